//! How an alternation ends, and what to tell the user about it.
use serde::{Deserialize, Serialize};

/// What brings the bodies to agree.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Driver {
    /// Active set outside, preconditioned conjugate gradients inside.
    #[default]
    ActiveSet,
    /// The paper's alternation with correction weights.
    Relaxed,
}

/// What carries displacements and forces across an interface.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Transfer {
    /// Integrals over the interface.
    #[default]
    Mortar,
    /// Nodes and their conjugate points.
    Pointwise,
}

/// How an alternation can end: a closed list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// All criteria are met.
    Converged,
    /// The bodies do not touch.
    Open,
    /// There is no contact pair.
    NoContact,
    /// All contact nodes were released while the bodies still penetrate.
    Emptied,
    /// The active set recurs.
    Cycling,
    /// The jump grows.
    Diverging,
    /// The jump stopped falling.
    Stalled,
    /// The displacements agree, the forces do not.
    Unbalanced,
    /// All agrees, but nodes outside the active set penetrate.
    Penetration,
    /// The limit was reached.
    MaxAlternations,
    /// A body answered, or the result has, what is not a finite number.
    NotFinite,
    /// The alternation ended as it should, but the checks of its result contradict it.
    ChecksFailed,
    /// No state of the contact nodes was found that satisfies the laws of friction.
    NoState,
    /// No stresses were found in bodies that yield that are in equilibrium with their loads.
    NoEquilibrium,
}

impl Reason {
    /// Every reason.
    pub const ALL: [Reason; 14] = [
        Reason::Converged,
        Reason::Open,
        Reason::NoContact,
        Reason::Emptied,
        Reason::Cycling,
        Reason::Diverging,
        Reason::Stalled,
        Reason::Unbalanced,
        Reason::Penetration,
        Reason::MaxAlternations,
        Reason::NotFinite,
        Reason::ChecksFailed,
        Reason::NoState,
        Reason::NoEquilibrium,
    ];

    /// True if the result is a solution: exit code 0, otherwise 3.
    pub fn converged(self) -> bool {
        matches!(self, Reason::Converged | Reason::Open | Reason::NoContact)
    }

