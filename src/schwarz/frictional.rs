//! The contact problem with friction on a dense compliance, settled exactly.
//!
//! With x the forces on all rows, normal ones R and tangential ones T, y = A x + g - Z alpha the gaps and, negative, the
//! slips since the last accepted state, Z'x + K alpha = e, each node keeps one of
//!
//! - open: R = 0, T = 0, y_n >= 0;
//! - stick: y_n = 0, y_t = 0, R >= 0, |T| <= mu R + q;
//! - slip, forwards or backwards: y_n = 0, T = s (mu R + q), s y_t <= 0, R >= 0, s = 1 or -1
//!
//! (Amontons and Coulomb: q = 0; Tresca: mu = 0; rough and bonded: no bound, and bonded nodes have no sign of R).
//!
//! A semi-smooth Newton iteration on these states does it (Alart and Curnier, Comput. Methods Appl. Mech. Engng 92 (1991) 353;
//! Hueeber, Stadler and Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572): normal and tangential conditions together, so that no
//! slip bound is ever frozen. Should it return to a state that it has had, [`super::lifting`] follows the solution as all gaps
//! are lowered from where nothing touches.
use crate::tolerances::SUM;
use crate::{
    error::Result,
    petsc::{Lu, Symmetric},
    vector::{all_finite, larger, largest},
};
use serde::{Deserialize, Serialize};
use std::{collections::HashSet, ops::Range};

/// Added to the diagonal, relative to its mean, which is 1: as without friction.
const STIFFENED: f64 = 1e-9;

/// A mode whose rows move less than this, squared and relative to the largest, moves them by round-off.
const UNSEEN: f64 = 1e-18;

/// Refinements of a solution.
const REFINEMENTS: usize = 8;

/// Tension, penetration, slip and force beyond the bound below this are none, relative to the largest force and elastic
/// approach of the pair.
const NONE: f64 = 1e-12;

/// Least compliance, relative to the mean, that tells by the round-off of a row's gap what of its force is round-off.
const LEAST_COMPLIANCE: f64 = 1e-2;

/// Newton updates before another start, or another method, is tried: three to fifteen are usual, and a coefficient of 10 on a fine
/// mesh takes some forty.
const UPDATES: usize = 120;

/// What the loads do on free motions and forces do not take up, relative to all they do: more is no equilibrium.
const UNBALANCED: f64 = 1e-9;

/// The same, relative to what all forces together could do.
const ROUNDED: f64 = 1e-12;

/// Slips that supports prescribe below this share of the elastic approach of the pair are what directions of a faceted surface
/// differ by from those of its supports.
const PRESCRIBED: f64 = 1e-3;

/// What a contact node does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Touch {
    /// Does not touch.
    Open,
    /// Touches and does not slip; of a node without friction: touches.
    Stick,
    /// Slips so that the tangential force is positive.
    Forwards,
    /// Slips so that the tangential force is negative.
    Backwards,
}

impl Touch {
    /// Sign of the tangential force of a node that slips.
    pub fn slips(self) -> Option<f64> {
        match self {
            Touch::Forwards => Some(1.0),
            Touch::Backwards => Some(-1.0),
            Touch::Open | Touch::Stick => None,
        }
    }

    /// As a number in a message, and back.
    pub fn code(self) -> f64 {
        match self {
            Touch::Open => 0.0,
            Touch::Stick => 1.0,
            Touch::Forwards => 2.0,
            Touch::Backwards => 3.0,
        }
    }

    #[allow(missing_docs)]
    pub fn of_code(code: f64) -> Touch {
        match code as i64 {
            1 => Touch::Stick,
            2 => Touch::Forwards,
            3 => Touch::Backwards,
            _ => Touch::Open,
        }
    }
}

/// A contact node: its rows and its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    pub normal: usize,
    /// Of a pair with a tangential law.
    pub tangential: Option<usize>,
    /// mu; infinite: it never slips.
    pub friction: f64,
    /// q, in the units of the forces.
    pub shear: f64,
    /// Never open, in tension neither.
    pub bonded: bool,
    /// Supports prescribe both sides along each other: the slip is known, and no tangential force changes it.
    pub held: bool,
}

impl Node {
    /// The tangential row of a node that can be held by its force.
    pub fn free(&self) -> Option<usize> {
        self.tangential.filter(|_| !self.held)
    }

