//! Names of a body's PETSc options.
use crate::{error::Result, petsc};

/// Prefix of a body's PETSc options: `-body_<name>_ksp_type cg`.
pub fn options_prefix(name: &str) -> String {
    format!("body_{name}_")
}

/// True if the options database names the body's solver or preconditioner.
pub(super) fn has_own_solver(name: &str) -> Result<bool> {
    let prefix = options_prefix(name);
    Ok(petsc::has_option(&prefix, "ksp_type")? || petsc::has_option(&prefix, "pc_type")?)
}
