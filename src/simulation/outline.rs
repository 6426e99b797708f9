//! Outlines of the rigid bodies, for the picture.
use crate::vector::larger;
use crate::{
    body::LoadFactors,
    case::{Case, RigidShape},
    contact::vector::{norm, sub},
    output::Outline,
    parallel,
};
use mpi::topology::SimpleCommunicator;

/// Straight pieces of a circle.
const PIECES: u32 = 180;

/// Every rigid body, moved by its factor times its prescribed motion. `points`: this rank's nodes, m; a plane is
/// drawn as far as they reach. Collective.
pub(super) fn outlines(
    case: &Case,
    points: &[[f64; 3]],
    factors: &LoadFactors,
    world: &SimpleCommunicator,
) -> Vec<Outline> {
    let polyline = |shape: &RigidShape| match shape {
        RigidShape::Plane { through, normal } => {
            let own = points.iter().map(|p| norm(&sub(p, through))).fold(0.0, larger);
            // Behind the plane is the left of this direction.
            let reach = 2.0 * parallel::max(world, &[own])[0];
            let end = |t: f64| [through[0] - t * normal[1], through[1] + t * normal[0], 0.0];
            vec![end(-reach), end(reach)]
        }
        RigidShape::Circle { center, radius, inside } => {
            let turn = if *inside { -std::f64::consts::TAU } else { std::f64::consts::TAU };
            let point = |i: u32| {
                let (sin, cos) = (turn * f64::from(i) / f64::from(PIECES)).sin_cos();
                [center[0] + radius * cos, center[1] + radius * sin, 0.0]
            };
            (0..=PIECES).map(point).collect()
        }
        RigidShape::Polyline { points } => points.clone(),
    };
    let outline = |body: &crate::case::RigidCase| Outline {
        body: body.name.clone(),
        points: polyline(&body.shape),
        motion: body.motion.map(|u| factors.on_supports(body.path) * u),
    };
    case.rigid.iter().map(outline).collect()
}
