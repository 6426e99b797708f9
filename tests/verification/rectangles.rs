//! Heated rectangles of steel held by contact alone: pressures along the interface, stresses inside. Displacements,
//! resultant and moment are with the shipped case.
use super::{common, gapped, near, pressure_at};
use kontakt::output::{RESULT, Results};
use std::path::Path;

/// The results of a variant of the shipped case with extra settings.
fn variant(name: &str, arguments: &[&str]) -> Results {
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/heated-rectangles");
    let out = tempfile::tempdir().expect("a temporary directory");
    let arguments = [&["--variant", name], arguments].concat();
    let output = common::run(2, &case, out.path(), &arguments);
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    common::check_invariants(&common::summary(out.path()), name);
    Results::read(&out.path().join(RESULT)).expect("the file reads")
}

/// Pressures in MPa at these places in mm; they vanish beyond the contact.
#[test]
fn pressures_along_the_interface() {
    let places = [2.5, 5.0, 7.5, 10.0, 12.5, 15.0, 20.0];
    let table: [(&str, &[f64]); 11] = [
        ("S1a", &[214.2, 150.9, 109.4, 83.3, 67.2, 56.6, 42.2]),
        ("S1b", &[227.3, 151.9, 102.4, 73.05, 56.2, 48.3, 43.4]),
        ("S1c", &[281.5, 173.9, 103.3, 61.7, 38.0, 27.3, 21.5]),
        ("S2a", &[369.9, 264.8, 144.0, 0.0, 0.0, 0.0, 0.0]),
        ("S2b", &[383.4, 264.3, 131.0, 0.0, 0.0, 0.0, 0.0]),
        ("S2c", &[453.0, 256.4, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("S1d", &[267.1, 169.5, 103.4, 65.7, 44.0, 33.9, 28.3]),
        ("S1e", &[267.3, 169.6, 103.3, 65.5, 43.7, 33.6, 28.0]),
        ("S2d", &[433.4, 309.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("S2e", &[436.6, 305.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("S3", &[238.7, 147.9, 102.5, 76.5, 61.1, 53.5, 48.6]),
    ];
    for (name, pressures) in table {
        let results = variant(name, &[]);
        let side = gapped(&results.pairs[0]);
        for (x, p) in std::iter::zip(places, pressures) {
            near(pressure_at(side, 1e-3 * x) * 1e-6, *p, 0.015 * p, &format!("{name}: pressure at {x} mm"));
        }
    }
}

/// Where it opens: u2(C) - u2(G), um. The gap at the end of the shorter surface is that of the table of the pair.
#[test]
fn opening_at_the_corner() {
    for (name, opening) in [("S2a", 65.06), ("S2b", 64.50), ("S2c", 106.61), ("S2d", 102.52), ("S2e", 102.79)]
    {
        let results = variant(name, &[]);
        let side = gapped(&results.pairs[0]);
        let i = side.x.iter().position(|x| (x[0] - 0.025).abs() < 1e-9).expect("the corner");
        // The mean gap over the corner's multiplier is a little less than the gap at the corner.
        near(side.gap[i] * 1e6, opening, 0.01 * opening, name);
    }
}

/// Coarser and finer meshes give the same answer to the discretisation error.
#[test]
fn swapped_roles() {
    let runs = [["46", "40"], ["40", "50"]].map(|[upper, lower]| {
        let set = [
            format!("body.upper.mesh.rectangle.x.cells={upper}"),
            format!("body.lower.mesh.rectangle.x={{ at = [0, 0.025, 0.05], cells = [{lower}, {lower}] }}"),
        ];
        variant("S2b", &["--set", &set[0], "--set", &set[1]])
    });
    let [a, b] = runs.each_ref().map(|r| gapped(&r.pairs[0]));
    for x in [1.0, 2.5, 4.0, 6.0] {
        let p = [a, b].map(|side| pressure_at(side, 1e-3 * x));
        near(p[0], p[1], 5e-3 * p[0], &format!("pressure at {x} mm"));
    }
}
