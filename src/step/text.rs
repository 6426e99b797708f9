//! Lines of text from all ranks.
use crate::parallel;
use mpi::topology::SimpleCommunicator;

/// The lines of all ranks, in rank order, on every rank. Collective.
pub(crate) fn gather_lines(world: &SimpleCommunicator, own: &[String]) -> Vec<String> {
    let bytes: Vec<f64> = own.iter().flat_map(|line| line.bytes().chain([b'\n'])).map(f64::from).collect();
    let mut all = parallel::gather(world, &bytes);
    parallel::broadcast(world, 0, &mut all);
    let bytes: Vec<u8> = all.into_iter().map(|b| b as u8).collect();
    String::from_utf8_lossy(&bytes).lines().map(str::to_owned).collect()
}
