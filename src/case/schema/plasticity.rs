//! The tables of bodies that yield, and of bodies of several materials.
use super::Kind::*;
use super::{ABSENT, Dimension as D, Key, REQUIRED, Table, is, key};

/// How a curve of yield stresses is given.
const PLASTIC_STRAIN: Key = key(
    "plastic_strain",
    Numbers(D::NUMBER),
    REQUIRED,
    "Equivalent plastic strains: 0 first, increasing; at least two.",
);
const STRESS: Key =
    key("stress", Numbers(D::PRESSURE), REQUIRED, "Yield stress at each of them: > 0, nowhere falling.");

pub(super) const MATERIAL_PLASTICITY: Table = Table {
    name: "material.plasticity",
    heading: "`[material.NAME.plasticity]`",
    about: "The material yields by von Mises' criterion. Without this table it stays elastic, however high its stress. The yield \
stress grows with the equivalent plastic strain p in one of these forms, exactly one of which is given:\n\n\
- `yield_stress`, with `hardening` or without: yield_stress + hardening p;\n\
- `curve`: straight lines between points, constant beyond the last one; `curves`: one curve for each temperature, linear in \
between, constant beyond the ends;\n\
- `ramberg_osgood`: p = offset (sigma / yield_stress)^exponent: plastic strain from the first load on;\n\
- `power`: Swift's yield_stress (1 + p / strain)^exponent.\n\n\
How bodies that yield are \
computed is said in [`[plasticity]`](#plasticity). A body whose material has tables over temperature needs a `temperature`, \
here, too.\n\n\
```toml\n\
[material.steel.plasticity]\n\
yield_stress = { temperature = [293, 473, 573, 673], value = [780e6, 700e6, 680e6, 610e6] }\n\
hardening = 2e9\n\
kinematic = { modulus = 5e9, recall = 20 }\n\n\
[material.copper.plasticity]\n\
curve = { plastic_strain = [0, 0.01, 0.1], stress = [60e6, 110e6, 200e6] }\n\
```",
    keys: &[
        key("yield_stress", Property(D::PRESSURE), ABSENT, "Yield stress without plastic strain; > 0."),
        key(
            "hardening",
            Property(D::PRESSURE),
            is("0"),
            "With `yield_stress`: its growth per plastic strain, >= 0; 0: perfectly plastic. A tangent modulus E_t of the \
stress over the total strain is a hardening of E E_t / (E - E_t).",
        ),
        key("curve", Table("material.plasticity.curve"), ABSENT, "Yield stress over plastic strain."),
        key(
            "curves",
            Tables("material.plasticity.curves"),
            ABSENT,
            "The same at each of several temperatures.",
        ),
        key(
            "ramberg_osgood",
            Table("material.plasticity.ramberg_osgood"),
            ABSENT,
            "The law of Ramberg and Osgood.",
        ),
        key("power", Table("material.plasticity.power"), ABSENT, "Swift's law."),
        key(
            "kinematic",
            Table("material.plasticity.kinematic"),
            ABSENT,
            "Kinematic hardening: the yield surface moves as well. Only with `theory = \"flow\"`.",
        ),
    ],
};

pub(super) const CURVE: Table = Table {
    name: "material.plasticity.curve",
    heading: "`curve`",
    about: "A stress that falls is refused: softening gathers in one row of cells, and the answer would be that of the mesh.",
    keys: &[PLASTIC_STRAIN, STRESS],
};

pub(super) const CURVES: Table = Table {
    name: "material.plasticity.curves",
    heading: "`curves`",
    about: "By temperature, at least two: `curves = [{ temperature = 293, plastic_strain = [0, 0.1], stress = [3e8, 4e8] }, ...]`.",
    keys: &[
        key(
            "temperature",
            Number(D::TEMPERATURE),
            REQUIRED,
            "Temperature of the curve; higher than that of the one before.",
        ),
        PLASTIC_STRAIN,
        STRESS,
    ],
};

pub(super) const RAMBERG_OSGOOD: Table = Table {
    name: "material.plasticity.ramberg_osgood",
    heading: "`ramberg_osgood`",
    about: "",
    keys: &[
        key(
            "yield_stress",
            Property(D::PRESSURE),
            REQUIRED,
            "Stress at which the plastic strain is `offset`; > 0.",
        ),
        key("offset", Number(D::NUMBER), is("0.002"), "Plastic strain at the yield stress; > 0."),
        key("exponent", Number(D::NUMBER), REQUIRED, "n; > 1."),
    ],
};

