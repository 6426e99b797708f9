//! Reads a case: the file, then the variant, then `--set`; then the whole, checked.
use std::path::{Path, PathBuf};

use super::contact::{self, NamedBody, refuse_duplicates};
use super::material::Materials;
use super::node::{Node, Value};
use super::path::Paths;
use super::reader::{Fields, Reader, all};
use super::{Analysis, BodyCase, BodyRef, Case, RigidCase, Units};
use super::{
    alternation, body, edit, exact, fingerprint, material, nearest, path, plasticity, rigid, step, study,
};
use crate::error::{Error, Result};

/// Reads a case file, or the `case.toml` of a directory, with one of its variants and `--set` changes
/// (`body.lower.temperature=400`). All errors of the file are reported together, one on each line.
pub fn read(path: &Path, variant: Option<&str>, sets: &[String]) -> Result<Case> {
    let file = if path.is_dir() { path.join("case.toml") } else { path.to_path_buf() };
    let shown = file.display().to_string();
    let text =
        std::fs::read_to_string(&file).map_err(|e| Error::Input(format!("{shown}: cannot be read: {e}")))?;
    let mut root = Node::parse(&text, &shown)?;
    let mut changes = Vec::new();
    if let Some(name) = variant {
        changes.push(format!("variant {name}"));
        changes.extend(apply_variant(&mut root, name)?);
    }
    for argument in sets {
        edit::set_from_command_line(&mut root, argument)?;
        changes.push(format!("--set {argument}"));
    }
    let directory = file.parent().unwrap_or(Path::new("")).to_path_buf();
    let reader = Reader::new(units(&root), directory);
    let case = read_tree(&reader, &root);
    let case = case.map(|case| Case { name: name(&file), variant: variant.map(str::to_string), ..case });
    let title = variant.and_then(|name| variant_named(&root, name)).and_then(|v| v.get("title")?.text());
    let case = case.map(|case| {
        let own = root.get("title").and_then(Node::text).unwrap_or(&case.name);
        Case { title: crate::plain_text(title.unwrap_or(own)), ..case }
    });
    let fingerprint = fingerprint::of(&root, &reader.directory);
    reader.finish(case.map(|case| Case { text: with_changes(&text, &changes), fingerprint, ..case }))
}

/// Name of a case: its directory for a `case.toml`, else the file's stem.
fn name(file: &Path) -> String {
    let directory = |file: &Path| -> Option<String> {
        let directory = file.canonicalize().ok()?.parent()?.file_name()?.to_string_lossy().into_owned();
        Some(directory)
    };
    let stem = || file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let name = if file.file_name().is_some_and(|f| f == "case.toml") {
        directory(file).or_else(stem)
    } else {
        stem()
    };
    name.unwrap_or_else(|| "case".into())
}

fn with_changes(text: &str, changes: &[String]) -> String {
    let mut text = text.to_string();
    if !text.ends_with('\n') {
        text.push('\n');
    }
    for change in changes {
        text.push_str(&format!("# {}\n", change.replace('\n', " ")));
    }
    text
}

/// The units, before anything else is read; a wrong value is refused later, with the other errors.
fn units(root: &Node) -> Units {
    match root.get("units").and_then(Node::text) {
        Some("consistent") => Units::Consistent,
        _ => Units::Si,
    }
}

fn variants(root: &Node) -> &[Node] {
    match root.get("variant").map(|node| &node.value) {
        Some(Value::Array(items)) => items,
        _ => &[],
    }
}

fn variant_named<'a>(root: &'a Node, name: &str) -> Option<&'a Node> {
    variants(root).iter().find(|node| node.get("name").and_then(Node::text) == Some(name))
}

/// Applies the removals and settings of a variant; returns them as text.
fn apply_variant(root: &mut Node, name: &str) -> Result<Vec<String>> {
    let Some(variant) = variant_named(root, name).cloned() else {
        let names: Vec<&str> = variants(root).iter().filter_map(|node| node.get("name")?.text()).collect();
        let hint = match names.is_empty() {
            true => "the case has no [[variant]]".to_string(),
            false => nearest::hint(name, &names).trim_end().to_string(),
        };
        return Err(Error::Input(format!("{}: there is no variant '{name}'; {hint}", root.place.file)));
    };
    let mut changes = Vec::new();
    if let Some(Value::Array(paths)) = variant.get("remove").map(|node| &node.value) {
        for (path, node) in paths.iter().filter_map(|node| Some((node.text()?, node))) {
            edit::remove(root, path, &node.place)?;
            changes.push(format!("remove {path}"));
        }
    }
    for (path, node) in variant.get("set").and_then(Node::entries).unwrap_or_default() {
        edit::set(root, path, node.clone())?;
        changes.push(format!("set {path} = {node}"));
    }
    Ok(changes)
}

