//! How the result is spread over the ranks and the load steps: whose rows of a dataset are where.
use super::hdf5_rows::{Grown, Place, Plan, Rows, Values};
use super::{Piece, ResultFile};
use crate::error::{Error, Result};
use crate::record::PairTables;
use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;

/// How many rows the ranks before this one have, this one has, and all have. The same totals on all ranks.
pub(super) struct Spread {
    pub rank: usize,
    pub size: usize,
    pub points: Share,
    pub cells: Share,
    pub connectivity: Share,
    /// Length of the tables of both sides of each contact pair; 0 where no rank has one.
    pub sides: Vec<[usize; 2]>,
    /// Of the same sides: more than 0 if it has the multipliers, and the length of a closed one, m, or 0.
    pub side_facts: Vec<[[f64; 2]; 2]>,
    /// Rows of the history, which rank 0 has.
    pub history: usize,
    /// Whether these rows have the contact pairs.
    pub history_of_pairs: bool,
    /// The steps that the file has already; `None`: a file without a table of steps.
    pub growth: Option<Growth>,
}

/// How far a file has grown that takes one load step after the other. The same on all ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Growth {
    /// Steps it has.
    pub steps: usize,
    /// Rows of their history.
    pub history: usize,
    /// Steps it has room for without a change of its structure, at least 1.
    pub expected: usize,
    /// Bytes of the longest name of a step.
    pub name_width: usize,
}

#[derive(Clone, Copy)]
pub(super) struct Share {
    pub start: usize,
    pub own: usize,
    pub total: usize,
}

impl Spread {
    /// Collective.
    pub fn new(comm: &SimpleCommunicator, result: &ResultFile, growth: Option<Growth>) -> Result<Self> {
        let (rank, size) = (comm.rank() as usize, comm.size() as usize);
        let [points, cells, connectivity] = grid(comm, result.piece);
        let of_pairs = result.history.first().is_some_and(|row| !row.pairs.is_empty());
        let mut history = [result.history.len() as u64, u64::from(of_pairs)];
        comm.process_at_rank(0).broadcast_into(&mut history[..]);
        Ok(Spread {
            rank,
            size,
            points,
            cells,
            connectivity,
            sides: side_lengths(comm, result.pairs)?,
            side_facts: side_facts(comm, result.pairs),
            history: history[0] as usize,
            history_of_pairs: history[1] != 0,
            growth,
        })
    }

    /// False if an earlier step has made what does not change.
    pub fn is_first(&self) -> bool {
        self.growth.is_none_or(|growth| growth.steps == 0)
    }

    /// Adds the rows of a dataset that grows with the steps, if there are any: `rows.total` rows a step.
    pub fn add_by_step<'a>(
        &self,
        plan: &mut Plan<'a>,
        group: &Place,
        name: &str,
        unit: Option<&str>,
        rows: Rows<'a>,
    ) -> Result<()> {
        let Some(growth) = self.growth else { return plan.add(group, name, unit, rows) };
        // HDF5 has no chunks without rows.
        if rows.total == 0 {
            return plan.add(group, name, unit, rows);
        }
        let grown = Grown { from: growth.steps * rows.total, chunk: growth.expected * rows.total };
        plan.grow(group, name, unit, rows, grown, false)
    }

    /// What rank 0 has and the others have not.
    pub fn on_first<'a, T>(&self, all: &'a [T]) -> &'a [T] {
        if self.rank == 0 { all } else { &[] }
    }

    /// A column that rank 0 writes.
    pub fn rows_of_first(&self, total: usize, values: Values<'static>) -> Rows<'static> {
        Rows { start: 0, total, columns: 1, values: if self.rank == 0 { values } else { values.none() } }
    }
}

/// Collective. Points, cells and nodes of the cells.
fn grid(comm: &SimpleCommunicator, piece: &Piece) -> [Share; 3] {
    let connectivity: usize = piece.cells.iter().map(|cell| cell.nodes().len()).sum();
    let own = [piece.points.len() as u64, piece.cells.len() as u64, connectivity as u64];
    let (rank, size) = (comm.rank() as usize, comm.size() as usize);
    let mut all = vec![0u64; 3 * size];
    comm.all_gather_into(&own[..], &mut all[..]);
    [0, 1, 2].map(|k| {
        let counts = || all.iter().skip(k).step_by(3).map(|&n| n as usize);
        Share { start: counts().take(rank).sum(), own: own[k] as usize, total: counts().sum() }
    })
}

/// Collective. What rank 0 is to write of the sides, which other ranks hold.
fn side_facts(comm: &SimpleCommunicator, pairs: &[PairTables]) -> Vec<[[f64; 2]; 2]> {
    let sides = pairs.iter().flat_map(|pair| &pair.sides);
    let own: Vec<f64> = sides
        .flat_map(|side| match side {
            Some(table) => [f64::from(u8::from(table.multipliers)), table.closed.unwrap_or(0.0)],
            None => [0.0; 2],
        })
        .collect();
    let all = crate::parallel::max(comm, &own);
    all.chunks_exact(4).map(|v| [[v[0], v[1]], [v[2], v[3]]]).collect()
}

/// Collective. Lengths of the tables, of each of which at most one rank has a copy.
fn side_lengths(comm: &SimpleCommunicator, pairs: &[PairTables]) -> Result<Vec<[usize; 2]>> {
    let sides = || pairs.iter().flat_map(|pair| &pair.sides);
    let mine: Vec<[u64; 2]> =
        sides().map(|side| side.as_ref().map_or([0, 0], |table| [1, table.s.len() as u64])).collect();
    let mut sum = vec![[0u64; 2]; mine.len()];
    comm.all_reduce_into(mine.as_flattened(), sum.as_flattened_mut(), SystemOperation::sum());
    let sides = sum.as_chunks::<2>().0;
    if let Some(p) = sides.iter().position(|[a, b]| a[0].max(b[0]) > 1) {
        return Err(Error::internal(format!(
            "several ranks hold a side of contact pair \"{}\"",
            pairs[p].name
        )));
    }
    Ok(sides.iter().map(|side| side.map(|[_, length]| length as usize)).collect())
}
