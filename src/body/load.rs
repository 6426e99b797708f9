//! The loads of a body and the factors on them: a load step scales right-hand sides and factorises nothing.
use crate::case::StepCase;
use serde::{Deserialize, Serialize};

/// Factors on what acts: at the end of a load step, or on the way there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LoadFactors {
    /// On the loads that follow no path.
    pub loads: f64,
    /// On the displacements that supports prescribe and that follow no path.
    pub supports: f64,
    /// On T - Tref, where that follows no path.
    pub temperature: f64,
    /// Path parameter; 0 before the first step.
    #[serde(default)]
    pub at: f64,
    /// Factors of the load paths, in the order of the case; 0 where there is none yet.
    #[serde(default)]
    pub paths: Vec<f64>,
}

impl Default for LoadFactors {
    fn default() -> Self {
        LoadFactors::FULL
    }
}

impl From<&StepCase> for LoadFactors {
    fn from(step: &StepCase) -> Self {
        let StepCase { loads, supports, temperature, at, ref paths, .. } = *step;
        LoadFactors { loads, supports, temperature, at, paths: paths.clone() }
    }
}

impl LoadFactors {
    /// All acts as written but what follows a path.
    pub const FULL: LoadFactors =
        LoadFactors { loads: 1.0, supports: 1.0, temperature: 1.0, at: 0.0, paths: Vec::new() };

    /// Nothing acts.
    pub const NONE: LoadFactors =
        LoadFactors { loads: 0.0, supports: 0.0, temperature: 0.0, at: 0.0, paths: Vec::new() };

    /// On the loads that follow this path, or none.
    pub fn on_loads(&self, path: Option<usize>) -> f64 {
        path.map_or(self.loads, |path| self.of_path(path))
    }

    /// On the prescribed displacements that follow this path, or none.
    pub fn on_supports(&self, path: Option<usize>) -> f64 {
        path.map_or(self.supports, |path| self.of_path(path))
    }

    /// On T - Tref where that follows this path, or none.
    pub fn on_temperature(&self, path: Option<usize>) -> f64 {
        path.map_or(self.temperature, |path| self.of_path(path))
    }

    fn of_path(&self, path: usize) -> f64 {
        self.paths.get(path).copied().unwrap_or(0.0)
    }

    /// The factors at a share of the way to others, all of them on straight lines.
    pub fn toward(&self, end: &LoadFactors, share: f64) -> LoadFactors {
        let between = |a: f64, b: f64| a + share * (b - a);
        LoadFactors {
            loads: between(self.loads, end.loads),
            supports: between(self.supports, end.supports),
            temperature: between(self.temperature, end.temperature),
            at: between(self.at, end.at),
            paths: (0..end.paths.len()).map(|p| between(self.of_path(p), end.of_path(p))).collect(),
        }
    }
}

/// Forces at the owned nodes at factor 1, N, of all that follows one path, or none.
#[derive(Clone)]
pub(super) struct Part {
    pub path: Option<usize>,
    pub forces: Vec<f64>,
}

/// Sum of the parts, each times its factor; `n`: numbers in each.
pub(super) fn scaled(parts: &[Part], n: usize, factor: impl Fn(Option<usize>) -> f64) -> Vec<f64> {
    let mut sum = vec![0.0; n];
    for Part { path, forces } in parts {
        let factor = factor(*path);
        std::iter::zip(&mut sum, forces).for_each(|(sum, f)| *sum += factor * f);
    }
    sum
}

/// Work of a part of the loads on the free rigid modes at factor 1, J.
pub(super) struct ModeWork {
    pub path: Option<usize>,
    pub work: Vec<f64>,
    /// Sum of the absolute works.
    pub scale: Vec<f64>,
}

/// Right-hand sides at the owned nodes, N.
pub(super) struct Loads {
    /// Of the current step.
    pub factors: LoadFactors,
    /// External nodal forces, in global axes; without contact, without initial strain.
    pub external: Vec<Part>,
    /// Path of the temperature.
    pub temperature_path: Option<usize>,
    /// Factor that the temperature of the body has.
    pub heat: f64,
    /// Forces of the initial strain, in the nodes' frames: at factor 1, or, where material data vary with
    /// temperature, at the current factor.
    pub thermal: Vec<f64>,
    /// Forces of the supports' displacements, in the nodes' frames.
    pub prescribed: Vec<Part>,
    pub mode_work: Vec<ModeWork>,
    /// Right-hand side of the current step without contact forces, in the nodes' frames.
    pub current: Vec<f64>,
    /// The same condensed to the interface, on the first rank, once it has been asked for.
    pub condensed: Option<Vec<f64>>,
}

impl Loads {
    /// External nodal forces of these factors, in global axes.
    pub fn external_at(&self, factors: &LoadFactors) -> Vec<f64> {
        scaled(&self.external, self.thermal.len(), |path| factors.on_loads(path))
    }

    /// Forces of the supports' displacements of these factors, in the nodes' frames.
    pub fn prescribed_at(&self, factors: &LoadFactors) -> Vec<f64> {
        scaled(&self.prescribed, self.thermal.len(), |path| factors.on_supports(path))
    }
}
