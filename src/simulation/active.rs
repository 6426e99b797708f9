//! A load step by the active-set driver: from the bodies' answers on the contact rows to forces, gaps and verdict.
use super::{
    Plan,
    found::{EndFound, Found},
    rows::{Pair, Shares, both_surfaces, held_nodes, pair_rows},
};
use crate::{
    body::{Body, BodyRow, LoadFactors, Response, ResponseKind},
    case::{Case, ContactGeometry, Gap, ResponseCase},
    contact::{Row, Surface, vector::dot},
    error::{Error, Result},
    output::{HistoryRow, Reason},
    parallel::{self, Exchange, agree},
    schwarz::{ActiveSet, Coarse, Coupling, End, Limits, Respond},
};
use nalgebra::{DMatrix, DVector};
use std::{collections::HashMap, time::Instant};

/// Updates of the geometry after which a step gives up.
const GEOMETRY_UPDATES: usize = 30;

/// Turning of a surface in contact, rad, from which a user is told that the initial geometry does not hold.
const TURNED: f64 = 0.05;

/// The bodies of this rank's group, and the contact rows as its first rank holds them.
pub(super) struct Active {
    pub bodies: Vec<Body>,
    responses: Vec<Response>,
    contacts: Option<Contacts>,
    /// Number of each of this group's bodies' first free mode among all `n_modes`.
    first_mode: Vec<usize>,
    n_modes: usize,
    pub clock: Clock,
}

/// Seconds that this rank has spent, waiting for others included.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Clock {
    /// Search and transfer.
    pub search: f64,
    /// From the assembled matrices to the bodies' answers on the contact rows.
    pub factorise: f64,
    /// Load steps: the driver, then the displacements of the whole bodies.
    pub step: f64,
    /// Of these the displacements.
    pub recover: f64,
}

pub(super) struct Contacts {
    pairs: Vec<Option<Pair>>,
    shares: Shares,
    held: Vec<[Vec<bool>; 2]>,
    /// Row forces of the last step, by row.
    warm: Option<Vec<f64>>,
}

/// What a step leaves for the bodies: contact nodal forces and displacements at the owned nodes.
pub(super) struct Nodal {
    pub contact: Vec<f64>,
    pub displacement: Vec<f64>,
}

impl Active {
    /// Meshes are there; finds the rows, assembles and factorises. Collective.
    pub fn new(case: &Case, plan: &Plan, exchange: &Exchange) -> Result<Active> {
        let groups = &plan.groups;
        let start = Instant::now();
        let contacts =
            if groups.is_root() { Contacts::new(case, plan, exchange).map(Some) } else { Ok(None) };
        let mut contacts = agree(&groups.world, contacts)?;
        let mut clock = Clock { search: start.elapsed().as_secs_f64(), ..Clock::default() };
        let mut assembled = Vec::new();
        let built = groups.bodies().iter().enumerate().try_for_each(|(i, &b)| {
            if let Some(options) = &case.bodies[b].solver {
                crate::petsc::set_options(&super::prefixed(options, &case.bodies[b].name))?;
            }
            let nodes = contacts.as_ref().map_or_else(Vec::new, |c| c.shares.interface[i].clone());
            let mut nodes: Vec<f64> = nodes.into_iter().map(f64::from).collect();
            parallel::broadcast(&groups.group, 0, &mut nodes);
            let nodes: Vec<u32> = nodes.into_iter().map(|n| n as u32).collect();
            let kind = match case.bodies[b].response {
                ResponseCase::Automatic => ResponseKind::Automatic,
                ResponseCase::Condensed => ResponseKind::Condensed,
                ResponseCase::Solver => ResponseKind::Solver,
            };
            let (body, mesh, group) = (&case.bodies[b], &plan.meshes[i], &groups.group);
            assembled.push(Body::assemble(body, case.analysis, mesh, group, &nodes, kind)?);
            Ok(())
        });
        agree(&groups.world, built)?;
        let start = Instant::now();
        let (mut bodies, mut responses) = (Vec::new(), Vec::new());
        let factorised = assembled.into_iter().enumerate().try_for_each(|(i, body)| {
            let mut body = body.factorise(&groups.group)?;
            let rows =
                contacts.as_mut().map_or_else(Vec::new, |c| std::mem::take(&mut c.shares.body_rows[i]));
            responses.push(body.respond(&groups.group, rows)?);
            bodies.push(body);
            Ok(())
        });
        agree(&groups.world, factorised)?;
        clock.factorise = start.elapsed().as_secs_f64();
        let mut counts = vec![0.0; case.bodies.len()];
        if groups.is_root() {
            std::iter::zip(groups.bodies(), &bodies)
                .for_each(|(&b, body)| counts[b] = body.free.modes.len() as f64);
        }
        let counts = parallel::sum(&groups.world, &counts);
        let before = |b: usize| counts[..b].iter().sum::<f64>() as usize;
        let first_mode = groups.bodies().iter().map(|&b| before(b)).collect();
        Ok(Active { bodies, responses, contacts, first_mode, n_modes: before(counts.len()), clock })
    }

