//! Pictures of a run, drawn by one process from the result file.
//!
//! `bodies.png`: the deformed bodies, coloured by a stress or the plastic strain; `pressure.svg`: contact pressure along
//! the surfaces, and the tractions of friction; `convergence.svg`: the alternation.
mod bodies;
mod chart;
mod colour;
mod convergence;
mod curve;
mod legend;
mod outline;
mod pixel;
mod precision;
mod pressure;
mod raster;
mod scale;
mod scene;
mod sharp;
mod traction;
mod view;

pub(crate) use precision::{Precision, PrecisionCurve, PrecisionPoint};

use super::Results;
use crate::case::OutputCase;
use crate::error::{Error, Result};
use plotters::style::{FontStyle, IntoFont, register_font};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// Family name of the font that comes with the program, so that no system font is needed.
const FONT: &str = "sans-serif";
/// Text and axes.
const INK: plotters::style::RGBColor = plotters::style::RGBColor(40, 40, 40);
/// Grid lines.
const GRID: plotters::style::RGBColor = plotters::style::RGBColor(226, 226, 226);
/// Colours of curves, distinct to all readers (Okabe and Ito).
const CURVES: [plotters::style::RGBColor; 6] = [
    plotters::style::RGBColor(0, 114, 178),
    plotters::style::RGBColor(213, 94, 0),
    plotters::style::RGBColor(0, 158, 115),
    plotters::style::RGBColor(204, 121, 167),
    plotters::style::RGBColor(86, 180, 233),
    plotters::style::RGBColor(230, 159, 0),
];

/// Makes the font known to the drawing library, once.
fn font() -> Result<()> {
    static FONT_READY: LazyLock<bool> = LazyLock::new(|| {
        let regular = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
        regular.and(register_font(FONT, FontStyle::Bold, dejavu::sans::bold())).is_ok()
    });
    match *FONT_READY {
        true => Ok(()),
        false => Err(Error::internal("the font of the pictures cannot be read")),
    }
}

/// Draws the pictures that the results have something for, into a directory. Returns the files written.
pub fn draw(results: &Results, style: &OutputCase, directory: &Path) -> Result<Vec<PathBuf>> {
    font()?;
    let pictures = [
        ("bodies.png", bodies::draw(results, style)?),
        ("pressure.svg", pressure::draw(results)?.map(String::into_bytes)),
        ("convergence.svg", convergence::draw(results)?.map(String::into_bytes)),
    ];
    let mut written = Vec::new();
    for (name, content) in pictures {
        let path = directory.join(name);
        match content {
            Some(content) => {
                super::file::write_complete(&path, &content)?;
                written.push(path);
            }
            // Of an older result: it would be taken for one of this.
            None => drop(std::fs::remove_file(path)),
        }
    }
    Ok(written)
}

/// Any error of the drawing library.
fn failed(e: impl std::fmt::Display) -> Error {
    Error::internal(format!("drawing: {e}"))
}

/// Title and what follows it, the title shortened so that both fit into so many pixels of bold type.
fn heading(title: &str, subject: &str, size: i32, width: i32) -> String {
    let font = (FONT, size).into_font().style(FontStyle::Bold);
    let fits = |text: &str| font.box_size(text).is_ok_and(|(length, _)| length as i32 <= width);
    let whole = format!("{title}{subject}");
    if fits(&whole) {
        return whole;
    }
    let ends: Vec<usize> = title.char_indices().map(|(i, _)| i).collect();
    let cut = |end: usize| format!("{}…{subject}", title[..end].trim_end());
    // The longest that fits; without any title if nothing does.
    let longest = ends.partition_point(|&end| fits(&cut(end)));
    cut(ends[longest.saturating_sub(1)..].first().copied().unwrap_or(0))
}

/// `case, variant C`.
fn title(results: &Results) -> String {
    let run = &results.run;
    match &run.variant {
        Some(variant) => format!("{}, variant {variant}", run.title),
        None => run.title.clone(),
    }
}

/// The same with the last load step, if there are several.
fn title_of_last_step(results: &Results) -> String {
    let steps = results.run.steps.as_deref().unwrap_or_default();
    match steps {
        [] | [_] => title(results),
        [.., last] => {
            let name = last.name.as_ref().map_or_else(String::new, |name| format!(" ({name})"));
            format!("{}, step {}{name}", title(results), steps.len())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_title_is_shortened_and_what_follows_it_is_not() {
        font().unwrap();
        let title = "A title that goes on and on ".repeat(8);
        let text = heading(&title, ": error over time", 20, 900);
        assert!(text.starts_with("A title that goes on") && text.ends_with("…: error over time"), "{text}");
        let width = |text: &str| (FONT, 20).into_font().style(FontStyle::Bold).box_size(text).unwrap().0;
        assert!(width(&text) <= 900 && width(&text) > 800, "{}", width(&text));
        assert_eq!(heading("Short", ": error", 20, 900), "Short: error");
    }
}
