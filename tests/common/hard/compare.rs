//! Numbers of summaries: against limits, against what is expected, against each other.
use super::expected::{Number, Run, Same};
use kontakt::vector::larger;
use serde_json::Value;

/// A number over its limit.
#[derive(Debug, Clone)]
pub struct Ratio {
    /// What it is.
    pub name: String,
    /// Value over limit; 1 and less is right.
    pub ratio: f64,
}

impl Ratio {
    pub fn new(name: impl Into<String>, value: f64, limit: f64) -> Self {
        let ratio = if value == 0.0 { 0.0 } else { value / limit };
        Ratio { name: name.into(), ratio }
    }
}

/// A number by path: `pairs.interface.max_pressure`, `steps.1.probes.A.displacement.1`; list items by name or index.
pub fn number(summary: &Value, path: &str) -> Option<f64> {
    let step = |at: &Value, key: &str| match at {
        Value::Array(items) => match key.parse::<usize>() {
            Ok(i) => items.get(i).cloned(),
            Err(_) => items.iter().find(|item| item["name"] == key).cloned(),
        },
        other => other.get(key).cloned(),
    };
    path.split('.').try_fold(summary.clone(), |at, key| step(&at, key))?.as_f64()
}

fn items<'a>(summary: &'a Value, key: &str) -> &'a [Value] {
    summary[key].as_array().map_or(&[], Vec::as_slice)
}

fn components(value: &Value) -> Vec<f64> {
    value.as_array().map_or(Vec::new(), |list| list.iter().filter_map(Value::as_f64).collect())
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().map(f64::abs).fold(0.0, larger)
}

/// Largest displacement component of the probes, m.
fn travel(summary: &Value) -> f64 {
    largest(items(summary, "probes").iter().flat_map(|probe| components(&probe["displacement"])))
}

/// I1 to I5 and I7 of a run that is a solution.
pub fn invariants(summary: &Value, round_off: f64) -> Vec<Ratio> {
    const LIMITS: [(&str, f64); 6] = [
        ("action_reaction", 1e-10),
        ("equilibrium", 1e-9),
        ("residual", 1e-9),
        ("tension", 1e-6),
        ("complementarity", 1e-6),
        ("virtual_work", 1e-10),
    ];
    let mut ratios: Vec<Ratio> = LIMITS
        .iter()
        .map(|(key, limit)| {
            let limit = if matches!(*key, "residual" | "equilibrium" | "virtual_work") {
                limit.max(round_off)
            } else {
                *limit
            };
            Ratio::new(*key, number(&summary["checks"], key).unwrap_or(f64::NAN), limit)
        })
        .collect();
    let travel = travel(summary);
    for pair in items(summary, "pairs") {
        let length = pair["contact_length"].as_f64().filter(|length| *length > 0.0).unwrap_or(travel);
        let penetration = pair["max_penetration"].as_f64().unwrap_or(f64::NAN);
        // The smaller of 1e-8 of the contact length and 1e-6 of the displacements, but not below their round-off.
        let of_travel = if travel > 0.0 { 1e-6 * travel } else { f64::INFINITY };
        ratios.push(Ratio::new(
            "penetration",
            penetration,
            (1e-8 * length).min(of_travel).max(1e-14 * travel),
        ));
    }
    ratios
}

/// What friction must keep, where there is any: its cone, the sense of the slip, the balance of energies, no work given back.
pub fn friction(summary: &Value) -> Vec<Ratio> {
    let mut ratios = Vec::new();
    for friction in items(summary, "pairs").iter().filter_map(|pair| pair.get("friction")) {
        let of = |key: &str| number(friction, key).unwrap_or(f64::NAN);
        ratios.push(Ratio::new("cone", of("beyond_bound"), 1e-10));
        ratios.push(Ratio::new("sense of slip", of("wrong_slip"), 1e-8));
        ratios.push(Ratio::new("work of friction", larger(-of("dissipated"), 0.0), f64::MIN_POSITIVE));
    }
    let steps = items(summary, "steps").iter().chain(std::iter::once(summary));
    let imbalances = steps.filter_map(|step| number(step.get("energy")?, "imbalance"));
    ratios.extend(imbalances.map(|imbalance| Ratio::new("energy", imbalance, 1e-6)));
    ratios
}

/// The numbers that are not as expected.
pub fn values(summary: &Value, numbers: &[Number]) -> Vec<String> {
    let fault = |n: &Number| {
        let Some(found) = number(summary, &n.path) else { return Some(format!("{} is missing", n.path)) };
        let allowed = n.absolute + n.relative * n.value.abs();
        let difference = (found - n.value).abs();
        (difference.is_nan() || difference > allowed).then(|| {
            let Number { path, value, .. } = n;
            format!("{path} = {found:.12e}, not {value:.12e} +- {allowed:.1e} (off by {difference:.2e})")
        })
    };
    numbers.iter().filter_map(fault).collect()
}

