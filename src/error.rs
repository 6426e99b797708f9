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
    /// A body can move freely as a rigid body: exit code 4.
    #[error("{0}")]
    Unrestrained(String),
    /// A body answered with what is not a finite number: exit code 3.
    #[error("{0}")]
    NotFinite(String),
    /// A library call failed, or kontakt itself is wrong: exit code 1.
    #[error("{0}")]
    Internal(String),
}

impl Error {
    /// Wrong input.
    pub fn input(message: impl fmt::Display) -> Self {
        Error::Input(message.to_string())
    }

    /// A failure that the user's input did not cause.
    pub fn internal(message: impl fmt::Display) -> Self {
        Error::Internal(message.to_string())
    }

    /// The process exit code (README, "Exit codes").
    pub fn exit_code(&self) -> i32 {
        match self {
            Error::Internal(_) => 1,
            Error::Input(_) => 2,
            Error::NotFinite(_) => 3,
            Error::Unrestrained(_) => 4,
        }
    }
}

impl From<hdf5::Error> for Error {
    fn from(e: hdf5::Error) -> Self {
        Error::Internal(format!("HDF5: {e}"))
    }
}
