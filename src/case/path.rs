//! Load paths: `[path.NAME]`, and `paths` of the `[[step]]` tables.
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};

use super::Origin;
use super::nearest;
use super::node::{Node, Value};
use super::reader::{Field, Fields};

/// A path: what follows it has its factor in place of the general one.
#[derive(Debug, Clone, PartialEq)]
pub struct PathCase {
    /// Name; unique, and what the paths are sorted by.
    pub name: String,
    /// The factor over the path parameter; `None`: the steps give it one by one.
    pub table: Option<PathTable>,
    /// Where it is written.
    pub origin: Origin,
}

/// A factor over the path parameter: linear between its rows, constant beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct PathTable {
    /// Path parameters, increasing; at least two.
    pub at: Vec<f64>,
    /// The factor at each of them.
    pub factor: Vec<f64>,
}

impl PathTable {
    /// The factor at a path parameter; at a row that of the row, to the last bit.
    pub fn at(&self, parameter: f64) -> f64 {
        let after = self.at.partition_point(|at| *at <= parameter);
        match (after.checked_sub(1), self.at.get(after)) {
            (None, _) => self.factor[0],
            (Some(before), None) => self.factor[before],
            (Some(before), Some(end)) => {
                let share = (parameter - self.at[before]) / (end - self.at[before]);
                self.factor[before] + share * (self.factor[after] - self.factor[before])
            }
        }
    }
}

/// The paths as they are named all over the case, and which of them something follows.
pub(super) struct Paths {
    names: Vec<String>,
    followed: RefCell<BTreeSet<usize>>,
    /// True if something follows a path that is not known: which one it means is not, either.
    unsure: Cell<bool>,
}

impl Paths {
    /// All that `[path]` and the steps give, right or wrong.
    pub fn named_in(case: &Node) -> Paths {
        let keys = |node: Option<&Node>| -> Vec<String> {
            node.and_then(Node::entries).unwrap_or_default().iter().map(|(name, _)| name.clone()).collect()
        };
        let steps = match case.get("step").map(|node| &node.value) {
            Some(Value::Array(steps)) => &steps[..],
            _ => &[],
        };
        let in_steps = steps.iter().flat_map(|step| keys(step.get("paths")));
        let names: BTreeSet<String> = keys(case.get("path")).into_iter().chain(in_steps).collect();
        Paths { names: names.into_iter().collect(), followed: RefCell::default(), unsure: Cell::new(false) }
    }

    /// The path that a load, a support, a temperature or a motion follows, if it follows one.
    pub fn followed_by(&self, fields: &Fields<'_>) -> Option<usize> {
        let Some(name) = fields.name("path") else {
            self.unsure.set(self.unsure.get() || fields.has("path"));
            return None;
        };
        let known: Vec<&str> = self.names.iter().map(String::as_str).collect();
        match known.iter().position(|known| *known == name) {
            Some(index) => {
                self.followed.borrow_mut().insert(index);
                Some(index)
            }
            None => {
                self.unsure.set(true);
                let hint = nearest::hint(name, &known);
                let rule = format!(
                    "no such path is given, neither by [path.{name}] nor by 'paths' of a [[step]]; {hint}"
                );
                fields.field("path")?.refuse(rule.trim_end().trim_end_matches(';'))
            }
        }
    }

    /// The names of those that something follows.
    fn followed(&self) -> Vec<&str> {
        self.followed.borrow().iter().map(|&i| self.names[i].as_str()).collect()
    }

    /// Notes a path that nothing follows, at the place where it is given.
    fn refuse_idle(&self, name: &str, given: &Field<'_>) {
        let followed = self.followed();
        if !followed.contains(&name) && !self.unsure.get() {
            let hint = nearest::hint(name, &followed);
            let text = format!(
                "nothing follows this path: no load, support, temperature or motion has path = \"{name}\"; {hint}"
            );
            given.error(text.trim_end().trim_end_matches(';'));
        }
    }
}

/// Reads `[path]`, after all that may follow a path was read.
pub(super) fn read_all(case: &Fields<'_>, paths: &Paths) -> Vec<PathCase> {
    let mut tables = BTreeMap::new();
    for (name, field) in case.named("path") {
        paths.refuse_idle(name, &field);
        if !case.has("step") {
            field.error("a path leads through the steps, and there is no [[step]]");
        }
        let Some(fields) = field.reader.open("path", field.node, &field.path) else { continue };
        tables.insert(name, (table(&fields), fields.origin()));
    }
    let path = |name: &String| {
        let (table, origin) = tables.remove(name.as_str()).unwrap_or_default();
        PathCase { name: name.clone(), table, origin }
    };
    paths.names.iter().map(path).collect()
}

fn table(fields: &Fields<'_>) -> Option<PathTable> {
    let (at, factor) = (fields.numbers("at"), fields.numbers("factor"));
    let (at, factor) = (at?, factor?);
    if at.len() < 2 {
        return fields.field("at")?.refuse("at least two path parameters are needed");
    }
    if let Some(i) = at.windows(2).position(|pair| pair[0] >= pair[1]) {
        let rule = format!("path parameters increase, and {} comes after {}", at[i + 1], at[i]);
        return fields.field("at")?.refuse(rule);
    }
    if at.len() != factor.len() {
        let rule =
            format!("{} factors for {} path parameters; there is one for each", factor.len(), at.len());
        return fields.field("factor")?.refuse(rule);
    }
    Some(PathTable { at, factor })
}

/// Factors that a step gives to paths by name: index and factor.
pub(super) fn of_step(step: &Fields<'_>, paths: &Paths, tables: &[PathCase]) -> Vec<(usize, f64)> {
    let Some(field) = step.field("paths") else { return Vec::new() };
    let Some(entries) = field.node.entries() else {
        field.wrong::<()>("a table of factors is needed, such as paths = { NAME = 0.5 }");
        return Vec::new();
    };
    let mut factors = Vec::new();
    for (name, node) in entries {
        let part = field.part(node, name);
        paths.refuse_idle(name, &part);
        let Some(index) = paths.names.iter().position(|known| known == name) else { continue };
        if tables[index].table.is_some() {
            part.error(format!("this path has a table, [path.{name}]: its factor comes from 'at'"));
        }
        factors.extend(part.number(part.dimension()).map(|factor| (index, factor)));
    }
    factors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_linear_between_its_rows_and_constant_beyond() {
        let table = PathTable { at: vec![0.1, 0.3, 1.7], factor: vec![0.2, 1.1, -0.7] };
        for (at, factor) in std::iter::zip(&table.at, &table.factor) {
            assert_eq!(table.at(*at), *factor);
        }
        assert!((table.at(0.2) - 0.65).abs() < 1e-15 && (table.at(1.0) - 0.2).abs() < 1e-15);
        assert_eq!([-3.0, 0.0, 2.0, 1e300].map(|at| table.at(at)), [0.2, 0.2, -0.7, -0.7]);
    }
}
