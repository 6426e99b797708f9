//! Material laws: pure functions of strain, temperature and parameters.
mod hardening;
mod linear_elastic;
mod parameters;
mod plane;
mod plastic;
mod return_mapping;
mod root;
mod state;
mod tensor;

#[cfg(test)]
mod plastic_tests;

pub use linear_elastic::{LinearElastic, von_mises};
pub use parameters::{Analysis, Hardening, Kinematic, MaterialCase, Plasticity, Property, Theory};
pub use plastic::ElastoPlastic;
pub use state::{PointResponse, PointState, Tangent};
