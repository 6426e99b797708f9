//! `[alternation]`: which driver brings the bodies to agree, and how displacements and forces cross the interface.
use super::nearest;
use super::node::Value;
use super::reader::{Field, Fields};
use crate::schwarz::weights::Weights;

/// How the bodies are brought to agree.
#[derive(Debug, Clone, PartialEq)]
pub struct AlternationCase {
    /// What decides the next displacements and forces.
    pub driver: Driver,
    /// How a pair's displacements and forces cross the interface.
    pub transfer: Transfer,
    /// When the alternation stops.
    pub tolerance: Tolerance,
    /// Alternations after which it gives up.
    pub max_alternations: usize,
}

/// Relative tolerance of the stop test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// A tenth of the discretisation error of the contact pressure, as the pressures themselves show it.
    Automatic,
    /// This number.
    Fixed(f64),
}

impl Tolerance {
    /// Of the relaxed driver, whose corrections say less of the error than a residual does: it does not follow the mesh.
    pub const RELAXED: f64 = 1e-8;
}

/// The drivers of the alternation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Driver {
    /// Primal-dual active set outside, preconditioned conjugate gradients inside: one iteration is one force step and
    /// one displacement step of all bodies.
    ActiveSet,
    /// The paper's alternation: corrections of displacements and forces, each body taking its share by these weights.
    Relaxed(Weights),
}

/// Transfers across the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transfer {
    /// Contact forces live on one surface and act on both through integrals over the common surface: action equals
    /// reaction, and a constant pressure passes, on meshes that do not match, too.
    Mortar,
    /// Nodal values taken at conjugate points. With [`Driver::ActiveSet`]: the nodes of one surface against the facets
    /// of the other. With [`Driver::Relaxed`]: the paper's transfer, of both surfaces' nodes.
    Pointwise,
}

impl Driver {
    /// Name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            Driver::ActiveSet => "active set",
            Driver::Relaxed(_) => "relaxed",
        }
    }

    /// The transfer where the case names none.
    fn default_transfer(self) -> Transfer {
        match self {
            Driver::ActiveSet => Transfer::Mortar,
            Driver::Relaxed(_) => Transfer::Pointwise,
        }
    }

    fn default_max_alternations(self) -> usize {
        match self {
            Driver::ActiveSet => 1000,
            Driver::Relaxed(_) => 200,
        }
    }
}

impl Transfer {
    /// Name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            Transfer::Mortar => "mortar",
            Transfer::Pointwise => "pointwise",
        }
    }
}

/// What holds without `[alternation]`.
impl Default for AlternationCase {
    fn default() -> Self {
        let driver = Driver::ActiveSet;
        AlternationCase {
            driver,
            transfer: driver.default_transfer(),
            tolerance: Tolerance::Automatic,
            max_alternations: driver.default_max_alternations(),
        }
    }
}

/// Reads `[alternation]`; every key has a default. `None` if driver or transfer are wrong: then nothing that depends
/// on them is checked.
pub(super) fn read(case: &Fields<'_>) -> Option<AlternationCase> {
    let Some(fields) = case.table("alternation") else {
        return (!case.has("alternation")).then(AlternationCase::default);
    };
    let tolerance = fields.field("tolerance").and_then(|field| tolerance(&field));
    let max_alternations = fields.count("max_alternations");
    let (driver, transfer) = (driver(&fields), fields.choice("transfer"));
    let driver = driver?;
    let transfer = match transfer.map(|choice| [Transfer::Mortar, Transfer::Pointwise][choice]) {
        Some(transfer) => transfer,
        None if fields.has("transfer") => return None,
        None => driver.default_transfer(),
    };
    Some(AlternationCase {
        driver,
        transfer,
        tolerance: tolerance.unwrap_or(Tolerance::Automatic),
        max_alternations: max_alternations.unwrap_or(driver.default_max_alternations()),
    })
}

/// A number, or `"auto"`.
pub(super) fn tolerance(field: &Field<'_>) -> Option<Tolerance> {
    match &field.node.value {
        Value::Text(text) if text == "auto" => return Some(Tolerance::Automatic),
        Value::Text(text) if text.starts_with(char::is_alphabetic) => {
            let hint = nearest::hint(text, &["auto"]);
            return field.refuse(format!("{hint}or a number in (0, 1e-2]"));
        }
        _ => {}
    }
    let value = field.number(field.dimension())?;
    match value > 0.0 && value <= 1e-2 {
        true => Some(Tolerance::Fixed(value)),
        false => field.refuse("must be in (0, 1e-2], or \"auto\""),
    }
}

/// `driver` with its `weights`.
fn driver(fields: &Fields<'_>) -> Option<Driver> {
    let given = fields.field("weights");
    let relaxed = match fields.choice("driver") {
        Some(choice) => choice == 1,
        None if fields.has("driver") => return None,
        None => false,
    };
    match (relaxed, given) {
        (false, None) => Some(Driver::ActiveSet),
        (false, Some(given)) => given
            .refuse("weights belong to driver = \"relaxed\"; the driver \"active set\" has none to choose"),
        (true, None) => Some(Driver::Relaxed(Weights::Response)),
        (true, Some(given)) => weights(&given).map(Driver::Relaxed),
    }
}

/// One of the names, or a number in (0, 1).
pub(super) fn weights(field: &Field<'_>) -> Option<Weights> {
    const NAMED: [(&str, Weights); 5] = [
        ("response", Weights::Response),
        ("response per surface", Weights::ResponseSurface),
        ("magnitude", Weights::Magnitude),
        ("component", Weights::Component),
        ("stiffness", Weights::Stiffness),
    ];
    if let Value::Text(name) = &field.node.value {
        return NAMED.iter().find(|(other, _)| other == name).map(|(_, weights)| *weights).or_else(|| {
            let names = NAMED.map(|(name, _)| name);
            let hint = nearest::hint(name, &names);
            field.refuse(format!("{}or a number in (0, 1)", hint))
        });
    }
    let value = field.number(field.dimension())?;
    match value > 0.0 && value < 1.0 {
        true => Some(Weights::Constant(value)),
        false => field.refuse("a constant weight must be in (0, 1)"),
    }
}
