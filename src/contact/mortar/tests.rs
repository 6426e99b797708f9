use super::super::{
    Pairing, Surface, pointwise,
    testing::{chain, circle, equal, placed, unequal},
    vector::{dot, norm, sub},
};
use super::{Row, multiplier_side, rows};
use crate::contact::{ConjugateRule, Gap};
use crate::vector::larger;

const TOUCHING: Gap = Gap::Geometry { offset: 0.0 };

/// Upper side of a lower body: run through from right to left.
fn lower(ends: &[f64], quadratic: bool, y: f64) -> Surface {
    let back: Vec<f64> = ends.iter().rev().copied().collect();
    chain(&back, quadratic, |s| [s, y])
}

/// Lower side of an upper body.
fn upper(ends: &[f64], quadratic: bool, y: f64) -> Surface {
    chain(ends, quadratic, |s| [s, y])
}

/// int N dA over the part of each facet within [low, high] along x.
fn consistent(surface: &Surface, low: f64, high: f64) -> Vec<f64> {
    let mut force = vec![0.0; surface.nodes.len()];
    for facet in &surface.facets {
        let (a, b) = (surface.points[facet[0] as usize][0], surface.points[facet[1] as usize][0]);
        let (from, to) = (a.min(b).max(low), a.max(b).min(high));
        if from >= to {
            continue;
        }
        for (at, w) in super::GAUSS6 {
            let x = 0.5 * (from + to) + 0.5 * (to - from) * at;
            let xi = (2.0 * x - a - b) / (b - a);
            let (n, _) = super::super::surface::line_shape(facet.len(), xi);
            for (i, &node) in facet.iter().enumerate() {
                force[node as usize] += n[i] * w * 0.5 * (to - from);
            }
        }
    }
    force
}

/// The rows' vectors as multiples of each side's own outward normal.
fn coefficients(row: impl std::borrow::Borrow<Row>) -> [Vec<(u32, f64)>; 2] {
    let row = row.borrow();
    let side = |s: usize, sign: f64| -> Vec<(u32, f64)> {
        row.terms[s].iter().map(|(node, v)| (*node, sign * dot(v, &row.normal))).collect()
    };
    [side(0, 1.0), side(1, -1.0)]
}

/// What must hold for any two straight, parallel surfaces; `overlap` along x before turning.
fn check_straight(multiplier: &Surface, mortar: &Surface, overlap: [f64; 2], angle: f64, gap: f64) {
    let turned = [multiplier, mortar].map(|s| placed(s, angle, [0.3, -0.2]));
    let rows = rows(&turned[0], &turned[1], &TOUCHING, 1.0, f64::INFINITY);
    let h = (0..multiplier.facets.len()).map(|f| multiplier.facet_size(f)).fold(0.0, larger);
    let mut forces = [vec![0.0; multiplier.nodes.len()], vec![0.0; mortar.nodes.len()]];
    // What cancels where multipliers are extrapolated.
    let mut sizes = forces.clone();
    for row in &rows {
        assert!(row.area > 0.0);
        assert!((row.gap - gap).abs() < 1e-12, "{} instead of {gap}", row.gap);
        let mut way = [0.0; 3];
        let mut scale = 0.0_f64;
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let sum: f64 = coefficients(row.clone())[side].iter().map(|t| t.1).sum();
            // Coefficients larger than one, where multipliers are extrapolated, carry their round-off into the sum.
            let size: f64 = coefficients(row.clone())[side].iter().map(|t| t.1.abs()).sum();
            assert!((sum - 1.0).abs() < 4e-14 * size, "{sum} {size}");
            for (node, c) in coefficients(row.clone())[side].clone() {
                let p = turned[side].points[node as usize];
                way = [way[0] + sign * c * p[0], way[1] + sign * c * p[1], 0.0];
                scale = larger(scale, c.abs());
                forces[side][node as usize] += c * row.area;
                sizes[side][node as usize] += (c * row.area).abs();
            }
        }
        let expected = row.normal.map(|n| n * gap);
        assert!(
            norm(&sub(&way, &expected)) < 1e-12 * scale.max(1.0),
            "linear field: {way:?} {expected:?} {scale}"
        );
    }
    let total: f64 = rows.iter().map(|r| r.area).sum();
    assert!((total - (overlap[1] - overlap[0]).max(0.0)).abs() < 1e-11, "area {total}, {overlap:?}");
    for (side, surface) in [multiplier, mortar].into_iter().enumerate() {
        let expected = consistent(surface, overlap[0], overlap[1]);
        for ((got, want), size) in forces[side].iter().zip(&expected).zip(&sizes[side]) {
            let tolerance = 1e-11 * h.max(0.01) + 1e-12 * size + 1e-12 * gap.abs();
            assert!((got - want).abs() < tolerance, "side {side}: {got} {want} {size}");
        }
    }
}

