//! Contact pairs and load steps after a run, as they go into the result file.
use super::Reason;
use crate::contact::Law;
use std::collections::BTreeMap;

/// One side of a contact pair after the run, node by node along the surface. Held by one rank only.
#[derive(Debug, Clone, Default, PartialEq)]
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
    /// 0: no candidate, 1: open, 2: in contact, 3: in contact and slipping.
    pub status: Vec<i32>,
    /// Of a pair with a tangential law.
    pub tangential: Option<Tangential>,
    /// True if the surfaces are bonded, and may pull.
    pub bonded: bool,
    /// True if the unknown contact forces are on this side; what the other has of gap and pressure is theirs, interpolated.
    pub multipliers: bool,
    /// Length of a closed surface, m: where `s` comes back to the first node. `None`: it has ends.
    pub closed: Option<f64>,
}

/// What a node does along its surface: positive along the outward normal turned by 90 degrees against the clock, on both sides.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tangential {
    /// Tangential traction on this side, Pa.
    pub traction: Vec<f64>,
    /// Slip of this side on the other, all load steps together, m.
    pub slip: Vec<f64>,
}

/// Least status of a node in contact.
pub const IN_CONTACT: i32 = 2;

/// Status of a node that slips.
pub const SLIPS: i32 = 3;

impl SideTable {
    /// True if a node is in contact.
    pub fn touches(&self, node: usize) -> bool {
        self.status[node] >= IN_CONTACT
    }

    /// True if all columns have the same length.
    pub fn is_consistent(&self) -> bool {
        let SideTable { s, x, normal, gap, pressure, force, status, .. } = self;
        let lengths = [x.len(), normal.len(), gap.len(), pressure.len(), force.len(), status.len()];
        let tangential = self.tangential.iter().flat_map(|t| [t.traction.len(), t.slip.len()]);
        lengths.into_iter().chain(tangential).all(|n| n == s.len())
    }
}

/// Both sides of a contact pair. Every rank has the same pairs in the same order, but few have the tables.
#[derive(Debug, Clone, PartialEq)]
pub struct PairTables {
    /// Name of the pair; names its group in the file.
    pub name: String,
    /// `body.surface` of side A and side B.
    pub surfaces: [String; 2],
    /// What the pair does tangentially.
    pub law: Law,
    /// True if the number of the law varies with the temperature.
    pub varies: bool,
    /// The tables, each on one rank, `None` on the others. A side may have none anywhere: a rigid surface.
    pub sides: [Option<SideTable>; 2],
}

/// A load step that was run: what acted at its end, and how it ended. The same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadStep {
    /// Name, if any.
    pub name: Option<String>,
    /// Factor on the loads.
    pub loads: f64,
    /// Factor on the prescribed displacements.
    pub supports: f64,
    /// Factor on temperature less reference temperature.
    pub temperature: f64,
    /// Path parameter; only if a path has a table.
    pub at: Option<f64>,
    /// Factor of each load path, by name.
    pub paths: BTreeMap<String, f64>,
    /// Increments that led to it.
    pub increments: u64,
    /// How the alternation ended.
    pub reason: Reason,
    /// Alternations made.
    pub alternations: u64,
    /// Updates of the active set.
    pub updates: u64,
}
