//! Writing `result.vtkhdf`: all ranks together, under a hidden name until there is something to read in it.
use super::agree::{agree, on_rank_zero, same_everywhere};
use super::hdf5_rows::{Place, Plan};
use super::spread::{Growth, Spread};
use super::{ResultFile, RunInfo, history, steps, tables, vtkhdf};
use crate::error::{Error, Result};
use hdf5::{File, FileBuilder};
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use std::path::{Path, PathBuf};

/// Collective over `comm`, usually the world. Writes the file of a case without load steps in parallel; an error on any
/// rank is returned on all.
///
/// The file appears under its name when it is complete, replacing an older one, whose `summary.json` goes
/// first. A run that is killed leaves at most the hidden `.<name>.part`, which the next run overwrites.
pub fn write(comm: &SimpleCommunicator, path: &Path, result: &ResultFile) -> Result<()> {
    check(comm, result)?;
    let part = part_name(path);
    create(comm, path, result, None)?;
    publish(comm, &part, path)
}

/// The result file of a case with load steps. Each is added as soon as it is accepted, and counted when all of it is on the
/// disk: the counter (`NSteps`) is what readers go by, so that they find the steps before it whatever ends the run. Places
/// for the steps that are expected are made with the first; from then on the file's structure stays as it is, but for the
/// lengths of its datasets.
pub struct Growing {
    path: PathBuf,
    /// Whether the file gets its name with its first step, or when it is complete.
    at_once: bool,
    published: bool,
    growth: Growth,
    /// Of this rank's share of the first step.
    shape: String,
    /// Names of the contact pairs.
    pairs: Vec<String>,
    is_first_rank: bool,
}

impl Growing {
    /// Touches no file. `at_once`: an older file of this name is replaced by the first step, not by the complete file.
    /// `names`: of the steps that are expected; there may be more or fewer, but no longer ones.
    pub fn new<'n>(path: &Path, at_once: bool, names: impl Iterator<Item = Option<&'n str>>) -> Growing {
        let (mut expected, mut name_width) = (0, 0);
        for name in names {
            expected += 1;
            name_width = name_width.max(name.map_or(0, str::len));
        }
        let growth = Growth { steps: 0, history: 0, expected: expected.max(1), name_width };
        Growing {
            path: path.to_path_buf(),
            at_once,
            published: false,
            growth,
            shape: String::new(),
            pairs: Vec::new(),
            is_first_rank: false,
        }
    }

    /// Steps that are in the file.
    pub fn steps(&self) -> usize {
        self.growth.steps
    }

    /// Adds the last step of the table `result.run.steps`, the history of which is `result.history`. Collective; an error
    /// on any rank is returned on all, and the steps before it stay as they are.
    pub fn append(&mut self, comm: &SimpleCommunicator, result: &ResultFile) -> Result<()> {
        check(comm, result)?;
        agree(comm, self.check_step(result))?;
        self.is_first_rank = comm.rank() == 0;
        let rows = if self.growth.steps == 0 {
            let rows = create(comm, &self.path, result, Some(self.growth))?;
            self.shape = result.shape();
            self.pairs = result.pairs.iter().map(|pair| pair.name.clone()).collect();
            rows
        } else {
            let written = self.extend(comm, result);
            written.map_err(|e| cannot_write(&self.path, e))?
        };
        self.growth.steps += 1;
        self.growth.history += rows;
        if self.at_once && !self.published {
            self.publish(comm)?;
        }
        Ok(())
    }

    fn check_step(&self, result: &ResultFile) -> Result<()> {
        let wrong = |what: &str| Err(Error::internal(format!("result file: {what}")));
        let table = result.run.steps.as_deref().unwrap_or_default();
        if table.len() != self.growth.steps + 1 {
            return wrong("every step of the table needs its results");
        }
        let name = table.last().and_then(|step| step.name.as_deref()).unwrap_or("");
        if name.len() > self.growth.name_width {
            return wrong("the name of a step is longer than any that was expected");
        }
        if self.growth.steps > 0 && result.shape() != self.shape {
            return wrong("the steps differ in fields or in contact tables");
        }
        Ok(())
    }

    fn file(&self) -> PathBuf {
        if self.published { self.path.clone() } else { part_name(&self.path) }
    }

    /// A further step. Returns the rows of its history. Collective.
    fn extend(&self, comm: &SimpleCommunicator, result: &ResultFile) -> Result<usize> {
        let (path, growth) = (self.file(), self.growth);
        let spread = Spread::new(comm, result, Some(growth))?;
        let structure = || {
            let needed = create_all(&spread, &Place(None), result)?;
            if spread.rank > 0 {
                return Ok(needed);
            }
            reserve(&path, &needed)?;
            let file = file_options().open_rw(&path)?;
            let plan = create_all(&spread, &Place(Some(file.group("/")?)), result)?;
            file.close()?;
            Ok(plan)
        };
        let mut plan = agree(comm, structure())?;
        plan.locate(comm);
        agree(comm, plan.write(&path).map_err(Error::internal))?;
        on_rank_zero(comm, || {
            change(&path, |root| {
                tables::set_verdict(root, result.run, false)?;
                steps::count(root, growth.steps + 1)
            })
        })?;
        Ok(spread.history)
    }

    /// Notes how the run ended, and gives the file its name if it has none yet. Collective.
    pub fn finish(mut self, comm: &SimpleCommunicator, run: &RunInfo) -> Result<()> {
        let (path, growth) = (self.file(), self.growth);
        let noted = on_rank_zero(comm, || {
            change(&path, |root| {
                tables::trim_contact(root, &self.pairs, growth)?;
                tables::set_verdict(root, run, true)
            })
        });
        noted.map_err(|e| cannot_write(&self.path, e))?;
        if self.published { Ok(()) } else { self.publish(comm) }
    }

    fn publish(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        publish(comm, &part_name(&self.path), &self.path)?;
        self.published = true;
        Ok(())
    }
}

