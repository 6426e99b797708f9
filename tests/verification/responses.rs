//! However a body answers, on however many ranks, and whatever carries forces across: the same solution.
use super::{common, multipliers, near, rectangle, solve_all, value};
use kontakt::output::Results;
use kontakt::vector::larger;
use serde_json::Value;

/// A heated block on a wider one, held by contact alone: it lifts off towards its end. Meshes that do not match.
fn floating(response: [&str; 2]) -> String {
    let body = |name: &str, x: f64, cells: usize, y: f64, rest: &str| {
        let rest = format!("temperature = \"max(600 - 16000*x, 200)\"\n{rest}");
        rectangle(name, "steel", "quad8", (0.0, x, cells), (y, y + 0.025, 8), &rest)
    };
    format!(
        "analysis = \"plane stress\"\nalternation.tolerance = 1e-11\nmaterial.steel = {{ young = 2.1e11, poisson = 0.3, expansion = 12.5e-6, reference_temperature = 293 }}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n\
         probe = [{{ name = \"u\", body = \"upper\", at = [0.025, 0.025] }}, {{ name = \"l\", body = \"lower\", at = [0.05, 0.025] }}]\n{}{}",
        body(
            "lower",
            0.05,
            20,
            0.0,
            &format!(
                "support = [{{ surface = \"left\", x = 0 }}, {{ surface = \"bottom\", y = 0 }}]\n{}",
                response[0]
            )
        ),
        body(
            "upper",
            0.025,
            12,
            0.025,
            &format!(
                "support = [{{ surface = \"left\", x = 0 }}]\nload = [{{ surface = \"top\", pressure = 1e8 }}]\n{}",
                response[1]
            )
        )
    )
}

/// A soft disc on a stiff one; the mid-planes are prescribed.
fn discs(response: [&str; 2]) -> String {
    let disc = |name: &str, y: f64, arc: &str, size: f64, u: f64, response: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"{name}\"\n\
             mesh.half_disc = {{ center = [0, {y}], radius = 0.05, arc = \"{arc}\", angle = {{ at = [-45, -1.2, 0, 1.2, 45], size = [6, {size}, {size}, {size}, 6] }}, \
             depth = {{ at = [0, 0.02, 0.6], size = [1e-3, 1e-3, 0.1] }}, core = 4 }}\n\
             support = [{{ surface = \"flat\", y = {u:e} }}, {{ point = [0, {y}], x = 0 }}]\n{response}\n"
        )
    };
    format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-11\nmaterial.upper = {{ young = 2.1e12, poisson = 0.3 }}\nmaterial.lower = {{ young = 2.1e11, poisson = 0.3 }}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.arc\", \"lower.arc\"] }}]\nprobe = [{{ name = \"l\", body = \"lower\", at = [0, -0.001] }}]\n{}{}",
        disc("upper", 0.05, "down", 0.06, -1.5e-5, response[0]),
        disc("lower", -0.05, "up", 0.08, 1.5e-5, response[1])
    )
}

const CONDENSED: &str = "response = \"condensed\"";
const SOLVER: &str = "response = \"solver\"";
const MULTIGRID: &str =
    "response = \"solver\"\nsolver = \"-ksp_type cg -pc_type gamg -ksp_rtol 1e-13 -ksp_max_it 2000\"";

fn same(a: &(Value, Results), b: &(Value, Results), relative: f64, what: &str) {
    common::assert_agree(&a.0, &b.0, relative, what);
    let (s, t) = (multipliers(&a.1, 0), multipliers(&b.1, 0));
    let largest = s.pressure.iter().fold(0.0, |l, p| larger(l, *p));
    for (p, q) in std::iter::zip(&s.pressure, &t.pressure) {
        near(*p, *q, relative * largest, what);
    }
}

#[test]
fn condensed_or_solved() {
    for (name, case) in [("floating", floating as fn([&str; 2]) -> String), ("discs", discs)] {
        let reference = solve_all(&case([CONDENSED; 2]), 1, &[]);
        for (body, is) in reference.0["bodies"].as_array().expect("bodies").iter().zip(["condensed"; 2]) {
            assert_eq!(body["response"], is, "{name}");
        }
        for (ranks, response) in [
            (1, [SOLVER; 2]),
            (2, [CONDENSED, SOLVER]),
            (4, [CONDENSED; 2]),
            (4, [SOLVER; 2]),
            (3, [SOLVER, CONDENSED]),
        ] {
            let run = solve_all(&case(response), ranks, &[]);
            same(&reference, &run, 1e-8, &format!("{name} {response:?} on {ranks} ranks"));
        }
    }
}

#[test]
fn solved_by_multigrid() {
    let reference = solve_all(&floating([CONDENSED; 2]), 1, &[]);
    for ranks in [1, 2, 4] {
        let run = solve_all(&floating([MULTIGRID; 2]), ranks, &[]);
        same(&reference, &run, 1e-8, &format!("by multigrid on {ranks} ranks"));
    }
}

