//! Scenes of rings, bores, rollers and discs.
use super::draw::Draw;
use super::scene::{ELEMENTS, Expect, Frame, Head, Material, Scene, Twin, body, contact};
use kontakt::vector::larger;
use std::fmt::Write;

/// Relative errors that the mesh may leave in a force and in the largest pressure: `cells` to a right angle, `across`: the
/// larger logarithm of the radii's ratio from cell to cell.
fn allowed(elements: [&str; 2], cells: usize, across: f64) -> [f64; 2] {
    let linear = elements.iter().any(|e| *e == "tri3" || *e == "quad4");
    // Second order in the angle and the height of a cell; constants with a margin of three over those of quad4 and quad8.
    let angle = 1.57 / cells as f64;
    let force = 0.003 + if linear { 3.0 * (angle * angle + across * across) } else { 1.0 * angle * angle };
    // Constant stresses are of first order.
    [force, if elements.contains(&"tri3") { 2.0 * force + 2.0 * (angle + across) } else { 2.0 * force }]
}

/// Logarithm of the radii's ratio from cell to cell.
fn layer([a, b]: [f64; 2], cells: usize) -> f64 {
    (b / a).ln() / cells as f64
}

/// Radial displacement of a ring's inner and outer rim under unit pressure there, m/Pa (Lame).
fn rim(head: &Head, m: &Material, [a, b]: [f64; 2], inner: bool) -> f64 {
    let [e, nu] = head.plane(m);
    let ratio = (b * b + a * a) / (b * b - a * a);
    if inner { a / e * (ratio + nu) } else { b / e * (ratio - nu) }
}

/// A pressure that is the same all round, and its force: with errors of the force and of the largest pressure.
fn uniform(pressure: f64, area: f64, [force, peak]: [f64; 2], frame: &Frame) -> Vec<Expect> {
    let value = frame.pressure(pressure).parse().expect("a number");
    vec![
        Expect::Peak { pair: "fit".into(), value, relative: peak },
        Expect::Force { pair: "fit".into(), value: frame.force(pressure * area), relative: force },
    ]
}

fn ring(radius: [f64; 2], cells: [usize; 2], span: usize, frame: &Frame) -> String {
    let [from, to] = radius.map(|r| frame.length(r));
    let around = cells[1] * span;
    let degrees = 90 * span;
    format!(
        "ring = {{ radius = {{ from = {from}, to = {to}, cells = {} }}, angle = {{ from = 0, to = {degrees}, cells = {around} }} }}",
        cells[0]
    )
}

/// Supports of a ring over one to four right angles; a ring that contact holds has those of symmetry only.
fn hold(span: usize, radius: f64, held: bool, frame: &Frame) -> String {
    let point = |at: [f64; 2], c: &str| format!("[[body.support]]\npoint = {}\n{c} = 0\n", frame.point(at));
    let ends = "[[body.support]]\nsurface = \"start\"\ny = 0\n";
    match span {
        1 => format!("{ends}[[body.support]]\nsurface = \"end\"\nx = 0\n"),
        2 => {
            let across = if held { point([0.0, radius], "x") } else { String::new() };
            format!("{ends}[[body.support]]\nsurface = \"end\"\ny = 0\n{across}")
        }
        _ if held => point([radius, 0.0], "y") + &point([-radius, 0.0], "y") + &point([0.0, radius], "x"),
        _ => String::new(),
    }
}

/// Two rings pressed into each other (Lame).
pub fn press_fit(draw: &mut Draw, frame: Frame) -> Scene {
    let head = Head { pointwise: false, ..Head::draw(draw) };
    let r = draw.log(1e-3, 1.0);
    let radii = [r * draw.between(0.3, 0.8), r, r * draw.between(1.2, 2.0)];
    let interference = r * draw.log(1e-5, 2e-3);
    let elements = [draw.pick(&ELEMENTS), draw.pick(&ELEMENTS)];
    let e = draw.log(1e6, 1e12);
    let moduli = [e, e * draw.log(0.01, 100.0)];
    let materials = [0, 1].map(|i| Material::draw(draw, moduli[i], elements[i]));
    let span = draw.pick(&[1, 1, 2, 4]);
    let around = [draw.whole(8, 24), draw.whole(8, 24)];
    // Interference by overlapping meshes, or by an offset.
    let overlap = draw.chance(0.5);
    let mut text = head.text("press fit", &frame);
    let shift = if overlap { interference } else { 0.0 };
    let sizes = [[radii[0], radii[1] + shift], [radii[1], radii[2]]];
    let mut thickest = 0.0;
    for (i, name) in ["inner", "outer"].into_iter().enumerate() {
        text += &materials[i].text(name, &frame);
        let across = draw.whole(4, 8);
        thickest = larger(thickest, layer(sizes[i], across));
        text += &body(name, elements[i], &ring(sizes[i], [across, around[i]], span, &frame), &frame);
        text += &hold(span, sizes[i][i], i == 1, &frame);
    }
    let offset =
        if overlap { String::new() } else { format!("gap_offset = {}\n", frame.length(-interference)) };
    let sides =
        if draw.chance(0.5) { ["inner.outer", "outer.inner"] } else { ["outer.inner", "inner.outer"] };
    text += &contact("fit", sides, &offset);
    let compliance = rim(&head, &materials[0], sizes[0], false) + rim(&head, &materials[1], sizes[1], true);
    let pressure = interference / compliance;
    let errors = allowed(elements, around[0].min(around[1]), thickest);
    let area = radii[1] * span as f64 * std::f64::consts::FRAC_PI_2 * head.thickness;
    let expect = uniform(pressure, area, errors, &frame);
    Scene { family: "press fit", text, expect, twins: vec![Twin::Ranks], dense: false }
}

