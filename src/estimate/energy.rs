//! Energy of the difference between recovered and computed stresses.
use super::{plane::Plane, recovery::recovered};
use crate::{
    body::{Body, Fields},
    element::{ElementKind, Formulation, MAX_NODES, PointGeometry, PointLaw, QuadraturePoint, error_rule},
    error::Result,
    mesh::Cell,
    parallel::{self, agree},
};
use mpi::topology::SimpleCommunicator;

/// Differences of stresses below this share of what the strains would make without cancellation are round-off.
const ROUND_OFF: f64 = 1e-10;

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

    /// Estimates the error of a body from its stresses. Collective on the group.
    pub(crate) fn new(
        body: &Body,
        index: usize,
        group: &SimpleCommunicator,
        u: &[f64],
        fields: &Fields,
    ) -> Result<(Self, Defect)> {
        let nodal = recovered(body, group, fields)?;
        let mut defect = Defect::default();
        let found = agree(group, cell_errors(body, u, fields, &nodal, &mut defect))?;
        let (mut cells, sums) = found;
        let sums = parallel::sum(group, &sums);
        let [mut error2, energy2, scale2] = [sums[0], sums[1], sums[2]];
        if error2 <= ROUND_OFF.powi(2) * scale2 {
            error2 = 0.0;
            cells.iter_mut().for_each(|cell| cell.energy2 = 0.0);
        }
        Ok((BodyError { body: index, cells, error2, energy2 }, defect))
    }
}

/// Stresses at a point, Pa.
#[derive(Debug, Clone, Copy, Default)]
struct AtPoint {
    /// Recovered less those of the displacements.
    missing: Plane,
    /// Of the element, with its enhanced strains, less those of the displacements.
    enhanced: Plane,
}

/// What the stresses of a solution lack, at the points of the error rule, own cell by own cell.
#[derive(Debug, Clone, Default)]
pub(crate) struct Defect(Vec<AtPoint>);

impl Defect {
    /// Scalar product in energy of the errors of two solutions in each own cell, J: of this one, and of what `u` differs from
    /// it by.
    ///
    /// With recovered stresses s*, stresses of the element s_h, and s_u those of the displacements alone, it is
    /// int (s* - s_u) : C^-1 (s* - s_u)' - (s_h - s_u) : C^-1 (s_h - s_u)' t dA of both: the error of the work of the one's
    /// forces on the other's displacements. Without enhanced strains s_h = s_u. Collective on the group.
    pub fn products(
        &self,
        body: &Body,
        group: &SimpleCommunicator,
        u: &[f64],
        fields: &Fields,
    ) -> Result<Vec<f64>> {
        let nodal = recovered(body, group, fields)?;
        let mut other = Defect::default();
        agree(group, cell_errors(body, u, fields, &nodal, &mut other))?;
        let (part, mut points) = (&body.part, std::iter::zip(&self.0, &other.0));
        let mut x = [[0.0; 3]; MAX_NODES];
        let of_cell = |cell: &Cell| {
            let n = cell.kind.n_nodes();
            std::iter::zip(&mut x, cell.nodes()).for_each(|(x, &node)| *x = part.points[node as usize]);
            let mut sum = 0.0;
            for (point, (a, b)) in std::iter::zip(error_rule(cell.kind), &mut points) {
                let geometry = PointGeometry::new(cell.kind, &x[..n], point)?;
                let law = body.law(cell, &geometry.n[..n]);
                let part = |a: &Plane, b: &Plane| {
                    complementary_product(&law, a, &std::array::from_fn(|c| b[c] - a[c]))
                };
                let density = part(&a.missing, &b.missing) - part(&a.enhanced, &b.enhanced);
                sum += geometry.area * body.thickness() * density;
            }
            Ok(sum)
        };
        agree(group, part.cells[..part.n_own_cells].iter().map(of_cell).collect())
    }
}

/// sqrt(error2 / (energy2 + error2)); zero where there is neither.
pub(super) fn relative(error2: f64, energy2: f64) -> f64 {
    if error2 > 0.0 { (error2 / (energy2 + error2)).sqrt() } else { 0.0 }
}

