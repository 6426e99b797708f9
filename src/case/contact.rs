//! Reads what joins the bodies and what is reported: `[[contact]]`, `[[probe]]`, `[output]`.
use super::body::surface_error;
use super::property::property;
use super::reader::{Field, Fields, all};
use super::within::within;
use super::{
    AlternationCase, BodyRef, ConjugateRule, ContactCase, ContactGeometry, Driver, Gap, Law, OutputCase,
    ProbeCase, Property, Shown, StressComponent, SurfaceName, Transfer, nearest,
};

/// A body as others refer to it.
pub(super) struct NamedBody<'a> {
    /// Its name as written, good or not.
    pub name: &'a str,
    /// Which body of the case it is.
    pub body: BodyRef,
    /// Its surfaces, where they are known before the mesh is read.
    pub surfaces: Option<&'static [&'static str]>,
    /// True if it has a temperature.
    pub heated: bool,
}

/// Reads one pair. `alternation` is `None` where it could not be read.
pub(super) fn read(
    fields: &Fields<'_>,
    bodies: &[NamedBody<'_>],
    alternation: Option<&AlternationCase>,
) -> Option<ContactCase> {
    let name = fields.name("name");
    let (gap, offset) = (fields.number("gap"), fields.number("gap_offset"));
    if fields.has("gap") && fields.has("gap_offset") {
        fields.error("'gap' replaces the geometric gap and 'gap_offset' adds to it; give one of the two");
    }
    let search_distance = fields.number_if("search_distance", |value| value > 0.0, "must be > 0");
    let conjugate = conjugate(fields, alternation);
    let geometry =
        fields.choice("geometry").map(|choice| [ContactGeometry::Initial, ContactGeometry::Updated][choice]);
    let (law, over_temperature) = law(fields).unwrap_or_default();
    if geometry == Some(ContactGeometry::Updated) && law.is_frictional() {
        refuse_slipping_apart(fields, alternation);
    }
    let surfaces = surfaces(fields, bodies)?;
    if over_temperature.is_some() {
        needs_temperature(fields, bodies, &surfaces);
    }
    let default_name = || {
        let body_name = |body| bodies.iter().find(|b| b.body == body).map_or("", |b| b.name);
        surfaces.each_ref().map(|s| format!("{}.{}", body_name(s.body), s.surface)).join("-")
    };
    Some(ContactCase {
        name: name.map_or_else(default_name, str::to_string),
        gap: gap.map_or(Gap::Geometry { offset: offset.unwrap_or(0.0) }, Gap::Value),
        search_distance,
        conjugate: conjugate.unwrap_or(ConjugateRule::ClosestPoint),
        geometry: geometry.unwrap_or(ContactGeometry::Initial),
        law,
        over_temperature,
        origin: fields.origin(),
        surfaces,
    })
}

/// `law`, `friction` and `shear`, which go together; the number of the law, if it is a table.
fn law(fields: &Fields<'_>) -> Option<(Law, Option<Property>)> {
    let friction = property(fields, "friction", |value| value >= 0.0, "must be >= 0");
    let shear = property(fields, "shear", |value| value > 0.0, "must be > 0");
    const COULOMB: usize = 1;
    let chosen = fields.choice("law").or(fields.has("friction").then_some(COULOMB)).unwrap_or(0);
    for (key, needed) in [("friction", COULOMB), ("shear", 2)] {
        match (fields.has(key), chosen == needed) {
            (true, false) => {
                fields.error_at(key, format!("'{key}' belongs to law = \"{}\"", LAWS[needed]));
                return None;
            }
            (false, true) => {
                fields.error(format!("law = \"{}\" needs '{key}'", LAWS[needed]));
                return None;
            }
            _ => {}
        }
    }
    let (law, property) = match chosen {
        COULOMB => {
            let property = friction?;
            let law = match property.largest() {
                0.0 => Law::Frictionless,
                friction => Law::Coulomb { friction },
            };
            (law, Some(property))
        }
        2 => {
            let property = shear?;
            (Law::Tresca { shear: property.largest() }, Some(property))
        }
        3 => (Law::Rough, None),
        4 => (Law::Tied, None),
        _ => (Law::Frictionless, None),
    };
    Some((law, property.filter(|property| property.is_table() && law.is_frictional())))
}

/// A table over temperature needs one.
fn needs_temperature(fields: &Fields<'_>, bodies: &[NamedBody<'_>], surfaces: &[SurfaceName; 2]) {
    let heated = |s: &SurfaceName| bodies.iter().any(|b| b.body == s.body && b.heated);
    if !surfaces.iter().any(heated) {
        let key = if fields.has("friction") { "friction" } else { "shear" };
        fields.error_at(
            key,
            "a table over temperature needs a body with a 'temperature' on one side of the pair at least",
        );
    }
}

