//! Bodies whose meshes differ in size, and chains of bodies, as case texts: units N, mm, MPa.

/// Peak pressure of the ball on the block, MPa: quad8 of 0.015 mm on both sides.
pub const PEAK: f64 = 1705.05;

/// A ball of R = 10 mm pressed by 0.02 mm on a block, with cells of these sizes, mm, at the contact (half-width 0.295 mm) of
/// each: uniform if that is not small.
pub fn ball_on_block(element: &str, [ball, block]: [f64; 2]) -> String {
    let degrees = (ball / 10.0).to_degrees();
    let ball = match ball < 0.3 {
        true => format!(
            "angle = {{ at = [-70, -3, 0, 3, 70], size = [8, {degrees}, {degrees}, {degrees}, 8] }}, \
             depth = {{ at = [0, 0.5], size = [{}, 0.08] }}, core = 6",
            ball / 10.0
        ),
        false => {
            let cells = (5.0 / ball).round();
            format!(
                "angle = {{ from = -70, to = 70, cells = {} }}, depth = {{ to = 0.5, cells = {cells} }}, core = {}",
                2.0 * (70.0 / degrees).round(),
                cells.clamp(2.0, 6.0)
            )
        }
    };
    let block = match block < 0.3 {
        true => format!(
            "x = {{ at = [-20, -0.6, 0, 0.6, 20], size = [3, {block}, {block}, {block}, 3] }}, \
             y = {{ at = [-20, 0], size = [3, {block}] }}"
        ),
        false => {
            let cells = (20.0 / block).round();
            format!(
                "x = {{ from = -20, to = 20, cells = {} }}, y = {{ from = -20, to = 0, cells = {cells} }}",
                2.0 * cells
            )
        }
    };
    format!(
        "{}contact = [{{ name = \"c\", surfaces = [\"ball.arc\", \"block.top\"] }}]\n\
         {}mesh.half_disc = {{ center = [0, 10], radius = 10, arc = \"down\", {ball} }}\n\
         support = [{{ surface = \"flat\", x = 0, y = -0.02 }}]\n\
         {}mesh.rectangle = {{ {block} }}\nsupport = [{{ surface = \"bottom\", x = 0, y = 0 }}]\n",
        heading(),
        body("ball", element),
        body("block", element)
    )
}

/// Peak pressure of the ball on the chain, MPa: quad8 of 0.01 mm at the contact, six to a mm in the beam.
#[allow(dead_code, reason = "not of every test that is made of this file")]
pub const CHAIN_PEAK: f64 = 1565.44;

/// A ball pressed by 0.08 mm on a small block that lies on a beam held at both ends: what decides the force is the beam, with
/// `cells` cells a mm of its own element.
#[allow(dead_code, reason = "not of every test that is made of this file")]
pub fn ball_on_chain(element: &str, beam: &str, cells: usize) -> String {
    let degrees = 0.002_f64.to_degrees();
    format!(
        "{}contact = [{{ name = \"top\", surfaces = [\"ball.arc\", \"block.top\"] }}, \
         {{ name = \"low\", surfaces = [\"block.bottom\", \"beam.top\"] }}]\n\
         {}mesh.half_disc = {{ center = [0, 10], radius = 10, arc = \"down\", \
         angle = {{ at = [-70, -2, 0, 2, 70], size = [8, {degrees}, {degrees}, {degrees}, 8] }}, \
         depth = {{ at = [0, 0.5], size = [0.002, 0.08] }}, core = 6 }}\n\
         support = [{{ surface = \"flat\", x = 0, y = -0.08 }}]\n\
         {}mesh.rectangle = {{ x = {{ at = [-1, -0.3, 0, 0.3, 1], size = [0.2, 0.02, 0.02, 0.02, 0.2] }}, \
         y = {{ at = [-3, 0], size = [0.3, 0.02] }} }}\nsupport = [{{ point = [0, -3], x = 0 }}]\n\
         {}mesh.rectangle = {{ x = {{ from = -10, to = 10, cells = {} }}, y = {{ from = -6, to = -3, cells = {} }} }}\n\
         support = [{{ surface = \"left\", x = 0, y = 0 }}, {{ surface = \"right\", x = 0, y = 0 }}]\n",
        heading(),
        body("ball", element),
        body("block", element),
        body("beam", beam),
        20 * cells,
        3 * cells
    )
}

fn heading() -> &'static str {
    "units = \"consistent\"\nanalysis = \"plane strain\"\nalternation.tolerance = 1e-8\n\
     material.steel = { young = 210000, poisson = 0.3 }\n"
}

fn body(name: &str, element: &str) -> String {
    format!("[[body]]\nname = \"{name}\"\nmaterial = \"steel\"\nelement = \"{element}\"\n")
}