    /// Solves a load step, started from the contact forces of the last one. Collective.
    pub fn step(
        &mut self,
        case: &Case,
        plan: &Plan,
        exchange: &Exchange,
        step: u64,
        factors: LoadFactors,
        mut progress: impl FnMut(&HistoryRow),
    ) -> Result<(Found, Vec<Nodal>)> {
        let start = Instant::now();
        let group = &plan.groups.group;
        let loaded =
            std::iter::zip(&mut self.bodies, &mut self.responses).try_for_each(|(body, response)| {
                body.set_load(factors, group)?;
                body.reload(group, response)
            });
        agree(&plan.groups.world, loaded)?;
        let updated = case.contacts.iter().any(|c| c.geometry == ContactGeometry::Updated);
        let mut geometry = Geometry::default();
        let mut found = Found::none();
        for update in 0..=GEOMETRY_UPDATES {
            if updated && update > 0 {
                self.follow(case, plan, exchange, factors, &mut geometry)?;
            }
            let history = std::mem::take(&mut found.history);
            let counts = (found.updates, found.force_steps, found.displacement_steps);
            let driven = self.drive(case, plan, exchange, step, factors, &geometry, &mut progress)?;
            geometry.solution = driven.1;
            found = driven.0;
            found.prepend(history, counts);
            if !updated || !found.reason.converged() {
                break;
            }
            let moved = self.motion(plan, &mut geometry)?;
            if moved <= case.alternation.tolerance.max(1e-10) {
                break;
            }
            if update == GEOMETRY_UPDATES {
                found.reason = Reason::Stalled;
                found.diagnosis.push(format!(
                    "after {GEOMETRY_UPDATES} updates of normals and gaps the surfaces still move by {moved:.1e} of their \
                     displacement: apply the load in smaller steps ([[step]])"
                ));
            }
        }
        let recovering = Instant::now();
        let nodal = self.recover(plan, &geometry.solution)?;
        self.clock.recover += recovering.elapsed().as_secs_f64();
        self.look_beyond(case, plan, exchange, factors, &nodal, &mut found);
        found.warnings = super::text::gather_lines(&plan.groups.world, &found.warnings);
        self.clock.step += start.elapsed().as_secs_f64();
        Ok((found, nodal))
    }

