//! How is something explained that is no plot? A sheet of lines, areas, arrows, marks, boxes and words.

use super::canvas::{self, Anchor, Canvas, text_width};
use super::clip::dashes;
use super::colour::{Dash, INK, Look, PAPER};
use super::mark::{draw_arrow, draw_marker};

const TEXT_PX: f64 = 12.5;
const HEADING_PX: f64 = 14.0;
const ROW_PX: f64 = 17.0;
/// Room between the edge of a box and its words.
const PADDING_PX: f64 = 9.0;

/// A point of the sheet, px, y down.
pub type At = (f64, f64);

/// Where words hang on their point; they are centred in height.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// They begin there.
    Start,
    /// They are centred there.
    Middle,
    /// They end there.
    End,
}

impl Align {
    fn anchor(self) -> Anchor {
        match self {
            Align::Start => Anchor::Start,
            Align::Middle => Anchor::Middle,
            Align::End => Anchor::End,
        }
    }

    /// How much of the words' length lies before their point.
    fn share_before(self) -> f64 {
        match self {
            Align::Start => 0.0,
            Align::Middle => 0.5,
            Align::End => 1.0,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Stroke {
    Line { points: Vec<At>, look: Look },
    Area { corners: Vec<At>, look: Look, alpha: f64 },
    Arrow { tail: At, tip: At, look: Look },
    Mark { at: At, look: Look },
    Words { text: String, at: At, align: Align, size_px: f64 },
}

/// A picture in pixels of its own sheet, drawn in the order of the calls.
///
/// ```
/// use calibench_harness::{Align, Drawing, Figure, Look};
///
/// let drawing = Drawing::new(200.0, 80.0)
///     .boxed((10.0, 10.0), 80.0, "truth", &["a camera", "and poses"], Look::series(0))
///     .arrow((90.0, 40.0), (150.0, 40.0), Look::ink())
///     .words("views", (160.0, 40.0), Align::Start);
/// assert_eq!(Figure::drawing("flow", &drawing, "What goes where.").file_name(), "flow.svg");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    size: (f64, f64),
    strokes: Vec<Stroke>,
}

impl Drawing {
    /// An empty sheet, px.
    pub fn new(width_px: f64, height_px: f64) -> Drawing {
        Drawing { size: (width_px, height_px), strokes: Vec::new() }
    }

    fn with(mut self, stroke: Stroke) -> Drawing {
        self.strokes.push(stroke);
        self
    }

    /// A line through points, in their order.
    pub fn line(self, points: impl IntoIterator<Item = At>, look: Look) -> Drawing {
        self.with(Stroke::Line { points: points.into_iter().collect(), look })
    }

    /// A filled polygon, as opaque as `alpha` says.
    pub fn area(self, corners: impl IntoIterator<Item = At>, look: Look, alpha: f64) -> Drawing {
        self.with(Stroke::Area { corners: corners.into_iter().collect(), look, alpha })
    }

    /// A line with a head at its end.
    pub fn arrow(self, tail: At, tip: At, look: Look) -> Drawing {
        self.with(Stroke::Arrow { tail, tip, look })
    }

    /// A marker.
    pub fn mark(self, at: At, look: Look) -> Drawing {
        self.with(Stroke::Mark { at, look })
    }

    /// One line of words.
    pub fn words(self, text: impl Into<String>, at: At, align: Align) -> Drawing {
        self.with(Stroke::Words { text: text.into(), at, align, size_px: TEXT_PX })
    }

    /// One line of larger words.
    pub fn heading(self, text: impl Into<String>, at: At, align: Align) -> Drawing {
        self.with(Stroke::Words { text: text.into(), at, align, size_px: HEADING_PX })
    }

    /// A box with a heading and rows of words below it; as high as they need, see [`Drawing::box_height`].
    pub fn boxed(
        self,
        (left, top): At,
        width: f64,
        heading: impl Into<String>,
        rows: &[impl AsRef<str>],
        look: Look,
    ) -> Drawing {
        let (right, bottom) = (left + width, top + Drawing::box_height(rows.len()));
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
        let row_at = |k: usize| (left + PADDING_PX, top + PADDING_PX + ROW_PX * (k as f64 + 0.5));
        let framed = self
            .area(corners, look, 0.12)
            .line(corners.into_iter().chain([(left, top)]), look.dash(Dash::Solid))
            .heading(heading, row_at(0), Align::Start);
        let rows = rows.iter().enumerate();
        rows.fold(framed, |drawing, (k, row)| drawing.words(row.as_ref(), row_at(k + 1), Align::Start))
    }

    /// Height of a box with so many rows below its heading, px.
    pub fn box_height(rows: usize) -> f64 {
        2.0 * PADDING_PX + ROW_PX * (rows as f64 + 1.0)
    }

    /// The SVG.
    pub(super) fn svg(&self, caption: &str) -> String {
        let (width, height) = self.size;
        canvas::draw(width, height, caption, |canvas| {
            canvas.rectangle((0.0, 0.0), self.size, PAPER);
            self.strokes.iter().for_each(|stroke| stroke.draw(canvas));
        })
    }

    /// Words that run over the edge of the sheet: a mistake of whoever draws.
    pub(super) fn words_beyond_the_sheet(&self) -> Vec<&str> {
        let (width, height) = self.size;
        let beyond = self.strokes.iter().filter_map(|stroke| {
            let Stroke::Words { text, at, align, size_px } = stroke else { return None };
            let length = text_width(text, *size_px);
            let left = at.0 - align.share_before() * length;
            let half = 0.5 * size_px;
            let runs_over = left < 0.0 || left + length > width || at.1 < half || at.1 + half > height;
            runs_over.then_some(text.as_str())
        });
        beyond.collect()
    }
}

impl Stroke {
    fn draw(&self, canvas: &mut Canvas<'_>) {
        match self {
            Stroke::Line { points, look } => {
                for stroke in dashes(points, look.dash.pattern()) {
                    canvas.line(&stroke, look.colour, look.width_px);
                }
            }
            Stroke::Area { corners, look, alpha } => canvas.polygon(corners, look.colour, *alpha),
            Stroke::Arrow { tail, tip, look } => draw_arrow(canvas, *tail, *tip, *look),
            Stroke::Mark { at, look } => draw_marker(canvas, *at, *look),
            Stroke::Words { text, at, align, size_px } => {
                canvas.text(text, *at, *size_px, INK, align.anchor());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_is_svg_with_its_words_in_the_order_of_the_calls() {
        let drawing = Drawing::new(120.0, 60.0).words("first <one>", (5.0, 10.0), Align::Start).boxed(
            (5.0, 20.0),
            100.0,
            "second",
            &[] as &[&str],
            Look::ink(),
        );
        let svg = drawing.svg("what it shows");
        let place = |words| svg.find(words).expect("the words are in the SVG");
        assert!(place("first &lt;one&gt;") < place("second"));
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(drawing.words_beyond_the_sheet().is_empty());
    }

    #[test]
    fn words_that_run_over_the_edge_are_named() {
        let drawing = Drawing::new(60.0, 30.0)
            .words("far too long for it", (5.0, 15.0), Align::Start)
            .words("in", (55.0, 15.0), Align::End)
            .words("low", (5.0, 29.0), Align::Start);
        assert_eq!(drawing.words_beyond_the_sheet(), ["far too long for it", "low"]);
    }
}
