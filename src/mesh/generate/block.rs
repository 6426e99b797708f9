//! Rectangle and block with four straight or circular edges.
use super::Grading;
use super::net::{Grid, Net, middle};
use super::{affordable, finite, fractions, positions};
use crate::error::{Error, Result};

/// Axis-parallel rectangle.
pub fn rectangle(x: &Grading, y: &Grading) -> Result<Net> {
    let (x, y) = (positions("rectangle: x", x)?, positions("rectangle: y", y)?);
    affordable(x.len() as f64 * y.len() as f64)?;
    let mut net = Net::default();
    let grid: Grid = x.iter().map(|&x| y.iter().map(|&y| net.node([x, y])).collect()).collect();
    finish(&mut net, &grid);
    Ok(net)
}

/// Cells and surfaces of a grid.
fn finish(net: &mut Net, grid: &Grid) {
    let (columns, rows) = (grid.len() - 1, grid[0].len() - 1);
    net.cells(grid, |column, _| 2 * column >= columns);
    net.surface("left", grid[0].iter().copied());
    net.surface("right", grid[columns].iter().copied());
    net.surface("bottom", grid.iter().map(|column| column[0]));
    net.surface("top", grid.iter().map(|column| column[rows]));
}

/// A straight or circular edge, from `a` (parameter 0) to `b` (parameter 1).
#[derive(Debug, Clone, Copy)]
struct Curve {
    a: [f64; 2],
    b: [f64; 2],
    arc: Option<Arc>,
}

#[derive(Debug, Clone, Copy)]
struct Arc {
    center: [f64; 2],
    radius: f64,
    start: f64,
    sweep: f64,
}

impl Curve {
    fn new(name: &str, a: [f64; 2], b: [f64; 2], center: Option<[f64; 2]>) -> Result<Self> {
        let chord = (b[0] - a[0]).hypot(b[1] - a[1]);
        if chord == 0.0 {
            return Err(Error::input(format!(
                "block: the ends of edge {name} coincide at ({}, {})",
                a[0], a[1]
            )));
        }
        let Some(c) = center else { return Ok(Curve { a, b, arc: None }) };
        let (p, q) = ([a[0] - c[0], a[1] - c[1]], [b[0] - c[0], b[1] - c[1]]);
        let (ra, rb) = (p[0].hypot(p[1]), q[0].hypot(q[1]));
        if (ra - rb).abs() > 1e-9 * (ra + rb) {
            return Err(Error::input(format!(
                "block: the arc's centre ({}, {}) is {ra} from one end of edge {name} but {rb} from the \
                 other; they must be equal",
                c[0], c[1]
            )));
        }
        // The shorter way round; an arc of half a circle would not say which.
        let sweep = (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]);
        if sweep.abs() > 0.99 * std::f64::consts::PI {
            return Err(Error::input(format!(
                "block: the arc of edge {name} must be shorter than a half circle; split the block"
            )));
        }
        Ok(Curve { a, b, arc: Some(Arc { center: c, radius: ra, start: p[1].atan2(p[0]), sweep }) })
    }

    /// The point at parameter t; the ends are exact. Along an arc, t is the fraction of its angle.
    fn at(&self, t: f64) -> [f64; 2] {
        if t == 0.0 || t == 1.0 {
            return if t == 0.0 { self.a } else { self.b };
        }
        match &self.arc {
            None => [0, 1].map(|d| (1.0 - t) * self.a[d] + t * self.b[d]),
            Some(arc) => {
                let [c, s] = super::direction(arc.start + t * arc.sweep);
                [arc.center[0] + arc.radius * c, arc.center[1] + arc.radius * s]
            }
        }
    }

    /// Offset of the curve's middle between two parameters from the middle of their chord.
    fn bulge(&self, t0: f64, t1: f64) -> [f64; 2] {
        let (mid, chord) = (self.at(0.5 * (t0 + t1)), middle(self.at(t0), self.at(t1)));
        if self.arc.is_some() { [mid[0] - chord[0], mid[1] - chord[1]] } else { [0.0; 2] }
    }
}

