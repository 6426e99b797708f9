//! The smooth curve that a facet stands for: what its nodes were placed on.
//!
//! Straight facets leave a curve by the sagitta, which a clearance or an interference need not be large against. Distances
//! between surfaces are therefore those between the curves: the arcs that generated meshes were made of, and for meshes
//! from files the curve through the nodes.
use super::{
    Surface,
    vector::{combine, dot, norm, sub, unit},
};
use crate::{
    mesh::{Curve, Mesh, Side, Smooth},
    vector::larger,
};

/// A curve over the chord of a facet: an arc of a circle and a cubic that leans it.
///
/// With L the chord, a the half angle, d the skew and -1 <= xi <= 1 along the chord, the height is
/// L sin a (1 - xi^2) / (2 (cos phi + cos a)) - L tan d xi (1 - xi^2) / 4, sin phi = xi sin a.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Camber {
    /// Half of the angle that the arc spans, rad; positive if it bulges outwards.
    pub half_angle: f64,
    /// Angle by which the cubic lifts the tangent at the start and lowers it at the end, rad.
    pub skew: f64,
    /// How far the true curve may lie from this one because the nodes do not tell, m.
    pub doubt: f64,
    /// True if it was found from the nodes.
    pub deduced: bool,
}

/// Ends of facets that are this near to each other, relative to the facet, are the same point.
const SAME_POINT: f64 = 1e-9;

/// How far beyond its ends, in xi, a curve is followed.
const BEYOND: f64 = 1.5;

impl Camber {
    /// From the angles of the tangents at start and end against the chord, rad, anticlockwise: inwards.
    fn of_tangents([start, end]: [f64; 2]) -> Camber {
        Camber { half_angle: 0.5 * (end - start), skew: -0.5 * (start + end), ..Self::default() }
    }

    /// Of the curves that side `ends` of a mesh stands for; `None`: its own.
    pub(super) fn of_mesh(mesh: &Mesh, ends: [u32; 2]) -> Option<Camber> {
        let key = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let doubt = mesh.unclear.get(&key).copied();
        let curve = mesh.curves.get(&key);
        let [a, b] = ends.map(|n| mesh.points[n as usize]);
        let angle = |from: [f64; 2], to: [f64; 2]| (to[1] - from[1]).atan2(to[0] - from[0]);
        let ([p, q], chord) = ([[a[0], a[1]], [b[0], b[1]]], angle([a[0], a[1]], [b[0], b[1]]));
        let turned = |direction: f64| {
            let turns = (direction - chord) / std::f64::consts::TAU;
            std::f64::consts::TAU * (turns - turns.round())
        };
        let camber = match curve {
            None => Camber::default(),
            Some(Curve::Arc { center }) => {
                let radius = 0.5
                    * ((p[0] - center[0]).hypot(p[1] - center[1])
                        + (q[0] - center[0]).hypot(q[1] - center[1]));
                let half = (0.5 * (q[0] - p[0]).hypot(q[1] - p[1]) / radius).min(1.0).asin();
                // Outwards if the centre is on the body's side, the left.
                let left = (q[0] - p[0]) * (center[1] - p[1]) - (q[1] - p[1]) * (center[0] - p[0]);
                return Some(Camber { half_angle: half.copysign(left), ..Camber::default() });
            }
            Some(Curve::Cubic { control: [first, second] }) => {
                let [first, second] = if ends[0] < ends[1] { [first, second] } else { [second, first] };
                Camber::of_tangents([turned(angle(p, *first)), turned(angle(*second, q))])
            }
        };
        (curve.is_some() || doubt.is_some()).then(|| Camber {
            doubt: doubt.unwrap_or(0.0),
            deduced: true,
            ..camber
        })
    }

    /// Of the straight facets of a surface, from its own nodes.
    pub(super) fn of_nodes(points: &[[f64; 3]], facets: &[Vec<u32>]) -> Vec<Option<Camber>> {
        let straight = |f: &&Vec<u32>| f.len() == 2;
        let side = |f: &Vec<u32>| Side::new([f[0], f[1]], &points[f[0] as usize], &points[f[1] as usize]);
        let sides: Vec<Side> = facets.iter().filter(straight).map(side).collect();
        let mut found = crate::mesh::smooth(&sides).into_iter();
        let of = |f: &Vec<u32>| {
            let smooth = (f.len() == 2).then(|| found.next()).flatten()?;
            let Smooth { tangents, doubt } = smooth;
            (smooth != Smooth::default()).then(|| Camber {
                doubt,
                deduced: true,
                ..Camber::of_tangents(tangents)
            })
        };
        facets.iter().map(of).collect()
    }

    /// Height over the chord, relative to its length, and its slope.
    fn height(&self, xi: f64) -> (f64, f64) {
        let (sin, cos) = self.half_angle.sin_cos();
        let sin_phi = (xi * sin).clamp(-1.0 + f64::EPSILON, 1.0 - f64::EPSILON);
        let cos_phi = (1.0 - sin_phi * sin_phi).sqrt();
        let (room, lean) = (1.0 - xi * xi, self.skew.tan());
        let height = 0.5 * sin * room / (cos_phi + cos) - 0.25 * lean * xi * room;
        (height, -sin_phi / cos_phi - 0.5 * lean * (1.0 - 3.0 * xi * xi))
    }
}

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
    let size = SAME_POINT * surfaces[0].facet_size(facets[0]);
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
