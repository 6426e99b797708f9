//! Linear solvers chosen by options: what they are called is checked, and what they answer is measured.
use super::{
    Matrix, Vector,
    error::{check, check_options},
    handle::make,
    session::{default_option, option_value},
    sys,
};
use crate::error::{Error, Result};
use crate::tolerances::PRODUCT;
use mpi::traits::{AsRaw, Communicator};
use std::{
    ffi::{CStr, CString, c_char},
    ptr,
};

/// MUMPS' choice of an ordering, and approximate minimum degree.
const ORDERING: &str = "mat_mumps_icntl_7";
const MINIMUM_DEGREE: &str = "0";

/// Without options a solver is asked for this share of the residual that its answers may have at most, ...
const RESERVE: f64 = 0.01;

/// ... but for no less than this: rounding leaves as much.
const LEAST: f64 = 1e-12;

/// Most iterations of a solve, without options.
const ITERATIONS: i32 = 10_000;

/// The residual that an iteration carries along departs from the true one by rounding; up to this factor it counts.
const DEPARTS: f64 = 10.0;

/// A solver that stops by another norm than the true residual's is started again so often.
const RESTARTS: usize = 3;

/// Preconditioners whose operator is symmetric for a symmetric matrix; conjugate gradients need one.
const SYMMETRIC: [&str; 16] = [
    "bjacobi",
    "cholesky",
    "eisenstat",
    "gamg",
    "hypre",
    "icc",
    "ilu",
    "jacobi",
    "lu",
    "mg",
    "ml",
    "none",
    "pbjacobi",
    "redundant",
    "sor",
    "svd",
];

/// Those that solve at once.
const DIRECT: [&str; 2] = ["cholesky", "lu"];

handle!(Handle, KSP, KSPDestroy);

/// A linear solver with its options prefix.
pub struct Ksp {
    handle: Handle,
    /// One application of the factor is the answer.
    direct: bool,
    name: String,
    /// Relative residual to reach.
    tolerance: f64,
    /// Largest diagonal entry of the matrix.
    diagonal: f64,
    notes: Vec<String>,
}

impl Ksp {
    /// A solver for `a`. Without options: one sparse Cholesky factorisation by MUMPS and nothing else; options with
    /// the `prefix` change that. An iterative one ends with |b - A x| <= `tolerance` |b|, or what rounding leaves,
    /// whatever its options say; a solve that does not is an error.
    pub fn new<C: Communicator + AsRaw<Raw = mpi::ffi::MPI_Comm>>(
        comm: &C,
        a: &Matrix,
        prefix: &str,
        tolerance: f64,
    ) -> Result<Self> {
        // On one rank, for plane problems of up to a million unknowns, a nested dissection takes longer than it saves. An
        // option, since PETSc 3.18 loses what MatMumpsSetIcntl says before the analysis.
        if comm.size() == 1 {
            default_option(prefix, ORDERING, MINIMUM_DEGREE)?;
        }
        let wanted = refuse_unknown_types(prefix)?;
        let text = CString::new(prefix).map_err(Error::internal)?;
        // SAFETY: valid handles; PETSc copies the strings.
        let handle = unsafe {
            let ksp = Handle(make(|k| sys::KSPCreate(comm.as_raw(), k))?);
            check(sys::KSPSetOperators(ksp.0, a.0, a.0))?;
            check(sys::KSPSetOptionsPrefix(ksp.0, text.as_ptr()))?;
            check(sys::KSPSetType(
                ksp.0,
                iterative_type(wanted.pc.as_deref()).unwrap_or(c"preonly").as_ptr(),
            ))?;
            let mut pc = ptr::null_mut();
            check(sys::KSPGetPC(ksp.0, &mut pc))?;
            check(sys::PCSetType(pc, sys::PCCHOLESKY.as_ptr()))?;
            check(sys::PCFactorSetMatSolverType(pc, sys::MATSOLVERMUMPS.as_ptr()))?;
            let relative = (RESERVE * tolerance).max(LEAST.min(tolerance));
            check(sys::KSPSetTolerances(ksp.0, relative, 0.0, sys::PETSC_DEFAULT as f64, ITERATIONS))?;
            check_options(sys::KSPSetFromOptions(ksp.0))?;
            ksp
        };
        let diagonal = a.largest_diagonal()?;
        let mut ksp =
            Ksp { handle, direct: false, name: String::new(), tolerance, diagonal, notes: Vec::new() };
        ksp.settle(wanted.ksp.as_deref())?;
        Ok(ksp)
    }

