//! Strains, stresses and the balance of forces from the displacements.
use super::{Body, assembly, hanging::Hanging, laws::Law, points::in_plane, rounding::rounded};
use crate::{
    contact::vector::dot,
    element::{ElementKind, MAX_NODES, PointGeometry, PointLaw, QuadraturePoint, SolidElement},
    error::Result,
    material::PointState,
    mesh::Cell,
    vector::larger,
};

/// Tensors are (xx, yy, zz, xy, yz, xz).
type Tensor = [f64; 6];

/// Fields on this rank's cells and nodes; nodal values are means over the cells of the body that meet in the node.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fields {
    /// At local nodes, m.
    pub displacement: Vec<[f64; 3]>,
    /// At local nodes, K.
    pub temperature: Option<Vec<f64>>,
    /// At local nodes, Pa.
    pub stress: Vec<Tensor>,
    /// At local nodes.
    pub strain: Vec<Tensor>,
    /// Means over own cells, Pa.
    pub cell_stress: Vec<Tensor>,
    /// Means over own cells.
    pub cell_strain: Vec<Tensor>,
    /// At the elements' points.
    pub at_points: PointStresses,
    /// Nodal forces of the stresses at the owned nodes, `dim` components each, N.
    pub internal: Vec<f64>,
    /// Of a body that yields.
    pub plastic: Option<PlasticFields>,
}

/// What a body has yielded.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlasticFields {
    /// Plastic strain at local nodes.
    pub strain: Vec<Tensor>,
    /// Equivalent plastic strain at local nodes, never negative.
    pub equivalent: Vec<f64>,
    /// Means over own cells: plastic strain, equivalent plastic strain, plastic work in J/m3.
    pub cell_strain: Vec<Tensor>,
    #[allow(missing_docs)]
    pub cell_equivalent: Vec<f64>,
    #[allow(missing_docs)]
    pub cell_work: Vec<f64>,
    /// Of each own cell: the share of its points at which plastic strain grows.
    pub cell_yields: Vec<f64>,
    /// Largest equivalent plastic strain at a point of an own cell.
    pub largest: f64,
    /// Volume of the own cells' points that have plastic strain, and of all, m3.
    pub volume: [f64; 2],
}

/// Stresses in the plane (11, 22, 12) at the elements' points of all cells of the part, Pa.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointStresses {
    /// One cell after the other.
    stresses: Vec<[f64; 3]>,
    /// Where each cell ends in it.
    ends: Vec<u32>,
}

impl PointStresses {
    fn with_capacity(n_cells: usize) -> PointStresses {
        PointStresses { stresses: Vec::with_capacity(4 * n_cells), ends: Vec::with_capacity(n_cells) }
    }

    /// Those of a cell.
    pub fn of(&self, cell: usize) -> &[[f64; 3]] {
        let first = cell.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.stresses[first as usize..self.ends[cell] as usize]
    }

    /// Adds the next cell's, and gives them back.
    fn push(&mut self, stresses: impl IntoIterator<Item = [f64; 3]>) -> &[[f64; 3]] {
        let first = self.stresses.len();
        self.stresses.extend(stresses);
        self.ends.push(self.stresses.len() as u32);
        &self.stresses[first..]
    }
}

/// Sums over this rank's share that must balance over the group.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Balance {
    /// Sum of squares of the residual at free unknowns, N2, and of all nodal forces (applied, contact, internal).
    pub residual2: [f64; 2],
    /// Resultant of external, contact and support forces, N.
    pub resultant: [f64; 3],
    /// Their moment about the origin, N m (2D: about z).
    pub moment: f64,
    /// Sum of the absolute nodal forces, N, and of their moments, N m: what round-off is measured against.
    pub scale: [f64; 2],
    /// Work of stresses on strains, and of external, contact and support forces on displacements, J; and the sum of
    /// the absolute works.
    pub work: [f64; 3],
    /// Elastic energy, J.
    pub stored: f64,
    /// Plastic work so far, J.
    pub plastic: f64,
    /// Elastic energy of strains of round-off size, 1e-14, J: a body with less work done on it is not loaded.
    pub noise: f64,
    /// Sum of the sizes of the nodal loads, N.
    pub applied: f64,
    /// Resultant of the support forces, N; a fixing is no support, its force is residual.
    pub reaction: [f64; 3],
    /// What the unit round-off of the displacements makes of the internal forces, eps |u| times the stiffness of the cells
    /// at a node: sum of squares over the nodes, N2, and sum, N.
    pub round_off: [f64; 2],
}

