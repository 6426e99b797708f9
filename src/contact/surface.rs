//! A contact surface: its nodes in order, normals, facets, tributary areas.
use super::{
    Camber,
    vector::{combine, norm, sub},
};

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
            // As `s` is measured: by way of the mid-side node.
            let way = [&facet[..1], &facet[2..], &facet[1..2]].concat();
            let points: Vec<[f64; 3]> = way.iter().map(|&i| self.points[i as usize]).collect();
            points.windows(2).map(|p| norm(&sub(&p[1], &p[0]))).sum::<f64>()
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
