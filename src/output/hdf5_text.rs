//! String attributes and datasets of fixed length, for which `hdf5` wants the length at compile time.
use crate::error::{Error, Result};
use hdf5_sys::{h5::herr_t, h5a::*, h5d::*, h5i::hid_t, h5p::H5P_DEFAULT, h5s::*, h5t::*};
use std::ffi::CString;

/// A string attribute of fixed length (VTK's readers do not take others).
pub(super) fn string_attribute(object: &hdf5::Location, name: &str, value: &str) -> Result<()> {
    wide_string_attribute(object, name, value, value.len())
}

/// The same with room for `width` bytes. An attribute that is there is written over in place, if it has as much.
pub(super) fn wide_string_attribute(
    object: &hdf5::Location,
    name: &str,
    value: &str,
    width: usize,
) -> Result<()> {
    let name = c_string(name)?;
    // HDF5 has no strings of length 0: pad with NUL.
    let mut bytes = value.as_bytes().to_vec();
    bytes.resize(width.max(bytes.len()).max(1), 0);
    let charset = if value.is_ascii() { H5T_cset_t::H5T_CSET_ASCII } else { H5T_cset_t::H5T_CSET_UTF8 };
    // SAFETY: `bytes` is as long as the string type says.
    hdf5::sync::sync(|| unsafe {
        let kind = Handle::new(H5Tcopy(*H5T_C_S1), H5Tclose, "H5Tcopy")?;
        check(H5Tset_size(kind.0, bytes.len()), "H5Tset_size")?;
        check(H5Tset_strpad(kind.0, H5T_str_t::H5T_STR_NULLPAD), "H5Tset_strpad")?;
        check(H5Tset_cset(kind.0, charset), "H5Tset_cset")?;
        let space = Handle::new(H5Screate(H5S_class_t::H5S_SCALAR), H5Sclose, "H5Screate")?;
        if H5Aexists(object.id(), name.as_ptr()) > 0 {
            let attribute = H5Aopen(object.id(), name.as_ptr(), H5P_DEFAULT);
            let attribute = Handle::new(attribute, H5Aclose, "H5Aopen")?;
            return check(H5Awrite(attribute.0, kind.0, bytes.as_ptr().cast()), "H5Awrite");
        }
        let attribute = H5Acreate2(object.id(), name.as_ptr(), kind.0, space.0, H5P_DEFAULT, H5P_DEFAULT);
        let attribute = Handle::new(attribute, H5Aclose, "H5Acreate2")?;
        check(H5Awrite(attribute.0, kind.0, bytes.as_ptr().cast()), "H5Awrite")
    })
}

/// Reads what [`string_attribute`] wrote.
pub(super) fn read_string_attribute(object: &hdf5::Location, name: &str) -> Result<String> {
    let c_name = c_string(name)?;
    // SAFETY: the buffer is as long as the type and the (scalar) space of the attribute say.
    let bytes = hdf5::sync::sync(|| unsafe {
        let attribute = H5Aopen(object.id(), c_name.as_ptr(), H5P_DEFAULT);
        let attribute = Handle::new(attribute, H5Aclose, &format!("no attribute \"{name}\": H5Aopen"))?;
        let kind = Handle::new(H5Aget_type(attribute.0), H5Tclose, "H5Aget_type")?;
        let space = Handle::new(H5Aget_space(attribute.0), H5Sclose, "H5Aget_space")?;
        let mut bytes = vec![0u8; fixed_size(&kind, name)? * points(&space)];
        check(H5Aread(attribute.0, kind.0, bytes.as_mut_ptr().cast()), "H5Aread")?;
        Ok::<_, Error>(bytes)
    })?;
    Ok(unpadded(&bytes))
}

/// Reads a dataset of strings of fixed length.
pub(super) fn read_strings(dataset: &hdf5::Dataset) -> Result<Vec<String>> {
    // SAFETY: the buffer is as long as the type and the space of the dataset say.
    let (bytes, width) = hdf5::sync::sync(|| unsafe {
        let kind = Handle::new(H5Dget_type(dataset.id()), H5Tclose, "H5Dget_type")?;
        let width = fixed_size(&kind, &dataset.name())?;
        let mut bytes = vec![0u8; width * dataset.size()];
        let all = H5S_ALL;
        check(H5Dread(dataset.id(), kind.0, all, all, H5P_DEFAULT, bytes.as_mut_ptr().cast()), "H5Dread")?;
        Ok::<_, Error>((bytes, width))
    })?;
    Ok(bytes.chunks(width).map(unpadded).collect())
}

/// Bytes of a string type; an error if the type is another, or its strings have no fixed length.
unsafe fn fixed_size(kind: &Handle, name: &str) -> Result<usize> {
    // SAFETY: `kind` is an open type.
    let (class, variable) = unsafe { (H5Tget_class(kind.0), H5Tis_variable_str(kind.0)) };
    if class != H5T_class_t::H5T_STRING || variable != 0 {
        return Err(Error::input(format!("{name} is not a string of fixed length")));
    }
    // SAFETY: as above; a string type has at least one byte.
    Ok(unsafe { H5Tget_size(kind.0) }.max(1))
}

unsafe fn points(space: &Handle) -> usize {
    // SAFETY: `space` is an open dataspace.
    unsafe { H5Sget_simple_extent_npoints(space.0) }.max(0) as usize
}

fn unpadded(bytes: &[u8]) -> String {
    let end = bytes.iter().rposition(|&b| b != 0).map_or(0, |i| i + 1);
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

fn c_string(name: &str) -> Result<CString> {
    CString::new(name).map_err(|_| Error::internal(format!("{name:?} has a NUL character")))
}

/// A raw HDF5 handle, closed on drop.
struct Handle(hid_t, unsafe extern "C" fn(hid_t) -> herr_t);

impl Handle {
    /// Takes over what `call` returned; negative means that it failed.
    ///
    /// # Safety
    /// `close` must be the function that closes this kind of handle.
    unsafe fn new(id: hid_t, close: unsafe extern "C" fn(hid_t) -> herr_t, call: &str) -> Result<Self> {
        if id < 0 { Err(Error::internal(format!("HDF5: {call} failed"))) } else { Ok(Handle(id, close)) }
    }
}

impl Drop for Handle {
    fn drop(&mut self) {
        // SAFETY: promised to `new`.
        unsafe { (self.1)(self.0) };
    }
}

/// Turns HDF5's return code into a `Result`.
fn check(code: herr_t, call: &str) -> Result<()> {
    if code < 0 { Err(Error::internal(format!("HDF5: {call} failed"))) } else { Ok(()) }
}
