//! The bodies with their factorisations, and how they are brought from one state to the next.
use super::{
    active::Active,
    found::Found,
    relaxed::Relaxed,
    state::State,
    task::{Scene, Target},
};
use crate::{
    body::Body,
    case::{Case, Driver},
    error::{Error, Result},
    petsc::Stage,
    record::{HistoryRow, Reason},
    scene::Plan,
};
use mpi::{topology::SimpleCommunicator, traits::*};

/// The driver of the case with all it works on. What it keeps between steps can be made again from a state: operators,
/// and the contact rows of the last geometry.
pub(crate) enum Engine {
    Active(Box<Active>),
    Relaxed(Box<Relaxed>),
}

/// What a step makes: the next state, if `found.reason` is a solution, what was found on the way, and the contact
/// nodal forces at the owned nodes of each body, N.
pub(crate) struct Advanced {
    pub state: State,
    pub found: Found,
    pub contact: Vec<Vec<f64>>,
}

impl Engine {
    /// Meshes, assembles, factorises. Collective.
    pub fn new(case: &Case, world: &SimpleCommunicator) -> Result<(Plan, Engine)> {
        let _stage = Stage::SetUp.enter();
        match case.alternation.driver {
            Driver::Relaxed(weights) => {
                if let Some(step) = case.steps.first() {
                    return Err(step.origin.error("load steps need driver = \"active set\""));
                }
                let (plan, relaxed) = Relaxed::new(case, world, weights)?;
                Ok((plan, Engine::Relaxed(Box::new(relaxed))))
            }
            Driver::ActiveSet => {
                let plan = Plan::new(case, world)?;
                let active = Active::new(case, &plan, &plan.exchange(case))?;
                Ok((plan, Engine::Active(Box::new(active))))
            }
        }
    }

    /// The state at the end of a step that begins in `from`, which is not changed. Collective.
    pub fn advance(
        &mut self,
        scene: &Scene,
        from: &State,
        target: Target,
        progress: impl FnMut(&HistoryRow),
    ) -> Result<Advanced> {
        let _stage = Stage::Alternate.enter();
        let advanced = match self {
            Engine::Active(active) => active.advance(scene, from, target, progress),
            Engine::Relaxed(relaxed) => relaxed.advance(scene, target, progress),
        };
        advanced.map_err(|e| match e {
            Error::NotConverged(text) => Error::NotConverged(format!("load step {}: {text}", target.number)),
            other => other,
        })
    }

    pub fn bodies(&self) -> &[Body] {
        match self {
            Engine::Active(active) => &active.bodies,
            Engine::Relaxed(relaxed) => &relaxed.bodies,
        }
    }

    /// True if one of this rank's bodies answers by dense algebra.
    pub fn is_condensed(&self, place: usize) -> bool {
        match self {
            Engine::Active(active) => active.bodies[place].is_condensed(),
            // Its compliance is made by solves.
            Engine::Relaxed(_) => true,
        }
    }

    /// Factorisations of a body's interface operators.
    pub fn interface_factorisations(&self, place: usize) -> usize {
        match self {
            Engine::Active(active) => active.bodies[place].cost().interface_factorisations,
            Engine::Relaxed(relaxed) => relaxed.compliances[place].factorisations,
        }
    }
}

/// A body's own PETSc options under its prefix: `-ksp_type cg` becomes `-body_<name>_ksp_type cg`.
pub(super) fn prefixed(options: &str, name: &str) -> String {
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

/// Rank 0's verdict, known to all. Rank 0 is always a group's first rank. Collective.
pub(crate) fn share_reason(world: &SimpleCommunicator, reason: &mut Reason) {
    let mut code = Reason::ALL.iter().position(|r| r == reason).unwrap_or(0) as u64;
    world.process_at_rank(0).broadcast_into(&mut code);
    *reason = Reason::ALL[code as usize];
}
