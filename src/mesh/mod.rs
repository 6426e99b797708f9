//! The mesh of a body: points, cells by kind, named surfaces.
use crate::element::ElementKind;
use std::collections::BTreeMap;

/// Mesh of one body.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Number of space dimensions.
    pub dim: usize,
    /// Node coordinates, m; z = 0 in two dimensions.
    pub points: Vec<[f64; 3]>,
    /// All cells.
    pub cells: Vec<Cell>,
    /// Named sets of boundary facets.
    pub surfaces: BTreeMap<String, Vec<Facet>>,
}

/// A cell: its kind and its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Element kind.
    pub kind: ElementKind,
    /// Node indices; the first `kind.n_nodes()` count.
    nodes: [u32; 8],
}

impl Cell {
    /// A cell from its nodes.
    pub fn new(kind: ElementKind, nodes: &[u32]) -> Self {
        let mut all = [0; 8];
        all[..kind.n_nodes()].copy_from_slice(&nodes[..kind.n_nodes()]);
        Cell { kind, nodes: all }
    }

    /// Its nodes, in the element's order.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.kind.n_nodes()]
    }
}

/// A boundary facet: a side of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Facet {
    /// Cell index.
    pub cell: u32,
    /// Which of the cell's facets.
    pub side: u8,
}

impl Mesh {
    /// Nodes of a facet: the two ends, then the mid-side node; the body lies to the left.
    pub fn facet_nodes(&self, facet: Facet) -> impl Iterator<Item = u32> + '_ {
        let cell = &self.cells[facet.cell as usize];
        cell.kind.facets()[facet.side as usize].iter().map(move |&i| cell.nodes()[i])
    }
}
