//! The contact solve alone, without stresses and output, and where its time goes.
use super::{pairs::pair_results, results::Counts};
use crate::{
    body::{Cost, Response},
    case::Case,
    error::{Error, Result},
    parallel,
    record::PairSummary,
    scene::Plan,
    schwarz::{Coarse, Coupling, PairRows},
    step::{Engine, Found, Scene, State, Target},
};

/// A contact solve from the assembled matrices to the displacements of all bodies; the same on all ranks.
#[derive(Debug, Clone)]
pub struct ContactSolve {
    /// Unknowns of all bodies.
    pub dofs: usize,
    /// Wall seconds, the largest over the ranks; meshing and assembly are left out.
    pub seconds: f64,
    /// Where they go.
    pub split: ContactSplit,
    /// True if it ended with a solution.
    pub converged: bool,
    /// Alternations.
    pub alternations: usize,
    /// Updates of the active set.
    pub updates: usize,
    /// What the pairs transmit.
    pub pairs: Vec<PairSummary>,
}

/// Seconds of the parts of a contact solve, each the largest over the ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactSplit {
    /// Factorisation of the stiffness matrices, with the Schur complements of the interfaces.
    pub factor: f64,
    /// Loads condensed to the interfaces.
    pub condense: f64,
    /// Interface operators: made and factorised.
    pub interface: f64,
    /// Contact search and rows.
    pub search: f64,
    /// The driver, but for the interface operators.
    pub alternate: f64,
    /// Displacements of the interiors.
    pub recover: f64,
}

impl ContactSolve {
    /// Solves a case of one load step. Collective.
    pub fn run(case: &Case, plan: &Plan) -> Result<ContactSolve> {
        let exchange = plan.exchange(case);
        let mut engine = Engine::new(case, plan, &exchange)?;
        let cost = |engine: &Engine| {
            engine.bodies().iter().map(|b| b.cost()).fold(Cost::default(), |sum, c| Cost {
                factor: sum.factor + c.factor,
                condense: sum.condense + c.condense,
                interface: sum.interface + c.interface,
                ..sum
            })
        };
        let before = cost(&engine);
        let scene = Scene { case, plan, exchange: &exchange };
        let found = engine.advance(&scene, &State::start(), Target::FULL, |_| {})?.found;
        let (after, clock) = (cost(&engine), engine.clock);
        let in_step = after.interface + after.condense - before.interface - before.condense;
        let seconds = [
            clock.search + clock.factorise + clock.step,
            after.factor,
            after.condense,
            after.interface,
            clock.search,
            clock.step - clock.recover - in_step,
            clock.recover,
        ];
        Self::of(case, plan, found, &seconds)
    }

    /// With the seconds of this rank, in all and of the parts. Collective.
    fn of(case: &Case, plan: &Plan, found: Found, seconds: &[f64]) -> Result<ContactSolve> {
        let world = &plan.groups.world;
        let s = parallel::max(world, seconds);
        let (pairs, _) = pair_results(case, &found, world, &mut Vec::new());
        let counts = Counts::of(world, &found);
        Ok(ContactSolve {
            dofs: plan.dofs.iter().sum(),
            seconds: s[0],
            split: ContactSplit {
                factor: s[1],
                condense: s[2],
                interface: s[3],
                search: s[4],
                alternate: s[5],
                recover: s[6],
            },
            converged: found.reason.converged(),
            alternations: counts.alternations as usize,
            updates: counts.updates as usize,
            pairs,
        })
    }
}

/// The bodies of a case on one rank, joined on the contact rows that they begin with: for drivers to be tried on.
pub fn on_contact_rows<T>(
    case: &Case,
    plan: &Plan,
    look: impl FnOnce(&mut Coupling<Response>, &[PairRows], &Coarse) -> Result<T>,
) -> Result<T> {
    let exchange = plan.exchange(case);
    let mut engine = Engine::new(case, plan, &exchange)?;
    engine
        .on_rows(&exchange, look)
        .ok_or_else(|| Error::internal("only the first rank holds contact rows"))?
}
