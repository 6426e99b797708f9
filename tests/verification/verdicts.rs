//! A run that says "converged" is right: what is not, says so, and what is beyond the theory is warned about.
use super::{close, common, solve, value};
use serde_json::Value;

/// Two blocks of `young`, the upper one pressed by 1 MPa.
fn blocks(young: &str) -> String {
    format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-8\nmaterial.steel = {{ young = {young}, poisson = 0.3 }}\n\
         [[body]]\nname = \"upper\"\nmaterial = \"steel\"\n\
         mesh.rectangle = {{ x = {{ from = 0, to = 0.04, cells = 8 }}, y = {{ from = 0.02, to = 0.04, cells = 4 }} }}\n\
         load = [{{ surface = \"top\", pressure = 1e6 }}]\nsupport = [{{ surface = \"left\", x = 0 }}]\n\
         [[body]]\nname = \"lower\"\nmaterial = \"steel\"\n\
         mesh.rectangle = {{ x = {{ from = 0, to = 0.06, cells = 12 }}, y = {{ from = 0, to = 0.02, cells = 4 }} }}\n\
         support = [{{ surface = \"bottom\", y = 0 }}, {{ surface = \"left\", x = 0 }}]\n\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"upper.bottom\", \"lower.top\"]\n"
    )
}

/// Blocks of the same width on each other, the first on a frictionless floor, the last pressed down by `travel`: in each the
/// stress is travel / sum(h (1 - nu^2) / E). `layers`: element, E, height, cells along and across.
fn pile(layers: &[(&str, f64, f64, [usize; 2])], travel: f64, tolerance: &str) -> (String, f64) {
    let mut text = format!("analysis = \"plane stress\"\nalternation.tolerance = {tolerance}\n");
    let (mut y, mut compliance) = (0.3, 0.0);
    for (i, (element, young, height, [nx, ny])) in layers.iter().enumerate() {
        let top = y + height;
        let push = if i + 1 == layers.len() {
            format!("{{ surface = \"top\", y = -{travel} }}, ")
        } else {
            String::new()
        };
        let floor = if i == 0 { "{ surface = \"bottom\", y = 0 }, " } else { "" };
        text += &format!(
            "[material.m{i}]\nyoung = {young}\npoisson = 0\n[[body]]\nname = \"b{i}\"\nmaterial = \"m{i}\"\nelement = \"{element}\"\n\
             mesh.rectangle.x = {{ from = 0.0, to = 2.1, cells = {nx} }}\nmesh.rectangle.y = {{ from = {y}, to = {top}, cells = {ny} }}\n\
             support = [{push}{floor}{{ point = [0.0, {y}], x = 0 }}]\n"
        );
        if i > 0 {
            text +=
                &format!("[[contact]]\nname = \"c{i}\"\nsurfaces = [\"b{i}.bottom\", \"b{}.top\"]\n", i - 1);
        }
        (y, compliance) = (top, compliance + height / young);
    }
    (text, travel / compliance)
}

fn run(text: &str, ranks: usize, arguments: &[&str]) -> (Option<i32>, Value) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let case = directory.path().join("case.toml");
    std::fs::write(&case, text).expect("the case is written");
    let out = directory.path().join("out");
    let output = common::run(ranks, &case, &out, arguments);
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap_or_else(|_| "null".into());
    (output.status.code(), serde_json::from_str(&summary).expect("JSON"))
}

fn texts<'s>(summary: &'s Value, key: &str) -> Vec<&'s str> {
    summary[key].as_array().into_iter().flatten().filter_map(Value::as_str).collect()
}

