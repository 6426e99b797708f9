//! Whether an answer satisfies the equations, from the result file alone: equilibrium of every node of every body under
//! the forces in the file, supports kept, action and reaction, no tension, no penetration.
//!
//! For a convex problem these conditions are not only necessary but sufficient.
use super::beyond;
use super::model::Model;
use kontakt::{
    case::{BodyRef, Case, ContactGeometry, Gap, RigidShape},
    output::Results,
    record::SideTable,
};

/// Displacements of each body, node by node in the order of its mesh.
pub fn displacements(results: &Results, models: &[Model]) -> Result<Vec<Vec<f64>>, String> {
    let field =
        results.piece.point_fields.iter().find(|f| f.name == "displacement").ok_or("no displacements")?;
    let mut first = 0;
    let mut all = Vec::new();
    for (b, model) in models.iter().enumerate() {
        let n = model.mesh.points.len();
        let there = results.piece.points.get(first..first + n);
        if there.is_none_or(|points| points != &model.mesh.points[..]) {
            return Err(format!("the nodes of body {b} are not those of its mesh"));
        }
        let nodes = field.values.chunks(3).skip(first).take(n);
        all.push(nodes.flat_map(|u| [u[0], u[1]]).collect());
        first += n;
    }
    Ok(all)
}

/// What is wrong with an answer. `slack`: relative accuracy of forces that the tolerance leaves.
/// `multipliers`: the side of each pair that has them.
pub fn faults(
    case: &Case,
    models: &[Model],
    results: &Results,
    multipliers: &[usize],
    u: &[Vec<f64>],
    slack: f64,
) -> Vec<String> {
    let mut faults = Vec::new();
    if u.iter().flatten().any(|u| !u.is_finite()) {
        return vec!["a displacement is not finite".into()];
    }
    let mut contact: Vec<Vec<f64>> = models.iter().map(|m| vec![0.0; m.external.len()]).collect();
    for (p, &side) in multipliers.iter().enumerate() {
        match sides(case, results, p) {
            Some(sides) => {
                let found = pair_forces(case, models, p, sides, side, slack, &mut contact);
                faults.extend(found);
            }
            None => faults.push(format!("pair {} is not in the file", case.contacts[p].name)),
        }
    }
    for (b, model) in models.iter().enumerate() {
        faults.extend(equilibrium(&case.bodies[b].name, model, &u[b], &contact[b], slack));
    }
    for p in 0..case.contacts.len() {
        faults.extend(penetration(case, models, results, u, p, slack));
    }
    faults
}

/// The tables of a pair of the case; the file has its own order.
fn sides<'r>(case: &Case, results: &'r Results, p: usize) -> Option<&'r [Option<SideTable>; 2]> {
    Some(&results.pairs.iter().find(|pair| pair.name == case.contacts[p].name)?.sides)
}

/// Adds a pair's nodal forces to those of the bodies; action and reaction, tension.
fn pair_forces(
    case: &Case,
    models: &[Model],
    p: usize,
    sides: &[Option<SideTable>; 2],
    multipliers: usize,
    slack: f64,
    contact: &mut [Vec<f64>],
) -> Vec<String> {
    let (mut faults, mut total, mut size) = (Vec::new(), [0.0; 2], 0.0);
    let name = &case.contacts[p].name;
    let mut deformable = 0;
    for (s, side) in sides.iter().enumerate() {
        let (Some(side), BodyRef::Deformable(b)) = (side, case.contacts[p].surfaces[s].body) else {
            continue;
        };
        deformable += 1;
        let nodes: Vec<usize> = models[b].surface(case, p, s).concat();
        for (x, force) in std::iter::zip(&side.x, &side.force) {
            let Some(&node) = nodes.iter().find(|&&n| models[b].mesh.points[n] == *x) else {
                faults.push(format!("pair {name}: no node at {x:?}"));
                continue;
            };
            for c in 0..2 {
                contact[b][2 * node + c] += force[c];
                total[c] += force[c];
            }
            size += force[0].hypot(force[1]);
        }
        // On the other side of two deformable ones pressures are what multipliers leave there.
        let peak = side.pressure.iter().fold(0.0, |a: f64, p| if p.abs() > a { p.abs() } else { a });
        let pulled = side.pressure.iter().filter(|p| beyond(-**p, (1e-8 + slack) * peak)).count();
        if s == multipliers && pulled > 0 {
            faults.push(format!("pair {name}: {pulled} nodes are pulled or have no pressure"));
        }
    }
    if size.is_nan() {
        faults.push(format!("pair {name}: forces that are not finite"));
    }
    let unbalanced = f64::hypot(total[0], total[1]);
    if deformable == 2 && beyond(unbalanced, 1e-9 * size) {
        faults.push(format!("pair {name}: action and reaction differ by {unbalanced:.1e} of {size:.1e} N"));
    }
    faults
}

