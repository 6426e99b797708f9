//! The contact rows of this rank's pairs: found, followed as the surfaces move, and given to the driver.
use super::{
    Plan,
    active::Step,
    found::{EndFound, Found},
    rows::{Pair, Shares, both_surfaces, held_nodes, pair_rows, rigid_motion},
};
use crate::vector::{larger, smaller, worst};
use crate::{
    body::{BodyRow, Constraints, FreeModes, Response, RigidMode, mesh_extent, name_bodies, name_motion},
    case::{Case, ContactGeometry, Gap, Tolerance},
    contact::{Row, Surface, vector::dot},
    error::{Error, Result},
    estimate::pressure::{self, Chain},
    parallel::Exchange,
    record::{HistoryRow, Reason},
    schwarz::{AUTOMATIC, ActiveSet, Coarse, Coupling, End, Limits, Respond},
};
use std::collections::HashMap;

/// Pairs and rows as the first rank of a group holds them.
pub(super) struct Contacts {
    pub pairs: Vec<Option<Pair>>,
    pub shares: Shares,
    held: Vec<[Vec<bool>; 2]>,
    /// Row forces of the last step, by row, and those of springs if they are known.
    warm: Option<Vec<f64>>,
}

/// The deformed geometry that the rows were taken from.
#[derive(Default)]
pub(super) struct Geometry {
    pub solution: Solution,
    /// Per body: displacement of its interface nodes, m; empty before the first update.
    pub displacement: Vec<Vec<[f64; 3]>>,
    /// Gap of each row of each end at zero displacement, as seen from the deformed geometry, m.
    gaps: Option<Vec<Vec<f64>>>,
}

/// Row forces and mode amplitudes of this rank's bodies.
#[derive(Default)]
pub(super) struct Solution {
    pub force: Vec<Vec<f64>>,
    pub alpha: Vec<Vec<f64>>,
    /// Motions of all modes that nothing restrains; the same on all first ranks.
    pub unrestrained: Vec<Vec<f64>>,
}

/// What a solve needs to know.
pub(super) struct Task<'t, 'e> {
    pub step: Step<'t, 'e>,
    pub geometry: &'t Geometry,
    /// First mode and number of modes of each of this rank's bodies.
    pub first_mode: &'t [usize],
    pub counts: &'t [usize],
    pub n_modes: usize,
    pub names: &'t dyn Fn(usize, usize) -> String,
}

/// Overlap over the size of a body from which on it is no fit: the tightest shrink fits of machines have 0.3 % of the
/// diameter (ISO 286, p to zc), and the strain is about as large.
const NO_FIT: f64 = 1e-2;

/// `gap from 1e-5 to 2e-5`, `overlap up to 1e-6`, `touching`.
fn gap_in_words(rows: &[Row]) -> String {
    let [least, most] = rows
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], row| [smaller(a, row.gap), larger(b, row.gap)]);
    match rows.is_empty() {
        true => "no node has a counterpart within the search distance".into(),
        false if least < 0.0 && most > 0.0 => format!("overlap up to {:.3e}, gap up to {most:.3e}", -least),
        false if least < 0.0 => format!("overlap {:.3e} to {:.3e}", -most, -least),
        false if most == 0.0 => "touching".into(),
        false => format!("gap {least:.3e} to {most:.3e}"),
    }
}

impl Contacts {
    /// Number of nodes of a body of this rank that contact may reach.
    pub fn interface_nodes(&self, place: usize) -> usize {
        self.shares.interface[place].len()
    }

    /// A line on each pair whose multipliers are here.
    pub fn outlook(&self, case: &Case) -> Vec<String> {
        let ends = ends_with_rows(&self.shares.ends, &self.pairs);
        ends.map(|(end, rows)| {
            let contact = &case.contacts[end.pair];
            let side = self.pairs[end.pair].as_ref().map_or(0, |p| p.multiplier);
            let name = &contact.surfaces[side];
            let geometry = match contact.geometry {
                ContactGeometry::Initial => "initial",
                ContactGeometry::Updated => "updated",
            };
            format!(
                "contact {}: {} candidates, {}; multipliers on {}.{}, frictionless, {} transfer, {geometry} geometry",
                contact.name,
                rows.len(),
                gap_in_words(rows),
                case.body_name(name.body),
                name.surface,
                case.alternation.transfer.name(),
            )
        })
        .collect()
    }

