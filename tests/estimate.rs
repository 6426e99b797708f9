//! The error estimate against true errors: exact solutions, and a very fine mesh where there is none inside.
//!
//! One process, one rank: a single test function, since MPI and PETSc start once.
mod common;

use common::inside::{Runner, point_field};
use kontakt::{
    case::Case,
    element::{ElementKind, PointGeometry, PointLaw, SolidElement, load_rule},
    estimate,
    material::LinearElastic,
    mesh::Locator,
    output::{Results, SideTable, Summary},
};

/// In the plane (11, 22, 12), Pa.
type Plane = [f64; 3];

/// Half-width, m, and peak pressure, Pa, of two equal steel cylinders of 50 mm under 1e6 N/m.
const A: f64 = 5.252319e-4;
const P0: f64 = 1.212074e9;
const RADIUS: f64 = 0.05;
const APPROACH: f64 = 1.501341e-5;

/// A half disc with `k` elements per half-width; cells far away of about `far` degrees.
fn half_disc(name: &str, element: &str, k: f64, far: f64, up: bool) -> String {
    let size = (A / RADIUS).to_degrees() / k;
    let half = size * (1.25 * k).ceil().max(2.0);
    let (arc, y) = if up { ("up", -RADIUS) } else { ("down", RADIUS) };
    let depth = size.to_radians();
    format!(
        "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\nelement = \"{element}\"\n\
         mesh.half_disc = {{ center = [0, {y}], radius = {RADIUS}, arc = \"{arc}\", \
         angle = {{ at = [-45, {}, 0, {half}, 45], size = [{far}, {size}, {size}, {size}, {far}] }}, \
         depth = {{ at = [0, {}, 0.6], size = [{depth}, {depth}, {}] }}, core = {} }}\n\
         support = [{{ surface = \"flat\", y = {:e} }}, {{ point = [0, {y}], x = 0 }}]\n",
        -half,
        (2.0 * depth).max(0.01),
        0.02 * far,
        (24.0 / far).round(),
        y.signum() * -APPROACH,
    )
}

fn heading(with: &str) -> String {
    format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-10\nmaterial.steel = {{ young = 2.1e11, poisson = 0.3 }}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.arc\", \"{with}\"] }}]\n"
    )
}

fn on_plane(element: &str, k: f64, far: f64) -> String {
    let plane = "[[body]]\nname = \"plane\"\nrigid.plane = { through = [0, 0], normal = [0, 1] }\n";
    heading("plane.surface") + &half_disc("upper", element, k, far, false) + plane
}

fn cylinders(element: &str, k: [f64; 2], far: f64) -> String {
    heading("lower.arc")
        + &half_disc("upper", element, k[0], far, false)
        + &half_disc("lower", element, k[1], far, true)
}

/// A run with the displacements and laws that its stresses follow from.
struct Solved {
    case: Case,
    summary: Summary,
    results: Results,
}

impl Solved {
    fn new(runner: &Runner, text: &str) -> Solved {
        let case = runner.parse(text);
        let (summary, results) = runner.run(&case);
        Solved { case, summary, results }
    }

    /// |e| / |u| of the finite element stresses against `exact` (body, point), which may not know every point.
    fn energy_error(&self, exact: impl Fn(usize, &[f64; 3]) -> Option<Plane>) -> f64 {
        let piece = &self.results.piece;
        let displacement = point_field(&self.results, "displacement");
        let (mut error, mut energy) = (0.0, 0.0);
        let mut strains = Vec::new();
        for (cell, &body) in std::iter::zip(&piece.cells, &piece.cell_bodies) {
            let body = body as usize;
            let law = LinearElastic::new(&self.case.bodies[body].material, self.case.analysis).law(None);
            let element =
                SolidElement::new(cell.kind, self.case.bodies[body].formulation).expect("an element");
            let x: Vec<[f64; 3]> = cell.nodes().iter().map(|&n| piece.points[n as usize]).collect();
            let u: Vec<f64> = (cell.nodes().iter())
                .flat_map(|&n| displacement.values[3 * n as usize..][..2].to_vec())
                .collect();
            let rule = load_rule(cell.kind);
            element.strains_at(rule, &x, &u, |_, _| law, &mut strains).expect("strains");
            for (point, strain) in std::iter::zip(rule, &strains) {
                let geometry = PointGeometry::new(cell.kind, &x, point).expect("a good cell");
                let Some(wanted) = exact(body, &geometry.x) else { continue };
                let found = law.stress(*strain);
                let difference = std::array::from_fn(|c| found[c] - wanted[c]);
                error += geometry.area * complementary(&law, &difference);
                energy += geometry.area * complementary(&law, &wanted);
            }
        }
        (error / energy).sqrt()
    }

    /// Recovered stress at a point, from the nodal means.
    fn stress_at(&self, locator: &Locator, x: &[f64; 3]) -> Option<Plane> {
        let (cell, xi) = locator.find(x)?;
        let cell = &self.results.piece.cells[cell];
        let stress = point_field(&self.results, "stress");
        let mut s = [0.0; 3];
        for (&node, n) in std::iter::zip(cell.nodes(), cell.kind.shape(&xi).n) {
            let at = &stress.values[6 * node as usize..];
            s = [s[0] + n * at[0], s[1] + n * at[1], s[2] + n * at[3]];
        }
        Some(s)
    }

