//! Reads what yields: `[material.NAME.plasticity]`, and `[plasticity]`, how it is computed.
use super::node::Value;
use super::property::{property, temperature};
use super::reader::{Field, Fields, all};
use super::{BodyCase, PlasticityCase, Property, Tangent, Theory, ZoneCase};
use crate::material::{Hardening, Kinematic, Plasticity};

/// Forms of the yield stress.
const FORMS: [&str; 5] = ["yield_stress", "curve", "curves", "ramberg_osgood", "power"];

const POSITIVE: &str = "must be > 0";

const SOFTENING: &str = "softening gathers in one row of cells, and the answer would be that of the mesh";

/// Iterations of the secant method where the case does not say how many.
const SECANT_ITERATIONS: usize = 1000;

/// A curve of yield stresses, Pa, over plastic strains.
type Curve = Vec<(f64, f64)>;

fn positive(value: f64) -> bool {
    value > 0.0
}

/// Reads `plasticity` of a material.
pub(super) fn of_material(fields: &Fields<'_>) -> Option<Plasticity> {
    let linear = linear(fields);
    let curve = fields.table("curve").and_then(|table| curve(&table));
    let curves = fields.field("curves").and_then(|field| curves(fields, &field));
    let ramberg_osgood = fields.table("ramberg_osgood").and_then(|table| self::ramberg_osgood(&table));
    let power = fields.table("power").and_then(|table| self::power(&table));
    let kinematic = fields.table("kinematic").map(|table| kinematic(&table));
    let hardening = match fields.given(&FORMS)[..] {
        ["yield_stress"] => linear,
        ["curve"] => curve.map(|curve| Hardening::Table(vec![(0.0, curve)])),
        ["curves"] => curves.map(Hardening::Table),
        ["ramberg_osgood"] => ramberg_osgood,
        ["power"] => power,
        // Noted already.
        [] if fields.has("hardening") => None,
        ref given => {
            let given = if given.is_empty() { "none".to_string() } else { given.join(" and ") };
            fields.error(format!("{given} given; exactly one of {} is needed", FORMS.join(", ")));
            None
        }
    };
    let kinematic = match kinematic {
        Some(read) => Some(read?),
        None => None,
    };
    Some(Plasticity { hardening: hardening?, kinematic })
}

/// `yield_stress` with `hardening`.
fn linear(fields: &Fields<'_>) -> Option<Hardening> {
    let yield_stress = property(fields, "yield_stress", positive, POSITIVE);
    let modulus = property(fields, "hardening", |v| v >= 0.0, &format!("must be >= 0: {SOFTENING}"));
    if fields.has("hardening") && !fields.has("yield_stress") {
        fields
            .error_at("hardening", "goes with 'yield_stress'; the other forms say how the material hardens");
    }
    let modulus = match fields.has("hardening") {
        true => modulus?,
        false => Property::Constant(0.0),
    };
    Some(Hardening::Linear { yield_stress: yield_stress?, modulus })
}

fn ramberg_osgood(fields: &Fields<'_>) -> Option<Hardening> {
    let yield_stress = property(fields, "yield_stress", positive, POSITIVE);
    let offset = match fields.number_if("offset", positive, POSITIVE) {
        None if fields.has("offset") => None,
        offset => Some(offset.unwrap_or(0.002)),
    };
    let exponent =
        fields.number_if("exponent", |n| n > 1.0, "must be > 1: plastic strain grows faster than the stress");
    Some(Hardening::RambergOsgood { yield_stress: yield_stress?, offset: offset?, exponent: exponent? })
}

fn power(fields: &Fields<'_>) -> Option<Hardening> {
    let yield_stress = property(fields, "yield_stress", positive, POSITIVE);
    let strain = fields.number_if("strain", positive, POSITIVE);
    let exponent = fields.number_if("exponent", |n| n > 0.0 && n <= 1.0, "must be in (0, 1]");
    Some(Hardening::Power { yield_stress: yield_stress?, strain: strain?, exponent: exponent? })
}

fn kinematic(fields: &Fields<'_>) -> Option<Kinematic> {
    let modulus =
        property(fields, "modulus", positive, "must be > 0; without 'kinematic' there is no backstress");
    let recall = fields.number_if("recall", |v| v >= 0.0, "must be >= 0");
    if recall.is_none() && fields.has("recall") {
        return None;
    }
    Some(Kinematic { modulus: modulus?, recall: recall.unwrap_or(0.0) })
}

