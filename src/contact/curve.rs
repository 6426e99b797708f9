//! Surfaces as the curves that their facets stand for: normals, distances, sagittas.
use super::{
    Camber, Surface,
    vector::{combine, dot, norm, sub, unit},
};
use crate::tolerances::COORDINATES;
use crate::vector::larger;

/// How far beyond its ends, in xi, a curve is followed.
const BEYOND: f64 = 1.5;

impl Surface {
    /// Start, direction and outward normal of the chord of facet `f`, and its length, m.
    fn chord(&self, f: usize) -> ([f64; 3], [f64; 3], [f64; 3], f64) {
        let ends = &self.facets[f];
        let (a, b) = (self.points[ends[0] as usize], self.points[ends[1] as usize]);
        let along = sub(&b, &a);
        let t = unit(&along);
        (a, t, [t[1], -t[0], 0.0], norm(&along))
    }

    /// Outward unit normal of the curve of facet `f` at `xi`.
    pub(crate) fn curve_normal(&self, f: usize, xi: f64) -> [f64; 3] {
        let Some(camber) = &self.cambers[f] else { return unit(&self.area_vector(f, xi)) };
        let (_, t, m, _) = self.chord(f);
        unit(&combine([(1.0, &m), (-camber.height(xi).1, &t)]))
    }

    /// Signed distance from `x` along the unit vector `normal` to the curve of facet `f`, near `xi`; `None` if it has no
    /// curve but its own.
    pub(super) fn distance_to_curve(
        &self,
        f: usize,
        x: &[f64; 3],
        normal: &[f64; 3],
        xi: f64,
    ) -> Option<f64> {
        let camber = self.cambers[f].as_ref().filter(|c| c.half_angle != 0.0 || c.skew != 0.0)?;
        let (a, t, m, length) = self.chord(f);
        let from = sub(&a, x);
        let point = |xi: f64| {
            let (height, slope) = camber.height(xi);
            let s = 0.5 * (1.0 + xi) * length;
            (combine([(1.0, &from), (s, &t), (height * length, &m)]), slope)
        };
        let cross = |v: &[f64; 3]| normal[0] * v[1] - normal[1] * v[0];
        let (across_t, across_m) = (0.5 * length * cross(&t), 0.5 * length * cross(&m));
        let mut at = xi;
        // Newton for the point on the line: the curve is nearly straight.
        for _ in 0..20 {
            let (offset, slope) = point(at);
            let next = (at - cross(&offset) / (across_t + slope * across_m)).clamp(-BEYOND, BEYOND);
            let step = (next - at).abs();
            at = next;
            if step.is_nan() || step < 1e-15 {
                break;
            }
        }
        let distance = dot(&point(at).0, normal);
        distance.is_finite().then_some(distance)
    }

    /// Height of the curve of facet `f` over its chord, m, its largest: the sagitta.
    pub fn sagitta(&self, f: usize) -> f64 {
        let height =
            |c: &Camber| [-0.5, 0.0, 0.5].map(|xi| c.height(xi).0.abs()).into_iter().fold(0.0, larger);
        self.cambers[f].as_ref().map_or(0.0, |c| self.facet_size(f) * height(c))
    }

    /// How far, m, the surface may lie at each node from what the gaps are measured with, because a mesh from a file does
    /// not tell a coarse curve from a polygon: the sagitta of the arc that the facets' turn would make of them, the larger of
    /// the adjacent facets. Zero for generated meshes, and where the nodes show a curve, a corner or a straight line.
    pub fn sagitta_in_doubt(&self) -> Vec<f64> {
        let mut doubt = vec![0.0_f64; self.nodes.len()];
        for (facet, camber) in std::iter::zip(&self.facets, &self.cambers) {
            for &node in facet {
                let largest = &mut doubt[node as usize];
                *largest = larger(*largest, camber.map_or(0.0, |c| c.doubt));
            }
        }
        doubt
    }
}

/// What the curves of two facets, at `xi` and `eta`, add to the distance between the facets themselves, from `x` along
/// `normal`; `distance`: that of the mortar facet.
///
/// Facets whose ends coincide stand for one curve, whatever each one's neighbours say of it.
pub(super) fn clearance(
    [own, mortar]: [&Surface; 2],
    [f, g]: [usize; 2],
    [xi, eta]: [f64; 2],
    [x, normal]: [&[f64; 3]; 2],
    distance: f64,
) -> f64 {
    if own.cambers[f].is_none() && mortar.cambers[g].is_none() {
        return distance;
    }
    let deduced = |c: &Option<Camber>| c.is_some_and(|c| c.deduced);
    if (deduced(&own.cambers[f]) || deduced(&mortar.cambers[g])) && same_ends([own, mortar], [f, g]) {
        return distance;
    }
    let from = own.distance_to_curve(f, x, normal, xi).unwrap_or(0.0);
    mortar.distance_to_curve(g, x, normal, eta).unwrap_or(distance) - from
}

/// True if two facets that face each other have the same ends.
fn same_ends(surfaces: [&Surface; 2], facets: [usize; 2]) -> bool {
    let ends = |i: usize| {
        let (surface, facet): (&Surface, &Vec<u32>) = (surfaces[i], &surfaces[i].facets[facets[i]]);
        [facet[0], facet[1]].map(|n| surface.points[n as usize])
    };
    let ([a, b], [c, d]) = (ends(0), ends(1));
    let size = COORDINATES * surfaces[0].facet_size(facets[0]);
    norm(&sub(&a, &d)) <= size && norm(&sub(&b, &c)) <= size
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::testing::{circle, placed};

    /// From chord to curve along the radius, on every facet of a circle, is what the radius says.
    #[test]
    fn curves_of_a_circle_lie_on_it() {
        // Tangents of the circle through three nodes are exact, and so are arcs between them.
        for n in [10, 24, 96] {
            for bore in [false, true] {
                let surface = placed(&circle(n, 2.0, false, bore, 0.3), 0.7, [0.0; 2]);
                for f in 0..n {
                    for xi in [-1.0, -0.6, 0.1, 1.0] {
                        let x = surface.point(f, xi);
                        let outward = surface.curve_normal(f, xi);
                        let sign = if bore { -1.0 } else { 1.0 };
                        let radial = unit(&x).map(|c| sign * c);
                        let found = surface.distance_to_curve(f, &x, &radial, xi).unwrap();
                        assert!((found - sign * (2.0 - norm(&x))).abs() < 1e-14, "{n} {f} {xi}");
                        if xi.abs() == 1.0 {
                            assert!(dot(&outward, &radial) > 1.0 - 1e-12, "{n} {f} {xi}");
                        }
                    }
                }
                let sagitta = 2.0 * (1.0 - (std::f64::consts::PI / n as f64).cos());
                assert!((surface.sagitta(0) / sagitta - 1.0).abs() < 1e-12);
                assert!(surface.sagitta_in_doubt().iter().all(|d| *d == 0.0));
            }
        }
    }
}
