//! The alternation on two bars, where its convergence factors are known in closed form.
//!
//! Bar A of stiffness `km` is fixed, bar B of stiffness `ks` is pushed against it by an overlap D: the contact force is
//! p = D km ks / (km + ks). With the pressures weighted by beta (A's own) and the displacements by w (A's own), the
//! error of the common interface position is multiplied by [beta km - (1 - beta) ks] [w / km - (1 - w) / ks] per
//! alternation.
use super::{
    ActiveSet, Alternation, Coarse, Coupling, End, Known, Limits, PairRows, Reason, Respond, Touch,
    weights::Weights,
};
use crate::{
    contact::Law,
    error::Result,
    parallel::{Exchange, Partner},
};

/// A bar with one contact row: w = free - R / k.
struct Bar {
    k: f64,
    free: [f64; 1],
}

impl Respond for Bar {
    fn n_rows(&self) -> usize {
        1
    }
    fn free(&self) -> &[f64] {
        &self.free
    }
    fn force_step(&mut self, force: &[f64]) -> Result<Vec<f64>> {
        Ok(vec![force[0] / self.k])
    }
    fn displacement_step(&mut self, inward: &[f64], active: &[bool]) -> Result<Vec<f64>> {
        Ok(vec![if active[0] { self.k * inward[0] } else { 0.0 }])
    }
    fn modes(&self) -> &[Vec<f64>] {
        &[]
    }
    fn mode_work(&self) -> &[f64] {
        &[]
    }
    fn mode_scale(&self) -> &[f64] {
        &[]
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

/// Looks at two bars' alternation.
fn on_bars<T>(
    [km, ks]: [f64; 2],
    overlap: Overlap,
    rows: PairRows,
    look: impl FnOnce(&mut ActiveSet<Bar>) -> T,
) -> T {
    let (gap, push) = if overlap == Overlap::Push { (0.0, 1.0) } else { (-1.0, 0.0) };
    let mut bars = [Bar { k: km, free: [0.0] }, Bar { k: ks, free: [push] }];
    let end = |body| End { pair: 0, multiplier: body == 0, body, rows: 0..1, watched: Vec::new() };
    let ends = [end(0), end(1)];
    let exchange = Exchange {
        comm: None,
        partners: vec![Partner::Here(1), Partner::Here(0)],
        traffic: Default::default(),
    };
    let mut coupling = Coupling::new(&mut bars, &ends, &exchange);
    let stiffness = km * ks / (km + ks);
    let coarse = Coarse::new(&coupling, 0, &[0, 0], vec![stiffness]);
    let rows =
        [PairRows { gap: vec![gap], stiffness, compliance_ratio: ks / km, ..rows }, PairRows::default()];
    let limits = Limits { tolerance: 1e-12, max_alternations: 100, friction: false };
    look(&mut ActiveSet::new(&mut coupling, &rows, &coarse, limits, 1, 1))
}

/// Position error of A's surface after each alternation, started `offset` away from the solution.
fn errors(km: f64, ks: f64, weights: Weights, overlap: Overlap, offset: f64, n: usize) -> Vec<f64> {
    on_bars([km, ks], overlap, PairRows::default(), |rows| {
        let exact = ks / (km + ks);
        // The force step leaves -p / km and base + p / ks: an error of p moves both.
        let p = (1.0 + offset) * km * ks / (km + ks);
        let mut alternation =
            Alternation::new(rows, weights, Some(Known { force: &[p], touch: &[] })).unwrap();
        let mut all = vec![p / km - exact];
        for _ in 0..n {
            alternation.alternate(|_| {}).unwrap();
            all.push(alternation.rows.force[0] / km - exact);
        }
        all
    })
}

/// A side that supports hold, or that is rigid, leaves the other one all of the correction: the first alternation ends it.
#[test]
fn a_side_that_cannot_give_way_leaves_it_to_the_other() {
    for weights in [Weights::Constant(0.3), Weights::Component, Weights::Response, Weights::Stiffness] {
        for (k, held, expected) in [([2.0, 1e30], [false, true], 2.0), ([1e30, 3.0], [true, false], 3.0)] {
            let rows = PairRows { held: vec![held], ..PairRows::default() };
            let force = on_bars(k, Overlap::Gap, rows, |rows| {
                let mut alternation = Alternation::new(rows, weights, None).unwrap();
                alternation.alternate(|_| {}).unwrap();
                alternation.rows.force[0]
            });
            assert!((force - expected).abs() < 1e-12 * expected, "{weights:?} {held:?}: {force}");
        }
    }
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

/// A post with a normal and a tangential spring: w = free - R / k in both directions.
struct Post {
    k: [f64; 2],
    free: [f64; 2],
}

impl Respond for Post {
    fn n_rows(&self) -> usize {
        2
    }
    fn free(&self) -> &[f64] {
        &self.free
    }
    fn force_step(&mut self, force: &[f64]) -> Result<Vec<f64>> {
        Ok(std::iter::zip(force, self.k).map(|(f, k)| f / k).collect())
    }
    fn displacement_step(&mut self, inward: &[f64], active: &[bool]) -> Result<Vec<f64>> {
        let row = |((v, k), active): ((&f64, f64), &bool)| if *active { k * v } else { 0.0 };
        Ok(std::iter::zip(inward, self.k).zip(active).map(row).collect())
    }
    fn modes(&self) -> &[Vec<f64>] {
        &[]
    }
    fn mode_work(&self) -> &[f64] {
        &[]
    }
    fn mode_scale(&self) -> &[f64] {
        &[]
    }
}

/// Posts of normal stiffness 2 and 6 and tangential stiffness 1 and 3, an overlap of 1, and a motion along each other: how the node
/// ends, its tangential force, and why the alternation ends.
fn on_posts(law: Law, motion: f64, known: Option<Known>) -> (Reason, Touch, f64) {
    let mut posts = [Post { k: [2.0, 1.0], free: [0.0; 2] }, Post { k: [6.0, 3.0], free: [0.0, motion] }];
    let end = |body| End { pair: 0, multiplier: body == 0, body, rows: 0..2, watched: Vec::new() };
    let ends = [end(0), end(1)];
    let exchange = Exchange {
        comm: None,
        partners: vec![Partner::Here(1), Partner::Here(0)],
        traffic: Default::default(),
    };
    let mut coupling = Coupling::new(&mut posts, &ends, &exchange);
    let coarse = Coarse::new(&coupling, 0, &[0, 0], vec![1.0; 2]);
    let rows = PairRows {
        gap: vec![-1.0, 0.0],
        law,
        area: vec![0.5; 2],
        stiffness: 1.0,
        compliance_ratio: 3.0,
        ..PairRows::default()
    };
    let rows = [rows, PairRows::default()];
    let limits = Limits { tolerance: 1e-12, max_alternations: 100, friction: true };
    let mut state = ActiveSet::new(&mut coupling, &rows, &coarse, limits, 1, 1);
    let outcome = state.relax(Weights::Stiffness, known, |_| {}).unwrap();
    assert!((state.force[0] - 1.5).abs() < 1e-12, "{:?}", state.force);
    (outcome.reason, state.touch(0..1)[0], state.force[1])
}

#[test]
fn a_node_sticks_within_the_cone_and_slides_at_its_edge() {
    let half = Law::Coulomb { friction: 0.5 };
    // It would carry 3/4 of the motion; mu p is 3/4, and k times the area 1/2.
    for (law, motion, touch, force) in [
        (half, 0.8, Touch::Stick, 0.6),
        (half, -0.8, Touch::Stick, -0.6),
        (half, 1.2, Touch::Forwards, 0.75),
        (half, -1.2, Touch::Backwards, -0.75),
        (Law::Tresca { shear: 1.0 }, 0.8, Touch::Forwards, 0.5),
        (Law::Rough, 100.0, Touch::Stick, 75.0),
        (Law::Tied, -100.0, Touch::Stick, -75.0),
    ] {
        let known = [vec![Touch::Backwards]];
        let warm = [1.0, -0.3];
        // However it starts, from nothing known or from sliding the wrong way.
        for known in [None, Some(Known { force: &warm, touch: &known })] {
            let (reason, ends_as, t) = on_posts(law, motion, known);
            assert_eq!((reason, ends_as), (Reason::Converged, touch), "{law:?} {motion}: {t}");
            assert!((t - force).abs() < 1e-12 * force.abs(), "{law:?} {motion}: {t}");
        }
    }
}
