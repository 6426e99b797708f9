//! Stages of a run as PETSc logs them (`-log_view`).
use super::{error::check, sys};
use crate::error::Result;
use std::sync::atomic::{AtomicI32, Ordering};

/// A part of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Meshes, surfaces, search.
    SetUp,
    /// Stiffness matrices and loads.
    Assemble,
    /// Factorisations, or set-ups of solvers.
    Factor,
    /// The bodies' answers on the contact rows.
    Condense,
    /// The driver of the contact.
    Alternate,
    /// Result files, pictures and summary.
    Write,
}

/// Ends its stage when dropped; the one around it goes on.
pub struct InStage(());

/// PETSc's numbers of the stages, once they are known.
static NUMBERS: [AtomicI32; 6] = [const { AtomicI32::new(-1) }; 6];

/// Tells PETSc their names, on every rank in the same order.
pub(super) fn register() -> Result<()> {
    let names = [c"set-up", c"assemble", c"factor", c"condense", c"alternate", c"write"];
    for (number, name) in std::iter::zip(&NUMBERS, names) {
        let mut stage = -1;
        // SAFETY: PETSc copies the name.
        check(unsafe { sys::PetscLogStageRegister(name.as_ptr(), &mut stage) })?;
        number.store(stage, Ordering::Relaxed);
    }
    Ok(())
}

impl Stage {
    /// What follows belongs to this stage, until the value is dropped.
    #[must_use]
    pub fn enter(self) -> Option<InStage> {
        let number = NUMBERS[self as usize].load(Ordering::Relaxed);
        // SAFETY: a registered stage.
        (number >= 0 && unsafe { sys::PetscLogStagePush(number) } == 0).then_some(InStage(()))
    }
}

impl Drop for InStage {
    fn drop(&mut self) {
        // SAFETY: ends what `enter` began.
        unsafe { sys::PetscLogStagePop() };
    }
}
