//! Load steps: `[[step]]`.
use super::Origin;
use super::reader::Fields;

/// One load step: what acts at its end, as factors on the case's values. Steps do not accumulate.
#[derive(Debug, Clone, PartialEq)]
pub struct StepCase {
    /// Name, if it has one; unique among the steps.
    pub name: Option<String>,
    /// Factor on all loads.
    pub loads: f64,
    /// Factor on all prescribed displacements, those of rigid bodies included.
    pub supports: f64,
    /// Factor on temperature minus reference temperature.
    pub temperature: f64,
    /// Where it is written.
    pub origin: Origin,
}

/// Reads one step; every factor is 1 where it is not given.
pub(super) fn read(fields: &Fields<'_>) -> Option<StepCase> {
    let name = fields.line("name");
    if name.is_some_and(|name| name.trim().is_empty()) {
        return fields.field("name")?.refuse("a name must have a letter; leave it out for none");
    }
    let factor = |key: &str| match fields.number(key) {
        None if fields.has(key) => None,
        value => Some(value.unwrap_or(1.0)),
    };
    let (loads, supports, temperature) = (factor("loads"), factor("supports"), factor("temperature"));
    Some(StepCase {
        name: name.map(str::to_string),
        loads: loads?,
        supports: supports?,
        temperature: temperature?,
        origin: fields.origin(),
    })
}