    /// Penetration of the rows beyond the search distance, and whether the surfaces have turned too far for the normals
    /// they had before. Collective.
    fn look_beyond(
        &self,
        case: &Case,
        plan: &Plan,
        exchange: &Exchange,
        factors: LoadFactors,
        nodal: &[Nodal],
        found: &mut Found,
    ) {
        let mut moved = Vec::new();
        for (surface, &(_, _, body)) in std::iter::zip(&plan.surfaces, &plan.ends) {
            let place = plan.place(body);
            let u =
                self.bodies[place].at_nodes(&plan.groups.group, &nodal[place].displacement, &surface.nodes);
            moved.push(u);
        }
        let Some(contacts) = &self.contacts else { return };
        let outward = |i: usize, row: &Row, side: usize| -> f64 {
            row.terms[side].iter().map(|(node, v)| dot(v, &moved[i][*node as usize])).sum()
        };
        let own: Vec<Vec<f64>> = std::iter::zip(&contacts.shares.ends, 0..)
            .map(|(end, i)| {
                let rows = contacts.pairs[end.pair].as_ref().map_or(&[][..], |p| &p.beyond);
                rows.iter().map(|row| outward(i, row, usize::from(!end.multiplier))).collect()
            })
            .collect();
        let received = exchange.swap(&own);
        for (i, end) in contacts.shares.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let Some(pair) = &contacts.pairs[end.pair] else { continue };
            let rigid = super::rows::rigid_motion(case, end.pair, 1 - pair.multiplier);
            for (j, row) in pair.beyond.iter().enumerate() {
                let other = match rigid {
                    Some(u) => factors.supports * row.terms[1].iter().map(|(_, v)| dot(v, &u)).sum::<f64>(),
                    None => received[i][j],
                };
                found.ends[i].beyond = found.ends[i].beyond.max(own[i][j] + other - row.gap);
            }
            if case.contacts[end.pair].geometry == ContactGeometry::Initial {
                let (before, surface) = (&plan.surfaces[i], plan.surfaces[i].moved(&moved[i]));
                let status = &found.ends[i].table.status;
                let turned = (0..status.len()).filter(|&n| status[n] == 2).map(|n| {
                    let [a, b] = [&before.normals[n], &surface.normals[n]];
                    (1.0 - dot(a, b).powi(2)).max(0.0).sqrt()
                });
                let turned = turned.fold(0.0, f64::max);
                if turned > TURNED {
                    found.warnings.push(format!(
                        "contact '{}': the surface turns by up to {:.1} degrees where it touches, which normals and gaps of the \
                         initial geometry do not follow: use geometry = \"updated\"",
                        case.contacts[end.pair].name,
                        turned.asin().to_degrees()
                    ));
                }
            }
        }
    }

    /// Runs the driver on the first ranks; the others serve bodies that answer by their solver. Collective.
    #[allow(clippy::too_many_arguments)]
    fn drive(
        &mut self,
        case: &Case,
        plan: &Plan,
        exchange: &Exchange,
        step: u64,
        factors: LoadFactors,
        geometry: &Geometry,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<(Found, Solution)> {
        let world = &plan.groups.world;
        let scale: Vec<Vec<f64>> = self.bodies.iter().map(Body::mode_scale).collect();
        let outcome = match &mut self.contacts {
            None => {
                let served = self.responses.iter_mut().try_for_each(Response::serve);
                served.map(|()| (Found::none(), Solution::default()))
            }
            Some(contacts) => {
                let names = |b: usize, k: usize| self.bodies[b].free.modes[k].name.clone();
                let task = Task {
                    case,
                    plan,
                    exchange,
                    step,
                    factors,
                    geometry,
                    first_mode: &self.first_mode,
                    n_modes: self.n_modes,
                    scale: &scale,
                    names: &names,
                };
                let outcome = contacts.solve(&task, &mut self.responses, progress);
                self.responses.iter().for_each(Response::finish);
                outcome
            }
        };
        parallel::idle_barrier(world);
        let (mut found, solution) = agree(world, outcome)?;
        super::share_outcome(world, &mut found.reason, [0; 4]);
        found.free_modes = super::text::gather_lines(world, &found.free_modes);
        found.diagnosis = super::text::gather_lines(world, &found.diagnosis);
        Ok((found, solution))
    }

    /// Displacements and contact forces at the owned nodes of each body. Collective.
    fn recover(&mut self, plan: &Plan, solution: &Solution) -> Result<Vec<Nodal>> {
        let group = &plan.groups.group;
        let mut out = Vec::new();
        let done = self.bodies.iter_mut().enumerate().try_for_each(|(i, body)| {
            let force = solution.force.get(i).map_or(&[][..], Vec::as_slice);
            let alpha = solution.alpha.get(i).map_or(&[][..], Vec::as_slice);
            let contact = body.contact_forces(&self.responses[i], force);
            let displacement = body.displacements(group, &contact, alpha)?;
            out.push(Nodal { contact, displacement });
            Ok(())
        });
        agree(&plan.groups.world, done)?;
        self.hold_free_motions(plan, solution, &mut out);
        Ok(out)
    }

    /// Takes out of the displacements what they have of the motions that nothing restrains, whatever the fixings left of
    /// them: with V a basis of these motions and Z the modes, u - Z V (V'Z'Z V)^-1 V'Z'u. Collective.
    fn hold_free_motions(&self, plan: &Plan, solution: &Solution, nodal: &mut [Nodal]) {
        let (world, n) = (&plan.groups.world, self.n_modes);
        let mut basis = solution.unrestrained.concat();
        parallel::broadcast(world, 0, &mut basis);
        if basis.is_empty() {
            return;
        }
        let basis = DMatrix::from_column_slice(n, basis.len() / n, &basis);
        // Z'Z and Z'u over all nodes of all bodies.
        let mut sums = vec![0.0; n * n + n];
        for ((body, nodal), &first) in std::iter::zip(&self.bodies, nodal.iter()).zip(&self.first_mode) {
            let (dim, modes) = (body.dim(), body.free.modes.len());
            for (node, u) in nodal.displacement.chunks_exact(dim).enumerate() {
                let at = |k: usize| body.free.at(k, body.part.original[node], &body.part.points[node]);
                let values: Vec<[f64; 3]> = (0..modes).map(at).collect();
                for k in 0..modes {
                    let product =
                        |v: &[f64]| std::iter::zip(&values[k][..dim], v).map(|(a, b)| a * b).sum::<f64>();
                    sums[n * n + first + k] += product(u);
                    (0..modes).for_each(|l| sums[(first + k) * n + first + l] += product(&values[l][..dim]));
                }
            }
        }
        let sums = parallel::sum(world, &sums);
        let gram = DMatrix::from_column_slice(n, n, &sums[..n * n]);
        let projected = basis.transpose() * gram * &basis;
        let rhs = basis.transpose() * DVector::from_column_slice(&sums[n * n..]);
        let Some(factor) = projected.cholesky() else { return };
        let amplitudes = &basis * factor.solve(&rhs);
        for ((body, nodal), &first) in std::iter::zip(&self.bodies, nodal).zip(&self.first_mode) {
            let dim = body.dim();
            for (node, u) in nodal.displacement.chunks_exact_mut(dim).enumerate() {
                for k in 0..body.free.modes.len() {
                    let mode = body.free.at(k, body.part.original[node], &body.part.points[node]);
                    std::iter::zip(u.iter_mut(), mode).for_each(|(u, m)| *u -= amplitudes[first + k] * m);
                }
            }
        }
    }

    /// Largest change of the interface displacements since the last geometry, relative to the largest displacement.
    /// Collective.
    fn motion(&mut self, plan: &Plan, geometry: &mut Geometry) -> Result<f64> {
        let mut now = Vec::new();
        let is_root = self.contacts.is_some();
        let moved = match is_root {
            false => self.responses.iter_mut().try_for_each(Response::serve),
            true => {
                let moved = self.responses.iter_mut().enumerate().try_for_each(|(i, response)| {
                    let (force, alpha) = (&geometry.solution.force[i], &geometry.solution.alpha[i]);
                    now.push(response.interface_displacements(force, alpha)?);
                    Ok(())
                });
                self.responses.iter().for_each(Response::finish);
                moved
            }
        };
        agree(&plan.groups.world, moved)?;
        let size = |v: &[f64; 3]| dot(v, v).sqrt();
        let mut largest = [0.0_f64; 2];
        for (i, nodes) in now.iter().enumerate() {
            for (k, u) in nodes.iter().enumerate() {
                let old = geometry.displacement.get(i).map_or([0.0; 3], |d| d[k]);
                largest[0] = largest[0].max(size(&crate::contact::vector::sub(u, &old)));
                largest[1] = largest[1].max(size(u));
            }
        }
        geometry.displacement = now;
        let largest = parallel::max(&plan.groups.world, &largest);
        Ok(if largest[1] > 0.0 { largest[0] / largest[1] } else { 0.0 })
    }

    /// Normals, transfer and gaps at the displaced surfaces; the bodies' answers on the new rows. Collective.
    fn follow(
        &mut self,
        case: &Case,
        plan: &Plan,
        exchange: &Exchange,
        factors: LoadFactors,
        geometry: &mut Geometry,
    ) -> Result<()> {
        let start = Instant::now();
        let mut rows = vec![Vec::new(); self.bodies.len()];
        if let Some(contacts) = &mut self.contacts {
            contacts.follow(case, plan, exchange, factors, geometry);
            rows = std::mem::take(&mut contacts.shares.body_rows);
        }
        self.clock.search += start.elapsed().as_secs_f64();
        let answered =
            std::iter::zip(&mut self.bodies, rows).enumerate().try_for_each(|(i, (body, rows))| {
                self.responses[i] = body.respond(&plan.groups.group, rows)?;
                Ok(())
            });
        agree(&plan.groups.world, answered)
    }
}

