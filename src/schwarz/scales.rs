//! What the active-set driver's residuals, tension and penetration are measured by.
use super::{ActiveSet, Respond};
use crate::vector::larger;

/// What is below this share of its parts is round-off.
pub(super) const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// Smallest thresholds of tension and penetration, relative to the largest force and the elastic approach: with exact
/// zeros a gap that just closes lets nodes flip in round-off for ever. They grow tenfold, up to the tolerance, when a
/// set returns.
pub(super) const THRESHOLD: f64 = 1e-11;

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Gap at a row, m.
    pub fn gap_at(&self, j: usize) -> f64 {
        self.gap[j] - self.coarse.at(j, &self.alpha)
    }

    /// Norm of the elastic approach at the active rows, and of what round-off leaves of it, m.
    pub(super) fn scales(&self) -> (f64, f64) {
        let mut sums = [0.0; 3];
        // Of soft modes it is the motion that there is: without contact it may be out of all proportion.
        let (held, sprung) = (self.coarse.all_are_sprung(), self.sprung());
        for j in (0..self.coupling.n).filter(|&j| self.active[j]) {
            let elastic = self.gap[j] - self.g_free[j] - self.coarse.at(j, &sprung);
            let local = self.force[j] / self.coarse.scaling(j);
            let rigid = self.coarse.at(j, &self.alpha);
            if j < self.coupling.n_rows {
                sums[0] += if held { elastic * elastic } else { 0.0 };
                sums[1] += local * local;
            }
            sums[2] += elastic * elastic + self.g_free[j] * self.g_free[j] + rigid * rigid;
        }
        let sums = self.coupling.exchange.sum(&sums);
        (larger(sums[0], sums[1]).sqrt(), ROUND_OFF * sums[2].sqrt())
    }

    /// Norm of a residual on the contact rows, or that on the springs if it is larger, measured by their own travel, m.
    pub(super) fn size(&self, r: &[f64], scale: f64) -> f64 {
        let mut sums = [0.0; 3];
        for (j, r) in r.iter().enumerate() {
            if j < self.coupling.n_rows {
                sums[0] += r * r;
            } else {
                sums[1] += r * r;
                sums[2] += self.coarse.at(j, &self.alpha).powi(2);
            }
        }
        let [rows, springs, travel] = match self.coupling.exchange.sum(&sums)[..] {
            [a, b, c] => [a, b, c].map(f64::sqrt),
            _ => [0.0; 3],
        };
        larger(rows, if travel > scale { springs * scale / travel } else { springs })
    }

    /// Largest absolute value on the contact rows of all ranks. Collective on the roots.
    pub(super) fn largest(&self, v: &[f64]) -> f64 {
        let rows = &v[..self.coupling.n_rows];
        self.coupling.exchange.max(&[rows.iter().fold(0.0, |l, v| larger(l, v.abs()))])[0]
    }

    pub(super) fn any_active(&self) -> bool {
        let active = self.active[..self.coupling.n_rows].contains(&true);
        self.coupling.exchange.max(&[f64::from(u8::from(active))])[0] > 0.0
    }

    /// Rows under compression, and the springs.
    pub(super) fn compressed(&self, force: &[f64]) -> Vec<bool> {
        (0..self.coupling.n).map(|j| j >= self.coupling.n_rows || force[j] > 0.0).collect()
    }

    /// Amplitudes of the sprung modes; zero for the others.
    pub(super) fn sprung(&self) -> Vec<f64> {
        let sprung = |(alpha, k): (&f64, &f64)| if *k > 0.0 { *alpha } else { 0.0 };
        std::iter::zip(&self.alpha, &self.coarse.stiffness).map(sprung).collect()
    }

    /// What the contact forces change of each gap, but for rigid motions: the elastic approach, m.
    pub fn elastic_approach(&self) -> Vec<f64> {
        let at_rest = self.coarse.sprung(&self.coarse.work);
        let change: Vec<f64> =
            std::iter::zip(self.sprung(), at_rest).map(|(alpha, rest)| alpha - rest).collect();
        let at = |j: usize| (self.gap[j] - self.g_free[j] - self.coarse.at(j, &change)).abs();
        (0..self.coupling.n_rows).map(at).collect()
    }

    /// True if a gap would be negative with all rigid motions at zero and without contact forces. Collective on the roots.
    pub fn would_penetrate_at_rest(&self) -> bool {
        let at_rest = self.coarse.sprung(&self.coarse.work);
        let [mut deepest, mut parts] = [0.0_f64; 2];
        for j in 0..self.coupling.n_rows {
            let soft = self.coarse.at(j, &at_rest);
            deepest = larger(deepest, soft - self.g_free[j]);
            parts = larger(parts, soft.abs());
        }
        let largest = self.coupling.exchange.max(&[deepest, parts]);
        largest[0] > self.gap_threshold() + THRESHOLD * largest[1]
    }

    /// Penetration below this is none, m.
    pub fn gap_threshold(&self) -> f64 {
        let mut largest = [0.0_f64; 2];
        let (held, sprung) = (self.coarse.all_are_sprung(), self.sprung());
        for j in 0..self.coupling.n_rows {
            let elastic = (self.gap[j] - self.g_free[j] - self.coarse.at(j, &sprung)).abs();
            let local = (self.force[j] / self.coarse.scaling(j)).abs();
            largest[0] = larger(larger(largest[0], local), if held { elastic } else { 0.0 });
            if self.active[j] {
                largest[1] = larger(larger(largest[1], self.g_free[j].abs()), elastic);
            }
        }
        let largest = self.coupling.exchange.max(&largest);
        self.threshold.max(THRESHOLD) * largest[0] + ROUND_OFF * largest[1]
    }

    /// Active rows in tension, open rows that penetrate, and the largest of either relative to its scale.
    pub(super) fn violations(&self) -> (Vec<usize>, Vec<usize>, f64) {
        let largest = self.largest(&self.force);
        let (tension, penetration) = (self.threshold * largest, self.gap_threshold());
        let n = self.coupling.n_rows;
        let leaving: Vec<usize> = (0..n).filter(|&j| self.active[j] && self.force[j] < -tension).collect();
        let entering: Vec<usize> =
            (0..n).filter(|&j| !self.active[j] && self.gap_at(j) < -penetration).collect();
        let worst = leaving.iter().map(|&j| -self.force[j] / largest).fold(0.0, larger);
        let worst =
            entering.iter().map(|&j| -self.gap_at(j) / (penetration / self.threshold)).fold(worst, larger);
        (leaving, entering, self.coupling.exchange.max(&[worst])[0])
    }
}
