//! The groups beside the grid: `/contact/<pair>/a` and `/b`, `/run`.
use super::hdf5_rows::{Plan, Rows, Values};
use super::hdf5_text::string_attribute;
use super::{ResultFile, RunInfo, SideTable};
use crate::case::Analysis;
use crate::error::{Error, Result};
use hdf5::{File, Group};
use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;

/// Collective. Creates `/contact`. Each side's table comes from the one rank that holds it.
///
/// The table of a side is that of the last step. With load steps, `steps/<k>` in it holds the columns that change
/// after step k; those of the last step are the same datasets under another name.
pub(super) fn create_contact<'a>(
    comm: &SimpleCommunicator,
    file: &File,
    result: &ResultFile<'a>,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let contact = file.create_group("contact")?;
    let run = result.run;
    for (p, pair) in result.pairs.iter().enumerate() {
        let group = contact.create_group(&group_name(&pair.name))?;
        string_attribute(&group, "name", &pair.name)?;
        for (side, name) in ["a", "b"].into_iter().enumerate() {
            let table = pair.sides[side].as_ref();
            let group = group.create_group(name)?;
            string_attribute(&group, "surface", &pair.surfaces[side])?;
            let total = side_length(comm, &pair.name, table)?;
            let rows = |columns, values: &'a [f64]| Rows {
                start: 0,
                total,
                columns,
                values: Values::F64(values.into()),
            };
            let s = table.map_or(&[][..], |t| &t.s);
            let x = table.map_or(&[][..], |t| t.x.as_flattened());
            plan.add(&group, "s", Some(run.unit("m")), rows(1, s))?;
            plan.add(&group, "x", Some(run.unit("m")), rows(3, x))?;
            add_state(&group, table, total, run, plan)?;
            let Some(steps) = &run.steps else { continue };
            let by_step = group.create_group("steps")?;
            for (k, pairs) in result.pairs_of_steps().enumerate() {
                let step = by_step.create_group(&(k + 1).to_string())?;
                if k + 1 < steps.len() {
                    add_state(&step, pairs[p].sides[side].as_ref(), total, run, plan)?;
                } else {
                    let link = |name| group.link_hard(name, &format!("steps/{}/{name}", k + 1));
                    STATE.into_iter().try_for_each(link)?;
                }
            }
        }
    }
    Ok(())
}

/// Columns of a side that change from step to step.
const STATE: [&str; 5] = ["normal", "gap", "pressure", "force", "status"];

/// Collective. The columns of a side that change from step to step.
fn add_state<'a>(
    group: &Group,
    table: Option<&'a SideTable>,
    total: usize,
    run: &RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let rows = |columns, values| Rows { start: 0, total, columns, values };
    let f64s = |column: fn(&SideTable) -> &[f64]| Values::F64(table.map_or(&[][..], column).into());
    let status = Values::I32(table.map_or(&[][..], |t| &t.status).into());
    plan.add(group, "normal", Some(run.unit("-")), rows(3, f64s(|t| t.normal.as_flattened())))?;
    plan.add(group, "gap", Some(run.unit("m")), rows(1, f64s(|t| &t.gap)))?;
    plan.add(group, "pressure", Some(run.unit("Pa")), rows(1, f64s(|t| &t.pressure)))?;
    plan.add(group, "force", Some(run.unit("N")), rows(3, f64s(|t| t.force.as_flattened())))?;
    plan.add(group, "status", Some(run.unit("-")), rows(1, status))
}

/// A pair's name as one HDF5 link: `/` would start a group.
pub(super) fn group_name(pair: &str) -> String {
    pair.replace('/', "_")
}

/// Collective. Length of the table, of which at most one rank has a copy.
fn side_length(comm: &SimpleCommunicator, pair: &str, table: Option<&SideTable>) -> Result<usize> {
    let mine = [u64::from(table.is_some()), table.map_or(0, |t| t.s.len() as u64)];
    let mut sum = [0u64; 2];
    comm.all_reduce_into(&mine[..], &mut sum[..], SystemOperation::sum());
    match sum[0] {
        0 | 1 => Ok(sum[1] as usize),
        n => Err(Error::internal(format!("{n} ranks hold the same side of contact pair \"{pair}\""))),
    }
}

/// Collective. Creates `/run`: what was run, as attributes. An attribute holds at most 64 kB: `case_text` is
/// a dataset.
pub(super) fn create_run<'a>(
    comm: &SimpleCommunicator,
    file: &File,
    run: &'a RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let group = file.create_group("run")?;
    let (analysis, thickness) = match run.analysis {
        Analysis::PlaneStress { thickness } => ("plane_stress", thickness),
        Analysis::PlaneStrain { thickness } => ("plane_strain", thickness),
    };
    let texts = [
        ("kontakt", env!("CARGO_PKG_VERSION")),
        ("case", &run.case),
        ("title", &run.title),
        ("variant", run.variant.as_deref().unwrap_or("")),
        ("units", run.units_name()),
        ("reason", run.reason.name()),
        ("analysis", analysis),
    ];
    for (name, text) in texts {
        string_attribute(&group, name, text)?;
    }
    group.new_attr::<u8>().create("converged")?.write_scalar(&u8::from(run.converged()))?;
    group.new_attr::<u64>().create("alternations")?.write_scalar(&run.alternations)?;
    group.new_attr::<i32>().create("ranks")?.write_scalar(&comm.size())?;
    group.new_attr::<f64>().create("tolerance")?.write_scalar(&run.tolerance)?;
    group.new_attr::<f64>().create("thickness")?.write_scalar(&thickness)?;
    let texts = |texts: &[String]| {
        let values = Values::text(texts, comm.rank() == 0);
        Rows { start: 0, total: texts.len(), columns: 1, values }
    };
    plan.add(&group, "bodies", None, texts(&run.bodies))?;
    plan.add(&group, "case_text", None, texts(std::slice::from_ref(&run.text)))
}

/// Collective. Creates `/rigid/<body>`, if there are rigid bodies: outlines, for pictures.
pub(super) fn create_rigid<'a>(
    comm: &SimpleCommunicator,
    file: &File,
    run: &'a RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    if run.rigid.is_empty() {
        return Ok(());
    }
    let all = file.create_group("rigid")?;
    for outline in &run.rigid {
        let group = all.create_group(&group_name(&outline.body))?;
        string_attribute(&group, "name", &outline.body)?;
        let mut add = |name: &str, vectors: &'a [[f64; 3]]| {
            let own = if comm.rank() == 0 { vectors.as_flattened() } else { &[] };
            let rows = Rows { start: 0, total: vectors.len(), columns: 3, values: Values::F64(own.into()) };
            plan.add(&group, name, Some(run.unit("m")), rows)
        };
        add("x", &outline.points)?;
        add("motion", std::slice::from_ref(&outline.motion))?;
    }
    Ok(())
}
