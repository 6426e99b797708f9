//! Contact of several deformable bodies by the Schwarz alternating method on MPI rank groups.
#![warn(missing_docs)]

pub mod case;
pub mod element;
pub mod error;
pub mod material;
pub mod mesh;
pub mod output;
pub mod petsc;

pub use error::{Error, Result};
