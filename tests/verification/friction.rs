//! Friction: partial slip, blocks, wedges, belts and fits with known answers, and the laws' own conditions.
use super::{attempt, close, multipliers, near, solve, solve_all, value};
use kontakt::{
    output::Results,
    record::{IN_CONTACT, SLIPS, SideTable},
    vector::{largest, worst},
};
use serde_json::Value;
use std::{f64::consts::PI, fmt::Write as _};

pub(super) const STEEL: &str =
    "alternation.tolerance = 1e-10\nmaterial.steel = { young = 2.1e11, poisson = 0.3 }\n";

/// Half-width and radius of the two equal discs that are pressed together by 1 MN/m.
pub(super) const A: f64 = 5.252317e-4;
pub(super) const RADIUS: f64 = 0.05;

/// Two half discs pressed together, then sheared by the shares `loads` of mu P; `cells` along the half-width.
pub(super) fn discs(friction: f64, cells: f64, surfaces: &str, loads: &[f64]) -> String {
    let (angle, depth) = (A / RADIUS / cells * 180.0 / PI, A / RADIUS / cells);
    let body = |name: &str, side: f64, arc: &str, rest: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\n\
             mesh.half_disc = {{ center = [0, {y}], radius = {RADIUS}, arc = \"{arc}\", \
             angle = {{ at = [-45, -1.0, 0, 1.0, 45], size = [6, {angle}, {angle}, {angle}, 6] }}, \
             depth = {{ at = [0, 0.02, 0.6], size = [{depth}, {depth}, 0.1] }}, core = 4 }}\n\
             support = [{{ surface = \"flat\", y = {close} }}{rest}]\n\
             load = [{{ surface = \"flat\", traction = [{traction}, 0] }}]\n",
            y = side * RADIUS,
            close = -side * 1.501341e-5,
            traction = side * friction * 1e6 / (2.0 * RADIUS),
        )
    };
    let mut text = format!(
        "analysis = \"plane strain\"\n{STEEL}{}{}[[contact]]\nname = \"pair\"\nsurfaces = [{surfaces}]\nfriction = {friction}\n",
        body("upper", 1.0, "down", ""),
        body("lower", -1.0, "up", ", { point = [0, -0.05], x = 0 }"),
    );
    for load in loads {
        let _ = writeln!(text, "[[step]]\nloads = {load}");
    }
    text
}

pub(super) const A_OVER_B: &str = "\"upper.arc\", \"lower.arc\"";

/// Tangential traction of Cattaneo and Mindlin at x / a over mu p0, of the share Q / (mu P).
fn cattaneo(x: f64, share: f64) -> f64 {
    let c = (1.0 - share).sqrt();
    let root = |v: f64| if v > 0.0 { v.sqrt() } else { 0.0 };
    root(1.0 - x * x) - if c > 0.0 { c * root(1.0 - (x / c).powi(2)) } else { 0.0 }
}

/// The same after shearing to `first` and back to `share`.
pub(super) fn reversed(x: f64, first: f64, share: f64) -> f64 {
    cattaneo(x, first) - 2.0 * cattaneo(x, 0.5 * (first - share))
}

/// Tractions over mu p0 at the nodes in contact, by x / a, the sense of the shear positive.
pub(super) fn tractions(table: &SideTable, friction: f64) -> Vec<(f64, f64)> {
    let peak = worst(table.pressure.iter().copied());
    let along = table.tangential.as_ref().expect("a pair with a law");
    let sign = table.normal[0][1].signum();
    (0..table.s.len())
        .filter(|&i| table.touches(i))
        .map(|i| (table.x[i][0] / A, -sign * along.traction[i] / (friction * peak)))
        .collect()
}

/// Relative in L2, of equal cells.
fn distance(found: &[(f64, f64)], exact: impl Fn(f64) -> f64) -> f64 {
    let square = |v: f64| v * v;
    let error: f64 = found.iter().map(|&(x, q)| square(q - exact(x))).sum();
    (error / found.iter().map(|&(x, _)| square(exact(x))).sum::<f64>()).sqrt()
}

