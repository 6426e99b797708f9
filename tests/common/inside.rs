//! Runs in the process of the test, on one rank. MPI and PETSc start once: one test function per program.
use kontakt::{
    case::{self, Case},
    output::{Field, RESULT, Results},
    petsc,
    record::{SideTable, Summary},
    simulation,
};
use mpi::{environment::Universe, topology::SimpleCommunicator};
use std::path::Path;

/// MPI, PETSc and all that runs in them.
pub struct Runner {
    // In this order: PETSc ends before MPI.
    session: petsc::Session,
    world: SimpleCommunicator,
    universe: Universe,
}

impl Runner {
    /// Starts MPI and PETSc.
    pub fn start() -> Runner {
        let universe = mpi::initialize().expect("MPI starts once in this process");
        let session = petsc::Session::start().expect("PETSc starts");
        Runner { session, world: universe.world(), universe }
    }

    /// A shipped case.
    pub fn read(&self, name: &str) -> Case {
        self.variant(name, None)
    }

    /// A variant of a shipped case.
    pub fn variant(&self, name: &str, variant: Option<&str>) -> Case {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(name);
        case::read(&path, variant, &[]).expect("the case reads")
    }

    /// The case of a text.
    pub fn parse(&self, text: &str) -> Case {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let file = directory.path().join("case.toml");
        std::fs::write(&file, text).expect("the case is written");
        case::read(&file, None, &[]).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }

    /// Runs a case that must converge.
    pub fn run(&self, case: &Case) -> (Summary, Results) {
        let (summary, results) = self.attempt(case).unwrap_or_else(|e| panic!("{}: {e}", case.name));
        assert!(summary.converged, "{}: {:?} {:?}", case.name, summary.reason, summary.diagnosis);
        (summary, results)
    }

    /// Runs a case, however it ends.
    pub fn attempt(&self, case: &Case) -> kontakt::error::Result<(Summary, Results)> {
        let out = tempfile::tempdir().expect("a temporary directory");
        let summary = simulation::run(case, &self.world, out.path(), |_| {})?;
        Ok((summary, Results::read(&out.path().join(RESULT)).expect("the file reads")))
    }
}

/// Both sides of a pair.
pub fn sides(results: &Results, pair: usize) -> Vec<&SideTable> {
    results.pairs[pair].sides.iter().flatten().filter(|side| !side.s.is_empty()).collect()
}

/// A field at the nodes.
pub fn point_field<'r>(results: &'r Results, name: &str) -> &'r Field {
    results.piece.point_fields.iter().find(|f| f.name == name).expect("the field is there")
}

/// Body of each point.
pub fn point_bodies(results: &Results) -> Vec<usize> {
    let mut bodies = vec![0; results.piece.points.len()];
    for (cell, &body) in std::iter::zip(&results.piece.cells, &results.piece.cell_bodies) {
        cell.nodes().iter().for_each(|&n| bodies[n as usize] = body as usize);
    }
    bodies
}
