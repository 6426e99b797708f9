//! Reads `mesh`: a generated shape or a Gmsh file.
use super::grading;
use super::node::Value;
use super::reader::{Field, Fields, LONGEST_LINE, all};
use super::schema::ELEMENTS;
use super::{Geometry, Grading, Shape};
use crate::element::ElementKind;

const SOURCES: [&str; 6] = ["rectangle", "block", "ring", "half_disc", "disc", "file"];

impl Shape {
    /// Names of the surfaces that the generator makes.
    pub fn surface_names(&self) -> &'static [&'static str] {
        match self {
            Shape::Rectangle { .. } | Shape::Block { .. } => &["left", "right", "bottom", "top"],
            Shape::Ring { angle, .. } if is_full_turn(angle) => &["inner", "outer"],
            Shape::Ring { .. } => &["inner", "outer", "start", "end"],
            Shape::HalfDisc { .. } => &["flat", "arc"],
            Shape::Disc { .. } => &["arc"],
        }
    }
}

/// Refinements after which almost any mesh is too large.
const MOST_REFINEMENTS: usize = 16;

impl Shape {
    /// The same shape with every cell in four, `times` times: each interval of its gradings is halved.
    fn refined(mut self, times: usize) -> Shape {
        for _ in 0..times {
            match &mut self {
                Shape::Rectangle { x: a, y: b }
                | Shape::Block { u: a, v: b, .. }
                | Shape::Ring { radius: a, angle: b, .. } => [a, b].map(Grading::halve),
                Shape::HalfDisc { angle, depth, core, .. } => {
                    *core *= 2;
                    [angle, depth].map(Grading::halve)
                }
                Shape::Disc { quarter, depth, .. } => {
                    *quarter *= 2;
                    [depth.halve(), ()]
                }
            };
        }
        self
    }

    /// Cells along the longest direction.
    fn longest(&self) -> usize {
        let of = |grading: &Grading| grading.at.len() - 1;
        match self {
            Shape::Rectangle { x: a, y: b }
            | Shape::Block { u: a, v: b, .. }
            | Shape::Ring { radius: a, angle: b, .. } => of(a).max(of(b)),
            Shape::HalfDisc { angle, depth, core, .. } => of(angle).max(of(depth)).max(*core),
            Shape::Disc { quarter, depth, .. } => of(depth).max(*quarter),
        }
    }
}

/// True if a ring's angles go all the way round.
fn is_full_turn(angle: &Grading) -> bool {
    let span = angle.at.last().copied().unwrap_or(0.0) - angle.at.first().copied().unwrap_or(0.0);
    (span - std::f64::consts::TAU).abs() < 1e-9
}

/// Reads the mesh of a body, whose key `element` belongs to it.
pub(super) fn read(body: &Fields<'_>) -> Option<Geometry> {
    let element = body.choice("element").and_then(element_named);
    let mesh = body.table("mesh")?;
    let given = mesh.given(&SOURCES);
    if given.len() != 1 {
        mesh.error(format!("{} given; exactly one of {} is needed", listed(&given), SOURCES.join(", ")));
        return None;
    }
    let (rotate, translate) = (mesh.number("rotate"), mesh.point("translate"));
    let scale = mesh.number_if("scale", |value| value > 0.0, "must be > 0");
    let groups = mesh.field("group").and_then(|field| groups(&field));
    let refine = mesh.natural("refine", MOST_REFINEMENTS).unwrap_or(0);
    if given[0] == "file" {
        for key in mesh.given(&["rotate", "translate"]) {
            mesh.error_at(key, "belongs to generated shapes, not to a mesh file");
        }
        if body.has("element") {
            body.error_at("element", "belongs to generated shapes; a mesh file has its own element kinds");
        }
        let file = existing_file(&mesh, "file")?;
        let (groups, scale) = (groups.unwrap_or_default(), scale.unwrap_or(1.0));
        return Some(Geometry::Gmsh { file, groups, scale, refine, origin: mesh.origin() });
    }
    for key in mesh.given(&["group", "scale"]) {
        mesh.error_at(key, "belongs to 'file', not to a generated shape");
    }
    let shape = match given[0] {
        "rectangle" => rectangle(&mesh.table("rectangle")?),
        "block" => block(&mesh.table("block")?),
        "ring" => ring(&mesh.table("ring")?),
        "half_disc" => half_disc(&mesh.table("half_disc")?),
        _ => disc(&mesh.table("disc")?),
    };
    let shape = shape?;
    let cells = shape.longest() << refine;
    if cells > grading::MOST_CELLS {
        let rule =
            format!("this makes {cells} cells in one direction; at most {} are allowed", grading::MOST_CELLS);
        mesh.error_at("refine", rule);
        return None;
    }
    Some(Geometry::Generated {
        shape: shape.refined(refine),
        element: element.unwrap_or(ElementKind::Quad4),
        rotate: rotate.unwrap_or(0.0).to_radians(),
        translate: translate.unwrap_or([0.0; 2]),
        origin: mesh.origin(),
    })
}

