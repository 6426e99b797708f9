//! Strains, stresses and the balance of forces from the displacements.
use super::{Body, assembly, hanging::Hanging};
use crate::{
    contact::vector::dot,
    element::{ElementKind, MAX_NODES, PointGeometry, PointLaw, QuadraturePoint, SolidElement},
    error::Result,
    mesh::Cell,
    vector::largest,
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
        let modulus = self.model.law.plane_modulus();
        let stiffness = self.model.law.law(None).h[0][0] * self.model.thickness;
        let mut rounding = vec![0.0; part.points.len()];
        for (i, cell) in part.cells.iter().enumerate() {
            self.evaluate(cell, u, others, &mut work)?;
            let element = self.model.elements.of(cell.kind);
            let n = cell.kind.n_nodes();
            let n_points = work.geometry.len();
            let stresses = fields.at_points.push(work.stress.iter().map(|s| [s[0], s[1], s[3]]));
            let f = &mut work.force[..n * dim];
            element.internal_force(&work.geometry, self.model.thickness, stresses, f);
            for (other, strains) in
                std::iter::zip(&mut of_others, work.plane_strain[n_points..].chunks_exact(n_points))
            {
                other.push(std::iter::zip(&work.laws, strains).map(|(law, strain)| law.stress(*strain)));
            }
            // The trace of a stiffness, of which a node has its share.
            let mut trace = 0.0;
            for g in &work.geometry {
                trace += g.area * g.gradient[..n].iter().map(|d| dot(d, d)).sum::<f64>();
            }
            let rounded = f64::EPSILON * stiffness * trace * largest(&work.u[..n * dim]);
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
            if i < part.n_own_cells {
                fields.cell_stress.push(SolidElement::mean(&work.geometry, &work.stress));
                fields.cell_strain.push(SolidElement::mean(&work.geometry, &work.strain));
                let points = work.stress.iter().zip(&work.plane_strain).zip(&work.geometry);
                for (((s, e), g), t) in points.zip(&work.temperature) {
                    let v = g.area * self.model.thickness;
                    balance.noise += 1e-28 * modulus * v;
                    let work = v * (s[0] * e[0] + s[1] * e[1] + s[3] * e[2]);
                    balance.work[0] += work;
                    balance.stored += match t {
                        Some(_) => v * self.model.law.energy(*s, *t),
                        None => 0.5 * work,
                    };
                    // Where nothing moves the stored energy sets the scale.
                    balance.work[2] += v * (s[0] * s[0] + s[1] * s[1] + s[3] * s[3]) / modulus;
                }
            }
        }
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
    fn missing(&self, i: usize, forces: [&[f64]; 3]) -> [[f64; 3]; 2] {
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
    fn evaluate(&self, cell: &Cell, u: &[f64], others: &[&[f64]], work: &mut Workspace) -> Result<()> {
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
        let laws = work.geometry.iter().map(|geometry| self.model.law.law(temperature(&geometry.n[..n])));
        work.laws.extend(laws);
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
        for (strain, geometry) in work.plane_strain.iter().zip(&work.geometry) {
            let t = temperature(&geometry.n[..n]);
            work.stress.push(self.model.law.stress(*strain, t));
            work.strain.push(self.model.law.strain(*strain, t));
            work.temperature.push(t);
        }
        Ok(())
    }

    /// Stresses in the plane (11, 22, 12), Pa, at `points` of a cell, added to `stresses`; `u` as in [`Body::recover`].
    pub fn stresses_at(
        &self,
        cell: &Cell,
        u: &[f64],
        points: &[QuadraturePoint],
        stresses: &mut Vec<[f64; 3]>,
    ) -> Result<()> {
        let (dim, n) = (self.part.dim, cell.kind.n_nodes());
        let (mut x, mut own) = ([[0.0; 3]; MAX_NODES], [0.0; 3 * MAX_NODES]);
        assembly::cell_points(&self.part, cell, &mut x);
        for (a, &node) in cell.nodes().iter().enumerate() {
            own[a * dim..][..dim].copy_from_slice(&u[node as usize * dim..][..dim]);
        }
        let mut strains = Vec::with_capacity(points.len());
        let element = self.element(cell.kind);
        element.strains_at(
            points,
            &x[..n],
            &own[..n * dim],
            |_, shape| self.law(cell, shape),
            &mut strains,
        )?;
        let at_points = std::iter::zip(points, strains)
            .map(|(point, strain)| self.law(cell, &cell.kind.shape(&point.xi).n[..n]).stress(strain));
        stresses.extend(at_points);
        Ok(())
    }

    /// The law at a point of a cell, given the shape functions there.
    pub fn law(&self, cell: &Cell, shape: &[f64]) -> PointLaw {
        let temperature = self.temperature.as_ref().map(|t| &t[..]);
        self.model.law.law(assembly::temperature_at(temperature, cell, shape))
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
        for i in 0..part.n_owned {
            let (x, u) = (part.points[i], vector(u, i, dim));
            let [residual, reaction] = self.missing(i, [internal, &external, contact]);
            let [internal, applied, contact] = [internal, &external, contact].map(|f| vector(f, i, dim));
            balance.residual2[0] += dot(&residual, &residual);
            // Loads that cancel inside (initial strain, prescribed motion) still set the scale of round-off.
            let load = match self.model.constraints.0.get(&(i as u32)) {
                Some(_) => [0.0; 3],
                None => vector(&self.loads.current, i, dim),
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