#[test]
fn partial_slip_is_cattaneo_and_mindlins() {
    for surfaces in [A_OVER_B, "\"lower.arc\", \"upper.arc\""] {
        for share in [0.25, 0.5, 0.9] {
            let cells = 40.0;
            let (summary, results) = solve_all(&discs(0.3, cells, surfaces, &[0.0, share]), 2, &[]);
            let table = multipliers(&results, 0);
            let found = tractions(table, 0.3);
            let what = format!("{surfaces} {share}");
            let error = distance(&found, |x| cattaneo(x, share));
            // A slip zone of five cells is drawn by five values.
            let allowed = if share < 0.5 { 0.015 } else { 0.01 };
            assert!(error < allowed, "{what}: off by {error:e} in L2");
            let middle = found.iter().min_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).expect("nodes").1;
            near(middle, cattaneo(0.0, share), 0.005 * cattaneo(0.0, share), &what);
            let stuck = (0..table.s.len()).filter(|&i| table.status[i] == IN_CONTACT);
            let half_width = worst(stuck.map(|i| table.x[i][0].abs() / A));
            near(half_width, (1.0 - share).sqrt(), 1.0 / cells, &what);
            // No oscillation: the curvature of q changes its sign at the edge of stick only, on either side.
            let outside: Vec<f64> =
                found.iter().filter(|(x, _)| *x > 0.0 && *x < half_width).map(|f| f.1).collect();
            assert!(outside.windows(3).all(|q| q[0] - 2.0 * q[1] + q[2] > 0.0), "{what}: {outside:?}");
            // The cone, to round-off.
            let along = &table.tangential.as_ref().expect("a law").traction;
            let peak = worst(table.pressure.iter().copied());
            let beyond = |i: usize| along[i].abs() - 0.3 * table.pressure[i].max(0.0);
            assert!((0..table.s.len()).all(|i| beyond(i) <= 1e-10 * peak), "{what}");
            for step in summary["steps"].as_array().expect("steps") {
                assert!(step["updates"].as_u64().is_some_and(|n| n <= 8), "{what}: {step}");
            }
            near(value(&summary, "pairs.pair.friction.force").abs(), share * 3e5, 1e-6 * 3e5, &what);
        }
    }
}

#[test]
fn shear_that_turns_back_leaves_tractions_behind() {
    let path = [0.0, 0.6, 0.2, 0.0, -0.2, -0.6];
    for last in 2..path.len() {
        let (_, results) = solve_all(&discs(0.3, 40.0, A_OVER_B, &path[..=last]), 1, &[]);
        let found = tractions(multipliers(&results, 0), 0.3);
        let size = worst(found.iter().map(|f| f.1.abs()));
        let error = found.iter().map(|&(x, q)| (q - reversed(x, 0.6, path[last])).powi(2)).sum::<f64>();
        let error = (error / found.len() as f64).sqrt();
        assert!(error < 0.012 * size, "{}: {error:e} of {size}", path[last]);
    }
}

/// Pressed and sheared together from nought nothing slips, and q = (Q / P) p (Mindlin and Deresiewicz, J. Appl. Mech. 20 (1953) 327); one
/// increment, which knows only its end, takes it for pressed first. It says so, and `auto` divides it.
#[test]
fn oblique_loads_depend_on_their_increments() {
    let of = |steps: &str| -> (Value, f64) {
        let text =
            discs(0.3, 40.0, A_OVER_B, &[0.5]).replace("[[step]]\n", &format!("[[step]]\nsteps = {steps}\n"));
        let (summary, results) = solve_all(&text, 1, &[]);
        let table = multipliers(&results, 0);
        let traction = &table.tangential.as_ref().expect("a law").traction;
        let pairs = || std::iter::zip(traction, &table.pressure);
        let error: f64 = pairs().map(|(q, p)| (q.abs() - 0.15 * p).powi(2)).sum();
        (summary, (error / pairs().map(|(_, p)| (0.15 * p).powi(2)).sum::<f64>()).sqrt())
    };
    let warned = |summary: &Value| summary["warnings"].to_string().contains("dividing an increment");
    let (one, far) = of("1");
    assert!(warned(&one) && far > 0.3, "{far}");
    let (auto, near_enough) = of("\"auto\"");
    assert!(near_enough < 0.08, "{near_enough} in {} increments", auto["steps"][0]["increments"]);
    // Pressed first, nothing depends on increments.
    assert!(!warned(&solve(&discs(0.3, 20.0, A_OVER_B, &[0.0, 0.5]))));
}

