//! A run by the paper's alternation: contact nodes, conjugate points, compliances, and what it found.
use super::{
    engine::{Advanced, prefixed, share_reason},
    found::{EndFound, Found, empty_table},
    state::{BodyState, State},
    task::{Scene, Target},
};
use crate::vector::larger;
use crate::{
    body::{Body, Compliance, ContactRow, ResponseKind},
    case::{Case, ContactCase, Tolerance, Weights},
    contact::{Pairing, Surface, vector::dot},
    error::{Error, Result},
    material::LinearElastic,
    parallel::{self, Exchange, agree},
    petsc,
    record::{HistoryRow, Reason, SideTable},
    scene::Plan,
    schwarz::{self, Alternation, ContactNode, Side, alternation::SideState, weights::Both},
};
use mpi::topology::SimpleCommunicator;

/// Default search distance as a share of the smaller surface's extent.
const SEARCH: f64 = 0.1;

/// A contact node whose free directions carry less than this share of the normal is held by its support.
const HELD: f64 = 0.1;

/// Pairs and sides as the first rank of a group holds them.
pub(crate) struct Contacts {
    pub(crate) sides: Vec<Side>,
    /// Per side: nodes that have a conjugate point but are no candidates: they must not come to penetrate.
    pub(crate) beyond: Vec<Vec<ContactNode>>,
}

/// The bodies as the alternation needs them: assembled, factorised, their contact nodes paired.
pub struct Interface {
    /// Meshes, rank groups, contact surfaces.
    pub plan: Plan,
    /// This group's bodies.
    pub bodies: Vec<Body>,
    /// Their compliances, on the group's first rank.
    pub compliances: Vec<Compliance>,
    /// Sides of pairs, on the group's first rank.
    pub(crate) contacts: Option<Contacts>,
}

impl Interface {
    /// Builds it. Collective.
    pub fn new(case: &Case, world: &SimpleCommunicator) -> Result<Interface> {
        let plan = Plan::new(case, world)?;
        let groups = &plan.groups;
        // Both groups of a pair hold both surfaces.
        let exchange = plan.exchange(case);
        let stage = petsc::Stage::Search.enter();
        let contacts = if groups.is_root() { pair_up(case, &plan, &exchange).map(Some) } else { Ok(None) };
        let contacts = agree(world, contacts)?;
        drop(stage);
        let observed: Vec<Vec<u32>> = groups.bodies().iter().map(|&b| plan.observed(b)).collect();
        let (mut bodies, mut free) = (Vec::new(), Vec::new());
        let built = groups.bodies().iter().enumerate().try_for_each(|(i, &b)| {
            if let Some(options) = &case.bodies[b].solver {
                petsc::set_options(&prefixed(options, &case.bodies[b].name))?;
            }
            let mut body = Body::new(
                &case.bodies[b],
                case.analysis,
                &plan.meshes[i],
                &groups.group,
                &observed[i],
                ResponseKind::Solver,
            )?;
            free.push(Compliance::free_displacements(&mut body, &groups.group, &observed[i])?);
            bodies.push(body);
            Ok(())
        });
        agree(world, built)?;
        let mut contacts = contacts;
        if let Some(contacts) = &mut contacts {
            contacts.narrow(case, &free, &exchange);
        }
        let mut compliances = Vec::new();
        let condensed = bodies.iter_mut().enumerate().try_for_each(|(i, body)| {
            let rows = contacts.as_ref().map_or_else(Vec::new, |c| contact_rows(c, i));
            let free = std::mem::take(&mut free[i]);
            compliances.extend(Compliance::new(body, &groups.group, &observed[i], free, rows)?);
            Ok(())
        });
        agree(world, condensed)?;
        drop(exchange);
        Ok(Interface { plan, bodies, compliances, contacts })
    }

    /// This rank's sides of pairs; none but on the first rank of a group.
    pub fn sides(&self) -> &[Side] {
        self.contacts.as_ref().map_or(&[], |c| &c.sides)
    }
}

