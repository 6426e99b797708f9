//! The work-precision diagram of a study: error over seconds, both logarithmic, a curve for each choice.
use super::legend::{Legend, Symbol};
use super::scale::power_of_ten;
use super::sharp::Sharp;
use super::{CURVES, FONT, GRID, INK, failed, font, heading};
use crate::error::Result;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::path::Path;

const SIZE: (u32, u32) = (960, 640);
/// Pixels of the bitmap for one of the drawing.
const SHARP: u32 = 2;
const LEFT: i32 = 24;
const TITLE: i32 = 50;
/// Pixels of its type.
const TITLE_SIZE: i32 = 20;
/// Room for the labels of the axes: left, right, top, bottom.
const MARGINS: [i32; 4] = [96, 30, 16, 64];
/// Smaller errors are drawn here: they are zero to round-off.
const FLOOR: f64 = 1e-15;
/// An axis that goes to smaller errors is labelled with powers of ten.
const SMALLEST_PERCENT: f64 = 5e-6;
/// Room beside the outermost points, as a factor.
const MARGIN: f64 = 1.5;

/// What to draw.
pub(crate) struct Precision {
    /// Of the case; a long one is shortened.
    pub title: String,
    /// What follows the title.
    pub subject: String,
    /// Seconds that every run takes, whatever its mesh.
    pub fixed: Option<f64>,
    /// Names of the axes.
    pub time: String,
    pub error: String,
    pub curves: Vec<PrecisionCurve>,
    /// Errors below this say nothing, and in a few words why; 0: all do.
    pub known_to: f64,
    pub known_text: &'static str,
}

/// The levels of one choice.
pub(crate) struct PrecisionCurve {
    pub name: String,
    pub points: Vec<PrecisionPoint>,
}

/// A run.
pub(crate) struct PrecisionPoint {
    pub level: usize,
    /// Smallest, largest.
    pub seconds: [f64; 2],
    pub error: f64,
    /// On the Pareto front: nothing is as accurate for less time.
    pub best: bool,
}

impl Precision {
    /// Draws it as SVG.
    pub fn svg(&self) -> Result<String> {
        font()?;
        let mut svg = String::new();
        self.draw(&SVGBackend::with_string(&mut svg, SIZE).into_drawing_area())?;
        Ok(svg)
    }

    /// Draws it as PNG into a file.
    pub fn png(&self, path: &Path) -> Result<()> {
        font()?;
        let bitmap = BitMapBackend::new(path, (SIZE.0 * SHARP, SIZE.1 * SHARP));
        self.draw(&Sharp::new(bitmap, SHARP).into_drawing_area())
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()> {
        area.fill(&WHITE).map_err(failed)?;
        let legend = self.legend();
        let (head, body) = area.split_vertically(TITLE + legend.height());
        let style = TextStyle::from((FONT, TITLE_SIZE).into_font().style(FontStyle::Bold)).color(&INK);
        let title = heading(&self.title, &self.subject, TITLE_SIZE, SIZE.0 as i32 - 2 * LEFT);
        head.draw(&Text::new(title, (LEFT, 18), style)).map_err(failed)?;
        legend.draw(&head, (LEFT, TITLE))?;
        let (width, height) = body.dim_in_pixel();
        let times = self.points().flat_map(|p| p.seconds).chain(self.fixed);
        let x = Axis::new(times, [MARGINS[0], width as i32 - MARGINS[1]]);
        let errors =
            self.points().map(|p| p.error.max(FLOOR)).chain((self.known_to > 0.0).then_some(self.known_to));
        let y = Axis::new(errors, [height as i32 - MARGINS[3], MARGINS[2]]);
        self.draw_axes(&body, &x, &y)?;
        if self.known_to > 0.0 {
            let at = y.at(self.known_to);
            let dashes = (x.pixels[0]..x.pixels[1]).step_by(12);
            for from in dashes {
                line(&body, [(from, at), ((from + 7).min(x.pixels[1]), at)], INK.stroke_width(1))?;
            }
        }
        if let Some(fixed) = self.fixed {
            let at = x.at(fixed);
            for from in (y.pixels[1]..y.pixels[0]).step_by(8) {
                line(&body, [(at, from), (at, (from + 3).min(y.pixels[0]))], INK.stroke_width(1))?;
            }
        }
        for (k, curve) in self.curves.iter().enumerate() {
            draw_curve(&body, curve, k, &x, &y)?;
        }
        area.present().map_err(failed)
    }

    fn points(&self) -> impl Iterator<Item = &PrecisionPoint> {
        self.curves.iter().flat_map(|curve| &curve.points)
    }

    fn legend(&self) -> Legend {
        let mut entries = Vec::new();
        if self.curves.len() > 1 {
            let named = self.curves.iter().enumerate();
            entries.extend(named.map(|(k, curve)| (Symbol::Line(stroke(k)), curve.name.clone())));
        }
        entries.push((Symbol::Ring(INK), "no run is as accurate for less time".into()));
        if self.known_to > 0.0 {
            entries.push((Symbol::Dashes(INK.stroke_width(1)), self.known_text.into()));
        }
        if let Some(fixed) = self.fixed {
            let text = format!("dotted: MPI and the program start, {fixed:.2} s");
            entries.push((Symbol::Line(INK.stroke_width(1)), text));
        }
        Legend::new(entries, SIZE.0 as i32 - 2 * LEFT)
    }

    fn draw_axes<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>, x: &Axis, y: &Axis) -> Result<()> {
        let style = |size: i32, h: HPos, v: VPos| {
            TextStyle::from((FONT, size).into_font()).color(&INK).pos(Pos::new(h, v))
        };
        let [left, right] = x.pixels;
        let [bottom, top] = y.pixels;
        for tick in x.ticks() {
            let at = x.at(tick);
            line(area, [(at, bottom), (at, top)], GRID.stroke_width(1))?;
            let text = Text::new(plain(tick), (at, bottom + 8), style(15, HPos::Center, VPos::Top));
            area.draw(&text).map_err(failed)?;
        }
        for tick in y.ticks() {
            let at = y.at(tick);
            line(area, [(left, at), (right, at)], GRID.stroke_width(1))?;
            let label = if y.low > SMALLEST_PERCENT { percent(tick) } else { power(tick) };
            let text = Text::new(label, (left - 8, at), style(15, HPos::Right, VPos::Center));
            area.draw(&text).map_err(failed)?;
        }
        line(area, [(left, bottom), (right, bottom)], INK.stroke_width(1))?;
        line(area, [(left, bottom), (left, top)], INK.stroke_width(1))?;
        let at = ((left + right) / 2, bottom + 36);
        area.draw(&Text::new(self.time.as_str(), at, style(16, HPos::Center, VPos::Top))).map_err(failed)?;
        let turned = TextStyle::from((FONT, 16).into_font().transform(FontTransform::Rotate270)).color(&INK);
        let turned = turned.pos(Pos::new(HPos::Center, VPos::Top));
        area.draw(&Text::new(self.error.as_str(), (8, (bottom + top) / 2), turned)).map_err(failed)
    }
}

