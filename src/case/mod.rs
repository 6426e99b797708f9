//! The case: what the user asked for, checked, in one consistent set of units, names resolved.
//!
//! [`read`] turns a case file (TOML), an optional variant and `--set` changes into a [`Case`]: plain data,
//! from which every other module takes its own piece. Nothing downstream sees TOML.
mod alternation;
mod body;
mod contact;
mod edit;
mod exact;
mod expression;
mod fingerprint;
mod grading;
mod material;
mod nearest;
mod node;
mod read;
mod reader;
mod reference;
mod rigid;
mod schema;
mod shape;
mod step;
mod study;
mod temperature_file;
mod transform;
mod units;

pub use alternation::{AlternationCase, Driver, Tolerance, Transfer, Weights};
pub use exact::{ClosedForm, ExactCase, ExactProbe, HertzLoad};
pub use expression::Expression;
pub use read::{read, variant_names};
pub use reference::reference;
pub use rigid::{RigidCase, RigidShape};
pub use step::StepCase;
pub use study::StudyCase;

use crate::error::Error;

/// Where a value was written: `cases/x/case.toml:12: body.lower.support.0.surface`.
///
/// Kept by every item that can only be checked against the mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Origin {
    /// Path of the file, or `--set` / `variant "C"`.
    pub file: String,
    /// 1-based line; 0 where there is none (`--set`).
    pub line: usize,
    /// Full key.
    pub key: String,
}

impl Origin {
    /// An input error at this place.
    pub fn error(&self, message: impl std::fmt::Display) -> Error {
        Error::Input(format!("{self}: {message}"))
    }
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.file, self.key),
            line => write!(f, "{}:{line}: {}", self.file, self.key),
        }
    }
}

/// A whole case.
#[derive(Debug, Clone)]
pub struct Case {
    /// Directory name, or file stem; names the results directory.
    pub name: String,
    /// Title for pictures and the log; the name if none is given.
    pub title: String,
    /// Variant that was applied, if any.
    pub variant: Option<String>,
    /// The case as run: the file's text, then the variant and the `--set` changes as comment lines.
    pub text: String,
    /// Units of the numbers.
    pub units: Units,
    /// Plane stress or plane strain, with the thickness.
    pub analysis: Analysis,
    /// The deformable bodies, in file order.
    pub bodies: Vec<BodyCase>,
    /// The rigid bodies, in file order.
    pub rigid: Vec<RigidCase>,
    /// The contact pairs, in file order.
    pub contacts: Vec<ContactCase>,
    /// How the bodies are brought to agree.
    pub alternation: AlternationCase,
    /// The load steps, in file order; empty: one step with everything as written.
    pub steps: Vec<StepCase>,
    /// Named points to report.
    pub probes: Vec<ProbeCase>,
    /// What to draw.
    pub output: OutputCase,
    /// What a study varies.
    pub study: StudyCase,
    /// What is known of the solution, if anything is.
    pub exact: Option<ExactCase>,
    /// Stands for all that a run depends on, files included: the same number, the same run.
    pub fingerprint: u64,
}

impl Case {
    /// Number of contact pairs that a body is in.
    pub fn pairs_of(&self, body: BodyRef) -> usize {
        self.contacts.iter().filter(|c| c.surfaces.iter().any(|s| s.body == body)).count()
    }

    /// Name of a body.
    pub fn body_name(&self, body: BodyRef) -> &str {
        match body {
            BodyRef::Deformable(i) => &self.bodies[i].name,
            BodyRef::Rigid(i) => &self.rigid[i].name,
        }
    }
}

/// Which units the case's numbers are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Units {
    /// m, N, Pa, K; strings with a unit are converted.
    Si,
    /// The user's own consistent set; strings with a unit are refused, and nothing is labelled.
    Consistent,
}

/// The two-dimensional idealisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Analysis {
    /// sigma_zz = 0.
    PlaneStress {
        /// Thickness, m.
        thickness: f64,
    },
    /// eps_zz = 0.
    PlaneStrain {
        /// Thickness, m.
        thickness: f64,
    },
}

impl Analysis {
    /// Thickness of the slice, m.
    pub fn thickness(self) -> f64 {
        match self {
            Analysis::PlaneStress { thickness } | Analysis::PlaneStrain { thickness } => thickness,
        }
    }
}