/// The deformed geometry that the rows were taken from.
#[derive(Default)]
struct Geometry {
    solution: Solution,
    /// Per body: displacement of its interface nodes, m; empty before the first update.
    displacement: Vec<Vec<[f64; 3]>>,
    /// Gap of each row of each end at zero displacement, as seen from the deformed geometry, m.
    gaps: Option<Vec<Vec<f64>>>,
}

/// Row forces and mode amplitudes of this rank's bodies.
#[derive(Default)]
struct Solution {
    force: Vec<Vec<f64>>,
    alpha: Vec<Vec<f64>>,
    /// Motions of all modes that nothing restrains; the same on all first ranks.
    unrestrained: Vec<Vec<f64>>,
}

/// What a solve needs to know.
struct Task<'t, 'e> {
    case: &'t Case,
    plan: &'t Plan,
    exchange: &'t Exchange<'e>,
    step: u64,
    factors: LoadFactors,
    geometry: &'t Geometry,
    first_mode: &'t [usize],
    n_modes: usize,
    scale: &'t [Vec<f64>],
    names: &'t dyn Fn(usize, usize) -> String,
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
                "contact {}: {} rows, multipliers on {}.{}, frictionless, {} transfer, {geometry} geometry",
                contact.name,
                rows.len(),
                case.body_name(name.body),
                name.surface,
                case.alternation.transfer.name(),
            )
        })
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

    fn follow(
        &mut self,
        case: &Case,
        plan: &Plan,
        exchange: &Exchange,
        factors: LoadFactors,
        geometry: &mut Geometry,
    ) {
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
            if let (true, Some(motion)) = (is_updated(pair), super::rows::rigid_motion(case, pair, 1 - side))
            {
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
                .collect()
        });
        geometry.gaps = Some(gaps.collect());
        self.pairs = pairs;
        self.shares = shares;
    }

    fn solve(
        &mut self,
        task: &Task,
        responses: &mut [Response],
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<(Found, Solution)> {
        let Task { case, exchange, factors, .. } = *task;
        let mut rows = self.shares.rows.clone();
        for (i, end) in self.shares.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let Some(pair) = &self.pairs[end.pair] else { continue };
            let updated = case.contacts[end.pair].geometry == ContactGeometry::Updated;
            match &task.geometry.gaps {
                Some(gaps) if updated => rows[i].gap = gaps[i].clone(),
                // A rigid surface's motion is given.
                _ => std::iter::zip(&mut rows[i].gap, &pair.rigid_motion)
                    .for_each(|(gap, motion)| *gap -= factors.supports * motion),
            }
        }
        let mut coupling = Coupling::new(responses, &self.shares.ends, exchange);
        let scaling: Vec<f64> =
            rows.iter().flat_map(|rows| std::iter::repeat_n(rows.stiffness, rows.gap.len())).collect();
        let coarse = Coarse::new(&coupling, task.n_modes, task.first_mode, task.scale, scaling);
        let limits = Limits {
            tolerance: case.alternation.tolerance,
            max_alternations: case.alternation.max_alternations,
        };
        let n_pairs = case.contacts.len();
        let mut driver = ActiveSet::new(&mut coupling, &rows, &coarse, limits, n_pairs, task.step);
        let outcome = match driver.run(self.warm.as_deref(), progress)? {
            Ok(outcome) => outcome,
            Err(motion) => return Err(unrestrained(task, &coarse, &motion)),
        };
        let projector = coarse.projector(exchange, &driver.active);
        let free: Vec<usize> = projector.free_modes(task.n_modes);
        if let (true, Some(motion)) = (outcome.reason.converged(), projector.driven(&coarse.work)) {
            return Err(unrestrained(task, &coarse, &motion));
        }
        let gaps: Vec<f64> = (0..driver.coupling.n).map(|j| driver.gap_at(j)).collect();
        let elastic: Vec<f64> = (0..driver.coupling.n).map(|j| driver.elastic_at(j)).collect();
        let threshold = driver.gap_threshold();
        let mut found = Found::none();
        found.reason = if n_pairs == 0 { Reason::NoContact } else { outcome.reason };
        found.history = outcome.history;
        (found.updates, found.gap_threshold) = (driver.updates as u64, threshold);
        (found.force_steps, found.displacement_steps) =
            (driver.coupling.steps.force as u64, driver.coupling.steps.displacement as u64);
        for (b, &first) in task.first_mode.iter().enumerate() {
            let n = task.scale[b].len();
            for k in free.iter().filter(|k| (first..first + n).contains(k)) {
                let body = task.plan.groups.bodies()[b];
                found.free_modes.push(format!("{}\t{}", case.bodies[body].name, (task.names)(b, k - first)));
            }
        }
        if !found.reason.converged() {
            found.diagnosis = self.diagnose(task, &driver.flipped);
        }
        if let (Some(residual), 0) = (driver.round_off, task.plan.groups.own) {
            found.warnings.push(format!(
                "round-off ends the alternation at a gap residual of {residual:.1e}, above the tolerance of {:.1e}",
                case.alternation.tolerance
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
            alpha: std::iter::zip(task.first_mode, task.scale)
                .map(|(&f, s)| alpha[f..f + s.len()].to_vec())
                .collect(),
        };
        for (i, end) in self.shares.ends.iter().enumerate() {
            let values = if end.multiplier { &out[i] } else { &received[i] };
            solution.force[end.body][end.rows.clone()].copy_from_slice(values);
            let Some(pair) = &self.pairs[end.pair] else { continue };
            let (surface, side) = (&task.plan.surfaces[i], task.plan.ends[i].1);
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
                    let x = task.plan.surfaces[i].points[pair.rows[j - range.start].node as usize];
                    format!("({:.4e}, {:.4e})", x[0], x[1])
                })
                .collect();
            if !points.is_empty() {
                let shown = points.len().min(6);
                lines.push(format!(
                    "contact '{}': {} node(s) still change between open and closed, near {}{}",
                    task.case.contacts[end.pair].name,
                    points.len(),
                    points[..shown].join(", "),
                    if points.len() > shown { ", ..." } else { "" }
                ));
            }
        }
        lines
    }
}

