//! The paper's alternation: displacement step, force correction, force step, displacement correction.
//!
//! Each alternation is one Dirichlet-Dirichlet step followed by one Neumann-Neumann step (even and odd
//! iterations of the paper). The state reported is the one after the force step: action equals reaction, the gap as
//! converged. It needs bodies that stand without contact and answer displacements exactly.
use super::{
    ActiveSet, Interpolated, Outcome, Reason, Respond, Touch, Watch,
    frictional::Node,
    record::Snapshot,
    weights::{Correction, Sides, Weights},
};
use crate::tolerances::THRESHOLD;
use crate::{error::Result, record::HistoryRow};

/// Measures of one alternation, over all rows of all ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measures {
    /// Norm of the disagreement of the surfaces at active rows after the force step, m.
    pub jump: f64,
    /// Norm of the response to the contact forces at active rows, mean of both sides, m.
    pub response: f64,
    /// Norm of its change since the last alternation, m.
    pub change: f64,
    /// Disagreement of the forces after the displacement step, |R_m - R_s| / (|R_m| + |R_s|) of norms.
    pub force_imbalance: f64,
    /// Rows that touch.
    pub active: usize,
    /// Rows that touch and whose force acts on one side only.
    pub unmatched: usize,
    /// Rows that entered or left.
    pub flips: usize,
}

/// What is known of the contact at the last load step.
#[derive(Debug, Clone, Copy)]
pub struct Known<'k> {
    /// Row forces, N.
    pub force: &'k [f64],
    /// What the nodes did, end by end; may be left empty without friction.
    pub touch: &'k [Vec<Touch>],
}

/// The alternation on the rows of this rank.
pub struct Alternation<'s, 'c, 'a, B> {
    /// Forces, gaps and active rows.
    pub rows: &'s mut ActiveSet<'c, 'a, B>,
    weights: Weights,
    /// Outward displacements of the multiplier and the mortar sides without contact forces, m.
    free: [Vec<f64>; 2],
    /// How far the contact forces push them inwards, m.
    pushed: [Vec<f64>; 2],
    /// False until the bodies have felt a contact force: all weights start with 1/2, since displacements without
    /// contact forces say nothing of the stiffnesses.
    started: bool,
    /// What the weights look at of each row's pair.
    sides: Vec<Sides>,
    /// The nodes, with friction.
    pub(super) nodes: Option<Vec<Node>>,
    /// Rows that leave in tension, and enter in penetration.
    unilateral: Vec<bool>,
}

impl<'s, 'c, 'a, B: Respond> Alternation<'s, 'c, 'a, B> {
    /// Finds the rows that penetrate without contact forces, or under those that are known. Collective on the roots.
    pub fn new(rows: &'s mut ActiveSet<'c, 'a, B>, weights: Weights, known: Option<Known>) -> Result<Self> {
        rows.coupling.check_free(&rows.g_free)?;
        let n = rows.coupling.n;
        let free =
            rows.coupling.to_multipliers(|bodies, end| bodies[end.body].free()[end.rows.clone()].to_vec());
        let of_pair = |pair: &super::PairRows| {
            let held = move |k: usize| pair.held.get(k).copied().unwrap_or_default();
            let sides = move |k| Sides {
                multiplier: pair.side,
                compliance_ratio: pair.compliance_ratio,
                held: held(k),
            };
            (0..pair.gap.len()).map(sides).collect::<Vec<_>>()
        };
        let sides = rows.rows.iter().flat_map(of_pair).collect();
        let pushed = [vec![0.0; n], vec![0.0; n]];
        let nodes = rows.rubbing_nodes();
        let mut all =
            Alternation { rows, weights, free, pushed, started: false, sides, nodes, unilateral: Vec::new() };
        all.unilateral = all.unilateral();
        if let Some(known) = known {
            all.start_from(&known)?;
        }
        all.enter();
        Ok(all)
    }

    /// Begins with what is known. Collective on the roots.
    pub fn start_from(&mut self, known: &Known) -> Result<()> {
        self.rows.force = known.force.to_vec();
        self.rows.active = self.rows.compressed(known.force);
        self.begin_as(known.touch);
        self.force_step()
    }

    /// Alternates until the stop test or the watch ends it; `progress` sees every row. Collective on the roots.
    pub fn run(&mut self, mut progress: impl FnMut(&HistoryRow)) -> Result<Outcome> {
        if !self.rows.any_active() {
            return Ok(self.rows.outcome(Reason::Open));
        }
        // Jumps are measured by what they begin with.
        let mut watch = Watch::new(THRESHOLD * self.rows.largest(&self.rows.g_free));
        for _ in 0..self.rows.limits.max_alternations {
            let measures = self.alternate(&mut progress)?;
            let ended =
                self.stop_test(&measures).or_else(|| watch.observe(measures.jump, self.rows.set_hash()));
            if let Some(reason) = ended {
                return Ok(self.rows.outcome(reason));
            }
        }
        Ok(self.rows.outcome(Reason::MaxAlternations))
    }

