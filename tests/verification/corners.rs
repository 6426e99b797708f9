//! Nodes in several pairs, on planes of symmetry and in corners; surfaces that part and meet again.
use super::friction::STEEL;
use super::{multipliers, near, rectangle, solve, solve_all, value};
use kontakt::record::SideTable;
use kontakt::vector::{largest, worst};
use serde_json::Value;

fn of_step(summary: &Value, step: usize, pair: &str, key: &str) -> f64 {
    value(&summary["steps"][step], &format!("pairs.{pair}.{key}"))
}

/// A block in a corner, pressed on the floor by P. The floor is dragged to the wall and the wall up or down, so that both slide all along:
/// N_w = mu_f N_f and N_f = P + s mu_w N_w, s = 1 where the wall goes down. The node in the corner is in both pairs.
#[test]
fn a_block_in_a_corner_slides_on_floor_and_wall() {
    let (floor, wall, load) = (0.4, 0.3, 1e6 * 0.03);
    for (sense, name) in [(-1.0, "down"), (1.0, "up")] {
        for element in ["quad4", "quad8"] {
            let block = rectangle(
                "block",
                "steel",
                element,
                (0.0, 0.03, 10),
                (0.0, 0.02, 7),
                "load = [{ surface = \"top\", pressure = 1e6 }]",
            );
            let text = format!(
                "analysis = \"plane strain\"\n{STEEL}{block}\
                 [[body]]\nname = \"floor\"\nrigid = {{ plane = {{ through = [0, 0], normal = [0, 1] }}, x = 1e-3, path = \"floor\" }}\n\
                 [[body]]\nname = \"wall\"\nrigid = {{ plane = {{ through = [0.03, 0], normal = [-1, 0] }}, y = {}, path = \"wall\" }}\n\
                 [[contact]]\nname = \"floor\"\nsurfaces = [\"block.bottom\", \"floor.surface\"]\nfriction = {floor}\n\
                 [[contact]]\nname = \"wall\"\nsurfaces = [\"block.right\", \"wall.surface\"]\nfriction = {wall}\n\
                 [[step]]\nname = \"slide\"\npaths = {{ floor = 0.5, wall = 0.5 }}\n[[step]]\npaths = {{ floor = 1, wall = 2 }}\n",
                sense * 1e-3
            );
            let summary = solve(&text);
            let on_floor = load / (1.0 + sense * floor * wall);
            let on_wall = floor * on_floor;
            for step in [0, 1] {
                let of = |pair: &str, key: &str| of_step(&summary, step, pair, key);
                for (pair, mu, normal) in [("floor", floor, on_floor), ("wall", wall, on_wall)] {
                    let what = format!("{name}, {element}, {pair}");
                    near(of(pair, "normal_force"), normal, 1e-9 * load, &what);
                    near(of(pair, "friction.force").abs(), mu * normal, 1e-9 * load, &what);
                    assert_eq!(of(pair, "friction.sticking"), 0.0, "{what}");
                }
                near(of("floor", "resultant.0"), on_wall, 1e-9 * load, "dragged to the wall");
                near(
                    of("wall", "resultant.1"),
                    sense * wall * on_wall,
                    1e-9 * load,
                    "dragged along the wall",
                );
            }
            // Nothing but slip from the first step to the second.
            let gained = |pair: &str| {
                of_step(&summary, 1, pair, "friction.dissipated")
                    - of_step(&summary, 0, pair, "friction.dissipated")
            };
            near(
                gained("floor"),
                floor * on_floor * 0.5e-3,
                1e-9 * floor * on_floor * 1e-3,
                "work on the floor",
            );
            near(gained("wall"), wall * on_wall * 1.5e-3, 1e-9 * wall * on_wall * 1e-3, "work on the wall");
        }
    }
}

