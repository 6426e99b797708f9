//! The command line: `kontakt run CASE`, `kontakt check CASE`, `kontakt study CASE`.
mod flags;

use clap::{Args, Parser, Subcommand};
use kontakt::{
    Error, Result,
    body::options_prefix,
    case::{self, Case},
    output,
    parallel::{self, agree},
    petsc, plain_text,
    record::{AdaptRound, HistoryRow, Summary},
    scene, simulation, study,
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{io::IsTerminal, path::PathBuf};

/// Contact of deformable bodies by the Schwarz alternating method on MPI rank groups.
///
/// A case file describes bodies, supports, loads and contact pairs; docs/case-file.md has every key. Each body is solved
/// by its own group of ranks; only contact displacements and forces are exchanged.
///
///   mpirun -n 2 kontakt run cases/heated-gap --variant C
///
/// PETSc options of a body's solver may follow, with the body's prefix: -body_upper_ksp_type cg -body_upper_pc_type gamg.
/// PETSc's own may, too: -log_view, -memory_view, -options_left.
///
/// Exit codes: 0 converged, 1 internal error, 2 wrong input, 3 not converged, 4 unrestrained motion,
/// 5 the accuracy that --adapt asks for not reached, 6 not enough memory.
#[derive(Parser)]
#[command(version, verbatim_doc_comment)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Solve a case and write result.vtkhdf, summary.json and pictures.
    Run {
        #[command(flatten)]
        case: CaseArgs,
        /// Directory for the results [default: results/<case>[/<variant>]].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        #[command(flatten)]
        adapt: AdaptArgs,
    },
    /// Do everything short of solving, and say what it would cost.
    Check {
        #[command(flatten)]
        case: CaseArgs,
    },
    /// Show what accuracy costs in time: solve the case on several meshes, in several ways. Not under mpirun.
    Study(Box<flags::StudyArgs>),
}

#[derive(Args)]
struct AdaptArgs {
    /// Refine where the error is until its estimate, of the peak contact pressure or in the energy norm, is below this:
    /// pressure=1%, energy=0.01.
    #[arg(long, value_name = "QUANTITY=ERROR")]
    adapt: Option<simulation::Goal>,
    /// Most solves of an adaptive run [default: 20].
    #[arg(long, value_name = "N", requires = "adapt", value_parser = clap::value_parser!(u32).range(1..))]
    adapt_rounds: Option<u32>,
    /// Unknowns beyond which an adaptive run refines no more [default: 2000000].
    #[arg(long, value_name = "N", requires = "adapt", value_parser = clap::value_parser!(u64).range(1..))]
    adapt_dofs: Option<u64>,
}

#[derive(Args)]
struct CaseArgs {
    /// A case file, or a directory with case.toml.
    case: PathBuf,
    /// Apply a [[variant]] of the case.
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// Change a key: body.upper.material.young=2e11 (may be repeated).
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

fn main() {
    let (arguments, petsc_options) = split_arguments(std::env::args().collect());
    // Help and usage errors need neither MPI nor PETSc.
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(e) => {
            let first = std::env::var("OMPI_COMM_WORLD_RANK").map_or(true, |rank| rank == "0");
            if first {
                let _ = e.print();
            }
            std::process::exit(if e.use_stderr() { 2 } else { 0 });
        }
    };
    let command = match cli.command {
        // It starts processes with MPI, and has none itself.
        Command::Study(arguments) => std::process::exit(run_study(arguments, petsc_options)),
        command => command,
    };
    parallel::end_with_parent();
    let Some(universe) = parallel::initialize() else {
        eprintln!("kontakt: MPI is already initialised");
        std::process::exit(1);
    };
    abort_on_panic();
    let world = universe.world();
    let ready = agree(&world, petsc::touch_blas());
    let code = match ready.and_then(|()| petsc::Session::start_with(&petsc_options)).and_then(|session| {
        let code = execute(command, &petsc_options, &world)?;
        drop(session);
        Ok(code)
    }) {
        Ok(code) => code,
        Err(error) => {
            if world.rank() == 0 {
                report(&error);
            }
            error.exit_code()
        }
    };
    drop(universe);
    std::process::exit(code);
}

/// A panic on one rank would leave the others waiting for ever.
fn abort_on_panic() {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        report(info);
        parallel::end_all(1);
    }));
}

/// PETSc's options start with a single dash and a word; the rest is ours.
fn split_arguments(all: Vec<String>) -> (Vec<String>, Vec<String>) {
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let mut words = all.into_iter().peekable();
    while let Some(word) = words.next() {
        let is_petsc = word.len() > 2 && word.starts_with('-') && !word.starts_with("--");
        if !is_petsc {
            ours.push(word);
            continue;
        }
        theirs.push(word);
        let is_value = |next: &String| !next.starts_with('-') || next.parse::<f64>().is_ok();
        theirs.extend(words.next_if(is_value));
    }
    (ours, theirs)
}

