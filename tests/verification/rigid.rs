//! Rigid planes, circles and polylines against elastic bodies.
use super::{attempt, close, multipliers, near, rectangle, solve_all, value};
use std::f64::consts::PI;

const STEEL: &str = "material.steel = { young = 2.1e11, poisson = 0.3 }\n";

/// A plane moved down onto a block, then up again: uniform pressure E U / h, and none.
#[test]
fn moved_plane() {
    let block = rectangle(
        "block",
        "steel",
        "quad8",
        (0.0, 0.04, 7),
        (0.0, 0.02, 3),
        "support = [{ surface = \"bottom\", y = 0 }, { point = [0, 0], x = 0 }]",
    );
    for (shape, offset) in [
        ("plane = { through = [3, 0.02], normal = [0, -2] }", 0.0),
        ("plane = { through = [3, 0.020005], normal = [0, -2] }", 5e-6),
        // Outward is to the right of the way: from left to right it is below.
        ("polyline = { points = [[-0.01, 0.02], [0.07, 0.02]] }", 0.0),
        ("polyline = { points = [[-0.01, 0.02], [0.013, 0.02], [0.07, 0.02]] }", 0.0),
        ("polyline = { points = [[0, 0.02], [0.04, 0.02], [0.04, 0.04], [0, 0.04], [0, 0.02]] }", 0.0),
    ] {
        let text = format!(
            "analysis = \"plane strain\"\nalternation.tolerance = 1e-11\n{STEEL}\
             contact = [{{ name = \"c\", surfaces = [\"punch.surface\", \"block.top\"] }}]\n\
             step = [{{ supports = 0.5 }}, {{ supports = 1 }}, {{ supports = -1 }}]\n\
             probe = [{{ name = \"t\", body = \"block\", at = [0.04, 0.02] }}]\n\
             [[body]]\nname = \"punch\"\nrigid = {{ {shape}, y = -2e-5 }}\n{block}"
        );
        let (summary, results) = solve_all(&text, 2, &[]);
        let modulus = 2.1e11 / (1.0 - 0.09) / 0.02;
        for (i, motion) in [1e-5, 2e-5].into_iter().enumerate() {
            let p = (motion - offset) * modulus;
            near(value(&summary, &format!("steps.{i}.pairs.c.max_pressure")), p, 1e-9 * p, shape);
            near(value(&summary, &format!("steps.{i}.pairs.c.normal_force")), p * 0.04, 1e-9 * p, shape);
            for found in &super::gapped(&results.before[i].pairs[0]).pressure {
                near(*found, p, 1e-9 * p, shape);
            }
            // On side A, the punch: upwards.
            near(value(&summary, &format!("steps.{i}.pairs.c.resultant.1")), p * 0.04, 1e-9 * p, shape);
        }
        assert_eq!(value(&summary, "pairs.c.normal_force"), 0.0);
        for gap in &multipliers(&results, 0).gap {
            near(*gap, 2e-5 + offset, 1e-14, "gap");
        }
    }
}

/// A block on an inclined plane, held along it: weight over width times cosine, whatever the angle.
#[test]
fn block_on_an_inclined_plane() {
    for degrees in [0.0_f64, 17.0, 45.0, 80.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let text = format!(
            "analysis = \"plane stress\"\nalternation.tolerance = 1e-11\n{STEEL}\
             contact = [{{ name = \"c\", surfaces = [\"block.bottom\", \"plane.surface\"] }}]\n\
             [[body]]\nname = \"plane\"\nrigid.plane = {{ through = [0, 0], normal = [{}, {cos}] }}\n{}",
            -sin,
            rectangle(
                "block",
                "steel",
                "quad4",
                (0.0, 0.04, 8),
                (0.0, 0.02, 4),
                &format!(
                    "mesh.rotate = {degrees}\nsupport = [{{ surface = \"left\", x = 0, angle = {degrees} }}]\n\
                     load = [{{ body_force = [0, -7.8e7] }}]"
                )
            )
        );
        let (summary, _) = solve_all(&text, 2, &[]);
        close(&summary, "pairs.c.normal_force", 7.8e7 * 0.04 * 0.02 * cos, 1e-9);
        near(value(&summary, "pairs.c.resultant.0"), -7.8e7 * 8e-4 * cos * sin, 1e-6, "along x");
        near(value(&summary, "pairs.c.resultant.1"), 7.8e7 * 8e-4 * cos * cos, 1e-6, "along y");
    }
}

