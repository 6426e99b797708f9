//! Nodal normals of a surface and the normal field along its facets.
use super::{
    Surface,
    vector::{combine, dot, unit},
};

/// Neighbouring facets whose normals' cosine is below this meet at a kink (about 60 degrees): no smooth surface.
const KINK: f64 = 0.49;

/// At a kink a facet's own normal is further from the node's than this cosine (about half of the above).
const HALF_KINK: f64 = 0.85;

/// Outward unit normals at the nodes.
///
/// A normal is the sum of the adjacent facets' unit normals there, each weighted so that nodes on a circle get the
/// exact radius however unevenly they are spaced. A chord that spans the angle 2a of a circle has the length
/// 2 R sin a, and its normal leans by a from the radius at its end: sin a / (2 R sin a) = 1 / (2 R) whatever a is, so
/// the tangential parts of both neighbours cancel if each is weighted with 1 / length. The end normal of a parabola
/// through 0, a and 2a has the tangential part (1 - cos a)^2 / (sin a (2 - cos a)), which is a^3 / 4 + O(a^5): between two
/// quadratic facets the weight is 1 / length^3. At a kink the weights are equal.
pub(super) fn nodal(surface: &Surface) -> Vec<[f64; 3]> {
    let mut around: Vec<Vec<([f64; 3], f64, bool)>> = vec![Vec::new(); surface.nodes.len()];
    for (f, facet) in surface.facets.iter().enumerate() {
        for (i, &node) in facet.iter().enumerate() {
            let normal = own(surface, f, i);
            around[node as usize].push((normal, surface.facet_size(f), facet.len() == 3));
        }
    }
    around
        .iter()
        .map(|facets| {
            let kink = facets.iter().any(|a| facets.iter().any(|b| dot(&a.0, &b.0) < KINK));
            let power = match facets.iter().all(|&(.., quadratic)| quadratic) {
                _ if kink => 0,
                true => 3,
                false => 1,
            };
            let shortest = facets.iter().fold(f64::INFINITY, |s, &(_, size, _)| s.min(size));
            let weight = |size: f64| if size > 0.0 { (shortest / size).powi(power) } else { 1.0 };
            unit(&combine(facets.iter().map(|(normal, size, _)| (weight(*size), normal))))
        })
        .collect()
}

/// Unit normal of facet `f` itself at its `i`-th node.
fn own(surface: &Surface, f: usize, i: usize) -> [f64; 3] {
    unit(&surface.area_vector(f, [-1.0, 1.0, 0.0][i]))
}

/// The normals between which the field along facet `f` is interpolated, at its nodes: the nodes' own, but the facet's
/// own where a node is a kink. What is round the corner is not ahead of the facet.
pub(super) fn along(surface: &Surface, f: usize) -> [[f64; 3]; 3] {
    let mut normals = [[0.0; 3]; 3];
    for (i, &node) in surface.facets[f].iter().enumerate() {
        let (facet, nodal) = (own(surface, f, i), surface.normals[node as usize]);
        normals[i] = if dot(&facet, &nodal) < HALF_KINK { facet } else { nodal };
    }
    normals
}
