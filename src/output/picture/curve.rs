//! The curves of `pressure.svg`: which of them there are, and over which coordinate they are drawn.
use super::CURVES;
use super::colour::ramp;
use crate::output::Results;
use crate::record::{PairTables, SideTable};
use crate::vector::larger;
use plotters::style::{Color, RGBColor, ShapeStyle};

/// Load steps whose curves can still be told apart.
const STEPS: usize = 6;

/// Pressure or traction along a surface.
pub(super) struct Curve<'a> {
    /// 0: side a of the pair.
    pub side: usize,
    pub name: String,
    pub colour: RGBColor,
    pub stroke: ShapeStyle,
    /// Radius of the dot at a node in contact, pixels.
    pub dot: i32,
    pub points: Vec<Point>,
    /// By node: where it is drawn, m, along a surface that is closed if it has a length, m.
    places: Vec<f64>,
    pub period: Option<f64>,
    pub table: &'a SideTable,
    /// By node: what is drawn, Pa, and whether it gets a dot.
    nodes: Vec<(f64, bool)>,
}

/// A node on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    /// Coordinate along the surface, m.
    pub s: f64,
    /// Pressure or traction, Pa.
    pub value: f64,
    /// True if it is in contact.
    pub touches: bool,
}

impl<'a> Curve<'a> {
    fn new(
        side: usize,
        name: String,
        table: &'a SideTable,
        (colour, width, dot): (RGBColor, u32, i32),
    ) -> Self {
        let nodes = (0..table.s.len()).map(|i| (table.pressure[i], table.touches(i))).collect();
        Curve::of_nodes(side, name, table, nodes, (colour, width, dot))
    }

    /// The same nodes with other values, drawn at the same places without dots.
    pub fn with_values(&self, width: u32, value: impl Fn(usize) -> f64) -> Self {
        let nodes = (0..self.table.s.len()).map(|i| (value(i), false)).collect();
        let style = (self.colour, width, 0);
        let mut curve = Curve::of_nodes(self.side, self.name.clone(), self.table, nodes, style);
        curve.place(self.places.clone(), self.period);
        curve
    }

    fn of_nodes(
        side: usize,
        name: String,
        table: &'a SideTable,
        nodes: Vec<(f64, bool)>,
        (colour, width, dot): (RGBColor, u32, i32),
    ) -> Self {
        let stroke = colour.stroke_width(width);
        let mut curve = Curve {
            side,
            name,
            colour,
            stroke,
            dot,
            points: Vec::new(),
            places: Vec::new(),
            period: None,
            table,
            nodes,
        };
        curve.place(table.s.clone(), table.closed);
        curve
    }

    /// Draws the nodes at other coordinates, along a closed surface of length `period`. What has no coordinate or no value is
    /// left out. A closed curve comes back to its first node.
    fn place(&mut self, s: Vec<f64>, period: Option<f64>) {
        self.period = period;
        let closed = self.table.closed;
        let point = |(i, s): (usize, f64)| {
            let (value, touches) = self.nodes[i];
            Point { s, value, touches }
        };
        let back = s.first().copied().filter(|_| closed.is_some()).map(|first| {
            // Along itself the first node is at the end, too; along another surface it stays where it is.
            let own = s == self.table.s;
            (0, if own { closed.unwrap_or(first) } else { first })
        });
        self.places = s;
        let all = self.places.iter().copied().enumerate().chain(back).map(point);
        self.points = all.filter(|p| p.s.is_finite() && p.value.is_finite()).collect();
    }
}

impl Curve<'_> {
    /// The curve within a range: coordinate, m, and value, Pa. One line, or on a closed surface one on either side of
    /// where the coordinate begins anew.
    pub fn within(&self, from: f64, to: f64) -> Vec<Vec<(f64, f64)>> {
        let mut lines = vec![Vec::new()];
        for (i, p) in self.points.iter().enumerate() {
            let start = (p.s, p.value);
            let Some(q) = self.points.get(i + 1) else {
                push(&mut lines, start, [from, to]);
                continue;
            };
            let end = (q.s, q.value);
            match self.period {
                Some(period) if (q.s - p.s).abs() > 0.5 * period => {
                    let seams = if p.s > q.s { [period, 0.0] } else { [0.0, period] };
                    let ways = [(seams[0] - p.s).abs(), (q.s - seams[1]).abs()];
                    let t = if ways[0] + ways[1] > 0.0 { ways[0] / (ways[0] + ways[1]) } else { 0.0 };
                    let value = p.value + t * (q.value - p.value);
                    piece(&mut lines, start, (seams[0], value), [from, to]);
                    push(&mut lines, (seams[0], value), [from, to]);
                    lines.push(Vec::new());
                    piece(&mut lines, (seams[1], value), end, [from, to]);
                }
                _ => piece(&mut lines, start, end, [from, to]),
            }
        }
        lines
    }
}

