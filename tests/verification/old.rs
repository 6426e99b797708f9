//! Verification problems with exact answers that are not shipped as cases, on 2 ranks.
mod common;

use common::{check_invariants, run, summary, value};
use serde_json::Value;

fn solve(text: &str) -> Value {
    let summary = attempt(text, 0);
    check_invariants(&summary, "verification");
    summary
}

/// Runs a case that must end with this exit code.
fn attempt(text: &str, code: i32) -> Value {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("case.toml");
    std::fs::write(&file, text).expect("the case is written");
    let output = run(2, &file, &directory.path().join("out"), &[]);
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    summary(&directory.path().join("out"))
}

fn close(summary: &Value, path: &str, expected: f64, relative: f64) {
    let found = value(summary, path);
    assert!((found - expected).abs() <= relative * expected.abs(), "{path}: {found:e}, not {expected:e}");
}

fn ring(name: &str, material: &str, inner: f64, outer: f64, extra: &str) -> String {
    format!(
        r#"
[[body]]
name = "{name}"
material = "{material}"
element = "quad8"
mesh.ring = {{ radius = {{ from = {inner}, to = {outer}, cells = 6 }}, angle = {{ from = 0, to = 90, cells = 20 }} }}
support = [{{ surface = "start", y = 0 }}, {{ surface = "end", x = 0 }}]
{extra}
"#
    )
}

/// Three shrunk rings: the middle one is pressed from both sides, and stiff against it. The paper's alternation, whose
/// weights see one interface at a time, cannot bring it to agreement; it must say so, not return a wrong pressure.
#[test]
fn three_rings_are_not_called_converged() {
    let text = format!(
        r#"
analysis = "plane stress"
alternation = {{ driver = "relaxed", tolerance = 1e-10 }}
material.a = {{ young = 2.1e11, poisson = 0.3 }}
material.b = {{ young = 7e10, poisson = 0.33 }}
material.c = {{ young = 1.1e11, poisson = 0.34 }}
contact = [
    {{ name = "ab", surfaces = ["a.outer", "b.inner"], gap_offset = -3e-5 }},
    {{ name = "bc", surfaces = ["b.outer", "c.inner"], gap_offset = -4e-5 }},
]
{}{}{}"#,
        ring("a", "a", 0.04, 0.06, ""),
        ring("b", "b", 0.06, 0.08, ""),
        ring("c", "c", 0.08, 0.1, "")
    );
    let summary = attempt(&text, 3);
    assert_eq!(summary["converged"], false);
    assert_eq!(summary["reason"], "emptied");
}

/// An aluminium ring heated inside a steel ring closes a radial gap; with less heat it does not.
#[test]
fn heated_rings() {
    let case = |analysis: &str, temperature: f64| {
        let heat = format!("temperature = {temperature}");
        format!(
            r#"
analysis = "{analysis}"
alternation = {{ tolerance = 1e-10 }}
material.al = {{ young = 7e10, poisson = 0.33, expansion = 23e-6, reference_temperature = 0 }}
material.fe = {{ young = 2.1e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 0 }}
contact = [{{ name = "fit", surfaces = ["inner.outer", "outer.inner"], gap_offset = 5e-5 }}]
{}{}"#,
            ring("inner", "al", 0.05, 0.1, &heat),
            ring("outer", "fe", 0.1, 0.15, &heat)
        )
    };
    close(&solve(&case("plane stress", 100.0)), "pairs.fit.max_pressure", 1.8234443e7, 3e-3);
    close(&solve(&case("plane strain", 100.0)), "pairs.fit.max_pressure", 3.5588994e7, 3e-3);
    let open = solve(&case("plane stress", 30.0));
    assert_eq!(open["reason"], "open");
    assert_eq!(value(&open, "pairs.fit.max_pressure"), 0.0);
}

/// Two leaves under uniform pressure share it: contact pressure q / 2 along the length, grazing all the way. Tip
/// deflection of a beam of half the load.
#[test]
fn two_leaves() {
    let leaf = |name: &str, y: f64, load: &str| {
        format!(
            r#"
[[body]]
name = "{name}"
material = "steel"
element = "quad8"
mesh.rectangle = {{ x = {{ from = 0, to = 0.2, cells = 80 }}, y = {{ from = {y}, to = {}, cells = 4 }} }}
support = [{{ surface = "left", x = 0, y = 0 }}]
{load}
"#,
            y + 0.01
        )
    };
    let text = format!(
        r#"
analysis = "plane stress"
alternation = {{ tolerance = 1e-9 }}
material.steel = {{ young = 2.1e11, poisson = 0.3 }}
contact = [{{ name = "leaves", surfaces = ["upper.bottom", "lower.top"] }}]
probe = [{{ name = "tip", body = "upper", at = [0.2, 0.02] }}]
{}{}"#,
        leaf("lower", 0.0, ""),
        leaf("upper", 0.01, "load = [{ surface = \"top\", pressure = 1e5 }]")
    );
    let summary = solve(&text);
    close(&summary, "probes.tip.displacement.1", -5.722e-4, 5e-3);
    // Half of the load crosses the interface.
    close(&summary, "pairs.leaves.normal_force", 0.5 * 1e5 * 0.2, 2e-2);
}

