//! Distributed vectors, matrices and solvers.
use super::{
    error::check,
    handle::{int, make},
    sys,
};
use crate::error::Result;
use mpi::traits::{AsRaw, Communicator};
use std::ptr;

/// A block size that PETSc, hypre and GAMG use to see the displacement components of a node.
pub type Coordinates<'a> = &'a [[f64; 3]];

handle!(
    /// A distributed vector; each rank owns a contiguous range of entries.
    Vector, Vec, VecDestroy
);
handle!(
    /// A distributed sparse matrix (AIJ).
    Matrix, Mat, MatDestroy
);
handle!(Index, IS, ISDestroy);
handle!(Scatter, VecScatter, VecScatterDestroy);
handle!(NullSpace, MatNullSpace, MatNullSpaceDestroy);
handle!(Container, PetscContainer, PetscContainerDestroy);

/// The arrays of a matrix that PETSc has not allocated itself.
struct Rows {
    starts: Vec<i32>,
    columns: Vec<i32>,
    values: Vec<f64>,
}

/// # Safety
/// `rows` must come from a box of [`Rows`].
unsafe extern "C" fn free_rows(rows: *mut std::ffi::c_void) -> sys::PetscErrorCode {
    // SAFETY: promised.
    drop(unsafe { Box::from_raw(rows.cast::<Rows>()) });
    0
}

impl Vector {
    /// Zero vector with `n_owned` entries on this rank.
    pub fn zeros<C: Communicator + AsRaw<Raw = mpi::ffi::MPI_Comm>>(
        comm: &C,
        n_owned: usize,
    ) -> Result<Self> {
        let n = int(n_owned)?;
        // SAFETY: a valid communicator and sizes.
        let v = Vector(make(|v| unsafe { sys::VecCreateMPI(comm.as_raw(), n, sys::PETSC_DETERMINE, v) })?);
        v.set(&vec![0.0; n_owned])?;
        Ok(v)
    }

    /// Number of entries on this rank. Not collective.
    pub fn n_owned(&self) -> usize {
        let mut n = 0;
        // SAFETY: valid handle.
        unsafe { sys::VecGetLocalSize(self.0, &mut n) };
        n as usize
    }

    /// Copy of this rank's entries. Not collective.
    pub fn to_vec(&self) -> Result<Vec<f64>> {
        let mut p = ptr::null();
        // SAFETY: the array has `n_owned` entries and is given back before the handle changes.
        unsafe {
            check(sys::VecGetArrayRead(self.0, &mut p))?;
            let values = std::slice::from_raw_parts(p, self.n_owned()).to_vec();
            check(sys::VecRestoreArrayRead(self.0, &mut p))?;
            Ok(values)
        }
    }

    /// Sets this rank's entries. Not collective.
    pub fn set(&self, values: &[f64]) -> Result<()> {
        assert_eq!(values.len(), self.n_owned());
        let mut p = ptr::null_mut();
        // SAFETY: as above.
        unsafe {
            check(sys::VecGetArray(self.0, &mut p))?;
            std::slice::from_raw_parts_mut(p, values.len()).copy_from_slice(values);
            check(sys::VecRestoreArray(self.0, &mut p))
        }
    }

    /// Adds `values` at global `indices`, which may belong to other ranks; then assembles.
    pub fn add(&self, indices: &[i32], values: &[f64]) -> Result<()> {
        assert_eq!(indices.len(), values.len());
        // SAFETY: both slices have the stated length.
        unsafe {
            check(sys::VecSetValues(
                self.0,
                int(indices.len())?,
                indices.as_ptr(),
                values.as_ptr(),
                sys::InsertMode::ADD_VALUES,
            ))?;
            check(sys::VecAssemblyBegin(self.0))?;
            check(sys::VecAssemblyEnd(self.0))
        }
    }

    /// A vector of the same layout.
    pub(super) fn duplicate(&self) -> Result<Self> {
        // SAFETY: valid handle.
        Ok(Vector(make(|v| unsafe { sys::VecDuplicate(self.0, v) })?))
    }

