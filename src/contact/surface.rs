//! A contact surface: its nodes in order, normals, facets, tributary areas.
use super::{
    Camber,
    vector::{combine, norm, sub},
};
use crate::mesh::{Facet, Mesh};
use std::collections::HashMap;

/// One side of a contact pair, as geometry. In two dimensions a chain (or several) of edges.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Mesh node of each surface node; ordered along the surface, the body to the left.
    pub nodes: Vec<u32>,
    /// Node coordinates, m.
    pub points: Vec<[f64; 3]>,
    /// Outward unit normals at the nodes: weighted means of the adjacent facets' normals, see `normals.rs`.
    pub normals: Vec<[f64; 3]>,
    /// Arc length from the first node, m.
    pub s: Vec<f64>,
    /// Facets as indices into `nodes`: the two ends and, if quadratic, the mid-side node.
    pub facets: Vec<Vec<u32>>,
    /// The curve that each facet stands for; `None`: its own.
    pub cambers: Vec<Option<Camber>>,
    /// Nodes where the surface has a corner, however it is deformed.
    pub corners: Vec<bool>,
    /// Tributary area of each node, int N_i t ds, m2.
    pub weights: Vec<f64>,
    /// True if no deformation can change the shape: the normals are exact, whatever is pressed against it.
    pub rigid: bool,
}

/// Shape functions of a two- or three-node line at `xi` in [-1, 1], and their derivatives.
pub fn line_shape(n_nodes: usize, xi: f64) -> ([f64; 3], [f64; 3]) {
    match n_nodes {
        2 => ([0.5 * (1.0 - xi), 0.5 * (1.0 + xi), 0.0], [-0.5, 0.5, 0.0]),
        _ => ([0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi * xi], [xi - 0.5, xi + 0.5, -2.0 * xi]),
    }
}

impl Surface {
    /// The surface made of `facets` of `mesh`; `thickness` scales the tributary areas.
    pub fn new(mesh: &Mesh, facets: &[Facet], thickness: f64) -> Surface {
        let mut surface = Surface::default();
        let mut local: HashMap<u32, u32> = HashMap::new();
        let mut length = 0.0;
        for facet in in_order(mesh, facets) {
            let global: Vec<u32> = mesh.facet_nodes(facet).collect();
            let points: Vec<[f64; 3]> = global.iter().map(|&g| mesh.points[g as usize]).collect();
            // Along the chain: start, middle, end.
            let (arc, total) = arc_lengths(&points);
            let order: &[usize] = if global.len() == 3 { &[0, 2, 1] } else { &[0, 1] };
            for &i in order {
                local.entry(global[i]).or_insert_with(|| {
                    surface.nodes.push(global[i]);
                    surface.points.push(points[i]);
                    surface.s.push(length + arc[i]);
                    surface.nodes.len() as u32 - 1
                });
            }
            length += total;
            surface.facets.push(global.iter().map(|g| local[g]).collect());
            surface.cambers.push(Camber::of_mesh(mesh, [global[0], global[1]]));
        }
        surface.corners = super::normals::corners(&surface);
        surface.measured(thickness)
    }

    /// A surface of its own: `points` and `facets` in order, the body to the left; `thickness` as in [`Surface::new`].
    /// Straight facets of a `smooth` one stand for the curve through its nodes.
    pub(super) fn from_points(
        points: Vec<[f64; 3]>,
        facets: Vec<Vec<u32>>,
        thickness: f64,
        smooth: bool,
    ) -> Surface {
        let mut surface =
            Surface { nodes: (0..points.len() as u32).collect(), points, facets, ..Self::default() };
        surface.s = vec![0.0; surface.nodes.len()];
        let mut length = 0.0;
        for facet in &surface.facets {
            let corners: Vec<[f64; 3]> = facet.iter().map(|&i| surface.points[i as usize]).collect();
            let (arc, total) = arc_lengths(&corners);
            for (&node, at) in facet.iter().zip(arc) {
                // The first node of a closed surface keeps zero.
                if node > 0 {
                    surface.s[node as usize] = length + at;
                }
            }
            length += total;
        }
        surface.cambers = match smooth {
            true => Camber::of_nodes(&surface.points, &surface.facets),
            false => vec![None; surface.facets.len()],
        };
        surface.corners = super::normals::corners(&surface);
        surface.measured(thickness)
    }