    /// One alternation: displacement step, force correction (22), force step, displacements read off. Collective on the
    /// roots.
    pub fn alternate(&mut self, mut progress: impl FnMut(&HistoryRow)) -> Result<Measures> {
        let before = self.pushed.clone();
        let reactions = self.displacement_step()?;
        let (force_imbalance, mut left) = self.correct_forces(reactions);
        left.extend(self.limit_forces());
        self.force_step()?;
        let watched = self.watched();
        let mut sums = [0.0; 5];
        for j in (0..self.rows.coupling.n_rows).filter(|&j| self.rows.active[j]) {
            sums[0] += self.rows.gap[j].powi(2);
            for (pushed, before) in std::iter::zip(&self.pushed, &before) {
                sums[1] += 0.5 * pushed[j].powi(2);
                sums[2] += 0.5 * (pushed[j] - before[j]).powi(2);
            }
            sums[3] += f64::from(u8::from(watched[j]));
            sums[4] += 1.0;
        }
        let sums = self.rows.coupling.exchange.sum(&sums);
        let mut measures = Measures {
            jump: sums[0].sqrt(),
            response: sums[1].sqrt(),
            change: sums[2].sqrt(),
            force_imbalance,
            active: sums[4] as usize,
            unmatched: sums[3] as usize,
            flips: 0,
        };
        // Active rows are those whose surfaces were to agree; what enters now shows as a flip.
        let was_active = self.rows.active.clone();
        let entered = self.enter();
        let counts = self.rows.coupling.exchange.sum(&[entered.len() as f64, left.len() as f64]);
        measures.flips = (counts[0] + counts[1]) as usize;
        measures.active += counts[0] as usize;
        self.rows.flipped = left.into_iter().chain(entered).collect();
        let state = Snapshot {
            gaps: &self.rows.gap,
            active: &was_active,
            n_normal: &self.rows.rows.iter().map(|rows| rows.n_normal()).collect::<Vec<_>>(),
            flipped: &self.rows.flipped,
            scale: measures.response,
            imbalance: force_imbalance,
            update: 0,
        };
        progress(self.rows.recorder.record(self.rows.coupling, &state));
        Ok(measures)
    }

    /// Displacement step: the corrected displacements (21, 29) are prescribed at the active rows of all bodies; returns the
    /// compressive forces of the multiplier and the mortar sides, N.
    fn displacement_step(&mut self) -> Result<[Vec<f64>; 2]> {
        let n = self.rows.coupling.n;
        let measured = match self.weights {
            Weights::Magnitude if self.started => self.rows.coupling.distances(&self.rows.force)?,
            Weights::Component if self.started => [0, 1].map(|side| {
                std::iter::zip(&self.free[side], &self.pushed[side]).map(|(free, v)| free - v).collect()
            }),
            Weights::Response if self.started => self.lengths(self.pushed.clone()),
            Weights::ResponseSurface if self.started => self.norms(&self.pushed),
            _ => [vec![0.0; n], vec![0.0; n]],
        };
        let mut inward = [vec![0.0; n], vec![0.0; n]];
        for j in (0..self.rows.coupling.n_rows).filter(|&j| self.rows.active[j]) {
            let weight = self.weight(Correction::Displacement, &measured, j);
            inward[0][j] = -weight * self.rows.gap[j];
            inward[1][j] = -(1.0 - weight) * self.rows.gap[j];
        }
        let mut forces = self.rows.coupling.push([&inward[0], &inward[1]], &self.rows.active)?;
        // Before the step each body is in equilibrium with the forces as they are.
        for side in &mut forces {
            std::iter::zip(side, &self.rows.force).for_each(|(added, force)| *added += force);
        }
        self.interpolate(&mut forces);
        Ok(forces)
    }

    /// Where a row's force does not act on a side, what the forces of that side are at its place (28).
    fn interpolate(&self, forces: &mut [Vec<f64>; 2]) {
        for (pair, range) in std::iter::zip(self.rows.rows, &self.rows.coupling.ranges) {
            for (force, interpolated) in std::iter::zip(&mut *forces, &pair.interpolated) {
                let own = force[range.clone()].to_vec();
                for Interpolated { row, terms } in interpolated {
                    force[range.start + row] = terms.iter().map(|&(k, share)| share * own[k]).sum();
                }
            }
        }
    }

