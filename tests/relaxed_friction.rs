//! Friction in the paper's alternation: where it converges it finds what the default driver finds.
//!
//! One process, one rank: a single test function, since MPI and PETSc start once.
mod common;

use common::inside::{Runner, sides};
use kontakt::{
    case::{Driver, Tolerance, Transfer, Weights},
    contact::Law,
    record::{IN_CONTACT, SLIPS, SideTable},
    vector::{larger, largest},
};

/// What the fields of two tables differ by, relative to the largest pressure and slip; the same nodes must slip.
fn differ(a: &SideTable, b: &SideTable, what: &str) {
    let difference =
        |a: &[f64], b: &[f64]| std::iter::zip(a, b).map(|(a, b)| (a - b).abs()).fold(0.0, larger);
    let pressure = largest(&b.pressure);
    let (t, u) = (a.tangential.as_ref().unwrap(), b.tangential.as_ref().unwrap());
    eprintln!(
        "{what}: pressure {:.1e} traction {:.1e} slip {:.1e}",
        difference(&a.pressure, &b.pressure) / pressure,
        difference(&t.traction, &u.traction) / pressure,
        difference(&t.slip, &u.slip) / largest(&u.slip)
    );
    let n = |s: i32| b.status.iter().filter(|x| **x == s).count();
    eprintln!("   stick {} slip {} same {}", n(IN_CONTACT), n(SLIPS), a.status == b.status);
}

/// Two blocks pressed together by an overlap, the upper one pushed along and back.
fn blocks(ratio: f64) -> String {
    format!(
        r#"analysis = "plane strain"
[material.a]
young = {:e}
poisson = 0.3
[material.b]
young = 2.1e11
poisson = 0.3
[[body]]
name = "upper"
material = "a"
element = "quad4"
mesh.rectangle = {{ x = {{ from = 0.01, to = 0.03, cells = 16 }}, y = {{ from = 0, to = 0.02, cells = 16 }} }}
[[body.support]]
surface = "top"
x = 1e-5
y = 0
[[body]]
name = "lower"
material = "b"
element = "quad4"
mesh.rectangle = {{ x = {{ from = 0, to = 0.04, cells = 32 }}, y = {{ from = -0.02, to = 0, cells = 16 }} }}
[[body.support]]
surface = "bottom"
x = 0
y = 0
[[contact]]
name = "c"
surfaces = ["upper.bottom", "lower.top"]
gap_offset = -1e-5
friction = 0.3
[[step]]
supports = 0
[[step]]
supports = 1
[[step]]
supports = -0.2
"#,
        2.1e11 * ratio
    )
}

fn cylinders(ratio: f64) -> String {
    let arc = |name: &str, material: &str, s: f64, edge: &str| {
        format!(
            r#"
[[body]]
name = "{name}"
material = "{material}"
element = "quad4"
mesh.block = {{ corners = [[-0.03, {}], [0.03, {}], [0.03, {}], [-0.03, {}]], arcs = {{ {edge} = [0, {}] }}, u = {{ at = [0, 0.35, 0.65, 1], cells = [6, 40, 6] }}, v = {{ from = 0, to = 1, cells = 12 }} }}
"#,
            if s > 0.0 { 0.01 } else { -0.04 },
            if s > 0.0 { 0.01 } else { -0.04 },
            if s > 0.0 { 0.04 } else { -0.01 },
            if s > 0.0 { 0.04 } else { -0.01 },
            s * 0.05
        )
    };
    format!(
        r#"analysis = "plane strain"
[material.a]
young = {:e}
poisson = 0.3
[material.b]
young = 2.1e11
poisson = 0.3
{}
[[body.support]]
surface = "top"
x = 12e-6
y = 0
{}
[[body.support]]
surface = "bottom"
x = 0
y = 0
[[contact]]
name = "c"
surfaces = ["upper.bottom", "lower.top"]
gap_offset = -3e-5
friction = 0.3
[[step]]
supports = 0
[[step]]
supports = 1
[[step]]
supports = -0.5
"#,
        2.1e11 * ratio,
        arc("upper", "a", 1.0, "bottom"),
        arc("lower", "b", -1.0, "top")
    )
}

#[test]
fn friction_in_the_papers_alternation() {
    let runner = Runner::start();
    for (name, text, transfer) in [
        ("blocks", blocks as fn(f64) -> String, Transfer::Pointwise),
        ("cylinders", cylinders, Transfer::Mortar),
    ] {
        for ratio in [1.0, 2.0, 5.0] {
            for law in [
                Law::Coulomb { friction: 0.1 },
                Law::Coulomb { friction: 0.3 },
                Law::Coulomb { friction: 1.0 },
            ] {
                let mut case = runner.parse(&text(ratio));
                case.contacts[0].law = law;
                case.alternation.tolerance = Tolerance::Fixed(1e-10);
                case.alternation.transfer = transfer;
                let (_, exact) = runner.run(&case);
                for weights in
                    [Weights::Response, Weights::Stiffness, Weights::ResponseSurface, Weights::Magnitude]
                {
                    case.alternation.driver = Driver::Relaxed(weights);
                    match runner.attempt(&case) {
                        Ok((summary, found)) => {
                            eprintln!(
                                "{name} {ratio} {law:?} {weights:?} {:?} {} {:?} {:?}",
                                summary.reason,
                                summary.alternations,
                                summary.diagnosis,
                                found
                                    .history
                                    .iter()
                                    .map(|r| (r.step, r.alternation, r.flips, r.displacement_jump as f32))
                                    .last()
                            );
                            if summary.converged {
                                differ(sides(&found, 0)[0], sides(&exact, 0)[0], &format!("  "));
                            }
                        }
                        Err(e) => eprintln!("{name} {law:?} {weights:?} {e}"),
                    }
                }
            }
        }
    }
}