fn ring(angle: &str, support: &str) -> String {
    format!(
        "[[body]]\nname = \"ring\"\nmaterial = \"steel\"\nelement = \"quad8\"\n\
         mesh.ring = {{ radius = {{ from = 0.05, to = 0.1, cells = 12 }}, angle = {angle} }}\n{support}\n"
    )
}

/// An elastic ring pressed into a rigid bore, and onto a rigid shaft (Lame): quarters, and whole rings held by contact alone.
#[test]
fn ring_in_a_bore_and_on_a_shaft() {
    let (a, b, d, e, nu) = (0.05_f64, 0.1_f64, 2e-5, 2.1e11, 0.3);
    let ratio = (b * b + a * a) / (b * b - a * a);
    let quarter = ring(
        "{ from = 0, to = 90, cells = 40 }",
        "support = [{ surface = \"start\", y = 0 }, { surface = \"end\", x = 0 }]",
    );
    let whole = ring("{ from = 0, to = 360, cells = 160 }", "");
    for (ring, share) in [(&quarter, 0.25), (&whole, 1.0)] {
        for (inside, surface, radius, p) in [
            (true, "outer", b - d, d / (b / e * (ratio - nu))),
            (false, "inner", a + d, d / (a / e * (ratio + nu))),
        ] {
            let text = format!(
                "analysis = \"plane stress\"\nalternation.tolerance = 1e-11\n{STEEL}\
                 contact = [{{ name = \"c\", surfaces = [\"ring.{surface}\", \"rigid.surface\"] }}]\n\
                 probe = [{{ name = \"p\", body = \"ring\", at = [0.075, 0] }}]\n\
                 [[body]]\nname = \"rigid\"\nrigid.circle = {{ center = [0, 0], radius = {radius:.17}, inside = {inside} }}\n{ring}"
            );
            let (summary, results) = solve_all(&text, 2, &[]);
            for found in &multipliers(&results, 0).pressure {
                near(*found, p, 1e-3 * p, &format!("{surface}: pressure"));
            }
            let circumference = share * 2.0 * PI * if inside { b } else { a };
            close(&summary, "pairs.c.normal_force", p * circumference, 1e-4);
            if share == 1.0 {
                // Nothing keeps a ring from spinning, and nothing turns it.
                let free = &summary["free_modes"];
                assert_eq!(free.as_array().map(Vec::len), Some(1), "{free}");
                assert!(free[0]["mode"].as_str().expect("a mode").contains("rotation"), "{free}");
                near(value(&summary, "probes.p.displacement.1"), 0.0, 1e-12, "spin");
                for c in 0..2 {
                    near(value(&summary, &format!("pairs.c.resultant.{c}")), 0.0, 1e-6 * p * b, "resultant");
                }
            }
        }
    }
}

