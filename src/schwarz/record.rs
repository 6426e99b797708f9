//! The history of the active-set driver: a row per alternation.
use super::{Coupling, Respond};
use crate::record::{HistoryRow, PairRow};
use crate::vector::larger;
use std::time::Instant;

/// Gathers the history.
pub(super) struct Recorder {
    start: Instant,
    rows: Vec<HistoryRow>,
    count: usize,
    n_pairs: usize,
    step: u64,
    last: Vec<f64>,
}

/// What a row is made from.
pub(super) struct Snapshot<'a> {
    pub gaps: &'a [f64],
    pub active: &'a [bool],
    /// Per end: its normal rows; tangential ones follow.
    pub n_normal: &'a [usize],
    pub flipped: &'a [usize],
    /// Norm of the elastic approach, m.
    pub scale: f64,
    /// Imbalance of the forces on the bodies that only contact holds, relative.
    pub imbalance: f64,
    pub update: usize,
}

impl Recorder {
    pub fn new(n_pairs: usize, step: u64) -> Recorder {
        Recorder { start: Instant::now(), rows: Vec::new(), count: 0, n_pairs, step, last: Vec::new() }
    }

    /// Pairs of the case.
    pub fn n_pairs(&self) -> usize {
        self.n_pairs
    }

    /// Alternations so far.
    pub fn count(&self) -> usize {
        self.count
    }

    pub fn take(&mut self) -> Vec<HistoryRow> {
        std::mem::take(&mut self.rows)
    }

    /// Adds the row of one alternation. Collective on the roots.
    pub fn record<B: Respond>(&mut self, coupling: &Coupling<B>, state: &Snapshot) -> &HistoryRow {
        self.count += 1;
        // Per pair: squared residual, closed, open, flips; then maxima of penetration and gap of closed rows.
        let mut sums = vec![[0.0; 4]; self.n_pairs];
        let mut maxima = vec![[0.0_f64; 2]; self.n_pairs];
        for (i, end) in coupling.ends.iter().enumerate().filter(|(_, end)| end.multiplier) {
            let (sum, max) = (&mut sums[end.pair], &mut maxima[end.pair]);
            let range = coupling.ranges[i].clone();
            for (k, j) in range.clone().enumerate() {
                let gap = state.gaps[j];
                if k >= state.n_normal[i] {
                    // Of a node that sticks what it has slipped.
                    sum[0] += if state.active[j] { gap * gap } else { 0.0 };
                    continue;
                }
                max[0] = larger(max[0], -gap);
                if state.active[j] {
                    sum[0] += gap * gap;
                    sum[1] += 1.0;
                    max[1] = larger(max[1], gap.abs());
                } else {
                    sum[2] += 1.0;
                }
            }
            sum[3] += state.flipped.iter().filter(|j| range.contains(j)).count() as f64;
        }
        let sums = coupling.exchange.sum(sums.as_flattened());
        let maxima = coupling.exchange.max(maxima.as_flattened());
        let residuals: Vec<f64> = sums.chunks_exact(4).map(|s| s[0].sqrt()).collect();
        let contraction = |p: usize| self.last.get(p).map(|last| residuals[p] / last);
        let pairs: Vec<PairRow> = std::iter::zip(sums.chunks_exact(4), maxima.chunks_exact(2))
            .enumerate()
            .map(|(p, (s, m))| PairRow {
                gap: m[1],
                penetration: m[0],
                active: s[1] as u64,
                open: s[2] as u64,
                flips: s[3] as u64,
                // One force acts on both sides.
                force_imbalance: 0.0,
                contraction: contraction(p),
            })
            .collect();
        let size = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
        let jump = size(&residuals);
        self.rows.push(HistoryRow {
            step: self.step,
            increment: 1,
            alternation: self.count as u64,
            update: state.update as u64,
            displacement_jump: if state.scale > 0.0 { jump / state.scale } else { 0.0 },
            force_imbalance: state.imbalance,
            penetration: pairs.iter().map(|p| p.penetration).fold(0.0, larger),
            gap: pairs.iter().map(|p| p.gap).fold(0.0, larger),
            active: pairs.iter().map(|p| p.active).sum(),
            open: pairs.iter().map(|p| p.open).sum(),
            flips: pairs.iter().map(|p| p.flips).sum(),
            contraction: (!self.last.is_empty()).then(|| jump / size(&self.last)),
            seconds: self.start.elapsed().as_secs_f64(),
            pairs,
        });
        self.last = residuals;
        self.rows.last().expect("a row was just added")
    }
}
