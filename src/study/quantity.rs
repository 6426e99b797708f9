//! The numbers of a run whose errors a study measures, taken from its `summary.json`.
use crate::case::{QUANTITIES_OF_PAIR, QUANTITIES_OF_PROBE, STRAIN_ENERGY};
use crate::vector::larger;
use serde_json::Value;

/// Components below this part of the largest of their kind are zero to round-off, and have no relative error.
const NOTHING: f64 = 1e-9;

/// Names of the components of vectors and of stresses.
const AXES: [&str; 2] = ["x", "y"];
const STRESSES: [&str; 4] = ["xx", "yy", "zz", "xy"];

/// A number, or a vector of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Quantity {
    /// `pair.peak_pressure`, `probe.displacement`.
    pub name: String,
    pub unit: &'static str,
    pub values: Vec<f64>,
}

impl Quantity {
    fn new(owner: &str, what: &str, unit: &'static str, values: Vec<f64>) -> Self {
        Quantity { name: format!("{owner}.{what}"), unit, values }
    }
}

/// All quantities of a run, those that are zero to round-off left out.
pub(super) fn quantities(summary: &Value) -> Vec<Quantity> {
    let mut all = Vec::new();
    let list = |key: &str| summary[key].as_array().cloned().unwrap_or_default();
    let number = |value: &Value| value.as_f64().map(|value| vec![value]);
    for pair in list("pairs") {
        let name = pair["name"].as_str().unwrap_or_default();
        let numbers = [
            ("peak_pressure", "max_pressure", "Pa"),
            ("force", "normal_force", "N"),
            ("contact_length", "contact_length", "m"),
        ];
        for (what, key, unit) in numbers {
            all.extend(number(&pair[key]).map(|values| Quantity::new(name, what, unit, values)));
        }
    }
    for probe in list("probes") {
        let name = probe["name"].as_str().unwrap_or_default();
        let u: Option<Vec<f64>> =
            probe["displacement"].as_array().and_then(|u| u.iter().take(2).map(Value::as_f64).collect());
        let stress: Option<Vec<f64>> = STRESSES.iter().map(|key| probe["stress"][key].as_f64()).collect();
        let vectors = [("displacement", "m", u), ("stress", "Pa", stress)];
        for (what, unit, values) in vectors {
            all.extend(values.map(|values| Quantity::new(name, what, unit, values)));
        }
    }
    let parts: Vec<Quantity> = all.iter().flat_map(|q| parts(&q.name, &q.values, q.unit)).collect();
    all.extend(parts);
    let mut total = None;
    for body in list("bodies") {
        let name = body["name"].as_str().unwrap_or_default();
        if let Some(energy) = body[STRAIN_ENERGY].as_f64() {
            all.push(Quantity::new(name, STRAIN_ENERGY, "J", vec![energy]));
            *total.get_or_insert(0.0) += energy;
        }
    }
    all.extend(total.map(|sum| Quantity { name: STRAIN_ENERGY.into(), unit: "J", values: vec![sum] }));
    let largest =
        |unit: &str| all.iter().filter(|q| q.unit == unit).map(|q| norm(&q.values)).fold(0.0, larger);
    let units = ["Pa", "N", "m", "J"].map(|unit| (unit, largest(unit)));
    let matters = |q: &Quantity| {
        let scale = units.iter().find(|(unit, _)| *unit == q.unit).map_or(0.0, |(_, scale)| *scale);
        norm(&q.values) > NOTHING * scale
    };
    all.into_iter().filter(matters).collect()
}

/// The components of a vector or stress as quantities of their own, and the equivalent stress.
pub(super) fn parts(name: &str, values: &[f64], unit: &'static str) -> Vec<Quantity> {
    let names: &[&str] = match name.rsplit_once('.') {
        Some((_, "displacement")) => &AXES,
        Some((_, "stress")) => &STRESSES,
        _ => &[],
    };
    let mut parts: Vec<Quantity> =
        names.iter().zip(values).map(|(part, value)| Quantity::new(name, part, unit, vec![*value])).collect();
    if let ([_, _, _, _], &[xx, yy, zz, xy]) = (names, values) {
        parts.push(Quantity::new(name, "von_mises", unit, vec![von_mises([xx, yy, zz, xy])]));
    }
    parts
}

