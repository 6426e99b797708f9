//! How many alternations each weight needs, by stiffness ratio: the paper's alternation on a cylinder on a block.
//!
//! `cargo bench --bench weights` writes docs/benchmarks/weights.md.
//!
//! Cylinder on block, frictionless, plane strain, quad4, matching nodes: R = 0.05 m, E_B = 210 GPa, nu = 0.3. Block
//! |x| <= 0.05, -0.05 <= y <= 0, bottom clamped; upper body from the arc (|x| <= 0.04) up to y = 0.05, its top moved
//! by (0, -2e-4) m. Counted: alternations until the contact forces are within 1e-8 of the discrete solution.
//!
//! With friction the same, moved by 1.5e-5 m along the surface as well, and two equal blocks of 0.04 m by 0.02 m, the lower one
//! clamped below, the top of the upper one moved by (2.5e-6, -1e-5) m; the discrete solution is the default driver's.
use kontakt::vector::smaller;
use kontakt::{
    Error, Result,
    body::Response,
    case::{self, Case},
    petsc,
    schwarz::{
        ActiveSet, Alternation, Coarse, Coupling, Ended, Limits, PairRows, Reason, Touch, Watch,
        weights::Weights,
    },
    simulation::{Plan, on_contact_rows},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::fmt::Write;

const RATIOS: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 1e4, 1e-4];
/// Of the tables with friction.
const FRICTION_RATIOS: [f64; 5] = [1.0, 2.0, 10.0, 1e4, 1e-4];
const FRICTIONS: [f64; 4] = [0.0, 0.1, 0.3, 1.0];
const WEIGHTS: [(&str, Weights); 6] = [
    ("constant 0.5", Weights::Constant(0.5)),
    ("ratio per component (34, 36)", Weights::Component),
    ("ratio of magnitudes (32, 35)", Weights::Magnitude),
    ("response per node", Weights::Response),
    ("response per surface", Weights::ResponseSurface),
    ("stiffness", Weights::Stiffness),
];

/// x of the contact nodes: 121 uniform in |x| <= 0.01, 12 elements to each side up to `end`, geometric.
fn columns(end: f64) -> Vec<f64> {
    let h = 0.02 / 120.0;
    let side = geometric(end - 0.01, 12, h);
    let mut x: Vec<f64> = side.iter().rev().map(|d| -0.01 - d).collect();
    x.extend((0..=120).map(|i| (f64::from(i) - 60.0) * h));
    x.extend(side.iter().map(|d| 0.01 + d));
    x
}

/// Distances of `n` nodes: the first cell has size `first`, the last ends at `length`.
fn geometric(length: f64, n: usize, first: f64) -> Vec<f64> {
    let sum = |q: f64| (0..n).map(|i| first * q.powi(i as i32)).sum::<f64>();
    let (mut low, mut high) = (1.0, 10.0);
    for _ in 0..200 {
        let q = 0.5 * (low + high);
        if sum(q) < length { low = q } else { high = q }
    }
    let mut at = 0.0;
    (0..n)
        .map(|i| {
            at += first * low.powi(i as i32);
            at
        })
        .collect()
}

fn list(values: impl IntoIterator<Item = f64>) -> String {
    let text: Vec<String> = values.into_iter().map(|v| format!("{v:e}")).collect();
    format!("{{ at = [{}], cells = [{}] }}", text.join(", "), vec!["1"; text.len() - 1].join(", "))
}

/// What `friction` is, how far the upper body's top moves along the surface, m, and the transfer.
#[derive(Clone, Copy)]
struct Rubbing {
    friction: f64,
    along: f64,
    transfer: &'static str,
}

const SMOOTH: Rubbing = Rubbing { friction: 0.0, along: 0.0, transfer: "pointwise" };

/// The case text of a ratio of moduli.
type Scene = fn(f64, Rubbing) -> String;

/// Two equal blocks on each other.
fn blocks(ratio: f64, Rubbing { friction, along, transfer }: Rubbing) -> String {
    format!(
        r#"{head}[[body]]
name = "upper"
material = "a"
element = "quad4"
mesh.rectangle = {{ x = {{ from = 0, to = 0.04, cells = 32 }}, y = {{ from = 0, to = 0.02, cells = 16 }} }}
[[body.support]]
surface = "top"
x = {along:e}
y = -1e-5
[[body]]
name = "lower"
material = "b"
element = "quad4"
mesh.rectangle = {{ x = {{ from = 0, to = 0.04, cells = 32 }}, y = {{ from = -0.02, to = 0, cells = 16 }} }}
[[body.support]]
surface = "bottom"
x = 0
y = 0
[[contact]]
name = "contact"
surfaces = ["upper.bottom", "lower.top"]
friction = {friction}
"#,
        head = head(ratio, transfer),
    )
}

