//! Half disc and disc: a core block surrounded by outer blocks whose mesh lines run from the rim inwards.
use super::Grading;
use super::net::{Grid, Net, middle};
use super::{affordable, finite, fractions, positions, positive};
use crate::error::{Error, Result};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, PI};

/// Lower edge of a core block in a disc of radius 1 about the origin: the parabola y = -h + c x^2 over the
/// angles -end..end from the lowest point. It meets each ray from the centre, so that outer mesh lines are
/// radial.
#[derive(Debug, Clone, Copy)]
struct CoreEdge {
    h: f64,
    c: f64,
}

impl CoreEdge {
    /// The edge whose middle is `depth` below the rim, for an outer block up to the angle `end`.
    ///
    /// Three blocks meet in the corner. They share it evenly, 120 degrees each, if the edge rises there by
    /// `end` - 30 degrees; the corner must also keep clear of the rim.
    fn new(depth: f64, end: f64) -> Self {
        let h = 1.0 - depth;
        let rise = (end - PI / 6.0).clamp(0.0, FRAC_PI_4).tan();
        let (s, c) = end.sin_cos();
        let ideal = 2.0 * h / (s * rise + 2.0 * c);
        let radius = ideal.min(1.0 - 0.5 * depth).max(h);
        let (x, y) = (radius * s, radius * c);
        CoreEdge { h, c: (h - y) / (x * x) }
    }

    /// Where the ray in the direction (sin, -cos) meets the edge: (x, -y).
    fn meet(&self, sin: f64, cos: f64) -> [f64; 2] {
        let t = sin / cos;
        let x = 2.0 * t * self.h / (1.0 + (1.0 + 4.0 * self.c * t * t * self.h).sqrt());
        [x, self.h - self.c * x * x]
    }
}

/// Adds the outer blocks: columns of nodes from `rim` to `inner`, at the given fractions of the way.
///
/// The edges along the rim are arcs about the origin; further in they flatten until they are straight at the
/// core.
fn outer(net: &mut Net, rim: &[[f64; 2]], inner: &[[f64; 2]], fraction: &[f64], closed: bool) -> Grid {
    let mut grid: Grid = Vec::new();
    for (p, q) in rim.iter().zip(inner) {
        let at = |f: f64| if f == 1.0 { *q } else { [0, 1].map(|d| p[d] + f * (q[d] - p[d])) };
        grid.push(fraction.iter().map(|&f| net.node(at(f))).collect());
    }
    let mut rim = rim.to_vec();
    if closed {
        grid.push(grid[0].clone());
        rim.push(rim[0]);
    }
    for k in 0..grid.len() - 1 {
        let (a, b) = (rim[k], rim[k + 1]);
        let chord = middle(a, b);
        // Radius over the chord's height, less one.
        let rise = 0.5 * (a[0].hypot(a[1]) + b[0].hypot(b[1])) / chord[0].hypot(chord[1]) - 1.0;
        for (i, &f) in fraction.iter().enumerate().take(fraction.len() - 1) {
            net.bulge(grid[k][i], grid[k + 1][i], chord.map(|x| (1.0 - f) * rise * x));
        }
    }
    grid
}

/// Depths as fractions of the last one.
fn normalised(depth: &[f64]) -> Vec<f64> {
    let last = depth[depth.len() - 1];
    depth.iter().map(|d| d / last).collect()
}

/// Half disc on one side of its mid-plane.
pub fn half_disc(
    center: [f64; 2],
    radius: f64,
    up: bool,
    angle: &Grading,
    depth: &Grading,
    core: usize,
) -> Result<Net> {
    finite("half disc: center", &center)?;
    positive("half disc: radius", radius)?;
    let angle = symmetric(positions("half disc: angle", angle)?)?;
    let depth = fractions("half disc: depth", depth, true)?;
    if core == 0 {
        return Err(Error::input("half disc: core: 0 cells, at least 1 is needed"));
    }
    let (n, m, core_f) = (angle.len() - 1, depth.len() - 1, core as f64);
    affordable((n as f64 + 2.0 * core_f) * (m as f64 + core_f))?;

    // The disc below its mid-plane, radius 1, first the right half of everything mirrored by sign.
    let end = angle[n];
    let edge = CoreEdge::new(depth[m], end);
    let (s, c) = end.sin_cos();
    let corner = edge.meet(s, c);
    // Inclination of the core's side, by the same rule of even angles.
    let lean = (end + PI / 6.0).clamp(50f64.to_radians(), 100f64.to_radians());
    let top = (corner[0] + corner[1] / lean.tan()).min(1.0 - 0.4 * depth[m]);
    let side = |l: usize| {
        let f = l as f64 / core_f;
        let at =
            if l == core { [top, 0.0] } else { [0, 1].map(|d| corner[d] + f * ([top, 0.0][d] - corner[d])) };
        let (s, c) = if l == core { (1.0, 0.0) } else { (end + f * (FRAC_PI_2 - end)).sin_cos() };
        ([s, c], at)
    };
    // (rim, core edge) of each column, as (x, -y).
    let right: Vec<_> = (1..=core).map(side).collect();
    let left = right.iter().rev().map(|&(p, q)| ([-p[0], p[1]], [-q[0], q[1]]));
    let middle_block = angle.iter().map(|a| {
        let (s, c) = a.sin_cos();
        ([s, c], edge.meet(s, c))
    });
    let columns: Vec<_> = left.chain(middle_block).chain(right.iter().copied()).collect();
    let scale = |p: [f64; 2]| [radius * p[0], -radius * p[1]];
    let rim: Vec<_> = columns.iter().map(|(p, _)| scale(*p)).collect();
    let inner: Vec<_> = columns.iter().map(|(_, q)| scale(*q)).collect();

    let mut net = Net::default();
    let ring = outer(&mut net, &rim, &inner, &normalised(depth), false);
    // The core: its lower edge and sides are the inner ends of the outer columns.
    let block: Grid = (0..=n)
        .map(|j| {
            let q = inner[core + j];
            let x_top = radius * top * (q[0] / inner[core + n][0]);
            (0..=core)
                .map(|l| match (j, l) {
                    (_, 0) => ring[core + j][m],
                    (0, l) => ring[core - l][m],
                    (j, l) if j == n => ring[core + n + l][m],
                    _ => {
                        let f = l as f64 / core_f;
                        net.node([q[0] + f * (x_top - q[0]), if l == core { 0.0 } else { (1.0 - f) * q[1] }])
                    }
                })
                .collect()
        })
        .collect();
    let all = ring.len() - 1;
    net.cells(&ring, |k, _| 2 * k >= all);
    net.cells(&block, |j, _| 2 * j >= n);
    net.arc(ring.iter().map(|column| column[0]), [0.0; 2]);
    net.surface("arc", ring.iter().map(|column| column[0]));
    net.surface("flat", ring[0].iter().copied());
    net.surface("flat", block.iter().map(|column| column[core]));
    net.surface("flat", ring[all].iter().copied());
    place(&mut net, center, up);
    Ok(net)
}