impl Contacts {
    /// Keeps as candidates the nodes that contact can reach: those whose gap without contact forces is no more than
    /// [`REACH`] times the largest closing of any node. The others are checked at the end. A search distance in the
    /// case is taken at its word. Collective on the roots.
    fn narrow(&mut self, case: &Case, free: &[Vec<[f64; 3]>], exchange: &Exchange) {
        let own: Vec<&[[f64; 3]]> = self.sides.iter().map(|s| &free[s.body][s.observed.clone()]).collect();
        let out: Vec<Vec<f64>> = own.iter().map(|u| u.as_flattened().to_vec()).collect();
        let others = exchange.swap(&out);
        let approach = |i: usize, node: &ContactNode| {
            let other = Side::vector_at_conjugate(node, others[i].as_chunks().0);
            dot(&node.conjugate.normal, &crate::contact::vector::sub(&own[i][node.node], &other))
        };
        let closing = self.sides.iter().enumerate().flat_map(|(i, s)| s.nodes.iter().map(move |n| (i, n)));
        let closing = closing.map(|(i, node)| approach(i, node)).fold(0.0, larger);
        let closing = exchange.max(&[closing])[0];
        let mut kept: Vec<Vec<ContactNode>> = Vec::new();
        for (i, side) in self.sides.iter().enumerate() {
            let chosen = case.contacts[side.pair].search_distance.is_some();
            let (near, far): (Vec<_>, Vec<_>) = side
                .nodes
                .iter()
                .cloned()
                .partition(|node| chosen || node.conjugate.gap - approach(i, node) <= REACH * closing);
            kept.push(near);
            self.beyond[i].extend(far);
        }
        let mut rows = vec![0; free.len()];
        for (side, nodes) in std::iter::zip(&mut self.sides, kept) {
            side.nodes = nodes;
            for node in &mut side.nodes {
                node.row = rows[side.body];
                rows[side.body] += 1;
            }
        }
    }
}

/// Gap, in largest closings, up to which contact forces may be expected to close it.
const REACH: f64 = 2.0;

/// ConjugateRule points and candidates of every pair this rank shares. Collective on the roots.
fn pair_up(case: &Case, plan: &Plan, exchange: &Exchange) -> Result<Contacts> {
    let packed: Vec<Vec<f64>> = plan.surfaces.iter().map(Surface::pack).collect();
    let others: Vec<Surface> = exchange.swap(&packed).iter().map(|v| Surface::unpack(v)).collect();
    let own_modulus = |b: usize| LinearElastic::new(&case.bodies[b].material, case.analysis).plane_modulus();
    let mut contacts = Contacts { sides: Vec::new(), beyond: Vec::new() };
    let mut pairings = Vec::new();
    let mut held: Vec<Vec<f64>> = Vec::new();
    for (i, &(pair, side, body)) in plan.ends.iter().enumerate() {
        let contact = &case.contacts[pair];
        let (own, other) = (&plan.surfaces[i], &others[i]);
        let ordered = if side == 0 { [own, other] } else { [other, own] };
        let mut pairing = Pairing::new(ordered, &contact.gap, contact.conjugate);
        let conjugates = std::mem::take(&mut pairing.conjugates[side]);
        let place = plan.groups.bodies().iter().position(|&b| b == body).unwrap_or(0);
        let constraints = crate::body::Constraints::new(&case.bodies[body], &plan.meshes[place])?;
        let is_held = |node: u32, normal: &[f64; 3]| {
            constraints.0.get(&node).is_some_and(|support| {
                let free = support.free_part(normal, plan.meshes[place].dim);
                dot(&free, &free).sqrt() < HELD
            })
        };
        held.push(
            std::iter::zip(&own.nodes, &conjugates)
                .map(|(&node, c)| f64::from(u8::from(c.as_ref().is_some_and(|c| is_held(node, &c.normal)))))
                .collect(),
        );
        pairings.push(conjugates);
    }
    let others_held = exchange.swap(&held);
    let mut rows = vec![0; plan.groups.bodies().len()];
    let mut offsets = vec![0; plan.groups.bodies().len()];
    for (i, (conjugates, &(pair, side, body))) in std::iter::zip(pairings, &plan.ends).enumerate() {
        let place = plan.groups.bodies().iter().position(|&b| b == body).unwrap_or(0);
        let n = plan.surfaces[i].nodes.len();
        let reach = search_distance(&case.contacts[pair], &plan.surfaces[i], &others[i]);
        let (mut nodes, mut beyond) = (Vec::new(), Vec::new());
        for (node, conjugate) in conjugates.into_iter().enumerate() {
            let Some(conjugate) = conjugate else { continue };
            let share: f64 = conjugate.terms.iter().map(|&(j, w)| w * others_held[i][j as usize]).sum();
            let follows = share > 0.5;
            let candidate = held[i][node] == 0.0 && conjugate.gap.abs() <= reach;
            let row = rows[place];
            let contact_node = ContactNode { node, row, conjugate, follows };
            if candidate {
                rows[place] += 1;
                nodes.push(contact_node);
            } else if held[i][node] == 0.0 {
                beyond.push(contact_node);
            }
        }
        let other_body = plan.other_body(case, pair, side);
        contacts.sides.push(Side {
            pair,
            first: side == 0,
            body: place,
            observed: offsets[place]..offsets[place] + n,
            nodes,
            moduli: Both { own: own_modulus(body), other: own_modulus(other_body) },
        });
        contacts.beyond.push(beyond);
        offsets[place] += n;
    }
    Ok(contacts)
}

