//! Bodies that yield where they touch: V08-5, indentation of two half discs by both theories, friction, heat.
use super::{common::assert_agree, multipliers, near, pressure_at, rectangle, solve_within, value};
use kontakt::output::Results;
use kontakt::vector::larger;
use serde_json::Value;
use std::f64::consts::PI;

/// Radius of the punch, m; E / (1 - nu^2) of the block, and its yield stress, Pa; nu.
const LINE: (f64, f64, f64, f64) = (0.05, 2.1e11 / 0.91, 350e6, 0.3);

/// Depth of the largest von Mises stress under a line contact over the half width, and that stress over the peak pressure, from Hertz' field
/// on the axis.
fn hertz_yields() -> (f64, f64) {
    let mises = |z: f64| {
        let root = (1.0 + z * z).sqrt();
        let (x, y) = (-((1.0 + 2.0 * z * z) / root - 2.0 * z), -1.0 / root);
        let across = LINE.3 * (x + y);
        (0.5 * ((x - y).powi(2) + (y - across).powi(2) + (across - x).powi(2))).sqrt()
    };
    let depths = (0..20_000).map(|i| 1e-4 * f64::from(i));
    depths.map(|z| (z, mises(z))).max_by(|a, b| a.1.total_cmp(&b.1)).expect("depths")
}

/// Half width and force at first yield, m and N/m.
fn first_yield() -> (f64, f64) {
    let peak = LINE.2 / hertz_yields().1;
    let half_width = 2.0 * LINE.0 * peak / LINE.1;
    (half_width, 0.5 * PI * half_width * peak)
}

/// Half a block `far` half widths wide and high, `cells` to a half width down to `zone` of them, and a rigid disc that goes down by each of
/// the `levels` times a^2 / R, in `increments` each.
fn line(
    theory: &str,
    element: &str,
    [cells, zone, far]: [f64; 3],
    levels: &[f64],
    increments: usize,
) -> String {
    let a = first_yield().0;
    let last = levels[levels.len() - 1];
    let steps: Vec<String> =
        levels.iter().map(|l| format!("{{ supports = {:e}, steps = {increments} }}", l / last)).collect();
    let (h, zone, coarse, far) = (a / cells, zone * a, 0.1 * far * a, far * a);
    format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-8\nplasticity.theory = \"{theory}\"\nstep = [{}]\n\
         material.m = {{ young = 2.1e11, poisson = 0.3, plasticity = {{ yield_stress = {} }} }}\n\
         contact = [{{ name = \"c\", surfaces = [\"block.top\", \"punch.surface\"] }}]\n\
         [[body]]\nname = \"block\"\nmaterial = \"m\"\nelement = \"{element}\"\n\
         mesh.rectangle.x = {{ at = [0, {zone:e}, {far:e}], size = [{h:e}, {h:e}, {coarse:e}] }}\n\
         mesh.rectangle.y = {{ at = [-{far:e}, -{:e}, 0], size = [{coarse:e}, {h:e}, {h:e}] }}\n\
         support = [{{ surface = \"left\", x = 0 }}, {{ surface = \"bottom\", y = 0 }}]\n\
         [[body]]\nname = \"punch\"\nrigid = {{ circle = {{ center = [0, {r}], radius = {r} }}, y = {:e} }}\n",
        steps.join(", "),
        LINE.2,
        1.3 * zone,
        -last * a * a / LINE.0,
        r = LINE.0
    )
}

