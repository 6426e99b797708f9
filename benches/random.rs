//! Runs random scenes: `scripts/random [--seed N] [--scenes N] [--from N] [--json FILE]`.
//!
//! One line for each scene: its number, verdict and what it was compared with. The cases of those that fail are left in
//! target/random. Exit code 0 only if all are right.
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/random/mod.rs"]
mod random;

use random::Verdict;
use std::{path::Path, process::ExitCode};

const USAGE: &str = "usage: scripts/random [--seed N] [--scenes N] [--from N] [--json FILE]";

fn main() -> ExitCode {
    let (mut seed, mut scenes, mut from, mut json) = (1, 200, 0, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        // From cargo bench.
        if argument == "--bench" {
            continue;
        }
        let value = arguments.next().unwrap_or_default();
        let number = |into: &mut u64| value.parse().map(|value| *into = value).is_ok();
        let understood = match argument.as_str() {
            "--seed" => number(&mut seed),
            "--scenes" => number(&mut scenes),
            "--from" => number(&mut from),
            "--json" => {
                json = Some(value.clone());
                !value.is_empty()
            }
            _ => false,
        };
        if !understood {
            eprintln!("{argument}: unknown or without its value\n{USAGE}");
            return ExitCode::from(2);
        }
    }
    let keep = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/random");
    println!("seed {seed}\nscene family     verdict   alts.  compared with");
    let mut rows = Vec::new();
    for number in from..from + scenes {
        let row = random::check(seed, number);
        println!("{}", row.line());
        if row.verdict != Verdict::Right {
            match row.keep(&keep, seed) {
                Ok(folder) => println!("      kontakt run {}", folder.display()),
                Err(e) => eprintln!("cannot keep the case: {e}"),
            }
        }
        rows.push(row);
    }
    let count = |verdict| rows.iter().filter(|row| row.verdict == verdict).count();
    let (right, wrong, unsolved) = (count(Verdict::Right), count(Verdict::Wrong), count(Verdict::Unsolved));
    println!(
        "{} scenes of seed {seed}: {right} right, {wrong} wrong and called converged, {unsolved} unsolved",
        rows.len()
    );
    let list: Vec<serde_json::Value> = rows.iter().map(random::Row::json).collect();
    let text = serde_json::to_string_pretty(&list).expect("plain values") + "\n";
    let written = json.map_or(Ok(()), |file| std::fs::write(file, text));
    if let Err(e) = &written {
        eprintln!("cannot write: {e}");
    }
    ExitCode::from(u8::from(wrong + unsolved > 0 || written.is_err()))
}
