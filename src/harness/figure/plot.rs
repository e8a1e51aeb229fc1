//! What is in a plot? A list of layers over two axes, told in the order in which they are drawn.

use super::axis::{Axis, Scale};
use super::colour::{Dash, Look, Marker};
use super::heat::HeatMap;
use calibench::geometry::Vec2;
use nalgebra::Matrix2;
use std::borrow::Borrow;

/// One layer; an empty label keeps it out of the legend.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Layer {
    Line {
        label: String,
        points: Vec<(f64, f64)>,
        look: Look,
    },
    Points {
        label: String,
        points: Vec<(f64, f64)>,
        look: Look,
    },
    /// `(x, low, high)`.
    Band {
        label: String,
        edges: Vec<(f64, f64, f64)>,
        look: Look,
    },
    /// `(x, low, high)`: a bar with caps at both ends.
    ErrorBars {
        label: String,
        bars: Vec<(f64, f64, f64)>,
        look: Look,
    },
    /// `(left, right, height)`.
    Histogram {
        label: String,
        bars: Vec<(f64, f64, f64)>,
        look: Look,
    },
    /// `(x, y, dx, dy)`, data units.
    Arrows {
        label: String,
        arrows: Vec<(f64, f64, f64, f64)>,
        look: Look,
    },
    Vertical {
        label: String,
        x: f64,
        look: Look,
    },
    Horizontal {
        label: String,
        y: f64,
        look: Look,
    },
}

impl Layer {
    pub(super) fn label(&self) -> &str {
        match self {
            Layer::Line { label, .. }
            | Layer::Points { label, .. }
            | Layer::Band { label, .. }
            | Layer::ErrorBars { label, .. }
            | Layer::Histogram { label, .. }
            | Layer::Arrows { label, .. }
            | Layer::Vertical { label, .. }
            | Layer::Horizontal { label, .. } => label,
        }
    }

    /// The corners that the axes must hold.
    pub(super) fn extent(&self) -> Vec<(f64, f64)> {
        let both_ends = |&(x, low, high): &(f64, f64, f64)| [(x, low), (x, high)];
        match self {
            Layer::Line { points, .. } | Layer::Points { points, .. } => points.clone(),
            Layer::Band { edges, .. } => edges.iter().flat_map(both_ends).collect(),
            Layer::ErrorBars { bars, .. } => bars.iter().flat_map(both_ends).collect(),
            Layer::Histogram { bars, .. } => bars.iter().flat_map(|b| [(b.0, 0.0), (b.1, b.2)]).collect(),
            Layer::Arrows { arrows, .. } => {
                arrows.iter().flat_map(|a| [(a.0, a.1), (a.0 + a.2, a.1 + a.3)]).collect()
            }
            // NaN does not count when the axis is fitted.
            Layer::Vertical { x, .. } => vec![(*x, f64::NAN)],
            Layer::Horizontal { y, .. } => vec![(f64::NAN, *y)],
        }
    }
}

/// A plot. Every call adds one layer; series look different from one another unless a [`Look`] is given.
///
/// ```
/// use calibench_harness::{Figure, Look, Plot};
///
/// let measured = [(1.0, 0.52), (2.0, 0.27), (4.0, 0.12)];
/// let law: Vec<(f64, f64)> = measured.iter().map(|(n, _)| (*n, 0.5 / n)).collect();
/// let plot = Plot::new("Spread against views", "views", "sd (px)")
///     .log_x()
///     .log_y()
///     .line_as("1/n", &law, Look::ink())
///     .points("measured", &measured);
/// let figure = Figure::plot("spread", &plot, "Three sets of views; notice the slope.");
/// assert_eq!(figure.file_name(), "spread.svg");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    pub(super) title: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) layers: Vec<Layer>,
    pub(super) heat: Option<HeatMap>,
    pub(super) equal_aspect: bool,
    pub(super) size: (f64, f64),
    series: usize,
}

/// The items of a slice or of an iterator.
fn all<P: Copy>(items: impl IntoIterator<Item: Borrow<P>>) -> Vec<P> {
    items.into_iter().map(|item| *item.borrow()).collect()
}

