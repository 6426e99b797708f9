//! kontakt against other open programs on the same meshes: CPU seconds, memory, error.
//!
//! `scripts/bench --only peers [--json FILE]` writes docs/benchmarks/peers.md and its picture.
//!
//! Two half discs (cases/hertz-line) at four sizes, quad4, displacement driven; the whole process of each program on one
//! thread, result files written. All programs take turns; the least CPU seconds of the repetitions count, less those of a
//! run on a mesh of a few elements.
mod common;
#[path = "peers/mod.rs"]
mod programs;

use common::{
    plot::{Curve, Panel},
    process::{self, Spent},
    run::Run,
};
use kontakt::{Error, Result};
use plotters::chart::SeriesLabelPosition;
use programs::{calculix, decks::Pair, getfem};
use std::{path::Path, process::Command};

/// About how many unknowns are wanted, and how often each program runs.
const SIZES: [(f64, usize); 4] = [(5e3, 5), (20e3, 5), (77e3, 3), (308e3, 2)];
/// Unknowns of the run that shows what a program spends before it has anything to do, and its repetitions.
const EMPTY: (f64, usize) = (300.0, 9);

/// The programs.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Program {
    Kontakt,
    GetFem,
    CalculiX,
}
use Program::*;

impl Program {
    const ALL: [Program; 3] = [Kontakt, GetFem, CalculiX];

