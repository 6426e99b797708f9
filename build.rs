//! Finds PETSc and MUMPS and generates the bindings that `src/petsc` wraps.
use std::{env, path::PathBuf, process::Command};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/petsc/petsc.h");
    println!("cargo::rerun-if-env-changed=PKG_CONFIG_PATH");

    // pkg-config emits the link flags; bindgen needs the include paths by hand.
    let petsc = pkg_config::Config::new()
        .atleast_version("3.18")
        .probe("PETSc")
        .unwrap_or_else(|e| panic!("PETSc not found (Debian: apt-get install petsc-dev): {e}"));
    // The dense algebra of interfaces; PETSc depends on them, but its flags do not name them.
    println!("cargo::rustc-link-lib=lapack");
    println!("cargo::rustc-link-lib=blas");
    let include = petsc.include_paths.iter().map(|dir| format!("-I{}", dir.display()));

    let bindings = bindgen::Builder::default()
        .header("src/petsc/petsc.h")
        .clang_args(include.chain(mpi_compile_flags()))
        .rust_edition(bindgen::RustEdition::Edition2024)
        .allowlist_function("(Petsc|Mat|Vec|KSP|PC|IS).*")
        .allowlist_var(
            "PETSC_.*|MAT[A-Z_]+|VEC[A-Z_]+|KSP[A-Z_]+|PC[A-Z_]+|IS[A-Z_]+|KSPList|PCList|PetscTrFree",
        )
        // MPI's types are those of the mpi crate, so that a communicator needs no cast.
        .blocklist_type("MPI_.*|ompi_.*|mca_.*")
        .blocklist_function("MPI_.*|PMPI_.*")
        .blocklist_var("FP_.*")
        .raw_line("pub use mpi::ffi::*;")
        // Functions on FILE and va_list would drag the C library's internals in.
        .opaque_type("_IO_FILE|FILE")
        .blocklist_function(".*(FPrintf|VSNPrintf|VFPrintf|FOpen|FClose|POpen|PClose).*")
        .default_enum_style(bindgen::EnumVariation::ModuleConsts)
        .default_macro_constant_type(bindgen::MacroTypeVariation::Signed)
        .generate_cstr(true)
        .layout_tests(false)
        .generate_comments(false)
        .generate()
        .expect("bindgen failed on PETSc's headers");
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets OUT_DIR"));
    bindings.write_to_file(out.join("petsc.rs")).expect("OUT_DIR is writable");

    // PETSc depends on MUMPS; its interface does not reach all of it.
    println!("cargo::rustc-link-lib=dmumps");
    bindgen::Builder::default()
        .header_contents("mumps.h", "#include <dmumps_c.h>")
        .clang_args(petsc.include_paths.iter().map(|dir| format!("-I{}", dir.display())))
        .rust_edition(bindgen::RustEdition::Edition2024)
        .allowlist_function("dmumps_c")
        .layout_tests(false)
        .generate_comments(false)
        .generate()
        .expect("bindgen failed on MUMPS' header")
        .write_to_file(out.join("mumps.rs"))
        .expect("OUT_DIR is writable");
}

/// `-I...` of Open MPI.
fn mpi_compile_flags() -> Vec<String> {
    let mpicc = env::var("MPICC").unwrap_or_else(|_| "mpicc".into());
    let out = Command::new(&mpicc)
        .arg("--showme:compile")
        .output()
        .unwrap_or_else(|e| panic!("cannot run {mpicc}: {e}"));
    String::from_utf8_lossy(&out.stdout).split_whitespace().map(str::to_owned).collect()
}