    pub(super) fn copy_from(&self, other: &Vector) -> Result<()> {
        // SAFETY: valid handles of one layout.
        check(unsafe { sys::VecCopy(other.0, self.0) })
    }

    /// Adds a vector of the same layout.
    pub(super) fn add_vector(&self, other: &Vector) -> Result<()> {
        // SAFETY: valid handles of one layout.
        check(unsafe { sys::VecAXPY(self.0, 1.0, other.0) })
    }

    /// Euclidean norm over all ranks.
    pub fn norm(&self) -> Result<f64> {
        let mut value = 0.0;
        // SAFETY: valid handle.
        check(unsafe { sys::VecNorm(self.0, sys::NormType::NORM_2, &mut value) })?;
        Ok(value)
    }
}

impl Matrix {
    /// Symmetric positive definite matrix from (row, column, value) triples; equal positions are summed, entries of
    /// other ranks' rows are sent there, a negative row or column is dropped.
    ///
    /// `n_owned` rows live on this rank; `block` is the number of displacement components of a node.
    pub fn from_triples<C: Communicator + AsRaw<Raw = mpi::ffi::MPI_Comm>>(
        comm: &C,
        n_owned: usize,
        block: usize,
        (mut rows, mut columns): (Vec<i32>, Vec<i32>),
        values: Vec<f64>,
    ) -> Result<Self> {
        assert!(rows.len() == values.len() && columns.len() == values.len());
        let n = int(n_owned)?;
        // SAFETY: the handle is valid from `make` on; the three arrays have the same length.
        unsafe {
            let a = Matrix(make(|a| sys::MatCreate(comm.as_raw(), a))?);
            check(sys::MatSetSizes(a.0, n, n, sys::PETSC_DETERMINE, sys::PETSC_DETERMINE))?;
            check(sys::MatSetType(a.0, sys::MATAIJ.as_ptr()))?;
            check(sys::MatSetBlockSize(a.0, int(block)?))?;
            check(sys::MatSetPreallocationCOO(
                a.0,
                values.len() as sys::PetscCount,
                rows.as_mut_ptr(),
                columns.as_mut_ptr(),
            ))?;
            drop((rows, columns));
            check(sys::MatSetValuesCOO(a.0, values.as_ptr(), sys::InsertMode::INSERT_VALUES))?;
            check(sys::MatSetOption(a.0, sys::MatOption::MAT_SPD, sys::PetscBool::PETSC_TRUE))?;
            Ok(a)
        }
    }

    /// Symmetric positive definite matrix on one rank of compressed rows, not copied: where each begins, the columns,
    /// ascending in each row, and the values.
    pub fn from_rows<C: Communicator + AsRaw<Raw = mpi::ffi::MPI_Comm>>(
        comm: &C,
        block: usize,
        starts: Vec<i32>,
        columns: Vec<i32>,
        values: Vec<f64>,
    ) -> Result<Self> {
        assert_eq!(comm.size(), 1);
        assert!(columns.len() == values.len() && starts.last() == Some(&int(values.len())?));
        let n = int(starts.len() - 1)?;
        let mut rows = Box::new(Rows { starts, columns, values });
        let (i, j, a) = (rows.starts.as_mut_ptr(), rows.columns.as_mut_ptr(), rows.values.as_mut_ptr());
        // SAFETY: handles are valid from `make` on; the arrays fit each other, and live until PETSc frees the container,
        // which is when it frees the matrix.
        unsafe {
            let matrix = Matrix(make(|m| sys::MatCreateSeqAIJWithArrays(comm.as_raw(), n, n, i, j, a, m))?);
            let owner = Container(make(|c| sys::PetscContainerCreate(comm.as_raw(), c))?);
            check(sys::PetscContainerSetPointer(owner.0, Box::into_raw(rows).cast()))?;
            check(sys::PetscContainerSetUserDestroy(owner.0, Some(free_rows)))?;
            check(sys::PetscObjectCompose(matrix.0.cast(), c"rows".as_ptr(), owner.0.cast()))?;
            check(sys::MatSetBlockSize(matrix.0, int(block)?))?;
            check(sys::MatSetOption(matrix.0, sys::MatOption::MAT_SPD, sys::PetscBool::PETSC_TRUE))?;
            Ok(matrix)
        }
    }

