//! The displacement step of a body that answers by its solver: normal displacements prescribed at all nodes of its rows,
//! with a matrix and a factorisation of its own that no change of the contact set touches.
//!
//! A row of one node is prescribed as it is. A node of several rows takes the mean of their values per unit of the row,
//! weighted by the size of the row's vector at the node, W inward, and each row gets W' of the nodes' reactions: the
//! operator W' S W is symmetric and positive semi-definite, and the sum of R is the sum of the reactions.
use super::{BodyRow, Constraints, NodeConstraint, parts::Parts};
use crate::tolerances::HELD_PRESCRIBED;
use crate::{
    contact::vector::{self, combine, dot, norm},
    error::{Error, Result},
    parallel,
    petsc::{Ksp, Matrix, Stage, Vector},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// Rows whose directions at a node have at least this cosine prescribe one direction; others (another surface at a
/// corner) a second one.
const SAME: f64 = 0.7;

/// The vectors of a row add up to about 1; a row of less than this has no direction.
const VOID: f64 = 0.1;

/// Modes that the prescribed directions hold less than this, relative to the best held, need a fixing.
const LOOSE: f64 = 1e-6;

/// The second boundary value problem of a body.
pub(super) struct Dirichlet {
    /// Supports, prescribed directions, and the fixings that are still needed, by local node.
    constraints: Constraints,
    ksp: Ksp,
    /// Stiffness of the cells at the prescribed nodes, without constraints: all that couples these nodes.
    near: Matrix,
    /// On the first rank: what is prescribed at each node.
    nodes: Vec<Prescribed>,
}

/// Prescribed directions of an interface node.
struct Prescribed {
    /// Position among the interface nodes.
    node: usize,
    /// One or two directions d_k, the parts of the unit normals that supports leave free.
    directions: Vec<[f64; 3]>,
    /// (D'D)^-1 D': rows that turn a nodal force into what works on the directions' displacements.
    inverse: Vec<[f64; 3]>,
    /// Per direction: rows and weights W.
    rows: Vec<Vec<(usize, f64)>>,
}

impl Dirichlet {
    /// Assembles and factorises. Collective.
    pub fn new(body: &Parts, group: &SimpleCommunicator) -> Result<Dirichlet> {
        let _stage = Stage::Factor.enter();
        let nodes = prescribed_nodes(body);
        let held = held_directions(body, group, &nodes);
        let model = &body.model;
        let dim = model.part.dim;
        let mut constraints = Constraints::default();
        for (local, original) in model.part.original.iter().enumerate() {
            let local = local as u32;
            let own = model.constraints.0.get(&local);
            let directions = held.get(original);
            if own.is_some() || directions.is_some() {
                let own = own.cloned().unwrap_or_else(NodeConstraint::free);
                constraints.0.insert(local, own.and_held(directions.map_or(&[], Vec::as_slice), dim));
            }
        }
        let temperature = body.temperature.as_ref().map(|t| &t[..]);
        let matrix = model.parameters(temperature, &constraints).stiffness(group)?.matrix;
        let marked: Vec<bool> = model.part.original.iter().map(|node| held.contains_key(node)).collect();
        let free = Constraints::default();
        let near = model.parameters(temperature, &free).stiffness_near(group, &marked)?;
        let setting = body.system.setting();
        let ksp =
            Ksp::new(group, &matrix, &setting.prefix, setting.tolerance).map_err(|e| setting.of_body(e))?;
        ksp.set_up().map_err(|e| match e {
            Error::Internal(text) => Error::internal(format!(
                "body '{}': the matrix of the displacement step cannot be factorised: {text}",
                setting.body
            )),
            other => setting.of_body(other),
        })?;
        Ok(Dirichlet { constraints, ksp, near, nodes })
    }

    /// Row forces that push the rows inwards by `inward`, m; on the first rank, where it is given. Collective.
    pub fn solve(&self, body: &Parts, group: &SimpleCommunicator, inward: &[f64]) -> Result<Vec<f64>> {
        let dim = body.model.part.dim;
        let owned = &body.interface.owned;
        let mut u = vec![0.0; body.model.part.n_owned * dim];
        for p in &self.nodes {
            for (inverse, rows) in std::iter::zip(&p.inverse, &p.rows) {
                let outward = -rows.iter().map(|&(row, weight)| weight * inward[row]).sum::<f64>();
                (0..dim).for_each(|c| u[owned[p.node] * dim + c] += outward * inverse[c]);
            }
        }
        let [b, x, f] = [(); 3].map(|()| Vector::zeros(group, u.len()));
        let (b, x, f) = (b?, x?, f?);
        x.set(&u)?;
        self.near.times(&x, &f)?;
        let load: Vec<f64> = f.to_vec()?.iter().map(|f| -f).collect();
        b.set(&self.constraints.to_frames(&load, dim))?;
        self.ksp.solve(&b, &x).map_err(|e| body.system.setting().of_body(e))?;
        body.cost.add(|c| c.solves += 1);
        let inner = self.constraints.from_frames(&x.to_vec()?, dim);
        std::iter::zip(&mut u, inner).for_each(|(u, inner)| *u += inner);
        x.set(&u)?;
        self.near.times(&x, &f)?;
        let f = f.to_vec()?;
        let mut out = vec![0.0; inward.len()];
        for p in &self.nodes {
            let mut nodal = [0.0; 3];
            nodal[..dim].copy_from_slice(&f[owned[p.node] * dim..][..dim]);
            for (inverse, rows) in std::iter::zip(&p.inverse, &p.rows) {
                rows.iter().for_each(|&(row, weight)| out[row] -= weight * dot(inverse, &nodal));
            }
        }
        Ok(out)
    }
}

/// The rows that push a node in about one direction, and their weights.
struct Bundle {
    direction: [f64; 3],
    rows: Vec<(usize, f64)>,
}

/// Directions and weights at the nodes of all rows.
fn prescribed_nodes(body: &Parts) -> Vec<Prescribed> {
    let dim = body.model.part.dim;
    let units: Vec<f64> = body.values.rows.iter().map(unit_of).collect();
    let mut terms: BTreeMap<usize, Vec<(usize, [f64; 3])>> = BTreeMap::new();
    for (j, row) in body.values.rows.iter().enumerate() {
        for (node, v) in row.terms.iter().filter(|(_, v)| norm(v) > 0.0) {
            terms.entry(*node).or_default().push((j, *v));
        }
    }
    let mut nodes = Vec::new();
    for (node, mut terms) in terms {
        // The largest coefficient is a positive one and shows the direction.
        terms.sort_by(|a, b| norm(&b.1).total_cmp(&norm(&a.1)));
        let mut bundles: Vec<Bundle> = Vec::new();
        for (row, v) in terms {
            let size = norm(&v);
            let cosine = |d: &[f64; 3]| dot(d, &v) / (size * norm(d));
            let n_bundles = bundles.len();
            match bundles.iter_mut().find(|b| cosine(&b.direction).abs() > SAME) {
                Some(b) => {
                    b.direction = combine([(1.0, &b.direction), (cosine(&b.direction).signum(), &v)]);
                    b.rows.push((row, size));
                }
                None if n_bundles < dim => bundles.push(Bundle { direction: v, rows: vec![(row, size)] }),
                None => {}
            }
        }
        let own = body.interface.constraints.0.get(&(node as u32));
        let mut p = Prescribed { node, directions: Vec::new(), inverse: Vec::new(), rows: Vec::new() };
        for Bundle { direction, mut rows } in bundles {
            let unit = vector::unit(&direction);
            let free = own.map_or(unit, |own| own.free_part(&unit, dim));
            let parallel = |other: &[f64; 3]| dot(other, &free).abs() > 0.999 * norm(other) * norm(&free);
            if norm(&free) < HELD_PRESCRIBED || p.directions.iter().any(parallel) {
                continue;
            }
            let total: f64 = rows.iter().map(|(_, w)| w).sum();
            rows.iter_mut().for_each(|(row, w)| *w /= total * units[*row]);
            p.directions.push(free);
            p.rows.push(rows);
        }
        let n = p.directions.len();
        let gram = DMatrix::from_fn(n, n, |a, b| dot(&p.directions[a], &p.directions[b]));
        let Some(gram) = gram.try_inverse().filter(|_| n > 0) else { continue };
        p.inverse = (0..n).map(|a| combine((0..n).map(|b| (gram[(a, b)], &p.directions[b])))).collect();
        nodes.push(p);
    }
    nodes
}

/// Displacement of a row when all its nodes move by 1 along it.
fn unit_of(row: &BodyRow) -> f64 {
    let size = norm(&combine(row.terms.iter().map(|(_, v)| (1.0, v))));
    if size < VOID { 1.0 } else { size }
}

/// Directions to hold by mesh node: the prescribed ones, and fixings for the modes that these leave loose. The first
/// rank decides. Collective.
fn held_directions(
    body: &Parts,
    group: &SimpleCommunicator,
    nodes: &[Prescribed],
) -> BTreeMap<u32, Vec<[f64; 3]>> {
    let mut packed = Vec::new();
    let mut push = |node: u32, d: &[f64; 3]| packed.extend([f64::from(node), d[0], d[1], d[2]]);
    for p in nodes {
        p.directions.iter().for_each(|d| push(body.interface.nodes[p.node], d));
    }
    if group.rank() == 0 {
        for (node, d) in needed_fixings(body, nodes) {
            push(node, &d);
        }
    }
    parallel::broadcast(group, 0, &mut packed);
    let mut held: BTreeMap<u32, Vec<[f64; 3]>> = BTreeMap::new();
    for d in packed.chunks_exact(4) {
        held.entry(d[0] as u32).or_default().push([d[1], d[2], d[3]]);
    }
    held
}

/// The body's fixings that hold what the prescribed directions do not: pivoted on the modes these leave loose.
fn needed_fixings(body: &Parts, nodes: &[Prescribed]) -> Vec<(u32, [f64; 3])> {
    let (free, interface) = (&body.free, &body.interface);
    let n = free.modes.len();
    let mut gram = DMatrix::<f64>::zeros(n, n);
    for p in nodes {
        let at: Vec<[f64; 3]> =
            (0..n).map(|k| free.at(k, interface.nodes[p.node], &interface.points[p.node])).collect();
        for d in &p.directions {
            (0..n * n).for_each(|i| gram[(i / n, i % n)] += dot(d, &at[i / n]) * dot(d, &at[i % n]));
        }
    }
    if n == 0 {
        return Vec::new();
    }
    let Some(eigen) = crate::vector::symmetric_eigen(gram) else { return Vec::new() };
    let largest = eigen.eigenvalues.max();
    let loose: Vec<usize> = (0..n).filter(|&k| eigen.eigenvalues[k] <= LOOSE * largest).collect();
    // What each fixing sees of the loose combinations of modes.
    let mut rows: Vec<(usize, Vec<f64>)> = body
        .fixings
        .iter()
        .enumerate()
        .map(|(i, fixing)| {
            let along: Vec<f64> =
                (0..n).map(|k| dot(&fixing.direction, &free.at(k, fixing.node, &fixing.point))).collect();
            let seen = |&l: &usize| (0..n).map(|k| along[k] * eigen.eigenvectors[(k, l)]).sum::<f64>();
            (i, loose.iter().map(seen).collect())
        })
        .collect();
    let mut chosen = Vec::new();
    let size = |row: &Vec<f64>| row.iter().map(|v| v * v).sum::<f64>();
    for _ in 0..loose.len().min(body.fixings.len()) {
        let Some(best) = (0..rows.len()).max_by(|&a, &b| size(&rows[a].1).total_cmp(&size(&rows[b].1)))
        else {
            break;
        };
        let (i, pivot) = rows.swap_remove(best);
        chosen.push((body.fixings[i].node, body.fixings[i].direction));
        let scale = size(&pivot).max(f64::MIN_POSITIVE);
        for (_, row) in &mut rows {
            let along: f64 = std::iter::zip(&*row, &pivot).map(|(a, b)| a * b).sum::<f64>() / scale;
            std::iter::zip(row, &pivot).for_each(|(r, p)| *r -= along * p);
        }
    }
    chosen
}
