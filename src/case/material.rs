//! Reads materials: the named ones of the case, inline ones, and those of a material file.
use std::collections::BTreeMap;

use super::node::{Node, Value};
use super::property::{property, temperature};
use super::reader::{Field, Fields};
use super::shape::existing_file;
use super::{MaterialCase, Property, nearest, plasticity};

/// The materials of a case by name; `None` where one has errors, which are noted.
pub(super) type Materials<'a> = BTreeMap<&'a str, Option<MaterialCase>>;

/// Reads `[material.*]`.
pub(super) fn read_all<'a>(fields: &Fields<'a>) -> Materials<'a> {
    let read_one = |(name, field): (&'a str, Field<'a>)| {
        let material = field.reader.open("material", field.node, &field.path).and_then(|m| read(&m, name));
        (name, material)
    };
    fields.named("material").into_iter().map(read_one).collect()
}

/// The material that a body, or an insert, asks for.
pub(super) fn of_body(body: &Fields<'_>, materials: &Materials<'_>) -> Option<MaterialCase> {
    let field = body.field("material")?;
    match &field.node.value {
        Value::Text(name) => named(&field, name, materials),
        Value::Table(_) if field.node.get("file").is_some() => from_file(&field),
        Value::Table(_) => {
            let name = format!("material of {}", body.path);
            read(&field.reader.open("material", field.node, &field.path)?, &name)
        }
        _ => field.wrong("the name of a material, or a table, is needed"),
    }
}

fn named(field: &Field<'_>, name: &str, materials: &Materials<'_>) -> Option<MaterialCase> {
    match materials.get(name) {
        Some(material) => material.clone(),
        None => {
            let names: Vec<&str> = materials.keys().copied().collect();
            let hint = match names.is_empty() {
                true => "write a table [material.NAME] with it".to_string(),
                false => nearest::hint(name, &names).trim_end().to_string(),
            };
            field.refuse(format!("there is no such material; {hint}"))
        }
    }
}

fn from_file(field: &Field<'_>) -> Option<MaterialCase> {
    let fields = field.reader.open("material reference", field.node, &field.path)?;
    let (path, name) = (existing_file(&fields, "file"), fields.text("name"));
    let (path, name) = (path?, name?);
    let shown = path.display().to_string();
    let root = std::fs::read_to_string(&path).map_err(|e| crate::Error::input(format!("{shown}: {e}")));
    let root = root.and_then(|text| Node::parse(&text, &shown));
    let root = root.map_err(|error| field.reader.note_error(&field.node.place, &error)).ok()?;
    let file = field.reader.open("material file", &root, "")?;
    // Only the one that is asked for is read: the others may be for other programs.
    let all = file.named("material");
    match all.iter().find(|(other, _)| *other == name) {
        Some((_, material)) => read(&field.reader.open("material", material.node, &material.path)?, name),
        None => {
            let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
            let hint = nearest::hint(name, &names);
            fields.field("name")?.refuse(format!("{shown} has no such material; {}", hint.trim_end()))
        }
    }
}

fn read(fields: &Fields<'_>, name: &str) -> Option<MaterialCase> {
    let young = property(fields, "young", |v| v > 0.0, "must be > 0");
    let poisson = property(
        fields,
        "poisson",
        |v| v > -1.0 && v < 0.5,
        "must be in (-1, 0.5): nu >= 0.5 needs a mixed \
        formulation, which kontakt does not have",
    );
    let expansion = property(fields, "expansion", |_| true, "");
    let reference = temperature(fields, "reference_temperature");
    let plasticity = fields.table("plasticity").and_then(|table| plasticity::of_material(&table));
    if fields.has("expansion") && !fields.has("reference_temperature") {
        fields.error_at("reference_temperature", "missing; 'expansion' needs the temperature it counts from");
    }
    Some(MaterialCase {
        name: name.to_string(),
        young: young?,
        poisson: poisson?,
        expansion,
        reference_temperature: reference.unwrap_or(0.0),
        plasticity,
    })
}

/// True if a property of the material, of heat, strength or stiffness, is a table over temperature.
pub(super) fn over_temperature(material: &MaterialCase) -> bool {
    let properties = [Some(&material.young), Some(&material.poisson), material.expansion.as_ref()];
    properties.into_iter().flatten().any(Property::is_table)
        || material.plasticity.as_ref().is_some_and(plasticity::over_temperature)
}