fn curve(fields: &Fields<'_>) -> Option<Curve> {
    let (strains, stresses) = (fields.numbers("plastic_strain"), fields.numbers("stress"));
    let (strains, stresses) = (strains?, stresses?);
    if strains.len() != stresses.len() || strains.len() < 2 {
        fields.error(format!(
            "{} plastic strains and {} stresses were given; at least two of each are needed, as many of one as of the other",
            strains.len(),
            stresses.len()
        ));
        return None;
    }
    if strains[0] != 0.0 {
        let rule =
            "the first must be 0: plastic strain is what remains, the total strain less stress / young";
        fields.error_at("plastic_strain", format!("it begins at {}; {rule}", strains[0]));
        return None;
    }
    if let Some(w) = strains.windows(2).find(|w| w[0] >= w[1]) {
        fields
            .error_at("plastic_strain", format!("{} follows {}; plastic strains must increase", w[1], w[0]));
        return None;
    }
    if let Some(stress) = stresses.iter().find(|stress| !positive(**stress)) {
        fields.error_at("stress", format!("{stress} was given; {POSITIVE}"));
        return None;
    }
    if let Some(w) = stresses.windows(2).find(|w| w[0] > w[1]) {
        fields.error_at("stress", format!("{} follows {}; it must not fall: {SOFTENING}", w[1], w[0]));
        return None;
    }
    Some(std::iter::zip(strains, stresses).collect())
}

/// Curves by temperature.
fn curves(fields: &Fields<'_>, field: &Field<'_>) -> Option<Vec<(f64, Curve)>> {
    let tables = fields.tables("curves");
    let Value::Array(items) = &field.node.value else { return None };
    let read = |table: &Fields<'_>| {
        let (temperature, curve) = (temperature(table, "temperature"), curve(table));
        Some((temperature?, curve?))
    };
    let curves = all(tables.iter().map(read)).filter(|read| read.len() == items.len())?;
    if curves.len() < 2 {
        return field.refuse("at least two are needed; one for all temperatures is 'curve'");
    }
    if let Some(i) = (1..curves.len()).find(|&i| curves[i - 1].0 >= curves[i].0) {
        let (before, here) = (curves[i - 1].0, curves[i].0);
        tables[i].error_at("temperature", format!("{here} follows {before}; temperatures must increase"));
        return None;
    }
    Some(curves)
}

/// True if it is given over temperature.
pub(super) fn over_temperature(plasticity: &Plasticity) -> bool {
    let hardening = match &plasticity.hardening {
        Hardening::Linear { yield_stress, modulus } => yield_stress.is_table() || modulus.is_table(),
        Hardening::Table(curves) => curves.len() > 1,
        Hardening::RambergOsgood { yield_stress, .. } | Hardening::Power { yield_stress, .. } => {
            yield_stress.is_table()
        }
    };
    hardening || plasticity.kinematic.as_ref().is_some_and(|kinematic| kinematic.modulus.is_table())
}

/// Reads `[plasticity]`; every key has a default.
pub(super) fn read<'a>(case: &Fields<'_>, bodies: impl Iterator<Item = &'a BodyCase>) -> PlasticityCase {
    let default = PlasticityCase::default();
    let Some(fields) = case.table("plasticity") else { return default };
    let theory = fields.choice("theory").map_or(default.theory, |i| [Theory::Flow, Theory::Deformation][i]);
    let tangent =
        fields.choice("iteration").map_or(default.tangent, |i| [Tangent::Consistent, Tangent::Secant][i]);
    let tolerance = fields.number_if("tolerance", |v| v > 0.0 && v < 1e-2, "must be > 0 and < 1e-2");
    let max_iterations = fields.count("max_iterations");
    const ZONES: [ZoneCase; 3] = [ZoneCase::Automatic, ZoneCase::Always, ZoneCase::Never];
    let zone = fields.choice("zone").map_or(default.zone, |i| ZONES[i]);
    check_theory(&fields, theory, tangent, bodies);
    PlasticityCase {
        theory,
        tangent,
        tolerance: tolerance.unwrap_or(default.tolerance),
        max_iterations: max_iterations.unwrap_or(match tangent {
            Tangent::Consistent => default.max_iterations,
            Tangent::Secant => SECANT_ITERATIONS,
        }),
        zone,
    }
}

/// What the theories do not go with.
fn check_theory<'a>(
    fields: &Fields<'_>,
    theory: Theory,
    tangent: Tangent,
    bodies: impl Iterator<Item = &'a BodyCase>,
) {
    if (theory, tangent) == (Theory::Flow, Tangent::Secant) {
        fields.error_at(
            "iteration",
            "\"secant\" was given; secant moduli are those of theory = \"deformation\", in which the strain follows from the \
             stress alone; theory = \"flow\" takes \"newton\"",
        );
    }
    if theory == Theory::Flow {
        return;
    }
    let kinematic = |body: &'a BodyCase| {
        let moves = |material: &&super::MaterialCase| {
            material.plasticity.as_ref().is_some_and(|plasticity| plasticity.kinematic.is_some())
        };
        body.materials().find(moves).map(|material| (body, material))
    };
    if let Some((body, material)) = { bodies }.find_map(kinematic) {
        fields.error_at(
            "theory",
            format!(
                "\"deformation\" was given; the material '{}' of body '{}' has 'kinematic', and backstress is a matter of flow: it \
                 grows along the way, which this theory does not know; take \"flow\", or remove 'kinematic'",
                material.name, body.name
            ),
        );
    }
}
