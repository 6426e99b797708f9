//! Error of the contact pressure, from the pressures at the nodes of one surface.
//!
//! A nodal pressure is the contact force of the node over its area: a mean of the pressure around the node. Two things
//! show how far it is from the pressure at the node: how much the nodal values scatter about a smooth curve, and how much
//! the mean of that curve around the node differs from its value there. The curve is a parabola through five nodes; of
//! the square of the pressure where the contact ends within the surface, for there p^2 and not p is smooth (Hertz: p =
//! p0 sqrt(1 - x^2/a^2)).
use crate::contact::Surface;
use nalgebra::{DMatrix, DVector};

/// Nodes of a parabola.
const WINDOW: usize = 5;

/// Three-point Gauss rule on [0, 1]: exact to degree 5, a parabola times a quadratic shape function.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Of the node's force when too few nodes touch to say more.
const UNKNOWN: f64 = 1.0;

/// The nodes of a contact surface in their order along it.
#[derive(Debug, Clone, Default)]
pub struct Chain {
    /// Node before and after each node, if any.
    next: Vec<[Option<usize>; 2]>,
    points: Vec<[f64; 3]>,
    /// True for a node in the middle of a facet.
    middle: Vec<bool>,
    /// True if the facets are quadratic.
    quadratic: bool,
}

/// What is known of the pressure at a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// Cannot touch.
    None,
    /// Could touch but does not.
    Open,
    /// Touches.
    Closed,
}

impl Chain {
    /// The chain of a surface.
    pub fn new(surface: &Surface) -> Chain {
        let n = surface.nodes.len();
        let mut chain = Chain {
            next: vec![[None; 2]; n],
            points: surface.points.clone(),
            middle: vec![false; n],
            quadratic: surface.facets.iter().any(|f| f.len() == 3),
        };
        for facet in &surface.facets {
            let along: Vec<usize> = match facet[..] {
                [a, b, m] => {
                    chain.middle[m as usize] = true;
                    vec![a as usize, m as usize, b as usize]
                }
                _ => facet.iter().map(|&n| n as usize).collect(),
            };
            for pair in along.windows(2) {
                chain.next[pair[0]][1] = Some(pair[1]);
                chain.next[pair[1]][0] = Some(pair[0]);
            }
        }
        chain
    }

    /// Estimated error of the pressure at each node that touches, Pa, zero elsewhere.
    pub fn errors(&self, pressure: &[f64], contact: &[Contact]) -> Vec<f64> {
        let mut errors = vec![0.0; pressure.len()];
        let mut seen = vec![false; pressure.len()];
        for node in 0..pressure.len() {
            if contact[node] == Contact::Closed && !seen[node] {
                let run = self.run(node, contact);
                run.nodes.iter().for_each(|&n| seen[n] = true);
                let values: Vec<f64> = run.nodes.iter().map(|&n| pressure[n]).collect();
                for (&n, error) in std::iter::zip(&run.nodes, self.of_run(&run, &values)) {
                    errors[n] = error;
                }
            }
        }
        errors
    }

    /// The connected nodes in contact that a node belongs to.
    fn run(&self, node: usize, contact: &[Contact]) -> Run {
        let touches = |n: &usize| contact[*n] == Contact::Closed;
        let mut first = node;
        while let Some(before) = self.next[first][0].filter(touches).filter(|n| *n != node) {
            first = before;
        }
        let (mut nodes, mut s) = (vec![first], vec![0.0]);
        while let Some(after) = self.next[nodes[nodes.len() - 1]][1].filter(touches).filter(|n| *n != first) {
            let (a, b) = (&self.points[nodes[nodes.len() - 1]], &self.points[after]);
            s.push(s[s.len() - 1] + crate::contact::vector::norm(&crate::contact::vector::sub(a, b)));
            nodes.push(after);
        }
        let opens = |n: usize, side: usize| self.next[n][side].is_some_and(|n| contact[n] == Contact::Open);
        let ends = [opens(first, 0), opens(nodes[nodes.len() - 1], 1)];
        Run { nodes, s, ends }
    }

