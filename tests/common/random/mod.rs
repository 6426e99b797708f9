//! Random scenes: drawn from a seed, run by the program, judged without it.
//!
//! `tests/random.rs` runs the first of them, `scripts/random` (benches/random.rs) as many as asked. Every scene has an
//! answer, so that one that does not converge is a fault, and one that converges to something else a worse one.
#![allow(dead_code)]
mod blocks;
mod dense;
mod draw;
mod model;
mod round;
mod scene;
mod verify;

use crate::common::mpirun;
use draw::Draw;
use kontakt::{
    case::{self, Case},
    output::{RESULT, Results},
    vector::larger,
};
use model::Model;
use scene::{Expect, Frame, Scene, Twin};
use serde_json::Value;
use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// How a scene ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// As it must.
    Right,
    /// Called converged, and wrong.
    Wrong,
    /// Not converged, or refused.
    Unsolved,
}

/// One scene of a run.
pub struct Row {
    pub scene: u64,
    pub family: &'static str,
    pub verdict: Verdict,
    pub alternations: u64,
    /// What it was compared with.
    pub compared: String,
    pub faults: Vec<String>,
    /// The case file, if it failed.
    pub text: String,
}

/// What one start of the program left.
struct Outcome {
    code: Option<i32>,
    summary: Value,
    text: String,
    out: tempfile::TempDir,
}

/// A scene by its seed and number, in SI units or scaled.
fn draw_scene(seed: u64, number: u64, units: [f64; 2]) -> Scene {
    let mut draw = Draw::new(seed, number);
    let frame = Frame { degrees: 0.0, units };
    match draw.whole(0, 19) {
        0..=7 => blocks::stack(&mut draw, frame),
        8..=9 => blocks::foil(&mut draw, frame),
        10 => blocks::shared(&mut draw, frame),
        11..=12 => blocks::stops(&mut draw, frame),
        13 => blocks::wedge(&mut draw, frame),
        14..=15 => round::press_fit(&mut draw, frame),
        16 => round::bore(&mut draw, frame),
        17..=18 => round::roller(&mut draw, frame),
        _ => round::disc(&mut draw, frame),
    }
}

fn start(case: &Path, ranks: usize, sets: &[String]) -> Outcome {
    let out = tempfile::tempdir().expect("a temporary directory");
    let program = env!("CARGO_BIN_EXE_kontakt");
    let mut command = if ranks > 1 {
        let mut command = mpirun(ranks);
        command.arg(program);
        command
    } else {
        let mut command = Command::new("timeout");
        command.args(["--kill-after=5", "120", program]).env("OMP_NUM_THREADS", "1");
        command
    };
    command.arg("run").arg(case).arg("--out").arg(out.path());
    command.args(sets.iter().flat_map(|set| ["--set", set]));
    let output = command.output().expect("the program starts");
    let summary = std::fs::read_to_string(out.path().join("summary.json")).ok();
    let summary = summary.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or(Value::Null);
    let text = [&output.stdout[..], &output.stderr[..]].map(String::from_utf8_lossy).concat();
    Outcome { code: output.status.code(), summary, text, out }
}

/// Runs a scene and judges it.
pub fn check(seed: u64, number: u64) -> Row {
    let scene = draw_scene(seed, number, [1.0; 2]);
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("case.toml");
    std::fs::write(&file, &scene.text).expect("the case is written");
    let mut row = Row {
        scene: number,
        family: scene.family,
        verdict: Verdict::Right,
        alternations: 0,
        compared: String::new(),
        faults: Vec::new(),
        text: scene.text.clone(),
    };
    let case = match case::read(&file, None, &[]) {
        Ok(case) => case,
        Err(e) => {
            row.faults.push(format!("the case does not read: {e}"));
            row.verdict = Verdict::Unsolved;
            return row;
        }
    };
    let one = start(&file, 1, &[]);
    row.alternations = one.summary["alternations"].as_u64().unwrap_or(0);
    if let Some(fault) = unsolved(&one) {
        row.faults.push(fault);
        row.verdict = Verdict::Unsolved;
        return row;
    }
    judge(&case, &scene, &one, &mut row);
    for twin in &scene.twins {
        compare(seed, number, &case, &file, twin, &one, &mut row);
    }
    if !row.faults.is_empty() && row.verdict == Verdict::Right {
        row.verdict = Verdict::Wrong;
    }
    row
}

/// What is left of relative accuracy by the tolerance that was used.
fn slack(summary: &Value) -> f64 {
    10.0 * summary["tolerance"].as_f64().unwrap_or(f64::NAN)
}

fn unsolved(outcome: &Outcome) -> Option<String> {
    if outcome.code == Some(0) {
        return None;
    }
    let last: Vec<&str> = outcome.text.lines().rev().take(2).collect();
    Some(format!("exit code {:?}: {}", outcome.code, last.into_iter().rev().collect::<Vec<_>>().join(" | ")))
}