/// Adds a point to the last line if it is in the range.
fn push(lines: &mut [Vec<(f64, f64)>], point: (f64, f64), [from, to]: [f64; 2]) {
    if let (true, Some(line)) = ((from..=to).contains(&point.0), lines.last_mut()) {
        line.push(point);
    }
}

/// Adds the start of a piece of a line, and where it enters and leaves the range.
fn piece(lines: &mut [Vec<(f64, f64)>], start: (f64, f64), end: (f64, f64), range: [f64; 2]) {
    push(lines, start, range);
    let mut cuts = range;
    if end.0 < start.0 {
        cuts.reverse();
    }
    for s in cuts {
        let t = (s - start.0) / (end.0 - start.0);
        if t > 0.0 && t < 1.0 {
            push(lines, (s, start.1 + t * (end.1 - start.1)), range);
        }
    }
}

/// The curves of a pair: its sides, or the side that carries the pressure after up to six load steps.
pub(super) fn curves(results: &Results, pair: usize) -> Vec<Curve<'_>> {
    let before = results.before.iter().map(|state| &state.pairs[pair]);
    let steps: Vec<&PairTables> = before.chain([&results.pairs[pair]]).collect();
    let mut curves = match &steps[..] {
        [] => Vec::new(),
        [last] => sides(last),
        steps => steps_of(steps, results),
    };
    // What is in contact is below them. The same pressure after several steps is to be seen for each.
    let n = curves.len() as u32;
    for (i, curve) in curves.iter_mut().enumerate().filter(|_| results.pairs[pair].law.is_frictional()) {
        curve.dot = 0;
        if steps.len() > 1 {
            curve.stroke = curve.colour.stroke_width(2 + 2 * (n - 1 - i as u32).min(2));
        }
    }
    curves
}

fn sides(pair: &PairTables) -> Vec<Curve<'_>> {
    let drawn = carriers(&[pair]);
    let curve = |&side: &usize| {
        let table = pair.sides[side].as_ref()?;
        // The second side is drawn thinner and smaller, upon the first.
        let (width, dot) = [(4, 6), (2, 3)][if drawn.len() == 1 { 1 } else { side }];
        let style = (CURVES[side], width, dot);
        Some(Curve::new(side, pair.surfaces[side].clone(), table, style))
    };
    let mut curves: Vec<_> = drawn.iter().filter_map(curve).collect();
    // Side b runs the other way round its body: it is drawn backwards, so that what touches is drawn at one place.
    if let [a, b] = &mut curves[..] {
        b.place(along(a.table, b.table), a.table.closed);
    }
    curves
}

/// `step 2, shear`.
fn step_name(results: &Results, k: usize) -> String {
    let name = results.run.steps.as_ref().and_then(|table| table.get(k)?.name.as_deref());
    let number = format!("step {}", k + 1);
    name.map_or_else(|| number.clone(), |name| format!("{number}, {name}"))
}

fn steps_of<'a>(steps: &[&'a PairTables], results: &Results) -> Vec<Curve<'a>> {
    let largest = |side: usize| {
        let tables = steps.iter().filter_map(|pair| pair.sides[side].as_ref());
        tables.flat_map(|table| &table.pressure).copied().filter(|p| p.is_finite()).fold(0.0, larger)
    };
    let with_multipliers = |side: &usize| {
        let mut tables = steps.iter().filter_map(|pair| pair.sides[*side].as_ref());
        tables.any(|table| table.multipliers)
    };
    let rubs = steps.iter().any(|pair| pair.law.is_frictional());
    let side = match &carriers(steps)[..] {
        [] => return Vec::new(),
        [side] => *side,
        // Tractions are exact where the unknowns are.
        both if rubs => usize::from(!both.first().is_some_and(with_multipliers)),
        // Two faces of the same pressure: the first will do.
        _ => usize::from(largest(1) > 2.0 * largest(0)),
    };
    let chosen = choose(steps.len());
    let curve = |(i, &k): (usize, &usize)| {
        let table = steps[k].sides[side].as_ref()?;
        let light = 1.0 - i as f64 / (chosen.len() - 1).max(1) as f64;
        let [r, g, b] = ramp(0.82 * light);
        Some(Curve::new(side, step_name(results, k), table, (RGBColor(r, g, b), 2, 3)))
    };
    chosen.iter().enumerate().filter_map(curve).collect()
}

