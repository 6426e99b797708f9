//! One factorisation that also returns the Schur complement on chosen unknowns.
//!
//! By MUMPS without PETSc between: PETSc's interface runs the two halves of a solve only together, whereas the loads of a
//! body are condensed (forwards) before the contact is solved and its interior is recovered (backwards) after it.
use super::{Matrix, error::check, handle::int, mumps, sys};
use crate::{
    error::{Error, Result},
    parallel,
};
use mpi::{ffi::RSMPI_Comm_c2f, topology::SimpleCommunicator, traits::*};
use std::{cell::RefCell, ffi::CString, ptr};

/// A factorisation short of memory is tried again with twice the reserve so often.
const RETRIES: usize = 6;

/// `job` of a call of MUMPS.
#[derive(Clone, Copy)]
#[repr(i32)]
enum Job {
    Start = -1,
    End = -2,
    Analyse = 1,
    Factorise = 2,
    Solve = 3,
}

/// What a solve does with the Schur complement, ICNTL(26).
#[derive(Clone, Copy)]
#[repr(i32)]
enum Half {
    Both = 0,
    Reduce = 1,
    Expand = 2,
}

/// A factor of the interior block A_II of a matrix whose other unknowns B are condensed.
pub struct SchurFactor(Interior);

enum Interior {
    Factor(RefCell<Instance>),
    /// Every unknown is one of B.
    Nothing(Nothing),
}

/// A matrix of which nothing is condensed.
struct Nothing {
    /// The owned entries of B, on the first rank.
    interface: Vec<usize>,
    kept: Option<Triples>,
}

/// An instance of MUMPS with the arrays it points to.
struct Instance {
    id: Box<mumps::DMUMPS_STRUC_C>,
    /// Right-hand side or solution of all unknowns, on the first rank.
    all: Vec<f64>,
    /// The same of B.
    reduced: Vec<f64>,
    /// Owned entries, without those of B, of the right-hand side whose reduction waits for its expansion.
    last: Option<Vec<f64>>,
    /// B's owned entries, on the first rank.
    interface: Vec<usize>,
    /// The matrix that was analysed, if it may be factorised again with other values.
    kept: Option<Triples>,
}

/// How often a matrix is factorised.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Times {
    /// The matrix is given up, and its zeros are no entries.
    Once,
    /// Its pattern, zeros included, is kept; a pivot that is not positive is an error.
    Often,
}

/// Upper triangle of this rank's rows, numbered from 1; equal positions are summed.
#[derive(Default)]
pub(super) struct Triples {
    pub rows: Vec<i32>,
    pub columns: Vec<i32>,
    pub values: Vec<f64>,
}

impl Triples {
    pub fn push(&mut self, row: i32, column: i32, value: f64) {
        self.rows.push(row);
        self.columns.push(column);
        self.values.push(value);
    }
}

impl SchurFactor {
    /// Factorises `a` by MUMPS (Cholesky) and returns S = A_BB - A_BI A_II^-1 A_IB, row i for the i-th of `interface`:
    /// n x n values on rank 0, row by row, of which the lower triangle counts; none elsewhere. `interface`: global
    /// indices, owned by rank 0 and given there; empty on the other ranks. A may be singular if A_II is not. PETSc's
    /// options for MUMPS with the `prefix` apply. Collective.
    pub fn new(
        group: &SimpleCommunicator,
        a: &Matrix,
        interface: &[i32],
        prefix: &str,
    ) -> Result<(SchurFactor, Vec<f64>)> {
        let (n, triples) = upper_triangle(a, Times::Once)?;
        SchurFactor::of_triples(group, n, triples, interface, prefix, Times::Once)
    }

    /// As [`SchurFactor::new`], but able to [refactorise](SchurFactor::refactorise): the pattern is kept, and an A_II that
    /// is not positive definite is [`Error::Indefinite`]. Collective.
    pub fn renewable(
        group: &SimpleCommunicator,
        a: &Matrix,
        interface: &[i32],
        prefix: &str,
    ) -> Result<(SchurFactor, Vec<f64>)> {
        let (n, triples) = upper_triangle(a, Times::Often)?;
        SchurFactor::of_triples(group, n, triples, interface, prefix, Times::Often)
    }

