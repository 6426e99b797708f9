//! Stiffness, strains and internal forces of a solid element.
//!
//! Every element is a set of displacement modes: its shape functions and, in the enhanced quad4 and tri6,
//! internal modes, whose amplitudes are eliminated inside the element. Strain B u and force B^T
//! sigma are formed mode by mode in [`strain_of`] and [`force_of`]; the material enters only through
//! [`PointLaw`].
//!
//! Incompatible modes of the quad4 m = 1, 2, in the form of Simo and Rifai, Int. J. Numer. Meth. Engng 29 (1990) 1595
//! (four parameters), which is that of Taylor, Beresford and Wilson, ibid. 10 (1976) 1211: the modes xi_m^2 /
//! 2 with the gradient det J0 / det J  xi_m  J0^-T e_m, J0 the Jacobian at the centre. Its integral over the
//! element is zero on any shape, so that the patch test holds.
//!
//! The enhanced tri6 has the bubble 27 L1 L2 L3, its gradient formed in the same way, and a dilatation that is
//! linear in the element ([`Dilatation`]): the conforming element of Crouzeix and Raviart (RAIRO R3 (1973) 33)
//! with its pressures eliminated, stable near incompressibility (Fortin, Int. J. Numer. Meth. Fluids 1 (1981) 347).
use super::Formulation;
use super::dilatation::Dilatation;
use super::geometry::{Gradients, Jacobian};
use super::{ElementKind, MAX_NODES, PointGeometry, QuadraturePoint, stiffness_rule};
use crate::{Result, vector::larger};

/// What the material says at one quadrature point: sigma = H (eps - eps0) + sigma0, Voigt order (11, 22, 12) with
/// gamma12 = 2 eps12. A law that is not linear says it of its tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLaw {
    /// H, symmetric, Pa.
    pub h: [[f64; 3]; 3],
    /// eps0.
    pub initial_strain: [f64; 3],
    /// sigma0, Pa.
    pub initial_stress: [f64; 3],
}

impl PointLaw {
    /// H (eps - eps0) + sigma0, Pa.
    pub fn stress(&self, strain: [f64; 3]) -> [f64; 3] {
        let elastic: [f64; 3] = std::array::from_fn(|i| strain[i] - self.initial_strain[i]);
        let stress = times(&self.h, &elastic);
        std::array::from_fn(|i| stress[i] + self.initial_stress[i])
    }
}

/// A kind with a formulation that fits it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SolidElement {
    kind: ElementKind,
    formulation: Formulation,
}

/// The formulation an element kind uses: the one asked for, or its default.
///
/// Defaults: quad4 enhanced, quad8 reduced, because these lock neither in bending nor near incompressibility;
/// triangles standard. With 2 x 2 points a quad8 has one free mode more than the rigid ones, which no two
/// neighbours share: a body of a single reduced quad8 is not held by supports that would hold a rigid body.
/// The text of an error says what the kind can do.
pub fn resolve(kind: ElementKind, asked: Option<Formulation>) -> std::result::Result<Formulation, String> {
    use Formulation::{Enhanced, Reduced, Standard};
    match (kind, asked) {
        (ElementKind::Quad4, None | Some(Enhanced)) | (ElementKind::Tri6, Some(Enhanced)) => Ok(Enhanced),
        (ElementKind::Quad8, None | Some(Reduced)) => Ok(Reduced),
        (ElementKind::Tri3 | ElementKind::Tri6, None) | (_, Some(Standard)) => Ok(Standard),
        (_, Some(Enhanced)) => Err(format!(
            "{} elements have no enhanced formulation: only quad4 and tri6 have one",
            kind.name()
        )),
        (_, Some(Reduced)) => {
            Err(format!("{} elements have no reduced formulation: only quad8 has one", kind.name()))
        }
    }
}

/// Iterations inside an element with internal modes after which it is given up.
const LOCAL_ITERATIONS: usize = 25;

