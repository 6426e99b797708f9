//! The free modes of the bodies, rigid and soft ones, as the coarse space of the interface problem (as in FETI).
//!
//! With Z the outward row displacements of all free modes, alpha their amplitudes and e the work of the loads on them,
//! the gap is g = g_free + F R - Z alpha and the bodies are in equilibrium if Z' R = e. A spring of stiffness k and lever z
//! on a mode is one more row, of compliance 1/k and never open: r / k - z alpha = 0, and z r resists the mode.
use super::{Coupling, Respond};
use crate::parallel::Exchange;
use crate::tolerances::{FREE_OF_CONTACT, NO_WORK, SUM};
use crate::vector::{larger, largest, smaller, symmetric_eigen};
use nalgebra::{DMatrix, DVector};

/// A slope of the rigid start's energy below this, relative to the first, is none.
const FLAT: f64 = 1e-13;

/// Iterations and bisections of the rigid start; each is a few small reductions.
const START_ITERATIONS: usize = 200;

/// When a row resists a rigid motion in the first guess.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resists {
    /// Where the bodies are pressed together.
    Pressed,
    /// Either way: springs, bonded surfaces, and surfaces that may stick.
    Always,
    /// A tangential row of surfaces that may slip.
    Never,
}

/// The free modes of all bodies.
#[derive(Clone)]
pub struct Coarse {
    /// Number of modes of all bodies.
    pub n: usize,
    /// Work of the loads on each mode, J; what is round-off is zero.
    pub work: Vec<f64>,
    /// Stiffness of each mode's spring, N/m; zero without.
    pub stiffness: Vec<f64>,
    /// The springs of this rank: the mode and the lever.
    springs: Vec<(usize, f64)>,
    /// Per row of this rank and side (multipliers first): the modes that move it, and by how much outwards, m.
    rows: Vec<[Vec<(usize, f64)>; 2]>,
    /// Diagonal scaling Q of each row: its local stiffness, N/m.
    scaling: Vec<f64>,
    /// Number of contact rows; springs follow.
    n_rows: usize,
    held: Option<Held>,
}

/// What is taken out of the problem: the part of the work and of the rows' displacements that belongs to held motions.
#[derive(Clone)]
struct Held {
    work: Vec<f64>,
    rows: Vec<[Vec<(usize, f64)>; 2]>,
}

/// The coarse problem on an active set.
pub struct Projector {
    /// Pseudo-inverse W of Z' Q Z on the active rows.
    inverse: DMatrix<f64>,
    /// Orthonormal basis of the motions that the active rows do not restrain.
    pub unrestrained: Vec<DVector<f64>>,
}

