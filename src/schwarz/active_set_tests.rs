//! The active-set driver on bodies that are matrices.
use super::{ActiveSet, Coarse, Coupling, End, Ended, Limits, PairRows, Reason, Respond, Spring};
use crate::vector::{larger, largest, smaller};
use crate::{
    error::Result,
    parallel::{Exchange, Partner},
};
use nalgebra::{DMatrix, DVector};

/// A body with a dense compliance.
struct Dense {
    compliance: DMatrix<f64>,
    free: Vec<f64>,
    modes: Vec<Vec<f64>>,
    work: Vec<f64>,
    scale: Vec<f64>,
    springs: Vec<Spring>,
}

impl Respond for Dense {
    fn n_rows(&self) -> usize {
        self.free.len()
    }
    fn free(&self) -> &[f64] {
        &self.free
    }
    fn force_step(&mut self, force: &[f64]) -> Result<Vec<f64>> {
        Ok((&self.compliance * DVector::from_column_slice(force)).as_slice().to_vec())
    }
    fn displacement_step(&mut self, inward: &[f64], active: &[bool]) -> Result<Vec<f64>> {
        let rows: Vec<usize> = (0..active.len()).filter(|&i| active[i]).collect();
        let c = self.compliance.select_rows(&rows).select_columns(&rows);
        let s = c.try_inverse().expect("regular");
        let v = DVector::from_iterator(rows.len(), rows.iter().map(|&i| inward[i]));
        let mut r = &s * v;
        if !self.modes.is_empty() {
            let g = DMatrix::from_fn(rows.len(), self.modes.len(), |i, k| self.modes[k][rows[i]]);
            let gram = (g.transpose() * &s * &g).pseudo_inverse(1e-12).expect("an inverse");
            r -= &s * &g * (gram * (g.transpose() * &r));
        }
        let mut out = vec![0.0; active.len()];
        rows.iter().zip(r.iter()).for_each(|(&i, r)| out[i] = *r);
        Ok(out)
    }
    fn modes(&self) -> &[Vec<f64>] {
        &self.modes
    }
    fn mode_work(&self) -> &[f64] {
        &self.work
    }
    fn mode_scale(&self) -> &[f64] {
        &self.scale
    }
    fn springs(&self) -> &[Spring] {
        &self.springs
    }
}

/// Compliance like that of a half-plane: logarithmic, on `n` points of [-1, 1].
fn half_plane(n: usize, modulus: f64) -> (DMatrix<f64>, Vec<f64>) {
    let x: Vec<f64> = (0..n).map(|i| -1.0 + 2.0 * i as f64 / (n - 1) as f64).collect();
    let h = 2.0 / (n - 1) as f64;
    let c = DMatrix::from_fn(n, n, |i, j| {
        let d: f64 = x[i] - x[j];
        let part = |d: f64| if d == 0.0 { 0.0 } else { d * (d.abs().ln() - 1.0) };
        // Mean over a cell, and the depth of the body as a constant.
        (3.0 - (part(d + 0.5 * h) - part(d - 0.5 * h)) / h) / (std::f64::consts::PI * modulus) * 2.0
    });
    (c, x)
}

struct Run {
    reason: Reason,
    alternations: usize,
    force: Vec<f64>,
    gaps: Vec<f64>,
    updates: usize,
    free_modes: usize,
}

