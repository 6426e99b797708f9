//! Straight-sided elements on curved surfaces, where the sagitta is larger than the clearance or the interference; and corners.
use super::{multipliers, near, solve, solve_all, start, value};
use kontakt::{output::Results, vector::worst};
use std::{f64::consts::PI, fmt::Write as _, path::Path};

const STEEL: &str = "alternation.tolerance = 1e-12\nmaterial.steel = { young = 2.1e11, poisson = 0.3 }\n";

const QUARTER: &str = "support = [{ surface = \"start\", y = 0 }, { surface = \"end\", x = 0 }]\n";

/// A quarter of a ring.
fn ring(name: &str, element: &str, [from, to]: [f64; 2], cells: usize, rest: &str) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\nelement = \"{element}\"\n\
         mesh.ring = {{ radius = {{ from = {from}, to = {to}, cells = 8 }}, angle = {{ from = 0, to = 90, cells = {cells} }} }}\n\
         {QUARTER}{rest}"
    )
}

/// Lame's pressure of two rings of one material, plane stress: inner radius, joint, outer radius, interference.
fn lame(young: f64, [a, b, c]: [f64; 3], interference: f64) -> f64 {
    let [a2, b2, c2] = [a, b, c].map(|r| r * r);
    interference * young / (b * ((b2 + a2) / (b2 - a2) + (c2 + b2) / (c2 - b2)))
}

/// Largest relative distance of the pressures of the multipliers from `p`.
fn scatter(results: &Results, p: f64) -> f64 {
    let table = multipliers(results, 0);
    let candidates = std::iter::zip(&table.pressure, &table.status).filter(|(_, s)| **s > 0);
    worst(candidates.map(|(found, _)| (found / p - 1.0).abs()))
}

/// Rings whose meshes overlap by an eighth of the sagitta of their facets: force, pressures at the nodes and displacements are
/// Lame's on any two meshes, with any side as side A.
#[test]
fn press_fits_of_overlapping_meshes() {
    let (radii, interference) = ([0.01, 0.02, 0.03], 2.5e-6);
    let p = lame(2.1e11, radii, interference);
    for (elements, allowed) in [
        (["quad4", "quad4"], 5e-3),
        (["tri3", "quad4"], 2e-2),
        (["quad8", "quad4"], 5e-3),
        (["quad8", "quad8"], 1e-3),
    ] {
        for cells in [[24, 31], [40, 24], [24, 24], [24, 72]] {
            for surfaces in ["\"shaft.outer\", \"hub.inner\"", "\"hub.inner\", \"shaft.outer\""] {
                let text = format!(
                    "analysis = \"plane stress\"\n{STEEL}contact = [{{ name = \"fit\", surfaces = [{surfaces}] }}]\n{}{}",
                    ring("shaft", elements[0], [0.01, 0.02 + interference], cells[0], ""),
                    ring("hub", elements[1], [0.02, 0.03], cells[1], "")
                );
                let (summary, results) = solve_all(&text, 1, &[]);
                let what = format!("{elements:?} {cells:?} {surfaces}");
                near(
                    value(&summary, "pairs.fit.normal_force"),
                    p * 0.5 * PI * 0.02,
                    allowed * p * 0.03,
                    &what,
                );
                let found = scatter(&results, p);
                assert!(found < allowed, "{what}: pressures off by {found:.2e}");
                near(value(&summary, "pairs.fit.contact_length"), 0.5 * PI * 0.02, 1e-3 * 0.03, &what);
            }
        }
    }
}

/// A ring under inner pressure that closes a clearance to a rigid bore, which 16 facets a quarter leave by twenty times as
/// much; and one pressed onto a rigid shaft by outer pressure.
#[test]
fn rings_and_rigid_circles_with_a_clearance() {
    let (young, nu, clearance) = (2e11, 0.3, 2e-5);
    for inside in [true, false] {
        for (element, cells, allowed) in [
            ("quad4", 8, 1e-2),
            ("quad4", 16, 4e-3),
            ("quad4", 64, 2e-3),
            ("tri3", 32, 3e-2),
            ("quad8", 16, 2e-3),
        ] {
            let ([a, b], load) = ([0.05, 0.08], 1e8);
            // Loaded and touching radius. Plane strain: E' = E / (1 - nu^2), nu' = nu / (1 - nu).
            let (e1, nu1) = (young / (1.0 - nu * nu), nu / (1.0 - nu));
            let (far, near_, radius) =
                if inside { ("inner", "outer", b + clearance) } else { ("outer", "inner", a - clearance) };
            // Radial displacement of the touching face by a unit of load there and on the other face (Lame).
            let d = b * b - a * a;
            let (own, other) = match inside {
                true => {
                    (b / (e1 * d) * ((1.0 - nu1) * b * b + (1.0 + nu1) * a * a), 2.0 * a * a * b / (e1 * d))
                }
                false => {
                    (a / (e1 * d) * ((1.0 - nu1) * a * a + (1.0 + nu1) * b * b), 2.0 * b * b * a / (e1 * d))
                }
            };
            let p = (load * other - clearance) / own;
            let text = format!(
                "analysis = \"plane strain\"\nalternation.tolerance = 1e-12\nmaterial.steel = {{ young = {young}, poisson = {nu} }}\n\
                 contact = [{{ name = \"c\", surfaces = [\"ring.{near_}\", \"rigid.surface\"] }}]\n{}\
                 [[body]]\nname = \"rigid\"\nrigid.circle = {{ center = [0, 0], radius = {radius:.17}, inside = {inside} }}\n",
                ring(
                    "ring",
                    element,
                    [a, b],
                    cells,
                    &format!("load = [{{ surface = \"{far}\", pressure = {load} }}]\n")
                )
            );
            let (summary, results) = solve_all(&text, 1, &[]);
            let what = format!("{element} {cells} {inside}");
            assert_eq!(summary["reason"], "converged", "{what}");
            let force = p * 0.5 * PI * if inside { b } else { a };
            near(value(&summary, "pairs.c.normal_force"), force, allowed * force, &what);
            // Nodal pressures of triangles scatter on any mesh.
            let found = scatter(&results, p);
            assert!(found < allowed || element == "tri3", "{what}: pressures off by {found:.2e}");
        }
    }
}

