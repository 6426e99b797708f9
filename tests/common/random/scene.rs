//! What a scene is: the text of its case and what must be true of its answer.
use super::draw::Draw;
use std::fmt::Write;

/// What is known of the answer.
pub enum Expect {
    /// Normal force of a pair, N, by statics or a closed form.
    Force { pair: String, value: f64, relative: f64 },
    /// Largest pressure of a pair, Pa.
    Peak { pair: String, value: f64, relative: f64 },
    /// Pressure at every closed node of a pair, Pa.
    Uniform { pair: String, value: f64, relative: f64 },
    /// Difference of the normal forces of two pairs in a step, N.
    StepForce { step: usize, pairs: [&'static str; 2], value: f64, relative: f64 },
}

/// The case once more, changed in a way that must not matter.
#[derive(Clone)]
pub enum Twin {
    /// On two ranks.
    Ranks,
    /// The sides of all pairs swapped; equal only to the discretisation, this part of the forces.
    Swap(f64),
    /// All bodies answer by their solver.
    Solver,
    /// All bodies condensed.
    Condensed,
    /// The last step alone.
    LastStep,
    /// Lengths times the first factor, moduli and pressures times the second, in consistent units.
    Scaled(f64, f64),
    /// With `geometry = "updated"`: displacements are small, so this part of the forces.
    Updated(f64),
}

/// A random scene.
pub struct Scene {
    /// Its family.
    pub family: &'static str,
    /// The case file.
    pub text: String,
    /// What is known.
    pub expect: Vec<Expect>,
    /// Which twins to run.
    pub twins: Vec<Twin>,
    /// True if all pairs are straight and node meets node or facet: the dense solution is that of the same problem.
    pub dense: bool,
}

/// The frame and the units a scene is written in: everything is drawn in SI units in axes of its own.
pub struct Frame {
    /// From the scene's x axis to that of the case, degrees.
    pub degrees: f64,
    /// Factors on lengths and pressures.
    pub units: [f64; 2],
}

impl Frame {
    /// A vector in the axes of the case, without units.
    pub fn turned(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        if self.degrees == 0.0 {
            return [x, y];
        }
        let (s, c) = self.degrees.to_radians().sin_cos();
        [c * x - s * y, s * x + c * y]
    }

    /// A point.
    pub fn point(&self, p: [f64; 2]) -> String {
        let [x, y] = self.turned(p);
        format!("[{:?}, {:?}]", x * self.units[0], y * self.units[0])
    }

    /// A direction.
    pub fn direction(&self, d: [f64; 2]) -> String {
        let [x, y] = self.turned(d);
        format!("[{x:?}, {y:?}]")
    }

    /// A length.
    pub fn length(&self, value: f64) -> String {
        format!("{:?}", value * self.units[0])
    }

    /// A pressure or modulus.
    pub fn pressure(&self, value: f64) -> String {
        format!("{:?}", value * self.units[1])
    }

    /// A vector of forces per volume.
    pub fn per_volume(&self, b: [f64; 2]) -> String {
        let [x, y] = self.turned(b).map(|b| b * self.units[1] / self.units[0]);
        format!("[{x:?}, {y:?}]")
    }

    /// Newtons in the units of the case.
    pub fn force(&self, value: f64) -> f64 {
        value * self.units[1] * self.units[0] * self.units[0]
    }

    /// `angle = ...` of a support, if the frame is turned.
    pub fn angle(&self) -> String {
        if self.degrees == 0.0 { String::new() } else { format!(", angle = {:?}", self.degrees) }
    }

    /// The scene's coordinate along x as an expression of the case's.
    pub fn along(&self) -> String {
        let (s, c) = self.degrees.to_radians().sin_cos();
        if self.degrees == 0.0 { "x".into() } else { format!("({c:?}*x + ({s:?})*y)") }
    }
}

/// A material.
#[derive(Clone, Copy)]
pub struct Material {
    pub young: f64,
    pub poisson: f64,
    pub expansion: f64,
}

/// The beginning of a case: title, units, analysis, alternation.
pub struct Head {
    pub plane_strain: bool,
    pub thickness: f64,
    pub pointwise: bool,
    pub tolerance: &'static str,
}

impl Head {
    /// Draws one.
    pub fn draw(draw: &mut Draw) -> Head {
        Head {
            plane_strain: draw.chance(0.5),
            thickness: if draw.chance(0.5) { 1.0 } else { draw.log(1e-4, 1e2) },
            pointwise: draw.chance(0.25),
            tolerance: draw.pick(&["1e-10", "1e-8", "1e-9", "\"auto\""]),
        }
    }

    /// Its text.
    pub fn text(&self, family: &str, frame: &Frame) -> String {
        let units = if frame.units == [1.0; 2] { "" } else { "units = \"consistent\"\n" };
        let analysis = if self.plane_strain { "plane strain" } else { "plane stress" };
        let thickness = frame.length(self.thickness);
        let mut text =
            format!("title = \"{family}\"\n{units}analysis = \"{analysis}\"\nthickness = {thickness}\n");
        let _ = writeln!(text, "[alternation]\ntolerance = {}", self.tolerance);
        if self.pointwise {
            text += "transfer = \"pointwise\"\n";
        }
        text
    }

    /// E' and nu' of the plane problem.
    pub fn plane(&self, m: &Material) -> [f64; 2] {
        if self.plane_strain {
            [m.young / (1.0 - m.poisson * m.poisson), m.poisson / (1.0 - m.poisson)]
        } else {
            [m.young, m.poisson]
        }
    }
}

impl Material {
    /// Poisson's ratio up to what the element takes.
    pub fn draw(draw: &mut Draw, young: f64, element: &str) -> Material {
        let any = draw.between(0.0, 0.45);
        let rubber = if element == "tri3" { 0.45 } else { 0.4999 };
        let poisson = draw.pick(&[0.0, 0.3, 0.3, any, any, rubber]);
        Material { young, poisson, expansion: 0.0 }
    }

    /// Its table, as the material of body `name`.
    pub fn text(&self, name: &str, frame: &Frame) -> String {
        let mut text = format!(
            "[material.{name}]\nyoung = {}\npoisson = {:?}\n",
            frame.pressure(self.young),
            self.poisson
        );
        if self.expansion != 0.0 {
            let _ = write!(text, "expansion = {:?}\nreference_temperature = 293\n", self.expansion);
        }
        text
    }
}

/// Element kinds.
pub const ELEMENTS: [&str; 4] = ["tri3", "tri6", "quad4", "quad8"];

/// `[[body]]` up to its mesh.
pub fn body(name: &str, element: &str, mesh: &str, frame: &Frame) -> String {
    let turn =
        if frame.degrees == 0.0 { String::new() } else { format!("mesh.rotate = {:?}\n", frame.degrees) };
    format!(
        "[[body]]\nname = \"{name}\"\nmaterial = \"{name}\"\nelement = \"{element}\"\nmesh.{mesh}\n{turn}"
    )
}

/// `[[contact]]` between two surfaces.
pub fn contact(name: &str, sides: [&str; 2], rest: &str) -> String {
    format!("[[contact]]\nname = \"{name}\"\nsurfaces = [\"{}\", \"{}\"]\n{rest}", sides[0], sides[1])
}
