//! The results of a study: a row for each choice and level, errors, orders, and what they were measured against.
use super::exact::Known;
use super::journal::Journal;
use super::plan::{Elements, Plan};
use super::quantity::{Quantity, difference, norm, quantities};
use super::richardson::{Behaviour, Limit, limit, order_of_errors};
use super::run::Measured;
use crate::vector::smaller;
use serde_json::Value;
use std::collections::BTreeMap;

/// Errors below this are round-off, whatever the values.
pub(super) const ROUND_OFF: f64 = 1e-9;
/// Largest order of a quantity, over the order of the element's shape functions: twice for energies, and a little for what
/// is not yet asymptotic.
const HIGHEST_ORDER: f64 = 2.25;

/// Median, smallest and largest of the repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub(super) struct Spread {
    pub median: f64,
    pub low: f64,
    pub high: f64,
}

/// The runs of one choice at one level.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Index into the labels.
    pub choice: usize,
    pub level: usize,
    pub ranks: usize,
    pub converged: bool,
    /// How it ended.
    pub ending: String,
    /// The error reported, if any.
    pub error_text: Option<String>,
    pub repetitions: usize,
    /// From the summary; null if there is none.
    pub summary: Value,
    /// Of the solution, without start-up of MPI.
    pub seconds: Spread,
    /// Of the process.
    pub process: Spread,
    pub cpu: Spread,
    pub memory: f64,
    pub quantities: Vec<Quantity>,
    /// By quantity.
    pub errors: BTreeMap<String, f64>,
    /// By quantity: from the error of the level before.
    pub orders: BTreeMap<String, f64>,
}

/// What the errors of a quantity are measured against.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub unit: &'static str,
    pub values: Vec<f64>,
    /// True: `[exact]`; false: the limit below.
    pub exact: bool,
    /// Limit of the finest levels of the best choice, and its index.
    pub limit: Option<(usize, Limit)>,
    /// Errors below this say nothing.
    pub known_to: f64,
}

/// All results.
pub(super) struct Table {
    /// Of the choices; empty if there is one only.
    pub labels: Vec<String>,
    /// Of the choices.
    pub elements: Vec<Elements>,
    /// By choice, then level.
    pub rows: Vec<Row>,
    /// By quantity.
    pub references: BTreeMap<String, Reference>,
    /// Limits by quantity and choice.
    pub limits: BTreeMap<(String, usize), Limit>,
    /// Names of the quantities in the order of the summary.
    pub names: Vec<String>,
}

impl Row {
    /// A number of the summary by path, NaN if it is not there.
    pub fn number(&self, path: &[&str]) -> f64 {
        path.iter().fold(&self.summary, |value, key| &value[key]).as_f64().unwrap_or(f64::NAN)
    }

    /// How the bodies answered, each way once.
    pub fn responses(&self) -> String {
        let bodies = self.summary["bodies"].as_array().cloned().unwrap_or_default();
        let mut responses: Vec<&str> = bodies.iter().filter_map(|body| body["response"].as_str()).collect();
        responses.sort_unstable();
        responses.dedup();
        responses.join("+")
    }

    /// Unknowns of all bodies.
    pub fn dofs(&self) -> Option<u64> {
        let bodies = self.summary["bodies"].as_array()?;
        Some(bodies.iter().filter_map(|body| body["dofs"].as_u64()).sum())
    }
}

impl Table {
    /// Gathers what the journal has of the plan.
    pub fn new(plan: &Plan, journal: &Journal, known: &Known) -> Table {
        let mut rows: Vec<Row> = Vec::new();
        for run in &plan.runs {
            let id = run.id();
            let measured: Vec<&Measured> = journal.all(&id).collect();
            rows.extend(row(run.choice, run.level, run.ranks, &measured));
        }
        rows.sort_by_key(|row| (row.choice, row.level));
        let mut names: Vec<String> = Vec::new();
        for quantity in rows.iter().flat_map(|row| &row.quantities) {
            if !names.contains(&quantity.name) {
                names.push(quantity.name.clone());
            }
        }
        let mut table = Table {
            labels: plan.labels(),
            elements: plan.elements.clone(),
            rows,
            references: BTreeMap::new(),
            limits: BTreeMap::new(),
            names,
        };
        for name in table.names.clone() {
            table.judge(&name, known.get(&name));
        }
        table.names.retain(|name| table.references.contains_key(name));
        table
    }

    /// True if it takes the name of a pair to say which one is meant.
    pub fn has_several_pairs(&self) -> bool {
        let pairs = |row: &Row| row.summary["pairs"].as_array().map_or(0, Vec::len);
        self.rows.iter().any(|row| pairs(row) > 1)
    }

