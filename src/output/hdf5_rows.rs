//! The file's structure, which rank 0 makes with HDF5, and the rows of its datasets, which every rank then puts
//! into their place in the file.
//!
//! The datasets are contiguous, or in chunks that are not compressed, so that HDF5 can say where their rows are.
//! Collective writes through MPI-IO would do the same, but one rank's failure in the middle of them (a full disk) can leave
//! the others waiting for ever.
use super::hdf5_text::{string_attribute, wide_string_attribute};
use crate::error::{Error, Result};
use hdf5::plist::dataset_create::{AllocTime, FillTime, Layout};
use hdf5::types::TypeDescriptor;
use hdf5::{Dataset, Extents, Group, H5Type};
use hdf5_sys::h5d::H5Dget_chunk_info_by_coord;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use std::borrow::Cow;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// A group of the file, on rank 0; on the others nothing, and all that is done to it does nothing.
pub(super) struct Place(pub Option<Group>);

impl Place {
    /// A group in this one, created if it is not there.
    pub fn group(&self, name: &str) -> Result<Place> {
        let get = |group: &Group| match group.link_exists(name) {
            true => group.group(name),
            false => group.create_group(name),
        };
        Ok(Place(self.0.as_ref().map(get).transpose()?))
    }

    /// Creates an attribute of a text.
    pub fn text(&self, name: &str, value: &str) -> Result<()> {
        self.0.as_ref().map_or(Ok(()), |group| string_attribute(group, name, value))
    }

    /// The same with room for `width` bytes; one that is there is written over.
    pub fn wide_text(&self, name: &str, value: &str, width: usize) -> Result<()> {
        self.0.as_ref().map_or(Ok(()), |group| wide_string_attribute(group, name, value, width))
    }

    /// An attribute of a number, created if it is not there.
    pub fn number<T: H5Type>(&self, name: &str, value: T) -> Result<()> {
        let Some(group) = &self.0 else { return Ok(()) };
        let attribute = group.attr(name).or_else(|_| group.new_attr::<T>().create(name))?;
        Ok(attribute.write_scalar(&value)?)
    }

    /// Creates an attribute of several numbers.
    pub fn numbers<T: H5Type>(&self, name: &str, values: &[T]) -> Result<()> {
        let Some(group) = &self.0 else { return Ok(()) };
        Ok(group.new_attr::<T>().shape(values.len()).create(name)?.write_raw(values)?)
    }

    /// Takes the name from what has it, if anything has.
    pub fn unlink(&self, name: &str) -> Result<()> {
        match &self.0 {
            Some(group) if group.link_exists(name) => Ok(group.unlink(name)?),
            _ => Ok(()),
        }
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
        Self::text_within(texts, texts.iter().map(|t| t.as_ref().len()).max().unwrap_or(0))
    }

    /// Texts of at most `width` bytes; HDF5 has no strings of length 0.
    pub fn text_within(texts: &[impl AsRef<str>], width: usize) -> Self {
        let width = width.max(1);
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

/// How a dataset grows: by the rows of a write at a time, after those that it has.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grown {
    /// Rows it has.
    pub from: usize,
    /// Rows that are given a place in the file at a time: what is not written of them takes none on the disk. As long as a
    /// dataset stays within them, all that changes of the file's structure is its length.
    pub chunk: usize,
}

/// Datasets that wait for their rows. Every rank has the same ones in the same order.
#[derive(Default)]
pub(super) struct Plan<'a> {
    rows: Vec<Rows<'a>>,
    pieces: Vec<Piece>,
    /// Where each piece begins in the file; on ranks other than 0 known after [`Plan::locate`].
    offsets: Vec<u64>,
    /// Bytes of this write, nearly: those of the rows of all ranks, and what HDF5 needs beside them.
    pub length: u64,
    /// Bytes by which the file becomes longer, holes included.
    pub span: u64,
}

/// Rows of a write that are together in the file, counted over all ranks.
struct Piece {
    /// Index of the rows.
    of: usize,
    range: Range<usize>,
}

impl<'a> Plan<'a> {
    /// A dataset with a `unit` attribute, if it has a unit; one that is there keeps its place and is written over.
    pub fn add(&mut self, group: &Place, name: &str, unit: Option<&str>, rows: Rows<'a>) -> Result<()> {
        // HDF5 describes a dataset in half a kilobyte and keeps its names in larger blocks.
        let length = (rows.total * rows.columns * rows.values.datatype().size() + 2048) as u64;
        (self.length, self.span) = (self.length + length, self.span + length);
        let offset = match &group.0 {
            None => 0,
            Some(group) if group.link_exists(name) => place(&group.dataset(name)?)?,
            Some(group) if rows.columns > 1 => {
                create(group, name, unit, &rows.values, (rows.total, rows.columns), None)?
            }
            Some(group) => create(group, name, unit, &rows.values, rows.total, None)?,
        };
        self.pieces.push(Piece { of: self.rows.len(), range: 0..rows.total });
        self.offsets.push(offset);
        self.rows.push(rows);
        Ok(())
    }