/// A rigid cylinder pressed into a deep block: half-width and peak pressure follow from the force (Hertz).
#[test]
fn rigid_cylinder_on_a_block() {
    let r = 0.05;
    let text = format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-10\n{STEEL}\
         contact = [{{ name = \"c\", surfaces = [\"block.top\", \"cylinder.surface\"] }}]\n\
         [[body]]\nname = \"cylinder\"\nrigid = {{ circle = {{ center = [0, {r}], radius = {r} }}, y = -1.5e-5 }}\n\
         [[body]]\nname = \"block\"\nmaterial = \"steel\"\nelement = \"quad8\"\n\
         mesh.rectangle = {{ x = {{ at = [-0.1, -8e-4, 0, 8e-4, 0.1], size = [0.02, 4e-5, 4e-5, 4e-5, 0.02] }}, y = {{ at = [-0.1, -1.5e-3, 0], size = [0.02, 4e-5, 4e-5] }} }}\n\
         support = [{{ surface = \"bottom\", y = 0 }}, {{ point = [0, -0.1], x = 0 }}]\n"
    );
    let (summary, results) = solve_all(&text, 2, &[]);
    let force = value(&summary, "pairs.c.normal_force");
    let modulus = 2.1e11 / 0.91;
    let (a, p0) = ((4.0 * force * r / (PI * modulus)).sqrt(), (force * modulus / (PI * r)).sqrt());
    near(value(&summary, "pairs.c.max_pressure"), p0, 2e-3 * p0, "peak pressure");
    near(0.5 * value(&summary, "pairs.c.contact_length"), a, 4e-5, "half-width");
    let side = multipliers(&results, 0);
    for (x, p) in std::iter::zip(&side.x, &side.pressure).filter(|(x, _)| x[0].abs() < 0.8 * a) {
        near(*p, p0 * (1.0 - (x[0] / a).powi(2)).sqrt(), 5e-3 * p0, &format!("pressure at {:e}", x[0]));
    }
}

/// A roller pressed into a V: each flank takes P / (2 sin(half angle)). Its spin is free. There are nodes where it
/// touches: the forces act along the roller's normals, so that the contact of nodes beside it would lean.
#[test]
fn roller_in_a_v() {
    let (load, half, r) = (1e5, 20.0_f64.to_radians(), 0.02);
    let (sin, cos) = half.sin_cos();
    let disc = format!(
        "[[body]]\nname = \"roller\"\nmaterial = \"steel\"\nelement = \"quad8\"\nmesh.disc = {{ center = [0, 0], radius = {r}, quarter = 45, depth = {{ at = [0, 0.5], cells = 12 }} }}\n\
         load = [{{ body_force = [0, {:e}] }}]\n",
        -load / (PI * r * r)
    );
    // Flanks that touch the roller where their normals point to its centre.
    let flanks = format!(
        "contact = [{{ name = \"left\", surfaces = [\"roller.arc\", \"left.surface\"] }}, {{ name = \"right\", surfaces = [\"roller.arc\", \"right.surface\"] }}]\n\
         [[body]]\nname = \"left\"\nrigid.plane = {{ through = [{x}, {y}], normal = [{cos}, {sin}] }}\n\
         [[body]]\nname = \"right\"\nrigid.plane = {{ through = [{}, {y}], normal = [{}, {sin}] }}\n",
        r * cos,
        -cos,
        x = -r * cos,
        y = -r * sin
    );
    // From the upper end of the right flank down and up again, the body of the V below: outward is to the right.
    let (depth, up) = (r / sin, 0.08);
    let v = format!(
        "contact = [{{ name = \"v\", surfaces = [\"roller.arc\", \"v.surface\"] }}]\n\
         [[body]]\nname = \"v\"\nrigid.polyline.points = [[{0}, {1}], [0, {2}], [{3}, {1}]]\n",
        up * half.tan(),
        up - depth,
        -depth,
        -up * half.tan()
    );
    let heading = format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-10\n{STEEL}probe = [{{ name = \"c\", body = \"roller\", at = [0, 0] }}]\n"
    );
    let exact = load / (2.0 * sin);
    let (summary, _) = solve_all(&format!("{heading}{flanks}{disc}"), 2, &[]);
    for (pair, side) in [("left", 1.0), ("right", -1.0)] {
        close(&summary, &format!("pairs.{pair}.normal_force"), exact, 2e-4);
        close(&summary, &format!("pairs.{pair}.resultant.0"), side * exact * cos, 2e-4);
        close(&summary, &format!("pairs.{pair}.resultant.1"), exact * sin, 2e-4);
    }
    assert_eq!(summary["free_modes"].as_array().map(Vec::len), Some(1), "{}", summary["free_modes"]);
    let (summary, _) = solve_all(&format!("{heading}{v}{disc}"), 2, &[]);
    close(&summary, "pairs.v.normal_force", 2.0 * exact, 2e-4);
    close(&summary, "pairs.v.resultant.1", load, 1e-7);
    near(value(&summary, "pairs.v.resultant.0"), 0.0, 1e-6 * load, "sideways");
}

/// Pulled off the plane that is its only hold: refused, with the body, the motion and advice.
#[test]
fn nothing_holds_it() {
    let text = format!(
        "analysis = \"plane stress\"\n{STEEL}contact = [{{ name = \"c\", surfaces = [\"block.bottom\", \"plane.surface\"] }}]\n\
         [[body]]\nname = \"plane\"\nrigid.plane = {{ through = [0, 0], normal = [0, 1] }}\n{}",
        rectangle(
            "block",
            "steel",
            "quad4",
            (0.0, 0.04, 8),
            (0.0, 0.02, 4),
            "support = [{ surface = \"left\", x = 0 }]\nload = [{ surface = \"top\", pressure = -1e6 }]"
        )
    );
    let directory = attempt(&text, 4);
    assert!(directory.1.contains("'block'") && directory.1.contains("translation y"), "{}", directory.1);
}
