//! What all ranks must know before any of them acts on it. Everything here is collective.
use crate::error::{Error, Result};
use crate::stable_hash::StableHash;
use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;

/// Collective. `local` if it is `Ok` on all ranks; otherwise the error of the lowest rank that has one, on
/// all ranks.
pub(super) fn agree<T>(comm: &SimpleCommunicator, local: Result<T>) -> Result<T> {
    let mine = if local.is_err() { comm.rank() } else { comm.size() };
    let mut first: mpi::Rank = 0;
    comm.all_reduce_into(&mine, &mut first, SystemOperation::min());
    if first == comm.size() {
        return local;
    }
    let (code, text) = local.err().map_or((0, String::new()), |e| (e.kind(), e.to_string()));
    let mut header = [code as u64, text.len() as u64];
    let root = comm.process_at_rank(first);
    root.broadcast_into(&mut header[..]);
    let mut bytes = text.into_bytes();
    bytes.resize(header[1] as usize, 0);
    root.broadcast_into(&mut bytes[..]);
    let text = String::from_utf8_lossy(&bytes).into_owned();
    Err(Error::of_kind(header[0] as i32, text))
}

/// Collective. Runs `work` on rank 0 only; all ranks learn whether it succeeded.
pub(super) fn on_rank_zero(comm: &SimpleCommunicator, work: impl FnOnce() -> Result<()>) -> Result<()> {
    agree(comm, if comm.rank() == 0 { work() } else { Ok(()) })
}

/// Collective. An error unless every rank passes the same text.
pub(super) fn same_everywhere(comm: &SimpleCommunicator, what: &str, text: &str) -> Result<()> {
    let (mut low, mut high) = (0u64, 0u64);
    let mine = StableHash::new().bytes(text.as_bytes()).finish();
    comm.all_reduce_into(&mine, &mut low, SystemOperation::min());
    comm.all_reduce_into(&mine, &mut high, SystemOperation::max());
    if low == high { Ok(()) } else { Err(Error::internal(format!("{what} differ between ranks"))) }
}