/// Least share of the way to its next amplitudes that an iteration takes inside an element.
const LEAST_SHARE: f64 = 1. / 16.;

/// Forces on internal modes, relative to the sum of their parts, that are none.
const LOCAL_TOLERANCE: f64 = 1e-12;

/// A pivot of the internal modes is at least this share of their largest one: without hardening it may vanish.
const LEAST_PIVOT: f64 = 1e-12;

/// Most internal modes.
const MAX_INTERNAL: usize = 2;

/// Components times the most displacement modes.
const MAX_DOFS: usize = 2 * MAX_NODES;

/// The element with all its modes, before the internal ones are eliminated. H is symmetric and so is k: only its
/// entries up to the diagonal count.
struct Full {
    k: [[f64; MAX_DOFS]; MAX_DOFS],
    f: [f64; MAX_DOFS],
}

/// An element's points, with the gradients of all its modes there.
struct Inside<'e> {
    geometry: &'e [PointGeometry],
    gradients: &'e [Gradients],
    dilatation: Option<&'e Dilatation>,
}

/// What [`SolidElement::respond`] works in, to be used again for the next element.
pub struct Workspace {
    full: Full,
    gradients: Vec<Gradients>,
}

impl Default for Workspace {
    fn default() -> Self {
        Workspace { full: Full::zero(), gradients: Vec::new() }
    }
}

impl Full {
    fn zero() -> Full {
        Full { k: [[0.; MAX_DOFS]; MAX_DOFS], f: [0.; MAX_DOFS] }
    }
}

impl SolidElement {
    /// The element of this kind; `None` takes the kind's default formulation ([`resolve`]).
    pub fn new(kind: ElementKind, formulation: Option<Formulation>) -> std::result::Result<Self, String> {
        Ok(SolidElement { kind, formulation: resolve(kind, formulation)? })
    }

    /// Kind.
    pub fn kind(&self) -> ElementKind {
        self.kind
    }

    /// Formulation.
    pub fn formulation(&self) -> Formulation {
        self.formulation
    }

