//! What round-off makes of the forces in a body.
use crate::{contact::vector::dot, element::PointGeometry, vector::largest};

/// What the unit round-off of the displacements `u` of a cell of `n` nodes makes of the forces of its stresses, N: eps |u| times its
/// stiffness, by that of the material against a strain times the thickness, N/m.
pub(super) fn rounded(geometry: &[PointGeometry], n: usize, stiffness: f64, u: &[f64]) -> f64 {
    // The trace of a stiffness, of which a node has its share.
    let of_point = |g: &PointGeometry| g.area * g.gradient[..n].iter().map(|d| dot(d, d)).sum::<f64>();
    f64::EPSILON * stiffness * geometry.iter().map(of_point).sum::<f64>() * largest(u)
}