fn execute(command: Command, petsc_options: &[String], world: &SimpleCommunicator) -> Result<i32> {
    let (Command::Run { case: args, .. } | Command::Check { case: args }) = &command else {
        return Err(Error::internal("a study has no ranks"));
    };
    let case = agree(world, case::read(&args.case, args.variant.as_deref(), &args.sets))?;
    refuse_unknown_prefixes(petsc_options, &case)?;
    match command {
        Command::Check { .. } => check(&case, world),
        Command::Run { out, adapt, .. } => run(&case, out, &adapt, world),
        Command::Study(_) => Err(Error::internal("a study has no ranks")),
    }
}

fn run_study(arguments: Box<flags::StudyArgs>, petsc_options: Vec<String>) -> i32 {
    study::study(&arguments.request(petsc_options)).unwrap_or_else(|error| {
        // All ranks of a study that mpirun has started come here.
        if std::env::var("OMPI_COMM_WORLD_RANK").map_or(true, |rank| rank == "0") {
            report(&error);
        }
        error.exit_code()
    })
}

/// What is wrong, on the terminal.
fn report(error: &Error) {
    eprintln!("kontakt: error: {}", plain_text(&error.to_string()));
}

/// Options that look like a body's but name none.
fn refuse_unknown_prefixes(options: &[String], case: &Case) -> Result<()> {
    for option in options.iter().filter(|o| o.starts_with("-body_")) {
        if !case.bodies.iter().any(|b| option[1..].starts_with(&options_prefix(&b.name))) {
            let names: Vec<String> =
                case.bodies.iter().map(|b| format!("-{}", options_prefix(&b.name))).collect();
            return Err(Error::input(format!(
                "{option}: no body has this prefix; the case's are {}",
                names.join(", ")
            )));
        }
    }
    Ok(())
}

fn run(case: &Case, out: Option<PathBuf>, adapt: &AdaptArgs, world: &SimpleCommunicator) -> Result<i32> {
    let mut default = PathBuf::from("results").join(&case.name);
    default.extend(&case.variant);
    let directory = out.unwrap_or(default);
    let terminal = std::io::stderr().is_terminal();
    let progress = |row: &HistoryRow| print_row(row, terminal);
    let folder = output::Folder::open(world, &directory, case)?;
    let summary = match adapt.adapt {
        None => simulation::run(case, world, &directory, progress),
        Some(goal) => {
            let default = simulation::Limits::default();
            let limits = simulation::Limits {
                rounds: adapt.adapt_rounds.map_or(default.rounds, |n| n as usize),
                dofs: adapt.adapt_dofs.map_or(default.dofs, |n| n as usize),
            };
            simulation::run_adaptive(case, goal, limits, world, &directory, progress, print_round)
        }
    };
    let summary = folder.close(world, summary)?;
    if world.rank() == 0 {
        for warning in &summary.warnings {
            eprintln!("warning: {}", plain_text(warning));
        }
        for pair in &summary.pairs {
            println!(
                "contact {}: normal force {:.6e}, max pressure {:.6e}, length {:.6e}, penetration {:.2e}, imbalance {:.2e}",
                pair.name,
                pair.normal_force,
                pair.max_pressure,
                pair.contact_length,
                pair.max_penetration,
                pair.force_imbalance
            );
        }
        for (pair, friction) in summary.pairs.iter().filter_map(|p| Some((p, p.friction.as_ref()?))) {
            println!(
                "contact {}: {}: tangential force {:.6e}, slipping over {:.6e}, sticking over {:.6e}, slip up to {:.3e}, dissipated {:.3e}",
                pair.name,
                friction.law,
                friction.force,
                friction.slip_length,
                friction.stick_length,
                friction.max_slip,
                friction.dissipated
            );
        }
        if let Some(energy) = summary.energy {
            let heat = energy.heat.map_or_else(String::new, |heat| format!("heat {heat:.6e}, "));
            let rubbed =
                energy.dissipated.map_or_else(String::new, |work| format!("dissipated {work:.6e}, "));
            let yielded =
                energy.plastic.map_or_else(String::new, |work| format!("plastic work {work:.6e}, "));
            println!(
                "energy: external work {:.6e}, {heat}stored {:.6e}, {rubbed}{yielded}imbalance {:.1e}",
                energy.external, energy.stored, energy.imbalance
            );
        }
        for body in summary.plasticity.iter().flat_map(|plasticity| &plasticity.bodies) {
            println!(
                "body {}: plastic strain in {:.2} % of its volume, up to {:.3e}, plastic work {:.3e}",
                body.name,
                100.0 * body.plastic_volume,
                body.max_plastic_strain,
                body.work
            );
        }
        let verdict = if summary.converged { "converged" } else { "NOT CONVERGED" };
        println!(
            "{verdict} ({}) after {} alternations: {} Residual {:.1e}, {:.2} s",
            summary.reason.name(),
            summary.alternations,
            summary.reason.explanation(summary.driver),
            summary.residual,
            summary.seconds.total
        );
        println!("{}", accuracy(&summary));
        for mode in &summary.free_modes {
            println!(
                "free motion: body {}: {}; nothing holds it and no load drives it: it stays at zero",
                mode.body,
                plain_text(&mode.mode)
            );
        }
        if !summary.converged {
            println!("{}", summary.reason.advice(summary.driver));
        }
        for line in &summary.diagnosis {
            println!("{}", plain_text(line));
        }
        println!("results in {} (picture: {})", directory.display(), directory.join("bodies.png").display());
    }
    Ok(match (summary.converged, summary.adapt_reached) {
        (false, _) => 3,
        (true, Some(false)) => 5,
        _ => 0,
    })
}

