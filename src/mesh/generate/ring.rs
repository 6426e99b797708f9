//! Ring sector or full ring.
use super::Grading;
use super::net::{Grid, Net};
use super::{affordable, direction, finite, positions};
use crate::error::{Error, Result};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Ring between the first and last radius, from the first to the last angle; closed if that is a full turn.
pub fn ring(center: [f64; 2], radius: &Grading, angle: &Grading) -> Result<Net> {
    finite("ring: center", &center)?;
    let (radius, angle) = (positions("ring: radius", radius)?, positions("ring: angle", angle)?);
    affordable(radius.len() as f64 * angle.len() as f64)?;
    if radius[0] <= 0.0 {
        return Err(Error::input(format!("ring: radius: the inner radius {} must be positive", radius[0])));
    }
    let turn = angle[angle.len() - 1] - angle[0];
    if turn > TAU * (1.0 + 1e-9) {
        return Err(Error::input(format!(
            "ring: angle: spans {} degrees, more than a full turn",
            turn.to_degrees()
        )));
    }
    if let Some(w) = angle.windows(2).find(|w| w[1] - w[0] > FRAC_PI_2 * (1.0 + 1e-9)) {
        let step = (w[1] - w[0]).to_degrees();
        return Err(Error::input(format!(
            "ring: angle: a cell spans {step} degrees; at most 90 are allowed"
        )));
    }
    let full = turn > TAU * (1.0 - 1e-9);

    let mut net = Net::default();
    let at = |r: f64, [c, s]: [f64; 2]| [center[0] + r * c, center[1] + r * s];
    let distinct = angle.len() - usize::from(full);
    let mut rows: Vec<Vec<u32>> = angle[..distinct]
        .iter()
        .map(|&a| radius.iter().map(|&r| net.node(at(r, direction(a)))).collect())
        .collect();
    if full {
        rows.push(rows[0].clone());
    }
    for (j, w) in angle.windows(2).enumerate() {
        // The chord's middle lies at r cos(half step); the arc's middle at r.
        let rise = 2.0 * (0.25 * (w[1] - w[0])).sin().powi(2);
        let [c, s] = direction(0.5 * (w[0] + w[1]));
        for (i, &r) in radius.iter().enumerate() {
            net.bulge(rows[j][i], rows[j + 1][i], [r * rise * c, r * rise * s]);
        }
    }
    // Columns outwards, rows by angle: counter-clockwise.
    let grid: Grid = (0..radius.len()).map(|i| rows.iter().map(|row| row[i]).collect()).collect();
    net.cells(&grid, |_, row| 2 * row < angle.len() - 1);
    net.arc(grid[0].iter().copied(), center);
    net.arc(grid[radius.len() - 1].iter().copied(), center);
    net.surface("inner", grid[0].iter().copied());
    net.surface("outer", grid[radius.len() - 1].iter().copied());
    if !full {
        net.surface("start", rows[0].iter().copied());
        net.surface("end", rows[angle.len() - 1].iter().copied());
    }
    Ok(net)
}
