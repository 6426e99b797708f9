//! The command line: exit codes, refusals, options of PETSc, what a bad run leaves behind.
mod common;

use common::{mpirun, run, summary};
use kontakt::vector::larger;
use std::path::{Path, PathBuf};

fn case(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("cases").join(name)
}

fn stderr(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Pulled upwards by a load, or left to the relaxed driver, which cannot hold it.
#[test]
fn a_body_that_nothing_holds_is_refused_with_its_motion() {
    let free = "body.upper.support=[{point=[0, 0.05], x=0}]";
    let pull = "body.upper.load=[{surface=\"top\", pressure=-1e6}]";
    let relaxed = "alternation.driver=\"relaxed\"";
    for (ranks, second) in [(1, pull), (2, pull), (1, relaxed), (2, relaxed)] {
        let out = tempfile::tempdir().unwrap();
        let output = run(ranks, &case("patch"), out.path(), &["--set", free, "--set", second]);
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(4), "{text}");
        assert!(text.contains("body 'upper'") && text.contains("translation y"), "{text}");
        assert_eq!(text.matches("error:").count(), 1, "one message: {text}");
        let summary = summary(out.path());
        assert_eq!((&summary["converged"], &summary["reason"]), (&false.into(), &"unrestrained".into()));
        assert_eq!(summary["exit_code"], 4);
        assert!(summary["error"].as_str().unwrap().contains("translation y"), "{summary}");
    }
}

/// Two blocks on each other, the lower one without a support against the load: both go.
#[test]
fn bodies_that_move_together_are_named_together() {
    let no_floor = "body.lower.support=[{ point=[0, 0], x=0 }]";
    let free = "body.upper.support=[{ point=[0, 0.05], x=0 }]";
    let press = "body.upper.load=[{ surface=\"top\", pressure=1e6 }]";
    for ranks in [1, 2] {
        let out = tempfile::tempdir().unwrap();
        let output =
            run(ranks, &case("patch"), out.path(), &["--set", no_floor, "--set", free, "--set", press]);
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(4), "{text}");
        let told =
            "bodies 'lower' and 'upper' are not held against the loads and move together: translation y";
        assert!(text.contains(told) && text.matches("error:").count() == 1, "{text}");
    }
}

/// What is refused before it starts leaves the results alone; from there on the old verdict is gone.
#[test]
fn no_verdict_outlives_its_run() {
    let out = tempfile::tempdir().unwrap();
    assert_eq!(run(2, &case("patch"), out.path(), &[]).status.code(), Some(0));
    let before = summary(out.path());
    for set in ["body.upper.youn=1", "contact.interface.surfaces=[\"upper.botom\", \"lower.top\"]"] {
        let output = run(2, &case("patch"), out.path(), &["--set", set]);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains("--set"), "{}", stderr(&output));
    }
    assert_eq!(before, summary(out.path()));
    // Only the mesh tells that this is wrong.
    let infinite = "body.upper.support.0.y=\"1/(x - 0.04)\"";
    let free = "body.upper.support=[{point=[0, 0.05], x=0}]";
    let pull = "body.upper.load=[{surface=\"top\", pressure=-1e6}]";
    for (ranks, sets, code, reason) in [
        (1, &[infinite][..], 2, "refused"),
        (2, &[infinite], 2, "refused"),
        (2, &[free, pull], 4, "unrestrained"),
    ] {
        assert_eq!(run(1, &case("patch"), out.path(), &[]).status.code(), Some(0));
        let arguments: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let output = run(ranks, &case("patch"), out.path(), &arguments);
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        let summary = summary(out.path());
        assert_eq!((&summary["converged"], &summary["reason"]), (&false.into(), &reason.into()));
        assert!(stderr(&output).contains("had the results of another input"), "{}", stderr(&output));
        assert!(stderr(&output).contains(summary["error"].as_str().unwrap()), "{summary}");
    }
    // The same input again is no other one.
    for said in [true, false] {
        let output = run(1, &case("patch"), out.path(), &[]);
        assert_eq!(stderr(&output).contains("another input"), said, "{}", stderr(&output));
    }
}

/// A run long enough to be met at work.
fn slow(out: &Path) -> std::process::Child {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_kontakt"));
    command
        .arg("run")
        .arg(case("hertz-line"))
        .arg("--out")
        .arg(out)
        .args(["--set", "body.lower.mesh.refine=3"]);
    command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap()
}

