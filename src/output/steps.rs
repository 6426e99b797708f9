//! The load steps: `/VTKHDF/Steps`, by which ParaView plays them, and `/steps`, what acted in each.
//!
//! The grid is written once: every step starts at its first part, point and cell, and only the fields move on.
use super::hdf5_rows::{Place, Plan, Values};
use super::hdf5_text::read_strings;
use super::spread::Spread;
use super::{Field, Piece};
use crate::error::{Error, Result};
use crate::record::{LoadStep, Reason};
use hdf5::File;

/// Creates `Steps` in the group `/VTKHDF`.
pub(super) fn create_time(
    spread: &Spread,
    vtkhdf: &Place,
    piece: &Piece,
    n_steps: usize,
    plan: &mut Plan,
) -> Result<()> {
    let group = vtkhdf.group("Steps")?;
    group.number("NSteps", n_steps as i64)?;
    let times = (1..=n_steps).map(|k| k as f64).collect();
    plan.add(&group, "Values", None, spread.rows_of_first(n_steps, Values::F64(times)))?;
    // `stride` rows from one step to the next.
    let starts = |stride: usize| {
        spread.rows_of_first(n_steps, Values::I64((0..n_steps).map(|k| (k * stride) as i64).collect()))
    };
    let parts = Values::I64(vec![spread.size as i64; n_steps].into());
    plan.add(&group, "NumberOfParts", None, spread.rows_of_first(n_steps, parts))?;
    plan.add(&group, "PartOffsets", None, starts(0))?;
    plan.add(&group, "PointOffsets", None, starts(0))?;
    // A column per topology, of which an unstructured grid has one.
    plan.add_table(&group, "CellOffsets", starts(0))?;
    plan.add_table(&group, "ConnectivityIdOffsets", starts(0))?;
    let mut offsets = |name: &str, fields: &[Field], stride: usize| {
        let group = group.group(name)?;
        fields.iter().try_for_each(|field| plan.add(&group, &field.name, None, starts(stride)))?;
        Ok::<_, Error>(group)
    };
    offsets("PointDataOffsets", &piece.point_fields, spread.points.total)?;
    let of_cells = offsets("CellDataOffsets", &piece.cell_fields, spread.cells.total)?;
    let of_fields = offsets("FieldDataOffsets", &[], 0)?;
    plan.add(&of_cells, "body", None, starts(0))?;
    plan.add(&of_fields, "alternations", None, starts(1))?;
    plan.add(&of_fields, "converged", None, starts(1))
}

/// Creates `/steps`: a row per step.
pub(super) fn create_table(spread: &Spread, file: &Place, steps: &[LoadStep], plan: &mut Plan) -> Result<()> {
    let group = file.group("steps")?;
    let mut column = |name: &str, values: Values<'static>| {
        plan.add(&group, name, None, spread.rows_of_first(steps.len(), values))
    };
    let names: Vec<_> = steps.iter().map(|step| step.name.as_deref().unwrap_or("")).collect();
    let reasons: Vec<_> = steps.iter().map(|step| step.reason.name()).collect();
    column("name", Values::text(&names))?;
    column("reason", Values::text(&reasons))?;
    column("loads", Values::F64(steps.iter().map(|step| step.loads).collect()))?;
    column("supports", Values::F64(steps.iter().map(|step| step.supports).collect()))?;
    column("temperature", Values::F64(steps.iter().map(|step| step.temperature).collect()))?;
    column("converged", Values::U8(steps.iter().map(|step| u8::from(step.reason.converged())).collect()))?;
    column("alternations", Values::I64(steps.iter().map(|step| step.alternations as i64).collect()))?;
    column("updates", Values::I64(steps.iter().map(|step| step.updates as i64).collect()))
}

/// Reads `/steps`; `None` if the case had no table of them.
pub(super) fn read(file: &File) -> Result<Option<Vec<LoadStep>>> {
    if !file.link_exists("steps") {
        return Ok(None);
    }
    let group = file.group("steps")?;
    let reals = |name| Ok::<_, Error>(group.dataset(name)?.read_raw::<f64>()?);
    let counts = |name| Ok::<_, Error>(group.dataset(name)?.read_raw::<u64>()?);
    let (names, reasons) = (read_strings(&group.dataset("name")?)?, read_strings(&group.dataset("reason")?)?);
    let (loads, supports, temperature) = (reals("loads")?, reals("supports")?, reals("temperature")?);
    let (alternations, updates) = (counts("alternations")?, counts("updates")?);
    let n = names.len();
    let lengths = [reasons.len(), loads.len(), supports.len(), temperature.len(), alternations.len()];
    if lengths.iter().any(|&length| length != n) || updates.len() != n || n == 0 {
        return Err(Error::input("the columns of the steps differ in length"));
    }
    let step = |i: usize| {
        let reason = Reason::named(&reasons[i])
            .ok_or_else(|| Error::input(format!("unknown reason \"{}\"", reasons[i])))?;
        Ok(LoadStep {
            name: Some(names[i].clone()).filter(|name| !name.is_empty()),
            loads: loads[i],
            supports: supports[i],
            temperature: temperature[i],
            reason,
            alternations: alternations[i],
            updates: updates[i],
        })
    };
    (0..n).map(step).collect::<Result<Vec<_>>>().map(Some)
}
