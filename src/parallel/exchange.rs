//! Vectors between the two sides of contact pairs: a copy inside a process, a message between rank groups.
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{cell::Cell, rc::Rc};

/// What this rank has sent to other rank groups.
#[derive(Debug, Default)]
pub struct Traffic {
    messages: Cell<u64>,
    bytes: Cell<u64>,
    reductions: Cell<u64>,
}

impl Traffic {
    /// Messages, their bytes, and reductions over the groups this rank took part in.
    pub fn counts(&self) -> [u64; 3] {
        [self.messages.get(), self.bytes.get(), self.reductions.get()]
    }

    fn add(&self, values: &[f64]) {
        self.messages.set(self.messages.get() + 1);
        self.bytes.set(self.bytes.get() + size_of_val(values) as u64);
    }
}

/// The other side of a pair, as seen from one of this rank's sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Partner {
    /// On this rank: index among this rank's sides.
    Here(usize),
    /// On another group's first rank.
    Remote {
        /// Its rank in the roots' communicator.
        rank: i32,
        /// Pair index: distinguishes several pairs between the same two ranks.
        pair: usize,
    },
    /// A rigid surface, which every group holds itself: nothing is exchanged, an empty vector is received.
    Rigid,
}

/// The exchange between the sides of pairs, held by the first rank of every group.
pub struct Exchange<'a> {
    /// Communicator of the group roots; `None` in a process that holds every side itself.
    pub comm: Option<&'a SimpleCommunicator>,
    /// Partner of each of this rank's sides.
    pub partners: Vec<Partner>,
    /// Counts what is sent.
    pub traffic: Rc<Traffic>,
}

impl Exchange<'_> {
    /// Sends `out[i]` from side i to its partner; returns what the partners sent. Messages travel only between ranks
    /// that share a pair, and all of those must call it.
    pub fn swap(&self, out: &[Vec<f64>]) -> Vec<Vec<f64>> {
        assert_eq!(out.len(), self.partners.len());
        mpi::request::scope(|scope| {
            let mut requests = Vec::new();
            for (values, partner) in std::iter::zip(out, &self.partners) {
                if let (Partner::Remote { rank, pair }, Some(comm)) = (*partner, self.comm) {
                    let to = comm.process_at_rank(rank);
                    self.traffic.add(values);
                    requests.push(to.immediate_send_with_tag(scope, &values[..], pair as i32));
                }
            }
            let received = self
                .partners
                .iter()
                .map(|partner| match (*partner, self.comm) {
                    (Partner::Here(side), _) => out[side].clone(),
                    (Partner::Rigid, _) => Vec::new(),
                    (Partner::Remote { rank, pair }, Some(comm)) => {
                        comm.process_at_rank(rank).receive_vec_with_tag(pair as i32).0
                    }
                    (Partner::Remote { .. }, None) => unreachable!("a remote side needs a communicator"),
                })
                .collect();
            for request in requests {
                request.wait();
            }
            received
        })
    }

    /// The communicator of the group roots, for a reduction, which is counted if there are others.
    fn reducing(&self) -> Option<&SimpleCommunicator> {
        let others = self.comm.filter(|comm| comm.size() > 1);
        if others.is_some() {
            self.traffic.reductions.set(self.traffic.reductions.get() + 1);
        }
        self.comm
    }

    /// Makes all group roots leave with the same result. Collective on them.
    pub fn agree<T>(&self, result: crate::Result<T>) -> crate::Result<T> {
        match self.reducing() {
            Some(comm) => super::agree(comm, result),
            None => result,
        }
    }

    /// Sum over the group roots, entry by entry. Collective on them.
    pub fn sum(&self, values: &[f64]) -> Vec<f64> {
        self.reducing().map_or_else(|| values.to_vec(), |comm| super::sum(comm, values))
    }

    /// Largest value over the group roots, of either sign. Collective on them.
    pub fn max_signed(&self, value: f64) -> f64 {
        self.reducing().map_or(value, |comm| super::max_signed(comm, value))
    }

    /// Largest value over the group roots, entry by entry. Collective on them.
    pub fn max(&self, values: &[f64]) -> Vec<f64> {
        self.reducing().map_or_else(|| values.to_vec(), |comm| super::max(comm, values))
    }
}
