//! Recovered stresses at the nodes of a rank's part of a body.
use super::{
    patch::{Fit, Samples, TERMS},
    plane::Plane,
};
use crate::{
    body::{Body, Fields},
    element::ElementKind,
    error::Result,
    mesh::{Cell, MeshPart},
};
use mpi::{topology::SimpleCommunicator, traits::*};

/// Numbers of a fit that ranks tell each other: kind, size, coefficients.
const PACKED: usize = 2 + 3 * TERMS;

/// Whether a vertex is inside the body, all cells around it, and its fits, one for each solution.
struct Vertex {
    inside: bool,
    fits: Vec<Fit>,
}

/// Recovered stress at every local node, Pa, of each solution. Collective on the group.
///
/// At a vertex inside the body it is the value of its own fit. Nodes on the boundary and between vertices take the mean
/// of the fits of the vertices inside in their cells, evaluated at the node; where there is none, as in a layer one cell
/// thick, that of the fits of the vertices on the boundary.
pub(super) fn recovered(
    body: &Body,
    group: &SimpleCommunicator,
    solutions: &[&Fields],
) -> Result<Vec<Vec<Plane>>> {
    let part = &body.part;
    let around = Around::new(part);
    let mut samples = Samples::default();
    let mut own =
        |node: usize| around.is_vertex[node].then(|| vertex(body, solutions, &around, node, &mut samples));
    let mut vertices: Vec<Option<Vertex>> = (0..part.n_owned).map(&mut own).collect();
    if group.size() > 1 {
        let mut all: Vec<Option<Vertex>> = (0..part.points.len()).map(|_| None).collect();
        for k in 0..solutions.len() {
            let mut packed = vec![0.0; part.n_owned * PACKED];
            for (vertex, packed) in std::iter::zip(&vertices, packed.chunks_exact_mut(PACKED)) {
                if let Some(vertex) = vertex {
                    packed[0] = if vertex.inside { 2.0 } else { 1.0 };
                    packed[1] = vertex.fits[k].size;
                    packed[2..].copy_from_slice(vertex.fits[k].coefficients.as_flattened());
                }
            }
            let got = with_ghosts(body, group, &packed)?;
            for (vertex, (v, &center)) in
                std::iter::zip(&mut all, std::iter::zip(got.chunks_exact(PACKED), &part.points))
            {
                let terms: &[[f64; TERMS]] = v[2..].as_chunks().0;
                let fit = Fit { center, size: v[1], coefficients: [terms[0], terms[1], terms[2]] };
                if v[0] > 0.0 {
                    let vertex = vertex.get_or_insert(Vertex { inside: v[0] > 1.0, fits: Vec::new() });
                    vertex.fits.push(fit);
                }
            }
        }
        vertices = all;
    }
    let of_solution = |k: usize| (0..part.n_local).map(|n| at_node(part, &around, &vertices, n, k)).collect();
    Ok((0..solutions.len()).map(of_solution).collect())
}

/// The cells around each local node.
struct Around {
    first: Vec<u32>,
    cells: Vec<u32>,
    is_vertex: Vec<bool>,
}

impl Around {
    fn new(part: &MeshPart) -> Around {
        let mut first = vec![0; part.n_local + 1];
        let mut is_vertex = vec![false; part.n_local];
        let n_local = part.n_local;
        fn local(cell: &Cell, n_local: usize) -> impl Iterator<Item = usize> {
            cell.nodes().iter().map(|&n| n as usize).filter(move |&n| n < n_local)
        }
        for cell in &part.cells {
            local(cell, n_local).for_each(|n| first[n + 1] += 1);
            let corners = cell.nodes()[..cell.kind.n_corners()].iter();
            corners.filter(|&&n| (n as usize) < n_local).for_each(|&n| is_vertex[n as usize] = true);
        }
        (0..n_local).for_each(|n| first[n + 1] += first[n]);
        let (mut next, mut cells) = (first.clone(), vec![0; first[n_local] as usize]);
        for (i, cell) in part.cells.iter().enumerate() {
            for n in local(cell, n_local) {
                cells[next[n] as usize] = i as u32;
                next[n] += 1;
            }
        }
        Around { first, cells, is_vertex }
    }

    fn of(&self, node: usize) -> &[u32] {
        &self.cells[self.first[node] as usize..self.first[node + 1] as usize]
    }
}

