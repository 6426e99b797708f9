//! The way from one load step to the next, and how it is divided into increments.
use super::state::{NodeState, PairState, State};
use crate::{
    body::LoadFactors,
    case::{Increments, PathCase, StepCase},
    contact::Coefficients,
    parallel,
    schwarz::Touch,
    vector::{larger, ratio, smaller},
};
use mpi::topology::SimpleCommunicator;
use std::collections::HashMap;

/// An increment that fails is halved, and its halves again, but no further than to this share of it: four halvings show
/// whether smaller ones help, and cost no more than a few increments.
const LEAST: f64 = 1.0 / 16.0;

/// Least share of the way that an automatic increment has: it may have to follow the contact.
const LEAST_AUTOMATIC: f64 = 1.0 / 64.0;

/// Least share of the way that is tried where a body that friction holds begins to slide: the load at which it does is known to
/// a millionth.
pub(super) const LEAST_SLIDING: f64 = 1.0 / (1 << 21) as f64;

/// Least share of the way that is tried where bodies that yield find no equilibrium: the limit load is known to a thousandth.
pub(super) const LEAST_COLLAPSING: f64 = 1.0 / 2048.0;

/// Share of a pair's candidates that may open or close in an automatic increment.
const TURNOVER: f64 = 0.2;

/// Share up to which the next increment is twice as large: what twice the increment may turn over.
const EASE: f64 = 0.5 * TURNOVER;

/// Change of the tangential forces, relative to what they would be at the end of the step, that dividing an increment in two may make.
pub(super) const DEPENDS: f64 = 0.01;

/// What a change of the work of friction counts beside one of the tangential forces: it is of first order in the increments.
const WORK: f64 = 0.1;

/// Change of the normal forces, relative to the largest, below which they are the same: a tenth of what [`DEPENDS`] looks for.
const STEADY: f64 = 0.1 * DEPENDS;

/// Shares of the way that differ by less are the same.
const SAME: f64 = 1e-9;

/// The factors between the end of one step and that of the next.
pub(super) struct Way<'c> {
    from: LoadFactors,
    to: LoadFactors,
    paths: &'c [PathCase],
}

impl<'c> Way<'c> {
    pub fn new(from: &LoadFactors, step: &StepCase, paths: &'c [PathCase]) -> Way<'c> {
        Way { from: from.clone(), to: step.into(), paths }
    }

    /// The factors after a share of the way; at its end those of the step, to the last bit.
    pub fn at(&self, share: f64) -> LoadFactors {
        if share >= 1.0 {
            return self.to.clone();
        }
        let mut factors = self.from.toward(&self.to, share);
        for (factor, path) in std::iter::zip(&mut factors.paths, self.paths) {
            if let Some(table) = &path.table {
                *factor = table.at(factors.at);
            }
        }
        factors
    }

    /// Shares of the way at which a table has a row, where the factors may turn.
    fn rows(&self) -> Vec<f64> {
        let length = self.to.at - self.from.at;
        let all = self.paths.iter().filter_map(|path| path.table.as_ref()).flat_map(|table| &table.at);
        let mut shares: Vec<f64> = all.map(|at| (at - self.from.at) / length).collect();
        shares.retain(|share| *share > SAME && *share < 1.0 - SAME);
        shares.sort_by(f64::total_cmp);
        shares.dedup_by(|a, b| *a - *b < SAME);
        shares
    }
}

/// How far along the way of a step the increments have come, and how large the next one is; all in shares of the way.
pub(super) struct Pace {
    done: f64,
    size: f64,
    largest: f64,
    least: f64,
    /// Where an increment has to end, increasing up to 1.
    stops: Vec<f64>,
    automatic: bool,
}

impl Pace {
    /// `divisible`: an increment that fails is tried in parts.
    pub fn new(increments: Increments, way: &Way, divisible: bool) -> Pace {
        let (largest, least, mut stops) = match increments {
            Increments::Equal(n) => {
                let stops = (1..n).map(|k| k as f64 / n as f64).collect();
                (1.0 / n as f64, LEAST / n as f64, stops)
            }
            Increments::Automatic => (1.0, LEAST_AUTOMATIC, way.rows()),
        };
        stops.push(1.0);
        let least = if divisible { least } else { largest };
        Pace {
            done: 0.0,
            size: largest,
            largest,
            least,
            stops,
            automatic: increments == Increments::Automatic,
        }
    }

    /// Half of the way to `reached`.
    pub fn middle(&self, reached: f64) -> f64 {
        0.5 * (self.done + reached)
    }

    /// Where the next increment ends, exactly 1 at the end of the way; `None` after that.
    pub fn next(&self) -> Option<f64> {
        let stop = self.stops.iter().copied().find(|stop| *stop > self.done)?;
        let reached = self.done + self.size;
        Some(if reached > stop - SAME.min(0.1 * self.size) { stop } else { reached })
    }

