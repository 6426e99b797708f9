//! `pressure.svg`: contact pressure along the surface, a panel for each pair: both sides, or one side after
//! several load steps.
use super::curve::{Curve, Point, curves, range};
use super::legend::{Legend, Symbol};
use super::scale::{Ticks, Unit};
use super::{FONT, GRID, INK, failed, heading, title};
use crate::error::Result;
use crate::output::Results;
use crate::record::PairTables;
use crate::vector::{larger, smaller};
use plotters::coord::Shift;
use plotters::prelude::*;

const WIDTH: i32 = 960;
const CHART: i32 = 370;
const TITLE: i32 = 52;
const CAPTION: i32 = 34;
const LEFT: i32 = 24;
/// More panels are more than anyone looks at.
const MOST: usize = 12;

/// A pair's part of the picture.
struct Panel<'a> {
    pair: &'a PairTables,
    curves: Vec<Curve<'a>>,
    legend: Legend,
}

impl Panel<'_> {
    fn height(&self) -> i32 {
        CAPTION + self.legend.height() + CHART
    }
}

/// The picture as SVG; `None` if there are no contact tables.
pub(super) fn draw(results: &Results) -> Result<Option<String>> {
    let panel = |p: usize| {
        let (pair, curves) = (&results.pairs[p], curves(results, p));
        let entry = |curve: &Curve| (Symbol::Line(curve.stroke), curve.name.clone());
        let mut entries: Vec<_> = curves.iter().map(entry).collect();
        let dot = if pair.tangential { "node that sticks" } else { "node in contact" };
        entries.push((Symbol::Dot(INK), dot.to_owned()));
        (!curves.is_empty()).then(|| Panel { pair, curves, legend: Legend::new(entries, WIDTH - 2 * LEFT) })
    };
    let panels: Vec<_> = (0..results.pairs.len()).filter_map(panel).take(MOST).collect();
    if panels.is_empty() {
        return Ok(None);
    }
    let height = TITLE + panels.iter().map(Panel::height).sum::<i32>();
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH as u32, height as u32)).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let (head, mut rest) = area.split_vertically(TITLE);
        let style = TextStyle::from((FONT, 22).into_font().style(FontStyle::Bold)).color(&INK);
        let title = heading(&title(results), "", 22, WIDTH - 2 * LEFT);
        head.draw(&Text::new(title, (LEFT, 18), style)).map_err(failed)?;
        for panel in &panels {
            let (own, below) = rest.split_vertically(panel.height());
            draw_panel(&own, panel, results)?;
            rest = below;
        }
        area.present().map_err(failed)?;
    }
    Ok(Some(svg))
}

fn draw_panel(area: &DrawingArea<SVGBackend, Shift>, panel: &Panel, results: &Results) -> Result<()> {
    let units = results.run.units;
    let Panel { pair, curves, legend } = panel;
    let pressures = || curves.iter().flat_map(|curve| &curve.points).map(|point| point.pressure);
    let (largest, smallest) = (pressures().fold(0.0, larger), pressures().fold(0.0, smaller));
    let (from, to) = range(curves);
    let (p, s) = (Unit::stress(units, largest.max(-smallest)), Unit::length(units, from.abs().max(to.abs())));
    let top = if largest > 0.0 { 1.1 * largest } else { 1.0 } / p.factor;
    let bottom = if smallest < 0.0 { 1.1 * smallest / p.factor } else { 0.0 };

    let (head, body) = area.split_vertically(CAPTION + legend.height());
    let style = TextStyle::from((FONT, 17).into_font()).color(&INK);
    let what = if pair.tangential { "Contact pressure and traction" } else { "Contact pressure" };
    let mut caption = format!("{what}, {}", pair.name);
    if let (false, Some(curve)) = (results.before.is_empty(), curves.first()) {
        caption += &format!(", on {}", pair.surfaces[curve.side]);
    }
    head.draw(&Text::new(caption, (LEFT, 6), style)).map_err(failed)?;
    legend.draw(&head, (LEFT, CAPTION))?;
    let mut chart = ChartBuilder::on(&body)
        .margin(10)
        .margin_right(30)
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
        .y_desc(p.label(if pair.tangential { "pressure, traction" } else { "pressure" }))
        .label_style((FONT, 15).into_font().color(&INK))
        .axis_desc_style((FONT, 16).into_font().color(&INK))
        .draw()
        .map_err(failed)?;
    for curve in curves {
        let shown = |(x, pressure): (f64, f64)| (x / s.factor, pressure / p.factor);
        for line in curve.within(from, to) {
            let line = line.into_iter().map(shown);
            chart.draw_series(LineSeries::new(line, curve.stroke)).map_err(failed)?;
        }
        let dotted = |point: &&Point| point.touches && curve.dot > 0 && (from..=to).contains(&point.s);
        let touching = curve.points.iter().filter(dotted);
        let dot =
            |point: &Point| Circle::new(shown((point.s, point.pressure)), curve.dot, curve.colour.filled());
        chart.draw_series(touching.map(dot)).map_err(failed)?;
    }
    Ok(())
}
