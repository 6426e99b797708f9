//! Invariants every run must satisfy, measured on the run itself.
use crate::step::EndFound;
use crate::vector::{larger, ratio, smaller, worst};
use crate::{body::Balance, parallel, record};
use mpi::topology::SimpleCommunicator;

/// Sum of a balance over the group.
pub(super) fn total(group: &SimpleCommunicator, b: &Balance) -> Balance {
    let parts = [
        &b.residual2[..],
        &b.resultant,
        &[b.moment],
        &b.scale,
        &b.work,
        &b.reaction,
        &[b.noise],
        &b.round_off,
        &[b.applied, b.stored, b.plastic],
    ]
    .concat();
    let s = parallel::sum(group, &parts);
    Balance {
        residual2: [s[0], s[1]],
        resultant: [s[2], s[3], s[4]],
        moment: s[5],
        scale: [s[6], s[7]],
        work: [s[8], s[9], s[10]],
        reaction: [s[11], s[12], s[13]],
        noise: s[14],
        round_off: [s[15], s[16]],
        applied: s[17],
        stored: s[18],
        plastic: s[19],
    }
}

/// No check made yet.
pub(super) fn none() -> record::Checks {
    record::Checks {
        residual: 0.0,
        equilibrium: 0.0,
        virtual_work: 0.0,
        tension: 0.0,
        complementarity: 0.0,
        action_reaction: 0.0,
        penetration: 0.0,
    }
}

/// The worse of each of two steps.
pub(super) fn worse(a: record::Checks, b: record::Checks) -> record::Checks {
    record::Checks {
        residual: larger(a.residual, b.residual),
        equilibrium: larger(a.equilibrium, b.equilibrium),
        virtual_work: larger(a.virtual_work, b.virtual_work),
        tension: larger(a.tension, b.tension),
        complementarity: larger(a.complementarity, b.complementarity),
        action_reaction: larger(a.action_reaction, b.action_reaction),
        penetration: larger(a.penetration, b.penetration),
    }
}

/// Forces below this share of the largest in the scene are what the round-off of that leaves.
pub(super) const SCENE: f64 = 1e-12;

/// A direct solver leaves a residual of a few times eps |K| |u|, sums over the cells of a node included.
const BACKWARD_ERROR: f64 = 100.0;

/// The invariants of one body, each relative to its own forces, or to what counts of the scene's if that is more.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BodyChecks {
    pub residual: f64,
    pub equilibrium: f64,
    pub virtual_work: f64,
    /// Residual and resultant without what round-off may leave.
    pub proven: [f64; 2],
}

/// Invariants of all bodies of the case, known to all ranks.
pub(super) struct OfBodies {
    pub bodies: Vec<BodyChecks>,
    /// Largest sum of the absolute nodal forces of a body that is loaded at all, N.
    pub largest_force: f64,
    /// Sums over the bodies: of the sizes of their nodal loads, and of the resultants of their supports, N.
    pub applied: [f64; 2],
}

impl OfBodies {
    /// `balances`: of this rank's bodies, `numbers`: theirs among the `n` of the case. Collective.
    pub fn new(balances: &[Balance], numbers: &[usize], n: usize, world: &SimpleCommunicator) -> OfBodies {
        let mut forces = vec![[0.0; 2]; n];
        for (b, &number) in std::iter::zip(balances, numbers) {
            forces[number] = [b.applied, b.reaction.iter().map(|c| c * c).sum::<f64>().sqrt()];
        }
        let forces = parallel::max(world, forces.as_flattened());
        let applied = [0, 1].map(|k| forces.iter().skip(k).step_by(2).sum());
        // Ratios of round-off to round-off say nothing.
        let loaded = |b: &&Balance| b.work[2].is_nan() || b.work[2] > b.noise;
        let over = |f: fn(&Balance) -> f64| worst(balances.iter().filter(loaded).map(f));
        let scene = [over(|b| b.residual2[1].sqrt()), over(|b| b.scale[0]), over(|b| b.scale[1])];
        let scene = parallel::max(world, &scene);
        let mut all = vec![[0.0; 5]; n];
        for (b, &number) in std::iter::zip(balances, numbers).filter(|(b, _)| loaded(b)) {
            let scale = |own: f64, k: usize| larger(own, SCENE * scene[k]);
            let (residual, forces) = (b.residual2[0].sqrt(), scale(b.residual2[1].sqrt(), 0));
            let resultant = b.resultant.iter().map(|c| c * c).sum::<f64>().sqrt();
            let force = ratio(resultant, scale(b.scale[0], 1));
            let moment = ratio(b.moment.abs(), scale(b.scale[1], 2));
            let beyond = |value: f64, round_off: f64| larger(value - BACKWARD_ERROR * round_off, 0.0);
            all[number] = [
                ratio(residual, forces),
                larger(force, moment),
                ratio((b.work[0] - b.work[1]).abs(), larger(b.work[2], b.work[0].abs())),
                ratio(beyond(residual, b.round_off[0].sqrt()), forces),
                ratio(beyond(resultant, b.round_off[1]), scale(b.scale[0], 1)),
            ];
        }
        let all = parallel::max(world, all.as_flattened());
        let of_body = |v: &[f64; 5]| BodyChecks {
            residual: v[0],
            equilibrium: v[1],
            virtual_work: v[2],
            proven: [v[3], v[4]],
        };
        OfBodies { bodies: all.as_chunks().0.iter().map(of_body).collect(), largest_force: scene[1], applied }
    }
}

/// Largest tension over the largest pressure of a surface; none where they are bonded.
pub(super) fn tension(side: &record::SideTable) -> f64 {
    if side.bonded {
        return 0.0;
    }
    let lowest = side.pressure.iter().copied().fold(0.0, smaller);
    ratio(-lowest, worst(side.pressure.iter().copied()))
}

/// The invariants of the run, each relative to its own scale. Collective.
pub(super) fn checks(
    of_bodies: &OfBodies,
    pairs: &[record::PairSummary],
    ends: &[EndFound],
    world: &SimpleCommunicator,
) -> record::Checks {
    let tension = worst(ends.iter().filter(|end| end.counts).map(|end| tension(&end.table)));
    let bodies = &of_bodies.bodies;
    record::Checks {
        residual: worst(bodies.iter().map(|b| b.residual)),
        equilibrium: worst(bodies.iter().map(|b| b.equilibrium)),
        virtual_work: worst(bodies.iter().map(|b| b.virtual_work)),
        tension: parallel::max(world, &[tension])[0],
        complementarity: worst(pairs.iter().map(|p| p.complementarity)),
        action_reaction: worst(pairs.iter().map(|p| p.force_imbalance)),
        penetration: worst(pairs.iter().map(|p| p.max_penetration)),
    }
}