fn run(
    bodies: &mut [Dense],
    gap: Vec<f64>,
    stiffness: f64,
    ratio: f64,
) -> std::result::Result<Run, Vec<f64>> {
    let n = gap.len();
    let ends = [
        End { pair: 0, multiplier: true, body: 0, rows: 0..n, watched: Vec::new() },
        End { pair: 0, multiplier: false, body: 1, rows: 0..n, watched: Vec::new() },
    ];
    let exchange = Exchange {
        comm: None,
        partners: vec![Partner::Here(1), Partner::Here(0)],
        traffic: Default::default(),
    };
    let first = [0, bodies[0].modes.len()];
    let n_modes = bodies.iter().map(|b| b.modes.len()).sum();
    bodies.iter_mut().for_each(|b| b.scale = b.work.iter().map(|w| w.abs()).collect());
    let rows =
        [PairRows { gap, stiffness, compliance_ratio: ratio, ..PairRows::default() }, PairRows::default()];
    let mut coupling = Coupling::new(bodies, &ends, &exchange);
    let coarse = Coarse::new(&coupling, n_modes, &first, vec![stiffness; n]);
    let limits = Limits { tolerance: 1e-8, max_alternations: 500, friction: false };
    let mut driver = ActiveSet::new(&mut coupling, &rows, &coarse, limits, 1, 1);
    let outcome = match driver.run(None, |_| {}).expect("no library fails") {
        Ended::Outcome(outcome) => outcome,
        Ended::Driven(motion) => return Err(motion),
    };
    let free_modes = coarse.projector(&exchange, &driver.active).unrestrained.len();
    Ok(Run {
        reason: outcome.reason,
        alternations: outcome.history.len(),
        gaps: (0..n).map(|j| driver.gap_at(j)).collect(),
        force: driver.force,
        updates: driver.updates,
        free_modes,
    })
}

fn body(compliance: DMatrix<f64>) -> Dense {
    let n = compliance.nrows();
    Dense {
        compliance,
        free: vec![0.0; n],
        modes: Vec::new(),
        work: Vec::new(),
        scale: Vec::new(),
        springs: Vec::new(),
    }
}

fn complementary(run: &Run) {
    let largest = run.force.iter().copied().fold(0.0, larger);
    let reach = run.gaps.iter().map(|g| g.abs()).fold(0.0, larger);
    for (r, g) in std::iter::zip(&run.force, &run.gaps) {
        assert!(*r >= -1e-8 * largest && *g >= -1e-8 * reach, "{r:e} {g:e}");
        assert!((r * g).abs() <= 1e-8 * largest * reach, "{r:e} {g:e}");
    }
}

#[test]
fn hertz_at_every_stiffness_ratio_takes_the_same_few_alternations() {
    for n in [51, 101, 201] {
        for ratio in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
            let (a, x) = half_plane(n, ratio);
            let (b, _) = half_plane(n, 1.0);
            let gap: Vec<f64> = x.iter().map(|x| x * x - 0.2).collect();
            let stiffness = 1.0 / (1.0 + 1.0 / ratio);
            let found = run(&mut [body(a), body(b)], gap, stiffness, 1.0 / ratio).expect("restrained");
            assert_eq!(found.reason, Reason::Converged);
            eprintln!("{n} {ratio}: {} {}", found.alternations, found.updates);
            assert!(found.alternations <= 20, "{n} {ratio}: {}", found.alternations);
            complementary(&found);
        }
    }
}

#[test]
fn a_floating_body_is_pressed_by_its_load() {
    let n = 81;
    let (a, x) = half_plane(n, 1.0);
    let (b, _) = half_plane(n, 5.0);
    for (lift, tilt) in [(0.0, 0.0), (0.5, 0.0), (0.5, 0.1)] {
        let mut upper = body(a.clone());
        // Translation towards the other body and rotation; load P, and a moment.
        upper.modes = vec![vec![1.0; n], x.clone()];
        upper.work = vec![0.3, tilt * 0.3];
        let gap: Vec<f64> = x.iter().map(|x| x * x + lift).collect();
        let found = run(&mut [upper, body(b.clone())], gap, 0.8, 0.2).expect("held by contact");
        assert_eq!(found.reason, Reason::Converged);
        complementary(&found);
        assert!((found.force.iter().sum::<f64>() - 0.3).abs() < 1e-12);
        let moment: f64 = std::iter::zip(&found.force, &x).map(|(f, x)| f * x).sum();
        assert!((moment - tilt * 0.3).abs() < 1e-12);
        assert!(found.alternations < 40, "{}", found.alternations);
        assert_eq!(found.free_modes, 0);
    }
}

