//! A run, from the checked case to the files: builds everything, calls everything, computes nothing itself.
mod active;
mod adapt;
mod checks;
mod contacts;
mod evidence;
mod fields;
mod found;
mod length;
mod measure;
mod outline;
mod outlook;
mod pairs;
mod relaxed;
mod rows;
mod solved;
mod text;

pub use adapt::{Goal, Limits, Quantity, run_adaptive};
pub use measure::{ContactSolve, ContactSplit};
pub use outlook::outlook;
pub use relaxed::Interface;

use crate::{
    body::{Body, LoadFactors},
    case::{self, Case},
    contact::Surface,
    error::{Error, Result},
    estimate::{BodyError, Estimate, MultiplierSide},
    output::{self, Piece, RunInfo, State},
    parallel::{self, Exchange, agree},
    record::{self, HistoryRow, LoadStep, Reason, StepSummary, Summary},
    scene::Plan,
};
use active::{Active, Nodal};
use checks::{checks, total, worst};
use evidence::Evidence;
use fields::{append, probe, start_fields};
use found::Found;
use mpi::{topology::SimpleCommunicator, traits::*};
use outline::outlines;
use pairs::pair_results;
use relaxed::Relaxed;
use solved::Solved;
use std::{path::Path, time::Instant};

/// Runs a case and writes its results. Returns the summary (complete on world rank 0). Collective.
pub fn run(
    case: &Case,
    world: &SimpleCommunicator,
    directory: &Path,
    progress: impl FnMut(&HistoryRow),
) -> Result<Summary> {
    Ok(run_and_estimate(case, world, directory, progress)?.0)
}

/// The same, with the error estimate of the last step, cell by cell. Collective.
pub fn run_and_estimate(
    case: &Case,
    world: &SimpleCommunicator,
    directory: &Path,
    mut progress: impl FnMut(&HistoryRow),
) -> Result<(Summary, Estimate)> {
    let start = Instant::now();
    output::prepare(world, directory)?;
    Solved::new(case, world, &mut progress)?.finish(case, world, directory, start, None)
}

/// The driver of the case with all it works on.
enum Engine {
    Active(Box<Active>),
    Relaxed(Box<Relaxed>),
}

impl Engine {
    fn new(case: &Case, world: &SimpleCommunicator) -> Result<(Plan, Engine)> {
        match case.alternation.driver {
            case::Driver::Relaxed(weights) => {
                if let Some(step) = case.steps.first() {
                    return Err(step.origin.error("load steps need driver = \"active set\""));
                }
                let (plan, relaxed) = Relaxed::new(case, world, weights)?;
                Ok((plan, Engine::Relaxed(Box::new(relaxed))))
            }
            case::Driver::ActiveSet => {
                let plan = Plan::new(case, world)?;
                let active = Active::new(case, &plan, &plan.exchange(case))?;
                Ok((plan, Engine::Active(Box::new(active))))
            }
        }
    }

    fn step(
        &mut self,
        case: &Case,
        plan: &Plan,
        exchange: &Exchange,
        number: u64,
        step: &case::StepCase,
        progress: impl FnMut(&HistoryRow),
    ) -> Result<(Found, Vec<Nodal>)> {
        let factors =
            LoadFactors { loads: step.loads, supports: step.supports, temperature: step.temperature };
        match self {
            Engine::Active(active) => {
                active.step(&active::Step { case, plan, exchange, number, factors }, progress)
            }
            Engine::Relaxed(relaxed) => relaxed.step(case, plan, exchange, progress),
        }
    }

    fn bodies(&self) -> &[Body] {
        match self {
            Engine::Active(active) => &active.bodies,
            Engine::Relaxed(relaxed) => &relaxed.bodies,
        }
    }
}

/// What the steps so far have given.
struct Run {
    /// Of the last step; the same on all ranks.
    reason: Reason,
    piece: Piece,
    pairs: Vec<record::PairTables>,
    before: Vec<State>,
    history: Vec<HistoryRow>,
    steps: Vec<StepSummary>,
    free_modes: Vec<String>,
    held_modes: Vec<String>,
    checks: record::Checks,
    counts: [u64; 4],
    warnings: Vec<String>,
    diagnosis: Vec<String>,
    alternate: f64,
    /// Smallest tolerance of a step.
    tolerance: f64,
    /// Of the last step.
    estimate: Estimate,
}

