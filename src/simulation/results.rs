//! What the accepted steps of a run have given.
use super::{
    checks::{self, OfBodies, checks, total, worse},
    evidence::Evidence,
    fields::{append, probe, start_fields},
    outline::outlines,
    pairs::pair_results,
    plausible::{Motion, Motions},
};
use crate::{
    body::{Body, LoadFactors},
    case::{Case, StepCase},
    contact::Surface,
    error::{Error, Result},
    estimate::{BodyError, Change, Estimate, MultiplierSide, Solved},
    output::{Piece, RunInfo, State},
    parallel::{self, agree},
    record::{self, HistoryRow, LoadStep, Reason, StepSummary},
    scene::{ContactSide, Plan},
    step::{self, Accepted, Advanced, End, Engine, Found, Influence, Nodal, Scene},
    vector::{ratio, smaller},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::time::Instant;

/// What was counted. The same on all ranks.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub alternations: u64,
    pub updates: u64,
    pub force_steps: u64,
    pub displacement_steps: u64,
}

/// A step that was measured, and all that is kept of it until the next one.
#[derive(Default)]
pub(super) struct Last {
    pub piece: Piece,
    pub pairs: Vec<record::PairTables>,
    pub free_modes: Vec<String>,
    pub held_modes: Vec<String>,
    pub estimate: Estimate,
}

/// What the steps so far have given.
pub(super) struct Run {
    /// How the last one ended; the same on all ranks.
    pub reason: Reason,
    pub last: Last,
    pub before: Vec<State>,
    pub history: Vec<HistoryRow>,
    pub steps: Vec<StepSummary>,
    pub checks: record::Checks,
    pub counts: Counts,
    pub warnings: Vec<String>,
    pub diagnosis: Vec<String>,
    /// Seconds of the driver.
    pub alternate: f64,
    /// Smallest tolerance of a step.
    pub tolerance: f64,
}

/// A step, measured: its numbers, its fields, and its verdict.
struct Measured {
    last: Last,
    summary: StepSummary,
    checks: record::Checks,
    counts: Counts,
    warnings: Vec<String>,
}

impl Run {
    fn new() -> Run {
        Run {
            reason: Reason::NoContact,
            last: Last::default(),
            before: Vec::new(),
            history: Vec::new(),
            steps: Vec::new(),
            checks: checks::none(),
            counts: Counts::default(),
            warnings: Vec::new(),
            diagnosis: Vec::new(),
            alternate: 0.0,
            tolerance: f64::INFINITY,
        }
    }

