//! Nodal normals of a surface and the normal field along its facets.
use super::{
    Surface,
    vector::{combine, dot, unit},
};

/// Curves that turn by less than this at a node, rad, go on smoothly.
const SMOOTH: f64 = 1e-6;

/// A parabola's end lags behind the curve by up to 0.14 of the angle that it spans (a quarter of a circle; less of a smaller
/// part, where it falls as its square): a turn beyond this share between two parabolas is a corner.
const LAG: f64 = 0.25;

/// Nodes where the surface has a corner: where the curves of its facets ([`super::Camber`]) meet at an angle. Whether straight
/// facets of a mesh from a file are a curve was decided with the mesh's outline; of parabolas, which have no other curve,
/// the angle counts against what they turn themselves.
pub(super) fn corners(surface: &Surface) -> Vec<bool> {
    let mut around: Vec<Vec<([f64; 3], f64)>> = vec![Vec::new(); surface.nodes.len()];
    for (f, facet) in surface.facets.iter().enumerate() {
        let ends = [own(surface, f, 0), own(surface, f, 1)];
        let has_lag = facet.len() == 3 && surface.cambers[f].is_none();
        let lag = if has_lag { LAG * angle(&ends[0], &ends[1]) } else { 0.0 };
        std::iter::zip(facet, ends).for_each(|(&node, normal)| around[node as usize].push((normal, lag)));
    }
    let meet_at_an_angle = |facets: &Vec<([f64; 3], f64)>| match facets[..] {
        [(a, lag_a), (b, lag_b)] => angle(&a, &b) > SMOOTH.max(lag_a).max(lag_b),
        _ => facets.len() > 2,
    };
    around.iter().map(meet_at_an_angle).collect()
}

/// Angle between two unit vectors, rad.
fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (a[0] * b[1] - a[1] * b[0]).atan2(dot(a, b)).abs()
}

/// Outward unit normals at the nodes.
///
/// A normal is the sum of the adjacent facets' unit normals there, each weighted so that nodes on a circle get the
/// exact radius however unevenly they are spaced. A chord that spans the angle 2a of a circle has the length
/// 2 R sin a, and its normal leans by a from the radius at its end: sin a / (2 R sin a) = 1 / (2 R) whatever a is, so
/// the tangential parts of both neighbours cancel if each is weighted with 1 / length. The end normal of a parabola
/// through 0, a and 2a has the tangential part (1 - cos a)^2 / (sin a (2 - cos a)), which is a^3 / 4 + O(a^5): between two
/// quadratic facets the weight is 1 / length^3. At a corner the weights are equal.
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
        .zip(&surface.corners)
        .map(|(facets, corner)| {
            let power = match facets.iter().all(|&(.., quadratic)| quadratic) {
                _ if *corner => 0,
                true => 3,
                false => 1,
            };
            let shortest = facets.iter().fold(f64::INFINITY, |s, &(_, size, _)| s.min(size));
            let weight = |size: f64| if size > 0.0 { (shortest / size).powi(power) } else { 1.0 };
            unit(&combine(facets.iter().map(|(normal, size, _)| (weight(*size), normal))))
        })
        .collect()
}

/// Unit normal of the curve of facet `f` itself at its `i`-th node.
fn own(surface: &Surface, f: usize, i: usize) -> [f64; 3] {
    surface.curve_normal(f, [-1.0, 1.0, 0.0][i])
}

/// The normals between which the field along facet `f` is interpolated, at its nodes: the nodes' own, but the facet's
/// own where a node is a corner. What is round the corner is not ahead of the facet.
pub(super) fn along(surface: &Surface, f: usize) -> [[f64; 3]; 3] {
    let mut normals = [[0.0; 3]; 3];
    for (i, &node) in surface.facets[f].iter().enumerate() {
        let corner = surface.corners[node as usize];
        normals[i] = if corner { own(surface, f, i) } else { surface.normals[node as usize] };
    }
    normals
}
