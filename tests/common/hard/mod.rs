//! The hard cases of cases/hard: run under mpirun, compared with what each states about itself.
//!
//! `tests/hard.rs` runs the quick ones, `scripts/hard` (benches/hard.rs) all of them.
#![allow(dead_code)]
mod compare;
mod expected;
mod results;

use crate::common::mpirun;
pub use compare::Ratio;
use expected::{Expected, Run};
use kontakt::vector::larger;
use serde_json::Value;
use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

/// A case or variant with what is expected of it.
pub struct Item {
    /// Directory of the case.
    directory: PathBuf,
    /// `case` or `case/variant`.
    pub name: String,
    run: Run,
    /// Relative difference that the swap of the sides may make; `None`: not swapped.
    swap: Option<f64>,
    /// `--set` arguments: none, or those for `geometry = "updated"` of all pairs.
    sets: Vec<String>,
}

/// How an item ended: one line of the table.
pub struct Row {
    /// `case` or `case/variant`.
    pub case: String,
    /// Reason of the summary, `refused`, or how it failed.
    pub outcome: String,
    /// The outcome expected.
    pub expected: String,
    /// True if nothing is wrong.
    pub ok: bool,
    /// Alternations on the first number of ranks.
    pub alternations: u64,
    /// Active-set updates on the first number of ranks.
    pub updates: u64,
    /// The invariant nearest to its limit, or furthest beyond it.
    pub worst: Option<Ratio>,
    /// What is wrong, a line each.
    pub faults: Vec<String>,
}

/// What one start of the program left.
struct Outcome {
    name: String,
    code: Option<i32>,
    text: String,
    summary: Value,
    directory: tempfile::TempDir,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/hard")
}

/// All cases and variants whose name contains `filter`, those of the quick subset only if `quick`.
pub fn items(quick: bool, filter: &str) -> Vec<Item> {
    let mut directories: Vec<PathBuf> = std::fs::read_dir(root())
        .expect("cases/hard is there")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.join("case.toml").exists())
        .collect();
    directories.sort();
    let mut items = Vec::new();
    for directory in directories {
        let name = directory.file_name().expect("a name").to_string_lossy().into_owned();
        let Expected { swap, run } = expected::read(&directory);
        for run in run {
            let name = run.variant.as_ref().map_or(name.clone(), |variant| format!("{name}/{variant}"));
            let swap = run.swap.or(swap).filter(|tolerance| *tolerance > 0.0);
            items.push(Item { directory: directory.clone(), name, run, swap, sets: Vec::new() });
        }
    }
    items.retain(|item| item.name.contains(filter) && (!quick || item.run.quick));
    items
}

/// Relative difference that following the surfaces may make: a few times the strains of the cases, which edges and slopes
/// multiply. Where it is more the case says why.
const FOLLOWED: f64 = 1e-2;

/// The items with `geometry = "updated"` in all pairs; those without a pair, or with a gap that is a number, have none.
pub fn updated(items: Vec<Item>) -> Vec<Item> {
    let of = |mut item: Item| {
        let case = kontakt::case::read(&item.directory, item.run.variant.as_deref(), &[]).ok()?;
        let follows = |c: &kontakt::case::ContactCase| matches!(c.gap, kontakt::case::Gap::Geometry { .. });
        if case.contacts.is_empty() || !case.contacts.iter().all(follows) {
            return None;
        }
        let set = |c: &kontakt::case::ContactCase| format!("contact.{}.geometry=\"updated\"", c.name);
        item.sets = case.contacts.iter().map(set).collect();
        item.name += " (updated)";
        if let Some(updated) = item.run.updated.clone() {
            if let Some(outcome) = updated.outcome {
                (item.run.outcome, item.run.exit, item.run.message) = (outcome, updated.exit, Vec::new());
            }
            item.run.symmetric = None;
            item.run.values.clear();
            item.run.profile.clear();
            item.run.slope.clear();
        }
        item.run.values.iter_mut().for_each(|n| n.relative = larger(n.relative, FOLLOWED));
        item.run.profile.iter_mut().for_each(|p| p.relative = larger(p.relative, FOLLOWED));
        item.run.symmetric = item.run.symmetric.map(|s| larger(s, FOLLOWED));
        // These are of the small changes that updates bring.
        item.run.same.clear();
        Some(item)
    };
    items.into_iter().filter_map(of).collect()
}

/// Coefficients that all hard cases are tried with.
pub const COEFFICIENTS: [f64; 4] = [1e-3, 0.1, 0.3, 1.0];

/// Most alternations with friction over those without it, of a case, and the median over all.
const DEARER: [f64; 2] = [2.0, 1.3];