/// One physical group, or several.
fn groups(field: &Field<'_>) -> Option<Vec<String>> {
    let names = match &field.node.value {
        Value::Text(_) => vec![field.line(LONGEST_LINE)?],
        Value::Array(_) => all(field.items()?.iter().map(|item| item.line(LONGEST_LINE)))?,
        _ => return field.wrong("the name of a physical group, or an array of names, is needed"),
    };
    match (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
        _ if names.is_empty() => {
            field.refuse("at least one group is needed; without the key all cells are the body")
        }
        Some(i) => field.refuse(format!("'{}' is named twice", names[i])),
        None => Some(names.into_iter().map(str::to_string).collect()),
    }
}

/// The path of a file that is there, from the directory of the case.
pub(super) fn existing_file(fields: &Fields<'_>, key: &str) -> Option<std::path::PathBuf> {
    let path = fields.reader.directory.join(fields.text(key)?);
    match path.is_file() {
        true => Some(path),
        false => fields.field(key)?.refuse(format!("there is no file {}", path.display())),
    }
}

fn element_named(choice: usize) -> Option<ElementKind> {
    ElementKind::ALL.into_iter().find(|kind| kind.name() == ELEMENTS[choice])
}

fn listed(names: &[&str]) -> String {
    if names.is_empty() { "none".into() } else { names.join(" and ") }
}

fn rectangle(fields: &Fields<'_>) -> Option<Shape> {
    let (x, y) = (graded(fields, "x", [None; 2]), graded(fields, "y", [None; 2]));
    Some(Shape::Rectangle { x: x?, y: y? })
}

/// Edges of a block, counter-clockwise.
const EDGES: [&str; 4] = ["bottom", "right", "top", "left"];

fn block(fields: &Fields<'_>) -> Option<Shape> {
    const UNIT: [Option<f64>; 2] = [Some(0.0), Some(1.0)];
    let (u, v) = (graded(fields, "u", UNIT), graded(fields, "v", UNIT));
    for (key, grading) in [("u", &u), ("v", &v)] {
        if let Some(Grading { at }) = grading
            && (at.first() != Some(&0.0) || at.last() != Some(&1.0))
        {
            fields.error_at(key, "must go from 0 to 1");
        }
    }
    let arcs = fields.table("arcs").map_or([None; 4], |arcs| EDGES.map(|edge| arcs.point(edge)));
    let corners = fields.points("corners")?;
    let Ok(corners) = <[[f64; 2]; 4]>::try_from(corners) else {
        return fields.field("corners")?.refuse("four points are needed, counter-clockwise from bottom-left");
    };
    if !counter_clockwise(&corners) {
        return fields
            .field("corners")?
            .refuse("the corners must go counter-clockwise round a convex quadrilateral");
    }
    for (i, edge) in EDGES.into_iter().enumerate() {
        if let Some(center) = arcs[i] {
            let [r0, r1] =
                [corners[i], corners[(i + 1) % 4]].map(|p| (p[0] - center[0]).hypot(p[1] - center[1]));
            if r0 <= 0.0 || (r0 - r1).abs() > 1e-9 * r0.max(r1) {
                fields.error_at(
                    "arcs",
                    format!(
                        "the centre of '{edge}' must be equally far from both ends of the \
                    edge; it is {r0} and {r1} away"
                    ),
                );
            }
        }
    }
    Some(Shape::Block { corners, arcs, u: u?, v: v? })
}

