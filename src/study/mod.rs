//! `kontakt study`: what accuracy costs in time. The case is solved on several meshes in several ways, each run a process
//! of its own; errors are measured against the exact solution, or the limit of the finest meshes.
mod exact;
mod export;
mod front;
mod journal;
mod page;
mod plan;
mod progress;
mod quantity;
mod reference;
mod request;
mod richardson;
mod run;
mod table;

use crate::{
    Error, Result,
    output::{Lock, Precision, PrecisionCurve, PrecisionPoint, write_complete},
};
use journal::{Found, Header, Journal};
use page::Page;
use plan::Plan;
use progress::Progress;
use std::path::{Path, PathBuf};
use table::Table;

pub use request::Request;

/// Exit code if no run has converged.
const NOTHING_CONVERGED: i32 = 3;

/// Runs a study, or what is left of it, and writes its results. Returns the exit code. Not under mpirun: it starts the runs
/// itself.
pub fn study(request: &Request) -> Result<i32> {
    if let Some(ranks) = std::env::var(run::RANKS_VARIABLE).ok().filter(|ranks| ranks != "1") {
        return Err(Error::input(format!(
            "kontakt study was started by mpirun on {ranks} ranks; it starts mpirun itself, for each of its runs: start it \
             without, and say --ranks {ranks}"
        )));
    }
    let plan = Plan::new(request)?;
    let known = exact::known(&plan.case)?;
    let directory = directory(request, &plan);
    let _lock = Lock::take(&directory)?;
    let header = Header::new(plan.case.fingerprint, &request.petsc_options)?;
    let (mut journal, found) = Journal::open(&directory, &header, request.fresh)?;
    match found {
        Found::OtherCase => {
            eprintln!(
                "the case has changed since the runs in {}: those are kept, all anew",
                directory.display()
            )
        }
        Found::OtherProgram => {
            eprintln!("the runs in {} are of another build of kontakt: all anew", directory.display());
        }
        Found::Nothing | Found::Same => {}
    }
    run_all(request, &plan, &directory, &mut journal)?;
    let table = Table::new(&plan, &journal, &known);
    report(request, &plan, &table, &directory)
}

fn directory(request: &Request, plan: &Plan) -> PathBuf {
    let mut default = PathBuf::from("results").join(&plan.case.name);
    default.extend(&plan.case.variant);
    request.out.clone().unwrap_or_else(|| default.join("study"))
}

/// Makes the runs that are not in the journal. One repetition of all runs comes after the other, so that a slow moment of the
/// machine does not fall on one of them alone.
fn run_all(request: &Request, plan: &Plan, directory: &Path, journal: &mut Journal) -> Result<()> {
    remove_leftovers(directory);
    let repeat = plan.case.study.repeat;
    let all = (0..repeat).flat_map(|repetition| plan.runs.iter().map(move |run| (repetition, run)));
    let missing: Vec<_> =
        all.filter(|(repetition, run)| journal.get(&run.id(), *repetition).is_none()).collect();
    let progress = Progress::new(plan, missing.iter().map(|(_, run)| *run));
    let labels = plan.labels();
    for (repetition, run) in missing {
        let id = run.id();
        // One that failed would fail again.
        if journal.all(&id).any(|measured| !measured.converged()) {
            progress.skip(run);
            continue;
        }
        progress.start(run, &labels[run.choice], repetition);
        let measured = run::measure(request, run, &directory.join(format!(".run-{}", std::process::id())))?;
        progress.done(run, &labels[run.choice], repetition, &measured);
        journal.add(id, repetition, measured)?;
    }
    progress.finish();
    // A run that has outlived its study may have come back to it.
    remove_leftovers(directory);
    Ok(())
}

