//! Which surface of a pair carries the multipliers.
use super::super::Surface;
use super::segments::{Edge, Segments};

/// Relative differences below this do not count.
const EQUAL: f64 = 1e-6;

/// Facets that differ by less are alike: one more on a surface of twenty; deformation does not change so much.
const ALIKE: f64 = 0.05;

/// A body this much stiffer is nearly rigid to the other, and like a rigid one carries no multipliers: pressures that
/// only it could resist are hardly determined, and take many alternations.
const RIGID: f64 = 10.0;

/// The side of a pair that carries the multipliers: that with the finer facets where the surfaces face each other,
/// unless its body is by far the stiffer one; of two equally fine ones the softer body; of two equally soft ones side 0.
/// `moduli` of the bodies, Pa.
///
/// The choice follows the bodies, not the order in which they are named, and round-off cannot change it.
pub fn multiplier_side(surfaces: [&Surface; 2], moduli: [f64; 2]) -> usize {
    if moduli[0].max(moduli[1]) > RIGID * moduli[0].min(moduli[1]) {
        return usize::from(moduli[1] < moduli[0]);
    }
    smaller(facing_sizes(surfaces)).or_else(|| smaller(moduli)).unwrap_or(0)
}

/// The side with the coarser facets where the surfaces face each other, whose multipliers the displacements of both sides can
/// follow; `None` if they are about equally fine.
pub fn coarser_side(surfaces: [&Surface; 2]) -> Option<usize> {
    let [a, b] = facing_sizes(surfaces);
    ((a - b).abs() > ALIKE * a.max(b)).then_some(usize::from(b > a))
}

fn facing_sizes([a, b]: [&Surface; 2]) -> [f64; 2] {
    [facing_size(a, b), facing_size(b, a)]
}

/// Index of the smaller of two numbers; `None` if they are equal within the tolerance.
fn smaller([a, b]: [f64; 2]) -> Option<usize> {
    ((a - b).abs() > EQUAL * a.abs().max(b.abs())).then_some(usize::from(b < a))
}

/// Mean facet size of the part of `surface` that faces `other`, m: its length over the number of facets in it, parts of
/// facets counting as parts. That of the whole surface if nothing faces.
fn facing_size(surface: &Surface, other: &Surface) -> f64 {
    let segments = Segments::new(surface, other, f64::INFINITY);
    let (mut length, mut count, mut whole) = (0.0, 0.0, 0.0);
    for f in 0..surface.facets.len() {
        let found = segments.of(&Edge::new(surface, f));
        let part: f64 = found.iter().map(|s| 0.5 * (s.span[1] - s.span[0])).sum();
        length += part * surface.facet_size(f);
        count += part;
        whole += surface.facet_size(f);
    }
    if count > 0.0 { length / count } else { whole / surface.facets.len().max(1) as f64 }
}
