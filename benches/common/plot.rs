//! Curves on logarithmic axes, as PNG and SVG.
use kontakt::vector::{larger, smaller};
use kontakt::{Error, Result};
use plotters::{
    coord::Shift,
    prelude::*,
    style::{FontStyle, register_font},
};
use std::path::Path;

/// Width and height of a panel, pixels.
const PANEL: (u32, u32) = (760, 560);
const FONT: &str = "sans-serif";
const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(226, 226, 226);
/// Distinct to all readers (Okabe and Ito).
const COLOURS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115), RGBColor(204, 121, 167)];

/// A curve; points with a text have it written beside them.
pub struct Curve {
    pub name: String,
    pub points: Vec<(f64, f64, String)>,
}

/// A diagram.
pub struct Panel {
    pub title: String,
    pub x: String,
    pub y: String,
    pub curves: Vec<Curve>,
    /// Where the legend is.
    pub legend: SeriesLabelPosition,
}

/// Draws panels side by side into docs/benchmarks/<name>.png and .svg.
pub fn draw(name: &str, panels: &[Panel]) -> Result<()> {
    let failed = |e: &dyn std::fmt::Display| Error::internal(format!("{name}: {e}"));
    for (style, face) in
        [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())]
    {
        register_font(FONT, style, face)
            .map_err(|_| Error::internal("the font of the pictures cannot be read"))?;
    }
    let directory = super::root().join("docs/benchmarks");
    std::fs::create_dir_all(&directory).map_err(|e| failed(&e))?;
    let size = (PANEL.0 * panels.len() as u32, PANEL.1);
    let path = |ending: &str| directory.join(format!("{name}.{ending}"));
    let (png, svg) = (path("png"), path("svg"));
    // Twice the size in PNG, for print.
    let bitmap = BitMapBackend::new(&png, (2 * size.0, 2 * size.1)).into_drawing_area();
    panels_on(&bitmap, panels, 2).map_err(|e| failed(&e))?;
    let vector = SVGBackend::new(&svg, size).into_drawing_area();
    panels_on(&vector, panels, 1).map_err(|e| failed(&e))?;
    drop(vector);
    end_lines(&svg)
}

/// A text file ends with a line end.
fn end_lines(file: &Path) -> Result<()> {
    let text = std::fs::read_to_string(file).map_err(Error::internal)?;
    std::fs::write(file, text.trim_end().to_owned() + "\n").map_err(Error::internal)
}

type Drawn = std::result::Result<(), String>;

fn panels_on<B: DrawingBackend>(area: &DrawingArea<B, Shift>, panels: &[Panel], scale: u32) -> Drawn {
    area.fill(&WHITE).map_err(|e| e.to_string())?;
    for (panel, area) in std::iter::zip(panels, area.split_evenly((1, panels.len()))) {
        one(&area, panel, scale)?;
    }
    area.present().map_err(|e| e.to_string())
}

/// All values, with a third of a decade free on both sides.
fn range(values: impl Iterator<Item = f64> + Clone) -> std::ops::Range<f64> {
    const FREE: f64 = 2.2;
    let low = values.clone().fold(f64::INFINITY, smaller);
    low / FREE..FREE * values.fold(0.0, larger)
}

fn one<B: DrawingBackend>(area: &DrawingArea<B, Shift>, panel: &Panel, scale: u32) -> Drawn {
    let text = |size: u32| (FONT, (size * scale) as i32).into_font().color(&INK);
    let points = || panel.curves.iter().flat_map(|c| &c.points);
    let ranges = (range(points().map(|p| p.0)), range(points().map(|p| p.1)));
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, (FONT, (18 * scale) as i32, FontStyle::Bold).into_font().color(&INK))
        .margin(14 * scale)
        .margin_right(24 * scale)
        .x_label_area_size(46 * scale)
        .y_label_area_size(74 * scale)
        .build_cartesian_2d(ranges.0.log_scale(), ranges.1.log_scale())
        .map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .bold_line_style(GRID.stroke_width(scale))
        .light_line_style(WHITE)
        .axis_style(INK.stroke_width(scale))
        .x_desc(&panel.x)
        .y_desc(&panel.y)
        .axis_desc_style(text(15))
        .label_style(text(14))
        .x_label_formatter(&|v| power(*v))
        .y_label_formatter(&|v| power(*v))
        .draw()
        .map_err(|e| e.to_string())?;
    for (i, curve) in panel.curves.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let line = curve.points.iter().map(|p| (p.0, p.1));
        chart
            .draw_series(LineSeries::new(line.clone(), colour.stroke_width(2 * scale)))
            .map_err(|e| e.to_string())?
            .label(&curve.name)
            .legend(move |(x, y)| {
                let end = x + 24 * scale as i32;
                PathElement::new([(x, y), (end, y)], colour.stroke_width(2 * scale))
            });
        let dots = line.map(|p| Circle::new(p, 5 * scale, colour.filled()));
        chart.draw_series(dots).map_err(|e| e.to_string())?;
        let labels = curve.points.iter().map(|(x, y, label)| {
            let place = (8 * scale as i32, -(18 * scale as i32));
            EmptyElement::at((*x, *y)) + Text::new(label.clone(), place, text(12).color(&colour))
        });
        chart.draw_series(labels).map_err(|e| e.to_string())?;
    }
    chart
        .configure_series_labels()
        .position(panel.legend.clone())
        .margin(12 * scale)
        .legend_area_size(34 * scale)
        .background_style(WHITE.mix(0.9))
        .border_style(GRID.stroke_width(scale))
        .label_font(text(14))
        .draw()
        .map_err(|e| e.to_string())
}

/// 1, 2 and 5 times a power of ten: as they are from 0.001 to 1000, beyond as a power. Other ticks have no label.
fn power(value: f64) -> String {
    let exponent = (value.log10() + 1e-9).floor() as i32;
    let digit = value / 10f64.powi(exponent);
    let is = |wanted: f64| (digit / wanted - 1.0).abs() < 1e-6;
    if (-3..=3).contains(&exponent) {
        return if is(1.0) || is(2.0) || is(5.0) {
            format!("{:.*}", (-exponent).max(0) as usize, value)
        } else {
            String::new()
        };
    }
    if !is(1.0) {
        return String::new();
    }
    let digits = exponent.unsigned_abs().to_string();
    let raised =
        digits.bytes().map(|d| ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][usize::from(d - b'0')]);
    format!("10{}{}", if exponent < 0 { "⁻" } else { "" }, raised.collect::<String>())
}
