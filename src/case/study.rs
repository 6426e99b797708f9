//! `[study]`: what `kontakt study` sweeps.
use super::node::Value;
use super::reader::{Field, Fields, all};
use super::{ContactCase, Driver, ProbeCase, alternation, nearest, schema, solver_options};

/// Finest level a study may ask for: 4^10 times the elements of the case's own mesh.
const FINEST: i64 = 10;

/// What a study varies. An empty list leaves that as the case has it.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyCase {
    /// Levels of refinement of the case's own meshes, increasing; 0: as they are.
    pub levels: Vec<usize>,
    /// Element kinds of the generated meshes.
    pub elements: Vec<String>,
    /// Tolerances of the alternation, as written.
    pub tolerances: Vec<String>,
    /// Drivers of the alternation.
    pub drivers: Vec<String>,
    /// Weights of the relaxed driver, as written.
    pub weights: Vec<String>,
    /// Transfers across the interface.
    pub transfers: Vec<String>,
    /// How bodies answer on their surfaces.
    pub responses: Vec<String>,
    /// PETSc options of the bodies' solvers.
    pub solvers: Vec<String>,
    /// Numbers of ranks.
    pub ranks: Vec<usize>,
    /// How often each run is repeated, for its time.
    pub repeat: usize,
    /// What errors are judged by; `None`: the first peak pressure, or the first probe.
    pub quantity: Option<String>,
    /// Changes to the case before all others, as `PATH=VALUE`.
    pub sets: Vec<String>,
}

/// What holds without `[study]`.
impl Default for StudyCase {
    fn default() -> Self {
        StudyCase {
            levels: (0..=3).collect(),
            elements: Vec::new(),
            tolerances: Vec::new(),
            drivers: Vec::new(),
            weights: Vec::new(),
            transfers: Vec::new(),
            responses: Vec::new(),
            solvers: Vec::new(),
            ranks: vec![1],
            repeat: 3,
            quantity: None,
            sets: Vec::new(),
        }
    }
}

/// Reads `[study]`; every key has a default.
pub(super) fn read(
    case: &Fields<'_>,
    bodies: &[&str],
    contacts: Option<&[ContactCase]>,
    probes: Option<&[ProbeCase]>,
) -> StudyCase {
    let mut study = StudyCase::default();
    let Some(fields) = case.table("study") else { return study };
    if let Some(levels) = list(&fields, "levels", levels) {
        study.levels = levels;
    }
    let choice = |key, choices: &'static [&'static str]| {
        list(&fields, key, |field| items(field, |item| one_of(item, choices))).unwrap_or_default()
    };
    study.elements = choice("elements", schema::ELEMENTS);
    study.drivers = choice("drivers", schema::DRIVERS);
    study.transfers = choice("transfers", schema::TRANSFERS);
    study.responses = choice("responses", schema::RESPONSES);
    study.tolerances = list(&fields, "tolerances", |field| items(field, tolerance)).unwrap_or_default();
    study.weights = list(&fields, "weights", |field| items(field, weights)).unwrap_or_default();
    study.solvers = list(&fields, "solvers", |field| items(field, solver_options::read)).unwrap_or_default();
    study.ranks = list(&fields, "ranks", |field| items(field, |item| item.count())).unwrap_or(study.ranks);
    study.repeat = fields.count("repeat").unwrap_or(study.repeat);
    study.quantity = quantity(&fields, bodies, contacts, probes);
    study.sets = sets(&fields);
    let relaxed = match &study.drivers[..] {
        [] => true,
        drivers => drivers.iter().any(|driver| *driver == Driver::Relaxed(super::Weights::Response).name()),
    };
    if !study.weights.is_empty() && !relaxed {
        fields.error_at("weights", "weights belong to the driver \"relaxed\", which 'drivers' does not list");
    }
    study
}

/// What a study measures of a pair: `PAIR.force`.
pub const QUANTITIES_OF_PAIR: [&str; 3] = ["peak_pressure", "force", "contact_length"];
/// What a study measures of a probe: vectors, and their components alone.
pub const QUANTITIES_OF_PROBE: [&str; 9] = [
    "displacement",
    "stress",
    "displacement.x",
    "displacement.y",
    "stress.xx",
    "stress.yy",
    "stress.zz",
    "stress.xy",
    "stress.von_mises",
];
/// What a study measures of a body, `BODY.strain_energy`, and of all together: its elastic energy, J.
pub const STRAIN_ENERGY: &str = "strain_energy";

