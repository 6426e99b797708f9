//! What a run would do and cost, before it is done.
use super::paths::path_lines;
use crate::{
    body::{Constraints, condense_estimate, free_motions, largest_zone, zone_estimate, zone_whole},
    case::{Case, Driver, ResponseCase, ZoneCase},
    element::ElementKind,
    error::Result,
    parallel::{self, agree},
    vector::worst,
};
use crate::{
    scene::Plan,
    step::{Contacts, gather_lines},
};
use mpi::traits::*;

/// Lines on bodies and contacts: unknowns, ranks, effects, what supports leave free, and how each body would answer contact
/// at which cost. Finds the contact rows, but assembles and solves nothing. Collective; the lines are on every rank.
pub fn outlook(case: &Case, plan: &Plan) -> Result<Vec<String>> {
    let groups = &plan.groups;
    let exchange = plan.exchange(case);
    let contacts = match groups.is_root() {
        true => Contacts::new(case, plan, &exchange).map(Some),
        false => Ok(None),
    };
    let contacts = agree(&groups.world, contacts)?;
    let described = if groups.is_root() { bodies(case, plan, contacts.as_ref()) } else { Ok(Vec::new()) };
    let mut lines = agree(&groups.world, described)?;
    if let Some(contacts) = &contacts {
        lines.extend(contacts.outlook(case));
        lines.extend(contacts.overlaps(case, plan).into_iter().map(|line| format!("warning: {line}")));
    }
    let mut lines = gather_lines(&groups.world, &lines);
    // Bodies before contacts, each in the order of the ranks.
    lines.sort_by_key(|line| !line.starts_with("body"));
    lines.extend(path_lines(case));
    lines.extend(costs(case, plan));
    Ok(lines)
}

/// What a process takes before it has a mesh, bytes: MPI, PETSc, MUMPS, BLAS and HDF5.
const PROCESS: f64 = 69e6;

/// Memory of a body of n unknowns at the peak of a run, bytes: a share of n (mesh, matrix, fields) and one of n log2 n (the
/// factor by nested dissection with MUMPS' working space). Fitted to 12 runs with quad4, tri3 and tri6 of 27 thousand to 1.2
/// million unknowns, two bodies each, which it meets within 10 %.
const PER_DOF: f64 = 250.0;
const PER_DOF_LOG: f64 = 105.0;

/// A quad8's rows have nearly twice the entries of the others; the share of n log2 n, and the time, were as many times theirs.
const QUAD8: f64 = 1.3;

/// Ranks that share a body hold parts of its front and its halo twice.
const SHARED: f64 = 1.25;

/// Seconds of a run on one core of about 3 GHz: at its start and end; per unknown, and per unknown and step (stresses, estimate,
/// file); factorisation per n and n^1.5. From the stages of the same runs.
const SECONDS: f64 = 0.1;
const PER_DOF_SECONDS: f64 = 1.2e-6;
const PER_DOF_STEP_SECONDS: f64 = 2.6e-6;
const FACTOR_SECONDS: f64 = 4.0e-6;
const FACTOR_SECONDS_15: f64 = 6.0e-9;

/// Of a body that yields: bytes of its quadrature points, and iterations of an increment.
const PER_DOF_POINTS: f64 = 1000.0;
const ITERATIONS: f64 = 5.0;

/// Bytes of the result file: of a point (coordinates), of a cell beside its nodes (type, offset, body), of the fields of a step at
/// a point (displacement, stress, strain, von Mises; with friction traction, slip, status) and in a cell (stress, strain, von Mises, error), and of the pictures.
const POINT: f64 = 24.0;
const CELL: f64 = 13.0;
const POINT_FIELDS: f64 = 128.0;
const FRICTION_FIELDS: f64 = 56.0;
const CELL_FIELDS: f64 = 112.0;
const PICTURES: f64 = 2e5;

