//! The pictures, drawn from made-up results: what is there, what it says, and how long it takes.
//!
//! `KONTAKT_KEEP=DIR` keeps them, to be looked at.
use kontakt::case::{Analysis, OutputCase, Shown, StressComponent, Units};
use kontakt::contact::Law;
use kontakt::element::ElementKind;
use kontakt::mesh::Cell;
use kontakt::output::*;
use kontakt::record::*;
use std::path::Path;

const STYLE: OutputCase = OutputCase {
    shown: Shown::Stress(StressComponent::Yy),
    magnification: None,
    window: None,
    every_estimate: false,
};

/// A block of n x n quadrilaterals from `low` to `high`; `kind` quad4 or quad8.
fn block(piece: &mut Piece, body: i32, kind: ElementKind, low: [f64; 2], high: [f64; 2], n: usize) {
    let first = piece.points.len() as u32;
    let m = 2 * n + 1; // a node at every corner and mid-side; the unused ones do no harm
    for j in 0..m {
        for i in 0..m {
            let t = [i, j].map(|k| k as f64 / (m - 1) as f64);
            piece.points.push([low[0] + t[0] * (high[0] - low[0]), low[1] + t[1] * (high[1] - low[1]), 0.0]);
        }
    }
    let node = |i: usize, j: usize| first + (j * m + i) as u32;
    for j in (0..2 * n).step_by(2) {
        for i in (0..2 * n).step_by(2) {
            let corners = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1]];
            let nodes = corners.map(|[a, b]| node(i + a, j + b));
            piece.cells.push(Cell::new(kind, &nodes));
            piece.cell_bodies.push(body);
        }
    }
}

/// Adds displacement (m) and stress (Pa) as functions of the place and of the body.
fn add_fields(piece: &mut Piece, u: impl Fn([f64; 2]) -> [f64; 2], stress: impl Fn([f64; 2]) -> [f64; 4]) {
    let places = || piece.points.iter().map(|x| [x[0], x[1]]);
    let displacement = places().flat_map(|x| [u(x)[0], u(x)[1], 0.0]).collect();
    let stress = places().flat_map(|x| [&stress(x)[..], &[0.0; 2]].concat()).collect();
    piece.point_fields = vec![
        Field { name: "displacement".into(), unit: "m", components: 3, values: displacement },
        Field { name: "stress".into(), unit: "Pa", components: 6, values: stress },
    ];
}

fn results(piece: Piece, pairs: Vec<PairTables>, title: &str, units: Units) -> Results {
    let history = (1..=24)
        .map(|i| HistoryRow {
            step: 1,
            alternation: i,
            displacement_jump: 0.3 * 0.42f64.powi(i as i32),
            force_imbalance: if i == 1 { f64::NAN } else { (0.5 * 0.3f64.powi(i as i32)).max(3e-13) },
            active: [40, 31, 29, 28, 27][(i as usize - 1).min(4)],
            contraction: Some(0.42),
            seconds: 0.01 * i as f64,
            ..HistoryRow::default()
        })
        .collect();
    let run = RunInfo {
        case: "made-up".into(),
        title: title.into(),
        variant: None,
        text: String::new(),
        units,
        analysis: Analysis::PlaneStrain { thickness: 1.0 },
        bodies: vec!["upper".into(), "lower".into()],
        reason: Reason::Converged,
        alternations: 24,
        tolerance: 1e-8,
        steps: None,
        rigid: Vec::new(),
    };
    Results { piece, partitions: vec![[0, 0]], pairs, before: Vec::new(), history, run, complete: true }
}

/// Pressure p0 sqrt(1 - (x/a)^2) on n nodes over -length .. length at height y.
fn hertz_side(n: usize, length: f64, a: f64, p0: f64, y: f64, backwards: bool) -> SideTable {
    let xs = (0..n).map(|i| length * (2.0 * i as f64 / (n - 1) as f64 - 1.0));
    let xs: Vec<f64> = xs.map(|x| if backwards { -x } else { x }).collect();
    let pressure = |x: f64| p0 * (1.0 - (x / a).powi(2)).max(0.0).sqrt();
    SideTable {
        s: xs.iter().map(|x| length + if backwards { -x } else { *x }).collect(),
        x: xs.iter().map(|x| [*x, y, 0.0]).collect(),
        normal: vec![[0.0, 1.0, 0.0]; n],
        gap: vec![0.0; n],
        pressure: xs.iter().map(|x| pressure(*x)).collect(),
        force: vec![[0.0; 3]; n],
        status: xs.iter().map(|x| if x.abs() < a { 2 } else { 1 }).collect(),
        multipliers: true,
        closed: None,
        tangential: None,
        bonded: false,
    }
}

