//! Contact patch test: uniform pressure through a flat interface of meshes that need not match, to round-off.
mod common;

use common::inside::{Runner, point_bodies, point_field, sides};
use kontakt::vector::larger;
use kontakt::{case::Case, output::Results};

/// Width, and heights of the lower and the upper block, m.
const SIZE: [f64; 3] = [0.04, 0.02, 0.03];

/// Pressure, Pa.
const PRESSURE: f64 = 1e8;

/// Of the alternation.
const TOLERANCE: f64 = 1e-14;

/// Young's moduli and Poisson's ratios of the lower and the upper block.
#[derive(Clone, Copy)]
struct Row {
    name: &'static str,
    plane_strain: bool,
    young: [f64; 2],
    poisson: [f64; 2],
    /// u2 of the interface and of the top, m.
    settles: [f64; 2],
}

const ROWS: [Row; 6] = [
    Row {
        name: "ps same",
        plane_strain: false,
        young: [2e11, 2e11],
        poisson: [0.3, 0.3],
        settles: [-1e-5, -2.5e-5],
    },
    Row {
        name: "ps diff",
        plane_strain: false,
        young: [2e11, 7e10],
        poisson: [0.3, 0.33],
        settles: [-1e-5, -5.285_714_285_714_286e-5],
    },
    Row {
        name: "ps soft",
        plane_strain: false,
        young: [2e11, 2e5],
        poisson: [0.3, 0.4999],
        settles: [-1e-5, -15.00001],
    },
    Row {
        name: "pe same",
        plane_strain: true,
        young: [2e11, 2e11],
        poisson: [0.3, 0.3],
        settles: [-9.1e-6, -2.275e-5],
    },
    Row {
        name: "pe diff",
        plane_strain: true,
        young: [2e11, 7e10],
        poisson: [0.3, 0.33],
        settles: [-9.1e-6, -4.729e-5],
    },
    Row {
        name: "pe stiff",
        plane_strain: true,
        young: [2e11, 2e17],
        poisson: [0.3, 0.0],
        settles: [-9.1e-6, -9.100015e-6],
    },
];

impl Row {
    /// Strains along and across the uniaxial pressure over the pressure, 1/Pa: both negative parts of Hooke's law.
    fn compliance(&self, body: usize) -> [f64; 2] {
        let (e, nu) = (self.young[body], self.poisson[body]);
        if self.plane_strain { [(1.0 - nu * nu) / e, nu * (1.0 + nu) / e] } else { [1.0 / e, nu / e] }
    }
}

/// Cells along and up, and element kind, of each block.
#[derive(Clone, Copy, Debug)]
struct Meshes {
    cells: [[usize; 2]; 2],
    elements: [&'static str; 2],
}

const TABLE: [[usize; 2]; 2] = [[5, 3], [7, 4]];

fn heading(row: &Row) -> String {
    let analysis = if row.plane_strain { "plane strain" } else { "plane stress" };
    let material = |body: usize, name: &str| {
        format!("material.{name} = {{ young = {:e}, poisson = {} }}\n", row.young[body], row.poisson[body])
    };
    format!(
        "analysis = \"{analysis}\"\noutput.window = [[0, 0], [0.04, 0.05]]\n{}{}\
         alternation.tolerance = {TOLERANCE:e}\n\
         contact = [{{ name = \"i\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n",
        material(0, "lower"),
        material(1, "upper")
    )
}

/// Two rectangles under pressure from above; the upper one is held by contact alone, but for one node along x.
fn rectangles(row: &Row, meshes: &Meshes) -> String {
    let [w, h1, h2] = SIZE;
    let body = |i: usize, name: &str, y: [f64; 2], held: &str| {
        let ([nx, ny], element) = (meshes.cells[i], meshes.elements[i]);
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"{name}\"\nelement = \"{element}\"\n\
             mesh.rectangle.x = {{ from = 0, to = {w}, cells = {nx} }}\n\
             mesh.rectangle.y = {{ from = {}, to = {}, cells = {ny} }}\n{held}\n",
            y[0], y[1]
        )
    };
    let lower = "support = [{ surface = \"bottom\", y = 0 }, { point = [0, 0], x = 0 }]";
    let upper = format!(
        "support = [{{ point = [0, {}], x = 0 }}]\nload = [{{ surface = \"top\", pressure = {PRESSURE} }}]",
        h1 + h2
    );
    heading(row) + &body(0, "lower", [0.0, h1], lower) + &body(1, "upper", [h1, h1 + h2], &upper)
}