#[test]
fn uniform_pressure_reaches_both_sides_consistently() {
    for (q, r) in [(false, false), (true, true), (true, false), (false, true)] {
        for (n, m) in [(5, 7), (7, 5), (1, 50), (50, 1), (97, 101), (3, 3), (4, 16)] {
            for angle in [0.0, 0.7, 2.5] {
                for gap in [0.0, 1e-3, -1e-4] {
                    let (a, b) = (equal(n, 0.0, 0.04), unequal(m, 0.0, 0.04));
                    check_straight(&lower(&a, q, 0.02), &upper(&b, r, 0.02 + gap), [0.0, 0.04], angle, gap);
                    check_straight(&upper(&a, q, 0.02 + gap), &lower(&b, r, 0.02), [0.0, 0.04], angle, gap);
                }
            }
        }
    }
}

#[test]
fn partial_overlaps_are_exact() {
    for (q, r) in [(false, false), (true, true), (true, false), (false, true)] {
        for step in 1..80 {
            let end = 0.0137 * f64::from(step);
            for (n, m) in [(4, 3), (1, 10), (10, 1), (2, 2)] {
                let a = lower(&equal(n, 0.0, 1.0), q, 0.0);
                // One end covered, then neither.
                let b = upper(&equal(m, -0.3, end), r, 0.0);
                check_straight(&a, &b, [0.0, end.min(1.0)], 0.4, 0.0);
                let c = upper(&equal(m, 0.31, 0.31 + 0.3 * end), r, 1e-3);
                check_straight(&a, &c, [0.31, (0.31 + 0.3 * end).min(1.0)], 0.4, 1e-3);
            }
        }
    }
}

#[test]
fn extreme_facets_are_exact() {
    let thin: Vec<f64> = equal(4, 0.0, 1e-3).into_iter().chain(equal(3, 0.1, 1.0)).collect();
    for (q, r) in [(false, false), (true, true)] {
        check_straight(&lower(&thin, q, 0.0), &upper(&equal(9, 0.0, 1.0), r, 0.0), [0.0, 1.0], 0.3, 0.0);
        // Gap far larger than the edges.
        check_straight(&lower(&equal(40, 0.0, 0.04), q, 0.0), &upper(&thin, r, 2.0), [0.0, 0.04], 0.3, 2.0);
        // A part so short that the multipliers extrapolate a hundredfold.
        let short = upper(&equal(2, 0.4, 0.41), r, 0.0);
        let rows = rows(&lower(&equal(1, 0.0, 1.0), q, 0.0), &short, &TOUCHING, 1.0, 1.0);
        let area: f64 = rows.iter().map(|r| r.area).sum();
        assert!((area - 0.01).abs() < 1e-14 && rows.iter().all(|r| r.area > 0.0 && r.gap.abs() < 1e-9));
    }
}

/// Uncovered nodes carry no multiplier where hardly anything of their edge is covered.
#[test]
fn coefficients_stay_moderate_at_the_end_of_an_overlap() {
    for q in [false, true] {
        let a = lower(&equal(8, 0.0, 1.0), q, 0.0);
        for step in 0..200 {
            let b = upper(&equal(9, 0.0, 0.5 + 0.00187 * f64::from(step)), q, 0.0);
            for row in rows(&a, &b, &TOUCHING, 1.0, 1.0) {
                for (_, c) in coefficients(row.clone()).into_iter().flatten() {
                    assert!(c.abs() < 12.0, "{c}");
                }
            }
        }
    }
}