#[test]
fn cycles_of_shear_close_and_dissipate_alike() {
    let mut path = vec![0.0, 0.6];
    (0..6).for_each(|_| path.extend([-0.6, 0.6]));
    let (summary, _) = solve_all(&discs(0.3, 20.0, A_OVER_B, &path), 1, &[]);
    let steps = summary["steps"].as_array().expect("steps");
    let lost: Vec<f64> =
        steps.iter().map(|s| s["pairs"][0]["friction"]["dissipated"].as_f64().expect("a number")).collect();
    let cycles: Vec<f64> = lost[1..].windows(3).step_by(2).map(|w| w[2] - w[0]).collect();
    assert!(cycles[0] > 0.0);
    for cycle in &cycles {
        near(*cycle, cycles[0], 1e-9 * cycles[0], "dissipation of a cycle");
    }
    // From one turn to the other the same nodes slip twice as far as at first (Masing), at the same bound.
    let (first, turned) = (lost[1], lost[2] - lost[1]);
    near(turned, 2.0 * first, 2e-3 * first, "dissipation from one turn to the other");
}

#[test]
fn friction_nought_is_frictionless_to_the_bit() {
    let text = discs(0.3, 10.0, A_OVER_B, &[0.0]);
    let without = text.replace("friction = 0.3\n", "");
    let nought = text.replace("friction = 0.3\n", "friction = 0\n");
    let forces = |text: &str| {
        let (_, results) = solve_all(text, 1, &[]);
        multipliers(&results, 0).force.clone()
    };
    assert_eq!(forces(&without), forces(&nought));
}

/// A plate on a rigid floor, pressed from above and from the left, held on the right: open, slipping and sticking together.
pub(super) fn plate(friction: f64, cells: usize, element: &str) -> String {
    let mut text = format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-10\nmaterial.m = {{ young = 1.3e11, poisson = 0.2 }}\n\
         [[body]]\nname = \"plate\"\nmaterial = \"m\"\nelement = \"{element}\"\n\
         mesh.rectangle = {{ x = {{ from = 0, to = 0.04, cells = {cells} }}, y = {{ from = 0, to = 0.04, cells = {cells} }} }}\n\
         support = [{{ surface = \"right\", x = 0 }}]\n\
         load = [{{ surface = \"top\", pressure = 5e7 }}, {{ surface = \"left\", pressure = 15e7 }}]\n\
         [[body]]\nname = \"floor\"\nrigid = {{ plane = {{ through = [0, 0], normal = [0, 1] }} }}\n\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"plate.bottom\", \"floor.surface\"]\nfriction = {friction}\n"
    );
    for (i, x) in [0.0, 1.25e-3, 5e-3, 7.5e-3, 11.25e-3, 20e-3].iter().enumerate() {
        let _ = writeln!(text, "[[probe]]\nname = \"p{i}\"\nbody = \"plate\"\nat = [{x}, 0]");
    }
    text
}

/// Displacements along the floor, um, of Code_Aster's SSNV128 at other coefficients as well; two discretisations on three meshes
/// agree to the digits given. The corner is singular.
#[test]
fn a_plate_that_opens_slips_and_sticks() {
    let known: [(f64, [f64; 6], f64); 6] = [
        (0.3, [35.21, 33.845, 29.901, 27.353, 23.621, 15.301], f64::NAN),
        (0.6, [31.65, 30.27, 25.99, 23.24, 19.287, 10.886], 1.0830e6),
        (1.0, [28.603, 27.225, 22.868, 19.807, 15.414, 6.457], 1.40534e6),
        (1.5, [26.56, 25.18, 20.98, 17.67, 12.77, 3.06], 1.5559e6),
        (2.0, [25.49, 24.11, 19.95, 16.66, 11.37, 1.08], 1.616e6),
        (3.0, [24.49, 23.11, 18.97, 15.80, 10.03, 0.0], 1.662e6),
    ];
    for cells in [32, 64] {
        for (friction, along, force) in &known {
            let summary = solve(&plate(*friction, cells, "quad4"));
            let what = format!("mu = {friction}, {cells} cells");
            for (i, expected) in along.iter().enumerate() {
                let u = 1e6 * summary["probes"][i]["displacement"][0].as_f64().expect("a number");
                let allowed = if cells == 32 { 0.06 } else { 0.02 };
                near(u, *expected, allowed, &what);
            }
            if force.is_finite() {
                near(value(&summary, "pairs.pair.friction.force").abs(), *force, 5e-4 * force, &what);
            }
            near(value(&summary, "pairs.pair.normal_force"), 2e6, 1e-6, &what);
            assert!(value(&summary, "updates") <= 16.0, "{what}");
        }
    }
    // No uniqueness is promised here, but what is found satisfies every condition.
    let summary = solve(&plate(10.0, 64, "quad4"));
    assert!(value(&summary, "pairs.pair.friction.beyond_bound") < 1e-10);
    assert!(value(&summary, "pairs.pair.friction.wrong_slip") < 1e-10);
}