/// True for a convex quadrilateral that goes counter-clockwise.
fn counter_clockwise(corners: &[[f64; 2]; 4]) -> bool {
    (0..4).all(|i| {
        let [a, b, c] = [corners[i], corners[(i + 1) % 4], corners[(i + 2) % 4]];
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) > 0.0
    })
}

fn ring(fields: &Fields<'_>) -> Option<Shape> {
    let center = fields.point("center").unwrap_or([0.0; 2]);
    let (radius, angle) = (graded(fields, "radius", [None; 2]), graded(fields, "angle", [None; 2]));
    if let Some(radius) = &radius
        && radius.at[0] <= 0.0
    {
        fields.error_at("radius", format!("begins at {}; the inner radius must be > 0", radius.at[0]));
    }
    if let Some(Grading { at }) = &angle
        && at[at.len() - 1] - at[0] > 360.0 * (1.0 + 1e-12)
    {
        fields.error_at(
            "angle",
            format!("goes from {} to {} degrees; at most a full turn is allowed", at[0], at[at.len() - 1]),
        );
    }
    Some(Shape::Ring { center, radius: radius?, angle: in_radians(angle?) })
}

fn half_disc(fields: &Fields<'_>) -> Option<Shape> {
    let center = fields.point("center").unwrap_or([0.0; 2]);
    let (radius, up) = (radius(fields), fields.choice("arc").map(|choice| choice == 0));
    let (angle, depth) = (graded(fields, "angle", [None; 2]), depth(fields));
    let core = fields.count("core");
    if let Some(Grading { at }) = &angle {
        let symmetric = at.iter().zip(at.iter().rev()).all(|(a, b)| (a + b).abs() <= 1e-9 * at[0].abs());
        if !symmetric || at[0] <= -90.0 {
            fields.error_at("angle", "must be symmetric about 0 and inside (-90, 90) degrees");
        }
    }
    Some(Shape::HalfDisc {
        center,
        radius: radius?,
        up: up?,
        angle: in_radians(angle?),
        depth: depth?,
        core: core?,
    })
}

fn disc(fields: &Fields<'_>) -> Option<Shape> {
    let center = fields.point("center").unwrap_or([0.0; 2]);
    let (radius, depth, quarter) = (radius(fields), depth(fields), fields.count("quarter"));
    Some(Shape::Disc { center, radius: radius?, quarter: quarter?, depth: depth? })
}

fn radius(fields: &Fields<'_>) -> Option<f64> {
    fields.number_if("radius", |value| value > 0.0, "must be > 0")
}

fn depth(fields: &Fields<'_>) -> Option<Grading> {
    let depth = graded(fields, "depth", [Some(0.0), None])?;
    if depth.at[0] != 0.0 || depth.at[depth.at.len() - 1] >= 1.0 {
        fields.error_at("depth", "must go from 0 (the rim) to less than 1 (the centre)");
        return None;
    }
    Some(depth)
}

fn graded(fields: &Fields<'_>, key: &str, ends: [Option<f64>; 2]) -> Option<Grading> {
    grading::read(&fields.table(key)?, ends)
}

fn in_radians(degrees: Grading) -> Grading {
    Grading { at: degrees.at.into_iter().map(f64::to_radians).collect() }
}
