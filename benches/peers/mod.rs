//! What the benchmarks against other programs share: the programs' decks, and all of them measured in turn.
#![allow(dead_code)]

pub mod calculix;
pub mod decks;
pub mod getfem;

use crate::common::process::{self, Spent};
use decks::Pair;
use kontakt::Result;
use std::{path::Path, process::Command};

/// Unknowns of the run that shows what a program spends before it has anything to do, and its repetitions.
const EMPTY: (f64, usize) = (300.0, 9);

/// A program on one scene, of about so many unknowns.
pub trait Program: Copy + PartialEq + 'static {
    /// All that are compared.
    const ALL: &'static [Self];

    /// What a run has found.
    type Found;

    fn name(self) -> &'static str;

    /// The scene.
    fn scene(dofs: f64) -> Result<Pair>;

    /// Writes what the program reads.
    fn prepare(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<()>;

    fn command(self, pair: &Pair, dofs: f64, directory: &Path) -> Command;

    /// From what a run has left.
    fn found(self, directory: &Path) -> Result<Self::Found>;

    /// What was set, in words.
    fn setting(self, dofs: f64, directory: &Path) -> String;

    /// One run: what it spent and found.
    fn run(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<(Spent, Self::Found)> {
        let log = directory.join(format!("{}.log", self.name()));
        let mut command = self.command(pair, dofs, directory);
        let spent = process::run(command.env("OMP_NUM_THREADS", "1"), &log)?;
        Ok((spent, self.found(directory)?))
    }
}

/// The programs, each once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Contender {
    Kontakt,
    GetFem,
    CalculiX,
}

impl Contender {
    pub const EACH: &'static [Contender] = &[Contender::Kontakt, Contender::GetFem, Contender::CalculiX];

    /// What it is called.
    pub fn called(self) -> &'static str {
        match self {
            Contender::Kontakt => "kontakt",
            Contender::GetFem => "GetFEM",
            Contender::CalculiX => "CalculiX",
        }
    }

    /// Writes its deck, if it has one.
    pub fn write_deck(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<()> {
        match self {
            Contender::Kontakt => Ok(()),
            Contender::GetFem => getfem::prepare(pair, directory),
            Contender::CalculiX => calculix::prepare(pair, dofs, directory),
        }
    }
}

/// A program at a size: the cheapest of its runs.
pub struct Row<P: Program> {
    pub program: P,
    pub dofs: usize,
    /// Of the whole process.
    pub spent: Spent,
    /// CPU seconds less those of the empty run.
    pub net: f64,
    pub found: P::Found,
    pub setting: String,
}

/// All programs at all sizes, and what each spends on an empty run, in CPU seconds.
pub struct Comparison<P: Program> {
    pub rows: Vec<Row<P>>,
    starts: Vec<(P, f64)>,
}

/// Measures all programs at these sizes, with their repetitions.
pub fn compare<P: Program>(sizes: &[(f64, usize)], directory: &Path) -> Result<Comparison<P>> {
    let (_, empty) = measure::<P>(EMPTY, directory)?;
    let starts: Vec<(P, f64)> =
        std::iter::zip(P::ALL, &empty).map(|(program, (spent, _))| (*program, spent.cpu)).collect();
    let mut rows = Vec::new();
    for &size in sizes {
        let (dofs, runs) = measure::<P>(size, directory)?;
        for (&(program, start), (spent, found)) in std::iter::zip(&starts, runs) {
            let setting = program.setting(size.0, directory);
            rows.push(Row { program, dofs, spent, net: spent.cpu - start, found, setting });
        }
    }
    Ok(Comparison { rows, starts })
}

/// What each program spent and found.
type Runs<P> = Vec<(Spent, <P as Program>::Found)>;

/// Runs of all programs in turn, the cheapest of each.
fn measure<P: Program>((dofs, repetitions): (f64, usize), directory: &Path) -> Result<(usize, Runs<P>)> {
    let pair = P::scene(dofs)?;
    for program in P::ALL {
        program.prepare(&pair, dofs, directory)?;
    }
    let runs = process::cheapest(P::ALL, repetitions, |program| program.run(&pair, dofs, directory))?;
    Ok((pair.dofs(), runs))
}

impl<P: Program> Comparison<P> {
    /// `kontakt 0.15 s, GetFEM 0.12 s.`
    pub fn start_ups(&self) -> String {
        let each = self.starts.iter().map(|(program, cpu)| format!("{} {cpu:.2} s", program.name()));
        each.collect::<Vec<_>>().join(", ") + "."
    }

    /// Net CPU seconds of a row over those of `own` at the same size.
    pub fn times(&self, row: &Row<P>, own: P) -> f64 {
        let own = self.rows.iter().find(|r| r.program == own && r.dofs == row.dofs);
        row.net / own.expect("every program runs at every size").net
    }

    /// The rows for scripts, with what was found added to each.
    pub fn json(&self, add: impl Fn(&Row<P>, &mut serde_json::Value)) -> serde_json::Value {
        let row = |r: &Row<P>| {
            let mut row = serde_json::json!({
                "program": r.program.name(),
                "dofs": r.dofs,
                "cpu_seconds": r.net,
                "startup_cpu_seconds": r.spent.cpu - r.net,
                "peak_mb": r.spent.peak_mb,
            });
            add(r, &mut row);
            row
        };
        self.rows.iter().map(row).collect()
    }
}