/// A block on a rigid floor turned by `angle`, pressed by N = 12 kN and pushed by T.
pub(super) fn block(angle: f64, push: f64, law: &str) -> String {
    let (s, c) = (angle * PI / 180.0).sin_cos();
    let along = |[x, y]: [f64; 2]| [c * x - s * y, s * x + c * y];
    let corner = |x: f64, y: f64| {
        let [x, y] = along([x, y]);
        format!("[{x}, {y}]")
    };
    let [tx, ty] = along([push / 0.02, 0.0]);
    let [nx, ny] = along([0.0, 1.0]);
    format!(
        "analysis = \"plane stress\"\n{STEEL}[[body]]\nname = \"block\"\nmaterial = \"steel\"\n\
         mesh.block = {{ corners = [{}, {}, {}, {}], u = {{ cells = 12 }}, v = {{ cells = 6 }} }}\n\
         load = [{{ surface = \"top\", pressure = {p} }}, {{ surface = \"left\", traction = [{tx}, {ty}] }}]\n\
         [[body]]\nname = \"floor\"\nrigid = {{ plane = {{ through = [0, 0], normal = [{nx}, {ny}] }} }}\n\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"block.bottom\", \"floor.surface\"]\n{law}\n",
        corner(0.0, 0.0),
        corner(0.06, 0.0),
        corner(0.06, 0.02),
        corner(0.0, 0.02),
        p = 12e3 / 0.06,
    )
}

#[test]
fn a_block_slides_at_mu_n() {
    for angle in [0.0, 60.0] {
        for share in [0.5, 0.99, 1.0 - 1e-6] {
            let push = share * 0.3 * 12e3;
            let (summary, results) = solve_all(&block(angle, push, "friction = 0.3"), 2, &[]);
            near(value(&summary, "pairs.pair.friction.force").abs(), push, 1e-6 * push, "tangential force");
            close(&summary, "pairs.pair.normal_force", 12e3, 1e-9);
            let table = multipliers(&results, 0);
            if share == 0.99 {
                assert!(table.status.contains(&IN_CONTACT) && table.status.contains(&SLIPS));
            }
        }
        // Pressed first, then pushed to 1.01 mu N: the load at which it left, to a millionth. The same bound by Tresca's law.
        for law in ["friction = 0.3", "law = \"tresca\"\nshear = 6e4"] {
            let _ = solve(&block(angle, 0.99 * 3.6e3, law));
            let text = block(angle, 1.01 * 3.6e3, law).replace("traction", "path = \"push\", traction")
                + "[[step]]\npaths = { push = 0 }\n[[step]]\npaths = { push = 1 }\n";
            let (kept, log) = attempt(&text, 4);
            assert!(log.contains("body 'block'") && log.contains("translation"), "{log}");
            let told = log.split("path push = ").nth(1).and_then(|rest| rest.split_whitespace().next());
            let share: f64 = told.and_then(|told| told.trim_end_matches(',').parse().ok()).expect("a factor");
            assert!(share <= 1.0 / 1.01 && share > 1.0 / 1.01 - 1e-6, "{share}");
            assert!(kept.is_some_and(|kept| kept["converged"] == false));
        }
        let summary = solve(&block(angle, 9e3, "law = \"rough\""));
        assert_eq!(summary["pairs"][0]["friction"]["slipping"], 0);
    }
}

/// The floor is dragged under a block that is held on the left: when all slips, every further travel is slip, and costs mu N of work.
#[test]
fn what_slides_dissipates_mu_n_times_its_travel() {
    let text = block(0.0, 0.0, "friction = 0.3")
        .replace("load = [", "support = [{ surface = \"left\", x = 0 }]\nload = [")
        .replace("rigid = { plane", "rigid = { x = 1e-3, path = \"drag\", plane")
        + "[[step]]\nname = \"press\"\npaths = { drag = 0 }\n[[step]]\npaths = { drag = 0.5 }\n[[step]]\npaths = { drag = 1 }\n\
           [[step]]\npaths = { drag = 0.2 }\n";
    let summary = solve(&text);
    let of = |step: usize, key: &str| {
        summary["steps"][step]["pairs"][0]["friction"][key].as_f64().expect("a number")
    };
    for (step, sense) in [(1, 1.0), (2, 1.0), (3, -1.0)] {
        // The block is dragged along, and back: action on the block, side A.
        let drag = summary["steps"][step]["pairs"][0]["resultant"][0].as_f64().expect("a number");
        near(drag, sense * 0.3 * 12e3, 1e-6 * 3.6e3, "what drags the block");
        near(of(step, "slip_length"), 0.06, 1e-12, "length that slips");
        assert_eq!((of(step, "stick_length"), of(step, "sticking")), (0.0, 0.0));
    }
    let work = of(2, "dissipated") - of(1, "dissipated");
    near(work, 3.6e3 * 0.5e-3, 1e-9 * work, "work of friction");
    near(of(2, "max_slip") - of(1, "max_slip"), 0.5e-3, 1e-12, "slip");
    // On the way back the block springs back first: a little less slip than the floor's travel.
    let back = of(3, "dissipated") - of(2, "dissipated");
    assert!(back < 3.6e3 * 0.8e-3 && back > 3.6e3 * 0.799e-3, "{back}");
}