fn stroke(k: usize) -> ShapeStyle {
    CURVES[k % CURVES.len()].stroke_width(2)
}

fn line<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    ends: [(i32, i32); 2],
    stroke: ShapeStyle,
) -> Result<()> {
    area.draw(&PathElement::new(ends, stroke)).map_err(failed)
}

fn draw_curve<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    curve: &PrecisionCurve,
    k: usize,
    x: &Axis,
    y: &Axis,
) -> Result<()> {
    let colour = CURVES[k % CURVES.len()];
    let place = |p: &PrecisionPoint| (x.at(p.seconds[0]), y.at(p.error.max(FLOOR)));
    let path: Vec<(i32, i32)> = curve.points.iter().map(place).collect();
    area.draw(&PathElement::new(path, stroke(k))).map_err(failed)?;
    let small = TextStyle::from((FONT, 13).into_font()).color(&INK).pos(Pos::new(HPos::Left, VPos::Bottom));
    for p in &curve.points {
        let (px, py) = place(p);
        line(area, [(x.at(p.seconds[0]), py), (x.at(p.seconds[1]), py)], colour.stroke_width(1))?;
        // From the seventh curve on the colours come again, with squares.
        if k < CURVES.len() {
            area.draw(&Circle::new((px, py), 4, colour.filled())).map_err(failed)?;
        } else {
            area.draw(&Rectangle::new([(px - 4, py - 4), (px + 4, py + 4)], colour.filled()))
                .map_err(failed)?;
        }
        if p.best {
            area.draw(&Circle::new((px, py), 8, INK.stroke_width(1))).map_err(failed)?;
        }
        let aside = if p.best { 10 } else { 7 };
        area.draw(&Text::new(p.level.to_string(), (px + aside, py - 5), small.clone())).map_err(failed)?;
    }
    Ok(())
}

/// A logarithmic axis.
struct Axis {
    low: f64,
    high: f64,
    /// Where its ends are.
    pixels: [i32; 2],
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, pixels: [i32; 2]) -> Axis {
        let finite = values.filter(|v| v.is_finite() && *v > 0.0);
        let (low, high) = finite.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (1.0, 1.0) };
        Axis { low: low / MARGIN, high: high * MARGIN, pixels }
    }

    fn at(&self, value: f64) -> i32 {
        let t = (value / self.low).ln() / (self.high / self.low).ln();
        let [from, to] = self.pixels.map(f64::from);
        (from + t.clamp(0.0, 1.0) * (to - from)).round() as i32
    }

    /// Powers of ten, with twice and five times them where there are few.
    fn ticks(&self) -> Vec<f64> {
        let decades = (self.high / self.low).log10();
        let digits: &[f64] = if decades > 3.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let every = (decades / 12.0).ceil().max(1.0) as i32;
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let powers = (first..=last).filter(|n| n % every == 0);
        let all = powers.flat_map(|n| digits.iter().map(move |d| d * 10f64.powi(n)));
        all.filter(|t| (self.low..=self.high).contains(t)).collect()
    }
}

/// A number of seconds.
fn plain(value: f64) -> String {
    let decimals = (-(value.log10() + 1e-9).floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// A relative error in percent.
fn percent(value: f64) -> String {
    format!("{} %", plain(100.0 * value))
}

/// A relative error by its power of ten.
fn power(value: f64) -> String {
    let digit = (value / 10f64.powf((value.log10() + 1e-9).floor())).round();
    let power = power_of_ten(value / digit);
    if digit == 1.0 { power } else { format!("{digit}·{power}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::new([0.3, 4.0].into_iter(), [0, 100]);
        assert_eq!(axis.ticks(), [0.2, 0.5, 1.0, 2.0, 5.0]);
        assert_eq!((axis.at(0.2), axis.at(6.0)), (0, 100));
        assert_eq!(Axis::new([1e-8, 1.0].into_iter(), [0, 100]).ticks().len(), 9);
        assert_eq!([plain(0.5), plain(20.0)], ["0.5", "20"]);
        assert_eq!([percent(0.1), percent(5e-4)], ["10 %", "0.05 %"]);
        assert_eq!([power(1e-7), power(2e-6)], ["10⁻⁷", "2·10⁻⁶"]);
    }
}
