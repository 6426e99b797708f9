//! `kontakt study`: errors and orders of a known problem, going on after a kill, refusals.
mod common;

use common::mpirun;
use std::{
    collections::BTreeMap,
    path::Path,
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

/// Two rings pressed into each other: exact by Lame.
const RINGS: &str = r#"
analysis = "plane strain"
[[body]]
name = "inner"
material = { young = 2.1e11, poisson = 0.3 }
element = "quad8"
mesh.ring = { radius = { from = 0.05, to = 0.1, cells = 2 }, angle = { from = 0, to = 90, cells = 6 } }
support = [{ surface = "start", y = 0 }, { surface = "end", x = 0 }]
[[body]]
name = "outer"
material = { young = 7e10, poisson = 0.33 }
element = "quad8"
mesh.ring = { radius = { from = 0.1, to = 0.15, cells = 2 }, angle = { from = 0, to = 90, cells = 6 } }
support = [{ surface = "start", y = 0 }, { surface = "end", x = 0 }]
[[contact]]
name = "fit"
surfaces = ["inner.outer", "outer.inner"]
gap_offset = -5e-5
[[probe]]
name = "bore"
body = "inner"
at = [0.05, 0]
[alternation]
tolerance = 1e-10
"#;
const LAME: &str = "[exact]\npress_fit = { radii = [0.05, 0.1, 0.15], interference = 5e-5 }\n";

fn study(case: &Path, out: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kontakt"));
    command.arg("study").arg(case).arg("--out").arg(out).args(arguments);
    command
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The rows of `study.csv`, by the names of the columns.
fn rows(out: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(out.join("study.csv")).expect("study.csv is there");
    reader.deserialize().map(|row| row.expect("a row")).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} = {:?}", row[column]))
}

#[test]
fn errors_and_orders_are_those_of_the_elements() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
    let page = directory.path().join("pages/rings.md");
    let arguments = ["--levels", "2..3", "--elements", "quad4,quad8", "--repeat", "1", "--page"];
    let output = study(&case, &out, &arguments).arg(&page).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let rows = rows(&out);
    let keys: Vec<(&str, &str)> = rows.iter().map(|row| (&row["element"][..], &row["level"][..])).collect();
    assert_eq!(keys, [("quad4", "2"), ("quad4", "3"), ("quad8", "2"), ("quad8", "3")]);
    // Displacements converge with order 2 and, superconvergent with 2 x 2 points, 4.
    for (row, order) in [(&rows[1], 2.0), (&rows[3], 4.0)] {
        let found = number(row, "bore.displacement.order");
        assert!((found - order).abs() < 0.25, "{}: order {found}", row["element"]);
    }
    // The error is the relative distance from Lame's displacement; u = -p b^2 (...)/(...), worked out by hand.
    let (e, nu) = (2.1e11 / 0.91, 0.3 / 0.7);
    let (e2, nu2) = (7e10 / (1.0 - 0.33 * 0.33), 0.33 / 0.67);
    let opening = 0.1 / e2 * (0.0325 / 0.0125 + nu2) + 0.1 / e * (0.0125 / 0.0075 - nu);
    let pressure = 5e-5 / opening;
    let exact = -pressure * 0.01 / 0.0075 * 2.0 * 0.05 / e;
    for row in &rows {
        let error = (number(row, "bore.displacement.x") / exact - 1.0).abs();
        let stated = number(row, "bore.displacement.error");
        assert!((error - stated).abs() < 1e-9 + 1e-6 * error, "{error:e}, {stated:e}");
        let error = (number(row, "fit.peak_pressure") / pressure - 1.0).abs();
        assert!((error - number(row, "fit.peak_pressure.error")).abs() < 1e-9 + 1e-6 * error);
        assert_eq!((&row["converged"][..], &row["ending"][..]), ("1", "converged"));
        let [seconds, process, cpu] =
            ["seconds", "process_seconds", "cpu_seconds"].map(|column| number(row, column));
        assert!(seconds > 0.0 && process > seconds && cpu > 0.0, "{seconds} {process} {cpu}");
        assert!(number(row, "peak_memory_mb") > 1.0 && number(row, "tolerance") == 1e-10);
    }
    // The same numbers in the HDF5 file; page and pictures are there.
    let file = hdf5::File::open(out.join("study.h5")).unwrap();
    let dofs = file.dataset("study/dofs").unwrap().read_raw::<f64>().unwrap();
    assert_eq!(dofs, rows.iter().map(|row| number(row, "dofs")).collect::<Vec<_>>());
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.contains("For 1 % of peak pressure: level") && text.contains("(rings.svg)"), "{text}");
    assert!(
        page.with_extension("svg").exists()
            && out.join("study.svg").exists()
            && out.join("study.png").exists()
    );
}