    /// Makes the increment half as large; false if that is too small. `reached`: where it was to end.
    pub fn halve(&mut self, reached: f64) -> bool {
        self.halve_down_to(self.least, reached)
    }

    /// The same with another least size.
    pub fn halve_down_to(&mut self, least: f64, reached: f64) -> bool {
        let half = 0.5 * (reached - self.done);
        let possible = half >= least * (1.0 - SAME);
        if possible {
            self.size = half;
        }
        possible
    }

    /// True if increments follow the contact.
    pub fn is_automatic(&self) -> bool {
        self.automatic
    }

    /// True if so much of the contact has turned over that the increment is to be [halved](Pace::halve).
    pub fn is_too_large(&self, turnover: f64) -> bool {
        self.automatic && turnover > TURNOVER
    }

    /// Takes an increment; what went well may go on in larger ones.
    pub fn accept(&mut self, reached: f64, turnover: f64) {
        self.done = reached;
        if !self.automatic || turnover <= EASE {
            self.size = larger(self.size, (2.0 * self.size).min(self.largest));
        }
    }
}

/// Largest share of a pair's candidates whose status has changed, of pairs that were in contact before. A single node is
/// none: no smaller increment makes less of it. Collective.
pub(super) fn turnover(before: &[PairState], after: &[PairState], world: &SimpleCommunicator) -> f64 {
    let of_pair = |pair: &PairState| {
        let old = before.iter().find(|old| (old.pair, old.side) == (pair.pair, pair.side))?;
        let touched = old.nodes.iter().any(|node| node.status != Touch::Open);
        let old: HashMap<u32, Touch> = old.nodes.iter().map(|node| (node.node, node.status)).collect();
        let was = |node: &NodeState| old.get(&node.node).copied().unwrap_or(Touch::Open);
        let changed = pair.nodes.iter().filter(|node| node.status != was(node)).count();
        (touched && changed > 1).then(|| changed as f64 / pair.nodes.len() as f64)
    };
    let own = after.iter().filter_map(of_pair).fold(0.0, larger);
    parallel::max(world, &[own])[0]
}

/// [`turnover`] and what dividing an increment changes, as one number to pace by.
pub(super) fn pace_by(turnover: f64, depends: f64) -> f64 {
    larger(turnover, TURNOVER * depends / DEPENDS)
}

/// True if nodes slip while normal forces, or what bounds the tangential ones by them, change: then the tangential forces depend on the way. Collective.
pub(super) fn depends_on_way(before: &[PairState], after: &[PairState], world: &SimpleCommunicator) -> bool {
    let old = State::nodes(before);
    // Whether any slips, the largest change of a normal force, or of what a coefficient makes of it, and the largest normal force.
    let mut most = [0.0_f64; 3];
    for pair in after {
        for node in &pair.nodes {
            let old = old.get(&(pair.pair, pair.side, node.node));
            let varied = varied(old.and_then(|old| old.coefficients), node.coefficients) * node.force.abs();
            let change = (node.force - old.map_or(0.0, |old| old.force)).abs();
            let slips = f64::from(u8::from(node.status.slips().is_some()));
            let own = [slips, larger(change, varied), node.force.abs()];
            std::iter::zip(&mut most, own).for_each(|(most, own)| *most = larger(*most, own));
        }
    }
    let [slips, change, force] = parallel::max(world, &most)[..] else { return false };
    slips > 0.0 && change > STEADY * force
}

/// The largest change of a coefficient, relative.
fn varied(before: Option<Coefficients>, now: Option<Coefficients>) -> f64 {
    let change = |(a, b): (f64, f64)| if a == b { 0.0 } else { (b - a).abs() / larger(a, b) };
    let pairs = before.into_iter().flatten().zip(now.into_iter().flatten());
    pairs.map(change).fold(0.0, larger)
}

/// What dividing an increment changes, relative.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Change {
    /// Norm of the difference of the tangential forces over that of the forces.
    pub forces: f64,
    /// Difference of the works of friction over the smaller of both. What a node travels before it touches is no slip, but counts as
    /// such in the increment in which it does: that shows here.
    pub work: f64,
}

impl Change {
    /// The same of the share of a step that an increment is.
    pub fn of_share(self, share: f64) -> Change {
        Change { forces: share * self.forces, work: share * self.work }
    }

    /// Both as one number, to be compared with [`DEPENDS`].
    pub fn depends(self) -> f64 {
        larger(self.forces, WORK * self.work)
    }
}