/// A body held on all sides and heated: -E alpha dT / (1 - nu) in plane stress, / (1 - 2 nu) in plane strain.
#[test]
fn constrained_heating() {
    for (analysis, denominator) in [("plane stress", 1.0 - 0.3), ("plane strain", 1.0 - 0.6)] {
        let text = format!(
            r#"
analysis = "{analysis}"
probe = [{{ name = "m", body = "b", at = [0.3, 0.4] }}]
[[body]]
name = "b"
material = {{ young = 2.1e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 20 }}
temperature = 120
mesh.rectangle = {{ x = {{ from = 0, to = 1, cells = 3 }}, y = {{ from = 0, to = 1, cells = 3 }} }}
support = [{{ surface = "left", x = 0 }}, {{ surface = "right", x = 0 }}, {{ surface = "top", y = 0 }}, {{ surface = "bottom", y = 0 }}]
"#
        );
        let summary = solve(&text);
        close(&summary, "probes.m.stress.xx", -2.52e8 / denominator, 1e-10);
        close(&summary, "probes.m.stress.yy", -2.52e8 / denominator, 1e-10);
    }
}

/// Two parallel cantilevers, a gap of 0.5 mm, a tip load on the upper one: R = (P - g / C) / 2 at the tip.
#[test]
fn two_cantilevers() {
    let beam = |name: &str, y: f64, load: &str| {
        format!(
            r#"
[[body]]
name = "{name}"
material = "steel"
element = "quad8"
mesh.rectangle = {{ x = {{ from = 0, to = 0.2, cells = 80 }}, y = {{ from = {y}, to = {}, cells = 4 }} }}
support = [{{ surface = "left", x = 0, y = 0 }}]
{load}
"#,
            y + 0.01
        )
    };
    let text = format!(
        r#"
analysis = "plane stress"
alternation = {{ tolerance = 1e-9 }}
material.steel = {{ young = 2.1e11, poisson = 0.3 }}
contact = [{{ name = "tip", surfaces = ["upper.bottom", "lower.top"] }}]
probe = [{{ name = "tip", body = "upper", at = [0.2, 0.0205] }}]
{}{}"#,
        beam("lower", 0.0, ""),
        beam("upper", 0.0105, "load = [{ point = [0.2, 0.0205], force = [0, -2e4] }]")
    );
    let summary = solve(&text);
    // Timoshenko 8362.6 N/m; the resultant sits in the last nodes, first order in the element size.
    close(&summary, "pairs.tip.normal_force", 8362.6, 1e-2);
    close(&summary, "probes.tip.displacement.1", -1.77678e-3, 1e-2);
}

/// Thick cylinder under a steady radial temperature drop, plane strain.
#[test]
fn thermal_cylinder() {
    let text = r#"
analysis = "plane strain"
probe = [{ name = "a", body = "c", at = [0.05, 0] }, { name = "m", body = "c", at = [0.075, 0] }, { name = "b", body = "c", at = [0.1, 0] }]
[[body]]
name = "c"
material = { young = 2.1e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 0 }
temperature = "100*ln(0.1/sqrt(x^2 + y^2))/ln(2)"
element = "quad8"
mesh.ring = { radius = { from = 0.05, to = 0.1, cells = 24 }, angle = { from = 0, to = 90, cells = 24 } }
support = [{ surface = "start", y = 0 }, { surface = "end", x = 0 }]
"#;
    let summary = solve(text);
    close(&summary, "probes.a.displacement.0", 3.026511e-5, 1e-3);
    close(&summary, "probes.b.displacement.0", 6.053021e-5, 1e-3);
    // At y = 0 the hoop stress is yy, the radial one xx.
    close(&summary, "probes.a.stress.yy", -2.20315e8, 1e-2);
    close(&summary, "probes.b.stress.yy", 1.39685e8, 1e-2);
    close(&summary, "probes.m.stress.xx", -2.80401e7, 1e-2);
    close(&summary, "probes.b.stress.zz", 4.19055e7, 2e-2);
}
