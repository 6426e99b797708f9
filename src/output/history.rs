//! The group `/history`: a row per alternation, and the same per contact pair in `/history/pairs/<pair>`.
use super::hdf5_rows::{Grown, Place, Plan, Rows, Values};
use super::spread::Spread;
use super::tables::group_name;
use super::{ResultFile, RunInfo};
use crate::{
    error::{Error, Result},
    record::{HistoryRow, PairRow, PairTables},
};
use hdf5::{Group, H5Type};
use std::borrow::Cow;

/// In the file's column what is not known is no number.
fn cell(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

fn known(cell: f64) -> Option<f64> {
    (!cell.is_nan()).then_some(cell)
}

/// A column of numbers: name, unit, value of a row.
type Real<T> = (&'static str, &'static str, fn(&T) -> f64);
/// A column of counts.
type Count<T> = (&'static str, fn(&T) -> u64);

const REALS: [Real<HistoryRow>; 6] = [
    ("displacement_jump", "-", |row| row.displacement_jump),
    ("force_imbalance", "-", |row| row.force_imbalance),
    ("penetration", "m", |row| row.penetration),
    ("gap", "m", |row| row.gap),
    ("contraction", "-", |row| cell(row.contraction)),
    ("seconds", "s", |row| row.seconds),
];
const COUNTS: [Count<HistoryRow>; 5] = [
    ("alternation", |row| row.alternation),
    ("update", |row| row.update),
    ("active", |row| row.active),
    ("open", |row| row.open),
    ("flips", |row| row.flips),
];
const PAIR_REALS: [Real<PairRow>; 4] = [
    ("gap", "m", |row| row.gap),
    ("penetration", "m", |row| row.penetration),
    ("force_imbalance", "-", |row| row.force_imbalance),
    ("contraction", "-", |row| cell(row.contraction)),
];
const PAIR_COUNTS: [Count<PairRow>; 3] =
    [("active", |row| row.active), ("open", |row| row.open), ("flips", |row| row.flips)];

/// Rows that a file of load steps has room for at a time: some thousand alternations fit into a few hundred kilobytes.
const CHUNK: usize = 4096;

/// Creates `/history` from the rows of rank 0, or adds to it. The columns `step` and `increment` are there if the case has
/// steps.
pub(super) fn create<'a>(
    spread: &Spread,
    file: &Place,
    result: &ResultFile<'a>,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let ResultFile { history, pairs, run, .. } = *result;
    let own = spread.on_first(history);
    let total = spread.history;
    let group = file.group("history")?;
    let grown = spread.growth.map(|growth| Grown { from: growth.history, chunk: CHUNK });
    let columns = Columns { group: &group, own: own.iter().collect(), total, run, grown };
    if run.steps.is_some() {
        let of_steps: [Count<HistoryRow>; 2] = [("step", |row| row.step), ("increment", |row| row.increment)];
        columns.add(plan, &[], &of_steps)?;
    }
    columns.add(plan, &REALS, &COUNTS)?;
    if !spread.history_of_pairs {
        return Ok(());
    }
    let all = group.group("pairs")?;
    for (p, pair) in pairs.iter().enumerate() {
        let group = all.group(&group_name(&pair.name))?;
        if spread.is_first() {
            group.text("name", &pair.name)?;
        }
        let own = own.iter().map(|row| &row.pairs[p]).collect();
        Columns { group: &group, own, total, run, grown }.add(plan, &PAIR_REALS, &PAIR_COUNTS)?;
    }
    Ok(())
}

/// Rows of rank 0 that become datasets, one per column.
struct Columns<'a, 'b, T> {
    group: &'a Place,
    own: Vec<&'b T>,
    total: usize,
    run: &'a RunInfo,
    grown: Option<Grown>,
}

impl<T> Columns<'_, '_, T> {
    fn add(&self, plan: &mut Plan, reals: &[Real<T>], counts: &[Count<T>]) -> Result<()> {
        let mut add = |name: &str, unit: &'static str, values| {
            let (unit, rows) =
                (Some(self.run.unit(unit)), Rows { start: 0, total: self.total, columns: 1, values });
            match self.grown {
                Some(grown) => plan.grow(self.group, name, unit, rows, grown, false),
                None => plan.add(self.group, name, unit, rows),
            }
        };
        for (name, unit, column) in reals {
            let values = self.own.iter().map(|row| column(row)).collect::<Cow<_>>();
            add(name, unit, Values::F64(values))?;
        }
        for (name, column) in counts {
            let values = self.own.iter().map(|row| column(row) as i64).collect::<Cow<_>>();
            add(name, "-", Values::I64(values))?;
        }
        Ok(())
    }
}