/// Writes a mesh of four-node cells, or of triangles, in Gmsh's format 2.2; `map` from the unit square.
fn write_mesh(path: &Path, [nx, ny]: [usize; 2], triangles: bool, map: impl Fn(f64, f64) -> [f64; 2]) {
    let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n");
    text +=
        "1 1 \"bottom\"\n1 2 \"right\"\n1 3 \"top\"\n1 4 \"left\"\n2 5 \"body\"\n$EndPhysicalNames\n$Nodes\n";
    let number = |i: usize, j: usize| 1 + i + (nx + 1) * j;
    writeln!(text, "{}", (nx + 1) * (ny + 1)).unwrap();
    for j in 0..=ny {
        for i in 0..=nx {
            let [x, y] = map(i as f64 / nx as f64, j as f64 / ny as f64);
            writeln!(text, "{} {x:.17e} {y:.17e} 0", number(i, j)).unwrap();
        }
    }
    let mut elements = Vec::new();
    for i in 0..nx {
        elements.push(format!("1 2 1 1 {} {}", number(i, 0), number(i + 1, 0)));
        elements.push(format!("1 2 3 3 {} {}", number(i + 1, ny), number(i, ny)));
    }
    for j in 0..ny {
        elements.push(format!("1 2 2 2 {} {}", number(nx, j), number(nx, j + 1)));
        elements.push(format!("1 2 4 4 {} {}", number(0, j + 1), number(0, j)));
    }
    for i in 0..nx {
        for j in 0..ny {
            let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            if triangles {
                elements.push(format!("2 2 5 5 {a} {b} {c}"));
                elements.push(format!("2 2 5 5 {a} {c} {d}"));
            } else {
                elements.push(format!("3 2 5 5 {a} {b} {c} {d}"));
            }
        }
    }
    writeln!(text, "$EndNodes\n$Elements\n{}", elements.len()).unwrap();
    elements.iter().enumerate().for_each(|(k, e)| writeln!(text, "{} {e}", k + 1).unwrap());
    std::fs::write(path, text + "$EndElements\n").unwrap();
}

/// The press fit with meshes from files, whose curves are those through the nodes.
#[test]
fn press_fits_of_meshes_from_files() {
    let (radii, interference) = ([0.01, 0.02, 0.03], 2.5e-6);
    let p = lame(2.1e11, radii, interference);
    let directory = tempfile::tempdir().unwrap();
    for (triangles, allowed) in [(false, 5e-3), (true, 2e-2)] {
        for cells in [[24, 31], [31, 24], [24, 48]] {
            let polar = |from: f64, to: f64| {
                move |u: f64, v: f64| {
                    let (sin, cos) = (0.5 * PI * (1.0 - u)).sin_cos();
                    let r = from + (to - from) * v;
                    [r * cos, r * sin]
                }
            };
            write_mesh(
                &directory.path().join("shaft.msh"),
                [cells[0], 8],
                triangles,
                polar(0.01, 0.02 + interference),
            );
            write_mesh(&directory.path().join("hub.msh"), [cells[1], 8], triangles, polar(0.02, 0.03));
            let body = |name: &str| {
                format!(
                    "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\nmesh.file = \"{}/{name}.msh\"\n\
                     support = [{{ surface = \"right\", y = 0 }}, {{ surface = \"left\", x = 0 }}]\n",
                    directory.path().display()
                )
            };
            let text = format!(
                "analysis = \"plane stress\"\n{STEEL}contact = [{{ name = \"fit\", surfaces = [\"shaft.top\", \"hub.bottom\"] }}]\n{}{}",
                body("shaft"),
                body("hub")
            );
            let (summary, results) = solve_all(&text, 1, &[]);
            let what = format!("{cells:?}, triangles: {triangles}");
            near(value(&summary, "pairs.fit.normal_force"), p * 0.5 * PI * 0.02, allowed * p * 0.03, &what);
            // Nodal pressures of triangles scatter on any mesh.
            let found = scatter(&results, p);
            assert!(found < allowed || triangles, "{what}: pressures off by {found:.2e}");
        }
    }
}

