//! Running the program under mpirun or in the test's own process, and the invariants every run must satisfy.
#![allow(dead_code)]
pub mod inside;

use kontakt::vector::larger;
use serde_json::Value;
use std::{
    path::Path,
    process::{Command, Output},
};

/// mpirun with the settings that make it usable in containers, as root and on few cores.
pub fn mpirun(ranks: usize) -> Command {
    let mut command = Command::new("timeout"); // a deadlock must fail, not hang
    command.args(["--kill-after=5", "120", "mpirun", "-q", "-n", &ranks.to_string()]);
    for (key, value) in [
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
        ("OMPI_MCA_hwloc_base_binding_policy", "none"),
        ("OMPI_MCA_btl_vader_single_copy_mechanism", "none"),
        ("OMP_NUM_THREADS", "1"),
    ] {
        command.env(key, value);
    }
    command
}

/// `kontakt run case` with results in `out`.
pub fn run(ranks: usize, case: &Path, out: &Path, arguments: &[&str]) -> Output {
    let mut command = mpirun(ranks);
    command.arg(env!("CARGO_BIN_EXE_kontakt")).arg("run").arg(case).arg("--out").arg(out).args(arguments);
    command.output().expect("mpirun starts")
}

/// The summary a run left.
pub fn summary(out: &Path) -> Value {
    let text = std::fs::read_to_string(out.join("summary.json")).expect("summary.json is there");
    serde_json::from_str(&text).expect("summary.json is JSON")
}

/// A value by path: `pairs.interface.max_pressure`, `probes.A.displacement.1`; list items by name or index.
pub fn value(summary: &Value, path: &str) -> f64 {
    let found = path.split('.').try_fold(summary, |at, key| match at {
        Value::Array(items) => match key.parse::<usize>() {
            Ok(i) => items.get(i),
            Err(_) => items.iter().find(|item| item["name"] == key),
        },
        other => other.get(key),
    });
    found.and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {path}"))
}

/// Invariants I1 to I5 and I7 of a run that converged.
pub fn check_invariants(summary: &Value, what: &str) {
    check_invariants_within(summary, 1.0, what);
}

/// The same with a factor on what round-off may leave of equilibrium and virtual work: slender bodies lose digits, since
/// small strains make large displacements (a clamped beam of 80 x 4 cells without any contact: 8e-11).
pub fn check_invariants_within(summary: &Value, factor: f64, what: &str) {
    let check = |key: &str, limit: f64| {
        let value = value(summary, &format!("checks.{key}"));
        assert!(value <= limit, "{what}: {key} = {value:.2e} > {limit:.0e}");
    };
    check("action_reaction", 1e-10); // I1
    check("equilibrium", 1e-9 * factor); // I2
    check("residual", 1e-9 * factor);
    check("tension", 1e-6); // I4
    check("complementarity", 1e-6); // I5
    check("virtual_work", 1e-10 * factor); // I7
    // I3: the penetration against the travel of the probes or the length of the contact (one node has none); below the
    // round-off of coordinates there is none.
    let pairs = summary["pairs"].as_array().expect("pairs");
    let of_probes = |key: &str| {
        let probes = summary["probes"].as_array().into_iter().flatten();
        probes.map(|probe| largest(&probe[key])).fold(0.0, larger)
    };
    let travel = of_probes("displacement");
    let length = pairs.iter().map(|pair| largest(&pair["contact_length"])).fold(travel, larger);
    for pair in pairs {
        let penetration = pair["max_penetration"].as_f64().expect("a number");
        let limit = (1e-8 * length).max(f64::EPSILON * of_probes("x"));
        assert!(penetration <= limit, "{what}: penetration {penetration:.2e}");
    }
}

/// Asserts that two summaries agree in every physical number to `relative`, each against the largest of its kind.
pub fn assert_same(a: &Value, b: &Value, relative: f64, what: &str) {
    assert_agree(a, b, relative, what);
    assert_eq!(a["alternations"], b["alternations"], "{what}");
}

/// The same without the count of alternations.
pub fn assert_agree(a: &Value, b: &Value, relative: f64, what: &str) {
    for key in ["reason", "converged", "free_modes"] {
        assert_eq!(a[key], b[key], "{what}: {key}");
    }
    let list = |v: &Value, key: &str| v[key].as_array().cloned().unwrap_or_default();
    let over = |key: &str, part: &str| list(a, key).iter().map(|v| largest(&v[part])).fold(0.0, larger);
    // Below 1 kPa a stress is round-off.
    let pressure = larger(larger(over("pairs", "max_pressure"), over("probes", "stress")), 1e3);
    let length = larger(over("pairs", "contact_length"), over("probes", "x"));
    let (pairs, probes) = ([list(a, "pairs"), list(b, "pairs")], [list(a, "probes"), list(b, "probes")]);
    assert_eq!((pairs[0].len(), probes[0].len()), (pairs[1].len(), probes[1].len()), "{what}");
    let force = over("pairs", "normal_force");
    for (p, q) in std::iter::zip(&pairs[0], &pairs[1]) {
        let name = format!("{what}: {}", p["name"]);
        for key in ["name", "active", "open", "candidates", "multiplier_side"] {
            assert_eq!(p[key], q[key], "{name}: {key}");
        }
        let scales = [
            ("normal_force", force),
            ("resultant", force),
            ("moment", force * length),
            ("max_pressure", pressure),
            ("contact_length", length),
        ];
        for (key, scale) in scales {
            near(&p[key], &q[key], relative * scale, &format!("{name}: {key}"));
        }
    }
    // The error of the pressure is relative to the peak, as the pressures are compared here.
    for (key, scale) in [("energy", 0.0), ("contact_pressure", 1.0)] {
        let of = |v: &Value| v["error_estimate"][key].as_f64().unwrap_or(-1.0);
        let (x, y) = (of(a), of(b));
        let allowed = relative * x.abs().max(1e-3).max(scale);
        assert!((x - y).abs() <= allowed, "{what}: estimated error, {key}: {x:e} and {y:e}");
    }
    let travel = over("probes", "displacement");
    for (p, q) in std::iter::zip(&probes[0], &probes[1]) {
        let name = format!("{what}: {}", p["name"]);
        near(&p["displacement"], &q["displacement"], relative * travel, &format!("{name}: displacement"));
        for key in ["xx", "yy", "zz", "xy"] {
            near(&p["stress"][key], &q["stress"][key], relative * pressure, &format!("{name}: {key}"));
        }
    }
}

/// Asserts that two numbers, or lists of them, differ by no more than `allowed`.
fn near(a: &Value, b: &Value, allowed: f64, what: &str) {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{what}");
            std::iter::zip(a, b).for_each(|(a, b)| near(a, b, allowed, what));
        }
        _ => {
            let (x, y) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
            assert!((x - y).abs() <= allowed, "{what}: {x:e} and {y:e}, {:.1e} allowed", allowed);
        }
    }
}

fn largest(value: &Value) -> f64 {
    match value {
        Value::Object(map) => map.values().map(largest).fold(0.0, larger),
        Value::Array(items) => items.iter().map(largest).fold(0.0, larger),
        other => other.as_f64().map_or(0.0, f64::abs),
    }
}
