//! Finer meshes: cells into four of their own kind, all of them or some.
//!
//! A cell is cut at the middles of its sides in its own map (red refinement). New nodes on the boundary lie on the
//! curve that the side stands for ([`Curve`]); sides without one keep their own: straight, or the parabola through the
//! mid-side node. Where only one of two neighbours is cut, the nodes in the middle of their common side *hang*
//! ([`HangingSide`]): a side of the coarse cell stands against two of the fine ones.
mod curve;
mod hanging;
mod outline;
#[cfg(test)]
mod tests;

pub use curve::Curve;
pub use hanging::{HangingSide, Slave};
pub(super) use outline::follow;
pub(crate) use outline::{Side, Smooth, smooth};

use super::{Cell, Facet, Mesh};
use crate::error::{Error, Result};
use curve::middle;
use std::collections::{BTreeMap, HashMap};

/// More nodes than this are taken for a mistake.
const MAX_NODES: usize = 100_000_000;

/// An edge: its two end nodes, smaller number first.
type Edge = (u32, u32);

fn edge(a: u32, b: u32) -> Edge {
    (a.min(b), a.max(b))
}

/// Every cell into four, `times` times.
pub fn refine_all(mut mesh: Mesh, times: usize) -> Result<Mesh> {
    for _ in 0..times {
        if 4 * mesh.points.len() > MAX_NODES {
            return Err(Error::input(format!(
                "refine: the mesh would have about {:.1e} nodes, more than {MAX_NODES:.0e}: refine less",
                4.0 * mesh.points.len() as f64
            )));
        }
        let all = vec![true; mesh.cells.len()];
        mesh = refine(&mesh, &all);
    }
    Ok(mesh)
}

/// The marked cells into four, and as many others as keep neighbours within a factor of two.
///
/// Nodes keep their numbers, new ones follow; children stand in the place of their cell and are of its material. No node hangs on a side whose
/// own ends hang: a cell with a hanging corner is cut only together with the coarse cell whose side it hangs on.
pub fn refine(mesh: &Mesh, marked: &[bool]) -> Mesh {
    let cut = closure(mesh, marked);
    let mut build = Build::new(mesh, &cut);
    for (cell, cut) in mesh.cells.iter().zip(&cut) {
        build.first.push(build.mesh.cells.len() as u32);
        if *cut { build.children(cell) } else { build.mesh.cells.push(cell.clone()) }
    }
    build.finish(&cut)
}

/// The marked cells and those that must be cut with them.
fn closure(mesh: &Mesh, marked: &[bool]) -> Vec<bool> {
    let coarse: HashMap<u32, u32> = mesh.hanging.iter().map(|side| (side.middle, side.coarse.cell)).collect();
    let mut cut = marked.to_vec();
    let mut todo: Vec<usize> = (0..cut.len()).filter(|&c| cut[c]).collect();
    while let Some(c) = todo.pop() {
        let cell = &mesh.cells[c];
        for corner in &cell.nodes()[..cell.kind.n_corners()] {
            if let Some(&other) = coarse.get(corner)
                && !std::mem::replace(&mut cut[other as usize], true)
            {
                todo.push(other as usize);
            }
        }
    }
    cut
}

/// A finer mesh under construction.
struct Build<'a> {
    old: &'a Mesh,
    mesh: Mesh,
    /// Number of each old cell, or of its first child.
    first: Vec<u32>,
    /// Node in the middle of an edge: of a linear cell's side, or of half a quadratic one's.
    middles: HashMap<Edge, u32>,
}

impl<'a> Build<'a> {
    fn new(old: &'a Mesh, cut: &[bool]) -> Self {
        let mut mesh = Mesh { dim: old.dim, points: old.points.clone(), ..Mesh::default() };
        (mesh.curves, mesh.unclear) = (old.curves.clone(), old.unclear.clone());
        mesh.cells.reserve(old.cells.len() + 3 * cut.iter().filter(|c| **c).count());
        let mut middles = HashMap::new();
        for side in &old.hanging {
            let nodes: Vec<u32> = old.facet_nodes(side.coarse).collect();
            match side.quarters {
                None => drop(middles.insert(edge(nodes[0], nodes[1]), side.middle)),
                Some(quarters) => {
                    for (end, quarter) in std::iter::zip(&nodes[..2], quarters) {
                        middles.insert(edge(*end, side.middle), quarter);
                    }
                }
            }
        }
        Build { old, mesh, first: Vec::with_capacity(old.cells.len()), middles }
    }

