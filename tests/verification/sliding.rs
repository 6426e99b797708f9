//! Sliding: belts, wedges and blocks that are dragged, with resultants and work that statics gives; and the edge of sliding.
use super::friction::{A_OVER_B, STEEL, block, discs, plate};
use super::{attempt, multipliers, near, rectangle, solve, solve_all, value};
use kontakt::record::SLIPS;
use serde_json::Value;
use std::f64::consts::PI;

/// A thin belt round half of a rigid drum, pulled at one end and held at the other; all of it slips towards the pull. The tension
/// grows with the angle by exp(mu angle), and the pressure is the tension over the radius (Eytelwein).
#[test]
fn a_belt_round_half_of_a_drum() {
    let (friction, radius, thickness, pull) = (0.3_f64, 0.1, 2e-4, 1e5);
    let text = format!(
        "analysis = \"plane stress\"\n{STEEL}[[body]]\nname = \"belt\"\nmaterial = \"steel\"\nelement = \"quad8\"\n\
         mesh.ring = {{ radius = {{ from = {radius}, to = {}, cells = 1 }}, angle = {{ from = 0, to = 180, cells = 240 }} }}\n\
         support = [{{ surface = \"start\", y = 0 }}]\nload = [{{ surface = \"end\", traction = [0, {}] }}]\n\
         [[body]]\nname = \"drum\"\nrigid = {{ circle = {{ center = [0, 0], radius = {radius} }} }}\n\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"belt.inner\", \"drum.surface\"]\nfriction = {friction}\n",
        radius + thickness,
        -pull / thickness,
    );
    let (summary, results) = super::solve_within(&text, 1, &[], 1e3);
    let ratio = (friction * PI).exp();
    near(ratio, 2.566332, 1e-6, "the formula");
    let held = pull - value(&summary, "pairs.pair.friction.force").abs();
    near(pull / held, ratio, 0.015 * ratio, "T2 / T1");
    // Both ends pull the drum down.
    near(value(&summary, "pairs.pair.resultant.1"), pull + held, 0.005 * pull, "what the drum carries");
    let table = multipliers(&results, 0);
    let angle = |i: usize| table.x[i][1].atan2(table.x[i][0]);
    // What holds the belt along itself up to an angle: the tension there.
    for degrees in [30.25_f64, 60.25, 90.25, 120.25, 150.25] {
        let to = degrees.to_radians();
        let held_by =
            |i: usize| table.force[i][1].mul_add(angle(i).cos(), -table.force[i][0] * angle(i).sin());
        let passed: f64 = (0..table.s.len()).filter(|&i| angle(i) < to).map(held_by).sum();
        let expected = pull * (friction * (to - PI)).exp();
        near(held - passed, expected, 0.015 * expected, &format!("tension at {degrees}"));
    }
    assert!(
        (0..table.s.len()).filter(|&i| table.touches(i)).filter(|&i| table.status[i] != SLIPS).count() <= 1
    );
}

