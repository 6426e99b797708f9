//! Positions of the cell boundaries along one direction of a structured mesh.
//!
//! Input that mirrors another, or itself, about 0 gives positions that do so to the last bit: each position
//! is computed from the nearer end of its interval, by the same operations on both sides.
use super::Grading;
use super::reader::{Field, Fields};

/// Most cells along one direction.
pub(super) const MOST_CELLS: usize = 1_000_000;

/// Cells of one interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cells {
    /// How many.
    pub count: usize,
    /// Relative size of the first and the last cell; geometric in between.
    pub sizes: [f64; 2],
}

impl Grading {
    /// Cuts every interval in its middle.
    pub(super) fn halve(&mut self) {
        let halves = self.at.windows(2).flat_map(|w| [0.5 * (w[0] + w[1]), w[1]]);
        self.at = self.at.first().copied().into_iter().chain(halves).collect();
    }
}

/// Reads a grading table; `ends` are the first and last position where `from` and `to` are absent.
pub(super) fn read(fields: &Fields<'_>, ends: [Option<f64>; 2]) -> Option<Grading> {
    let (from, to) = (fields.number("from").or(ends[0]), fields.number("to").or(ends[1]));
    let (at, size) = (fields.numbers("at"), fields.numbers("size"));
    let (cells, ratio) = (fields.field("cells"), fields.field("ratio"));
    let breakpoints = match at {
        Some(at) => {
            for key in fields.given(&["from", "to"]) {
                fields.error_at(key, "'at' already says where the cells begin and end; give one of the two");
            }
            at
        }
        None if fields.has("at") => return None,
        None => {
            for (key, value) in [("from", from), ("to", to)] {
                if value.is_none() && !fields.has(key) {
                    fields.error_at(
                        key,
                        "missing; give 'from', 'to' and 'cells', or 'at' with 'cells' or 'size'",
                    );
                }
            }
            vec![from?, to?]
        }
    };
    if breakpoints.len() < 2 || !increasing(&breakpoints) {
        fields.error(format!(
            "the positions {breakpoints:?} are not at least two, each larger than the one before"
        ));
        return None;
    }
    let n = breakpoints.len() - 1;
    let intervals: Vec<Cells> = match (cells, size) {
        (Some(cells), None) if !fields.has("size") => {
            let counts = per_interval(&cells, n, Field::count);
            let ratios = match &ratio {
                Some(ratio) => per_interval(ratio, n, positive),
                None => Some(vec![1.0; n]),
            };
            let pairs = counts?.into_iter().zip(ratios?);
            pairs.map(|(count, ratio)| Cells { count, sizes: [1.0, ratio] }).collect()
        }
        (None, Some(size)) => {
            if ratio.is_some() {
                fields.error_at("ratio", "goes with 'cells'; 'size' already says how the cells grow");
            }
            if size.len() != n + 1 || size.iter().any(|h| *h <= 0.0) {
                fields.error_at(
                    "size",
                    format!(
                        "{size:?} was given; {} positive sizes are needed, one at each \
                    breakpoint",
                        n + 1
                    ),
                );
                return None;
            }
            let lengths = breakpoints.windows(2).map(|w| w[1] - w[0]);
            lengths.zip(size.windows(2)).map(|(length, h)| cells_for_sizes(length, [h[0], h[1]])).collect()
        }
        (None, None) if !fields.has("size") => {
            fields.error_at("cells", "missing; give 'cells', or 'size' at each breakpoint");
            return None;
        }
        (None, None) => return None,
        (Some(_), _) => {
            fields.error_at("size", "goes without 'cells'; give one of the two");
            return None;
        }
    };
    expand(&breakpoints, &intervals).map_err(|message| fields.error(message)).ok()
}