/// One deformable body.
#[derive(Debug, Clone)]
pub struct BodyCase {
    /// Name; letters, digits, `_` and `-`.
    pub name: String,
    /// Where its mesh comes from.
    pub geometry: Geometry,
    /// Cells of it to cut into four, then cells of the finer mesh, and so on: what adaptive refinement adds. None in a
    /// case as read.
    pub cuts: Vec<Vec<u32>>,
    /// Element formulation; `None` means each element kind's default.
    pub formulation: Option<Formulation>,
    /// Its material.
    pub material: MaterialCase,
    /// Prescribed displacements.
    pub supports: Vec<Support>,
    /// Loads.
    pub loads: Vec<Load>,
    /// Temperature, K; `None`: the scene has no heat in this body.
    pub temperature: Option<Temperature>,
    /// PETSc options for this body's solver, without the prefix (`-ksp_type cg -pc_type gamg`).
    pub solver: Option<String>,
    /// How it answers forces and displacements on its contact surfaces.
    pub response: ResponseCase,
    /// How often every cell of its mesh is cut into four; the geometry is what comes of it.
    pub refine: usize,
    /// Where the body is written.
    pub origin: Origin,
}

/// How an element turns displacements into strains. What is not named is the plain displacement element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Formulation {
    /// Displacement element, full integration.
    Standard,
    /// quad4 with enhanced assumed strains (Simo-Rifai / Taylor, 4 parameters): its default.
    Enhanced,
    /// quad8 with 2 x 2 points: its default.
    Reduced,
}

/// How a body answers on its contact surfaces. All give the same answer, at another cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResponseCase {
    /// Whichever a cost estimate finds cheaper.
    Automatic,
    /// By dense algebra on its interface (Schur complement), made once with the factorisation.
    Condensed,
    /// By a solve of the whole body for each step.
    Solver,
}

/// Source of a mesh.
#[derive(Debug, Clone)]
pub enum Geometry {
    /// A Gmsh file, path resolved against the case file.
    Gmsh {
        /// Path of the `.msh` file.
        file: std::path::PathBuf,
        /// Name of the physical group (of the highest dimension) that is the body; `None`: all cells.
        group: Option<String>,
        /// Factor on all coordinates (a mesh in mm in an SI case: 1e-3).
        scale: f64,
        /// How often every cell is cut into four.
        refine: usize,
        /// Where it is written.
        origin: Origin,
    },
    /// A built-in generator.
    Generated {
        /// The shape.
        shape: Shape,
        /// The element kind.
        element: crate::element::ElementKind,
        /// Rotation about the origin, radians, counter-clockwise, applied before the translation.
        rotate: f64,
        /// Translation, m.
        translate: [f64; 2],
        /// Where it is written.
        origin: Origin,
    },
}

/// Subdivision of one direction of a structured mesh: strictly increasing relative or absolute positions of
/// the cell boundaries (corner nodes), first to last.
#[derive(Debug, Clone, PartialEq)]
pub struct Grading {
    /// Positions of the corner nodes, increasing. For a rectangle they are coordinates in m, for a block or the
    /// directions of a ring or half disc as the variant of [`Shape`] says.
    pub at: Vec<f64>,
}