/// Plane strain by the paper's alternation; the first material `ratio` times stiffer than the second one.
fn head(ratio: f64, transfer: &str) -> String {
    format!(
        r#"
analysis = "plane strain"
alternation = {{ driver = "relaxed", transfer = "{transfer}" }}
[material.a]
young = {young:e}
poisson = 0.3
[material.b]
young = 2.1e11
poisson = 0.3
"#,
        young = 2.1e11 * ratio,
    )
}

fn cylinder(ratio: f64, Rubbing { friction, along, transfer }: Rubbing) -> String {
    let depth = geometric(1.0, 24, 0.02 / 120.0 / 0.05);
    let up = std::iter::once(0.0).chain(depth.iter().copied().take(23)).chain([1.0]);
    let down = depth.iter().take(23).map(|d| -0.05 * d).chain([-0.05]).rev_list().chain([0.0]);
    let half = 0.8_f64.asin();
    let u = columns(0.04).into_iter().map(|x| 0.5 + 0.5 * (x.clamp(-0.04, 0.04) / 0.05).asin() / half);
    let mut u: Vec<f64> = u.collect();
    let last = u.len() - 1;
    (u[0], u[last]) = (0.0, 1.0);
    let mut x = columns(0.05);
    (x[0], x[last]) = (-0.05, 0.05);
    format!(
        r#"{head}[[body]]
name = "cylinder"
material = "a"
element = "quad4"
mesh.block = {{ corners = [[-0.04, 0.02], [0.04, 0.02], [0.04, 0.05], [-0.04, 0.05]], arcs = {{ bottom = [0, 0.05] }}, u = {u}, v = {v} }}
[[body.support]]
surface = "top"
x = {along:e}
y = -2e-4
[[body]]
name = "block"
material = "b"
element = "quad4"
mesh.rectangle = {{ x = {x}, y = {y} }}
[[body.support]]
surface = "bottom"
x = 0
y = 0
[[contact]]
name = "contact"
surfaces = ["cylinder.bottom", "block.top"]
within = {{ x = [-0.01, 0.01] }}
friction = {friction}
"#,
        head = head(ratio, transfer),
        u = list(u),
        v = list(up),
        x = list(x),
        y = list(down),
    )
}

trait RevList: Iterator<Item = f64> + Sized {
    fn rev_list(self) -> std::vec::IntoIter<f64> {
        let mut all: Vec<f64> = self.collect();
        all.reverse();
        all.into_iter()
    }
}
impl<I: Iterator<Item = f64>> RevList for I {}

/// Alternations until the contact forces are within 1e-8 of `exact`, or how it fails.
fn count(
    coupling: &mut Coupling<Response>,
    rows: &[PairRows],
    coarse: &Coarse,
    weights: Weights,
    exact: &mut Option<Vec<f64>>,
) -> Result<String> {
    // The reference must be converged far below what is measured.
    let limit = if exact.is_none() { 60 } else { 300 };
    let friction = rows.iter().any(|rows| rows.law.is_frictional());
    let limits = Limits { tolerance: 1e-30, max_alternations: limit, friction };
    let mut state = ActiveSet::new(coupling, rows, coarse, limits, 1, 1);
    let mut alternation = Alternation::new(&mut state, weights, None)?;
    let mut watch = Watch::new(0.0);
    let mut errors = Vec::new();
    for _ in 0..limit {
        let measures = alternation.alternate(|_| {})?;
        let forces = &alternation.rows.force;
        let Some(exact) = exact.as_ref() else { continue };
        let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|f| f * f).sum::<f64>().sqrt();
        let size = norm(&mut exact.iter().copied());
        errors.push(norm(&mut std::iter::zip(forces, exact).map(|(f, e)| f - e)) / size);
        if errors.last().is_some_and(|e| *e <= 1e-8) {
            return Ok(errors.len().to_string());
        }
        if watch.observe(measures.jump, 0) == Some(Reason::Diverging) {
            return Ok("diverges".into());
        }
    }
    if exact.is_none() {
        *exact = Some(alternation.rows.force.clone());
        return Ok(String::new());
    }
    let best = errors.iter().copied().fold(f64::INFINITY, smaller);
    Ok(if best < 0.05 { format!("stalls at {best:.0e}") } else { "diverges".into() })
}

