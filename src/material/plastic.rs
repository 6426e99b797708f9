//! Elasto-plasticity at a point, by von Mises' criterion, with thermal strain, in plane stress and plane strain.
//!
//! Everything is taken at the temperature of the end of the increment. The point keeps its plastic strain, so moduli may
//! change with temperature; it keeps its backstress, to which each increment adds with the modulus of its temperature.
//!
//! The deformation theory (Birger's variable elasticity parameters) relates the deviators of stress and of total strain
//! minus thermal strain by Gs = sigma_i / 3 e_i, e_i = (2/3 e:e)^(1/2), with sigma_i on the hardening curve at p = e_i -
//! sigma_i / 3 G, and K unchanged: one radial return from the virgin state with isotropic hardening alone.
use super::linear_elastic::Parameters;
use super::plane::{Yielded, plane_strain, plane_stress};
use super::return_mapping::ReturnMapping;
use super::state::{PointResponse, PointState, Tangent};
use super::tensor::{Tensor, add, dot, equivalent, scaled};
use super::{Analysis, LinearElastic, MaterialCase, Plasticity, Theory};
use crate::{element::PointLaw, vector::smaller};

/// The law of a material that yields.
#[derive(Debug, Clone)]
pub struct ElastoPlastic {
    /// Below yield.
    pub elastic: LinearElastic,
    plasticity: Plasticity,
    theory: Theory,
}

impl ElastoPlastic {
    /// `None` for a material that does not yield.
    pub fn new(material: &MaterialCase, analysis: Analysis, theory: Theory) -> Option<ElastoPlastic> {
        let plasticity = material.plasticity.clone()?;
        Some(ElastoPlastic { elastic: LinearElastic::new(material, analysis), plasticity, theory })
    }

    /// The answer to a total strain in the plane (11, 22, gamma12) at the end of an increment that begins in `old`; temperature in K.
    ///
    /// Without yielding it is the elastic law, with no plastic strain bit by bit [`LinearElastic::law`]; else the law
    /// is the tangent at this strain. With recall of the backstress the tangent is not symmetric, and its symmetric
    /// part is given. The flow theory has no secant: there [`Tangent::Secant`] is the consistent tangent. The
    /// deformation theory uses `old` only for the plastic work.
    pub fn respond(
        &self,
        strain: [f64; 3],
        old: &PointState,
        temperature: Option<f64>,
        tangent: Tangent,
    ) -> PointResponse {
        let parameters = self.elastic.at(temperature);
        let mapping = self.mapping(&parameters, temperature);
        let virgin = PointState::default();
        let start = if self.theory == Theory::Deformation { &virgin } else { old };
        let mut response = if self.elastic.is_plane_strain() {
            match plane_strain(&mapping, &parameters, strain, start) {
                Some(yielded) => self.yielding(strain, yielded, tangent),
                None => self.elastic_response(&parameters, strain, start),
            }
        } else {
            let elastic = self.elastic_response(&parameters, strain, start);
            let volume = (elastic.state.stress[0] + elastic.state.stress[1]) / (3. * mapping.bulk);
            match plane_stress(&mapping, &parameters, strain, start, volume) {
                Some(yielded) => self.yielding(strain, yielded, tangent),
                None => elastic,
            }
        };
        response.state.work = old.work + plastic_work(old, &response.state);
        response
    }

    /// The elastic law while no plastic strain is added to that of `old`.
    pub fn frozen(&self, old: &PointState, temperature: Option<f64>) -> PointLaw {
        self.frozen_law(&self.elastic.at(temperature), &old.plastic_strain)
    }

    /// Stress in the plane, Pa, that would hold the plastic strain of a state back, or as much of it as the yield stress can.
    pub fn held(&self, state: &PointState, temperature: Option<f64>) -> [f64; 3] {
        let stress = scaled(2. * self.elastic.at(temperature).shear(), &state.plastic_strain);
        let temperature = self.elastic.temperature(temperature);
        let share = self.plasticity.hardening.at(state.equivalent, temperature).0 / equivalent(&stress);
        [0, 1, 3].map(|i| smaller(share, 1.) * stress[i])
    }