impl Default for Run {
    fn default() -> Self {
        Run {
            reason: Reason::NoContact,
            piece: Piece::default(),
            pairs: Vec::new(),
            before: Vec::new(),
            history: Vec::new(),
            steps: Vec::new(),
            free_modes: Vec::new(),
            held_modes: Vec::new(),
            checks: checks::none(),
            counts: [0; 4],
            warnings: Vec::new(),
            diagnosis: Vec::new(),
            alternate: 0.0,
            tolerance: f64::INFINITY,
            estimate: Estimate::default(),
        }
    }
}

impl Run {
    /// Interiors, stresses, balance, pairs and verdict of a step. Collective.
    fn finish_step(
        &mut self,
        case: &Case,
        plan: &Plan,
        bodies: &[Body],
        mut found: Found,
        nodal: &[Nodal],
        step: &case::StepCase,
    ) -> Result<()> {
        let (world, groups) = (&plan.groups.world, &plan.groups);
        let mut piece = Piece::default();
        let heated = case.bodies.iter().any(|b| b.temperature.is_some());
        start_fields(&mut piece, heated);
        let (mut balances, mut recovered, mut errors) = (Vec::new(), Vec::new(), Vec::new());
        let finished = std::iter::zip(bodies, nodal).enumerate().try_for_each(|(i, (body, nodal))| {
            let u = body.with_ghosts(&groups.group, &nodal.displacement)?;
            let (fields, balance) = agree(&groups.group, body.recover(&u, &nodal.contact))?;
            let error = BodyError::new(body, groups.bodies()[i], &groups.group, &u, &fields)?;
            append(&mut piece, body, &fields, &error, groups.bodies()[i], heated);
            errors.push(error);
            balances.push(total(&groups.group, &balance));
            recovered.push(fields);
            Ok(())
        });
        agree(world, finished)?;
        let probes = probe(case, plan, bodies, &recovered, world)?;
        let (mut pairs, tables, beyond) = pair_results(case, &found, world, &mut self.warnings);
        if found.reason.converged() && beyond {
            found.reason = Reason::Penetration;
        }
        let checks = checks(&balances, &pairs, &found.ends, world);
        let evidence = Evidence { checks: &checks, pairs: &pairs, piece: &piece };
        evidence.decide(&mut found, world);
        let estimate = Estimate::new(case, plan, errors, &multiplier_sides(plan, &found));
        std::iter::zip(&mut pairs, &estimate.pairs).for_each(|(p, e)| p.error_estimate = e.pressure);
        self.checks = worst(self.checks, checks);
        let counts = [found.history.len() as u64, found.updates, found.force_steps, found.displacement_steps];
        let counts = share_outcome(world, &mut found.reason, counts);
        self.reason = found.reason;
        self.tolerance = self.tolerance.min(parallel::from_first(world, found.tolerance));
        std::iter::zip(&mut self.counts, counts).for_each(|(sum, n)| *sum += n);
        if !self.steps.is_empty() {
            let old = std::mem::take(&mut self.piece);
            let pairs = std::mem::take(&mut self.pairs);
            self.before.push(State { point_fields: old.point_fields, cell_fields: old.cell_fields, pairs });
        }
        let summary = LoadStep {
            name: step.name.clone(),
            loads: step.loads,
            supports: step.supports,
            temperature: step.temperature,
            reason: found.reason,
            alternations: counts[0],
            updates: counts[1],
        };
        let error_estimate = record::ErrorEstimate::from(&estimate);
        self.steps.push(StepSummary::new(&summary, pairs, probes, error_estimate));
        self.estimate = estimate;
        (self.piece, self.pairs, self.free_modes) = (piece, tables, found.free_modes);
        self.held_modes = found.held_modes;
        self.history.append(&mut found.history);
        self.warnings.append(&mut found.warnings);
        self.diagnosis.append(&mut found.diagnosis);
        Ok(())
    }

