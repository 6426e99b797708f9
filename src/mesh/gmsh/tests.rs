use super::*;
use crate::element::ElementKind;
use crate::mesh::testing::*;
use std::f64::consts::PI;
use std::path::PathBuf;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn load(name: &str, group: Option<&str>) -> Result<Mesh> {
    read(&data(name), group.as_slice(), 1.0)
}

fn message(text: &str, group: Option<&str>) -> String {
    let raw = parse("m.msh", text.as_bytes());
    raw.and_then(|raw| body::select("m.msh", &raw, group.as_slice(), 1.0)).unwrap_err().to_string()
}

/// Every shipped variant of one mesh.
fn variants(kind: &str) -> Vec<String> {
    let versions = ["2.2", "4.1"];
    versions.iter().flat_map(|v| ["ascii", "binary"].map(|b| format!("{kind}-{v}-{b}.msh"))).collect()
}

#[test]
fn all_formats_give_the_same_plate() {
    let kinds = [
        ("tri1", ElementKind::Tri3),
        ("tri2", ElementKind::Tri6),
        ("quad1", ElementKind::Quad4),
        ("quad2", ElementKind::Quad8),
    ];
    for (name, kind) in kinds {
        let area_exact = 4.0 - 0.25 * 0.25 * PI;
        let mut sizes = Vec::new();
        for file in variants(name) {
            let mesh = load(&file, Some("plate")).unwrap();
            assert!(mesh.cells.iter().all(|c| c.kind == kind), "{file}");
            assert_eq!(mesh.surfaces.keys().collect::<Vec<_>>(), ["ends", "group 14", "notch", "plate top"]);
            assert_eq!(euler(&mesh), 1);
            let tolerance = if kind.n_nodes() > kind.n_corners() { 2e-4 } else { 2.5e-2 };
            assert!((area(&mesh) - area_exact).abs() < tolerance, "{file}: {}", area(&mesh));
            let lengths = [("ends", 1.0), ("group 14", 3.5), ("notch", 0.25 * PI), ("plate top", 4.0)];
            for (surface, length) in lengths {
                let found = surface_length(&mesh, surface);
                assert!((found - length).abs() < 2.5e-2, "{file}: {surface} {found}");
            }
            for facet in &mesh.surfaces["plate top"] {
                let normal = facet_length(&mesh, *facet).1;
                assert!(normal[1] > 0.0 && normal[0].abs() < 1e-12, "normals point out of the body");
            }
            sizes.push((mesh.points, mesh.cells, mesh.surfaces));
        }
        for other in &sizes[1..] {
            assert_eq!(other.1, sizes[0].1, "{name}");
            assert_eq!(other.2, sizes[0].2, "{name}");
            for (p, q) in other.0.iter().zip(&sizes[0].0) {
                // ASCII files have 16 digits.
                assert!((p[0] - q[0]).abs() < 1e-15 && (p[1] - q[1]).abs() < 1e-15);
            }
        }
    }
}

#[test]
fn bodies_are_chosen_by_name_and_scaled() {
    let block = read(&data("quad2-4.1-binary.msh"), &["block"], 1e-3).unwrap();
    assert!((area(&block) - 2e-6).abs() < 1e-18);
    assert_eq!(block.surfaces.keys().collect::<Vec<_>>(), ["block bottom", "ends"]);
    assert!((surface_length(&block, "ends") - 0.5e-3).abs() < 1e-15);
    let both = load("quad2-4.1-binary.msh", None).unwrap();
    assert_eq!(crate::mesh::components(&both).1, 2);
    assert!((surface_length(&both, "ends") - 1.5).abs() < 1e-12);
    let error = load("quad2-4.1-binary.msh", Some("plat")).unwrap_err().to_string();
    assert!(error.contains("did you mean \"plate\"?") && error.contains("\"block\""), "{error}");
}

#[test]
fn what_is_not_read_says_what_to_do() {
    let error = load("quad9.msh", None).unwrap_err().to_string();
    assert!(error.contains("Mesh.SecondOrderIncomplete = 1") && error.contains("line"), "{error}");
    let error = load("solid.msh", None).unwrap_err().to_string();
    assert!(error.contains("three-dimensional"), "{error}");
    let error = load("absent.msh", None).unwrap_err().to_string();
    assert!(error.contains("absent.msh: cannot read"), "{error}");
}

const HEAD: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 \
0\n5 2 0 0\n6 2 1 0\n$EndNodes\n";

fn with_elements(elements: &[&str]) -> String {
    format!("{HEAD}$Elements\n{}\n{}\n$EndElements\n", elements.len(), elements.join("\n"))
}