/// The items with a coefficient of friction in all pairs, on one rank and, with 0.3, on two; those without a pair have none. What the numbers
/// are is not known then, that they are a state of equilibrium within the laws is.
pub fn with_friction(items: Vec<Item>, friction: f64) -> Vec<Item> {
    let of = |mut item: Item| {
        let case = kontakt::case::read(&item.directory, item.run.variant.as_deref(), &[]).ok()?;
        let smooth = |c: &kontakt::case::ContactCase| !c.law.is_frictional();
        if case.contacts.is_empty() || !case.contacts.iter().all(smooth) {
            return None;
        }
        let set = |c: &kontakt::case::ContactCase| format!("contact.{}.friction={friction}", c.name);
        item.sets = case.contacts.iter().map(set).collect();
        item.name += &format!(" (mu {friction})");
        item.swap = None;
        let run = &mut item.run;
        if let Some(other) = run.friction.iter().find(|other| other.coefficients.contains(&friction)).cloned()
        {
            (run.outcome, run.exit) = (other.outcome, other.exit);
        }
        run.ranks = if friction == 0.3 { vec![1, 2] } else { vec![1] };
        (run.free_modes, run.free_modes_min) = (None, None);
        run.message.clear();
        run.mode.clear();
        run.values.clear();
        run.profile.clear();
        run.slope.clear();
        run.same.clear();
        Some(item)
    };
    items.into_iter().filter_map(of).collect()
}

/// The items as they are, on one rank alone.
pub fn on_one_rank(mut items: Vec<Item>) -> Vec<Item> {
    for item in &mut items {
        item.run.ranks = vec![1];
        item.run.same.clear();
        item.swap = None;
    }
    items
}

