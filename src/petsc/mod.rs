//! PETSc behind a thin safe layer: the calls the program makes, each checked, each handle freed on drop.
//!
//! All `unsafe` of the program that concerns PETSc is in this folder. Matrices and vectors live on a rank group's
//! communicator; unless said otherwise a method is collective on it.
#[macro_use]
mod handle;
mod dense;
mod error;
mod ksp;
mod linear;
mod schur;
mod session;
mod stage;
mod two_level;

pub use dense::{Cholesky, Lu, Symmetric};
pub use ksp::{Ksp, smooth_stretched};
pub use linear::{Coordinates, Gather, Matrix, Vector};
pub use schur::SchurFactor;
pub use session::{Session, has_option, option_prefixes_left, set_options, touch_blas};
pub use stage::{Stage, StageSeconds};
pub use two_level::{Rest, ZoneFactor};

#[allow(non_upper_case_globals, non_camel_case_types, non_snake_case, missing_docs, unused)]
#[allow(unsafe_op_in_unsafe_fn, rustdoc::all, clippy::all)]
mod sys {
    include!(concat!(env!("OUT_DIR"), "/petsc.rs"));
}

#[allow(non_upper_case_globals, non_camel_case_types, non_snake_case, missing_docs, unused)]
#[allow(unsafe_op_in_unsafe_fn, rustdoc::all, clippy::all)]
mod mumps {
    include!(concat!(env!("OUT_DIR"), "/mumps.rs"));
}