#[test]
fn without_an_exact_solution_errors_are_measured_against_the_limit() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    std::fs::write(&case, RINGS).unwrap();
    let output = study(&case, &out, &["--levels", "0..2", "--repeat", "1"]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let limits = rows(&out);
    std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
    let output = study(&case, &out, &["--levels", "0..2", "--repeat", "1"]).output().unwrap();
    // What is exact is no part of a run.
    assert!(stderr(&output).contains("all of them are done already"), "{}", stderr(&output));
    for (limit, exact) in limits.iter().zip(rows(&out)).take(2) {
        let (limit, exact) =
            (number(limit, "bore.displacement.error"), number(&exact, "bore.displacement.error"));
        assert!((limit / exact - 1.0).abs() < 0.05, "{limit:e} against the limit, {exact:e} exact");
    }
    let output = study(&case, &out, &["--levels", "0..2", "--set", "exact={ peak_pressure = 3e7 }"]).output();
    let output = output.unwrap();
    assert!(stderr(&output).contains("differ by"), "a wrong exact value is noticed: {}", stderr(&output));
}

#[test]
fn a_study_that_was_killed_goes_on_and_does_no_run_twice() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
    let arguments = ["--levels", "0..2", "--repeat", "2"];
    let mut child =
        study(&case, &out, &arguments).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    let journal = || std::fs::read_to_string(out.join("runs.jsonl")).unwrap_or_default();
    let start = Instant::now();
    // The first line is the header.
    while journal().lines().count() < 3 {
        assert!(start.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = journal();
    let done = before.lines().count() - 1;
    assert!(done < 6, "the kill came too late");
    let output = study(&case, &out, &arguments).output().unwrap();
    let text = stderr(&output);
    assert!(output.status.success(), "{text}");
    assert!(text.contains(&format!("{done} are done already, {} are left", 6 - done)), "{text}");
    let after = journal();
    assert!(after.starts_with(&before) && after.lines().count() == 7, "{after}");
    let mut names: Vec<String> = after
        .lines()
        .skip(1)
        .map(|line| {
            let entry: serde_json::Value = serde_json::from_str(line).unwrap();
            format!("{} {}", entry["run"], entry["repetition"])
        })
        .collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), 6, "{names:?}");
    assert!(rows(&out).iter().all(|row| row["repetitions"] == "2"));
    let left = std::fs::read_dir(&out).unwrap().flatten();
    assert!(left.map(|e| e.file_name()).all(|name| !name.to_string_lossy().starts_with(".run-")));
    // Another case begins anew, and says so.
    std::fs::write(&case, format!("{RINGS}{LAME}").replace("7e10", "8e10")).unwrap();
    let output = study(&case, &out, &["--levels", "0", "--repeat", "1"]).output().unwrap();
    assert!(stderr(&output).contains("the case has changed"), "{}", stderr(&output));
    assert_eq!(journal().lines().count(), 2);
}

/// Processes whose command line names this directory, but for one.
fn processes(directory: &Path, but: u32) -> Vec<String> {
    let of = |entry: std::fs::DirEntry| {
        let pid = entry.file_name().to_string_lossy().parse::<u32>().ok().filter(|pid| *pid != but)?;
        let line = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let line = String::from_utf8_lossy(&line).replace('\0', " ");
        line.contains(&directory.display().to_string()).then(|| format!("{pid} {line}"))
    };
    std::fs::read_dir("/proc").unwrap().flatten().filter_map(of).collect()
}

