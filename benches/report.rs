//! What `scripts/bench` writes last: the index of docs/benchmarks and the figures that the README quotes.
//!
//! The keys of the file after `--json` are taken over into docs/benchmarks/figures.json, from which both are written.
mod common;

use kontakt::{Error, Result};
use serde_json::{Map, Value};
use std::{collections::BTreeMap, path::Path};

/// The part of the README that is written here.
const BEGIN: &str = "<!-- bench: written by scripts/bench -->";
const END: &str = "<!-- bench: end -->";

const PAGES: [(&str, &str); 8] = [
    ("floor", "contact against one linear solve of the glued bodies, both drivers, other solvers of PETSc"),
    ("peers", "CPU time, memory and error against CalculiX and GetFEM on the same meshes"),
    (
        "friction",
        "pressed and sheared: CPU time and error of the tangential traction against the same two, and what friction costs",
    ),
    (
        "plasticity",
        "a disc pressed into a block, both yield: CPU time against the same two, and what the plastic zone saves",
    ),
    ("scaling", "from 5 000 to a million unknowns, from one rank to two, by the way the bodies answer"),
    ("effects", "one case with each effect alone off and on: instructions, messages, bytes, unknowns"),
    ("adaptive", "adaptive against uniform refinement of an ungraded Hertz mesh"),
    ("weights", "alternations of the paper's method by weight and stiffness ratio"),
];

fn read(path: &Path) -> Map<String, Value> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|e| Error::internal(format!("{}: {e}", path.display())))
}

fn main() -> Result<()> {
    let directory = common::root().join("docs/benchmarks");
    let path = directory.join("figures.json");
    let mut figures = read(&path);
    if let Some(new) = common::argument("--json") {
        figures.extend(read(&new));
    }
    write(&path, &(serde_json::to_string_pretty(&figures).map_err(Error::internal)? + "\n"))?;
    write(&directory.join("README.md"), &index(&directory))?;
    let path = common::root().join("README.md");
    let text = std::fs::read_to_string(&path).map_err(Error::internal)?;
    let parts = text.split_once(BEGIN).and_then(|(head, rest)| Some((head, rest.split_once(END)?.1)));
    let Some((head, tail)) = parts else {
        return Err(Error::internal(format!("README.md has no lines `{BEGIN}` and `{END}`")));
    };
    write(&path, &format!("{head}{BEGIN}\n{}{END}{tail}", quoted(&figures)))
}

fn index(directory: &Path) -> String {
    let mut text = String::from(
        "# Benchmarks\n\nWritten by `scripts/bench`, which measures everything in one run; `--only NAME` measures one, `--json FILE` leaves the \
         figures for\nscripts. The last figures of all are in [figures.json](figures.json).\n\n| page | what it shows |\n|---|---|\n",
    );
    for (name, what) in PAGES {
        if directory.join(format!("{name}.md")).exists() {
            text += &format!("| [{name}]({name}.md) | {what} |\n");
        }
    }
    text += "\nSeconds are those of the machine it ran on; what holds elsewhere are the ratios.\n";
    text + "\nThe hard cases have a table of their own: [hard-cases.md](../hard-cases.md), by `scripts/hard`.\n"
}

/// The README's lines: those for which there are figures.
fn quoted(figures: &Map<String, Value>) -> String {
    let list = |key: &str| figures.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
    let lines = [
        alternations(&list("alternations")),
        floor(&list("floor")),
        peers(&list("peers")),
        friction(&list("friction")),
        plasticity(&list("plasticity")),
        scaling(&list("scaling")),
        ranks(&list("ranks")),
    ];
    let lines: Vec<String> = lines.into_iter().flatten().collect();
    lines.join(";\n") + if lines.is_empty() { "" } else { ".\n" }
}

fn number(row: &Value, key: &str) -> Option<f64> {
    row[key].as_f64()
}

/// 310832 as `310 000`.
fn round(dofs: f64) -> String {
    let step = 10f64.powf(dofs.log10().floor() - 1.0);
    let digits = format!("{:.0}", (dofs / step).round() * step);
    let first = digits.len() % 3;
    let (head, tail) = digits.split_at(first);
    let groups = tail.as_bytes().chunks(3).map(|c| String::from_utf8_lossy(c).into_owned());
    let head = (!head.is_empty()).then(|| head.to_owned());
    head.into_iter().chain(groups).collect::<Vec<_>>().join(" ")
}

fn alternations(rows: &[Value]) -> Option<String> {
    let counts: Vec<u64> = rows
        .iter()
        .flat_map(|r| r["alternations"].as_array().into_iter().flatten())
        .filter_map(Value::as_u64)
        .collect();
    let (least, most) = (counts.iter().min()?, counts.iter().max()?);
    let (small, large) = (number(rows.first()?, "dofs")?, number(rows.last()?, "dofs")?);
    let counts = match (least, most) {
        (1, 1) => "1 alternation".into(),
        _ if least == most => format!("{least} alternations"),
        _ => format!("{least} to {most} alternations"),
    };
    Some(format!(
        "- Hertz contact takes {counts} to 1e-8 at E_A/E_B = 1e-6, 1 and 1e6, from {} to {} unknowns",
        round(small),
        round(large)
    ))
}