impl Plot {
    /// An empty plot of 560 x 400 px. Axis labels carry their unit: `u (px)`.
    pub fn new(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Plot {
        Plot {
            title: title.into(),
            x: Axis::new(x_label),
            y: Axis::new(y_label),
            layers: Vec::new(),
            heat: None,
            equal_aspect: false,
            size: (560.0, 400.0),
            series: 0,
        }
    }

    /// A heat map; its levels take the place of the ticks.
    pub fn heat_map(
        title: impl Into<String>,
        x_label: impl Into<String>,
        y_label: impl Into<String>,
        heat: HeatMap,
    ) -> Plot {
        Plot { heat: Some(heat), ..Plot::new(title, x_label, y_label) }
    }

    /// The look of the next series.
    fn next_look(&mut self) -> Look {
        self.series += 1;
        Look::series(self.series - 1)
    }

    fn with(mut self, layer: Layer) -> Plot {
        self.layers.push(layer);
        self
    }

    /// A line through points, in their order. A point that is not finite interrupts it.
    pub fn line(
        mut self,
        label: impl Into<String>,
        points: impl IntoIterator<Item: Borrow<(f64, f64)>>,
    ) -> Plot {
        let look = self.next_look();
        self.line_as(label, points, look)
    }

    /// A line of a given look.
    pub fn line_as(
        self,
        label: impl Into<String>,
        points: impl IntoIterator<Item: Borrow<(f64, f64)>>,
        look: Look,
    ) -> Plot {
        self.with(Layer::Line { label: label.into(), points: all(points), look })
    }

    /// Markers.
    pub fn points(
        mut self,
        label: impl Into<String>,
        points: impl IntoIterator<Item: Borrow<(f64, f64)>>,
    ) -> Plot {
        let look = self.next_look();
        self.points_as(label, points, look)
    }

    /// Markers of a given look.
    pub fn points_as(
        self,
        label: impl Into<String>,
        points: impl IntoIterator<Item: Borrow<(f64, f64)>>,
        look: Look,
    ) -> Plot {
        self.with(Layer::Points { label: label.into(), points: all(points), look })
    }

    /// A shaded band between `(x, low, high)`.
    pub fn band(
        mut self,
        label: impl Into<String>,
        edges: impl IntoIterator<Item: Borrow<(f64, f64, f64)>>,
    ) -> Plot {
        let look = self.next_look();
        self.band_as(label, edges, look)
    }

    /// A shaded band of a given look.
    pub fn band_as(
        self,
        label: impl Into<String>,
        edges: impl IntoIterator<Item: Borrow<(f64, f64, f64)>>,
        look: Look,
    ) -> Plot {
        self.with(Layer::Band { label: label.into(), edges: all(edges), look })
    }

    /// Intervals `(x, low, high)`, each a bar with caps.
    pub fn error_bars_as(
        self,
        label: impl Into<String>,
        bars: impl IntoIterator<Item: Borrow<(f64, f64, f64)>>,
        look: Look,
    ) -> Plot {
        self.with(Layer::ErrorBars { label: label.into(), bars: all(bars), look })
    }

    /// Markers with their intervals, `(x, value, low, high)` each.
    pub fn measured_as(
        self,
        label: impl Into<String>,
        measured: impl IntoIterator<Item = (f64, f64, f64, f64)>,
        look: Look,
    ) -> Plot {
        let measured: Vec<_> = measured.into_iter().collect();
        self.error_bars_as("", measured.iter().map(|&(x, _, low, high)| (x, low, high)), look).points_as(
            label,
            measured.iter().map(|&(x, value, ..)| (x, value)),
            look,
        )
    }

    /// Bars `(left, right, height)` from zero.
    pub fn histogram(
        mut self,
        label: impl Into<String>,
        bars: impl IntoIterator<Item: Borrow<(f64, f64, f64)>>,
    ) -> Plot {
        let look = self.next_look();
        self.with(Layer::Histogram { label: label.into(), bars: all(bars), look })
    }

    /// Arrows `(x, y, dx, dy)` in data units; enlarge `dx, dy` beforehand and say so in the label.
    pub fn arrows(
        mut self,
        label: impl Into<String>,
        arrows: impl IntoIterator<Item: Borrow<(f64, f64, f64, f64)>>,
    ) -> Plot {
        let look = self.next_look();
        self.with(Layer::Arrows { label: label.into(), arrows: all(arrows), look })
    }

    /// The curve `(x - centre)' covariance^-1 (x - centre) = scale^2`. With `scale^2 = -2 ln(1 - p)` it holds
    /// a normal draw with probability `p`: 2.4477 for 95 %. A matrix that is no covariance draws nothing.
    pub fn ellipse(
        mut self,
        label: impl Into<String>,
        centre: Vec2,
        covariance: &Matrix2<f64>,
        scale: f64,
    ) -> Plot {
        let look = self.next_look();
        self.ellipse_as(label, centre, covariance, scale, look)
    }

    /// The same curve in a given look.
    pub fn ellipse_as(
        self,
        label: impl Into<String>,
        centre: Vec2,
        covariance: &Matrix2<f64>,
        scale: f64,
        look: Look,
    ) -> Plot {
        self.line_as(label, ellipse_points(centre, covariance, scale), look)
    }

    /// A vertical line across the plot.
    pub fn vline(self, label: impl Into<String>, x: f64) -> Plot {
        self.vline_as(label, x, Look::ink().dash(Dash::Dashed))
    }

    /// A vertical line of a given look.
    pub fn vline_as(self, label: impl Into<String>, x: f64, look: Look) -> Plot {
        self.with(Layer::Vertical { label: label.into(), x, look })
    }

    /// A horizontal line across the plot.
    pub fn hline(self, label: impl Into<String>, y: f64) -> Plot {
        self.hline_as(label, y, Look::ink().dash(Dash::Dashed))
    }

    /// A horizontal line of a given look.
    pub fn hline_as(self, label: impl Into<String>, y: f64, look: Look) -> Plot {
        self.with(Layer::Horizontal { label: label.into(), y, look })
    }

    /// A small marker for each of many trials.
    pub fn cloud(
        self,
        label: impl Into<String>,
        points: impl IntoIterator<Item: Borrow<(f64, f64)>>,
        look: Look,
    ) -> Plot {
        self.points_as(label, points, look.marker(Marker::Dot).size(1.2))
    }

    /// A logarithmic x axis; values that are not positive are left out.
    pub fn log_x(mut self) -> Plot {
        self.x.scale = Scale::Log;
        self
    }

    /// A logarithmic y axis; values that are not positive are left out.
    pub fn log_y(mut self) -> Plot {
        self.y.scale = Scale::Log;
        self
    }

    /// The range of x that is shown; lines are cut at its ends.
    pub fn x_range(mut self, low: f64, high: f64) -> Plot {
        self.x.fixed = Some((low, high));
        self
    }

    /// The range of y that is shown; lines are cut at its ends.
    pub fn y_range(mut self, low: f64, high: f64) -> Plot {
        self.y.fixed = Some((low, high));
        self
    }

    /// y grows downwards, as image rows do.
    pub fn y_down(mut self) -> Plot {
        self.y.reversed = true;
        self
    }

    /// One unit of x is as long as one of y. For linear axes.
    pub fn equal_aspect(mut self) -> Plot {
        self.equal_aspect = true;
        self
    }

    /// Width and height of the whole figure or panel, px, legend included.
    pub fn size(mut self, width_px: f64, height_px: f64) -> Plot {
        self.size = (width_px, height_px);
        self
    }
}

/// 129 points of the ellipse, by the Cholesky factor of the covariance; none if it has none.
fn ellipse_points(centre: Vec2, covariance: &Matrix2<f64>, scale: f64) -> Vec<(f64, f64)> {
    let Some(factor) = covariance.cholesky() else { return Vec::new() };
    (0..=128)
        .map(|k| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(k) / 128.0);
            let point = centre + factor.l() * Vec2::new(cos, sin) * scale;
            (point.x, point.y)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_of_an_ellipse_lies_at_the_stated_mahalanobis_distance() {
        let covariance = Matrix2::new(4.0, -1.5, -1.5, 1.0);
        let centre = Vec2::new(3.0, -2.0);
        let inverse = covariance.try_inverse().unwrap();
        let points = ellipse_points(centre, &covariance, 2.5);
        assert_eq!(points.len(), 129);
        for (x, y) in points {
            let d = Vec2::new(x, y) - centre;
            assert!(((d.transpose() * inverse * d)[0].sqrt() - 2.5).abs() < 1e-12);
        }
        assert!(ellipse_points(centre, &Matrix2::new(1.0, 2.0, 2.0, 1.0), 1.0).is_empty());
    }
}
