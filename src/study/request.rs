//! What a study is asked for.
use std::path::PathBuf;

/// What the user asks for.
pub struct Request {
    /// A case file, or a directory with case.toml.
    pub case: PathBuf,
    /// A variant of it.
    pub variant: Option<String>,
    /// Changes to the case, as `PATH=VALUE`.
    pub sets: Vec<String>,
    /// Changes to `[study]`, likewise.
    pub flags: Vec<String>,
    /// PETSc options for all runs.
    pub petsc_options: Vec<String>,
    /// Directory of the results; `None`: `results/<case>[/<variant>]/study`.
    pub out: Option<PathBuf>,
    /// A Markdown file to write the page to as well, its picture beside it.
    pub page: Option<PathBuf>,
    /// Measure everything again.
    pub fresh: bool,
    /// More ranks than cores are wanted.
    pub oversubscribe: bool,
    /// The command line, for the page.
    pub command: String,
}
