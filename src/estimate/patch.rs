//! Polynomials fitted to the stresses of the cells around a node.
use super::plane::Plane;
use crate::vector::larger;
use nalgebra::SMatrix;

/// Most terms: 1, x, y, x^2, xy, y^2.
pub const TERMS: usize = 6;

/// A fit whose smallest pivot is below this, relative to the largest term, is not determined by its samples.
const PIVOT: f64 = 1e-5;

/// A stress polynomial about a centre, coordinates in units of `size`.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    pub center: [f64; 3],
    pub size: f64,
    /// By component.
    pub coefficients: [[f64; TERMS]; 3],
}

/// Stresses at points, of one solution or several, to be fitted.
#[derive(Debug)]
pub struct Samples {
    points: Vec<[f64; 3]>,
    /// Point by point, those of all solutions together.
    stresses: Vec<Plane>,
    solutions: usize,
}

impl Samples {
    /// None yet, of so many solutions.
    pub fn new(solutions: usize) -> Samples {
        Samples { points: Vec::new(), stresses: Vec::new(), solutions }
    }

    pub fn clear(&mut self) {
        self.points.clear();
        self.stresses.clear();
    }

    pub fn push(&mut self, point: [f64; 3], stresses: impl IntoIterator<Item = Plane>) {
        self.points.push(point);
        self.stresses.extend(stresses);
    }

    /// Least squares fits about `center` with up to `terms` terms (6, 3 or 1), one for each solution, added to `fits`; fewer
    /// terms where the samples do not determine them.
    pub fn fit(&self, center: [f64; 3], terms: usize, fits: &mut Vec<Fit>) {
        let distance = |p: &[f64; 3]| (p[0] - center[0]).hypot(p[1] - center[1]);
        let size = self.points.iter().map(distance).fold(0.0, larger);
        let size = if size > 0.0 { size } else { 1.0 };
        let found =
            (terms == 6 && self.solve::<6>(center, size, fits)) || self.solve::<3>(center, size, fits);
        if !found {
            let count = self.points.len() as f64;
            fits.extend((0..self.solutions).map(|k| {
                let mean = |c: usize| self.of(k).map(|s| s[c]).sum::<f64>() / count;
                let coefficients = std::array::from_fn(|c| [mean(c), 0.0, 0.0, 0.0, 0.0, 0.0]);
                Fit { center, size, coefficients }
            }));
        }
    }

    /// The stresses of a solution.
    fn of(&self, solution: usize) -> impl Iterator<Item = &Plane> {
        self.stresses.iter().skip(solution).step_by(self.solutions)
    }

    /// Adds the fits with `N` terms to `fits`; `false`, and none, if the samples do not determine them.
    fn solve<const N: usize>(&self, center: [f64; 3], size: f64, fits: &mut Vec<Fit>) -> bool {
        if self.points.len() < N {
            return false;
        }
        let terms_at = |x: &[f64; 3]| -> [f64; N] {
            let all = basis(x, &center, size);
            std::array::from_fn(|i| all[i])
        };
        // Its lower half.
        let mut matrix = SMatrix::<f64, N, N>::zeros();
        for p in self.points.iter().map(terms_at) {
            for j in 0..N {
                (j..N).for_each(|i| matrix[(i, j)] += p[i] * p[j]);
            }
        }
        let Some(factor) = matrix.cholesky() else { return false };
        let pivots = factor.l_dirty().diagonal();
        // The pivots of the matrix are the squares.
        if pivots.min() < PIVOT.sqrt() * pivots.max() {
            return false;
        }
        for k in 0..self.solutions {
            let mut terms = SMatrix::<f64, N, 3>::zeros();
            for (p, s) in std::iter::zip(self.points.iter().map(terms_at), self.of(k)) {
                for c in 0..3 {
                    (0..N).for_each(|i| terms[(i, c)] += p[i] * s[c]);
                }
            }
            factor.solve_mut(&mut terms);
            let coefficients =
                std::array::from_fn(|c| std::array::from_fn(|i| if i < N { terms[(i, c)] } else { 0.0 }));
            fits.push(Fit { center, size, coefficients });
        }
        true
    }
}

