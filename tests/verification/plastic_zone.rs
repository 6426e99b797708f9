//! Only the part of a body that yields is iterated: the answer is that of the whole.
use super::{rectangle, solve_all};
use serde_json::Value;

/// Two blocks, one of them punched, pushed against each other with friction 0.2 and let go again.
fn punched(zone: &str) -> String {
    let supports = "support = [{ surface = \"left\", x = 0 }, { surface = \"bottom\", y = 0 }, \
         { surface = \"top\", within = { x = [0, 0.01] }, y = -2e-5 }]";
    let block = rectangle("block", "m", "quad4", (0.0, 0.05, 50), (0.0, 0.05, 50), supports);
    let other = rectangle(
        "other",
        "m",
        "quad4",
        (0.05, 0.09, 30),
        (0.0, 0.05, 45),
        "support = [{ surface = \"right\", x = -1e-5 }, { surface = \"bottom\", y = 0 }]",
    );
    format!(
        "analysis = \"plane strain\"\n[plasticity]\nzone = \"{zone}\"\n[material.m]\nyoung = 2.1e11\npoisson = 0.3\n\
         plasticity = {{ yield_stress = 3e8, hardening = 1e9 }}\n{block}{other}\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"block.right\", \"other.left\"]\nfriction = 0.2\n\
         [[step]]\nsteps = 3\n[[step]]\nsupports = 2\nsteps = 3\n[[step]]\nsupports = 0.5\n"
    )
}

/// The same case heated, moduli and yield stress over temperature, on elements of second order.
fn heated(zone: &str) -> String {
    let body = |name: &str, y: (f64, f64, usize), cells: usize, supports: &str| {
        let heat = format!("temperature = \"600 - 8000*x\"\n{supports}");
        rectangle(name, "m", "quad8", (0.0, 0.05, cells), y, &heat)
    };
    let lower = body(
        "lower",
        (0.0, 0.02, 16),
        44,
        "support = [{ surface = \"left\", x = 0 }, { surface = \"bottom\", y = 0 }]",
    );
    let upper = body(
        "upper",
        (0.02, 0.04, 17),
        41,
        "support = [{ surface = \"left\", x = 0 }]\nload = [{ surface = \"top\", pressure = 1e8 }]",
    );
    format!(
        "analysis = \"plane strain\"\n[plasticity]\nzone = \"{zone}\"\n[material.m]\npoisson = 0.3\nexpansion = 12e-6\n\
         reference_temperature = 293\nyoung = {{ temperature = [293, 673], value = [2.1e11, 1.8e11] }}\n\
         plasticity = {{ yield_stress = {{ temperature = [293, 673], value = [7e8, 5e8] }}, hardening = 2e9 }}\n\
         {lower}{upper}[[contact]]\nname = \"pair\"\nsurfaces = [\"upper.bottom\", \"lower.top\"]\n\
         [[step]]\nsteps = 4\n[[step]]\ntemperature = 0.3\n"
    )
}

/// Numbers of all steps.
fn numbers(summary: &Value) -> Vec<[f64; 4]> {
    let steps = summary["steps"].as_array().expect("steps");
    let number = |v: &Value| v.as_f64().expect("a number");
    let of = |step: &Value| {
        [
            number(&step["pairs"][0]["max_pressure"]),
            number(&step["energy"]["stored"]),
            number(&step["energy"]["plastic"]),
            number(&step["plasticity"]["max_plastic_strain"]),
        ]
    };
    steps.iter().map(of).collect()
}

#[test]
fn a_zone_and_the_whole_agree() {
    for case in [punched, heated] {
        let [whole, zone] = ["never", "always"].map(|zone| solve_all(&case(zone), 1, &[]).0);
        let [expected, found] = [&whole, &zone].map(numbers);
        for (a, b) in std::iter::zip(expected.as_flattened(), found.as_flattened()) {
            assert!((a - b).abs() <= 1e-10 * a.abs(), "{a:e} {b:e}");
        }
        let shares = |summary: &Value| -> Vec<f64> {
            let bodies = summary["steps"][0]["plasticity"]["bodies"].as_array().expect("bodies").iter();
            bodies.map(|body| body["zone_fraction"].as_f64().expect("a number")).collect()
        };
        assert!(shares(&whole).iter().all(|share| *share == 1.0));
        assert!(shares(&zone).iter().any(|share| *share > 0.0 && *share < 0.6), "{:?}", shares(&zone));
    }
}

/// A body that cannot yield is factorised once, whatever its neighbour does; and where bodies answer by their solver, or surfaces are
/// followed, tied or pressed by the paper's driver, the two find the same.
#[test]
fn an_elastic_neighbour_is_factorised_once() {
    let text = punched("never")
        .replace("name = \"other\"\nmaterial = \"m\"", "name = \"other\"\nmaterial = \"e\"")
        .replace("[[contact]]", "[material.e]\nyoung = 2.1e11\npoisson = 0.3\n[[contact]]");
    let summary = solve_all(&text, 2, &[]).0;
    let of = |body: usize| summary["bodies"][body]["factorisations"].as_f64().expect("a number");
    assert!(of(0) > 10.0, "{}", of(0));
    assert_eq!(of(1), 1.0);
    let smooth = text.replace("friction = 0.2\n", "");
    let expected = numbers(&solve_all(&smooth, 2, &[]).0);
    let by_solver = smooth.replace("name = \"block\"", "name = \"block\"\nresponse = \"solver\"");
    let relaxed = smooth
        .replace("[[contact]]", "[alternation]\ndriver = \"relaxed\"\ntransfer = \"mortar\"\n[[contact]]");
    let followed = smooth.replace("[[contact]]\n", "[[contact]]\ngeometry = \"updated\"\n");
    // Normals that turn by 1e-4 change what is found by as much.
    for (what, text, allowed) in
        [("solver", by_solver, 1e-6), ("relaxed", relaxed, 1e-4), ("followed", followed, 2e-3)]
    {
        let found = numbers(&solve_all(&text, 2, &[]).0);
        for (a, b) in std::iter::zip(expected.as_flattened(), found.as_flattened()) {
            assert!((a - b).abs() <= allowed * a.abs(), "{what}: {a:e} {b:e}");
        }
    }
}
