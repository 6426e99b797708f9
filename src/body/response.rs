//! A body as the driver sees it.
use super::{Body, BodyRow, Condensed, Solver, interface::contact_force, row_values::RowValues};
use crate::{
    error::Result,
    petsc::{Stage, Symmetric},
    schwarz::{Respond, Spring},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::time::Instant;

/// A body's answer on its contact rows, held by every rank of its group; the first rank runs the driver.
///
/// Of a condensed body only the first rank has work; of one that answers by its solver the others
/// [serve](Response::serve) it.
pub enum Response {
    /// By dense algebra on the interface.
    Condensed(Condensed),
    /// By solves of the whole body.
    Solver(Solver),
}

impl Body {
    /// The body's answer on `rows`, which need be given on the first rank only. Collective.
    pub fn respond(&mut self, group: &SimpleCommunicator, rows: Vec<BodyRow>) -> Result<Response> {
        let _stage = Stage::Condense.enter();
        let start = Instant::now();
        let rows = if group.rank() == 0 { self.interface.own_rows(rows) } else { Vec::new() };
        let values = RowValues { rows, ..RowValues::default() };
        let mut response = if self.is_condensed() {
            let condensed = Condensed::new(self, values);
            Response::Condensed(crate::parallel::agree(group, condensed)?)
        } else {
            Response::Solver(Solver::new(self, group, values))
        };
        self.cost.add(|c| c.interface += start.elapsed().as_secs_f64());
        self.refresh(group, &mut response)?;
        Ok(response)
    }

    /// Brings a response up to date after [`Body::set_load`]: the same rows, and the same operators unless the
    /// stiffness has changed. Collective.
    pub fn reload(&mut self, group: &SimpleCommunicator, response: &mut Response) -> Result<()> {
        if response.is_of(self) {
            return self.refresh(group, response);
        }
        let rows = std::mem::take(&mut response.values_mut().rows);
        // The rows are in the interface's own numbers already.
        let values = RowValues { rows, ..RowValues::default() };
        *response = if self.is_condensed() {
            Response::Condensed(crate::parallel::agree(group, Condensed::new(self, values))?)
        } else {
            Response::Solver(Solver::new(self, group, values))
        };
        self.refresh(group, response)
    }

    /// Contact nodal forces of the rows at this rank's owned nodes, N, in global axes. Not collective.
    pub fn contact_forces(&self, response: &Response, force: &[f64]) -> Vec<f64> {
        let dim = self.part.dim;
        let mut owned = vec![0.0; self.part.n_owned * dim];
        let at_interface = contact_force(&response.values().rows, force, self.interface.nodes.len(), dim);
        for (dof, f) in std::iter::zip(self.interface.dofs(dim), at_interface) {
            owned[dof] += f;
        }
        owned
    }

    /// Free displacements and work on the modes of the current load. Collective.
    fn refresh(&mut self, group: &SimpleCommunicator, response: &mut Response) -> Result<()> {
        let dim = self.part.dim;
        let mut soft_work = Vec::new();
        let mut interface = if self.is_condensed() {
            let mut u = self.condensed_load(group)?;
            for mode in self.system.soft().iter().flat_map(|soft| &soft.modes) {
                let works = || std::iter::zip(mode, &u).map(|(m, f)| m * f);
                soft_work.push([works().sum::<f64>(), works().map(f64::abs).sum()]);
            }
            let solved = self.system.interface_factor().map_or(Ok(()), |s| s.solve(&mut u));
            crate::parallel::agree(group, solved)?;
            u
        } else if self.interface.nodes.is_empty() {
            // Nothing touches it: there is nothing to answer.
            Vec::new()
        } else {
            let x = self.system.solve_refined(group, &self.loads.current)?;
            self.interface.dofs(dim).into_iter().map(|dof| x[dof]).collect()
        };
        let constraints = &self.interface.constraints;
        interface = constraints.from_frames(&interface, dim);
        let values = response.values_mut();
        let n_rigid = self.free.modes.len();
        values.mode_interface = match group.rank() {
            0 => (0..n_rigid).map(|k| self.interface.mode(&self.free, k, dim)).collect(),
            _ => vec![Vec::new(); n_rigid],
        };
        if let Some(soft) = self.system.soft() {
            values.mode_interface.extend(soft.modes.iter().map(|mode| constraints.from_frames(mode, dim)));
        }
        values.free = values.at_rows(&interface, dim);
        values.modes = values.mode_interface.iter().map(|mode| values.at_rows(mode, dim)).collect();
        values.free_interface = interface;
        (values.mode_work, values.mode_scale) = (self.mode_work(), self.mode_scale());
        values.mode_work.extend(soft_work.iter().map(|work| work[0]));
        values.mode_scale.extend(soft_work.iter().map(|work| work[1]));
        if let Response::Condensed(condensed) = response {
            condensed.set_springs();
        }
        Ok(())
    }
}

impl Response {
    pub(super) fn values(&self) -> &RowValues {
        match self {
            Response::Condensed(c) => &c.values,
            Response::Solver(s) => &s.parts.values,
        }
    }

    fn values_mut(&mut self) -> &mut RowValues {
        match self {
            Response::Condensed(c) => &mut c.values,
            Response::Solver(s) => &mut s.parts.values,
        }
    }

    fn is_of(&self, body: &Body) -> bool {
        match self {
            Response::Condensed(c) => c.is_of(body),
            Response::Solver(s) => s.is_of(body),
        }
    }

    /// On all ranks but the first: takes part in what the first asks for, until it [finishes](Response::finish).
    pub fn serve(&mut self) -> Result<()> {
        match self {
            Response::Condensed(_) => Ok(()),
            Response::Solver(s) => s.serve(),
        }
    }

    /// On the first rank: lets the others leave [`Response::serve`]. To be called once for every time they serve, even
    /// after an error of another body.
    pub fn finish(&self) {
        if let Response::Solver(s) = self {
            s.finish();
        }
    }

    /// Displacements at the interface nodes, in the order given to the body, under all loads, the row forces and
    /// `alpha` of each free mode, m; on the first rank, the others serving.
    pub fn interface_displacements(&mut self, force: &[f64], alpha: &[f64]) -> Result<Vec<[f64; 3]>> {
        let (u, dim) = self.interface_values(force, alpha)?;
        let interface = match self {
            Response::Condensed(c) => &c.interface,
            Response::Solver(s) => &s.parts.interface,
        };
        Ok(interface.at_given(&u, dim))
    }

    /// The same, each node once, and the number of components.
    fn interface_values(&mut self, force: &[f64], alpha: &[f64]) -> Result<(Vec<f64>, usize)> {
        let (u, dim) = match self {
            Response::Condensed(c) => (c.interface_displacements(force)?, c.dim),
            Response::Solver(s) => (s.interface_displacements(force)?, s.dim()),
        };
        Ok((self.values().complete(u, alpha), dim))
    }
}

impl Respond for Response {
    fn n_rows(&self) -> usize {
        self.values().rows.len()
    }

    fn free(&self) -> &[f64] {
        &self.values().free
    }

    fn force_step(&mut self, force: &[f64]) -> Result<Vec<f64>> {
        match self {
            Response::Condensed(c) => c.push(force),
            Response::Solver(s) => s.force_step(force),
        }
    }

    fn displacement_step(&mut self, inward: &[f64], active: &[bool]) -> Result<Vec<f64>> {
        match self {
            Response::Condensed(c) => c.prescribe(inward, active),
            Response::Solver(s) => s.displacement_step(inward, active),
        }
    }

    fn unilateral_step(&mut self, gap: &[f64], chosen: &[bool], held: &[f64]) -> Result<Option<Vec<f64>>> {
        match self {
            Response::Condensed(c) => c.unilateral_step(gap, chosen, held),
            Response::Solver(_) => Ok(None),
        }
    }

    fn distances(&mut self, force: &[f64]) -> Result<Vec<f64>> {
        let (u, dim) = self.interface_values(force, &[])?;
        Ok(self.values().rows.iter().map(|row| row.distance(&u, dim)).collect())
    }

    fn compliance(&self) -> Option<&Symmetric> {
        match self {
            Response::Condensed(c) => Some(c.compliance()),
            Response::Solver(_) => None,
        }
    }

    fn condensation(&self) -> f64 {
        match self {
            Response::Condensed(c) => c.operations(),
            Response::Solver(_) => 0.0,
        }
    }

    fn modes(&self) -> &[Vec<f64>] {
        &self.values().modes
    }

    fn mode_work(&self) -> &[f64] {
        &self.values().mode_work
    }

    fn mode_scale(&self) -> &[f64] {
        &self.values().mode_scale
    }

    fn springs(&self) -> &[Spring] {
        &self.values().springs
    }
}
