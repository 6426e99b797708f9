//! Length of the contact: between the zeros of the pressure, within what lies opposite.
use crate::{
    contact::{
        Surface,
        vector::{norm, sub},
    },
    vector::larger,
};
use nalgebra::{DMatrix, DVector};

/// Nodes of the parabola whose root is the end of the contact.
const WINDOW: usize = 5;

/// A piece of a facet between two neighbouring nodes.
struct Piece {
    nodes: [usize; 2],
    /// Middle node of the facet, if it is quadratic.
    middle: Option<usize>,
    length: f64,
    /// Where that which lies opposite begins and ends, as shares of the length.
    cover: [f64; 2],
}

/// Length, m, of the part of `surface` that touches, given the pressures at its nodes, Pa, which of them touch, and the part of
/// each facet that has a partner, in its own coordinate from -1 to 1.
///
/// A piece between two nodes in contact counts whole. Beyond the last one the contact reaches to where the pressure
/// vanishes, at most to the next node; nothing counts that lies opposite nothing.
pub(super) fn contact_length(
    surface: &Surface,
    cover: &[Option<[f64; 2]>],
    pressure: &[f64],
    touches: &[bool],
) -> f64 {
    let pieces = pieces(surface, cover);
    // Pieces before and after each node.
    let mut around = vec![[None; 2]; surface.nodes.len()];
    for (k, piece) in pieces.iter().enumerate() {
        (around[piece.nodes[0]][1], around[piece.nodes[1]][0]) = (Some(k), Some(k));
    }
    let reach = |piece: &Piece, inside: usize| {
        let last = inwards(&pieces, &around, piece.nodes[inside], inside, pressure, touches);
        end_beyond(&last, piece.length) / piece.length
    };
    let length = |piece: &Piece| {
        let part = match piece.nodes.map(|n| touches[n]) {
            [true, true] => [0.0, 1.0],
            [true, false] => [0.0, reach(piece, 0)],
            [false, true] => [1.0 - reach(piece, 1), 1.0],
            [false, false] => return 0.0,
        };
        // A contact that ends before the last node takes off what the piece before counted too much.
        match part[1] - part[0] {
            negative if negative < 0.0 => negative * piece.length,
            _ => (part[1].min(piece.cover[1]) - part[0].max(piece.cover[0])).max(0.0) * piece.length,
        }
    };
    larger(pieces.iter().map(length).sum(), 0.0)
}

/// The facets' pieces from node to node.
fn pieces(surface: &Surface, cover: &[Option<[f64; 2]>]) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (facet, cover) in std::iter::zip(&surface.facets, cover) {
        let along: Vec<usize> = match facet[..] {
            [a, b, m] => vec![a as usize, m as usize, b as usize],
            _ => facet.iter().map(|&n| n as usize).collect(),
        };
        let count = along.len().saturating_sub(1);
        for (k, ends) in along.windows(2).enumerate() {
            let share = |xi: f64| (0.5 * (1.0 + xi) * count as f64 - k as f64).clamp(0.0, 1.0);
            pieces.push(Piece {
                nodes: [ends[0], ends[1]],
                middle: facet.get(2).map(|n| *n as usize),
                length: norm(&sub(&surface.points[ends[1]], &surface.points[ends[0]])),
                cover: cover.map_or([0.0; 2], |span| span.map(share)),
            });
        }
    }
    pieces
}

/// A node in contact, seen from the end of the contact.
#[derive(Clone, Copy)]
struct Last {
    /// Beyond the last node in contact, m: not positive.
    place: f64,
    pressure: f64,
    weight: Weight,
}

/// What the pressure at a node is a mean with, over its force's support: the shape of the node's multiplier.
#[derive(Clone, Copy)]
enum Weight {
    Hat,
    /// Bernstein's polynomials of a quadratic facet, at its ends and at its middle.
    QuadraticEnd,
    QuadraticMiddle,
}