/// A ring pressed into a rigid bore, or onto a rigid shaft (Lame).
pub fn bore(draw: &mut Draw, frame: Frame) -> Scene {
    let head = Head { pointwise: draw.chance(0.3), ..Head::draw(draw) };
    let r = draw.log(1e-3, 1.0);
    let inside = draw.chance(0.5);
    let interference = r * draw.log(1e-5, 2e-3);
    let element = draw.pick(&ELEMENTS);
    let e = draw.log(1e6, 1e12);
    let material = Material::draw(draw, e, element);
    let (span, around) = (draw.pick(&[1, 2, 4]), draw.whole(8, 24));
    let overlap = draw.chance(0.5);
    let shift = if overlap { interference } else { 0.0 };
    let size = if inside { [0.5 * r, r + shift] } else { [r - shift, 1.8 * r] };
    let mut text = head.text("bore", &frame) + &material.text("ring", &frame);
    let across = draw.whole(4, 8);
    text += &body("ring", element, &ring(size, [across, around], span, &frame), &frame);
    text += &hold(span, if inside { size[0] } else { size[1] }, true, &frame);
    let _ = write!(
        text,
        "[[body]]\nname = \"hub\"\nrigid.circle = {{ center = [0, 0], radius = {}, inside = {inside} }}\n",
        frame.length(r)
    );
    let offset =
        if overlap { String::new() } else { format!("gap_offset = {}\n", frame.length(-interference)) };
    let surface = if inside { "ring.outer" } else { "ring.inner" };
    let sides = if draw.chance(0.5) { [surface, "hub.surface"] } else { ["hub.surface", surface] };
    text += &contact("fit", sides, &offset);
    let pressure = interference / rim(&head, &material, size, !inside);
    let errors = allowed([element; 2], around, layer(size, across));
    let area = r * span as f64 * std::f64::consts::FRAC_PI_2 * head.thickness;
    let expect = uniform(pressure, area, errors, &frame);
    Scene { family: "bore", text, expect, twins: vec![Twin::Ranks], dense: false }
}

