//! PETSc's error codes as [`Error`](crate::Error), with the library's message and call chain.
use super::sys;
use crate::error::{Error, Result};
use std::{
    cell::RefCell,
    ffi::{CStr, c_char, c_int, c_void},
    ptr,
};

thread_local! { static LAST: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) }; }

fn text(p: *const c_char) -> String {
    if p.is_null() {
        return String::new();
    }
    // SAFETY: PETSc passes NUL-terminated strings.
    unsafe { CStr::from_ptr(p) }.to_string_lossy().into_owned()
}

/// Replaces PETSc's traceback printer: remembers instead of printing.
///
/// # Safety
/// Called by PETSc with valid or null strings; does not unwind.
pub(super) unsafe extern "C" fn record(
    _comm: sys::MPI_Comm,
    line: c_int,
    function: *const c_char,
    file: *const c_char,
    code: sys::PetscErrorCode,
    kind: sys::PetscErrorType::Type,
    message: *const c_char,
    _context: *mut c_void,
) -> sys::PetscErrorCode {
    LAST.with(|last| {
        if let Ok(mut trace) = last.try_borrow_mut() {
            if kind == sys::PetscErrorType::PETSC_ERROR_INITIAL {
                *trace = vec![text(message)];
            }
            trace.push(format!("at {} ({}:{line})", text(function), text(file)));
        }
    });
    code
}

/// Turns a return code into a result.
pub(super) fn check(code: sys::PetscErrorCode) -> Result<()> {
    if code == 0 {
        return Ok(());
    }
    let trace = LAST.with(RefCell::take).join("\n    ");
    let mut generic = ptr::null();
    // SAFETY: `generic` receives a pointer to a static string.
    unsafe { sys::PetscErrorMessage(code, &mut generic, ptr::null_mut()) };
    Err(Error::internal(format!("PETSc error {code} ({}): {trace}", text(generic))))
}
