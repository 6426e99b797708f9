//! One load step after the other: a [`State`] is one accepted point of the load path, [`Engine::advance`] makes the next
//! one of it and never changes it, and [`march`] goes along the path, in smaller steps where a step fails.
mod active;
mod contacts;
mod engine;
mod found;
mod length;
mod march;
mod neutral;
mod relaxed;
mod rows;
mod state;
mod task;
mod text;

pub(crate) use active::{Active, Nodal};
pub(crate) use contacts::Contacts;
pub(crate) use engine::{Advanced, Engine};
pub(crate) use found::{EndFound, Found};
pub(crate) use march::{Accepted, End, march};
pub use relaxed::Interface;
pub(crate) use relaxed::Relaxed;
pub use state::{BodyState, NodeState, PairState, State, Status};
pub(crate) use task::{Influence, Scene, Target};
pub(crate) use text::gather_lines;
