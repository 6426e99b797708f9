//! A TOML document as a tree that remembers where each value was written.
use std::fmt;
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use super::Origin;
use crate::error::{Error, Result};

/// File and line of a value; line 0 where there is none (`--set`).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    pub file: Arc<str>,
    pub line: usize,
}

impl Place {
    pub fn origin(&self, key: impl Into<String>) -> Origin {
        Origin { file: self.file.to_string(), line: self.line, key: key.into() }
    }
}

/// A value and its place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Node {
    pub value: Value,
    pub place: Place,
}

/// What a TOML file can hold. Tables keep the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Bool(bool),
    Integer(i64),
    Float(f64),
    Text(String),
    Date(String),
    Array(Vec<Node>),
    Table(Vec<(String, Node)>),
}

impl Value {
    /// The kind of value, as a word for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::Bool(_) => "a boolean",
            Value::Integer(_) => "an integer",
            Value::Float(_) => "a number",
            Value::Text(_) => "a string",
            Value::Date(_) => "a date",
            Value::Array(_) => "an array",
            Value::Table(_) => "a table",
        }
    }
}

impl Node {
    /// Parses a document; the root is a table.
    pub fn parse(text: &str, file: &str) -> Result<Node> {
        let source = Source::new(text, file.into());
        let document = DeTable::parse(text).map_err(|e| source.syntax_error(&e))?;
        source.table(document.get_ref(), source.place(0))
    }

    /// Parses one value, as `--set` gives it.
    pub fn parse_value(text: &str, place: &Place) -> Option<Node> {
        let value = DeValue::parse(text).ok()?;
        let source = Source::new(text, place.file.clone());
        let mut node = source.value(value.get_ref(), place.clone()).ok()?;
        node.place_all(place);
        Some(node)
    }

    /// Entries of a table.
    pub fn entries(&self) -> Option<&[(String, Node)]> {
        match &self.value {
            Value::Table(entries) => Some(entries),
            _ => None,
        }
    }

    /// Value of a key, if this is a table that has it.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entries()?.iter().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// The string, if it is one.
    pub fn text(&self) -> Option<&str> {
        match &self.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    fn place_all(&mut self, place: &Place) {
        self.place = place.clone();
        match &mut self.value {
            Value::Array(items) => items.iter_mut().for_each(|item| item.place_all(place)),
            Value::Table(entries) => entries.iter_mut().for_each(|(_, node)| node.place_all(place)),
            _ => {}
        }
    }
}

/// Characters of a value that a message shows.
const SHOWN: usize = 200;

/// The text, cut where it is too long for a message.
pub(super) fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_string(),
    }
}

/// The value as TOML on one line.
impl fmt::Display for Node {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.value {
            Value::Bool(value) => write!(f, "{value}"),
            Value::Integer(value) => write!(f, "{value}"),
            Value::Float(value) if value.is_nan() => f.write_str("nan"),
            Value::Float(value) => write!(f, "{value:?}"),
            Value::Text(text) => f.write_str(&quoted(text)),
            Value::Date(text) => f.write_str(text),
            Value::Array(items) => {
                let items: Vec<String> = items.iter().map(Node::to_string).collect();
                write!(f, "[{}]", items.join(", "))
            }
            Value::Table(entries) => {
                let entries: Vec<String> =
                    entries.iter().map(|(key, node)| format!("{key} = {node}")).collect();
                write!(f, "{{ {} }}", entries.join(", "))
            }
        }
    }
}

/// A string in double quotes, on one line.
fn quoted(text: &str) -> String {
    let mut out = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

struct Source<'a> {
    text: &'a str,
    file: Arc<str>,
    /// Where lines end: a value's line is looked up, not counted, or a long table takes time with the square of its length.
    line_ends: Vec<usize>,
}

impl<'a> Source<'a> {
    fn new(text: &'a str, file: Arc<str>) -> Source<'a> {
        let line_ends = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i).collect();
        Source { text, file, line_ends }
    }

    fn place(&self, offset: usize) -> Place {
        Place { file: self.file.clone(), line: 1 + self.line_ends.partition_point(|end| *end < offset) }
    }

    fn syntax_error(&self, error: &toml::de::Error) -> Error {
        let line = self.place(error.span().map_or(0, |span| span.start)).line;
        let text = shortened(self.text.lines().nth(line - 1).unwrap_or("").trim());
        Error::Input(format!("{}:{line}: not valid TOML: {}: {text}", self.file, error.message()))
    }

    fn table(&self, table: &DeTable<'_>, place: Place) -> Result<Node> {
        let mut entries = Vec::with_capacity(table.len());
        for (key, value) in table {
            let node = self.value(value.get_ref(), self.place(key.span().start))?;
            entries.push((key.get_ref().to_string(), node));
        }
        // TOML tables come sorted by key or in file order, depending on a feature of the library.
        entries.sort_by_key(|(_, node)| node.place.line);
        Ok(Node { value: Value::Table(entries), place })
    }

    fn value(&self, value: &DeValue<'_>, place: Place) -> Result<Node> {
        let value = match value {
            DeValue::Boolean(value) => Value::Bool(*value),
            DeValue::Integer(value) => Value::Integer(
                i64::from_str_radix(value.as_str(), value.radix())
                    .map_err(|_| Error::Input(format!("{}:{}: integer too large", place.file, place.line)))?,
            ),
            DeValue::Float(value) => Value::Float(
                value
                    .as_str()
                    .parse()
                    .map_err(|_| Error::Input(format!("{}:{}: not a number", place.file, place.line)))?,
            ),
            DeValue::String(text) => Value::Text(text.to_string()),
            DeValue::Datetime(date) => Value::Date(date.to_string()),
            DeValue::Array(items) => {
                let items =
                    items.iter().map(|item| self.value(item.get_ref(), self.place(item.span().start)));
                Value::Array(items.collect::<Result<_>>()?)
            }
            DeValue::Table(table) => return self.table(table, place),
        };
        Ok(Node { value, place })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_remembered() {
        let root = Node::parse("a = 1\n[[body]]\nname = \"q\"\nmesh.x = [1,\n 2.5]\n", "f.toml").unwrap();
        let Value::Array(bodies) = &root.get("body").unwrap().value else { panic!("body is an array") };
        assert_eq!(bodies[0].place.line, 2);
        let x = bodies[0].get("mesh").unwrap().get("x").unwrap();
        let Value::Array(items) = &x.value else { panic!("x is an array") };
        assert_eq!((x.place.line, items[0].place.line, items[1].place.line), (4, 4, 5));
        assert_eq!(x.to_string(), "[1, 2.5]");
    }

    #[test]
    fn a_syntax_error_names_the_line() {
        let error = Node::parse("a = 1\nb = 2 mm\n", "f.toml").unwrap_err().to_string();
        assert!(error.starts_with("f.toml:2: not valid TOML"), "{error}");
    }

    #[test]
    fn what_is_shown_can_be_read_again() {
        let text = r#"{ a = [1, 2.5e-7, -inf], b = "q\"\\\n", c = { d = true } }"#;
        let place = Place { file: "--set".into(), line: 0 };
        let node = Node::parse_value(text, &place).unwrap();
        assert_eq!(Node::parse_value(&node.to_string(), &place).unwrap(), node);
    }
}
