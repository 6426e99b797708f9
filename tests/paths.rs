//! Load paths and the increments of load steps: what acts when, and that the way makes no difference where it must not.
mod common;

use common::{check_invariants, run, summary, value};
use kontakt::output::{RESULT, Results};
use serde_json::Value;
use std::path::Path;

/// Runs a case on so many ranks; its summary and its result file.
fn solve_on(ranks: usize, text: &str, arguments: &[&str]) -> (Value, Results) {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("case.toml");
    std::fs::write(&file, text).unwrap();
    let out = directory.path().join("out");
    let ran = run(ranks, &file, &out, arguments);
    assert_eq!(ran.status.code(), Some(0), "{text}\n{}", String::from_utf8_lossy(&ran.stderr));
    (summary(&out), Results::read(&out.join(RESULT)).unwrap())
}

fn solve(text: &str) -> Value {
    solve_on(1, text, &[]).0
}

fn steps(summary: &Value) -> &[Value] {
    summary["steps"].as_array().expect("there are steps")
}

/// Displacements and stresses of all probes after a step.
fn at_probes(step: &Value) -> Vec<f64> {
    let probes = step["probes"].as_array().expect("there are probes");
    let of = |probe: &Value| {
        let displacement = probe["displacement"].as_array().unwrap().iter().map(|u| u.as_f64().unwrap());
        // Both count alike: Pa over a modulus of about 1e11, in bodies of about 1 m.
        let stress = ["xx", "yy", "xy"].map(|c| value(probe, &format!("stress.{c}")) / 1e11);
        displacement.chain(stress).collect::<Vec<_>>()
    };
    probes.iter().flat_map(of).collect()
}

#[track_caller]
fn assert_close(a: &[f64], b: &[f64], tolerance: f64) {
    let scale = b.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    assert!(a.len() == b.len() && scale > 0.0);
    for (a, b) in std::iter::zip(a, b) {
        assert!((a - b).abs() <= tolerance * scale, "{a} {b}: {:.1e}", (a - b).abs() / scale);
    }
}

/// A block that stands on its bottom, with all that can act on it; `P` stands for what follows a path.
const BLOCK: &str = r#"analysis = "plane strain"
[[body]]
name = "block"
material = { young = 2e11, poisson = 0.3, expansion = 1e-5, reference_temperature = 300 }
mesh.rectangle = { x = { from = 0, to = 1, cells = 6 }, y = { from = 0, to = 1, cells = 6 } }
temperature = TEMPERATURE
support = [
    { surface = "bottom", x = 0, y = 0 },
    { surface = "left", x = "1e-4*y" FIRST },
    { surface = "right", y = "-2e-4*y" SECOND, angle = 20 },
]
load = [{ surface = "top", pressure = 3e7 PRESS }, { surface = "top", traction = [1e7, 0] PUSH }, { body_force = [0, -1e6] }]
[[probe]]
name = "a"
body = "block"
at = [0.3, 0.8]
[[probe]]
name = "b"
body = "block"
at = [0.9, 0.55]
"#;

/// What follows paths by these names, and what general factors.
fn block(press: &str, push: &str, first: &str, second: &str, heat: &str) -> String {
    let of = |name: &str| match name {
        "" => String::new(),
        name => format!(", path = \"{name}\""),
    };
    let heat = of(heat);
    BLOCK
        .replace("PRESS", &of(press))
        .replace("PUSH", &of(push))
        .replace("FIRST", &of(first))
        .replace("SECOND", &of(second))
        .replace("TEMPERATURE", &format!("{{ value = \"350 + 20*x\" {heat} }}"))
}

