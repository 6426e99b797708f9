//! The nodes of a body that contact forces may reach. The first rank of the body's group owns them all.
use super::{Constraints, FreeModes};
use crate::contact::vector::{combine, dot, unit};
use crate::mesh::{Mesh, Numbering};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::collections::HashMap;

/// A contact row of a body: its outward displacement is the sum of v . u over the terms, and a compressive force R acts
/// with -R v at its nodes. The vectors v point out of the body and add up to about a unit vector.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BodyRow {
    /// Index among the interface nodes given to [`Body::new`](super::Body::new), and v.
    pub terms: Vec<(usize, [f64; 3])>,
    /// Along the surfaces: at its nodes there is a normal row as well.
    pub tangential: bool,
}

/// The interface nodes. Values at them: nodes x dim, node by node.
pub struct Interface {
    /// Interface node of each node as given, which may repeat.
    given: Vec<usize>,
    /// Mesh nodes, each once; the same on all ranks.
    pub nodes: Vec<u32>,
    /// Coordinates, m.
    pub points: Vec<[f64; 3]>,
    /// Constraints, by position among the nodes.
    pub constraints: Constraints,
    /// Position of each node among this rank's owned nodes: on the first rank; empty elsewhere.
    pub owned: Vec<usize>,
}

impl Interface {
    pub(super) fn new(
        given: &[u32],
        mesh: &Mesh,
        constraints: &Constraints,
        numbering: &Numbering,
        group: &SimpleCommunicator,
    ) -> Interface {
        let (mut nodes, mut place) = (Vec::new(), HashMap::new());
        let given = given
            .iter()
            .map(|&node| {
                *place.entry(node).or_insert_with(|| {
                    nodes.push(node);
                    nodes.len() - 1
                })
            })
            .collect();
        let is_first = group.rank() == 0;
        let owned = nodes.iter().filter(|_| is_first).map(|&n| numbering.new_of_old[n as usize] as usize);
        Interface {
            given,
            owned: owned.collect(),
            points: nodes.iter().map(|&n| mesh.points[n as usize]).collect(),
            constraints: constraints.of_nodes(&nodes),
            nodes,
        }
    }

    /// Owned unknowns, node by node, on the first rank.
    pub(super) fn dofs(&self, dim: usize) -> Vec<usize> {
        self.owned.iter().flat_map(|&i| (0..dim).map(move |c| i * dim + c)).collect()
    }

    /// A free mode at the nodes, global axes.
    pub(super) fn mode(&self, free: &FreeModes, k: usize, dim: usize) -> Vec<f64> {
        let at = |(node, x): (&u32, &[f64; 3])| free.at(k, *node, x).into_iter().take(dim);
        std::iter::zip(&self.nodes, &self.points).flat_map(at).collect()
    }

    /// Rows over the nodes as given to rows over the nodes, each once.
    pub(super) fn own_rows(&self, mut rows: Vec<BodyRow>) -> Vec<BodyRow> {
        rows.iter_mut().flat_map(|row| &mut row.terms).for_each(|(i, _)| *i = self.given[*i]);
        rows
    }

    /// Values at the nodes to vectors at the nodes as given.
    pub(super) fn at_given(&self, values: &[f64], dim: usize) -> Vec<[f64; 3]> {
        self.given
            .iter()
            .map(|&i| std::array::from_fn(|c| if c < dim { values[i * dim + c] } else { 0.0 }))
            .collect()
    }
}

impl BodyRow {
    /// Outward displacement, m, from displacements at the interface nodes in global axes.
    pub(super) fn displacement(&self, u: &[f64], dim: usize) -> f64 {
        self.terms.iter().map(|(i, v)| (0..dim).map(|c| v[c] * u[i * dim + c]).sum::<f64>()).sum()
    }

    /// How far the row's place has moved, m: of the nodes' displacements the mean with the weights v . n, with n the row's
    /// direction.
    pub(super) fn distance(&self, u: &[f64], dim: usize) -> f64 {
        let sum = combine(self.terms.iter().map(|(_, v)| (1.0, v)));
        let n = unit(&sum);
        let mean = (0..dim).map(|c| self.terms.iter().map(|(i, v)| dot(v, &n) * u[i * dim + c]).sum::<f64>());
        mean.map(|u| u * u).sum::<f64>().sqrt()
    }

    /// Adds a multiple of v at the interface nodes.
    pub(super) fn add_to(&self, factor: f64, values: &mut [f64], dim: usize) {
        for (i, v) in &self.terms {
            (0..dim).for_each(|c| values[i * dim + c] += factor * v[c]);
        }
    }
}

/// Sum of the forces -R v of all rows at the interface nodes, N, in global axes.
pub(super) fn contact_force(rows: &[BodyRow], force: &[f64], n_nodes: usize, dim: usize) -> Vec<f64> {
    let mut f = vec![0.0; n_nodes * dim];
    std::iter::zip(rows, force).filter(|(_, r)| **r != 0.0).for_each(|(row, r)| row.add_to(-r, &mut f, dim));
    f
}
