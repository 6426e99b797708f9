//! The entries of a stiffness matrix as its cells contribute them.
//!
//! A body on one rank has the pattern of its rows made first, from the cells around each node, and every contribution
//! added in its place; on several ranks the contributions are kept as triples, which PETSc sends to their owners.
use crate::{error::Result, petsc::Matrix};
use mpi::{topology::SimpleCommunicator, traits::*};

pub(super) enum Entries {
    /// Nobody asks for them.
    Nothing,
    BlockRows(BlockRows),
    Triples {
        rows: Vec<i32>,
        columns: Vec<i32>,
        values: Vec<f64>,
    },
}

/// Rows of node blocks, `dim` x `dim` values each, in the order of compressed rows of single unknowns.
pub(super) struct BlockRows {
    dim: usize,
    /// Of each node: where its neighbours begin.
    start: Vec<usize>,
    /// Itself and the nodes that share a cell with it, ascending.
    neighbours: Vec<u32>,
    values: Vec<f64>,
}

/// Lists of nodes, one per cell.
#[derive(Default)]
pub(super) struct Lists {
    nodes: Vec<u32>,
    ends: Vec<usize>,
}

impl Lists {
    pub fn push(&mut self, nodes: impl Iterator<Item = u32>) {
        self.nodes.extend(nodes);
        self.ends.push(self.nodes.len());
    }

    fn of(&self, cell: usize) -> &[u32] {
        &self.nodes[if cell == 0 { 0 } else { self.ends[cell - 1] }..self.ends[cell]]
    }
}

impl Entries {
    /// Nothing yet. `cells`: global nodes of the cells to come; `n_nodes`: of all ranks together.
    pub fn new(group: &SimpleCommunicator, n_nodes: usize, dim: usize, cells: &Lists) -> Entries {
        match group.size() {
            1 => Entries::BlockRows(BlockRows::new(n_nodes, dim, cells)),
            _ => {
                let n = (0..cells.ends.len()).map(|cell| (cells.of(cell).len() * dim).pow(2)).sum();
                Entries::Triples {
                    rows: Vec::with_capacity(n),
                    columns: Vec::with_capacity(n),
                    values: Vec::with_capacity(n),
                }
            }
        }
    }

    /// Adds a cell's matrix, row by row; `dofs`: its global unknowns, node by node, -1 for one that is left out.
    pub fn add(&mut self, dofs: &[i32], k: &[f64]) {
        match self {
            Entries::Nothing => {}
            Entries::BlockRows(of_nodes) => of_nodes.add(dofs, k),
            Entries::Triples { rows, columns, values } => {
                for (i, k) in std::iter::zip(dofs, k.chunks_exact(dofs.len())) {
                    rows.extend(std::iter::repeat_n(*i, dofs.len()));
                    columns.extend_from_slice(dofs);
                    values.extend_from_slice(k);
                }
            }
        }
    }

    /// Adds to the diagonal of an unknown of this rank.
    pub fn add_diagonal(&mut self, dof: i32, value: f64) {
        match self {
            Entries::Nothing => {}
            Entries::BlockRows(of_nodes) => {
                let (node, c) = (dof as usize / of_nodes.dim, dof as usize % of_nodes.dim);
                if let Some(at) = of_nodes.place(node, node as u32) {
                    of_nodes.values[at.first + c * at.stride + c] += value;
                }
            }
            Entries::Triples { rows, columns, values } => {
                rows.push(dof);
                columns.push(dof);
                values.push(value);
            }
        }
    }

    /// Rows, columns and values of a body on one rank.
    pub fn into_triples(self) -> (Vec<i32>, Vec<i32>, Vec<f64>) {
        match self {
            Entries::BlockRows(of_nodes) => {
                let (starts, columns) = of_nodes.compressed();
                let row = |(i, bounds): (usize, &[i32])| {
                    std::iter::repeat_n(i as i32, (bounds[1] - bounds[0]) as usize)
                };
                let rows = starts.windows(2).enumerate().flat_map(row).collect();
                (rows, columns, of_nodes.values)
            }
            Entries::Triples { rows, columns, values } => (rows, columns, values),
            Entries::Nothing => Default::default(),
        }
    }

    /// The matrix of `n_owned` unknowns of this rank. Collective.
    pub fn into_matrix(self, group: &SimpleCommunicator, n_owned: usize, dim: usize) -> Result<Matrix> {
        match self {
            Entries::Nothing => Matrix::from_triples(group, n_owned, dim, Default::default(), Vec::new()),
            Entries::BlockRows(rows) => {
                let (starts, columns) = rows.compressed();
                Matrix::from_rows(group, dim, starts, columns, rows.values)
            }
            Entries::Triples { rows, columns, values } => {
                Matrix::from_triples(group, n_owned, dim, (rows, columns), values)
            }
        }
    }
}

