//! The paper's alternation on what the default driver is known to solve: load steps, rigid bodies, both transfers, both
//! geometries.
use super::{attempt, multipliers, near, rectangle, solve_all, value};
use kontakt::output::Results;
use kontakt::vector::larger;
use serde_json::Value;

const DEFAULT: &str = "driver = \"active set\", tolerance = 1e-11";
const RELAXED: &str = "driver = \"relaxed\", tolerance = 1e-11";

/// Two half discs pressed together by their mid-planes, of moduli that differ by `ratio`.
fn discs(alternation: &str, ratio: f64, rest: &str, contact: &str) -> String {
    let disc = |name: &str, y: f64, arc: &str, u: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"{name}\"\n\
             mesh.half_disc = {{ center = [0, {y}], radius = 0.05, arc = \"{arc}\", angle = {{ at = [-45, -1.2, 0, 1.2, 45], size = [6, 0.1, 0.1, 0.1, 6] }}, \
             depth = {{ at = [0, 0.02, 0.6], size = [1e-3, 1e-3, 0.1] }}, core = 4 }}\n\
             support = [{{ surface = \"flat\", y = {u:e} }}, {{ point = [0, {y}], x = 0 }}]\n"
        )
    };
    format!(
        "analysis = \"plane strain\"\nalternation = {{ {alternation} }}\nmaterial.upper = {{ young = {:e}, poisson = 0.3 }}\n\
         material.lower = {{ young = 2.1e11, poisson = 0.3 }}\n{rest}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.arc\", \"lower.arc\"], gap_offset = 1e-9{contact} }}]\n{}{}",
        2.1e11 * ratio,
        disc("upper", 0.05, "down", -1.5e-5),
        disc("lower", -0.05, "up", 1.5e-5)
    )
}

/// Forces and pressures of both drivers after every step, and the last state node by node.
fn same(text: impl Fn(&str) -> String, relative: f64, what: &str) -> [(Value, Results); 2] {
    let [a, b] = [DEFAULT, RELAXED].map(|driver| solve_all(&text(driver), 2, &[]));
    assert_eq!((&a.0["driver"], &b.0["driver"]), (&"active_set".into(), &"relaxed".into()));
    let steps =
        |summary: &Value| summary["steps"].as_array().cloned().unwrap_or_else(|| vec![summary.clone()]);
    let (before, after) = (steps(&a.0), steps(&b.0));
    assert_eq!(before.len(), after.len(), "{what}");
    for (k, (x, y)) in std::iter::zip(&before, &after).enumerate() {
        for path in ["pairs.c.normal_force", "pairs.c.max_pressure"] {
            let largest = before.iter().map(|step| value(step, path)).fold(0.0, larger);
            near(value(y, path), value(x, path), relative * largest, &format!("{what}: step {k}: {path}"));
        }
    }
    let largest = multipliers(&a.1, 0).pressure.iter().copied().fold(0.0, larger);
    for (p, q) in std::iter::zip(&multipliers(&a.1, 0).pressure, &multipliers(&b.1, 0).pressure) {
        near(*q, *p, relative * largest, &format!("{what}: pressure"));
    }
    [a, b]
}

/// Loading, unloading to nothing, and loading again; a step begins with the forces of the one before.
#[test]
fn load_steps() {
    let steps = "step = [{ supports = 0.4 }, { supports = 1 }, { supports = -1 }, { supports = 0.7 }]";
    for transfer in ["mortar", "pointwise"] {
        for ratio in [1.0, 5.0] {
            let text =
                |driver: &str| discs(&format!("{driver}, transfer = \"{transfer}\""), ratio, steps, "");
            let [_, relaxed] = same(text, 1e-7, &format!("{transfer}, {ratio}"));
            assert_eq!(value(&relaxed.0, "steps.2.pairs.c.normal_force"), 0.0);
        }
    }
}

