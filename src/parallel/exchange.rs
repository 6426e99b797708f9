//! Vectors between the two sides of contact pairs: a copy inside a process, a message between rank groups.
use mpi::{topology::SimpleCommunicator, traits::*};

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
}

/// The exchange between sides. One side of every pair is "A", the other "B".
pub struct Exchange<'a> {
    /// Communicator of the group roots.
    pub comm: &'a SimpleCommunicator,
    /// Partner of each of this rank's sides.
    pub partners: Vec<Partner>,
}

impl Exchange<'_> {
    /// Sends `out[i]` from side i to its partner; returns what the partners sent. Messages travel only between ranks
    /// that share a pair, and all of those must call it.
    pub fn swap(&self, out: &[Vec<f64>]) -> Vec<Vec<f64>> {
        assert_eq!(out.len(), self.partners.len());
        mpi::request::scope(|scope| {
            let requests: Vec<_> = std::iter::zip(out, &self.partners)
                .filter_map(|(values, partner)| match *partner {
                    Partner::Here(_) => None,
                    Partner::Remote { rank, pair } => Some(
                        self.comm
                            .process_at_rank(rank)
                            .immediate_send_with_tag(scope, &values[..], pair as i32),
                    ),
                })
                .collect();
            let received = self
                .partners
                .iter()
                .map(|partner| match *partner {
                    Partner::Here(side) => out[side].clone(),
                    Partner::Remote { rank, pair } => {
                        self.comm.process_at_rank(rank).receive_vec_with_tag(pair as i32).0
                    }
                })
                .collect();
            for request in requests {
                request.wait();
            }
            received
        })
    }
}
