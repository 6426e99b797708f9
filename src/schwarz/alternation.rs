//! The paper's alternation: displacement step, force correction, force step, displacement correction.
//!
//! Each alternation is one Dirichlet-Dirichlet step followed by one Neumann-Neumann step (even and odd
//! iterations of the paper). The state reported is the one after the force step: action equals reaction, the gap as
//! converged.
use super::{
    ContactNode, Reason, RespondAtNodes, Side, Watch,
    weights::{self, Both, Weights},
};
use crate::vector::{all_finite, larger};
use crate::{
    contact::vector::{dot, norm, sub},
    error::{Error, Result},
    parallel::Exchange,
    record::HistoryRow,
};
use std::{
    hash::{DefaultHasher, Hash, Hasher},
    time::Instant,
};

/// Threshold of penetration and tension, relative to the relative motion of the surfaces and to the largest nodal
/// force: with exact zeros a gap that just closes lets nodes flip in round-off for ever.
const THRESHOLD: f64 = 1e-11;

/// What the user chooses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Correction weights.
    pub weights: Weights,
    /// Relative tolerance of the stop test.
    pub tolerance: f64,
    /// Iteration limit.
    pub max_alternations: usize,
}

/// How it ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub reason: Reason,
    /// One row per alternation.
    pub history: Vec<HistoryRow>,
}

/// What one side carries from step to step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SideState {
    /// Per contact node: touches the other body.
    pub active: Vec<bool>,
    /// Per contact node: corrected compressive normal force, N.
    pub force: Vec<f64>,
    /// Per contact node: gap after the last force step, m.
    pub gap: Vec<f64>,
    /// Per observed node: displacement after the last force step, m.
    pub displacement: Vec<[f64; 3]>,
    /// The same of the other side.
    pub other_displacement: Vec<[f64; 3]>,
    /// Displacements without contact forces, own and other side.
    free: [Vec<[f64; 3]>; 2],
}

/// Measures of one alternation, summed over all sides of all ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measures {
    /// Norm of the disagreement of the surfaces at active nodes after the force step, m.
    pub jump: f64,
    /// Norm of the response u - u_free at active nodes, m.
    pub response: f64,
    /// Norm of the change of the normal displacements since the last alternation at active nodes, m.
    pub change: f64,
    /// Disagreement of the nodal forces after the displacement step, |R_m - R_s| / (|R_m| + |R_s|) of norms.
    pub force_imbalance: f64,
    /// Nodes that touch.
    pub active: usize,
    /// Nodes that touch and have no single node for a conjugate point.
    pub unmatched: usize,
    /// Nodes that entered or left.
    pub flips: usize,
}

/// The alternation between this rank's bodies and those of the other groups.
pub struct Alternation<'a, B> {
    /// This rank's bodies.
    pub bodies: &'a mut [B],
    /// This rank's sides.
    pub sides: &'a [Side],
    /// To the partners of the sides.
    pub exchange: &'a Exchange<'a>,
    /// The user's choices.
    pub settings: Settings,
    /// Per side.
    pub states: Vec<SideState>,
    /// Penetration below this is none, m.
    pub gap_threshold: f64,
    /// False until the bodies have felt a contact force: all weights start with 1/2, since displacements without
    /// contact forces say nothing of the stiffnesses.
    pub(super) started: bool,
}

