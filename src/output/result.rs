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

/// Everything that goes into the result file.
#[derive(Debug, Clone, Copy)]
pub struct ResultFile<'a> {
    /// This rank's part of the bodies, with the fields of the last step.
    pub piece: &'a Piece,
    /// The contact pairs after the last step.
    pub pairs: &'a [PairTables],
    /// What was found in the steps before the last: one fewer than `run.steps`; none without a table of steps.
    pub before: &'a [State],
    /// The alternations; only rank 0's are written.
    pub history: &'a [HistoryRow],
    /// What was run.
    pub run: &'a RunInfo,
}

impl<'a> ResultFile<'a> {
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
        let steps = self.run.steps.as_ref().map_or(1, Vec::len);
        ok(steps == self.before.len() + 1, || "every step of the table needs its results".into())?;
        for state in self.before {
            check_fields(&state.point_fields, points.len())?;
            check_fields(&state.cell_fields, cells.len())?;
            let same = same_fields(&state.point_fields, point_fields)
                && same_fields(&state.cell_fields, cell_fields)
                && same_tables(&state.pairs, self.pairs);
            ok(same, || "the steps differ in fields or in contact tables".into())?;
        }
        for row in self.history {
            let fits = [0, self.pairs.len()].contains(&row.pairs.len())
                && row.pairs.len() == self.history[0].pairs.len();
            ok(fits, || "the history needs a row for every pair, or for none".into())?;
        }
        Ok(())
    }

    /// Contact pairs after every step, the last one last.
    pub(super) fn pairs_of_steps(&self) -> impl Iterator<Item = &'a [PairTables]> {
        let before = self.before.iter().map(|state| state.pairs.as_slice());
        before.chain(std::iter::once(self.pairs))
    }

    /// All that must be the same on all ranks, as one text.
    pub(super) fn skeleton(&self) -> String {
        let fields = |fields: &[Field]| -> Vec<_> {
            fields.iter().map(|f| (f.name.clone(), f.unit, f.components)).collect()
        };
        let pairs: Vec<_> = self.pairs.iter().map(|p| (&p.name, &p.surfaces)).collect();
        let Piece { point_fields, cell_fields, .. } = self.piece;
        format!("{:?}", (fields(point_fields), fields(cell_fields), pairs, self.before.len(), self.run))
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

fn same_fields(a: &[Field], b: &[Field]) -> bool {
    let same = |(a, b): (&Field, &Field)| (&a.name, a.unit, a.components) == (&b.name, b.unit, b.components);
    a.len() == b.len() && std::iter::zip(a, b).all(same)
}

/// The same pairs, with the tables of the same nodes.
fn same_tables(a: &[PairTables], b: &[PairTables]) -> bool {
    let side = |(a, b): (&Option<SideTable>, &Option<SideTable>)| match (a, b) {
        (Some(a), Some(b)) => a.is_consistent() && a.s.len() == b.s.len(),
        (a, b) => a.is_none() && b.is_none(),
    };
    let same = |(a, b): (&PairTables, &PairTables)| {
        (&a.name, &a.surfaces) == (&b.name, &b.surfaces) && std::iter::zip(&a.sides, &b.sides).all(side)
    };
    a.len() == b.len() && std::iter::zip(a, b).all(same)
}
