//! What a run leaves behind: `result.vtkhdf`, `summary.json`, pictures.
//!
//! All ranks call [`prepare`] before anything is computed and [`write()`] when it is; then rank 0 draws the
//! pictures from the file and writes the [`Summary`], last of all.
use crate::error::{Error, Result};
use mpi::topology::SimpleCommunicator;
use std::path::Path;

mod agree;
mod file;
mod hdf5_rows;
mod hdf5_text;
mod history;
mod picture;
mod read;
mod reason;
mod result;
mod spread;
mod steps;
mod summary;
mod tables;
mod vtkhdf;

pub use file::write;
pub(crate) use file::{file_options, write_complete};
pub use history::{HistoryRow, PairRow, mean_contraction};
pub use picture::draw;
pub(crate) use picture::{Precision, PrecisionCurve, PrecisionPoint};
pub use read::Results;
pub use reason::{Driver, Reason, Transfer};
pub use result::*;
pub use summary::*;

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
