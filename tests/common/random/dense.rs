//! The contact problem of straight flush surfaces by dense algebra: node against facet, an active-set method that moves
//! one node at a time once it would cycle. What it returns satisfies all conditions, which is checked.
use super::model::Model;
use kontakt::case::{BodyRef, Case, Gap, RigidShape};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The solution: normal force of each pair, N, and displacements of each body, m.
pub struct Solution {
    pub forces: Vec<f64>,
    pub u: Vec<Vec<f64>>,
}

/// A node against a facet: gap = start + weights . u >= 0.
struct Row {
    pair: usize,
    start: f64,
    /// Body, unknown, weight.
    weights: Vec<(usize, usize, f64)>,
}

/// A body's equations with its held unknowns turned into their frames and taken out, free rigid motions made stiff.
struct Dense {
    /// From free unknowns in frames to unknowns along x and y.
    basis: DMatrix<f64>,
    /// Displacements of the supports.
    given: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
    /// Rigid motions that the supports leave, orthonormal, in the free unknowns.
    motions: DMatrix<f64>,
    load: DVector<f64>,
}

impl Dense {
    fn new(model: &Model) -> Option<Dense> {
        let n = 2 * model.mesh.points.len();
        let mut k = DMatrix::zeros(n, n);
        let mut f = DVector::from_column_slice(&model.external);
        for element in &model.elements {
            let dofs: Vec<usize> = element.nodes.iter().flat_map(|&a| [2 * a, 2 * a + 1]).collect();
            for (i, &row) in dofs.iter().enumerate() {
                f[row] += element.f[i];
                for (j, &column) in dofs.iter().enumerate() {
                    k[(row, column)] += element.k[i * dofs.len() + j];
                }
            }
        }
        let mut given = DVector::zeros(n);
        let mut columns: Vec<DVector<f64>> = Vec::new();
        for node in 0..n / 2 {
            let held: Vec<_> = model.held.iter().filter(|h| h.node == node).collect();
            let mut axes = vec![[1.0, 0.0], [0.0, 1.0]];
            if let [first, rest @ ..] = &held[..] {
                let d = first.direction;
                axes = vec![[-d[1], d[0]]];
                (0..2).for_each(|c| given[2 * node + c] += first.value * d[c]);
                if let Some(second) = rest.first() {
                    axes.clear();
                    (0..2).for_each(|c| given[2 * node + c] += second.value * second.direction[c]);
                }
            }
            for axis in axes {
                let mut column = DVector::zeros(n);
                (column[2 * node], column[2 * node + 1]) = (axis[0], axis[1]);
                columns.push(column);
            }
        }
        let basis = DMatrix::from_columns(&columns);
        let reduced = basis.transpose() * &k * &basis;
        let load = basis.transpose() * (f - &k * &given);
        // Rigid motions of the body that no support stops: combinations that vanish at every held unknown.
        let all = DMatrix::from_fn(n, 3, |i, m| {
            let p = model.mesh.points[i / 2];
            let q = model.mesh.points[0];
            let size = 1.0_f64.max(0.0);
            match (m, i % 2) {
                (0, 0) | (1, 1) => size,
                (2, 0) => -(p[1] - q[1]),
                (2, 1) => p[0] - q[0],
                _ => 0.0,
            }
        });
        let scale = all.column(2).amax();
        let all = DMatrix::from_columns(&[all.column(0).into(), all.column(1).into(), all.column(2) / scale]);
        let stopped = DMatrix::from_fn(model.held.len().max(1), 3, |h, m| {
            model.held.get(h).map_or(0.0, |held| {
                all[(2 * held.node, m)] * held.direction[0] + all[(2 * held.node + 1, m)] * held.direction[1]
            })
        });
        let eigen = (stopped.transpose() * &stopped).symmetric_eigen();
        let free: Vec<DVector<f64>> = (0..3)
            .filter(|&m| eigen.eigenvalues[m] < 1e-10)
            .map(|m| basis.transpose() * (&all * eigen.eigenvectors.column(m)))
            .collect();
        let motions = if free.is_empty() {
            DMatrix::zeros(reduced.nrows(), 0)
        } else {
            DMatrix::from_columns(&free).qr().q()
        };
        let stiff = reduced.diagonal().mean();
        let factor = (reduced + stiff * &motions * motions.transpose()).cholesky()?;
        Some(Dense { basis, given, factor, motions, load })
    }
}

