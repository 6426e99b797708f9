//! Friction in the paper's alternation: where it converges it finds what the default driver finds, and where it cannot have an
//! answer it says so.
//!
//! One process, one rank: a single test function, since MPI and PETSc start once.
mod common;

use common::inside::{Runner, sides};
use kontakt::{
    case::{Case, Driver, Tolerance, Transfer, Weights},
    contact::Law,
    record::{IN_CONTACT, SLIPS, SideTable},
    vector::{larger, largest},
};

const COULOMB: Law = Law::Coulomb { friction: 0.3 };

/// Tolerance of both drivers, and what their results may differ by for it.
const TOLERANCE: f64 = 1e-10;
const ALLOWED: f64 = 1e-8;

/// Materials of the upper body, `ratio` times as stiff, and of the lower one, and what happens: the overlap presses, then the upper
/// body's top is pushed along, and half the way back to the other side.
fn text(ratio: f64, bodies: &str, contact: &str) -> String {
    format!(
        r#"analysis = "plane strain"
material.a = {{ young = {:e}, poisson = 0.3 }}
material.b = {{ young = 2.1e11, poisson = 0.3 }}
{bodies}
[[contact]]
name = "joint"
surfaces = ["upper.bottom", "lower.top"]
{contact}
[[step]]
supports = 0
[[step]]
supports = 1
[[step]]
supports = -0.5
"#,
        2.1e11 * ratio
    )
}

/// A block on a wider one, whose nodes match if both have `cells` to the centimetre.
fn blocks(ratio: f64, cells: u32, contact: &str) -> String {
    let body = |name: &str, material: &str, x: [f64; 2], y: [f64; 2], support: &str| {
        let n = (x[1] - x[0]) * 100.0 * f64::from(cells);
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"{material}\"\nelement = \"quad4\"\nmesh.rectangle = {{ x = {{ from = {}, \
             to = {}, cells = {n:.0} }}, y = {{ from = {}, to = {}, cells = 12 }} }}\n[[body.support]]\n{support}\n",
            x[0], x[1], y[0], y[1]
        )
    };
    let bodies = [
        body("upper", "a", [0.01, 0.03], [0.0, 0.02], "surface = \"top\"\nx = 5e-6\ny = 0"),
        body("lower", "b", [0.0, 0.04], [-0.02, 0.0], "surface = \"bottom\"\nx = 0\ny = 0"),
    ];
    text(ratio, &bodies.concat(), &format!("gap_offset = -1e-5\n{contact}"))
}

/// Two cylinders of the same radius and mesh: Cattaneo's and Mindlin's problem.
fn cylinders(ratio: f64) -> String {
    let body = |name: &str, material: &str, y: [f64; 2], arc: &str, support: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"{material}\"\nelement = \"quad4\"\nmesh.block = {{ corners = [[-0.03, {0}], \
             [0.03, {0}], [0.03, {1}], [-0.03, {1}]], arcs = {{ {arc} }}, u = {{ at = [0, 0.4, 0.6, 1], cells = [8, 48, 8] }}, \
             v = {{ from = 0, to = 1, cells = 12 }} }}\n[[body.support]]\n{support}\n",
            y[0], y[1]
        )
    };
    let bodies = [
        body("upper", "a", [0.01, 0.04], "bottom = [0, 0.05]", "surface = \"top\"\nx = 1.5e-5\ny = 0"),
        body("lower", "b", [-0.04, -0.01], "top = [0, -0.05]", "surface = \"bottom\"\nx = 0\ny = 0"),
    ];
    text(ratio, &bodies.concat(), "gap_offset = -1e-4\nfriction = 0.3")
}

/// Pressures and tractions by the largest pressure, slips by the largest one; the same nodes stick and slip.
fn same(a: &SideTable, b: &SideTable, what: &str) {
    let close = |a: &[f64], b: &[f64], scale: f64, field: &str| {
        let difference = std::iter::zip(a, b).map(|(a, b)| (a - b).abs()).fold(0.0, larger);
        assert!(difference <= ALLOWED * scale, "{what}: {field} differ by {:.1e}", difference / scale);
    };
    let pressure = largest(&b.pressure);
    let [t, u] = [a, b].map(|table| table.tangential.as_ref().expect("the pair has friction"));
    close(&a.pressure, &b.pressure, pressure, "pressures");
    close(&t.traction, &u.traction, pressure, "tractions");
    close(&t.slip, &u.slip, largest(&u.slip), "slips");
    if b.multipliers {
        assert_eq!(a.status, b.status, "{what}");
    }
}