impl<'a, B: RespondAtNodes> Alternation<'a, B> {
    /// Solves the bodies without contact forces and finds the nodes that penetrate. Collective on the roots.
    pub fn new(
        bodies: &'a mut [B],
        sides: &'a [Side],
        exchange: &'a Exchange<'a>,
        settings: Settings,
    ) -> Result<Self> {
        let states = sides
            .iter()
            .map(|side| SideState {
                active: vec![false; side.nodes.len()],
                force: vec![0.0; side.nodes.len()],
                gap: vec![0.0; side.nodes.len()],
                ..SideState::default()
            })
            .collect();
        let mut all =
            Alternation { bodies, sides, exchange, settings, states, gap_threshold: 0.0, started: false };
        all.solve_force_step()?;
        let mut motion: f64 = 0.0;
        let mut size: f64 = 0.0;
        for (side, state) in std::iter::zip(sides, &mut all.states) {
            state.free = [state.displacement.clone(), state.other_displacement.clone()];
            for (node, gap) in std::iter::zip(&side.nodes, &state.gap) {
                motion = larger(motion, (node.conjugate.gap - gap).abs());
                size = larger(larger(size, norm(&state.displacement[node.node])), node.conjugate.gap.abs());
            }
        }
        let scales = exchange.max(&[motion, size]);
        all.gap_threshold = THRESHOLD * scales[0] + 8.0 * f64::EPSILON * scales[1];
        all.enter();
        Ok(all)
    }

    /// Alternates until the stop test or the watch ends it; `progress` sees every row. Collective on the roots.
    pub fn run(&mut self, mut progress: impl FnMut(&HistoryRow)) -> Result<Outcome> {
        let start = Instant::now();
        let mut history: Vec<HistoryRow> = Vec::new();
        let mut watch = Watch::new(self.gap_threshold);
        if self.count_active().0 == 0 {
            return Ok(Outcome { reason: Reason::Open, history });
        }
        let mut last_jump = None;
        for alternation in 1..=self.settings.max_alternations {
            let measures = self.alternate()?;
            let relative = |x: f64| if x > 0.0 { x / measures.response } else { 0.0 };
            let [penetration, gap, candidates] = self.gaps();
            let row = HistoryRow {
                step: 1,
                alternation: alternation as u64,
                update: 0,
                displacement_jump: relative(measures.jump),
                force_imbalance: measures.force_imbalance,
                penetration,
                gap,
                active: measures.active as u64,
                open: (candidates as u64).saturating_sub(measures.active as u64),
                flips: measures.flips as u64,
                pairs: Vec::new(),
                contraction: last_jump.map(|last| measures.jump / last),
                seconds: start.elapsed().as_secs_f64(),
            };
            last_jump = Some(measures.jump);
            progress(&row);
            history.push(row);
            if let Some(reason) =
                self.stop_test(&measures).or_else(|| watch.observe(measures.jump, self.set()))
            {
                return Ok(Outcome { reason, history });
            }
        }
        Ok(Outcome { reason: Reason::MaxAlternations, history })
    }

    /// One alternation: displacement step, force correction (22), force step, displacements read off.
    pub fn alternate(&mut self) -> Result<Measures> {
        let before: Vec<Vec<f64>> = (0..self.sides.len()).map(|i| self.normal_displacements(i)).collect();
        let reactions = self.displacement_step()?;
        let (force_imbalance, left) = self.correct_forces(&reactions);
        self.solve_force_step()?;
        self.started = true;
        let mut sums = [0.0; 4];
        for (i, side) in self.sides.iter().enumerate() {
            let state = &self.states[i];
            for (k, now) in self.normal_displacements(i).into_iter().enumerate() {
                if state.active[k] {
                    let free = dot(&side.nodes[k].conjugate.normal, &state.free[0][side.nodes[k].node]);
                    sums[0] += state.gap[k].powi(2);
                    sums[1] += (now - free).powi(2);
                    sums[2] += (now - before[i][k]).powi(2);
                    sums[3] += f64::from(u8::from(side.nodes[k].conjugate.terms.len() > 1));
                }
            }
        }
        let sums = self.exchange.sum(&sums);
        let entered = self.enter();
        let (active, flips) = self.count_active_and(left + entered);
        let [jump, response, change] = [sums[0].sqrt(), sums[1].sqrt(), sums[2].sqrt()];
        let unmatched = sums[3] as usize;
        Ok(Measures { jump, response, change, force_imbalance, active, unmatched, flips })
    }