impl Weight {
    /// How many pieces it reaches, and its value at this share of them.
    fn reach(self) -> f64 {
        if matches!(self, Weight::QuadraticEnd) { 2.0 } else { 1.0 }
    }

    fn at(self, share: f64) -> f64 {
        match self {
            Weight::Hat => 1.0 - share,
            Weight::QuadraticEnd => (1.0 - share).powi(2),
            Weight::QuadraticMiddle => 1.0 - share * share,
        }
    }
}

/// The touching nodes from `node` inwards, the last one first.
fn inwards(
    pieces: &[Piece],
    around: &[[Option<usize>; 2]],
    node: usize,
    side: usize,
    pressure: &[f64],
    touches: &[bool],
) -> Vec<Last> {
    let weight = |piece: &Piece, node: usize| match piece.middle {
        None => Weight::Hat,
        Some(middle) if middle == node => Weight::QuadraticMiddle,
        Some(_) => Weight::QuadraticEnd,
    };
    let (mut at, mut place) = (node, 0.0);
    let mut last: Vec<Last> = Vec::new();
    while let Some(piece) = around[at][side].or(around[at][1 - side]).map(|k| &pieces[k]) {
        last.push(Last { place, pressure: pressure[at], weight: weight(piece, at) });
        let next = around[at][side].map(|k| pieces[k].nodes[side]);
        let Some(next) = next.filter(|n| touches[*n] && *n != node && last.len() <= WINDOW) else { break };
        place -= piece.length;
        at = next;
    }
    last
}

/// How far beyond the last node in contact the pressure vanishes, m: at a smooth end p^2 is smooth in the distance from it
/// (Hertz: a parabola), so its root is that of the parabola through the nodes before the last one, whose own support
/// reaches beyond the contact; with few nodes that of the line through the last two. Not before the node before the last,
/// not beyond `room`, which is taken where the pressure does not fall, and half of it where one node alone touches.
fn end_beyond(last: &[Last], room: f64) -> f64 {
    let [first, second, ..] = last else { return 0.5 * room };
    let line = || {
        let squares = [first.pressure.powi(2), second.pressure.powi(2)];
        let slope = (squares[1] - squares[0]) / (first.place - second.place);
        if slope > 0.0 { squares[0] / slope } else { room }
    };
    let root = if last.len() > WINDOW { root_of_parabola(last) } else { None };
    root.filter(|r| *r >= second.place && *r <= room).unwrap_or_else(line).clamp(second.place, room)
}

/// Rounds in which the parabola is fitted again to what its own means around the nodes leave of the pressures: each gains
/// two digits.
const ROUNDS: usize = 6;

/// Points of the mean to either side of a node: the midpoint rule, which does not mind the root in p.
const POINTS: usize = 32;

/// First root beyond the last node but one of the parabola that p^2 fits best there. A nodal pressure is a mean around its
/// node, by which it lies below the pressure there: the fit takes that back.
fn root_of_parabola(last: &[Last]) -> Option<f64> {
    let nodes = &last[1..];
    let size = -last[last.len() - 1].place;
    let largest = nodes.iter().map(|n| n.pressure).fold(0.0, larger);
    let matrix = DMatrix::from_fn(nodes.len(), 3, |r, k| (nodes[r].place / size).powi(k as i32));
    let factors = matrix.qr();
    let mut pressures = DVector::from_iterator(nodes.len(), nodes.iter().map(|n| n.pressure / largest));
    let mut fit = DVector::zeros(3);
    for round in 0..=ROUNDS {
        let squares = pressures.map(|p| p * p);
        fit = factors.r().solve_upper_triangular(&(factors.q().transpose() * squares))?;
        let curve = |place: f64| (fit[0] + place / size * (fit[1] + place / size * fit[2])).max(0.0).sqrt();
        if round == ROUNDS {
            break;
        }
        for (i, node) in nodes.iter().enumerate() {
            let outwards = last[i].place - node.place;
            let inwards = last.get(i + 2).map_or(outwards, |next| node.place - next.place);
            let bias = mean(node, [outwards, inwards], &curve) - curve(node.place);
            pressures[i] = (node.pressure / largest - bias).max(0.0);
        }
    }
    let (c, b, a) = (fit[0], fit[1], fit[2]);
    let root = (b * b - 4.0 * a * c).sqrt();
    let q = -0.5 * (b + root.copysign(b));
    let beyond = |r: &f64| r.is_finite() && *r > nodes[0].place / size;
    [q / a, c / q].into_iter().filter(beyond).min_by(f64::total_cmp).map(|r| r * size)
}