/// Two bodies joined along roofs of any slope, under pressure from all around: it is the same everywhere.
#[test]
fn corners_under_hydrostatic_pressure() {
    let directory = tempfile::tempdir().unwrap();
    let p = 1e8;
    for turn in [5.0_f64, 20.0, 39.0, 45.0, 59.0, 75.0, 90.0, 120.0] {
        for (down, triangles) in [(1.0, false), (-1.0, true)] {
            let slope = down * (0.5 * turn).to_radians().tan();
            // One roof in the middle; nodes of both meshes lie on its ridge.
            let roof = move |x: f64| slope * (1.0 - (x - 1.0).abs());
            let between = |low: f64, high: f64, of_low: f64, of_high: f64| {
                move |u: f64, v: f64| {
                    let (from, to) = (low + of_low * roof(2.0 * u), high + of_high * roof(2.0 * u));
                    [2.0 * u, from + (to - from) * v]
                }
            };
            write_mesh(&directory.path().join("lower.msh"), [12, 8], triangles, between(-3.0, 0.0, 0.0, 1.0));
            write_mesh(&directory.path().join("upper.msh"), [16, 8], triangles, between(0.0, 3.0, 1.0, 0.0));
            let pressed = |surfaces: &[&str]| {
                let loads = surfaces.iter().map(|s| format!("{{ surface = \"{s}\", pressure = {p} }}"));
                format!("load = [{}]\n", loads.collect::<Vec<_>>().join(", "))
            };
            let file = |name: &str| format!("mesh.file = \"{}/{name}.msh\"\n", directory.path().display());
            let text = format!(
                "analysis = \"plane stress\"\n{STEEL}\
                 contact = [{{ name = \"c\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n\
                 [[body]]\nname = \"lower\"\nmaterial = \"steel\"\n{}support = [{{ surface = \"bottom\", y = 0 }}, {{ point = [0, -3], x = 0 }}]\n{}\
                 [[body]]\nname = \"upper\"\nmaterial = \"steel\"\n{}support = [{{ point = [0, 3], x = 0 }}]\n{}",
                file("lower"),
                pressed(&["left", "right"]),
                file("upper"),
                pressed(&["left", "right", "top"]),
            );
            let results = solve_all(&text, 1, &[]).1;
            let found = scatter(&results, p);
            assert!(found < 1e-10, "{turn} degrees, {down}: pressures off by {found:.2e}");
        }
    }
}

/// A mesh of a ring from a file so coarse that its sides could be those of a polygon: the run says so.
#[test]
fn a_polygon_that_could_be_a_circle_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let octagon = |u: f64, v: f64| {
        let (sin, cos) = (-2.0 * PI * u).sin_cos();
        [(0.01 + 0.01 * v) * cos, (0.01 + 0.01 * v) * sin]
    };
    // Three quarters of an octagonal ring.
    let part = |u: f64, v: f64| octagon(0.75 * u, v);
    write_mesh(&directory.path().join("shaft.msh"), [6, 4], false, part);
    let text = format!(
        "analysis = \"plane stress\"\n{STEEL}contact = [{{ name = \"c\", surfaces = [\"shaft.top\", \"bore.surface\"] }}]\n\
         [[body]]\nname = \"shaft\"\nmaterial = \"steel\"\nmesh.file = \"{}/shaft.msh\"\n\
         support = [{{ surface = \"left\", x = 0, y = 0 }}]\n\
         [[body]]\nname = \"bore\"\nrigid.circle = {{ center = [0, 0], radius = 0.01999, inside = true }}\n",
        directory.path().display()
    );
    let run = tempfile::tempdir().unwrap();
    let (_, log) = start(&text, 1, &[], run.path());
    assert!(log.contains("coarse curve"), "{log}");
}

/// Nothing that penetrates is open.
#[test]
fn a_ring_inside_its_bore_is_open_and_one_in_it_is_not() {
    let case = |radius: f64| {
        format!(
            "analysis = \"plane strain\"\n{STEEL}contact = [{{ name = \"c\", surfaces = [\"ring.outer\", \"bore.surface\"] }}]\n{}\
             [[body]]\nname = \"bore\"\nrigid.circle = {{ center = [0, 0], radius = {radius}, inside = true }}\n",
            ring("ring", "quad4", [0.05, 0.08], 8, "")
        )
    };
    assert_eq!(solve(&case(0.0800001))["reason"], "open");
    assert_eq!(solve(&case(0.0799999))["reason"], "converged");
}
