//! Coefficients of friction that are tables over temperature.
use super::{attempt, close, friction::block, multipliers, near, rectangle, solve, solve_all, value};
use kontakt::{
    output::Results,
    record::{SLIPS, SideTable},
    vector::worst,
};

/// From 0.3 at 293 K to 0.15 at 593 K.
const FALLING: &str = "friction = { temperature = [293, 593], value = [0.3, 0.15] }";

fn mu(temperature: f64) -> f64 {
    0.3 - 0.15 * ((temperature - 293.0) / 300.0).clamp(0.0, 1.0)
}

/// A steel that does not expand.
const STEEL: &str =
    "material.steel = { young = 2.1e11, poisson = 0.3, expansion = 0, reference_temperature = 293 }\n";

/// A block that is pushed, then heated to `heat` of the way from 293 K to 593 K.
fn heated(law: &str, share: f64, heat: f64) -> String {
    let push = share * mu(293.0 + 300.0 * heat) * 12e3;
    block(0.0, push, law)
        .replace("poisson = 0.3 }", "poisson = 0.3, expansion = 0, reference_temperature = 293 }")
        .replace("material = \"steel\"\n", "material = \"steel\"\ntemperature = 593\n")
        + &format!("[[step]]\ntemperature = 0\n[[step]]\ntemperature = {heat}\n")
}

#[test]
fn a_heated_block_slides_at_mu_of_its_temperature() {
    for heat in [0.0, 0.5, 1.0] {
        let push = |share: f64| share * mu(293.0 + 300.0 * heat) * 12e3;
        let share = 1.0 - 1e-6;
        let summary = solve(&heated(FALLING, share, heat));
        near(value(&summary, "pairs.pair.friction.force").abs(), push(share), 1e-9 * 3.6e3, "held");
        close(&summary, "pairs.pair.normal_force", 12e3, 1e-9);
        let (_, log) = attempt(&heated(FALLING, 1.0 + 1e-6, heat), 4);
        assert!(log.contains("body 'block'") && log.contains("translation"), "{log}");
    }
    // What heat lets go at last held well before.
    let steps = "[[step]]\ntemperature = 0\n[[step]]\ntemperature = ";
    let hot = heated(FALLING, 1.0 + 1e-6, 1.0);
    let _ = solve(&hot.replace(&format!("{steps}1"), &format!("{steps}0.99")));
}

/// A plate dragged over another by its supports while both are warmed; the temperatures vary along the surfaces. `cells` of the lower one.
fn dragged(alternation: &str, law: &str, [upper, lower]: [&str; 2], cells: usize, geometry: &str) -> String {
    let plate = |name: &str, y: (f64, f64, usize), cells: usize, heat: &str, support: &str| {
        let heat = if heat.is_empty() { String::new() } else { format!("temperature = \"{heat}\"\n") };
        let rest = format!("{heat}support = [{{ {support} }}]");
        rectangle(name, "steel", "quad4", (0.0, 0.06, cells), y, &rest)
    };
    format!(
        "analysis = \"plane stress\"\n{alternation}\n{STEEL}{}{}\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"upper.bottom\", \"lower.top\"]\ngeometry = \"{geometry}\"\n{law}\n\
         [[step]]\nsupports = 0.5\ntemperature = 0\n[[step]]\nsupports = 0.8\ntemperature = 0.5\n\
         [[step]]\nsupports = 0.8\n[[step]]\n",
        plate("upper", (0.02, 0.04, 4), 12, upper, "surface = \"top\", x = 3e-6, y = -1e-6"),
        plate("lower", (0.0, 0.02, 4), cells, lower, "surface = \"bottom\", x = 0, y = 0"),
    )
}

const TIGHT: &str = "alternation.tolerance = 1e-11";
const RELAXED: &str = "alternation = { driver = \"relaxed\", transfer = \"mortar\", tolerance = 1e-11, max_alternations = 5000 }";
const UPPER: &str = "293 + 300*x/0.06";
const LOWER: &str = "593 - 100*x/0.06";

