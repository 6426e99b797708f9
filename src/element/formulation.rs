//! How an element turns displacements into strains.
use super::ElementKind;

/// How an element turns displacements into strains. What is not named is the plain displacement element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Formulation {
    /// Displacement element, full integration.
    Standard,
    /// quad4 with enhanced assumed strains (Simo-Rifai / Taylor, 4 parameters): its default. tri6 with a bubble and a
    /// linear dilatation: its default near incompressibility.
    Enhanced,
    /// quad8 with 2 x 2 points: its default.
    Reduced,
}

impl Formulation {
    /// Name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            Formulation::Standard => "standard",
            Formulation::Enhanced => "enhanced",
            Formulation::Reduced => "reduced",
        }
    }

    /// The formulations of an element kind, the default first.
    pub fn of(kind: ElementKind) -> &'static [Formulation] {
        match kind {
            ElementKind::Tri3 => &[Formulation::Standard],
            ElementKind::Tri6 => &[Formulation::Standard, Formulation::Enhanced],
            ElementKind::Quad4 => &[Formulation::Enhanced, Formulation::Standard],
            ElementKind::Quad8 => &[Formulation::Reduced, Formulation::Standard],
        }
    }
}
