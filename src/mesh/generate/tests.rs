use super::*;
use crate::mesh::check;
use crate::mesh::testing::*;
use crate::vector::{larger, smaller};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

fn mesh(shape: &Shape, kind: ElementKind) -> Mesh {
    let mesh = generate(shape, kind, 0.0, [0.0; 2]).unwrap();
    check(&mesh).unwrap();
    mesh
}

/// Positions from 0 to `end`, first step `first`, growing evenly to `end` in n steps.
fn graded(first: f64, end: f64, n: usize) -> Vec<f64> {
    let sum = |q: f64| (0..n).map(|i| first * q.powi(i as i32)).sum::<f64>();
    let (mut low, mut high) = (0.1, 4.0);
    for _ in 0..200 {
        let mid = 0.5 * (low + high);
        if sum(mid) < end { low = mid } else { high = mid }
    }
    let mut at = vec![0.0];
    for i in 0..n {
        at.push(at[i] + first * low.powi(i as i32));
    }
    at[n] = end;
    at
}

fn both_sides(half: &[f64]) -> Grading {
    let at = half[1..].iter().rev().map(|a| -a).chain(half.iter().copied()).collect();
    Grading { at }
}

fn half_disc(radius: f64, up: bool, angle: Grading, depth: Grading, core: usize) -> Shape {
    Shape::HalfDisc { center: [0.0; 2], radius, up, angle, depth, core }
}

/// Half disc for a Hertz contact: R = 0.05 m, cells of 2.6e-5 m at the contact point, up to 5e-3 m elsewhere.
fn hertz() -> Shape {
    let angle = both_sides(&graded(2.6e-5 / 0.05, FRAC_PI_4, 48));
    half_disc(0.05, false, angle, Grading { at: graded(2.6e-5 / 0.05, 0.5, 40) }, 8)
}

#[test]
fn rectangle_is_exact() {
    let shape = Shape::Rectangle { x: uniform(-2.0, 2.0, 4), y: uniform(1.0, 4.0, 3) };
    for kind in ElementKind::ALL {
        let mesh = mesh(&shape, kind);
        assert_sound(&mesh, 0);
        assert!((area(&mesh) - 12.0).abs() < 1e-12);
        for (name, length) in [("left", 3.0), ("right", 3.0), ("bottom", 4.0), ("top", 4.0)] {
            assert!((surface_length(&mesh, name) - length).abs() < 1e-12, "{name}");
        }
        let x_left = mesh.surfaces["left"].iter().flat_map(|&f| mesh.facet_nodes(f));
        assert!(x_left.into_iter().all(|n| mesh.points[n as usize][0] == -2.0));
        assert_mirrored(&mesh, [-1.0, 1.0]);
    }
    assert_eq!(mesh(&shape, ElementKind::Quad4).points.len(), 20);
    assert_eq!(mesh(&shape, ElementKind::Quad8).points.len(), 20 + 31);
    assert_eq!(mesh(&shape, ElementKind::Tri6).points.len(), 20 + 31 + 12);
}

#[test]
fn an_unsymmetric_grading_is_not_mirrored() {
    let shape = Shape::Rectangle { x: Grading { at: vec![-2.0, 0.5, 2.0] }, y: uniform(1.0, 4.0, 3) };
    let mesh = mesh(&shape, ElementKind::Quad4);
    assert!(std::panic::catch_unwind(|| assert_mirrored(&mesh, [-1.0, 1.0])).is_err());
}

#[test]
fn rotation_and_translation_move_every_node() {
    let shape = Shape::Rectangle { x: uniform(0.0, 2.0, 2), y: uniform(0.0, 1.0, 1) };
    let turned = generate(&shape, ElementKind::Quad4, FRAC_PI_2, [10.0, 20.0]).unwrap();
    let expected = mesh(&shape, ElementKind::Quad4);
    for (p, q) in turned.points.iter().zip(&expected.points) {
        assert_eq!(*p, [10.0 - q[1], 20.0 + q[0], 0.0]);
    }
}

