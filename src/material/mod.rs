//! Material laws: pure functions of strain, temperature and parameters.
mod linear_elastic;
mod parameters;
mod plastic;

pub use linear_elastic::{LinearElastic, von_mises};
pub use parameters::{Analysis, Hardening, Kinematic, MaterialCase, Plasticity, Property, Theory};
pub use plastic::{ElastoPlastic, PointResponse, PointState, Tangent};
