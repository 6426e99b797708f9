//! What the answers of a body have in common.
use super::BodyRow;
use crate::schwarz::Spring;

/// What a response knows of a body apart from its operators: values of rows on the first rank, none elsewhere.
#[derive(Debug, Clone, Default)]
pub(super) struct RowValues {
    pub rows: Vec<BodyRow>,
    /// Displacements at the interface nodes without contact forces, m, global axes.
    pub free_interface: Vec<f64>,
    /// Row displacements without contact forces, m.
    pub free: Vec<f64>,
    /// Modes x rows.
    pub modes: Vec<Vec<f64>>,
    /// Modes x interface values.
    pub mode_interface: Vec<Vec<f64>>,
    /// Work of the loads on each mode, and the sum of the absolute works, J.
    pub mode_work: Vec<f64>,
    pub mode_scale: Vec<f64>,
    /// Of the soft modes.
    pub springs: Vec<Spring>,
}

impl RowValues {
    /// Row displacements of displacements at the interface nodes.
    pub fn at_rows(&self, u: &[f64], dim: usize) -> Vec<f64> {
        self.rows.iter().map(|row| row.displacement(u, dim)).collect()
    }

    /// Adds the free displacements and the modes to those of the contact forces, at the interface nodes.
    pub fn complete(&self, mut u: Vec<f64>, alpha: &[f64]) -> Vec<f64> {
        std::iter::zip(&mut u, &self.free_interface).for_each(|(u, free)| *u += free);
        for (alpha, mode) in std::iter::zip(alpha, &self.mode_interface) {
            std::iter::zip(&mut u, mode).for_each(|(u, m)| *u += alpha * m);
        }
        u
    }
}
