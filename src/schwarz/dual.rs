//! The dual problem of condensed bodies: their compliances on the contact rows, added up once, are F, and the whole
//! contact problem is settled on it before the bodies are asked. One alternation then tests what was found.
//!
//! Every root holds F; the first one solves and the others receive its answer, so that all have the same digits.
use super::{
    Coarse, Coupling, PairRows, Respond,
    quadratic::{Answer, Face, Given, Quadratic},
};
use crate::{error::Result, petsc::Symmetric, vector::larger};
use std::ops::Range;

/// Factorisations on the closed rows that a contact problem is reckoned to take, m^3 / 3 operations each.
const FACTORISATIONS: f64 = 10.0;

/// Products with F, its scaling included, 2 n^2 operations each.
const PRODUCTS: f64 = 50.0;

/// Operations that nobody notices: a fraction of a second, less than the start of a run.
const UNNOTICED: f64 = 1e9;

/// F on the rows of all pairs, scaled.
pub(super) struct Dual {
    /// Where each pair's rows begin.
    first: Vec<usize>,
    quadratic: Quadratic,
    /// x = R s, A = F / (s s'), with s the square root of the mean compliance of the row's pair, weighted so that what
    /// the gaps do not determine is a pressure without waves.
    scale: Vec<f64>,
    /// The system of the active set last asked for.
    face: Option<Face>,
}

impl Dual {
    /// Gathers F; `None` where a body has no compliance at hand, or where working with F would cost more than condensing
    /// the bodies has. `closed`: rows that a first guess closes. The same on all roots. Collective on them.
    pub fn new<B: Respond>(
        coupling: &Coupling<B>,
        coarse: &Coarse,
        rows: &[PairRows],
        n_pairs: usize,
        closed: &[bool],
    ) -> Option<Dual> {
        let exchange = coupling.exchange;
        let mut counts = vec![0.0; n_pairs + 3];
        counts[n_pairs + 2] = closed[..coupling.n_rows].iter().filter(|c| **c).count() as f64;
        for end in coupling.ends.iter().filter(|end| end.multiplier) {
            counts[end.pair] = end.rows.len() as f64;
        }
        for body in coupling.bodies.iter() {
            counts[n_pairs] += f64::from(u8::from(body.compliance().is_none() && body.n_rows() > 0));
            counts[n_pairs + 1] += body.condensation();
        }
        let counts = exchange.sum(&counts);
        let first: Vec<usize> = (0..=n_pairs).map(|p| counts[..p].iter().sum::<f64>() as usize).collect();
        let n = first[n_pairs];
        let factorised = |n: f64| FACTORISATIONS * n.powi(3) / 3.0;
        let work = factorised(counts[n_pairs + 2]) + PRODUCTS * 2.0 * (n as f64).powi(2);
        let allowed = larger(counts[n_pairs + 1], UNNOTICED);
        if n == 0 || counts[n_pairs] > 0.0 || work > allowed {
            return None;
        }
        let mut f = gathered(coupling, &first);
        let pairs: Vec<Range<usize>> = (0..n_pairs).map(|p| first[p]..first[p + 1]).collect();
        let place = Layout { coupling, first: &first };
        let scale = place.scale(&mut f, rows);
        let modes = place.modes(coarse, &scale);
        let a = Symmetric::from_lower_rows(n, f);
        // The interior-point method factorises all of it.
        let interior = factorised(n as f64) <= allowed;
        let quadratic = Quadratic { a, modes, stiffness: coarse.stiffness.clone(), pairs, interior };
        Some(Dual { first, quadratic, scale, face: None })
    }

