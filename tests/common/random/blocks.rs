//! Scenes of straight-sided bodies: stacks, foils, a shared support, stops, wedges.
use super::draw::Draw;
use super::scene::{ELEMENTS, Expect, Frame, Head, Material, Scene, Twin, body, contact};
use std::fmt::Write;

/// A rectangle with its mesh.
struct Block {
    x: [f64; 2],
    y: [f64; 2],
    cells: [usize; 2],
    element: &'static str,
    material: Material,
}

impl Block {
    fn width(&self) -> f64 {
        self.x[1] - self.x[0]
    }

    fn height(&self) -> f64 {
        self.y[1] - self.y[0]
    }

    fn mesh(&self, frame: &Frame) -> String {
        let side = |ends: [f64; 2], cells: usize| {
            let [from, to] = ends.map(|v| frame.length(v));
            format!("{{ from = {from}, to = {to}, cells = {cells} }}")
        };
        format!("rectangle = {{ x = {}, y = {} }}", side(self.x, self.cells[0]), side(self.y, self.cells[1]))
    }

    fn text(&self, name: &str, frame: &Frame) -> String {
        self.material.text(name, frame) + &body(name, self.element, &self.mesh(frame), frame)
    }
}

fn support(surface: &str, component: &str, value: &str, frame: &Frame) -> String {
    format!("[[body.support]]\nsurface = \"{surface}\"\n{component} = {value}{}\n", angle_line(frame))
}

fn point_support(at: [f64; 2], component: &str, frame: &Frame) -> String {
    format!("[[body.support]]\npoint = {}\n{component} = 0{}\n", frame.point(at), angle_line(frame))
}

fn angle_line(frame: &Frame) -> String {
    frame.angle().replace(", ", "\n")
}

fn floor(frame: &Frame) -> String {
    let [through, normal] = [frame.point([0.0, 0.0]), frame.direction([0.0, 1.0])];
    format!("[[body]]\nname = \"floor\"\nrigid.plane = {{ through = {through}, normal = {normal} }}\n")
}

/// Moduli over twelve decades from scene to scene, six within one.
fn young(draw: &mut Draw) -> impl Fn(&mut Draw) -> f64 + use<> {
    let (base, spread) = (draw.log(1e6, 1e12), draw.pick(&[1.0, 10.0, 1e3]));
    move |draw: &mut Draw| base * draw.log(1.0 / spread, spread)
}

