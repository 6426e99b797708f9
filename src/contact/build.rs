//! How a surface comes to be: from facets of a mesh, from points, or from another by a motion.
use super::{
    Camber, Surface, normals,
    surface::line_shape,
    vector::{combine, norm, sub},
};
use crate::mesh::{Facet, Mesh};
use std::collections::HashMap;

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
        surface.corners = normals::corners(&surface);
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
        surface.corners = normals::corners(&surface);
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
        self.normals = normals::nodal(&self);
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