fn ends_with_rows<'s>(
    ends: &'s [End],
    pairs: &'s [Option<Pair>],
) -> impl Iterator<Item = (&'s End, &'s [Row])> + 's {
    ends.iter()
        .filter(|end| end.multiplier)
        .filter_map(|end| Some((end, &pairs[end.pair].as_ref()?.rows[..])))
}

/// The body and the mode on which the loads do most of the work in a motion that nothing stops. Collective on the roots.
fn unrestrained(task: &Task, coarse: &Coarse, motion: &[f64]) -> Error {
    let share = |k: usize| (motion[k] * coarse.work[k]).abs();
    let worst = (0..motion.len()).fold(0, |best, k| if share(k) > share(best) { k } else { best });
    let own = task.first_mode.iter().enumerate().find(|(b, first)| {
        let first = **first;
        (first..first + task.scale[*b].len()).contains(&worst)
    });
    let named = match own {
        // Another rank has the body.
        None => Ok(()),
        Some((b, first)) => {
            let body = &task.case.bodies[task.plan.groups.bodies()[b]];
            Err(Error::Unrestrained(format!(
                "{}: body '{}' is not held against its loads: {}: neither supports nor contact stop this motion; add a \
                 [[body.support]] that does, or check the direction of the load and the contact pairs",
                body.origin,
                body.name,
                (task.names)(b, worst - first)
            )))
        }
    };
    task.exchange.agree(named).err().unwrap_or_else(|| Error::internal("no body owns the free motion"))
}