impl Drop for Growing {
    fn drop(&mut self) {
        if self.is_first_rank && self.growth.steps > 0 && !self.published {
            let _ = std::fs::remove_file(part_name(&self.path));
        }
    }
}

/// Collective.
fn check(comm: &SimpleCommunicator, result: &ResultFile) -> Result<()> {
    agree(comm, result.check())?;
    same_everywhere(comm, "the names of the results", &result.skeleton())
}

/// Makes the file under its hidden name; there is none after an error. Returns the rows of its history. Collective.
fn create(
    comm: &SimpleCommunicator,
    path: &Path,
    result: &ResultFile,
    growth: Option<Growth>,
) -> Result<usize> {
    let part = part_name(path);
    // Before HDF5 does, whose message would not say why it cannot.
    on_rank_zero(comm, || match std::fs::File::create(&part) {
        Ok(_) => Ok(()),
        Err(e) => Err(Error::input(format!("cannot write {}: {e}", path.display()))),
    })?;
    let written = write_part(comm, &part, result, growth);
    if written.is_err() && comm.rank() == 0 {
        // The error that brought us here matters more than one of removing the file.
        let _ = std::fs::remove_file(&part);
    }
    written.map_err(|e| cannot_write(path, e))
}

fn cannot_write(path: &Path, error: Error) -> Error {
    match error {
        Error::Internal(text) => Error::Internal(format!("cannot write {}: {text}", path.display())),
        other => other,
    }
}

/// Changes attributes and links of a file. Not collective.
fn change(path: &Path, work: impl FnOnce(&Place) -> Result<()>) -> Result<()> {
    let file = file_options().open_rw(path)?;
    work(&Place(Some(file.group("/")?)))?;
    Ok(file.close()?)
}

/// Name of an incomplete file: hidden, in the same directory, so that renaming it is atomic.
pub(super) fn part_name(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.part"))
}

/// Gives a file its name. What belonged to an older result with this name is out of date from here on. Collective.
fn publish(comm: &SimpleCommunicator, part: &Path, path: &Path) -> Result<()> {
    let published = on_rank_zero(comm, || {
        let failed = |e: std::io::Error| Error::internal(e);
        match std::fs::remove_file(path.with_file_name(super::SUMMARY)) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(failed(e)),
            _ => {}
        }
        std::fs::rename(part, path).map_err(failed)
    });
    if published.is_err() && comm.rank() == 0 {
        let _ = std::fs::remove_file(part);
    }
    published.map_err(|e| cannot_write(path, e))
}

/// Collective. Rank 0 makes the structure; then every rank writes its rows into it.
fn write_part(
    comm: &SimpleCommunicator,
    part: &Path,
    result: &ResultFile,
    growth: Option<Growth>,
) -> Result<usize> {
    let spread = Spread::new(comm, result, growth)?;
    let mut plan = agree(comm, structure(&spread, part, result))?;
    plan.locate(comm);
    agree(comm, plan.write(part).map_err(Error::internal))?;
    Ok(spread.history)
}

/// Makes the file with every group, attribute and dataset, on rank 0; gives the rows it waits for, on all.
fn structure<'a>(spread: &Spread, part: &Path, result: &ResultFile<'a>) -> Result<Plan<'a>> {
    // The rows are gathered twice, first to know the file's length before HDF5 has it open.
    let needed = create_all(spread, &Place(None), result)?;
    if spread.rank > 0 {
        return Ok(needed);
    }
    reserve(part, &needed)?;
    let file = file_options().create(part)?;
    let plan = create_all(spread, &Place(Some(file.group("/")?)), result)?;
    file.close()?;
    Ok(plan)
}

/// Makes sure that the disk has room for what is to be written, and that the file may become as long: HDF5 does not survive
/// a close that fails. It gives the space back before HDF5 takes it, so that another program may still be faster.
fn reserve(path: &Path, needed: &Plan) -> Result<()> {
    let file = std::fs::OpenOptions::new().write(true).open(path).map_err(Error::internal)?;
    let length = file.metadata().map_err(Error::internal)?.len();
    let missing = |e: std::io::Error, bytes: u64| {
        Error::internal(format!("{e} ({} MB needed)", bytes.div_ceil(1_000_000)))
    };
    let result = match fallocate(&file, FallocateFlags::empty(), length, needed.length) {
        Err(e @ (Errno::NOSPC | Errno::DQUOT | Errno::FBIG)) => Err(missing(e.into(), needed.length)),
        // Not every file system can reserve; one that cannot is no reason to stop.
        _ => file.set_len(length + needed.span).map_err(|e| missing(e, needed.span)),
    };
    file.set_len(length).map_err(Error::internal)?;
    result
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
    if spread.is_first() {
        tables::create_run(spread, file, result.run, &mut plan)?;
    }
    tables::create_rigid(spread, file, result.run, &mut plan)?;
    if let (Some(growth), Some(step)) = (spread.growth, result.run.steps.iter().flatten().last()) {
        steps::add_row(spread, growth, file, step, &mut plan)?;
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
