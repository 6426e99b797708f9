//! The price of contact: a whole contact solve against one linear solve of the same two bodies glued together.
//!
//! `scripts/bench --only floor [--json FILE]` writes docs/benchmarks/floor.md.
//!
//! Two half discs (cases/hertz-line) at four sizes of mesh, on 1 and on 2 ranks, from the assembled matrices to the
//! displacements. Linear: one Cholesky factorisation and one solve by MUMPS of the matrix in which the matching nodes of
//! the two surfaces over the width of contact are one node, in the faster of two orderings. All are measured in turn; medians.
use kontakt::{
    Error, Result,
    body::{AssembledBody, Body, ResponseKind},
    case::{self, BodyCase, Case, Region},
    mesh::{Cell, Facet, Mesh},
    petsc::{self, Ksp, Vector},
    simulation::{ContactSolve, Plan, build_mesh},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use serde::{Deserialize, Serialize};
use std::{
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

/// Unknowns of the case as written, and about how many are wanted.
const CASE_DOFS: f64 = 38_104.0;
const SIZES: [f64; 4] = [5e3, 20e3, 80e3, 300e3];
const RANKS: [usize; 2] = [1, 2];
const STIFFNESS: [f64; 3] = [1e-6, 1.0, 1e6];
/// Repetitions: more where the runs are short.
const REPETITIONS: [usize; 4] = [15, 9, 7, 5];

/// Orderings of the linear solve, ICNTL(7): approximate minimum degree, which MUMPS takes with a Schur complement whatever it is
/// told, and PORD, which it takes by itself otherwise.
const ORDERINGS: [i32; 2] = [0, 4];

/// Hertz for equal moduli: force, N, peak pressure, Pa, half-width, m; the first two grow with the effective modulus.
const FORCE: f64 = 1e6;
const PEAK: f64 = 1.212074e9;
const HALF_WIDTH: f64 = 5.25232e-4;

/// Medians for one size on some ranks, seconds.
#[derive(Serialize, Deserialize)]
struct Row {
    dofs: usize,
    ranks: usize,
    linear_seconds: f64,
    /// By ordering.
    linear_by: [f64; 2],
    contact_seconds: f64,
    ratio: f64,
    /// Factor, condense, interface, search, alternate, recover.
    split: [f64; 6],
    alternations: usize,
    /// Relative, of force and peak pressure.
    errors: [f64; 2],
}

/// Alternations by stiffness ratio.
#[derive(Serialize, Deserialize)]
struct Counts {
    dofs: usize,
    alternations: Vec<usize>,
}

#[derive(Default, Serialize, Deserialize)]
struct Results {
    rows: Vec<Row>,
    counts: Vec<Counts>,
}

/// The case with element sizes for about `dofs` unknowns; the upper body `ratio` times as stiff as the lower one.
fn sized_case(dofs: f64, ratio: f64) -> Result<Case> {
    let h = (CASE_DOFS / dofs).sqrt();
    let mut sets =
        vec![format!("material.upper.young = {:e}", 2.1e11 * ratio), "alternation.tolerance = 1e-8".into()];
    for body in ["upper", "lower"] {
        let key = format!("body.{body}.mesh.half_disc");
        // A node on the axis, whatever the size.
        sets.push(format!("{key}.angle.at = [-45, -1.2, 0, 1.2, 45]"));
        sets.push(format!("{key}.angle.size = [{0}, {1}, {1}, {1}, {0}]", 4.0 * h, 0.05 * h));
        sets.push(format!("{key}.depth.size = [{0:e}, {0:e}, {1}]", 8.75e-4 * h, 0.08 * h));
        sets.push(format!("{key}.core = {}", (6.0 / h).round()));
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/hertz-line/case.toml");
    case::read(&file, None, &sets)
}

/// Both bodies as one: nodes of the two arcs with the same x within the half-width become one, half-way.
fn glued(case: &Case) -> Result<(BodyCase, Mesh)> {
    let mut mesh = Mesh { dim: 2, ..Mesh::default() };
    let mut body = case.bodies[0].clone();
    let mut first: Vec<usize> = Vec::new();
    body.name = "glued".into();
    body.supports.clear();
    for (b, part) in case.bodies.iter().enumerate() {
        let own = build_mesh(&part.geometry)?;
        let mut in_reach: Vec<usize> = own.surfaces["arc"]
            .iter()
            .flat_map(|f| own.facet_nodes(*f))
            .map(|n| n as usize)
            .filter(|&n| own.points[n][0].abs() <= HALF_WIDTH)
            .collect();
        in_reach.sort_by(|&m, &n| own.points[m][0].total_cmp(&own.points[n][0]));
        in_reach.dedup();
        let mut number: Vec<Option<u32>> = vec![None; own.points.len()];
        if b == 1 {
            if first.len() != in_reach.len() {
                return Err(Error::internal("the surfaces do not match"));
            }
            for (&there, &here) in std::iter::zip(&first, &in_reach) {
                let (p, q) = (mesh.points[there], own.points[here]);
                if (p[0] - q[0]).abs() > 1e-9 {
                    return Err(Error::internal("the surfaces do not match"));
                }
                mesh.points[there] = [0, 1, 2].map(|c| 0.5 * (p[c] + q[c]));
                number[here] = Some(there as u32);
            }
        }
        for (point, number) in std::iter::zip(&own.points, &mut number) {
            if number.is_none() {
                *number = Some(mesh.points.len() as u32);
                mesh.points.push(*point);
            }
        }
        let first_cell = mesh.cells.len() as u32;
        for cell in &own.cells {
            let nodes: Vec<u32> = cell.nodes().iter().filter_map(|&n| number[n as usize]).collect();
            mesh.cells.push(Cell::new(cell.kind, &nodes));
        }
        let flat = format!("{} flat", part.name);
        let moved = own.surfaces["flat"].iter().map(|f| Facet { cell: f.cell + first_cell, ..*f });
        mesh.surfaces.insert(flat.clone(), moved.collect());
        for support in &part.supports {
            let mut support = support.clone();
            if let Region::Surface { name, .. } = &mut support.region {
                *name = flat.clone();
            }
            body.supports.push(support);
        }
        first = in_reach;
    }
    Ok((body, mesh))
}

/// Seconds of `work`, the largest over the ranks.
fn timed<T>(world: &SimpleCommunicator, work: impl FnOnce() -> Result<T>) -> Result<(f64, T)> {
    world.barrier();
    let start = Instant::now();
    let done = work()?;
    Ok((kontakt::parallel::max(world, &[start.elapsed().as_secs_f64()])[0], done))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// One size on the ranks there are.
fn measure(world: &SimpleCommunicator, dofs: f64, repetitions: usize) -> Result<Row> {
    let case = sized_case(dofs, 1.0)?;
    let plan = Plan::new(&case, world)?;
    let (body, mesh) = glued(&case)?;
    let whole = Body::assemble(&body, case.analysis, &mesh, world, &[], ResponseKind::Solver)?;
    let load = whole.load();
    let (mut linear, mut contact) = ([Vec::new(), Vec::new()], Vec::new());
    for _ in 0..repetitions {
        for (ordering, seconds) in std::iter::zip(ORDERINGS, &mut linear) {
            seconds.push(solve_linear(world, &whole, &load, ordering)?);
        }
        contact.push(ContactSolve::run(&case, &plan)?);
    }
    let last = &contact[0];
    if !contact.iter().all(|c| c.converged) {
        return Err(Error::internal("the contact solve did not converge"));
    }
    let part = |part: fn(&ContactSolve) -> f64| median(contact.iter().map(part).collect());
    let linear_by = linear.map(median);
    let (linear_seconds, contact_seconds) = (linear_by[0].min(linear_by[1]), part(|c| c.seconds));
    Ok(Row {
        dofs: last.dofs,
        ranks: world.size() as usize,
        linear_seconds,
        linear_by,
        contact_seconds,
        ratio: contact_seconds / linear_seconds,
        split: [
            part(|c| c.split.factor),
            part(|c| c.split.condense),
            part(|c| c.split.interface),
            part(|c| c.split.search),
            part(|c| c.split.alternate),
            part(|c| c.split.recover),
        ],
        alternations: last.alternations,
        errors: [last.pairs[0].normal_force / FORCE - 1.0, last.pairs[0].max_pressure / PEAK - 1.0],
    })
}

/// Seconds of a factorisation and a solve, the largest over the ranks.
fn solve_linear(
    world: &SimpleCommunicator,
    whole: &AssembledBody,
    load: &[f64],
    ordering: i32,
) -> Result<f64> {
    petsc::set_options(&format!("-body_glued_mat_mumps_icntl_7 {ordering}"))?;
    let zeros = || Vector::zeros(world, load.len());
    let (seconds, u) = timed(world, || {
        let ksp = Ksp::new(world, whole.matrix(), "body_glued_")?;
        ksp.set_up()?;
        let (b, x) = (zeros()?, zeros()?);
        b.set(load)?;
        ksp.solve(&b, &x)?;
        x.to_vec()
    })?;
    let (x, r, b) = (zeros()?, zeros()?, zeros()?);
    x.set(&u)?;
    b.set(load)?;
    whole.matrix().times(&x, &r)?;
    r.set(&std::iter::zip(r.to_vec()?, load).map(|(ax, b)| ax - b).collect::<Vec<_>>())?;
    match r.norm()? <= 1e-9 * b.norm()? {
        true => Ok(seconds),
        false => Err(Error::internal("the linear solve has a large residual")),
    }
}

/// Everything on the ranks there are.
fn work(world: &SimpleCommunicator) -> Result<Results> {
    let mut results = Results::default();
    for (dofs, repetitions) in std::iter::zip(SIZES, REPETITIONS) {
        results.rows.push(measure(world, dofs, repetitions)?);
    }
    if world.size() == 1 {
        for dofs in SIZES {
            let mut counts = Counts { dofs: 0, alternations: Vec::new() };
            for ratio in STIFFNESS {
                let case = sized_case(dofs, ratio)?;
                let solve = ContactSolve::run(&case, &Plan::new(&case, world)?)?;
                if !solve.converged {
                    return Err(Error::internal(format!("stiffness ratio {ratio:e} does not converge")));
                }
                counts.dofs = solve.dofs;
                counts.alternations.push(solve.alternations);
            }
            results.counts.push(counts);
        }
    }
    Ok(results)
}

/// On the ranks that mpirun has started: leaves the results in `file`.
fn worker(file: &Path) -> Result<()> {
    let universe = mpi::initialize().ok_or_else(|| Error::internal("MPI is already running"))?;
    let session = petsc::Session::start()?;
    let world = universe.world();
    let results = work(&world)?;
    if world.rank() == 0 {
        let text = serde_json::to_string(&results).map_err(Error::internal)?;
        std::fs::write(file, text).map_err(Error::internal)?;
    }
    drop(session);
    Ok(())
}

/// Starts this program on so many ranks.
fn on_ranks(ranks: usize) -> Result<Results> {
    let this = std::env::current_exe().map_err(Error::internal)?;
    let file = std::env::temp_dir().join(format!("kontakt-floor-{}-{ranks}.json", std::process::id()));
    let mut command = Command::new("mpirun");
    command.args(["-q", "-n", &ranks.to_string()]).arg(this).arg("--worker").arg(&file);
    let status = command.status().map_err(|e| Error::internal(format!("mpirun: {e}")))?;
    let text = std::fs::read_to_string(&file);
    let _ = std::fs::remove_file(&file);
    match status.success() {
        true => serde_json::from_str(&text.map_err(Error::internal)?).map_err(Error::internal),
        false => Err(Error::internal(format!("the benchmark failed on {ranks} rank(s)"))),
    }
}

fn page(results: &Results) -> String {
    let mut text = String::from(
        "# Contact against one linear solve\n\n\
         Written by `scripts/bench --only floor`. Two half discs pressed together (cases/hertz-line, meshes of one family); seconds \
         are wall, the\n\
         largest over the ranks, from the assembled matrices to the displacements; medians of interleaved repetitions.\n\n\
         Linear: one MUMPS Cholesky factorisation and one solve of the two bodies glued together over the width of contact, in \
         the faster of two\n\
         orderings: AMD, which MUMPS always takes with a Schur complement, and PORD, its own choice without one, whose analysis \
         is slow.\n\
         Contact: everything a contact solve does but meshing, assembly, stresses and output; both bodies condensed.\n\n\
         | dofs | ranks | linear s: AMD | PORD | contact s | ratio | alternations | error of force | error of peak pressure |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for r in &results.rows {
        text += &format!(
            "| {} | {} | {:.4} | {:.4} | {:.4} | {:.2} | {} | {:+.3} % | {:+.3} % |\n",
            r.dofs,
            r.ranks,
            r.linear_by[0],
            r.linear_by[1],
            r.contact_seconds,
            r.ratio,
            r.alternations,
            100.0 * r.errors[0],
            100.0 * r.errors[1]
        );
    }
    text += "\nWhere the contact solve spends its seconds (each part the largest over the ranks, so that on 2 ranks they add up to \
             more; bodies on\n\
             different ranks wait for each other in the alternation):\n\n\
             | dofs | ranks | factor | condense loads | interface operators | search and rows | alternation | recovery |\n\
             |---|---|---|---|---|---|---|---|\n";
    for r in &results.rows {
        let parts: Vec<String> = r.split.iter().map(|s| format!("{s:.4}")).collect();
        text += &format!("| {} | {} | {} |\n", r.dofs, r.ranks, parts.join(" | "));
    }
    text += "\nWhat contact costs more than the linear solve: the unknowns of the interface must be eliminated last, which leaves the \
             ordering of a body\n\
             less choice than the glued bodies have, so that the two factorisations take more operations than the one; the rest is \
             small. Condensing and\n\
             recovery are the two halves of one solve. On 2 ranks each body has a rank of its own, while the linear solve shares one \
             matrix.\n";
    text += "\nAlternations to 1e-8 by the ratio of the moduli:\n\n| dofs |";
    STIFFNESS.iter().for_each(|ratio| text += &format!(" E_A/E_B = {ratio:e} |"));
    text += &format!("\n|{}\n", "---|".repeat(STIFFNESS.len() + 1));
    for c in &results.counts {
        let counts: Vec<String> = c.alternations.iter().map(usize::to_string).collect();
        text += &format!("| {} | {} |\n", c.dofs, counts.join(" | "));
    }
    text
}

/// Adds this benchmark's numbers to the JSON object in `file`, which other benchmarks may have begun.
fn write_json(file: &Path, rows: &[Row]) -> Result<()> {
    let mut all = match std::fs::read_to_string(file) {
        Ok(text) => serde_json::from_str(&text).map_err(Error::internal)?,
        Err(_) => serde_json::json!({}),
    };
    let rows = rows.iter().map(|r| {
        serde_json::json!({
            "dofs": r.dofs,
            "ranks": r.ranks,
            "linear_seconds": r.linear_seconds,
            "contact_seconds": r.contact_seconds,
            "ratio": r.ratio,
        })
    });
    all["floor"] = rows.collect();
    let text = serde_json::to_string_pretty(&all).map_err(Error::internal)?;
    std::fs::write(file, text + "\n").map_err(Error::internal)
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |key: &str| {
        arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1)).map(PathBuf::from)
    };
    if let Some(file) = value("--worker") {
        return worker(&file);
    }
    let mut all = Results::default();
    for ranks in RANKS {
        let results = on_ranks(ranks)?;
        all.rows.extend(results.rows);
        all.counts.extend(results.counts);
    }
    let text = page(&all);
    println!("{text}");
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/benchmarks");
    std::fs::create_dir_all(&directory)
        .and_then(|()| std::fs::write(directory.join("floor.md"), text))
        .map_err(Error::internal)?;
    if let Some(file) = value("--json") {
        write_json(&file, &all.rows)?;
    }
    Ok(())
}
