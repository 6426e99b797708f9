//! Load steps of elastic bodies without friction: only the state at the end matters, and nothing is left after unloading.
use super::{close, multipliers, near, rectangle, solve_all, value};
use kontakt::output::Results;
use kontakt::vector::larger;
use serde_json::Value;

/// Two discs that just do not touch, so that round-off in the mean gap of a row is no interference; the mid-planes are
/// prescribed.
fn discs(steps: &str) -> String {
    let disc = |name: &str, y: f64, arc: &str, size: f64, u: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"{name}\"\n\
             mesh.half_disc = {{ center = [0, {y}], radius = 0.05, arc = \"{arc}\", angle = {{ at = [-45, -1.2, 0, 1.2, 45], size = [6, {size}, {size}, {size}, 6] }}, \
             depth = {{ at = [0, 0.02, 0.6], size = [1e-3, 1e-3, 0.1] }}, core = 4 }}\n\
             support = [{{ surface = \"flat\", y = {u:e} }}, {{ point = [0, {y}], x = 0 }}]\n"
        )
    };
    format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-11\nmaterial.upper = {{ young = 4.2e11, poisson = 0.3 }}\nmaterial.lower = {{ young = 2.1e11, poisson = 0.3 }}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.arc\", \"lower.arc\"], gap_offset = 1e-9 }}]\nprobe = [{{ name = \"p\", body = \"lower\", at = [0, -0.001] }}]\n{steps}\n{}{}",
        disc("upper", 0.05, "down", 0.06, -1.5e-5),
        disc("lower", -0.05, "up", 0.08, 1.5e-5)
    )
}

/// A heated block on a wider one, held by contact alone: it lifts off towards its end.
fn blocks(steps: &str) -> String {
    let body = |name: &str, x: f64, cells: usize, y: f64, rest: &str| {
        let rest = format!("temperature = \"max(600 - 16000*x, 200)\"\n{rest}");
        rectangle(name, "steel", "quad8", (0.0, x, cells), (y, y + 0.025, 8), &rest)
    };
    format!(
        "analysis = \"plane stress\"\nalternation.tolerance = 1e-11\nmaterial.steel = {{ young = 2.1e11, poisson = 0.3, expansion = 12.5e-6, reference_temperature = 293 }}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\nprobe = [{{ name = \"p\", body = \"upper\", at = [0.025, 0.025] }}]\n{steps}\n{}{}",
        body(
            "lower",
            0.05,
            20,
            0.0,
            "support = [{ surface = \"left\", x = 0 }, { surface = \"bottom\", y = 0 }]"
        ),
        body(
            "upper",
            0.025,
            12,
            0.025,
            "support = [{ surface = \"left\", x = 0 }]\nload = [{ surface = \"top\", pressure = 1e8 }]"
        )
    )
}

/// Each step scales all that acts by its factor.
fn steps(factors: &[f64]) -> String {
    let tables: Vec<String> =
        factors.iter().map(|f| format!("{{ loads = {f}, supports = {f}, temperature = {f} }}")).collect();
    format!("step = [{}]", tables.join(", "))
}

fn same_end(a: &(Value, Results), b: &(Value, Results), relative: f64, what: &str) {
    let (s, t) = (multipliers(&a.1, 0), multipliers(&b.1, 0));
    let largest = s.pressure.iter().fold(0.0, |l, p| larger(l, *p));
    for (p, q) in std::iter::zip(&s.pressure, &t.pressure) {
        near(*p, *q, relative * largest, what);
    }
    for c in 0..2 {
        let path = format!("probes.p.displacement.{c}");
        near(value(&a.0, &path), value(&b.0, &path), relative * 1e-4, what);
    }
    close(&a.0, "pairs.c.normal_force", value(&b.0, "pairs.c.normal_force"), relative);
}

#[test]
fn one_step_equals_many() {
    for (name, case) in [("discs", discs as fn(&str) -> String), ("blocks", blocks)] {
        let one = solve_all(&case(""), 2, &[]);
        for factors in [&[0.25, 0.5, 0.75, 1.0][..], &[1.5, 0.2, 1.0], &[0.5, 0.0, 1.0]] {
            let many = solve_all(&case(&steps(factors)), 2, &[]);
            same_end(&one, &many, 1e-8, &format!("{name} {factors:?}"));
        }
    }
}

