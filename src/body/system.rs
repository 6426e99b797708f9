//! A body's equations and how they are solved: by its solver, or condensed to its interface.
use super::{
    Interface, condense_estimate,
    cost::SharedCost,
    soft::{SoftModes, Split},
};
use crate::tolerances::PRODUCT;
use crate::vector::larger;
use crate::{
    error::{Error, Result},
    parallel::{self, agree},
    petsc::{Cholesky, Ksp, Matrix, SchurFactor, Stage, Symmetric, Vector, ZoneFactor},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use std::{cell::RefCell, rc::Rc, time::Instant};

/// A relative residual above this, and above what rounding the product A x alone leaves, gets the final displacements of a
/// body one step of iterative refinement.
const REFINE: f64 = 1e-12;

/// Names for options and messages.
#[derive(Debug, Clone)]
pub(super) struct Setting {
    pub body: String,
    /// Prefix of its PETSc options.
    pub prefix: String,
    /// Displacement components of a node.
    pub dim: usize,
    /// Relative residual that the answers of an iterative solver may have at most.
    pub tolerance: f64,
}

impl Setting {
    /// Says of which body an error is.
    pub fn of_body(&self, e: Error) -> Error {
        e.map(|text| format!("body '{}': {text}", self.body))
    }
}

/// The stiffness matrix with its solver. Vectors: owned unknowns, in the nodes' frames.
pub(super) struct System {
    /// `None` where the rest of a body is condensed.
    matrix: Option<Matrix>,
    /// Largest diagonal entry, N/m.
    diagonal: f64,
    answer: Answer,
    setting: Setting,
    cost: SharedCost,
}

enum Answer {
    Solver(Ksp),
    Condensed(Box<Condensate>),
}

/// What condensation leaves.
struct Condensate {
    interior: Interior,
    /// Factor of the Schur complement, soft modes stiffened, on the first rank.
    interface: Option<Cholesky>,
    /// The soft modes, on the first rank.
    soft: SoftModes,
    /// Owned unknowns of the interface, on the first rank; its first global unknowns are its own.
    dofs: Vec<usize>,
}

/// What the unknowns that are not on the interface are condensed by.
enum Interior {
    Whole(Rc<RefCell<SchurFactor>>),
    Zone(Rc<RefCell<ZoneFactor>>),
}

impl Interior {
    fn reduce(&self, group: &SimpleCommunicator, b: &[f64]) -> Result<Vec<f64>> {
        match self {
            Interior::Whole(factor) => factor.borrow().reduce(group, b),
            Interior::Zone(factor) => factor.borrow().reduce(group, b),
        }
    }

    fn expand(&self, group: &SimpleCommunicator, b: &[f64], x_b: &[f64]) -> Result<Vec<f64>> {
        match self {
            Interior::Whole(factor) => factor.borrow().expand(group, b, x_b),
            Interior::Zone(factor) => factor.borrow().expand(group, b, x_b),
        }
    }
}

impl System {
    /// Factorises; `split`: the soft modes to split off if the body is condensed. Collective, errors included.
    pub fn new(
        group: &SimpleCommunicator,
        matrix: Matrix,
        interface: &Interface,
        setting: Setting,
        condensed: bool,
        split: Option<&Split>,
        cost: &SharedCost,
    ) -> Result<System> {
        let failed = |e: Error| match e {
            Error::Internal(_) | Error::Indefinite(_) => e.map(|text| {
                format!("body '{}': the stiffness matrix cannot be factorised: {text}", setting.body)
            }),
            other => setting.of_body(other),
        };
        let _stage = Stage::Factor.enter();
        parallel::busy_with(format!("factorising body '{}'", setting.body));
        let start = Instant::now();
        let answer = if condensed {
            let dofs = interface.dofs(setting.dim);
            let indices: Vec<i32> = dofs.iter().map(|&dof| dof as i32).collect();
            let (interior, s) =
                SchurFactor::new(group, &matrix, &indices, &setting.prefix).map_err(failed)?;
            cost.add(|c| c.factor += start.elapsed().as_secs_f64());
            let _stage = Stage::Condense.enter();
            let start = Instant::now();
            let factor = match group.rank() {
                0 => factor_interface(Symmetric::from_lower_rows(dofs.len(), s), split).map(Some),
                _ => Ok(None),
            };
            let (interface, soft) = agree(group, factor.map_err(failed))?.unzip();
            cost.add(|c| c.interface += start.elapsed().as_secs_f64());
            Answer::Condensed(Box::new(Condensate {
                interior: Interior::Whole(Rc::new(RefCell::new(interior))),
                interface,
                soft: soft.unwrap_or_default(),
                dofs,
            }))
        } else {
            let ksp = Ksp::new(group, &matrix, &setting.prefix, setting.tolerance)
                .map_err(|e| setting.of_body(e))?;
            if ksp.is_direct() {
                let need = condense_estimate(matrix.n_rows(), 0, setting.dim).factor_bytes;
                let own = need / f64::from(group.size());
                parallel::demand(group, own, "its factorisation").map_err(failed)?;
            }
            ksp.set_up().map_err(failed)?;
            cost.add(|c| c.factor += start.elapsed().as_secs_f64());
            Answer::Solver(ksp)
        };
        cost.add(|c| c.factorisations += 1);
        let diagonal = matrix.largest_diagonal()?;
        Ok(System { matrix: Some(matrix), diagonal, answer, setting, cost: cost.clone() })
    }

    /// The same body with another stiffness of the same pattern; `renewable`: the factor of the last such one, which is factorised
    /// again, or made. A condensed body. Collective, errors included.
    pub fn renewed(
        &self,
        group: &SimpleCommunicator,
        matrix: Matrix,
        renewable: &mut Option<Rc<RefCell<SchurFactor>>>,
        interface: &Interface,
        split: Option<&Split>,
    ) -> Result<System> {
        let _stage = Stage::Factor.enter();
        parallel::busy_with(format!("factorising body '{}'", self.setting.body));
        let start = Instant::now();
        let dofs = interface.dofs(self.setting.dim);
        let (factor, s) = match renewable {
            Some(factor) => {
                let s = factor.borrow_mut().refactorise(group, &matrix);
                (factor.clone(), s.map_err(|e| self.setting.of_body(e))?)
            }
            None => {
                let indices: Vec<i32> = dofs.iter().map(|&dof| dof as i32).collect();
                let made = SchurFactor::renewable(group, &matrix, &indices, &self.setting.prefix);
                let (factor, s) = made.map_err(|e| self.setting.of_body(e))?;
                let factor = Rc::new(RefCell::new(factor));
                *renewable = Some(factor.clone());
                (factor, s)
            }
        };
        self.cost.add(|c| {
            c.factor += start.elapsed().as_secs_f64();
            c.factorisations += 1;
        });
        let factored = match group.rank() {
            0 => self.factor_interface(s, dofs.len(), split).map(Some),
            _ => Ok(None),
        };
        let (interface, soft) = agree(group, factored)?.unzip();
        let answer = Answer::Condensed(Box::new(Condensate {
            interior: Interior::Whole(factor),
            interface,
            soft: soft.unwrap_or_default(),
            dofs,
        }));
        let diagonal = matrix.largest_diagonal()?;
        Ok(System {
            matrix: Some(matrix),
            diagonal,
            answer,
            setting: self.setting(),
            cost: self.cost.clone(),
        })
    }

    /// The same body with its rest condensed: the `factor` of its zone, and the complement of that on the interface unknowns `dofs`.
    pub fn of_zone(
        &self,
        factor: Rc<RefCell<ZoneFactor>>,
        complement: Vec<f64>,
        dofs: Vec<usize>,
        split: Option<&Split>,
    ) -> Result<System> {
        let (interface, soft) = self.factor_interface(complement, dofs.len(), split)?;
        let interior = Interior::Zone(factor);
        let answer =
            Answer::Condensed(Box::new(Condensate { interior, interface: Some(interface), soft, dofs }));
        let (setting, cost) = (self.setting(), self.cost.clone());
        Ok(System { matrix: None, diagonal: self.diagonal, answer, setting, cost })
    }

    fn factor_interface(
        &self,
        s: Vec<f64>,
        n: usize,
        split: Option<&Split>,
    ) -> Result<(Cholesky, SoftModes)> {
        let _stage = Stage::Condense.enter();
        let start = Instant::now();
        let factor = factor_interface(Symmetric::from_lower_rows(n, s), split);
        self.cost.add(|c| c.interface += start.elapsed().as_secs_f64());
        factor.map_err(|e| self.setting.of_body(e))
    }

    /// Largest diagonal entry, N/m.
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    pub fn setting(&self) -> Setting {
        self.setting.clone()
    }

    pub fn is_condensed(&self) -> bool {
        matches!(self.answer, Answer::Condensed(_))
    }

    /// The solver; `None` if the body is condensed.
    pub fn ksp(&self) -> Option<&Ksp> {
        match &self.answer {
            Answer::Solver(ksp) => Some(ksp),
            Answer::Condensed(_) => None,
        }
    }

    /// What the options of the solver say and is not done.
    pub fn notes(&self) -> &[String] {
        self.ksp().map_or(&[], Ksp::notes)
    }

    /// True if the residual of an answer has been measured, and is as small as it can be made.
    fn is_measured(&self) -> bool {
        self.ksp().is_some_and(|ksp| !ksp.is_direct())
    }

    /// Factor of the Schur complement, on the first rank of a condensed body.
    pub fn interface_factor(&self) -> Option<&Cholesky> {
        match &self.answer {
            Answer::Condensed(c) => c.interface.as_ref(),
            Answer::Solver(_) => None,
        }
    }

    /// Soft modes that were split off, on the first rank; none elsewhere. The factor of the interface is then that of a
    /// body whose soft modes are stiffened.
    pub fn soft(&self) -> Option<&SoftModes> {
        match &self.answer {
            Answer::Condensed(c) => Some(&c.soft),
            Answer::Solver(_) => None,
        }
    }

    /// x = A^-1 b but for soft modes that were split off. Collective.
    pub fn solve(&self, group: &SimpleCommunicator, b: &[f64]) -> Result<Vec<f64>> {
        match &self.answer {
            Answer::Solver(ksp) => {
                let (rhs, x) = (vector(group, b)?, Vector::zeros(group, b.len())?);
                ksp.solve(&rhs, &x).map_err(|e| self.setting.of_body(e))?;
                self.cost.add(|c| c.solves += 1);
                x.to_vec()
            }
            Answer::Condensed(condensate) => {
                let mut interface = self.condense(group, b)?;
                let solved = condensate.interface.as_ref().map_or(Ok(()), |s| s.solve(&mut interface));
                agree(group, solved)?;
                self.recover(group, b, &interface)
            }
        }
    }

    /// As [`System::solve`]; a direct one with one step of iterative refinement, which makes the answer independent of the
    /// factorisation's round-off and so of the number of ranks. Collective.
    pub fn solve_refined(&self, group: &SimpleCommunicator, b: &[f64]) -> Result<Vec<f64>> {
        let x = self.solve(group, b)?;
        if self.is_measured() {
            return Ok(x);
        }
        let residual = self.residual(group, b, &x)?;
        self.correct(group, x, &residual)
    }

    /// b_B - A_BI A_II^-1 b_I, on the first rank; empty elsewhere. Half a solve. Collective.
    pub fn condense(&self, group: &SimpleCommunicator, b: &[f64]) -> Result<Vec<f64>> {
        let Answer::Condensed(condensate) = &self.answer else { return Ok(Vec::new()) };
        let Condensate { interior, dofs, .. } = &**condensate;
        let mut inside = b.to_vec();
        dofs.iter().for_each(|&dof| inside[dof] = 0.0);
        let size = parallel::max(group, &[inside.iter().fold(0.0, |m, v| larger(m, v.abs()))])[0];
        if size == 0.0 {
            return Ok(dofs.iter().map(|&dof| b[dof]).collect());
        }
        let _stage = Stage::Condense.enter();
        let start = Instant::now();
        let condensed = interior.reduce(group, b)?;
        self.cost.add(|c| c.condense += start.elapsed().as_secs_f64());
        Ok(condensed)
    }

    /// All of x from x_B, given on the first rank: x_I = A_II^-1 (b_I - A_IB x_B). Half a solve if b_I has just been
    /// condensed, else a whole one. Collective.
    pub fn recover(&self, group: &SimpleCommunicator, b: &[f64], interface: &[f64]) -> Result<Vec<f64>> {
        let Answer::Condensed(condensate) = &self.answer else {
            return Err(Error::internal("only a condensed body recovers its interior"));
        };
        let x = condensate.interior.expand(group, b, interface)?;
        self.cost.add(|c| c.solves += 1);
        Ok(x)
    }

    /// As [`System::recover`], but of unknowns that iterations of a zone change: nought elsewhere, and no work there.
    pub fn recover_zone(&self, group: &SimpleCommunicator, b: &[f64], interface: &[f64]) -> Result<Vec<f64>> {
        match &self.answer {
            Answer::Condensed(condensate) => match &condensate.interior {
                Interior::Zone(factor) => {
                    let factor = factor.borrow();
                    let of_zone = factor.expand_zone(group, b, interface)?;
                    let mut x = vec![0.0; b.len()];
                    std::iter::zip(factor.rest().zone_unknowns(), of_zone)
                        .for_each(|(&i, value)| x[i] = value);
                    Ok(x)
                }
                Interior::Whole(_) => self.recover(group, b, interface),
            },
            Answer::Solver(_) => self.recover(group, b, interface),
        }
    }

    /// x with one step of iterative refinement if its residual asks for it; never after an iterative solver, which has
    /// measured it. Collective.
    pub fn refine(&self, group: &SimpleCommunicator, b: &[f64], x: Vec<f64>) -> Result<Vec<f64>> {
        if self.is_measured() || self.matrix.is_none() {
            return Ok(x);
        }
        let residual = self.residual(group, b, &x)?;
        let squares = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let sums = parallel::sum(group, &[squares(&residual), squares(b), squares(&x)]);
        let round_off = PRODUCT * self.diagonal * sums[2].sqrt();
        if sums[0].sqrt() <= (REFINE * sums[1].sqrt()).max(round_off) {
            return Ok(x);
        }
        self.correct(group, x, &residual)
    }

    fn correct(&self, group: &SimpleCommunicator, mut x: Vec<f64>, residual: &[f64]) -> Result<Vec<f64>> {
        let correction = self.solve(group, residual)?;
        std::iter::zip(&mut x, correction).for_each(|(x, d)| *x += d);
        Ok(x)
    }

    /// A x. Collective.
    fn times(&self, group: &SimpleCommunicator, x: &[f64]) -> Result<Vec<f64>> {
        let (x, y) = (vector(group, x)?, Vector::zeros(group, x.len())?);
        let matrix = self.matrix.as_ref().ok_or_else(|| Error::internal("a condensed rest has no matrix"))?;
        matrix.times(&x, &y)?;
        y.to_vec()
    }

    fn residual(&self, group: &SimpleCommunicator, b: &[f64], x: &[f64]) -> Result<Vec<f64>> {
        Ok(std::iter::zip(b, self.times(group, x)?).map(|(b, ax)| b - ax).collect())
    }
}

/// Factor of the Schur complement with its soft modes stiffened, and these.
fn factor_interface(s: Symmetric, split: Option<&Split>) -> Result<(Cholesky, SoftModes)> {
    let factor = match split {
        Some(split) => split.apply(s)?,
        None => s.into_cholesky(0.0)?.map(|factor| (factor, SoftModes::default())),
    };
    factor.ok_or_else(|| {
        Error::Indefinite(
            "the Schur complement of the interface is not positive definite: a piece of the mesh is not held, or the body \
             is so thin for its length that its bending is lost in the round-off of its other stiffnesses".into(),
        )
    })
}

/// A distributed vector of owned entries.
fn vector(group: &SimpleCommunicator, owned: &[f64]) -> Result<Vector> {
    let v = Vector::zeros(group, owned.len())?;
    v.set(owned)?;
    Ok(v)
}
