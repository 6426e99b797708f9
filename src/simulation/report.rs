//! The summary: the run in numbers.
use super::results::{Run, peak_memory_mb};
use crate::{
    case::{self, Case},
    estimate::Estimate,
    output::RunInfo,
    parallel,
    petsc::{Stage, StageSeconds},
    record::{self, Summary},
    scene::Plan,
    step::Engine,
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::time::Instant;

/// When a run began.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    at: Instant,
    stages: StageSeconds,
}

impl Start {
    pub fn now() -> Start {
        Start { at: Instant::now(), stages: StageSeconds::now() }
    }

    /// Wall seconds since then. Collective.
    fn seconds(&self, world: &SimpleCommunicator) -> record::Seconds {
        let now = StageSeconds::now();
        let of = |stage| now.of(stage, &self.stages);
        let own = [
            of(Stage::SetUp),
            of(Stage::Search),
            of(Stage::Assemble),
            of(Stage::Factor),
            of(Stage::Condense),
            of(Stage::Alternate),
            of(Stage::Recover),
            of(Stage::Estimate),
            of(Stage::Write),
            self.at.elapsed().as_secs_f64(),
        ];
        let all = parallel::sum(world, &own);
        let [setup, search, assemble, factor, condense, alternate, recover, estimate, write, total] =
            std::array::from_fn(|i| all[i] / f64::from(world.size()));
        record::Seconds {
            setup,
            search,
            assemble,
            factor,
            condense,
            alternate,
            recover,
            estimate,
            write,
            total,
        }
    }
}

/// Where a run took place.
pub(super) struct Site<'s> {
    pub case: &'s Case,
    pub plan: &'s Plan,
    pub engine: &'s Engine,
}

impl Run {
    /// The run in numbers, and the estimate of its last step. Collective.
    pub fn summary(self, site: &Site, info: &RunInfo, start: &Start) -> (Summary, Estimate) {
        let Site { case, plan, .. } = *site;
        let world = &plan.groups.world;
        let seconds = start.seconds(world);
        let estimate = self.last.estimate.unwrap_or_default();
        let mut bodies = bodies(site);
        std::iter::zip(&mut bodies, &estimate.body_energy).for_each(|(b, e)| b.error_estimate = Some(*e));
        std::iter::zip(&mut bodies, &estimate.strain_energy).for_each(|(b, e)| b.strain_energy = Some(*e));
        let last = self.steps.last();
        let summary = Summary {
            schema: Summary::SCHEMA,
            kontakt: env!("CARGO_PKG_VERSION").into(),
            case: case.name.clone(),
            variant: case.variant.clone(),
            input: format!("{:016x}", case.fingerprint),
            converged: info.converged(),
            reason: info.reason,
            driver: match case.alternation.driver {
                case::Driver::ActiveSet => record::Driver::ActiveSet,
                case::Driver::Relaxed(_) => record::Driver::Relaxed,
            },
            transfer: match case.alternation.transfer {
                case::Transfer::Mortar => record::Transfer::Mortar,
                case::Transfer::Pointwise => record::Transfer::Pointwise,
            },
            alternations: self.counts.alternations,
            updates: self.counts.updates,
            force_steps: self.counts.force_steps,
            displacement_steps: self.counts.displacement_steps,
            exchange: exchanged(plan),
            tolerance: self.tolerance,
            tolerance_automatic: case.alternation.tolerance == case::Tolerance::Automatic,
            residual: self.checks.residual,
            ranks: world.size() as usize,
            bodies,
            error_estimate: record::ErrorEstimate::from(&estimate),
            free_modes: modes_of(case, &self.last.free_modes),
            held_modes: modes_of(case, &self.last.held_modes),
            pairs: last.map_or_else(Vec::new, |s| s.pairs.clone()),
            energy: last.and_then(|s| s.energy),
            plasticity: last.and_then(|s| s.plasticity.clone()),
            probes: last.map_or_else(Vec::new, |s| s.probes.clone()),
            steps: (!case.steps.is_empty()).then_some(self.steps),
            checks: self.checks,
            plausibility: self.plausibility,
            seconds,
            peak_memory_mb: peak_memory_mb(world),
            warnings: self.warnings,
            diagnosis: self.diagnosis,
            adapt: None,
            adapt_reached: None,
        };
        (summary, estimate)
    }
}

/// "body\tmode" lines in the order of the bodies.
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

/// Collective.
fn bodies(site: &Site) -> Vec<record::BodySummary> {
    const N: usize = 5;
    let Site { case, plan, engine } = *site;
    let mut counts = vec![[0.0; N]; case.bodies.len()];
    for (i, &b) in plan.groups.bodies().iter().enumerate().filter(|_| plan.groups.is_root()) {
        let body = &engine.bodies()[i];
        let cost = body.cost();
        counts[b] = [
            cost.factorisations as f64,
            cost.interface_factorisations as f64,
            f64::from(u8::from(body.is_condensed())),
            (body.interface.nodes.len() * body.dim()) as f64,
            cost.solves as f64,
        ];
    }
    let counts = parallel::sum(&plan.groups.world, counts.as_flattened());
    let summary = |(b, (body, counts)): (usize, (&case::BodyCase, &[f64]))| record::BodySummary {
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
    };
    std::iter::zip(&case.bodies, counts.chunks_exact(N)).enumerate().map(summary).collect()
}