/// Memory, time and size of the results of a run whose bodies are factorised, as a line. Collective.
fn costs(case: &Case, plan: &Plan) -> Option<String> {
    let groups = &plan.groups;
    let steps = case.steps.len().max(1) as f64;
    let increments = case.steps.iter().map(|step| step.increments.least()).sum::<usize>().max(1) as f64;
    let heated = case.bodies.iter().any(|b| b.temperature.is_some());
    let rubs = if case.has_friction() { FRICTION_FIELDS } else { 0.0 };
    let point_fields = POINT_FIELDS + rubs + if heated { 8.0 } else { 0.0 };
    // By body: the factor of its elements, bytes of its grid and of its fields after a step.
    let mut of_bodies = vec![[0.0; 3]; case.bodies.len()];
    for (&b, mesh) in std::iter::zip(groups.bodies(), &plan.meshes) {
        let quad8 = mesh.cells.iter().any(|cell| cell.kind == ElementKind::Quad8);
        let nodes: usize = mesh.cells.iter().map(|cell| cell.nodes().len()).sum();
        let (points, cells) = (mesh.points.len() as f64, mesh.cells.len() as f64);
        let grid = POINT * points + CELL * cells + 8.0 * nodes as f64;
        of_bodies[b] = [if quad8 { QUAD8 } else { 1.0 }, grid, point_fields * points + CELL_FIELDS * cells];
    }
    let all = parallel::max(&groups.world, of_bodies.as_flattened());
    let mut memory = vec![PROCESS; groups.shares.len()];
    let mut seconds = vec![SECONDS; groups.shares.len()];
    for (b, [factor, ..]) in all.as_chunks::<3>().0.iter().enumerate() {
        let (points, iterations) = match case.bodies[b].yields() {
            true => (PER_DOF_POINTS, 1.0 + ITERATIONS * increments),
            false => (0.0, 1.0),
        };
        let (group, n) = (groups.group_of(b), plan.dofs[b].max(2) as f64);
        let ranks = groups.shares[group].ranks.len() as f64;
        let bytes = (PER_DOF + points) * n + factor * PER_DOF_LOG * n * n.log2();
        memory[group] += bytes / ranks * if ranks > 1.0 { SHARED } else { 1.0 };
        let factorise = factor * (FACTOR_SECONDS * n + FACTOR_SECONDS_15 * n.powf(1.5));
        seconds[group] += iterations * factorise / ranks
            + n * (PER_DOF_SECONDS + iterations.max(increments) * PER_DOF_STEP_SECONDS) / ranks;
    }
    let whole: f64 = std::iter::zip(&memory, &groups.shares).map(|(m, s)| m * s.ranks.len() as f64).sum();
    let size: f64 =
        all.as_chunks::<3>().0.iter().map(|[_, grid, fields]| grid + steps * fields).sum::<f64>() + PICTURES;
    // As the system and `peak_memory_mb` count.
    const MB: f64 = 1024.0 * 1024.0;
    let any_own = case.bodies.iter().any(|b| b.solver.is_some());
    let solver = if any_own { ", were all bodies factorised" } else { "" };
    (groups.world.rank() == 0).then(|| {
        format!(
            "a run takes about {:.0} MB in all ({:.0} MB on the rank with most), {:.2} s on cores of 3 GHz, and {:.1} MB of results{solver}",
            whole / MB,
            worst(memory.iter().copied()) / MB,
            worst(seconds.iter().copied()),
            size / 1e6
        )
    })
}

fn bodies(case: &Case, plan: &Plan, contacts: Option<&Contacts>) -> Result<Vec<String>> {
    let mut lines = Vec::new();
    for (i, &b) in plan.groups.bodies().iter().enumerate() {
        let (body, mesh, dofs) = (&case.bodies[b], &plan.meshes[i], plan.dofs[b]);
        let ranks = plan.groups.shares[plan.groups.own].ranks.len();
        let heat = if body.temperature.is_some() { ", thermal strain" } else { "" };
        let mut line = format!("body {}: {dofs} dofs on {ranks} rank(s){heat}", body.name);
        let interface = contacts.map_or(0, |c| c.interface_nodes(i)) * mesh.dim;
        let mut is_condensed = false;
        if interface > 0 {
            let estimate = condense_estimate(dofs, interface, mesh.dim);
            // A solver of the user's choice is used.
            let own = body.solver.as_ref().is_some_and(|s| s.contains("-ksp_type") || s.contains("-pc_type"));
            let chosen = match body.response {
                _ if matches!(case.alternation.driver, Driver::Relaxed(_)) => "condensed",
                ResponseCase::Automatic if estimate.prefers_condensed() && !own => "condensed",
                ResponseCase::Automatic | ResponseCase::Solver => "by its solver",
                ResponseCase::Condensed => "condensed",
            };
            is_condensed = chosen == "condensed";
            line += &format!(
                "; {interface} of them on the interface, answers {chosen} (estimate: condensed {:.2} Gflop and {:.0} MB, by its \
                 solver {:.2} Gflop)",
                estimate.condensed / 1e9,
                (estimate.bytes + estimate.factor_bytes) / 1e6,
                estimate.solver / 1e9
            );
        }
        if body.yields() && is_condensed && ranks == 1 {
            line += &zone_line(case.plasticity.zone, dofs, interface, mesh.dim);
        }
        let free = free_motions(mesh, &Constraints::new(body, mesh)?);
        if !free.is_empty() {
            line += &format!("; supports leave free: {}", free.join(", "));
        }
        lines.push(line);
    }
    Ok(lines)
}

/// What iterations factorise of a body that yields.
fn zone_line(zone: ZoneCase, dofs: usize, interface: usize, dim: usize) -> String {
    let largest = match zone {
        ZoneCase::Never => 0.0,
        ZoneCase::Always => 1.0,
        ZoneCase::Automatic => largest_zone(dofs, interface, dim),
    };
    if largest == 0.0 {
        return "; if it yields, iterations factorise all of it".into();
    }
    const EXAMPLE: f64 = 0.1;
    format!(
        "; if it yields, iterations factorise the zone that does while it is at most {:.0} % of the cells (estimate: {:.2} Gflop at \
         {:.0} %, {:.2} Gflop for all of them)",
        100.0 * largest,
        zone_estimate(dofs, interface, dim, EXAMPLE) / 1e9,
        100.0 * EXAMPLE,
        zone_whole(dofs, interface) / 1e9
    )
}
