//! Reads properties, perhaps tables over temperature.
use super::reader::{Fields, join};
use super::{Property, Units};

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
