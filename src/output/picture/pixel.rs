//! Points and colours of a bitmap.

/// Red, green, blue.
pub(super) type Rgb = [u8; 3];

/// A point on the canvas, pixels of the final picture, y downwards.
pub(super) type Pixel = [f64; 2];

/// A colour that fills a word: one store instead of two.
pub(super) type Point = [u8; 4];

/// The last byte means nothing.
pub(super) fn point([r, g, b]: Rgb) -> Point {
    [r, g, b, 0]
}
