//! Energy of the difference between recovered and computed stresses.
use super::{plane::Plane, recovery::recovered};
use crate::{
    body::{Body, PointStresses},
    element::{ElementKind, Formulation, MAX_NODES, PointGeometry, PointLaw, QuadraturePoint, error_rule},
    error::Result,
    mesh::Cell,
    parallel::{self, agree},
};
use mpi::topology::SimpleCommunicator;

/// Differences of stresses below this share of what the strains would make without cancellation are round-off.
const ROUND_OFF: f64 = 1e-10;

/// Changed solutions that are looked at together.
const TOGETHER: usize = 2;

/// Strains that round-off makes in a body without load.
const NO_STRAIN: f64 = 1e-14;

/// Energy error of a cell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CellError {
    /// Number of the cell in the body's whole mesh.
    pub cell: u32,
    /// Square of the energy norm of the error in the cell, J.
    pub energy2: f64,
    /// Area of the cell times the thickness, m3.
    pub volume: f64,
    /// What the errors in the cell change of the peak pressures, relative to them, sizes added over the pairs.
    pub peaks: f64,
}

/// Energy error of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BodyError {
    /// Index of the body in the case.
    pub body: usize,
    /// This rank's own cells, in the order of its part of the mesh.
    pub cells: Vec<CellError>,
    /// |e|^2 of the whole body, J.
    pub error2: f64,
    /// |u_h|^2 of the whole body, J: twice its elastic energy.
    pub energy2: f64,
}

impl BodyError {
    /// |e| / sqrt(|u_h|^2 + |e|^2); zero where there is neither.
    pub fn relative(&self) -> f64 {
        relative(self.error2, self.energy2)
    }

    /// Estimates the error of a body from its stresses, and its scalar products in energy with the errors of what other
    /// solutions `changed` differ from it by, J, own cell by own cell. Collective on the group.
    ///
    /// With recovered stresses s*, stresses of the element s_h, and s_u those of the displacements alone, a product is
    /// int (s* - s_u) : C^-1 (s* - s_u)' - (s_h - s_u) : C^-1 (s_h - s_u)' t dA: the error of the work of the one's forces
    /// on the other's displacements. Without enhanced strains s_h = s_u.
    pub(crate) fn new(
        body: &Body,
        index: usize,
        group: &SimpleCommunicator,
        solution: &Solved,
        changed: &[Solved],
    ) -> Result<(Self, Vec<Vec<f64>>)> {
        let mut products = Vec::new();
        let mut own = None;
        // A few at a time, for the fits take memory.
        let first = changed.len().min(TOGETHER);
        for changed in std::iter::once(&changed[..first]).chain(changed[first..].chunks(TOGETHER)) {
            let solutions: Vec<&Solved> = std::iter::once(solution).chain(changed).collect();
            let stresses: Vec<&PointStresses> = solutions.iter().map(|s| s.stresses).collect();
            let nodal = recovered(body, group, &stresses)?;
            let found = agree(group, cell_errors(body, &solutions, &nodal))?;
            products.extend(found.products);
            own.get_or_insert((found.cells, found.sums));
        }
        let (mut cells, sums) = own.unwrap_or_default();
        let sums = parallel::sum(group, &sums);
        let [mut error2, energy2, scale2] = [sums[0], sums[1], sums[2]];
        if error2 <= ROUND_OFF.powi(2) * scale2 {
            error2 = 0.0;
            cells.iter_mut().for_each(|cell| cell.energy2 = 0.0);
            products.iter_mut().flatten().for_each(|product| *product = 0.0);
        }
        Ok((BodyError { body: index, cells, error2, energy2 }, products))
    }
}

/// A solution: displacements at all nodes of the part, m, and stresses.
pub(crate) struct Solved<'s> {
    pub u: &'s [f64],
    pub stresses: &'s PointStresses,
}

/// What cells have of errors.
#[derive(Default)]
struct Found {
    cells: Vec<CellError>,
    /// Of |e|^2, |u_h|^2 and of what round-off is measured against.
    sums: [f64; 3],
    /// By changed solution and cell.
    products: Vec<Vec<f64>>,
}

/// Stresses at a point, Pa.
#[derive(Debug, Clone, Copy, Default)]
struct AtPoint {
    /// Recovered less those of the displacements.
    missing: Plane,
    /// Of the element, with its enhanced strains, less those of the displacements.
    enhanced: Plane,
}

/// sqrt(error2 / (energy2 + error2)); zero where there is neither.
pub(super) fn relative(error2: f64, energy2: f64) -> f64 {
    if error2 > 0.0 { (error2 / (energy2 + error2)).sqrt() } else { 0.0 }
}