#[test]
fn a_body_whose_solver_does_not_solve_is_not_converged() {
    let (_, direct) = run(&blocks("2.1e11"), 1, &[]);
    let exact = common::value(&direct, "pairs.pair.max_pressure");
    for options in [
        &[
            "-body_lower_ksp_type",
            "richardson",
            "-body_lower_pc_type",
            "jacobi",
            "-body_lower_ksp_max_it",
            "3",
        ][..],
        &["-body_lower_ksp_type", "cg", "-body_lower_pc_type", "jacobi", "-body_lower_ksp_rtol", "0.3"],
        &["-body_upper_ksp_type", "preonly", "-body_upper_pc_type", "jacobi"],
    ] {
        for ranks in [1, 2] {
            let (code, summary) = run(&blocks("2.1e11"), ranks, options);
            // It may be helped to the right answer; it may not have another one.
            let right = || (common::value(&summary, "pairs.pair.max_pressure") / exact - 1.0).abs() < 1e-6;
            assert!(code != Some(0) || right(), "{options:?} on {ranks} ranks: {code:?}, {summary}");
            if summary["reason"] == "checks_failed" {
                assert_eq!((code, &summary["converged"]), (Some(3), &Value::Bool(false)));
                let said = texts(&summary, "diagnosis");
                assert!(said.iter().any(|line| line.contains("residual of equilibrium")), "{said:?}");
            }
        }
    }
}

#[test]
fn every_pair_is_as_exact_as_its_own_approach_asks() {
    // The approach of the stiff pair is a millionth of that of the soft ones.
    let layers = [
        ("tri6", 1.3e11, 0.47205155854760206, [9, 1]),
        ("tri6", 2.2e11, 13.9, [12, 8]),
        ("tri6", 1.2e5, 0.9, [3, 1]),
        ("tri6", 5e9, 1.25, [8, 1]),
    ];
    let (text, exact) = pile(&layers, 9e-6, "1e-10");
    for ranks in [1, 2] {
        let (code, summary) = run(&text, ranks, &[]);
        assert_eq!(code, Some(0), "{summary}");
        for pair in ["c1", "c2", "c3"] {
            let found = common::value(&summary, &format!("pairs.{pair}.max_pressure"));
            assert!((found / exact - 1.0).abs() < 1e-7, "{pair} on {ranks} ranks: {found:e}, not {exact:e}");
        }
    }
}

#[test]
fn an_automatic_tolerance_goes_down_where_nothing_but_the_alternation_is_wrong() {
    let layers = [("tri3", 2.9e12, 0.243, [2, 1]), ("tri3", 8.9e12, 0.353, [12, 1])];
    let (text, exact) = pile(&layers, 3e-6, "\"auto\"");
    let (code, summary) = run(&text, 1, &[]);
    assert_eq!(code, Some(0), "{summary}");
    let found = common::value(&summary, "pairs.c1.max_pressure");
    assert!((found / exact - 1.0).abs() < 1e-8, "{found:e}, not {exact:e}: {}", summary["tolerance"]);
}

#[test]
fn a_wrong_unit_and_a_large_rotation_are_said() {
    let (code, summary) = run(&blocks("2.1e5"), 2, &[]);
    assert_eq!(code, Some(0));
    let warnings = texts(&summary, "warnings");
    let strains = warnings.iter().find(|line| line.contains("strains go up to"));
    let strains = strains.unwrap_or_else(|| panic!("{warnings:?}"));
    assert!(strains.contains("0.04 x 0.02") && strains.contains("0.06 x 0.02"), "{strains}");
    assert!(!warnings.iter().any(|line| line.contains("updated")), "{warnings:?}");
    let (_, right) = run(&blocks("2.1e11"), 1, &[]);
    assert_eq!(texts(&right, "warnings"), Vec::<&str>::new());
    // A cantilever of length L pushed down by d at its end turns there by 3/2 d/L = 0.45: 24.2 degrees.
    let strip = "analysis = \"plane stress\"\nmaterial.steel = { young = 2.1e11, poisson = 0.3 }\n[[body]]\nname = \"strip\"\n\
                 material = \"steel\"\nelement = \"quad8\"\n\
                 mesh.rectangle = { x = { from = 0, to = 0.1, cells = 50 }, y = { from = 0, to = 0.002, cells = 1 } }\n\
                 support = [{ surface = \"left\", x = 0, y = 0 }, { point = [0.1, 0.001], y = -0.03 }]\n";
    let strip = strip.replace("cells = 1 } }", "cells = 2 } }");
    let (code, summary) = run(&strip, 1, &[]);
    assert_eq!(code, Some(0), "{summary}");
    let warnings = texts(&summary, "warnings");
    assert!(warnings.iter().any(|line| line.contains("turns by up to 24.")), "{warnings:?}");
}

