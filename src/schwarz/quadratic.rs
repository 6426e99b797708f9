//! The contact problem on a dense compliance, settled exactly: x >= 0, y = A x + g - Z alpha >= 0, x y = 0,
//! Z'x + K alpha = e.
//!
//! A primal-dual active set (semi-smooth Newton) does it in a few factorisations; should a set return, an interior-point
//! method, which cannot cycle, finds the set (Mehrotra 1992; Nocedal and Wright, Numerical Optimization, 16.6). Rows that
//! depend on each other and motions that nothing holds need no special case: every factorisation is of a slightly
//! stiffened system, whose error refinement takes away again; what the system does not determine stays at its least norm.
use crate::tolerances::SUM;
use crate::{
    error::Result,
    petsc::{Cholesky, Symmetric},
    vector::{all_finite, larger, largest, smaller},
};
use nalgebra::{DMatrix, DVector};
use std::{collections::HashSet, ops::Range};

/// Added to the diagonal, relative to its mean, which is 1: between the round-off of the entries, which it must drown, and
/// the smallest stiffness that counts, which refinement must still see.
const STIFFENED: f64 = 1e-9;

/// A mode whose rows move less than this, squared and relative to the largest, moves them by round-off.
const UNSEEN: f64 = 1e-18;

/// Refinements of a solution; each lowers the error by the ratio of [`STIFFENED`] to the smallest eigenvalue.
const REFINEMENTS: usize = 8;

/// Tension and penetration below this are none, relative to the largest force and elastic approach of the pair: ten times
/// the round-off of a few hundred terms.
const NONE: f64 = 1e-12;

/// Updates of the active set before the interior-point method takes over: bodies that dent take five to ten.
const UPDATES: usize = 40;

/// Iterations of the interior-point method, which takes ten to thirty whatever the size.
const INTERIOR_ITERATIONS: usize = 80;

/// Fall of the mean product of force and gap that separates closed rows from open ones.
const SEPARATED: f64 = 1e-13;

/// Share of the way to the boundary that an interior step goes.
const INSIDE: f64 = 0.99;

/// The data that stay from one solution to the next.
#[derive(Debug, Clone)]
pub(super) struct Quadratic {
    /// A, scaled to a mean diagonal of 1.
    pub a: Symmetric,
    /// Z, mode by mode.
    pub modes: Vec<Vec<f64>>,
    /// K, one per mode; zero for rigid ones.
    pub stiffness: Vec<f64>,
    /// Rows of each pair: what forces and gaps are compared with.
    pub pairs: Vec<Range<usize>>,
    /// Whether the interior-point method may be asked.
    pub interior: bool,
}

/// The right-hand sides, and where to begin.
#[derive(Debug, Clone)]
pub(super) struct Given<'g> {
    pub gap: &'g [f64],
    pub work: &'g [f64],
    pub force: &'g [f64],
    pub alpha: &'g [f64],
}

/// What was found.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    pub force: Vec<f64>,
    pub alpha: Vec<f64>,
    pub active: Vec<bool>,
}

/// The stiffened system of one active set, factorised.
#[derive(Debug, Clone)]
pub(super) struct Face {
    pub active: Vec<usize>,
    /// Of A_aa + [`STIFFENED`] I.
    factor: Cholesky,
    /// Its solutions for Z_a.
    answers: Vec<Vec<f64>>,
    /// Of Z_a' A_aa^-1 Z_a + K + what holds free motions.
    coarse: nalgebra::Cholesky<f64, nalgebra::Dyn>,
}

impl Quadratic {
    /// Forces, motions and the active set, or the last one tried if even that of the interior-point method leaves
    /// violations; `None` if nothing could be factorised.
    pub fn solve(&self, given: &Given) -> Result<Option<Answer>> {
        let n = self.a.n();
        let mut active: Vec<bool> = (0..n).map(|j| given.force[j] > 0.0).collect();
        let mut inside = false;
        loop {
            let mut visited = HashSet::new();
            let mut last = None;
            for _ in 0..UPDATES {
                if !visited.insert(active.clone()) {
                    break;
                }
                let Some((force, alpha)) = self.on_set(&active, given)? else { return Ok(None) };
                let next = self.next_set(&active, &force, &alpha, given.gap)?;
                let settled = next == active;
                last = Some(Answer { force, alpha, active: active.clone() });
                if settled {
                    return Ok(last);
                }
                active = next;
            }
            if inside || !self.interior {
                return Ok(last);
            }
            let Some(found) = self.interior(given)? else { return Ok(last) };
            (active, inside) = (found, true);
        }
    }

