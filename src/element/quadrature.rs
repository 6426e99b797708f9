//! Quadrature rules on the reference elements and facets.
//!
//! Lines and quadrilaterals: Gauss-Legendre. Triangles: the centroid rule; Hammer and Stroud's three points
//! (degree 2); Radon's seven points (degree 5, Monatsh. Math. 52 (1948) 286). Weights add up to the reference
//! area: 4 for a quadrilateral, 1/2 for a triangle, 2 for a line.
use super::Formulation;
use super::{ElementKind, FacetKind};

/// A point of a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraturePoint {
    /// Reference coordinates.
    pub xi: [f64; 3],
    /// Weight.
    pub weight: f64,
}

/// A point of a facet rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacetPoint {
    /// Position on [-1, 1].
    pub s: f64,
    /// Weight.
    pub weight: f64,
}

/// Most points a stiffness rule has.
pub const MAX_POINTS: usize = 9;

/// Rule for stiffness, strains and internal forces. Points of the quadrilaterals run along xi first.
///
/// tri3: 1 point; tri6: 3 points (degree 2), exact on straight-sided elements, enhanced 7 (degree 5, for the
/// bubble); quad4: 2 x 2; quad8: 3 x 3,
/// reduced 2 x 2. The pair must come from [`super::resolve`]; [`super::SolidElement`] guarantees that.
pub fn stiffness_rule(kind: ElementKind, formulation: Formulation) -> &'static [QuadraturePoint] {
    match (kind, formulation) {
        (ElementKind::Tri3, _) => &TRIANGLE_1,
        (ElementKind::Tri6, Formulation::Enhanced) => &TRIANGLE_7,
        (ElementKind::Tri6, _) => &TRIANGLE_3,
        (ElementKind::Quad4, _) | (ElementKind::Quad8, Formulation::Reduced) => &SQUARE_2,
        (ElementKind::Quad8, Formulation::Standard | Formulation::Enhanced) => &SQUARE_3,
    }
}

/// Finer rule for body loads and error norms: degree 5 on triangles, 4 x 4 points (degree 7 in each
/// direction) on quadrilaterals.
pub fn load_rule(kind: ElementKind) -> &'static [QuadraturePoint] {
    match kind {
        ElementKind::Tri3 | ElementKind::Tri6 => &TRIANGLE_7,
        ElementKind::Quad4 | ElementKind::Quad8 => &SQUARE_4,
    }
}

/// Rule for the energy of the difference between a recovered stress and that of the element: exact for the square of
/// what the two may hold on straight-sided elements.
pub fn error_rule(kind: ElementKind) -> &'static [QuadraturePoint] {
    match kind {
        ElementKind::Tri3 => &TRIANGLE_3,
        ElementKind::Quad4 => &SQUARE_2,
        ElementKind::Tri6 => &TRIANGLE_7,
        ElementKind::Quad8 => &SQUARE_3,
    }
}

/// Rule for loads and weights on a facet: 3 Gauss points on a line2 (degree 5), 4 on a line3 (degree 7).
pub fn facet_rule(kind: FacetKind) -> &'static [FacetPoint] {
    match kind {
        FacetKind::Line2 => &GAUSS_3,
        FacetKind::Line3 => &GAUSS_4,
    }
}

const fn at(s: f64, weight: f64) -> FacetPoint {
    FacetPoint { s, weight }
}

// 1/sqrt(3); sqrt(3/5); sqrt(3/7 -+ 2/7 sqrt(6/5)) with weights (18 +- sqrt(30))/36.
const G2: [FacetPoint; 2] = [at(-0.577_350_269_189_625_8, 1.), at(0.577_350_269_189_625_8, 1.)];
static GAUSS_3: [FacetPoint; 3] = G3;
const G3: [FacetPoint; 3] =
    [at(-0.774_596_669_241_483_4, 5. / 9.), at(0., 8. / 9.), at(0.774_596_669_241_483_4, 5. / 9.)];
