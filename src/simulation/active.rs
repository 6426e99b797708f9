//! A load step by the active-set driver: from the bodies' answers on the contact rows to forces, gaps and verdict.
use super::{
    Plan,
    contacts::{Contacts, Geometry, Solution, Task},
    found::Found,
};
use crate::vector::larger;
use crate::{
    body::{Body, LoadFactors, Response, ResponseKind},
    case::{BodyRef, Case, ContactGeometry, ResponseCase},
    contact::{Gap, Row, Surface, deepest_node, vector::dot},
    error::Result,
    parallel::{self, Exchange, agree},
    record::{HistoryRow, Reason},
};
use nalgebra::{DMatrix, DVector};
use std::time::Instant;

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
    /// What the last step ended with.
    geometry: Geometry,
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

/// A load step: the case, where it is solved, and the factors at its end.
#[derive(Clone, Copy)]
pub(super) struct Step<'s, 'e> {
    pub case: &'s Case,
    pub plan: &'s Plan,
    pub exchange: &'s Exchange<'e>,
    /// 1, 2, ...
    pub number: u64,
    pub factors: LoadFactors,
}

/// What a step leaves for the bodies: contact nodal forces and displacements at the owned nodes.
pub(super) struct Nodal {
    pub contact: Vec<f64>,
    pub displacement: Vec<f64>,
}

/// How soft a mode has to be to join the coarse space: in a chain of bodies, where it carries over what happens at one
/// contact to the next, and elsewhere, where it only spares the compliance its round-off.
const SOFT: [f64; 2] = [2.0, 0.3];

/// [`SOFT`] of a body.
fn softness(case: &Case, body: usize) -> f64 {
    let own = BodyRef::Deformable(body);
    let pairs = case.contacts.iter().filter(|c| c.surfaces.iter().any(|s| s.body == own));
    let in_chain = pairs.flat_map(|c| &c.surfaces).any(|s| case.pairs_of(s.body) > 1);
    SOFT[usize::from(!in_chain)]
}

