//! What a run leaves behind, as plain data: how it ended, its history, contact tables and summary. Nothing here reads,
//! writes or computes; every other module may use it.
mod history;
mod reason;
mod summary;
mod tables;

pub use history::{HistoryRow, PairRow, mean_contraction};
pub use reason::{Driver, Reason, Transfer};
pub use summary::*;
pub use tables::{IN_CONTACT, LoadStep, PairTables, SLIPS, SideTable, Tangential};
