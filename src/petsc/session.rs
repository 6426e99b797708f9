//! Start and end of PETSc, and its options database.
use super::{
    error::{check, record},
    sys,
};
use crate::{
    error::{Error, Result},
    parallel,
};
use std::{
    ffi::{CStr, CString, c_char, c_int},
    ptr,
};

/// OpenBLAS takes a buffer of up to 128 MB at its first call and tries for ever if it cannot get it.
const BLAS_BUFFER: usize = 160 << 20;

/// Options that PETSc asks for when it ends.
const ASKED_AT_THE_END: [&str; 9] = [
    "citations",
    "get_total_flops",
    "malloc_dump",
    "malloc_view",
    "memory_view",
    "objects_dump",
    "options_left",
    "options_table",
    "options_view",
];

/// PETSc, from initialisation to finalisation. MPI must be initialised before and finalised after.
pub struct Session(());

impl Session {
    /// Initialises PETSc on `MPI_COMM_WORLD`; errors are returned, not printed, and signals are left alone.
    pub fn start() -> Result<Session> {
        Session::start_with(&[])
    }

    /// The same with options of the command line (`-log_view`, `-body_upper_ksp_type`, `cg`), some of which PETSc knows only
    /// if it has them when it starts.
    pub fn start_with(options: &[String]) -> Result<Session> {
        // Not the files of options that PETSc looks for in the working directory and at home: `.petscrc` may lie beside a
        // case, and options write files.
        let words = ["kontakt", "-skip_petscrc"].into_iter().chain(options.iter().map(String::as_str));
        let words: std::result::Result<Vec<CString>, _> = words.map(CString::new).collect();
        let words = words.map_err(|_| Error::input("PETSc options must not contain NUL"))?;
        let mut pointers: Vec<*mut c_char> = words.into_iter().map(CString::into_raw).collect();
        let n = c_int::try_from(pointers.len()).map_err(Error::internal)?;
        pointers.push(ptr::null_mut());
        // PETSc keeps both for the rest of the process.
        let (n, all) = (Box::leak(Box::new(n)), Box::leak(Box::new(pointers.leak().as_mut_ptr())));
        // SAFETY: arguments as `main` gets them, which live as long as the process; the handler is a static function.
        unsafe {
            check(sys::PetscInitialize(n, all, ptr::null(), ptr::null()))?;
            check(sys::PetscPopSignalHandler())?;
            check(sys::PetscPushErrorHandler(Some(record), ptr::null_mut()))?;
        }
        super::stage::register()?;
        Ok(Session(()))
    }
}

/// Makes BLAS take its buffer while there is room for it. Not collective: agree on the error.
pub fn touch_blas() -> Result<()> {
    if !parallel::can_have(BLAS_BUFFER) {
        return Err(Error::Memory(format!(
            "there is not enough memory to begin: {} MB for the buffer of BLAS",
            BLAS_BUFFER >> 20
        )));
    }
    super::Symmetric::gram(&[1.0; 4], 2, 2).map(|_| ())
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

/// Value of `-<prefix><name>`, if the options have it; it counts as asked for.
pub(super) fn option_value(prefix: &str, name: &str) -> Result<Option<String>> {
    let prefix = CString::new(prefix).map_err(Error::internal)?;
    let name = CString::new(format!("-{name}")).map_err(Error::internal)?;
    // Names of types are short; a longer value is cut and then unknown.
    let mut value = [0; 256];
    let mut found = sys::PetscBool::PETSC_FALSE;
    // SAFETY: the buffer has the stated length and comes back NUL-terminated.
    unsafe {
        check(sys::PetscOptionsGetString(
            ptr::null_mut(),
            prefix.as_ptr(),
            name.as_ptr(),
            value.as_mut_ptr(),
            value.len(),
            &mut found,
        ))?;
        let is_found = found == sys::PetscBool::PETSC_TRUE;
        Ok(is_found.then(|| CStr::from_ptr(value.as_ptr()).to_string_lossy().into_owned()))
    }
}

/// Gives `-<prefix><name>` a value unless it has one. It counts as asked for: nobody has misspelt it.
pub(super) fn default_option(prefix: &str, name: &str, value: &str) -> Result<()> {
    if !has_option(prefix, name)? {
        set_options(&format!("-{prefix}{name} {value}"))?;
        has_option(prefix, name)?;
    }
    Ok(())
}

/// Names of options starting with `prefix` that nothing has asked for, nor will: most likely misspelt.
pub fn option_prefixes_left(prefix: &str) -> Result<Vec<String>> {
    let (mut n, mut names, mut values) = (0, ptr::null_mut(), ptr::null_mut());
    // SAFETY: PETSc fills the three outputs; they are read before they are given back.
    unsafe {
        check(sys::PetscOptionsLeftGet(ptr::null_mut(), &mut n, &mut names, &mut values))?;
        let left = (0..n as usize)
            .map(|i| CStr::from_ptr(*names.add(i)).to_string_lossy().into_owned())
            .filter(|name| name.starts_with(prefix) && !ASKED_AT_THE_END.contains(&name.as_str()))
            .collect();
        check(sys::PetscOptionsLeftRestore(ptr::null_mut(), &mut n, &mut names, &mut values))?;
        Ok(left)
    }
}