#[test]
fn matching_nodes_make_single_terms() {
    for angle in [0.0, 0.9, 4.0] {
        for noise in [0.0, 1e-15] {
            let ends = unequal(9, 0.0, 0.03);
            let moved: Vec<f64> =
                ends.iter().enumerate().map(|(i, x)| x + noise * (i as f64).cos()).collect();
            for q in [false, true] {
                let a = placed(&lower(&ends, q, 0.0), angle, [0.1, 0.1]);
                let b = placed(&upper(&moved, q, 0.0), angle, [0.1, 0.1]);
                let rows = rows(&a, &b, &TOUCHING, 1.0, 1.0);
                assert_eq!(rows.len(), a.nodes.len());
                for row in rows {
                    assert_eq!(
                        coefficients(row.clone())[0].len(),
                        coefficients(row.clone())[1].len(),
                        "{:?}",
                        coefficients(row.clone())
                    );
                    for (_, c) in &coefficients(row.clone())[1] {
                        assert!(coefficients(row.clone())[0].iter().any(|(_, d)| (c - d).abs() < 1e-12));
                    }
                    let [own, other] = coefficients(row.clone());
                    let own = own.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                    let other = other.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                    let (x, y) = (a.points[own.0 as usize], b.points[other.0 as usize]);
                    assert!(own.0 == row.node && norm(&sub(&x, &y)) < 1e-14);
                    assert!(q || coefficients(row.clone())[1].len() == 1);
                }
            }
        }
    }
}

#[test]
fn concentric_circles_have_a_uniform_gap() {
    for gap in [1e-4, -1e-4, 0.3] {
        for (n, m) in [(64, 64), (60, 77), (80, 33)] {
            let disc = circle(n, 1.0, true, false, 0.1);
            let bore = circle(m, 1.0 + gap, true, true, 0.0);
            // A parabola leaves the circle by (half angle)^4 / 8 times the radius at most.
            let coarse = std::f64::consts::PI / n.min(m) as f64;
            let leave = coarse.powi(4) / 4.0;
            for (a, b) in [(&disc, &bore), (&bore, &disc)] {
                let found = rows(a, b, &TOUCHING, 1.0, f64::INFINITY);
                assert_eq!(found.len(), a.nodes.len());
                let area: f64 = found.iter().map(|r| r.area).sum();
                assert!((area / a.weights.iter().sum::<f64>() - 1.0).abs() < 1e-7);
                for row in &found {
                    assert!(
                        (row.gap - gap).abs() < 1e-6 * gap.abs() + 4.0 * leave,
                        "{} {gap} {n} {m}",
                        row.gap
                    );
                    let x = a.points[row.node as usize];
                    let sine = x[0] * row.normal[1] - x[1] * row.normal[0];
                    assert!(sine.abs() < 1e-12);
                }
            }
            // Linear facets, radial normals.
            let a = chain(&unequal(n, 0.0, std::f64::consts::TAU), false, |s| [s.cos(), s.sin()]);
            let b = circle(m, 1.0 + gap, false, true, 0.2);
            let found = rows(&a, &b, &TOUCHING, 1.0, f64::INFINITY);
            assert_eq!(found.len(), n);
            for row in &found {
                assert!((row.gap - gap).abs() < 4.0 * coarse.powi(2) * (1.0 + gap.abs()));
            }
        }
    }
    // Matching circles, one on the other.
    let (a, b) = (circle(40, 0.1, true, false, 0.0), circle(40, 0.1, true, true, 0.0));
    for row in rows(&a, &b, &TOUCHING, 1.0, 1.0) {
        assert!(
            row.gap.abs() < 1e-16 && coefficients(row.clone())[0].len() == coefficients(row.clone())[1].len(),
            "{row:?}"
        );
    }
}

#[test]
fn nodes_on_a_circle_have_radial_normals() {
    for q in [false, true] {
        let surface = chain(&unequal(40, 0.0, std::f64::consts::TAU), q, |s| [s.cos(), s.sin()]);
        for (p, n) in surface.points.iter().zip(&surface.normals) {
            let tolerance = if q { 1e-6 } else { 1e-13 };
            assert!((p[0] * n[1] - p[1] * n[0]).abs() < tolerance, "{q}: {}", p[0] * n[1] - p[1] * n[0]);
            assert!(p[0] * n[0] + p[1] * n[1] > 0.99);
        }
    }
}

