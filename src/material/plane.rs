//! The law in six components reduced to plane strain, eps_zz = 0, and plane stress, sigma_zz = 0.
use super::return_mapping::{ReturnMapping, Returned, Stiffness};
use super::root::{Sample, root};
use super::tensor::{Tensor, add, add_mean, scaled};
use super::{linear_elastic::Parameters, state::PointState};

/// The plane's components.
const PLANE: [usize; 3] = [0, 1, 3];

/// A point of the plane that yields.
pub(super) struct Yielded {
    pub returned: Returned,
    /// Total strain.
    pub strain: Tensor,
    /// Pa.
    pub stress: Tensor,
    /// Derivative of the stress in the plane (11, 22, 12), Pa, not yet symmetric.
    tangent: fn(&Stiffness) -> [[f64; 3]; 3],
}

impl Yielded {
    /// Its symmetric part, of the consistent stiffness or, at the same strain, of another.
    pub fn tangent(&self, stiffness: &Stiffness) -> [[f64; 3]; 3] {
        let h = (self.tangent)(stiffness);
        std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (h[i][j] + h[j][i])))
    }
}

/// Plane strain: nothing is unknown but the return. Total in-plane strain (11, 22, gamma12).
pub(super) fn plane_strain(
    law: &ReturnMapping,
    parameters: &Parameters,
    strain: [f64; 3],
    old: &PointState,
) -> Option<Yielded> {
    let heat = parameters.thermal_strain;
    let [xx, yy, zz] = [strain[0] - heat, strain[1] - heat, -heat];
    let volume = xx + yy + zz;
    let returned = law.respond(&deviator([xx, yy, zz, 0.5 * strain[2]], volume), old)?;
    Some(Yielded {
        strain: [strain[0], strain[1], 0., 0.5 * strain[2], 0., 0.],
        stress: add_mean(&returned.deviator, law.bulk * volume),
        returned,
        tangent: |c| PLANE.map(|i| PLANE.map(|j| c.entry(i, j))),
    })
}

/// Plane stress: the elastic change of volume is the unknown, from which both the pressure and the strain across the plane
/// follow without cancellation; `volume`: that of the elastic answer.
pub(super) fn plane_stress(
    law: &ReturnMapping,
    parameters: &Parameters,
    strain: [f64; 3],
    old: &PointState,
    volume: f64,
) -> Option<Yielded> {
    let heat = parameters.thermal_strain;
    let [xx, yy, xy] = [strain[0] - heat, strain[1] - heat, 0.5 * strain[2]];
    let deviator = |volume: f64| deviator([xx, yy, volume - xx - yy, xy], volume);
    let across = |s: &Tensor, slope: f64, volume: f64| {
        let size = s[0].abs().max(s[1].abs()).max(s[2].abs()).max(s[3].abs());
        Sample { value: s[2] + law.bulk * volume, slope, noise: f64::EPSILON * size }
    };
    // An elastic point takes no iteration.
    let mut first = Some(law.respond(&deviator(volume), old)?);
    let mut last = None;
    let volume = root(volume, (f64::NEG_INFINITY, f64::INFINITY), |volume| {
        let strain = deviator(volume);
        last = first.take().or_else(|| law.respond(&strain, old));
        match &last {
            Some(returned) => across(&returned.deviator, returned.stiffness.entry(2, 2), volume),
            None => {
                let elastic = scaled(2. * law.shear, &add(&strain, -1., &old.plastic_strain));
                across(&elastic, law.bulk + 4. / 3. * law.shear, volume)
            }
        }
    });
    // The root is where the law was asked last.
    let returned = last?;
    Some(Yielded {
        strain: [strain[0], strain[1], volume - xx - yy + heat, xy, 0., 0.],
        stress: add_mean(&returned.deviator, law.bulk * volume),
        returned,
        tangent: condensed,
    })
}

/// h_ab - h_a3 h_3b / h_33.
fn condensed(c: &Stiffness) -> [[f64; 3]; 3] {
    let pivot = 1. / c.entry(2, 2);
    PLANE.map(|i| PLANE.map(|j| c.entry(i, j) - c.entry(i, 2) * c.entry(2, j) * pivot))
}

/// Deviator of (xx, yy, zz, xy) with this trace.
fn deviator([xx, yy, zz, xy]: [f64; 4], trace: f64) -> Tensor {
    let mean = trace / 3.;
    [xx - mean, yy - mean, zz - mean, xy, 0., 0.]
}
