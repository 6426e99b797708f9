//! Writes the reference page of the case file, `docs/case-file.md`, from the schema.
use super::expression::{FUNCTIONS, FUNCTIONS_OF_TWO};
use super::schema::{Default, Key, Kind, TABLES, Table};
use super::units::{Dimension, UNITS};

/// The example of the page; a test reads it as a case.
pub(super) const EXAMPLE: &str = r#"title = "Two heated blocks close a gap"
analysis = "plane stress"

[material.steel]
young = "200 GPa"
poisson = 0.3
expansion = 12e-6                      # 1/K
reference_temperature = 293            # K

[material.aluminium]
young = "70 GPa"
poisson = 0.33
expansion = 23e-6
reference_temperature = 293

[[body]]
name = "lower"
material = "steel"
mesh.rectangle.x = { from = 0, to = 0.04, cells = 8 }
mesh.rectangle.y = { from = 0, to = 0.02, cells = 4 }
temperature = 393                      # K

[[body.support]]
surface = "bottom"
y = 0
[[body.support]]
surface = "left"
x = 0

[[body]]
name = "upper"
material = "aluminium"
mesh.rectangle.x = { from = 0, to = 0.04, cells = 8 }
mesh.rectangle.y = { from = "20.05 mm", to = "50.05 mm", cells = 6 }
temperature = 393

[[body.support]]
surface = "top"
y = 0
[[body.support]]
surface = "left"
x = 0

[[contact]]
name = "main"
surfaces = ["upper.bottom", "lower.top"]

[[probe]]
name = "A"
body = "lower"
at = [0, 0.02]

[[variant]]
name = "C"
title = "The gap stays open"
set = { "contact.main.gap" = "0.2 mm" }
"#;

const INTRODUCTION: &str = "\
<!-- Written by `kontakt::case::reference` from src/case/schema.rs. To write it again: KONTAKT_BLESS=1 \
cargo test -->
# The case file

A case is one TOML file, or a directory with a `case.toml`. Whatever is not in it is not in the run: a body \
without \
`temperature` has no heat, a case without `[[contact]]` no alternation. The whole file is checked before \
any work; every \
error names file, line, key, the value given and the rule, and all are reported together.
";

const UNITS_TEXT: &str = "\
Plain numbers are in SI units: m, N, Pa, K, and kg, s where they occur. Angles are in degrees, since that \
is how they are \
read off a drawing; inside expressions, `sin` and its kin take radians.

A string with a unit is converted: `\"210 GPa\"`, `\"25 mm\"`, `\"12e-6 1/K\"`, `\"76.5 kN/m3\"`, `\"30 \
deg\"`. Units are \
multiplied by `*` or a blank, divided by `/`, raised by `^2` or just `2`; each `/` divides by the one unit \
after it. The wrong \
dimension is an error. `\"27 degC\"` is an absolute temperature and stands alone.
";

const CONSISTENT_TEXT: &str = "\
With `units = \"consistent\"` the numbers are in a set of units of your own, such as mm, N, MPa, K. Nothing \
is converted, strings with \
a unit are refused (but for angles), and nothing is labelled with a unit in the results.
";

const EXPRESSIONS_TEXT: &str = "\
Where the type is *scalar*, a string without a unit is an expression of the coordinates `x`, `y` and `z` of \
the undeformed \
body: `\"600 - 16000*x\"`, `\"max(600 - 16000*x, 200)\"`, `\"1e8*(1 + x/0.04)\"`. Numbers in it are in the \
units of plain numbers. \
Operators: `+ - * / ^`, with the usual precedence (`-x^2` is `-(x^2)`). Constant: `pi`.
";

const VARIANTS_TEXT: &str = "\
A `[[variant]]` is a set of changes with a name. `kontakt run CASE --variant C` makes them; without \
`--variant` the case \
runs as written.

```toml
[[variant]]
name = \"C\"
title = \"A finer mesh, a wider gap, and no load\"
remove = [\"body.upper.load\"]
set = { \"contact.main.gap\" = 2e-4, \"body.lower.mesh.rectangle.x.cells\" = 10 }
```

A path is keys with dots between them. An item of an array of tables goes by its `name`, or by its index \
from 0 \
(`body.lower.support.0.y`); the index after the last appends. What is set replaces what was there, tables \
as a whole; a new \
key is added. Removals come first. Paths that lead nowhere are errors.
";

const SET_TEXT: &str = "\
`--set PATH=VALUE` on the command line makes one such change after the variant: `--set \
body.lower.material=aluminium`, \
`--set material.steel.young=2.1e11`, `--set contact.main.gap=\"0.1 mm\"`. The value is read as TOML and, if \
it is not that, taken as \
a string. It can be given many times.
";