    /// Rows of a choice that converged, coarse first.
    pub fn curve(&self, choice: usize) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(move |row| row.choice == choice && row.converged)
    }

    /// Reference, errors and orders of a quantity.
    fn judge(&mut self, name: &str, known: Option<&Vec<f64>>) {
        let mut best: Option<(usize, f64, Limit)> = None;
        for choice in 0..self.labels.len() {
            let sequence: Vec<(usize, &[f64])> =
                self.curve(choice).filter_map(|row| Some((row.level, row.value(name)?))).collect();
            let Some(limit) = limit(&sequence, self.highest_order(choice)) else { continue };
            let tolerance = self.curve(choice).last().map_or(f64::INFINITY, |row| row.number(&["tolerance"]));
            let rank = |limit: &Limit, tolerance: f64| {
                let good = matches!(limit.behaviour, Behaviour::Asymptotic | Behaviour::Settled);
                (!good, tolerance, limit.uncertainty)
            };
            let new = rank(&limit, tolerance);
            if best.as_ref().is_none_or(|(_, tolerance, old)| new < rank(old, *tolerance)) {
                best = Some((choice, tolerance, limit.clone()));
            }
            self.limits.insert((name.to_string(), choice), limit);
        }
        let limit = best.map(|(choice, _, limit)| (choice, self.compared(name, choice, limit)));
        let unit =
            self.rows.iter().flat_map(|row| &row.quantities).find(|q| q.name == name).map_or("", |q| q.unit);
        let values = match (known, &limit) {
            (Some(known), _) => known.clone(),
            (None, Some((_, limit))) => limit.values.clone(),
            (None, None) => return,
        };
        let scale = norm(&values);
        if scale == 0.0 {
            return;
        }
        let known_to = match (known, &limit) {
            (None, Some((_, limit))) => limit.uncertainty,
            // A closed form that the meshes do not tend to is no better than its distance from their limit.
            (Some(known), Some((_, limit))) if limit.behaviour == Behaviour::Asymptotic => {
                let away = norm(&difference(known, &limit.values)) / scale;
                if away > limit.uncertainty { away } else { 0.0 }
            }
            _ => 0.0,
        };
        for row in &mut self.rows {
            if let (true, Some(value)) = (row.converged, row.value(name)) {
                let error = norm(&difference(value, &values)) / scale;
                row.errors.insert(name.to_string(), error);
            }
        }
        for choice in 0..self.labels.len() {
            let curve: Vec<usize> = (0..self.rows.len())
                .filter(|&i| self.rows[i].choice == choice && self.rows[i].errors.contains_key(name))
                .collect();
            for pair in curve.windows(2) {
                let [before, row] =
                    [pair[0], pair[1]].map(|i| (self.rows[i].level, self.rows[i].errors[name]));
                if let (Some(order), true) = (order_of_errors(before, row), row.1 > ROUND_OFF) {
                    self.rows[pair[1]].orders.insert(name.to_string(), order);
                }
            }
        }
        let reference = Reference { unit, values, exact: known.is_some(), limit, known_to };
        self.references.insert(name.to_string(), reference);
    }

    /// The limit of a choice, no better known than the nearest limit of another choice says: elements of different kinds
    /// have one limit.
    fn compared(&self, name: &str, choice: usize, limit: Limit) -> Limit {
        let good = |other: &Limit| other.behaviour == Behaviour::Asymptotic;
        let away = |other: &Limit| norm(&difference(&other.values, &limit.values)) / norm(&limit.values);
        let others = (0..self.labels.len()).filter(|other| *other != choice);
        let others = others.filter_map(|other| self.limits.get(&(name.to_string(), other)));
        let nearest = others.filter(|other| good(other)).map(away).fold(f64::INFINITY, smaller);
        let uncertainty =
            if nearest.is_finite() { limit.uncertainty.max(nearest) } else { limit.uncertainty };
        Limit { uncertainty, ..limit }
    }

    /// The largest order that a quantity can have with the elements of a choice.
    fn highest_order(&self, choice: usize) -> f64 {
        HIGHEST_ORDER * self.elements[choice].degree as f64
    }
}

impl Row {
    /// Value of a quantity.
    pub fn value(&self, name: &str) -> Option<&[f64]> {
        self.quantities.iter().find(|q| q.name == name).map(|q| &q.values[..])
    }
}

fn row(choice: usize, level: usize, ranks: usize, measured: &[&Measured]) -> Option<Row> {
    // Repetitions give the same numbers; only times differ. One that failed tells more than those that did not.
    let told = measured.iter().find(|m| !m.converged()).or(measured.first())?;
    let seconds =
        |of: &dyn Fn(&Measured) -> Option<f64>| spread(measured.iter().filter_map(|m| of(m)).collect());
    let summary = told.summary.clone().unwrap_or_default();
    let memory = seconds(&|m| m.summary.as_ref()?["peak_memory_mb"].as_f64());
    Some(Row {
        choice,
        level,
        ranks,
        converged: told.converged(),
        ending: told.ending(),
        error_text: told.error.clone(),
        repetitions: measured.len(),
        quantities: quantities(&summary),
        summary,
        seconds: seconds(&|m| m.summary.as_ref()?["seconds"]["total"].as_f64()),
        process: seconds(&|m| Some(m.process_seconds)),
        cpu: seconds(&|m| Some(m.cpu_seconds)),
        memory: memory.high,
        errors: BTreeMap::new(),
        orders: BTreeMap::new(),
    })
}

fn spread(mut values: Vec<f64>) -> Spread {
    values.sort_by(f64::total_cmp);
    let (Some(&low), Some(&high)) = (values.first(), values.last()) else {
        return Spread { median: f64::NAN, low: f64::NAN, high: f64::NAN };
    };
    let half = values.len() / 2;
    let median = if values.len() % 2 == 1 { values[half] } else { 0.5 * (values[half - 1] + values[half]) };
    Spread { median, low, high }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Row {
        /// A run that took so long and gave nothing.
        pub fn of_time(seconds: f64) -> Row {
            let time = spread(vec![seconds]);
            Row {
                choice: 0,
                level: 0,
                ranks: 1,
                converged: true,
                ending: "converged".into(),
                error_text: None,
                repetitions: 1,
                summary: Value::Null,
                seconds: time,
                process: time,
                cpu: time,
                memory: 1.0,
                quantities: Vec::new(),
                errors: BTreeMap::new(),
                orders: BTreeMap::new(),
            }
        }
    }

    #[test]
    fn median_and_range() {
        assert_eq!(spread(vec![3.0, 1.0, 2.0]), Spread { median: 2.0, low: 1.0, high: 3.0 });
        assert_eq!(spread(vec![4.0, 1.0]).median, 2.5);
        assert!(spread(Vec::new()).median.is_nan());
    }
}
