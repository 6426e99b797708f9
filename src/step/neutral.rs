//! Rigid motions of a body along its own contact surfaces: a disc that spins, a block that slides on its flat side.
//!
//! However large, they change no gap, and no contact force can stop them. On a faceted surface, and with the round-off of
//! its normals, a little resistance and a little work of the loads are left over: to take them for real would turn the body
//! until huge forces balance next to nothing. So these motions are held, as in the analysis of a free structure by inertia
//! relief, and reported as free; loads that do work on them beyond what facets leave are refused. Where surfaces rub only friction
//! resists such a motion: pressures, whose normals lie between those of both surfaces, do no work on it.
use super::rows::straight_partner;
use crate::tolerances::NO_WORK;
use crate::{
    body::Body,
    case::{Case, ContactGeometry},
    contact::{Surface, vector::dot},
    scene::{ContactSide, Plan},
    vector::larger,
};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Angle, rad, between a surface and a motion along it that the coordinates of a mesh file leave: six digits on facets of a
/// twentieth of the radius.
const FILE_DIGITS: f64 = 1e-5;

/// A motion along the body's own surfaces.
#[derive(Debug, Clone)]
pub(crate) struct Neutral {
    /// Which of this rank's bodies.
    pub place: usize,
    /// Amplitudes of the body's rigid modes, a unit vector.
    pub motion: Vec<f64>,
    /// Work of the loads, relative to the sum of the absolute works, that the facets leave.
    pub faceted: f64,
    /// Friction resists it.
    pub rubs: bool,
}

/// The motions of this rank's bodies. Not collective.
pub(super) fn find(case: &Case, plan: &Plan, bodies: &[Body]) -> Vec<Neutral> {
    let mut found = Vec::new();
    for (place, (body, &index)) in std::iter::zip(bodies, plan.groups.bodies()).enumerate() {
        let modes = body.free.modes.len();
        let ends = || std::iter::zip(&plan.surfaces, &plan.ends).filter(move |(_, end)| end.body == index);
        let rubs = ends().any(|(_, end)| case.contacts[end.pair].law.is_frictional());
        // Rows that are found again where the surfaces have got to see the motion as it is.
        let follows = |pair: usize| case.contacts[pair].geometry == ContactGeometry::Updated;
        let followed = rubs && ends().any(|(_, end)| follows(end.pair));
        if modes == 0 || followed || ends().next().is_none() {
            continue;
        }
        let facets = ends().map(|(surface, _)| Facets::of(surface)).fold(Facets::default(), Facets::worse);
        // Along the own surfaces; and along straight rigid ones, where gaps follow the motion.
        let mut sides = Along::new(modes);
        let mut tracks = Along::new(modes);
        let mut has_track = false;
        for (surface, &ContactSide { pair, side, .. }) in ends() {
            sides.add_surface(body, surface);
            match straight_partner(case, pair, side).filter(|_| follows(pair)) {
                Some(normal) => {
                    has_track = true;
                    tracks.add_track(body, surface, &normal);
                }
                None => tracks.add_surface(body, surface),
            }
        }
        let mut motions: Vec<DVector<f64>> = Vec::new();
        let along = if has_track { vec![sides, tracks] } else { vec![sides] };
        for v in along.iter().flat_map(|along| along.motions(facets.angle())) {
            // Independent of those before.
            let rest = motions.iter().fold(v.clone(), |rest, m| &rest - m * m.dot(&v));
            if rest.norm() > 0.1 {
                motions.push(rest.normalize());
            }
        }
        let of = |v: DVector<f64>| Neutral {
            place,
            motion: v.as_slice().to_vec(),
            faceted: facets.work().max(NO_WORK),
            rubs,
        };
        found.extend(motions.into_iter().map(of));
    }
    found
}

/// Adds to the nodal forces of a body, at its interface, those that do the work `relief` less on its rigid modes: f = -Z b,
/// Z'Z b = relief. Not collective: the first rank of the group owns the interface.
pub(super) fn relieve(body: &Body, relief: &[f64], forces: &mut [f64]) {
    let (dim, interface) = (body.dim(), &body.interface);
    if interface.owned.is_empty() || relief.iter().all(|r| *r == 0.0) {
        return;
    }
    let modes = relief.len();
    let at = |i: usize| -> Vec<[f64; 3]> {
        (0..modes).map(|k| body.free.at(k, interface.nodes[i], &interface.points[i])).collect()
    };
    let mut gram = DMatrix::<f64>::zeros(modes, modes);
    for i in 0..interface.nodes.len() {
        let z = at(i);
        for (k, l) in (0..modes).flat_map(|k| (0..modes).map(move |l| (k, l))) {
            gram[(k, l)] += dot(&z[k], &z[l]);
        }
    }
    let scale = gram.amax();
    let Ok(inverse) = gram.pseudo_inverse(scale * f64::EPSILON.sqrt()) else { return };
    let b: DVector<f64> = inverse * DVector::from_column_slice(relief);
    for (i, &owned) in interface.owned.iter().enumerate() {
        for (z, b) in std::iter::zip(at(i), b.iter()) {
            (0..dim).for_each(|c| forces[owned * dim + c] -= b * z[c]);
        }
    }
}

/// How coarsely facets follow the curve of a surface.
#[derive(Debug, Clone, Copy, Default)]
struct Facets {
    /// Half the angle by which the normal turns along a facet, the median over the facets, rad.
    half_turn: f64,
    linear: bool,
}

