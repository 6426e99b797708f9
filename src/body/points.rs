//! The quadrature points of a body that yields: what they remember, and what they answer to displacements.
use super::{load::Part, system::System};
use crate::{
    element::PointLaw,
    material::{PointState, Tangent},
    mesh::Cell,
    petsc::SchurFactor,
};
use std::{cell::RefCell, rc::Rc};

/// All cells of the part, own and halo, one after the other.
pub(super) struct Points {
    /// Where each cell's points end.
    pub ends: Vec<u32>,
    /// At the last accepted state.
    pub accepted: Vec<PointState>,
    /// At the displacements of this iteration.
    pub current: Vec<PointState>,
    /// Total strains there.
    pub strains: Vec<[f64; 6]>,
    /// The linear laws there.
    pub laws: Vec<PointLaw>,
    /// Of each cell: whether a point yields.
    pub yields: Vec<bool>,
    /// Whether the internal modes of all cells have settled.
    pub settled: bool,
    /// Nodal forces of the stresses at the owned nodes, N.
    pub internal: Vec<f64>,
    /// Nodal forces that the thermal strains would make if nothing gave way, and a hundredth of those that the plastic strains
    /// would, at the owned nodes: what cancels inside, and what is there where no load is left, N.
    pub held: Vec<f64>,
    /// What the round-off of the displacements makes of `internal` at the owned nodes, N.
    pub rounding: Vec<f64>,
    pub tangent: Tangent,
    /// Whether nothing yields, on no rank.
    pub is_elastic: bool,
    /// While it holds for the temperature: what does not yield is factorised once.
    pub elastic: Option<Elastic>,
    /// Factor of the last stiffness of the whole body that was not elastic.
    pub renewable: Option<Rc<RefCell<SchurFactor>>>,
}

/// A body of which nothing yields.
#[derive(Clone)]
pub(super) struct Elastic {
    pub system: Rc<System>,
    /// Forces of the supports' displacements.
    pub prescribed: Vec<Part>,
}

/// Which points an evaluation brings to displacements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// All of them.
    All,
    /// Those that iterations change.
    Iterated,
}

/// What a body's points say of displacements.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Unbalanced {
    /// Sum of the squares of what is missing to equilibrium at free unknowns, of all nodal forces, and of what the unit round-off of
    /// the displacements makes of them, N2.
    pub squares: [f64; 3],
    /// Work of what is missing on the displacements of an iteration, J.
    pub work: f64,
    /// Whether the internal modes of all cells have settled, and nothing yields that was not iterated.
    pub settled: bool,
}

impl Points {
    pub fn new(cells: &[Cell], n_points: impl Fn(&Cell) -> usize, tangent: Tangent) -> Points {
        let mut end = 0;
        let ends: Vec<u32> = cells
            .iter()
            .map(|cell| {
                end += n_points(cell);
                end as u32
            })
            .collect();
        let none = PointLaw { h: [[0.0; 3]; 3], initial_strain: [0.0; 3], initial_stress: [0.0; 3] };
        Points {
            accepted: vec![PointState::default(); end],
            current: vec![PointState::default(); end],
            strains: vec![[0.0; 6]; end],
            laws: vec![none; end],
            yields: vec![false; cells.len()],
            ends,
            settled: true,
            internal: Vec::new(),
            held: Vec::new(),
            rounding: Vec::new(),
            tangent,
            is_elastic: true,
            elastic: None,
            renewable: None,
        }
    }

    pub fn range(&self, cell: usize) -> std::ops::Range<usize> {
        let first = cell.checked_sub(1).map_or(0, |before| self.ends[before]);
        first as usize..self.ends[cell] as usize
    }

    /// The linear laws of a cell.
    pub fn laws(&self, cell: usize) -> &[PointLaw] {
        &self.laws[self.range(cell)]
    }

    /// The states of a cell at the displacements of this iteration, and the strains.
    pub fn states(&self, cell: usize) -> (&[PointState], &[[f64; 6]]) {
        (&self.current[self.range(cell)], &self.strains[self.range(cell)])
    }

    /// Share of the points of a cell at which plastic strain grows.
    pub fn share_yielding(&self, cell: usize) -> f64 {
        let range = self.range(cell);
        let grows = |p: &usize| self.current[*p].equivalent > self.accepted[*p].equivalent;
        range.clone().filter(grows).count() as f64 / range.len() as f64
    }

    /// Of each cell: whether a point yields.
    pub fn yielding(&self) -> &[bool] {
        &self.yields
    }

    pub fn held(&self) -> &[f64] {
        &self.held
    }

    /// The elastic system does not hold at the temperatures to come.
    pub fn forget_elastic(&mut self) {
        self.elastic = None;
    }

    /// True if nothing yields, on no rank.
    pub fn is_elastic(&self) -> bool {
        self.is_elastic
    }

    /// Where the factor of a stiffness that is not elastic is kept, to be made again for the next one; `None` while it is elastic.
    pub fn renewable(&mut self) -> Option<&mut Option<Rc<RefCell<SchurFactor>>>> {
        (!self.is_elastic).then_some(&mut self.renewable)
    }

    pub fn keep_elastic(&mut self, system: &Rc<System>, prescribed: &[Part]) {
        self.elastic = Some(Elastic { system: system.clone(), prescribed: prescribed.to_vec() });
    }
}

/// (11, 22, 12) of (xx, yy, zz, xy, yz, xz).
pub(super) fn in_plane(stress: &[f64; 6]) -> [f64; 3] {
    [stress[0], stress[1], stress[3]]
}
