//! What is going on: a bar on a terminal, else a line for each run.
use super::front::seconds;
use super::plan::{Plan, Run};
use super::run::Measured;
use crate::vector::larger;
use indicatif::{ProgressBar, ProgressStyle};
use std::{cell::Cell, io::IsTerminal};

/// The bar advances by expected seconds; this many steps each.
const STEPS: f64 = 1000.0;

pub(super) struct Progress {
    bar: Option<ProgressBar>,
    runs: usize,
    repeat: usize,
    number: Cell<usize>,
}

impl Progress {
    /// Says what is to come.
    pub fn new<'a>(plan: &Plan, missing: impl Iterator<Item = &'a Run>) -> Progress {
        let guesses: Vec<f64> = missing.map(Run::guess).collect();
        let guess: f64 = guesses.iter().sum();
        let (all, _) = plan.size();
        let repeat = plan.case.study.repeat;
        let levels = plan.case.study.levels.len();
        let largest = plan.runs.iter().map(|run| run.dofs).fold(0.0, larger);
        eprintln!(
            "study of {}: {} x {} x {} = {all} runs, up to about {} unknowns",
            plan.case.name,
            plural(plan.choices.len(), "choice"),
            plural(levels, "level"),
            plural(repeat, "repetition"),
            largest.round()
        );
        let done = all - guesses.len();
        match (guesses.len(), done) {
            (0, _) => eprintln!("all of them are done already"),
            (left, 0) => eprintln!("{}, about {} on a machine of today", plural(left, "run"), seconds(guess)),
            (left, _) => eprintln!("{done} are done already, {left} are left, about {}", seconds(guess)),
        }
        let bar = (std::io::stderr().is_terminal() && !guesses.is_empty()).then(|| {
            let bar = ProgressBar::new((STEPS * guess) as u64);
            let style = ProgressStyle::with_template("{bar:30} {percent:>3} %, {eta} left  {wide_msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        Progress { bar, runs: guesses.len(), repeat, number: Cell::new(0) }
    }

    /// A run begins.
    pub fn start(&self, run: &Run, label: &str, repetition: usize) {
        if let Some(bar) = &self.bar {
            bar.set_message(self.name(run, label, repetition));
        }
    }

    /// It has ended.
    pub fn done(&self, run: &Run, label: &str, repetition: usize, measured: &Measured) {
        if self.bar.is_none() {
            let name = self.name(run, label, repetition);
            let time = seconds(measured.process_seconds);
            eprintln!("run {}/{}: {name}: {}, {time}", self.number.get() + 1, self.runs, measured.ending());
        }
        self.skip(run);
    }

    /// It is not needed.
    pub fn skip(&self, run: &Run) {
        self.number.set(self.number.get() + 1);
        if let Some(bar) = &self.bar {
            bar.inc((STEPS * run.guess()) as u64);
        }
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn name(&self, run: &Run, label: &str, repetition: usize) -> String {
        let mut name = format!("level {}", run.level);
        if !label.is_empty() {
            name.extend([", ", label]);
        }
        if self.repeat > 1 {
            name.push_str(&format!(", repetition {} of {}", repetition + 1, self.repeat));
        }
        name
    }
}

fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
