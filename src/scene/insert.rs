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

#[cfg(test)]
mod tests {
    use super::super::{cut_mesh, mesh_of};
    use super::*;
    use crate::mesh::{MeshPart, partition, refine};

    /// The only body of a case: `mesh` and `inserts`, made of steel.
    fn body(directory: &std::path::Path, mesh: &str, inserts: &str) -> BodyCase {
        let text = format!(
            "analysis = \"plane stress\"\n[material]\nsteel = {{ young = 2e11, poisson = 0.3 }}\n\
             soft = {{ young = 1e9, poisson = 0.3 }}\n[[body]]\nname = \"a\"\nmaterial = \"steel\"\n{mesh}\n{inserts}"
        );
        let file = directory.join("case.toml");
        std::fs::write(&file, text).unwrap();
        crate::case::read(&file, None, &[]).unwrap().bodies.remove(0)
    }

    /// Four by two cells on (0, 4) x (0, 2).
    fn plate(element: &str, inserts: &str) -> BodyCase {
        let directory = tempfile::tempdir().unwrap();
        let mesh = format!(
            "element = \"{element}\"\nmesh.rectangle.x = {{ from = 0, to = 4, cells = 4 }}\n\
             mesh.rectangle.y = {{ from = 0, to = 2, cells = 2 }}"
        );
        body(directory.path(), &mesh, inserts)
    }

    /// Area of the cells of a material.
    fn area(mesh: &Mesh, material: u8) -> f64 {
        let cells = mesh.cells.iter().filter(|cell| cell.material == material);
        let twice = |cell: &Cell| {
            let n = cell.kind.n_corners();
            let p = |i: usize| mesh.points[cell.nodes()[i % n] as usize];
            (0..n).map(|i| p(i)[0] * p(i + 1)[1] - p(i)[1] * p(i + 1)[0]).sum::<f64>()
        };
        cells.map(|cell| 0.5 * twice(cell)).sum()
    }

    const RIGHT: &str = "[[body.insert]]\nmaterial = \"soft\"\nwithin.x = [2, 9]\n";
    const TOP: &str = "[[body.insert]]\nmaterial = \"soft\"\nwithin = { x = [1, 3], y = [1, 2] }\n";

    #[test]
    fn boxes_hold_cells_and_the_later_one_counts() {
        for element in ["tri3", "tri6", "quad4", "quad8"] {
            let areas = |inserts: &str| {
                let mesh = mesh_of(&plate(element, inserts)).unwrap();
                [0, 1, 2].map(|material| area(&mesh, material))
            };
            assert_eq!(areas(""), [8.0, 0.0, 0.0], "{element}");
            assert_eq!(areas(RIGHT), [4.0, 4.0, 0.0], "{element}");
            assert_eq!(areas(&format!("{RIGHT}{TOP}")), [3.0, 3.0, 2.0], "{element}");
            assert_eq!(areas(&format!("{TOP}{RIGHT}")), [3.0, 1.0, 4.0], "{element}");
        }
    }

    #[test]
    fn children_and_parts_are_of_the_material_of_their_cell() {
        for element in ["tri3", "tri6", "quad4", "quad8"] {
            let mut body = plate(element, &format!("{RIGHT}{TOP}"));
            let coarse = mesh_of(&body).unwrap();
            let all = refine(&coarse, &vec![true; coarse.cells.len()]);
            body.cuts = vec![vec![0, 3, 5], vec![1, 2, 7]];
            let cut = cut_mesh(&body).unwrap();
            for mesh in [&all, &cut] {
                assert!(mesh.cells.len() > coarse.cells.len());
                let areas = [0, 1, 2].map(|material| area(mesh, material));
                assert_eq!(areas, [3.0, 3.0, 2.0], "{element}");
                let owner = partition(mesh, 3).unwrap();
                for rank in 0..3 {
                    let part = MeshPart::new(mesh, &owner, rank, 3);
                    for (cell, &old) in std::iter::zip(&part.cells, &part.original_cells) {
                        assert_eq!(cell.material, mesh.cells[old as usize].material, "{element}");
                    }
                }
            }
            let mut twice = coarse.clone();
            twice.append(&coarse);
            assert_eq!([0, 1, 2].map(|material| area(&twice, material)), [6.0, 6.0, 4.0], "{element}");
        }
    }

    #[test]
    fn an_empty_box_is_refused() {
        let insert = "[[body.insert]]\nmaterial = \"soft\"\nwithin.y = [1.9, 2]\n";
        let error = mesh_of(&plate("quad4", insert)).unwrap_err().to_string();
        let expected = "body.a.insert.0: within: no cell has its centre in this box; the body lies in x = [0, 4], y = [0, 2]";
        assert!(error.contains(expected), "{error}");
    }

    /// Two squares of one mesh file, the second in two triangles, the upper of which is in a group of its own, too.
    const SQUARES: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"left\"\n2 2 \"right\"\n2 3 \"corner\"\n\
        $EndPhysicalNames\n$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 2 0 0\n6 2 1 0\n$EndNodes\n$Elements\n4\n\
        1 3 2 1 1 1 2 3 4\n2 2 2 2 2 2 5 6\n3 2 2 2 2 2 6 3\n4 2 2 3 2 2 6 3\n$EndElements\n";

    #[test]
    fn groups_of_a_mesh_file_are_inserts() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("m.msh"), SQUARES).unwrap();
        let group = |name: &str| format!("[[body.insert]]\nmaterial = \"soft\"\ngroup = \"{name}\"\n");
        let areas = |keys: &str, inserts: &str| {
            let mesh =
                mesh_of(&body(directory.path(), &format!("mesh = {{ file = \"m.msh\"{keys} }}"), inserts));
            mesh.map(|mesh| [0, 1, 2].map(|material| area(&mesh, material))).map_err(|e| e.to_string())
        };
        let both = group("right") + &group("corner");
        for keys in ["", ", group = [\"left\", \"right\"]", ", refine = 2"] {
            assert_eq!(areas(keys, &group("right")).unwrap(), [1.0, 1.0, 0.0], "{keys}");
            assert_eq!(areas(keys, &both).unwrap(), [1.0, 0.5, 0.5], "{keys}");
            assert_eq!(areas(keys, &(group("corner") + &group("right"))).unwrap(), [1.0, 0.0, 1.0], "{keys}");
        }
        assert_eq!(areas(", group = \"right\"", &group("corner")).unwrap(), [0.5, 0.5, 0.0]);
        let error = areas(", group = \"left\"", &group("right")).unwrap_err();
        let expected =
            "body.a.insert.0: group: \"right\" has no cell of this body; its cells are in \"left\"";
        assert!(error.contains(expected) && error.contains("lists them all in 'mesh.group'"), "{error}");
        let error = areas("", &group("rihgt")).unwrap_err();
        assert!(error.contains("did you mean \"right\"?"), "{error}");
    }
}