/// Waits until the run has its directory.
fn started(out: &Path, child: &mut std::process::Child) {
    let start = std::time::Instant::now();
    while !out.join(".kontakt.lock").exists() {
        assert!(start.elapsed().as_secs() < 60 && child.try_wait().unwrap().is_none(), "it has not started");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

#[test]
fn a_killed_run_leaves_no_verdict_and_no_lock_and_two_do_not_mix() {
    let out = tempfile::tempdir().unwrap();
    assert_eq!(run(1, &case("patch"), out.path(), &[]).status.code(), Some(0));
    let mut first = slow(out.path());
    started(out.path(), &mut first);
    let second = run(2, &case("patch"), out.path(), &[]);
    let text = stderr(&second);
    assert_eq!(second.status.code(), Some(2), "{text}");
    let process = format!("another run (process {}", first.id());
    assert!(text.contains(&process) && text.contains("--out"), "{text}");
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(!out.path().join("summary.json").exists());
    assert!(out.path().join(".kontakt.lock").exists(), "the kill came in the middle");
    assert_eq!(run(2, &case("patch"), out.path(), &[]).status.code(), Some(0));
    assert_eq!(summary(out.path())["converged"], true);
    assert!(!out.path().join(".kontakt.lock").exists());
}

#[test]
fn an_iteration_limit_is_no_convergence() {
    let out = tempfile::tempdir().unwrap();
    // Bodies that answer by their solver take more than two.
    let solver = ["upper", "lower"].map(|body| format!("body.{body}.response=solver"));
    let limit = "alternation.max_alternations=2";
    let arguments = ["--set", limit, "--set", &solver[0], "--set", &solver[1]];
    let output = run(2, &case("hertz-line"), out.path(), &arguments);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert_eq!(summary(out.path())["reason"], "max_alternations");
    assert!(out.path().join("result.vtkhdf").exists(), "what there is is kept");
}

#[test]
fn petsc_options_reach_the_body_they_name() {
    let (direct, iterative) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    assert_eq!(run(2, &case("patch"), direct.path(), &[]).status.code(), Some(0));
    let options = ["-body_upper_ksp_type", "cg", "-body_upper_pc_type", "jacobi"];
    let output = run(2, &case("patch"), iterative.path(), &options);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    // The same answer; a body that answers by its solver takes other alternations to it.
    let (condensed, mut solved) = (summary(direct.path()), summary(iterative.path()));
    assert_eq!(
        (&condensed["bodies"][1]["response"], &solved["bodies"][1]["response"]),
        (&"condensed".into(), &"solver".into())
    );
    solved["alternations"] = condensed["alternations"].clone();
    common::assert_same(&condensed, &solved, 1e-8, "cg against Cholesky");
    // One iteration is not enough: the option is not ignored.
    let options =
        ["-body_upper_ksp_type", "cg", "-body_upper_ksp_max_it", "1", "-body_upper_pc_type", "none"];
    let output = run(1, &case("patch"), iterative.path(), &options);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let text = stderr(&output);
    assert!(text.contains("body 'upper'") && text.contains("after 1 iterations"), "{text}");
    let output = run(1, &case("patch"), iterative.path(), &["-body_uper_ksp_type", "cg"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}

/// Whatever a user makes of a body's solver, the answer is the direct one or the verdict says that there is none.
#[test]
fn a_solver_that_is_changed_changes_nothing_else() {
    let out = tempfile::tempdir().unwrap();
    assert_eq!(run(1, &case("patch"), out.path(), &[]).status.code(), Some(0));
    let direct = common::value(&summary(out.path()), "pairs.interface.normal_force");
    for options in [
        "-body_lower_pc_type jacobi",
        "-body_lower_pc_type none",
        "-body_upper_pc_type icc",
        "-body_upper_pc_type gamg",
        "-body_upper_ksp_type preonly -body_upper_pc_type sor",
        "-body_upper_pc_type asm",
        "-body_lower_ksp_type cg -body_lower_pc_type gamg -body_lower_ksp_rtol 0.1",
        "-body_lower_ksp_type gmres -body_lower_pc_type jacobi -body_lower_ksp_atol 1e9",
        "-body_lower_ksp_type richardson -body_lower_pc_type sor -body_lower_ksp_rtol 0.5",
    ] {
        let words: Vec<&str> = options.split(' ').collect();
        let output = run(1, &case("patch"), out.path(), &words);
        match output.status.code() {
            Some(0) => {
                let found = common::value(&summary(out.path()), "pairs.interface.normal_force");
                assert!((found / direct - 1.0).abs() < 1e-7, "{options}: {found} for {direct}");
                let said = stderr(&output);
                let loose = ["preonly", "rtol", "atol"].iter().any(|word| options.contains(word));
                assert!(said.contains("warning: body '") || !loose, "{options}: {said}");
            }
            Some(3) => assert!(stderr(&output).contains("a relative residual of"), "{}", stderr(&output)),
            code => panic!("{options}: {code:?} {}", stderr(&output)),
        }
    }
}

/// One line with the option, its value and what there is.
#[test]
fn an_unknown_solver_is_wrong_input() {
    let out = tempfile::tempdir().unwrap();
    for (options, known) in
        [(["-body_upper_pc_type", "gamgg"], "gamg"), (["-body_upper_ksp_type", "cgg"], "gmres")]
    {
        let output = run(2, &case("patch"), out.path(), &options);
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        let line = text.lines().find(|line| line.contains(&options.join(" "))).expect(&text);
        assert!(line.contains(known) && !text.contains("    at "), "{text}");
    }
}

/// PETSc's own options work, and those that nothing asks for are named after the run.
#[test]
fn options_of_petsc_itself() {
    let out = tempfile::tempdir().unwrap();
    let options = ["-log_view", "-memory_view", "-ksp_type", "cg", "-body_upper_kps_type", "cg"];
    let output = run(2, &case("patch"), out.path(), &options);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for stage in ["set-up", "assemble", "factor", "condense", "alternate", "write"] {
        assert!(
            said.lines().any(|l| l.contains("Stage") || l.contains(stage)) && said.contains(stage),
            "{stage}: {said}"
        );
    }
    let warnings = summary(out.path())["warnings"].to_string();
    assert!(
        warnings.contains("-ksp_type was") && warnings.contains("-body_upper_kps_type was"),
        "{warnings}"
    );
    assert!(!warnings.contains("log_view") && !warnings.contains("memory_view"), "{warnings}");
}

/// Too little memory ends at once, with one message and a code of its own.
#[cfg(target_os = "linux")]
#[test]
fn too_little_memory_is_said() {
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("case.toml");
    let side = "{ from = 0, to = 1, cells = 400 }";
    std::fs::write(
        &file,
        format!(
            "analysis = \"plane strain\"\n[[body]]\nname = \"block\"\nmaterial = {{ young = 2e11, poisson = 0.3 }}\n\
             mesh.rectangle = {{ x = {side}, y = {side} }}\nsupport = [{{ surface = \"bottom\", x = 0, y = 0 }}]\n\
             load = [{{ surface = \"top\", pressure = 1e6 }}]\n"
        ),
    )
    .unwrap();
    // Kilobytes: from too little to begin with, to too little for the factor.
    for limit in [450_000, 650_000] {
        let command = format!(
            "ulimit -v {limit}; exec timeout 300 {} run {} --out {}",
            env!("CARGO_BIN_EXE_kontakt"),
            file.display(),
            out.path().display()
        );
        let output = std::process::Command::new("sh").args(["-c", &command]).output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(6), "{limit}: {text}");
        assert_eq!(text.matches("kontakt: error").count(), 1, "{limit}: {text}");
        assert!(text.contains("memory") || text.contains("MB"), "{limit}: {text}");
    }
}

#[test]
fn factorisations_are_counted() {
    let out = tempfile::tempdir().unwrap();
    run(2, &case("hertz-line"), out.path(), &[]);
    let summary = summary(out.path());
    let mut interface = 0;
    for body in summary["bodies"].as_array().unwrap() {
        assert_eq!(body["factorisations"], 1);
        interface += body["interface_factorisations"].as_u64().unwrap();
    }
    // The leading body's, once for each active set; none where the contact problem is settled on the dense dual matrix.
    assert!(interface <= summary["updates"].as_u64().unwrap() + 1, "{interface}");
}

#[test]
fn check_says_what_a_run_would_cost() {
    let mut command = mpirun(3);
    command.arg(env!("CARGO_BIN_EXE_kontakt")).arg("check").arg(case("heated-gap"));
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(text.contains("body lower: 306 dofs") && text.contains("thermal strain"), "{text}");
    assert!(text.contains("2 rank(s)"), "{text}");
}

/// A file of PETSc options beside a case may ask for any file to be written.
#[test]
fn files_of_petsc_options_beside_a_case_are_not_read() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::copy(case("patch").join("case.toml"), directory.path().join("case.toml")).unwrap();
    for name in [".petscrc", "petscrc"] {
        std::fs::write(directory.path().join(name), "-log_view :written\n-body_upper_ksp_type cg\n").unwrap();
    }
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_kontakt"))
        .current_dir(directory.path())
        .args(["run", ".", "--out", "results"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(!directory.path().join("written").exists());
    assert_eq!(summary(&directory.path().join("results"))["bodies"][1]["response"], "condensed");
}

/// Gap or overlap and candidates of every pair, in `check` and in the log, and a warning of what no fit has.
#[test]
fn gaps_and_overlaps_are_told() {
    let told = |command: &str, gap: &str, ranks: usize| {
        let out = tempfile::tempdir().unwrap();
        let mut process = mpirun(ranks);
        process.arg(env!("CARGO_BIN_EXE_kontakt")).arg(command).arg(case("patch"));
        process.args(["--set", &format!("contact.interface.gap={gap}")]);
        if command == "run" {
            process.arg("--out").arg(out.path());
        }
        let output = process.output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output) + &String::from_utf8_lossy(&output.stdout)
    };
    for (command, ranks) in [("check", 1), ("run", 1), ("run", 2)] {
        let text = told(command, "1e-4", ranks);
        assert!(text.contains("contact interface: 6 candidates, gap 1.000e-4 to 1.000e-4"), "{text}");
        assert!(!text.contains("no fit"), "{text}");
        let text = told(command, "-1e-5", ranks);
        assert!(text.contains("contact interface: 6 candidates, overlap 1.000e-5 to 1.000e-5"), "{text}");
        assert!(!text.contains("no fit"), "{text}");
        // A block of 40 by 20 mm or by 30 mm.
        let text = told(command, "-1e-3", ranks);
        assert_eq!(text.matches("overlap by up to 1.000e-3 at the start").count(), 1, "{text}");
    }
}

#[test]
fn help_needs_no_mpi() {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_kontakt")).arg("--help").output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && text.contains("Exit codes") && text.contains("check"), "{text}");
}

#[test]
fn one_body_without_contact_is_one_solve() {
    let directory = tempfile::tempdir().unwrap();
    let file: &Path = &directory.path().join("bar.toml");
    let text = r#"
analysis = "plane stress"
[[body]]
name = "bar"
material = { young = "200 GPa", poisson = 0.25 }
element = "quad8"
mesh.rectangle = { x = { from = 0, to = 2, cells = 4 }, y = { from = 0, to = 1, cells = 2 } }
support = [{ surface = "left", x = 0 }, { point = [0, 0], y = 0 }]
load = [{ surface = "right", traction = ["100 MPa", 0] }]
[[probe]]
name = "end"
body = "bar"
at = [2, 1]
"#;
    std::fs::write(file, text).unwrap();
    for ranks in [1, 2, 3] {
        let out = tempfile::tempdir().unwrap();
        let output = run(ranks, file, out.path(), &[]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let summary = summary(out.path());
        assert_eq!(summary["reason"], "no_contact");
        assert!((common::value(&summary, "probes.end.displacement.0") / 1e-3 - 1.0).abs() < 1e-10);
        assert!((common::value(&summary, "probes.end.displacement.1") / -1.25e-4 - 1.0).abs() < 1e-10);
        assert!((common::value(&summary, "probes.end.stress.xx") / 1e8 - 1.0).abs() < 1e-10);
    }
}

/// An error that only one rank of a group sees ends all of them, with one message.
#[test]
fn an_error_on_one_rank_stops_all() {
    for (key, text) in [
        ("body.lower.temperature=\"393/(x - 0.04)\"", "temperature"),
        ("body.upper.support.0.y=\"1/(x - 0.04)\"", "displacement"),
    ] {
        let out = tempfile::tempdir().unwrap();
        let output = run(4, &case("heated-gap"), out.path(), &["--set", key]);
        let log = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{log}");
        assert!(log.contains(text) && log.matches("error:").count() == 1, "{log}");
    }
}

/// Two squares pressed together in so many steps, so many cells along each side.
fn stepped(steps: usize, cells: usize) -> String {
    let body = |name: &str, x: f64, y: f64, support: &str| {
        format!(
            r#"
[[body]]
name = "{name}"
element = "quad4"
material = {{ young = 2.1e11, poisson = 0.3 }}
mesh.rectangle = {{ x = {{ from = 0, to = {x}, cells = {cells} }}, y = {{ from = {y}, to = {}, cells = {cells} }} }}
support = [{{ surface = "left", x = 0 }}, {support}]
"#,
            y + 1.0
        )
    };
    let mut text = String::from("analysis = \"plane strain\"\n");
    text += &body("upper", 1.0, 1.0, "{ surface = \"top\", y = -1e-3 }");
    text += &body("lower", 1.5, 0.0, "{ surface = \"bottom\", y = 0 }");
    text += "[[contact]]\nname = \"c\"\nsurfaces = [\"upper.bottom\", \"lower.top\"]\n";
    for k in 1..=steps {
        text += &format!("[[step]]\nname = \"step {k}\"\nsupports = {}\n", k as f64 / steps as f64);
    }
    text
}

/// The displacements and stresses after each step, and the pressures.
fn states(results: &kontakt::output::Results) -> Vec<Vec<f64>> {
    let of = |fields: &[kontakt::output::Field], pairs: &[kontakt::record::PairTables]| -> Vec<f64> {
        let pressures = pairs.iter().flat_map(|p| p.sides.iter().flatten()).flat_map(|side| &side.pressure);
        fields.iter().flat_map(|f| &f.values).chain(pressures).copied().collect()
    };
    let last = of(&results.piece.point_fields, &results.pairs);
    results.before.iter().map(|s| of(&s.point_fields, &s.pairs)).chain([last]).collect()
}

/// Killed while it is at its steps, a run leaves those that it has accepted, as they are in a run that gets to the end.
#[test]
fn a_killed_run_leaves_its_accepted_steps() {
    use kontakt::output::{RESULT, Results};
    const STEPS: usize = 30;
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("case.toml");
    std::fs::write(&file, stepped(STEPS, 60)).unwrap();
    let whole = directory.path().join("whole");
    assert_eq!(run(1, &file, &whole, &[]).status.code(), Some(0));
    let expected = states(&Results::read(&whole.join(RESULT)).unwrap());
    assert_eq!(expected.len(), STEPS);
    for wait in [1, 4, 9] {
        let out = directory.path().join(format!("killed-{wait}"));
        // An older result is there until the first step is.
        std::fs::create_dir_all(&out).unwrap();
        std::fs::write(out.join(RESULT), "old").unwrap();
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_kontakt"));
        command.arg("run").arg(&file).arg("--out").arg(&out);
        command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null());
        let mut child = command.spawn().unwrap();
        let steps = || Results::read(&out.join(RESULT)).map_or(0, |read| read.before.len() + 1);
        while steps() < wait {
            assert!(child.try_wait().unwrap().is_none(), "it has ended by itself");
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let read = Results::read(&out.join(RESULT)).unwrap();
        let found = states(&read);
        assert!(found.len() >= wait && found.len() < STEPS && !read.complete, "{} steps", found.len());
        assert_eq!(read.run.steps.as_ref().map(Vec::len), Some(found.len()));
        assert!(read.history.iter().all(|row| row.step <= found.len() as u64));
        assert!(!out.join("summary.json").exists());
        assert!(found == expected[..found.len()], "the steps of the killed run are others");
    }
}

/// As many processes make the same file.
#[test]
fn steps_on_two_ranks_are_those_on_one() {
    use kontakt::output::{RESULT, Results};
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("case.toml");
    std::fs::write(&file, stepped(4, 12)).unwrap();
    let [one, two] = [1, 2].map(|ranks| {
        let out = directory.path().join(ranks.to_string());
        assert_eq!(run(ranks, &file, &out, &[]).status.code(), Some(0));
        states(&Results::read(&out.join(RESULT)).unwrap())
    });
    for (one, two) in std::iter::zip(&one, &two) {
        let scale = one.iter().map(|v| v.abs()).fold(0.0, larger);
        assert!(one.len() == two.len() && scale > 0.0);
        // A rank has a body each: the points are in the same order.
        assert!(std::iter::zip(one, two).all(|(a, b)| (a - b).abs() <= 1e-9 * scale));
    }
}

#[test]
fn memory_does_not_depend_on_the_number_of_steps() {
    let directory = tempfile::tempdir().unwrap();
    let peaks = [1, 10, 40].map(|steps| {
        let file = directory.path().join(format!("{steps}.toml"));
        std::fs::write(&file, stepped(steps, 90)).unwrap();
        let out = directory.path().join(steps.to_string());
        assert_eq!(run(1, &file, &out, &[]).status.code(), Some(0));
        let summary = summary(&out);
        let estimates =
            summary["steps"].as_array().unwrap().iter().map(|s| s.get("error_estimate").is_some());
        // Only the last step's error is estimated.
        assert_eq!(
            estimates.collect::<Vec<_>>().iter().rposition(|known| !known),
            steps.checked_sub(2),
            "{summary}"
        );
        summary["peak_memory_mb"].as_f64().unwrap()
    });
    for peak in peaks {
        assert!((peak / peaks[0] - 1.0).abs() < 0.05, "{peaks:?} MB for 1, 10, 40 steps");
    }
}

#[test]
fn the_seconds_add_up_to_the_total() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("case.toml");
    std::fs::write(&file, stepped(3, 60)).unwrap();
    let adapted = ["--adapt", "energy=1%", "--adapt-rounds", "2"];
    for (case, ranks, arguments) in [
        (&file, 1, &[][..]),
        (&file, 2, &[]),
        (&case("hertz-line"), 1, &[]),
        (&case("hertz-line"), 2, &adapted),
        (
            &case("hertz-line"),
            1,
            &["--set", "alternation.driver=\"relaxed\"", "--set", "alternation.weights=0.5"],
        ),
    ] {
        let out = tempfile::tempdir().unwrap();
        run(ranks, case, out.path(), arguments);
        let summary = summary(out.path());
        let seconds = summary["seconds"].as_object().unwrap();
        let total = seconds["total"].as_f64().unwrap();
        let parts: f64 =
            seconds.iter().filter(|(k, _)| *k != "total").map(|(_, v)| v.as_f64().unwrap()).sum();
        assert!((parts / total - 1.0).abs() <= 0.03, "{parts} of {total}: {seconds:?}");
        assert!(seconds.values().all(|v| v.as_f64().unwrap() >= 0.0));
    }
}

/// Memory and size of the results of runs, from what `check` says of them.
#[test]
fn check_predicts_memory_and_results() {
    for (element, cells, ranks) in [("quad4", 90, 1), ("quad8", 60, 1), ("tri3", 90, 2), ("quad4", 90, 2)] {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("case.toml");
        std::fs::write(&file, stepped(2, cells).replace("quad4", element)).unwrap();
        let mut command = mpirun(ranks);
        let output = command.arg(env!("CARGO_BIN_EXE_kontakt")).arg("check").arg(&file).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let line = text.lines().find(|line| line.starts_with("a run takes about")).expect(&text);
        let before = |unit: &str| -> f64 {
            let words: Vec<&str> = line[..line.find(unit).expect(line)].split_whitespace().collect();
            words.last().unwrap().parse().expect(line)
        };
        let out = directory.path().join("out");
        assert_eq!(run(ranks, &file, &out, &[]).status.code(), Some(0));
        let peak = summary(&out)["peak_memory_mb"].as_f64().unwrap();
        let sizes = std::fs::read_dir(&out).unwrap().map(|file| file.unwrap().metadata().unwrap().len());
        let size = sizes.sum::<u64>() as f64 / 1e6;
        for (what, predicted, found) in
            [("memory", before(" MB in all"), peak), ("results", before(" MB of results"), size)]
        {
            assert!((predicted / found - 1.0).abs() < 0.2, "{element}, {ranks}: {what} {found}: {line}");
        }
    }
}
