//! A bitmap with several pixels for one of the drawing: what is drawn for a screen can be printed.
use plotters::prelude::*;
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind};

/// Draws everything on another backend, so many times as large.
pub(super) struct Sharp<B> {
    backend: B,
    factor: u32,
}

/// A style with thicker lines.
struct Thick {
    color: BackendColor,
    width: u32,
}

impl BackendStyle for Thick {
    fn color(&self) -> BackendColor {
        self.color
    }
    fn stroke_width(&self) -> u32 {
        self.width
    }
}

impl<B> Sharp<B> {
    pub fn new(backend: B, factor: u32) -> Self {
        Sharp { backend, factor }
    }

    fn at(&self, (x, y): BackendCoord) -> BackendCoord {
        (x * self.factor as i32, y * self.factor as i32)
    }

    fn thick<S: BackendStyle>(&self, style: &S) -> Thick {
        Thick { color: style.color(), width: style.stroke_width() * self.factor }
    }
}

type Drawn<B> = Result<(), DrawingErrorKind<<B as DrawingBackend>::ErrorType>>;

impl<B: DrawingBackend> DrawingBackend for Sharp<B> {
    type ErrorType = B::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        let (width, height) = self.backend.get_size();
        (width / self.factor, height / self.factor)
    }

    fn ensure_prepared(&mut self) -> Drawn<B> {
        self.backend.ensure_prepared()
    }

    fn present(&mut self) -> Drawn<B> {
        self.backend.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn<B> {
        let (from, size) = (self.at(point), self.factor as i32 - 1);
        self.backend.draw_rect(from, (from.0 + size, from.1 + size), &Thick { color, width: 1 }, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn<B> {
        let (from, to, style) = (self.at(from), self.at(to), self.thick(style));
        self.backend.draw_line(from, to, &style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn<B> {
        let (from, to, style) = (self.at(from), self.at(to), self.thick(style));
        self.backend.draw_rect(from, to, &style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn<B> {
        let path: Vec<BackendCoord> = path.into_iter().map(|point| self.at(point)).collect();
        let style = self.thick(style);
        self.backend.draw_path(path, &style)
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn<B> {
        let (center, style) = (self.at(center), self.thick(style));
        self.backend.draw_circle(center, radius * self.factor, &style, fill)
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, at: BackendCoord) -> Drawn<B> {
        let size = style.size() * f64::from(self.factor);
        let font = FontDesc::new(style.family(), size, style.style()).transform(style.transform());
        let style = TextStyle { font, color: style.color(), pos: style.anchor() };
        self.backend.draw_text(text, &style, self.at(at))
    }
}
