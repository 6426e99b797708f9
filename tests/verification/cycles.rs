//! Shear that goes to and fro: tractions, work of friction and closed loops over many cycles; the scene in a mirror.
use super::friction::{A, A_OVER_B, RADIUS, STEEL, discs, reversed, tractions};
use super::{multipliers, near, solve_all};
use kontakt::record::SideTable;
use kontakt::vector::{largest, worst};
use serde_json::Value;

/// Share of mu P to which the shear goes, and the coefficient.
const SHARE: f64 = 0.6;
const FRICTION: f64 = 0.3;

/// Cells along the half-width.
const CELLS: f64 = 32.0;

/// Work of friction after each step, J.
fn dissipated(summary: &Value) -> Vec<f64> {
    let steps = summary["steps"].as_array().expect("steps");
    let of = |step: &Value| step["pairs"][0]["friction"]["dissipated"].as_f64().expect("a number");
    steps.iter().map(of).collect()
}

/// Work of friction of the first shear from nought, J/m. Where x > c slips, q = mu p and the slip is that of Hertz's gap outside the
/// contact, s' = (mu / R) sqrt(x^2 - c^2), 1/R the sum of both curvatures: tangential compliances are the normal ones, and q is
/// mu times the difference of two of Hertz's pressures. On from one turn to the other the slips are twice these.
fn first_shear() -> f64 {
    let (radius, c) = (0.5 * RADIUS, A * (1.0_f64 - SHARE).sqrt());
    let peak = 2.0 * 1e6 / (std::f64::consts::PI * A);
    let slip = |x: f64| {
        let root = (x * x - c * c).sqrt();
        FRICTION / (2.0 * radius) * (x * root - c * c * ((x + root) / c).ln())
    };
    let work = |x: f64| 2.0 * FRICTION * peak * (1.0 - (x / A).powi(2)).sqrt() * slip(x);
    let n = 20_000;
    let h = (A - c) / f64::from(n);
    (0..n).map(|i| work(c + (f64::from(i) + 0.5) * h) * h).sum()
}

#[test]
fn thirty_cycles_of_shear_lose_what_theory_says() {
    let mut path = vec![0.0, SHARE];
    (0..30).for_each(|_| path.extend([-SHARE, SHARE]));
    path.push(-0.2);
    let (summary, results) = solve_all(&discs(FRICTION, CELLS, A_OVER_B, &path), 1, &[]);
    let lost = dissipated(&summary);
    let first = first_shear();
    near(lost[1], first, 0.01 * first, "work of the first shear");
    // Never less than before.
    assert!(lost.windows(2).all(|w| w[1] >= w[0]), "{lost:?}");
    let cycles: Vec<f64> = (0..30).map(|k| lost[2 * k + 3] - lost[2 * k + 1]).collect();
    for cycle in &cycles {
        near(*cycle, 4.0 * first, 0.01 * 4.0 * first, "work of a cycle");
        near(*cycle, cycles[0], 1e-9 * cycles[0], "work of each cycle");
    }
    // After thirty cycles the way from 0.6 down to -0.2 leaves what it leaves after the first shear.
    let found = tractions(multipliers(&results, 0), FRICTION);
    let size = worst(found.iter().map(|f| f.1.abs()));
    let error: f64 = found.iter().map(|&(x, q)| (q - reversed(x, SHARE, -0.2)).powi(2)).sum();
    let error = (error / found.len() as f64).sqrt();
    assert!(error < 0.015 * size, "{error:e} of {size}");
    for (x, expected) in [(0.0, -0.08326), (0.5, -0.07011), (0.9, -0.43589)] {
        let nearest = |a: &&(f64, f64), b: &&(f64, f64)| (a.0 - x).abs().total_cmp(&(b.0 - x).abs());
        let (at, q) = *found.iter().min_by(nearest).expect("nodes");
        near(reversed(x, SHARE, -0.2), expected, 1e-5, "the formula");
        near(q, reversed(at, SHARE, -0.2), 0.01, &format!("traction at {at}"));
    }
    // The loop is closed: the same tractions and slips as without any cycle.
    let (_, once) = solve_all(&discs(FRICTION, CELLS, A_OVER_B, &[0.0, SHARE, -0.2]), 1, &[]);
    let [once, often] = [&once, &results].map(|r| multipliers(r, 0).tangential.clone().expect("a law"));
    for (what, a, b) in [("traction", &once.traction, &often.traction), ("slip", &once.slip, &often.slip)] {
        let allowed = 1e-9 * largest(a);
        std::iter::zip(a, b).for_each(|(a, b)| near(*b, *a, allowed, what));
    }
}