/// Solves a case whose pairs are straight; `sides` says which side of each pair has the nodes. `None`: no solution found.
pub fn solve(case: &Case, models: &[Model], sides: &[usize]) -> Option<Solution> {
    let dense = models.iter().map(Dense::new).collect::<Option<Vec<_>>>()?;
    let mut rows = Vec::new();
    for (p, &side) in sides.iter().enumerate() {
        rows.extend(pair_rows(case, models, p, side)?);
    }
    // Everything in terms of row forces and rigid motions.
    let n = rows.len();
    let mut compliance = DMatrix::zeros(n, n);
    let mut start = DVector::from_iterator(n, rows.iter().map(|row| row.start));
    let total: usize = dense.iter().map(|d| d.motions.ncols()).sum();
    let (mut couple, mut driving) = (DMatrix::zeros(n, total), DVector::zeros(total));
    let mut first = 0;
    let mut parts = Vec::new();
    for (b, d) in dense.iter().enumerate() {
        let mut g = DMatrix::zeros(n, d.basis.nrows());
        for (i, row) in rows.iter().enumerate() {
            row.weights.iter().filter(|w| w.0 == b).for_each(|&(_, dof, weight)| g[(i, dof)] += weight);
        }
        start += &g * &d.given;
        let g = g * &d.basis;
        let answer = d.factor.solve(&g.transpose());
        compliance += &g * &answer;
        start += answer.transpose() * &d.load;
        let m = d.motions.ncols();
        couple.columns_mut(first, m).copy_from(&(&g * &d.motions));
        driving.rows_mut(first, m).copy_from(&(-d.motions.transpose() * &d.load));
        parts.push((g, first));
        first += m;
    }
    let (force, motion) = active_set(&compliance, &couple, &start, &driving)?;
    let mut forces = vec![0.0; sides.len()];
    std::iter::zip(&rows, force.iter()).for_each(|(row, f)| forces[row.pair] += f);
    let u = std::iter::zip(&dense, &parts).map(|(d, (g, first))| {
        let m = d.motions.ncols();
        let free = d.factor.solve(&(&d.load + g.transpose() * &force)) + &d.motions * motion.rows(*first, m);
        (&d.given + &d.basis * free).as_slice().to_vec()
    });
    Some(Solution { forces, u: u.collect() })
}

/// Row forces and motions: gap = start + C f + N m >= 0, f >= 0, f . gap = 0, N' f = driving.
fn active_set(
    compliance: &DMatrix<f64>,
    couple: &DMatrix<f64>,
    start: &DVector<f64>,
    driving: &DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let (n, m) = (start.len(), driving.len());
    // In units of the largest entries, so that one tolerance serves.
    let unit = compliance.diagonal().amax();
    let mut active = vec![true; n];
    for round in 0..400 {
        let list: Vec<usize> = (0..n).filter(|&i| active[i]).collect();
        let size = list.len() + m;
        let matrix = DMatrix::from_fn(size, size, |i, j| match (list.get(i), list.get(j)) {
            (Some(&i), Some(&j)) => compliance[(i, j)] / unit,
            (Some(&i), None) => couple[(i, j - list.len())],
            (None, Some(&j)) => couple[(j, i - list.len())],
            (None, None) => 0.0,
        });
        let right = DVector::from_fn(size, |i, _| match list.get(i) {
            Some(&i) => -start[i] / unit,
            None => driving[i - list.len()],
        });
        let lu = matrix.clone().full_piv_lu();
        let mut x = lu.solve(&right)?;
        // Once more for the digits that a motion without stiffness costs.
        x += lu.solve(&(&right - matrix * &x))?;
        let mut force = DVector::zeros(n);
        std::iter::zip(&list, x.iter()).for_each(|(&i, f)| force[i] = *f);
        let motion = x.rows(list.len(), m) * unit;
        let gap = start + compliance * &force + couple * &motion;
        let scale = [force.amax(), (start.amax() + gap.amax()) / unit].map(|s| 1e-10 * s);
        let wrong: Vec<usize> = (0..n)
            .filter(|&i| if active[i] { force[i] < -scale[0] } else { gap[i] / unit < -scale[1] })
            .collect();
        if wrong.is_empty() {
            return Some((force, motion));
        }
        // All at once while that may settle, then the first alone, which ends on any matrix of this kind (Murty).
        let change = if round < 30 { &wrong[..] } else { &wrong[..1] };
        change.iter().for_each(|&i| active[i] = !active[i]);
    }
    None
}

