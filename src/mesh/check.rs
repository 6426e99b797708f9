//! Refuses meshes on which a computation would fail or give nonsense.
use super::{Mesh, components};
use crate::element::{MAX_NODES, load_rule};
use crate::error::{Error, Result};
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Checks that the mesh has cells, that every node is used, that no two nodes coincide, and the shape of each
/// cell.
pub fn check(mesh: &Mesh) -> Result<()> {
    if mesh.cells.is_empty() {
        return Err(Error::input("the mesh has no cells"));
    }
    let mut used = vec![false; mesh.points.len()];
    for (number, cell) in mesh.cells.iter().enumerate() {
        for &node in cell.nodes() {
            match used.get_mut(node as usize) {
                Some(used) => *used = true,
                None => return Err(Error::internal(format!("cell {number} has no node {node}"))),
            }
        }
    }
    if let Some(node) = used.iter().position(|used| !used) {
        return Err(Error::input(format!(
            "node {node} at {} belongs to no cell; remove it",
            place(mesh, node as u32)
        )));
    }
    (0..mesh.cells.len()).try_for_each(|cell| edges(mesh, cell).and_then(|()| jacobian(mesh, cell)))?;
    coincident(mesh)
}

fn place(mesh: &Mesh, node: u32) -> String {
    let p = mesh.points[node as usize];
    format!("({}, {})", p[0], p[1])
}

/// Largest extent of the nodes' box.
fn extent<'a>(points: impl Iterator<Item = &'a [f64; 3]> + Clone) -> f64 {
    let range = |d: usize| {
        let (low, high) = points.clone().fold((f64::MAX, f64::MIN), |r, p| (r.0.min(p[d]), r.1.max(p[d])));
        high - low
    };
    range(0).max(range(1))
}

/// Sides have a length, and mid-side nodes lie in the middle third.
fn edges(mesh: &Mesh, number: usize) -> Result<()> {
    let cell = &mesh.cells[number];
    let size = extent(cell.nodes().iter().map(|&n| &mesh.points[n as usize]));
    for side in 0..cell.kind.facets().len() as u8 {
        // Two ends and, of a quadratic cell, the mid-side node.
        let (mut nodes, mut n_nodes) = ([0; 3], 0);
        for (slot, node) in std::iter::zip(&mut nodes, cell.facet_nodes(side)) {
            *slot = node;
            n_nodes += 1;
        }
        let p = nodes.map(|n| mesh.points[n as usize]);
        let along = [p[1][0] - p[0][0], p[1][1] - p[0][1]];
        let square = along[0] * along[0] + along[1] * along[1];
        // Also refuses coordinates that are not numbers.
        if square.is_nan() || square <= (1e-12 * size).powi(2) {
            return Err(Error::input(format!(
                "cell {number} has a side of length zero at {}; merge its nodes or mesh again",
                place(mesh, nodes[0])
            )));
        }
        if let Some(mid) = p[..n_nodes].get(2) {
            let fraction = ((mid[0] - p[0][0]) * along[0] + (mid[1] - p[0][1]) * along[1]) / square;
            if !(1.0 / 3.0..=2.0 / 3.0).contains(&fraction) {
                return Err(Error::input(format!(
                    "cell {number}: the mid-side node at {} lies at {fraction:.2} of its side, outside \
                     the middle third; \
                     mesh again with a finer size along curved edges",
                    place(mesh, nodes[2])
                )));
            }
        }
    }
    Ok(())
}

/// The map from the reference element is positive at nodes and integration points.
fn jacobian(mesh: &Mesh, number: usize) -> Result<()> {
    let cell = &mesh.cells[number];
    let mut x = [[0.0; 3]; MAX_NODES];
    std::iter::zip(&mut x, cell.nodes()).for_each(|(x, &n)| *x = mesh.points[n as usize]);
    let x = &x[..cell.nodes().len()];
    let size = extent(x.iter());
    // det J of a linear cell is linear: its nodes have the least of it.
    let linear = cell.kind.n_nodes() == cell.kind.n_corners();
    let integration = if linear { &[] } else { load_rule(cell.kind) }.iter().map(|point| &point.xi);
    for xi in cell.kind.node_coordinates().iter().chain(integration) {
        let shape = cell.kind.shape(xi);
        let mut j = [[0.0; 2]; 2];
        let mut at = [0.0; 2];
        for ((p, dn), n) in x.iter().zip(&shape.dn).zip(&shape.n) {
            for d in 0..2 {
                at[d] += n * p[d];
                j[d][0] += p[d] * dn[0];
                j[d][1] += p[d] * dn[1];
            }
        }
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        if det.is_nan() || det <= 1e-12 * size * size {
            return Err(Error::input(format!(
                "cell {number} ({}) is distorted or turned over at ({}, {}): its area there is {det:e} \
                 times the reference; \
                 mesh again, finer along curved edges",
                cell.kind.name(),
                at[0],
                at[1]
            )));
        }
    }
    Ok(())
}

