//! What a step is told.
use super::{place::Place, state::PairState};
use crate::{body::LoadFactors, case::Case, contact::Coefficients, parallel::Exchange, scene::Plan};

/// The case, and where it is solved.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'s, 'e> {
    pub case: &'s Case,
    pub plan: &'s Plan,
    pub exchange: &'s Exchange<'e>,
}

/// An increment of a load step: their numbers, 1, 2, ..., and the factors at its end.
#[derive(Clone, Copy)]
pub(crate) struct Target<'f> {
    /// Of the load step.
    pub number: u64,
    /// In the load step.
    pub increment: u64,
    pub factors: &'f LoadFactors,
    /// At the end of the path: what the mesh makes wrong of the peak pressures is looked into.
    pub is_end: bool,
}

impl Target<'static> {
    /// All that acts without a path, in one step, without a look at what the mesh makes wrong.
    pub const FULL: Target<'static> =
        Target { number: 1, increment: 1, factors: &LoadFactors::FULL, is_end: false };
}

/// A solve on the contact rows as they are.
pub(crate) struct Task<'t, 'e> {
    pub scene: Scene<'t, 'e>,
    pub target: Target<'t>,
    /// Forces to begin with; none: unknown.
    pub warm: &'t [PairState],
    /// The last accepted state: where the surfaces were, and its contact nodes.
    pub from: &'t Place,
    #[allow(missing_docs)]
    pub before: &'t [PairState],
    pub modes: &'t Modes,
    /// Per end, of each normal row of pairs where these vary; empty elsewhere.
    pub coefficients: &'t [Vec<Coefficients>],
    /// Name of a mode of one of this rank's bodies.
    pub names: &'t dyn Fn(usize, usize) -> String,
}

/// The free modes of this rank's bodies among those of all bodies.
#[derive(Debug, Clone, Default)]
pub(crate) struct Modes {
    /// Modes of all bodies.
    pub total: usize,
    /// Number of each body's first mode.
    pub first: Vec<usize>,
    /// Modes of each body.
    pub counts: Vec<usize>,
}

/// Row forces and mode amplitudes of this rank's bodies.
#[derive(Default)]
pub(crate) struct Solution {
    pub force: Vec<Vec<f64>>,
    pub alpha: Vec<Vec<f64>>,
    /// Motions of all modes that nothing restrains; the same on all first ranks.
    pub unrestrained: Vec<Vec<f64>>,
    /// Work, per mode of all bodies, that the loads do on motions without resistance and that faceted surfaces leave, J.
    pub relief: Vec<f64>,
    pub pairs: Vec<PairState>,
    /// What decides the peak pressures, with the solution changed by it: of a step at the end of the path.
    pub influences: Vec<(Influence, Solution)>,
}

/// The peak pressure of a pair as a function of the contact forces, and the dual solution of it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Influence {
    pub pair: usize,
    /// Its value, Pa.
    pub value: f64,
    /// The solution is changed by this many times the dual solution, m2.
    pub scale: f64,
    /// By how much it would change were the partners of coarse meshes able to follow: across the pair itself, and across the
    /// others, Pa.
    pub partners: [f64; 2],
}