#[test]
fn a_load_that_nothing_stops_is_refused_and_a_motion_without_work_is_free() {
    let n = 21;
    let (a, x) = half_plane(n, 1.0);
    let (b, _) = half_plane(n, 1.0);
    let gap: Vec<f64> = x.iter().map(|x| x * x + 0.1).collect();
    let mut upper = body(a.clone());
    // Away from the other body.
    upper.modes = vec![vec![1.0; n]];
    upper.work = vec![-1.0];
    let motion = run(&mut [upper, body(b.clone())], gap.clone(), 0.5, 1.0).err().expect("it flies away");
    assert!(motion[0] < 0.0);
    // A motion along the surface, without and with a load.
    let with = |work: f64| {
        let mut upper = body(a.clone());
        upper.modes = vec![vec![1.0; n], vec![0.0; n]];
        upper.work = vec![1.0, work];
        run(&mut [upper, body(b.clone())], gap.clone(), 0.5, 1.0)
    };
    let found = with(0.0).expect("held");
    assert_eq!((found.reason, found.free_modes), (Reason::Converged, 1));
    assert!(with(0.1).is_err());
}

#[test]
fn feasible_steps_find_the_same_solution() {
    let n = 41;
    let (a, x) = half_plane(n, 1.0);
    let (b, _) = half_plane(n, 3.0);
    let gap: Vec<f64> = x.iter().map(|x| x * x * (1.0 + 0.5 * (20.0 * x).sin()) - 0.2).collect();
    let reference =
        run(&mut [body(a.clone()), body(b.clone())], gap.clone(), 0.75, 1.0 / 3.0).expect("restrained");
    let ends = [
        End { pair: 0, multiplier: true, body: 0, rows: 0..n, watched: Vec::new() },
        End { pair: 0, multiplier: false, body: 1, rows: 0..n, watched: Vec::new() },
    ];
    let exchange = Exchange {
        comm: None,
        partners: vec![Partner::Here(1), Partner::Here(0)],
        traffic: Default::default(),
    };
    let rows = [
        PairRows { gap, stiffness: 0.75, compliance_ratio: 1.0 / 3.0, ..PairRows::default() },
        PairRows::default(),
    ];
    let mut bodies = [body(a), body(b)];
    let mut coupling = Coupling::new(&mut bodies, &ends, &exchange);
    let coarse = Coarse::new(&coupling, 0, &[0, 0], vec![0.75; n]);
    let limits = Limits { tolerance: 1e-10, max_alternations: 2000, friction: false };
    let mut driver = ActiveSet::new(&mut coupling, &rows, &coarse, limits, 1, 1);
    let (start, _) = coarse
        .start(&exchange, &driver.gap.clone(), &driver.resists(super::coarse::Resists::Never))
        .expect("restrained");
    let reason = driver.descend(&start, &mut |_| {}).expect("no library fails");
    assert_eq!(reason, Reason::Converged);
    let largest = reference.force.iter().copied().fold(0.0, larger);
    for (a, b) in std::iter::zip(&driver.force, &reference.force) {
        assert!((a - b).abs() <= 1e-7 * largest, "{a:e} {b:e}");
    }
}

#[test]
fn a_soft_mode_on_a_spring_is_the_body_as_a_whole() {
    let n = 61;
    let (a, x) = half_plane(n, 1.0);
    let (b, _) = half_plane(n, 2.0);
    // A plate that bends, a thousand times softer than it dents; its load does some work on the bending.
    let bending = DVector::from_iterator(n, x.iter().map(|x| 1.0 - x * x));
    let (stiffness, work) = (1e-3, 4e-4);
    let gap: Vec<f64> = x.iter().map(|x| 0.1 * x * x - 0.1).collect();
    let mut whole = body(&a + &bending * bending.transpose() / stiffness);
    whole.free = (&bending * (work / stiffness)).as_slice().to_vec();
    let mut split = body(a);
    split.modes = vec![bending.as_slice().to_vec()];
    split.work = vec![work];
    split.springs = vec![Spring { mode: 0, lever: 0.1, stiffness: stiffness / 0.01 }];
    let found = [whole, split].map(|first| {
        let found = run(&mut [first, body(b.clone())], gap.clone(), 0.67, 0.5).expect("restrained");
        assert_eq!(found.reason, Reason::Converged);
        complementary(&found);
        found
    });
    let largest = found[0].force.iter().copied().fold(0.0, larger);
    for (a, b) in std::iter::zip(&found[0].force, &found[1].force) {
        assert!((a - b).abs() <= 1e-6 * largest, "{a:e} {b:e}");
    }
    // What bends carries the rest of the load.
    let pushed: f64 = std::iter::zip(&found[1].force, &bending).map(|(f, z)| f * z).sum();
    assert!((pushed + 0.1 * found[1].force[n] - work).abs() < 1e-12 * work.abs().max(pushed));
}