/// The reference page, in Markdown.
pub fn reference() -> String {
    let mut page = format!("{INTRODUCTION}\n```toml\n{EXAMPLE}```\n\n");
    page.push_str(
        "Contents: [keys](#keys), [units](#units), [expressions](#expressions), [variants](#variants), ",
    );
    page.push_str("[`--set`](#--set).\n\n## Keys\n\n");
    page.push_str(
        "*scalar*: a number, a string with a unit, or an [expression](#expressions). *number*: a \
number or a ",
    );
    page.push_str(
        "string with a unit. The unit is that of plain numbers. **required**: there is no \
default; –: without \
it, there is none of it.\n",
    );
    for table in TABLES.iter().filter(|table| !table.heading.is_empty()) {
        page.push_str(&section(table));
    }
    page.push_str(&format!(
        "\n## Units\n\n{UNITS_TEXT}\nKnown units: {}.\n\n{CONSISTENT_TEXT}",
        known_units()
    ));
    let one = FUNCTIONS.iter().map(|f| format!("`{}(a)`", f.0));
    let two = FUNCTIONS_OF_TWO.iter().map(|f| format!("`{}(a, b)`", f.0));
    let functions = one.chain(two).collect::<Vec<_>>().join(", ");
    page.push_str(&format!("\n## Expressions\n\n{EXPRESSIONS_TEXT}Functions: {functions}.\n"));
    page.push_str(&format!("\n## Variants\n\n{VARIANTS_TEXT}\n## `--set`\n\n{SET_TEXT}"));
    page
}

fn known_units() -> String {
    let absolute = ["`degC`".to_string(), "`°C`".to_string()];
    UNITS.iter().map(|unit| format!("`{}`", unit.0)).chain(absolute).collect::<Vec<_>>().join(", ")
}

fn section(table: &Table) -> String {
    let mut text = format!("\n### {}\n\n", table.heading);
    if !table.about.is_empty() {
        text.push_str(&format!("{}\n\n", table.about));
    }
    text.push_str("| key | type | unit | default | meaning |\n|---|---|---|---|---|\n");
    for key in table.keys {
        let Key { name, kind, meaning, .. } = key;
        let (unit, default) = (unit(*kind), default(key.default));
        text.push_str(&format!("| `{name}` | {} | {unit} | {default} | {meaning} |\n", type_of(*kind)));
    }
    text
}

fn default(default: Default) -> String {
    match default {
        Default::Required => "**required**".into(),
        Default::Absent => "–".into(),
        Default::Is(text) if text == "false" || text.contains(['"', '[']) || text.parse::<f64>().is_ok() => {
            format!("`{text}`")
        }
        Default::Is(text) => text.into(),
    }
}

fn unit(kind: Kind) -> &'static str {
    match kind {
        Kind::Number(d) | Kind::Scalar(d) | Kind::Property(d) | Kind::Numbers(d) => d.unit(),
        Kind::Point(d) | Kind::Points(d) | Kind::Vector(d) | Kind::Either(_, d) => d.unit(),
        _ => Dimension::NUMBER.unit(),
    }
}

fn type_of(kind: Kind) -> String {
    match kind {
        Kind::Text => "string".into(),
        Kind::Name => "name (letters, digits, `_`, `-`)".into(),
        Kind::Texts => "array of strings".into(),
        Kind::Choice(choices) => choices.iter().map(|c| format!("`\"{c}\"`")).collect::<Vec<_>>().join(", "),
        Kind::Flag => "`true`, `false`".into(),
        Kind::Count => "integer > 0".into(),
        Kind::Natural => "integer >= 0".into(),
        Kind::Number(_) => "number".into(),
        Kind::Scalar(_) => "scalar".into(),
        Kind::Property(_) => "property".into(),
        Kind::Numbers(_) => "array of numbers".into(),
        Kind::Point(_) => "`[x, y]`, numbers".into(),
        Kind::Points(_) => "array of `[x, y]`".into(),
        Kind::Vector(_) => "`[x, y]`, scalars".into(),
        Kind::Table(name) => format!("table{}", link(name)),
        Kind::Tables(name) => format!("array of tables{}", link(name)),
        Kind::Named(name) => format!("tables by name{}", link(name)),
        Kind::Changes => "table of paths and values".into(),
        Kind::Either(forms, _) => forms.into(),
    }
}

/// Link to the section of a table.
fn link(name: &str) -> String {
    let name = if name.starts_with("grading") { "grading length" } else { name };
    match TABLES.iter().find(|table| table.name == name && !table.heading.is_empty()) {
        Some(table) => format!(", [see]({})", anchor(table.heading)),
        None => String::new(),
    }
}

/// Anchor of a heading, as GitHub makes it.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    let text: String = kept.collect::<String>().to_lowercase().replace(' ', "-");
    format!("#{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `KONTAKT_BLESS=1 cargo test` writes the page again.
    #[test]
    fn the_page_in_docs_is_up_to_date() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/case-file.md");
        if std::env::var_os("KONTAKT_BLESS").is_some() {
            std::fs::create_dir_all(concat!(env!("CARGO_MANIFEST_DIR"), "/docs")).unwrap();
            std::fs::write(path, reference()).unwrap();
        }
        let page = std::fs::read_to_string(path).unwrap_or_default();
        assert!(
            page == reference(),
            "docs/case-file.md is out of date; write it again with KONTAKT_BLESS=1 cargo test"
        );
    }

    /// Every link of the page leads to a heading.
    #[test]
    fn links_lead_somewhere() {
        let page = reference();
        let anchors: Vec<String> = page
            .lines()
            .filter(|l| l.starts_with('#'))
            .map(|l| anchor(l.trim_start_matches('#').trim()))
            .collect();
        let links = page.split("](#").skip(1).filter_map(|rest| rest.split(')').next());
        for link in links {
            assert!(anchors.contains(&format!("#{link}")), "{link} in {anchors:?}");
        }
    }
}
