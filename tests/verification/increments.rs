//! Increments with friction: where the way must make no difference to the end, and increments that are taken back.
use super::friction::{A_OVER_B, discs, plate};
use super::{multipliers, near, solve_all};
use kontakt::output::Results;
use kontakt::vector::largest;
use serde_json::Value;

/// Tractions, slips and pressures of the last step alike, each by its largest value, and the work of friction.
#[track_caller]
fn same_end(a: &(Value, Results), b: &(Value, Results), relative: f64, what: &str) {
    let tables = [a, b].map(|run| multipliers(&run.1, 0));
    assert_eq!(tables[0].status, tables[1].status, "{what}");
    let columns = tables.map(|t| {
        let along = t.tangential.as_ref().expect("a law");
        [t.pressure.clone(), along.traction.clone(), along.slip.clone()]
    });
    for (column, (a, b)) in
        ["pressure", "traction", "slip"].iter().zip(std::iter::zip(&columns[0], &columns[1]))
    {
        let allowed = relative * largest(a);
        assert!(allowed > 0.0, "{what}: {column}");
        std::iter::zip(a, b).for_each(|(a, b)| near(*b, *a, allowed, &format!("{what}: {column}")));
    }
    let [a, b] = [a, b].map(|run| lost(&run.0));
    near(b, a, relative * a, &format!("{what}: work of friction"));
}

fn lost(summary: &Value) -> f64 {
    super::value(summary, "pairs.pair.friction.dissipated")
}

fn increments(summary: &Value, step: usize) -> u64 {
    summary["steps"][step]["increments"].as_u64().expect("a number")
}

/// The plate on the floor: no gap, and all loads grow together. All conditions are homogeneous, so that every increment is the same
/// picture, larger: forces and slips grow with the load, and the work of friction with its square.
#[test]
fn proportional_loads_need_no_increments() {
    for friction in [0.3, 1.0, 3.0] {
        let of = |steps: &str| {
            let text = plate(friction, 32, "quad4") + "[[step]]\nloads = 1\nsteps = " + steps + "\n";
            solve_all(&text, 1, &[])
        };
        let one = of("1");
        assert!(lost(&one.0) > 0.0);
        for (steps, n) in [("10", 10), ("100", 100), ("\"auto\"", 1)] {
            let many = of(steps);
            assert!(increments(&many.0, 0) >= n, "{steps}");
            same_end(&one, &many, 1e-10, &format!("mu = {friction}, steps = {steps}"));
        }
        // Steps of their own: half of the load is half of the slip and a quarter of the work.
        let text = plate(friction, 32, "quad4") + "[[step]]\nloads = 0.5\n[[step]]\nloads = 1\n";
        let halves = solve_all(&text, 1, &[]);
        same_end(&one, &halves, 1e-10, "two steps");
        let friction = |step: usize, key: &str| {
            halves.0["steps"][step]["pairs"][0]["friction"][key].as_f64().expect("a number")
        };
        near(
            friction(0, "dissipated"),
            0.25 * lost(&one.0),
            1e-10 * lost(&one.0),
            "work of half of the load",
        );
        near(friction(0, "max_slip"), 0.5 * friction(1, "max_slip"), 1e-10 * friction(1, "max_slip"), "slip");
    }
}

