//! The groups beside the grid: `/contact/<pair>/a` and `/b`, `/run`.
use super::hdf5_rows::{Place, Plan, Rows, Values};
use super::spread::{Growth, Spread};
use super::{ResultFile, RunInfo};
use crate::case::Analysis;
use crate::contact::Law;
use crate::error::Result;
use crate::record::{Reason, SideTable, Tangential};

/// Creates `/contact`. Each side's table comes from the one rank that holds it.
///
/// The table of a side is that of the last step. With load steps, `steps/<k>` in it holds the columns that change
/// after step k. The groups of the steps that are expected are there from the first step on, so that their parent does
/// not change; [`trim_contact`] removes those of steps that were not made.
pub(super) fn create_contact<'a>(
    spread: &Spread,
    file: &Place,
    result: &ResultFile<'a>,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let contact = file.group("contact")?;
    let run = result.run;
    for (p, pair) in result.pairs.iter().enumerate() {
        let group = contact.group(&group_name(&pair.name))?;
        if spread.is_first() {
            group.text("name", &pair.name)?;
            add_law(&group, pair.law)?;
            if pair.varies {
                group.number("over_temperature", 1_u8)?;
            }
        }
        for (side, name) in ["a", "b"].into_iter().enumerate() {
            let table = pair.sides[side].as_ref();
            let group = group.group(name)?;
            if spread.is_first() {
                group.text("surface", &pair.surfaces[side])?;
            }
            let total = spread.sides[p][side];
            let rows = |columns, values: &'a [f64]| Rows {
                start: 0,
                total,
                columns,
                values: Values::F64(values.into()),
            };
            if spread.is_first() {
                let s = table.map_or(&[][..], |t| &t.s);
                let x = table.map_or(&[][..], |t| t.x.as_flattened());
                plan.add(&group, "s", Some(run.unit("m")), rows(1, s))?;
                plan.add(&group, "x", Some(run.unit("m")), rows(3, x))?;
                let [multipliers, closed] = spread.side_facts[p][side];
                group.number("multipliers", u8::from(multipliers > 0.0))?;
                if closed > 0.0 {
                    group.number("closed", closed)?;
                }
            }
            add_state(&group, (table, pair.law.is_frictional()), total, run, plan)?;
            let Some(growth) = spread.growth else { continue };
            let steps = group.group("steps")?;
            let rest = if growth.steps == 0 { growth.expected } else { 0 };
            for k in growth.steps + 1..=rest.max(growth.steps + 1) {
                let table = table.filter(|_| k == growth.steps + 1);
                add_state(
                    &steps.group(&k.to_string())?,
                    (table, pair.law.is_frictional()),
                    total,
                    run,
                    plan,
                )?;
            }
        }
    }
    Ok(())
}

/// The tangential law as attributes, if there is one.
fn add_law(group: &Place, law: Law) -> Result<()> {
    if law.is_frictional() {
        group.text("law", law.name())?;
    }
    match law {
        Law::Coulomb { friction } => group.number("friction", friction),
        Law::Tresca { shear } => group.number("shear", shear),
        Law::Frictionless | Law::Rough | Law::Tied => Ok(()),
    }
}

/// Removes the groups of steps that were not made.
pub(super) fn trim_contact(file: &Place, pairs: &[String], growth: Growth) -> Result<()> {
    let contact = file.group("contact")?;
    for pair in pairs {
        let group = contact.group(&group_name(pair))?;
        for side in ["a", "b"] {
            let steps = group.group(side)?.group("steps")?;
            (growth.steps + 1..=growth.expected).try_for_each(|k| steps.unlink(&k.to_string()))?;
        }
    }
    Ok(())
}

/// The columns of a side that change from step to step.
fn add_state<'a>(
    group: &Place,
    (table, tangential): (Option<&'a SideTable>, bool),
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
    if tangential {
        let of = |column: fn(&Tangential) -> &[f64]| {
            let column = table.and_then(|t| t.tangential.as_ref()).map_or(&[][..], column);
            Values::F64(column.into())
        };
        plan.add(group, "traction", Some(run.unit("Pa")), rows(1, of(|t| &t.traction)))?;
        plan.add(group, "slip", Some(run.unit("m")), rows(1, of(|t| &t.slip)))?;
    }
    plan.add(group, "status", Some(run.unit("-")), rows(1, status))
}

/// A pair's name as one HDF5 link: `/` would start a group.
pub(super) fn group_name(pair: &str) -> String {
    pair.replace('/', "_")
}

/// Creates `/run`: what was run, as attributes. An attribute holds at most 64 kB: `case_text` is
/// a dataset.
pub(super) fn create_run<'a>(
    spread: &Spread,
    file: &Place,
    run: &'a RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    let group = file.group("run")?;
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
        ("analysis", analysis),
    ];
    for (name, text) in texts {
        group.text(name, text)?;
    }
    group.number("ranks", spread.size as i32)?;
    group.number("thickness", thickness)?;
    set_verdict(file, run, spread.growth.is_none())?;
    let texts = |texts: &[String]| spread.rows_of_first(texts.len(), Values::text(texts));
    plan.add(&group, "bodies", None, texts(&run.bodies))?;
    plan.add(&group, "case_text", None, texts(std::slice::from_ref(&run.text)))
}

/// The attributes of `/run` that a run changes as it goes on; `complete` when it has come to its end.
pub(super) fn set_verdict(file: &Place, run: &RunInfo, complete: bool) -> Result<()> {
    let group = file.group("run")?;
    group.wide_text("reason", run.reason.name(), Reason::widest())?;
    group.number("complete", u8::from(complete))?;
    group.number("converged", u8::from(complete && run.converged()))?;
    group.number("alternations", run.alternations)?;
    group.number("tolerance", run.tolerance)
}

/// Creates `/rigid/<body>`, if there are rigid bodies: outlines, for pictures.
pub(super) fn create_rigid<'a>(
    spread: &Spread,
    file: &Place,
    run: &'a RunInfo,
    plan: &mut Plan<'a>,
) -> Result<()> {
    if run.rigid.is_empty() {
        return Ok(());
    }
    let all = file.group("rigid")?;
    for outline in &run.rigid {
        let group = all.group(&group_name(&outline.body))?;
        if spread.is_first() {
            group.text("name", &outline.body)?;
        }
        let mut add = |name: &str, vectors: &'a [[f64; 3]]| {
            let own = spread.on_first(vectors).as_flattened();
            let rows = Rows { start: 0, total: vectors.len(), columns: 3, values: Values::F64(own.into()) };
            plan.add(&group, name, Some(run.unit("m")), rows)
        };
        add("x", &outline.points)?;
        add("motion", std::slice::from_ref(&outline.motion))?;
    }
    Ok(())
}
