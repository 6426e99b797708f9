//! Writing `result.vtkhdf`: all ranks together, under a hidden name until it is complete.
use super::agree::{agree, on_rank_zero, same_everywhere};
use super::hdf5_rows::Plan;
use super::{ResultFile, history, steps, tables, vtkhdf};
use crate::error::{Error, Result};
use hdf5::File;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use std::mem::ManuallyDrop;
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
    // Some file systems report a full disk no sooner than this.
    std::fs::File::open(part).and_then(|file| file.sync_all()).map_err(failed)?;
    match std::fs::remove_file(path.with_file_name(super::SUMMARY)) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(failed(e)),
        _ => {}
    }
    std::fs::rename(part, path).map_err(failed)
}

/// Collective. Opening and closing are collective too: the file is closed by all ranks, whatever happened in
/// between.
fn write_part(comm: &SimpleCommunicator, part: &Path, result: &ResultFile) -> Result<()> {
    let opened = File::with_options().with_fapl(|access| access.mpio(comm.as_raw(), None)).create(part);
    // Where only some ranks could open it, closing would wait for the others: these keep their handle.
    let file = ManuallyDrop::new(agree(comm, opened.map_err(Error::from))?);
    let filled = fill(comm, &file, part, result);
    let file = ManuallyDrop::into_inner(file);
    let closed = agree(comm, file.close().map_err(Error::from));
    filled.and(closed)
}

/// Collective.
fn fill(comm: &SimpleCommunicator, file: &File, part: &Path, result: &ResultFile) -> Result<()> {
    let plan = agree(comm, create_all(comm, file, result))?;
    agree(comm, file.flush().map_err(Error::from))?;
    on_rank_zero(comm, || reserve(part))?;
    plan.write(comm)
}

/// Collective. Creates every group, attribute and dataset.
fn create_all<'a>(comm: &SimpleCommunicator, file: &File, result: &ResultFile<'a>) -> Result<Plan<'a>> {
    let mut plan = Plan::default();
    vtkhdf::create(comm, file, result, &mut plan)?;
    tables::create_contact(comm, file, result, &mut plan)?;
    history::create(comm, file, result.history, result.pairs, result.run, &mut plan)?;
    tables::create_run(comm, file, result.run, &mut plan)?;
    tables::create_rigid(comm, file, result.run, &mut plan)?;
    if let Some(table) = &result.run.steps {
        steps::create_table(comm, file, table, &mut plan)?;
    }
    Ok(plan)
}

/// Takes the file's space from the disk before the data go out, so that a full disk is found by one rank,
/// here. Found by one rank in the middle of a collective write, it can leave the others waiting for ever
/// inside MPI-IO.
///
/// Flushing gave the file its full length, most of it a hole.
fn reserve(part: &Path) -> Result<()> {
    use std::os::fd::AsRawFd;
    let file = std::fs::OpenOptions::new().read(true).write(true).open(part).map_err(Error::internal)?;
    let length = file.metadata().map_err(Error::internal)?.len();
    let length = libc::off_t::try_from(length).map_err(Error::internal)?;
    // SAFETY: the descriptor is open; the call touches no memory.
    match unsafe { libc::posix_fallocate(file.as_raw_fd(), 0, length) } {
        0 => Ok(()),
        // Not every file system can reserve; one that cannot is no reason to stop.
        code if !matches!(code, libc::ENOSPC | libc::EDQUOT | libc::EFBIG) => Ok(()),
        code => {
            let e = std::io::Error::from_raw_os_error(code);
            Err(Error::internal(format!("{e} ({} MB needed)", length / 1_000_000)))
        }
    }
}

/// Writes a small file, complete or not at all. Not collective.
pub(crate) fn write_complete(path: &Path, content: &[u8]) -> Result<()> {
    let part = part_name(path);
    std::fs::write(&part, content).and_then(|()| std::fs::rename(&part, path)).map_err(|e| {
        let _ = std::fs::remove_file(&part);
        Error::internal(format!("cannot write {}: {e}", path.display()))
    })
}