#[test]
fn circle_on_a_line_opens_quadratically() {
    let radius = 0.05;
    let arc =
        |n: usize| chain(&equal(n, -0.4, 0.4), true, move |s| [radius * s.sin(), radius * (1.0 - s.cos())]);
    let base = lower(&equal(30, -0.04, 0.04), true, 0.0);
    let (arc, plane) = (arc(50), Surface::rigid_plane([0.0, 0.0], [0.0, 1.0], 10.0));
    for other in [&base, &plane] {
        let found = rows(&arc, other, &TOUCHING, 1.0, 1.0);
        assert_eq!(found.len(), arc.nodes.len());
        for row in found {
            // Along the circle's normal: (1 - cos) / cos.
            let x = arc.points[row.node as usize][0] / radius;
            let exact = radius * (1.0 / (1.0 - x * x).sqrt() - 1.0);
            let h: f64 = 0.8 / 100.0;
            assert!((row.gap - exact).abs() < radius * h * h, "{} {exact}", row.gap);
        }
    }
    // On a rigid circle.
    let rigid = Surface::rigid_circle([0.0, radius], radius, false);
    let found = rows(&base, &rigid, &TOUCHING, 1.0, 0.02);
    assert!(found.len() > 30);
    for row in found {
        let x = base.points[row.node as usize][0] / radius;
        let exact = radius * (1.0 - (1.0 - x * x).max(0.0).sqrt());
        assert!((row.gap - exact).abs() < 3e-4 * (1.0 + x.abs()), "{} {exact} {x}", row.gap);
    }
}

/// Rows change little when the ends of the surfaces move by round-off against each other.
#[test]
fn ends_that_nearly_coincide_change_nothing() {
    for q in [false, true] {
        let at = |shift: f64| {
            let a = lower(&equal(20, 0.0, 0.025), q, 0.0125);
            let b = upper(&equal(13, 0.0, 0.025 + shift), q, 0.0125);
            let c = upper(&equal(13, 0.0, 0.0125 + shift), q, 0.0125);
            [rows(&a, &b, &TOUCHING, 1.0, 1.0), rows(&a, &c, &TOUCHING, 1.0, 1.0)].concat()
        };
        let exact = at(0.0);
        for shift in [1e-12, -1e-12, 1e-10, -1e-10, 1e-17, 1e-9, -1e-9] {
            same(&exact, &at(shift), shift.abs() * 1e4 + 1e-11, 0.025);
        }
    }
}

