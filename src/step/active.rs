//! A load step by the active-set driver: from the bodies' answers on the contact rows to forces, gaps and verdict.
use super::{
    contacts::Contacts,
    engine::{Advanced, prefixed, share_reason},
    found::Found,
    neutral::{self, Neutral},
    rows::rigid_motion,
    state::{BodyState, PairState, State},
    task::{Modes, Scene, Solution, Target, Task},
    text::gather_lines,
};
use crate::vector::larger;
use crate::{
    body::{Body, Response, ResponseKind},
    case::{BodyRef, Case, ContactGeometry, ResponseCase, Tolerance},
    contact::{
        Gap, Row, Surface, deepest_node,
        vector::{combine, dot},
    },
    error::{Error, Result},
    parallel::{self, Exchange, agree},
    petsc::Stage,
    record::{HistoryRow, Reason},
    scene::Plan,
};
use nalgebra::{DMatrix, DVector};
use std::{collections::HashMap, time::Instant};

/// Updates of the geometry after which a step gives up.
const GEOMETRY_UPDATES: usize = 30;

/// Motion of the surfaces from one geometry to the next, relative to their displacement, that is none: round-off of
/// positions, whatever the tolerance.
const SETTLED: f64 = 1e-10;

/// An automatic tolerance is a tenth of the discretisation error; of few meshes it comes below this.
const SELDOM_BELOW: f64 = 1e-8;

/// Turning of a surface in contact, rad, from which a user is told that the initial geometry does not hold.
const TURNED: f64 = 0.05;

/// The bodies of this rank's group, and the contact rows as its first rank holds them.
pub(crate) struct Active {
    pub bodies: Vec<Body>,
    responses: Vec<Response>,
    contacts: Option<Contacts>,
    modes: Modes,
    /// Motions of this rank's bodies along their own surfaces.
    neutral: Vec<Neutral>,
    /// The geometry that the rows are of; `None`: not known.
    rows_at: Option<Place>,
    pub clock: Clock,
}

/// Seconds that this rank has spent, waiting for others included.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Clock {
    /// Search and transfer.
    pub search: f64,
    /// From the assembled matrices to the bodies' answers on the contact rows.
    pub factorise: f64,
    /// Load steps: the driver, then the displacements of the whole bodies.
    pub step: f64,
    /// Of these the displacements.
    pub recover: f64,
}

/// What a step leaves for each body: contact nodal forces and displacements at the owned nodes.
#[derive(Default)]
struct Nodal {
    contact: Vec<Vec<f64>>,
    displacement: Vec<Vec<f64>>,
}

/// Where the surfaces are: displacements of the interface nodes by body, on the first ranks, and the factor on the motion
/// of rigid bodies.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    pub displacement: Vec<Vec<[f64; 3]>>,
    pub supports: f64,
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

impl Active {
    /// Meshes are there; finds the rows, assembles and factorises. Collective.
    pub fn new(case: &Case, plan: &Plan, exchange: &Exchange) -> Result<Active> {
        let groups = &plan.groups;
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
            body.answer_to(match case.alternation.tolerance {
                Tolerance::Fixed(tolerance) => tolerance,
                Tolerance::Automatic => SELDOM_BELOW,
            });
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
        let modes = number_modes(plan, &bodies);
        let neutral = match contacts.is_some() {
            true => neutral::find(case, plan, &bodies),
            false => Vec::new(),
        };
        let mut active = Active { bodies, responses, contacts, modes, neutral, rows_at: None, clock };
        active.rows_at = Some(active.place_of(plan, &State::start())?);
        Ok(active)
    }