    /// The surface with its nodes moved by `u`, m, one displacement per surface node: normals and tributary areas
    /// are those of the new positions, `s` remains the arc length before the motion. The curves keep their heights over the
    /// facets: they move with them.
    pub fn moved(&self, u: &[[f64; 3]]) -> Surface {
        let points = self.points.iter().zip(u).map(|(x, u)| combine([(1.0, x), (1.0, u)])).collect();
        let length: f64 = (0..self.facets.len()).flat_map(|f| self.areas(f)).map(|(_, area)| area).sum();
        let thickness = if length > 0.0 { self.weights.iter().sum::<f64>() / length } else { 1.0 };
        // The mid-side node of a quadratic facet moves with it: from then on the curve is the facet's own.
        let own = |(facet, camber): (&Vec<u32>, &Option<Camber>)| camber.filter(|_| facet.len() == 2);
        let cambers = std::iter::zip(&self.facets, &self.cambers).map(own).collect();
        Surface { points, cambers, ..self.clone() }.measured(thickness)
    }

    /// Computes normals and tributary areas from points and facets.
    fn measured(mut self, thickness: f64) -> Surface {
        self.normals = super::normals::nodal(&self);
        self.weights = vec![0.0; self.nodes.len()];
        for f in 0..self.facets.len() {
            for (xi, area) in self.areas(f) {
                let (n, _) = line_shape(self.facets[f].len(), xi);
                for (i, &node) in self.facets[f].iter().enumerate() {
                    self.weights[node as usize] += n[i] * area * thickness;
                }
            }
        }
        self
    }

    /// Gauss points of facet `f` and the length each stands for, m.
    fn areas(&self, f: usize) -> [(f64, f64); 3] {
        GAUSS3.map(|(xi, weight)| (xi, weight * norm(&self.area_vector(f, xi))))
    }

    /// Point of facet `f` at `xi`.
    pub fn point(&self, f: usize, xi: f64) -> [f64; 3] {
        let (n, _) = line_shape(self.facets[f].len(), xi);
        combine(self.facets[f].iter().enumerate().map(|(i, &node)| (n[i], &self.points[node as usize])))
    }

    /// dx/dxi of facet `f` at `xi`.
    pub fn tangent(&self, f: usize, xi: f64) -> [f64; 3] {
        let (_, dn) = line_shape(self.facets[f].len(), xi);
        combine(self.facets[f].iter().enumerate().map(|(i, &node)| (dn[i], &self.points[node as usize])))
    }

    /// Outward normal times ds/dxi: the tangent turned clockwise, since the body lies to its left.
    pub fn area_vector(&self, f: usize, xi: f64) -> [f64; 3] {
        let t = self.tangent(f, xi);
        [t[1], -t[0], 0.0]
    }

    /// Distance between the ends of facet `f`, m.
    pub fn facet_size(&self, f: usize) -> f64 {
        let ends = &self.facets[f];
        norm(&sub(&self.points[ends[1] as usize], &self.points[ends[0] as usize]))
    }

    /// Length of a surface that closes on itself, in one chain, m; `None`: it has ends.
    pub fn closed_length(&self) -> Option<f64> {
        let n = self.facets.len();
        let closes = (0..n).all(|f| self.facets[f][1] == self.facets[(f + 1) % n][0]);
        let length = |facet: &Vec<u32>| {
            let points: Vec<[f64; 3]> = facet.iter().map(|&i| self.points[i as usize]).collect();
            arc_lengths(&points).1
        };
        (n > 1 && closes).then(|| self.facets.iter().map(length).sum())
    }

