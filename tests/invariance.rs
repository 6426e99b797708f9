//! Invariants that need several runs or a mirrored mesh: reciprocity (I9), mirror symmetry (I10), frames (I12), units (I13), tiny gaps (H04).
//!
//! One process, one rank: a single test function, since MPI and PETSc start once.
use kontakt::{
    case::{self, Case, Gap},
    output::{RESULT, Results, Summary},
    petsc, simulation,
};
use mpi::topology::SimpleCommunicator;
use std::path::Path;

struct Runner<'a> {
    world: &'a SimpleCommunicator,
}

impl Runner<'_> {
    fn read(&self, name: &str) -> Case {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(name);
        case::read(&path, None, &[]).expect("the case reads")
    }

    fn run(&self, case: &Case) -> (Summary, Results) {
        let out = tempfile::tempdir().expect("a temporary directory");
        let summary = simulation::run(case, self.world, out.path(), |_| {}).expect("the run ends");
        assert!(summary.converged, "{}: {:?}", case.name, summary.reason);
        (summary, Results::read(&out.path().join(RESULT)).expect("the file reads"))
    }
}

fn close(a: f64, b: f64, relative: f64, what: &str) {
    assert!((a - b).abs() <= relative * a.abs().max(b.abs()), "{what}: {a:e} and {b:e}");
}

fn same(a: &Summary, b: &Summary, length: f64, force: f64, what: &str) {
    let pressure = force / (length * length);
    let (p, q) = (&a.pairs[0], &b.pairs[0]);
    close(p.normal_force * force, q.normal_force, 1e-8, what);
    close(p.max_pressure * pressure, q.max_pressure, 1e-8, what);
    close(p.contact_length * length, q.contact_length, 1e-8, what);
    assert!(a.alternations.abs_diff(b.alternations) <= 1, "{what}: {} {}", a.alternations, b.alternations);
    assert_eq!(p.active, q.active, "{what}");
}

/// I12: rotated by any angle. Displacements of probes turn, scalars stay.
fn frames(runner: &Runner) {
    for name in ["patch", "hertz-line"] {
        let case = runner.read(name);
        let (reference, _) = runner.run(&case);
        for degrees in [30.0_f64, 77.0] {
            let mut turned = case.rotated(degrees.to_radians()).expect("the case can be rotated");
            turned.output.window = None;
            let (summary, _) = runner.run(&turned);
            same(&reference, &summary, 1.0, 1.0, &format!("{name} turned by {degrees}"));
            let (sin, cos) = degrees.to_radians().sin_cos();
            for (a, b) in std::iter::zip(&reference.probes, &summary.probes) {
                let u = &a.displacement;
                let expected = [cos * u[0] - sin * u[1], sin * u[0] + cos * u[1]];
                let size = u[0].hypot(u[1]);
                for (found, wanted) in std::iter::zip(&b.displacement, expected) {
                    assert!((found - wanted).abs() <= 1e-8 * size, "{name} {}: {found:e} {wanted:e}", a.name);
                }
            }
        }
    }
}

/// I13: (m, Pa), (mm, MPa), (um, TPa), (km, kPa).
fn units(runner: &Runner) {
    for name in ["patch", "hertz-line"] {
        let case = runner.read(name);
        let (reference, _) = runner.run(&case);
        for (length, pressure) in [(1e3, 1e-6), (1e6, 1e-12), (1e-3, 1e-3)] {
            let scaled = case.rescaled(length, pressure);
            let (summary, _) = runner.run(&scaled);
            let force = pressure * length * length;
            same(&reference, &summary, length, force, &format!("{name} in units of {length:e}"));
        }
    }
}

/// I10: the mirrored Hertz problem has a mirrored answer, node by node.
fn mirror(runner: &Runner) {
    let (_, results) = runner.run(&runner.read("hertz-line"));
    for side in &results.pairs[0].sides {
        let side = side.as_ref().expect("one process holds both sides");
        let (n, largest) = (side.x.len(), side.pressure.iter().copied().fold(0.0, f64::max));
        for i in 0..n {
            let j = n - 1 - i;
            assert!((side.x[i][0] + side.x[j][0]).abs() <= 1e-15, "the mesh is mirrored");
            let difference = (side.pressure[i] - side.pressure[j]).abs();
            assert!(difference <= 1e-10 * largest, "node {i}: {difference:e} of {largest:e}");
            assert_eq!(side.status[i], side.status[j], "node {i}");
            // Hertz's profile p0 sqrt(1 - x^2 / a^2), away from the edge.
            let (p0, a) = (1.212074e9, 5.252319e-4);
            let x = side.x[i][0] / a;
            if x.abs() < 0.8 {
                close(side.pressure[i], p0 * (1.0 - x * x).sqrt(), 0.02, "Hertz profile");
            }
        }
    }
}