    /// Makes an iteration of what is none and cannot be a solver by itself, and its tolerances tight enough.
    fn settle(&mut self, chosen: Option<&str>) -> Result<()> {
        let ksp = self.handle.0;
        let (mut method, preconditioner) = self.types()?;
        self.direct = method == "preonly" && DIRECT.contains(&preconditioner.as_str());
        // SAFETY: valid handles; the outputs are plain numbers.
        unsafe {
            if let ("preonly", Some(instead)) = (method.as_str(), iterative_type(Some(&preconditioner))) {
                check(sys::KSPSetType(ksp, instead.as_ptr()))?;
                method = instead.to_string_lossy().into_owned();
            }
            if !self.direct && chosen.is_none_or(|chosen| chosen == "preonly") {
                self.notes.push(format!(
                    "-pc_type {preconditioner} is no solver by itself: -ksp_type {method} is taken with it"
                ));
                if method == "gmres" {
                    check(sys::KSPSetPCSide(ksp, sys::PCSide::PC_RIGHT))?;
                    check(sys::KSPSetNormType(ksp, sys::KSPNormType::KSP_NORM_UNPRECONDITIONED))?;
                }
            }
            if method == "cg" {
                // The norm of what is asked for; the preconditioned one differs by the condition of the preconditioner.
                check(sys::KSPSetNormType(ksp, sys::KSPNormType::KSP_NORM_UNPRECONDITIONED))?;
            }
            let (mut relative, mut absolute, mut divergence, mut most) = (0.0, 0.0, 0.0, 0);
            check(sys::KSPGetTolerances(ksp, &mut relative, &mut absolute, &mut divergence, &mut most))?;
            if !self.direct && (relative > self.tolerance || absolute > 0.0) {
                self.notes.push(format!(
                    "-ksp_rtol {relative:e} -ksp_atol {absolute:e} would be too loose for the alternation: a relative residual \
                     of {:.1e} is asked of -ksp_type {method}",
                    self.tolerance
                ));
            }
            check(sys::KSPSetTolerances(ksp, relative.min(self.tolerance), 0.0, divergence, most))?;
            // The set-up reports by errors, a solve by its reason.
            check(sys::KSPSetErrorIfNotConverged(ksp, sys::PetscBool::PETSC_TRUE))?;
        }
        self.name = format!("-ksp_type {method} -pc_type {preconditioner}");
        Ok(())
    }

    fn types(&self) -> Result<(String, String)> {
        let (mut method, mut pc, mut preconditioner) = (ptr::null(), ptr::null_mut(), ptr::null());
        // SAFETY: valid handles; the names belong to PETSc.
        unsafe {
            check(sys::KSPGetType(self.handle.0, &mut method))?;
            check(sys::KSPGetPC(self.handle.0, &mut pc))?;
            check(sys::PCGetType(pc, &mut preconditioner))?;
            Ok((name_at(method), name_at(preconditioner)))
        }
    }

    /// True if a solve is one application of a factorisation.
    pub fn is_direct(&self) -> bool {
        self.direct
    }

    /// What the options say and is not done, for the user.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Sets up the preconditioner: with the default options, factorises.
    pub fn set_up(&self) -> Result<()> {
        // SAFETY: valid handle.
        unsafe {
            check_options(sys::KSPSetUp(self.handle.0)).map_err(|e| match e {
                Error::Internal(text) if !self.direct => {
                    Error::NotConverged(format!("{} cannot be set up: {text}", self.name))
                }
                other => other,
            })?;
            check(sys::KSPSetErrorIfNotConverged(self.handle.0, sys::PetscBool::PETSC_FALSE))
        }
    }

    /// Solves A x = b.
    pub fn solve(&self, b: &Vector, x: &Vector) -> Result<()> {
        if !self.direct {
            return self.iterate(b, x);
        }
        let (reason, _) = self.run(b, x)?;
        if reason < 0 {
            return Err(Error::NotConverged(format!("{}: {}", self.name, explain(reason))));
        }
        Ok(())
    }

