//! A body of which only a zone is iterated.
use super::{
    Body,
    assembly::{Model, Share, temperature_at},
    hanging::Hanging,
    load::{LoadFactors, Part, scaled},
    points::Points,
    zone::Condensed,
};
use crate::{
    error::Result,
    mesh::MeshPart,
    petsc::{Rest, ZoneFactor},
    vector::larger,
};
use mpi::topology::SimpleCommunicator;
use nalgebra::{DMatrix, DVector};
use std::{cell::RefCell, rc::Rc, time::Instant};

/// A block joins the zone if a point of it is loaded to this share of its yield stress when the rest is condensed: what joins later
/// has the rest condensed anew.
const NEAR: f64 = 0.7;

impl Body {
    /// Factorises the zone at the laws of its points; false if the whole body is to be factorised. A body on one rank.
    pub(super) fn linearise_zone(&mut self, group: &SimpleCommunicator) -> Result<bool> {
        let (Some(zone), Some(points)) = (&mut self.zone, &self.points) else { return Ok(false) };
        let start = Instant::now();
        let temperature = self.temperature.as_ref().map(|t| &t[..]);
        let near = |cell: usize| loading(points, cell, &self.model, temperature) > NEAR;
        let Some(is_in) = zone.grown(points.yielding(), near) else {
            zone.dissolve();
            return Ok(false);
        };
        let diagonal = self.system.diagonal();
        let model = &self.model;
        let heat = self.loads.factors.on_temperature(self.loads.temperature_path);
        if zone.cells() != Some(&is_in) {
            zone.dissolve();
            let prefix = &self.system.setting().prefix;
            let interface = self.interface.dofs(self.part.dim);
            let rest =
                condense(model, (temperature, heat), points, is_in, (diagonal, &interface, prefix), group)?;
            self.cost.add(|c| c.factorisations += 1);
            zone.state = Some(rest);
        }
        let Some(state) = &mut zone.state else { return Ok(false) };
        if state.heated != heat {
            let Share { thermal, .. } = model.share(temperature, points, |c| !state.is_in[c], group)?;
            (state.thermal, state.heated) = (thermal, heat);
        }
        let Share { entries, mut thermal, mut prescribed } =
            model.share(temperature, points, |c| state.is_in[c], group)?;
        let (mut rows, mut columns, mut values) = entries.into_triples();
        rows.extend(state.of_zone.iter().map(|&i| i as i32));
        columns.extend(state.of_zone.iter().map(|&i| i as i32));
        values.extend(state.of_zone.iter().map(|_| state.diagonal));
        std::iter::zip(&mut thermal, &state.thermal).for_each(|(sum, f)| *sum += f);
        for (sum, part) in std::iter::zip(&mut prescribed, &state.prescribed) {
            std::iter::zip(&mut sum.forces, &part.forces).for_each(|(sum, f)| *sum += f);
        }
        self.cost.add(|c| c.assemble += start.elapsed().as_secs_f64());
        let start = Instant::now();
        let complement = match &state.factor {
            Some(factor) => factor.borrow_mut().refactorise(group, &values)?,
            None => {
                let triples = (&rows[..], &columns[..], &values[..]);
                let (factor, complement) = ZoneFactor::new(group, state.rest.clone(), triples)?;
                state.factor = Some(Rc::new(RefCell::new(factor)));
                complement
            }
        };
        self.cost.add(|c| {
            c.factor += start.elapsed().as_secs_f64();
            c.factorisations += 1;
        });
        let Some(factor) = state.factor.clone() else { return Ok(false) };
        self.loads.thermal = thermal;
        self.loads.prescribed = prescribed;
        let dofs = self.interface.dofs(self.part.dim);
        self.system = Rc::new(self.system.of_zone(factor, complement, dofs, self.split.as_ref())?);
        Ok(true)
    }

    /// Nodal forces of the stresses of the rest at the owned nodes, N, at displacements of the zone: on its edge what the condensed cells
    /// make of them, inside the rest those that are in equilibrium, none along supports.
    pub(super) fn forces_of_rest(&self, u: &[f64]) -> Vec<f64> {
        let Some(state) = self.zone.as_ref().and_then(|zone| zone.state.as_ref()) else {
            return vec![0.0; u.len()];
        };
        let (constraints, dim) = (&self.model.constraints, self.part.dim);
        let mut forces = constraints.to_frames(&self.loads.external_at(&self.loads.factors), dim);
        state.rest.zone_unknowns().iter().for_each(|&i| forces[i] = 0.0);
        let prescribed = prescribed_at(&state.prescribed, &self.loads.factors, u.len());
        for (i, f) in state.rest.on_edge(&constraints.to_frames(&self.held_at_fixings(u), dim)) {
            forces[i] = f - state.thermal[i] - prescribed[i];
        }
        state.held.iter().for_each(|&i| forces[i] = 0.0);
        constraints.from_frames(&forces, dim)
    }

