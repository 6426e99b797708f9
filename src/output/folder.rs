//! The results directory of a run: one run at a time writes into it, and no verdict outlives the run that gave it.
use super::SUMMARY;
use super::agree::{agree, on_rank_zero};
use super::file::write_complete;
use crate::case::Case;
use crate::error::{Error, Result};
use crate::record::Summary;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use serde::Serialize;
use std::fs::{self, File, OpenOptions};
use std::io::{Read, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Held by the run, or the study, that writes into the directory.
const LOCK: &str = ".kontakt.lock";

/// The lock of a directory. The kernel releases it with the process, however that ends.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
    path: PathBuf,
}

impl Lock {
    /// Makes the directory and takes its lock; an error if another process has it. A file system without locks is no
    /// reason to stop: `None`.
    pub fn take(directory: &Path) -> Result<Option<Lock>> {
        let cannot = |e: std::io::Error| {
            Error::input(format!("cannot write to the results directory {}: {e}", directory.display()))
        };
        fs::create_dir_all(directory).map_err(cannot)?;
        let path = directory.join(LOCK);
        loop {
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
            let mut file = file.map_err(cannot)?;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) => {}
                Err(Errno::WOULDBLOCK) => return Err(taken(directory, &mut file)),
                Err(e) if has_no_locks(e) => {
                    let _ = fs::remove_file(&path);
                    return Ok(None);
                }
                Err(e) => return Err(cannot(e.into())),
            }
            // The run before may have removed the file between the opening and the lock: it is nobody's then.
            if is_at(&file, &path) {
                let written = file.set_len(0).and_then(|()| file.write_all(holder().as_bytes()));
                written.map_err(cannot)?;
                return Ok(Some(Lock { file, path }));
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Before the lock is released with the file; a file that stays does no harm.
        if is_at(&self.file, &self.path) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// What a file system says that does not know locks, or whose lock service is down.
fn has_no_locks(e: Errno) -> bool {
    [Errno::NOLCK, Errno::NOTSUP, Errno::OPNOTSUPP, Errno::NOSYS, Errno::INVAL].contains(&e)
}

/// True if the path still leads to this open file.
fn is_at(file: &File, path: &Path) -> bool {
    let key = |m: fs::Metadata| (m.dev(), m.ino());
    let of_path = fs::metadata(path).map(key).ok();
    file.metadata().map(key).ok() == of_path
}

fn holder() -> String {
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    match host.trim() {
        "" => format!("process {}", std::process::id()),
        host => format!("process {} on {host}", std::process::id()),
    }
}

fn taken(directory: &Path, file: &mut File) -> Error {
    let mut by = String::new();
    let _ = file.rewind().and_then(|()| file.read_to_string(&mut by));
    let by = if by.is_empty() { String::new() } else { format!(" ({by})") };
    Error::input(format!(
        "another run{by} is writing into the results directory {}; wait until it has ended, or give another with --out",
        directory.display()
    ))
}

/// The results directory of a run that has started.
pub struct Folder {
    directory: PathBuf,
    case: String,
    variant: Option<String>,
    input: String,
    _lock: Option<Lock>,
}

/// `summary.json` of a run that ended with an error after it had started.
#[derive(Serialize)]
struct Failed<'a> {
    schema: u32,
    kontakt: &'a str,
    case: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    variant: Option<&'a str>,
    input: &'a str,
    converged: bool,
    reason: &'a str,
    exit_code: i32,
    error: String,
}

impl Folder {
    /// Locks the directory for this run and removes the summary of the run before, so that nothing looks complete that is
    /// not. On rank 0 a warning is printed if that run was of another input. Collective.
    pub fn open(comm: &SimpleCommunicator, directory: &Path, case: &Case) -> Result<Folder> {
        let on_root = if comm.rank() == 0 { Lock::take(directory) } else { Ok(None) };
        let lock = agree(comm, on_root)?;
        let input = format!("{:016x}", case.fingerprint);
        on_rank_zero(comm, || {
            let summary = directory.join(SUMMARY);
            if let Some(other) = other_input(&summary, &input) {
                eprintln!(
                    "warning: {} had the results of another input ({other}); they are replaced (--out gives another directory)",
                    directory.display()
                );
            }
            match fs::remove_file(&summary) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                    Err(Error::input(format!("cannot replace {}: {e}", summary.display())))
                }
                _ => Ok(()),
            }
        })?;
        let (case, variant) = (case.name.clone(), case.variant.clone());
        Ok(Folder { directory: directory.to_path_buf(), case, variant, input, _lock: lock })
    }

    /// Ends the run: an error is left in `summary.json`, in place of results. Collective.
    pub fn close<T>(self, comm: &SimpleCommunicator, result: Result<T>) -> Result<T> {
        let Err(error) = result else { return result };
        if comm.rank() == 0 {
            // The error that brought us here matters more than one of writing it down.
            let _ = write_complete(&self.directory.join(SUMMARY), self.failed(&error).as_bytes());
        }
        // The lock of rank 0 is held until its files are.
        Err(error)
    }

    fn failed(&self, error: &Error) -> String {
        let reason = match error.exit_code() {
            2 => "refused",
            3 => "not_finite",
            4 => "unrestrained",
            _ => "failed",
        };
        let failed = Failed {
            schema: Summary::SCHEMA,
            kontakt: env!("CARGO_PKG_VERSION"),
            case: &self.case,
            variant: self.variant.as_deref(),
            input: &self.input,
            converged: false,
            reason,
            exit_code: error.exit_code(),
            error: error.to_string(),
        };
        serde_json::to_string_pretty(&failed).unwrap_or_default() + "\n"
    }
}

/// Case and variant of a summary of another input, in words.
fn other_input(summary: &Path, input: &str) -> Option<String> {
    let old: serde_json::Value = serde_json::from_str(&fs::read_to_string(summary).ok()?).ok()?;
    if old["input"].as_str()? == input {
        return None;
    }
    let variant =
        old["variant"].as_str().map_or_else(String::new, |v| format!(", variant {}", crate::plain_text(v)));
    Some(format!("case {}{variant}", crate::plain_text(old["case"].as_str()?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_held_once_and_a_file_left_behind_is_none() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("results");
        fs::create_dir(&path).unwrap();
        fs::write(path.join(LOCK), "process 1").unwrap();
        let lock = Lock::take(&path).unwrap();
        assert!(lock.is_some(), "the file of a killed run is no lock");
        let error = Lock::take(&path).unwrap_err();
        let own = format!("another run (process {}", std::process::id());
        assert!(error.exit_code() == 2 && error.to_string().contains(&own), "{error}");
        drop(lock);
        assert_eq!(fs::read_dir(&path).unwrap().count(), 0);
        assert!(Lock::take(&path).unwrap().is_some());
    }

    #[test]
    fn file_systems_without_locks_are_told_from_locks_that_are_held() {
        assert!([Errno::NOLCK, Errno::NOTSUP, Errno::NOSYS].into_iter().all(has_no_locks));
        assert!(![Errno::WOULDBLOCK, Errno::ACCESS, Errno::IO].into_iter().any(has_no_locks));
    }
}