/// sigma_xx, sigma_yy, sigma_zz, tau_xy under a Hertz pressure (McEwen; Johnson, Contact Mechanics, eqs.
/// 4.49), depth z >= 0.
fn hertz_stress(x: f64, z: f64, a: f64, p0: f64) -> [f64; 4] {
    let q = a * a - x * x + z * z;
    let root = (q * q + 4.0 * x * x * z * z).sqrt();
    let m = (0.5 * (root + q)).max(0.0).sqrt();
    let n = (0.5 * (root - q)).max(0.0).sqrt() * if x < 0.0 { -1.0 } else { 1.0 };
    let k = (z * z + n * n) / (m * m + n * n).max(1e-30);
    let (xx, yy) = (-p0 / a * (m * (1.0 + k) - 2.0 * z), -p0 / a * m * (1.0 - k));
    let xy = -p0 / a * n * (m * m - z * z) / (m * m + n * n).max(1e-30);
    [xx, yy, 0.3 * (xx + yy), xy]
}

/// Two blocks, the upper one pressed on the middle of the lower one, which bends.
fn punch(kind: ElementKind, units: Units) -> Results {
    let mut piece = Piece::default();
    block(&mut piece, 0, kind, [-0.02, 0.0], [0.02, 0.03], 12);
    block(&mut piece, 1, kind, [-0.06, -0.04], [0.06, 0.0], 24);
    let u = |x: [f64; 2]| {
        [-3e-5 * x[1] * (x[0] / 0.06), -2e-5 * (1.0 - (x[0] / 0.06).powi(2)) - 2e-4 * x[1].max(0.0)]
    };
    let stress = |x: [f64; 2]| {
        let bending = -4e9 * (x[1] + 0.02).min(0.02) * (1.0 - (x[0] / 0.06).powi(2));
        [bending, -1.2e8 * (-(x[0] / 0.02).powi(2)).exp() * (1.0 + x[1] / 0.04).min(1.0), 0.0, 0.0]
    };
    add_fields(&mut piece, u, stress);
    let side = |backwards| hertz_side(31, 0.02, 0.0185, 1.4e8, 0.0, backwards);
    let pair = PairTables {
        law: Law::Frictionless,
        varies: false,
        name: "upper.bottom-lower.top".into(),
        surfaces: ["upper.bottom".into(), "lower.top".into()],
        sides: [Some(side(false)), Some(side(true))],
    };
    results(piece, vec![pair], "Punch on a beam", units)
}

/// 200,000 cells and a contact of 3 % of the size.
fn hertz(n: usize) -> Results {
    let (r, a, p0) = (0.05, 0.0015, 9e8);
    let mut piece = Piece::default();
    block(&mut piece, 0, ElementKind::Quad4, [-r, 0.0], [r, r], n);
    block(&mut piece, 1, ElementKind::Quad4, [-r, -r], [r, 0.0], n);
    // Half discs, with small cells at the contact.
    let half = piece.points.len() / 2;
    for (i, x) in piece.points.iter_mut().enumerate() {
        let sign = if i < half { 1.0 } else { -1.0 };
        let (s, d) = (x[0] / r, x[1].abs() / r);
        let (s, d) = (s * s.abs().powf(1.2), d.powf(2.0));
        let rim = r - (r * r - (r * s).powi(2)).max(0.0).sqrt();
        *x = [r * s, sign * (rim + (r - rim) * d), 0.0];
    }
    add_fields(
        &mut piece,
        |x| [0.0, -6e-5 * x[1] / r * (1.0 - (x[0] / r).powi(2))],
        |x| hertz_stress(x[0], x[1].abs(), a, p0),
    );
    let side = |backwards| hertz_side(121, 0.01, a, p0, 0.0, backwards);
    let pair = PairTables {
        law: Law::Frictionless,
        varies: false,
        name: "discs".into(),
        surfaces: ["upper.arc".into(), "lower.arc".into()],
        sides: [Some(side(false)), Some(side(true))],
    };
    results(piece, vec![pair], "Two half discs (Hertz)", Units::Si)
}

fn draw_in(name: &str, results: &Results, style: &OutputCase, check: impl FnOnce(&Path)) {
    let directory = tempfile::tempdir().unwrap();
    let written = draw(results, style, directory.path()).unwrap();
    assert!(written.iter().all(|path| path.exists()));
    if let Some(keep) = std::env::var_os("KONTAKT_KEEP") {
        for path in &written {
            let file = path.file_name().unwrap().to_str().unwrap();
            std::fs::copy(path, Path::new(&keep).join(format!("{name}-{file}"))).unwrap();
        }
    }
    check(directory.path());
}

