//! Plasticity: kontakt against other open programs, and against itself with and without its plastic zone, on the same meshes.
//!
//! `scripts/bench --only plasticity [--json FILE]` writes docs/benchmarks/plasticity.md and its picture.
//!
//! A half disc pressed into a block, both of which yield, in ten equal steps (benches/indentation.toml); the whole process of each
//! program on one thread, result files written. All programs take turns; the least CPU seconds of the repetitions count, less those of
//! a run on a mesh of a few elements. There is no exact solution: the forces of all must agree.
mod common;
#[path = "peers/mod.rs"]
mod programs;

use common::{
    plot::{Curve, Panel},
    run::Run,
};
use kontakt::{Error, Result, case};
use plotters::chart::SeriesLabelPosition;
use programs::{
    Comparison, Contender, Program, Row, calculix, compare,
    decks::{Pair, YIELD},
    getfem,
};
use serde_json::Value;
use std::{path::Path, process::Command};

/// About how many unknowns are wanted, and how often each program runs.
const SIZES: &[(f64, usize)] = &[(5e3, 3), (20e3, 2), (77e3, 1)];
/// The same for kontakt against itself.
const ZONE_SIZES: &[(f64, usize)] = &[(77e3, 3)];
/// Displacements of the disc, m: about 5, 15 and 27 % of the elements yield.
const DEPTHS: [f64; 3] = [0.05e-3, 0.08e-3, DEPTH];
/// Against the other programs.
const DEPTH: f64 = 0.12e-3;
/// As in the case.
const STEPS: usize = 10;

/// Largest relative difference of the programs' forces, and of kontakt's with itself.
const AGREE: f64 = 0.01;
const SAME: f64 = 1e-6;

/// What is aimed at: times less CPU time than the best of the others, times less with the zone than without it at the least and
/// at the largest depth, and most by which the automatic choice is dearer than the cheaper of the two.
const AGAINST_OTHERS: f64 = 8.0;
const ZONE_GAINS: [f64; 2] = [2.5, 2.0];
const DEARER: f64 = 0.05;

use Contender::*;

/// kontakt: what stays elastic is condensed or not, at a depth.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Variant {
    zone: Zone,
    depth: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Zone {
    Never,
    Always,
    Automatic,
}

/// What a run has found.
#[derive(Debug, Clone, Copy, Default)]
pub struct Found {
    /// Of the contact at the end, N.
    force: f64,
    /// Factorisations and Newton iterations of all steps.
    factorisations: Option<f64>,
    iterations: Option<f64>,
    /// Shares of the elements at the end: that yield, and of the plastic zone.
    plastic: Option<f64>,
    zone: Option<f64>,
}

fn scene(dofs: f64) -> Result<Pair> {
    let case = case::read(&common::indentation(), None, &common::indentation_sizes(dofs))?;
    Pair::new(&case, common::INDENTER * common::INDENTED.sin())?.yielding(&case)
}

impl Program for Contender {
    const ALL: &'static [Contender] = Contender::EACH;

    type Found = Found;

    fn name(self) -> &'static str {
        self.called()
    }

    fn scene(dofs: f64) -> Result<Pair> {
        scene(dofs)
    }

    fn prepare(self, pair: &Pair, dofs: f64, directory: &Path) -> Result<()> {
        self.write_deck(pair, dofs, directory)
    }

    fn command(self, pair: &Pair, dofs: f64, directory: &Path) -> Command {
        match self {
            Kontakt => Variant { zone: Zone::Automatic, depth: DEPTH }.command(pair, dofs, directory),
            GetFem => getfem::command(pair, directory),
            CalculiX => calculix::command(directory),
        }
    }

    fn found(self, directory: &Path) -> Result<Found> {
        let (force, factorisations) = match self {
            Kontakt => return own(directory),
            GetFem => (getfem::force(directory), getfem::steps(directory)),
            CalculiX => (calculix::force(directory), calculix::factorisations(directory) as f64),
        };
        let force =
            force.ok_or_else(|| Error::internal(format!("{} has left no contact force", self.name())))?;
        Ok(Found {
            force: force.abs(),
            factorisations: Some(factorisations),
            iterations: Some(factorisations),
            ..Found::default()
        })
    }

    fn setting(self, _dofs: f64, _directory: &Path) -> String {
        String::new()
    }
}