    /// Name in `summary.json`.
    pub fn name(self) -> &'static str {
        match self {
            Reason::Converged => "converged",
            Reason::Open => "open",
            Reason::NoContact => "no_contact",
            Reason::Emptied => "emptied",
            Reason::Cycling => "cycling",
            Reason::Diverging => "diverging",
            Reason::Stalled => "stalled",
            Reason::Unbalanced => "unbalanced",
            Reason::Penetration => "penetration",
            Reason::MaxAlternations => "max_alternations",
            Reason::NotFinite => "not_finite",
            Reason::ChecksFailed => "checks_failed",
            Reason::NoState => "no_state",
            Reason::NoEquilibrium => "no_equilibrium",
        }
    }

    /// Bytes of the longest name.
    pub(crate) fn widest() -> usize {
        Reason::ALL.into_iter().map(|reason| reason.name().len()).max().unwrap_or(0)
    }

    /// The reason of this name.
    pub fn named(name: &str) -> Option<Reason> {
        Reason::ALL.into_iter().find(|reason| reason.name() == name)
    }

    /// One sentence: what happened.
    pub fn explanation(self, driver: Driver) -> &'static str {
        use Driver::{ActiveSet, Relaxed};
        match (self, driver) {
            (Reason::Converged, _) => "Displacements, forces and the active set agree within the tolerance.",
            (Reason::Open, _) => "The bodies do not touch: nothing penetrates and no contact force acts.",
            (Reason::NoContact, _) => "The case has no contact pair: each body was solved once.",
            (Reason::Emptied, _) => "All contact nodes were released although the bodies still penetrate.",
            (Reason::Cycling, _) => {
                "The set of nodes in contact came back to an earlier one without settling."
            }
            (Reason::Diverging, ActiveSet) => {
                "The gap left at the nodes in contact grows from alternation to alternation."
            }
            (Reason::Diverging, Relaxed) => {
                "The displacement jump between the bodies grows from alternation to alternation."
            }
            (Reason::Stalled, ActiveSet) => {
                "The gap left at the nodes in contact stopped falling before it reached the tolerance: round-off, \
                 or the accuracy of a body's solver, hides the rest."
            }
            (Reason::Stalled, Relaxed) => {
                "The displacement jump stopped falling before it reached the tolerance."
            }
            (Reason::Unbalanced, ActiveSet) => {
                "The displacements agree, but the contact forces do not balance the loads of a body that is free to move."
            }
            (Reason::Unbalanced, Relaxed) => {
                "The displacements agree, but the contact forces of the two sides do not balance."
            }
            (Reason::Penetration, _) => {
                "The nodes in contact agree, but others penetrate more than the tolerance allows."
            }
            (Reason::MaxAlternations, _) => {
                "The largest number of alternations was reached before the tolerance."
            }
            (Reason::NotFinite, _) => "A number became too large to be one: the result is worth nothing.",
            (Reason::ChecksFailed, _) => {
                "The alternation came to its end, but the checks of its result contradict it."
            }
            (Reason::NoState, _) => {
                "No state of the contact nodes, open, sticking or slipping, was found that satisfies the laws of friction."
            }
            (Reason::NoEquilibrium, _) => {
                "No stresses that the materials can bear were found in equilibrium with the loads."
            }
        }
    }

    /// One sentence: what to do about it; empty if the result is a solution.
    pub fn advice(self, driver: Driver) -> &'static str {
        use Driver::{ActiveSet, Relaxed};
        match (self, driver) {
            (Reason::Converged | Reason::Open | Reason::NoContact, _) => "",
            (Reason::Emptied, ActiveSet) => {
                "Look at the initial gap and at the loads: they may pull the bodies apart."
            }
            (Reason::Emptied, Relaxed) => {
                "Use the weights \"response\", or smaller constant ones, and look at the initial gap."
            }
            (Reason::Cycling, ActiveSet) => {
                "Refine the mesh at the edge of the contact, or apply the loads in several steps."
            }
            (Reason::Cycling, Relaxed) => {
                "Refine the mesh at the edge of the contact, or use smaller constant weights."
            }
            (Reason::Diverging, ActiveSet) => {
                "With exact answers of the bodies it cannot grow: make their solvers more accurate, and look for \
                 surfaces in contact whose nodes are prescribed."
            }
            (Reason::Diverging, Relaxed) => {
                "The stiffer body must take the smaller correction: use the weights \"response\" or \"stiffness\"."
            }
            (Reason::Stalled, ActiveSet) => {
                "Raise the tolerance, or make the bodies' solvers more accurate if they are iterative."
            }
            (Reason::Stalled, Relaxed) => {
                "Compare the tolerance with the solver's accuracy, and try other weights."
            }
            (Reason::Unbalanced, ActiveSet) => {
                "Look at what is free to move and at the loads on it, or add a support against that motion."
            }
            (Reason::Unbalanced, Relaxed) => {
                "The nodes of the two surfaces probably do not match, which the pointwise transfer of forces needs: \
                 match the meshes."
            }
            (Reason::Penetration, _) => {
                "Increase the pair's search distance, or refine the mesh near the penetrating nodes."
            }
            (Reason::MaxAlternations, ActiveSet) => {
                "Look at the history: if the gap residual still falls, raise max_alternations; if the contact set \
                 still changes, apply the loads in several steps."
            }
            (Reason::MaxAlternations, Relaxed) => {
                "Look at the history: if the jump still falls, raise max_alternations; if not, try other weights."
            }
            (Reason::NotFinite, _) => {
                "Look for a size, modulus, load, displacement or temperature that is out of all proportion: a power of \
                 ten or a unit too many."
            }
            (Reason::ChecksFailed, _) => {
                "Make the bodies' solvers more accurate if they are iterative, and look for sizes, moduli or supports \
                 that are out of all proportion."
            }
            (Reason::NoState, _) => {
                "Large coefficients of friction may leave no solution, or several: apply the loads in steps, and look whether the \
                 coefficient is right."
            }
            (Reason::NoEquilibrium, _) => {
                "The loads may be beyond the limit load of a body: look at how far they got, and at yield stress, hardening and units; \
                 or apply them in more steps."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_same_everywhere() {
        for reason in Reason::ALL {
            assert_eq!(serde_json::to_value(reason).unwrap(), serde_json::json!(reason.name()));
            assert_eq!(Reason::named(reason.name()), Some(reason));
        }
    }

    #[test]
    fn only_the_relaxed_alternation_speaks_of_weights() {
        for reason in Reason::ALL {
            for driver in [Driver::ActiveSet, Driver::Relaxed] {
                assert_eq!(reason.converged(), reason.advice(driver).is_empty());
                assert!(!reason.explanation(driver).contains("weight"));
            }
            assert!(!reason.advice(Driver::ActiveSet).contains("weight"));
        }
    }
}
