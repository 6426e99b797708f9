//! Runs the hard cases: `scripts/hard [--json FILE] [--quick] [--filter TEXT] [--updated]`.
//!
//! One line for each case and variant of cases/hard. Run in full, it writes docs/hard-cases.md. Exit code 0 only if
//! every case does what it states.
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/hard/mod.rs"]
mod hard;

use std::{path::Path, process::ExitCode};

const USAGE: &str = "usage: scripts/hard [--json FILE] [--quick] [--filter TEXT] [--updated]";

fn main() -> ExitCode {
    let (mut json, mut quick, mut filter) = (None, false, String::new());
    let mut updated = false;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--json" => json = arguments.next(),
            "--quick" => quick = true,
            "--updated" => updated = true,
            "--filter" => filter = arguments.next().unwrap_or_default(),
            // From cargo bench.
            "--bench" => {}
            _ => {
                eprintln!("{argument}: unknown\n{USAGE}");
                return ExitCode::from(2);
            }
        }
    }
    let items = hard::items(quick, &filter);
    let items = if updated { hard::updated(items) } else { items };
    println!("{}", hard::heading());
    let mut rows = Vec::new();
    for item in &items {
        let row = hard::check(item, None);
        println!("{}", row.line());
        rows.push(row);
    }
    let wrong = rows.iter().filter(|row| !row.ok).count();
    println!("{} cases, {} as expected, {wrong} wrong", rows.len(), rows.len() - wrong);
    let mut written = Ok(());
    if let Some(file) = json {
        written = std::fs::write(file, hard::json(&rows));
    }
    if !quick && !updated && filter.is_empty() {
        let table = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/hard-cases.md");
        written = written.and(std::fs::write(table, hard::markdown(&rows)));
    }
    if let Err(e) = &written {
        eprintln!("cannot write: {e}");
    }
    ExitCode::from(u8::from(wrong > 0 || rows.is_empty() || written.is_err()))
}
