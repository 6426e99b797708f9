//! `summary.json`: the run in numbers, for scripts. Its keys are a public interface, versioned by `schema`.
use super::{Driver, LoadStep, Reason, Transfer};
use crate::error::{Error, Result};
use serde::Serialize;
use std::collections::BTreeMap;

/// Nodes in contact that make a pressure: with fewer there is none between the two ends of the contact, and what there is
/// grows as the cells shrink.
pub const RESOLVED_NODES: u64 = 3;

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
    /// Stands for all that the run depends on, files included: the same text, the same input.
    pub input: String,
    /// True if the result is a solution: every step converged.
    pub converged: bool,
    /// How the alternation ended, of the last step.
    pub reason: Reason,
    /// What brought the bodies to agree.
    pub driver: Driver,
    /// What carried displacements and forces across the interfaces.
    pub transfer: Transfer,
    /// Alternations made, in all steps.
    pub alternations: u64,
    /// Updates of the active set, in all steps.
    pub updates: u64,
    /// Force steps: all bodies answered contact forces with displacements.
    pub force_steps: u64,
    /// Displacement steps: all bodies, or their approximations, answered gaps with contact forces.
    pub displacement_steps: u64,
    /// What the rank groups sent each other.
    pub exchange: ExchangeSummary,
    /// Tolerance of the stop test.
    pub tolerance: f64,
    /// True if it followed the discretisation error.
    pub tolerance_automatic: bool,
    /// Largest relative residual of the equilibrium of a body.
    #[serde(skip_serializing_if = "not_finite")]
    pub residual: f64,
    /// Ranks of the run.
    pub ranks: usize,
    /// Discretisation error after the last step.
    pub error_estimate: ErrorEstimate,
    /// The bodies, in file order.
    pub bodies: Vec<BodySummary>,
    /// Rigid motions that neither supports nor contact hold, and that no load drives: held at zero.
    pub free_modes: Vec<FreeMode>,
    /// Rigid motions that the supports leave free and contact holds.
    pub held_modes: Vec<FreeMode>,
    /// The contact pairs after the last step, in file order.
    pub pairs: Vec<PairSummary>,
    /// The probes after the last step, in file order.
    pub probes: Vec<ProbeSummary>,
    /// Where the work went in all steps; only where surfaces rub.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergySummary>,
    /// What has yielded by the last step; only where bodies can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plasticity: Option<PlasticitySummary>,
    /// The load steps that were run; only if the case has a table of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<Vec<StepSummary>>,
    /// Invariants every run must satisfy.
    pub checks: Checks,
    /// Sizes of forces and displacements.
    pub plausibility: Plausibility,
    /// Wall seconds.
    pub seconds: Seconds,
    /// Memory, MB, at its peak, sum over the ranks.
    #[serde(skip_serializing_if = "not_finite")]
    pub peak_memory_mb: f64,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// What went wrong, where, and what to do about it; empty if the result is a solution.
    pub diagnosis: Vec<String>,
    /// Rounds of adaptive refinement; only if it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adapt: Option<Vec<AdaptRound>>,
    /// True if the last round's estimate is below the target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adapt_reached: Option<bool>,
}

/// A solve of an adaptive run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct AdaptRound {
    /// Unknowns of all bodies, those that hang included.
    pub dofs: u64,
    /// Estimated error in the energy norm, relative.
    #[serde(skip_serializing_if = "not_finite")]
    pub energy: f64,
    /// Of the peak contact pressure; absent if nothing touches.
    #[serde(skip_serializing_if = "absent")]
    pub contact_pressure: Option<f64>,
    /// Alternations made.
    pub alternations: u64,
    /// Wall seconds.
    pub seconds: f64,
}

/// Estimated discretisation error of the whole, relative.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ErrorEstimate {
    /// In the energy norm: |e| / sqrt(|u_h|^2 + |e|^2).
    #[serde(skip_serializing_if = "not_finite")]
    pub energy: f64,
    /// Of the peak contact pressure, the largest of the pairs; absent if nothing touches.
    #[serde(skip_serializing_if = "absent")]
    pub contact_pressure: Option<f64>,
}

/// What the rank groups sent each other, sums over the ranks; nothing where one rank has all bodies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct ExchangeSummary {
    /// Messages from group to group.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Reductions over the groups.
    pub reductions: u64,
}

/// A rigid motion of a body that its supports leave free.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeMode {
    /// Name of the body.
    pub body: String,
    /// The motion, in words.
    pub mode: String,
}

