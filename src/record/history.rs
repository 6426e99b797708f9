//! The history of an alternation: a row each, and the same per contact pair.

/// One row of the history: an alternation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HistoryRow {
    /// Load step, 1, 2, ...; 1 without a table of steps.
    pub step: u64,
    /// Increment of the step, 1, 2, ...
    pub increment: u64,
    /// Running number within the step: 1, 2, ...
    pub alternation: u64,
    /// Active-set update that the alternation belongs to, 1, 2, ... within the step; 0 where nothing counts them.
    pub update: u64,
    /// Gap left at the nodes in contact, relative to the elastic response, -.
    pub displacement_jump: f64,
    /// Disagreement of the nodal forces, relative, -.
    pub force_imbalance: f64,
    /// Largest penetration, m; 0 if there is none.
    pub penetration: f64,
    /// Largest |gap| at the nodes in contact, m.
    pub gap: f64,
    /// Nodes in contact.
    pub active: u64,
    /// Nodes that could touch and do not.
    pub open: u64,
    /// Nodes that entered or left the contact.
    pub flips: u64,
    /// Measured contraction of the displacement jump, -; the first has none.
    pub contraction: Option<f64>,
    /// Wall seconds since the first alternation began.
    pub seconds: f64,
    /// The same for each contact pair, in their order; empty where it was not measured.
    pub pairs: Vec<PairRow>,
}

/// A contact pair in an alternation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PairRow {
    /// Largest |gap| at the nodes in contact, m.
    pub gap: f64,
    /// Largest penetration, m; 0 if there is none.
    pub penetration: f64,
    /// Nodes in contact.
    pub active: u64,
    /// Nodes that could touch and do not.
    pub open: u64,
    /// Nodes that entered or left the contact.
    pub flips: u64,
    /// Disagreement of the nodal forces, relative, -.
    pub force_imbalance: f64,
    /// Measured contraction of the gap at the nodes in contact, -; the first has none.
    pub contraction: Option<f64>,
}

/// Geometric mean of the contractions that are known and have a logarithm: the rate over all of them.
pub fn mean_contraction(contractions: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    let known = contractions.into_iter().flatten().filter(|c| c.is_finite() && *c > 0.0);
    let (sum, n) = known.fold((0.0, 0), |(sum, n), c| (sum + c.ln(), n + 1));
    (n > 0).then(|| (sum / f64::from(n)).exp())
}

#[cfg(test)]
mod tests {
    use super::mean_contraction;

    #[test]
    fn the_mean_contraction_is_the_rate() {
        assert!((mean_contraction([None, Some(0.5), Some(0.02)]).unwrap() - 0.1).abs() < 1e-15);
        assert_eq!(mean_contraction([None, Some(f64::INFINITY), Some(0.0)]), None);
    }
}
