//! `bodies.png`: the deformed bodies, coloured by a stress or the plastic strain; beside it the contact, if it is small.
use super::colour::ColourScale;
use super::scale::{Ticks, Unit, number};
use super::scene::Scene;
use super::view::{View, Window};
use super::{FONT, INK, failed, heading, title_of_last_step};
use crate::case::{OutputCase, Shown, StressComponent, Units};
use crate::error::Result;
use crate::output::Results;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;

const LEFT: usize = 120;
const TOP: usize = 118;
const BOTTOM: usize = 84;
/// Between the last panel and the edge: the colour bar and its labels.
const RIGHT: usize = 210;
/// From one panel to the next: the labels of its axis.
const BETWEEN: usize = 130;
/// A contact shorter than this part of the bodies gets a panel of its own.
const SMALL_CONTACT: f64 = 0.05;

/// One of the pictures side by side.
struct Panel {
    view: View,
    magnification: f64,
    left: usize,
}

/// The picture as PNG; `None` if the file has no cells.
pub(super) fn draw(results: &Results, style: &OutputCase) -> Result<Option<Vec<u8>>> {
    if results.piece.cells.is_empty() {
        return Ok(None);
    }
    let scene = Scene::new(results, style.shown)?;
    let magnification = style.magnification.unwrap_or_else(|| scene.magnification());
    let window = match style.window {
        Some([low, high]) => Window { low, high },
        None => scene.window(magnification),
    };
    let zoom = contact_window(results, &scene, &window);
    let panels = arrange(window, magnification, zoom);
    let colours = scene.colours(&panels[0].view.window, magnification);

    let height = TOP + panels[0].view.pixels[1] + BOTTOM;
    let width = panels.last().map_or(0, |p| p.left + p.view.pixels[0]) + RIGHT;
    let mut rgb = vec![255u8; 3 * width * height];
    for panel in &panels {
        let picture = scene.paint(&panel.view, panel.magnification, &colours).into_rgb();
        let row_length = 3 * panel.view.pixels[0];
        for (row, pixels) in picture.chunks(row_length).enumerate() {
            let start = 3 * ((TOP + row) * width + panel.left);
            rgb[start..start + row_length].copy_from_slice(pixels);
        }
    }
    label(&mut rgb, (width as u32, height as u32), results, style, &panels, &colours)?;
    encode(&rgb, width, height).map(Some)
}

/// Around the nodes in contact, if they are a small part of what is drawn.
fn contact_window(results: &Results, scene: &Scene, window: &Window) -> Option<Window> {
    let tables = results.pairs.iter().flat_map(|pair| pair.sides.iter().flatten());
    let active = tables.flat_map(|side| {
        side.x.iter().zip(&side.status).filter(|(_, status)| **status >= crate::record::IN_CONTACT)
    });
    let around =
        active.map(|(x, _)| [x[0], x[1]]).filter(|x| window.sees(std::iter::once(*x))).collect::<Vec<_>>();
    if around.len() < 3 {
        return None;
    }
    let contact = Window::around(around.into_iter());
    let length = contact.size()[0].max(contact.size()[1]);
    let bodies = scene.bounds(0.0).size();
    let small = length > 0.0
        && length < SMALL_CONTACT * bodies[0].max(bodies[1]).min(window.size()[0].max(window.size()[1]));
    let moved = scene.displacement_near(contact.centre());
    small.then(|| contact.resized([3.0 * length; 2]).shifted(moved))
}

/// One panel, or two of the same height.
fn arrange(window: Window, magnification: f64, zoom: Option<Window>) -> Vec<Panel> {
    let Some(zoom) = zoom else {
        return vec![Panel { view: View::fit(window, [1240, 900], [420, 300]), magnification, left: LEFT }];
    };
    let view = View::fit(window, [720, 820], [300, 400]);
    let (height, side) = (view.pixels[1], zoom.size()[0]);
    let pixels = [(height as f64 * 1.25) as usize, height].map(|n| n.min(820));
    let zoom = zoom.resized([side, side * pixels[1] as f64 / pixels[0] as f64]);
    let left = LEFT + view.pixels[0] + BETWEEN;
    // As it is: a magnified displacement would close more than the gap.
    let detail = Panel { view: View { window: zoom, pixels }, magnification: 1.0, left };
    vec![Panel { view, magnification, left: LEFT }, detail]
}