/// Nodes of a side by their mirror image: x, pressure, traction, slip, status.
fn by_x(table: &SideTable, sign: f64) -> Vec<[f64; 5]> {
    let along = table.tangential.as_ref().expect("a law");
    let row = |i: usize| {
        let (q, slip) = (sign * along.traction[i], sign * along.slip[i]);
        [sign * table.x[i][0], table.pressure[i], q, slip, f64::from(table.status[i])]
    };
    let mut rows: Vec<[f64; 5]> = (0..table.s.len()).map(row).collect();
    rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
    rows
}

/// Columns of two tables, each by its own largest value.
#[track_caller]
fn same(a: &[[f64; 5]], b: &[[f64; 5]], relative: f64) {
    assert_eq!(a.len(), b.len());
    for k in 0..5 {
        let size = worst(a.iter().map(|row| row[k].abs()));
        assert!(size > 0.0, "column {k} says nothing");
        let off = worst(std::iter::zip(a, b).map(|(a, b)| (a[k] - b[k]).abs()));
        assert!(off <= relative * size, "column {k}: {off:e} of {size:e}");
    }
}

#[test]
fn the_mirrored_shear_has_the_mirrored_tractions() {
    for path in [&[0.0, 0.9][..], &[0.0, 0.6, -0.2]] {
        let mirrored: Vec<f64> = path.iter().map(|load| -load).collect();
        let [given, mirrored] = [path, &mirrored].map(|path| {
            let (_, results) = solve_all(&discs(FRICTION, 20.0, A_OVER_B, path), 1, &[]);
            multipliers(&results, 0).clone()
        });
        same(&by_x(&given, 1.0), &by_x(&mirrored, -1.0), 1e-10);
    }
}

/// Open, slipping and sticking at once, on a mesh that is finer at one end, and all of it in a mirror.
#[test]
fn the_mirrored_plate_has_the_mirrored_tractions() {
    let plate = |sign: f64| {
        let (push, hold) = if sign > 0.0 { ("left", "right") } else { ("right", "left") };
        let mut at = [0.0, 0.01, 0.04].map(|x| sign * x);
        let mut cells = [14, 20];
        if sign < 0.0 {
            at.reverse();
            cells.reverse();
        }
        let text = format!(
            "analysis = \"plane strain\"\n{STEEL}[[body]]\nname = \"plate\"\nmaterial = \"steel\"\n\
             mesh.rectangle = {{ x = {{ at = {at:?}, cells = {cells:?} }}, y = {{ from = 0, to = 0.04, cells = 24 }} }}\n\
             support = [{{ surface = \"{hold}\", x = 0 }}]\n\
             load = [{{ surface = \"top\", pressure = 5e7 }}, {{ surface = \"{push}\", pressure = 15e7 }}]\n\
             [[body]]\nname = \"floor\"\nmaterial = \"steel\"\n\
             mesh.rectangle = {{ x = {{ from = -0.05, to = 0.05, cells = 50 }}, y = {{ from = -0.02, to = 0, cells = 10 }} }}\n\
             support = [{{ surface = \"bottom\", x = 0, y = 0 }}]\n\
             [[contact]]\nname = \"pair\"\nsurfaces = [\"plate.bottom\", \"floor.top\"]\nfriction = 1\n"
        );
        let (_, results) = solve_all(&text, 1, &[]);
        multipliers(&results, 0).clone()
    };
    let [given, mirrored] = [1.0, -1.0].map(plate);
    for status in [1, 2, 3] {
        assert!(given.status.contains(&status), "{:?}", given.status);
    }
    same(&by_x(&given, 1.0), &by_x(&mirrored, -1.0), 1e-10);
}
