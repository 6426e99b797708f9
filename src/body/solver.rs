//! The answer of a body by its solver: each step is a solve of the whole body, on all ranks of its group.
//!
//! The first rank runs the driver and knows the rows; the interface nodes are its own. The other ranks serve: they
//! wait for what the first asks for and take part in it.
use super::{Body, dirichlet::Dirichlet, interface::contact_force, parts::Parts, row_values::RowValues};
use crate::{error::Result, parallel, vector::pseudo_inverse};
use mpi::{topology::SimpleCommunicator, traits::*};
use nalgebra::{DMatrix, DVector};
use std::{rc::Rc, time::Instant};

/// What the first rank asks the others for.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    Finish,
    Solve,
    Prescribe,
}

/// The answer.
pub struct Solver {
    pub(super) parts: Parts,
    group: SimpleCommunicator,
    /// Made at the first displacement step.
    dirichlet: Option<Dirichlet>,
}

impl Solver {
    pub(super) fn new(body: &Body, group: &SimpleCommunicator, values: RowValues) -> Solver {
        Solver { parts: Parts::new(body, values), group: group.duplicate(), dirichlet: None }
    }

    pub(super) fn is_of(&self, body: &Body) -> bool {
        Rc::ptr_eq(&self.parts.system, &body.system)
    }

    pub(super) fn dim(&self) -> usize {
        self.parts.model.part.dim
    }

    /// Takes part in the first rank's steps until it finishes. Returns at once on the first rank.
    pub(super) fn serve(&mut self) -> Result<()> {
        if self.group.rank() == 0 {
            return Ok(());
        }
        // A failure is every rank's: the first rank finds it too, and then finishes.
        let mut served = Ok(());
        loop {
            let result = match self.request(Order::Finish) {
                Order::Finish => return served,
                Order::Solve => self.solve(&[]),
                Order::Prescribe => self.prescribe(&[]),
            };
            served = served.and(result.map(|_| ()));
        }
    }

    pub(super) fn finish(&self) {
        if self.group.rank() == 0 {
            self.request(Order::Finish);
        }
    }

    /// The first rank's request, on all ranks. Those that wait sleep. Collective.
    fn request(&self, what: Order) -> Order {
        const ALL: [Order; 3] = [Order::Finish, Order::Solve, Order::Prescribe];
        if self.group.size() == 1 {
            return what;
        }
        parallel::idle_barrier(&self.group);
        let mut code = ALL.iter().position(|r| *r == what).unwrap_or(0) as u64;
        self.group.process_at_rank(0).broadcast_into(&mut code);
        ALL[code as usize]
    }

    /// Displacements at the interface nodes under forces there and no load, global axes. Collective.
    fn solve(&self, force: &[f64]) -> Result<Vec<f64>> {
        let (dim, constraints) = (self.dim(), &self.parts.interface.constraints);
        let mut rhs = vec![0.0; self.parts.model.part.n_owned * dim];
        let dofs = self.parts.interface.dofs(dim);
        std::iter::zip(&dofs, constraints.to_frames(force, dim)).for_each(|(&dof, f)| rhs[dof] = f);
        let x = self.parts.system.solve(&self.group, &rhs)?;
        Ok(constraints.from_frames(&dofs.into_iter().map(|dof| x[dof]).collect::<Vec<_>>(), dim))
    }

    /// Forces that hold the interface nodes at the prescribed row displacements. Collective.
    fn prescribe(&mut self, inward: &[f64]) -> Result<Vec<f64>> {
        let dirichlet = match self.dirichlet.take() {
            Some(dirichlet) => dirichlet,
            None => {
                let start = Instant::now();
                let made = Dirichlet::new(&self.parts, &self.group)?;
                self.parts.cost.add(|c| {
                    c.factorisations += 1;
                    c.factor += start.elapsed().as_secs_f64();
                });
                made
            }
        };
        let force = dirichlet.solve(&self.parts, &self.group, inward);
        self.dirichlet = Some(dirichlet);
        force
    }

    /// Displacements at the interface nodes under row forces alone, m.
    pub(super) fn interface_displacements(&self, force: &[f64]) -> Result<Vec<f64>> {
        self.request(Order::Solve);
        let f = contact_force(&self.parts.values.rows, force, self.parts.interface.nodes.len(), self.dim());
        self.solve(&f)
    }

    pub(super) fn force_step(&self, force: &[f64]) -> Result<Vec<f64>> {
        let u = self.interface_displacements(force)?;
        Ok(self.parts.values.rows.iter().map(|row| -row.displacement(&u, self.dim())).collect())
    }

    pub(super) fn displacement_step(&mut self, inward: &[f64], active: &[bool]) -> Result<Vec<f64>> {
        if !active.contains(&true) {
            return Ok(vec![0.0; inward.len()]);
        }
        let on_active = |v: &[f64]| -> Vec<f64> {
            std::iter::zip(v, active).map(|(v, active)| if *active { *v } else { 0.0 }).collect()
        };
        let modes: Vec<Vec<f64>> = self.parts.values.modes.iter().map(|mode| on_active(mode)).collect();
        self.request(Order::Prescribe);
        let mut force = self.prescribe(&without(&modes, on_active(inward)))?;
        force = without(&modes, on_active(&force));
        Ok(force)
    }
}

/// v without its part in the span of `modes`.
fn without(modes: &[Vec<f64>], mut v: Vec<f64>) -> Vec<f64> {
    if modes.is_empty() {
        return v;
    }
    let dot = |a: &[f64], b: &[f64]| std::iter::zip(a, b).map(|(a, b)| a * b).sum::<f64>();
    let n = modes.len();
    let gram = pseudo_inverse(DMatrix::from_fn(n, n, |k, l| dot(&modes[k], &modes[l])));
    let beta = gram * DVector::from_iterator(n, modes.iter().map(|mode| dot(mode, &v)));
    for (beta, mode) in std::iter::zip(&beta, modes) {
        std::iter::zip(&mut v, mode).for_each(|(v, m)| *v -= beta * m);
    }
    v
}
