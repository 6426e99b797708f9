//! The smooth curve that a facet stands for: what its nodes were placed on.
//!
//! Straight facets leave a curve by the sagitta, which a clearance or an interference need not be large against. Distances
//! between surfaces are therefore those between the curves: the arcs that generated meshes were made of, and for meshes
//! from files the curve through the nodes.
use crate::mesh::{Curve, Mesh, Side, Smooth};

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
    pub(super) fn height(&self, xi: f64) -> (f64, f64) {
        let (sin, cos) = self.half_angle.sin_cos();
        let sin_phi = (xi * sin).clamp(-1.0 + f64::EPSILON, 1.0 - f64::EPSILON);
        let cos_phi = (1.0 - sin_phi * sin_phi).sqrt();
        let (room, lean) = (1.0 - xi * xi, self.skew.tan());
        let height = 0.5 * sin * room / (cos_phi + cos) - 0.25 * lean * xi * room;
        (height, -sin_phi / cos_phi - 0.5 * lean * (1.0 - 3.0 * xi * xi))
    }
}
