//! Colour maps with even steps to the eye.
use super::pixel::{Point, Rgb, point};

/// Where there is no value.
const NO_VALUE: Rgb = [190, 190, 190];

/// How values become colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ColourScale {
    /// Smallest value drawn.
    pub low: f64,
    /// Largest value drawn.
    pub high: f64,
    /// True: colours diverge from 0, equally far to both sides.
    pub diverging: bool,
}

impl ColourScale {
    /// For these values: diverging if both signs matter.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.filter(|v| v.is_finite()) {
            low = low.min(v);
            high = high.max(v);
        }
        if low > high {
            (low, high) = (0.0, 0.0);
        }
        let size = low.abs().max(high.abs());
        if high - low <= 1e-9 * size || size == 0.0 {
            // The same everywhere, up to round-off: the bar needs some length nevertheless.
            let half = if size == 0.0 { 1.0 } else { 0.1 * size };
            return ColourScale { low: low - half, high: high + half, diverging: false };
        }
        let diverging = low < -0.02 * size && high > 0.02 * size;
        ColourScale { low, high, diverging }
    }

    /// From nought, which is white, to this value; of nothing but noughts some length nevertheless.
    pub fn from_nought(high: f64) -> Self {
        ColourScale { low: 0.0, high: if high > 0.0 { high } else { 1e-6 }, diverging: true }
    }

    /// Colour of a value; grey where there is none.
    pub fn colour(&self, value: f64) -> Rgb {
        if !value.is_finite() {
            return NO_VALUE;
        }
        if self.diverging {
            let size = self.high.max(-self.low);
            blend(&DIVERGING, 0.5 + 0.5 * value / size)
        } else {
            blend(&SEQUENTIAL, (value - self.low) / (self.high - self.low))
        }
    }
}

/// Steps of a [`Palette`]: finer than a bitmap's 8 bits can show.
const STEPS: usize = 2048;
/// Bits behind the point of a place in a [`Palette`]: thousands of pixels add up to less than a step of it.
const BITS: u32 = 20;

/// Values that are linear over the pixels, as places in a [`Palette`]: in fixed point, since rounding a double for every
/// pixel takes longer.
pub(super) struct Slope {
    is_known: bool,
    first: i64,
    along: i64,
    down: i64,
}

/// A colour scale as a table.
pub(super) struct Palette {
    low: f64,
    per_value: f64,
    colours: Box<[Point; STEPS]>,
}

impl Palette {
    /// From the low to the high end, and as far beyond 0 where the scale diverges.
    pub fn new(scale: &ColourScale) -> Palette {
        let size = scale.high.max(-scale.low);
        let [low, high] = if scale.diverging { [-size, size] } else { [scale.low, scale.high] };
        let step = (high - low) / (STEPS - 1) as f64;
        let colours = std::array::from_fn(|i| point(scale.colour(low + i as f64 * step)));
        Palette { low, per_value: 1.0 / step, colours: Box::new(colours) }
    }

    /// Places of values that are linear over the pixels: the first pixel's value, and how it grows along a row and
    /// from row to row.
    pub fn slope(&self, first: f64, along: f64, down: f64) -> Slope {
        let fixed = |places: f64| (places * f64::from(1 << BITS)) as i64;
        Slope {
            is_known: first.is_finite() && along.is_finite() && down.is_finite(),
            first: fixed((first - self.low) * self.per_value + 0.5),
            along: fixed(along * self.per_value),
            down: fixed(down * self.per_value),
        }
    }

    /// Colours points of one row from the place (along, down) on; grey where there is no value.
    pub fn fill(&self, points: &mut [Point], slope: &Slope, [along, down]: [usize; 2]) {
        if !slope.is_known {
            return points.fill(point(NO_VALUE));
        }
        let to = |step: i64, n: usize| step.saturating_mul(n as i64);
        let mut place =
            slope.first.saturating_add(to(slope.along, along)).saturating_add(to(slope.down, down));
        let ends = [place, place.saturating_add(to(slope.along, points.len()))];
        if ends.iter().all(|end| (0..STEPS as i64).contains(&(end >> BITS))) {
            for point in points {
                *point = self.colours[(place >> BITS) as usize % STEPS];
                place += slope.along;
            }
            return;
        }
        for point in points {
            *point = self.colours[(place >> BITS).clamp(0, STEPS as i64 - 1) as usize];
            place = place.saturating_add(slope.along);
        }
    }
}

/// Colours in an order that the eye follows, dark for 0, light for 1.
pub(super) fn ramp(t: f64) -> Rgb {
    blend(&SEQUENTIAL, t)
}

/// Nine samples of Matplotlib's `viridis` (CC0).
const SEQUENTIAL: [Rgb; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// Eleven steps of ColorBrewer's `RdBu` (Apache 2.0), blue for compression.
const DIVERGING: [Rgb; 11] = [
    [5, 48, 97],
    [33, 102, 172],
    [67, 147, 195],
    [146, 197, 222],
    [209, 229, 240],
    [247, 247, 247],
    [253, 219, 199],
    [244, 165, 130],
    [214, 96, 77],
    [178, 24, 43],
    [103, 0, 31],
];

/// Linear between the stops, constant beyond the ends.
fn blend(stops: &[Rgb], t: f64) -> Rgb {
    let x = t.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let i = (x as usize).min(stops.len() - 2);
    let f = x - i as f64;
    std::array::from_fn(|k| {
        (f64::from(stops[i][k]) * (1.0 - f) + f64::from(stops[i + 1][k]) * f).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mixed_signs_diverge_from_zero() {
        let scale = ColourScale::of([-4.0, 1.0].into_iter());
        assert!(scale.diverging);
        assert_eq!(scale.colour(0.0), [247, 247, 247]);
        assert_eq!(scale.colour(-4.0), [5, 48, 97]);
        // As far from white as -1, not as -4.
        assert!(scale.colour(1.0)[2] > 150);
    }

    #[test]
    fn a_palette_is_its_scale() {
        for scale in [
            ColourScale { low: -4.0, high: 1.0, diverging: true },
            ColourScale { low: 2.0, high: 5.0, diverging: false },
        ] {
            let palette = Palette::new(&scale);
            let mut row = vec![point([0; 3]); 111];
            // Beyond both ends, and within them.
            for (first, step) in [(-5.0, 0.1), (scale.low, (scale.high - scale.low) / 112.0)] {
                palette.fill(&mut row, &palette.slope(first - 3.0 * step, step, step), [2, 1]);
                for (i, colour) in row.iter().enumerate() {
                    let value = first + i as f64 * step;
                    let mut pair = std::iter::zip(*colour, scale.colour(value));
                    assert!(pair.all(|(a, b)| a.abs_diff(b) <= 1), "{value}");
                }
            }
            for (first, step) in [(f64::NAN, 0.1), (0.0, f64::INFINITY)] {
                palette.fill(&mut row, &palette.slope(first, step, 0.0), [0, 0]);
                assert!(row.iter().all(|colour| *colour == point(NO_VALUE)));
            }
        }
    }

    #[test]
    fn one_sign_is_sequential_and_a_constant_is_the_middle() {
        let scale = ColourScale::of([2.0, f64::NAN, 5.0].into_iter());
        assert_eq!(scale, ColourScale { low: 2.0, high: 5.0, diverging: false });
        assert_eq!(scale.colour(5.0), [253, 231, 37]);
        let constant = ColourScale::of([3.0, 3.0].into_iter());
        assert_eq!(constant.colour(3.0), SEQUENTIAL[4]);
        let nothing = ColourScale::of(std::iter::empty());
        assert!(nothing.low < nothing.high);
    }
}
