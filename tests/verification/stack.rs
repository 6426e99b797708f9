//! Three blocks on each other, the middle one held by contact alone but for its side.
use super::{close, multipliers, near, rectangle, solve_all, value};

fn stack(analysis: &str, closing: f64, cells: [usize; 3], order: [usize; 3]) -> String {
    let heights = [0.01, 0.02, 0.015];
    let bottoms = [0.0, 0.01 + 1e-5, 0.03 + 3e-5];
    let names = ["low", "middle", "top"];
    let extra = [
        "{ surface = \"bottom\", y = 0 }, ".to_owned(),
        String::new(),
        format!("{{ surface = \"top\", y = {} }}, ", -closing),
    ];
    let bodies = order.map(|b| {
        let support = format!("support = [{}{{ surface = \"left\", x = 0 }}]", extra[b]);
        let y = (bottoms[b], bottoms[b] + heights[b], 3);
        rectangle(names[b], names[b], "quad4", (0.0, 0.04, cells[b]), y, &support)
    });
    format!(
        "analysis = \"{analysis}\"\nalternation.tolerance = 1e-11\nmaterial.low = {{ young = 2.1e11, poisson = 0.3 }}\n\
         material.middle = {{ young = 7e10, poisson = 0.33 }}\nmaterial.top = {{ young = 1.1e11, poisson = 0.34 }}\n\
         contact = [{{ name = \"lower\", surfaces = [\"middle.bottom\", \"low.top\"] }}, {{ name = \"upper\", surfaces = [\"middle.top\", \"top.bottom\"] }}]\n\
         probe = [{{ name = \"m\", body = \"middle\", at = [0.02, 0.01001] }}]\n{}",
        bodies.concat()
    )
}

#[test]
fn three_body_stack() {
    for (analysis, p, u) in
        [("plane stress", 1.06451613e8, -1.506912e-5), ("plane strain", 1.19464798e8, -1.517681e-5)]
    {
        for (cells, order) in [([6, 6, 6], [0, 1, 2]), ([5, 7, 4], [0, 1, 2]), ([9, 4, 11], [2, 0, 1])] {
            let (summary, results) = solve_all(&stack(analysis, 8e-5, cells, order), 2, &[]);
            for pair in 0..2 {
                for found in &multipliers(&results, pair).pressure {
                    near(*found, p, 5e-9 * p, &format!("{analysis} {cells:?}: pressure"));
                }
            }
            close(&summary, "probes.m.displacement.1", u, 1e-6);
        }
    }
}

/// Closed by less than the gaps: nothing touches, and where the middle block is nobody knows; it stays.
#[test]
fn loose_middle_block() {
    let (summary, _) = solve_all(&stack("plane stress", 2e-5, [5, 7, 4], [0, 1, 2]), 2, &[]);
    assert_eq!(summary["reason"], "open");
    for pair in ["lower", "upper"] {
        assert_eq!(value(&summary, &format!("pairs.{pair}.normal_force")), 0.0);
    }
    near(value(&summary, "probes.m.displacement.1"), 0.0, 1e-15, "displacement");
    let free = &summary["free_modes"];
    assert_eq!(free.as_array().map(Vec::len), Some(1), "{free}");
    assert_eq!(free[0]["body"], "middle");
    assert_eq!(free[0]["mode"], "translation y");
}

/// One cell whose nodes both lie beyond the narrow block on it: the pointwise transfer takes that one's nodes.
#[test]
fn nodes_that_face_nothing_leave_it_to_the_others() {
    let block = |name: &str, x: [f64; 2], y: [f64; 2], cells: usize, rest: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\nmesh.rectangle = {{ x = {{ from = {}, to = {}, cells = {cells} }}, \
             y = {{ from = {}, to = {}, cells = 2 }} }}\n{rest}",
            x[0], x[1], y[0], y[1]
        )
    };
    // By their moduli the first one, or the second one, has the multipliers.
    for young in ["2.1e9", "2.1e13"] {
        let text = format!(
            "analysis = \"plane stress\"\nalternation = {{ tolerance = 1e-10, transfer = \"pointwise\" }}\n\
             material = {{ steel = {{ young = 2.1e11, poisson = 0.3 }}, other = {{ young = {young}, poisson = 0.3 }} }}\n{}{}\
             [[contact]]\nname = \"pair\"\nsurfaces = [\"a.top\", \"b.bottom\"]\n",
            block("a", [0.0, 0.03], [0.0, 0.01], 1, "support = [{ surface = \"bottom\", x = 0, y = 0 }]\n")
                .replace("steel", "other"),
            block(
                "b",
                [0.01, 0.02],
                [0.01, 0.02],
                7,
                "support = [{ point = [0.01, 0.01], x = 0 }]\nload = [{ surface = \"top\", pressure = 1e6 }]\n"
            ),
        );
        super::close(&super::solve(&text), "pairs.pair.normal_force", 1e4, 1e-9);
    }
}
