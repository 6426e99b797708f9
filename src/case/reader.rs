//! Reads typed values out of the tree, as the schema describes them, and gathers every error on the way.
//!
//! A reading function returns `None` where the key is absent or an error was noted: nothing needs to tell the
//! two apart, since a case with any error is refused as a whole by [`Reader::finish`].
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::PathBuf;

use super::expression::Expression;
use super::node::{Node, Place, Value, shortened};
use super::schema::{self, Default, Key, Kind, Table};
use super::units::{self, Dimension};
use super::{Origin, Scalar, Units, nearest};
use crate::error::{Error, Result};
use crate::plain_text::is_plain;

/// Bytes of the longest text, an expression or a list of options: HDF5 takes 64 kB for an attribute.
const LONGEST_TEXT: usize = 10_000;
/// Characters of the longest title or surface: what a picture can show of them is less.
pub(super) const LONGEST_LINE: usize = 200;
/// Characters of the longest name: it stands in file names, which may have 255 bytes, and in names of options.
const LONGEST_NAME: usize = 100;

/// What all tables share: the units, the directory paths start from, and the errors so far.
pub(super) struct Reader {
    pub units: Units,
    pub directory: PathBuf,
    errors: RefCell<Vec<(Place, String)>>,
    /// (table, key) of every key that was asked for; a test compares it with the schema.
    pub asked: RefCell<BTreeSet<(&'static str, &'static str)>>,
}

/// A table of the case, opened with its schema.
pub(super) struct Fields<'a> {
    pub reader: &'a Reader,
    pub node: &'a Node,
    pub path: String,
    table: &'static Table,
}

/// A value, with its full key.
pub(super) struct Field<'a> {
    pub reader: &'a Reader,
    pub node: &'a Node,
    pub path: String,
    kind: Kind,
}

impl Reader {
    pub fn new(units: Units, directory: PathBuf) -> Self {
        Reader { units, directory, errors: Vec::new().into(), asked: BTreeSet::new().into() }
    }

    pub fn note(&self, place: &Place, path: &str, message: impl std::fmt::Display) {
        let text = place.origin(path).error(message).to_string();
        self.errors.borrow_mut().push((place.clone(), text));
    }

    /// Notes an error that already says where.
    pub fn note_error(&self, place: &Place, error: &Error) {
        self.errors.borrow_mut().push((place.clone(), error.to_string()));
    }

    /// The value, or all errors: by file, then line, one on each line of the text.
    pub fn finish<T>(self, value: Option<T>) -> Result<T> {
        let mut errors = self.errors.into_inner();
        errors.sort_by(|(a, _), (b, _)| (&a.file, a.line).cmp(&(&b.file, b.line)));
        let mut texts: Vec<String> = errors.into_iter().map(|(_, text)| text).collect();
        texts.dedup();
        match value {
            Some(value) if texts.is_empty() => Ok(value),
            _ if texts.is_empty() => Err(Error::internal("case: refused without a reason")),
            _ => Err(Error::Input(texts.join("\n"))),
        }
    }

    /// Opens `node` as a table of the schema; refuses keys that are not in it.
    pub fn open<'a>(&'a self, table: &str, node: &'a Node, path: &str) -> Option<Fields<'a>> {
        let Some(table) = schema::table(table) else {
            self.note(&node.place, path, format!("internal: table '{table}' is not in the schema"));
            return None;
        };
        let Some(entries) = node.entries() else {
            let given = shortened(&node.to_string());
            self.note(&node.place, path, format!("{given} is {}; a table is needed", node.value.kind()));
            return None;
        };
        let names: Vec<&str> = table.keys.iter().map(|key| key.name).collect();
        for (name, value) in entries.iter().filter(|(name, _)| !names.contains(&name.as_str())) {
            let hint = nearest::hint(name, &names);
            let name = shortened(name);
            self.note(&value.place, &join(path, &name), format!("unknown key '{name}'; {}", hint.trim_end()));
        }
        Some(Fields { reader: self, node, path: path.to_string(), table })
    }
}

/// `path.key`.
pub(super) fn join(path: &str, key: &str) -> String {
    match path {
        "" => key.to_string(),
        _ => format!("{path}.{key}"),
    }
}

impl<'a> Fields<'a> {
    pub fn origin(&self) -> Origin {
        self.node.place.origin(&self.path)
    }

    /// Notes an error of the table as a whole.
    pub fn error(&self, message: impl std::fmt::Display) {
        self.reader.note(&self.node.place, &self.path, message);
    }