/// Built-in geometries. All elements are counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Axis-parallel rectangle; surfaces `left`, `right`, `bottom`, `top`.
    Rectangle {
        /// x of the corner nodes, m.
        x: Grading,
        /// y of the corner nodes, m.
        y: Grading,
    },
    /// Four corners (bottom-left, bottom-right, top-right, top-left), mapped by a Coons patch; an edge is straight or
    /// a circular arc. Surfaces `left`, `right`, `bottom`, `top`.
    Block {
        /// The corners, counter-clockwise from bottom-left, m.
        corners: [[f64; 2]; 4],
        /// Centre of the arc of `bottom`, `right`, `top`, `left` where it is one, m.
        arcs: [Option<[f64; 2]>; 4],
        /// Along bottom and top: 0 to 1 (fraction of the x extent on an arc edge is NOT used: fraction of arc length).
        u: Grading,
        /// From bottom to top: 0 to 1.
        v: Grading,
    },
    /// Ring sector; surfaces `inner`, `outer`, `start`, `end` (the last two absent on a full ring).
    Ring {
        /// Centre, m.
        center: [f64; 2],
        /// Radii of the corner nodes, m.
        radius: Grading,
        /// Angles of the corner nodes, radians, counter-clockwise from x.
        angle: Grading,
    },
    /// Half disc below (or above) its mid-plane: a core block and three outer blocks; surfaces `flat` (the mid-plane) and `arc`.
    HalfDisc {
        /// Centre of the mid-plane, m.
        center: [f64; 2],
        /// Radius, m.
        radius: f64,
        /// True: the arc points up (y >= center), false: down.
        up: bool,
        /// Along the arc: angle from the arc's lowest (highest) point, radians, over the middle block, symmetric
        /// about 0, strictly inside (-pi/2, pi/2).
        angle: Grading,
        /// From the arc inwards: depth below the arc as a fraction of the radius, 0 first, last < 1.
        depth: Grading,
        /// Cells of the core between mid-plane and outer block.
        core: usize,
    },
    /// Full disc: a square core and four outer blocks; surface `arc`.
    Disc {
        /// Centre, m.
        center: [f64; 2],
        /// Radius, m.
        radius: f64,
        /// Cells along each quarter of the rim.
        quarter: usize,
        /// From the rim inwards: depth as a fraction of the radius, 0 first, last < 1.
        depth: Grading,
    },
}

/// A number, or an expression of the coordinates `x`, `y` (and `z`).
#[derive(Debug, Clone)]
pub enum Scalar {
    /// The same everywhere.
    Constant(f64),
    /// Evaluated at each point.
    Expression(Expression),
}

impl Scalar {
    /// Value at a point.
    pub fn at(&self, x: &[f64; 3]) -> f64 {
        match self {
            Scalar::Constant(value) => *value,
            Scalar::Expression(e) => e.at(x),
        }
    }
}

/// Temperature field of a body, K.
#[derive(Debug, Clone)]
pub enum Temperature {
    /// Constant or expression.
    Field(Scalar),
    /// Nodal values by coordinates, from a CSV file with the columns x, y, temperature.
    Nodal {
        /// Node coordinates and temperature.
        values: Vec<([f64; 3], f64)>,
        /// Where it is written.
        origin: Origin,
    },
}

/// Where a support or load acts.
#[derive(Debug, Clone)]
pub enum Region {
    /// A named surface, or the part of it inside a box.
    Surface {
        /// Name of the surface.
        name: String,
        /// Lower and upper corner; infinite where not given. A facet belongs if all its nodes do.
        within: Option<[[f64; 3]; 2]>,
    },
    /// The node at this point.
    Point([f64; 3]),
}

/// Prescribed displacement.
#[derive(Debug, Clone)]
pub struct Support {
    /// Where.
    pub region: Region,
    /// Displacement per direction of the frame, m; `None`: free.
    pub displacement: [Option<Scalar>; 3],
    /// Angle of the frame's first direction to x, radians.
    pub angle: f64,
    /// Where it is written.
    pub origin: Origin,
}

/// A load.
#[derive(Debug, Clone)]
pub struct Load {
    /// What acts.
    pub kind: LoadKind,
    /// Where it is written.
    pub origin: Origin,
}

/// Kinds of load.
#[derive(Debug, Clone)]
pub enum LoadKind {
    /// Traction vector on a surface, Pa.
    Traction(Region, [Scalar; 3]),
    /// Pressure on a surface, Pa, positive inwards.
    Pressure(Region, Scalar),
    /// Resultant force, N: spread evenly over a surface, or at a point.
    Force(Region, [f64; 3]),
    /// Force per volume, N/m3.
    BodyForce([Scalar; 3]),
}

/// Material data. A table holds piecewise linear values over temperature, constant beyond its ends.
#[derive(Debug, Clone)]
pub struct MaterialCase {
    /// Name, for messages.
    pub name: String,
    /// Young's modulus, Pa.
    pub young: Property,
    /// Poisson's ratio.
    pub poisson: Property,
    /// Mean coefficient of expansion from the reference temperature, 1/K; `None` where no body with this material is heated.
    pub expansion: Option<Property>,
    /// Reference temperature, K.
    pub reference_temperature: f64,
}