    fn name(self) -> &'static str {
        match self {
            Kontakt => "kontakt",
            GetFem => "GetFEM",
            CalculiX => "CalculiX",
        }
    }

    /// Writes what the program reads, for about `dofs` unknowns.
    fn prepare(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<()> {
        match self {
            Kontakt => Ok(()),
            GetFem => getfem::prepare(pair, directory),
            CalculiX => calculix::prepare(pair, dofs, directory),
        }
    }

    fn command(self, pair: &Pair, dofs: f64, directory: &Path) -> Command {
        match self {
            Kontakt => Run::hertz(dofs, &[]).command(&[], &directory.join("kontakt")),
            GetFem => getfem::command(pair, directory),
            CalculiX => calculix::command(directory),
        }
    }

    /// Peak pressure of a run, Pa.
    fn peak(self, directory: &Path) -> Result<f64> {
        let found = match self {
            Kontakt => {
                let text =
                    std::fs::read_to_string(directory.join("kontakt/summary.json")).unwrap_or_default();
                let summary: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
                summary["pairs"][0]["max_pressure"].as_f64()
            }
            GetFem => getfem::peak(directory),
            CalculiX => calculix::peak(directory),
        };
        found.ok_or_else(|| Error::internal(format!("{} has left no contact pressure", self.name())))
    }

    /// One run: what it spent and its peak pressure.
    fn run(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<(Spent, f64)> {
        let log = directory.join(format!("{}.log", self.name()));
        let mut command = self.command(pair, dofs, directory);
        let spent = process::run(command.env("OMP_NUM_THREADS", "1"), &log)?;
        Ok((spent, self.peak(directory)?))
    }
}

/// A program at a size: the cheapest of its runs.
struct Row {
    program: Program,
    dofs: usize,
    /// Of the whole process.
    spent: Spent,
    /// CPU seconds less those of the empty run.
    net: f64,
    /// Relative.
    error: f64,
    setting: String,
}

/// Runs of all programs in turn, the cheapest of each.
fn measure(dofs: f64, repetitions: usize, directory: &Path) -> Result<(usize, Vec<(Spent, f64)>)> {
    let pair = Pair::new(&common::sized_case(dofs, &[])?)?;
    let count = pair.dofs();
    for program in Program::ALL {
        program.prepare(&pair, dofs, directory)?;
    }
    let runs = process::cheapest(&Program::ALL, repetitions, |p| p.run(&pair, dofs, directory))?;
    Ok((count, runs))
}

fn main() -> Result<()> {
    common::in_scratch("peers", all)
}

fn all(directory: &Path) -> Result<()> {
    let (_, empty) = measure(EMPTY.0, EMPTY.1, directory)?;
    let empty: Vec<Spent> = empty.into_iter().map(|(spent, _)| spent).collect();
    let mut rows = Vec::new();
    for (size, repetitions) in SIZES {
        let (dofs, runs) = measure(size, repetitions, directory)?;
        for ((program, empty), (spent, peak)) in std::iter::zip(std::iter::zip(Program::ALL, &empty), runs) {
            let setting = match program {
                Kontakt => String::new(),
                GetFem => format!("{} Newton steps", getfem::steps(directory)),
                CalculiX => format!("penalty {} E/h", calculix::penalty(size)),
            };
            let error = peak / common::PEAK - 1.0;
            rows.push(Row { program, dofs, spent, net: spent.cpu - empty.cpu, error, setting });
        }
    }
    common::write_page("peers.md", &page(&rows, &empty))?;
    common::plot::draw("peers", &panels(&rows))?;
    let json = rows.iter().map(|r| {
        serde_json::json!({
            "program": r.program.name(),
            "dofs": r.dofs,
            "cpu_seconds": r.net,
            "startup_cpu_seconds": r.spent.cpu - r.net,
            "peak_mb": r.spent.peak_mb,
            "peak_pressure_error": r.error,
        })
    });
    common::add_json("peers", json.collect())
}

fn page(rows: &[Row], empty: &[Spent]) -> String {
    let mut text = String::from(
        "# Against other open programs\n\n\
         Written by `scripts/bench --only peers`. Two half discs pressed together (cases/hertz-line): the same nodes and quad4 cells for \
         all, plane strain,\n\
         displacements prescribed on the flats, peak pressure compared with Hertz. CPU seconds (user and system) of the whole process \
         on one thread,\n\
         result file written; the programs take turns, the least of the repetitions counts. The start-up of each, measured on a mesh of a \
         few elements, is\n\
         subtracted: ",
    );
    let starts = std::iter::zip(Program::ALL, empty).map(|(p, e)| format!("{} {:.2} s", p.name(), e.cpu));
    text += &(starts.collect::<Vec<_>>().join(", ") + ".\n\n");
    text += "| dofs | program | setting | CPU s | times kontakt | peak memory, MB | error of peak pressure |\n\
             |---|---|---|---|---|---|---|\n";
    for r in rows {
        let own = rows
            .iter()
            .find(|k| k.program == Kontakt && k.dofs == r.dofs)
            .expect("kontakt runs at every size");
        text += &format!(
            "| {} | {} | {} | {:.2} | {:.1} | {:.0} | {:+.3} % |\n",
            r.dofs,
            r.program.name(),
            r.setting,
            r.net,
            r.net / own.net,
            r.spent.peak_mb,
            100.0 * r.error
        );
    }
    text += "\n![CPU seconds, memory and error](peers.png)\n\n";
    text += "Each program at the best sound setting found, and each finds the error of the mesh:\n\n";
    text += getfem::SETTING;
    text += calculix::SETTING;
    text += "- kontakt: the default driver, both bodies condensed; nothing to set.\n\n\
             An error crosses zero where a penalty is tuned, so that the errors of one column say the size, not the rank.\n";
    text
}

fn panels(rows: &[Row]) -> [Panel; 2] {
    let curves = |point: fn(&Row) -> (f64, f64, String)| {
        let curve = |program: Program| Curve {
            name: program.name().into(),
            points: rows.iter().filter(|r| r.program == program).map(point).collect(),
        };
        Program::ALL.map(curve).into()
    };
    [
        Panel {
            title: "Work and precision".into(),
            x: "CPU seconds, less start-up".into(),
            y: "error of peak pressure, %".into(),
            curves: curves(|r| (r.net, 100.0 * r.error.abs(), format!("{:.0}k", r.dofs as f64 / 1e3))),
            legend: SeriesLabelPosition::UpperRight,
        },
        Panel {
            title: "Cost over size".into(),
            x: "unknowns".into(),
            y: "CPU seconds, less start-up".into(),
            curves: curves(|r| (r.dofs as f64, r.net, String::new())),
            legend: SeriesLabelPosition::UpperLeft,
        },
    ]
}