    fn of_run(&self, run: &Run, p: &[f64]) -> Vec<f64> {
        let n = p.len();
        let moving = run.ends.contains(&true);
        if moving && n < 3 {
            return p.iter().map(|p| UNKNOWN * p.abs()).collect();
        }
        // The last nodes before an edge have its error; they are left out if enough others are there.
        let inner = [usize::from(run.ends[0]), n - usize::from(run.ends[1])];
        let [low, high] = if inner[1] - inner[0] >= WINDOW { inner } else { [0, n] };
        let width = WINDOW.min(high - low);
        let values: Vec<f64> = p.iter().map(|p| if moving { p * p } else { *p }).collect();
        (0..n)
            .map(|j| {
                let start = j.saturating_sub(WINDOW / 2).clamp(low, high - width);
                let window = start..start + width;
                // A parabola through three nodes would leave nothing.
                let degree = if moving || width > 3 { 2 } else { 1 }.min(width - 1);
                let parabola = parabola(&run.s[window.clone()], &values[window], run.s[j], degree);
                let at = |s: f64| {
                    let value = parabola(s);
                    if moving { value.max(0.0).sqrt() } else { value }
                };
                let scatter = p[j] - at(run.s[j]);
                let mean = self.mean_around(run, j, &at) - at(run.s[j]);
                scatter.hypot(mean)
            })
            .collect()
    }

    /// Mean of a function around node `j` of a run with the weights that make a nodal pressure of a pressure: the hat
    /// functions, or Bernstein's polynomials on quadratic facets.
    fn mean_around(&self, run: &Run, j: usize, at: &impl Fn(f64) -> f64) -> f64 {
        let n = run.nodes.len();
        let is_middle = self.middle[run.nodes[j]];
        let reach = if self.quadratic && !is_middle { 2 } else { 1 };
        let s = &run.s;
        let (mut sum, mut total) = (0.0, 0.0);
        let mut add = |from: f64, to: f64, weight: &dyn Fn(f64) -> f64| {
            for (t, w) in GAUSS {
                let w = w * weight(t) * (to - from).abs();
                sum += w * at(from + t * (to - from));
                total += w;
            }
        };
        if is_middle {
            let (from, to) = (s[j.saturating_sub(1)], s[(j + 1).min(n - 1)]);
            add(from, to, &|t| t * (1.0 - t));
        } else {
            let weight = |t: f64| if self.quadratic { (1.0 - t).powi(2) } else { 1.0 - t };
            add(s[j], s[j.saturating_sub(reach)], &weight);
            add(s[j], s[(j + reach).min(n - 1)], &weight);
        }
        if total > 0.0 { sum / total } else { at(s[j]) }
    }
}

/// Connected nodes in contact.
struct Run {
    nodes: Vec<usize>,
    /// Length along the surface, m.
    s: Vec<f64>,
    /// True if the neighbour beyond the first, and the last, node is open: the contact ends within the surface.
    ends: [bool; 2],
}

/// The polynomial of this degree that fits values best, about `center`.
fn parabola(s: &[f64], values: &[f64], center: f64, degree: usize) -> impl Fn(f64) -> f64 {
    let size = s.iter().map(|s| (s - center).abs()).fold(0.0, f64::max);
    let size = if size > 0.0 { size } else { 1.0 };
    let matrix = DMatrix::from_fn(s.len(), degree + 1, |i, k| ((s[i] - center) / size).powi(k as i32));
    let fitted = matrix.clone().qr();
    let rhs = fitted.q().transpose() * DVector::from_column_slice(values);
    let solution = fitted.r().solve_upper_triangular(&rhs).unwrap_or_else(|| DVector::zeros(degree + 1));
    move |at: f64| solution.iter().rev().fold(0.0, |sum, c| sum * (at - center) / size + c)
}

/// Largest of the errors at the nodes whose pressure is at least [`PEAK`] of the largest, relative to that; `None` if
/// there is no pressure.
pub fn relative(pressure: &[f64], errors: &[f64]) -> Option<f64> {
    let peak = pressure.iter().copied().fold(0.0, f64::max);
    let near = std::iter::zip(pressure, errors).filter(|(p, _)| **p >= PEAK * peak).map(|(_, e)| *e);
    (peak > 0.0).then(|| near.fold(0.0, f64::max) / peak)
}

/// Share of the largest pressure from which a node belongs to the peak: on a Hertz contact |x| <= 0.6 a. The error at the
/// edge of a contact, which falls with the root of the element size, is no error of the peak.
pub const PEAK: f64 = 0.8;