    /// One run of the solver: why it ended, and after how many iterations.
    fn run(&self, b: &Vector, x: &Vector) -> Result<(i32, i32)> {
        let (mut reason, mut iterations) = (0, 0);
        // SAFETY: valid handles of matching layout.
        unsafe {
            check(sys::KSPSolve(self.handle.0, b.0, x.0))?;
            check(sys::KSPGetConvergedReason(self.handle.0, &mut reason))?;
            check(sys::KSPGetIterationNumber(self.handle.0, &mut iterations))?;
        }
        Ok((reason, iterations))
    }

    /// Iterates until the true residual is as small as it has to be. What a solver says of itself, in its own norm and by
    /// its own test, is not taken for it.
    fn iterate(&self, b: &Vector, x: &Vector) -> Result<()> {
        let scale = b.norm()?;
        x.set(&vec![0.0; x.n_owned()])?;
        if scale == 0.0 {
            return Ok(());
        }
        let (residual, correction) = (b.duplicate()?, b.duplicate()?);
        residual.copy_from(b)?;
        let mut count = 0;
        let mut reached = 1.0;
        for _ in 0..=RESTARTS {
            let (reason, iterations) = self.run(&residual, &correction)?;
            count += iterations;
            x.add_vector(&correction)?;
            self.residual(b, x, &residual)?;
            let before = reached;
            reached = residual.norm()? / scale;
            let round_off = PRODUCT * self.diagonal * x.norm()? / scale;
            if reached <= (DEPARTS * self.tolerance).max(round_off) {
                return Ok(());
            }
            let gains = reached < 0.5 * before;
            if reason < 0 || !gains {
                return Err(Error::NotConverged(format!(
                    "{}: a relative residual of {reached:.1e} after {count} iterations ({}), {:.1e} is needed",
                    self.name,
                    explain(reason),
                    self.tolerance
                )));
            }
        }
        Err(Error::NotConverged(format!(
            "{}: a relative residual of {reached:.1e} after {count} iterations and {RESTARTS} restarts, {:.1e} is needed",
            self.name, self.tolerance
        )))
    }

    /// r = b - A x.
    fn residual(&self, b: &Vector, x: &Vector, r: &Vector) -> Result<()> {
        let mut a = ptr::null_mut();
        // SAFETY: valid handles of matching layout; the solver keeps the matrix.
        unsafe {
            check(sys::KSPGetOperators(self.handle.0, &mut a, ptr::null_mut()))?;
            check(sys::MatMult(a, x.0, r.0))?;
            check(sys::VecAYPX(r.0, -1.0, b.0))
        }
    }
}

/// Algebraic multigrid with smoothers for stretched cells: incomplete Cholesky on every level, and no aggressive coarsening.
/// With point relaxation the iterations grow with the stretching (100 x 100 squares: 18, stretched to 20:1: 143, so smoothed
/// 12). Options of the user's come first; nothing happens unless they choose `-pc_type gamg`. To be called before the solver
/// is made.
pub fn smooth_stretched(prefix: &str) -> Result<()> {
    if option_value(prefix, "pc_type")?.as_deref() != Some("gamg")
        || super::has_option(prefix, "mg_levels_pc_type")?
    {
        return Ok(());
    }
    // Blocks are the ranks' shares. Two levels of fill: what the graded meshes of contact zones need.
    default_option(prefix, "mg_levels_pc_type", "bjacobi")?;
    default_option(prefix, "mg_levels_sub_pc_type", "icc")?;
    default_option(prefix, "mg_levels_sub_pc_factor_levels", "2")?;
    default_option(prefix, "pc_gamg_aggressive_coarsening", "0")
}

/// The iteration that a preconditioner needs; none if it solves at once, or if none is given.
fn iterative_type(preconditioner: Option<&str>) -> Option<&'static CStr> {
    let preconditioner = preconditioner.filter(|pc| !DIRECT.contains(pc))?;
    Some(if SYMMETRIC.contains(&preconditioner) { c"cg" } else { c"gmres" })
}

/// Types that the options choose.
struct Wanted {
    ksp: Option<String>,
    pc: Option<String>,
}

