//! The elements of a body.
use crate::{
    case::{BodyCase, LoadKind},
    element::{ElementKind, Formulation, SolidElement, resolve_for},
    error::Result,
    material::Analysis,
    mesh::Mesh,
    vector::larger,
};

/// The element of each kind, with the formulation the case asks for.
#[derive(Debug, Clone, Copy)]
pub struct Elements([Option<SolidElement>; ElementKind::ALL.len()]);

impl Elements {
    /// Resolves the formulation for every kind of cell in the mesh; one that would lock is refused.
    pub fn new(mesh: &Mesh, case: &BodyCase, analysis: Analysis) -> Result<Elements> {
        // Contraction across the plane makes up for any in-plane dilatation: plane stress does not lock.
        let poisson = match analysis {
            Analysis::PlaneStress { .. } => 0.0,
            // Plastic strains have no volume.
            Analysis::PlaneStrain { .. } if case.yields() => 0.5,
            Analysis::PlaneStrain { .. } => {
                case.materials().fold(f64::NEG_INFINITY, |most, m| larger(most, m.poisson.largest()))
            }
        };
        let mut elements = [None; ElementKind::ALL.len()];
        for cell in &mesh.cells {
            let slot = &mut elements[cell.kind as usize];
            if slot.is_none() {
                let element = resolve_for(cell.kind, case.formulation, poisson)
                    .and_then(|formulation| SolidElement::new(cell.kind, Some(formulation)));
                let element = element.map_err(|text| case.origin.error(text))?;
                refuse_body_force(element, case)?;
                *slot = Some(element);
            }
        }
        Ok(Elements(elements))
    }

    /// The element of a kind that occurs in the mesh.
    pub fn of(&self, kind: ElementKind) -> SolidElement {
        self.0[kind as usize].expect("the kinds of all cells are resolved")
    }
}

/// The bubble of an enhanced tri6 is eliminated before there are loads: it would have to carry its share of a body
/// force, and without it strains are wrong by h in place of h^2.
fn refuse_body_force(element: SolidElement, case: &BodyCase) -> Result<()> {
    let is_body_force = |load: &&crate::case::Load| matches!(load.kind, LoadKind::BodyForce(_));
    match case.loads.iter().find(is_body_force) {
        Some(load) if (element.kind(), element.formulation()) == (ElementKind::Tri6, Formulation::Enhanced) => {
            Err(load.origin.error(
                "tri6 elements in their enhanced formulation, the default in plane strain at a Poisson's ratio above \
                 0.45, take no 'body_force'; take quad4 or quad8",
            ))
        }
        _ => Ok(()),
    }
}
