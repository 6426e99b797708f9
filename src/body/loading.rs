//! What acts on a body, set and worked out.
use super::{
    Body, LoadFactors,
    assembly::Assembled,
    load::{Loads, ModeWork, Part},
    points::Points,
    system::System,
    zone::Zone,
};
use crate::{
    error::Result,
    parallel::{self, agree},
    petsc::Stage,
};
use mpi::topology::SimpleCommunicator;
use std::{rc::Rc, time::Instant};

impl Body {
    /// Sets the factors on loads, prescribed displacements and temperature. True if they have changed: responses must
    /// then be [reloaded](Body::reload). The stiffness is factorised again only if it varies with a temperature that
    /// changes. Collective.
    pub fn set_load(&mut self, factors: &LoadFactors, group: &SimpleCommunicator) -> Result<bool> {
        if *factors == self.loads.factors {
            return Ok(false);
        }
        let factor = factors.on_temperature(self.loads.temperature_path);
        let heated = factor != self.loads.heat && self.given_temperature.is_some();
        self.loads.factors = factors.clone();
        if heated {
            self.loads.heat = factor;
            let laws = &self.model.laws;
            let scaled = |&t: &f64| laws.scaled_temperature(t, factor);
            self.temperature =
                self.given_temperature.as_ref().map(|given| Rc::new(given.iter().map(scaled).collect()));
            if let Some(points) = &mut self.points {
                // The next linearisation does it.
                if self.model.laws.stiffness_varies() {
                    points.forget_elastic();
                    self.zone.iter_mut().for_each(Zone::dissolve);
                }
            } else if !laws.expands_linearly() {
                self.reassemble(group)?;
            }
        }
        self.combine_loads();
        Ok(true)
    }

    /// At the current temperatures; factorises if the stiffness has changed. Collective.
    fn reassemble(&mut self, group: &SimpleCommunicator) -> Result<()> {
        let kept = (!self.model.laws.stiffness_varies()).then(|| self.system.clone());
        self.assemble_again(group, kept)
    }

    /// Assembles at the current temperatures and laws of the points, and factorises, unless a system is given that has kept its
    /// stiffness. Collective.
    pub(super) fn assemble_again(
        &mut self,
        group: &SimpleCommunicator,
        kept: Option<Rc<System>>,
    ) -> Result<()> {
        let stage = Stage::Assemble.enter();
        let start = Instant::now();
        let temperature = self.temperature.as_ref().map(|t| &t[..]);
        let Assembled { matrix, thermal, prescribed } =
            self.model.assemble(temperature, self.points.as_ref(), group)?;
        self.loads.thermal = thermal;
        self.loads.prescribed = prescribed;
        self.cost.add(|c| c.assemble += start.elapsed().as_secs_f64());
        drop(stage);
        if let Some(kept) = kept {
            self.system = kept;
            return Ok(());
        }
        let split = self.split.as_ref();
        let renewable = self.points.as_mut().filter(|_| self.system.is_condensed());
        let built = match renewable.and_then(Points::renewable) {
            Some(renewable) => self.system.renewed(group, matrix, renewable, &self.interface, split),
            None => {
                let (condensed, setting) = (self.system.is_condensed(), self.system.setting());
                System::new(group, matrix, &self.interface, setting, condensed, split, &self.cost)
            }
        };
        self.system = Rc::new(agree(group, built)?);
        Ok(())
    }

    /// Right-hand side of the current factors. Not collective.
    pub(super) fn combine_loads(&mut self) {
        let Loads { factors, thermal, temperature_path, .. } = &self.loads;
        let heat = match self.model.laws.expands_linearly() && self.points.is_none() {
            true => factors.on_temperature(*temperature_path),
            false => 1.0,
        };
        let external = self.model.constraints.to_frames(&self.loads.external_at(factors), self.part.dim);
        let prescribed = self.loads.prescribed_at(factors);
        let parts = external.iter().zip(thermal).zip(&prescribed);
        self.loads.current = parts.map(|((e, t), p)| e + heat * t + p).collect();
        self.loads.condensed = None;
    }

    /// Work of the current loads on the free rigid modes, J: prescribed displacements and initial strains do none.
    pub(super) fn mode_work(&self) -> Vec<f64> {
        self.sum_over_modes(|part, factor| part.work.iter().map(|e| factor * e).collect())
    }

    /// The current right-hand side condensed to the interface, on the first rank; empty elsewhere. Collective.
    pub(super) fn condensed_load(&mut self, group: &SimpleCommunicator) -> Result<Vec<f64>> {
        if self.loads.condensed.is_none() {
            self.loads.condensed = Some(self.system.condense(group, &self.loads.current)?);
        }
        Ok(self.loads.condensed.clone().unwrap_or_default())
    }

    /// Sum of the absolute works of the loads' nodal forces on each free rigid mode, J: what round-off is measured against.
    pub(super) fn mode_scale(&self) -> Vec<f64> {
        self.sum_over_modes(|part, factor| part.scale.iter().map(|e| factor.abs() * e).collect())
    }

    /// Sum over the parts of the loads of a number for each free rigid mode.
    fn sum_over_modes(&self, of: impl Fn(&ModeWork, f64) -> Vec<f64>) -> Vec<f64> {
        let mut sum = vec![0.0; self.free.modes.len()];
        for part in &self.loads.mode_work {
            let of_part = of(part, self.loads.factors.on_loads(part.path));
            std::iter::zip(&mut sum, of_part).for_each(|(sum, value)| *sum += value);
        }
        sum
    }

    /// Work at factor 1 of the external forces on each mode, by parts. Collective.
    pub(super) fn work_on_modes(&self, group: &SimpleCommunicator) -> Vec<ModeWork> {
        let of_part = |part: &Part| {
            let [work, scale] = self.work_of(&part.forces, group);
            ModeWork { path: part.path, work, scale }
        };
        self.loads.external.iter().map(of_part).collect()
    }

    /// Work of nodal forces on each mode, and the sum of the absolute works, J. Collective.
    fn work_of(&self, forces: &[f64], group: &SimpleCommunicator) -> [Vec<f64>; 2] {
        let (part, dim) = (&self.part, self.part.dim);
        let n = self.free.modes.len();
        let mut work = vec![0.0; 2 * n];
        for (i, force) in forces.chunks_exact(dim).enumerate() {
            for k in 0..n {
                let mode = self.free.at(k, part.original[i], &part.points[i]);
                for (f, m) in std::iter::zip(force, mode) {
                    work[k] += f * m;
                    work[n + k] += (f * m).abs();
                }
            }
        }
        let work = parallel::sum(group, &work);
        [work[..n].to_vec(), work[n..].to_vec()]
    }
}
