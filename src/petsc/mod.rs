//! PETSc behind a thin safe layer.
