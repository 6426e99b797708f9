//! Dense matrices by LAPACK: what a condensed body computes with. Nothing here is collective.
use crate::error::{Error, Result};
use crate::vector::{larger, smaller};
use std::ffi::{c_char, c_int};
use std::sync::{Mutex, MutexGuard, PoisonError};

// Fortran passes everything by address; the lengths of the character arguments, all 1, may be left out.
unsafe extern "C" {
    fn dpotrf_(uplo: *const c_char, n: *const c_int, a: *mut f64, lda: *const c_int, info: *mut c_int);
    fn dpotrs_(
        uplo: *const c_char,
        n: *const c_int,
        nrhs: *const c_int,
        a: *const f64,
        lda: *const c_int,
        b: *mut f64,
        ldb: *const c_int,
        info: *mut c_int,
    );
    fn dgetrf_(
        m: *const c_int,
        n: *const c_int,
        a: *mut f64,
        lda: *const c_int,
        ipiv: *mut c_int,
        info: *mut c_int,
    );
    fn dgetrs_(
        trans: *const c_char,
        n: *const c_int,
        nrhs: *const c_int,
        a: *const f64,
        lda: *const c_int,
        ipiv: *const c_int,
        b: *mut f64,
        ldb: *const c_int,
        info: *mut c_int,
    );
    fn dtrsm_(
        side: *const c_char,
        uplo: *const c_char,
        trans: *const c_char,
        diag: *const c_char,
        m: *const c_int,
        n: *const c_int,
        alpha: *const f64,
        a: *const f64,
        lda: *const c_int,
        b: *mut f64,
        ldb: *const c_int,
    );
    fn dsyrk_(
        uplo: *const c_char,
        trans: *const c_char,
        n: *const c_int,
        k: *const c_int,
        alpha: *const f64,
        a: *const f64,
        lda: *const c_int,
        beta: *const f64,
        c: *mut f64,
        ldc: *const c_int,
    );
    fn dsyevr_(
        jobz: *const c_char,
        range: *const c_char,
        uplo: *const c_char,
        n: *const c_int,
        a: *mut f64,
        lda: *const c_int,
        vl: *const f64,
        vu: *const f64,
        il: *const c_int,
        iu: *const c_int,
        abstol: *const f64,
        m: *mut c_int,
        w: *mut f64,
        z: *mut f64,
        ldz: *const c_int,
        isuppz: *mut c_int,
        work: *mut f64,
        lwork: *const c_int,
        iwork: *mut c_int,
        liwork: *const c_int,
        info: *mut c_int,
    );
    fn dsymv_(
        uplo: *const c_char,
        n: *const c_int,
        alpha: *const f64,
        a: *const f64,
        lda: *const c_int,
        x: *const f64,
        incx: *const c_int,
        beta: *const f64,
        y: *mut f64,
        incy: *const c_int,
    );
}

const LOWER: c_char = b'L' as c_char;
const LEFT: c_char = b'L' as c_char;
const PLAIN: c_char = b'N' as c_char;
const VECTORS: c_char = b'V' as c_char;
const INTERVAL: c_char = b'V' as c_char;
const TRANSPOSED: c_char = b'T' as c_char;

/// Pivots below this share of the largest are round-off: the matrix has dependent rows.
const DEPENDENT: f64 = 1e-13;

/// One caller at a time: not every build of OpenBLAS keeps threads apart that call it together, as those of tests do. A rank has
/// one thread, and does not notice.
fn alone() -> MutexGuard<'static, ()> {
    static CALLED: Mutex<()> = Mutex::new(());
    CALLED.lock().unwrap_or_else(PoisonError::into_inner)
}

fn int(n: usize) -> Result<c_int> {
    c_int::try_from(n).map_err(|_| Error::internal(format!("{n} does not fit LAPACK's 32-bit integers")))
}

/// A symmetric matrix, both triangles stored.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Symmetric {
    n: usize,
    a: Vec<f64>,
}

