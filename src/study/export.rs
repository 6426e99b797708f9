//! `study.csv` and `study.h5`: the whole table, a row for each choice and level.
use super::plan::Plan;
use super::table::{Row, Table};
use crate::{Error, Result, output::file_options};
use hdf5::types::VarLenUnicode;
use std::{path::Path, str::FromStr};

/// A column of the table.
pub(super) struct Column {
    pub name: String,
    pub unit: &'static str,
    pub cells: Cells,
}

/// Its cells; a number that is not known is NaN, and empty in the CSV file.
pub(super) enum Cells {
    Text(Vec<String>),
    Number(Vec<f64>),
}

/// All columns.
pub(super) fn columns(plan: &Plan, table: &Table) -> Vec<Column> {
    let mut columns = Vec::new();
    let mut text = |name: &str, cell: &dyn Fn(&Row) -> String| {
        let cells = Cells::Text(table.rows.iter().map(cell).collect());
        columns.push(Column { name: name.into(), unit: "", cells });
    };
    let summary = |row: &Row, key: &str| row.summary[key].as_str().unwrap_or_default().to_string();
    let swept = |value: Option<&String>| value.map(|v| v.trim_matches('"').to_string()).unwrap_or_default();
    text("choice", &|row| table.labels[row.choice].clone());
    text("element", &|row| plan.elements[row.choice].names.clone());
    text("driver", &|row| summary(row, "driver"));
    text("weights", &|row| swept(plan.choices[row.choice].weights.as_ref()));
    text("transfer", &|row| summary(row, "transfer"));
    text("response", &|row| row.responses());
    text("solver", &|row| swept(plan.choices[row.choice].solver.as_ref()));
    text("ending", &|row| row.ending.clone());
    let mut number = |name: &str, unit: &'static str, cell: &dyn Fn(&Row) -> f64| {
        let cells = Cells::Number(table.rows.iter().map(cell).collect());
        columns.push(Column { name: name.into(), unit, cells });
    };
    number("converged", "", &|row| f64::from(u8::from(row.converged)));
    number("level", "", &|row| row.level as f64);
    number("ranks", "", &|row| row.ranks as f64);
    number("tolerance", "", &|row| row.number(&["tolerance"]));
    number("dofs", "", &|row| row.dofs().map_or(f64::NAN, |dofs| dofs as f64));
    for key in ["alternations", "updates"] {
        number(key, "", &|row| row.number(&[key]));
    }
    number("repetitions", "", &|row| row.repetitions as f64);
    number("time", "s", &|row| row.time());
    number("starved", "", &|row| f64::from(u8::from(row.starved())));
    number("seconds", "s", &|row| row.seconds.low);
    number("seconds_median", "s", &|row| row.seconds.median);
    number("seconds_max", "s", &|row| row.seconds.high);
    number("process_seconds", "s", &|row| row.process.low);
    number("process_seconds_median", "s", &|row| row.process.median);
    number("process_seconds_max", "s", &|row| row.process.high);
    number("cpu_seconds", "s", &|row| row.cpu.low);
    number("cpu_seconds_median", "s", &|row| row.cpu.median);
    number("cpu_seconds_max", "s", &|row| row.cpu.high);
    number("peak_memory_mb", "MB", &|row| row.memory);
    for key in ["energy", "contact_pressure"] {
        number(&format!("estimate.{key}"), "", &|row| row.number(&["error_estimate", key]));
    }
    for name in &table.names {
        let unit = table.references[name].unit;
        // The components of a vector are quantities themselves.
        if table.references[name].values.len() == 1 {
            number(name, unit, &|row| row.value(name).map_or(f64::NAN, |v| v[0]));
        }
        number(&format!("{name}.error"), "", &|row| row.errors.get(name).copied().unwrap_or(f64::NAN));
        number(&format!("{name}.order"), "", &|row| row.orders.get(name).copied().unwrap_or(f64::NAN));
    }
    columns
}

/// Writes the CSV file.
pub(super) fn write_csv(path: &Path, columns: &[Column]) -> Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let rows = columns.first().map_or(0, |column| column.cells.len());
    writer.write_record(columns.iter().map(|column| &column.name)).map_err(Error::internal)?;
    for i in 0..rows {
        writer.write_record(columns.iter().map(|column| column.cells.text(i))).map_err(Error::internal)?;
    }
    crate::output::write_complete(path, &writer.into_inner().map_err(Error::internal)?)
}

/// Writes the HDF5 file: a dataset for each column of `/study`, its unit an attribute.
pub(super) fn write_hdf5(path: &Path, columns: &[Column]) -> Result<()> {
    let part = path.with_extension("h5.part");
    let file = file_options().create(&part)?;
    let group = file.create_group("study")?;
    for column in columns {
        let name = column.name.replace('/', "_");
        let dataset = match &column.cells {
            Cells::Number(values) => group.new_dataset_builder().with_data(values).create(name.as_str())?,
            Cells::Text(texts) => {
                let texts: Vec<VarLenUnicode> =
                    texts.iter().map(|text| unicode(text)).collect::<Result<_>>()?;
                group.new_dataset_builder().with_data(&texts).create(name.as_str())?
            }
        };
        if !column.unit.is_empty() {
            dataset.new_attr::<VarLenUnicode>().create("unit")?.write_scalar(&unicode(column.unit)?)?;
        }
    }
    file.close()?;
    std::fs::rename(&part, path).map_err(|e| Error::internal(format!("cannot write {}: {e}", path.display())))
}

fn unicode(text: &str) -> Result<VarLenUnicode> {
    VarLenUnicode::from_str(text).map_err(Error::internal)
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Cells::Text(cells) => cells.len(),
            Cells::Number(cells) => cells.len(),
        }
    }

    fn text(&self, i: usize) -> String {
        match self {
            Cells::Text(cells) => cells[i].clone(),
            Cells::Number(cells) if cells[i].is_nan() => String::new(),
            // Counts without a point, all else so that it reads back to the last bit.
            Cells::Number(cells) if cells[i].fract() == 0.0 && cells[i].abs() < 1e15 => cells[i].to_string(),
            Cells::Number(cells) => format!("{:?}", cells[i]),
        }
    }
}
