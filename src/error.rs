//! The one error type. Its variant decides the exit code; its text is what the user reads.
use std::fmt;

/// `Result` with kontakt's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong.
#[derive(Debug, Clone, thiserror::Error)]
pub enum Error {
    /// The case, a mesh or an option is wrong: exit code 2. The text names file, line, key, value and rule.
    #[error("{0}")]
    Input(String),
    /// A solver does not reach its tolerance: exit code 3. The text names body, count and residual.
    #[error("{0}")]
    NotConverged(String),
    /// A body can move freely as a rigid body: exit code 4.
    #[error("{0}")]
    Unrestrained(String),
    /// A body answered with what is not a finite number: exit code 3.
    #[error("{0}")]
    NotFinite(String),
    /// A matrix that a method needs positive definite is not: exit code 1 where no method knows a way on.
    #[error("{0}")]
    Indefinite(String),
    /// There is less memory than the run needs: exit code 6. The text names body and need.
    #[error("{0}")]
    Memory(String),
    /// A library call failed, or kontakt itself is wrong: exit code 1.
    #[error("{0}")]
    Internal(String),
}

impl Error {
    /// Exit code of [`Error::Memory`].
    pub const MEMORY: i32 = 6;

    /// Wrong input.
    pub fn input(message: impl fmt::Display) -> Self {
        Error::Input(message.to_string())
    }

    /// A failure that the user's input did not cause.
    pub fn internal(message: impl fmt::Display) -> Self {
        Error::Internal(message.to_string())
    }

    /// A matrix that is not positive definite.
    pub fn indefinite(reason: impl fmt::Display) -> Self {
        Error::Indefinite(format!("the matrix is not positive definite: {reason}"))
    }

    /// The process exit code (README, "Exit codes").
    pub fn exit_code(&self) -> i32 {
        match self {
            Error::Internal(_) | Error::Indefinite(_) => 1,
            Error::Input(_) => 2,
            Error::NotFinite(_) | Error::NotConverged(_) => 3,
            Error::Unrestrained(_) => 4,
            Error::Memory(_) => Error::MEMORY,
        }
    }

    /// The kind of error as a number, to send it to another rank: see [`Error::of_kind`].
    pub fn kind(&self) -> i32 {
        match self {
            Error::Internal(_) => 1,
            Error::Input(_) => 2,
            Error::NotConverged(_) => 3,
            Error::Unrestrained(_) => 4,
            Error::NotFinite(_) => 5,
            Error::Memory(_) => 6,
            Error::Indefinite(_) => 7,
        }
    }

    /// The error of a [kind](Error::kind).
    pub fn of_kind(kind: i32, text: String) -> Self {
        match kind {
            2 => Error::Input(text),
            3 => Error::NotConverged(text),
            4 => Error::Unrestrained(text),
            5 => Error::NotFinite(text),
            6 => Error::Memory(text),
            7 => Error::Indefinite(text),
            _ => Error::Internal(text),
        }
    }

    /// The same kind of error, its text changed: where it happened, or to what.
    pub fn map(self, change: impl FnOnce(String) -> String) -> Self {
        match self {
            Error::Input(text) => Error::Input(change(text)),
            Error::NotConverged(text) => Error::NotConverged(change(text)),
            Error::Unrestrained(text) => Error::Unrestrained(change(text)),
            Error::NotFinite(text) => Error::NotFinite(change(text)),
            Error::Memory(text) => Error::Memory(change(text)),
            Error::Indefinite(text) => Error::Indefinite(change(text)),
            Error::Internal(text) => Error::Internal(change(text)),
        }
    }
}

impl From<hdf5::Error> for Error {
    fn from(e: hdf5::Error) -> Self {
        Error::Internal(format!("HDF5: {e}"))
    }
}
