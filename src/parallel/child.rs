//! Processes that end with the one that started them, however that ends.
use rustix::process::{Signal, set_parent_process_death_signal};
use std::io;
use std::os::unix::process::CommandExt;
use std::process::Command;

/// Set for everything that such a process starts in its turn: mpirun's own processes end with mpirun.
const BOUND: &str = "KONTAKT_ENDS_WITH_PARENT";

/// The kernel ends the command's process when this thread's process has ended, by SIGTERM, which mpirun passes on.
pub fn bind_to_parent(command: &mut Command) {
    let parent = std::process::id();
    command.env(BOUND, "1");
    // SAFETY: between fork and exec only system calls are made, which allocate nothing.
    unsafe {
        command.pre_exec(move || {
            set_parent_process_death_signal(Some(Signal::TERM))?;
            // It may have ended before.
            match std::os::unix::process::parent_id() == parent {
                true => Ok(()),
                false => Err(io::Error::from(io::ErrorKind::BrokenPipe)),
            }
        });
    }
}

/// To be called first by a process that may have been started so: it is killed when its parent, mpirun, has ended.
pub fn end_with_parent() {
    if std::env::var_os(BOUND).is_some() {
        // Without it the process ends when it notices that its peers are gone.
        let _ = set_parent_process_death_signal(Some(Signal::KILL));
    }
}
