//! What a run leaves behind: `result.vtkhdf`, `summary.json`, pictures.
//!
//! All ranks call [`prepare`] before anything is computed, and [`write()`] when it is, or with load steps
//! [`Growing::append`] after each; then rank 0 draws the pictures from the file and writes the [`Summary`], last of all.
use crate::{
    error::{Error, Result},
    record::Summary,
};
use mpi::topology::SimpleCommunicator;
use std::path::Path;

mod agree;
mod file;
mod folder;
mod hdf5_rows;
mod hdf5_text;
mod history;
mod picture;
mod read;
mod result;
mod spread;
mod steps;
mod tables;
mod vtkhdf;

pub use file::{Growing, write};
pub(crate) use file::{file_options, write_complete};
pub use folder::Folder;
pub(crate) use folder::Lock;
pub use picture::draw;
pub(crate) use picture::{Precision, PrecisionCurve, PrecisionPoint};
pub use read::Results;
pub use result::*;

/// Name of the result file.
pub const RESULT: &str = "result.vtkhdf";
/// Name of the summary.
pub const SUMMARY: &str = "summary.json";

/// Collective. Creates the results directory and makes sure that it can be written to, before hours of work.
pub fn prepare(comm: &SimpleCommunicator, directory: &Path) -> Result<()> {
    agree::on_rank_zero(comm, || {
        let probe = directory.join(".kontakt.part");
        let tried = std::fs::create_dir_all(directory)
            .and_then(|()| std::fs::write(&probe, ""))
            .and_then(|()| std::fs::remove_file(&probe));
        tried.map_err(|e| {
            Error::input(format!("cannot write to the results directory {}: {e}", directory.display()))
        })
    })
}

/// Writes `summary.json`, complete or not at all. Rank 0 does this, when all else is written.
pub fn write_summary(summary: &Summary, path: &Path) -> Result<()> {
    write_complete(path, summary.to_json()?.as_bytes())
}
