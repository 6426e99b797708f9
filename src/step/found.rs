//! What a driver found, end by end of the pairs, whichever driver it was.
use super::{
    length::contact_length,
    rows::{Pair, turned},
    state::NodeState,
};
use crate::vector::{larger, worst};
use crate::{
    contact::{Law, Surface, largest_force, vector::combine},
    parallel,
    record::{HistoryRow, IN_CONTACT, Reason, SLIPS, SideTable, Tangential},
    schwarz::{self, Touch},
};
use mpi::topology::SimpleCommunicator;
use std::collections::HashMap;

/// The outcome of a load step, on the first rank of a group; mostly empty elsewhere.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    pub reason: Reason,
    pub history: Vec<HistoryRow>,
    pub updates: u64,
    pub force_steps: u64,
    pub displacement_steps: u64,
    /// Tolerance of the stop test at the end.
    pub tolerance: f64,
    /// This rank's ends of pairs.
    pub ends: Vec<EndFound>,
    /// Penetration below this is none, m.
    pub gap_threshold: f64,
    /// "body\tmode" of rigid motions that nothing restrains and on which the loads do no work.
    pub free_modes: Vec<String>,
    /// Likewise those that contact holds.
    pub held_modes: Vec<String>,
    pub diagnosis: Vec<String>,
    pub warnings: Vec<String>,
    /// Warnings of surfaces that have turned away from the normals they had.
    pub turned: Vec<String>,
    /// The residual that round-off leaves, if that is more than the tolerance.
    pub round_off: Option<f64>,
    /// Newton iterations of bodies that yield, and what each of the last increment left of the residual of equilibrium.
    pub iterations: u64,
    #[allow(missing_docs)]
    pub residuals: Vec<f64>,
    /// Something else than the contact forces takes up what these do on motions along faceted surfaces.
    pub relieved: bool,
}

/// One end of a pair.
#[derive(Debug, Clone)]
pub(crate) struct EndFound {
    pub pair: usize,
    /// Side in the case: 0 is A.
    pub side: usize,
    /// True if the numbers of the pair are counted at this end.
    pub counts: bool,
    /// True if the pair's multipliers are on this end's side.
    pub multiplier: bool,
    pub table: SideTable,
    pub normal_force: f64,
    /// Length in contact, m, where the pair is counted.
    pub length: f64,
    pub active: usize,
    pub candidates: usize,
    /// Nodes of both sides in contact without a conjugate node: the paper's transfer only.
    pub unmatched: usize,
    /// Largest penetration of a candidate, and of a node beyond the candidates, m.
    pub penetration: f64,
    pub beyond: f64,
    /// Largest |pressure x gap|, and the largest gap or travel, m.
    pub complementarity: [f64; 2],
    /// Largest elastic approach at a candidate, m.
    pub approach: f64,
    /// Largest overlap of the undeformed bodies at a candidate, m.
    pub overlap: f64,
    /// Of the end with the multipliers of a pair with a tangential law.
    pub rubbing: Option<Rubbing>,
    /// Of the end with the multipliers: what nodes take from the loads that change their state in this step, beyond the work of
    /// their friction, if forces and displacements are taken as growing together, J: no force acts through a gap that closes,
    /// and what begins to slip does so at its bound.
    pub beside: f64,
}

/// Works at the nodes of a pair, J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Works {
    /// Of friction in all.
    pub dissipated: f64,
    /// See [`EndFound::beside`].
    pub beside: f64,
}

/// What the surfaces of a pair do along each other.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Rubbing {
    /// Sum of the tangential forces on the side of the multipliers, along its outward normal turned forwards, N.
    pub force: f64,
    /// Work of friction so far, J.
    pub dissipated: f64,
    /// Lengths that stick and slip, m.
    pub lengths: [f64; 2],
    /// Nodes that stick and slip.
    pub nodes: [usize; 2],
    /// Largest slip in all, m.
    pub slip: f64,
    /// Largest tangential force beyond the bound, N.
    pub beyond: f64,
    /// Largest slip of this step the way the tangential force pulls, m, and largest slip of a node that sticks.
    pub astray: f64,
    /// Largest force of a node, N.
    pub scale: f64,
}

impl Rubbing {
    /// `states`: of the rows, then those of nodes that have none any more; `slips`: of this step by row; `dissipated`: work of friction
    /// so far, J; `thickness`, m.
    fn new(data: &Pair, states: &[NodeState], slips: &[f64], dissipated: f64, thickness: f64) -> Rubbing {
        let mut rubbing = Rubbing { dissipated, ..Rubbing::default() };
        for (j, (row, node)) in std::iter::zip(data.own_rows(), states).enumerate() {
            rubbing.slip = larger(rubbing.slip, node.slip.abs());
            let kind = match node.status {
                Touch::Open => continue,
                Touch::Stick => 0,
                Touch::Forwards | Touch::Backwards => 1,
            };
            rubbing.force -= node.tangential;
            rubbing.lengths[kind] += row.area / thickness;
            rubbing.nodes[kind] += 1;
            let astray = match node.status.slips() {
                Some(sign) => -sign * slips[j],
                None => slips[j].abs(),
            };
            rubbing.astray = larger(rubbing.astray, astray);
            rubbing.scale = larger(rubbing.scale, larger(node.force.abs(), node.tangential.abs()));
            if data.law.friction().is_finite() {
                let coefficients = node.coefficients.unwrap_or(data.law.coefficients());
                let bound = largest_force(coefficients, node.force, row.area);
                rubbing.beyond = larger(rubbing.beyond, node.tangential.abs() - bound);
            }
        }
        rubbing
    }
}

