//! A-posteriori estimate of the discretisation error: in energy from recovered stresses; in contact pressure from
//! recovered pressures, and from what the errors in energy of all bodies change of the peak.
//!
//! Energy: the stresses sigma_h at the points of the cells around a node are fitted by a polynomial (superconvergent
//! patch recovery, Zienkiewicz and Zhu, Int. J. Numer. Meth. Engng 33 (1992) 1331 and 1365); the nodal values of the
//! fits, interpolated, are the recovered stress sigma*. Then
//!
//! |e|^2 = int (sigma* - sigma_h) : C^-1 (sigma* - sigma_h) t dA,   |u_h|^2 = int sigma_h : C^-1 sigma_h t dA,
//!
//! and the relative error of a body, or of all together, is |e| / sqrt(|u_h|^2 + |e|^2).
//!
//! Peak: what the errors change of it is their scalar product in energy with the errors of the dual solution (Becker and
//! Rannacher, Acta Numerica 10 (2001) 1; Ainsworth and Oden, A Posteriori Error Estimation, Wiley 2000, chapter 8), and what no
//! stress of a coarse mesh shows is found on the surface alone (`coarse.rs`).
pub(crate) mod coarse;
mod energy;
mod patch;
mod plane;
pub mod pressure;
mod recovery;

pub(crate) use energy::Solved;
pub use energy::{BodyError, CellError};

use crate::vector::{larger, smaller};
use crate::{
    case::Case,
    contact::Surface,
    parallel,
    record::{ErrorEstimate, IN_CONTACT, SideTable},
    scene::Plan,
};
use pressure::{Chain, Contact};

/// Error estimate of a load step. The cells are this rank's, the numbers are the same on all ranks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Estimate {
    /// The bodies of this rank's group, in the group's order, cell by cell.
    pub bodies: Vec<BodyError>,
    /// |e| / sqrt(|u_h|^2 + |e|^2) of every body of the case, in file order.
    pub body_energy: Vec<f64>,
    /// Elastic energy of every body of the case, |u_h|^2 / 2, J.
    pub strain_energy: Vec<f64>,
    /// The contact pairs, in file order.
    pub pairs: Vec<PairError>,
    /// |e| / sqrt(|u_h|^2 + |e|^2) of all bodies together.
    pub energy: f64,
    /// Largest relative error of the contact pressure of a pair; `None` if nothing touches.
    pub contact_pressure: Option<f64>,
}

/// Error estimate of the pressure of a contact pair.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairError {
    /// Relative to the peak pressure; `None` if nothing touches. The same on all ranks.
    pub pressure: Option<f64>,
    /// Body (in the case) and side (0: A) that carries the multipliers, whose nodes these are.
    pub body: usize,
    #[allow(missing_docs)]
    pub side: usize,
    /// The nodes in contact. On the first rank of that body's group, empty elsewhere.
    pub nodes: Vec<NodeError>,
}

/// Pressure error at a node.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NodeError {
    /// Node of the body's whole mesh.
    pub node: u32,
    /// Estimated error of the pressure, Pa, not negative.
    pub error: f64,
}

impl From<&Estimate> for ErrorEstimate {
    fn from(estimate: &Estimate) -> ErrorEstimate {
        ErrorEstimate { energy: estimate.energy, contact_pressure: estimate.contact_pressure }
    }
}

