//! Every shipped case and variant against its expected numbers, on 1 to 4 ranks.
mod common;

use common::{assert_same, check_invariants, run, summary, value};
use serde::Deserialize;
use std::path::PathBuf;

#[derive(Deserialize)]
struct Expected {
    run: Vec<Run>,
}

#[derive(Deserialize)]
struct Run {
    variant: Option<String>,
    /// Reason in the summary; "any" that converged, or "not converged". Default: "converged".
    reason: Option<String>,
    values: Vec<Number>,
}

#[derive(Deserialize)]
struct Number {
    path: String,
    value: f64,
    relative: Option<f64>,
    absolute: Option<f64>,
}

/// Runs a case with all its variants on these numbers of ranks; all of them must agree to 1e-8.
fn verify(name: &str) {
    let case = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("cases").join(name);
    let text = std::fs::read_to_string(case.join("expected.toml")).expect("expected.toml");
    let expected: Expected = toml::from_str(&text).expect("expected.toml is well formed");
    let known = kontakt::case::variant_names(&case).expect("the case reads");
    let mut tested: Vec<&str> = expected.run.iter().filter_map(|r| r.variant.as_deref()).collect();
    for wanted in &expected.run {
        let ranks = 1..=4;
        let mut first = None;
        for ranks in ranks {
            let what = format!("{name} {} on {ranks} ranks", wanted.variant.as_deref().unwrap_or(""));
            let out = tempfile::tempdir().expect("a temporary directory");
            let arguments: Vec<&str> =
                wanted.variant.iter().flat_map(|v| ["--variant", v.as_str()]).collect();
            let output = run(ranks, &case, out.path(), &arguments);
            let log = String::from_utf8_lossy(&output.stderr).into_owned();
            let reason = wanted.reason.as_deref().unwrap_or("converged");
            let code = if reason == "not converged" { 3 } else { 0 };
            assert_eq!(output.status.code(), Some(code), "{what}: {log}");
            let summary = summary(out.path());
            assert_eq!(summary["converged"], code == 0, "{what}");
            match reason {
                "any" | "not converged" => {}
                reason => assert_eq!(summary["reason"], reason, "{what}"),
            }
            if code == 0 {
                check_invariants(&summary, &what);
            }
            for number in &wanted.values {
                let found = value(&summary, &number.path);
                let allowed =
                    number.absolute.unwrap_or(0.0) + number.relative.unwrap_or(0.0) * number.value.abs();
                assert!(
                    (found - number.value).abs() <= allowed,
                    "{what}: {} is {found:e}, not {:e} +- {allowed:e}",
                    number.path,
                    number.value
                );
            }
            // A run that does not converge, or that may end in either state, ends in round-off that the number of ranks may
            // change.
            match &first {
                _ if code != 0 || reason == "any" => {}
                None => first = Some(summary),
                Some(one) => assert_same(one, &summary, 1e-8, &what),
            }
        }
    }
    tested.sort_unstable();
    let mut known: Vec<&str> = known.iter().map(String::as_str).collect();
    known.sort_unstable();
    assert_eq!(tested, known, "{name}: every variant has its expected numbers");
}

#[test]
fn heated_gap() {
    verify("heated-gap");
}

#[test]
fn heated_rectangles() {
    verify("heated-rectangles");
}

#[test]
fn hertz_line() {
    verify("hertz-line");
}

#[test]
fn patch() {
    verify("patch");
}

#[test]
fn press_fit() {
    verify("press-fit");
}

#[test]
fn partial_slip() {
    verify("partial-slip");
}

#[test]
fn indentation() {
    verify("indentation");
}

#[test]
fn press_fit_plastic() {
    verify("press-fit-plastic");
}

#[test]
fn residual_stress() {
    verify("residual-stress");
}
