//! Adaptive against uniform refinement: the Hertz case from an ungraded mesh with half-width / element size = 1.
//!
//! `scripts/bench --only adaptive [--json FILE]` writes docs/benchmarks/adaptive.md.
//!
//! The program itself on 2 ranks, whole process with results written. Uniform: the same start mesh with `refine = N`,
//! N = 0, 1, ... up to the first whose peak pressure is within the target of the exact one. Adaptive: `--adapt
//! pressure=0.5%`, which knows nothing of the exact one.
use kontakt::{Error, Result};
use serde_json::{Value, json};
use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// Peak pressure, Pa.
const EXACT: f64 = 1.212_074e9;

/// Relative error of the peak pressure to reach.
const TARGET: f64 = 5e-3;

/// Uniform refinements tried at most: 1.4 million unknowns.
const MOST: usize = 2;

const RANKS: &str = "2";

/// Repetitions: of short runs, and of the finest uniform one.
const REPETITIONS: [usize; 2] = [3, 1];

/// One way to refine: what it cost and how good it is.
struct Run {
    name: String,
    dofs: f64,
    wall: f64,
    cpu: f64,
    memory: f64,
    estimate: f64,
    error: f64,
    rounds: Value,
}

/// Runs the case so often and takes the median by CPU seconds.
fn measure(name: &str, arguments: &[String], repetitions: usize) -> Result<Run> {
    let mut runs = (0..repetitions).map(|_| once(name, arguments)).collect::<Result<Vec<Run>>>()?;
    runs.sort_by(|a, b| a.cpu.total_cmp(&b.cpu));
    Ok(runs.swap_remove(repetitions / 2))
}

fn once(name: &str, arguments: &[String]) -> Result<Run> {
    let out = std::env::temp_dir().join(format!("kontakt-adaptive-{}", std::process::id()));
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/hertz-line");
    // The shell knows the CPU seconds of all the processes it waits for.
    let script = "TIMEFORMAT='cpu %R %U %S'; time mpirun -q -n \"$@\"";
    let mut command = Command::new("bash");
    command.args(["-c", script, "bash", RANKS, env!("CARGO_BIN_EXE_kontakt"), "run"]).arg(&case);
    command.args(["--variant", "ungraded", "--out"]).arg(&out).args(arguments);
    let ran = command.output().map_err(|e| Error::internal(format!("bash: {e}")))?;
    let said = String::from_utf8_lossy(&ran.stderr);
    if !ran.status.success() {
        return Err(Error::internal(format!("{name}: {said}")));
    }
    let times = said.lines().rev().find_map(|line| line.strip_prefix("cpu ")).unwrap_or_default();
    let times: Vec<f64> = times.split(' ').filter_map(|t| t.parse().ok()).collect();
    let [wall, user, system] = times[..] else { return Err(Error::internal("no times from bash")) };
    let text = std::fs::read_to_string(out.join("summary.json")).map_err(Error::internal)?;
    let summary: Value = serde_json::from_str(&text).map_err(Error::internal)?;
    std::fs::remove_dir_all(&out).map_err(Error::internal)?;
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let bodies = summary["bodies"].as_array().into_iter().flatten();
    Ok(Run {
        name: name.to_owned(),
        dofs: bodies.map(|body| number(&body["dofs"])).sum(),
        wall,
        cpu: user + system,
        memory: number(&summary["peak_memory_mb"]),
        estimate: number(&summary["error_estimate"]["contact_pressure"]),
        error: number(&summary["pairs"][0]["max_pressure"]) / EXACT - 1.0,
        rounds: summary["adapt"].clone(),
    })
}

impl Run {
    fn line(&self) -> String {
        format!(
            "| {} | {} | {:.1} | {:.1} | {:.0} | {:.2} % | {:+.2} % |\n",
            self.name,
            self.dofs,
            self.wall,
            self.cpu,
            self.memory,
            100.0 * self.estimate,
            100.0 * self.error
        )
    }

    fn json(&self) -> Value {
        json!({
            "name": self.name, "dofs": self.dofs, "seconds": self.wall, "cpu_seconds": self.cpu, "peak_mb": self.memory,
            "estimate": self.estimate, "peak_pressure_error": self.error, "rounds": self.rounds,
        })
    }

