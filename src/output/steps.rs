//! The load steps: `/VTKHDF/Steps`, by which ParaView plays them, and `/steps`, what acted in each.
//!
//! The grid is written once: every step starts at its first part, point and cell, and only the fields move on.
use super::Piece;
use super::hdf5_rows::{Grown, Place, Plan, Values};
use super::hdf5_text::read_strings;
use super::spread::{Growth, Spread};
use crate::error::{Error, Result};
use crate::record::{LoadStep, Reason};
use hdf5::{File, Group};
use std::collections::BTreeMap;

/// Adds a step to `Steps` in the group `/VTKHDF`. The first is counted at once, those after it by [`count`].
pub(super) fn add_time(
    spread: &Spread,
    growth: Growth,
    vtkhdf: &Place,
    piece: &Piece,
    plan: &mut Plan,
) -> Result<()> {
    let group = vtkhdf.group("Steps")?;
    if growth.steps == 0 {
        group.number("NSteps", 1i64)?;
    }
    let one = |value: i64| spread.rows_of_first(1, Values::I64(vec![value].into()));
    let time = Values::F64(vec![(growth.steps + 1) as f64].into());
    spread.add_by_step(plan, &group, "Values", None, spread.rows_of_first(1, time))?;
    spread.add_by_step(plan, &group, "NumberOfParts", None, one(spread.size as i64))?;
    spread.add_by_step(plan, &group, "PartOffsets", None, one(0))?;
    spread.add_by_step(plan, &group, "PointOffsets", None, one(0))?;
    // A column per topology, of which an unstructured grid has one.
    let grown = Grown { from: growth.steps, chunk: growth.expected };
    plan.grow(&group, "CellOffsets", None, one(0), grown, true)?;
    plan.grow(&group, "ConnectivityIdOffsets", None, one(0), grown, true)?;
    // `stride` rows from one step to the next.
    let mut add = |group: &Place, name: &str, stride: usize| {
        spread.add_by_step(plan, group, name, None, one((growth.steps * stride) as i64))
    };
    let (of_points, of_cells) = (group.group("PointDataOffsets")?, group.group("CellDataOffsets")?);
    piece.point_fields.iter().try_for_each(|f| add(&of_points, &f.name, spread.points.total))?;
    piece.cell_fields.iter().try_for_each(|f| add(&of_cells, &f.name, spread.cells.total))?;
    add(&of_cells, "body", 0)?;
    let of_fields = group.group("FieldDataOffsets")?;
    add(&of_fields, "alternations", 1)?;
    add(&of_fields, "converged", 1)
}

/// Counts the steps of a file that has their results: what readers go by, and the last that is written of a step.
pub(super) fn count(file: &Place, steps: usize) -> Result<()> {
    file.group("VTKHDF")?.group("Steps")?.number("NSteps", steps as i64)
}

/// Steps that are counted; `None` without a table of steps.
pub(super) fn counted(file: &File) -> Result<Option<usize>> {
    if !file.link_exists("steps") {
        return Ok(None);
    }
    let steps: i64 = file.group("VTKHDF/Steps")?.attr("NSteps")?.read_scalar()?;
    usize::try_from(steps).ok().filter(|n| *n > 0).map(Some).ok_or_else(|| Error::input("there are no steps"))
}

/// Adds a step to `/steps`.
pub(super) fn add_row(
    spread: &Spread,
    growth: Growth,
    file: &Place,
    step: &LoadStep,
    plan: &mut Plan,
) -> Result<()> {
    let group = file.group("steps")?;
    let mut column = |name: &str, values: Values<'static>| {
        spread.add_by_step(plan, &group, name, None, spread.rows_of_first(1, values))
    };
    let name = step.name.as_deref().unwrap_or("");
    column("name", Values::text_within(&[name], growth.name_width))?;
    column("reason", Values::text_within(&[step.reason.name()], Reason::widest()))?;
    column("loads", Values::F64(vec![step.loads].into()))?;
    column("supports", Values::F64(vec![step.supports].into()))?;
    column("temperature", Values::F64(vec![step.temperature].into()))?;
    if let Some(at) = step.at {
        column("at", Values::F64(vec![at].into()))?;
    }
    column("increments", Values::I64(vec![step.increments as i64].into()))?;
    column("converged", Values::U8(vec![u8::from(step.reason.converged())].into()))?;
    column("alternations", Values::I64(vec![step.alternations as i64].into()))?;
    column("updates", Values::I64(vec![step.updates as i64].into()))?;
    if step.paths.is_empty() {
        return Ok(());
    }
    let paths = group.group("paths")?;
    step.paths.iter().try_for_each(|(name, factor)| {
        let row = spread.rows_of_first(1, Values::F64(vec![*factor].into()));
        spread.add_by_step(plan, &paths, name, None, row)
    })
}

/// Reads the rows of `/steps` that are counted; `None` if the case had no table of them.
pub(super) fn read(file: &File) -> Result<Option<Vec<LoadStep>>> {
    let Some(n) = counted(file)? else { return Ok(None) };
    let group = file.group("steps")?;
    let reals = |name| Ok::<_, Error>(group.dataset(name)?.read_raw::<f64>()?);
    let counts = |name| Ok::<_, Error>(group.dataset(name)?.read_raw::<u64>()?);
    let (names, reasons) = (read_strings(&group.dataset("name")?)?, read_strings(&group.dataset("reason")?)?);
    let (loads, supports, temperature) = (reals("loads")?, reals("supports")?, reals("temperature")?);
    let (alternations, updates) = (counts("alternations")?, counts("updates")?);
    // Files of before there were increments have none.
    let increments = if group.link_exists("increments") { counts("increments")? } else { vec![1; n] };
    let at = if group.link_exists("at") { Some(reals("at")?) } else { None };
    let paths = read_paths(&group)?;
    let lengths = [names.len(), reasons.len(), loads.len(), supports.len(), temperature.len()];
    let counted = [alternations.len(), updates.len(), increments.len()];
    let of_paths = at.iter().map(Vec::len).chain(paths.values().map(Vec::len));
    if lengths.into_iter().chain(counted).chain(of_paths).any(|length| length < n) {
        return Err(Error::input("there are fewer rows of steps than steps"));
    }
    let step = |i: usize| {
        let reason = Reason::named(&reasons[i])
            .ok_or_else(|| Error::input(format!("unknown reason \"{}\"", reasons[i])))?;
        Ok(LoadStep {
            name: Some(names[i].clone()).filter(|name| !name.is_empty()),
            loads: loads[i],
            supports: supports[i],
            temperature: temperature[i],
            at: at.as_ref().map(|at| at[i]),
            paths: paths.iter().map(|(name, factors)| (name.clone(), factors[i])).collect(),
            increments: increments[i],
            reason,
            alternations: alternations[i],
            updates: updates[i],
        })
    };
    (0..n).map(step).collect::<Result<Vec<_>>>().map(Some)
}

/// The factors of each load path.
fn read_paths(steps: &Group) -> Result<BTreeMap<String, Vec<f64>>> {
    if !steps.link_exists("paths") {
        return Ok(BTreeMap::new());
    }
    let group = steps.group("paths")?;
    let read = |name: String| {
        let factors = group.dataset(&name)?.read_raw::<f64>()?;
        Ok((name, factors))
    };
    group.member_names()?.into_iter().map(read).collect()
}