/// The elastic laws in a cell.
pub struct CellLaws<'b> {
    law: &'b Law,
    cell: &'b Cell,
    temperature: Option<&'b [f64]>,
    /// Plastic strains at its nodes.
    plastic: Option<Box<[Tensor; MAX_NODES]>>,
}

impl CellLaws<'_> {
    /// Given the shape functions at a point.
    pub fn at(&self, shape: &[f64]) -> PointLaw {
        let temperature = assembly::temperature_at(self.temperature, self.cell, shape);
        let Some(nodal) = self.plastic.as_deref() else { return self.law.elastic.law(temperature) };
        let strain = |c: usize| std::iter::zip(shape, nodal).map(|(n, strain)| n * strain[c]).sum();
        let state = PointState { plastic_strain: std::array::from_fn(strain), ..PointState::default() };
        self.law.frozen(&state, temperature)
    }
}

impl PlasticFields {
    fn new(n_local: usize) -> PlasticFields {
        PlasticFields {
            strain: vec![[0.0; 6]; n_local],
            equivalent: vec![0.0; n_local],
            ..PlasticFields::default()
        }
    }

    /// Adds a cell's values at its nodes.
    fn add(&mut self, element: SolidElement, cell: &Cell, states: &[PointState]) {
        if states.iter().all(|state| state.equivalent == 0.0) {
            return;
        }
        let mut values = [[0.0; 7]; MAX_NODES];
        let of_point = |state: &PointState| {
            std::array::from_fn(|c| state.plastic_strain.get(c).copied().unwrap_or(state.equivalent))
        };
        let at_points: Vec<[f64; 7]> = states.iter().map(of_point).collect();
        element.to_nodes(&at_points, &mut values[..cell.kind.n_nodes()]);
        for (value, &node) in values.iter().zip(cell.nodes()) {
            let node = node as usize;
            if node < self.equivalent.len() {
                (0..6).for_each(|c| self.strain[node][c] += value[c]);
                self.equivalent[node] += larger(value[6], 0.0);
            }
        }
    }

    /// Adds an own cell; its plastic work, J. `yields`: the share of its points at which plastic strain grows.
    fn add_own(&mut self, states: &[PointState], volumes: &[f64], yields: f64) -> f64 {
        let volume: f64 = volumes.iter().sum();
        let mean = |of: &dyn Fn(&PointState) -> f64| {
            std::iter::zip(states, volumes).map(|(state, v)| v * of(state)).sum::<f64>() / volume
        };
        self.cell_strain.push(std::array::from_fn(|c| mean(&|state| state.plastic_strain[c])));
        self.cell_equivalent.push(mean(&|state| state.equivalent));
        let work = mean(&|state| state.work);
        self.cell_work.push(work);
        self.cell_yields.push(yields);
        for (state, v) in std::iter::zip(states, volumes) {
            self.largest = larger(self.largest, state.equivalent);
            self.volume[0] += if state.equivalent > 0.0 { *v } else { 0.0 };
        }
        self.volume[1] += volume;
        work * volume
    }

    /// Sums at the nodes to means; `count`: cells at each node.
    fn average(&mut self, count: &[u32]) {
        let at_nodes = self.strain.iter_mut().zip(&mut self.equivalent);
        for ((strain, equivalent), n) in at_nodes.zip(count) {
            let share = 1.0 / f64::from((*n).max(1));
            strain.iter_mut().for_each(|e| *e *= share);
            *equivalent *= share;
        }
    }
}