/// Title, axes and colour bar around the panels.
fn label(
    rgb: &mut [u8],
    size: (u32, u32),
    results: &Results,
    style: &OutputCase,
    panels: &[Panel],
    colours: &ColourScale,
) -> Result<()> {
    let area = BitMapBackend::with_buffer(rgb, size).into_drawing_area();
    let (name, symbol) = names(style.shown);
    let unit = match style.shown {
        Shown::Stress(_) => Unit::stress(results.run.units, colours.high.abs().max(colours.low.abs())),
        Shown::PlasticStrain => Unit::strain(colours.high),
    };
    text(
        &area,
        &heading(&title_of_last_step(results), "", 30, size.0 as i32 - 2 * LEFT as i32),
        (LEFT as i32, 14),
        (30, FontStyle::Bold),
        Pos::new(HPos::Left, VPos::Top),
    )?;
    let range = (colours.high - colours.low) / unit.factor;
    let value =
        |v: f64| format!("{} {}", number(v / unit.factor, super::scale::round_up(range) / 1000.0), unit.name);
    let [low, high] = [colours.low, colours.high].map(value);
    let line = format!("{name}, nodal, from {} to {}", low.trim(), high.trim());
    text(&area, &line, (LEFT as i32, 52), (19, FontStyle::Normal), Pos::new(HPos::Left, VPos::Top))?;
    for (k, panel) in panels.iter().enumerate() {
        let line = match (k, panel.magnification) {
            (0, m) => format!("displacements × {}, undeformed outline grey", number(m, m)),
            _ => "contact, displacements × 1".to_owned(),
        };
        text(
            &area,
            &line,
            (panel.left as i32, 82),
            (19, FontStyle::Normal),
            Pos::new(HPos::Left, VPos::Top),
        )?;
        axes(&area, panel, results.run.units)?;
    }
    let last = &panels[panels.len() - 1];
    let bar = (last.left + last.view.pixels[0] + 34, last.view.pixels[1]);
    colour_bar(&area, bar, colours, unit, symbol)?;
    area.present().map_err(failed)
}

/// What is shown, in the heading and above the bar.
fn names(shown: Shown) -> (&'static str, &'static str) {
    let component = match shown {
        Shown::Stress(component) => component,
        Shown::PlasticStrain => return ("equivalent plastic strain", "plastic strain"),
    };
    match component {
        StressComponent::Xx => ("stress σxx", "σxx"),
        StressComponent::Yy => ("stress σyy", "σyy"),
        StressComponent::Zz => ("stress σzz", "σzz"),
        StressComponent::Xy => ("shear stress τxy", "τxy"),
        StressComponent::VonMises => ("von Mises stress", "σ von Mises"),
    }
}