/// One value for all intervals, or an array with one for each.
fn per_interval<'a, T: Copy>(
    field: &Field<'a>,
    n: usize,
    read: impl Fn(&Field<'a>) -> Option<T>,
) -> Option<Vec<T>> {
    if !matches!(field.node.value, super::node::Value::Array(_)) {
        return Some(vec![read(field)?; n]);
    }
    let values = super::reader::all(field.items()?.iter().map(read))?;
    match values.len() == n {
        true => Some(values),
        false => field.refuse(format!("{n} value(s) are needed, one for each interval between breakpoints")),
    }
}

fn positive(field: &Field<'_>) -> Option<f64> {
    let value = field.number(super::units::Dimension::NUMBER)?;
    if value > 0.0 { Some(value) } else { field.refuse("must be > 0") }
}

fn increasing(values: &[f64]) -> bool {
    values.windows(2).all(|w| w[0] < w[1])
}

/// Positions of all cell boundaries; the error says what is wrong.
pub(super) fn expand(breakpoints: &[f64], intervals: &[Cells]) -> Result<Grading, String> {
    let total = intervals.iter().fold(0_usize, |sum, cells| sum.saturating_add(cells.count));
    if total > MOST_CELLS {
        return Err(format!("this makes {total} cells in one direction; at most {MOST_CELLS} are allowed"));
    }
    let mut at = vec![breakpoints[0]];
    for (ends, cells) in breakpoints.windows(2).zip(intervals) {
        at.extend((1..cells.count).map(|i| position(ends[0], ends[1], *cells, i)));
        at.push(ends[1]);
    }
    match increasing(&at) {
        true => Ok(Grading { at }),
        false => {
            Err("the smallest cells are too small to tell their ends apart; take a ratio nearer to 1".into())
        }
    }
}

/// Position of boundary `i` of an interval.
fn position(a: f64, b: f64, cells: Cells, i: usize) -> f64 {
    let Cells { count: n, sizes: [first, last] } = cells;
    if last < first {
        return -position(-b, -a, Cells { count: n, sizes: [last, first] }, n - i);
    }
    let length = b - a;
    if last == first {
        return match (2 * i).cmp(&n) {
            std::cmp::Ordering::Less => a + length * (i as f64 / n as f64),
            std::cmp::Ordering::Equal => 0.5 * (a + b),
            std::cmp::Ordering::Greater => b - length * ((n - i) as f64 / n as f64),
        };
    }
    let fraction = geometric_fraction(last / first, n, i);
    if fraction <= 0.5 { a + length * fraction } else { b - length * (1.0 - fraction) }
}

/// (g^i - 1) / (g^n - 1), with g^(n-1) = ratio.
fn geometric_fraction(ratio: f64, n: usize, i: usize) -> f64 {
    let log_g = ratio.ln() / (n.max(2) - 1) as f64;
    (log_g * i as f64).exp_m1() / (log_g * n as f64).exp_m1()
}

