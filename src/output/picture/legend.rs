//! What the curves are, in rows above the chart, where no curve is hidden by them.
use super::{FONT, INK, failed};
use crate::error::Result;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

const SIZE: i32 = 15;
const ROW: i32 = 22;
const SYMBOL: i32 = 26;
const BETWEEN: i32 = 24;

/// How a curve looks.
#[derive(Debug, Clone, Copy)]
pub(super) enum Symbol {
    /// A line.
    Line(ShapeStyle),
    /// A broken line.
    Dashes(ShapeStyle),
    /// A bar.
    Bar(RGBColor),
    /// A dot.
    Dot(RGBColor),
    /// A circle around a dot.
    Ring(RGBColor),
}

/// Symbols and names, laid out in rows.
pub(super) struct Legend {
    entries: Vec<(Symbol, String)>,
    /// Left end and row of each entry.
    places: Vec<(i32, i32)>,
}

impl Legend {
    /// In rows of so many pixels.
    pub fn new(entries: Vec<(Symbol, String)>, width: i32) -> Self {
        let mut places = Vec::new();
        let (mut x, mut row) = (0, 0);
        for (_, name) in &entries {
            let length = SYMBOL + text_width(name) + BETWEEN;
            if x > 0 && x + length - BETWEEN > width {
                (x, row) = (0, row + 1);
            }
            places.push((x, row));
            x += length;
        }
        Legend { entries, places }
    }

    /// Height of all rows, pixels.
    pub fn height(&self) -> i32 {
        self.places.last().map_or(0, |(_, row)| (row + 1) * ROW)
    }

    /// Draws it with its upper left corner at a place.
    pub fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        (left, top): (i32, i32),
    ) -> Result<()> {
        let style = TextStyle::from((FONT, SIZE).into_font()).color(&INK);
        let style = style.pos(Pos::new(HPos::Left, VPos::Center));
        for ((symbol, name), (x, row)) in self.entries.iter().zip(&self.places) {
            let (x, y) = (left + x, top + row * ROW + ROW / 2);
            let line = |from: i32, to: i32, stroke: ShapeStyle| {
                area.draw(&PathElement::new([(x + from, y), (x + to, y)], stroke)).map_err(failed)
            };
            match *symbol {
                Symbol::Line(stroke) => line(0, SYMBOL - 6, stroke)?,
                Symbol::Dashes(stroke) => {
                    [(0, 5), (8, 13), (16, 20)].into_iter().try_for_each(|(a, b)| line(a, b, stroke))?;
                }
                Symbol::Bar(colour) => {
                    let corners = [(x, y - 4), (x + SYMBOL - 6, y + 4)];
                    area.draw(&Rectangle::new(corners, colour.filled())).map_err(failed)?;
                }
                Symbol::Dot(colour) => {
                    area.draw(&Circle::new((x + (SYMBOL - 6) / 2, y), 4, colour.filled())).map_err(failed)?;
                }
                Symbol::Ring(colour) => {
                    let middle = (x + (SYMBOL - 6) / 2, y);
                    area.draw(&Circle::new(middle, 7, colour.stroke_width(1))).map_err(failed)?;
                }
            }
            area.draw(&Text::new(name.as_str(), (x + SYMBOL, y), style.clone())).map_err(failed)?;
        }
        Ok(())
    }
}

fn text_width(text: &str) -> i32 {
    let size = (FONT, SIZE).into_font().box_size(text);
    size.map_or(9 * text.chars().count() as i32, |(width, _)| width as i32)
}
