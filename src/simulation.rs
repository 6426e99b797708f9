//! A run, from the checked case to the files: builds everything, calls everything, computes nothing itself.
use crate::{
    body::{Balance, Body, Compliance, ContactRow, Fields, find_facets},
    case::{Case, ContactCase, Geometry},
    contact::{Pairing, Surface, vector::dot},
    error::{Error, Result},
    material::{LinearElastic, von_mises},
    mesh::{self, Locator, Mesh},
    output::{self, Field, HistoryRow, PairTables, Piece, Reason, ResultFile, RunInfo, SideTable, Summary},
    parallel::{self, Exchange, Groups, Partner, agree},
    petsc,
    schwarz::{self, Alternation, ContactNode, Side, weights::Both},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{path::Path, time::Instant};

/// What `kontakt check` reports, and what a run starts from: meshes checked, ranks dealt, bodies restrained.
pub struct Plan {
    /// Unknowns of each body.
    pub dofs: Vec<usize>,
    /// The communicators.
    pub groups: Groups,
    /// Meshes of this group's bodies.
    meshes: Vec<Mesh>,
    /// Contact surfaces of this group's bodies, in the order of `ends`.
    surfaces: Vec<Surface>,
    /// Per surface: pair, side (0: A), body index in the case.
    ends: Vec<(usize, usize, usize)>,
}

/// Builds a body's mesh.
pub fn build_mesh(geometry: &Geometry) -> Result<Mesh> {
    let (mesh, origin) = match geometry {
        Geometry::Gmsh { file, group, scale, origin } => {
            (mesh::read_gmsh(file, group.as_deref(), *scale), origin)
        }
        Geometry::Generated { shape, element, rotate, translate, origin } => {
            (mesh::generate(shape, *element, *rotate, *translate), origin)
        }
    };
    let mesh = mesh.map_err(|e| origin.error(e))?;
    mesh::check(&mesh).map_err(|e| origin.error(e))?;
    Ok(mesh)
}

impl Plan {
    /// Meshes the bodies, deals the ranks, finds the contact surfaces, and refuses what cannot be solved. Collective.
    pub fn new(case: &Case, world: &SimpleCommunicator) -> Result<Plan> {
        let (rank, size) = (world.rank() as usize, world.size() as usize);
        // Body b is meshed first by rank b mod P, only to know its size.
        let mut counts = vec![0.0; case.bodies.len()];
        let mut known: Vec<Option<Mesh>> = vec![None; case.bodies.len()];
        let sized = (rank..case.bodies.len()).step_by(size).try_for_each(|b| {
            let mesh = build_mesh(&case.bodies[b].geometry)?;
            counts[b] = (mesh.points.len() * mesh.dim) as f64;
            known[b] = Some(mesh);
            Ok(())
        });
        agree(world, sized)?;
        let dofs: Vec<usize> = parallel::sum(world, &counts).into_iter().map(|n| n as usize).collect();
        let groups = Groups::new(world, &dofs);
        let meshes = groups.bodies().iter().map(|&b| match known[b].take() {
            Some(mesh) => Ok(mesh),
            None => build_mesh(&case.bodies[b].geometry),
        });
        let meshes = agree(world, meshes.collect::<Result<Vec<Mesh>>>())?;
        let mut plan = Plan { dofs, groups, meshes, surfaces: Vec::new(), ends: Vec::new() };
        let found = plan.find_surfaces(case);
        agree(world, found)?;
        let restrained = plan.refuse_free_bodies(case);
        agree(world, restrained)?;
        Ok(plan)
    }

    fn find_surfaces(&mut self, case: &Case) -> Result<()> {
        for (p, contact) in case.contacts.iter().enumerate() {
            for (side, name) in contact.surfaces.iter().enumerate() {
                let Some(i) = self.groups.bodies().iter().position(|&b| b == name.body) else { continue };
                let body = &case.bodies[name.body].name;
                let facets =
                    find_facets(&self.meshes[i], body, &name.surface, name.within.as_ref(), &contact.origin)?;
                self.surfaces.push(Surface::new(&self.meshes[i], &facets, case.analysis.thickness()));
                self.ends.push((p, side, name.body));
            }
        }
        Ok(())
    }

    fn refuse_free_bodies(&self, case: &Case) -> Result<()> {
        for (&b, mesh) in std::iter::zip(self.groups.bodies(), &self.meshes) {
            let body = &case.bodies[b];
            let constraints = crate::body::Constraints::new(body, mesh)?;
            let free = crate::body::free_motions(mesh, &constraints);
            if !free.is_empty() {
                let held = if case.contacts.iter().any(|c| c.surfaces.iter().any(|s| s.body == b)) {
                    "is held by nothing but contact, which this version cannot solve"
                } else {
                    "is not held by its supports"
                };
                return Err(Error::Unrestrained(format!(
                    "{}: body '{}' {held}: free motion: {}; add a [[body.support]] that prevents it",
                    body.origin,
                    body.name,
                    free.join(", ")
                )));
            }
        }
        Ok(())
    }

    /// Number of nodes of each pair's surfaces, over all ranks: what may touch. Collective.
    pub fn contact_nodes(&self, case: &Case) -> Vec<[usize; 2]> {
        let mut counts = vec![0.0; 2 * case.contacts.len()];
        if self.groups.is_root() {
            for (surface, &(pair, side, _)) in std::iter::zip(&self.surfaces, &self.ends) {
                counts[2 * pair + side] = surface.nodes.len() as f64;
            }
        }
        let all = parallel::sum(&self.groups.world, &counts);
        all.chunks_exact(2).map(|c| [c[0] as usize, c[1] as usize]).collect()
    }

    /// Mesh nodes of all contact surfaces of a body of this group, surface by surface.
    fn observed(&self, body: usize) -> Vec<u32> {
        let own = std::iter::zip(&self.surfaces, &self.ends).filter(|(_, end)| end.2 == body);
        own.flat_map(|(surface, _)| surface.nodes.iter().copied()).collect()
    }

    /// The exchange between this rank's surfaces and their partners'.
    pub fn exchange(&self, case: &Case) -> Exchange<'_> {
        Exchange { comm: self.groups.roots.as_ref(), partners: self.partners(case) }
    }

    /// Partners of this rank's surfaces.
    fn partners(&self, case: &Case) -> Vec<Partner> {
        self.ends
            .iter()
            .map(|&(pair, side, _)| {
                let other = case.contacts[pair].surfaces[1 - side].body;
                let group = self.groups.group_of(other);
                if group == self.groups.own {
                    let here = self.ends.iter().position(|e| (e.0, e.1) == (pair, 1 - side));
                    Partner::Here(here.expect("both sides are on this rank"))
                } else {
                    Partner::Remote { rank: group as i32, pair }
                }
            })
            .collect()
    }
}

