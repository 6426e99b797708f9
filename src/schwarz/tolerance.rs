//! A tolerance that follows the discretisation error.
use super::{ActiveSet, Respond};

/// Where an automatic tolerance begins, and what it does not fall below.
pub const AUTOMATIC: [f64; 2] = [1e-4, 1e-10];

/// An automatic tolerance is this share of the discretisation error.
const SHARE: f64 = 0.1;

/// Smallest relative discretisation error of a pair's pressure, given the row forces and which rows are in contact;
/// infinite where nothing touches.
pub type MeshError<'e> = dyn Fn(&[f64], &[bool]) -> f64 + 'e;

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// Brings an automatic tolerance down to a share of the discretisation error that the forces show. While they are not
    /// yet accurate they scatter more than the mesh makes them, and the next look will find less.
    pub(super) fn follow_mesh_error(&mut self) {
        if let Some(error) = self.mesh_error {
            let smallest = -self.coupling.exchange.max_signed(-error(&self.force, &self.active));
            self.limits.tolerance = self.limits.tolerance.min((SHARE * smallest).max(AUTOMATIC[1]));
        }
    }
}