/// A quantity that the case has.
fn quantity(
    fields: &Fields<'_>,
    bodies: &[&str],
    contacts: Option<&[ContactCase]>,
    probes: Option<&[ProbeCase]>,
) -> Option<String> {
    let name = fields.text("quantity")?;
    let of_pairs = contacts?.iter().flat_map(|c| QUANTITIES_OF_PAIR.map(|what| format!("{}.{what}", c.name)));
    let of_probes = probes?.iter().flat_map(|p| QUANTITIES_OF_PROBE.map(|what| format!("{}.{what}", p.name)));
    let of_bodies = bodies.iter().map(|body| format!("{body}.{STRAIN_ENERGY}"));
    let all: Vec<String> =
        of_pairs.chain(of_probes).chain(of_bodies).chain([STRAIN_ENERGY.to_string()]).collect();
    if all.iter().any(|other| other == name) {
        return Some(name.to_string());
    }
    let names: Vec<&str> = all.iter().map(String::as_str).collect();
    fields.field("quantity")?.refuse(nearest::hint(name, &names).trim_end())
}

/// The values of a key: at least one, none of them twice.
fn list<T: PartialEq>(
    fields: &Fields<'_>,
    key: &str,
    read: impl FnOnce(&Field<'_>) -> Option<Vec<T>>,
) -> Option<Vec<T>> {
    let field = fields.field(key)?;
    let values = read(&field)?;
    if values.is_empty() {
        return field.refuse("at least one is needed; leave the key out to keep what the case has");
    }
    if (1..values.len()).any(|i| values[..i].contains(&values[i])) {
        return field.refuse("one of them is listed twice");
    }
    Some(values)
}

fn items<T>(field: &Field<'_>, read: impl Fn(&Field<'_>) -> Option<T>) -> Option<Vec<T>> {
    all(field.items()?.iter().map(read))
}

fn one_of(item: &Field<'_>, choices: &'static [&'static str]) -> Option<String> {
    let text = item.text()?;
    match choices.contains(&text) {
        true => Some(text.to_string()),
        false => item.refuse(nearest::hint(text, choices).trim_end()),
    }
}

/// `"0..3"`, both ends included, or an array.
fn levels(field: &Field<'_>) -> Option<Vec<usize>> {
    const RULE: &str = "levels are whole numbers from 0 to 10: \"0..3\", or [0, 1, 3]";
    let numbers: Vec<i64> = match &field.node.value {
        Value::Text(text) => match text.split_once("..").map(|(a, b)| (a.trim().parse(), b.trim().parse())) {
            Some((Ok(from), Ok(to))) if from <= to && to <= FINEST => (from..=to).collect(),
            _ => return field.refuse(RULE),
        },
        Value::Array(items) => {
            let number = |item: &super::node::Node| match item.value {
                Value::Integer(n) => Some(n),
                _ => None,
            };
            items.iter().map(number).collect::<Option<Vec<i64>>>().or_else(|| field.refuse(RULE))?
        }
        _ => return field.refuse(RULE),
    };
    if numbers.iter().any(|n| !(0..=FINEST).contains(n)) {
        return field.refuse(RULE);
    }
    let mut levels: Vec<usize> = numbers.into_iter().filter_map(|n| usize::try_from(n).ok()).collect();
    levels.sort_unstable();
    Some(levels)
}

/// As it is written, if `[alternation]` would take it.
fn tolerance(item: &Field<'_>) -> Option<String> {
    alternation::tolerance(item).map(|_| item.node.to_string())
}

fn weights(item: &Field<'_>) -> Option<String> {
    alternation::weights(item).map(|_| item.node.to_string())
}

fn sets(fields: &Fields<'_>) -> Vec<String> {
    let Some(field) = fields.field("set") else { return Vec::new() };
    match field.node.entries() {
        Some(entries) => entries.iter().map(|(path, node)| format!("{path}={node}")).collect(),
        None => field.wrong("a table is needed: { \"contact.main.gap\" = 2e-4 }").unwrap_or_default(),
    }
}
