//! The active-set driver's first guess: where the bodies would touch, and with which forces.
use super::{ActiveSet, Respond};
use crate::{error::Result, record::HistoryRow};

/// Residual of the first guess, relative, up to which the leading bodies alone are a good model of the pairs.
const MODEL: f64 = 1e-2;

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// The first active set and forces: those of the whole problem where F is at hand, begun from `guess`; else `guess`,
    /// corrected.
    pub(super) fn first_guess(
        &mut self,
        guess: Vec<f64>,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Vec<f64>> {
        if let Some(dual) = &mut self.dual {
            let solved = dual.solve(self.coupling, self.coarse, &self.g_free, &guess, &self.alpha)?;
            if let Some((force, _)) = solved {
                self.active =
                    (0..self.coupling.n).map(|j| j >= self.coupling.n_rows || force[j] != 0.0).collect();
                return Ok(force);
            }
        }
        self.active = self.compressed(&guess);
        self.improved_guess(guess, progress)
    }

    /// Each pair's softer body pressed against the other one held fast. Where the two are alike up to a factor, as
    /// bodies that only dent are, the set of active rows is that of the solution. Rows whose body has no answer keep
    /// the springs' forces.
    pub(super) fn one_sided_guess(&mut self, start: &[f64]) -> Result<Vec<f64>> {
        for (share, rows) in std::iter::zip(&mut self.share, self.rows) {
            let mortar_is_softer = rows.compliance_ratio < 1.0 && !rows.mortar_is_coarse;
            *share = if mortar_is_softer { 0.0 } else { 1.0 };
        }
        // The leading body finds its own soft modes' amplitudes; those of the other one are at rest.
        let at_rest = self.coarse.sprung(&self.coarse.work);
        let rigid: Vec<f64> = std::iter::zip(&self.alpha, &self.coarse.stiffness)
            .map(|(alpha, k)| if *k > 0.0 { 0.0 } else { *alpha })
            .collect();
        let mut gap: Vec<f64> =
            (0..self.coupling.n).map(|j| self.gap[j] - self.coarse.at(j, &rigid)).collect();
        for (i, _) in self.coupling.ends.iter().enumerate().filter(|(_, e)| e.multiplier) {
            let other = usize::from(self.share[i] >= 0.5);
            self.coupling.ranges[i].clone().for_each(|j| gap[j] -= self.coarse.at_side(j, other, &at_rest));
        }
        let answer = self.coupling.unilateral_step(&gap, start, &self.share)?;
        let mut guess: Vec<f64> = std::iter::zip(answer, start).map(|(g, s)| g.unwrap_or(*s)).collect();
        if self.largest(&guess) == 0.0 {
            guess = start.to_vec();
        }
        Ok(guess)
    }

    /// Where the first guess shows that F is nearly theta times the compliance C of the leading bodies, one more unilateral
    /// step with that model, C R' + (g / theta - C R) >= 0, corrects the set before anything is solved on it.
    pub(super) fn improved_guess(
        &mut self,
        guess: Vec<f64>,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Vec<f64>> {
        let projector = self.coarse.projector(self.coupling.exchange, &self.active);
        let responses = self.evaluate(guess, &projector, progress)?;
        let r = self.residual_vector();
        let scales = self.scales();
        let (scale, floor) = (scales.all, scales.floor);
        let [size, _] = self.size(&r, &scales);
        let Some([mut own, mut other]) = responses else { return Ok(self.force.clone()) };
        if size > MODEL * scale || size <= (self.limits.tolerance * scale).max(floor) {
            return Ok(self.force.clone());
        }
        // With what the soft modes give way.
        let n_rows = self.coupling.n_rows;
        let pushed = |j: usize| if j < n_rows { self.force[j] } else { 0.0 };
        let sprung = self.coarse.sprung(&self.coarse.restrict(self.coupling.exchange, pushed));
        let at_rest = self.coarse.sprung(&self.coarse.work);
        for j in 0..n_rows {
            own[j] += self.coarse.at_side(j, 0, &sprung);
            other[j] += self.coarse.at_side(j, 1, &sprung);
        }
        let mut model = vec![0.0; self.coupling.n];
        for (i, _) in self.coupling.ends.iter().enumerate().filter(|(_, e)| e.multiplier) {
            let range = self.coupling.ranges[i].clone();
            let side = usize::from(self.share[i] < 0.5);
            let leading = [&own, &other][side];
            let work = |w: &[f64]| -> f64 { range.clone().map(|j| self.force[j] * w[j]).sum() };
            let theta = (work(&own) + work(&other)) / work(leading);
            let theta = if theta.is_finite() && theta > 0.0 { theta } else { 1.0 };
            range.for_each(|j| {
                model[j] = self.gap_at(j) / theta - leading[j] + self.coarse.at_side(j, side, &at_rest)
            });
        }
        let answer = self.coupling.unilateral_step(&model, &self.force, &self.share)?;
        let missing = f64::from(u8::from(answer.contains(&None)));
        let mut better: Vec<f64> = answer.into_iter().map(Option::unwrap_or_default).collect();
        if self.coupling.exchange.max(&[missing])[0] > 0.0 || self.largest(&better) == 0.0 {
            better = self.force.clone();
        }
        self.active = self.compressed(&better);
        Ok(better)
    }

    /// A guess of the contact forces has the right shape; its size minimises the energy along it. The springs follow.
    pub(super) fn resize(&self, force: &mut [f64], own: &mut [f64], other: &mut [f64]) {
        let (coarse, n_rows) = (self.coarse, self.coupling.n_rows);
        let pushed = coarse.restrict(self.coupling.exchange, |j| if j < n_rows { force[j] } else { 0.0 });
        let mut sums = [0.0; 2];
        for j in 0..n_rows {
            sums[0] += force[j] * (own[j] + other[j]);
            sums[1] -= force[j] * self.g_free[j];
        }
        let [mut work, mut driven] = [sums[0], sums[1]];
        let sums = self.coupling.exchange.sum(&[work, driven]);
        (work, driven) = (sums[0], sums[1]);
        for (k, stiffness) in coarse.stiffness.iter().enumerate() {
            work += pushed[k] * pushed[k] / stiffness;
            driven += pushed[k] * coarse.work[k] / stiffness;
        }
        let size = driven / work;
        let size = if work > 0.0 && size.is_finite() && size > 0.0 { size } else { 1.0 };
        for v in [&mut *force, &mut *own, &mut *other] {
            v[..n_rows].iter_mut().for_each(|v| *v *= size);
        }
        let pushed: Vec<f64> = pushed.iter().map(|p| size * p).collect();
        let springs = coarse.spring_forces(&pushed);
        for ((s, j), (_, spring)) in springs.into_iter().zip(n_rows..).zip(&self.coupling.springs) {
            (force[j], own[j]) = (s, s / spring.stiffness);
        }
    }
}
