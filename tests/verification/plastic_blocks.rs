//! Blocks that yield: patches of distorted cells, hour-glassing, and the limit load of a punch.
use super::plasticity::{FREE_OF_LOCKING, KINDS, case};
use super::{attempt, near, rectangle, solve_within, start, value};
use kontakt::output::{RESULT, Results};
use kontakt::vector::{larger, smaller};
use serde_json::Value;
use std::collections::HashMap;
use std::fmt::Write;

/// A rectangle of 5 x 4 cells, or of twice as many triangles, whose nodes inside are moved by up to 0.3 of a cell, as a Gmsh file.
fn distorted(kind: &str, size: [f64; 2]) -> String {
    const CELLS: [usize; 2] = [5, 4];
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / (1_u64 << 31) as f64
    };
    let mut corners = Vec::new();
    for j in 0..=CELLS[1] {
        for i in 0..=CELLS[0] {
            let inside = i % CELLS[0] != 0 && j % CELLS[1] != 0;
            let at = |i: usize, c: usize, by: f64| {
                (i as f64 + if inside { 0.6 * (by - 0.5) } else { 0.0 }) * size[c] / CELLS[c] as f64
            };
            corners.push([at(i, 0, random()), at(j, 1, random())]);
        }
    }
    let corner = |i: usize, j: usize| j * (CELLS[0] + 1) + i;
    let is_quadratic = ["tri6", "quad8"].contains(&kind);
    let (mut nodes, mut middles) = (corners.clone(), HashMap::new());
    let mut with_middles = |of: &[usize], sides: usize| {
        let mut all = of.to_vec();
        for k in 0..if is_quadratic { sides } else { 0 } {
            let (a, b) = (of[k], of[(k + 1) % of.len()]);
            all.push(*middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                nodes.push([0, 1].map(|c| 0.5 * (corners[a][c] + corners[b][c])));
                nodes.len() - 1
            }));
        }
        all
    };
    let mut elements = Vec::new();
    let of_kind = HashMap::from([("tri3", 2), ("quad4", 3), ("tri6", 9), ("quad8", 16)])[kind];
    for j in 0..CELLS[1] {
        for i in 0..CELLS[0] {
            let c = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            let cells: Vec<Vec<usize>> = match (kind.starts_with("quad"), (i + j) % 2) {
                (true, _) => vec![c.to_vec()],
                (_, 0) => vec![vec![c[0], c[1], c[2]], vec![c[0], c[2], c[3]]],
                _ => vec![vec![c[0], c[1], c[3]], vec![c[1], c[2], c[3]]],
            };
            elements.extend(cells.iter().map(|cell| (of_kind, 3, with_middles(cell, cell.len()))));
        }
    }
    for j in 0..CELLS[1] {
        for (group, i) in [(1, 0), (2, CELLS[0])] {
            elements.push((
                if is_quadratic { 8 } else { 1 },
                group,
                with_middles(&[corner(i, j), corner(i, j + 1)], 1),
            ));
        }
    }
    let mut text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n1 1 \"left\"\n1 2 \"right\"\n2 3 \"b\"\n$EndPhysicalNames\n$Nodes\n{}\n",
        nodes.len()
    );
    for (i, [x, y]) in nodes.iter().enumerate() {
        writeln!(text, "{} {x:e} {y:e} 0", i + 1).expect("a string");
    }
    writeln!(text, "$EndNodes\n$Elements\n{}", elements.len()).expect("a string");
    for (i, (kind, group, of)) in elements.iter().enumerate() {
        let of: Vec<String> = of.iter().map(|n| (n + 1).to_string()).collect();
        writeln!(text, "{} {kind} 2 {group} {group} {}", i + 1, of.join(" ")).expect("a string");
    }
    text + "$EndElements\n"
}

/// By how much the components of the stresses differ over the nodes.
fn spread(results: &Results) -> f64 {
    let field = results.piece.point_fields.iter().find(|f| f.name == "stress").expect("stresses");
    (0..6).fold(0.0, |most, c| {
        let of = || field.values.iter().skip(c).step_by(6).copied();
        larger(most, of().fold(f64::MIN, larger) - of().fold(f64::MAX, smaller))
    })
}

