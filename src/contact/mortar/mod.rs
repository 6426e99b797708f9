//! Mortar transfer with dual multipliers on surfaces made of line segments.
//!
//! The multipliers live on one surface, the multiplier side; its counterpart is the mortar side. With psi_j the dual
//! function of multiplier node j, D_j = int psi_j dA, u the displacement of the multiplier side, N_k the shape
//! functions of the mortar side and g the distance between the surfaces along the normal field of the multiplier side,
//!
//! gap_j = int psi_j (g - n . (u - sum_k N_k u_k)) dA / D_j,  n the normal field of the multiplier side.
//!
//! g is the distance between the curves that the facets stand for (`camber.rs`), not between the facets. Opposite straight
//! facets move by linear displacements, which follow it from end to end of their common part but not in between: there it is
//! interpolated, or the dual functions, which are negative in places, would make an overlap of curves that only touch.
//!
//! Against a rigid surface with normal m it is m / (m . n) in place of n: both bodies touch along its shape.
//!
//! All integrals run over the part of the multiplier side that has a partner, also those that make psi dual
//! (consistent boundary modification, Cichosz and Bischoff 2011; Popp et al. 2012, 2013): a uniform pressure then gives
//! the consistent nodal forces on both sides for any two meshes and any overlap.
mod dual;
mod segments;
mod side;
#[cfg(test)]
mod tests;

pub use side::{coarser_side, multiplier_side};

use super::Gap;
use super::{
    Row, Surface,
    curve::clearance,
    normals,
    surface::line_shape,
    vector::{combine, dot, norm, sub, unit},
};
use crate::tolerances::COORDINATES;
use crate::vector::larger;
use dual::{Dual, Part};
use nalgebra::{DMatrix, DVector};
use segments::{Edge, Segments};
use std::collections::BTreeMap;

/// A node carries a multiplier if at least this share of its B has a partner on one of its edges: what holds for
/// hardly any area, extrapolated to the node, is no sensible condition. No share that simple meshes would give exactly.
const CARRIES: f64 = 0.237;

/// Facets are paired this many search distances apart, so that the rows within the distance have their whole support.
const MARGIN: f64 = 2.0;

/// Coefficients smaller than this are round-off in the coordinates, relative to a facet.
const NEGLIGIBLE: f64 = 1e-11;

