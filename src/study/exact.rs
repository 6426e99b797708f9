//! What is known of a case's solution, as values of the quantities that a study measures.
use super::quantity::parts;
use crate::{
    Result,
    body::LoadFactors,
    case::{
        Analysis, BodyCase, BodyRef, Case, ClosedForm, ExactCase, Gap, HertzLoad, MaterialCase, Property,
        Scalar, Temperature,
    },
};
use std::{collections::BTreeMap, f64::consts::PI};

/// Values by the name of the quantity.
pub(super) type Known = BTreeMap<String, Vec<f64>>;

/// E, nu and alpha of the plane problem: those of the material in plane stress; E/(1 - nu^2), nu/(1 - nu) and
/// (1 + nu) alpha in plane strain.
struct Plane {
    young: f64,
    poisson: f64,
    expansion: f64,
    /// sigma_zz over sigma_xx + sigma_yy.
    out_of_plane: f64,
}

/// All that `[exact]` says; an error names what of the case the closed form does not cover.
pub(super) fn known(case: &Case) -> Result<Known> {
    let mut known = Known::new();
    let Some(exact) = &case.exact else { return Ok(known) };
    let pair = exact.pair.and_then(|pair| case.contacts.get(pair));
    let mut of_pair = |what: &str, value: Option<f64>| {
        if let (Some(pair), Some(value)) = (pair, value) {
            known.insert(format!("{}.{what}", pair.name), vec![value]);
        }
    };
    let closed = match &exact.solution {
        Some(form) => closed_form(case, exact, *form)?,
        None => Closed::default(),
    };
    of_pair("force", exact.force.or(closed.force));
    of_pair("peak_pressure", exact.peak_pressure.or(closed.peak_pressure));
    of_pair("contact_length", exact.contact_length.or(closed.contact_length));
    known.extend(closed.probes);
    for (probe, at) in &exact.probes {
        let name = &case.probes[*probe].name;
        known.extend(at.displacement.map(|u| (format!("{name}.displacement"), u.to_vec())));
        known.extend(at.stress.map(|stress| (format!("{name}.stress"), stress.to_vec())));
    }
    let parts: Vec<_> = known.iter().flat_map(|(name, values)| parts(name, values, "")).collect();
    known.extend(parts.into_iter().map(|part| (part.name, part.values)));
    Ok(known)
}

/// What a closed form says.
#[derive(Default)]
struct Closed {
    force: Option<f64>,
    peak_pressure: Option<f64>,
    contact_length: Option<f64>,
    probes: Known,
}

fn closed_form(case: &Case, exact: &ExactCase, form: ClosedForm) -> Result<Closed> {
    let surfaces = exact.pair.map(|pair| case.contacts[pair].surfaces.each_ref().map(|surface| surface.body));
    let Some(sides) = surfaces else {
        return Err(exact.origin.error("a closed form is about a contact pair"));
    };
    match form {
        ClosedForm::HertzLine { curvature, load } => hertz(case, exact, sides, (curvature, load)),
        ClosedForm::PressFit { radii, interference, center } => {
            press_fit(case, exact, sides, radii, interference, center)
        }
        ClosedForm::HeatedBlocks { heights, width } => heated_blocks(case, exact, sides, heights, width),
    }
}

/// Hertz: a^2 = 4 P R / (pi E*), p0 = 2 P / (pi a), with the force P per thickness, 1/R the curvature of the gap and
/// 1/E* = 1/E'_A + 1/E'_B.
fn hertz(
    case: &Case,
    exact: &ExactCase,
    sides: [BodyRef; 2],
    (curvature, load): (f64, HertzLoad),
) -> Result<Closed> {
    let mut compliance = 0.0;
    for side in sides {
        if let Some(i) = side.deformable() {
            compliance += 1.0 / plane(case, exact, &case.bodies[i])?.young;
        }
    }
    let thickness = case.analysis.thickness();
    let (force, half_width) = match load {
        HertzLoad::Force(force) => (force, (4.0 * force / thickness / curvature * compliance / PI).sqrt()),
        HertzLoad::HalfWidth(a) => (thickness * PI * a * a * curvature / (4.0 * compliance), a),
    };
    Ok(Closed {
        force: Some(force),
        peak_pressure: Some(2.0 * force / thickness / (PI * half_width)),
        contact_length: Some(2.0 * half_width),
        probes: Known::new(),
    })
}