    /// The forces, springs' ones included, and the motions with which `gap`, the gaps without contact forces and motions,
    /// close; `force` and `alpha` say where to begin. `None` if they were not found. Collective on the roots.
    pub fn solve<B: Respond>(
        &mut self,
        coupling: &Coupling<B>,
        coarse: &Coarse,
        gap: &[f64],
        force: &[f64],
        alpha: &[f64],
    ) -> Result<Option<(Vec<f64>, Vec<f64>)>> {
        let place = Layout { coupling, first: &self.first };
        let scale = &self.scale;
        let gap: Vec<f64> = std::iter::zip(place.gather(gap), scale).map(|(g, s)| g / s).collect();
        let force: Vec<f64> = std::iter::zip(place.gather(force), scale).map(|(f, s)| f * s).collect();
        let given = Given { gap: &gap, work: &coarse.work, force: &force, alpha };
        let n = gap.len();
        let mut message = vec![0.0; n + coarse.n + 1];
        let found = if place.solves() { self.quadratic.solve(&given) } else { Ok(None) };
        let found = coupling.exchange.agree(found)?;
        if let Some(Answer { force, alpha, active, .. }) = found {
            // Closed rows keep their forces, round-off's tension too; the others have none.
            let forces = force.iter().zip(&active).zip(scale).map(|((f, a), s)| if *a { f / s } else { 0.0 });
            message.splice(..n, forces);
            message.splice(n..n + alpha.len(), alpha);
            message[n + coarse.n] = 1.0;
        }
        let message = coupling.exchange.sum(&message);
        if message[n + coarse.n] != 1.0 {
            return Ok(None);
        }
        let alpha = message[n..n + coarse.n].to_vec();
        let mut out = place.own(&message[..n]);
        out.extend(coarse.spring_forces_at(&alpha));
        Ok(Some((out, alpha)))
    }

    /// The change of the forces that answers the residual `r` on the active rows, springs included, exactly; `None` if the
    /// system cannot be solved. Collective on the roots.
    pub fn correct<B: Respond>(
        &mut self,
        coupling: &Coupling<B>,
        coarse: &Coarse,
        r: &[f64],
        active: &[bool],
    ) -> Result<Option<Vec<f64>>> {
        let place = Layout { coupling, first: &self.first };
        let flags: Vec<f64> = active.iter().map(|a| f64::from(u8::from(*a))).collect();
        let (r_rows, flags) = (place.gather(r), place.gather(&flags));
        // A spring answers its own residual, and what that pushes has to be taken up.
        let springs: Vec<f64> = r[coupling.n_rows..]
            .iter()
            .zip(&coupling.springs)
            .map(|(r, (_, spring))| spring.stiffness * r)
            .collect();
        let pushed = coarse.restrict(coupling.exchange, |j| {
            if j < coupling.n_rows { 0.0 } else { springs[j - coupling.n_rows] }
        });
        let missing: Vec<f64> = pushed.iter().map(|p| -p).collect();
        let n = r_rows.len();
        let mut message = vec![0.0; n + coarse.n + 1];
        let solves = place.solves();
        let answer = if solves { self.correct_rows(&r_rows, &flags, &missing) } else { Ok(None) };
        let answer = coupling.exchange.agree(answer)?;
        if let Some((x, alpha)) = answer {
            message.splice(..n, x);
            message.splice(n..n + alpha.len(), alpha);
            message[n + coarse.n] = 1.0;
        }
        let message = coupling.exchange.sum(&message);
        if message[n + coarse.n] != 1.0 {
            return Ok(None);
        }
        let place = Layout { coupling, first: &self.first };
        let mut out = place.own(&message[..n]);
        let changed = coarse.spring_forces_at(&message[n..n + coarse.n]);
        out.extend(std::iter::zip(springs, changed).map(|(a, b)| a + b));
        Ok(Some(out))
    }

    /// The same on the rows of all pairs.
    fn correct_rows(
        &mut self,
        r: &[f64],
        flags: &[f64],
        missing: &[f64],
    ) -> Result<Option<(Vec<f64>, Vec<f64>)>> {
        let active: Vec<usize> = (0..flags.len()).filter(|&j| flags[j] > 0.5).collect();
        if self.face.as_ref().is_none_or(|face| face.active != active) {
            self.face = self.quadratic.face(active)?;
        }
        let Some(face) = &self.face else { return Ok(None) };
        let of_active = face.active.iter().map(|&j| r[j] / self.scale[j]).collect();
        let (x, alpha) = self.quadratic.correct(face, of_active, missing)?;
        let mut out = vec![0.0; r.len()];
        face.active.iter().zip(x).for_each(|(&j, x)| out[j] = x / self.scale[j]);
        Ok(Some((out, alpha)))
    }
}