impl Program for Variant {
    const ALL: &'static [Variant] = &variants();

    type Found = Found;

    fn name(self) -> &'static str {
        match self.zone {
            Zone::Never => "refactorise",
            Zone::Always => "zone",
            Zone::Automatic => "automatic",
        }
    }

    fn scene(dofs: f64) -> Result<Pair> {
        scene(dofs)
    }

    fn prepare(self, _pair: &Pair, _dofs: f64, _directory: &Path) -> Result<()> {
        Ok(())
    }

    fn command(self, _pair: &Pair, dofs: f64, directory: &Path) -> Command {
        let mut sets = common::indentation_sizes(dofs);
        sets.push(format!("body.upper.support.0.y = -{:e}", self.depth));
        match self.zone {
            Zone::Never => sets.push("plasticity.zone = \"never\"".into()),
            Zone::Always => sets.push("plasticity.zone = \"always\"".into()),
            Zone::Automatic => {}
        }
        Run { case: common::indentation(), sets, ranks: 1 }.command(&[], &directory.join("kontakt"))
    }

    fn found(self, directory: &Path) -> Result<Found> {
        own(directory)
    }

    fn setting(self, _dofs: f64, _directory: &Path) -> String {
        format!("{:.2} mm", 1e3 * self.depth)
    }
}

/// All at each depth.
const fn variants() -> [Variant; 9] {
    const ZONES: [Zone; 3] = [Zone::Never, Zone::Always, Zone::Automatic];
    let mut all = [Variant { zone: Zone::Never, depth: 0.0 }; 9];
    let mut i = 0;
    while i < all.len() {
        all[i] = Variant { zone: ZONES[i % 3], depth: DEPTHS[i / 3] };
        i += 1;
    }
    all
}

/// What kontakt's summary says.
fn own(directory: &Path) -> Result<Found> {
    let text = std::fs::read_to_string(directory.join("kontakt/summary.json")).map_err(Error::internal)?;
    let summary: Value = serde_json::from_str(&text).map_err(Error::internal)?;
    let force = summary["pairs"][0]["resultant"][1].as_f64();
    let force = force.ok_or_else(|| Error::internal("kontakt has left no contact force"))?;
    let plasticity = &summary["plasticity"];
    let bodies = plasticity["bodies"].as_array();
    let zones =
        bodies.map(|all| all.iter().filter_map(|body| body["zone_fraction"].as_f64()).collect::<Vec<_>>());
    Ok(Found {
        force: force.abs(),
        factorisations: plasticity["factorisations"].as_f64(),
        iterations: plasticity["iterations"].as_f64(),
        plastic: plasticity["plastic_fraction"].as_f64(),
        // The bodies have about as many elements.
        zone: zones.filter(|z| !z.is_empty()).map(|z| z.iter().sum::<f64>() / z.len() as f64),
    })
}

fn main() -> Result<()> {
    common::in_scratch("plasticity", all)
}

fn all(directory: &Path) -> Result<()> {
    let others = compare::<Contender>(SIZES, directory)?;
    for &dofs in &sizes(&others.rows) {
        let rows = || others.rows.iter().filter(move |r| r.dofs == dofs);
        agree(rows(), AGREE)?;
    }
    let zones = compare::<Variant>(ZONE_SIZES, directory)?;
    for depth in DEPTHS {
        agree(zones.rows.iter().filter(|r| r.program.depth == depth), SAME)?;
    }
    common::write_page("plasticity.md", &page(&others, &zones))?;
    common::plot::draw("plasticity", &panels(&others.rows, &zones.rows))?;
    let rows = [
        others.json(|r, row| {
            add(row, r.program.name(), if r.program == Kontakt { "automatic" } else { "" }, DEPTH, &r.found)
        }),
        zones.json(|r, row| add(row, "kontakt", r.program.name(), r.program.depth, &r.found)),
    ];
    common::add_json(
        "plasticity",
        rows.into_iter().flat_map(|rows| rows.as_array().cloned()).flatten().collect(),
    )
}

