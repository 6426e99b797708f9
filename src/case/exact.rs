//! `[exact]`: what is known of the solution, for `kontakt study` to measure errors against.
use super::nearest;
use super::reader::Fields;
use super::{ContactCase, Origin, ProbeCase};

/// What is known of the solution.
#[derive(Debug, Clone)]
pub struct ExactCase {
    /// Index of the pair that force, pressure and length are of; `None`: nothing is known of them.
    pub pair: Option<usize>,
    /// Normal force, N.
    pub force: Option<f64>,
    /// Peak pressure, Pa.
    pub peak_pressure: Option<f64>,
    /// Length in contact, m.
    pub contact_length: Option<f64>,
    /// Index of a probe, and what is known there.
    pub probes: Vec<(usize, ExactProbe)>,
    /// A solution in closed form, for what is not given as a number.
    pub solution: Option<ClosedForm>,
    /// Where it is written.
    pub origin: Origin,
}

/// What is known at a probe.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExactProbe {
    /// Displacement along x and y, m.
    pub displacement: Option<[f64; 2]>,
    /// Stresses xx, yy, zz, xy, Pa.
    pub stress: Option<[f64; 4]>,
}

/// A solution in closed form. Materials, gap and analysis are those of the case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClosedForm {
    /// Hertz' contact of two cylinders along a line, both half-spaces to the contact.
    HertzLine {
        /// 1/R of the gap, the sum of both sides' curvatures, 1/m.
        curvature: f64,
        /// Total force or half-width.
        load: HertzLoad,
    },
    /// Lame: two rings joined with an interference, side A the inner one.
    PressFit {
        /// Bore, interface, rim, m.
        radii: [f64; 3],
        /// Radial interference, m.
        interference: f64,
        /// Common centre, m.
        center: [f64; 2],
    },
    /// Two uniformly heated blocks between rigid walls, free to slide along them.
    HeatedBlocks {
        /// Heights of the blocks of side A and B, m.
        heights: [f64; 2],
        /// Width of the contact, m.
        width: f64,
    },
}

/// What says how hard two cylinders are pressed together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HertzLoad {
    /// Force over the whole thickness, N.
    Force(f64),
    /// Half-width of the contact, m.
    HalfWidth(f64),
}

const FORMS: [&str; 3] = ["hertz_line", "press_fit", "heated_blocks"];

/// Reads `[exact]`; `None` if it is not there, or wrong.
pub(super) fn read(
    case: &Fields<'_>,
    contacts: Option<&[ContactCase]>,
    probes: Option<&[ProbeCase]>,
) -> Option<ExactCase> {
    let fields = case.table("exact")?;
    let positive = |key| fields.number_if(key, |value| value > 0.0, "must be > 0");
    let (force, peak_pressure) = (positive("force"), positive("peak_pressure"));
    let (length, half_width) = (positive("contact_length"), positive("half_width"));
    if fields.has("contact_length") && fields.has("half_width") {
        fields.error_at(
            "half_width",
            "'contact_length' is given as well, which is twice that; give one of the two",
        );
    }
    let solution = closed_form(&fields);
    let of_contact = ["force", "peak_pressure", "contact_length", "half_width"];
    let given = fields.given(&[&of_contact[..], &FORMS[..]].concat());
    if let (Some(key), Some([])) = (given.first(), contacts) {
        fields.error_at(key, "the case has no [[contact]]");
    }
    if given.is_empty() && !fields.has("probe") {
        fields.error("nothing is given; 'peak_pressure', a 'probe', 'hertz_line' ...");
    }
    let pair = match given.is_empty() && !fields.has("pair") {
        true => None,
        false => pair(&fields, contacts),
    };
    Some(ExactCase {
        pair,
        force,
        peak_pressure,
        contact_length: length.or(half_width.map(|a| 2.0 * a)),
        probes: read_probes(&fields, probes),
        solution,
        origin: fields.origin(),
    })
}

/// The pair: named, or the only one.
fn pair(fields: &Fields<'_>, contacts: Option<&[ContactCase]>) -> Option<usize> {
    let name = fields.text("pair");
    let contacts = contacts?;
    match name {
        Some(name) => contacts.iter().position(|c| c.name == name).or_else(|| {
            let names: Vec<&str> = contacts.iter().map(|c| c.name.as_str()).collect();
            let hint = nearest::hint(name, &names);
            fields.field("pair")?.refuse(format!("there is no such pair; {}", hint.trim_end()))
        }),
        None if contacts.len() > 1 => {
            fields.error("the case has several pairs; 'pair' must say which one this is about");
            None
        }
        None => (!contacts.is_empty()).then_some(0),
    }
}

