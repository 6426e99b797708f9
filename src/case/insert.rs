//! Reads `[[body.insert]]`: the parts of a body that are of other materials.
use super::material::{self, Materials};
use super::reader::{Fields, all};
use super::within::within;
use super::{Geometry, Insert, InsertCells};

/// Inserts of one body: a cell knows its own by a byte.
const MOST: usize = u8::MAX as usize;

pub(super) fn read_all(
    body: &Fields<'_>,
    geometry: Option<&Geometry>,
    materials: &Materials<'_>,
) -> Option<Vec<Insert>> {
    let tables = body.tables("insert");
    if tables.len() > MOST {
        body.error_at("insert", format!("there are {}; a body has at most {MOST}", tables.len()));
    }
    all(tables.iter().map(|table| read(table, geometry, materials)))
}

fn read(fields: &Fields<'_>, geometry: Option<&Geometry>, materials: &Materials<'_>) -> Option<Insert> {
    let material = material::of_body(fields, materials);
    let (group, within) = (fields.line("group"), within(fields));
    let cells = match fields.given(&["group", "within"])[..] {
        ["group"] if matches!(geometry, Some(Geometry::Generated { .. })) => {
            let rule = "a generated mesh has no physical groups; say where the insert is by 'within'";
            fields.field("group")?.refuse(rule)
        }
        ["group"] => group.map(|name| InsertCells::Group(name.to_string())),
        ["within"] => within.map(InsertCells::Within),
        _ => {
            fields.error("exactly one of 'group' and 'within' is needed: which cells are of this material");
            None
        }
    };
    Some(Insert { cells: cells?, material: material?, origin: fields.origin() })
}
