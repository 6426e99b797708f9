//! The group `/VTKHDF`: the bodies with their fields, as ParaView and VTK read them.
//!
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html>. Every rank writes one
//! partition: its points, cells and connectivity are consecutive rows, and node numbers are those within the
//! partition. With load steps the fields of all partitions after one step are followed by those after the next.
use super::hdf5_rows::{Place, Plan, Rows, Values};
use super::spread::{Share, Spread};
use super::{Field, Piece, ResultFile, RunInfo, steps};
use crate::error::Result;

/// Creates the group, or lets it grow by a step; its rows are added to `plan`.
pub(super) fn create<'a>(
    spread: &Spread,
    file: &Place,
    result: &ResultFile<'a>,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let ResultFile { piece, run, .. } = *result;
    let group = file.group("VTKHDF")?;
    if spread.is_first() {
        create_grid(spread, &group, result, plan)?;
    }
    add_fields(&group.group("CellData")?, &piece.cell_fields, (spread, spread.cells), run, plan)?;
    add_fields(&group.group("PointData")?, &piece.point_fields, (spread, spread.points), run, plan)?;
    let field_data = group.group("FieldData")?;
    let (alternations, converged) = match run.steps.as_ref().and_then(|steps| steps.last()) {
        Some(step) => (step.alternations, step.reason.converged()),
        None => (run.alternations, run.converged()),
    };
    for (name, value) in [("alternations", alternations as i64), ("converged", i64::from(converged))] {
        let rows = spread.rows_of_first(1, Values::I64(vec![value].into()));
        spread.add_by_step(plan, &field_data, name, None, rows)?;
    }
    match spread.growth {
        Some(growth) => steps::add_time(spread, growth, &group, piece, plan),
        None => Ok(()),
    }
}

/// The grid, which does not change.
fn create_grid<'a>(
    spread: &Spread,
    group: &Place,
    result: &ResultFile<'a>,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let ResultFile { piece, run, .. } = *result;
    // Without steps nothing of version 2 is needed, and every reader takes version 1.
    let version = if run.steps.is_some() { 2i64 } else { 1 };
    group.numbers("Version", &[version, 0])?;
    group.text("Type", "UnstructuredGrid")?;

    plan.add(group, "NumberOfPoints", None, partition(spread, spread.points.own))?;
    plan.add(group, "NumberOfCells", None, partition(spread, spread.cells.own))?;
    plan.add(group, "NumberOfConnectivityIds", None, partition(spread, spread.connectivity.own))?;

    let Share { start, total, .. } = spread.points;
    let points = Values::F64(piece.points.as_flattened().into());
    plan.add(group, "Points", Some(run.unit("m")), Rows { start, total, columns: 3, values: points })?;

    let Share { start, total, .. } = spread.connectivity;
    let nodes: Vec<i64> = piece.cells.iter().flat_map(|cell| cell.nodes()).map(|&i| i64::from(i)).collect();
    let nodes = Values::I64(nodes.into());
    plan.add(group, "Connectivity", None, Rows { start, total, columns: 1, values: nodes })?;

    let Share { start, total, .. } = spread.cells;
    let types: Vec<u8> = piece.cells.iter().map(|cell| cell.kind.vtk_type()).collect();
    let types = Values::U8(types.into());
    plan.add(group, "Types", None, Rows { start, total, columns: 1, values: types })?;
    // A partition of n cells has n + 1 offsets, an empty one has the offset 0.
    let offsets = Rows {
        start: start + spread.rank,
        total: total + spread.size,
        columns: 1,
        values: Values::I64(offsets(piece).into()),
    };
    plan.add(group, "Offsets", None, offsets)?;

    let bodies = Values::I32(piece.cell_bodies.as_slice().into());
    let cell_data = group.group("CellData")?;
    plan.add(&cell_data, "body", None, Rows { start, total, columns: 1, values: bodies })?;
    Ok(())
}

/// One row per rank.
fn partition<'a>(spread: &Spread, value: usize) -> Rows<'a> {
    let values = Values::I64(vec![value as i64].into());
    Rows { start: spread.rank, total: spread.size, columns: 1, values }
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

/// Fields, after those of the steps before.
fn add_fields<'a>(
    group: &Place,
    fields: &'a [Field],
    (spread, share): (&Spread, Share),
    run: &RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    fields.iter().try_for_each(|field| {
        let Share { start, total, .. } = share;
        let values = Values::F64(field.values.as_slice().into());
        let rows = Rows { start, total, columns: field.components, values };
        spread.add_by_step(plan, group, &field.name, Some(run.unit(field.unit)), rows)
    })
}