    /// Goes through all load steps; a step that fails ends the run with the last accepted one kept. Collective.
    pub fn march(
        case: &Case,
        plan: &Plan,
        engine: &mut Engine,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Run> {
        let exchange = plan.exchange(case);
        let one =
            StepCase { name: None, loads: 1.0, supports: 1.0, temperature: 1.0, origin: Default::default() };
        let path = if case.steps.is_empty() { std::slice::from_ref(&one) } else { &case.steps[..] };
        let scene = Scene { case, plan, exchange: &exchange };
        let is_first = plan.groups.world.rank() == 0;
        let on_rank_zero = |row: &HistoryRow| {
            if is_first {
                progress(row);
            }
        };
        let mut run = Run::new();
        let mut begun = Instant::now();
        let end = step::march(engine, &scene, path, on_rank_zero, |engine, accepted| {
            run.alternate += begun.elapsed().as_secs_f64();
            let kept = run.keep(case, plan, engine, accepted)?;
            begun = Instant::now();
            Ok(kept)
        })?;
        run.end(end, case)?;
        Ok(run)
    }

    /// Says how far the load got where it did not get to the end.
    fn end(&mut self, end: End, case: &Case) -> Result<()> {
        let reached = self.steps.iter().rev().find(|step| step.reason.converged());
        let reached = reached.map(|step| {
            format!(
                "the load got to loads = {}, supports = {}, temperature = {}",
                step.loads, step.supports, step.temperature
            )
        });
        match end {
            End::Arrived => Ok(()),
            End::Stopped(reason) => {
                self.reason = reason;
                self.diagnosis.extend(reached.filter(|_| !case.steps.is_empty()));
                Ok(())
            }
            End::Refused(Error::Unrestrained(text)) => {
                let reached = reached.filter(|_| !case.steps.is_empty());
                let text = reached.map_or(text.clone(), |reached| format!("{text}; {reached}"));
                Err(Error::Unrestrained(text))
            }
            End::Refused(error) => Err(error),
        }
    }

    /// Measures a step and keeps it if it is a solution, or if there is none to keep in its place. Collective.
    fn keep(
        &mut self,
        case: &Case,
        plan: &Plan,
        engine: &Engine,
        accepted: Accepted,
    ) -> Result<(Reason, step::State)> {
        let Accepted { name, factors, advanced } = accepted;
        let Advanced { state, mut found, contact, influences } = advanced;
        let measured =
            measure(case, plan, engine.bodies(), &state, &mut found, &contact, &influences, name, factors)?;
        let reason = found.reason;
        self.counts.add(&measured.counts);
        if !reason.converged() && self.steps.iter().any(|step| step.reason.converged()) {
            self.diagnosis = found.diagnosis;
            return Ok((reason, state));
        }
        if self.steps.pop_if(|step| !step.reason.converged()).is_some() {
            // It was kept for want of a solution: nothing of it remains.
            self.history.clear();
            (self.checks, self.tolerance) = (checks::none(), f64::INFINITY);
        } else if !self.steps.is_empty() {
            let old = std::mem::take(&mut self.last);
            let Piece { point_fields, cell_fields, .. } = old.piece;
            self.before.push(State { point_fields, cell_fields, pairs: old.pairs });
        }
        self.reason = reason;
        self.tolerance = smaller(self.tolerance, found.tolerance);
        self.checks = worse(self.checks, measured.checks);
        self.steps.push(measured.summary);
        self.last = measured.last;
        self.history.append(&mut found.history);
        self.warnings.extend(measured.warnings);
        self.warnings.append(&mut found.warnings);
        self.diagnosis = found.diagnosis;
        Ok((reason, state))
    }

    /// What was run. Collective.
    pub fn info(&self, case: &Case, world: &SimpleCommunicator) -> RunInfo {
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
            alternations: self.counts.alternations,
            tolerance: self.tolerance,
            steps: (!case.steps.is_empty()).then(|| steps.collect()),
            rigid: outlines(case, &self.last.piece.points, supports, world),
        }
    }
}

impl Counts {
    /// Rank 0's, known to all. Collective.
    pub fn of(world: &SimpleCommunicator, found: &Found) -> Counts {
        let mut counts =
            [found.history.len() as u64, found.updates, found.force_steps, found.displacement_steps];
        world.process_at_rank(0).broadcast_into(&mut counts[..]);
        let [alternations, updates, force_steps, displacement_steps] = counts;
        Counts { alternations, updates, force_steps, displacement_steps }
    }

    fn add(&mut self, other: &Counts) {
        self.alternations += other.alternations;
        self.updates += other.updates;
        self.force_steps += other.force_steps;
        self.displacement_steps += other.displacement_steps;
    }
}