/// H04: gaps down to round-off and interference; p = (U - g) / C.
fn tiny_gaps(runner: &Runner) {
    let mut case = runner.read("patch");
    let (e1, e2) = (2.1e11, 7e10);
    case.bodies[0].material.young = case::Property::Constant(e1);
    case.bodies[1].supports[0].displacement[1] = Some(case::Scalar::Constant(-1e-5));
    let compliance = 0.02 / e1 + 0.03 / e2;
    for gap in [0.0, 1e-12, -1e-12, 1e-15, 1e-9, -1e-5] {
        case.contacts[0].gap = Gap::Value(gap);
        let (summary, _) = runner.run(&case);
        let what = format!("gap {gap:e}");
        close(summary.pairs[0].max_pressure, (1e-5 - gap) / compliance, 1e-11, &what);
        assert_eq!(summary.pairs[0].active, summary.pairs[0].candidates, "{what}");
    }
}

/// I9: fA.uB = fB.uA for two loads with the same contact set (Betti), zero gap, isothermal.
fn reciprocity(runner: &Runner) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("case.toml");
    let run = |pressure: &str| {
        let probes: String = (0..6)
            .map(|i| {
                format!(
                    "[[probe]]\nname = \"t{i}\"\nbody = \"upper\"\nat = [{}, 0.05]\n",
                    0.008 * f64::from(i)
                )
            })
            .collect();
        let text = format!(
            r#"
analysis = "plane stress"
[material.a]
young = 2e11
poisson = 0.3
[[body]]
name = "lower"
material = "a"
mesh.rectangle = {{ x = {{ from = 0, to = 0.04, cells = 5 }}, y = {{ from = 0, to = 0.02, cells = 3 }} }}
support = [{{ surface = "bottom", y = 0, x = 0 }}]
[[body]]
name = "upper"
material = "a"
mesh.rectangle = {{ x = {{ from = 0, to = 0.04, cells = 5 }}, y = {{ from = 0.02, to = 0.05, cells = 4 }} }}
support = [{{ surface = "left", x = 0, y = 0 }}]
load = [{{ surface = "top", pressure = {pressure} }}]
[[contact]]
surfaces = ["upper.bottom", "lower.top"]
[alternation]
tolerance = 1e-13
{probes}"#
        );
        std::fs::write(&file, text).expect("the case is written");
        runner.run(&case::read(&file, None, &[]).expect("the case reads")).0
    };
    let (a, b) = (run("1e8"), run("\"1e8*(1 + x/0.04)\""));
    assert_eq!(a.pairs[0].active, b.pairs[0].active);
    assert_eq!(a.pairs[0].active, a.pairs[0].candidates);
    // Consistent nodal forces of p0 + p1 x on linear edges of length h.
    let h = 0.008;
    let force = |p: &dyn Fn(f64) -> f64, i: usize| {
        let (x, mut f) = (h * i as f64, 0.0);
        for neighbour in [i.checked_sub(1), (i < 5).then_some(i + 1)].into_iter().flatten() {
            f += h / 6.0 * (2.0 * p(x) + p(h * neighbour as f64));
        }
        -f
    };
    let work = |p: &dyn Fn(f64) -> f64, u: &Summary| -> f64 {
        (0..6).map(|i| force(p, i) * u.probes[i].displacement[1]).sum()
    };
    let ab = work(&|_| 1e8, &b);
    let ba = work(&|x| 1e8 * (1.0 + x / 0.04), &a);
    close(ab, ba, 1e-11, "reciprocity");
}

/// H01 for bodies that the plain alternation can treat: prisms, every stiffness ratio, either body the stiffer.
fn stiffness_ratios(runner: &Runner) {
    let mut case = runner.read("patch");
    for ratio in [1e-6, 1e-3, 0.1, 0.2, 1.0, 5.0, 10.0, 1e3, 1e6] {
        let (e1, e2) = (2e11, 2e11 * ratio);
        case.bodies[0].material.young = case::Property::Constant(e1);
        case.bodies[1].material.young = case::Property::Constant(e2);
        let (summary, _) = runner.run(&case);
        let exact = 5e-5 / (0.02 / e1 + 0.03 / e2);
        // Displacements rounded to double, times the stiffness of the stiffer body.
        let round_off = 1e-15 * ratio.max(1.0 / ratio);
        close(summary.pairs[0].max_pressure, exact, 1e-9 + round_off, &format!("ratio {ratio:e}"));
        assert!(summary.alternations <= 8, "ratio {ratio:e}: {}", summary.alternations);
    }
}

#[test]
fn invariance() {
    let universe = mpi::initialize().expect("MPI starts once in this process");
    let session = petsc::Session::start().expect("PETSc starts");
    let world = universe.world();
    let runner = Runner { world: &world };
    frames(&runner);
    units(&runner);
    mirror(&runner);
    tiny_gaps(&runner);
    reciprocity(&runner);
    stiffness_ratios(&runner);
    drop(session);
}