/// Half of a wedge pressed into an elastic V whose nodes do not match: what slips all one way carries what statics says, below and above
/// the angle from which on a loop that freezes the normal force diverges (tan angle = mu).
#[test]
fn an_elastic_v_carries_a_wedge_by_statics() {
    for (angle, friction, normal, thrust) in [
        (20.0, 0.0, 1.4619022e5, 1.3737387e5),
        (20.0, 0.2, 9.4346980e4, 8.2203448e4),
        (30.0, 0.1, 8.5236590e4, 6.9555222e4),
        (20.0, 0.5, 6.158648e4, 4.734048e4),
        (10.0, 0.3, 1.065892e5, 9.941718e4),
    ] {
        let (s, c) = (angle * PI / 180.0_f64).sin_cos();
        let at = |height: f64| 0.01 + height * s / c;
        let text = format!(
            "analysis = \"plane stress\"\n{STEEL}material.soft = {{ young = 7e10, poisson = 0.33 }}\n\
             [[body]]\nname = \"wedge\"\nmaterial = \"steel\"\n\
             mesh.block = {{ corners = [[0, 0], [{}, 0], [{}, 0.04], [0, 0.04]], u = {{ cells = 6 }}, v = {{ cells = 16 }} }}\n\
             support = [{{ surface = \"left\", x = 0 }}]\nload = [{{ surface = \"top\", pressure = {} }}]\n\
             [[body]]\nname = \"v\"\nmaterial = \"soft\"\n\
             mesh.block = {{ corners = [[{}, -0.01], [0.06, -0.01], [0.06, 0.05], [{}, 0.05]], u = {{ cells = 10 }}, v = {{ cells = 29 }} }}\n\
             support = [{{ surface = \"right\", x = 0, y = 0 }}]\n\
             [[contact]]\nname = \"flank\"\nsurfaces = [\"wedge.right\", \"v.left\"]\nfriction = {friction}\n",
            at(0.0),
            at(0.04),
            0.5e5 / at(0.04),
            at(-0.01),
            at(0.05),
        );
        let summary = solve(&text);
        let what = format!("{angle} degrees, mu = {friction}");
        let exact = 1e5 / (2.0 * (s + friction * c));
        near(exact, normal, 1e-6 * normal, &what);
        near(exact * (c - friction * s), thrust, 1e-6 * thrust, &what);
        near(value(&summary, "pairs.flank.normal_force"), exact, 1e-6 * exact, &what);
        near(value(&summary, "pairs.flank.resultant.0"), -exact * (c - friction * s), 1e-6 * exact, &what);
        if friction > 0.0 {
            near(value(&summary, "pairs.flank.friction.force").abs(), friction * exact, 1e-6 * exact, &what);
            assert_eq!(summary["pairs"][0]["friction"]["sticking"], 0, "{what}");
        }
    }
}

/// The plate that opens, slips and sticks, on the finest of the meshes that the reference was found on.
#[test]
fn a_fine_plate_has_the_digits_of_the_reference() {
    // Coefficient, displacements and what they may be off by, um; friction in all.
    let known: [(f64, [f64; 6], f64, f64); 3] = [
        (0.3, [35.21, 33.845, 29.901, 27.353, 23.621, 15.301], 0.006, f64::NAN),
        (1.0, [28.603, 27.225, 22.868, 19.807, 15.414, 6.457], 0.002, 1.40534e6),
        (3.0, [24.49, 23.11, 18.97, 15.80, 10.03, 0.0], 0.015, 1.662e6),
    ];
    let along_floor =
        |summary: &Value| [0, 1, 2, 3, 4, 5].map(|i| value(summary, &format!("probes.p{i}.displacement.0")));
    let (young, poisson) = (1.3e11, 0.2);
    let strain = (1.0 - poisson * poisson) / young * (15e7 - poisson / (1.0 - poisson) * 5e7);
    let frictionless = along_floor(&solve(&plate(0.0, 128, "quad4")));
    for (u, x) in std::iter::zip(frictionless, [0.0, 1.25e-3, 5e-3, 7.5e-3, 11.25e-3, 20e-3]) {
        near(u, strain * (0.04 - x), 1e-10 * strain * 0.04, "without friction");
    }
    for (friction, along, allowed, force) in known {
        let summary = solve(&plate(friction, 128, "quad4"));
        let what = format!("mu = {friction}");
        for (u, expected) in std::iter::zip(along_floor(&summary), along) {
            near(1e6 * u, expected, allowed, &what);
        }
        // Where all slips, the node in the corner, which a support holds along the floor, has no friction.
        if force.is_finite() {
            near(value(&summary, "pairs.pair.friction.force").abs(), force, 3e-4 * force, &what);
        }
    }
}

