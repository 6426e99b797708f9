//! The mesh of a body: points, cells by kind, named surfaces.
mod check;
mod components;
mod generate;
mod gmsh;
mod locate;
mod part;
mod partition;
mod refine;
#[cfg(test)]
mod testing;

pub use check::check;
pub use components::components;
pub use generate::{Grading, Shape, generate};
pub use gmsh::read as read_gmsh;
pub use locate::{Locator, nearest_node};
pub use part::{MeshPart, Numbering};
pub use partition::{give_to_first, partition};
pub use refine::{Curve, HangingSide, Slave, refine, refine_all};
pub(crate) use refine::{Side, Smooth, smooth};

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
    /// Named sets of cells, increasing: the physical groups of a Gmsh file.
    pub groups: BTreeMap<String, Vec<u32>>,
    /// Curves that boundary sides stand for, by their end nodes, smaller number first; refinement follows them.
    pub curves: BTreeMap<(u32, u32), Curve>,
    /// How far, m, the outline may lie from what boundary sides stand for: their nodes do not tell curve from corner.
    pub unclear: BTreeMap<(u32, u32), f64>,
    /// Sides between a coarse cell and two finer ones.
    pub hanging: Vec<HangingSide>,
}

/// A cell: its kind and its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Element kind.
    pub kind: ElementKind,
    /// What it is of: 0 the body's material, 1, 2, ... its inserts in their order.
    pub material: u8,
    /// Node indices; the first `kind.n_nodes()` count.
    nodes: [u32; 8],
}

impl Cell {
    /// A cell from its nodes.
    pub fn new(kind: ElementKind, nodes: &[u32]) -> Self {
        let mut all = [0; 8];
        all[..kind.n_nodes()].copy_from_slice(&nodes[..kind.n_nodes()]);
        Cell { kind, material: 0, nodes: all }
    }

    /// A cell of the same kind and material on other nodes.
    pub fn on(&self, nodes: &[u32]) -> Self {
        Cell { material: self.material, ..Cell::new(self.kind, nodes) }
    }

    /// Its nodes, in the element's order.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.kind.n_nodes()]
    }

    /// Nodes of one of its sides: the two ends, then the mid-side node; the cell lies to the left.
    pub fn facet_nodes(&self, side: u8) -> impl Iterator<Item = u32> + '_ {
        self.kind.facets()[side as usize].iter().map(|&i| self.nodes[i])
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
        self.cells[facet.cell as usize].facet_nodes(facet.side)
    }

    /// Every side of every cell with its two end nodes, smaller number first.
    pub fn sides(&self) -> impl Iterator<Item = ((u32, u32), Facet)> + '_ {
        self.cells.iter().enumerate().flat_map(|(c, cell)| {
            cell.kind.facets().iter().enumerate().map(move |(s, local)| {
                let (a, b) = (cell.nodes()[local[0]], cell.nodes()[local[1]]);
                ((a.min(b), a.max(b)), Facet { cell: c as u32, side: s as u8 })
            })
        })
    }

    /// Sides of one cell only: the boundary, hanging sides, and sides whose cells have mid-side nodes of their own.
    pub fn single_sides(&self) -> Vec<Facet> {
        // All sides, sorted by their smaller end node: `start` has where those of each node begin.
        let mut start = vec![0; self.points.len() + 1];
        self.sides().for_each(|((low, _), _)| start[low as usize + 1] += 1);
        (1..start.len()).for_each(|node| start[node] += start[node - 1]);
        let mut next = start.clone();
        let mut sides = vec![((0, None), Facet { cell: 0, side: 0 }); start[self.points.len()]];
        for ((low, high), facet) in self.sides() {
            sides[next[low as usize]] = ((high, self.facet_nodes(facet).nth(2)), facet);
            next[low as usize] += 1;
        }
        let of_nodes = start.windows(2).map(|range| &sides[range[0]..range[1]]);
        let single = of_nodes.flat_map(|sides| {
            sides.iter().filter(|side| sides.iter().filter(|other| other.0 == side.0).count() == 1)
        });
        single.map(|&(_, facet)| facet).collect()
    }

    /// Gives the straight boundary sides of a mesh read from a file, those of linear cells, the curves of a smooth
    /// outline: refinement follows them. Corners are kept, straight lines stay straight.
    pub fn follow_smooth_outline(&mut self) {
        refine::follow(self);
    }

    /// Adds another mesh's nodes, cells, surfaces and groups, unconnected to these; those of one name become one.
    pub fn append(&mut self, other: &Mesh) {
        let (n_nodes, n_cells) = (self.points.len() as u32, self.cells.len() as u32);
        self.dim = self.dim.max(other.dim);
        self.points.extend_from_slice(&other.points);
        for cell in &other.cells {
            let nodes: Vec<u32> = cell.nodes().iter().map(|n| n + n_nodes).collect();
            self.cells.push(cell.on(&nodes));
        }
        for (name, facets) in &other.surfaces {
            let moved = facets.iter().map(|f| Facet { cell: f.cell + n_cells, side: f.side });
            self.surfaces.entry(name.clone()).or_default().extend(moved);
        }
        for (name, cells) in &other.groups {
            self.groups.entry(name.clone()).or_default().extend(cells.iter().map(|cell| cell + n_cells));
        }
        let curves = other.curves.iter().map(|(&(a, b), &curve)| ((a + n_nodes, b + n_nodes), curve));
        self.curves.extend(curves);
        let unclear = other.unclear.iter().map(|(&(a, b), &doubt)| ((a + n_nodes, b + n_nodes), doubt));
        self.unclear.extend(unclear);
        self.hanging.extend(other.hanging.iter().map(|side| side.moved(n_nodes, n_cells)));
    }
}