    /// Notes an error of a key: at its value, or at the table where it is absent.
    pub fn error_at(&self, key: &str, message: impl std::fmt::Display) {
        let place = self.node.get(key).map_or(&self.node.place, |node| &node.place);
        self.reader.note(place, &join(&self.path, key), message);
    }

    pub fn has(&self, key: &str) -> bool {
        self.node.get(key).is_some()
    }

    /// Those of `keys` that are given.
    pub fn given<'k>(&self, keys: &[&'k str]) -> Vec<&'k str> {
        keys.iter().copied().filter(|key| self.has(key)).collect()
    }

    /// The value of a key; its absence is noted if the schema requires it.
    pub fn field(&self, name: &str) -> Option<Field<'a>> {
        let Some(key) = self.table.keys.iter().find(|key| key.name == name) else {
            self.error(format!("internal: key '{name}' is not in the schema of '{}'", self.table.name));
            return None;
        };
        let Key { kind, default, meaning, .. } = key;
        self.reader.asked.borrow_mut().insert((self.table.name, key.name));
        let path = join(&self.path, name);
        match self.node.get(name) {
            Some(node) => Some(Field { reader: self.reader, node, path, kind: *kind }),
            None => {
                if *default == Default::Required {
                    self.reader.note(&self.node.place, &path, format!("missing; it is required: {meaning}"));
                }
                None
            }
        }
    }

    pub fn text(&self, key: &str) -> Option<&'a str> {
        let field = self.field(key)?;
        field.expect(matches!(field.kind, Kind::Text))?;
        field.text()
    }

    /// A title, or the name that a surface or group has in a mesh file.
    pub fn line(&self, key: &str) -> Option<&'a str> {
        let field = self.field(key)?;
        field.expect(matches!(field.kind, Kind::Text))?;
        field.line(LONGEST_LINE)
    }

    /// A name: letters, digits, `_`, `-`; so that it can stand in paths, options and file names.
    pub fn name(&self, key: &str) -> Option<&'a str> {
        let field = self.field(key)?;
        field.expect(matches!(field.kind, Kind::Name))?;
        let name = field.line(LONGEST_NAME)?;
        let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        match !name.is_empty() && name.chars().all(good) {
            true => Some(name),
            false => field.refuse("a name is made of letters, digits, '_' and '-'"),
        }
    }

    pub fn texts(&self, key: &str) -> Option<Vec<&'a str>> {
        let field = self.field(key)?;
        field.expect(matches!(field.kind, Kind::Texts))?;
        all(field.items()?.into_iter().map(|item| item.line(LONGEST_LINE)))
    }

    /// Index of the string among the choices of the schema.
    pub fn choice(&self, key: &str) -> Option<usize> {
        let field = self.field(key)?;
        let Kind::Choice(choices) = field.kind else { return field.mismatch() };
        let text = field.text()?;
        choices.iter().position(|choice| *choice == text).or_else(|| {
            let hint = nearest::hint(text, choices);
            field.refuse(format!("{}; {}", one_of(choices), hint.trim_end()))
        })
    }

    pub fn count(&self, key: &str) -> Option<usize> {
        let field = self.field(key)?;
        field.expect(matches!(field.kind, Kind::Count))?;
        field.count()
    }

    pub fn natural(&self, key: &str, most: usize) -> Option<usize> {
        let field = self.field(key)?;
        field.expect(matches!(field.kind, Kind::Natural))?;
        field.natural(most)
    }

    pub fn flag(&self, key: &str) -> Option<bool> {
        let field = self.field(key)?;
        field.expect(matches!(field.kind, Kind::Flag))?;
        match field.node.value {
            Value::Bool(value) => Some(value),
            _ => field.wrong("true or false is needed"),
        }
    }

    pub fn number(&self, key: &str) -> Option<f64> {
        let field = self.field(key)?;
        let Kind::Number(dimension) = field.kind else { return field.mismatch() };
        field.number(dimension)
    }

    /// A number that keeps a rule, which the message states ("must be > 0").
    pub fn number_if(&self, key: &str, good: impl Fn(f64) -> bool, rule: &str) -> Option<f64> {
        let value = self.number(key)?;
        match good(value) {
            true => Some(value),
            false => self.field(key)?.refuse(rule),
        }
    }

    pub fn scalar(&self, key: &str) -> Option<Scalar> {
        let field = self.field(key)?;
        let Kind::Scalar(dimension) = field.kind else { return field.mismatch() };
        field.scalar(dimension)
    }

    pub fn numbers(&self, key: &str) -> Option<Vec<f64>> {
        let field = self.field(key)?;
        let Kind::Numbers(dimension) = field.kind else { return field.mismatch() };
        field.numbers(dimension)
    }

    pub fn point(&self, key: &str) -> Option<[f64; 2]> {
        let field = self.field(key)?;
        let Kind::Point(dimension) = field.kind else { return field.mismatch() };
        field.point(dimension)
    }

    pub fn points(&self, key: &str) -> Option<Vec<[f64; 2]>> {
        let field = self.field(key)?;
        let Kind::Points(dimension) = field.kind else { return field.mismatch() };
        all(field.items()?.into_iter().map(|item| item.point(dimension)))
    }

    pub fn vector(&self, key: &str) -> Option<[Scalar; 2]> {
        let field = self.field(key)?;
        let Kind::Vector(dimension) = field.kind else { return field.mismatch() };
        let [x, y] = field.pair()?;
        let (x, y) = (x.scalar(dimension), y.scalar(dimension));
        Some([x?, y?])
    }

    pub fn table(&self, key: &str) -> Option<Fields<'a>> {
        let field = self.field(key)?;
        let Kind::Table(name) = field.kind else { return field.mismatch() };
        self.reader.open(name, field.node, &field.path)
    }

    /// The tables of an array of tables; each is known by its name, or else by its index.
    pub fn tables(&self, key: &str) -> Vec<Fields<'a>> {
        let Some(field) = self.field(key) else { return Vec::new() };
        let Kind::Tables(table) = field.kind else { return field.mismatch().unwrap_or_default() };
        let Value::Array(items) = &field.node.value else {
            field.wrong::<()>(&format!("an array of tables is needed: write [[{table}]], or [{{ ... }}]"));
            return Vec::new();
        };
        let open = |(i, node): (usize, &'a Node)| {
            let label = match node.get("name").and_then(Node::text) {
                Some(name) if !name.is_empty() && !name.contains('.') => name.to_string(),
                _ => i.to_string(),
            };
            self.reader.open(table, node, &join(&field.path, &label))
        };
        items.iter().enumerate().filter_map(open).collect()
    }

    /// The tables below a key, each with its name.
    pub fn named(&self, key: &str) -> Vec<(&'a str, Field<'a>)> {
        let Some(field) = self.field(key) else { return Vec::new() };
        let Kind::Named(_) = field.kind else { return field.mismatch().unwrap_or_default() };
        let Some(entries) = field.node.entries() else {
            field.wrong::<()>("a table is needed");
            return Vec::new();
        };
        let item = |(name, node): &'a (String, Node)| (name.as_str(), field.part(node, name));
        entries.iter().map(item).collect()
    }
}

