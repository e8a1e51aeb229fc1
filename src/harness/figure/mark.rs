//! How is one point drawn, and how a series shown in the legend?

use super::canvas::{Canvas, Point};
use super::clip::dashes;
use super::colour::{Look, Marker};
use super::plot::Layer;

/// One marker.
pub(super) fn draw_marker(canvas: &mut Canvas<'_>, (x, y): Point, look: Look) {
    let (r, colour) = (look.size_px, look.colour);
    match look.marker {
        Marker::Disc | Marker::Dot => canvas.circle((x, y), r, colour, true),
        Marker::Circle => canvas.circle((x, y), r, colour, false),
        Marker::Square => {
            let r = 0.9 * r;
            canvas.polygon(&[(x - r, y - r), (x + r, y - r), (x + r, y + r), (x - r, y + r)], colour, 1.0);
        }
        Marker::Triangle => {
            canvas.polygon(
                &[(x, y - 1.2 * r), (x + 1.1 * r, y + 0.8 * r), (x - 1.1 * r, y + 0.8 * r)],
                colour,
                1.0,
            );
        }
        Marker::Diamond => {
            let r = 1.25 * r;
            canvas.polygon(&[(x, y - r), (x + r, y), (x, y + r), (x - r, y)], colour, 1.0);
        }
        Marker::Cross => {
            canvas.line(&[(x - r, y - r), (x + r, y + r)], colour, 1.5);
            canvas.line(&[(x - r, y + r), (x + r, y - r)], colour, 1.5);
        }
        Marker::Plus => {
            canvas.line(&[(x - 1.2 * r, y), (x + 1.2 * r, y)], colour, 1.5);
            canvas.line(&[(x, y - 1.2 * r), (x, y + 1.2 * r)], colour, 1.5);
        }
    }
}

/// A line with a head of two barbs, as long as the line allows.
pub(super) fn draw_arrow(canvas: &mut Canvas<'_>, tail: Point, tip: Point, look: Look) {
    for stroke in dashes(&[tail, tip], look.dash.pattern()) {
        canvas.line(&stroke, look.colour, look.width_px);
    }
    if let Some(head) = arrow_head(tail, tip, 8.0) {
        canvas.line(&head, look.colour, look.width_px);
    }
}

/// Barb, tip, barb; none for an arrow that is shorter than a pixel.
pub(super) fn arrow_head(tail: Point, tip: Point, longest_px: f64) -> Option<[Point; 3]> {
    let (ax, ay) = (tip.0 - tail.0, tip.1 - tail.1);
    let length = libm::hypot(ax, ay);
    if length <= 1.0 {
        return None;
    }
    let (ux, uy) = (ax / length, ay / length);
    let head = length.min(longest_px);
    let barb =
        |side: f64| (tip.0 - head * ux + side * 0.5 * head * uy, tip.1 - head * uy - side * 0.5 * head * ux);
    Some([barb(1.0), tip, barb(-1.0)])
}

/// The sample of a layer in the legend, from `(x, y)` to the right.
pub(super) fn draw_sample(canvas: &mut Canvas<'_>, layer: &Layer, (x, y): Point, width: f64) {
    let patch = [(x, y - 5.0), (x + width, y - 5.0), (x + width, y + 5.0), (x, y + 5.0)];
    match layer {
        Layer::Line { look, .. } | Layer::Vertical { look, .. } | Layer::Horizontal { look, .. } => {
            for stroke in dashes(&[(x, y), (x + width, y)], look.dash.pattern()) {
                canvas.line(&stroke, look.colour, look.width_px);
            }
        }
        Layer::Points { look, .. } => draw_marker(canvas, (x + 0.5 * width, y), *look),
        Layer::Band { look, .. } => canvas.polygon(&patch, look.colour, 0.2),
        Layer::Histogram { look, .. } => canvas.polygon(&patch, look.colour, 0.35),
        Layer::ErrorBars { look, .. } => {
            canvas.line(
                &[(x + 0.5 * width, y - 6.0), (x + 0.5 * width, y + 6.0)],
                look.colour,
                look.width_px,
            );
        }
        Layer::Arrows { look, .. } => {
            canvas.line(&[(x, y), (x + width, y)], look.colour, 1.1);
            canvas.line(
                &[(x + width - 5.0, y - 3.0), (x + width, y), (x + width - 5.0, y + 3.0)],
                look.colour,
                1.1,
            );
        }
    }
}