#[test]
fn updated_geometry() {
    let transfer = |driver: &str| format!("{driver}, transfer = \"mortar\"");
    let text = |driver: &str| discs(&transfer(driver), 2.0, "", ", geometry = \"updated\"");
    let [_, updated] = same(text, 1e-7, "updated");
    let initial = solve_all(&discs(&transfer(RELAXED), 2.0, "", ""), 1, &[]);
    let [p, q] = [&updated, &initial].map(|run| value(&run.0, "pairs.c.max_pressure"));
    assert!((p / q - 1.0).abs() > 1e-4, "the geometry was updated");
}

/// A block pressed by a rigid circle, a rigid plane, a rigid edge, step by step: the block takes all of every correction,
/// whatever the weights.
#[test]
fn rigid_bodies() {
    for (shape, motion) in [
        ("circle = { center = [0.013, 0.12], radius = 0.1 }", -2e-5),
        ("plane = { through = [0, 0.02], normal = [0, -1] }", -1e-5),
        (
            "polyline = { points = [[0.01, 0.04], [0.01, 0.02], [0.03, 0.02], [0.03, 0.04], [0.01, 0.04]] }",
            -1e-5,
        ),
    ] {
        for weights in ["\"response\"", "\"stiffness\"", "\"magnitude\"", "0.3"] {
            let text = |driver: &str| {
                let weights =
                    if driver == RELAXED { format!(", weights = {weights}") } else { String::new() };
                format!(
                    "analysis = \"plane strain\"\nalternation = {{ {driver}{weights}, transfer = \"mortar\" }}\n\
                     material.steel = {{ young = 2.1e11, poisson = 0.3 }}\n\
                     contact = [{{ name = \"c\", surfaces = [\"punch.surface\", \"block.top\"] }}]\n\
                     step = [{{ supports = 0.5 }}, {{ supports = 1 }}]\n\
                     [[body]]\nname = \"punch\"\nrigid = {{ {shape}, y = {motion:e} }}\n{}",
                    rectangle(
                        "block",
                        "steel",
                        "quad4",
                        (0.0, 0.04, 40),
                        (0.0, 0.02, 20),
                        "support = [{ surface = \"bottom\", x = 0, y = 0 }]"
                    )
                )
            };
            let [_, relaxed] = same(text, 1e-7, &format!("{shape}, {weights}"));
            assert!(value(&relaxed.0, "pairs.c.normal_force") > 1e5, "{shape}");
        }
    }
}

/// Uniform pressure passes between nodes that do not match, whichever side is the finer one, by mortar; not by the paper's own
/// transfer, and the run says so.
#[test]
fn meshes_that_do_not_match() {
    for cells in [[5, 7], [7, 5], [3, 16], [16, 3]] {
        let text = |transfer: &str| {
            let body = |name: &str, y: f64, cells: usize, rest: &str| {
                rectangle(name, name, "quad4", (0.0, 0.04, cells), (y, y + 0.02, 4), rest)
            };
            format!(
                "analysis = \"plane stress\"\nalternation = {{ {RELAXED}, transfer = \"{transfer}\" }}\n\
                 material.lower = {{ young = 2e11, poisson = 0.3 }}\nmaterial.upper = {{ young = 7e10, poisson = 0.33 }}\n\
                 contact = [{{ name = \"c\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n{}{}",
                body(
                    "lower",
                    0.0,
                    cells[0],
                    "support = [{ surface = \"bottom\", y = 0 }, { point = [0, 0], x = 0 }]"
                ),
                body(
                    "upper",
                    0.02,
                    cells[1],
                    "support = [{ surface = \"top\", y = -1e-5 }, { point = [0, 0.04], x = 0 }]"
                )
            )
        };
        let exact = 1e-5 / (0.02 / 2e11 + 0.02 / 7e10);
        for ranks in [1, 2] {
            let (_, results) = solve_all(&text("mortar"), ranks, &[]);
            for p in &multipliers(&results, 0).pressure {
                near(*p, exact, 1e-8 * exact, &format!("{cells:?} on {ranks} ranks"));
            }
        }
        let (summary, log) = attempt(&text("pointwise"), 3);
        let summary = summary.expect("a summary");
        assert_eq!(summary["reason"], "unbalanced", "{cells:?}: {log}");
        assert!(value(&summary, "pairs.c.force_imbalance") > 1e-2, "{cells:?}");
        assert!(log.contains("do not match"), "{log}");
    }
}
