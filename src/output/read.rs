//! Reading `result.vtkhdf` back, by one process.
use super::hdf5_text::{read_string_attribute, read_strings};
use super::{Field, Outline, Piece, ResultFile, RunInfo, State, file_options};
use super::{history, steps};
use crate::case::{Analysis, Units};
use crate::contact::Law;
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::mesh::Cell;
use crate::record::{HistoryRow, PairTables, Reason, SideTable, Tangential};
use hdf5::{Dataset, File, Group, H5Type};
use std::path::Path;

/// A result file in memory, the partitions joined.
#[derive(Debug, Clone)]
pub struct Results {
    /// All partitions, one after the other, with the fields of the last step.
    pub piece: Piece,
    /// First point and first cell of each partition.
    pub partitions: Vec<[usize; 2]>,
    /// The contact pairs after the last step, both sides present; one that no rank held has no nodes.
    pub pairs: Vec<PairTables>,
    /// What was found in the steps before the last; without the fields if only the last step's were read.
    pub before: Vec<State>,
    /// The alternations.
    pub history: Vec<HistoryRow>,
    /// What was run.
    pub run: RunInfo,
    /// False if the run was ended before its last load step: what there is of it is sound.
    pub complete: bool,
}

impl Results {
    /// Reads a file. Not collective.
    pub fn read(path: &Path) -> Result<Self> {
        Self::open(path, true)
    }

    /// Reads a file, but of all fields only those of the last step: they need as much memory for any number of steps. Not
    /// collective.
    pub fn read_last(path: &Path) -> Result<Self> {
        Self::open(path, false)
    }

    fn open(path: &Path, all_fields: bool) -> Result<Self> {
        let wrong =
            |e: Error| Error::input(format!("{} is not a result file of kontakt: {e}", path.display()));
        let file = file_options()
            .open(path)
            .map_err(|e| Error::input(format!("cannot read {}: {e}", path.display())))?;
        Self::from_file(&file, all_fields).map_err(wrong)
    }

    fn from_file(file: &File, all_fields: bool) -> Result<Self> {
        let of_run = file.group("run")?;
        let run = RunInfo { steps: steps::read(file)?, rigid: read_rigid(file)?, ..read_run(&of_run)? };
        let complete = of_run.attr("complete")?.read_scalar::<u8>()? != 0;
        let n_steps = run.steps.as_ref().map(Vec::len);
        let last = n_steps.unwrap_or(1) - 1;
        let vtk = file.group("VTKHDF")?;
        let (mut piece, partitions) = read_grid(&vtk)?;
        [piece.point_fields, piece.cell_fields] = read_state(&vtk, &piece, last)?;
        let contact = file.group("contact")?.groups()?;
        let pairs = |step| contact.iter().map(|group| read_pair(group, step)).collect::<Result<Vec<_>>>();
        let mut before = Vec::new();
        for k in 0..last {
            let [point_fields, cell_fields] =
                if all_fields { read_state(&vtk, &piece, k)? } else { Default::default() };
            before.push(State { point_fields, cell_fields, pairs: pairs(Some(k + 1))? });
        }
        // The columns beside those of the steps may be of a step that is not complete.
        let pairs = pairs(n_steps)?;
        let history = history::read(&file.group("history")?, &pairs, n_steps)?;
        ResultFile { piece: &piece, pairs: &pairs, history: &history, run: &run }.check()?;
        Ok(Results { piece, partitions, pairs, before, history, run, complete })
    }
}