/// Checks area and arc length on a coarse and a fine mesh: small errors, and the order at which they vanish.
fn assert_converges(
    shape: impl Fn(usize) -> Shape,
    arcs: &[&str],
    exact_area: f64,
    exact_arc: f64,
    holes: i64,
) {
    for kind in ElementKind::ALL {
        let errors = [1, 2].map(|n| {
            let mesh = mesh(&shape(n), kind);
            assert_sound(&mesh, holes);
            let arc: f64 = arcs.iter().map(|name| surface_length(&mesh, name)).sum();
            [(area(&mesh) / exact_area - 1.0).abs(), (arc / exact_arc - 1.0).abs()]
        });
        // Straight sides: h^2. Parabolic sides: h^4 in area (arc length is measured over two chords).
        let quadratic = kind.n_nodes() > kind.n_corners();
        let area_rate = (errors[0][0] / errors[1][0]).log2();
        assert!(errors[1][0] < if quadratic { 1e-4 } else { 2e-2 }, "{kind:?}: {errors:?}");
        assert!(area_rate > if quadratic { 3.7 } else { 1.9 }, "{kind:?}: {errors:?}");
        assert!((errors[0][1] / errors[1][1]).log2() > 1.9, "{kind:?}: {errors:?}");
    }
}

#[test]
fn ring_sector_and_full_ring_converge() {
    let ring = |end: f64, n: usize| Shape::Ring {
        center: [1.0, 2.0],
        radius: uniform(1.0, 2.0, 2),
        angle: uniform(0.0, end, n),
    };
    assert_converges(|n| ring(FRAC_PI_2, 4 * n), &["inner", "outer"], 0.75 * PI, 1.5 * PI, 0);
    assert_converges(|n| ring(TAU, 12 * n), &["inner", "outer"], 3.0 * PI, 6.0 * PI, 1);
    let sector = mesh(&ring(FRAC_PI_2, 4), ElementKind::Quad8);
    assert_eq!(sector.surfaces.keys().collect::<Vec<_>>(), ["end", "inner", "outer", "start"]);
    let on = |name: &str, d: usize, value: f64| {
        sector.surfaces[name]
            .iter()
            .flat_map(|&f| sector.facet_nodes(f))
            .all(|n| sector.points[n as usize][d] == value)
    };
    assert!(on("start", 1, 2.0) && on("end", 0, 1.0), "symmetry planes are exact");
    assert_eq!(mesh(&ring(TAU, 12), ElementKind::Quad4).surfaces.len(), 2);
}

#[test]
fn block_with_an_arc_converges() {
    // A rectangle 2 x 1 with a half-moon of 90 degrees, radius sqrt 2, bulging below its bottom edge.
    let shape = |n: usize| Shape::Block {
        corners: [[-1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 1.0]],
        arcs: [Some([0.0, 1.0]), None, None, None],
        u: uniform(0.0, 1.0, 4 * n),
        v: uniform(0.0, 1.0, 2 * n),
    };
    let arc = 2f64.sqrt() * FRAC_PI_2;
    let segment = 0.5 * 2.0 * (FRAC_PI_2 - 1.0);
    assert_converges(shape, &["bottom"], 2.0 + segment, arc, 0);
    let mesh = mesh(&shape(2), ElementKind::Tri6);
    for node in mesh.surfaces["bottom"].iter().flat_map(|&f| mesh.facet_nodes(f)) {
        let [x, y, _] = mesh.points[node as usize];
        assert!((x.hypot(y - 1.0) - 2f64.sqrt()).abs() < 1e-15);
        // Nodes divide the arc's angle evenly.
        let step = x.atan2(1.0 - y) / (FRAC_PI_2 / 16.0);
        assert!((step - step.round()).abs() < 1e-12);
    }
}

