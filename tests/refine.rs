//! The key `mesh.refine`: finer meshes of the same body, generated or from a file.
use kontakt::{
    body::Constraints,
    case::{self, Case},
    element::ElementKind,
    mesh::{Locator, Mesh},
    scene::build_mesh,
};
use std::path::{Path, PathBuf};

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn read(case: &str, sets: &[String]) -> Case {
    case::read(&root(case), None, sets).unwrap_or_else(|e| panic!("{case}: {e}"))
}

/// One body from a Gmsh file of the test data, `refine` times finer.
fn from_file(file: &str, refine: &str) -> Result<Mesh, String> {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("f.toml");
    let text = format!(
        "analysis = \"plane stress\"\n[material.a]\nyoung = 1\npoisson = 0.3\n[[body]]\nname = \"b\"\nmaterial = \"a\"\n\
         mesh = {{ file = {:?}, group = \"plate\", refine = {refine} }}\n",
        root("tests/data").join(file)
    );
    std::fs::write(&path, text).expect("a temporary file");
    let case = case::read(&path, None, &[]).map_err(|e| e.to_string())?;
    build_mesh(&case.bodies[0].geometry).map_err(|e| e.to_string())
}

#[test]
fn generated_bodies_have_four_times_the_cells_and_keep_nodes_supports_and_probes() {
    for case in ["cases/hertz-line", "cases/press-fit", "cases/heated-rectangles"] {
        let names: Vec<String> = read(case, &[]).bodies.into_iter().map(|b| b.name).collect();
        for element in ["tri3", "tri6", "quad4", "quad8"] {
            let at = |level: usize| {
                let set = |name: &String| {
                    [format!("body.{name}.mesh.refine={level}"), format!("body.{name}.element={element}")]
                };
                read(case, &names.iter().flat_map(set).collect::<Vec<_>>())
            };
            let (coarse, fine) = (at(0), at(2));
            for (b, body) in fine.bodies.iter().enumerate() {
                let before = build_mesh(&coarse.bodies[b].geometry).expect("a mesh");
                let mesh = build_mesh(&body.geometry).unwrap_or_else(|e| panic!("{case} {element}: {e}"));
                assert_eq!(mesh.cells.len(), 16 * before.cells.len());
                assert!(mesh.hanging.is_empty());
                for (name, facets) in &before.surfaces {
                    assert_eq!(mesh.surfaces[name].len(), 4 * facets.len(), "{name}");
                }
                // By point, too: a node of the coarse mesh is one of the fine mesh.
                let supports =
                    Constraints::new(body, &mesh).unwrap_or_else(|e| panic!("{case} {element}: {e}"));
                assert!(body.supports.is_empty() || !supports.0.is_empty());
                let locator = Locator::new(&mesh.points, &mesh.cells);
                for probe in fine.probes.iter().filter(|p| p.body == b) {
                    assert!(locator.find(&probe.at).is_some(), "{case}: probe {}", probe.name);
                }
            }
        }
    }
}

#[test]
fn meshes_from_files_too_every_kind() {
    for (file, kind) in [
        ("tri1-4.1-ascii.msh", ElementKind::Tri3),
        ("tri2-4.1-ascii.msh", ElementKind::Tri6),
        ("quad1-4.1-ascii.msh", ElementKind::Quad4),
        ("quad2-4.1-ascii.msh", ElementKind::Quad8),
    ] {
        let (coarse, fine) = (from_file(file, "0").unwrap(), from_file(file, "2").unwrap());
        assert!(coarse.curves.is_empty(), "nothing is made that was not asked for");
        assert_eq!(fine.cells.len(), 16 * coarse.cells.len());
        assert!(fine.cells.iter().all(|cell| cell.kind == kind || cell.kind.n_corners() != kind.n_corners()));
        assert!(!coarse.surfaces.is_empty());
        for (name, facets) in &coarse.surfaces {
            assert_eq!(fine.surfaces[name].len(), 4 * facets.len(), "{file}: {name}");
        }
        assert_eq!(fine.points[..coarse.points.len()], coarse.points[..], "nodes keep their places");
    }
}

#[test]
fn a_wrong_count_is_refused_with_what_was_given() {
    for (value, rule) in [
        ("-1", "from 0 to 16"),
        ("17", "from 0 to 16"),
        ("1.5", "an integer, 0 or more"),
        ("\"2\"", "an integer, 0 or more"),
    ] {
        let error = from_file("tri1-4.1-ascii.msh", value).unwrap_err();
        assert!(
            error.contains(rule) && error.contains("refine") && error.contains(value.trim_matches('"')),
            "{error}"
        );
    }
    let error =
        case::read(&root("cases/hertz-line"), None, &["body.upper.mesh.refine=16".into()]).unwrap_err();
    assert!(error.to_string().contains("cells in one direction"), "{error}");
    let error = case::read(&root("cases/hertz-line"), None, &["body.upper.mesh.refin=1".into()]).unwrap_err();
    assert!(error.to_string().contains("refine"), "{error}");
}