/// mpirun, and the ranks it has started, end with a study that is killed.
#[test]
fn runs_end_with_their_study() {
    for ranks in ["1", "2"] {
        let directory = tempfile::tempdir().unwrap();
        let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
        std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
        let arguments = ["--levels", "5", "--repeat", "1", "--ranks", ranks, "--oversubscribe"];
        let mut child =
            study(&case, &out, &arguments).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
        let start = Instant::now();
        // mpirun, and every rank of the run.
        let expected = 1 + ranks.parse::<usize>().unwrap();
        let held = || {
            std::fs::read_dir(&out)
                .is_ok_and(|d| d.flatten().any(|entry| entry.path().join(".kontakt.lock").exists()))
        };
        while !held() || processes(&out, child.id()).len() < expected {
            assert!(start.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
            std::thread::sleep(Duration::from_millis(20));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let killed = Instant::now();
        while !processes(&out, child.id()).is_empty() {
            let left = processes(&out, child.id());
            assert!(killed.elapsed() < Duration::from_secs(20), "still there: {left:?}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

#[test]
fn more_ranks_than_cores_are_refused_unless_forced() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
    let output = study(&case, &out, &["--levels", "0", "--ranks", "1000"]).output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("study.ranks: 1000 was given") && text.contains("--oversubscribe"), "{text}");
    let more = (std::thread::available_parallelism().unwrap().get() + 1).to_string();
    let forced = ["--levels", "0", "--repeat", "1", "--ranks", &more, "--oversubscribe"];
    let output = study(&case, &out, &forced).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(rows(&out)[0]["ranks"], more);
}

/// The runs of one input are not lost to a study of another in the same directory, and two at once do not mix.
#[test]
fn another_input_does_not_overwrite_the_runs_of_the_first() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
    let arguments = ["--levels", "0", "--repeat", "1"];
    assert!(study(&case, &out, &arguments).output().unwrap().status.success());
    let first = std::fs::read_to_string(out.join("runs.jsonl")).unwrap();
    let output = study(&case, &out, &[&arguments[..], &["--set", "thickness=2"]].concat()).output().unwrap();
    assert!(stderr(&output).contains("those are kept"), "{}", stderr(&output));
    let output = study(&case, &out, &arguments).output().unwrap();
    assert!(stderr(&output).contains("all of them are done already"), "{}", stderr(&output));
    assert_eq!(std::fs::read_to_string(out.join("runs.jsonl")).unwrap(), first);
}

/// Components, equivalent stress and energy: those of Lame's solution. By equilibrium and Hooke's law the energy of a ring
/// is half the work of the joint's pressure on its displacement.
#[test]
fn components_and_energies_are_quantities() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
    let arguments = ["--levels", "1..3", "--repeat", "1", "--quantity", "bore.stress.yy"];
    let output = study(&case, &out, &arguments).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(stdout.contains("stress yy at bore"), "{stdout}");
    let rows = rows(&out);
    let finest = rows.last().unwrap();
    let (e, nu) = (2.1e11 / 0.91, 0.3 / 0.7);
    let (e2, nu2) = (7e10 / (1.0 - 0.33 * 0.33), 0.33 / 0.67);
    let outer = 0.1 / e2 * (0.0325 / 0.0125 + nu2);
    let inner = 0.1 / e * (0.0125 / 0.0075 - nu);
    let p = 5e-5 / (outer + inner);
    // At the bore: no radial stress, -2 p b^2 / (b^2 - a^2) around it, nu times that along z.
    let hoop: f64 = -2.0 * p * 0.01 / 0.0075;
    let equivalent = hoop.abs() * (1.0 - 0.3 + 0.09f64).sqrt();
    // A quarter of the joint, a metre long.
    let energy = |u: f64| 0.5 * p * (p * u) * 0.1 * std::f64::consts::FRAC_PI_2;
    for (name, exact, within) in [
        ("bore.stress.yy", hoop, 1e-3),
        // The radial stress, which vanishes only in the limit, enters.
        ("bore.stress.von_mises", equivalent, 2e-3),
        ("inner.strain_energy", energy(inner), 1e-4),
        ("outer.strain_energy", energy(outer), 1e-4),
        ("strain_energy", energy(inner + outer), 1e-4),
    ] {
        let found = number(finest, name);
        assert!((found / exact - 1.0).abs() < within, "{name}: {found:e} for {exact:e}");
        let error = number(finest, &format!("{name}.error"));
        assert!(error < within, "{name}: error {error:e}");
    }
}

/// A long cantilever on the tip of a short one: one node in contact, whatever the mesh.
const LEAF: &str = r#"
analysis = "plane stress"
material.steel = { young = 2.1e11, poisson = 0.3 }
[[body]]
name = "long"
material = "steel"
mesh.rectangle = { x = { from = 0, to = 0.2, cells = 20 }, y = { from = 0, to = 0.01, cells = 1 } }
support = [{ surface = "left", x = 0, y = 0 }]
load = [{ surface = "right", force = [0, -1e4] }]
[[body]]
name = "short"
material = "steel"
mesh.rectangle = { x = { from = 0, to = 0.1, cells = 10 }, y = { from = -0.01, to = 0, cells = 1 } }
support = [{ surface = "left", x = 0, y = 0 }]
[[contact]]
name = "tip"
surfaces = ["long.bottom", "short.top"]
"#;

#[test]
fn one_node_in_contact_has_no_limit_and_a_run_says_so() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("leaf.toml"), directory.path().join("out"));
    std::fs::write(&case, LEAF).unwrap();
    let output = study(&case, &out, &["--levels", "0..2", "--repeat", "1"]).output().unwrap();
    let text = stderr(&output);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("fewer than 3 nodes of tip are in contact (3 of 3 rows in all)"), "{text}");
    assert!(!rows(&out)[0].keys().any(|column| column.ends_with(".error")), "no limit is taken");
    let run = Command::new(env!("CARGO_BIN_EXE_kontakt"))
        .args([
            "run",
            &case.display().to_string(),
            "--out",
            &directory.path().join("run").display().to_string(),
        ])
        .output()
        .unwrap();
    assert!(
        run.status.success() && stderr(&run).contains("contact 'tip': only 1 node is in contact"),
        "{}",
        stderr(&run)
    );
    // With an exact value errors are what they are.
    std::fs::write(&case, format!("{LEAF}[exact]\nforce = 12444.8\n")).unwrap();
    let output = study(&case, &out, &["--levels", "0..2", "--repeat", "1"]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(rows(&out).iter().all(|row| number(row, "tip.force.error") < 0.02));
}

