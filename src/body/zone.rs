//! The part of a body that yields: of a body on one rank, Newton's iterations assemble and factorise this zone alone, with the elastic
//! rest condensed onto the zone's edge and the contact unknowns.
//!
//! The zone grows by blocks of cells: a block belongs to it if one of its cells yields, or is near to it when the rest is condensed.
//! What yields outside is looked for after the first iterations of an increment and at its end.
use super::{
    Body,
    assembly::{Model, Share},
    estimate::largest_zone,
    hanging::Hanging,
    load::{LoadFactors, Part, scaled},
    points::Points,
};
use crate::{
    case::ZoneCase,
    error::Result,
    mesh::MeshPart,
    petsc::{Rest, ZoneFactor},
};
use mpi::topology::SimpleCommunicator;
use nalgebra::{DMatrix, DVector};
use std::{cell::RefCell, rc::Rc, time::Instant};

/// Cells of a block.
const BLOCK: usize = 64;

/// A block joins the zone if a point of it is loaded to this share of its yield stress when the rest is condensed: what joins later
/// has the rest condensed anew.
const NEAR: f64 = 0.7;

/// What a body knows of its zone.
pub(super) struct Zone {
    /// Largest share of the cells.
    largest: f64,
    /// Cells by blocks.
    blocks: Vec<Vec<u32>>,
    /// The zone, while the rest is condensed.
    state: Option<Condensed>,
}

/// A body whose rest is condensed.
struct Condensed {
    /// Of each cell: whether it is in the zone.
    is_in: Vec<bool>,
    share: f64,
    rest: Rc<Rest>,
    /// Forces at the owned nodes of the rest's cells, N, held unknowns with the diagonal.
    thermal: Vec<f64>,
    prescribed: Vec<Part>,
    /// Diagonal of held unknowns, N/m.
    diagonal: f64,
    /// Factor of the temperature at which the rest's thermal forces are.
    heated: f64,
    factor: Option<Rc<RefCell<ZoneFactor>>>,
}

impl Zone {
    /// Of a body with so many unknowns on its interface.
    pub fn new(kind: ZoneCase, part: &MeshPart, n_interface_dofs: usize) -> Zone {
        let largest = match kind {
            ZoneCase::Never => 0.0,
            ZoneCase::Always => 1.0,
            ZoneCase::Automatic => largest_zone(part.n_owned * part.dim, n_interface_dofs, part.dim),
        };
        let mut cells: Vec<u32> = (0..part.cells.len() as u32).collect();
        let mut blocks = Vec::new();
        divide(&centres(part), &mut cells, &mut blocks);
        Zone { largest, blocks, state: None }
    }

    /// Share of the cells that iterations factorise.
    pub fn share(&self) -> f64 {
        self.state.as_ref().map_or(1.0, |state| state.share)
    }

    /// The cells of the zone, while there is one.
    pub fn cells(&self) -> Option<&[bool]> {
        self.state.as_ref().map(|state| &state.is_in[..])
    }

    /// The whole body is iterated.
    pub fn dissolve(&mut self) {
        self.state = None;
    }

    /// The zone that holds all cells that yield, and those near to it if it is new; `None` if the whole body is to be factorised.
    fn grown(&self, yields: &[bool], is_near: impl Fn(usize) -> bool) -> Option<Vec<bool>> {
        let touched = |block: &[u32], test: &dyn Fn(usize) -> bool| block.iter().any(|&c| test(c as usize));
        let holds = |is_in: &[bool]| (0..yields.len()).all(|c| !yields[c] || is_in[c]);
        let known = self.cells().filter(|is_in| holds(is_in));
        let is_in = match known {
            Some(is_in) => is_in.to_vec(),
            None => {
                let old = self.cells();
                let joins = |c: usize| yields[c] || is_near(c) || old.is_some_and(|old| old[c]);
                let mut is_in = vec![false; yields.len()];
                for block in self.blocks.iter().filter(|block| touched(block, &joins)) {
                    block.iter().for_each(|&c| is_in[c as usize] = true);
                }
                is_in
            }
        };
        let share = share_of(&is_in);
        (share <= self.largest && share < 1.0).then_some(is_in)
    }
}

impl Body {
    /// Factorises the zone at the laws of its points; false if the whole body is to be factorised. A body on one rank.
    pub(super) fn linearise_zone(&mut self, group: &SimpleCommunicator) -> Result<bool> {
        let (Some(zone), Some(points)) = (&mut self.zone, &self.points) else { return Ok(false) };
        let start = Instant::now();
        let temperature = self.temperature.as_ref().map(|t| &t[..]);
        let near = |cell: usize| points.loading(cell, &self.model, temperature) > NEAR;
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
        let (rows, columns, mut values) = entries.into_triples();
        // Held unknowns that the rest does not have.
        let (held, _) = model.held();
        let in_rest = touched(&self.part, |c| !state.is_in[c]);
        let (mut rows, mut columns) = (rows, columns);
        for i in held.into_iter().filter(|&i| !in_rest[i]) {
            rows.push(i as i32);
            columns.push(i as i32);
            values.push(state.diagonal);
        }
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
        let (held, _) = self.model.held();
        held.into_iter().for_each(|i| forces[i] = 0.0);
        constraints.from_frames(&forces, dim)
    }
}

impl Body {
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
    let share = share_of(&is_in);
    Ok(Condensed { is_in, share, rest: Rc::new(rest), thermal, prescribed, diagonal, heated, factor: None })
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

fn share_of(is_in: &[bool]) -> f64 {
    is_in.iter().filter(|is_in| **is_in).count() as f64 / is_in.len() as f64
}

/// Mean of the nodes of each cell, m.
fn centres(part: &MeshPart) -> Vec<[f64; 3]> {
    let centre = |cell: &crate::mesh::Cell| {
        let nodes = cell.nodes();
        std::array::from_fn(|c| {
            nodes.iter().map(|&node| part.points[node as usize][c]).sum::<f64>() / nodes.len() as f64
        })
    };
    part.cells.iter().map(centre).collect()
}

/// Cuts the cells in two across their longer side, and the halves again, down to blocks.
fn divide(centres: &[[f64; 3]], cells: &mut [u32], blocks: &mut Vec<Vec<u32>>) {
    if cells.len() <= BLOCK {
        blocks.push(cells.to_vec());
        return;
    }
    let extent = |c: usize| {
        let values = cells.iter().map(|&cell| centres[cell as usize][c]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (crate::vector::smaller(low, x), crate::vector::larger(high, x))
        });
        high - low
    };
    let axis = if extent(0) >= extent(1) { 0 } else { 1 };
    let middle = cells.len() / 2;
    cells.select_nth_unstable_by(middle, |&a, &b| {
        centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b))
    });
    let (low, high) = cells.split_at_mut(middle);
    divide(centres, low, blocks);
    divide(centres, high, blocks);
}
