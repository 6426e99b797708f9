//! Closest-point projection onto a surface, found with an R-tree.
use super::{
    Surface,
    surface::line_shape,
    vector::{combine, dot, norm, sub, unit},
};
use rstar::{AABB, RTree, SelectionFunction, primitives::GeomWithData, primitives::Rectangle};

/// A facet's bounding box and its index.
type Leaf = GeomWithData<Rectangle<[f64; 3]>, usize>;

/// A surface with its spatial index.
pub struct Search<'a> {
    surface: &'a Surface,
    tree: RTree<Leaf>,
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
pub(super) const FACING: f64 = -0.1;

/// Projection error allowed relative to the facet, for round-off in the coordinates.
const ROUND_OFF: f64 = 1e-6;

/// Boxes whose projection on each axis meets the axis's range.
struct Band(Vec<([f64; 2], [f64; 2])>);

impl SelectionFunction<Leaf> for Band {
    fn should_unpack_parent(&self, bounds: &AABB<[f64; 3]>) -> bool {
        let (low, high) = (bounds.lower(), bounds.upper());
        self.0.iter().all(|(axis, range)| {
            let (mut least, mut most) = (0.0, 0.0);
            for i in 0..2 {
                let (a, b) = (axis[i] * low[i], axis[i] * high[i]);
                least += a.min(b);
                most += a.max(b);
            }
            least <= range[1] && most >= range[0]
        })
    }

    fn should_unpack_leaf(&self, leaf: &Leaf) -> bool {
        self.should_unpack_parent(&rstar::RTreeObject::envelope(leaf))
    }
}

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
        for f in self.along_line(x, normal) {
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

    /// Facets whose boxes the line through `x` along `normal` meets, either way.
    pub fn along_line(&self, x: &[f64; 3], normal: &[f64; 3]) -> impl Iterator<Item = usize> + '_ {
        let at = x[0] * normal[1] - x[1] * normal[0];
        self.select(Band(vec![([normal[1], -normal[0]], [at, at])]))
    }

    /// Facets whose boxes meet the convex hull of `points`, separated along coordinate axes and `axes` only: a few
    /// too many may come.
    pub fn near_hull(&self, points: &[[f64; 3]], axes: &[[f64; 2]]) -> impl Iterator<Item = usize> + '_ {
        let bands = axes.iter().chain(&[[1.0, 0.0], [0.0, 1.0]]).map(|&axis| {
            let range = points.iter().map(|p| axis[0] * p[0] + axis[1] * p[1]);
            (axis, range.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]))
        });
        self.select(Band(bands.collect()))
    }

    fn select(&self, band: Band) -> impl Iterator<Item = usize> + '_ {
        self.tree.locate_with_selection_function(band).map(|leaf| leaf.data)
    }

    /// Where the line through `x` along the unit vector `normal` meets facet `f`: the coordinate eta there and the
    /// signed distance from `x`. Beyond the facet's ends the facet is extrapolated. `None` if the line is parallel.
    pub fn hit(&self, f: usize, x: &[f64; 3], normal: &[f64; 3]) -> Option<(f64, f64)> {
        let side = |p: &[f64; 3]| normal[0] * (p[1] - x[1]) - normal[1] * (p[0] - x[0]);
        let at = |i: usize| side(&self.surface.points[self.surface.facets[f][i] as usize]);
        let (a, b) = (at(0), at(1));
        let straight = (a + b) / (a - b);
        let eta = if self.surface.facets[f].len() == 2 {
            straight
        } else {
            // side(eta) = second eta^2 + first eta + middle; of its two roots the one the chord suggests.
            let middle = at(2);
            let (second, first) = (0.5 * (a + b) - middle, 0.5 * (b - a));
            let root = (first * first - 4.0 * second * middle).max(0.0).sqrt();
            let q = -0.5 * (first + root.copysign(first));
            let guess = if straight.is_finite() { straight.clamp(-1.0, 1.0) } else { 0.0 };
            let roots = [middle / q, q / second].into_iter().filter(|r| r.is_finite());
            roots.min_by(|r, s| (r - guess).abs().total_cmp(&(s - guess).abs()))?
        };
        let distance = dot(&sub(&self.surface.point(f, eta), x), normal);
        (eta.is_finite() && distance.is_finite()).then_some((eta, distance))
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
