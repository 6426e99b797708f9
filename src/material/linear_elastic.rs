//! Isotropic linear elasticity with thermal strain, in plane stress and plane strain.
//!
//! Source: Stankevich, Yakovlev, Si Tu Htet (2012), eqs. (5), (5a), (5b). With dT = T - Tref and the mean
//! coefficient alpha(T): plane stress H = E/(1 - nu^2) [1 nu 0; nu 1 0; 0 0 (1 - nu)/2], eps0 = alpha dT (1,
//! 1, 0); plane strain the same with E/(1 - nu^2), nu/(1 - nu) and (1 + nu) alpha in the place of E, nu and
//! alpha.
use super::{Analysis, MaterialCase, Property};
use crate::element::PointLaw;

/// Young's modulus, Poisson's ratio and mean expansion coefficient, each perhaps a function of temperature.
#[derive(Debug, Clone)]
pub struct LinearElastic {
    young: Property,
    poisson: Property,
    expansion: Option<Property>,
    reference_temperature: f64,
    plane_strain: bool,
}

/// The parameters at one temperature.
pub(super) struct Parameters {
    /// E, Pa.
    pub young: f64,
    /// nu.
    pub poisson: f64,
    /// alpha (T - Tref).
    pub thermal_strain: f64,
}

impl Parameters {
    /// G = E / 2 (1 + nu), Pa.
    pub fn shear(&self) -> f64 {
        0.5 * self.young / (1. + self.poisson)
    }

    /// K = E / 3 (1 - 2 nu), Pa.
    pub fn bulk(&self) -> f64 {
        self.young / (3. * (1. - 2. * self.poisson))
    }
}

impl LinearElastic {
    /// From the case, whose reader has checked the ranges (E > 0, -1 < nu < 1/2).
    pub fn new(material: &MaterialCase, analysis: Analysis) -> Self {
        LinearElastic {
            young: material.young.clone(),
            poisson: material.poisson.clone(),
            expansion: material.expansion.clone(),
            reference_temperature: material.reference_temperature,
            plane_strain: matches!(analysis, Analysis::PlaneStrain { .. }),
        }
    }

    /// The law at a temperature, K; `None`: no heat, the parameters are those at the reference temperature.
    pub fn law(&self, temperature: Option<f64>) -> PointLaw {
        self.law_of(&self.at(temperature))
    }

    /// The law with these parameters.
    pub(super) fn law_of(&self, parameters: &Parameters) -> PointLaw {
        let &Parameters { young, poisson, thermal_strain } = parameters;
        let (e, nu, strain) = if self.plane_strain {
            (young / (1. - poisson * poisson), poisson / (1. - poisson), (1. + poisson) * thermal_strain)
        } else {
            (young, poisson, thermal_strain)
        };
        let c = e / (1. - nu * nu);
        let shear = 0.5 * young / (1. + poisson);
        PointLaw {
            h: [[c, c * nu, 0.], [c * nu, c, 0.], [0., 0., shear]],
            initial_strain: [strain, strain, 0.],
            initial_stress: [0.; 3],
        }
    }

    /// Stress (xx, yy, zz, xy, yz, xz), Pa, from the total in-plane strain (11, 22, gamma12).
    ///
    /// sigma_zz is 0 in plane stress and nu (sigma_xx + sigma_yy) - E alpha dT in plane strain.
    pub fn stress(&self, strain: [f64; 3], temperature: Option<f64>) -> [f64; 6] {
        let [xx, yy, xy] = self.law(temperature).stress(strain);
        let p = self.at(temperature);
        let zz = if self.plane_strain { p.poisson * (xx + yy) - p.young * p.thermal_strain } else { 0. };
        [xx, yy, zz, xy, 0., 0.]
    }

    /// Total strain (xx, yy, zz, xy, yz, xz) from the total in-plane strain (11, 22, gamma12). The shear is
    /// the tensor component eps_xy = gamma12 / 2, not the engineering one.
    ///
    /// eps_zz is 0 in plane strain and -nu/E (sigma_xx + sigma_yy) + alpha dT in plane stress.
    pub fn strain(&self, strain: [f64; 3], temperature: Option<f64>) -> [f64; 6] {
        let zz = if self.plane_strain {
            0.
        } else {
            let [xx, yy, _] = self.law(temperature).stress(strain);
            let p = self.at(temperature);
            p.thermal_strain - p.poisson / p.young * (xx + yy)
        };
        [strain[0], strain[1], zz, 0.5 * strain[2], 0., 0.]
    }

    /// Elastic energy of a stress (xx, yy, zz, xy, yz, xz), J/m3: half of stress times elastic strain,
    /// ((1 + nu) s:s - nu (tr s)^2) / 2E.
    pub fn energy(&self, stress: [f64; 6], temperature: Option<f64>) -> f64 {
        let p = self.at(temperature);
        let [xx, yy, zz, xy, yz, xz] = stress;
        let squares = xx * xx + yy * yy + zz * zz + 2. * (xy * xy + yz * yz + xz * xz);
        0.5 / p.young * ((1. + p.poisson) * squares - p.poisson * (xx + yy + zz).powi(2))
    }

    /// True if Young's modulus or Poisson's ratio vary with temperature: the stiffness then does, too.
    pub fn stiffness_varies(&self) -> bool {
        self.young.is_table() || self.poisson.is_table()
    }

    /// True if the thermal strain is proportional to T - Tref.
    pub fn expands_linearly(&self) -> bool {
        !self.stiffness_varies() && !self.expansion.as_ref().is_some_and(Property::is_table)
    }

