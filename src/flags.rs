//! The flags of `kontakt study`, as changes to the case's `[study]`.
use crate::CaseArgs;
use clap::Args;
use kontakt::study::Request;
use std::path::PathBuf;

#[derive(Args)]
pub struct StudyArgs {
    #[command(flatten)]
    pub case: CaseArgs,
    /// Levels of refinement, 0..3 or 0,2,4: how often the elements of the case's meshes are split into four.
    #[arg(
        long,
        alias = "level",
        value_name = "LEVELS",
        help_heading = "What is varied (before the case's [study])"
    )]
    levels: Option<String>,
    /// Elements of the generated meshes: tri3,tri6,quad4,quad8.
    #[arg(
        long,
        alias = "element",
        value_name = "LIST",
        help_heading = "What is varied (before the case's [study])"
    )]
    elements: Option<String>,
    /// Tolerances of the alternation: 1e-4,1e-8.
    #[arg(
        long,
        alias = "tolerance",
        value_name = "LIST",
        help_heading = "What is varied (before the case's [study])"
    )]
    tolerances: Option<String>,
    /// Drivers of the alternation: "active set,relaxed".
    #[arg(
        long,
        alias = "driver",
        value_name = "LIST",
        help_heading = "What is varied (before the case's [study])"
    )]
    drivers: Option<String>,
    /// Weights of the relaxed driver: response,stiffness,0.5.
    #[arg(long, value_name = "LIST", help_heading = "What is varied (before the case's [study])")]
    weights: Option<String>,
    /// Transfers across the interface: mortar,pointwise.
    #[arg(
        long,
        alias = "transfer",
        value_name = "LIST",
        help_heading = "What is varied (before the case's [study])"
    )]
    transfers: Option<String>,
    /// How the bodies answer: condensed,solver.
    #[arg(
        long,
        alias = "response",
        value_name = "LIST",
        help_heading = "What is varied (before the case's [study])"
    )]
    responses: Option<String>,
    /// Numbers of ranks: 1,2,4.
    #[arg(long, value_name = "LIST", help_heading = "What is varied (before the case's [study])")]
    ranks: Option<String>,
    /// Allow more ranks than this machine has cores.
    #[arg(long)]
    oversubscribe: bool,
    /// Repetitions of each run; the least of their times counts.
    #[arg(long, value_name = "N")]
    repeat: Option<String>,
    /// What accuracy is judged by: PAIR.peak_pressure, PAIR.force, PROBE.displacement ...
    #[arg(long, value_name = "NAME")]
    quantity: Option<String>,
    /// Directory for the results [default: results/<case>[/<variant>]/study].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write the page to this Markdown file as well, its picture beside it.
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Measure everything again, also what an earlier study has left.
    #[arg(long)]
    fresh: bool,
}

impl StudyArgs {
    pub fn request(self, petsc_options: Vec<String>) -> Request {
        let mut flags = Vec::new();
        let levels = self.levels.as_ref().map(|text| match text.contains("..") {
            true => quoted(text),
            false => list(text),
        });
        flags.extend(levels.map(|levels| format!("study.levels={levels}")));
        let lists = [
            ("elements", &self.elements),
            ("tolerances", &self.tolerances),
            ("drivers", &self.drivers),
            ("weights", &self.weights),
            ("transfers", &self.transfers),
            ("responses", &self.responses),
            ("ranks", &self.ranks),
        ];
        for (key, text) in lists {
            flags.extend(text.as_ref().map(|text| format!("study.{key}={}", list(text))));
        }
        flags.extend(self.repeat.map(|n| format!("study.repeat={n}")));
        flags.extend(self.quantity.map(|name| format!("study.quantity={}", quoted(&name))));
        Request {
            case: self.case.case,
            variant: self.case.variant,
            sets: self.case.sets,
            flags,
            petsc_options,
            out: self.out,
            page: self.page,
            fresh: self.fresh,
            oversubscribe: self.oversubscribe,
            command: command(),
        }
    }
}

/// `a,1` as the TOML array `["a", 1]`.
fn list(text: &str) -> String {
    let item = |item: &str| match item.trim() {
        item if item.parse::<f64>().is_ok() => item.to_string(),
        item => quoted(item),
    };
    format!("[{}]", text.split(',').map(item).collect::<Vec<_>>().join(", "))
}

/// As a TOML string.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// The command line without what says nothing of the study: where it goes, and whether it is new.
fn command() -> String {
    let mut words = vec!["kontakt".to_string()];
    let mut arguments = std::env::args().skip(1);
    while let Some(word) = arguments.next() {
        match word.as_str() {
            "--fresh" => {}
            "--out" => drop(arguments.next()),
            word if word.starts_with("--out=") => {}
            word if word.contains(|c: char| c.is_whitespace() || "\"'$\\*?[]{}".contains(c)) => {
                words.push(format!("'{}'", word.replace('\'', "'\\''")));
            }
            word => words.push(word.to_string()),
        }
    }
    words.join(" ")
}
