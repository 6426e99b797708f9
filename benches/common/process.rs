//! Processes and what they cost.
use kontakt::{Error, Result};
use std::{
    fs::File,
    path::Path,
    process::{Command, Stdio},
    time::Instant,
};

/// Lines of a log that an error quotes.
const QUOTED: usize = 20;

/// What a process and those it waited for have spent.
#[derive(Debug, Clone, Copy)]
pub struct Spent {
    /// CPU seconds, of the user and of the system.
    pub cpu: f64,
    /// Wall seconds.
    pub wall: f64,
    /// Largest resident memory of one process, MB.
    pub peak_mb: f64,
}

/// Runs of all in turn, `repetitions` times: of each the one with the least CPU seconds, and what it found.
pub fn cheapest<P: Copy, V>(
    programs: &[P],
    repetitions: usize,
    run: impl Fn(P) -> Result<(Spent, V)>,
) -> Result<Vec<(Spent, V)>> {
    let mut best: Vec<Option<(Spent, V)>> = programs.iter().map(|_| None).collect();
    for _ in 0..repetitions {
        for (&program, best) in std::iter::zip(programs, &mut best) {
            let done = run(program)?;
            if best.as_ref().is_none_or(|b| done.0.cpu < b.0.cpu) {
                *best = Some(done);
            }
        }
    }
    Ok(best.into_iter().flatten().collect())
}

/// Runs a command to its end, what it says into the file `log`; an error with the last lines of it if it fails.
pub fn run(command: &mut Command, log: &Path) -> Result<Spent> {
    let said = File::create(log).map_err(Error::internal)?;
    command.stdout(said.try_clone().map_err(Error::internal)?).stderr(Stdio::from(said));
    let start = Instant::now();
    let name = command.get_program().to_string_lossy().into_owned();
    let child = command.spawn().map_err(|e| Error::internal(format!("{name}: {e}")))?;
    let (mut status, pid) = (0, child.id() as libc::pid_t);
    // SAFETY: all zeros is a valid rusage, which wait4 fills in; the child is waited for here only.
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    if unsafe { libc::wait4(pid, &mut status, 0, &mut usage) } != pid {
        return Err(Error::internal(format!("{name}: {}", std::io::Error::last_os_error())));
    }
    if !libc::WIFEXITED(status) || libc::WEXITSTATUS(status) != 0 {
        let said = std::fs::read_to_string(log).unwrap_or_default();
        let first = said.lines().count().saturating_sub(QUOTED);
        let last: Vec<&str> = said.lines().skip(first).collect();
        return Err(Error::internal(format!("{name} failed (status {status}):\n{}", last.join("\n"))));
    }
    let seconds = |t: libc::timeval| t.tv_sec as f64 + 1e-6 * t.tv_usec as f64;
    Ok(Spent {
        cpu: seconds(usage.ru_utime) + seconds(usage.ru_stime),
        wall: start.elapsed().as_secs_f64(),
        peak_mb: usage.ru_maxrss as f64 / 1024.0,
    })
}