#[test]
fn loads_on_two_paths_follow_their_tables_and_superpose() {
    let general = |loads: [f64; 2]| {
        // One after the other: the sum of two runs with general factors.
        let step = |loads: f64| format!("[[step]]\nloads = {loads}\nsupports = 0\ntemperature = 0\n");
        let text = block("", "", "", "", "").replace(", { body_force = [0, -1e6] }", "");
        let press = text.replace("traction = [1e7, 0]", "traction = [0, 0]");
        let push = text.replace("pressure = 3e7", "pressure = 0");
        let of = |text: String, loads: f64| at_probes(&steps(&solve(&(text + &step(loads))))[0]);
        let (a, b) = (of(press, loads[0]), of(push, loads[1]));
        std::iter::zip(a, b).map(|(a, b)| a + b).collect::<Vec<_>>()
    };
    let tables =
        "[path.press]\nat = [0, 1]\nfactor = [0, 1]\n[path.push]\nat = [1, 2, 4]\nfactor = [0, 1, -1]\n";
    let text = block("press", "push", "", "", "") + tables;
    let text = text + "[[step]]\nat = 0.25\nsupports = 0\ntemperature = 0\nloads = 0\n";
    let next =
        |at: f64| format!("[[step]]\nat = {at}\nsupports = 0\ntemperature = 0\nloads = 0\nsteps = 3\n");
    let (found, results) = solve_on(1, &(text + &next(1.0) + &next(1.5) + &next(3.5)), &[]);
    let expected = [(0.25, 0.25, 0.0), (1.0, 1.0, 0.0), (1.5, 1.0, 0.5), (3.5, 1.0, -0.5)];
    assert_eq!(steps(&found).len(), expected.len());
    let rows = results.run.steps.as_ref().unwrap();
    for (i, (step, (at, press, push))) in std::iter::zip(steps(&found), expected).enumerate() {
        assert_eq!(
            [value(step, "at"), value(step, "paths.press"), value(step, "paths.push")],
            [at, press, push]
        );
        assert_eq!(step["increments"], if i == 0 { 1 } else { 3 });
        assert_eq!((rows[i].at, rows[i].increments), (Some(at), if i == 0 { 1 } else { 3 }));
        assert_eq!(rows[i].paths, [("press".into(), press), ("push".into(), push)].into());
        assert_close(&at_probes(step), &general([press, push]), 1e-10);
    }
}

/// Each kind of what acts on a path of its own is the same as by the general factors, on one rank and on two.
#[test]
fn supports_temperature_and_loads_follow_paths() {
    let step = |text: String| text + "[[step]]\nloads = 0.4\nsupports = -0.7\ntemperature = 1.3\n";
    let general = at_probes(&steps(&solve(&step(block("", "", "", "", ""))))[0]);
    let by_paths = "paths = { l = 0.4, s = -0.7, t = 1.3 }\n";
    let on_paths = step(block("l", "l", "s", "", "t")) + by_paths;
    let both = step(block("l", "", "s", "s2", "t")) + "paths = { l = 0.4, s = -0.7, s2 = -0.7, t = 1.3 }\n";
    for (ranks, text) in [(1, &on_paths), (1, &both), (2, &both)] {
        let (found, _) = solve_on(ranks, text, &[]);
        assert_close(&at_probes(&steps(&found)[0]), &general, 1e-10);
        check_invariants(&found, "paths");
    }
    // Supports on two paths are the sum of each alone.
    let alone = |first: f64, second: f64| {
        let text = block("", "", "s", "s2", "").replace("[[probe]]\nname = \"a\"", &format!(
            "[[step]]\nloads = 0\nsupports = 0\ntemperature = 0\npaths = {{ s = {first}, s2 = {second} }}\n[[probe]]\nname = \"a\""
        ));
        at_probes(&steps(&solve(&text))[0])
    };
    let (a, b) = (alone(1.0, 0.0), alone(0.0, 1.0));
    let sum: Vec<f64> = std::iter::zip(&a, &b).map(|(a, b)| 0.6 * a - 1.4 * b).collect();
    assert_close(&alone(0.6, -1.4), &sum, 1e-10);
}

