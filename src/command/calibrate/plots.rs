//! What does a calibration look like? Residuals over the frame, view by view, and the lens with its
//! uncertainty.

use calibench::calibrate::LensCalibration;
use calibench::camera::{Camera, Parameter};
use calibench::geometry::{Vec2, Vec3};
use calibench_harness::{Figure, Look, Plot};

/// The figures of a calibration from marks at these pixels, view after view.
pub(super) fn figures(
    calibration: &LensCalibration,
    pixels: &[Vec2],
    numbers: &[usize],
    image_size: Option<(usize, usize)>,
) -> Vec<Figure> {
    vec![
        residuals(calibration, pixels, image_size),
        view_errors(calibration, numbers),
        lens(calibration, pixels),
    ]
}

/// Residuals as arrows where they were seen.
fn residuals(calibration: &LensCalibration, pixels: &[Vec2], image_size: Option<(usize, usize)>) -> Figure {
    let residuals = || calibration.residuals.iter().flatten();
    let extent = pixels.iter().fold(0.0f64, |m, p| m.max(p.x).max(p.y));
    // The longest arrow takes a twentieth of the frame; a round factor is easier to undo by eye.
    let longest = residuals().map(|r| r.norm()).fold(f64::MIN_POSITIVE, f64::max);
    let factor = round_down(extent / 20.0 / longest);
    let arrows: Vec<(f64, f64, f64, f64)> =
        pixels.iter().zip(residuals()).map(|(p, r)| (p.x, p.y, factor * r.x, factor * r.y)).collect();
    let title = format!("Residuals, predicted \u{2212} observed, {factor} times enlarged");
    let mut plot = Plot::new(title, "u (px)", "v (px)").equal_aspect().y_down();
    if let Some((width, height)) = image_size {
        let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
        let border = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom), (-0.5, -0.5)];
        plot = plot.line_as("", border, Look::ink());
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

/// An axis shorter than this has ticks between whole numbers.
const WHOLE_TICKS_FROM: f64 = 6.5;

/// The end of an axis that counts from one number to another: so long that its ticks are whole numbers.
pub(super) fn whole_ticks(first: f64, last: f64) -> f64 {
    (last + 0.5).max(first - 0.5 + WHOLE_TICKS_FROM)
}

/// RMSE of each view, by its number, against that of all; without the marks' weights, as in the table.
fn view_errors(calibration: &LensCalibration, numbers: &[usize]) -> Figure {
    let error = |(i, &number): (usize, &usize)| Some((number as f64, calibration.view_rmse_px(i)?));
    let points: Vec<(f64, f64)> = numbers.iter().enumerate().filter_map(error).collect();
    let ends = |start: f64, end: fn(f64, f64) -> f64| points.iter().map(|p| p.0).fold(start, end);
    let (first, last) = (ends(f64::INFINITY, f64::min), ends(f64::NEG_INFINITY, f64::max));
    let of_all = calibration.rms_per_axis_px().norm();
    let top = 1.15 * points.iter().map(|p| p.1).fold(of_all, f64::max);
    let plot = Plot::new("Reprojection error of each view", "number of the view", "RMSE per point (px)")
        .points("view", &points)
        .hline("all views", of_all)
        .x_range(first - 0.5, whole_ticks(first, last))
        .y_range(0.0, top);
    Figure::plot(
        "views",
        &plot,
        "RMSE per point of each view, px, by its number in the table of views. A view far above the rest deserves a look.",
    )
}

/// The radius at which the lens shows an angle, against that of a pinhole or, where it sees far to the side,
/// of an equidistant lens; with its standard deviation, out to the farthest point seen.
fn lens(calibration: &LensCalibration, pixels: &[Vec2]) -> Figure {
    let camera = &calibration.camera;
    let angles =
        pixels.iter().filter_map(|p| camera.ray(p).ok()).map(|ray| libm::atan2(ray.xy().norm(), ray.z));
    let farthest = angles.fold(0.0, f64::max);
    let is_wide = camera.distortion.model().sees_behind();
    let (reference, name) = if is_wide { (farthest, "equidistant") } else { (libm::tan(farthest), "ideal") };
    let focal = 0.5 * (camera.fx + camera.fy);
    let at = |i: u32| {
        let r = reference * f64::from(i) / 100.0;
        let angle = if is_wide { r } else { libm::atan(r) };
        let seen = camera.distortion.project(&Vec3::new(libm::sin(angle), 0.0, libm::cos(angle)))?;
        Some((focal * r, focal * (seen.x - r), 2.0 * focal * radial_deviation(calibration, angle)))
    };
    let nodes: Vec<(f64, f64, f64)> = (0..=100).filter_map(at).collect();
    let curve: Vec<(f64, f64)> = nodes.iter().map(|&(r, shift, _)| (r, shift)).collect();
    let band: Vec<(f64, f64, f64)> =
        nodes.iter().map(|&(r, shift, sd)| (r, shift - sd, shift + sd)).collect();
    let radial = radial_names(calibration).join(", ");
    let x = match is_wide {
        true => "undistorted radius, angle from the axis \u{d7} focal length (px)",
        false => "undistorted radius (px)",
    };
    let plot = Plot::new("Displacement by the lens", x, "outward (px)")
        .band(format!("\u{b1}2 standard deviations ({radial})"), &band)
        .line("radial displacement", &curve)
        .hline("", 0.0);
    let caption = format!(
        "Radial displacement against an {name} lens out to the farthest point seen, px, tangential terms left out. Undistorted radius: \
         where the {name} lens shows the point, from the principal point. Beyond the curve's end the model is extrapolated."
    );
    Figure::plot("lens", &plot, caption)
}

/// Coefficients that bend an image radially.
fn is_radial(parameter: Parameter) -> bool {
    use Parameter::{Alpha, K1, K2, K3, K4, K5, K6, Xi};
    matches!(parameter, K1 | K2 | K3 | K4 | K5 | K6 | Xi | Alpha)
}

/// The names of the radial coefficients of the model.
fn radial_names(calibration: &LensCalibration) -> Vec<&'static str> {
    let coefficients = calibration.camera.distortion.model().coefficients();
    coefficients.iter().filter(|p| is_radial(**p)).map(|p| p.name()).collect()
}

/// Standard deviation of the distorted radius at an angle from the axis, from the radial coefficients'
/// covariance.
fn radial_deviation(calibration: &LensCalibration, angle: f64) -> f64 {
    let plain = Camera { cx: 0.0, cy: 0.0, fx: 1.0, fy: 1.0, skew: 0.0, ..calibration.camera };
    let point = Vec3::new(libm::sin(angle), 0.0, libm::cos(angle));
    let Some(at) = plain.pixel_with_derivatives(&point) else { return f64::NAN };
    let radial: Vec<(Parameter, Vec2)> =
        at.by_parameters.into_iter().filter(|(p, _)| is_radial(*p)).collect();
    calibration.covariance.largest_spread(&radial)
}
