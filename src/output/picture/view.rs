//! From the plane of the bodies to the pixels of a panel.
use super::pixel::Pixel;

/// A rectangle of the plane, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    pub low: [f64; 2],
    pub high: [f64; 2],
}

impl Window {
    /// Around these points; a unit square if there is none.
    pub fn around(points: impl Iterator<Item = [f64; 2]>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points.filter(|p| p.iter().all(|x| x.is_finite())) {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        if low[0] > high[0] { Window { low: [0.0; 2], high: [1.0; 2] } } else { Window { low, high } }
    }

    /// Width and height.
    pub fn size(&self) -> [f64; 2] {
        [self.high[0] - self.low[0], self.high[1] - self.low[1]]
    }

    /// With a margin, a fraction of the larger side, all around.
    pub fn widened(&self, fraction: f64) -> Self {
        let [width, height] = self.size();
        let margin = (fraction * width.max(height)).max(1e-9 * (self.low[0].abs() + self.low[1].abs()));
        let margin = if margin > 0.0 { margin } else { 1.0 };
        Window { low: self.low.map(|x| x - margin), high: self.high.map(|x| x + margin) }
    }

    /// Its middle.
    pub fn centre(&self) -> [f64; 2] {
        [0, 1].map(|k| 0.5 * (self.low[k] + self.high[k]))
    }

    /// Moved.
    pub fn shifted(&self, by: [f64; 2]) -> Self {
        Window { low: [0, 1].map(|k| self.low[k] + by[k]), high: [0, 1].map(|k| self.high[k] + by[k]) }
    }

    /// With this size and the same centre.
    pub fn resized(&self, size: [f64; 2]) -> Self {
        let centre = self.centre();
        Window {
            low: [0, 1].map(|k| centre[k] - 0.5 * size[k]),
            high: [0, 1].map(|k| centre[k] + 0.5 * size[k]),
        }
    }

    /// True if a box around these points overlaps the window.
    pub fn sees(&self, points: impl Iterator<Item = [f64; 2]>) -> bool {
        Window::around(points).overlaps(self)
    }

    /// True if they have a point in common.
    pub fn overlaps(&self, other: &Window) -> bool {
        (0..2).all(|k| self.low[k] <= other.high[k] && self.high[k] >= other.low[k])
    }
}

/// A window on a panel of so many pixels, equally scaled in both directions.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub window: Window,
    /// Width and height, pixels.
    pub pixels: [usize; 2],
}

impl View {
    /// As large as fits into `most` pixels; the window grows where it would be thinner than `least`.
    pub fn fit(window: Window, most: [usize; 2], least: [usize; 2]) -> Self {
        let size = window.size();
        let scale = (most[0] as f64 / size[0]).min(most[1] as f64 / size[1]);
        let pixels = [0, 1].map(|k| ((size[k] * scale) as usize).clamp(least[k], most[k]));
        View { window: window.resized([0, 1].map(|k| pixels[k] as f64 / scale)), pixels }
    }

    /// Where a point is on the panel.
    pub fn pixel(&self, p: [f64; 2]) -> Pixel {
        let size = self.window.size();
        let t = [0, 1].map(|k| (p[k] - self.window.low[k]) / size[k]);
        [t[0] * self.pixels[0] as f64, (1.0 - t[1]) * self.pixels[1] as f64]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_keep_the_aspect() {
        let window = Window { low: [0.0, 0.0], high: [4.0, 1.0] };
        let view = View::fit(window, [800, 800], [100, 300]);
        assert_eq!(view.pixels, [800, 300]);
        // The window grew: a square of it is a square on the panel.
        let [a, b] = [view.pixel([1.0, 0.0]), view.pixel([2.0, 1.0])];
        assert!((b[0] - a[0] - 200.0).abs() < 1.0 && (a[1] - b[1] - 200.0).abs() < 1.0);
        assert!(Window::around(std::iter::once([1.0, 1.0])).widened(0.1).size()[0] > 0.0);
    }
}
