//! Meshes and measures that several tests of this module share.
use super::{Facet, Mesh, generate};
use crate::element::ElementKind;
use crate::mesh::{Grading, Shape};
use std::collections::{BTreeMap, BTreeSet};

/// n + 1 positions from `a` to `b`.
pub fn uniform(a: f64, b: f64, n: usize) -> Grading {
    let at = (0..=n).map(|i| if i == n { b } else { a + (b - a) * i as f64 / n as f64 }).collect();
    Grading { at }
}

/// n by n cells on the unit square.
pub fn unit_square(kind: ElementKind, n: usize) -> Mesh {
    let shape = Shape::Rectangle { x: uniform(0.0, 1.0, n), y: uniform(0.0, 1.0, n) };
    generate(&shape, kind, 0.0, [0.0; 2]).unwrap()
}

/// Corners, then mid-sides, in the order in which the boundary of a cell meets them.
fn outline(mesh: &Mesh, cell: usize) -> Vec<[f64; 3]> {
    let cell = &mesh.cells[cell];
    let order = cell.kind.facets().iter().flat_map(|f| [Some(f[0]), f.get(2).copied()]).flatten();
    order.map(|i| mesh.points[cell.nodes()[i] as usize]).collect()
}

/// Area of the polygon through all nodes of a cell's boundary, plus what its parabolic sides add.
pub fn cell_area(mesh: &Mesh, cell: usize) -> f64 {
    let p = outline(mesh, cell);
    let polygon: f64 = (0..p.len())
        .map(|i| {
            let (a, b) = (p[i], p[(i + 1) % p.len()]);
            0.5 * (a[0] * b[1] - a[1] * b[0])
        })
        .sum();
    // A parabola encloses 4/3 of the triangle of its ends and middle.
    let kind = mesh.cells[cell].kind;
    let curved = if kind.n_nodes() > kind.n_corners() {
        (0..kind.n_corners())
            .map(|i| {
                let (a, m, b) = (p[2 * i], p[2 * i + 1], p[(2 * i + 2) % p.len()]);
                let triangle = 0.5 * ((m[0] - a[0]) * (b[1] - a[1]) - (m[1] - a[1]) * (b[0] - a[0]));
                triangle / 3.0
            })
            .sum()
    } else {
        0.0
    };
    polygon + curved
}

/// Area of the mesh.
pub fn area(mesh: &Mesh) -> f64 {
    (0..mesh.cells.len()).map(|c| cell_area(mesh, c)).sum()
}

/// Length of a facet, over its chords between neighbouring nodes, and its outward normal times its chord.
pub fn facet_length(mesh: &Mesh, facet: Facet) -> (f64, [f64; 2]) {
    let p: Vec<_> = mesh.facet_nodes(facet).map(|n| mesh.points[n as usize]).collect();
    let length = |a: [f64; 3], b: [f64; 3]| (b[0] - a[0]).hypot(b[1] - a[1]);
    let total = if p.len() == 3 { length(p[0], p[2]) + length(p[2], p[1]) } else { length(p[0], p[1]) };
    (total, [p[1][1] - p[0][1], p[0][0] - p[1][0]])
}

/// Length of a surface.
pub fn surface_length(mesh: &Mesh, name: &str) -> f64 {
    mesh.surfaces[name].iter().map(|&f| facet_length(mesh, f).0).sum()
}

/// Sides of one cell only.
pub fn boundary(mesh: &Mesh) -> Vec<Facet> {
    let mut sides: BTreeMap<(u32, u32), Vec<Facet>> = BTreeMap::new();
    for (ends, facet) in mesh.sides() {
        sides.entry(ends).or_default().push(facet);
    }
    assert!(sides.values().all(|list| list.len() <= 2), "a side has more than two cells");
    sides.into_values().filter(|list| list.len() == 1).map(|list| list[0]).collect()
}

/// Corner nodes - sides + cells: 1 for a body without holes, 0 with one hole.
pub fn euler(mesh: &Mesh) -> i64 {
    let corners: BTreeSet<u32> =
        mesh.cells.iter().flat_map(|c| c.nodes()[..c.kind.n_corners()].to_vec()).collect();
    let sides: BTreeSet<(u32, u32)> = mesh.sides().map(|(ends, _)| ends).collect();
    corners.len() as i64 - sides.len() as i64 + mesh.cells.len() as i64
}

/// Smallest and largest corner angle of all cells, degrees.
pub fn angles(mesh: &Mesh) -> (f64, f64) {
    let mut range = (f64::MAX, f64::MIN);
    for cell in &mesh.cells {
        let n = cell.kind.n_corners();
        let p = |i: usize| mesh.points[cell.nodes()[i % n] as usize];
        for i in 0..n {
            let (a, b, c) = (p(i + n - 1), p(i), p(i + 1));
            let (u, v) = ([c[0] - b[0], c[1] - b[1]], [a[0] - b[0], a[1] - b[1]]);
            let angle = (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]).to_degrees();
            range = (range.0.min(angle), range.1.max(angle));
        }
    }
    range
}

/// What every mesh of a body must satisfy: no unmatched sides, surfaces that are the boundary, a closed
/// outline.
pub fn assert_sound(mesh: &Mesh, holes: i64) {
    assert_eq!(euler(mesh), 1 - holes);
    let outline = boundary(mesh);
    let key = |f: &Facet| (f.cell, f.side);
    let expected: BTreeSet<_> = outline.iter().map(key).collect();
    let named: Vec<_> = mesh.surfaces.values().flatten().map(key).collect();
    assert_eq!(named.iter().copied().collect::<BTreeSet<_>>(), expected, "surfaces are not the boundary");
    assert_eq!(named.len(), expected.len(), "a facet is in two surfaces");
    let sum = outline.iter().fold([0.0; 2], |s, &f| {
        let n = facet_length(mesh, f).1;
        [s[0] + n[0], s[1] + n[1]]
    });
    assert!(sum[0].hypot(sum[1]) < 1e-12, "normals do not close: {sum:?}");
    assert!((0..mesh.cells.len()).all(|c| cell_area(mesh, c) > 0.0), "a cell is not counter-clockwise");
    let used: BTreeSet<u32> = mesh.cells.iter().flat_map(|c| c.nodes().to_vec()).collect();
    assert_eq!(used.len(), mesh.points.len(), "unused nodes");
}

/// Asserts that (x, y) -> (flip x, flip y) maps nodes and cells onto themselves, to the last bit.
pub fn assert_mirrored(mesh: &Mesh, flip: [f64; 2]) {
    // Adding 0 turns -0 into 0.
    let bits = |p: &[f64; 3], s: [f64; 2]| [(s[0] * p[0] + 0.0).to_bits(), (s[1] * p[1] + 0.0).to_bits()];
    let number: BTreeMap<_, _> =
        mesh.points.iter().enumerate().map(|(i, p)| (bits(p, [1.0, 1.0]), i as u32)).collect();
    assert_eq!(number.len(), mesh.points.len(), "two nodes in one place");
    let image: Vec<u32> = mesh
        .points
        .iter()
        .map(|p| *number.get(&bits(p, flip)).unwrap_or_else(|| panic!("{p:?} has no mirror image")))
        .collect();
    let set = |nodes: Vec<u32>| nodes.into_iter().collect::<BTreeSet<_>>();
    let all: BTreeSet<_> = mesh.cells.iter().map(|c| set(c.nodes().to_vec())).collect();
    let mirrored: BTreeSet<_> =
        mesh.cells.iter().map(|c| set(c.nodes().iter().map(|&n| image[n as usize]).collect())).collect();
    assert!(all == mirrored, "cells are not mirrored");
}