/// A block of 40 x 20 by its own weight on a slope.
fn on_slope(angle: f64, friction: f64) -> String {
    let (s, c) = (angle * PI / 180.0).sin_cos();
    format!(
        "analysis = \"plane stress\"\n{STEEL}[[body]]\nname = \"block\"\nmaterial = \"steel\"\n\
         mesh.rectangle = {{ x = {{ from = 0, to = 0.04, cells = 8 }}, y = {{ from = 0, to = 0.02, cells = 4 }} }}\n\
         load = [{{ body_force = [{}, {}] }}]\n\
         [[body]]\nname = \"slope\"\nrigid = {{ plane = {{ through = [0, 0], normal = [0, 1] }} }}\n\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"block.bottom\", \"slope.surface\"]\nfriction = {friction}\n",
        7.7e4 * s,
        -7.7e4 * c
    )
}

#[test]
fn a_block_on_a_slope_sticks_slides_or_tips() {
    let summary = solve(&on_slope(16.69, 0.3));
    let [t, n] = ["friction.force", "normal_force"].map(|k| value(&summary, &format!("pairs.pair.{k}")));
    near(t.abs() / n, (16.69 * PI / 180.0).tan(), 1e-9, "slope");
    assert!(attempt(&on_slope(16.71, 0.3), 4).1.contains("translation"));
    // The resultant leaves the base at tan = 2.
    let _ = solve(&on_slope(63.3, 3.0));
    assert!(attempt(&on_slope(63.6, 3.0), 4).1.contains("rotation"));
}

/// Half of a wedge of half angle `angle` pressed into a V by 2 P, slipping all along its flank.
fn wedge(angle: f64, friction: f64) -> String {
    let (s, c) = (angle * PI / 180.0).sin_cos();
    let (height, bottom) = (0.04, 0.01);
    let top = bottom + height * s / c;
    format!(
        "analysis = \"plane stress\"\n{STEEL}[[body]]\nname = \"wedge\"\nmaterial = \"steel\"\n\
         mesh.block = {{ corners = [[0, 0], [{bottom}, 0], [{top}, {height}], [0, {height}]], u = {{ cells = 6 }}, v = {{ cells = 16 }} }}\n\
         support = [{{ surface = \"left\", x = 0 }}]\nload = [{{ surface = \"top\", pressure = {} }}]\n\
         [[body]]\nname = \"v\"\nrigid = {{ plane = {{ through = [{bottom}, 0], normal = [{}, {s}] }} }}\n\
         [[contact]]\nname = \"flank\"\nsurfaces = [\"wedge.right\", \"v.surface\"]\nfriction = {friction}\n",
        0.5e5 / top,
        -c,
    )
}

#[test]
fn wedges_below_and_above_the_slope_of_the_load_path() {
    for (angle, friction) in [(20.0, 0.2), (30.0, 0.1), (20.0, 0.5), (10.0, 0.3)] {
        let (s, c) = (angle * PI / 180.0_f64).sin_cos();
        let normal = 1e5 / (2.0 * (s + friction * c));
        let summary = solve(&wedge(angle, friction));
        close(&summary, "pairs.flank.normal_force", normal, 1e-6);
        near(
            value(&summary, "pairs.flank.friction.force").abs(),
            friction * normal,
            1e-6 * normal,
            "friction",
        );
    }
}