/// Nearly all of mu P: what still sticks is narrower than a cell.
#[test]
fn discs_on_the_edge_of_sliding() {
    for cells in [10.0, 20.0, 40.0] {
        let (summary, results) = solve_all(&discs(0.3, cells, A_OVER_B, &[0.0, 0.999]), 1, &[]);
        near(value(&summary, "pairs.pair.resultant.0").abs(), 0.999 * 3e5, 1e-9 * 3e5, "shear");
        assert!(value(&summary, "pairs.pair.friction.beyond_bound") < 1e-12);
        assert!(value(&summary, "pairs.pair.friction.wrong_slip") < 1e-10);
        let table = multipliers(&results, 0);
        let along = table.tangential.as_ref().expect("a law");
        let nodes: Vec<usize> = (0..table.s.len()).filter(|&i| table.touches(i)).collect();
        for &i in nodes.iter().filter(|&&i| table.status[i] == SLIPS) {
            near(along.traction[i].abs(), 0.3 * table.pressure[i], 1e-10 * 1e9, "on the cone");
        }
        let sticking = nodes.iter().filter(|&&i| table.status[i] != SLIPS).count();
        assert!(sticking > 0 && sticking as f64 <= 2.0 * 0.0317 * cells + 2.0, "{sticking}");
    }
}

/// A hundred-millionth below mu N the block holds, as much above it slides away, and that is said with its motion.
#[test]
fn a_hundred_millionth_decides_whether_a_block_slides() {
    for angle in [0.0, 37.0] {
        let push = |over: f64| (1.0 + over) * 0.3 * 12e3;
        for over in [-0.01, -1e-8] {
            let summary = solve(&block(angle, push(over), "friction = 0.3"));
            near(value(&summary, "pairs.pair.friction.force").abs(), push(over), 1e-9 * push(over), "push");
            assert!(value(&summary, "pairs.pair.friction.beyond_bound") < 1e-9);
        }
        for over in [1e-8, 1e-6, 0.01] {
            let (_, log) = attempt(&block(angle, push(over), "friction = 0.3"), 4);
            assert!(log.contains("body 'block'") && log.contains("stop this motion"), "{over}: {log}");
            // So near to holding the motion that is told has a part of the block's settling.
            assert!(over < 1e-7 || log.contains("translation"), "{over}: {log}");
        }
        // At mu N itself either is right, but one of them it is.
        let (ended, log) = either(&block(angle, push(0.0), "friction = 0.3"));
        assert!(ended == 0 || ended == 4 && log.contains("body 'block'"), "{ended}: {log}");
    }
}

/// How a run ends that may end either way.
fn either(text: &str) -> (i32, String) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let (code, log) = super::start(text, 1, &[], directory.path());
    (code.expect("it ends by itself"), log)
}

/// A slab is dragged under a block that is pressed on it by P and held on the left; `slab`: its cells on 80 mm.
fn dragged(slab: usize, geometry: &str, steps: &str) -> String {
    let block = rectangle(
        "block",
        "steel",
        "quad4",
        (0.0, 0.02, 12),
        (0.0, 0.01, 6),
        "support = [{ surface = \"left\", x = 0 }]\nload = [{ surface = \"top\", pressure = 1e6 }]",
    );
    let slab = rectangle(
        "slab",
        "steel",
        "quad4",
        (-0.03, 0.05, slab),
        (-0.01, 0.0, 6),
        "support = [{ surface = \"bottom\", x = 0.01, y = 0, path = \"drag\" }]",
    );
    format!(
        "analysis = \"plane strain\"\n{STEEL}{block}{slab}[[contact]]\nname = \"pair\"\nsurfaces = [\"block.bottom\", \"slab.top\"]\n\
         friction = 0.3\ngeometry = \"{geometry}\"\n[[step]]\npaths = {{ drag = 0 }}\n{steps}"
    )
}

fn of_step(summary: &Value, step: usize, key: &str) -> f64 {
    summary["steps"][step]["pairs"][0]["friction"][key].as_f64().expect("a number")
}

