//! Material laws: pure functions of strain, temperature and parameters.
mod linear_elastic;

pub use linear_elastic::{LinearElastic, von_mises};