/// A strip round a quarter of a rigid drum, pulled at one end, held at the other: T2 / T1 = exp(mu pi / 2), Eytelwein.
#[test]
fn a_strip_round_a_quarter_of_a_drum() {
    let (friction, radius, thickness, pull) = (0.2, 0.1, 1e-3, 1e5);
    let text = format!(
        "analysis = \"plane stress\"\n{STEEL}[[body]]\nname = \"strip\"\nmaterial = \"steel\"\nelement = \"quad8\"\n\
         mesh.ring = {{ radius = {{ from = {radius}, to = {}, cells = 2 }}, angle = {{ from = 0, to = 90, cells = 90 }} }}\n\
         support = [{{ surface = \"start\", y = 0 }}]\nload = [{{ surface = \"end\", traction = [{}, 0] }}]\n\
         [[body]]\nname = \"drum\"\nrigid = {{ circle = {{ center = [0, 0], radius = {radius} }} }}\n\
         [[contact]]\nname = \"pair\"\nsurfaces = [\"strip.inner\", \"drum.surface\"]\nfriction = {friction}\n",
        radius + thickness,
        -pull / thickness,
    );
    let summary = solve(&text);
    let friction_force = value(&summary, "pairs.pair.friction.force").abs();
    let ratio = pull / (pull - friction_force);
    near(ratio, (friction * PI / 2.0).exp(), 0.01 * 1.3691, "T2 / T1");
}

/// A shaft of radius 20 mm shrunk into a hub, turned by the share of the torque that mu = 0.1 holds.
fn shaft(share: f64) -> String {
    let interference = 2.5e-6;
    let (p, r) = (6.1523e6, 0.02);
    let torque = share * 0.1 * p * 2.0 * PI * r * r;
    // Of a uniform tangential traction on the bore of 10 mm.
    let q = torque / (2.0 * PI * 0.01 * 0.01);
    let ring = |name: &str, from: f64, to: f64, rest: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\nelement = \"quad8\"\n\
             mesh.ring = {{ radius = {{ from = {from}, to = {to}, cells = 6 }}, angle = {{ from = 0, to = 360, cells = 64 }} }}\n{rest}"
        )
    };
    format!(
        "analysis = \"plane stress\"\n{STEEL}{}{}[[contact]]\nname = \"fit\"\nsurfaces = [\"shaft.outer\", \"hub.inner\"]\nfriction = 0.1\n\
         [[step]]\nname = \"shrink\"\nloads = 0\n[[step]]\nname = \"turn\"\n",
        ring(
            "shaft",
            0.01,
            r + interference,
            &format!(
                "load = [{{ surface = \"inner\", traction = [\"-{q} * y / 0.01\", \"{q} * x / 0.01\"] }}]\n"
            )
        ),
        ring(
            "hub",
            r,
            0.03,
            "support = [{ point = [0.03, 0], y = 0, x = 0 }, { point = [-0.03, 0], y = 0 }]\n"
        ),
    )
}

#[test]
fn a_shrunk_shaft_holds_its_torque_and_no_more() {
    let summary = solve(&shaft(0.98));
    close(&summary, "pairs.fit.normal_force", 6.1523e6 * 2.0 * PI * 0.02, 2e-3);
    let (kept, log) = attempt(&shaft(1.02), 4);
    assert!(log.contains("body 'shaft'") && log.contains("rotation"), "{log}");
    // The share of the load at which it left, to a millionth, and what it carried until then.
    let told = log.split("loads = ").nth(1).and_then(|rest| rest.split(',').next()).expect("a factor");
    let share: f64 = told.parse().expect("a number");
    let carried = value(&summary, "pairs.fit.normal_force") * 0.1 * 0.02;
    let torque = 1.02 * 0.1 * 6.1523e6 * 2.0 * PI * 0.02 * 0.02;
    near(share * torque, carried, 2e-3 * carried, "torque at which it left");
    assert!(kept.is_some_and(|kept| kept["converged"] == false));
}

