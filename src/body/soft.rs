//! Soft modes: deformations that take so little force that a compliance would drown all others in their round-off.
//!
//! A foil bends far more easily than it is compressed, and a long chain of slabs is soft as a whole. Such modes go to the
//! coarse space of the interface problem, each with its small stiffness, as rigid modes do with none. Let S be the Schur
//! complement of the interface, G orthonormal force patterns, S_t = S + t G G'. Then S u = f is, exactly,
//!
//!   u = S_t^-1 f + Phi a,   K a = Phi' f,   Phi = S_t^-1 G (G'S_t^-1 G)^-1,   L = Phi'S Phi,   K = L (t + L) / t,
//!
//! whatever G is; with the softest eigenvectors of S in G nothing in S_t^-1 is large. An L that is round-off of S counts
//! as zero: contact alone holds that mode.
use crate::vector::{larger, symmetric_eigen};
use crate::{
    error::{Error, Result},
    petsc::{Cholesky, Symmetric},
};
use nalgebra::{DMatrix, DVector};

/// Lanczos steps to find the largest compliance: a factor of two is near enough.
const LANCZOS_STEPS: usize = 6;

/// What is left of a unit pattern outside the others below this is nothing of its own.
const OWN: f64 = 1e-3;

/// What to split off.
pub(super) struct Split {
    /// Modes softer than this share of the longest wave of a body as deep as its interface is long.
    pub softness: f64,
    /// Free rigid modes at the interface unknowns.
    pub rigid: Vec<Vec<f64>>,
    /// Interface unknowns that supports and fixings hold.
    pub held: Vec<bool>,
    /// Displacement components of a node.
    pub dim: usize,
}

/// The soft modes at the interface unknowns, in the nodes' frames.
#[derive(Debug, Clone, Default)]
pub(super) struct SoftModes {
    /// Phi, each of largest entry 1.
    pub modes: Vec<Vec<f64>>,
    /// K, N/m, diagonal.
    pub stiffness: Vec<f64>,
}

impl Split {
    /// The factor of S_t, and the modes: of S and none if nothing is soft. `None` if S_t is not positive definite.
    pub fn apply(&self, s: Symmetric) -> Result<Option<(Cholesky, SoftModes)>> {
        let n = s.n();
        let free = || (0..n).filter(|&i| !self.held[i]);
        let count = free().count();
        if count == 0 {
            return Ok(s.into_cholesky(0.0)?.map(|factor| (factor, SoftModes::default())));
        }
        let mean = free().map(|i| s.at(i, i)).sum::<f64>() / count as f64;
        let limit = self.softness * mean * self.dim as f64 / n as f64;
        let plain = s.cholesky()?;
        if let Some(factor) = plain
            && self.largest_compliance(&factor)? * limit <= 1.0
        {
            return Ok(Some((factor, SoftModes::default())));
        }
        let mut patterns = orthonormal(&self.rigid, &[]);
        let n_rigid = patterns.len();
        patterns.append(&mut orthonormal(&s.eigenvectors_below(limit)?, &patterns));
        let patterns = patterns.split_off(n_rigid);
        let t = free().map(|i| s.at(i, i)).fold(0.0, larger);
        let stiffened = s.clone().add_outer(t, &patterns)?;
        let Some(factor) = stiffened.into_cholesky(0.0)? else { return Ok(None) };
        let modes = soft_modes(&s, &factor, &patterns, t)?;
        Ok(Some((factor, modes)))
    }

    /// Of S^-1 on forces that are in equilibrium on the free unknowns, by Lanczos, from below.
    fn largest_compliance(&self, factor: &Cholesky) -> Result<f64> {
        let rigid = orthonormal(&self.rigid, &[]);
        let project = |v: &mut [f64]| {
            std::iter::zip(&mut *v, &self.held).filter(|(_, h)| **h).for_each(|(v, _)| *v = 0.0);
            remove(v, &rigid);
        };
        // No symmetry of a body is one of this vector.
        let mut q: Vec<f64> = (0..factor.n()).map(|i| 1.0 + (i as f64).sin()).collect();
        project(&mut q);
        let (mut diagonal, mut off) = (Vec::new(), vec![0.0]);
        let mut before = vec![0.0; q.len()];
        let mut size = dot(&q, &q).sqrt();
        for k in 0..LANCZOS_STEPS {
            if size == 0.0 {
                break;
            }
            q.iter_mut().for_each(|q| *q /= size);
            let mut w = q.clone();
            factor.solve(&mut w)?;
            project(&mut w);
            diagonal.push(dot(&q, &w));
            for ((w, q), b) in w.iter_mut().zip(&q).zip(&before) {
                *w -= diagonal[k] * q + off[k] * b;
            }
            size = dot(&w, &w).sqrt();
            off.push(size);
            before = std::mem::replace(&mut q, w);
        }
        let m = diagonal.len();
        let t = DMatrix::from_fn(m, m, |i, j| match i.abs_diff(j) {
            0 => diagonal[i],
            1 => off[i.max(j)],
            _ => 0.0,
        });
        Ok(if m == 0 { 0.0 } else { symmetric_eigen(t).ok_or_else(overflown)?.eigenvalues.max() })
    }
}

