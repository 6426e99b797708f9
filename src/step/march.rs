//! Along the load path.
use super::{
    advance::Advanced,
    engine::Engine,
    found::Found,
    state::State,
    task::{Scene, Target},
    way::{
        Change, DEPENDS, LEAST_COLLAPSING, LEAST_SLIDING, Pace, Way, change, depends_on_way, pace_by,
        turnover,
    },
};
use crate::{
    body::LoadFactors,
    case::{ContactGeometry, StepCase},
    error::{Error, Result},
    record::{HistoryRow, Reason},
};

/// An increment that was solved, to be measured, accepted and kept.
pub(crate) struct Accepted<'m> {
    /// Of the step that it belongs to, if it ends it.
    pub name: Option<&'m str>,
    pub factors: LoadFactors,
    /// Number of the increment in its step: 1, 2, ...
    pub increment: u64,
    /// True at the end of a step.
    pub ends_step: bool,
    /// True at the end of the path.
    pub is_last: bool,
    pub advanced: Advanced,
}

/// How the march ended.
pub(crate) enum End {
    /// At the end of the path.
    Arrived,
    /// The last accepted increment was no solution further on.
    Stopped(Reason),
    /// A motion that nothing stops.
    Refused(Error),
}

/// Goes through the steps of a path. `accept` measures an increment that was solved, keeps it if it is a solution, and
/// says how it ended. Where one fails, smaller ones are tried if the way matters: if there is a table of steps, or if the
/// geometry is updated or surfaces rub; otherwise the end alone decides. Collective.
pub(crate) fn march<'p>(
    engine: &mut Engine,
    scene: &Scene,
    path: &'p [StepCase],
    mut progress: impl FnMut(&HistoryRow),
    mut accept: impl FnMut(&Engine, Accepted<'p>) -> Result<(Reason, State)>,
) -> Result<End> {
    let (case, world) = (scene.case, &scene.plan.groups.world);
    let updated = case.contacts.iter().any(|c| c.geometry == ContactGeometry::Updated);
    let divisible = updated || case.has_friction() || case.has_plasticity() || !case.steps.is_empty();
    let mut state = State::start();
    for (i, step) in path.iter().enumerate() {
        let is_final = i + 1 == path.len();
        let way = Way::new(&state.factors, step, &case.paths);
        let mut pace = Pace::new(step.increments, &way, divisible);
        let mut increment = 1;
        // What was found in larger increments that were taken back.
        let mut before: Option<Found> = None;
        while let Some(reached) = pace.next() {
            let factors = way.at(reached);
            let ends_step = reached >= 1.0;
            let is_last = ends_step && is_final;
            let target = Target {
                number: i as u64 + 1,
                increment,
                factors: &factors,
                is_end: ends_step && (is_final || case.output.every_estimate),
            };
            let in_increment = |row: &HistoryRow| progress(&HistoryRow { increment, ..row.clone() });
            let failure = match engine.advance(scene, &state, target, in_increment) {
                Ok(mut advanced) => {
                    if let Some(before) = before.take() {
                        advanced.found.prepend(before);
                    }
                    let divides = match case.has_friction() && advanced.found.reason.converged() {
                        true => {
                            let middle = way.at(pace.middle(reached));
                            divided(engine, scene, &state, &middle, target, &advanced.state)?
                                .of_share(reached)
                        }
                        false => Change::default(),
                    };
                    let depends = divides.depends();
                    let changed = match pace.is_automatic() {
                        true => pace_by(turnover(&state.pairs, &advanced.state.pairs, world), depends),
                        false => 0.0,
                    };
                    if advanced.found.reason.converged() && pace.is_too_large(changed) && pace.halve(reached)
                    {
                        before = Some(advanced.found);
                        continue;
                    }
                    if depends > DEPENDS {
                        advanced.found.warnings.push(format!(
                            "load step {}: dividing an increment in two changes the tangential forces by {:.1} % and the work of \
                             friction by {:.1} %, for normal and tangential loads change together while surfaces slip, or surfaces \
                             close: use more increments (steps), or steps = \"auto\"",
                            i + 1,
                            100.0 * divides.forces,
                            100.0 * divides.work
                        ));
                    }
                    let name = step.name.as_deref().filter(|_| ends_step);
                    let accepted = Accepted { name, factors, increment, ends_step, is_last, advanced };
                    match accept(engine, accepted)? {
                        (reason, accepted) if reason.converged() => {
                            state = accepted;
                            pace.accept(reached, changed);
                            increment += 1;
                            continue;
                        }
                        (reason, _) => End::Stopped(reason),
                    }
                }
                Err(error @ Error::Unrestrained(_)) => End::Refused(error),
                Err(Error::NotConverged(text)) => {
                    return Err(Error::NotConverged(format!("load step {}: {text}", i + 1)));
                }
                Err(error) => return Err(error),
            };
            // Where a body leaves that only friction holds is looked for to the end.
            let slides = case.has_friction() && matches!(failure, End::Refused(_));
            // So is the limit load, but not to the last digit.
            let collapses = matches!(failure, End::Stopped(Reason::NoEquilibrium));
            let halved = match (slides, collapses) {
                (true, _) => pace.halve_down_to(LEAST_SLIDING, reached),
                (_, true) => pace.halve_down_to(LEAST_COLLAPSING, reached),
                _ => pace.halve(reached),
            };
            if !halved {
                return Ok(failure);
            }
        }
    }
    Ok(End::Arrived)
}

/// What changes if an increment is divided in two: nothing where nothing slips, or where the halves tell nothing. The end of a step in which normal and tangential loads change together depends on the way.
/// Collective.
fn divided(
    engine: &mut Engine,
    scene: &Scene,
    from: &State,
    middle: &LoadFactors,
    target: Target,
    whole: &State,
) -> Result<Change> {
    let world = &scene.plan.groups.world;
    if !depends_on_way(&from.pairs, &whole.pairs, world) {
        return Ok(Change::default());
    }
    let mut to = |state: &State, factors: &LoadFactors| -> Result<Option<State>> {
        let target = Target { factors, is_end: false, ..target };
        match engine.advance(scene, state, target, |_| {}) {
            Ok(advanced) if advanced.found.reason.converged() => Ok(Some(advanced.state)),
            Ok(_) | Err(Error::Unrestrained(_)) => Ok(None),
            Err(error) => Err(error),
        }
    };
    let half = to(from, middle)?;
    let end = half.map_or(Ok(None), |half| to(&half, target.factors))?;
    // What is measured next is the increment itself.
    engine.load(scene.plan, target)?;
    engine.return_to(scene, from, whole)?;
    Ok(end.map_or(Change::default(), |end| change(&from.pairs, [&whole.pairs, &end.pairs], world)))
}
