//! Load steps: `[[step]]`.
use super::Origin;
use super::node::Value;
use super::path::{self, PathCase, Paths};
use super::reader::Fields;

/// One load step: what acts at its end, as factors on the case's values. Steps do not accumulate.
#[derive(Debug, Clone, PartialEq)]
pub struct StepCase {
    /// Name, if it has one; unique among the steps.
    pub name: Option<String>,
    /// Factor on all loads that follow no path.
    pub loads: f64,
    /// Factor on all prescribed displacements that follow no path, those of rigid bodies included.
    pub supports: f64,
    /// Factor on temperature minus reference temperature, where that follows no path.
    pub temperature: f64,
    /// Path parameter; 0 without tables.
    pub at: f64,
    /// Factor of each path of the case.
    pub paths: Vec<f64>,
    /// How the way to the end of the step is divided.
    pub increments: Increments,
    /// Where it is written.
    pub origin: Origin,
}

/// Parts of a load step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Increments {
    /// So many of one size; a part that fails is halved.
    Equal(usize),
    /// As large as the contact allows.
    Automatic,
}

impl Increments {
    /// So many there are at least.
    pub fn least(self) -> usize {
        match self {
            Increments::Equal(n) => n,
            Increments::Automatic => 1,
        }
    }
}

impl StepCase {
    /// Everything as written, in one step.
    pub fn whole() -> StepCase {
        StepCase {
            name: None,
            loads: 1.0,
            supports: 1.0,
            temperature: 1.0,
            at: 0.0,
            paths: Vec::new(),
            increments: Increments::Equal(1),
            origin: Origin::default(),
        }
    }
}

/// Reads the steps; `has_tables`: there are paths with tables, right or wrong. A factor that a step does not give is 1, that of a path is as it was after the step before, at first 0.
pub(super) fn read_all(
    tables: &[Fields<'_>],
    paths: &Paths,
    cases: &[PathCase],
    has_tables: bool,
) -> Option<Vec<StepCase>> {
    let (mut at, mut factors) = (0.0, vec![0.0; cases.len()]);
    let mut steps = Vec::new();
    for fields in tables {
        let parameter = parameter(fields, has_tables, at);
        at = parameter.unwrap_or(at);
        path::of_step(fields, paths, cases).into_iter().for_each(|(i, factor)| factors[i] = factor);
        for (factor, path) in std::iter::zip(&mut factors, cases) {
            *factor = path.table.as_ref().map_or(*factor, |table| table.at(at));
        }
        steps.push(read(fields, at, &factors));
    }
    steps.into_iter().collect()
}

fn read(fields: &Fields<'_>, at: f64, paths: &[f64]) -> Option<StepCase> {
    let name = fields.line("name");
    let increments = increments(fields);
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
        at,
        paths: paths.to_vec(),
        increments: increments.unwrap_or(Increments::Equal(1)),
        origin: fields.origin(),
    })
}

/// The path parameter, which the steps must give if there are tables over it, and only then.
fn parameter(fields: &Fields<'_>, has_tables: bool, before: f64) -> Option<f64> {
    let Some(at) = fields.number("at") else {
        if has_tables && !fields.has("at") {
            fields.error_at(
                "at",
                "missing; a [path.NAME] table needs the path parameter at the end of each step",
            );
        }
        return None;
    };
    if !has_tables {
        return fields.field("at")?.refuse("'at' is the path parameter, and there is no [path.NAME] table");
    }
    match at > before {
        true => Some(at),
        false => fields.field("at")?.refuse(format!(
            "the path parameter begins at 0 and increases from step to step; here it must be > {before}"
        )),
    }
}

fn increments(fields: &Fields<'_>) -> Option<Increments> {
    let field = fields.field("steps")?;
    match &field.node.value {
        Value::Text(text) if text == "auto" => Some(Increments::Automatic),
        Value::Text(_) => field.refuse("a count of increments or \"auto\" is needed"),
        _ => field.count().map(Increments::Equal),
    }
}