/// Pixels of a PNG, and its width.
fn pixels(path: &Path) -> (Vec<u8>, usize) {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut rgb).unwrap();
    (rgb, info.width as usize)
}

#[test]
fn three_pictures_with_units() {
    draw_in("punch", &punch(ElementKind::Quad8, Units::Si), &STYLE, |directory| {
        let pressure = std::fs::read_to_string(directory.join("pressure.svg")).unwrap();
        assert!(pressure.contains("pressure (MPa)") && pressure.contains("lower.top"));
        let convergence = std::fs::read_to_string(directory.join("convergence.svg")).unwrap();
        assert!(convergence.contains("10⁻⁸") && convergence.contains("active nodes"));
        let (rgb, _) = pixels(&directory.join("bodies.png"));
        // Compression is blue, and much of the picture is bodies.
        let blue = rgb.chunks(3).filter(|p| p[2] > p[0].saturating_add(40)).count();
        assert!(blue > 20_000, "{blue}");
    });
}

#[test]
fn own_units_are_not_named() {
    let style = OutputCase { shown: Shown::Stress(StressComponent::Xx), magnification: Some(1.0), ..STYLE };
    draw_in("own-units", &punch(ElementKind::Quad4, Units::Consistent), &style, |directory| {
        let pressure = std::fs::read_to_string(directory.join("pressure.svg")).unwrap();
        assert!(pressure.contains("pressure") && !pressure.contains("Pa)"));
    });
}

#[test]
fn plastic_strain_is_white_where_there_is_none() {
    let mut results = punch(ElementKind::Quad8, Units::Si);
    let style = OutputCase { shown: Shown::PlasticStrain, magnification: Some(1.0), ..STYLE };
    let e = draw(&results, &style, Path::new("/nonexistent")).unwrap_err();
    assert!(e.to_string().contains("equivalent_plastic_strain"), "{e}");
    let of = |x: &[f64; 3]| (4e-3 - 0.4 * (x[0].hypot(x[1] + 0.01))).max(0.0);
    let values = results.piece.points.iter().map(of).collect();
    let name = "equivalent_plastic_strain".into();
    results.piece.point_fields.push(Field { name, unit: "-", components: 1, values });
    let count = |rgb: &[u8]| rgb.chunks(3).filter(|p| p[0] > p[2].saturating_add(40)).count();
    let mut red = 0;
    draw_in("plastic", &results, &style, |directory| {
        let (rgb, _) = pixels(&directory.join("bodies.png"));
        red = count(&rgb);
        // Nothing is blue, and what has not yielded is as white as a body is.
        assert!(rgb.chunks(3).all(|p| p[2] <= p[0].saturating_add(40)));
        assert!(rgb.chunks(3).filter(|p| *p == [247; 3]).count() > 50_000);
    });
    assert!(red > 5_000, "{red}");
    // Nothing has yielded.
    results.piece.point_fields.last_mut().unwrap().values.fill(0.0);
    draw_in("unyielded", &results, &style, |directory| {
        // The bar alone.
        let (rgb, _) = pixels(&directory.join("bodies.png"));
        assert!(count(&rgb) < 20_000, "{}", count(&rgb));
    });
}

#[test]
fn a_small_contact_gets_its_own_panel_and_many_cells_are_quick() {
    let start = std::time::Instant::now();
    let results = hertz(316);
    let made = start.elapsed();
    draw_in("hertz", &results, &STYLE, |directory| {
        let seconds = (start.elapsed() - made).as_secs_f64();
        println!("{} cells: {seconds:.1} s", results.piece.cells.len());
        assert!(seconds < 60.0, "{seconds} s");
        assert!(pixels(&directory.join("bodies.png")).1 > 1300);
    });
}

/// What the active-set driver does in a load step: some updates, in each of which the residual falls from a jump up.
fn active_set_history(step: u64, lengths: &[u64], active: &[u64]) -> Vec<HistoryRow> {
    let mut rows = Vec::new();
    for (update, (&n, &active)) in lengths.iter().zip(active).enumerate() {
        for i in 0..n {
            rows.push(HistoryRow {
                step,
                alternation: rows.len() as u64 + 1,
                update: update as u64 + 1,
                displacement_jump: 0.4 * 0.3f64.powi(update as i32) * 0.12f64.powi(i as i32),
                force_imbalance: 2e-13 * (1.0 + i as f64),
                active,
                ..HistoryRow::default()
            });
        }
    }
    rows
}