    /// Displacements at the owned nodes without the part of the free motions, m: as the stiffness matrix knows them, in which fixings
    /// hold these. A body on one rank.
    fn held_at_fixings(&self, u: &[f64]) -> Vec<f64> {
        let (part, dim, n) = (&self.part, self.part.dim, self.free.modes.len());
        let mut held = u.to_vec();
        if n == 0 {
            return held;
        }
        let fixed: Vec<(usize, [f64; 3])> = std::iter::zip(self.fixed_nodes(), self.fixings.iter())
            .map(|(node, fixing)| (node, fixing.direction))
            .collect();
        let along = |d: &[f64; 3], v: &[f64]| std::iter::zip(&d[..dim], v).map(|(d, v)| d * v).sum::<f64>();
        let modes = DMatrix::from_fn(fixed.len(), n, |i, k| {
            let (node, d) = &fixed[i];
            let mode = self.free.at(k, part.original[*node], &part.points[*node]);
            along(d, &mode[..dim])
        });
        let moved = DVector::from_iterator(
            fixed.len(),
            fixed.iter().map(|(node, d)| along(d, &u[node * dim..][..dim])),
        );
        let Some(alpha) = modes.lu().solve(&moved) else { return held };
        for (node, u) in held.chunks_exact_mut(dim).enumerate() {
            for (k, alpha) in alpha.iter().enumerate() {
                let mode = self.free.at(k, part.original[node], &part.points[node]);
                std::iter::zip(&mut *u, mode).for_each(|(u, m)| *u -= alpha * m);
            }
        }
        held
    }
}

fn prescribed_at(parts: &[Part], factors: &LoadFactors, n: usize) -> Vec<f64> {
    scaled(parts, n, |path| factors.on_supports(path))
}

/// Condenses the cells that are not in the zone.
fn condense(
    model: &Model,
    (temperature, heated): (Option<&[f64]>, f64),
    points: &Points,
    is_in: Vec<bool>,
    (diagonal, interface, prefix): (f64, &[usize], &str),
    group: &SimpleCommunicator,
) -> Result<Condensed> {
    let Share { mut entries, thermal, mut prescribed } =
        model.share(temperature, points, |c| !is_in[c], group)?;
    let in_rest = touched(&model.part, |c| !is_in[c]);
    let (held, values) = model.held();
    for &i in held.iter().filter(|&&i| in_rest[i]) {
        entries.add_diagonal(i as i32, diagonal);
    }
    // All held unknowns are counted here, whichever part has them.
    for (part, values) in std::iter::zip(&mut prescribed, values) {
        values.into_iter().for_each(|(i, value)| part.forces[i] = diagonal * value);
    }
    let (rows, columns, values) = entries.into_triples();
    let in_zone = touched(&model.part, |c| is_in[c]);
    let interface: Vec<i32> = interface.iter().map(|&i| i as i32).collect();
    let n = model.part.n_owned * model.part.dim;
    let rest = Rest::new(group, n, (&rows, &columns, &values), &interface, &in_zone, prefix)?;
    let of_zone = held.iter().copied().filter(|&i| !in_rest[i]).collect();
    Ok(Condensed {
        is_in,
        held,
        of_zone,
        rest: Rc::new(rest),
        thermal,
        prescribed,
        diagonal,
        heated,
        factor: None,
    })
}

/// Unknowns that chosen cells touch, those of the masters of their slaves included.
fn touched(part: &MeshPart, chosen: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut touched = vec![false; part.n_owned * part.dim];
    let hanging = Hanging::of(part);
    for (_, cell) in part.cells.iter().enumerate().filter(|(c, _)| chosen(*c)) {
        let masters = hanging.reduce(cell).map(|reduced| reduced.nodes).unwrap_or_default();
        for &node in cell.nodes().iter().chain(&masters) {
            (0..part.dim).for_each(|c| touched[node as usize * part.dim + c] = true);
        }
    }
    touched
}

/// Largest equivalent stress of a cell's points over their yield stress.
fn loading(points: &Points, cell: usize, model: &Model, temperature: Option<&[f64]>) -> f64 {
    let of = &model.part.cells[cell];
    let (law, rule) = (model.laws.of(of), model.elements.of(of.kind).points());
    let ratios = std::iter::zip(&points.current[points.range(cell)], rule).map(|(state, point)| {
        let shape = of.kind.shape(&point.xi);
        law.yield_ratio(state, temperature_at(temperature, of, &shape.n[..of.kind.n_nodes()]))
    });
    ratios.fold(0.0, larger)
}
