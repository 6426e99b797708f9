//! A solved case: from the plan to the last load step, then to the files.
use super::{Engine, Plan, Run, adapt::Adapted, draw, option_warnings, remove_old_summary};
use crate::{
    case::{self, Case},
    error::Result,
    estimate::Estimate,
    output::{self, ResultFile},
    parallel::agree,
    petsc::Stage,
    plain_text,
    record::{HistoryRow, Summary},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{path::Path, time::Instant};

/// A case that is solved, not written yet.
pub(super) struct Solved {
    // Before the plan: factorisations end before their communicators.
    engine: Engine,
    run: Run,
    pub plan: Plan,
}

impl Solved {
    /// Solves all load steps. Collective.
    pub fn new(
        case: &Case,
        world: &SimpleCommunicator,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Self> {
        let (plan, mut engine) = Engine::new(case, world)?;
        let mut run = Run::default();
        if let Engine::Active(active) = &engine {
            let [lines, warnings] = active.announce(case, &plan);
            lines.iter().filter(|_| world.rank() == 0).for_each(|line| eprintln!("{}", plain_text(line)));
            run.warnings = warnings;
        }
        run.all_steps(case, &plan, &mut engine, progress)?;
        Ok(Solved { engine, run, plan })
    }

    pub fn converged(&self) -> bool {
        self.run.reason.converged()
    }

    pub fn estimate(&self) -> &Estimate {
        &self.run.estimate
    }

    pub fn alternations(&self) -> u64 {
        self.run.counts[0]
    }

    /// Largest pressure of a pair after the last step, Pa.
    pub fn max_pressure(&self, pair: usize) -> f64 {
        self.run.steps.last().and_then(|step| step.pairs.get(pair)).map_or(0.0, |pair| pair.max_pressure)
    }

    /// Writes results, pictures and summary; `start`: of the whole run. Collective.
    pub fn finish(
        self,
        case: &Case,
        world: &SimpleCommunicator,
        directory: &Path,
        start: Instant,
        adapted: Option<Adapted>,
    ) -> Result<(Summary, Estimate)> {
        let Solved { plan, engine, run } = self;
        let _stage = Stage::Write.enter();
        let writing = Instant::now();
        let info = run.info(case, world);
        let file = directory.join(output::RESULT);
        let before = if case.steps.is_empty() { &[][..] } else { &run.before };
        let result =
            ResultFile { piece: &run.piece, pairs: &run.pairs, before, history: &run.history, run: &info };
        remove_old_summary(world, directory)?;
        output::write(world, &file, &result)?;
        let drawn = if world.rank() == 0 { draw(case, &file, directory) } else { Ok(()) };
        agree(world, drawn)?;
        let clock = [writing.elapsed().as_secs_f64(), start.elapsed().as_secs_f64()];
        let (mut summary, estimate) = run.summary(case, &plan, &engine, &info, clock);
        summary.warnings.extend(option_warnings(case, &plan.groups, engine.bodies())?);
        if let Some(adapted) = adapted {
            adapted.report(&mut summary);
        }
        let written = if world.rank() == 0 {
            output::write_summary(&summary, &directory.join(output::SUMMARY))
        } else {
            Ok(())
        };
        agree(world, written)?;
        Ok((summary, estimate))
    }
}

impl Run {
    fn all_steps(
        &mut self,
        case: &Case,
        plan: &Plan,
        engine: &mut Engine,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<()> {
        let world = &plan.groups.world;
        let exchange = plan.exchange(case);
        let one = case::StepCase {
            name: None,
            loads: 1.0,
            supports: 1.0,
            temperature: 1.0,
            origin: Default::default(),
        };
        let steps = if case.steps.is_empty() { std::slice::from_ref(&one) } else { &case.steps[..] };
        for (i, step) in steps.iter().enumerate() {
            let alternating = Instant::now();
            let on_rank_zero = |row: &HistoryRow| {
                if world.rank() == 0 {
                    progress(row);
                }
            };
            let (found, nodal) = engine.step(case, plan, &exchange, i as u64 + 1, step, on_rank_zero)?;
            self.alternate += alternating.elapsed().as_secs_f64();
            self.finish_step(case, plan, engine.bodies(), found, &nodal, step)?;
            // The steps after one that failed would start from nowhere.
            if !self.reason.converged() {
                break;
            }
        }
        Ok(())
    }
}
