//! Stiffness matrix and load vector.
use super::{
    Constraints, Elements, NodeConstraint,
    entries::{Entries, Lists},
    hanging::{Hanging, Reduced},
    laws::Laws,
    load::Part,
    points::Points,
    region,
};
use crate::vector::larger;
use crate::{
    case::{BodyCase, LoadKind, Region},
    element::{MAX_NODES, body_load, facet_load, facet_weights},
    error::{Error, Result},
    mesh::{Cell, Facet, Mesh, MeshPart},
    parallel::agree,
    petsc::{Matrix, Vector},
};
use mpi::topology::SimpleCommunicator;
use std::{
    collections::{BTreeSet, HashSet},
    rc::Rc,
};

/// Largest number of unknowns of an element.
const MAX_DOFS: usize = 3 * MAX_NODES;

/// What a body is made of, the same from its first to its last load.
pub struct Model {
    pub part: Rc<MeshPart>,
    pub elements: Elements,
    pub laws: Laws,
    /// Supports and fixings of this rank's nodes.
    pub constraints: Constraints,
    /// The same with the displacements that follow a path, all others zero.
    pub on_paths: Vec<(usize, Constraints)>,
    pub thickness: f64,
}

impl Model {
    /// The body at nodal temperatures, with the laws of its points if it yields: its matrix, and its right-hand sides by the paths that
    /// they follow. Collective.
    pub fn assemble(
        &self,
        temperature: Option<&[f64]>,
        points: Option<&Points>,
        group: &SimpleCommunicator,
    ) -> Result<Assembled> {
        let Stiffness { matrix, thermal, prescribed, diagonal } =
            Parameters { points, ..self.parameters(temperature, &self.constraints) }.stiffness(group)?;
        let mut parts = vec![Part { path: None, forces: prescribed }];
        for (path, supports) in &self.on_paths {
            let parameters = Parameters { points, ..self.parameters(temperature, supports) };
            let forces = parameters.prescribed_forces(group, diagonal)?;
            parts.push(Part { path: Some(*path), forces });
        }
        Ok(Assembled { matrix, thermal, prescribed: parts })
    }

    /// Forces of the initial strains and stresses of its points at the owned nodes, N, in the nodes' frames. Collective.
    pub fn forces_of_points(
        &self,
        temperature: Option<&[f64]>,
        points: &Points,
        group: &SimpleCommunicator,
    ) -> Result<Vec<f64>> {
        let parameters = self.parameters(temperature, &self.constraints);
        let parameters = Parameters { points: Some(points), stiff: false, ..parameters };
        let Contributions { thermal, .. } = agree(group, parameters.element_arrays(group, |_, _| true))?;
        parameters.sum_to_owners(group, &thermal)
    }

    /// What chosen cells of a body on one rank contribute at these laws of its points.
    pub fn share(
        &self,
        temperature: Option<&[f64]>,
        points: &Points,
        chosen: impl Fn(usize) -> bool + Copy,
        group: &SimpleCommunicator,
    ) -> Result<Share> {
        let with =
            |constraints| Parameters { points: Some(points), ..self.parameters(temperature, constraints) };
        let mut share = with(&self.constraints).share(group, chosen)?;
        for (path, supports) in &self.on_paths {
            let forces = with(supports).forces_of_supports(group, chosen)?;
            share.prescribed.push(Part { path: Some(*path), forces });
        }
        Ok(share)
    }

    /// Held unknowns at the owned nodes, slaves among them, and of each path the displacements there.
    pub fn held(&self) -> (Vec<usize>, Vec<Vec<(usize, f64)>>) {
        let (part, dim) = (&self.part, self.part.dim);
        let of = |constraints| self.parameters(None, constraints).held().collect::<Vec<_>>();
        let values: Vec<Vec<(usize, f64)>> = std::iter::once(&self.constraints)
            .chain(self.on_paths.iter().map(|(_, supports)| supports))
            .map(of)
            .collect();
        let slaves = Hanging::of(part).among(part.n_owned);
        let slaves = slaves.flat_map(|slave| (0..dim).map(move |c| slave.node as usize * dim + c));
        (values[0].iter().map(|(i, _)| *i).chain(slaves).collect(), values)
    }