    /// Overlaps at the start that no fit has, of the pairs whose multipliers are here.
    pub fn overlaps(&self, case: &Case, plan: &Plan) -> Vec<String> {
        let ends = ends_with_rows(&self.shares.ends, &self.pairs);
        let warning = |(end, rows): (&End, &[Row])| {
            let overlap = worst(rows.iter().map(|row| -row.gap));
            let size = mesh_extent(&plan.meshes[end.body].points);
            (overlap > NO_FIT * size).then(|| {
                format!(
                    "contact '{}': the surfaces overlap by up to {overlap:.3e} at the start, {:.1} % of the size of the body \
                     ({size:.3e}): no fit has so much; look at positions, units and gap",
                    case.contacts[end.pair].name,
                    100.0 * overlap / size
                )
            })
        };
        ends.filter_map(warning).collect()
    }

    pub fn new(case: &Case, plan: &Plan, exchange: &Exchange) -> Result<Contacts> {
        for contact in case.contacts.iter().filter(|c| c.geometry == ContactGeometry::Updated) {
            if let Gap::Value(_) = contact.gap {
                return Err(contact.origin.error(
                    "geometry = \"updated\" follows the gap between the surfaces, which 'gap' replaces by a number; \
                     'gap_offset' goes with it",
                ));
            }
        }
        let held = exchange.agree(held_nodes(case, plan, exchange))?;
        let surfaces = both_surfaces(case, plan, exchange, &plan.surfaces);
        let pairs = pair_rows(case, plan, &surfaces, &held);
        let mut interface = vec![Vec::new(); plan.groups.bodies().len()];
        for (surface, &(pair, _, body)) in std::iter::zip(&plan.surfaces, &plan.ends) {
            if case.contacts[pair].geometry == ContactGeometry::Updated {
                interface[plan.place(body)].extend(&surface.nodes);
            }
        }
        interface.iter_mut().for_each(|nodes: &mut Vec<u32>| {
            nodes.sort_unstable();
            nodes.dedup();
        });
        let shares = Shares::new(case, plan, &pairs, Some(&interface));
        Ok(Contacts { pairs, shares, held, warm: None })
    }

    pub fn follow(&mut self, step: &Step, geometry: &mut Geometry) {
        let Step { case, plan, exchange, factors, .. } = *step;
        let interface = self.shares.interface.clone();
        let places: Vec<HashMap<u32, usize>> =
            interface.iter().map(|nodes| nodes.iter().enumerate().map(|(k, &n)| (n, k)).collect()).collect();
        let at = |place: usize, node: u32| -> [f64; 3] {
            places[place].get(&node).map_or([0.0; 3], |&k| geometry.displacement[place][k])
        };
        let is_updated = |pair: usize| case.contacts[pair].geometry == ContactGeometry::Updated;
        let moved: Vec<Surface> = std::iter::zip(&plan.surfaces, &plan.ends)
            .map(|(surface, &(pair, _, body))| {
                if !is_updated(pair) {
                    return surface.clone();
                }
                let place = plan.place(body);
                let u: Vec<[f64; 3]> = surface.nodes.iter().map(|&n| at(place, n)).collect();
                surface.moved(&u)
            })
            .collect();
        let mut surfaces = both_surfaces(case, plan, exchange, &moved);
        for (i, &(pair, side, _)) in plan.ends.iter().enumerate() {
            if let (true, Some(motion)) = (is_updated(pair), rigid_motion(case, pair, 1 - side)) {
                let u = motion.map(|m| factors.supports * m);
                surfaces[i][1] = surfaces[i][1].moved(&vec![u; surfaces[i][1].nodes.len()]);
            }
        }
        let pairs = pair_rows(case, plan, &surfaces, &self.held);
        let shares = Shares::new(case, plan, &pairs, Some(&interface));
        // Forces go with the multiplier's node.
        if let Some(warm) = &self.warm {
            let mut by_node = HashMap::new();
            let mut next = 0;
            for (end, old) in ends_with_rows(&self.shares.ends, &self.pairs) {
                for row in old {
                    by_node.insert((end.pair, row.node), warm[next]);
                    next += 1;
                }
            }
            let of = |end: &End, row: &Row| by_node.get(&(end.pair, row.node)).copied().unwrap_or(0.0);
            let moved = ends_with_rows(&shares.ends, &pairs);
            self.warm =
                Some(moved.flat_map(|(end, rows)| rows.iter().map(move |row| of(end, row))).collect());
        }
        // What the rows' own displacements would be of the present motion.
        let present: Vec<Vec<f64>> = shares
            .ends
            .iter()
            .map(|end| {
                let displaced = |row: &BodyRow| -> f64 {
                    row.terms.iter().map(|(k, v)| dot(v, &geometry.displacement[end.body][*k])).sum()
                };
                shares.body_rows[end.body][end.rows.clone()].iter().map(displaced).collect()
            })
            .collect();
        let out: Vec<Vec<f64>> = std::iter::zip(&shares.ends, &present)
            .map(|(end, p)| if end.multiplier { Vec::new() } else { p.clone() })
            .collect();
        let received = exchange.swap(&out);
        let gaps = shares.ends.iter().enumerate().map(|(i, end)| {
            if !end.multiplier {
                return Vec::new();
            }
            let rows = pairs[end.pair].as_ref().map_or(&[][..], |p| &p.rows);
            let other = |j: usize| received[i].get(j).copied().unwrap_or(0.0);
            rows.iter()
                .enumerate()
                .map(|(j, row)| row.gap + if is_updated(end.pair) { present[i][j] + other(j) } else { 0.0 })
                .zip(pairs[end.pair].iter().flat_map(|p| &p.rigid_motion))
                .map(|(gap, motion)| gap + if is_updated(end.pair) { factors.supports * motion } else { 0.0 })
                .collect()
        });
        geometry.gaps = Some(gaps.collect());
        self.pairs = pairs;
        self.shares = shares;
    }

