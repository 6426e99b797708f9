//! Material laws: pure functions of strain, temperature and parameters.
mod linear_elastic;
mod parameters;

pub use linear_elastic::{LinearElastic, von_mises};
pub use parameters::{Analysis, MaterialCase, Property};
