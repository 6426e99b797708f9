//! What the benchmarks share: the Hertz case at a wanted size, exact values, medians, pages and JSON.
#![allow(dead_code)]

pub mod plot;
pub mod process;
pub mod run;

use kontakt::{
    Error, Result,
    case::{self, Case},
};
use std::path::{Path, PathBuf};

/// Unknowns of cases/hertz-line as written.
const CASE_DOFS: f64 = 38_104.0;

/// Hertz for equal moduli: force, N, peak pressure, Pa, half-width, m; the first two grow with the effective modulus.
pub const FORCE: f64 = 1e6;
pub const PEAK: f64 = 1.212074e9;
pub const HALF_WIDTH: f64 = 5.25232e-4;
/// How far from the axis other programs look for contact, m.
pub const REACH: f64 = 2.01 * HALF_WIDTH;

/// Radius of the indenter, m, and how far it can touch, radians from its lowest point.
pub const INDENTER: f64 = 0.05;
pub const INDENTED: f64 = 0.052;
/// Largest over smallest cells along a side of the indentation, and its unknowns for one cell along half the contact.
const RATIO: f64 = 100.0;
const INDENTATION_DOFS: f64 = 12.5;

/// Where the project is.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The Hertz case, cases/hertz-line.
pub fn hertz() -> PathBuf {
    root().join("cases/hertz-line/case.toml")
}

/// Settings of the Hertz case that give about `dofs` unknowns, matching meshes, and a node on the axis at any size.
pub fn sizes(dofs: f64) -> Vec<String> {
    let h = (CASE_DOFS / dofs).sqrt();
    let mut sets = vec!["alternation.tolerance = 1e-8".to_string()];
    for body in ["upper", "lower"] {
        let key = format!("body.{body}.mesh.half_disc");
        sets.push(format!("{key}.angle.at = [-45, -1.2, 0, 1.2, 45]"));
        sets.push(format!("{key}.angle.size = [{0}, {1}, {1}, {1}, {0}]", 4.0 * h, 0.05 * h));
        sets.push(format!("{key}.depth.size = [{0:e}, {0:e}, {1}]", 8.75e-4 * h, 0.08 * h));
        sets.push(format!("{key}.core = {}", (6.0 / h).round()));
    }
    sets
}

/// The case of partial slip, cases/partial-slip, whose discs [`sizes`] also fits.
pub fn partial_slip() -> PathBuf {
    root().join("cases/partial-slip/case.toml")
}

/// The Hertz case with about `dofs` unknowns and more settings.
pub fn sized_case(dofs: f64, more: &[String]) -> Result<Case> {
    case::read(&hertz(), None, &[&sizes(dofs)[..], more].concat())
}

/// The plastic indentation, benches/indentation.toml.
pub fn indentation() -> PathBuf {
    root().join("benches/indentation.toml")
}

/// Settings of the indentation that give about `dofs` unknowns, opposite nodes where the bodies can touch, and a node on the axis.
pub fn indentation_sizes(dofs: f64) -> Vec<String> {
    let n = (dofs / INDENTATION_DOFS).sqrt().round();
    let of = |share: f64| (share * n).round().max(1.0);
    let degrees = INDENTED.to_degrees();
    let positions: Vec<f64> =
        (-n as i64..=n as i64).map(|i| INDENTER * (INDENTED * i as f64 / n).sin()).collect();
    let last = positions.len();
    let (mut cells, mut ratios) = (vec![1.0; last + 1], vec![1.0; last + 1]);
    (cells[0], cells[last]) = (of(0.85), of(0.85));
    (ratios[0], ratios[last]) = (1.0 / RATIO, RATIO);
    let cells: Vec<String> = cells.iter().map(f64::to_string).collect();
    let at: Vec<f64> = [-INDENTER].into_iter().chain(positions).chain([INDENTER]).collect();
    let disc = "body.upper.mesh.half_disc";
    let block = "body.lower.mesh.rectangle";
    vec![
        format!("{disc}.angle.at = [-45, -{degrees}, {degrees}, 45]"),
        format!("{disc}.angle.cells = [{0}, {1}, {0}]", of(0.66), 2.0 * n),
        format!("{disc}.angle.ratio = [{}, 1, {RATIO}]", 1.0 / RATIO),
        format!("{disc}.depth.cells = {}", of(0.67)),
        format!("{disc}.core = {}", of(0.15)),
        format!("{block}.x = {{ at = {at:?}, cells = [{}], ratio = {ratios:?} }}", cells.join(",")),
        format!("{block}.y.cells = {}", of(0.89)),
        format!("{block}.y.ratio = {}", 1.0 / RATIO),
    ]
}

pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Of this program's arguments, the one after `key`.
pub fn argument(key: &str) -> Option<PathBuf> {
    let arguments: Vec<String> = std::env::args().collect();
    arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1)).map(PathBuf::from)
}

/// Does something with a directory of its own, which is removed again.
pub fn in_scratch<V>(name: &str, work: impl Fn(&Path) -> Result<V>) -> Result<V> {
    let directory = std::env::temp_dir().join(format!("kontakt-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&directory).map_err(Error::internal)?;
    let done = work(&directory);
    let _ = std::fs::remove_dir_all(&directory);
    done
}

/// Prints a page and writes it to docs/benchmarks.
pub fn write_page(name: &str, text: &str) -> Result<()> {
    println!("{text}");
    let directory = root().join("docs/benchmarks");
    std::fs::create_dir_all(&directory)
        .and_then(|()| std::fs::write(directory.join(name), text))
        .map_err(|e| Error::internal(format!("{name}: {e}")))
}

/// Adds a key to the JSON object in the file after `--json`, if given, which other benchmarks may have begun.
pub fn add_json(key: &str, value: serde_json::Value) -> Result<()> {
    let Some(file) = argument("--json") else { return Ok(()) };
    let mut all = match std::fs::read_to_string(&file) {
        Ok(text) => serde_json::from_str(&text).map_err(Error::internal)?,
        Err(_) => serde_json::json!({}),
    };
    all[key] = value;
    let text = serde_json::to_string_pretty(&all).map_err(Error::internal)?;
    std::fs::write(&file, text + "\n").map_err(Error::internal)
}
