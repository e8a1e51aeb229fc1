//! How does a plot become a picture? Panels on a sheet; in each a title, axes, layers, and a legend below.

use super::axis::{Scale, Span};
use super::canvas::{self, Anchor, Canvas, Point, text_width};
use super::clip::{Frame, dashes};
use super::colour::{Dash, GRID, INK, Look, PAPER};
use super::legend;
use super::mark::{arrow_head, draw_marker};
use super::plot::{Layer, Plot};

const TITLE_PX: f64 = 14.0;
const LABEL_PX: f64 = 12.5;
const TICK_PX: f64 = 11.5;
/// Room beside the frame for a colour scale with its ticks and label.
const SCALE_PX: f64 = 96.0;

/// The SVG of panels, row by row.
pub(super) fn svg(plots: &[Plot], columns: usize, caption: &str) -> String {
    let columns = columns.clamp(1, plots.len().max(1));
    let (width, height) = plots.iter().fold((0.0f64, 0.0f64), |(w, h), p| (w.max(p.size.0), h.max(p.size.1)));
    let sheet = (width * columns as f64, height * plots.len().div_ceil(columns) as f64);
    canvas::draw(sheet.0, sheet.1, caption, |canvas| {
        canvas.rectangle((0.0, 0.0), sheet, PAPER);
        for (index, plot) in plots.iter().enumerate() {
            let corner = (width * (index % columns) as f64, height * (index / columns) as f64);
            draw_panel(canvas, plot, corner);
        }
    })
}

/// Spans and frame of a plot, settled.
struct Panel {
    x: Span,
    y: Span,
    frame: Frame,
}

fn draw_panel(canvas: &mut Canvas<'_>, plot: &Plot, (left, top): Point) {
    let panel = Panel::lay_out(plot, left, top);
    let frame = panel.frame;
    let middle = 0.5 * (frame.left + frame.right);
    canvas.text(&plot.title, (left + 0.5 * plot.size.0, top + 16.0), TITLE_PX, INK, Anchor::Middle);
    match &plot.heat {
        Some(heat) => {
            heat.draw_cells(canvas, frame, TICK_PX);
            heat.draw_scale(canvas, frame, TICK_PX);
        }
        None => panel.draw_grid(canvas),
    }
    for layer in &plot.layers {
        panel.draw_layer(canvas, layer);
    }
    let (l, t, r, b) = (frame.left, frame.top, frame.right, frame.bottom);
    canvas.line(&[(l, t), (r, t), (r, b), (l, b), (l, t)], INK, 1.0);
    canvas.text(&plot.x.label, (middle, frame.bottom + 22.0), LABEL_PX, INK, Anchor::Below);
    let y_label = (left + 14.0, 0.5 * (frame.top + frame.bottom));
    canvas.text(&plot.y.label, y_label, LABEL_PX, INK, Anchor::Upwards);
    legend::draw(canvas, &plot.layers, left + 14.0, frame.bottom + 44.0, plot.size.0 - 24.0);
}

impl Panel {
    fn lay_out(plot: &Plot, left: f64, top: f64) -> Panel {
        let extent: Vec<(f64, f64)> = plot.layers.iter().flat_map(Layer::extent).collect();
        let mut x = plot.x.span(extent.iter().map(|p| p.0));
        let mut y = plot.y.span(extent.iter().map(|p| p.1));
        // Bars stand on the axis.
        let bars = plot.layers.iter().any(|layer| matches!(layer, Layer::Histogram { .. }));
        let below = extent.iter().any(|p| p.1 < 0.0);
        if bars && !below && y.scale == Scale::Linear && plot.y.fixed.is_none() {
            y.low = 0.0;
        }
        let widest =
            |texts: &mut dyn Iterator<Item = &str>| texts.map(|t| text_width(t, TICK_PX)).fold(0.0, f64::max);
        let y_ticks = y.ticks(6);
        let tick_px = match &plot.heat {
            Some(heat) => widest(&mut heat.rows().iter().map(String::as_str)),
            None => widest(&mut y_ticks.iter().map(|t| t.text.as_str())),
        };
        let (width, height) = plot.size;
        let legend_px = legend::height(&plot.layers, width - 24.0);
        let right_px = if plot.heat.is_some() { SCALE_PX } else { 18.0 };
        let frame = Frame {
            left: left + 34.0 + tick_px,
            top: top + 32.0,
            right: left + width - right_px,
            bottom: top + height - 46.0 - legend_px,
        };
        if plot.equal_aspect {
            widen_to_equal_aspect(&mut x, &mut y, frame);
        }
        Panel { x, y, frame }
    }

    /// The place of a data point; NaN where it has none.
    fn place(&self, (x, y): (f64, f64)) -> Point {
        let frame = self.frame;
        (frame.left + frame.width() * self.x.fraction(x), frame.bottom - frame.height() * self.y.fraction(y))
    }

    fn draw_grid(&self, canvas: &mut Canvas<'_>) {
        let frame = self.frame;
        let room = frame.width() / 62.0;
        for tick in self.x.ticks(room as usize) {
            let x = frame.left + frame.width() * self.x.fraction(tick.value);
            canvas.line(&[(x, frame.top), (x, frame.bottom)], GRID, 0.8);
            canvas.text(&tick.text, (x, frame.bottom + 5.0), TICK_PX, INK, Anchor::Below);
        }
        for tick in self.y.ticks(6) {
            let y = frame.bottom - frame.height() * self.y.fraction(tick.value);
            canvas.line(&[(frame.left, y), (frame.right, y)], GRID, 0.8);
            canvas.text(&tick.text, (frame.left - 6.0, y), TICK_PX, INK, Anchor::End);
        }
    }