/// Cells of a geometric progression over `length` whose first and last size are `sizes`, as nearly as a whole
/// number of cells allows. Their ratio is met exactly.
pub(super) fn cells_for_sizes(length: f64, sizes: [f64; 2]) -> Cells {
    let (small, large) = (sizes[0].min(sizes[1]), sizes[0].max(sizes[1]));
    // sum of the progression = length: g = (length - small) / (length - large), count = 1 + ln(large/small) /
    // ln(g)
    let count = if small == large {
        length / small
    } else if large < length {
        1.0 + (large / small).ln() / ((large - small) / (length - large)).ln_1p()
    } else {
        1.0
    };
    let count = if count.is_finite() { count.round().max(1.0) as usize } else { 1 };
    Cells { count, sizes }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mirrored(at: &[f64]) -> Vec<f64> {
        at.iter().rev().map(|x| -x).collect()
    }

    #[test]
    fn uniform() {
        let at = expand(&[0.0, 0.04], &[Cells { count: 5, sizes: [1.0, 1.0] }]).unwrap().at;
        assert_eq!(at.len(), 6);
        assert_eq!((at[0], at[5]), (0.0, 0.04));
        assert!(at.windows(2).all(|w| (w[1] - w[0] - 0.008).abs() < 1e-17));
    }

    #[test]
    fn ratio_is_last_over_first() {
        for ratio in [0.1, 0.9, 1.0, 3.0, 50.0] {
            let at = expand(&[0.3, 1.7], &[Cells { count: 7, sizes: [1.0, ratio] }]).unwrap().at;
            assert_eq!((at[0], at[7]), (0.3, 1.7));
            let h: Vec<f64> = at.windows(2).map(|w| w[1] - w[0]).collect();
            assert!((h[6] / h[0] / ratio - 1.0).abs() < 1e-12, "{ratio}");
            assert!(h.windows(3).all(|w| (w[1] * w[1] / (w[0] * w[2]) - 1.0).abs() < 1e-12), "geometric");
        }
    }

    #[test]
    fn sizes_are_met_as_nearly_as_the_count_allows() {
        for (length, first, last) in
            [(1.0, 0.1, 0.1), (1.0, 0.001, 0.05), (0.05, 5e-3, 1e-4), (7.0, 0.3, 2.0)]
        {
            let cells = cells_for_sizes(length, [first, last]);
            let at = expand(&[0.0, length], &[cells]).unwrap().at;
            let n = cells.count as f64;
            let h = [at[1], length - at[cells.count - 1]];
            // one cell more or less changes every size by a factor of about 1 +- 1/n; rounding by half of
            // that
            for (h, wanted) in h.iter().zip([first, last]) {
                assert!(
                    (h / wanted).ln().abs() < 0.75 / (n - 1.0).max(1.0) * (1.0 + (last / first).ln().abs()),
                    "{length} {first} {last}: {h} for {wanted}, {n} cells"
                );
            }
            // no other count is nearer
            let miss = |count| {
                let at = expand(&[0.0, length], &[Cells { count, ..cells }]).unwrap().at;
                (at[1] / first).ln().abs()
            };
            assert!(miss(cells.count) <= miss(cells.count + 1) * 1.2);
            assert!(cells.count < 3 || miss(cells.count) <= miss(cells.count - 1) * 1.2);
        }
        assert_eq!(cells_for_sizes(1.0, [2.0, 5.0]).count, 1);
        assert_eq!(cells_for_sizes(1.0, [0.25, 0.25]), Cells { count: 4, sizes: [0.25, 0.25] });
    }

    #[test]
    fn mirrored_input_gives_mirrored_positions_to_the_last_bit() {
        for (breakpoints, cells) in [
            (vec![-0.05, -0.01, 0.01, 0.05], vec![(12, 0.1), (121, 1.0), (12, 10.0)]),
            (vec![-0.3, 0.3], vec![(7, 1.0)]),
            (vec![-0.3, 0.3], vec![(8, 1.0)]),
            (vec![-1.1, 0.0, 1.1], vec![(33, 0.02), (33, 50.0)]),
        ] {
            let cells: Vec<Cells> =
                cells.into_iter().map(|(count, ratio)| Cells { count, sizes: [1.0, ratio] }).collect();
            let at = expand(&breakpoints, &cells).unwrap().at;
            assert_eq!(at, mirrored(&at), "{breakpoints:?}");
        }
        let at = |h: [f64; 3]| {
            let b = [-0.05, 0.0, 0.05];
            let cells = [cells_for_sizes(0.05, [h[0], h[1]]), cells_for_sizes(0.05, [h[1], h[2]])];
            expand(&b, &cells).unwrap().at
        };
        for h in [[5e-3, 1e-4, 5e-3], [7e-3, 3e-4, 7e-3], [1e-3, 1e-3, 1e-3]] {
            let symmetric = at(h);
            assert_eq!(symmetric, mirrored(&symmetric), "{h:?}");
        }
    }

    #[test]
    fn cells_too_small_to_tell_apart_are_refused() {
        assert!(expand(&[1.0, 2.0], &[Cells { count: 100, sizes: [1.0, 1e30] }]).is_err());
        assert!(expand(&[1.0, 2.0], &[Cells { count: 2_000_000, sizes: [1.0, 1.0] }]).is_err());
    }
}
