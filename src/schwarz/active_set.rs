//! The default driver: primal-dual active set (semi-smooth Newton) outside, conjugate gradients inside.
//!
//! Find R >= 0, g = g_free + F R - Z alpha >= 0, R g = 0, Z' R = e. On a fixed active set this is a linear system in R
//! and alpha, solved by projected conjugate gradients in which one iteration is one alternation: the force step applies
//! F, the displacement step of one body of each pair preconditions. Then nodes in tension leave the set and nodes that
//! penetrate enter it. Should a set return, the driver goes over to feasible steps, which lower the energy
//! 1/2 R'F R + R'g_free every time, so that no set can return (Nocedal and Wright, Numerical Optimization, 16.5).
use super::{
    ActiveSet, Ended, PairRows, Reason, Respond, coarse::Resists, dual::Dual, projected_cg::Inner,
    record::Snapshot,
};
use crate::vector::{larger, smaller};
use crate::{error::Result, record::HistoryRow};
use std::{
    collections::HashSet,
    hash::{DefaultHasher, Hash, Hasher},
};

/// Thresholds grow no further than this, however loose the tolerance: a set is right or wrong whatever the mesh error.
const LARGEST_THRESHOLD: f64 = 1e-8;

/// Tolerance of the linear systems while the active set still changes.
const EARLY: f64 = 1e-3;

/// A residual that round-off does not let fall below this is no solution, whatever the tolerance.
const WORTHLESS: f64 = 1e-6;

/// Product of the compliance ratios against long and short waves from which the body that is softer against short waves
/// leads: 1 would balance the condition numbers, but the long waves are few, and conjugate gradients remove a few
/// outliers one by one.
const FEW_LONG_WAVES: f64 = 0.01;

/// In a chain of bodies both sides of a pair make the displacement step if neither is this much softer than the other.
const ALIKE: f64 = 10.0;

impl<'c, 'a, B: Respond> ActiveSet<'c, 'a, B> {
    /// Runs to the end; `warm`: forces of the last load step; `progress` sees every row of the history. Collective on the
    /// roots.
    pub fn run(&mut self, warm: Option<&[f64]>, mut progress: impl FnMut(&HistoryRow)) -> Result<Ended> {
        self.coupling.check_free(&self.g_free)?;
        let (start, alpha) =
            match self.coarse.start(self.coupling.exchange, &self.g_free, &self.resists(Resists::Never)) {
                Ok(start) => start,
                Err(motion) => return Ok(Ended::Driven(motion)),
            };
        self.alpha = alpha;
        if self.largest(&start) == 0.0 {
            return Ok(self.rest_open(start));
        }
        let closed = self.compressed(&start);
        self.dual = Dual::new(self.coupling, self.coarse, self.rows, self.recorder.n_pairs(), &closed);
        let guess = match warm {
            Some(warm) if self.largest(warm) > 0.0 => {
                // Where the springs' forces are not known they start from rest.
                let mut warm = warm.to_vec();
                warm.resize(self.coupling.n, 0.0);
                warm
            }
            _ if self.dual.is_some() => start.clone(),
            _ => self.one_sided_guess(&start)?,
        };
        let guess = self.first_guess(guess, &mut progress)?;
        let reason = self.iterate(guess, &start, &mut progress)?;
        Ok(Ended::Outcome(self.outcome(reason)))
    }

    /// Nothing touches: soft modes are where the loads alone put them.
    pub(super) fn rest_open(&mut self, start: Vec<f64>) -> Ended {
        let at_rest = self.coarse.sprung(&self.coarse.work);
        for ((alpha, rest), k) in self.alpha.iter_mut().zip(at_rest).zip(&self.coarse.stiffness) {
            *alpha = if *k > 0.0 { rest } else { *alpha };
        }
        (self.active, self.force) = (self.compressed(&start), start);
        Ended::Outcome(self.outcome(Reason::Open))
    }