/// From the state `from` to `a` in one increment and to `b` in two. Collective.
pub(super) fn change(from: &[PairState], [a, b]: [&[PairState]; 2], world: &SimpleCommunicator) -> Change {
    let other = State::nodes(b);
    let mut sums = [0.0; 4];
    for pair in a {
        for node in &pair.nodes {
            let other = other.get(&(pair.pair, pair.side, node.node)).map_or(0.0, |other| other.tangential);
            sums[0] += (node.tangential - other).powi(2);
            sums[1] += node.tangential.powi(2);
        }
    }
    let work = |pairs: &[PairState]| pairs.iter().map(|pair| pair.dissipated).sum::<f64>();
    (sums[2], sums[3]) = (work(a) - work(from), work(b) - work(from));
    let sums = parallel::sum(world, &sums);
    let work = ratio((sums[2] - sums[3]).abs(), smaller(sums[2], sums[3]));
    Change { forces: ratio(sums[0], sums[1]).sqrt(), work }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::PathTable;

    fn way(paths: &[PathCase], at: f64) -> Way<'_> {
        let step = StepCase {
            loads: 0.3,
            at,
            paths: paths.iter().map(|path| path.table.as_ref().map_or(0.7, |t| t.at(at))).collect(),
            ..StepCase::whole()
        };
        Way::new(&LoadFactors { loads: 0.1, ..LoadFactors::NONE }, &step, paths)
    }

    fn table(at: &[f64], factor: &[f64]) -> PathCase {
        let table = Some(PathTable { at: at.to_vec(), factor: factor.to_vec() });
        PathCase { name: "p".into(), table, origin: Default::default() }
    }

    /// The ends of the increments that all succeed, with this turnover.
    fn ends(mut pace: Pace, turnover: f64) -> Vec<f64> {
        let mut ends = Vec::new();
        while let Some(reached) = pace.next() {
            ends.push(reached);
            pace.accept(reached, turnover);
        }
        ends
    }

    #[test]
    fn factors_go_straight_and_tables_are_followed() {
        let given = PathCase { table: None, ..table(&[], &[]) };
        let paths = [table(&[0.0, 1.0, 3.0], &[0.5, 1.0, -1.0]), given];
        let way = way(&paths, 2.0);
        let half = way.at(0.5);
        assert!((half.loads - 0.2).abs() < 1e-15 && half.at == 1.0);
        assert_eq!(half.paths, [1.0, 0.35]);
        assert_eq!(way.at(0.25).paths, [0.75, 0.175]);
        assert_eq!(way.at(1.0), way.to);
        assert_eq!(way.rows(), [0.5]);
    }

    #[test]
    fn equal_increments_end_on_their_shares() {
        for n in [1, 2, 3, 7, 10, 97] {
            let expected: Vec<f64> = (1..=n).map(|k| k as f64 / n as f64).collect();
            let pace = || Pace::new(Increments::Equal(n), &way(&[], 0.0), true);
            assert_eq!(ends(pace(), 1.0), expected);
            // One that fails is halved four times at most, and what follows ends on the shares again.
            let mut pace = pace();
            let reached = |pace: &Pace| pace.next().unwrap();
            let halvings = (0..9).take_while(|_| pace.halve(reached(&pace))).count();
            assert_eq!(halvings, 4);
            let found = ends(pace, 1.0);
            assert!(expected.iter().all(|end| found.contains(end)), "{found:?}");
            assert_eq!(found.len(), n + 4, "{found:?}");
        }
        let mut whole = Pace::new(Increments::Equal(1), &way(&[], 0.0), false);
        assert!(!whole.halve(1.0) && whole.next() == Some(1.0));
    }

    #[test]
    fn automatic_increments_stop_at_the_rows_and_grow_with_ease() {
        let paths = [table(&[0.0, 0.1, 0.7, 9.0], &[0.0, 1.0, 2.0, 3.0]), table(&[0.7, 1.3], &[0.0, 1.0])];
        let way = way(&paths, 2.0);
        let pace = || Pace::new(Increments::Automatic, &way, true);
        assert_eq!(ends(pace(), 0.0), [0.05, 0.35, 0.65, 1.0]);
        let halved = || {
            let mut pace = Pace::new(Increments::Automatic, &self::way(&[], 0.0), true);
            assert!(pace.halve(1.0) && pace.halve(0.5) && pace.halve(0.25));
            pace
        };
        assert_eq!(ends(halved(), EASE), [0.125, 0.375, 0.875, 1.0]);
        assert_eq!(ends(halved(), TURNOVER), (1..=8).map(|k| k as f64 / 8.0).collect::<Vec<_>>());
        let mut pace = pace();
        assert!(pace.is_too_large(0.21) && !pace.is_too_large(0.2));
        // The first row is nearer than twice the least increment is long.
        assert!(pace.halve(0.05) && !pace.halve(0.025));
    }
}