/// No two nodes lie in one place: they would be a crack, or two bodies read as one.
///
/// One of them is on the boundary, as is the other unless two pieces lie on top of each other: inside a piece, the cells
/// that pass the checks above fill the place around a node.
fn coincident(mesh: &Mesh) -> Result<()> {
    let mut nodes: Vec<u32> = mesh.single_sides().into_iter().flat_map(|f| mesh.facet_nodes(f)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let point = |node: u32| [mesh.points[node as usize][0], mesh.points[node as usize][1]];
    let tree = RTree::bulk_load(nodes.iter().map(|&node| GeomWithData::new(point(node), node)).collect());
    let tolerance = 1e-12 * extent(mesh.points.iter());
    if components(mesh).1 > 1 {
        nodes = (0..mesh.points.len() as u32).collect();
    }
    for node in nodes {
        let near = tree.locate_within_distance(point(node), tolerance * tolerance);
        if let Some(other) = near.map(|found| found.data).find(|&other| other != node) {
            return Err(Error::input(format!(
                "two nodes, {node} and {other}, lie at {} and are not connected: a crack, or nodes that \
                 should be one. \
                 Remove duplicate nodes in the mesher (Gmsh: Coherence), or choose one body by its group \
                 name",
                place(mesh, node)
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::testing::{boundary, unit_square};
    use crate::mesh::{Cell, Facet, read_gmsh};
    use std::path::Path;

    fn message(mesh: &Mesh) -> String {
        check(mesh).unwrap_err().to_string()
    }

    #[test]
    fn good_meshes_pass() {
        for kind in ElementKind::ALL {
            check(&unit_square(kind, 3)).unwrap();
        }
    }

    #[test]
    fn empty_and_unused() {
        assert!(message(&Mesh::default()).contains("no cells"));
        let mut mesh = unit_square(ElementKind::Quad4, 1);
        mesh.points.push([3.0, 4.0, 0.0]);
        assert!(message(&mesh).contains("node 4 at (3, 4) belongs to no cell"));
    }

    #[test]
    fn two_bodies_on_one_line_are_a_crack() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/quad1-4.1-ascii.msh");
        check(&read_gmsh(&file, &["plate"], 1.0).unwrap()).unwrap();
        let error = message(&read_gmsh(&file, &[], 1.0).unwrap());
        assert!(error.contains("are not connected") && error.contains(", 1)"), "{error}");
    }

    #[test]
    fn single_sides_are_the_boundary() {
        for kind in ElementKind::ALL {
            let mesh = unit_square(kind, 3);
            let order = |facet: &Facet| (facet.cell, facet.side);
            let (mut found, mut expected) = (mesh.single_sides(), boundary(&mesh));
            found.sort_unstable_by_key(order);
            expected.sort_unstable_by_key(order);
            assert_eq!(found, expected, "{kind:?}");
        }
    }

    #[test]
    fn a_slit_at_the_middle_of_a_side() {
        let mut mesh = unit_square(ElementKind::Tri6, 1);
        let shared = |node: &u32| mesh.cells[1].nodes()[3..].contains(node);
        let middle = mesh.cells[0].nodes()[3..].iter().position(shared).unwrap();
        let mut nodes = mesh.cells[0].nodes().to_vec();
        mesh.points.push(mesh.points[nodes[3 + middle] as usize]);
        nodes[3 + middle] = mesh.points.len() as u32 - 1;
        mesh.cells[0] = Cell::new(ElementKind::Tri6, &nodes);
        assert!(message(&mesh).contains("lie at (0.5, 0.5) and are not connected"));
    }

    #[test]
    fn one_mesh_on_top_of_another() {
        let mut mesh = unit_square(ElementKind::Quad4, 6);
        let mut insert = unit_square(ElementKind::Quad4, 2);
        // Its boundary meets inner nodes of the other.
        insert.points.iter_mut().for_each(|p| *p = [(1.0 + p[0]) / 3.0, (1.0 + p[1]) / 3.0, 0.0]);
        mesh.append(&insert);
        assert!(message(&mesh).contains("are not connected"));
    }

    #[test]
    fn cells_out_of_shape() {
        let mut mesh = unit_square(ElementKind::Quad4, 1);
        mesh.cells[0] = Cell::new(ElementKind::Quad4, &[0, 3, 2, 1]);
        assert!(message(&mesh).contains("turned over"));
        let mut mesh = unit_square(ElementKind::Quad4, 1);
        mesh.points[1] = mesh.points[0];
        assert!(message(&mesh).contains("side of length zero at (0, 0)"));
        mesh.points[1] = [f64::NAN; 3];
        assert!(check(&mesh).is_err());
        for (kind, mid) in [(ElementKind::Quad8, 4), (ElementKind::Tri6, 3)] {
            let mut mesh = unit_square(kind, 1);
            let node = mesh.cells[0].nodes()[mid] as usize;
            let x = mesh.points[node][0];
            mesh.points[node][0] = x + 0.1;
            check(&mesh).unwrap();
            mesh.points[node][0] = x + 0.2;
            assert!(message(&mesh).contains("outside the middle third"));
            // Pushed through the cell.
            mesh.points[node] = [x, 1.1, 0.0];
            assert!(message(&mesh).contains("distorted"), "{kind:?}");
        }
    }
}
