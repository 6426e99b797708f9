//! A bitmap with triangles, lines and smooth edges: hundreds of thousands of cells in a second.
use super::colour::Palette;
use super::pixel::{Pixel, Point, Rgb, point};

/// Drawn with this many points per pixel and direction.
const FINE: usize = 2;

/// A bitmap, white at first.
pub(super) struct Canvas {
    width: usize,
    height: usize,
    /// Row by row, in the fine resolution.
    points: Vec<Point>,
}

impl Canvas {
    /// Size in pixels of the final picture.
    pub fn new(width: usize, height: usize) -> Self {
        let (width, height) = (width * FINE, height * FINE);
        Canvas { width, height, points: vec![point([255; 3]); width * height] }
    }

    /// True if a point of the bitmap lies in this box: what lies between the points cannot be seen.
    pub fn has_points(&self, low: Pixel, high: Pixel) -> bool {
        let [columns, rows] = [(0, self.width), (1, self.height)]
            .map(|(k, size)| span(low[k] * FINE as f64, high[k] * FINE as f64, size));
        !columns.is_empty() && !rows.is_empty()
    }

    /// Fills a triangle, the value linear in it.
    pub fn triangle(&mut self, corners: [Pixel; 3], values: [f64; 3], palette: &Palette) {
        let [a, b, c] = corners.map(|p| p.map(|x| x * FINE as f64));
        let area = cross(a, b, c);
        // Not finite, or seen from its edge.
        if !(area.abs() > 0.0 && area.is_finite()) {
            return;
        }
        let (low, high) =
            ([0, 1].map(|k| a[k].min(b[k]).min(c[k])), [0, 1].map(|k| a[k].max(b[k]).max(c[k])));
        let columns = span(low[0], high[0], self.width);
        if columns.is_empty() {
            return;
        }
        let rows = span(low[1], high[1], self.height);
        // Barycentric coordinates at the first point of a row, along the row, and from row to row.
        let sides = [(b, c), (c, a), (a, b)];
        let dw = sides.map(|(p, q)| (p[1] - q[1]) / area);
        let along = dw.map(f64::recip);
        let down = sides.map(|(p, q)| (q[0] - p[0]) / area);
        let first = [columns.start as f64 + 0.5, rows.start as f64 + 0.5];
        let first = sides.map(|(p, q)| cross(p, q, first) / area);
        let sum = |w: [f64; 3]| w[0] * values[0] + w[1] * values[1] + w[2] * values[2];
        let slope = palette.slope(sum(first), sum(dw), sum(down));
        let n_columns = columns.len() as f64;
        for (n, row) in rows.enumerate() {
            let w: [f64; 3] = std::array::from_fn(|k| first[k] + n as f64 * down[k]);
            // A little more than the triangle: no gap between neighbours.
            let (mut from, mut to) = (0.0f64, n_columns - 1.0);
            for k in 0..3 {
                let end = (-1e-9 - w[k]) * along[k];
                match dw[k] {
                    dw if dw > 0.0 => from = from.max(end),
                    dw if dw < 0.0 => to = to.min(end),
                    _ if w[k] < -1e-9 => to = -1.0,
                    _ => {}
                }
            }
            if from <= to {
                // Rounded up; `ceil` is a call on old processors.
                let from = from as usize + usize::from(from > (from as usize) as f64);
                let end = (to as usize + 1).max(from);
                let points = &mut self.points[row * self.width + columns.start..];
                palette.fill(&mut points[from..end], &slope, [from, n]);
            }
        }
    }

    /// Draws a line `width` pixels wide with rounded ends.
    pub fn line(&mut self, from: Pixel, to: Pixel, width: f64, colour: Rgb, opacity: f64) {
        let (Some((from, to)), true) = (self.clip(from, to, width), opacity > 0.0) else { return };
        let [a, b] = [from, to].map(|p| p.map(|x| x * FINE as f64));
        let d = [b[0] - a[0], b[1] - a[1]];
        let length2 = (d[0] * d[0] + d[1] * d[1]).max(1e-12);
        // Points at the edge are covered in part: as wide wherever it lies between the points.
        let reach = 0.5 * width * FINE as f64 + 0.5;
        let rows = span(a[1].min(b[1]) - reach, a[1].max(b[1]) + reach, self.height);
        for row in rows {
            let y = row as f64 + 0.5;
            // Only near the line in this row: a long slanted line has a large box.
            let t = |y: f64| if d[1] == 0.0 { None } else { Some(((y - a[1]) / d[1]).clamp(0.0, 1.0)) };
            let (x0, x1) = match (t(y - reach), t(y + reach)) {
                (Some(t0), Some(t1)) => (a[0] + t0 * d[0], a[0] + t1 * d[0]),
                _ => (a[0], b[0]),
            };
            for column in span(x0.min(x1) - reach, x0.max(x1) + reach, self.width) {
                let p = [column as f64 + 0.5 - a[0], y - a[1]];
                let t = ((p[0] * d[0] + p[1] * d[1]) / length2).clamp(0.0, 1.0);
                let (dx, dy) = (p[0] - t * d[0], p[1] - t * d[1]);
                let covered = (reach - (dx * dx + dy * dy).sqrt()).min(1.0);
                if covered > 0.0 {
                    let point = &mut self.points[row * self.width + column];
                    for (old, new) in point.iter_mut().zip(colour) {
                        *old = mix(*old, new, covered * opacity);
                    }
                }
            }
        }
    }