/// Errors of the own cells, and the sums of |e|^2, |u_h|^2 and of what round-off is measured against.
fn cell_errors(
    body: &Body,
    u: &[f64],
    fields: &Fields,
    nodal: &[Plane],
    defect: &mut Defect,
) -> Result<(Vec<CellError>, [f64; 3])> {
    let part = &body.part;
    let (mut cells, mut sums) = (Vec::with_capacity(part.n_own_cells), [0.0; 3]);
    let (mut x, mut stresses) = ([[0.0; 3]; MAX_NODES], Vec::new());
    for (i, cell) in part.cells[..part.n_own_cells].iter().enumerate() {
        let n = cell.kind.n_nodes();
        std::iter::zip(&mut x, cell.nodes()).for_each(|(x, &node)| *x = part.points[node as usize]);
        let rule = error_rule(cell.kind);
        let enhances =
            cell.kind == ElementKind::Quad4 && body.element(cell.kind).formulation() == Formulation::Enhanced;
        computed(body, cell, u, fields.points_of(i), rule, &mut stresses)?;
        let mut error = CellError { cell: part.original_cells[i], ..CellError::default() };
        for (point, computed) in std::iter::zip(rule, &stresses) {
            let geometry = PointGeometry::new(cell.kind, &x[..n], point)?;
            let volume = geometry.area * body.thickness();
            let law = body.law(cell, &geometry.n[..n]);
            let mut difference = computed.map(|s| -s);
            for (&node, shape) in std::iter::zip(cell.nodes(), geometry.n) {
                (0..3).for_each(|c| difference[c] += shape * nodal[node as usize][c]);
            }
            defect.0.push(match enhances {
                false => AtPoint { missing: difference, enhanced: [0.0; 3] },
                true => {
                    let plain = law.stress(strain(&geometry, cell, u));
                    let enhanced: Plane = std::array::from_fn(|c| computed[c] - plain[c]);
                    AtPoint { missing: std::array::from_fn(|c| difference[c] + enhanced[c]), enhanced }
                }
            });
            error.volume += volume;
            error.energy2 += volume * complementary(&law, &difference);
            let energy = complementary(&law, computed);
            // Strains that heat makes may cancel those of the stresses.
            let heat = law.stress([0.0; 3]);
            sums[1] += volume * energy;
            let unloaded = NO_STRAIN * NO_STRAIN * law.h[0][0];
            sums[2] += volume * (energy + complementary(&law, &heat) + unloaded / (ROUND_OFF * ROUND_OFF));
        }
        sums[0] += error.energy2;
        cells.push(error);
    }
    Ok((cells, sums))
}

/// sigma_h at the points of the `rule`: those of the element are at hand.
fn computed(
    body: &Body,
    cell: &Cell,
    u: &[f64],
    at_points: &[Plane],
    rule: &[QuadraturePoint],
    stresses: &mut Vec<Plane>,
) -> Result<()> {
    stresses.clear();
    match cell.kind {
        ElementKind::Tri3 => stresses.resize(rule.len(), at_points[0]),
        ElementKind::Quad4 => stresses.extend(at_points),
        ElementKind::Tri6 | ElementKind::Quad8 => body.stresses_at(cell, u, rule, stresses)?,
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

/// s : H^-1 s, J/m3, of a law whose normal and shear stresses do not mix.
fn complementary(law: &PointLaw, s: &Plane) -> f64 {
    complementary_product(law, s, s)
}

/// r : H^-1 s, J/m3.
fn complementary_product(law: &PointLaw, r: &Plane, s: &Plane) -> f64 {
    let h = &law.h;
    let det = h[0][0] * h[1][1] - h[0][1] * h[1][0];
    (h[1][1] * r[0] * s[0] + h[0][0] * r[1] * s[1] - h[0][1] * r[0] * s[1] - h[1][0] * r[1] * s[0]) / det
        + r[2] * s[2] / h[2][2]
}