#[test]
fn clockwise_cells_are_turned_round() {
    let text = with_elements(&["1 3 2 1 1 1 4 3 2", "2 2 2 1 1 2 5 3", "3 2 2 1 1 3 6 5"]);
    let raw = parse("m.msh", text.as_bytes()).unwrap();
    let mesh = body::select("m.msh", &raw, &["group 1"], 1.0).unwrap();
    assert!((0..3).all(|c| cell_area(&mesh, c) > 0.0));
    assert!((area(&mesh) - 2.0).abs() < 1e-15);
}

#[test]
fn wrong_cells_and_surfaces_are_refused() {
    let square = "1 3 2 1 1 1 2 3 4";
    let cases: &[(&[&str], &str)] = &[
        (&["1 3 2 1 1 1 2 4 3"], "element 1 near (0, 0) is tangled"),
        (&["7 2 2 1 1 1 2 5"], "element 7 near (0, 0) has no area"),
        (&["1 3 2 1 1 1 2 2 4"], "a node twice"),
        (&["1 2 2 1 1 1 2 9"], "node 9, which is not in $Nodes"),
        (&[square, "2 3 2 1 1 2 3 4 1"], "elements 1 and 2 have the same nodes"),
        (
            &[square, "2 3 2 1 1 2 5 6 3", "3 1 2 4 4 2 3"],
            "surface \"group 4\": line 3 at (1, 0) lies inside the body",
        ),
        (&["3 1 2 4 4 2 3"], "no triangles or quadrilaterals"),
        (&[square, "2 2 2 1 1 2 5 3", "3 2 2 1 1 2 6 3"], "more than two cells share a side"),
    ];
    for (elements, part) in cases {
        let error = message(&with_elements(elements), None);
        assert!(error.contains(part) && error.starts_with("m.msh"), "{error}");
    }
    let missing = message(&with_elements(&["1 3 2 0 1 1 2 3 4"]), Some("plate"));
    assert!(missing.contains("no physical group of dimension 2"), "{missing}");
    let bent = with_elements(&[square]).replace("3 1 1 0\n", "3 1 1 0.5\n");
    assert!(message(&bent, None).contains("plane z = 0"));
}

#[test]
fn a_mesh_in_another_plane_is_told_where_it_lies() {
    let square = ["1 3 2 1 1 1 2 3 4"];
    let with_nodes = |turn: fn([f64; 2]) -> [f64; 3]| {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let nodes = corners.map(turn).into_iter().enumerate();
        let nodes: String = nodes.map(|(i, p)| format!("{} {} {} {}\n", i + 1, p[0], p[1], p[2])).collect();
        let (head, _) = HEAD.split_once("$Nodes\n").unwrap();
        let elements = with_elements(&square).replace(HEAD, "");
        format!("{head}$Nodes\n4\n{nodes}$EndNodes\n{elements}")
    };
    for (turn, part) in [
        ((|p| [p[0], 0.0, p[1]]) as fn([f64; 2]) -> [f64; 3], "lies in the x-z plane (y = 0 everywhere)"),
        (|p| [p[0], -2.0, p[1]], "lies in the x-z plane (y = -2 everywhere)"),
        (|p| [0.5, p[0], p[1]], "lies in the y-z plane (x = 0.5 everywhere)"),
        (|p| [p[0], p[1], 0.25], "lies in the plane z = 0.25; it must lie in the plane z = 0: move it"),
        (|p| [p[0], p[1], p[1]], "must lie in the plane z = 0, but there is a node at (1, 1, 1)"),
    ] {
        let error = message(&with_nodes(turn), None);
        assert!(error.contains(part) && !error.contains("mesh again"), "{error}");
    }
    let raw = parse("m.msh", with_nodes(|p| [p[0] + 1e3, p[1], 1e-12]).as_bytes()).unwrap();
    assert!(body::select("m.msh", &raw, &[], 1.0).is_ok());
}

#[test]
fn names_that_mean_two_groups_are_refused() {
    let elements = ["1 3 2 1 1 1 2 3 4", "2 2 2 2 2 2 5 3", "3 1 2 7 7 1 2", "4 1 2 8 8 3 4"];
    let named = |names: &str| {
        let count = names.lines().count();
        with_elements(&elements)
            .replace("$Nodes\n6", &format!("$PhysicalNames\n{count}\n{names}$EndPhysicalNames\n$Nodes\n6"))
    };
    let error = message(&named("2 1 \"plate\"\n2 2 \"plate\"\n"), Some("plate"));
    assert!(error.contains("groups 1 and 2 of dimension 2 are all called \"plate\""), "{error}");
    let error = message(&named("1 7 \"edge\"\n1 8 \"edge\"\n"), None);
    assert!(error.contains("groups 7 and 8 of dimension 1"), "{error}");
    let error = message(&named("1 7 \"group 8\"\n"), None);
    assert!(error.contains("groups 7 and 8 of dimension 1"), "{error}");
    // A body and a surface may share a name, and so may surfaces of different bodies.
    let text = named("2 1 \"a\"\n1 7 \"a\"\n1 8 \"a\"\n").replace("4 1 2 8 8 3 4", "4 1 2 8 8 2 5");
    let raw = parse("m.msh", text.as_bytes()).unwrap();
    let mesh = body::select("m.msh", &raw, &["a"], 1.0).unwrap();
    assert_eq!(mesh.surfaces["a"].len(), 1);
    let parametric = with_elements(&elements).replace("Nodes", "ParametricNodes");
    let error = message(&parametric, None);
    assert!(error.contains("Mesh.SaveParametric = 0") && error.contains("$ParametricNodes"), "{error}");
}