/// The grid without fields, and the partitions.
fn read_grid(group: &Group) -> Result<(Piece, Vec<[usize; 2]>)> {
    let n_points = group.dataset("NumberOfPoints")?.read_raw::<u64>()?;
    let n_cells = group.dataset("NumberOfCells")?.read_raw::<u64>()?;
    let n_connectivity = group.dataset("NumberOfConnectivityIds")?.read_raw::<u64>()?;
    let points = read_vectors(&group.dataset("Points")?)?;
    let connectivity = group.dataset("Connectivity")?.read_raw::<u32>()?;
    let types = group.dataset("Types")?.read_raw::<u8>()?;

    let mut cells = Vec::with_capacity(types.len());
    let mut partitions = Vec::new();
    let mut types = types.iter();
    let (mut first_point, mut first_node) = (0, 0);
    for ((&n_points, &n_cells), &n_nodes) in n_points.iter().zip(&n_cells).zip(&n_connectivity) {
        partitions.push([first_point, cells.len()]);
        let end = first_node + n_nodes as usize;
        let mut nodes =
            connectivity.get(first_node..end).ok_or_else(|| Error::input("Connectivity is too short"))?;
        for vtk_type in types.by_ref().take(n_cells as usize) {
            let (cell, rest) = read_cell(*vtk_type, nodes, first_point)?;
            cells.push(cell);
            nodes = rest;
        }
        first_point += n_points as usize;
        first_node = end;
    }
    let cell_bodies = group.dataset("CellData/body")?.read_raw()?;
    Ok((Piece { points, cells, cell_bodies, ..Piece::default() }, partitions))
}

/// Nodal and cell fields after step `k`, 0 the first.
fn read_state(group: &Group, piece: &Piece, k: usize) -> Result<[Vec<Field>; 2]> {
    Ok([
        read_fields(&group.group("PointData")?, piece.points.len(), k)?,
        read_fields(&group.group("CellData")?, piece.cells.len(), k)?,
    ])
}

/// A cell, its nodes counted from the first of all points, and the nodes after it.
fn read_cell(vtk_type: u8, nodes: &[u32], first_point: usize) -> Result<(Cell, &[u32])> {
    let kind = ElementKind::ALL.into_iter().find(|kind| kind.vtk_type() == vtk_type);
    let kind = kind.ok_or_else(|| Error::input(format!("unknown VTK cell type {vtk_type}")))?;
    let (own, rest) =
        nodes.split_at_checked(kind.n_nodes()).ok_or_else(|| Error::input("Connectivity is too short"))?;
    let own: Vec<u32> = own.iter().map(|&i| i.saturating_add(first_point as u32)).collect();
    Ok((Cell::new(kind, &own), rest))
}

fn read_vectors(dataset: &Dataset) -> Result<Vec<[f64; 3]>> {
    let values = dataset.read_raw::<f64>()?;
    let (vectors, rest) = values.as_chunks();
    if !rest.is_empty() || dataset.shape().get(1) != Some(&3) {
        return Err(Error::input(format!("{} must have 3 columns", dataset.name())));
    }
    Ok(vectors.to_vec())
}

/// The fields of a group after step `k`, `rows` of each: every dataset with a unit, in alphabetical order.
fn read_fields(group: &Group, rows: usize, k: usize) -> Result<Vec<Field>> {
    const UNITS: [&str; 6] = ["m", "Pa", "K", "N", "J/m3", "-"];
    let mut fields = Vec::new();
    for dataset in group.datasets()? {
        let Ok(unit) = read_string_attribute(&dataset, "unit") else { continue };
        let unit = UNITS.into_iter().find(|known| *known == unit).unwrap_or("");
        let name = dataset.name().rsplit('/').next().unwrap_or_default().to_owned();
        let range = k * rows..(k + 1) * rows;
        let components = dataset.shape().get(1).copied().unwrap_or(1);
        let values = match dataset.ndim() {
            _ if rows == 0 => Vec::new(),
            1 => dataset.read_slice_1d::<f64, _>(range)?.into_raw_vec_and_offset().0,
            _ => dataset.read_slice_2d::<f64, _>((range, ..))?.into_raw_vec_and_offset().0,
        };
        fields.push(Field { name, unit, components, values });
    }
    Ok(fields)
}