    /// Runs the driver on the rows as they are. Collective on the roots, the other ranks serving.
    pub fn solve(
        &mut self,
        task: &Task,
        responses: &mut [Response],
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<(Found, Solution)> {
        let Step { case, plan, exchange, number, factors } = task.step;
        let mut rows = self.shares.rows.clone();
        for (i, end) in self.shares.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let Some(pair) = &self.pairs[end.pair] else { continue };
            let updated = case.contacts[end.pair].geometry == ContactGeometry::Updated;
            if let (true, Some(gaps)) = (updated, &task.geometry.gaps) {
                rows[i].gap = gaps[i].clone();
            }
            // A rigid surface's motion is given.
            std::iter::zip(&mut rows[i].gap, &pair.rigid_motion)
                .for_each(|(gap, motion)| *gap -= factors.supports * motion);
        }
        let mut coupling = Coupling::new(responses, &self.shares.ends, exchange);
        coupling.names = plan.groups.bodies().iter().map(|&b| case.bodies[b].name.clone()).collect();
        let scaling: Vec<f64> =
            rows.iter().flat_map(|rows| std::iter::repeat_n(rows.stiffness, rows.gap.len())).collect();
        let coarse = Coarse::new(&coupling, task.n_modes, task.first_mode, scaling);
        let (start, automatic) = match case.alternation.tolerance {
            Tolerance::Automatic => (AUTOMATIC[0], true),
            Tolerance::Fixed(tolerance) => (tolerance, false),
        };
        let limits = Limits { tolerance: start, max_alternations: case.alternation.max_alternations };
        let n_pairs = case.contacts.len();
        let mut driver = ActiveSet::new(&mut coupling, &rows, &coarse, limits, n_pairs, number);
        let chains: Vec<Chain> =
            if automatic { plan.surfaces.iter().map(Chain::new).collect() } else { Vec::new() };
        let ranges = driver.coupling.ranges.clone();
        let (ends, pairs) = (&self.shares.ends, &self.pairs);
        let mesh_error = move |force: &[f64], active: &[bool]| {
            let of_end = |i: usize| {
                let rows = &pairs[ends[i].pair].as_ref().filter(|_| ends[i].multiplier)?.rows;
                let range = ranges[i].clone();
                pressure_error(&chains[i], rows, &force[range.clone()], &active[range])
            };
            (0..ends.len()).filter_map(of_end).fold(f64::INFINITY, smaller)
        };
        if automatic {
            driver.mesh_error = Some(&mesh_error);
        }
        let mut not_finite = None;
        let outcome = match driver.run(self.warm.as_deref(), progress) {
            Ok(Ok(outcome)) => outcome,
            Ok(Err(motion)) => return Err(unrestrained(task, &motion)),
            // The state is that before the answer.
            Err(Error::NotFinite(what)) => {
                not_finite = Some(what);
                driver.outcome(Reason::NotFinite)
            }
            Err(error) => return Err(error),
        };
        let projector = coarse.projector(exchange, &driver.active);
        let free: Vec<usize> = projector.free_modes(task.n_modes);
        if let (true, Some(motion)) = (outcome.reason.converged(), projector.driven(&coarse.work)) {
            return Err(unrestrained(task, &motion));
        }
        let gaps: Vec<f64> = (0..driver.coupling.n).map(|j| driver.gap_at(j)).collect();
        let elastic = driver.elastic_approach();
        let threshold = driver.gap_threshold();
        let mut found = Found::none();
        found.reason =
            if n_pairs == 0 && outcome.reason.converged() { Reason::NoContact } else { outcome.reason };
        found.history = outcome.history;
        (found.updates, found.gap_threshold) = (driver.updates as u64, threshold);
        (found.force_steps, found.displacement_steps) =
            (driver.coupling.steps.force as u64, driver.coupling.steps.displacement as u64);
        for (b, &first) in task.first_mode.iter().enumerate() {
            let body = &case.bodies[plan.groups.bodies()[b]].name;
            // Soft modes have a stiffness of their own.
            for k in (first..first + task.counts[b]).filter(|k| coarse.stiffness[*k] == 0.0) {
                let line = format!("{body}\t{}", (task.names)(b, k - first));
                if free.contains(&k) { found.free_modes.push(line) } else { found.held_modes.push(line) }
            }
        }
        if !found.reason.converged() {
            found.diagnosis = self.diagnose(task, &driver.flipped);
            // All first ranks have agreed on it.
            found.diagnosis.extend(not_finite.filter(|_| plan.groups.own == 0));
        }
        found.tolerance = driver.limits.tolerance;
        if let (Some(residual), Tolerance::Fixed(_), 0) =
            (driver.round_off, case.alternation.tolerance, plan.groups.own)
        {
            found.warnings.push(format!(
                "round-off ends the alternation at a gap residual of {residual:.1e}, above the tolerance of {:.1e}",
                found.tolerance
            ));
        }
        let (force, alpha, active) = (driver.force.clone(), driver.alpha.clone(), driver.active.clone());
        let ranges = driver.coupling.ranges.clone();
        self.warm = Some(force.clone());
        // Mortar ends learn the row forces.
        let out: Vec<Vec<f64>> = ranges.iter().map(|range| force[range.clone()].to_vec()).collect();
        let received = exchange.swap(&out);
        // Where nothing touches, free bodies stay where they are unless the others would then penetrate them.
        let penetrates = driver.would_penetrate_at_rest();
        let holds = outcome.reason != Reason::Open || !penetrates;
        let mut solution = Solution {
            unrestrained: projector
                .unrestrained
                .iter()
                .filter(|_| holds)
                .map(|v| v.as_slice().to_vec())
                .collect(),
            force: responses.iter().map(|r| vec![0.0; r.n_rows()]).collect(),
            alpha: std::iter::zip(task.first_mode, task.counts)
                .map(|(&f, &count)| alpha[f..f + count].to_vec())
                .collect(),
        };
        for (i, end) in self.shares.ends.iter().enumerate() {
            let values = if end.multiplier { &out[i] } else { &received[i] };
            solution.force[end.body][end.rows.clone()].copy_from_slice(values);
            let Some(pair) = &self.pairs[end.pair] else { continue };
            let (surface, side) = (&plan.surfaces[i], plan.ends[i].1);
            found.ends.push(if end.multiplier {
                let range = ranges[i].clone();
                EndFound::of_multipliers(
                    surface,
                    end.pair,
                    side,
                    pair,
                    &force[range.clone()],
                    [&gaps[range.clone()], &elastic[range.clone()]],
                    &active[range],
                )
            } else {
                EndFound::of_mortar(surface, end.pair, side, pair, values)
            });
        }
        Ok((found, solution))
    }

