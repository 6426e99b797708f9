//! Hertz line contact: cylinders of R = 50 mm, half approach 1.501341e-5 m, plane strain.
use super::scenes::{A, P0, cylinders, on_plane};
use super::{close, multipliers, near, pressure_at, solve_all, value};
use kontakt::output::Results;
use kontakt::vector::larger;
use serde_json::Value;

fn two(element: &str, k: [f64; 2], far: f64, ratio: f64) -> (Value, Results) {
    solve_all(&cylinders(element, k, far, ratio), 2, &[])
}

fn one(element: &str, k: f64, far: f64) -> (Value, Results) {
    solve_all(&on_plane(element, k, far), 2, &[])
}

/// Errors of force, peak pressure, half-width (in elements) and profile up to 0.8 of the half-width.
struct Errors {
    force: f64,
    peak: f64,
    width: f64,
    profile: f64,
}

fn errors(run: &(Value, Results), k: f64) -> Errors {
    let (summary, results) = run;
    let side = multipliers(results, 0);
    let profile = std::iter::zip(&side.x, &side.pressure).filter(|(x, _)| x[0].abs() < 0.8 * A);
    Errors {
        force: value(summary, "pairs.c.normal_force") / 1e6 - 1.0,
        peak: value(summary, "pairs.c.max_pressure") / P0 - 1.0,
        width: (0.5 * value(summary, "pairs.c.contact_length") - A) / (A / k),
        profile: profile.map(|(x, p)| (p / P0 - (1.0 - (x[0] / A).powi(2)).sqrt()).abs()).fold(0.0, larger),
    }
}

/// Slope of ln error over ln element size.
fn order(levels: &[(f64, f64)]) -> f64 {
    let n = levels.len() as f64;
    let points: Vec<(f64, f64)> = levels.iter().map(|(k, e)| (-k.ln(), e.abs().ln())).collect();
    let mean = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let covariance: f64 = points.iter().map(|p| (p.0 - mean.0) * (p.1 - mean.1)).sum();
    covariance / points.iter().map(|p| (p.0 - mean.0).powi(2)).sum::<f64>()
}

/// Two equal cylinders, four levels of refinement: profile, peak and force converge to theory, the half-width is right to
/// an element.
#[test]
fn two_cylinders_converge() {
    for (element, far, expected) in
        [("quad4", [6.0, 6.0, 4.0, 2.0], 1.2), ("quad8", [4.0; 4], 1.3), ("tri6", [4.0; 4], 1.3)]
    {
        let mut profiles = Vec::new();
        for (k, far) in [2.5, 5.0, 10.0, 20.0].into_iter().zip(far) {
            let e = errors(&two(element, [k, k], far, 1.0), k);
            assert!(e.width.abs() <= 1.0, "{element} {k}: the half-width is off by {:.2} elements", e.width);
            assert!(e.force.abs() <= 0.06 / (k * k) + 2e-4, "{element} {k}: force off by {:.1e}", e.force);
            assert!(e.peak.abs() <= 0.2 / (k * k) + 3e-4, "{element} {k}: peak off by {:.1e}", e.peak);
            profiles.push((k, e.profile));
        }
        let found = order(&profiles);
        assert!(found >= expected, "{element}: profile converges with order {found:.2}: {profiles:?}");
    }
}

/// 60 elements per half-width: peak pressure within 0.2 %, with a wide margin.
#[test]
fn peak_pressure_of_a_fine_mesh() {
    for element in ["quad4", "quad8"] {
        let e = errors(&two(element, [60.0, 60.0], 4.0, 1.0), 60.0);
        assert!(
            e.peak.abs() < 5e-4 && e.force.abs() < 5e-4 && e.width.abs() <= 1.0,
            "{element}: {:.1e} {:.1e}",
            e.peak,
            e.force
        );
    }
}

/// One cylinder on a rigid plane is the half of two equal ones. Coarse meshes, quadratic elements: bounds from what an
/// independent code with linear multipliers found; ours are nodal means of the pressure, hence flatter at the peak.
#[test]
fn coarse_meshes_on_a_rigid_plane() {
    // Elements per half-width; bound on the force, relative; peak over p0 and how far it may be from it.
    let table = [
        (0.25, 0.31, 0.401, 0.02),
        (0.5, 0.06, 0.697, 0.02),
        (1.0, 1.8e-2, 0.971, 0.01),
        (2.0, 6e-3, 1.0, 0.01),
        (3.0, 2.8e-3, 1.0, 0.01),
        (5.0, 1e-3, 1.0, 2.5e-3),
        (10.0, 1.9e-4, 1.0, 1.3e-3),
        (20.0, 6e-5, 1.0, 4e-4),
        (40.0, 3e-5, 1.0, 1e-4),
    ];
    let mut profiles = Vec::new();
    for (k, force, peak, off) in table {
        let e = errors(&one("quad8", k, 4.0), k);
        assert!(e.force.abs() <= force, "{k}: force off by {:.2e}", e.force);
        near(1.0 + e.peak, peak, off, "peak pressure");
        assert!(k < 1.0 || e.width.abs() <= 1.0, "{k}: the half-width is off by {:.2} elements", e.width);
        if k >= 5.0 {
            profiles.push((k, e.profile));
        }
    }
    let found = order(&profiles);
    assert!(found >= 1.5, "profile converges with order {found:.2}: {profiles:?}");
    // Profile at some stations.
    let (_, results) = one("quad8", 20.0, 4.0);
    for (x, p) in
        [(0.0, 1.212074e9), (0.25, 1.173586e9), (0.5, 1.049687e9), (0.75, 8.01711e8), (0.9, 5.28331e8)]
    {
        near(pressure_at(multipliers(&results, 0), x * A), p, 2e-3 * P0, &format!("pressure at {x} a"));
    }
}

/// Unequal moduli, meshes that do not match, either body the stiffer: the half-width stays, the force follows E*.
#[test]
fn unequal_moduli() {
    for (ratio, force, peak) in
        [(2.0, 1.333333e6, 1.616098e9), (5.0, 1.666667e6, 2.020123e9), (10.0, 1.818182e6, 2.203770e9)]
    {
        for k in [[12.0, 12.0], [16.0, 11.0], [10.0, 15.0]] {
            let (summary, _) = two("quad8", k, 4.0, ratio);
            close(&summary, "pairs.c.normal_force", force, 2e-3);
            close(&summary, "pairs.c.max_pressure", peak, 5e-3);
            near(value(&summary, "pairs.c.contact_length"), 2.0 * A, 2.0 * A / 10.0, "length");
        }
    }
    // The upper one softer: forces of the same ratio times its modulus.
    let (summary, _) = two("quad8", [16.0, 11.0], 4.0, 0.1);
    close(&summary, "pairs.c.normal_force", 1.818182e5, 2e-3);
    close(&summary, "pairs.c.max_pressure", 2.203770e8, 5e-3);
}
