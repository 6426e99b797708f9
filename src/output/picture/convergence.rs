//! `convergence.svg`: displacement jump and force imbalance of each alternation, and how many nodes are
//! active.
use super::scale::power_of_ten;
use super::{CURVES, FONT, GRID, INK, failed, title};
use crate::error::Result;
use crate::output::{HistoryRow, Results};
use plotters::prelude::*;

/// Smaller numbers are drawn here: they are zero to round-off.
const FLOOR: f64 = 1e-17;

/// A number of each alternation.
type Column = fn(&HistoryRow) -> f64;

/// The picture as SVG; `None` if there was no alternation.
pub(super) fn draw(results: &Results) -> Result<Option<String>> {
    let history = &results.history;
    let (Some(first), Some(last)) = (history.first(), history.last()) else { return Ok(None) };
    let shown = |value: f64| value.is_finite().then_some(value.max(FLOOR));
    let values =
        history.iter().flat_map(|row| [row.displacement_jump, row.force_imbalance]).filter_map(shown);
    let tolerance = shown(results.run.tolerance).unwrap_or(FLOOR);
    let (low, high) = values.fold((tolerance, tolerance), |(low, high), v| (low.min(v), high.max(v)));
    let (low, high) = (10f64.powf((low / 1.5).log10().floor()), 10f64.powf((1.5 * high).log10().ceil()));
    let (from, to) = (first.alternation as f64 - 0.5, last.alternation as f64 + 0.5);
    let most = history.iter().map(|row| row.active).max().unwrap_or(0).max(1) as f64 * 1.15;

    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (960, 540)).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(18)
            .caption(
                format!("{}: {}", title(results), results.run.reason.name().replace('_', " ")),
                (FONT, 20).into_font().style(FontStyle::Bold).color(&INK),
            )
            .x_label_area_size(52)
            .y_label_area_size(76)
            .right_y_label_area_size(76)
            .build_cartesian_2d(from..to, (low..high).log_scale())
            .map_err(failed)?
            .set_secondary_coord(from..to, 0.0..most);
        let whole =
            |x: &f64| if (x - x.round()).abs() < 1e-6 { format!("{}", x.round()) } else { String::new() };
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .axis_style(INK)
            .x_labels(history.len().min(12))
            .y_labels(12)
            .x_label_formatter(&whole)
            .y_label_formatter(&|y| power_of_ten(*y))
            .x_desc("alternation")
            .y_desc("relative size")
            .label_style((FONT, 15).into_font().color(&INK))
            .axis_desc_style((FONT, 16).into_font().color(&INK))
            .draw()
            .map_err(failed)?;
        chart
            .configure_secondary_axes()
            .y_desc("active nodes")
            .y_labels(6)
            .y_label_formatter(&whole)
            .axis_style(INK)
            .label_style((FONT, 15).into_font().color(&INK))
            .axis_desc_style((FONT, 16).into_font().color(&INK))
            .draw()
            .map_err(failed)?;

        let active = history.iter().map(|row| (row.alternation as f64, row.active as f64));
        let thin = CURVES[2].mix(0.6).stroke_width(2);
        let series = chart.draw_secondary_series(LineSeries::new(active, thin)).map_err(failed)?;
        series
            .label("active nodes (right)")
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], thin));
        let dashes = INK.stroke_width(1);
        let series = DashedLineSeries::new([(from, tolerance), (to, tolerance)], 7, 5, dashes);
        let series = chart.draw_series(series).map_err(failed)?;
        series.label("tolerance").legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], dashes));
        let jump = (CURVES[0], "displacement jump", (|row| row.displacement_jump) as Column);
        let imbalance = (CURVES[1], "force imbalance", (|row| row.force_imbalance) as Column);
        for (colour, name, column) in [jump, imbalance] {
            let point = |row: &HistoryRow| Some((row.alternation as f64, shown(column(row))?));
            let points: Vec<_> = history.iter().filter_map(point).collect();
            let stroke = colour.stroke_width(2);
            let series = chart.draw_series(LineSeries::new(points.clone(), stroke)).map_err(failed)?;
            series.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], stroke));
            if points.len() <= 60 {
                let markers = points.into_iter().map(|p| Circle::new(p, 4, colour.filled()));
                chart.draw_series(markers).map_err(failed)?;
            }
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .label_font((FONT, 15).into_font().color(&INK))
            .draw()
            .map_err(failed)?;
        area.present().map_err(failed)?;
    }
    Ok(Some(svg))
}
