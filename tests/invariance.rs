//! Invariants that need several runs or a mirrored mesh: reciprocity (I9), mirror symmetry (I10), exchanged sides (I11),
//! frames (I12), units (I13), numbers of elements and gaps down to round-off (H04), stiffness ratios (H01).
//!
//! One process, one rank: a single test function, since MPI and PETSc start once.
mod common;

use common::inside::Runner;
use kontakt::vector::larger;
use kontakt::{
    case::{self, Case, Gap, Tolerance},
    record::Summary,
};

fn close(a: f64, b: f64, relative: f64, what: &str) {
    assert!((a - b).abs() <= relative * a.abs().max(b.abs()), "{what}: {a:e} and {b:e}");
}

/// Agreement of all pairs, relative, after scaling by the units of length and force; alternations within one.
fn same(a: &Summary, b: &Summary, length: f64, force: f64, relative: f64, what: &str) {
    let pressure = force / (length * length);
    assert_eq!(a.pairs.len(), b.pairs.len());
    for (p, q) in std::iter::zip(&a.pairs, &b.pairs) {
        close(p.normal_force * force, q.normal_force, relative, what);
        close(p.max_pressure * pressure, q.max_pressure, relative, what);
        close(p.contact_length * length, q.contact_length, relative, what);
        assert_eq!((p.active, p.candidates), (q.active, q.candidates), "{what}");
    }
    assert!(a.alternations.abs_diff(b.alternations) <= 1, "{what}: {} {}", a.alternations, b.alternations);
}

/// Displacements of probes, turned by `angle`.
fn same_probes(a: &Summary, b: &Summary, angle: f64, what: &str) {
    let (sin, cos) = angle.sin_cos();
    let largest = a.probes.iter().map(|p| p.displacement[0].hypot(p.displacement[1])).fold(0.0, larger);
    for (a, b) in std::iter::zip(&a.probes, &b.probes) {
        let u = &a.displacement;
        let expected = [cos * u[0] - sin * u[1], sin * u[0] + cos * u[1]];
        for (found, wanted) in std::iter::zip(&b.displacement, expected) {
            assert!((found - wanted).abs() <= 1e-8 * largest, "{what} {}: {found:e} {wanted:e}", a.name);
        }
    }
}

/// Small and large contact, held by supports and by contact alone, matching and not.
const CASES: [(&str, Option<&str>); 8] = [
    ("patch", None),
    ("patch", Some("non-matching-quad8")),
    ("patch", Some("pressure")),
    ("patch", Some("rigid-floor")),
    ("hertz-line", None),
    ("press-fit", None),
    ("heated-gap", Some("D")),
    ("heated-rectangles", Some("S2b")),
];

/// The cases with their answers; finer tolerances than theirs, so that what is compared is the solution.
fn references(runner: &Runner) -> Vec<(String, Case, Summary)> {
    CASES
        .iter()
        .map(|&(name, variant)| {
            let mut case = runner.variant(name, variant);
            case.alternation.tolerance = Tolerance::Fixed(1e-11);
            case.output.window = None;
            let summary = runner.run(&case).0;
            (format!("{name} {}", variant.unwrap_or("")), case, summary)
        })
        .collect()
}

/// I12: rotated by any angle, moved anywhere. Displacements of probes turn, scalars stay.
fn frames(runner: &Runner, references: &[(String, Case, Summary)]) {
    for (name, case, reference) in references {
        for degrees in [30.0_f64, 77.0, -135.0] {
            let angle = degrees.to_radians();
            let what = format!("{name} turned by {degrees}");
            let (summary, _) = runner.run(&case.rotated(angle).expect("the case can be rotated"));
            same(reference, &summary, 1.0, 1.0, 1e-8, &what);
            same_probes(reference, &summary, angle, &what);
        }
        for by in [[0.37, -0.71], [-1.0, 1.0]] {
            let what = format!("{name} moved by {by:?}");
            let (summary, _) = runner.run(&case.translated(by[0], by[1]).expect("the case can be moved"));
            same(reference, &summary, 1.0, 1.0, 1e-8, &what);
            same_probes(reference, &summary, 0.0, &what);
        }
    }
}

