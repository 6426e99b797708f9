//! The linear system of an active set, by projected conjugate gradients: one iteration is one alternation.
use super::{ActiveSet, Projector, Respond};
use crate::{error::Result, record::HistoryRow};

/// Imbalance of the forces, relative to the sum of the absolute works, that is round-off.
const BALANCED: f64 = 1e-12;

/// Iterations without a smaller residual after which round-off is taken to have been reached, and up to how many times the
/// least that round-off can leave: the round-off of a body's answer grows with its condition.
const PATIENCE: [(usize, f64); 2] = [(12, 1e4), (48, 1e6)];

/// The same where the preconditioner is exact: one iteration leaves nothing but round-off, and a second one none of the first's.
const EXACT_PATIENCE: [(usize, f64); 2] = [(2, 1e4), (6, 1e6)];

/// Iterations that a residual below the tolerance may rest before the forces, whose error is watched, too, are as good as
/// round-off lets them be.
const SMALL_PATIENCE: usize = 4;

/// A direction of conjugate gradients.
struct Direction {
    p: Vec<f64>,
    /// F p, m.
    q: Vec<f64>,
    /// p'F p.
    curvature: f64,
}

/// Work of a displacement step, relative to that of the local stiffness, that is round-off: the answer is none.
const NO_ANSWER: f64 = 1e-12;

