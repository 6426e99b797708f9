//! Bodies that yield in uniform states: exact answers to bars, blocks, cycles and layers.
use super::{near, rectangle, solve_all, solve_within, value};
use kontakt::{
    output::{Field, Piece, Results},
    vector::larger,
};
use serde_json::Value;

pub(super) const KINDS: [&str; 4] = ["tri3", "tri6", "quad4", "quad8"];

/// What does not lock in plane strain.
pub(super) const FREE_OF_LOCKING: [&str; 3] = ["tri6", "quad4", "quad8"];

/// Yield stress and hardening of the bar, Pa.
const BAR: (f64, f64) = (250e6, 2e9);

/// A case: `top` has its keys that are no tables, and what stands before the bodies.
pub(super) fn case(analysis: &str, material: &str, steps: &str, top: &str, bodies: &str) -> String {
    format!(
        "analysis = \"plane {analysis}\"\nmaterial.m = {{ {material} }}\nstep = [{steps}]\n{top}\n{bodies}"
    )
}

/// A bar 0.1 x 0.04 m under these stresses at its end, MPa, one step for each.
fn bar(analysis: &str, element: &str, material: &str, top: &str, stresses: &[f64]) -> String {
    let steps: Vec<String> = stresses.iter().map(|s| format!("{{ loads = {s} }}")).collect();
    let rest = "support = [{ surface = \"left\", x = 0 }, { point = [0, 0], y = 0 }]\n\
                load = [{ surface = \"right\", traction = [1e6, 0] }]";
    let body = rectangle("b", "m", element, (0.0, 0.1, 3), (0.0, 0.04, 2), rest);
    let top = format!("probe = [{{ name = \"p\", body = \"b\", at = [0.1, 0.04] }}]\n{top}");
    case(analysis, material, &steps.join(", "), &top, &body)
}

fn of_steps(summary: &Value) -> &[Value] {
    summary["steps"].as_array().expect("steps")
}

/// Largest size of a component of a field at the nodes, at the end.
pub(super) fn largest(results: &Results, name: &str) -> f64 {
    let field = results.piece.point_fields.iter().find(|f| f.name == name).expect("the field is there");
    field.values.iter().fold(0.0, |most, v| larger(most, v.abs()))
}

/// V08-1: loaded, loaded further, unloaded; strains along and across, plastic strain and work.
#[test]
fn a_bar_yields_and_unloads() {
    let material = "young = 2e11, poisson = 0.3, plasticity = { yield_stress = 250e6, hardening = 2e9 }";
    for element in KINDS {
        let text = bar("stress", element, material, "", &[260.0, 300.0, 0.0]);
        let (summary, results) = solve_all(&text, 2, &[]);
        for (step, [strain, plastic]) in
            of_steps(&summary).iter().zip([[6.3e-3, 5e-3], [2.65e-2, 2.5e-2], [2.5e-2, 2.5e-2]])
        {
            let across = -0.3 * (strain - plastic) - 0.5 * plastic;
            near(value(step, "probes.p.displacement.0"), 0.1 * strain, 1e-10, element);
            near(value(step, "probes.p.displacement.1"), 0.04 * across, 1e-10, element);
            near(value(step, "plasticity.max_plastic_strain"), plastic, 1e-10, element);
            assert!(value(step, "energy.imbalance") < 1e-9, "{}", step["energy"]);
        }
        assert!(largest(&results, "stress") < 1e-9 * 250e6, "{}", largest(&results, "stress"));
        let unloading = value(&summary, "steps.2.plasticity.iterations");
        near(unloading, 1.0, 0.0, "iterations to no load");
    }
}