#[test]
fn runs_that_do_not_converge_are_listed_and_not_in_the_curves() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
    let limit = ["--levels", "0", "--repeat", "2", "--set", "alternation.max_alternations=2"];
    let solver = ["--set", "body.inner.response=solver"];
    let output = study(&case, &out, &limit).args(solver).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let rows = rows(&out);
    assert_eq!((&rows[0]["converged"][..], &rows[0]["ending"][..]), ("0", "max alternations"));
    assert_eq!(rows[0]["repetitions"], "1", "what fails is not repeated");
    assert!(std::fs::read_to_string(out.join("study.md")).unwrap().contains("**max alternations**"));
}

#[test]
fn wrong_keys_and_flags_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    let check = |addition: &str, arguments: &[&str], expected: &[&str]| {
        std::fs::write(&case, format!("{RINGS}{addition}")).unwrap();
        let output = study(&case, &out, arguments).output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{addition} {arguments:?}: {text}");
        assert!(expected.iter().all(|part| text.contains(part)), "{addition} {arguments:?}: {text}");
    };
    let none: &[&str] = &[];
    check("[study]\nlevel = 3\n", none, &["rings.toml:26: study.level: unknown key 'level'", "'levels'"]);
    check("[study]\nlevels = \"3..1\"\n", none, &["study.levels", "\"3..1\" was given", "\"0..3\""]);
    check("[study]\nelements = [\"quad5\"]\n", none, &["study.elements.0", "did you mean 'quad4'"]);
    check("[study]\ntolerances = [1]\n", none, &["study.tolerances.0: 1 was given; must be in (0, 1e-2]"]);
    check("[study]\nranks = [1, 1]\n", none, &["study.ranks", "listed twice"]);
    check("[study]\nweights = [\"response\"]\n", none, &["weights", "relaxed"]);
    check("", &["--levels", "0..x"], &["--set: study.levels: \"0..x\" was given"]);
    check("", &["--levels", "0,1"], &["[exact]", "at least three"]);
    check("", &["--drivers", "active"], &["study.drivers.0", "active set"]);
    check("[exact]\n", none, &["exact: nothing is given"]);
    check("[exact]\npeak_presure = 1\n", none, &["exact.peak_presure", "did you mean 'peak_pressure'"]);
    check("[exact]\nforce = \"1 MPa\"\n", none, &["exact.force", "a force"]);
    check("[exact]\nprobe.bor = { x = 0, y = 0 }\n", none, &["there is no probe 'bor'", "'bore'"]);
    check("[exact]\nprobe.bore = { x = 0 }\n", none, &["'x', 'y' belong together"]);
    check("[exact]\npair = \"fits\"\nforce = 1\n", none, &["exact.pair", "did you mean 'fit'"]);
    check(
        "[exact]\npress_fit = { radii = [1, 2], interference = 1 }\n",
        none,
        &["exact.press_fit.radii", "bore"],
    );
    check("[exact]\nhertz_line = { radius = [1] }\n", none, &["one of 'force' and 'half_width'"]);
    check("[exact]\nheated_blocks = { heights = [1, 1], width = 1 }\n", none, &["needs its 'gap'"]);
    let named = ["--quantity", "fit.peak"];
    check(LAME, &named, &["study.quantity: \"fit.peak\" was given; there is: fit.peak_pressure, fit.force"]);
}

#[test]
fn mpirun_is_its_own_business() {
    let directory = tempfile::tempdir().unwrap();
    let (case, out) = (directory.path().join("rings.toml"), directory.path().join("out"));
    std::fs::write(&case, format!("{RINGS}{LAME}")).unwrap();
    let under = |ranks: usize| {
        let mut command = mpirun(ranks);
        command
            .arg(env!("CARGO_BIN_EXE_kontakt"))
            .args(["study", "--levels", "0", "--repeat", "1", "--ranks", "2"]);
        command.arg(&case).arg("--out").arg(&out).output().unwrap()
    };
    let output = under(2);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(stderr(&output).matches("it starts mpirun itself").count(), 1, "{}", stderr(&output));
    // On one rank nothing of the surrounding MPI reaches the runs.
    let output = under(1);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(rows(&out)[0]["ranks"], "2");
}
