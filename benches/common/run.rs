//! Runs of kontakt.
use super::process::{self, Spent};
use kontakt::{Error, Result};
use serde_json::Value;
use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// A case with settings, on some ranks.
pub struct Run {
    pub case: PathBuf,
    pub sets: Vec<String>,
    pub ranks: usize,
}

/// What a run has spent and reported.
#[derive(Clone)]
pub struct Done {
    pub spent: Spent,
    pub summary: Value,
    /// Bytes of result.vtkhdf.
    pub bytes: u64,
}

impl Run {
    /// The Hertz case with about `dofs` unknowns on one rank.
    pub fn hertz(dofs: f64, more: &[&str]) -> Run {
        let mut sets = super::sizes(dofs);
        sets.extend(more.iter().map(|s| s.to_string()));
        Run { case: super::hertz(), sets, ranks: 1 }
    }

    /// The command; `before` is put before the program, as valgrind is.
    pub fn command(&self, before: &[&str], out: &Path) -> Command {
        let program = env!("CARGO_BIN_EXE_kontakt");
        let mut words: Vec<String> = Vec::new();
        if self.ranks > 1 {
            words.extend(["mpirun", "-q", "-n", &self.ranks.to_string()].map(String::from));
        }
        words.extend(before.iter().map(|w| w.to_string()));
        words.extend([program, "run"].map(String::from));
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).arg(&self.case).arg("--out").arg(out).env("OMP_NUM_THREADS", "1");
        for set in &self.sets {
            command.args(["--set", set]);
        }
        command.stdout(Stdio::null());
        command
    }

    /// Runs it, results into a directory of its own that is removed again.
    pub fn run(&self) -> Result<Done> {
        let out = std::env::temp_dir().join(format!("kontakt-bench-{}", std::process::id()));
        let done = self.run_into(&out);
        let _ = std::fs::remove_dir_all(&out);
        done
    }

    fn run_into(&self, out: &Path) -> Result<Done> {
        let log = out.with_extension("log");
        let spent = process::run(&mut self.command(&[], out), &log);
        let _ = std::fs::remove_file(log);
        let spent = spent?;
        let text = std::fs::read_to_string(out.join("summary.json")).map_err(Error::internal)?;
        let summary = serde_json::from_str(&text).map_err(Error::internal)?;
        let bytes = std::fs::metadata(out.join("result.vtkhdf")).map_err(Error::internal)?.len();
        Ok(Done { spent, summary, bytes })
    }
}

impl Done {
    /// Wall seconds of a phase of the run.
    pub fn seconds(&self, phase: &str) -> f64 {
        self.summary["seconds"][phase].as_f64().unwrap_or(f64::NAN)
    }

    /// A number of the summary.
    pub fn number(&self, key: &str) -> f64 {
        self.summary[key].as_f64().unwrap_or(f64::NAN)
    }

    /// Sum over the bodies.
    pub fn sum(&self, key: &str) -> u64 {
        let bodies = self.summary["bodies"].as_array().into_iter().flatten();
        bodies.filter_map(|b| b[key].as_u64()).sum()
    }

    /// Relative error of the Hertz peak pressure.
    pub fn peak_error(&self) -> f64 {
        self.summary["pairs"][0]["max_pressure"].as_f64().unwrap_or(f64::NAN) / super::PEAK - 1.0
    }
}

/// Of runs made in turn, `repetitions` times, the one with the least of `cost` for each.
pub fn least(runs: &[Run], repetitions: usize, cost: fn(&Done) -> f64) -> Result<Vec<Done>> {
    let mut best: Vec<Option<Done>> = vec![None; runs.len()];
    for _ in 0..repetitions {
        for (run, best) in std::iter::zip(runs, &mut best) {
            let done = run.run()?;
            if best.as_ref().is_none_or(|b| cost(&done) < cost(b)) {
                *best = Some(done);
            }
        }
    }
    Ok(best.into_iter().flatten().collect())
}

/// The case file without its `[[contact]]` tables and what is known of them, as text in another file.
pub fn without_contact(case: &Path, file: &Path) -> Result<()> {
    let text = std::fs::read_to_string(case).map_err(Error::internal)?;
    let mut inside = false;
    let kept = text.lines().filter(|line| {
        if line.starts_with('[') {
            inside = matches!(*line, "[[contact]]" | "[exact]");
        }
        !inside
    });
    std::fs::write(file, kept.collect::<Vec<_>>().join("\n") + "\n").map_err(Error::internal)
}
