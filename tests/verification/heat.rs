//! Bodies that expansion brings into contact, and thermal stress without contact.
use super::{close, gapped, multipliers, near, rectangle, solve, solve_all};
use kontakt::vector::larger;

/// Gap closure by uniform heating of two blocks between rigid walls.
struct Closure {
    plane_strain: bool,
    gap: f64,
    heat: [f64; 2],
    element: &'static str,
    level: usize,
}

const YOUNG: [f64; 2] = [2e11, 7e10];
const POISSON: [f64; 2] = [0.3, 0.33];
const EXPANSION: [f64; 2] = [12e-6, 23e-6];
const HEIGHT: [f64; 2] = [0.02, 0.03];

impl Closure {
    /// Free growth of the lower block and of both, m; compliance of both, m/Pa.
    fn growth(&self) -> [f64; 2] {
        let k = |b: usize| if self.plane_strain { 1.0 + POISSON[b] } else { 1.0 };
        let grow = |b: usize| k(b) * EXPANSION[b] * self.heat[b] * HEIGHT[b];
        [grow(0), grow(0) + grow(1)]
    }

    fn compliance(&self) -> [f64; 2] {
        let c = |b: usize| {
            HEIGHT[b] / YOUNG[b] * if self.plane_strain { 1.0 - POISSON[b] * POISSON[b] } else { 1.0 }
        };
        [c(0), c(0) + c(1)]
    }

    /// The gap is between the surfaces, and their meshes do not match.
    fn text(&self, steps: &str) -> String {
        let n = self.level;
        let body = |b: usize, name: &str, y: f64, cells: (usize, usize), support: &str| {
            let rest = format!("temperature = {}\n{support}", 293.0 + self.heat[b]);
            rectangle(
                name,
                name,
                self.element,
                (0.0, 0.04, cells.0 * n),
                (y, y + HEIGHT[b], cells.1 * n),
                &rest,
            )
        };
        let material = |b: usize, name: &str| {
            format!(
                "material.{name} = {{ young = {:e}, poisson = {}, expansion = {:e}, reference_temperature = 293 }}\n",
                YOUNG[b], POISSON[b], EXPANSION[b]
            )
        };
        format!(
            "analysis = \"plane {}\"\nalternation.tolerance = 1e-11\n{}{}\
             contact = [{{ name = \"i\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n\
             probe = [{{ name = \"l\", body = \"lower\", at = [0.02, 0.02] }}]\n{steps}\n{}{}",
            if self.plane_strain { "strain" } else { "stress" },
            material(0, "lower"),
            material(1, "upper"),
            body(
                0,
                "lower",
                0.0,
                (5, 3),
                "support = [{ surface = \"bottom\", y = 0 }, { surface = \"left\", x = 0 }]"
            ),
            body(
                1,
                "upper",
                HEIGHT[0] + self.gap,
                (7, 4),
                "support = [{ surface = \"top\", y = 0 }, { surface = \"left\", x = 0 }]"
            ),
        )
    }

    fn pressure(&self) -> f64 {
        ((self.growth()[1] - self.gap) / self.compliance()[1]).max(0.0)
    }

    fn check(&self) {
        let (summary, results) = solve_all(&self.text(""), 2, &[]);
        let what = format!("{} {} {:e}", self.element, self.level, self.gap);
        let p = self.pressure();
        let side = multipliers(&results, 0);
        for (found, gap) in std::iter::zip(&side.pressure, &side.gap) {
            near(*found, p, 1e-9 * p.max(1e8), &what);
            near(*gap, (self.gap - self.growth()[1]).max(0.0), 1e-9 * self.growth()[1], &what);
        }
        let lower = self.growth()[0] - p * self.compliance()[0];
        close(&summary, "probes.l.displacement.1", lower, 1e-9);
        assert_eq!(summary["reason"], if p > 0.0 { "converged" } else { "open" });
    }
}

/// The published numbers, then three levels of refinement of three element kinds.
#[test]
fn gap_closes_by_heating() {
    let table = [
        (false, 5e-5, [100.0, 100.0], 8.13513514e7),
        (true, 5e-5, [100.0, 100.0], 1.54303235e8),
        (false, 2e-4, [100.0, 100.0], 0.0),
        (true, 2e-4, [100.0, 100.0], 0.0),
        (false, 2e-5, [300.0, 0.0], 9.83783784e7),
        (true, 2e-5, [300.0, 0.0], 1.55635441e8),
    ];
    for (i, &(plane_strain, gap, heat, p)) in table.iter().enumerate() {
        let element = ["tri3", "tri6", "quad4", "quad8"][i % 4];
        for level in [1, 2, 4] {
            let case = Closure { plane_strain, gap, heat, element, level };
            near(case.pressure(), p, 5e-9 * p, "formula");
            case.check();
        }
    }
}

/// The expansion just closes the gap: either state, no pressure, no gap.
#[test]
fn gap_just_closes() {
    for (plane_strain, level) in [(false, 1), (true, 1), (false, 2), (true, 2), (false, 4)] {
        let mut case = Closure { plane_strain, gap: 0.0, heat: [100.0; 2], element: "quad4", level };
        case.gap = case.growth()[1];
        let (_, results) = solve_all(&case.text(""), 2, &[]);
        let side = multipliers(&results, 0);
        for (p, gap) in std::iter::zip(&side.pressure, &side.gap) {
            near(*p, 0.0, 1e-9 * YOUNG[1] * EXPANSION[1] * 100.0, "pressure");
            near(*gap, 0.0, 1e-9 * case.gap, "gap");
        }
    }
}