/// Loaded to the yield point, then beyond in one increment, which the mean of the stresses at both ends then works in: sy p + H p^2 / 2.
#[test]
fn fields_are_those_of_the_bar() {
    let material = "young = 2e11, poisson = 0.3, plasticity = { yield_stress = 250e6, hardening = 2e9 }";
    let (p, work) = (2.5e-2, 250e6 * 2.5e-2 + 1e9 * 2.5e-2 * 2.5e-2);
    for (stresses, yielding) in [(&[250.0, 300.0][..], 1.0), (&[250.0, 300.0, 100.0], 0.0)] {
        let text = bar("stress", "quad8", material, "", stresses);
        let (summary, results) = solve_all(&text, 2, &[]);
        let all = |fields: &[Field], name: &str, expected: &[f64]| {
            let field = fields.iter().find(|field| field.name == name).expect("the field is there");
            assert!(!field.values.is_empty());
            for (i, found) in field.values.iter().enumerate() {
                let expected = expected[i % expected.len()];
                near(*found, expected, 1e-9 * larger(expected.abs(), p), name);
            }
        };
        let Piece { point_fields, cell_fields, .. } = &results.piece;
        let tensor = [p, -0.5 * p, -0.5 * p, 0.0, 0.0, 0.0];
        for fields in [point_fields, cell_fields] {
            all(fields, "plastic_strain", &tensor);
            all(fields, "equivalent_plastic_strain", &[p]);
        }
        all(cell_fields, "plastic_work", &[work]);
        all(cell_fields, "yielding", &[yielding]);
        let volume = 0.1 * 0.04;
        near(
            value(&summary, "plasticity.bodies.b.work"),
            work * volume,
            1e-9 * work * volume,
            "plastic work",
        );
        near(value(&summary, "energy.plastic"), work * volume, 1e-9 * work * volume, "plastic work");
        near(value(&summary, "plasticity.bodies.b.plastic_volume"), 1.0, 1e-12, "volume");
        near(value(&summary, "plasticity.plastic_fraction"), yielding, 0.0, "cells that yield");
    }
}

/// In plane stress, and in plane strain, where the yield point is that of s (1 - nu + nu^2)^(1/2); nearly incompressible, too.
#[test]
fn the_yield_point_is_sharp() {
    let (sy, hardening) = BAR;
    for (analysis, nu) in [("stress", 0.3_f64), ("stress", 0.4999999), ("strain", 0.3), ("strain", 0.4999999)]
    {
        let material = format!(
            "young = 2e11, poisson = {nu}, plasticity = {{ yield_stress = {sy}, hardening = {hardening} }}"
        );
        let point = 1e-6 * if analysis == "stress" { sy } else { sy / (1.0 - nu + nu * nu).sqrt() };
        for element in FREE_OF_LOCKING {
            let what = format!("{element}, plane {analysis}, nu = {nu}");
            let text = bar(analysis, element, &material, "", &[point * (1.0 - 1e-6), point * (1.0 + 1e-6)]);
            let (summary, _) = solve_within(&text, 1, &[], 1e3);
            near(value(&summary, "steps.0.plasticity.max_plastic_strain"), 0.0, 0.0, &what);
            assert!(value(&summary, "steps.1.plasticity.max_plastic_strain") > 1e-8, "{what}");
            if analysis == "strain" && nu == 0.3 {
                continue;
            }
            // Beyond it, where the direction of the stress stays: p = (f - 1) sigma_y / H.
            let text = bar(analysis, element, &material, "", &[1.1 * point]);
            let (summary, _) = solve_within(&text, 1, &[], 1e3);
            let (found, exact) = (value(&summary, "plasticity.max_plastic_strain"), 0.1 * sy / hardening);
            near(found, exact, 1e-5 * exact, &what);
        }
    }
}

/// Plastic strain with its sign, accumulated, and backstress after each of these stresses along one axis.
fn cycled(stresses: &[f64], hardening: f64, modulus: f64, recall: f64) -> Vec<[f64; 3]> {
    let mut now = [0.0; 3];
    let after = |s: &f64| {
        let [plastic, total, back] = now;
        let sign = (s - back).signum();
        // Armstrong and Frederick's law in closed form at the increment dp of plastic strain.
        let backstress = |dp: f64| match recall {
            0.0 => back + sign * modulus * dp,
            _ => back * (-recall * dp).exp() - sign * modulus / recall * (-recall * dp).exp_m1(),
        };
        let beyond = |dp: f64| sign * (s - backstress(dp)) - (BAR.0 + hardening * (total + dp));
        if beyond(0.0) > 0.0 {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                *(if beyond(middle) > 0.0 { &mut low } else { &mut high }) = middle;
            }
            now = [plastic + sign * low, total + low, backstress(low)];
        }
        now
    };
    stresses.iter().map(after).collect()
}

