//! From values at the quadrature points to values at the nodes and means over the element.
use super::{ElementKind, PointGeometry, SolidElement, load_rule};
use crate::Result;

impl SolidElement {
    /// Values at the nodes from values at the quadrature points.
    ///
    /// tri3: the constant. tri6: the linear function through the three points, or fitted to the seven. Quadrilaterals: a + b xi + c
    /// eta + d xi eta, through the 2 x 2 points, or fitted to the 3 x 3 points by least squares with the
    /// Gauss weights (the fit takes the values of the quadratic at the 2 x 2 points, where stresses are most
    /// accurate: Barlow, Int. J. Numer. Meth. Engng 10 (1976) 243).
    pub fn to_nodes<const N: usize>(&self, at_points: &[[f64; N]], at_nodes: &mut [[f64; N]]) {
        match self.kind() {
            ElementKind::Tri3 => at_nodes.fill(at_points[0]),
            ElementKind::Tri6 => self.fit(at_points, at_nodes, |xi| {
                // Orthogonal; with three points 2 L_a - 1/3 is one at point a and zero at the others.
                [1. - xi[0] - xi[1], xi[0], xi[1]].map(|l| 2. * l - 1. / 3.)
            }),
            ElementKind::Quad4 | ElementKind::Quad8 => {
                self.fit(at_points, at_nodes, |xi| [1., xi[0], xi[1], xi[0] * xi[1]])
            }
        }
    }

    /// Mean over the element, (1/A) int v dA, of values at the quadrature points; `geometry`: by
    /// [`Self::geometry`].
    pub fn mean<const N: usize>(geometry: &[PointGeometry], at_points: &[[f64; N]]) -> [f64; N] {
        let (mut mean, mut total) = ([0.; N], 0.);
        for (geometry, values) in geometry.iter().zip(at_points) {
            total += geometry.area;
            for (sum, value) in mean.iter_mut().zip(values) {
                *sum += geometry.area * value;
            }
        }
        mean.map(|sum| sum / total)
    }

    /// Volume, m3.
    pub fn volume(&self, x: &[[f64; 3]], thickness: f64) -> Result<f64> {
        let mut volume = 0.;
        for point in load_rule(self.kind()) {
            volume += PointGeometry::new(self.kind(), x, point)?.area * thickness;
        }
        Ok(volume)
    }

    /// Least squares fit with a `basis` that is orthogonal under the rule, evaluated at the nodes.
    fn fit<const N: usize, const M: usize>(
        &self,
        at_points: &[[f64; N]],
        at_nodes: &mut [[f64; N]],
        basis: impl Fn(&[f64; 3]) -> [f64; M],
    ) {
        let (mut coefficients, mut norms) = ([[0.; N]; M], [0.; M]);
        for (point, values) in self.points().iter().zip(at_points) {
            let phi = basis(&point.xi);
            for m in 0..M {
                norms[m] += point.weight * phi[m] * phi[m];
                for (c, value) in coefficients[m].iter_mut().zip(values) {
                    *c += point.weight * phi[m] * value;
                }
            }
        }
        for (coefficients, norm) in coefficients.iter_mut().zip(norms) {
            *coefficients = coefficients.map(|c| c / norm);
        }
        for (node, xi) in at_nodes.iter_mut().zip(self.kind().node_coordinates()) {
            *node = [0.; N];
            for (phi, coefficients) in basis(xi).iter().zip(&coefficients) {
                node.iter_mut().zip(coefficients).for_each(|(value, c)| *value += phi * c);
            }
        }
    }
}
