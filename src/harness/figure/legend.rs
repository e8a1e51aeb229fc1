//! Which series is which? Samples with names, set in rows below the plot, where they cover no data.

use super::canvas::{Anchor, Canvas, text_width};
use super::colour::INK;
use super::mark::draw_sample;
use super::plot::Layer;

const TEXT_PX: f64 = 12.0;
const SAMPLE_PX: f64 = 28.0;
const GAP_PX: f64 = 16.0;
const ROW_PX: f64 = 18.0;

/// Entries broken into rows of at most `width` px.
fn rows(layers: &[Layer], width: f64) -> Vec<Vec<&Layer>> {
    let mut rows: Vec<Vec<&Layer>> = Vec::new();
    let mut used = 0.0;
    for layer in layers.iter().filter(|layer| !layer.label().is_empty()) {
        let entry = entry_width(layer);
        match rows.last_mut() {
            Some(row) if used + entry <= width => row.push(layer),
            _ => {
                rows.push(vec![layer]);
                used = 0.0;
            }
        }
        used += entry;
    }
    rows
}

fn entry_width(layer: &Layer) -> f64 {
    SAMPLE_PX + 5.0 + text_width(layer.label(), TEXT_PX) + GAP_PX
}

/// Height of the legend, px.
pub(super) fn height(layers: &[Layer], width: f64) -> f64 {
    ROW_PX * rows(layers, width).len() as f64
}

/// Draws the legend with its top-left corner at `(left, top)`.
pub(super) fn draw(canvas: &mut Canvas<'_>, layers: &[Layer], left: f64, top: f64, width: f64) {
    for (index, row) in rows(layers, width).into_iter().enumerate() {
        let y = top + ROW_PX * (index as f64 + 0.5);
        let mut x = left;
        for layer in row {
            draw_sample(canvas, layer, (x, y), SAMPLE_PX);
            canvas.text(layer.label(), (x + SAMPLE_PX + 5.0, y), TEXT_PX, INK, Anchor::Start);
            x += entry_width(layer);
        }
    }
}
