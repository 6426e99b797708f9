//! A body as the drivers see it: contact rows, and how it answers forces and displacements on them.
use crate::{error::Result, petsc::Symmetric};

/// A spring that resists a free mode: a soft mode's own stiffness, stiffness x lever^2, N/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Which of the body's modes.
    pub mode: usize,
    /// Its travel for a mode of amplitude 1, m.
    pub lever: f64,
    /// N/m.
    pub stiffness: f64,
}

/// A body's answer on its contact rows. Its outward row displacements are w = free - C R + sum_k modes_k alpha_k, m,
/// with the compressive row forces R, N, the compliance C, and the amplitudes alpha of its free modes: rigid ones, and soft
/// ones that a spring resists.
///
/// All vectors have one entry per row of the body. The two steps are collective on the body's rank group.
pub trait Respond {
    /// Number of rows.
    fn n_rows(&self) -> usize;

    /// w without contact forces, under all loads, supports and initial strains, free modes held at zero, m.
    fn free(&self) -> &[f64];

    /// Force step: C R, how far the forces push the rows inwards, m.
    fn force_step(&mut self, force: &[f64]) -> Result<Vec<f64>>;

    /// Displacement step: the forces, N, that push the `active` rows inwards by `inward`, m, while the others carry no
    /// force and free rigid motion costs none: R = S (inward + G beta), G'R = 0, S = (C_aa)^-1, G = modes on the active
    /// rows. Zero on rows that a support of the body holds. Exact for a condensed body; a symmetric positive semi-definite approximation otherwise.
    fn displacement_step(&mut self, inward: &[f64], active: &[bool]) -> Result<Vec<f64>>;

    /// Unilateral displacement step: the compressive forces, N, of the body pressed against a rigid obstacle that leaves
    /// the `chosen` rows the gap `gap` (negative: it is pushed in): R >= 0, C R + gap - Z beta >= 0, one of them zero at
    /// each chosen row; the other rows carry the forces `held`, which count in the equilibrium Z'R = e of free modes.
    /// `held` on the chosen rows says where to begin. `None` if the body has no such answer at hand.
    fn unilateral_step(&mut self, gap: &[f64], chosen: &[bool], held: &[f64]) -> Result<Option<Vec<f64>>> {
        let _ = (gap, chosen, held);
        Ok(None)
    }

    /// How far the rows have moved, in any direction, under all loads and the row forces, m, free modes held at zero. Of a
    /// body that moves along its rows' normals only, |w|.
    fn distances(&mut self, force: &[f64]) -> Result<Vec<f64>> {
        let pushed = self.force_step(force)?;
        Ok(std::iter::zip(self.free(), pushed).map(|(free, pushed)| (free - pushed).abs()).collect())
    }

    /// Row displacements of each free mode (modes x rows), m.
    fn modes(&self) -> &[Vec<f64>];

    /// Work of the body's loads on each free mode, J.
    fn mode_work(&self) -> &[f64];

    /// Sum of the absolute works of the loads' nodal forces on each free mode, J: what round-off is measured against.
    fn mode_scale(&self) -> &[f64];

    /// C, m/N, if it is at hand as a matrix.
    fn compliance(&self) -> Option<&Symmetric> {
        None
    }

    /// Operations that it took to have C at hand: what more may be done with it without being noticed.
    fn condensation(&self) -> f64 {
        0.0
    }

    /// The springs of the soft modes; none of a rigid one.
    fn springs(&self) -> &[Spring] {
        &[]
    }
}