impl Found {
    pub fn none() -> Found {
        Found {
            reason: Reason::NoContact,
            history: Vec::new(),
            updates: 0,
            force_steps: 0,
            displacement_steps: 0,
            tolerance: schwarz::AUTOMATIC[1],
            ends: Vec::new(),
            gap_threshold: 0.0,
            free_modes: Vec::new(),
            held_modes: Vec::new(),
            diagnosis: Vec::new(),
            warnings: Vec::new(),
            turned: Vec::new(),
            round_off: None,
            iterations: 0,
            residuals: Vec::new(),
            relieved: false,
        }
    }

    /// Where a node beyond the candidates penetrates, this is no solution. Collective.
    pub fn refuse_penetration(&mut self, world: &SimpleCommunicator) {
        let deepest = self.ends.iter().map(|end| end.beyond).fold(0.0, larger);
        let [deepest, threshold] = parallel::max(world, &[deepest, self.gap_threshold])[..] else { return };
        if deepest > threshold && self.reason.converged() {
            self.reason = Reason::Penetration;
        }
    }

    /// Puts the history and the counts of what was tried before in front of its own.
    pub fn prepend(&mut self, mut before: Found) {
        for row in &mut self.history {
            row.alternation += before.history.len() as u64;
            row.update += before.updates;
        }
        before.history.append(&mut self.history);
        self.history = before.history;
        self.updates += before.updates;
        self.iterations += before.iterations;
        self.force_steps += before.force_steps;
        self.displacement_steps += before.displacement_steps;
    }
}

impl EndFound {
    /// The end with the multipliers: pressures and gaps are those of the rows. `elastic`: what the contact forces
    /// change of each gap; where all nodes touch from the start, there is no other length to measure a gap by.
    pub fn of_multipliers(
        surface: &Surface,
        side: usize,
        data: &Pair,
        force: &[f64],
        [gaps, elastic]: [&[f64]; 2],
        (states, works): (&[NodeState], Works),
        thickness: f64,
    ) -> EndFound {
        let mut table = SideTable { multipliers: true, ..empty_table(surface) };
        table.tangential = data.law.is_frictional().then(|| no_slip(surface));
        let active: Vec<bool> = states.iter().map(|node| node.status != Touch::Open).collect();
        let mut complementarity = [0.0_f64; 2];
        // The nodes of the other side, if they have rows of their own, have an end of their own.
        let n = data.n_own;
        let along = &force[data.rows.len()..];
        let slips: Vec<f64> = gaps.iter().skip(data.rows.len()).map(|y| -y).collect();
        let rubbing =
            data.law.is_frictional().then(|| Rubbing::new(data, states, &slips, works.dissipated, thickness));
        table.bonded = data.law == Law::Tied;
        let [gaps, elastic, force] = [&gaps[..n], &elastic[..n], &force[..n]];
        for (j, row) in data.own_rows().iter().enumerate() {
            let i = row.node as usize;
            table.normal[i] = row.normal;
            table.gap[i] = gaps[j];
            table.pressure[i] = force[j] / row.area;
            table.status[i] = match states[j].status {
                Touch::Open => 1,
                Touch::Stick => IN_CONTACT,
                Touch::Forwards | Touch::Backwards => SLIPS,
            };
            add_forces(&mut table, &row.terms[0], force[j]);
            if let Some(tangential) = &mut table.tangential {
                tangential.traction[i] = -along[j] / row.area;
                tangential.slip[i] = states[j].slip;
                add_forces(&mut table, &turned(&row.terms[0]), along[j]);
            }
            complementarity[0] = larger(complementarity[0], (table.pressure[i] * gaps[j]).abs());
            let lengths = [gaps[j].abs(), row.gap.abs(), (row.gap - gaps[j]).abs(), elastic[j]];
            complementarity[1] = lengths.into_iter().fold(complementarity[1], larger);
        }
        let touches: Vec<bool> = (0..table.status.len()).map(|i| table.touches(i)).collect();
        let length = contact_length(surface, &data.cover, &table.pressure, &touches);
        EndFound {
            length,
            pair: data.number,
            side,
            counts: true,
            multiplier: true,
            table,
            normal_force: force.iter().sum(),
            active: active.iter().filter(|a| **a).count(),
            candidates: n,
            unmatched: 0,
            // Bonded surfaces must not open either.
            penetration: worst(gaps.iter().map(|g| if data.law == Law::Tied { g.abs() } else { -g })),
            beyond: 0.0,
            complementarity,
            approach: worst(elastic.iter().copied()),
            overlap: data.rows.iter().map(|row| -data.gap_of(row)).fold(0.0, larger),
            rubbing,
            beside: works.beside,
        }
    }

