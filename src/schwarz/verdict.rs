//! How an alternation ends, and the watch that recognises an end that is no convergence.
use crate::vector::smaller;
use std::collections::HashMap;

pub use crate::record::Reason;

/// Follows the displacement jump and the contact set from one alternation to the next.
#[derive(Debug, Default)]
pub struct Watch {
    floor: f64,
    jumps: Vec<f64>,
    set: u64,
    /// Jump at the last visit to each contact set.
    visits: HashMap<u64, f64>,
    returns_in_vain: usize,
}

/// Alternations over which a jump that does not fall is a stall. The slowest useful contraction is then
/// 0.9^(1/50) = 0.998 an alternation.
const STALL: usize = 50;

/// Returns to a contact set without a smaller jump before it is called a cycle.
const RETURNS: usize = 4;

/// Growth of the jump over its smallest value that is divergence; so is growth over [`GROWING`] alternations in a row.
const GROWTH: f64 = 1e6;
const GROWING: usize = 15;

impl Watch {
    /// A watch; jumps below `floor` are round-off.
    pub fn new(floor: f64) -> Watch {
        Watch { floor, ..Watch::default() }
    }

    /// Takes in one alternation: its absolute displacement jump and a hash of its contact set.
    pub fn observe(&mut self, jump: f64, set: u64) -> Option<Reason> {
        let smallest = self.jumps.iter().copied().fold(f64::INFINITY, smaller);
        self.jumps.push(jump);
        if !jump.is_finite() || jump > GROWTH * smallest.max(self.floor) || self.has_grown() {
            return Some(Reason::Diverging);
        }
        let changed = self.jumps.len() > 1 && set != self.set;
        self.set = set;
        let before = self.visits.insert(set, jump);
        if changed && before.is_some_and(|b| jump > 0.9 * b) {
            self.returns_in_vain += 1;
            if self.returns_in_vain >= RETURNS {
                return Some(Reason::Cycling);
            }
        }
        let n = self.jumps.len();
        if n > STALL {
            let least = |jumps: &[f64]| jumps.iter().copied().fold(f64::INFINITY, smaller);
            let (old, recent) = self.jumps.split_at(n - STALL);
            if least(recent) > 0.9 * least(old) {
                return Some(Reason::Stalled);
            }
        }
        None
    }

    fn has_grown(&self) -> bool {
        let n = self.jumps.len();
        n > GROWING && self.jumps[n - GROWING - 1..].windows(2).all(|w| w[1] > w[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steady_progress_is_left_alone() {
        let mut watch = Watch::default();
        assert!((0..200).all(|i| watch.observe(0.99_f64.powi(i), u64::from(i > 3)).is_none()));
    }

    #[test]
    fn growth_is_divergence() {
        let mut watch = Watch::default();
        let end = (0..100).find_map(|i| watch.observe(1.5_f64.powi(i), 0));
        assert_eq!(end, Some(Reason::Diverging));
        assert_eq!(Watch::default().observe(f64::NAN, 0), Some(Reason::Diverging));
    }

    #[test]
    fn returning_sets_are_a_cycle() {
        let mut watch = Watch::default();
        let end = (0..100).find_map(|i| watch.observe(1.0, i % 3));
        assert_eq!(end, Some(Reason::Cycling));
    }

    #[test]
    fn a_plateau_is_a_stall() {
        let mut watch = Watch::default();
        let end = (0..200).find_map(|i| watch.observe(0.5_f64.powi(i).max(1e-4), 0));
        assert_eq!(end, Some(Reason::Stalled));
    }
}
