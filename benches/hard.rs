//! Runs the hard cases: `scripts/hard [--json FILE] [--quick] [--filter TEXT] [--updated] [--friction]`.
//!
//! One line for each case and variant of cases/hard. Run in full, it writes docs/hard-cases.md. Exit code 0 only if
//! every case does what it states.
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/hard/mod.rs"]
mod hard;

use std::{path::Path, process::ExitCode};

const USAGE: &str = "usage: scripts/hard [--json FILE] [--quick] [--filter TEXT] [--updated] [--friction]";

fn main() -> ExitCode {
    let (mut json, mut quick, mut filter) = (None, false, String::new());
    let (mut updated, mut friction) = (false, false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--json" => json = arguments.next(),
            "--quick" => quick = true,
            "--updated" => updated = true,
            "--friction" => friction = true,
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
    let check = |item: &hard::Item| {
        let row = hard::check(item, None);
        println!("{}", row.line());
        row
    };
    let mut rows = Vec::new();
    let mut dear = Vec::new();
    if friction {
        let smooth: Vec<hard::Row> = hard::on_one_rank(items).iter().map(check).collect();
        for mu in hard::COEFFICIENTS {
            let of_mu: Vec<hard::Row> =
                hard::with_friction(hard::items(quick, &filter), mu).iter().map(check).collect();
            let ([median, most], faults) = hard::dearer(&smooth, &of_mu);
            println!(
                "mu {mu}: alternations over those without friction: median {median:.2}, largest {most:.2}"
            );
            faults.iter().for_each(|fault| println!("    {fault}"));
            dear.extend(faults);
            rows.extend(of_mu);
        }
    } else {
        rows.extend(items.iter().map(check));
    }
    let wrong = rows.iter().filter(|row| !row.ok).count();
    println!("{} cases, {} as expected, {wrong} wrong", rows.len(), rows.len() - wrong);
    let mut written = Ok(());
    if let Some(file) = json {
        written = std::fs::write(file, hard::json(&rows));
    }
    if !quick && !updated && !friction && filter.is_empty() {
        let table = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/hard-cases.md");
        written = written.and(std::fs::write(table, hard::markdown(&rows)));
    }
    if let Err(e) = &written {
        eprintln!("cannot write: {e}");
    }
    ExitCode::from(u8::from(wrong > 0 || !dear.is_empty() || rows.is_empty() || written.is_err()))
}