/// A punch pressed in several steps, each with a longer contact; side b carries the pressure or is rigid.
fn pressed_in_steps(n: usize) -> Results {
    let mut results = punch(ElementKind::Quad8, Units::Si);
    let mut steps = Vec::new();
    results.history.clear();
    for k in 1..=n {
        let load = k as f64 / n as f64;
        let side = hertz_side(61, 0.02, 0.018 * load.sqrt(), 1.4e8 * load.sqrt(), 0.0, false);
        let idle = SideTable { pressure: vec![0.0; 61], status: vec![0; 61], ..side.clone() };
        let pairs = vec![PairTables {
            law: Law::Frictionless,
            varies: false,
            name: "punch".into(),
            surfaces: ["upper.bottom".into(), "anvil.surface".into()],
            sides: [Some(side), Some(idle)],
        }];
        let Piece { point_fields, cell_fields, .. } = results.piece.clone();
        results.before.push(State { point_fields, cell_fields, pairs });
        results.history.extend(active_set_history(k as u64, &[5, 4, 7], &[9, 12, 14 + 2 * k as u64]));
        let name = [None, Some("press"), Some("hold")][k % 3].map(String::from);
        let (reason, alternations, updates) = (Reason::Converged, 16, 3);
        let factor = load;
        steps.push(LoadStep {
            name,
            loads: factor,
            supports: 1.0,
            temperature: 1.0,
            at: None,
            paths: Default::default(),
            increments: 1,
            reason,
            alternations,
            updates,
        });
    }
    results.pairs = results.before.pop().expect("the last step").pairs;
    results.run.steps = Some(steps);
    results
}

#[test]
fn pressure_after_each_load_step_and_marks_in_the_convergence() {
    draw_in("steps", &pressed_in_steps(4), &STYLE, |directory| {
        let pressure = std::fs::read_to_string(directory.join("pressure.svg")).unwrap();
        assert!(pressure.contains("step 1, press") && pressure.contains("step 4, press"));
        assert!(pressure.contains("on upper.bottom") && !pressure.contains("anvil"));
        let convergence = std::fs::read_to_string(directory.join("convergence.svg")).unwrap();
        assert!(convergence.contains("step 4") && convergence.contains("active set updated"));
    });
    // More steps than anyone can tell apart.
    draw_in("many-steps", &pressed_in_steps(16), &STYLE, |directory| {
        let pressure = std::fs::read_to_string(directory.join("pressure.svg")).unwrap();
        assert_eq!(pressure.matches("step ").count(), 6);
        assert!(pressure.contains("step 16, press"));
    });
    let mut failed = pressed_in_steps(3);
    failed.run.steps.as_mut().unwrap()[1].reason = Reason::Cycling;
    draw_in("failed-step", &failed, &STYLE, |directory| {
        let convergence = std::fs::read_to_string(directory.join("convergence.svg")).unwrap();
        assert!(convergence.contains("step 2: cycling"));
    });
}

#[test]
fn a_rigid_side_has_no_table() {
    let mut results = punch(ElementKind::Quad8, Units::Si);
    results.history = active_set_history(1, &[7, 6, 40, 9, 12], &[20, 17, 15, 14, 14]);
    results.pairs[0].sides[1] = None;
    // A block under the beam, and a disc on its end.
    let corners = [[0.0, -0.07], [-0.05, -0.07], [-0.05, -0.0405], [-0.02, -0.0405], [-0.02, -0.06]];
    let block: Vec<[f64; 3]> = corners.iter().rev().map(|c| [c[0], c[1], 0.0]).collect();
    let angle = |i: i32| f64::from(i) * std::f64::consts::TAU / 60.0;
    let disc = |i: i32| [0.045 + 0.01 * angle(i).cos(), 0.0105 + 0.01 * angle(i).sin(), 0.0];
    results.run.rigid = vec![
        Outline { body: "block".into(), points: block, motion: [0.0; 3] },
        Outline { body: "disc".into(), points: (0..=60).map(disc).collect(), motion: [0.0, -1e-5, 0.0] },
    ];
    draw_in("rigid", &results, &STYLE, |directory| {
        let pressure = std::fs::read_to_string(directory.join("pressure.svg")).unwrap();
        assert!(pressure.contains("upper.bottom") && !pressure.contains("lower.top<"));
    });
    // As it comes back from the file, and nothing in contact.
    results.pairs[0].sides[1] = Some(SideTable::default());
    let side = results.pairs[0].sides[0].as_mut().unwrap();
    side.pressure.fill(0.0);
    side.status.fill(1);
    draw_in("open", &results, &STYLE, |directory| assert!(directory.join("pressure.svg").exists()));
}

