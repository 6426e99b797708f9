//! Built-in meshes: rectangle, four-sided block, ring, half disc, disc.
//!
//! Each shape lays out quadrilaterals ([`net`]), which then become elements of the wanted kind; curved edges
//! keep their mid-side nodes on the curve. A shape symmetric about x = 0 gives coordinates symmetric to the
//! last bit.
mod block;
mod disc;
mod net;
mod ring;
mod shape;
#[cfg(test)]
mod tests;

pub use shape::{Grading, Shape};

use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::mesh::Mesh;

/// More corner nodes than this are taken for a mistake.
const MAX_NODES: f64 = 1e8;

/// Mesh of a built-in shape, rotated about the origin (radians, counter-clockwise), then translated (m).
///
/// Nodes are numbered as the cells meet them, row by row. Triangles come from cutting each quadrilateral; the
/// cuts are mirror images of each other about the middle column if the number of columns is even.
pub fn generate(shape: &Shape, element: ElementKind, rotate: f64, translate: [f64; 2]) -> Result<Mesh> {
    finite("rotate", &[rotate])?;
    finite("translate", &translate)?;
    let net = match shape {
        Shape::Rectangle { x, y } => block::rectangle(x, y)?,
        Shape::Block { corners, arcs, u, v } => block::block(corners, arcs, u, v)?,
        Shape::Ring { center, radius, angle } => ring::ring(*center, radius, angle)?,
        Shape::HalfDisc { center, radius, up, angle, depth, core } => {
            disc::half_disc(*center, *radius, *up, angle, depth, *core)?
        }
        Shape::Disc { center, radius, quarter, depth } => disc::disc(*center, *radius, *quarter, depth)?,
    };
    let mut mesh = net.into_mesh(element);
    let [c, s] = direction(rotate);
    let place = |[x, y]: [f64; 2]| {
        // A sum with +0 also turns -0 into 0.
        let turned = if rotate == 0.0 { [x, y] } else { [c * x - s * y, s * x + c * y] };
        [turned[0] + translate[0], turned[1] + translate[1]]
    };
    for p in &mut mesh.points {
        let [x, y] = place([p[0], p[1]]);
        *p = [x, y, 0.0];
    }
    mesh.curves.values_mut().for_each(|curve| *curve = curve.moved(place));
    Ok(mesh)
}

/// (cos, sin) of an angle; exact zeros on the axes.
fn direction(angle: f64) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    [c, s].map(|value| if value.abs() < 1e-15 { 0.0 } else { value })
}

/// Refuses infinite and undefined numbers.
fn finite(what: &str, values: &[f64]) -> Result<()> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(Error::input(format!("{what}: {v} is not a finite number"))),
        None => Ok(()),
    }
}

/// Refuses a radius that is not positive.
fn positive(what: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::input(format!("{what}: {value} must be a positive number")))
}

/// The positions of a grading: at least two, finite, strictly increasing.
fn positions<'a>(what: &str, grading: &'a Grading) -> Result<&'a [f64]> {
    let at = &grading.at;
    finite(what, at)?;
    if at.len() < 2 {
        return Err(Error::input(format!(
            "{what}: needs at least two positions (one cell), found {}",
            at.len()
        )));
    }
    match at.windows(2).find(|w| w[0] >= w[1]) {
        Some(w) => Err(Error::input(format!("{what}: must increase, but {} follows {}", w[1], w[0]))),
        None => Ok(at),
    }
}

/// Positions that run from exactly 0 to exactly 1 (or to less than 1 if `open`).
fn fractions<'a>(what: &str, grading: &'a Grading, open: bool) -> Result<&'a [f64]> {
    let at = positions(what, grading)?;
    let last = at[at.len() - 1];
    let right = if open { last < 1.0 } else { last == 1.0 };
    if at[0] == 0.0 && right {
        return Ok(at);
    }
    let rule = if open { "start at 0 and end below 1" } else { "run from 0 to 1" };
    Err(Error::input(format!("{what}: must {rule}, but runs from {} to {last}", at[0])))
}

/// Refuses meshes too large to number.
fn affordable(nodes: f64) -> Result<()> {
    if nodes <= MAX_NODES {
        return Ok(());
    }
    Err(Error::input(format!(
        "the mesh would have {nodes:.1e} nodes, more than {MAX_NODES:.0e}: use fewer cells"
    )))
}
