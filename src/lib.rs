//! Contact of several deformable bodies by the Schwarz alternating method on MPI rank groups.
#![warn(missing_docs)]

pub mod body;
pub mod case;
pub mod contact;
pub mod element;
pub mod error;
pub mod estimate;
pub mod material;
pub mod mesh;
pub mod output;
pub mod parallel;
pub mod petsc;
mod plain_text;
pub mod record;
pub mod scene;
pub mod schwarz;
pub mod simulation;
mod stable_hash;
pub mod step;
pub mod study;
mod tolerances;
pub mod vector;

pub use error::{Error, Result};
pub use plain_text::plain_text;
