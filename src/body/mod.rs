//! A body: its share of the mesh, its stiffness matrix and solver, its loads and supports, and its answer to contact.
//!
//! Knows nothing of contact but where it may act: it takes forces or displacements on contact rows and answers with
//! the other, by its solver or condensed to its interface. Every method that needs the rank group says "collective".
mod assembly;
mod compliance;
mod condensed;
mod constraint;
mod dirichlet;
mod estimate;
mod interface;
mod load;
mod recovery;
mod region;
mod response;
mod rigid;
mod solver;
mod system;

pub use compliance::{Compliance, ContactRow};
pub use condensed::Condensed;
pub use constraint::{Constraints, NodeConstraint};
pub use estimate::{Estimate, ResponseKind, condense_estimate};
pub use interface::{BodyRow, Interface};
pub use load::LoadFactors;
pub use recovery::{Balance, Fields};
pub use region::{Region, find_facets, mesh_extent};
pub use response::Response;
pub use rigid::{Fixing, FreeModes, RigidMode, free_motions};
pub use solver::Solver;

use crate::{
    case::{Analysis, BodyCase, Temperature},
    element::{ElementKind, SolidElement},
    error::{Error, Result},
    material::LinearElastic,
    mesh::{Mesh, MeshPart, Numbering, give_to_first, partition},
    parallel::agree,
    petsc::{Gather, Vector},
};
use assembly::{Assembled, Model};
use load::Loads;
use mpi::{topology::SimpleCommunicator, traits::*};
use rstar::{RTree, primitives::GeomWithData};
use std::{rc::Rc, time::Instant};
use system::{Setting, SharedCost, System};

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
    system: Rc<System>,
    /// Entries of a global vector for all nodes of the part.
    ghosts: Gather,
}

/// What the body's solver has cost so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cost {
    /// Set-ups of the solver: factorisations of the stiffness matrix with a direct one.
    pub factorisations: usize,
    /// Solves with the stiffness matrix, or with its interior block (right-hand sides).
    pub solves: usize,
    /// Factorisations of interface operators for displacement steps.
    pub interface_factorisations: usize,
    /// Seconds of assembly.
    pub assemble: f64,
    /// Seconds of factorisation.
    pub factor: f64,
    /// Seconds of making and factorising interface operators.
    pub interface: f64,
}

/// The element of each kind, with the formulation the case asks for.
#[derive(Debug, Clone, Copy)]
pub struct Elements([Option<SolidElement>; ElementKind::ALL.len()]);

impl Elements {
    /// Resolves the formulation for every kind of cell in the mesh.
    pub fn new(mesh: &Mesh, case: &BodyCase) -> Result<Elements> {
        let mut elements = [None; ElementKind::ALL.len()];
        for cell in &mesh.cells {
            let slot = &mut elements[cell.kind as usize];
            if slot.is_none() {
                let element = SolidElement::new(cell.kind, case.formulation);
                *slot = Some(element.map_err(|text| case.origin.error(text))?);
            }
        }
        Ok(Elements(elements))
    }

    /// The element of a kind that occurs in the mesh.
    pub fn of(&self, kind: ElementKind) -> SolidElement {
        self.0[kind as usize].expect("the kinds of all cells are resolved")
    }
}

impl Body {
    /// Builds the body on its rank group from its whole mesh: partition, assembly, factorisation.
    ///
    /// `interface`: mesh nodes that contact may reach, the same on all ranks; rows name them by their position in the
    /// list. The first rank owns them. Collective.
    pub fn new(
        case: &BodyCase,
        analysis: Analysis,
        mesh: &Mesh,
        group: &SimpleCommunicator,
        interface: &[u32],
        response: ResponseKind,
    ) -> Result<Body> {
        let start = Instant::now();
        let parts = group.size() as usize;
        // The same on every rank of the group, errors included.
        let elements = Elements::new(mesh, case)?;
        let mut owners = partition(mesh, parts)
            .map_err(|e| case.origin.error(format!("cannot be spread over {parts} ranks: {e}")))?;
        give_to_first(mesh, &mut owners, interface);
        // METIS draws from the C library's random numbers: only one rank's answer may count.
        group.process_at_rank(0).broadcast_into(&mut owners[..]);
        let numbering = Numbering::new(mesh, &owners, parts);
        let part = Rc::new(MeshPart::with_numbering(mesh, &owners, group.rank() as u32, &numbering));
        let temperature = case.temperature.as_ref().map(|t| temperatures(t, &part.points)).transpose();
        // From here on ranks see different nodes: an error of one is agreed before the next collective call.
        let temperature = agree(group, temperature)?.map(Rc::new);
        let mut constraints = Constraints::new(case, mesh)?;
        let free = FreeModes::new(mesh, &constraints);
        let fixings = free.fixings(mesh, &constraints, interface);
        constraints.fix(&fixings);
        let interface = Interface::new(interface, mesh, &constraints, &numbering, group);
        let model = Model {
            part: part.clone(),
            elements,
            law: LinearElastic::new(&case.material, analysis),
            constraints: constraints.of_part(&part),
            thickness: analysis.thickness(),
        };
        let dim = part.dim;
        let condensed =
            response.is_condensed(&case.name, part.n_global_nodes * dim, interface.nodes.len() * dim, dim)?;
        let set_up = start.elapsed().as_secs_f64();

        let dofs: Vec<i32> =
            part.global.iter().flat_map(|&g| (0..dim).map(move |c| (g as usize * dim + c) as i32)).collect();
        let ghosts = Gather::new(&Vector::zeros(group, part.n_owned * dim)?, &dofs)?;
        let parameters = model.parameters(temperature.as_ref().map(|t| &t[..]), &model.constraints);
        let external = parameters.external_forces(case, mesh, group)?;
        let Assembled { matrix, thermal, prescribed } = parameters.stiffness(group)?;
        let cost = SharedCost::default();
        cost.add(|c| c.assemble = start.elapsed().as_secs_f64() - set_up);
        let setting = Setting { body: case.name.clone(), prefix: options_prefix(&case.name), dim };
        let system = System::new(group, matrix, &interface, setting, condensed, &cost)?;
        let loads = Loads {
            factors: LoadFactors::default(),
            external,
            thermal,
            prescribed,
            mode_work: Vec::new(),
            mode_scale: Vec::new(),
            current: Vec::new(),
            condensed: None,
        };
        let mut body = Body {
            name: case.name.clone(),
            part,
            numbering,
            free: Rc::new(free),
            fixings: Rc::new(fixings),
            interface: Rc::new(interface),
            cost,
            model: Rc::new(model),
            given_temperature: temperature.clone(),
            temperature,
            loads,
            system: Rc::new(system),
            ghosts,
        };
        [body.loads.mode_work, body.loads.mode_scale] = body.work_on_modes(group);
        body.combine_loads();
        Ok(body)
    }