fn read_rigid(file: &File) -> Result<Vec<Outline>> {
    if !file.link_exists("rigid") {
        return Ok(Vec::new());
    }
    let outline = |group: &Group| {
        let motion = read_vectors(&group.dataset("motion")?)?;
        Ok(Outline {
            body: read_string_attribute(group, "name")?,
            points: read_vectors(&group.dataset("x")?)?,
            motion: *motion.first().ok_or_else(|| Error::input("a rigid body has no motion"))?,
        })
    };
    file.group("rigid")?.groups()?.iter().map(outline).collect()
}

/// A pair after the last step, or after step `step`.
fn read_pair(group: &Group, step: Option<usize>) -> Result<PairTables> {
    let (a, b) = (group.group("a")?, group.group("b")?);
    let sides = [read_side(&a, step)?, read_side(&b, step)?];
    Ok(PairTables {
        name: read_string_attribute(group, "name")?,
        surfaces: [read_string_attribute(&a, "surface")?, read_string_attribute(&b, "surface")?],
        law: read_law(group)?,
        varies: group.attr("over_temperature").is_ok(),
        sides: sides.map(Some),
    })
}

fn read_law(group: &Group) -> Result<Law> {
    let Ok(name) = read_string_attribute(group, "law") else { return Ok(Law::Frictionless) };
    let number = |name| Ok::<f64, Error>(group.attr(name)?.read_scalar()?);
    match name.as_str() {
        "coulomb" => Ok(Law::Coulomb { friction: number("friction")? }),
        "tresca" => Ok(Law::Tresca { shear: number("shear")? }),
        "rough" => Ok(Law::Rough),
        "tied" => Ok(Law::Tied),
        other => Err(Error::input(format!("unknown law \"{other}\""))),
    }
}

fn read_side(group: &Group, step: Option<usize>) -> Result<SideTable> {
    let state = match step {
        Some(k) => group.group(&format!("steps/{k}"))?,
        None => group.clone(),
    };
    Ok(SideTable {
        s: read(group, "s")?,
        x: read_vectors(&group.dataset("x")?)?,
        normal: read_vectors(&state.dataset("normal")?)?,
        gap: read(&state, "gap")?,
        pressure: read(&state, "pressure")?,
        force: read_vectors(&state.dataset("force")?)?,
        status: read(&state, "status")?,
        tangential: match state.link_exists("traction") {
            true => Some(Tangential { traction: read(&state, "traction")?, slip: read(&state, "slip")? }),
            false => None,
        },
        bonded: false,
        multipliers: group.attr("multipliers")?.read_scalar::<u8>()? != 0,
        closed: group.attr("closed").ok().map(|length| length.read_scalar()).transpose()?,
    })
}

fn read<T: H5Type>(group: &Group, name: &str) -> Result<Vec<T>> {
    Ok(group.dataset(name)?.read_raw()?)
}

fn read_run(group: &Group) -> Result<RunInfo> {
    let text = |name| read_string_attribute(group, name);
    let thickness = group.attr("thickness")?.read_scalar()?;
    let reason = text("reason")?;
    let unknown = |what: &str, name: &str| Error::input(format!("unknown {what} \"{name}\""));
    Ok(RunInfo {
        case: text("case")?,
        title: text("title")?,
        variant: Some(text("variant")?).filter(|variant| !variant.is_empty()),
        text: read_strings(&group.dataset("case_text")?)?.concat(),
        units: if text("units")? == "SI" { Units::Si } else { Units::Consistent },
        analysis: match text("analysis")?.as_str() {
            "plane_stress" => Analysis::PlaneStress { thickness },
            "plane_strain" => Analysis::PlaneStrain { thickness },
            other => return Err(unknown("analysis", other)),
        },
        bodies: read_strings(&group.dataset("bodies")?)?,
        reason: Reason::named(&reason).ok_or_else(|| unknown("reason", &reason))?,
        alternations: group.attr("alternations")?.read_scalar()?,
        tolerance: group.attr("tolerance")?.read_scalar()?,
        steps: None,
        rigid: Vec::new(),
    })
}
