//! The price of contact: a whole contact solve against one linear solve of the same two bodies glued together.
//!
//! `scripts/bench --only floor [--json FILE]` writes docs/benchmarks/floor.md.
//!
//! Two half discs (cases/hertz-line) at four sizes of mesh, on 1 and on 2 ranks, from the assembled matrices to the
//! displacements. Linear: one Cholesky factorisation and one solve by MUMPS of the matrix in which the matching nodes of
//! the two surfaces over the width of contact are one node, in the faster of two orderings. All are measured in turn; medians.
mod common;

use common::{FORCE, HALF_WIDTH, PEAK, argument, median};
use kontakt::{
    Error, Result,
    body::{AssembledBody, Body, ResponseKind},
    case::{BodyCase, Case, Region},
    mesh::{Cell, Facet, Mesh},
    petsc::{self, Ksp, Vector},
    scene::{Plan, build_mesh},
    simulation::ContactSolve,
};
use mpi::{topology::SimpleCommunicator, traits::*};
use serde::{Deserialize, Serialize};
use std::{path::Path, process::Command, time::Instant};

/// About how many unknowns are wanted.
const SIZES: [f64; 4] = [5e3, 20e3, 80e3, 320e3];
const RANKS: [usize; 2] = [1, 2];
const STIFFNESS: [f64; 3] = [1e-6, 1.0, 1e6];
/// Of the other linear solvers.
const OTHER_REPETITIONS: usize = 3;
/// Repetitions: more where the runs are short.
const REPETITIONS: [usize; 4] = [15, 9, 7, 5];

/// Orderings of the linear solve, ICNTL(7): approximate minimum degree, which MUMPS takes with a Schur complement whatever it is
/// told, and PORD, which it takes by itself otherwise.
const ORDERINGS: [i32; 2] = [0, 4];

/// Other solvers of the linear system that PETSc has: name, options, largest number of ranks.
const OTHERS: [(&str, &str, i32); 5] = [
    (
        "PETSc Cholesky, nested dissection",
        "-pc_factor_mat_solver_type petsc -pc_factor_mat_ordering_type nd",
        1,
    ),
    ("CHOLMOD", "-pc_factor_mat_solver_type cholmod", 1),
    ("SuperLU", "-pc_type lu -pc_factor_mat_solver_type superlu", 1),
    ("UMFPACK", "-pc_type lu -pc_factor_mat_solver_type umfpack", 1),
    ("CG, GAMG", "-ksp_type cg -pc_type gamg -ksp_rtol 1e-10", 2),
];

/// A relative residual that a linear solve must reach.
const RESIDUAL: f64 = 1e-9;