/// Bodies of other moduli pressed together by a growing load slip outwards: a punch that touches all along keeps its picture.
#[test]
fn a_punch_on_a_softer_body_needs_no_increments() {
    let of = |steps: &str| {
        let text = format!(
            "analysis = \"plane strain\"\nalternation.tolerance = 1e-12\n\
             material.hard = {{ young = 2.1e11, poisson = 0.3 }}\nmaterial.soft = {{ young = 3e10, poisson = 0.1 }}\n{}{}\
             [[contact]]\nname = \"pair\"\nsurfaces = [\"upper.bottom\", \"lower.top\"]\nfriction = 0.2\n\
             [[step]]\nloads = 1\nsteps = {steps}\n",
            super::rectangle(
                "upper",
                "hard",
                "quad4",
                (-0.01, 0.01, 20),
                (0.0, 0.015, 12),
                "load = [{ surface = \"top\", pressure = 5e7 }]\nsupport = [{ point = [0, 0.015], x = 0 }]"
            ),
            super::rectangle(
                "lower",
                "soft",
                "quad4",
                (-0.03, 0.03, 54),
                (-0.03, 0.0, 20),
                "support = [{ surface = \"bottom\", x = 0, y = 0 }]"
            ),
        );
        solve_all(&text, 1, &[])
    };
    let one = of("1");
    let table = multipliers(&one.1, 0);
    let slips = &table.tangential.as_ref().expect("a law").slip;
    assert!(table.status.contains(&3) && table.status.contains(&2), "{:?}", table.status);
    // Outwards: one way at either end.
    assert!(largest(slips) > 0.0 && slips[1] * slips[slips.len() - 2] < 0.0, "{slips:?}");
    for steps in ["10", "100"] {
        same_end(&one, &of(steps), 1e-10, steps);
    }
}

/// Equal discs pressed first: normal forces stay, what slips goes on slipping, and the end of a monotone shear is that of one increment.
#[test]
fn monotone_shear_of_equal_discs_needs_no_increments() {
    let of = |steps: &str| {
        let text = discs(0.3, 20.0, A_OVER_B, &[0.0]) + "[[step]]\nloads = 0.7\nsteps = " + steps + "\n";
        solve_all(&text, 1, &[])
    };
    let one = of("1");
    for (steps, n) in [("10", 10), ("40", 40), ("\"auto\"", 1)] {
        let many = of(steps);
        assert!(increments(&many.0, 1) >= n, "{steps}: {}", increments(&many.0, 1));
        same_end(&one, &many, 1e-10, steps);
    }
}

/// Equal cylinders pressed, then sheared, by the paper's alternation: with too few alternations for the shear its parts are found, and
/// the end is that of the direct run, since a monotone shear of equal bodies does not depend on the way.
#[test]
fn increments_that_are_taken_back_leave_nothing() {
    let text = |limit: usize, steps: &str| {
        let body = |name: &str, y: [f64; 2], arc: &str, support: &str| {
            format!(
                "[[body]]\nname = \"{name}\"\nmaterial = \"m\"\nmesh.block = {{ corners = [[-0.03, {0}], [0.03, {0}], [0.03, {1}], \
                 [-0.03, {1}]], arcs = {{ {arc} }}, u = {{ at = [0, 0.4, 0.6, 1], cells = [8, 48, 8] }}, v = {{ cells = 12 }} }}\n{support}\n",
                y[0], y[1]
            )
        };
        format!(
            "analysis = \"plane strain\"\nmaterial.m = {{ young = 2.1e11, poisson = 0.3 }}\n\
             alternation = {{ driver = \"relaxed\", tolerance = 1e-12, max_alternations = {limit} }}\n{}{}\
             [[contact]]\nname = \"pair\"\nsurfaces = [\"upper.bottom\", \"lower.top\"]\nfriction = 0.3\ngap_offset = -1e-4\n\
             [[step]]\nsupports = 0\n[[step]]\nsupports = 1\n{steps}",
            body(
                "upper",
                [0.01, 0.04],
                "bottom = [0, 0.05]",
                "support = [{ surface = \"top\", x = 4e-5, y = 0 }]"
            ),
            body(
                "lower",
                [-0.04, -0.01],
                "top = [0, -0.05]",
                "support = [{ surface = \"bottom\", x = 0, y = 0 }]"
            ),
        )
    };
    let direct = solve_all(&text(1000, ""), 1, &[]);
    let needed = |step: usize| direct.0["steps"][step]["alternations"].as_u64().expect("a number") as usize;
    let limit = needed(0);
    assert!(limit < needed(1), "the shear takes more alternations");
    for way in ["", "steps = \"auto\"\n"] {
        let found = solve_all(&text(limit, way), 1, &[]);
        assert!(increments(&found.0, 1) > 1, "{way}");
        same_end(&direct, &found, 1e-10, way);
    }
}
