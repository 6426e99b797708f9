//! A body: its share of the mesh, its stiffness matrix and solver, its loads and supports, and its answer to contact.
//!
//! Knows nothing of contact but where it may act: it takes forces or displacements on contact rows and answers with
//! the other, by its solver or condensed to its interface. Every method that needs the rank group says "collective".
mod assembly;
mod build;
mod condensed;
mod constraint;
mod cost;
mod dirichlet;
mod elements;
mod entries;
mod estimate;
mod hanging;
mod interface;
mod laws;
mod load;
mod loading;
mod motion;
mod newton;
mod observed;
mod options;
mod parts;
mod points;
mod recovery;
mod region;
mod response;
mod rigid;
mod rounding;
mod row_values;
mod soft;
mod solver;
mod system;
mod temperature;
mod zone;
mod zoned;

pub use build::AssembledBody;
pub use condensed::Condensed;
pub use constraint::{Constraints, Fixing, NodeConstraint};
pub use cost::Cost;
pub use elements::Elements;
pub use estimate::{Estimate, ResponseKind, condense_estimate, largest_zone, zone_estimate, zone_whole};
pub use interface::{BodyRow, Interface};
pub use load::LoadFactors;
pub use motion::{name_bodies, name_motion};
pub use options::options_prefix;
pub use points::{Extent, Unbalanced};
pub use recovery::{Balance, Fields, PlasticFields, PointStresses};
pub use region::{Region, find_facets, mesh_extent};
pub use response::Response;
pub use rigid::{FreeModes, RigidMode, free_motions};
pub use solver::Solver;

use crate::{
    error::Result,
    mesh::{MeshPart, Numbering},
    parallel::agree,
    petsc::{Gather, Vector},
};
use assembly::Model;
use cost::SharedCost;
use hanging::Hanging;
use load::Loads;
use mpi::topology::SimpleCommunicator;
use points::Points;
use soft::Split;
use std::rc::Rc;
use system::System;
use zone::Zone;

/// One body on its rank group.
pub struct Body {
    /// Name from the case.
    pub name: String,
    /// This rank's share of the mesh.
    pub part: Rc<MeshPart>,
    /// Owner and global number of every node of the mesh.
    pub numbering: Numbering,
    /// Rigid motions that the supports leave free; fixings hold them in the stiffness matrix.
    pub free: Rc<FreeModes>,
    fixings: Rc<Vec<Fixing>>,
    /// Where contact may act.
    pub interface: Rc<Interface>,
    cost: SharedCost,
    model: Rc<Model>,
    /// Temperature at this rank's nodes at factor 1, K.
    given_temperature: Option<Rc<Vec<f64>>>,
    /// The same at the current factor.
    temperature: Option<Rc<Vec<f64>>>,
    loads: Loads,
    /// Of a body that yields.
    points: Option<Points>,
    /// Of a body on one rank that yields and answers by its Schur complement.
    zone: Option<Zone>,
    /// True while that is what the system is of.
    zone_acts: bool,
    system: Rc<System>,
    split: Option<Split>,
    /// Entries of a global vector for all nodes of the part.
    ghosts: Gather,
}

/// Whether displacements are refined once more where the factorisation's round-off is seen in their residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accuracy {
    /// Results.
    Refined,
    /// What an estimate is made of.
    AsSolved,
    /// What the next iteration of a body that yields is made of: elsewhere than in its zone, if that alone is iterated, they are nought.
    Iterated,
}

impl Body {
    /// Number of space dimensions.
    pub fn dim(&self) -> usize {
        self.part.dim
    }

    /// Unknowns of the whole body, supported ones included.
    pub fn n_dofs(&self) -> usize {
        self.part.n_global_nodes * self.part.dim
    }

    /// Number of free modes: rigid ones and, on the first rank, soft ones.
    pub fn n_modes(&self) -> usize {
        self.free.modes.len() + self.system.soft().map_or(0, |soft| soft.modes.len())
    }

    /// What a free mode is called.
    pub fn mode_name(&self, k: usize) -> String {
        match self.free.modes.get(k) {
            Some(mode) => mode.name.clone(),
            None => format!("bending {}", k + 1 - self.free.modes.len()),
        }
    }

    /// What it has cost so far, its responses included.
    pub fn cost(&self) -> Cost {
        self.cost.get()
    }

    /// What the options of its solver say and is not done, for the user; the same on all ranks of the group.
    pub fn notes(&self) -> &[String] {
        self.system.notes()
    }