/// Frame, ticks and labels of a panel.
fn axes(area: &Area, panel: &Panel, units: Units) -> Result<()> {
    let View { window, pixels } = panel.view;
    let (x0, y0) = (panel.left as i32, TOP as i32);
    let (x1, y1) = (x0 + pixels[0] as i32, y0 + pixels[1] as i32);
    area.draw(&Rectangle::new([(x0 - 1, y0 - 1), (x1, y1)], INK.stroke_width(1))).map_err(failed)?;
    let largest = window.low.iter().chain(&window.high).fold(0.0f64, |m, x| m.max(x.abs()));
    // By the size of the window: a detail far from the origin is still measured in its own unit.
    let [width, height] = window.size();
    let unit =
        Unit::length(units, if largest < 10.0 * width.max(height) { largest } else { width.max(height) });
    let ticks = |k: usize, spacing: usize| {
        Ticks::new(
            window.low[k] / unit.factor,
            window.high[k] / unit.factor,
            (pixels[k] / spacing).clamp(2, 8),
        )
    };
    let x_ticks = ticks(0, 110);
    for &x in &x_ticks.at {
        let at = x0 + panel.view.pixel([x * unit.factor, 0.0])[0] as i32;
        line(area, (at, y1), (at, y1 + 7))?;
        text(
            area,
            &x_ticks.label(x),
            (at, y1 + 11),
            (18, FontStyle::Normal),
            Pos::new(HPos::Center, VPos::Top),
        )?;
    }
    let y_ticks = ticks(1, 80);
    for &y in &y_ticks.at {
        let at = y0 + panel.view.pixel([0.0, y * unit.factor])[1] as i32;
        line(area, (x0 - 7, at), (x0, at))?;
        text(
            area,
            &y_ticks.label(y),
            (x0 - 11, at),
            (18, FontStyle::Normal),
            Pos::new(HPos::Right, VPos::Center),
        )?;
    }
    let middle = ((x0 + x1) / 2, y1 + 42);
    text(area, &unit.label("x"), middle, (20, FontStyle::Normal), Pos::new(HPos::Center, VPos::Top))?;
    let style = TextStyle::from((FONT, 20).into_font()).color(&INK).transform(FontTransform::Rotate270);
    let style = style.pos(Pos::new(HPos::Center, VPos::Center));
    area.draw(&Text::new(unit.label("y"), (x0 - 86, (y0 + y1) / 2), style)).map_err(failed)
}

/// The bar shows only colours that occur: from the smallest value to the largest.
fn colour_bar(
    area: &Area,
    (left, height): (usize, usize),
    colours: &ColourScale,
    unit: Unit,
    name: &str,
) -> Result<()> {
    const WIDTH: i32 = 26;
    let height = height as i32 - 40;
    let (x, top) = (left as i32, TOP as i32 + 40);
    let range = colours.high - colours.low;
    for row in 0..height {
        let value = colours.high - range * (f64::from(row) + 0.5) / f64::from(height);
        let [r, g, b] = colours.colour(value);
        let row = Rectangle::new([(x, top + row), (x + WIDTH, top + row + 1)], RGBColor(r, g, b).filled());
        area.draw(&row).map_err(failed)?;
    }
    area.draw(&Rectangle::new([(x, top), (x + WIDTH, top + height)], INK.stroke_width(1))).map_err(failed)?;
    let ticks =
        Ticks::new(colours.low / unit.factor, colours.high / unit.factor, (height as usize / 60).clamp(2, 9));
    for &value in &ticks.at {
        let at = top + ((colours.high - value * unit.factor) / range * f64::from(height)) as i32;
        line(area, (x + WIDTH, at), (x + WIDTH + 7, at))?;
        let (label, at) = (ticks.label(value), (x + WIDTH + 12, at));
        text(area, &label, at, (18, FontStyle::Normal), Pos::new(HPos::Left, VPos::Center))?;
    }
    text(area, &unit.label(name), (x, TOP as i32), (20, FontStyle::Normal), Pos::new(HPos::Left, VPos::Top))
}

fn line(area: &Area, from: (i32, i32), to: (i32, i32)) -> Result<()> {
    area.draw(&PathElement::new([from, to], INK)).map_err(failed)
}

fn text(
    area: &Area,
    text: &str,
    at: (i32, i32),
    (size, weight): (u32, FontStyle),
    anchor: Pos,
) -> Result<()> {
    let font = (FONT, size).into_font().style(weight);
    let style = TextStyle::from(font).color(&INK).pos(anchor);
    area.draw(&Text::new(text, at, style)).map_err(failed)
}

fn encode(rgb: &[u8], width: usize, height: usize) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(rgb).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}
