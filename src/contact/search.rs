//! Closest-point projection onto a surface, found with an R-tree.
use super::{
    Surface,
    surface::line_shape,
    vector::{combine, dot, norm, sub, unit},
};
use rstar::{AABB, RTree, primitives::GeomWithData, primitives::Rectangle};

/// A surface with its spatial index.
pub struct Search<'a> {
    surface: &'a Surface,
    tree: RTree<GeomWithData<Rectangle<[f64; 3]>, usize>>,
    /// Number of facets at each node: one at a free end of the surface.
    facets_at_node: Vec<u8>,
}

/// The point of a surface that belongs to a given point.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    /// Facet index.
    pub facet: usize,
    /// Shape function of each of the facet's nodes at the point.
    pub shape: [f64; 3],
    /// The point, m.
    pub point: [f64; 3],
    /// Outward unit normal of the surface there, interpolated between the nodes' normals.
    pub normal: [f64; 3],
    /// How far, along the surface, the given point lies beyond its free end, m; 0 inside.
    pub overshoot: f64,
    /// How far the point may reasonably be off, m: the projection along either surface's normal is legitimate, and
    /// so is what lies between them.
    pub slack: f64,
}

/// Facets are hit only where the two surfaces face each other: cosine between the normals below this.
const FACING: f64 = -0.1;

/// Projection error allowed relative to the facet, for round-off in the coordinates.
const ROUND_OFF: f64 = 1e-6;

impl<'a> Search<'a> {
    /// Builds the index, O(n log n).
    pub fn new(surface: &'a Surface) -> Self {
        let boxes = (0..surface.facets.len()).map(|f| {
            let corners: Vec<[f64; 3]> =
                surface.facets[f].iter().map(|&i| surface.points[i as usize]).collect();
            let bounds = AABB::from_points(&corners);
            // A curved edge may leave the box of its nodes by a little.
            let pad = 0.1 * surface.facet_size(f);
            let (low, high) = (bounds.lower().map(|c| c - pad), bounds.upper().map(|c| c + pad));
            GeomWithData::new(Rectangle::from_corners(low, high), f)
        });
        let mut facets_at_node = vec![0; surface.nodes.len()];
        for &end in surface.facets.iter().flat_map(|f| &f[..2]) {
            facets_at_node[end as usize] += 1;
        }
        Search { surface, tree: RTree::bulk_load(boxes.collect()), facets_at_node }
    }

    /// Closest point of the surface to `x`, among facets that face `normal`.
    pub fn closest(&self, x: &[f64; 3], normal: &[f64; 3]) -> Option<Projection> {
        let mut best: Option<(f64, usize, f64)> = None;
        for (leaf, box_distance2) in self.tree.nearest_neighbor_iter_with_distance_2(x) {
            if best.is_some_and(|(d2, ..)| box_distance2 > d2) {
                break;
            }
            let f = leaf.data;
            let xi = self.closest_on_facet(f, x);
            if dot(&unit(&self.surface.area_vector(f, xi)), normal) > FACING {
                continue;
            }
            let offset = sub(&self.surface.point(f, xi), x);
            let d2 = dot(&offset, &offset);
            if best.is_none_or(|(b, ..)| d2 < b) {
                best = Some((d2, f, xi));
            }
        }
        best.map(|(_, f, xi)| self.projection(f, xi, x, normal))
    }

    /// Where the line through `x` along `normal` meets the surface: the intersection nearest to `x`.
    pub fn intersection(&self, x: &[f64; 3], normal: &[f64; 3]) -> Option<Projection> {
        let across = [normal[1], -normal[0], 0.0];
        let mut best: Option<(f64, usize, f64)> = None;
        for f in 0..self.surface.facets.len() {
            let ends = &self.surface.facets[f];
            let side = |i: u32| dot(&sub(&self.surface.points[i as usize], x), &across);
            let (a, b) = (side(ends[0]), side(ends[1]));
            let tolerance = ROUND_OFF * self.surface.facet_size(f);
            if a.min(b) > tolerance || a.max(b) < -tolerance || a == b {
                continue;
            }
            // Secant on a straight edge is exact; a curved one takes a few Newton steps.
            let mut xi = ((a + b) / (a - b)).clamp(-1.0, 1.0);
            for _ in 0..20 {
                let slope = dot(&self.surface.tangent(f, xi), &across);
                let step = dot(&sub(&self.surface.point(f, xi), x), &across) / slope;
                xi = (xi - step).clamp(-1.0, 1.0);
                if step.abs() < 1e-15 || !step.is_finite() {
                    break;
                }
            }
            if dot(&unit(&self.surface.area_vector(f, xi)), normal) > FACING {
                continue;
            }
            let distance = norm(&sub(&self.surface.point(f, xi), x));
            if best.is_none_or(|(d, ..)| distance < d) {
                best = Some((distance, f, xi));
            }
        }
        best.map(|(_, f, xi)| self.projection(f, xi, x, normal))
    }

    /// Coordinate in [-1, 1] of the point of facet `f` closest to `x`.
    fn closest_on_facet(&self, f: usize, x: &[f64; 3]) -> f64 {
        let ends = &self.surface.facets[f];
        let (a, b) = (self.surface.points[ends[0] as usize], self.surface.points[ends[1] as usize]);
        let chord = sub(&b, &a);
        let mut xi = (2.0 * dot(&sub(x, &a), &chord) / dot(&chord, &chord) - 1.0).clamp(-1.0, 1.0);
        if ends.len() == 2 {
            return xi;
        }
        // Newton on d/dxi |x(xi) - x|^2 = 0; Gauss-Newton where the curvature would make it a maximum.
        let second =
            combine([1.0, 1.0, -2.0].into_iter().zip(ends.iter().map(|&i| &self.surface.points[i as usize])));
        for _ in 0..30 {
            let (offset, t) = (sub(&self.surface.point(f, xi), x), self.surface.tangent(f, xi));
            let curvature = dot(&t, &t) + dot(&offset, &second).max(-0.5 * dot(&t, &t));
            let next = (xi - dot(&offset, &t) / curvature).clamp(-1.0, 1.0);
            let change = (next - xi).abs();
            xi = next;
            if change < 1e-15 {
                break;
            }
        }
        xi
    }

    fn projection(&self, f: usize, xi: f64, x: &[f64; 3], normal: &[f64; 3]) -> Projection {
        let surface = self.surface;
        let nodes = &surface.facets[f];
        let (shape, _) = line_shape(nodes.len(), xi);
        let point = surface.point(f, xi);
        let facet_normal = unit(&surface.area_vector(f, xi));
        let interpolated =
            unit(&combine(nodes.iter().enumerate().map(|(i, &n)| (shape[i], &surface.normals[n as usize]))));
        let offset = sub(x, &point);
        let at_free_end = xi.abs() == 1.0 && self.facets_at_node[nodes[usize::from(xi > 0.0)] as usize] == 1;
        let overshoot = if at_free_end {
            (xi.signum() * dot(&offset, &unit(&surface.tangent(f, xi)))).max(0.0)
        } else {
            0.0
        };
        // sin of the angle between the two normals times the distance, twice: see `slack`.
        let cross = normal[0] * facet_normal[1] - normal[1] * facet_normal[0];
        let slack = 2.0 * norm(&offset) * cross.abs() + ROUND_OFF * surface.facet_size(f);
        Projection { facet: f, shape, point, normal: interpolated, overshoot, slack }
    }
}