/// Phi and K of the patterns G.
fn soft_modes(s: &Symmetric, factor: &Cholesky, patterns: &[Vec<f64>], t: f64) -> Result<SoftModes> {
    let (n, m) = (s.n(), patterns.len());
    if m == 0 {
        return Ok(SoftModes::default());
    }
    let mut solved = patterns.concat();
    factor.solve(&mut solved)?;
    let (g, solved) = (DMatrix::from_vec(n, m, patterns.concat()), DMatrix::from_vec(n, m, solved));
    let inner = (g.transpose() * &solved).try_inverse();
    let inner = inner.ok_or_else(|| Error::internal("the soft modes of a body depend on each other"))?;
    let mut phi = solved * inner;
    // Symmetric to round-off; the formulas above turn with an orthogonal change of G.
    let image: Vec<Vec<f64>> = phi.column_iter().map(|c| s.times(c.as_slice())).collect::<Result<_>>()?;
    let stiffness = phi.transpose() * DMatrix::from_vec(n, m, image.concat());
    let eigen = symmetric_eigen(0.5 * (&stiffness + stiffness.transpose())).ok_or_else(overflown)?;
    phi *= &eigen.eigenvectors;
    let round_off = n as f64 * f64::EPSILON * t;
    let mut found = SoftModes::default();
    for (column, &l) in phi.column_iter().zip(&eigen.eigenvalues) {
        let column: DVector<f64> = column.into_owned();
        let l = if l > round_off * column.norm_squared() { l } else { 0.0 };
        let largest = column.amax();
        found.modes.push((column / largest).as_slice().to_vec());
        found.stiffness.push(l * (t + l) / t / (largest * largest));
    }
    Ok(found)
}

fn overflown() -> Error {
    Error::NotFinite(
        "the stiffness of a body against its softest motions is not a finite number: look for a modulus or a size that is \
         out of all proportion"
            .into(),
    )
}

/// An orthonormal basis of what the vectors span outside `others` (Gram-Schmidt, twice).
fn orthonormal(vectors: &[Vec<f64>], others: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for v in vectors {
        let mut v = v.clone();
        let before = dot(&v, &v).sqrt();
        for _ in 0..2 {
            remove(&mut v, others);
            remove(&mut v, &basis);
        }
        let size = dot(&v, &v).sqrt();
        if size > OWN * before && size > 0.0 {
            v.iter_mut().for_each(|v| *v /= size);
            basis.push(v);
        }
    }
    basis
}

/// v less its parts along an orthonormal basis.
fn remove(v: &mut [f64], basis: &[Vec<f64>]) {
    for b in basis {
        let part = dot(v, b);
        std::iter::zip(&mut *v, b).for_each(|(v, b)| *v -= part * b);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    std::iter::zip(a, b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of springs between unknowns, held at one end: soft as a whole.
    fn chain(n: usize) -> Symmetric {
        let mut a = vec![0.0; n * n];
        for i in 0..n {
            a[i * n + i] = if i + 1 < n { 2.0 } else { 1.0 };
            if i > 0 {
                a[i * n + i - 1] = -1.0;
            }
        }
        Symmetric::from_lower_rows(n, a)
    }

    #[test]
    fn the_split_is_exact() {
        let n = 40;
        let s = chain(n);
        for softness in [0.0, 0.5, 4.0] {
            let split = Split { softness, rigid: Vec::new(), held: vec![false; n], dim: 1 };
            let (factor, soft) = split.apply(s.clone()).unwrap().unwrap();
            assert_eq!(soft.modes.is_empty(), softness == 0.0);
            let f: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).cos()).collect();
            let mut u = f.clone();
            factor.solve(&mut u).unwrap();
            for (mode, k) in std::iter::zip(&soft.modes, &soft.stiffness) {
                let a = dot(mode, &f) / k;
                std::iter::zip(&mut u, mode).for_each(|(u, m)| *u += a * m);
            }
            let image = s.times(&u).unwrap();
            std::iter::zip(image, &f)
                .for_each(|(a, b)| assert!((a - b).abs() < 1e-11, "{softness}: {a} {b}"));
        }
    }

    #[test]
    fn what_is_left_is_not_soft() {
        let n = 40;
        let split = Split { softness: 1.0, rigid: Vec::new(), held: vec![false; n], dim: 1 };
        let (factor, soft) = split.apply(chain(n)).unwrap().unwrap();
        let left = split.largest_compliance(&factor).unwrap();
        let before = split.largest_compliance(&chain(n).cholesky().unwrap().unwrap()).unwrap();
        assert!(soft.modes.len() < n / 4 && left < 0.1 * before, "{} {left} {before}", soft.modes.len());
    }
}