/// Fits the stresses around a vertex.
fn vertex(body: &Body, solutions: &[&Fields], around: &Around, node: usize, samples: &mut Samples) -> Vertex {
    let part = &body.part;
    let cells = around.of(node);
    // Each edge at an inner vertex belongs to two cells.
    let mut ends: Vec<(u32, u8)> = Vec::with_capacity(16);
    let mut linear = true;
    for &c in cells {
        let cell = &part.cells[c as usize];
        linear &= matches!(cell.kind, ElementKind::Tri3 | ElementKind::Quad4);
        let corners = &cell.nodes()[..cell.kind.n_corners()];
        let at = corners.iter().position(|&n| n as usize == node).unwrap_or(0);
        for step in [1, corners.len() - 1] {
            let end = corners[(at + step) % corners.len()];
            match ends.iter_mut().find(|(other, _)| *other == end) {
                Some((_, count)) => *count += 1,
                None => ends.push((end, 1)),
            }
        }
    }
    let inside = ends.iter().all(|(_, count)| *count == 2);
    samples.clear();
    for &c in cells {
        sample(body, solutions, c as usize, inside, samples);
    }
    Vertex { fits: samples.fit(part.points[node], if linear { 3 } else { 6 }), inside }
}

/// Adds the points of a cell where its stresses are most accurate: the centre of linear elements, the two by two points
/// of a quad8, the three points of a tri6. Without neighbours all round (not `inside`) those of the quad4, too, have to do.
fn sample(body: &Body, solutions: &[&Fields], c: usize, inside: bool, samples: &mut Samples) {
    let cell = &body.part.cells[c];
    let element = body.element(cell.kind);
    let position = |xi: &[f64; 3]| {
        let shape = cell.kind.shape(xi);
        let mut x = [0.0; 3];
        for (&node, n) in std::iter::zip(cell.nodes(), shape.n) {
            (0..3).for_each(|c| x[c] += n * body.part.points[node as usize][c]);
        }
        x
    };
    if inside && cell.kind == ElementKind::Quad4 {
        let mean = |fields: &&Fields| {
            let stresses = fields.points_of(c);
            std::array::from_fn(|c| stresses.iter().map(|s| s[c]).sum::<f64>() / stresses.len() as f64)
        };
        samples.push(position(&cell.kind.center()), solutions.iter().map(mean));
        return;
    }
    for (i, point) in element.points().iter().enumerate() {
        samples.push(position(&point.xi), solutions.iter().map(|fields| fields.points_of(c)[i]));
    }
}

fn at_node(
    part: &MeshPart,
    around: &Around,
    vertices: &[Option<Vertex>],
    node: usize,
    solution: usize,
) -> Plane {
    let x = &part.points[node];
    if let Some(Vertex { fits, inside: true }) = &vertices[node] {
        return fits[solution].at(x);
    }
    for inside in [true, false] {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        let mut seen: Vec<u32> = Vec::with_capacity(16);
        for &c in around.of(node) {
            let cell = &part.cells[c as usize];
            for &corner in &cell.nodes()[..cell.kind.n_corners()] {
                let Some(vertex) = &vertices[corner as usize] else { continue };
                if vertex.inside == inside && !seen.contains(&corner) {
                    seen.push(corner);
                    let value = vertex.fits[solution].at(x);
                    (0..3).for_each(|c| sum[c] += value[c]);
                    count += 1.0;
                }
            }
        }
        if count > 0.0 {
            return sum.map(|s| s / count);
        }
    }
    [0.0; 3]
}

/// Several numbers a node, from the owned nodes to all of the part. Collective on the group.
fn with_ghosts(body: &Body, group: &SimpleCommunicator, packed: &[f64]) -> Result<Vec<f64>> {
    let (part, dim) = (&body.part, body.dim());
    let mut all = vec![0.0; part.points.len() * PACKED];
    for first in (0..PACKED).step_by(dim) {
        let width = dim.min(PACKED - first);
        let mut own = vec![0.0; part.n_owned * dim];
        for (to, from) in std::iter::zip(own.chunks_exact_mut(dim), packed.chunks_exact(PACKED)) {
            to[..width].copy_from_slice(&from[first..first + width]);
        }
        let got = body.with_ghosts(group, &own)?;
        for (to, from) in std::iter::zip(all.chunks_exact_mut(PACKED), got.chunks_exact(dim)) {
            to[first..first + width].copy_from_slice(&from[..width]);
        }
    }
    Ok(all)
}