    fn draw_layer(&self, canvas: &mut Canvas<'_>, layer: &Layer) {
        let frame = self.frame;
        match layer {
            Layer::Line { points, look, .. } => self.stroke(canvas, points, *look),
            Layer::Points { points, look, .. } => {
                for at in points.iter().map(|p| self.place(*p)).filter(|p| frame.contains(*p)) {
                    draw_marker(canvas, at, *look);
                }
            }
            Layer::Band { edges, look, .. } => self.draw_band(canvas, edges, *look),
            Layer::ErrorBars { bars, look, .. } => self.draw_error_bars(canvas, bars, *look),
            Layer::Histogram { bars, look, .. } => self.draw_bars(canvas, bars, *look),
            Layer::Arrows { arrows, look, .. } => self.draw_arrows(canvas, arrows, *look),
            Layer::Vertical { x, look, .. } => {
                let at = self.place((*x, self.y.low)).0;
                self.stroke_px(canvas, &[(at, frame.top), (at, frame.bottom)], *look);
            }
            Layer::Horizontal { y, look, .. } => {
                let at = self.place((self.x.low, *y)).1;
                self.stroke_px(canvas, &[(frame.left, at), (frame.right, at)], *look);
            }
        }
    }

    /// A line in data units, dashed and cut at the frame.
    fn stroke(&self, canvas: &mut Canvas<'_>, points: &[(f64, f64)], look: Look) {
        let path: Vec<Point> = points.iter().map(|p| self.place(*p)).collect();
        self.stroke_px(canvas, &path, look);
    }

    fn stroke_px(&self, canvas: &mut Canvas<'_>, path: &[Point], look: Look) {
        for part in self.frame.clip_line(path) {
            for stroke in dashes(&part, look.dash.pattern()) {
                canvas.line(&stroke, look.colour, look.width_px);
            }
        }
    }

    fn draw_band(&self, canvas: &mut Canvas<'_>, edges: &[(f64, f64, f64)], look: Look) {
        let frame = self.frame;
        let clamp = |p: Point| (p.0.clamp(frame.left, frame.right), p.1.clamp(frame.top, frame.bottom));
        let lower = edges.iter().map(|e| self.place((e.0, e.1)));
        let upper = edges.iter().rev().map(|e| self.place((e.0, e.2)));
        let outline: Vec<Point> =
            lower.chain(upper).filter(|p| p.0.is_finite() && p.1.is_finite()).map(clamp).collect();
        if outline.len() > 2 {
            canvas.polygon(&outline, look.colour, 0.2);
        }
    }

    fn draw_error_bars(&self, canvas: &mut Canvas<'_>, bars: &[(f64, f64, f64)], look: Look) {
        let look = look.dash(Dash::Solid);
        for &(x, low, high) in bars {
            let (a, b) = (self.place((x, low)), self.place((x, high)));
            self.stroke_px(canvas, &[a, b], look);
            for end in [a, b] {
                self.stroke_px(canvas, &[(end.0 - 3.0, end.1), (end.0 + 3.0, end.1)], look);
            }
        }
    }

    fn draw_bars(&self, canvas: &mut Canvas<'_>, bars: &[(f64, f64, f64)], look: Look) {
        let frame = self.frame;
        for &(left, right, height) in bars {
            let (a, b) = (self.place((left, 0.0)), self.place((right, height)));
            let x = |x: f64| x.clamp(frame.left, frame.right);
            let y = |y: f64| if y.is_finite() { y.clamp(frame.top, frame.bottom) } else { frame.bottom };
            let (a, b) = ((x(a.0), y(a.1)), (x(b.0), y(b.1)));
            if height > 0.0 && b.0 > a.0 {
                let outline = [(a.0, a.1), (a.0, b.1), (b.0, b.1), (b.0, a.1)];
                canvas.polygon(&outline, look.colour, 0.35);
                canvas.line(&outline, look.colour, 0.8);
            }
        }
    }

    fn draw_arrows(&self, canvas: &mut Canvas<'_>, arrows: &[(f64, f64, f64, f64)], look: Look) {
        let look = look.dash(Dash::Solid).width(1.1);
        for &(x, y, dx, dy) in arrows {
            let (tail, tip) = (self.place((x, y)), self.place((x + dx, y + dy)));
            self.stroke_px(canvas, &[tail, tip], look);
            if let Some(head) = arrow_head(tail, tip, 4.5) {
                self.stroke_px(canvas, &head, look);
            }
        }
    }
}

/// Makes the span of the shorter direction longer, about its middle, until both have the same scale.
fn widen_to_equal_aspect(x: &mut Span, y: &mut Span, frame: Frame) {
    let per_px_x = (x.high - x.low) / frame.width();
    let per_px_y = (y.high - y.low) / frame.height();
    let widen = |span: &mut Span, length: f64| {
        let middle = 0.5 * (span.low + span.high);
        (span.low, span.high) = (middle - 0.5 * length, middle + 0.5 * length);
    };
    if per_px_x < per_px_y {
        widen(x, per_px_y * frame.width());
    } else {
        widen(y, per_px_x * frame.height());
    }
}