fn search_distance(contact: &ContactCase, own: &Surface, other: &Surface) -> f64 {
    match (contact.search_distance, &contact.gap) {
        (Some(distance), _) => distance,
        (None, crate::case::Gap::Value(_)) => f64::INFINITY,
        (None, crate::case::Gap::Geometry { .. }) => SEARCH * own.extent().min(other.extent()),
    }
}

/// Contact rows of one of this rank's bodies, in the order of their numbers.
fn contact_rows(contacts: &Contacts, body: usize) -> Vec<ContactRow> {
    let mut rows = Vec::new();
    for side in contacts.sides.iter().filter(|s| s.body == body) {
        rows.extend(side.nodes.iter().map(|node| ContactRow {
            observed: side.observed.start + node.node,
            normal: node.conjugate.normal,
        }));
    }
    rows
}

/// What a run by the paper's alternation works with.
pub(crate) struct Relaxed {
    pub bodies: Vec<Body>,
    pub compliances: Vec<Compliance>,
    pub contacts: Option<Contacts>,
    pub weights: Weights,
}

impl Relaxed {
    /// Assembles, factorises, pairs the surfaces. Collective.
    pub fn new(case: &Case, world: &SimpleCommunicator, weights: Weights) -> Result<(Plan, Relaxed)> {
        let Interface { plan, bodies, compliances, contacts } = Interface::new(case, world)?;
        Ok((plan, Relaxed { bodies, compliances, contacts, weights }))
    }

    /// Runs the alternation. The first ranks of the groups work, the others sleep. Collective.
    pub fn advance(
        &mut self,
        scene: &Scene,
        target: Target,
        progress: impl FnMut(&HistoryRow),
    ) -> Result<Advanced> {
        let Scene { case, plan, exchange } = *scene;
        let world = &plan.groups.world;
        let outcome = match &self.contacts {
            Some(contacts) if !case.contacts.is_empty() => {
                alternate(case, plan, &mut self.compliances, contacts, exchange, self.weights, progress)
            }
            _ => Ok((Found::none(), Vec::new())),
        };
        parallel::idle_barrier(world);
        let (mut found, rows) = agree(world, outcome)?;
        share_reason(world, &mut found.reason);
        found.tolerance = parallel::from_first(world, found.tolerance);
        found.refuse_penetration(world);
        let (mut bodies, mut forces) = (Vec::new(), Vec::new());
        let group = &plan.groups.group;
        let done = self.bodies.iter_mut().zip(plan.groups.bodies()).enumerate().try_for_each(
            |(i, (body, &index))| {
                let force = rows.get(i).map_or(&[][..], Vec::as_slice);
                let contact = spread(body, group, plan, index, self.compliances.get(i), force);
                let nodes = body.part.original[..body.part.n_owned].to_vec();
                bodies.push(BodyState { body: index, nodes, displacement: body.solve(group, &contact)? });
                forces.push(contact);
                Ok(())
            },
        );
        agree(world, done)?;
        let state = State { factors: target.factors, bodies, pairs: Vec::new() };
        Ok(Advanced { state, found, contact: forces })
    }
}

fn alternate(
    case: &Case,
    plan: &Plan,
    bodies: &mut [Compliance],
    contacts: &Contacts,
    exchange: &Exchange,
    weights: Weights,
    progress: impl FnMut(&HistoryRow),
) -> Result<(Found, Vec<Vec<f64>>)> {
    let settings = schwarz::Settings {
        weights,
        tolerance: match case.alternation.tolerance {
            Tolerance::Automatic => Tolerance::RELAXED,
            Tolerance::Fixed(tolerance) => tolerance,
        },
        max_alternations: case.alternation.max_alternations,
    };
    let n_bodies = bodies.len();
    let mut rows = vec![Vec::new(); n_bodies];
    let mut found = Found::none();
    let mut not_finite = |what: String| {
        found.reason = Reason::NotFinite;
        // All first ranks have agreed on it.
        found.diagnosis.extend((plan.groups.own == 0).then_some(what));
    };
    let mut alternation = match Alternation::new(bodies, &contacts.sides, exchange, settings) {
        Err(Error::NotFinite(what)) => {
            not_finite(what);
            return Ok((found, rows));
        }
        alternation => alternation?,
    };
    let outcome = match alternation.run(progress) {
        // The state is that before the answer.
        Err(Error::NotFinite(what)) => {
            not_finite(what);
            schwarz::Outcome { reason: Reason::NotFinite, history: Vec::new() }
        }
        outcome => outcome?,
    };
    for (i, (side, state)) in std::iter::zip(&contacts.sides, &alternation.states).enumerate() {
        let rows: &mut Vec<f64> = &mut rows[side.body];
        rows.extend(&state.force);
        found.ends.push(end_found(&plan.surfaces[i], side, state, &contacts.beyond[i]));
    }
    found.reason = outcome.reason;
    found.tolerance = settings.tolerance;
    // One more: without contact forces, to begin with.
    found.force_steps = outcome.history.len() as u64 + 1;
    found.displacement_steps = outcome.history.len() as u64;
    found.history = outcome.history;
    found.gap_threshold = alternation.gap_threshold;
    Ok((found, rows))
}

