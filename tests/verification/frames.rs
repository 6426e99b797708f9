//! Friction does not know the frame, the units or the order of the sides: the same scene turned, in other units, with sides exchanged,
//! and pairs of bodies that turn together.
use super::{multipliers, near, solve_all, value};
use kontakt::output::Results;
use kontakt::record::SideTable;
use kontakt::vector::worst;
use serde_json::Value;

/// How a scene is written: turned by an angle in degrees, lengths and pressures times these.
#[derive(Clone, Copy)]
struct Frame {
    angle: f64,
    length: f64,
    pressure: f64,
}

const PLAIN: Frame = Frame { angle: 0.0, length: 1.0, pressure: 1.0 };

impl Frame {
    /// A vector of lengths or of pressures.
    fn vector(self, [x, y]: [f64; 2], unit: f64) -> String {
        let (s, c) = self.angle.to_radians().sin_cos();
        format!("[{:?}, {:?}]", unit * (c * x - s * y), unit * (s * x + c * y))
    }

    fn corners(self, x: [f64; 2], y: [f64; 2]) -> String {
        let at = |x, y| self.vector([x, y], self.length);
        format!("[{}, {}, {}, {}]", at(x[0], y[0]), at(x[1], y[0]), at(x[1], y[1]), at(x[0], y[1]))
    }
}

/// A soft block pressed on a stiffer one, pushed to the right, and back to the left; on a rigid floor as well if that is wanted. Nodes
/// match unless `cells` of the two differ.
fn scene(frame: Frame, law: &str, cells: [usize; 2], exchanged: bool) -> String {
    let Frame { angle, length, pressure } = frame;
    let support =
        |surface: &str| format!("support = [{{ surface = \"{surface}\", x = 0, y = 0, angle = {angle} }}]");
    let bodies = [
        format!(
            "[[body]]\nname = \"upper\"\nmaterial = \"soft\"\nmesh.block = {{ corners = {}, u = {{ cells = {} }}, v = {{ cells = 8 }} }}\n\
             load = [{{ surface = \"top\", pressure = {:?} }}, {{ surface = \"left\", path = \"push\", traction = {} }}]\n",
            frame.corners([0.0, 0.02], [0.0, 0.01]),
            cells[0],
            5e7 * pressure,
            frame.vector([2e7, 0.0], pressure),
        ),
        format!(
            "[[body]]\nname = \"lower\"\nmaterial = \"hard\"\nmesh.block = {{ corners = {}, u = {{ cells = {} }}, v = {{ cells = 8 }} }}\n{}\n",
            frame.corners([-0.01, 0.03], [-0.02, 0.0]),
            cells[1],
            support("bottom"),
        ),
    ];
    let (bodies, surfaces) = match exchanged {
        false => (bodies.concat(), "\"upper.bottom\", \"lower.top\""),
        true => (format!("{}{}", bodies[1], bodies[0]), "\"lower.top\", \"upper.bottom\""),
    };
    format!(
        "analysis = \"plane strain\"\nunits = \"consistent\"\nthickness = {length:?}\nalternation.tolerance = 1e-12\n\
         material.hard = {{ young = {:?}, poisson = 0.3 }}\nmaterial.soft = {{ young = {:?}, poisson = 0.35 }}\n{bodies}\
         [[contact]]\nname = \"pair\"\nsurfaces = [{surfaces}]\n{law}\n\
         [[step]]\npaths = {{ push = 0 }}\n[[step]]\npaths = {{ push = 1 }}\n[[step]]\npaths = {{ push = -0.5 }}\n",
        2.1e11 * pressure,
        7e10 * pressure,
    )
}

/// Pressures, tractions, slips and states along the side with the multipliers, by the distance from its end.
fn along(results: &Results) -> Vec<[f64; 5]> {
    let table: &SideTable = multipliers(results, 0);
    let q = table.tangential.as_ref().expect("a law");
    let row =
        |i: usize| [table.s[i], table.pressure[i], q.traction[i], q.slip[i], f64::from(table.status[i])];
    (0..table.s.len()).map(row).collect()
}