#[test]
fn an_element_of_two_groups_is_one_cell() {
    let text = with_elements(&["1 3 2 1 1 1 2 3 4", "2 3 2 2 1 1 2 3 4", "3 1 2 5 1 1 2"]);
    let raw = parse("m.msh", text.as_bytes()).unwrap();
    for group in [None, Some("group 1"), Some("group 2")] {
        let mesh = body::select("m.msh", &raw, group.as_slice(), 1.0).unwrap();
        assert_eq!((mesh.cells.len(), mesh.surfaces["group 5"].len()), (1, 1));
    }
}

#[test]
fn errors_name_file_line_and_section() {
    let text = with_elements(&["1 3 2 1 1 1 2 3 4"]).replace("4 0 1 0\n", "4 0 one 0\n");
    let error = message(&text, None);
    assert_eq!(error, "m.msh: line 9 in $Nodes: expected a real number, found \"one\"");
    let error = message(&text.replace("2.2 0", "3.0 0"), None);
    assert!(error.contains("format 3.0 is not read"), "{error}");
    assert!(message("hello", None).contains("line 1: expected the start of a section"));
    assert!(message("", None).contains("not a Gmsh file"));
    let big = b"$MeshFormat\n4.1 1 8\n\x00\x00\x00\x01\n$EndMeshFormat\n";
    assert!(parse("m.msh", big).unwrap_err().to_string().contains("big-endian"));
}

#[test]
fn truncated_and_garbled_files_are_errors_not_panics() {
    let mut state = 1u32;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 8
    };
    for file in ["quad1", "tri2"].iter().flat_map(|kind| variants(kind)) {
        let bytes = std::fs::read(data(&file)).unwrap();
        let try_read =
            |bytes: &[u8]| parse("m", bytes).and_then(|raw| body::select("m", &raw, &["plate"], 1.0));
        assert!(try_read(&bytes).is_ok());
        let end = bytes.len() - "$EndElements\n".len();
        for length in (0..end).step_by(61) {
            assert!(try_read(&bytes[..length]).is_err(), "{file} cut at {length}");
        }
        for _ in 0..200 {
            let mut bytes = bytes.clone();
            for _ in 0..=random() % 3 {
                let at = random() as usize % bytes.len();
                bytes[at] ^= 1 << (random() % 8);
            }
            // Whatever comes out: no panic, no endless loop, and no cell turned inside out.
            if let Ok(mesh) = try_read(&bytes) {
                assert!(
                    mesh.cells.iter().all(|c| c.nodes().iter().all(|&n| (n as usize) < mesh.points.len()))
                );
            }
        }
    }
}

/// Two squares side by side; format 2.2 repeats the second for the group that it is in, too.
#[test]
fn a_body_of_several_groups_knows_which_cells_each_has() {
    let text = with_elements(&["1 3 2 1 1 1 2 3 4", "2 3 2 2 2 2 5 6 3", "3 3 2 3 2 2 5 6 3"]);
    let raw = parse("m.msh", text.as_bytes()).unwrap();
    let groups =
        |names: &[&str]| body::select("m.msh", &raw, names, 1.0).map(|mesh| (mesh.points.len(), mesh.groups));
    let cells = |list: &[(&str, u32)]| -> BTreeMap<String, Vec<u32>> {
        list.iter().map(|(name, cell)| (name.to_string(), vec![*cell])).collect()
    };
    let whole = cells(&[("group 1", 0), ("group 2", 1), ("group 3", 1)]);
    assert_eq!(groups(&[]).unwrap(), (6, whole.clone()));
    assert_eq!(groups(&["group 2", "group 1"]).unwrap(), (6, whole));
    assert_eq!(groups(&["group 3"]).unwrap(), (4, cells(&[("group 2", 0), ("group 3", 0)])));
    let error = groups(&["group 1", "grup 2"]).unwrap_err().to_string();
    assert!(error.contains("is named \"grup 2\"; there are") && error.contains("did you mean"), "{error}");
}
