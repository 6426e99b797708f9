//! `convergence.svg`: what is left of the gap at the nodes in contact and of the force imbalance after each
//! alternation, how many nodes are active, where the active set was updated and where a load step begins.
use super::legend::{Legend, Symbol};
use super::scale::power_of_ten;
use super::{CURVES, FONT, GRID, INK, failed, heading, title};
use crate::error::Result;
use crate::output::Results;
use crate::record::HistoryRow;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

const WIDTH: i32 = 960;
const HEIGHT: i32 = 560;
const LEFT: i32 = 24;
const TITLE: i32 = 50;
/// Smaller numbers are drawn here: they are zero to round-off.
const FLOOR: f64 = 1e-17;
/// With more alternations a marker for each would hide the curve.
const MARKERS: usize = 60;

/// A number of each alternation.
type Column = fn(&HistoryRow) -> f64;

/// The picture as SVG; `None` if there was no alternation.
pub(super) fn draw(results: &Results) -> Result<Option<String>> {
    let history = &results.history;
    if history.is_empty() {
        return Ok(None);
    }
    let tolerance = shown(results.run.tolerance).unwrap_or(FLOOR);
    let values =
        history.iter().flat_map(|row| [row.displacement_jump, row.force_imbalance]).filter_map(shown);
    let (low, high) = values.fold((tolerance, tolerance), |(low, high), v| (low.min(v), high.max(v)));
    let (low, high) = (10f64.powf((low / 1.5).log10().floor()), 10f64.powf((1.5 * high).log10().ceil()));
    let (from, to) = (0.5, history.len() as f64 + 0.5);
    let most = history.iter().map(|row| row.active).max().unwrap_or(0).max(1) as f64 * 1.15;
    let marks = Marks::new(history);
    // Room for the numbers of the steps.
    let high = if marks.are_labelled() { 10.0 * high } else { high };
    let stroke = |k: usize| CURVES[k].stroke_width(2);
    let (thin, dashes, dots) =
        (CURVES[2].mix(0.6).stroke_width(2), INK.stroke_width(1), MARK.stroke_width(1));

    let mut entries = vec![
        (Symbol::Line(stroke(0)), "displacement jump (gap in contact)".to_owned()),
        (Symbol::Line(stroke(1)), "force imbalance".to_owned()),
        (Symbol::Line(thin), "active nodes (right)".to_owned()),
        (Symbol::Dashes(dashes), "tolerance".to_owned()),
    ];
    if !marks.updates.is_empty() {
        entries.push((Symbol::Dashes(dots), "active set updated".to_owned()));
    }
    let legend = Legend::new(entries, WIDTH - 2 * LEFT);

    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH as u32, HEIGHT as u32)).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let (head, body) = area.split_vertically(TITLE + legend.height());
        let style = TextStyle::from((FONT, 20).into_font().style(FontStyle::Bold)).color(&INK);
        let width = head.dim_in_pixel().0 as i32 - 2 * LEFT;
        let heading = heading(&title(results), &format!(": {}", verdict(results)), 20, width);
        head.draw(&Text::new(heading, (LEFT, 18), style)).map_err(failed)?;
        legend.draw(&head, (LEFT, TITLE))?;
        let mut chart = ChartBuilder::on(&body)
            .margin(14)
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

        for &x in &marks.updates {
            let line = DashedLineSeries::new([(x, low), (x, high)], 3, 4, dots);
            chart.draw_series(line).map_err(failed)?;
        }
        let wide = INK.mix(0.55).stroke_width(1);
        for &(x, step) in &marks.steps {
            if x > from {
                chart.draw_series(LineSeries::new([(x, low), (x, high)], wide)).map_err(failed)?;
            }
            let style = TextStyle::from((FONT, 13).into_font()).color(&INK);
            let style = style.pos(Pos::new(HPos::Left, VPos::Top));
            // Just inside the upper left corner of the step's part of the chart.
            let at = (x + 0.008 * (to - from), high * (low / high).powf(0.012));
            if marks.are_labelled() {
                let label = Text::new(format!("step {step}"), at, style);
                chart.draw_series(std::iter::once(label)).map_err(failed)?;
            }
        }
        for part in parts(history, |row| Some(row.active as f64)) {
            chart.draw_secondary_series(LineSeries::new(part, thin)).map_err(failed)?;
        }
        let line = DashedLineSeries::new([(from, tolerance), (to, tolerance)], 7, 5, dashes);
        chart.draw_series(line).map_err(failed)?;
        let jump = (0, (|row| row.displacement_jump) as Column);
        let imbalance = (1, (|row| row.force_imbalance) as Column);
        for (colour, column) in [jump, imbalance] {
            for part in parts(history, |row| shown(column(row))) {
                if history.len() <= MARKERS || part.len() == 1 {
                    let dots = part.iter().map(|p| Circle::new(*p, 3, CURVES[colour].filled()));
                    chart.draw_series(dots).map_err(failed)?;
                }
                chart.draw_series(LineSeries::new(part, stroke(colour))).map_err(failed)?;
            }
        }
        area.present().map_err(failed)?;
    }
    Ok(Some(svg))
}