    /// A load step from the state `from`, which is not changed. Collective.
    pub fn advance(
        &mut self,
        scene: &Scene,
        from: &State,
        target: Target,
        mut progress: impl FnMut(&HistoryRow),
    ) -> Result<Advanced> {
        let Scene { case, plan, .. } = *scene;
        let start = Instant::now();
        self.load(plan, target)?;
        let updated = case.contacts.iter().any(|c| c.geometry == ContactGeometry::Updated);
        let mut place = self.place_of(plan, from)?;
        let mut warm = from.pairs.clone();
        let mut found = Found::none();
        let mut end = Nodal::default();
        let mut damping = Damping::default();
        for update in 0..=GEOMETRY_UPDATES {
            if updated {
                self.follow(scene, &place)?;
            }
            let history = std::mem::take(&mut found.history);
            let counts = (found.updates, found.force_steps, found.displacement_steps);
            let (driven, solution) = self.drive(scene, target, &warm, &mut progress)?;
            found = driven;
            found.prepend(history, counts);
            let (recovering, _stage) = (Instant::now(), Stage::Recover.enter());
            end = self.recover(plan, &solution)?;
            self.clock.recover += recovering.elapsed().as_secs_f64();
            warm = solution.pairs;
            if !updated || !found.reason.converged() {
                break;
            }
            let now = Place {
                displacement: self.at_interfaces(plan, &end.displacement),
                supports: target.factors.supports,
            };
            let moved = now.distance(&place, plan);
            place = damping.next(place, now, plan);
            if moved <= larger(found.tolerance, SETTLED) {
                break;
            }
            if update == GEOMETRY_UPDATES {
                found.reason = Reason::Stalled;
                found.diagnosis.push(format!(
                    "after {GEOMETRY_UPDATES} damped updates of normals and gaps the surfaces still move by {moved:.1e} of their \
                     displacement, in smaller steps too: refine the mesh where one node or a corner carries"
                ));
            }
        }
        self.look_beyond(scene, target, &end, &mut found);
        found.turned = gather_lines(&plan.groups.world, &found.turned);
        found.warnings = gather_lines(&plan.groups.world, &found.warnings);
        found.refuse_penetration(&plan.groups.world);
        self.clock.step += start.elapsed().as_secs_f64();
        let state = self.state(plan, target, end.displacement, warm);
        Ok(Advanced { state, found, contact: end.contact })
    }

    /// Sets what acts. Collective.
    fn load(&mut self, plan: &Plan, target: Target) -> Result<()> {
        let group = &plan.groups.group;
        let loaded =
            std::iter::zip(&mut self.bodies, &mut self.responses).try_for_each(|(body, response)| {
                if body.set_load(target.factors, group)? {
                    body.reload(group, response)?;
                }
                Ok(())
            });
        agree(&plan.groups.world, loaded)?;
        if target.number > 1 {
            // A stiffness that varies with the temperature may have other soft modes.
            self.modes = number_modes(plan, &self.bodies);
        }
        Ok(())
    }

    /// Where a state's surfaces are. Collective.
    fn place_of(&self, plan: &Plan, state: &State) -> Result<Place> {
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
        let own = agree(&plan.groups.world, own.collect::<Result<Vec<_>>>())?;
        let displacement = self.at_interfaces(plan, &own);
        Ok(Place { displacement, supports: state.factors.supports })
    }

    /// Displacements of the interface nodes, on the first rank of the group. Collective.
    fn at_interfaces(&self, plan: &Plan, owned: &[Vec<f64>]) -> Vec<Vec<[f64; 3]>> {
        let group = &plan.groups.group;
        std::iter::zip(&self.bodies, owned).map(|(b, u)| b.at_nodes(group, u, &b.interface.nodes)).collect()
    }

    /// This rank's share of the state at the end of a step.
    fn state(
        &self,
        plan: &Plan,
        target: Target,
        displacement: Vec<Vec<f64>>,
        pairs: Vec<PairState>,
    ) -> State {
        let bodies = std::iter::zip(&self.bodies, displacement).zip(plan.groups.bodies());
        let bodies = bodies.map(|((body, displacement), &index)| BodyState {
            body: index,
            nodes: body.part.original[..body.part.n_owned].to_vec(),
            displacement,
        });
        State { factors: target.factors, bodies: bodies.collect(), pairs }
    }