/// Default search distance as a share of the smaller surface's extent.
const SEARCH: f64 = 0.1;

/// A contact node whose free directions carry less than this share of the normal is held by its support.
const HELD: f64 = 0.1;

/// Pairs and sides as the first rank of a group holds them.
struct Contacts {
    sides: Vec<Side>,
    /// Per side: nodes that have a conjugate point but are no candidates: they must not come to penetrate.
    beyond: Vec<Vec<ContactNode>>,
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
    contacts: Option<Contacts>,
    /// Wall seconds up to the paired surfaces.
    pairing_seconds: f64,
}

impl Interface {
    /// Builds it. Collective.
    pub fn new(case: &Case, world: &SimpleCommunicator) -> Result<Interface> {
        let start = Instant::now();
        let plan = Plan::new(case, world)?;
        let groups = &plan.groups;
        // Both groups of a pair hold both surfaces.
        let exchange = plan.exchange(case);
        let contacts = if groups.is_root() { pair_up(case, &plan, &exchange).map(Some) } else { Ok(None) };
        let contacts = agree(world, contacts)?;
        let pairing_seconds = start.elapsed().as_secs_f64();
        let observed: Vec<Vec<u32>> = groups.bodies().iter().map(|&b| plan.observed(b)).collect();
        let (mut bodies, mut free) = (Vec::new(), Vec::new());
        let built = groups.bodies().iter().enumerate().try_for_each(|(i, &b)| {
            if let Some(options) = &case.bodies[b].solver {
                petsc::set_options(&prefixed(options, &case.bodies[b].name))?;
            }
            let mut body = Body::new(&case.bodies[b], case.analysis, &plan.meshes[i], &groups.group)?;
            let solving = Instant::now();
            free.push(Compliance::free_displacements(&mut body, &groups.group, &observed[i])?);
            body.cost.factor += solving.elapsed().as_secs_f64();
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
            let solving = Instant::now();
            let rows = contacts.as_ref().map_or_else(Vec::new, |c| contact_rows(c, i));
            let free = std::mem::take(&mut free[i]);
            compliances.extend(Compliance::new(body, &groups.group, &observed[i], free, rows)?);
            body.cost.factor += solving.elapsed().as_secs_f64();
            Ok(())
        });
        agree(world, condensed)?;
        drop(exchange);
        Ok(Interface { plan, bodies, compliances, contacts, pairing_seconds })
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
        let closing = closing.map(|(i, node)| approach(i, node)).fold(0.0, f64::max);
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

/// Runs a case and writes its results. Returns the summary (complete on world rank 0). Collective.
pub fn run(
    case: &Case,
    world: &SimpleCommunicator,
    directory: &Path,
    mut progress: impl FnMut(&HistoryRow),
) -> Result<Summary> {
    let start = Instant::now();
    output::prepare(world, directory)?;
    let Interface { plan, mut bodies, mut compliances, contacts, pairing_seconds } =
        Interface::new(case, world)?;
    let groups = &plan.groups;
    let exchange = plan.exchange(case);
    let mut seconds = [0.0; 6];
    seconds[0] = pairing_seconds;
    (seconds[1], seconds[2]) =
        bodies.iter().fold((0.0, 0.0), |s, b| (s.0 + b.cost.assemble, s.1 + b.cost.factor));

    // The alternation, on the first ranks of the groups; the others sleep.
    let alternating = Instant::now();
    let mut found = match &contacts {
        Some(contacts) if !case.contacts.is_empty() => {
            alternate(case, &mut compliances, contacts, &exchange, |row| {
                if world.rank() == 0 {
                    progress(row);
                }
            })
        }
        _ => Ok(Found::none()),
    };
    parallel::idle_barrier(world);
    found = agree(world, found);
    let mut found = found?;
    seconds[3] = alternating.elapsed().as_secs_f64();

    // Interiors, stresses, balance.
    let mut piece = Piece::default();
    let heated = case.bodies.iter().any(|b| b.temperature.is_some());
    start_fields(&mut piece, heated);
    let mut balances = Vec::new();
    let mut recovered = Vec::new();
    let finished = bodies.iter_mut().enumerate().try_for_each(|(i, body)| {
        let compliance = compliances.get(i);
        let force = found.rows.get(i).map_or(&[][..], Vec::as_slice);
        let contact = spread(body, &groups.group, &plan, groups.bodies()[i], compliance, force);
        let owned = body.solve(&groups.group, &contact)?;
        let u = body.with_ghosts(&groups.group, &owned)?;
        let (fields, balance) = body.recover(&u, &contact)?;
        append(&mut piece, body, &fields, groups.bodies()[i], heated);
        balances.push(total(&groups.group, &balance));
        recovered.push(fields);
        Ok(())
    });
    agree(world, finished)?;
    let probes = probe(case, &plan, &bodies, &recovered, world)?;

    // The verdict and the files.
    let writing = Instant::now();
    let mut warnings = Vec::new();
    let (pairs, tables, beyond) = pair_results(case, &plan, &contacts, &found, world, &mut warnings);
    if found.reason.converged() && beyond {
        found.reason = Reason::Penetration;
    }
    let checks = checks(&balances, &pairs, &tables, world);
    let header = share_outcome(world, found.reason, &found.history);
    let info = RunInfo {
        case: case.name.clone(),
        title: case.title.clone(),
        variant: case.variant.clone(),
        text: case.text.clone(),
        units: case.units,
        analysis: case.analysis,
        bodies: case.bodies.iter().map(|b| b.name.clone()).collect(),
        reason: header.0,
        alternations: header.1,
        tolerance: case.alternation.tolerance,
    };
    let file = directory.join(output::RESULT);
    let result = ResultFile { piece: &piece, pairs: &tables, history: &found.history, run: &info };
    remove_old_summary(world, directory)?;
    output::write(world, &file, &result)?;
    let drawn = if world.rank() == 0 { draw(case, &file, directory) } else { Ok(()) };
    agree(world, drawn)?;
    seconds[4] = writing.elapsed().as_secs_f64();
    seconds[5] = start.elapsed().as_secs_f64();
    let seconds = parallel::max(world, &seconds);
    let summary = Summary {
        schema: Summary::SCHEMA,
        kontakt: env!("CARGO_PKG_VERSION").into(),
        case: case.name.clone(),
        variant: case.variant.clone(),
        converged: info.converged(),
        reason: info.reason,
        alternations: info.alternations,
        tolerance: case.alternation.tolerance,
        residual: checks.residual,
        ranks: world.size() as usize,
        bodies: body_summaries(case, &plan, &bodies, &compliances, world),
        pairs,
        probes,
        checks,
        seconds: output::Seconds {
            setup: seconds[0],
            assemble: seconds[1],
            factor: seconds[2],
            alternate: seconds[3],
            write: seconds[4],
            total: seconds[5],
        },
        peak_memory_mb: parallel::sum(world, &[peak_memory_mb()])[0],
        warnings,
    };
    let written = if world.rank() == 0 { summary.write(&directory.join(output::SUMMARY)) } else { Ok(()) };
    agree(world, written)?;
    Ok(summary)
}

/// Conjugate points and candidates of every pair this rank shares. Collective on the roots.
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
        let other_body = case.contacts[pair].surfaces[1 - side].body;
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

/// What the alternation found, on the first rank of a group; empty elsewhere.
struct Found {
    reason: Reason,
    history: Vec<HistoryRow>,
    states: Vec<schwarz::alternation::SideState>,
    /// Per body, per row: compressive normal force, N.
    rows: Vec<Vec<f64>>,
    gap_threshold: f64,
}

impl Found {
    fn none() -> Found {
        let reason = Reason::NoContact;
        Found { reason, history: Vec::new(), states: Vec::new(), rows: Vec::new(), gap_threshold: 0.0 }
    }
}

fn alternate(
    case: &Case,
    bodies: &mut [Compliance],
    contacts: &Contacts,
    exchange: &Exchange,
    progress: impl FnMut(&HistoryRow),
) -> Result<Found> {
    let settings = schwarz::Settings {
        weights: case.alternation.weights,
        tolerance: case.alternation.tolerance,
        max_alternations: case.alternation.max_alternations,
    };
    let n_bodies = bodies.len();
    let mut alternation = Alternation::new(bodies, &contacts.sides, exchange, settings)?;
    let outcome = alternation.run(progress)?;
    let mut rows = vec![Vec::new(); n_bodies];
    for (side, state) in std::iter::zip(&contacts.sides, &alternation.states) {
        let rows: &mut Vec<f64> = &mut rows[side.body];
        rows.extend(&state.force);
    }
    Ok(Found {
        reason: outcome.reason,
        history: outcome.history,
        gap_threshold: alternation.gap_threshold,
        states: alternation.states,
        rows,
    })
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

fn start_fields(piece: &mut Piece, heated: bool) {
    let field =
        |name: &str, unit, components| Field { name: name.into(), unit, components, values: Vec::new() };
    piece.point_fields = vec![
        field("displacement", "m", 3),
        field("stress", "Pa", 6),
        field("strain", "-", 6),
        field("von_mises", "Pa", 1),
    ];
    if heated {
        piece.point_fields.push(field("temperature", "K", 1));
    }
    piece.cell_fields = vec![field("stress", "Pa", 6), field("strain", "-", 6), field("von_mises", "Pa", 1)];
}

/// Adds a body's own cells and local nodes to this rank's piece.
fn append(piece: &mut Piece, body: &Body, fields: &Fields, index: usize, heated: bool) {
    let first = piece.points.len() as u32;
    piece.points.extend(&body.part.points[..body.part.n_local]);
    for cell in &body.part.cells[..body.part.n_own_cells] {
        let nodes: Vec<u32> = cell.nodes().iter().map(|n| n + first).collect();
        piece.cells.push(mesh::Cell::new(cell.kind, &nodes));
        piece.cell_bodies.push(index as i32);
    }
    let mises = |stress: &[[f64; 6]]| stress.iter().map(|s| von_mises(*s)).collect::<Vec<_>>();
    let points = &mut piece.point_fields;
    points[0].values.extend(fields.displacement.as_flattened());
    points[1].values.extend(fields.stress.as_flattened());
    points[2].values.extend(fields.strain.as_flattened());
    points[3].values.extend(mises(&fields.stress));
    if heated {
        match &fields.temperature {
            Some(t) => points[4].values.extend(t),
            None => points[4].values.extend(std::iter::repeat_n(f64::NAN, body.part.n_local)),
        }
    }
    piece.cell_fields[0].values.extend(fields.cell_stress.as_flattened());
    piece.cell_fields[1].values.extend(fields.cell_strain.as_flattened());
    piece.cell_fields[2].values.extend(mises(&fields.cell_stress));
}

/// Sum of a balance over the group.
fn total(group: &SimpleCommunicator, b: &Balance) -> Balance {
    let parts = [&b.residual2[..], &b.resultant, &[b.moment], &b.scale, &b.work, &b.reaction].concat();
    let s = parallel::sum(group, &parts);
    Balance {
        residual2: [s[0], s[1]],
        resultant: [s[2], s[3], s[4]],
        moment: s[5],
        scale: [s[6], s[7]],
        work: [s[8], s[9], s[10]],
        reaction: [s[11], s[12], s[13]],
    }
}

/// Values at the probes. Collective.
fn probe(
    case: &Case,
    plan: &Plan,
    bodies: &[Body],
    fields: &[Fields],
    world: &SimpleCommunicator,
) -> Result<Vec<output::ProbeSummary>> {
    let mut out = Vec::new();
    for probe in &case.probes {
        // found, displacement, stress, temperature; from the one rank that owns the cell
        let mut values = [0.0; 9];
        let mut missing = Ok(());
        if let Some(i) = plan.groups.bodies().iter().position(|&b| b == probe.body) {
            let mesh = &plan.meshes[i];
            match Locator::new(&mesh.points, &mesh.cells).find(&probe.at) {
                None => {
                    let body = &case.bodies[probe.body].name;
                    missing = Err(probe.origin.error(format!("the point is not in body '{body}'")));
                }
                Some((cell, xi)) => {
                    let part = &bodies[i].part;
                    let own = &part.original_cells[..part.n_own_cells];
                    if let Some(local) = own.iter().position(|&c| c as usize == cell) {
                        values = interpolate(part, &fields[i], local, &xi);
                    }
                }
            }
        }
        agree(world, missing)?;
        let v = parallel::sum(world, &values);
        let heated = case.bodies[probe.body].temperature.is_some();
        out.push(output::ProbeSummary {
            name: probe.name.clone(),
            body: case.bodies[probe.body].name.clone(),
            x: probe.at[..2].to_vec(),
            displacement: v[1..3].to_vec(),
            stress: output::StressSummary { xx: v[4], yy: v[5], zz: v[6], xy: v[7] },
            temperature: heated.then_some(v[8]),
        });
    }
    Ok(out)
}

fn interpolate(part: &mesh::MeshPart, fields: &Fields, cell: usize, xi: &[f64; 3]) -> [f64; 9] {
    let cell = &part.cells[cell];
    let shape = cell.kind.shape(xi);
    let mut v = [0.0; 9];
    v[0] = 1.0;
    for (&node, n) in std::iter::zip(cell.nodes(), shape.n) {
        let node = node as usize;
        (0..3).for_each(|c| v[1 + c] += n * fields.displacement[node][c]);
        (0..4).for_each(|c| v[4 + c] += n * fields.stress[node][c]);
        v[8] += n * fields.temperature.as_ref().map_or(0.0, |t| t[node]);
    }
    v
}

/// Summaries and tables of the pairs, and whether a node beyond the search distance penetrates. Collective.
fn pair_results(
    case: &Case,
    plan: &Plan,
    contacts: &Option<Contacts>,
    found: &Found,
    world: &SimpleCommunicator,
    warnings: &mut Vec<String>,
) -> (Vec<output::PairSummary>, Vec<PairTables>, bool) {
    let names = |contact: &ContactCase| {
        [0, 1].map(|s| {
            format!("{}.{}", case.bodies[contact.surfaces[s].body].name, contact.surfaces[s].surface)
        })
    };
    let mut tables: Vec<PairTables> = case
        .contacts
        .iter()
        .map(|c| PairTables { name: c.name.clone(), surfaces: names(c), sides: [None, None] })
        .collect();
    // Per pair: sums over the ranks of what each side contributes, and maxima.
    let mut sums = vec![[0.0; 12]; case.contacts.len()];
    let mut maxima = vec![[0.0_f64; 5]; case.contacts.len()];
    if let Some(contacts) = contacts {
        for (i, (side, state)) in std::iter::zip(&contacts.sides, &found.states).enumerate() {
            let surface = &plan.surfaces[i];
            let table = side_table(surface, side, state);
            let sum = &mut sums[side.pair];
            let max = &mut maxima[side.pair];
            let column = usize::from(!side.first);
            for f in &table.force {
                (0..3).for_each(|c| sum[3 * column + c] += f[c]);
            }
            if side.first {
                sum[6] += state.force.iter().sum::<f64>();
                sum[7] = contact_length(&table);
            }
            sum[8] += state.active.iter().filter(|a| **a).count() as f64;
            sum[9] += side.nodes.len() as f64;
            let touching = std::iter::zip(&side.nodes, &state.active).filter(|(_, active)| **active);
            let unmatched = touching.filter(|(node, _)| node.conjugate.terms.len() > 1).count();
            sum[10] += unmatched as f64;
            max[0] = table.pressure.iter().copied().fold(max[0], f64::max);
            max[1] = state.gap.iter().map(|g| -g).fold(max[1], f64::max);
            for (k, node) in side.nodes.iter().enumerate() {
                let pressure = state.force[k] / surface.weights[node.node];
                let travel = dot(&node.conjugate.normal, &state.displacement[node.node]).abs();
                max[3] = max[3].max((pressure * state.gap[k]).abs());
                max[4] = max[4].max(state.gap[k].abs()).max(node.conjugate.gap.abs()).max(travel);
            }
            for node in &contacts.beyond[i] {
                let other = Side::vector_at_conjugate(node, &state.other_displacement);
                let approach = crate::contact::vector::sub(&state.displacement[node.node], &other);
                max[2] = max[2].max(dot(&node.conjugate.normal, &approach) - node.conjugate.gap);
            }
            tables[side.pair].sides[column] = Some(table);
        }
    }
    let sums = parallel::sum(world, sums.as_flattened());
    let maxima = parallel::max(world, maxima.as_flattened());
    let threshold = parallel::max(world, &[found.gap_threshold])[0];
    let mut beyond = false;
    let pairs = case
        .contacts
        .iter()
        .enumerate()
        .map(|(p, contact)| {
            let (s, m) = (&sums[12 * p..12 * p + 12], &maxima[5 * p..5 * p + 5]);
            beyond |= m[2] > threshold;
            let size = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
            let together: Vec<f64> = (0..3).map(|c| s[c] + s[3 + c]).collect();
            let scale = size(&s[..3]) + size(&s[3..6]);
            let force_imbalance = if scale > 0.0 { size(&together) / scale } else { 0.0 };
            if s[10] > 0.0 {
                warnings.push(format!(
                    "contact '{}': the nodes of the two surfaces do not match; the pointwise transfer of nodal forces is \
                     wrong there (force imbalance {force_imbalance:.2e}): match the meshes at the interface",
                    contact.name
                ));
            }
            output::PairSummary {
                name: contact.name.clone(),
                normal_force: s[6],
                resultant: s[..2].to_vec(),
                max_pressure: m[0],
                contact_length: s[7],
                max_penetration: m[1],
                force_imbalance,
                complementarity: if m[0] * m[4] > 0.0 { m[3] / (m[0] * m[4]) } else { 0.0 },
                active: s[8] as u64,
                candidates: s[9] as u64,
            }
        })
        .collect();
    (pairs, tables, beyond)
}

fn side_table(surface: &Surface, side: &Side, state: &schwarz::alternation::SideState) -> SideTable {
    let n = surface.nodes.len();
    let mut table = SideTable {
        s: surface.s.clone(),
        x: surface.points.clone(),
        normal: surface.normals.clone(),
        gap: vec![f64::NAN; n],
        pressure: vec![0.0; n],
        force: vec![[0.0; 3]; n],
        status: vec![0; n],
    };
    for (k, node) in side.nodes.iter().enumerate() {
        let i = node.node;
        table.normal[i] = node.conjugate.normal;
        table.gap[i] = state.gap[k];
        table.pressure[i] = state.force[k] / surface.weights[i];
        table.force[i] = node.conjugate.normal.map(|c| -state.force[k] * c);
        table.status[i] = if state.active[k] { 2 } else { 1 };
    }
    table
}

/// Length in contact, m: between the zeros of the pressure. At a smooth edge p^2 is linear in the distance from the
/// edge, so the zero is extrapolated from the last two nodes in contact; it lies between the last node in contact
/// and the first open one.
fn contact_length(table: &SideTable) -> f64 {
    let (s, p) = (&table.s, &table.pressure);
    let touches = |i: usize| table.status[i] == 2;
    let edge = |inside: usize, next: usize, open: Option<usize>| {
        let Some(open) = open else { return 0.0 };
        let (p0, p1) = (p[inside].powi(2), p[next].powi(2));
        let room = (s[open] - s[inside]).abs();
        let step = (s[inside] - s[next]).abs();
        if p1 > p0 { (step * p0 / (p1 - p0)).min(room) } else { room }
    };
    let mut length = 0.0;
    let mut start = None;
    for i in 0..=s.len() {
        match start {
            None if i < s.len() && touches(i) => start = Some(i),
            Some(first) if i == s.len() || !touches(i) => {
                let last = i - 1;
                length += s[last] - s[first];
                if last > first {
                    length += edge(first, first + 1, first.checked_sub(1));
                    length += edge(last, last - 1, (i < s.len()).then_some(i));
                }
                start = None;
            }
            _ => {}
        }
    }
    length
}

/// The invariants of the run, each relative to its own scale. Collective.
fn checks(
    balances: &[Balance],
    pairs: &[output::PairSummary],
    tables: &[PairTables],
    world: &SimpleCommunicator,
) -> output::Checks {
    let ratio = |value: f64, scale: f64| if scale > 0.0 { value / scale } else { 0.0 };
    let mut worst = [0.0_f64; 4];
    for b in balances {
        worst[0] = worst[0].max(ratio(b.residual2[0].sqrt(), b.residual2[1].sqrt()));
        let resultant = b.resultant.iter().map(|c| c * c).sum::<f64>().sqrt();
        worst[1] = worst[1].max(ratio(resultant, b.scale[0])).max(ratio(b.moment.abs(), b.scale[1]));
        worst[2] = worst[2].max(ratio((b.work[0] - b.work[1]).abs(), b.work[2].max(b.work[0].abs())));
    }
    for side in tables.iter().flat_map(|t| t.sides.iter().flatten()) {
        let largest = side.pressure.iter().copied().fold(0.0, f64::max);
        let lowest = side.pressure.iter().copied().fold(0.0, f64::min);
        worst[3] = worst[3].max(ratio(-lowest, largest));
    }
    let worst = parallel::max(world, &worst);
    output::Checks {
        residual: worst[0],
        equilibrium: worst[1],
        virtual_work: worst[2],
        tension: worst[3],
        complementarity: pairs.iter().map(|p| p.complementarity).fold(0.0, f64::max),
        action_reaction: pairs.iter().map(|p| p.force_imbalance).fold(0.0, f64::max),
        penetration: pairs.iter().map(|p| p.max_penetration).fold(0.0, f64::max),
    }
}

/// Rank 0's verdict and number of alternations, known to all. Rank 0 is always a group's first rank. Collective.
fn share_outcome(world: &SimpleCommunicator, reason: Reason, history: &[HistoryRow]) -> (Reason, u64) {
    let root = world.process_at_rank(0);
    let mut code = Reason::ALL.iter().position(|r| *r == reason).unwrap_or(0) as u64;
    let mut alternations = history.len() as u64;
    root.broadcast_into(&mut code);
    root.broadcast_into(&mut alternations);
    (Reason::ALL[code as usize], alternations)
}

fn body_summaries(
    case: &Case,
    plan: &Plan,
    bodies: &[Body],
    compliances: &[Compliance],
    world: &SimpleCommunicator,
) -> Vec<output::BodySummary> {
    let mut counts = vec![[0.0; 2]; case.bodies.len()];
    for (i, &b) in plan.groups.bodies().iter().enumerate() {
        if plan.groups.is_root() {
            counts[b] = [bodies[i].cost.factorisations as f64, compliances[i].factorisations as f64];
        }
    }
    let counts = parallel::sum(world, counts.as_flattened());
    case.bodies
        .iter()
        .enumerate()
        .map(|(b, body)| output::BodySummary {
            name: body.name.clone(),
            dofs: plan.dofs[b] as u64,
            ranks: plan.groups.shares[plan.groups.group_of(b)].ranks.len(),
            factorisations: counts[2 * b] as u64,
            interface_factorisations: counts[2 * b + 1] as u64,
        })
        .collect()
}

/// The old summary goes first: a run killed from here on leaves nothing that looks complete.
fn remove_old_summary(world: &SimpleCommunicator, directory: &Path) -> Result<()> {
    let path = directory.join(output::SUMMARY);
    let removed = if world.rank() == 0 && path.exists() {
        std::fs::remove_file(&path)
            .map_err(|e| Error::input(format!("cannot replace {}: {e}", path.display())))
    } else {
        Ok(())
    };
    agree(world, removed)
}

fn draw(case: &Case, file: &Path, directory: &Path) -> Result<()> {
    let results = output::Results::read(file)?;
    output::draw(&results, &case.output, directory).map(|_| ())
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

/// Peak resident memory of this process, MB; 0 where the system does not tell.
fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok()).map_or(0.0, |kb| kb / 1024.0)
}