/// I13: (m, Pa), (mm, MPa), (um, TPa), (km, kPa).
fn units(runner: &Runner, references: &[(String, Case, Summary)]) {
    for (name, case, reference) in references {
        for (length, pressure) in [(1e3, 1e-6), (1e6, 1e-12), (1e-3, 1e-3)] {
            let (summary, _) = runner.run(&case.rescaled(length, pressure));
            let force = pressure * length * length;
            same(reference, &summary, length, force, 1e-8, &format!("{name} in units of {length:e}"));
        }
    }
}

/// I11: the two sides of every pair exchanged, and the order of the bodies. The finer side carries the multipliers
/// whatever its name is, so that only equal sides change roles, and with them nothing where nodes match.
fn exchanged_sides(runner: &Runner, references: &[(String, Case, Summary)]) {
    for (name, case, reference) in references {
        let (summary, _) = runner.run(&case.swapped());
        // Equal discs: the normals of the one or of the other.
        let relative = if name.starts_with("hertz") { 1e-8 } else { 1e-9 };
        let what = format!("{name} with its sides exchanged");
        for (p, q) in std::iter::zip(&reference.pairs, &summary.pairs) {
            close(p.normal_force, q.normal_force, relative, &what);
            close(p.max_pressure, q.max_pressure, relative, &what);
            close(p.contact_length, q.contact_length, relative, &what);
        }
        within_a_fifth(reference, &summary, &what);
    }
    // Meshes that do not match with the roles of fine and coarse exchanged: the discretisation error.
    let case = |upper: u32, lower: u32| {
        let mut case = runner.variant("heated-rectangles", Some("S2b"));
        case.alternation.tolerance = Tolerance::Fixed(1e-10);
        let text = |n: u32| format!("{n}");
        let set = [
            format!("body.upper.mesh.rectangle.x.cells={}", text(upper)),
            format!("body.lower.mesh.rectangle.x.cells=[{0}, {0}]", text(lower)),
        ];
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/heated-rectangles");
        case::read(&path, Some("S2b"), &set).expect("the case reads")
    };
    let [(a, _), (b, _)] = [case(44, 40), case(40, 44)].map(|case| runner.run(&case));
    assert_ne!(a.pairs[0].multiplier_side, b.pairs[0].multiplier_side);
    close(a.pairs[0].moment, b.pairs[0].moment, 2e-3, "roles");
    for (a, b) in std::iter::zip(&a.probes, &b.probes) {
        for c in 0..2 {
            assert!((a.displacement[c] - b.displacement[c]).abs() < 1e-7, "{}", a.name);
        }
    }
    within_a_fifth(&a, &b, "roles");
}

fn within_a_fifth(a: &Summary, b: &Summary, what: &str) {
    let allowed = (a.alternations.max(b.alternations) / 5).max(1);
    assert!(
        a.alternations.abs_diff(b.alternations) <= allowed,
        "{what}: {} {}",
        a.alternations,
        b.alternations
    );
}

