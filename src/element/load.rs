//! Nodal forces of distributed loads, and the share of a facet that belongs to each node.
use super::{ElementKind, FacetKind, PointGeometry, facet_rule, load_rule};
use crate::Result;

/// Adds the nodal forces of a body force, f_a += int N_a b t dA, N, to `f` (dof = 2 node + component).
///
/// `x`: node coordinates, m; `thickness`, m; `b(x)`: force per volume, N/m3.
pub fn body_load(
    kind: ElementKind,
    x: &[[f64; 3]],
    thickness: f64,
    mut b: impl FnMut(&[f64; 3]) -> [f64; 3],
    f: &mut [f64],
) -> Result<()> {
    for point in load_rule(kind) {
        let g = PointGeometry::new(kind, x, point)?;
        let b = b(&g.x);
        for (node, n) in f.chunks_exact_mut(2).zip(g.n) {
            for (force, b) in node.iter_mut().zip(b) {
                *force += n * b * g.area * thickness;
            }
        }
    }
    Ok(())
}

/// Adds the nodal forces of a traction on a facet, f_a += int N_a p t ds, N, to `f` (dof = 2 node + component).
///
/// `x`: coordinates of the facet's nodes in the order of [`ElementKind::facets`], m; `thickness`, m;
/// `traction(x, n)`: Pa, from the position and the outward unit normal there. Curved facets keep their curve.
pub fn facet_load(
    x: &[[f64; 3]],
    thickness: f64,
    mut traction: impl FnMut(&[f64; 3], &[f64; 3]) -> [f64; 3],
    f: &mut [f64],
) {
    for_facet_points(x, |n, position, normal, length| {
        let p = traction(position, normal);
        for (node, n) in f.chunks_exact_mut(2).zip(n) {
            for (force, p) in node.iter_mut().zip(p) {
                *force += n * p * length * thickness;
            }
        }
    });
}

/// Adds int N_a t ds, m2, to `weights`: the area of the facet that belongs to each of its nodes. They add up to
/// the facet's area.
pub fn facet_weights(x: &[[f64; 3]], thickness: f64, weights: &mut [f64]) {
    for_facet_points(x, |n, _, _, length| {
        for (weight, n) in weights.iter_mut().zip(n) {
            *weight += n * length * thickness;
        }
    });
}

/// Calls `at(N, x, outward unit normal, weight ds)` at each quadrature point. With the tangent t = dx/ds the body
/// lies to the left, so the outward normal is (t_y, -t_x)/|t|.
fn for_facet_points(x: &[[f64; 3]], mut at: impl FnMut(&[f64; 3], &[f64; 3], &[f64; 3], f64)) {
    let kind = FacetKind::with_nodes(x.len());
    for point in facet_rule(kind) {
        let shape = kind.shape(point.s);
        let (mut position, mut tangent) = ([0.; 3], [0.; 3]);
        for (a, node) in x.iter().enumerate() {
            for i in 0..3 {
                position[i] += shape.n[a] * node[i];
                tangent[i] += shape.dn[a] * node[i];
            }
        }
        let length = tangent[0].hypot(tangent[1]);
        if length > 0. {
            let normal = [tangent[1] / length, -tangent[0] / length, 0.];
            at(&shape.n, &position, &normal, length * point.weight);
        }
    }
}