fn read_tree(reader: &Reader, root: &Node) -> Option<Case> {
    let fields = reader.open("case", root, "")?;
    fields.line("title");
    fields.choice("units");
    read_variants(&fields);
    let analysis = analysis(&fields);
    let materials = material::read_all(&fields);
    let tables = fields.tables("body");
    if fields.has("body") && tables.is_empty() {
        fields.error_at("body", "at least one body is needed");
    }
    refuse_duplicates(&tables, "bodies");
    let alternation = alternation::read(&fields);
    let paths = Paths::named_in(root);
    let bodies = read_bodies(&tables, &materials, &paths);
    let named = &bodies.named;
    if !tables.is_empty() && bodies.deformable.is_empty() {
        fields.error_at("body", "all bodies are rigid; at least one deformable body is needed");
    }
    let plasticity = plasticity::read(&fields, bodies.deformable.iter().flatten());
    let contacts = fields.tables("contact");
    refuse_duplicates(&contacts, "contacts");
    let contacts = all(contacts.iter().map(|table| contact::read(table, named, alternation.as_ref())));
    let steps = fields.tables("step");
    refuse_duplicates(&steps, "steps");
    let path_cases = path::read_all(&fields, &paths);
    let steps = step::read_all(&steps, &paths, &path_cases, fields.has("path"));
    let probes = fields.tables("probe");
    refuse_duplicates(&probes, "probes");
    let probes = all(probes.iter().map(|table| contact::probe(table, named)));
    let yields = bodies.deformable.iter().any(|body| body.as_ref().is_none_or(BodyCase::yields));
    let output = contact::output(&fields, yields);
    let meshed: Vec<&str> =
        named.iter().filter(|b| matches!(b.body, BodyRef::Deformable(_))).map(|b| b.name).collect();
    let study = study::read(&fields, &meshed, contacts.as_deref(), probes.as_deref());
    let exact = exact::read(&fields, contacts.as_deref(), probes.as_deref());
    Some(Case {
        name: String::new(),
        title: String::new(),
        variant: None,
        text: String::new(),
        units: reader.units,
        analysis: analysis?,
        bodies: all(bodies.deformable.into_iter())?,
        rigid: all(bodies.rigid.into_iter())?,
        contacts: contacts?,
        alternation: alternation?,
        paths: path_cases,
        steps: steps?,
        probes: probes?,
        output,
        plasticity,
        study,
        exact,
        fingerprint: 0,
    })
}

/// The bodies as read, `None` where something is wrong with one.
struct Bodies<'a> {
    /// All of them, in file order.
    named: Vec<NamedBody<'a>>,
    deformable: Vec<Option<BodyCase>>,
    /// Those with the key `rigid`.
    rigid: Vec<Option<RigidCase>>,
}

fn read_bodies<'a>(tables: &[Fields<'a>], materials: &Materials<'_>, paths: &Paths) -> Bodies<'a> {
    let mut bodies = Bodies { named: Vec::new(), deformable: Vec::new(), rigid: Vec::new() };
    for table in tables {
        let (body, surfaces) = if table.has("rigid") {
            bodies.rigid.push(rigid::read(table, paths));
            (BodyRef::Rigid(bodies.rigid.len() - 1), Some(rigid::SURFACES))
        } else {
            let read = body::read(table, materials, paths);
            let surfaces = read.as_ref().and_then(|body| body::generated_surfaces(&body.geometry));
            bodies.deformable.push(read);
            (BodyRef::Deformable(bodies.deformable.len() - 1), surfaces)
        };
        bodies.named.push(NamedBody { name: label(table), body, surfaces, heated: table.has("temperature") });
    }
    bodies
}