/// The contact forces of the default driver, and how many nodes touch and slip.
fn exact_with_friction(
    coupling: &mut Coupling<Response>,
    rows: &[PairRows],
    coarse: &Coarse,
) -> Result<(Vec<f64>, [usize; 2])> {
    let limits = Limits { tolerance: 1e-12, max_alternations: 60, friction: true };
    let mut state = ActiveSet::new(coupling, rows, coarse, limits, 1, 1);
    match state.run_with_friction(None, |_| {})? {
        Ended::Outcome(outcome) if outcome.reason.converged() => {}
        _ => return Err(Error::internal("the default driver did not converge")),
    }
    let touch = state.touch(0..state.coupling.n_rows);
    let normal = &touch[..rows.iter().map(PairRows::n_normal).sum()];
    let count = |is: &dyn Fn(&Touch) -> bool| normal.iter().filter(|touch| is(touch)).count();
    let counts = [count(&|touch| *touch != Touch::Open), count(&|touch| touch.slips().is_some())];
    Ok((state.force, counts))
}

/// Reads the case of a text.
fn read(text: &str) -> Result<Case> {
    let directory = std::env::temp_dir().join(format!("kontakt-weights-{}", std::process::id()));
    let file = directory.join("case.toml");
    std::fs::create_dir_all(&directory)
        .and_then(|()| std::fs::write(&file, text))
        .map_err(Error::internal)?;
    let case = case::read(&file, None, &[]);
    let _ = std::fs::remove_dir_all(directory);
    case
}

/// A table of a scene with friction: in each cell the counts for all coefficients.
fn with_friction(world: &SimpleCommunicator, scene: Scene, rubbing: Rubbing) -> Result<String> {
    let mut tally = Tally::default();
    let mut text = String::from("| E_A/E_B | nodes that slip |");
    WEIGHTS.iter().for_each(|(name, _)| write!(text, " {name} |").expect("a string grows"));
    text += &format!("\n|{}\n", "---|".repeat(WEIGHTS.len() + 2));
    for ratio in FRICTION_RATIOS {
        let mut cells = vec![Vec::new(); WEIGHTS.len() + 1];
        for friction in FRICTIONS {
            let case = read(&scene(ratio, Rubbing { friction, ..rubbing }))?;
            let plan = Plan::new(&case, world)?;
            let column = on_contact_rows(&case, &plan, |coupling, rows, coarse| {
                let (exact, [touching, slipping]) = match friction {
                    // Without tangential rows the alternation finds it.
                    0.0 => {
                        let mut exact = None;
                        count(coupling, rows, coarse, Weights::Stiffness, &mut exact)?;
                        (exact, [0, 0])
                    }
                    _ => {
                        let (exact, counts) = exact_with_friction(coupling, rows, coarse)?;
                        (Some(exact), counts)
                    }
                };
                let slip = if friction == 0.0 { "–".into() } else { format!("{slipping} of {touching}") };
                let counts = WEIGHTS
                    .iter()
                    .map(|(_, weights)| count(coupling, rows, coarse, *weights, &mut exact.clone()));
                std::iter::once(Ok(slip)).chain(counts).collect::<Result<Vec<String>>>()
            })?;
            std::iter::zip(&mut cells, column).for_each(|(cell, value)| cell.push(value));
        }
        cells[1..].iter().for_each(|counts| tally.add(counts));
        let cells: Vec<String> = cells.iter().map(|cell| cell.join(" / ")).collect();
        let row = format!("| {ratio:e} | {} |", cells.join(" | "));
        println!("{row}");
        text += &row;
        text.push('\n');
    }
    Ok(format!("{text}\n{}\n", tally.sentence()))
}

/// What friction does to the number of alternations where they converge without it.
#[derive(Default)]
struct Tally {
    no_more: usize,
    /// Alternations over those without friction.
    factors: Vec<f64>,
    fails: usize,
}

impl Tally {
    /// The counts of all coefficients, the first without friction.
    fn add(&mut self, counts: &[String]) {
        let number = |text: &String| text.parse::<f64>().ok();
        let Some((smooth, others)) = counts.split_first().and_then(|(a, rest)| Some((number(a)?, rest)))
        else {
            return;
        };
        for count in others.iter().map(number) {
            match count {
                Some(count) if count <= smooth => self.no_more += 1,
                Some(count) => self.factors.push(count / smooth),
                None => self.fails += 1,
            }
        }
    }