#[test]
fn a_body_that_has_turned_many_times_is_no_solution() {
    // A pin in a bore: nothing but the facets of the bore holds it against a load beside its centre.
    let text = "analysis = \"plane stress\"\nthickness = 0.01\nalternation.transfer = \"pointwise\"\n\
                material.steel = { young = 2.1e11, poisson = 0.3 }\n[[body]]\nname = \"pin\"\nmaterial = \"steel\"\nelement = \"quad8\"\n\
                mesh.disc = { radius = 0.01, quarter = 30, depth = { to = 0.5, cells = 6 } }\nmesh.translate = [5e-5, 0]\n\
                load = [{ body_force = [6.3662e9, 6.4e8] }]\n[[body]]\nname = \"ring\"\nmaterial = \"steel\"\nelement = \"quad8\"\n\
                mesh.ring = { radius = { from = 0.01005, to = 0.03, cells = 12 }, angle = { from = 0, to = 360, cells = 128 } }\n\
                support = [{ surface = \"outer\", x = 0, y = 0 }]\n[[contact]]\nname = \"bore\"\nsurfaces = [\"pin.arc\", \"ring.inner\"]\n";
    let (code, summary) = run(text, 1, &[]);
    // Statics: the pair carries no less than the load of 20.1 kN; a wedge of 90 degrees would carry 1.41 times that.
    let plausible = || common::value(&summary, "pairs.bore.normal_force") < 1.5 * 20.1e3;
    assert!(code != Some(0) || plausible(), "{code:?}: {}", summary["pairs"]);
}

/// A wedge pushed under a slope of so many degrees by a pressure on its thick end: N = F / sin(angle).
fn wedge(degrees: f64) -> String {
    let slope = degrees.to_radians();
    let thin = 0.2 - slope.tan();
    let (nx, ny) = (-slope.sin(), -slope.cos());
    format!(
        r#"
analysis = "plane strain"
[[body]]
name = "wedge"
element = "quad8"
material = {{ young = 2.1e11, poisson = 0.3 }}
mesh.block = {{ corners = [[0, 0], [1, 0], [1, {thin}], [0, 0.2]], u = {{ from = 0, to = 1, cells = 20 }}, v = {{ from = 0, to = 1, cells = 4 }} }}
load = [{{ surface = "left", pressure = 1e5 }}]
[[body]]
name = "floor"
rigid.plane = {{ through = [0, 0], normal = [0, 1] }}
[[body]]
name = "slope"
rigid.plane = {{ through = [0, 0.2], normal = [{nx}, {ny}] }}
[[contact]]
name = "below"
surfaces = ["wedge.bottom", "floor.surface"]
[[contact]]
name = "above"
surfaces = ["wedge.top", "slope.surface"]
"#
    )
}

/// What the pairs carry is set against what is applied: a wedge of a degree multiplies it by 57, which a user is told.
#[test]
fn forces_far_above_the_loads_are_told() {
    for (degrees, warned) in [(1.0_f64, true), (3.0, false)] {
        let summary = solve(&wedge(degrees));
        let force = 0.2 * 1e5 / degrees.to_radians().sin();
        close(&summary, "pairs.1.normal_force", force, 1e-6);
        close(&summary, "plausibility.carried_over_applied", force / (0.2 * 1e5), 1e-6);
        let size = value(&summary, "plausibility.displacement_over_size");
        assert!(size > 0.0 && size < 1e-3, "{size}");
        let warnings = summary["warnings"].to_string();
        assert_eq!(warnings.contains("times as much"), warned, "{warnings}");
    }
}
