//! Reads `[[body]]` with its supports, loads and temperature.
use super::insert;
use super::material::{self, Materials};
use super::node::Value;
use super::path::Paths;
use super::reader::{Field, Fields};
use super::shape::{self, existing_file};
use super::temperature_file;
use super::units::Dimension;
use super::within::within;
use super::{
    BodyCase, Formulation, Geometry, Load, LoadKind, MaterialCase, Region, ResponseCase, Scalar, Support,
    Temperature, Units, nearest, solver_options,
};

impl ResponseCase {
    /// All, in the order of the schema.
    const ALL: [ResponseCase; 3] = [ResponseCase::Automatic, ResponseCase::Condensed, ResponseCase::Solver];

    /// Name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            ResponseCase::Automatic => "automatic",
            ResponseCase::Condensed => "condensed",
            ResponseCase::Solver => "solver",
        }
    }
}

/// Reads one deformable body.
pub(super) fn read(fields: &Fields<'_>, materials: &Materials<'_>, paths: &Paths) -> Option<BodyCase> {
    let name = fields.name("name");
    let geometry = shape::read(fields);
    let formulation = formulation(fields, geometry.as_ref());
    let material = material::of_body(fields, materials);
    let (temperature, temperature_path) = temperature(fields, paths).unzip();
    let temperature_path = temperature_path.flatten();
    let inserts = insert::read_all(fields, geometry.as_ref(), materials);
    let all_materials = || material.iter().chain(inserts.iter().flatten().map(|insert| &insert.material));
    all_materials().for_each(|material| check_heat(fields, material));
    check_references(fields, all_materials());
    let surfaces = geometry.as_ref().and_then(generated_surfaces);
    let supports = super::reader::all(fields.tables("support").iter().map(|f| support(f, surfaces, paths)));
    let loads = super::reader::all(fields.tables("load").iter().map(|f| load(f, surfaces, paths)));
    Some(BodyCase {
        name: name?.to_string(),
        geometry: geometry?,
        cuts: Vec::new(),
        formulation,
        material: material?,
        inserts: inserts?,
        supports: supports?,
        loads: loads?,
        temperature,
        temperature_path,
        solver: solver(fields),
        response: ResponseCase::ALL[fields.choice("response").unwrap_or(0)],
        refine: refine(fields),
        origin: fields.origin(),
    })
}

/// `mesh.refine`, which [`shape::read`] checks.
fn refine(fields: &Fields<'_>) -> usize {
    match fields.node.get("mesh").and_then(|mesh| mesh.get("refine")).map(|node| &node.value) {
        Some(Value::Integer(n)) => usize::try_from(*n).unwrap_or(0),
        _ => 0,
    }
}

/// Surface names that are known before the mesh is made.
pub(super) fn generated_surfaces(geometry: &Geometry) -> Option<&'static [&'static str]> {
    match geometry {
        Geometry::Generated { shape, .. } => Some(shape.surface_names()),
        Geometry::Gmsh { .. } => None,
    }
}

/// `there is no surface 'x'; ...`, if the surfaces are known and this is none of them.
pub(super) fn surface_error(name: &str, known: Option<&[&str]>) -> Option<String> {
    let known = known.filter(|known| !known.contains(&name))?;
    Some(format!("there is no surface '{name}'; {}", nearest::hint(name, known).trim_end()))
}

fn formulation(fields: &Fields<'_>, geometry: Option<&Geometry>) -> Option<Formulation> {
    const ALL: [Formulation; 3] = [Formulation::Standard, Formulation::Enhanced, Formulation::Reduced];
    let formulation = ALL[fields.choice("formulation")?];
    if let Some(Geometry::Generated { element, .. }) = geometry
        && !Formulation::of(*element).contains(&formulation)
    {
        let names: Vec<&str> = Formulation::of(*element).iter().map(|f| f.name()).collect();
        let rule = format!("{} has {}", element.name(), names.join(", "));
        return fields.field("formulation")?.refuse(rule);
    }
    Some(formulation)
}

/// Temperature and material must fit together.
fn check_heat(fields: &Fields<'_>, material: &MaterialCase) {
    let over_temperature = material::over_temperature(material);
    match fields.has("temperature") {
        true if material.expansion.is_none() && !over_temperature => fields.error_at(
            "temperature",
            format!("temperature needs 'expansion' in the material ({})", material.name),
        ),
        false if over_temperature => fields.error_at(
            "temperature",
            format!(
                "missing; the material ({}) has tables over temperature: at which temperature?",
                material.name
            ),
        ),
        _ => {}
    }
}

/// The temperature of a body grows from one reference temperature, whatever its materials.
fn check_references<'a>(fields: &Fields<'_>, materials: impl Iterator<Item = &'a MaterialCase>) {
    // What heat does nothing to is refused already.
    let heated =
        |material: &&MaterialCase| material.expansion.is_some() || material::over_temperature(material);
    let mut materials = materials.filter(heated);
    let Some(first) = materials.next().filter(|_| fields.has("temperature")) else { return };
    if let Some(other) = materials.find(|other| other.reference_temperature != first.reference_temperature) {
        let said =
            |material: &MaterialCase| format!("{} of '{}'", material.reference_temperature, material.name);
        fields.error_at(
            "temperature",
            format!(
                "the materials of a body with a temperature need one 'reference_temperature', from which all of it is heated; \
                 there are {} and {}",
                said(first),
                said(other)
            ),
        );
    }
}

