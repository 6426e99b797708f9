//! The group `/VTKHDF`: the bodies with their fields, as ParaView and VTK read them.
//!
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html>. Every rank writes one
//! partition: its points, cells and connectivity are consecutive rows, and node numbers are those within the
//! partition. With load steps the fields of all partitions after one step are followed by those after the next.
use super::hdf5_rows::{Place, Plan, Rows, Values};
use super::spread::{Share, Spread};
use super::{Field, Piece, ResultFile, RunInfo, State, steps};
use crate::error::Result;
use crate::record::LoadStep;

/// Creates the group; its rows are added to `plan`.
pub(super) fn create<'a>(
    spread: &Spread,
    file: &Place,
    result: &ResultFile<'a>,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let ResultFile { piece, before, run, .. } = *result;
    let group = file.group("VTKHDF")?;
    // Without steps nothing of version 2 is needed, and every reader takes version 1.
    let version = if run.steps.is_some() { 2i64 } else { 1 };
    group.numbers("Version", &[version, 0])?;
    group.text("Type", "UnstructuredGrid")?;

    plan.add(&group, "NumberOfPoints", None, partition(spread, spread.points.own))?;
    plan.add(&group, "NumberOfCells", None, partition(spread, spread.cells.own))?;
    plan.add(&group, "NumberOfConnectivityIds", None, partition(spread, spread.connectivity.own))?;

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
    let cell_data = group.group("CellData")?;
    plan.add(&cell_data, "body", None, Rows { start, total, columns: 1, values: bodies })?;
    let of_steps = |fields: fn(&State) -> &[Field], last: &'a [Field]| -> Vec<&'a [Field]> {
        before.iter().map(fields).chain([last]).collect()
    };
    let cell_fields = of_steps(|state| &state.cell_fields, &piece.cell_fields);
    add_fields(&cell_data, &cell_fields, spread.cells, run, plan)?;
    let point_data = group.group("PointData")?;
    let point_fields = of_steps(|state| &state.point_fields, &piece.point_fields);
    add_fields(&point_data, &point_fields, spread.points, run, plan)?;

    let field_data = group.group("FieldData")?;
    let one = vec![(run.alternations, run.converged())];
    let of_steps = |table: &Vec<LoadStep>| {
        table.iter().map(|step| (step.alternations, step.reason.converged())).collect()
    };
    let facts: Vec<(u64, bool)> = run.steps.as_ref().map_or(one, of_steps);
    let mut fact = |name: &str, value: fn(&(u64, bool)) -> i64| {
        let values = Values::I64(facts.iter().map(value).collect());
        plan.add(&field_data, name, None, spread.rows_of_first(facts.len(), values))
    };
    fact("alternations", |step| step.0 as i64)?;
    fact("converged", |step| i64::from(step.1))?;
    match &run.steps {
        Some(table) => steps::create_time(spread, &group, piece, table.len(), plan),
        None => Ok(()),
    }
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

/// Fields of every step, one step after the other.
fn add_fields<'a>(
    group: &Place,
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
