//! The results of a study: a row for each choice and level, errors, orders, and what they were measured against.
use super::exact::Known;
use super::journal::Journal;
use super::plan::{Choice, Elements, Plan};
use super::quantity::{Quantity, difference, norm, quantities};
use super::reference::{Reference, Sequence};
use super::richardson::{Limit, limit, order_of_errors};
use super::run::Measured;
use serde_json::Value;
use std::collections::BTreeMap;

/// Errors below this are round-off, whatever the values.
pub(super) const ROUND_OFF: f64 = 1e-9;
/// Largest order of a quantity, over the order of the element's shape functions: twice for energies, and a little for what
/// is not yet asymptotic.
const HIGHEST_ORDER: f64 = 2.25;

/// Wall time over processor time of a rank from which on a run has waited rather than worked, and the seconds that starting
/// mpirun waits by itself.
const STARVED: f64 = 2.0;
const START_UP_WAIT: f64 = 1.0;

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

/// All results.
pub(super) struct Table {
    /// Of the choices; empty if there is one only.
    pub labels: Vec<String>,
    /// Of the choices.
    pub elements: Vec<Elements>,
    /// Of the choices: how many of their settings are none of kontakt's defaults.
    pub departures: Vec<usize>,
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

    /// Seconds that the study reckons with: wall time of the process, the least of the repetitions, for what else the machine
    /// does only adds to it. Where that is far above what the processors have worked, the run has waited for a turn: their
    /// share then.
    pub fn time(&self) -> f64 {
        if self.starved() { self.cpu.low / self.ranks as f64 } else { self.process.low }
    }

    /// True if the run has waited for the machine more than it has worked.
    pub fn starved(&self) -> bool {
        self.process.low > STARVED * self.cpu.low / self.ranks as f64 + START_UP_WAIT
    }

    /// Seconds of the process that are not of the solution: the start of MPI and of the program.
    pub fn start_up(&self) -> f64 {
        self.process.low - self.seconds.low
    }

    /// The pair that fewer nodes carry than make a pressure, if there is one: what it gives depends on the mesh, and is the
    /// same on all only by chance. A surface that is all in contact has its pressure at any number.
    pub fn unresolved(&self) -> Option<String> {
        let pairs = self.summary["pairs"].as_array()?;
        let few = |pair: &&Value| {
            let count = |key: &str| pair[key].as_u64().unwrap_or(0);
            (1..crate::record::RESOLVED_NODES).contains(&count("active"))
                && count("active") < count("candidates")
        };
        Some(pairs.iter().find(few)?["name"].as_str()?.to_string())
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
            departures: plan.choices.iter().map(Choice::departures).collect(),
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
        let mut sequences = Vec::new();
        for choice in 0..self.labels.len() {
            let rows: Vec<&Row> = self.curve(choice).filter(|row| row.value(name).is_some()).collect();
            let resolved: Vec<(usize, &[f64])> = rows
                .iter()
                .filter(|row| row.unresolved().is_none())
                .filter_map(|row| Some((row.level, row.value(name)?)))
                .collect();
            let Some(mut limit) = limit(&resolved, self.highest_order(choice)) else { continue };
            // What the alternation leaves is in every value.
            let tolerance = rows.last().map_or(f64::NAN, |row| row.number(&["tolerance"]));
            limit.uncertainty = if tolerance > limit.uncertainty { tolerance } else { limit.uncertainty };
            let finest = rows.last().and_then(|row| row.value(name)).unwrap_or_default().to_vec();
            self.limits.insert((name.to_string(), choice), limit.clone());
            sequences.push(Sequence { choice, limit, finest });
        }
        let unit =
            self.rows.iter().flat_map(|row| &row.quantities).find(|q| q.name == name).map_or("", |q| q.unit);
        let Some(reference) = Reference::new(known, &sequences, unit) else { return };
        let scale = norm(&reference.values);
        // The finest level of a sequence without an order stands for the limit: that mesh has no error, however it is solved.
        let own = reference.limit.as_ref().filter(|(_, limit)| !reference.exact && limit.is_finest_level());
        let own = own.and_then(|(choice, _)| Some((*choice, self.curve(*choice).last()?.level)));
        let elements = &self.elements;
        let is_own = |row: &Row| {
            let same = |(choice, level): (usize, usize)| {
                elements[choice].names == elements[row.choice].names && level == row.level
            };
            own.is_some_and(same)
        };
        for row in self.rows.iter_mut().filter(|row| row.converged && !is_own(row)) {
            if let Some(value) = row.value(name) {
                let error = norm(&difference(value, &reference.values)) / scale;
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
        self.references.insert(name.to_string(), reference);
    }

    /// The least seconds in which MPI and the program start, if any run says so.
    pub fn start_up(&self) -> Option<f64> {
        let all = self.rows.iter().filter(|row| !row.starved()).map(Row::start_up);
        all.filter(|s| s.is_finite() && *s > 0.0).min_by(f64::total_cmp)
    }

    /// Levels, by choice, that have no limit because too few nodes carry a pair.
    pub fn unresolved(&self) -> Vec<(&Row, String)> {
        self.rows
            .iter()
            .filter(|row| row.converged)
            .filter_map(|row| Some((row, row.unresolved()?)))
            .collect()
    }

    /// The largest order that a quantity can have with the elements of a choice.
    pub fn highest_order(&self, choice: usize) -> f64 {
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

    impl Table {
        /// Rows of choices with linear elements, without references.
        pub fn of(rows: Vec<Row>, labels: &[&str]) -> Table {
            Table {
                labels: labels.iter().map(|label| label.to_string()).collect(),
                elements: vec![Elements { degree: 1, ..Elements::default() }; labels.len()],
                departures: vec![0; labels.len()],
                rows,
                references: BTreeMap::new(),
                limits: BTreeMap::new(),
                names: Vec::new(),
            }
        }
    }

    #[test]
    fn a_run_that_waited_for_the_machine_is_judged_by_its_work() {
        let of = |wall: f64, cpu: f64, ranks: usize| {
            let row = Row::of_time(wall);
            Row { cpu: spread(vec![cpu]), ranks, ..row }
        };
        assert_eq!((of(28.8, 1.0, 1).time(), of(28.8, 1.0, 1).starved()), (1.0, true));
        assert_eq!((of(0.6, 0.1, 1).time(), of(5.0, 9.8, 2).time()), (0.6, 5.0));
        assert_eq!(of(30.0, 4.0, 2).time(), 2.0);
    }

    #[test]
    fn few_nodes_in_contact_are_told_from_a_surface_that_is_all_in_contact() {
        let row = |active: u64, candidates: u64| {
            let summary =
                serde_json::json!({ "pairs": [{ "name": "p", "active": active, "candidates": candidates }] });
            Row { summary, ..Row::of_time(1.0) }.unresolved()
        };
        assert_eq!([row(1, 9), row(2, 9)], [Some("p".to_string()), Some("p".to_string())]);
        assert_eq!([row(0, 9), row(3, 9), row(2, 2)], [None, None, None]);
    }

    #[test]
    fn median_and_range() {
        assert_eq!(spread(vec![3.0, 1.0, 2.0]), Spread { median: 2.0, low: 1.0, high: 3.0 });
        assert_eq!(spread(vec![4.0, 1.0]).median, 2.5);
        assert!(spread(Vec::new()).median.is_nan());
    }
}