    /// Equivalent stress of the deviator without the backstress over the current yield stress sigma_y(p, T): 1 on the
    /// yield surface. Infinite where a stress meets no elastic range.
    pub fn yield_ratio(&self, state: &PointState, temperature: Option<f64>) -> f64 {
        self.mapping(&self.elastic.at(temperature), temperature).yield_ratio(state)
    }

    fn mapping(&self, parameters: &Parameters, temperature: Option<f64>) -> ReturnMapping<'_> {
        let temperature = self.elastic.temperature(temperature);
        let kinematic = match (&self.plasticity.kinematic, self.theory) {
            (Some(kinematic), Theory::Flow) => (kinematic.modulus.at(temperature), kinematic.recall),
            (None, _) | (_, Theory::Deformation) => (0., 0.),
        };
        ReturnMapping {
            bulk: parameters.bulk(),
            shear: parameters.shear(),
            hardening: &self.plasticity.hardening,
            kinematic,
            temperature,
        }
    }

    /// sigma = C (eps - eps_th - eps_p): the plastic strain, without volume, adds -2 G eps_p in plane strain and
    /// -H eps_p in plane stress, where the strain across the plane is free.
    fn frozen_law(&self, parameters: &Parameters, plastic: &Tensor) -> PointLaw {
        let law = self.elastic.law_of(parameters);
        if plastic == &[0.; 6] {
            return law;
        }
        let initial_stress = if self.elastic.is_plane_strain() {
            [plastic[0], plastic[1], plastic[3]].map(|strain| -2. * parameters.shear() * strain)
        } else {
            let strain = [plastic[0], plastic[1], 2. * plastic[3]];
            law.h.map(|row| -(row[0] * strain[0] + row[1] * strain[1] + row[2] * strain[2]))
        };
        PointLaw { initial_stress, ..law }
    }

    fn elastic_response(
        &self,
        parameters: &Parameters,
        strain: [f64; 3],
        start: &PointState,
    ) -> PointResponse {
        let &Parameters { young, poisson, thermal_strain } = parameters;
        let law = self.frozen_law(parameters, &start.plastic_strain);
        let [xx, yy, xy] = law.stress(strain);
        let across = thermal_strain + start.plastic_strain[2];
        let (stress_zz, strain_zz) = if self.elastic.is_plane_strain() {
            (poisson * (xx + yy) - young * across, 0.)
        } else {
            (0., across - poisson / young * (xx + yy))
        };
        PointResponse {
            law,
            strain: [strain[0], strain[1], strain_zz, 0.5 * strain[2], 0., 0.],
            state: PointState { stress: [xx, yy, stress_zz, xy, 0., 0.], ..*start },
            yields: false,
        }
    }

    fn yielding(&self, strain: [f64; 3], yielded: Yielded, tangent: Tangent) -> PointResponse {
        let returned = &yielded.returned;
        let h = match (self.theory, tangent) {
            (Theory::Deformation, Tangent::Secant) => yielded.tangent(&returned.stiffness.secant()),
            (Theory::Flow, _) | (_, Tangent::Consistent) => yielded.tangent(&returned.stiffness),
        };
        let stress = yielded.stress;
        PointResponse {
            law: PointLaw { h, initial_strain: strain, initial_stress: [stress[0], stress[1], stress[3]] },
            strain: yielded.strain,
            state: PointState {
                plastic_strain: returned.plastic_strain,
                equivalent: returned.equivalent,
                backstress: returned.backstress,
                stress,
                work: 0.,
            },
            yields: true,
        }
    }
}

/// 1/2 (sigma_old + sigma_new) : (eps_p new - eps_p old), J/m3.
fn plastic_work(old: &PointState, new: &PointState) -> f64 {
    let increment = add(&new.plastic_strain, -1., &old.plastic_strain);
    0.5 * dot(&add(&old.stress, 1., &new.stress), &increment)
}