impl Estimate {
    /// Puts the bodies and the contact pairs of this rank's group together with those of the others. Collective.
    pub(crate) fn new(
        case: &Case,
        plan: &Plan,
        bodies: Vec<BodyError>,
        tables: &[MultiplierSide],
        changes: &[Option<Change>],
    ) -> Estimate {
        let groups = &plan.groups;
        let mut sums = vec![[0.0; 2]; case.bodies.len()];
        for body in bodies.iter().filter(|_| groups.is_root()) {
            sums[body.body] = [body.error2, body.energy2];
        }
        let sums = parallel::sum(&groups.world, sums.as_flattened());
        let (sums, _) = sums.as_chunks::<2>();
        let together = |chosen: &mut dyn Iterator<Item = &[f64; 2]>| {
            let sum = chosen.fold([0.0; 2], |sum, s| [sum[0] + s[0], sum[1] + s[1]]);
            energy::relative(sum[0], sum[1])
        };
        let mut pairs = vec![PairError::default(); case.contacts.len()];
        let mut numbers = vec![[0.0; 3]; case.contacts.len()];
        for table in tables {
            let contact = &case.contacts[table.pair];
            let mut own = contact.surfaces.iter().filter_map(|s| s.body.deformable()).map(|b| &sums[b]);
            let (relative, nodes) = table.errors();
            let global = match changes[table.pair] {
                Some(change) => change.relative(),
                // Where displacements press the bodies together, their energy is off by |e|^2 / |u|^2; the pressure of a Hertz
                // contact goes with the root of it.
                None => 0.5 * together(&mut own).powi(2),
            };
            if let Some(local) = relative {
                numbers[table.pair] = [1.0, larger(local, global), table.side as f64];
            }
            pairs[table.pair].nodes = nodes;
        }
        let numbers = parallel::sum(&groups.world, numbers.as_flattened());
        for ((pair, contact), &[touches, relative, side]) in
            std::iter::zip(&mut pairs, &case.contacts).zip(numbers.as_chunks::<3>().0)
        {
            pair.pressure = (touches > 0.0).then_some(relative);
            pair.side = side as usize;
            pair.body = contact.surfaces[pair.side].body.deformable().unwrap_or(0);
        }
        let contact_pressure = pairs.iter().filter_map(|p| p.pressure).reduce(larger);
        let strain_energy = sums.iter().map(|s| 0.5 * s[1]).collect();
        let body_energy = sums.iter().map(|s| energy::relative(s[0], s[1])).collect();
        let energy = together(&mut sums.iter());
        Estimate { bodies, body_energy, strain_energy, pairs, energy, contact_pressure }
    }
}

/// By how much the peak pressure of a pair would change without the errors of the meshes, relative to it, to first order.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Change {
    /// By what the stresses of all bodies lack: their scalar product in energy with those of the dual solution.
    pub stresses: f64,
    /// By what the partner of a finer mesh cannot follow: of the pair, which stresses may know of as well, and of other pairs.
    pub partners: [f64; 2],
}

/// A change beyond this share is none of first order any more.
const MOST: f64 = 0.9;

impl Change {
    /// Relative error of the peak pressure: of what is there now from what there should be.
    fn relative(&self) -> f64 {
        let [own, others] = self.partners;
        let size = self.stresses.hypot(own) + others.abs();
        if self.stresses + own + others < 0.0 {
            let size = smaller(size, MOST);
            return size / (1.0 - size);
        }
        size
    }
}

/// The side of a pair that carries the multipliers, with what was found there.
pub(crate) struct MultiplierSide<'a> {
    pub pair: usize,
    pub side: usize,
    pub surface: &'a Surface,
    pub table: &'a SideTable,
}

impl MultiplierSide<'_> {
    /// Relative error of the peak pressure, and the nodes' errors.
    fn errors(&self) -> (Option<f64>, Vec<NodeError>) {
        let contact: Vec<Contact> = (self.table.status.iter())
            .map(|status| match status {
                IN_CONTACT.. => Contact::Closed,
                1 => Contact::Open,
                _ => Contact::None,
            })
            .collect();
        let errors = Chain::new(self.surface).errors(&self.table.pressure, &contact);
        let touching = (0..errors.len()).filter(|&n| contact[n] == Contact::Closed);
        let nodes =
            touching.map(|n| NodeError { node: self.surface.nodes[n], error: errors[n].error }).collect();
        (pressure::relative(&self.table.pressure, &errors), nodes)
    }
}
