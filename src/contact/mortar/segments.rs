//! Segments: which part of a multiplier-side edge lies opposite which mortar facet.
use super::super::{
    Surface, normals,
    search::{FACING, Search},
    surface::line_shape,
    vector::{combine, dot, norm, sub, unit},
};
use crate::tolerances::COORDINATES;

/// How far beyond a facet's ends a line may meet it: the ends of segments are rounded to within [`COORDINATES`].
const BEYOND: f64 = 1e-6;

/// A part of an edge and the facet opposite to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Mortar facet.
    pub facet: usize,
    /// Coordinates on the multiplier edge between which the facet lies opposite.
    pub span: [f64; 2],
}

/// An edge of the multiplier side with its normal field: nodal normals interpolated, then made unit vectors.
pub struct Edge<'a> {
    surface: &'a Surface,
    /// Facet index.
    pub facet: usize,
    /// Normals at the edge's nodes.
    pub normals: [[f64; 3]; 3],
}

impl<'a> Edge<'a> {
    /// Facet `f` of the surface.
    pub fn new(surface: &'a Surface, facet: usize) -> Self {
        Edge { surface, facet, normals: normals::along(surface, facet) }
    }

    /// Its nodes.
    pub fn nodes(&self) -> &'a [u32] {
        &self.surface.facets[self.facet]
    }

    /// Position at `xi`, m.
    pub fn point(&self, xi: f64) -> [f64; 3] {
        self.surface.point(self.facet, xi)
    }

    /// ds/dxi, m.
    pub fn stretch(&self, xi: f64) -> f64 {
        norm(&self.surface.tangent(self.facet, xi))
    }

    /// Unit normal at `xi`.
    pub fn normal(&self, xi: f64) -> [f64; 3] {
        let (n, _) = line_shape(self.nodes().len(), xi);
        unit(&combine(n.into_iter().zip(&self.normals)))
    }

    /// How far `y` lies ahead of the normal line at `xi`, times |n|, and the derivative of that.
    fn ahead(&self, y: &[f64; 3], xi: f64) -> (f64, f64) {
        let (n, dn) = line_shape(self.nodes().len(), xi);
        let (normal, turn) =
            (combine(n.into_iter().zip(&self.normals)), combine(dn.into_iter().zip(&self.normals)));
        let (offset, tangent) = (sub(y, &self.point(xi)), self.surface.tangent(self.facet, xi));
        let cross = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[1] - a[1] * b[0];
        (cross(&normal, &offset), cross(&turn, &offset) - cross(&normal, &tangent))
    }

    /// Coordinate whose normal line passes through `y`; infinite if that is beyond an end. `None` if the lines have
    /// crossed before they get there: `y` lies beyond the centre of curvature.
    pub fn coordinate(&self, y: &[f64; 3]) -> Option<f64> {
        let (first, last) = (self.ahead(y, -1.0).0, self.ahead(y, 1.0).0);
        match (first >= 0.0, last <= 0.0) {
            (true, false) => return Some(f64::INFINITY),
            (false, true) => return Some(f64::NEG_INFINITY),
            (false, false) => return None,
            (true, true) => {}
        }
        if first == last {
            return None;
        }
        // Newton, kept between the two bounds: positive on the left, negative on the right.
        let (mut low, mut high) = (-1.0, 1.0);
        let mut xi = (first + last) / (first - last);
        for _ in 0..60 {
            let (value, slope) = self.ahead(y, xi);
            if value >= 0.0 {
                low = xi;
            } else {
                high = xi;
            }
            let mut next = xi - value / slope;
            if !(low..=high).contains(&next) {
                next = 0.5 * (low + high);
            }
            let step = (next - xi).abs();
            xi = next;
            if step < 1e-15 {
                break;
            }
        }
        Some(xi)
    }
}

/// Finds segments on the edges of one surface opposite another.
pub struct Segments<'a> {
    multiplier: &'a Surface,
    own: Search<'a>,
    mortar: &'a Surface,
    other: Search<'a>,
    /// How far ahead of an edge facets may lie, m.
    limit: f64,
    /// Size of the whole, m: the furthest that anything can lie.
    extent: f64,
}

impl<'a> Segments<'a> {
    /// Indexes both surfaces; facets further ahead than `limit`, m, lie opposite nothing.
    pub fn new(multiplier: &'a Surface, mortar: &'a Surface, limit: f64) -> Self {
        // Both boxes and the way from one to the other.
        let between = match (multiplier.points.first(), mortar.points.first()) {
            (Some(a), Some(b)) => norm(&sub(a, b)),
            _ => 0.0,
        };
        let extent = multiplier.extent() + mortar.extent() + between;
        let (own, other) = (Search::new(multiplier), Search::new(mortar));
        Segments { multiplier, own, mortar, other, limit: limit.min(extent), extent }
    }

