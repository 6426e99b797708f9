//! What a point of a material that yields remembers and answers.
use crate::element::PointLaw;
use serde::{Deserialize, Serialize};

/// What a point remembers. Tensors are (xx, yy, zz, xy, yz, xz); shear strains are tensor components, not engineering ones.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PointState {
    /// Plastic strain, without volume.
    pub plastic_strain: [f64; 6],
    /// Equivalent plastic strain p: accumulated by the flow theory, by the deformation theory that of the plastic strain.
    pub equivalent: f64,
    /// Deviatoric, Pa.
    pub backstress: [f64; 6],
    /// Pa.
    pub stress: [f64; 6],
    /// Plastic work so far, J/m3.
    pub work: f64,
}

/// What a point answers to a strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointResponse {
    /// Stress in the plane, linearised at this strain.
    pub law: PointLaw,
    /// Total strain.
    pub strain: [f64; 6],
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