/// Six-point Gauss rule on [-1, 1]: (point, weight).
const GAUSS6: [(f64, f64); 6] = [
    (-0.932_469_514_203_152, 0.171_324_492_379_170_36),
    (-0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (-0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];

/// Contact rows of a pair, at most one for each node of the multiplier side, in the order of its nodes.
///
/// `thickness` in m. Rows whose gap is larger than `search_distance`, m (infinite: no limit), are left out. For the
/// current configuration give [`Surface::moved`] surfaces: the gaps are then the current ones.
pub fn rows(
    multiplier: &Surface,
    mortar: &Surface,
    gap: &Gap,
    thickness: f64,
    search_distance: f64,
) -> Vec<Row> {
    let found = transfer(multiplier, mortar, gap, thickness, search_distance, &|_| false);
    found.rows.into_iter().filter(|row| row.gap <= search_distance * (1.0 + COORDINATES)).collect()
}

/// What the mortar transfer of a pair consists of.
#[derive(Debug, Clone, Default)]
pub struct Transferred {
    /// All rows, in the order of the multiplier side's nodes.
    pub rows: Vec<Row>,
    /// Of each facet of the multiplier side: from where to where on it, xi in [-1, 1], the mortar side lies opposite.
    pub cover: Vec<Option<[f64; 2]>>,
}

/// As [`rows`], but with all rows of facets within reach of `search_distance`. Nodes that are `taken` carry the multiplier of
/// another pair: they get none here if another node of their facets can have their share. A constant pressure is
/// then still that of one multiplier field over both pairs.
pub fn transfer(
    multiplier: &Surface,
    mortar: &Surface,
    gap: &Gap,
    thickness: f64,
    search_distance: f64,
    taken: &dyn Fn(u32) -> bool,
) -> Transferred {
    let limit = match gap {
        Gap::Value(_) => f64::INFINITY,
        Gap::Geometry { offset } => MARGIN * search_distance - offset,
    };
    let segments = Segments::new(multiplier, mortar, limit);
    let edges: Vec<Overlap> =
        (0..multiplier.facets.len()).filter_map(|f| Overlap::new(&segments, multiplier, mortar, f)).collect();
    let mut cover = vec![None; multiplier.facets.len()];
    edges.iter().for_each(|edge| cover[edge.edge.facet] = Some(edge.part.span));
    let carries = carriers(&edges, taken);
    let mut sums: BTreeMap<u32, Sums> = BTreeMap::new();
    for (edge, carries) in edges.iter().zip(&carries) {
        let Some(dual) = edge.part.dual(carries) else { continue };
        edge.add_to(&mut sums, &dual);
    }
    let rows = sums.into_iter().filter_map(|(node, sum)| sum.into_row(node, gap, thickness)).collect();
    Transferred { rows, cover }
}

/// The part of an edge that has a partner, with the integrals over it.
struct Overlap<'a> {
    edge: Edge<'a>,
    part: Part,
    /// Mortar nodes opposite.
    opposite: Vec<u32>,
    /// int b N_i n dA, a column per node of the edge; one matrix per component of n.
    own: [DMatrix<f64>; 3],
    /// The same with the shape functions of the nodes opposite.
    mixed: [DMatrix<f64>; 3],
    /// int b g dA, and int b (n - n_1) dA by component, n_1 at the edge's first node.
    gap: DVector<f64>,
    mean: [DVector<f64>; 3],
    /// Share of each node's B, integrated over the whole edge, that has a partner.
    shares: Vec<f64>,
    /// Partners reach the edge's ends.
    reaches: [bool; 2],
}

impl<'a> Overlap<'a> {
    /// Integrates over facet `f`; `None` where it has no partner.
    fn new(segments: &Segments, surface: &'a Surface, mortar: &Surface, f: usize) -> Option<Self> {
        let edge = Edge::new(surface, f);
        let n = edge.nodes().len();
        let found = segments.of(&edge);
        let total: f64 = found.iter().map(|s| s.span[1] - s.span[0]).sum();
        let (first, last) = (found.first()?, found.last()?);
        if total <= 2.0 * COORDINATES {
            return None;
        }
        let span = [first.span[0], last.span[1]];
        let mut opposite: Vec<u32> =
            found.iter().flat_map(|s| mortar.facets[s.facet].iter().copied()).collect();
        opposite.sort_unstable();
        opposite.dedup();
        let mut mean = [(); 3].map(|()| DVector::zeros(n));
        let mut part = Part::new(n, span);
        let zeros = |columns: usize| [(); 3].map(|()| DMatrix::zeros(n, columns));
        let (mut own, mut mixed, mut gap) = (zeros(n), zeros(opposite.len()), DVector::zeros(n));
        for segment in &found {
            let nodes = &mortar.facets[segment.facet];
            let columns: Vec<usize> =
                nodes.iter().filter_map(|node| opposite.binary_search(node).ok()).collect();
            let half = 0.5 * (segment.span[1] - segment.span[0]);
            let facing = [surface, mortar];
            // Normal field, place on the mortar facet, and distance between the curves.
            let meet = |xi: f64| {
                let (field, x) = (edge.normal(xi), edge.point(xi));
                let (eta, distance) = segments.opposite(segment.facet, &x, &field)?;
                let distance = clearance(facing, [f, segment.facet], [xi, eta], [&x, &field], distance);
                Some((field, eta, distance))
            };
            let is_curved = surface.cambers[f].is_some() || mortar.cambers[segment.facet].is_some();
            let straight = (is_curved && n == 2 && nodes.len() == 2)
                .then(|| segment.span.map(|xi| meet(xi).map(|(.., distance)| distance)));
            for (at, weight) in GAUSS6 {
                let xi = segment.span[0] + half * (1.0 + at);
                let Some((field, eta, distance)) = meet(xi) else { continue };
                let distance = match straight {
                    Some([Some(a), Some(b)]) => 0.5 * ((1.0 - at) * a + (1.0 + at) * b),
                    _ => distance,
                };
                let normal = match mortar.rigid {
                    true => along_rigid(&field, &unit(&mortar.area_vector(segment.facet, eta))),
                    false => field,
                };
                let area = weight * half * edge.stretch(xi);
                let b = part.basis(xi);
                part.add(&b, area);
                gap.axpy(area * distance, &b, 1.0);
                let ((shape, _), (own_shape, _)) = (line_shape(nodes.len(), eta), line_shape(n, xi));
                let (own_vectors, vectors) = match conforming(facing, [f, segment.facet]) {
                    true => {
                        let opposite = normals::along(mortar, segment.facet).map(|n| n.map(|c| -c));
                        (
                            in_the_round(&normal, &own_shape, &edge.normals, n),
                            in_the_round(&normal, &shape, &opposite, nodes.len()),
                        )
                    }
                    false => ([normal; 3], [normal; 3]),
                };
                for c in 0..3 {
                    mean[c].axpy(area * (normal[c] - edge.normals[0][c]), &b, 1.0);
                    for (i, n_i) in own_shape.into_iter().enumerate().take(n) {
                        own[c].column_mut(i).axpy(area * n_i * own_vectors[i][c], &b, 1.0);
                    }
                    for ((k, &column), n_k) in columns.iter().enumerate().zip(shape) {
                        mixed[c].column_mut(column).axpy(area * n_k * vectors[k][c], &b, 1.0);
                    }
                }
            }
        }
        let mut whole = vec![0.0; n];
        for (xi, weight) in GAUSS6 {
            let b = dual::bernstein(n, xi);
            whole.iter_mut().zip(b).for_each(|(sum, b)| *sum += weight * edge.stretch(xi) * b);
        }
        let shares = part.areas().iter().zip(whole).map(|(area, whole)| area / whole).collect();
        let reaches = [span[0] <= -1.0 + 2.0 * COORDINATES, span[1] >= 1.0 - 2.0 * COORDINATES];
        Some(Overlap { edge, part, opposite, own, mixed, gap, mean, shares, reaches })
    }

    /// The edge's two end nodes.
    fn ends(&self) -> impl Iterator<Item = u32> + use<'a> {
        self.edge.nodes().iter().copied().take(2)
    }

    /// Adds the edge's integrals to those of its nodes' rows.
    fn add_to(&self, sums: &mut BTreeMap<u32, Sums>, dual: &Dual) {
        let nodes = self.edge.nodes();
        let own = self.own.each_ref().map(|m| &dual.functions * m);
        let mixed = self.mixed.each_ref().map(|m| &dual.functions * m);
        let gap = &dual.functions * &self.gap;
        // D_j as the functions themselves give it, so that round-off in them cancels.
        let area = &dual.functions * self.part.total();
        let mean = self.mean.each_ref().map(|m| &dual.functions * m);
        let add = |sum: &mut [f64; 3], m: &[DMatrix<f64>; 3], at: (usize, usize), sign: f64| {
            (0..3).for_each(|c| sum[c] += sign * m[c][at]);
        };
        for (k, &i) in dual.nodes.iter().enumerate() {
            let sum = sums.entry(nodes[i]).or_default();
            sum.area += area[k];
            sum.gap += gap[k];
            (0..3).for_each(|c| sum.mean[c] += area[k] * self.edge.normals[0][c] + mean[c][k]);
            sum.normal = combine([(1.0, &sum.normal), (dual.area[k], &self.edge.normals[i])]);
            for (j, &node) in nodes.iter().enumerate() {
                add(sum.terms[0].entry(node).or_default(), &own, (k, j), 1.0);
            }
            for (j, &node) in self.opposite.iter().enumerate() {
                add(sum.terms[1].entry(node).or_default(), &mixed, (k, j), -1.0);
            }
        }
    }
}