/// A free body in the way of the other one, with no load on it: it gives way until the two touch, and no further, whatever
/// the round-off of the gaps.
#[test]
fn a_body_without_load_is_pushed_away_until_it_touches() {
    let n = 21;
    for case in 0..200 {
        let (c, x) = half_plane(n, 1.0);
        let mut free = body(c.clone());
        // A translation and a tilt.
        free.modes = vec![vec![1.0; n], x.clone()];
        free.work = vec![0.0, 0.0];
        let mut bodies = [free, body(c)];
        let gap: Vec<f64> =
            (0..n).map(|j| -1e-3 * (1.0 + ((7 * case + 1) as f64 * (j + 1) as f64).sin())).collect();
        let deepest = gap.iter().map(|g| -g).fold(0.0, larger);
        let run = run(&mut bodies, gap, 1.0, 1.0).expect("nothing drives it");
        assert_eq!(run.reason, Reason::Open, "{case}");
        let nearest = run.gaps.iter().copied().fold(f64::INFINITY, smaller);
        assert!(nearest.abs() <= 1e-12 * deepest, "{case}: the nearest nodes are {nearest:e} apart");
    }
}

/// A change of the gaps changes a function of the forces by their scalar product with the dual forces.
#[test]
fn the_influence_of_the_gaps_on_the_forces() {
    let n = 41;
    let ends = [
        End { pair: 0, multiplier: true, body: 0, rows: 0..n, watched: Vec::new() },
        End { pair: 0, multiplier: false, body: 1, rows: 0..n, watched: Vec::new() },
    ];
    // Held by supports; pressed by a force, so that contact alone holds it.
    for is_free in [false, true] {
        let changed = |change: f64| {
            let (mut bodies, x) =
                ([half_plane(n, 1.0).0, half_plane(n, 3.0).0].map(body), half_plane(n, 1.0).1);
            if is_free {
                bodies[0].modes = vec![vec![1.0; n]];
                (bodies[0].work, bodies[0].scale) = (vec![0.3], vec![0.3]);
            }
            let bump = |x: f64| change * (3.0 * x + 0.4).cos();
            let approach = if is_free { 0.0 } else { 0.4 };
            let gap: Vec<f64> = x.iter().map(|x| 0.5 * x * x - approach + bump(*x)).collect();
            let rows = [
                PairRows { gap, stiffness: 0.7, compliance_ratio: 3.0, ..PairRows::default() },
                PairRows::default(),
            ];
            let exchange = Exchange {
                comm: None,
                partners: vec![Partner::Here(1), Partner::Here(0)],
                traffic: Default::default(),
            };
            let mut coupling = Coupling::new(&mut bodies, &ends, &exchange);
            let modes = usize::from(is_free);
            let coarse = Coarse::new(&coupling, modes, &[0, modes], vec![0.7; n]);
            let limits = Limits { tolerance: 1e-11, max_alternations: 500, friction: false };
            let mut driver = ActiveSet::new(&mut coupling, &rows, &coarse, limits, 1, 1);
            let ended = driver.run(None, |_| {}).expect("no library fails");
            assert!(matches!(ended, Ended::Outcome(_)), "it is held");
            let c: Vec<f64> = x.iter().map(|x| if x.abs() < 0.2 { 1.0 } else { 0.0 }).collect();
            let value: f64 = std::iter::zip(&c, &driver.force).map(|(c, f)| c * f).sum();
            let (dual, _) = driver.influence(c).expect("no library fails");
            let slope: f64 = std::iter::zip(&x, &dual).map(|(x, m)| m * (3.0 * x + 0.4).cos()).sum();
            if is_free {
                assert!(dual.iter().sum::<f64>().abs() < 1e-9 * largest(&dual), "in equilibrium");
            }
            (value, slope)
        };
        let step = 1e-6;
        let [(low, _), (_, slope), (high, _)] = [-step, 0.0, step].map(changed);
        let measured = (high - low) / (2.0 * step);
        assert!((slope / measured - 1.0).abs() < 0.02, "{is_free}: {slope:e} {measured:e}");
    }
}