/// Medians for one size on some ranks, seconds.
#[derive(Serialize, Deserialize)]
struct Row {
    dofs: usize,
    ranks: usize,
    linear_seconds: f64,
    /// By ordering.
    linear_by: [f64; 2],
    contact_seconds: f64,
    /// By the relaxed driver.
    relaxed_seconds: f64,
    ratio: f64,
    /// By the other solvers; none where one does not work.
    others: Vec<Option<f64>>,
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

/// The case with about `dofs` unknowns; the upper body `ratio` times as stiff as the lower one.
fn sized_case(dofs: f64, ratio: f64) -> Result<Case> {
    common::sized_case(dofs, &[format!("material.upper.young = {:e}", 2.1e11 * ratio)])
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

/// One size on the ranks there are.
fn measure(world: &SimpleCommunicator, dofs: f64, repetitions: usize) -> Result<Row> {
    let case = sized_case(dofs, 1.0)?;
    let plan = Plan::new(&case, world)?;
    let (body, mesh) = glued(&case)?;
    let whole = Body::assemble(&body, &case, &mesh, world, &[], ResponseKind::Solver)?;
    let load = whole.load();
    let (mut linear, mut contact) = ([Vec::new(), Vec::new()], Vec::new());
    let mut others = vec![Vec::new(); OTHERS.len()];
    for repetition in 0..repetitions {
        for (ordering, seconds) in std::iter::zip(ORDERINGS, &mut linear) {
            petsc::set_options(&format!("-body_glued_mat_mumps_icntl_7 {ordering}"))?;
            let (time, residual) = solve_linear(world, &whole, &load, "body_glued_")?;
            if residual > RESIDUAL {
                return Err(Error::internal("the linear solve has a large residual"));
            }
            seconds.push(time);
        }
        for (i, (other, seconds)) in std::iter::zip(OTHERS, &mut others).enumerate() {
            if repetition < OTHER_REPETITIONS && world.size() <= other.2 {
                let prefix = format!("other{i}_");
                petsc::set_options(&other.1.replace(" -", &format!(" -{prefix}")).replacen(
                    '-',
                    &format!("-{prefix}"),
                    1,
                ))?;
                // One that fails is left out of the table.
                if let Ok((time, residual)) = solve_linear(world, &whole, &load, &prefix)
                    && residual <= RESIDUAL
                {
                    seconds.push(time);
                }
            }
        }
        contact.push(ContactSolve::run(&case, &plan)?);
    }
    let sets = [String::from("alternation.driver = \"relaxed\"")];
    let relaxed = ContactSolve::run(&common::sized_case(dofs, &sets)?, &plan)?;
    contact_must_converge(&relaxed)?;
    let last = &contact[0];
    contact.iter().try_for_each(contact_must_converge)?;
    let part = |part: fn(&ContactSolve) -> f64| median(contact.iter().map(part).collect());
    let linear_by = linear.map(median);
    let (linear_seconds, contact_seconds) = (linear_by[0].min(linear_by[1]), part(|c| c.seconds));
    Ok(Row {
        dofs: last.dofs,
        ranks: world.size() as usize,
        linear_seconds,
        linear_by,
        contact_seconds,
        relaxed_seconds: relaxed.seconds,
        ratio: contact_seconds / linear_seconds,
        others: others.into_iter().map(|s| (!s.is_empty()).then(|| median(s))).collect(),
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

fn contact_must_converge(solve: &ContactSolve) -> Result<()> {
    match solve.converged {
        true => Ok(()),
        false => Err(Error::internal("the contact solve did not converge")),
    }
}

/// Seconds of set-up and a solve, the largest over the ranks, and the relative residual.
fn solve_linear(
    world: &SimpleCommunicator,
    whole: &AssembledBody,
    load: &[f64],
    prefix: &str,
) -> Result<(f64, f64)> {
    let zeros = || Vector::zeros(world, load.len());
    let (seconds, u) = timed(world, || {
        let ksp = Ksp::new(world, whole.matrix(), prefix, RESIDUAL)?;
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
    Ok((seconds, r.norm()? / b.norm()?))
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
         Contact: everything a contact solve does but meshing, assembly, stresses, error estimate and output; both bodies condensed.\n\n\
         | dofs | ranks | linear s: AMD | PORD | contact s | ratio | relaxed driver s | alternations | error of force | error of peak pressure |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in &results.rows {
        text += &format!(
            "| {} | {} | {:.4} | {:.4} | {:.4} | {:.2} | {:.3} | {} | {:+.3} % | {:+.3} % |\n",
            r.dofs,
            r.ranks,
            r.linear_by[0],
            r.linear_by[1],
            r.contact_seconds,
            r.ratio,
            r.relaxed_seconds,
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
    text += "\nThe same linear system by other solvers of PETSc, seconds, shown without a bound: a direct solver without Schur complement has \
             nothing to\n\
             condense the bodies with.\n\n| dofs | ranks |";
    OTHERS.iter().for_each(|(name, ..)| text += &format!(" {name} |"));
    text += &format!("\n|{}\n", "---|".repeat(OTHERS.len() + 2));
    for r in &results.rows {
        let seconds = r.others.iter().map(|s| s.map_or_else(|| "–".into(), |s| format!("{s:.4}")));
        text += &format!("| {} | {} | {} |\n", r.dofs, r.ranks, seconds.collect::<Vec<_>>().join(" | "));
    }
    text += "\nAlternations to 1e-8 by the ratio of the moduli:\n\n| dofs |";
    STIFFNESS.iter().for_each(|ratio| text += &format!(" E_A/E_B = {ratio:e} |"));
    text += &format!("\n|{}\n", "---|".repeat(STIFFNESS.len() + 1));
    for c in &results.counts {
        let counts: Vec<String> = c.alternations.iter().map(usize::to_string).collect();
        text += &format!("| {} | {} |\n", c.dofs, counts.join(" | "));
    }
    text
}

fn json(r: &Row) -> serde_json::Value {
    let fastest = std::iter::zip(OTHERS, &r.others).filter_map(|(o, s)| Some((o.0, (*s)?)));
    let fastest = fastest.min_by(|a, b| a.1.total_cmp(&b.1));
    serde_json::json!({
        "dofs": r.dofs,
        "ranks": r.ranks,
        "linear_seconds": r.linear_seconds,
        "contact_seconds": r.contact_seconds,
        "relaxed_seconds": r.relaxed_seconds,
        "ratio": r.ratio,
        "relaxed_ratio": r.relaxed_seconds / r.linear_seconds,
        "fastest_other": fastest.map(|f| f.0),
        "fastest_other_seconds": fastest.map(|f| f.1),
    })
}

fn main() -> Result<()> {
    if let Some(file) = argument("--worker") {
        return worker(&file);
    }
    let mut all = Results::default();
    for ranks in RANKS {
        let results = on_ranks(ranks)?;
        all.rows.extend(results.rows);
        all.counts.extend(results.counts);
    }
    common::write_page("floor.md", &page(&all))?;
    let counts = all.counts.iter().map(
        |c| serde_json::json!({ "dofs": c.dofs, "stiffness": STIFFNESS, "alternations": c.alternations }),
    );
    common::add_json("alternations", counts.collect())?;
    common::add_json("floor", all.rows.iter().map(json).collect())
}