/// The temperature, and the path that it follows.
fn temperature(fields: &Fields<'_>, paths: &Paths) -> Option<(Temperature, Option<usize>)> {
    let field = fields.field("temperature")?;
    let Value::Table(_) = field.node.value else {
        return Some((uniform_or_expression(&field, field.dimension())?, None));
    };
    let table = field.reader.open("temperature", field.node, &field.path)?;
    let path = paths.followed_by(&table);
    let temperature = match table.given(&["file", "value"])[..] {
        ["file"] => temperature_file(&table),
        ["value"] => table.field("value").and_then(|value| uniform_or_expression(&value, field.dimension())),
        _ => {
            table.error("exactly one of 'file' and 'value' is needed");
            None
        }
    };
    Some((temperature?, path))
}

fn temperature_file(table: &Fields<'_>) -> Option<Temperature> {
    let path = existing_file(table, "file")?;
    let values = temperature_file::read(&path, table.reader.units);
    let values = values.map_err(|error| table.reader.note_error(&table.node.place, &error)).ok()?;
    Some(Temperature::Nodal { values, origin: table.origin() })
}

fn uniform_or_expression(field: &Field<'_>, dimension: Dimension) -> Option<Temperature> {
    match field.scalar(dimension)? {
        Scalar::Constant(value) if value < 0.0 && field.reader.units == Units::Si => {
            field.refuse("must be >= 0 K")
        }
        scalar => Some(Temperature::Field(scalar)),
    }
}

fn solver(fields: &Fields<'_>) -> Option<String> {
    let field = fields.field("solver")?;
    let options = solver_options::read(&field)?;
    match options.trim().is_empty() {
        true => field.refuse("PETSc options begin with '-', such as \"-ksp_type cg -pc_type gamg\""),
        false => Some(options.trim().to_string()),
    }
}

fn support(fields: &Fields<'_>, surfaces: Option<&[&str]>, paths: &Paths) -> Option<Support> {
    let (region, path) = (region(fields, surfaces), paths.followed_by(fields));
    let (x, y, angle) = (fields.scalar("x"), fields.scalar("y"), fields.number("angle"));
    if !fields.has("surface") && !fields.has("point") {
        fields.error("a support needs a 'surface' or a 'point'");
    }
    if fields.given(&["x", "y"]).is_empty() {
        fields.error("a support needs 'x' or 'y', the displacement it prescribes (0 holds it)");
    }
    Some(Support {
        region: region?,
        displacement: [x, y, None],
        angle: angle.unwrap_or(0.0).to_radians(),
        path,
        origin: fields.origin(),
    })
}

fn load(fields: &Fields<'_>, surfaces: Option<&[&str]>, paths: &Paths) -> Option<Load> {
    const KINDS: [&str; 4] = ["pressure", "traction", "force", "body_force"];
    let (region, path) = (region(fields, surfaces), paths.followed_by(fields));
    let (pressure, traction) = (fields.scalar("pressure"), fields.vector("traction"));
    let (force, body_force) = (fields.point("force"), fields.vector("body_force"));
    let given = fields.given(&KINDS);
    let [kind] = given[..] else {
        let given = if given.is_empty() { "no kind of load".into() } else { given.join(" and ") };
        fields.error(format!("{given} given; a load has exactly one of {}", KINDS.join(", ")));
        return None;
    };
    let has_region = fields.has("surface") || fields.has("point");
    if kind == "body_force" && (has_region || fields.has("within")) {
        fields.error("'body_force' acts everywhere; it takes no 'surface', 'point' or 'within'");
    }
    if kind != "body_force" && !has_region {
        let point = if kind == "force" { " or a 'point'" } else { "" };
        fields.error(format!("'{kind}' needs a 'surface'{point} to act on"));
    }
    if fields.has("point") && matches!(kind, "pressure" | "traction") {
        fields.error(format!("'{kind}' acts on a 'surface', not at a 'point'; a point takes 'force'"));
    }
    let zero = Scalar::Constant(0.0);
    let kind = match kind {
        "pressure" => LoadKind::Pressure(region?, pressure?),
        "traction" => {
            traction.map(|[x, y]| [x, y, zero]).zip(region).map(|(t, r)| LoadKind::Traction(r, t))?
        }
        "force" => force.map(|[x, y]| [x, y, 0.0]).zip(region).map(|(f, r)| LoadKind::Force(r, f))?,
        _ => body_force.map(|[x, y]| LoadKind::BodyForce([x, y, zero]))?,
    };
    Some(Load { kind, path, origin: fields.origin() })
}

/// `surface` with `within`, or `point`; neither is no error here.
fn region(fields: &Fields<'_>, surfaces: Option<&[&str]>) -> Option<Region> {
    let (surface, point, within) = (fields.line("surface"), fields.point("point"), within(fields));
    if fields.has("surface") && fields.has("point") {
        fields.error("'surface' and 'point' exclude each other");
    }
    if fields.has("point") && fields.has("within") {
        fields.error_at("within", "goes with 'surface', not with 'point'");
    }
    if let Some(message) = surface.and_then(|name| surface_error(name, surfaces)) {
        fields.error_at("surface", message);
    }
    match (surface, point) {
        (Some(name), _) => Some(Region::Surface { name: name.to_string(), within }),
        (None, Some([x, y])) => Some(Region::Point([x, y, 0.0])),
        (None, None) => None,
    }
}
