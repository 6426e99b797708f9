//! How an alternation ends, and the watch that recognises an end that is no convergence.
use serde::Serialize;
use std::collections::HashMap;

/// Why a run ended. The list is closed: scripts rely on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// Displacements and forces agree on a contact set that no longer changes.
    Converged,
    /// The bodies do not touch, and nothing penetrates.
    Open,
    /// The case has no contact pair.
    NoContact,
    /// The contact set became empty although the bodies penetrate without contact forces.
    Emptied,
    /// The same contact sets return without progress.
    Cycling,
    /// The displacement jump grows.
    Diverging,
    /// The displacement jump no longer decreases.
    Stalled,
    /// The iterates are at rest, but the two sides' displacements or forces do not agree.
    Unbalanced,
    /// Nodes outside the search distance penetrate.
    Penetration,
    /// The iteration limit was reached.
    MaxAlternations,
}

impl Reason {
    /// True if the result may be used.
    pub fn converged(self) -> bool {
        matches!(self, Reason::Converged | Reason::Open | Reason::NoContact)
    }

    /// One sentence: what happened and what to do.
    pub fn explanation(self) -> &'static str {
        match self {
            Reason::Converged => "displacements and forces of the two sides agree",
            Reason::Open => "the bodies do not touch",
            Reason::NoContact => "no contact pair: one linear solve per body",
            Reason::Emptied => {
                "the contact emptied while the bodies still penetrate: \
                 use weights = \"response\", or check supports and gap"
            }
            Reason::Cycling => {
                "the same contact sets return for ever: \
                 use weights = \"response\", refine the contact zone, or check the gap"
            }
            Reason::Diverging => {
                "the displacement jump grows: \
                 this weight does not suit the bodies' stiffness ratio; use weights = \"response\" or \"stiffness\""
            }
            Reason::Stalled => {
                "the displacement jump no longer decreases: \
                 no weight of this kind suits all interface modes; try weights = \"stiffness\""
            }
            Reason::Unbalanced => {
                "the iterates are at rest, but the two sides do not agree: \
                 the pointwise transfer needs nodes that match across the interface"
            }
            Reason::Penetration => "nodes further apart than search_distance penetrate: increase it",
            Reason::MaxAlternations => "the iteration limit was reached: increase max_alternations",
        }
    }
}

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
        let smallest = self.jumps.iter().copied().fold(f64::INFINITY, f64::min);
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
            let least = |jumps: &[f64]| jumps.iter().copied().fold(f64::INFINITY, f64::min);
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