    fn sentence(&self) -> String {
        let mut factors = self.factors.clone();
        factors.sort_by(f64::total_cmp);
        let median = factors.get(factors.len() / 2).copied().unwrap_or(1.0);
        format!(
            "Where the alternation converges without friction, it takes no more alternations with it in {} of {} cases, more in {} \
             ({median:.1} times as many in the median), and does not converge in {}.",
            self.no_more,
            self.no_more + factors.len() + self.fails,
            factors.len(),
            self.fails
        )
    }
}

fn friction_text(world: &SimpleCommunicator) -> Result<String> {
    let scenes: [(&str, Scene, Rubbing); 4] = [
        (
            "Cylinder on block, pressed only, mortar transfer",
            cylinder,
            Rubbing { transfer: "mortar", ..SMOOTH },
        ),
        ("Two equal blocks, pressed only, nodes that match", blocks, SMOOTH),
        (
            "Cylinder on block, pressed and pushed along, mortar transfer",
            cylinder,
            Rubbing { along: 1.5e-5, transfer: "mortar", ..SMOOTH },
        ),
        (
            "Two equal blocks, pressed and pushed along, nodes that match",
            blocks,
            Rubbing { along: 2.5e-6, ..SMOOTH },
        ),
    ];
    let mut text = String::from(FRICTION_HEAD);
    for (name, scene, rubbing) in scenes {
        println!("{name}");
        text += &format!("\n{name}:\n\n{}", with_friction(world, scene, rubbing)?);
    }
    Ok(text)
}

const FRICTION_HEAD: &str = "\n## With friction\n\n\
Each cell: alternations for mu = 0 / 0.1 / 0.3 / 1, until normal and tangential forces are within 1e-8 of those of the default\n\
driver, which takes one for any of them; beside the ratio of the moduli how many of the nodes in contact slip.\n\n\
The paper remarks that friction does not increase the number of contact iterations. It does: with equal moduli the cylinder\n\
takes 1.5 to 2 times as many at any mu, pressed only or pushed along, and with other moduli weights stall or diverge that are\n\
safe without friction. The weight by stiffness suffers least. The reason: a body pressed across its surface moves along it, too,\n\
two bodies that face each other with opposite signs, so that even equal ones are not in proportion, as weights need it (the\n\
equal blocks are, without friction: one alternation); and the force of a node that slides follows the pressure an alternation\n\
late. The remark comes near the truth where nearly all nodes slide against weak friction.\n";

fn table(world: &SimpleCommunicator) -> Result<String> {
    let mut text = String::from(
        "# Alternations by weight and stiffness ratio\n\n\
         Written by `cargo bench --bench weights`. Cylinder on block (R = 0.05 m, 121 candidate nodes, matching), the paper's\n\
         alternation; counted until the contact forces are within 1e-8 of the discrete solution.\n\n| E_A/E_B |",
    );
    WEIGHTS.iter().for_each(|(name, _)| write!(text, " {name} |").expect("a string grows"));
    text += &format!("\n|{}\n", "---|".repeat(WEIGHTS.len() + 1));
    for ratio in RATIOS {
        let case = read(&cylinder(ratio, SMOOTH))?;
        let plan = Plan::new(&case, world)?;
        let row = on_contact_rows(&case, &plan, |coupling, rows, coarse| {
            let mut exact = None;
            count(coupling, rows, coarse, Weights::Stiffness, &mut exact)?;
            let mut row = format!("| {ratio:e} |");
            for (_, weights) in WEIGHTS {
                row += &format!(" {} |", count(coupling, rows, coarse, weights, &mut exact)?);
            }
            Ok(row)
        })?;
        println!("{row}");
        text += &row;
        text.push('\n');
    }
    Ok(text + &friction_text(world)?)
}

fn main() -> Result<()> {
    let universe = mpi::initialize().ok_or_else(|| Error::internal("MPI is already running"))?;
    let session = petsc::Session::start()?;
    let text = table(&universe.world())?;
    drop(session);
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/benchmarks/weights.md");
    std::fs::create_dir_all(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/benchmarks"))
        .and_then(|()| std::fs::write(path, text))
        .map_err(Error::internal)?;
    let _ = universe.world().rank();
    println!("written to docs/benchmarks/weights.md");
    Ok(())
}
