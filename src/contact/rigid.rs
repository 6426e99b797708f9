//! Surfaces of rigid bodies: what deformable bodies are pressed against. They are mortar sides.
use super::{
    Surface,
    vector::{combine, unit},
};

/// Quadratic facets of a circle: each leaves it by less than 1e-11 of the radius.
const CIRCLE_FACETS: u32 = 720;

impl Surface {
    /// A plane through a point with an outward normal: one facet, `extent` long to either side, m.
    pub fn rigid_plane(through: [f64; 2], normal: [f64; 2], extent: f64) -> Surface {
        let normal = unit(&[normal[0], normal[1], 0.0]);
        // The outward normal is the tangent turned clockwise.
        let tangent = [-normal[1], normal[0], 0.0];
        let center = [through[0], through[1], 0.0];
        let end = |side: f64| combine([(1.0, &center), (side * extent, &tangent)]);
        Surface::rigid(vec![end(-1.0), end(1.0)], vec![vec![0, 1]])
    }

    /// A circle, run through anticlockwise; clockwise if contact is on its `inside` (a bore). Every node lies on it.
    pub fn rigid_circle(center: [f64; 2], radius: f64, inside: bool) -> Surface {
        let count = 2 * CIRCLE_FACETS;
        let turn = if inside { -std::f64::consts::TAU } else { std::f64::consts::TAU };
        let point = |i: u32| {
            let (sin, cos) = (turn * f64::from(i) / f64::from(count)).sin_cos();
            [center[0] + radius * cos, center[1] + radius * sin, 0.0]
        };
        let facet = |f: u32| vec![2 * f, (2 * f + 2) % count, 2 * f + 1];
        Surface::rigid((0..count).map(point).collect(), (0..CIRCLE_FACETS).map(facet).collect())
    }

    fn rigid(points: Vec<[f64; 3]>, facets: Vec<Vec<u32>>) -> Surface {
        Surface { rigid: true, ..Surface::from_points(points, facets, 1.0, false) }
    }

    /// Straight lines from point to point, closed if the last point is the first; the body lies to the left.
    pub fn rigid_polyline(points: &[[f64; 2]]) -> Surface {
        let closed = points.len() > 3 && points.first() == points.last();
        let n_nodes = points.len() - usize::from(closed);
        let nodes = points[..n_nodes].iter().map(|p| [p[0], p[1], 0.0]).collect();
        let facets = (1..points.len()).map(|i| vec![i as u32 - 1, (i % n_nodes) as u32]).collect();
        Surface::rigid(nodes, facets)
    }
}
