//! What the accepted steps of a run have given.
use super::{
    checks::{self, OfBodies, checks, total, worse},
    energy,
    evidence::Evidence,
    fields::{append, probe, start_fields},
    friction_fields::add_friction,
    outline::outlines,
    pairs::pair_results,
    plastic,
    plausible::{self, Motion, Motions, plausibility},
};
use crate::{
    body::{Body, LoadFactors},
    case::{Case, StepCase},
    contact::Surface,
    error::{Error, Result},
    estimate::{BodyError, Change, Estimate, MultiplierSide, Solved},
    output::{self, Growing, Piece, ResultFile, RunInfo},
    parallel::{self, agree},
    petsc::Stage,
    record::{self, HistoryRow, LoadStep, Plausibility, Reason, StepSummary},
    scene::{ContactSide, Plan},
    step::{self, Accepted, Advanced, End, Energy, Engine, Found, Influence, Nodal, Scene},
    vector::{ratio, smaller, worst},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::path::Path;

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
    /// `None`: not made yet.
    pub estimate: Option<Estimate>,
    /// What it is made of: displacements of this rank's bodies, m, and contact forces at their owned nodes, N.
    pub solution: Vec<[Vec<f64>; 2]>,
}

/// What the steps so far have given.
pub(super) struct Run {
    /// How the last one ended; the same on all ranks.
    pub reason: Reason,
    pub last: Last,
    /// The alternations that are not in the file yet.
    pub history: Vec<HistoryRow>,
    /// Takes each step of a table of steps as soon as it is accepted.
    pub file: Option<Growing>,
    pub steps: Vec<StepSummary>,
    pub checks: record::Checks,
    pub plausibility: Plausibility,
    pub counts: Counts,
    pub warnings: Vec<String>,
    pub diagnosis: Vec<String>,
    /// Smallest tolerance of a step.
    pub tolerance: f64,
    /// What acts after the last step that is kept.
    factors: LoadFactors,
    /// Where surfaces rub or bodies yield: forces and displacements there.
    point: Option<energy::Point>,
    /// True if that is an increment on the way to the end of its step.
    unfinished: bool,
    /// Warnings of the steps before.
    warned: usize,
}

/// A step, measured: its numbers, its fields, and its verdict.
struct Measured {
    last: Last,
    summary: StepSummary,
    checks: record::Checks,
    plausibility: Plausibility,
    counts: Counts,
    warnings: Vec<String>,
    /// Where surfaces rub or bodies yield.
    energy: Option<(energy::Point, Energy)>,
}

impl Run {
    fn new(file: Option<Growing>) -> Run {
        Run {
            reason: Reason::NoContact,
            last: Last::default(),
            history: Vec::new(),
            file,
            steps: Vec::new(),
            checks: checks::none(),
            plausibility: Plausibility::default(),
            counts: Counts::default(),
            warnings: Vec::new(),
            diagnosis: Vec::new(),
            tolerance: f64::INFINITY,
            factors: LoadFactors::FULL,
            point: None,
            unfinished: false,
            warned: 0,
        }
    }