/// A = L L'.
#[derive(Debug, Clone)]
pub struct Cholesky {
    n: usize,
    l: Vec<f64>,
}

/// P A = L U.
#[derive(Debug, Clone)]
pub struct Lu {
    n: usize,
    lu: Vec<f64>,
    pivots: Vec<c_int>,
}

impl Lu {
    /// Factorises the `n` x `n` values, column by column; `None` if a pivot vanishes.
    pub fn new(n: usize, mut lu: Vec<f64>) -> Result<Option<Lu>> {
        assert_eq!(lu.len(), n * n);
        let (order, mut pivots, mut info) = (int(n)?, vec![0; n], 0);
        let _alone = alone();
        // SAFETY: lu is n x n, pivots has n entries.
        unsafe {
            dgetrf_(&order, &order, lu.as_mut_ptr(), &order.max(1), pivots.as_mut_ptr(), &mut info);
        }
        if info < 0 {
            return Err(Error::internal(format!("LAPACK dgetrf: argument {} is wrong", -info)));
        }
        Ok((info == 0).then_some(Lu { n, lu, pivots }))
    }

    /// Solves A X = B in place; B's columns lie one after the other.
    pub fn solve(&self, b: &mut [f64]) -> Result<()> {
        if self.n == 0 || b.is_empty() {
            return Ok(());
        }
        assert_eq!(b.len() % self.n, 0);
        let (n, columns, mut info) = (int(self.n)?, int(b.len() / self.n)?, 0);
        let _alone = alone();
        // SAFETY: lu is n x n and its pivots are n, b is n x columns.
        unsafe {
            dgetrs_(
                &PLAIN,
                &n,
                &columns,
                self.lu.as_ptr(),
                &n,
                self.pivots.as_ptr(),
                b.as_mut_ptr(),
                &n,
                &mut info,
            );
        }
        if info != 0 {
            return Err(Error::internal(format!("LAPACK dgetrs: argument {} is wrong", -info)));
        }
        Ok(())
    }
}

impl Symmetric {
    /// From the lower triangle of `n` x `n` values, row by row; the others do not count.
    pub fn from_lower_rows(n: usize, mut a: Vec<f64>) -> Self {
        assert_eq!(a.len(), n * n);
        // Blocks, so that one of the two triangles is not read with a stride of n.
        const BLOCK: usize = 32;
        for i0 in (0..n).step_by(BLOCK) {
            for j0 in (0..=i0).step_by(BLOCK) {
                for i in i0..(i0 + BLOCK).min(n) {
                    for j in j0..(j0 + BLOCK).min(i) {
                        a[j * n + i] = a[i * n + j];
                    }
                }
            }
        }
        Symmetric { n, a }
    }

    /// Y'Y of the `n` columns of length `k` in `y`.
    pub fn gram(y: &[f64], k: usize, n: usize) -> Result<Self> {
        assert_eq!(y.len(), k * n);
        let mut a = vec![0.0; n * n];
        let (rows, columns) = (int(k)?, int(n)?);
        let _alone = alone();
        // SAFETY: y is k x n, a is n x n, both column-major and dense.
        unsafe {
            dsyrk_(
                &LOWER,
                &TRANSPOSED,
                &columns,
                &rows,
                &1.0,
                y.as_ptr(),
                &rows.max(1),
                &0.0,
                a.as_mut_ptr(),
                &columns.max(1),
            );
        }
        for j in 0..n {
            for i in j + 1..n {
                a[i * n + j] = a[j * n + i];
            }
        }
        Ok(Symmetric { n, a })
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Entry.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.a[j * self.n + i]
    }