/// V08-5: force, half width, central pressure. The half widths of the table are known to the digit in brackets there, and to half a cell.
#[test]
fn line_contact_beyond_yield() {
    let (a, force) = first_yield();
    near(a, 2.720400e-4, 1e-6 * a, "half width at first yield");
    near(force, 2.682645e5, 1e-6 * force, "force at first yield");
    let table = [
        (2.0, 0.785, 0.88, 0.05, 1.59),
        (4.0, 1.671, 1.35, 0.05, 2.049),
        (6.0, 2.532, 1.85, 0.05, 2.196),
        (8.0, 3.353, 2.35, 0.05, 2.268),
        (12.0, 4.855, 3.2, 0.1, 2.335),
    ];
    let text = line("flow", "quad4", [6.0, 4.5, 60.0], &table.map(|row| row.0), 10);
    let (summary, results) = solve_within(&text, 1, &[], 10.0);
    let of = |step: usize, key: &str| value(&summary, &format!("steps.{step}.pairs.c.{key}"));
    for (i, (level, p, width, known, central)) in table.into_iter().enumerate() {
        near(2.0 * of(i, "normal_force") / force, p, 5e-3 * p, &format!("{level}: force"));
        near(of(i, "contact_length") / a, width, known + 0.5 / 6.0, &format!("{level}: half width"));
        near(of(i, "max_pressure") / LINE.2, central, 5e-3 * central, &format!("{level}: pressure"));
        quadratic(&summary["steps"][i]);
    }
    // Elastic still: Hertz'.
    near(
        of(0, "contact_length") / a,
        (2.0 * of(0, "normal_force") / force).sqrt(),
        0.01,
        "elastic half width",
    );
    near(pressure_at(multipliers(&results, 0), 0.0), of(4, "max_pressure"), 1e-9 * LINE.2, "in the middle");
    for (level, p, central) in [(4.0, 1.6705, 2.056), (8.0, 3.333, 2.351)] {
        let (summary, _) =
            solve_within(&line("deformation", "quad4", [6.0, 4.5, 60.0], &[level], 1), 1, &[], 10.0);
        let of = |key: &str| value(&summary, &format!("pairs.c.{key}"));
        near(2.0 * of("normal_force") / force, p, 5e-3 * p, &format!("deformation {level}: force"));
        near(of("max_pressure") / LINE.2, central, 5e-3 * central, &format!("deformation {level}: pressure"));
    }
}

/// A line contact yields first at 0.70 of its half width below the middle, when Hertz says. The sides of the block are far away: those of
/// a block of 60 half widths bring it forward by 2.5 %, of 240 by 0.4 %.
#[test]
fn line_contact_yields_first_inside() {
    let (a, force) = first_yield();
    let (depth, _) = hertz_yields();
    near(depth, 0.70, 0.006, "Hertz' depth");
    let levels: Vec<f64> = (0..8).map(|i| 3.82 + 0.02 * f64::from(i)).collect();
    let found =
        |levels: &[f64]| solve_within(&line("flow", "quad8", [10.0, 1.6, 960.0], levels, 1), 1, &[], 10.0);
    let (summary, _) = found(&levels);
    let plastic = |i: usize| value(&summary, &format!("steps.{i}.plasticity.max_plastic_strain"));
    let first = (0..levels.len()).find(|&i| plastic(i) > 0.0).expect("it yields");
    assert!(first > 0, "it has yielded before");
    let load = |i: usize| 2.0 * value(&summary, &format!("steps.{i}.pairs.c.normal_force")) / force;
    assert!(load(first) - load(first - 1) < 6e-3, "fine steps");
    near(0.5 * (load(first) + load(first - 1)), 1.0, 0.01, "force at first yield");
    let pressure = value(&summary, &format!("steps.{first}.pairs.c.max_pressure"));
    let peak = LINE.2 / hertz_yields().1;
    near(pressure, peak, 0.01 * peak, "pressure at first yield");
    let (_, results) = found(&levels[..=first]);
    let fields = &results.piece.point_fields;
    let p = &fields.iter().find(|f| f.name == "equivalent_plastic_strain").expect("the field").values;
    let most = (0..p.len()).max_by(|&i, &j| p[i].total_cmp(&p[j])).expect("nodes");
    let [x, y, _] = results.piece.points[most];
    near(x, 0.0, 0.11 * a, "on the axis");
    near(-y / a, depth, 0.06, "depth of first yield");
}

/// The last increment of a step ends quadratically, or nearly, and takes no more than eight iterations, as the others on the mean.
fn quadratic(step: &Value) {
    let plasticity = &step["plasticity"];
    let residuals: Vec<f64> =
        plasticity["residuals"].as_array().expect("residuals").iter().filter_map(Value::as_f64).collect();
    assert!(residuals.len() <= 8, "{residuals:?}");
    assert!(value(plasticity, "iterations") <= 8.0 * value(step, "increments"), "{plasticity}");
    if let [.., before, last] = residuals[..] {
        assert!(last <= larger(before.powf(1.5), 1e-10), "{residuals:?}");
    }
}

