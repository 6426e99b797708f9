//! What the active-set driver's residuals, tension and penetration are measured by.
use super::{ActiveSet, Respond};
use crate::tolerances::{SUM, THRESHOLD};
use crate::vector::{larger, ratio, worst};

/// A pair's own approach counts down to this share of that of all pairs: of a smaller one the round-off of what they move
/// together, [`SUM`], leaves less than seven digits.
const LEAST_PAIR: f64 = 1e-7;

/// What residuals are measured by.
pub(super) struct Scales {
    /// Norm of the elastic approach at the active rows, m.
    pub all: f64,
    /// What round-off leaves of a residual, m.
    pub floor: f64,
    /// Each pair's own approach over that of all.
    shares: Vec<f64>,
}

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Gap at a row, m.
    pub fn gap_at(&self, j: usize) -> f64 {
        self.gap[j] - self.coarse.at(j, &self.alpha)
    }

    /// What residuals are measured by. Collective on the roots.
    pub(super) fn scales(&self) -> Scales {
        // Per pair, then of the springs: squares of the elastic approach, of the local one, of what is rounded.
        let n_pairs = self.recorder.n_pairs();
        let mut sums = vec![[0.0; 3]; n_pairs + 1];
        // Of soft modes it is the motion that there is: without contact it may be out of all proportion.
        let (held, sprung) = (self.coarse.all_are_sprung(), self.sprung());
        for (j, pair) in self.pair_of_row().into_iter().enumerate().filter(|(j, _)| self.active[*j]) {
            let elastic = self.gap[j] - self.g_free[j] - self.coarse.at(j, &sprung);
            let local = self.force[j] / self.coarse.scaling(j);
            let rigid = self.coarse.at(j, &self.alpha);
            let sum = &mut sums[pair];
            if j < self.coupling.n_rows {
                sum[0] += if held { elastic * elastic } else { 0.0 };
                sum[1] += local * local;
            }
            sum[2] += elastic * elastic + self.g_free[j] * self.g_free[j] + rigid * rigid;
        }
        let sums = self.coupling.exchange.sum(sums.as_flattened());
        let total = |k: usize| sums.chunks_exact(3).map(|s| s[k]).sum::<f64>();
        let all = larger(total(0), total(1)).sqrt();
        let own = |s: &[f64]| larger(larger(s[0], s[1]).sqrt(), LEAST_PAIR * all);
        let of_pair = |s: &[f64]| ratio(own(s), all);
        let shares: Vec<f64> = sums.chunks_exact(3).take(n_pairs).map(of_pair).collect();
        // Where a pair's own approach is small, the round-off of its gaps counts by that much more.
        let rounded =
            std::iter::zip(sums.chunks_exact(3), &shares).map(|(s, share)| ratio(s[2].sqrt(), *share));
        Scales { all, floor: SUM * larger(worst(rounded), total(2).sqrt()), shares }
    }

    /// The pair of each row of a row vector; one more than there are for the springs.
    fn pair_of_row(&self) -> Vec<usize> {
        let mut pairs = vec![self.recorder.n_pairs(); self.coupling.n];
        for (end, range) in std::iter::zip(self.coupling.ends, &self.coupling.ranges) {
            pairs[range.clone()].fill(end.pair);
        }
        pairs
    }

    /// Size of a residual, m: of the pairs' norms, each measured by its own approach, the largest, and the norm over all
    /// pairs; or that on the springs if it is larger, measured by their own travel. Collective on the roots.
    pub(super) fn size(&self, r: &[f64], scales: &Scales) -> [f64; 2] {
        let n_pairs = self.recorder.n_pairs();
        let mut sums = vec![0.0; n_pairs + 2];
        for (j, pair) in self.pair_of_row().into_iter().enumerate() {
            sums[pair] += r[j] * r[j];
            if j >= self.coupling.n_rows {
                sums[n_pairs + 1] += self.coarse.at(j, &self.alpha).powi(2);
            }
        }
        let sums: Vec<f64> = self.coupling.exchange.sum(&sums).into_iter().map(f64::sqrt).collect();
        let rows = worst(std::iter::zip(&sums, &scales.shares).map(|(r, share)| ratio(*r, *share)));
        let joint = sums[..n_pairs].iter().map(|r| r * r).sum::<f64>().sqrt();
        // Without a scale nothing has been measured yet.
        let rows = if scales.all > 0.0 { rows } else { joint };
        let (springs, travel) = (sums[n_pairs], sums[n_pairs + 1]);
        let springs = if travel > scales.all { springs * scales.all / travel } else { springs };
        [rows, joint].map(|rows| larger(rows, springs))
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

    /// What the contact forces change of each gap, but for rigid motions: the elastic approach, m. At least the dent of the row's
    /// own force: how much of the rest is rigid motion depends on what holds a free body meanwhile.
    pub fn elastic_approach(&self) -> Vec<f64> {
        let at_rest = self.coarse.sprung(&self.coarse.work);
        let change: Vec<f64> =
            std::iter::zip(self.sprung(), at_rest).map(|(alpha, rest)| alpha - rest).collect();
        let at = |j: usize| {
            let approach = (self.gap[j] - self.g_free[j] - self.coarse.at(j, &change)).abs();
            larger(approach, ratio(self.force[j].abs(), self.coarse.scaling(j)))
        };
        (0..self.coupling.n_rows).map(at).collect()
    }

    /// True if a gap would be negative with all rigid motions at zero and without contact forces. Collective on the roots.
    pub fn would_penetrate_at_rest(&self) -> bool {
        let at_rest = self.coarse.sprung(&self.coarse.work);
        let [mut deepest, mut parts] = [0.0_f64; 2];
        for j in self.normals() {
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
        self.threshold.max(THRESHOLD) * largest[0] + SUM * largest[1]
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
