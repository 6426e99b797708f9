//! Rigid bodies: `rigid` of a `[[body]]`, a plane, a circle or a polyline with a prescribed motion.
use super::Origin;
use super::path::Paths;
use super::reader::Fields;

/// A rigid body: no mesh, no unknowns; nothing but its surface and how it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidCase {
    /// Name; unique among all bodies.
    pub name: String,
    /// Its surface.
    pub shape: RigidShape,
    /// Prescribed translation, m.
    pub motion: [f64; 3],
    /// Path that the motion follows: an index into [`Case::paths`](super::Case::paths); `None`: the general factor.
    pub path: Option<usize>,
    /// Where it is written.
    pub origin: Origin,
}

/// Surface of a rigid body; outward is away from the body, towards those it touches.
#[derive(Debug, Clone, PartialEq)]
pub enum RigidShape {
    /// A straight line without ends, the body behind it.
    Plane {
        /// A point on it, m.
        through: [f64; 3],
        /// Outward normal, of unit length.
        normal: [f64; 3],
    },
    /// A circle.
    Circle {
        /// Centre, m.
        center: [f64; 3],
        /// Radius, m; > 0.
        radius: f64,
        /// True: a bore, the body is outside the circle and outward is towards the centre. False: a disc.
        inside: bool,
    },
    /// A chain of segments; the body lies to the left of the direction of travel, outward is to the right.
    Polyline {
        /// The corners, m: at least two, each apart from the one before.
        points: Vec<[f64; 3]>,
    },
}

/// The surfaces of a rigid body: it has one.
pub(super) const SURFACES: &[&str] = &["surface"];

const SHAPES: [&str; 3] = ["plane", "circle", "polyline"];

/// Keys of a body that need a mesh.
const DEFORMABLE: [&str; 10] = [
    "material",
    "insert",
    "mesh",
    "element",
    "formulation",
    "temperature",
    "support",
    "load",
    "solver",
    "response",
];

/// Reads a body that has the key `rigid`.
pub(super) fn read(body: &Fields<'_>, paths: &Paths) -> Option<RigidCase> {
    let name = body.name("name");
    for key in body.given(&DEFORMABLE) {
        body.error_at(key, "belongs to a deformable body; a rigid one has only 'name' and 'rigid'");
    }
    let fields = body.table("rigid")?;
    let motion = ["x", "y"].map(|key| (fields.number(key), fields.has(key)));
    let path = paths.followed_by(&fields);
    if fields.has("path") && fields.given(&["x", "y"]).is_empty() {
        fields.error_at("path", "scales the motion, and there is no 'x' or 'y'");
    }
    let given = fields.given(&SHAPES);
    let [shape] = given[..] else {
        let given = if given.is_empty() { "none".into() } else { given.join(" and ") };
        fields.error(format!("{given} given; exactly one of {} is needed", SHAPES.join(", ")));
        return None;
    };
    let table = fields.table(shape)?;
    let shape = match shape {
        "plane" => plane(&table),
        "circle" => circle(&table),
        _ => polyline(&table),
    };
    let [x, y] = motion.map(|(value, given)| if given { value } else { Some(0.0) });
    let (shape, motion) = (shape?, [x?, y?, 0.0]);
    Some(RigidCase { name: name?.to_string(), shape, motion, path, origin: body.origin() })
}

fn plane(fields: &Fields<'_>) -> Option<RigidShape> {
    let (through, normal) = (fields.point("through"), fields.point("normal"));
    let [x, y] = normal?;
    let length = x.hypot(y);
    if length == 0.0 || !length.is_finite() {
        return fields.field("normal")?.refuse("a normal must have a length > 0");
    }
    Some(RigidShape::Plane { through: in_space(through?), normal: [x / length, y / length, 0.0] })
}

fn circle(fields: &Fields<'_>) -> Option<RigidShape> {
    let (center, inside) = (fields.point("center"), fields.flag("inside"));
    let radius = fields.number_if("radius", |value| value > 0.0, "must be > 0");
    Some(RigidShape::Circle { center: in_space(center?), radius: radius?, inside: inside.unwrap_or(false) })
}

fn polyline(fields: &Fields<'_>) -> Option<RigidShape> {
    let points = fields.points("points")?;
    let field = fields.field("points")?;
    if points.len() < 2 {
        return field.refuse("at least two points are needed");
    }
    if let Some(i) = points.windows(2).position(|ends| ends[0] == ends[1]) {
        return field.refuse(format!("points {i} and {} are the same; a segment needs a length > 0", i + 1));
    }
    let turns_back = |corner: &[[f64; 2]]| {
        let [a, b, c] = [corner[0], corner[1], corner[2]];
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
        u[0] * v[1] - u[1] * v[0] == 0.0 && u[0] * v[0] + u[1] * v[1] < 0.0
    };
    if let Some(i) = points.windows(3).position(turns_back) {
        return field.refuse(format!("at point {} the line turns back on itself", i + 1));
    }
    Some(RigidShape::Polyline { points: points.into_iter().map(in_space).collect() })
}

fn in_space([x, y]: [f64; 2]) -> [f64; 3] {
    [x, y, 0.0]
}