/// Adds what was found to a row for scripts.
fn add(row: &mut Value, program: &str, variant: &str, depth: f64, found: &Found) {
    row["program"] = program.into();
    row["variant"] = variant.into();
    row["depth"] = depth.into();
    row["steps"] = STEPS.into();
    row["force"] = found.force.into();
    row["factorisations"] = found.factorisations.into();
    row["iterations"] = found.iterations.into();
    row["plastic_fraction"] = found.plastic.into();
    row["zone_fraction"] = found.zone.into();
}

/// Unknowns of the rows, each once.
fn sizes(rows: &[Row<Contender>]) -> Vec<usize> {
    let mut sizes: Vec<usize> = rows.iter().map(|r| r.dofs).collect();
    sizes.dedup();
    sizes
}

/// An error if the forces differ by more than `most`, relative to their mean.
fn agree<'a, P: Program<Found = Found>>(rows: impl Iterator<Item = &'a Row<P>>, most: f64) -> Result<()> {
    let forces: Vec<(&str, f64)> = rows.map(|r| (r.program.name(), r.found.force)).collect();
    let mean = forces.iter().map(|(_, force)| force).sum::<f64>() / forces.len() as f64;
    match forces.iter().all(|(_, force)| (force / mean - 1.0).abs() <= most) {
        true => Ok(()),
        false => Err(Error::internal(format!("the forces do not agree, N: {forces:?}"))),
    }
}

/// A share in percent, a count, or nothing.
fn percent(share: Option<f64>) -> String {
    share.map_or(String::new(), |share| format!("{:.1} %", 100.0 * share))
}

fn count(number: Option<f64>) -> String {
    number.map_or(String::new(), |number| format!("{number:.0}"))
}

/// Net CPU seconds of a variant at a depth.
fn seconds(rows: &[Row<Variant>], zone: Zone, depth: f64) -> f64 {
    let row = rows.iter().find(|r| r.program == Variant { zone, depth });
    row.map_or(f64::NAN, |r| r.net)
}

/// What was aimed at, and what was reached.
fn targets(others: &Comparison<Contender>, rows: &[Row<Variant>]) -> String {
    let verdict = |reached: bool| if reached { "reached" } else { "missed" };
    let mut text = String::from("| aim | found | |\n|---|---|---|\n");
    for dofs in sizes(&others.rows) {
        let times = others.rows.iter().filter(|r| r.dofs == dofs && r.program != Kontakt);
        let best = times.map(|r| others.times(r, Kontakt)).fold(f64::INFINITY, f64::min);
        text += &format!(
            "| {dofs} unknowns: {AGAINST_OTHERS} times less than the best of the others | {best:.1} | {} |\n",
            verdict(best >= AGAINST_OTHERS)
        );
    }
    for (depth, aim) in [(DEPTHS[0], ZONE_GAINS[0]), (DEPTHS[2], ZONE_GAINS[1])] {
        let gain = seconds(rows, Zone::Never, depth) / seconds(rows, Zone::Always, depth);
        text += &format!(
            "| {:.2} mm: the zone {aim} times less than refactorising | {gain:.2} | {} |\n",
            1e3 * depth,
            verdict(gain >= aim)
        );
    }
    for depth in DEPTHS {
        let cheaper = seconds(rows, Zone::Never, depth).min(seconds(rows, Zone::Always, depth));
        let dearer = seconds(rows, Zone::Automatic, depth) / cheaper - 1.0;
        text += &format!(
            "| {:.2} mm: the automatic choice at most {:.0} % dearer than the cheaper | {:+.0} % | {} |\n",
            1e3 * depth,
            100.0 * DEARER,
            100.0 * dearer,
            verdict(dearer <= DEARER)
        );
    }
    text
}

