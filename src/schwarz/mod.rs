//! The Schwarz alternating method: bodies are solved separately and exchange contact displacements and contact nodal
//! forces until both agree (Stankevich, Yakovlev, Si Tu Htet 2012).
//!
//! This module knows interface vectors, not physics. A body is a [`Respond`]: given contact forces it
//! answers with displacements (force step, Neumann), given contact displacements it answers with forces (displacement
//! step, Dirichlet). What to do with the two steps is a driver's business: [`ActiveSet`] is the default, [`Alternation`] the
//! paper's.
mod active_set;
#[cfg(test)]
mod active_set_tests;
mod alternation;
mod coarse;
mod coupling;
mod dual;
mod friction;
mod frictional;
mod guess;
mod influence;
mod learned;
mod lifting;
mod projected_cg;
mod quadratic;
mod record;
mod respond;
mod scales;
mod sliding;
mod state;
#[cfg(test)]
mod tests;
mod tolerance;
mod verdict;
pub mod weights;

pub use alternation::{Alternation, Known, Measures};
pub use coarse::{Coarse, Projector};
pub use coupling::{Coupling, End, Interpolated, PairRows, Share, Steps};
pub use frictional::Touch;
pub use respond::{Respond, Spring};
pub use state::{ActiveSet, Ended, Limits, MeshError, Outcome};
pub use tolerance::AUTOMATIC;
pub use verdict::{Reason, Watch};