/// Where the active set was updated.
const MARK: RGBColor = RGBColor(150, 150, 150);

fn shown(value: f64) -> Option<f64> {
    value.is_finite().then_some(value.max(FLOOR))
}

/// How it ended: in words, with the step if there are several.
fn verdict(results: &Results) -> String {
    let failed = results.run.steps.iter().flatten().enumerate().find(|(_, step)| !step.reason.converged());
    let words = |name: &str| name.replace('_', " ");
    match failed {
        Some((k, step)) => format!("step {}: {}", k + 1, words(step.reason.name())),
        None => words(results.run.reason.name()),
    }
}

/// Between which alternations something new begins; alternations are counted through all steps, from 1.
struct Marks {
    updates: Vec<f64>,
    /// With the number of the step; the first one too. None if there is one step only.
    steps: Vec<(f64, u64)>,
}

impl Marks {
    /// True if the steps are few enough for a label each.
    fn are_labelled(&self) -> bool {
        (2..=12).contains(&self.steps.len())
    }

    fn new(history: &[HistoryRow]) -> Self {
        let (mut updates, mut steps) = (Vec::new(), Vec::new());
        for (i, row) in history.iter().enumerate() {
            let before = i.checked_sub(1).map(|i| &history[i]);
            let x = i as f64 + 0.5;
            if before.is_none_or(|before| before.step != row.step) {
                steps.push((x, row.step));
            } else if before.is_some_and(|before| before.update != row.update) {
                updates.push(x);
            }
        }
        if steps.len() == 1 {
            steps.clear();
        }
        Marks { updates, steps }
    }
}

/// The curve of a column, broken where a step begins and where there is no number.
fn parts(history: &[HistoryRow], value: impl Fn(&HistoryRow) -> Option<f64>) -> Vec<Vec<(f64, f64)>> {
    let mut parts = vec![Vec::new()];
    let mut step = None;
    for (x, row) in (1..).map(f64::from).zip(history) {
        let point = value(row);
        if point.is_none() || step != Some(row.step) {
            parts.push(Vec::new());
        }
        step = Some(row.step);
        if let (Some(y), Some(part)) = (point, parts.last_mut()) {
            part.push((x, y));
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(step: u64, update: u64, displacement_jump: f64) -> HistoryRow {
        HistoryRow { step, update, displacement_jump, ..HistoryRow::default() }
    }

    #[test]
    fn steps_and_updates_are_marked_where_they_begin() {
        let history = [
            row(1, 1, 1.0),
            row(1, 1, 0.1),
            row(1, 2, 0.2),
            row(2, 1, 0.5),
            row(2, 2, f64::NAN),
            row(2, 2, 0.1),
        ];
        let marks = Marks::new(&history);
        assert_eq!((marks.updates, marks.steps), (vec![2.5, 4.5], vec![(0.5, 1), (3.5, 2)]));
        let parts = parts(&history, |row| shown(row.displacement_jump));
        assert_eq!(parts, [vec![(1.0, 1.0), (2.0, 0.1), (3.0, 0.2)], vec![(4.0, 0.5)], vec![(6.0, 0.1)]]);
        assert!(Marks::new(&history[..3]).steps.is_empty());
    }
}
