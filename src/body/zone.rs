//! The part of a body that yields: of a body on one rank, Newton's iterations assemble and factorise this zone alone, with the elastic
//! rest condensed onto the zone's edge and the contact unknowns.
//!
//! The zone grows by blocks of cells: a block belongs to it if one of its cells yields, or is near to it when the rest is condensed.
//! What yields outside is looked for after the first iterations of an increment and at its end.
use super::{estimate::largest_zone, load::Part};
use crate::{
    case::ZoneCase,
    mesh::{Cell, MeshPart},
    petsc::{Rest, ZoneFactor},
    vector::{larger, smaller},
};
use std::{cell::RefCell, rc::Rc};

/// Cells of a block.
const BLOCK: usize = 64;

/// What a body knows of its zone.
pub(super) struct Zone {
    /// Largest share of the cells.
    pub largest: f64,
    /// Cells by blocks.
    pub blocks: Vec<Vec<u32>>,
    /// The zone, while the rest is condensed.
    pub state: Option<Condensed>,
}

/// A body whose rest is condensed.
pub(super) struct Condensed {
    /// Of each cell: whether it is in the zone.
    pub is_in: Vec<bool>,
    /// Held unknowns, and those among them that the rest does not touch.
    pub held: Vec<usize>,
    pub of_zone: Vec<usize>,
    pub rest: Rc<Rest>,
    /// Forces at the owned nodes of the rest's cells, N, held unknowns with the diagonal.
    pub thermal: Vec<f64>,
    pub prescribed: Vec<Part>,
    /// Diagonal of held unknowns, N/m.
    pub diagonal: f64,
    /// Factor of the temperature at which the rest's thermal forces are.
    pub heated: f64,
    pub factor: Option<Rc<RefCell<ZoneFactor>>>,
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
        self.cells().map_or(1.0, share_of)
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
    pub fn grown(&self, yields: &[bool], is_near: impl Fn(usize) -> bool) -> Option<Vec<bool>> {
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

/// Share of the cells that are in.
fn share_of(is_in: &[bool]) -> f64 {
    is_in.iter().filter(|is_in| **is_in).count() as f64 / is_in.len() as f64
}

/// Mean of the nodes of each cell, m.
fn centres(part: &MeshPart) -> Vec<[f64; 3]> {
    let centre = |cell: &Cell| {
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
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (smaller(low, x), larger(high, x)));
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
