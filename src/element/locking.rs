//! Which formulation a material admits: near incompressibility some lock.
//!
//! In plane strain lambda/G = 2 nu/(1 - 2 nu) grows without limit as nu nears 1/2, and an element that cannot keep its
//! area while it deforms is too stiff by the part lambda/G times h^2 of it (Babuska and Suri, SIAM J. Numer. Anal. 29
//! (1992) 439). In plane stress the body contracts across the plane and nothing locks.
use super::{ElementKind, Formulation, solid::resolve};

/// Largest Poisson's ratio in plane strain for elements that lock.
///
/// Measured on a rubber cover 10 mm thick on a rigid core of 40 mm, 6 cells across, against quad8: a tri3 is too stiff
/// by 0.6 % (1 + lambda/G) in force; the estimate of the peak pressure is within a factor of 2 of its error up to
/// nu = 0.45 (lambda/G = 9: 7.3 % for 5.7 %), at 0.49 low by 6 (53 % for 8.9 %), at 0.4999 by 190. So up to here the
/// estimate tells of it, and beyond nobody would.
pub const LARGEST_POISSON: f64 = 0.45;

/// The formulation of an element kind for Poisson's ratio `poisson` in plane strain (0: plane stress): the one asked
/// for, or the default, which for the tri6 is the enhanced one beyond [`LARGEST_POISSON`]. One that locks is an error
/// whose text says what to take.
pub fn resolve_for(
    kind: ElementKind,
    asked: Option<Formulation>,
    poisson: f64,
) -> Result<Formulation, String> {
    let nearly_incompressible = poisson > LARGEST_POISSON;
    let formulation = match (kind, asked) {
        (ElementKind::Tri6, None) if nearly_incompressible => Formulation::Enhanced,
        _ => resolve(kind, asked)?,
    };
    if formulation != Formulation::Standard || !nearly_incompressible {
        return Ok(formulation);
    }
    let advice = match kind {
        ElementKind::Tri3 => "take tri6, quad4 or quad8",
        ElementKind::Tri6 => {
            "take its enhanced one, the default here (leave out 'formulation'), or quad4 or quad8"
        }
        ElementKind::Quad4 => "take its enhanced one, the default (leave out 'formulation')",
        ElementKind::Quad8 => "take its reduced one, the default (leave out 'formulation')",
    };
    let cause = match poisson >= 0.5 {
        true => "where they yield, for plastic strains keep their volume".to_string(),
        false => format!("at a Poisson's ratio of {poisson}, beyond {LARGEST_POISSON}"),
    };
    Err(format!(
        "{} elements in their standard formulation lock in plane strain {cause}: forces and pressures could be many times too \
         large; {advice}",
        kind.name()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use Formulation::{Enhanced, Reduced, Standard};

    #[test]
    fn what_locks_is_refused_and_nothing_else() {
        for kind in ElementKind::ALL {
            for poisson in [-0.9, 0., 0.3, LARGEST_POISSON] {
                assert_eq!(resolve_for(kind, None, poisson), resolve(kind, None));
                assert_eq!(resolve_for(kind, Some(Standard), poisson), Ok(Standard));
            }
            for poisson in [0.4501, 0.49, 0.4999, 0.499999] {
                let text = resolve_for(kind, Some(Standard), poisson).unwrap_err();
                assert!(text.contains(kind.name()) && text.contains(&poisson.to_string()), "{text}");
            }
        }
        let default = |kind| resolve_for(kind, None, 0.4999);
        assert!(default(ElementKind::Tri3).unwrap_err().contains("take tri6, quad4 or quad8"));
        assert_eq!(default(ElementKind::Tri6), Ok(Enhanced));
        assert_eq!(default(ElementKind::Quad4), Ok(Enhanced));
        assert_eq!(default(ElementKind::Quad8), Ok(Reduced));
    }
}