/// How a linear solve on the active set ended.
#[derive(PartialEq, Eq)]
pub(super) enum Inner {
    Done,
    RoundOff,
    Limit,
}

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Solves on the active set, starting from `force` cut down to it and brought into equilibrium.
    pub(super) fn solve(
        &mut self,
        force: Vec<f64>,
        projector: &Projector,
        tolerance: f64,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Inner> {
        self.evaluate(force, projector, progress)?;
        self.solve_from_state(projector, tolerance, progress)
    }

    /// Forces cut down to the active set and brought into equilibrium, and the gaps under them; what they push the
    /// multiplier and the mortar sides inwards, m, if that took a force step.
    pub(super) fn evaluate(
        &mut self,
        mut force: Vec<f64>,
        projector: &Projector,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Option<[Vec<f64>; 2]>> {
        std::iter::zip(&mut force, &self.active).filter(|(_, a)| !**a).for_each(|(f, _)| *f = 0.0);
        let is_guess = self.updates == 0 && self.coarse.all_are_sprung() && self.dual.is_none();
        if !is_guess {
            self.balance(&mut force, projector);
        }
        let changed = force != self.force;
        if self.coupling.exchange.max(&[f64::from(u8::from(changed))])[0] == 0.0 {
            return Ok(None);
        }
        let [mut own, mut other] = self.coupling.force_step(&force)?;
        self.choose_lead(&force, &own, &other);
        if is_guess {
            self.resize(&mut force, &mut own, &mut other);
        }
        self.force = force;
        self.gap =
            self.g_free.iter().zip(std::iter::zip(&own, &other)).map(|(g, (a, b))| g + a + b).collect();
        self.update_alpha(projector);
        self.record(0, progress);
        Ok(Some([own, other]))
    }

    /// Adds Q Z W (e - Z'R) on the active rows: the least change, in local elastic energy, that restores equilibrium.
    fn balance(&self, force: &mut [f64], projector: &Projector) {
        let pushed = self.coarse.restrict(self.coupling.exchange, |j| force[j]);
        let missing: Vec<f64> = std::iter::zip(&self.coarse.work, pushed).map(|(e, p)| e - p).collect();
        // Round-off is no imbalance: to chase it would cost a force step.
        let absolute = self.coarse.absolute_work(self.coupling.exchange, force);
        let balanced = |k: usize| missing[k].abs() <= BALANCED * (self.coarse.work[k].abs() + absolute[k]);
        if (0..self.coarse.n).all(balanced) {
            return;
        }
        let a = projector.solve(&missing);
        if a.iter().any(|a| *a != 0.0) {
            for j in (0..force.len()).filter(|&j| self.active[j]) {
                force[j] += self.coarse.scaling(j) * self.coarse.at(j, &a);
            }
        }
    }

    /// alpha = W Z'Q g on the active rows: the rigid motion that closes the gaps as far as one can.
    pub(super) fn update_alpha(&mut self, projector: &Projector) {
        if self.coarse.n > 0 {
            let g = self.coarse.restrict(self.coupling.exchange, |j| {
                if self.active[j] { self.coarse.scaling(j) * self.gap[j] } else { 0.0 }
            });
            self.alpha = projector.solve(&g);
        }
    }

    /// Projected preconditioned conjugate gradients from the state as it is. Every direction is made conjugate to all before
    /// it: there are few beside the cost of a step of the bodies, and with the last one alone round-off lets the others
    /// return, so that more iterations are taken than there are rows.
    pub(super) fn solve_from_state(
        &mut self,
        projector: &Projector,
        tolerance: f64,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Inner> {
        self.update_alpha(projector);
        let mut r = self.residual_vector();
        let mut directions: Vec<Direction> = Vec::new();
        let mut best = (f64::INFINITY, 0);
        let mut sizes = Vec::new();
        let early = tolerance > self.limits.tolerance;
        for iteration in 0_usize.. {
            let scales = self.scales();
            let (scale, floor) = (scales.all, scales.floor);
            let [size, joint] = self.size(&r, &scales);
            self.residual = if scale > 0.0 { size / scale } else { 0.0 };
            let mut small = size <= scale * if early { tolerance } else { self.limits.tolerance };
            if small && !early {
                let is_believed = self.follow_mesh_error(self.residual);
                small = is_believed && size <= self.limits.tolerance * scale;
            }
            if small && early || size == 0.0 {
                return Ok(Inner::Done);
            }
            if size < 0.9 * best.0 {
                best = (size, iteration);
            }
            let waited = iteration - best.1;
            // Conjugate gradients do not lower this norm at every iteration: on its way down from a peak it does not rest.
            sizes.push(size);
            let falls = |over: usize| size < 0.9 * sizes[iteration.saturating_sub(over)];
            let rests = |(patience, much): (usize, f64)| {
                waited > patience && size <= much * floor && !falls(patience / 2)
            };
            let patience = if self.dual.is_some() { EXACT_PATIENCE } else { PATIENCE };
            if size <= floor || small && waited > SMALL_PATIENCE || patience.into_iter().any(rests) {
                // What round-off hides of one pair need not be worthless to all.
                self.residual = if scale > 0.0 { joint / scale } else { 0.0 };
                return Ok(Inner::RoundOff);
            }
            if self.recorder.count() >= self.limits.max_alternations {
                return Ok(Inner::Limit);
            }
            let mut z = self.precondition(&r)?;
            // Where a support holds the leading body only the other one gives way: its local stiffness has to do.
            for j in (0..z.len()).filter(|&j| self.active[j]) {
                if z[j] == 0.0 {
                    z[j] = self.coarse.scaling(j) * r[j];
                }
            }
            self.resist_held(&r, &mut z);
            let pushed = self.coarse.restrict(self.coupling.exchange, |j| z[j]);
            let a = projector.solve(&pushed);
            for (j, z) in z.iter_mut().enumerate() {
                let rigid = self.coarse.scaling(j) * self.coarse.at(j, &a);
                *z = if self.active[j] { *z - rigid } else { 0.0 };
            }
            // The preconditioned residual estimates the error of the forces, which a small gap may hide.
            if small
                && self.coupling.dot(&z, &z)
                    <= self.limits.tolerance.powi(2) * self.coupling.dot(&self.force, &self.force)
            {
                return Ok(Inner::Done);
            }
            let p = self.conjugate(z, &directions);
            let [own, other] = self.coupling.force_step(&p)?;
            let q: Vec<f64> = std::iter::zip(own, other).map(|(a, b)| a + b).collect();
            let curvature = self.coupling.dot(&p, &q);
            let work = self.coupling.dot(&p, &r);
            if curvature.is_nan() || work.is_nan() || curvature <= 0.0 || work <= 0.0 {
                // Round-off, or a redundant row: nothing is to be gained in this direction.
                if directions.is_empty() {
                    return Ok(Inner::RoundOff);
                }
                directions.clear();
                continue;
            }
            let step = work / curvature;
            std::iter::zip(&mut self.force, &p).for_each(|(f, p)| *f += step * p);
            std::iter::zip(&mut self.gap, &q).for_each(|(g, q)| *g += step * q);
            self.update_alpha(projector);
            self.record(0, progress);
            r = self.residual_vector();
            directions.push(Direction { p, q, curvature });
        }
        unreachable!("the loop ends by a return")
    }

    /// `z` less its parts along the directions, in the scalar product of F. Collective on the roots.
    fn conjugate(&self, z: Vec<f64>, directions: &[Direction]) -> Vec<f64> {
        let product = |d: &Direction| std::iter::zip(&z, &d.q).map(|(z, q)| z * q).sum::<f64>();
        let products: Vec<f64> = directions.iter().map(product).collect();
        let products = if products.is_empty() { products } else { self.coupling.exchange.sum(&products) };
        let mut p = z;
        for (product, d) in std::iter::zip(products, directions) {
            let part = product / d.curvature;
            std::iter::zip(&mut p, &d.p).for_each(|(p, d)| *p -= part * d);
        }
        p
    }

    /// Forces that would take the residual `r` away: exactly, where F is at hand, else by a displacement step.
    fn precondition(&mut self, r: &[f64]) -> Result<Vec<f64>> {
        let answer = match &mut self.dual {
            Some(dual) => dual.correct(self.coupling, self.coarse, r, &self.active)?,
            None => None,
        };
        match answer {
            Some(z) => Ok(z),
            None => self.coupling.displacement_step(r, &self.active, &self.share),
        }
    }

    /// Few rows, and motions of a body that are held: the body by itself could still make them and gives no answer, where
    /// the problem has one. Its local stiffness has to do. Collective on the roots.
    fn resist_held(&self, r: &[f64], z: &mut [f64]) {
        let local: Vec<f64> =
            (0..r.len()).map(|j| if self.active[j] { self.coarse.scaling(j) * r[j] } else { 0.0 }).collect();
        let sizes = [self.coupling.dot(z, r), self.coupling.dot(&local, r)];
        if sizes[0] <= NO_ANSWER * sizes[1] {
            z.copy_from_slice(&local);
        }
    }

    /// -(g - Z alpha) on the active rows, m.
    pub(super) fn residual_vector(&self) -> Vec<f64> {
        (0..self.coupling.n).map(|j| if self.active[j] { -self.gap_at(j) } else { 0.0 }).collect()
    }
}
