//! The numbers of a run whose errors a study measures, taken from its `summary.json`.
use crate::vector::larger;
use serde_json::Value;

/// Components below this part of the largest of their kind are zero to round-off, and have no relative error.
const NOTHING: f64 = 1e-9;

/// A number, or a vector of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Quantity {
    /// `pair.peak_pressure`, `probe.displacement`.
    pub name: String,
    pub unit: &'static str,
    /// Names of the components; empty for a number.
    pub components: &'static [&'static str],
    pub values: Vec<f64>,
}

impl Quantity {
    fn new(
        owner: &str,
        what: &str,
        unit: &'static str,
        components: &'static [&'static str],
        values: Vec<f64>,
    ) -> Self {
        Quantity { name: format!("{owner}.{what}"), unit, components, values }
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
            all.extend(number(&pair[key]).map(|values| Quantity::new(name, what, unit, &[], values)));
        }
    }
    for probe in list("probes") {
        let name = probe["name"].as_str().unwrap_or_default();
        let u: Option<Vec<f64>> =
            probe["displacement"].as_array().and_then(|u| u.iter().take(2).map(Value::as_f64).collect());
        all.extend(u.map(|u| Quantity::new(name, "displacement", "m", &["x", "y"], u)));
        const STRESSES: [&str; 4] = ["xx", "yy", "zz", "xy"];
        let stress: Option<Vec<f64>> = STRESSES.iter().map(|key| probe["stress"][key].as_f64()).collect();
        all.extend(stress.map(|stress| Quantity::new(name, "stress", "Pa", &STRESSES, stress)));
    }
    let largest =
        |unit: &str| all.iter().filter(|q| q.unit == unit).map(|q| norm(&q.values)).fold(0.0, larger);
    let units = ["Pa", "N", "m"].map(|unit| (unit, largest(unit)));
    let matters = |q: &Quantity| {
        let scale = units.iter().find(|(unit, _)| *unit == q.unit).map_or(0.0, |(_, scale)| *scale);
        norm(&q.values) > NOTHING * scale
    };
    all.into_iter().filter(matters).collect()
}

/// Euclidean norm.
pub(super) fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Difference of two vectors.
pub(super) fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// `peak pressure` for `contact.peak_pressure`; with its owner if `full`.
pub(super) fn spoken(name: &str, full: bool) -> String {
    match name.split_once('.') {
        Some((owner, "displacement")) => format!("displacement at {owner}"),
        Some((owner, "stress")) => format!("stress at {owner}"),
        Some((owner, what)) if full => format!("{} of {owner}", what.replace('_', " ")),
        Some((_, what)) => what.replace('_', " "),
        None => name.to_string(),
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
        });
        let names: Vec<String> = quantities(&summary).into_iter().map(|q| q.name).collect();
        let expected = ["p.peak_pressure", "p.force", "p.contact_length", "a.displacement", "b.stress"];
        assert_eq!(names, expected);
        assert_eq!(spoken("p.peak_pressure", false), "peak pressure");
        assert_eq!(spoken("p.peak_pressure", true), "peak pressure of p");
    }
}
