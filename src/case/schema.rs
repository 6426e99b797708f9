//! Every key of the case file: the one list from which unknown keys are refused, dimensions checked, and
//! `docs/case-file.md` written.
mod plasticity;
mod study;

use super::units::Dimension;

/// A table of the case file.
pub(super) struct Table {
    /// Name here and in [`Kind`], such as `body.support`.
    pub name: &'static str,
    /// Heading in the reference page.
    pub heading: &'static str,
    /// Text below the heading.
    pub about: &'static str,
    pub keys: &'static [Key],
}

/// A key of a table.
pub(super) struct Key {
    pub name: &'static str,
    pub kind: Kind,
    pub default: Default,
    pub meaning: &'static str,
}

/// What holds if the key is absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Default {
    /// The key must be given.
    Required,
    /// Nothing: the effect is not there, or the other keys say it.
    Absent,
    /// This, as the reference page says it.
    Is(&'static str),
}

/// What a key takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// A string.
    Text,
    /// A string of letters, digits, `_`, `-`.
    Name,
    /// An array of strings.
    Texts,
    /// One of these strings.
    Choice(&'static [&'static str]),
    /// `true` or `false`.
    Flag,
    /// A positive integer.
    Count,
    /// An integer, 0 or more.
    Natural,
    /// A number, or a string with a unit.
    Number(Dimension),
    /// A number, a string with a unit, or an expression of x, y, z.
    Scalar(Dimension),
    /// A number, or a table over temperature.
    Property(Dimension),
    /// An array of numbers.
    Numbers(Dimension),
    /// `[x, y]`.
    Point(Dimension),
    /// An array of `[x, y]`.
    Points(Dimension),
    /// `[x, y]` of scalars.
    Vector(Dimension),
    /// A table of the schema.
    Table(&'static str),
    /// An array of such tables.
    Tables(&'static str),
    /// A table of such tables, each with a name of the user's.
    Named(&'static str),
    /// Any table: keys are paths.
    Changes,
    /// Several forms, in these words; numbers in it have this dimension.
    Either(&'static str, Dimension),
}

/// The table of that name.
pub(super) fn table(name: &str) -> Option<&'static Table> {
    TABLES.iter().find(|table| table.name == name)
}

const REQUIRED: Default = Default::Required;
const ABSENT: Default = Default::Absent;
const fn is(text: &'static str) -> Default {
    Default::Is(text)
}
const fn key(name: &'static str, kind: Kind, default: Default, meaning: &'static str) -> Key {
    Key { name, kind, default, meaning }
}

use Dimension as D;
use Kind::*;

/// Names of the element kinds that generated meshes can have.
pub(super) const ELEMENTS: &[&str] = &["tri3", "tri6", "quad4", "quad8"];
/// How bodies may answer on their contact surfaces.
pub(super) const RESPONSES: &[&str] = &["automatic", "condensed", "solver"];
/// The drivers.
pub(super) const DRIVERS: &[&str] = &["active set", "relaxed"];
/// The transfers.
pub(super) const TRANSFERS: &[&str] = &["mortar", "pointwise"];
const PATH: &str = "Name of a [load path](#pathname), whose factor it has in place of the general one.";
const WITHIN: &str = "Only the part of the surface inside this box (a facet belongs if all its nodes do).";

/// All tables, in the order of the reference page.
pub(super) const TABLES: &[Table] = &[
    Table {
        name: "case",
        heading: "Top level",
        about: "",
        keys: &[
            key(
                "title",
                Text,
                is("the case's name"),
                "Title for pictures and the log: one line, at most 200 characters, none of them a control.",
            ),
            key(
                "units",
                Choice(&["SI", "consistent"]),
                is("\"SI\""),
                "Units of plain numbers; see [Units](#units).",
            ),
            key(
                "analysis",
                Choice(&["plane stress", "plane strain"]),
                REQUIRED,
                "The two-dimensional idealisation.",
            ),
            key(
                "thickness",
                Number(D::LENGTH),
                is("1"),
                "Thickness of the slice; forces are for this thickness.",
            ),
            key("material", Named("material"), ABSENT, "Materials, each under a name: `[material.steel]`."),
            key("body", Tables("body"), REQUIRED, "The bodies, at least one of them deformable."),
            key(
                "contact",
                Tables("contact"),
                ABSENT,
                "The contact pairs. None: one ordinary solve per body.",
            ),
            key("alternation", Table("alternation"), ABSENT, "How the bodies are brought to agree."),
            key(
                "step",
                Tables("step"),
                is("one, with everything as written"),
                "Load steps, one after the other.",
            ),
            key(
                "path",
                Named("path"),
                ABSENT,
                "Factors over a path parameter, each under a name: `[path.preload]`.",
            ),
            key("plasticity", Table("plasticity"), ABSENT, "How bodies that yield are computed."),
            key("probe", Tables("probe"), ABSENT, "Points to report."),
            key("output", Table("output"), ABSENT, "What to draw."),
            key("exact", Table("exact"), ABSENT, "What is known of the solution, for `kontakt study`."),
            key("study", Table("study"), ABSENT, "What `kontakt study` varies."),
            key("variant", Tables("variant"), ABSENT, "Named changes; see [Variants](#variants)."),
        ],
    },
    Table {
        name: "material",
        heading: "`[material.NAME]`",
        about: "Isotropic, linear elastic up to where it yields, if it does. A *property* is a number, a string with a unit, or a table over \
temperature, `{ temperature = [293, 373], value = [214e9, 211e9] }`: linear between its rows, constant \
beyond its \
ends. A body whose material has such a table needs a `temperature`; a body with a `temperature` needs \
`expansion`, \
unless a table says what else the temperature is for. Thermal strain is \
`expansion(T) * (T - reference_temperature)`.",
        keys: &[
            key("young", Property(D::PRESSURE), REQUIRED, "Young's modulus; > 0."),
            key("poisson", Property(D::NUMBER), REQUIRED, "Poisson's ratio; in (-1, 0.5)."),
            key(
                "expansion",
                Property(D::EXPANSION),
                ABSENT,
                "Mean coefficient of thermal expansion, from the \
reference temperature to the temperature it is tabulated at.",
            ),
            key(
                "reference_temperature",
                Number(D::TEMPERATURE),
                ABSENT,
                "Temperature without thermal strain; \
required with `expansion`.",
            ),
            key("plasticity", Table("material.plasticity"), ABSENT, "How it yields."),
        ],
    },
    plasticity::MATERIAL_PLASTICITY,
    plasticity::CURVE,
    plasticity::CURVES,
    plasticity::RAMBERG_OSGOOD,
    plasticity::POWER,
    plasticity::KINEMATIC,
    Table {
        name: "material reference",
        heading: "A material from a file",
        about: "In place of a name, `material` of a body can hold the keys of a material itself, or point \
to a file \
of `[material.NAME]` tables: `material = { file = \"materials.toml\", name = \"40Kh\" }`. Plain numbers \
there are in \
the units of the case. `cases/materials.toml` has steels and alloys that engineers use, in SI units.",
        keys: &[
            key("file", Text, REQUIRED, "Path of the file, from the case file's directory."),
            key("name", Text, REQUIRED, "Name of the material in it."),
        ],
    },
    Table {
        name: "material file",
        heading: "",
        about: "",
        keys: &[key(
            "material",
            Named("material"),
            REQUIRED,
            "Materials, each under a name: `[material.steel]`.",
        )],
    },
    Table {
        name: "property",
        heading: "",
        about: "",
        keys: &[
            key("temperature", Numbers(D::TEMPERATURE), REQUIRED, "Temperatures, increasing; at least two."),
            // The values have the dimension of the property that the table stands for.
            key("value", Either("array of numbers", D::NUMBER), REQUIRED, "The property at each of them."),
        ],
    },
    Table {
        name: "body",
        heading: "`[[body]]`",
        about: "Formulations: `standard` is the displacement element, for every kind. quad4 takes `enhanced` \
(enhanced assumed strains, four parameters) and has it by default: the standard quad4 locks in bending and \
near \
incompressibility, the enhanced one does in neither. quad8 takes `reduced` (2 x 2 points) and has it by \
default: it \
does not lock near incompressibility, its stresses are superconvergent at these points, and its one \
zero-energy \
mode cannot spread from element to element. tri6 takes `enhanced` (a bubble, and a dilatation linear in the \
element) and has it by default in plane strain at a Poisson's ratio above 0.45, where the standard one's \
pressures oscillate. In plane strain above 0.45 formulations that lock are refused: tri3 has no other, quad4, \
quad8 and tri6 have their defaults. A material with a table counts by its largest value. An enhanced tri6 takes no \
`body_force`.\n\nSolver: by default a sparse Cholesky factorisation (L D L^T) \
by MUMPS, \
made once and used again while the matrix does not change: the fastest set-up there is in two dimensions, \
and one \
that no material contrast or mesh grading upsets. `solver = \"-ksp_type cg -pc_type gamg\"` changes it for \
this body, \
with PETSc's own option names; `-body_<name>_ksp_type cg` does on the command line. A case may give the options that choose \
and tune a solver (`-ksp_...`, `-pc_...`, `-mat_mumps_...`, also of the solvers inside a preconditioner, `-sub_...`, \
`-mg_levels_...`); viewers, monitors and whatever else may write a file or load code are refused by name, so that a case \
from anybody is safe to run; `.petscrc` files are not read. The command line takes them all.\n\n\
A body with `rigid` is a rigid one: it has a `name` and [`rigid`](#rigid) and none of the other keys.",
        keys: &[
            key("name", Name, REQUIRED, "Name, unique among the bodies."),
            key(
                "material",
                Either("name, [table](#materialname) or [reference](#a-material-from-a-file)", D::NUMBER),
                REQUIRED,
                "Its material, where no [insert](#bodyinsert) is; not with `rigid`.",
            ),
            key("mesh", Table("mesh"), REQUIRED, "Where its mesh comes from; not with `rigid`."),
            key(
                "element",
                Choice(ELEMENTS),
                is("\"quad4\""),
                "Element kind of a generated mesh; not with a mesh \
file, which has its own.",
            ),
            key(
                "formulation",
                Choice(&["standard", "enhanced", "reduced"]),
                is(
                    "quad4 `enhanced`, quad8 `reduced`, triangles `standard`, nearly incompressible tri6 `enhanced`",
                ),
                "How strains follow from displacements.",
            ),
            key(
                "temperature",
                Either("scalar or [table](#temperature)", D::TEMPERATURE),
                ABSENT,
                "Temperature \
field. Absent: no heat in this body.",
            ),
            key("insert", Tables("body.insert"), ABSENT, "Parts of other materials."),
            key("support", Tables("body.support"), ABSENT, "Prescribed displacements."),
            key("load", Tables("body.load"), ABSENT, "Loads."),
            key(
                "solver",
                Text,
                is("MUMPS Cholesky"),
                "PETSc options for this body's equations, without prefix.",
            ),
            key(
                "response",
                Choice(RESPONSES),
                is("\"automatic\""),
                "How it answers on its contact surfaces: by dense algebra on its interface, made once (`condensed`), \
by a solve of the whole body each time (`solver`), or whichever a cost estimate finds cheaper. The answer is the \
same.",
            ),
            key(
                "rigid",
                Table("rigid"),
                ABSENT,
                "Makes the body rigid; in place of all the other keys but `name`.",
            ),
        ],
    },
    plasticity::INSERT,
    Table {
        name: "rigid",
        heading: "`rigid`",
        about: "A body without mesh, material and unknowns, in contact only with deformable bodies. Exactly one of \
`plane`, `circle`, `polyline`. Its only surface is called `surface`: `surfaces = [\"punch.bottom\", \
\"anvil.surface\"]`. Its outward side is where the bodies are that it may touch. Only with `driver = \"active set\"`.",
        keys: &[
            key("plane", Table("rigid.plane"), ABSENT, "A straight line without ends."),
            key("circle", Table("rigid.circle"), ABSENT, "A disc, or a bore."),
            key("polyline", Table("rigid.polyline"), ABSENT, "A chain of segments."),
            key("x", Number(D::LENGTH), is("0"), "Prescribed motion along x."),
            key("y", Number(D::LENGTH), is("0"), "Prescribed motion along y."),
            key("path", Name, is("the factor `supports`"), PATH),
        ],
    },
    Table {
        name: "rigid.plane",
        heading: "`rigid.plane`",
        about: "",
        keys: &[
            key("through", Point(D::LENGTH), REQUIRED, "A point on it."),
            key("normal", Point(D::NUMBER), REQUIRED, "Outward normal, of any length > 0."),
        ],
    },
    Table {
        name: "rigid.circle",
        heading: "`rigid.circle`",
        about: "",
        keys: &[
            key("center", Point(D::LENGTH), REQUIRED, "Centre."),
            key("radius", Number(D::LENGTH), REQUIRED, "Radius; > 0."),
            key("inside", Flag, is("false"), "`true`: a bore, which other bodies touch from within."),
        ],
    },
    Table {
        name: "rigid.polyline",
        heading: "`rigid.polyline`",
        about: "",
        keys: &[key(
            "points",
            Points(D::LENGTH),
            REQUIRED,
            "The corners, at least two; the body lies to the left of the direction of travel, outward is to the right.",
        )],
    },
    Table {
        name: "temperature",
        heading: "`temperature`",
        about: "A temperature from a file, or one that follows a load path: `temperature = { value = 400, path = \"heating\" }`. \
Exactly one of `file` and `value`. The file has nodal values as text with commas between its columns and the header line \
`x,y,temperature`, in the units of the case, one line for each node.",
        keys: &[
            key("file", Text, ABSENT, "Path of the CSV file, from the case file's directory."),
            key("value", Scalar(D::TEMPERATURE), ABSENT, "The temperature."),
            key("path", Name, is("the factor `temperature`"), PATH),
        ],
    },
    Table {
        name: "body.support",
        heading: "`[[body.support]]`",
        about: "Prescribes one or both displacement components on a surface, a part of it, or the node at a \
point. \
What is not named is free. With `angle`, `x` and `y` are the components along the turned axes.",
        keys: &[
            key("surface", Text, ABSENT, "Name of a surface of this body. This or `point`."),
            key("point", Point(D::LENGTH), ABSENT, "Position of a node. This or `surface`."),
            key("within", Table("within"), ABSENT, WITHIN),
            key("x", Scalar(D::LENGTH), is("free"), "Displacement along the first axis."),
            key("y", Scalar(D::LENGTH), is("free"), "Displacement along the second axis."),
            key("angle", Number(D::ANGLE), is("0"), "From the x axis to the first axis, counter-clockwise."),
            key("path", Name, is("the factor `supports`"), PATH),
        ],
    },
    Table {
        name: "body.load",
        heading: "`[[body.load]]`",
        about: "One of `pressure`, `traction`, `force`, `body_force`. The first three act on a `surface`; a \
`force` \
may act at a `point` instead; a `body_force` acts everywhere.",
        keys: &[
            key("surface", Text, ABSENT, "Name of a surface of this body."),
            key("point", Point(D::LENGTH), ABSENT, "Position of a node, for a point force."),
            key("within", Table("within"), ABSENT, WITHIN),
            key("pressure", Scalar(D::PRESSURE), ABSENT, "Pressure, positive into the body."),
            key("traction", Vector(D::PRESSURE), ABSENT, "Force per area, along x and y."),
            key(
                "force",
                Point(D::FORCE),
                ABSENT,
                "Resultant along x and y, spread evenly over the surface, or \
at the point.",
            ),
            key("body_force", Vector(D::FORCE_PER_VOLUME), ABSENT, "Force per volume, along x and y."),
            key("path", Name, is("the factor `loads`"), PATH),
        ],
    },
    Table {
        name: "within",
        heading: "`within`",
        about: "A box with sides along x and y: `within = { x = [0, \"10 mm\"] }`. A direction not named is \
not limited.",
        keys: &[
            key("x", Numbers(D::LENGTH), ABSENT, "Lower and upper end."),
            key("y", Numbers(D::LENGTH), ABSENT, "Lower and upper end."),
        ],
    },
    Table {
        name: "mesh",
        heading: "`mesh`",
        about: "Exactly one source: a generated shape (`rectangle`, `block`, `ring`, `half_disc`, `disc`) \
or a Gmsh `file`. `mesh.rectangle = { ... }` and \
`mesh = { rectangle = { ... } }` are the same to TOML. A generated mesh is turned about the origin first \
and moved then; all other positions in the case (`point`, `within`, probes, expressions) are those of the \
mesh so placed.",
        keys: &[
            key("rectangle", Table("mesh.rectangle"), ABSENT, "Rectangle with sides along x and y."),
            key("block", Table("mesh.block"), ABSENT, "Four corners, edges straight or circular."),
            key("ring", Table("mesh.ring"), ABSENT, "Sector of a ring, or a whole ring."),
            key(
                "half_disc",
                Table("mesh.half_disc"),
                ABSENT,
                "Half disc, refined at its lowest (highest) point.",
            ),
            key("disc", Table("mesh.disc"), ABSENT, "Whole disc."),
            key(
                "file",
                Text,
                ABSENT,
                "Gmsh `.msh` file (4.1 or 2.2), path from the case file's directory. Physical \
groups name the bodies and surfaces.",
            ),
            key(
                "group",
                Either("string, or array of strings", D::NUMBER),
                is("all cells"),
                "With `file`: the physical group that is this body, or several that are it together: they share the nodes where \
they meet.",
            ),
            key(
                "scale",
                Number(D::NUMBER),
                is("1"),
                "With `file`: factor on its coordinates (mm in an SI case: 1e-3).",
            ),
            key(
                "refine",
                Natural,
                is("0"),
                "How often every cell is cut into four, nodes on the curved boundary (of a file's straight sides: on a \
smooth curve through its nodes; a turn of more than 40 degrees, or one that the neighbouring nodes do not have, is a corner and kept).",
            ),
            key(
                "rotate",
                Number(D::ANGLE),
                is("0"),
                "Generated shapes: rotation about the origin, counter-clockwise.",
            ),
            key(
                "translate",
                Point(D::LENGTH),
                is("[0, 0]"),
                "Generated shapes: translation, after the rotation.",
            ),
        ],
    },
    Table {
        name: "mesh.rectangle",
        heading: "`mesh.rectangle`",
        about: "Sides along x and y. Surfaces: `left`, `right`, `bottom`, `top`.",
        keys: &[
            key("x", Table("grading length"), REQUIRED, "[Grading](#grading) along x, in m."),
            key("y", Table("grading length"), REQUIRED, "Grading along y, in m."),
        ],
    },
    Table {
        name: "mesh.block",
        heading: "`mesh.block`",
        about: "Surfaces: `left`, `right`, `bottom`, `top`.",
        keys: &[
            key("corners", Points(D::LENGTH), REQUIRED, "Four points, counter-clockwise from bottom-left."),
            key("arcs", Table("arcs"), is("straight edges"), "Centres of the edges that are circular arcs."),
            key(
                "u",
                Table("grading number"),
                REQUIRED,
                "Grading along bottom and top, from 0 to 1 (on an arc: \
fraction of its length).",
            ),
            key("v", Table("grading number"), REQUIRED, "Grading from bottom to top, from 0 to 1."),
        ],
    },
    Table {
        name: "arcs",
        heading: "`mesh.block.arcs`",
        about: "The centre is equally far from both ends of the edge; the arc is the one shorter than a \
half circle.",
        keys: &[
            key("bottom", Point(D::LENGTH), is("straight"), "Centre of the bottom edge's arc."),
            key("right", Point(D::LENGTH), is("straight"), "Centre of the right edge's arc."),
            key("top", Point(D::LENGTH), is("straight"), "Centre of the top edge's arc."),
            key("left", Point(D::LENGTH), is("straight"), "Centre of the left edge's arc."),
        ],
    },
    Table {
        name: "mesh.ring",
        heading: "`mesh.ring`",
        about: "Surfaces: `inner`, `outer`, `start`, `end`; the last two are absent on a whole ring.",
        keys: &[
            key("center", Point(D::LENGTH), is("[0, 0]"), "Centre."),
            key(
                "radius",
                Table("grading length"),
                REQUIRED,
                "Grading of the radius, from the inner one (> 0), in m.",
            ),
            key(
                "angle",
                Table("grading angle"),
                REQUIRED,
                "Grading of the angle, counter-clockwise from x, at most a \
full turn, in degrees.",
            ),
        ],
    },
    Table {
        name: "mesh.half_disc",
        heading: "`mesh.half_disc`",
        about: "A core block and three blocks around it. Surfaces: `flat` (the mid-plane) and `arc`.",
        keys: &[
            key("center", Point(D::LENGTH), is("[0, 0]"), "Centre of the mid-plane."),
            key("radius", Number(D::LENGTH), REQUIRED, "Radius."),
            key("arc", Choice(&["up", "down"]), REQUIRED, "Where the arc is, seen from the mid-plane."),
            key(
                "angle",
                Table("grading angle"),
                REQUIRED,
                "Grading along the arc over the middle block: the angle from \
the arc's lowest (highest) point, symmetric about 0, inside (-90, 90), in degrees.",
            ),
            key(
                "depth",
                Table("grading number"),
                REQUIRED,
                "Grading from the arc (0) inwards, as a fraction of the \
radius, to less than 1.",
            ),
            key("core", Count, REQUIRED, "Cells between mid-plane and middle block."),
        ],
    },
    Table {
        name: "mesh.disc",
        heading: "`mesh.disc`",
        about: "A square core and four blocks around it. Surface: `arc`.",
        keys: &[
            key("center", Point(D::LENGTH), is("[0, 0]"), "Centre."),
            key("radius", Number(D::LENGTH), REQUIRED, "Radius."),
            key("quarter", Count, REQUIRED, "Cells along each quarter of the rim."),
            key(
                "depth",
                Table("grading number"),
                REQUIRED,
                "Grading from the rim (0) inwards, as a fraction of the \
radius, to less than 1.",
            ),
        ],
    },
    Table {
        name: "grading length",
        heading: "Grading",
        about: "Where the cells of a structured mesh end. Plain numbers are in m for `x`, `y` and `radius`, \
in degrees for \
`angle`, fractions for `u`, `v` and `depth`. Three forms:\n\n\
```toml\n\
x = { from = 0, to = 0.04, cells = 5 }\n\
x = { at = [-0.05, -0.01, 0.01, 0.05], cells = [12, 120, 12], ratio = [0.1, 1, 10] }\n\
x = { at = [-0.05, 0, 0.05], size = [\"5 mm\", \"0.1 mm\", \"5 mm\"] }\n\
```\n\n\
The last chooses the number of cells and their geometric progression so that the cells at the breakpoints \
have the sizes \
wanted, as nearly as a whole number of cells allows. Input that is symmetric about 0 gives positions that \
are, to the last bit.",
        keys: GRADING_LENGTH,
    },
    Table { name: "grading angle", heading: "", about: "", keys: GRADING_ANGLE },
    Table { name: "grading number", heading: "", about: "", keys: GRADING_NUMBER },
    Table {
        name: "contact",
        heading: "`[[contact]]`",
        about: "A pair of surfaces of two bodies. `surfaces[0]` is side A. The gap is positive \
where the \
surfaces are apart, negative where they overlap (interference).",
        keys: &[
            key("name", Name, is("A.surface-B.surface"), "Name, unique among the pairs."),
            key("surfaces", Texts, REQUIRED, "Two surfaces, `[\"upper.bottom\", \"lower.top\"]`."),
            key(
                "gap",
                Number(D::LENGTH),
                is("from the geometry"),
                "Initial gap, in place of the geometric one.",
            ),
            key("gap_offset", Number(D::LENGTH), is("0"), "Added to the geometric gap; not with `gap`."),
            key(
                "within",
                Table("within"),
                is("everywhere"),
                "Only the part of both surfaces inside this box.",
            ),
            key(
                "search_distance",
                Number(D::LENGTH),
                is("from the surfaces' size"),
                "Nodes further from the other \
surface are no candidates.",
            ),
            key(
                "conjugate",
                Choice(&["closest point", "intersection"]),
                is("\"closest point\""),
                "How the point \
opposite a node is found: closest-point projection, or the intersection of the node's normal with the other \
surface. Only with `transfer = \"pointwise\"`.",
            ),
            key(
                "law",
                Choice(&["frictionless", "coulomb", "tresca", "rough", "tied"]),
                is("\"coulomb\" with `friction`, else \"frictionless\""),
                "What the surfaces do tangentially. `coulomb`: they slip where the tangential traction reaches `friction` times the \
pressure; `tresca`: where it reaches `shear`; `rough`: nowhere while they touch; `tied`: they are bonded and do not open either, \
with the gap that there is between the nodes of the meshes.",
            ),
            key(
                "friction",
                Property(D::NUMBER),
                is("none"),
                "Coefficient of friction mu of Amontons' and Coulomb's law, >= 0; 0 is no friction. Perhaps a table over \
temperature, as of a material: it is that of the mean of the temperatures of the two surfaces at each node at the end of each \
increment; of a body without temperature, and of a rigid one, that of the other.",
            ),
            key(
                "shear",
                Property(D::PRESSURE),
                is("none"),
                "Bound of the tangential traction of `law = \"tresca\"`, > 0. Perhaps a table, as `friction`.",
            ),
            key(
                "geometry",
                Choice(&["initial", "updated"]),
                is("\"initial\""),
                "Normals and gap of the undeformed surfaces, right where displacements are small against their radii; \
or `updated`, following the deformation.",
            ),
        ],
    },
    Table {
        name: "alternation",
        heading: "`[alternation]`",
        about: "An alternation is a force step of all bodies and a displacement step of all bodies. The driver says \
what is made of them. `active set`: which nodes touch is decided by a primal-dual active set, their forces by \
conjugate gradients, one iteration of which is one alternation. `relaxed`: the paper's alternation, in which each \
body takes its share of a correction by `weights`; the supports of each body must hold it, and it answers condensed. With friction all nodes that touch stick at first, and \
slide where the corrected tangential force is beyond its bound (37, 40).\n\nTransfer: `mortar` integrates over the surface that both have \
in common; meshes need not match. `pointwise` takes nodal values at conjugate points: with `relaxed` those of the nodes of \
both surfaces, the paper's transfer, which has friction only where nodes match; with `active set` the nodes of one surface against the facets of the other.\n\n\
Weights: `response` is the response per node, |v_m|/(|v_m| + |v_s|) with v = u - u_free, \
the default, since \
it follows the stiffness of the two bodies without being told; `response per surface` takes norms over the \
active nodes; \
`magnitude` and `component` are the paper's ratios (32, 35) and (34, 36); `stiffness` is E'_B/(E'_A + \
E'_B); a number in \
(0, 1) is the paper's constant.",
        keys: &[
            key("driver", Choice(DRIVERS), is("\"active set\""), "What decides the next step."),
            key(
                "transfer",
                Choice(TRANSFERS),
                is("`active set`: `mortar`; `relaxed`: `pointwise`"),
                "How displacements and forces cross the interface.",
            ),
            key(
                "weights",
                Either(
                    "`response`, `response per surface`, `magnitude`, `component`, `stiffness`, or a \
number",
                    D::NUMBER,
                ),
                is("\"response\""),
                "Weights of the corrections. Only with `driver = \"relaxed\"`.",
            ),
            key(
                "tolerance",
                Either("`auto` or a number", D::NUMBER),
                is("\"auto\""),
                "Relative tolerance of the stop test; in (0, 1e-2]. `auto`: a tenth of the error that the mesh leaves in \
the contact pressure, as the pressures along the surface show it while they are found, between 1e-10 and 1e-4; \
`relaxed`: 1e-8.",
            ),
            key(
                "max_alternations",
                Count,
                is("`active set`: 1000; `relaxed`: 200"),
                "Alternations after which it gives up.",
            ),
        ],
    },
    plasticity::PLASTICITY,
    Table {
        name: "step",
        heading: "`[[step]]`",
        about: "Each step says the whole state at its end: the factors of one step do not build on those of the \
one before. It starts from the contact state that the one before has found. Without any `[[step]]` there is one step, \
all factors 1. What follows a [load path](#pathname) has the factor of the path instead.\n\n\
The way to the end of a step may be divided into increments, `steps = 10` equal ones or `steps = \"auto\"`. On the way all \
factors change linearly, those of a path with a table as the table says over the path parameter, which changes linearly. An \
increment that finds no solution is halved, and its halves again, down to a 16th of it. `auto` begins with the whole \
step and stops at every row of a table; an increment is also halved, down to a 64th of the step, if in a pair that was in \
contact more than a fifth of the candidate nodes (and more than one) open or close in it, and the next one is twice as large \
if less than half as many did. The last increment ends exactly at the end of the step. Result file, pictures and `steps` of the \
summary have the ends of the steps only; each says how many `increments` led to it.",
        keys: &[
            key("name", Text, ABSENT, "Name, unique among the steps."),
            key("loads", Number(D::NUMBER), is("1"), "Factor on all loads without a `path`."),
            key(
                "supports",
                Number(D::NUMBER),
                is("1"),
                "Factor on all prescribed displacements without a `path`, the motion of rigid bodies included.",
            ),
            key(
                "temperature",
                Number(D::NUMBER),
                is("1"),
                "Factor on temperature minus reference temperature, in bodies without a `path`.",
            ),
            key(
                "at",
                Number(D::NUMBER),
                ABSENT,
                "Path parameter at the end of the step; required with `[path.NAME]` tables. It is 0 before the first step and \
increases from step to step.",
            ),
            key(
                "paths",
                Either("table of numbers by name", D::NUMBER),
                is("as in the step before, at first 0"),
                "Factors of [load paths](#pathname) without a table: `paths = { preload = 1, shear = 0.5 }`.",
            ),
            key(
                "steps",
                Either("integer > 0, or `\"auto\"`", D::NUMBER),
                is("1"),
                "Increments to the end of the step.",
            ),
        ],
    },
    Table {
        name: "path",
        heading: "`[path.NAME]`",
        about: "A load path is a factor with a name. A load, a support, the temperature of a body or the motion of a rigid one that \
has `path = \"NAME\"` follows it: its factor in a step is that of the path. So one load can stay while another grows, or comes \
after it. The factors are a table over a path parameter, of which each `[[step]]` says where it ends (`at`), or they stand \
in the steps one by one (`paths`). Everything begins at zero: a path is at 0 until a step names it.\n\n\
```toml\n\
[path.preload]\n\
at = [0, 1]\n\
factor = [0, 1]          # stays 1 beyond\n\n\
[path.shear]\n\
at = [1, 2, 4]\n\
factor = [0, 1, -1]\n\n\
[[step]]\n\
at = 1\n\n\
[[step]]\n\
at = 4\n\
steps = \"auto\"\n\
```",
        keys: &[
            key("at", Numbers(D::NUMBER), REQUIRED, "Path parameters, increasing; at least two."),
            key(
                "factor",
                Numbers(D::NUMBER),
                REQUIRED,
                "The factor at each of them: linear in between, constant beyond the ends.",
            ),
        ],
    },
    Table {
        name: "probe",
        heading: "`[[probe]]`",
        about: "Displacement, stress and temperature of a material point, in the log and in `summary.json`.",
        keys: &[
            key("name", Name, REQUIRED, "Name, unique among the probes."),
            key("body", Text, REQUIRED, "Name of the body."),
            key("at", Point(D::LENGTH), REQUIRED, "Position before deformation."),
        ],
    },
    Table {
        name: "output",
        heading: "`[output]`",
        about: "",
        keys: &[
            key(
                "stress",
                Choice(&["xx", "yy", "zz", "xy", "von Mises"]),
                is("\"yy\""),
                "Stress that colours the picture.",
            ),
            key(
                "field",
                Choice(&["equivalent plastic strain"]),
                ABSENT,
                "What colours the picture in place of a stress; white: none. Only where a body can yield.",
            ),
            key(
                "magnification",
                Number(D::NUMBER),
                is("chosen"),
                "Factor on the displacements in the picture; >= 0.",
            ),
            key("window", Points(D::LENGTH), is("everything"), "Lower and upper corner of what to draw."),
            key(
                "estimate",
                Choice(&["last step", "every step"]),
                is("\"last step\""),
                "With load steps: which of them the error is estimated for. It takes about a fifth of a step's time.",
            ),
        ],
    },
    study::EXACT,
    study::EXACT_PROBE,
    study::HERTZ_LINE,
    study::PRESS_FIT,
    study::HEATED_BLOCKS,
    study::STUDY,
    Table {
        name: "variant",
        heading: "`[[variant]]`",
        about: "",
        keys: &[
            key("name", Name, REQUIRED, "Name, for `--variant`."),
            key("title", Text, is("the case's title"), "Title of the variant."),
            key("remove", Texts, ABSENT, "Paths to remove, before anything is set."),
            key("set", Changes, ABSENT, "Paths and their new values."),
        ],
    },
];

/// Keys of a grading of positions with this dimension.
const fn grading(d: Dimension) -> [Key; 6] {
    [
        key("from", Number(d), is("0 for `u`, `v`, `depth`; else required"), "First position."),
        key("to", Number(d), is("1 for `u`, `v`; else required"), "Last position."),
        key("at", Numbers(d), ABSENT, "Breakpoints, increasing; in place of `from` and `to`."),
        key(
            "cells",
            Either("count, or an array of them", D::NUMBER),
            ABSENT,
            "Number of cells, of each interval.",
        ),
        key(
            "ratio",
            Either("number, or an array of them", D::NUMBER),
            is("1"),
            "Size of the last cell over that of \
the first, of each interval; geometric in between.",
        ),
        key("size", Numbers(d), ABSENT, "In place of `cells`: cell size wanted at each breakpoint."),
    ]
}
const GRADING_LENGTH: &[Key] = &grading(D::LENGTH);
const GRADING_ANGLE: &[Key] = &grading(D::ANGLE);
const GRADING_NUMBER: &[Key] = &grading(D::NUMBER);
