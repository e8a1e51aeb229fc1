//! How does a stroke become SVG? plotters' backend, on a canvas ten times finer than the figure.
//!
//! plotters draws on whole pixels, which kinks smooth curves. Everything is drawn ten times larger, and the
//! view box scales it back.

use super::colour::Rgb;
use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, FontTransform, IntoFont, RGBColor, ShapeStyle, TextStyle};
use std::sync::Once;

/// Canvas units a pixel of the figure.
const FINE: f64 = 10.0;

/// plotters divides a font's size by this on its way to SVG; undone here, so that sizes are CSS pixels.
const FONT_SCALE: f64 = 1.24;

/// Families a viewer tries in turn; the first is the one whose measures are embedded here, and Verdana shares
/// its widths.
const FAMILY: &str = "DejaVu Sans, Verdana, Geneva, sans-serif";

/// A point of the figure, px, y down.
pub(super) type Point = (f64, f64);

/// Where a text hangs on its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    /// The text begins at the point, centred in height.
    Start,
    /// Centred both ways.
    Middle,
    /// The text ends at the point, centred in height.
    End,
    /// Centred below the point.
    Below,
    /// Centred, read upwards.
    Upwards,
}

/// An SVG being drawn.
pub(super) struct Canvas<'a> {
    backend: SVGBackend<'a>,
}

/// Draws a figure of `width x height` px and gives its SVG.
pub(super) fn draw(width: f64, height: f64, caption: &str, paint: impl FnOnce(&mut Canvas<'_>)) -> String {
    register_font();
    let fine = |length: f64| (length * FINE).round() as u32;
    let mut text = String::new();
    {
        let backend = SVGBackend::with_string(&mut text, (fine(width), fine(height)));
        let mut canvas = Canvas { backend };
        paint(&mut canvas);
        canvas.backend.present().expect(IN_MEMORY);
    }
    // plotters' own opening tag ends at the first line break.
    let body = text.split_once('\n').map_or("", |(_, body)| body);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" \
         role=\"img\">\n<desc>{}</desc>\n{body}",
        fine(width),
        fine(height),
        escape(caption)
    )
}

const IN_MEMORY: &str = "drawing SVG into memory cannot fail";

/// Gives plotters the embedded font, once.
fn register_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let bytes = include_bytes!("../font/DejaVuSans-subset.ttf");
        assert!(
            plotters::style::register_font(FAMILY, FontStyle::Normal, bytes).is_ok(),
            "the embedded font is a TrueType font"
        );
    });
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn fine((x, y): Point) -> (i32, i32) {
    ((x * FINE).round() as i32, (y * FINE).round() as i32)
}

fn style(colour: Rgb, alpha: f64, width_px: f64) -> ShapeStyle {
    let (r, g, b) = colour;
    ShapeStyle {
        color: RGBColor(r, g, b).mix(alpha),
        filled: false,
        stroke_width: (width_px * FINE).round() as u32,
    }
}

fn text_style(size_px: f64, colour: Rgb) -> TextStyle<'static> {
    let (r, g, b) = colour;
    let mut style = TextStyle::from((FAMILY, size_px * FINE * FONT_SCALE).into_font());
    style.color = RGBColor(r, g, b).to_backend_color();
    style
}

/// Width of a text, px.
pub(super) fn text_width(text: &str, size_px: f64) -> f64 {
    register_font();
    // The em is the size; plotters measures with its enlarged one.
    let (width, _) = text_style(size_px, super::colour::INK).font.box_size(text).unwrap_or((0, 0));
    f64::from(width) / FINE / FONT_SCALE * ADVANCE_SCALE
}

/// ab_glyph scales by the height from descender to ascender, 1.164 em in this font, not by the em.
const ADVANCE_SCALE: f64 = 1.164;

impl Canvas<'_> {
    /// An open line through points; fewer than two draw nothing.
    pub(super) fn line(&mut self, points: &[Point], colour: Rgb, width_px: f64) {
        if points.len() > 1 {
            let path: Vec<_> = points.iter().copied().map(fine).collect();
            self.backend.draw_path(path, &style(colour, 1.0, width_px)).expect(IN_MEMORY);
        }
    }

    /// A filled polygon.
    pub(super) fn polygon(&mut self, points: &[Point], colour: Rgb, alpha: f64) {
        let path: Vec<_> = points.iter().copied().map(fine).collect();
        self.backend.fill_polygon(path, &style(colour, alpha, 0.0)).expect(IN_MEMORY);
    }

    /// A filled rectangle between two corners.
    pub(super) fn rectangle(&mut self, a: Point, b: Point, colour: Rgb) {
        self.backend.draw_rect(fine(a), fine(b), &style(colour, 1.0, 0.0), true).expect(IN_MEMORY);
    }

    /// A disc, or an open circle.
    pub(super) fn circle(&mut self, centre: Point, radius_px: f64, colour: Rgb, filled: bool) {
        let radius = (radius_px * FINE).round() as u32;
        self.backend.draw_circle(fine(centre), radius, &style(colour, 1.0, 1.2), filled).expect(IN_MEMORY);
    }

    /// A line of text.
    pub(super) fn text(&mut self, text: &str, at: Point, size_px: f64, colour: Rgb, anchor: Anchor) {
        let (h, v) = match anchor {
            Anchor::Start => (HPos::Left, VPos::Center),
            Anchor::Middle | Anchor::Upwards => (HPos::Center, VPos::Center),
            Anchor::End => (HPos::Right, VPos::Center),
            Anchor::Below => (HPos::Center, VPos::Top),
        };
        let mut style = text_style(size_px, colour).pos(Pos::new(h, v));
        if anchor == Anchor::Upwards {
            style = style.transform(FontTransform::Rotate270);
        }
        self.backend.draw_text(text, &style, fine(at)).expect(IN_MEMORY);
    }
}
