//! A-posteriori estimate of the discretisation error: in energy from recovered stresses, in contact pressure from
//! recovered pressures.
//!
//! Energy: the stresses sigma_h at the points of the cells around a node are fitted by a polynomial (superconvergent
//! patch recovery, Zienkiewicz and Zhu, Int. J. Numer. Meth. Engng 33 (1992) 1331 and 1365); the nodal values of the
//! fits, interpolated, are the recovered stress sigma*. Then
//!
//! |e|^2 = int (sigma* - sigma_h) : C^-1 (sigma* - sigma_h) t dA,   |u_h|^2 = int sigma_h : C^-1 sigma_h t dA,
//!
//! and the relative error of a body, or of all together, is |e| / sqrt(|u_h|^2 + |e|^2).
mod energy;
mod patch;
mod recovery;

pub use energy::{BodyError, CellError};

use crate::parallel::{self, Groups};

/// Error estimate of a load step. The cells are this rank's, the numbers are the same on all ranks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Estimate {
    /// The bodies of this rank's group, in the group's order.
    pub bodies: Vec<BodyError>,
    /// The contact pairs, in file order; on every rank the numbers, on the rank that holds the multipliers the nodes, too.
    pub pairs: Vec<PairError>,
    /// |e| / sqrt(|u_h|^2 + |e|^2) of all bodies together.
    pub energy: f64,
    /// Largest relative error of the contact pressure of a pair; `None` if nothing touches.
    pub contact_pressure: Option<f64>,
}

/// Error estimate of the pressure of a contact pair.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairError {
    /// Index of the pair in the case.
    pub pair: usize,
    /// Relative to the peak pressure; `None` if nothing touches.
    pub pressure: Option<f64>,
    /// Mesh nodes of the side that carries the multipliers, in contact or next to it, with the error of the pressure
    /// there, Pa. Filled on the first rank of that body's group, empty elsewhere.
    pub nodes: Vec<NodeError>,
    /// Body and side of the pair that the nodes are of.
    pub body: usize,
    /// 0: side A.
    pub side: usize,
}

/// Pressure error at a node.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NodeError {
    /// Node of the body's whole mesh.
    pub node: u32,
    /// Estimated error of the pressure, Pa, not negative.
    pub error: f64,
}

impl Estimate {
    /// Puts the bodies of this rank's group together with those of the others. Collective.
    pub fn new(bodies: Vec<BodyError>, groups: &Groups) -> Estimate {
        let mut sums = [0.0; 2];
        for body in bodies.iter().filter(|_| groups.is_root()) {
            sums[0] += body.error2;
            sums[1] += body.energy2;
        }
        let sums = parallel::sum(&groups.world, &sums);
        Estimate { bodies, energy: energy::relative(sums[0], sums[1]), ..Estimate::default() }
    }
}
