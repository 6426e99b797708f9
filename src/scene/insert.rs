//! Which cells of a body are of which material.
use crate::{
    case::{BodyCase, Insert, InsertCells},
    error::{Error, Result},
    mesh::{Cell, Mesh},
    vector::{in_figures, larger, least},
};

/// Tells each cell its material. Of two inserts that have a cell in common the later one has it.
pub(super) fn mark(mesh: &mut Mesh, body: &BodyCase) -> Result<()> {
    for (i, insert) in body.inserts.iter().enumerate() {
        let material =
            u8::try_from(i + 1).map_err(|_| insert.origin.error("a body has at most 255 inserts"))?;
        for cell in cells_of(mesh, insert)? {
            mesh.cells[cell].material = material;
        }
    }
    Ok(())
}

/// The cells of an insert: at least one.
fn cells_of(mesh: &Mesh, insert: &Insert) -> Result<Vec<usize>> {
    match &insert.cells {
        InsertCells::Group(name) => match mesh.groups.get(name) {
            Some(cells) => Ok(cells.iter().map(|&cell| cell as usize).collect()),
            None => Err(unknown_group(mesh, insert, name)),
        },
        InsertCells::Within([low, high]) => {
            let inside = |cell: &usize| {
                let center = center(mesh, &mesh.cells[*cell]);
                (0..3).all(|d| low[d] <= center[d] && center[d] <= high[d])
            };
            let cells: Vec<usize> = (0..mesh.cells.len()).filter(inside).collect();
            match cells.is_empty() {
                true => Err(empty_box(mesh, insert)),
                false => Ok(cells),
            }
        }
    }
}

/// Mean of a cell's corners, m.
fn center(mesh: &Mesh, cell: &Cell) -> [f64; 3] {
    let corners = &cell.nodes()[..cell.kind.n_corners()];
    std::array::from_fn(|d| {
        corners.iter().map(|&node| mesh.points[node as usize][d]).sum::<f64>() / corners.len() as f64
    })
}

fn unknown_group(mesh: &Mesh, insert: &Insert, name: &str) -> Error {
    let names: Vec<String> = mesh.groups.keys().map(|name| format!("{name:?}")).collect();
    let known = match names.is_empty() {
        true => "its cells are in no physical group".to_string(),
        false => format!("its cells are in {}", names.join(", ")),
    };
    let near = mesh.groups.keys().find(|known| strsim::jaro_winkler(known, name) > 0.8);
    let hint = near.map_or(String::new(), |near| format!("; did you mean {near:?}?"));
    insert.origin.error(format!(
        "group: {name:?} has no cell of this body; {known}{hint} (a body of several groups lists them all in 'mesh.group')"
    ))
}

fn empty_box(mesh: &Mesh, insert: &Insert) -> Error {
    let range = |d: usize| {
        let all = || mesh.points.iter().map(|p| p[d]);
        let ends = [least(all()), all().fold(f64::NEG_INFINITY, larger)];
        ends.map(in_figures).join(", ")
    };
    insert.origin.error(format!(
        "within: no cell has its centre in this box; the body lies in x = [{}], y = [{}], and its cells may be larger than the box",
        range(0),
        range(1)
    ))
}