/// A block over the joint of two slabs, each with its own coefficient, and dragged along: P is shared, and each share has its friction.
#[test]
fn a_block_over_a_joint_rubs_on_both_slabs() {
    let block = rectangle(
        "block",
        "steel",
        "quad4",
        (-0.02, 0.02, 13),
        (0.0, 0.015, 6),
        "support = [{ surface = \"top\", x = 1e-4, path = \"drag\" }]\nload = [{ surface = \"top\", pressure = 1e6 }]",
    );
    let slab = |name: &str, x: (f64, f64, usize)| {
        rectangle(
            name,
            "steel",
            "quad4",
            x,
            (-0.02, 0.0, 7),
            "support = [{ surface = \"bottom\", x = 0, y = 0 }]",
        )
    };
    let text = format!(
        "analysis = \"plane strain\"\n{STEEL}{block}{}{}\
         [[contact]]\nname = \"left\"\nsurfaces = [\"block.bottom\", \"first.top\"]\nfriction = 0.4\n\
         [[contact]]\nname = \"right\"\nsurfaces = [\"block.bottom\", \"second.top\"]\nfriction = 0.2\n\
         [[step]]\npaths = {{ drag = 0 }}\n[[step]]\npaths = {{ drag = 0.5 }}\n[[step]]\npaths = {{ drag = 1 }}\n",
        slab("first", (-0.04, 0.0, 20)),
        slab("second", (0.0, 0.04, 20)),
    );
    let summary = solve(&text);
    let load = 1e6 * 0.04;
    let normal = ["left", "right"].map(|pair| of_step(&summary, 2, pair, "normal_force"));
    near(normal[0] + normal[1], load, 1e-9 * load, "the load");
    for (pair, friction, normal) in [("left", 0.4, normal[0]), ("right", 0.2, normal[1])] {
        near(of_step(&summary, 2, pair, "friction.force").abs(), friction * normal, 1e-9 * load, pair);
        near(of_step(&summary, 2, pair, "resultant.0"), -friction * normal, 1e-9 * load, pair);
        let gained = of_step(&summary, 2, pair, "friction.dissipated")
            - of_step(&summary, 1, pair, "friction.dissipated");
        near(gained, friction * normal * 0.5e-4, 1e-8 * friction * load * 1e-4, pair);
    }
}

/// Half of a block that is pressed on a floor and spreads, and all of it: the node on the plane of symmetry does not slip, all others as
/// they do in the whole.
#[test]
fn a_half_is_half_of_the_whole() {
    for soft in ["rigid", "deformable"] {
        let scene = |whole: bool| {
            let (from, held) = if whole {
                (-1.0, "{ point = [0, 0.02], x = 0 }")
            } else {
                (0.0, "{ surface = \"left\", x = 0 }")
            };
            let (n, m) = if whole { (24, 40) } else { (12, 20) };
            let block = rectangle(
                "block",
                "soft",
                "quad4",
                (0.015 * from, 0.015, n),
                (0.0, 0.02, 12),
                &format!("support = [{held}]\nload = [{{ surface = \"top\", pressure = 2e7 }}]"),
            );
            let side = if whole { "" } else { ", { surface = \"left\", x = 0 }" };
            let floor = match soft {
                "rigid" => {
                    "[[body]]\nname = \"floor\"\nrigid = { plane = { through = [0, 0], normal = [0, 1] } }\n"
                        .to_owned()
                }
                _ => rectangle(
                    "floor",
                    "steel",
                    "quad4",
                    (0.03 * from, 0.03, m),
                    (-0.03, 0.0, 14),
                    &format!("support = [{{ surface = \"bottom\", x = 0, y = 0 }}{side}]"),
                ),
            };
            let other = if soft == "rigid" { "floor.surface" } else { "floor.top" };
            let text = format!(
                "analysis = \"plane strain\"\n{STEEL}material.soft = {{ young = 2e9, poisson = 0.4 }}\n{block}{floor}\
                 [[contact]]\nname = \"pair\"\nsurfaces = [\"block.bottom\", \"{other}\"]\nfriction = 0.1\n"
            );
            solve_all(&text, 1, &[])
        };
        let [whole, half] = [true, false].map(scene);
        let key = |run: &Value, key: &str| value(run, &format!("pairs.pair.{key}"));
        for name in ["normal_force", "friction.dissipated"] {
            near(
                key(&half.0, name),
                0.5 * key(&whole.0, name),
                1e-10 * key(&whole.0, name),
                &format!("{soft}: {name}"),
            );
        }
        let [whole, half] = [&whole.1, &half.1].map(|r| multipliers(r, 0).clone());
        let rows = |table: &SideTable| {
            let along = table.tangential.clone().expect("a law");
            let mut rows: Vec<[f64; 4]> = (0..table.s.len())
                .filter(|&i| table.x[i][0] > -1e-12)
                .map(|i| [table.x[i][0], table.pressure[i], along.traction[i], along.slip[i]])
                .collect();
            rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
            rows
        };
        let (a, b) = (rows(&whole), rows(&half));
        assert_eq!(a.len(), b.len());
        assert_eq!((b[0][2].abs() < 1.0, b[0][3]), (true, 0.0), "{soft}: the node in the middle: {:?}", b[0]);
        for k in 0..4 {
            let size = worst(a.iter().map(|row| row[k].abs()));
            assert!(size > 0.0, "{soft}: column {k}");
            std::iter::zip(&a, &b).for_each(|(a, b)| {
                near(b[k], a[k], 1e-10 * size, &format!("{soft}: column {k} at {}", a[0]))
            });
        }
    }
}

