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
    if code == 0 { Ok(()) } else { Err(error(code, &LAST.with(RefCell::take))) }
}

/// The same where options of the user's choice are read or first used: what they make PETSc refuse is wrong input, in one
/// line.
pub(super) fn check_options(code: sys::PetscErrorCode) -> Result<()> {
    let refused = [
        sys::PETSC_ERR_SUP,
        sys::PETSC_ERR_SUP_SYS,
        sys::PETSC_ERR_ORDER,
        sys::PETSC_ERR_ARG_SIZ,
        sys::PETSC_ERR_ARG_WRONG,
        sys::PETSC_ERR_ARG_OUTOFRANGE,
        sys::PETSC_ERR_ARG_WRONGSTATE,
        sys::PETSC_ERR_ARG_INCOMP,
        sys::PETSC_ERR_ARG_NULL,
        sys::PETSC_ERR_ARG_UNKNOWN_TYPE,
        sys::PETSC_ERR_USER,
        sys::PETSC_ERR_MISSING_FACTOR,
        sys::PETSC_ERR_WRONG_MPI_SIZE,
        sys::PETSC_ERR_USER_INPUT,
    ];
    if !refused.contains(&code) {
        return check(code);
    }
    let trace = LAST.with(RefCell::take);
    let message = trace.first().and_then(|text| text.lines().next()).unwrap_or("no reason given");
    Err(Error::input(format!("PETSc refuses the solver's options: {message}")))
}

fn error(code: sys::PetscErrorCode, trace: &[String]) -> Error {
    let mut generic = ptr::null();
    // SAFETY: `generic` receives a pointer to a static string.
    unsafe { sys::PetscErrorMessage(code, &mut generic, ptr::null_mut()) };
    let message = trace.first().map_or("", String::as_str);
    if code == sys::PETSC_ERR_MEM || lacks_memory(message) {
        return Error::Memory(format!("there is not enough memory: {}", message.replace('\n', " ")));
    }
    Error::internal(format!("PETSc error {code} ({}): {}", text(generic), trace.join("\n    ")))
}

/// True for MUMPS' complaint, as PETSc hands it on, that an allocation has failed, INFOG(1) = -7, -13, -19 or -22.
fn lacks_memory(message: &str) -> bool {
    let value = message.split_once("INFOG(1)=").map(|(_, rest)| rest.split(',').next().unwrap_or("").trim());
    matches!(value, Some("-7" | "-13" | "-19" | "-22"))
}
