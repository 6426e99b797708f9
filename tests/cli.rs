//! The command line: exit codes, refusals, options of PETSc, what a bad run leaves behind.
mod common;

use common::{mpirun, run, summary};
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
        assert!(!out.path().join("summary.json").exists());
    }
}

#[test]
fn wrong_input_leaves_old_results_alone() {
    let out = tempfile::tempdir().unwrap();
    assert_eq!(run(2, &case("patch"), out.path(), &[]).status.code(), Some(0));
    let before = summary(out.path());
    for set in ["body.upper.youn=1", "contact.interface.surfaces=[\"upper.botom\", \"lower.top\"]"] {
        let output = run(2, &case("patch"), out.path(), &["--set", set]);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains("--set"), "{}", stderr(&output));
    }
    assert_eq!(before, summary(out.path()));
}

#[test]
fn an_iteration_limit_is_no_convergence() {
    let out = tempfile::tempdir().unwrap();
    let output = run(2, &case("hertz-line"), out.path(), &["--set", "alternation.max_alternations=2"]);
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
    assert_eq!(run(1, &case("patch"), iterative.path(), &options).status.code(), Some(1));
    let output = run(1, &case("patch"), iterative.path(), &["-body_uper_ksp_type", "cg"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
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
    // The leading body's, once for each active set.
    assert!(interface >= 1 && interface <= summary["updates"].as_u64().unwrap() + 1, "{interface}");
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
