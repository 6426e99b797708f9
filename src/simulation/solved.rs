//! A solved case: from the plan to the last load step, then to the files.
use super::{
    adapted::Adapted,
    files::{draw, remove_old_summary},
    options::option_warnings,
    report::{Clock, Site},
    results::Run,
};
use crate::{
    case::Case,
    error::Result,
    estimate::Estimate,
    output::{self, ResultFile},
    parallel::agree,
    petsc::Stage,
    plain_text,
    record::{HistoryRow, Summary},
    scene::Plan,
    step::Engine,
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
        let stage = Stage::SetUp.enter();
        let plan = Plan::new(case, world)?;
        let mut engine = Engine::new(case, &plan, &plan.exchange(case))?;
        drop(stage);
        let [lines, said] = engine.announce(case, &plan);
        lines.iter().filter(|_| world.rank() == 0).for_each(|line| eprintln!("{}", plain_text(line)));
        let mut run = Run::march(case, &plan, &mut engine, progress)?;
        run.warnings.splice(0..0, said);
        Ok(Solved { engine, run, plan })
    }

    pub fn converged(&self) -> bool {
        self.run.reason.converged()
    }

    pub fn estimate(&self) -> &Estimate {
        &self.run.last.estimate
    }

    pub fn alternations(&self) -> u64 {
        self.run.counts.alternations
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
        let result = ResultFile {
            piece: &run.last.piece,
            pairs: &run.last.pairs,
            before,
            history: &run.history,
            run: &info,
        };
        remove_old_summary(world, directory)?;
        output::write(world, &file, &result)?;
        let drawn = if world.rank() == 0 { draw(case, &file, directory) } else { Ok(()) };
        agree(world, drawn)?;
        let clock = Clock { write: writing.elapsed().as_secs_f64(), total: start.elapsed().as_secs_f64() };
        let site = Site { case, plan: &plan, engine: &engine };
        let (mut summary, estimate) = run.summary(&site, &info, clock);
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