    /// Penetration of the rows beyond the search distance, and whether the surfaces have turned too far for the normals
    /// they had before. Collective.
    fn look_beyond(&self, scene: &Scene, target: Target, end: &Nodal, found: &mut Found) {
        let (Scene { case, plan, exchange }, factors) = (*scene, target.factors);
        let mut moved = Vec::new();
        for (surface, &(_, _, body)) in std::iter::zip(&plan.surfaces, &plan.ends) {
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
        warm: &[PairState],
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
                let task = Task { scene: *scene, target, warm, modes: &self.modes, names: &names };
                let outcome = contacts.solve(&task, &self.neutral, &mut self.responses, progress);
                self.responses.iter().for_each(Response::finish);
                outcome
            }
        };
        parallel::idle_barrier(world);
        let (mut found, solution) = agree(world, outcome)?;
        share_reason(world, &mut found.reason);
        found.tolerance = parallel::from_first(world, found.tolerance);
        found.free_modes = gather_lines(world, &found.free_modes);
        found.held_modes = gather_lines(world, &found.held_modes);
        found.diagnosis = gather_lines(world, &found.diagnosis);
        Ok((found, solution))
    }

    /// Displacements and contact forces at the owned nodes of each body. Collective.
    fn recover(&mut self, plan: &Plan, solution: &Solution) -> Result<Nodal> {
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
            end.displacement.push(body.displacements(group, &contact, alpha)?);
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

/// Damping of the geometry's updates: none as long as each update moves the surfaces by less than half of the one before;
/// else Aitken's factor (Irons and Tuck, Int. J. Numer. Meth. Eng. 1 (1969) 275), w' = -w r.(r' - r) / |r' - r|^2 of two
/// motions r, r' to come.
struct Damping {
    factor: f64,
    last: Option<(Place, f64)>,
}

/// Least and largest damping factor: none is an update, and a larger one would not be damping.
const DAMPED: [f64; 2] = [0.05, 1.0];

impl Default for Damping {
    fn default() -> Self {
        Damping { factor: 1.0, last: None }
    }
}

impl Damping {
    /// The geometry to go on with: a share of the way from `place`, where the rows are, to `now`, where the bodies are.
    /// Collective.
    fn next(&mut self, place: Place, now: Place, plan: &Plan) -> Place {
        let motion = now.combined(1.0, &place, -1.0);
        let size = parallel::sum(&plan.groups.world, &[motion.dot(&motion)])[0];
        if let Some((last, before)) = &self.last {
            let change = motion.combined(1.0, last, -1.0);
            let sums = [last.dot(&change), change.dot(&change)];
            let sums = parallel::sum(&plan.groups.world, &sums);
            if size > 0.25 * before || self.factor < 1.0 {
                let factor = -self.factor * sums[0] / sums[1];
                self.factor = if factor.is_finite() { factor.clamp(DAMPED[0], DAMPED[1]) } else { 1.0 };
            }
        }
        let mut next = place.combined(1.0, &motion, self.factor);
        if self.factor >= 1.0 {
            next = now.clone();
        }
        next.supports = now.supports;
        self.last = Some((motion, size));
        next
    }
}

impl Place {
    /// a x + b y of the displacements.
    fn combined(&self, a: f64, other: &Place, b: f64) -> Place {
        let sum = |(x, y): (&Vec<[f64; 3]>, &Vec<[f64; 3]>)| {
            std::iter::zip(x, y).map(|(x, y)| combine([(a, x), (b, y)])).collect()
        };
        let displacement = std::iter::zip(&self.displacement, &other.displacement).map(sum).collect();
        Place { displacement, supports: self.supports }
    }

    /// x . y over this rank's nodes.
    fn dot(&self, other: &Place) -> f64 {
        let pairs =
            std::iter::zip(&self.displacement, &other.displacement).flat_map(|(x, y)| std::iter::zip(x, y));
        pairs.map(|(x, y)| dot(x, y)).sum()
    }

    /// Largest difference of the displacements from another place's, relative to the largest displacement. Collective.
    fn distance(&self, other: &Place, plan: &Plan) -> f64 {
        let size = |v: &[f64; 3]| dot(v, v).sqrt();
        let mut largest = [0.0_f64; 2];
        for (u, old) in std::iter::zip(self.displacement.as_slice(), &other.displacement)
            .flat_map(|(now, old)| std::iter::zip(now, old))
        {
            largest[0] = larger(largest[0], size(&crate::contact::vector::sub(u, old)));
            largest[1] = larger(largest[1], size(u));
        }
        let largest = parallel::max(&plan.groups.world, &largest);
        if largest[1] > 0.0 { largest[0] / largest[1] } else { 0.0 }
    }
}

/// Nothing is open while a node of either surface lies inside the other body, whatever the mean gaps say. Collective on the
/// roots.
fn nodes_inside(scene: &Scene, target: Target, moved: &[Vec<[f64; 3]>], found: &mut Found) {
    let (Scene { case, plan, exchange }, factors) = (*scene, target.factors);
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
                larger(deepest_node(own, &other, *offset), deepest_node(&other, own, *offset))
            }
        };
        end.beyond = larger(end.beyond, depth);
    }
}
