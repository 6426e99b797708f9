//! The file's structure, which rank 0 makes with HDF5, and the rows of its datasets, which every rank then puts
//! into their place in the file.
//!
//! The datasets are contiguous, so that HDF5 can say where they begin. Collective writes through MPI-IO would do
//! the same, but one rank's failure in the middle of them (a full disk) can leave the others waiting for ever.
use super::hdf5_text::string_attribute;
use crate::error::{Error, Result};
use hdf5::plist::dataset_create::{AllocTime, FillTime, Layout};
use hdf5::types::TypeDescriptor;
use hdf5::{Dataset, Extents, Group, H5Type};
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use std::borrow::Cow;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// A group of the file, on rank 0; on the others nothing, and all that is done to it does nothing.
pub(super) struct Place(pub Option<Group>);

impl Place {
    /// Creates a group in this one.
    pub fn group(&self, name: &str) -> Result<Place> {
        Ok(Place(self.0.as_ref().map(|group| group.create_group(name)).transpose()?))
    }

    /// Creates an attribute of a text.
    pub fn text(&self, name: &str, value: &str) -> Result<()> {
        self.0.as_ref().map_or(Ok(()), |group| string_attribute(group, name, value))
    }

    /// Creates an attribute of a number.
    pub fn number<T: H5Type>(&self, name: &str, value: T) -> Result<()> {
        let Some(group) = &self.0 else { return Ok(()) };
        Ok(group.new_attr::<T>().create(name)?.write_scalar(&value)?)
    }

    /// Creates an attribute of several numbers.
    pub fn numbers<T: H5Type>(&self, name: &str, values: &[T]) -> Result<()> {
        let Some(group) = &self.0 else { return Ok(()) };
        Ok(group.new_attr::<T>().shape(values.len()).create(name)?.write_raw(values)?)
    }

    /// A second name for what has one.
    pub fn link(&self, target: &str, name: &str) -> Result<()> {
        self.0.as_ref().map_or(Ok(()), |group| Ok(group.link_hard(target, name)?))
    }
}

/// This rank's rows of a dataset.
pub(super) struct Rows<'a> {
    /// Rows of the ranks before this one.
    pub start: usize,
    /// Rows of all ranks.
    pub total: usize,
    /// Values per row; 1 gives a one-dimensional dataset.
    pub columns: usize,
    /// The rows, one after the other.
    pub values: Values<'a>,
}

