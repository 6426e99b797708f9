//! One Hertz case with each effect on or off: two half discs, or a half disc on a rigid one.
#![allow(dead_code)]

use std::fmt::Write;

/// What the case has; by default contact of two bodies that stay cold, and nothing else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    pub contact: Contact,
    /// The second body is a rigid disc.
    pub rigid: bool,
    pub heat: Heat,
    pub geometry: Option<&'static str>,
    /// Number of load steps; `None`: no table of them.
    pub steps: Option<usize>,
    /// Size of the mesh: 1 has about 4800 unknowns, half of it four times as many.
    pub size: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Contact {
    /// No `[[contact]]`.
    None,
    /// A pair too far apart to touch.
    Apart,
    Closed,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Heat {
    /// No word of it.
    None,
    /// The material expands, but no body has a temperature.
    Expansion,
    /// Both bodies at the temperature without thermal strain.
    Neutral,
    Uniform,
    /// Uniform, with Young's modulus from a table in which it is constant, or falls.
    Table {
        falling: bool,
    },
}

impl Default for Scene {
    fn default() -> Scene {
        Scene {
            contact: Contact::Closed,
            rigid: false,
            heat: Heat::None,
            geometry: None,
            steps: None,
            size: 1.0,
        }
    }
}

/// Displacement of the flats, m.
const LIFT: f64 = 1.501341e-5;
/// Temperature without thermal strain and of the heated bodies, K.
const COLD: f64 = 293.0;
const HOT: f64 = 313.0;

impl Scene {
    /// The case file.
    pub fn text(&self) -> String {
        let mut text = String::from("analysis = \"plane strain\"\n\n[material.steel]\npoisson = 0.3\n");
        match self.heat {
            Heat::Table { falling } => {
                let hot = if falling { "1.9e11" } else { "2.1e11" };
                let _ =
                    writeln!(text, "young = {{ temperature = [{COLD}, {HOT}], value = [2.1e11, {hot}] }}");
            }
            _ => text += "young = 2.1e11\n",
        }
        if self.heat != Heat::None {
            let _ = writeln!(text, "expansion = 12e-6\nreference_temperature = {COLD}");
        }
        text += &self.body("upper", 1.0);
        if self.rigid {
            let _ = writeln!(
                text,
                "\n[[body]]\nname = \"lower\"\nrigid = {{ circle = {{ center = [0, -0.05], radius = 0.05 }}, y = {LIFT} }}"
            );
        } else {
            text += &self.body("lower", -1.0);
        }
        if self.contact != Contact::None {
            let lower = if self.rigid { "lower.surface" } else { "lower.arc" };
            let _ =
                writeln!(text, "\n[[contact]]\nname = \"contact\"\nsurfaces = [\"upper.arc\", \"{lower}\"]");
            if self.contact == Contact::Apart {
                text += "gap = 1e-3\n";
            }
            if let Some(geometry) = self.geometry {
                let _ = writeln!(text, "geometry = \"{geometry}\"");
            }
        }
        text += "\n[alternation]\ntolerance = 1e-8\n";
        let n = self.steps.unwrap_or(0);
        for step in 1..=n {
            let _ = writeln!(text, "\n[[step]]\nsupports = {}", step as f64 / n as f64);
        }
        text
    }

    /// A half disc; `up`: 1 if it lies above the contact.
    fn body(&self, name: &str, up: f64) -> String {
        let h = self.size;
        let (center, lift, arc) = (0.05 * up, -LIFT * up, if up > 0.0 { "down" } else { "up" });
        let (fine, coarse) = (0.14 * h, 11.3 * h);
        let mut text = format!(
            "\n[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\n\
             mesh.half_disc = {{ center = [0, {center}], radius = 0.05, arc = \"{arc}\", angle = {{ at = [-45, -1.2, 0, 1.2, 45], \
             size = [{coarse}, {fine}, {fine}, {fine}, {coarse}] }}, depth = {{ at = [0, 0.02, 0.6], size = [{0:e}, {0:e}, {1}] }}, \
             core = {2} }}\n\
             support = [{{ surface = \"flat\", y = {lift:e} }}, {{ point = [0, {center}], x = 0 }}]\n",
            2.5e-3 * h,
            0.23 * h,
            (2.0 / h).round().max(1.0)
        );
        match self.heat {
            Heat::None | Heat::Expansion => {}
            Heat::Neutral => drop(writeln!(text, "temperature = {COLD}")),
            Heat::Uniform | Heat::Table { .. } => drop(writeln!(text, "temperature = {HOT}")),
        }
        text
    }
}