/// Runs the case with both drivers; both must converge, and agree. Returns how many nodes stick and how many slip.
fn compare(runner: &Runner, case: &Case, weights: Weights, what: &str) -> [usize; 2] {
    let mut case = case.clone();
    case.alternation.tolerance = Tolerance::Fixed(TOLERANCE);
    let (_, exact) = runner.run(&case);
    case.alternation.driver = Driver::Relaxed(weights);
    let (summary, found) = runner.run(&case);
    let what = format!("{what}, {weights:?}, {} alternations", summary.alternations);
    let (found, exact) = (sides(&found, 0), sides(&exact, 0));
    std::iter::zip(&found, &exact).for_each(|(a, b)| same(a, b, &what));
    let of_multipliers = exact.iter().find(|side| side.multipliers).expect("a side has the multipliers");
    [IN_CONTACT, SLIPS].map(|status| of_multipliers.status.iter().filter(|s| **s == status).count())
}

/// The case as far as its first `steps` steps.
fn until(case: &Case, steps: usize) -> Case {
    let mut case = case.clone();
    case.steps.truncate(steps);
    case
}

/// Coulomb's law: pushed and back; part of the surface slips, part sticks.
fn part_slip(runner: &Runner) {
    for transfer in [Transfer::Pointwise, Transfer::Mortar] {
        let mut case = runner.parse(&blocks(2.0, 8, "friction = 0.3"));
        case.alternation.transfer = transfer;
        let counts = [2, 3].map(|steps| {
            compare(
                runner,
                &until(&case, steps),
                Weights::Response,
                &format!("blocks, {transfer:?}, {steps}"),
            )
        });
        assert!(counts[0].iter().all(|n| *n > 1), "{counts:?}");
    }
    for (ratio, weights) in [(1.0, Weights::Response), (5.0, Weights::Stiffness)] {
        let case = runner.parse(&cylinders(ratio));
        let counts = [2, 3].map(|steps| {
            compare(runner, &until(&case, steps), weights, &format!("cylinders, {ratio}, {steps} steps"))
        });
        assert!(counts[0].iter().all(|n| *n > 1), "{counts:?}");
    }
}

/// The other laws.
fn laws(runner: &Runner) {
    let case = runner.parse(&blocks(2.0, 8, "friction = 0.3"));
    for law in [Law::Tresca { shear: 1e7 }, Law::Rough, Law::Tied] {
        let mut case = case.clone();
        case.contacts[0].law = law;
        let [sticking, slipping] = compare(runner, &case, Weights::Response, &law.describe(false));
        assert_eq!(slipping > 0, matches!(law, Law::Tresca { .. }), "{law:?}: {sticking} {slipping}");
    }
}

/// Weights that cannot agree end without a converged result.
fn no_false_answer(runner: &Runner) {
    let mut case = runner.parse(&blocks(5.0, 8, "friction = 0.3"));
    assert_eq!(case.contacts[0].law, COULOMB);
    case.alternation.driver = Driver::Relaxed(Weights::Constant(0.5));
    let (summary, _) = runner.attempt(&case).expect("it runs");
    assert!(!summary.converged, "{:?}", summary.reason);
}

/// Meshes that do not match, with the transfer that needs them to.
fn refused(runner: &Runner) {
    let mut case = runner.parse(&blocks(1.0, 8, "friction = 0.3").replace("cells = 32", "cells = 29"));
    case.alternation.driver = Driver::Relaxed(Weights::Response);
    case.alternation.transfer = Transfer::Pointwise;
    let Err(error) = runner.attempt(&case) else { panic!("it is refused") };
    let message = error.to_string();
    for part in ["case.toml:", "contact.joint", "do not match", "use transfer = \"mortar\""] {
        assert!(message.contains(part), "{message}");
    }
    case.alternation.transfer = Transfer::Mortar;
    assert!(runner.attempt(&case).is_ok());
}

#[test]
fn friction_in_the_papers_alternation() {
    let runner = Runner::start();
    part_slip(&runner);
    laws(&runner);
    no_false_answer(&runner);
    refused(&runner);
}