impl Coarse {
    /// Gathers the modes. `first`: number of each of this rank's bodies' first mode among all `n`; `scaling`: of the contact
    /// rows. Collective on the roots.
    pub fn new<B: Respond>(
        coupling: &Coupling<B>,
        n: usize,
        first: &[usize],
        mut scaling: Vec<f64>,
    ) -> Coarse {
        let mut work = vec![0.0; 2 * n];
        for (b, body) in coupling.bodies.iter().enumerate() {
            for (k, (e, scale)) in std::iter::zip(body.mode_work(), body.mode_scale()).enumerate() {
                (work[first[b] + k], work[n + first[b] + k]) = (*e, *scale);
            }
        }
        let work = coupling.exchange.sum(&work);
        let negligible = |k: usize| work[k].abs() <= NO_WORK * work[n + k];
        let work = (0..n).map(|k| if negligible(k) { 0.0 } else { work[k] }).collect();
        let mut rows = vec![<[Vec<(usize, f64)>; 2]>::default(); coupling.n];
        // The mode's number and the rows' displacements, end by end; a mortar end sends its own.
        let of_end = |bodies: &[B], end: &super::End| -> Vec<f64> {
            let modes = bodies[end.body].modes();
            let mut message = vec![first[end.body] as f64, modes.len() as f64];
            modes.iter().for_each(|mode| message.extend(&mode[end.rows.clone()]));
            message
        };
        let mine: Vec<Vec<f64>> = coupling.ends.iter().map(|end| of_end(coupling.bodies, end)).collect();
        let out: Vec<Vec<f64>> = std::iter::zip(coupling.ends, &mine)
            .map(|(end, message)| if end.multiplier { Vec::new() } else { message.clone() })
            .collect();
        let received = coupling.exchange.swap(&out);
        for (i, end) in coupling.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            for (side, message) in
                [&mine[i], &received[i]].into_iter().enumerate().filter(|(_, m)| m.len() > 2)
            {
                let (first, m) = (message[0] as usize, end.rows.len());
                for (k, values) in message[2..].chunks_exact(m.max(1)).enumerate() {
                    for (row, z) in std::iter::zip(&mut rows[coupling.ranges[i].clone()], values) {
                        row[side].push((first + k, *z));
                    }
                }
            }
        }
        let (mut stiffness, mut springs) = (vec![0.0; n], Vec::new());
        for (j, (b, spring)) in (coupling.n_rows..).zip(&coupling.springs) {
            let mode = first[*b] + spring.mode;
            rows[j][0].push((mode, spring.lever));
            scaling.push(spring.stiffness);
            stiffness[mode] = spring.stiffness * spring.lever.powi(2);
            springs.push((mode, spring.lever));
        }
        let stiffness = if n > 0 { coupling.exchange.sum(&stiffness) } else { stiffness };
        Coarse { n, work, stiffness, springs, rows, scaling, n_rows: coupling.n_rows, held: None }
    }

    /// Holds motions: neither do loads or contact forces work on them any more, nor has any solution a part of them.
    /// `onto`: the orthogonal projector onto them; each belongs to one body. `rolls`: that onto motions that only the `normal` rows do not
    /// see.
    pub fn hold(&mut self, onto: &DMatrix<f64>, rolls: &DMatrix<f64>, normal: &[bool]) {
        let work = (onto * DVector::from_column_slice(&self.work)).as_slice().to_vec();
        std::iter::zip(&mut self.work, &work).for_each(|(w, held)| *w -= held);
        let of_normals = onto + rolls;
        let part = |row: &Vec<(usize, f64)>, onto: &DMatrix<f64>| -> Vec<(usize, f64)> {
            row.iter().map(|&(k, _)| (k, row.iter().map(|&(l, z)| onto[(k, l)] * z).sum())).collect()
        };
        let parts = |(j, sides): (usize, &[Vec<(usize, f64)>; 2])| {
            let onto = if normal.get(j).is_some_and(|normal| *normal) { &of_normals } else { onto };
            [part(&sides[0], onto), part(&sides[1], onto)]
        };
        let rows: Vec<[Vec<(usize, f64)>; 2]> = self.rows.iter().enumerate().map(parts).collect();
        let entries =
            |rows: &[Vec<(usize, f64)>; 2]| rows.iter().flatten().map(|e| e.1).collect::<Vec<f64>>();
        for (row, held) in std::iter::zip(&mut self.rows, &rows) {
            std::iter::zip(row.iter_mut().flatten(), entries(held)).for_each(|((_, z), held)| *z -= held);
        }
        self.held = Some(Held { work, rows });
    }

    /// Work on each mode of what the loads and the contact forces leave unbalanced in the held motions, J; empty if
    /// there are none. Collective on the roots.
    pub fn relief(&self, exchange: &Exchange, force: &[f64]) -> Vec<f64> {
        let Some(held) = &self.held else { return Vec::new() };
        let mut pushed = vec![0.0; self.n];
        for (row, force) in std::iter::zip(&held.rows, force) {
            row.iter().flatten().for_each(|&(k, z)| pushed[k] += z * force);
        }
        std::iter::zip(&held.work, exchange.sum(&pushed)).map(|(work, pushed)| work - pushed).collect()
    }

    /// The same modes under loads that do no work on a motion.
    pub(super) fn without(&self, motion: &[f64]) -> Coarse {
        let mut coarse = self.clone();
        let square: f64 = motion.iter().map(|m| m * m).sum();
        let work: f64 = std::iter::zip(motion, &self.work).map(|(m, e)| m * e).sum();
        std::iter::zip(&mut coarse.work, motion).for_each(|(e, m)| *e -= m * work / square);
        coarse
    }

    /// The same modes under no loads.
    pub(super) fn unloaded(&self) -> Coarse {
        let mut coarse = self.clone();
        coarse.work.fill(0.0);
        coarse.held.iter_mut().for_each(|held| held.work.fill(0.0));
        coarse
    }

    /// True if springs resist all modes: each body stands without contact.
    pub fn all_are_sprung(&self) -> bool {
        self.stiffness.iter().all(|k| *k > 0.0)
    }

    /// The springs' forces, N, in equilibrium with contact forces that do the work `pushed` on the modes.
    pub fn spring_forces(&self, pushed: &[f64]) -> Vec<f64> {
        self.springs.iter().map(|&(k, lever)| (self.work[k] - pushed[k]) / lever).collect()
    }

    /// The springs' forces, N, at the amplitudes `alpha`.
    pub fn spring_forces_at(&self, alpha: &[f64]) -> Vec<f64> {
        let stiffness = &self.scaling[self.n_rows..];
        std::iter::zip(&self.springs, stiffness).map(|(&(k, lever), s)| s * lever * alpha[k]).collect()
    }

    /// Z' v over all ranks. Collective on the roots unless there are no modes.
    pub fn restrict(&self, exchange: &Exchange, v: impl Fn(usize) -> f64) -> Vec<f64> {
        if self.n == 0 {
            return Vec::new();
        }
        let mut sum = vec![0.0; self.n];
        for (j, row) in self.rows.iter().enumerate() {
            let v = v(j);
            if v != 0.0 {
                row.iter().flatten().for_each(|&(k, z)| sum[k] += z * v);
            }
        }
        exchange.sum(&sum)
    }

    /// (Z a) at row j, m.
    pub fn at(&self, j: usize, a: &[f64]) -> f64 {
        self.rows[j].iter().flatten().map(|&(k, z)| z * a[k]).sum()
    }

    /// The same of the modes of one side's body (0: that of the multipliers).
    pub fn at_side(&self, j: usize, side: usize, a: &[f64]) -> f64 {
        self.rows[j][side].iter().map(|&(k, z)| z * a[k]).sum()
    }

    /// Amplitudes of the sprung modes under forces that do the work `work` on the modes; zero of the others.
    pub fn sprung(&self, work: &[f64]) -> Vec<f64> {
        let amplitude =
            |(work, stiffness): (&f64, &f64)| if *stiffness > 0.0 { work / stiffness } else { 0.0 };
        std::iter::zip(work, &self.stiffness).map(amplitude).collect()
    }

    /// Q at row j, N/m.
    pub fn scaling(&self, j: usize) -> f64 {
        self.scaling[j]
    }

    /// The coarse problem on the active rows. Collective on the roots.
    pub fn projector(&self, exchange: &Exchange, active: &[bool]) -> Projector {
        let n = self.n;
        if n == 0 {
            return Projector { inverse: DMatrix::zeros(0, 0), unrestrained: Vec::new() };
        }
        let gram = self.gram(exchange, |j| if active[j] { self.scaling[j] } else { 0.0 });
        // Modes of bodies of very different stiffness are compared with their own diagonal.
        let diagonal: Vec<f64> = (0..n).map(|k| gram[(k, k)].sqrt()).collect();
        let largest = diagonal.iter().copied().fold(0.0, larger);
        let unit = |k: usize| match (diagonal[k] > 1e-14 * largest, largest > 0.0) {
            (true, _) => 1.0 / diagonal[k],
            (false, true) => 1.0 / largest,
            (false, false) => 1.0,
        };
        let scaled = DMatrix::from_fn(n, n, |i, j| gram[(i, j)] * unit(i) * unit(j));
        let Some(eigen) = symmetric_eigen(scaled) else {
            // Overflown: no motion helps, and the checks of the result say so.
            return Projector { inverse: DMatrix::zeros(n, n), unrestrained: Vec::new() };
        };
        let top = eigen.eigenvalues.max();
        let mut inverse = DMatrix::zeros(n, n);
        let mut unrestrained = Vec::new();
        for (k, &value) in eigen.eigenvalues.iter().enumerate() {
            let mut v = eigen.eigenvectors.column(k).into_owned();
            (0..n).for_each(|i| v[i] *= unit(i));
            if value > FREE_OF_CONTACT * top && top > 0.0 {
                inverse += &v * v.transpose() / value;
            } else {
                unrestrained.push(v.normalize());
            }
        }
        Projector { inverse, unrestrained }
    }

    fn gram(&self, exchange: &Exchange, weight: impl Fn(usize) -> f64) -> DMatrix<f64> {
        let n = self.n;
        let mut gram = vec![0.0; n * n];
        for (j, row) in self.rows.iter().enumerate() {
            let q = weight(j);
            if q != 0.0 {
                for &(i, a) in row.iter().flatten() {
                    row.iter().flatten().for_each(|&(k, b)| gram[i * n + k] += q * a * b);
                }
            }
        }
        DMatrix::from_row_slice(n, n, &exchange.sum(&gram))
    }

    /// A first guess of the contact forces: every row a spring of its local stiffness k, the bodies rigid but for it.
    /// Minimises 1/2 sum k <Z alpha - g>^2 - e . alpha, so that the forces R = k <Z alpha - g> are compressive and in
    /// equilibrium with the loads; closes initial gaps that a force drives. `Err`: the motion that goes on for ever.
    /// Collective on the roots.
    ///
    /// `resists` says of each row when.
    pub fn start(
        &self,
        exchange: &Exchange,
        gap: &[f64],
        resists: &[Resists],
    ) -> Result<(Vec<f64>, Vec<f64>), Vec<f64>> {
        let n = self.n;
        let mut alpha = vec![0.0; n];
        let force = |alpha: &[f64]| -> Vec<f64> {
            let force = |j: usize| {
                let (moved, gap) = (self.at(j, alpha), gap[j]);
                let touches = (moved - gap).abs() <= SUM * moved.abs().max(gap.abs());
                match resists[j] {
                    Resists::Never => 0.0,
                    Resists::Pressed if touches => 0.0,
                    Resists::Pressed => larger(self.scaling[j] * (moved - gap), 0.0),
                    Resists::Always => self.scaling[j] * (moved - gap),
                }
            };
            (0..gap.len()).map(force).collect()
        };
        let mut r = force(&alpha);
        for _ in 0..START_ITERATIONS {
            if n == 0 {
                break;
            }
            let pushed = self.restrict(exchange, |j| r[j]);
            let residual: Vec<f64> = std::iter::zip(&self.work, &pushed).map(|(e, p)| e - p).collect();
            // Modes move no node by more than one: a spin, which rows hardly see, is measured by the forces, too.
            let total = exchange.sum(&[r[..self.n_rows].iter().map(|r| r.abs()).sum::<f64>()])[0];
            if (0..n).all(|k| residual[k].abs() <= 1e-12 * (self.work[k].abs() + total)) {
                break;
            }
            let active: Vec<bool> =
                (0..r.len()).map(|j| resists[j] == Resists::Always || r[j] > 0.0).collect();
            let projector = self.projector(exchange, &active);
            let b = DVector::from_vec(residual);
            // Where nothing resists yet the bodies go along with the load; elsewhere a Newton step.
            let drift: DVector<f64> =
                projector.unrestrained.iter().fold(DVector::zeros(n), |d, v| d + v * v.dot(&b));
            let drifting = drift.norm() > 1e-9 * b.norm();
            let direction = if drifting { drift } else { &projector.inverse * &b };
            let Some(step) =
                self.line_search(exchange, [gap, &alpha, direction.as_slice()], resists, drifting)
            else {
                return Err(direction.as_slice().to_vec());
            };
            alpha.iter_mut().zip(direction.iter()).for_each(|(a, d)| *a += step * d);
            r = force(&alpha);
        }
        Ok((r, alpha))
    }

    /// Sum of the absolute works of row forces on each mode. Collective on the roots.
    pub fn absolute_work(&self, exchange: &Exchange, r: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.n];
        for (j, row) in self.rows.iter().enumerate() {
            row.iter().flatten().for_each(|&(k, z)| sum[k] += (z * r[j]).abs());
        }
        exchange.sum(&sum)
    }

    /// Minimum of the springs' energy along `direction`; `None` if it falls for ever.
    fn line_search(
        &self,
        exchange: &Exchange,
        [gap, alpha, direction]: [&[f64]; 3],
        resists: &[Resists],
        open_ended: bool,
    ) -> Option<f64> {
        // What is round-off of bodies that move together, or of a direction that has no part of a motion, closes nothing.
        let farthest = largest(direction);
        let along = |j: usize| {
            let parts = self.rows[j].iter().flatten().map(|&(k, z)| (z * direction[k]).abs()).sum::<f64>();
            let along = self.at(j, direction);
            if along.abs() > SUM * larger(parts, farthest) { along } else { 0.0 }
        };
        let along: Vec<f64> = (0..gap.len()).map(along).collect();
        let pen: Vec<f64> = (0..gap.len()).map(|j| self.at(j, alpha) - gap[j]).collect();
        let work: f64 = std::iter::zip(&self.work, direction).map(|(e, d)| e * d).sum();
        let slope = |t: f64| -> [f64; 2] {
            let mut s = [0.0, 0.0];
            for j in 0..gap.len() {
                let x = pen[j] + t * along[j];
                if resists[j] == Resists::Always || resists[j] == Resists::Pressed && x > 0.0 {
                    s[0] += self.scaling[j] * x * along[j];
                    s[1] += self.scaling[j] * along[j] * along[j];
                }
            }
            let s = exchange.sum(&s);
            [s[0] - work, s[1]]
        };
        // A step length to begin with: the first contact ahead, the springs that start to resist at once, or a full Newton
        // step.
        let mut high = 1.0;
        if open_ended {
            let ahead = |j: &usize| along[*j] > 0.0 && resists[*j] == Resists::Pressed;
            let first = (0..gap.len())
                .filter(|j| ahead(j) && pen[*j] < 0.0)
                .map(|j| -pen[j] / along[j])
                .fold(f64::INFINITY, smaller);
            let first = -exchange.max_signed(-first);
            let resisting = (0..gap.len()).filter(|j| ahead(j) && pen[*j] >= 0.0);
            let stiffness = resisting.map(|j| self.scaling[j] * along[j] * along[j]).sum::<f64>();
            let stiffness = exchange.sum(&[stiffness])[0];
            high = match first.is_finite() {
                true => first,
                false if stiffness > 0.0 => work / stiffness,
                false => return None,
            };
        }
        // Bodies that are pushed apart until they only touch: beyond that the energy is flat, and before it nearly so.
        let flat = FLAT * slope(0.0)[0].abs();
        let mut low = 0.0;
        let mut doublings = 0;
        while slope(high)[0] < -flat {
            (low, high) = (high, 2.0 * high);
            doublings += 1;
            if doublings > 400 {
                return None;
            }
        }
        if slope(high) == [0.0, 0.0] {
            // Nothing resists there any more: as far as the last row that does.
            let leaving = (0..self.n_rows)
                .filter(|&j| resists[j] == Resists::Pressed && pen[j] > 0.0 && along[j] < 0.0);
            let leaves = leaving.map(|j| pen[j] / -along[j]);
            return Some(exchange.max(&[leaves.fold(0.0, larger)])[0]);
        }
        // Newton on the piecewise linear slope, kept inside the bracket.
        let mut t = high;
        for _ in 0..START_ITERATIONS {
            let [value, curvature] = slope(t);
            if value.abs() <= flat {
                return Some(t);
            }
            if value > 0.0 {
                high = t
            } else {
                low = t
            }
            let next = if curvature > 0.0 { t - value / curvature } else { 0.5 * (low + high) };
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - t).abs() <= 1e-14 * high {
                return Some(next);
            }
            t = next;
        }
        Some(t)
    }
}

