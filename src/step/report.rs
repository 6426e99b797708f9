//! What a driver found on the contact rows, for the results, for the bodies and for the next step.
use super::{
    contacts::Contacts,
    found::{EndFound, Found, Works},
    rows::Pair,
    state::{NodeState, PairState},
    task::{Scene, Solution, Task},
};
use crate::{
    body::Response,
    case::Tolerance,
    contact::{Coefficients, Law, Row, Surface, largest_force},
    record::Reason,
    schwarz::{ActiveSet, Coarse, Outcome, Projector, Respond, Touch},
    vector::larger,
};
use std::collections::HashSet;

/// Sagittas in doubt beyond this share of what the contact forces move the surfaces by change the pressure by as much.
const UNCLEAR: f64 = 0.01;

impl Contacts {
    /// What the driver found, for the results and for the bodies. Collective on the roots.
    pub(super) fn report(
        &self,
        task: &Task,
        driver: &ActiveSet<Response>,
        projector: &Projector,
        outcome: Outcome,
    ) -> (Found, Solution) {
        let Scene { case, plan, exchange } = task.scene;
        let mut found = Found::none();
        let untouched = case.contacts.is_empty() && outcome.reason.converged();
        found.reason = if untouched { Reason::NoContact } else { outcome.reason };
        found.history = outcome.history;
        (found.updates, found.gap_threshold) = (driver.updates as u64, driver.gap_threshold());
        (found.force_steps, found.displacement_steps) =
            (driver.coupling.steps.force as u64, driver.coupling.steps.displacement as u64);
        [found.free_modes, found.held_modes] = free_and_held_modes(task, driver.coarse, projector);
        if !found.reason.converged() {
            found.diagnosis = self.diagnose(task, &driver.flipped);
        }
        found.tolerance = driver.limits.tolerance;
        found.round_off = driver.round_off;
        if let (Some(residual), Tolerance::Fixed(_), 0) =
            (driver.round_off, case.alternation.tolerance, plan.groups.own)
        {
            found.warnings.push(format!(
                "round-off ends the alternation at a gap residual of {residual:.1e}, above the tolerance of {:.1e}",
                found.tolerance
            ));
        }
        // Mortar ends learn the row forces.
        let ranges = &driver.coupling.ranges;
        let out: Vec<Vec<f64>> = ranges.iter().map(|range| driver.force[range.clone()].to_vec()).collect();
        let received = exchange.swap(&out);
        let mut gaps: Vec<f64> = (0..driver.coupling.n).map(|j| driver.gap_at(j)).collect();
        for (end, range) in std::iter::zip(&self.shares.ends, ranges).filter(|(end, _)| end.multiplier) {
            let Some(pair) = self.pairs[end.pair].as_ref().filter(|pair| pair.law.is_frictional()) else {
                continue;
            };
            let along = range.start + pair.rows.len()..range.end;
            // Where supports hold both sides along each other nothing slips, whatever the frame makes of it.
            for (t, touch) in along.zip(driver.touch(range.clone())) {
                gaps[t] = if touch == Touch::Stick && !driver.active[t] { 0.0 } else { gaps[t] };
            }
        }
        let out_gaps: Vec<Vec<f64>> = ranges.iter().map(|range| gaps[range.clone()].to_vec()).collect();
        let received_gaps = exchange.swap(&out_gaps);
        // Where nothing touches, free bodies stay where they are unless the others would then penetrate them.
        let penetrates = driver.would_penetrate_at_rest();
        let holds = outcome.reason != Reason::Open || !penetrates;
        let unrestrained = projector.unrestrained.iter().filter(|_| holds);
        let modes = std::iter::zip(&task.modes.first, &task.modes.counts);
        let mut solution = Solution {
            unrestrained: unrestrained.map(|v| v.as_slice().to_vec()).collect(),
            force: driver.coupling.bodies.iter().map(|r| vec![0.0; r.n_rows()]).collect(),
            alpha: modes.map(|(&f, &count)| driver.alpha[f..f + count].to_vec()).collect(),
            relief: driver.coarse.relief(exchange, &driver.force),
            pairs: Vec::new(),
            influences: Vec::new(),
        };
        found.relieved = solution.relief.iter().any(|relief| *relief != 0.0);
        let elastic = driver.elastic_approach();
        let thickness = case.analysis.thickness();
        let before = self.known(task, task.before);
        let (states, works): (Vec<Vec<NodeState>>, Vec<Works>) = (0..ranges.len())
            .map(|i| {
                let end = &self.shares.ends[i];
                let Some(pair) = self.pairs[end.pair].as_ref().filter(|_| end.multiplier) else {
                    return Default::default();
                };
                let range = ranges[i].clone();
                let touch = driver.touch(range.clone());
                let initial = &self.shares.rows[i].gap;
                let coefficients = task.coefficients.get(i).map_or(&[][..], Vec::as_slice);
                let (mut states, works) = node_states(
                    (pair, coefficients),
                    &plan.surfaces[i],
                    &out[i],
                    [&gaps[range], initial],
                    &touch,
                    &before[i],
                );
                let key = (end.pair, plan.ends[i].side);
                if pair.law.is_frictional() {
                    states.extend(left_behind(task.before, key, &states));
                }
                let known = task.before.iter().find(|known| (known.pair, known.side) == key);
                let so_far = known.map_or(0.0, |known| known.dissipated);
                (states, Works { dissipated: so_far + works.dissipated, ..works })
            })
            .unzip();
        let told = |states: &Vec<NodeState>| states.iter().flat_map(|s| [s.status.code(), s.slip]).collect();
        let received_states = match case.has_friction() {
            true => exchange.swap(&states.iter().map(told).collect::<Vec<Vec<f64>>>()),
            false => vec![Vec::new(); ranges.len()],
        };
        found.warnings.extend(self.unclear_curves(task, &gaps, &elastic, &driver.active));
        for (i, end) in self.shares.ends.iter().enumerate() {
            let mut values = if end.multiplier { out[i].clone() } else { received[i].clone() };
            end.watched.iter().for_each(|&k| values[k] = 0.0);
            let values = &values[..];
            solution.force[end.body][end.rows.clone()].copy_from_slice(values);
            let Some(pair) = &self.pairs[end.pair] else { continue };
            let (surface, side) = (&plan.surfaces[i], plan.ends[i].side);
            if !end.multiplier {
                found.ends.push(EndFound::of_mortar(
                    surface,
                    end.pair,
                    side,
                    pair,
                    values,
                    &received_gaps[i],
                    &received_states[i],
                ));
                continue;
            }
            let range = ranges[i].clone();
            let touch = driver.touch(range.clone());
            let unmatched = pair.watched.iter().flatten().filter(|j| touch[**j] != Touch::Open).count();
            let of_range = [&gaps[range.clone()], &elastic[range]];
            let left = (&states[i][..], works[i]);
            let found_end = EndFound::of_multipliers(surface, side, pair, values, of_range, left, thickness);
            found.ends.push(EndFound { unmatched, ..found_end });
            let dissipated = works[i].dissipated;
            solution.pairs.push(PairState { pair: end.pair, side, nodes: states[i].clone(), dissipated });
        }
        (found, solution)
    }