    /// Rigid modes as near null space, for algebraic multigrid; `points` are the owned nodes.
    pub fn set_rigid_modes<C: Communicator + AsRaw<Raw = mpi::ffi::MPI_Comm>>(
        &self,
        comm: &C,
        points: Coordinates,
        dim: usize,
    ) -> Result<()> {
        let x = Vector::zeros(comm, points.len() * dim)?;
        x.set(&points.iter().flat_map(|p| p[..dim].to_vec()).collect::<Vec<_>>())?;
        // SAFETY: valid handles; the matrix keeps its own reference to the null space.
        unsafe {
            check(sys::VecSetBlockSize(x.0, int(dim)?))?;
            let modes = NullSpace(make(|m| sys::MatNullSpaceCreateRigidBody(x.0, m))?);
            check(sys::MatSetNearNullSpace(self.0, modes.0))
        }
    }

    /// Number of rows on all ranks. Not collective.
    pub fn n_rows(&self) -> usize {
        let mut n = 0;
        // SAFETY: valid handle.
        unsafe { sys::MatGetSize(self.0, &mut n, ptr::null_mut()) };
        n as usize
    }

    /// Largest diagonal entry over all ranks.
    pub fn largest_diagonal(&self) -> Result<f64> {
        let mut largest = 0.0;
        // SAFETY: valid handles; the vector has the matrix's layout.
        unsafe {
            let d = Vector(make(|v| sys::MatCreateVecs(self.0, v, ptr::null_mut()))?);
            check(sys::MatGetDiagonal(self.0, d.0))?;
            check(sys::VecNorm(d.0, sys::NormType::NORM_INFINITY, &mut largest))?;
        }
        Ok(largest)
    }

    /// y = A x.
    pub fn times(&self, x: &Vector, y: &Vector) -> Result<()> {
        // SAFETY: valid handles of matching layout.
        check(unsafe { sys::MatMult(self.0, x.0, y.0) })
    }
}

/// Brings chosen entries of a distributed vector to this rank.
pub struct Gather {
    scatter: Scatter,
    local: Vector,
}

impl Gather {
    /// Entries at the global `indices` of vectors laid out like `model`.
    pub fn new(model: &Vector, indices: &[i32]) -> Result<Self> {
        let n = int(indices.len())?;
        // SAFETY: valid handles; PETSc copies the indices.
        unsafe {
            let own = sys::RSMPI_COMM_SELF;
            let local = Vector(make(|v| sys::VecCreateSeq(own, n, v))?);
            let from = Index(make(|s| {
                sys::ISCreateGeneral(own, n, indices.as_ptr(), sys::PetscCopyMode::PETSC_COPY_VALUES, s)
            })?);
            let scatter =
                Scatter(make(|s| sys::VecScatterCreate(model.0, from.0, local.0, ptr::null_mut(), s))?);
            Ok(Gather { scatter, local })
        }
    }

    /// The entries of `x`, in the order of the indices.
    pub fn get(&self, x: &Vector) -> Result<Vec<f64>> {
        let (mode, insert) = (sys::ScatterMode::SCATTER_FORWARD, sys::InsertMode::INSERT_VALUES);
        // SAFETY: valid handles of the layout given to `new`.
        unsafe {
            check(sys::VecScatterBegin(self.scatter.0, x.0, self.local.0, insert, mode))?;
            check(sys::VecScatterEnd(self.scatter.0, x.0, self.local.0, insert, mode))?;
        }
        self.local.to_vec()
    }
}
