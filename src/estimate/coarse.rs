//! What the partner of a contact surface cannot follow because its mesh is coarser.
//!
//! The stresses of a mesh that is coarse against the contact do not show what it leaves out. But near the surface every
//! body is a half-plane, which forces R per thickness t push in by -2 / (pi E' t) ln|x - y| R, and a mesh with nodes at
//! distances h answers forces and displacements as if each were spread over c h around its node. What the partner should
//! give way to, with the forces where the finer surface has them, less what it does give way to, with the forces at its
//! own nodes, is the error of its compliance.
use crate::contact::{
    Row, Surface,
    vector::{dot, norm, sub},
};
use std::{collections::BTreeMap, f64::consts::PI};

/// What -ln d stands for at a node's own force, d in facets: on linear facets ln 2 pi, with which the sum over equal facets
/// is the integral; at the ends of quadratic facets what a square mesh of quad8 answers to a force there (measured; at other
/// nodes it answers -ln d), in their middles so that the sum is the integral again: 4 middle + end = 5 ln 2 pi + 4 ln 2.
const OWN_LINEAR: f64 = 1.837_877_066_409_345_3;
const OWN_END: f64 = 2.85;
const OWN_MIDDLE: f64 = (5.0 * OWN_LINEAR + 4.0 * std::f64::consts::LN_2 - OWN_END) / 4.0;

/// The nodes of a contact surface.
#[derive(Debug, Clone, Default)]
pub struct Grain {
    points: Vec<[f64; 3]>,
    /// -ln d of each node's own force, d in m.
    own: Vec<f64>,
}

/// A force at a node, N, and the same of the dual solution.
struct Loaded {
    node: usize,
    forces: [f64; 2],
}

impl Grain {
    /// Of a surface.
    pub fn new(surface: &Surface) -> Grain {
        let n = surface.nodes.len();
        let (mut sum, mut count, mut constant) = (vec![0.0; n], vec![0.0; n], vec![OWN_LINEAR; n]);
        for facet in &surface.facets {
            let ends = [facet[0], facet[1]].map(|i| &surface.points[i as usize]);
            for (k, &node) in facet.iter().enumerate() {
                sum[node as usize] += norm(&sub(ends[0], ends[1]));
                count[node as usize] += 1.0;
                if facet.len() == 3 {
                    constant[node as usize] = if k == 2 { OWN_MIDDLE } else { OWN_END };
                }
            }
        }
        let mean = std::iter::zip(sum, count).map(|(sum, count): (f64, f64)| sum / count);
        let own = std::iter::zip(mean, constant).map(|(h, c)| c - h.ln()).collect();
        Grain { points: surface.points.clone(), own }
    }

    /// -sum f_i ln d_ij m_j of forces f and dual ones m.
    fn energy(&self, loaded: &[Loaded]) -> f64 {
        let mut sum = 0.0;
        for a in loaded {
            for b in loaded {
                let between = sub(&self.points[a.node], &self.points[b.node]);
                let distance2 = dot(&between, &between);
                let kernel = if distance2 > 0.0 { -0.5 * distance2.ln() } else { self.own[a.node] };
                sum += a.forces[0] * b.forces[1] * kernel;
            }
        }
        sum
    }
}

/// Change of the function that the dual forces of `forces` are of, were the partner able to follow the forces of the rows.
/// `grain`: of the side with the multipliers; `stiffness`: E' t of that side and of the partner, N/m.
pub fn missing(rows: &[Row], grain: &Grain, forces: [&[f64]; 2], stiffness: [f64; 2]) -> f64 {
    let share = |row: &Row, v: &[f64; 3]| -dot(v, &row.normal);
    // Per node of the partner: area, and the two forces.
    let mut nodes: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
    for (j, row) in rows.iter().enumerate() {
        for (node, v) in &row.terms[1] {
            let sums = nodes.entry(*node).or_default();
            let each = [row.area, forces[0][j], forces[1][j]];
            std::iter::zip(sums, each).for_each(|(sum, value)| *sum += share(row, v) * value);
        }
    }
    let mut left: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
    for (j, row) in rows.iter().enumerate() {
        let mut own = [forces[0][j], forces[1][j]];
        for (node, v) in &row.terms[1] {
            let [area, f, m] = nodes[node];
            if area > 0.0 {
                let part = share(row, v) * row.area / area;
                own = [own[0] - part * f, own[1] - part * m];
            }
        }
        for (node, v) in row.terms[0].iter().filter(|_| own != [0.0; 2]) {
            let sums = left.entry(*node as usize).or_default();
            std::iter::zip(sums, own).for_each(|(sum, value)| *sum += dot(v, &row.normal) * value);
        }
    }
    let left: Vec<Loaded> = left.into_iter().map(|(node, forces)| Loaded { node, forces }).collect();
    let followed = stiffness[1] / (stiffness[0] + stiffness[1]);
    followed * 2.0 / (PI * stiffness[1]) * grain.energy(&left)
}