/// True if two facets stand for curves that lie in each other, as a pin in its hole.
fn conforming([own, mortar]: [&Surface; 2], [f, g]: [usize; 2]) -> bool {
    let bulge = |surface: &Surface, f: usize| surface.cambers[f].map_or(0.0, |c| c.half_angle);
    !mortar.rigid && bulge(own, f) * bulge(mortar, g) < 0.0
}

/// What the nodes' displacements are multiplied with, beside the shape functions N, to give that of the curve along `normal`.
///
/// Between nodes that move radially by the same u a straight facet moves by only n . sum N_i n_i u = |m| u, m = sum N_i n_i, and
/// meshes that do not match leave gaps of u times the sagitta over the radius, which single elements resist. The radial
/// parts, sum N_i n_i . u_i / |m|, are as much too large. The mean of both, (n + n_i / |m|) / 2, is right to fourth order in
/// the angle, and exact for rigid motions of a circle. `facing` are the nodes' normals n_i, turned together to make m point along
/// `normal`: the rows' vectors then add up to it. Quadratic facets need no such care.
fn in_the_round(
    normal: &[f64; 3],
    shape: &[f64; 3],
    facing: &[[f64; 3]; 3],
    n_nodes: usize,
) -> [[f64; 3]; 3] {
    if n_nodes != 2 {
        return [*normal; 3];
    }
    let m = combine(shape.iter().copied().zip(facing).take(n_nodes));
    let size2 = dot(&m, &m);
    // Of the turn from m to the normal, over |m|.
    let (cos, sin) = (dot(&m, normal) / size2, (m[0] * normal[1] - m[1] * normal[0]) / size2);
    facing.map(|n| {
        let turned = [cos * n[0] - sin * n[1], sin * n[0] + cos * n[1], 0.0];
        combine([(0.5, normal), (0.5, &turned)])
    })
}

