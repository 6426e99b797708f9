use super::*;
use crate::element::ElementKind;
use crate::mesh::testing::*;
use crate::mesh::{Grading, Shape};
use crate::mesh::{check, generate};
use crate::vector::{larger, smaller};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn build(shape: &Shape, kind: ElementKind) -> Mesh {
    generate(shape, kind, 0.0, [0.0; 2]).unwrap()
}

fn ring(end: f64, n: usize) -> Shape {
    Shape::Ring { center: [1.0, 2.0], radius: uniform(1.0, 2.0, 2), angle: uniform(0.0, end, n) }
}

fn half_disc() -> Shape {
    let depth = Grading { at: vec![0.0, 0.2, 0.5] };
    Shape::HalfDisc { center: [0.0; 2], radius: 0.5, up: false, angle: uniform(-0.8, 0.8, 4), depth, core: 2 }
}

/// Corners of the coarse sides' middles are no crack: what `assert_sound` asks of the boundary, with hanging sides.
fn assert_conforming_but_hanging(mesh: &Mesh) {
    check(mesh).unwrap();
    let mut sides: BTreeMap<Edge, u32> = BTreeMap::new();
    mesh.sides().for_each(|(ends, _)| *sides.entry(ends).or_default() += 1);
    let coarse: BTreeMap<Edge, &HangingSide> = mesh
        .hanging
        .iter()
        .map(|side| {
            let nodes: Vec<u32> = mesh.facet_nodes(side.coarse).collect();
            (edge(nodes[0], nodes[1]), side)
        })
        .collect();
    assert_eq!(coarse.len(), mesh.hanging.len());
    let halves: Vec<Edge> =
        coarse.iter().flat_map(|(&(a, b), side)| [edge(a, side.middle), edge(side.middle, b)]).collect();
    let on_surface: Vec<Edge> = mesh
        .surfaces
        .values()
        .flatten()
        .map(|&f| {
            let nodes: Vec<u32> = mesh.facet_nodes(f).collect();
            edge(nodes[0], nodes[1])
        })
        .collect();
    for (ends, count) in &sides {
        let lonely = coarse.contains_key(ends) || halves.contains(ends) || on_surface.contains(ends);
        assert_eq!(*count, if lonely { 1 } else { 2 }, "{ends:?}");
    }
    for slave in mesh.slaves() {
        let total: f64 = slave.masters.iter().map(|(_, w)| w).sum();
        assert_eq!(total, 1.0);
        for d in 0..2 {
            let x: f64 = slave.masters.iter().map(|&(m, w)| w * mesh.points[m as usize][d]).sum();
            assert!((x - mesh.points[slave.node as usize][d]).abs() < 1e-14, "off the coarse side");
        }
    }
    let slaves: Vec<u32> = mesh.slaves().iter().map(|s| s.node).collect();
    assert!(slaves.windows(2).all(|w| w[0] < w[1]), "a node is a slave twice");
    for slave in mesh.slaves() {
        assert!(
            slave.masters.iter().all(|(m, _)| slaves.binary_search(m).is_err()),
            "a slave has a slave as master"
        );
    }
    let surface_nodes = mesh.surfaces.values().flatten().flat_map(|&f| mesh.facet_nodes(f));
    assert!(surface_nodes.into_iter().all(|n| slaves.binary_search(&n).is_err()), "a boundary node hangs");
}