    /// Force correction (22); rows whose corrected force is tension leave the contact (26). Returns the force imbalance of
    /// the displacement step and the rows that left.
    fn correct_forces(&mut self, reactions: [Vec<f64>; 2]) -> (f64, Vec<usize>) {
        let measured = match self.weights {
            Weights::ResponseSurface => self.norms(&reactions),
            Weights::Magnitude | Weights::Response => self.lengths(reactions.clone()),
            _ => reactions.clone(),
        };
        let mut sums = [0.0; 3];
        let n_rows = self.rows.coupling.n_rows;
        for (j, (own, other)) in std::iter::zip(&reactions[0], &reactions[1]).take(n_rows).enumerate() {
            let weight = self.weight(Correction::Force, &measured, j);
            self.rows.force[j] = if self.rows.active[j] { own + weight * (other - own) } else { 0.0 };
            if self.rows.active[j] && self.sides[j].held == [false; 2] {
                sums[0] += (own - other).powi(2);
                sums[1] += own.powi(2);
                sums[2] += other.powi(2);
            }
        }
        let sums = self.rows.coupling.exchange.sum(&sums);
        let threshold = THRESHOLD * self.rows.largest(&self.rows.force);
        // Not compressive leaves (26). Reactions of opposite sign give a ratio weight exactly zero.
        let leaves =
            |j: &usize| self.rows.active[*j] && self.unilateral[*j] && self.rows.force[*j] <= threshold;
        let left: Vec<usize> = (0..self.rows.coupling.n_rows).filter(leaves).collect();
        for &j in &left {
            (self.rows.active[j], self.rows.force[j]) = (false, 0.0);
        }
        (crate::vector::ratio(sums[0].sqrt(), sums[1].sqrt() + sums[2].sqrt()), left)
    }

    /// Force step: the corrected forces act on all bodies; displacements and gaps are read off.
    fn force_step(&mut self) -> Result<()> {
        self.pushed = self.rows.coupling.force_step(&self.rows.force)?;
        let pushed = std::iter::zip(&self.pushed[0], &self.pushed[1]);
        self.rows.gap = std::iter::zip(&self.rows.g_free, pushed).map(|(g, (a, b))| g + a + b).collect();
        self.started = true;
        Ok(())
    }

    /// Open rows that penetrate enter the contact, sliding nodes may stick again: those that change.
    fn enter(&mut self) -> Vec<usize> {
        let (_, mut entering, _) = self.rows.violations();
        entering.retain(|&j| self.unilateral[j]);
        entering.iter().for_each(|&j| self.rows.active[j] = true);
        entering.extend(self.stick());
        entering
    }

    /// All three must hold: the surfaces coincide, the forces agree, the contact set did not change.
    fn stop_test(&self, m: &Measures) -> Option<Reason> {
        let tolerance = self.rows.limits.tolerance;
        let small = tolerance * m.response + self.rows.gap_threshold() * (m.active as f64).sqrt();
        let agreed = m.jump <= small && m.force_imbalance <= tolerance;
        let forceless = self.rows.largest(&self.rows.force) == 0.0;
        match (m.flips, m.active) {
            (0, 0) => Some(Reason::Open),
            (0, _) if agreed => Some(Reason::Converged),
            (0, _) if m.unmatched > 0 && m.change <= 0.1 * small => Some(Reason::Unbalanced),
            (_, 0) => None,
            // The set emptied and the free bodies penetrate again: the start returns, and so would everything after it.
            (flips, active) if flips >= active && m.jump == 0.0 && forceless => Some(Reason::Emptied),
            _ => None,
        }
    }

    /// Weight of a row's multiplier side.
    fn weight(&self, correction: Correction, measured: &[Vec<f64>; 2], j: usize) -> f64 {
        self.weights.at(correction, [measured[0][j], measured[1][j]], &self.sides[j])
    }

    /// At each row the norms over the active rows of its pair, multiplier side and mortar side.
    fn norms(&self, values: &[Vec<f64>; 2]) -> [Vec<f64>; 2] {
        [0, 1].map(|side| {
            let values = &values[side];
            let mut norms = vec![0.0; values.len()];
            for range in &self.rows.coupling.ranges {
                let active = range.clone().filter(|&j| self.rows.active[j]);
                norms[range.clone()].fill(active.map(|j| values[j] * values[j]).sum::<f64>().sqrt());
            }
            norms
        })
    }

    /// Rows whose force acts on one side only.
    fn watched(&self) -> Vec<bool> {
        let mut watched = vec![false; self.rows.coupling.n];
        for (pair, range) in std::iter::zip(self.rows.rows, &self.rows.coupling.ranges) {
            pair.interpolated.iter().flatten().for_each(|i| watched[range.start + i.row] = true);
        }
        watched
    }
}

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Runs the paper's alternation to its end; `known`: the last load step's. Collective on the roots.
    pub fn relax(
        &mut self,
        weights: Weights,
        known: Option<Known>,
        progress: impl FnMut(&HistoryRow),
    ) -> Result<Outcome> {
        Alternation::new(self, weights, known)?.run(progress)
    }
}
