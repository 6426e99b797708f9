//! What an element's map from reference to body gives at a point: position, area and shape function
//! gradients.
use super::shape::{MAX_NODES, Shape};
use super::{ElementKind, QuadraturePoint};
use crate::{Error, Result};

/// Gradient of each displacement mode at a quadrature point, 1/m: shape functions, then internal modes.
pub(super) type Gradients = [[f64; 3]; MAX_NODES];

/// An element at one quadrature point.
#[derive(Debug, Clone, Copy)]
pub struct PointGeometry {
    /// Position, m.
    pub x: [f64; 3],
    /// Shape functions N_a.
    pub n: [f64; MAX_NODES],
    /// dN_a/dx_i, 1/m.
    pub gradient: [[f64; 3]; MAX_NODES],
    /// det J times the weight of the point, m2.
    pub area: f64,
    /// det J, m2.
    pub det: f64,
}

/// Jacobian J_ij = dx_i/dxi_j of the map, m, and its determinant, m2.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jacobian {
    j: [[f64; 2]; 2],
    /// det J.
    pub det: f64,
}

impl Jacobian {
    /// From the nodes' coordinates. A determinant that is not positive is an input error.
    #[inline]
    pub fn new(kind: ElementKind, x: &[[f64; 3]], shape: &Shape) -> Result<Self> {
        let mut j = [[0.; 2]; 2];
        for (node, dn) in x.iter().zip(&shape.dn) {
            for (row, coordinate) in j.iter_mut().zip(node) {
                row[0] += coordinate * dn[0];
                row[1] += coordinate * dn[1];
            }
        }
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        if det > 0. { Ok(Jacobian { j, det }) } else { Err(inverted(kind, x, det)) }
    }

    /// Gradient J^-T g in the body of a function whose reference derivatives are g.
    #[inline]
    pub fn gradient(&self, g: &[f64; 3]) -> [f64; 3] {
        let [[a, b], [c, d]] = self.j;
        let per_det = 1. / self.det;
        [(d * g[0] - c * g[1]) * per_det, (a * g[1] - b * g[0]) * per_det, 0.]
    }
}

impl PointGeometry {
    /// The element with these node coordinates at a quadrature point.
    #[inline]
    pub fn new(kind: ElementKind, x: &[[f64; 3]], point: &QuadraturePoint) -> Result<Self> {
        let shape = kind.shape(&point.xi);
        let jacobian = Jacobian::new(kind, x, &shape)?;
        let mut geometry = PointGeometry {
            x: [0.; 3],
            n: shape.n,
            gradient: [[0.; 3]; MAX_NODES],
            area: point.weight * jacobian.det,
            det: jacobian.det,
        };
        for (a, node) in x.iter().enumerate() {
            for (sum, coordinate) in geometry.x.iter_mut().zip(node) {
                *sum += shape.n[a] * coordinate;
            }
            geometry.gradient[a] = jacobian.gradient(&shape.dn[a]);
        }
        Ok(geometry)
    }
}

fn inverted(kind: ElementKind, x: &[[f64; 3]], det: f64) -> Error {
    let nodes: Vec<String> = x.iter().map(|p| format!("({}, {})", p[0], p[1])).collect();
    Error::input(format!(
        "a {} element is inverted or degenerate (det J = {det:e} at a quadrature point); its nodes must run \
         counter-clockwise: {}",
        kind.name(),
        nodes.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::load_rule;

    /// x = map of the reference coordinates with all terms an element kind can carry.
    fn distorted(kind: ElementKind) -> Vec<[f64; 3]> {
        let map = |p: &[f64; 3]| {
            let (s, t) = (p[0], p[1]);
            [2. + 1.3 * s - 0.2 * t + 0.05 * s * t, -1. + 0.3 * s + 0.9 * t + 0.08 * s * t - 0.04 * s * s, 0.]
        };
        kind.node_coordinates().iter().map(map).collect()
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        for kind in ElementKind::ALL {
            let x = distorted(kind);
            let (xi, h) = ([0.3, 0.2, 0.], 1e-6);
            let at = |xi| PointGeometry::new(kind, &x, &QuadraturePoint { xi, weight: 1. }).unwrap();
            let g = at(xi);
            // Along each reference direction: dN/dxi_j = grad N . dx/dxi_j.
            for j in 0..2 {
                let (mut plus, mut minus) = (xi, xi);
                plus[j] += h;
                minus[j] -= h;
                let (p, m) = (at(plus), at(minus));
                for a in 0..kind.n_nodes() {
                    let along: f64 = (0..2).map(|i| g.gradient[a][i] * (p.x[i] - m.x[i])).sum();
                    assert!((p.n[a] - m.n[a] - along).abs() < 1e-9 * h.sqrt(), "{kind:?} node {a}");
                }
            }
        }
    }

    #[test]
    fn area_is_that_of_the_polygon() {
        // Shoelace formula; straight sides only.
        for kind in [ElementKind::Tri3, ElementKind::Quad4] {
            let x = distorted(kind);
            let n = x.len();
            let polygon: f64 =
                (0..n).map(|a| (x[a], x[(a + 1) % n])).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum();
            let area: f64 =
                load_rule(kind).iter().map(|g| PointGeometry::new(kind, &x, g).unwrap().area).sum();
            assert!((area - polygon / 2.).abs() < 1e-14 * area);
        }
    }

    #[test]
    fn a_clockwise_element_is_refused_with_its_coordinates() {
        let x = [[0., 0., 0.], [0., 1., 0.], [1.5, 0., 0.]];
        let error = PointGeometry::new(ElementKind::Tri3, &x, &load_rule(ElementKind::Tri3)[0]).unwrap_err();
        assert!(matches!(error, Error::Input(_)));
        assert!(error.to_string().contains("tri3") && error.to_string().contains("(1.5, 0)"), "{error}");
    }
}
