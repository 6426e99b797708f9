//! The tables that only `kontakt study` reads.
use super::Kind::*;
use super::{ABSENT, Dimension as D, REQUIRED, Table, is, key};

pub(super) const EXACT: Table = Table {
    name: "exact",
    heading: "`[exact]`",
    about: "Only `kontakt study` reads it: errors are measured against these values. What is given as a number goes \
before what a closed form says; what neither says is compared with the limit of the finest meshes. At most one closed \
form; materials, analysis, thickness and gap are those of the case, so that most variants need no values of their own.\n\n\
```toml\n\
exact.hertz_line = { radius = [\"50 mm\", \"50 mm\"], force = \"1 MN\" }\n\
exact.probe.tip = { x = 0, y = \"-12.5 um\" }\n\
```",
    keys: &[
        key("pair", Text, is("the only pair"), "Name of the pair that force, pressure and length are of."),
        key("force", Number(D::FORCE), ABSENT, "Normal force, over the whole thickness; > 0."),
        key("peak_pressure", Number(D::PRESSURE), ABSENT, "Largest pressure; > 0."),
        key("contact_length", Number(D::LENGTH), ABSENT, "Length in contact; > 0."),
        key("half_width", Number(D::LENGTH), ABSENT, "Half of it, in its place."),
        key("probe", Named("exact.probe"), ABSENT, "What is known at a probe, under its name."),
        key("hertz_line", Table("exact.hertz_line"), ABSENT, "Hertz' line contact."),
        key("press_fit", Table("exact.press_fit"), ABSENT, "Lamé's press fit of two rings."),
        key(
            "heated_blocks",
            Table("exact.heated_blocks"),
            ABSENT,
            "Two uniformly heated blocks between rigid walls.",
        ),
    ],
};

pub(super) const EXACT_PROBE: Table = Table {
    name: "exact.probe",
    heading: "`exact.probe.NAME`",
    about: "Displacement, stress, or both.",
    keys: &[
        key("x", Number(D::LENGTH), ABSENT, "Displacement along x; with `y`."),
        key("y", Number(D::LENGTH), ABSENT, "Displacement along y; with `x`."),
        key("xx", Number(D::PRESSURE), ABSENT, "Stress; with the other three."),
        key("yy", Number(D::PRESSURE), ABSENT, "Stress."),
        key("zz", Number(D::PRESSURE), ABSENT, "Stress."),
        key("xy", Number(D::PRESSURE), ABSENT, "Stress."),
    ],
};

pub(super) const HERTZ_LINE: Table = Table {
    name: "exact.hertz_line",
    heading: "`exact.hertz_line`",
    about: "Force, peak pressure and contact length of cylinders that touch along a line, right while the contact is \
small against the radii. `force` or `half_width` says how hard they are pressed.",
    keys: &[
        key(
            "radius",
            Numbers(D::LENGTH),
            REQUIRED,
            "Radii of the two sides; one if the other is flat, a negative one if it is hollow.",
        ),
        key("force", Number(D::FORCE), ABSENT, "Force over the whole thickness; > 0."),
        key("half_width", Number(D::LENGTH), ABSENT, "Half the width of the contact; > 0."),
    ],
};

pub(super) const PRESS_FIT: Table = Table {
    name: "exact.press_fit",
    heading: "`exact.press_fit`",
    about: "Peak pressure of two rings pressed into each other, and displacement and stress at all probes; side A is \
the inner ring.",
    keys: &[
        key("radii", Numbers(D::LENGTH), REQUIRED, "Bore, interface, rim."),
        key("interference", Number(D::LENGTH), REQUIRED, "Radial interference; > 0."),
        key("center", Point(D::LENGTH), is("[0, 0]"), "Common centre."),
    ],
};

pub(super) const HEATED_BLOCKS: Table = Table {
    name: "exact.heated_blocks",
    heading: "`exact.heated_blocks`",
    about: "Force, peak pressure and contact length of two blocks of uniform temperature between rigid walls along \
which they slide freely. The pair needs its `gap`.",
    keys: &[
        key("heights", Numbers(D::LENGTH), REQUIRED, "Heights of the blocks of side A and side B."),
        key("width", Number(D::LENGTH), REQUIRED, "Width of the contact."),
    ],
};

pub(super) const STUDY: Table = Table {
    name: "study",
    heading: "`[study]`",
    about: "What `kontakt study` varies: every combination of what is listed here is run, at every level. Flags of \
the same names go before (`--levels 0..4 --elements quad4,quad8`). A list that is absent leaves the case as it is. \
Weights go with the relaxed driver only.",
    keys: &[
        key(
            "levels",
            Either("`\"0..3\"` or array of integers", D::NUMBER),
            is("\"0..3\""),
            "Levels: how often the elements of the case's meshes are split into four.",
        ),
        key(
            "elements",
            Either("array of element kinds", D::NUMBER),
            ABSENT,
            "Elements of the generated meshes.",
        ),
        key(
            "tolerances",
            Either("array of numbers and `\"auto\"`", D::NUMBER),
            ABSENT,
            "Tolerances of the [alternation](#alternation).",
        ),
        key("drivers", Either("array of drivers", D::NUMBER), ABSENT, "Drivers of the alternation."),
        key("weights", Either("array of weights", D::NUMBER), ABSENT, "Weights of the relaxed driver."),
        key("transfers", Either("array of transfers", D::NUMBER), ABSENT, "Transfers across the interface."),
        key("responses", Either("array of responses", D::NUMBER), ABSENT, "`response` of all bodies."),
        key(
            "solvers",
            Either("array of strings", D::NUMBER),
            ABSENT,
            "`solver` of all bodies: PETSc options, with their tolerances.",
        ),
        key(
            "ranks",
            Either("array of integers > 0", D::NUMBER),
            is("[1]"),
            "Numbers of ranks; more than the machine has cores only with `--oversubscribe`.",
        ),
        key("repeat", Count, is("3"), "Runs of each kind; the least of their times counts."),
        key(
            "quantity",
            Text,
            is("the first peak pressure, or else the first probe"),
            "What accuracy is judged by: `PAIR.peak_pressure`, `PAIR.force`, `PAIR.contact_length`, \
`PROBE.displacement`, `PROBE.stress` (the norm of the difference), their components alone (`PROBE.displacement.y`, \
`PROBE.stress.xx`, ...), `PROBE.stress.von_mises`, `BODY.strain_energy`, and `strain_energy` of all bodies.",
        ),
        key(
            "set",
            Changes,
            ABSENT,
            "Changes to the case for the study, as in a variant: a coarser mesh to start from, for instance.",
        ),
    ],
};