fn read_probes(fields: &Fields<'_>, probes: Option<&[ProbeCase]>) -> Vec<(usize, ExactProbe)> {
    let mut read = Vec::new();
    for (name, field) in fields.named("probe") {
        let Some(known) = fields.reader.open("exact.probe", field.node, &field.path) else { continue };
        let displacement = group(&known, ["x", "y"]);
        let stress = group(&known, ["xx", "yy", "zz", "xy"]);
        if known.given(&["x", "y", "xx", "yy", "zz", "xy"]).is_empty() {
            known.error("nothing is given; { x = 1e-5, y = 0 }");
        }
        let Some(probes) = probes else { continue };
        match probes.iter().position(|probe| probe.name == name) {
            Some(probe) => read.push((probe, ExactProbe { displacement, stress })),
            None => {
                let names: Vec<&str> = probes.iter().map(|probe| probe.name.as_str()).collect();
                let hint = nearest::hint(name, &names);
                known.error(format!("there is no probe '{name}'; {}", hint.trim_end()));
            }
        }
    }
    read
}

/// Numbers that belong together: all or none.
fn group<const N: usize>(fields: &Fields<'_>, keys: [&str; N]) -> Option<[f64; N]> {
    let values = keys.map(|key| fields.number(key));
    let given = fields.given(&keys);
    if !given.is_empty() && given.len() < N {
        fields.error(format!("'{}' belong together; give all of them or none", keys.join("', '")));
    }
    let mut all = [0.0; N];
    for (to, value) in all.iter_mut().zip(values) {
        *to = value?;
    }
    Some(all)
}

fn closed_form(fields: &Fields<'_>) -> Option<ClosedForm> {
    let forms =
        [fields.table("hertz_line").map(|t| hertz(&t)), fields.table("press_fit").map(|t| press_fit(&t)), {
            fields.table("heated_blocks").map(|t| heated_blocks(&t))
        }];
    if let [_, second, ..] = fields.given(&FORMS)[..] {
        fields.error_at(second, "another closed form is given as well; a case has one solution");
    }
    forms.into_iter().flatten().next()?
}

fn hertz(fields: &Fields<'_>) -> Option<ClosedForm> {
    let radii = fields.numbers("radius");
    let positive = |key| fields.number_if(key, |value| value > 0.0, "must be > 0");
    let (force, half_width) = (positive("force"), positive("half_width"));
    let load = match (force, half_width) {
        (Some(force), None) => Some(HertzLoad::Force(force)),
        (None, Some(a)) => Some(HertzLoad::HalfWidth(a)),
        _ => {
            fields.error("one of 'force' and 'half_width' is needed");
            None
        }
    };
    let radii = radii?;
    let curvature: f64 = radii.iter().map(|r| 1.0 / r).sum();
    if !(1..=2).contains(&radii.len()) || !curvature.is_finite() || curvature <= 0.0 {
        return fields.field("radius")?.refuse(
            "one or two radii are needed; a flat side is left out, a hollow one has a negative radius, the larger one",
        );
    }
    Some(ClosedForm::HertzLine { curvature, load: load? })
}

fn press_fit(fields: &Fields<'_>) -> Option<ClosedForm> {
    let interference = fields.number_if("interference", |value| value > 0.0, "must be > 0");
    let center = fields.point("center").unwrap_or([0.0; 2]);
    let radii = fields.numbers("radii")?;
    match radii[..] {
        [a, b, c] if 0.0 <= a && a < b && b < c => {
            Some(ClosedForm::PressFit { radii: [a, b, c], interference: interference?, center })
        }
        _ => {
            fields.field("radii")?.refuse("bore, interface and rim are needed, increasing: [0.05, 0.1, 0.15]")
        }
    }
}

fn heated_blocks(fields: &Fields<'_>) -> Option<ClosedForm> {
    let width = fields.number_if("width", |value| value > 0.0, "must be > 0");
    let heights = fields.numbers("heights")?;
    match heights[..] {
        [a, b] if a > 0.0 && b > 0.0 => Some(ClosedForm::HeatedBlocks { heights: [a, b], width: width? }),
        _ => {
            fields.field("heights")?.refuse("the heights of the blocks of side A and B are needed, both > 0")
        }
    }
}