/// A load step in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepSummary {
    /// Name, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Factor on the loads.
    pub loads: f64,
    /// Factor on the prescribed displacements.
    pub supports: f64,
    /// Factor on temperature less reference temperature.
    pub temperature: f64,
    /// Path parameter; only if a load path has a table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// Factors of the load paths; only if the case has any.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub paths: BTreeMap<String, f64>,
    /// Increments that led to it.
    pub increments: u64,
    /// How the alternation ended.
    pub reason: Reason,
    /// True if the step is a solution.
    pub converged: bool,
    /// Alternations made.
    pub alternations: u64,
    /// Updates of the active set.
    pub updates: u64,
    /// Tolerance of its stop test.
    pub tolerance: f64,
    /// The contact pairs, in file order.
    pub pairs: Vec<PairSummary>,
    /// The probes, in file order.
    pub probes: Vec<ProbeSummary>,
    /// Where the work went so far; only where surfaces rub or bodies can yield.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergySummary>,
    /// What has yielded; only where bodies can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plasticity: Option<PlasticitySummary>,
    /// Discretisation error at its end, if it was estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_estimate: Option<ErrorEstimate>,
}

/// What bodies have yielded, and how it was found.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PlasticitySummary {
    /// Iterations of the step: contact problems of linear bodies.
    pub iterations: u64,
    /// Largest residual of equilibrium of a body, over its nodal forces, after each iteration of the last increment.
    pub residuals: Vec<f64>,
    /// Factorisations of stiffness matrices, by all bodies so far.
    pub factorisations: u64,
    /// Share of all cells in which plastic strain grows in the last increment.
    pub plastic_fraction: f64,
    /// Largest equivalent plastic strain at a point.
    pub max_plastic_strain: f64,
    /// The bodies that can yield.
    pub bodies: Vec<BodyPlasticity>,
}

/// What a body has yielded.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct BodyPlasticity {
    /// Name.
    pub name: String,
    /// Share of its volume that has plastic strain.
    pub plastic_volume: f64,
    /// Largest equivalent plastic strain at a point.
    pub max_plastic_strain: f64,
    /// Plastic work so far, J.
    pub work: f64,
    /// Share of its cells in which plastic strain grows in the last increment.
    pub plastic_fraction: f64,
    /// Share of its cells that were iterated; 1: all.
    pub zone_fraction: f64,
}

/// Energies of all bodies since the start: external + heat = stored + dissipated + plastic.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EnergySummary {
    /// Work of loads and supports, and of putting together surfaces that overlap at the start, J.
    #[serde(skip_serializing_if = "not_finite")]
    pub external: f64,
    /// What heat has changed of the elastic energy beyond the work of the stresses, J; only of heated bodies.
    #[serde(skip_serializing_if = "absent")]
    pub heat: Option<f64>,
    /// Elastic energy, J.
    #[serde(skip_serializing_if = "not_finite")]
    pub stored: f64,
    /// Work of friction, J; only where surfaces rub.
    #[serde(skip_serializing_if = "absent")]
    pub dissipated: Option<f64>,
    /// Plastic work, J: what hardening stores is part of it; only where bodies can yield.
    #[serde(skip_serializing_if = "absent")]
    pub plastic: Option<f64>,
    /// What is missing to the balance, over the largest of these so far, -.
    #[serde(skip_serializing_if = "not_finite")]
    pub imbalance: f64,
}

impl StepSummary {
    /// A step and what was found at its end.
    pub fn new(
        step: &LoadStep,
        tolerance: f64,
        pairs: Vec<PairSummary>,
        probes: Vec<ProbeSummary>,
        error_estimate: Option<ErrorEstimate>,
    ) -> Self {
        let LoadStep { name, loads, supports, temperature, at, paths, increments, .. } = step.clone();
        let LoadStep { reason, alternations, updates, .. } = *step;
        let converged = reason.converged();
        StepSummary {
            name,
            loads,
            supports,
            temperature,
            at,
            paths,
            increments,
            reason,
            converged,
            alternations,
            updates,
            tolerance,
            pairs,
            probes,
            energy: None,
            plasticity: None,
            error_estimate,
        }
    }
}

/// How a body answers contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Response {
    /// By the dense matrix of its interface.
    #[default]
    Condensed,
    /// By its solver, anew for each answer.
    Solver,
    /// Not at all: it is rigid.
    Rigid,
}