/// Loaded and unloaded: displacements, stresses and pressures return to zero.
#[test]
fn unloading_leaves_nothing() {
    for (name, case) in [("discs", discs as fn(&str) -> String), ("blocks", blocks)] {
        let (_, results) = solve_all(&case(&steps(&[0.5, 1.0, 0.0])), 2, &[]);
        let largest = |fields: &[kontakt::output::Field], of: &str| {
            let field = fields.iter().find(|f| f.name == of).expect("the field is there");
            field.values.iter().fold(0.0, |l, v| larger(l, v.abs()))
        };
        for field in ["displacement", "stress"] {
            let (loaded, left) = (
                largest(&results.before[1].point_fields, field),
                largest(&results.piece.point_fields, field),
            );
            assert!(left <= 1e-10 * loaded, "{name}: {field} {left:e} of {loaded:e}");
        }
        let p = multipliers(&results, 0).pressure.iter().fold(0.0, |l, p| larger(l, *p));
        let before =
            super::gapped(&results.before[1].pairs[0]).pressure.iter().fold(0.0, |l, p| larger(l, *p));
        assert!(p <= 1e-10 * before, "{name}: pressure {p:e}");
    }
}

/// A block between two stops, pushed to and fro: the contacts of a step are none of the next one's.
fn between_stops(steps: &str, geometry: &str) -> String {
    let block = rectangle(
        "block",
        "steel",
        "quad4",
        (0.0, 0.04, 8),
        (0.0, 0.02, 4),
        "support = [{ surface = \"bottom\", y = 0 }]\nload = [{ body_force = [1e9, 0] }]",
    );
    format!(
        "analysis = \"plane stress\"\nalternation.tolerance = 1e-11\nmaterial.steel = {{ young = 2.1e11, poisson = 0.3 }}\n\
         contact = [{{ name = \"r\", surfaces = [\"block.right\", \"right.surface\"], geometry = \"{geometry}\" }}, \
         {{ name = \"l\", surfaces = [\"block.left\", \"left.surface\"], geometry = \"{geometry}\" }}]\n\
         probe = [{{ name = \"p\", body = \"block\", at = [0.02, 0.02] }}]\n{steps}\n{block}\
         [[body]]\nname = \"right\"\nrigid.plane = {{ through = [0.041, 0], normal = [-1, 0] }}\n\
         [[body]]\nname = \"left\"\nrigid.plane = {{ through = [-0.001, 0], normal = [1, 0] }}\n"
    )
}

/// Whatever the steps before, each step ends as it does alone.
#[test]
fn a_step_alone_ends_the_same() {
    let loads = [1.0, -1.0, -0.3, 0.7];
    for geometry in ["initial", "updated"] {
        let table = |factors: &[f64]| {
            let rows: Vec<String> = factors.iter().map(|f| format!("{{ loads = {f} }}")).collect();
            format!("step = [{}]", rows.join(", "))
        };
        let (all, _) = solve_all(&between_stops(&table(&loads), geometry), 2, &[]);
        for (k, load) in loads.iter().enumerate() {
            let (alone, _) = solve_all(&between_stops(&table(&[*load]), geometry), 1, &[]);
            let (right, left) = if *load > 0.0 { ("r", "l") } else { ("l", "r") };
            for (pair, force) in [(right, 8e5 * load.abs()), (left, 0.0)] {
                let path = format!("pairs.{pair}.normal_force");
                near(value(&all, &format!("steps.{k}.{path}")), force, 1e-8 * 8e5, geometry);
                near(value(&alone, &path), force, 1e-8 * 8e5, geometry);
            }
            let at = |summary, path: String| value(summary, &path);
            let path = "probes.p.displacement.0";
            near(at(&all, format!("steps.{k}.{path}")), at(&alone, path.into()), 1e-9 * 1e-3, geometry);
        }
    }
}

/// A warm start costs less than a cold one.
#[test]
fn a_step_starts_from_the_last_one() {
    let solver = ["--set", "body.upper.response=solver"];
    let (summary, _) = solve_all(&blocks(&steps(&[1.0, 1.0])), 2, &solver);
    let [first, second] = [0, 1].map(|i| value(&summary, &format!("steps.{i}.alternations")));
    assert!(second <= 2.0 && second < first, "{first} {second}");
}