/// An error in one line if an option chooses what there is not.
fn refuse_unknown_types(prefix: &str) -> Result<Wanted> {
    let known = |name: &str, list: fn() -> Result<Vec<String>>| -> Result<Option<String>> {
        let Some(value) = option_value(prefix, name)? else { return Ok(None) };
        let known = list()?;
        if known.contains(&value) {
            return Ok(Some(value));
        }
        let known = known.join(", ");
        Err(Error::input(format!("-{prefix}{name} {value}: there is no such type; there are {known}")))
    };
    let (ksp, pc) = (known("ksp_type", methods)?, known("pc_type", preconditioners)?);
    if let Some(package) = option_value(prefix, "pc_factor_mat_solver_type")? {
        let factor = match pc.as_deref() {
            Some("lu") => sys::MatFactorType::MAT_FACTOR_LU,
            None | Some("cholesky") => sys::MatFactorType::MAT_FACTOR_CHOLESKY,
            _ => return Ok(Wanted { ksp, pc }),
        };
        let known: Vec<&str> = PACKAGES.into_iter().filter(|name| factorises(name, factor)).collect();
        if !factorises(&package, factor) {
            return Err(Error::input(format!(
                "-{prefix}pc_factor_mat_solver_type {package}: no package of this name does -pc_type {}; there are {}",
                pc.as_deref().unwrap_or("cholesky"),
                known.join(", ")
            )));
        }
    }
    Ok(Wanted { ksp, pc })
}

/// Packages of factorisations that PETSc may have been built with.
const PACKAGES: [&str; 9] =
    ["petsc", "mumps", "cholmod", "superlu", "superlu_dist", "umfpack", "klu", "pastix", "mkl_pardiso"];

/// True if a package factorises sparse matrices, on one rank or several.
fn factorises(package: &str, factor: sys::MatFactorType::Type) -> bool {
    let Ok(package) = CString::new(package) else { return false };
    [sys::MATSEQAIJ, sys::MATMPIAIJ].iter().any(|matrix| {
        let (mut has_package, mut has_type, mut make) = Default::default();
        // SAFETY: the outputs are plain values; the strings live through the call.
        let code = unsafe {
            sys::MatSolverTypeGet(
                package.as_ptr(),
                matrix.as_ptr(),
                factor,
                &mut has_package,
                &mut has_type,
                &mut make,
            )
        };
        code == 0 && make.is_some()
    })
}

fn methods() -> Result<Vec<String>> {
    // SAFETY: the call fills the list.
    unsafe {
        check(sys::KSPInitializePackage())?;
        registered(sys::KSPList)
    }
}

fn preconditioners() -> Result<Vec<String>> {
    // SAFETY: the call fills the list.
    unsafe {
        check(sys::PCInitializePackage())?;
        registered(sys::PCList)
    }
}

/// Names in one of PETSc's lists of types.
///
/// # Safety
/// `list` must be one of these lists.
unsafe fn registered(list: sys::PetscFunctionList) -> Result<Vec<String>> {
    let (mut names, mut n) = (ptr::null_mut(), 0);
    // SAFETY: promised; the strings are PETSc's own.
    unsafe {
        check(sys::PetscFunctionListGet(list, &mut names, &mut n))?;
        let mut out: Vec<String> = (0..n as usize).map(|i| name_at(*names.add(i))).collect();
        if let Some(free) = sys::PetscTrFree {
            check(free(names.cast(), line!() as i32, c"registered".as_ptr(), c"ksp.rs".as_ptr()))?;
        }
        out.retain(|name| !name.is_empty());
        out.sort();
        Ok(out)
    }
}

/// A name that PETSc keeps; empty if there is none.
///
/// # Safety
/// `p` must be null or a NUL-terminated string.
unsafe fn name_at(p: *const c_char) -> String {
    if p.is_null() {
        return String::new();
    }
    // SAFETY: promised.
    unsafe { CStr::from_ptr(p) }.to_string_lossy().into_owned()
}

/// Why a solve ended, in words.
fn explain(reason: i32) -> &'static str {
    match reason {
        -3 => "its limit",
        -4 => "diverged",
        -5 | -6 => "breakdown",
        -8 => "the preconditioner is not positive definite",
        -9 => "not a number",
        -10 => "the matrix is not positive definite",
        -11 => "the preconditioner failed",
        0.. => "which it takes for convergence",
        _ => "failed",
    }
}
