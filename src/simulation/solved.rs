//! A solved case: from the plan to the last load step, then to the files.
use super::{
    adapted::Adapted,
    files::{draw, remove_old_summary},
    options::option_warnings,
    report::{Site, Start},
    results::Run,
};
use crate::{
    case::Case,
    error::Result,
    estimate::Estimate,
    output::{self, Growing},
    parallel::agree,
    petsc::Stage,
    plain_text,
    record::{HistoryRow, Summary},
    scene::Plan,
    step::Engine,
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::path::Path;

/// A case that is solved, not written yet.
pub(super) struct Solved {
    // Before the plan: factorisations end before their communicators.
    engine: Engine,
    run: Run,
    pub plan: Plan,
}

impl Solved {
    /// Solves all load steps. Those of a table are added to the result file in `directory` as soon as they are accepted,
    /// under its name from the first one on if `at_once`, else when it is complete. Collective.
    pub fn new(
        case: &Case,
        world: &SimpleCommunicator,
        directory: &Path,
        at_once: bool,
        progress: &mut impl FnMut(&HistoryRow),
    ) -> Result<Self> {
        let stage = Stage::SetUp.enter();
        let plan = Plan::new(case, world)?;
        let mut engine = Engine::new(case, &plan, &plan.exchange(case))?;
        drop(stage);
        let [lines, said] = engine.announce(case, &plan);
        lines.iter().filter(|_| world.rank() == 0).for_each(|line| eprintln!("{}", plain_text(line)));
        let names = case.steps.iter().map(|step| step.name.as_deref());
        let file = Growing::new(&directory.join(output::RESULT), at_once, names);
        let file = (!case.steps.is_empty()).then_some(file);
        let mut run = Run::march(case, &plan, &mut engine, file, progress)?;
        run.warnings.splice(0..0, said);
        Ok(Solved { engine, run, plan })
    }

    pub fn converged(&self) -> bool {
        self.run.reason.converged()
    }

    pub fn estimate(&self) -> &Estimate {
        self.run.last.estimate.as_ref().expect("a run that has ended has its estimate")
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
        start: &Start,
        adapted: Option<Adapted>,
    ) -> Result<(Summary, Estimate)> {
        let Solved { plan, engine, mut run } = self;
        let stage = Stage::Write.enter();
        let info = run.info(case, world);
        let file = directory.join(output::RESULT);
        remove_old_summary(world, directory)?;
        run.write(case, world, &file, &info)?;
        let drawn = if world.rank() == 0 { draw(case, &file, directory) } else { Ok(()) };
        agree(world, drawn)?;
        drop(stage);
        let site = Site { case, plan: &plan, engine: &engine };
        let (mut summary, estimate) = run.summary(&site, &info, start);
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