    /// The mortar end: nodal forces by the transposed operator. Pressure and gap are those of the rows, interpolated between
    /// the two multiplier nodes on either side of the point opposite. The nodal forces over their areas would be rougher:
    /// they are means of multipliers that jump from facet to facet.
    pub fn of_mortar(
        surface: &Surface,
        pair: usize,
        side: usize,
        data: &Pair,
        force: &[f64],
        gaps: &[f64],
        states: &[f64],
    ) -> EndFound {
        // Of each row its node's state and slip.
        let (states, _) = states.as_chunks::<2>();
        let slides = |j: usize| states.get(j).is_some_and(|state| Touch::of_code(state[0]).slips().is_some());
        let mut table = empty_table(surface);
        table.tangential = data.law.is_frictional().then(|| no_slip(surface));
        let (force, along) = force.split_at(data.rows.len());
        for (row, along) in std::iter::zip(&data.rows, along) {
            add_forces(&mut table, &turned(&row.terms[1]), *along);
        }
        for (j, (row, force)) in std::iter::zip(&data.rows, force).enumerate() {
            if data.watched[1].contains(&j) {
                continue;
            }
            add_forces(&mut table, &row.terms[1], *force);
            for (node, _) in &row.terms[1] {
                let status = &mut table.status[*node as usize];
                *status = (*status).max(if *force != 0.0 { IN_CONTACT } else { 1 });
            }
        }
        let row_at: HashMap<u32, usize> =
            data.rows.iter().enumerate().map(|(j, row)| (row.node, j)).collect();
        for (i, opposite) in data.opposite.iter().enumerate() {
            let Some(between) = opposite else { continue };
            // Where a node has no row nothing presses, and no gap is known.
            let rows = between.map(|(node, weight)| (row_at.get(&node).copied(), weight));
            let of = |value: &dyn Fn(usize) -> f64, missing: f64| -> f64 {
                let used = rows.iter().filter(|(_, weight)| *weight > 0.0);
                used.map(|(row, weight)| weight * row.map_or(missing, value)).sum()
            };
            table.pressure[i] = of(&|j| force[j] / data.rows[j].area, 0.0);
            table.gap[i] = of(&|j| gaps[j], f64::NAN);
            // A force without pressure is the rest of a facet that touches further on.
            if table.status[i] > 0 {
                table.status[i] = if table.pressure[i] != 0.0 { IN_CONTACT } else { 1 };
            }
            if let Some(tangential) = &mut table.tangential {
                tangential.traction[i] = of(&|j| -along[j] / data.rows[j].area, 0.0);
                tangential.slip[i] = of(&|j| states[j][1], 0.0);
                // Between two nodes that slip.
                let slips =
                    rows.iter().filter(|(_, weight)| *weight > 0.0).all(|(row, _)| row.is_some_and(slides));
                if slips && table.status[i] == IN_CONTACT {
                    table.status[i] = SLIPS;
                }
            }
        }
        EndFound {
            pair,
            side,
            counts: false,
            multiplier: false,
            table,
            normal_force: 0.0,
            length: 0.0,
            active: 0,
            candidates: 0,
            unmatched: 0,
            penetration: 0.0,
            beyond: 0.0,
            complementarity: [0.0; 2],
            approach: 0.0,
            overlap: 0.0,
            rubbing: None,
            beside: 0.0,
        }
    }
}

/// A table of a surface without contact.
pub(crate) fn empty_table(surface: &Surface) -> SideTable {
    let n = surface.nodes.len();
    SideTable {
        s: surface.s.clone(),
        x: surface.points.clone(),
        normal: surface.normals.clone(),
        gap: vec![f64::NAN; n],
        pressure: vec![0.0; n],
        force: vec![[0.0; 3]; n],
        status: vec![0; n],
        tangential: None,
        bonded: false,
        multipliers: false,
        closed: surface.closed_length(),
    }
}

/// No traction and no slip along a surface.
fn no_slip(surface: &Surface) -> Tangential {
    let n = surface.nodes.len();
    Tangential { traction: vec![0.0; n], slip: vec![0.0; n] }
}

/// Adds the force -f v_i at the nodes of a row.
fn add_forces(table: &mut SideTable, terms: &[(u32, [f64; 3])], f: f64) {
    for (node, v) in terms {
        let sum = &mut table.force[*node as usize];
        *sum = combine([(1.0, &*sum), (-f, v)]);
    }
}