/// The name of a table as written, good or not.
fn label<'a>(fields: &Fields<'a>) -> &'a str {
    fields.node.get("name").and_then(Node::text).unwrap_or("")
}

fn analysis(fields: &Fields<'_>) -> Option<Analysis> {
    let thickness = fields.number_if("thickness", |value| value > 0.0, "must be > 0").unwrap_or(1.0);
    match fields.choice("analysis")? {
        0 => Some(Analysis::PlaneStress { thickness }),
        _ => Some(Analysis::PlaneStrain { thickness }),
    }
}

/// Checks the form of every variant; the one that is run was applied before.
fn read_variants(fields: &Fields<'_>) {
    let tables = fields.tables("variant");
    refuse_duplicates(&tables, "variants");
    for table in &tables {
        table.name("name");
        table.line("title");
        table.texts("remove");
        if let Some(set) = table.field("set")
            && set.node.entries().is_none()
        {
            set.wrong::<()>("a table is needed: { \"contact.main.gap\" = 2e-4 }");
        }
    }
}

/// Names and titles of the variants of a case, in file order.
pub fn variant_names(path: &Path) -> Result<Vec<String>> {
    let file: PathBuf = if path.is_dir() { path.join("case.toml") } else { path.to_path_buf() };
    let shown = file.display().to_string();
    let text =
        std::fs::read_to_string(&file).map_err(|e| Error::Input(format!("{shown}: cannot be read: {e}")))?;
    let root = Node::parse(&text, &shown)?;
    Ok(variants(&root).iter().filter_map(|node| Some(node.get("name")?.text()?.to_string())).collect())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::schema::TABLES;
    use super::super::{
        ContactGeometry, Driver, PlasticityCase, Property, ResponseCase, RigidShape, Transfer, Weights,
        ZoneCase,
    };
    use super::*;
    use crate::material::{Hardening, Kinematic, Plasticity};

    /// Cases that between them have every table of the schema.
    const EVERYTHING: [&str; 4] = [
        r#"analysis = "plane stress"
[material.a]
young = { temperature = [293, 373], value = [1, 2] }
poisson = 0.3
[alternation]
[output]
field = "equivalent plastic strain"
[study]
[exact]
probe.p = { x = 0, y = 0 }
hertz_line = { radius = [1], force = 1 }
[plasticity]
[material.a.plasticity]
yield_stress = 1
kinematic = { modulus = 1 }
[material.b]
young = 1
poisson = 0
plasticity.curve = { plastic_strain = [0, 1], stress = [1, 1] }
[material.c]
young = 1
poisson = 0
plasticity.curves = [{ temperature = 0, plastic_strain = [0, 1], stress = [1, 1] }, { temperature = 1, plastic_strain = [0, 1], stress = [1, 1] }]
[material.d]
young = 1
poisson = 0
plasticity.ramberg_osgood = { yield_stress = 1, exponent = 2 }
[material.e]
young = 1
poisson = 0
plasticity.power = { yield_stress = 1, strain = 1, exponent = 1 }
[[variant]]
name = "v"
[[contact]]
surfaces = ["a.left", "b.right"]
within = { x = [0, 1] }
[[probe]]
name = "p"
body = "a"
at = [0, 0]
[[body]]
name = "a"
material = "a"
mesh.rectangle = { x = { from = 0, to = 1, cells = 1 }, y = { from = 0, to = 1, cells = 1 } }
temperature = { file = "t.csv" }
[[body.insert]]
material = "a"
within.x = [0, 1]
[[body.support]]
surface = "left"
x = 0
[[body.load]]
body_force = [0, 1]
[[body]]
name = "b"
material = { file = "m.toml", name = "a" }
mesh.block = { corners = [[0, 0], [1, 0], [1, 1], [0, 1]], arcs.top = [0.5, 0], u.cells = 1, v.cells = 1 }
"#,
        r#"analysis = "plane stress"
[[body]]
name = "a"
material = { young = 1, poisson = 0 }
mesh.ring = { radius = { from = 1, to = 2, cells = 1 }, angle = { from = 0, to = 90, cells = 1 } }
[[body]]
name = "b"
material = { young = 1, poisson = 0 }
mesh.half_disc.radius = 1
mesh.half_disc.arc = "up"
mesh.half_disc.core = 2
mesh.half_disc.depth = { to = 0.3, cells = 1 }
mesh.half_disc.angle = { from = -30, to = 30, cells = 2 }
"#,
        r#"analysis = "plane stress"
[[body]]
name = "a"
material = { young = 1, poisson = 0, expansion = 0, reference_temperature = 300 }
mesh.disc = { radius = 1, quarter = 2, depth = { to = 0.3, cells = 1 } }
temperature = { value = 300, path = "p" }
[[body]]
name = "b"
material = { young = 1, poisson = 0 }
mesh = { file = "b.msh", group = "b", scale = 1e-3, refine = 1 }
[[body]]
name = "c"
rigid = { plane = { through = [0, 0], normal = [0, 1] }, y = 1, path = "p" }
[[body]]
name = "d"
rigid.circle = { center = [0, 0], radius = 1 }
[[body]]
name = "e"
rigid.polyline = { points = [[0, 0], [1, 0]] }
[path.p]
at = [0, 1]
factor = [0, 1]
[[step]]
at = 1
[exact]
press_fit = { radii = [1, 2, 3], interference = 1e-3 }
[[contact]]
surfaces = ["a.arc", "b.inner"]
"#,
        r#"analysis = "plane stress"
[[body]]
name = "a"
material = { young = 1, poisson = 0 }
mesh.rectangle = { x = { from = 0, to = 1, cells = 1 }, y = { from = 0, to = 1, cells = 1 } }
[[contact]]
surfaces = ["a.top", "b.bottom"]
[[body]]
name = "b"
material = { young = 1, poisson = 0 }
mesh.rectangle = { x = { from = 0, to = 1, cells = 1 }, y = { from = 1, to = 2, cells = 1 } }
[exact]
heated_blocks = { heights = [1, 1], width = 1 }
"#,
    ];

    #[test]
    fn every_key_of_the_schema_is_read_and_every_key_read_is_in_it() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("t.csv"), "x,y,temperature\n0,0,300\n").unwrap();
        std::fs::write(directory.path().join("m.toml"), "[material.a]\nyoung = 1\npoisson = 0\n").unwrap();
        std::fs::write(directory.path().join("b.msh"), "").unwrap();
        let mut asked = BTreeSet::new();
        for text in EVERYTHING {
            let reader = Reader::new(Units::Si, directory.path().to_path_buf());
            let root = Node::parse(text, "f.toml").unwrap();
            let case = read_tree(&reader, &root);
            asked.extend(reader.asked.borrow().iter().copied());
            // A key that is read but not in the schema, or as another type, is an "internal" error here.
            reader.finish(case).unwrap();
        }
        let schema: BTreeSet<_> =
            TABLES.iter().flat_map(|t| t.keys.iter().map(|key| (t.name, key.name))).collect();
        let unread: Vec<_> = schema.difference(&asked).collect();
        assert!(unread.is_empty(), "in the schema, but never read: {unread:?}");
    }

    /// Every key with a type in the schema is also read as that type.
    #[test]
    fn every_key_can_be_given() {
        let all = r#"title = "T"
units = "SI"
analysis = "plane strain"
thickness = "2 mm"
[material.a]
young = "1 GPa"
poisson = 0.3
expansion = { temperature = ["0 degC", "100 degC"], value = ["1e-5 1/K", 2e-5] }
reference_temperature = "20 degC"
[material.a.plasticity]
yield_stress = { temperature = [293, "100 degC"], value = ["300 MPa", 2e8] }
hardening = "1 GPa"
kinematic = { modulus = "2 GPa", recall = 3 }
[plasticity]
theory = "flow"
iteration = "newton"
tolerance = 1e-6
max_iterations = 7
zone = "never"
[alternation]
driver = "relaxed"
transfer = "pointwise"
weights = 0.25
tolerance = 1e-6
max_alternations = 7
[output]
stress = "von Mises"
magnification = 5
window = [[0, 0], [1, "10 mm"]]
[[variant]]
name = "v"
title = "V"
remove = ["contact"]
set = { thickness = 3 }
[[variant]]
name = "active"
remove = ["alternation.weights", "contact.c.conjugate"]
set = { "alternation.driver" = "active set", "alternation.transfer" = "mortar", "contact.c.geometry" = "updated", "body.2" = { name = "r", rigid = { circle = { center = [0, 3], radius = "1 mm", inside = true }, x = 1, y = "-1 mm" } } }
[[step]]
name = "half"
loads = 0.5
supports = -1
temperature = "50 %"
[[contact]]
name = "c"
surfaces = ["a.left", "b.right"]
gap_offset = "-1 um"
search_distance = "1 mm"
conjugate = "intersection"
geometry = "initial"
[[body]]
name = "a"
material = "a"
element = "quad8"
formulation = "standard"
solver = "-ksp_type cg"
response = "solver"
temperature = "300 + 10*x"
mesh.rectangle.x = { at = [0, 1, 3], cells = [2, 4], ratio = [1, 3] }
mesh.rectangle.y = { at = [0, 1], size = [0.1, 0.2] }
mesh.rotate = 30
mesh.translate = ["1 mm", 0]
[[body.support]]
surface = "left"
within = { x = [0, 1], y = [0, "2 mm"] }
x = "1e-3*y"
y = "-1 um"
angle = 30
[[body.support]]
point = [0, 0]
y = 0
[[body.load]]
surface = "top"
pressure = "10 MPa"
[[body.load]]
surface = "top"
traction = ["1e5*x", 0]
[[body.load]]
point = [1, 1]
force = ["1 kN", 0]
[[body]]
name = "b"
material = "a"
temperature = 300
mesh.block = { corners = [[0, 0], [1, 0], [1, 1], [0, 1]], u.cells = 1, v.cells = 1 }
[[body.load]]
body_force = [0, "-76.5 kN/m3"]
"#;
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("x.toml");
        std::fs::write(&file, all).unwrap();
        let case = read(&file, None, &[]).unwrap();
        assert_eq!(case.analysis, Analysis::PlaneStrain { thickness: 2e-3 });
        assert_eq!(case.name, "x");
        assert_eq!(case.alternation.driver, Driver::Relaxed(Weights::Constant(0.25)));
        assert_eq!(case.bodies[0].response, ResponseCase::Solver);
        let step = &case.steps[0];
        assert_eq!((step.name.as_deref(), step.loads), (Some("half"), 0.5));
        assert_eq!((step.supports, step.temperature), (-1.0, 0.5));
        let active = read(&file, Some("active"), &[]).unwrap();
        assert_eq!(
            (active.alternation.driver, active.alternation.transfer),
            (Driver::ActiveSet, Transfer::Mortar)
        );
        assert_eq!(active.contacts[0].geometry, ContactGeometry::Updated);
        let rigid = &active.rigid[0];
        assert_eq!(rigid.shape, RigidShape::Circle { center: [0.0, 3.0, 0.0], radius: 1e-3, inside: true });
        assert_eq!(rigid.motion, [1.0, -1e-3, 0.0]);
        let hardening = Hardening::Linear {
            yield_stress: Property::Table(vec![(293.0, 3e8), (373.15, 2e8)]),
            modulus: Property::Constant(1e9),
        };
        let kinematic = Some(Kinematic { modulus: Property::Constant(2e9), recall: 3.0 });
        assert_eq!(case.bodies[0].material.plasticity, Some(Plasticity { hardening, kinematic }));
        assert_eq!(
            case.plasticity,
            PlasticityCase {
                tolerance: 1e-6,
                max_iterations: 7,
                zone: ZoneCase::Never,
                ..PlasticityCase::default()
            }
        );
        let case = read(&file, Some("v"), &["thickness=4".into(), "body.a.temperature=300".into()]).unwrap();
        assert_eq!((case.analysis.thickness(), case.contacts.len()), (4.0, 0));
        assert_eq!((case.title.as_str(), case.variant.as_deref()), ("V", Some("v")));
        let changes = "# variant v\n# remove contact\n# set thickness = 3\n# --set thickness=4\n";
        assert!(case.text.contains(changes), "{}", case.text);
    }

    #[test]
    fn the_example_of_the_reference_page_is_a_case() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("case.toml");
        std::fs::write(&file, super::super::reference::EXAMPLE).unwrap();
        read(directory.path(), None, &[]).unwrap();
        let case = read(directory.path(), Some("C"), &[]).unwrap();
        assert_eq!(case.contacts[0].gap, super::super::Gap::Value(2e-4));
        assert_eq!(variant_names(&file).unwrap(), ["C"]);
    }
}
