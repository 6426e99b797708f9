//! Changes to a case before it is read: `[[variant]]` tables and `--set`.
//!
//! Both name a place by a dotted path: `body.lower.support.0.y`. An item of an array of tables goes by its
//! `name`, or by its index from 0; index = length appends.
use super::nearest;
use super::node::{Node, Place, Value};
use crate::error::{Error, Result};

/// Puts `node` at `path`, replacing what is there and creating tables on the way.
pub(super) fn set(root: &mut Node, path: &str, node: Node) -> Result<()> {
    let place = node.place.clone();
    let segments = split(path, &place)?;
    let mut here = root;
    for (depth, segment) in segments[..segments.len() - 1].iter().enumerate() {
        here = child(here, segment, segments[depth + 1], path, &place)?;
    }
    let last = segments[segments.len() - 1];
    match &mut here.value {
        Value::Table(entries) => match entries.iter_mut().find(|(key, _)| key == last) {
            Some((_, old)) => *old = node,
            None => entries.push((last.to_string(), node)),
        },
        Value::Array(items) => match find(items, last) {
            Some(i) => items[i] = node,
            None if last.parse() == Ok(items.len()) => items.push(node),
            None => return Err(no_item(items, last, path, &place)),
        },
        _ => return Err(not_a_table(here, last, path, &place)),
    }
    Ok(())
}

/// Removes what is at `path`.
pub(super) fn remove(root: &mut Node, path: &str, place: &Place) -> Result<()> {
    let segments = split(path, place)?;
    let mut here = root;
    for segment in &segments[..segments.len() - 1] {
        let position = match &here.value {
            Value::Table(entries) => entries.iter().position(|(key, _)| key == segment),
            Value::Array(items) => find(items, segment),
            _ => return Err(not_a_table(here, segment, path, place)),
        };
        here = match (&mut here.value, position) {
            (Value::Table(entries), Some(i)) => &mut entries[i].1,
            (Value::Array(items), Some(i)) => &mut items[i],
            (Value::Array(items), None) => return Err(no_item(items, segment, path, place)),
            (value, _) => return Err(no_key(value, segment, path, place)),
        };
    }
    let last = segments[segments.len() - 1];
    match &mut here.value {
        Value::Table(entries) => match entries.iter().position(|(key, _)| key == last) {
            Some(i) => drop(entries.remove(i)),
            None => return Err(no_key(&here.value, last, path, place)),
        },
        Value::Array(items) => match find(items, last) {
            Some(i) => drop(items.remove(i)),
            None => return Err(no_item(items, last, path, place)),
        },
        _ => return Err(not_a_table(here, last, path, place)),
    }
    Ok(())
}

/// Applies `--set path=value`: the value is TOML, or else a string.
pub(super) fn set_from_command_line(root: &mut Node, argument: &str) -> Result<()> {
    let place = Place { file: "--set".into(), line: 0 };
    let Some((path, text)) = argument.split_once('=') else {
        return Err(Error::Input(format!(
            "--set {argument}: expected PATH=VALUE, such as body.lower.temperature=400"
        )));
    };
    let (path, text) = (path.trim(), text.trim());
    let node = Node::parse_value(text, &place)
        .unwrap_or_else(|| Node { value: Value::Text(text.to_string()), place: place.clone() });
    set(root, path, node)
}

/// Segments of a dotted path.
fn split<'a>(path: &'a str, place: &Place) -> Result<Vec<&'a str>> {
    let segments: Vec<&str> = path.split('.').map(str::trim).collect();
    match segments.iter().any(|s| s.is_empty()) {
        true => Err(place
            .origin(path)
            .error("a path is names with dots between them, such as body.lower.temperature")),
        false => Ok(segments),
    }
}

/// The table or array below `here` that `segment` names; a missing one is created.
fn child<'a>(
    here: &'a mut Node,
    segment: &str,
    next: &str,
    path: &str,
    place: &Place,
) -> Result<&'a mut Node> {
    if !matches!(here.value, Value::Table(_) | Value::Array(_)) {
        return Err(not_a_table(here, segment, path, place));
    }
    match &mut here.value {
        Value::Array(items) => match find(items, segment) {
            Some(i) => Ok(&mut items[i]),
            None => Err(no_item(items, segment, path, place)),
        },
        Value::Table(entries) => {
            let i = entries.iter().position(|(key, _)| key == segment).unwrap_or_else(|| {
                let value = match next.parse::<usize>() {
                    Ok(_) => Value::Array(Vec::new()),
                    Err(_) => Value::Table(Vec::new()),
                };
                entries.push((segment.to_string(), Node { value, place: place.clone() }));
                entries.len() - 1
            });
            Ok(&mut entries[i].1)
        }
        _ => Err(Error::internal("case path: neither table nor array")),
    }
}