#[test]
fn straight_sides_have_their_node_in_the_middle() {
    let shape = Shape::Block {
        corners: [[0.0, 0.0], [3.0, 0.5], [2.5, 2.0], [0.2, 1.5]],
        arcs: [None; 4],
        u: Grading { at: vec![0.0, 0.1, 0.4, 1.0] },
        v: uniform(0.0, 1.0, 2),
    };
    for kind in [ElementKind::Tri6, ElementKind::Quad8] {
        let mesh = mesh(&shape, kind);
        assert_sound(&mesh, 0);
        for (_, facet) in mesh.sides() {
            let p: Vec<_> = mesh.facet_nodes(facet).map(|n| mesh.points[n as usize]).collect();
            assert_eq!(p[2], [0, 1, 2].map(|d| 0.5 * (p[0][d] + p[1][d])));
        }
    }
}

#[test]
fn disc_and_half_disc_converge() {
    let disc = |n: usize| Shape::Disc {
        center: [0.0; 2],
        radius: 2.0,
        quarter: 4 * n,
        depth: uniform(0.0, 0.4, 2 * n),
    };
    assert_converges(disc, &["arc"], 4.0 * PI, 4.0 * PI, 0);
    for up in [false, true] {
        let angle = |n| uniform(-FRAC_PI_4, FRAC_PI_4, 4 * n);
        let half = |n: usize| half_disc(2.0, up, angle(n), uniform(0.0, 0.5, 2 * n), 2 * n);
        assert_converges(half, &["arc"], 2.0 * PI, 2.0 * PI, 0);
        let mesh = mesh(&half(2), ElementKind::Quad8);
        assert!((surface_length(&mesh, "flat") - 4.0).abs() < 1e-14);
        let side = if up { 1.0 } else { -1.0 };
        assert!(mesh.points.iter().all(|p| side * p[1] >= 0.0), "on the wrong side of the mid-plane");
        assert!(
            mesh.surfaces["flat"]
                .iter()
                .flat_map(|&f| mesh.facet_nodes(f))
                .all(|n| mesh.points[n as usize][1] == 0.0)
        );
    }
}

#[test]
fn discs_are_mirrored_to_the_last_bit() {
    for kind in ElementKind::ALL {
        for quarter in [5, 6] {
            // The diagonal of a middle column has no mirror image.
            if quarter % 2 == 1 && kind.n_corners() == 3 {
                continue;
            }
            let depth = Grading { at: vec![0.0, 0.1, 0.37] };
            let mesh = mesh(&Shape::Disc { center: [0.0; 2], radius: 0.7, quarter, depth }, kind);
            assert_mirrored(&mesh, [-1.0, 1.0]);
            assert_mirrored(&mesh, [1.0, -1.0]);
        }
        let mesh = mesh(&hertz(), kind);
        assert_mirrored(&mesh, [-1.0, 1.0]);
        assert!(mesh.points.contains(&[0.0, -0.05, 0.0]), "the contact point is a node");
    }
}

#[test]
fn nodes_of_the_rim_lie_on_the_circle() {
    for kind in ElementKind::ALL {
        let mesh = mesh(&hertz(), kind);
        for node in mesh.surfaces["arc"].iter().flat_map(|&f| mesh.facet_nodes(f)) {
            let [x, y, _] = mesh.points[node as usize];
            assert!((x.hypot(y) - 0.05).abs() < 1e-16, "{x}, {y}");
        }
    }
}

#[test]
fn hertz_half_disc_has_good_cells_of_the_right_size() {
    let mesh = mesh(&hertz(), ElementKind::Quad4);
    let (low, high) = angles(&mesh);
    assert!(low > 50.0 && high < 135.0, "{low} {high}");
    let length = |f| facet_length(&mesh, f).0;
    let arc: Vec<f64> = mesh.surfaces["arc"].iter().map(|&f| length(f)).collect();
    let shortest = arc.iter().copied().fold(f64::MAX, smaller);
    assert!((shortest / 2.6e-5 - 1.0).abs() < 1e-3, "{shortest}");
    let longest = boundary(&mesh).into_iter().map(length).fold(0.0, larger);
    assert!(longest < 7e-3, "{longest}");
    // The first layer is as thin as the cells are wide, at the contact point.
    assert!(mesh.points.iter().any(|p| p[0] == 0.0 && (p[1] + 0.05 - 2.6e-5).abs() < 1e-12));
}

