//! What accuracy costs: the cheapest run for an error, and the sentence that says so.
use super::quantity::spoken;
use super::table::{Row, Table};
use crate::vector::larger;

/// Accuracies asked for, relative, and how much more is asked then.
const TARGET: f64 = 1e-2;
const MORE: f64 = 10.0;

/// What is smaller, in percent, is round-off.
const PERCENT_OF_ROUND_OFF: f64 = 1e-11;
/// Errors that differ by less than this factor are alike.
const ALIKE: f64 = 1.05;
/// Times that differ by less than this factor are alike: repetitions of a run of a second scatter so on a quiet machine.
const AS_FAST: f64 = 1.3;

/// A run as a point of the diagram.
pub(super) struct Point<'a> {
    pub row: &'a Row,
    /// Error of the quantity.
    pub error: f64,
    /// The error that can be relied on: no finer level of the choice has a larger one, the level before allows it with the
    /// elements' highest order, and the reference is known to it. A mesh may be right by chance, the finest one too.
    pub reliable: f64,
    /// Nothing is as accurate for less time.
    pub best: bool,
}

/// The runs of a study that have an error, by choice and level.
pub(super) fn points<'a>(table: &'a Table, quantity: &str) -> Vec<Point<'a>> {
    let known_to = table.references.get(quantity).map_or(0.0, |reference| reference.known_to);
    let mut points = Vec::new();
    for choice in 0..table.labels.len() {
        let curve: Vec<(&Row, f64)> =
            table.curve(choice).filter_map(|row| Some((row, *row.errors.get(quantity)?))).collect();
        let mut before: Option<(usize, f64)> = None;
        for (i, &(row, error)) in curve.iter().enumerate() {
            let held = curve[i..].iter().map(|(_, error)| *error).fold(known_to, larger);
            let order = table.highest_order(choice);
            let allowed = |(level, error): (usize, f64)| error / (order * (row.level - level) as f64).exp2();
            let reliable = before.map_or(held, |before| larger(held, allowed(before)));
            before = Some((row.level, reliable));
            points.push(Point { row, error, reliable, best: false });
        }
    }
    let better = |a: &Point, b: &Point| {
        let faster = a.row.time() < b.row.time();
        let as_fast = a.row.time() <= b.row.time();
        let sharper = ALIKE * a.reliable < b.reliable;
        (faster && a.reliable <= ALIKE * b.reliable) || (as_fast && sharper)
    };
    let best: Vec<bool> =
        points.iter().map(|point| !points.iter().any(|other| better(other, point))).collect();
    points.iter_mut().zip(best).for_each(|(point, best)| point.best = best);
    points
}

/// The cheapest run with at most this error, and the others that are as fast: what the clock does not tell apart is ordered
/// by how near its settings are to the defaults, then by level, so that a second study names the same.
pub(super) fn cheapest<'p, 'a>(
    table: &Table,
    points: &'p [Point<'a>],
    error: f64,
) -> Option<(&'p Point<'a>, Vec<&'p Point<'a>>)> {
    let good = || points.iter().filter(|point| point.reliable <= error);
    let least = good().map(|point| point.row.time()).min_by(f64::total_cmp)?;
    let mut tied: Vec<&Point> = good().filter(|point| point.row.time() <= AS_FAST * least).collect();
    tied.sort_by_key(|point| (table.departures[point.row.choice], point.row.level, point.row.choice));
    let first = tied.remove(0);
    // A finer level of the same choice is no alternative.
    tied.retain(|point| point.row.choice != first.row.choice);
    tied.dedup_by_key(|point| point.row.choice);
    Some((first, tied))
}

/// "For 1 % of peak pressure: level 3, quad8, 0.8 s; ten times more accuracy costs 6 times the time (level 4, ...)."
pub(super) fn sentence(table: &Table, quantity: &str) -> String {
    let points = points(table, quantity);
    let what = spoken(quantity, table.has_several_pairs());
    let Some(most) = points.iter().min_by(|a, b| a.reliable.total_cmp(&b.reliable)) else {
        return format!("No run has an error of {what} to speak of.");
    };
    let Some((first, tied)) = cheapest(table, &points, TARGET) else {
        return format!(
            "1 % of {what} is not reached; the best is {}: {}, {}.",
            percent(most.reliable),
            name(table, most.row),
            seconds(most.row.time())
        );
    };
    let time = first.row.time();
    let costs = |point: &Point| {
        let factor = match point.row.time() / time {
            factor if (1.0 / AS_FAST..AS_FAST).contains(&factor) => "no more time that could be told".into(),
            factor => format!("{} the time", times(factor)),
        };
        format!("{factor} ({}, {})", name(table, point.row), seconds(point.row.time()))
    };
    // The first run may be far better than asked for: ten times more than what it has, then.
    let (has, base) = match first.reliable <= TARGET / MORE {
        true => (format!(", which has {}", percent(first.reliable)), first.reliable),
        false => (String::new(), TARGET),
    };
    let more = match cheapest(table, &points, base / MORE) {
        Some((second, _)) => format!("ten times more accuracy costs {}", costs(second)),
        None if std::ptr::eq(most.row, first.row) => "none is more accurate".to_string(),
        None => {
            format!(
                "ten times more is not reached, the best is {} for {}",
                percent(most.reliable),
                costs(most)
            )
        }
    };
    let first = named_with_ties(table, first.row, &tied);
    format!("For 1 % of {what}: {first}, {}{has}; {more}.", seconds(time))
}

