//! How cost grows: with the unknowns on one rank, from one rank to two, and with the way the bodies answer.
//!
//! `scripts/bench --only scaling [--json FILE]` writes docs/benchmarks/scaling.md and its picture.
//!
//! Whole runs of the program on the Hertz case (cases/hertz-line), in turn; of repetitions the one with the least cost.
mod common;

use common::{
    plot::{Curve, Panel},
    run::{Done, Run, least, without_contact},
};
use kontakt::{Error, Result};
use plotters::chart::SeriesLabelPosition;

/// About how many unknowns, and how often.
const SIZES: [(f64, usize); 5] = [(5e3, 7), (20e3, 5), (80e3, 3), (320e3, 2), (1e6, 2)];
/// The same where one rank is compared with two.
const RANKS: [(f64, usize); 2] = [(80e3, 5), (320e3, 3)];
/// Unknowns of the run that shows the start-up, and its repetitions.
const EMPTY: (f64, usize) = (300.0, 9);
/// Unknowns where the answers are compared, and repetitions.
const ANSWERS: (f64, usize) = (20e3, 1);
/// Phases of summary.json, in the order of a run.
const PHASES: [&str; 7] = ["setup", "search", "assemble", "factor", "condense", "alternate", "write"];

const SOLVER: [&str; 2] = ["body.upper.response = \"solver\"", "body.lower.response = \"solver\""];
const ITERATIVE: [&str; 2] = [
    "body.upper.solver = \"-ksp_type cg -pc_type gamg -ksp_rtol 1e-10\"",
    "body.lower.solver = \"-ksp_type cg -pc_type gamg -ksp_rtol 1e-10\"",
];
const RELAXED: [&str; 1] = ["alternation.driver = \"relaxed\""];

fn cpu(done: &Done) -> f64 {
    done.spent.cpu
}

fn main() -> Result<()> {
    let start_up = cpu(&least(&[Run::hertz(EMPTY.0, &[])], EMPTY.1, cpu)?[0]);
    let mut contact = Vec::new();
    let mut linear = Vec::new();
    let file = std::env::temp_dir().join(format!("kontakt-linear-{}.toml", std::process::id()));
    without_contact(&common::hertz(), &file)?;
    for (dofs, repetitions) in SIZES {
        let runs = [Run::hertz(dofs, &[]), Run { case: file.clone(), ..Run::hertz(dofs, &[]) }];
        let mut done = least(&runs, repetitions, cpu)?.into_iter();
        contact.extend(done.next());
        linear.extend(done.next());
    }
    let _ = std::fs::remove_file(&file);
    let mut ranks = Vec::new();
    for (dofs, repetitions) in RANKS {
        let runs = [1, 2].map(|ranks| Run { ranks, ..Run::hertz(dofs, &[]) });
        ranks.push(least(&runs, repetitions, |done| done.seconds("total"))?);
    }
    let answers = answers()?;
    let sizes = Sizes { start_up, contact, linear };
    common::write_page("scaling.md", &(sizes.text() + &ranks_text(&ranks) + &answers_text(&answers)))?;
    common::plot::draw("scaling", &sizes.panels())?;
    common::add_json("scaling", sizes.json())?;
    common::add_json("ranks", ranks.iter().map(|pair| rank_json(pair)).collect())
}

/// Runs by size.
struct Sizes {
    /// CPU seconds of a run on a mesh of a few elements.
    start_up: f64,
    contact: Vec<Done>,
    /// Without contact.
    linear: Vec<Done>,
}

impl Sizes {
    fn net(&self, done: &Done) -> f64 {
        cpu(done) - self.start_up
    }

    /// Microseconds for an unknown.
    fn per_dof(&self, done: &Done) -> f64 {
        1e6 * self.net(done) / done.sum("dofs") as f64
    }

    /// Growth of the cost for an unknown from the second size to the last.
    fn growth(&self) -> f64 {
        self.per_dof(&self.contact[SIZES.len() - 1]) / self.per_dof(&self.contact[1])
    }