/// Two trapezia that meet in an inclined line, under pressure from all sides: they shrink and slide on each other.
fn trapezia(row: &Row, meshes: &Meshes) -> String {
    let body = |i: usize, name: &str, corners: &str, rest: &str| {
        let ([nx, ny], element) = (meshes.cells[i], meshes.elements[i]);
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"{name}\"\nelement = \"{element}\"\nmesh.block = {{ corners = {corners}, \
             u = {{ cells = {nx} }}, v = {{ cells = {ny} }} }}\n{rest}\n"
        )
    };
    let load = |surfaces: [&str; 3]| {
        let loads = surfaces.map(|s| format!("{{ surface = \"{s}\", pressure = {PRESSURE} }}"));
        format!("load = [{}]", loads.join(", "))
    };
    let lower = "support = [{ point = [0, 0], x = 0, y = 0 }, { point = [0.04, 0], y = 0 }]\n".to_owned()
        + &load(["left", "right", "bottom"]);
    // Held along the interface at its left end.
    let angle = (0.015_f64 / 0.04).atan().to_degrees();
    let upper = format!(
        "support = [{{ point = [0, 0.015], x = 0, angle = {angle:.17} }}]\n{}",
        load(["left", "right", "top"])
    );
    heading(row)
        + &body(0, "lower", "[[0, 0], [0.04, 0], [0.04, 0.03], [0, 0.015]]", &lower)
        + &body(1, "upper", "[[0, 0.015], [0.04, 0.03], [0.04, 0.05], [0, 0.05]]", &upper)
}

/// What a node or an element may be off by, over the pressure: the round-off of the displacements times the body's own
/// stiffness, and that of the coordinates of surfaces that do not lie along an axis, which makes gaps, times the
/// stiffness of both bodies in series.
fn round_off(row: &Row, meshes: &Meshes, body: usize, largest: f64) -> f64 {
    let [w, h1, h2] = SIZE;
    let [nx, ny] = meshes.cells[body];
    // Distance of the nodes.
    let quadratic = matches!(meshes.elements[body], "tri6" | "quad8");
    let h = (w / nx as f64).min([h1, h2][body] / ny as f64) / if quadratic { 2.0 } else { 1.0 };
    let series = 1.0 / row.young.iter().map(|e| 1.0 / e).sum::<f64>();
    let force = largest * row.young[body] + 0.05 * series;
    (10.0 * f64::EPSILON * force / (h * PRESSURE)).max(1e-10)
}

/// Largest displacement of each body, m.
fn largest_displacements(results: &Results) -> [f64; 2] {
    let mut largest = [0.0_f64; 2];
    let u = &point_field(results, "displacement").values;
    for (body, u) in std::iter::zip(point_bodies(results), u.chunks_exact(3)) {
        largest[body] = larger(largest[body], u[0].hypot(u[1]));
    }
    largest
}

/// Pressures on both surfaces, and stresses at all nodes and in all cells. `stress`: the exact one of each body over
/// the pressure: xx, yy, zz, xy.
fn check(
    failures: &mut Vec<String>,
    results: &Results,
    row: &Row,
    meshes: &Meshes,
    stress: [[f64; 4]; 2],
    what: &str,
) {
    let largest = largest_displacements(results);
    let allowed = [0, 1].map(|body| round_off(row, meshes, body, largest[body]));
    let either = allowed[0].max(allowed[1]);
    let surfaces = sides(results, 0);
    assert_eq!(surfaces.len(), 2, "{what}");
    let mut worst = 0.0_f64;
    for side in surfaces {
        worst = side.pressure.iter().fold(worst, |w, p| larger(w, (p / PRESSURE - 1.0).abs()));
    }
    small(failures, worst, either, &format!("{what}: pressure"));
    let cells = &results.piece.cell_fields.iter().find(|f| f.name == "stress").expect("stress").values;
    let cell_bodies = results.piece.cell_bodies.iter().map(|&b| b as usize).collect();
    let mut worst = [0.0_f64; 2];
    for (values, bodies) in
        [(&point_field(results, "stress").values, point_bodies(results)), (cells, cell_bodies)]
    {
        for (found, body) in std::iter::zip(values.chunks_exact(6), bodies) {
            for (found, exact) in std::iter::zip(found, stress[body]) {
                worst[body] = larger(worst[body], (found / PRESSURE - exact).abs());
            }
        }
    }
    for body in 0..2 {
        small(failures, worst[body], allowed[body], &format!("{what}: stress of body {body}"));
    }
}

/// Notes an error that is too large.
fn small(failures: &mut Vec<String>, error: f64, allowed: f64, what: &str) {
    if error.is_nan() || error > allowed {
        failures.push(format!("{what} is off by {error:.1e}, {allowed:.1e} allowed"));
    }
}