    /// True if it answers by its Schur complement, false if by its solver.
    pub fn is_condensed(&self) -> bool {
        self.system.is_condensed()
    }

    /// Displacements at the owned nodes, m, under all loads, the nodal forces `contact` (owned nodes, `dim` components
    /// each, N), and with `alpha` of each free mode (given on the first rank). Collective.
    ///
    /// A condensed body recovers its interior with one solve, as accurate as asked for. A free body's forces must balance.
    pub fn displacements(
        &mut self,
        group: &SimpleCommunicator,
        contact: &[f64],
        alpha: &[f64],
        accuracy: Accuracy,
    ) -> Result<Vec<f64>> {
        let mut u = if self.system.is_condensed() {
            let mut interface = self.condensed_load(group)?;
            let contact = self.model.constraints.to_frames(contact, self.part.dim);
            let dofs = self.interface.dofs(self.part.dim);
            std::iter::zip(&mut interface, dofs).for_each(|(f, dof)| *f += contact[dof]);
            let solved = self.system.interface_factor().map_or(Ok(()), |s| s.solve(&mut interface));
            agree(group, solved)?;
            if let Some(soft) = self.system.soft() {
                for (mode, alpha) in std::iter::zip(&soft.modes, alpha.iter().skip(self.free.modes.len())) {
                    std::iter::zip(&mut interface, mode).for_each(|(u, m)| *u += alpha * m);
                }
            }
            let rhs: Vec<f64> = std::iter::zip(&self.loads.current, contact).map(|(f, c)| f + c).collect();
            let x = match accuracy {
                Accuracy::Iterated => self.system.recover_zone(group, &rhs, &interface)?,
                _ => self.system.recover(group, &rhs, &interface)?,
            };
            // What yields is not linear: the next iteration refines it.
            let is_linear = self.points.as_ref().is_none_or(Points::is_elastic);
            let x = match accuracy {
                Accuracy::Refined if is_linear => self.system.refine(group, &rhs, x)?,
                _ => x,
            };
            self.fill_slaves(group, self.model.constraints.from_frames(&x, self.part.dim))?
        } else {
            self.solve(group, contact)?
        };
        let mut alpha = alpha.to_vec();
        crate::parallel::broadcast(group, 0, &mut alpha);
        for (node, u) in u.chunks_exact_mut(self.part.dim).enumerate() {
            for (k, alpha) in alpha.iter().enumerate().take(self.free.modes.len()) {
                let mode = self.free.at(k, self.part.original[node], &self.part.points[node]);
                std::iter::zip(&mut *u, mode).for_each(|(u, m)| *u += alpha * m);
            }
        }
        Ok(u)
    }

    /// Solves under all loads and the nodal forces `contact` (owned nodes, `dim` components each, N). Returns the
    /// displacements at the owned nodes, m, free modes held by the fixings. Collective.
    pub fn solve(&mut self, group: &SimpleCommunicator, contact: &[f64]) -> Result<Vec<f64>> {
        let constraints = &self.model.constraints;
        let contact = constraints.to_frames(contact, self.part.dim);
        let rhs: Vec<f64> = std::iter::zip(&self.loads.current, contact).map(|(f, c)| f + c).collect();
        let x = self.system.solve(group, &rhs)?;
        let u = constraints.from_frames(&self.system.refine(group, &rhs, x)?, self.part.dim);
        self.fill_slaves(group, u)
    }

    /// Displacements at the owned nodes with those of the slaves, from the others. Collective.
    fn fill_slaves(&self, group: &SimpleCommunicator, mut u: Vec<f64>) -> Result<Vec<f64>> {
        if !self.part.hanging {
            return Ok(u);
        }
        let (all, dim) = (self.with_ghosts(group, &u)?, self.part.dim);
        for slave in Hanging::of(&self.part).among(self.part.n_owned) {
            for c in 0..dim {
                let from = |&(master, weight): &(u32, f64)| weight * all[master as usize * dim + c];
                u[slave.node as usize * dim + c] = slave.masters.iter().map(from).sum();
            }
        }
        Ok(u)
    }

    /// Values at all nodes of the part (owned, local, halo), from the values at the owned nodes. Collective.
    pub fn with_ghosts(&self, group: &SimpleCommunicator, owned: &[f64]) -> Result<Vec<f64>> {
        let v = Vector::zeros(group, owned.len())?;
        v.set(owned)?;
        self.ghosts.get(&v)
    }
}