    fn text(&self) -> String {
        let mut text = format!(
            "# How cost grows\n\n\
             Written by `scripts/bench --only scaling`. Two half discs pressed together (cases/hertz-line), whole runs on one rank with all \
             output; start-up,\n\
             {:.2} CPU s on a mesh of a few elements, is subtracted from CPU seconds.\n\n\
             | dofs | CPU s | µs / dof | peak memory, MB | kB / dof | alternations | error of peak pressure |\n\
             |---|---|---|---|---|---|---|\n",
            self.start_up
        );
        for done in &self.contact {
            let dofs = done.sum("dofs");
            text += &format!(
                "| {dofs} | {:.2} | {:.2} | {:.0} | {:.2} | {} | {:+.3} % |\n",
                self.net(done),
                self.per_dof(done),
                done.spent.peak_mb,
                1024.0 * done.spent.peak_mb / dofs as f64,
                done.number("alternations"),
                100.0 * done.peak_error()
            );
        }
        text += &format!(
            "\nFrom {} to {} dofs the cost for an unknown grows {:.2} times.\n\n![Cost and memory](scaling.png)\n\n",
            self.contact[1].sum("dofs"),
            self.contact[SIZES.len() - 1].sum("dofs"),
            self.growth()
        );
        let largest = &self.contact[SIZES.len() - 1].spent;
        text += &format!(
            "Wall seconds of the largest run over its CPU seconds: {:.2}. Well above 1, the machine had other work, and what follows in wall \
             seconds says\nlittle.\n\n",
            largest.wall / largest.cpu
        );
        text += "Where the wall seconds go, with contact:\n\n";
        text += &phases(&self.contact);
        text += "\nWithout contact, which is a linear run; the last column is the part of the whole run that is not factorisation, solve or \
                 output:\n\n";
        text += &phases(&self.linear);
        text
    }

    fn panels(&self) -> [Panel; 2] {
        let digits = |value: f64| if value < 10.0 { format!("{value:.1}") } else { format!("{value:.0}") };
        let curve = |name: &str, runs: &[Done], y: &dyn Fn(&Done) -> f64, labelled: bool| Curve {
            name: name.into(),
            points: runs
                .iter()
                .map(|d| (d.sum("dofs") as f64, y(d), if labelled { digits(y(d)) } else { String::new() }))
                .collect(),
        };
        let cost = |done: &Done| self.per_dof(done);
        let memory = |done: &Done| 1024.0 * done.spent.peak_mb / done.sum("dofs") as f64;
        let panel = |title: &str, y: &str, curves| Panel {
            title: title.into(),
            x: "unknowns".into(),
            y: y.into(),
            curves,
            legend: SeriesLabelPosition::UpperRight,
        };
        let both = |y: &dyn Fn(&Done) -> f64| {
            vec![
                curve("contact", &self.contact, y, true),
                curve("no contact (linear)", &self.linear, y, false),
            ]
        };
        [
            panel("CPU time for an unknown", "CPU time less start-up, µs / unknown", both(&cost)),
            panel("Memory for an unknown", "peak memory, kB / unknown", both(&memory)),
        ]
    }

    fn json(&self) -> serde_json::Value {
        let row = |(contact, linear): (&Done, &Done)| {
            serde_json::json!({
                "dofs": contact.sum("dofs"),
                "cpu_seconds": self.net(contact),
                "startup_cpu_seconds": self.start_up,
                "microseconds_per_dof": self.per_dof(contact),
                "peak_mb": contact.spent.peak_mb,
                "kb_per_dof": 1024.0 * contact.spent.peak_mb / contact.sum("dofs") as f64,
                "seconds": contact.summary["seconds"],
                "linear_cpu_seconds": self.net(linear),
                "linear_peak_mb": linear.spent.peak_mb,
                "linear_seconds": linear.summary["seconds"],
                "assembly_and_setup_share": share(linear),
            })
        };
        std::iter::zip(&self.contact, &self.linear).map(row).collect()
    }
}