    /// Largest tangential force at the normal force `r`.
    pub fn bound(&self, r: f64) -> f64 {
        match self.friction.is_finite() {
            true => self.friction * larger(r, 0.0) + self.shear,
            false => f64::INFINITY,
        }
    }
}

/// The data that stay from one solution to the next.
#[derive(Debug, Clone)]
pub(super) struct Frictional {
    /// A, scaled to a mean diagonal of 1.
    pub a: Symmetric,
    /// Z, mode by mode.
    pub modes: Vec<Vec<f64>>,
    /// K, one per mode; zero for rigid ones.
    pub stiffness: Vec<f64>,
    /// The nodes, pair by pair.
    pub nodes: Vec<Node>,
    /// Nodes of each pair: what forces and gaps are compared with.
    pub pairs: Vec<Range<usize>>,
}

/// The right-hand sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Given<'g> {
    pub gap: &'g [f64],
    pub work: &'g [f64],
}

/// Forces and motions.
#[derive(Debug, Clone, Default)]
pub(super) struct Forces {
    pub x: Vec<f64>,
    pub alpha: Vec<f64>,
    /// How the motions still change: by nothing but round-off if the forces balance, else along the motion that goes on for ever.
    pub drift: Vec<f64>,
}

/// What was found.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    pub forces: Forces,
    pub states: Vec<Touch>,
    /// Newton updates that it took.
    pub updates: usize,
    /// False if the forces are not in equilibrium with the loads: the motion that `forces` has goes on for ever.
    pub holds: bool,
    /// False if the states need not be those of a solution.
    pub settled: bool,
}

/// The stiffened system of one set of states, factorised: rows `rows` and the equilibrium of the modes.
pub(super) struct System {
    rows: Vec<usize>,
    /// Of each unknown the rows that it acts on, with its share of their force.
    acts: Vec<[(usize, f64); 2]>,
    /// Of each mode the amplitude whose rows have the norm 1.
    units: Vec<f64>,
    factor: Lu,
}

impl Frictional {
    /// Forces, motions and states from the states `starts`, one after the other until one leads to an answer, then from where the
    /// last of them would slip to without friction, then by lifting; `None` if there is none.
    pub fn solve(&self, given: &Given, starts: &[Vec<Touch>]) -> Result<Option<Answer>> {
        let mut updates = 0;
        let mut loose = None;
        for k in 0..=starts.len() {
            let start = match (starts.get(k), starts.last()) {
                (Some(start), _) => Some(start.clone()),
                (None, Some(last)) => self.slid(last, given)?,
                (None, None) => None,
            };
            let Some(start) = start else { continue };
            match self.from(start, given, &mut updates)? {
                Some(answer) if answer.holds => return Ok(Some(answer)),
                Some(answer) => loose = loose.or(Some(answer)),
                None => {}
            }
        }
        if let Some(lifted) = self.lift(given)? {
            // The path ends at a solution but for round-off.
            if let Some(answer) = self.from(lifted, given, &mut updates)? {
                if answer.holds {
                    return Ok(Some(answer));
                }
                loose.get_or_insert(answer);
            }
        }
        Ok(loose)
    }

    /// All nodes that touch slip the way in which they would without friction; `None` if that is not known.
    fn slid(&self, states: &[Touch], given: &Given) -> Result<Option<Vec<Touch>>> {
        let mut smooth = self.clone();
        let touches: Vec<bool> = states.iter().map(|state| *state != Touch::Open).collect();
        let mut slid = states.to_vec();
        for ((node, state), touches) in smooth.nodes.iter_mut().zip(&mut slid).zip(touches) {
            if touches && node.free().is_some() && node.friction.is_finite() {
                (node.friction, node.shear, *state) = (0.0, 0.0, Touch::Forwards);
            }
        }
        let Some(forces) = smooth.on_states(&slid, given)? else { return Ok(None) };
        let gaps = self.gaps(&forces, given.gap)?;
        for (node, state) in self.nodes.iter().zip(&mut slid).filter(|(_, state)| **state == Touch::Forwards)
        {
            if node.tangential.is_some_and(|t| gaps[t] > 0.0) {
                *state = Touch::Backwards;
            }
        }
        Ok(Some(slid))
    }

