//! Reads materials: the named ones of the case, inline ones, and those of a material file.
use std::collections::BTreeMap;

use super::node::{Node, Value};
use super::reader::{Field, Fields, join};
use super::shape::existing_file;
use super::{MaterialCase, Property, Units, nearest, plasticity};

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

/// A temperature; in SI it is not below absolute zero.
pub(super) fn temperature(fields: &Fields<'_>, key: &str) -> Option<f64> {
    let units = fields.reader.units;
    fields.number_if(key, |value| units == Units::Consistent || value >= 0.0, "must be >= 0 K")
}

/// A property, every value of which keeps a rule.
pub(super) fn property(
    fields: &Fields<'_>,
    key: &str,
    good: impl Fn(f64) -> bool,
    rule: &str,
) -> Option<Property> {
    let field = fields.field(key)?;
    let dimension = field.dimension();
    if field.node.entries().is_none() {
        let value = field.number(dimension)?;
        return if good(value) { Some(Property::Constant(value)) } else { field.refuse(rule) };
    }
    let table = field.reader.open("property", field.node, &field.path)?;
    let (temperatures, values) = (table.numbers("temperature"), table.field("value"));
    let values = values.and_then(|values| values.numbers(dimension));
    let (temperatures, values) = (temperatures?, values?);
    if temperatures.len() != values.len() || values.len() < 2 {
        table.error(format!(
            "{} temperatures and {} values were given; at least two of each are needed, as many of \
            one as of the other",
            temperatures.len(),
            values.len()
        ));
        return None;
    }
    if let Some(w) = temperatures.windows(2).find(|w| w[0] >= w[1]) {
        table.error_at("temperature", format!("{} follows {}; temperatures must increase", w[1], w[0]));
        return None;
    }
    if let Some(i) = values.iter().position(|value| !good(*value)) {
        let place = join("value", &i.to_string());
        table.error_at("value", format!("{} was given ({place}); {rule}", values[i]));
        return None;
    }
    Some(Property::Table(temperatures.into_iter().zip(values).collect()))
}