/// A material whose modulus depends on a temperature that follows a path.
#[test]
fn a_temperature_on_a_path_changes_the_stiffness() {
    let table = "young = { temperature = [300, 400], value = [2e11, 1e11] }";
    let hot = |heat: &str| block("", "", "", "", heat).replace("young = 2e11", table);
    let general = solve(&(hot("") + "[[step]]\ntemperature = 0.35\n"));
    let on_path =
        solve(&(hot("t") + "[[step]]\npaths = { t = 1 }\n[[step]]\npaths = { t = 0.35 }\nsteps = 2\n"));
    assert_close(&at_probes(&steps(&on_path)[1]), &at_probes(&steps(&general)[0]), 1e-10);
}

/// A block that two loads press and push, on a wider one; meshes do not match, and the contact is shorter than the block.
fn punch(press: &str, push: &str) -> String {
    format!(
        r#"analysis = "plane strain"
[[body]]
name = "upper"
material = {{ young = 2e11, poisson = 0.3 }}
mesh.rectangle = {{ x = {{ from = 0, to = 1, cells = 12 }}, y = {{ from = 1, to = 2, cells = 12 }} }}
support = [{{ surface = "left", within = {{ y = [1.9, 2] }}, x = 0 }}]
load = [{{ surface = "top", pressure = "1e8*(0.2 + x)" {press} }}, {{ surface = "right", traction = [0, 4e7] {push} }}]
[[body]]
name = "lower"
material = {{ young = 1e11, poisson = 0.3 }}
mesh.rectangle = {{ x = {{ from = -0.5, to = 1.5, cells = 29 }}, y = {{ from = 0, to = 1, cells = 13 }} }}
support = [{{ surface = "bottom", x = 0, y = 0 }}]
[[contact]]
name = "c"
surfaces = ["upper.bottom", "lower.top"]
[alternation]
tolerance = 1e-12
[[probe]]
name = "a"
body = "upper"
at = [0.25, 1.5]
[[probe]]
name = "b"
body = "lower"
at = [0.71, 0.75]
"#
    )
}

/// Probes and contact after the last step.
fn state(summary: &Value) -> Vec<f64> {
    let of_pair =
        ["normal_force", "max_pressure"].map(|key| value(summary, &format!("pairs.c.{key}")) / 1e11);
    at_probes(summary).into_iter().chain(of_pair).collect()
}

#[test]
fn the_way_makes_no_difference_without_friction() {
    let whole = solve(&punch("", ""));
    assert!(value(&whole, "pairs.c.open") > 0.0 && value(&whole, "pairs.c.active") > 0.0);
    let [press, push] = [", path = \"press\"", ", path = \"push\""];
    let tables = "[path.press]\nat = [0, 1]\nfactor = [0, 1]\n[path.push]\nat = [1, 2]\nfactor = [0, 1]\n";
    let in_order = format!("{}{tables}[[step]]\nat = 1\n[[step]]\nat = 2\n", punch(press, push));
    let at_once = format!("{}{tables}[[step]]\nat = 2\nsteps = 1\n", punch(press, push));
    let by_steps = punch(press, push) + "[[step]]\npaths = { press = 1 }\n[[step]]\npaths = { push = 1 }\n";
    let ten = punch("", "") + "[[step]]\nsteps = 10\n";
    let automatic = punch(press, push) + tables + "[[step]]\nname = \"end\"\nat = 2\nsteps = \"auto\"\n";
    for text in [in_order, at_once, by_steps, ten] {
        let found = solve(&text);
        assert_close(&state(&found), &state(&whole), 1e-10);
        check_invariants(&found, "a way");
    }
    let (found, results) = solve_on(1, &automatic, &[]);
    assert_close(&state(&found), &state(&whole), 1e-10);
    // The end is hit, and the row of the tables on the way to it.
    let [step] = steps(&found) else { panic!("increments are no steps") };
    assert_eq!([value(step, "at"), value(step, "paths.press"), value(step, "paths.push")], [2.0, 1.0, 1.0]);
    let increments = step["increments"].as_u64().unwrap();
    assert!(step["name"] == "end" && increments >= 2, "{increments}");
    assert_eq!(results.before.len(), 0);
    check_history(&found, &results);
}