    /// Factorises a matrix of the same pattern without a new analysis and returns its S. After an error there is no factor
    /// until the next success. Collective.
    pub fn refactorise(&mut self, group: &SimpleCommunicator, a: &Matrix) -> Result<Vec<f64>> {
        let (_, new) = upper_triangle(a, Times::Often)?;
        let kept = self.kept_mut()?;
        let same = kept.rows == new.rows && kept.columns == new.columns;
        if parallel::max(group, &[f64::from(u8::from(!same))])[0] > 0.0 {
            return Err(Error::internal("the matrix to be factorised again has another pattern"));
        }
        kept.values = new.values;
        self.factorise_again(group)
    }

    /// The matrix of [`Times::Often`], to change its values.
    pub(super) fn kept_mut(&mut self) -> Result<&mut Triples> {
        let kept = match &mut self.0 {
            Interior::Factor(instance) => &mut instance.get_mut().kept,
            Interior::Nothing(nothing) => &mut nothing.kept,
        };
        kept.as_mut().ok_or_else(|| Error::internal("a factor whose matrix was not kept"))
    }

    /// The same factor, unable to factorise again.
    pub(super) fn without_matrix(mut self) -> SchurFactor {
        match &mut self.0 {
            Interior::Factor(instance) => instance.get_mut().kept = None,
            Interior::Nothing(nothing) => nothing.kept = None,
        }
        self
    }

    /// Factorises the kept matrix with its present values. Collective.
    pub(super) fn factorise_again(&mut self, group: &SimpleCommunicator) -> Result<Vec<f64>> {
        match &mut self.0 {
            Interior::Factor(instance) => instance.get_mut().factorise(group, Times::Often),
            Interior::Nothing(nothing) => {
                Ok(nothing.kept.as_ref().map_or(Vec::new(), |t| dense_lower(t, &nothing.interface)))
            }
        }
    }

    /// [`SchurFactor::new`] of an n x n matrix of triples. Collective.
    pub(super) fn of_triples(
        group: &SimpleCommunicator,
        n: usize,
        triples: Triples,
        interface: &[i32],
        prefix: &str,
        times: Times,
    ) -> Result<(SchurFactor, Vec<f64>)> {
        assert!(group.rank() == 0 || interface.is_empty());
        let size = parallel::sum(group, &[interface.len() as f64])[0] as usize;
        let owned: Vec<usize> = interface.iter().map(|&i| i as usize).collect();
        if size == n {
            let s = dense_lower(&triples, &owned);
            let kept = (times == Times::Often).then_some(triples);
            return Ok((SchurFactor(Interior::Nothing(Nothing { interface: owned, kept })), s));
        }
        let mut instance = Instance::start(group)?;
        (instance.id.n, instance.id.size_schur) = (int(n)?, int(size)?);
        set_options(&mut instance.id, prefix)?;
        // The matrix in triples: the first rank's, or each rank's own. The Schur complement, if there is one, and
        // right-hand sides are the first rank's.
        let id = &mut instance.id;
        id.icntl[17] = if group.size() == 1 { 0 } else { 3 };
        (id.icntl[4], id.icntl[18], id.icntl[19], id.icntl[20]) = (0, i32::from(size > 0), 0, 0);
        (instance.interface, instance.kept) = (owned, Some(triples));
        instance.analyse(group)?;
        let s = instance.factorise(group, times)?;
        if times == Times::Once {
            instance.kept = None;
        }
        if group.rank() == 0 {
            (instance.all, instance.reduced) = (vec![0.0; n], vec![0.0; size]);
        }
        Ok((SchurFactor(Interior::Factor(RefCell::new(instance))), s))
    }