/// Distorted cells in uniform tension, by a load and by a motion, beyond yield and back: the stress stays uniform.
#[test]
fn patches_of_distorted_cells() {
    for (analysis, kinds) in [("stress", &KINDS[..]), ("strain", &FREE_OF_LOCKING)] {
        for kind in kinds {
            for (drive, hardening) in [("load", 2e9), ("motion", 2e9), ("motion", 0.0)] {
                // A bar of enhanced quad4 without hardening bends without stiffness: there is no equilibrium to find.
                if (*kind, hardening) == ("quad4", 0.0) {
                    continue;
                }
                let what = format!("{kind}, plane {analysis}, {drive}, {hardening}");
                let (pull, load) = match drive {
                    "load" => ("", "load = [{ surface = \"right\", traction = [320e6, 0] }]"),
                    _ => (", { surface = \"right\", x = 4e-3 }", ""),
                };
                let body = format!(
                    "[[body]]\nname = \"b\"\nmaterial = \"m\"\nmesh = {{ file = \"mesh.msh\", group = \"b\" }}\n\
                     support = [{{ surface = \"left\", x = 0 }}, {{ point = [0, 0], y = 0 }}{pull}]\n{load}"
                );
                let material = format!(
                    "young = 2e11, poisson = 0.3, plasticity = {{ yield_stress = 250e6, hardening = {hardening} }}"
                );
                for steps in ["{ steps = 3 }", "{ steps = 3 }, { loads = 0.2, supports = 0.2 }"] {
                    let directory = tempfile::tempdir().expect("a temporary directory");
                    let mesh = distorted(kind, [0.1, 0.06]);
                    std::fs::write(directory.path().join("mesh.msh"), mesh).expect("the mesh is written");
                    let text = case(analysis, &material, steps, "", &body);
                    let (code, log) = start(&text, 1, &[], directory.path());
                    assert_eq!(code, Some(0), "{what}: {log}");
                    let out = directory.path().join("out");
                    let results = Results::read(&out.join(RESULT)).expect("the file reads");
                    assert!(spread(&results) <= 1e-8 * 250e6, "{what}: {:e}", spread(&results));
                    if (analysis, drive) == ("stress", "load") {
                        let plastic = value(&super::summary(&out), "plasticity.max_plastic_strain");
                        near(plastic, 0.035, 1e-10, &what);
                    }
                }
            }
        }
    }
}

/// A block 0.1 x 0.1 m in plane strain pressed together by a tenth, between smooth plates or held ones.
fn pressed(element: &str, cells: usize, held: bool) -> (Value, Results) {
    let supports = match held {
        true => "{ surface = \"top\", x = 0, y = -0.01 }, { surface = \"bottom\", x = 0, y = 0 }",
        false => {
            "{ surface = \"top\", y = -0.01 }, { surface = \"bottom\", y = 0 }, { surface = \"left\", x = 0 }"
        }
    };
    let rest = format!("support = [{supports}]");
    let body = rectangle("b", "m", element, (0.0, 0.1, cells), (0.0, 0.1, cells), &rest);
    let material = "young = 2.1e11, poisson = 0.3, plasticity = { yield_stress = 240e6, hardening = 2e9 }";
    let steps = "{ supports = 0.98, steps = 20 }, {}";
    solve_within(&case("strain", material, steps, "", &body), 1, &[], 10.0)
}

/// No hour-glassing: the state stays uniform where it can, and the force between held plates is that of other elements.
#[test]
fn pressed_blocks_keep_their_shape() {
    for element in FREE_OF_LOCKING {
        let (_, results) = pressed(element, 8, false);
        assert!(spread(&results) <= 1e-8 * 240e6, "{element}: {:e}", spread(&results));
    }
    let force = |element: &str, cells: usize| {
        let (summary, _) = pressed(element, cells, true);
        let work = |i: usize| value(&summary, &format!("steps.{i}.energy.external"));
        (work(1) - work(0)) / (0.02 * 0.01)
    };
    let reference = force("quad8", 24);
    for (element, cells, allowed) in
        [("quad8", 12, 0.01), ("quad4", 12, 0.02), ("quad4", 24, 0.01), ("tri6", 12, 0.01)]
    {
        near(force(element, cells), reference, allowed * reference, &format!("{element} {cells}"));
    }
}

/// Half width of the punch, m, and yield stress, Pa.
const PUNCH: (f64, f64) = (0.1, 240e6);