/// The side of a pair, as its surfaces are listed in the case.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum PairSide {
    #[default]
    A,
    B,
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
    /// How it answers contact.
    pub response: Response,
    /// Degrees of freedom of its contact surfaces, those of its dense matrix.
    pub interface_dofs: u64,
    /// Solves with its factorisation or its iterative solver.
    pub solves: u64,
    /// Estimated discretisation error in the energy norm, relative; absent for a rigid body.
    #[serde(skip_serializing_if = "absent")]
    pub error_estimate: Option<f64>,
    /// Elastic energy after the last step, J: half the integral of stress times elastic strain.
    #[serde(skip_serializing_if = "absent")]
    pub strain_energy: Option<f64>,
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

/// What a reader can judge a result by: the largest of all steps; what has nothing to be compared with is absent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Plausibility {
    /// Largest normal force of a pair over what acts from outside: the sum of the sizes of the nodal loads and of the
    /// resultants of the bodies' supports. Interference and heat press bodies together without either.
    #[serde(skip_serializing_if = "absent")]
    pub carried_over_applied: Option<f64>,
    /// Largest displacement of a body's node over the larger side of the body's box.
    #[serde(skip_serializing_if = "absent")]
    pub displacement_over_size: Option<f64>,
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
    /// Moment of the contact forces on side A about the origin, N m, counter-clockwise.
    #[serde(skip_serializing_if = "not_finite")]
    pub moment: f64,
    /// The side that carries the unknown contact forces.
    pub multiplier_side: PairSide,
    /// Largest nodal pressure, Pa.
    #[serde(skip_serializing_if = "not_finite")]
    pub max_pressure: f64,
    /// Estimated discretisation error of the peak pressure, relative to it; absent if nothing touches.
    #[serde(skip_serializing_if = "absent")]
    pub error_estimate: Option<f64>,
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
    /// Of a pair with a tangential law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<FrictionSummary>,
    /// Mean contraction measured, an alternation, -.
    #[serde(skip_serializing_if = "absent")]
    pub contraction: Option<f64>,
    /// Nodes of the multiplier side in contact.
    pub active: u64,
    /// Nodes that could be and are not.
    pub open: u64,
    /// Nodes that could be.
    pub candidates: u64,
}

/// What the surfaces of a pair do along each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrictionSummary {
    /// The law.
    pub law: String,
    /// Sum of the tangential forces on the side of the multipliers, along its outward normal turned by 90 degrees against the clock,
    /// N.
    #[serde(skip_serializing_if = "not_finite")]
    pub force: f64,
    /// Work of friction in all load steps so far, J.
    #[serde(skip_serializing_if = "not_finite")]
    pub dissipated: f64,
    /// Lengths that stick and that slip, as the nodes' shares of the surface, m.
    #[serde(skip_serializing_if = "not_finite")]
    pub stick_length: f64,
    #[allow(missing_docs)]
    #[serde(skip_serializing_if = "not_finite")]
    pub slip_length: f64,
    /// Nodes that stick and that slip.
    pub sticking: u64,
    #[allow(missing_docs)]
    pub slipping: u64,
    /// Largest slip of a node, all load steps together, m.
    #[serde(skip_serializing_if = "not_finite")]
    pub max_slip: f64,
    /// Largest tangential force of a node beyond what the law allows, over the largest force of a node, or 1e-12 of that of all pairs, -.
    #[serde(skip_serializing_if = "not_finite")]
    pub beyond_bound: f64,
    /// Largest slip of a node against its law (with the tangential force, or of one that sticks), over the largest slip or the
    /// elastic approach, -.
    #[serde(skip_serializing_if = "not_finite")]
    pub wrong_slip: f64,
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