/// Five half-cycles and no load at the end, isotropic, Prager's, Armstrong and Frederick's hardening and both at once.
#[test]
fn cycles_follow_the_closed_form() {
    let stresses = [300.0, -320.0, 340.0, -360.0, 380.0, 0.0];
    for (hardening, modulus, recall) in
        [(2e9, 0.0, 0.0), (2e9, 5e9, 0.0), (0.0, 5e9, 0.0), (2e9, 5e9, 20.0), (0.0, 20e9, 100.0)]
    {
        let kinematic = match modulus {
            0.0 => String::new(),
            _ => format!(", kinematic = {{ modulus = {modulus}, recall = {recall} }}"),
        };
        let material = format!(
            "young = 2e11, poisson = 0.3, plasticity = {{ yield_stress = 250e6, hardening = {hardening}{kinematic} }}"
        );
        let pa = stresses.map(|s| 1e6 * s);
        let exact = cycled(&pa, hardening, modulus, recall);
        for element in ["quad4", "tri6"] {
            let text = bar("stress", element, &material, "plasticity.tolerance = 1e-12", &stresses);
            let (summary, _) = solve_all(&text, 2, &[]);
            for ((step, s), [plastic, total, _]) in of_steps(&summary).iter().zip(pa).zip(&exact) {
                let what = format!("{element} {hardening} {modulus} {recall}: {s}");
                near(value(step, "probes.p.displacement.0") / 0.1, s / 2e11 + plastic, 1e-11, &what);
                near(value(step, "plasticity.max_plastic_strain"), *total, 1e-11, &what);
            }
        }
    }
}

/// Below its yield stress a body that can yield is the elastic one, and is factorised once.
#[test]
fn below_yield_a_body_is_elastic() {
    let elastic = "young = 2e11, poisson = 0.3";
    let material = format!(
        "{elastic}, plasticity = {{ yield_stress = 250e6, hardening = 2e9, kinematic = {{ modulus = 5e9 }} }}"
    );
    for element in KINDS {
        for ranks in [1, 2] {
            let stresses = [200.0, -240.0, 100.0, 0.0];
            let run =
                |material: &str| solve_all(&bar("stress", element, material, "", &stresses), ranks, &[]);
            let ((a, _), (b, results)) = (run(elastic), run(&material));
            for (a, b) in of_steps(&a).iter().zip(of_steps(&b)) {
                for key in ["displacement.0", "displacement.1"] {
                    let path = format!("probes.p.{key}");
                    near(value(a, &path), value(b, &path), 1e-18, element);
                }
                near(value(a, "probes.p.stress.xx"), value(b, "probes.p.stress.xx"), 1e-4, element);
            }
            assert!(largest(&results, "stress") <= 1e-12 * 240e6, "{element}");
            near(value(&b, "plasticity.factorisations"), 1.0, 0.0, element);
        }
    }
}

/// H13: a free body heated by 300 K at once has neither stress nor plastic strain.
#[test]
fn free_heating_yields_nothing() {
    let material = "young = 2e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 300, plasticity = { yield_stress = 250e6 }";
    let rest =
        "temperature = 600\nsupport = [{ point = [0, 0], x = 0, y = 0 }, { point = [0, 0.04], x = 0 }]";
    for (theory, iteration) in [("flow", "newton"), ("deformation", "newton"), ("deformation", "secant")] {
        for element in KINDS {
            let body = rectangle("b", "m", element, (0.0, 0.1, 5), (0.0, 0.04, 3), rest);
            let top = format!(
                "plasticity = {{ theory = \"{theory}\", iteration = \"{iteration}\" }}\nprobe = [{{ name = \"p\", body = \"b\", at = [0.1, 0.04] }}]"
            );
            let (summary, results) = solve_all(&case("stress", material, "{}", &top, &body), 2, &[]);
            assert!(largest(&results, "stress") <= 1e-9 * 250e6, "{element}");
            near(value(&summary, "plasticity.max_plastic_strain"), 0.0, 0.0, element);
            near(value(&summary, "plasticity.iterations"), 1.0, 0.0, element);
            near(value(&summary, "probes.p.displacement.0"), 0.1 * 12e-6 * 300.0, 1e-15, element);
        }
    }
}