    /// Tref + factor (T - Tref), K.
    pub fn scaled_temperature(&self, t: f64, factor: f64) -> f64 {
        // Factor 1 is the temperature as given, to the last bit.
        if factor == 1.0 { t } else { self.reference_temperature + factor * (t - self.reference_temperature) }
    }

    /// Modulus of the plane problem at the reference temperature, Pa: E in plane stress, E/(1 - nu^2) in
    /// plane strain.
    pub fn plane_modulus(&self) -> f64 {
        let p = self.at(None);
        if self.plane_strain { p.young / (1. - p.poisson * p.poisson) } else { p.young }
    }

    /// T, or Tref without heat, K.
    pub(super) fn temperature(&self, temperature: Option<f64>) -> f64 {
        temperature.unwrap_or(self.reference_temperature)
    }

    /// True in plane strain.
    pub(super) fn is_plane_strain(&self) -> bool {
        self.plane_strain
    }

    pub(super) fn at(&self, temperature: Option<f64>) -> Parameters {
        let t = self.temperature(temperature);
        let expansion = self.expansion.as_ref().map_or(0., |alpha| alpha.at(t));
        Parameters {
            young: self.young.at(t),
            poisson: self.poisson.at(t),
            thermal_strain: expansion * (t - self.reference_temperature),
        }
    }
}

/// Von Mises stress of (xx, yy, zz, xy, yz, xz), in the unit of the stress.
pub fn von_mises(s: [f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = s;
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 3. * (xy * xy + yz * yz + xz * xz)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE_STRESS: Analysis = Analysis::PlaneStress { thickness: 1. };
    const PLANE_STRAIN: Analysis = Analysis::PlaneStrain { thickness: 1. };
    const E: f64 = 2.1e11;
    const NU: f64 = 0.3;
    const STRAIN: [f64; 3] = [1.1e-3, -0.4e-3, 0.9e-3];

    fn case() -> MaterialCase {
        MaterialCase {
            name: "steel".into(),
            young: Property::Table(vec![(293., E), (493., 0.8 * E)]),
            poisson: Property::Constant(NU),
            expansion: Some(Property::Table(vec![(293., 1e-5), (493., 1.4e-5)])),
            reference_temperature: 293.,
            plasticity: None,
        }
    }

    /// Hooke's law in three dimensions, eps_i = (s_i - nu (s_j + s_k))/E + alpha dT, on what the plane law
    /// returns.
    #[test]
    fn all_components_obey_hookes_law_in_three_dimensions() {
        for analysis in [PLANE_STRESS, PLANE_STRAIN] {
            let law = LinearElastic::new(&case(), analysis);
            // At 393 K: 0.9 E and alpha 1.2e-5.
            for (temperature, young, thermal) in [(None, E, 0.), (Some(393.), 0.9 * E, 1.2e-3)] {
                let s = law.stress(STRAIN, temperature);
                let e = law.strain(STRAIN, temperature);
                for i in 0..3 {
                    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                    let expected = (s[i] - NU * (s[j] + s[k])) / young + thermal;
                    assert!((e[i] - expected).abs() < 1e-17, "{analysis:?} {temperature:?} component {i}");
                }
                assert!((2. * e[3] - STRAIN[2]).abs() < 1e-18);
                assert!((s[3] - young / (1. + NU) * e[3]).abs() < 1e-6);
                match analysis {
                    Analysis::PlaneStress { .. } => assert_eq!(s[2], 0.),
                    Analysis::PlaneStrain { .. } => assert_eq!(e[2], 0.),
                }
                assert_eq!((s[4], s[5], e[4], e[5]), (0., 0., 0., 0.));
                let thermal = [thermal, thermal, thermal, 0., 0., 0.];
                let elastic = (0..6).map(|c| if c < 3 { 0.5 } else { 1. } * s[c] * (e[c] - thermal[c]));
                let energy: f64 = elastic.sum();
                assert!((law.energy(s, temperature) - energy).abs() < 1e-12 * energy);
            }
        }
    }

    #[test]
    fn a_heated_held_body_carries_minus_e_alpha_dt() {
        // Plane strain, free in the plane: sigma_zz = -E alpha dT, in-plane strain (1 + nu) alpha dT.
        let law = LinearElastic::new(&case(), PLANE_STRAIN);
        let s = law.stress([1.3 * 1.2e-3, 1.3 * 1.2e-3, 0.], Some(393.));
        assert!(s[0].abs() < 1. && (s[2] + 0.9 * E * 1.2e-3).abs() < 1.);
        // Without an expansion coefficient, heat only changes the other parameters.
        let cold = LinearElastic::new(&MaterialCase { expansion: None, ..case() }, PLANE_STRAIN);
        assert_eq!(cold.law(Some(393.)).initial_strain, [0.; 3]);
    }

    #[test]
    fn plane_modulus_and_von_mises() {
        assert_eq!(LinearElastic::new(&case(), PLANE_STRESS).plane_modulus(), E);
        assert_eq!(LinearElastic::new(&case(), PLANE_STRAIN).plane_modulus(), E / (1. - NU * NU));
        assert_eq!(von_mises([5., 0., 0., 0., 0., 0.]), 5.);
        assert_eq!(von_mises([7., 7., 7., 0., 0., 0.]), 0.);
        assert!((von_mises([0., 0., 0., 1., 2., 2.]) - 27_f64.sqrt()).abs() < 1e-15);
    }
}
