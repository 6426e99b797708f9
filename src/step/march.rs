//! Along the load path.
use super::{
    advance::{Advanced, Engine},
    state::State,
    task::{Scene, Target},
};
use crate::{
    body::LoadFactors,
    case::{ContactGeometry, StepCase},
    error::{Error, Result},
    record::{HistoryRow, Reason},
};

/// A step that fails is halved, and its halves again, but no further than to this share of it: four halvings show whether
/// smaller steps help, and cost no more than a few steps.
const LEAST: f64 = 1.0 / 16.0;

/// A step that was solved, to be measured, accepted and kept.
pub(crate) struct Accepted<'m> {
    /// Of the step of the case that it belongs to; `None` for a part of one, unless it is the last part.
    pub name: Option<&'m str>,
    pub factors: LoadFactors,
    /// True at the end of the path.
    pub is_last: bool,
    pub advanced: Advanced,
}

/// How the march ended.
pub(crate) enum End {
    /// At the end of the path.
    Arrived,
    /// The last accepted step was no solution further on.
    Stopped(Reason),
    /// A motion that nothing stops.
    Refused(Error),
}

/// Goes through the steps of a path. `accept` measures a step that was solved, keeps it if it is a solution, and says how
/// it ended. Where a step fails, smaller ones are tried if the way matters: if there is a table of steps, or if the
/// geometry is updated; otherwise the end alone decides. Collective.
pub(crate) fn march<'p>(
    engine: &mut Engine,
    scene: &Scene,
    path: &'p [StepCase],
    mut progress: impl FnMut(&HistoryRow),
    mut accept: impl FnMut(&Engine, Accepted<'p>) -> Result<(Reason, State)>,
) -> Result<End> {
    let updated = scene.case.contacts.iter().any(|c| c.geometry == ContactGeometry::Updated);
    let least = if updated || !scene.case.steps.is_empty() { LEAST } else { 1.0 };
    let mut state = State::start();
    let mut number = 1;
    for (i, step) in path.iter().enumerate() {
        let is_final = i + 1 == path.len();
        let target =
            LoadFactors { loads: step.loads, supports: step.supports, temperature: step.temperature };
        let from = state.factors;
        let (mut done, mut size) = (0.0, 1.0);
        while done < 1.0 {
            let reached = done + size;
            let is_last = reached >= 1.0;
            let factors = if is_last { target } else { from.toward(&target, reached) };
            let name = step.name.as_deref().filter(|_| is_last);
            let tried = engine.advance(
                scene,
                &state,
                Target { number, factors, is_end: is_last && (is_final || scene.case.output.every_estimate) },
                &mut progress,
            );
            let failure = match tried {
                Ok(advanced) => {
                    match accept(engine, Accepted { name, factors, is_last: is_last && is_final, advanced })?
                    {
                        (reason, accepted) if reason.converged() => {
                            (state, done) = (accepted, reached);
                            number += 1;
                            // What went well may go on in larger steps.
                            size = (2.0 * size).min(1.0 - done);
                            continue;
                        }
                        (reason, _) => End::Stopped(reason),
                    }
                }
                Err(error @ Error::Unrestrained(_)) => End::Refused(error),
                Err(Error::NotConverged(text)) => {
                    return Err(Error::NotConverged(format!("load step {number}: {text}")));
                }
                Err(error) => return Err(error),
            };
            size *= 0.5;
            if size < least {
                return Ok(failure);
            }
        }
    }
    Ok(End::Arrived)
}