static GAUSS_4: [FacetPoint; 4] = G4;
const G4: [FacetPoint; 4] = [
    at(-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    at(-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    at(0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    at(0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

static SQUARE_2: [QuadraturePoint; 4] = square(G2);
static SQUARE_3: [QuadraturePoint; 9] = square(G3);
static SQUARE_4: [QuadraturePoint; 16] = square(G4);

/// Tensor product of a line rule with itself; M = N^2.
const fn square<const N: usize, const M: usize>(line: [FacetPoint; N]) -> [QuadraturePoint; M] {
    let mut points = [QuadraturePoint { xi: [0.; 3], weight: 0. }; M];
    let mut i = 0;
    while i < M {
        let (p, q) = (line[i % N], line[i / N]);
        points[i] = QuadraturePoint { xi: [p.s, q.s, 0.], weight: p.weight * q.weight };
        i += 1;
    }
    points
}

const fn triangle(xi: f64, eta: f64, weight: f64) -> QuadraturePoint {
    QuadraturePoint { xi: [xi, eta, 0.], weight }
}

static TRIANGLE_1: [QuadraturePoint; 1] = [triangle(1. / 3., 1. / 3., 0.5)];

// Point a lies towards corner a.
static TRIANGLE_3: [QuadraturePoint; 3] = [
    triangle(1. / 6., 1. / 6., 1. / 6.),
    triangle(2. / 3., 1. / 6., 1. / 6.),
    triangle(1. / 6., 2. / 3., 1. / 6.),
];

// (6 -+ sqrt(15))/21 with weights (155 -+ sqrt(15))/2400.
const A: f64 = 0.101_286_507_323_456_33;
const B: f64 = 0.470_142_064_105_115_1;
const WEIGHT_A: f64 = 0.062_969_590_272_413_58;
const WEIGHT_B: f64 = 0.066_197_076_394_253_1;
static TRIANGLE_7: [QuadraturePoint; 7] = [
    triangle(1. / 3., 1. / 3., 9. / 80.),
    triangle(A, A, WEIGHT_A),
    triangle(1. - 2. * A, A, WEIGHT_A),
    triangle(A, 1. - 2. * A, WEIGHT_A),
    triangle(B, B, WEIGHT_B),
    triangle(1. - 2. * B, B, WEIGHT_B),
    triangle(B, 1. - 2. * B, WEIGHT_B),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: i32) -> f64 {
        (1..=n).map(f64::from).product()
    }

    /// Integral of xi^p eta^q over the reference element.
    fn exact(kind: ElementKind, p: i32, q: i32) -> f64 {
        let line = |p: i32| if p % 2 == 0 { 2. / f64::from(p + 1) } else { 0. };
        match kind {
            ElementKind::Tri3 | ElementKind::Tri6 => factorial(p) * factorial(q) / factorial(p + q + 2),
            ElementKind::Quad4 | ElementKind::Quad8 => line(p) * line(q),
        }
    }

    #[test]
    fn rules_are_exact_to_their_degree_and_no_further() {
        use ElementKind::*;
        use Formulation::*;
        let rules = [
            (Tri3, stiffness_rule(Tri3, Standard), 1),
            (Tri6, stiffness_rule(Tri6, Standard), 2),
            (Tri6, stiffness_rule(Tri6, Enhanced), 5),
            (Quad4, stiffness_rule(Quad4, Enhanced), 3),
            (Quad8, stiffness_rule(Quad8, Reduced), 3),
            (Quad8, stiffness_rule(Quad8, Standard), 5),
            (Tri6, load_rule(Tri6), 5),
            (Quad8, load_rule(Quad8), 7),
        ];
        for (kind, rule, degree) in rules {
            let error = |p: i32, q: i32| {
                let sum: f64 = rule.iter().map(|g| g.weight * g.xi[0].powi(p) * g.xi[1].powi(q)).sum();
                (sum - exact(kind, p, q)).abs()
            };
            for p in 0..=degree {
                for q in 0..=degree - p {
                    assert!(error(p, q) < 2e-15, "{kind:?} degree {degree}: xi^{p} eta^{q}");
                }
            }
            assert!(error(degree + 1, 0) > 1e-5, "{kind:?} degree {degree}");
        }
    }

    #[test]
    fn facet_rules_are_exact_to_their_degree() {
        for (kind, degree) in [(FacetKind::Line2, 5), (FacetKind::Line3, 7)] {
            for p in 0..=degree {
                let sum: f64 = facet_rule(kind).iter().map(|g| g.weight * g.s.powi(p)).sum();
                let exact = if p % 2 == 0 { 2. / f64::from(p + 1) } else { 0. };
                assert!((sum - exact).abs() < 4e-16, "{kind:?} s^{p}");
            }
        }
    }
}