#[test]
fn every_cell_into_four_and_the_exact_boundary_in_the_limit() {
    let area_of = |shape: &Shape| match shape {
        Shape::Ring { angle, .. } => 1.5 * (angle.at[angle.at.len() - 1] - angle.at[0]),
        _ => 0.5 * PI * 0.25,
    };
    for shape in [ring(FRAC_PI_2, 3), ring(TAU, 8), half_disc()] {
        let holes = i64::from(matches!(&shape, Shape::Ring { angle, .. } if angle.at.len() == 9));
        for kind in ElementKind::ALL {
            let mut mesh = build(&shape, kind);
            let mut errors = Vec::new();
            for level in 0..4 {
                if level > 0 {
                    let (cells, surfaces) = (mesh.cells.len(), mesh.surfaces.clone());
                    mesh = refine_all(mesh, 1).unwrap();
                    assert_eq!(mesh.cells.len(), 4 * cells);
                    assert!(mesh.hanging.is_empty());
                    for (name, facets) in surfaces {
                        assert_eq!(mesh.surfaces[&name].len(), 2 * facets.len());
                    }
                }
                check(&mesh).unwrap();
                assert_sound(&mesh, holes);
                errors.push((area(&mesh) / area_of(&shape) - 1.0).abs());
            }
            let quadratic = kind.n_nodes() > kind.n_corners();
            let order = (errors[2] / errors[3]).log2();
            assert!(order > if quadratic { 3.7 } else { 1.9 }, "{kind:?}: {errors:?}");
            // On the circle to the last digits, not only nearer to it.
            let name = if matches!(shape, Shape::Ring { .. }) { "outer" } else { "arc" };
            let (center, radius) = if name == "outer" { ([1.0, 2.0], 2.0) } else { ([0.0, 0.0], 0.5) };
            for node in mesh.surfaces[name].iter().flat_map(|&f| mesh.facet_nodes(f)) {
                let p = mesh.points[node as usize];
                assert!(((p[0] - center[0]).hypot(p[1] - center[1]) / radius - 1.0).abs() < 1e-15 * 8.0);
            }
        }
    }
}

#[test]
fn a_file_of_straight_sides_becomes_round_and_keeps_its_corners() {
    // As if read from a file: without curves.
    let read = |shape: &Shape, kind| Mesh { curves: BTreeMap::new(), ..build(shape, kind) };
    for kind in [ElementKind::Tri3, ElementKind::Quad4] {
        let mut mesh = read(&ring(FRAC_PI_2, 6), kind);
        mesh.follow_smooth_outline();
        let mesh = refine_all(mesh, 5).unwrap();
        check(&mesh).unwrap();
        // The sixth order of the cubics leaves 1e-7 of the sagitta at 15 degrees a side.
        assert!((surface_length(&mesh, "outer") / PI - 1.0).abs() < 2e-5);
        for node in mesh.surfaces["outer"].iter().flat_map(|&f| mesh.facet_nodes(f)) {
            let p = mesh.points[node as usize];
            assert!(((p[0] - 1.0).hypot(p[1] - 2.0) / 2.0 - 1.0).abs() < 1e-7, "{p:?}");
        }
        assert!(
            mesh.surfaces["start"]
                .iter()
                .flat_map(|&f| mesh.facet_nodes(f))
                .all(|n| mesh.points[n as usize][1] == 2.0)
        );
        assert!((area(&mesh) / (0.75 * PI) - 1.0).abs() < 1e-4);

        let shape = Shape::Rectangle { x: uniform(0.0, 1.0, 2), y: uniform(0.0, 1.0, 2) };
        let mut square = read(&shape, kind);
        square.follow_smooth_outline();
        assert!(square.curves.is_empty());
        assert_eq!(area(&refine_all(square, 3).unwrap()), 1.0);
    }
}

#[test]
fn a_straight_line_goes_over_into_an_arc_and_stays_straight() {
    // A stadium's side: straight from (0, 0) to (2, 0), then a quarter circle about (2, 1), up and back.
    let mut points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    points.extend((1..=6).map(|i| {
        let t = f64::from(i) * FRAC_PI_2 / 6.0;
        [2.0 + t.sin(), 1.0 - t.cos(), 0.0]
    }));
    points.push([0.0, 1.0, 0.0]);
    let last = points.len() as u32 - 1;
    let cells = (0..last - 1).map(|i| Cell::new(ElementKind::Tri3, &[i, i + 1, last])).collect();
    let mut mesh = Mesh { dim: 2, points, cells, ..Mesh::default() };
    mesh.follow_smooth_outline();
    assert!(!mesh.curves.contains_key(&(0, 1)) && !mesh.curves.contains_key(&(1, 2)));
    let exact = 1.0 * 2.0 + PI / 4.0;
    let errors = [3, 4].map(|n| (area(&refine_all(mesh.clone(), n).unwrap()) / exact - 1.0).abs());
    assert!(errors[1] < 1e-4 && errors[0] / errors[1] > 3.5, "{errors:?}");
}

