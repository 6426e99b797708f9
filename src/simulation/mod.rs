//! A run, from the checked case to the files: builds everything, calls everything, computes nothing itself.
mod adapt;
mod adapted;
mod checks;
mod energy;
mod evidence;
mod fields;
mod files;
mod friction_fields;
mod measure;
mod options;
mod outline;
mod outlook;
mod pairs;
mod paths;
mod plastic;
mod plausible;
mod report;
mod results;
mod solved;

pub use crate::scene::{Plan, build_mesh};
pub use adapt::{Goal, Limits, Quantity, run_adaptive};
pub use measure::{ContactSolve, ContactSplit, on_contact_rows};
pub use outlook::outlook;

use crate::{
    case::Case,
    error::Result,
    estimate::Estimate,
    output,
    record::{HistoryRow, Summary},
};
use mpi::topology::SimpleCommunicator;
use report::Start;
use solved::Solved;
use std::path::Path;

/// Runs a case and writes its results. Returns the summary (complete on world rank 0). Collective.
pub fn run(
    case: &Case,
    world: &SimpleCommunicator,
    directory: &Path,
    progress: impl FnMut(&HistoryRow),
) -> Result<Summary> {
    Ok(run_and_estimate(case, world, directory, progress)?.0)
}

/// The same, with the error estimate of the last step, cell by cell. Collective.
pub fn run_and_estimate(
    case: &Case,
    world: &SimpleCommunicator,
    directory: &Path,
    mut progress: impl FnMut(&HistoryRow),
) -> Result<(Summary, Estimate)> {
    let start = Start::now();
    output::prepare(world, directory)?;
    let solved = Solved::new(case, world, directory, true, &mut progress)?;
    solved.finish(case, world, directory, &start, None)
}
