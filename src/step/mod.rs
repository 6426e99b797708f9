//! One load step after the other: a [`State`] is one accepted point of the load path, `Engine::advance` makes the next
//! one of it and never changes it, and `march` goes along the path, in increments that are halved where one fails.
mod advance;
mod contacts;
mod engine;
mod found;
mod influence;
mod known;
mod length;
mod march;
mod neutral;
mod newton;
mod place;
mod report;
mod rows;
mod state;
mod task;
mod text;
mod way;

pub(crate) use advance::Advanced;
pub(crate) use contacts::Contacts;
pub(crate) use engine::{Engine, Nodal};
pub(crate) use found::{EndFound, Found};
pub(crate) use march::{Accepted, End, march};
pub use state::{BodyState, Energy, NodeState, PairState, State};
pub(crate) use task::{Influence, Scene, Target};
pub(crate) use text::gather_lines;
