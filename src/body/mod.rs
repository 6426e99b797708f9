//! A body: its share of the mesh, its stiffness matrix and solver, its loads and supports.
//!
//! Knows nothing of contact: it takes nodal forces on observed nodes and answers with displacements there. Every
//! method that needs the rank group says "collective".
mod assembly;
mod compliance;
mod constraint;
mod recovery;
mod region;
mod rigid;

pub use compliance::{Compliance, ContactRow};
pub use constraint::{Constraints, NodeConstraint};
pub use recovery::{Balance, Fields};
pub use region::{Region, find_facets, mesh_extent};
pub use rigid::free_motions;

use crate::{
    case::{Analysis, BodyCase, Temperature},
    element::{ElementKind, SolidElement},
    error::{Error, Result},
    material::LinearElastic,
    mesh::{Mesh, MeshPart, Numbering, partition},
    parallel::agree,
    petsc::{Gather, Ksp, Matrix, Vector},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use rstar::{RTree, primitives::GeomWithData};
use std::time::Instant;

/// One body on its rank group.
pub struct Body {
    /// Name from the case.
    pub name: String,
    /// This rank's share of the mesh.
    pub part: MeshPart,
    /// Owner and global number of every node of the mesh.
    pub numbering: Numbering,
    /// Counters and wall seconds of this rank.
    pub cost: Cost,
    thickness: f64,
    elements: Elements,
    law: LinearElastic,
    /// Temperature at this rank's nodes, K.
    temperature: Option<Vec<f64>>,
    /// Supports of this rank's nodes.
    constraints: Constraints,
    /// External nodal forces at the owned nodes, N; without contact, without initial strain.
    external: Vec<f64>,
    /// Right-hand side without contact forces, in the nodes' frames.
    load: Vec<f64>,
    matrix: Matrix,
    ksp: Ksp,
    /// Entries of a global vector for all nodes of the part.
    ghosts: Gather,
}

/// What the body's solver has cost so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cost {
    /// Set-ups of the solver: factorisations of the stiffness matrix with a direct one.
    pub factorisations: usize,
    /// Solves with the stiffness matrix (right-hand sides).
    pub solves: usize,
    /// Seconds of assembly.
    pub assemble: f64,
    /// Seconds of factorisation.
    pub factor: f64,
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
    /// Builds the body on its rank group from its whole mesh: partition, assembly, factorisation. Collective.
    pub fn new(case: &BodyCase, analysis: Analysis, mesh: &Mesh, group: &SimpleCommunicator) -> Result<Body> {
        let start = Instant::now();
        let parts = group.size() as usize;
        // The same on every rank of the group, errors included.
        let elements = Elements::new(mesh, case)?;
        let mut owners = partition(mesh, parts)
            .map_err(|e| case.origin.error(format!("cannot be spread over {parts} ranks: {e}")))?;
        // METIS draws from the C library's random numbers: only one rank's answer may count.
        group.process_at_rank(0).broadcast_into(&mut owners[..]);
        let numbering = Numbering::new(mesh, &owners, parts);
        let part = MeshPart::with_numbering(mesh, &owners, group.rank() as u32, &numbering);
        let temperature = case.temperature.as_ref().map(|t| temperatures(t, &part.points)).transpose();
        // From here on ranks see different nodes: an error of one is agreed before the next collective call.
        let temperature = agree(group, temperature)?;
        let constraints = Constraints::new(case, mesh)?.of_part(&part);
        let law = LinearElastic::new(&case.material, analysis);
        let set_up = start.elapsed().as_secs_f64();

        let dim = part.dim;
        let model = Vector::zeros(group, part.n_owned * dim)?;
        let dofs: Vec<i32> =
            part.global.iter().flat_map(|&g| (0..dim).map(move |c| (g as usize * dim + c) as i32)).collect();
        let ghosts = Gather::new(&model, &dofs)?;
        let thickness = analysis.thickness();
        let parameters = assembly::Parameters {
            part: &part,
            elements: &elements,
            law: &law,
            temperature: temperature.as_deref(),
            constraints: &constraints,
            thickness,
        };
        let external = parameters.external_forces(case, mesh, group)?;
        let (matrix, load) = parameters.stiffness(group, &external)?;
        matrix.set_rigid_modes(group, &part.points[..part.n_owned], dim)?;
        let assemble = start.elapsed().as_secs_f64() - set_up;

        let factoring = Instant::now();
        let ksp = Ksp::new(group, &matrix, &options_prefix(&case.name))?;
        ksp.set_up().map_err(|e| {
            Error::internal(format!("body '{}': the stiffness matrix cannot be factorised: {e}", case.name))
        })?;
        let cost = Cost { factorisations: 1, solves: 0, assemble, factor: factoring.elapsed().as_secs_f64() };
        Ok(Body {
            name: case.name.clone(),
            part,
            numbering,
            cost,
            thickness,
            elements,
            law,
            temperature,
            constraints,
            external,
            load,
            matrix,
            ksp,
            ghosts,
        })
    }

    /// Number of space dimensions.
    pub fn dim(&self) -> usize {
        self.part.dim
    }

    /// Unknowns of the whole body, supported ones included.
    pub fn n_dofs(&self) -> usize {
        self.part.n_global_nodes * self.part.dim
    }

    /// Solves under all loads and the nodal forces `contact` (owned nodes, `dim` components each, N). Returns the
    /// displacements at the owned nodes, m. Collective.
    ///
    /// One step of iterative refinement follows the solve, which makes the answer independent of the factorisation's
    /// round-off and so of the number of ranks.
    pub fn solve(&mut self, group: &SimpleCommunicator, contact: &[f64]) -> Result<Vec<f64>> {
        let n = self.load.len();
        let [b, x, r, dx] = [(); 4].map(|()| Vector::zeros(group, n));
        let (b, x, r, dx) = (b?, x?, r?, dx?);
        let contact = self.constraints.to_frames(contact, self.part.dim);
        let rhs: Vec<f64> = std::iter::zip(&self.load, contact).map(|(f, c)| f + c).collect();
        b.set(&rhs)?;
        self.ksp.solve(&b, &x)?;
        self.matrix.times(&x, &r)?;
        r.set(&std::iter::zip(&rhs, r.to_vec()?).map(|(b, ax)| b - ax).collect::<Vec<_>>())?;
        self.ksp.solve(&r, &dx)?;
        self.cost.solves += 2;
        let solution: Vec<f64> = std::iter::zip(x.to_vec()?, dx.to_vec()?).map(|(x, dx)| x + dx).collect();
        Ok(self.constraints.from_frames(&solution, self.part.dim))
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
