//! What the result file holds, as the ranks hold it.
use crate::case::{Analysis, Units};
use crate::error::{Error, Result};
use crate::mesh::Cell;
use crate::record::{HistoryRow, LoadStep, PairTables, Reason, SideTable};

/// This rank's share of the grid: one partition of it, with the pieces of all bodies the rank takes part in.
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

/// What was found at the end of a load step: fields on the grid of the [`Piece`], and the contact pairs.
#[derive(Debug, Clone, Default)]
pub struct State {
    /// Fields at the nodes.
    pub point_fields: Vec<Field>,
    /// Fields per cell.
    pub cell_fields: Vec<Field>,
    /// The contact pairs.
    pub pairs: Vec<PairTables>,
}

/// Outline of a rigid body, to be drawn. The same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Name of the body.
    pub body: String,
    /// A polyline before any motion, m; the body lies to the left of the direction of travel.
    pub points: Vec<[f64; 3]>,
    /// Prescribed motion at the end of the last step, m.
    pub motion: [f64; 3],
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
    /// Names of the deformable bodies; `CellData/body` is an index into them.
    pub bodies: Vec<String>,
    /// The rigid bodies.
    pub rigid: Vec<Outline>,
    /// How the alternation ended, of the last step.
    pub reason: Reason,
    /// Alternations made, in all steps.
    pub alternations: u64,
    /// Tolerance of the stop test.
    pub tolerance: f64,
    /// The load steps that were run; `None` if the case has no table of them.
    pub steps: Option<Vec<LoadStep>>,
}

impl RunInfo {
    /// True if the result can be trusted: every step converged.
    pub fn converged(&self) -> bool {
        self.reason.converged() && self.steps.iter().flatten().all(|step| step.reason.converged())
    }

    /// Unit to label a number with: none where the user keeps his own.
    pub fn unit<'a>(&self, si: &'a str) -> &'a str {
        match self.units {
            Units::Si => si,
            Units::Consistent => "",
        }
    }

    pub(super) fn units_name(&self) -> &'static str {
        match self.units {
            Units::Si => "SI",
            Units::Consistent => "consistent",
        }
    }
}

/// What goes into the result file: everything, or with a table of load steps what the last one of it adds.
#[derive(Debug, Clone, Copy)]
pub struct ResultFile<'a> {
    /// This rank's part of the bodies, with the fields of the last step.
    pub piece: &'a Piece,
    /// The contact pairs after the last step.
    pub pairs: &'a [PairTables],
    /// The alternations, of the last step if there is a table of steps; only rank 0's are written.
    pub history: &'a [HistoryRow],
    /// What was run.
    pub run: &'a RunInfo,
}

impl ResultFile<'_> {
    /// Refuses arrays whose lengths do not fit together: others' rows would be overwritten.
    pub(super) fn check(&self) -> Result<()> {
        let Piece { points, cells, cell_bodies, point_fields, cell_fields } = self.piece;
        ok(cell_bodies.len() == cells.len(), || "as many body indices as cells are needed".into())?;
        let in_range = cells.iter().flat_map(|cell| cell.nodes()).all(|&i| (i as usize) < points.len());
        ok(in_range, || "a cell has a node that is not there".into())?;
        check_fields(point_fields, points.len())?;
        check_fields(cell_fields, cells.len())?;
        for pair in self.pairs {
            let fits = pair.sides.iter().flatten().all(SideTable::is_consistent);
            ok(fits, || format!("the columns of contact pair \"{}\" differ in length", pair.name))?;
        }
        for row in self.history {
            let fits = [0, self.pairs.len()].contains(&row.pairs.len())
                && row.pairs.len() == self.history[0].pairs.len();
            ok(fits, || "the history needs a row for every pair, or for none".into())?;
        }
        Ok(())
    }

    /// All that must be the same on all ranks, as one text.
    pub(super) fn skeleton(&self) -> String {
        let fields = |fields: &[Field]| -> Vec<_> {
            fields.iter().map(|f| (f.name.clone(), f.unit, f.components)).collect()
        };
        let pairs: Vec<_> = self.pairs.iter().map(|p| (&p.name, &p.surfaces)).collect();
        let Piece { point_fields, cell_fields, .. } = self.piece;
        format!("{:?}", (fields(point_fields), fields(cell_fields), pairs, self.run))
    }

    /// All that must be the same in all steps: the sizes of this rank's grid, fields and tables.
    pub(super) fn shape(&self) -> String {
        let Piece { points, cells, point_fields, cell_fields, .. } = self.piece;
        let fields =
            |fields: &[Field]| fields.iter().map(|f| (f.name.clone(), f.components)).collect::<Vec<_>>();
        let lengths = |p: &PairTables| p.sides.each_ref().map(|side| side.as_ref().map(|t| t.s.len()));
        let pairs: Vec<_> = self.pairs.iter().map(|p| (&p.name, lengths(p))).collect();
        format!("{:?}", (points.len(), cells.len(), fields(point_fields), fields(cell_fields), pairs))
    }
}

fn ok(condition: bool, what: impl Fn() -> String) -> Result<()> {
    if condition { Ok(()) } else { Err(Error::internal(format!("result file: {}", what()))) }
}

fn check_fields(fields: &[Field], n: usize) -> Result<()> {
    fields.iter().try_for_each(|field| {
        let fits = field.components > 0 && field.values.len() == field.components * n;
        ok(fits, || format!("field \"{}\" has the wrong length", field.name))
    })
}