/// Steps to draw: all, or the last and others evenly before it.
fn choose(n: usize) -> Vec<usize> {
    let m = n.min(STEPS);
    (1..=m).map(|i| (i * n).div_ceil(m) - 1).collect()
}

/// Sides with something to draw: nodes that can touch, or pressure; if no side has, those with nodes.
fn carriers(steps: &[&PairTables]) -> Vec<usize> {
    let tables = |side: usize| steps.iter().filter_map(move |pair| pair.sides[side].as_ref());
    let carries = |table: &SideTable| {
        let presses = table.pressure.iter().any(|p| p.is_finite() && *p != 0.0);
        table.status.iter().any(|status| *status != 0) || presses
    };
    let with = |test: &dyn Fn(&SideTable) -> bool| -> Vec<usize> {
        (0..2).filter(|&side| tables(side).any(test)).collect()
    };
    let carriers = with(&carries);
    if carriers.is_empty() { with(&|table| !table.s.is_empty()) } else { carriers }
}

/// The part of the coordinate that is worth drawing, m.
pub(super) fn range(curves: &[Curve]) -> (f64, f64) {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let around = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| (low.min(s), high.max(s)))
    };
    let (low, high) = around(&mut points().map(|point| point.s));
    let touching = |point: &&Point| point.touches || point.value != 0.0;
    let (from, to) = around(&mut points().filter(touching).map(|point| point.s));
    // A small contact would be a needle: show it with as much beside it.
    let margin = 0.5 * (to - from);
    let (from, to) = if from < to { (low.max(from - margin), high.min(to + margin)) } else { (low, high) };
    if from < to { (from, to) } else { (0.0, 1.0) }
}

/// The coordinate along `a` of each node of `b`: of the closest point of the polyline of `a`.
fn along(a: &SideTable, b: &SideTable) -> Vec<f64> {
    let closest = |x: &[f64; 3]| {
        let mut best = (f64::INFINITY, f64::NAN);
        let n = a.s.len();
        // On a closed surface from the last node back to the first, too.
        for i in 1..n + usize::from(a.closed.is_some()) {
            let (p, q) = (a.x[i - 1], a.x[i % n]);
            let end = if i < n { a.s[i] } else { a.closed.unwrap_or(a.s[0]) };
            let d: [f64; 3] = std::array::from_fn(|k| q[k] - p[k]);
            let length2: f64 = d.iter().map(|d| d * d).sum();
            let dot: f64 = (0..3).map(|k| (x[k] - p[k]) * d[k]).sum();
            let t = if length2 > 0.0 { (dot / length2).clamp(0.0, 1.0) } else { 0.0 };
            let distance2: f64 = (0..3).map(|k| (p[k] + t * d[k] - x[k]).powi(2)).sum();
            if distance2 < best.0 {
                best = (distance2, a.s[i - 1] + t * (end - a.s[i - 1]));
            }
        }
        best.1
    };
    if a.s.len() < 2 { b.s.clone() } else { b.x.iter().map(closest).collect() }
}

#[cfg(test)]
pub(super) mod testing {
    use super::*;

    /// A side of three nodes without pressure.
    pub fn table(s: [f64; 3], x: [f64; 3], status: [i32; 3]) -> SideTable {
        let zeros = vec![[0.0; 3]; 3];
        SideTable {
            s: s.to_vec(),
            x: x.map(|x| [x, 0.0, 0.0]).to_vec(),
            normal: zeros.clone(),
            gap: vec![0.0; 3],
            pressure: vec![0.0; 3],
            force: zeros,
            status: status.to_vec(),
            multipliers: true,
            ..SideTable::default()
        }
    }

    /// Its pressure.
    pub fn curve(table: &SideTable) -> Curve<'_> {
        Curve::new(0, String::new(), table, (CURVES[0], 1, 1))
    }
}

