//! `pressure.svg`: contact pressure along the surface, a panel for each pair, both sides.
use super::scale::{Ticks, Unit};
use super::{CURVES, FONT, GRID, INK, failed, title};
use crate::error::Result;
use crate::output::{PairTables, Results, SideTable};
use plotters::coord::Shift;
use plotters::prelude::*;

const WIDTH: u32 = 960;
const PANEL: u32 = 420;
const TITLE: u32 = 56;
/// More panels are more than anyone looks at.
const MOST: usize = 12;

/// The picture as SVG; `None` if there are no contact tables.
pub(super) fn draw(results: &Results) -> Result<Option<String>> {
    let with_table = |pair: &&PairTables| pair.sides.iter().flatten().any(|side| !side.s.is_empty());
    let pairs: Vec<_> = results.pairs.iter().filter(with_table).take(MOST).collect();
    if pairs.is_empty() {
        return Ok(None);
    }
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, TITLE + PANEL * pairs.len() as u32))
            .into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let (head, body) = area.split_vertically(TITLE);
        let style = TextStyle::from((FONT, 22).into_font().style(FontStyle::Bold)).color(&INK);
        head.draw(&Text::new(title(results), (24, 18), style)).map_err(failed)?;
        for (panel, pair) in body.split_evenly((pairs.len(), 1)).iter().zip(&pairs) {
            draw_pair(panel, pair, results)?;
        }
        area.present().map_err(failed)?;
    }
    Ok(Some(svg))
}

/// Pressure over the coordinate along the surface. Side b runs the other way round its body: it is drawn
/// backwards, so that what touches is drawn at the same place.
fn draw_pair(panel: &DrawingArea<SVGBackend, Shift>, pair: &PairTables, results: &Results) -> Result<()> {
    let units = results.run.units;
    let finite = |x: &f64| x.is_finite();
    let sides = || pair.sides.iter().flatten();
    let largest = sides().flat_map(|side| &side.pressure).copied().filter(finite).fold(0.0, f64::max);
    let smallest = sides().flat_map(|side| &side.pressure).copied().filter(finite).fold(0.0, f64::min);
    let (curves, from, to) = curves(pair);
    let (p, s) = (Unit::stress(units, largest.max(-smallest)), Unit::length(units, from.abs().max(to.abs())));
    let top = if largest > 0.0 { 1.1 * largest } else { 1.0 } / p.factor;
    let bottom = if smallest < 0.0 { 1.1 * smallest / p.factor } else { 0.0 };

    let mut chart = ChartBuilder::on(panel)
        .margin(14)
        .margin_right(30)
        .caption(format!("Contact pressure, {}", pair.name), (FONT, 17).into_font().color(&INK))
        .x_label_area_size(52)
        .y_label_area_size(84)
        .build_cartesian_2d(from / s.factor..to / s.factor, bottom..top)
        .map_err(failed)?;
    let x_ticks = Ticks::new(from / s.factor, to / s.factor, 8);
    let y_ticks = Ticks::new(bottom, top, 6);
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_labels(8)
        .y_labels(6)
        .x_label_formatter(&|x| x_ticks.label(*x))
        .y_label_formatter(&|y| y_ticks.label(*y))
        .x_desc(s.label("distance along the surface"))
        .y_desc(p.label("pressure"))
        .label_style((FONT, 15).into_font().color(&INK))
        .axis_desc_style((FONT, 16).into_font().color(&INK))
        .draw()
        .map_err(failed)?;
    for (curve, surface) in curves.iter().zip(&pair.surfaces) {
        let colour = CURVES[curve.side];
        let point = |i: &usize| (curve.s[*i] / s.factor, curve.table.pressure[*i] / p.factor);
        let all: Vec<usize> = (0..curve.s.len()).collect();
        let stroke = colour.stroke_width(4 - 2 * curve.side as u32);
        let series = LineSeries::new(all.iter().map(point), stroke);
        let drawn = chart.draw_series(series).map_err(failed)?.label(surface.as_str());
        drawn.legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], stroke));
        // The second side is drawn thinner and smaller, upon the first.
        let active = all.iter().filter(|&&i| curve.table.status[i] == 2);
        let size = 6 - 3 * curve.side as i32;
        let markers = active.map(|i| Circle::new(point(i), size, colour.filled()));
        chart.draw_series(markers).map_err(failed)?;
    }
    chart
        .draw_series(std::iter::empty::<Circle<(f64, f64), i32>>())
        .map_err(failed)?
        .label("node in contact")
        .legend(|(x, y)| Circle::new((x + 11, y), 4, INK.filled()));
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .label_font((FONT, 15).into_font().color(&INK))
        .draw()
        .map_err(failed)
}

