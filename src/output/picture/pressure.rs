//! `pressure.svg`: contact pressure along the surface, a panel for each pair: both sides, or one side after
//! several load steps. Of a pair with a tangential law also what sticks and slips, and the tractions.
use super::chart::{Line, chart};
use super::curve::{Curve, curves, range};
use super::legend::{Legend, Symbol};
use super::traction::{self, Traction, tractions};
use super::{FONT, INK, failed, heading, title};
use crate::error::Result;
use crate::output::Results;
use crate::record::PairTables;
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
    /// None without a tangential law.
    tractions: Vec<Traction<'a>>,
    legend: Legend,
}

impl<'a> Panel<'a> {
    fn new(pair: &'a PairTables, curves: Vec<Curve<'a>>) -> Self {
        let tractions = tractions(pair.law, pair.varies, &curves);
        let entry = |curve: &Curve| (Symbol::Line(curve.stroke), curve.name.clone());
        let mut entries: Vec<_> = curves.iter().map(entry).collect();
        match tractions.is_empty() {
            true => entries.push((Symbol::Dot(INK), "node in contact".to_owned())),
            false => entries.extend(traction::symbols(pair.law, pair.varies)),
        }
        Panel { pair, curves, tractions, legend: Legend::new(entries, WIDTH - 2 * LEFT) }
    }

    fn height(&self) -> i32 {
        CAPTION + self.legend.height() + CHART + traction::height(&self.tractions)
    }
}

/// The picture as SVG; `None` if there are no contact tables.
pub(super) fn draw(results: &Results) -> Result<Option<String>> {
    let panel = |p: usize| {
        let curves = curves(results, p);
        (!curves.is_empty()).then(|| Panel::new(&results.pairs[p], curves))
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
    let Panel { pair, curves, tractions, legend } = panel;
    let (from, to) = range(curves);
    let (head, body) = area.split_vertically(CAPTION + legend.height());
    let style = TextStyle::from((FONT, 17).into_font()).color(&INK);
    let mut caption = match pair.law.is_frictional() {
        true => format!(
            "Contact pressure and tangential traction, {}, {}",
            pair.name,
            pair.law.describe(pair.varies)
        ),
        false => format!("Contact pressure, {}", pair.name),
    };
    if let (false, Some(curve)) = (results.before.is_empty(), curves.first()) {
        caption += &format!(", on {}", pair.surfaces[curve.side]);
    }
    head.draw(&Text::new(caption, (LEFT, 6), style)).map_err(failed)?;
    legend.draw(&head, (LEFT, CAPTION))?;
    let (own, below) = body.split_vertically(CHART);
    let lines: Vec<Line> = curves.iter().map(Line::new).collect();
    chart(&own, &lines, "pressure", [from, to], results.run.units)?;
    if tractions.is_empty() {
        return Ok(());
    }
    let (states, own) = below.split_vertically(traction::strip_height(tractions));
    traction::strip(&states, tractions, [from, to])?;
    let lines: Vec<Line> = tractions.iter().flat_map(Traction::lines).collect();
    chart(&own, &lines, "tangential traction", [from, to], results.run.units)
}
