//! Shape functions of the element kinds and of their facets, on the reference element.
//!
//! Quadrilaterals live on [-1, 1]^2, triangles on xi, eta >= 0, xi + eta <= 1, facets on [-1, 1]. Source:
//! Zienkiewicz, Taylor, Zhu, "The Finite Element Method: Its Basis and Fundamentals", chapter on shape
//! functions (serendipity quadrilaterals, triangles in area coordinates).
use super::ElementKind;

/// Most nodes an element can have.
pub const MAX_NODES: usize = 8;

/// Shape functions and their derivatives at one point of the reference element. Entries beyond the element's
/// nodes and beyond its dimension are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// N_a.
    pub n: [f64; MAX_NODES],
    /// dN_a / dxi_j.
    pub dn: [[f64; 3]; MAX_NODES],
}

impl ElementKind {
    /// Reference coordinates of the nodes.
    pub fn node_coordinates(self) -> &'static [[f64; 3]] {
        const TRIANGLE: [[f64; 3]; 6] =
            [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0.5, 0., 0.], [0.5, 0.5, 0.], [0., 0.5, 0.]];
        const SQUARE: [[f64; 3]; 8] = [
            [-1., -1., 0.],
            [1., -1., 0.],
            [1., 1., 0.],
            [-1., 1., 0.],
            [0., -1., 0.],
            [1., 0., 0.],
            [0., 1., 0.],
            [-1., 0., 0.],
        ];
        match self {
            ElementKind::Tri3 => &TRIANGLE[..3],
            ElementKind::Tri6 => &TRIANGLE,
            ElementKind::Quad4 => &SQUARE[..4],
            ElementKind::Quad8 => &SQUARE,
        }
    }

    /// Centre of the reference element.
    pub fn center(self) -> [f64; 3] {
        match self {
            ElementKind::Tri3 | ElementKind::Tri6 => [1. / 3., 1. / 3., 0.],
            ElementKind::Quad4 | ElementKind::Quad8 => [0.; 3],
        }
    }

    /// Kind of the facets.
    pub fn facet_kind(self) -> FacetKind {
        match self {
            ElementKind::Tri3 | ElementKind::Quad4 => FacetKind::Line2,
            ElementKind::Tri6 | ElementKind::Quad8 => FacetKind::Line3,
        }
    }

    /// Shape functions at a point of the reference element.
    #[inline]
    pub fn shape(self, xi: &[f64; 3]) -> Shape {
        let mut shape = Shape { n: [0.; MAX_NODES], dn: [[0.; 3]; MAX_NODES] };
        match self {
            ElementKind::Tri3 => tri3(xi, &mut shape),
            ElementKind::Tri6 => tri6(xi, &mut shape),
            ElementKind::Quad4 => quad4(xi, &mut shape),
            ElementKind::Quad8 => quad8(xi, &mut shape),
        }
        shape
    }
}

/// Derivatives of the area coordinates L = (1 - xi - eta, xi, eta).
const DL: [[f64; 3]; 3] = [[-1., -1., 0.], [1., 0., 0.], [0., 1., 0.]];

/// N_a = L_a.
fn tri3(xi: &[f64; 3], shape: &mut Shape) {
    shape.n[..3].copy_from_slice(&[1. - xi[0] - xi[1], xi[0], xi[1]]);
    shape.dn[..3].copy_from_slice(&DL);
}

/// Corners N_a = L_a (2 L_a - 1), mid-sides N = 4 L_a L_b.
fn tri6(xi: &[f64; 3], shape: &mut Shape) {
    let l = [1. - xi[0] - xi[1], xi[0], xi[1]];
    for a in 0..3 {
        let b = (a + 1) % 3;
        shape.n[a] = l[a] * (2. * l[a] - 1.);
        shape.dn[a] = DL[a].map(|d| (4. * l[a] - 1.) * d);
        shape.n[a + 3] = 4. * l[a] * l[b];
        shape.dn[a + 3] = std::array::from_fn(|j| 4. * (l[b] * DL[a][j] + l[a] * DL[b][j]));
    }
}

/// N_a = (1 + xi xi_a) (1 + eta eta_a) / 4.
fn quad4(xi: &[f64; 3], shape: &mut Shape) {
    for (a, p) in ElementKind::Quad4.node_coordinates().iter().enumerate() {
        let (s, t) = (1. + xi[0] * p[0], 1. + xi[1] * p[1]);
        shape.n[a] = 0.25 * s * t;
        shape.dn[a] = [0.25 * p[0] * t, 0.25 * s * p[1], 0.];
    }
}

/// Corners N_a = (1 + xi xi_a) (1 + eta eta_a) (xi xi_a + eta eta_a - 1) / 4,
/// mid-sides N = (1 - xi^2) (1 + eta eta_a) / 2 or (1 + xi xi_a) (1 - eta^2) / 2.
fn quad8(xi: &[f64; 3], shape: &mut Shape) {
    let [x, y, _] = *xi;
    for (a, p) in ElementKind::Quad8.node_coordinates().iter().enumerate() {
        let (s, t) = (1. + x * p[0], 1. + y * p[1]);
        if a < 4 {
            shape.n[a] = 0.25 * s * t * (x * p[0] + y * p[1] - 1.);
            shape.dn[a][0] = 0.25 * p[0] * t * (2. * x * p[0] + y * p[1]);
            shape.dn[a][1] = 0.25 * p[1] * s * (x * p[0] + 2. * y * p[1]);
        } else if p[0] == 0. {
            shape.n[a] = 0.5 * (1. - x * x) * t;
            shape.dn[a] = [-x * t, 0.5 * (1. - x * x) * p[1], 0.];
        } else {
            shape.n[a] = 0.5 * s * (1. - y * y);
            shape.dn[a] = [0.5 * p[0] * (1. - y * y), -y * s, 0.];
        }
    }
}

