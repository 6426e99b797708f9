//! How the gaps decide a linear function of the contact forces: the dual solution on the converged active set.
use super::{ActiveSet, Limits, Respond, record::Recorder};
use crate::error::Result;

/// Residual of the dual solution: an estimate needs no more.
const ACCURACY: f64 = 0.05;

/// Alternations after which the dual solution is taken as it is.
const MOST: usize = 6;

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Forces m, N, in equilibrium without loads, and motions b with F m - Z b + c = 0 on the active rows. A small change dg
    /// of the gaps changes the function c'R of the contact forces by m'dg. Collective on the roots.
    pub fn influence(&mut self, c: Vec<f64>) -> Result<(Vec<f64>, Vec<f64>)> {
        let steps = self.coupling.steps;
        let coarse = self.coarse.unloaded();
        let projector = coarse.projector(self.coupling.exchange, &self.active);
        let n = self.coupling.n;
        let mut dual = ActiveSet {
            coupling: &mut *self.coupling,
            rows: self.rows,
            coarse: &coarse,
            limits: Limits { tolerance: ACCURACY, max_alternations: MOST, ..self.limits },
            mesh_error: None,
            force: vec![0.0; n],
            gap: c.clone(),
            alpha: vec![0.0; coarse.n],
            active: self.active.clone(),
            touch: Vec::new(),
            share: self.share.clone(),
            // No first guess is to be made.
            updates: 1,
            flipped: Vec::new(),
            round_off: None,
            dual: self.dual.take(),
            g_free: c,
            look: None,
            recorder: Recorder::new(self.recorder.n_pairs(), 0),
            threshold: self.threshold,
            residual: 0.0,
        };
        let solved = dual.solve_from_state(&projector, ACCURACY, &mut |_| {});
        let ActiveSet { force, alpha, dual: matrix, .. } = dual;
        self.dual = matrix;
        self.coupling.steps = steps;
        // As far as it has come it is an answer.
        solved?;
        Ok((force, alpha))
    }
}