impl Fit {
    /// Stress at a point, Pa.
    pub fn at(&self, x: &[f64; 3]) -> Plane {
        let p = basis(x, &self.center, self.size);
        self.coefficients.map(|terms| std::iter::zip(terms, p).map(|(a, b)| a * b).sum())
    }
}

fn basis(x: &[f64; 3], center: &[f64; 3], size: f64) -> [f64; TERMS] {
    let (x, y) = ((x[0] - center[0]) / size, (x[1] - center[1]) / size);
    [1.0, x, y, x * x, x * y, y * y]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(points: &[[f64; 3]], stress: impl Fn(&[f64; 3]) -> Plane) -> Samples {
        let mut samples = Samples::new(1);
        points.iter().for_each(|p| samples.push(*p, [stress(p)]));
        samples
    }

    fn fits(samples: &Samples, at: [f64; 3], terms: usize) -> Vec<Fit> {
        let mut fits = Vec::new();
        samples.fit(at, terms, &mut fits);
        fits
    }

    fn grid(nx: usize, ny: usize) -> Vec<[f64; 3]> {
        (0..nx * ny).map(|i| [1.0 + 0.1 * (i % nx) as f64, 2.0 + 0.1 * (i / nx) as f64, 0.0]).collect()
    }

    #[test]
    fn polynomials_are_reproduced() {
        let linear = |p: &[f64; 3]| [1.0 + p[0], p[1], 2.0 * p[0] - p[1]];
        let quadratic = |p: &[f64; 3]| [p[0] * p[0], p[0] * p[1], 1.0 - p[1] * p[1]];
        let at = [1.17, 2.03, 0.0];
        let near = |a: Plane, b: Plane| std::iter::zip(a, b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(
            fits(&samples(&grid(2, 2), linear), at, 3)[0].at(&[1.3, 2.2, 0.0]),
            linear(&[1.3, 2.2, 0.0])
        ));
        assert!(near(
            fits(&samples(&grid(4, 4), quadratic), at, 6)[0].at(&[1.3, 2.2, 0.0]),
            quadratic(&[1.3, 2.2, 0.0])
        ));
    }

    #[test]
    fn several_solutions_are_fitted_each_for_itself() {
        let of = |p: &[f64; 3]| [[p[0], 1.0, p[1]], [p[1] * p[1], p[0], 2.0]];
        let mut both = Samples::new(2);
        grid(4, 4).iter().for_each(|p| both.push(*p, of(p)));
        let at = [1.17, 2.03, 0.0];
        for (k, fit) in fits(&both, at, 6).iter().enumerate() {
            assert_eq!(fit.at(&at), fits(&samples(&grid(4, 4), |p| of(p)[k]), at, 6)[0].at(&at));
        }
    }

    #[test]
    fn samples_that_do_not_determine_a_term_do_without_it() {
        // Two rows say nothing of y^2, one row nothing of y, one point nothing but the value.
        let linear = |p: &[f64; 3]| [p[0], p[1], 0.0];
        let fit = fits(&samples(&grid(4, 2), linear), [1.0, 2.0, 0.0], 6)[0];
        assert!((fit.at(&[1.05, 2.5, 0.0])[1] - 2.5).abs() < 1e-12);
        let row = fits(&samples(&grid(4, 1), linear), [1.0, 2.0, 0.0], 6)[0];
        assert!((row.at(&[5.0, 7.0, 0.0])[0] - 1.15).abs() < 1e-12);
        assert_eq!(fits(&samples(&grid(1, 1), linear), [0.0; 3], 3)[0].at(&[9.0; 3]), [1.0, 2.0, 0.0]);
    }
}