impl<'a> Field<'a> {
    /// Notes an error of this value.
    pub fn error(&self, message: impl std::fmt::Display) {
        self.reader.note(&self.node.place, &self.path, message);
    }

    /// Notes the value given and the rule it breaks.
    pub fn refuse<T>(&self, rule: impl std::fmt::Display) -> Option<T> {
        self.error(format!("{} was given; {rule}", shortened(&self.node.to_string())));
        None
    }

    /// Notes a value of the wrong type.
    pub fn wrong<T>(&self, needed: &str) -> Option<T> {
        self.error(format!("{} is {}; {needed}", shortened(&self.node.to_string()), self.node.value.kind()));
        None
    }

    fn mismatch<T>(&self) -> Option<T> {
        self.error("internal: read as another type than the schema says");
        None
    }

    fn expect(&self, as_in_schema: bool) -> Option<()> {
        if as_in_schema { Some(()) } else { self.mismatch() }
    }

    /// A part of this value.
    pub fn part(&self, node: &'a Node, label: &str) -> Field<'a> {
        Field { reader: self.reader, node, path: join(&self.path, label), kind: self.kind }
    }

    /// A text that may stand in files, pictures and on a terminal.
    pub fn text(&self) -> Option<&'a str> {
        let text = self.node.text().or_else(|| self.wrong("a string is needed"))?;
        if text.len() > LONGEST_TEXT {
            return self.refuse(format!("it is longer than {LONGEST_TEXT} bytes"));
        }
        match text.chars().find(|c| !is_plain(*c) && !['\n', '\t'].contains(c)) {
            Some(c) => {
                self.refuse(format!("control characters (here {}) are not allowed", c.escape_unicode()))
            }
            None => Some(text),
        }
    }

