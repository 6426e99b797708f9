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
use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::PI,
};

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

/// How much coarser the partner is than the rows in contact: 1 from half as many nodes on, 0 from as many.
pub fn coarseness(rows: &[Row], force: &[f64]) -> f64 {
    let active = || std::iter::zip(rows, force).filter(|(_, f)| **f != 0.0).map(|(row, _)| row);
    let partner: BTreeSet<u32> = active().flat_map(|row| row.terms[1].iter().map(|t| t.0)).collect();
    (2.0 - 2.0 * partner.len() as f64 / active().count().max(1) as f64).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows at n + 1 nodes of [-1, 1] whose partner has a node at every k-th of them.
    fn line(n: usize, k: usize) -> (Vec<Row>, Grain, Vec<f64>) {
        let x: Vec<f64> = (0..=n).map(|i| 2.0 * i as f64 / n as f64 - 1.0).collect();
        let row = |i: usize| {
            let (node, part) = (i / k, (i % k) as f64 / k as f64);
            let share = |node: usize, w: f64| (node as u32, [0.0, -w, 0.0]);
            let mut partner = vec![share(node, 1.0 - part)];
            partner.extend((part > 0.0).then(|| share(node + 1, part)));
            Row {
                node: i as u32,
                terms: [vec![(i as u32, [0.0, 1.0, 0.0])], partner],
                normal: [0.0, 1.0, 0.0],
                gap: 0.0,
                area: if i == 0 || i == n { 1.0 } else { 2.0 } / n as f64,
            }
        };
        let surface = Surface {
            nodes: (0..=n as u32).collect(),
            points: x.iter().map(|&x| [x, 0.0, 0.0]).collect(),
            facets: (0..n as u32).map(|i| vec![i, i + 1]).collect(),
            ..Surface::default()
        };
        ((0..=n).map(row).collect(), Grain::new(&surface), x)
    }

    fn forces(rows: &[Row], x: &[f64], p: impl Fn(f64) -> f64) -> Vec<f64> {
        std::iter::zip(rows, x).map(|(row, x)| row.area * p(*x)).collect()
    }

    #[test]
    fn what_the_partner_can_carry_is_not_missing() {
        let (rows, grain, x) = line(40, 5);
        let [uniform, dual] = [forces(&rows, &x, |_| 3.0), forces(&rows, &x, |x| (7.0 * x).sin() - x)];
        assert!(missing(&rows, &grain, [&uniform, &dual], [1.0, 1.0]).abs() < 1e-12);
        // Nor is anything if it has the same nodes.
        let (rows, grain, x) = line(40, 1);
        let peak = forces(&rows, &x, |x| (1.0 - (x / 0.3).powi(2)).max(0.0).sqrt());
        assert!(missing(&rows, &grain, [&peak, &peak], [1.0, 1.0]).abs() < 1e-12);
        assert_eq!(coarseness(&rows, &peak), 0.0);
    }

    /// A uniform pressure on [-a, a] pushes itself in by 2 / (pi E' t) (3/2 - ln 2a) in the mean, spread over the facets of
    /// length H at a node by 2 / (pi E' t) (ln 2 pi - ln H).
    #[test]
    fn a_force_on_a_small_part_of_a_facet_is_missing() {
        for (k, a) in [(100, 0.0275), (200, 0.0275), (200, 0.0525)] {
            let (rows, grain, x) = line(400, k);
            let force = forces(&rows, &x, |x| if x.abs() <= a { 0.5 / a } else { 0.0 });
            let found = missing(&rows, &grain, [&force, &force], [1e9, 1.0]) * 1e9;
            let facet = k as f64 / 200.0;
            let wanted = 2.0 / PI * ((1.5 - (2.0 * a).ln()) - (OWN_LINEAR - facet.ln()));
            assert!((found / wanted - 1.0).abs() < 0.1, "{k}: {found} {wanted}");
            assert_eq!(coarseness(&rows, &force), 1.0);
        }
    }
}
