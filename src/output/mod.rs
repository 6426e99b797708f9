//! What a run leaves behind: `result.vtkhdf`, `summary.json`, pictures.
//!
//! All ranks call [`prepare`] before anything is computed and [`write()`] when it is; then rank 0 draws the
//! pictures from the file and writes the [`Summary`], last of all.
use crate::case::{Analysis, Units};
use crate::error::{Error, Result};
use crate::mesh::Cell;
use mpi::topology::SimpleCommunicator;
use std::path::Path;

mod agree;
mod file;
mod hdf5_rows;
mod hdf5_text;
mod picture;
mod read;
mod summary;
mod tables;
mod vtkhdf;

pub use file::write;
pub use picture::draw;
pub use read::Results;
pub use summary::*;

/// Name of the result file.
pub const RESULT: &str = "result.vtkhdf";
/// Name of the summary.
pub const SUMMARY: &str = "summary.json";

/// Collective. Creates the results directory and makes sure that it can be written to, before hours of work.
pub fn prepare(comm: &SimpleCommunicator, directory: &Path) -> Result<()> {
    agree::on_rank_zero(comm, || {
        let probe = directory.join(".kontakt.part");
        let tried = std::fs::create_dir_all(directory)
            .and_then(|()| std::fs::write(&probe, ""))
            .and_then(|()| std::fs::remove_file(&probe));
        tried.map_err(|e| {
            Error::input(format!("cannot write to the results directory {}: {e}", directory.display()))
        })
    })
}

/// This rank's share of the fields: one partition of the VTKHDF grid, with the pieces of all bodies the rank
/// takes part in.
#[derive(Debug, Clone, Default)]
pub struct Piece {
    /// Node coordinates, m.
    pub points: Vec<[f64; 3]>,
    /// Cells, with indices into `points`.
    pub cells: Vec<Cell>,
    /// Body index of each cell.
    pub cell_bodies: Vec<i32>,
    /// Fields at the nodes. Every rank holds the same fields in the same order.
    pub point_fields: Vec<Field>,
    /// Fields per cell (mean over the cell).
    pub cell_fields: Vec<Field>,
}

/// A named field: `values.len() == components * n`, point- or cell-major. Tensors are (xx, yy, zz, xy, yz,
/// xz).
#[derive(Debug, Clone)]
pub struct Field {
    /// Name shown by ParaView.
    pub name: String,
    /// SI unit (`Pa`, `m`, `K`, `-`).
    pub unit: &'static str,
    /// Components per point or cell: 1, 3 or 6.
    pub components: usize,
    /// The values.
    pub values: Vec<f64>,
}

/// One side of a contact pair after the run, node by node along the surface. Held by one rank only.
#[derive(Debug, Clone, Default)]
pub struct SideTable {
    /// Coordinate along the surface, m, from its first node.
    pub s: Vec<f64>,
    /// Node coordinates, undeformed, m.
    pub x: Vec<[f64; 3]>,
    /// Outward unit normal used for contact.
    pub normal: Vec<[f64; 3]>,
    /// Gap after deformation, m; NaN where the node has no conjugate point.
    pub gap: Vec<f64>,
    /// Contact pressure, Pa.
    pub pressure: Vec<f64>,
    /// Contact nodal force on this body, N.
    pub force: Vec<[f64; 3]>,
    /// 0: no candidate, 1: open, 2: in contact.
    pub status: Vec<i32>,
}

/// One row of the history: an alternation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HistoryRow {
    /// 1, 2, ...
    pub alternation: u64,
    /// Displacement jump relative to the elastic response, -.
    pub displacement_jump: f64,
    /// Disagreement of the nodal forces of the displacement step, relative, -.
    pub force_imbalance: f64,
    /// Active nodes, both sides of all pairs.
    pub active: u64,
    /// Measured contraction of the displacement jump, -; NaN for the first.
    pub contraction: f64,
    /// Wall seconds since the first alternation began.
    pub seconds: f64,
}