/// Two half discs on each other; `size`: of the cells on the arc, degrees; `supports` of the upper and the lower flat.
fn discs(size: f64, head: &str, contact: &str, supports: [&str; 2]) -> String {
    let disc = |name: &str, y: f64, arc: &str, supports: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"m\"\n\
             mesh.half_disc = {{ center = [0, {y}], radius = 0.05, arc = \"{arc}\", angle = {{ at = [-45, -1.5, 1.5, 45], size = [6, {size}, {size}, 6] }}, \
             depth = {{ at = [0, 0.04, 0.6], size = [{depth}, {depth}, 0.1] }}, core = 6 }}\nsupport = [{supports}]\n",
            depth = 0.0175 * size
        )
    };
    format!(
        "analysis = \"plane strain\"\n{head}\n\
         material.m = {{ young = 2.1e11, poisson = 0.3, plasticity = {{ yield_stress = 500e6, hardening = 2e9 }} }}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.arc\", \"lower.arc\"]{contact} }}]\n{}{}",
        disc("upper", 0.05, "down", supports[0]),
        disc("lower", -0.05, "up", supports[1])
    )
}

/// Pressed together by 40 um.
pub(super) fn indentation(size: f64, head: &str) -> String {
    let supports = [
        "{ surface = \"flat\", y = -4e-5 }, { point = [0, 0.05], x = 0 }",
        "{ surface = \"flat\", y = 0 }, { point = [0, -0.05], x = 0 }",
    ];
    discs(size, head, "", supports)
}

fn stress_at_nodes(results: &Results) -> f64 {
    super::plasticity::largest(results, "stress")
}

/// While the load grows both theories agree to 1 %; unloaded, plastic flow leaves stresses and the deformation theory nothing.
#[test]
fn both_theories_of_an_indentation() {
    let run = |theory: &str, increments: usize| {
        let head = format!(
            "plasticity.theory = \"{theory}\"\nstep = [{{ supports = 0.5, steps = {increments} }}, {{ steps = {increments} }}, {{ supports = 0 }}]"
        );
        solve_within(&indentation(0.1, &head), 2, &[], 10.0)
    };
    let (flow, deformation) = (run("flow", 5), run("deformation", 1));
    for step in [0, 1] {
        let of = |summary: &Value, key: &str| value(summary, &format!("steps.{step}.{key}"));
        for (key, allowed) in [
            ("pairs.c.normal_force", 0.002),
            ("pairs.c.contact_length", 0.01),
            ("pairs.c.max_pressure", 0.02),
        ] {
            let (a, b) = (of(&flow.0, key), of(&deformation.0, key));
            near(a, b, allowed * b, key);
        }
        // The normals are those of one of the discs.
        let [upper, lower] =
            ["upper", "lower"].map(|disc| of(&flow.0, &format!("plasticity.bodies.{disc}.work")));
        near(upper, lower, 0.05 * lower, "work");
        for summary in [&flow.0, &deformation.0] {
            quadratic(&summary["steps"][step]);
            assert!(of(summary, "energy.imbalance") < 1e-6);
        }
    }
    let force = |i: usize| value(&flow.0, &format!("steps.{i}.pairs.c.normal_force"));
    assert!(force(1) > 2.0 * force(0) && force(2) == 0.0, "pressed and taken off");
    let left = [&flow, &deformation].map(|(_, results)| stress_at_nodes(results) / 500e6);
    assert!(left[0] > 0.4 && left[1] < 1e-9, "{left:?}");
    assert!(value(&flow.0, "plasticity.max_plastic_strain") > 2e-3);
    near(value(&deformation.0, "plasticity.max_plastic_strain"), 0.0, 0.0, "no plastic strain is left");
    assert_eq!(flow.0["steps"][2]["plasticity"]["iterations"], 1, "unloading is elastic");
}