    /// What was run. Collective.
    fn info(&self, case: &Case, world: &SimpleCommunicator) -> RunInfo {
        let steps = self.steps.iter().map(|s| LoadStep {
            name: s.name.clone(),
            loads: s.loads,
            supports: s.supports,
            temperature: s.temperature,
            reason: s.reason,
            alternations: s.alternations,
            updates: s.updates,
        });
        let supports = self.steps.last().map_or(1.0, |step| step.supports);
        RunInfo {
            case: case.name.clone(),
            title: case.title.clone(),
            variant: case.variant.clone(),
            text: case.text.clone(),
            units: case.units,
            analysis: case.analysis,
            bodies: case.bodies.iter().map(|b| b.name.clone()).collect(),
            reason: self.reason,
            alternations: self.counts[0],
            tolerance: self.tolerance,
            steps: (!case.steps.is_empty()).then(|| steps.collect()),
            rigid: outlines(case, &self.piece.points, supports, world),
        }
    }

    /// The run in numbers. `clock`: seconds of writing, and in all. Collective.
    fn summary(
        self,
        case: &Case,
        plan: &Plan,
        engine: &Engine,
        info: &RunInfo,
        clock: [f64; 2],
    ) -> (Summary, Estimate) {
        let world = &plan.groups.world;
        let search = match engine {
            Engine::Active(active) => active.clock.search,
            Engine::Relaxed(relaxed) => relaxed.search_seconds,
        };
        let sum = |f: fn(crate::body::Cost) -> f64| engine.bodies().iter().map(|b| f(b.cost())).sum::<f64>();
        let seconds = [
            plan.seconds,
            search,
            sum(|c| c.assemble),
            sum(|c| c.factor),
            sum(|c| c.interface + c.condense),
            self.alternate,
            clock[0],
            clock[1],
        ];
        let s = parallel::max(world, &seconds);
        let last = self.steps.last();
        let mut bodies = body_summaries(case, plan, engine, world);
        std::iter::zip(&mut bodies, &self.estimate.body_energy)
            .for_each(|(b, e)| b.error_estimate = Some(*e));
        std::iter::zip(&mut bodies, &self.estimate.strain_energy)
            .for_each(|(b, e)| b.strain_energy = Some(*e));
        let summary = Summary {
            schema: Summary::SCHEMA,
            kontakt: env!("CARGO_PKG_VERSION").into(),
            case: case.name.clone(),
            variant: case.variant.clone(),
            input: format!("{:016x}", case.fingerprint),
            converged: info.converged(),
            reason: info.reason,
            driver: match engine {
                Engine::Active(_) => record::Driver::ActiveSet,
                Engine::Relaxed(_) => record::Driver::Relaxed,
            },
            transfer: match case.alternation.transfer {
                case::Transfer::Mortar => record::Transfer::Mortar,
                case::Transfer::Pointwise => record::Transfer::Pointwise,
            },
            alternations: self.counts[0],
            updates: self.counts[1],
            force_steps: self.counts[2],
            displacement_steps: self.counts[3],
            exchange: exchanged(plan),
            tolerance: self.tolerance,
            tolerance_automatic: case.alternation.tolerance == case::Tolerance::Automatic,
            residual: self.checks.residual,
            ranks: world.size() as usize,
            bodies,
            error_estimate: record::ErrorEstimate::from(&self.estimate),
            free_modes: modes_of(case, &self.free_modes),
            held_modes: modes_of(case, &self.held_modes),
            pairs: last.map_or_else(Vec::new, |s| s.pairs.clone()),
            probes: last.map_or_else(Vec::new, |s| s.probes.clone()),
            steps: (!case.steps.is_empty()).then(|| self.steps.clone()),
            checks: self.checks,
            seconds: record::Seconds {
                setup: s[0],
                search: s[1],
                assemble: s[2],
                factor: s[3],
                condense: s[4],
                alternate: s[5],
                write: s[6],
                total: s[7],
            },
            peak_memory_mb: parallel::sum(world, &[peak_memory_mb()])[0],
            warnings: self.warnings,
            diagnosis: self.diagnosis,
            adapt: None,
            adapt_reached: None,
        };
        (summary, self.estimate)
    }
}

