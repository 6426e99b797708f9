//! A condensed body's answer: dense algebra on its interface, on the first rank of its group.
//!
//! With the Schur complement S = L L' and the rows J (held components left out), C = J S^-1 J' = Y'Y, Y = L^-1 J'.
use super::{
    Body, Interface, cost::SharedCost, interface::contact_force, row_values::RowValues, system::System,
};
use crate::tolerances::HELD_COMPLIANCE;
use crate::{
    error::{Error, Result},
    petsc::{Cholesky, Stage, Symmetric},
    schwarz::Spring,
    vector::pseudo_inverse,
};
use nalgebra::{DMatrix, DVector};
use std::{rc::Rc, time::Instant};

/// Where rows depend on each other, a displacement step takes the compliance plus this share of its mean diagonal: a
/// preconditioner that is bounded where the body has nothing to say.
const BOUNDED: f64 = 0.1;

/// Updates of the active set after which a unilateral step is given up: it is only a guess.
const UNILATERAL_UPDATES: usize = 60;

/// The answer; without rows on ranks other than the first.
pub struct Condensed {
    pub(super) values: RowValues,
    pub(super) interface: Rc<Interface>,
    system: Rc<System>,
    cost: SharedCost,
    pub(super) dim: usize,
    /// C, m/N.
    compliance: Symmetric,
    step: Option<Step>,
}

/// A displacement step's operators for one set of active rows.
struct Step {
    active: Vec<usize>,
    /// Of C_aa.
    factor: Cholesky,
    /// S G, mode by mode, N/m.
    forces: Vec<Vec<f64>>,
    /// Pseudo-inverse of G'S G, the springs' stiffness added where they take part.
    coarse: DMatrix<f64>,
}

impl Condensed {
    pub(super) fn new(body: &Body, values: RowValues) -> Result<Condensed> {
        let (dim, interface) = (body.part.dim, &body.interface);
        let mut compliance = Symmetric::default();
        if let Some(factor) = body.system.interface_factor() {
            let mut y = Vec::with_capacity(factor.n() * values.rows.len());
            let mut column = vec![0.0; factor.n()];
            for row in &values.rows {
                column.fill(0.0);
                row.add_to(1.0, &mut column, dim);
                y.extend(interface.constraints.to_frames(&column, dim));
            }
            factor.half_solve(&mut y)?;
            compliance = Symmetric::gram(&y, factor.n(), values.rows.len())?;
        }
        let (interface, system, cost) = (interface.clone(), body.system.clone(), body.cost.clone());
        Ok(Condensed { values, interface, system, cost, dim, compliance, step: None })
    }

    /// The soft modes' stiffnesses as springs, measured by the stiffness of the rows.
    pub(super) fn set_springs(&mut self) {
        let Some(soft) = self.system.soft() else { return };
        let n_rigid = self.values.modes.len() - soft.modes.len();
        let mean = self.compliance.mean_diagonal();
        let scale = if mean > 0.0 { 1.0 / mean } else { 1.0 };
        let springs = soft.stiffness.iter().enumerate().filter(|(_, k)| **k > 0.0);
        self.values.springs = springs
            .map(|(i, k)| Spring { mode: n_rigid + i, lever: (k / scale).sqrt(), stiffness: scale })
            .collect();
    }

    pub(super) fn is_of(&self, body: &Body) -> bool {
        Rc::ptr_eq(&self.system, &body.system)
    }

    /// C, m/N: symmetric, positive definite unless rows depend on each other.
    pub fn compliance(&self) -> &Symmetric {
        &self.compliance
    }

    /// Operations that the Schur complement's dense front, its factor and C have taken.
    pub(super) fn operations(&self) -> f64 {
        let b = (self.interface.nodes.len() * self.dim) as f64;
        let m = self.values.rows.len() as f64;
        2.0 / 3.0 * b.powi(3) + b * b * m + b * m * m
    }

    /// Force step.
    pub(super) fn push(&self, force: &[f64]) -> Result<Vec<f64>> {
        self.compliance.times(force)
    }

    /// Displacement step.
    pub(super) fn prescribe(&mut self, inward: &[f64], active: &[bool]) -> Result<Vec<f64>> {
        let mut force = vec![0.0; inward.len()];
        // A support holds the other rows: no force moves them, and none resists.
        let least = HELD_COMPLIANCE * self.compliance.mean_diagonal();
        let yields = |i: usize| self.compliance.at(i, i) > least;
        let chosen: Vec<usize> = (0..active.len()).filter(|&i| active[i] && yields(i)).collect();
        if chosen.is_empty() {
            return Ok(force);
        }
        if self.step.as_ref().is_none_or(|step| step.active != chosen) {
            let _stage = Stage::Condense.enter();
            let (start, dependent) = (Instant::now(), self.depend(&chosen));
            self.step = Some(Step::new(&self.compliance, &self.values.modes, &[], chosen, dependent)?);
            self.cost.add(|c| {
                c.interface_factorisations += 1;
                c.interface += start.elapsed().as_secs_f64();
            });
        }
        let Some(step) = &self.step else { return Ok(force) };
        let mut r: Vec<f64> = step.active.iter().map(|&i| inward[i]).collect();
        step.factor.solve(&mut r)?;
        if !step.forces.is_empty() {
            let modes = &self.values.modes;
            let work = modes.iter().map(|mode| dot(step.active.iter().map(|&i| mode[i]), &r));
            let beta = -&step.coarse * DVector::from_iterator(modes.len(), work);
            for (beta, forces) in std::iter::zip(&beta, &step.forces) {
                std::iter::zip(&mut r, forces).for_each(|(r, f)| *r += beta * f);
            }
        }
        std::iter::zip(&step.active, r).for_each(|(&i, r)| force[i] = r);
        Ok(force)
    }

