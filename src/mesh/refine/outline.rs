//! The smooth outline behind the straight sides of a linear mesh.
use super::{Curve, edge};
use crate::mesh::Mesh;
use std::collections::HashMap;
use std::f64::consts::PI;

/// The outline has a corner where it turns by more than this, rad: 40 degrees, nine sides on a full circle.
const CORNER: f64 = 40.0 * PI / 180.0;

/// Sides that turn by less than this, rad, are one straight line.
const STRAIGHT: f64 = 1e-6;

/// A directed side of the outline; the body lies to its left.
#[derive(Clone, Copy)]
struct Side {
    ends: [u32; 2],
    /// Direction of the chord, rad.
    angle: f64,
    length: f64,
}

/// Gives the straight boundary sides of a linear mesh the curves of a smooth outline ([`Curve::Cubic`]).
///
/// The tangent at a node is that of the circle through it and its two neighbours, so that a circle is met to sixth
/// order. Corners stay: there, and where a straight line begins, the tangent is not carried over. Sides in line with a
/// neighbour are straight. Sides of quadratic cells have their own curve and are left alone.
pub fn follow(mesh: &mut Mesh) {
    let sides = outline(mesh);
    let starts: HashMap<u32, usize> = starts(&sides);
    // Of each side: how much the outline turns at its end, into the side that follows.
    let next: Vec<Option<usize>> = sides.iter().map(|s| starts.get(&s.ends[1]).copied()).collect();
    let mut before: Vec<Option<usize>> = vec![None; sides.len()];
    next.iter().enumerate().for_each(|(i, next)| {
        if let Some(next) = next {
            before[*next] = Some(i);
        }
    });
    let turn = |from: usize, to: usize| wrap(sides[to].angle - sides[from].angle);
    let in_line = |i: usize| {
        let straight = |from: Option<usize>, to: Option<usize>| {
            from.zip(to).is_some_and(|(from, to)| turn(from, to).abs() < STRAIGHT)
        };
        straight(before[i], Some(i)) || straight(Some(i), next[i])
    };
    let straight: Vec<bool> = (0..sides.len()).map(in_line).collect();
    // Angle from the chord of side i to the outline's tangent, at its start (from the side before) and at its end.
    let tangent = |from: usize, to: usize| -> Option<[f64; 2]> {
        let turned = turn(from, to);
        if turned.abs() > CORNER {
            return None;
        }
        // A straight line goes over into the curve without a kink.
        match (straight[from], straight[to]) {
            (true, true) => None,
            (true, false) => Some([0.0, -turned]),
            (false, true) => Some([turned, 0.0]),
            (false, false) => Some(split(turned, sides[from].length, sides[to].length)),
        }
    };
    for (i, side) in sides.iter().enumerate().filter(|(i, _)| !straight[*i]) {
        let start = before[i].and_then(|b| tangent(b, i)).map(|[_, to]| to);
        let end = next[i].and_then(|n| tangent(i, n)).map(|[from, _]| from);
        // Next to a corner the side is an arc with the other end's tangent.
        let (start, end) = match (start, end) {
            (Some(start), Some(end)) => (start, end),
            (Some(start), None) => (start, -start),
            (None, Some(end)) => (-end, end),
            (None, None) => continue,
        };
        let ends = side.ends.map(|n| [mesh.points[n as usize][0], mesh.points[n as usize][1]]);
        // Handles of the cubic that is an arc where both angles are the same.
        let handle = side.length / (3.0 * (0.25 * (end - start)).cos().powi(2));
        let (s1, c1) = (side.angle + start).sin_cos();
        let (s2, c2) = (side.angle + end).sin_cos();
        let control = [
            [ends[0][0] + handle * c1, ends[0][1] + handle * s1],
            [ends[1][0] - handle * c2, ends[1][1] - handle * s2],
        ];
        let curve = Curve::Cubic { control };
        mesh.curves.insert(
            edge(side.ends[0], side.ends[1]),
            if side.ends[0] < side.ends[1] { curve } else { curve.reversed() },
        );
    }
}

/// The boundary sides of linear cells.
fn outline(mesh: &Mesh) -> Vec<Side> {
    let side = |facet| {
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        let [a, b] = nodes[..] else { return None };
        let (p, q) = (mesh.points[a as usize], mesh.points[b as usize]);
        let d = [q[0] - p[0], q[1] - p[1]];
        Some(Side { ends: [a, b], angle: d[1].atan2(d[0]), length: d[0].hypot(d[1]) })
    };
    mesh.single_sides().into_iter().filter_map(side).collect()
}

/// The side that starts at a node, unless several do: pieces that meet in a point have a corner there.
fn starts(sides: &[Side]) -> HashMap<u32, usize> {
    let mut starts = HashMap::new();
    let mut several = Vec::new();
    for (i, side) in sides.iter().enumerate() {
        if starts.insert(side.ends[0], i).is_some() {
            several.push(side.ends[0]);
        }
    }
    starts.retain(|node, _| !several.contains(node));
    starts
}

/// Tangent of the circle through the ends of two chords of lengths `a` and `b`, the second turned by `turn` against the
/// first: its angle against the first, and against the second. (Tangent-chord theorem: half the arc over the chord.)
fn split(turn: f64, a: f64, b: f64) -> [f64; 2] {
    // The angles x over a and turn - x over b have sin x / a = sin(turn - x) / b = 1 / (2 R).
    let (s, c) = turn.sin_cos();
    let x = (a * s).atan2(b + a * c);
    [x, x - turn]
}

/// An angle in (-pi, pi].
fn wrap(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}