/// Values of one of the types a result file has.
pub(super) enum Values<'a> {
    F64(Cow<'a, [f64]>),
    I64(Cow<'a, [i64]>),
    I32(Cow<'a, [i32]>),
    U8(Cow<'a, [u8]>),
    /// Strings of `width` bytes, one after the other; a row is a string.
    Text {
        bytes: Vec<u8>,
        width: usize,
    },
}

impl Values<'_> {
    /// Texts of any length.
    pub fn text(texts: &[impl AsRef<str>]) -> Self {
        let width = texts.iter().map(|t| t.as_ref().len()).max().unwrap_or(0).max(1);
        let mut bytes = Vec::new();
        for (i, text) in texts.iter().enumerate() {
            bytes.extend_from_slice(text.as_ref().as_bytes());
            bytes.resize((i + 1) * width, 0);
        }
        Values::Text { bytes, width }
    }

    /// No values of the same type.
    pub fn none(self) -> Self {
        match self {
            Values::F64(_) => Values::F64(Cow::default()),
            Values::I64(_) => Values::I64(Cow::default()),
            Values::I32(_) => Values::I32(Cow::default()),
            Values::U8(_) => Values::U8(Cow::default()),
            Values::Text { width, .. } => Values::Text { bytes: Vec::new(), width },
        }
    }

    /// The values as they are in memory, and in the file.
    fn bytes(&self) -> &[u8] {
        match self {
            Values::F64(v) => bytemuck::cast_slice(v),
            Values::I64(v) => bytemuck::cast_slice(v),
            Values::I32(v) => bytemuck::cast_slice(v),
            Values::U8(v) => v,
            Values::Text { bytes, .. } => bytes,
        }
    }

    /// HDF5's type of a value, and its length in bytes.
    fn datatype(&self) -> TypeDescriptor {
        match self {
            Values::F64(_) => f64::type_descriptor(),
            Values::I64(_) => i64::type_descriptor(),
            Values::I32(_) => i32::type_descriptor(),
            Values::U8(_) => u8::type_descriptor(),
            Values::Text { width, .. } => TypeDescriptor::FixedUnicode(*width),
        }
    }
}

/// Datasets that wait for their rows. Every rank has the same ones in the same order.
#[derive(Default)]
pub(super) struct Plan<'a> {
    rows: Vec<Rows<'a>>,
    /// Where the dataset of each begins in the file; on ranks other than 0 known after [`Plan::locate`].
    offsets: Vec<u64>,
    /// Bytes of the file, nearly: those of the rows of all ranks, and what HDF5 needs beside them.
    pub length: u64,
}

impl<'a> Plan<'a> {
    /// Creates a dataset with a `unit` attribute, if it has a unit.
    pub fn add(&mut self, group: &Place, name: &str, unit: Option<&str>, rows: Rows<'a>) -> Result<()> {
        self.add_blocks(group, name, unit, vec![rows])
    }

    /// Creates a dataset that is filled in several writes, one after the other: at least one, all of the same type
    /// and the same total.
    pub fn add_blocks(
        &mut self,
        group: &Place,
        name: &str,
        unit: Option<&str>,
        blocks: Vec<Rows<'a>>,
    ) -> Result<()> {
        let Some(first) = blocks.first() else { return Ok(()) };
        let offset = self.create(group, name, unit, first, first.columns > 1)?;
        self.offsets.extend(blocks.iter().map(|_| offset));
        self.rows.extend(blocks);
        Ok(())
    }

    /// Creates a dataset of two dimensions, even for one column.
    pub fn add_table(&mut self, group: &Place, name: &str, rows: Rows<'a>) -> Result<()> {
        let offset = self.create(group, name, None, &rows, true)?;
        self.offsets.push(offset);
        self.rows.push(rows);
        Ok(())
    }

    fn create(
        &mut self,
        group: &Place,
        name: &str,
        unit: Option<&str>,
        rows: &Rows,
        table: bool,
    ) -> Result<u64> {
        let Rows { total, columns, ref values, .. } = *rows;
        // HDF5 describes a dataset in half a kilobyte and keeps its names in larger blocks.
        self.length += (total * columns * values.datatype().size() + 2048) as u64;
        match &group.0 {
            None => Ok(0),
            Some(group) if table => create(group, name, unit, values, (total, columns)),
            Some(group) => create(group, name, unit, values, total),
        }
    }

    /// Collective. Tells all ranks where the datasets are.
    pub fn locate(&mut self, comm: &SimpleCommunicator) {
        comm.process_at_rank(0).broadcast_into(&mut self.offsets[..]);
    }

    /// Puts this rank's rows into the file, whose structure is complete, and on the disk.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        let file = std::fs::OpenOptions::new().write(true).open(path)?;
        for (rows, offset) in std::iter::zip(&self.rows, &self.offsets) {
            let before = rows.start * rows.columns * rows.values.datatype().size();
            file.write_all_at(rows.values.bytes(), offset + before as u64)?;
        }
        // Some file systems report a full disk no sooner than this.
        file.sync_all()
    }
}

/// Creates a dataset and takes its space in the file; gives the place of its first byte.
fn create(
    group: &Group,
    name: &str,
    unit: Option<&str>,
    values: &Values,
    shape: impl Into<Extents>,
) -> Result<u64> {
    let builder = group.new_dataset_builder().empty_as(values.datatype()).shape(shape);
    let builder = builder.layout(Layout::Contiguous).fill_time(FillTime::Never);
    let dataset: Dataset = builder.alloc_time(Some(AllocTime::Early)).create(name)?;
    if let Some(unit) = unit {
        string_attribute(&dataset, "unit", unit)?;
    }
    match dataset.offset() {
        Some(offset) => Ok(offset),
        // Nothing will be written there.
        None if dataset.size() == 0 => Ok(0),
        None => Err(Error::internal(format!("HDF5: {} has no place in the file", dataset.name()))),
    }
}