    /// Goes through all load steps; a step that fails ends the run with the last accepted one kept. With a table of steps
    /// each is added to `file` as soon as it is accepted. Collective.
    pub fn march(
        case: &Case,
        plan: &Plan,
        engine: &mut Engine,
        file: Option<Growing>,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Run> {
        let exchange = plan.exchange(case);
        let one = StepCase::whole();
        let path = if case.steps.is_empty() { std::slice::from_ref(&one) } else { &case.steps[..] };
        let scene = Scene { case, plan, exchange: &exchange };
        let is_first = plan.groups.world.rank() == 0;
        let on_rank_zero = |row: &HistoryRow| {
            if is_first {
                progress(row);
            }
        };
        let mut run = Run::new(file);
        let end = step::march(engine, &scene, path, on_rank_zero, |engine, accepted| {
            run.keep(case, plan, engine, accepted)
        })?;
        run.end(end, case, &plan.groups.world)?;
        if run.last.estimate.is_none() && !run.last.solution.is_empty() {
            let displacement = run.last.solution.iter().map(|[u, _]| u.clone()).collect::<Vec<_>>();
            engine.revisit(&scene, &run.factors, &displacement)?;
        }
        run.estimate(case, plan, engine.bodies())?;
        Ok(run)
    }

    /// Says how far the load got where it did not get to the end. Collective.
    fn end(&mut self, end: End, case: &Case, world: &SimpleCommunicator) -> Result<()> {
        let reached = self.steps.iter().rev().find(|step| step.reason.converged());
        let tells = !case.steps.is_empty() || case.has_friction() || case.has_plasticity();
        let reached = reached.filter(|_| tells).map(|step| {
            format!(
                "the load got to loads = {}, supports = {}, temperature = {}{}",
                step.loads,
                step.supports,
                step.temperature,
                step.paths
                    .iter()
                    .map(|(name, factor)| format!(", path {name} = {factor}"))
                    .collect::<String>()
            )
        });
        if self.unfinished {
            // The way of a step that does not get to its end is told as far as it went.
            self.append(case, world)?;
        }
        match end {
            End::Arrived => Ok(()),
            End::Stopped(reason) => {
                self.reason = reason;
                self.diagnosis.extend(reached);
                Ok(())
            }
            End::Refused(Error::Unrestrained(text)) => {
                let text = reached.map_or(text.clone(), |reached| format!("{text}; {reached}"));
                Err(Error::Unrestrained(text))
            }
            End::Refused(error) => Err(error),
        }
    }

    /// Measures an increment and keeps it if it is a solution, or if there is none to keep in its place. Collective.
    fn keep(
        &mut self,
        case: &Case,
        plan: &Plan,
        engine: &Engine,
        accepted: Accepted,
    ) -> Result<(Reason, step::State)> {
        let Accepted { name, factors, increment, ends_step, is_last, advanced } = accepted;
        let Advanced { mut state, mut found, contact, influences } = advanced;
        let estimated = is_last || (ends_step && case.output.every_estimate);
        let step = load_step(case, name, &factors, increment);
        let measured = measure(
            case,
            plan,
            engine.bodies(),
            &state,
            &mut found,
            contact,
            &influences,
            step,
            estimated,
            self.point.as_ref(),
        )?;
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
            self.plausibility = Plausibility::default();
        }
        self.reason = reason;
        self.tolerance = smaller(self.tolerance, found.tolerance);
        self.checks = worse(self.checks, measured.checks);
        self.plausibility = plausible::worse(self.plausibility, measured.plausibility);
        self.factors = factors;
        if let (true, Some((point, energy))) = (reason.converged(), measured.energy) {
            (self.point, state.energy) = (Some(point), energy);
        }
        self.add_step(measured.summary);
        self.last = measured.last;
        self.add_history(found.history, increment);
        self.warn(measured.warnings.into_iter().chain(found.warnings).collect());
        self.diagnosis = found.diagnosis;
        self.unfinished = reason.converged() && !ends_step;
        if reason.converged() && ends_step {
            self.warned = self.warnings.len();
            self.append(case, &plan.groups.world)?;
        }
        Ok((reason, state))
    }

    /// An increment takes the place of the one before it in its step.
    fn add_step(&mut self, mut step: StepSummary) {
        if self.unfinished
            && let Some(before) = self.steps.pop()
        {
            step.alternations += before.alternations;
            step.updates += before.updates;
            if let (Some(step), Some(before)) = (&mut step.plasticity, before.plasticity) {
                step.iterations += before.iterations;
            }
        }
        self.steps.push(step);
    }

    /// Alternations and updates are counted through the increments of a step.
    fn add_history(&mut self, rows: Vec<HistoryRow>, increment: u64) {
        let before = self.history.last().filter(|_| self.unfinished);
        let (alternations, updates) = before.map_or((0, 0), |row| (row.alternation, row.update));
        self.history.extend(rows.into_iter().map(|row| HistoryRow {
            increment,
            alternation: alternations + row.alternation,
            update: updates + row.update,
            ..row
        }));
    }

    /// Adds warnings. What was said of an increment before in the same step is said with the present figures.
    fn warn(&mut self, warnings: Vec<String>) {
        let before = self.warnings.len();
        for warning in warnings {
            let said = self.warnings[self.warned..before].iter_mut().find(|said| same_words(said, &warning));
            match said {
                Some(said) => *said = warning,
                None => self.warnings.push(warning),
            }
        }
    }

