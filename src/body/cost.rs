//! What a body has cost.
use std::{cell::Cell, rc::Rc};

/// What the body's solver has cost so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cost {
    /// Set-ups of the solver: factorisations of the stiffness matrix with a direct one.
    pub factorisations: usize,
    /// Solves with the stiffness matrix, or with its interior block (right-hand sides).
    pub solves: usize,
    /// Factorisations of interface operators for displacement steps.
    pub interface_factorisations: usize,
    /// Seconds of assembly.
    pub assemble: f64,
    /// Seconds of factorisation.
    pub factor: f64,
    /// Seconds of making and factorising interface operators.
    pub interface: f64,
    /// Seconds of condensing loads to the interface.
    pub condense: f64,
}

/// Counters that a body shares with its responses.
#[derive(Debug, Clone, Default)]
pub(super) struct SharedCost(Rc<Cell<Cost>>);

impl SharedCost {
    pub fn get(&self) -> Cost {
        self.0.get()
    }

    pub fn add(&self, change: impl FnOnce(&mut Cost)) {
        let mut cost = self.0.get();
        change(&mut cost);
        self.0.set(cost);
    }
}