    /// What a user can do about a failure: the nodes that do not settle, pair by pair.
    fn diagnose(&self, task: &Task, flipped: &[usize]) -> Vec<String> {
        let mut lines = Vec::new();
        let mut first = 0;
        for (i, end) in self.shares.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let Some(pair) = &self.pairs[end.pair] else { continue };
            let range = first..first + pair.rows.len();
            first = range.end;
            let points: Vec<String> = flipped
                .iter()
                .filter(|j| range.contains(j))
                .map(|j| {
                    let x = task.step.plan.surfaces[i].points[pair.rows[j - range.start].node as usize];
                    format!("({:.4e}, {:.4e})", x[0], x[1])
                })
                .collect();
            if !points.is_empty() {
                let shown = points.len().min(6);
                lines.push(format!(
                    "contact '{}': {} node(s) still change between open and closed, near {}{}",
                    task.step.case.contacts[end.pair].name,
                    points.len(),
                    points[..shown].join(", "),
                    if points.len() > shown { ", ..." } else { "" }
                ));
            }
        }
        lines
    }
}

/// Relative error of the pressure that row forces show; `None` if none of them is in contact.
fn pressure_error(chain: &Chain, rows: &[Row], force: &[f64], active: &[bool]) -> Option<f64> {
    let mut pressure = vec![0.0; chain.len()];
    let mut contact = vec![pressure::Contact::None; chain.len()];
    for (row, (force, active)) in std::iter::zip(rows, std::iter::zip(force, active)) {
        pressure[row.node as usize] = force / row.area;
        contact[row.node as usize] =
            if *active { pressure::Contact::Closed } else { pressure::Contact::Open };
    }
    pressure::relative(&pressure, &chain.errors(&pressure, &contact))
}

