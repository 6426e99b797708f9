//! Where the work goes: what loads and supports do is stored or dissipated, step by step.
use super::{
    friction::{A_OVER_B, block, discs},
    near, solve, solve_all,
};
use serde_json::Value;

/// Energies after a step: external work, heat, stored, dissipated, J.
fn energies(summary: &Value, step: usize) -> [f64; 4] {
    let energy = &summary["steps"][step]["energy"];
    ["external", "heat", "stored", "dissipated"].map(|key| energy[key].as_f64().unwrap_or(0.0))
}

/// The balance of every step, by the figures themselves.
fn balances(summary: &Value, allowed: f64) {
    let steps = summary["steps"].as_array().expect("a table of steps").len();
    let all = (0..steps).flat_map(|step| energies(summary, step));
    let largest = all.fold(0.0_f64, |m, e| m.max(e.abs()));
    let mut before = 0.0;
    for step in 0..steps {
        let [external, heat, stored, dissipated] = energies(summary, step);
        near(external + heat, stored + dissipated, allowed * largest, "balance of energies");
        let told = summary["steps"][step]["energy"]["imbalance"].as_f64().expect("a number");
        assert!(told <= allowed, "{told:e}");
        // No step gives back what friction has taken.
        assert!(dissipated >= before * (1.0 - 1e-12), "{dissipated:e} after {before:e}");
        before = dissipated;
    }
    assert_eq!(summary["energy"], summary["steps"][steps - 1]["energy"]);
}

/// A block of 60 x 20 mm in plane stress is pressed by 0.2 MPa: p^2 V / 2E is stored. Then the floor is dragged away under it: each
/// further travel s costs mu N s, all of it dissipated.
#[test]
fn what_drags_a_block_works_against_friction_alone() {
    let text = block(0.0, 0.0, "friction = 0.3")
        .replace("load = [", "support = [{ surface = \"left\", x = 0 }]\nload = [")
        .replace("rigid = { plane", "rigid = { x = 1e-3, path = \"drag\", plane")
        + "[[step]]\npaths = { drag = 0 }\n[[step]]\npaths = { drag = 0.5 }\n[[step]]\npaths = { drag = 1 }\n";
    let smooth = text.replace("friction = 0.3", "friction = 1e-9");
    let pressed = energies(&solve(&smooth), 0);
    let stored = 2e5_f64.powi(2) * 0.06 * 0.02 / (2.0 * 2.1e11);
    near(pressed[0], stored, 1e-6 * stored, "work of the press");
    near(pressed[2], stored, 1e-6 * stored, "stored by the press");
    let summary = solve(&text);
    balances(&summary, 1e-9);
    let [first, second] = [1, 2].map(|step| energies(&summary, step));
    let work = 3.6e3 * 0.5e-3;
    near(second[0] - first[0], work, 1e-9 * work, "work of the dragged floor");
    near(second[3] - first[3], work, 1e-9 * work, "dissipated");
    near(second[2], first[2], 1e-9 * work, "stored");
}

/// Two discs sheared to and fro: only stuck and slipping nodes, one increment a turn; then with rows found again as they move, and on
/// meshes that do not match.
#[test]
fn cycles_of_partial_slip_balance() {
    let loads = [0.0, 0.6, -0.6, 0.6, 0.0];
    let text = discs(0.3, 10.0, A_OVER_B, &loads);
    let summary = solve(&text);
    balances(&summary, 1e-9);
    // A closed cycle stores nothing: all work is dissipated.
    let [first, last] = [1, 3].map(|step| energies(&summary, step));
    near(last[2], first[2], 1e-9 * first[2], "stored");
    near(last[0] - first[0], last[3] - first[3], 1e-8 * last[3], "work of the cycle");
    balances(&solve(&text.replace("friction =", "geometry = \"updated\"\nfriction =")), 1e-8);
    let coarse = discs(0.3, 7.0, A_OVER_B, &loads);
    let lower = coarse.split("name = \"lower\"").nth(1).and_then(|rest| rest.split("support").next());
    let fine = text.split("name = \"lower\"").nth(1).and_then(|rest| rest.split("support").next());
    let (Some(lower), Some(fine)) = (lower, fine) else { panic!("two bodies") };
    balances(&solve(&coarse.replace(lower, fine)), 1e-9);
    // Normal and tangential loads together, in increments: nodes close and begin to slip in each.
    let together = discs(0.3, 10.0, A_OVER_B, &[])
        + "[[step]]\nloads = 0.7\nsteps = 8\n[[step]]\nloads = -0.2\nsupports = 0.6\nsteps = 5\n";
    balances(&solve(&together), 1e-9);
}