    /// True if there are more normal rows than nodes that they move, or more tangential ones.
    fn depend(&self, rows: &[usize]) -> bool {
        [false, true].into_iter().any(|tangential| {
            let rows =
                || rows.iter().map(|&i| &self.values.rows[i]).filter(|row| row.tangential == tangential);
            let mut nodes: Vec<usize> = rows().flat_map(|row| &row.terms).map(|(node, _)| *node).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes.len() < rows().count()
        })
    }

    /// The complementarity problem on the chosen rows by a primal-dual active set; `None` if it does not settle.
    pub(super) fn unilateral_step(
        &self,
        gap: &[f64],
        chosen: &[bool],
        held: &[f64],
    ) -> Result<Option<Vec<f64>>> {
        let (n, modes) = (gap.len(), &self.values.modes);
        let others: Vec<f64> = (0..n).map(|i| if chosen[i] { 0.0 } else { held[i] }).collect();
        let at_rest = self.compliance.times(&others)?;
        let gap: Vec<f64> = std::iter::zip(gap, at_rest).map(|(g, w)| g + w).collect();
        let work = std::iter::zip(&self.values.mode_work, modes)
            .map(|(e, mode)| e - dot(others.iter().copied(), mode))
            .collect::<Vec<f64>>();
        let mut active: Vec<usize> = (0..n)
            .filter(|&i| chosen[i] && if modes.is_empty() { gap[i] < 0.0 } else { held[i] > 0.0 })
            .collect();
        for _ in 0..UNILATERAL_UPDATES {
            if active.is_empty() {
                return Ok(Some(vec![0.0; n]));
            }
            let step = Step::new(&self.compliance, modes, &self.values.springs, active.clone(), false)?;
            let mut r: Vec<f64> = active.iter().map(|&i| -gap[i]).collect();
            step.factor.solve(&mut r)?;
            let missing = std::iter::zip(&work, modes)
                .map(|(e, mode)| e - dot(active.iter().map(|&i| mode[i]), &r))
                .collect::<Vec<f64>>();
            let beta = &step.coarse * DVector::from_vec(missing);
            for (beta, forces) in std::iter::zip(&beta, &step.forces) {
                std::iter::zip(&mut r, forces).for_each(|(r, f)| *r += beta * f);
            }
            let mut force = vec![0.0; n];
            active.iter().zip(r).for_each(|(&i, r)| force[i] = r);
            let inward = self.compliance.times(&force)?;
            let rigid = |i: usize| std::iter::zip(&beta, modes).map(|(b, mode)| b * mode[i]).sum::<f64>();
            let stays = |i: usize| match force[i] == 0.0 {
                true => inward[i] + gap[i] - rigid(i) < 0.0,
                false => force[i] > 0.0,
            };
            let next: Vec<usize> = (0..n).filter(|&i| chosen[i] && stays(i)).collect();
            let settled = next == active;
            active = next;
            if settled {
                return Ok(Some(force));
            }
        }
        Ok(None)
    }

    /// Displacements at the interface nodes under row forces alone, m.
    pub(super) fn interface_displacements(&self, force: &[f64]) -> Result<Vec<f64>> {
        let Some(factor) = self.system.interface_factor() else { return Ok(Vec::new()) };
        let f = contact_force(&self.values.rows, force, self.interface.nodes.len(), self.dim);
        let mut u = self.interface.constraints.to_frames(&f, self.dim);
        factor.solve(&mut u)?;
        Ok(self.interface.constraints.from_frames(&u, self.dim))
    }
}

impl Step {
    fn new(
        compliance: &Symmetric,
        modes: &[Vec<f64>],
        springs: &[Spring],
        active: Vec<usize>,
        dependent: bool,
    ) -> Result<Step> {
        let factor = compliance
            .principal(&active)
            .regular_cholesky(if dependent { BOUNDED } else { 0.0 })
            .map_err(|e| Error::internal(format!("the compliance of the contact rows is singular: {e}")))?;
        let on_active: Vec<Vec<f64>> =
            modes.iter().map(|mode| active.iter().map(|&i| mode[i]).collect()).collect();
        let mut forces = on_active.clone();
        forces.iter_mut().try_for_each(|f| factor.solve(f))?;
        let n = modes.len();
        let mut stiffness = DMatrix::from_fn(n, n, |k, l| {
            let (a, b) = (
                dot(on_active[k].iter().copied(), &forces[l]),
                dot(on_active[l].iter().copied(), &forces[k]),
            );
            0.5 * (a + b)
        });
        springs.iter().for_each(|s| stiffness[(s.mode, s.mode)] += s.stiffness * s.lever * s.lever);
        Ok(Step { coarse: pseudo_inverse(stiffness), active, factor, forces })
    }
}

fn dot(a: impl Iterator<Item = f64>, b: &[f64]) -> f64 {
    a.zip(b).map(|(a, b)| a * b).sum()
}