pub(super) const POWER: Table = Table {
    name: "material.plasticity.power",
    heading: "`power`",
    about: "Of sigma = K (strain + p)^exponent, as it is often printed, the yield stress is K strain^exponent.",
    keys: &[
        key("yield_stress", Property(D::PRESSURE), REQUIRED, "Yield stress without plastic strain; > 0."),
        key("strain", Number(D::NUMBER), REQUIRED, "Strain that the plastic strain adds to; > 0."),
        key("exponent", Number(D::NUMBER), REQUIRED, "n; in (0, 1]."),
    ],
};

pub(super) const KINEMATIC: Table = Table {
    name: "material.plasticity.kinematic",
    heading: "`kinematic`",
    about: "The backstress grows by 2/3 `modulus` times the plastic strain, less `recall` times itself times p (Armstrong and \
Frederick); without `recall` it is Prager's.",
    keys: &[
        key("modulus", Property(D::PRESSURE), REQUIRED, "C; > 0."),
        key(
            "recall",
            Number(D::NUMBER),
            is("0"),
            "gamma; >= 0. The stress of uniaxial tension moves by at most C / gamma.",
        ),
    ],
};

pub(super) const PLASTICITY: Table = Table {
    name: "plasticity",
    heading: "`[plasticity]`",
    about: "How bodies that yield are computed: those with a material that has [`plasticity`](#materialnameplasticity). Without \
such a body it says nothing.\n\n\
Theory: `flow` adds plastic strain along the deviatoric stress, increment by increment; unloading is elastic, and the way counts: \
take several increments (`steps` of a [`[[step]]`](#step)) where loads do not grow in proportion. `deformation` has the strain \
follow from the stress alone, a non-linear elastic law by variable elasticity parameters: right where all stresses grow in \
proportion, at one increment.\n\n\
Iteration: `newton` with the tangent that belongs to the increment. `secant`, only with `deformation`, is the method of variable \
elasticity parameters as it is printed: each iteration is an elastic body whose moduli at each point are the secant ones of the \
iteration before. It gets to the same answer in many more iterations.\n\n\
A body that yields all over without hardening has no one answer: any part of it may go on stretching. In plane stress the enhanced \
quad4, whose bending is then free, finds no equilibrium there; take quad8, or a little hardening.",
    keys: &[
        key("theory", Choice(&["flow", "deformation"]), is("\"flow\""), "What plastic strains follow."),
        key("iteration", Choice(&["newton", "secant"]), is("\"newton\""), "The stiffness of an iteration."),
        key(
            "tolerance",
            Number(D::NUMBER),
            is("1e-9"),
            "Residual of an increment, relative to the forces, from which on it is solved; > 0, < 1e-2.",
        ),
        key(
            "max_iterations",
            Count,
            is("`newton`: 25; `secant`: 1000"),
            "Iterations after which an increment is given up, and halved.",
        ),
        key(
            "zone",
            Choice(&["automatic", "always", "never"]),
            is("\"automatic\""),
            "Whether only the part of a body that yields is iterated, with the rest condensed onto it: `always` where it is \
possible, `never`, or if a cost estimate finds it cheaper. The answer is the same.",
        ),
    ],
};

pub(super) const INSERT: Table = Table {
    name: "body.insert",
    heading: "`[[body.insert]]`",
    about: "A part of the body that is of another material: a layer, a fibre, a weld. The two share the nodes on their border, and are \
bonded there. The border follows sides of cells: it is as sharp as the mesh is aligned with it. Of two inserts that have a cell in \
common the later one has it. Exactly one of `group` and `within`. The materials of a body with `temperature` have one \
`reference_temperature`.\n\n\
```toml\n\
[[body.insert]]\n\
material = \"copper\"\n\
within = { y = [\"8 mm\", \"10 mm\"] }\n\
```",
    keys: &[
        key(
            "material",
            Either("name, [table](#materialname) or [reference](#a-material-from-a-file)", D::NUMBER),
            REQUIRED,
            "Its material.",
        ),
        key(
            "group",
            Text,
            ABSENT,
            "The cells of the body that are in this physical group of the mesh file; at least one. A body of several groups lists them in `mesh.group`.",
        ),
        key(
            "within",
            Table("within"),
            ABSENT,
            "The cells whose centre, the mean of their corners, lies inside this box; at least one. Refinement by the estimated error \
does not move the border.",
        ),
    ],
};