/// Where a node block's values are: rows `stride` apart.
struct Slot {
    first: usize,
    stride: usize,
}

impl BlockRows {
    fn new(n_nodes: usize, dim: usize, cells: &Lists) -> BlockRows {
        // The cells of each node.
        let mut start = vec![0; n_nodes + 1];
        cells.nodes.iter().for_each(|&node| start[node as usize + 1] += 1);
        (0..n_nodes).for_each(|node| start[node + 1] += start[node]);
        let (mut next, mut cells_of) = (start.clone(), vec![0; cells.nodes.len()]);
        for cell in 0..cells.ends.len() {
            for &node in cells.of(cell) {
                let next = &mut next[node as usize];
                cells_of[*next] = cell;
                *next += 1;
            }
        }
        let mut seen_by = vec![u32::MAX; n_nodes];
        let (mut neighbours, mut starts) = (Vec::with_capacity(4 * cells.nodes.len()), vec![0]);
        for node in 0..n_nodes {
            let first = neighbours.len();
            for &cell in &cells_of[start[node]..start[node + 1]] {
                for &other in cells.of(cell) {
                    if seen_by[other as usize] != node as u32 {
                        seen_by[other as usize] = node as u32;
                        neighbours.push(other);
                    }
                }
            }
            neighbours[first..].sort_unstable();
            starts.push(neighbours.len());
        }
        let values = vec![0.0; neighbours.len() * dim * dim];
        BlockRows { dim, start: starts, neighbours, values }
    }

    fn place(&self, row: usize, column: u32) -> Option<Slot> {
        let (first, dim) = (self.start[row], self.dim);
        let of_row = &self.neighbours[first..self.start[row + 1]];
        let position = of_row.iter().position(|&n| n == column)?;
        Some(Slot { first: first * dim * dim + position * dim, stride: of_row.len() * dim })
    }

    fn add(&mut self, dofs: &[i32], k: &[f64]) {
        let (n, dim) = (dofs.len(), self.dim);
        let node = |of_node: &[i32]| of_node.iter().find(|&&dof| dof >= 0).map(|&dof| dof as usize / dim);
        for (a, rows) in dofs.chunks_exact(dim).enumerate() {
            let Some(row) = node(rows) else { continue };
            for (b, columns) in dofs.chunks_exact(dim).enumerate() {
                let Some(column) = node(columns) else { continue };
                let Some(place) = self.place(row, column as u32) else { continue };
                for c in (0..dim).filter(|&c| rows[c] >= 0) {
                    let to = &mut self.values[place.first + c * place.stride..][..dim];
                    let from = &k[(a * dim + c) * n + b * dim..][..dim];
                    for d in (0..dim).filter(|&d| columns[d] >= 0) {
                        to[d] += from[d];
                    }
                }
            }
        }
    }

    /// Starts of the unknowns' rows, and their columns.
    fn compressed(&self) -> (Vec<i32>, Vec<i32>) {
        let dim = self.dim;
        let (mut starts, mut columns) = (vec![0], Vec::with_capacity(self.values.len()));
        for bounds in self.start.windows(2) {
            for _ in 0..dim {
                for &node in &self.neighbours[bounds[0]..bounds[1]] {
                    columns.extend((0..dim).map(|d| (node as usize * dim + d) as i32));
                }
                starts.push(columns.len() as i32);
            }
        }
        (starts, columns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_the_sums_of_the_cells() {
        let cells = [vec![0_u32, 1, 3], vec![1, 2, 3], vec![4, 3, 2]];
        let (n_nodes, dim) = (5, 2);
        let mut lists = Lists::default();
        cells.iter().for_each(|nodes| lists.push(nodes.iter().copied()));
        let mut rows = BlockRows::new(n_nodes, dim, &lists);
        let n = n_nodes * dim;
        let mut dense = vec![0.0; n * n];
        for (number, nodes) in cells.iter().enumerate() {
            let mut dofs: Vec<i32> =
                nodes.iter().flat_map(|&a| (0..dim).map(move |c| (a as usize * dim + c) as i32)).collect();
            // A support.
            dofs.iter_mut().filter(|dof| **dof == 3).for_each(|dof| *dof = -1);
            let k: Vec<f64> = (0..36).map(|i| (i + 100 * number) as f64).collect();
            for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
                if dofs[i] >= 0 && dofs[j] >= 0 {
                    dense[dofs[i] as usize * n + dofs[j] as usize] += k[i * 6 + j];
                }
            }
            rows.add(&dofs, &k);
        }
        let (starts, columns) = rows.compressed();
        let mut found = vec![0.0; n * n];
        for row in 0..n {
            let range = starts[row] as usize..starts[row + 1] as usize;
            assert!(columns[range.clone()].windows(2).all(|pair| pair[0] < pair[1]));
            range.for_each(|at| found[row * n + columns[at] as usize] = rows.values[at]);
        }
        assert_eq!(found, dense);
    }
}