/// The history has all increments, and its alternations are counted through them.
fn check_history(summary: &Value, results: &Results) {
    for (k, step) in std::iter::zip(1.., steps(summary)) {
        let rows: Vec<_> = results.history.iter().filter(|row| row.step == k).collect();
        let numbers: Vec<u64> = rows.iter().map(|row| row.alternation).collect();
        assert_eq!(numbers, (1..=rows.len() as u64).collect::<Vec<_>>());
        let increments = step["increments"].as_u64().unwrap();
        assert!(
            rows.windows(2).all(|w| w[0].increment <= w[1].increment && w[1].increment <= w[0].increment + 1)
        );
        assert_eq!((rows[0].increment, rows[rows.len() - 1].increment), (1, increments));
        assert_eq!(step["alternations"].as_u64().unwrap(), rows.len() as u64);
    }
}

/// A rigid disc pressed into a block: the contact grows from node to node.
fn disc(steps: &str, path: &str) -> String {
    format!(
        r#"analysis = "plane strain"
[[body]]
name = "block"
material = {{ young = 2e11, poisson = 0.3 }}
mesh.rectangle = {{ x = {{ from = -1, to = 1, cells = 80 }}, y = {{ from = 0, to = 1, cells = 30 }} }}
support = [{{ surface = "bottom", x = 0, y = 0 }}]
[[body]]
name = "disc"
rigid = {{ circle = {{ center = [0, 11], radius = 10 }}, y = -4e-2 {path} }}
[[contact]]
name = "c"
surfaces = ["block.top", "disc.surface"]
[alternation]
tolerance = 1e-12
[[probe]]
name = "a"
body = "block"
at = [0.3, 0.75]
{steps}
"#
    )
}

#[test]
fn automatic_increments_follow_the_contact_and_end_where_the_steps_do() {
    // Down and up again, with the turn in the middle of the last step.
    let table = "[path.down]\nat = [0, 1, 2]\nfactor = [0, 1, 0]\n[[step]]\nat = 0.1\n";
    let auto = |at: f64| format!("[[step]]\nat = {at}\nsteps = \"auto\"\n");
    let auto = table.to_string() + &auto(0.7) + &auto(1.7);
    let (found, results) = solve_on(1, &disc(&auto, ", path = \"down\""), &[]);
    let ends: Vec<[f64; 2]> =
        steps(&found).iter().map(|s| [value(s, "at"), value(s, "paths.down")]).collect();
    assert_eq!(ends[..2], [[0.1, 0.1], [0.7, 0.7]]);
    assert!(ends[2][0] == 1.7 && (ends[2][1] - 0.3).abs() < 1e-15);
    let increments: Vec<u64> = steps(&found).iter().map(|s| s["increments"].as_u64().unwrap()).collect();
    // Nothing touched before the first; the others turn over more than a fifth of the candidates, or turn.
    assert!(increments[0] == 1 && increments[1] > 1 && increments[2] > 1, "{increments:?}");
    check_history(&found, &results);
    // No increment of a pair in contact has changed more than its share.
    let last_rows = |step: u64, increment: u64| {
        results.history.iter().rfind(|row| (row.step, row.increment) == (step, increment)).unwrap()
    };
    for step in 2..=3 {
        for increment in 2..=increments[step as usize - 1] {
            let [before, after] = [increment - 1, increment].map(|i| last_rows(step, i));
            let share = before.active.abs_diff(after.active) as f64 / (after.active + after.open) as f64;
            assert!(share <= 0.2, "{step} {increment}: {share}");
        }
    }
    for (k, factor) in [(1, 0.7), (2, ends[2][1])] {
        let direct = solve(&disc(&format!("[[step]]\nsupports = {factor}\n"), ""));
        assert_close(&at_probes(&steps(&found)[k]), &at_probes(&direct), 1e-10);
    }
}

