//! The contact problem with friction followed from where nothing touches: the gaps are raised by theta times a positive vector,
//! then lowered.
//!
//! Forces and gaps are piecewise linear in theta; at each event one node changes its state, and theta goes on in the direction
//! in which what has just become positive grows: down, or back up where the solution is not unique (a parametric principal
//! pivoting method: Cottle, Pang and Stone, The Linear Complementarity Problem, 2009, sections 4.5 and 5.1). Bodies that only
//! contact holds stand on springs meanwhile, whose forces are then taken off along the same kind of path.
use super::frictional::{Forces, Frictional, Given, Node, Touch};
use crate::{
    error::Result,
    vector::{larger, largest},
};

/// Events after which the path is given up, per node: ten times the usual three.
const EVENTS: usize = 30;

/// Operations after which it is given up: some seconds.
const WORK: f64 = 2e10;

/// A derivative below this share of the largest is none.
const FLAT: f64 = 1e-11;

/// Gaps and loads along a path: `gap` + theta `gap_rate`, `work` + theta `work_rate`.
struct Path<'p> {
    problem: &'p Frictional,
    gap: [&'p [f64]; 2],
    work: [&'p [f64]; 2],
}

/// Forces and gaps.
type Point = (Forces, Vec<f64>);

/// Largest rate of a line.
fn steepest([_, (rates, gaps)]: &[Point; 2]) -> f64 {
    larger(largest(&rates.x), largest(gaps))
}

/// Where a path ended.
enum End {
    /// At theta = 0.
    Arrived(Vec<Touch>),
    /// Theta would grow for ever, or the path was given up.
    Lost,
}

/// What must not become negative of a node: its value at theta and its rate, and the state beyond.
type Limit = (f64, f64, Touch);

impl Frictional {
    /// The states of a solution; `None` if the path has no end.
    pub fn lift(&self, given: &Given) -> Result<Option<Vec<Touch>>> {
        // Free modes stand on springs as stiff as the rows that see them.
        let seen = |mode: &Vec<f64>| mode.iter().map(|z| z * z).sum::<f64>();
        let springs: Vec<f64> = std::iter::zip(&self.stiffness, &self.modes)
            .map(|(k, mode)| if *k > 0.0 { 0.0 } else { larger(seen(mode), f64::MIN_POSITIVE) })
            .collect();
        let mut sprung = self.clone();
        std::iter::zip(&mut sprung.stiffness, &springs).for_each(|(k, s)| *k += s);
        let rate = self.lifted();
        let zero = vec![0.0; given.work.len()];
        let path = Path { problem: &sprung, gap: [given.gap, &rate], work: [given.work, &zero] };
        let states: Vec<Touch> =
            self.nodes.iter().map(|n| if n.bonded { Touch::Stick } else { Touch::Open }).collect();
        let Some(top) = path.top(&states)? else { return Ok(None) };
        let End::Arrived(states) = path.follow(top, states)? else { return Ok(None) };
        if springs.iter().all(|s| *s == 0.0) {
            return Ok(Some(states));
        }
        let Some(forces) = sprung.on_states(&states, given)? else { return Ok(None) };
        let of_springs: Vec<f64> = std::iter::zip(&springs, &forces.alpha).map(|(s, a)| -s * a).collect();
        let still = vec![0.0; given.gap.len()];
        let path = Path { problem: self, gap: [given.gap, &still], work: [given.work, &of_springs] };
        Ok(match path.follow(1.0, states)? {
            End::Arrived(states) => Some(states),
            End::Lost => None,
        })
    }

    /// Positive for the gaps, small for the slips, and like no other: no two events together.
    fn lifted(&self) -> Vec<f64> {
        let mut rate = vec![0.0; self.a.n()];
        // A sequence that fills [0, 1) evenly.
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        for (j, node) in self.nodes.iter().enumerate() {
            let at = |k: usize| ((2 * j + k) as f64 * golden).fract();
            rate[node.normal] = 1.0 + 0.5 * at(1);
            if let Some(t) = node.tangential {
                rate[t] = 0.01 * (at(2) - 0.5);
            }
        }
        rate
    }
}

impl Path<'_> {
    /// Theta at which nothing touches, beyond the last closing.
    fn top(&self, states: &[Touch]) -> Result<Option<f64>> {
        let Some([at_zero, rate]) = self.line(states)? else { return Ok(None) };
        let of_node = |node: &Node| {
            let (y, slope) = (at_zero.1[node.normal], rate.1[node.normal]);
            if node.bonded || slope <= 0.0 { 0.0 } else { -y / slope }
        };
        let top = self.problem.nodes.iter().map(of_node).fold(0.0, larger);
        Ok(Some(if top > 0.0 { 1.01 * top } else { 1.0 }))
    }

    /// Forces and gaps at theta = 0, and their rates, with these states; `None` if they do not decide them.
    fn line(&self, states: &[Touch]) -> Result<Option<[Point; 2]>> {
        let of = |k: usize| -> Result<Option<Point>> {
            let mut problem = std::borrow::Cow::Borrowed(self.problem);
            if k == 1 && self.problem.nodes.iter().any(|n| n.shear != 0.0) {
                problem.to_mut().nodes.iter_mut().for_each(|n| n.shear = 0.0);
            }
            let given = Given { gap: self.gap[k], work: self.work[k] };
            let Some(forces) = problem.on_states(states, &given)? else { return Ok(None) };
            let gaps = problem.gaps(&forces, self.gap[k])?;
            Ok(Some((forces, gaps)))
        };
        Ok(of(0)?.zip(of(1)?).map(|(a, b)| [a, b]))
    }

    /// What must not become negative, node by node.
    fn limits(&self, states: &[Touch], line: &[Point; 2], theta: f64) -> Vec<Vec<Limit>> {
        let [(at, gap), (rate, gap_rate)] = line;
        let value = |j: usize| (at.x[j] + theta * rate.x[j], rate.x[j]);
        let of_gap = |j: usize| (gap[j] + theta * gap_rate[j], gap_rate[j]);
        let of_node = |(node, state): (&Node, &Touch)| {
            let mut limits: Vec<Limit> = Vec::with_capacity(3);
            let (r, dr) = value(node.normal);
            match state {
                Touch::Open => {
                    let (y, dy) = of_gap(node.normal);
                    limits.push((y, dy, Touch::Stick));
                    return limits;
                }
                _ if !node.bonded => limits.push((r, dr, Touch::Open)),
                _ => {}
            }
            let Some(t) = node.free().filter(|_| node.friction.is_finite()) else { return limits };
            match state.slips() {
                None => {
                    let (force, d) = value(t);
                    let (bound, db) = (node.friction * r + node.shear, node.friction * dr);
                    limits.push((bound - force, db - d, Touch::Forwards));
                    limits.push((bound + force, db + d, Touch::Backwards));
                }
                Some(sign) => {
                    let (y, dy) = of_gap(t);
                    limits.push((-sign * y, -sign * dy, Touch::Stick));
                }
            }
            limits
        };
        std::iter::zip(&self.problem.nodes, states).map(of_node).collect()
    }

    /// Operations of an event: two factorisations, and products for their refinements.
    fn work_of(&self, states: &[Touch]) -> f64 {
        let touching = states.iter().filter(|state| **state != Touch::Open).count() as f64;
        let (order, n) = (2.0 * touching + self.work[0].len() as f64, self.problem.a.n() as f64);
        4.0 / 3.0 * order.powi(3) + 20.0 * n * n
    }

    /// From `theta`, where `states` hold, down to zero.
    fn follow(&self, mut theta: f64, mut states: Vec<Touch>) -> Result<End> {
        let mut down = true;
        let Some(mut line) = self.line(&states)? else { return Ok(End::Lost) };
        let mut work = 0.0;
        for _ in 0..EVENTS * states.len().max(10) {
            work += self.work_of(&states);
            if work > WORK {
                return Ok(End::Lost);
            }
            let way = if down { -1.0 } else { 1.0 };
            let limits = self.limits(&states, &line, theta);
            let flat = FLAT * steepest(&line);
            let mut event: Option<(f64, usize, Touch)> = None;
            for (j, of_node) in limits.iter().enumerate() {
                for &(value, rate, beyond) in of_node {
                    // What has just been met grows from now on.
                    if way * rate >= -flat {
                        continue;
                    }
                    let step = larger(value, 0.0) / -(way * rate);
                    if event.is_none_or(|(least, ..)| step < least) {
                        event = Some((step, j, beyond));
                    }
                }
            }
            let to_zero = if down { theta } else { f64::INFINITY };
            let Some((step, j, beyond)) = event.filter(|(step, ..)| *step < to_zero) else {
                return Ok(if down { End::Arrived(states) } else { End::Lost });
            };
            theta += way * step;
            let Some((next, next_line, next_down)) =
                self.change(&states, &line, (theta, down), (j, beyond))?
            else {
                return Ok(End::Lost);
            };
            (states, line, down) = (next, next_line, next_down);
        }
        Ok(End::Lost)
    }

    /// The state beyond an event of node `j`, and the direction in which it goes on.
    #[expect(clippy::type_complexity, reason = "states, line and direction of the next piece")]
    fn change(
        &self,
        states: &[Touch],
        line: &[Point; 2],
        (theta, down): (f64, bool),
        (j, beyond): (usize, Touch),
    ) -> Result<Option<(Vec<Touch>, [Point; 2], bool)>> {
        let closes = states[j] == Touch::Open;
        let candidate = match self.problem.nodes[j].free() {
            // Without force it slips wherever it has got to.
            Some(t) if closes && self.problem.nodes[j].friction.is_finite() => {
                let [(_, gap), (_, rate)] = line;
                if gap[t] + theta * rate[t] < 0.0 { Touch::Forwards } else { Touch::Backwards }
            }
            _ => beyond,
        };
        let mut next = states.to_vec();
        next[j] = candidate;
        let Some(line) = self.line(&next)? else { return Ok(None) };
        let limits = self.limits(&next, &line, theta);
        let flat = FLAT * steepest(&line);
        // What is zero at the event has to grow.
        let grow = |way: f64| {
            limits[j].iter().all(|&(_, rate, beyond)| {
                let at_zero = if closes {
                    beyond == Touch::Open
                } else {
                    candidate == Touch::Open || beyond == states[j]
                };
                !at_zero || way * rate >= -flat
            })
        };
        let ahead = if down { -1.0 } else { 1.0 };
        Ok(match (grow(ahead), grow(-ahead)) {
            (true, _) => Some((next, line, down)),
            (false, true) => Some((next, line, !down)),
            (false, false) => None,
        })
    }
}
