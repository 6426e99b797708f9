//! A tolerance that follows the discretisation error.
use super::{ActiveSet, Respond};
use crate::vector::{larger, smaller};

/// Where an automatic tolerance begins, and what it does not fall below.
pub const AUTOMATIC: [f64; 2] = [1e-4, 1e-10];

/// An automatic tolerance is this share of the discretisation error.
const SHARE: f64 = 0.1;

/// Smallest relative discretisation error of a pair's pressure, given the row forces and which rows are in contact;
/// infinite where nothing touches.
pub type MeshError<'e> = dyn Fn(&[f64], &[bool]) -> f64 + 'e;

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Brings an automatic tolerance down to a share of the discretisation error that the forces show. While they are not
    /// yet accurate they scatter more than the mesh makes them, and the next look will find less: false until a look has
    /// found no less than half of what the look before it had found. Collective on the roots.
    pub(super) fn follow_mesh_error(&mut self) -> bool {
        let Some(error) = self.mesh_error else { return true };
        let smallest = -self.coupling.exchange.max_signed(-error(&self.force, &self.active));
        let asked = larger(SHARE * smallest, AUTOMATIC[1]);
        self.limits.tolerance = smaller(self.limits.tolerance, asked);
        let before = self.look.replace(asked);
        // Nothing is below the least.
        asked <= AUTOMATIC[1] || before.is_some_and(|before| asked >= 0.5 * before)
    }
}