    /// Draws a polyline with hatching to the left of the direction of travel: the edge of something rigid.
    pub fn hatched(&mut self, line: &[Pixel], colour: Rgb) {
        const SPACING: f64 = 11.0;
        const LENGTH: f64 = 10.0;
        // From one stroke to the next, across the corners; not counted where nothing can be seen.
        let mut left = 0.5 * SPACING;
        for ends in line.windows(2) {
            let Some((from, to)) = self.clip(ends[0], ends[1], LENGTH) else { continue };
            self.line(from, to, 2.4, colour, 1.0);
            let d = [to[0] - from[0], to[1] - from[1]];
            let length = d[0].hypot(d[1]);
            if length <= 0.0 {
                continue;
            }
            let along = d.map(|x| x / length);
            while left < length {
                let p = [from[0] + left * along[0], from[1] + left * along[1]];
                // y points down: left of the travel is (dy, -dx). The strokes lean back by 45 degrees.
                let lean = [along[1] - along[0], -along[0] - along[1]].map(|x| x * LENGTH / 2f64.sqrt());
                self.line(p, [p[0] + lean[0], p[1] + lean[1]], 1.2, colour, 0.8);
                left += SPACING;
            }
            left -= length;
        }
    }

    /// The part of a line that can be seen.
    fn clip(&self, from: Pixel, to: Pixel, width: f64) -> Option<(Pixel, Pixel)> {
        let size = [self.width as f64 / FINE as f64, self.height as f64 / FINE as f64];
        let (mut t0, mut t1) = (0.0f64, 1.0f64);
        for k in 0..2 {
            let (low, high, d) = (-width, size[k] + width, to[k] - from[k]);
            if !d.is_finite() || !from[k].is_finite() {
                return None;
            }
            if d == 0.0 {
                if from[k] < low || from[k] > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - from[k]) / d, (high - from[k]) / d);
            t0 = t0.max(a.min(b));
            t1 = t1.min(a.max(b));
        }
        let at = |t: f64| [0, 1].map(|k| from[k] + t * (to[k] - from[k]));
        (t0 <= t1).then(|| (at(t0), at(t1)))
    }

    /// The picture: 8-bit RGB, row by row, each pixel the mean of its points.
    pub fn into_rgb(self) -> Vec<u8> {
        let mut rgb = vec![0; 3 * self.points.len() / (FINE * FINE)];
        let rows = self.points.chunks_exact(FINE * self.width);
        for (rows, out) in rows.zip(rgb.chunks_exact_mut(3 * self.width / FINE)) {
            for (column, out) in out.chunks_exact_mut(3).enumerate() {
                // Red and blue are summed in one word, 16 bits for each.
                let (mut red_blue, mut green) = (0, 0);
                for row in rows.chunks_exact(self.width) {
                    for point in &row[column * FINE..][..FINE] {
                        let word = u32::from_le_bytes(*point);
                        red_blue += word & 0x00ff_00ff;
                        green += word >> 8 & 0xff;
                    }
                }
                let mean = |sum: u32| (sum / (FINE * FINE) as u32) as u8;
                out.copy_from_slice(&[mean(red_blue & 0xffff), mean(green), mean(red_blue >> 16)]);
            }
        }
        rgb
    }
}

/// Twice the area of a triangle.
fn cross(a: Pixel, b: Pixel, c: Pixel) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Pixels whose centres lie between two coordinates, or on them to round-off.
fn span(low: f64, high: f64, size: usize) -> std::ops::Range<usize> {
    let last = (high + 0.5 + 1e-6).clamp(0.0, size as f64) as usize;
    (low - 0.5 - 1e-6).ceil().clamp(0.0, last as f64) as usize..last
}

fn mix(old: u8, new: u8, opacity: f64) -> u8 {
    (f64::from(old) * (1.0 - opacity) + f64::from(new) * opacity).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::output::picture::colour::ColourScale;

    const SCALE: ColourScale = ColourScale { low: 0.0, high: 1.0, diverging: false };

    #[test]
    fn triangles_cover_their_area_and_nothing_else() {
        let mut canvas = Canvas::new(20, 10);
        let palette = Palette::new(&SCALE);
        canvas.triangle([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]], [1.0; 3], &palette);
        canvas.triangle([[-1e9, 3.0], [f64::NAN, 0.0], [4.0, 4.0]], [0.5; 3], &palette);
        let filled =
            canvas.points.iter().filter(|&&p| p != point([255; 3])).count() as f64 / (FINE * FINE) as f64;
        assert!((filled - 50.0).abs() < 3.0, "{filled}");
        let rgb = canvas.into_rgb();
        assert_eq!(rgb.len(), 600);
        assert_eq!(rgb[..3], SCALE.colour(1.0));
        assert_eq!(rgb[57..60], [255; 3]);
    }

    #[test]
    fn what_lies_between_the_points_cannot_be_seen() {
        let canvas = Canvas::new(2, 2);
        let third = 1.0 / FINE as f64;
        assert!(canvas.has_points([0.4 * third; 2], [0.6 * third; 2]));
        assert!(!canvas.has_points([0.6 * third, 0.0], [1.4 * third, 2.0]));
        assert!(!canvas.has_points([2.0; 2], [3.0; 2]) && !canvas.has_points([-1.0; 2], [0.0; 2]));
    }

    #[test]
    fn lines_have_their_width_wherever_they_end() {
        let mut canvas = Canvas::new(20, 10);
        canvas.line([-1e7, 5.0], [1e7, 5.0], 2.0, [0; 3], 1.0);
        canvas.line([5.0, 1e5], [5.0, f64::INFINITY], 2.0, [0; 3], 1.0);
        let black = canvas.points.iter().filter(|&&p| p == point([0; 3])).count();
        assert_eq!(black, 20 * 2 * FINE * FINE);
    }
}