/// Turns by half a turn if `up`, then moves the origin to `center`.
fn place(net: &mut Net, center: [f64; 2], up: bool) {
    let sign = if up { -1.0 } else { 1.0 };
    net.transform(|p| [sign * p[0], sign * p[1]], center);
}

/// The angles made exactly symmetric about 0, if they are to round-off.
fn symmetric(angle: &[f64]) -> Result<Vec<f64>> {
    let n = angle.len() - 1;
    let end = angle[n];
    if end >= FRAC_PI_2 * (1.0 - 1e-6) {
        return Err(Error::input(format!("half disc: angle: {} degrees must be below 90", end.to_degrees())));
    }
    if let Some(i) = (0..=n).find(|&i| (angle[i] + angle[n - i]).abs() > 1e-9 * end.abs()) {
        return Err(Error::input(format!(
            "half disc: angle: must be symmetric about 0, but {} has no counterpart {}",
            angle[i], -angle[i]
        )));
    }
    Ok((0..=n).map(|i| 0.5 * (angle[i] - angle[n - i])).collect())
}

/// Full disc.
pub fn disc(center: [f64; 2], radius: f64, quarter: usize, depth: &Grading) -> Result<Net> {
    finite("disc: center", &center)?;
    positive("disc: radius", radius)?;
    let depth = fractions("disc: depth", depth, true)?;
    if quarter == 0 {
        return Err(Error::input("disc: quarter: 0 cells, at least 1 is needed"));
    }
    let (q, m) = (quarter, depth.len() - 1);
    affordable(4.0 * q as f64 * (m as f64 + 0.25 * q as f64))?;

    // Rim and core edge of the lowest quarter, radius 1, as (x, -y), left to right.
    let edge = CoreEdge::new(depth[m], FRAC_PI_4);
    let lowest: Vec<_> = (0..=q)
        .map(|i| {
            let part = (2.0 * i as f64 - q as f64) / q as f64;
            let (s, c) = (part * FRAC_PI_4).sin_cos();
            let [s, c] = if part.abs() == 1.0 { [part * FRAC_1_SQRT_2, FRAC_1_SQRT_2] } else { [s, c] };
            let [x, y] = edge.meet(s, c);
            // In the corners both quarters must agree to the bit.
            ([s, c], if part.abs() == 1.0 { [x, x.abs()] } else { [x, y] })
        })
        .collect();
    let turned = |k: usize, [x, y]: [f64; 2]| {
        let p = [[x, -y], [y, x], [-x, y], [-y, -x]][k / q];
        p.map(|v| radius * v)
    };
    let rim: Vec<_> = (0..4 * q).map(|k| turned(k, lowest[k % q].0)).collect();
    let inner: Vec<_> = (0..4 * q).map(|k| turned(k, lowest[k % q].1)).collect();

    let mut net = Net::default();
    let ring = outer(&mut net, &rim, &inner, &normalised(depth), true);
    let corner = lowest[q].1[0];
    let core: Grid = (0..=q)
        .map(|i| {
            (0..=q)
                .map(|j| match (i, j) {
                    (i, 0) => ring[i][m],
                    (i, j) if i == q => ring[q + j][m],
                    (i, j) if j == q => ring[3 * q - i][m],
                    (0, j) => ring[4 * q - j][m],
                    (i, j) => {
                        // Product of the edge's two coordinates: it meets all four edges.
                        let ([xi, yi], [xj, yj]) = (lowest[i].1, lowest[j].1);
                        net.node([radius * (xi / corner * yj), radius * (xj / corner * yi)])
                    }
                })
                .collect()
        })
        .collect();
    // Each quarter is mirrored about its own middle.
    net.cells(&ring, |k, _| 2 * (k % q) >= q);
    net.cells(&core, |i, j| (2 * i >= q) == (2 * j >= q));
    net.arc(ring.iter().map(|column| column[0]), [0.0; 2]);
    net.surface("arc", ring.iter().map(|column| column[0]));
    place(&mut net, center, false);
    Ok(net)
}