    /// What assembly needs, at nodal temperatures, with the body's own or other constraints.
    pub fn parameters<'a>(
        &'a self,
        temperature: Option<&'a [f64]>,
        constraints: &'a Constraints,
    ) -> Parameters<'a> {
        Parameters {
            part: &self.part,
            elements: &self.elements,
            laws: &self.laws,
            points: None,
            stiff: true,
            temperature,
            constraints,
            thickness: self.thickness,
        }
    }
}

/// What assembly needs to know of a body.
#[derive(Clone, Copy)]
pub struct Parameters<'a> {
    pub part: &'a MeshPart,
    pub elements: &'a Elements,
    pub laws: &'a Laws,
    /// Laws of the points of a body that yields; `None`: those of `laws`.
    pub points: Option<&'a Points>,
    /// Whether the matrix is wanted, or the right-hand sides alone.
    pub stiff: bool,
    pub temperature: Option<&'a [f64]>,
    pub constraints: &'a Constraints,
    pub thickness: f64,
}

/// What the cells of one rank contribute: to the matrix, to the right-hand sides at local nodes, and the largest diagonal
/// entry.
struct Contributions {
    entries: Entries,
    /// From the initial strain.
    thermal: Vec<f64>,
    /// From prescribed displacements.
    prescribed: Vec<f64>,
    largest: f64,
}

/// What some cells of a body on one rank contribute, in the nodes' frames.
pub(super) struct Share {
    pub entries: Entries,
    /// Forces of the initial strain, N.
    pub thermal: Vec<f64>,
    /// Forces of the supports' displacements; none at a held unknown.
    pub prescribed: Vec<Part>,
}

/// An assembled body, in the nodes' frames: the right-hand sides at the owned nodes.
pub(super) struct Assembled {
    pub matrix: Matrix,
    /// Forces of the initial strain, N.
    pub thermal: Vec<f64>,
    /// Forces of the supports' displacements.
    pub prescribed: Vec<Part>,
}

/// The stiffness matrix under some constraints, and the right-hand sides at the owned nodes.
pub struct Stiffness {
    pub matrix: Matrix,
    /// Forces of the initial strain, N.
    pub thermal: Vec<f64>,
    /// Forces of the prescribed displacements, N; at a held unknown the diagonal times its value.
    pub prescribed: Vec<f64>,
    /// Diagonal of the held unknowns, N/m.
    pub diagonal: f64,
}

/// Coordinates of a cell's nodes.
pub fn cell_points(part: &MeshPart, cell: &Cell, x: &mut [[f64; 3]; MAX_NODES]) {
    for (x, &node) in x.iter_mut().zip(cell.nodes()) {
        *x = part.points[node as usize];
    }
}

/// Temperature at a quadrature point from the nodal values, given the shape functions there, K.
pub fn temperature_at(temperature: Option<&[f64]>, cell: &Cell, n: &[f64]) -> Option<f64> {
    let t = temperature?;
    Some(std::iter::zip(cell.nodes(), n).map(|(&node, n)| n * t[node as usize]).sum())
}