/// Every node in equilibrium, every support kept.
fn equilibrium(name: &str, model: &Model, u: &[f64], contact: &[f64], slack: f64) -> Vec<String> {
    let mut faults = Vec::new();
    let (internal, size) = model.internal(u);
    let mut residual: Vec<f64> = (0..u.len()).map(|i| internal[i] - model.external[i] - contact[i]).collect();
    let norm = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    // Reactions of the supports are forces, too.
    let scale = norm(&residual) + norm(&model.external) + norm(contact);
    for held in &model.held {
        let (n, d) = (held.node, held.direction);
        let along = residual[2 * n] * d[0] + residual[2 * n + 1] * d[1];
        residual[2 * n] -= along * d[0];
        residual[2 * n + 1] -= along * d[1];
        let moved = u[2 * n] * d[0] + u[2 * n + 1] * d[1];
        let travel = u.iter().fold(held.value.abs(), |a, v| if v.abs() > a { v.abs() } else { a });
        if beyond((moved - held.value).abs(), 1e-8 * travel) {
            faults.push(format!("body {name}: a support moves by {moved:.9e}, not {:.9e}", held.value));
        }
    }
    // Round-off of what the sums are made of, and what the tolerance leaves.
    let allowed = (1e-8 + slack) * scale + 1e-12 * norm(&size);
    let left = norm(&residual);
    if beyond(left, allowed) {
        faults.push(format!("body {name}: residual {left:.1e} N of {scale:.1e} N, {allowed:.1e} allowed"));
    }
    faults
}

/// A surface as a chain of short straight pieces, with outward on their right.
struct Chain(Vec<[[f64; 2]; 2]>);

/// Pieces a facet of three nodes is drawn with.
const PIECES: usize = 4;

impl Chain {
    fn deformed(model: &Model, facets: &[Vec<usize>], u: &[f64]) -> Chain {
        let at = |n: usize| [model.mesh.points[n][0] + u[2 * n], model.mesh.points[n][1] + u[2 * n + 1]];
        let mut pieces = Vec::new();
        for facet in facets {
            let (a, b) = (at(facet[0]), at(facet[1]));
            let Some(&middle) = facet.get(2) else {
                pieces.push([a, b]);
                continue;
            };
            let m = at(middle);
            let on = |k: usize| {
                let s = 2.0 * k as f64 / PIECES as f64 - 1.0;
                [0, 1].map(|i| 0.5 * s * (s - 1.0) * a[i] + 0.5 * s * (s + 1.0) * b[i] + (1.0 - s * s) * m[i])
            };
            pieces.extend((0..PIECES).map(|k| [on(k), on(k + 1)]));
        }
        Chain(pieces)
    }

    /// Distance of a point in front of the nearest piece (negative: inside), where its foot is within it.
    fn distance(&self, p: [f64; 2]) -> Option<f64> {
        let mut nearest: Option<(f64, Option<f64>)> = None;
        for [a, b] in &self.0 {
            let (t, d) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
            let length = t[0].hypot(t[1]);
            let along = (t[0] * d[0] + t[1] * d[1]) / length;
            let across = (t[1] * d[0] - t[0] * d[1]) / length;
            let within = (0.0..=length).contains(&along);
            let past = along - along.clamp(0.0, length);
            let away = across.hypot(past);
            if nearest.is_none_or(|(n, _)| away < n) {
                nearest = Some((away, within.then_some(across)));
            }
        }
        nearest?.1
    }

    /// Largest distance between an arc through the nodes and its pieces: an eighth of piece times turn. Facets come in any order.
    fn sagitta(&self) -> f64 {
        let mut largest = 0.0;
        for v in &self.0 {
            for w in self.0.iter().filter(|w| (v[1][0] - w[0][0]).hypot(v[1][1] - w[0][1]) == 0.0) {
                let [p, q] = [v, w].map(|w| [0, 1].map(|i| w[1][i] - w[0][i]));
                let turn = (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]).abs();
                let s = 0.25 * turn * p[0].hypot(p[1]).max(q[0].hypot(q[1]));
                largest = if s > largest { s } else { largest };
            }
        }
        largest
    }
}

