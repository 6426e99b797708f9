//! How far the bodies have moved and deformed: whether small strains and small rotations can mean it.
use super::checks::{OfBodies, SCENE};
use crate::{
    body::{Body, Fields},
    case::{Case, Scalar},
    parallel,
    record::{PairSummary, Plausibility},
    vector::{in_figures, larger},
};
use mpi::topology::SimpleCommunicator;

/// Strain from which a user is told: what small strains leave out, their square, is then 5 % of them.
const LARGE_STRAIN: f64 = 0.05;

/// Turn, rad, from which a user is told: 10 degrees, which small strains take for a stretch of 1.5 %.
const LARGE_TURN: f64 = 0.175;

/// Mean turn of a body, rad, that no solution has: small strains take it for a stretch of 41 %.
const BEYOND_TURN: f64 = 1.0;

/// The largest value, and where it is, m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Peak {
    value: f64,
    at: [f64; 2],
}

impl Peak {
    fn join(&mut self, other: Peak) {
        if other.value.is_nan() || other.value > self.value {
            *self = other;
        }
    }
}

/// How a body has moved, from one rank's part of it or from all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    /// Largest principal strain in the plane, of the means over cells.
    strain: Peak,
    /// Largest mean rotation of a cell, (du_y/dx - du_x/dy) / 2.
    turn: Peak,
    low: [f64; 2],
    high: [f64; 2],
    /// Largest displacement of a node, m.
    way: f64,
    /// Of the nodes, about `origin`: number, sums of x, of u, of x.x and of x cross u.
    n: f64,
    x: [f64; 2],
    u: [f64; 2],
    xx: f64,
    xu: f64,
}

/// Numbers of a [`Motion`] in a message, with its body's.
const NUMBERS: usize = 19;

impl Motion {
    fn none() -> Motion {
        Motion {
            strain: Peak::default(),
            turn: Peak::default(),
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
            way: 0.0,
            n: 0.0,
            x: [0.0; 2],
            u: [0.0; 2],
            xx: 0.0,
            xu: 0.0,
        }
    }

    /// Of this rank's part; `origin`: a point of the body, the same on all its ranks.
    pub fn of_part(body: &Body, fields: &Fields, origin: [f64; 3]) -> Motion {
        let (part, mut motion) = (&body.part, Motion::none());
        for (cell, strain) in std::iter::zip(&part.cells, &fields.cell_strain) {
            let corners = cell.kind.n_corners();
            let nodes = || cell.nodes()[..corners].iter().map(|&n| n as usize);
            let points: Vec<[f64; 3]> = nodes().map(|n| part.points[n]).collect();
            let center = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>() / corners as f64);
            motion.strain.join(Peak { value: principal(strain), at: center });
            if nodes().any(|n| n >= fields.displacement.len()) {
                continue;
            }
            let moved: Vec<[f64; 3]> = nodes().map(|n| fields.displacement[n]).collect();
            motion.turn.join(Peak { value: turn(&points, &moved).abs(), at: center });
        }
        for (p, u) in std::iter::zip(&part.points[..part.n_owned], &fields.displacement) {
            let x = [p[0] - origin[0], p[1] - origin[1]];
            for c in 0..2 {
                (motion.low[c], motion.high[c]) = (motion.low[c].min(p[c]), motion.high[c].max(p[c]));
                (motion.x[c], motion.u[c]) = (motion.x[c] + x[c], motion.u[c] + u[c]);
            }
            motion.way = larger(motion.way, u[0].hypot(u[1]));
            motion.n += 1.0;
            motion.xx += x[0] * x[0] + x[1] * x[1];
            motion.xu += x[0] * u[1] - x[1] * u[0];
        }
        motion
    }

    /// Mean turn, rad: sum r x (u - u_mean) / sum r.r, with r from the mean of the nodes.
    fn mean_turn(&self) -> f64 {
        let dot = |a: &[f64; 2], b: &[f64; 2]| (a[0] * b[0] + a[1] * b[1]) / self.n;
        let cross = (self.x[0] * self.u[1] - self.x[1] * self.u[0]) / self.n;
        let inertia = self.xx - dot(&self.x, &self.x);
        if inertia > 0.0 { (self.xu - cross) / inertia } else { 0.0 }
    }

    /// Larger side of its box, m.
    fn size(&self) -> f64 {
        larger(self.high[0] - self.low[0], self.high[1] - self.low[1])
    }

    fn join(&mut self, other: &Motion) {
        self.strain.join(other.strain);
        self.turn.join(other.turn);
        for c in 0..2 {
            (self.low[c], self.high[c]) = (self.low[c].min(other.low[c]), self.high[c].max(other.high[c]));
            (self.x[c], self.u[c]) = (self.x[c] + other.x[c], self.u[c] + other.u[c]);
        }
        self.way = larger(self.way, other.way);
        (self.n, self.xx, self.xu) = (self.n + other.n, self.xx + other.xx, self.xu + other.xu);
    }

    fn pack(&self, body: usize) -> [f64; NUMBERS] {
        let Motion { strain: s, turn: t, low, high, way, n, x, u, xx, xu } = *self;
        let [sx, sy, tx, ty] = [s.at[0], s.at[1], t.at[0], t.at[1]];
        [
            body as f64,
            s.value,
            sx,
            sy,
            t.value,
            tx,
            ty,
            low[0],
            low[1],
            high[0],
            high[1],
            n,
            x[0],
            x[1],
            u[0],
            u[1],
            xx,
            xu,
            way,
        ]
    }

    fn unpack(v: &[f64; NUMBERS]) -> (usize, Motion) {
        let motion = Motion {
            strain: Peak { value: v[1], at: [v[2], v[3]] },
            turn: Peak { value: v[4], at: [v[5], v[6]] },
            low: [v[7], v[8]],
            high: [v[9], v[10]],
            n: v[11],
            x: [v[12], v[13]],
            u: [v[14], v[15]],
            xx: v[16],
            xu: v[17],
            way: v[18],
        };
        (v[0] as usize, motion)
    }
}