/// A block of one or more cells in plane strain, pressed together by `strain`, free to the right.
fn pressed(element: &str, hardening: f64, strain: f64, top: &str, steps: usize) -> Value {
    let material = format!(
        "young = 2.1e11, poisson = 0.3, plasticity = {{ yield_stress = 240e6, hardening = {hardening} }}"
    );
    let rest = format!(
        "support = [{{ surface = \"left\", x = 0 }}, {{ surface = \"bottom\", y = 0 }}, {{ surface = \"top\", y = -{strain} }}]"
    );
    let cells = if element == "quad8" { 2 } else { 1 };
    let body = rectangle("b", "m", element, (0.0, 1.0, cells), (0.0, 1.0, cells), &rest);
    let top = format!("{top}\nprobe = [{{ name = \"p\", body = \"b\", at = [0.3, 0.4] }}]");
    let text = case("strain", &material, &format!("{{ steps = {steps} }}"), &top, &body);
    solve_within(&text, 1, &[], 10.0).0
}

/// V08-4: first yield, the deformation theory in one step and one increment of the flow theory, which are the same, and the flow
/// theory in so many increments that what is left of its path is small. The rows with hardening are those of 2000 increments.
#[test]
fn plane_strain_compression() {
    let stresses = |summary: &Value| ["yy", "zz"].map(|c| -value(summary, &format!("probes.p.stress.{c}")));
    let yields = |strain: f64| value(&pressed("quad4", 0.0, strain, "", 1), "plasticity.max_plastic_strain");
    near(yields(1.170091e-3 * (1.0 - 1e-6)), 0.0, 0.0, "below the yield point");
    assert!(yields(1.170091e-3 * (1.0 + 1e-6)) > 0.0);
    let table = [
        (0.0, 1.2e-3, [2.703921e8, 8.260251e7], [2.703877e8, 8.258310e7]),
        (0.0, 1.5e-3, [2.732321e8, 9.651386e7], [2.729370e8, 9.488686e7]),
        (0.0, 2e-3, [2.756117e8, 1.127332e8], [2.748756e8, 1.069002e8]),
        (0.0, 3e-3, [2.769136e8, 1.290154e8], [2.761862e8, 1.183221e8]),
        (2.1e9, 3e-3, [2.817728e8, 1.306201e8], [2.810449e8, 1.200204e8]),
        (2.1e9, 1e-2, [3.013489e8, 1.500645e8], [3.012397e8, 1.439510e8]),
    ];
    for (hardening, strain, flow, deformation) in table {
        for element in FREE_OF_LOCKING {
            for top in [
                "plasticity.theory = \"deformation\"",
                "plasticity = { theory = \"deformation\", iteration = \"secant\" }",
                "",
            ] {
                let summary = pressed(element, hardening, strain, top, 1);
                for (found, exact) in stresses(&summary).into_iter().zip(deformation) {
                    near(found, exact, 5e-7 * exact, &format!("{element} {hardening} {strain} {top}"));
                }
            }
        }
        let summary = pressed("quad4", hardening, strain, "", 2000);
        let allowed = if hardening == 0.0 { [5e-6, 1e-4] } else { [2e-7, 2e-7] };
        for ((found, exact), allowed) in stresses(&summary).into_iter().zip(flow).zip(allowed) {
            near(found, exact, allowed * exact, &format!("flow {hardening} {strain}"));
        }
    }
}