/// Number of each of this rank's bodies' first free mode among those of all bodies, and how many there are. Collective.
fn number_modes(case: &Case, plan: &Plan, bodies: &[Body]) -> (Vec<usize>, usize) {
    let groups = &plan.groups;
    let mut counts = vec![0.0; case.bodies.len()];
    if groups.is_root() {
        std::iter::zip(groups.bodies(), bodies).for_each(|(&b, body)| counts[b] = body.n_modes() as f64);
    }
    let counts = parallel::sum(&groups.world, &counts);
    let before = |b: usize| counts[..b].iter().sum::<f64>() as usize;
    (groups.bodies().iter().map(|&b| before(b)).collect(), before(counts.len()))
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
        let factorised = assembled.into_iter().enumerate().try_for_each(|(i, mut body)| {
            body.split_soft_modes(softness(case, groups.bodies()[i]));
            let mut body = body.factorise(&groups.group)?;
            let rows =
                contacts.as_mut().map_or_else(Vec::new, |c| std::mem::take(&mut c.shares.body_rows[i]));
            responses.push(body.respond(&groups.group, rows)?);
            bodies.push(body);
            Ok(())
        });
        agree(&groups.world, factorised)?;
        clock.factorise = start.elapsed().as_secs_f64();
        let geometry = Geometry::default();
        let (first_mode, n_modes) = number_modes(case, plan, &bodies);
        Ok(Active { bodies, responses, contacts, first_mode, n_modes, geometry, clock })
    }

    /// Solves a load step, started from the contact forces of the last one. Collective.
    pub fn step(
        &mut self,
        step: &Step,
        mut progress: impl FnMut(&HistoryRow),
    ) -> Result<(Found, Vec<Nodal>)> {
        let Step { case, plan, factors, .. } = *step;
        let start = Instant::now();
        let group = &plan.groups.group;
        let loaded =
            std::iter::zip(&mut self.bodies, &mut self.responses).try_for_each(|(body, response)| {
                if body.set_load(factors, group)? {
                    body.reload(group, response)?;
                }
                Ok(())
            });
        agree(&plan.groups.world, loaded)?;
        if step.number > 1 {
            // A stiffness that varies with the temperature may have other soft modes.
            (self.first_mode, self.n_modes) = number_modes(case, plan, &self.bodies);
        }
        let updated = case.contacts.iter().any(|c| c.geometry == ContactGeometry::Updated);
        let mut geometry = std::mem::take(&mut self.geometry);
        let mut found = Found::none();
        for update in 0..=GEOMETRY_UPDATES {
            if updated && update > 0 {
                self.follow(step, &mut geometry)?;
            }
            let history = std::mem::take(&mut found.history);
            let counts = (found.updates, found.force_steps, found.displacement_steps);
            let driven = self.drive(step, &geometry, &mut progress)?;
            geometry.solution = driven.1;
            found = driven.0;
            found.prepend(history, counts);
            if !updated || !found.reason.converged() {
                break;
            }
            let moved = self.motion(plan, &mut geometry)?;
            if moved <= found.tolerance.max(1e-10) {
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
        self.look_beyond(step, &nodal, &mut found);
        found.warnings = super::text::gather_lines(&plan.groups.world, &found.warnings);
        self.geometry = geometry;
        self.clock.step += start.elapsed().as_secs_f64();
        Ok((found, nodal))
    }

    /// Penetration of the rows beyond the search distance, and whether the surfaces have turned too far for the normals
    /// they had before. Collective.
    fn look_beyond(&self, step: &Step, nodal: &[Nodal], found: &mut Found) {
        let Step { case, plan, exchange, factors, .. } = *step;
        let mut moved = Vec::new();
        for (surface, &(_, _, body)) in std::iter::zip(&plan.surfaces, &plan.ends) {
            let place = plan.place(body);
            let u =
                self.bodies[place].at_nodes(&plan.groups.group, &nodal[place].displacement, &surface.nodes);
            moved.push(u);
        }
        let Some(contacts) = &self.contacts else { return };
        if found.reason == Reason::Open {
            nodes_inside(step, &moved, found);
        }
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
            let updated = case.contacts[end.pair].geometry == ContactGeometry::Updated;
            for (j, row) in pair.beyond.iter().enumerate() {
                if updated {
                    // Its gap is that of the deformed surfaces already.
                    found.ends[i].beyond = larger(found.ends[i].beyond, -row.gap);
                    continue;
                }
                let other = match rigid {
                    Some(u) => factors.supports * row.terms[1].iter().map(|(_, v)| dot(v, &u)).sum::<f64>(),
                    None => received[i][j],
                };
                found.ends[i].beyond = larger(found.ends[i].beyond, own[i][j] + other - row.gap);
            }
            if !updated {
                let (before, surface) = (&plan.surfaces[i], plan.surfaces[i].moved(&moved[i]));
                let status = &found.ends[i].table.status;
                let turned = (0..status.len()).filter(|&n| status[n] == 2).map(|n| {
                    let [a, b] = [&before.normals[n], &surface.normals[n]];
                    larger(1.0 - dot(a, b).powi(2), 0.0).sqrt()
                });
                let turned = turned.fold(0.0, larger);
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

    /// What is said before the first step: a line on each pair, with its candidates and gap, and warnings of overlaps that no
    /// fit has. The same on all ranks. Collective.
    pub fn announce(&self, case: &Case, plan: &Plan) -> [Vec<String>; 2] {
        let own = |of: &dyn Fn(&Contacts) -> Vec<String>| self.contacts.as_ref().map_or_else(Vec::new, of);
        [own(&|c| c.outlook(case)), own(&|c| c.overlaps(case, plan))]
            .map(|lines| super::text::gather_lines(&plan.groups.world, &lines))
    }

    /// Runs the driver on the first ranks; the others serve bodies that answer by their solver. Collective.
    fn drive(
        &mut self,
        step: &Step,
        geometry: &Geometry,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<(Found, Solution)> {
        let world = &step.plan.groups.world;
        let counts: Vec<usize> = self.bodies.iter().map(Body::n_modes).collect();
        let outcome = match &mut self.contacts {
            None => {
                let served = self.responses.iter_mut().try_for_each(Response::serve);
                served.map(|()| (Found::none(), Solution::default()))
            }
            Some(contacts) => {
                let names = |b: usize, k: usize| self.bodies[b].mode_name(k);
                let task = Task {
                    step: *step,
                    geometry,
                    first_mode: &self.first_mode,
                    n_modes: self.n_modes,
                    counts: &counts,
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
        found.tolerance = parallel::from_first(world, found.tolerance);
        found.free_modes = super::text::gather_lines(world, &found.free_modes);
        found.held_modes = super::text::gather_lines(world, &found.held_modes);
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
                largest[0] = larger(largest[0], size(&crate::contact::vector::sub(u, &old)));
                largest[1] = larger(largest[1], size(u));
            }
        }
        geometry.displacement = now;
        let largest = parallel::max(&plan.groups.world, &largest);
        Ok(if largest[1] > 0.0 { largest[0] / largest[1] } else { 0.0 })
    }

    /// Normals, transfer and gaps at the displaced surfaces; the bodies' answers on the new rows. Collective.
    fn follow(&mut self, step: &Step, geometry: &mut Geometry) -> Result<()> {
        let plan = step.plan;
        let start = Instant::now();
        let mut rows = vec![Vec::new(); self.bodies.len()];
        if let Some(contacts) = &mut self.contacts {
            contacts.follow(step, geometry);
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

/// Nothing is open while a node of either surface lies inside the other body, whatever the mean gaps say. Collective on the
/// roots.
fn nodes_inside(step: &Step, moved: &[Vec<[f64; 3]>], found: &mut Found) {
    let Step { case, plan, exchange, factors, .. } = *step;
    let deformed: Vec<Surface> = std::iter::zip(&plan.surfaces, moved).map(|(s, u)| s.moved(u)).collect();
    let surfaces = super::rows::both_surfaces(case, plan, exchange, &deformed);
    for end in &mut found.ends {
        let at = plan.ends.iter().position(|e| (e.0, e.1) == (end.pair, end.side));
        let (Some(i), Gap::Geometry { offset }) = (at, &case.contacts[end.pair].gap) else { continue };
        let [own, other] = &surfaces[i];
        let depth = match super::rows::rigid_motion(case, end.pair, 1 - end.side) {
            None => deepest_node(own, other, *offset),
            Some(motion) => {
                let u = motion.map(|m| factors.supports * m);
                let other = other.moved(&vec![u; other.nodes.len()]);
                deepest_node(own, &other, *offset).max(deepest_node(&other, own, *offset))
            }
        };
        end.beyond = end.beyond.max(depth);
    }
}