    /// Number of space dimensions.
    pub fn dim(&self) -> usize {
        self.part.dim
    }

    /// Unknowns of the whole body, supported ones included.
    pub fn n_dofs(&self) -> usize {
        self.part.n_global_nodes * self.part.dim
    }

    /// What it has cost so far, its responses included.
    pub fn cost(&self) -> Cost {
        self.cost.get()
    }

    /// True if it answers by its Schur complement, false if by its solver.
    pub fn is_condensed(&self) -> bool {
        self.system.is_condensed()
    }

    /// Displacements at the owned nodes, m, under all loads, the nodal forces `contact` (owned nodes, `dim` components
    /// each, N), and with `alpha` of each free rigid mode (given on the first rank). Collective.
    ///
    /// A condensed body recovers its interior with one solve. A free body's forces must balance.
    pub fn displacements(
        &mut self,
        group: &SimpleCommunicator,
        contact: &[f64],
        alpha: &[f64],
    ) -> Result<Vec<f64>> {
        let mut u = if self.system.is_condensed() {
            let mut interface = self.condensed_load(group)?;
            let contact = self.model.constraints.to_frames(contact, self.part.dim);
            let dofs = self.interface.dofs(self.part.dim);
            std::iter::zip(&mut interface, dofs).for_each(|(f, dof)| *f += contact[dof]);
            let solved = self.system.interface_factor().map_or(Ok(()), |s| s.solve(&mut interface));
            agree(group, solved)?;
            let rhs: Vec<f64> = std::iter::zip(&self.loads.current, contact).map(|(f, c)| f + c).collect();
            let x = self.system.recover(group, &rhs, &interface)?;
            let x = self.system.refine(group, &rhs, x)?;
            self.model.constraints.from_frames(&x, self.part.dim)
        } else {
            self.solve(group, contact)?
        };
        let mut alpha = alpha.to_vec();
        crate::parallel::broadcast(group, 0, &mut alpha);
        for (node, u) in u.chunks_exact_mut(self.part.dim).enumerate() {
            for (k, alpha) in alpha.iter().enumerate() {
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
        Ok(constraints.from_frames(&self.system.solve_refined(group, &rhs)?, self.part.dim))
    }

    /// Values at all nodes of the part (owned, local, halo), from the values at the owned nodes. Collective.
    pub fn with_ghosts(&self, group: &SimpleCommunicator, owned: &[f64]) -> Result<Vec<f64>> {
        let v = Vector::zeros(group, owned.len())?;
        v.set(owned)?;
        self.ghosts.get(&v)
    }
}

/// Prefix of a body's PETSc options: `-body_<name>_ksp_type cg`.
pub fn options_prefix(name: &str) -> String {
    format!("body_{name}_")
}

/// Temperature at points, K.
fn temperatures(temperature: &Temperature, points: &[[f64; 3]]) -> Result<Vec<f64>> {
    match temperature {
        Temperature::Field(scalar) => points
            .iter()
            .map(|x| {
                let value = scalar.at(x);
                if value.is_finite() {
                    return Ok(value);
                }
                Err(Error::input(format!("the temperature at ({}, {}) is not finite", x[0], x[1])))
            })
            .collect(),
        Temperature::Nodal { values, origin } => {
            let given = values.iter().map(|&(x, value)| GeomWithData::new(x, value)).collect();
            let extent = mesh_extent(points);
            let tree = RTree::bulk_load(given);
            points
                .iter()
                .map(|x| match tree.nearest_neighbor_iter_with_distance_2(x).next() {
                    Some((node, d2)) if d2.sqrt() <= 1e-6 * extent => Ok(node.data),
                    _ => Err(origin.error(format!("no temperature for the node at ({}, {})", x[0], x[1]))),
                })
                .collect()
        }
    }
}
