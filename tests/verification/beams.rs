//! Slender beams in contact, clamped at the left end; plane stress.
use super::{close, gapped, multipliers, near, rectangle, solve_within, value};
use kontakt::record::SideTable;

/// A cantilever 0.2 m long and 10 mm high.
fn beam(name: &str, y: f64, cells: usize, load: &str) -> String {
    let rest = format!("support = [{{ surface = \"left\", x = 0, y = 0 }}]\n{load}");
    rectangle(name, "steel", "quad8", (0.0, 0.2, cells), (y, y + 0.01, 4), &rest)
}

const HEADING: &str = "analysis = \"plane stress\"\nalternation.tolerance = 1e-9\nmaterial.steel = { young = 2.1e11, poisson = 0.3 }\n";

/// Two leaves under uniform pressure share it: contact pressure q / 2 along the length, grazing all the way. Tip
/// deflection of a beam of half the load.
#[test]
fn two_leaves() {
    for cells in [80, 67] {
        let text = format!(
            "{HEADING}contact = [{{ name = \"leaves\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n\
             probe = [{{ name = \"tip\", body = \"upper\", at = [0.2, 0.02] }}]\n{}{}",
            beam("lower", 0.0, cells, ""),
            beam("upper", 0.01, 80, "load = [{ surface = \"top\", pressure = 1e5 }]")
        );
        let (summary, results) = solve_within(&text, 2, &[], 10.0);
        close(&summary, "probes.tip.displacement.1", -5.722e-4, 1e-3);
        // Half of the load crosses the interface; where meshes that do not match are clamped they press on each other.
        let side = multipliers(&results, 0);
        near(force_between(side, 0.02, 0.2), 5e4 * 0.18, 5e4 * 0.18 * 1e-2, "force outside of the clamp");
        let inner: Vec<f64> = std::iter::zip(&side.x, &side.pressure)
            .filter(|(x, _)| x[0] > 0.05 && x[0] < 0.15)
            .map(|(_, p)| *p)
            .collect();
        let mean = inner.iter().sum::<f64>() / inner.len() as f64;
        near(mean, 5e4, 2e-2 * 5e4, "mean pressure in the middle half");
        if cells == 80 {
            assert_eq!(value(&summary, "pairs.leaves.open"), 0.0);
            inner.iter().for_each(|p| near(*p, 5e4, 5.0, "pressure in the middle half"));
        }
    }
}

/// The same leaves with a force at the tip of the upper one: half of it crosses, at the tip alone.
#[test]
fn two_leaves_tip_load() {
    for cells in [80, 67] {
        let text = format!(
            "{HEADING}contact = [{{ name = \"leaves\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n{}{}",
            beam("lower", 0.0, cells, ""),
            beam("upper", 0.01, 80, "load = [{ point = [0.2, 0.02], force = [0, -1e3] }]")
        );
        let (_, results) = solve_within(&text, 2, &[], 10.0);
        let side = gapped(&results.pairs[0]);
        near(force_between(side, 0.19, 0.2), 503.0, 5.0, "contact force at the tip");
        near(force_between(side, 0.02, 0.19), 0.0, 1e-6, "contact force elsewhere");
    }
}

/// Size of the contact force between two sections.
fn force_between(side: &SideTable, from: f64, to: f64) -> f64 {
    let nodes = std::iter::zip(&side.x, &side.force).filter(|(x, _)| x[0] > from && x[0] <= to + 1e-12);
    nodes.map(|(_, f)| f[1]).sum::<f64>().abs()
}

/// Two parallel cantilevers, a gap of 0.5 mm, a tip load on the upper one: R = (P - g / C) / 2 at the tip.
#[test]
fn two_cantilevers() {
    // Timoshenko 8362.6 N/m; the resultant sits in the last nodes, first order in the element size.
    for (cells, force, allowed) in [
        ([40, 40], 8362.6, 1.2e-2),
        ([80, 80], 8362.6, 8e-3),
        ([160, 160], 8362.6, 5e-3),
        ([80, 97], 8362.6, 8e-3),
    ] {
        let text = format!(
            "{HEADING}contact = [{{ name = \"tip\", surfaces = [\"upper.bottom\", \"lower.top\"] }}]\n\
             probe = [{{ name = \"tip\", body = \"upper\", at = [0.2, 0.0205] }}]\n{}{}",
            beam("lower", 0.0, cells[0], ""),
            beam("upper", 0.0105, cells[1], "load = [{ point = [0.2, 0.0205], force = [0, -2e4] }]")
        );
        let (summary, _) = solve_within(&text, 2, &[], 10.0);
        close(&summary, "pairs.tip.normal_force", force, allowed);
        close(&summary, "probes.tip.displacement.1", -1.77678e-3, 5e-3);
    }
}

/// A cantilever under uniform pressure above two rigid stops with pads of 2 mm, at half its length and at the tip.
#[test]
fn beam_on_two_stops() {
    for (gaps, forces) in [
        ([0.2e-3, 1.2e-3], [1.5611e5, 1.7780e4]),
        ([0.2e-3, 0.9e-3], [1.3371e5, 2.6869e4]),
        ([1.0e-3, 1.2e-3], [0.0, 6.7512e4]),
    ] {
        // To the right of the way lies the outside: from right to left it is above.
        let stop = |name: &str, x: [f64; 2], gap: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nrigid.polyline.points = [[{}, {:e}], [{}, {:e}]]\n",
                x[1], -gap, x[0], -gap
            )
        };
        let text = format!(
            "{HEADING}contact = [{{ name = \"middle\", surfaces = [\"beam.bottom\", \"middle.surface\"] }}, {{ name = \"end\", surfaces = [\"beam.bottom\", \"end.surface\"] }}]\n\
             probe = [{{ name = \"tip\", body = \"beam\", at = [0.2, 0] }}]\n{}{}{}",
            stop("middle", [0.099, 0.101], gaps[0]),
            stop("end", [0.198, 0.2], gaps[1]),
            beam("beam", 0.0, 200, "load = [{ surface = \"top\", pressure = 1e6 }]")
        );
        let (summary, _) = solve_within(&text, 2, &[], 10.0);
        near(value(&summary, "pairs.middle.normal_force"), forces[0], 1e-2 * forces[0], "middle");
        near(value(&summary, "pairs.end.normal_force"), forces[1], 5e-2 * forces[1], "end");
    }
}