/// True for a component or the equivalent stress, whose vector or stress is a quantity itself.
pub(super) fn is_part(name: &str) -> bool {
    let ends = |part: &&str| name.strip_suffix(*part).is_some_and(|rest| rest.ends_with('.'));
    QUANTITIES_OF_PROBE.iter().filter(|what| what.contains('.')).any(ends)
}

/// sqrt(((xx - yy)^2 + (yy - zz)^2 + (zz - xx)^2) / 2 + 3 xy^2).
fn von_mises([xx, yy, zz, xy]: [f64; 4]) -> f64 {
    let squares = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * squares + 3.0 * xy * xy).sqrt()
}

/// Euclidean norm.
pub(super) fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Difference of two vectors.
pub(super) fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// `peak pressure` for `contact.peak_pressure`; with its owner if `full`. Names of pairs may have dots themselves.
pub(super) fn spoken(name: &str, full: bool) -> String {
    let ends = |what: &&&str| name.strip_suffix(**what).is_some_and(|rest| rest.ends_with('.'));
    let of = |what: &str| name[..name.len() - what.len()].trim_end_matches('.').to_string();
    if let Some(what) = QUANTITIES_OF_PROBE.iter().rfind(ends) {
        let words = match what.split_once('.') {
            Some((_, "von_mises")) => "von Mises stress".to_string(),
            Some((kind, part)) => format!("{kind} {part}"),
            None => what.to_string(),
        };
        return format!("{words} at {}", of(what));
    }
    let words = |what: &str| what.replace('_', " ");
    match QUANTITIES_OF_PAIR.iter().find(ends) {
        Some(what) if full => format!("{} of {}", words(what), of(what)),
        Some(what) => words(what),
        None => match name.strip_suffix(STRAIN_ENERGY).filter(|rest| rest.ends_with('.')) {
            Some(_) => format!("{} of {}", words(STRAIN_ENERGY), of(STRAIN_ENERGY)),
            None => words(name),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_is_zero_to_round_off_is_left_out() {
        let summary = json!({
            "pairs": [{ "name": "p", "normal_force": 2.0, "max_pressure": 1e8, "contact_length": 0.1 }],
            "probes": [
                { "name": "a", "displacement": [0.0, 1e-5, 0.0], "stress": { "xx": 1e-3, "yy": 0.0, "zz": 0.0, "xy": 0.0 } },
                { "name": "b", "displacement": [1e-20, 0.0, 0.0], "stress": { "xx": 1e6, "yy": 0.0, "zz": 0.0, "xy": 0.0 } },
            ],
            "bodies": [{ "name": "u", "strain_energy": 3.0 }, { "name": "v", "strain_energy": 1.0 }],
        });
        let all = quantities(&summary);
        let names: Vec<&str> = all.iter().map(|q| &q.name[..]).collect();
        let expected = [
            "p.peak_pressure",
            "p.force",
            "p.contact_length",
            "a.displacement",
            "b.stress",
            "a.displacement.y",
            "b.stress.xx",
            "b.stress.von_mises",
            "u.strain_energy",
            "v.strain_energy",
            "strain_energy",
        ];
        assert_eq!(names, expected);
        assert_eq!(all.last().unwrap().values, [4.0]);
    }

    #[test]
    fn names_are_spoken() {
        for (name, full, words) in [
            ("p.peak_pressure", false, "peak pressure"),
            ("p.peak_pressure", true, "peak pressure of p"),
            ("a.top-b.bottom.force", true, "force of a.top-b.bottom"),
            ("tip.displacement", false, "displacement at tip"),
            ("tip.displacement.y", false, "displacement y at tip"),
            ("tip.stress.xy", true, "stress xy at tip"),
            ("tip.stress.von_mises", true, "von Mises stress at tip"),
            ("u.strain_energy", true, "strain energy of u"),
            ("strain_energy", false, "strain energy"),
        ] {
            assert_eq!(spoken(name, full), words);
            assert_eq!(is_part(name), name.starts_with("tip.") && name.matches('.').count() == 2);
        }
    }

    /// Uniaxial, pure shear, hydrostatic.
    #[test]
    fn equivalent_stress() {
        assert_eq!(von_mises([-2.0, 0.0, 0.0, 0.0]), 2.0);
        assert!((von_mises([0.0, 0.0, 0.0, 1.0]) - 3f64.sqrt()).abs() < 1e-15);
        assert_eq!(von_mises([5.0, 5.0, 5.0, 0.0]), 0.0);
    }
}