/// Where nodes match, nodes against facets are the mortar rows but for the directions of the normals on curved surfaces.
#[test]
fn pointwise_transfer_on_matching_meshes() {
    let block = |transfer: &str| {
        let body = |name: &str, y: f64, rest: &str| {
            rectangle(name, name, "quad4", (0.0, 0.04, 9), (y, y + 0.02, 5), rest)
        };
        format!(
            "analysis = \"plane stress\"\nalternation = {{ tolerance = 1e-12, transfer = \"{transfer}\" }}\n\
             material.lower = {{ young = 2e11, poisson = 0.3 }}\nmaterial.upper = {{ young = 7e10, poisson = 0.33 }}\n\
             contact = [{{ name = \"c\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\nprobe = [{{ name = \"u\", body = \"upper\", at = [0.04, 0.04] }}]\n{}{}",
            body("lower", 0.0, "support = [{ surface = \"bottom\", x = 0, y = 0 }]"),
            // More on one side than on the other: it lifts off.
            body(
                "upper",
                0.02,
                "support = [{ point = [0, 0.04], x = 0 }]\nload = [{ surface = \"top\", pressure = \"1e8*(1 - x/0.04)\" }]"
            )
        )
    };
    let [a, b] = ["mortar", "pointwise"].map(|t| solve_all(&block(t), 2, &[]));
    same(&a, &b, 1e-8, "blocks");
    let set = [
        "--set",
        "alternation.transfer=pointwise",
        "--set",
        "body.upper.mesh.half_disc.angle.size=[6, 0.08, 0.08, 0.08, 6]",
    ];
    let a = solve_all(&discs([""; 2]), 2, &set[2..]);
    let b = solve_all(&discs([""; 2]), 2, &set);
    assert_eq!((&a.0["transfer"], &b.0["transfer"]), (&"mortar".into(), &"pointwise".into()));
    for path in ["pairs.c.normal_force", "pairs.c.max_pressure"] {
        let (p, q) = (value(&a.0, path), value(&b.0, path));
        near(p, q, 1e-3 * p, path);
    }
}

/// With friction the contact problem is settled on a compliance that learns from the alternations: the same tractions and work, in few of
/// them, whichever body answers by its solver, by multigrid as well, on any number of ranks.
#[test]
fn friction_is_the_same_however_bodies_answer() {
    let text = super::friction::discs(0.3, 8.0, super::friction::A_OVER_B, &[0.0, 0.5, -0.3]);
    let of = |upper: &str, lower: &str| {
        text.replacen("name = \"upper\"\n", &format!("name = \"upper\"\n{upper}\n"), 1).replacen(
            "name = \"lower\"\n",
            &format!("name = \"lower\"\n{lower}\n"),
            1,
        )
    };
    let (condensed, exact) = solve_all(&of(CONDENSED, CONDENSED), 2, &[]);
    let lost = condensed["energy"]["dissipated"].as_f64().expect("a number");
    let exact = &multipliers(&exact, 0).tangential.as_ref().expect("tractions").traction;
    let most = exact.iter().fold(0.0, |most, q| larger(most, q.abs()));
    for (answers, ranks) in
        [([SOLVER, SOLVER], 1), ([SOLVER, SOLVER], 4), ([CONDENSED, SOLVER], 2), ([MULTIGRID, SOLVER], 2)]
    {
        let (summary, results) = solve_all(&of(answers[0], answers[1]), ranks, &[]);
        for step in summary["steps"].as_array().expect("steps") {
            // Without friction conjugate gradients take 30 and more.
            assert!(step["alternations"].as_u64().expect("a number") <= 18, "{}", step["alternations"]);
        }
        assert!(summary["bodies"][1]["response"] == "solver");
        near(
            summary["energy"]["dissipated"].as_f64().expect("a number"),
            lost,
            1e-7 * lost,
            "work of friction",
        );
        let found = &multipliers(&results, 0).tangential.as_ref().expect("tractions").traction;
        for (q, exact) in std::iter::zip(found, exact) {
            near(*q, *exact, 1e-7 * most, "traction");
        }
    }
    // A wedge between two blocks, whose compliance is not that of a half-plane.
    let wedge = std::fs::read_to_string("cases/hard/wedge/case.toml").expect("the case reads");
    let wedge = wedge
        .split("[[variant]]")
        .next()
        .expect("a case")
        .replace("[[contact]]", "[[contact]]\nfriction = 0.3");
    let works = [CONDENSED, SOLVER].map(|answer| {
        let text = wedge.replace("[[body]]", &format!("[[body]]\n{answer}"));
        solve_all(&text, 2, &[]).0["energy"]["dissipated"].as_f64().expect("a number")
    });
    near(works[1], works[0], 1e-6 * works[0], "work of friction");
}
