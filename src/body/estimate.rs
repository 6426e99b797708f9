//! Whether condensing a body to its interface is worth it.
use super::options::has_own_solver;
use crate::error::Result;

/// How a body answers contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ResponseKind {
    /// The cheaper of the two by [`condense_estimate`]; by the solver if its PETSc options are the user's.
    #[default]
    Automatic,
    /// By the Schur complement on its interface.
    Condensed,
    /// By its solver.
    Solver,
}

/// Cost of the two ways, in operations at the speed of a sparse factorisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Factorisation with the Schur complement, interface operators, condensation and recovery.
    pub condensed: f64,
    /// Two factorisations (force step, displacement step) and the solves of an alternation.
    pub solver: f64,
    /// Memory of the interface operators of a condensed body, bytes.
    pub bytes: f64,
    /// Memory of the sparse factor, bytes.
    pub factor_bytes: f64,
}

/// Alternations that the estimate reckons with where a body answers by its solver, each of one solve with each matrix: thin
/// and coarse bodies, for which the choice is close, take 130 to 520, condensed ones a few.
const ALTERNATIONS: f64 = 200.0;

/// Interface operators of this size are never in the way, bytes.
const SMALL: f64 = 1e9;

/// A solve moves the factor through memory once each way: an operation of it costs this many of a factorisation's.
const SOLVE_SLOWDOWN: f64 = 10.0;

impl Estimate {
    /// True if condensing is cheaper and takes no more memory than the factor, or little.
    pub fn prefers_condensed(&self) -> bool {
        self.condensed <= self.solver && self.bytes <= self.factor_bytes.max(SMALL)
    }
}

/// Estimates for a body of N = `n_dofs` unknowns, b = `n_interface_dofs` of them on the interface.
///
/// Nested dissection: in 2D the factor has 5 N log2 N entries and takes 56 N^1.5 operations, in 3D 4 N^(4/3) entries
/// and 20 N^2 operations (constants from Cholesky factorisations of two displacements per node, bilinear elements).
/// The Schur complement adds a dense front of b unknowns, b^3 / 3 operations; its own factor takes as many, and
/// the operator of m = b / dim rows b^2 m + b m^2. Condensation and recovery are one solve each.
pub fn condense_estimate(n_dofs: usize, n_interface_dofs: usize, dim: usize) -> Estimate {
    let (n, b) = (n_dofs.max(2) as f64, n_interface_dofs as f64);
    let m = b / dim as f64;
    let (entries, factor) = match dim {
        3 => (4.0 * n.powf(4.0 / 3.0), 20.0 * n * n),
        _ => (5.0 * n * n.log2(), 56.0 * n.powf(1.5)),
    };
    let solve = 4.0 * entries * SOLVE_SLOWDOWN;
    Estimate {
        condensed: factor + 2.0 / 3.0 * b.powi(3) + b * b * m + b * m * m + 2.0 * solve,
        solver: 2.0 * factor + 2.0 * ALTERNATIONS * solve,
        bytes: 8.0 * (2.0 * b * b + b * m + 2.0 * m * m),
        factor_bytes: 8.0 * entries,
    }
}

/// Share of a factorisation of the whole body that one of its zone may take at most: what the zone saves above it goes into condensing the
/// rest whenever it grows. Of ten steps of an indentation with 5 to 77 thousand unknowns (`scripts/bench --only plasticity`, and twice as
/// deep) zones of up to two thirds of the cells were cheaper than the whole, the largest by 5 to 15 %.
const WORTH_IT: f64 = 0.7;

/// Unknowns below which a factorisation is too short for anything to be saved; bodies of 2600 still saved a fifth.
const SMALLEST: usize = 2000;

/// Operations of a dense front take this share of the time of those of many small ones.
const DENSE: f64 = 1.0 / 3.0;

/// Operations, at the speed of a sparse factorisation, of one of a part of a body of N unknowns, b of them on the interface: a `share` of
/// its cells, whose edge, three sides of a square, is dense with what the rest is condensed to.
pub fn zone_estimate(n_dofs: usize, n_interface_dofs: usize, dim: usize, share: f64) -> f64 {
    let (n, b) = (share * n_dofs as f64, n_interface_dofs as f64);
    let edge = 3.0 * dim as f64 * (n / dim as f64).sqrt();
    56.0 * n.powf(1.5) + DENSE / 3.0 * ((b + edge).powi(3) - b.powi(3)) + interface_front(b)
}

/// Operations of a factorisation of the whole body.
pub fn zone_whole(n_dofs: usize, n_interface_dofs: usize) -> f64 {
    56.0 * (n_dofs as f64).powf(1.5) + interface_front(n_interface_dofs as f64)
}

/// The Schur complement on b unknowns and its factor.
fn interface_front(b: f64) -> f64 {
    DENSE * 2.0 / 3.0 * b.powi(3)
}

/// Share of the cells up to which the zone of a body is factorised alone; 0: never.
pub fn largest_zone(n_dofs: usize, n_interface_dofs: usize, dim: usize) -> f64 {
    if n_dofs < SMALLEST {
        return 0.0;
    }
    let whole = zone_whole(n_dofs, n_interface_dofs);
    let pays = |percent: &u32| {
        zone_estimate(n_dofs, n_interface_dofs, dim, 0.01 * f64::from(*percent)) <= WORTH_IT * whole
    };
    0.01 * f64::from((1..=100).take_while(pays).last().unwrap_or(0))
}

impl ResponseKind {
    /// Resolves `Automatic`; a body without interface answers by its solver in any case. Not collective, the same on
    /// all ranks.
    pub fn is_condensed(
        self,
        name: &str,
        n_dofs: usize,
        n_interface_dofs: usize,
        dim: usize,
    ) -> Result<bool> {
        Ok(n_interface_dofs > 0
            && match self {
                ResponseKind::Condensed => true,
                ResponseKind::Solver => false,
                ResponseKind::Automatic => {
                    !has_own_solver(name)?
                        && condense_estimate(n_dofs, n_interface_dofs, dim).prefers_condensed()
                }
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_interface_is_condensed_and_a_dominating_one_is_not() {
        for n in [100, 10_000, 300_000, 3_000_000] {
            let side = (n as f64 / 2.0).sqrt() as usize;
            assert!(condense_estimate(n, 2 * side, 2).prefers_condensed(), "{n}");
        }
        assert!(!condense_estimate(200_000, 60_000, 2).prefers_condensed());
        assert!(!condense_estimate(3_000_000, 200_000, 3).prefers_condensed());
        assert!(condense_estimate(300_000, 3_000, 3).prefers_condensed());
    }

    #[test]
    fn without_interface_there_is_nothing_to_condense() {
        assert!(!ResponseKind::Condensed.is_condensed("b", 100, 0, 2).unwrap());
        assert!(!ResponseKind::Solver.is_condensed("b", 100, 10, 2).unwrap());
    }
}