/// The bodies' motions on rank 0; nothing elsewhere.
pub(super) struct Motions(Vec<Motion>);

impl Motions {
    /// From the parts of this rank's bodies; `numbers`: theirs among the `n` of the case. Collective.
    pub fn gather(parts: &[Motion], numbers: &[usize], n: usize, world: &SimpleCommunicator) -> Motions {
        let own: Vec<f64> = std::iter::zip(parts, numbers).flat_map(|(m, &b)| m.pack(b)).collect();
        let all = parallel::gather(world, &own);
        if all.is_empty() {
            return Motions(Vec::new());
        }
        let mut motions = vec![Motion::none(); n];
        for packed in all.as_chunks().0 {
            let (body, motion) = Motion::unpack(packed);
            motions[body].join(&motion);
        }
        Motions(motions)
    }

    /// True if a strain is beyond small ones.
    pub fn has_large_strain(&self) -> bool {
        self.0.iter().any(|m| m.strain.value > LARGE_STRAIN)
    }

    /// Largest side of a body's box, m. On rank 0.
    fn largest_size(&self) -> f64 {
        self.0.iter().map(Motion::size).fold(0.0, larger)
    }

    /// Largest displacement over the larger side of the body's box, and the body. On rank 0.
    pub fn farthest(&self) -> Option<(f64, usize)> {
        let over_size = |m: &Motion| if m.size() > 0.0 { m.way / m.size() } else { 0.0 };
        let all = self.0.iter().map(over_size).enumerate().map(|(b, ratio)| (ratio, b));
        all.reduce(|a, b| if b.0 > a.0 { b } else { a })
    }

    /// What no solution has.
    pub fn contradictions(&self, case: &Case) -> Vec<String> {
        let of_body = |(m, body): (&Motion, &crate::case::BodyCase)| {
            let turn = m.mean_turn().abs();
            // Beside strains of its own size a turn is part of the deformation, or its round-off.
            (turn > larger(BEYOND_TURN, m.strain.value)).then(|| {
                format!(
                    "body '{}' has turned by {turn:.2e} rad on the whole, which no small rotation is: nothing holds it \
                     against turning but the unevenness of surfaces; hold it by a support, or look at the load's line of action",
                    body.name
                )
            })
        };
        std::iter::zip(&self.0, &case.bodies).filter_map(of_body).collect()
    }

