//! Start and end of PETSc, and its options database.
use super::{
    error::{check, record},
    sys,
};
use crate::error::{Error, Result};
use std::{
    ffi::{CStr, CString},
    ptr,
};

/// PETSc, from initialisation to finalisation. MPI must be initialised before and finalised after.
pub struct Session(());

impl Session {
    /// Initialises PETSc on `MPI_COMM_WORLD`; errors are returned, not printed, and signals are left alone.
    pub fn start() -> Result<Session> {
        // SAFETY: plain calls; the handler is a static function.
        unsafe {
            check(initialize())?;
            check(sys::PetscPopSignalHandler())?;
            check(sys::PetscPushErrorHandler(Some(record), ptr::null_mut()))?;
        }
        Ok(Session(()))
    }
}

/// Starts PETSc without the files of options that it looks for in the working directory and at home: `.petscrc` may lie
/// beside a case, and options write files.
///
/// # Safety
/// MPI must be initialised.
unsafe fn initialize() -> sys::PetscErrorCode {
    let words = [c"kontakt".as_ptr().cast_mut(), c"-skip_petscrc".as_ptr().cast_mut(), ptr::null_mut()];
    // PETSc keeps both for the rest of the process.
    let n = Box::leak(Box::new(2));
    let all = Box::leak(Box::new(Box::leak(Box::new(words)).as_mut_ptr()));
    // SAFETY: promised; arguments as `main` gets them, which live as long as the process.
    unsafe { sys::PetscInitialize(n, all, ptr::null(), ptr::null()) }
}

impl Drop for Session {
    fn drop(&mut self) {
        // SAFETY: PETSc is initialised while a `Session` lives.
        unsafe { sys::PetscFinalize() };
    }
}

/// Adds options in PETSc's own syntax (`-body_upper_ksp_type cg`); later ones win.
pub fn set_options(options: &str) -> Result<()> {
    let text = CString::new(options).map_err(|_| Error::input("PETSc options must not contain NUL"))?;
    // SAFETY: a null options object means the global database.
    check(unsafe { sys::PetscOptionsInsertString(ptr::null_mut(), text.as_ptr()) })
}

/// True if the options database has `-<prefix><name>`; it counts as asked for.
pub fn has_option(prefix: &str, name: &str) -> Result<bool> {
    let nul = |_| Error::input("PETSc options must not contain NUL");
    let prefix = CString::new(prefix).map_err(nul)?;
    let name = CString::new(format!("-{name}")).map_err(nul)?;
    let mut found = sys::PetscBool::PETSC_FALSE;
    // SAFETY: a null options object means the global database.
    check(unsafe { sys::PetscOptionsHasName(ptr::null_mut(), prefix.as_ptr(), name.as_ptr(), &mut found) })?;
    Ok(found == sys::PetscBool::PETSC_TRUE)
}

/// Gives `-<prefix><name>` a value unless it has one. It counts as asked for: nobody has misspelt it.
pub(super) fn default_option(prefix: &str, name: &str, value: &str) -> Result<()> {
    if !has_option(prefix, name)? {
        set_options(&format!("-{prefix}{name} {value}"))?;
        has_option(prefix, name)?;
    }
    Ok(())
}

/// Names of options starting with `prefix` that nothing has asked for: most likely misspelt.
pub fn option_prefixes_left(prefix: &str) -> Result<Vec<String>> {
    let (mut n, mut names, mut values) = (0, ptr::null_mut(), ptr::null_mut());
    // SAFETY: PETSc fills the three outputs; they are read before they are given back.
    unsafe {
        check(sys::PetscOptionsLeftGet(ptr::null_mut(), &mut n, &mut names, &mut values))?;
        let left = (0..n as usize)
            .map(|i| CStr::from_ptr(*names.add(i)).to_string_lossy().into_owned())
            .filter(|name| name.starts_with(prefix))
            .collect();
        check(sys::PetscOptionsLeftRestore(ptr::null_mut(), &mut n, &mut names, &mut values))?;
        Ok(left)
    }
}

/// Ends all ranks at once, with exit code 1.
pub fn abort() {
    // SAFETY: MPI is initialised whenever the program can panic on more than one rank.
    unsafe { sys::MPI_Abort(sys::RSMPI_COMM_WORLD, 1) };
}
