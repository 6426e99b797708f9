//! What a run leaves behind: `result.vtkhdf`, `summary.json`, pictures.
use crate::mesh::Cell;

/// This rank's share of the fields: one partition of the VTKHDF grid, with the pieces of all bodies the rank takes part in.
#[derive(Debug, Clone, Default)]
pub struct Piece {
    /// Node coordinates, m.
    pub points: Vec<[f64; 3]>,
    /// Cells, with indices into `points`.
    pub cells: Vec<Cell>,
    /// Body index of each cell.
    pub cell_bodies: Vec<i32>,
    /// Fields at the nodes. Every rank holds the same fields in the same order.
    pub point_fields: Vec<Field>,
    /// Fields per cell (mean over the cell).
    pub cell_fields: Vec<Field>,
}

/// A named field: `values.len() == components * n`, point- or cell-major. Tensors are (xx, yy, zz, xy, yz, xz).
#[derive(Debug, Clone)]
pub struct Field {
    /// Name shown by ParaView.
    pub name: String,
    /// SI unit (`Pa`, `m`, `K`, `-`).
    pub unit: &'static str,
    /// Components per point or cell: 1, 3 or 6.
    pub components: usize,
    /// The values.
    pub values: Vec<f64>,
}

/// One side of a contact pair after the run, node by node along the surface. Held by one rank only.
#[derive(Debug, Clone, Default)]
pub struct SideTable {
    /// Coordinate along the surface, m, from its first node.
    pub s: Vec<f64>,
    /// Node coordinates, undeformed, m.
    pub x: Vec<[f64; 3]>,
    /// Outward unit normal used for contact.
    pub normal: Vec<[f64; 3]>,
    /// Gap after deformation, m; NaN where the node has no conjugate point.
    pub gap: Vec<f64>,
    /// Contact pressure, Pa.
    pub pressure: Vec<f64>,
    /// Contact nodal force on this body, N.
    pub force: Vec<[f64; 3]>,
    /// 0: no candidate, 1: open, 2: in contact.
    pub status: Vec<i32>,
}

/// One row of the history: an alternation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HistoryRow {
    /// 1, 2, ...
    pub alternation: u64,
    /// Displacement jump relative to the elastic response, -.
    pub displacement_jump: f64,
    /// Disagreement of the nodal forces of the displacement step, relative, -.
    pub force_imbalance: f64,
    /// Active nodes, both sides of all pairs.
    pub active: u64,
    /// Measured contraction of the displacement jump, -; NaN for the first.
    pub contraction: f64,
    /// Wall seconds since the first alternation began.
    pub seconds: f64,
}
