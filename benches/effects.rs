//! What each effect costs, alone: one Hertz case with it off, present at its neutral value, and on.
//!
//! `scripts/bench --only effects [--json FILE]` writes docs/benchmarks/effects.md.
//!
//! Instructions are those of the whole process on one rank, start-up and pictures included, counted by valgrind, which gives the
//! same number on any machine under any load; messages are those of a run on two ranks. tests/effects.rs holds the counters.
mod common;
#[path = "common/scene.rs"]
mod scene;

use common::run::{Done, Run};
use kontakt::{Error, Result};
use scene::{Contact, Heat, Scene};
use std::{
    path::Path,
    process::{Command, Stdio},
};

/// What an unused effect may cost: relative difference of instructions that is called none.
const NOTHING: f64 = 0.01;

/// A scene, and the one it is compared with: the row of that number.
struct Entry {
    effect: &'static str,
    state: &'static str,
    scene: Scene,
    against: usize,
    /// Must cost nothing against it.
    free: bool,
}

fn entries() -> Vec<Entry> {
    let base = Scene::default();
    let heat = |heat: Heat| Scene { heat, ..base };
    let entry = |effect, state, scene, against, free| Entry { effect, state, scene, against, free };
    vec![
        entry("two elastic bodies in contact", "", base, 0, false),
        entry("heat", "off: the material expands, no body has a temperature", heat(Heat::Expansion), 0, true),
        entry("heat", "neutral: the reference temperature", heat(Heat::Neutral), 0, false),
        entry("heat", "on: uniform temperature", heat(Heat::Uniform), 0, false),
        entry(
            "modulus over temperature",
            "neutral: a table that is constant",
            heat(Heat::Table { falling: false }),
            3,
            false,
        ),
        entry("modulus over temperature", "on", heat(Heat::Table { falling: true }), 3, false),
        entry("updated geometry", "off: \"initial\"", Scene { geometry: Some("initial"), ..base }, 0, true),
        entry("updated geometry", "on", Scene { geometry: Some("updated"), ..base }, 0, false),
        entry("load steps", "neutral: one step", Scene { steps: Some(1), ..base }, 0, false),
        entry("load steps", "on: four steps", Scene { steps: Some(4), ..base }, 0, false),
        entry("second body", "rigid", Scene { rigid: true, ..base }, 0, false),
        entry("contact", "off: no pair", Scene { contact: Contact::None, ..base }, 0, false),
        entry(
            "contact",
            "neutral: a pair too far apart",
            Scene { contact: Contact::Apart, ..base },
            11,
            false,
        ),
    ]
}

struct Row {
    instructions: f64,
    one: Done,
    two: Done,
}

fn measure(scene: &Scene, directory: &Path) -> Result<Row> {
    let case = directory.join("case.toml");
    std::fs::write(&case, scene.text()).map_err(Error::internal)?;
    let mut run = Run { case, sets: Vec::new(), ranks: 1 };
    let one = run.run()?;
    let instructions = instructions(&run, &directory.join("out"))?;
    run.ranks = 2;
    Ok(Row { instructions, one, two: run.run()? })
}

/// Instructions of a run, from the line `I refs: 1,234` of valgrind.
fn instructions(run: &Run, out: &Path) -> Result<f64> {
    let counter = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"];
    let mut command: Command = run.command(&counter, out);
    let output =
        command.stderr(Stdio::piped()).output().map_err(|e| Error::internal(format!("valgrind: {e}")))?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let digits = |line: &str| line.chars().filter(char::is_ascii_digit).collect::<String>().parse().ok();
    let count = said.lines().find_map(|line| digits(line.split_once("refs:")?.1));
    count
        .filter(|_| output.status.success())
        .ok_or_else(|| Error::internal(format!("valgrind has counted nothing:\n{said}")))
}

fn main() -> Result<()> {
    let directory = std::env::temp_dir().join(format!("kontakt-effects-{}", std::process::id()));
    std::fs::create_dir_all(&directory).map_err(Error::internal)?;
    let entries = entries();
    let rows: Result<Vec<Row>> = entries.iter().map(|entry| measure(&entry.scene, &directory)).collect();
    let _ = std::fs::remove_dir_all(&directory);
    let rows = rows?;
    let costly: Vec<&str> = std::iter::zip(&entries, &rows)
        .filter(|(entry, row)| entry.free && (ratio(row, &rows[entry.against]) - 1.0).abs() > NOTHING)
        .map(|(entry, _)| entry.effect)
        .collect();
    common::write_page("effects.md", &page(&entries, &rows))?;
    let json = std::iter::zip(&entries, &rows).map(|(entry, row)| {
        serde_json::json!({
            "effect": entry.effect,
            "state": entry.state,
            "instructions": row.instructions,
            "ratio": ratio(row, &rows[entry.against]),
            "against": entry.against,
            "unknowns": row.one.sum("dofs"),
            "factorisations": row.one.sum("factorisations"),
            "solves": row.one.sum("solves"),
            "alternations": row.one.number("alternations"),
            "messages": row.two.summary["exchange"]["messages"],
            "bytes_sent": row.two.summary["exchange"]["bytes"],
            "bytes_written": row.one.bytes,
        })
    });
    common::add_json("effects", json.collect())?;
    match costly.is_empty() {
        true => Ok(()),
        false => Err(Error::internal(format!("off, but not free: {}", costly.join(", ")))),
    }
}

/// Instructions against those of another row.
fn ratio(row: &Row, other: &Row) -> f64 {
    row.instructions / other.instructions
}

fn page(entries: &[Entry], rows: &[Row]) -> String {
    let mut text = String::from(
        "# Only what the scene calls for\n\n\
         Written by `scripts/bench --only effects`. Two half discs pressed together, about 4800 unknowns; in each row one effect is \
         changed. Instructions are\n\
         those of the whole process on one rank, start-up and pictures included, counted by valgrind; \"times\" compares them with the row \
         named. Messages and\n\
         their bytes are those between the two rank groups of a run on two ranks; one rank sends none. What is off is free within 1 %, \
         which this benchmark\n\
         and, by counters, tests/effects.rs check.\n\n\
         | row | effect | state | instructions, 10^9 | times (row) | unknowns | factorisations | solves | alternations | messages | kB sent | kB written |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (i, (entry, row)) in std::iter::zip(entries, rows).enumerate() {
        let sent = |key: &str| row.two.summary["exchange"][key].as_f64().unwrap_or(f64::NAN);
        text += &format!(
            "| {} | {} | {} | {:.3} | {:.3} ({}) | {} | {} | {} | {} | {} | {:.0} | {:.0} |\n",
            i + 1,
            entry.effect,
            entry.state,
            1e-9 * row.instructions,
            ratio(row, &rows[entry.against]),
            entry.against + 1,
            row.one.sum("dofs"),
            row.one.sum("factorisations"),
            row.one.sum("solves"),
            row.one.number("alternations"),
            sent("messages"),
            1e-3 * sent("bytes"),
            1e-3 * row.one.bytes as f64,
        );
    }
    text
}
