//! The dilatation of an element's modes, projected onto the linear functions.
//!
//! In place of div v = dv_i/dx_i of a mode its projection P div v: the function of 1, xi, eta next to it in L2 over the
//! element. Strains keep their deviator: eps_ii gets (P div v - div v)/2 in each direction of the plane. Eliminating
//! a pressure that is linear in the element from the mixed equations of displacement and pressure gives the same
//! (Simo, Taylor and Pister, Comput. Methods Appl. Mech. Engng 51 (1985) 177).
use super::geometry::Gradients;
use super::{MAX_NODES, PointGeometry, QuadraturePoint};

/// P of the gradients of the modes.
pub(super) struct Dilatation {
    /// Of the [`basis`], for each mode and direction, 1/m.
    coefficients: [[[f64; 2]; 3]; MAX_NODES],
}

/// Linear functions on the reference triangle, zero at its centre but for the first.
fn basis(point: &QuadraturePoint) -> [f64; 3] {
    [1., 3. * point.xi[0] - 1., 3. * point.xi[1] - 1.]
}

impl Dilatation {
    /// From the gradients of the modes at the quadrature points, given the point's index and geometry.
    pub fn new(
        points: &[QuadraturePoint],
        geometry: &[PointGeometry],
        gradients: impl Fn(usize, &PointGeometry) -> Gradients,
    ) -> Self {
        let (mut gram, mut moments) = ([[0.; 3]; 3], [[[0.; 2]; 3]; MAX_NODES]);
        for (p, (point, geometry)) in points.iter().zip(geometry).enumerate() {
            let phi = basis(point).map(|phi| phi * geometry.area);
            for (row, phi) in gram.iter_mut().zip(phi) {
                row.iter_mut().zip(basis(point)).for_each(|(entry, other)| *entry += phi * other);
            }
            for (mode, g) in moments.iter_mut().zip(gradients(p, geometry)) {
                for (sum, phi) in mode.iter_mut().zip(phi) {
                    sum[0] += phi * g[0];
                    sum[1] += phi * g[1];
                }
            }
        }
        let inverse = inverse(&gram);
        let solve = |m: [[f64; 2]; 3]| {
            inverse.map(|row| [0, 1].map(|i| row[0] * m[0][i] + row[1] * m[1][i] + row[2] * m[2][i]))
        };
        Dilatation { coefficients: moments.map(solve) }
    }

    /// (P div v - div v)/2 at a point for unit amplitudes of each mode along x and y, 1/m.
    pub fn change(&self, point: &QuadraturePoint, gradients: &Gradients) -> [[f64; 2]; MAX_NODES] {
        let phi = basis(point);
        std::array::from_fn(|a| {
            let c = &self.coefficients[a];
            let at = |i: usize| phi[0] * c[0][i] + phi[1] * c[1][i] + phi[2] * c[2][i];
            [0.5 * (at(0) - gradients[a][0]), 0.5 * (at(1) - gradients[a][1])]
        })
    }
}

/// Of a symmetric, positive definite matrix, by cofactors.
fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let cofactor = |i: usize, j: usize| {
        let [a, b] = [(i + 1) % 3, (i + 2) % 3];
        let [c, d] = [(j + 1) % 3, (j + 2) % 3];
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let det = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / det))
}
