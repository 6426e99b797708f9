//! Where surfaces meet: contact surfaces, conjugate points, gaps.
//!
//! Knows surfaces, not bodies: both rank groups of a pair hold both surfaces and compute the same pairing.
mod gap;
pub mod mortar;
mod normals;
mod pairing;
mod rigid;
mod rows;
mod search;
mod surface;
#[cfg(test)]
mod testing;

pub use gap::{ConjugateRule, Gap};
pub use pairing::{Conjugate, Pairing};
pub use rows::{Row, pointwise};
pub use search::Projection;
pub use surface::Surface;

/// Small vectors.
pub(crate) mod vector {
    /// a - b
    pub fn sub(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    /// a . b
    pub fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// |a|
    pub fn norm(a: &[f64; 3]) -> f64 {
        dot(a, a).sqrt()
    }

    /// a / |a|; zero stays zero.
    pub fn unit(a: &[f64; 3]) -> [f64; 3] {
        let length = norm(a);
        if length > 0.0 { a.map(|c| c / length) } else { *a }
    }

    /// Sum of w_i v_i.
    pub fn combine<'a>(terms: impl IntoIterator<Item = (f64, &'a [f64; 3])>) -> [f64; 3] {
        terms.into_iter().fold([0.0; 3], |s, (w, v)| [s[0] + w * v[0], s[1] + w * v[1], s[2] + w * v[2]])
    }
}