/// Coons patch between four edges: bottom and top along u, left and right along v.
///
/// P(u, v) = (1-v) B(u) + v T(u) + (1-u) L(v) + u R(v) - bilinear interpolation of the corners.
pub fn block(corners: &[[f64; 2]; 4], arcs: &[Option<[f64; 2]>; 4], u: &Grading, v: &Grading) -> Result<Net> {
    let (u, v) = (fractions("block: u", u, false)?, fractions("block: v", v, false)?);
    affordable(u.len() as f64 * v.len() as f64)?;
    for p in corners.iter().chain(arcs.iter().flatten()) {
        finite("block: corners and arcs", p)?;
    }
    let [p0, p1, p2, p3] = *corners;
    let bottom = Curve::new("bottom", p0, p1, arcs[0])?;
    let right = Curve::new("right", p1, p2, arcs[1])?;
    let top = Curve::new("top", p3, p2, arcs[2])?;
    let left = Curve::new("left", p0, p3, arcs[3])?;
    let at = |u: f64, v: f64| -> [f64; 2] {
        if v == 0.0 || v == 1.0 {
            return if v == 0.0 { bottom.at(u) } else { top.at(u) };
        }
        if u == 0.0 || u == 1.0 {
            return if u == 0.0 { left.at(v) } else { right.at(v) };
        }
        let (b, t, l, r) = (bottom.at(u), top.at(u), left.at(v), right.at(v));
        [0, 1].map(|d| {
            let bilinear = (1.0 - v) * ((1.0 - u) * p0[d] + u * p1[d]) + v * ((1.0 - u) * p3[d] + u * p2[d]);
            ((1.0 - v) * b[d] + v * t[d]) + ((1.0 - u) * l[d] + u * r[d]) - bilinear
        })
    };
    let blend = |t: f64, a: [f64; 2], b: [f64; 2]| [0, 1].map(|d| (1.0 - t) * a[d] + t * b[d]);

    let mut net = Net::default();
    let grid: Grid = u.iter().map(|&u| v.iter().map(|&v| net.node(at(u, v))).collect()).collect();
    if bottom.arc.is_some() || top.arc.is_some() {
        for (i, w) in u.windows(2).enumerate() {
            let (b, t) = (bottom.bulge(w[0], w[1]), top.bulge(w[0], w[1]));
            for (j, &v) in v.iter().enumerate() {
                net.bulge(grid[i][j], grid[i + 1][j], blend(v, b, t));
            }
        }
    }
    if left.arc.is_some() || right.arc.is_some() {
        for (j, w) in v.windows(2).enumerate() {
            let (l, r) = (left.bulge(w[0], w[1]), right.bulge(w[0], w[1]));
            for (i, &u) in u.iter().enumerate() {
                net.bulge(grid[i][j], grid[i][j + 1], blend(u, l, r));
            }
        }
    }
    let (last, row) = (u.len() - 1, v.len() - 1);
    let chains = [
        (bottom, grid.iter().map(|column| column[0]).collect::<Vec<_>>()),
        (right, grid[last].clone()),
        (top, grid.iter().map(|column| column[row]).collect()),
        (left, grid[0].clone()),
    ];
    for (curve, chain) in chains {
        if let Some(arc) = curve.arc {
            net.arc(chain, arc.center);
        }
    }
    convex(&net, &grid)?;
    finish(&mut net, &grid);
    Ok(net)
}

/// Refuses a block whose cells are folded or whose corners run clockwise.
fn convex(net: &Net, grid: &Grid) -> Result<()> {
    for columns in grid.windows(2) {
        for j in 0..columns[0].len() - 1 {
            let ids = [columns[0][j], columns[1][j], columns[1][j + 1], columns[0][j + 1]];
            let p = ids.map(|id| net.points[id as usize]);
            for k in 0..4 {
                let (a, b, c) = (p[(k + 3) % 4], p[k], p[(k + 1) % 4]);
                if (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) <= 0.0 {
                    return Err(Error::input(format!(
                        "block: the mesh folds over at ({}, {}); give the corners counter-clockwise from \
                         bottom-left, \
                         and split a block with a strongly bent edge or a corner of 180 degrees or more",
                        b[0], b[1]
                    )));
                }
            }
        }
    }
    Ok(())
}