/// The sides with multipliers that this rank holds.
fn multiplier_sides<'a>(plan: &'a Plan, found: &'a Found) -> Vec<MultiplierSide<'a>> {
    let ends = std::iter::zip(&plan.surfaces, &plan.ends);
    let side = |(surface, &(pair, side, _)): (&'a Surface, &(usize, usize, usize))| {
        let end = found.ends.iter().find(|e| e.multiplier && (e.pair, e.side) == (pair, side))?;
        Some(MultiplierSide { pair, side, surface, table: &end.table })
    };
    ends.filter_map(side).collect()
}

/// "body\tmode" lines as modes, by the order of the bodies.
fn modes_of(case: &Case, lines: &[String]) -> Vec<record::FreeMode> {
    let mut modes: Vec<(&str, &str)> = lines.iter().filter_map(|line| line.split_once('\t')).collect();
    modes.sort_by_key(|(body, _)| case.bodies.iter().position(|b| b.name == *body));
    modes.into_iter().map(|(body, mode)| record::FreeMode { body: body.into(), mode: mode.into() }).collect()
}

/// What the groups sent each other. Every rank of a reduction has counted it. Collective.
fn exchanged(plan: &Plan) -> record::ExchangeSummary {
    let world = &plan.groups.world;
    let [messages, bytes, reductions] = plan.traffic.counts().map(|n| n as f64);
    let sums = parallel::sum(world, &[messages, bytes]);
    let reductions = parallel::max(world, &[reductions])[0];
    record::ExchangeSummary { messages: sums[0] as u64, bytes: sums[1] as u64, reductions: reductions as u64 }
}

/// Rank 0's verdict and counts, known to all. Rank 0 is always a group's first rank. Collective.
fn share_outcome(world: &SimpleCommunicator, reason: &mut Reason, mut counts: [u64; 4]) -> [u64; 4] {
    let root = world.process_at_rank(0);
    let mut code = Reason::ALL.iter().position(|r| r == reason).unwrap_or(0) as u64;
    root.broadcast_into(&mut code);
    root.broadcast_into(&mut counts[..]);
    *reason = Reason::ALL[code as usize];
    counts
}

fn body_summaries(
    case: &Case,
    plan: &Plan,
    engine: &Engine,
    world: &SimpleCommunicator,
) -> Vec<record::BodySummary> {
    const N: usize = 5;
    let mut counts = vec![[0.0; N]; case.bodies.len()];
    for (i, &b) in plan.groups.bodies().iter().enumerate() {
        if plan.groups.is_root() {
            let body = &engine.bodies()[i];
            let cost = body.cost();
            let condensed = match engine {
                Engine::Active(_) => body.is_condensed(),
                // Its compliance is made by solves, but it answers by dense algebra.
                Engine::Relaxed(_) => true,
            };
            let dense = match engine {
                Engine::Active(_) => cost.interface_factorisations,
                Engine::Relaxed(relaxed) => relaxed.compliances[i].factorisations,
            };
            counts[b] = [
                cost.factorisations as f64,
                dense as f64,
                f64::from(u8::from(condensed)),
                (body.interface.nodes.len() * body.dim()) as f64,
                cost.solves as f64,
            ];
        }
    }
    let counts = parallel::sum(world, counts.as_flattened());
    case.bodies
        .iter()
        .zip(counts.chunks_exact(N))
        .enumerate()
        .map(|(b, (body, counts))| record::BodySummary {
            name: body.name.clone(),
            dofs: plan.dofs[b] as u64,
            ranks: plan.groups.shares[plan.groups.group_of(b)].ranks.len(),
            factorisations: counts[0] as u64,
            interface_factorisations: counts[1] as u64,
            response: if counts[2] > 0.5 { record::Response::Condensed } else { record::Response::Solver },
            interface_dofs: counts[3] as u64,
            solves: counts[4] as u64,
            error_estimate: None,
            strain_energy: None,
        })
        .collect()
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
