//! Adaptive runs: what they reach, what they cost, the same on any number of ranks, and how they give up.
mod common;
#[path = "common/partners.rs"]
mod partners;

use common::{check_invariants, run, summary, value};
use kontakt::{case, scene::build_mesh};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Peak pressure of the Hertz case, Pa.
const EXACT: f64 = 1.212_074e9;

fn case(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(name)
}

/// Exit code, summary and output of a run.
fn adapt(ranks: usize, name: &str, arguments: &[&str]) -> (Option<i32>, Value, String) {
    let out = tempfile::tempdir().expect("a temporary directory");
    let ran = run(ranks, &case(name), out.path(), arguments);
    let text = String::from_utf8_lossy(&ran.stdout).into_owned() + &String::from_utf8_lossy(&ran.stderr);
    let found = if out.path().join("summary.json").is_file() { summary(out.path()) } else { Value::Null };
    let refused = found["exit_code"].as_i64().is_some();
    let found = if refused { Value::Null } else { found };
    assert!(found.is_null() || out.path().join("result.vtkhdf").is_file(), "the results are kept");
    (ran.status.code(), found, text)
}

fn rounds(summary: &Value) -> &[Value] {
    summary["adapt"].as_array().expect("the rounds are listed")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// A coarse start, three cells on a fifth of the half-width's square: fast.
fn coarse() -> Vec<String> {
    let of = |body: &str| {
        [
            format!("body.{body}.mesh.half_disc.angle={{ from = -45, to = 45, cells = 50 }}"),
            format!("body.{body}.mesh.half_disc.depth={{ to = 0.6, cells = 20 }}"),
            format!("body.{body}.mesh.half_disc.core=16"),
        ]
    };
    [of("upper"), of("lower")].concat().into_iter().flat_map(|set| ["--set".to_owned(), set]).collect()
}

#[test]
fn hertz_to_half_a_percent_with_a_fifth_of_the_unknowns() {
    let (code, found, text) = adapt(2, "hertz-line", &["--variant", "ungraded", "--adapt", "pressure=0.5%"]);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(found["adapt_reached"], true);
    check_invariants(&found, "hertz-line ungraded");
    let adaptive = rounds(&found).last().expect("a round");
    let estimate = number(&adaptive["contact_pressure"]);
    let error = (value(&found, "pairs.contact.max_pressure") / EXACT - 1.0).abs();
    assert!(estimate <= 5e-3 && error <= 5e-3, "estimate {estimate}, error {error}");
    assert!((value(&found, "pairs.contact.normal_force") / 1e6 - 1.0).abs() < 5e-3);
    // The start was far off: a/h = 1.
    assert!(number(&rounds(&found)[0]["contact_pressure"]) > 0.05);
    let dofs: f64 = found["bodies"].as_array().unwrap().iter().map(|b| number(&b["dofs"])).sum();
    assert_eq!(number(&adaptive["dofs"]), dofs);

    // Uniform: one refinement is not enough, so that it takes the unknowns of two.
    let finer = |n: usize| ["upper", "lower"].map(|body| format!("body.{body}.mesh.refine={n}"));
    let [upper, lower] = finer(1);
    let (code, uniform, text) =
        adapt(2, "hertz-line", &["--variant", "ungraded", "--set", &upper, "--set", &lower]);
    assert_eq!(code, Some(0), "{text}");
    let error = (value(&uniform, "pairs.contact.max_pressure") / EXACT - 1.0).abs();
    assert!(error > 5e-3, "{error}");
    let two = case::read(&case("hertz-line"), Some("ungraded"), &finer(2)).expect("the case reads");
    let needed: usize =
        two.bodies.iter().map(|b| 2 * build_mesh(&b.geometry).expect("a mesh").points.len()).sum();
    assert!(dofs <= 0.2 * needed as f64, "{dofs} of {needed}");
    // Even all rounds together take less time than the one uniform mesh that is still too coarse would four times over.
    let spent: f64 = rounds(&found).iter().map(|round| number(&round["seconds"])).sum();
    let uniform = value(&uniform, "seconds.total");
    assert!(spent < 4.0 * uniform, "{spent} s for {uniform} s");
}

#[test]
fn one_two_and_four_ranks_cut_the_same_cells() {
    let sets = coarse();
    let mut arguments: Vec<&str> =
        vec!["--variant", "ungraded", "--adapt", "pressure=4%", "--adapt-rounds", "8"];
    arguments.extend(sets.iter().map(String::as_str));
    let runs = [1, 2, 4].map(|ranks| {
        let (code, found, text) = adapt(ranks, "hertz-line", &arguments);
        assert_eq!(code, Some(0), "{ranks} ranks: {text}");
        check_invariants(&found, &format!("{ranks} ranks"));
        found
    });
    assert!(rounds(&runs[0]).len() > 2);
    for other in &runs[1..] {
        assert_eq!(rounds(other).len(), rounds(&runs[0]).len());
        for (a, b) in rounds(&runs[0]).iter().zip(rounds(other)) {
            assert_eq!(a["dofs"], b["dofs"]);
            for key in ["energy", "contact_pressure"] {
                assert!((number(&a[key]) / number(&b[key]) - 1.0).abs() < 1e-6, "{key}: {a} {b}");
            }
        }
        for path in ["pairs.contact.max_pressure", "pairs.contact.normal_force"] {
            assert!((value(&runs[0], path) / value(other, path) - 1.0).abs() < 1e-8, "{path}");
        }
    }
}

#[test]
fn every_element_kind_and_energy_too() {
    for element in ["tri3", "tri6", "quad4", "quad8"] {
        let mut arguments: Vec<String> = coarse();
        for body in ["upper", "lower"] {
            arguments.extend(["--set".to_owned(), format!("body.{body}.element={element}")]);
        }
        let quadratic = matches!(element, "tri6" | "quad8");
        let goal = match element {
            _ if quadratic => "energy=4%",
            "quad4" => "energy=10%",
            _ => "energy=15%",
        };
        arguments.extend(["--variant", "ungraded", "--adapt", goal].map(str::to_owned));
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let (code, found, text) = adapt(2, "hertz-line", &arguments);
        assert_eq!(code, Some(0), "{element}: {text}");
        check_invariants(&found, element);
        let rounds = rounds(&found);
        let (first, last) = (&rounds[0], &rounds[rounds.len() - 1]);
        assert!(number(&first["energy"]) > 2.0 * number(&last["energy"]), "{element}: {rounds:?}");
        assert!(number(&last["dofs"]) < 1.5 * number(&first["dofs"]), "{element}: {rounds:?}");
        // Towards the solution, not only towards a small estimate.
        let error = (value(&found, "pairs.contact.max_pressure") / EXACT - 1.0).abs();
        assert!(error < if element == "tri3" { 0.2 } else { 0.05 }, "{element}: {error}");
        let estimate = number(&last["contact_pressure"]);
        assert!(error < 2.0 * estimate, "{element}: {error} {estimate}");
    }
}

#[test]
fn a_surface_of_several_pairs_is_refined_for_each() {
    let (code, found, text) = adapt(2, "hard/roller", &["--adapt", "pressure=1%"]);
    assert_eq!(code, Some(0), "{text}");
    check_invariants(&found, "roller");
    // Side by side: neither surface is much finer than the other.
    assert!(rounds(&found).len() < 10, "{text}");
    assert!(number(&found["error_estimate"]["contact_pressure"]) <= 0.01);
}

/// A fine ball on a coarse block: the block is cut, until the peak is right.
#[test]
fn a_coarse_partner_is_refined() {
    let out = tempfile::tempdir().expect("a temporary directory");
    let file = out.path().join("case.toml");
    std::fs::write(&file, partners::ball_on_block("quad8", [0.035, 0.5])).expect("the case is written");
    let ran = run(1, &file, out.path(), &["--adapt", "pressure=3%"]);
    assert_eq!(ran.status.code(), Some(0), "{}", String::from_utf8_lossy(&ran.stderr));
    let found = summary(out.path());
    assert!(number(&rounds(&found)[0]["contact_pressure"]) > 0.06, "{found}");
    let error = (value(&found, "pairs.c.max_pressure") / partners::PEAK - 1.0).abs();
    let estimate = number(&rounds(&found).last().expect("a round")["contact_pressure"]);
    assert!(error < 2.0 * estimate && estimate < 0.03, "{error} {estimate}");
    let grown = rounds(&found).last().expect("a round");
    assert!(number(&grown["dofs"]) < 1.2 * number(&rounds(&found)[0]["dofs"]), "{found}");
}

#[test]
fn load_steps_are_solved_on_every_mesh_and_the_last_one_is_estimated() {
    let mut arguments: Vec<String> = coarse();
    arguments.extend(
        [
            "--set",
            "step=[{ supports = 0.5 }, { supports = 1 }]",
            "--variant",
            "ungraded",
            "--adapt",
            "energy=20%",
        ]
        .map(str::to_owned),
    );
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (code, found, text) = adapt(2, "hertz-line", &arguments);
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(found["steps"].as_array().map(Vec::len), Some(2));
    assert_eq!(found["error_estimate"]["energy"], rounds(&found).last().unwrap()["energy"]);
}

#[test]
fn a_target_out_of_reach_is_said_and_the_results_are_kept() {
    let sets = coarse();
    for (limit, reason) in
        [(["--adapt-rounds", "2"], "--adapt-rounds"), (["--adapt-dofs", "100"], "--adapt-dofs")]
    {
        let mut arguments = vec!["--variant", "ungraded", "--adapt", "pressure=0.01%"];
        arguments.extend(limit);
        arguments.extend(sets.iter().map(String::as_str));
        let (code, found, text) = adapt(2, "hertz-line", &arguments);
        assert_eq!(code, Some(5), "{text}");
        assert_eq!((&found["adapt_reached"], &found["converged"]), (&Value::Bool(false), &Value::Bool(true)));
        let said = found["diagnosis"][0].as_str().expect("a diagnosis");
        assert!(
            said.contains("target not reached") && said.contains(reason) && text.contains(said),
            "{said}"
        );
    }
}

#[test]
fn no_mesh_is_made_beyond_the_limit() {
    let sets = coarse();
    let mut arguments = vec!["--variant", "ungraded", "--adapt", "energy=0.1%", "--adapt-dofs", "20000"];
    arguments.extend(sets.iter().map(String::as_str));
    let (code, found, text) = adapt(1, "hertz-line", &arguments);
    assert_eq!(code, Some(5), "{text}");
    assert!(rounds(&found).len() > 2, "{text}");
    assert!(rounds(&found).iter().all(|round| number(&round["dofs"]) <= 20_000.0), "{text}");
    let said = found["diagnosis"][0].as_str().expect("a diagnosis");
    assert!(said.contains("--adapt-dofs") && said.contains("the next mesh would have"), "{said}");
}

#[test]
fn what_elements_of_first_order_cost_is_said() {
    let sets = coarse();
    for (element, is_said) in [("quad4", true), ("quad8", false)] {
        let elements = ["upper", "lower"].map(|body| format!("body.{body}.element={element}"));
        let mut arguments = vec!["--variant", "ungraded", "--adapt", "energy=1%", "--adapt-rounds", "1"];
        arguments.extend(sets.iter().map(String::as_str));
        elements.iter().for_each(|set| arguments.extend(["--set", set]));
        let (code, found, text) = adapt(1, "hertz-line", &arguments);
        assert_eq!(code, Some(5), "{text}");
        let warnings = found["warnings"].to_string();
        assert_eq!(warnings.contains("elements of first order"), is_said, "{element}: {warnings}");
    }
}

#[test]
fn wrong_goals_are_refused_with_what_is_right() {
    for (arguments, parts) in [
        (&["--adapt", "presure=1%"][..], &["presure", "nearest: pressure"][..]),
        (&["--adapt", "pressure"], &["pressure=1%"]),
        (&["--adapt", "pressure=0"], &["more than 0"]),
        (&["--adapt", "energy=one"], &["'one'", "1% or 0.01"]),
        (&["--adapt-rounds", "3"], &["--adapt <QUANTITY=ERROR>"]),
        (&["--adapt", "energy=1%", "--adapt-rounds", "0"], &["--adapt-rounds", "0"]),
        (&["--adapt", "energy=1%", "--variant", "half"], &["active set"]),
    ] {
        let (code, found, text) = adapt(2, "hertz-line", arguments);
        assert_eq!(code, Some(2), "{arguments:?}: {text}");
        assert!(found.is_null());
        assert!(parts.iter().all(|part| text.contains(part)), "{arguments:?}: {text}");
    }
    let (code, _, text) = adapt(1, "heated-gap", &["--adapt", "pressure=1%", "--variant", "nonsense"]);
    assert_eq!(code, Some(2), "{text}");
}

#[test]
fn without_adapt_nothing_of_it_is_there() {
    let (code, found, _) = adapt(1, "patch", &[]);
    assert_eq!(code, Some(0));
    assert!(found.get("adapt").is_none() && found.get("adapt_reached").is_none());
}