/// The tangential traction of all nodes is the bound, which is `bound` of place and pressure.
fn is_at(results: &Results, bound: impl Fn(f64, f64) -> f64, allowed: f64, what: &str) {
    let table: &SideTable = multipliers(results, 0);
    let along = &table.tangential.as_ref().expect("a law").traction;
    let size = worst(along.iter().map(|q| q.abs()));
    assert!(results.pairs[0].varies, "{what}");
    assert!(table.status.iter().all(|status| *status == SLIPS), "{what}: {:?}", table.status);
    for ((x, p), q) in std::iter::zip(&table.x, &table.pressure).zip(along) {
        near(q.abs(), bound(x[0], *p), allowed * size, &format!("{what}, x = {}", x[0]));
    }
}

#[test]
fn all_that_slips_carries_mu_of_the_mean_temperature_there() {
    let [up, low] = [|x: f64| 293.0 + 300.0 * x / 0.06, |x: f64| 593.0 - 100.0 * x / 0.06];
    let mean = |x: f64| 0.5 * (up(x) + low(x));
    for (alternation, cells, geometry, allowed) in [
        (TIGHT, 12, "initial", 1e-9),
        (TIGHT, 17, "initial", 1e-9),
        (TIGHT, 7, "initial", 1e-9),
        (TIGHT, 12, "updated", 1e-3),
        (RELAXED, 12, "initial", 1e-9),
    ] {
        let what = format!("{alternation} {cells} {geometry}");
        let text = |heat, law| dragged(alternation, law, heat, cells, geometry);
        let (_, results) = solve_all(&text([UPPER, LOWER], FALLING), 2, &[]);
        is_at(&results, |x, p| mu(mean(x)) * p, allowed, &what);
        // A body without temperature has that of the other.
        let (_, results) = solve_all(&text([UPPER, ""], FALLING), 2, &[]);
        is_at(&results, |x, p| mu(up(x)) * p, allowed, &what);
        let (_, results) = solve_all(&text(["", LOWER], FALLING), 2, &[]);
        is_at(&results, |x, p| mu(low(x)) * p, allowed, &what);
        let tresca = "law = \"tresca\"\nshear = { temperature = [293, 593], value = [\"0.3 MPa\", 0.15e6] }";
        let (_, results) = solve_all(&text([UPPER, LOWER], tresca), 2, &[]);
        is_at(&results, |x, _| mu(mean(x)) * 1e6, allowed, &what);
    }
}

/// How far the tractions of two runs are apart, relative, and the works of friction.
fn apart(texts: [(&str, usize); 2]) -> f64 {
    let [a, b] = texts.map(|(text, ranks)| {
        let (summary, results) = solve_all(text, ranks, &[]);
        let table = multipliers(&results, 0).clone();
        let along = table.tangential.expect("a law");
        (table.pressure, along.traction, value(&summary, "pairs.pair.friction.dissipated"))
    });
    let off = |a: &[f64], b: &[f64]| {
        worst(std::iter::zip(a, b).map(|(a, b)| (a - b).abs())) / worst(a.iter().map(|a| a.abs()))
    };
    assert!(a.2 > 0.0);
    off(&a.0, &b.0).max(off(&a.1, &b.1)).max(off(&[a.2], &[b.2]))
}

#[test]
fn a_table_with_equal_values_is_the_number() {
    for alternation in [TIGHT, RELAXED] {
        let text = |law| dragged(alternation, law, [UPPER, LOWER], 12, "initial");
        let table = text("friction = { temperature = [293, 593], value = [0.2, 0.2] }");
        let off = apart([(&table, 2), (&text("friction = 0.2"), 2)]);
        assert!(off <= 1e-12, "{off:e}");
    }
}

#[test]
fn the_ranks_do_not_matter() {
    for heat in [[UPPER, LOWER], ["", LOWER], [UPPER, ""]] {
        let text = dragged(TIGHT, FALLING, heat, 17, "initial");
        let off = apart([(&text, 1), (&text, 2)]).max(apart([(&text, 1), (&text, 3)]));
        assert!(off <= 1e-9, "{off:e}");
    }
}

/// No friction where it is hot: nodes there slip without a traction.
#[test]
fn a_table_may_come_down_to_nothing() {
    let law = "friction = { temperature = [293, 443, 593], value = [0.3, 0, 0] }";
    let bound = |x: f64, p: f64| (0.3 - 0.3 * x / 0.03).max(0.0) * p;
    let (_, results) = solve_all(&dragged(TIGHT, law, [UPPER, ""], 12, "initial"), 2, &[]);
    is_at(&results, bound, 1e-9, "nothing");
}