/// No node of either side inside the other, but for what a weak condition leaves within a cell: the approach of a
/// pressure over one cell, h p/E.
fn penetration(
    case: &Case,
    models: &[Model],
    results: &Results,
    u: &[Vec<f64>],
    p: usize,
    slack: f64,
) -> Option<String> {
    let contact = &case.contacts[p];
    let offset = match contact.gap {
        Gap::Geometry { offset } => offset,
        // Scenes give a value only where the surfaces are flush.
        Gap::Value(value) => value,
    };
    let (mut worst, mut h, mut largest_u, mut peak, mut softest, mut size) =
        (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64, f64::INFINITY, 0.0_f64);
    let mut sagitta = 0.0;
    for (s, name) in contact.surfaces.iter().enumerate() {
        let BodyRef::Deformable(b) = name.body else { continue };
        let (model, other) = (&models[b], contact.surfaces[1 - s].body);
        let facets = model.surface(case, p, s);
        let x = |n: usize| [model.mesh.points[n][0], model.mesh.points[n][1]];
        for facet in &facets {
            let (a, b) = (x(facet[0]), x(facet[1]));
            h = h.max((a[0] - b[0]).hypot(a[1] - b[1]));
        }
        let young = case.bodies[b].material.young.at(293.0);
        softest = softest.min(young);
        let nodes: Vec<usize> = facets.concat();
        let ends = |c: usize| {
            nodes.iter().map(|&n| x(n)[c]).fold([f64::MAX, f64::MIN], |a, v| [a[0].min(v), a[1].max(v)])
        };
        size =
            nodes.iter().flat_map(|&n| x(n)).fold(size, |a, v| a.max(v.abs())).max(ends(0)[1] - ends(0)[0]);
        largest_u = nodes.iter().fold(largest_u, |a, &n| a.max(u[b][2 * n].abs()).max(u[b][2 * n + 1].abs()));
        if let Some(side) = sides(case, results, p).and_then(|sides| sides[s].as_ref()) {
            peak = side.pressure.iter().fold(peak, |a, v| if v.abs() > a { v.abs() } else { a });
        }
        let distance: Box<dyn Fn([f64; 2]) -> Option<f64>> = match other {
            BodyRef::Deformable(o) => {
                let chain = Chain::deformed(&models[o], &models[o].surface(case, p, 1 - s), &u[o]);
                sagitta = chain.sagitta().max(sagitta);
                Box::new(move |q| chain.distance(q))
            }
            BodyRef::Rigid(r) => {
                let (shape, motion) = (&case.rigid[r].shape, case.rigid[r].motion);
                match shape {
                    RigidShape::Plane { through, normal } => Box::new(move |q| {
                        let d = [0, 1].map(|c| q[c] - through[c] - motion[c]);
                        Some(d[0] * normal[0] + d[1] * normal[1])
                    }),
                    RigidShape::Circle { center, radius, inside } => Box::new(move |q| {
                        let r = (q[0] - center[0] - motion[0]).hypot(q[1] - center[1] - motion[1]);
                        Some(if *inside { radius - r } else { r - radius })
                    }),
                    RigidShape::Polyline { .. } => Box::new(|_| None),
                }
            }
        };
        for &n in &nodes {
            let q = [x(n)[0] + u[b][2 * n], x(n)[1] + u[b][2 * n + 1]];
            if let Some(d) = distance(q) {
                worst = worst.max(-(d + offset));
            }
        }
    }
    // The surfaces' turn on their way is left out by linear geometry.
    let second_order =
        if contact.geometry == ContactGeometry::Initial { 4.0 * largest_u * largest_u / size } else { 0.0 };
    let round_off = 1e-13 * size + (1e-9 + slack) * largest_u;
    let allowed = h * peak / softest + second_order + 2.0 * sagitta + round_off;
    (worst > allowed).then(|| {
        format!(
            "pair {}: a node is {worst:.2e} m inside, {allowed:.1e} allowed (pressure {peak:.2e} Pa)",
            contact.name
        )
    })
}