#[test]
fn half_discs_of_all_proportions_have_good_cells() {
    for end in [10.0, 15.0, 20.0, 30.0, 45.0, 60.0, 70.0, 80.0f64] {
        for depth in [0.02, 0.1, 0.3, 0.5, 0.7, 0.9] {
            for first in [1e-3, 0.25] {
                let angle = both_sides(&graded(first * end.to_radians(), end.to_radians(), 12));
                let depth = Grading { at: graded(first * depth, depth, 8) };
                let mesh = mesh(&half_disc(1.0, false, angle, depth.clone(), 5), ElementKind::Quad4);
                let (low, high) = angles(&mesh);
                assert!(low > 25.0 && high < 155.0, "{end} deg, {depth:?}: {low} {high}");
            }
        }
    }
}

#[test]
fn discs_of_all_proportions_have_good_cells() {
    for depth in [0.05, 0.3, 0.6, 0.9] {
        for quarter in [1, 2, 7, 16] {
            // A core that fills most of the disc is nearly round: its corners open up.
            let limits = if depth < 0.2 { (20.0, 162.0) } else { (44.0, 141.0) };
            let depth = uniform(0.0, depth, 4);
            let mesh =
                mesh(&Shape::Disc { center: [0.0; 2], radius: 1.0, quarter, depth }, ElementKind::Quad4);
            let (low, high) = angles(&mesh);
            assert!(low > limits.0 && high < limits.1, "{quarter}: {low} {high}");
        }
    }
}

#[test]
fn wrong_input_is_refused_with_the_reason() {
    let line = || uniform(0.0, 1.0, 2);
    let rectangle = |x: Vec<f64>| Shape::Rectangle { x: Grading { at: x }, y: line() };
    let block = |corners, arc| Shape::Block { corners, arcs: [arc, None, None, None], u: line(), v: line() };
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let ring = |r: [f64; 2], a: Vec<f64>| Shape::Ring {
        center: [0.0; 2],
        radius: Grading { at: r.to_vec() },
        angle: Grading { at: a },
    };
    let half = |angle: Vec<f64>, depth: Vec<f64>, core| {
        half_disc(1.0, true, Grading { at: angle }, Grading { at: depth }, core)
    };
    let cases = [
        (rectangle(vec![0.0]), "at least two"),
        (rectangle(vec![0.0, 0.0]), "must increase"),
        (rectangle(vec![0.0, f64::NAN]), "finite"),
        (block([square[0], square[3], square[2], square[1]], None), "counter-clockwise"),
        (block(square, Some([0.2, 1.0])), "must be equal"),
        (block(square, Some([0.5, 0.0])), "half circle"),
        (block([square[0], square[0], square[2], square[3]], None), "coincide"),
        (ring([0.0, 1.0], vec![0.0, 1.0]), "inner radius"),
        (ring([1.0, 2.0], vec![0.0, 2.0]), "at most 90"),
        (ring([1.0, 2.0], (0..9).map(f64::from).collect()), "full turn"),
        (half(vec![-0.5, 0.4], vec![0.0, 0.5], 2), "symmetric"),
        (half(vec![-FRAC_PI_2, FRAC_PI_2], vec![0.0, 0.5], 2), "below 90"),
        (half(vec![-0.5, 0.5], vec![0.1, 0.5], 2), "start at 0"),
        (half(vec![-0.5, 0.5], vec![0.0, 1.0], 2), "end below 1"),
        (half(vec![-0.5, 0.5], vec![0.0, 0.5], 0), "at least 1"),
        (Shape::Disc { center: [0.0; 2], radius: -1.0, quarter: 2, depth: uniform(0.0, 0.5, 2) }, "positive"),
        (
            Shape::Disc { center: [0.0; 2], radius: 1.0, quarter: 1 << 40, depth: uniform(0.0, 0.5, 2) },
            "fewer cells",
        ),
    ];
    for (shape, part) in cases {
        let error = generate(&shape, ElementKind::Quad4, 0.0, [0.0; 2]).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}
