//! The smooth outline behind the straight sides of a linear mesh, and its corners.
use super::{Curve, edge};
use crate::mesh::Mesh;
use std::collections::HashMap;
use std::f64::consts::PI;

/// A chain of straight sides has a corner where it turns by more than this, rad: 40 degrees, nine sides on a full circle.
const CORNER: f64 = 40.0 * PI / 180.0;

/// Up to this, rad, a turn that its neighbours have, too, may also be that of a coarse curve: six sides on a full circle.
const COARSE: f64 = 60.0 * PI / 180.0;

/// Sides that turn by less than this, rad, are one straight line.
const STRAIGHT: f64 = 1e-6;

/// A curve turns at a node at most this many times as far as at its neighbours: twice at the middle of a rounding of two
/// sides, at whose ends it turns half as far; the rest is for unequal sides.
const STEEPER: f64 = 2.2;

/// Next to a straight line a curve turns at least this many times as far at its second node as at its first: twice
/// with equal sides, where a chamfer of one side turns alike at both ends.
const BEGINS: f64 = 1.25;

/// A directed side of a chain; the body lies to its left.
#[derive(Clone, Copy)]
pub(crate) struct Side {
    /// Nodes.
    pub ends: [u32; 2],
    /// Direction of the chord, rad.
    pub angle: f64,
    /// Of the chord, m.
    pub length: f64,
}

impl Side {
    /// The side from node `ends[0]` at `p` to `ends[1]` at `q`.
    pub fn new(ends: [u32; 2], p: &[f64; 3], q: &[f64; 3]) -> Side {
        let d = [q[0] - p[0], q[1] - p[1]];
        Side { ends, angle: d[1].atan2(d[0]), length: d[0].hypot(d[1]) }
    }
}

/// What a side stands for.
#[derive(Clone, Copy, Default, PartialEq, Debug)]
pub(crate) struct Smooth {
    /// Angles, rad, from the chord to the tangent of the curve at its start and its end; zero: straight.
    pub tangents: [f64; 2],
    /// How far the curve may lie from this because its nodes do not tell curve from corner, m.
    pub doubt: f64,
}

/// What a turn between two straight sides is.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Joint {
    /// The curve goes on.
    Smooth,
    Corner,
    /// Taken for a corner; it could be a coarse curve.
    Unclear,
}

/// The rule of what a corner is: a turn that its neighbours do not have. `turn` in rad, `around`: those at the nodes before
/// and after; `None`: there is none.
fn joint(turn: f64, around: [Option<f64>; 2]) -> Joint {
    let size = turn.abs();
    let alike = |t: &f64| t * turn > 0.0 && t.abs() * STEEPER >= size;
    let ends = |t: &f64| t.abs() > CORNER || t.abs() > STEEPER * size;
    let [before, after] = around.map(|t| t.filter(alike));
    let likely = match (before, after) {
        (Some(_), Some(_)) => true,
        (None, None) => return Joint::Corner,
        // The curve begins or ends here: at a corner, at the end of the chain, or in a straight line or a curve the
        // other way.
        (Some(t), None) => around[1].is_none_or(|o| ends(&o)) || t.abs() >= BEGINS * size,
        (None, Some(t)) => around[0].is_none_or(|o| ends(&o)) || t.abs() >= BEGINS * size,
    };
    match likely {
        true if size <= CORNER => Joint::Smooth,
        _ if size <= COARSE => Joint::Unclear,
        _ => Joint::Corner,
    }
}

/// The smooth curves behind a chain (or several) of straight sides, side by side.
///
/// The tangent at a node is that of the circle through it and its two neighbours, so that a circle is met to sixth
/// order. Corners stay: there, and where a straight line begins, the tangent is not carried over. Sides in line with a
/// neighbour are straight; next to a corner a side is an arc with the other end's tangent.
pub(crate) fn smooth(sides: &[Side]) -> Vec<Smooth> {
    let starts: HashMap<u32, usize> = starts(sides);
    let next: Vec<Option<usize>> = sides.iter().map(|s| starts.get(&s.ends[1]).copied()).collect();
    let mut before: Vec<Option<usize>> = vec![None; sides.len()];
    next.iter().enumerate().for_each(|(i, next)| {
        if let Some(next) = next {
            before[*next] = Some(i);
        }
    });
    // Of each side: how much the chain turns at its end, into the side that follows.
    let turns: Vec<Option<f64>> =
        std::iter::zip(sides, &next).map(|(s, n)| n.map(|n| wrap(sides[n].angle - s.angle))).collect();
    let turn_before = |i: usize| before[i].and_then(|b| turns[b]);
    let in_line = |turn: Option<f64>| turn.is_some_and(|t| t.abs() < STRAIGHT);
    let straight: Vec<bool> =
        (0..sides.len()).map(|i| in_line(turn_before(i)) || in_line(turns[i])).collect();
    let joints: Vec<Joint> = (0..sides.len())
        .map(|i| match (turns[i], next[i]) {
            (Some(turn), Some(next)) => joint(turn, [turn_before(i), turns[next]]),
            _ => Joint::Corner,
        })
        .collect();
    // Angles from the chords of side i and of the one after it to the tangent between them.
    let tangent = |i: usize| -> Option<[f64; 2]> {
        let (next, turn) = (next[i]?, turns[i]?);
        match (joints[i], straight[i], straight[next]) {
            (Joint::Corner | Joint::Unclear, ..) | (_, true, true) => None,
            // A straight line goes over into the curve without a kink.
            (_, true, false) => Some([0.0, -turn]),
            (_, false, true) => Some([turn, 0.0]),
            (_, false, false) => Some(split(turn, sides[i].length, sides[next].length)),
        }
    };
    let unclear = |i: Option<usize>| -> f64 {
        i.filter(|i| joints[*i] == Joint::Unclear).and_then(|i| turns[i]).unwrap_or(0.0).abs()
    };
    (0..sides.len())
        .map(|i| {
            // An arc that turns by this at both ends rises so far above its chord.
            let doubt = sides[i].length * unclear(before[i]).max(unclear(Some(i))) / 8.0;
            if straight[i] {
                return Smooth::default();
            }
            let start = before[i].and_then(tangent).map(|[_, to]| to);
            let end = tangent(i).map(|[from, _]| from);
            let tangents = match (start, end) {
                (Some(start), Some(end)) => [start, end],
                (Some(start), None) => [start, -start],
                (None, Some(end)) => [-end, end],
                (None, None) => [0.0; 2],
            };
            Smooth { tangents, doubt }
        })
        .collect()
}

