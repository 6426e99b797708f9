//! The end of all ranks, where one of them cannot go on.
use mpi::ffi;

/// Ends all ranks at once with an exit code, if MPI runs.
pub fn end_all(code: i32) {
    let (mut begun, mut ended) = (0, 0);
    // SAFETY: both questions may be asked at any time; the abort only while MPI runs.
    unsafe {
        ffi::MPI_Initialized(&mut begun);
        ffi::MPI_Finalized(&mut ended);
        if begun != 0 && ended == 0 {
            ffi::MPI_Abort(ffi::RSMPI_COMM_WORLD, code);
        }
    }
}
