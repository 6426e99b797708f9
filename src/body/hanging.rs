//! Nodes that hang on the side of a coarser cell: they are no unknowns, their displacements follow from their masters.
//!
//! With u = T u_m in a cell, T the identity but for its slaves, stiffness and forces go to the masters as T' K T and
//! T' f. A slave's own row is an identity row like that of a held unknown, its right-hand side zero; after each solve
//! it gets the value that its masters give it.
use crate::mesh::{Cell, MeshPart, Slave};

/// The slaves of a part of a mesh, in the part's numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hanging<'a>(&'a [Slave]);

/// A cell with slaves: the nodes that take their place, and T.
pub(super) struct Reduced {
    /// The cell's own nodes that are no slaves, then masters that it does not have.
    pub nodes: Vec<u32>,
    /// Of each node of the cell: positions among `nodes`, and weights.
    rows: Vec<Vec<(usize, f64)>>,
}

impl<'a> Hanging<'a> {
    pub fn of(part: &'a MeshPart) -> Self {
        Hanging(&part.slaves)
    }

    pub fn is_empty(self) -> bool {
        self.0.is_empty()
    }

    fn find(self, node: u32) -> Option<&'a Slave> {
        self.0.binary_search_by_key(&node, |slave| slave.node).ok().map(|i| &self.0[i])
    }

    /// Slaves among the first `n` nodes: the owned or the local ones.
    pub fn among(self, n: usize) -> impl Iterator<Item = &'a Slave> {
        self.0.iter().take_while(move |slave| (slave.node as usize) < n)
    }

    /// `None` for a cell without slaves.
    pub fn reduce(self, cell: &Cell) -> Option<Reduced> {
        if self.is_empty() || cell.nodes().iter().all(|&node| self.find(node).is_none()) {
            return None;
        }
        let mut nodes: Vec<u32> = cell.nodes().iter().copied().filter(|&n| self.find(n).is_none()).collect();
        let rows = cell.nodes().iter().map(|&node| {
            let itself = [(node, 1.0)];
            let masters = self.find(node).map_or(&itself[..], |slave| &slave.masters);
            let place = |&(master, weight): &(u32, f64)| {
                let known = nodes.iter().position(|&n| n == master);
                let at = known.unwrap_or_else(|| {
                    nodes.push(master);
                    nodes.len() - 1
                });
                (at, weight)
            };
            masters.iter().map(place).collect()
        });
        let rows = rows.collect();
        Some(Reduced { nodes, rows })
    }

    /// Moves what nodal values (forces) the slaves have to their masters.
    pub fn distribute(self, values: &mut [f64], dim: usize) {
        for slave in self.0 {
            for c in 0..dim {
                let value = std::mem::take(&mut values[slave.node as usize * dim + c]);
                for &(master, weight) in &slave.masters {
                    values[master as usize * dim + c] += weight * value;
                }
            }
        }
    }
}

impl Reduced {
    /// K to T' K T and f to T' f, in place at the start of the arrays; n unknowns before. Returns how many after.
    pub fn apply(&self, dim: usize, n: usize, k: &mut [f64], f: &mut [f64]) -> usize {
        let m = self.nodes.len() * dim;
        let mut half = vec![0.0; n * m];
        for row in 0..n {
            for (b, terms) in self.rows.iter().enumerate() {
                for &(to, weight) in terms {
                    (0..dim).for_each(|c| half[row * m + to * dim + c] += weight * k[row * n + b * dim + c]);
                }
            }
        }
        let mut force = vec![0.0; m];
        k[..m * m].fill(0.0);
        for (a, terms) in self.rows.iter().enumerate() {
            for &(to, weight) in terms {
                for c in 0..dim {
                    let (from, to) = (a * dim + c, to * dim + c);
                    (0..m).for_each(|j| k[to * m + j] += weight * half[from * m + j]);
                    force[to] += weight * f[from];
                }
            }
        }
        f[..m].copy_from_slice(&force);
        m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;

    #[test]
    fn the_energy_of_a_cell_is_that_of_its_nodes_where_slaves_follow() {
        let slaves = [Slave { node: 1, masters: vec![(0, 0.5), (7, 0.5)] }];
        let cell = Cell::new(ElementKind::Quad4, &[0, 1, 2, 3]);
        let reduced = Hanging(&slaves).reduce(&cell).unwrap();
        assert_eq!(reduced.nodes, [0, 2, 3, 7]);
        let (n, dim) = (8, 2);
        let k: Vec<f64> = (0..n * n).map(|i| 1.0 / (1.0 + (i / n) as f64 + (i % n) as f64)).collect();
        let f: Vec<f64> = (0..n).map(|i| i as f64 - 2.0).collect();
        let u = [0.3, -0.2, 0.7, 0.1, -0.4, 0.9, 0.5, 0.6];
        let full = [u[0], u[1], 0.5 * (u[0] + u[6]), 0.5 * (u[1] + u[7]), u[2], u[3], u[4], u[5]];
        let energy = |k: &[f64], u: &[f64]| -> f64 { (0..n * n).map(|i| u[i / n] * k[i] * u[i % n]).sum() };
        let work = |f: &[f64], u: &[f64]| -> f64 { std::iter::zip(f, u).map(|(f, u)| f * u).sum() };
        let (mut kr, mut fr) = (k.clone(), f.clone());
        assert_eq!(reduced.apply(dim, n, &mut kr, &mut fr), n);
        assert!((energy(&kr, &u) - energy(&k, &full)).abs() < 1e-14);
        assert!((work(&fr, &u) - work(&f, &full)).abs() < 1e-14);
        assert!(Hanging(&slaves).reduce(&Cell::new(ElementKind::Quad4, &[0, 2, 3, 4])).is_none());
    }
}
