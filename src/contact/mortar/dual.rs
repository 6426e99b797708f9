//! Dual shape functions of the multipliers on the part of an edge that has a partner.
//!
//! Displacements on the multiplier side are written in Bernstein polynomials B, since the integral of each over any
//! part of an edge is positive; that of a quadratic shape function need not be. B is in the order of the facet's
//! nodes: linear (1 -+ xi)/2; quadratic (1 -+ xi)^2/4, (1 - xi^2)/2.
use nalgebra::{DMatrix, DVector};

/// B at `xi`; the first `n_nodes` count.
pub fn bernstein(n_nodes: usize, xi: f64) -> [f64; 3] {
    let (a, b) = (0.5 * (1.0 - xi), 0.5 * (1.0 + xi));
    if n_nodes == 2 { [a, b, 0.0] } else { [a * a, b * b, 2.0 * a * b] }
}

/// Coefficients T (n x n) in B_j(xi) = sum_l T_jl B_l(tau), tau from -1 to 1 as xi goes from `span[0]` to `span[1]`.
/// Positive, hence free of cancellation, if the span lies in [-1, 1]. The inverse is that of the inverse map.
fn restricted(n_nodes: usize, span: [f64; 2]) -> DMatrix<f64> {
    let [low, high] = span.map(|xi| 0.5 * (1.0 + xi));
    if n_nodes == 2 {
        return DMatrix::from_row_slice(2, 2, &[1.0 - low, 1.0 - high, low, high]);
    }
    let (from, to) = (1.0 - low, 1.0 - high);
    #[rustfmt::skip]
    let t = [
        from * from, to * to, from * to,
        low * low, high * high, low * high,
        2.0 * low * from, 2.0 * high * to, low * to + high * from,
    ];
    DMatrix::from_row_slice(3, 3, &t)
}

/// Integrals over the part of an edge that has a partner, in the Bernstein basis b of that part alone: however short
/// it is, no digits are lost.
#[derive(Debug, Clone)]
pub struct Part {
    /// Where it begins and ends on the edge.
    pub span: [f64; 2],
    /// int b b' dA, n x n.
    pub mass: DMatrix<f64>,
    /// int b dA.
    pub area: DVector<f64>,
}

impl Part {
    /// Nothing integrated yet.
    pub fn new(n_nodes: usize, span: [f64; 2]) -> Self {
        Part { span, mass: DMatrix::zeros(n_nodes, n_nodes), area: DVector::zeros(n_nodes) }
    }

    /// b at `xi`.
    pub fn basis(&self, xi: f64) -> DVector<f64> {
        let tau = (2.0 * xi - self.span[0] - self.span[1]) / (self.span[1] - self.span[0]);
        let n = self.area.len();
        DVector::from_column_slice(&bernstein(n, tau)[..n])
    }

    /// Adds the area `area` at the point where the basis is `b`.
    pub fn add(&mut self, b: &DVector<f64>, area: f64) {
        self.mass.ger(area, b, b, 1.0);
        self.area.axpy(area, b, 1.0);
    }

    /// int b dA over the part.
    pub fn total(&self) -> &DVector<f64> {
        &self.area
    }

    /// int B dA over the part.
    pub fn areas(&self) -> DVector<f64> {
        restricted(self.area.len(), self.span) * &self.area
    }

    /// Dual functions of the nodes that carry a multiplier.
    ///
    /// psi = A B, A = D M^-1 with M = int B B', D = int B: then int psi_j B_k = delta_jk D_j and sum psi = 1. Nodes
    /// that carry none give their B to the nearest ones that do (B := S B): the multipliers then still represent
    /// a constant pressure, and the row of a node may contain the displacement of its neighbours. `None` if no node
    /// carries one or the part is empty.
    pub fn dual(&self, carries: &[bool]) -> Option<Dual> {
        let n = self.area.len();
        let spread = spread(carries)?;
        let local = restricted(n, self.span);
        let full = carries.iter().all(|&c| c);
        let merged = &spread * &local;
        let area = &merged * &self.area;
        // M^-1 B in terms of b.
        let functions = if full {
            let scale = 2.0 / (self.span[1] - self.span[0]);
            let inverse = [-1.0, 1.0].map(|xi| scale * (xi - 0.5 * (self.span[0] + self.span[1])));
            // M^-1 B = T^-T m^-1 T^-1 T b.
            restricted(n, inverse).transpose() * self.mass.clone().cholesky()?.inverse()
        } else {
            let mass = &merged * &self.mass * merged.transpose();
            mass.cholesky()?.solve(&merged)
        };
        let functions = DMatrix::from_diagonal(&area) * functions;
        let nodes = (0..n).filter(|&i| carries[i]).collect();
        Some(Dual { nodes, functions, area })
    }
}

/// Dual functions on an edge.
#[derive(Debug, Clone)]
pub struct Dual {
    /// Which of the edge's nodes they belong to.
    pub nodes: Vec<usize>,
    /// psi_k = sum_l functions_kl b_l.
    pub functions: DMatrix<f64>,
    /// int psi_k dA.
    pub area: DVector<f64>,
}

/// Which share of each B (column) each multiplier (row) takes. Along an edge: first end, middle, second end.
fn spread(carries: &[bool]) -> Option<DMatrix<f64>> {
    let nodes: Vec<usize> = (0..carries.len()).filter(|&i| carries[i]).collect();
    if nodes.is_empty() {
        return None;
    }
    let place = |i: usize| [0i32, 2, 1][i];
    let mut spread = DMatrix::zeros(nodes.len(), carries.len());
    for j in 0..carries.len() {
        let distance = |&i: &usize| (place(i) - place(j)).abs();
        let nearest = nodes.iter().map(distance).min()?;
        let takers: Vec<usize> = (0..nodes.len()).filter(|&k| distance(&nodes[k]) == nearest).collect();
        for &k in &takers {
            spread[(k, j)] = 1.0 / takers.len() as f64;
        }
    }
    Some(spread)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::larger;

    #[test]
    fn short_parts_lose_no_digits() {
        for n in [2, 3] {
            for span in [[-1.0, 1.0], [0.2, 0.7], [0.3, 0.301]] {
                let mut part = Part::new(n, span);
                let (half, gauss) = (0.5 * (span[1] - span[0]), 0.6_f64.sqrt());
                for (at, w) in [(-gauss, 5.0 / 9.0), (0.0, 8.0 / 9.0), (gauss, 5.0 / 9.0)] {
                    let b = DVector::from_column_slice(&bernstein(n, at)[..n]);
                    part.add(&b, w * half);
                }
                let dual = part.dual(&vec![true; n]).unwrap();
                // int psi b' T' = D, and the sum of psi is one.
                let product = &dual.functions * &part.mass * restricted(n, span).transpose();
                for i in 0..n {
                    assert!(part.areas()[i] > 0.0);
                    let largest = (0..n).fold(0.0_f64, |m, k| larger(m, dual.functions[(i, k)].abs()));
                    for j in 0..n {
                        let expected = if i == j { dual.area[i] } else { 0.0 };
                        assert!((product[(i, j)] - expected).abs() < 1e-12 * half * largest, "{n} {span:?}");
                    }
                    assert!((dual.functions.column(i).sum() - 1.0).abs() < 1e-11, "{n} {span:?}");
                }
            }
        }
    }
}