/// Removes what runs have left that were killed with their study.
fn remove_leftovers(directory: &Path) {
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let running = |pid: &str| Path::new("/proc").join(pid).exists();
        if name.strip_prefix(".run-").is_some_and(|pid| !running(pid)) {
            // One that cannot be removed does no harm.
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// Writes and prints the results.
fn report(request: &Request, plan: &Plan, table: &Table, directory: &Path) -> Result<i32> {
    let quantity = quantity(plan, table);
    let columns = export::columns(plan, table);
    export::write_csv(&directory.join("study.csv"), &columns)?;
    export::write_hdf5(&directory.join("study.h5"), &columns)?;
    let page = |picture: &str| Page {
        title: &plan.case.title,
        command: &request.command,
        picture: picture.to_string(),
        table,
        quantity: quantity.as_deref(),
    };
    let diagram = quantity.as_deref().map(|quantity| diagram(plan, table, quantity));
    if let Some(diagram) = &diagram {
        write_complete(&directory.join("study.svg"), diagram.svg()?.as_bytes())?;
        diagram.png(&directory.join("study.png"))?;
    }
    write_complete(&directory.join("study.md"), page("study.svg").markdown().as_bytes())?;
    if let Some(path) = &request.page {
        let picture = path.with_extension("svg");
        if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent)
                .map_err(|e| Error::input(format!("{}: {e}", parent.display())))?;
        }
        let name = picture.file_name().unwrap_or_default().to_string_lossy();
        write_complete(path, page(&name).markdown().as_bytes())?;
        if let Some(diagram) = &diagram {
            write_complete(&picture, diagram.svg()?.as_bytes())?;
        }
    }
    let page = page("study.svg");
    page.warnings().iter().for_each(|warning| eprintln!("warning: {warning}"));
    println!("{}", page.answer());
    println!("table and diagram in {} (study.md, study.svg, study.csv, study.h5)", directory.display());
    let converged = table.rows.iter().any(|row| row.converged);
    if let (false, Some(row)) = (converged, table.rows.first()) {
        let error = row.error_text.clone().unwrap_or_default();
        eprintln!("kontakt: error: no run of the study has converged; the first one: {} {error}", row.ending);
    }
    Ok(if converged { 0 } else { NOTHING_CONVERGED })
}

/// The quantity that accuracy is judged by: the one asked for, else the first peak pressure, else the first there is. None
/// where nothing is known of it.
fn quantity(plan: &Plan, table: &Table) -> Option<String> {
    if let Some(asked) = &plan.case.study.quantity {
        if !table.names.contains(asked) {
            eprintln!("warning: no run and no limit say what {asked} should be; it is not judged");
        }
        return table.names.contains(asked).then(|| asked.clone());
    }
    let pressure = table.names.iter().find(|name| name.ends_with(".peak_pressure"));
    pressure.or(table.names.first()).cloned()
}

fn diagram(plan: &Plan, table: &Table, quantity: &str) -> Precision {
    let what = quantity::spoken(quantity, table.has_several_pairs());
    let points = front::points(table, quantity);
    let curve = |choice: usize| PrecisionCurve {
        name: match table.labels[choice].as_str() {
            "" => plan.elements[choice].names.clone(),
            label => label.to_string(),
        },
        points: points
            .iter()
            .filter(|point| point.row.choice == choice && point.row.time().is_finite())
            .map(|point| PrecisionPoint {
                level: point.row.level,
                seconds: [point.row.time(), point.row.process.high.max(point.row.time())],
                error: point.error,
                best: point.best,
            })
            .collect(),
    };
    Precision {
        title: plan.case.title.clone(),
        subject: format!(": error of {what} over time"),
        time: "wall seconds of the process, least of the repetitions (numbers: level of refinement)".into(),
        fixed: table.start_up(),
        error: format!("relative error of {what}"),
        curves: (0..table.labels.len()).map(curve).filter(|curve| !curve.points.is_empty()).collect(),
        known_to: table.references[quantity].known_to,
        known_text: match table.references[quantity].exact {
            true => "exact value and limit of the meshes differ by this",
            false => "the limit of the meshes is known to this",
        },
    }
}