impl Parameters<'_> {
    /// The stiffness matrix with supports and fixings eliminated (identity rows, symmetric), and the right-hand sides
    /// of initial strain and prescribed displacements. Collective.
    pub fn stiffness(&self, group: &SimpleCommunicator) -> Result<Stiffness> {
        let (part, dim) = (self.part, self.part.dim);
        let Contributions { mut entries, thermal, prescribed, largest } =
            agree(group, self.element_arrays(group, |_, _| true))?;
        // Identity rows, scaled like the rest of the diagonal, keep the held unknowns in the system.
        let scale = crate::parallel::max(group, &[largest])[0];
        for (i, _) in self.held() {
            let (node, c) = (i / dim, i % dim);
            entries.add_diagonal((part.global[node] as usize * dim + c) as i32, scale);
        }
        for slave in Hanging::of(part).among(part.n_owned) {
            for c in 0..dim {
                let dof = (part.global[slave.node as usize] as usize * dim + c) as i32;
                entries.add_diagonal(dof, scale);
            }
        }
        let thermal = self.sum_to_owners(group, &thermal)?;
        let prescribed = self.with_held(self.sum_to_owners(group, &prescribed)?, scale);
        let matrix = entries.into_matrix(group, part.n_owned * dim, dim)?;
        matrix.set_rigid_modes(group, &part.points[..part.n_owned], dim)?;
        Ok(Stiffness { matrix, thermal, prescribed, diagonal: scale })
    }

    /// Unknowns at the owned nodes that are held, with their displacements.
    fn held(&self) -> impl Iterator<Item = (usize, f64)> {
        let (n_owned, dim) = (self.part.n_owned as u32, self.part.dim);
        self.constraints.0.range(..n_owned).flat_map(move |(&node, constraint)| {
            (0..dim).filter_map(move |c| Some((node as usize * dim + c, constraint.held(c)?)))
        })
    }

    /// Forces with those of the held unknowns in place.
    fn with_held(&self, mut forces: Vec<f64>, diagonal: f64) -> Vec<f64> {
        self.held().for_each(|(i, value)| forces[i] = diagonal * value);
        forces
    }

    /// Forces of the prescribed displacements at the owned nodes, N, in the nodes' frames: the cells at nodes that do
    /// not stay where they are make them. Collective.
    fn prescribed_forces(&self, group: &SimpleCommunicator, diagonal: f64) -> Result<Vec<f64>> {
        Ok(self.with_held(self.forces_of_supports(group, |_| true)?, diagonal))
    }

    /// The same of chosen cells, none of the held unknowns. Collective.
    fn forces_of_supports(
        &self,
        group: &SimpleCommunicator,
        chosen: impl Fn(usize) -> bool,
    ) -> Result<Vec<f64>> {
        let moves = |node: &u32| {
            let constraint = self.constraints.0.get(node);
            constraint.is_some_and(|constraint| constraint.prescribed.iter().flatten().any(|u| *u != 0.0))
        };
        let hanging = Hanging::of(self.part);
        let near = |cell: &Cell| {
            let of_masters = |reduced: &Reduced| reduced.nodes.iter().any(moves);
            cell.nodes().iter().any(moves) || hanging.reduce(cell).as_ref().is_some_and(of_masters)
        };
        let of_cells = self.element_arrays(group, |index, cell| chosen(index) && near(cell));
        let Contributions { prescribed, .. } = agree(group, of_cells)?;
        self.sum_to_owners(group, &prescribed)
    }

    /// What chosen cells of a body on one rank make of its matrix and right-hand sides, without the rows of held unknowns.
    fn share(&self, group: &SimpleCommunicator, chosen: impl Fn(usize) -> bool) -> Result<Share> {
        let of_cells = self.element_arrays(group, |index, _| chosen(index));
        let Contributions { entries, thermal, prescribed, .. } = of_cells?;
        Ok(Share {
            entries,
            thermal: self.sum_to_owners(group, &thermal)?,
            prescribed: vec![Part { path: None, forces: self.sum_to_owners(group, &prescribed)? }],
        })
    }

    /// What the cells at some nodes (marked by local number) contribute to the stiffness matrix. Collective.
    pub fn stiffness_near(&self, group: &SimpleCommunicator, nodes: &[bool]) -> Result<Matrix> {
        let hanging = Hanging::of(self.part);
        let near = |cell: &Cell| {
            let at = |all: &[u32]| all.iter().any(|&node| nodes[node as usize]);
            at(cell.nodes()) || hanging.reduce(cell).is_some_and(|reduced| at(&reduced.nodes))
        };
        let Contributions { entries, .. } = agree(group, self.element_arrays(group, |_, cell| near(cell)))?;
        entries.into_matrix(group, self.part.n_owned * self.part.dim, self.part.dim)
    }

    /// Stiffness and right-hand sides of this rank's chosen cells, held unknowns eliminated.
    fn element_arrays(
        &self,
        group: &SimpleCommunicator,
        chosen: impl Fn(usize, &Cell) -> bool,
    ) -> Result<Contributions> {
        let (part, dim) = (self.part, self.part.dim);
        let all = || part.cells[..part.n_own_cells].iter().enumerate();
        let own = || all().filter(|(index, cell)| chosen(*index, cell));
        let hanging = Hanging::of(part);
        let mut lists = Lists::default();
        let listed = || own().filter(|_| self.stiff);
        // A slave has a row of its own: it stays among its cell's nodes.
        listed().for_each(|(_, cell)| match hanging.reduce(cell) {
            None => lists.push(cell.nodes().iter().map(|&node| part.global[node as usize])),
            Some(reduced) => {
                let slaves = cell.nodes().iter().filter(|node| !reduced.nodes.contains(node));
                lists.push(reduced.nodes.iter().chain(slaves).map(|&node| part.global[node as usize]));
            }
        });
        let mut entries = match self.stiff {
            true => Entries::new(group, part.n_global_nodes, dim, &lists),
            false => Entries::Nothing,
        };
        let n_nodes = self.summed_nodes();
        let (mut thermal, mut prescribed) = (vec![0.0; n_nodes * dim], vec![0.0; n_nodes * dim]);
        let mut x = [[0.0; 3]; MAX_NODES];
        let (mut k, mut f, mut g) = ([0.0; MAX_DOFS * MAX_DOFS], [0.0; MAX_DOFS], [0.0; MAX_DOFS]);
        let mut supports: [Option<&NodeConstraint>; MAX_NODES] = [None; MAX_NODES];
        let mut global = [0_i32; MAX_DOFS];
        let mut largest: f64 = 0.0;
        for (index, cell) in own() {
            let n = cell.kind.n_nodes() * dim;
            let law = &self.laws.of(cell).elastic;
            let of_points = self.points.map(|points| points.laws(index));
            cell_points(part, cell, &mut x);
            self.elements.of(cell.kind).stiffness(
                &x[..cell.kind.n_nodes()],
                self.thickness,
                |point, shape| match of_points {
                    Some(laws) => laws[point],
                    None => law.law(temperature_at(self.temperature, cell, shape)),
                },
                &mut k[..n * n],
                &mut f[..n],
            )?;
            let reduced = hanging.reduce(cell);
            let n = reduced.as_ref().map_or(n, |reduced| reduced.apply(dim, n, &mut k, &mut f));
            let nodes = reduced.as_ref().map_or(cell.nodes(), |reduced| &reduced.nodes);
            let (k, f, g) = (&mut k[..n * n], &mut f[..n], &mut g[..n]);
            let mut supported = false;
            for (a, &node) in nodes.iter().enumerate() {
                supports[a] = self.constraints.0.get(&node);
                supported |= supports[a].is_some();
                for c in 0..dim {
                    global[a * dim + c] = (part.global[node as usize] as usize * dim + c) as i32;
                }
            }
            if supported {
                eliminate(&supports[..nodes.len()], dim, k, [f, g], &mut global[..n]);
            }
            for (a, &node) in nodes.iter().enumerate() {
                for c in 0..dim {
                    thermal[node as usize * dim + c] += f[a * dim + c];
                    if supported {
                        prescribed[node as usize * dim + c] += g[a * dim + c];
                    }
                    largest = larger(largest, k[(a * dim + c) * (n + 1)]);
                }
            }
            entries.add(&global[..n], k);
        }
        Ok(Contributions { entries, thermal, prescribed, largest })
    }

    /// External nodal forces at the owned nodes, in global axes, by the paths that they follow. Collective.
    pub fn external_forces(
        &self,
        case: &BodyCase,
        mesh: &Mesh,
        group: &SimpleCommunicator,
    ) -> Result<Vec<Part>> {
        let paths: BTreeSet<Option<usize>> = case.loads.iter().map(|load| load.path).collect();
        let part = |path| {
            let local = agree(group, self.local_forces(case, path, mesh))?;
            Ok(Part { path, forces: self.sum_to_owners(group, &local)? })
        };
        paths.into_iter().map(part).collect()
    }

    /// Of the loads that follow this path, or none, the share of this rank's cells, at its local nodes, N.
    fn local_forces(&self, case: &BodyCase, path: Option<usize>, mesh: &Mesh) -> Result<Vec<f64>> {
        let (part, dim) = (self.part, self.part.dim);
        let mut f = vec![0.0; self.summed_nodes() * dim];
        for load in case.loads.iter().filter(|load| load.path == path) {
            match &load.kind {
                LoadKind::BodyForce(b) => {
                    self.add_body_force(|x| std::array::from_fn(|i| b[i].at(x)), &mut f)?
                }
                LoadKind::Traction(region, t) => {
                    let facets = self.own_facets(case, mesh, region, &load.origin)?;
                    self.add_traction(&facets, |x, _| std::array::from_fn(|i| t[i].at(x)), &mut f);
                }
                LoadKind::Pressure(region, p) => {
                    let facets = self.own_facets(case, mesh, region, &load.origin)?;
                    self.add_traction(&facets, |x, n| n.map(|n| -p.at(x) * n), &mut f);
                }
                LoadKind::Force(Region::Point(x), force) => {
                    let node = region::find_node(mesh, &case.name, x, &load.origin)?;
                    if let Some(i) = part.original[..part.n_owned].iter().position(|&o| o == node) {
                        (0..dim).for_each(|c| f[i * dim + c] += force[c]);
                    }
                }
                LoadKind::Force(region @ Region::Surface { name, within }, force) => {
                    let all = region::find_facets(mesh, &case.name, name, within.as_ref(), &load.origin)?;
                    let area = facet_area(mesh, &all, self.thickness);
                    let facets = self.own_facets(case, mesh, region, &load.origin)?;
                    self.add_traction(&facets, |_, _| force.map(|f| f / area), &mut f);
                }
            }
        }
        Hanging::of(part).distribute(&mut f, dim);
        if f.iter().any(|f| !f.is_finite()) {
            return Err(Error::input(format!("body '{}': a load is not finite at a node", case.name)));
        }
        Ok(f)
    }

    fn add_body_force(&self, b: impl Fn(&[f64; 3]) -> [f64; 3], f: &mut [f64]) -> Result<()> {
        let (part, dim) = (self.part, self.part.dim);
        let mut x = [[0.0; 3]; MAX_NODES];
        for cell in &part.cells[..part.n_own_cells] {
            let n = cell.kind.n_nodes();
            let mut local = [0.0; MAX_DOFS];
            cell_points(part, cell, &mut x);
            body_load(cell.kind, &x[..n], self.thickness, &b, &mut local[..n * dim])?;
            for (a, &node) in cell.nodes().iter().enumerate() {
                (0..dim).for_each(|c| f[node as usize * dim + c] += local[a * dim + c]);
            }
        }
        Ok(())
    }

    fn add_traction(&self, facets: &[Facet], t: impl Fn(&[f64; 3], &[f64; 3]) -> [f64; 3], f: &mut [f64]) {
        let (part, dim) = (self.part, self.part.dim);
        for facet in facets {
            let cell = &part.cells[facet.cell as usize];
            let nodes = cell.kind.facets()[facet.side as usize].iter().map(|&i| cell.nodes()[i] as usize);
            let nodes: Vec<usize> = nodes.collect();
            let x: Vec<[f64; 3]> = nodes.iter().map(|&i| part.points[i]).collect();
            let mut local = vec![0.0; nodes.len() * dim];
            facet_load(&x, self.thickness, &t, &mut local);
            for (a, &node) in nodes.iter().enumerate() {
                (0..dim).for_each(|c| f[node * dim + c] += local[a * dim + c]);
            }
        }
    }

    /// This rank's facets of a region of the body.
    fn own_facets(
        &self,
        case: &BodyCase,
        mesh: &Mesh,
        region: &Region,
        origin: &crate::case::Origin,
    ) -> Result<Vec<Facet>> {
        let Region::Surface { name, within } = region else {
            return Err(origin.error("needs a surface, not a point"));
        };
        let all = region::find_facets(mesh, &case.name, name, within.as_ref(), origin)?;
        let all: HashSet<(u32, u8)> = all.into_iter().map(|f| (f.cell, f.side)).collect();
        let own = self.part.surfaces.get(name).map_or(&[][..], Vec::as_slice);
        let original = |f: &Facet| (self.part.original_cells[f.cell as usize], f.side);
        Ok(own.iter().copied().filter(|f| all.contains(&original(f))).collect())
    }

    /// Nodes that own cells contribute to: the local ones, and masters beyond where nodes hang.
    fn summed_nodes(&self) -> usize {
        if self.part.slaves.is_empty() { self.part.n_local } else { self.part.points.len() }
    }

    /// Sums contributions at the nodes to their owners. Collective.
    fn sum_to_owners(&self, group: &SimpleCommunicator, local: &[f64]) -> Result<Vec<f64>> {
        let (part, dim) = (self.part, self.part.dim);
        let n_owned = part.n_owned * dim;
        let v = Vector::zeros(group, n_owned)?;
        v.set(&local[..n_owned])?;
        let ghosts: Vec<i32> = part.global[part.n_owned..local.len() / dim]
            .iter()
            .flat_map(|&g| (0..dim).map(move |c| (g as usize * dim + c) as i32))
            .collect();
        v.add(&ghosts, &local[n_owned..])?;
        v.to_vec()
    }
}

