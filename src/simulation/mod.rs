//! A run, from the checked case to the files: builds everything, calls everything, computes nothing itself.
mod adapt;
mod checks;
mod evidence;
mod fields;
mod measure;
mod outline;
mod outlook;
mod pairs;
mod plausible;
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

/// What the options of the bodies' solvers say and is not done, and the options that nothing has asked for: most likely
/// misspelt, or without a body's prefix. On world rank 0 at least. Collective.
fn option_warnings(
    case: &Case,
    groups: &parallel::Groups,
    bodies: &[crate::body::Body],
) -> Result<Vec<String>> {
    let of_group = || -> Result<Vec<String>> {
        let mut lines = Vec::new();
        for (&b, body) in std::iter::zip(groups.bodies(), bodies) {
            lines.extend(body.notes().iter().map(|note| format!("body '{}': {note}", body.name)));
            let prefix = crate::body::options_prefix(&case.bodies[b].name);
            let left = crate::petsc::option_prefixes_left(&prefix)?;
            lines.extend(left.iter().map(|name| {
                format!("PETSc option -{name} was not used: misspelt, or nothing of what the body does asks for it")
            }));
        }
        if groups.world.rank() == 0 {
            let left = crate::petsc::option_prefixes_left("")?;
            lines.extend(left.iter().filter(|name| !name.starts_with("body_")).map(|name| {
                let example = crate::body::options_prefix(&case.bodies[0].name);
                format!(
                    "PETSc option -{name} was not used: misspelt, or without the prefix of a body's solver (-{example}{name})"
                )
            }));
        }
        Ok(lines)
    };
    let lines = if groups.is_root() { of_group() } else { Ok(Vec::new()) };
    let lines = agree(&groups.world, lines)?;
    Ok(crate::step::gather_lines(&groups.world, &lines))
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
    let results = output::Results::read_last(file)?;
    output::draw(&results, &case.output, directory).map(|_| ())
}