/// The run against the equations, what is known of it and, where there is one, the dense solution.
fn judge(case: &Case, scene: &Scene, one: &Outcome, row: &mut Row) {
    let results = match Results::read(&one.out.path().join(RESULT)) {
        Ok(results) => results,
        Err(e) => return row.faults.push(e.to_string()),
    };
    let slack = slack(&one.summary);
    let models: Vec<Model> = case.bodies.iter().map(|body| Model::new(case, body)).collect();
    let u = match verify::displacements(&results, &models) {
        Ok(u) => u,
        Err(fault) => return row.faults.push(fault),
    };
    row.compared = "equations".into();
    let side = |pair: &Value| usize::from(pair["multiplier_side"] == "b");
    let sides: Vec<usize> = one.summary["pairs"].as_array().into_iter().flatten().map(side).collect();
    if sides.len() != case.contacts.len() {
        return row.faults.push("the summary does not have all pairs".into());
    }
    row.faults.extend(verify::faults(case, &models, &results, &sides, &u, slack));
    for expect in &scene.expect {
        row.faults.extend(known(expect, &one.summary, &results, slack));
    }
    if scene.dense {
        match dense::solve(case, &models, &sides) {
            Some(solution) => {
                row.compared = "dense".into();
                row.faults.extend(against_dense(&solution, &models, &one.summary, &u, slack));
            }
            None => row.compared += ", no dense solution found",
        }
    }
}

fn pair_number(summary: &Value, pair: &str, key: &str) -> f64 {
    let pairs = summary["pairs"].as_array().into_iter().flatten();
    let found = pairs.into_iter().find(|p| p["name"] == pair);
    found.and_then(|p| p[key].as_f64()).unwrap_or(f64::NAN)
}

/// True beyond the limit, and of what is not a number.
fn beyond(value: f64, limit: f64) -> bool {
    value > limit || value.is_nan() || limit.is_nan()
}

fn differs(found: f64, value: f64, relative: f64) -> bool {
    beyond((found - value).abs(), relative * value.abs())
}

fn known(expect: &Expect, summary: &Value, results: &Results, slack: f64) -> Option<String> {
    match expect {
        Expect::Force { pair, value, relative } | Expect::Peak { pair, value, relative } => {
            let (key, what) = match expect {
                Expect::Force { .. } => ("normal_force", "force"),
                _ => ("max_pressure", "peak pressure"),
            };
            let found = pair_number(summary, pair, key);
            differs(found, *value, relative + slack).then(|| {
                format!("pair {pair}: {what} {found:.9e}, not {value:.9e} ({:+.1e})", found / value - 1.0)
            })
        }
        Expect::Uniform { pair, value, relative } => {
            let side = usize::from(
                summary["pairs"].as_array()?.iter().find(|p| p["name"] == *pair)?["multiplier_side"] == "b",
            );
            let side = results.pairs.iter().find(|p| p.name == *pair)?.sides[side].as_ref()?;
            let closed = std::iter::zip(&side.pressure, &side.status).filter(|(_, status)| **status == 2);
            let off: Vec<f64> =
                closed.map(|(p, _)| *p).filter(|p| differs(*p, *value, relative + slack)).collect();
            (!off.is_empty()).then(|| {
                format!("pair {pair}: pressure {:.9e} at {} nodes, not {value:.9e}", off[0], off.len())
            })
        }
        Expect::StepForce { step, pairs: [push, back], value, relative } => {
            let of = |pair: &str| pair_number(&summary["steps"][step], pair, "normal_force");
            let found = of(push) - of(back);
            let scale = summary["steps"].as_array()?.iter().map(|s| {
                let pairs = s["pairs"].as_array().into_iter().flatten();
                pairs.filter_map(|p| p["normal_force"].as_f64()).fold(0.0, larger)
            });
            let scale = scale.fold(0.0, larger);
            beyond((found - value).abs(), (relative + slack) * scale).then(|| {
                format!("step {}: force of {push} less {back} {found:.9e}, not {value:.9e}", step + 1)
            })
        }
    }
}

fn against_dense(
    solution: &dense::Solution,
    models: &[Model],
    summary: &Value,
    u: &[Vec<f64>],
    slack: f64,
) -> Vec<String> {
    let mut faults = Vec::new();
    let largest = solution.forces.iter().fold(0.0_f64, |a, f| a.max(f.abs()));
    for (pair, force) in std::iter::zip(summary["pairs"].as_array().into_iter().flatten(), &solution.forces) {
        let found = pair["normal_force"].as_f64().unwrap_or(f64::NAN);
        if beyond((found - force).abs(), (1e-6 + slack) * largest) {
            faults.push(format!(
                "pair {}: force {found:.9e}, the dense solution has {force:.9e}",
                pair["name"]
            ));
        }
    }
    for (b, (found, right)) in std::iter::zip(u, &solution.u).enumerate() {
        let largest = right.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        let off = std::iter::zip(found, right).map(|(a, b)| (a - b).abs()).fold(0.0_f64, larger);
        // A body that nothing strains moves by the round-off of its coordinates.
        let size = models[b].mesh.points.iter().flatten().fold(0.0_f64, |a, x| a.max(x.abs()));
        if beyond(off, (1e-6 + 10.0 * slack) * largest + 1e-13 * size) {
            faults.push(format!(
                "body {b}: displacements differ from the dense solution by {:.1e}",
                off / largest
            ));
        }
    }
    faults
}

