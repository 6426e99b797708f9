//! A load step: from the bodies' answers on the contact rows to forces, gaps and verdict.
use super::{
    contacts::Contacts,
    engine::{Clock, Engine, Nodal},
    found::Found,
    neutral,
    newton::{Newton, Progress},
    place::{Damping, Place, rigid_factor, rigid_factors},
    rows::rigid_motion,
    state::{BodyState, Energy, PairState, State},
    task::{Influence, Modes, Scene, Solution, Target, Task},
    text::gather_lines,
};
use crate::vector::{in_figures, larger};
use crate::{
    body::{Accuracy, Body, Response, ResponseKind},
    case::{BodyRef, Case, ContactGeometry, Driver, ResponseCase, Tolerance},
    contact::{Gap, Row, Surface, deepest_node, vector::dot},
    error::{Error, Result},
    parallel::{self, Exchange, agree},
    petsc::Stage,
    record::{HistoryRow, Reason},
    scene::{ContactSide, Plan},
    schwarz::{Coarse, Coupling, PairRows},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use nalgebra::{DMatrix, DVector};
use std::{collections::HashMap, time::Instant};

/// Updates of the geometry after which a step gives up.
const GEOMETRY_UPDATES: usize = 30;

/// Motion of the surfaces from one geometry to the next, relative to their displacement, that is none: round-off of
/// positions, whatever the tolerance.
const SETTLED: f64 = 1e-10;

/// Stretch or turn of surfaces, relative to their length, from which on there is nothing to follow: small strains take a facet
/// turned by 45 degrees for one 1.4 times as long.
const FOLLOWED: f64 = 1.0;

/// An automatic tolerance is a tenth of the discretisation error; of few meshes it comes below this.
const SELDOM_BELOW: f64 = 1e-8;

/// Turning of a surface in contact, rad, from which a user is told that the initial geometry does not hold.
const TURNED: f64 = 0.05;

/// What a step makes: the next state, if `found.reason` is a solution, what was found on the way, and the contact
/// nodal forces at the owned nodes of each body, N.
pub(crate) struct Advanced {
    pub state: State,
    pub found: Found,
    pub contact: Vec<Vec<f64>>,
    /// What decides the peak pressures of the pairs; none where the driver does not tell.
    pub influences: Vec<(Influence, Nodal)>,
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

/// Collective.
fn number_modes(plan: &Plan, bodies: &[Body]) -> Modes {
    let groups = &plan.groups;
    let counts: Vec<usize> = bodies.iter().map(Body::n_modes).collect();
    let mut all = vec![0.0; plan.dofs.len()];
    if groups.is_root() {
        std::iter::zip(groups.bodies(), &counts).for_each(|(&b, n)| all[b] = *n as f64);
    }
    let all = parallel::sum(&groups.world, &all);
    let before = |b: usize| all[..b].iter().sum::<f64>() as usize;
    Modes { total: before(all.len()), first: groups.bodies().iter().map(|&b| before(b)).collect(), counts }
}

impl Engine {
    /// Meshes are there; finds the rows, assembles and factorises. Collective.
    pub fn new(case: &Case, plan: &Plan, exchange: &Exchange) -> Result<Engine> {
        let groups = &plan.groups;
        let is_relaxed = matches!(case.alternation.driver, Driver::Relaxed(_));
        let (start, stage) = (Instant::now(), Stage::Search.enter());
        let contacts =
            if groups.is_root() { Contacts::new(case, plan, exchange).map(Some) } else { Ok(None) };
        let mut contacts = agree(&groups.world, contacts)?;
        let mut clock = Clock { search: start.elapsed().as_secs_f64(), ..Clock::default() };
        drop(stage);
        let mut assembled = Vec::new();
        let built = groups.bodies().iter().enumerate().try_for_each(|(i, &b)| {
            if let Some(options) = &case.bodies[b].solver {
                crate::petsc::set_options(&prefixed(options, &case.bodies[b].name))?;
            }
            let nodes = contacts.as_ref().map_or_else(Vec::new, |c| c.shares.interface[i].clone());
            let mut nodes: Vec<f64> = nodes.into_iter().map(f64::from).collect();
            parallel::broadcast(&groups.group, 0, &mut nodes);
            let nodes: Vec<u32> = nodes.into_iter().map(|n| n as u32).collect();
            let kind = match case.bodies[b].response {
                // It asks for displacements at the active rows alone, and for exact answers.
                _ if is_relaxed => ResponseKind::Condensed,
                // Its compliance is needed as a matrix, and a model of it takes more alternations.
                ResponseCase::Automatic if case.has_friction() => ResponseKind::Condensed,
                ResponseCase::Automatic => ResponseKind::Automatic,
                ResponseCase::Condensed => ResponseKind::Condensed,
                ResponseCase::Solver => ResponseKind::Solver,
            };
            let (body, mesh, group) = (&case.bodies[b], &plan.meshes[i], &groups.group);
            assembled.push(Body::assemble(body, case, mesh, group, &nodes, kind)?);
            Ok(())
        });
        agree(&groups.world, built)?;
        let start = Instant::now();
        let (mut bodies, mut responses) = (Vec::new(), Vec::new());
        let factorised = assembled.into_iter().enumerate().try_for_each(|(i, mut body)| {
            body.answer_to(match case.alternation.tolerance {
                Tolerance::Fixed(tolerance) => tolerance,
                Tolerance::Automatic => SELDOM_BELOW,
            });
            if !is_relaxed {
                body.split_soft_modes(softness(case, groups.bodies()[i]));
            }
            let mut body = body.factorise(&groups.group)?;
            let rows =
                contacts.as_mut().map_or_else(Vec::new, |c| std::mem::take(&mut c.shares.body_rows[i]));
            responses.push(body.respond(&groups.group, rows)?);
            bodies.push(body);
            Ok(())
        });
        agree(&groups.world, factorised)?;
        clock.factorise = start.elapsed().as_secs_f64();
        let modes = number_modes(plan, &bodies);
        let neutral = match contacts.is_some() {
            true => neutral::find(case, plan, &bodies),
            false => Vec::new(),
        };
        let mut engine = Engine { bodies, responses, contacts, modes, neutral, rows_at: None, clock };
        engine.rows_at = Some(engine.place_of(case, plan, &State::start())?);
        Ok(engine)
    }

    /// The state at the end of a load step that begins in `from`, which is not changed. Collective.
    pub fn advance(
        &mut self,
        scene: &Scene,
        from: &State,
        target: Target,
        mut progress: impl FnMut(&HistoryRow),
    ) -> Result<Advanced> {
        let _stage = Stage::Alternate.enter();
        let Scene { case, plan, .. } = *scene;
        let start = Instant::now();
        self.load(plan, target)?;
        let updated = case.contacts.iter().any(|c| c.geometry == ContactGeometry::Updated);
        let temperatures = self.temperatures(case, plan);
        let mut place = self.place_of(case, plan, from)?;
        let begun = place.clone();
        let mut warm = from.pairs.clone();
        let mut found = Found::none();
        let mut end = Nodal { contact: Vec::new(), displacement: Vec::new() };
        let mut decisive = Vec::new();
        let mut damping = Damping::default();
        let mut newton = case.has_plasticity().then(|| self.begin(scene, from)).transpose()?;
        let mut updates = 0;
        loop {
            if updated {
                self.follow(scene, &place)?;
            }
            let driven =
                self.drive(scene, target, (&begun, &from.pairs), &warm, &temperatures, &mut progress);
            let (driven, solution) = match driven {
                // The bodies of the first iteration are elastic: what does not hold those is a missing support.
                Err(Error::Unrestrained(_)) if found.iterations > 0 => {
                    found.reason = Reason::NoEquilibrium;
                    found.diagnosis.push(
                        "where bodies yield, nothing is left that holds them against their loads".into(),
                    );
                    break;
                }
                driven => driven?,
            };
            let before = std::mem::replace(&mut found, driven);
            found.prepend(before);
            let (recovering, _stage) = (Instant::now(), Stage::Recover.enter());
            let accuracy = newton.as_ref().map_or(Accuracy::Refined, Newton::accuracy);
            end = self.recover(plan, &solution, accuracy)?;
            self.clock.recover += recovering.elapsed().as_secs_f64();
            let mut balanced = true;
            if let Some(iterations) = newton.as_mut().filter(|_| found.reason.converged()) {
                iterations.as_accurate_as(found.tolerance);
                found.iterations += 1;
                match self.iterate(iterations, plan, &solution, &mut end)? {
                    Progress::Solved => {}
                    Progress::Goes => balanced = false,
                    Progress::Failed(why) => {
                        found.reason = Reason::NoEquilibrium;
                        found.diagnosis.push(why);
                    }
                }
            }
            warm = solution.pairs;
            decisive = solution.influences;
            if !found.reason.converged() || (!updated && balanced) {
                break;
            }
            if !updated {
                continue;
            }
            let now = Place {
                displacement: self.at_interfaces(plan, &end.displacement),
                rigid: rigid_factors(case, target.factors),
            };
            let stretch = self.contacts.as_ref().map_or(0.0, |contacts| contacts.stretch(scene, &now));
            let stretch = parallel::max(&plan.groups.world, &[stretch])[0];
            if stretch > FOLLOWED {
                found.reason = Reason::ChecksFailed;
                found.diagnosis.push(format!(
                    "surfaces that are followed stretch or turn by up to {} times their length, which no small strain is: look at the \
                     units of moduli, loads and lengths",
                    in_figures(stretch)
                ));
                break;
            }
            let moved = now.distance(&place, plan);
            place = damping.next(place, now, plan);
            // No further than round-off let the forces come.
            let accuracy = parallel::from_first(&plan.groups.world, found.round_off.unwrap_or(0.0));
            if balanced && moved <= larger(larger(found.tolerance, SETTLED), accuracy) {
                break;
            }
            updates += usize::from(balanced);
            if updates > GEOMETRY_UPDATES {
                found.reason = Reason::Stalled;
                found.diagnosis.push(format!(
                    "after {GEOMETRY_UPDATES} damped updates of normals and gaps the surfaces still move by {moved:.1e} of their \
                     displacement, in smaller steps too: refine the mesh where one node or a corner carries"
                ));
                break;
            }
        }
        if let Some(iterations) = newton {
            if !found.reason.converged() {
                end = iterations.whole;
                self.bring_to(plan, &end.displacement)?;
                decisive.clear();
            }
            found.residuals = iterations.residuals;
        }
        let influences = decisive
            .into_iter()
            .map(|(influence, solution)| Ok((influence, self.recover(plan, &solution, Accuracy::AsSolved)?)))
            .collect::<Result<Vec<_>>>()?;
        self.look_beyond(scene, target, &end, &mut found);
        found.turned = gather_lines(&plan.groups.world, &found.turned);
        found.warnings = gather_lines(&plan.groups.world, &found.warnings);
        found.refuse_penetration(&plan.groups.world);
        self.clock.step += start.elapsed().as_secs_f64();
        let state = self.state(plan, target, end.displacement, warm, from.energy);
        Ok(Advanced { state, found, contact: end.contact, influences })
    }

    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The bodies joined on the contact rows that they begin with, for drivers to be tried on; `None` on ranks that are not
    /// the first of their group. Collective on the roots.
    pub fn on_rows<T>(
        &mut self,
        exchange: &Exchange,
        look: impl FnOnce(&mut Coupling<Response>, &[PairRows], &Coarse) -> T,
    ) -> Option<T> {
        let rows = &self.contacts.as_ref()?.shares.rows;
        let ends = &self.contacts.as_ref()?.shares.ends;
        let scaling = rows.iter().flat_map(|r| std::iter::repeat_n(r.stiffness, r.gap.len())).collect();
        let mut coupling = Coupling::new(&mut self.responses, ends, exchange);
        let coarse = Coarse::new(&coupling, self.modes.total, &self.modes.first, scaling);
        Some(look(&mut coupling, rows, &coarse))
    }

    /// Sets what acts. Collective.
    pub(super) fn load(&mut self, plan: &Plan, target: Target) -> Result<()> {
        let group = &plan.groups.group;
        let loaded =
            std::iter::zip(&mut self.bodies, &mut self.responses).try_for_each(|(body, response)| {
                if body.set_load(target.factors, group)? {
                    body.reload(group, response)?;
                }
                Ok(())
            });
        agree(&plan.groups.world, loaded)?;
        if (target.number, target.increment) > (1, 1) {
            // A stiffness that varies with the temperature may have other soft modes.
            self.number_modes(plan);
        }
        Ok(())
    }

    /// Collective.
    pub(super) fn number_modes(&mut self, plan: &Plan) {
        self.modes = number_modes(plan, &self.bodies);
    }

    /// Temperatures at the nodes of each end's surface, K, on the first ranks; nothing where no law varies with them. Collective.
    fn temperatures(&self, case: &Case, plan: &Plan) -> Vec<Option<Vec<f64>>> {
        if case.contacts.iter().all(|contact| contact.over_temperature.is_none()) {
            return Vec::new();
        }
        let group = &plan.groups.group;
        let of_end = |(surface, end): (&Surface, &ContactSide)| {
            self.bodies[plan.place(end.body)].temperatures_at(group, &surface.nodes)
        };
        std::iter::zip(&plan.surfaces, &plan.ends).map(of_end).collect()
    }

    /// Where a state's surfaces are. Collective.
    fn place_of(&self, case: &Case, plan: &Plan, state: &State) -> Result<Place> {
        let displacement = self.at_interfaces(plan, &self.displacements_of(plan, state)?);
        Ok(Place { displacement, rigid: rigid_factors(case, &state.factors) })
    }

    /// A state's displacements at the owned nodes of each body. Collective.
    pub(super) fn displacements_of(&self, plan: &Plan, state: &State) -> Result<Vec<Vec<f64>>> {
        let of = |body: &Body, index: &usize| {
            let known = state.bodies.iter().find(|b| b.body == *index);
            let own = &body.part.original[..body.part.n_owned];
            let Some(known) = known else { return Ok(vec![0.0; own.len() * body.dim()]) };
            if known.nodes == own {
                return Ok(known.displacement.clone());
            }
            // A state of other ranks: by its nodes.
            let at: HashMap<u32, &[f64]> =
                std::iter::zip(&known.nodes, known.displacement.chunks_exact(body.dim()))
                    .map(|(n, u)| (*n, u))
                    .collect();
            let found: Option<Vec<&[f64]>> = own.iter().map(|n| at.get(n).copied()).collect();
            found.map(|u| u.concat()).ok_or_else(|| Error::internal("the state lacks nodes of the mesh"))
        };
        let own = std::iter::zip(&self.bodies, plan.groups.bodies()).map(|(b, i)| of(b, i));
        agree(&plan.groups.world, own.collect::<Result<Vec<_>>>())
    }

    /// Displacements of the interface nodes, on the first rank of the group. Collective.
    fn at_interfaces(&self, plan: &Plan, owned: &[Vec<f64>]) -> Vec<Vec<[f64; 3]>> {
        let group = &plan.groups.group;
        std::iter::zip(&self.bodies, owned).map(|(b, u)| b.at_nodes(group, u, &b.interface.nodes)).collect()
    }

    /// This rank's share of the state at the end of a step; `energy`: that of the state before.
    fn state(
        &self,
        plan: &Plan,
        target: Target,
        displacement: Vec<Vec<f64>>,
        pairs: Vec<PairState>,
        energy: Energy,
    ) -> State {
        let bodies = std::iter::zip(&self.bodies, displacement).zip(plan.groups.bodies());
        let bodies = bodies.map(|((body, displacement), &index)| {
            let (points, ends) = body.point_states();
            BodyState {
                body: index,
                nodes: body.part.original[..body.part.n_owned].to_vec(),
                displacement,
                cells: if body.yields() { body.part.original_cells.clone() } else { Vec::new() },
                ends: ends.to_vec(),
                points: points.to_vec(),
            }
        });
        State { factors: target.factors.clone(), bodies: bodies.collect(), pairs, energy }
    }

    /// Penetration of the rows beyond the search distance, and whether the surfaces have turned too far for the normals
    /// they had before. Collective.
    fn look_beyond(&self, scene: &Scene, target: Target, end: &Nodal, found: &mut Found) {
        let (Scene { case, plan, exchange }, factors) = (*scene, target.factors);
        let mut moved = Vec::new();
        for (surface, &ContactSide { body, .. }) in std::iter::zip(&plan.surfaces, &plan.ends) {
            let place = plan.place(body);
            let u = self.bodies[place].at_nodes(&plan.groups.group, &end.displacement[place], &surface.nodes);
            moved.push(u);
        }
        let Some(contacts) = &self.contacts else { return };
        if found.reason == Reason::Open {
            nodes_inside(scene, target, &moved, found);
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
            let rigid = rigid_motion(case, end.pair, 1 - pair.multiplier);
            let updated = case.contacts[end.pair].geometry == ContactGeometry::Updated;
            for (j, row) in pair.beyond.iter().enumerate() {
                if updated {
                    // Its gap is that of the deformed surfaces already.
                    found.ends[i].beyond = larger(found.ends[i].beyond, -row.gap);
                    continue;
                }
                let other = match rigid {
                    Some(u) => {
                        rigid_factor(case, factors, end.pair, 1 - pair.multiplier)
                            * row.terms[1].iter().map(|(_, v)| dot(v, &u)).sum::<f64>()
                    }
                    None => received[i][j],
                };
                found.ends[i].beyond = larger(found.ends[i].beyond, own[i][j] + other - row.gap);
            }
            if !updated {
                let (before, surface) = (&plan.surfaces[i], plan.surfaces[i].moved(&moved[i]));
                let table = &found.ends[i].table;
                let turned = (0..table.status.len()).filter(|&n| table.touches(n)).map(|n| {
                    let [a, b] = [&before.normals[n], &surface.normals[n]];
                    larger(1.0 - dot(a, b).powi(2), 0.0).sqrt()
                });
                let turned = turned.fold(0.0, larger);
                if turned > TURNED {
                    found.turned.push(format!(
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
            .map(|lines| gather_lines(&plan.groups.world, &lines))
    }

    /// Runs the driver on the first ranks; the others serve bodies that answer by their solver. Collective.
    fn drive(
        &mut self,
        scene: &Scene,
        target: Target,
        (from, before): (&Place, &[PairState]),
        warm: &[PairState],
        temperatures: &[Option<Vec<f64>>],
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<(Found, Solution)> {
        let world = &scene.plan.groups.world;
        let outcome = match &self.contacts {
            None => {
                let served = self.responses.iter_mut().try_for_each(Response::serve);
                served.map(|()| (Found::none(), Solution::default()))
            }
            Some(contacts) => {
                let names = |b: usize, k: usize| self.bodies[b].mode_name(k);
                let coefficients = &contacts.coefficients(scene, temperatures)[..];
                let (scene, modes, names) = (*scene, &self.modes, &names);
                let task = Task { scene, target, from, before, warm, modes, coefficients, names };
                let outcome = contacts.solve(&task, &self.neutral, &mut self.responses, progress);
                self.responses.iter().for_each(Response::finish);
                outcome
            }
        };
        parallel::idle_barrier(world);
        let (mut found, mut solution) = agree(world, outcome)?;
        share_influences(world, &mut solution.influences);
        share_reason(world, &mut found.reason);
        found.tolerance = parallel::from_first(world, found.tolerance);
        found.free_modes = gather_lines(world, &found.free_modes);
        found.held_modes = gather_lines(world, &found.held_modes);
        found.diagnosis = gather_lines(world, &found.diagnosis);
        Ok((found, solution))
    }

    /// Displacements and contact forces at the owned nodes of each body. Collective.
    pub(super) fn recover(&mut self, plan: &Plan, solution: &Solution, accuracy: Accuracy) -> Result<Nodal> {
        let group = &plan.groups.group;
        let mut end = Nodal::default();
        let done = self.bodies.iter_mut().enumerate().try_for_each(|(i, body)| {
            let force = solution.force.get(i).map_or(&[][..], Vec::as_slice);
            let alpha = solution.alpha.get(i).map_or(&[][..], Vec::as_slice);
            let mut contact = body.contact_forces(&self.responses[i], force);
            if !solution.relief.is_empty() {
                let relief = &solution.relief[self.modes.first[i]..][..body.free.modes.len()];
                neutral::relieve(body, relief, &mut contact);
            }
            end.displacement.push(body.displacements(group, &contact, alpha, accuracy)?);
            end.contact.push(contact);
            Ok(())
        });
        agree(&plan.groups.world, done)?;
        self.hold_free_motions(plan, solution, &mut end.displacement);
        Ok(end)
    }

    /// Takes out of the displacements what they have of the motions that nothing restrains, whatever the fixings left of
    /// them: with V a basis of these motions and Z the modes, u - Z V (V'Z'Z V)^-1 V'Z'u. Collective.
    fn hold_free_motions(&self, plan: &Plan, solution: &Solution, displacement: &mut [Vec<f64>]) {
        let (world, n) = (&plan.groups.world, self.modes.total);
        let mut basis = solution.unrestrained.concat();
        parallel::broadcast(world, 0, &mut basis);
        if basis.is_empty() {
            return;
        }
        let basis = DMatrix::from_column_slice(n, basis.len() / n, &basis);
        // Z'Z and Z'u over all nodes of all bodies.
        let mut sums = vec![0.0; n * n + n];
        for ((body, u), &first) in std::iter::zip(&self.bodies, displacement.iter()).zip(&self.modes.first) {
            let (dim, modes) = (body.dim(), body.free.modes.len());
            for (node, u) in u.chunks_exact(dim).enumerate() {
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
        for ((body, u), &first) in std::iter::zip(&self.bodies, displacement).zip(&self.modes.first) {
            let dim = body.dim();
            for (node, u) in u.chunks_exact_mut(dim).enumerate() {
                for k in 0..body.free.modes.len() {
                    let mode = body.free.at(k, body.part.original[node], &body.part.points[node]);
                    std::iter::zip(u.iter_mut(), mode).for_each(|(u, m)| *u -= amplitudes[first + k] * m);
                }
            }
        }
    }

    /// Brings normals, transfer and gaps to the displaced surfaces, and the bodies' answers on the new rows, unless
    /// they are there. Collective.
    fn follow(&mut self, scene: &Scene, place: &Place) -> Result<()> {
        let plan = scene.plan;
        let differs = self.rows_at.as_ref() != Some(place);
        if parallel::max(&plan.groups.world, &[f64::from(u8::from(differs))])[0] == 0.0 {
            return Ok(());
        }
        self.rows_at = None;
        let (start, stage) = (Instant::now(), Stage::Search.enter());
        let mut rows = vec![Vec::new(); self.bodies.len()];
        if let Some(contacts) = &mut self.contacts {
            contacts.follow(scene, place);
            rows = std::mem::take(&mut contacts.shares.body_rows);
        }
        self.clock.search += start.elapsed().as_secs_f64();
        drop(stage);
        let answered =
            std::iter::zip(&mut self.bodies, rows).enumerate().try_for_each(|(i, (body, rows))| {
                self.responses[i] = body.respond(&plan.groups.group, rows)?;
                Ok(())
            });
        agree(&plan.groups.world, answered)?;
        self.rows_at = Some(place.clone());
        Ok(())
    }
}

/// Rank 0's, known to all. Rank 0 is always a group's first rank. Collective.
fn share_influences(world: &SimpleCommunicator, influences: &mut Vec<(Influence, Solution)>) {
    let numbers =
        |(i, _): &(Influence, Solution)| [i.pair as f64, i.value, i.scale, i.partners[0], i.partners[1]];
    let mut all: Vec<f64> = influences.iter().flat_map(numbers).collect();
    parallel::broadcast(world, 0, &mut all);
    let known = all.as_chunks::<5>().0;
    let missing = known.iter().skip(influences.len());
    let missing = missing.map(|&[pair, value, scale, own, others]| {
        (Influence { pair: pair as usize, value, scale, partners: [own, others] }, Solution::default())
    });
    influences.extend(missing.collect::<Vec<_>>());
}

/// Nothing is open while a node of either surface lies inside the other body, whatever the mean gaps say. Collective on the
/// roots.
fn nodes_inside(scene: &Scene, target: Target, moved: &[Vec<[f64; 3]>], found: &mut Found) {
    let (Scene { case, plan, exchange }, factors) = (*scene, target.factors);
    let deformed: Vec<Surface> = std::iter::zip(&plan.surfaces, moved).map(|(s, u)| s.moved(u)).collect();
    let surfaces = super::rows::both_surfaces(case, plan, exchange, &deformed);
    for end in &mut found.ends {
        let at = plan.end(end.pair, end.side);
        let (Some(i), Gap::Geometry { offset }) = (at, &case.contacts[end.pair].gap) else { continue };
        let [own, other] = &surfaces[i];
        let depth = match super::rows::rigid_motion(case, end.pair, 1 - end.side) {
            None => deepest_node(own, other, *offset),
            Some(motion) => {
                let factor = rigid_factor(case, factors, end.pair, 1 - end.side);
                let u = motion.map(|m| factor * m);
                let other = other.moved(&vec![u; other.nodes.len()]);
                larger(deepest_node(own, &other, *offset), deepest_node(&other, own, *offset))
            }
        };
        end.beyond = larger(end.beyond, depth);
    }
}

/// A body's own PETSc options under its prefix: `-ksp_type cg` becomes `-body_<name>_ksp_type cg`.
fn prefixed(options: &str, name: &str) -> String {
    options
        .split_whitespace()
        .map(|word| match word.strip_prefix('-') {
            Some(option) if option.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                format!("-{}{option}", crate::body::options_prefix(name))
            }
            _ => word.to_owned(),
        })
        .collect::<Vec<_>>()
        .join(" ")
}

/// Rank 0's verdict, known to all. Rank 0 is always a group's first rank. Collective.
fn share_reason(world: &SimpleCommunicator, reason: &mut Reason) {
    let mut code = Reason::ALL.iter().position(|r| r == reason).unwrap_or(0) as u64;
    world.process_at_rank(0).broadcast_into(&mut code);
    *reason = Reason::ALL[code as usize];
}