    /// b_B - A_BI A_II^-1 b_I on rank 0, empty elsewhere; `b`: owned entries. Half a solve. Collective.
    pub fn reduce(&self, group: &SimpleCommunicator, b: &[f64]) -> Result<Vec<f64>> {
        match &self.0 {
            Interior::Factor(instance) => instance.borrow_mut().reduce(group, b),
            Interior::Nothing(nothing) => Ok(nothing.interface.iter().map(|&i| b[i]).collect()),
        }
    }

    /// Owned entries of x with x_I = A_II^-1 (b_I - A_IB x_B), x_B given on rank 0. Half a solve if b_I has just been
    /// reduced, a whole one otherwise. Collective.
    pub fn expand(&self, group: &SimpleCommunicator, b: &[f64], x_b: &[f64]) -> Result<Vec<f64>> {
        let mut instance = match &self.0 {
            Interior::Factor(instance) => instance.borrow_mut(),
            Interior::Nothing(nothing) => {
                let mut x = vec![0.0; b.len()];
                std::iter::zip(&nothing.interface, x_b).for_each(|(&i, x_b)| x[i] = *x_b);
                return Ok(x);
            }
        };
        let b = instance.inside(b);
        let is_new = instance.last.as_ref() != Some(&b);
        if parallel::max(group, &[f64::from(u8::from(is_new))])[0] > 0.0 {
            instance.reduce(group, &b)?;
        }
        instance.expand(group, b.len(), x_b)
    }
}

/// The matrix itself, row by row in the order of `interface`, lower triangle.
fn dense_lower(triples: &Triples, interface: &[usize]) -> Vec<f64> {
    let n = interface.len();
    let mut place = vec![0; n];
    interface.iter().enumerate().for_each(|(k, &i)| place[i] = k);
    let mut s = vec![0.0; n * n];
    if n > 0 {
        for ((row, column), value) in triples.rows.iter().zip(&triples.columns).zip(&triples.values) {
            let (i, j) = (place[*row as usize - 1], place[*column as usize - 1]);
            s[i.max(j) * n + i.min(j)] += value;
        }
    }
    s
}

impl Instance {
    fn start(group: &SimpleCommunicator) -> Result<Instance> {
        // SAFETY: the structure is plain data, and all zeros is what MUMPS expects before it starts.
        let mut id: Box<mumps::DMUMPS_STRUC_C> = unsafe { Box::new(std::mem::zeroed()) };
        // SAFETY: a valid communicator, which MUMPS duplicates.
        id.comm_fortran = unsafe { RSMPI_Comm_c2f(group.as_raw()) };
        // Symmetric positive definite; the first rank takes part in the work.
        (id.sym, id.par) = (1, 1);
        let mut instance = Instance {
            id,
            all: Vec::new(),
            reduced: Vec::new(),
            last: None,
            interface: Vec::new(),
            kept: None,
        };
        instance.call(Job::Start, "start")?;
        // Silent: errors are returned.
        instance.id.icntl[..4].copy_from_slice(&[-1, -1, -1, 0]);
        Ok(instance)
    }

    /// The symbolic factorisation of the kept matrix.
    fn analyse(&mut self, group: &SimpleCommunicator) -> Result<()> {
        let mut chosen: Vec<i32> = self.interface.iter().map(|&i| i as i32 + 1).collect();
        self.id.listvar_schur = chosen.as_mut_ptr();
        // Some versions look at the address of the Schur complement already here.
        let mut s = vec![0.0; chosen.len() * chosen.len()];
        self.id.schur = s.as_mut_ptr();
        self.show_matrix(group);
        let done = self.call(Job::Analyse, "analysis");
        self.hide_matrix();
        done?;
        parallel::demand(group, self.need(), "its factorisation")
    }