/// Uniaxial pressure, the whole turned by `angle`.
fn uniaxial(failures: &mut Vec<String>, runner: &Runner, row: &Row, meshes: &Meshes, angle: f64) {
    let what = format!("{} {meshes:?} turned by {angle:.2}", row.name);
    let case = placed(runner.parse(&rectangles(row, meshes)), angle);
    let (summary, results) = runner.run(&case);
    let (sin, cos) = angle.sin_cos();
    // -p along the turned y axis.
    let stress = [0, 1].map(|body| {
        let zz = if row.plane_strain { -row.poisson[body] } else { 0.0 };
        [-sin * sin, -cos * cos, zz, sin * cos]
    });
    check(failures, &results, row, meshes, stress, &what);
    let p = &summary.pairs[0];
    assert_eq!(p.active, p.candidates, "{what}");
    small(failures, (p.contact_length / SIZE[0] - 1.0).abs(), 1e-12, &format!("{what}: length"));
    // Displacements: the whole field.
    let compliance = [row.compliance(0), row.compliance(1)];
    let [_, h1, h2] = SIZE;
    let interface = -PRESSURE * compliance[0][0] * h1;
    let top = interface - PRESSURE * compliance[1][0] * h2;
    for (found, table) in std::iter::zip([interface, top], row.settles) {
        assert!((found / table - 1.0).abs() < 1e-8, "the table says {table:e}, the formula {found:e}");
    }
    let (largest, mut error) = (largest_displacements(&results), 0.0_f64);
    let u = &point_field(&results, "displacement").values;
    for ((x, u), body) in std::iter::zip(&results.piece.points, u.chunks_exact(3)).zip(point_bodies(&results))
    {
        let x = [cos * x[0] + sin * x[1], cos * x[1] - sin * x[0]];
        let u = [cos * u[0] + sin * u[1], cos * u[1] - sin * u[0]];
        let along = if body == 0 {
            -PRESSURE * compliance[0][0] * x[1]
        } else {
            interface - PRESSURE * compliance[1][0] * (x[1] - h1)
        };
        let exact = [PRESSURE * compliance[body][1] * x[0], along];
        for c in 0..2 {
            error = larger(error, (u[c] - exact[c]).abs() / largest[body]);
        }
    }
    small(failures, error, 1e-10, &format!("{what}: displacement"));
}

/// The same pressure from all sides, through an inclined interface.
fn hydrostatic(failures: &mut Vec<String>, runner: &Runner, row: &Row, meshes: &Meshes, angle: f64) {
    let what = format!("{} {meshes:?}, inclined, turned by {angle:.2}", row.name);
    let case = placed(runner.parse(&trapezia(row, meshes)), angle);
    let (_, results) = runner.run(&case);
    let stress = [0, 1].map(|body| {
        let zz = if row.plane_strain { -2.0 * row.poisson[body] } else { 0.0 };
        [-1.0, -1.0, zz, 0.0]
    });
    check(failures, &results, row, meshes, stress, &what);
}

fn placed(case: Case, angle: f64) -> Case {
    if angle == 0.0 { case } else { case.rotated(angle).expect("the case can be turned") }
}

#[test]
fn patch() {
    let runner = Runner::start();
    let mut failures = Vec::new();
    let inclined = 30.0_f64.to_radians();
    for row in &ROWS {
        for element in ["tri3", "tri6", "quad4", "quad8"] {
            let meshes = Meshes { cells: TABLE, elements: [element; 2] };
            for angle in [0.0, inclined] {
                uniaxial(&mut failures, &runner, row, &meshes, angle);
                hydrostatic(&mut failures, &runner, row, &meshes, angle);
            }
        }
    }
    for row in [&ROWS[1], &ROWS[4]] {
        let mixes = [
            ["tri3", "quad4"],
            ["quad8", "quad4"],
            ["tri3", "quad8"],
            ["quad4", "tri6"],
            ["tri6", "quad8"],
            ["tri6", "tri3"],
        ];
        for elements in mixes {
            for cells in [TABLE, [[7, 4], [5, 3]]] {
                let meshes = Meshes { cells, elements };
                uniaxial(&mut failures, &runner, row, &meshes, inclined);
                hydrostatic(&mut failures, &runner, row, &meshes, 0.0);
            }
        }
        for element in ["tri3", "tri6", "quad4", "quad8"] {
            for cells in [[[2, 1], [100, 24]], [[100, 24], [2, 2]], [[97, 24], [101, 30]]] {
                let meshes = Meshes { cells, elements: [element; 2] };
                uniaxial(&mut failures, &runner, row, &meshes, 0.0);
                hydrostatic(&mut failures, &runner, row, &meshes, inclined);
            }
        }
    }
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}