/// Area of facets, m2.
fn facet_area(mesh: &Mesh, facets: &[Facet], thickness: f64) -> f64 {
    facets
        .iter()
        .map(|&f| {
            let x: Vec<[f64; 3]> = mesh.facet_nodes(f).map(|i| mesh.points[i as usize]).collect();
            let mut weights = vec![0.0; x.len()];
            facet_weights(&x, thickness, &mut weights);
            weights.iter().sum::<f64>()
        })
        .sum()
}

/// Turns an element's arrays into its nodes' frames and eliminates held unknowns: their columns, times the values, go to
/// the right-hand side `g`, their rows and columns get index -1, which PETSc drops.
fn eliminate(
    supports: &[Option<&NodeConstraint>],
    dim: usize,
    k: &mut [f64],
    [f, g]: [&mut [f64]; 2],
    global: &mut [i32],
) {
    let n = f.len();
    for (a, support) in supports.iter().enumerate() {
        let Some(support) = support.filter(|s| s.frame.is_some()) else { continue };
        let q = |i: usize, c: usize| support.direction(c)[i];
        let mut turned = [0.0; 3];
        for row in 0..n {
            // Columns of this node: K Q.
            for (c, t) in turned[..dim].iter_mut().enumerate() {
                *t = (0..dim).map(|i| k[row * n + a * dim + i] * q(i, c)).sum();
            }
            k[row * n + a * dim..][..dim].copy_from_slice(&turned[..dim]);
        }
        for column in 0..n {
            // Rows of this node: Q' K.
            for (c, t) in turned[..dim].iter_mut().enumerate() {
                *t = (0..dim).map(|i| q(i, c) * k[(a * dim + i) * n + column]).sum();
            }
            (0..dim).for_each(|c| k[(a * dim + c) * n + column] = turned[c]);
        }
        for (c, t) in turned[..dim].iter_mut().enumerate() {
            *t = (0..dim).map(|i| q(i, c) * f[a * dim + i]).sum();
        }
        f[a * dim..][..dim].copy_from_slice(&turned[..dim]);
    }
    g.fill(0.0);
    for (a, support) in supports.iter().enumerate() {
        let Some(support) = support else { continue };
        for c in 0..dim {
            let Some(value) = support.held(c) else { continue };
            let j = a * dim + c;
            for (i, g) in g.iter_mut().enumerate() {
                *g -= k[i * n + j] * value;
            }
            global[j] = -1;
        }
    }
    for (j, index) in global.iter().enumerate() {
        if *index < 0 {
            (f[j], g[j]) = (0.0, 0.0);
        }
    }
}