/// Two heated blocks close a gap, rub along each other and part again: what is cold stores nothing, and the gap that has opened has not
/// lost what friction took.
#[test]
fn what_friction_took_is_not_lost_when_a_gap_opens() {
    let text = std::fs::read_to_string("cases/hard/heat-cycle/case.toml").expect("the case reads");
    let text =
        text.replace("gap = 5e-5", "gap = 5e-5\nfriction = 0.3").replace("[[step]]", "[[step]]\nsteps = 4");
    let text = text.split("[[variant]]").next().expect("a case").to_owned();
    let (summary, _) = solve_all(&text, 2, &[]);
    balances(&summary, 1e-9);
    let [hot, cooled, again] = [1, 2, 3].map(|step| energies(&summary, step));
    assert!(hot[3] > 1e-3 * hot[2], "{hot:?}");
    assert!(cooled[2] <= 1e-12 * hot[2], "{cooled:?}");
    near(cooled[0] + cooled[1], cooled[3], 1e-9 * hot[1].abs(), "all work is dissipated");
    assert!(cooled[3] > hot[3]);
    // The second time costs as much as the first, on both ways.
    near(again[3] - cooled[3], hot[3], 1e-9 * hot[3], "the gap closed once more");
    let smooth = solve(&text.replace("friction = 0.3", ""));
    assert!(smooth["energy"].is_null() && smooth["steps"][1]["energy"].is_null());
}

/// The paper's second example with friction on a path of heat: moduli and expansion that vary with the temperature; then by the
/// paper's alternation, to its tolerance.
#[test]
fn energies_balance_in_heat_and_in_the_papers_driver() {
    let text = std::fs::read_to_string("cases/heated-rectangles/case.toml").expect("the case reads");
    let text = text.split("[[probe]]").next().expect("a case");
    let text = text.replace("cells = 40", "cells = 10").replace("cells = 16", "cells = 4");
    let text = text
        .replace("cells = [40, 40]", "cells = [10, 10]")
        .replace("[[contact]]", "[[contact]]\nfriction = 0.3");
    let steps = "[[step]]\ntemperature = 0.5\nsteps = 3\n[[step]]\nsteps = 3\n[[step]]\ntemperature = 0.2\nsteps = 3\n";
    let soft = text
        .replace("young = 2.1e11", "young = { temperature = [293, 700], value = [2.1e11, 1.6e11] }")
        .replace("expansion = 12.5e-6", "expansion = { temperature = [293, 700], value = [12e-6, 14e-6] }");
    balances(&solve(&format!("{soft}{steps}")), 1e-9);
    for transfer in ["mortar", "pointwise"] {
        let relaxed = format!("[alternation]\ndriver = \"relaxed\"\ntransfer = \"{transfer}\"");
        balances(&solve(&(text.replace("[alternation]", &relaxed) + steps)), 1e-6);
    }
}

/// A block of steel heated by 100 K between its clamped foot and a rigid ceiling, free to widen: E (alpha dT)^2 V / 2 is stored, by heat
/// alone. The energies of the bodies are those of the estimate, which takes other points.
#[test]
fn heat_stores_what_a_held_block_would_lengthen() {
    let text = "analysis = \"plane stress\"\nalternation.tolerance = 1e-10\n\
        material.steel = { young = 2.1e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 293 }\n\
        [[body]]\nname = \"block\"\nmaterial = \"steel\"\ntemperature = 393\n\
        mesh.rectangle = { x = { from = 0, to = 0.04, cells = 6 }, y = { from = 0, to = 0.02, cells = 4 } }\n\
        support = [{ surface = \"bottom\", y = 0 }, { surface = \"left\", x = 0 }]\n\
        [[body]]\nname = \"ceiling\"\nrigid = { plane = { through = [0, 0.02], normal = [0, -1] } }\n\
        [[contact]]\nname = \"pair\"\nsurfaces = [\"block.top\", \"ceiling.surface\"]\nfriction = 1e-9\n\
        [[step]]\ntemperature = 0.5\n[[step]]\n";
    let summary = solve(text);
    balances(&summary, 1e-9);
    for (step, share) in [(0, 0.5_f64), (1, 1.0)] {
        let stored = 2.1e11 * (12e-6 * 100.0 * share).powi(2) * 0.04 * 0.02 / 2.0;
        let [external, heat, found, dissipated] = energies(&summary, step);
        near(found, stored, 1e-6 * stored, "stored");
        near(heat, stored, 1e-6 * stored, "heat");
        assert!(external.abs() < 1e-6 * stored && dissipated < 1e-6 * stored, "{external:e} {dissipated:e}");
    }
    let of_body = summary["bodies"][0]["strain_energy"].as_f64().expect("a number");
    near(energies(&summary, 1)[2], of_body, 1e-6 * of_body, "energy of the body");
    let discs = solve(&discs(0.3, 8.0, A_OVER_B, &[0.0, 0.5]));
    let of_bodies: f64 =
        [0, 1].map(|b| discs["bodies"][b]["strain_energy"].as_f64().expect("a number")).iter().sum();
    near(energies(&discs, 1)[2], of_bodies, 1e-9 * of_bodies, "energy of two bodies");
}
