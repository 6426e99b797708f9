//! Nodal temperatures from a CSV file with the header line `x,y,temperature`.
use std::path::Path;

use super::Units;
use super::node::shortened;
use crate::error::{Error, Result};

const HEADER: [&str; 3] = ["x", "y", "temperature"];

/// Node positions and temperatures, in the units of the case.
pub(super) fn read(path: &Path, units: Units) -> Result<Vec<([f64; 3], f64)>> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).map_err(|e| Error::Input(format!("{shown}: {e}")))?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let header: Vec<&str> =
        lines.next().map_or(Vec::new(), |(_, line)| line.split(',').map(str::trim).collect());
    if header != HEADER {
        return Err(Error::Input(format!(
            "{shown}:1: '{}' was given; the first line must be {}",
            shortened(&header.join(",")),
            HEADER.join(",")
        )));
    }
    let values: Vec<_> = lines
        .map(|(i, line)| {
            row(line, units).map_err(|rule| {
                Error::Input(format!("{shown}:{}: '{}' was given; {rule}", i + 1, shortened(line)))
            })
        })
        .collect::<Result<_>>()?;
    match values.is_empty() {
        true => Err(Error::Input(format!("{shown}: has no line below the header"))),
        false => Ok(values),
    }
}

fn row(line: &str, units: Units) -> std::result::Result<([f64; 3], f64), String> {
    let numbers: Vec<f64> = line.split(',').filter_map(|cell| cell.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, t] if line.split(',').count() == 3 && numbers.iter().all(|v| v.is_finite()) => match t < 0.0 {
            true if units == Units::Si => Err("a temperature must be >= 0 K".into()),
            _ => Ok(([x, y, 0.0], t)),
        },
        _ => Err("three finite numbers are needed, with commas between them".into()),
    }
}