    /// A warning for each pair whose gaps depend on what the nodes of a mesh do not tell: curve or polygon. `elastic`: what
    /// the contact forces change of each gap, m.
    fn unclear_curves(&self, task: &Task, gaps: &[f64], elastic: &[f64], active: &[bool]) -> Vec<String> {
        let mut warnings = Vec::new();
        let mut next = 0;
        for end in self.shares.ends.iter().filter(|end| end.multiplier) {
            let first = next;
            next += end.rows.len();
            let Some(pair) = self.pairs[end.pair].as_ref().filter(|pair| pair.law != Law::Tied) else {
                continue;
            };
            let near = (0..pair.rows.len()).filter(|j| active[first + j] || gaps[first + j] < pair.doubt[*j]);
            let doubt = near.map(|j| pair.doubt[j]).fold(0.0, larger);
            let elastic = elastic[first..first + pair.rows.len()].iter().copied().fold(0.0, larger);
            if doubt > UNCLEAR * elastic {
                warnings.push(format!(
                    "contact '{}': the nodes of a mesh from a file do not tell whether its sides are those of a polygon, which they \
                     are taken for, or of a coarse curve, which would lie {doubt:.1e} m from them; the contact forces move \
                     the surfaces by {elastic:.1e} m: use a finer mesh or quadratic cells",
                    task.scene.case.contacts[end.pair].name
                ));
            }
        }
        warnings
    }