/// Part of the wall seconds that set-up and assembly take.
fn share(done: &Done) -> f64 {
    (done.seconds("setup") + done.seconds("search") + done.seconds("assemble")) / done.seconds("total")
}

fn phases(runs: &[Done]) -> String {
    let mut text = format!("| dofs | {} | total | set-up and assembly |\n", PHASES.join(" | "));
    text += &format!("|{}\n", "---|".repeat(PHASES.len() + 3));
    for done in runs {
        let seconds: Vec<String> = PHASES.iter().map(|phase| format!("{:.3}", done.seconds(phase))).collect();
        text += &format!(
            "| {} | {} | {:.3} | {:.0} % |\n",
            done.sum("dofs"),
            seconds.join(" | "),
            done.seconds("total"),
            100.0 * share(done)
        );
    }
    text
}

/// t1 / (2 t2), of the whole run and of all but the output.
fn efficiencies(pair: &[Done]) -> [f64; 2] {
    let solve = |done: &Done| done.seconds("total") - done.seconds("write");
    [pair[0].seconds("total") / (2.0 * pair[1].seconds("total")), solve(&pair[0]) / (2.0 * solve(&pair[1]))]
}

fn rank_json(pair: &[Done]) -> serde_json::Value {
    let [whole, solve] = efficiencies(pair);
    serde_json::json!({
        "dofs": pair[0].sum("dofs"),
        "seconds_1_rank": pair[0].seconds("total"),
        "seconds_2_ranks": pair[1].seconds("total"),
        "efficiency": whole,
        "efficiency_without_output": solve,
        "cpu_seconds_1_rank": cpu(&pair[0]),
        "cpu_seconds_2_ranks": cpu(&pair[1]),
    })
}

fn ranks_text(ranks: &[Vec<Done>]) -> String {
    let mut text = String::from(
        "\n## One rank against two\n\n\
         Wall seconds of a run, the least of several in turn; two bodies of equal size, so that each rank has one. Efficiency: t1 / (2 t2).\n\n\
         | dofs | 1 rank, s | 2 ranks, s | efficiency | without output |\n|---|---|---|---|---|\n",
    );
    for pair in ranks {
        let [whole, solve] = efficiencies(pair);
        text += &format!(
            "| {} | {:.3} | {:.3} | {whole:.2} | {solve:.2} |\n",
            pair[0].sum("dofs"),
            pair[0].seconds("total"),
            pair[1].seconds("total"),
        );
    }
    text
}

/// Ways to answer, by name.
fn answers() -> Result<Vec<(&'static str, Done)>> {
    let of = |sets: &[&str]| Run::hertz(ANSWERS.0, sets);
    let names = [
        "active set, condensed (the default)",
        "active set, a direct solve each time",
        "active set, CG with GAMG each time",
        "relaxed, the paper's alternation",
    ];
    let runs = [of(&[]), of(&SOLVER), of(&[SOLVER, ITERATIVE].concat()), of(&RELAXED)];
    let done = least(&runs, ANSWERS.1, cpu)?;
    if !done.iter().all(|d| d.summary["converged"] == true) {
        return Err(Error::internal("a run has not converged"));
    }
    Ok(std::iter::zip(names, done).collect())
}

fn answers_text(answers: &[(&str, Done)]) -> String {
    let mut text = String::from(
        "\n## How the bodies answer\n\n\
         The same case on one rank by driver and response, start-up included. Alternations by weight and stiffness ratio are in \
         [weights.md](weights.md), by\n\
         size and stiffness ratio in [floor.md](floor.md).\n\n\
         | driver, response | dofs | alternations | factorisations | solves | CPU s | error of peak pressure |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for (name, done) in answers {
        text += &format!(
            "| {name} | {} | {} | {} | {} | {:.2} | {:+.3} % |\n",
            done.sum("dofs"),
            done.number("alternations"),
            done.sum("factorisations"),
            done.sum("solves"),
            cpu(done),
            100.0 * done.peak_error()
        );
    }
    text
}