    /// Forces and motions that close the gaps of the active rows.
    fn on_set(&self, active: &[bool], given: &Given) -> Result<Option<(Vec<f64>, Vec<f64>)>> {
        let rows: Vec<usize> = (0..active.len()).filter(|&j| active[j]).collect();
        let Some(face) = self.face(rows)? else { return Ok(None) };
        let (mut x, mut alpha) = (vec![0.0; active.len()], given.alpha.to_vec());
        let mut before = f64::INFINITY;
        for _ in 0..REFINEMENTS {
            let y = self.gaps(&x, &alpha, given.gap)?;
            let missing = self.missing(&x, &alpha, given.work);
            let r: Vec<f64> = face.active.iter().map(|&j| -y[j]).collect();
            let (dx, da) = self.correct(&face, r, &missing)?;
            let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
            face.active.iter().zip(&dx).for_each(|(&j, d)| x[j] += d);
            std::iter::zip(&mut alpha, &da).for_each(|(a, d)| *a += d);
            let change = size(&dx) / size(&x);
            // No smaller any more: round-off. Not a number: of no use.
            if change.is_nan() || change <= f64::EPSILON || change > 0.5 * before {
                break;
            }
            before = change;
        }
        Ok(all_finite(x.iter().chain(&alpha)).then_some((x, alpha)))
    }

    /// The stiffened system of the active rows; `None` if it cannot be factorised, as with entries that are no numbers.
    pub fn face(&self, active: Vec<usize>) -> Result<Option<Face>> {
        let Some(factor) = self.a.principal(&active).into_cholesky(STIFFENED)? else { return Ok(None) };
        self.factorised(active, factor)
    }

    fn factorised(&self, active: Vec<usize>, factor: Cholesky) -> Result<Option<Face>> {
        let on_active: Vec<Vec<f64>> =
            self.modes.iter().map(|mode| active.iter().map(|&j| mode[j]).collect()).collect();
        let mut answers = on_active.clone();
        answers.iter_mut().try_for_each(|mode| factor.solve(mode))?;
        let m = self.modes.len();
        let mut coarse = DMatrix::from_fn(m, m, |k, l| {
            0.5 * (dot(&on_active[k], &answers[l]) + dot(&on_active[l], &answers[k]))
        });
        let seen: Vec<f64> = self.modes.iter().map(|mode| dot(mode, mode)).collect();
        // A spin that rows see by round-off only must not weigh less than that.
        let least = UNSEEN * largest(&seen);
        for (k, seen) in seen.into_iter().enumerate() {
            let all = larger(seen, least);
            // A spring need only be kept above the round-off of the rest.
            let added = if self.stiffness[k] > 0.0 { NONE } else { STIFFENED };
            let held = self.stiffness[k] + added * all;
            coarse[(k, k)] += if held > 0.0 { held } else { 1.0 };
        }
        let coarse = nalgebra::Cholesky::new(coarse);
        Ok(coarse.map(|coarse| Face { active, factor, answers, coarse }))
    }

    /// Corrections of the active forces and of the motions for residuals of the gaps and of equilibrium.
    pub fn correct(&self, face: &Face, mut r: Vec<f64>, missing: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        face.factor.solve(&mut r)?;
        let pushed =
            self.modes.iter().map(|mode| face.active.iter().zip(&r).map(|(&j, r)| mode[j] * r).sum::<f64>());
        let rest = DVector::from_iterator(missing.len(), std::iter::zip(missing, pushed).map(|(m, p)| m - p));
        let alpha = face.coarse.solve(&rest);
        for (alpha, answer) in std::iter::zip(&alpha, &face.answers) {
            std::iter::zip(&mut r, answer).for_each(|(r, z)| *r += alpha * z);
        }
        Ok((r, alpha.as_slice().to_vec()))
    }

    /// A x + g - Z alpha.
    fn gaps(&self, x: &[f64], alpha: &[f64], gap: &[f64]) -> Result<Vec<f64>> {
        let mut y = self.a.times(x)?;
        std::iter::zip(&mut y, gap).for_each(|(y, g)| *y += g);
        for (alpha, mode) in std::iter::zip(alpha, &self.modes) {
            std::iter::zip(&mut y, mode).for_each(|(y, z)| *y -= alpha * z);
        }
        Ok(y)
    }

    /// e - Z'x - K alpha.
    fn missing(&self, x: &[f64], alpha: &[f64], work: &[f64]) -> Vec<f64> {
        (0..work.len()).map(|k| work[k] - dot(&self.modes[k], x) - self.stiffness[k] * alpha[k]).collect()
    }

