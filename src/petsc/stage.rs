//! Stages of a run: as PETSc logs them (`-log_view`), and their wall time.
use super::{error::check, sys};
use crate::error::Result;
use std::{
    cell::RefCell,
    sync::atomic::{AtomicI32, Ordering},
    time::Instant,
};

/// A part of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Meshes, surfaces, partitions.
    SetUp,
    /// Facing surfaces found, and the transfer between them.
    Search,
    /// Stiffness matrices and loads.
    Assemble,
    /// Factorisations, or set-ups of solvers.
    Factor,
    /// The bodies' answers on the contact rows.
    Condense,
    /// The driver of the contact.
    Alternate,
    /// Displacements of the interiors, strains, stresses and the checks made of them.
    Recover,
    /// Error estimates, and what is to be refined by them.
    Estimate,
    /// Result files, pictures and summary.
    Write,
}

/// Number of stages.
const STAGES: usize = 9;

/// Ends its stage when dropped; the one around it goes on.
pub struct InStage {
    logged: bool,
}

/// Seconds of the stages of this thread's run.
struct Clock {
    seconds: [f64; STAGES],
    /// The stage that runs, and those around it.
    open: Vec<Stage>,
    since: Instant,
}

thread_local! {
    static CLOCK: RefCell<Clock> =
        RefCell::new(Clock { seconds: [0.0; STAGES], open: Vec::new(), since: Instant::now() });
}

impl Clock {
    /// Counts the time up to now for the stage that has run.
    fn look(&mut self) {
        let now = Instant::now();
        if let Some(stage) = self.open.last() {
            self.seconds[*stage as usize] += (now - self.since).as_secs_f64();
        }
        self.since = now;
    }
}

/// What the stages of a run have taken on this rank, each without those inside it: together no more than the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageSeconds([f64; STAGES]);

impl StageSeconds {
    /// Up to now.
    pub fn now() -> StageSeconds {
        CLOCK.with_borrow_mut(|clock| {
            clock.look();
            StageSeconds(clock.seconds)
        })
    }

    /// Of a stage, since an earlier time.
    pub fn of(&self, stage: Stage, since: &StageSeconds) -> f64 {
        self.0[stage as usize] - since.0[stage as usize]
    }
}

/// PETSc's numbers of the stages, once they are known.
static NUMBERS: [AtomicI32; STAGES] = [const { AtomicI32::new(-1) }; STAGES];

/// Tells PETSc their names, on every rank in the same order.
pub(super) fn register() -> Result<()> {
    let names = [
        c"set-up",
        c"search",
        c"assemble",
        c"factor",
        c"condense",
        c"alternate",
        c"recover",
        c"estimate",
        c"write",
    ];
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
    pub fn enter(self) -> InStage {
        CLOCK.with_borrow_mut(|clock| {
            clock.look();
            clock.open.push(self);
        });
        let number = NUMBERS[self as usize].load(Ordering::Relaxed);
        // SAFETY: a registered stage.
        InStage { logged: number >= 0 && unsafe { sys::PetscLogStagePush(number) } == 0 }
    }
}

impl Drop for InStage {
    fn drop(&mut self) {
        CLOCK.with_borrow_mut(|clock| {
            clock.look();
            clock.open.pop();
        });
        if self.logged {
            // SAFETY: ends what `enter` began.
            unsafe { sys::PetscLogStagePop() };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{thread::sleep, time::Duration};

    #[test]
    fn a_stage_inside_another_is_counted_once() {
        let (start, begun) = (StageSeconds::now(), Instant::now());
        let outer = Stage::Alternate.enter();
        sleep(Duration::from_millis(5));
        let inner = Stage::Condense.enter();
        sleep(Duration::from_millis(20));
        drop(inner);
        sleep(Duration::from_millis(5));
        drop(outer);
        let total = begun.elapsed().as_secs_f64();
        sleep(Duration::from_millis(5));
        let now = StageSeconds::now();
        let [outer, inner] = [Stage::Alternate, Stage::Condense].map(|stage| now.of(stage, &start));
        assert!(outer >= 0.01 && inner >= 0.02, "{outer} {inner}");
        assert!((outer + inner - total).abs() < 1e-3, "{outer} + {inner} is not {total}");
    }
}