impl Projector {
    /// W v.
    pub fn solve(&self, v: &[f64]) -> Vec<f64> {
        if v.is_empty() {
            return Vec::new();
        }
        (&self.inverse * DVector::from_column_slice(v)).as_slice().to_vec()
    }

    /// The unrestrained motion on which the loads do work that the contact forces do not take up, if there is one.
    /// `missing`: the works of both together on the modes; `scale`: the sums of the absolute works, against which round-off
    /// is measured.
    pub fn driven(&self, missing: &[f64], scale: &[f64]) -> Option<Vec<f64>> {
        let e = DVector::from_column_slice(missing);
        let drift = self.unrestrained.iter().fold(DVector::zeros(scale.len()), |d, v| d + v * v.dot(&e));
        let scale = DVector::from_column_slice(scale).norm();
        (drift.norm() > NO_WORK * scale && drift.norm() > 0.0).then(|| drift.as_slice().to_vec())
    }

    /// As many modes as there are unrestrained motions, independent of each other in them: one after the other the mode
    /// that takes the largest part in what is left of the motions.
    pub fn free_modes(&self, n: usize) -> Vec<usize> {
        if self.unrestrained.is_empty() {
            return Vec::new();
        }
        let mut motions = DMatrix::from_columns(&self.unrestrained).qr().q();
        let mut chosen = Vec::new();
        for _ in 0..self.unrestrained.len() {
            let part = |k: usize| motions.row(k).norm();
            let largest = (0..n).fold(0, |best, k| if part(k) > part(best) { k } else { best });
            let direction = motions.row(largest).transpose().normalize();
            motions -= &motions * &direction * direction.transpose();
            chosen.push(largest);
        }
        chosen.sort_unstable();
        chosen
    }
}
