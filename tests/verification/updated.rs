//! `geometry = "updated"`: normals and gaps that follow the deformation.
use super::{common, near, rectangle, solve_all, value};
use kontakt::output::Results;
use kontakt::record::SideTable;
use kontakt::vector::larger;
use serde_json::Value;

const HEADING: &str = "analysis = \"plane strain\"\nalternation.tolerance = 1e-11\nmaterial.lower = { young = 2.1e11, poisson = 0.3 }\nmaterial.upper = { young = 7e10, poisson = 0.33 }\n";

fn contact(surfaces: [&str; 2], geometry: &str) -> String {
    format!(
        "contact = [{{ name = \"c\", surfaces = [\"{}\", \"{}\"], geometry = \"{geometry}\" }}]\n",
        surfaces[0], surfaces[1]
    )
}

/// Pressures on a surface by the nodes' positions less a shift.
fn profile(results: &Results, side: usize, shift: f64) -> Vec<(f64, f64)> {
    let side: &SideTable = results.pairs[0].sides[side].as_ref().expect("a table");
    std::iter::zip(&side.x, &side.pressure).map(|(x, p)| (x[0] - shift, *p)).collect()
}

fn same(moved: &(Value, Results), built: &(Value, Results), shift: f64, relative: f64) {
    let force = value(&built.0, "pairs.c.normal_force");
    near(value(&moved.0, "pairs.c.normal_force"), force, relative * force, "normal force");
    let (p, q) = (profile(&moved.1, 0, 0.0), profile(&built.1, 0, shift));
    let largest = q.iter().fold(0.0_f64, |l, q| larger(l, q.1));
    for ((x, p), (y, q)) in std::iter::zip(p, q) {
        near(x, y, 1e-12, "the same node");
        near(p, q, relative * largest, &format!("pressure at {x:e}"));
    }
}

/// A block pushed along a wider one by half of its width, then pressed: as if it had been there from the start.
#[test]
fn pushed_along() {
    let case = |start: f64, push: f64, geometry: &str| {
        let upper = rectangle(
            "upper",
            "upper",
            "quad8",
            (-0.01 + start, 0.01 + start, 9),
            (0.02, 0.035, 6),
            &format!("support = [{{ surface = \"top\", x = {push}, y = -1e-5 }}]"),
        );
        let lower = rectangle(
            "lower",
            "lower",
            "quad8",
            (-0.03, 0.06, 30),
            (0.0, 0.02, 8),
            "support = [{ surface = \"bottom\", x = 0, y = 0 }]",
        );
        HEADING.to_owned() + &contact(["upper.bottom", "lower.top"], geometry) + &upper + &lower
    };
    let moved = solve_all(&case(0.0, 0.0123, "updated"), 2, &[]);
    let built = solve_all(&case(0.0123, 0.0, "updated"), 2, &[]);
    same(&moved, &built, 0.0123, 1e-7);
    // Small displacements: the initial geometry is right to the order of the strains.
    let initial = solve_all(&case(0.0123, 0.0, "initial"), 2, &[]);
    same(&initial, &built, 0.0, 5e-3);
}

/// A disc pushed over the top of a rigid cylinder, and pressed down: the further, the less they meet.
#[test]
fn over_the_top() {
    let case = |start: f64, push: f64, geometry: &str| {
        let r = 0.05;
        let y = r - 2e-5;
        format!(
            "{HEADING}{}[[body]]\nname = \"upper\"\nmaterial = \"upper\"\nelement = \"quad8\"\n\
             mesh.half_disc = {{ center = [{start}, {y}], radius = {r}, arc = \"down\", angle = {{ at = [-45, -2, 0, 2, 45], size = [5, 0.1, 0.1, 0.1, 5] }}, \
             depth = {{ at = [0, 0.02, 0.6], size = [1.7e-3, 1.7e-3, 0.1] }}, core = 5 }}\n\
             support = [{{ surface = \"flat\", x = {push}, y = 0 }}]\n\
             [[body]]\nname = \"cylinder\"\nrigid.circle = {{ center = [0, -0.05], radius = 0.05 }}\n",
            contact(["upper.arc", "cylinder.surface"], geometry)
        )
    };
    // The overlap of 20 um is lost by s^2 / (2 (R + R)) = 11 um.
    let s = 1.5e-3;
    let moved = solve_all(&case(0.0, s, "updated"), 2, &[]);
    let built = solve_all(&case(s, 0.0, "updated"), 2, &[]);
    same(&moved, &built, s, 1e-6);
    // The initial geometry knows nothing of it, and says so.
    let initial = solve_all(&case(0.0, s, "initial"), 2, &[]);
    let (wrong, right) = (value(&initial.0, "pairs.c.normal_force"), value(&built.0, "pairs.c.normal_force"));
    assert!(wrong > 1.5 * right, "{wrong:e} {right:e}");
}

