//! The contact rows of this rank's pairs: found, followed as the surfaces move, and given to the driver.
use super::{
    found::Found,
    neutral::Neutral,
    place::{Place, rigid_factor},
    rows::{Held, Pair, Shares, both_surfaces, held_nodes, pair_rows, rigid_motion},
    state::NodeState,
    task::{Scene, Solution, Task},
};
use crate::vector::{larger, smaller, worst};
use crate::{
    body::{BodyRow, Constraints, FreeModes, Response, RigidMode, mesh_extent, name_bodies, name_motion},
    case::{Case, ContactGeometry, Driver, Gap, Tolerance},
    contact::{
        Law, Row, Surface,
        vector::{dot, sub},
    },
    error::{Error, Result},
    estimate::pressure::{self, Chain},
    parallel::Exchange,
    record::{HistoryRow, Reason},
    scene::{ContactSide, Plan},
    schwarz::{AUTOMATIC, ActiveSet, Coarse, Coupling, End, Ended, Known, Limits, PairRows, Respond},
};
use nalgebra::DMatrix;
use std::collections::HashMap;

/// Pairs and rows as the first rank of a group holds them.
pub(crate) struct Contacts {
    pub pairs: Vec<Option<Pair>>,
    pub shares: Shares,
    held: Vec<[Vec<Held>; 2]>,
    /// Gap of each row of each end at zero displacement, as seen from the deformed geometry, m; `None`: the rows' own.
    gaps: Option<Vec<Vec<f64>>>,
}

/// Overlap over the size of a body from which on it is no fit: the tightest shrink fits of machines have 0.3 % of the
/// diameter (ISO 286, p to zc), and the strain is about as large.
const NO_FIT: f64 = 1e-2;