    /// Adds the last step to the file, if there is a table of steps. Collective.
    fn append(&mut self, case: &Case, world: &SimpleCommunicator) -> Result<()> {
        let Some(mut file) = self.file.take() else { return Ok(()) };
        let _stage = Stage::Write.enter();
        let info = self.info(case, world);
        let Last { piece, pairs, .. } = &self.last;
        file.append(world, &ResultFile { piece, pairs, history: &self.history, run: &info })?;
        self.history.clear();
        self.file = Some(file);
        // The file has them; the points tell how far planes are to be drawn.
        let Piece { cells, cell_bodies, point_fields, cell_fields, .. } = &mut self.last.piece;
        (*cells, *cell_bodies) = Default::default();
        (*point_fields, *cell_fields) = Default::default();
        Ok(())
    }

    /// The estimate of the last step that was kept, if it has none: the run did not get to the end. Collective.
    fn estimate(&mut self, case: &Case, plan: &Plan, bodies: &[Body]) -> Result<()> {
        let (Some(step), None) = (self.steps.last_mut(), &self.last.estimate) else { return Ok(()) };
        let _stage = Stage::Estimate.enter();
        let mut errors = Vec::new();
        let groups = &plan.groups;
        let made = std::iter::zip(bodies, &self.last.solution).zip(groups.bodies()).try_for_each(
            |((body, [displacement, contact]), &index)| {
                let u = body.with_ghosts(&groups.group, displacement)?;
                let (fields, ..) = agree(&groups.group, body.recover(&u, contact, &[]))?;
                let own = Solved { u: &u, stresses: &fields.at_points };
                errors.push(BodyError::new(body, index, &groups.group, &own, &[])?.0);
                Ok(())
            },
        );
        agree(&groups.world, made)?;
        let unknown = vec![None; case.contacts.len()];
        let estimate = Estimate::new(case, plan, errors, &multiplier_sides(plan, &self.last.pairs), &unknown);
        step.set_estimate(&estimate);
        self.last.estimate = Some(estimate);
        Ok(())
    }

    /// Completes the result file. Collective.
    pub fn write(
        &mut self,
        case: &Case,
        world: &SimpleCommunicator,
        path: &Path,
        info: &RunInfo,
    ) -> Result<()> {
        // What is kept for want of a solution.
        if self.file.as_ref().is_some_and(|file| file.steps() == 0) {
            self.append(case, world)?;
        }
        let Last { piece, pairs, .. } = &self.last;
        match self.file.take() {
            Some(file) => file.finish(world, info),
            None => {
                output::write(world, path, &ResultFile { piece, pairs, history: &self.history, run: info })
            }
        }
    }