/// A side with the coordinate it is drawn over.
struct Curve<'a> {
    side: usize,
    table: &'a SideTable,
    s: Vec<f64>,
}

/// Both sides over the coordinate of side a, and the part of it that is worth drawing, m.
fn curves(pair: &PairTables) -> (Vec<Curve<'_>>, f64, f64) {
    let sides = pair.sides.iter().enumerate().filter_map(|(side, table)| Some((side, table.as_ref()?)));
    let mut curves: Vec<_> = sides.map(|(side, table)| Curve { side, table, s: table.s.clone() }).collect();
    if let [a, b] = &mut curves[..] {
        b.s = along(a.table, b.table);
    }
    let touching = |curve: &Curve| {
        let table = curve.table;
        let active = |i: &usize| table.status[*i] == 2 || table.pressure[*i] != 0.0;
        (0..table.s.len()).filter(active).map(|i| curve.s[i]).collect::<Vec<_>>()
    };
    let range = |values: Vec<f64>| {
        let finite = || values.iter().copied().filter(|s| s.is_finite());
        (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max))
    };
    let (low, high) = range(curves.iter().flat_map(|c| c.s.clone()).collect());
    let (from, to) = range(curves.iter().flat_map(touching).collect());
    // A small contact would be a needle: show it with as much beside it.
    let margin = 0.5 * (to - from);
    let (from, to) = if from < to { (low.max(from - margin), high.min(to + margin)) } else { (low, high) };
    if from < to { (curves, from, to) } else { (curves, 0.0, 1.0) }
}

/// The coordinate along `a` of each node of `b`: of the closest point of the polyline of `a`.
fn along(a: &SideTable, b: &SideTable) -> Vec<f64> {
    let closest = |x: &[f64; 3]| {
        let mut best = (f64::INFINITY, f64::NAN);
        for i in 1..a.s.len() {
            let (p, q) = (a.x[i - 1], a.x[i]);
            let d: [f64; 3] = std::array::from_fn(|k| q[k] - p[k]);
            let length2: f64 = d.iter().map(|d| d * d).sum();
            let dot: f64 = (0..3).map(|k| (x[k] - p[k]) * d[k]).sum();
            let t = if length2 > 0.0 { (dot / length2).clamp(0.0, 1.0) } else { 0.0 };
            let distance2: f64 = (0..3).map(|k| (p[k] + t * d[k] - x[k]).powi(2)).sum();
            if distance2 < best.0 {
                best = (distance2, a.s[i - 1] + t * (a.s[i] - a.s[i - 1]));
            }
        }
        best.1
    };
    if a.s.len() < 2 { b.s.clone() } else { b.x.iter().map(closest).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_side_is_drawn_where_it_touches() {
        let table = |s: [f64; 3], x: [f64; 3]| SideTable {
            s: s.to_vec(),
            x: x.map(|x| [x, 0.0, 0.0]).to_vec(),
            ..SideTable::default()
        };
        let a = table([0.0, 1.0, 2.0], [0.0, 1.0, 2.0]);
        let b = table([0.0, 1.0, 2.0], [2.0, 0.5, -1.0]);
        assert_eq!(along(&a, &b), [2.0, 0.5, 0.0]);
    }
}
