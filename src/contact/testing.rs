//! Surfaces for tests.
use super::Surface;

/// A chain of facets through the images of `ends`, the body to the left; with mid-side nodes if `quadratic`. Closed
/// if the last end maps onto the first.
pub fn chain(ends: &[f64], quadratic: bool, map: impl Fn(f64) -> [f64; 2]) -> Surface {
    let place = |s: f64| {
        let [x, y] = map(s);
        [x, y, 0.0]
    };
    let closed = {
        let (a, b) = (place(ends[0]), place(ends[ends.len() - 1]));
        (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-12
    };
    let step = 1 + usize::from(quadratic);
    let n_facets = ends.len() - 1;
    let n_nodes = n_facets * step + usize::from(!closed);
    let mut points = Vec::new();
    for i in 0..n_nodes {
        let (facet, middle) = (i / step, i % step == 1);
        points.push(place(if middle { 0.5 * (ends[facet] + ends[facet + 1]) } else { ends[facet] }));
    }
    let facets = (0..n_facets).map(|f| {
        let mut nodes = vec![(f * step) as u32, ((f + 1) * step % n_nodes) as u32];
        if !closed {
            nodes[1] = ((f + 1) * step) as u32;
        }
        if quadratic {
            nodes.push((f * step + 1) as u32);
        }
        nodes
    });
    let facets = facets.collect();
    Surface::from_points(points, facets, 1.0, true)
}

/// `n` equal parts of an interval.
pub fn equal(n: usize, from: f64, to: f64) -> Vec<f64> {
    (0..=n).map(|i| from + (to - from) * i as f64 / n as f64).collect()
}

/// `n` unequal parts of an interval.
pub fn unequal(n: usize, from: f64, to: f64) -> Vec<f64> {
    let wave = |i: usize| if i == 0 || i == n { 0.0 } else { 0.3 * (7.3 * i as f64).sin() };
    (0..=n).map(|i| from + (to - from) * (i as f64 + wave(i)) / n as f64).collect()
}

/// A circle from `n` facets: a disc, or a bore that is run through clockwise.
pub fn circle(n: usize, radius: f64, quadratic: bool, bore: bool, start: f64) -> Surface {
    let turn = if bore { -std::f64::consts::TAU } else { std::f64::consts::TAU };
    chain(&equal(n, 0.0, turn), quadratic, |s| [radius * (s + start).cos(), radius * (s + start).sin()])
}

/// Turns by an angle, then shifts.
pub fn placed(surface: &Surface, angle: f64, shift: [f64; 2]) -> Surface {
    let (sin, cos) = angle.sin_cos();
    let u: Vec<[f64; 3]> = surface
        .points
        .iter()
        .map(|p| [cos * p[0] - sin * p[1] + shift[0] - p[0], sin * p[0] + cos * p[1] + shift[1] - p[1], 0.0])
        .collect();
    surface.moved(&u)
}