fn find(items: &[Node], segment: &str) -> Option<usize> {
    items
        .iter()
        .position(|item| item.get("name").and_then(Node::text) == Some(segment))
        .or_else(|| segment.parse().ok().filter(|&i: &usize| i < items.len()))
}

fn no_item(items: &[Node], segment: &str, path: &str, place: &Place) -> Error {
    let names: Vec<&str> = items.iter().filter_map(|item| item.get("name").and_then(Node::text)).collect();
    let indices = match items.len() {
        0 => "it has no items".to_string(),
        n => format!("or an index from 0 to {}", n - 1),
    };
    place
        .origin(path)
        .error(format!("there is no item '{segment}'; {}{indices}", nearest::hint(segment, &names)))
}

fn no_key(value: &Value, segment: &str, path: &str, place: &Place) -> Error {
    let names: Vec<&str> = match value {
        Value::Table(entries) => entries.iter().map(|(key, _)| key.as_str()).collect(),
        _ => Vec::new(),
    };
    place.origin(path).error(format!("there is no '{segment}' to remove; {}", nearest::hint(segment, &names)))
}

fn not_a_table(node: &Node, segment: &str, path: &str, place: &Place) -> Error {
    place
        .origin(path)
        .error(format!("cannot go to '{segment}': what is before it is {}, {node}", node.value.kind()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "[[body]]\nname = \"lower\"\nmesh.rectangle.x = { cells = 5 }\n[[body.load]]\npressure = 1\n";

    fn tree() -> Node {
        Node::parse(TEXT, "f.toml").unwrap()
    }

    fn at<'a>(root: &'a Node, path: &[&str]) -> &'a Node {
        path.iter().fold(root, |node, segment| match &node.value {
            Value::Array(items) => &items[find(items, segment).unwrap()],
            _ => node.get(segment).unwrap(),
        })
    }

    #[test]
    fn paths_go_through_names_and_indices() {
        let mut root = tree();
        set_from_command_line(&mut root, "body.lower.mesh.rectangle.x.cells = 9").unwrap();
        set_from_command_line(&mut root, "body.0.load.0.pressure=100 MPa").unwrap();
        set_from_command_line(&mut root, "body.lower.load.1={ force = [1, 0] }").unwrap();
        set_from_command_line(&mut root, "output.stress=yy").unwrap();
        assert_eq!(at(&root, &["body", "lower", "mesh", "rectangle", "x", "cells"]).value, Value::Integer(9));
        assert_eq!(at(&root, &["body", "lower", "load", "0", "pressure"]).text(), Some("100 MPa"));
        assert_eq!(at(&root, &["body", "lower", "load", "1", "force"]).to_string(), "[1, 0]");
        assert_eq!(at(&root, &["output", "stress"]).text(), Some("yy"));
        assert_eq!(at(&root, &["output", "stress"]).place.origin("k").to_string(), "--set: k");
    }

    #[test]
    fn removal() {
        let mut root = tree();
        let place = Place { file: "f.toml".into(), line: 7 };
        remove(&mut root, "body.lower.load.0", &place).unwrap();
        assert_eq!(at(&root, &["body", "lower", "load"]).value, Value::Array(Vec::new()));
        remove(&mut root, "body.lower.load", &place).unwrap();
        let error = remove(&mut root, "body.lower.load", &place).unwrap_err().to_string();
        assert!(error.contains("f.toml:7: body.lower.load: there is no 'load' to remove"), "{error}");
    }

    #[test]
    fn wrong_paths_say_what_there_is() {
        for (argument, text) in [
            ("body.lowr.temperature=1", "there is no item 'lowr'; did you mean 'lower'?"),
            ("body.2.temperature=1", "or an index from 0 to 0"),
            ("body.lower.name.x=1", "cannot go to 'x': what is before it is a string, \"lower\""),
            ("body..x=1", "a path is names with dots"),
            ("body.lower", "expected PATH=VALUE"),
        ] {
            let error = set_from_command_line(&mut tree(), argument).unwrap_err().to_string();
            assert!(error.contains(text), "{argument}: {error}");
        }
    }
}