/// Two to five blocks on each other, on a floor or a support.
pub fn stack(draw: &mut Draw, mut frame: Frame) -> Scene {
    frame.degrees = if draw.chance(0.3) { draw.between(-180.0, 180.0) } else { 0.0 };
    let mut head = Head::draw(draw);
    let (n, w) = (draw.whole(2, 5), draw.log(1e-4, 1.0));
    let matching = draw.chance(0.35);
    let young = young(draw);
    let common = draw.pick(&ELEMENTS);
    let mixed = draw.chance(0.4);
    let cells = draw.whole(1, 14);
    let heated = draw.chance(0.2);
    let mut blocks: Vec<Block> = Vec::new();
    for _ in 0..n {
        let element = if mixed { draw.pick(&ELEMENTS) } else { common };
        let e = young(draw);
        let mut material = Material::draw(draw, e, element);
        material.expansion = if heated { draw.log(1e-6, 3e-5) } else { 0.0 };
        let (half, centre) = (0.5 * w * draw.between(0.7, 1.4), w * draw.between(-0.06, 0.06));
        let bottom = blocks.last().map_or(0.0, |b| b.y[1]);
        let height = w * draw.log(0.1, 2.0);
        let own = [draw.whole(1, 14), draw.whole(1, 8)];
        let x = if matching { [-0.5 * w, 0.5 * w] } else { [centre - half, centre + half] };
        let cells = [if matching { cells } else { own[0] }, own[1]];
        blocks.push(Block { x, y: [bottom, bottom + height], cells, element, material });
    }
    let rigid_floor = draw.chance(0.5);
    let softest =
        blocks.iter().map(|b| b.material.young).fold(f64::INFINITY, |a, b| if b < a { b } else { a });
    let temperature = draw.between(273.0, 373.0);
    let (driven, gravity) = (draw.chance(0.4), draw.chance(0.2));
    let gravity = gravity && blocks.iter().all(|b| b.element != "tri6" || b.material.poisson <= 0.45);
    let pressure = softest * draw.log(1e-6, 1e-3);
    let slope = if draw.chance(0.5) { draw.between(-0.3, 0.3) } else { 0.0 };
    let travel = draw.log(1e-5, 1e-3) * blocks.iter().map(Block::height).sum::<f64>();
    let weight = softest * 1e-5 / w;
    head.pointwise = head.pointwise || matching && draw.chance(0.5);

    let mut text = head.text("stack", &frame);
    for (i, block) in blocks.iter().enumerate() {
        text += &block.text(&format!("b{i}"), &frame);
        if heated {
            let _ = writeln!(text, "temperature = {temperature:?}");
        }
        if draw.chance(0.2) {
            let _ = writeln!(text, "response = \"{}\"", draw.pick(&["condensed", "solver"]));
        }
        if i == 0 && !rigid_floor {
            text += &support("bottom", "y", "0", &frame);
        }
        match draw.whole(0, 2) {
            0 => text += &support("left", "x", "0", &frame),
            1 => text += &point_support([block.x[0], block.y[0]], "x", &frame),
            _ => text += &point_support([block.x[1], block.y[1]], "x", &frame),
        }
        if i == n - 1 {
            if driven {
                text += &support("top", "y", &frame.length(-travel), &frame);
            } else {
                let [p, along] = [frame.pressure(pressure), frame.along()];
                let [middle, width] =
                    [0.5 * (block.x[0] + block.x[1]), block.width()].map(|v| frame.length(v));
                let p = format!("\"{p} * (1 + ({slope:?}) * ({along} - ({middle})) / {width})\"");
                let _ = write!(text, "[[body.load]]\nsurface = \"top\"\npressure = {p}\n");
            }
        }
        if gravity {
            let _ = writeln!(text, "[[body.load]]\nbody_force = {}", frame.per_volume([0.0, -weight]));
        }
    }
    if rigid_floor {
        text += &floor(&frame);
    }
    let mut expect = Vec::new();
    let first = usize::from(!rigid_floor);
    for i in first..n {
        let (low, high) =
            (if i == 0 { "floor.surface".into() } else { format!("b{}.top", i - 1) }, format!("b{i}.bottom"));
        let sides = if draw.chance(0.5) { [&low[..], &high] } else { [&high[..], &low] };
        // Where the top is driven, gaps and interferences are small against its travel.
        let size = 0.05 * travel;
        let rest = match draw.whole(0, 7) {
            0 => format!("gap_offset = {}\n", frame.length(-size * draw.between(0.1, 1.0))),
            1 => format!("gap_offset = {}\n", frame.length(size * draw.between(0.1, 1.0))),
            2 => format!("gap = {}\n", frame.length(size * draw.between(-1.0, 1.0))),
            _ => String::new(),
        };
        text += &contact(&format!("c{i}"), sides, &rest);
        if !driven {
            let above: f64 = blocks[i..].iter().map(|b| weight * b.width() * b.height()).sum();
            let weight = if gravity { above } else { 0.0 };
            let force = (pressure * blocks[n - 1].width() + weight) * head.thickness;
            let relative = if head.tolerance == "\"auto\"" { 1e-3 } else { 1e-6 };
            expect.push(Expect::Force { pair: format!("c{i}"), value: frame.force(force), relative });
        }
    }
    let stepped = draw.chance(0.15);
    if stepped {
        text += "[[step]]\nloads = 0.4\nsupports = 0.6\n[[step]]\n";
    }
    let mut twins = vec![Twin::Ranks];
    twins.push(draw.pick(&[&Twin::Solver, &Twin::Condensed, &Twin::Scaled(1e3, 1e-6)]).clone());
    if stepped {
        twins.push(Twin::LastStep);
    }
    // Mortar on lines of the same nodes is node to node where shape functions are linear.
    let linear = blocks.iter().all(|b| b.element == "tri3" || b.element == "quad4");
    let dense = head.pointwise || (matching || rigid_floor && n == 1) && linear;
    Scene { family: "stack", text, expect, twins, dense }
}