fn ends_with_rows<'s>(
    ends: &'s [End],
    pairs: &'s [Option<Pair>],
) -> impl Iterator<Item = (&'s End, &'s [Row])> + 's {
    ends.iter()
        .filter(|end| end.multiplier)
        .filter_map(|end| Some((end, &pairs[end.pair].as_ref()?.rows[..])))
}

/// The bodies that move together where nothing stops them, and their motion. Collective on the roots.
fn unrestrained(task: &Task, motion: &[f64]) -> Error {
    let Step { case, exchange, .. } = task.step;
    let modes = exchange.agree(own_modes(task));
    let modes = match modes {
        Ok(own) => exchange.sum(&own),
        Err(error) => return error,
    };
    let all: Vec<(usize, RigidMode, f64)> = std::iter::zip(modes.chunks_exact(MODE), motion)
        .filter(|(mode, _)| mode[0] > 0.0)
        .map(|(mode, amplitude)| (mode[0] as usize - 1, rigid_mode(mode), *amplitude))
        .collect();
    let all: Vec<(usize, &RigidMode, f64)> = all.iter().map(|(body, mode, a)| (*body, mode, *a)).collect();
    let names: Vec<&str> = case.bodies.iter().map(|body| body.name.as_str()).collect();
    let (bodies, how) = name_motion(&names, &all);
    let Some(&first) = bodies.first() else { return Error::internal("no body owns the free motion") };
    let own: Vec<&str> = bodies.iter().map(|&b| names[b]).collect();
    let (are, which, place) = match own.len() {
        1 => ("is", "its loads: ", "it"),
        _ => ("are", "the loads and move together: ", "one of them"),
    };
    Error::Unrestrained(format!(
        "{}: {} {are} not held against {which}{how}: neither supports nor contact stop this motion; add a \
         [[body.support]] to {place} that does, or check the direction of the load and the contact pairs",
        case.bodies[first].origin,
        name_bodies(&own)
    ))
}

/// Numbers of a mode: 1 + its body (0: no rigid mode), its piece, translation, rotation, centre.
const MODE: usize = 7;

/// The rigid modes of this rank's bodies, among those of all.
fn own_modes(task: &Task) -> Result<Vec<f64>> {
    let Step { case, plan, .. } = task.step;
    let mut numbers = vec![0.0; MODE * task.n_modes];
    for (i, (&b, mesh)) in std::iter::zip(plan.groups.bodies(), &plan.meshes).enumerate() {
        let free = FreeModes::new(mesh, &Constraints::new(&case.bodies[b], mesh)?);
        for (k, mode) in free.modes.iter().enumerate().take(task.counts[i]) {
            let [t, c] = [&mode.translation, &mode.center];
            let values = [1.0 + b as f64, f64::from(mode.piece), t[0], t[1], mode.rotation, c[0], c[1]];
            numbers[MODE * (task.first_mode[i] + k)..][..MODE].copy_from_slice(&values);
        }
    }
    Ok(numbers)
}

fn rigid_mode(numbers: &[f64]) -> RigidMode {
    RigidMode {
        name: String::new(),
        piece: numbers[1] as u32,
        translation: [numbers[2], numbers[3], 0.0],
        rotation: numbers[4],
        center: [numbers[5], numbers[6], 0.0],
    }
}