/// A line for each mesh of an adaptive run.
fn print_round(round: &AdaptRound) {
    let AdaptRound { dofs, energy, contact_pressure, alternations, seconds } = round;
    let pressure = contact_pressure.map_or_else(String::new, |p| format!(", pressure {:.3} %", 100.0 * p));
    println!(
        "refinement: {dofs} dofs, estimated error: energy {:.3} %{pressure}; {alternations} alternations, {seconds:.2} s",
        100.0 * energy
    );
}

/// The error estimate in words.
fn accuracy(summary: &Summary) -> String {
    let percent = |error: f64| format!("{:.2} %", 100.0 * error);
    let kontakt::record::ErrorEstimate { energy, contact_pressure } = summary.error_estimate;
    let pressure =
        contact_pressure.map_or_else(String::new, |p| format!(", {} of the peak pressure", percent(p)));
    format!("estimated error of the mesh: {} in the energy norm{pressure}", percent(energy))
}

fn print_row(row: &HistoryRow, terminal: bool) {
    if row.alternation == 1 {
        match (row.step, row.increment) {
            (1, 1) => {}
            (step, 1) => eprintln!("load step {step}"),
            (step, increment) => eprintln!("load step {step}, increment {increment}"),
        }
    }
    let HistoryRow { alternation, displacement_jump: jump, force_imbalance, active, open, flips, .. } = row;
    let HistoryRow { contraction, penetration, .. } = row;
    if terminal {
        let contraction = contraction.map_or_else(String::new, |c| format!("{c:.3}"));
        if *alternation == 1 {
            eprintln!(
                "alternation  gap residual  force imbalance  closed    open   flips  penetration  contraction"
            );
        }
        eprintln!(
            "{alternation:11}  {jump:12.3e}  {force_imbalance:15.3e}  {active:6}  {open:6}  {flips:6}  {penetration:11.3e}  {contraction:>11}"
        );
    } else {
        eprintln!(
            "alternation {alternation} jump {jump:.3e} imbalance {force_imbalance:.3e} active {active} open {open} flips {flips}"
        );
    }
}

fn check(case: &Case, world: &SimpleCommunicator) -> Result<i32> {
    let plan = scene::Plan::new(case, world)?;
    let lines = simulation::outlook(case, &plan)?;
    if world.rank() == 0 {
        let analysis = match case.analysis {
            case::Analysis::PlaneStress { .. } => "plane stress",
            case::Analysis::PlaneStrain { .. } => "plane strain",
        };
        println!("{}: {analysis}, thickness {}", plain_text(&case.title), case.analysis.thickness());
        lines.iter().for_each(|line| println!("{}", plain_text(line)));
        for rigid in &case.rigid {
            println!("body {}: rigid, no unknowns", rigid.name);
        }
        if !case.steps.is_empty() {
            let least: usize = case.steps.iter().map(|step| step.increments.least()).sum();
            let automatic = case.steps.iter().any(|step| step.increments == case::Increments::Automatic);
            let increments = match (automatic, least > case.steps.len()) {
                (true, _) => format!(", at least {least} increments"),
                (false, true) => format!(", {least} increments"),
                (false, false) => String::new(),
            };
            println!("{} load steps{increments}", case.steps.len());
        }
    }
    Ok(0)
}