    /// What a user should know of strains and rotations.
    pub fn warnings(&self, case: &Case) -> Vec<String> {
        let mut lines = Vec::new();
        let strains = (0..self.0.len()).filter(|&b| self.0[b].strain.value > LARGE_STRAIN);
        let largest =
            strains.reduce(|a, b| if self.0[b].strain.value > self.0[a].strain.value { b } else { a });
        if let Some(b) = largest {
            let Peak { value, at } = self.0[b].strain;
            let sizes: Vec<String> = std::iter::zip(&self.0, &case.bodies)
                .map(|(m, body)| {
                    let [w, h] = [0, 1].map(|c| m.high[c] - m.low[c]);
                    format!("'{}' {} x {}", body.name, in_figures(w), in_figures(h))
                })
                .collect();
            lines.push(format!(
                "body '{}': strains go up to {}, at ({}, {}); small strains end far below: look at the units of \
                 moduli, loads and lengths (sizes as read: {})",
                case.bodies[b].name,
                in_figures(value),
                in_figures(at[0]),
                in_figures(at[1]),
                sizes.join(", ")
            ));
            return lines;
        }
        for (m, body) in std::iter::zip(&self.0, &case.bodies) {
            let Peak { value, at } = m.turn;
            if value > LARGE_TURN {
                // A turn by w is a stretch by sqrt(1 + w^2) to small strains.
                lines.push(format!(
                    "body '{}' turns by up to {:.1} degrees, at ({}, {}): beyond small rotations, which strains are \
                     computed for, with any geometry of the contact: the turn alone is a stretch of {:.1} % there",
                    body.name,
                    value.atan().to_degrees(),
                    in_figures(at[0]),
                    in_figures(at[1]),
                    100.0 * (value.hypot(1.0) - 1.0)
                ));
            }
        }
        lines
    }
}

/// Loads alone make pairs carry more than they are by the wedge that the surfaces are to them: 1 / (2 sin a) times at half the
/// angle a, 29 times at one degree. Beyond it the forces most likely hold each other, not the load.
const WEDGE: f64 = 30.0;

/// An overlap below this share of the largest body is one of rounded coordinates, and presses with as small a share of the modulus.
const OVERLAP: f64 = 1e-9;

/// A body that moves by more than its own size has left where gaps and normals were measured.
const FAR: f64 = 1.0;

/// The sizes of forces and displacements, and what a user should know of them. `overlap`: the largest of the undeformed bodies,
/// m. The same on all ranks but for the warnings, which are rank 0's. Collective.
pub(super) fn plausibility(
    case: &Case,
    of_bodies: &OfBodies,
    pairs: &[PairSummary],
    motions: &Motions,
    overlap: f64,
    world: &SimpleCommunicator,
) -> (Plausibility, Vec<String>) {
    let mut warnings = Vec::new();
    let driven = is_driven(case) || overlap > OVERLAP * motions.largest_size();
    let [loads, supports] = of_bodies.applied;
    let applied = loads + supports;
    let largest = pairs.iter().reduce(|a, b| if b.normal_force > a.normal_force { b } else { a });
    let carried = largest.filter(|_| applied > SCENE * of_bodies.largest_force && applied > 0.0);
    let carried_over_applied = carried.map(|pair| pair.normal_force / applied);
    if let (Some(pair), Some(ratio)) = (carried, carried_over_applied)
        && (!driven && ratio > WEDGE)
    {
        warnings.push(format!(
            "contact '{}' carries {:.3e} where loads of {loads:.3e} are all that acts: {ratio:.0} times as much; look at how the              loaded body is held, at the transfer, and at the displacements",
            pair.name, pair.normal_force
        ));
    }
    let farthest = motions.farthest();
    if let Some((ratio, body)) = farthest.filter(|(ratio, _)| *ratio > FAR) {
        warnings.push(format!(
            "body '{}' moves by {ratio:.3e} times its own size: far beyond small displacements; look at its supports and loads",
            case.bodies[body].name
        ));
    }
    let displacement = parallel::from_first(world, farthest.map_or(f64::NAN, |(ratio, _)| ratio));
    (Plausibility { carried_over_applied, displacement_over_size: Some(displacement) }, warnings)
}