    /// Factorises the kept matrix, as it was analysed but for its values; returns its Schur complement.
    fn factorise(&mut self, group: &SimpleCommunicator, times: Times) -> Result<Vec<f64>> {
        self.last = None;
        let mut chosen: Vec<i32> = self.interface.iter().map(|&i| i as i32 + 1).collect();
        let mut s = vec![0.0; chosen.len() * chosen.len()];
        (self.id.listvar_schur, self.id.schur) = (chosen.as_mut_ptr(), s.as_mut_ptr());
        self.show_matrix(group);
        let mut tried = 0;
        let done = loop {
            match self.call(Job::Factorise, "factorisation") {
                Err(_) if tried < RETRIES && self.lacks_memory() => self.id.icntl[13] *= 2,
                other => break other,
            }
            tried += 1;
        };
        self.hide_matrix();
        let [error, .., negative] = self.id.infog[..12] else { return Err(Error::internal("INFOG")) };
        // Without pivoting MUMPS goes on after a negative pivot and counts it.
        match times {
            Times::Often if matches!(error, -10 | -40) => Err(Error::indefinite("a pivot is zero")),
            Times::Often if error >= 0 && negative > 0 => {
                Err(Error::indefinite(format!("{negative} pivots are negative")))
            }
            Times::Once | Times::Often => done.map(|()| s),
        }
    }

    /// Points MUMPS to the kept matrix, which stays where it is until it is hidden again.
    fn show_matrix(&mut self, group: &SimpleCommunicator) {
        let (id, Some(matrix)) = (&mut self.id, &mut self.kept) else { return };
        let count = matrix.values.len() as i64;
        let [rows, columns] = [matrix.rows.as_mut_ptr(), matrix.columns.as_mut_ptr()];
        if group.size() == 1 {
            (id.nnz, id.irn, id.jcn, id.a) = (count, rows, columns, matrix.values.as_mut_ptr());
        } else {
            (id.nnz_loc, id.irn_loc, id.jcn_loc, id.a_loc) =
                (count, rows, columns, matrix.values.as_mut_ptr());
        }
    }

    /// Forgets the addresses of the matrix and of the Schur complement.
    fn hide_matrix(&mut self) {
        let id = &mut self.id;
        (id.irn, id.jcn, id.a) = (ptr::null_mut(), ptr::null_mut(), ptr::null_mut());
        (id.irn_loc, id.jcn_loc, id.a_loc) = (ptr::null_mut(), ptr::null_mut(), ptr::null_mut());
        (id.listvar_schur, id.schur) = (ptr::null_mut(), ptr::null_mut());
    }

    fn call(&mut self, job: Job, phase: &str) -> Result<()> {
        self.id.job = job as i32;
        // SAFETY: the arrays that this job reads and writes are there and have the sizes that MUMPS was told.
        unsafe { mumps::dmumps_c(&mut *self.id) };
        let [error, more] = [self.id.infog[0], self.id.infog[1]];
        if error >= 0 {
            return Ok(());
        }
        let text = format!("MUMPS {phase}: INFOG(1) = {error}, INFOG(2) = {more}");
        if matches!(error, -7 | -13 | -19 | -22) {
            return Err(Error::Memory(format!(
                "there is not enough memory for its factorisation, which needs {:.0} MB on the rank that needs most ({text})",
                self.need() / 1e6
            )));
        }
        Err(Error::internal(text))
    }

    /// Memory of the factorisation on the rank that needs most, as the analysis foresees it, bytes: INFOG(16), in
    /// millions.
    fn need(&self) -> f64 {
        f64::from(self.id.infog[15]) * 1e6
    }

    /// True after a factorisation that a larger ICNTL(14) may help.
    fn lacks_memory(&self) -> bool {
        matches!(self.id.infog[0], -8 | -9 | -14 | -15 | -17 | -20)
    }

    fn has_interface(&self) -> bool {
        self.id.size_schur > 0
    }

    /// b with zeros on B.
    fn inside(&self, b: &[f64]) -> Vec<f64> {
        let mut inside = b.to_vec();
        self.interface.iter().for_each(|&i| inside[i] = 0.0);
        inside
    }

    fn reduce(&mut self, group: &SimpleCommunicator, b: &[f64]) -> Result<Vec<f64>> {
        if group.size() == 1 {
            self.all.copy_from_slice(b);
        } else {
            self.all = parallel::gather(group, b);
        }
        if !self.has_interface() {
            // Nothing to reduce to: MUMPS solves at the expansion.
            self.last = Some(b.to_vec());
            return Ok(Vec::new());
        }
        self.solve(Half::Reduce)?;
        self.last = Some(self.inside(b));
        Ok(self.reduced.clone())
    }