/// Rows agree within `tolerance`.
fn same(a: &[Row], b: &[Row], tolerance: f64, size: f64) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!(a.node == b.node && (a.area - b.area).abs() < tolerance * size, "{} {}", a.area, b.area);
        assert!((a.gap - b.gap).abs() < tolerance * size, "{} {}", a.gap, b.gap);
        for side in 0..2 {
            let term = |row: &Row, node: u32| {
                coefficients(row.clone())[side].iter().find(|t| t.0 == node).map_or(0.0, |t| t.1)
            };
            for &(node, _) in coefficients(a.clone())[side].iter().chain(&coefficients(b.clone())[side]) {
                let (x, y) = (term(a, node), term(b, node));
                assert!((x - y).abs() < tolerance * 10.0, "{x} {y} {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn frame_does_not_matter() {
    for q in [false, true] {
        let a = chain(&equal(31, -0.5, 0.5), q, |s| [s, 0.1 * s * s]);
        let b = lower(&unequal(17, -0.45, 0.6), q, 0.0);
        let here = rows(&a, &b, &TOUCHING, 1.0, 1.0);
        for (angle, shift) in [(1.0, [0.0, 0.0]), (0.0, [1.0, 2.0]), (-2.2, [0.3, 0.4])] {
            let (c, d) = (placed(&a, angle, shift), placed(&b, angle, shift));
            same(&here, &rows(&c, &d, &TOUCHING, 1.0, 1.0), 2e-12, 1.0);
            assert_eq!(multiplier_side([&a, &b], [1.0, 1.0]), multiplier_side([&c, &d], [1.0, 1.0]));
        }
        // Unit of length.
        let scaled = |s: &Surface| {
            let u: Vec<[f64; 3]> = s.points.iter().map(|p| p.map(|c| 999.0 * c)).collect();
            s.moved(&u)
        };
        let large = rows(&scaled(&a), &scaled(&b), &TOUCHING, 1.0, 1000.0);
        let back: Vec<Row> =
            large.into_iter().map(|r| Row { gap: r.gap / 1000.0, area: r.area / 1000.0, ..r }).collect();
        same(&here, &back, 1e-12, 1.0);
    }
}

#[test]
fn finer_then_softer_side_carries_multipliers() {
    let (a, b) = (lower(&equal(5, 0.0, 1.0), false, 0.0), upper(&equal(7, 0.0, 1.0), false, 0.0));
    assert_eq!(multiplier_side([&a, &b], [1.0, 2.0]), 1);
    assert_eq!(multiplier_side([&b, &a], [2.0, 1.0]), 0);
    let c = upper(&equal(10, 0.0, 2.0), false, 0.0);
    assert_eq!(multiplier_side([&a, &c], [2.0, 1.0]), 1);
    assert_eq!(multiplier_side([&c, &a], [1.0, 2.0]), 0);
    assert_eq!(multiplier_side([&a, &c], [1.0, 1.0]), 0);
    // Fine only where nothing is opposite.
    let graded: Vec<f64> = equal(4, 0.0, 1.0).into_iter().chain(equal(100, 1.01, 2.0)).collect();
    assert_eq!(multiplier_side([&a, &upper(&graded, false, 0.0)], [1.0, 1.0]), 0);
}

/// Boundaries of whole bodies, closed: only what faces each other is paired.
#[test]
fn whole_boundaries_pair_where_they_face() {
    let square = |x: [f64; 2], y: [f64; 2], n: usize| {
        let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]], [x[0], y[0]]];
        chain(&equal(4 * n, 0.0, 4.0), false, move |s| {
            let (side, t) = ((s.floor() as usize).min(3), s - s.floor().min(3.0));
            let (a, b) = (corners[side], corners[side + 1]);
            [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
        })
    };
    let lower = square([0.0, 1.0], [-0.1, 0.0], 6);
    for gap in [0.0, 0.02, -0.003] {
        let upper = square([0.2, 0.7], [gap, 0.1 + gap], 5);
        let found = rows(&upper, &lower, &TOUCHING, 1.0, f64::INFINITY);
        assert_eq!(found.len(), 6, "{gap}");
        for row in &found {
            assert!(upper.points[row.node as usize][1] == gap && (row.gap - gap).abs() < 1e-14);
            assert!((row.normal[1] + 1.0).abs() < 1e-14, "{:?}", row.normal);
        }
        let area: f64 = found.iter().map(|r| r.area).sum();
        assert!((area - 0.5).abs() < 1e-12);
        let found = rows(&lower, &upper, &TOUCHING, 1.0, f64::INFINITY);
        assert!((found.iter().map(|r| r.area).sum::<f64>() - 0.5).abs() < 1e-12);
        assert!(found.iter().all(|r| (r.gap - gap).abs() < 1e-14));
    }
    // Penetration deeper than the facets are long.
    let (fine, deep) = (square([0.0, 1.0], [-0.1, 0.0], 120), square([0.2, 0.7], [-0.03, 0.07], 120));
    for (a, b) in [(&deep, &fine), (&fine, &deep)] {
        let found = rows(a, b, &TOUCHING, 1.0, f64::INFINITY);
        assert!((found.iter().map(|r| r.area).sum::<f64>() - 0.5).abs() < 1e-12);
        assert!(found.iter().all(|r| (r.gap + 0.03).abs() < 1e-13 && r.normal[1].abs() > 1.0 - 1e-13));
    }
    // A small disc anywhere in a bore, and far outside another.
    let disc = placed(&circle(40, 0.3, true, false, 0.0), 0.0, [0.0, -0.7]);
    let bore = circle(90, 1.0, true, true, 0.0);
    let found = rows(&disc, &bore, &TOUCHING, 1.0, f64::INFINITY);
    assert_eq!(found.len(), 80);
    for row in &found {
        let (x, n) = (disc.points[row.node as usize], row.normal);
        let along = dot(&x, &n);
        let exact = (along * along + 1.0 - dot(&x, &x)).sqrt() - along;
        assert!((row.gap - exact).abs() < 5e-3, "{} {exact}", row.gap);
    }
    let other = placed(&circle(30, 0.3, true, false, 0.0), 0.0, [0.0, 1.0]);
    let found = rows(&disc, &other, &TOUCHING, 1.0, f64::INFINITY);
    assert!(!found.is_empty() && found.iter().all(|r| r.gap > 1.0 && r.normal[1] > 0.5));
}