    fn point(&self, node: u32) -> [f64; 2] {
        let p = self.mesh.points[node as usize];
        [p[0], p[1]]
    }

    fn node(&mut self, p: [f64; 2]) -> u32 {
        self.mesh.points.push([p[0], p[1], 0.0]);
        (self.mesh.points.len() - 1) as u32
    }

    /// Adds the four children of a cell.
    fn children(&mut self, cell: &Cell) {
        let n = cell.kind.n_corners();
        let quadratic = cell.kind.n_nodes() > n;
        let corners = &cell.nodes()[..n];
        let mids: Vec<u32> = (0..n)
            .map(|s| {
                let (a, b) = (corners[s], corners[(s + 1) % n]);
                if quadratic { cell.nodes()[n + s] } else { self.side_middle(a, b) }
            })
            .collect();
        let mut families: Vec<Vec<u32>> = Vec::with_capacity(4);
        let center = (n == 4).then(|| self.center(cell, &mids));
        for k in 0..n {
            let mut child = vec![0; n];
            (child[k], child[(k + 1) % n], child[(k + n - 1) % n]) =
                (corners[k], mids[k], mids[(k + n - 1) % n]);
            if let Some(center) = center {
                child[(k + 2) % 4] = center;
            }
            families.push(child);
        }
        if n == 3 {
            families.push(mids.clone());
        }
        if quadratic {
            self.halve_sides(cell);
        }
        for child in families {
            let mut nodes = child.clone();
            for s in 0..if quadratic { n } else { 0 } {
                let (a, b) = (child[s], child[(s + 1) % n]);
                nodes.push(self.inner_middle(cell, a, b, center));
            }
            self.mesh.cells.push(cell.on(&nodes));
        }
    }

    /// Middle of a linear cell's side, on its curve.
    fn side_middle(&mut self, a: u32, b: u32) -> u32 {
        let ends = edge(a, b);
        if let Some(&node) = self.middles.get(&ends) {
            return node;
        }
        let (p, q) = (self.point(ends.0), self.point(ends.1));
        let Some(curve) = self.mesh.curves.remove(&ends) else {
            let node = self.node(middle(p, q));
            self.middles.insert(ends, node);
            if let Some(doubt) = self.mesh.unclear.remove(&ends) {
                self.mesh.unclear.extend([((ends.0, node), doubt), ((ends.1, node), doubt)]);
            }
            return node;
        };
        let (at, [first, second]) = curve.halves(p, q);
        let node = self.node(at);
        self.middles.insert(ends, node);
        // The new node has the larger number: the second half runs towards its smaller one.
        self.mesh.curves.insert((ends.0, node), first);
        self.mesh.curves.insert((ends.1, node), second.reversed());
        node
    }

    /// Nodes in the middle of the halves of a quadratic cell's sides, on the curve.
    fn halve_sides(&mut self, cell: &Cell) {
        for nodes in cell.kind.facets() {
            let [a, b, mid] = [nodes[0], nodes[1], nodes[2]].map(|i| cell.nodes()[i]);
            let ends = edge(a, b);
            if self.middles.contains_key(&edge(a, mid)) {
                continue;
            }
            let [p, q, m] = [ends.0, ends.1, mid].map(|i| self.point(i));
            let halves = match self.mesh.curves.remove(&ends) {
                Some(curve) => {
                    let [first, second] = curve.halves(p, q).1;
                    let second = second.reversed();
                    self.mesh.curves.insert(edge(ends.0, mid), first.along(ends.0, mid));
                    self.mesh.curves.insert(edge(ends.1, mid), second.along(ends.1, mid));
                    [first.halves(p, m).0, second.halves(q, m).0]
                }
                // The parabola through the three nodes, a quarter of the way from each end.
                None => [(p, q), (q, p)].map(|(near, far)| {
                    [0, 1].map(|d| {
                        hanging::QUARTER[0] * near[d]
                            + hanging::QUARTER[1] * far[d]
                            + hanging::QUARTER[2] * m[d]
                    })
                }),
            };
            for (end, at) in [ends.0, ends.1].into_iter().zip(halves) {
                let node = self.node(at);
                self.middles.insert(edge(end, mid), node);
            }
        }
    }