/// Nodes of one side against the facets of the other, or a rigid plane.
fn pair_rows(case: &Case, models: &[Model], p: usize, side: usize) -> Option<Vec<Row>> {
    let contact = &case.contacts[p];
    let b = contact.surfaces[side].body.deformable()?;
    let model = &models[b];
    let facets = model.surface(case, p, side);
    let x = |m: &Model, n: usize| [m.mesh.points[n][0], m.mesh.points[n][1]];
    let (from, to) = (x(model, facets[0][0]), x(model, facets[0][1]));
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    let normal = [(to[1] - from[1]) / length, -(to[0] - from[0]) / length];
    let mut nodes: Vec<usize> = facets.concat();
    nodes.sort_unstable();
    nodes.dedup();
    let mut rows = Vec::new();
    for node in nodes {
        let along =
            |h: &&super::model::Held| (h.direction[0] * normal[0] + h.direction[1] * normal[1]).abs() > 1e-6;
        if model.held.iter().filter(|h| h.node == node).any(|h| along(&h)) {
            continue;
        }
        let at = x(model, node);
        let mut weights = vec![(b, 2 * node, -normal[0]), (b, 2 * node + 1, -normal[1])];
        let distance = match contact.surfaces[1 - side].body {
            BodyRef::Rigid(r) => {
                let RigidShape::Plane { through, .. } = &case.rigid[r].shape else { return None };
                let motion = case.rigid[r].motion;
                (0..2).map(|c| (through[c] + motion[c] - at[c]) * normal[c]).sum()
            }
            BodyRef::Deformable(o) => {
                let other = &models[o];
                let foot = models[o].surface(case, p, 1 - side).into_iter().find_map(|facet| {
                    let (a, e) = (x(other, facet[0]), x(other, facet[1]));
                    let t = [e[0] - a[0], e[1] - a[1]];
                    let s = ((at[0] - a[0]) * t[0] + (at[1] - a[1]) * t[1]) / (t[0] * t[0] + t[1] * t[1]);
                    (-1e-9..=1.0 + 1e-9).contains(&s).then_some((facet, s, a))
                });
                let Some((facet, s, a)) = foot else { continue };
                let xi = 2.0 * s - 1.0;
                let shape = match facet.len() {
                    2 => vec![1.0 - s, s],
                    _ => vec![0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi * xi],
                };
                for (&n, w) in std::iter::zip(&facet, shape) {
                    weights.extend([(o, 2 * n, w * normal[0]), (o, 2 * n + 1, w * normal[1])]);
                }
                (a[0] - at[0]) * normal[0] + (a[1] - at[1]) * normal[1]
            }
        };
        let start = match contact.gap {
            Gap::Geometry { offset } => distance + offset,
            Gap::Value(value) => value,
        };
        rows.push(Row { pair: p, start, weights });
    }
    Some(rows)
}
