//! Weights of the corrections, "iteration parameters" of the paper (30-36).
//!
//! The weight of a node m multiplies (u_s - u_m) in the displacement correction (21) and (R_s - R_m) in the force
//! correction (22); its conjugate point takes one minus it (31, 33), so after a correction both sides agree.
/// Weights of the corrections ("iteration parameters", eqs. 30-36 of the paper).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weights {
    /// One number for both steps (30, 31).
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

impl Weights {
    /// True if the weight does not follow the solution.
    pub fn is_constant(self) -> bool {
        matches!(self, Weights::Constant(_) | Weights::Stiffness)
    }
}

/// What the weights look at: one quantity on the own side (m) and on the conjugate side (s).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Both {
    /// At the node.
    pub own: f64,
    /// At its conjugate point.
    pub other: f64,
}

impl Both {
    /// As seen from the conjugate side.
    pub fn swapped(self) -> Both {
        Both { own: self.other, other: self.own }
    }

    /// |own| / (|own| + |other|); 1/2 where both are zero, so that an unloaded start is defined.
    pub fn ratio(self) -> f64 {
        let (own, other) = (self.own.abs(), self.other.abs());
        // Halved first: the sum of two huge numbers must not overflow.
        let sum = 0.5 * own + 0.5 * other;
        if sum > 0.0 { 0.5 * own / sum } else { 0.5 }
    }
}

/// Measures of the displacement at a node and its conjugate point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Displacements {
    /// Normal components u_n.
    pub normal: Both,
    /// Magnitudes |u|.
    pub magnitude: Both,
    /// Normal components of the response to the contact forces, v = u - u_free.
    pub response: Both,
    /// Norms of v_n over the active nodes of the two surfaces.
    pub surface_response: Both,
}

/// Measures of the contact force at a node and its conjugate point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Forces {
    /// Normal components R_n; without friction also the magnitudes.
    pub normal: Both,
    /// Norms over the active nodes of the two surfaces.
    pub surface: Both,
}

/// Weight of the displacement correction at a node. `moduli`: plane moduli E' of the two bodies, Pa; `first`: the node
/// is on side A, to which a constant weight refers.
pub fn displacement(weights: Weights, u: &Displacements, moduli: Both, first: bool) -> f64 {
    match weights {
        Weights::Constant(a) => side(a, first),
        Weights::Magnitude => u.magnitude.ratio(),
        Weights::Component => u.normal.ratio(),
        Weights::Response => u.response.ratio(),
        Weights::ResponseSurface => u.surface_response.ratio(),
        // The softer body gives way: E'_s / (E'_m + E'_s).
        Weights::Stiffness => 1.0 - moduli.ratio(),
    }
}

/// Weight of the force correction at a node.
pub fn force(weights: Weights, r: &Forces, moduli: Both, first: bool) -> f64 {
    match weights {
        Weights::Constant(a) => side(a, first),
        Weights::Magnitude | Weights::Component | Weights::Response => r.normal.ratio(),
        Weights::ResponseSurface => r.surface.ratio(),
        Weights::Stiffness => moduli.ratio(),
    }
}

fn side(a: f64, first: bool) -> f64 {
    if first { a } else { 1.0 - a }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_over_zero_is_one_half() {
        assert_eq!(Both { own: 0.0, other: 0.0 }.ratio(), 0.5);
        assert_eq!(Both { own: 1e-310, other: 1e-310 }.ratio(), 0.5);
        assert_eq!(Both { own: f64::MAX, other: f64::MAX }.ratio(), 0.5);
        assert_eq!(Both { own: 1e-300, other: 0.0 }.ratio(), 1.0);
    }

    #[test]
    fn the_two_sides_add_up_to_one() {
        let both = Both { own: 3.0, other: -1.0 };
        let swapped = Both { own: -1.0, other: 3.0 };
        for weights in [
            Weights::Constant(0.3),
            Weights::Magnitude,
            Weights::Component,
            Weights::Response,
            Weights::ResponseSurface,
            Weights::Stiffness,
        ] {
            let u = |b| Displacements { normal: b, magnitude: b, response: b, surface_response: b };
            let r = |b| Forces { normal: b, surface: b };
            let moduli = Both { own: 2e11, other: 7e10 };
            let turned = Both { own: 7e10, other: 2e11 };
            let sum = displacement(weights, &u(both), moduli, true)
                + displacement(weights, &u(swapped), turned, false);
            assert!((sum - 1.0).abs() < 1e-15, "{weights:?}");
            let sum = force(weights, &r(both), moduli, true) + force(weights, &r(swapped), turned, false);
            assert!((sum - 1.0).abs() < 1e-15, "{weights:?}");
        }
    }
}
