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
    run::Run,
};
use kontakt::{Error, Result};
use plotters::chart::SeriesLabelPosition;
use programs::{Comparison, Contender, Program, Row, calculix, compare, decks::Pair, getfem};
use std::{path::Path, process::Command};

/// About how many unknowns are wanted, and how often each program runs.
const SIZES: [(f64, usize); 4] = [(5e3, 5), (20e3, 5), (77e3, 3), (308e3, 2)];

use Contender::*;

impl Program for Contender {
    const ALL: &'static [Contender] = Contender::EACH;

    /// Relative error.
    type Found = f64;

    fn name(self) -> &'static str {
        self.called()
    }

    fn scene(dofs: f64) -> Result<Pair> {
        Pair::new(&common::sized_case(dofs, &[])?, common::REACH)
    }

    fn prepare(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<()> {
        self.write_deck(pair, dofs, directory)
    }

    fn command(self, pair: &Pair, dofs: f64, directory: &Path) -> Command {
        match self {
            Kontakt => Run::hertz(dofs, &[]).command(&[], &directory.join("kontakt")),
            GetFem => getfem::command(pair, directory),
            CalculiX => calculix::command(directory),
        }
    }

    /// Of the peak pressure.
    fn found(self, directory: &Path) -> Result<f64> {
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
        let peak =
            found.ok_or_else(|| Error::internal(format!("{} has left no contact pressure", self.name())))?;
        Ok(peak / common::PEAK - 1.0)
    }

    fn setting(self, dofs: f64, directory: &Path) -> String {
        match self {
            Kontakt => String::new(),
            GetFem => format!("{} Newton steps", getfem::steps(directory)),
            CalculiX => format!("penalty {} E/h", calculix::penalty(dofs)),
        }
    }
}

fn main() -> Result<()> {
    common::in_scratch("peers", all)
}

fn all(directory: &Path) -> Result<()> {
    let all = compare::<Contender>(&SIZES, directory)?;
    common::write_page("peers.md", &page(&all))?;
    common::plot::draw("peers", &panels(&all.rows))?;
    common::add_json("peers", all.json(|r, row| row["peak_pressure_error"] = r.found.into()))
}

fn page(all: &Comparison<Contender>) -> String {
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
    text += &(all.start_ups()
        + "

");
    text += "| dofs | program | setting | CPU s | times kontakt | peak memory, MB | error of peak pressure |\n\
             |---|---|---|---|---|---|---|\n";
    for r in &all.rows {
        text += &format!(
            "| {} | {} | {} | {:.2} | {:.1} | {:.0} | {:+.3} % |\n",
            r.dofs,
            r.program.name(),
            r.setting,
            r.net,
            all.times(r, Kontakt),
            r.spent.peak_mb,
            100.0 * r.found
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

fn panels(rows: &[Row<Contender>]) -> [Panel; 2] {
    let curves = |point: fn(&Row<Contender>) -> (f64, f64, String)| {
        let curve = |program: Contender| Curve {
            name: program.name().into(),
            points: rows.iter().filter(|r| r.program == program).map(point).collect(),
        };
        [Kontakt, GetFem, CalculiX].map(curve).into()
    };
    [
        Panel {
            title: "Work and precision".into(),
            x: "CPU seconds, less start-up".into(),
            y: "error of peak pressure, %".into(),
            curves: curves(|r| (r.net, 100.0 * r.found.abs(), format!("{:.0}k", r.dofs as f64 / 1e3))),
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
