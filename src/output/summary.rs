//! `summary.json`: the run in numbers, for scripts. Its keys are a public interface, versioned by `schema`.
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

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
}

impl Reason {
    /// Every reason.
    pub const ALL: [Reason; 10] = [
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
        }
    }

    /// One sentence: what happened.
    pub fn explanation(self) -> &'static str {
        match self {
            Reason::Converged => "Displacements, forces and the active set agree within the tolerance.",
            Reason::Open => "The bodies do not touch: nothing penetrates and no contact force acts.",
            Reason::NoContact => "The case has no contact pair: each body was solved once.",
            Reason::Emptied => "All contact nodes were released although the bodies still penetrate.",
            Reason::Cycling => "The set of nodes in contact came back to an earlier one without settling.",
            Reason::Diverging => {
                "The displacement jump between the bodies grows from alternation to alternation."
            }
            Reason::Stalled => "The displacement jump stopped falling before it reached the tolerance.",
            Reason::Unbalanced => {
                "The displacements agree, but the contact forces of the two sides do not balance."
            }
            Reason::Penetration => {
                "The nodes in contact agree, but others penetrate more than the tolerance allows."
            }
            Reason::MaxAlternations => "The largest number of alternations was reached before the tolerance.",
        }
    }

    /// One sentence: what to do about it; empty if the result is a solution.
    pub fn advice(self) -> &'static str {
        match self {
            Reason::Converged | Reason::Open | Reason::NoContact => "",
            Reason::Emptied => {
                "Use the weights \"response\", or smaller constant ones, and look at the initial gap."
            }
            Reason::Cycling => "Refine the mesh at the edge of the contact, or use smaller constant weights.",
            Reason::Diverging => {
                "The stiffer body must take the smaller correction: use the weights \"response\" or \"stiffness\"."
            }
            Reason::Stalled => "Compare the tolerance with the solver's accuracy, and try other weights.",
            Reason::Unbalanced => {
                "The nodes of the two surfaces probably do not match, which the pointwise transfer of forces needs: \
                 match the meshes."
            }
            Reason::Penetration => {
                "Increase the pair's search distance, or refine the mesh near the penetrating nodes."
            }
            Reason::MaxAlternations => {
                "Look at the history: if the jump still falls, raise max_alternations; if not, try other weights."
            }
        }
    }
}

/// The whole summary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Version of this list of keys.
    pub schema: u32,
    /// Version of kontakt.
    pub kontakt: String,
    /// Name of the case.
    pub case: String,
    /// Variant, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// True if the result is a solution.
    pub converged: bool,
    /// How the alternation ended.
    pub reason: Reason,
    /// Alternations made.
    pub alternations: u64,
    /// Tolerance of the stop test.
    pub tolerance: f64,
    /// Largest relative residual of the equilibrium of a body.
    #[serde(skip_serializing_if = "not_finite")]
    pub residual: f64,
    /// Ranks of the run.
    pub ranks: usize,
    /// The bodies, in file order.
    pub bodies: Vec<BodySummary>,
    /// The contact pairs, in file order.
    pub pairs: Vec<PairSummary>,
    /// The probes, in file order.
    pub probes: Vec<ProbeSummary>,
    /// Invariants every run must satisfy.
    pub checks: Checks,
    /// Wall seconds.
    pub seconds: Seconds,
    /// Memory, MB, at its peak, sum over the ranks.
    #[serde(skip_serializing_if = "not_finite")]
    pub peak_memory_mb: f64,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A body in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodySummary {
    /// Name.
    pub name: String,
    /// Degrees of freedom.
    pub dofs: u64,
    /// Ranks that share it.
    pub ranks: usize,
    /// Factorisations of its stiffness matrix.
    pub factorisations: u64,
    /// Factorisations of the dense compliance of its active contact nodes: one per change of the contact set.
    pub interface_factorisations: u64,
}

