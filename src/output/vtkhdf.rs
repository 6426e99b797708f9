//! The group `/VTKHDF`: the bodies with their fields, as ParaView and VTK read them.
//!
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html>. Every rank writes one
//! partition: its points, cells and connectivity are consecutive rows, and node numbers are those within the
//! partition. With load steps the fields of all partitions after one step are followed by those after the next.
use super::hdf5_rows::{Plan, Rows, Values};
use super::hdf5_text::string_attribute;
use super::{Field, LoadStep, Piece, ResultFile, RunInfo, State, steps};
use crate::error::Result;
use hdf5::{File, Group};
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;

/// How many rows of the grid the ranks before this one have, this one has, and all have.
struct Spread {
    rank: usize,
    size: usize,
    points: Share,
    cells: Share,
    connectivity: Share,
}

#[derive(Clone, Copy)]
struct Share {
    start: usize,
    own: usize,
    total: usize,
}

impl Spread {
    /// Collective.
    fn new(comm: &SimpleCommunicator, piece: &Piece) -> Self {
        let connectivity: usize = piece.cells.iter().map(|cell| cell.nodes().len()).sum();
        let own = [piece.points.len() as u64, piece.cells.len() as u64, connectivity as u64];
        let (rank, size) = (comm.rank() as usize, comm.size() as usize);
        let mut all = vec![0u64; 3 * size];
        comm.all_gather_into(&own[..], &mut all[..]);
        let share = |k: usize| {
            let counts = || all.iter().skip(k).step_by(3).map(|&n| n as usize);
            Share { start: counts().take(rank).sum(), own: own[k] as usize, total: counts().sum() }
        };
        Spread { rank, size, points: share(0), cells: share(1), connectivity: share(2) }
    }

    /// One row per rank.
    fn partition<'a>(&self, value: usize) -> Rows<'a> {
        let values = Values::I64(vec![value as i64].into());
        Rows { start: self.rank, total: self.size, columns: 1, values }
    }
}

/// Collective. Creates the group; its rows are added to `plan`.
pub(super) fn create<'a>(
    comm: &SimpleCommunicator,
    file: &File,
    result: &ResultFile<'a>,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let ResultFile { piece, before, run, .. } = *result;
    let spread = Spread::new(comm, piece);
    let group = file.create_group("VTKHDF")?;
    // Without steps nothing of version 2 is needed, and every reader takes version 1.
    let version = if run.steps.is_some() { 2i64 } else { 1 };
    group.new_attr::<i64>().shape(2).create("Version")?.write_raw(&[version, 0])?;
    string_attribute(&group, "Type", "UnstructuredGrid")?;

    plan.add(&group, "NumberOfPoints", None, spread.partition(spread.points.own))?;
    plan.add(&group, "NumberOfCells", None, spread.partition(spread.cells.own))?;
    plan.add(&group, "NumberOfConnectivityIds", None, spread.partition(spread.connectivity.own))?;

    let Share { start, total, .. } = spread.points;
    let points = Values::F64(piece.points.as_flattened().into());
    plan.add(&group, "Points", Some(run.unit("m")), Rows { start, total, columns: 3, values: points })?;

    let Share { start, total, .. } = spread.connectivity;
    let nodes: Vec<i64> = piece.cells.iter().flat_map(|cell| cell.nodes()).map(|&i| i64::from(i)).collect();
    let nodes = Values::I64(nodes.into());
    plan.add(&group, "Connectivity", None, Rows { start, total, columns: 1, values: nodes })?;

    let Share { start, total, .. } = spread.cells;
    let types: Vec<u8> = piece.cells.iter().map(|cell| cell.kind.vtk_type()).collect();
    let types = Values::U8(types.into());
    plan.add(&group, "Types", None, Rows { start, total, columns: 1, values: types })?;
    // A partition of n cells has n + 1 offsets, an empty one has the offset 0.
    let offsets = Rows {
        start: start + spread.rank,
        total: total + spread.size,
        columns: 1,
        values: Values::I64(offsets(piece).into()),
    };
    plan.add(&group, "Offsets", None, offsets)?;

    let bodies = Values::I32(piece.cell_bodies.as_slice().into());
    let cell_data = group.create_group("CellData")?;
    plan.add(&cell_data, "body", None, Rows { start, total, columns: 1, values: bodies })?;
    let of_steps = |fields: fn(&State) -> &[Field], last: &'a [Field]| -> Vec<&'a [Field]> {
        before.iter().map(fields).chain([last]).collect()
    };
    let cell_fields = of_steps(|state| &state.cell_fields, &piece.cell_fields);
    add_fields(&cell_data, &cell_fields, spread.cells, run, plan)?;
    let point_data = group.create_group("PointData")?;
    let point_fields = of_steps(|state| &state.point_fields, &piece.point_fields);
    add_fields(&point_data, &point_fields, spread.points, run, plan)?;

    let field_data = group.create_group("FieldData")?;
    let one = vec![(run.alternations, run.converged())];
    let of_steps = |table: &Vec<LoadStep>| {
        table.iter().map(|step| (step.alternations, step.reason.converged())).collect()
    };
    let facts: Vec<(u64, bool)> = run.steps.as_ref().map_or(one, of_steps);
    let total = facts.len();
    let mut fact = |name: &str, value: fn(&(u64, bool)) -> i64| {
        let values = facts.iter().map(value).filter(|_| spread.rank == 0).collect();
        plan.add(&field_data, name, None, Rows { start: 0, total, columns: 1, values: Values::I64(values) })
    };
    fact("alternations", |step| step.0 as i64)?;
    fact("converged", |step| i64::from(step.1))?;
    match &run.steps {
        Some(table) => {
            let sizes = [spread.points.total, spread.cells.total];
            steps::create_time(comm, &group, piece, table.len(), sizes, plan)
        }
        None => Ok(()),
    }
}

fn offsets(piece: &Piece) -> Vec<i64> {
    let mut offsets = vec![0];
    let mut end = 0;
    for cell in &piece.cells {
        end += cell.nodes().len() as i64;
        offsets.push(end);
    }
    offsets
}

/// Fields of every step, one step after the other.
fn add_fields<'a>(
    group: &Group,
    steps: &[&'a [Field]],
    share: Share,
    run: &RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let Some(last) = steps.last() else { return Ok(()) };
    for (i, field) in last.iter().enumerate() {
        let block = |(k, fields): (usize, &&'a [Field])| Rows {
            start: k * share.total + share.start,
            total: steps.len() * share.total,
            columns: field.components,
            values: Values::F64(fields[i].values.as_slice().into()),
        };
        let blocks = steps.iter().enumerate().map(block).collect();
        plan.add_blocks(group, &field.name, Some(run.unit(field.unit)), blocks)?;
    }
    Ok(())
}