/// A heated ring grows into a bore by 1 % of its radius: the force is that of theory on the undeformed ring (Lame).
#[test]
fn deep_into_a_bore() {
    let (a, b, d, e, nu) = (0.05_f64, 0.1_f64, 1e-3, 2.1e11, 0.3);
    let exact = d / (b / e * ((b * b + a * a) / (b * b - a * a) - nu)) * 0.5 * std::f64::consts::PI * b;
    for geometry in ["initial", "updated"] {
        let text = format!(
            "analysis = \"plane stress\"\nalternation.tolerance = 1e-11\nmaterial.steel = {{ young = {e:e}, poisson = {nu} }}\n{}\
             probe = [{{ name = \"p\", body = \"ring\", at = [0.1, 0] }}]\n\
             [[body]]\nname = \"bore\"\nrigid.circle = {{ center = [0, 0], radius = {}, inside = true }}\n\
             [[body]]\nname = \"ring\"\nmaterial = \"steel\"\nelement = \"quad8\"\n\
             mesh.ring = {{ radius = {{ from = 0.05, to = 0.1, cells = 12 }}, angle = {{ from = 0, to = 90, cells = 40 }} }}\n\
             support = [{{ surface = \"start\", y = 0 }}, {{ surface = \"end\", x = 0 }}]\n",
            contact(["ring.outer", "bore.surface"], geometry),
            b - d
        );
        let (summary, _) = solve_all(&text, 2, &[]);
        near(value(&summary, "pairs.c.normal_force"), exact, 1e-4 * exact, geometry);
        near(value(&summary, "probes.p.displacement.0"), -d, 1e-4 * d, geometry);
    }
}

/// Two discs: what the initial geometry misses is of the order of the strains, and falls with them.
#[test]
fn small_displacements_need_no_update() {
    let case = |closing: f64, geometry: &str| {
        let disc = |name: &str, y: f64, arc: &str, size: f64, u: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nmaterial = \"{name}\"\nelement = \"quad8\"\n\
                 mesh.half_disc = {{ center = [0, {y}], radius = 0.05, arc = \"{arc}\", angle = {{ at = [-45, -1.2, 0, 1.2, 45], size = [6, {size}, {size}, {size}, 6] }}, \
                 depth = {{ at = [0, 0.02, 0.6], size = [1e-3, 1e-3, 0.1] }}, core = 4 }}\n\
                 support = [{{ surface = \"flat\", y = {u:e} }}, {{ point = [0, {y}], x = 0 }}]\n"
            )
        };
        HEADING.to_owned()
            + &contact(["upper.arc", "lower.arc"], geometry)
            + &disc("upper", 0.05, "down", 0.06, -closing)
            + &disc("lower", -0.05, "up", 0.08, closing)
    };
    let difference = |closing: f64| {
        let [a, b] = ["initial", "updated"]
            .map(|g| value(&solve_all(&case(closing, g), 2, &[]).0, "pairs.c.normal_force"));
        (a / b - 1.0).abs()
    };
    let [small, large] = [4e-6, 16e-6].map(difference);
    // Strains are of the order of the half-width over the radius, 0.5 % and 1 %.
    assert!(small < 1e-3 && large < 2e-3 && small < large, "{small:e} {large:e}");
}

/// One step or several: the geometry in the end is the same.
#[test]
fn updates_do_not_depend_on_the_steps() {
    let case = |steps: &str| {
        let upper = rectangle(
            "upper",
            "upper",
            "quad4",
            (-0.01, 0.01, 9),
            (0.02, 0.035, 6),
            "support = [{ surface = \"top\", x = 0.004, y = -1e-5 }]",
        );
        let lower = rectangle(
            "lower",
            "lower",
            "quad4",
            (-0.03, 0.06, 40),
            (0.0, 0.02, 8),
            "support = [{ surface = \"bottom\", x = 0, y = 0 }]",
        );
        HEADING.to_owned() + &contact(["upper.bottom", "lower.top"], "updated") + steps + &upper + &lower
    };
    let one = solve_all(&case(""), 2, &[]);
    let many =
        solve_all(&case("step = [{ supports = 0.3 }, { supports = 0.7 }, { supports = 1 }]\n"), 2, &[]);
    common::assert_agree(&one.0, &many.0, 1e-7, "one step and three");
}

/// A rigid roller, pressed in and moved along: without friction the way there does not matter, in one step or in three.
#[test]
fn the_way_there_does_not_matter() {
    let case = |steps: &str| {
        let block = rectangle(
            "block",
            "lower",
            "quad8",
            (-0.02, 0.02, 40),
            (-0.02, 0.0, 20),
            "support = [{ surface = \"bottom\", x = 0, y = 0 }]",
        );
        HEADING.to_owned()
            + steps
            + &contact(["roller.surface", "block.top"], "updated")
            + "[[body]]\nname = \"roller\"\nrigid = { circle = { center = [-0.003, 0.05], radius = 0.05 }, x = 0.006, y = -2e-5 }\n"
            + &block
    };
    let one = solve_all(&case(""), 2, &[]);
    let three = solve_all(&case("step = [{ supports = 0.3 }, { supports = 0.7 }, {}]\n"), 2, &[]);
    let side = |results: &Results| results.pairs[0].sides[1].clone().expect("the block's table");
    let (p, q) = (side(&one.1), side(&three.1));
    let largest = p.pressure.iter().copied().fold(0.0, larger);
    assert!(largest > 1e7, "the roller presses: {largest:e}");
    for (p, q) in std::iter::zip(&p.pressure, &q.pressure) {
        near(*q, *p, 1e-7 * largest, "pressure");
    }
    // Mirrored at the roller's axis, which has come to x = 3 mm.
    let moment = value(&one.0, "pairs.c.moment");
    let force = value(&one.0, "pairs.c.normal_force");
    near(moment.abs() / force, 0.003, 1e-5, "the resultant lies below the axis");
}