    fn expand(&mut self, group: &SimpleCommunicator, n_owned: usize, x_b: &[f64]) -> Result<Vec<f64>> {
        self.reduced.copy_from_slice(x_b);
        self.solve(if self.has_interface() { Half::Expand } else { Half::Both })?;
        // MUMPS has given up what the reduction left.
        self.last = None;
        let mut x = match group.size() {
            1 => self.all.clone(),
            _ => parallel::scatter(group, &self.all, n_owned),
        };
        std::iter::zip(&self.interface, x_b).for_each(|(&i, value)| x[i] = *value);
        Ok(x)
    }

    fn solve(&mut self, half: Half) -> Result<()> {
        let id = &mut self.id;
        id.icntl[25] = half as i32;
        (id.nrhs, id.lrhs, id.rhs) = (1, id.n, self.all.as_mut_ptr());
        (id.lredrhs, id.redrhs) = (id.size_schur, self.reduced.as_mut_ptr());
        self.call(Job::Solve, "solve")
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // An error leaves nothing to be done.
        let _ = self.call(Job::End, "end");
    }
}

/// Number of all rows, and this rank's entries on and above the diagonal; those factorised once are without zeros.
fn upper_triangle(a: &Matrix, times: Times) -> Result<(usize, Triples)> {
    let mut triples = Triples::default();
    let (mut n, mut first, mut end) = (0, 0, 0);
    // SAFETY: a valid matrix; every row is given back before the next is asked for.
    unsafe {
        check(sys::MatGetSize(a.0, &mut n, ptr::null_mut()))?;
        check(sys::MatGetOwnershipRange(a.0, &mut first, &mut end))?;
        for row in first..end {
            let (mut count, mut columns, mut values) = (0, ptr::null(), ptr::null());
            check(sys::MatGetRow(a.0, row, &mut count, &mut columns, &mut values))?;
            if count > 0 {
                let of_row = std::slice::from_raw_parts(columns, count as usize);
                let of_row = of_row.iter().zip(std::slice::from_raw_parts(values, count as usize));
                let counts = |value: f64| times == Times::Often || value != 0.0;
                for (&column, &value) in of_row.filter(|(column, value)| **column >= row && counts(**value)) {
                    triples.push(row + 1, column + 1, value);
                }
            }
            check(sys::MatRestoreRow(a.0, row, &mut count, &mut columns, &mut values))?;
        }
    }
    Ok((n as usize, triples))
}

/// Takes `-<prefix>mat_mumps_icntl_<i>` and `-<prefix>mat_mumps_cntl_<i>` from the options, as PETSc's interface does.
fn set_options(id: &mut mumps::DMUMPS_STRUC_C, prefix: &str) -> Result<()> {
    let prefix = CString::new(prefix).map_err(Error::internal)?;
    let none = ptr::null_mut();
    let mut found = sys::PetscBool::PETSC_FALSE;
    let mut printed = false;
    // SAFETY: a null options object means the global database; strings live through the calls.
    unsafe {
        for (i, control) in id.icntl.iter_mut().enumerate() {
            let name = CString::new(format!("-mat_mumps_icntl_{}", i + 1)).map_err(Error::internal)?;
            let mut value = *control;
            check(sys::PetscOptionsGetInt(none, prefix.as_ptr(), name.as_ptr(), &mut value, &mut found))?;
            *control = value;
            printed |= i == 3 && value > 0;
        }
        for (i, control) in id.cntl.iter_mut().enumerate() {
            let name = CString::new(format!("-mat_mumps_cntl_{}", i + 1)).map_err(Error::internal)?;
            check(sys::PetscOptionsGetReal(none, prefix.as_ptr(), name.as_ptr(), control, &mut found))?;
        }
    }
    if printed {
        // Unit 6 is the standard output.
        id.icntl[..3].copy_from_slice(&[6, 0, 6]);
    }
    Ok(())
}
