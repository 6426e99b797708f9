//! Reads what joins the bodies and what is reported: `[[contact]]`, `[alternation]`, `[[probe]]`, `[output]`.
use super::body::{generated_surfaces, surface_error, within};
use super::node::Value;
use super::reader::{Field, Fields, all};
use super::{
    AlternationCase, BodyCase, Conjugate, ContactCase, Gap, OutputCase, ProbeCase, StressComponent,
    SurfaceName, Weights, nearest,
};

/// A body as others refer to it: its name, and the body where it could be read.
pub(super) type NamedBody<'a> = (&'a str, Option<&'a BodyCase>);

/// Reads one pair.
pub(super) fn read(fields: &Fields<'_>, bodies: &[NamedBody<'_>]) -> Option<ContactCase> {
    let name = fields.name("name");
    let (gap, offset) = (fields.number("gap"), fields.number("gap_offset"));
    if fields.has("gap") && fields.has("gap_offset") {
        fields.error("'gap' replaces the geometric gap and 'gap_offset' adds to it; give one of the two");
    }
    let search_distance = fields.number_if("search_distance", |value| value > 0.0, "must be > 0");
    let conjugate = fields.choice("conjugate");
    let surfaces = surfaces(fields, bodies)?;
    let default_name =
        || surfaces.each_ref().map(|s| format!("{}.{}", bodies[s.body].0, s.surface)).join("-");
    Some(ContactCase {
        name: name.map_or_else(default_name, str::to_string),
        gap: gap.map_or(Gap::Geometry { offset: offset.unwrap_or(0.0) }, Gap::Value),
        search_distance,
        conjugate: [Conjugate::ClosestPoint, Conjugate::Intersection][conjugate.unwrap_or(0)],
        origin: fields.origin(),
        surfaces,
    })
}

fn surfaces(fields: &Fields<'_>, bodies: &[NamedBody<'_>]) -> Option<[SurfaceName; 2]> {
    let within = within(fields);
    let names = fields.texts("surfaces")?;
    let field = fields.field("surfaces")?;
    let [a, b] = names[..] else {
        return field.refuse("two surfaces are needed, such as [\"upper.bottom\", \"lower.top\"]");
    };
    let (a, b) = (surface(&field, a, bodies), surface(&field, b, bodies));
    let ((body_a, a), (body_b, b)) = (a?, b?);
    if body_a == body_b && a == b {
        return field.refuse("a surface cannot be in contact with itself");
    }
    if body_a == body_b {
        return field.refuse("the two surfaces of a pair must belong to different bodies");
    }
    Some([SurfaceName { body: body_a, surface: a, within }, SurfaceName { body: body_b, surface: b, within }])
}

/// Body and surface of "body.surface".
fn surface(field: &Field<'_>, name: &str, bodies: &[NamedBody<'_>]) -> Option<(usize, String)> {
    let Some((body, surface)) = name.split_once('.').filter(|(_, surface)| !surface.is_empty()) else {
        field.error(format!("'{name}' was given; a surface is written \"body.surface\""));
        return None;
    };
    let index = index_of(field, body, bodies)?;
    let known = bodies[index].1.and_then(|body| generated_surfaces(&body.geometry));
    match surface_error(surface, known) {
        Some(message) => {
            field.error(format!("'{name}' was given; on body '{body}' {message}"));
            None
        }
        None => Some((index, surface.to_string())),
    }
}

fn index_of(field: &Field<'_>, name: &str, bodies: &[NamedBody<'_>]) -> Option<usize> {
    bodies.iter().position(|(other, _)| *other == name).or_else(|| {
        let names: Vec<&str> = bodies.iter().map(|(name, _)| *name).filter(|name| !name.is_empty()).collect();
        field.refuse(format!("there is no body '{name}'; {}", nearest::hint(name, &names).trim_end()))
    })
}

/// Reads `[alternation]`; every key has a default.
pub(super) fn alternation(case: &Fields<'_>) -> AlternationCase {
    let mut alternation =
        AlternationCase { weights: Weights::Response, tolerance: 1e-8, max_alternations: 200 };
    if let Some(fields) = case.table("alternation") {
        let in_range = |value: f64| value > 0.0 && value <= 1e-2;
        let tolerance = fields.number_if("tolerance", in_range, "must be in (0, 1e-2]");
        alternation.tolerance = tolerance.unwrap_or(alternation.tolerance);
        alternation.max_alternations =
            fields.count("max_alternations").unwrap_or(alternation.max_alternations);
        alternation.weights =
            fields.field("weights").and_then(|f| weights(&f)).unwrap_or(alternation.weights);
    }
    alternation
}

fn weights(field: &Field<'_>) -> Option<Weights> {
    const NAMED: [(&str, Weights); 5] = [
        ("response", Weights::Response),
        ("response per surface", Weights::ResponseSurface),
        ("magnitude", Weights::Magnitude),
        ("component", Weights::Component),
        ("stiffness", Weights::Stiffness),
    ];
    if let Value::Text(name) = &field.node.value {
        return NAMED.iter().find(|(other, _)| other == name).map(|(_, weights)| *weights).or_else(|| {
            let names = NAMED.map(|(name, _)| name);
            let hint = nearest::hint(name, &names);
            field.refuse(format!("{}or a number in (0, 1)", hint))
        });
    }
    let value = field.number(field.dimension())?;
    match value > 0.0 && value < 1.0 {
        true => Some(Weights::Constant(value)),
        false => field.refuse("a constant weight must be in (0, 1)"),
    }
}

/// Reads one probe.
pub(super) fn probe(fields: &Fields<'_>, bodies: &[NamedBody<'_>]) -> Option<ProbeCase> {
    let (name, at, body) = (fields.name("name"), fields.point("at"), fields.text("body"));
    let body = index_of(&fields.field("body")?, body?, bodies);
    let [x, y] = at?;
    Some(ProbeCase { name: name?.to_string(), body: body?, at: [x, y, 0.0], origin: fields.origin() })
}

/// Reads `[output]`; every key has a default.
pub(super) fn output(case: &Fields<'_>) -> OutputCase {
    use StressComponent::*;
    let mut output = OutputCase { component: Yy, magnification: None, window: None };
    if let Some(fields) = case.table("output") {
        output.component = fields.choice("stress").map_or(Yy, |choice| [Xx, Yy, Zz, Xy, VonMises][choice]);
        output.magnification = fields.number_if("magnification", |value| value >= 0.0, "must be >= 0");
        output.window = window(&fields);
    }
    output
}

fn window(fields: &Fields<'_>) -> Option<[[f64; 2]; 2]> {
    let corners = all(fields.points("window")?.into_iter().map(Some))?;
    match corners[..] {
        [low, high] if low[0] < high[0] && low[1] < high[1] => Some([low, high]),
        _ => fields
            .field("window")?
            .refuse("the lower and then the upper corner are needed, [[x0, y0], [x1, y1]]"),
    }
}

/// Notes names that occur twice.
pub(super) fn refuse_duplicates(fields: &[Fields<'_>], what: &str) {
    for (i, item) in fields.iter().enumerate() {
        let name = item.node.get("name").and_then(|node| node.text());
        let earlier = fields[..i]
            .iter()
            .find(|other| name.is_some() && other.node.get("name").and_then(|node| node.text()) == name);
        if let (Some(name), Some(earlier)) = (name, earlier) {
            let line = earlier.node.place.line;
            item.error_at(
                "name",
                format!("there are two {what} named '{name}'; the first is in line {line}"),
            );
        }
    }
}
