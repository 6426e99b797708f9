//! The groups beside the grid: `/contact/<pair>/a` and `/b`, `/history`, `/run`.
use super::hdf5_rows::{Plan, Rows, Values};
use super::hdf5_text::string_attribute;
use super::{HistoryRow, PairTables, RunInfo, SideTable};
use crate::case::Analysis;
use crate::error::{Error, Result};
use hdf5::File;
use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use std::borrow::Cow;

/// Collective. Creates `/contact`. Each side's table comes from the one rank that holds it.
pub(super) fn create_contact<'a>(
    comm: &SimpleCommunicator,
    file: &File,
    pairs: &'a [PairTables],
    run: &RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let contact = file.create_group("contact")?;
    for pair in pairs {
        let group = contact.create_group(&group_name(&pair.name))?;
        string_attribute(&group, "name", &pair.name)?;
        for ((side, surface), table) in ["a", "b"].iter().zip(&pair.surfaces).zip(&pair.sides) {
            let group = group.create_group(side)?;
            string_attribute(&group, "surface", surface)?;
            let total = side_length(comm, &pair.name, table.as_ref())?;
            let rows = |columns, values| Rows { start: 0, total, columns, values };
            let f64s =
                |column: fn(&SideTable) -> &[f64]| Values::F64(table.as_ref().map_or(&[][..], column).into());
            let status = Values::I32(table.as_ref().map_or(&[][..], |t| &t.status).into());
            plan.add(&group, "s", Some(run.unit("m")), rows(1, f64s(|t| &t.s)))?;
            plan.add(&group, "x", Some(run.unit("m")), rows(3, f64s(|t| t.x.as_flattened())))?;
            plan.add(&group, "normal", Some(run.unit("-")), rows(3, f64s(|t| t.normal.as_flattened())))?;
            plan.add(&group, "gap", Some(run.unit("m")), rows(1, f64s(|t| &t.gap)))?;
            plan.add(&group, "pressure", Some(run.unit("Pa")), rows(1, f64s(|t| &t.pressure)))?;
            plan.add(&group, "force", Some(run.unit("N")), rows(3, f64s(|t| t.force.as_flattened())))?;
            plan.add(&group, "status", Some(run.unit("-")), rows(1, status))?;
        }
    }
    Ok(())
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

/// Collective. Creates `/history` from the rows of rank 0.
pub(super) fn create_history<'a>(
    comm: &SimpleCommunicator,
    file: &File,
    history: &'a [HistoryRow],
    run: &RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let own = if comm.rank() == 0 { history } else { &[] };
    let mut total = own.len() as u64;
    comm.process_at_rank(0).broadcast_into(&mut total);
    let group = file.create_group("history")?;
    let rows = |values| Rows { start: 0, total: total as usize, columns: 1, values };
    let f64s = |column: fn(&HistoryRow) -> f64| Values::F64(own.iter().map(column).collect::<Cow<_>>());
    let i64s = |column: fn(&HistoryRow) -> u64| {
        Values::I64(own.iter().map(|row| column(row) as i64).collect::<Cow<_>>())
    };
    plan.add(&group, "alternation", Some("-"), rows(i64s(|row| row.alternation)))?;
    plan.add(&group, "displacement_jump", Some("-"), rows(f64s(|row| row.displacement_jump)))?;
    plan.add(&group, "force_imbalance", Some("-"), rows(f64s(|row| row.force_imbalance)))?;
    plan.add(&group, "active", Some("-"), rows(i64s(|row| row.active)))?;
    plan.add(&group, "contraction", Some("-"), rows(f64s(|row| row.contraction)))?;
    plan.add(&group, "seconds", Some("s"), rows(f64s(|row| row.seconds)))?;
    string_attribute(&group, "units", run.units_name())
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