/// Mean of a function of the place around a node; `lengths` of the pieces outwards and inwards, m.
fn mean(node: &Last, lengths: [f64; 2], curve: &dyn Fn(f64) -> f64) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (length, sign) in std::iter::zip(lengths, [1.0, -1.0]) {
        let reach = node.weight.reach() * length;
        for k in 0..POINTS {
            let share = (k as f64 + 0.5) / POINTS as f64;
            let weight = node.weight.at(share) * reach;
            sum += weight * curve(node.place + sign * share * reach);
            total += weight;
        }
    }
    sum / total
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(nodes: &[f64]) -> Surface {
        let points: Vec<[f64; 2]> = nodes.iter().map(|x| [*x, 0.0]).collect();
        Surface::rigid_polyline(&points)
    }

    fn length(x: &[f64], cover: Option<[f64; 2]>, p: impl Fn(f64) -> f64) -> f64 {
        let surface = line(x);
        let pressure: Vec<f64> = x.iter().map(|x| p(*x)).collect();
        let touches: Vec<bool> = pressure.iter().map(|p| *p > 0.0).collect();
        let mut covers = vec![Some([-1.0, 1.0]); surface.facets.len()];
        if let (Some(cover), Some(last)) = (cover, covers.last_mut()) {
            *last = Some(cover);
        }
        contact_length(&surface, &covers, &pressure, &touches)
    }

    #[test]
    fn ends_of_hertz_are_found_between_the_nodes() {
        let x: Vec<f64> = (0..=40).map(|i| -2.0 + 0.1 * f64::from(i)).collect();
        // Nodal pressures are means with hat functions.
        for a in [0.91, 0.953, 0.999, 1.03, 1.07] {
            let hertz = |x: f64| (1.0 - (x / a).powi(2)).max(0.0).sqrt();
            let node = |x: f64| Last { place: x, pressure: 0.0, weight: Weight::Hat };
            let means = |x: f64| mean(&node(x), [0.1; 2], &hertz);
            let found = length(&x, None, means);
            assert!((found - 2.0 * a).abs() < 3e-3, "{a}: {found}");
        }
    }

    #[test]
    fn nothing_counts_that_lies_opposite_nothing() {
        let x: Vec<f64> = (0..=10).map(f64::from).collect();
        assert!((length(&x, None, |_| 3.0) - 10.0).abs() < 1e-12);
        // The partner ends in the middle of the last facet, whose nodes all touch.
        assert!((length(&x, Some([-1.0, 0.0]), |_| 3.0) - 9.5).abs() < 1e-12);
        // It ends before the last node, which carries nothing.
        let uniform = |x: f64| if x < 9.5 { 3.0 } else { 0.0 };
        assert!((length(&x, Some([-1.0, -0.8]), uniform) - 9.1).abs() < 1e-12);
        assert_eq!(length(&x, None, |_| 0.0), 0.0);
    }

    #[test]
    fn a_closed_surface_is_as_long_as_its_facets() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let surface = Surface::rigid_polyline(&square);
        let cover = vec![Some([-1.0, 1.0]); 4];
        assert!((contact_length(&surface, &cover, &[1.0; 4], &[true; 4]) - 6.0).abs() < 1e-12);
    }
}