/// A beam cut along its middle and tied again, and the uncut one, at matching nodes: the same to round-off.
#[test]
fn tied_halves_are_one_body() {
    let halves = |cells: [usize; 2], tie: bool| {
        let body = |name: &str, from: f64, to: f64, rows: usize, cells: usize| {
            format!(
                "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\n\
                 mesh.rectangle = {{ x = {{ from = 0, to = 0.1, cells = {cells} }}, y = {{ from = {from}, to = {to}, cells = {rows} }} }}\n\
                 support = [{{ surface = \"left\", x = 0, y = 0 }}]\nload = [{{ surface = \"right\", traction = [0, 1e6] }}]\n"
            )
        };
        let bodies = match tie {
            true => body("a", 0.0, 0.01, 3, cells[0]) + &body("b", 0.01, 0.02, 3, cells[1]),
            false => body("a", 0.0, 0.02, 6, cells[0]),
        };
        let pair = "[[contact]]\nname = \"seam\"\nsurfaces = [\"a.top\", \"b.bottom\"]\nlaw = \"tied\"\n";
        format!(
            "analysis = \"plane stress\"\n{STEEL}{bodies}{}[[probe]]\nname = \"tip\"\nbody = \"a\"\nat = [0.1, 0]\n",
            if tie { pair } else { "" }
        )
    };
    let tip = |text: &str| -> [f64; 2] {
        let summary = solve(text);
        [0, 1].map(|c| summary["probes"][0]["displacement"][c].as_f64().expect("a number"))
    };
    let whole = tip(&halves([30, 30], false));
    let tied = tip(&halves([30, 30], true));
    for c in [0, 1] {
        near(tied[c], whole[c], 1e-9 * largest(&whole), "tip of tied halves");
    }
    // Where the nodes do not match, to the order of the transfer.
    let other = tip(&halves([30, 47], true));
    near(other[1], whole[1], 2e-3 * whole[1].abs(), "tip of halves that do not match");
}

/// Two strips of metal, bonded and heated: the curvature of a bimetal (Timoshenko), away from the ends.
#[test]
fn a_bonded_bimetal_bends() {
    let text = "analysis = \"plane stress\"\nalternation.tolerance = 1e-10\n\
        material.steel = { young = 2.1e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 293 }\n\
        material.alu = { young = 7e10, poisson = 0.33, expansion = 23e-6, reference_temperature = 293 }\n\
        [[body]]\nname = \"steel\"\nmaterial = \"steel\"\ntemperature = 393\n\
        mesh.rectangle = { x = { from = 0, to = 0.1, cells = 200 }, y = { from = 0, to = 0.002, cells = 4 } }\n\
        support = [{ surface = \"left\", x = 0 }, { point = [0, 0], y = 0 }]\n\
        [[body]]\nname = \"alu\"\nmaterial = \"alu\"\ntemperature = 393\n\
        mesh.rectangle = { x = { from = 0, to = 0.1, cells = 150 }, y = { from = 0.002, to = 0.005, cells = 6 } }\n\
        support = [{ surface = \"left\", x = 0 }]\n\
        [[contact]]\nname = \"bond\"\nsurfaces = [\"steel.top\", \"alu.bottom\"]\nlaw = \"tied\"\n\
        [[probe]]\nname = \"tip\"\nbody = \"steel\"\nat = [0.1, 0]\n";
    let summary = solve(text);
    let tip = summary["probes"][0]["displacement"][1].as_f64().expect("a number");
    near(tip.abs(), 1.641791e-3, 0.01 * 1.641791e-3, "tip of the bimetal");
}

