//! How are the residuals distributed? Against each other, and by their length.

use calibench_harness::figure::density;
use calibench_harness::{Figure, Look, Plot};
use nalgebra::Matrix2;

/// More points than these make a page slow and no clearer.
const MOST_POINTS: usize = 5000;

/// Bars of the histogram.
const BINS: usize = 24;

/// The circle that holds 95 % of normally distributed points, in standard deviations of a coordinate:
/// `sqrt(-2 ln 0.05)`.
const HOLDS_95: f64 = 2.447_746_830_680_816;

/// Residuals, each times its mark's weight, and the noise of a coordinate of them.
pub(super) struct Residuals {
    pub(super) all: Vec<(f64, f64)>,
    pub(super) sigma_px: f64,
    pub(super) is_weighted: bool,
}

impl Residuals {
    fn unit(&self) -> &'static str {
        if self.is_weighted { "px times weight" } else { "px" }
    }
}

/// Both figures; none of an exact fit.
pub(super) fn figures(residuals: &Residuals) -> Vec<Figure> {
    let lengths: Vec<f64> = residuals.all.iter().map(|r| libm::hypot(r.0, r.1)).collect();
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    let shown = longest > 0.0 && residuals.sigma_px > 0.0 && residuals.sigma_px.is_finite();
    if !shown {
        return Vec::new();
    }
    vec![scatter(residuals), histogram(residuals, &lengths, longest)]
}

fn scatter(residuals: &Residuals) -> Figure {
    let (all, sigma, unit) = (&residuals.all, residuals.sigma_px, residuals.unit());
    let every = all.len().div_ceil(MOST_POINTS).max(1);
    let points: Vec<(f64, f64)> = all.iter().step_by(every).copied().collect();
    let circle = Matrix2::identity() * (sigma * sigma);
    let plot = Plot::new(
        "Residuals, u against v",
        format!("u, predicted \u{2212} observed ({unit})"),
        format!("v ({unit})"),
    )
    .equal_aspect()
    .y_down()
    .hline_as("", 0.0, Look::ink().width(0.6))
    .vline_as("", 0.0, Look::ink().width(0.6))
    .cloud("a mark", &points, Look::series(0))
    .ellipse_as("95 % of normal noise", nalgebra::Vector2::zeros(), &circle, HOLDS_95, Look::series(1));
    let some = if every > 1 { format!(" Every {every}th mark is shown.") } else { String::new() };
    let caption = format!(
        "Residual of every mark, {unit}. Noise alone gives a round cloud about zero, 95 % of it in the circle; a cloud that is long, \
         split or off the middle tells of something else.{some}"
    );
    Figure::plot("scatter", &plot, caption)
}

fn histogram(residuals: &Residuals, lengths: &[f64], longest: f64) -> Figure {
    let (sigma, unit) = (residuals.sigma_px, residuals.unit());
    // The longest belongs to the last bar.
    let high = longest * (1.0 + 1e-9);
    let bars = density(lengths, (0.0, high), BINS);
    let rayleigh = |r: f64| r / (sigma * sigma) * libm::exp(-0.5 * r * r / (sigma * sigma));
    let curve: Vec<(f64, f64)> =
        (0..=200).map(|i| high * f64::from(i) / 200.0).map(|r| (r, rayleigh(r))).collect();
    let plot = Plot::new(
        "Lengths of the residuals",
        format!("length of a residual ({unit})"),
        format!("share of marks per {unit}"),
    )
    .histogram("marks", &bars)
    .line("normal noise", &curve);
    let caption = "Lengths of all residuals, and what normal noise of the estimated size would give (Rayleigh's distribution). Bars \
                   far to the right are outliers.";
    Figure::plot("histogram", &plot, caption)
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::calibrate::{Settings, calibrate_lens};
    use calibench::synth::{Scene, Stream, StreamKey};

    #[test]
    fn noise_is_shown_and_an_exact_fit_is_not() {
        let key = StreamKey { seed: 1, scenario: "scatter", trial: 0, purpose: "noise" };
        let views = Scene::example().observe(0.1, &mut Stream::open(key));
        let calibration = calibrate_lens(&views, &Settings::standard()).unwrap();
        let all = calibration.residuals.iter().flatten().map(|r| (r.x, r.y)).collect();
        let mut residuals = Residuals { all, sigma_px: calibration.sigma_px, is_weighted: false };
        assert_eq!(figures(&residuals).len(), 2);
        residuals.all.fill((0.0, 0.0));
        assert!(figures(&residuals).is_empty());
    }

    #[test]
    fn the_circle_holds_95_of_100_normal_points() {
        assert!((libm::exp(-0.5 * HOLDS_95 * HOLDS_95) - 0.05).abs() < 1e-12);
    }
}
