//! What decides the peak pressures of the pairs.
use super::{
    contacts::Contacts,
    rows::Pair,
    task::{Influence, Solution, Task},
};
use crate::{
    body::Response,
    error::Result,
    estimate::coarse,
    schwarz::{ActiveSet, Respond},
    vector::{self, larger, ratio},
};
use std::ops::Range;

/// Share of the largest pressure from which a row belongs to the top of the peak: on a Hertz contact |x| <= 0.3 a. What the
/// mesh makes wrong is rather the mean there than one value, which the stresses of no mesh know.
const TOP: f64 = 0.95;

impl Contacts {
    /// What decides the peak pressure of each pair. Collective on the roots.
    pub(super) fn influences(
        &self,
        task: &Task,
        driver: &mut ActiveSet<Response>,
    ) -> Result<Vec<(Influence, Solution)>> {
        let exchange = task.scene.exchange;
        let mut found = Vec::new();
        for pair in 0..task.scene.case.contacts.len() {
            let Some((value, weights)) = self.peak_of(task, driver, pair) else { continue };
            let (dual, motion) = driver.influence(weights)?;
            let rows = driver.coupling.n_rows;
            let largest = |v: &[f64]| vector::largest(&v[..rows]);
            let sizes = exchange.max(&[largest(&driver.force), largest(&dual)]);
            let scale = ratio(sizes[0], sizes[1]);
            let sum = |a: &[f64], b: &[f64]| -> Vec<f64> {
                std::iter::zip(a, b).map(|(a, b)| a + scale * b).collect()
            };
            let (force, alpha) = (sum(&driver.force, &dual), sum(&driver.alpha, &motion));
            let changed = self.on_bodies(task, driver, &force, &alpha);
            let partners = self.partners(task, driver, &dual, pair);
            found.push((Influence { pair, value, scale, partners }, changed));
        }
        Ok(found)
    }

    /// Mean pressure of the peak of a pair, Pa, and its derivatives by the row forces, 1/m2; `None` if nothing touches.
    /// Collective on the roots.
    fn peak_of(&self, task: &Task, driver: &ActiveSet<Response>, pair: usize) -> Option<(f64, Vec<f64>)> {
        let mut weights = vec![0.0; driver.coupling.n];
        let mut sums = [0.0; 2];
        for (range, data) in self.multipliers(driver).filter(|(_, data)| data.number == pair) {
            let force = &driver.force[range.clone()];
            let pressure: Vec<f64> = std::iter::zip(force, &data.rows).map(|(f, row)| f / row.area).collect();
            let least = TOP * pressure.iter().copied().fold(0.0, larger);
            for j in (0..force.len()).filter(|&j| pressure[j] > 0.0 && pressure[j] >= least) {
                weights[range.start + j] = 1.0;
                sums[0] += force[j];
                sums[1] += data.rows[j].area;
            }
        }
        let [force, area] = task.scene.exchange.sum(&sums)[..] else { return None };
        weights.iter_mut().for_each(|w| *w /= area);
        (area > 0.0).then(|| (force / area, weights))
    }

    /// [`Influence::partners`]. Collective on the roots.
    fn partners(&self, task: &Task, driver: &ActiveSet<Response>, dual: &[f64], pair: usize) -> [f64; 2] {
        let thickness = task.scene.case.analysis.thickness();
        let mut sums = [0.0; 2];
        for (range, data) in self.multipliers(driver).filter(|(_, data)| data.moduli[1].is_finite()) {
            let forces = [&driver.force[range.clone()], &dual[range]];
            let stiffness = data.moduli.map(|modulus| modulus * thickness);
            let missing = || coarse::missing(&data.rows, &data.grain, forces, stiffness);
            // Near the peak itself a dual solution is as rough as the mesh: only a partner that is coarser tells.
            match (data.number == pair, coarse::coarseness(&data.rows, forces[0])) {
                (true, coarseness) if coarseness > 0.0 => sums[0] += coarseness * missing(),
                (true, _) => {}
                (false, _) => sums[1] += missing(),
            }
        }
        let sums = task.scene.exchange.sum(&sums);
        [sums[0], sums[1]]
    }

    /// The pairs whose multipliers this rank holds, with the rows' places in a row vector.
    fn multipliers(&self, driver: &ActiveSet<Response>) -> impl Iterator<Item = (Range<usize>, &Pair)> {
        let ranges = driver.coupling.ranges.clone();
        let ends = std::iter::zip(&self.shares.ends, ranges).filter(|(end, _)| end.multiplier);
        ends.filter_map(|(end, range)| Some((range, self.pairs[end.pair].as_ref()?)))
    }

    /// Row forces and motions, body by body. Collective on the roots.
    fn on_bodies(&self, task: &Task, driver: &ActiveSet<Response>, force: &[f64], alpha: &[f64]) -> Solution {
        let exchange = task.scene.exchange;
        let out: Vec<Vec<f64>> =
            driver.coupling.ranges.iter().map(|range| force[range.clone()].to_vec()).collect();
        let received = exchange.swap(&out);
        let modes = std::iter::zip(&task.modes.first, &task.modes.counts);
        let mut solution = Solution {
            force: driver.coupling.bodies.iter().map(|r| vec![0.0; r.n_rows()]).collect(),
            alpha: modes.map(|(&f, &count)| alpha[f..f + count].to_vec()).collect(),
            relief: driver.coarse.relief(exchange, force),
            ..Solution::default()
        };
        for (i, end) in self.shares.ends.iter().enumerate() {
            let values = if end.multiplier { &out[i] } else { &received[i] };
            solution.force[end.body][end.rows.clone()].copy_from_slice(values);
        }
        solution
    }
}