/// Runs a twin and compares forces and peaks.
fn compare(seed: u64, number: u64, case: &Case, file: &Path, twin: &Twin, one: &Outcome, row: &mut Row) {
    let pairs: Vec<String> = case.contacts.iter().map(|c| c.name.clone()).collect();
    let respond = |how: &str| -> Vec<String> {
        case.bodies.iter().map(|b| format!("body.{}.response={how}", b.name)).collect()
    };
    let mut factors = [1.0, 1.0];
    let (name, other, relative) = match twin {
        Twin::Ranks => ("2 ranks", start(file, 2, &[]), 1e-6),
        Twin::Solver => ("solver", start(file, 1, &respond("solver")), 1e-6),
        Twin::Condensed => ("condensed", start(file, 1, &respond("condensed")), 1e-6),
        Twin::Updated(relative) => {
            let sets: Vec<String> = pairs.iter().map(|p| format!("contact.{p}.geometry=updated")).collect();
            ("updated", start(file, 1, &sets), *relative)
        }
        Twin::Swap(relative) => {
            let text = |c: &case::ContactCase| {
                let side =
                    |s: usize| format!("{}.{}", case.body_name(c.surfaces[s].body), c.surfaces[s].surface);
                format!("contact.{}.surfaces=[\"{}\", \"{}\"]", c.name, side(1), side(0))
            };
            ("swapped", start(file, 1, &case.contacts.iter().map(text).collect::<Vec<_>>()), *relative)
        }
        Twin::LastStep => {
            let last = case.steps.len() - 1;
            let step = &case.steps[last];
            let set = format!("step=[{{ loads = {:?}, supports = {:?} }}]", step.loads, step.supports);
            ("last step alone", start(file, 1, &[set]), 1e-6)
        }
        Twin::Scaled(length, pressure) => {
            factors = [pressure * length * length, *pressure];
            let scaled = file.with_file_name("scaled.toml");
            std::fs::write(&scaled, draw_scene(seed, number, [*length, *pressure]).text)
                .expect("it is written");
            ("scaled", start(&scaled, 1, &[]), 1e-6)
        }
    };
    if let Some(fault) = unsolved(&other) {
        row.faults.push(format!("{name}: {fault}"));
        row.verdict = Verdict::Unsolved;
        return;
    }
    let relative = relative + slack(&one.summary) + slack(&other.summary);
    for (key, factor) in std::iter::zip(["normal_force", "max_pressure"], factors) {
        // A peak belongs to a mesh side and to the geometry of its nodes.
        if key == "max_pressure" && matches!(twin, Twin::Swap(_) | Twin::Updated(_)) {
            continue;
        }
        let all = |s: &Value| pairs.iter().map(|p| pair_number(s, p, key)).collect::<Vec<f64>>();
        let (a, b) = (all(&one.summary), all(&other.summary));
        let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs())) * factor;
        for (pair, (a, b)) in std::iter::zip(&pairs, std::iter::zip(&a, &b)) {
            // Peaks of single nodes are less accurate than their sums.
            let relative = if key == "max_pressure" { 10.0 * relative } else { relative };
            if beyond((a * factor - b).abs(), relative * largest) {
                row.faults.push(format!("{name}: pair {pair}: {key} {b:.9e}, not {:.9e}", a * factor));
            }
        }
    }
}

impl Row {
    /// One line, and one more for each fault.
    pub fn line(&self) -> String {
        let verdict = match self.verdict {
            Verdict::Right => "ok",
            Verdict::Wrong => "WRONG",
            Verdict::Unsolved => "UNSOLVED",
        };
        let Row { scene, family, alternations, compared, .. } = self;
        let mut text = format!("{scene:5} {family:10} {verdict:9} {alternations:5}  {compared}");
        for fault in &self.faults {
            text += &format!("\n      {fault}");
        }
        text
    }

    /// For scripts.
    pub fn json(&self) -> Value {
        serde_json::json!({
            "scene": self.scene, "family": self.family, "verdict": format!("{:?}", self.verdict).to_lowercase(),
            "alternations": self.alternations, "compared": self.compared, "faults": self.faults,
        })
    }

    /// Leaves the case file of a scene where it can be run again.
    pub fn keep(&self, directory: &Path, seed: u64) -> std::io::Result<PathBuf> {
        let folder = directory.join(format!("{seed}-{}-{}", self.scene, self.family.replace(' ', "-")));
        std::fs::create_dir_all(&folder)?;
        let comments: String = self.faults.iter().map(|f| format!("# {}\n", f.replace('\n', " "))).collect();
        std::fs::write(folder.join("case.toml"), comments + &self.text)?;
        Ok(folder)
    }
}
