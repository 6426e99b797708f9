//! The verdict of a step by what can be measured on its result, whatever the alternation says of itself.
use crate::{
    output::Piece,
    parallel,
    record::{Checks, PairSummary, Reason},
    step::Found,
    vector::all_finite,
};
use mpi::{topology::SimpleCommunicator, traits::*};

/// What a step has to show.
pub(super) struct Evidence<'r> {
    pub checks: &'r Checks,
    /// The same on all ranks.
    pub pairs: &'r [PairSummary],
    /// Fields on this rank.
    pub piece: &'r Piece,
}

impl Evidence<'_> {
    /// Takes the verdict back where the evidence contradicts it. Collective.
    pub fn decide(&self, found: &mut Found, world: &SimpleCommunicator) {
        let (what, fields) = (self.not_finite(), self.fields_are_finite(world));
        if what.is_none() && fields {
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
        // Temperatures are input, and none where a body has none.
        let fields = self.piece.point_fields.iter().chain(&self.piece.cell_fields);
        let finite = fields.filter(|f| f.unit != "K").all(|f| all_finite(&f.values));
        parallel::max(world, &[f64::from(u8::from(!finite))])[0] == 0.0
    }
}