fn floor(rows: &[Value]) -> Option<String> {
    let of = |ranks: u64| rows.iter().rfind(|r| r["ranks"] == ranks);
    let (one, two) = (of(1)?, of(2)?);
    Some(format!(
        "- the whole contact solve at {} unknowns costs {:.2} times one linear solve of the same two bodies glued together by the\n  \
         same direct solver on one rank, {:.2} times on two: [floor](docs/benchmarks/floor.md)",
        round(number(one, "dofs")?),
        number(one, "ratio")?,
        number(two, "ratio")?
    ))
}

/// The largest size of a list, and its rows by program.
fn largest(rows: &[Value]) -> Option<(f64, BTreeMap<&str, &Value>)> {
    let dofs = number(rows.last()?, "dofs")?;
    let rows = rows.iter().filter(|r| number(r, "dofs") == Some(dofs));
    Some((dofs, rows.filter_map(|r| Some((r["program"].as_str()?, r))).collect()))
}

fn friction(rows: &[Value]) -> Option<String> {
    let (dofs, rows) = largest(rows)?;
    let times = |program: &str, other: &str| {
        let seconds = |name: &str| number(rows.get(name)?, "cpu_seconds");
        Some(seconds(program)? / seconds(other)?)
    };
    Some(format!(
        "- two discs pressed and sheared, {} unknowns, friction 0.3, take kontakt {:.0} times less CPU time than GetFEM and {:.0} times less than CalculiX,\n  \
         and {:.2} times the CPU time of the same steps without friction: [friction](docs/benchmarks/friction.md)",
        round(dofs),
        times("GetFEM", "kontakt")?,
        times("CalculiX", "kontakt")?,
        times("kontakt", "kontakt frictionless")?
    ))
}

/// Of the rows against the other programs, those of the largest size; of kontakt's own, the gain at the least and the largest depth.
fn plasticity(rows: &[Value]) -> Option<String> {
    let of = |program: &str, variant: &str| -> Vec<&Value> {
        rows.iter().filter(|r| r["program"] == program && r["variant"] == variant).collect()
    };
    let others = [of("GetFEM", ""), of("CalculiX", "")];
    let dofs = number(others[0].last()?, "dofs")?;
    let seconds = |r: &&Value| number(r, "cpu_seconds");
    let at = |rows: &[&Value]| rows.iter().find(|r| number(r, "dofs") == Some(dofs)).and_then(seconds);
    let own = at(&of("kontakt", "automatic"))?;
    let (whole, zone) = (of("kontakt", "refactorise"), of("kontakt", "zone"));
    let gain = |(a, b): (&&Value, &&Value)| Some(seconds(a)? / seconds(b)?);
    let shares = |r: &&Value| Some(100.0 * number(r, "plastic_fraction")?);
    let ends = [(whole.first()?, zone.first()?), (whole.last()?, zone.last()?)];
    Some(format!(
        "- a disc pressed into a block, both of which yield, {} unknowns, ten steps, takes kontakt {:.1} times less CPU time than GetFEM and {:.1} times less\n  \
         than CalculiX; its plastic zone alone saves {:.1} times where {:.0} % of the elements yield, {:.1} times at {:.0} %: [plasticity](docs/benchmarks/plasticity.md)",
        round(dofs),
        at(&others[0])? / own,
        at(&others[1])? / own,
        gain(ends[0])?,
        shares(ends[0].1)?,
        gain(ends[1])?,
        shares(ends[1].1)?
    ))
}

fn peers(rows: &[Value]) -> Option<String> {
    let (dofs, rows) = largest(rows)?;
    let own = rows.get("kontakt")?;
    let others = rows.iter().filter(|(name, _)| **name != "kontakt");
    let others: Option<Vec<String>> = others
        .map(|(name, row)| {
            let times = |key: &str| Some(number(row, key)? / number(own, key)?);
            Some(format!(
                "{:.0} times less CPU time and {:.1} times less memory than {name}",
                times("cpu_seconds")?,
                times("peak_mb")?
            ))
        })
        .collect();
    Some(format!(
        "- the same Hertz mesh with {} unknowns, quad4, takes kontakt {},\n  each at its best setting: [peers](docs/benchmarks/peers.md)",
        round(dofs),
        others?.join(",\n  ")
    ))
}

fn scaling(rows: &[Value]) -> Option<String> {
    let (small, large) = (rows.get(1)?, rows.last()?);
    Some(format!(
        "- {} unknowns take {:.0} CPU s and {:.1} GB on one rank, {:.2} times as much time for each as {}: [scaling](docs/benchmarks/scaling.md)",
        round(number(large, "dofs")?),
        number(large, "cpu_seconds")?,
        number(large, "peak_mb")? / 1024.0,
        number(large, "microseconds_per_dof")? / number(small, "microseconds_per_dof")?,
        round(number(small, "dofs")?)
    ))
}

fn ranks(rows: &[Value]) -> Option<String> {
    let row = rows.last()?;
    Some(format!(
        "- two ranks have an efficiency of {:.2} ({:.2} without output) at {} unknowns",
        number(row, "efficiency")?,
        number(row, "efficiency_without_output")?,
        round(number(row, "dofs")?)
    ))
}