/// Kinds of facet; nodes: ends first, then the mid-side node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FacetKind {
    /// Straight line between two nodes.
    Line2,
    /// Parabola through three nodes.
    Line3,
}

/// Shape functions and their derivatives at one point of a facet; the third entry of a line2 is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacetShape {
    /// N_a.
    pub n: [f64; 3],
    /// dN_a / ds.
    pub dn: [f64; 3],
}

impl FacetKind {
    /// The kind with this many nodes: 2 or 3, as in [`ElementKind::facets`].
    pub fn with_nodes(n_nodes: usize) -> FacetKind {
        match n_nodes {
            2 => FacetKind::Line2,
            3 => FacetKind::Line3,
            n => unreachable!("no facet kind has {n} nodes"),
        }
    }

    /// Number of nodes.
    pub fn n_nodes(self) -> usize {
        match self {
            FacetKind::Line2 => 2,
            FacetKind::Line3 => 3,
        }
    }

    /// Position of the nodes on [-1, 1].
    pub fn node_coordinates(self) -> &'static [f64] {
        match self {
            FacetKind::Line2 => &[-1., 1.],
            FacetKind::Line3 => &[-1., 1., 0.],
        }
    }

    /// Shape functions at s in [-1, 1]: (1 -+ s)/2, or s (s -+ 1)/2 and 1 - s^2.
    pub fn shape(self, s: f64) -> FacetShape {
        match self {
            FacetKind::Line2 => FacetShape { n: [0.5 * (1. - s), 0.5 * (1. + s), 0.], dn: [-0.5, 0.5, 0.] },
            FacetKind::Line3 => FacetShape {
                n: [0.5 * s * (s - 1.), 0.5 * s * (s + 1.), 1. - s * s],
                dn: [s - 0.5, s + 0.5, -2. * s],
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [[f64; 3]; 3] = [[0.2, 0.3, 0.], [0.61, 0.07, 0.], [1. / 3., 0.5, 0.]];

    #[test]
    fn shape_functions_are_one_at_their_node_and_zero_at_the_others() {
        for kind in ElementKind::ALL {
            assert_eq!(kind.node_coordinates().len(), kind.n_nodes());
            for (a, xi) in kind.node_coordinates().iter().enumerate() {
                for (b, n) in kind.shape(xi).n.iter().enumerate() {
                    assert!(
                        (n - f64::from(u8::from(a == b))).abs() < 1e-15,
                        "{kind:?} N_{b} at node {a}: {n}"
                    );
                }
            }
        }
        for kind in [FacetKind::Line2, FacetKind::Line3] {
            for (a, &s) in kind.node_coordinates().iter().enumerate() {
                for (b, n) in kind.shape(s).n.iter().enumerate() {
                    assert_eq!(*n, f64::from(u8::from(a == b)));
                }
            }
        }
    }

    #[test]
    fn shape_functions_reproduce_one_and_the_coordinates() {
        for kind in ElementKind::ALL {
            for xi in POINTS {
                let shape = kind.shape(&xi);
                assert!((shape.n.iter().sum::<f64>() - 1.).abs() < 1e-15);
                for j in 0..2 {
                    assert!(shape.dn.iter().map(|d| d[j]).sum::<f64>().abs() < 1e-15);
                    let x: f64 = kind.node_coordinates().iter().zip(shape.n).map(|(p, n)| p[j] * n).sum();
                    assert!((x - xi[j]).abs() < 1e-15, "{kind:?}");
                }
            }
        }
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let h = 1e-6;
        for kind in ElementKind::ALL {
            for xi in POINTS {
                for j in 0..2 {
                    let (mut plus, mut minus) = (xi, xi);
                    plus[j] += h;
                    minus[j] -= h;
                    for a in 0..MAX_NODES {
                        let difference = (kind.shape(&plus).n[a] - kind.shape(&minus).n[a]) / (2. * h);
                        assert!((kind.shape(&xi).dn[a][j] - difference).abs() < 1e-9, "{kind:?} node {a}");
                    }
                }
            }
        }
        for kind in [FacetKind::Line2, FacetKind::Line3] {
            for a in 0..3 {
                let difference = (kind.shape(0.3 + h).n[a] - kind.shape(0.3 - h).n[a]) / (2. * h);
                assert!((kind.shape(0.3).dn[a] - difference).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_facet_has_the_shape_functions_of_its_element() {
        for kind in ElementKind::ALL {
            for facet in kind.facets() {
                let line = FacetKind::with_nodes(facet.len());
                assert_eq!(line, kind.facet_kind());
                let shape = line.shape(0.3);
                let mut xi = [0.; 3];
                for (&node, n) in facet.iter().zip(shape.n) {
                    for (x, p) in xi.iter_mut().zip(kind.node_coordinates()[node]) {
                        *x += n * p;
                    }
                }
                for (&node, n) in facet.iter().zip(shape.n) {
                    assert!((kind.shape(&xi).n[node] - n).abs() < 1e-15, "{kind:?}");
                }
            }
        }
    }
}