    /// Semi-smooth Newton, then feasible steps if it cycles.
    fn iterate(
        &mut self,
        guess: Vec<f64>,
        start: &[f64],
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Reason> {
        let mut visited: HashSet<u64> = HashSet::new();
        let mut early = EARLY.max(self.limits.tolerance);
        let mut force = guess;
        loop {
            let projector = self.coarse.projector(self.coupling.exchange, &self.active);
            let was_last = early <= self.limits.tolerance;
            let inner = self.solve(force.clone(), &projector, early, progress)?;
            let (leaving, entering, worst) = self.violations();
            let flips = self.coupling.exchange.sum(&[(leaving.len() + entering.len()) as f64])[0] as usize;
            if flips == 0 {
                if !(self.residual.is_finite() && worst.is_finite()) {
                    return Ok(Reason::NotFinite);
                }
                let settled = was_last || inner == Inner::RoundOff;
                if settled && inner != Inner::Limit {
                    if inner == Inner::RoundOff && self.residual > self.limits.tolerance.max(WORTHLESS) {
                        return Ok(Reason::Stalled);
                    }
                    self.round_off = (inner == Inner::RoundOff && self.residual > self.limits.tolerance)
                        .then_some(self.residual);
                    return Ok(if self.any_active() { Reason::Converged } else { Reason::Open });
                }
            }
            if inner == Inner::Limit || self.recorder.count() >= self.limits.max_alternations {
                self.flipped = leaving.into_iter().chain(entering).collect();
                return Ok(Reason::MaxAlternations);
            }
            if flips == 0 {
                early = self.limits.tolerance;
                force = self.force.clone();
                continue;
            }
            // Violations below the residual may be the residual's: first make it smaller, on the same set.
            if worst < self.residual && inner == Inner::Done && early > self.limits.tolerance {
                early = (0.1 * worst).max(self.limits.tolerance);
                force = self.force.clone();
                continue;
            }
            // A few nodes on a nearly exact set: the next solve may as well be the last one.
            if worst < early {
                early = self.limits.tolerance;
            }
            leaving.iter().for_each(|&j| self.active[j] = false);
            entering.iter().for_each(|&j| self.active[j] = true);
            self.flipped = leaving.into_iter().chain(entering).collect();
            self.updates += 1;
            if !visited.insert(self.set_hash()) {
                // Seen before: with the linear systems solved exactly and round-off set aside; if that does not help,
                // by steps that cannot return.
                if early > self.limits.tolerance {
                    early = self.limits.tolerance;
                    visited.clear();
                } else if self.threshold < self.limits.tolerance.min(LARGEST_THRESHOLD) {
                    self.threshold =
                        (10.0 * self.threshold).min(self.limits.tolerance).min(LARGEST_THRESHOLD);
                    visited.clear();
                } else {
                    return self.descend(start, progress);
                }
            }
            self.record(flips, progress);
            if !self.any_active() && self.coarse.n == 0 {
                // Nothing compressive is left: the next solve shows what the bodies do alone.
                self.force.fill(0.0);
                self.gap = self.g_free.clone();
            }
            force = self.force.clone();
        }
    }

    /// Feasible active-set method: forces stay compressive and in equilibrium, the energy falls with every step.
    pub(super) fn descend(
        &mut self,
        start: &[f64],
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Reason> {
        let mut feasible = start.to_vec();
        self.active = self.compressed(&feasible);
        let applied = self.apply(&feasible)?;
        let mut gap: Vec<f64> = std::iter::zip(&self.g_free, &applied).map(|(g, f)| g + f).collect();
        loop {
            let projector = self.coarse.projector(self.coupling.exchange, &self.active);
            (self.force, self.gap) = (feasible.clone(), gap.clone());
            let inner = self.solve_from_state(&projector, self.limits.tolerance, progress)?;
            if inner == Inner::Limit || self.recorder.count() >= self.limits.max_alternations {
                return Ok(Reason::MaxAlternations);
            }
            let largest = self.largest(&self.force);
            let limit = self.threshold * largest;
            // As far as the first force that vanishes.
            let ratios: Vec<f64> = (0..self.coupling.n_rows)
                .map(|j| match self.active[j] && self.force[j] < -limit {
                    true => feasible[j] / (feasible[j] - self.force[j]),
                    false => f64::INFINITY,
                })
                .collect();
            let step = ratios.iter().copied().fold(1.0, smaller);
            let step = -self.coupling.exchange.max_signed(-step);
            self.updates += 1;
            self.flipped.clear();
            if step < 1.0 {
                for j in 0..self.coupling.n {
                    feasible[j] += step * (self.force[j] - feasible[j]);
                    gap[j] += step * (self.gap[j] - gap[j]);
                    if ratios.get(j).is_some_and(|ratio| *ratio <= step * (1.0 + 1e-12)) {
                        (feasible[j], self.active[j]) = (0.0, false);
                        self.flipped.push(j);
                    }
                }
            } else {
                (feasible, gap) = (self.force.clone(), self.gap.clone());
                let (_, entering, _) = self.violations();
                let deepest = entering.iter().map(|&j| -self.gap_at(j)).fold(0.0, larger);
                let deepest = self.coupling.exchange.max(&[deepest])[0];
                if deepest == 0.0 {
                    self.updates -= 1;
                    return Ok(if self.any_active() { Reason::Converged } else { Reason::Open });
                }
                self.flipped = entering.into_iter().filter(|&j| -self.gap_at(j) >= deepest).collect();
                self.flipped.iter().for_each(|&j| self.active[j] = true);
            }
            let flips = self.coupling.exchange.sum(&[self.flipped.len() as f64])[0] as usize;
            self.record(flips, progress);
        }
    }

    /// F R, m. One force step.
    fn apply(&mut self, force: &[f64]) -> Result<Vec<f64>> {
        let [own, other] = self.coupling.force_step(force)?;
        Ok(std::iter::zip(own, other).map(|(a, b)| a + b).collect())
    }

    /// The body that is softer where the pair bends, not only where it dents, makes the displacement step: with
    /// c = C_own / C_other between its extremes over all wave lengths, preconditioning by the own body's stiffness
    /// leaves eigenvalues between 1 + 1/c_max and 1 + 1/c_min. The short waves have the ratio of the moduli; the long
    /// ones are measured by the responses to the contact forces as they are.
    pub(super) fn choose_lead(&mut self, force: &[f64], own: &[f64], other: &[f64]) {
        for (i, _) in self.coupling.ends.iter().enumerate().filter(|(_, e)| e.multiplier) {
            let range = self.coupling.ranges[i].clone();
            let work = |w: &[f64]| -> f64 {
                std::iter::zip(&force[range.clone()], &w[range.clone()]).map(|(f, w)| f * w).sum()
            };
            let (long, short) = (work(own) / work(other), self.rows[i].compliance_ratio);
            let alike = |c: f64| (1.0 / ALIKE..=ALIKE).contains(&c);
            // A body that cannot follow all rows leads only if it is softer by far.
            let coarse = if self.rows[i].mortar_is_coarse { 0.1 } else { 1.0 };
            let multiplier_leads = long * short >= coarse * FEW_LONG_WAVES || !long.is_finite();
            self.share[i] = match multiplier_leads {
                _ if self.rows[i].in_chain && alike(long) && alike(short) => 0.5,
                true => 1.0,
                false => 0.0,
            };
        }
    }

    pub(super) fn set_hash(&self) -> u64 {
        let mut parts = 0.0;
        for (i, end) in self.coupling.ends.iter().enumerate().filter(|(_, e)| e.multiplier) {
            let mut hasher = DefaultHasher::new();
            let range = self.coupling.ranges[i].clone();
            (end.pair, &self.active[range.clone()]).hash(&mut hasher);
            // Which way a node slips.
            self.touch.get(range).hash(&mut hasher);
            // 32 bits of each pair add up exactly in a double, in any order.
            parts += (hasher.finish() >> 32) as f64;
        }
        self.coupling.exchange.sum(&[parts])[0] as u64
    }

    pub(super) fn record(&mut self, flips: usize, progress: &mut impl FnMut(&HistoryRow)) {
        let scale = self.scales().all;
        let gaps: Vec<f64> = (0..self.coupling.n).map(|j| self.gap_at(j)).collect();
        let pushed = self.coarse.restrict(self.coupling.exchange, |j| self.force[j]);
        let size = |v: &mut dyn Iterator<Item = f64>| v.map(|v| v * v).sum::<f64>().sqrt();
        let imbalance = size(&mut std::iter::zip(&pushed, &self.coarse.work).map(|(p, e)| p - e));
        let total = size(&mut self.coarse.work.iter().copied());
        let state = Snapshot {
            gaps: &gaps,
            active: &self.active,
            n_normal: &self.rows.iter().map(PairRows::n_normal).collect::<Vec<_>>(),
            flipped: if flips > 0 { &self.flipped } else { &[] },
            scale,
            imbalance: if total > 0.0 { imbalance / total } else { 0.0 },
            update: self.updates,
        };
        let row = self.recorder.record(self.coupling, &state);
        progress(row);
    }
}