    /// A column.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.a[j * self.n..][..self.n]
    }

    /// Rows and columns `chosen`, in that order.
    pub fn principal(&self, chosen: &[usize]) -> Symmetric {
        let columns = chosen.iter().flat_map(|&j| {
            let column = &self.a[j * self.n..][..self.n];
            chosen.iter().map(move |&i| column[i])
        });
        Symmetric { n: chosen.len(), a: columns.collect() }
    }

    /// Mean of the diagonal; 0 of an empty matrix.
    pub fn mean_diagonal(&self) -> f64 {
        (0..self.n).map(|i| self.at(i, i)).sum::<f64>() / self.n.max(1) as f64
    }

    /// A x.
    pub fn times(&self, x: &[f64]) -> Result<Vec<f64>> {
        assert_eq!(x.len(), self.n);
        let mut y = vec![0.0; self.n];
        let n = int(self.n)?;
        let _alone = alone();
        // SAFETY: a is n x n, x and y have n entries.
        unsafe {
            dsymv_(&LOWER, &n, &1.0, self.a.as_ptr(), &n.max(1), x.as_ptr(), &1, &0.0, y.as_mut_ptr(), &1);
        }
        Ok(y)
    }

    /// A + diag(d).
    pub fn add_diagonal(mut self, d: &[f64]) -> Symmetric {
        self.a.iter_mut().step_by(self.n + 1).zip(d).for_each(|(a, d)| *a += d);
        self
    }

    /// A + factor G G', the columns of G given one by one.
    pub fn add_outer(mut self, factor: f64, columns: &[Vec<f64>]) -> Result<Symmetric> {
        let g = columns.concat();
        let (n, m) = (int(self.n)?, int(columns.len())?);
        assert_eq!(g.len(), self.n * columns.len());
        let _alone = alone();
        // SAFETY: a is n x n, g is n x m, both column-major and dense.
        unsafe {
            dsyrk_(
                &LOWER,
                &PLAIN,
                &n,
                &m,
                &factor,
                g.as_ptr(),
                &n.max(1),
                &1.0,
                self.a.as_mut_ptr(),
                &n.max(1),
            );
        }
        for j in 0..self.n {
            for i in j + 1..self.n {
                self.a[i * self.n + j] = self.a[j * self.n + i];
            }
        }
        Ok(self)
    }

    /// Orthonormal eigenvectors of the eigenvalues up to `limit`, smallest first.
    pub fn eigenvectors_below(&self, limit: f64) -> Result<Vec<Vec<f64>>> {
        let n = self.n;
        if n == 0 {
            return Ok(Vec::new());
        }
        let (order, mut found, mut info) = (int(n)?, 0, 0);
        let (mut a, mut values, mut vectors) = (self.a.clone(), vec![0.0; n], vec![0.0; n * n]);
        let (mut support, none) = (vec![0; 2 * n], 0);
        // As much as LAPACK asks for at least, and more for its blocks.
        let (work_size, integer_size) = (int(26 * n + 64 * n)?, int(10 * n)?);
        let (mut work, mut integers) = (vec![0.0; work_size as usize], vec![0; integer_size as usize]);
        let _alone = alone();
        // SAFETY: all arrays have the sizes that LAPACK documents for order n.
        unsafe {
            dsyevr_(
                &VECTORS,
                &INTERVAL,
                &LOWER,
                &order,
                a.as_mut_ptr(),
                &order,
                &-f64::MAX,
                &limit,
                &none,
                &none,
                &0.0,
                &mut found,
                values.as_mut_ptr(),
                vectors.as_mut_ptr(),
                &order,
                support.as_mut_ptr(),
                work.as_mut_ptr(),
                &work_size,
                integers.as_mut_ptr(),
                &integer_size,
                &mut info,
            );
        }
        if info != 0 {
            return Err(Error::internal(format!("LAPACK dsyevr: info = {info}")));
        }
        Ok(vectors.chunks_exact(n).take(found as usize).map(<[f64]>::to_vec).collect())
    }

    /// The factor L; `None` if the matrix is not positive definite to round-off.
    pub fn cholesky(&self) -> Result<Option<Cholesky>> {
        self.clone().into_cholesky(0.0)
    }

    /// The factor of A + shift I, in A's memory.
    pub fn into_cholesky(self, shift: f64) -> Result<Option<Cholesky>> {
        let Symmetric { n, a: mut l } = self;
        l.iter_mut().step_by(n + 1).for_each(|d| *d += shift);
        let (order, mut info) = (int(n)?, 0);
        let _alone = alone();
        // SAFETY: l is n x n.
        unsafe { dpotrf_(&LOWER, &order, l.as_mut_ptr(), &order.max(1), &mut info) };
        if info < 0 {
            return Err(Error::internal(format!("LAPACK dpotrf: argument {} is wrong", -info)));
        }
        Ok((info == 0).then_some(Cholesky { n, l }))
    }

    /// The factor of A, or of A plus the smallest of growing shifts of the diagonal that makes it regular, from `least`
    /// of its mean on: for an operator whose rows may depend on each other.
    pub fn regular_cholesky(&self, least: f64) -> Result<Cholesky> {
        let mean = self.mean_diagonal();
        let growing = (-12..=0).map(|k| 10_f64.powi(k)).filter(|shift| *shift > least);
        for shift in std::iter::once(least).chain(growing) {
            if let Some(factor) = self.clone().into_cholesky(shift * mean)?
                && (shift > 0.0 || factor.is_regular())
            {
                return Ok(factor);
            }
        }
        Err(Error::internal("an interface operator has no positive diagonal"))
    }
}

