//! A small finite element program for the element tests: structured meshes, band Cholesky, no MPI.
// Each test program uses its own part of this.
#![allow(dead_code)]
use kontakt::case::{Analysis, MaterialCase, Property};
use kontakt::element::{ElementKind, PointLaw, SolidElement, body_load, facet_load};
use kontakt::material::LinearElastic;

pub const PLANE_STRESS: Analysis = Analysis::PlaneStress { thickness: 1. };
pub const PLANE_STRAIN: Analysis = Analysis::PlaneStrain { thickness: 1. };

pub fn material(young: f64, poisson: f64, analysis: Analysis) -> LinearElastic {
    let case = MaterialCase {
        name: "test".into(),
        young: Property::Constant(young),
        poisson: Property::Constant(poisson),
        expansion: Some(Property::Constant(1e-5)),
        reference_temperature: 293.,
        plasticity: None,
    };
    LinearElastic::new(&case, analysis)
}

/// Every element with every formulation it has.
pub fn all_elements() -> Vec<SolidElement> {
    use kontakt::case::Formulation::{Enhanced, Reduced, Standard};
    let pairs =
        ElementKind::ALL.into_iter().flat_map(|kind| [Standard, Enhanced, Reduced].map(|f| (kind, f)));
    let elements: Vec<_> = pairs.filter_map(|(kind, f)| SolidElement::new(kind, Some(f)).ok()).collect();
    assert_eq!(elements.len(), 7);
    elements
}

pub struct Mesh {
    pub element: SolidElement,
    pub nodes: Vec<[f64; 3]>,
    pub cells: Vec<Vec<usize>>,
}

impl Mesh {
    /// nx x ny cells (each two triangles with alternating diagonals, or a quadrilateral) on the image of the
    /// unit square.
    pub fn grid(element: SolidElement, nx: usize, ny: usize, map: impl Fn(f64, f64) -> [f64; 2]) -> Mesh {
        let kind = element.kind();
        // Lattice with the mid-side points; nodes are numbered along its rows as cells ask for them.
        let point = |c: [usize; 2]| c[1] * (2 * nx + 1) + c[0];
        let mut cells = vec![];
        for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (2 * i, 2 * j))) {
            let corner = [[i, j], [i + 2, j], [i + 2, j + 2], [i, j + 2]];
            let split: &[&[usize]] = match kind {
                ElementKind::Quad4 | ElementKind::Quad8 => &[&[0, 1, 2, 3]],
                _ if (i + j) % 4 == 0 => &[&[0, 1, 2], &[0, 2, 3]],
                _ => &[&[0, 1, 3], &[1, 2, 3]],
            };
            for corners in split {
                let n = corners.len();
                let mut cell: Vec<usize> = corners.iter().map(|&c| point(corner[c])).collect();
                if kind.n_nodes() > n {
                    for a in 0..n {
                        let (p, q) = (corner[corners[a]], corner[corners[(a + 1) % n]]);
                        cell.push(point([(p[0] + q[0]) / 2, (p[1] + q[1]) / 2]));
                    }
                }
                cells.push(cell);
            }
        }
        let mut used: Vec<usize> = cells.concat();
        used.sort_unstable();
        used.dedup();
        for node in cells.iter_mut().flatten() {
            *node = used.binary_search(node).unwrap();
        }
        let position = |p: &usize| {
            let (i, j) = (p % (2 * nx + 1), p / (2 * nx + 1));
            let [x, y] = map(i as f64 / (2 * nx) as f64, j as f64 / (2 * ny) as f64);
            [x, y, 0.]
        };
        Mesh { element, nodes: used.iter().map(position).collect(), cells }
    }

    pub fn coordinates(&self, nodes: &[usize]) -> Vec<[f64; 3]> {
        nodes.iter().map(|&n| self.nodes[n]).collect()
    }

    /// Facets that belong to one cell only.
    pub fn boundary(&self) -> Vec<Vec<usize>> {
        let mut count = std::collections::BTreeMap::new();
        for cell in &self.cells {
            for facet in self.element.kind().facets() {
                let nodes: Vec<usize> = facet.iter().map(|&a| cell[a]).collect();
                let key = [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])];
                count.entry(key).or_insert_with(Vec::new).push(nodes);
            }
        }
        count.into_values().filter(|f| f.len() == 1).map(|mut f| f.remove(0)).collect()
    }

    /// The node at a point.
    pub fn at(&self, x: f64, y: f64) -> usize {
        self.nodes.iter().position(|p| (p[0] - x).hypot(p[1] - y) < 1e-9).expect("a node there")
    }

    /// Nodal values of a cell.
    pub fn local(&self, cell: &[usize], u: &[f64]) -> Vec<f64> {
        cell.iter().flat_map(|&n| [u[2 * n], u[2 * n + 1]]).collect()
    }
}

/// K u = f with a symmetric band matrix; thickness 1.
pub struct System<'m, L: Fn(&[f64; 3]) -> PointLaw> {
    pub mesh: &'m Mesh,
    law: L,
    width: usize,
    k: Vec<f64>,
    pub f: Vec<f64>,
}

