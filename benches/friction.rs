//! Friction: kontakt against other open programs, and against itself without friction, on the same meshes.
//!
//! `scripts/bench --only friction [--json FILE]` writes docs/benchmarks/friction.md and its picture.
//!
//! Two half discs pressed together, then sheared by half of what friction can carry (cases/partial-slip); the whole process of
//! each program on one thread, result files written. All programs take turns; the least CPU seconds of the repetitions count,
//! less those of a run on a mesh of a few elements. The tangential traction is compared with Cattaneo's and Mindlin's.
mod common;
#[path = "peers/mod.rs"]
mod programs;

use common::{
    plot::{Curve, Panel},
    process::{self, Spent},
    run::Run,
};
use kontakt::{Error, Result, case, output::Results};
use plotters::chart::SeriesLabelPosition;
use programs::{calculix, decks::Pair, getfem};
use std::{path::Path, process::Command};

/// About how many unknowns are wanted, and how often each program runs.
const SIZES: [(f64, usize); 2] = [(40e3, 5), (160e3, 3)];
/// Unknowns of the run that shows what a program spends before it has anything to do, and its repetitions.
const EMPTY: (f64, usize) = (300.0, 9);

/// Coefficient of friction, and the share of what it can carry that acts, as in the case.
const FRICTION: f64 = 0.3;
const SHARE: f64 = 0.5;

/// The programs, and kontakt where nothing holds the surfaces and nothing shears them.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Program {
    Kontakt,
    Frictionless,
    GetFem,
    CalculiX,
}
use Program::*;

impl Program {
    const ALL: [Program; 4] = [Kontakt, Frictionless, GetFem, CalculiX];

