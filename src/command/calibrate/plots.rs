//! What does a calibration look like? Residuals over the frame, view by view, and the lens with its
//! uncertainty.

use calibench::board::View;
use calibench::calibrate::Calibration;
use calibench::camera::Parameter;
use calibench::geometry::Vec2;
use calibench_harness::{Figure, Look, Plot};

/// The figures of a calibration.
pub(super) fn figures(
    calibration: &Calibration,
    views: &[View],
    image_size: Option<(usize, usize)>,
) -> Vec<Figure> {
    vec![residuals(calibration, views, image_size), view_errors(calibration), lens(calibration, views)]
}

/// Residuals as arrows where they were seen.
fn residuals(calibration: &Calibration, views: &[View], image_size: Option<(usize, usize)>) -> Figure {
    let pixels = || views.iter().flat_map(|v| v.pixels());
    let residuals = || calibration.residuals.iter().flatten();
    let extent = pixels().fold(0.0f64, |m, p| m.max(p.x).max(p.y));
    // The longest arrow takes a twentieth of the frame; a round factor is easier to undo by eye.
    let longest = residuals().map(|r| r.norm()).fold(f64::MIN_POSITIVE, f64::max);
    let factor = round_down(extent / 20.0 / longest);
    let arrows: Vec<(f64, f64, f64, f64)> =
        pixels().zip(residuals()).map(|(p, r)| (p.x, p.y, factor * r.x, factor * r.y)).collect();
    let title = format!("Residuals, predicted \u{2212} observed, {factor} times enlarged");
    let mut plot = Plot::new(title, "u (px)", "v (px)").equal_aspect().y_down();
    if let Some((width, height)) = image_size {
        let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
        let border = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom), (-0.5, -0.5)];
        plot = plot.line_as("", &border, Look::ink());
    }
    let caption = "Residual of every point where it was seen, px. Arrows that point the same way in a region show that the \
                   model misses something there.";
    Figure::plot("residuals", &plot.arrows("", &arrows), caption)
}

/// The largest of 1, 2, 5 times a power of ten that is not larger.
pub(crate) fn round_down(x: f64) -> f64 {
    let power = libm::exp10(libm::floor(libm::log10(x)));
    [5.0, 2.0, 1.0].map(|m| m * power).into_iter().find(|&m| m <= x).unwrap_or(power)
}

/// RMSE of each view against that of all.
fn view_errors(calibration: &Calibration) -> Figure {
    let points: Vec<(f64, f64)> = (0..calibration.residuals.len())
        .filter_map(|i| Some((i as f64 + 1.0, calibration.view_rmse_px(i)?)))
        .collect();
    let top = 1.15 * points.iter().map(|p| p.1).fold(calibration.rmse_px, f64::max);
    let plot = Plot::new("Reprojection error of each view", "view", "RMSE per point (px)")
        .points("view", &points)
        .hline("all views", calibration.rmse_px)
        .x_range(0.5, points.len() as f64 + 0.5)
        .y_range(0.0, top);
    Figure::plot(
        "views",
        &plot,
        "RMSE per point of each view, px. A view far above the rest deserves a look.",
    )
}

/// Radial displacement by the lens with its standard deviation, out to the farthest point seen.
fn lens(calibration: &Calibration, views: &[View]) -> Figure {
    let camera = &calibration.camera;
    let farthest = views
        .iter()
        .flat_map(|v| v.pixels())
        .filter_map(|p| camera.normalised_ray(p).ok())
        .map(|ray| ray.norm())
        .fold(0.0, f64::max);
    let focal = 0.5 * (camera.fx + camera.fy);
    let nodes = || (0..=100).map(|i| farthest * f64::from(i) / 100.0);
    let shift = |r: f64| focal * (camera.distortion.distort(&Vec2::new(r, 0.0)).x - r);
    let curve: Vec<(f64, f64)> = nodes().map(|r| (focal * r, shift(r))).collect();
    let band: Vec<(f64, f64, f64)> = nodes()
        .map(|r| {
            let sd = 2.0 * focal * radial_deviation(calibration, r);
            (focal * r, shift(r) - sd, shift(r) + sd)
        })
        .collect();
    let plot =
        Plot::new("Displacement by the lens", "distance from the principal point (px)", "outward (px)")
            .band("\u{b1}2 standard deviations (k1, k2, k3)", &band)
            .line("radial displacement", &curve)
            .hline("", 0.0);
    let caption = "Radial displacement out to the farthest point seen, px, tangential terms left out. Beyond that radius the \
                   model is extrapolated.";
    Figure::plot("lens", &plot, caption)
}

/// Standard deviation of `r (k1 r^2 + k2 r^4 + k3 r^6)` from the coefficients' covariance.
fn radial_deviation(calibration: &Calibration, r: f64) -> f64 {
    let s = r * r;
    let slopes = [(Parameter::K1, r * s), (Parameter::K2, r * s * s), (Parameter::K3, r * s * s * s)];
    let free: Vec<(usize, f64)> =
        slopes.into_iter().filter_map(|(p, slope)| Some((calibration.free.position(p)?, slope))).collect();
    let covariance = &calibration.covariance.intrinsics;
    let variance: f64 =
        free.iter().flat_map(|&(i, a)| free.iter().map(move |&(j, b)| a * b * covariance[(i, j)])).sum();
    variance.max(0.0).sqrt()
}
