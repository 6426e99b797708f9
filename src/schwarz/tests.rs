//! The alternation on two bars, where its convergence factors are known in closed form.
//!
//! Bar A of stiffness `km` is fixed, bar B of stiffness `ks` is pushed against it by an overlap D: the contact force is
//! p = D km ks / (km + ks). With the pressures weighted by beta (A's own) and the displacements by w (A's own), the
//! error of the common interface position is multiplied by [beta km - (1 - beta) ks] [w / km - (1 - w) / ks] per
//! alternation.
use super::{
    Alternation, ContactNode, RespondAtNodes, Settings, Side,
    weights::{Both, Weights},
};
use crate::{
    contact::Conjugate,
    error::Result,
    parallel::{Exchange, Partner},
};

/// A bar with one contact node: `u = base - normal p / k`.
struct Bar {
    k: f64,
    normal: f64,
    base: f64,
}

impl RespondAtNodes for Bar {
    fn force_step(&mut self, force: &[f64]) -> Result<Vec<[f64; 3]>> {
        Ok(vec![[self.base - self.normal * force[0] / self.k, 0.0, 0.0]])
    }

    fn displacement_step(&mut self, prescribed: &[Option<f64>]) -> Result<Vec<f64>> {
        Ok(vec![prescribed[0].map_or(0.0, |w| self.k * (self.normal * self.base - w))])
    }
}

/// Where the overlap of 1 comes from.
#[derive(Clone, Copy, PartialEq)]
enum Overlap {
    /// A negative initial gap: displacements are measured from the contact-free state.
    Gap,
    /// The base of B moves: displacements of both surfaces are measured in one frame.
    Push,
}

/// Position error of A's surface after each alternation, started `offset` away from the solution.
fn errors(km: f64, ks: f64, weights: Weights, overlap: Overlap, offset: f64, n: usize) -> Vec<f64> {
    let base = if overlap == Overlap::Push { -1.0 } else { 0.0 };
    let gap = if overlap == Overlap::Push { 0.0 } else { -1.0 };
    let mut bars = [Bar { k: km, normal: 1.0, base: 0.0 }, Bar { k: ks, normal: -1.0, base }];
    let side = |first: bool| {
        let normal = [if first { 1.0 } else { -1.0 }, 0.0, 0.0];
        let conjugate = Conjugate { terms: vec![(0, 1.0)], normal, gap };
        let (own, other) = if first { (km, ks) } else { (ks, km) };
        Side {
            pair: 0,
            first,
            body: usize::from(!first),
            observed: 0..1,
            nodes: vec![ContactNode { node: 0, row: 0, conjugate, follows: false }],
            moduli: Both { own, other },
        }
    };
    let sides = [side(true), side(false)];
    let exchange = Exchange {
        comm: None,
        partners: vec![Partner::Here(1), Partner::Here(0)],
        traffic: Default::default(),
    };
    let settings = Settings { weights, tolerance: 1e-12, max_alternations: 100 };
    let mut alternation = Alternation::new(&mut bars, &sides, &exchange, settings).unwrap();
    let exact = -ks / (km + ks);
    // The force step leaves -p / km and base + p / ks: an error of p moves both.
    let p = (1.0 + offset) * km * ks / (km + ks);
    alternation.states.iter_mut().for_each(|s| s.force = vec![p]);
    alternation.solve_force_step().unwrap();
    alternation.started = true;
    let mut all = vec![alternation.states[0].displacement[0][0] - exact];
    for _ in 0..n {
        alternation.alternate().unwrap();
        all.push(alternation.states[0].displacement[0][0] - exact);
    }
    all
}

fn factor(km: f64, ks: f64, beta: f64, w: f64) -> f64 {
    (beta * km - (1.0 - beta) * ks) * (w / km - (1.0 - w) / ks)
}

const RATIOS: [f64; 9] = [1e-6, 1e-3, 0.1, 0.2, 1.0, 5.0, 10.0, 1e3, 1e6];

#[test]
fn constant_weights_have_the_factor_of_the_formula() {
    for r in [0.01, 0.1, 0.1716, 0.5, 2.0, 5.83, 10.0, 100.0] {
        for a in [0.3, 0.5, 0.8] {
            // The weight a belongs to the other side's value: A's own gets one minus it.
            let expected = factor(1.0, r, 1.0 - a, 1.0 - a);
            let e = errors(1.0, r, Weights::Constant(a), Overlap::Gap, 1e-4, 1);
            assert!((e[1] / e[0] - expected).abs() < 1e-6 * expected.abs().max(1.0), "r {r} a {a}: {e:?}");
        }
    }
}

#[test]
fn half_converges_between_0_1716_and_5_83() {
    for (r, converges) in [(0.17, false), (0.173, true), (1.0, true), (5.82, true), (5.84, false)] {
        let e = errors(1.0, r, Weights::Constant(0.5), Overlap::Gap, 1e-6, 6);
        assert_eq!(e[6].abs() < e[0].abs(), converges, "r {r}: {e:?}");
    }
}

#[test]
fn response_and_stiffness_are_exact_after_one_alternation_and_stay_so() {
    for r in RATIOS {
        for weights in [Weights::Response, Weights::ResponseSurface, Weights::Stiffness] {
            for overlap in [Overlap::Gap, Overlap::Push] {
                let e = errors(1.0, r, weights, overlap, 1e-3, 51);
                // In one frame a stiff bar's force is a difference of displacements: round-off times its stiffness.
                let round_off = if overlap == Overlap::Push { f64::EPSILON * r } else { 0.0 };
                assert!(e[1..].iter().all(|e| e.abs() <= 1e-12 + round_off), "{weights:?} {r}: {e:?}");
            }
        }
    }
}

#[test]
fn printed_ratio_is_exact_only_when_measured_from_the_contact_free_state() {
    for r in [0.1, 1.0, 10.0] {
        let e = errors(1.0, r, Weights::Component, Overlap::Gap, 1e-3, 51);
        assert!(e[1..].iter().all(|e| e.abs() < 1e-12), "{r}: {e:?}");
    }
    // In one frame both surfaces move by the same amount: the ratio tends to 1/2.
    for r in [1e-3, 0.1, 0.5, 3.0, 10.0] {
        for weights in [Weights::Component, Weights::Magnitude] {
            let expected = -(1.0 - r) * (1.0 - r) / (4.0 * r);
            let e = errors(1.0, r, weights, Overlap::Push, 1e-9, 1);
            assert!((e[1] / e[0] / expected - 1.0).abs() < 1e-4, "{r}: {} {expected}", e[1] / e[0]);
        }
    }
}
