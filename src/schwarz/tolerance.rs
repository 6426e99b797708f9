//! A tolerance that follows the discretisation error.
use super::{ActiveSet, Respond, state::Look};
use crate::vector::{larger, smaller};

/// Where an automatic tolerance begins, and what it does not fall below.
pub const AUTOMATIC: [f64; 2] = [1e-4, 1e-10];

/// An automatic tolerance is this share of the discretisation error.
const SHARE: f64 = 0.1;

/// A second look at the discretisation error is one at this share of the residual of the first.
const CLOSER: f64 = 0.1;

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Brings an automatic tolerance down to a share of the discretisation error that the forces show at the residual
    /// `size`, relative. While they are not yet accurate they scatter more than the mesh makes them, and a look at a smaller
    /// residual finds less: false until one at a tenth of the residual has found no less than half of what the look before
    /// it had found. Collective on the roots.
    pub(super) fn follow_mesh_error(&mut self, size: f64) -> bool {
        let Some(error) = self.mesh_error else { return true };
        let smallest = -self.coupling.exchange.max_signed(-error(&self.force, &self.active));
        let asked = larger(SHARE * smallest, AUTOMATIC[1]);
        self.limits.tolerance = smaller(self.limits.tolerance, asked);
        // Nothing is below the least.
        if asked <= AUTOMATIC[1] {
            return true;
        }
        match self.look {
            Some(before) if asked >= 0.5 * before.asked => size <= CLOSER * before.size,
            _ => {
                self.look = Some(Look { asked, size });
                false
            }
        }
    }
}