/// A half disc on a rigid plane or on a block, under a force or a displacement (Hertz).
pub fn roller(draw: &mut Draw, frame: Frame) -> Scene {
    let head = Head::draw(draw);
    let r = draw.log(1e-3, 1.0);
    let elements = [draw.pick(&ELEMENTS), draw.pick(&ELEMENTS)];
    let rigid = draw.chance(0.5);
    let e = draw.log(1e6, 1e12);
    let moduli = [e, e * draw.log(1e-3, 1e3)];
    let materials = [0, 1].map(|i| Material::draw(draw, moduli[i], elements[i]));
    let compliance: f64 = (0..if rigid { 1 } else { 2 }).map(|i| 1.0 / head.plane(&materials[i])[0]).sum();
    // a^2 = 4 F' R / (pi E*), p0 = 2 F' / (pi a).
    let a = r * draw.between(0.02, 0.05);
    let force = std::f64::consts::PI * a * a / (4.0 * r * compliance);
    let peak = 2.0 * force / (std::f64::consts::PI * a);
    // Even: there is a node on the axis.
    let cells = 2 * draw.whole(6, 20);
    let degrees = (1.5 * a / r).to_degrees();
    let driven = draw.chance(0.4);
    let mut text = head.text("roller", &frame) + &materials[0].text("roller", &frame);
    let mesh = format!(
        "half_disc = {{ center = {}, radius = {}, arc = \"down\", core = 6, \
         angle = {{ at = [-45, {:?}, {degrees:?}, 45], cells = [8, {cells}, 8], ratio = [0.1, 1, 10] }}, \
         depth = {{ at = [0, 0.6], size = [{:?}, 0.1] }} }}",
        frame.point([0.0, r]),
        frame.length(r),
        -degrees,
        3.0 * a / r / cells as f64,
    );
    text += &body("roller", elements[0], &mesh, &frame);
    let _ = write!(text, "[[body.support]]\npoint = {}\nx = 0\n", frame.point([0.0, r]));
    if driven {
        let _ = write!(text, "[[body.support]]\nsurface = \"flat\"\ny = {}\n", frame.length(-a * a / r));
    } else {
        let p = frame.pressure(force / (2.0 * r));
        let _ = write!(text, "[[body.load]]\nsurface = \"flat\"\npressure = {p}\n");
        // A second node against the spin.
        let _ = write!(text, "[[body.support]]\npoint = {}\nx = 0\n", frame.point([0.0, 0.0]));
    }
    if rigid {
        text += "[[body]]\nname = \"base\"\nrigid.plane = { through = [0, 0], normal = [0, 1] }\n";
    } else {
        let [x, y] = [frame.length(r), frame.length(1.5 * a)];
        let fine = draw.whole(8, 60);
        let size = frame.length(3.0 * a / fine as f64);
        let mesh = format!(
            "rectangle = {{ x = {{ at = [-{x}, -{y}, {y}, {x}], cells = [8, {fine}, 8], ratio = [0.1, 1, 10] }}, \
             y = {{ at = [-{x}, 0], size = [{}, {size}] }} }}",
            frame.length(0.2 * r)
        );
        text += &(materials[1].text("base", &frame) + &body("base", elements[1], &mesh, &frame));
        text += "[[body.support]]\nsurface = \"bottom\"\nx = 0\ny = 0\n";
    }
    let other = if rigid { "base.surface" } else { "base.top" };
    let sides = if draw.chance(0.5) { ["roller.arc", other] } else { [other, "roller.arc"] };
    text += &contact("nip", sides, "");
    let mut expect = Vec::new();
    if !driven {
        let relative = if head.tolerance == "\"auto\"" { 1e-3 } else { 1e-6 };
        // The resultant is what statics fix; nodal normal forces lean by up to a/R.
        let value = frame.force(force * head.thickness);
        expect.push(Expect::Force { pair: "nip".into(), value, relative: relative + (a / r).powi(2) });
        if rigid && cells >= 20 && !head.pointwise {
            let relative = if elements[0] == "tri3" { 0.25 } else { 0.06 };
            expect.push(Expect::Peak {
                pair: "nip".into(),
                value: frame.pressure(peak).parse().expect("a number"),
                relative,
            });
        }
    }
    let mut twins =
        vec![Twin::Ranks, draw.pick(&[&Twin::Solver, &Twin::Condensed, &Twin::Scaled(1e3, 1e-6)]).clone()];
    if rigid {
        twins.push(Twin::Updated(0.02));
    } else if !head.pointwise {
        twins.push(Twin::Swap(0.05));
    }
    Scene { family: "roller", text, expect, twins, dense: false }
}

/// A whole disc between two rigid plates, its spin free.
pub fn disc(draw: &mut Draw, frame: Frame) -> Scene {
    let head = Head::draw(draw);
    let (r, e) = (draw.log(1e-3, 1.0), draw.log(1e6, 1e12));
    let element = draw.pick(&ELEMENTS);
    let material = Material::draw(draw, e, element);
    let quarter = 2 * draw.whole(8, 24);
    let mesh = format!(
        "disc = {{ radius = {}, quarter = {quarter}, depth = {{ to = 0.5, cells = {}, ratio = 3 }} }}",
        frame.length(r),
        draw.whole(4, 8)
    );
    let travel = r * draw.log(1e-4, 3e-3);
    let mut text =
        head.text("disc", &frame) + &material.text("disc", &frame) + &body("disc", element, &mesh, &frame);
    // Against rolling.
    let _ = write!(text, "[[body.support]]\npoint = {}\nx = 0\n", frame.point([0.0, -r]));
    for (name, y, normal) in [("low", -r, 1.0), ("high", r, -1.0)] {
        let motion =
            if name == "high" { format!("rigid.y = {}\n", frame.length(-travel)) } else { String::new() };
        let [through, normal] = [frame.point([0.0, y]), frame.direction([0.0, normal])];
        let _ = write!(
            text,
            "[[body]]\nname = \"{name}\"\nrigid.plane = {{ through = {through}, normal = {normal} }}\n{motion}"
        );
    }
    text += &contact("low", ["disc.arc", "low.surface"], "");
    text += &contact("high", ["high.surface", "disc.arc"], "");
    Scene {
        family: "disc",
        text,
        expect: Vec::new(),
        twins: vec![Twin::Ranks, Twin::Updated(0.02)],
        dense: false,
    }
}