/// Layers side by side along the load, one of which yields: each has the stress of its own curve at the common strain.
#[test]
fn layers_side_by_side() {
    for element in KINDS {
        let rest = "support = [{ surface = \"left\", x = 0 }, { surface = \"right\", x = 1e-3 }, { point = [0, 0], y = 0 }]\n\
                    insert = [{ material = \"hard\", within = { y = [0.02, 0.04] } }]";
        let body = rectangle("b", "m", element, (0.0, 0.1, 4), (0.0, 0.04, 4), rest);
        let top = "material.hard = { young = 1e11, poisson = 0.2 }\nprobe = [{ name = \"soft\", body = \"b\", at = [0.05, 0.005] }, \
                   { name = \"hard\", body = \"b\", at = [0.05, 0.035] }, { name = \"top\", body = \"b\", at = [0.1, 0.04] }]";
        let material = "young = 2e11, poisson = 0.3, plasticity = { yield_stress = 250e6, hardening = 2e9 }";
        let (summary, _) = solve_all(&case("stress", material, "{ supports = 0.1 }, {}", top, &body), 2, &[]);
        for (step, strain) in [(0, 1e-3), (1, 1e-2)] {
            let plastic = larger(0.0, (2e11 * strain - 250e6) / (2e11 + 2e9));
            let stress = 2e11 * (strain - plastic);
            let at = |path: &str| value(&summary, &format!("steps.{step}.{path}"));
            near(at("probes.soft.stress.xx"), stress, 1e-8 * stress, element);
            near(at("probes.hard.stress.xx"), 1e11 * strain, 1e-8 * 1e11 * strain, element);
            near(at("plasticity.max_plastic_strain"), plastic, 1e-10, element);
            let across = 0.02 * (-0.3 * (strain - plastic) - 0.5 * plastic) - 0.02 * 0.2 * strain;
            near(at("probes.top.displacement.1"), across, 1e-10, element);
        }
    }
}

/// Layers on each other between smooth walls, under one pressure: Hencky's law of the one that yields, solved for its stress along the
/// walls, gives its strain.
#[test]
fn layers_on_each_other() {
    let (young, nu, sy, hardening, q) = (2e11, 0.3, 250e6, 2e9, 340e6_f64);
    let plastic = |s: f64| ((s * s - s * q + q * q).sqrt() - sy) / hardening;
    // Strains over the plastic strain's share of the deviator: (a - b / 2) p / sigma_i + (a - nu b) / E.
    let strain = |a: f64, b: f64, s: f64| {
        (a - nu * b) / young + (a - 0.5 * b) * plastic(s) / (s * s - s * q + q * q).sqrt()
    };
    let (mut low, mut high) = (nu * q, 0.5 * q);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        *(if strain(middle, q, middle) < 0.0 { &mut low } else { &mut high }) = middle;
    }
    let (soft, hard) = (strain(q, low, low), q * (1.0 - 0.2 * 0.2) / 1e11);
    for element in KINDS {
        let rest = "support = [{ surface = \"left\", x = 0 }, { surface = \"right\", x = 0 }, { surface = \"bottom\", y = 0 }]\n\
                    insert = [{ material = \"hard\", within = { y = [0.03, 0.04] } }]\nload = [{ surface = \"top\", pressure = 340e6 }]";
        let body = rectangle("b", "m", element, (0.0, 0.05, 3), (0.0, 0.04, 4), rest);
        let top = "plasticity.theory = \"deformation\"\nmaterial.hard = { young = 1e11, poisson = 0.2 }\n\
                   probe = [{ name = \"p\", body = \"b\", at = [0.05, 0.04] }, { name = \"s\", body = \"b\", at = [0.02, 0.01] }]";
        let material = "young = 2e11, poisson = 0.3, plasticity = { yield_stress = 250e6, hardening = 2e9 }";
        let (summary, _) = solve_all(&case("stress", material, "{}", top, &body), 2, &[]);
        let exact = -(0.03 * soft + 0.01 * hard);
        near(value(&summary, "probes.p.displacement.1"), exact, 1e-8 * exact.abs(), element);
        near(value(&summary, "probes.s.stress.xx"), -low, 1e-8 * low, element);
        near(value(&summary, "plasticity.max_plastic_strain"), plastic(low), 1e-8 * plastic(low), element);
        near(value(&summary, "plasticity.bodies.b.plastic_volume"), 0.75, 1e-9, element);
    }
}