/// With too few alternations for the whole step its parts are found, and the end is that of the direct run.
#[test]
fn a_step_that_is_cut_back_ends_as_the_direct_one() {
    let limited = |limit: usize, steps: &str| {
        let solver = "response = \"solver\"\nmaterial";
        let text = disc(steps, "").replace("material", solver);
        text.replace("tolerance = 1e-12", &format!("tolerance = 1e-12\nmax_alternations = {limit}"))
    };
    let direct = solve(&limited(1000, "[[step]]\nsupports = 0.1\n[[step]]\n"));
    let of_step = |k: usize| steps(&direct)[k]["alternations"].as_u64().unwrap() as usize;
    let limit = of_step(0);
    assert!(limit < of_step(1), "the second step takes more");
    for way in ["", "steps = 2\n", "steps = \"auto\"\n"] {
        let text = limited(limit, &format!("[[step]]\nsupports = 0.1\n[[step]]\n{way}"));
        let (found, results) = solve_on(1, &text, &[]);
        let least = if way.contains('2') { 2 } else { 1 };
        assert!(steps(&found)[1]["increments"].as_u64().unwrap() > least, "{found}");
        assert_eq!(steps(&found).len(), 2);
        assert_close(&at_probes(&found), &at_probes(&direct), 1e-10);
        check_history(&found, &results);
    }
}

/// A step that does not get to its end leaves the increments before as its last, unnamed, step.
#[test]
fn what_was_reached_is_kept_and_told() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("case.toml");
    // From 0.467 of the pull on nothing holds the upper block down.
    let text = punch("", ", path = \"lift\"").replace("traction = [0, 4e7]", "traction = [0, 1.5e8]");
    let text = text
        + "[path.lift]\nat = [1, 2]\nfactor = [0, 1]\n[[step]]\nname = \"press\"\nat = 1\n[[step]]\nname = \"up\"\nat = 2\nsteps = 4\n";
    std::fs::write(&file, &text).unwrap();
    let out = directory.path().join("out");
    let ran = run(1, &file, &out, &[]);
    let said = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(4), "{said}");
    assert!(
        said.contains("; the load got to loads = 1, supports = 1, temperature = 1, path lift = 0.453125"),
        "{said}"
    );
    let results = Results::read(&out.join(RESULT)).unwrap();
    let [press, up] = results.run.steps.as_deref().unwrap() else { panic!("increments are no steps") };
    assert_eq!((press.name.as_deref(), press.paths["lift"]), (Some("press"), 0.0));
    assert_eq!((up.name.as_deref(), up.paths["lift"], up.at), (None, 0.453125, Some(1.453125)));
    assert!(
        up.increments == 4 && results.history.last().is_some_and(|row| (row.step, row.increment) == (2, 4))
    );
}

/// Followed geometry, a rigid motion on a path, and two ranks that have to agree on the increments.
#[test]
fn a_followed_surface_and_two_ranks_go_the_same_way() {
    let updated = |text: String| {
        text.replace("name = \"c\"", "name = \"c\"\ngeometry = \"updated\"").replace("1e-12", "1e-11")
    };
    let table =
        "[path.down]\nat = [0, 1]\nfactor = [0, 1]\n[[step]]\nat = 0.2\n[[step]]\nat = 1\nsteps = \"auto\"\n";
    let (found, _) = solve_on(1, &updated(disc(table, ", path = \"down\"")), &[]);
    let direct = solve(&updated(disc("[[step]]\n", "")));
    assert!(steps(&found)[1]["increments"].as_u64().unwrap() > 1);
    assert_close(&at_probes(&found), &at_probes(&direct), 1e-8);
    // The block rocks under the moving weight of its load.
    let lift = "[path.push]\nat = [0, 1, 2]\nfactor = [0, 1, -3]\n[[step]]\nat = 1\n[[step]]\nat = 2\nsteps = \"auto\"\n";
    let text = punch("", ", path = \"push\"") + lift;
    let [one, two] = [1, 2].map(|ranks| solve_on(ranks, &text, &[]));
    let increments = |found: &Value| steps(found)[1]["increments"].as_u64().unwrap();
    assert!(increments(&one.0) > 1 && increments(&one.0) == increments(&two.0), "{}", increments(&one.0));
    assert_close(&at_probes(&two.0), &at_probes(&one.0), 1e-10);
    check_history(&two.0, &two.1);
}

