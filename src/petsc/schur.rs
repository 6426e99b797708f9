//! One factorisation that also returns the Schur complement on chosen unknowns.
use super::{
    Matrix, Vector,
    error::check,
    handle::{int, make},
    sys,
};
use crate::error::{Error, Result};
use mpi::traits::{AsRaw, Communicator};
use std::{ffi::CString, mem::MaybeUninit, ptr, slice};

handle!(Factor, Mat, MatDestroy);
handle!(Index, IS, ISDestroy);
handle!(Complement, Mat, MatDestroy);

/// Control of MUMPS: what a solve does with the unknowns of the Schur complement.
const ICNTL_SCHUR_SOLVE: i32 = 26;

/// A factor of the interior block A_II of a matrix whose other unknowns B are condensed.
pub struct SchurFactor(Factor);

impl SchurFactor {
    /// Factorises `a` by MUMPS (Cholesky) and returns S = A_BB - A_BI A_II^-1 A_IB, row i for the i-th of `interface`:
    /// n x n values on rank 0, none elsewhere. `interface`: global indices, owned by rank 0 and given there; empty on
    /// the other ranks. A may be singular if A_II is not. PETSc options with the `prefix` apply. Collective.
    pub fn new<C: Communicator + AsRaw<Raw = mpi::ffi::MPI_Comm>>(
        comm: &C,
        a: &Matrix,
        interface: &[i32],
        prefix: &str,
    ) -> Result<(SchurFactor, Vec<f64>)> {
        assert!(comm.rank() == 0 || interface.is_empty());
        let prefix = CString::new(prefix).map_err(Error::internal)?;
        let n = int(interface.len())?;
        // SAFETY: valid handles from `make` on; PETSc copies indices and strings.
        unsafe {
            if comm.size() > 1 {
                // PETSc 3.18 returns garbage off the diagonal of a parallel Schur complement of a matrix that is
                // known to be positive definite: it transposes S in place, which does nothing to a symmetric one.
                check(sys::MatSetOption(a.0, sys::MatOption::MAT_SPD, sys::PetscBool::PETSC_FALSE))?;
            }
            let copy = sys::PetscCopyMode::PETSC_COPY_VALUES;
            let is = Index(make(|s| sys::ISCreateGeneral(comm.as_raw(), n, interface.as_ptr(), copy, s))?);
            let cholesky = sys::MatFactorType::MAT_FACTOR_CHOLESKY;
            let factor = Factor(make(|f| sys::MatGetFactor(a.0, sys::MATSOLVERMUMPS.as_ptr(), cholesky, f))?);
            check(sys::MatSetOptionsPrefix(factor.0, prefix.as_ptr()))?;
            check(sys::MatFactorSetSchurIS(factor.0, is.0))?;
            let mut info = MaybeUninit::uninit();
            check(sys::MatFactorInfoInitialize(info.as_mut_ptr()))?;
            let info = info.assume_init();
            check(sys::MatCholeskyFactorSymbolic(factor.0, a.0, ptr::null_mut(), &info))?;
            check_factor(&factor, "analysis")?;
            check(sys::MatCholeskyFactorNumeric(factor.0, a.0, &info))?;
            check_factor(&factor, "factorisation")?;
            let mut status = 0;
            let s = Complement(make(|s| sys::MatFactorCreateSchurComplement(factor.0, s, &mut status))?);
            let mut values = Vec::new();
            if comm.rank() == 0 {
                let mut p = ptr::null();
                check(sys::MatDenseGetArrayRead(s.0, &mut p))?;
                values = slice::from_raw_parts(p, interface.len() * interface.len()).to_vec();
                check(sys::MatDenseRestoreArrayRead(s.0, &mut p))?;
            }
            // From here on a solve leaves B alone.
            check(sys::MatMumpsSetIcntl(factor.0, ICNTL_SCHUR_SOLVE, 0))?;
            Ok((SchurFactor(factor), values))
        }
    }

    /// x_I = A_II^-1 b_I and x_B = 0. Collective.
    pub fn solve_interior(&self, b: &Vector, x: &Vector) -> Result<()> {
        // SAFETY: valid handles of matching layout.
        check(unsafe { sys::MatSolve(self.0.0, b.0, x.0) })
    }
}

/// MUMPS reports failure in the factor, not in a return code.
fn check_factor(factor: &Factor, phase: &str) -> Result<()> {
    let (mut error, mut info, mut more) = (0, 0, 0);
    // SAFETY: a valid factor by MUMPS; INFOG(1) and INFOG(2) are read.
    unsafe {
        check(sys::MatFactorGetError(factor.0, &mut error))?;
        check(sys::MatMumpsGetInfog(factor.0, 1, &mut info))?;
        check(sys::MatMumpsGetInfog(factor.0, 2, &mut more))?;
    }
    if error == 0 && info >= 0 {
        return Ok(());
    }
    Err(Error::internal(format!("MUMPS {phase}: INFOG(1) = {info}, INFOG(2) = {more}")))
}