/// Heated, cooled, heated again: the gap comes back, and the second heating gives the pressure of the first.
#[test]
fn heating_and_cooling() {
    for (plane_strain, gap, heat) in
        [(false, 5e-5, [100.0, 100.0]), (true, 2e-4, [100.0, 100.0]), (true, 2e-5, [300.0, 0.0])]
    {
        for level in [1, 2, 4] {
            let case = Closure { plane_strain, gap, heat, element: "quad8", level };
            let steps = "step = [{ name = \"hot\" }, { name = \"half\", temperature = 0.5 }, { name = \"cold\", temperature = 0 }, { name = \"again\" }]";
            let (summary, results) = solve_all(&case.text(steps), 2, &[]);
            assert_eq!((results.before.len(), summary["steps"].as_array().map(Vec::len)), (3, Some(4)));
            let tables = results.before.iter().map(|s| &s.pairs[0]).chain([&results.pairs[0]]);
            for (k, (pair, factor)) in tables.zip([1.0, 0.5, 0.0, 1.0]).enumerate() {
                let then = Closure { heat: heat.map(|t| factor * t), element: "quad8", ..case };
                let side = gapped(pair);
                for (p, g) in std::iter::zip(&side.pressure, &side.gap) {
                    near(
                        *p,
                        then.pressure(),
                        1e-9 * case.pressure().max(1e6),
                        &format!("pressure of step {k}"),
                    );
                    near(*g, (gap - then.growth()[1]).max(0.0), 1e-9 * gap, &format!("gap of step {k}"));
                }
            }
        }
    }
}

/// A body held on all sides and heated: -E alpha dT / (1 - nu) in plane stress, / (1 - 2 nu) in plane strain.
#[test]
fn constrained_heating() {
    for (analysis, denominator) in [("plane stress", 1.0 - 0.3), ("plane strain", 1.0 - 0.6)] {
        let text = format!(
            r#"
analysis = "{analysis}"
probe = [{{ name = "m", body = "b", at = [0.3, 0.4] }}]
[[body]]
name = "b"
material = {{ young = 2.1e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 20 }}
temperature = 120
mesh.rectangle = {{ x = {{ from = 0, to = 1, cells = 3 }}, y = {{ from = 0, to = 1, cells = 3 }} }}
support = [{{ surface = "left", x = 0 }}, {{ surface = "right", x = 0 }}, {{ surface = "top", y = 0 }}, {{ surface = "bottom", y = 0 }}]
"#
        );
        let summary = solve(&text);
        close(&summary, "probes.m.stress.xx", -2.52e8 / denominator, 1e-10);
        close(&summary, "probes.m.stress.yy", -2.52e8 / denominator, 1e-10);
    }
}

/// Two blocks of different expansion on each other, heated without load: they slide, nothing is stressed.
#[test]
fn stress_free_sliding() {
    let body = |name: &str, y: f64, cells: usize, support: &str| {
        rectangle(
            name,
            name,
            "quad8",
            (0.0, 0.04, cells),
            (y, y + 0.02, 4),
            &format!("temperature = 100\nsupport = [{support}]"),
        )
    };
    let text = format!(
        "analysis = \"plane stress\"\n\
         material.lower = {{ young = 2e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 0 }}\n\
         material.upper = {{ young = 7e10, poisson = 0.33, expansion = 23e-6, reference_temperature = 0 }}\n\
         contact = [{{ name = \"i\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n\
         probe = [{{ name = \"l\", body = \"lower\", at = [0.04, 0.02] }}, {{ name = \"u\", body = \"upper\", at = [0.04, 0.02] }}]\n{}{}",
        body("lower", 0.0, 5, "{ surface = \"bottom\", y = 0 }, { surface = \"left\", x = 0 }"),
        body("upper", 0.02, 7, "{ surface = \"left\", x = 0 }")
    );
    let (summary, results) = solve_all(&text, 2, &[]);
    let slip =
        super::value(&summary, "probes.u.displacement.0") - super::value(&summary, "probes.l.displacement.0");
    near(slip, 11e-6 * 100.0 * 0.04, 1e-14, "slip");
    let stress = &super::common::inside::point_field(&results, "stress").values;
    let largest = stress.iter().fold(0.0, |l, s| larger(l, s.abs()));
    assert!(largest < 1e-9 * 7e10 * 23e-6 * 100.0, "{largest:e}");
}

/// Thick cylinder under a steady radial temperature drop, plane strain.
#[test]
fn thermal_cylinder() {
    let text = r#"
analysis = "plane strain"
probe = [{ name = "a", body = "c", at = [0.05, 0] }, { name = "m", body = "c", at = [0.075, 0] }, { name = "b", body = "c", at = [0.1, 0] }]
[[body]]
name = "c"
material = { young = 2.1e11, poisson = 0.3, expansion = 12e-6, reference_temperature = 0 }
temperature = "100*ln(0.1/sqrt(x^2 + y^2))/ln(2)"
element = "quad8"
mesh.ring = { radius = { from = 0.05, to = 0.1, cells = 24 }, angle = { from = 0, to = 90, cells = 24 } }
support = [{ surface = "start", y = 0 }, { surface = "end", x = 0 }]
"#;
    let summary = solve(text);
    close(&summary, "probes.a.displacement.0", 3.026511e-5, 1e-3);
    close(&summary, "probes.b.displacement.0", 6.053021e-5, 1e-3);
    // At y = 0 the hoop stress is yy, the radial one xx.
    close(&summary, "probes.a.stress.yy", -2.20315e8, 1e-2);
    close(&summary, "probes.b.stress.yy", 1.39685e8, 1e-2);
    close(&summary, "probes.m.stress.xx", -2.80401e7, 1e-2);
    close(&summary, "probes.b.stress.zz", 4.19055e7, 2e-2);
}
