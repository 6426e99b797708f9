//! Error of the contact pressure, from the pressures at the nodes of one surface.
//!
//! A nodal pressure is the contact force of the node over its area: a mean of the pressure around the node. Two things
//! show how far it is from the pressure at the node: how much the nodal values scatter about a smooth curve, and how much
//! the mean of that curve around the node differs from its value there. The larger is the estimate. The curve is a
//! parabola fitted to five nodes; of the square of the pressure where the contact ends within the surface, for there p^2
//! and not p is smooth (Hertz: p = p0 sqrt(1 - x^2/a^2)).
use crate::contact::Surface;
use crate::vector::larger;
use nalgebra::{DMatrix, DVector};

/// Nodes of a parabola.
const WINDOW: usize = 5;

/// Weight of the last node of a surface in the parabolas next to it.
const END: f64 = 0.1;

/// Three-point Gauss rule on [0, 1]: exact to degree 5, a parabola times a quadratic shape function.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Share of the difference between mean and pressure that linear elements leave: the displacements at their nodes make up
/// for the rest (measured on Hertz contacts, 0.4 to 0.6 at 2 to 16 quad4 per half-width).
const MADE_UP: f64 = 0.5;

/// A curve that has more of a node than this goes through it.
const FOLLOWED: f64 = 0.99;

/// Share of the pressure that is in doubt when too few nodes touch to say more.
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