/// Pressed, dragged, lifted, moved on in the air, set down again and dragged on: in the air there is neither force nor slip, what comes
/// back is the first pressing, and what was lost stays lost.
#[test]
fn what_parts_and_meets_again_begins_anew() {
    for (floor, other) in [
        (
            "[[body]]\nname = \"floor\"\nrigid = { plane = { through = [0, 0], normal = [0, 1] }, x = 1e-3, path = \"along\" }\n",
            "floor.surface",
        ),
        ("", "floor.top"),
    ] {
        for geometry in ["initial", "updated"] {
            let block = rectangle(
                "block",
                "steel",
                "quad4",
                (-0.01, 0.01, 14),
                (0.0, 0.015, 8),
                "support = [{ surface = \"top\", x = 0 }, { surface = \"top\", y = -1e-5, path = \"down\" }]",
            );
            let floor = match floor {
                "" => rectangle(
                    "floor",
                    "steel",
                    "quad4",
                    (-0.04, 0.04, 56),
                    (-0.02, 0.0, 8),
                    "support = [{ surface = \"bottom\", y = 0 }, { surface = \"bottom\", x = 1e-3, path = \"along\" }]",
                ),
                rigid => rigid.to_owned(),
            };
            // down, along: pressed; dragged; lifted by as much as it was pressed; on in the air; set down; dragged on.
            let way = [(1.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, 3.0), (1.0, 3.0), (1.0, 3.5)];
            let steps: String = way
                .iter()
                .map(|(down, along)| format!("[[step]]\npaths = {{ down = {down}, along = {along} }}\n"))
                .collect();
            let run = |n: usize| {
                let steps: String = steps.split_inclusive("}\n").take(n).collect();
                let text = format!(
                    "analysis = \"plane strain\"\n{STEEL}{block}{floor}\
                     [[contact]]\nname = \"pair\"\nsurfaces = [\"block.bottom\", \"{other}\"]\nfriction = 0.3\ngeometry = \"{geometry}\"\n{steps}"
                );
                solve_all(&text, 1, &[])
            };
            let (summary, _) = run(6);
            let of = |step: usize, key: &str| of_step(&summary, step, "pair", key);
            let what = format!("{other}, {geometry}");
            // All that slides slips by the travel, but for what it has been dragged along before.
            assert_eq!(of(1, "friction.sticking"), 0.0, "{what}");
            for step in [2, 3] {
                assert_eq!(of(step, "normal_force"), 0.0, "{what}");
                assert_eq!(of(step, "active"), 0.0, "{what}");
                near(
                    of(step, "friction.dissipated"),
                    of(1, "friction.dissipated"),
                    1e-12 * of(1, "friction.dissipated"),
                    &what,
                );
            }
            let lost: Vec<f64> = (0..6).map(|step| of(step, "friction.dissipated")).collect();
            assert!(lost.windows(2).all(|w| w[1] >= w[0]), "{what}: {lost:?}");
            // The block is where it was; the floor reaches far enough to be the same everywhere, but for its ends.
            let same = if other == "floor.surface" { 1e-9 } else { 5e-3 };
            near(of(4, "normal_force"), of(0, "normal_force"), same * of(0, "normal_force"), &what);
            near(of(4, "resultant.0"), 0.0, same * of(0, "normal_force"), &what);
            if other == "floor.surface" {
                // No force is remembered: the tractions are those of the first pressing, node by node.
                let [pressed, dragged, again, last] =
                    [1, 2, 5, 6].map(|n| multipliers(&run(n).1, 0).tangential.clone().expect("a law"));
                let size = largest(&pressed.traction);
                std::iter::zip(&pressed.traction, &again.traction)
                    .for_each(|(a, b)| near(*b, *a, 1e-9 * size, &what));
                // Half as far dragged each node slips half of the travel less, for it springs back by the same.
                for i in 0..last.slip.len() {
                    let [first, second] = [dragged.slip[i] - pressed.slip[i], last.slip[i] - again.slip[i]];
                    near(first.abs() - second.abs(), 0.5e-3, 1e-9 * 1e-3, &format!("{what}: slip"));
                }
                // The bound is the mean of those before and after.
                let less = 0.5 * 0.3 * (of(0, "normal_force") + of(1, "normal_force")) * 0.5e-3;
                near(lost[1] - lost[0] - (lost[5] - lost[4]), less, 1e-9 * less, &format!("{what}: work"));
            }
            let bound = 0.3 * of(5, "normal_force");
            near(of(5, "friction.force").abs(), bound, 1e-9 * bound, &what);
            near(of(5, "resultant.0"), bound, 1e-3 * bound, &what);
            // The second drag loses what half of the first did, but for what springs back first.
            near(lost[5] - lost[4], bound * 0.5e-3, 0.02 * bound * 0.5e-3, &what);
        }
    }
}