/// Invariants of the run, each relative to its own scale but the penetration; what could not be computed is absent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Checks {
    /// Largest residual of a body's free unknowns over the norm of its nodal forces, from the stresses.
    #[serde(skip_serializing_if = "not_finite")]
    pub residual: f64,
    /// Resultant and moment of applied, contact and support forces of a body.
    #[serde(skip_serializing_if = "not_finite")]
    pub equilibrium: f64,
    /// Work of the stresses against work of all forces.
    #[serde(skip_serializing_if = "not_finite")]
    pub virtual_work: f64,
    /// Largest tension over the largest pressure.
    #[serde(skip_serializing_if = "not_finite")]
    pub tension: f64,
    /// Largest complementarity of a pair.
    #[serde(skip_serializing_if = "not_finite")]
    pub complementarity: f64,
    /// Largest |F_A + F_B| / (|F_A| + |F_B|) of a pair.
    #[serde(skip_serializing_if = "not_finite")]
    pub action_reaction: f64,
    /// Largest penetration, m.
    #[serde(skip_serializing_if = "not_finite")]
    pub penetration: f64,
}

/// A contact pair in numbers. What could not be computed is absent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairSummary {
    /// Name.
    pub name: String,
    /// Integral of the pressure over the part modelled, N.
    #[serde(skip_serializing_if = "not_finite")]
    pub normal_force: f64,
    /// Contact force on side A, N.
    #[serde(skip_serializing_if = "any_not_finite")]
    pub resultant: Vec<f64>,
    /// Largest nodal pressure, Pa.
    #[serde(skip_serializing_if = "not_finite")]
    pub max_pressure: f64,
    /// Length in contact, interpolated to zero pressure, m.
    #[serde(skip_serializing_if = "not_finite")]
    pub contact_length: f64,
    /// Largest penetration, m; 0 if there is none.
    #[serde(skip_serializing_if = "not_finite")]
    pub max_penetration: f64,
    /// |F_A + F_B| / (|F_A| + |F_B|), -.
    #[serde(skip_serializing_if = "not_finite")]
    pub force_imbalance: f64,
    /// Largest |pressure x gap| over the product of the largest pressure and the largest gap or travel, -.
    #[serde(skip_serializing_if = "not_finite")]
    pub complementarity: f64,
    /// Nodes in contact, both sides.
    pub active: u64,
    /// Nodes that could be, both sides.
    pub candidates: u64,
}

/// What happens at a probe.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ProbeSummary {
    /// Name.
    pub name: String,
    /// Name of its body.
    pub body: String,
    /// Where it is, undeformed, m.
    pub x: Vec<f64>,
    /// Displacement, m.
    #[serde(skip_serializing_if = "any_not_finite")]
    pub displacement: Vec<f64>,
    /// Stress, Pa.
    pub stress: StressSummary,
    /// Temperature, K, if the body is heated.
    #[serde(skip_serializing_if = "absent")]
    pub temperature: Option<f64>,
}

/// Stress at a probe, Pa.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct StressSummary {
    #[serde(skip_serializing_if = "not_finite")]
    pub xx: f64,
    #[serde(skip_serializing_if = "not_finite")]
    pub yy: f64,
    #[serde(skip_serializing_if = "not_finite")]
    pub zz: f64,
    #[serde(skip_serializing_if = "not_finite")]
    pub xy: f64,
}

/// Wall seconds of the phases, largest over the ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Seconds {
    pub setup: f64,
    pub assemble: f64,
    pub factor: f64,
    pub alternate: f64,
    pub write: f64,
    pub total: f64,
}

impl Summary {
    /// Version of the keys.
    pub const SCHEMA: u32 = 1;

    /// As JSON. A number that is not finite has no JSON: its key is left out.
    pub fn to_json(&self) -> Result<String> {
        let mut text = serde_json::to_string_pretty(self).map_err(Error::internal)?;
        text.push('\n');
        Ok(text)
    }

    /// Writes the file, complete or not at all. Rank 0 does this, when all else is written.
    pub fn write(&self, path: &Path) -> Result<()> {
        super::file::write_complete(path, self.to_json()?.as_bytes())
    }
}

fn not_finite(x: &f64) -> bool {
    !x.is_finite()
}

