//! A run, from the checked case to the files: builds everything, calls everything, computes nothing itself.
mod checks;
mod fields;
mod interface;
mod pairs;
mod plan;

pub use interface::Interface;
pub use plan::{Plan, build_mesh};

use crate::{
    body::{Body, Compliance},
    case::Case,
    error::{Error, Result},
    output::{self, HistoryRow, Piece, Reason, ResultFile, RunInfo, Summary},
    parallel::{self, Exchange, agree},
    schwarz::{self, Alternation},
};
use checks::{checks, total};
use fields::{append, probe, start_fields};
use interface::Contacts;
use mpi::{topology::SimpleCommunicator, traits::*};
use pairs::pair_results;
use std::{path::Path, time::Instant};

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
    warn_of_unused_options(case, groups)?;
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
        let (fields, balance) = agree(&groups.group, body.recover(&u, &contact))?;
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
        steps: None,
        rigid: Vec::new(),
    };
    let file = directory.join(output::RESULT);
    let result =
        ResultFile { piece: &piece, pairs: &tables, before: &[], history: &found.history, run: &info };
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
        driver: output::Driver::Relaxed,
        transfer: output::Transfer::Pointwise,
        alternations: info.alternations,
        updates: 0,
        // One more: without contact forces, to begin with.
        force_steps: info.alternations + u64::from(!case.contacts.is_empty()),
        displacement_steps: info.alternations,
        tolerance: case.alternation.tolerance,
        residual: checks.residual,
        ranks: world.size() as usize,
        bodies: body_summaries(case, &plan, &bodies, &compliances, world),
        free_modes: Vec::new(),
        pairs,
        probes,
        steps: None,
        checks,
        seconds: output::Seconds {
            setup: seconds[0],
            search: 0.0,
            assemble: seconds[1],
            factor: seconds[2],
            condense: 0.0,
            alternate: seconds[3],
            write: seconds[4],
            total: seconds[5],
        },
        peak_memory_mb: parallel::sum(world, &[peak_memory_mb()])[0],
        warnings,
        diagnosis: Vec::new(),
    };
    let written = if world.rank() == 0 { summary.write(&directory.join(output::SUMMARY)) } else { Ok(()) };
    agree(world, written)?;
    Ok(summary)
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
            response: output::Response::Condensed,
            interface_dofs: 0,
            solves: 0,
        })
        .collect()
}

/// PETSc options with a body's prefix that its solver did not ask for are most likely misspelt.
fn warn_of_unused_options(case: &Case, groups: &parallel::Groups) -> Result<()> {
    for &b in groups.bodies().iter().filter(|_| groups.is_root()) {
        let prefix = crate::body::options_prefix(&case.bodies[b].name);
        for name in crate::petsc::option_prefixes_left(&prefix)? {
            eprintln!("warning: PETSc option -{name} was not used: is it misspelt?");
        }
    }
    Ok(())
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

/// Peak resident memory of this process, MB; 0 where the system does not tell.
fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok()).map_or(0.0, |kb| kb / 1024.0)
}
