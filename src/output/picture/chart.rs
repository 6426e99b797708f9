//! A chart of stresses over the distance along a surface.
use super::curve::{Curve, Point};
use super::scale::{Ticks, Unit};
use super::{FONT, GRID, INK, failed};
use crate::case::Units;
use crate::error::Result;
use crate::vector::{larger, smaller};
use plotters::coord::Shift;
use plotters::prelude::*;

/// Pixels beside a chart: up to its left axis, and on the right.
pub(super) const BESIDE: [i32; 2] = [MARGIN + LABELS, 30];

const MARGIN: i32 = 10;
/// Numbers at the left axis.
const LABELS: i32 = 84;

/// A curve as a line of a chart.
pub(super) struct Line<'a> {
    curve: &'a Curve<'a>,
    /// Factor on the values.
    sign: f64,
    broken: bool,
}

impl<'a> Line<'a> {
    /// A whole line.
    pub fn new(curve: &'a Curve<'a>) -> Self {
        Line { curve, sign: 1.0, broken: false }
    }

    /// A broken line, of the values times `sign`.
    pub fn broken(curve: &'a Curve<'a>, sign: f64) -> Self {
        Line { curve, sign, broken: true }
    }
}

/// A chart of lines over the distance along the surface.
pub(super) fn chart(
    area: &DrawingArea<SVGBackend, Shift>,
    lines: &[Line],
    what: &str,
    [from, to]: [f64; 2],
    units: Units,
) -> Result<()> {
    let values =
        || lines.iter().flat_map(|line| line.curve.points.iter().map(|point| line.sign * point.value));
    let (largest, smallest) = (values().fold(0.0, larger), values().fold(0.0, smaller));
    let (p, s) = (Unit::stress(units, largest.max(-smallest)), Unit::length(units, from.abs().max(to.abs())));
    let top = if largest > 0.0 { 1.1 * largest } else { 1.0 } / p.factor;
    let bottom = if smallest < 0.0 { 1.1 * smallest / p.factor } else { 0.0 };
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN)
        .margin_right(BESIDE[1])
        .x_label_area_size(52)
        .y_label_area_size(LABELS)
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
        .y_desc(p.label(what))
        .label_style((FONT, 15).into_font().color(&INK))
        .axis_desc_style((FONT, 16).into_font().color(&INK))
        .draw()
        .map_err(failed)?;
    for Line { curve, sign, broken } in lines {
        let shown = |(x, value): (f64, f64)| (x / s.factor, sign * value / p.factor);
        for line in curve.within(from, to) {
            let line = line.into_iter().map(shown);
            match broken {
                true => chart.draw_series(DashedLineSeries::new(line, 6, 4, curve.stroke)).map(drop),
                false => chart.draw_series(LineSeries::new(line, curve.stroke)).map(drop),
            }
            .map_err(failed)?;
        }
        let dotted = |point: &&Point| point.touches && curve.dot > 0 && (from..=to).contains(&point.s);
        let touching = curve.points.iter().filter(dotted);
        let dot =
            |point: &Point| Circle::new(shown((point.s, point.value)), curve.dot, curve.colour.filled());
        chart.draw_series(touching.map(dot)).map_err(failed)?;
    }
    Ok(())
}