#[test]
fn what_is_not_there_is_not_drawn() {
    let mut results = punch(ElementKind::Quad4, Units::Si);
    results.pairs.clear();
    results.history.clear();
    let style = OutputCase {
        window: Some([[-0.01, -0.005], [0.03, 0.005]]),
        shown: Shown::Stress(StressComponent::Xx),
        ..STYLE
    };
    draw_in("window", &results, &style, |directory| {
        assert!(directory.join("bodies.png").exists());
        assert!(!directory.join("pressure.svg").exists() && !directory.join("convergence.svg").exists());
    });
    // A file without stresses is refused, not drawn wrong.
    results.piece.point_fields.pop();
    let e = draw(&results, &STYLE, Path::new("/nonexistent")).unwrap_err();
    assert!(e.to_string().contains("stress"), "{e}");
}

/// Partial slip after a step that only presses: tractions at 0.3 p beyond |x| = 0.6 a, where it slips.
fn sheared(law: Law, steps: usize) -> Results {
    let mut results = punch(ElementKind::Quad4, Units::Si);
    results.run.title = "Sheared punch".into();
    let (a, p0) = (0.015, 1.4e8);
    let state = |share: f64| {
        let mut side = hertz_side(61, 0.02, a, p0, 0.0, false);
        let bound = |i: usize| law.bound(side.pressure[i]).unwrap_or(0.3 * side.pressure[i]);
        let slips = |i: usize| share > 0.0 && side.touches(i) && side.x[i][0].abs() > 0.6 * a;
        let used = |i: usize| if slips(i) { share } else { 0.4 * share };
        let traction = |i: usize| if side.touches(i) { used(i) * bound(i) } else { 0.0 };
        let tangential = Tangential { traction: (0..61).map(traction).collect(), slip: vec![0.0; 61] };
        let status = (0..61).map(|i| if slips(i) { SLIPS } else { side.status[i] }).collect();
        (side.tangential, side.status) = (Some(tangential), status);
        let surfaces = ["upper.bottom".into(), "anvil.surface".into()];
        vec![PairTables { law, varies: false, name: "punch".into(), surfaces, sides: [Some(side), None] }]
    };
    results.pairs = state(1.0);
    if steps > 1 {
        let Piece { point_fields, cell_fields, .. } = results.piece.clone();
        results.before.push(State { point_fields, cell_fields, pairs: state(0.0) });
        let step = |name: &str| LoadStep {
            name: Some(name.into()),
            loads: 1.0,
            supports: 1.0,
            temperature: 1.0,
            at: None,
            paths: Default::default(),
            increments: 1,
            reason: Reason::Converged,
            alternations: 12,
            updates: 1,
        };
        results.run.steps = Some(vec![step("press"), step("shear")]);
    }
    results
}

#[test]
fn friction_has_a_chart_of_tractions_with_bounds_and_states() {
    let text = |law: Law, steps: usize, name: &str| {
        let mut text = String::new();
        draw_in(name, &sheared(law, steps), &STYLE, |directory| {
            text = std::fs::read_to_string(directory.join("pressure.svg")).unwrap();
        });
        text
    };
    let coulomb = text(Law::Coulomb { friction: 0.3 }, 1, "coulomb");
    for part in ["friction 0.3", "tangential traction (MPa)", "\u{b1}0.3 p", "sticks", "slips", "state"] {
        assert!(coulomb.contains(part), "{part}");
    }
    // The bound is drawn in pieces, on either side of the axis.
    let rough = text(Law::Rough, 1, "rough");
    let lines = |text: &str| text.matches("<polyline").count();
    assert!(lines(&coulomb) > lines(&rough) + 100, "{} and {} lines", lines(&coulomb), lines(&rough));
    assert!(rough.contains("tangential traction") && !rough.contains("bound") && !rough.contains("slips"));
    let tresca = text(Law::Tresca { shear: 2e7 }, 2, "tresca");
    for part in ["bound", "step 1, press", "step 2, shear", "\nstep 1\n", "\nstep 2\n", "on upper.bottom"] {
        assert!(tresca.contains(part), "{part}");
    }
    // Nothing of it without a law.
    draw_in("smooth", &punch(ElementKind::Quad4, Units::Si), &STYLE, |directory| {
        let smooth = std::fs::read_to_string(directory.join("pressure.svg")).unwrap();
        let absent = ["traction", "sticks", "slips", "bound"];
        assert!(smooth.contains("node in contact") && !absent.iter().any(|part| smooth.contains(part)));
    });
}