impl Facets {
    fn of(surface: &Surface) -> Facets {
        let turn = |f: usize| {
            let [a, b] = [-1.0, 1.0].map(|xi| surface.curve_normal(f, xi));
            0.5 * larger(1.0 - dot(&a, &b).powi(2), 0.0).sqrt().asin()
        };
        let mut turns: Vec<f64> = (0..surface.facets.len()).map(turn).collect();
        turns.sort_by(f64::total_cmp);
        Facets {
            half_turn: turns.get(turns.len() / 2).copied().unwrap_or(0.0),
            linear: surface.facets.iter().any(|f| f.len() == 2),
        }
    }

    fn worse(self, other: Facets) -> Facets {
        let half_turn = if other.half_turn > self.half_turn { other.half_turn } else { self.half_turn };
        Facets { half_turn, linear: self.linear || other.linear }
    }

    /// Angle between the normals of a facet's curve and those of the true one: where they are those of a parabola the third
    /// order of the half turn; of straight facets less.
    fn angle(&self) -> f64 {
        FILE_DIGITS + self.half_turn.powi(3)
    }

    /// Work of loads on a motion along the curve that its facets leave: of the order of the missing area, the square of
    /// the half turn, and its square where the facets are parabolas.
    fn work(&self) -> f64 {
        self.half_turn.powi(if self.linear { 2 } else { 4 })
    }
}

/// Motions that run along all of some surfaces.
struct Along {
    /// Sum of a a', a being the normal components of the modes at a node.
    across: DMatrix<f64>,
    /// Sum of v v', v being the modes at a node.
    total: DMatrix<f64>,
    /// The normal components, and the modes, node by node.
    nodes: Vec<(Vec<f64>, Vec<[f64; 3]>)>,
}

impl Along {
    fn new(modes: usize) -> Along {
        Along { across: DMatrix::zeros(modes, modes), total: DMatrix::zeros(modes, modes), nodes: Vec::new() }
    }

    fn add(&mut self, across: Vec<f64>, modes: Vec<[f64; 3]>) {
        let n = modes.len();
        for (k, l) in (0..n).flat_map(|k| (0..n).map(move |l| (k, l))) {
            self.across[(k, l)] += across[k] * across[l];
            self.total[(k, l)] += dot(&modes[k], &modes[l]);
        }
        self.nodes.push((across, modes));
    }

    /// The body's own surface: each facet's curve at both of its ends.
    fn add_surface(&mut self, body: &Body, surface: &Surface) {
        for (f, facet) in surface.facets.iter().enumerate() {
            for (&i, xi) in std::iter::zip(facet, [-1.0, 1.0]) {
                let (node, x) = (surface.nodes[i as usize], &surface.points[i as usize]);
                let normal = surface.curve_normal(f, xi);
                let modes: Vec<[f64; 3]> =
                    (0..body.free.modes.len()).map(|k| body.free.at(k, node, x)).collect();
                self.add(modes.iter().map(|v| dot(&normal, v)).collect(), modes);
            }
        }
    }

    /// A straight rigid surface: translations along it.
    fn add_track(&mut self, body: &Body, surface: &Surface, normal: &[f64; 3]) {
        for (&node, x) in std::iter::zip(&surface.nodes, &surface.points) {
            let modes: Vec<[f64; 3]> = (0..body.free.modes.len()).map(|k| body.free.at(k, node, x)).collect();
            self.add(modes.iter().map(|v| dot(normal, v)).collect(), modes);
        }
    }

    /// Motions, unit vectors of amplitudes, that nowhere leave the surfaces by more than an angle.
    fn motions(&self, angle: f64) -> Vec<DVector<f64>> {
        let moving = SymmetricEigen::new(self.total.clone());
        let top = moving.eigenvalues.max();
        // Columns: amplitudes that move the nodes by one, together.
        let columns: Vec<DVector<f64>> = moving
            .eigenvalues
            .iter()
            .enumerate()
            .filter(|(_, value)| **value > f64::EPSILON.sqrt() * top)
            .map(|(k, value)| moving.eigenvectors.column(k) / value.sqrt())
            .collect();
        if columns.is_empty() {
            return Vec::new();
        }
        let unit = DMatrix::from_columns(&columns);
        let across = SymmetricEigen::new(unit.transpose() * &self.across * &unit);
        let candidates = across.eigenvalues.iter().enumerate().filter(|(_, value)| **value <= angle * angle);
        let candidates = candidates.map(|(k, _)| &unit * across.eigenvectors.column(k));
        candidates.filter(|v| self.stays(v, angle)).map(|v| v.normalize()).collect()
    }

    /// Whether no node leaves its surface by more than an angle, measured by the node that moves most.
    fn stays(&self, v: &DVector<f64>, angle: f64) -> bool {
        let sum = |a: &[f64]| std::iter::zip(a, v.iter()).map(|(a, v)| a * v).sum::<f64>().abs();
        let size = |m: &[[f64; 3]]| {
            let at: [f64; 3] =
                std::array::from_fn(|c| std::iter::zip(m, v.iter()).map(|(m, v)| m[c] * v).sum());
            dot(&at, &at).sqrt()
        };
        let (mut leaves, mut moves) = (0.0, 0.0);
        for (across, modes) in &self.nodes {
            leaves = larger(leaves, sum(across));
            moves = larger(moves, size(modes));
        }
        leaves <= 3.0 * angle * moves
    }
}