/// Reads what [`create`] wrote, up to the last of `steps`; the rows of pairs in the order of `pairs`.
pub(super) fn read(group: &Group, pairs: &[PairTables], steps: Option<usize>) -> Result<Vec<HistoryRow>> {
    let mut n = group.dataset("alternation")?.size();
    let (mut step, mut increment) = (vec![1; n], vec![1; n]);
    if let Some(last) = steps {
        step = group.dataset("step")?.read_raw::<u64>()?;
        n = step.iter().take_while(|&&step| step <= last as u64).count();
        // Files of before there were increments have none.
        if group.link_exists("increment") {
            increment = column::<u64>(group, "increment", n)?;
        }
    }
    let count = |name| column::<u64>(group, name, n);
    let real = |name| column::<f64>(group, name, n);
    let (alternation, update) = (count("alternation")?, count("update")?);
    let (active, open, flips) = (count("active")?, count("open")?, count("flips")?);
    let (jump, imbalance) = (real("displacement_jump")?, real("force_imbalance")?);
    let (penetration, gap) = (real("penetration")?, real("gap")?);
    let (contraction, seconds) = (real("contraction")?, real("seconds")?);
    let of_pairs = match group.group("pairs") {
        Ok(all) => pairs
            .iter()
            .map(|pair| read_pair(&all.group(&group_name(&pair.name))?, n))
            .collect::<Result<_>>()?,
        Err(_) => Vec::new(),
    };
    let row = |i: usize| HistoryRow {
        step: step[i],
        increment: increment[i],
        alternation: alternation[i],
        update: update[i],
        displacement_jump: jump[i],
        force_imbalance: imbalance[i],
        penetration: penetration[i],
        gap: gap[i],
        active: active[i],
        open: open[i],
        flips: flips[i],
        contraction: known(contraction[i]),
        seconds: seconds[i],
        pairs: of_pairs.iter().map(|rows: &Vec<PairRow>| rows[i]).collect(),
    };
    Ok((0..n).map(row).collect())
}

fn read_pair(group: &Group, n: usize) -> Result<Vec<PairRow>> {
    let count = |name| column::<u64>(group, name, n);
    let real = |name| column::<f64>(group, name, n);
    let (active, open, flips) = (count("active")?, count("open")?, count("flips")?);
    let (gap, penetration) = (real("gap")?, real("penetration")?);
    let (imbalance, contraction) = (real("force_imbalance")?, real("contraction")?);
    let row = |i: usize| PairRow {
        gap: gap[i],
        penetration: penetration[i],
        active: active[i],
        open: open[i],
        flips: flips[i],
        force_imbalance: imbalance[i],
        contraction: known(contraction[i]),
    };
    Ok((0..n).map(row).collect())
}

fn column<T: H5Type>(group: &Group, name: &str, n: usize) -> Result<Vec<T>> {
    let mut values = group.dataset(name)?.read_raw()?;
    // A run that was killed may have begun to write a step.
    if values.len() >= n {
        values.truncate(n);
        Ok(values)
    } else {
        Err(Error::input("the columns of the history differ in length"))
    }
}