/// Fields and sums of two runs, in units of `length` and `pressure`.
#[track_caller]
fn same(a: &(Value, Results), b: &(Value, Results), frame: Frame, relative: f64, what: &str) {
    let Frame { length, pressure, .. } = frame;
    let units = [length, pressure, pressure, length, 1.0];
    let [x, y] = [a, b].map(|run| along(&run.1));
    assert_eq!(x.len(), y.len(), "{what}");
    for k in 0..5 {
        let size = worst(x.iter().map(|row| row[k].abs()));
        assert!(size > 0.0, "{what}: column {k}");
        let off = worst(std::iter::zip(&x, &y).map(|(x, y)| (x[k] - y[k] / units[k]).abs()));
        assert!(off <= relative * size, "{what}: column {k} off by {:.1e}", off / size);
    }
    let force = pressure * length * length;
    for step in 0..3 {
        for (key, unit, size) in [
            ("normal_force", force, "normal_force"),
            ("friction.force", force, "normal_force"),
            ("friction.dissipated", force * length, "friction.dissipated"),
            ("friction.max_slip", length, "friction.max_slip"),
            ("friction.slip_length", length, "contact_length"),
        ] {
            let of = |run: &(Value, Results), key: &str| {
                value(&run.0["steps"][step], &format!("pairs.pair.{key}"))
            };
            near(
                of(b, key) / unit,
                of(a, key),
                relative * of(a, size),
                &format!("{what}: {key} of step {step}"),
            );
        }
    }
}

const LAWS: [&str; 2] = ["friction = 0.3", "law = \"tresca\"\nshear = SHEAR"];

fn law(text: &str, frame: Frame) -> String {
    text.replace("SHEAR", &format!("{:?}", 1.2e7 * frame.pressure))
}

#[test]
fn a_turned_scene_rubs_alike() {
    for text in LAWS {
        for cells in [[20, 40], [17, 40]] {
            let of = |frame: Frame| solve_all(&scene(frame, &law(text, frame), cells, false), 1, &[]);
            let plain = of(PLAIN);
            let states: Vec<f64> = along(&plain.1).iter().map(|row| row[4]).collect();
            assert!(states.contains(&2.0) && states.contains(&3.0), "{states:?}");
            for angle in [37.0, 90.0, 180.0, -121.0] {
                let turned = of(Frame { angle, ..PLAIN });
                same(&plain, &turned, PLAIN, 1e-9, &format!("{text}, {cells:?}, {angle} degrees"));
            }
        }
    }
}

/// Millimetres and newtons; a scene a thousand times as large.
#[test]
fn other_units_rub_alike() {
    for text in LAWS {
        let of = |frame: Frame| solve_all(&scene(frame, &law(text, frame), [17, 40], false), 1, &[]);
        let plain = of(PLAIN);
        for (length, pressure) in [(1e3, 1e-6), (1e3, 1.0), (1e6, 1e-12), (1.0, 1e-9)] {
            let frame = Frame { length, pressure, ..PLAIN };
            same(&plain, &of(frame), frame, 1e-9, &format!("{text}, {length:e}, {pressure:e}"));
        }
    }
}

/// Where nodes match it does not matter which side is named first, nor which carries the multipliers.
#[test]
fn exchanged_sides_rub_alike() {
    for text in LAWS {
        for cells in [[20, 40], [17, 40]] {
            let [given, exchanged] = [false, true]
                .map(|exchanged| solve_all(&scene(PLAIN, &law(text, PLAIN), cells, exchanged), 1, &[]));
            same(&given, &exchanged, PLAIN, 1e-9, &format!("{text}, {cells:?}"));
            let of = |run: &(Value, Results), key: &str| value(&run.0, &format!("pairs.pair.{key}"));
            for key in ["resultant.0", "resultant.1"] {
                near(of(&given, key), -of(&exchanged, key), 1e-9 * of(&given, "normal_force"), key);
            }
        }
    }
    // The multipliers on the other side: of equally fine ones they go to the softer body.
    let of = |upper: f64| {
        let text = scene(PLAIN, "friction = 0.3", [20, 40], false).replace("0.35", "0.3");
        solve_all(&text.replace("young = 70000000000.0", &format!("young = {upper:e}")), 1, &[]).0
    };
    let [soft, hard] = [of(2.1e11 * (1.0 - 2e-6)), of(2.1e11 * (1.0 + 2e-6))];
    assert_ne!(soft["pairs"][0]["multiplier_side"], hard["pairs"][0]["multiplier_side"]);
    for key in ["friction.force", "friction.dissipated", "friction.max_slip", "max_pressure"] {
        let [soft, hard] = [&soft, &hard].map(|run| value(run, &format!("pairs.pair.{key}")).abs());
        near(soft, hard, 1e-5 * hard, key);
    }
}
