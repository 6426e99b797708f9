//! Ranks: how they are dealt to bodies, how they agree on errors, how the two sides of a pair exchange vectors.
//!
//! Collective calls appear here, in [`crate::petsc`] and in [`crate::output`], and say so.
mod child;
mod deal;
mod end;
mod exchange;
mod memory;

pub use child::{bind_to_parent, end_with_parent};
pub use deal::{Share, deal};
pub use end::end_all;
pub use exchange::{Exchange, Partner, Traffic};
pub use memory::{busy_with, can_have, demand};

use crate::error::{Error, Result};
use mpi::{
    collective::SystemOperation,
    environment::Universe,
    topology::{Color, SimpleCommunicator},
    traits::*,
};
use std::time::Duration;

/// Starts MPI; `None` if it has been started. A process on its own needs no Open MPI daemon beside it, and has no rank to
/// give way to while it waits. To be called before there are threads.
pub fn initialize() -> Option<Universe> {
    let is_set = |name| std::env::var_os(name).is_some();
    if !["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"].into_iter().any(is_set) {
        // SAFETY: there is one thread.
        unsafe {
            std::env::set_var("OMPI_MCA_ess_singleton_isolated", "1");
            std::env::set_var("OMPI_MCA_mpi_yield_when_idle", "0");
        }
    }
    mpi::initialize()
}

/// The communicators of this rank.
pub struct Groups {
    /// All ranks.
    pub world: SimpleCommunicator,
    /// The rank group this rank belongs to.
    pub group: SimpleCommunicator,
    /// The first ranks of all groups, which run the alternation; `None` on the others.
    pub roots: Option<SimpleCommunicator>,
    /// All groups, in the order of their ranks.
    pub shares: Vec<Share>,
    /// Index of this rank's group in `shares`.
    pub own: usize,
}

impl Groups {
    /// Splits `world` into rank groups, given each body's cost. Collective.
    pub fn new(world: &SimpleCommunicator, costs: &[usize]) -> Groups {
        let shares = deal(costs, world.size() as usize);
        let rank = world.rank() as usize;
        let own = shares.iter().position(|s| s.ranks.contains(&rank)).expect("every rank is dealt");
        let group = world.split_by_color(Color::with_value(own as i32)).expect("the color is defined");
        let is_root = rank == shares[own].ranks.start;
        let color = if is_root { Color::with_value(0) } else { Color::undefined() };
        Groups { world: world.duplicate(), group, roots: world.split_by_color(color), shares, own }
    }

    /// Bodies of this rank's group.
    pub fn bodies(&self) -> &[usize] {
        &self.shares[self.own].bodies
    }

    /// Index, in `shares` and in the roots' communicator, of the group that owns a body.
    pub fn group_of(&self, body: usize) -> usize {
        self.shares.iter().position(|s| s.bodies.contains(&body)).expect("every body is dealt")
    }

    /// True on the first rank of the group.
    pub fn is_root(&self) -> bool {
        self.roots.is_some()
    }
}

/// Makes all ranks of `comm` leave with the same result: if any has an error, all return the error of the lowest such
/// rank. Collective.
pub fn agree<T>(comm: &SimpleCommunicator, result: Result<T>) -> Result<T> {
    let (rank, size) = (comm.rank(), comm.size());
    let failed = if result.is_err() { rank } else { size };
    let mut first = size;
    comm.all_reduce_into(&failed, &mut first, SystemOperation::min());
    if first == size {
        return result;
    }
    let mut code = result.as_ref().err().map_or(0, Error::kind);
    let mut text = result.err().map_or_else(Vec::new, |e| e.to_string().into_bytes());
    let root = comm.process_at_rank(first);
    let mut length = text.len() as u64;
    root.broadcast_into(&mut code);
    root.broadcast_into(&mut length);
    text.resize(length as usize, 0);
    root.broadcast_into(&mut text[..]);
    let text = String::from_utf8_lossy(&text).into_owned();
    Err(Error::of_kind(code, text))
}

/// Sum over all ranks, entry by entry. Collective.
pub fn sum(comm: &SimpleCommunicator, values: &[f64]) -> Vec<f64> {
    let mut total = vec![0.0; values.len()];
    comm.all_reduce_into(values, &mut total[..], SystemOperation::sum());
    total
}

