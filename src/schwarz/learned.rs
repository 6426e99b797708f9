//! The compliance of bodies that answer by their solver, learned from their answers.
//!
//! No matrix of such a body is at hand, and a product with it is an alternation. What is known beforehand is how a half-plane of its
//! modulus gives way: forces at a distance r move its surface by 2 / (pi E') ln(L / r) each (Flamant; Johnson, Contact
//! Mechanics, 2.3), pressures and tractions alike. Every true answer y = F x is then learned in the manner of Broyden, Fletcher, Goldfarb
//! and Shanno,
//!
//!   A <- A - A s (A s)' / (s'A s) + y y' / (s'y),
//!
//! with s conjugate to all directions before it, so that A stays exact for all forces that have been tried, symmetric and positive definite.
use super::{Coupling, PairRows, Respond};
use crate::{
    error::Result,
    petsc::Symmetric,
    vector::{larger, smaller},
};
use std::f64::consts::PI;

/// A direction that does less than this share of the work of the forces is known but for round-off by those before it.
const NOTHING_NEW: f64 = 1e-22;

/// Directions that were tried, conjugate to each other: forces, what they push the rows inwards, and the work of the one on the other.
#[derive(Default)]
pub(super) struct Learned {
    directions: Vec<(Vec<f64>, Vec<f64>, f64)>,
}

impl Learned {
    /// A with what the forces `x` do, y = F x.
    pub fn learn(&mut self, a: Symmetric, x: &[f64], y: &[f64]) -> Result<Symmetric> {
        let (mut s, mut t) = (x.to_vec(), y.to_vec());
        let all = dot(x, y);
        // Twice, for round-off.
        for _ in 0..2 {
            for (p, q, work) in &self.directions {
                let share = dot(q, &s) / work;
                std::iter::zip(&mut s, p).for_each(|(s, p)| *s -= share * p);
                std::iter::zip(&mut t, q).for_each(|(t, q)| *t -= share * q);
            }
        }
        let work = dot(&s, &t);
        let of_a = a.times(&s)?;
        let known = dot(&s, &of_a);
        let is_new = work > NOTHING_NEW * all && known > 0.0;
        if !is_new {
            return Ok(a);
        }
        let a = a.add_outer(-1.0 / known, &[of_a])?.add_outer(1.0 / work, std::slice::from_ref(&t))?;
        self.directions.push((s, t, work));
        Ok(a)
    }
}

/// Adds to F what half-planes in place of the bodies without a compliance at hand would give. `missing`: of each pair, whether that is so
/// of the multiplier side and of the mortar side; `first`: where its rows begin. Collective on the roots.
pub(super) fn add_half_planes<B: Respond>(
    f: &mut [f64],
    coupling: &Coupling<B>,
    rows: &[PairRows],
    missing: &[[bool; 2]],
    first: &[usize],
) {
    let n = first.last().copied().unwrap_or(0);
    let mut base = vec![0.0; n * n];
    for (end, rows) in std::iter::zip(coupling.ends, rows).filter(|(end, _)| end.multiplier) {
        let at = first[end.pair];
        let own = match rows.compliance_ratio.is_finite() {
            true => rows.compliance_ratio / (1.0 + rows.compliance_ratio),
            false => 1.0,
        };
        for side in (0..2).filter(|&side| missing[end.pair][side]) {
            let compliance = 2.0 / (PI * rows.stiffness) * [own, 1.0 - own][side];
            for block in 0..rows.gap.len() / rows.n_normal().max(1) {
                let begin = block * rows.n_normal();
                let gives = |k: &usize| !rows.held.get(begin + *k).is_some_and(|held| held[side]);
                let nodes: Vec<usize> = (0..rows.n_normal()).filter(gives).collect();
                for (i, j, kernel) in half_plane(&rows.along, &nodes) {
                    base[(at + begin + i) * n + at + begin + j] += compliance * kernel;
                }
            }
        }
    }
    std::iter::zip(f, coupling.exchange.sum(&base)).for_each(|(f, base)| *f += base);
}