/// A thin foil between two blocks, interference on both faces: the pressure is uniform.
pub fn foil(draw: &mut Draw, mut frame: Frame) -> Scene {
    frame.degrees = if draw.chance(0.3) { draw.between(-180.0, 180.0) } else { 0.0 };
    let head = Head { pointwise: false, tolerance: "1e-10", ..Head::draw(draw) };
    let w = draw.log(1e-3, 1.0);
    let young = young(draw);
    let heights = [w * draw.between(0.2, 1.0), w * draw.log(1e-4, 1e-1), w * draw.between(0.2, 1.0)];
    let mut bottom = 0.0;
    let mut compliance = 0.0;
    let interference = [w, w].map(|w| w * draw.log(1e-7, 1e-5));
    let mut text = head.text("foil", &frame);
    for (i, height) in heights.into_iter().enumerate() {
        let material = Material { young: young(draw), poisson: 0.0, expansion: 0.0 };
        compliance += height / material.young;
        let cells = [draw.whole(1, 40), if i == 1 { draw.whole(1, 2) } else { draw.whole(1, 6) }];
        let element = draw.pick(&ELEMENTS);
        let block = Block { x: [0.0, w], y: [bottom, bottom + height], cells, element, material };
        bottom += height;
        text += &block.text(&format!("b{i}"), &frame);
        text += &support("left", "x", "0", &frame);
        match i {
            0 => text += &support("bottom", "y", "0", &frame),
            2 => text += &support("top", "y", "0", &frame),
            _ => {}
        }
    }
    let pressure = frame.pressure((interference[0] + interference[1]) / compliance);
    let value = pressure.parse().expect("a number");
    let mut expect = Vec::new();
    for (i, d) in interference.into_iter().enumerate() {
        let offset = format!("gap_offset = {}\n", frame.length(-d));
        let sides = [format!("b{i}.top"), format!("b{}.bottom", i + 1)];
        let sides = if draw.chance(0.5) { [&sides[0][..], &sides[1]] } else { [&sides[1][..], &sides[0]] };
        text += &contact(&format!("c{i}"), sides, &offset);
        expect.push(Expect::Uniform { pair: format!("c{i}"), value, relative: 1e-6 });
    }
    Scene { family: "foil", text, expect, twins: vec![Twin::Ranks, Twin::Swap(1e-6)], dense: false }
}

/// A block on two others that share a corner, under a uniform pressure: it stays uniform.
pub fn shared(draw: &mut Draw, frame: Frame) -> Scene {
    let head = Head { pointwise: false, tolerance: "1e-10", ..Head::draw(draw) };
    let (w, h) = (draw.log(1e-3, 1.0), draw.between(0.3, 1.0));
    let joint = w * draw.between(0.25, 0.75);
    let element = draw.pick(&ELEMENTS);
    let e = draw.log(1e6, 1e12);
    let material = Material { young: e, poisson: 0.0, expansion: 0.0 };
    let pressure = e * draw.log(1e-6, 1e-3);
    let mut text = head.text("shared", &frame);
    let xs = [[0.0, joint], [joint, w], [0.0, w]];
    let names = ["left", "right", "upper"];
    let mut expect = Vec::new();
    for (name, x) in std::iter::zip(names, xs) {
        let y = if name == "upper" { [h * w, 1.6 * h * w] } else { [0.0, h * w] };
        let cells = [draw.whole(1, 16), draw.whole(1, 5)];
        text += &Block { x, y, cells, element, material }.text(name, &frame);
        if name == "upper" {
            text += &point_support([0.0, y[1]], "x", &frame);
            let _ =
                write!(text, "[[body.load]]\nsurface = \"top\"\npressure = {}\n", frame.pressure(pressure));
        } else {
            text += &support("bottom", "y", "0", &frame);
            text += &point_support([x[0], 0.0], "x", &frame);
            let value = frame.force(pressure * (x[1] - x[0]) * head.thickness);
            expect.push(Expect::Force { pair: name.into(), value, relative: 1e-6 });
            let value = frame.pressure(pressure).parse().expect("a number");
            expect.push(Expect::Uniform { pair: name.into(), value, relative: 1e-6 });
        }
    }
    text += &contact("left", ["upper.bottom", "left.top"], "");
    text += &contact("right", ["right.top", "upper.bottom"], "");
    Scene { family: "shared", text, expect, twins: vec![Twin::Ranks], dense: false }
}