/// `level 3, quad8 (as fast: level 3, quad4)`.
pub(super) fn named_with_ties(table: &Table, row: &Row, tied: &[&Point]) -> String {
    let names: Vec<String> = tied.iter().map(|point| name(table, point.row)).collect();
    match names.is_empty() {
        true => name(table, row),
        false => format!("{} (as fast: {})", name(table, row), names.join("; ")),
    }
}

/// `level 3, quad8`.
pub(super) fn name(table: &Table, row: &Row) -> String {
    match table.labels[row.choice].as_str() {
        "" => format!("level {}", row.level),
        label => format!("level {}, {label}", row.level),
    }
}

fn times(factor: f64) -> String {
    match factor {
        factor if factor < 9.95 => format!("{factor:.1} times"),
        factor => format!("{factor:.0} times"),
    }
}

/// Seconds to two digits, minutes from two on.
pub(super) fn seconds(value: f64) -> String {
    match value {
        value if !value.is_finite() => "–".into(),
        value if value >= 120.0 => format!("{:.1} min", value / 60.0),
        value if value >= 10.0 => format!("{value:.0} s"),
        value if value >= 1.0 => format!("{value:.1} s"),
        value => format!("{value:.2} s"),
    }
}

/// A relative error in percent, to two digits; in powers of ten where that is too small to read.
pub(super) fn percent(error: f64) -> String {
    let value = 100.0 * error;
    match value {
        value if !value.is_finite() => "–".into(),
        value if value < PERCENT_OF_ROUND_OFF => "round-off".into(),
        value if value >= 10.0 => format!("{value:.0} %"),
        value if value >= 1e-3 => {
            let decimals = (1.0 - value.log10().floor()).max(0.0) as usize;
            format!("{value:.decimals$} %")
        }
        _ => format!("{error:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(row: &Row, reliable: f64) -> Point<'_> {
        Point { row, error: reliable, reliable, best: false }
    }

    #[test]
    fn the_cheapest_run_is_the_one_with_the_least_time() {
        let table = Table::of(Vec::new(), &[""]);
        let rows: Vec<Row> = [3.0, 1.0, 2.0].map(Row::of_time).into();
        let points = [point(&rows[0], 1e-4), point(&rows[1], 1e-2), point(&rows[2], 1e-3)];
        let time = |error| cheapest(&table, &points, error).map(|(point, _)| point.row.time());
        assert_eq!([time(0.1), time(5e-3), time(1e-4), time(1e-5)], [Some(1.0), Some(2.0), Some(3.0), None]);
    }

    /// Three choices within the scatter of the clock: whichever of them was fastest this time, the defaults are named.
    #[test]
    fn ties_go_to_the_defaults_and_are_named() {
        for times in [[1.0, 1.05, 1.1], [1.1, 1.0, 1.2], [1.2, 1.15, 1.0]] {
            let mut rows: Vec<Row> = times.map(Row::of_time).into();
            rows.iter_mut().enumerate().for_each(|(i, row)| row.choice = i);
            rows.iter_mut().for_each(|row| {
                row.errors.insert("q.force".into(), 5e-3);
            });
            let mut table = Table::of(rows, &["tri3", "quad4", "quad8"]);
            table.departures = vec![1, 0, 1];
            let text = sentence(&table, "q.force");
            let named = "For 1 % of force: level 0, quad4 (as fast: level 0, tri3; level 0, quad8), ";
            assert!(text.starts_with(named), "{text}");
        }
    }

    /// An error that changes its sign on one level is near zero there, by chance, on the finest level too.
    #[test]
    fn a_mesh_that_is_right_by_chance_does_not_count() {
        let errors = [0.04, 1e-6, 0.01, 1e-7];
        let rows: Vec<Row> = errors
            .iter()
            .enumerate()
            .map(|(level, error)| {
                let mut row = Row::of_time(1.0 + level as f64);
                row.level = level;
                row.errors.insert("q.force".into(), *error);
                row
            })
            .collect();
        let table = Table::of(rows, &[""]);
        let reliable: Vec<f64> = points(&table, "q.force").iter().map(|p| p.reliable).collect();
        // The elements are of degree 1: an order of 2.25 at most.
        assert_eq!(reliable[..3], [0.04, 0.01, 0.01]);
        assert!((reliable[3] / (0.01 / 2f64.powf(2.25)) - 1.0).abs() < 1e-12, "{reliable:?}");
    }

    #[test]
    fn numbers_as_people_write_them() {
        let percents = [0.123, 0.0456, 4.56e-3, 1.2e-5, 3e-7].map(percent);
        assert_eq!(percents, ["12 %", "4.6 %", "0.46 %", "0.0012 %", "3.0e-7"]);
        assert_eq!([0.123, 1.26, 12.3, 150.0].map(seconds), ["0.12 s", "1.3 s", "12 s", "2.5 min"]);
        assert_eq!([1.0, 12.4].map(times), ["1.0 times", "12 times"]);
    }
}