/// Lame: with A = 1/r^2 terms, a ring between radii i and o under pressure p at the joint b has
/// sigma_r, sigma_t = K (1 -+ s^2/r^2) and u = K/E' ((1 - nu') r + (1 + nu') s^2/r); inside K = -p b^2/(b^2 - a^2), s = a;
/// outside K = p b^2/(c^2 - b^2), s = c. The joint's displacements differ by the interference.
fn press_fit(
    case: &Case,
    exact: &ExactCase,
    sides: [BodyRef; 2],
    [a, b, c]: [f64; 3],
    interference: f64,
    center: [f64; 2],
) -> Result<Closed> {
    let [Some(inner), Some(outer)] = sides.map(BodyRef::deformable) else {
        return Err(exact.origin.error("press_fit: both rings must be deformable"));
    };
    let rings = [
        (inner, plane(case, exact, &case.bodies[inner])?, -b * b / (b * b - a * a), a),
        (outer, plane(case, exact, &case.bodies[outer])?, b * b / (c * c - b * b), c),
    ];
    // Radial displacement and stresses for a unit pressure.
    let at = |plane: &Plane, k: f64, s: f64, r: f64| {
        let term = if s == 0.0 { 0.0 } else { s * s / r };
        let u = k / plane.young * ((1.0 - plane.poisson) * r + (1.0 + plane.poisson) * term);
        let part = if s == 0.0 { 0.0 } else { term / r };
        [u, k * (1.0 - part), k * (1.0 + part)]
    };
    let opening =
        at(&rings[1].1, rings[1].2, rings[1].3, b)[0] - at(&rings[0].1, rings[0].2, rings[0].3, b)[0];
    let pressure = interference / opening;
    let mut probes = Known::new();
    for probe in &case.probes {
        let Some((_, plane, k, s)) = rings.iter().find(|ring| ring.0 == probe.body) else { continue };
        let d = [probe.at[0] - center[0], probe.at[1] - center[1]];
        let r = d[0].hypot(d[1]);
        let n = if r > 0.0 { [d[0] / r, d[1] / r] } else { [1.0, 0.0] };
        let [u, radial, hoop] = at(plane, *k, *s, r).map(|value| pressure * value);
        let zz = plane.out_of_plane * (radial + hoop);
        let stress = [
            radial * n[0] * n[0] + hoop * n[1] * n[1],
            radial * n[1] * n[1] + hoop * n[0] * n[0],
            zz,
            (radial - hoop) * n[0] * n[1],
        ];
        probes.insert(format!("{}.displacement", probe.name), vec![u * n[0], u * n[1]]);
        probes.insert(format!("{}.stress", probe.name), stress.to_vec());
    }
    Ok(Closed { force: None, peak_pressure: Some(pressure), contact_length: None, probes })
}

/// p = (sum of alpha' dT h - gap) / (sum of h/E'), or no contact.
fn heated_blocks(
    case: &Case,
    exact: &ExactCase,
    sides: [BodyRef; 2],
    heights: [f64; 2],
    width: f64,
) -> Result<Closed> {
    let gap = match exact.pair.map(|pair| &case.contacts[pair].gap) {
        Some(Gap::Value(gap)) => *gap,
        _ => return Err(exact.origin.error("heated_blocks: the pair needs its 'gap' as a number")),
    };
    let factors = case.steps.last().map_or(LoadFactors::FULL, LoadFactors::from);
    let (mut expansion, mut compliance) = (0.0, 0.0);
    for (side, height) in std::iter::zip(sides, heights) {
        let Some(i) = side.deformable() else {
            return Err(exact.origin.error("heated_blocks: both blocks must be deformable"));
        };
        let body = &case.bodies[i];
        let plane = plane(case, exact, body)?;
        compliance += height / plane.young;
        let factor = factors.on_temperature(body.temperature_path);
        expansion += height * plane.expansion * factor * heating(exact, body)?;
    }
    let pressure = (expansion - gap) / compliance;
    Ok(match pressure > 0.0 {
        true => Closed {
            force: Some(pressure * width * case.analysis.thickness()),
            peak_pressure: Some(pressure),
            contact_length: Some(width),
            probes: Known::new(),
        },
        false => Closed::default(),
    })
}