/// Pressure at a node as it should be, Pa.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NodalPressure {
    /// Estimated error of the nodal pressure, not negative.
    pub error: f64,
    /// Value of the smooth curve.
    pub smooth: f64,
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

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.next.len()
    }

    /// True without nodes.
    pub fn is_empty(&self) -> bool {
        self.next.is_empty()
    }

    /// Estimated errors of the pressures at the nodes that touch, Pa; zero elsewhere.
    pub fn errors(&self, pressure: &[f64], contact: &[Contact]) -> Vec<NodalPressure> {
        let mut errors = vec![NodalPressure::default(); pressure.len()];
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

    /// Errors of the pressures `p` of a run, and the pressures of the smooth curve.
    fn of_run(&self, run: &Run, p: &[f64]) -> Vec<NodalPressure> {
        let n = p.len();
        let moving = run.ends.contains(&true);
        let least = if self.quadratic { WINDOW } else { WINDOW / 2 + 1 };
        if moving && n < least {
            return p.iter().map(|&p| NodalPressure { error: UNKNOWN * p.abs(), smooth: p }).collect();
        }
        let values: Vec<f64> = p.iter().map(|p| if moving { p * p } else { *p }).collect();
        // Nodes at the ends have errors of their own, which they would bend the curve with.
        let least = if moving { WINDOW } else { 2 };
        let [low, high] = if n >= least + 2 { [1, n - 1] } else { [0, n] };
        let width = WINDOW.min(high - low);
        let degree = match width {
            WINDOW.. => 2,
            _ if moving => 2,
            // Through three nodes a parabola would leave nothing of what scatters.
            _ => 1.min(width - 1),
        };
        (0..n)
            .map(|j| {
                let start = j.saturating_sub(WINDOW / 2).clamp(low, high - width);
                let mut nodes: Vec<(usize, f64)> = (start..start + width).map(|i| (i, 1.0)).collect();
                for (end, next) in [(0, 1), (n - 1, n.saturating_sub(2))] {
                    let is_left_out = !(low..high).contains(&end) && (start..start + width).contains(&next);
                    if is_left_out && !moving {
                        nodes.push((end, END));
                    }
                }
                let (curve, leverage) = polynomial(&nodes, &run.s, &values, j, degree);
                let at = |s: f64| if moving { curve(s).max(0.0).sqrt() } else { curve(s) };
                let smooth = at(run.s[j]);
                let (mut scatter, mut mean) = (p[j] - smooth, self.mean_around(run, j, &at) - smooth);
                if !self.quadratic {
                    // The curve has followed the node's own error; on quadratic facets, whose errors alternate between ends
                    // and middles, it does not.
                    scatter /= (1.0 - leverage).sqrt();
                    mean *= MADE_UP;
                }
                NodalPressure { error: larger(scatter.abs(), mean.abs()), smooth }
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

/// The polynomial of this degree that fits the values of `nodes` (with weights) best, as a function of s, and the share of
/// its own value that it has at the `wanted` node; none where it goes through it and says nothing.
fn polynomial(
    nodes: &[(usize, f64)],
    s: &[f64],
    values: &[f64],
    wanted: usize,
    degree: usize,
) -> (impl Fn(f64) -> f64, f64) {
    let center = s[wanted];
    let size = nodes.iter().map(|(i, _)| (s[*i] - center).abs()).fold(0.0, larger);
    let size = if size > 0.0 { size } else { 1.0 };
    let matrix = DMatrix::from_fn(nodes.len(), degree + 1, |r, k| {
        let (i, weight) = nodes[r];
        weight.sqrt() * ((s[i] - center) / size).powi(k as i32)
    });
    let rhs = DVector::from_iterator(nodes.len(), nodes.iter().map(|&(i, weight)| weight.sqrt() * values[i]));
    let factors = matrix.qr();
    let q = factors.q();
    let solution = factors.r().solve_upper_triangular(&(q.transpose() * rhs));
    let solution = solution.unwrap_or_else(|| DVector::zeros(degree + 1));
    let own = nodes.iter().position(|(i, _)| *i == wanted);
    let leverage = own.map_or(0.0, |r| q.row(r).norm_squared());
    let curve = move |at: f64| solution.iter().rev().fold(0.0, |sum, c| sum * (at - center) / size + c);
    (curve, if leverage < FOLLOWED { leverage } else { 0.0 })
}

/// Largest of the errors at the nodes whose pressure is at least [`PEAK`] of the largest, relative to the largest of the
/// smooth curves there; `None` if there is no pressure.
pub fn relative(pressure: &[f64], errors: &[NodalPressure]) -> Option<f64> {
    let peak = pressure.iter().copied().fold(0.0, larger);
    if peak <= 0.0 {
        return None;
    }
    let near = std::iter::zip(pressure, errors).filter(|(p, _)| **p >= PEAK * peak);
    let (error, smooth) =
        near.fold((0.0_f64, 0.0_f64), |(e, s), (_, node)| (larger(e, node.error), larger(s, node.smooth)));
    Some(error / if smooth > 0.0 { smooth } else { peak })
}

/// Share of the largest pressure from which a node belongs to the peak: on a Hertz contact |x| <= 0.6 a. The error at the
/// edge of a contact, which falls with the root of the element size, is no error of the peak.
pub const PEAK: f64 = 0.8;

#[cfg(test)]
mod tests {
    use super::*;
    use Contact::{Closed, Open};

    /// Nodes on a line from -1 to 1, in facets of `width` steps.
    fn chain(n: usize, width: usize) -> (Chain, Vec<f64>) {
        let x: Vec<f64> = (0..n).map(|i| -1.0 + 2.0 * i as f64 / (n - 1) as f64).collect();
        let facet = |first: u32| match width {
            2 => vec![first, first + 2, first + 1],
            _ => vec![first, first + 1],
        };
        let surface = Surface {
            nodes: (0..n as u32).collect(),
            points: x.iter().map(|&x| [x, 0.0, 0.0]).collect(),
            facets: (0..n as u32 - 1).step_by(width).map(facet).collect(),
            ..Surface::default()
        };
        (Chain::new(&surface), x)
    }

    fn estimate(chain: &Chain, pressure: &[f64], contact: &[Contact]) -> Option<f64> {
        relative(pressure, &chain.errors(pressure, contact))
    }

    #[test]
    fn uniform_pressures_have_no_error() {
        for width in [1, 2] {
            for n in [3, 5, 7, 21] {
                let (chain, x) = chain(n, width);
                let found = estimate(&chain, &vec![7.0; x.len()], &vec![Closed; n]).unwrap();
                assert!(found < 1e-13, "{n} {width}: {found:e}");
            }
        }
        let (open, _) = chain(5, 1);
        assert_eq!(estimate(&open, &[0.0; 5], &[Open; 5]), None);
    }

    /// Means over the hats of p = sqrt(1 - (x / 0.8)^2), off by h^2 / 12 p'' at the peak; linear elements make up for half.
    #[test]
    fn the_mean_of_a_peak_is_too_low_by_what_is_estimated() {
        let (chain, x) = chain(41, 1);
        let h = 2.0 / 40.0;
        let exact = |x: f64| (1.0 - (x / 0.8).powi(2)).max(0.0).sqrt();
        let mean = |x: f64| {
            let points = (-200..=200).map(|i| f64::from(i) / 200.0);
            let (sum, total) = points.fold((0.0, 0.0), |(s, t), u| {
                let weight = 1.0 - u.abs();
                (s + weight * exact(x + h * u), t + weight)
            });
            sum / total
        };
        let p: Vec<f64> = x.iter().map(|&x| if x.abs() < 0.8 { mean(x) } else { 0.0 }).collect();
        let contact: Vec<Contact> = p.iter().map(|p| if *p > 0.0 { Closed } else { Open }).collect();
        let errors = chain.errors(&p, &contact);
        let measured = MADE_UP * (exact(0.0) - p[20]);
        assert!((errors[20].error / measured - 1.0).abs() < 0.02, "{:e} {measured:e}", errors[20].error);
        let found = relative(&p, &errors).unwrap();
        let peak = (0..41).filter(|&i| p[i] >= PEAK * p[20]).map(|i| (p[i] - exact(x[i])).abs());
        let measured = MADE_UP * peak.fold(0.0, larger);
        assert!((0.8..1.25).contains(&(found / measured)), "{found:e} {measured:e}");
    }

    #[test]
    fn a_node_that_is_off_is_seen() {
        let (chain, x) = chain(21, 1);
        let mut p: Vec<f64> = x.iter().map(|x| 5.0 + x).collect();
        // A linear pressure has the error of the means at the ends alone, a third of the slope times the size, half made up.
        let alone = chain.errors(&p, &[Closed; 21]);
        assert!(
            alone[1..20].iter().all(|e| e.error < 1e-12)
                && (alone[0].error - MADE_UP * 0.1 / 3.0).abs() < 1e-12
        );
        p[10] += 0.3;
        let error = chain.errors(&p, &[Closed; 21])[10].error;
        assert!((0.15..=0.3).contains(&error), "{error}");
    }

    #[test]
    fn few_nodes_say_nothing() {
        let (chain, _) = chain(7, 1);
        let contact = [Open, Open, Closed, Closed, Open, Open, Open];
        assert_eq!(estimate(&chain, &[0.0, 0.0, 1.0, 0.9, 0.0, 0.0, 0.0], &contact), Some(UNKNOWN));
    }
}