    fn is_good(&self) -> bool {
        self.error.abs() <= TARGET
    }
}

/// Unknowns, wall seconds and CPU seconds of the uniform mesh over those of the adaptive run.
fn ratios(uniform: &Run, adaptive: &Run) -> [f64; 3] {
    [uniform.dofs / adaptive.dofs, uniform.wall / adaptive.wall, uniform.cpu / adaptive.cpu]
}

fn page(uniform: &[Run], adaptive: &Run) -> String {
    let mut text = String::from(
        "# Adaptive against uniform refinement\n\n\
         Written by `scripts/bench --only adaptive`. Hertz line contact (cases/hertz-line, variant `ungraded`): quad4, cells as \
         large as the\n\
         half-width of the contact everywhere. Whole process on 2 ranks with results written; of the adaptive run all rounds \
         together.\n\
         The target is 0.5 % of the peak pressure; the error is against the exact 1.212074e9 Pa.\n\n\
         | refinement | dofs | wall s | CPU s | memory MB | estimate | error |\n|---|---|---|---|---|---|---|\n",
    );
    uniform.iter().chain([adaptive]).for_each(|run| text += &run.line());
    text += "\nRounds of the adaptive run, `kontakt run cases/hertz-line --variant ungraded --adapt pressure=0.5%`:\n\n\
             | dofs | energy | pressure | alternations | wall s |\n|---|---|---|---|---|\n";
    for round in adaptive.rounds.as_array().into_iter().flatten() {
        let of = |key: &str| round[key].as_f64().unwrap_or(f64::NAN);
        text += &format!(
            "| {} | {:.2} % | {:.2} % | {} | {:.2} |\n",
            of("dofs"),
            100.0 * of("energy"),
            100.0 * of("contact_pressure"),
            of("alternations"),
            of("seconds")
        );
    }
    let last = &uniform[uniform.len() - 1];
    let [dofs, wall, cpu] = ratios(last, adaptive);
    let reached = if last.is_good() { "reaches" } else { "has not reached" };
    text += &format!(
        "\nThe finest uniform mesh {reached} the target, with {dofs:.1} times the unknowns of the adaptive run, {wall:.1} times \
         its wall and\n{cpu:.1} times its CPU seconds.\n"
    );
    text
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let json =
        arguments.iter().position(|a| a == "--json").and_then(|i| arguments.get(i + 1)).map(PathBuf::from);
    let adaptive = measure("adaptive", &["--adapt", "pressure=0.5%"].map(str::to_owned), REPETITIONS[0])?;
    let mut uniform = Vec::new();
    for n in 0..=MOST {
        let of = |body: &str| ["--set".to_owned(), format!("body.{body}.mesh.refine={n}")];
        let repetitions = REPETITIONS[usize::from(n == MOST)];
        let run = measure(&format!("refine = {n}"), &[of("upper"), of("lower")].concat(), repetitions)?;
        let good = run.is_good();
        uniform.push(run);
        if good {
            break;
        }
    }
    let text = page(&uniform, &adaptive);
    println!("{text}");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/benchmarks/adaptive.md");
    std::fs::write(file, text).map_err(Error::internal)?;
    if !adaptive.is_good() {
        return Err(Error::internal("the adaptive run's error is above the target"));
    }
    let Some(file) = json else { return Ok(()) };
    let mut all = match std::fs::read_to_string(&file) {
        Ok(text) => serde_json::from_str(&text).map_err(Error::internal)?,
        Err(_) => json!({}),
    };
    let [dofs, wall, cpu] = ratios(&uniform[uniform.len() - 1], &adaptive);
    all["adaptive"] = json!({
        "uniform": uniform.iter().map(Run::json).collect::<Vec<_>>(), "adaptive": adaptive.json(),
        "dofs_ratio": dofs, "seconds_ratio": wall, "cpu_ratio": cpu,
        "uniform_reached": uniform[uniform.len() - 1].is_good(),
    });
    let text = serde_json::to_string_pretty(&all).map_err(Error::internal)?;
    std::fs::write(&file, text + "\n").map_err(Error::internal)
}