#[test]
fn given_gaps_and_distances() {
    let (a, b) = (lower(&equal(5, 0.0, 1.0), false, 0.0), upper(&equal(7, 0.0, 1.0), false, 0.25));
    let gaps = |gap: Gap, distance: f64| -> Vec<f64> {
        rows(&a, &b, &gap, 1.0, distance).iter().map(|r| r.gap).collect()
    };
    assert_eq!(gaps(Gap::Value(1e-3), f64::INFINITY), [1e-3; 6]);
    assert_eq!(gaps(Gap::Value(1e-3), 1e-2), [1e-3; 6]);
    assert!(gaps(Gap::Geometry { offset: -0.3 }, 0.1).iter().all(|g| (g + 0.05).abs() < 1e-14));
    assert_eq!(gaps(TOUCHING, 0.25).len(), 6);
    assert!(gaps(TOUCHING, 0.24).is_empty());
    assert_eq!(rows(&a, &b, &TOUCHING, 0.1, 1.0).iter().map(|r| r.area).sum::<f64>(), 0.1);
    let closed = b.moved(&vec![[0.0, -0.2, 0.0]; b.nodes.len()]);
    assert!(rows(&a, &closed, &TOUCHING, 1.0, 0.1).iter().all(|r| (r.gap - 0.05).abs() < 1e-15));
    let pairing = Pairing::new([&a, &b], &TOUCHING, ConjugateRule::ClosestPoint);
    let found = pointwise(&a, &pairing.conjugates[0], 0.25);
    assert_eq!(found.len(), 6);
    assert!(
        found
            .iter()
            .all(|r| coefficients(r.clone())[0] == [(r.node, 1.0)] && r.area == a.weights[r.node as usize])
    );
    assert!(pointwise(&a, &pairing.conjugates[0], 0.2).is_empty());
}

#[test]
fn rigid_surfaces_face_outwards() {
    let disc = Surface::rigid_circle([1.0, 2.0], 0.5, false);
    let bore = Surface::rigid_circle([1.0, 2.0], 0.5, true);
    for (surface, sign) in [(&disc, 1.0), (&bore, -1.0)] {
        assert!(surface.facets.len() >= 720);
        for (x, n) in surface.points.iter().zip(&surface.normals) {
            let radial = sub(x, &[1.0, 2.0, 0.0]);
            assert!((sign * dot(n, &radial) - 0.5).abs() < 1e-12);
        }
    }
    let plane = Surface::rigid_plane([1.0, 2.0], [3.0, 4.0], 7.0);
    assert!(norm(&sub(&plane.normals[0], &[0.6, 0.8, 0.0])) < 1e-15);
    assert!((plane.extent() - 14.0).abs() < 1e-13);
    let wedge = Surface::rigid_polyline(&[[1.0, 1.0], [0.0, 0.0], [-1.0, 1.0]]);
    let normal = wedge.area_vector(0, 0.0);
    assert!(normal[0] < 0.0 && normal[1] > 0.0);
    let triangle = Surface::rigid_polyline(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]);
    assert_eq!((triangle.nodes.len(), triangle.facets.len()), (3, 3));
    assert_eq!(triangle.facets[2], [2, 0]);
    // A wide block on the two sides of a ridge, the ridge's top in the middle of an edge.
    let ridge = Surface::rigid_polyline(&[[1.0, -1.0], [0.0, 0.0], [-1.0, -1.0]]);
    let found = rows(&upper(&equal(5, -0.5, 0.5), false, 0.0), &ridge, &TOUCHING, 1.0, 2.0);
    assert_eq!(found.len(), 6);
    assert!((found[0].gap - 0.5).abs() < 1e-12 && found[2].gap < 0.1);
}

#[test]
fn many_facets_take_little_time() {
    let n = 20_000;
    let start = std::time::Instant::now();
    let a = placed(&lower(&equal(n, 0.0, 1.0), false, 0.0), 0.7, [0.0, 0.0]);
    let b = placed(&upper(&equal(n + 1, 0.0, 1.0), false, 0.1), 0.7, [0.0, 0.0]);
    assert_eq!(rows(&a, &b, &TOUCHING, 1.0, f64::INFINITY).len(), n + 1);
    let (disc, bore) = (circle(n, 1.0, true, false, 0.0), circle(n, 1.1, true, true, 0.0));
    assert_eq!(rows(&disc, &bore, &TOUCHING, 1.0, f64::INFINITY).len(), 2 * n);
    let pairing = Pairing::new([&a, &b], &TOUCHING, ConjugateRule::Intersection);
    assert!(pairing.conjugates[0].iter().all(Option::is_some));
    assert!(start.elapsed().as_secs_f64() < 60.0, "{:?}", start.elapsed());
}
