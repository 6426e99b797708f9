//! Symmetric tensors (xx, yy, zz, xy, yz, xz); shear strains are tensor components, not engineering ones.

/// Six components.
pub(super) type Tensor = [f64; 6];

/// a:b; the shear components count twice.
#[inline]
pub(super) fn dot(a: &Tensor, b: &Tensor) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2. * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
}

/// a + factor b.
#[inline]
pub(super) fn add(a: &Tensor, factor: f64, b: &Tensor) -> Tensor {
    std::array::from_fn(|i| a[i] + factor * b[i])
}

/// factor a.
#[inline]
pub(super) fn scaled(factor: f64, a: &Tensor) -> Tensor {
    a.map(|a| factor * a)
}

/// a - tr(a)/3 1.
#[inline]
pub(super) fn deviator(a: &Tensor) -> Tensor {
    add_mean(a, -(a[0] + a[1] + a[2]) / 3.)
}

/// a + mean 1.
#[inline]
pub(super) fn add_mean(a: &Tensor, mean: f64) -> Tensor {
    [a[0] + mean, a[1] + mean, a[2] + mean, a[3], a[4], a[5]]
}

/// Von Mises' equivalent (3/2 s:s)^(1/2) of a deviatoric stress.
#[inline]
pub(super) fn equivalent(s: &Tensor) -> f64 {
    (1.5 * dot(s, s)).sqrt()
}