impl Body {
    /// Stresses, strains and the balance of forces. `u`: displacements at all nodes of the part (owned, local,
    /// halo), m; `contact`: contact nodal forces at the owned nodes, N. Of `others`, more displacements like `u`, the stresses at
    /// the elements' points.
    pub fn recover(
        &self,
        u: &[f64],
        contact: &[f64],
        others: &[&[f64]],
    ) -> Result<(Fields, Balance, Vec<PointStresses>)> {
        let (part, dim) = (&self.part, self.part.dim);
        let mut of_others = vec![PointStresses::with_capacity(part.cells.len()); others.len()];
        let mut fields = Fields {
            displacement: (0..part.n_local).map(|i| vector(u, i, dim)).collect(),
            temperature: self.temperature.as_ref().map(|t| t[..part.n_local].to_vec()),
            stress: vec![[0.0; 6]; part.n_local],
            strain: vec![[0.0; 6]; part.n_local],
            at_points: PointStresses::with_capacity(part.cells.len()),
            ..Fields::default()
        };
        let mut count = vec![0_u32; part.n_local];
        let mut internal = vec![0.0; part.points.len() * dim];
        let mut balance = Balance::default();
        let mut work = Workspace::default();
        let modulus = self.model.laws.plane_modulus();
        let stiffness = self.model.laws.stiffness() * self.model.thickness;
        let mut plastic = self.points.as_ref().map(|_| PlasticFields::new(part.n_local));
        let mut rounding = vec![0.0; part.points.len()];
        for (i, cell) in part.cells.iter().enumerate() {
            self.recover_cell(i, cell, u, others, &mut work)?;
            let element = self.model.elements.of(cell.kind);
            let n = cell.kind.n_nodes();
            let n_points = work.geometry.len();
            let stresses = fields.at_points.push(work.stress.iter().map(in_plane));
            let f = &mut work.force[..n * dim];
            element.internal_force(&work.geometry, self.model.thickness, stresses, f);
            for (other, strains) in
                std::iter::zip(&mut of_others, work.plane_strain[n_points..].chunks_exact(n_points))
            {
                other.push(std::iter::zip(&work.laws, strains).map(|(law, strain)| law.stress(*strain)));
            }
            let rounded = rounded(&work.geometry, n, stiffness, &work.u[..n * dim]);
            for (a, &node) in cell.nodes().iter().enumerate() {
                rounding[node as usize] += rounded;
                (0..dim).for_each(|c| internal[node as usize * dim + c] += f[a * dim + c]);
            }
            let mut at_nodes = [[0.0; 6]; MAX_NODES];
            for (values, sums) in [(&work.stress, &mut fields.stress), (&work.strain, &mut fields.strain)] {
                element.to_nodes(values, &mut at_nodes[..n]);
                for (tensor, &node) in at_nodes.iter().zip(cell.nodes()) {
                    if let Some(sum) = sums.get_mut(node as usize) {
                        (0..6).for_each(|c| sum[c] += tensor[c]);
                    }
                }
            }
            for &node in cell.nodes() {
                if let Some(count) = count.get_mut(node as usize) {
                    *count += 1;
                }
            }
            if let (Some(plastic), Some(points)) = (&mut plastic, &self.points) {
                let (states, _) = points.states(i);
                plastic.add(element, cell, states);
                if i < part.n_own_cells {
                    let volume = |g: &PointGeometry| g.area * self.model.thickness;
                    let volumes: Vec<f64> = work.geometry.iter().map(volume).collect();
                    balance.plastic += plastic.add_own(states, &volumes, points.share_yielding(i));
                }
            }
            let law = self.model.laws.of(cell);
            if i < part.n_own_cells {
                fields.cell_stress.push(SolidElement::mean(&work.geometry, &work.stress));
                fields.cell_strain.push(SolidElement::mean(&work.geometry, &work.strain));
                let points = work.stress.iter().zip(&work.plane_strain).zip(&work.geometry);
                for (((s, e), g), t) in points.zip(&work.temperature) {
                    let v = g.area * self.model.thickness;
                    balance.noise += 1e-28 * modulus * v;
                    let work = v * (s[0] * e[0] + s[1] * e[1] + s[3] * e[2]);
                    balance.work[0] += work;
                    balance.stored += match (t, &plastic) {
                        (None, None) => 0.5 * work,
                        _ => v * law.elastic.energy(*s, *t),
                    };
                    // Where nothing moves the stored energy sets the scale.
                    balance.work[2] += v * (s[0] * s[0] + s[1] * s[1] + s[3] * s[3]) / modulus;
                }
            }
        }
        plastic.iter_mut().for_each(|plastic| plastic.average(&count));
        fields.plastic = plastic;
        for (i, n) in count.into_iter().enumerate() {
            let share = 1.0 / f64::from(n.max(1));
            fields.stress[i].iter_mut().chain(&mut fields.strain[i]).for_each(|v| *v *= share);
        }
        // A stress, too, is at a slave what the coarse side has there.
        for slave in Hanging::of(part).among(part.n_local) {
            for field in [&mut fields.stress, &mut fields.strain] {
                let from = |c: usize| slave.masters.iter().map(|&(m, w)| w * field[m as usize][c]).sum();
                field[slave.node as usize] = std::array::from_fn(from);
            }
        }
        Hanging::of(part).distribute(&mut internal, dim);
        self.balance(u, contact, &internal, &mut balance);
        for r in &rounding[..part.n_owned] {
            balance.round_off[0] += r * r;
            balance.round_off[1] += r;
        }
        internal.truncate(part.n_owned * dim);
        fields.internal = internal;
        Ok((fields, balance, of_others))
    }

