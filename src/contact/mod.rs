//! Where surfaces meet: contact surfaces, conjugate points, gaps.
//!
//! Knows surfaces, not bodies: both rank groups of a pair hold both surfaces and compute the same pairing.
mod build;
mod camber;
mod curve;
mod gap;
mod law;
pub mod mortar;
mod normals;
mod pairing;
mod penetration;
mod rigid;
mod rows;
mod search;
mod surface;
#[cfg(test)]
mod testing;

pub use camber::Camber;
pub use gap::{ConjugateRule, Gap};
pub use law::{Coefficients, Law, largest_force};
pub use pairing::{Conjugate, Pairing};
pub use penetration::deepest_node;
pub use rows::{Row, pointwise};
pub use search::Projection;
pub use surface::Surface;

pub(crate) use crate::vector;
pub(crate) use search::Search;