/// Overlap over the size of a body from which on there is no answer to speak of: strains of this size are not small.
const NO_ANSWER: f64 = 0.25;

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
                "contact {}: {} candidates, {}; multipliers on {}.{}, {}, {} transfer, {geometry} geometry",
                contact.name,
                rows.len(),
                gap_in_words(rows),
                case.body_name(name.body),
                name.surface,
                contact.law.describe(contact.over_temperature.is_some()),
                case.alternation.transfer.name(),
            )
        })
        .collect()
    }

    /// Pairs whose multipliers are here and that overlap at the start by more than a share of the body's size, in words.
    fn overlapping(&self, case: &Case, plan: &Plan, share: f64) -> Vec<(usize, String)> {
        let ends = ends_with_rows(&self.shares.ends, &self.pairs);
        let words = |(end, rows): (&End, &[Row])| {
            let overlap = worst(rows.iter().map(|row| -row.gap));
            let size = mesh_extent(&plan.meshes[end.body].points);
            (overlap > share * size).then(|| {
                let text = format!(
                    "contact '{}': the surfaces overlap by up to {overlap:.3e} at the start, {:.1} % of the size of the body \
                     ({size:.3e})",
                    case.contacts[end.pair].name,
                    100.0 * overlap / size
                );
                (end.pair, text)
            })
        };
        ends.filter_map(words).collect()
    }

    /// Overlaps at the start that no fit has, of the pairs whose multipliers are here.
    pub fn overlaps(&self, case: &Case, plan: &Plan) -> Vec<String> {
        let overlapping = self.overlapping(case, plan, NO_FIT).into_iter();
        overlapping
            .map(|(_, text)| format!("{text}: no fit has so much; look at positions, units and gap"))
            .collect()
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
        let pairs = pair_rows(case, plan, &surfaces, &held, &[]);
        let mut interface = vec![Vec::new(); plan.groups.bodies().len()];
        for (surface, &ContactSide { pair, body, .. }) in std::iter::zip(&plan.surfaces, &plan.ends) {
            if case.contacts[pair].geometry == ContactGeometry::Updated {
                interface[plan.place(body)].extend(&surface.nodes);
            }
        }
        interface.iter_mut().for_each(|nodes: &mut Vec<u32>| {
            nodes.sort_unstable();
            nodes.dedup();
        });
        let shares = Shares::new(case, plan, &pairs, Some(&interface));
        let contacts = Contacts { pairs, shares, held, gaps: None };
        if case.has_friction() {
            exchange.agree(contacts.refuse_unmatched_friction(case))?;
        }
        let hopeless = contacts.overlapping(case, plan, NO_ANSWER).into_iter().next();
        let checked = match hopeless {
            Some((pair, text)) => Err(case.contacts[pair].origin.error(format!(
                "{text}: strains would not be small; look at positions, units and gap, and whether the surfaces face each other"
            ))),
            None => Ok(contacts),
        };
        exchange.agree(checked)
    }

    /// The paper's transfer interpolates forces where nodes do not match: what they have along the surfaces would not be bounded
    /// by the pressure that they have at the same place.
    fn refuse_unmatched_friction(&self, case: &Case) -> Result<()> {
        let unmatched =
            |pair: &&Pair| pair.law.is_frictional() && pair.watched.iter().any(|rows| !rows.is_empty());
        match self.pairs.iter().flatten().find(unmatched) {
            Some(pair) => Err(case.contacts[pair.number].origin.error(format!(
                "contact '{}': the nodes of the two surfaces do not match, and driver = \"relaxed\" has friction with \
                 transfer = \"pointwise\", its default, only where they do: use transfer = \"mortar\", or meshes that match",
                case.contacts[pair.number].name
            ))),
            None => Ok(()),
        }
    }

    /// By how much facets of surfaces that are followed stretch or turn, the largest, relative to their length.
    pub fn stretch(&self, scene: &Scene, to: &Place) -> f64 {
        let Scene { case, plan, .. } = *scene;
        let mut largest = 0.0;
        for (surface, side) in std::iter::zip(&plan.surfaces, &plan.ends) {
            if case.contacts[side.pair].geometry != ContactGeometry::Updated {
                continue;
            }
            let u = self.at_surface(surface, plan.place(side.body), to);
            for (f, facet) in surface.facets.iter().enumerate() {
                let moved = sub(&u[facet[1] as usize], &u[facet[0] as usize]);
                largest = larger(largest, dot(&moved, &moved).sqrt() / surface.facet_size(f));
            }
        }
        largest
    }

    /// Displacements of a surface's nodes, m, of a body of this rank.
    pub(super) fn at_surface(&self, surface: &Surface, place: usize, to: &Place) -> Vec<[f64; 3]> {
        let at: HashMap<u32, &[f64; 3]> =
            std::iter::zip(self.shares.interface[place].iter().copied(), &to.displacement[place]).collect();
        surface.nodes.iter().map(|node| at.get(node).map_or([0.0; 3], |u| **u)).collect()
    }

    /// Finds the rows again on the displaced surfaces. Collective on the roots.
    pub fn follow(&mut self, scene: &Scene, to: &Place) {
        let Scene { case, plan, exchange } = *scene;
        let interface = self.shares.interface.clone();
        let is_updated = |pair: usize| case.contacts[pair].geometry == ContactGeometry::Updated;
        let moved: Vec<Surface> = std::iter::zip(&plan.surfaces, &plan.ends)
            .map(|(surface, &ContactSide { pair, body, .. })| {
                if !is_updated(pair) {
                    return surface.clone();
                }
                surface.moved(&self.at_surface(surface, plan.place(body), to))
            })
            .collect();
        let mut surfaces = both_surfaces(case, plan, exchange, &moved);
        for (i, &ContactSide { pair, side, .. }) in plan.ends.iter().enumerate() {
            if let (true, Some(motion)) = (is_updated(pair), rigid_motion(case, pair, 1 - side)) {
                let factor = to.rigid_factor(case, pair, 1 - side);
                let u = motion.map(|m| factor * m);
                surfaces[i][1] = surfaces[i][1].moved(&vec![u; surfaces[i][1].nodes.len()]);
            }
        }
        let pairs = pair_rows(case, plan, &surfaces, &self.held, &self.pairs);
        let shares = Shares::new(case, plan, &pairs, Some(&interface));
        // What the rows' own displacements would be of the present motion.
        let present: Vec<Vec<f64>> = shares
            .ends
            .iter()
            .map(|end| {
                let displaced = |row: &BodyRow| -> f64 {
                    row.terms.iter().map(|(k, v)| dot(v, &to.displacement[end.body][*k])).sum()
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
            let side = pairs[end.pair].as_ref().map_or(0, |p| 1 - p.multiplier);
            let factor = to.rigid_factor(case, end.pair, side);
            rows.iter()
                .enumerate()
                .map(|(j, row)| row.gap + if is_updated(end.pair) { present[i][j] + other(j) } else { 0.0 })
                .zip(pairs[end.pair].iter().flat_map(|p| &p.rigid_motion))
                .map(|(gap, motion)| gap + if is_updated(end.pair) { factor * motion } else { 0.0 })
                .collect()
        });
        self.gaps = Some(gaps.collect());
        self.pairs = pairs;
        self.shares = shares;
    }

    /// Runs the driver on the rows as they are: from the forces that are known, and should that find no solution, once
    /// more from none, for the old set of contacts may hide the new one. Collective on the roots, the other ranks serving.
    pub fn solve(
        &self,
        task: &Task,
        neutral: &[Neutral],
        responses: &mut [Response],
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<(Found, Solution)> {
        let warm = self.known(task, task.warm);
        let known = warm.iter().flatten().flatten().any(|node| node.force != 0.0);
        let known = task.scene.exchange.max(&[f64::from(u8::from(known))])[0] > 0.0;
        if !known {
            return self.solve_from(task, neutral, responses, None, progress);
        }
        let failed = match self.solve_from(task, neutral, responses, Some(&warm), progress) {
            Ok((found, solution)) if found.reason.converged() => return Ok((found, solution)),
            Ok((found, _)) => found,
            Err(Error::Unrestrained(_)) => Found::none(),
            Err(error) => return Err(error),
        };
        let (mut found, solution) = self.solve_from(task, neutral, responses, None, progress)?;
        found.prepend(failed);
        Ok((found, solution))
    }

    /// Runs the driver once; `warm`: what is known of the nodes, to begin with. Collective on the roots.
    fn solve_from(
        &self,
        task: &Task,
        neutral: &[Neutral],
        responses: &mut [Response],
        warm: Option<&[Vec<Option<NodeState>>]>,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<(Found, Solution)> {
        let Scene { case, plan, exchange } = task.scene;
        let rows = self.rows_of_step(task);
        let touch = warm.map(|warm| self.known_states(warm));
        let warm = warm.map(|warm| self.known_forces(warm));
        let mut coupling = Coupling::new(responses, &self.shares.ends, exchange);
        coupling.names = plan.groups.bodies().iter().map(|&b| case.bodies[b].name.clone()).collect();
        let scaling: Vec<f64> =
            rows.iter().flat_map(|rows| std::iter::repeat_n(rows.stiffness, rows.gap.len())).collect();
        let mut coarse = Coarse::new(&coupling, task.modes.total, &task.modes.first, scaling);
        hold(task, neutral, &coupling, &rows, &mut coarse)?;
        let (start, automatic) = match (case.alternation.tolerance, case.alternation.driver) {
            (Tolerance::Automatic, Driver::ActiveSet) => (AUTOMATIC[0], true),
            (Tolerance::Automatic, Driver::Relaxed(_)) => (Tolerance::RELAXED, false),
            (Tolerance::Fixed(tolerance), _) => (tolerance, false),
        };
        let limits = Limits {
            tolerance: start,
            max_alternations: case.alternation.max_alternations,
            friction: case.has_friction(),
        };
        let n_pairs = case.contacts.len();
        let number = task.target.number;
        let warm = warm.map(|warm| with_springs(&warm, &coarse, exchange));
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
        let ended = match case.alternation.driver {
            Driver::ActiveSet if case.has_friction() => driver.run_with_friction(touch.as_deref(), progress),
            Driver::ActiveSet => driver.run(warm.as_deref(), progress),
            Driver::Relaxed(weights) => {
                let known =
                    warm.as_deref().zip(touch.as_deref()).map(|(force, touch)| Known { force, touch });
                driver.relax(weights, known, progress).map(Ended::Outcome)
            }
        };
        let ended = match ended {
            Ok(ended) => ended,
            // The state is that before the answer.
            Err(Error::NotFinite(what)) => {
                not_finite = Some(what);
                Ended::Outcome(driver.outcome(Reason::NotFinite))
            }
            Err(error) => return Err(error),
        };
        let outcome = match ended {
            Ended::Outcome(outcome) => outcome,
            Ended::Driven(motion) => return Err(unrestrained(task, &motion)),
        };
        let projector = coarse.projector(exchange, &driver.active);
        if outcome.reason.converged() {
            let pushed = coarse.restrict(exchange, |j| driver.force[j]);
            let missing: Vec<f64> = std::iter::zip(&coarse.work, pushed).map(|(e, p)| e - p).collect();
            let absolute = coarse.absolute_work(exchange, &driver.force);
            let scale: Vec<f64> = std::iter::zip(&coarse.work, absolute).map(|(e, a)| e.abs() + a).collect();
            if let Some(motion) = projector.driven(&missing, &scale) {
                return Err(unrestrained(task, &motion));
            }
        }
        let converged = outcome.reason.converged();
        let (mut found, mut solution) = self.report(task, &driver, &projector, outcome);
        // What decides a peak is not told by a symmetric dual problem where surfaces slip.
        if converged && task.target.is_end && !case.has_friction() {
            solution.influences = self.influences(task, &mut driver)?;
        }
        // All first ranks have agreed on it.
        found.diagnosis.extend(not_finite.filter(|_| plan.groups.own == 0));
        Ok((found, solution))
    }

    /// What the driver needs of the rows: gaps as seen from the geometry, less the given motion of rigid surfaces.
    fn rows_of_step(&self, task: &Task) -> Vec<PairRows> {
        let case = task.scene.case;
        let mut rows = self.shares.rows.clone();
        let travelled = if case.has_friction() { self.travelled(task) } else { Vec::new() };
        for (i, end) in self.shares.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let Some(pair) = &self.pairs[end.pair] else { continue };
            let updated = case.contacts[end.pair].geometry == ContactGeometry::Updated;
            if let (true, Some(gaps)) = (updated && pair.law != Law::Tied, &self.gaps) {
                rows[i].gap[..gaps[i].len()].copy_from_slice(&gaps[i]);
            }
            if let Some(coefficients) = task.coefficients.get(i) {
                rows[i].coefficients.clone_from(coefficients);
            }
            if pair.law.is_frictional() {
                rows[i].gap.truncate(pair.rows.len());
                rows[i].gap.extend(&travelled[i]);
            }
            let factor = rigid_factor(case, task.target.factors, end.pair, 1 - pair.multiplier);
            std::iter::zip(&mut rows[i].gap, &pair.rigid_motion)
                .for_each(|(gap, motion)| *gap -= factor * motion);
        }
        rows
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

/// Holds the bodies' motions along their own surfaces, unless the loads drive them; where surfaces rub, only pressures do no work on
/// them. Collective on the roots.
fn hold(
    task: &Task,
    neutral: &[Neutral],
    coupling: &Coupling<Response>,
    rows: &[PairRows],
    coarse: &mut Coarse,
) -> Result<()> {
    let exchange = task.scene.exchange;
    let (n, any) = (coarse.n, exchange.max(&[neutral.len() as f64])[0] > 0.0);
    if !any || n == 0 {
        return Ok(());
    }
    let mut onto = [vec![0.0; n * n], vec![0.0; n * n]];
    let mut driven = vec![0.0; n];
    for held in neutral {
        let first = task.modes.first[held.place];
        let scale = coupling.bodies[held.place].mode_scale();
        let at = |k: usize| coarse.work[first + k];
        let work: f64 = held.motion.iter().enumerate().map(|(k, v)| v * at(k)).sum();
        // The motion is a unit vector, its small parts round-off.
        let most = scale.iter().take(held.motion.len()).map(|s| s * s).sum::<f64>().sqrt();
        for (k, v) in held.motion.iter().enumerate() {
            if !held.rubs && work.abs() > held.faceted * most {
                driven[first + k] += work * v;
            }
            for (l, w) in held.motion.iter().enumerate() {
                onto[usize::from(held.rubs)][(first + k) * n + first + l] += v * w;
            }
        }
    }
    let driven = exchange.sum(&driven);
    if driven.iter().any(|d| *d != 0.0) {
        return Err(unrestrained(task, &driven));
    }
    let [onto, rolls] = onto.map(|onto| DMatrix::from_row_slice(n, n, &exchange.sum(&onto)));
    let mut normal = vec![false; coupling.n];
    for (rows, range) in std::iter::zip(rows, &coupling.ranges) {
        normal[range.start..range.start + rows.n_normal()].fill(true);
    }
    coarse.hold(&onto, &rolls, &normal);
    Ok(())
}

/// Row forces with those of the springs that are in equilibrium with them. Collective on the roots.
fn with_springs(forces: &[f64], coarse: &Coarse, exchange: &Exchange) -> Vec<f64> {
    let pushed = coarse.restrict(exchange, |j| forces.get(j).copied().unwrap_or(0.0));
    let mut all = forces.to_vec();
    all.extend(coarse.spring_forces(&pushed));
    all
}

/// The bodies that move together where nothing stops them, and their motion. Collective on the roots.
fn unrestrained(task: &Task, motion: &[f64]) -> Error {
    let Scene { case, exchange, .. } = task.scene;
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
    let Scene { case, plan, .. } = task.scene;
    let mut numbers = vec![0.0; MODE * task.modes.total];
    for (i, (&b, mesh)) in std::iter::zip(plan.groups.bodies(), &plan.meshes).enumerate() {
        let free = FreeModes::new(mesh, &Constraints::new(&case.bodies[b], mesh)?);
        for (k, mode) in free.modes.iter().enumerate().take(task.modes.counts[i]) {
            let [t, c] = [&mode.translation, &mode.center];
            let values = [1.0 + b as f64, f64::from(mode.piece), t[0], t[1], mode.rotation, c[0], c[1]];
            numbers[MODE * (task.modes.first[i] + k)..][..MODE].copy_from_slice(&values);
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