fn end_found(surface: &Surface, side: &Side, state: &SideState, beyond: &[ContactNode]) -> EndFound {
    let mut table = empty_table(surface);
    let mut complementarity = [0.0_f64; 2];
    let mut approach: f64 = 0.0;
    for (k, node) in side.nodes.iter().enumerate() {
        let i = node.node;
        table.normal[i] = node.conjugate.normal;
        table.gap[i] = state.gap[k];
        table.pressure[i] = state.force[k] / surface.weights[i];
        table.force[i] = node.conjugate.normal.map(|c| -state.force[k] * c);
        table.status[i] = if state.active[k] { 2 } else { 1 };
        let travel = dot(&node.conjugate.normal, &state.displacement[node.node]).abs();
        approach = larger(approach, (node.conjugate.gap - state.gap[k]).abs());
        complementarity[0] = larger(complementarity[0], (table.pressure[i] * state.gap[k]).abs());
        complementarity[1] =
            larger(larger(larger(complementarity[1], state.gap[k].abs()), node.conjugate.gap.abs()), travel);
    }
    let penetration = |node: &ContactNode| {
        let other = Side::vector_at_conjugate(node, &state.other_displacement);
        let approach = crate::contact::vector::sub(&state.displacement[node.node], &other);
        dot(&node.conjugate.normal, &approach) - node.conjugate.gap
    };
    let touching = std::iter::zip(&side.nodes, &state.active).filter(|(_, active)| **active);
    let whole = vec![Some([-1.0, 1.0]); surface.facets.len()];
    let touches: Vec<bool> = table.status.iter().map(|s| *s == 2).collect();
    EndFound {
        length: super::length::contact_length(surface, &whole, &table.pressure, &touches),
        pair: side.pair,
        side: usize::from(!side.first),
        counts: side.first,
        multiplier: side.first,
        normal_force: state.force.iter().sum(),
        active: state.active.iter().filter(|a| **a).count(),
        candidates: side.nodes.len(),
        unmatched: touching.filter(|(node, _)| node.conjugate.terms.len() > 1).count(),
        penetration: state.gap.iter().map(|g| -g).fold(0.0, larger),
        beyond: beyond.iter().map(penetration).fold(0.0, larger),
        complementarity,
        approach,
        overlap: side.nodes.iter().map(|node| -node.conjugate.gap).fold(0.0, larger),
        table: SideTable { multipliers: side.first, ..table },
    }
}

/// Contact forces of a body at this rank's owned nodes, N, from the group's first rank. Collective on the group.
fn spread(
    body: &Body,
    group: &SimpleCommunicator,
    plan: &Plan,
    index: usize,
    compliance: Option<&Compliance>,
    force: &[f64],
) -> Vec<f64> {
    let mut vectors = compliance.map_or_else(Vec::new, |c| c.forces(force).as_flattened().to_vec());
    parallel::broadcast(group, 0, &mut vectors);
    let (dim, first) = (body.dim(), body.part.first_owned);
    let mut owned = vec![0.0; body.part.n_owned * dim];
    let nodes = std::iter::zip(&plan.surfaces, &plan.ends).filter(|(_, end)| end.2 == index);
    for (node, f) in std::iter::zip(nodes.flat_map(|(s, _)| &s.nodes), vectors.chunks_exact(3)) {
        let global = body.numbering.new_of_old[*node as usize] as usize;
        if (first..first + body.part.n_owned).contains(&global) {
            (0..dim).for_each(|c| owned[(global - first) * dim + c] += f[c]);
        }
    }
    owned
}