    /// Signed distance of the mortar side from `x` along `normal`, and the coordinate where it is met.
    pub fn opposite(&self, facet: usize, x: &[f64; 3], normal: &[f64; 3]) -> Option<(f64, f64)> {
        self.other.hit(facet, x, normal)
    }

    /// Segments of an edge, in order.
    ///
    /// The ends of all mortar facets within reach are projected onto the edge along its normal field; between two
    /// neighbouring projections the same facets lie opposite throughout, and the middle decides which it is.
    pub fn of(&self, edge: &Edge) -> Vec<Segment> {
        let mut spans = self.spans(edge);
        let mut breaks: Vec<f64> = spans.iter().flat_map(|s| s.span).chain([-1.0, 1.0]).collect();
        breaks.sort_by(f64::total_cmp);
        let mut joints: Vec<f64> = Vec::with_capacity(breaks.len());
        for at in breaks {
            if joints.last().is_none_or(|last| at - last > 2.0 * COORDINATES) {
                joints.push(at);
            }
        }
        // The last joint may be a break within round-off of the end: the end counts.
        if let Some(last) = joints.last_mut() {
            *last = 1.0;
        }
        spans.sort_by(|a, b| a.span[0].total_cmp(&b.span[0]));
        let mut coming = spans.into_iter().peekable();
        let mut here: Vec<Segment> = Vec::new();
        let mut segments = Vec::new();
        for ends in joints.windows(2) {
            let middle = 0.5 * (ends[0] + ends[1]);
            while let Some(span) = coming.next_if(|s| s.span[0] < middle) {
                here.push(span);
            }
            here.retain(|s| s.span[1] > middle);
            if let Some(facet) = self.nearest(edge, middle, &here) {
                segments.push(Segment { facet, span: [ends[0], ends[1]] });
            }
        }
        segments
    }

    /// Facets that may lie opposite the edge and where.
    fn spans(&self, edge: &Edge) -> Vec<Segment> {
        let size = self.multiplier.facet_size(edge.facet);
        let mut points = Vec::with_capacity(9);
        let mut axes = Vec::with_capacity(4);
        for xi in [-1.0, 0.0, 1.0] {
            let (x, n) = (edge.point(xi), edge.normal(xi));
            points.extend([-self.extent, 0.0, self.limit.max(0.0)].map(|d| combine([(1.0, &x), (d, &n)])));
            axes.push([n[1], -n[0]]);
        }
        let normal = edge.normal(0.0);
        axes.push([normal[0], normal[1]]);
        let mut spans = Vec::new();
        for facet in self.other.near_hull(&points, &axes) {
            let ends = &self.mortar.facets[facet];
            let at = |i: usize| edge.coordinate(&self.mortar.points[ends[i] as usize]);
            let (Some(a), Some(b)) = (at(0), at(1)) else { continue };
            let span = [a.min(b).max(-1.0), a.max(b).min(1.0)];
            if size > 0.0 && span[1] > span[0] {
                spans.push(Segment { facet, span });
            }
        }
        spans
    }

    /// The facet opposite `xi`: the first one met ahead or behind, whichever is nearer, if it faces the edge. Behind
    /// is penetration: the way there leads through both bodies, so no other surface may lie between.
    fn nearest(&self, edge: &Edge, xi: f64, candidates: &[Segment]) -> Option<usize> {
        let (x, normal) = (edge.point(xi), edge.normal(xi));
        let mut first: [Option<(f64, usize, f64)>; 2] = [None, None];
        for candidate in candidates {
            let f = candidate.facet;
            let Some((eta, distance)) = self.opposite(f, &x, &normal) else { continue };
            if eta.abs() > 1.0 + BEYOND || distance > self.limit {
                continue;
            }
            let way = &mut first[usize::from(distance < 0.0)];
            if way.is_none_or(|(d, ..)| distance.abs() < d) {
                *way = Some((distance.abs(), f, eta));
            }
        }
        let faces = |&(_, f, eta): &(f64, usize, f64)| {
            dot(&unit(&self.mortar.area_vector(f, eta)), &normal) <= FACING
        };
        let ahead = first[0].filter(faces);
        let behind = first[1].filter(faces).filter(|&(depth, ..)| self.inside(edge, &x, &normal, depth));
        let nearest = ahead.into_iter().chain(behind).min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|(_, f, _)| f)
    }

    /// True if what lies `depth` behind `x` is still inside the edge's own body: no own facet lies between.
    fn inside(&self, edge: &Edge, x: &[f64; 3], normal: &[f64; 3], depth: f64) -> bool {
        let size = self.multiplier.facet_size(edge.facet);
        if depth <= size {
            return true;
        }
        !self.own.along_line(x, normal).any(|f| {
            self.own.hit(f, x, normal).is_some_and(|(eta, distance)| {
                f != edge.facet && eta.abs() <= 1.0 && -distance > BEYOND * size && -distance < depth
            })
        })
    }
}