    /// Displacement step: the corrected displacements (21, 29) are prescribed at the active nodes of all bodies;
    /// returns the compressive normal forces per side and contact node.
    pub fn displacement_step(&mut self) -> Result<Vec<Vec<f64>>> {
        let norms = self.surface_norms(|state, node| {
            let normal = &node.conjugate.normal;
            dot(normal, &state.displacement[node.node]) - dot(normal, &state.free[0][node.node])
        });
        let mut prescribed: Vec<Vec<Option<f64>>> = self.bodies.iter().map(|_| Vec::new()).collect();
        for (i, (side, state)) in std::iter::zip(self.sides, &self.states).enumerate() {
            for (k, node) in side.nodes.iter().enumerate() {
                let rows = &mut prescribed[side.body];
                rows.resize(rows.len().max(node.row + 1), None);
                if state.active[k] {
                    let weight = if node.follows {
                        1.0
                    } else if !self.started && !self.settings.weights.is_constant() {
                        0.5
                    } else {
                        let measures = state.displacement_measures(node, norms[i]);
                        weights::displacement(self.settings.weights, &measures, side.moduli, side.first)
                    };
                    let normal = dot(&node.conjugate.normal, &state.displacement[node.node]);
                    rows[node.row] = Some(normal + weight * state.gap[k]);
                }
            }
        }
        let steps = std::iter::zip(self.bodies.iter_mut(), &prescribed);
        let forces = steps.map(|(body, rows)| body.displacement_step(rows)).collect::<Result<Vec<_>>>();
        let forces = forces.and_then(|forces| {
            finite(forces.iter().all(all_finite), "contact displacements (displacement step)")?;
            Ok(forces)
        });
        let forces = self.exchange.agree(forces)?;
        Ok(self
            .sides
            .iter()
            .map(|side| side.nodes.iter().map(|node| forces[side.body][node.row]).collect())
            .collect())
    }

    /// Force correction (22); nodes whose corrected force is tension leave the contact (26). Returns the force
    /// imbalance of the displacement step and the number of nodes that left.
    fn correct_forces(&mut self, reactions: &[Vec<f64>]) -> (f64, usize) {
        let out: Vec<Vec<f64>> = std::iter::zip(self.sides, reactions)
            .map(|(side, reactions)| {
                let mut message = vec![0.0; side.observed.len() + 1];
                for (node, r) in std::iter::zip(&side.nodes, reactions) {
                    message[node.node] = *r;
                }
                // Behind the nodes: the norm that the weights per surface ask for.
                message[side.observed.len()] = reactions.iter().map(|r| r * r).sum::<f64>().sqrt();
                message
            })
            .collect();
        let received = self.exchange.swap(&out);
        let mut disagreement = [0.0; 3];
        let mut largest: f64 = 0.0;
        for (i, (side, state)) in std::iter::zip(self.sides, &mut self.states).enumerate() {
            let (Some(own_norm), Some(other_norm)) = (out[i].last(), received[i].last()) else { continue };
            let surface = Both { own: *own_norm, other: *other_norm };
            for (k, node) in side.nodes.iter().enumerate() {
                let normal = Both { own: reactions[i][k], other: Side::at_conjugate(node, &received[i]) };
                if !state.active[k] {
                    state.force[k] = 0.0;
                } else if node.follows {
                    state.force[k] = normal.own;
                } else {
                    // Both sides evaluate the correction of side A: conjugate nodes get the same bits.
                    let from_a = |both: Both| if side.first { both } else { both.swapped() };
                    let measures = weights::Forces { normal: from_a(normal), surface: from_a(surface) };
                    let moduli = from_a(side.moduli);
                    let weight = weights::force(self.settings.weights, &measures, moduli, true);
                    let Both { own, other } = measures.normal;
                    state.force[k] = own + weight * (other - own);
                    disagreement[0] += (normal.own - normal.other).powi(2);
                    disagreement[1] += normal.own.powi(2);
                    disagreement[2] += normal.other.powi(2);
                }
                largest = larger(largest, state.force[k].abs());
            }
        }
        let sums = self.exchange.sum(&disagreement);
        let threshold = THRESHOLD * self.exchange.max(&[largest])[0];
        let mut left = 0;
        for state in &mut self.states {
            for (active, force) in std::iter::zip(&mut state.active, &mut state.force) {
                // Not compressive leaves (26). Reactions of opposite sign give a ratio weight exactly zero.
                if *active && *force <= threshold {
                    (*active, *force) = (false, 0.0);
                    left += 1;
                }
            }
        }
        let total = sums[1].sqrt() + sums[2].sqrt();
        (if total > 0.0 { sums[0].sqrt() / total } else { 0.0 }, left)
    }