/// Gives the straight boundary sides of a linear mesh the curves of a smooth outline ([`Curve::Cubic`]).
///
/// Sides of quadratic cells have their own curve and are left alone.
pub fn follow(mesh: &mut Mesh) {
    let sides = outline(mesh);
    for (side, smooth) in std::iter::zip(&sides, smooth(&sides)) {
        let key = edge(side.ends[0], side.ends[1]);
        if smooth.doubt > 0.0 {
            mesh.unclear.insert(key, smooth.doubt);
        }
        let [start, end] = smooth.tangents;
        if start == 0.0 && end == 0.0 {
            continue;
        }
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
        mesh.curves.insert(key, if side.ends[0] < side.ends[1] { curve } else { curve.reversed() });
    }
}

/// The boundary sides of linear cells.
fn outline(mesh: &Mesh) -> Vec<Side> {
    let side = |facet| {
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        let [a, b] = nodes[..] else { return None };
        Some(Side::new([a, b], &mesh.points[a as usize], &mesh.points[b as usize]))
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

#[cfg(test)]
mod tests {
    use super::*;

    const DEGREE: f64 = PI / 180.0;

    /// Joints of a closed chain that turns by these angles, degrees.
    fn joints(turns: &[f64]) -> Vec<Joint> {
        let n = turns.len();
        let at = |i: usize| turns[i % n] * DEGREE;
        (0..n).map(|i| joint(at(i), [Some(at(i + n - 1)), Some(at(i + 1))])).collect()
    }

    #[test]
    fn a_corner_is_a_turn_that_its_neighbours_do_not_have() {
        for turn in [5.0, 15.0, 39.0, 55.0, 60.0, 90.0, 120.0] {
            for sign in [1.0, -1.0] {
                assert_eq!(joints(&[0.0, sign * turn, 0.0])[1], Joint::Corner, "{turn}");
                // Teeth of one side a flank.
                assert!(joints(&[turn, -turn, turn, -turn]).iter().all(|j| *j == Joint::Corner), "{turn}");
            }
        }
        // A chamfer of one side could be a rounding.
        assert_eq!(joints(&[0.0, 30.0, 30.0, 0.0])[1..3], [Joint::Unclear; 2]);
        // On a circle that turns by 4 degrees a side.
        assert_eq!(joints(&[4.0, 4.0, 12.0, 4.0, 4.0])[1..4], [Joint::Smooth, Joint::Corner, Joint::Smooth]);
    }

    #[test]
    fn curves_have_no_corner() {
        for turn in [1.0, 5.0, 11.25, 22.5, 36.0] {
            assert!(joints(&[turn; 5]).iter().all(|j| *j == Joint::Smooth), "{turn}");
            // From and into straight lines, and between corners.
            let rounded = joints(&[0.0, 0.5 * turn, turn, turn, 0.5 * turn, 0.0]);
            assert!(rounded[1..5].iter().all(|j| *j == Joint::Smooth), "{turn}: {rounded:?}");
            let ends = joints(&[-90.0, turn, turn, turn, 90.0]);
            assert!(ends[1..4].iter().all(|j| *j == Joint::Smooth), "{turn}: {ends:?}");
        }
        let halves = joints(&[0.0, 20.0, 40.0, 20.0, 0.0]);
        assert!(halves[1..4].iter().all(|j| *j == Joint::Smooth), "{halves:?}");
        // Where a wave bends the other way.
        let turns: Vec<f64> = (0..12).map(|k| 3.0 * (30.0 * DEGREE * f64::from(k) + 0.2).cos()).collect();
        let wave = joints(&turns);
        assert!(wave.iter().all(|j| *j == Joint::Smooth), "{wave:?}");
    }
}