/// Errors of the own cells. `nodal`: recovered stresses, by solution.
fn cell_errors(body: &Body, solutions: &[&Solved], nodal: &[Vec<Plane>]) -> Result<Found> {
    let part = &body.part;
    let mut found = Found {
        cells: Vec::with_capacity(part.n_own_cells),
        sums: [0.0; 3],
        products: vec![Vec::with_capacity(part.n_own_cells); solutions.len() - 1],
    };
    let (mut x, mut stresses) = ([[0.0; 3]; MAX_NODES], vec![Vec::new(); solutions.len()]);
    let mut points = vec![AtPoint::default(); solutions.len()];
    for (i, cell) in part.cells[..part.n_own_cells].iter().enumerate() {
        let n = cell.kind.n_nodes();
        std::iter::zip(&mut x, cell.nodes()).for_each(|(x, &node)| *x = part.points[node as usize]);
        let (rule, laws) = (error_rule(cell.kind), body.cell_laws(i));
        let is_enhanced = body.element(cell.kind).formulation() == Formulation::Enhanced;
        for (solution, stresses) in std::iter::zip(solutions, &mut stresses) {
            computed(body, cell, solution, i, rule, stresses)?;
        }
        found.products.iter_mut().for_each(|products| products.push(0.0));
        let mut error = CellError { cell: part.original_cells[i], ..CellError::default() };
        for (p, point) in rule.iter().enumerate() {
            let geometry = PointGeometry::new(cell.kind, &x[..n], point)?;
            let volume = geometry.area * body.thickness();
            let law = laws.at(&geometry.n[..n]);
            let compliance = Compliance::of(&law);
            for (k, at) in points.iter_mut().enumerate() {
                let u = solutions[k].u;
                let of_element = match stresses[k].get(p) {
                    Some(stress) => *stress,
                    None => law.stress(strain(&geometry, cell, u)),
                };
                let mut difference = of_element.map(|s| -s);
                for (&node, shape) in std::iter::zip(cell.nodes(), geometry.n) {
                    (0..3).for_each(|c| difference[c] += shape * nodal[k][node as usize][c]);
                }
                if k == 0 {
                    error.energy2 += volume * compliance.product(&difference, &difference);
                    let energy = compliance.product(&of_element, &of_element);
                    // Strains that heat makes may cancel those of the stresses.
                    let heat = law.stress([0.0; 3]);
                    found.sums[1] += volume * energy;
                    let unloaded = NO_STRAIN * NO_STRAIN * law.h[0][0];
                    let heat = compliance.product(&heat, &heat);
                    found.sums[2] += volume * (energy + heat + unloaded / (ROUND_OFF * ROUND_OFF));
                }
                let mut enhanced = [0.0; 3];
                if is_enhanced && cell.kind == ElementKind::Quad4 {
                    let plain = law.stress(strain(&geometry, cell, u));
                    (0..3).for_each(|c| enhanced[c] = of_element[c] - plain[c]);
                }
                *at = AtPoint { missing: std::array::from_fn(|c| difference[c] + enhanced[c]), enhanced };
            }
            error.volume += volume;
            for (products, changed) in std::iter::zip(&mut found.products, &points[1..]) {
                let part =
                    |a: &Plane, b: &Plane| compliance.product(a, &std::array::from_fn(|c| b[c] - a[c]));
                let at = &points[0];
                products[i] +=
                    volume * (part(&at.missing, &changed.missing) - part(&at.enhanced, &changed.enhanced));
            }
        }
        found.sums[0] += error.energy2;
        found.cells.push(error);
    }
    Ok(found)
}

/// s_h at the points of the `rule`; none where it is that of the displacements alone.
fn computed(
    body: &Body,
    cell: &Cell,
    solution: &Solved,
    index: usize,
    rule: &[QuadraturePoint],
    stresses: &mut Vec<Plane>,
) -> Result<()> {
    stresses.clear();
    let at_points = solution.stresses.of(index);
    match (cell.kind, body.element(cell.kind).formulation()) {
        (ElementKind::Tri3, _) => stresses.resize(rule.len(), at_points[0]),
        (ElementKind::Quad4, _) => stresses.extend(at_points),
        (_, Formulation::Enhanced) => body.stresses_at(index, solution.u, rule, stresses)?,
        (_, Formulation::Standard | Formulation::Reduced) => {}
    }
    Ok(())
}

/// Strain (11, 22, 12) of the displacements alone.
fn strain(geometry: &PointGeometry, cell: &Cell, u: &[f64]) -> Plane {
    let mut strain = [0.0; 3];
    for (&node, d) in std::iter::zip(cell.nodes(), &geometry.gradient) {
        let u = &u[2 * node as usize..][..2];
        strain[0] += d[0] * u[0];
        strain[1] += d[1] * u[1];
        strain[2] += d[1] * u[0] + d[0] * u[1];
    }
    strain
}

/// H^-1, 1/Pa, of a law whose normal and shear stresses do not mix.
struct Compliance {
    normal: [[f64; 2]; 2],
    shear: f64,
}

impl Compliance {
    fn of(law: &PointLaw) -> Compliance {
        let h = &law.h;
        let per_det = 1.0 / (h[0][0] * h[1][1] - h[0][1] * h[1][0]);
        let normal = [[h[1][1] * per_det, -h[0][1] * per_det], [-h[1][0] * per_det, h[0][0] * per_det]];
        Compliance { normal, shear: 1.0 / h[2][2] }
    }

    /// r : H^-1 s, J/m3.
    fn product(&self, r: &Plane, s: &Plane) -> f64 {
        let [a, b] = self.normal.map(|row| row[0] * s[0] + row[1] * s[1]);
        r[0] * a + r[1] * b + r[2] * self.shear * s[2]
    }
}