    /// Force step: the corrected forces act on all bodies; displacements and gaps are read off.
    pub fn solve_force_step(&mut self) -> Result<()> {
        let mut forces: Vec<Vec<f64>> = self.bodies.iter().map(|_| Vec::new()).collect();
        for (side, state) in std::iter::zip(self.sides, &self.states) {
            for (node, force) in std::iter::zip(&side.nodes, &state.force) {
                let rows = &mut forces[side.body];
                rows.resize(rows.len().max(node.row + 1), 0.0);
                rows[node.row] = *force;
            }
        }
        let steps = std::iter::zip(self.bodies.iter_mut(), &forces);
        let displacements = steps.map(|(body, force)| body.force_step(force)).collect::<Result<Vec<_>>>();
        let displacements = displacements.and_then(|u| {
            finite(u.iter().all(|u| all_finite(u.as_flattened())), "contact forces (force step)")?;
            Ok(u)
        });
        let displacements = self.exchange.agree(displacements)?;
        let own = |side: &Side| &displacements[side.body][side.observed.clone()];
        let out: Vec<Vec<f64>> = self.sides.iter().map(|side| own(side).as_flattened().to_vec()).collect();
        let received = self.exchange.swap(&out);
        for (i, (side, state)) in std::iter::zip(self.sides, &mut self.states).enumerate() {
            state.displacement = own(side).to_vec();
            state.other_displacement = received[i].as_chunks().0.to_vec();
            for (gap, node) in std::iter::zip(&mut state.gap, &side.nodes) {
                let other = Side::vector_at_conjugate(node, &state.other_displacement);
                let approach = sub(&state.displacement[node.node], &other);
                *gap = node.conjugate.gap - dot(&node.conjugate.normal, &approach);
            }
        }
        Ok(())
    }

    /// Open nodes that penetrate enter the contact; returns how many.
    pub fn enter(&mut self) -> usize {
        let mut entered = 0;
        for state in &mut self.states {
            for (active, gap) in std::iter::zip(&mut state.active, &state.gap) {
                if !*active && *gap < -self.gap_threshold {
                    *active = true;
                    entered += 1;
                }
            }
        }
        entered
    }

    /// All three must hold: the surfaces coincide, the forces agree, the contact set did not change.
    fn stop_test(&self, m: &Measures) -> Option<Reason> {
        let small = self.settings.tolerance * m.response + self.gap_threshold * (m.active as f64).sqrt();
        let agreed = m.jump <= small && m.force_imbalance <= self.settings.tolerance;
        match (m.flips, m.active) {
            (0, 0) => Some(Reason::Open),
            (0, _) if agreed => Some(Reason::Converged),
            (0, _) if m.unmatched > 0 && m.change <= 0.1 * small => Some(Reason::Unbalanced),
            (_, 0) => None,
            // The set emptied and the free bodies penetrate again: the start returns, and so would everything after it.
            (flips, active) if flips >= active && m.jump == 0.0 && self.all_forces_vanish() => {
                Some(Reason::Emptied)
            }
            _ => None,
        }
    }