/// A property: constant, or a table over temperature.
#[derive(Debug, Clone, PartialEq)]
pub enum Property {
    /// The same at every temperature.
    Constant(f64),
    /// (temperature K, value), temperatures strictly increasing, at least two rows.
    Table(Vec<(f64, f64)>),
}

impl Property {
    /// Value at a temperature, K: linear between rows, constant beyond the ends.
    pub fn at(&self, temperature: f64) -> f64 {
        match self {
            Property::Constant(value) => *value,
            Property::Table(rows) => {
                let i = rows.partition_point(|row| row.0 <= temperature);
                match (i, rows.len()) {
                    (0, _) => rows[0].1,
                    (i, n) if i == n => rows[n - 1].1,
                    (i, _) => {
                        let ((t0, v0), (t1, v1)) = (rows[i - 1], rows[i]);
                        v0 + (v1 - v0) * (temperature - t0) / (t1 - t0)
                    }
                }
            }
        }
    }

    /// True if it varies with temperature.
    pub fn is_table(&self) -> bool {
        matches!(self, Property::Table(_))
    }
}

/// A contact pair; `surfaces[0]` is side A.
#[derive(Debug, Clone)]
pub struct ContactCase {
    /// Name; by default `A.surface-B.surface`.
    pub name: String,
    /// The two surfaces.
    pub surfaces: [SurfaceName; 2],
    /// Initial gap.
    pub gap: Gap,
    /// Nodes further apart than this are no candidates, m; `None`: chosen from the surfaces' size.
    pub search_distance: Option<f64>,
    /// How conjugate points are found; [`Transfer::Pointwise`] only.
    pub conjugate: Conjugate,
    /// Which configuration normals and gap are taken in.
    pub geometry: ContactGeometry,
    /// Where it is written.
    pub origin: Origin,
}

/// A surface of a body.
#[derive(Debug, Clone)]
pub struct SurfaceName {
    /// The body.
    pub body: BodyRef,
    /// Surface name; on a deformable body checked against the mesh later.
    pub surface: String,
    /// Only the part inside this box.
    pub within: Option<[[f64; 3]; 2]>,
}

/// A body of the case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyRef {
    /// Index into [`Case::bodies`].
    Deformable(usize),
    /// Index into [`Case::rigid`].
    Rigid(usize),
}

impl BodyRef {
    /// Index into [`Case::bodies`], unless the body is rigid.
    pub fn deformable(self) -> Option<usize> {
        match self {
            BodyRef::Deformable(i) => Some(i),
            BodyRef::Rigid(_) => None,
        }
    }
}

/// Configuration that normals and gap of a pair are taken in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactGeometry {
    /// The undeformed one: right where displacements are small against the radii of the surfaces.
    Initial,
    /// The deformed one, brought up to date as the bodies move.
    Updated,
}

/// Initial gap of a pair, m; negative is interference.
#[derive(Debug, Clone, PartialEq)]
pub enum Gap {
    /// From the geometry, plus an offset.
    Geometry {
        /// Added to the geometric gap.
        offset: f64,
    },
    /// This value at every node, whatever the geometry.
    Value(f64),
}

/// How the conjugate point of a contact node is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conjugate {
    /// Closest point of the other surface.
    ClosestPoint,
    /// The paper's rule: where the line through the node along its normal meets the other surface.
    Intersection,
}

/// A point to report.
#[derive(Debug, Clone)]
pub struct ProbeCase {
    /// Name.
    pub name: String,
    /// Index into [`Case::bodies`].
    pub body: usize,
    /// Undeformed position, m.
    pub at: [f64; 3],
    /// Where it is written.
    pub origin: Origin,
}

/// What to draw and write.
#[derive(Debug, Clone)]
pub struct OutputCase {
    /// Stress component that colours the deformed bodies.
    pub component: StressComponent,
    /// Magnification of the displacements in the picture; `None`: chosen.
    pub magnification: Option<f64>,
    /// Region to draw (lower, upper corner); `None`: everything.
    pub window: Option<[[f64; 2]; 2]>,
}

/// A stress component or invariant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum StressComponent {
    Xx,
    Yy,
    Zz,
    Xy,
    VonMises,
}