    /// Loads and support forces at the owned nodes, N, that hold the body under the nodal forces `internal` of its stresses and
    /// `contact` of its contacts.
    pub fn held_by(&self, internal: &[f64], contact: &[f64]) -> Vec<f64> {
        let dim = self.part.dim;
        let mut held = self.loads.external_at(&self.loads.factors);
        let supported = self.model.constraints.0.keys().map(|&i| i as usize);
        for i in supported.filter(|&i| i < self.part.n_owned) {
            let [_, reaction] = self.missing(i, [internal, &held, contact]);
            (0..dim).for_each(|c| held[i * dim + c] += reaction[c]);
        }
        held
    }

    /// What is missing to equilibrium at an owned node: where it is free, and along its supports, N. Of all nodal forces those of the
    /// stresses, applied and of contact.
    pub(super) fn missing(&self, i: usize, forces: [&[f64]; 3]) -> [[f64; 3]; 2] {
        let dim = self.part.dim;
        let [internal, applied, contact] = forces.map(|f| vector(f, i, dim));
        let unbalanced: [f64; 3] = std::array::from_fn(|c| internal[c] - applied[c] - contact[c]);
        let residual = match self.model.constraints.0.get(&(i as u32)) {
            Some(support) => support.free_part(&unbalanced, dim),
            None => unbalanced,
        };
        [residual, std::array::from_fn(|c| unbalanced[c] - residual[c])]
    }

    /// Law and geometry at the quadrature points of a cell, stress and strain there, and the strains in the plane, those of
    /// `others` after those of `u`.
    fn recover_cell(
        &self,
        index: usize,
        cell: &Cell,
        u: &[f64],
        others: &[&[f64]],
        work: &mut Workspace,
    ) -> Result<()> {
        let (dim, n) = (self.part.dim, cell.kind.n_nodes());
        assembly::cell_points(&self.part, cell, &mut work.x);
        work.u.clear();
        for u in std::iter::once(&u).chain(others) {
            let of_node = |&node: &u32| &u[node as usize * dim..][..dim];
            work.u.extend(cell.nodes().iter().flat_map(of_node));
        }
        let temperature =
            |shape: &[f64]| assembly::temperature_at(self.temperature.as_ref().map(|t| &t[..]), cell, shape);
        let element = self.model.elements.of(cell.kind);
        element.geometry(&work.x[..n], &mut work.geometry)?;
        work.laws.clear();
        let law = &self.model.laws.of(cell).elastic;
        match &self.points {
            Some(points) => work.laws.extend(points.laws(index)),
            None => work.laws.extend(work.geometry.iter().map(|g| law.law(temperature(&g.n[..n])))),
        }
        let laws = &work.laws;
        element.strains(
            &work.x[..n],
            &work.geometry,
            &work.u,
            |point, _| laws[point],
            &mut work.plane_strain,
        )?;
        work.stress.clear();
        work.strain.clear();
        work.temperature.clear();
        work.temperature.extend(work.geometry.iter().map(|geometry| temperature(&geometry.n[..n])));
        if let Some(points) = &self.points {
            let (states, strains) = points.states(index);
            work.stress.extend(states.iter().map(|state| state.stress));
            work.strain.extend(strains);
            return Ok(());
        }
        for (strain, t) in work.plane_strain.iter().zip(&work.temperature) {
            work.stress.push(law.stress(*strain, *t));
            work.strain.push(law.strain(*strain, *t));
        }
        Ok(())
    }