#[cfg(test)]
mod tests {
    use super::testing::{curve, table};
    use super::*;
    use crate::contact::Law;

    #[test]
    fn the_other_side_is_drawn_where_it_touches() {
        let a = table([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], [1; 3]);
        let b = table([0.0, 1.0, 2.0], [2.0, 0.5, -1.0], [1; 3]);
        assert_eq!(along(&a, &b), [2.0, 0.5, 0.0]);
    }

    #[test]
    fn a_side_without_contact_nodes_is_not_drawn() {
        let side = |status| Some(table([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], status));
        let pair = |sides| PairTables {
            name: "p".into(),
            surfaces: ["a".into(), "b".into()],
            law: Law::Frictionless,
            varies: false,
            sides,
        };
        assert_eq!(carriers(&[&pair([side([0; 3]), side([0, 1, 2])])]), [1]);
        assert_eq!(carriers(&[&pair([side([0; 3]), None])]), [0]);
        assert_eq!(carriers(&[&pair([side([1; 3]), side([2; 3])])]), [0, 1]);
        assert!(carriers(&[&pair([None, Some(SideTable::default())])]).is_empty());
        let all_open = pair([side([0; 3]), None]);
        assert_eq!(sides(&all_open)[0].points.len(), 3);
    }

    #[test]
    fn a_line_ends_at_the_ends_of_the_range() {
        let mut side = table([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], [1; 3]);
        side.pressure = vec![0.0, 2.0, 6.0];
        let mut curve = curve(&side);
        assert_eq!(curve.within(0.5, 1.5), [[(0.5, 1.0), (1.0, 2.0), (1.5, 4.0)]]);
        curve.place(vec![2.0, 1.0, 0.0], None);
        assert_eq!(curve.within(0.5, 1.5), [[(1.5, 1.0), (1.0, 2.0), (0.5, 4.0)]]);
        assert_eq!(curve.within(1.25, 1.5), [[(1.5, 1.0), (1.25, 1.5)]]);
    }

    /// Three nodes on a closed line of length 3, the other side turned by half a piece, and the other way round.
    #[test]
    fn a_closed_surface_is_drawn_all_round_and_without_a_line_across() {
        let corner = |k: f64| [(TURN * k).cos(), (TURN * k).sin(), 0.0];
        const TURN: f64 = std::f64::consts::TAU / 3.0;
        let ring = |pressure: [f64; 3]| SideTable {
            s: vec![0.0, 1.0, 2.0],
            x: [0.0, 1.0, 2.0].map(corner).to_vec(),
            closed: Some(3.0),
            pressure: pressure.to_vec(),
            ..table([0.0; 3], [0.0; 3], [2; 3])
        };
        let a = ring([1.0, 2.0, 3.0]);
        let own = curve(&a);
        assert_eq!(own.within(0.0, 3.0), [[(0.0, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, 1.0)]]);
        // Backwards, in the middles of the sides of the first.
        let middle = |k: f64| std::array::from_fn(|c| 0.5 * (corner(k)[c] + corner(k + 1.0)[c]));
        let b = SideTable { x: [1.0, 0.0, 2.0].map(middle).to_vec(), ..ring([4.0, 6.0, 8.0]) };
        let mut other = curve(&b);
        other.place(along(&a, &b), a.closed);
        let lines = other.within(0.0, 3.0);
        let expected = [vec![(1.5, 4.0), (0.5, 6.0), (0.0, 7.0)], vec![(3.0, 7.0), (2.5, 8.0), (1.5, 4.0)]];
        let near = |(a, b): (&(f64, f64), &(f64, f64))| (a.0 - b.0).abs() + (a.1 - b.1).abs() < 1e-12;
        let same = |(a, b): (&Vec<_>, &Vec<_>)| a.len() == b.len() && std::iter::zip(a, b).all(near);
        assert!(lines.len() == 2 && std::iter::zip(&lines, &expected).all(same), "{lines:?}");
    }

    #[test]
    fn the_last_step_is_always_drawn() {
        assert_eq!(choose(2), [0, 1]);
        assert_eq!(choose(6), [0, 1, 2, 3, 4, 5]);
        assert_eq!(choose(12), [1, 3, 5, 7, 9, 11]);
        assert_eq!(choose(7).last(), Some(&6));
        assert_eq!(choose(7).len(), 6);
    }
}
