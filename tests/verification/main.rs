//! Verification problems with known answers that are not shipped as cases, on 2 ranks unless they say otherwise.
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/hertz.rs"]
mod scenes;

mod beams;
mod corners;
mod curved;
mod cycles;
mod energy;
mod frames;
mod friction;
mod friction_fields;
mod friction_heat;
mod heat;
mod hertz;
mod increments;
mod plastic_blocks;
mod plastic_contact;
mod plastic_tubes;
mod plastic_zone;
mod plasticity;
mod rectangles;
mod relaxed;
mod responses;
mod rigid;
mod rings;
mod sliding;
mod stack;
mod steps;
mod turning;
mod updated;
mod verdicts;

use common::{check_invariants_within, run, summary, value};
use kontakt::output::{RESULT, Results};
use kontakt::record::SideTable;
use serde_json::Value;

/// Runs a case that must converge and keep the invariants.
fn solve(text: &str) -> Value {
    solve_all(text, 2, &[]).0
}

/// The same with the fields, on any number of ranks.
fn solve_all(text: &str, ranks: usize, arguments: &[&str]) -> (Value, Results) {
    solve_within(text, ranks, arguments, 1.0)
}

/// The same with a factor on what round-off may leave of equilibrium.
fn solve_within(text: &str, ranks: usize, arguments: &[&str], factor: f64) -> (Value, Results) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let (code, log) = start(text, ranks, arguments, directory.path());
    let out = directory.path().join("out");
    assert_eq!(code, Some(0), "{log}\n{text}");
    let summary = summary(&out);
    check_invariants_within(&summary, factor, "verification");
    (summary, Results::read(&out.join(RESULT)).expect("the file reads"))
}

/// Runs a case that must end with this exit code, and returns its summary and what it says.
fn attempt(text: &str, code: i32) -> (Option<Value>, String) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let (found, log) = start(text, 2, &[], directory.path());
    assert_eq!(found, Some(code), "{log}\n{text}");
    let out = directory.path().join("out");
    (out.join("summary.json").exists().then(|| summary(&out)), log)
}

fn start(text: &str, ranks: usize, arguments: &[&str], directory: &std::path::Path) -> (Option<i32>, String) {
    let file = directory.join("case.toml");
    std::fs::write(&file, text).expect("the case is written");
    let output = run(ranks, &file, &directory.join("out"), arguments);
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn close(summary: &Value, path: &str, expected: f64, relative: f64) {
    near(value(summary, path), expected, relative * expected.abs(), path);
}

fn near(found: f64, expected: f64, allowed: f64, what: &str) {
    let error = (found - expected).abs();
    assert!(
        error <= allowed,
        "{what}: {found:e}, not {expected:e}, off by {error:.1e}, {allowed:.1e} allowed"
    );
}

/// The side of a pair that carries the multipliers.
fn multipliers(results: &Results, pair: usize) -> &SideTable {
    gapped(&results.pairs[pair])
}

fn gapped(pair: &kontakt::record::PairTables) -> &SideTable {
    let sides = pair.sides.iter().flatten();
    sides.into_iter().find(|side| side.multipliers).expect("a side has the multipliers")
}

/// Linear interpolation of the pressure of a side at `x` along the first axis.
fn pressure_at(side: &SideTable, x: f64) -> f64 {
    let mut nodes: Vec<(f64, f64)> =
        std::iter::zip(&side.x, &side.pressure).map(|(x, p)| (x[0], *p)).collect();
    nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let i = nodes.partition_point(|node| node.0 < x).clamp(1, nodes.len() - 1);
    let ((a, p), (b, q)) = (nodes[i - 1], nodes[i]);
    p + (q - p) * (x - a) / (b - a)
}

/// A rectangle as a body of a case: `x` and `y` as (from, to, cells).
fn rectangle(
    name: &str,
    material: &str,
    element: &str,
    x: (f64, f64, usize),
    y: (f64, f64, usize),
    rest: &str,
) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nmaterial = \"{material}\"\nelement = \"{element}\"\n\
         mesh.rectangle.x = {{ from = {}, to = {}, cells = {} }}\nmesh.rectangle.y = {{ from = {}, to = {}, cells = {} }}\n{rest}\n",
        x.0, x.1, x.2, y.0, y.1, y.2
    )
}