fn any_not_finite(x: &[f64]) -> bool {
    x.iter().any(|x| !x.is_finite())
}

fn absent(x: &Option<f64>) -> bool {
    x.is_none_or(|x| !x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn summary() -> Summary {
        let body = BodySummary {
            name: "upper".into(),
            dofs: 8,
            ranks: 1,
            factorisations: 2,
            interface_factorisations: 3,
        };
        let pair = PairSummary {
            name: "p".into(),
            normal_force: 1.0,
            resultant: vec![0.0, 1.0],
            max_pressure: 2.0,
            contact_length: 3.0,
            max_penetration: 0.0,
            force_imbalance: 1e-12,
            complementarity: 0.0,
            active: 4,
            candidates: 6,
        };
        let probe = ProbeSummary {
            name: "tip".into(),
            body: "upper".into(),
            x: vec![0.0, 1.0],
            displacement: vec![0.0, 0.1],
            stress: StressSummary { xx: 1.0, yy: 2.0, zz: 3.0, xy: 4.0 },
            temperature: Some(300.0),
        };
        Summary {
            schema: Summary::SCHEMA,
            kontakt: "0.1.0".into(),
            case: "c".into(),
            variant: Some("A".into()),
            converged: true,
            reason: Reason::MaxAlternations,
            alternations: 5,
            tolerance: 1e-8,
            residual: 1e-14,
            ranks: 2,
            bodies: vec![body],
            pairs: vec![pair],
            probes: vec![probe],
            checks: Checks {
                residual: 1e-12,
                equilibrium: 0.0,
                virtual_work: f64::NAN,
                tension: 0.0,
                complementarity: 0.0,
                action_reaction: 0.0,
                penetration: 0.0,
            },
            seconds: Seconds::default(),
            peak_memory_mb: 12.5,
            warnings: vec![],
        }
    }

    fn keys(value: &Value) -> Vec<&str> {
        value.as_object().unwrap().keys().map(String::as_str).collect()
    }

    #[test]
    fn keys_are_those_promised() {
        let json: Value = serde_json::from_str(&summary().to_json().unwrap()).unwrap();
        let top = "alternations bodies case checks converged kontakt pairs peak_memory_mb probes ranks reason residual schema \
                   seconds tolerance variant warnings";
        assert_eq!(keys(&json).join(" "), top);
        assert_eq!(
            keys(&json["bodies"][0]).join(" "),
            "dofs factorisations interface_factorisations name ranks"
        );
        let pair = "active candidates complementarity contact_length force_imbalance max_penetration max_pressure name normal_force \
                    resultant";
        assert_eq!(keys(&json["pairs"][0]).join(" "), pair);
        assert_eq!(keys(&json["probes"][0]).join(" "), "body displacement name stress temperature x");
        assert_eq!(keys(&json["probes"][0]["stress"]).join(" "), "xx xy yy zz");
        assert_eq!(keys(&json["seconds"]).join(" "), "alternate assemble factor setup total write");
        assert_eq!((&json["schema"], &json["reason"]), (&json!(1), &json!("max_alternations")));
    }

    #[test]
    fn what_is_not_known_is_absent() {
        let mut summary = summary();
        summary.variant = None;
        summary.residual = f64::NAN;
        summary.pairs[0].contact_length = f64::INFINITY;
        summary.pairs[0].resultant[0] = f64::NAN;
        summary.probes[0].temperature = Some(f64::NAN);
        summary.probes[0].stress.zz = f64::NAN;
        let text = summary.to_json().unwrap();
        assert!(!text.contains("null"), "{text}");
        let json: Value = serde_json::from_str(&text).unwrap();
        let gone = ["variant", "residual"].iter().all(|key| json.get(key).is_none());
        assert!(gone && json["pairs"][0].get("contact_length").is_none());
    }

    #[test]
    fn names_are_the_same_everywhere() {
        for reason in Reason::ALL {
            assert_eq!(serde_json::to_value(reason).unwrap(), json!(reason.name()));
            assert_eq!(reason.converged(), reason.advice().is_empty());
        }
    }
}