    /// Rows in tension leave, rows that penetrate enter.
    fn next_set(&self, active: &[bool], x: &[f64], alpha: &[f64], gap: &[f64]) -> Result<Vec<bool>> {
        let elastic = self.a.times(x)?;
        let mut next = active.to_vec();
        for pair in &self.pairs {
            let rigid = |j: usize| std::iter::zip(alpha, &self.modes).map(move |(a, mode)| a * mode[j]);
            let [force, approach] = [x, &elastic].map(|v| largest(&v[pair.clone()]));
            for j in pair.clone() {
                let moved: f64 = rigid(j).sum();
                let y = elastic[j] + gap[j] - moved;
                let parts = gap[j].abs() + rigid(j).map(f64::abs).sum::<f64>();
                next[j] = match active[j] {
                    true => x[j] >= -NONE * force,
                    false => y < -(NONE * approach + SUM * parts),
                };
            }
        }
        Ok(next)
    }

    /// The active set by an interior-point method.
    fn interior(&self, given: &Given) -> Result<Option<Vec<bool>>> {
        let n = self.a.n();
        let mean = |v: &[f64]| v.iter().map(|v| v.abs()).sum::<f64>() / n as f64;
        let mut alpha = given.alpha.to_vec();
        let x_size = mean(given.force);
        if x_size == 0.0 {
            return Ok(None);
        }
        let y_size = mean(&self.gaps(given.force, &alpha, given.gap)?) + x_size;
        let mut x: Vec<f64> = given.force.iter().map(|f| larger(*f, x_size)).collect();
        let mut y = self.gaps(&x, &alpha, given.gap)?;
        y.iter_mut().for_each(|y| *y = larger(*y, y_size));
        let first = dot(&x, &y);
        for _ in 0..INTERIOR_ITERATIONS {
            let product = dot(&x, &y);
            if product.is_nan() || product <= SEPARATED * first {
                break;
            }
            let ratio: Vec<f64> = std::iter::zip(&x, &y).map(|(x, y)| y / x + STIFFENED).collect();
            let Some(factor) = self.a.clone().add_diagonal(&ratio).into_cholesky(0.0)? else { break };
            let Some(face) = self.factorised((0..n).collect(), factor)? else { break };
            let gaps = self.gaps(&x, &alpha, given.gap)?;
            let missing = self.missing(&x, &alpha, given.work);
            // x y + x dy + y dx = target.
            let step = |target: &[f64]| -> Result<[Vec<f64>; 3]> {
                let r = (0..n).map(|j| target[j] / x[j] - gaps[j]).collect();
                let (dx, da) = self.correct(&face, r, &missing)?;
                let dy = (0..n).map(|j| (target[j] - y[j] * dx[j]) / x[j] - y[j]).collect();
                Ok([dx, dy, da])
            };
            let reach = |v: &[f64], d: &[f64]| {
                let ratios = std::iter::zip(v, d).filter(|(_, d)| **d < 0.0).map(|(v, d)| -v / d);
                ratios.fold(1.0 / INSIDE, smaller)
            };
            let [dx, dy, _] = step(&vec![0.0; n])?;
            let [sx, sy] = [smaller(reach(&x, &dx), 1.0), smaller(reach(&y, &dy), 1.0)];
            let ahead: f64 = (0..n).map(|j| (x[j] + sx * dx[j]) * (y[j] + sy * dy[j])).sum();
            let centre = (ahead / product).powi(3) * product / n as f64;
            let target: Vec<f64> = (0..n).map(|j| centre - dx[j] * dy[j]).collect();
            let [dx, dy, da] = step(&target)?;
            // One length for both: alpha belongs to x and to y.
            let length = INSIDE * smaller(reach(&x, &dx), reach(&y, &dy));
            if length.is_nan() {
                break;
            }
            for (v, d) in [(&mut x, &dx), (&mut y, &dy), (&mut alpha, &da)] {
                std::iter::zip(v.iter_mut(), d).for_each(|(v, d)| *v += length * d);
            }
        }
        Ok(all_finite(x.iter().chain(&y)).then(|| (0..n).map(|j| x[j] / x_size > y[j] / y_size).collect()))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    std::iter::zip(a, b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compliance like that of a half-plane, of `n` rows on [-1, 1], and their places.
    fn half_plane(n: usize) -> (Symmetric, Vec<f64>) {
        let x: Vec<f64> = (0..n).map(|i| -1.0 + 2.0 * i as f64 / (n - 1) as f64).collect();
        let at = |i: usize, j: usize| 1.0 - 0.2 * ((x[i] - x[j]).abs() + 0.7 / n as f64).ln();
        let a = (0..n * n).map(|k| at(k / n, k % n)).collect();
        (Symmetric::from_lower_rows(n, a), x)
    }

    /// Deflections of a cantilever of length 1 under forces along it, and a little denting.
    fn cantilever(n: usize) -> Symmetric {
        let x = |i: usize| (i + 1) as f64 / n as f64;
        let at = |i: usize, j: usize| {
            let (short, long) = (x(i).min(x(j)), x(i).max(x(j)));
            short * short * (3.0 * long - short) + if i == j { 1e-3 } else { 0.0 }
        };
        Symmetric::from_lower_rows(n, (0..n * n).map(|k| at(k / n, k % n)).collect())
    }

    fn is_solution(q: &Quadratic, given: &Given, found: &Answer) {
        let y = q.gaps(&found.force, &found.alpha, given.gap).unwrap();
        let elastic = largest(&q.a.times(&found.force).unwrap());
        for (x, y) in std::iter::zip(&found.force, &y) {
            assert!(*x >= -1e-10 * largest(&found.force) && *y >= -1e-10 * elastic, "{x} {y}");
            assert!(x.abs() <= 1e-10 * largest(&found.force) || y.abs() <= 1e-10 * elastic, "{x} {y}");
        }
        let missing = q.missing(&found.force, &found.alpha, given.work);
        assert!(largest(&missing) <= 1e-10 * larger(largest(given.work), 1.0), "{missing:?}");
    }

    fn problem(a: Symmetric, modes: Vec<Vec<f64>>) -> Quadratic {
        let (n, stiffness) = (a.n(), vec![0.0; modes.len()]);
        Quadratic { a, modes, stiffness, pairs: Vec::from([Range { start: 0, end: n }]), interior: true }
    }

    #[test]
    fn a_body_held_by_contact_alone_is_in_equilibrium() {
        let (a, x) = half_plane(61);
        let gap: Vec<f64> = x.iter().map(|x| x * x).collect();
        let q = problem(a, vec![vec![1.0; 61], x.clone()]);
        let given = Given { gap: &gap, work: &[0.3, 0.01], force: &[0.3 / 61.0; 61], alpha: &[0.0; 2] };
        let found = q.solve(&given).unwrap().unwrap();
        is_solution(&q, &given, &found);
        assert!(found.active.iter().any(|a| *a) && !found.active.iter().all(|a| *a));
    }

    #[test]
    fn the_interior_point_method_finds_the_set() {
        for (a, bend) in [(half_plane(60).0, 1.0), (cantilever(60), -0.4)] {
            let gap: Vec<f64> = (0..60).map(|i| bend * (i as f64 / 59.0 - 0.6).powi(2) - 0.05).collect();
            let start: Vec<f64> = gap.iter().map(|g| larger(-g, 0.0)).collect();
            let q = problem(a, Vec::new());
            let given = Given { gap: &gap, work: &[], force: &start, alpha: &[] };
            let found = q.solve(&given).unwrap().unwrap();
            is_solution(&q, &given, &found);
            assert_eq!(q.interior(&given).unwrap().unwrap(), found.active);
        }
    }

    #[test]
    fn what_nothing_determines_stays_small() {
        // Each row twice: the sum of the two forces is determined, and a motion that no row sees is not.
        let (half, x) = half_plane(20);
        let a = Symmetric::from_lower_rows(40, (0..1600).map(|k| half.at(k / 40 / 2, k % 40 / 2)).collect());
        let gap = vec![-0.1; 40];
        let q = problem(a, vec![vec![0.0; 40]]);
        let given = Given { gap: &gap, work: &[0.0], force: &[1.0; 40], alpha: &[0.0] };
        let found = q.solve(&given).unwrap().unwrap();
        is_solution(&q, &given, &found);
        let one = problem(half, Vec::new());
        let given = Given { gap: &gap[..x.len()], work: &[], force: &[1.0; 20], alpha: &[] };
        let once = one.solve(&given).unwrap().unwrap();
        // Round-off of A x, divided by what has to drown it.
        let round_off = f64::EPSILON * largest(&found.force) * 40.0 * 2.0 / STIFFENED;
        for (i, force) in once.force.iter().enumerate() {
            for found in &found.force[2 * i..2 * i + 2] {
                assert!((2.0 * found - force).abs() < round_off, "{found} {force}");
            }
        }
    }

    #[test]
    fn a_spin_that_rows_see_by_round_off_is_left_alone() {
        let (a, x) = half_plane(61);
        let gap: Vec<f64> = x.iter().map(|x| x * x).collect();
        let spin: Vec<f64> = (0..61).map(|j| 1e-17 * (3.0 * j as f64).sin()).collect();
        let q = problem(a, vec![vec![1.0; 61], spin]);
        let given = Given { gap: &gap, work: &[0.3, 0.0], force: &[0.3 / 61.0; 61], alpha: &[0.0; 2] };
        let found = q.solve(&given).unwrap().unwrap();
        is_solution(&q, &given, &found);
    }

    #[test]
    fn what_is_no_number_is_no_answer() {
        let (a, _) = half_plane(10);
        let q = problem(a, Vec::new());
        let given = Given { gap: &[f64::NAN; 10], work: &[], force: &[1.0; 10], alpha: &[] };
        assert!(q.solve(&given).unwrap().is_none());
    }
}