    /// Largest error of the nodal pressures of the peak, relative to the exact peak.
    fn pressure_error(&self, exact: impl Fn(&[f64; 3]) -> f64, peak: f64) -> f64 {
        let side = self.multipliers();
        let largest = side.pressure.iter().copied().fold(0.0, f64::max);
        let near = std::iter::zip(&side.x, &side.pressure)
            .filter(|(_, p)| **p >= estimate::pressure::PEAK * largest);
        near.map(|(x, p)| (p - exact(x)).abs() / peak).fold(0.0, f64::max)
    }

    fn multipliers(&self) -> &SideTable {
        let mut sides = self.results.pairs[0].sides.iter().flatten();
        sides.find(|side| side.gap.iter().any(|g| g.is_finite())).expect("a side has gaps")
    }
}

/// s : H^-1 s.
fn complementary(law: &PointLaw, s: &Plane) -> f64 {
    let [[a, b, _], [_, d, _], [_, _, g]] = law.h;
    (d * s[0] * s[0] + a * s[1] * s[1] - 2.0 * b * s[0] * s[1]) / (a * d - b * b) + s[2] * s[2] / g
}

#[test]
fn estimates() {
    let runner = Runner::start();
    hertz(&runner);
    press_fit(&runner);
}

fn hertz(runner: &Runner) {
    let reference = Solved::new(runner, &on_plane("quad8", 48.0, 1.0));
    let locator = Locator::new(&reference.results.piece.points, &reference.results.piece.cells);
    let profile = |x: &[f64; 3]| P0 * (1.0 - (x[0] / A).powi(2)).max(0.0).sqrt();
    for element in ["quad4", "tri3", "quad8", "tri6"] {
        for k in [1.0, 2.0, 4.0, 8.0, 16.0] {
            let run = Solved::new(runner, &on_plane(element, k, 3.0));
            let estimate = run.summary.error_estimate;
            let energy = run.energy_error(|_, x| reference.stress_at(&locator, x));
            let pressure = run.pressure_error(profile, P0);
            let peak = (run.summary.pairs[0].max_pressure / P0 - 1.0).abs();
            let e = estimate.contact_pressure.unwrap_or(0.0);
            println!(
                "{element} {k:4}: energy {:.2e} true {energy:.2e} ratio {:.2}   pressure {e:.2e} true {pressure:.2e} ratio {:.2}   peak {peak:.2e} ratio {:.2}",
                estimate.energy,
                estimate.energy / energy,
                e / pressure,
                e / peak
            );
        }
    }
}

fn press_fit(runner: &Runner) {
    let ring = |name: &str, element: &str, radii: [f64; 2], cells: [usize; 2]| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\nelement = \"{element}\"\n\
             mesh.ring = {{ radius = {{ from = {}, to = {}, cells = {} }}, angle = {{ from = 0, to = 90, cells = {} }} }}\n\
             support = [{{ surface = \"start\", y = 0 }}, {{ surface = \"end\", x = 0 }}]\n",
            radii[0], radii[1], cells[0], cells[1]
        )
    };
    let p = 2.4609375e7;
    // s_rr = a - b / r^2, s_tt = a + b / r^2.
    let lame = |body: usize, x: &[f64; 3]| {
        let (inner, outer) = if body == 0 { (0.05_f64, 0.1_f64) } else { (0.1, 0.15) };
        let span = outer * outer - inner * inner;
        let (pi, po) = if body == 0 { (0.0, p) } else { (p, 0.0) };
        let a = (pi * inner * inner - po * outer * outer) / span;
        let b = (pi - po) * (inner * outer).powi(2) / span;
        let r2 = x[0] * x[0] + x[1] * x[1];
        let (rr, tt) = (a - b / r2, a + b / r2);
        let (c2, s2, cs) = (x[0] * x[0] / r2, x[1] * x[1] / r2, x[0] * x[1] / r2);
        Some([rr * c2 + tt * s2, rr * s2 + tt * c2, (rr - tt) * cs])
    };
    for element in ["quad4", "tri3", "quad8", "tri6"] {
        for (n, m) in [(2, 2), (4, 4), (8, 8), (16, 16), (4, 5), (8, 11), (16, 21)] {
            let text = format!(
                "analysis = \"plane stress\"\nalternation.tolerance = 1e-10\nmaterial.steel = {{ young = 2.1e11, poisson = 0.3 }}\n\
                 contact = [{{ name = \"fit\", surfaces = [\"inner.outer\", \"outer.inner\"], gap_offset = -5e-5 }}]\n{}{}",
                ring("inner", element, [0.05, 0.1], [n, 2 * n]),
                ring("outer", element, [0.1, 0.15], [n, 2 * m])
            );
            let run = Solved::new(runner, &text);
            let estimate = run.summary.error_estimate;
            let energy = run.energy_error(lame);
            let pressure = run.pressure_error(|_| p, p);
            let e = estimate.contact_pressure.unwrap_or(0.0);
            println!(
                "{element} {n} {m}: energy {:.2e} true {energy:.2e} ratio {:.2}   pressure {e:.2e} true {pressure:.2e} ratio {:.2}",
                estimate.energy,
                estimate.energy / energy,
                e / pressure,
            );
        }
    }
    let _ = ElementKind::ALL;
}
