//! The loads of a body and the factors on them: a load step scales right-hand sides and factorises nothing.
use serde::{Deserialize, Serialize};

/// Factors of a load step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LoadFactors {
    /// On the loads.
    pub loads: f64,
    /// On the displacements that supports prescribe.
    pub supports: f64,
    /// On T - Tref.
    pub temperature: f64,
}

impl Default for LoadFactors {
    fn default() -> Self {
        LoadFactors { loads: 1.0, supports: 1.0, temperature: 1.0 }
    }
}

impl LoadFactors {
    /// Nothing acts.
    pub const NONE: LoadFactors = LoadFactors { loads: 0.0, supports: 0.0, temperature: 0.0 };

    /// The factors at a share of the way to others.
    pub fn toward(&self, end: &LoadFactors, share: f64) -> LoadFactors {
        let between = |a: f64, b: f64| a + share * (b - a);
        LoadFactors {
            loads: between(self.loads, end.loads),
            supports: between(self.supports, end.supports),
            temperature: between(self.temperature, end.temperature),
        }
    }
}

/// Right-hand sides at the owned nodes, N.
pub(super) struct Loads {
    /// Of the current step.
    pub factors: LoadFactors,
    /// External nodal forces at factor 1, in global axes; without contact, without initial strain.
    pub external: Vec<f64>,
    /// Forces of the initial strain, in the nodes' frames: at factor 1, or, where material data vary with
    /// temperature, at the current factor.
    pub thermal: Vec<f64>,
    /// Forces of the supports' displacements at factor 1, in the nodes' frames.
    pub prescribed: Vec<f64>,
    /// Work of the loads on the free rigid modes at factor 1, J.
    pub mode_work: Vec<f64>,
    /// Sum of the absolute works, J.
    pub mode_scale: Vec<f64>,
    /// Right-hand side of the current step without contact forces, in the nodes' frames.
    pub current: Vec<f64>,
    /// The same condensed to the interface, on the first rank, once it has been asked for.
    pub condensed: Option<Vec<f64>>,
}
