//! The runs that are done, on disk, so that a study that was interrupted goes on where it was.
use super::run::Measured;
use crate::{Error, Result, stable_hash::StableHash};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
};

/// Name of the file: a line for each run, after a first line that says of what.
pub(super) const JOURNAL: &str = "runs.jsonl";

/// What all runs of a journal have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    /// The case: [`crate::case::Case::fingerprint`].
    pub case: String,
    /// Version of kontakt, and its executable.
    pub program: String,
    /// PETSc options of the command line.
    pub options: Vec<String>,
}

#[derive(Serialize, Deserialize)]
struct Entry {
    run: String,
    repetition: usize,
    #[serde(flatten)]
    measured: Measured,
}

/// What became of an older journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// There was none.
    Nothing,
    /// Its runs are kept.
    Same,
    /// It is of another case: its runs are kept beside, for when that case comes back.
    OtherCase,
    /// It is of another kontakt.
    OtherProgram,
}

/// The journal of a study.
pub(super) struct Journal {
    path: PathBuf,
    entries: Vec<Entry>,
}

impl Header {
    /// For this program.
    pub fn new(fingerprint: u64, options: &[String]) -> Result<Header> {
        let executable = std::env::current_exe()
            .and_then(fs::read)
            .map_err(|e| Error::internal(format!("own executable: {e}")))?;
        let hash = StableHash::new().bytes(&executable).finish();
        let program = format!("{} {hash:016x}", env!("CARGO_PKG_VERSION"));
        Ok(Header { case: format!("{fingerprint:016x}"), program, options: options.to_vec() })
    }
}

impl Header {
    /// Where a journal with this header is set aside.
    fn file_name(&self) -> String {
        let options = self.options.iter().map(String::as_bytes);
        let hash = options.fold(StableHash::new().field(self.case.as_bytes()), StableHash::field);
        format!("runs-{:016x}.jsonl", hash.finish())
    }
}

impl Found {
    fn of(text: &str, header: &Header) -> Found {
        match header_of(text) {
            None => Found::Nothing,
            Some(old) if old == *header => Found::Same,
            Some(old) if old.program != header.program => Found::OtherProgram,
            Some(_) => Found::OtherCase,
        }
    }
}

fn header_of(journal: &str) -> Option<Header> {
    serde_json::from_str(journal.lines().next()?).ok()
}

/// Keeps the runs of another input under a name of their own; without runs there is nothing to keep.
fn set_aside(directory: &Path, journal: &str) -> Result<()> {
    let Some(old) = header_of(journal).filter(|_| journal.lines().count() > 1) else { return Ok(()) };
    crate::output::write_complete(&directory.join(old.file_name()), journal.as_bytes())
}

impl Journal {
    /// Opens the journal of a directory, or begins a new one. One of another case is set aside, not lost.
    pub fn open(directory: &Path, header: &Header, fresh: bool) -> Result<(Journal, Found)> {
        let path = directory.join(JOURNAL);
        let mut text = fs::read_to_string(&path).unwrap_or_default();
        let mut found = Found::of(&text, header);
        if header_of(&text).is_some_and(|old| old.case != header.case || old.options != header.options) {
            set_aside(directory, &text)?;
            let own = fs::read_to_string(directory.join(header.file_name())).unwrap_or_default();
            if Found::of(&own, header) == Found::Same {
                (text, found) = (own, Found::Same);
            }
        }
        // A line that a kill has cut short is no run.
        let kept: Vec<&str> = text
            .lines()
            .skip(1)
            .filter(|line| !fresh && found == Found::Same && serde_json::from_str::<Entry>(line).is_ok())
            .collect();
        let entries = kept.iter().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let mut new = serde_json::to_string(header).map_err(Error::internal)? + "\n";
        kept.iter().for_each(|line| new.extend([line, "\n"]));
        crate::output::write_complete(&path, new.as_bytes())?;
        Ok((Journal { path, entries }, found))
    }

    /// What a run gave, if it is done.
    pub fn get(&self, run: &str, repetition: usize) -> Option<&Measured> {
        let same = |entry: &&Entry| entry.run == run && entry.repetition == repetition;
        self.entries.iter().find(same).map(|entry| &entry.measured)
    }

    /// All repetitions of a run.
    pub fn all<'a>(&'a self, run: &'a str) -> impl Iterator<Item = &'a Measured> {
        self.entries.iter().filter(move |entry| entry.run == run).map(|entry| &entry.measured)
    }

    /// Adds a run; it is on disk when this returns.
    pub fn add(&mut self, run: String, repetition: usize, measured: Measured) -> Result<()> {
        let entry = Entry { run, repetition, measured };
        let line = serde_json::to_string(&entry).map_err(Error::internal)? + "\n";
        let written = fs::OpenOptions::new().append(true).open(&self.path);
        let written =
            written.and_then(|mut file| file.write_all(line.as_bytes()).and_then(|()| file.sync_data()));
        written.map_err(|e| Error::internal(format!("cannot write {}: {e}", self.path.display())))?;
        self.entries.push(entry);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_journal_of_the_same_case_is_kept_and_a_line_cut_short_is_not() {
        let directory = tempfile::tempdir().unwrap();
        let header = Header { case: "c".into(), program: "p".into(), options: vec![] };
        let measured =
            Measured { process_seconds: 1.0, cpu_seconds: 2.0, exit: Some(0), summary: None, error: None };
        let (mut journal, found) = Journal::open(directory.path(), &header, false).unwrap();
        assert_eq!(found, Found::Nothing);
        journal.add("a".into(), 0, measured.clone()).unwrap();
        journal.add("b".into(), 0, measured).unwrap();
        let path = directory.path().join(JOURNAL);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, &text[..text.len() - 9]).unwrap();
        let (journal, found) = Journal::open(directory.path(), &header, false).unwrap();
        assert_eq!(found, Found::Same);
        assert_eq!(journal.get("a", 0).map(|m| m.cpu_seconds), Some(2.0));
        assert!(journal.get("b", 0).is_none() && journal.get("a", 1).is_none());
        let other = Header { case: "d".into(), ..header.clone() };
        let (journal, found) = Journal::open(directory.path(), &other, false).unwrap();
        assert_eq!((found, journal.all("a").count()), (Found::OtherCase, 0));
        // The first case comes back to its runs; another program has none of them.
        let (journal, found) = Journal::open(directory.path(), &header, false).unwrap();
        assert_eq!((found, journal.all("a").count()), (Found::Same, 1));
        let other = Header { program: "q".into(), ..header };
        let (journal, found) = Journal::open(directory.path(), &other, false).unwrap();
        assert_eq!((found, journal.all("a").count()), (Found::OtherProgram, 0));
    }
}