    /// A dataset that has a row for each row of every write, `table`: of two dimensions even for one column.
    pub fn grow(
        &mut self,
        group: &Place,
        name: &str,
        unit: Option<&str>,
        rows: Rows<'a>,
        grown: Grown,
        table: bool,
    ) -> Result<()> {
        let Rows { total, columns, ref values, .. } = rows;
        let row = columns * values.datatype().size();
        // Chunks are no longer than HDF5 allows, and hold whole writes where these are all alike.
        let most = (LARGEST_CHUNK / row.max(1)) / total.max(1) * total.max(1);
        let chunk = grown.chunk.min(most).max(total).max(1);
        let end = grown.from + total;
        let new = end.div_ceil(chunk) - grown.from.div_ceil(chunk);
        self.length += (total * row + 2048) as u64;
        self.span += (new * chunk * row + 2048) as u64;
        let dataset = match &group.0 {
            None => None,
            Some(group) if group.link_exists(name) => {
                let dataset = group.dataset(name)?;
                match table || columns > 1 {
                    true => dataset.resize((end, columns))?,
                    false => dataset.resize(end)?,
                }
                Some(dataset)
            }
            Some(group) => {
                let chunk = Some(chunk);
                match table || columns > 1 {
                    true => create(group, name, unit, values, (end.., columns), chunk)?,
                    false => create(group, name, unit, values, end.., chunk)?,
                };
                Some(group.dataset(name)?)
            }
        };
        let mut first = grown.from;
        while first < end {
            let begin = first / chunk * chunk;
            let next = end.min(begin + chunk);
            let dimensions = if table || columns > 1 { 2 } else { 1 };
            let offset = dataset.as_ref().map_or(Ok(0), |dataset| chunk_place(dataset, begin, dimensions))?;
            self.offsets.push(offset + ((first - begin) * row) as u64);
            self.pieces.push(Piece { of: self.rows.len(), range: first - grown.from..next - grown.from });
            first = next;
        }
        self.rows.push(rows);
        Ok(())
    }

    /// Collective. Tells all ranks where the datasets are.
    pub fn locate(&mut self, comm: &SimpleCommunicator) {
        comm.process_at_rank(0).broadcast_into(&mut self.offsets[..]);
    }

    /// Puts this rank's rows into the file, whose structure is complete, and on the disk.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        let file = std::fs::OpenOptions::new().write(true).open(path)?;
        for (piece, offset) in std::iter::zip(&self.pieces, &self.offsets) {
            let Rows { start, columns, values, .. } = &self.rows[piece.of];
            let row = columns * values.datatype().size();
            let own = values.bytes().len() / row.max(1);
            let (first, end) = ((*start).max(piece.range.start), (start + own).min(piece.range.end));
            if first < end {
                let bytes = &values.bytes()[(first - start) * row..(end - start) * row];
                file.write_all_at(bytes, offset + ((first - piece.range.start) * row) as u64)?;
            }
        }
        // Some file systems report a full disk no sooner than this.
        file.sync_all()
    }
}

/// Bytes of a chunk: HDF5 allows four gigabytes, less one.
const LARGEST_CHUNK: usize = 1 << 31;

/// Creates a dataset, of unlimited length if it has chunks of `chunk` rows, and takes its space in the file; gives the place
/// of its first byte, of one without chunks.
fn create(
    group: &Group,
    name: &str,
    unit: Option<&str>,
    values: &Values,
    shape: impl Into<Extents>,
    chunk: Option<usize>,
) -> Result<u64> {
    let shape = shape.into();
    let builder = group.new_dataset_builder().empty_as(values.datatype()).shape(shape.clone());
    let builder = builder.fill_time(FillTime::Never).alloc_time(Some(AllocTime::Early));
    let dataset: Dataset = match (chunk, shape.dims().get(1)) {
        (None, _) => builder.layout(Layout::Contiguous).create(name)?,
        (Some(rows), None) => builder.chunk(rows).create(name)?,
        (Some(rows), Some(&columns)) => builder.chunk((rows, columns)).create(name)?,
    };
    if let Some(unit) = unit {
        string_attribute(&dataset, "unit", unit)?;
    }
    if chunk.is_some() { Ok(0) } else { place(&dataset) }
}

/// Where a dataset without chunks begins in the file.
fn place(dataset: &Dataset) -> Result<u64> {
    match dataset.offset() {
        Some(offset) => Ok(offset),
        // Nothing will be written there.
        None if dataset.size() == 0 => Ok(0),
        None => Err(nowhere(dataset)),
    }
}

/// Where the chunk that begins with a row is in the file.
fn chunk_place(dataset: &Dataset, row: usize, dimensions: usize) -> Result<u64> {
    let coordinates = [row as u64, 0];
    let (mut filters, mut place, mut size) = (0, u64::MAX, 0);
    // SAFETY: `coordinates` has at least as many numbers as the dataset has dimensions.
    let code = hdf5::sync::sync(|| unsafe {
        H5Dget_chunk_info_by_coord(
            dataset.id(),
            coordinates[..dimensions].as_ptr(),
            &mut filters,
            &mut place,
            &mut size,
        )
    });
    if code < 0 || place == u64::MAX { Err(nowhere(dataset)) } else { Ok(place) }
}

fn nowhere(dataset: &Dataset) -> Error {
    Error::internal(format!("HDF5: {} has no place in the file", dataset.name()))
}