    /// Newton's iteration from `states`. Should it return to states that it has had: `None` if its forces balance, else what did
    /// not hold the bodies.
    fn from(&self, mut states: Vec<Touch>, given: &Given, updates: &mut usize) -> Result<Option<Answer>> {
        let mut visited = HashSet::new();
        let mut last = None;
        while visited.len() < UPDATES && visited.insert(states.clone()) {
            let Some(forces) = self.on_states(&states, given)? else { return Ok(None) };
            let next = self.next_states(&states, &forces, given)?;
            if next == states {
                let holds = self.is_balanced(&forces, given);
                return Ok(Some(Answer { forces, states, updates: *updates, holds, settled: true }));
            }
            last = Some(Answer { forces, states, updates: *updates, holds: false, settled: true });
            states = next;
            *updates += 1;
        }
        Ok(last.filter(|answer| !self.is_balanced(&answer.forces, given)))
    }

    /// Forces and motions with which each node is as `states` say.
    pub fn on_states(&self, states: &[Touch], given: &Given) -> Result<Option<Forces>> {
        let Some(system) = self.system(states)? else { return Ok(None) };
        let mut forces =
            Forces { x: vec![0.0; self.a.n()], alpha: vec![0.0; given.work.len()], drift: Vec::new() };
        for (node, state) in std::iter::zip(&self.nodes, states) {
            if let (Some(sign), Some(t)) = (state.slips(), node.tangential) {
                forces.x[t] = sign * node.shear;
            }
        }
        let mut before = f64::INFINITY;
        for _ in 0..REFINEMENTS {
            let y = self.gaps(&forces, given.gap)?;
            let missing = self.missing(&forces, given.work);
            let change = self.correct(&system, &y, &missing)?;
            let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
            for (v, d) in [(&mut forces.x, &change.x), (&mut forces.alpha, &change.alpha)] {
                std::iter::zip(v, d).for_each(|(v, d)| *v += d);
            }
            forces.drift = change.alpha;
            let change = size(&change.x) / size(&forces.x);
            // No smaller any more: round-off. Not a number: of no use.
            if change.is_nan() || change <= f64::EPSILON || change > 0.5 * before {
                break;
            }
            before = change;
        }
        Ok(all_finite(forces.x.iter().chain(&forces.alpha)).then_some(forces))
    }

    /// The system of these states.
    pub fn system(&self, states: &[Touch]) -> Result<Option<System>> {
        let (mut rows, mut acts) = (Vec::new(), Vec::new());
        for (node, state) in std::iter::zip(&self.nodes, states).filter(|(_, s)| **s != Touch::Open) {
            rows.push(node.normal);
            acts.push([
                (node.normal, 1.0),
                match (state.slips(), node.tangential) {
                    (Some(sign), Some(t)) => (t, sign * node.friction),
                    _ => (node.normal, 0.0),
                },
            ]);
            if let (None, Some(t)) = (state.slips(), node.free()) {
                rows.push(t);
                acts.push([(t, 1.0), (t, 0.0)]);
            }
        }
        let seen: Vec<f64> = self.modes.iter().map(|mode| mode.iter().map(|z| z * z).sum()).collect();
        // A spin that rows see by round-off only must not weigh less than that.
        let least = UNSEEN * largest(&seen);
        let unit = |seen: &f64| 1.0 / larger(larger(*seen, least), f64::MIN_POSITIVE).sqrt();
        let units: Vec<f64> = seen.iter().map(unit).collect();
        let (n, m) = (rows.len(), self.modes.len());
        let order = n + m;
        let mut matrix = vec![0.0; order * order];
        for (k, act) in acts.iter().enumerate() {
            let column = &mut matrix[k * order..][..order];
            for &(row, share) in act.iter().filter(|(_, share)| *share != 0.0) {
                let of_row = self.a.column(row);
                std::iter::zip(column.iter_mut(), &rows).for_each(|(c, &i)| *c += share * of_row[i]);
                for (c, (mode, unit)) in std::iter::zip(&mut column[n..], std::iter::zip(&self.modes, &units))
                {
                    *c += share * unit * mode[row];
                }
            }
            column[k] += STIFFENED;
        }
        for (k, mode) in self.modes.iter().enumerate() {
            let column = &mut matrix[(n + k) * order..][..order];
            std::iter::zip(column.iter_mut(), &rows).for_each(|(c, &i)| *c = -units[k] * mode[i]);
            // A spring need only be kept above the round-off of the rest.
            let added = if self.stiffness[k] > 0.0 { NONE } else { STIFFENED };
            column[n + k] = self.stiffness[k] * units[k].powi(2) + added;
        }
        Ok(Lu::new(order, matrix)?.map(|factor| System { rows, acts, units, factor }))
    }

