//! The Schwarz alternating method: bodies are solved separately and exchange contact displacements and contact nodal
//! forces until both agree (Stankevich, Yakovlev, Si Tu Htet 2012).
//!
//! This module knows interface vectors, not physics. A body is a [`RespondAtNodes`] (or [`Respond`]): given contact forces it answers with
//! displacements (force step, Neumann), given contact displacements it answers with forces (displacement step,
//! Dirichlet). What to do with the two steps is a driver's business; [`alternation`] is the paper's.
mod active_set;
#[cfg(test)]
mod active_set_tests;
pub mod alternation;
mod coarse;
mod coupling;
mod dual;
mod guess;
mod influence;
mod projected_cg;
mod quadratic;
mod record;
mod respond;
mod scales;
mod side;
#[cfg(test)]
mod tests;
mod tolerance;
mod verdict;
pub mod weights;

pub use active_set::{ActiveSet, Limits};
pub use alternation::{Alternation, Outcome, Settings};
pub use coarse::{Coarse, Projector};
pub use coupling::{Coupling, End, PairRows, Share, Steps};
pub use respond::{Respond, Spring};
pub use side::{ContactNode, Side};
pub use tolerance::{AUTOMATIC, MeshError};
pub use verdict::{Reason, Watch};

use crate::error::Result;

/// A body as the paper's alternation sees it: contact rows (one normal direction at one node each) and observed nodes.
pub trait RespondAtNodes {
    /// Force step: displacement of every observed node, m, under the compressive normal forces `force`, N, one per
    /// row, and all loads of the body.
    fn force_step(&mut self, force: &[f64]) -> Result<Vec<[f64; 3]>>;

    /// Displacement step: rows with a value have this outward normal displacement, m, prescribed; the others carry no
    /// contact force. Returns the compressive normal force of every row, N.
    fn displacement_step(&mut self, prescribed: &[Option<f64>]) -> Result<Vec<f64>>;
}
