//! Recovered stresses at the nodes of a rank's part of a body.
use super::{
    patch::{Fit, Samples, TERMS},
    plane::Plane,
};
use crate::{
    body::{Body, PointStresses},
    element::ElementKind,
    error::Result,
    mesh::{Cell, MeshPart},
};
use mpi::{topology::SimpleCommunicator, traits::*};

/// Numbers of a fit that ranks tell each other: kind, size, coefficients.
const PACKED: usize = 2 + 3 * TERMS;

/// What is known of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// Between vertices: no fits of its own.
    Between,
    /// A vertex with cells all round.
    Inside,
    /// A vertex without.
    Edge,
}

/// The vertices of a part and the polynomials fitted there.
struct Fitted {
    /// By node.
    places: Vec<Place>,
    /// By node: where the fits of a vertex begin, one for each solution.
    first: Vec<u32>,
    fits: Vec<Fit>,
    solutions: usize,
}

impl Fitted {
    fn with_capacity(n: usize, solutions: usize) -> Fitted {
        let fits = Vec::with_capacity(n * solutions);
        Fitted { places: Vec::with_capacity(n), first: Vec::with_capacity(n), fits, solutions }
    }

    /// The next node: its fits are what is added before the one after it.
    fn push(&mut self, place: Place) {
        self.places.push(place);
        self.first.push(self.fits.len() as u32);
    }

    fn of(&self, node: usize) -> &[Fit] {
        &self.fits[self.first[node] as usize..][..self.solutions]
    }

    /// Tells the fits of owned nodes to the ranks that have them too. Collective on the group.
    fn with_ghosts(self, body: &Body, group: &SimpleCommunicator) -> Result<Fitted> {
        let part = &body.part;
        let mut got = Vec::new();
        for k in 0..self.solutions {
            let mut packed = vec![0.0; part.n_owned * PACKED];
            for (node, packed) in packed.chunks_exact_mut(PACKED).enumerate() {
                if self.places[node] != Place::Between {
                    let fit = &self.of(node)[k];
                    packed[0] = if self.places[node] == Place::Inside { 2.0 } else { 1.0 };
                    packed[1] = fit.size;
                    packed[2..].copy_from_slice(fit.coefficients.as_flattened());
                }
            }
            got.push(with_ghosts(body, group, &packed)?);
        }
        let mut all = Fitted::with_capacity(part.points.len(), self.solutions);
        for (node, &center) in part.points.iter().enumerate() {
            let of_node = |k: usize| &got[k][node * PACKED..][..PACKED];
            let place = match of_node(0)[0] {
                0.0 => Place::Between,
                2.0 => Place::Inside,
                _ => Place::Edge,
            };
            all.push(place);
            if place != Place::Between {
                all.fits.extend((0..self.solutions).map(|k| {
                    let terms: &[[f64; TERMS]] = of_node(k)[2..].as_chunks().0;
                    Fit { center, size: of_node(k)[1], coefficients: [terms[0], terms[1], terms[2]] }
                }));
            }
        }
        Ok(all)
    }
}

/// Recovered stress at every local node, Pa, of each solution. Collective on the group.
///
/// At a vertex inside the body it is the value of its own fit. Nodes on the boundary and between vertices take the mean
/// of the fits of the vertices inside in their cells, evaluated at the node; where there is none, as in a layer one cell
/// thick, that of the fits of the vertices on the boundary.
pub(super) fn recovered(
    body: &Body,
    group: &SimpleCommunicator,
    solutions: &[&PointStresses],
) -> Result<Vec<Vec<Plane>>> {
    let part = &body.part;
    let around = Around::new(part);
    let mut fitted = Fitted::with_capacity(part.n_owned, solutions.len());
    let mut scratch = Scratch { ends: Vec::new(), samples: Samples::new(solutions.len()) };
    for node in 0..part.n_owned {
        match around.is_vertex[node] {
            true => vertex(body, solutions, &around, node, &mut scratch, &mut fitted),
            false => fitted.push(Place::Between),
        }
    }
    if group.size() > 1 {
        fitted = fitted.with_ghosts(body, group)?;
    }
    let mut nodal = vec![Vec::with_capacity(part.n_local); solutions.len()];
    let mut seen = Vec::new();
    for node in 0..part.n_local {
        at_node(part, &around, &fitted, node, &mut seen, &mut nodal);
    }
    Ok(nodal)
}

/// Room for what is known around a vertex.
struct Scratch {
    /// The other ends of the edges, and how many cells have each.
    ends: Vec<(u32, u8)>,
    samples: Samples,
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
fn vertex(
    body: &Body,
    solutions: &[&PointStresses],
    around: &Around,
    node: usize,
    scratch: &mut Scratch,
    fitted: &mut Fitted,
) {
    let part = &body.part;
    let Scratch { ends, samples } = scratch;
    let cells = around.of(node);
    // Each edge at an inner vertex belongs to two cells.
    ends.clear();
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
    fitted.push(if inside { Place::Inside } else { Place::Edge });
    samples.fit(part.points[node], if linear { 3 } else { 6 }, &mut fitted.fits);
}

/// Adds the points of a cell where its stresses are most accurate: the centre of linear elements, the two by two points
/// of a quad8, the three points of a tri6. Without neighbours all round (not `inside`) those of the quad4, too, have to do.
fn sample(body: &Body, solutions: &[&PointStresses], c: usize, inside: bool, samples: &mut Samples) {
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
        let mean = |stresses: &&PointStresses| {
            let stresses = stresses.of(c);
            std::array::from_fn(|c| stresses.iter().map(|s| s[c]).sum::<f64>() / stresses.len() as f64)
        };
        samples.push(position(&cell.kind.center()), solutions.iter().map(mean));
        return;
    }
    for (i, point) in element.points().iter().enumerate() {
        samples.push(position(&point.xi), solutions.iter().map(|stresses| stresses.of(c)[i]));
    }
}

/// Adds the stresses at a node, of each solution; `seen` is room for the vertices around it.
fn at_node(
    part: &MeshPart,
    around: &Around,
    fitted: &Fitted,
    node: usize,
    seen: &mut Vec<u32>,
    nodal: &mut [Vec<Plane>],
) {
    let x = &part.points[node];
    if fitted.places[node] == Place::Inside {
        std::iter::zip(nodal, fitted.of(node)).for_each(|(nodal, fit)| nodal.push(fit.at(x)));
        return;
    }
    for wanted in [Place::Inside, Place::Edge] {
        seen.clear();
        for &c in around.of(node) {
            let cell = &part.cells[c as usize];
            for &corner in &cell.nodes()[..cell.kind.n_corners()] {
                if fitted.places[corner as usize] == wanted && !seen.contains(&corner) {
                    seen.push(corner);
                }
            }
        }
        if !seen.is_empty() {
            for (k, nodal) in nodal.iter_mut().enumerate() {
                let mut sum = [0.0; 3];
                for &vertex in &*seen {
                    let value = fitted.of(vertex as usize)[k].at(x);
                    (0..3).for_each(|c| sum[c] += value[c]);
                }
                nodal.push(sum.map(|s| s / seen.len() as f64));
            }
            return;
        }
    }
    nodal.iter_mut().for_each(|nodal| nodal.push([0.0; 3]));
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