    /// The change of forces and motions that answers the gaps `y` of a system's rows and what is `missing` to equilibrium.
    pub fn correct(&self, system: &System, y: &[f64], missing: &[f64]) -> Result<Forces> {
        let units = &system.units;
        let missing = std::iter::zip(missing, units).map(|(m, unit)| m * unit);
        let mut r: Vec<f64> = system.rows.iter().map(|&j| -y[j]).chain(missing).collect();
        system.factor.solve(&mut r)?;
        let mut x = vec![0.0; self.a.n()];
        for (act, r) in std::iter::zip(&system.acts, &r) {
            act.iter().for_each(|&(row, share)| x[row] += share * r);
        }
        let alpha = std::iter::zip(&r[system.rows.len()..], units).map(|(a, unit)| a * unit).collect();
        Ok(Forces { x, alpha, drift: Vec::new() })
    }

    /// A x + g - Z alpha.
    pub fn gaps(&self, forces: &Forces, gap: &[f64]) -> Result<Vec<f64>> {
        let mut y = self.a.times(&forces.x)?;
        std::iter::zip(&mut y, gap).for_each(|(y, g)| *y += g);
        for (alpha, mode) in std::iter::zip(&forces.alpha, &self.modes) {
            std::iter::zip(&mut y, mode).for_each(|(y, z)| *y -= alpha * z);
        }
        Ok(y)
    }

    /// e - Z'x - K alpha.
    fn missing(&self, forces: &Forces, work: &[f64]) -> Vec<f64> {
        let of_mode = |k: usize| {
            let pushed: f64 = std::iter::zip(&self.modes[k], &forces.x).map(|(z, x)| z * x).sum();
            work[k] - pushed - self.stiffness[k] * forces.alpha[k]
        };
        (0..work.len()).map(of_mode).collect()
    }

    /// True if the forces on the modes balance.
    fn is_balanced(&self, forces: &Forces, given: &Given) -> bool {
        let missing = self.missing(forces, given.work);
        let total: f64 = forces.x.iter().map(|x| x.abs()).sum();
        (0..missing.len()).all(|k| {
            let parts = std::iter::zip(&self.modes[k], &forces.x).map(|(z, x)| (z * x).abs()).sum::<f64>();
            // On a mode that forces do not work on, but for round-off, all is round-off.
            let none = ROUNDED * largest(&self.modes[k]) * total;
            missing[k].abs() <= UNBALANCED * (parts + given.work[k].abs()) + none
        })
    }

    /// What each node does after forces and gaps have been looked at.
    fn next_states(&self, states: &[Touch], forces: &Forces, given: &Given) -> Result<Vec<Touch>> {
        let elastic = self.a.times(&forces.x)?;
        let mut next = states.to_vec();
        for pair in &self.pairs {
            let nodes = &self.nodes[pair.clone()];
            let rows = || nodes.iter().flat_map(|n| std::iter::once(n.normal).chain(n.tangential));
            let [force, approach] = [&forces.x, &elastic].map(|v| largest(rows().map(|j| &v[j])));
            let rigid =
                |j: usize| std::iter::zip(&forces.alpha, &self.modes).map(move |(a, mode)| a * mode[j]);
            // The gap of a row, and what of it is round-off: of a pair that carries next to nothing that of what the forces of the
            // others do there.
            let at = |j: usize| {
                let y = elastic[j] + given.gap[j] - rigid(j).sum::<f64>();
                let pushed = std::iter::zip(self.a.column(j), &forces.x).map(|(a, x)| (a * x).abs());
                let parts = given.gap[j].abs() + rigid(j).map(f64::abs).sum::<f64>() + pushed.sum::<f64>();
                (y, SUM * parts)
            };
            let no_gap = |round_off: f64| NONE * approach + round_off;
            let no_force = |j: usize, round_off: f64| {
                NONE * force + round_off / larger(self.a.at(j, j), LEAST_COMPLIANCE)
            };
            for j in pair.clone() {
                let node = &self.nodes[j];
                let r = forces.x[node.normal];
                next[j] = match states[j] {
                    Touch::Open => {
                        let (y, round_off) = at(node.normal);
                        if y < -no_gap(round_off) {
                            closing(node, -y, node.tangential.map(|t| at(t).0))
                        } else {
                            Touch::Open
                        }
                    }
                    _ if !node.bonded && r < -no_force(node.normal, at(node.normal).1) => Touch::Open,
                    state => {
                        let Some(t) = node.tangential else { continue };
                        let (y, round_off) = at(t);
                        if node.held {
                            next[j] = prescribed(node, y, PRESCRIBED * approach);
                            continue;
                        }
                        self.tangential(
                            state,
                            node,
                            [r, forces.x[t]],
                            y,
                            [no_force(t, round_off), no_gap(round_off)],
                        )
                    }
                };
            }
        }
        Ok(next)
    }

