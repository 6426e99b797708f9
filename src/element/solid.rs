//! Stiffness, strains and internal forces of a solid element.
use super::quadrature::stiffness_rule;
use super::{ElementKind, QuadraturePoint};
use crate::Result;
use crate::case::Formulation;

/// What the material says at one quadrature point: sigma = H (eps - eps0), Voigt order (11, 22, 12) with
/// gamma12 = 2 eps12.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLaw {
    /// H, Pa.
    pub h: [[f64; 3]; 3],
    /// eps0.
    pub initial_strain: [f64; 3],
}

impl PointLaw {
    /// H (eps - eps0), Pa.
    pub fn stress(&self, strain: [f64; 3]) -> [f64; 3] {
        let elastic: [f64; 3] = std::array::from_fn(|i| strain[i] - self.initial_strain[i]);
        self.h.map(|row| row[0] * elastic[0] + row[1] * elastic[1] + row[2] * elastic[2])
    }
}

/// A kind with a formulation that fits it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SolidElement {
    kind: ElementKind,
    formulation: Formulation,
}

/// The formulation an element kind uses: the one asked for, or its default.
pub fn resolve(kind: ElementKind, asked: Option<Formulation>) -> std::result::Result<Formulation, String> {
    todo!()
}

impl SolidElement {
    /// The element of this kind; `None` takes the kind's default formulation ([`resolve`]).
    pub fn new(kind: ElementKind, formulation: Option<Formulation>) -> std::result::Result<Self, String> {
        Ok(SolidElement { kind, formulation: resolve(kind, formulation)? })
    }

    /// Kind.
    pub fn kind(&self) -> ElementKind {
        self.kind
    }

    /// Formulation.
    pub fn formulation(&self) -> Formulation {
        self.formulation
    }

    /// Quadrature points of stiffness, strains and stresses.
    pub fn points(&self) -> &'static [QuadraturePoint] {
        stiffness_rule(self.kind, self.formulation)
    }

    /// Stiffness `k` (2n x 2n, row-major, dof = 2 node + component, N/m) and the load of the initial strain
    /// `f` = int B^T H eps0 t dA (N); both are overwritten. Nodal forces are k u - f.
    ///
    /// `x`: node coordinates, m; `thickness`, m; `law(point, N)`: the law at a quadrature point, given its index and
    /// the shape functions there (to interpolate nodal values such as the temperature).
    pub fn stiffness(
        &self,
        x: &[[f64; 3]],
        thickness: f64,
        law: impl FnMut(usize, &[f64]) -> PointLaw,
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<()> {
        todo!()
    }

    /// Total in-plane strain (11, 22, gamma12) at each quadrature point for nodal displacements `u` (2n, m),
    /// the enhanced part included; `strains` is overwritten. `law` as in [`Self::stiffness`].
    pub fn strains(
        &self,
        x: &[[f64; 3]],
        u: &[f64],
        law: impl FnMut(usize, &[f64]) -> PointLaw,
        strains: &mut Vec<[f64; 3]>,
    ) -> Result<()> {
        todo!()
    }

    /// Internal forces `f` = int B^T sigma t dA (2n, N; overwritten) of in-plane stresses (11, 22, 12), Pa, at the
    /// quadrature points.
    pub fn internal_force(
        &self,
        x: &[[f64; 3]],
        thickness: f64,
        stress: &[[f64; 3]],
        f: &mut [f64],
    ) -> Result<()> {
        todo!()
    }
}