/// An integer that orders like the number, with what is not a number above all: MPI's maximum of doubles loses that.
fn ordered(value: f64) -> i64 {
    // Of either sign: a positive one is the largest of the total order.
    let bits = if value.is_nan() { f64::NAN } else { value }.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

/// The number of an integer of [`ordered`].
fn from_ordered(key: i64) -> f64 {
    f64::from_bits((key ^ (((key >> 63) as u64) >> 1) as i64) as u64)
}

/// Largest value over all ranks, entry by entry; not a number where a rank has that. Collective.
pub fn max(comm: &SimpleCommunicator, values: &[f64]) -> Vec<f64> {
    let own: Vec<i64> = values.iter().copied().map(ordered).collect();
    let mut largest = vec![0; values.len()];
    comm.all_reduce_into(&own[..], &mut largest[..], SystemOperation::max());
    largest.into_iter().map(from_ordered).collect()
}

/// Largest value over all ranks, of either sign. Collective.
pub fn max_signed(comm: &SimpleCommunicator, value: f64) -> f64 {
    max(comm, &[value])[0]
}

/// Rank 0's value. Collective.
pub fn from_first(comm: &SimpleCommunicator, mut value: f64) -> f64 {
    comm.process_at_rank(0).broadcast_into(&mut value);
    value
}

/// A barrier that sleeps while it waits, so that ranks with nothing to do leave the cores to the others. Collective.
pub fn idle_barrier(comm: &SimpleCommunicator) {
    let mut request = comm.immediate_barrier();
    while let Err(pending) = request.test() {
        request = pending;
        std::thread::sleep(Duration::from_micros(200));
    }
}

/// Broadcasts a vector whose length only `root` knows. Collective.
pub fn broadcast(comm: &SimpleCommunicator, root: i32, values: &mut Vec<f64>) {
    let process = comm.process_at_rank(root);
    let mut length = values.len() as u64;
    process.broadcast_into(&mut length);
    values.resize(length as usize, 0.0);
    process.broadcast_into(&mut values[..]);
}

/// Where each of consecutive pieces of these lengths begins.
fn starts(counts: &[i32]) -> Vec<i32> {
    let ends = counts.iter().scan(0, |end, &n| {
        *end += n;
        Some(*end - n)
    });
    ends.collect()
}

/// Brings a vector from every rank to rank 0, concatenated in rank order; empty elsewhere. Collective.
pub fn gather(comm: &SimpleCommunicator, values: &[f64]) -> Vec<f64> {
    let root = comm.process_at_rank(0);
    let count = values.len() as i32;
    if comm.rank() != 0 {
        root.gather_into(&count);
        root.gather_varcount_into(values);
        return Vec::new();
    }
    let mut counts = vec![0; comm.size() as usize];
    root.gather_into_root(&count, &mut counts[..]);
    let displacements = starts(&counts);
    let mut all = vec![0.0; counts.iter().sum::<i32>() as usize];
    let mut partition = mpi::datatype::PartitionMut::new(&mut all[..], &counts[..], &displacements[..]);
    root.gather_varcount_into_root(values, &mut partition);
    all
}

/// Deals rank 0's vector out: each rank, in rank order, gets its next `n` entries. Collective.
pub fn scatter(comm: &SimpleCommunicator, all: &[f64], n: usize) -> Vec<f64> {
    let root = comm.process_at_rank(0);
    let count = n as i32;
    let mut own = vec![0.0; n];
    if comm.rank() != 0 {
        root.gather_into(&count);
        root.scatter_varcount_into(&mut own[..]);
        return own;
    }
    let mut counts = vec![0; comm.size() as usize];
    root.gather_into_root(&count, &mut counts[..]);
    let displacements = starts(&counts);
    let partition = mpi::datatype::Partition::new(all, &counts[..], &displacements[..]);
    root.scatter_varcount_into_root(&partition, &mut own[..]);
    own
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_order_like_the_numbers_and_what_is_not_one_is_above_all() {
        let rising = [f64::NEG_INFINITY, -1e300, -1.0, -1e-320, 0.0, 1e-320, 2.0, 1e300, f64::INFINITY];
        let keys: Vec<i64> = rising.into_iter().map(ordered).collect();
        assert!(keys.is_sorted_by(|a, b| a < b));
        assert_eq!(keys.iter().map(|k| from_ordered(*k)).collect::<Vec<_>>(), rising);
        for nan in [f64::NAN, -f64::NAN] {
            assert!(keys.iter().all(|k| *k < ordered(nan)) && from_ordered(ordered(nan)).is_nan());
        }
    }
}
