//! The default driver where surfaces have tangential forces: the whole contact problem, active set and friction together, is
//! settled on the dense compliance of the bodies, and one alternation tests what was found. Where a body answers by its solver the compliance
//! is a model that learns from every alternation.
use super::{
    ActiveSet, Ended, PairRows, Reason, Respond, Touch,
    coarse::Resists,
    dual::{Layout, gathered},
    frictional::{Answer, Forces, Frictional, Given, Node},
    learned::{Learned, add_half_planes},
};
use crate::{
    contact::Law,
    error::Result,
    petsc::Symmetric,
    record::HistoryRow,
    tolerances::{HELD_COMPLIANCE, SUM},
    vector::{larger, largest},
};
use std::{borrow::Cow, ops::Range};

/// Alternations without a smaller residual after which a model of the compliance has no more to learn.
const LEARNS: usize = 12;

/// A residual that does not fall below this share of the one before is round-off.
const FALLS: f64 = 0.5;

/// A residual that round-off does not let fall below this is no solution, whatever the tolerance.
const WORTHLESS: f64 = 1e-6;

/// The dense problem of all pairs, and where this rank's rows are in it.
struct Dense {
    /// Where each pair's rows begin.
    first: Vec<usize>,
    /// Nodes of each pair.
    nodes: Vec<Range<usize>>,
    problem: Frictional,
    /// x = R s, A = F / (s s'), the same s for the rows of a node.
    scale: Vec<f64>,
    /// Where a body answers by its solver: what A has learned.
    learned: Option<Learned>,
}

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Runs to the end; `known`: what the nodes did at the last accepted state, end by end. Collective on the roots.
    pub fn run_with_friction(
        &mut self,
        known: Option<&[Vec<Touch>]>,
        mut progress: impl FnMut(&HistoryRow),
    ) -> Result<Ended> {
        self.coupling.check_free(&self.g_free)?;
        let start = match self.start() {
            Ok(start) => start,
            Err(motion) => return Ok(Ended::Driven(motion)),
        };
        let bonded = self.rows.iter().any(|rows| rows.law == Law::Tied);
        let bonded = self.coupling.exchange.max(&[f64::from(u8::from(bonded))])[0] > 0.0;
        if self.largest(&start) == 0.0 && !bonded {
            return Ok(self.rest_open(start));
        }
        let mut dense = self.dense()?;
        // All nodes that the bodies would press together stick at first, as in the paper.
        let pressed: Vec<bool> = start.iter().map(|f| *f > 0.0).collect();
        let all_stick = self.on_nodes(&dense, |i, j| {
            let touches = pressed[self.coupling.ranges[i].start + j];
            if touches { Touch::Stick } else { Touch::Open }
        });
        let mut starts = vec![all_stick];
        if let Some(known) = known {
            starts.insert(0, self.on_nodes(&dense, |i, j| known[i].get(j).copied().unwrap_or(Touch::Open)));
        }
        let mut gap = self.g_free.clone();
        // The smallest residual so far, and the alternations since; whether the one before was small enough.
        let (mut best, mut waited, mut small) = (f64::INFINITY, 0, false);
        let mut kept: Option<(f64, Answer, Vec<f64>)> = None;
        loop {
            let Some(answer) = self.settle(&dense, &gap, &starts)? else {
                return Ok(Ended::Outcome(self.outcome(Reason::NoState)));
            };
            self.updates += answer.updates;
            // What was learned last leaves all nodes as they are: the forces that were tried are the answer.
            if small && answer.holds && answer.settled && starts.first() == Some(&answer.states) {
                let reason = if self.any_touch() { Reason::Converged } else { Reason::Open };
                return Ok(Ended::Outcome(self.outcome(reason)));
            }
            self.take(&dense, &answer);
            if !answer.holds {
                return Ok(Ended::Driven(self.drift(&answer.forces.drift)));
            }
            if answer.settled {
                starts = vec![answer.states.clone()];
            }
            let settled = answer.settled;
            // What the bodies really answer; what the dense problem takes it for.
            let [own, other] = self.coupling.force_step(&self.force)?;
            self.gap = (0..self.coupling.n).map(|j| self.g_free[j] + own[j] + other[j]).collect();
            let residual: Vec<f64> =
                (0..self.coupling.n).map(|j| if self.active[j] { self.gap_at(j) } else { 0.0 }).collect();
            let scales = self.scales();
            let [rows, joint] = self.size(&residual, &scales);
            self.residual = if scales.all > 0.0 { larger(rows, joint) / scales.all } else { rows };
            self.flipped.clear();
            self.record(0, &mut progress);
            if !self.residual.is_finite() {
                return Ok(Ended::Outcome(self.outcome(Reason::NotFinite)));
            }
            let any = self.any_touch();
            small = self.residual <= self.limits.tolerance;
            if let (true, Some(_)) = (small && any, &dense.learned) {
                small = self.follow_mesh_error(self.residual) && self.residual <= self.limits.tolerance;
            }
            if dense.learned.is_none() && (small || !any) {
                let reason = if any { Reason::Converged } else { Reason::Open };
                return Ok(Ended::Outcome(self.outcome(reason)));
            }
            waited += 1;
            if self.residual <= FALLS * best {
                (best, waited) = (self.residual, 0);
            }
            let patience = if dense.learned.is_some() { LEARNS } else { 0 };
            small &= settled;
            let is_better = |(least, best, _): &(f64, Answer, Vec<f64>)| {
                settled && (!best.settled || self.residual < *least)
            };
            if kept.as_ref().is_none_or(is_better) {
                kept = Some((self.residual, answer, self.gap.clone()));
            }
            if let (true, Some((residual, answer, gap))) = (waited > patience, &kept) {
                // What was learned from round-off may have led away again.
                self.take(&dense, answer);
                (self.residual, self.gap) = (*residual, gap.clone());
                self.round_off = Some(self.residual);
                if !answer.settled {
                    return Ok(Ended::Outcome(self.outcome(Reason::NoState)));
                }
                let good = self.residual <= larger(self.limits.tolerance, WORTHLESS);
                let reason = if good { Reason::Converged } else { Reason::Stalled };
                return Ok(Ended::Outcome(self.outcome(reason)));
            }
            if self.recorder.count() >= self.limits.max_alternations {
                return Ok(Ended::Outcome(self.outcome(Reason::MaxAlternations)));
            }
            let pushed: Vec<f64> = std::iter::zip(own, other).map(|(own, other)| own + other).collect();
            // What the dense problem takes the answer for is put right.
            let beside = self.learn(&mut dense, &pushed)?;
            gap = std::iter::zip(&self.g_free, beside).map(|(g, beside)| g + beside).collect();
        }
    }

    /// Takes in that the forces push the rows inwards by `pushed`, m, and gives what they then do beside the compliance as it
    /// stands, m: round-off where that is exact. Collective on the roots.
    fn learn(&self, dense: &mut Dense, pushed: &[f64]) -> Result<Vec<f64>> {
        let exchange = self.coupling.exchange;
        let Dense { first, problem, learned, scale, .. } = dense;
        let place = Layout { coupling: &*self.coupling, first };
        let (x, y, solves) = (place.gather(&self.force), place.gather(pushed), place.solves());
        let mut look = || -> Result<Vec<f64>> {
            if !solves {
                return Ok(vec![0.0; x.len()]);
            }
            let x: Vec<f64> = std::iter::zip(&x, &*scale).map(|(x, s)| x * s).collect();
            let y: Vec<f64> = std::iter::zip(&y, &*scale).map(|(y, s)| y / s).collect();
            if let Some(learned) = learned {
                let a = std::mem::replace(&mut problem.a, Symmetric::from_lower_rows(0, Vec::new()));
                problem.a = learned.learn(a, &x, &y)?;
            }
            let of_a = problem.a.times(&x)?;
            Ok(std::iter::zip(&y, of_a).zip(&*scale).map(|((y, a), s)| (y - a) * s).collect())
        };
        let beside = exchange.sum(&exchange.agree(look())?);
        let mut own = place.own(&beside);
        own.resize(self.coupling.n, 0.0);
        Ok(own)
    }

    /// Which rows the bodies press together at first: as without friction; where a load drives a motion then, as if something else
    /// stopped it, or as if the surfaces stuck. `Err`: the motion that goes on even so. Collective on the roots.
    fn start(&mut self) -> std::result::Result<Vec<f64>, Vec<f64>> {
        let exchange = self.coupling.exchange;
        let smooth = self.resists(Resists::Never);
        let presses = |forces: &[f64]| {
            let most = self.normals().into_iter().map(|j| larger(forces[j], 0.0)).fold(0.0, larger);
            exchange.max(&[most])[0] > 0.0
        };
        let mut coarse = Cow::Borrowed(self.coarse);
        let mut found = coarse.start(exchange, &self.g_free, &smooth);
        // Each motion takes one direction out of the loads.
        for _ in 0..self.coarse.n {
            let Err(motion) = &found else { break };
            coarse = Cow::Owned(coarse.without(motion));
            found = coarse.start(exchange, &self.g_free, &smooth);
        }
        let is_driven = matches!(coarse, Cow::Owned(_));
        let (start, alpha) = match found {
            Ok(found) if !is_driven || presses(&found.0) => found,
            _ => {
                let glued = self.coarse.start(exchange, &self.g_free, &self.resists(Resists::Always))?;
                if !presses(&glued.0) {
                    return Err(self.coarse.start(exchange, &self.g_free, &smooth).err().unwrap_or_default());
                }
                glued
            }
        };
        self.alpha = alpha;
        Ok(start)
    }

    /// When each row resists in the first guess; `tangential` of those of surfaces that may slip.
    pub(super) fn resists(&self, tangential: Resists) -> Vec<Resists> {
        let mut resists = vec![Resists::Always; self.coupling.n];
        for (rows, range) in std::iter::zip(self.rows, &self.coupling.ranges) {
            let (n, law) = (rows.n_normal(), rows.law);
            let bonded = law == Law::Tied;
            resists[range.start..range.start + n].fill(if bonded {
                Resists::Always
            } else {
                Resists::Pressed
            });
            if law.is_frictional() {
                let never = law.friction().is_finite();
                resists[range.start + n..range.end].fill(if never { tangential } else { Resists::Always });
            }
        }
        resists
    }

    /// This rank's normal rows.
    pub(super) fn normals(&self) -> Vec<usize> {
        let of_end = |(rows, range): (&PairRows, &Range<usize>)| range.start..range.start + rows.n_normal();
        std::iter::zip(self.rows, &self.coupling.ranges).flat_map(of_end).collect()
    }

    fn any_touch(&self) -> bool {
        let any = self.touch.iter().any(|touch| *touch != Touch::Open);
        self.coupling.exchange.max(&[f64::from(u8::from(any))])[0] > 0.0
    }

    /// What the nodes of a multiplier end do.
    pub fn touch(&self, range: Range<usize>) -> Vec<Touch> {
        let of_row = |j: usize| match (self.touch.get(j), self.active[j]) {
            (Some(touch), _) => *touch,
            (None, true) => Touch::Stick,
            (None, false) => Touch::Open,
        };
        range.map(of_row).collect()
    }

    /// Gathers the compliance and the laws of all pairs. Collective on the roots.
    fn dense(&self) -> Result<Dense> {
        let (coupling, exchange, n_pairs) =
            (&*self.coupling, self.coupling.exchange, self.recorder.n_pairs());
        // Of each pair: rows, nodes, and bodies on either side that answer by their solver.
        let mut counts = vec![[0.0; 4]; n_pairs];
        for (end, rows) in std::iter::zip(coupling.ends, self.rows).filter(|(end, _)| end.multiplier) {
            counts[end.pair][..2].copy_from_slice(&[end.rows.len() as f64, rows.n_normal() as f64]);
        }
        for end in coupling.ends {
            let body = &coupling.bodies[end.body];
            let missing = body.compliance().is_none() && !end.rows.is_empty();
            counts[end.pair][if end.multiplier { 2 } else { 3 }] = f64::from(u8::from(missing));
        }
        let counts = exchange.sum(counts.as_flattened());
        let (counts, _) = counts.as_chunks::<4>();
        let missing: Vec<[bool; 2]> = counts.iter().map(|c| [c[2] > 0.0, c[3] > 0.0]).collect();
        let learns = missing.as_flattened().contains(&true);
        let first: Vec<usize> =
            (0..=n_pairs).map(|p| counts[..p].iter().map(|c| c[0]).sum::<f64>() as usize).collect();
        let begins: Vec<usize> =
            (0..=n_pairs).map(|p| counts[..p].iter().map(|c| c[1]).sum::<f64>() as usize).collect();
        let nodes: Vec<Range<usize>> = (0..n_pairs).map(|p| begins[p]..begins[p + 1]).collect();
        let n = first[n_pairs];
        let mut f = gathered(coupling, &first);
        if learns {
            add_half_planes(&mut f, coupling, self.rows, &missing, &first);
        }
        let place = Layout { coupling, first: &first };
        // Per row: friction, shear force and whether it is bonded.
        let per_row = |value: &dyn Fn(&PairRows, usize) -> f64| -> Vec<f64> {
            let mut own = vec![0.0; coupling.n];
            for (rows, range) in std::iter::zip(self.rows, &coupling.ranges) {
                range.clone().enumerate().for_each(|(k, j)| own[j] = value(rows, k));
            }
            place.gather(&own)
        };
        let friction = per_row(&|rows, k| rows.bounds(k)[0]);
        let shear = per_row(&|rows, k| rows.bounds(k)[1]);
        let bonded = per_row(&|rows, _| f64::from(u8::from(rows.law == Law::Tied)));
        let scale = place.scale(&mut f, self.rows);
        let of_node = |p: usize, k: usize| {
            let normal = first[p] + k;
            let tangential = (first[p + 1] - first[p] > nodes[p].len()).then(|| normal + nodes[p].len());
            Node {
                normal,
                tangential,
                friction: friction[normal],
                shear: shear[normal] * scale[normal],
                bonded: bonded[normal] > 0.0,
                held: tangential.is_some_and(|t| f[t * n + t] <= HELD_COMPLIANCE),
            }
        };
        let all = (0..n_pairs).flat_map(|p| (0..nodes[p].len()).map(move |k| (p, k)));
        let problem = Frictional {
            nodes: all.map(|(p, k)| of_node(p, k)).collect(),
            modes: place.modes(self.coarse, &scale),
            stiffness: self.coarse.stiffness.clone(),
            pairs: nodes.clone(),
            a: Symmetric::from_lower_rows(n, f),
        };
        Ok(Dense { first, nodes, problem, scale, learned: learns.then(Learned::default) })
    }

    /// A state per node of all pairs, from this rank's nodes, given by end and row. Bonded nodes stick. Collective on the
    /// roots.
    fn on_nodes(&self, dense: &Dense, state: impl Fn(usize, usize) -> Touch) -> Vec<Touch> {
        let mut codes = vec![0.0; dense.problem.nodes.len()];
        for (i, end) in self.coupling.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            for (k, node) in dense.nodes[end.pair].clone().enumerate() {
                codes[node] = state(i, k).code();
            }
        }
        let codes = self.coupling.exchange.sum(&codes);
        let of_node = |(node, code): (&Node, f64)| match Touch::of_code(code) {
            _ if node.bonded => Touch::Stick,
            Touch::Forwards | Touch::Backwards if node.tangential.is_none() => Touch::Stick,
            touch => touch,
        };
        std::iter::zip(&dense.problem.nodes, codes).map(of_node).collect()
    }

    /// Solves the dense problem with the gaps `gap`; all have the first rank's digits. Collective on the roots.
    fn settle(&self, dense: &Dense, gap: &[f64], starts: &[Vec<Touch>]) -> Result<Option<Answer>> {
        let exchange = self.coupling.exchange;
        let place = Layout { coupling: self.coupling, first: &dense.first };
        let gap: Vec<f64> = std::iter::zip(place.gather(gap), &dense.scale).map(|(g, s)| g / s).collect();
        let given = Given { gap: &gap, work: &self.coarse.work };
        let look = || -> Result<Option<Answer>> {
            let found = dense.problem.solve(&given, starts)?;
            let (None, Some(_), Some(states)) = (&found, &dense.learned, starts.last()) else {
                return Ok(found);
            };
            // That a model has no state tells nothing of the bodies: what it has with these states teaches it.
            let tried = dense.problem.on_states(states, &given)?;
            let as_tried =
                |forces| Answer { forces, states: states.clone(), updates: 0, holds: true, settled: false };
            Ok(tried.map(as_tried))
        };
        let found = exchange.agree(if place.solves() { look() } else { Ok(None) })?;
        let (n, m, nodes) = (gap.len(), self.coarse.n, dense.problem.nodes.len());
        let mut message = vec![0.0; n + 2 * m + nodes + 3];
        if let Some(Answer { forces, states, updates, holds, settled }) = found {
            let unscaled = std::iter::zip(&forces.x, &dense.scale).map(|(x, s)| x / s);
            let states = states.iter().map(|state| state.code());
            let rest = [if settled { 1.0 } else { 2.0 }, updates as f64, f64::from(u8::from(holds))];
            let motions = forces.alpha.iter().chain(&forces.drift).copied();
            let all = unscaled.chain(motions).chain(states).chain(rest);
            std::iter::zip(&mut message, all).for_each(|(m, v)| *m = v);
        }
        let message = exchange.sum(&message);
        let (x, rest) = message.split_at(n);
        let (alpha, rest) = rest.split_at(m);
        let (drift, rest) = rest.split_at(m);
        let (codes, rest) = rest.split_at(nodes);
        Ok((rest[0] > 0.0).then(|| Answer {
            forces: Forces { x: x.to_vec(), alpha: alpha.to_vec(), drift: drift.to_vec() },
            states: codes.iter().map(|code| Touch::of_code(*code)).collect(),
            updates: rest[1] as usize,
            holds: rest[2] == 1.0,
            settled: rest[0] == 1.0,
        }))
    }

    /// Takes over what was found on the rows of all pairs.
    fn take(&mut self, dense: &Dense, answer: &Answer) {
        let place = Layout { coupling: &*self.coupling, first: &dense.first };
        let mut force = place.own(&answer.forces.x);
        force.extend(self.coarse.spring_forces_at(&answer.forces.alpha));
        self.active = vec![true; self.coupling.n];
        self.touch = vec![Touch::Open; self.coupling.n_rows];
        for (i, end) in self.coupling.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let range = self.coupling.ranges[i].clone();
            let n = dense.nodes[end.pair].len();
            for (k, node) in dense.nodes[end.pair].clone().enumerate() {
                let touch = answer.states[node];
                self.touch[range.start + k] = touch;
                self.active[range.start + k] = touch != Touch::Open;
                if range.len() > n {
                    self.touch[range.start + n + k] = touch;
                    let acts = dense.problem.nodes[node].free().is_some();
                    self.active[range.start + n + k] = acts && touch == Touch::Stick;
                }
            }
        }
        self.force = force;
        self.alpha = answer.forces.alpha.clone();
    }

    /// The motion that goes on for ever where no equilibrium is found: that of the free modes, to the size 1.
    fn drift(&self, motion: &[f64]) -> Vec<f64> {
        let free = std::iter::zip(motion, &self.coarse.stiffness);
        let mut drift: Vec<f64> = free.map(|(a, k)| if *k > 0.0 { 0.0 } else { *a }).collect();
        let size = largest(&drift);
        drift.iter_mut().for_each(|d| *d = if d.abs() > SUM * size { *d / size } else { 0.0 });
        drift
    }
}