    /// Stresses in the plane (11, 22, 12), Pa, at `points` of a cell, by its index, added to `stresses`; `u` as in [`Body::recover`].
    pub fn stresses_at(
        &self,
        index: usize,
        u: &[f64],
        points: &[QuadraturePoint],
        stresses: &mut Vec<[f64; 3]>,
    ) -> Result<()> {
        let cell = &self.part.cells[index];
        let (dim, n) = (self.part.dim, cell.kind.n_nodes());
        let (mut x, mut own) = ([[0.0; 3]; MAX_NODES], [0.0; 3 * MAX_NODES]);
        assembly::cell_points(&self.part, cell, &mut x);
        for (a, &node) in cell.nodes().iter().enumerate() {
            own[a * dim..][..dim].copy_from_slice(&u[node as usize * dim..][..dim]);
        }
        let mut strains = Vec::with_capacity(points.len());
        let (element, laws) = (self.element(cell.kind), self.cell_laws(index));
        let of_points = self.points.as_ref().map(|points| points.laws(index));
        element.strains_at(
            points,
            &x[..n],
            &own[..n * dim],
            |point, shape| of_points.map_or_else(|| laws.at(shape), |laws| laws[point]),
            &mut strains,
        )?;
        let at_points = std::iter::zip(points, strains)
            .map(|(point, strain)| laws.at(&cell.kind.shape(&point.xi).n[..n]).stress(strain));
        stresses.extend(at_points);
        Ok(())
    }

    /// The elastic laws in a cell, by its index, with the plastic strains it has.
    pub fn cell_laws(&self, index: usize) -> CellLaws<'_> {
        let cell = &self.part.cells[index];
        let plastic = self.points.as_ref().map(|points| {
            let strains: Vec<Tensor> = points.states(index).0.iter().map(|s| s.plastic_strain).collect();
            let mut at_nodes = [[0.0; 6]; MAX_NODES];
            self.element(cell.kind).to_nodes(&strains, &mut at_nodes[..cell.kind.n_nodes()]);
            Box::new(at_nodes)
        });
        let temperature = self.temperature.as_ref().map(|t| &t[..]);
        CellLaws { law: self.model.laws.of(cell), cell, temperature, plastic }
    }

    /// The element of a kind that occurs in the mesh.
    pub fn element(&self, kind: ElementKind) -> SolidElement {
        self.model.elements.of(kind)
    }

    /// Thickness, m.
    pub fn thickness(&self) -> f64 {
        self.model.thickness
    }

    /// Residual, resultants and work at the owned nodes.
    fn balance(&self, u: &[f64], contact: &[f64], internal: &[f64], balance: &mut Balance) {
        let (part, dim) = (&self.part, self.part.dim);
        let external = self.loads.external_at(&self.loads.factors);
        // Of a body that yields the current right-hand side has the forces of all its stresses.
        let inside = self.points.as_ref().map_or(&self.loads.current[..], |points| points.held());
        for i in 0..part.n_owned {
            let (x, u) = (part.points[i], vector(u, i, dim));
            let [residual, reaction] = self.missing(i, [internal, &external, contact]);
            let [internal, applied, contact] = [internal, &external, contact].map(|f| vector(f, i, dim));
            balance.residual2[0] += dot(&residual, &residual);
            // Loads that cancel inside (initial strain, prescribed motion) still set the scale of round-off.
            let load = match self.model.constraints.0.get(&(i as u32)) {
                Some(_) => [0.0; 3],
                None => vector(inside, i, dim),
            };
            balance.residual2[1] += dot(&load, &load);
            balance.scale[0] += dot(&load, &load).sqrt();
            balance.scale[1] += (x[0] * load[1]).abs() + (x[1] * load[0]).abs();
            balance.work[2] += dot(&load, &u).abs();
            for force in [&applied, &contact, &reaction, &internal] {
                balance.residual2[1] += dot(force, force);
            }
            for force in [&applied, &contact, &reaction] {
                let moment = x[0] * force[1] - x[1] * force[0];
                (0..3).for_each(|c| balance.resultant[c] += force[c]);
                balance.moment += moment;
                balance.scale[0] += dot(force, force).sqrt();
                balance.scale[1] += (x[0] * force[1]).abs() + (x[1] * force[0]).abs();
                balance.work[1] += dot(force, &u);
                balance.work[2] += dot(force, &u).abs();
            }
            balance.applied += dot(&applied, &applied).sqrt();
            (0..3).for_each(|c| balance.reaction[c] += reaction[c]);
        }
    }
}

fn vector(values: &[f64], node: usize, dim: usize) -> [f64; 3] {
    let mut v = [0.0; 3];
    v[..dim].copy_from_slice(&values[node * dim..][..dim]);
    v
}

#[derive(Default)]
struct Workspace {
    x: [[f64; 3]; MAX_NODES],
    u: Vec<f64>,
    force: [f64; 3 * MAX_NODES],
    laws: Vec<PointLaw>,
    plane_strain: Vec<[f64; 3]>,
    stress: Vec<Tensor>,
    strain: Vec<Tensor>,
    temperature: Vec<Option<f64>>,
    geometry: Vec<PointGeometry>,
}
