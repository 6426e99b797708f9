//! Checks on the results file: pressures along surfaces, mirror symmetry.
use super::compare::Ratio;
use super::expected::{Profile, Run, Slope};
use kontakt::output::{RESULT, Results};
use kontakt::record::SideTable;
use kontakt::vector::{larger, smaller};
use rstar::{RTree, primitives::GeomWithData};
use serde_json::Value;
use std::path::Path;

/// Profiles, slopes and symmetry of a run; returns what is wrong.
pub fn check(directory: &Path, summary: &Value, run: &Run, ratios: &mut Vec<Ratio>) -> Vec<String> {
    if run.profile.is_empty() && run.slope.is_empty() && run.symmetric.is_none() {
        return Vec::new();
    }
    let results = match Results::read(&directory.join(RESULT)) {
        Ok(results) => results,
        Err(e) => return vec![e.to_string()],
    };
    let mut faults = Vec::new();
    for wanted in &run.profile {
        match side(&results, summary, &wanted.pair) {
            Some(side) => profile(wanted, side, &mut faults),
            None => faults.push(format!("pair {} has no pressures", wanted.pair)),
        }
    }
    for wanted in &run.slope {
        match side(&results, summary, &wanted.pair) {
            Some(side) => faults.extend(slope(wanted, side)),
            None => faults.push(format!("pair {} has no pressures", wanted.pair)),
        }
    }
    if let Some(limit) = run.symmetric {
        match asymmetry(&results) {
            Ok(value) => ratios.push(Ratio::new("symmetry", value, limit)),
            Err(fault) => faults.push(fault),
        }
    }
    faults
}

/// The side of a pair that carries the multipliers.
fn side<'a>(results: &'a Results, summary: &Value, pair: &str) -> Option<&'a SideTable> {
    let listed = summary["pairs"].as_array()?.iter().find(|p| p["name"] == pair)?;
    let side = usize::from(listed["multiplier_side"] == "b");
    results.pairs.iter().find(|p| p.name == pair)?.sides[side].as_ref().filter(|side| !side.x.is_empty())
}

fn profile(wanted: &Profile, side: &SideTable, faults: &mut Vec<String>) {
    let Profile { pair, relative, absolute, .. } = wanted;
    let differs = |found: f64, p: f64| {
        let difference = (found - p).abs();
        difference.is_nan() || difference > absolute + relative * p.abs()
    };
    if let Some(p) = wanted.uniform {
        let closed = std::iter::zip(&side.pressure, &side.status).filter(|(_, status)| **status == 2);
        let off = closed.map(|(found, _)| *found).filter(|found| differs(*found, p));
        if let Some(worst) = off.max_by(|a, b| (a - p).abs().total_cmp(&(b - p).abs())) {
            let error = (worst - p).abs() / p.abs();
            faults.push(format!(
                "pair {pair}: pressure {worst:.6e}, not {p:.6e} (off by {error:.1e}, relative)"
            ));
        }
    }
    for (&x, &p) in std::iter::zip(&wanted.at, &wanted.pressure) {
        match pressure_at(side, x) {
            Some(found) if !differs(found, p) => {}
            Some(found) => {
                let error = (found - p).abs() / p.abs();
                faults.push(format!(
                    "pair {pair}: pressure {found:.5e} at x = {x}, not {p:.5e} (off by {error:.1e})"
                ));
            }
            None => faults.push(format!("pair {pair}: no surface at x = {x}")),
        }
    }
}

/// The pressure at x, linear between nodes.
fn pressure_at(side: &SideTable, x: f64) -> Option<f64> {
    let n = side.x.len();
    let slack = 1e-9 * (side.x.first()?[0] - side.x.last()?[0]).abs();
    (1..n).find_map(|i| {
        let (a, b) = (side.x[i - 1][0], side.x[i][0]);
        let inside = x >= a.min(b) - slack && x <= a.max(b) + slack && a != b;
        let f = (x - a) / (b - a);
        inside.then(|| (1.0 - f) * side.pressure[i - 1] + f * side.pressure[i])
    })
}

/// Least squares of log p over log d.
fn slope(wanted: &Slope, side: &SideTable) -> Option<String> {
    let Slope { pair, corner, from, to, value, absolute } = wanted;
    let points: Vec<[f64; 2]> = std::iter::zip(&side.x, &side.pressure)
        .map(|(x, p)| [(corner - x[0]).abs(), *p])
        .filter(|[d, p]| d >= from && d <= to && *p > 0.0)
        .map(|[d, p]| [d.ln(), p.ln()])
        .collect();
    let n = points.len() as f64;
    let mean = |c: usize| points.iter().map(|q| q[c]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let covariance: f64 = points.iter().map(|q| (q[0] - x) * (q[1] - y)).sum();
    let found = covariance / points.iter().map(|q| (q[0] - x).powi(2)).sum::<f64>();
    let difference = (found - value).abs();
    (difference.is_nan() || difference > *absolute)
        .then(|| format!("pair {pair}: pressure grows with the power {found:.4}, not {value:.4}"))
}

/// Largest difference between the displacement of a node and that of its mirror image about x = 0, relative to the
/// largest displacement.
fn asymmetry(results: &Results) -> Result<f64, String> {
    let field = results.piece.point_fields.iter().find(|field| field.name == "displacement");
    let field = field.ok_or("the file has no displacements")?;
    let u = |i: usize| [field.values[3 * i], field.values[3 * i + 1]];
    let points = &results.piece.points;
    let indexed = points.iter().enumerate().map(|(i, p)| GeomWithData::new([p[0], p[1]], i));
    let tree = RTree::bulk_load(indexed.collect());
    let extent = points.iter().flat_map(|p| p[..2].iter().map(|c| c.abs())).fold(0.0, larger);
    let scale = field.values.iter().map(|v| v.abs()).fold(0.0, larger);
    let mut worst: f64 = 0.0;
    for (i, p) in points.iter().enumerate() {
        let [ux, uy] = u(i);
        // Where nodes of several bodies coincide, one of them is the image.
        let images = tree.locate_within_distance([-p[0], p[1]], (1e-10 * extent).powi(2));
        let difference = images.map(|image| {
            let [vx, vy] = u(image.data);
            (ux + vx).hypot(uy - vy)
        });
        let smallest = difference.fold(f64::INFINITY, smaller);
        if smallest.is_infinite() {
            return Err(format!("the node at ({}, {}) has no mirror image", p[0], p[1]));
        }
        worst = larger(worst, smallest);
    }
    Ok(if scale > 0.0 { worst / scale } else { worst })
}