/// I10: the mirrored Hertz problem has a mirrored answer, node by node.
fn mirror(runner: &Runner) {
    let (_, results) = runner.run(&runner.read("hertz-line"));
    for side in &results.pairs[0].sides {
        let side = side.as_ref().expect("one process holds both sides");
        let (n, largest) = (side.x.len(), side.pressure.iter().copied().fold(0.0, larger));
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
        runner.run(&runner.parse(&text)).0
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

/// Tresca's bound is a pressure, and in other units another number.
fn shear_in_other_units(runner: &Runner) {
    let case = runner.parse(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-12\nmaterial.a = { young = 2e11, poisson = 0.3 }\n\
         [[body]]\nname = \"block\"\nmaterial = \"a\"\nmesh.rectangle = { x = { from = 0, to = 0.02, cells = 12 }, y = { from = 0, to = 0.01, cells = 6 } }\n\
         support = [{ surface = \"left\", x = 0 }]\nload = [{ surface = \"top\", pressure = 5e7 }]\n\
         [[body]]\nname = \"floor\"\nrigid = { plane = { through = [0, 0], normal = [0, 1] }, x = 3e-7 }\n\
         [[contact]]\nsurfaces = [\"block.bottom\", \"floor.surface\"]\nlaw = \"tresca\"\nshear = 8e6\n",
    );
    let rubbing = |summary: &Summary| summary.pairs[0].friction.clone().expect("a law");
    let plain = rubbing(&runner.run(&case).0);
    assert!(plain.slipping > 0 && plain.sticking > 0, "{plain:?}");
    for (length, pressure) in [(1e3, 1e-6), (1.0, 1e3)] {
        let scaled = rubbing(&runner.run(&case.rescaled(length, pressure)).0);
        let (force, what) = (pressure * length * length, format!("units of {length:e}"));
        close(plain.force * force, scaled.force, 1e-9, &what);
        close(plain.dissipated * force * length, scaled.dissipated, 1e-9, &what);
        assert_eq!((plain.slipping, plain.sticking), (scaled.slipping, scaled.sticking), "{what}");
    }
}

/// Two half discs pressed into each other beyond yield and taken apart by half, of cells that match or not.
fn indented(runner: &Runner, cells: [f64; 2]) -> Case {
    let disc = |name: &str, y: f64, arc: &str, size: f64, u: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"m\"\n\
             mesh.half_disc = {{ center = [0, {y}], radius = 0.05, arc = \"{arc}\", angle = {{ at = [-45, -1.5, 1.5, 45], size = [9, {size}, {size}, 9] }}, \
             depth = {{ at = [0, 0.04, 0.6], size = [{depth}, {depth}, 0.15] }}, core = 4 }}\n\
             support = [{{ surface = \"flat\", y = {u} }}, {{ point = [0, {y}], x = 0 }}]\n",
            depth = 0.0175 * size
        )
    };
    runner.parse(&format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-11\nplasticity.tolerance = 1e-11\n\
         step = [{{ steps = 4 }}, {{ supports = 0.5 }}]\n\
         material.m = {{ young = 2.1e11, poisson = 0.3, plasticity = {{ yield_stress = 5e8, hardening = 2e9, kinematic = {{ modulus = 5e9, recall = 20 }} }} }}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.arc\", \"lower.arc\"] }}]\n\
         probe = [{{ name = \"p\", body = \"lower\", at = [0.0002, -0.001] }}]\n{}{}",
        disc("upper", 0.05, "down", cells[0], -4e-5),
        disc("lower", -0.05, "up", cells[1], 0.0)
    ))
}

/// I11, I12, I13 of bodies that yield.
fn plastic(runner: &Runner) {
    let yielded = |summary: &Summary| summary.plasticity.clone().expect("bodies that yield");
    for cells in [[0.25, 0.25], [0.25, 0.375]] {
        let case = indented(runner, cells);
        let reference = runner.run(&case).0;
        let plain = yielded(&reference);
        assert!(plain.max_plastic_strain > 1e-3 && reference.pairs[0].normal_force > 0.0, "{plain:?}");
        let alike = |summary: &Summary, length: f64, force: f64, what: &str| {
            let found = yielded(summary);
            close(plain.max_plastic_strain, found.max_plastic_strain, 1e-8, what);
            for a in &plain.bodies {
                let b = found.bodies.iter().find(|b| b.name == a.name).expect("the body");
                close(a.work * force * length, b.work, 1e-8, what);
                close(a.plastic_volume, b.plastic_volume, 1e-8, what);
            }
        };
        let angle = 37_f64.to_radians();
        let (turned, _) = runner.run(&case.rotated(angle).expect("the case can be rotated"));
        same(&reference, &turned, 1.0, 1.0, 1e-8, "yielding, turned");
        same_probes(&reference, &turned, angle, "yielding, turned");
        alike(&turned, 1.0, 1.0, "yielding, turned");
        for (length, pressure) in [(1e3, 1e-6), (1e-3, 1e-3)] {
            let (force, what) = (pressure * length * length, format!("yielding, units of {length:e}"));
            let (scaled, _) = runner.run(&case.rescaled(length, pressure));
            same(&reference, &scaled, length, force, 1e-8, &what);
            alike(&scaled, length, force, &what);
        }
        let (swapped, _) = runner.run(&case.swapped());
        let what = "yielding, sides exchanged";
        close(reference.pairs[0].normal_force, swapped.pairs[0].normal_force, 1e-8, what);
        close(reference.pairs[0].max_pressure, swapped.pairs[0].max_pressure, 1e-8, what);
        alike(&swapped, 1.0, 1.0, what);
    }
}

#[test]
fn invariance() {
    let runner = Runner::start();
    let references = references(&runner);
    frames(&runner, &references);
    units(&runner, &references);
    exchanged_sides(&runner, &references);
    mirror(&runner);
    tiny_gaps(&runner);
    reciprocity(&runner);
    stiffness_ratios(&runner);
    shear_in_other_units(&runner);
    plastic(&runner);
}