    /// A text on one line, short enough to be drawn and stored as an attribute.
    pub fn line(&self, most: usize) -> Option<&'a str> {
        let text = self.text()?;
        match text.chars().count() > most || text.contains(['\n', '\t']) {
            true => self.refuse(format!("at most {most} characters on one line are allowed")),
            false => Some(text),
        }
    }

    pub fn count(&self) -> Option<usize> {
        match self.node.value {
            Value::Integer(n @ 1..=1_000_000) => usize::try_from(n).ok(),
            Value::Integer(_) => self.refuse("an integer from 1 to 1000000 is needed"),
            _ => self.wrong("a positive integer is needed"),
        }
    }

    /// An integer from 0 to `most`.
    pub fn natural(&self, most: usize) -> Option<usize> {
        match self.node.value {
            Value::Integer(n) => usize::try_from(n)
                .ok()
                .filter(|n| *n <= most)
                .or_else(|| self.refuse(format!("an integer from 0 to {most} is needed"))),
            _ => self.wrong("an integer, 0 or more, is needed"),
        }
    }

    /// The dimension that the schema gives to a value of several forms.
    pub fn dimension(&self) -> Dimension {
        match self.kind {
            Kind::Either(_, dimension) | Kind::Property(dimension) => dimension,
            _ => Dimension::NUMBER,
        }
    }

    /// A finite number, in the units of the case.
    pub fn number(&self, dimension: Dimension) -> Option<f64> {
        let value = match &self.node.value {
            Value::Integer(value) => *value as f64,
            Value::Float(value) => *value,
            Value::Text(text) => self.with_unit(text, dimension)?,
            _ => return self.wrong("a number is needed"),
        };
        match value.is_finite() {
            true => Some(value),
            false => self.refuse("a finite number is needed"),
        }
    }

    fn with_unit(&self, text: &str, dimension: Dimension) -> Option<f64> {
        if self.units == Units::Consistent && dimension != Dimension::ANGLE {
            return self.refuse("with units = \"consistent\" a number stands without a unit");
        }
        units::convert(text, dimension, &self.path).map_err(|message| self.error(message)).ok()
    }

    pub fn scalar(&self, dimension: Dimension) -> Option<Scalar> {
        match &self.node.value {
            Value::Text(text) if units::split(text).is_none() => match Expression::parse(text) {
                Ok(expression) if expression.is_constant() => {
                    let value = expression.at(&[0.0; 3]);
                    match value.is_finite() {
                        true => Some(Scalar::Constant(value)),
                        false => self.refuse("a finite number is needed"),
                    }
                }
                Ok(expression) => Some(Scalar::Expression(expression)),
                Err(message) => self.refuse(message),
            },
            _ => self.number(dimension).map(Scalar::Constant),
        }
    }

    /// The items of an array.
    pub fn items(&self) -> Option<Vec<Field<'a>>> {
        match &self.node.value {
            Value::Array(items) => {
                Some(items.iter().enumerate().map(|(i, node)| self.part(node, &i.to_string())).collect())
            }
            _ => self.wrong("an array is needed"),
        }
    }

    pub fn numbers(&self, dimension: Dimension) -> Option<Vec<f64>> {
        all(self.items()?.into_iter().map(|item| item.number(dimension)))
    }

    fn pair(&self) -> Option<[Field<'a>; 2]> {
        <[Field<'a>; 2]>::try_from(self.items()?)
            .map_or_else(|_| self.refuse("two values are needed, [x, y]"), Some)
    }

    pub fn point(&self, dimension: Dimension) -> Option<[f64; 2]> {
        let [x, y] = self.pair()?;
        let (x, y) = (x.number(dimension), y.number(dimension));
        Some([x?, y?])
    }
}

impl std::ops::Deref for Field<'_> {
    type Target = Reader;
    fn deref(&self) -> &Reader {
        self.reader
    }
}

/// All values, or `None` if one is missing; every one is read, so that every error is noted.
pub(super) fn all<T>(values: impl Iterator<Item = Option<T>>) -> Option<Vec<T>> {
    let values: Vec<Option<T>> = values.collect();
    values.into_iter().collect()
}

/// "one of 'a', 'b', 'c' is needed".
fn one_of(choices: &[&str]) -> String {
    let quoted: Vec<String> = choices.iter().map(|choice| format!("'{choice}'")).collect();
    format!("one of {} is needed", quoted.join(", "))
}