    fn all_forces_vanish(&self) -> bool {
        let own = self.states.iter().flat_map(|s| &s.force).fold(0.0, |largest, f| larger(largest, f.abs()));
        self.exchange.max(&[own])[0] == 0.0
    }

    fn normal_displacements(&self, side: usize) -> Vec<f64> {
        let displacement = &self.states[side].displacement;
        let nodes = &self.sides[side].nodes;
        nodes.iter().map(|node| dot(&node.conjugate.normal, &displacement[node.node])).collect()
    }

    /// Norms over the active nodes of a quantity, own and other side.
    fn surface_norms(&self, quantity: impl Fn(&SideState, &ContactNode) -> f64) -> Vec<Both> {
        if self.settings.weights != Weights::ResponseSurface {
            return vec![Both::default(); self.sides.len()];
        }
        let own: Vec<Vec<f64>> = std::iter::zip(self.sides, &self.states)
            .map(|(side, state)| {
                let active = std::iter::zip(&side.nodes, &state.active).filter(|(_, active)| **active);
                vec![active.map(|(node, _)| quantity(state, node).powi(2)).sum::<f64>().sqrt()]
            })
            .collect();
        let other = self.exchange.swap(&own);
        std::iter::zip(own, other).map(|(own, other)| Both { own: own[0], other: other[0] }).collect()
    }

    fn count_active(&self) -> (usize, usize) {
        self.count_active_and(0)
    }

    /// Active nodes, and a count of this rank's, over all ranks.
    fn count_active_and(&self, count: usize) -> (usize, usize) {
        let active = self.states.iter().flat_map(|s| &s.active).filter(|a| **a).count();
        let sums = self.exchange.sum(&[active as f64, count as f64]);
        (sums[0] as usize, sums[1] as usize)
    }

    /// Largest penetration and largest gap at an active node, m, and the number of contact nodes, over all ranks.
    fn gaps(&self) -> [f64; 3] {
        let mut largest = [0.0_f64; 2];
        let mut nodes = 0.0;
        for state in &self.states {
            for (gap, active) in std::iter::zip(&state.gap, &state.active) {
                largest[0] = larger(largest[0], -gap);
                if *active {
                    largest[1] = larger(largest[1], gap.abs());
                }
                nodes += 1.0;
            }
        }
        let largest = self.exchange.max(&largest);
        [largest[0], largest[1], self.exchange.sum(&[nodes])[0]]
    }

    /// Hash of the contact set over all ranks.
    fn set(&self) -> u64 {
        let mut parts = 0.0;
        for (side, state) in std::iter::zip(self.sides, &self.states) {
            let mut hasher = DefaultHasher::new();
            (side.pair, side.first, &state.active).hash(&mut hasher);
            // 32 bits of each side add up exactly in a double, in any order.
            parts += (hasher.finish() >> 32) as f64;
        }
        self.exchange.sum(&[parts])[0] as u64
    }
}

/// The gate that no answer of a body passes which is not finite.
fn finite(is_finite: bool, question: &str) -> Result<()> {
    match is_finite {
        true => Ok(()),
        false => Err(Error::NotFinite(format!("the answer of a body to {question} is not a finite number"))),
    }
}

impl SideState {
    fn displacement_measures(&self, node: &ContactNode, surface: Both) -> weights::Displacements {
        let normal = &node.conjugate.normal;
        let own = self.displacement[node.node];
        let other = Side::vector_at_conjugate(node, &self.other_displacement);
        let own_response = sub(&own, &self.free[0][node.node]);
        let other_response = sub(&other, &Side::vector_at_conjugate(node, &self.free[1]));
        let both = |own: f64, other: f64| Both { own, other };
        weights::Displacements {
            normal: both(dot(normal, &own), dot(normal, &other)),
            magnitude: both(norm(&own), norm(&other)),
            response: both(dot(normal, &own_response), dot(normal, &other_response)),
            surface_response: surface,
        }
    }
}