/// The same answer on any number of ranks.
#[test]
fn indentation_on_several_ranks() {
    let head = "alternation.tolerance = 1e-11\nplasticity.tolerance = 1e-11\nstep = [{ steps = 4 }, { supports = 0.3 }]";
    let [one, two, four] = [1, 2, 4].map(|ranks| solve_within(&indentation(0.25, head), ranks, &[], 10.0).0);
    assert!(value(&one, "plasticity.max_plastic_strain") > 1e-3);
    for (other, ranks) in [(two, 2), (four, 4)] {
        assert_agree(&one, &other, 1e-8, &format!("{ranks} ranks"));
        for key in
            ["max_plastic_strain", "plastic_fraction", "bodies.upper.work", "bodies.lower.plastic_volume"]
        {
            let exact = value(&one, &format!("plasticity.{key}"));
            near(value(&other, &format!("plasticity.{key}")), exact, 1e-8 * exact, key);
        }
    }
}

/// Pressed, rubbed to and fro and taken off: work of loads is elastic energy, friction and plastic work.
#[test]
fn energies_with_friction_and_yielding() {
    let head = "step = [{ paths = { press = 1 }, steps = 4 }, { paths = { shear = 1 }, steps = 4 }, \
                { paths = { shear = -1 }, steps = 5 }, { paths = { press = 0 } }]";
    let supports = [
        "{ surface = \"flat\", y = -4e-5, path = \"press\" }, { surface = \"flat\", x = 8e-6, path = \"shear\" }",
        "{ surface = \"flat\", y = 0, x = 0 }",
    ];
    let (summary, _) = solve_within(&discs(0.25, head, ", friction = 0.2", supports), 2, &[], 10.0);
    let mut before = [0.0; 2];
    for step in summary["steps"].as_array().expect("steps") {
        let energy = &step["energy"];
        assert!(value(energy, "imbalance") < 1e-6, "{energy}");
        let now = [value(energy, "dissipated"), value(energy, "plastic")];
        let gone = value(energy, "external") - value(energy, "stored") - now[0] - now[1];
        near(gone, 0.0, 1e-6 * value(energy, "external"), "balance");
        assert!(now[0] >= before[0] && now[1] >= (1.0 - 1e-12) * before[1], "{energy}");
        before = now;
    }
    assert!(before[0] > 0.02 && before[1] > 1.0, "{before:?}");
    let slipped = |i: usize| value(&summary, &format!("steps.{i}.pairs.c.friction.slipping"));
    assert!(slipped(1) > 0.0 && slipped(2) > 0.0);
}

/// Heated unevenly, loaded, cooled: with what heat changes of the energy.
#[test]
fn energies_with_heat_and_yielding() {
    let rest = "temperature = \"293 + 300*(1 - x/0.1)^2\"\n\
                support = [{ surface = \"left\", x = 0 }, { surface = \"bottom\", y = 0 }, { surface = \"right\", x = 0 }]\n\
                load = [{ surface = \"top\", pressure = \"2e8*x/0.1\" }]";
    let body = rectangle("b", "m", "quad8", (0.0, 0.1, 10), (0.0, 0.06, 6), rest);
    let material = "young = 2e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 293, \
                    plasticity = { yield_stress = { temperature = [293, 893], value = [250e6, 200e6] }, hardening = 2e9 }";
    let steps = "{ loads = 0, steps = 8 }, { steps = 3 }, { temperature = 0, loads = 0.2, steps = 4 }";
    let (summary, _) =
        solve_within(&super::plasticity::case("strain", material, steps, "", &body), 2, &[], 10.0);
    for step in summary["steps"].as_array().expect("steps") {
        let energy = &step["energy"];
        assert!(value(energy, "imbalance") < 1e-6, "{energy}");
        let sum = value(energy, "external") + value(energy, "heat");
        let gone = sum - value(energy, "stored") - value(energy, "plastic");
        near(gone, 0.0, 1e-6 * value(energy, "heat"), "balance");
    }
    assert!(value(&summary, "energy.plastic") > 1000.0);
}