/// Wall seconds of the stages of a run, means over the ranks, each without those inside it: they add up to the total.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Seconds {
    /// Meshes, surfaces, partitions.
    pub setup: f64,
    /// Facing surfaces found, and the transfer between them.
    pub search: f64,
    pub assemble: f64,
    pub factor: f64,
    /// Dense matrices of the interfaces.
    pub condense: f64,
    /// The driver of the contact.
    pub alternate: f64,
    /// Displacements of the interiors, strains, stresses and the checks made of them.
    pub recover: f64,
    pub estimate: f64,
    /// Result files and pictures.
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
            response: Response::Solver,
            interface_dofs: 6,
            solves: 7,
            error_estimate: Some(0.01),
            strain_energy: Some(2.5),
        };
        let pair = PairSummary {
            name: "p".into(),
            normal_force: 1.0,
            resultant: vec![0.0, 1.0],
            moment: 0.5,
            multiplier_side: PairSide::B,
            max_pressure: 2.0,
            error_estimate: Some(0.02),
            contact_length: 3.0,
            max_penetration: 0.0,
            force_imbalance: 1e-12,
            complementarity: 0.0,
            friction: None,
            contraction: Some(0.2),
            active: 4,
            open: 2,
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
            input: "00c0ffee".into(),
            converged: true,
            reason: Reason::MaxAlternations,
            driver: Driver::ActiveSet,
            transfer: Transfer::Mortar,
            alternations: 5,
            updates: 2,
            force_steps: 6,
            displacement_steps: 5,
            exchange: ExchangeSummary::default(),
            tolerance: 1e-8,
            tolerance_automatic: true,
            residual: 1e-14,
            error_estimate: ErrorEstimate { energy: 0.01, contact_pressure: Some(0.02) },
            ranks: 2,
            bodies: vec![body],
            free_modes: vec![FreeMode { body: "upper".into(), mode: "translation along x".into() }],
            held_modes: Vec::new(),
            pairs: vec![pair],
            probes: vec![probe],
            energy: None,
            plasticity: None,
            steps: None,
            checks: Checks {
                residual: 1e-12,
                equilibrium: 0.0,
                virtual_work: f64::NAN,
                tension: 0.0,
                complementarity: 0.0,
                action_reaction: 0.0,
                penetration: 0.0,
            },
            plausibility: Plausibility::default(),
            seconds: Seconds::default(),
            peak_memory_mb: 12.5,
            warnings: vec![],
            diagnosis: vec![],
            adapt: None,
            adapt_reached: None,
        }
    }

    fn keys(value: &Value) -> Vec<&str> {
        value.as_object().unwrap().keys().map(String::as_str).collect()
    }

    #[test]
    fn keys_are_those_promised() {
        let json: Value = serde_json::from_str(&summary().to_json().unwrap()).unwrap();
        let top = "alternations bodies case checks converged diagnosis displacement_steps driver error_estimate exchange force_steps free_modes held_modes input kontakt \
                   pairs peak_memory_mb plausibility probes ranks reason residual schema seconds tolerance tolerance_automatic transfer updates variant warnings";
        assert_eq!(keys(&json).join(" "), top);
        assert_eq!(
            keys(&json["bodies"][0]).join(" "),
            "dofs error_estimate factorisations interface_dofs interface_factorisations name ranks response solves strain_energy"
        );
        let pair = "active candidates complementarity contact_length contraction error_estimate force_imbalance max_penetration max_pressure \
                    moment multiplier_side name normal_force open resultant";
        assert_eq!(keys(&json["pairs"][0]).join(" "), pair);
        assert_eq!(keys(&json["probes"][0]).join(" "), "body displacement name stress temperature x");
        assert_eq!(keys(&json["probes"][0]["stress"]).join(" "), "xx xy yy zz");
        assert_eq!(
            keys(&json["seconds"]).join(" "),
            "alternate assemble condense estimate factor recover search setup total write"
        );
        assert_eq!((&json["schema"], &json["reason"]), (&json!(1), &json!("max_alternations")));
        assert_eq!((&json["driver"], &json["transfer"]), (&json!("active_set"), &json!("mortar")));
        assert_eq!(json["bodies"][0]["response"], "solver");
        assert_eq!(json["pairs"][0]["multiplier_side"], "b");
        assert_eq!(keys(&json["free_modes"][0]).join(" "), "body mode");
    }

    #[test]
    fn a_table_of_steps_adds_a_key() {
        let mut summary = summary();
        let load_step = LoadStep {
            name: None,
            loads: 0.5,
            supports: 1.0,
            temperature: 1.0,
            at: None,
            paths: BTreeMap::new(),
            increments: 3,
            reason: Reason::Stalled,
            alternations: 3,
            updates: 2,
        };
        summary.steps = Some(vec![StepSummary::new(
            &load_step,
            1e-8,
            summary.pairs.clone(),
            vec![],
            Some(summary.error_estimate),
        )]);
        let json: Value = serde_json::from_str(&summary.to_json().unwrap()).unwrap();
        let step = "alternations converged error_estimate increments loads pairs probes reason supports temperature tolerance updates";
        assert_eq!(keys(&json["steps"][0]).join(" "), step);
        assert_eq!(json["steps"][0]["converged"], false);
        let paths = [("shear".to_string(), 0.25), ("preload".to_string(), 1.0)].into();
        let of_paths = LoadStep { at: Some(1.5), paths, ..load_step };
        summary.steps = Some(vec![StepSummary::new(&of_paths, 1e-8, vec![], vec![], None)]);
        let json: Value = serde_json::from_str(&summary.to_json().unwrap()).unwrap();
        assert_eq!(json["steps"][0]["at"], 1.5);
        assert_eq!(json["steps"][0]["paths"], json!({ "preload": 1.0, "shear": 0.25 }));
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
}