/// Interiors, stresses, balance, pairs and verdict of a step. Collective.
#[expect(clippy::too_many_arguments, reason = "a step with all it is measured by")]
fn measure(
    case: &Case,
    plan: &Plan,
    bodies: &[Body],
    state: &step::State,
    found: &mut Found,
    contact: &[Vec<f64>],
    influences: &[(Influence, Nodal)],
    name: Option<&str>,
    factors: LoadFactors,
) -> Result<Measured> {
    let (world, groups) = (&plan.groups.world, &plan.groups);
    let mut piece = Piece::default();
    let heated = case.bodies.iter().any(|b| b.temperature.is_some());
    start_fields(&mut piece, heated);
    let (mut balances, mut recovered, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    let mut motions = Vec::new();
    let mut changes = vec![0.0; influences.len()];
    let ends = std::iter::zip(&state.bodies, contact);
    let finished = std::iter::zip(bodies, ends).enumerate().try_for_each(|(i, (body, (end, contact)))| {
        let u = body.with_ghosts(&groups.group, &end.displacement)?;
        let (fields, balance) = agree(&groups.group, body.recover(&u, contact))?;
        let changed = influences.iter().map(|(_, changed)| {
            let u = body.with_ghosts(&groups.group, &changed.displacement[i])?;
            let fields = agree(&groups.group, body.point_stresses(&u))?;
            Ok((u, fields))
        });
        let changed = changed.collect::<Result<Vec<_>>>()?;
        let solved: Vec<Solved> = changed.iter().map(|(u, fields)| Solved { u, fields }).collect();
        let own = Solved { u: &u, fields: &fields };
        let (mut error, products) = BodyError::new(body, end.body, &groups.group, &own, &solved)?;
        for ((sum, (influence, _)), products) in std::iter::zip(&mut changes, influences).zip(products) {
            for (cell, product) in std::iter::zip(&mut error.cells, products) {
                let change = ratio(product, influence.scale * influence.value);
                *sum += change;
                cell.peaks += change.abs();
            }
        }
        append(&mut piece, body, &fields, &error, end.body, heated);
        errors.push(error);
        motions.push(Motion::of_part(body, &fields, plan.meshes[i].points[0]));
        balances.push(total(&groups.group, &balance));
        recovered.push(fields);
        Ok(())
    });
    agree(world, finished)?;
    let probes = probe(case, plan, bodies, &recovered, world)?;
    let mut warnings = Vec::new();
    let (mut pairs, tables) = pair_results(case, found, world, &mut warnings);
    let mut of_pairs = vec![None; case.contacts.len()];
    for ((influence, _), stresses) in std::iter::zip(influences, parallel::sum(world, &changes)) {
        let partners = influence.partners.map(|change| ratio(change, influence.value));
        of_pairs[influence.pair] = Some(Change { stresses, partners });
    }
    let estimate = Estimate::new(case, plan, errors, &multiplier_sides(plan, found), &of_pairs);
    std::iter::zip(&mut pairs, &estimate.pairs).for_each(|(p, e)| p.error_estimate = e.pressure);
    let n = case.bodies.len();
    let of_bodies = OfBodies::new(&balances, groups.bodies(), n, world);
    let motions = Motions::gather(&motions, groups.bodies(), n, world);
    let checks = checks(&of_bodies, &pairs, &found.ends, world);
    let evidence = Evidence {
        case,
        checks: &checks,
        bodies: &of_bodies,
        motions: &motions,
        pairs: &pairs,
        piece: &piece,
    };
    evidence.decide(found, world);
    warnings.extend(motions.warnings(case));
    // Large strains have another cause than the geometry of the contact.
    let turned = std::mem::take(&mut found.turned);
    warnings.extend(turned.into_iter().filter(|_| !motions.has_large_strain()));
    let counts = Counts::of(world, found);
    let summary = LoadStep {
        name: name.map(str::to_owned),
        loads: factors.loads,
        supports: factors.supports,
        temperature: factors.temperature,
        reason: found.reason,
        alternations: counts.alternations,
        updates: counts.updates,
    };
    let summary =
        StepSummary::new(&summary, found.tolerance, pairs, probes, record::ErrorEstimate::from(&estimate));
    let free_modes = std::mem::take(&mut found.free_modes);
    let held_modes = std::mem::take(&mut found.held_modes);
    Ok(Measured {
        last: Last { piece, pairs: tables, free_modes, held_modes, estimate },
        summary,
        checks,
        counts,
        warnings,
    })
}

/// The sides with multipliers that this rank holds.
fn multiplier_sides<'a>(plan: &'a Plan, found: &'a Found) -> Vec<MultiplierSide<'a>> {
    let ends = std::iter::zip(&plan.surfaces, &plan.ends);
    let side = |(surface, &ContactSide { pair, side, .. }): (&'a Surface, &ContactSide)| {
        let end = found.ends.iter().find(|e| e.multiplier && (e.pair, e.side) == (pair, side))?;
        Some(MultiplierSide { pair, side, surface, table: &end.table })
    };
    ends.filter_map(side).collect()
}

/// Peak resident memory of all processes, MB; 0 where the system does not tell. Collective.
pub(super) fn peak_memory_mb(world: &SimpleCommunicator) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let own =
        line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok()).map_or(0.0, |kb| kb / 1024.0);
    parallel::sum(world, &[own])[0]
}
