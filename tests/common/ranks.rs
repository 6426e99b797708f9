//! Test functions that run in this executable on several ranks.
use kontakt::petsc::Session;
use mpi::{topology::SimpleCommunicator, traits::*};

/// Runs `body`, the test `name`, on each number of ranks.
pub fn on_ranks(name: &str, ranks: &[usize], body: fn(&SimpleCommunicator)) {
    if std::env::var_os("KONTAKT_TEST_CHILD").is_some() {
        let universe = mpi::initialize().unwrap();
        let session = Session::start().unwrap();
        // A panic on one rank would leave the others waiting: end all of them.
        let run = || body(&universe.world());
        if std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).is_err() {
            universe.world().abort(1);
        }
        drop(session);
        return;
    }
    for &n in ranks {
        let mut command = crate::common::mpirun(n);
        command.arg(std::env::current_exe().unwrap());
        command.args(["--exact", name, "--nocapture", "--test-threads=1"]).env("KONTAKT_TEST_CHILD", "1");
        let out = command.output().unwrap();
        let [stdout, stderr] = [&out.stdout, &out.stderr].map(|text| String::from_utf8_lossy(text));
        assert!(out.status.success(), "{n} ranks:\n{stdout}\n{stderr}");
    }
}