/// A block between two rigid stops, pushed to and fro.
pub fn stops(draw: &mut Draw, frame: Frame) -> Scene {
    let head = Head::draw(draw);
    let (w, e) = (draw.log(1e-3, 1.0), draw.log(1e6, 1e12));
    let element = draw.pick(&ELEMENTS);
    let material = Material::draw(draw, e, element);
    let height = w * draw.log(0.3, 3.0);
    let cells = [draw.whole(2, 10), draw.whole(2, 8)];
    let traction = e * draw.log(1e-6, 1e-4);
    let gap = if draw.chance(0.5) { 0.0 } else { w * draw.log(1e-7, 1e-5) };
    let block = Block { x: [-0.5 * w, 0.5 * w], y: [0.0, height], cells, element, material };
    let mut text = head.text("stops", &frame) + &block.text("block", &frame);
    text += &point_support([-0.5 * w, 0.0], "x", &frame);
    let _ = write!(
        text,
        "[[body.load]]\nsurface = \"{}\"\ntraction = [0, {}]\n",
        draw.pick(&["left", "right", "top"]),
        frame.pressure(-traction)
    );
    let loaded = if text.contains("surface = \"top\"") { w } else { height };
    // A side pushed along its length turns the block: hold the other component of both ends of it.
    if loaded == height {
        text += &point_support([-0.5 * w, height], "x", &frame);
    }
    for (name, y, normal) in [("low", -gap, 1.0), ("high", height + gap, -1.0)] {
        let [through, normal] = [frame.point([0.0, y]), frame.direction([0.0, normal])];
        let _ = write!(
            text,
            "[[body]]\nname = \"{name}\"\nrigid.plane = {{ through = {through}, normal = {normal} }}\n"
        );
    }
    text += &contact("low", ["block.bottom", "low.surface"], "");
    text += &contact("high", ["high.surface", "block.top"], "");
    // Weighted gaps are those of the nodes where shape functions are linear.
    let dense = matches!(element, "tri3" | "quad4");
    let factors: Vec<f64> =
        (0..draw.whole(2, 4)).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 } * draw.between(0.3, 1.0)).collect();
    let mut expect = Vec::new();
    let force = frame.force(traction * loaded * head.thickness);
    for (step, factor) in factors.iter().enumerate() {
        let _ = write!(text, "[[step]]\nloads = {factor:?}\n");
        let relative = if head.tolerance == "\"auto\"" { 1e-3 } else { 1e-6 };
        expect.push(Expect::StepForce { step, pairs: ["low", "high"], value: force * factor, relative });
    }
    Scene { family: "stops", text, expect, twins: vec![Twin::LastStep, Twin::Ranks], dense }
}

/// A square block in a V of two rigid planes, held by its weight: each face carries the weight over the root of two.
pub fn wedge(draw: &mut Draw, frame: Frame) -> Scene {
    let head = Head::draw(draw);
    let (w, e) = (draw.log(1e-3, 1.0), draw.log(1e6, 1e12));
    let element = draw.pick(&ELEMENTS);
    let mut material = Material::draw(draw, e, element);
    if element == "tri6" {
        material.poisson = 0.3;
    }
    let cells = [draw.whole(2, 10), draw.whole(2, 10)];
    let weight = e * draw.log(1e-7, 1e-4) / w;
    let block = Block { x: [0.0, w], y: [0.0, w], cells, element, material };
    let frame = Frame { degrees: 45.0, ..frame };
    let mut text = head.text("wedge", &frame) + &block.text("block", &frame);
    let half = 0.5_f64.sqrt();
    // Down in the axes of the case.
    let _ =
        write!(text, "[[body.load]]\nbody_force = {}\n", frame.per_volume([-weight * half, -weight * half]));
    for (name, normal) in [("left", [1.0, 0.0]), ("right", [0.0, 1.0])] {
        let normal = frame.direction(normal);
        let _ = write!(
            text,
            "[[body]]\nname = \"{name}\"\nrigid.plane = {{ through = [0, 0], normal = {normal} }}\n"
        );
    }
    text += &contact("a", ["block.left", "left.surface"], "");
    text += &contact("b", ["right.surface", "block.bottom"], "");
    let value = frame.force(weight * w * w * head.thickness * half);
    let relative = if head.tolerance == "\"auto\"" { 1e-3 } else { 1e-6 };
    let expect = ["a", "b"].map(|pair| Expect::Force { pair: pair.into(), value, relative }).into();
    Scene { family: "wedge", text, expect, twins: vec![Twin::Ranks], dense: true }
}