    /// Centre of a quadrilateral. A linear one's moves by half of what its sides' middles move onto their curves
    /// (transfinite interpolation); a quadratic one's is that of its map.
    fn center(&mut self, cell: &Cell, mids: &[u32]) -> u32 {
        let corner = |i: usize| self.point(cell.nodes()[i]);
        let mean = middle(middle(corner(0), corner(1)), middle(corner(2), corner(3)));
        let m: Vec<[f64; 2]> = mids.iter().map(|&i| self.point(i)).collect();
        let of_sides = middle(middle(m[0], m[2]), middle(m[1], m[3]));
        self.node([0, 1].map(|d| 2.0 * of_sides[d] - mean[d]))
    }

    /// Mid-side node of a child of a quadratic cell: on the cell's side, or inside.
    fn inner_middle(&mut self, cell: &Cell, a: u32, b: u32, center: Option<u32>) -> u32 {
        let ends = edge(a, b);
        if let Some(&node) = self.middles.get(&ends) {
            return node;
        }
        // Where the ends lie in the cell's map, and their middle there.
        let at = |node: u32| match cell.nodes().iter().position(|&n| n == node) {
            Some(i) => cell.kind.node_coordinates()[i],
            None => {
                debug_assert_eq!(Some(node), center);
                [0.0; 3]
            }
        };
        let (p, q) = (at(a), at(b));
        let shape = cell.kind.shape(&std::array::from_fn(|d| 0.5 * (p[d] + q[d])));
        let mut x = [0.0; 2];
        for (&node, n) in cell.nodes().iter().zip(shape.n) {
            let p = self.point(node);
            (0..2).for_each(|d| x[d] += n * p[d]);
        }
        let node = self.node(x);
        self.middles.insert(ends, node);
        node
    }

    /// Surfaces, groups and hanging sides.
    fn finish(mut self, cut: &[bool]) -> Mesh {
        let halves = |f: &Facet| {
            let side = f.side;
            let (first, n) = (self.first[f.cell as usize], self.old.cells[f.cell as usize].kind.n_corners());
            // The first half of a side is its corner's child's, the second half the next corner's.
            let second = first + ((f.side as usize + 1) % n) as u32;
            let children =
                if cut[f.cell as usize] { vec![first + u32::from(f.side), second] } else { vec![first] };
            children.into_iter().map(move |cell| Facet { cell, side })
        };
        let finer = |facets: &Vec<Facet>| facets.iter().flat_map(halves).collect();
        let surfaces: BTreeMap<_, _> =
            self.old.surfaces.iter().map(|(name, list)| (name.clone(), finer(list))).collect();
        let children = |&cell: &u32| {
            let first = self.first[cell as usize];
            first..first + if cut[cell as usize] { 4 } else { 1 }
        };
        let groups = self.old.groups.iter();
        self.mesh.groups =
            groups.map(|(name, cells)| (name.clone(), cells.iter().flat_map(children).collect())).collect();
        let mut hanging = Vec::new();
        // A child of a coarse cell may stand against children of finer ones.
        for (c, cell) in self.mesh.cells.iter().enumerate() {
            for side in 0..cell.kind.facets().len() as u8 {
                let nodes: Vec<u32> = cell.facet_nodes(side).collect();
                let coarse = Facet { cell: c as u32, side };
                let of = |a: u32, b: u32| self.middles.get(&edge(a, b)).copied();
                let found = match nodes[..] {
                    [a, b] => of(a, b).map(|middle| HangingSide { coarse, middle, quarters: None }),
                    [a, b, middle] => of(a, middle).zip(of(middle, b)).map(|(p, q)| HangingSide {
                        coarse,
                        middle,
                        quarters: Some([p, q]),
                    }),
                    _ => None,
                };
                hanging.extend(found);
            }
        }
        (self.mesh.surfaces, self.mesh.hanging) = (surfaces, hanging);
        self.mesh
    }
}

impl Curve {
    /// A curve given from `from` to `to`, as it is stored: from the smaller number.
    fn along(self, from: u32, to: u32) -> Curve {
        if from < to { self } else { self.reversed() }
    }
}
