//! The PETSc options that a case may give to a body's solver: those that choose a solver and tune it.
//!
//! A case is data and may come from anybody, while PETSc's options can write any file, load libraries and read further
//! options. What is not known to be harmless is refused by name; on the command line the user may give everything.
use super::reader::Field;

/// What the options that choose and tune solvers begin with, after the prefixes of the solvers inside a preconditioner.
const FAMILIES: [&str; 3] = ["ksp_", "pc_", "mat_mumps_"];

/// Prefixes of the solvers inside a preconditioner: block methods, multigrid, splittings, redundant and telescope.
const INNER: [&str; 8] =
    ["sub_", "mg_levels_", "mg_coarse_", "mg_fine_", "fieldsplit_", "redundant_", "telescope_", "esteig_"];

/// Parts of the names of options, and whole values, that view, print or log, read or write files, or load code.
const ACTING: [&str; 22] = [
    "view", "monitor", "print", "plot", "draw", "dump", "log", "debug", "dbg", "python", "saws", "reason",
    "tmpdir", "file", "save", "load", "write", "read", "amgx", "patch", "shell", "compute",
];

/// MUMPS' controls that name Fortran units to print to (1 to 3), and the one that puts factors into files (22).
const FILES_OF_MUMPS: [&str; 4] = ["icntl_1", "icntl_2", "icntl_3", "icntl_22"];

/// The options as a text, if all of them may be given; otherwise an error of the field names the first that may not.
pub(super) fn read(field: &Field<'_>) -> Option<String> {
    let text = field.text()?;
    match check(text) {
        Ok(()) => Some(text.to_string()),
        Err(message) => field.refuse(message),
    }
}

fn check(text: &str) -> Result<(), String> {
    let mut after_option = false;
    for word in text.split_whitespace() {
        match word.strip_prefix('-').filter(|_| word.parse::<f64>().is_err()) {
            Some(name) => {
                option(name)?;
                after_option = true;
            }
            None => {
                value(word, after_option)?;
                after_option = false;
            }
        }
    }
    Ok(())
}

fn option(name: &str) -> Result<(), String> {
    let words = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let acts =
        ACTING.iter().any(|part| name.split('_').any(|word| word.starts_with(part) || word.ends_with(part)));
    let unit = FILES_OF_MUMPS.iter().any(|end| name.ends_with(&format!("mat_mumps_{end}")));
    if name.chars().all(words) && in_family(name) && !acts && !unit {
        return Ok(());
    }
    Err(format!(
        "-{name} is none of the options that a case may give: those that choose and tune a solver ({}_...), without \
         viewers, monitors and files. On the command line it may be given: -body_NAME_{name}",
        FAMILIES.map(|f| format!("-{}", f.trim_end_matches('_'))).join("_..., ")
    ))
}

/// True for an option of a family, of the body's solver or of one inside it (`-mg_levels_1_ksp_type`).
fn in_family(name: &str) -> bool {
    if FAMILIES.iter().any(|family| name.len() > family.len() && name.starts_with(family)) {
        return true;
    }
    let Some(rest) = INNER.iter().find_map(|inner| name.strip_prefix(inner)) else { return false };
    // A level, or a split, has a number.
    in_family(rest.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start_matches('_'))
}

fn value(word: &str, after_option: bool) -> Result<(), String> {
    if !after_option {
        return Err(format!(
            "'{word}' belongs to no option; PETSc options begin with '-', such as \"-ksp_type cg -pc_type gamg\""
        ));
    }
    // Names, numbers and lists of them; paths and viewers have other characters.
    let plain = |c: char| c.is_ascii_alphanumeric() || "_.,+-".contains(c);
    if word.chars().all(plain) && !ACTING.contains(&word) {
        return Ok(());
    }
    Err(format!("'{word}' is no name or number that a solver's option may have in a case"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_that_choose_and_tune_are_taken() {
        for text in [
            "",
            "-ksp_type cg -pc_type gamg",
            "-ksp_rtol 1e-10 -ksp_max_it 500 -ksp_norm_type unpreconditioned",
            "-pc_type cholesky -pc_factor_mat_solver_type mumps -mat_mumps_icntl_7 5 -mat_mumps_cntl_1 -1.0",
            "-pc_type hypre -pc_hypre_type boomeramg -pc_hypre_boomeramg_strong_threshold 0.5",
            "-pc_gamg_threshold 0.01,-1 -mg_levels_ksp_type chebyshev -mg_levels_1_pc_type sor -mg_coarse_pc_type lu",
            "-pc_type asm -sub_pc_type ilu -sub_pc_factor_levels 2 -ksp_initial_guess_nonzero",
            "-mg_levels_esteig_ksp_type cg\n-fieldsplit_0_pc_type jacobi",
            "-pc_type bjacobi -sub_ksp_type preonly -pc_factor_shift_type positive_definite",
        ] {
            assert_eq!(check(text), Ok(()), "{text}");
        }
    }

    #[test]
    fn what_writes_files_or_loads_code_is_refused_by_name() {
        for text in [
            "-ksp_view ascii:/tmp/x",
            "-ksp_view",
            "-ksp_view_mat binary:x",
            "-ksp_monitor :x",
            "-ksp_monitor_residual",
            "-ksp_converged_reason binary",
            "-pc_view",
            "-mg_levels_1_ksp_view_mat binary:x",
            "-sub_pc_mg_dump_binary x",
            "-mat_view",
            "-mat_mumps_ooc_tmpdir x",
            "-mat_mumps_icntl_22 1",
            "-mat_mumps_icntl_1 17",
            "-ksp_type python",
            "-pc_python_type m.C",
            "-pc_type shell",
            "-ksp_saws_block",
            "-ksp_plot_eigenvalues",
            "-pc_patch_construct_type user",
            "-options_file x",
            "-options_file_yaml x",
            "-prefix_push x",
            "-log_view :x",
            "-help",
            "-vec_view",
            "-dll_prepend x",
            "-malloc_dump",
            "-on_error_attach_debugger",
            "--ksp_type cg",
            "-KSP_VIEW",
            "-ksp_",
            "-ksp_type cg:x",
            "-ksp_type /tmp/x",
            "-ksp_type \"cg",
            "cg",
            "-ksp_type cg cg",
            "-ksp_type cg\u{a0}-ksp_view",
            "-pc_type gamg;x",
        ] {
            let error = check(text).expect_err(text);
            let named = text.split_whitespace().any(|word| error.contains(word));
            assert!(named && !error.contains('\n'), "{text}: {error}");
        }
    }
}
