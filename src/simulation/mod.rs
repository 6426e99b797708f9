//! A run, from the checked case to the files: builds everything, calls everything, computes nothing itself.
mod adapt;
mod checks;
mod evidence;
mod fields;
mod measure;
mod outline;
mod outlook;
mod pairs;
mod report;
mod results;
mod solved;

pub use crate::{
    scene::{Plan, build_mesh},
    step::Interface,
};
pub use adapt::{Goal, Limits, Quantity, run_adaptive};
pub use measure::{ContactSolve, ContactSplit};
pub use outlook::outlook;

use crate::{
    case::Case,
    error::{Error, Result},
    estimate::Estimate,
    output,
    parallel::{self, agree},
    record::{HistoryRow, Summary},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use solved::Solved;
use std::{path::Path, time::Instant};

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
    let start = Instant::now();
    output::prepare(world, directory)?;
    Solved::new(case, world, &mut progress)?.finish(case, world, directory, start, None)
}

/// PETSc options with a body's prefix that its solver did not ask for are most likely misspelt.
fn warn_of_unused_options(case: &Case, groups: &parallel::Groups) -> Result<()> {
    for &b in groups.bodies().iter().filter(|_| groups.is_root()) {
        let prefix = crate::body::options_prefix(&case.bodies[b].name);
        for name in crate::petsc::option_prefixes_left(&prefix)? {
            eprintln!("warning: PETSc option -{name} was not used: is it misspelt?");
        }
    }
    Ok(())
}

/// The old summary goes first: a run killed from here on leaves nothing that looks complete.
fn remove_old_summary(world: &SimpleCommunicator, directory: &Path) -> Result<()> {
    let path = directory.join(output::SUMMARY);
    let removed = if world.rank() == 0 && path.exists() {
        std::fs::remove_file(&path)
            .map_err(|e| Error::input(format!("cannot replace {}: {e}", path.display())))
    } else {
        Ok(())
    };
    agree(world, removed)
}

fn draw(case: &Case, file: &Path, directory: &Path) -> Result<()> {
    let results = output::Results::read(file)?;
    output::draw(&results, &case.output, directory).map(|_| ())
}