/// Agreement between numbers of ranks, to 1e-8. Where bodies only touch, forces are round-off and displacements alone are
/// compared; where parts are loose, forces alone. Alternations are not compared: near the tolerance round-off decides
/// when they end, and every number of ranks has the limit of the case.
pub fn ranks(one: &Value, other: &Value, run: &Run) -> Vec<Ratio> {
    let keys: &[&str] = match (run.outcome.as_str(), run.loose) {
        ("touching", _) => &[],
        (_, true) => &["normal_force", "max_pressure"],
        _ => &["normal_force", "max_pressure", "contact_length"],
    };
    let mut ratios = differences(one, other, &Factors::ONE, keys);
    ratios.retain(|r| !run.loose || r.name != "displacement");
    named("ranks", ratios, 1e-8_f64.max(run.round_off))
}

/// Agreement with the sides swapped: forces and displacements to the tolerance.
pub fn swap(one: &Value, other: &Value, tolerance: f64) -> Vec<Ratio> {
    named("swap", differences(one, other, &Factors::ONE, &["normal_force"]), tolerance)
}

/// Names and limits of differences.
fn named(name: &str, mut ratios: Vec<Ratio>, tolerance: f64) -> Vec<Ratio> {
    ratios.iter_mut().for_each(|r| {
        r.name = format!("{name}: {}", r.name);
        r.ratio /= tolerance;
    });
    ratios
}

/// Agreement with another run.
pub fn same(reference: &Value, found: &Value, same: &Same) -> Vec<Ratio> {
    let Same { length, pressure, .. } = *same;
    let factors = Factors {
        force: pressure * length * length,
        pressure,
        length,
        displacement: same.displacement.unwrap_or(length),
    };
    let keys = ["normal_force", "max_pressure", "contact_length"];
    let mut ratios = differences(reference, found, &factors, &keys);
    ratios.iter_mut().for_each(|r| {
        r.name = format!("same: {}", r.name);
        r.ratio /= same.relative;
    });
    if let Some(allowed) = same.alternations {
        let counts = [reference, found].map(|s| s["alternations"].as_u64().unwrap_or(0));
        let difference = counts[0].abs_diff(counts[1]) as f64;
        ratios.push(Ratio::new("same: alternations", difference, allowed as f64));
    }
    ratios
}

/// What the numbers of the first summary are multiplied by.
struct Factors {
    force: f64,
    pressure: f64,
    length: f64,
    displacement: f64,
}

impl Factors {
    const ONE: Factors = Factors { force: 1.0, pressure: 1.0, length: 1.0, displacement: 1.0 };
}

/// Of coordinates, relative, over the 1e-8 that differences are held to.
const ROUND_OFF: f64 = 1e-15 / 1e-8;

/// Relative differences of two summaries: each key of the pairs against its largest value among the pairs, the
/// displacements of the probes against the largest of them.
fn differences(one: &Value, other: &Value, factors: &Factors, keys: &[&str]) -> Vec<Ratio> {
    let mut ratios = Vec::new();
    let pairs = [one, other].map(|s| items(s, "pairs"));
    for key in keys {
        let factor = match *key {
            "normal_force" => factors.force,
            "max_pressure" => factors.pressure,
            _ => factors.length,
        };
        let column = |pairs: &[Value], factor: f64| -> Vec<f64> {
            pairs.iter().map(|pair| factor * pair[key].as_f64().unwrap_or(f64::NAN)).collect()
        };
        ratios.push(relative(key, &column(pairs[0], factor), &column(pairs[1], 1.0)));
    }
    let probes = |summary: &Value, factor: f64| -> Vec<f64> {
        let all = items(summary, "probes").iter().flat_map(|probe| components(&probe["displacement"]));
        all.map(|u| factor * u).collect()
    };
    let mut displacement = relative("displacement", &probes(one, factors.displacement), &probes(other, 1.0));
    // Displacements below the round-off of the coordinates are none.
    let places = |summary: &Value| -> f64 {
        largest(items(summary, "probes").iter().flat_map(|probe| components(&probe["x"])))
    };
    let travel = largest(probes(one, factors.displacement).into_iter().chain(probes(other, 1.0)));
    let round_off = ROUND_OFF * places(other);
    if travel < round_off {
        displacement.ratio *= travel / round_off;
    }
    ratios.push(displacement);
    ratios
}

fn relative(name: &str, a: &[f64], b: &[f64]) -> Ratio {
    let scale = largest(a.iter().chain(b).copied());
    let difference = std::iter::zip(a, b).map(|(a, b)| (a - b).abs()).fold(0.0, larger);
    let missing = a.len() != b.len() || a.iter().chain(b).any(|x| x.is_nan());
    Ratio::new(name, if missing { f64::NAN } else { difference }, scale)
}