/// Two weights on one slab, each with its own coefficient, dragged over it together.
#[test]
fn each_pair_has_its_own_coefficient() {
    let weight = |name: &str, x: f64, load: f64, pull: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\n\
             mesh.rectangle = {{ x = {{ from = {x}, to = {}, cells = 6 }}, y = {{ from = 0.02, to = 0.03, cells = 3 }} }}\n\
             load = [{{ surface = \"top\", force = [{pull}, -{load}] }}]\n",
            x + 0.02
        )
    };
    let text = |over: f64| {
        format!(
            "analysis = \"plane stress\"\n{STEEL}{}{}[[body]]\nname = \"slab\"\nmaterial = \"steel\"\n\
             mesh.rectangle = {{ x = {{ from = 0, to = 0.08, cells = 20 }}, y = {{ from = 0, to = 0.02, cells = 5 }} }}\n\
             support = [{{ surface = \"bottom\", x = 0, y = 0 }}]\n\
             [[contact]]\nname = \"a\"\nsurfaces = [\"first.bottom\", \"slab.top\"]\nfriction = 0.4\n\
             [[contact]]\nname = \"b\"\nsurfaces = [\"second.bottom\", \"slab.top\"]\nfriction = 0.3\n",
            weight("first", 0.01, 200.0, 0.999 * 80.0),
            weight("second", 0.05, 200.0, over * 60.0)
        )
    };
    let summary = solve(&text(0.999));
    near(value(&summary, "pairs.a.friction.force").abs(), 79.92, 1e-6, "first");
    near(value(&summary, "pairs.b.friction.force").abs(), 59.94, 1e-6, "second");
    // Action and reaction, and the sense of them: the weights are held back.
    for pair in summary["pairs"].as_array().expect("pairs") {
        assert!(pair["resultant"][0].as_f64().expect("a number") < 0.0, "{pair}");
    }
    assert!(attempt(&text(1.001), 4).1.contains("body 'second'"));
}

#[test]
fn ranks_agree_on_partial_slip() {
    let fields = |ranks: usize| -> (Value, Results) {
        solve_all(&discs(0.3, 16.0, A_OVER_B, &[0.0, 0.6]), ranks, &[])
    };
    let (_, one) = fields(1);
    let table = multipliers(&one, 0);
    for ranks in [2, 4] {
        let (_, results) = fields(ranks);
        let other = multipliers(&results, 0);
        let [q, p] = [table, other].map(|t| t.tangential.as_ref().expect("a law").traction.clone());
        let size = largest(&q);
        assert!(std::iter::zip(&q, &p).all(|(a, b)| (a - b).abs() < 1e-8 * size), "{ranks} ranks");
    }
}

/// Two blocks on one floor, one pressed and pushed a hundred thousand million times less than the other: each has the friction that it has
/// alone, for neither knows of the other.
#[test]
fn a_pair_that_carries_next_to_nothing_keeps_its_law() {
    let scaled = |factor: f64| {
        let text = block(0.0, factor * 0.99 * 3.6e3, "friction = 0.3");
        text.replace(
            &format!("pressure = {}", 12e3 / 0.06),
            &format!("pressure = {:e}", factor * 12e3 / 0.06),
        )
    };
    let (large, small) = (scaled(1.0), scaled(1e-11));
    let body = small.find("[[body]]").expect("a body");
    let floor = small.find("[[body]]\nname = \"floor\"").expect("a floor");
    let contact = small.find("[[contact]]").expect("a pair");
    let second = format!("{}{}", &small[body..floor], &small[contact..]);
    let second = second.replace("\"block", "\"light").replace("\"pair\"", "\"light\"");
    let both = solve(&format!("{large}{second}"));
    let alone = solve(&large);
    let of = |summary: &Value, pair: usize, key: &str| {
        summary["pairs"][pair]["friction"][key].as_f64().expect("a number")
    };
    for (pair, factor) in [(0, 1.0), (1, 1e-11)] {
        for (key, power) in
            [("sticking", 0), ("slipping", 0), ("force", 1), ("max_slip", 1), ("dissipated", 2)]
        {
            let expected = of(&alone, 0, key) * f64::powi(factor, power);
            near(of(&both, pair, key), expected, 1e-8 * expected.abs(), key);
        }
    }
}

/// A roller in a groove of two rigid planes at 45 degrees, pressed by P without friction and turned by a couple M. Where it slips on both,
/// statics give N1 + N2 = sqrt(2) P / (1 + mu^2): it holds up to M = mu sqrt(2) P R / (1 + mu^2), and no pressure on its facets more.
#[test]
fn a_roller_holds_the_couple_that_friction_carries() {
    let text = std::fs::read_to_string("cases/hard/roller/case.toml").expect("the case reads");
    let text = text.split("[[variant]]").next().expect("a case");
    let (p, radius) = (1e7, 0.05);
    for mu in [0.01, 0.1, 0.5] {
        let most = mu * 2_f64.sqrt() * p * radius / (1.0 + mu * mu);
        let turned = |share: f64| {
            let force = share * most / (2.0 * radius);
            let couple = format!(
                "load = [{{ point = [0.05, 0], force = [0, {:e}] }}, {{ point = [-0.05, 0], force = [0, {force:e}] }}]",
                -force
            );
            text.replacen(
                "depth = { from = 0, to = 0.5, cells = 8 } }",
                &format!("depth = {{ from = 0, to = 0.5, cells = 8 }} }}\n{couple}"),
                1,
            )
            .replace("name = \"left\"\nsurfaces", &format!("name = \"left\"\nfriction = {mu}\nsurfaces"))
            .replace("name = \"right\"\nsurfaces", &format!("name = \"right\"\nfriction = {mu}\nsurfaces"))
        };
        let summary = solve(&turned(0.998));
        let carried =
            ["left", "right"].map(|pair| value(&summary, &format!("pairs.{pair}.friction.force")).abs());
        near((carried[0] + carried[1]) * radius, 0.998 * most, 1e-3 * most, "couple");
        let log = attempt(&turned(1.002), 4).1;
        assert!(log.contains("'roller'") && log.contains("rotation"), "{log}");
    }
}
