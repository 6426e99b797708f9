//! Small vectors, and maxima that keep what is not a number: a number that is lost in a maximum is a wrong answer that
//! passes every test made with it.

use crate::tolerances::UNSEEN;
use nalgebra::{DMatrix, Dyn, SymmetricEigen};

/// The larger of two; not a number if either is not one.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The smaller of two; not a number if either is not one.
pub fn smaller(a: f64, b: f64) -> f64 {
    if a.is_nan() || a < b { a } else { b }
}

/// The largest value, at least zero; not a number if one of them is not.
pub fn worst(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, larger)
}

/// The largest absolute value; not a number if one of them is not.
pub fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    worst(values.into_iter().map(|v| v.abs()))
}

/// The smallest value, infinite if there is none; not a number if one of them is not.
pub fn least(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::INFINITY, smaller)
}

/// A number of a message, of any size, in four figures: `12.5`, `-0.002`, `2.5e80`.
pub fn in_figures(value: f64) -> String {
    let size = value.abs();
    let (figures, power) = match (1e-3..1e5).contains(&size) {
        true => {
            (format!("{value:.*}", (3 - size.log10().floor() as i32).clamp(0, 6) as usize), String::new())
        }
        false => {
            let text = format!("{value:.3e}");
            let (figures, power) = text.split_once('e').unwrap_or((&text, "0"));
            let power = if power == "0" { String::new() } else { format!("e{power}") };
            (figures.into(), power)
        }
    };
    let short =
        if figures.contains('.') { figures.trim_end_matches('0').trim_end_matches('.') } else { &figures };
    format!("{short}{power}")
}

/// value / scale: zero where there is no scale, not a number where the scale is not finite.
pub fn ratio(value: f64, scale: f64) -> f64 {
    if scale == 0.0 {
        0.0
    } else if scale.is_finite() {
        value / scale
    } else {
        f64::NAN
    }
}

/// True if every value is a finite number.
pub fn all_finite<'a>(values: impl IntoIterator<Item = &'a f64>) -> bool {
    values.into_iter().all(|v| v.is_finite())
}

/// Eigenvalues and vectors; `None` of a matrix with entries that are not finite, on which the iteration would not end.
pub(crate) fn symmetric_eigen(matrix: DMatrix<f64>) -> Option<SymmetricEigen<f64, Dyn>> {
    all_finite(matrix.iter()).then(|| SymmetricEigen::new(matrix))
}

/// Inverse on the eigenvectors whose eigenvalue is not [`UNSEEN`], zero on the others.
pub(crate) fn pseudo_inverse(a: DMatrix<f64>) -> DMatrix<f64> {
    if a.is_empty() {
        return a;
    }
    let n = a.nrows();
    let Some(mut eigen) = symmetric_eigen(a) else { return DMatrix::zeros(n, n) };
    let largest = eigen.eigenvalues.max();
    eigen.eigenvalues.apply(|v| *v = if *v > UNSEEN * largest { 1.0 / *v } else { 0.0 });
    eigen.recompose()
}

/// a - b
pub(crate) fn sub(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a . b
pub(crate) fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// |a|
pub(crate) fn norm(a: &[f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// a / |a|; zero stays zero.
pub(crate) fn unit(a: &[f64; 3]) -> [f64; 3] {
    let length = norm(a);
    if length > 0.0 { a.map(|c| c / length) } else { *a }
}

/// Sum of w_i v_i.
pub(crate) fn combine<'a>(terms: impl IntoIterator<Item = (f64, &'a [f64; 3])>) -> [f64; 3] {
    terms.into_iter().fold([0.0; 3], |s, (w, v)| [s[0] + w * v[0], s[1] + w * v[1], s[2] + w * v[2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_is_kept_wherever_it_stands() {
        // Both signs: inf - inf has the other one.
        for nan in [f64::NAN, -f64::NAN] {
            for values in [[nan, 1.0, -2.0], [1.0, nan, -2.0], [1.0, -2.0, nan]] {
                assert!(worst(values).is_nan() && largest(&values).is_nan() && least(values).is_nan());
                assert!(!all_finite(&values));
            }
        }
        assert!(!all_finite(&[f64::INFINITY]));
        assert_eq!(worst([1.0, f64::INFINITY, 2.0]), f64::INFINITY);
        assert_eq!((worst([-1.0, -2.0]), largest(&[-3.0, 1.0]), least([4.0, -1.0])), (0.0, 3.0, -1.0));
        assert_eq!((worst([]), least([])), (0.0, f64::INFINITY));
    }

    #[test]
    fn figures_of_any_size() {
        let shown = [0.0, 0.02, -1.5, 123.456, 54321.0, 1e-7, 2.5e80].map(in_figures);
        assert_eq!(shown, ["0", "0.02", "-1.5", "123.5", "54321", "1e-7", "2.5e80"]);
    }
}