/// What a displacement is multiplied with to give the change of the distance along `normal` from a rigid surface whose
/// normal is `other`: a point that slides along that surface comes no nearer.
fn along_rigid(normal: &[f64; 3], other: &[f64; 3]) -> [f64; 3] {
    let cosine = dot(normal, other);
    other.map(|c| c / cosine)
}

/// Integrals of one row, not yet divided by its area.
#[derive(Default)]
struct Sums {
    terms: [BTreeMap<u32, [f64; 3]>; 2],
    normal: [f64; 3],
    /// int psi n dA: what the vectors of each side add up to.
    mean: [f64; 3],
    gap: f64,
    area: f64,
}

impl Sums {
    fn into_row(self, node: u32, gap: &Gap, thickness: f64) -> Option<Row> {
        if self.area.is_nan() || self.area <= 0.0 {
            return None;
        }
        let gap = match gap {
            Gap::Value(value) => *value,
            Gap::Geometry { offset } => self.gap / self.area + offset,
        };
        let size = NEGLIGIBLE * self.area;
        let mut terms = self.terms.map(|terms| -> Vec<(u32, [f64; 3])> {
            let kept = terms.into_iter().filter(|(_, v)| norm(v) >= size);
            kept.map(|(node, v)| (node, v.map(|c| c / self.area))).collect()
        });
        balance(&mut terms, &self.mean.map(|c| c / self.area));
        Some(Row { node, terms, normal: unit(&self.normal), gap, area: self.area * thickness })
    }
}

/// Makes the vectors add up to `mean` on the multiplier side and to its opposite on the other to round-off, as their
/// integrals do, however much cancels in them: action equals reaction, and rigid motion is exact.
fn balance(terms: &mut [Vec<(u32, [f64; 3])>; 2], mean: &[f64; 3]) {
    for (side, sign) in std::iter::zip(terms, [1.0, -1.0]) {
        let sum = combine(side.iter().map(|(_, v)| (1.0, v)));
        let missing = sub(&mean.map(|m| sign * m), &sum);
        if let Some((_, v)) = side.iter_mut().max_by(|a, b| norm(&a.1).total_cmp(&norm(&b.1))) {
            *v = combine([(1.0, &*v), (1.0, &missing)]);
        }
    }
}

/// Which nodes of each edge carry a multiplier.
///
/// Those a sufficient share of whose B has a partner and that are not `taken`. An edge that would have none, or a connected part with a
/// single one (which could not transmit a moment), keeps the ends of its edges: a linear pressure.
fn carriers(edges: &[Overlap], taken: &dyn Fn(u32) -> bool) -> Vec<Vec<bool>> {
    let mut share: BTreeMap<u32, f64> = BTreeMap::new();
    for edge in edges {
        for (&node, &s) in edge.edge.nodes().iter().zip(&edge.shares) {
            let largest = share.entry(node).or_default();
            *largest = larger(*largest, s);
        }
    }
    let mut carry: BTreeMap<u32, bool> =
        share.into_iter().map(|(node, s)| (node, s >= CARRIES && !taken(node))).collect();
    for edge in edges {
        if !edge.edge.nodes().iter().any(|node| carry[node]) {
            carry.extend(edge.ends().map(|node| (node, true)));
        }
    }
    // Edges joined by a node that partners reach from both sides.
    let mut joint: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (e, edge) in edges.iter().enumerate() {
        for (&node, reached) in edge.edge.nodes().iter().zip(edge.reaches) {
            if reached {
                joint.entry(node).or_default().push(e);
            }
        }
    }
    let mut seen = vec![false; edges.len()];
    for start in 0..edges.len() {
        let mut connected = Vec::new();
        let mut next = vec![start];
        while let Some(e) = next.pop() {
            if std::mem::replace(&mut seen[e], true) {
                continue;
            }
            connected.push(e);
            next.extend(edges[e].edge.nodes().iter().filter_map(|node| joint.get(node)).flatten());
        }
        let mut nodes: Vec<u32> = connected.iter().flat_map(|&e| edges[e].edge.nodes()).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        if nodes.iter().filter(|node| carry[node]).count() < 2 {
            carry.extend(connected.iter().flat_map(|&e| edges[e].ends()).map(|node| (node, true)));
        }
    }
    edges.iter().map(|e| e.edge.nodes().iter().map(|node| carry[node]).collect()).collect()
}