/// Alternations of `rows` with a coefficient over those without: the median and the largest, and what is wrong with that, a line
/// each.
pub fn dearer(smooth: &[Row], rows: &[Row]) -> ([f64; 2], Vec<String>) {
    let name = |row: &Row| row.case.split(" (mu").next().unwrap_or_default().to_owned();
    let mut faults = Vec::new();
    let mut ratios: Vec<f64> = rows
        .iter()
        .filter(|row| row.outcome == "converged")
        .filter_map(|row| {
            let before =
                smooth.iter().find(|smooth| smooth.case == name(row) && smooth.outcome == "converged")?;
            let ratio = row.alternations as f64 / larger(before.alternations as f64, 1.0);
            if ratio > DEARER[0] {
                faults.push(format!(
                    "{}: {} alternations, without friction {}",
                    row.case, row.alternations, before.alternations
                ));
            }
            Some(ratio)
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios.get(ratios.len() / 2).copied().unwrap_or(0.0);
    if median > DEARER[1] {
        faults.push(format!("the median is {median:.2}"));
    }
    ([median, ratios.last().copied().unwrap_or(0.0)], faults)
}

/// Every variant has an expectation and every expectation a variant; a fault a line.
pub fn unmatched() -> Vec<String> {
    let mut faults = Vec::new();
    for entry in std::fs::read_dir(root()).expect("cases/hard is there") {
        let directory = entry.expect("an entry").path();
        if !directory.join("case.toml").exists() {
            continue;
        }
        let known = kontakt::case::variant_names(&directory).expect("the case reads");
        let stated: Vec<String> =
            expected::read(&directory).run.into_iter().filter_map(|run| run.variant).collect();
        let missing = known.iter().filter(|name| !stated.contains(name));
        faults.extend(missing.map(|name| format!("{}: {name} has no expectation", directory.display())));
        let surplus = stated.iter().filter(|name| !known.contains(name));
        faults.extend(surplus.map(|name| format!("{}: no variant {name}", directory.display())));
    }
    faults
}

/// Cases that do not read although they are not there to be refused; a fault a line.
pub fn unreadable() -> Vec<String> {
    let read = |item: &Item| {
        let error = kontakt::case::read(&item.directory, item.run.variant.as_deref(), &[]).err()?;
        (item.run.outcome != "refused").then(|| format!("{}: {error}", item.name))
    };
    items(false, "").iter().filter_map(read).collect()
}

/// `kontakt run` on `ranks` ranks.
fn start(directory: &Path, variant: Option<&str>, ranks: usize, sets: &[String]) -> Outcome {
    let out = tempfile::tempdir().expect("a temporary directory");
    let mut command = mpirun(ranks);
    command.arg(env!("CARGO_BIN_EXE_kontakt")).arg("run").arg(directory).arg("--out").arg(out.path());
    command.args(variant.iter().flat_map(|name| ["--variant", name]));
    command.args(sets.iter().flat_map(|set| ["--set", set]));
    let output = command.output().expect("mpirun starts");
    let text = [&output.stdout[..], &output.stderr[..]].map(String::from_utf8_lossy).concat();
    let summary = std::fs::read_to_string(out.path().join("summary.json")).ok();
    let summary = summary.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or(Value::Null);
    let code = output.status.code();
    let name = match code {
        Some(0 | 3) => summary["reason"].as_str().unwrap_or("no summary").to_string(),
        Some(2 | 4) => "refused".to_string(),
        Some(124 | 137) => "timeout".to_string(),
        _ => "failed".to_string(),
    };
    Outcome { name, code, text, summary, directory: out }
}

/// Runs an item on its numbers of ranks and with the sides of its pairs swapped, and checks everything.
pub fn check(item: &Item, ranks: Option<&[usize]>) -> Row {
    let Item { directory, run, sets, .. } = item;
    let variant = run.variant.as_deref();
    let mut row = Row {
        case: item.name.clone(),
        outcome: String::new(),
        expected: run.outcome.clone(),
        ok: false,
        alternations: 0,
        updates: 0,
        worst: None,
        faults: Vec::new(),
    };
    let mut ratios = Vec::new();
    let mut first: Option<Outcome> = None;
    for &n in ranks.unwrap_or(&run.ranks) {
        let found = start(directory, variant, n, sets);
        let mut faults = outcome_faults(&found, run);
        if faults.is_empty() && found.code == Some(0) {
            ratios.extend(compare::invariants(&found.summary, run.round_off));
            ratios.extend(compare::friction(&found.summary));
            faults.extend(too_many_alternations(&found, run));
            match &first {
                None => faults.extend(numbers(&found, item, &mut ratios)),
                Some(one) => ratios.extend(compare::ranks(&one.summary, &found.summary, run)),
            }
        }
        row.faults.extend(faults.into_iter().map(|fault| format!("{n} ranks: {fault}")));
        if first.is_none() {
            row.outcome = found.name.clone();
            row.alternations = found.summary["alternations"].as_u64().unwrap_or(0);
            row.updates = found.summary["updates"].as_u64().unwrap_or(0);
            first = Some(found);
        }
    }
    if let (Some(tolerance), Some(one), true) = (item.swap, &first, row.faults.is_empty())
        && one.name == "converged"
    {
        let sets = [&sets[..], &swapped(directory, variant)].concat();
        let found = start(directory, variant, 1, &sets);
        let faults = outcome_faults(&found, run);
        row.faults.extend(too_many_alternations(&found, run));
        if faults.is_empty() {
            ratios.extend(compare::swap(&one.summary, &found.summary, tolerance));
        }
        row.faults.extend(faults.into_iter().map(|fault| format!("sides swapped: {fault}")));
    }
    let violated = ratios.iter().filter(|r| r.ratio.is_nan() || r.ratio > 1.0);
    let mut violated: Vec<String> =
        violated.map(|r| format!("{} at {:.1e} of its limit", r.name, r.ratio)).collect();
    violated.sort_unstable();
    violated.dedup();
    row.faults.extend(violated);
    row.worst = ratios.into_iter().max_by(|a, b| a.ratio.abs().total_cmp(&b.ratio.abs()));
    row.ok = row.faults.is_empty();
    row
}

/// `--set` arguments that swap the sides of all pairs.
fn swapped(directory: &Path, variant: Option<&str>) -> Vec<String> {
    let case = kontakt::case::read(directory, variant, &[]).expect("it has been run");
    let sides = |c: &kontakt::case::ContactCase| {
        let [a, b] =
            [0, 1].map(|s| format!("{}.{}", case.body_name(c.surfaces[s].body), c.surfaces[s].surface));
        format!("contact.{}.surfaces=[\"{b}\", \"{a}\"]", c.name)
    };
    case.contacts.iter().map(sides).collect()
}

/// The outcome, its exit code, what it must say, the modes left free.
fn outcome_faults(found: &Outcome, run: &Run) -> Vec<String> {
    let mut faults = Vec::new();
    let as_expected = match run.outcome.as_str() {
        "touching" => matches!(found.name.as_str(), "converged" | "open"),
        expected => found.name == expected,
    };
    let code = run.exit.unwrap_or(0);
    if !as_expected || found.code != Some(code) {
        let last: Vec<&str> = found.text.lines().rev().take(4).collect();
        let last: Vec<&str> = last.into_iter().rev().collect();
        let text = last.join(" | ");
        faults.push(format!("{} (exit code {:?}), not {}: {text}", found.name, found.code, run.outcome));
        return faults;
    }
    for wanted in run.message.iter().filter(|wanted| !found.text.contains(wanted.as_str())) {
        faults.push(format!("the message does not say \"{wanted}\": {}", found.text.trim()));
    }
    let modes = found.summary["free_modes"].as_array().cloned().unwrap_or_default();
    if run.free_modes.is_some_and(|n| modes.len() as u64 != n)
        || run.free_modes_min.is_some_and(|n| (modes.len() as u64) < n)
    {
        let listed: Vec<String> = modes.iter().map(|m| format!("{} {}", m["body"], m["mode"])).collect();
        faults.push(format!("{} free modes: {}", modes.len(), listed.join(", ")));
    }
    if let [body, mode] = &run.mode[..] {
        let is =
            |m: &Value| m["body"] == body.as_str() && m["mode"].as_str().is_some_and(|t| t.contains(mode));
        if !modes.iter().any(is) {
            faults.push(format!("{mode} of {body} is not among the free modes"));
        }
    }
    faults
}

/// More alternations a load step than the run allows.
fn too_many_alternations(found: &Outcome, run: &Run) -> Option<String> {
    let of_steps = found.summary["steps"].as_array().map_or(Vec::new(), Vec::clone);
    let of_steps = if of_steps.is_empty() { vec![found.summary.clone()] } else { of_steps };
    let most = of_steps.iter().filter_map(|step| step["alternations"].as_u64()).max();
    let most = most.filter(|most| *most > run.alternations_max)?;
    Some(format!("{most} alternations, more than {}", run.alternations_max))
}

/// The numbers expected of the item.
fn numbers(found: &Outcome, item: &Item, ratios: &mut Vec<Ratio>) -> Vec<String> {
    let run = &item.run;
    let mut faults = compare::values(&found.summary, &run.values);
    faults.extend(results::check(found.directory.path(), &found.summary, run, ratios));
    for same in &run.same {
        let other = same.case.as_ref().map_or(item.directory.clone(), |case| root().join(case));
        let reference = start(&other, same.variant.as_deref(), 1, &[]);
        if reference.code == Some(0) {
            ratios.extend(compare::same(&reference.summary, &found.summary, same));
        } else {
            faults.push(format!("the run to compare with: {}", reference.name));
        }
    }
    faults
}

impl Row {
    /// The invariant nearest to its limit, as text.
    fn worst(&self) -> String {
        self.worst.as_ref().map_or("-".into(), |worst| format!("{} {:.1e}", worst.name, worst.ratio))
    }

    /// One line, and one more for each fault.
    pub fn line(&self) -> String {
        let ok = if self.ok { "ok" } else { "WRONG" };
        let Row { case, outcome, expected, alternations, updates, .. } = self;
        let worst = self.worst();
        let mut text =
            format!("{case:38} {outcome:14} {expected:14} {ok:5} {alternations:5} {updates:4}  {worst}");
        for fault in &self.faults {
            let _ = write!(text, "\n    {fault}");
        }
        text
    }
}

/// Heading of [`Row::line`].
pub fn heading() -> String {
    let [case, outcome, expected, ok] = ["case", "outcome", "expected", "ok"];
    format!("{case:38} {outcome:14} {expected:14} {ok:5} alts. upd.  invariant nearest to its limit")
}

/// `[{case, outcome, expected, ok, alternations, updates}]`.
pub fn json(rows: &[Row]) -> String {
    let row = |row: &Row| {
        serde_json::json!({
            "case": row.case, "outcome": row.outcome, "expected": row.expected, "ok": row.ok,
            "alternations": row.alternations, "updates": row.updates,
        })
    };
    let list: Vec<Value> = rows.iter().map(row).collect();
    serde_json::to_string_pretty(&list).expect("plain values") + "\n"
}

/// The table of docs/hard-cases.md.
pub fn markdown(rows: &[Row]) -> String {
    let passed = rows.iter().filter(|row| row.ok).count();
    let mut text = format!(
        "# Hard cases\n\n\
        Written by `scripts/hard`: every case and variant of [cases/hard](../cases/hard/README.md) on 1, 2 and 4 ranks \
        and, where the bodies touch, once more with the sides of its pairs swapped. Alternations and active-set \
        updates are those of 1 rank. The last column is the invariant that comes nearest to its limit and the fraction \
        of the limit it reaches (balance of forces, residual, tension, complementarity, penetration, virtual work; \
        agreement between numbers of ranks to 1e-8; the swap to the discretisation error of the case; symmetry where \
        the case is symmetric).\n\n\
        {passed} of {} as expected.\n\n\
        | case | outcome | expected | ok | alternations | updates | nearest invariant | of its limit |\n\
        |---|---|---|---|---:|---:|---|---:|\n",
        rows.len()
    );
    for row in rows {
        let (worst, ratio) =
            row.worst.as_ref().map_or(("", String::new()), |w| (w.name.as_str(), format!("{:.1e}", w.ratio)));
        let Row { case, outcome, expected, alternations, updates, .. } = row;
        let ok = if row.ok { "yes" } else { "**no**" };
        let _ = writeln!(
            text,
            "| {case} | {outcome} | {expected} | {ok} | {alternations} | {updates} | {worst} | {ratio} |"
        );
    }
    text
}