/// Over many cells of a slab that is finer or coarser than the block: it is dragged by mu P, slips by its travel, and loses mu P times
/// that, wherever the nodes are that carry the multipliers; those that have been left behind keep what they lost.
#[test]
fn a_block_slides_over_a_slab_by_its_travel() {
    let (bound, travel) = (0.3 * 1e6 * 0.02, 0.01);
    for slab in [24, 120] {
        let text = dragged(
            slab,
            "updated",
            "[[step]]\npaths = { drag = 0.1 }\nsteps = 20\n\
            [[step]]\npaths = { drag = 1 }\nsteps = 180\n[[step]]\npaths = { drag = 0.5 }\nsteps = 100\n",
        );
        let summary = solve(&text);
        for (step, sense) in [(1, 1.0), (2, 1.0), (3, -1.0)] {
            let drag = summary["steps"][step]["pairs"][0]["resultant"][0].as_f64().expect("a number");
            near(drag, sense * bound, 2e-6 * bound, "drag");
            assert_eq!(of_step(&summary, step, "sticking"), 0.0);
        }
        let lost = [1, 2, 3].map(|step| of_step(&summary, step, "dissipated"));
        // What it has sprung back by before it slides is 20 nm of a millimetre; what nodes carry changes from increment to increment.
        near(lost[1] - lost[0], bound * 0.9 * travel, 1e-3 * bound * travel, "work");
        near(lost[2] - lost[1], bound * 0.5 * travel, 1e-3 * bound * travel, "work on the way back");
        near(of_step(&summary, 1, "max_slip"), 0.1 * travel, 1e-4 * travel, "slip");
        near(of_step(&summary, 2, "max_slip"), travel, 1e-4 * travel, "slip");
    }
}

/// Two equal cylinders that are pressed together move alike along their contact: conjugate nodes exactly, mortar rows, whose points opposite
/// lie where one of the surfaces' normals leads, to the order of the gap's slope.
#[test]
fn equal_cylinders_pressed_together_do_not_slip() {
    let body = |name: &str, y: [f64; 2], arc: &str, surface: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\nmesh.block = {{ corners = [[-0.03, {0}], [0.03, {0}], [0.03, {1}], \
             [-0.03, {1}]], arcs = {{ {arc} }}, u = {{ at = [0, 0.4, 0.6, 1], cells = [8, 48, 8] }}, v = {{ cells = 12 }} }}\n\
             support = [{{ surface = \"{surface}\", x = 0, y = 0 }}]\n",
            y[0], y[1]
        )
    };
    for (alternation, allowed) in [
        ("transfer = \"pointwise\"", 1e-10),
        ("driver = \"relaxed\"", 1e-10),
        ("transfer = \"mortar\"", 1e-3),
        ("driver = \"relaxed\"\ntransfer = \"mortar\"", 1e-3),
    ] {
        let text = format!(
            "analysis = \"plane strain\"\nmaterial.steel = {{ young = 2.1e11, poisson = 0.3 }}\n[alternation]\ntolerance = 1e-11\n{alternation}\n\
             {}{}[[contact]]\nname = \"pair\"\nsurfaces = [\"upper.bottom\", \"lower.top\"]\nfriction = 0.3\ngap_offset = -1e-4\n",
            body("upper", [0.01, 0.04], "bottom = [0, 0.05]", "top"),
            body("lower", [-0.04, -0.01], "top = [0, -0.05]", "bottom"),
        );
        let (summary, results) = solve_all(&text, 1, &[]);
        let table = multipliers(&results, 0);
        let along = table.tangential.as_ref().expect("a law");
        assert_eq!(summary["pairs"][0]["friction"]["slipping"], 0, "{alternation}");
        near(value(&summary, "pairs.pair.friction.dissipated"), 0.0, 0.0, alternation);
        let peak = value(&summary, "pairs.pair.max_pressure");
        assert!(
            along.traction.iter().all(|q| q.abs() < allowed * peak),
            "{alternation}: {:?}",
            along.traction
        );
    }
}
