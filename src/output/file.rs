//! Writing `result.vtkhdf`: all ranks together, under a hidden name until it is complete.
use super::agree::{agree, on_rank_zero, same_everywhere};
use super::hdf5_rows::{Place, Plan};
use super::spread::Spread;
use super::{ResultFile, history, steps, tables, vtkhdf};
use crate::error::{Error, Result};
use hdf5::{File, FileBuilder};
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use std::path::{Path, PathBuf};

/// Collective over `comm`, usually the world. Writes the file in parallel; an error on any rank is returned
/// on all.
///
/// The file appears under its name when it is complete, replacing an older one, whose `summary.json` goes
/// first. A run that is killed leaves at most the hidden `.<name>.part`, which the next run overwrites.
pub fn write(comm: &SimpleCommunicator, path: &Path, result: &ResultFile) -> Result<()> {
    agree(comm, result.check())?;
    same_everywhere(comm, "the names of the results", &result.skeleton())?;
    let part = part_name(path);
    // Before HDF5 does, whose message would not say why it cannot.
    on_rank_zero(comm, || match std::fs::File::create(&part) {
        Ok(_) => Ok(()),
        Err(e) => Err(Error::input(format!("cannot write {}: {e}", path.display()))),
    })?;
    let written = write_part(comm, &part, result);
    let published = on_rank_zero(comm, || match &written {
        Ok(()) => publish(&part, path),
        Err(e) => Err(e.clone()),
    });
    if published.is_err() && comm.rank() == 0 {
        // The error that brought us here matters more than one of removing the file.
        let _ = std::fs::remove_file(&part);
    }
    published.map_err(|e| match e {
        Error::Internal(text) => Error::Internal(format!("cannot write {}: {text}", path.display())),
        other => other,
    })
}

/// Name of an incomplete file: hidden, in the same directory, so that renaming it is atomic.
pub(super) fn part_name(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.part"))
}

/// Gives a complete file its name. What belonged to an older result with this name is out of date from here
/// on.
fn publish(part: &Path, path: &Path) -> Result<()> {
    let failed = |e: std::io::Error| Error::internal(e);
    match std::fs::remove_file(path.with_file_name(super::SUMMARY)) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(failed(e)),
        _ => {}
    }
    std::fs::rename(part, path).map_err(failed)
}

/// Collective. Rank 0 makes the structure; then every rank writes its rows into it.
fn write_part(comm: &SimpleCommunicator, part: &Path, result: &ResultFile) -> Result<()> {
    let spread = Spread::new(comm, result)?;
    let mut plan = agree(comm, structure(&spread, part, result))?;
    plan.locate(comm);
    agree(comm, plan.write(part).map_err(Error::internal))
}

/// Makes the file with every group, attribute and dataset, on rank 0; gives the rows it waits for, on all.
fn structure<'a>(spread: &Spread, part: &Path, result: &ResultFile<'a>) -> Result<Plan<'a>> {
    if spread.rank > 0 {
        return create_all(spread, &Place(None), result);
    }
    // The rows are gathered twice, first to know the file's length before HDF5 has it open.
    reserve(part, create_all(spread, &Place(None), result)?.length)?;
    let file = file_options().create(part)?;
    let plan = create_all(spread, &Place(Some(file.group("/")?)), result)?;
    file.close()?;
    Ok(plan)
}

/// Makes sure that the disk has room for a file of about this length, bytes: HDF5 does not survive a close that
/// fails. It gives the space back before it takes it again, so that another program may still be faster.
fn reserve(part: &Path, length: u64) -> Result<()> {
    let file = std::fs::OpenOptions::new().write(true).open(part).map_err(Error::internal)?;
    match fallocate(&file, FallocateFlags::empty(), 0, length) {
        Err(e @ (Errno::NOSPC | Errno::DQUOT | Errno::FBIG)) => {
            let e = std::io::Error::from(e);
            Err(Error::internal(format!("{e} ({} MB needed)", length.div_ceil(1_000_000))))
        }
        // Not every file system can reserve; one that cannot is no reason to stop.
        _ => Ok(()),
    }
}

/// How files are opened: without locks, which the file systems of some clusters refuse.
pub(crate) fn file_options() -> FileBuilder {
    let mut options = File::with_options();
    options.with_fapl(|access| access.file_locking(false));
    options
}

fn create_all<'a>(spread: &Spread, file: &Place, result: &ResultFile<'a>) -> Result<Plan<'a>> {
    let mut plan = Plan::default();
    vtkhdf::create(spread, file, result, &mut plan)?;
    tables::create_contact(spread, file, result, &mut plan)?;
    history::create(spread, file, result, &mut plan)?;
    tables::create_run(spread, file, result.run, &mut plan)?;
    tables::create_rigid(spread, file, result.run, &mut plan)?;
    if let Some(table) = &result.run.steps {
        steps::create_table(spread, file, table, &mut plan)?;
    }
    Ok(plan)
}

/// Writes a small file, complete or not at all. Not collective.
pub(crate) fn write_complete(path: &Path, content: &[u8]) -> Result<()> {
    let part = part_name(path);
    std::fs::write(&part, content).and_then(|()| std::fs::rename(&part, path)).map_err(|e| {
        let _ = std::fs::remove_file(&part);
        Error::internal(format!("cannot write {}: {e}", path.display()))
    })
}
