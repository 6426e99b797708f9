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

/// Adds the nodal forces of a traction on a facet, f_a += int N_a p t ds, N, to `f` (dof = 2 node +
/// component).
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

/// Adds int N_a t ds, m2, to `weights`: the area of the facet that belongs to each of its nodes. They add up
/// to the facet's area.
pub fn facet_weights(x: &[[f64; 3]], thickness: f64, weights: &mut [f64]) {
    for_facet_points(x, |n, _, _, length| {
        for (weight, n) in weights.iter_mut().zip(n) {
            *weight += n * length * thickness;
        }
    });
}

/// Calls `at(N, x, outward unit normal, weight ds)` at each quadrature point. With the tangent t = dx/ds the
/// body lies to the left, so the outward normal is (t_y, -t_x)/|t|.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn body_load_of_a_linear_force_has_its_resultant_and_moment() {
        // Rectangle 2 x 1 (triangle: half of it), b = (0, 3 x).
        for kind in ElementKind::ALL {
            let triangle = kind.n_corners() == 3;
            let map =
                |p: &[f64; 3]| if triangle { [2. * p[0], p[1], 0.] } else { [1. + p[0], 0.5 * p[1], 0.] };
            let x: Vec<_> = kind.node_coordinates().iter().map(map).collect();
            let mut f = vec![0.; 2 * x.len()];
            body_load(kind, &x, 0.5, |x| [0., 3. * x[0], 0.], &mut f).unwrap();
            let resultant: f64 = f.chunks(2).map(|f| f[1]).sum();
            let moment: f64 = f.chunks(2).zip(&x).map(|(f, x)| x[0] * f[1]).sum();
            // 1.5 int x dA and 1.5 int x^2 dA.
            let (exact, exact_moment) = if triangle { (1.0, 1.0) } else { (3., 4.) };
            assert!((resultant - exact).abs() < 1e-14 && f.iter().step_by(2).all(|f| *f == 0.), "{kind:?}");
            assert!((moment - exact_moment).abs() < 1e-14, "{kind:?}: {moment}");
        }
    }

    #[test]
    fn pressure_on_a_facet_acts_inwards_and_along_the_normal() {
        // Bottom edge of a body above it, 3 m long: ends, then the mid-side node.
        let x = [[0., 0., 0.], [3., 0., 0.], [1.5, 0., 0.]];
        let push = |_: &[f64; 3], n: &[f64; 3]| n.map(|n| -2. * n);
        let mut f = [0.; 4];
        facet_load(&x[..2], 0.5, push, &mut f);
        assert!(f.iter().zip([0., 1.5, 0., 1.5]).all(|(f, e)| (f - e).abs() < 1e-15), "{f:?}");
        let mut f = [0.; 6];
        facet_load(&x, 0.5, push, &mut f);
        assert!(f.iter().zip([0., 0.5, 0., 0.5, 0., 2.]).all(|(f, e)| (f - e).abs() < 1e-15), "{f:?}");
    }

    #[test]
    fn weights_of_a_curved_facet_add_up_to_the_arc_and_a_closed_pressure_has_no_resultant() {
        // Quarter circle in one line3; the length of its parabola by fine subdivision.
        let h = 0.5_f64.sqrt();
        let x = [[1., 0., 0.], [0., 1., 0.], [h, h, 0.]];
        let at = |s: f64| {
            let n = FacetKind::Line3.shape(s).n;
            [0, 1].map(|i| (0..3).map(|a| n[a] * x[a][i]).sum::<f64>())
        };
        let chord = |k: i32| {
            let (p, q) = (at(f64::from(k) / 5000. - 1.), at(f64::from(k + 1) / 5000. - 1.));
            (p[0] - q[0]).hypot(p[1] - q[1])
        };
        let length: f64 = (0..10_000).map(chord).sum();
        let mut weights = [0.; 3];
        facet_weights(&x, 0.5, &mut weights);
        assert!((weights.iter().sum::<f64>() - 0.5 * length).abs() < 1e-4 * length);
        assert!((weights[0] - weights[1]).abs() < 1e-15);

        // p n over the curve: p times the chord, turned.
        let mut f = [0.; 6];
        facet_load(&x, 1., |_, n| *n, &mut f);
        let resultant = [0, 1].map(|i| f.iter().skip(i).step_by(2).sum::<f64>());
        assert!((resultant[0] - 1.).abs() < 1e-14 && (resultant[1] - 1.).abs() < 1e-14, "{resultant:?}");
    }
}