impl<'m, L: Fn(&[f64; 3]) -> PointLaw> System<'m, L> {
    /// Stiffness and initial strain load; `law(x)`.
    pub fn new(mesh: &'m Mesh, law: L) -> Self {
        let spread = |cell: &Vec<usize>| cell.iter().max().unwrap() - cell.iter().min().unwrap();
        let width = 2 * mesh.cells.iter().map(spread).max().unwrap() + 2;
        let n_dofs = 2 * mesh.nodes.len();
        let mut system = System { mesh, law, width, k: vec![0.; n_dofs * width], f: vec![0.; n_dofs] };
        let n = 2 * mesh.element.kind().n_nodes();
        let (mut k, mut f) = (vec![0.; n * n], vec![0.; n]);
        for cell in &mesh.cells {
            let x = mesh.coordinates(cell);
            let law = |_: usize, n: &[f64]| (system.law)(&interpolate(&x, n));
            mesh.element.stiffness(&x, 1., law, &mut k, &mut f).unwrap();
            let dof = |i: usize| 2 * cell[i / 2] + i % 2;
            for i in 0..n {
                system.f[dof(i)] += f[i];
                for j in (0..n).filter(|&j| dof(j) <= dof(i)) {
                    system.k[dof(i) * width + dof(i) - dof(j)] += k[i * n + j];
                }
            }
        }
        system
    }

    pub fn body_load(&mut self, b: impl Fn(&[f64; 3]) -> [f64; 3]) {
        for cell in &self.mesh.cells {
            let mut f = vec![0.; 2 * cell.len()];
            body_load(self.mesh.element.kind(), &self.mesh.coordinates(cell), 1., &b, &mut f).unwrap();
            self.add(cell, &f);
        }
    }

    /// Traction (x, n) on the facets whose ends are chosen.
    pub fn traction(
        &mut self,
        chosen: impl Fn(&[f64; 3]) -> bool,
        traction: impl Fn(&[f64; 3], &[f64; 3]) -> [f64; 3],
    ) {
        for facet in self.mesh.boundary() {
            let x = self.mesh.coordinates(&facet);
            if x[..2].iter().all(&chosen) {
                let mut f = vec![0.; 2 * facet.len()];
                facet_load(&x, 1., &traction, &mut f);
                self.add(&facet, &f);
            }
        }
    }

    fn add(&mut self, nodes: &[usize], f: &[f64]) {
        for (&node, f) in nodes.iter().zip(f.chunks_exact(2)) {
            self.f[2 * node] += f[0];
            self.f[2 * node + 1] += f[1];
        }
    }

    /// Displacements with the given values (dof, value) prescribed.
    pub fn solve(mut self, prescribed: &[(usize, f64)]) -> Vec<f64> {
        let (n, w) = (self.f.len(), self.width);
        for &(dof, value) in prescribed {
            for j in dof.saturating_sub(w - 1)..(dof + w).min(n) {
                let entry = &mut self.k[dof.max(j) * w + dof.abs_diff(j)];
                self.f[j] -= *entry * value;
                *entry = 0.;
            }
            self.k[dof * w] = 1.;
        }
        for &(dof, value) in prescribed {
            self.f[dof] = value;
        }
        cholesky_solve(&mut self.k, w, &mut self.f);
        self.f
    }

    /// Total strain and stress at each quadrature point of each cell, with the position of the point.
    pub fn strains_and_stresses(&self, u: &[f64]) -> Vec<[[f64; 3]; 3]> {
        let element = self.mesh.element;
        let (mut all, mut geometry, mut strains) = (vec![], vec![], vec![]);
        for cell in &self.mesh.cells {
            let x = self.mesh.coordinates(cell);
            let law = |_: usize, n: &[f64]| (self.law)(&interpolate(&x, n));
            element.geometry(&x, &mut geometry).unwrap();
            element.strains(&x, &geometry, &self.mesh.local(cell, u), law, &mut strains).unwrap();
            for (point, strain) in element.points().iter().zip(&strains) {
                let position = interpolate(&x, &element.kind().shape(&point.xi).n);
                all.push([position, *strain, (self.law)(&position).stress(*strain)]);
            }
        }
        all
    }
}

pub fn interpolate(x: &[[f64; 3]], n: &[f64]) -> [f64; 3] {
    std::array::from_fn(|i| x.iter().zip(n).map(|(x, n)| x[i] * n).sum())
}

/// Band Cholesky: entry (i, j), j <= i, at k[i w + i - j]; the solution replaces f.
fn cholesky_solve(k: &mut [f64], w: usize, f: &mut [f64]) {
    let n = f.len();
    // Row i from its first column, reversed, makes the inner products run over contiguous memory.
    for i in 0..n {
        let first = i.saturating_sub(w - 1);
        for j in first..=i {
            let start = first.max(j.saturating_sub(w - 1));
            let (head, row) = k.split_at_mut(i * w);
            let sum: f64 = if i == j {
                row[1..=i - start].iter().map(|a| a * a).sum()
            } else {
                let other = &head[j * w + 1..j * w + 1 + j - start];
                row[i - j + 1..=i - start].iter().zip(other).map(|(a, b)| a * b).sum()
            };
            let value = row[i - j] - sum;
            row[i - j] = if i == j {
                assert!(value > 0., "dof {i}: not positive definite");
                value.sqrt()
            } else {
                value / head[j * w]
            };
        }
    }
    for i in 0..n {
        for j in i.saturating_sub(w - 1)..i {
            f[i] -= k[i * w + i - j] * f[j];
        }
        f[i] /= k[i * w];
    }
    for i in (0..n).rev() {
        f[i] /= k[i * w];
        for j in i.saturating_sub(w - 1)..i {
            f[j] -= k[i * w + i - j] * f[i];
        }
    }
}