/// F, m/N, on the rows of all pairs, given where each pair's begin: the bodies' compliances added up. Collective on the roots.
pub(super) fn gathered<B: Respond>(coupling: &Coupling<B>, first: &[usize]) -> Vec<f64> {
    let n = first.last().copied().unwrap_or(0);
    let mut f = vec![0.0; n * n];
    for (b, body) in coupling.bodies.iter().enumerate() {
        let Some(compliance) = body.compliance() else { continue };
        let places: Vec<(usize, usize)> = coupling
            .ends
            .iter()
            .filter(|end| end.body == b)
            .flat_map(|end| end.rows.clone().zip(first[end.pair]..))
            .collect();
        for &(j, to) in &places {
            places.iter().for_each(|&(i, from)| f[to * n + from] += compliance.at(i, j));
        }
    }
    coupling.exchange.sum(&f)
}

/// Where this rank's rows are among those of all pairs.
pub(super) struct Layout<'p, 'c, 'a, B> {
    pub coupling: &'p Coupling<'a, B>,
    pub first: &'c [usize],
}

impl<B: Respond> Layout<'_, '_, '_, B> {
    /// Scales F to a mean diagonal of 1, and returns the scales: of each row the square root of its pair's mean compliance, weighted
    /// by its area. Of the two rows of a node with friction they are the same. Collective on the roots.
    pub fn scale(&self, f: &mut [f64], rows: &[PairRows]) -> Vec<f64> {
        let mut area = vec![1.0; self.coupling.n];
        for (rows, range) in std::iter::zip(rows, &self.coupling.ranges) {
            std::iter::zip(&mut area[range.clone()], &rows.area).for_each(|(a, b)| *a = *b);
        }
        let area = self.gather(&area);
        let n = area.len();
        let mut scale = vec![1.0; n];
        for pair in self.first.windows(2).map(|ends| ends[0]..ends[1]) {
            let mean = |v: &dyn Fn(usize) -> f64| pair.clone().map(v).sum::<f64>() / pair.len().max(1) as f64;
            let (compliance, mean_area) = (mean(&|j| f[j * n + j]), mean(&|j| area[j]));
            for j in pair.clone() {
                let weighted = (compliance * mean_area / area[j]).sqrt();
                scale[j] = if weighted > 0.0 && weighted.is_finite() { weighted } else { 1.0 };
            }
        }
        for j in 0..n {
            (0..n).for_each(|i| f[j * n + i] /= scale[i] * scale[j]);
        }
        scale
    }

    /// The modes on the rows of all pairs, scaled. Collective on the roots.
    pub fn modes(&self, coarse: &Coarse, scale: &[f64]) -> Vec<Vec<f64>> {
        let of_mode = |k: usize| {
            let unit: Vec<f64> = (0..coarse.n).map(|l| f64::from(u8::from(l == k))).collect();
            let own: Vec<f64> = (0..self.coupling.n).map(|j| coarse.at(j, &unit)).collect();
            std::iter::zip(self.gather(&own), scale).map(|(z, s)| z / s).collect()
        };
        (0..coarse.n).map(of_mode).collect()
    }

    /// True on the root that solves.
    pub fn solves(&self) -> bool {
        use mpi::topology::Communicator;
        self.coupling.exchange.comm.is_none_or(|comm| comm.rank() == 0)
    }

    fn ranges(&self) -> impl Iterator<Item = (Range<usize>, usize)> {
        let ends = self.coupling.ends.iter().zip(&self.coupling.ranges).filter(|(end, _)| end.multiplier);
        ends.map(|(end, range)| (range.clone(), self.first[end.pair]))
    }

    /// A row vector's values on the rows of all pairs. Collective on the roots.
    pub fn gather(&self, own: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.first.last().copied().unwrap_or(0)];
        for (range, first) in self.ranges() {
            all[first..first + range.len()].copy_from_slice(&own[range]);
        }
        self.coupling.exchange.sum(&all)
    }

    /// This rank's of the values on the rows of all pairs.
    pub fn own(&self, all: &[f64]) -> Vec<f64> {
        let mut own = vec![0.0; self.coupling.n_rows];
        for (range, first) in self.ranges() {
            let values = &all[first..first + range.len()];
            own[range].copy_from_slice(values);
        }
        own
    }
}
