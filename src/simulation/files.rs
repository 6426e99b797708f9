//! The files of a run: what goes first, and pictures.
use crate::{
    case::Case,
    error::{Error, Result},
    output,
    parallel::agree,
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::path::Path;

/// The old summary goes first: a run killed from here on leaves nothing that looks complete.
pub(super) fn remove_old_summary(world: &SimpleCommunicator, directory: &Path) -> Result<()> {
    let path = directory.join(output::SUMMARY);
    let removed = if world.rank() == 0 && path.exists() {
        std::fs::remove_file(&path)
            .map_err(|e| Error::input(format!("cannot replace {}: {e}", path.display())))
    } else {
        Ok(())
    };
    agree(world, removed)
}

pub(super) fn draw(case: &Case, file: &Path, directory: &Path) -> Result<()> {
    let results = output::Results::read_last(file)?;
    output::draw(&results, &case.output, directory).map(|_| ())
}