/// The paper's transfer has friction where nodes match: those that slip do not when they are followed.
fn refuse_slipping_apart(fields: &Fields<'_>, alternation: Option<&AlternationCase>) {
    let papers =
        |a: &AlternationCase| matches!(a.driver, Driver::Relaxed(_)) && a.transfer == Transfer::Pointwise;
    if alternation.is_some_and(papers) {
        fields.error_at(
            "geometry",
            "driver = \"relaxed\" with transfer = \"pointwise\", its default, has friction where nodes match, which they do \
             no more once they have slipped: use transfer = \"mortar\", or geometry = \"initial\"",
        );
    }
}

/// What `law` may be, in the order of its choices.
const LAWS: [&str; 5] = ["frictionless", "coulomb", "tresca", "rough", "tied"];

/// `conjugate`, which only a transfer at conjugate points has a use for.
fn conjugate(fields: &Fields<'_>, alternation: Option<&AlternationCase>) -> Option<ConjugateRule> {
    let conjugate = [ConjugateRule::ClosestPoint, ConjugateRule::Intersection][fields.choice("conjugate")?];
    match alternation?.transfer {
        Transfer::Pointwise => Some(conjugate),
        Transfer::Mortar => fields.field("conjugate")?.refuse(
            "'conjugate' belongs to transfer = \"pointwise\"; transfer = \"mortar\" integrates over both \
             surfaces and has no conjugate points",
        ),
    }
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
    if body_a.body == body_b.body && a == b {
        return field.refuse("a surface cannot be in contact with itself");
    }
    if body_a.body == body_b.body {
        return field.refuse("the two surfaces of a pair must belong to different bodies");
    }
    if let (BodyRef::Rigid(_), BodyRef::Rigid(_)) = (body_a.body, body_b.body) {
        let (a, b) = (body_a.name, body_b.name);
        return field
            .refuse(format!("'{a}' and '{b}' are both rigid; one body of a pair must be deformable"));
    }
    let named = |body: &NamedBody<'_>, surface| SurfaceName { body: body.body, surface, within };
    Some([named(body_a, a), named(body_b, b)])
}

/// Body and surface of "body.surface".
fn surface<'b, 'a>(
    field: &Field<'_>,
    name: &str,
    bodies: &'b [NamedBody<'a>],
) -> Option<(&'b NamedBody<'a>, String)> {
    let Some((body, surface)) = name.split_once('.').filter(|(_, surface)| !surface.is_empty()) else {
        field.error(format!("'{name}' was given; a surface is written \"body.surface\""));
        return None;
    };
    let found = body_named(field, body, bodies)?;
    match surface_error(surface, found.surfaces) {
        Some(message) => {
            field.error(format!("'{name}' was given; on body '{body}' {message}"));
            None
        }
        None => Some((found, surface.to_string())),
    }
}

fn body_named<'b, 'a>(
    field: &Field<'_>,
    name: &str,
    bodies: &'b [NamedBody<'a>],
) -> Option<&'b NamedBody<'a>> {
    bodies.iter().find(|other| other.name == name).or_else(|| {
        let names: Vec<&str> = bodies.iter().map(|b| b.name).filter(|name| !name.is_empty()).collect();
        field.refuse(format!("there is no body '{name}'; {}", nearest::hint(name, &names).trim_end()))
    })
}

/// Reads one probe.
pub(super) fn probe(fields: &Fields<'_>, bodies: &[NamedBody<'_>]) -> Option<ProbeCase> {
    let (name, at, body) = (fields.name("name"), fields.point("at"), fields.text("body"));
    let field = fields.field("body")?;
    let body = match body_named(&field, body?, bodies)?.body {
        BodyRef::Deformable(body) => body,
        BodyRef::Rigid(_) => {
            return field.refuse("a rigid body has nothing to report; probe a deformable one");
        }
    };
    let [x, y] = at?;
    Some(ProbeCase { name: name?.to_string(), body, at: [x, y, 0.0], origin: fields.origin() })
}

/// Reads `[output]`; every key has a default. `yields`: a body of the case can.
pub(super) fn output(case: &Fields<'_>, yields: bool) -> OutputCase {
    use StressComponent::*;
    let shown = Shown::Stress(Yy);
    let mut output = OutputCase { shown, magnification: None, window: None, every_estimate: false };
    if let Some(fields) = case.table("output") {
        if let Some(choice) = fields.choice("stress") {
            output.shown = Shown::Stress([Xx, Yy, Zz, Xy, VonMises][choice]);
        }
        if fields.choice("field").is_some() {
            output.shown = Shown::PlasticStrain;
            if fields.has("stress") {
                fields.error_at("field", "'stress' is given as well; the picture has one of them");
            } else if !yields {
                fields.error_at("field", "no body has a material with 'plasticity', so that nothing yields");
            }
        }
        output.magnification = fields.number_if("magnification", |value| value >= 0.0, "must be >= 0");
        output.window = window(&fields);
        output.every_estimate = fields.choice("estimate") == Some(1);
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
