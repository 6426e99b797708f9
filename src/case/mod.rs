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
mod insert;
mod material;
mod nearest;
mod node;
mod path;
mod plasticity;
mod property;
mod read;
mod reader;
mod reference;
mod rigid;
mod schema;
mod shape;
mod solver_options;
mod step;
mod study;
mod temperature_file;
mod transform;
mod units;
mod within;

pub use alternation::{AlternationCase, Driver, Tolerance, Transfer};
pub use exact::{ClosedForm, ExactCase, ExactProbe, HertzLoad};
pub use expression::Expression;
pub use path::{PathCase, PathTable};
pub use read::{read, variant_names};
pub use reference::reference;
pub use rigid::{RigidCase, RigidShape};
pub use step::{Increments, StepCase};
pub use study::{QUANTITIES_OF_PAIR, QUANTITIES_OF_PROBE, STRAIN_ENERGY, StudyCase};

// Choices that belong to the module that acts on them.
pub use crate::{
    contact::{ConjugateRule, Gap, Law},
    element::Formulation,
    material::{Analysis, MaterialCase, Property, Tangent, Theory},
    mesh::{Grading, Shape},
    schwarz::weights::Weights,
};

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
    /// The load paths, by name.
    pub paths: Vec<PathCase>,
    /// The load steps, in file order; empty: one step with everything as written.
    pub steps: Vec<StepCase>,
    /// Named points to report.
    pub probes: Vec<ProbeCase>,
    /// What to draw.
    pub output: OutputCase,
    /// How bodies that yield are computed.
    pub plasticity: PlasticityCase,
    /// What a study varies.
    pub study: StudyCase,
    /// What is known of the solution, if anything is.
    pub exact: Option<ExactCase>,
    /// Stands for all that a run depends on, files included: the same number, the same run.
    pub fingerprint: u64,
}

impl Case {
    /// True if a pair has tangential forces.
    pub fn has_friction(&self) -> bool {
        self.contacts.iter().any(|contact| contact.law.is_frictional())
    }

    /// True if a body has a material that yields.
    pub fn has_plasticity(&self) -> bool {
        self.bodies.iter().any(BodyCase::yields)
    }

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
    /// Its material, where no insert is.
    pub material: MaterialCase,
    /// Parts of other materials: where two overlap, the later one counts.
    pub inserts: Vec<Insert>,
    /// Prescribed displacements.
    pub supports: Vec<Support>,
    /// Loads.
    pub loads: Vec<Load>,
    /// Temperature, K; `None`: the scene has no heat in this body.
    pub temperature: Option<Temperature>,
    /// Path that the temperature follows: an index into [`Case::paths`]; `None`: the general factor.
    pub temperature_path: Option<usize>,
    /// PETSc options for this body's solver, without the prefix (`-ksp_type cg -pc_type gamg`).
    pub solver: Option<String>,
    /// How it answers forces and displacements on its contact surfaces.
    pub response: ResponseCase,
    /// How often every cell of its mesh is cut into four; the geometry is what comes of it.
    pub refine: usize,
    /// Where the body is written.
    pub origin: Origin,
}

impl BodyCase {
    /// Its materials: that of the body, then those of its inserts, as [`Cell::material`](crate::mesh::Cell) counts them.
    pub fn materials(&self) -> impl Iterator<Item = &MaterialCase> {
        std::iter::once(&self.material).chain(self.inserts.iter().map(|insert| &insert.material))
    }

    /// True if one of its materials yields.
    pub fn yields(&self) -> bool {
        self.materials().any(|material| material.plasticity.is_some())
    }
}

/// A part of a body that is of another material.
#[derive(Debug, Clone)]
pub struct Insert {
    /// Which cells.
    pub cells: InsertCells,
    /// Its material.
    pub material: MaterialCase,
    /// Where it is written.
    pub origin: Origin,
}

/// Cells of an insert.
#[derive(Debug, Clone, PartialEq)]
pub enum InsertCells {
    /// Those of a physical group of the mesh.
    Group(String),
    /// Those whose centre lies in a box, m.
    Within([[f64; 3]; 2]),
}

/// `[plasticity]`: how bodies that yield are computed.
#[derive(Debug, Clone, PartialEq)]
pub struct PlasticityCase {
    /// What plastic strains follow.
    pub theory: Theory,
    /// The stiffness of an iteration.
    pub tangent: Tangent,
    /// Residual of an increment, relative to the forces, from which on it is solved.
    pub tolerance: f64,
    /// Iterations after which an increment is given up.
    pub max_iterations: usize,
    /// Whether only the part of a body that yields is iterated.
    pub zone: ZoneCase,
}

impl Default for PlasticityCase {
    fn default() -> Self {
        PlasticityCase {
            theory: Theory::Flow,
            tangent: Tangent::Consistent,
            tolerance: 1e-9,
            max_iterations: 25,
            zone: ZoneCase::Automatic,
        }
    }
}

/// Whether what stays elastic in a body that yields is condensed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ZoneCase {
    /// If a cost estimate finds it cheaper.
    #[default]
    Automatic,
    /// Wherever it is possible.
    Always,
    /// Nowhere.
    Never,
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
        /// Names of the physical groups (of the highest dimension) that are the body; empty: all cells.
        groups: Vec<String>,
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
    /// Path that it follows: an index into [`Case::paths`]; `None`: the general factor.
    pub path: Option<usize>,
    /// Where it is written.
    pub origin: Origin,
}

/// A load.
#[derive(Debug, Clone)]
pub struct Load {
    /// What acts.
    pub kind: LoadKind,
    /// Path that it follows: an index into [`Case::paths`]; `None`: the general factor.
    pub path: Option<usize>,
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
    pub conjugate: ConjugateRule,
    /// Which configuration normals and gap are taken in.
    pub geometry: ContactGeometry,
    /// What the surfaces do tangentially.
    pub law: Law,
    /// The number of the law as a table over temperature, of which the law then has the largest.
    pub over_temperature: Option<Property>,
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
    /// What colours the deformed bodies.
    pub shown: Shown,
    /// Magnification of the displacements in the picture; `None`: chosen.
    pub magnification: Option<f64>,
    /// Region to draw (lower, upper corner); `None`: everything.
    pub window: Option<[[f64; 2]; 2]>,
    /// Whether the error is estimated for every load step, not only for the last.
    pub every_estimate: bool,
}

/// What the picture of the bodies shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// A stress.
    Stress(StressComponent),
    /// The equivalent plastic strain.
    PlasticStrain,
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
