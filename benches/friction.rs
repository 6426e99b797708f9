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
    run::Run,
};
use kontakt::{Error, Result, case, output::Results};
use plotters::chart::SeriesLabelPosition;
use programs::{Comparison, Program, Row, calculix, compare, decks::Pair, getfem};
use std::{path::Path, process::Command};

/// About how many unknowns are wanted, and how often each program runs.
const SIZES: [(f64, usize); 2] = [(40e3, 5), (160e3, 3)];

/// Coefficient of friction, and the share of what it can carry that acts, as in the case.
const FRICTION: f64 = 0.3;
const SHARE: f64 = 0.5;

/// The programs, and kontakt where nothing holds the surfaces and nothing shears them.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Contender {
    Kontakt,
    Frictionless,
    GetFem,
    CalculiX,
}
use Contender::*;

impl Program for Contender {
    const ALL: &'static [Contender] = &[Kontakt, Frictionless, GetFem, CalculiX];

    /// Relative error.
    type Found = f64;

    fn name(self) -> &'static str {
        match self {
            Kontakt => "kontakt",
            Frictionless => "kontakt frictionless",
            GetFem => "GetFEM",
            CalculiX => "CalculiX",
        }
    }

    fn scene(dofs: f64) -> Result<Pair> {
        Pair::new(&case::read(&common::partial_slip(), None, &common::sizes(dofs))?, common::REACH)
    }

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

    /// Of the tangential traction; NaN without friction.
    fn found(self, directory: &Path) -> Result<f64> {
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

    fn setting(self, dofs: f64, directory: &Path) -> String {
        match self {
            Kontakt | Frictionless => String::new(),
            GetFem => format!("{} Newton steps", getfem::steps(directory)),
            CalculiX => {
                let [penalty, stick] = calculix::friction_penalties(dofs);
                format!("penalty {penalty} E/h, stick {stick} E/h")
            }
        }
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

fn main() -> Result<()> {
    common::in_scratch("friction", all)
}

fn all(directory: &Path) -> Result<()> {
    let all = compare::<Contender>(&SIZES, directory)?;
    common::write_page("friction.md", &page(&all))?;
    common::plot::draw("friction", &panels(&all.rows))?;
    common::add_json("friction", all.json(|r, row| row["q_error"] = r.found.into()))
}

fn page(all: &Comparison<Contender>) -> String {
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
    text += &(all.start_ups()
        + "

");
    text += "| dofs | program | setting | CPU s | times kontakt | peak memory, MB | error of q |\n\
             |---|---|---|---|---|---|---|\n";
    for r in &all.rows {
        let error = if r.found.is_finite() { format!("{:.2} %", 100.0 * r.found) } else { String::new() };
        text += &format!(
            "| {} | {} | {} | {:.2} | {:.1} | {:.0} | {error} |\n",
            r.dofs,
            r.program.name(),
            r.setting,
            r.net,
            all.times(r, Kontakt),
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

fn panels(rows: &[Row<Contender>]) -> [Panel; 2] {
    let curve = |program: Contender, point: fn(&Row<Contender>) -> (f64, f64, String)| Curve {
        name: program.name().into(),
        points: rows.iter().filter(|r| r.program == program).map(point).collect(),
    };
    // In the same order, so that the colours are the programs'.
    let error = [Kontakt, GetFem, CalculiX]
        .map(|p| curve(p, |r| (r.net, 100.0 * r.found, format!("{:.0}k", r.dofs as f64 / 1e3))));
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