    /// Quadrature points of stiffness, strains and stresses.
    pub fn points(&self) -> &'static [QuadraturePoint] {
        stiffness_rule(self.kind, self.formulation)
    }

    /// Stiffness `k` (2n x 2n, row-major, dof = 2 node + component, N/m) and the load of the initial strain
    /// `f` = int B^T (H eps0 - sigma0) t dA (N); both are overwritten. Nodal forces are k u - f.
    ///
    /// `x`: node coordinates, m; `thickness`, m; `law(point, N)`: the law at a quadrature point, given its
    /// index and the shape functions there (to interpolate nodal values such as the temperature).
    pub fn stiffness(
        &self,
        x: &[[f64; 3]],
        thickness: f64,
        mut law: impl FnMut(usize, &[f64]) -> PointLaw,
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<()> {
        let mut full = Full::zero();
        let center = self.center(x)?;
        let dilatation = match self.projects() {
            true => {
                let mut geometry = Vec::new();
                self.geometry(x, &mut geometry)?;
                self.dilatation(&center, &geometry)
            }
            false => None,
        };
        for (index, point) in self.points().iter().enumerate() {
            let geometry = PointGeometry::new(self.kind, x, point)?;
            let law = law(index, &geometry.n[..self.kind.n_nodes()]);
            let gradients = self.gradients(&center, &geometry, point);
            let volume = geometry.area * thickness;
            match &dilatation {
                None => self.add_point(&mut full, 0, &gradients, &law, volume),
                Some(linear) => {
                    let change = linear.change(point, &gradients);
                    self.add_projected_point(&mut full, 0, &gradients, &change, &law, volume);
                }
            }
        }
        self.eliminate_internal(&mut full, 0);
        let n = 2 * self.kind.n_nodes();
        for (i, row) in full.k[..n].iter().enumerate() {
            for (j, entry) in row[..=i].iter().enumerate() {
                k[i * n + j] = *entry;
                k[j * n + i] = *entry;
            }
        }
        f.copy_from_slice(&full.f[..n]);
        Ok(())
    }

    /// The element at each of its quadrature points; `geometry` is overwritten.
    pub fn geometry(&self, x: &[[f64; 3]], geometry: &mut Vec<PointGeometry>) -> Result<()> {
        geometry.clear();
        for point in self.points() {
            geometry.push(PointGeometry::new(self.kind, x, point)?);
        }
        Ok(())
    }

    /// Total in-plane strain (11, 22, gamma12) at each quadrature point for nodal displacements `u` (m; 2n for each of one or
    /// several fields), the enhanced part included; `strains`, overwritten, has those of one field after those of the other.
    /// `geometry`: by [`Self::geometry`]; `law` as in [`Self::stiffness`].
    pub fn strains(
        &self,
        x: &[[f64; 3]],
        geometry: &[PointGeometry],
        u: &[f64],
        law: impl FnMut(usize, &[f64]) -> PointLaw,
        strains: &mut Vec<[f64; 3]>,
    ) -> Result<()> {
        let center = self.center(x)?;
        let internal = self.internal(&center, geometry, law);
        let dilatation = self.dilatation(&center, geometry);
        strains.clear();
        for u in u.chunks_exact(2 * self.kind.n_nodes()) {
            let amplitudes = self.amplitudes(internal.as_ref(), u);
            for (point, geometry) in self.points().iter().zip(geometry) {
                let gradients = self.gradients(&center, geometry, point);
                strains.push(self.strain(point, &gradients, dilatation.as_ref(), &amplitudes));
            }
        }
        Ok(())
    }

    /// Brings the internal modes to equilibrium with nodal displacements `u` (m, 2n) under a law that is not linear, by Newton
    /// iterations inside the element: `laws`, at each quadrature point, are those to begin with, and then what `answer`(point, strain)
    /// says of the strains (11, 22, gamma12) there. False if they do not settle. `work` may be of another element.
    pub fn respond(
        &self,
        x: &[[f64; 3]],
        geometry: &[PointGeometry],
        u: &[f64],
        laws: &mut [PointLaw],
        work: &mut Workspace,
        mut answer: impl FnMut(usize, [f64; 3]) -> PointLaw,
    ) -> Result<bool> {
        let center = self.center(x)?;
        let dilatation = self.dilatation(&center, geometry);
        let Workspace { full, gradients } = work;
        gradients.clear();
        let points = self.points().iter().zip(geometry);
        gradients.extend(points.map(|(point, geometry)| self.gradients(&center, geometry, point)));
        let inside = Inside { geometry, gradients, dilatation: dilatation.as_ref() };
        let mut last: Option<([f64; MAX_DOFS], f64)> = None;
        for _ in 0..LOCAL_ITERATIONS {
            let mut target = [0.; MAX_DOFS];
            target[..u.len()].copy_from_slice(u);
            if self.n_modes() > self.kind.n_nodes() {
                self.linearise_internal(full, &inside, laws);
                self.recover_internal(full, &mut target);
            }
            let mut share = 1.;
            loop {
                let amplitudes = match &last {
                    Some((from, _)) if share < 1. => {
                        std::array::from_fn(|i| from[i] + share * (target[i] - from[i]))
                    }
                    _ => target,
                };
                let (residual, none) = self.internal_residual(&inside, &amplitudes, laws, &mut answer);
                // One that is not finite is seen in the forces at the nodes.
                if residual <= none || !residual.is_finite() {
                    return Ok(true);
                }
                let is_worse = last.as_ref().is_some_and(|(_, before)| residual > *before);
                if !is_worse || share <= LEAST_SHARE {
                    last = Some((amplitudes, residual));
                    break;
                }
                share *= 0.5;
            }
        }
        Ok(false)
    }

    /// The equations of the internal modes at the points' laws, eliminated.
    fn linearise_internal(&self, full: &mut Full, inside: &Inside, laws: &[PointLaw]) {
        let first = 2 * self.kind.n_nodes();
        let rows = first..2 * self.n_modes();
        full.k[rows.clone()].iter_mut().for_each(|row| row.fill(0.));
        full.f[rows].fill(0.);
        let points = self.points().iter().zip(inside.geometry).zip(inside.gradients);
        for (((point, geometry), gradients), law) in points.zip(laws) {
            self.add_internal(full, point, gradients, inside.dilatation, law, geometry.area);
        }
        self.eliminate_internal(full, first);
    }

    /// Largest force on an internal mode when all modes have these `amplitudes`, m, and the force that is none; `laws` are then those at
    /// the strains.
    fn internal_residual(
        &self,
        inside: &Inside,
        amplitudes: &[f64; MAX_DOFS],
        laws: &mut [PointLaw],
        answer: &mut impl FnMut(usize, [f64; 3]) -> PointLaw,
    ) -> (f64, f64) {
        let n = self.kind.n_nodes();
        // The sizes of what the forces are the sum of, and what round-off of the strains makes of them.
        let (mut residual, mut size, mut round_off) = ([0.; 2 * MAX_INTERNAL], 0., 0.);
        let norm = |g: &[f64; 3]| g[0].abs() + g[1].abs();
        let points = self.points().iter().zip(inside.geometry).zip(inside.gradients);
        for (p, ((point, geometry), gradients)) in points.enumerate() {
            let strain = self.strain(point, gradients, inside.dilatation, amplitudes);
            laws[p] = answer(p, strain);
            if self.n_modes() == n {
                continue;
            }
            let stress = laws[p].stress(strain).map(|s| s * geometry.area);
            let change = inside.dilatation.map(|linear| linear.change(point, gradients));
            let parts = gradients[..self.n_modes()].iter().zip(amplitudes.chunks_exact(2));
            let rounded = parts.map(|(g, u)| norm(g) * (u[0].abs() + u[1].abs())).sum::<f64>();
            for m in n..self.n_modes() {
                round_off += laws[p].h[0][0] * geometry.area * rounded * norm(&gradients[m]);
                let mut force = force_of(&gradients[m], &stress);
                if let Some(change) = &change {
                    let pressure = stress[0] + stress[1];
                    (0..2).for_each(|c| force[c] += change[m][c] * pressure);
                }
                for c in 0..2 {
                    residual[2 * (m - n) + c] += force[c];
                    size += force[c].abs();
                }
            }
        }
        let residual = residual.iter().fold(0., |most, r| larger(most, r.abs()));
        (residual, LOCAL_TOLERANCE * size + f64::EPSILON * round_off)
    }

    /// The same at any `points` of the element; `law` is asked at its own.
    pub fn strains_at(
        &self,
        points: &[QuadraturePoint],
        x: &[[f64; 3]],
        u: &[f64],
        law: impl FnMut(usize, &[f64]) -> PointLaw,
        strains: &mut Vec<[f64; 3]>,
    ) -> Result<()> {
        let center = self.center(x)?;
        let mut geometry = Vec::new();
        if self.n_modes() > self.kind.n_nodes() {
            self.geometry(x, &mut geometry)?;
        }
        let amplitudes = self.amplitudes(self.internal(&center, &geometry, law).as_ref(), u);
        let dilatation = self.dilatation(&center, &geometry);
        strains.clear();
        for point in points {
            let geometry = PointGeometry::new(self.kind, x, point)?;
            let gradients = self.gradients(&center, &geometry, point);
            strains.push(self.strain(point, &gradients, dilatation.as_ref(), &amplitudes));
        }
        Ok(())
    }

    /// Internal forces `f` = int B^T sigma t dA (2n, N; overwritten) of in-plane stresses (11, 22, 12), Pa,
    /// at the quadrature points.
    pub fn internal_force(
        &self,
        geometry: &[PointGeometry],
        thickness: f64,
        stress: &[[f64; 3]],
        f: &mut [f64],
    ) {
        f.fill(0.);
        let nodal = |_: usize, geometry: &PointGeometry| geometry.gradient;
        let dilatation = self.projects().then(|| Dilatation::new(self.points(), geometry, nodal));
        for ((point, geometry), stress) in self.points().iter().zip(geometry).zip(stress) {
            let volume = geometry.area * thickness;
            let stress = stress.map(|s| s * volume);
            for (node, g) in f.chunks_exact_mut(2).zip(&geometry.gradient) {
                let force = force_of(g, &stress);
                node[0] += force[0];
                node[1] += force[1];
            }
            if let Some(linear) = &dilatation {
                let change = linear.change(point, &geometry.gradient);
                for (node, d) in f.chunks_exact_mut(2).zip(change) {
                    node[0] += d[0] * (stress[0] + stress[1]);
                    node[1] += d[1] * (stress[0] + stress[1]);
                }
            }
        }
    }

    /// The equations of the internal modes, k_ii u_i = f_i - k_in u_n, with one after the other eliminated; `None` without such
    /// modes.
    fn internal(
        &self,
        center: &Jacobian,
        geometry: &[PointGeometry],
        mut law: impl FnMut(usize, &[f64]) -> PointLaw,
    ) -> Option<Full> {
        let n = self.kind.n_nodes();
        (self.n_modes() > n).then(|| {
            let mut full = Full::zero();
            let dilatation = self.dilatation(center, geometry);
            for (index, (point, geometry)) in self.points().iter().zip(geometry).enumerate() {
                let law = law(index, &geometry.n[..n]);
                let gradients = self.gradients(center, geometry, point);
                self.add_internal(&mut full, point, &gradients, dilatation.as_ref(), &law, geometry.area);
            }
            self.eliminate_internal(&mut full, 2 * n);
            full
        })
    }

    /// Adds a point's share to the rows of the internal modes; the thickness cancels.
    fn add_internal(
        &self,
        full: &mut Full,
        point: &QuadraturePoint,
        gradients: &Gradients,
        dilatation: Option<&Dilatation>,
        law: &PointLaw,
        area: f64,
    ) {
        let n = self.kind.n_nodes();
        match dilatation {
            None => self.add_point(full, n, gradients, law, area),
            Some(linear) => {
                let change = linear.change(point, gradients);
                self.add_projected_point(full, n, gradients, &change, law, area);
            }
        }
    }

    /// Amplitudes of all modes, m, for nodal displacements `u`: the internal ones are at equilibrium.
    fn amplitudes(&self, internal: Option<&Full>, u: &[f64]) -> [f64; MAX_DOFS] {
        let mut amplitudes = [0.; MAX_DOFS];
        amplitudes[..u.len()].copy_from_slice(u);
        if let Some(full) = internal {
            self.recover_internal(full, &mut amplitudes);
        }
        amplitudes
    }

    /// B u at a point, where the modes have these gradients.
    fn strain(
        &self,
        point: &QuadraturePoint,
        gradients: &Gradients,
        dilatation: Option<&Dilatation>,
        amplitudes: &[f64; MAX_DOFS],
    ) -> [f64; 3] {
        let mut strain = [0.; 3];
        if let Some(linear) = dilatation {
            for (d, u) in linear.change(point, gradients).iter().zip(amplitudes.chunks_exact(2)) {
                let part = d[0] * u[0] + d[1] * u[1];
                strain[0] += part;
                strain[1] += part;
            }
        }
        for (g, u) in gradients[..self.n_modes()].iter().zip(amplitudes.chunks_exact(2)) {
            let part = strain_of(g, [u[0], u[1]]);
            strain = std::array::from_fn(|i| strain[i] + part[i]);
        }
        strain
    }

    /// Adds a point's share of k = int B^T H B t dA and f = int B^T (H eps0 - sigma0) t dA, of the modes from `first` on.
    #[inline]
    fn add_point(&self, full: &mut Full, first: usize, gradients: &Gradients, law: &PointLaw, volume: f64) {
        let modes = &gradients[..self.n_modes()];
        let h = law.h.map(|row| row.map(|h| h * volume));
        let relaxed = relaxed(&h, law, volume);
        for (a, g) in modes.iter().enumerate().skip(first) {
            let force = force_of(g, &relaxed);
            full.f[2 * a] += force[0];
            full.f[2 * a + 1] += force[1];
            // Two rows of B_a^T H.
            let row: [[f64; 3]; 2] = [
                std::array::from_fn(|j| g[0] * h[0][j] + g[1] * h[2][j]),
                std::array::from_fn(|j| g[1] * h[1][j] + g[0] * h[2][j]),
            ];
            for (k, row) in full.k[2 * a..][..2].iter_mut().zip(&row) {
                for (k, g) in k.chunks_exact_mut(2).zip(&modes[..=a]) {
                    let force = force_of(g, row);
                    k[0] += force[0];
                    k[1] += force[1];
                }
            }
        }
    }

    /// [`Self::add_point`] with B that `change` has given a linear dilatation.
    fn add_projected_point(
        &self,
        full: &mut Full,
        first: usize,
        gradients: &Gradients,
        change: &[[f64; 2]; MAX_NODES],
        law: &PointLaw,
        volume: f64,
    ) {
        let modes = self.n_modes();
        let b = |a: usize| -> [[f64; 3]; 2] {
            let (g, d) = (&gradients[a], &change[a]);
            [[g[0] + d[0], d[0], g[1]], [d[1], g[1] + d[1], g[0]]]
        };
        let dot = |p: &[f64; 3], q: &[f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let h = law.h.map(|row| row.map(|h| h * volume));
        let relaxed = relaxed(&h, law, volume);
        for a in first..modes {
            for (i, b_a) in b(a).iter().enumerate() {
                full.f[2 * a + i] += dot(b_a, &relaxed);
                let stress = times(&h, b_a);
                for (c, k) in full.k[2 * a + i].chunks_exact_mut(2).take(a + 1).enumerate() {
                    let b_c = b(c);
                    k[0] += dot(&b_c[0], &stress);
                    k[1] += dot(&b_c[1], &stress);
                }
            }
        }
    }

    /// True if the dilatation is projected onto the linear functions.
    fn projects(&self) -> bool {
        self.kind == ElementKind::Tri6 && self.formulation == Formulation::Enhanced
    }

    /// The dilatation of the modes, where it is projected.
    fn dilatation(&self, center: &Jacobian, geometry: &[PointGeometry]) -> Option<Dilatation> {
        let points = self.points();
        let gradients = |p: usize, geometry: &PointGeometry| self.gradients(center, geometry, &points[p]);
        self.projects().then(|| Dilatation::new(points, geometry, gradients))
    }

    /// Gaussian elimination of the internal amplitudes from the rows `first` on, the last one first. What is left in
    /// the leading block is the condensed element; the internal rows keep what [`Self::recover_internal`] needs.
    fn eliminate_internal(&self, full: &mut Full, first: usize) {
        let internal = 2 * self.kind.n_nodes()..2 * self.n_modes();
        let largest = internal.clone().fold(0., |most, p| larger(most, full.k[p][p]));
        for p in internal.rev() {
            full.k[p][p] = larger(full.k[p][p], LEAST_PIVOT * largest);
            let (row, f) = (full.k[p], full.f[p]);
            let pivot = 1. / row[p];
            for i in first..p {
                let factor = row[i] * pivot;
                for (k, entry) in full.k[i][..=i].iter_mut().zip(&row) {
                    *k -= factor * entry;
                }
                full.f[i] -= factor * f;
            }
        }
    }

    /// Internal amplitudes, m, from the nodal displacements in front of them.
    fn recover_internal(&self, full: &Full, u: &mut [f64; MAX_DOFS]) {
        for p in 2 * self.kind.n_nodes()..2 * self.n_modes() {
            let sum: f64 = full.k[p][..p].iter().zip(&u[..p]).map(|(k, u)| k * u).sum();
            u[p] = (full.f[p] - sum) / full.k[p][p];
        }
    }

    /// Number of displacement modes: nodes, and the internal modes of the enhanced quad4 (two) and tri6 (one).
    fn n_modes(&self) -> usize {
        match (self.formulation, self.kind) {
            (Formulation::Standard | Formulation::Reduced, _) => self.kind.n_nodes(),
            (Formulation::Enhanced, ElementKind::Tri6) => self.kind.n_nodes() + 1,
            (Formulation::Enhanced, _) => self.kind.n_nodes() + 2,
        }
    }

    /// Jacobian at the centre, J0.
    fn center(&self, x: &[[f64; 3]]) -> Result<Jacobian> {
        Jacobian::new(self.kind, x, &self.kind.shape(&self.kind.center()))
    }

    #[inline]
    fn gradients(&self, center: &Jacobian, geometry: &PointGeometry, point: &QuadraturePoint) -> Gradients {
        let mut gradients = geometry.gradient;
        if self.projects() {
            let [s, t, _] = point.xi;
            let bubble = [27. * t * (1. - 2. * s - t), 27. * s * (1. - s - 2. * t), 0.];
            gradients[self.kind.n_nodes()] = center.gradient(&bubble.map(|d| d * center.det / geometry.det));
            return gradients;
        }
        for (m, g) in gradients[self.kind.n_nodes()..self.n_modes()].iter_mut().enumerate() {
            let mut reference = [0.; 3];
            reference[m] = point.xi[m] * center.det / geometry.det;
            *g = center.gradient(&reference);
        }
        gradients
    }
}

/// B_a u_a: strain (11, 22, gamma12) of a mode with gradient `g`, 1/m, and amplitude `u`, m.
fn strain_of(g: &[f64; 3], u: [f64; 2]) -> [f64; 3] {
    [g[0] * u[0], g[1] * u[1], g[1] * u[0] + g[0] * u[1]]
}

/// B_a^T sigma: force per volume on a mode with gradient `g`, 1/m, by the stress (11, 22, 12), Pa.
fn force_of(g: &[f64; 3], stress: &[f64; 3]) -> [f64; 2] {
    [g[0] * stress[0] + g[1] * stress[2], g[1] * stress[1] + g[0] * stress[2]]
}

/// (H eps0 - sigma0) V, with H V given.
fn relaxed(h: &[[f64; 3]; 3], law: &PointLaw, volume: f64) -> [f64; 3] {
    let of_strain = times(h, &law.initial_strain);
    std::array::from_fn(|i| of_strain[i] - volume * law.initial_stress[i])
}

fn times(h: &[[f64; 3]; 3], v: &[f64; 3]) -> [f64; 3] {
    h.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use Formulation::{Enhanced, Reduced, Standard};

    #[test]
    fn defaults_and_refusals() {
        let default = |kind| resolve(kind, None).unwrap();
        assert_eq!(ElementKind::ALL.map(default), [Standard, Standard, Enhanced, Reduced]);
        for kind in ElementKind::ALL {
            assert_eq!(resolve(kind, Some(Standard)), Ok(Standard));
        }
        assert!(resolve(ElementKind::Tri3, Some(Enhanced)).unwrap_err().contains("tri3"));
        assert!(resolve(ElementKind::Quad8, Some(Enhanced)).unwrap_err().contains("only quad4 and tri6"));
        assert!(resolve(ElementKind::Quad4, Some(Reduced)).unwrap_err().contains("only quad8"));
    }
}