/// Increments cost neither memory nor room in the file, but for their history.
#[test]
fn file_and_memory_do_not_depend_on_the_number_of_increments() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("case.toml");
    let [one, many] = [1, 40].map(|n| {
        let text = punch("", "").replace("cells = 29", "cells = 100").replace("cells = 13", "cells = 60");
        std::fs::write(&file, format!("{text}[[step]]\nsteps = {n}\n")).unwrap();
        let out = directory.path().join(n.to_string());
        assert_eq!(run(1, &file, &out, &[]).status.code(), Some(0));
        let found = summary(&out);
        assert_eq!(steps(&found)[0]["increments"], n);
        let size = std::fs::metadata(out.join(RESULT)).unwrap().len();
        (size as f64, value(&found, "peak_memory_mb"))
    });
    assert!((many.0 - one.0).abs() < 0.1 * one.0, "{one:?} {many:?}");
    assert!((many.1 / one.1 - 1.0).abs() < 0.05, "{one:?} {many:?}");
}

#[test]
fn check_lists_the_paths() {
    let text = block("press", "push", "", "s", "t")
        + "[path.press]\nat = [0, 1]\nfactor = [0, 1]\n[[step]]\nat = 1\npaths = { push = 0.5, s = 1, t = 2 }\nsteps = 4\n";
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("case.toml");
    std::fs::write(&file, text).unwrap();
    let said = check(&file);
    for line in [
        "path press: factor 0, 1 at 0, 1; followed by 1 load\n",
        "path push: factor 0.5 after the steps; followed by 1 load\n",
        "path s: factor 1 after the steps; followed by 1 support\n",
        "path t: factor 2 after the steps; followed by 1 temperature\n",
        "1 load steps, 4 increments\n",
    ] {
        assert!(said.contains(line), "{line} is not in\n{said}");
    }
}

fn check(case: &Path) -> String {
    let mut command = common::mpirun(1);
    let ran = command.arg(env!("CARGO_BIN_EXE_kontakt")).arg("check").arg(case).output().unwrap();
    String::from_utf8_lossy(&ran.stdout).into_owned()
}

/// A temperature whose path begins later is the reference temperature until then, from the first step on.
#[test]
fn heat_that_begins_later() {
    let young = "young = 2e11";
    let over_temperature = "young = { temperature = [300, 400], value = [2e11, 1.6e11] }";
    let yields = "young = 2e11, plasticity = { yield_stress = 1.5e8 }";
    for (material, hot) in [(young, 2e11), (over_temperature, 1.6e11), (yields, 2e11)] {
        let text = format!(
            r#"analysis = "plane stress"
[[body]]
name = "block"
material = {{ {material}, poisson = 0.3, expansion = 1e-5, reference_temperature = 300 }}
mesh.rectangle = {{ x = {{ from = 0, to = 1, cells = 2 }}, y = {{ from = 0, to = 1, cells = 2 }} }}
temperature = {{ value = 400, path = "heat" }}
support = [{{ surface = "bottom", y = 0 }}, {{ surface = "left", x = 0 }}]
load = [{{ surface = "top", pressure = 1e8 }}]
[path.heat]
at = [1, 2]
factor = [0, 1]
[[step]]
at = 1
[[step]]
at = 2
[[probe]]
name = "top"
body = "block"
at = [0, 1]
"#
        );
        let found = solve(&text);
        let expected = [(300.0, -1e8 / 2e11), (400.0, 1e-3 - 1e8 / hot)];
        for (step, (temperature, u)) in std::iter::zip(steps(&found), expected) {
            assert_close(&[value(step, "probes.top.temperature")], &[temperature], 1e-12);
            assert_close(&[value(step, "probes.top.displacement.1")], &[u], 1e-9);
            assert_close(&[value(step, "probes.top.stress.yy")], &[-1e8], 1e-9);
        }
    }
}