/// Both sides of a contact pair. Every rank has the same pairs in the same order, but few have the tables.
#[derive(Debug, Clone)]
pub struct PairTables {
    /// Name of the pair; names its group in the file.
    pub name: String,
    /// `body.surface` of side A and side B.
    pub surfaces: [String; 2],
    /// The tables, each on one rank, `None` on the others.
    pub sides: [Option<SideTable>; 2],
}

/// What was run. The same on all ranks.
#[derive(Debug, Clone)]
pub struct RunInfo {
    /// Name of the case.
    pub case: String,
    /// Title of pictures.
    pub title: String,
    /// Variant, if any.
    pub variant: Option<String>,
    /// The case as run.
    pub text: String,
    /// Units of the numbers.
    pub units: Units,
    /// Idealisation and thickness.
    pub analysis: Analysis,
    /// Names of the bodies; `CellData/body` is an index into them.
    pub bodies: Vec<String>,
    /// How the alternation ended.
    pub reason: Reason,
    /// Alternations made.
    pub alternations: u64,
    /// Tolerance of the stop test.
    pub tolerance: f64,
}

impl RunInfo {
    /// True if the result can be trusted.
    pub fn converged(&self) -> bool {
        self.reason.converged()
    }

    /// Unit to label a number with: none where the user keeps his own.
    pub fn unit<'a>(&self, si: &'a str) -> &'a str {
        match self.units {
            Units::Si => si,
            Units::Consistent => "",
        }
    }

    fn units_name(&self) -> &'static str {
        match self.units {
            Units::Si => "SI",
            Units::Consistent => "consistent",
        }
    }
}

/// Everything that goes into the result file.
#[derive(Debug, Clone, Copy)]
pub struct ResultFile<'a> {
    /// This rank's part of the bodies.
    pub piece: &'a Piece,
    /// The contact pairs.
    pub pairs: &'a [PairTables],
    /// The alternations; only rank 0's are written.
    pub history: &'a [HistoryRow],
    /// What was run.
    pub run: &'a RunInfo,
}

impl ResultFile<'_> {
    /// Refuses arrays whose lengths do not fit together: HDF5 would read beyond their ends.
    fn check(&self) -> Result<()> {
        let Piece { points, cells, cell_bodies, point_fields, cell_fields } = self.piece;
        let ok = |condition: bool, what: &str| {
            if condition { Ok(()) } else { Err(Error::internal(format!("result file: {what}"))) }
        };
        ok(cell_bodies.len() == cells.len(), "as many body indices as cells are needed")?;
        let in_range = cells.iter().flat_map(|cell| cell.nodes()).all(|&i| (i as usize) < points.len());
        ok(in_range, "a cell has a node that is not there")?;
        for (fields, n) in [(point_fields, points.len()), (cell_fields, cells.len())] {
            for field in fields {
                let fits = field.components > 0 && field.values.len() == field.components * n;
                ok(fits, &format!("field \"{}\" has the wrong length", field.name))?;
            }
        }
        for pair in self.pairs {
            for SideTable { s, x, normal, gap, pressure, force, status } in pair.sides.iter().flatten() {
                let lengths = [x.len(), normal.len(), gap.len(), pressure.len(), force.len(), status.len()];
                let fits = lengths.iter().all(|&n| n == s.len());
                ok(fits, &format!("the columns of contact pair \"{}\" differ in length", pair.name))?;
            }
        }
        Ok(())
    }

    /// All that must be the same on all ranks, as one text.
    fn skeleton(&self) -> String {
        let fields = |fields: &[Field]| -> Vec<_> {
            fields.iter().map(|f| (f.name.clone(), f.unit, f.components)).collect()
        };
        let pairs: Vec<_> = self.pairs.iter().map(|p| (&p.name, &p.surfaces)).collect();
        let Piece { point_fields, cell_fields, .. } = self.piece;
        format!("{:?}", (fields(point_fields), fields(cell_fields), pairs, self.run))
    }
}