fn page(others: &Comparison<Contender>, zones: &Comparison<Variant>) -> String {
    let mut text = format!(
        "# Plasticity against other open programs\n\n\
         Written by `scripts/bench --only plasticity`. A half disc (radius {:.0} mm) pressed {:.2} mm into a block twice as wide as high in {STEPS} equal \
         steps without friction,\n\
         both of steel that yields at {:.0} MPa and hardens linearly by {:.0} GPa (benches/indentation.toml): the same nodes, quad4 cells, \
         supports and steps for all, plane\n\
         strain. There is no exact solution; the forces of the contact must agree within {:.0} %, or nothing is written here. CPU seconds (user and \
         system) of the\n\
         whole process on one thread, result file written; the programs take turns, the least of the repetitions counts. The start-up of each, measured \
         on a mesh of\n\
         a few elements, is subtracted: {}\n\n",
        1e3 * common::INDENTER,
        1e3 * DEPTH,
        1e-6 * YIELD[0],
        1e-9 * YIELD[1],
        100.0 * AGREE,
        others.start_ups()
    );
    text += "| dofs | program | factorisations | CPU s | times kontakt | peak memory, MB | force, MN/m |\n\
             |---|---|---|---|---|---|---|\n";
    for r in &others.rows {
        text += &format!(
            "| {} | {} | {} | {:.2} | {:.1} | {:.0} | {:.4} |\n",
            r.dofs,
            r.program.name(),
            count(r.found.factorisations),
            r.net,
            others.times(r, Kontakt),
            r.spent.peak_mb,
            1e-6 * r.found.force,
        );
    }
    text += "\n![CPU seconds](plasticity.png)\n\nEach program at the best sound setting found:\n\n";
    text += getfem::PLASTICITY_SETTING;
    text += calculix::PLASTICITY_SETTING;
    text += "- kontakt: the default driver; nothing to set. Its factorisations are of one body each, those of the others of both.\n\n\
             ## The plastic zone alone\n\n\
             kontakt by the same steps to three depths: everything refactorised in each iteration (`zone = \"never\"`), what stays elastic condensed \
             (`\"always\"`), and\n\
             the default. Times: of refactorising at the same depth.\n\n\
             | dofs | depth | way | yields | zone | iterations | factorisations | CPU s | times | force, MN/m |\n\
             |---|---|---|---|---|---|---|---|---|---|\n";
    for r in &zones.rows {
        text += &format!(
            "| {} | {} | {} | {} | {} | {} | {} | {:.2} | {:.2} | {:.4} |\n",
            r.dofs,
            r.setting,
            r.program.name(),
            percent(r.found.plastic),
            percent(r.found.zone),
            count(r.found.iterations),
            count(r.found.factorisations),
            r.net,
            zones.times(r, Variant { zone: Zone::Never, ..r.program }),
            1e-6 * r.found.force,
        );
    }
    text + "\n" + &targets(others, &zones.rows)
}

fn panels(others: &[Row<Contender>], zones: &[Row<Variant>]) -> [Panel; 2] {
    let program = |program: Contender| Curve {
        name: program.name().into(),
        points: others
            .iter()
            .filter(|r| r.program == program)
            .map(|r| (r.dofs as f64, r.net, String::new()))
            .collect(),
    };
    let way = |zone: Zone| Curve {
        name: Variant { zone, depth: DEPTH }.name().into(),
        points: zones
            .iter()
            .filter(|r| r.program.zone == zone)
            .map(|r| (1e3 * r.program.depth, r.net, percent(r.found.plastic)))
            .collect(),
    };
    let legend = SeriesLabelPosition::UpperLeft;
    [
        Panel {
            title: "Cost over size".into(),
            x: "unknowns".into(),
            y: "CPU seconds, less start-up".into(),
            curves: [Kontakt, GetFem, CalculiX].map(program).into(),
            legend,
        },
        Panel {
            title: "kontakt, the plastic zone alone".into(),
            x: "depth, mm".into(),
            y: "CPU seconds, less start-up".into(),
            curves: [Zone::Never, Zone::Always, Zone::Automatic].map(way).into(),
            legend: SeriesLabelPosition::UpperLeft,
        },
    ]
}
