//! A run of the study: a process of its own, so that what it costs is its own and nothing it does stops the study.
use super::{
    plan::{Run, cores},
    request::Request,
};
use crate::{Error, Result, output::SUMMARY, parallel::bind_to_parent};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    time::Instant,
};
use wait4::Wait4;

/// What makes mpirun usable in containers, as root, and with more ranks than cores; the user's own settings go before.
const ENVIRONMENT: [(&str, &str); 6] = [
    ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
    ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
    ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
    ("OMPI_MCA_hwloc_base_binding_policy", "none"),
    ("OMPI_MCA_btl_vader_single_copy_mechanism", "none"),
    ("OMP_NUM_THREADS", "1"),
];
/// Whether ranks that wait leave the core to others. Where every rank has its core, one that yields beside other work hardly
/// gets its turn again: the study decides, whatever the shell has set.
const YIELD: &str = "OMPI_MCA_mpi_yield_when_idle";
/// Set by mpirun for its own processes: what they start would take itself for one of them.
const OF_MPIRUN: [&str; 4] = ["OMPI_", "PMIX_", "PRTE_", "ORTE_"];
/// Set in every process that mpirun starts.
pub(super) const RANKS_VARIABLE: &str = "OMPI_COMM_WORLD_SIZE";

/// What a run cost and gave.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Measured {
    /// Seconds of the process, from its start to its end.
    pub process_seconds: f64,
    /// Processor seconds, user and system, of the process and all it started.
    pub cpu_seconds: f64,
    /// Exit code; none if it was killed.
    pub exit: Option<i32>,
    /// Its `summary.json`, if it left one.
    pub summary: Option<Value>,
    /// The first error it reported.
    pub error: Option<String>,
}

impl Measured {
    /// True if the result is a solution.
    pub fn converged(&self) -> bool {
        self.summary.as_ref().is_some_and(|summary| summary["converged"] == true)
    }

    /// How it ended, in a word or two.
    pub fn ending(&self) -> String {
        let reason = self.summary.as_ref().and_then(|summary| summary["reason"].as_str());
        match (reason, self.exit) {
            (Some(reason), _) => reason.replace('_', " "),
            (None, Some(2)) => "refused".into(),
            (None, Some(4)) => "unrestrained".into(),
            (None, Some(code)) => format!("failed with exit code {code}"),
            (None, None) => "killed".into(),
        }
    }
}

/// Runs the case once, with its results in a directory that is made before and removed after.
pub(super) fn measure(request: &Request, run: &Run, directory: &Path) -> Result<Measured> {
    let cannot = |e: std::io::Error| Error::input(format!("cannot write to {}: {e}", directory.display()));
    fs::create_dir_all(directory).map_err(cannot)?;
    let log = directory.join("log");
    let file = fs::File::create(&log).map_err(cannot)?;
    let program = std::env::current_exe().map_err(Error::internal)?;
    let mut command = Command::new("mpirun");
    command.args(["-q", "-n", &run.ranks.to_string()]).arg(program).arg("run").arg(&request.case);
    if let Some(variant) = &request.variant {
        command.args(["--variant", variant]);
    }
    command.args(run.sets.iter().map(|set| format!("--set={set}"))).arg("--out").arg(directory);
    command.args(&request.petsc_options);
    environment(&mut command, run.ranks);
    bind_to_parent(&mut command);
    let start = Instant::now();
    let child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(file)
        .spawn()
        .map_err(|e| Error::input(format!("mpirun cannot be started: {e}")))?;
    let ended = child.wait4().map_err(Error::internal)?;
    let process_seconds = start.elapsed().as_secs_f64();
    let cpu_seconds = (ended.rusage.utime + ended.rusage.stime).as_secs_f64();
    let summary = fs::read_to_string(directory.join(SUMMARY)).ok();
    let summary = summary.and_then(|text| serde_json::from_str(&text).ok());
    let error = fs::read_to_string(&log).ok().and_then(|log| first_error(&log));
    fs::remove_dir_all(directory).map_err(cannot)?;
    Ok(Measured { process_seconds, cpu_seconds, exit: ended.status.code(), summary, error })
}

fn environment(command: &mut Command, ranks: usize) {
    if std::env::var_os(RANKS_VARIABLE).is_some() {
        for (name, _) in std::env::vars_os() {
            if OF_MPIRUN.iter().any(|prefix| name.to_string_lossy().starts_with(prefix)) {
                command.env_remove(name);
            }
        }
    }
    let clean = std::env::var_os(RANKS_VARIABLE).is_some();
    for (name, value) in ENVIRONMENT {
        if clean || std::env::var_os(name).is_none() {
            command.env(name, value);
        }
    }
    command.env(YIELD, if ranks > cores() { "1" } else { "0" });
}

fn first_error(log: &str) -> Option<String> {
    let errors = log.lines().filter_map(|line| line.split_once("error: "));
    errors.map(|(_, text)| text.trim().to_string()).next()
}