#[test]
fn marked_cells_are_cut_and_neighbours_follow_where_nodes_would_hang_on_hanging_sides() {
    for kind in ElementKind::ALL {
        for shape in [ring(FRAC_PI_2, 3), half_disc()] {
            let mut mesh = build(&shape, kind);
            let whole = area(&refine_all(mesh.clone(), 6).unwrap());
            for round in 0..6 {
                // The cell at the same place each time: as steep as it gets.
                let at = mesh.points[mesh
                    .surfaces
                    .values()
                    .next()
                    .unwrap()
                    .first()
                    .map(|&f| mesh.facet_nodes(f).next().unwrap())
                    .unwrap() as usize];
                let near = |c: &Cell| c.nodes().iter().any(|&n| mesh.points[n as usize] == at);
                let marked: Vec<bool> = mesh.cells.iter().map(near).collect();
                let cells = mesh.cells.len();
                mesh = refine(&mesh, &marked);
                assert!(mesh.cells.len() >= cells + 3, "{round}");
                assert_conforming_but_hanging(&mesh);
                assert!(!mesh.hanging.is_empty());
            }
            assert!((area(&mesh) / whole - 1.0).abs() < 0.05);
            // From the coarsest to the finest in steps of two.
            let finest = (0..mesh.cells.len()).map(|c| cell_area(&mesh, c)).fold(f64::MAX, smaller);
            let coarsest = (0..mesh.cells.len()).map(|c| cell_area(&mesh, c)).fold(0.0, larger);
            assert!(coarsest / finest > 4f64.powi(5));
        }
    }
}

#[test]
fn a_region_cut_again_and_again_takes_coarser_neighbours_with_it() {
    for kind in ElementKind::ALL {
        let mut mesh = build(&ring(FRAC_PI_2, 8), kind);
        for _ in 0..4 {
            let inside = |c: &Cell| c.nodes().iter().any(|&n| mesh.points[n as usize][0] - 1.0 < 0.7);
            let marked: Vec<bool> = mesh.cells.iter().map(inside).collect();
            mesh = refine(&mesh, &marked);
            assert_conforming_but_hanging(&mesh);
        }
    }
}

#[test]
fn cutting_all_that_is_left_coarse_closes_the_hanging_sides() {
    for kind in ElementKind::ALL {
        let mesh = unit_square(kind, 3);
        let marked: Vec<bool> = (0..mesh.cells.len()).map(|c| c % 3 == 0).collect();
        let fine = refine(&mesh, &marked);
        let finished = refine(
            &fine,
            &(0..fine.cells.len())
                .map(|c| cell_area(&fine, c) > 0.02 * if kind.n_corners() == 4 { 1.5 } else { 1.0 })
                .collect::<Vec<_>>(),
        );
        assert!(finished.hanging.is_empty(), "{kind:?}");
        assert_eq!(finished.points.len(), refine_all(mesh, 1).unwrap().points.len());
        assert_sound(&finished, 0);
    }
}

#[test]
fn a_mesh_too_large_to_number_is_refused() {
    let mut mesh = unit_square(ElementKind::Tri3, 1);
    mesh.points.resize(MAX_NODES / 2, [0.0; 3]);
    assert!(refine_all(mesh, 1).unwrap_err().to_string().contains("refine less"));
}