    /// What was run. Collective.
    pub fn info(&self, case: &Case, world: &SimpleCommunicator) -> RunInfo {
        let steps = self.steps.iter().map(|s| LoadStep {
            name: s.name.clone(),
            loads: s.loads,
            supports: s.supports,
            temperature: s.temperature,
            at: s.at,
            paths: s.paths.clone(),
            increments: s.increments,
            reason: s.reason,
            alternations: s.alternations,
            updates: s.updates,
        });
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
            rigid: outlines(case, &self.last.piece.points, &self.factors, world),
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
    contact: Vec<Vec<f64>>,
    influences: &[(Influence, Nodal)],
    step: LoadStep,
    estimated: bool,
    before: Option<&energy::Point>,
) -> Result<Measured> {
    let _stage = Stage::Recover.enter();
    let (world, groups) = (&plan.groups.world, &plan.groups);
    let mut piece = Piece::default();
    let heated = case.bodies.iter().any(|b| b.temperature.is_some());
    start_fields(&mut piece, heated);
    let (mut balances, mut recovered, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    let mut motions = Vec::new();
    let mut changes = vec![0.0; influences.len()];
    let ends = std::iter::zip(&state.bodies, &contact);
    let finished = std::iter::zip(bodies, ends).enumerate().try_for_each(|(i, (body, (end, contact)))| {
        let u = body.with_ghosts(&groups.group, &end.displacement)?;
        let decisive = influences.iter().filter(|_| estimated);
        let changed = decisive
            .map(|(_, changed)| body.with_ghosts(&groups.group, &changed.displacement[i]))
            .collect::<Result<Vec<_>>>()?;
        let others: Vec<&[f64]> = changed.iter().map(|u| &u[..]).collect();
        let (fields, balance, stresses) = agree(&groups.group, body.recover(&u, contact, &others))?;
        let estimating = Stage::Estimate.enter();
        let mut error = None;
        if estimated {
            let solved: Vec<Solved> =
                std::iter::zip(&changed, &stresses).map(|(u, stresses)| Solved { u, stresses }).collect();
            let own = Solved { u: &u, stresses: &fields.at_points };
            let (mut of_body, products) = BodyError::new(body, end.body, &groups.group, &own, &solved)?;
            for ((sum, (influence, _)), products) in std::iter::zip(&mut changes, influences).zip(products) {
                for (cell, product) in std::iter::zip(&mut of_body.cells, products) {
                    let change = ratio(product, influence.scale * influence.value);
                    *sum += change;
                    cell.peaks += change.abs();
                }
            }
            error = Some(of_body);
        }
        drop(estimating);
        append(&mut piece, body, &fields, error.as_ref(), end.body, heated);
        errors.extend(error);
        motions.push(Motion::of_part(body, &fields, plan.meshes[i].points[0]));
        balances.push(total(&groups.group, &balance));
        recovered.push(fields);
        Ok(())
    });
    agree(world, finished)?;
    let probes = probe(case, plan, bodies, &recovered, world)?;
    let mut warnings = Vec::new();
    let (mut pairs, tables) = pair_results(case, found, world, &mut warnings);
    if case.has_friction() {
        add_friction(&mut piece, plan, bodies, &tables);
    }
    if case.has_plasticity() {
        plastic::add_plastic(&mut piece, bodies, &recovered);
    }
    let estimating = Stage::Estimate.enter();
    let mut of_pairs = vec![None; case.contacts.len()];
    for ((influence, _), stresses) in std::iter::zip(influences, parallel::sum(world, &changes)) {
        let partners = influence.partners.map(|change| ratio(change, influence.value));
        of_pairs[influence.pair] = Some(Change { stresses, partners });
    }
    let mut estimate =
        estimated.then(|| Estimate::new(case, plan, errors, &multiplier_sides(plan, &tables), &of_pairs));
    if let (true, Some(estimate)) = (case.has_plasticity(), &mut estimate) {
        // The estimate knows of stresses in the plane alone, of which plastic strains across it are no part.
        let mut stored = vec![0.0; case.bodies.len()];
        std::iter::zip(&balances, groups.bodies()).for_each(|(b, &index)| stored[index] = b.stored);
        estimate.strain_energy = parallel::max(world, &stored);
    }
    let of_pair = estimate.iter().flat_map(|estimate| &estimate.pairs);
    std::iter::zip(&mut pairs, of_pair).for_each(|(p, e)| p.error_estimate = e.pressure);
    drop(estimating);
    let energy = (case.has_friction() || case.has_plasticity()).then(|| {
        let acting = std::iter::zip(bodies, &recovered).zip(std::iter::zip(&state.bodies, &contact));
        let acting = acting.map(|((body, fields), (end, contact))| energy::Acting {
            displacement: end.displacement.clone(),
            forces: [fields.internal.clone(), body.held_by(&fields.internal, contact), contact.clone()],
        });
        let point = energy::Point::new(case, acting.collect(), found, &state.factors);
        let of_groups = if groups.is_root() { &balances[..] } else { &[] };
        let before = (before, state.energy);
        let (energy, summary) = energy::balance(case, before, &point, of_groups, (found, &pairs), world);
        ((point, energy), summary)
    });
    let (energy, of_energy) = energy.unzip();
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
        energy: of_energy.as_ref(),
        piece: &piece,
    };
    evidence.decide(found, world);
    warnings.extend(motions.warnings(case));
    let overlap = parallel::max(world, &[worst(found.ends.iter().map(|end| end.overlap))])[0];
    let (plausibility, lines) = plausibility(case, &of_bodies, &pairs, &motions, overlap, world);
    warnings.extend(lines);
    // Large strains have another cause than the geometry of the contact.
    let turned = std::mem::take(&mut found.turned);
    warnings.extend(turned.into_iter().filter(|_| !motions.has_large_strain()));
    let counts = Counts::of(world, found);
    let Counts { alternations, updates, .. } = counts;
    let step = LoadStep { reason: found.reason, alternations, updates, ..step };
    let mut summary = StepSummary::new(&step, found.tolerance, pairs, probes, None);
    summary.energy = of_energy;
    summary.plasticity =
        case.has_plasticity().then(|| plastic::summarise(case, plan, bodies, (&recovered, &balances), found));
    if let Some(estimate) = &estimate {
        summary.set_estimate(estimate);
    }
    let solution = match estimated {
        true => Vec::new(),
        false => {
            let ends = std::iter::zip(&state.bodies, contact);
            ends.map(|(end, contact)| [end.displacement.clone(), contact]).collect()
        }
    };
    let free_modes = std::mem::take(&mut found.free_modes);
    let held_modes = std::mem::take(&mut found.held_modes);
    Ok(Measured {
        last: Last { piece, pairs: tables, free_modes, held_modes, estimate, solution },
        summary,
        checks,
        plausibility,
        counts,
        warnings,
        energy,
    })
}

/// What acts, before it is known how it ends.
fn load_step(case: &Case, name: Option<&str>, factors: &LoadFactors, increment: u64) -> LoadStep {
    let has_tables = case.paths.iter().any(|path| path.table.is_some());
    let names = case.paths.iter().map(|path| path.name.clone());
    LoadStep {
        name: name.map(str::to_owned),
        loads: factors.loads,
        supports: factors.supports,
        temperature: factors.temperature,
        at: has_tables.then_some(factors.at),
        paths: std::iter::zip(names, factors.paths.iter().copied()).collect(),
        increments: increment,
        reason: Reason::NoContact,
        alternations: 0,
        updates: 0,
    }
}

/// True if two texts differ in numbers only.
fn same_words(a: &str, b: &str) -> bool {
    let is_number = |word: &str| word.trim_matches(['(', ')', ',', ';', ':', '%']).parse::<f64>().is_ok();
    let (a, b): (Vec<&str>, Vec<&str>) = (a.split(' ').collect(), b.split(' ').collect());
    a.len() == b.len() && std::iter::zip(a, b).all(|(a, b)| a == b || (is_number(a) && is_number(b)))
}

/// The sides with multipliers that this rank holds.
fn multiplier_sides<'a>(plan: &'a Plan, tables: &'a [record::PairTables]) -> Vec<MultiplierSide<'a>> {
    let ends = std::iter::zip(&plan.surfaces, &plan.ends);
    let side = |(surface, &ContactSide { pair, side, .. }): (&'a Surface, &ContactSide)| {
        let table = tables[pair].sides[side].as_ref().filter(|table| table.multipliers)?;
        Some(MultiplierSide { pair, side, surface, table })
    };
    ends.filter_map(side).collect()
}

impl StepSummary {
    fn set_estimate(&mut self, estimate: &Estimate) {
        std::iter::zip(&mut self.pairs, &estimate.pairs).for_each(|(p, e)| p.error_estimate = e.pressure);
        self.error_estimate = Some(record::ErrorEstimate::from(estimate));
    }
}

/// Peak resident memory of all processes, MB; 0 where the system does not tell. Collective.
pub(super) fn peak_memory_mb(world: &SimpleCommunicator) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let own =
        line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok()).map_or(0.0, |kb| kb / 1024.0);
    parallel::sum(world, &[own])[0]
}

#[cfg(test)]
mod tests {
    use super::same_words;

    #[test]
    fn figures_are_no_words() {
        assert!(same_words("body 'b1': strain of 0.12 at (1, 2)", "body 'b1': strain of 1e-3 at (4, 2)"));
        assert!(!same_words("body 'b1': strain of 0.12", "body 'b2': strain of 0.12"));
        assert!(!same_words("strain of 0.12", "strain of 0.12 there"));
    }
}
