//! Datasets whose rows are spread over the ranks, filled by collective writes.
//!
//! HDF5 wants all ranks to create the same things in the same order: what is marked collective here, all
//! ranks call.
use super::agree::agree;
use super::hdf5_text::{Handle, check, string_attribute};
use crate::error::Result;
use hdf5::types::TypeDescriptor;
use hdf5::{Dataset, Datatype, Extents, Group};
use hdf5_sys::{h5d::*, h5p::*, h5s::*};
use mpi::topology::SimpleCommunicator;
use std::borrow::Cow;
use std::ffi::c_void;
use std::ptr;

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
    /// Texts of any length; rows on rank 0 only, the same width everywhere.
    pub fn text(texts: &[impl AsRef<str>], held_here: bool) -> Self {
        let width = texts.iter().map(|t| t.as_ref().len()).max().unwrap_or(0).max(1);
        let mut bytes = Vec::new();
        for (i, text) in texts.iter().enumerate().filter(|_| held_here) {
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

    /// Number of values, a string being one.
    fn len(&self) -> usize {
        match self {
            Values::F64(v) => v.len(),
            Values::I64(v) => v.len(),
            Values::I32(v) => v.len(),
            Values::U8(v) => v.len(),
            Values::Text { bytes, width } => bytes.len() / width,
        }
    }

    fn as_ptr(&self) -> *const c_void {
        match self {
            Values::F64(v) => v.as_ptr().cast(),
            Values::I64(v) => v.as_ptr().cast(),
            Values::I32(v) => v.as_ptr().cast(),
            Values::U8(v) => v.as_ptr().cast(),
            Values::Text { bytes, .. } => bytes.as_ptr().cast(),
        }
    }

    fn datatype(&self) -> hdf5::Result<Datatype> {
        match self {
            Values::F64(_) => Datatype::from_type::<f64>(),
            Values::I64(_) => Datatype::from_type::<i64>(),
            Values::I32(_) => Datatype::from_type::<i32>(),
            Values::U8(_) => Datatype::from_type::<u8>(),
            Values::Text { width, .. } => Datatype::from_descriptor(&TypeDescriptor::FixedUnicode(*width)),
        }
    }
}

/// Datasets that exist already and wait for their rows.
///
/// All are created before the first is filled, so that the file's length is known, and its space reserved,
/// before much is written.
#[derive(Default)]
pub(super) struct Plan<'a>(Vec<(Dataset, Rows<'a>)>);

impl<'a> Plan<'a> {
    /// Collective. Creates a dataset with a `unit` attribute, if it has a unit.
    pub fn add(&mut self, group: &Group, name: &str, unit: Option<&str>, rows: Rows<'a>) -> Result<()> {
        self.add_blocks(group, name, unit, vec![rows])
    }

    /// Collective. Creates a dataset that is filled in several writes, one after the other: at least one, all of
    /// the same type and the same total.
    pub fn add_blocks(
        &mut self,
        group: &Group,
        name: &str,
        unit: Option<&str>,
        blocks: Vec<Rows<'a>>,
    ) -> Result<()> {
        let Some(first) = blocks.first() else { return Ok(()) };
        let dataset = match first.columns {
            1 => create(group, name, &first.values, first.total),
            columns => create(group, name, &first.values, (first.total, columns)),
        }?;
        if let Some(unit) = unit {
            string_attribute(&dataset, "unit", unit)?;
        }
        self.0.extend(blocks.into_iter().map(|rows| (dataset.clone(), rows)));
        Ok(())
    }

    /// Collective. Creates a dataset of two dimensions, even for one column.
    pub fn add_table(&mut self, group: &Group, name: &str, rows: Rows<'a>) -> Result<()> {
        let dataset = create(group, name, &rows.values, (rows.total, rows.columns))?;
        self.0.push((dataset, rows));
        Ok(())
    }

    /// Collective. Fills the datasets one after the other, all ranks together; stops, on all ranks, at the
    /// first that fails on any.
    pub fn write(self, comm: &SimpleCommunicator) -> Result<()> {
        for (dataset, rows) in self.0 {
            if rows.total > 0 {
                agree(comm, write_rows(&dataset, &rows))?;
            }
        }
        Ok(())
    }
}

/// Collective.
fn create(group: &Group, name: &str, values: &Values, shape: impl Into<Extents>) -> Result<Dataset> {
    let kind = values.datatype()?.to_descriptor()?;
    Ok(group.new_dataset_builder().empty_as(&kind).shape(shape).create(name)?)
}

/// Collective write of this rank's rows, of which there may be none.
fn write_rows(dataset: &Dataset, rows: &Rows) -> Result<()> {
    let n = rows.values.len() / rows.columns;
    let start = [rows.start as u64, 0];
    let count = [n as u64, rows.columns as u64];
    let rank = dataset.ndim().min(2);
    let space = dataset.space()?;
    let len = rows.values.len() as u64;
    let datatype = rows.values.datatype()?;
    // SAFETY: `start` and `count` have at least `rank` entries; the memory space has `len` values, all
    // selected (or none).
    hdf5::sync::sync(|| unsafe {
        let memory = Handle::new(H5Screate_simple(1, &len, ptr::null()), H5Sclose, "H5Screate_simple")?;
        if n == 0 {
            check(H5Sselect_none(memory.0), "H5Sselect_none")?;
            check(H5Sselect_none(space.id()), "H5Sselect_none")?;
        } else {
            let (start, count) = (start[..rank].as_ptr(), count[..rank].as_ptr());
            let selected =
                H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start, ptr::null(), count, ptr::null());
            check(selected, "H5Sselect_hyperslab")?;
        }
        let transfer = Handle::new(H5Pcreate(*H5P_CLS_DATASET_XFER), H5Pclose, "H5Pcreate")?;
        check(H5Pset_dxpl_mpio(transfer.0, H5FD_mpio_xfer_t::H5FD_MPIO_COLLECTIVE), "H5Pset_dxpl_mpio")?;
        let values = rows.values.as_ptr();
        let written = H5Dwrite(dataset.id(), datatype.id(), memory.0, space.id(), transfer.0, values);
        check(written, &format!("writing {} (is the disk full?)", dataset.name()))
    })
}