/// ln(L / r) of each two of the `nodes` at the places `along`; of a node with itself that of the mean over its share of the surface.
fn half_plane(along: &[f64], nodes: &[usize]) -> Vec<(usize, usize, f64)> {
    let mut order = nodes.to_vec();
    order.sort_by(|&i, &j| along[i].total_cmp(&along[j]));
    let places: Vec<f64> = order.iter().map(|&i| along[i]).collect();
    let extent = places.last().copied().unwrap_or(0.0) - places.first().copied().unwrap_or(0.0);
    // As far away as nothing is moved; one node has nothing to be measured by.
    let length = if extent > 0.0 { 2.0 * extent } else { 1.0 };
    let share = |k: usize| {
        let [before, after] = [places[k.saturating_sub(1)], places[(k + 1).min(places.len() - 1)]];
        let parts = usize::from(k > 0) + usize::from(k + 1 < places.len());
        let share = (after - before) / parts.max(1) as f64;
        if share > 0.0 { share } else { length }
    };
    let mut entries = Vec::with_capacity(nodes.len().pow(2));
    for (k, &i) in order.iter().enumerate() {
        // The mean over a share h of ln(L / r), r from its middle.
        entries.push((i, i, (2.0 * length / share(k)).ln() + 1.0));
        for (l, &j) in order.iter().enumerate().take(k) {
            // Nodes at the same place are as far apart as they are wide.
            let r = larger(places[k] - places[l], 0.25 * smaller(share(k), share(l)));
            let kernel = (length / r).ln();
            entries.extend([(i, j, kernel), (j, i, kernel)]);
        }
    }
    entries
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    std::iter::zip(a, b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever A was, after as many independent forces as there are rows it is F; before, it is F on all that were tried.
    #[test]
    fn what_was_tried_is_known_exactly() {
        let n = 6;
        let f = |i: usize, j: usize| if i == j { 3.0 + i as f64 } else { 1.0 / (1.0 + i.abs_diff(j) as f64) };
        let dense = |of: &dyn Fn(usize, usize) -> f64| {
            Symmetric::from_lower_rows(n, (0..n * n).map(|k| of(k / n, k % n)).collect())
        };
        let (truth, mut a) = (dense(&f), dense(&|i, j| if i == j { 0.2 } else { 0.0 }));
        let tried: Vec<Vec<f64>> =
            (0..n).map(|k| (0..n).map(|i| ((i * i + 3 * k + i * k) % 7) as f64 + 1.0).collect()).collect();
        let mut learned = Learned::default();
        for k in 0..n {
            a = learned.learn(a, &tried[k], &truth.times(&tried[k]).unwrap()).unwrap();
            for x in &tried[..=k] {
                let (of_a, of_f) = (a.times(x).unwrap(), truth.times(x).unwrap());
                std::iter::zip(of_a, of_f).for_each(|(a, f)| assert!((a - f).abs() < 1e-10, "{a} {f}"));
            }
            assert!(a.cholesky().unwrap().is_some());
        }
        // The same once more tells nothing.
        let before = a.times(&tried[0]).unwrap();
        a = learned.learn(a, &tried[0], &truth.times(&tried[0]).unwrap()).unwrap();
        assert_eq!(a.times(&tried[0]).unwrap(), before);
    }

    #[test]
    fn a_half_plane_is_positive_definite() {
        let nodes: Vec<usize> = (0..40).collect();
        // As dense everywhere, four times as dense in one half, and ever denser.
        let halves = |i: f64| if i < 20.0 { 0.1 * i } else { 2.0 + 0.025 * (i - 20.0) };
        for place in [&|i: f64| i, &halves, &|i: f64| 1.2_f64.powf(i)] as [&dyn Fn(f64) -> f64; 3] {
            let along: Vec<f64> = (0..40).map(|i| place(i as f64)).collect();
            let mut a = vec![0.0; 1600];
            half_plane(&along, &nodes).into_iter().for_each(|(i, j, kernel)| a[i * 40 + j] = kernel);
            assert!(Symmetric::from_lower_rows(40, a).cholesky().unwrap().is_some());
        }
    }
}