    /// How far apart points of the surface lie, m, the same in every frame: the distance from the point furthest from the
    /// first one to the point furthest from that.
    pub fn extent(&self) -> f64 {
        let furthest = |from: &[f64; 3]| {
            let distance = |p: &&[f64; 3]| norm(&sub(p, from));
            self.points.iter().max_by(|a, b| distance(a).total_cmp(&distance(b)))
        };
        let ends = self.points.first().and_then(furthest);
        ends.and_then(|from| Some(norm(&sub(furthest(from)?, from)))).unwrap_or(0.0)
    }

    /// Numbers that [`Surface::unpack`] turns back into the surface.
    pub fn pack(&self) -> Vec<f64> {
        let mut out = vec![self.nodes.len() as f64, self.facets.len() as f64];
        for i in 0..self.nodes.len() {
            out.push(f64::from(self.nodes[i]));
            out.extend(self.points[i]);
            out.extend(self.normals[i]);
            out.extend([self.s[i], self.weights[i], f64::from(u8::from(self.corners[i]))]);
        }
        for (facet, camber) in std::iter::zip(&self.facets, &self.cambers) {
            out.push(facet.len() as f64);
            out.extend(facet.iter().map(|&node| f64::from(node)));
            let has = f64::from(u8::from(camber.is_some()));
            let Camber { half_angle, skew, doubt, deduced } = camber.unwrap_or_default();
            out.extend([has, half_angle, skew, doubt, f64::from(u8::from(deduced))]);
        }
        out
    }

    /// Inverse of [`Surface::pack`].
    pub fn unpack(values: &[f64]) -> Surface {
        let mut next = values.iter().copied();
        let mut take = || next.next().unwrap_or(f64::NAN);
        let (n_nodes, n_facets) = (take() as usize, take() as usize);
        let mut surface = Surface::default();
        for _ in 0..n_nodes {
            surface.nodes.push(take() as u32);
            surface.points.push([take(), take(), take()]);
            surface.normals.push([take(), take(), take()]);
            surface.s.push(take());
            surface.weights.push(take());
            surface.corners.push(take() > 0.5);
        }
        for _ in 0..n_facets {
            let n = take() as usize;
            surface.facets.push((0..n).map(|_| take() as u32).collect());
            let has = take() > 0.5;
            let camber = Camber { half_angle: take(), skew: take(), doubt: take(), deduced: take() > 0.5 };
            surface.cambers.push(has.then_some(camber));
        }
        surface
    }
}

/// Three-point Gauss rule on [-1, 1]: exact for the tributary areas of straight quadratic edges.
const GAUSS3: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// Arc length from the start to each node of a facet (ends first, then the middle), and in all.
fn arc_lengths(points: &[[f64; 3]]) -> (Vec<f64>, f64) {
    match points {
        [a, b, m] => {
            let half = norm(&sub(m, a));
            let total = half + norm(&sub(b, m));
            (vec![0.0, total, half], total)
        }
        [a, b, ..] => {
            let total = norm(&sub(b, a));
            (vec![0.0, total], total)
        }
        _ => (vec![0.0; points.len()], 0.0),
    }
}

/// Facets chained end to start; an open chain begins at its free end, a closed one at the first facet given.
fn in_order(mesh: &Mesh, facets: &[Facet]) -> Vec<Facet> {
    let ends = |f: Facet| {
        let mut nodes = mesh.facet_nodes(f);
        (nodes.next().unwrap_or(0), nodes.next().unwrap_or(0))
    };
    let from: HashMap<u32, usize> = facets.iter().enumerate().map(|(i, &f)| (ends(f).0, i)).collect();
    let into: HashMap<u32, usize> = facets.iter().enumerate().map(|(i, &f)| (ends(f).1, i)).collect();
    let free = (0..facets.len()).filter(|&i| !into.contains_key(&ends(facets[i]).0));
    let mut seen = vec![false; facets.len()];
    let mut ordered = Vec::with_capacity(facets.len());
    for start in free.chain(0..facets.len()) {
        let mut at = Some(start);
        while let Some(i) = at.filter(|&i| !seen[i]) {
            seen[i] = true;
            ordered.push(facets[i]);
            at = from.get(&ends(facets[i]).1).copied();
        }
    }
    ordered
}