impl Cholesky {
    /// Number of rows.
    pub fn n(&self) -> usize {
        self.n
    }

    fn is_regular(&self) -> bool {
        let pivots = || self.l.iter().step_by(self.n + 1).map(|l| l * l);
        let (low, high) = (pivots().fold(f64::INFINITY, smaller), pivots().fold(0.0, larger));
        self.n == 0 || low > DEPENDENT * high
    }

    /// Solves A X = B in place; B's columns lie one after the other.
    pub fn solve(&self, b: &mut [f64]) -> Result<()> {
        if self.n == 0 || b.is_empty() {
            return Ok(());
        }
        assert_eq!(b.len() % self.n, 0);
        let (n, columns, mut info) = (int(self.n)?, int(b.len() / self.n)?, 0);
        let _alone = alone();
        // SAFETY: l is n x n, b is n x columns.
        unsafe { dpotrs_(&LOWER, &n, &columns, self.l.as_ptr(), &n, b.as_mut_ptr(), &n, &mut info) };
        if info != 0 {
            return Err(Error::internal(format!("LAPACK dpotrs: argument {} is wrong", -info)));
        }
        Ok(())
    }

    /// B <- L^-1 B in place: with it B'A^-1 B is a Gram matrix.
    pub fn half_solve(&self, b: &mut [f64]) -> Result<()> {
        if self.n == 0 || b.is_empty() {
            return Ok(());
        }
        assert_eq!(b.len() % self.n, 0);
        let (n, columns) = (int(self.n)?, int(b.len() / self.n)?);
        let _alone = alone();
        // SAFETY: as above.
        unsafe {
            dtrsm_(
                &LEFT,
                &LOWER,
                &PLAIN,
                &PLAIN,
                &n,
                &columns,
                &1.0,
                self.l.as_ptr(),
                &n,
                b.as_mut_ptr(),
                &n,
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric positive definite matrix and vectors with no special structure.
    fn example(n: usize) -> (Symmetric, Vec<f64>) {
        let y: Vec<f64> = (0..n * n).map(|i| ((i * i) as f64 * 0.37).sin()).collect();
        let mut a = Symmetric::gram(&y, n, n).unwrap();
        (0..n).for_each(|i| a.a[i * n + i] += 1.0);
        (a, (0..n).map(|i| (i as f64).cos()).collect())
    }

    #[test]
    fn solve_inverts_times() {
        for n in [1, 2, 33, 80] {
            let (a, x) = example(n);
            let mut b = [a.times(&x).unwrap(), vec![0.0; n]].concat();
            let factor = a.cholesky().unwrap().unwrap();
            factor.solve(&mut b).unwrap();
            std::iter::zip(&b, &x).for_each(|(b, x)| assert!((b - x).abs() < 1e-11, "{n}"));
            assert_eq!(&b[n..], vec![0.0; n]);
            // x'A^-1 x by half a solve and by a whole one.
            let (mut half, mut whole) = (x.clone(), x.clone());
            factor.half_solve(&mut half).unwrap();
            factor.solve(&mut whole).unwrap();
            let dot: f64 = std::iter::zip(&x, &whole).map(|(x, y)| x * y).sum();
            assert!((Symmetric::gram(&half, n, 1).unwrap().at(0, 0) - dot).abs() < 1e-12 * dot);
        }
    }

    #[test]
    fn unsymmetric_systems_are_solved() {
        for n in [1, 2, 33, 80] {
            let (a, x) = example(n);
            // A + upper triangle of ones.
            let at = |i: usize, j: usize| a.at(i, j) + if j > i { 1.0 } else { 0.0 };
            let values = (0..n * n).map(|k| at(k % n, k / n)).collect();
            let mut b: Vec<f64> = (0..n).map(|i| (0..n).map(|j| at(i, j) * x[j]).sum()).collect();
            Lu::new(n, values).unwrap().unwrap().solve(&mut b).unwrap();
            std::iter::zip(&b, &x).for_each(|(b, x)| assert!((b - x).abs() < 1e-11, "{n}"));
        }
        assert!(Lu::new(2, vec![1.0, 2.0, 2.0, 4.0]).unwrap().is_none());
    }

    #[test]
    fn products_are_by_rows_and_columns() {
        let (a, x) = example(5);
        let y = a.times(&x).unwrap();
        for (i, y) in y.iter().enumerate() {
            let sum: f64 = (0..5).map(|j| a.at(i, j) * x[j]).sum();
            assert!((y - sum).abs() < 1e-14);
        }
        let p = a.principal(&[3, 0]);
        assert_eq!((p.at(0, 0), p.at(0, 1), p.at(1, 1)), (a.at(3, 3), a.at(3, 0), a.at(0, 0)));
        let n = 70;
        let s = Symmetric::from_lower_rows(n, (0..n * n).map(|k| k as f64).collect());
        for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            assert_eq!([s.at(i, j), s.at(j, i)], [(i * n + j) as f64; 2]);
        }
    }

    #[test]
    fn low_eigenvectors_are_those_of_the_matrix() {
        let (a, _) = example(30);
        let low = a.eigenvectors_below(1.5).unwrap();
        assert!(!low.is_empty() && low.len() < 30);
        for v in &low {
            let av = a.times(v).unwrap();
            let value: f64 = std::iter::zip(&av, v).map(|(a, v)| a * v).sum();
            assert!(value < 1.5);
            std::iter::zip(&av, v)
                .for_each(|(a, v)| assert!((a - value * v).abs() < 1e-12 * a.abs().max(1.0)));
        }
        let raised = a.clone().add_outer(100.0, &low).unwrap();
        assert!(raised.eigenvectors_below(1.5).unwrap().is_empty());
    }

    #[test]
    fn what_is_not_positive_definite_has_no_factor() {
        assert!(Symmetric::from_lower_rows(2, vec![1.0, 2.0, 2.0, 1.0]).cholesky().unwrap().is_none());
        let dependent = Symmetric::from_lower_rows(2, vec![1.0, 1.0, 1.0, 1.0]);
        let factor = dependent.regular_cholesky(0.0).unwrap();
        let mut b = vec![2.0, 2.0];
        factor.solve(&mut b).unwrap();
        assert!((b[0] - 1.0).abs() < 1e-3 && (b[1] - 1.0).abs() < 1e-3, "{b:?}");
        assert!(Symmetric::default().cholesky().unwrap().is_some());
    }
}