    /// What a node that touches does tangentially: one that sticks slips where its force is beyond the bound, one that slips sticks
    /// where it has slipped the other way.
    fn tangential(
        &self,
        state: Touch,
        node: &Node,
        [r, t]: [f64; 2],
        y: f64,
        [no_force, no_slip]: [f64; 2],
    ) -> Touch {
        let bound = node.bound(r);
        let Some(sign) = state.slips() else {
            return match t.abs() > bound + no_force {
                true if t > 0.0 => Touch::Forwards,
                true => Touch::Backwards,
                false => Touch::Stick,
            };
        };
        // Against its direction.
        if sign * y > no_slip { Touch::Stick } else { state }
    }
}

/// What a node does whose slip -`y` supports prescribe; less than `none` is what their frames leave of a direction.
fn prescribed(node: &Node, y: f64, none: f64) -> Touch {
    match node.friction.is_finite() && y.abs() > none {
        true if y < 0.0 => Touch::Forwards,
        true => Touch::Backwards,
        false => Touch::Stick,
    }
}

/// What a node does that penetrates by `depth` and has slipped by -`y`: as if forces grew with both alike, it sticks within the
/// cone.
fn closing(node: &Node, depth: f64, y: Option<f64>) -> Touch {
    match y {
        Some(y) if y.abs() > node.friction * depth => {
            if y < 0.0 {
                Touch::Forwards
            } else {
                Touch::Backwards
            }
        }
        _ => Touch::Stick,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Touch::{Backwards, Forwards, Open, Stick};

    /// A body like a half-plane on [-1, 1]: nodes with a normal row each, then as many tangential rows.
    fn half_plane(n: usize, friction: f64) -> (Frictional, Vec<f64>) {
        let x: Vec<f64> = (0..n).map(|i| -1.0 + 2.0 * i as f64 / (n - 1) as f64).collect();
        let at = |i: usize, j: usize| match i / n == j / n {
            true => 1.0 - 0.2 * ((x[i % n] - x[j % n]).abs() + 0.7 / n as f64).ln(),
            false => 0.0,
        };
        let a =
            Symmetric::from_lower_rows(2 * n, (0..4 * n * n).map(|k| at(k / (2 * n), k % (2 * n))).collect());
        let node =
            |j| Node { normal: j, tangential: Some(n + j), friction, shear: 0.0, bonded: false, held: false };
        let nodes = (0..n).map(node).collect();
        (
            Frictional {
                a,
                modes: Vec::new(),
                stiffness: Vec::new(),
                nodes,
                pairs: std::iter::once(0..n).collect(),
            },
            x,
        )
    }

    /// The states' own conditions, to round-off.
    fn is_solution(q: &Frictional, given: &Given, found: &Answer) {
        let y = q.gaps(&found.forces, given.gap).unwrap();
        let (force, length) = (largest(&found.forces.x), largest(given.gap));
        for (node, state) in std::iter::zip(&q.nodes, &found.states) {
            let (r, gap) = (found.forces.x[node.normal], y[node.normal]);
            assert!(
                r >= -1e-10 * force && gap >= -1e-10 * length && (r * gap).abs() <= 1e-10 * force * length
            );
            let Some(t) = node.tangential else { continue };
            let (t, slip) = (found.forces.x[t], -y[t]);
            assert!(t.abs() <= node.bound(r) + 1e-10 * force, "{t} {r}");
            match state {
                Open => assert_eq!((r, t), (0.0, 0.0)),
                Stick => assert!(slip.abs() <= 1e-10 * length),
                Forwards | Backwards => {
                    assert!(
                        (t.abs() - node.bound(r)).abs() <= 1e-10 * force
                            && t * slip >= -1e-10 * force * length
                    );
                }
            }
        }
    }

    #[test]
    fn pressed_and_sheared_it_sticks_in_the_middle_and_slips_at_the_edges() {
        for n in [41, 121] {
            let (q, x) = half_plane(n, 0.3);
            let depth = 0.4;
            let gap: Vec<f64> = x.iter().map(|x| x * x - depth).chain(x.iter().map(|_| -0.05)).collect();
            let given = Given { gap: &gap, work: &[] };
            let all: Vec<Touch> = gap[..n].iter().map(|g| if *g < 0.0 { Stick } else { Open }).collect();
            let found = q.solve(&given, std::slice::from_ref(&all)).unwrap().unwrap();
            is_solution(&q, &given, &found);
            assert!(found.updates <= 10, "{}", found.updates);
            assert_eq!(found.states[n / 2], Stick);
            assert!(found.states.contains(&Forwards) && !found.states.contains(&Backwards));
            // Cattaneo and Mindlin: T = mu (R(P) - R(P')) where the normal problem of P' is one of the same shape.
            let first = found.states.iter().position(|s| *s == Stick).unwrap();
            let c = -x[first];
            let touches = found.states.iter().position(|s| *s != Open).unwrap();
            assert!(c < -x[touches]);
            // Lifted from nothing, the same.
            let lifted = q.lift(&given).unwrap().unwrap();
            assert_eq!(lifted, found.states);
        }
    }

    #[test]
    fn large_friction_is_solved_from_any_start() {
        for friction in [0.1, 1.0, 3.0, 10.0] {
            let (q, x) = half_plane(61, friction);
            let gap: Vec<f64> =
                x.iter().map(|x| x * x - 0.3).chain(x.iter().map(|x| 0.2 * x * (1.0 - x))).collect();
            let given = Given { gap: &gap, work: &[] };
            let mut answers = Vec::new();
            for start in [vec![Open; 61], vec![Stick; 61], vec![Forwards; 61], vec![Backwards; 61]] {
                let found = q.solve(&given, &[start]).unwrap().unwrap();
                is_solution(&q, &given, &found);
                answers.push(found.forces.x);
            }
            assert!(answers.windows(2).all(|w| {
                std::iter::zip(&w[0], &w[1]).all(|(a, b)| (a - b).abs() < 1e-10 * largest(&w[0]))
            }));
            let lifted = q.lift(&given).unwrap().unwrap();
            let forces = q.on_states(&lifted, &given).unwrap().unwrap();
            std::iter::zip(&forces.x, &answers[0])
                .for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{friction}"));
        }
    }

    /// A rigid block on three nodes, pressed by N and pushed by T: it holds up to T = mu N, then slides away.
    #[test]
    fn a_block_slides_away_at_mu_n() {
        let n = 3;
        let diagonal = |k: usize| if k / 6 == k % 6 { 1.0 } else { 0.0 };
        let a = Symmetric::from_lower_rows(6, (0..36).map(diagonal).collect());
        let node = |j| Node {
            normal: j,
            tangential: Some(n + j),
            friction: 0.3,
            shear: 0.0,
            bonded: false,
            held: false,
        };
        // Down and along; the modes' outward row displacements.
        let modes = vec![vec![1.0, 1.0, 1.0, 0.0, 0.0, 0.0], vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]];
        let q = Frictional {
            a,
            modes,
            stiffness: vec![0.0; 2],
            nodes: (0..n).map(node).collect(),
            pairs: std::iter::once(0..n).collect(),
        };
        for (share, holds) in [(0.0, true), (0.99, true), (1.0 - 1e-8, true), (1.01, false)] {
            let work = [12.0, share * 0.3 * 12.0];
            let given = Given { gap: &[0.0; 6], work: &work };
            let found = q.solve(&given, &[vec![Stick; 3]]).unwrap().unwrap();
            assert_eq!(found.holds, holds, "{share} {found:?}");
            if holds {
                is_solution(&q, &given, &found);
                assert!((found.forces.x[3..].iter().sum::<f64>() - work[1]).abs() < 1e-9);
                let lifted = q.lift(&given).unwrap().unwrap();
                assert!(lifted.iter().all(|s| *s != Open));
            }
        }
    }
}
