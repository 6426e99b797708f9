//! Invariants every run must satisfy, measured on the run itself.
use crate::step::EndFound;
use crate::vector::{larger, ratio, smaller};
use crate::{body::Balance, parallel, record};
use mpi::topology::SimpleCommunicator;

/// Sum of a balance over the group.
pub(super) fn total(group: &SimpleCommunicator, b: &Balance) -> Balance {
    let parts =
        [&b.residual2[..], &b.resultant, &[b.moment], &b.scale, &b.work, &b.reaction, &[b.noise]].concat();
    let s = parallel::sum(group, &parts);
    Balance {
        residual2: [s[0], s[1]],
        resultant: [s[2], s[3], s[4]],
        moment: s[5],
        scale: [s[6], s[7]],
        work: [s[8], s[9], s[10]],
        reaction: [s[11], s[12], s[13]],
        noise: s[14],
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
pub(super) fn worst(a: record::Checks, b: record::Checks) -> record::Checks {
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

/// The invariants of the run, each relative to its own scale. Collective.
pub(super) fn checks(
    balances: &[Balance],
    pairs: &[record::PairSummary],
    ends: &[EndFound],
    world: &SimpleCommunicator,
) -> record::Checks {
    let mut worst = [0.0_f64; 4];
    // Ratios of round-off to round-off say nothing.
    for b in balances.iter().filter(|b| b.work[2].is_nan() || b.work[2] > b.noise) {
        worst[0] = larger(worst[0], ratio(b.residual2[0].sqrt(), b.residual2[1].sqrt()));
        let resultant = b.resultant.iter().map(|c| c * c).sum::<f64>().sqrt();
        worst[1] = larger(larger(worst[1], ratio(resultant, b.scale[0])), ratio(b.moment.abs(), b.scale[1]));
        worst[2] = larger(worst[2], ratio((b.work[0] - b.work[1]).abs(), larger(b.work[2], b.work[0].abs())));
    }
    for side in ends.iter().filter(|end| end.counts).map(|end| &end.table) {
        let largest = side.pressure.iter().copied().fold(0.0, larger);
        let lowest = side.pressure.iter().copied().fold(0.0, smaller);
        worst[3] = larger(worst[3], ratio(-lowest, largest));
    }
    let worst = parallel::max(world, &worst);
    record::Checks {
        residual: worst[0],
        equilibrium: worst[1],
        virtual_work: worst[2],
        tension: worst[3],
        complementarity: pairs.iter().map(|p| p.complementarity).fold(0.0, larger),
        action_reaction: pairs.iter().map(|p| p.force_imbalance).fold(0.0, larger),
        penetration: pairs.iter().map(|p| p.max_penetration).fold(0.0, larger),
    }
}
