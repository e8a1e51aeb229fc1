//! How is a quantity over two others shown? Cells of a colour scale, with their values written in.

use super::axis::{Axis, Scale, Span};
use super::canvas::{Anchor, Canvas, Point, text_width};
use super::clip::Frame;
use super::colour::{INK, heat, text_on};
use calibench::io::significant;

/// A grid of values over two named lists of levels.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    label: String,
    columns: Vec<String>,
    rows: Vec<String>,
    values: Vec<f64>,
    logarithmic: bool,
    range: Option<(f64, f64)>,
    digits: usize,
    decimals: Option<usize>,
}

/// The values do not fill the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a heat map of {columns} columns and {rows} rows needs {} values, got {values}", columns * rows)]
pub struct HeatMapError {
    /// Levels along x.
    pub columns: usize,
    /// Levels along y.
    pub rows: usize,
    /// Values given.
    pub values: usize,
}

impl HeatMap {
    /// Values row by row, the first row at the bottom. `label` names the quantity with its unit.
    pub fn new(
        label: impl Into<String>,
        columns: Vec<String>,
        rows: Vec<String>,
        values: Vec<f64>,
    ) -> Result<HeatMap, HeatMapError> {
        if values.len() != columns.len() * rows.len() {
            return Err(HeatMapError { columns: columns.len(), rows: rows.len(), values: values.len() });
        }
        let label = label.into();
        Ok(HeatMap {
            label,
            columns,
            rows,
            values,
            logarithmic: false,
            range: None,
            digits: 2,
            decimals: None,
        })
    }

    /// Colours follow the logarithm; cells that are not positive stay blank.
    pub fn logarithmic(self) -> HeatMap {
        HeatMap { logarithmic: true, ..self }
    }

    /// Colours span this range instead of the values'.
    pub fn range(self, low: f64, high: f64) -> HeatMap {
        HeatMap { range: Some((low, high)), ..self }
    }

    /// Significant digits written in the cells.
    pub fn digits(self, digits: usize) -> HeatMap {
        HeatMap { digits, ..self }
    }

    /// Decimals written in the cells, the same in all, in the place of significant digits.
    pub fn decimals(self, decimals: usize) -> HeatMap {
        HeatMap { decimals: Some(decimals), ..self }
    }

    fn cell_text(&self, value: f64) -> String {
        let text = match self.decimals {
            Some(decimals) => format!("{value:.decimals$}"),
            None => significant(value, self.digits),
        };
        text.replace('-', "\u{2212}")
    }

    fn span(&self) -> Span {
        let mut axis = Axis::new("");
        axis.scale = if self.logarithmic { Scale::Log } else { Scale::Linear };
        let usable = |v: &f64| v.is_finite() && (!self.logarithmic || *v > 0.0);
        let (low, high) = self
            .values
            .iter()
            .copied()
            .filter(usable)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if self.range.is_some() || low < high {
            axis.fixed = self.range.or(Some((low, high)));
        }
        axis.span(self.values.iter().copied())
    }

    /// The cells with their values, and the levels along both axes.
    pub(super) fn draw_cells(&self, canvas: &mut Canvas<'_>, frame: Frame, text_px: f64) {
        let span = self.span();
        let (columns, rows) = (self.columns.len(), self.rows.len());
        let edge_x = |i: usize| frame.left + frame.width() * i as f64 / columns as f64;
        let edge_y = |j: usize| frame.bottom - frame.height() * j as f64 / rows as f64;
        for (index, &value) in self.values.iter().enumerate() {
            let (i, j) = (index % columns, index / columns);
            let fraction = span.fraction(value);
            let middle = (0.5 * (edge_x(i) + edge_x(i + 1)), 0.5 * (edge_y(j) + edge_y(j + 1)));
            if fraction.is_finite() {
                let colour = heat(fraction);
                canvas.rectangle((edge_x(i), edge_y(j + 1)), (edge_x(i + 1), edge_y(j)), colour);
                canvas.text(&self.cell_text(value), middle, text_px, text_on(colour), Anchor::Middle);
            } else {
                canvas.text("\u{2013}", middle, text_px, INK, Anchor::Middle);
            }
        }
        for (i, level) in self.columns.iter().enumerate() {
            let at = (0.5 * (edge_x(i) + edge_x(i + 1)), frame.bottom + 5.0);
            canvas.text(level, at, text_px, INK, Anchor::Below);
        }
        for (j, level) in self.rows.iter().enumerate() {
            let at = (frame.left - 6.0, 0.5 * (edge_y(j) + edge_y(j + 1)));
            canvas.text(level, at, text_px, INK, Anchor::End);
        }
    }

    /// The colour scale, to the right of the frame.
    pub(super) fn draw_scale(&self, canvas: &mut Canvas<'_>, frame: Frame, text_px: f64) {
        let span = self.span();
        let (left, right) = (frame.right + 14.0, frame.right + 28.0);
        const STEPS: usize = 64;
        let level = |k: usize| frame.bottom - frame.height() * k as f64 / STEPS as f64;
        for k in (0..STEPS).rev() {
            let colour = heat((k as f64 + 0.5) / STEPS as f64);
            // Drawn down to the foot, each over the last: no seam shows between the steps.
            canvas.rectangle((left, level(k + 1)), (right, level(0)), colour);
        }
        let ticks = span.ticks(5);
        let widest = ticks.iter().map(|t| text_width(&t.text, text_px)).fold(0.0, f64::max);
        for tick in ticks {
            let y = frame.bottom - frame.height() * span.fraction(tick.value);
            let mark: [Point; 2] = [(right, y), (right + 4.0, y)];
            canvas.line(&mark, INK, 1.0);
            canvas.text(&tick.text, (right + 6.0, y), text_px, INK, Anchor::Start);
        }
        canvas.text(
            &self.label,
            (right + widest + 17.0, 0.5 * (frame.top + frame.bottom)),
            text_px + 1.0,
            INK,
            Anchor::Upwards,
        );
    }

    /// Longest name of a row.
    pub(super) fn rows(&self) -> &[String] {
        &self.rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heat_map_must_be_filled() {
        let levels = |n: usize| (0..n).map(|i| i.to_string()).collect::<Vec<_>>();
        let error = HeatMap::new("q", levels(3), levels(2), vec![0.0; 5]).unwrap_err();
        assert_eq!(error, HeatMapError { columns: 3, rows: 2, values: 5 });
        assert!(HeatMap::new("q", levels(3), levels(2), vec![0.0; 6]).is_ok());
    }
}