/// Temperature over that without strain, K.
fn heating(exact: &ExactCase, body: &BodyCase) -> Result<f64> {
    match &body.temperature {
        None => Ok(0.0),
        Some(Temperature::Field(Scalar::Constant(t))) => Ok(t - body.material.reference_temperature),
        Some(_) => Err(exact
            .origin
            .error(format!("the closed form needs one temperature all over body '{}'", body.name))),
    }
}

fn plane(case: &Case, exact: &ExactCase, body: &BodyCase) -> Result<Plane> {
    if body.yields() || !body.inserts.is_empty() {
        return Err(exact.origin.error(format!(
            "the closed form needs elastic bodies of one material; body '{}' {}",
            body.name,
            if body.yields() { "has one that yields" } else { "has inserts" }
        )));
    }
    let MaterialCase { young, poisson, expansion, .. } = &body.material;
    let constant = |property: &Property| match property {
        Property::Constant(value) => Ok(*value),
        Property::Table(_) => Err(exact.origin.error(format!(
            "the closed form needs constant properties; those of body '{}' follow the temperature",
            body.name
        ))),
    };
    let (young, poisson) = (constant(young)?, constant(poisson)?);
    let expansion = expansion.as_ref().map_or(Ok(0.0), constant)?;
    Ok(match case.analysis {
        Analysis::PlaneStress { .. } => Plane { young, poisson, expansion, out_of_plane: 0.0 },
        Analysis::PlaneStrain { .. } => Plane {
            young: young / (1.0 - poisson * poisson),
            poisson: poisson / (1.0 - poisson),
            expansion: (1.0 + poisson) * expansion,
            out_of_plane: poisson,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn of(case: &str, variant: Option<&str>, exact: &str) -> Known {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(case);
        known(&crate::case::read(&path, variant, &[format!("exact={exact}")]).unwrap()).unwrap()
    }

    fn near(value: f64, expected: f64, relative: f64) {
        assert!((value / expected - 1.0).abs() < relative, "{value:e} for {expected:e}");
    }

    /// The numbers that the cases' own `expected.toml` and README state.
    #[test]
    fn closed_forms_give_the_numbers_of_the_cases() {
        for (variant, force) in [(None, 1e6), (Some("E2"), 1.333333e6), (Some("E10"), 1.818182e6)] {
            let known = of(
                "hertz-line",
                variant,
                "{ hertz_line = { radius = [0.05, 0.05], half_width = 5.25232e-4 } }",
            );
            near(known["contact.force"][0], force, 1e-5);
            near(known["contact.peak_pressure"][0], 1.212074e9 * force / 1e6, 1e-5);
        }
        let by_force = of("hertz-line", None, "{ hertz_line = { radius = [0.05, 0.05], force = 1e6 } }");
        near(by_force["contact.contact_length"][0], 2.0 * 5.25232e-4, 1e-5);
        let gap = "{ heated_blocks = { heights = [0.03, 0.02], width = 0.04 } }";
        near(of("heated-gap", None, gap)["interface.peak_pressure"][0], 8.13513514e7, 1e-8);
        near(of("heated-gap", Some("D"), gap)["interface.peak_pressure"][0], 9.83783784e7, 1e-8);
        near(of("heated-gap", Some("B-plane-strain"), gap)["interface.peak_pressure"][0], 1.54303235e8, 1e-8);
        assert!(of("heated-gap", Some("C"), gap).is_empty());
    }

    /// Both rings in equilibrium at the joint, free at bore and rim, apart by the interference.
    #[test]
    fn lame_keeps_its_boundary_conditions() {
        let fit = "{ press_fit = { radii = [0.05, 0.1, 0.15], interference = 5e-5 } }";
        for variant in [None, Some("ps-steel-aluminium"), Some("pe-aluminium-steel")] {
            let known = of("press-fit", variant, fit);
            let p = known["fit.peak_pressure"][0];
            near(known["inner-b.stress"][0], -p, 1e-12);
            near(known["outer-b.stress"][0], -p, 1e-12);
            assert!(known["bore.stress"][0].abs() < 1e-9 * p && known["rim.stress"][0].abs() < 1e-9 * p);
            near(known["outer-b.displacement"][0] - known["inner-b.displacement"][0], 5e-5, 1e-12);
        }
    }
}
