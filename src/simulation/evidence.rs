//! The verdict of a step by what can be measured on its result, whatever the alternation says of itself.
use super::{
    checks::{OfBodies, SCENE, tension},
    plausible::Motions,
};
use crate::{
    case::Case,
    output::Piece,
    parallel,
    record::{Checks, EnergySummary, PairSummary, Reason},
    step::Found,
    vector::{all_finite, larger, ratio, worst},
};
use mpi::{topology::SimpleCommunicator, traits::*};

/// A check may be this many tolerances, which the alternation measures by norms of its own.
const TOLERANCES: f64 = 10.0;

/// What may be missing to the balance of energies, over the largest: round-off adds up along a path, and bodies that move far have more
/// of it.
const ENERGY: f64 = 1e-6;

/// What a step has to show.
pub(super) struct Evidence<'r> {
    pub case: &'r Case,
    pub checks: &'r Checks,
    pub bodies: &'r OfBodies,
    pub motions: &'r Motions,
    /// The same on all ranks.
    pub pairs: &'r [PairSummary],
    /// Where surfaces rub.
    pub energy: Option<&'r EnergySummary>,
    /// Fields on this rank.
    pub piece: &'r Piece,
}

impl Evidence<'_> {
    /// Takes the verdict back where the evidence contradicts it. Collective.
    pub fn decide(&self, found: &mut Found, world: &SimpleCommunicator) {
        let (what, fields) = (self.not_finite(), self.fields_are_finite(world));
        let (approach, tensions) = (Self::approach(found, world), self.tensions(found, world));
        if what.is_none() && fields {
            if found.reason.converged() {
                let lines = self.contradictions(found, approach, &tensions);
                if !lines.is_empty() {
                    found.reason = Reason::ChecksFailed;
                    found.diagnosis.extend(lines);
                }
            }
            return;
        }
        let what = what.unwrap_or_else(|| "a displacement, strain or stress".into());
        if found.reason.converged() {
            found.reason = Reason::NotFinite;
        }
        if found.reason == Reason::NotFinite && world.rank() == 0 {
            found.diagnosis.push(format!("{what} is not a finite number"));
        }
    }

    /// Largest elastic approach of a pair, m. Collective.
    fn approach(found: &Found, world: &SimpleCommunicator) -> f64 {
        parallel::max(world, &[worst(found.ends.iter().map(|end| end.approach))])[0]
    }

    /// Largest tension over the largest pressure, of each pair. Collective.
    fn tensions(&self, found: &Found, world: &SimpleCommunicator) -> Vec<f64> {
        let mut tensions = vec![0.0; self.pairs.len()];
        found.ends.iter().filter(|end| end.counts).for_each(|end| tensions[end.pair] = tension(&end.table));
        parallel::max(world, &tensions)
    }

    /// The checks that are above what the tolerance, and round-off where that ended the alternation, allow. The tolerance
    /// is that of rank 0.
    fn contradictions(&self, found: &Found, approach: f64, tensions: &[f64]) -> Vec<String> {
        let accuracy = larger(found.tolerance, found.round_off.unwrap_or(0.0));
        let limit = TOLERANCES * accuracy;
        let mut lines = self.motions.contradictions(self.case);
        let mut hold = |subject: String, what: &str, value: f64| {
            if value > limit {
                lines.push(format!("{subject}: {what} is {value:.1e}, above {TOLERANCES} times the tolerance of {accuracy:.1e}"));
            }
        };
        for (body, checks) in std::iter::zip(&self.case.bodies, &self.bodies.bodies) {
            let [residual, resultant] = checks.proven;
            let subject = || format!("body '{}'", body.name);
            hold(subject(), "the residual of equilibrium, over its nodal forces,", residual);
            hold(
                subject(),
                "the resultant of its loads, contact and support forces, over their sum,",
                resultant,
            );
        }
        for (pair, tension) in std::iter::zip(self.pairs, tensions) {
            // Of a pair that carries round-off every ratio is one of round-off.
            if pair.normal_force.abs() <= SCENE * self.bodies.largest_force
                || self.bodies.largest_force == 0.0
            {
                continue;
            }
            let subject = || format!("contact '{}'", pair.name);
            hold(subject(), "the complementarity of pressure and gap", pair.complementarity);
            hold(subject(), "the difference of action and reaction", pair.force_imbalance);
            hold(subject(), "the tension, over the largest pressure,", *tension);
            if let Some(friction) = &pair.friction {
                hold(
                    subject(),
                    "the tangential force beyond its bound, over the largest force,",
                    friction.beyond_bound,
                );
                hold(subject(), "the slip against its law, over the largest slip,", friction.wrong_slip);
            }
            // A norm over the nodes in contact is what the alternation brings down.
            let norm = approach * (pair.active as f64).sqrt();
            let beyond = larger(pair.max_penetration - found.gap_threshold, 0.0);
            hold(subject(), "the penetration, over the elastic approach,", ratio(beyond, norm));
        }
        let limit = larger(limit, ENERGY);
        if let Some(energy) = self.energy.filter(|energy| energy.imbalance > limit) {
            let missing = energy.imbalance;
            lines.push(format!(
                "the path: {missing:.1e} of the largest energy is missing to their balance, above {limit:.1e}"
            ));
        }
        lines
    }

    /// The first number of the checks or the pairs that is not finite.
    fn not_finite(&self) -> Option<String> {
        let c = self.checks;
        let checks = [
            ("residual", c.residual),
            ("equilibrium", c.equilibrium),
            ("virtual work", c.virtual_work),
            ("tension", c.tension),
            ("complementarity", c.complementarity),
            ("action and reaction", c.action_reaction),
            ("penetration", c.penetration),
            ("energies", self.energy.map_or(0.0, |energy| energy.imbalance)),
        ];
        let of_pair = |p: &PairSummary| {
            let numbers = [
                ("normal force", p.normal_force),
                ("resultant", p.resultant.iter().sum()),
                ("moment", p.moment),
                ("largest pressure", p.max_pressure),
                ("contact length", p.contact_length),
            ];
            let (what, _) = numbers.into_iter().find(|(_, v)| !v.is_finite())?;
            Some(format!("contact '{}': the {what}", p.name))
        };
        let of_pairs = self.pairs.iter().find_map(of_pair);
        of_pairs.or_else(|| {
            let (what, _) = checks.into_iter().find(|(_, v)| !v.is_finite())?;
            Some(format!("the check of {what}"))
        })
    }

    /// True if every field on every rank is. Collective.
    fn fields_are_finite(&self, world: &SimpleCommunicator) -> bool {
        // Temperatures are input, and none where a body has none; errors are not estimated for every step.
        let fields = self.piece.point_fields.iter().chain(&self.piece.cell_fields);
        let finite =
            fields.filter(|f| f.unit != "K" && f.name != "error_density").all(|f| all_finite(&f.values));
        parallel::max(world, &[f64::from(u8::from(!finite))])[0] == 0.0
    }
}