/// The larger of each of two steps.
pub(super) fn worse(a: Plausibility, b: Plausibility) -> Plausibility {
    let of = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(larger);
    Plausibility {
        carried_over_applied: of(a.carried_over_applied, b.carried_over_applied),
        displacement_over_size: of(a.displacement_over_size, b.displacement_over_size),
    }
}

/// True if prescribed motions or heat drive the case, not loads alone.
fn is_driven(case: &Case) -> bool {
    let moves = |body: &crate::case::BodyCase| {
        body.supports
            .iter()
            .any(|s| s.displacement.iter().flatten().any(|u| !matches!(u, Scalar::Constant(0.0))))
    };
    case.bodies.iter().any(|body| body.temperature.is_some() || moves(body))
        || case.rigid.iter().any(|body| body.motion.iter().any(|u| *u != 0.0))
}

/// Largest absolute principal strain in the plane.
fn principal(strain: &[f64; 6]) -> f64 {
    let (mean, half) = (0.5 * (strain[0] + strain[1]), 0.5 * (strain[0] - strain[1]));
    let radius = half.hypot(strain[3]);
    larger((mean + radius).abs(), (mean - radius).abs())
}

/// Mean of (du_y/dx - du_x/dy) / 2 over a polygon: half its circulation over its area.
fn turn(points: &[[f64; 3]], moved: &[[f64; 3]]) -> f64 {
    let n = points.len();
    let (mut circulation, mut area) = (0.0, 0.0);
    for a in 0..n {
        let b = (a + 1) % n;
        let [dx, dy] = [0, 1].map(|c| points[b][c] - points[a][c]);
        let [ux, uy] = [0, 1].map(|c| 0.5 * (moved[a][c] + moved[b][c]));
        circulation += ux * dx + uy * dy;
        // From the first corner: far from the origin nothing is lost.
        let [rx, ry] = [0, 1].map(|c| points[a][c] - points[0][c]);
        area += 0.5 * (rx * dy - ry * dx);
    }
    0.5 * circulation / area
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_polygon_turns_by_what_it_was_turned() {
        let points = [[1.0, 2.0, 0.0], [3.0, 2.5, 0.0], [2.5, 4.0, 0.0], [0.5, 3.0, 0.0]];
        let (w, stretch) = (0.3, 0.2);
        let moved = points.map(|p| [stretch * p[0] - w * p[1] + 7.0, w * p[0] - 3.0, 0.0]);
        assert!((turn(&points, &moved) - w).abs() < 1e-14);
    }

    #[test]
    fn the_principal_strain_turns_with_the_axes() {
        let (s, c) = 0.7_f64.sin_cos();
        let (a, b) = (-0.3, 0.1);
        let strain = [a * c * c + b * s * s, a * s * s + b * c * c, 0.0, (a - b) * s * c, 0.0, 0.0];
        assert!((principal(&strain) - 0.3).abs() < 1e-15);
    }

    #[test]
    fn the_mean_turn_does_not_depend_on_the_origin_or_on_translations() {
        let mut motion = Motion::none();
        for x in [[5.0, 1.0], [6.0, 1.5], [5.5, 3.0], [4.0, 2.0]] {
            let u = [2.0 - 0.4 * x[1], -1.0 + 0.4 * x[0]];
            motion.n += 1.0;
            (0..2).for_each(|c| (motion.x[c], motion.u[c]) = (motion.x[c] + x[c], motion.u[c] + u[c]));
            motion.xx += x[0] * x[0] + x[1] * x[1];
            motion.xu += x[0] * u[1] - x[1] * u[0];
        }
        assert!((motion.mean_turn() - 0.4).abs() < 1e-14);
        assert_eq!(Motion::unpack(&motion.pack(3)), (3, motion));
    }
}