    /// What a user can do about a failure: the nodes that do not settle, pair by pair, where they have rows of their own.
    fn diagnose(&self, task: &Task, flipped: &[usize]) -> Vec<String> {
        let mut lines = Vec::new();
        let mut first = 0;
        for (i, end) in self.shares.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let Some(pair) = &self.pairs[end.pair] else { continue };
            let range = first..first + pair.n_own;
            first += end.rows.len();
            let points: Vec<String> = flipped
                .iter()
                .filter(|j| range.contains(j))
                .map(|j| {
                    let x = task.scene.plan.surfaces[i].points[pair.rows[j - range.start].node as usize];
                    format!("({:.4e}, {:.4e})", x[0], x[1])
                })
                .collect();
            if !points.is_empty() {
                let shown = points.len().min(6);
                lines.push(format!(
                    "contact '{}': {} node(s) still change between {}, near {}{}",
                    task.scene.case.contacts[end.pair].name,
                    points.len(),
                    if pair.law.is_frictional() { "open, sticking and slipping" } else { "open and closed" },
                    points[..shown].join(", "),
                    if points.len() > shown { ", ..." } else { "" }
                ));
            }
        }
        lines
    }
}

/// The nodes of the multipliers as they are left, and their works in this step: the slips since the last accepted state are added
/// to those before. `initial`: gaps before the first step; `coefficients`: by row, empty: those of the law.
fn node_states(
    (pair, coefficients): (&Pair, &[Coefficients]),
    surface: &Surface,
    force: &[f64],
    [gap, initial]: [&[f64]; 2],
    touch: &[Touch],
    before: &[Option<NodeState>],
) -> (Vec<NodeState>, Works) {
    let n = pair.rows.len();
    let mut works = Works::default();
    let state = |(j, row): (usize, &Row)| {
        let before = before.get(j).copied().flatten();
        let slip = if touch[j].slips().is_some() { -gap[n + j] } else { 0.0 };
        // It slips at the bound, which goes with the normal force.
        let coefficients = coefficients.get(j).copied();
        let bound = |coefficients: Option<Coefficients>, force: f64| {
            largest_force(coefficients.unwrap_or(pair.law.coefficients()), force, row.area)
        };
        let was = || before.map_or(0.0, |b| bound(b.coefficients, b.force));
        let bounds = || 0.5 * (was() + bound(coefficients, force[j]));
        let work = if slip == 0.0 { 0.0 } else { bounds() * slip.abs() };
        works.dissipated += work;
        let tangential = force.get(n + j).copied().unwrap_or(0.0);
        if before.is_none_or(|b| b.status != touch[j]) {
            let [forces, along] = before.map_or([0.0; 2], |b| [b.force, b.tangential]);
            let closed = gap[j] - before.map_or(initial[j], |b| b.gap);
            // One that opens takes its tangential force along.
            let moved = gap.get(n + j).copied().unwrap_or(0.0);
            let taken = 0.5 * ((forces + force[j]) * closed + (along + tangential) * moved);
            works.beside -= taken + work;
        }
        NodeState {
            node: surface.nodes[row.node as usize],
            force: force[j],
            tangential,
            gap: gap[j],
            slip: before.map_or(0.0, |b| b.slip) + slip,
            status: touch[j],
            coefficients,
        }
    };
    (pair.own_rows().iter().enumerate().map(state).collect(), works)
}

/// The nodes of a side that were candidates at the last accepted state and, since the surfaces have moved on, are none now: they are open,
/// and what they slipped stays.
fn left_behind(before: &[PairState], (pair, side): (usize, usize), now: &[NodeState]) -> Vec<NodeState> {
    let here: HashSet<u32> = now.iter().map(|node| node.node).collect();
    let of_side = before.iter().filter(|old| (old.pair, old.side) == (pair, side)).flat_map(|old| &old.nodes);
    let gone = of_side.filter(|old| !here.contains(&old.node));
    gone.map(|old| NodeState { force: 0.0, tangential: 0.0, status: Touch::Open, ..*old }).collect()
}

/// "body\tmode" of each rigid motion of this rank's bodies: those that nothing restrains, and those that contact holds.
fn free_and_held_modes(task: &Task, coarse: &Coarse, projector: &Projector) -> [Vec<String>; 2] {
    let Scene { case, plan, .. } = task.scene;
    let free = projector.free_modes(task.modes.total);
    let [mut unheld, mut held] = [Vec::new(), Vec::new()];
    for (b, (&first, &n)) in std::iter::zip(&task.modes.first, &task.modes.counts).enumerate() {
        let body = &case.bodies[plan.groups.bodies()[b]].name;
        // Soft modes have a stiffness of their own.
        for k in (first..first + n).filter(|k| coarse.stiffness[*k] == 0.0) {
            let line = format!("{body}\t{}", (task.names)(b, k - first));
            if free.contains(&k) { unheld.push(line) } else { held.push(line) }
        }
    }
    [unheld, held]
}
