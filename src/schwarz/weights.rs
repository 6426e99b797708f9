//! Weights of the corrections, "iteration parameters" of the paper (30-36).
//!
//! The weight of a node m multiplies (u_s - u_m) in the displacement correction (21) and (R_s - R_m) in the force
//! correction (22); its conjugate point s takes one minus it (31, 33), so after a correction both sides agree.
/// Weights of the corrections ("iteration parameters", eqs. 30-36 of the paper).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weights {
    /// One number for both steps (30, 31): the weight of side A.
    Constant(f64),
    /// Ratio of magnitudes (32, 35).
    Magnitude,
    /// Ratio per component (34, 36).
    Component,
    /// Response per node: |v_m| / (|v_m| + |v_s|), v = u - u_free. The default.
    Response,
    /// Response with norms over the active nodes of the surface.
    ResponseSurface,
    /// E'_B / (E'_A + E'_B), constant.
    Stiffness,
}

/// What is corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Correction {
    /// The displacements (21).
    Displacement,
    /// The forces (22).
    Force,
}

/// A pair as its multiplier side sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sides {
    /// Side in the case of the multipliers: 0 is A.
    pub multiplier: usize,
    /// E' of the mortar side over that of the multiplier side.
    pub compliance_ratio: f64,
    /// Whether supports hold the multiplier side and the mortar side, or these are rigid.
    pub held: [bool; 2],
}

impl Weights {
    /// True if the weight does not follow the solution.
    pub fn is_constant(self) -> bool {
        matches!(self, Weights::Constant(_) | Weights::Stiffness)
    }

    /// Weight of the multiplier side, m, at a row; `measured`: what the weights look at, there and on the mortar side. A side
    /// that cannot give way leaves the other one all of the displacement, and its own force.
    pub fn at(self, correction: Correction, measured: [f64; 2], sides: &Sides) -> f64 {
        let of_displacement = |displacement: f64| match correction {
            Correction::Displacement => displacement,
            Correction::Force => 1.0 - displacement,
        };
        match (sides.held, self) {
            ([_, true], _) => of_displacement(1.0),
            ([true, false], _) => of_displacement(0.0),
            // The softer body gives way.
            (_, Weights::Stiffness) => of_displacement(ratio([sides.compliance_ratio, 1.0])),
            (_, Weights::Constant(a)) if sides.multiplier == 0 => a,
            (_, Weights::Constant(a)) => 1.0 - a,
            _ => ratio(measured),
        }
    }
}

/// |a| / (|a| + |b|); 1/2 where both are zero, so that an unloaded start is defined.
fn ratio([a, b]: [f64; 2]) -> f64 {
    let (a, b) = (a.abs(), b.abs());
    // Halved first: the sum of two huge numbers must not overflow.
    let sum = 0.5 * a + 0.5 * b;
    if sum > 0.0 { 0.5 * a / sum } else { 0.5 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_over_zero_is_one_half() {
        assert_eq!(ratio([0.0, 0.0]), 0.5);
        assert_eq!(ratio([1e-310, 1e-310]), 0.5);
        assert_eq!(ratio([f64::MAX, f64::MAX]), 0.5);
        assert_eq!(ratio([1e-300, 0.0]), 1.0);
    }

    #[test]
    fn the_two_sides_add_up_to_one() {
        let [a, b] = [
            Sides { multiplier: 0, compliance_ratio: 3.0, held: [false; 2] },
            Sides { multiplier: 1, compliance_ratio: 1.0 / 3.0, held: [false; 2] },
        ];
        for weights in [
            Weights::Constant(0.3),
            Weights::Magnitude,
            Weights::Component,
            Weights::Response,
            Weights::ResponseSurface,
            Weights::Stiffness,
        ] {
            for correction in [Correction::Displacement, Correction::Force] {
                let sum = weights.at(correction, [3.0, -1.0], &a) + weights.at(correction, [-1.0, 3.0], &b);
                assert!((sum - 1.0).abs() < 1e-15, "{weights:?}");
            }
            let [rigid, held] = [[false, true], [true, false]].map(|held| Sides { held, ..a });
            assert_eq!(weights.at(Correction::Displacement, [3.0, 1.0], &rigid), 1.0);
            assert_eq!(weights.at(Correction::Force, [3.0, 1.0], &rigid), 0.0);
            assert_eq!(weights.at(Correction::Displacement, [3.0, 1.0], &held), 0.0);
            assert_eq!(weights.at(Correction::Force, [3.0, 1.0], &held), 1.0);
        }
    }
}