/// Half a block under a punch, `cells` of it along the half width; `on` acts on the strip under the punch.
fn under_punch(element: &str, cells: usize, steps: &str, top: &str, on: [&str; 2]) -> String {
    let h = PUNCH.0 / cells as f64;
    let grading = |at: [f64; 4], size: [f64; 4]| {
        let list = |v: [f64; 4], by: f64| v.map(|v| format!("{:e}", v * by)).join(", ");
        format!("{{ at = [{}], size = [{}] }}", list(at, PUNCH.0), list(size, h))
    };
    let strip = "surface = \"top\", within = { x = [-1, 0.1001] }";
    let [support, load] = on.map(|text| text.replace("STRIP", strip));
    let body = format!(
        "[[body]]\nname = \"b\"\nmaterial = \"m\"\nelement = \"{element}\"\nmesh.rectangle.x = {}\nmesh.rectangle.y = {}\n\
         support = [{support}{{ surface = \"left\", x = 0 }}, {{ surface = \"right\", x = 0 }}, {{ surface = \"bottom\", y = 0 }}]\n{load}\n",
        grading([0.0, 1.0, 1.6, 5.0], [1.0, 1.0, 2.0, 8.0]),
        grading([-4.0, -1.2, -0.3, 0.0], [8.0, 2.0, 1.3, 1.0])
    );
    let material = format!("young = 2.1e11, poisson = 0.3, plasticity = {{ yield_stress = {} }}", PUNCH.1);
    case("strain", &material, steps, top, &body)
}

/// V08-6: (2 + pi) k by Prandtl and Hill; of a smooth punch pushed in, and of a pressure on a strip, beyond which there is no equilibrium.
#[test]
fn the_limit_load_of_a_punch() {
    let exact = (2.0 + std::f64::consts::PI) / 3.0_f64.sqrt();
    for (element, cells) in [("tri6", 12), ("quad8", 12), ("quad4", 18)] {
        let steps = "{ supports = 0.5, steps = 10 }, { supports = 0.95, steps = 5 }, {}";
        let pushed = ["{ STRIP, y = -5e-3 }, ", ""];
        let (summary, _) = solve_within(&under_punch(element, cells, steps, "", pushed), 1, &[], 10.0);
        let work = |i: usize| value(&summary, &format!("steps.{i}.energy.external"));
        let mean = |i: usize, travel: f64| (work(i + 1) - work(i)) / (travel * 5e-3) / PUNCH.0 / PUNCH.1;
        let (before, limit) = (mean(0, 0.45), mean(1, 0.05));
        near(limit, exact, 0.02 * exact, element);
        near(before, limit, 5e-3 * limit, &format!("{element}: a limit"));
        let load = format!("load = [{{ STRIP, pressure = {} }}]", 1.05 * exact * PUNCH.1);
        let (summary, log) = attempt(&under_punch(element, 12, "{ steps = 8 }", "", ["", &load]), 3);
        let summary = summary.expect("a summary");
        assert_eq!(summary["reason"], "no_equilibrium", "{element}: {log}");
        let held = 1.05 * exact * value(&summary, "steps.0.loads");
        near(held, exact, 0.01 * exact, &format!("{element}: pressure on a strip"));
    }
}

/// A stiff punch under a load, held by contact alone: what ends it is not a missing support but the block, at the limit load of the same
/// punch pushed in.
#[test]
fn a_punch_under_a_load_sinks_in() {
    // The force on reduced quad8 goes on growing a little, by 0.1 % from here to three times as deep.
    for (element, depth, allowed) in [("tri6", 8e-3, 1.5e-3), ("quad4", 8e-3, 1.5e-3), ("quad8", 3e-2, 4e-3)]
    {
        let push = format!("{{ STRIP, y = -{depth} }}, ");
        let pushed = [&push[..], ""];
        let steps = "{ supports = 0.95, steps = 20 }, {}";
        let (summary, _) = solve_within(&under_punch(element, 6, steps, "", pushed), 1, &[], 10.0);
        let work = |i: usize| value(&summary, &format!("steps.{i}.energy.external"));
        let limit = (work(1) - work(0)) / (0.05 * depth) / PUNCH.0;
        let punch = format!(
            "support = [{{ surface = \"left\", x = 0 }}]\nload = [{{ surface = \"top\", pressure = {:e} }}]\n\
             [[contact]]\nsurfaces = [\"punch.bottom\", \"b.top\"]\n",
            1.04 * limit
        );
        let punch = rectangle("punch", "hard", element, (0.0, PUNCH.0, 6), (0.0, 0.05, 3), &punch);
        let top = "material.hard = { young = 2.1e15, poisson = 0 }";
        let text = under_punch(element, 6, "{ steps = 8 }", top, ["", ""]) + &punch;
        let (summary, log) = attempt(&text, 3);
        let summary = summary.expect("a summary");
        assert_eq!(summary["reason"], "no_equilibrium", "{element}: {log}");
        near(1.04 * value(&summary, "steps.0.loads"), 1.0, allowed, element);
    }
}
