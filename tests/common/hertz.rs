//! Hertz line contact as case texts: cylinders of R = 50 mm, half approach 1.501341e-5 m, plane strain.
/// Half-width, m, and peak pressure, Pa, of two equal steel cylinders under 1e6 N/m.
pub const A: f64 = 5.252319e-4;
pub const P0: f64 = 1.212074e9;
const RADIUS: f64 = 0.05;
const APPROACH: f64 = 1.501341e-5;

/// A half disc with `k` elements per half-width; cells far away of about `far` degrees.
fn half_disc(name: &str, element: &str, k: f64, far: f64, up: bool) -> String {
    // A node on the axis, and one at the edge of the contact.
    let size = (A / RADIUS).to_degrees() / k;
    let half = size * (1.25 * k).ceil().max(2.0);
    let (arc, y) = if up { ("up", -RADIUS) } else { ("down", RADIUS) };
    let depth = size.to_radians();
    format!(
        "[[body]]\nname = \"{name}\"\nmaterial = \"{name}\"\nelement = \"{element}\"\n\
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

fn heading(ratio: f64, with: &str) -> String {
    format!(
        "analysis = \"plane strain\"\nalternation.tolerance = 1e-10\n\
         material.upper = {{ young = {:e}, poisson = 0.3 }}\nmaterial.lower = {{ young = 2.1e11, poisson = 0.3 }}\n\
         contact = [{{ name = \"c\", surfaces = [\"upper.arc\", \"{with}\"] }}]\n",
        2.1e11 * ratio
    )
}

/// Two cylinders, the upper one's modulus `ratio` times the lower one's.
pub fn cylinders(element: &str, k: [f64; 2], far: f64, ratio: f64) -> String {
    heading(ratio, "lower.arc")
        + &half_disc("upper", element, k[0], far, false)
        + &half_disc("lower", element, k[1], far, true)
}

/// A cylinder on a rigid plane.
pub fn on_plane(element: &str, k: f64, far: f64) -> String {
    let plane = "[[body]]\nname = \"plane\"\nrigid.plane = { through = [0, 0], normal = [0, 1] }\n";
    heading(1.0, "plane.surface") + &half_disc("upper", element, k, far, false) + plane
}
