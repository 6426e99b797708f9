//! What a driver works on: forces, gaps and active rows of this rank.
use super::{Coarse, Coupling, PairRows, Reason, Respond, Share, Touch, dual::Dual, record::Recorder};
use crate::record::HistoryRow;
use crate::tolerances::{SUM, THRESHOLD};

/// What the user chooses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Residual of the gap at active rows, relative to the elastic approach of the surfaces.
    pub tolerance: f64,
    /// Alternations (force steps and active-set updates) after which the driver gives up.
    pub max_alternations: usize,
    /// Whether a pair of the case, on whatever rank, has tangential forces.
    pub friction: bool,
}

/// How a driver ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub reason: Reason,
    /// One row per alternation.
    pub history: Vec<HistoryRow>,
}

/// The end of a driver that may find no answer at all.
pub enum Ended {
    /// With an answer, or without one but with a reason.
    Outcome(Outcome),
    /// At a motion on which the loads work and which nothing stops.
    Driven(Vec<f64>),
}

/// A driver's state on the rows of this rank.
pub struct ActiveSet<'c, 'a, B> {
    /// The bodies.
    pub coupling: &'c mut Coupling<'a, B>,
    /// Rows of each end; empty for mortar ends.
    pub rows: &'c [PairRows],
    /// The free rigid modes.
    pub coarse: &'c Coarse,
    /// The user's choices; an automatic tolerance as far as it has come down.
    pub limits: Limits,
    /// Given if the tolerance is automatic; on all roots or on none.
    pub mesh_error: Option<&'c MeshError<'c>>,
    /// Compressive row forces, N.
    pub force: Vec<f64>,
    /// g_free + F R, m: the gap but for the rigid motions.
    pub gap: Vec<f64>,
    /// Amplitudes of the rigid modes.
    pub alpha: Vec<f64>,
    /// Rows in contact; of tangential rows those that stick.
    pub active: Vec<bool>,
    /// What the node of each contact row does; empty without tangential rows.
    pub(super) touch: Vec<Touch>,
    /// Who makes the displacement steps of each end's pair.
    pub share: Vec<Share>,
    /// Active-set updates so far.
    pub updates: usize,
    /// Rows that changed at the last update.
    pub flipped: Vec<usize>,
    /// The residual that round-off leaves, if that is more than the tolerance.
    pub round_off: Option<f64>,
    /// F, where it is at hand as a matrix.
    pub(super) dual: Option<Dual>,
    pub(super) g_free: Vec<f64>,
    /// The look at the mesh error that the next one has to confirm.
    pub(super) look: Option<Look>,
    pub(super) recorder: Recorder,
    pub(super) threshold: f64,
    /// The residual at which the last linear solve ended, relative.
    pub(super) residual: f64,
}

/// A look at the discretisation error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    /// The tolerance that it asked for.
    pub asked: f64,
    /// The residual at which it was made, relative.
    pub size: f64,
}

/// Smallest relative discretisation error of a pair's pressure, given the row forces and which rows are in contact;
/// infinite where nothing touches.
pub type MeshError<'e> = dyn Fn(&[f64], &[bool]) -> f64 + 'e;

impl<'c, 'a, B: Respond> ActiveSet<'c, 'a, B> {
    /// Finds where the bodies would penetrate: the first active set and the first guess of the forces. `warm`: forces
    /// of the last load step. Collective on the roots.
    pub fn new(
        coupling: &'c mut Coupling<'a, B>,
        rows: &'c [PairRows],
        coarse: &'c Coarse,
        limits: Limits,
        n_pairs: usize,
        step: u64,
    ) -> Self {
        let mut initial: Vec<f64> = rows.iter().flat_map(|r| r.gap.iter().copied()).collect();
        initial.resize(coupling.n, 0.0);
        let free = coupling.free();
        // A gap that closes to round-off is closed, and does not penetrate.
        let closes = |g: f64, w: f64| (g - w).abs() <= SUM * g.abs().max(w.abs());
        let g_free: Vec<f64> =
            std::iter::zip(&initial, free).map(|(&g, w)| if closes(g, w) { 0.0 } else { g - w }).collect();
        let n = coupling.n;
        let recorder = Recorder::new(n_pairs, step);
        ActiveSet {
            dual: None,
            share: vec![1.0; coupling.ends.len()],
            coupling,
            rows,
            coarse,
            limits,
            mesh_error: None,
            force: vec![0.0; n],
            gap: g_free.clone(),
            alpha: vec![0.0; coarse.n],
            active: vec![false; n],
            touch: Vec::new(),
            updates: 0,
            flipped: Vec::new(),
            round_off: None,
            g_free,
            look: None,
            recorder,
            threshold: THRESHOLD,
            residual: 0.0,
        }
    }

    /// How it ends: as it did so far, for this reason.
    pub fn outcome(&mut self, reason: Reason) -> Outcome {
        Outcome { reason, history: self.recorder.take() }
    }
}