    fn name(self) -> &'static str {
        match self {
            Kontakt => "kontakt",
            Frictionless => "kontakt frictionless",
            GetFem => "GetFEM",
            CalculiX => "CalculiX",
        }
    }

    /// Writes what the program reads, for about `dofs` unknowns.
    fn prepare(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<()> {
        match self {
            Kontakt | Frictionless => Ok(()),
            GetFem => getfem::prepare(pair, directory),
            CalculiX => calculix::prepare(pair, dofs, directory),
        }
    }

    fn command(self, pair: &Pair, dofs: f64, directory: &Path) -> Command {
        let own = |more: &[&str]| {
            let sets =
                common::sizes(dofs).into_iter().chain(more.iter().map(|set| set.to_string())).collect();
            Run { case: common::partial_slip(), sets, ranks: 1 }.command(&[], &directory.join("kontakt"))
        };
        match self {
            Kontakt => own(&[]),
            Frictionless => own(&["contact.contact.friction = 0", "step.shear.loads = 0"]),
            GetFem => getfem::command(pair, directory),
            CalculiX => calculix::command(directory),
        }
    }

    /// Relative error of the tangential traction that a run has left; NaN without friction.
    fn error(self, directory: &Path) -> Result<f64> {
        let found = match self {
            Kontakt => tractions(&Results::read_last(&directory.join("kontakt/result.vtkhdf"))?),
            Frictionless => return Ok(f64::NAN),
            GetFem => getfem::tractions(directory),
            CalculiX => calculix::tractions(directory),
        };
        let found =
            found.ok_or_else(|| Error::internal(format!("{} has left no contact stresses", self.name())))?;
        Ok(distance(&found))
    }

    /// One run: what it spent and its error.
    fn run(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<(Spent, f64)> {
        let log = directory.join(format!("{}.log", self.name()));
        let mut command = self.command(pair, dofs, directory);
        let spent = process::run(command.env("OMP_NUM_THREADS", "1"), &log)?;
        Ok((spent, self.error(directory)?))
    }
}

/// Tangential tractions, Pa, of the side with the multipliers by x.
fn tractions(results: &Results) -> Option<Vec<(f64, f64)>> {
    let side = results.pairs[0].sides.iter().flatten().find(|side| side.multipliers)?;
    let along = side.tangential.as_ref()?;
    Some(std::iter::zip(&side.x, &along.traction).map(|(x, q)| (x[0], *q)).collect())
}

/// Tangential traction of Cattaneo and Mindlin at x, Pa.
fn exact(x: f64) -> f64 {
    let root = |half_width: f64| (1.0 - (x / half_width).powi(2)).max(0.0).sqrt();
    let stick = (1.0 - SHARE).sqrt();
    FRICTION * common::PEAK * (root(common::HALF_WIDTH) - stick * root(stick * common::HALF_WIDTH))
}

/// Relative error in L2 of the tangential tractions at the nodes within the half-width, which stand for equal lengths. Their sense is
/// that of their sum.
fn distance(found: &[(f64, f64)]) -> f64 {
    let within = || found.iter().filter(|(x, _)| x.abs() <= common::HALF_WIDTH);
    let sense = within().map(|(_, q)| q).sum::<f64>().signum();
    let error: f64 = within().map(|&(x, q)| (sense * q - exact(x)).powi(2)).sum();
    (error / within().map(|&(x, _)| exact(x).powi(2)).sum::<f64>()).sqrt()
}

/// A program at a size: the cheapest of its runs.
struct Row {
    program: Program,
    dofs: usize,
    /// Of the whole process.
    spent: Spent,
    /// CPU seconds less those of the empty run.
    net: f64,
    /// Relative, of the tangential traction.
    error: f64,
    setting: String,
}

/// Runs of all programs in turn, the cheapest of each.
fn measure(dofs: f64, repetitions: usize, directory: &Path) -> Result<(usize, Vec<(Spent, f64)>)> {
    let pair = Pair::new(&case::read(&common::partial_slip(), None, &common::sizes(dofs))?)?;
    for program in Program::ALL {
        program.prepare(&pair, dofs, directory)?;
    }
    let runs = process::cheapest(&Program::ALL, repetitions, |p| p.run(&pair, dofs, directory))?;
    Ok((pair.dofs(), runs))
}

fn main() -> Result<()> {
    common::in_scratch("friction", all)
}

fn all(directory: &Path) -> Result<()> {
    let (_, empty) = measure(EMPTY.0, EMPTY.1, directory)?;
    let empty: Vec<Spent> = empty.into_iter().map(|(spent, _)| spent).collect();
    let mut rows = Vec::new();
    for (size, repetitions) in SIZES {
        let (dofs, runs) = measure(size, repetitions, directory)?;
        for ((program, empty), (spent, error)) in std::iter::zip(std::iter::zip(Program::ALL, &empty), runs) {
            let setting = match program {
                Kontakt | Frictionless => String::new(),
                GetFem => format!("{} Newton steps", getfem::steps(directory)),
                CalculiX => {
                    let [penalty, stick] = calculix::friction_penalties(size);
                    format!("penalty {penalty} E/h, stick {stick} E/h")
                }
            };
            rows.push(Row { program, dofs, spent, net: spent.cpu - empty.cpu, error, setting });
        }
    }
    common::write_page("friction.md", &page(&rows, &empty))?;
    common::plot::draw("friction", &panels(&rows))?;
    let json = rows.iter().map(|r| {
        serde_json::json!({
            "program": r.program.name(),
            "dofs": r.dofs,
            "cpu_seconds": r.net,
            "startup_cpu_seconds": r.spent.cpu - r.net,
            "peak_mb": r.spent.peak_mb,
            "q_error": r.error.is_finite().then_some(r.error),
        })
    });
    common::add_json("friction", json.collect())
}

fn page(rows: &[Row], empty: &[Spent]) -> String {
    let mut text = String::from(
        "# Friction against other open programs\n\n\
         Written by `scripts/bench --only friction`. Two half discs pressed together, then sheared by half of what friction can carry \
         (cases/partial-slip,\n\
         friction 0.3): the same nodes, quad4 cells, supports, loads and two steps for all (CalculiX: see below), plane strain. The error is that of the \
         tangential traction q at the nodes\n\
         within the half-width, relative in L2, against Cattaneo and Mindlin. CPU seconds (user and system) of the whole process on one \
         thread, result file\n\
         written; the programs take turns, the least of the repetitions counts. The start-up of each, measured on a mesh of a few \
         elements, is subtracted:\n",
    );
    let starts = std::iter::zip(Program::ALL, empty).map(|(p, e)| format!("{} {:.2} s", p.name(), e.cpu));
    text += &(starts.collect::<Vec<_>>().join(", ") + ".\n\n");
    text += "| dofs | program | setting | CPU s | times kontakt | peak memory, MB | error of q |\n\
             |---|---|---|---|---|---|---|\n";
    for r in rows {
        let own = rows
            .iter()
            .find(|k| k.program == Kontakt && k.dofs == r.dofs)
            .expect("kontakt runs at every size");
        let error = if r.error.is_finite() { format!("{:.2} %", 100.0 * r.error) } else { String::new() };
        text += &format!(
            "| {} | {} | {} | {:.2} | {:.1} | {:.0} | {error} |\n",
            r.dofs,
            r.program.name(),
            r.setting,
            r.net,
            r.net / own.net,
            r.spent.peak_mb,
        );
    }
    text += "\n![Error and CPU seconds](friction.png)\n\n";
    text += "Each program at the best sound setting found:\n\n";
    text += getfem::FRICTION_SETTING;
    text += calculix::FRICTION_SETTING;
    text += "- kontakt: the default driver, both bodies condensed; nothing to set. Frictionless: the same case and steps with friction 0 \
             and no shear.\n";
    text
}

fn panels(rows: &[Row]) -> [Panel; 2] {
    let curve = |program: Program, point: fn(&Row) -> (f64, f64, String)| Curve {
        name: program.name().into(),
        points: rows.iter().filter(|r| r.program == program).map(point).collect(),
    };
    // In the same order, so that the colours are the programs'.
    let error = [Kontakt, GetFem, CalculiX]
        .map(|p| curve(p, |r| (r.net, 100.0 * r.error, format!("{:.0}k", r.dofs as f64 / 1e3))));
    let cost = [Kontakt, GetFem, CalculiX, Frictionless]
        .map(|p| curve(p, |r| (r.dofs as f64 / 1e3, r.net, String::new())));
    [
        Panel {
            title: "Work and precision".into(),
            x: "CPU seconds, less start-up".into(),
            y: "error of the tangential traction, %".into(),
            curves: error.into(),
            legend: SeriesLabelPosition::UpperLeft,
        },
        Panel {
            title: "Cost over size".into(),
            x: "thousands of unknowns".into(),
            y: "CPU seconds, less start-up".into(),
            curves: cost.into(),
            legend: SeriesLabelPosition::UpperLeft,
        },
    ]
}
