//! PETSc handles that free themselves.
use super::{error::check, sys};
use crate::error::{Error, Result};
use std::ptr;

macro_rules! handle {
    ($(#[$doc:meta])* $name:ident, $raw:ident, $destroy:ident) => {
        $(#[$doc])*
        pub struct $name(pub(super) sys::$raw);
        impl Drop for $name {
            fn drop(&mut self) {
                // SAFETY: the handle was created by PETSc and is destroyed once.
                unsafe { sys::$destroy(&mut self.0) };
            }
        }
    };
}

/// Calls `create(&mut handle)`.
pub(super) fn make<T>(create: impl FnOnce(*mut *mut T) -> sys::PetscErrorCode) -> Result<*mut T> {
    let mut handle = ptr::null_mut();
    check(create(&mut handle))?;
    Ok(handle)
}

pub(super) fn int(n: usize) -> Result<i32> {
    i32::try_from(n).map_err(|_| Error::internal(format!("{n} does not fit PETSc's 32-bit integers")))
}
