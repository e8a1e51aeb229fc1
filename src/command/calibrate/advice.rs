//! What would make the next calibration better? Gaps in the data, with the numbers that show them and what to
//! do.

use super::maps::{Cells, corner_radius_px, pixel_deviation};
use calibench::calibrate::{LensCalibration, Loss};
use calibench::camera::Parameter;
use calibench::geometry::{Vec2, Vec3};
use calibench::io::significant;
use calibench::photos::Fit;

/// Points that end before this part of the corner radius leave half of the image's area without any, and the
/// highest radial term less than a fifth of its effect in the corner (0.7^5 = 0.17).
const RADIUS_COVERED: f64 = 0.7;

/// Part of the frame's cells that may be empty before it is worth a word.
const EMPTY_CELLS: f64 = 0.4;

/// Boards turned by less than this against each other hardly tell focal length from distance: its standard
/// deviation falls with the sine of the angle (Zhang 2000, section 5, finds 45 degrees best).
const LEAST_TILT_DEGREES: f64 = 15.0;

/// A view this many times worse than the median deserves a look.
const STANDS_OUT: f64 = 2.0;

/// Advice on a fit; what concerns the frame needs its size.
pub(super) fn of(fit: &Fit, names: &[String], image_size: Option<(usize, usize)>, loss: Loss) -> Vec<String> {
    let mut advice = Vec::new();
    if let Some(size) = image_size {
        advice.extend(radius(fit, size));
        advice.extend(empty_cells(fit, size));
        advice.extend(corner_deviation(&fit.calibration, size));
    }
    advice.extend(tilt(&fit.calibration));
    advice.extend(standing_out(&fit.calibration, names, loss));
    advice
}

/// The highest radial term that was estimated.
fn highest_radial(calibration: &LensCalibration) -> Option<Parameter> {
    use Parameter::{K1, K2, K3, K4, K5, K6};
    [K6, K5, K4, K3, K2, K1].into_iter().find(|&k| calibration.free.contains(k))
}

fn radius(fit: &Fit, size: (usize, usize)) -> Option<String> {
    let camera = &fit.calibration.camera;
    let corner = corner_radius_px(camera, size);
    let centre = Vec2::new(camera.cx, camera.cy);
    let pixels = || fit.views.iter().flat_map(|view| view.pixels()).map(|p| (p - centre).norm() / corner);
    let farthest = pixels().fold(0.0, f64::max);
    let term = highest_radial(&fit.calibration)?;
    if farthest >= RADIUS_COVERED {
        return None;
    }
    let outer = pixels().filter(|&r| r > 0.9 * farthest).count();
    Some(format!(
        "no points beyond {:.0} % of the corner radius (farthest at {:.0} %): {term} is carried by the {outer} outermost points, \
         and the lens model is extrapolated beyond them; bring the board into the corners of the image",
        100.0 * RADIUS_COVERED,
        100.0 * farthest
    ))
}

fn empty_cells(fit: &Fit, size: (usize, usize)) -> Option<String> {
    let counts = Cells::of(size).counts(fit.views.iter().flat_map(|view| view.pixels()));
    let empty = counts.iter().filter(|&&count| count == 0).count();
    (empty as f64 > EMPTY_CELLS * counts.len() as f64).then(|| {
        format!(
            "{empty} of {} cells of the frame have no point: move the board through the whole frame",
            counts.len()
        )
    })
}

fn corner_deviation(calibration: &LensCalibration, size: (usize, usize)) -> Option<String> {
    let (right, bottom) = (size.0 as f64 - 1.0, size.1 as f64 - 1.0);
    let worst = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)]
        .map(|(u, v)| pixel_deviation(calibration, &Vec2::new(u, v)))
        .into_iter()
        .fold(0.0, f64::max);
    (worst > 1.0).then(|| {
        format!(
            "a pixel in a corner of the image is known to {} px only: for work there, take more views that reach it",
            significant(worst, 2)
        )
    })
}

fn tilt(calibration: &LensCalibration) -> Option<String> {
    let normals: Vec<Vec3> =
        calibration.cam_from_target.iter().map(|pose| pose.rotation.column(2).into_owned()).collect();
    let extreme = outermost(&normals);
    let pairs = extreme.iter().enumerate().flat_map(|(i, a)| extreme[i + 1..].iter().map(move |b| (a, b)));
    let largest =
        pairs.map(|(a, b)| libm::atan2(a.cross(b).norm(), a.dot(b)).to_degrees()).fold(0.0, f64::max);
    let focal = calibration.free.contains(Parameter::Fx) || calibration.free.contains(Parameter::Fy);
    (focal && normals.len() > 1 && largest < LEAST_TILT_DEGREES).then(|| {
        format!(
            "no two boards are tilted by more than {largest:.0} degrees against each other: focal length and distance are hardly \
             told apart; tilt the board by 20 to 45 degrees about different axes"
        )
    })
}

/// Directions in which the outermost normals are looked for: the widest angle is missed by a part in a
/// thousand at most.
const DIRECTIONS: usize = 32;

/// The normals that lie farthest out in each direction across the optical axis: among them are two with the
/// widest angle, and finding them takes time that grows with their number, not with its square.
fn outermost(normals: &[Vec3]) -> Vec<Vec3> {
    let farthest = |k: usize| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / DIRECTIONS as f64);
        let along = |n: &Vec3| n.x * cos + n.y * sin;
        normals.iter().max_by(|a, b| along(a).total_cmp(&along(b))).copied()
    };
    (0..DIRECTIONS).filter_map(farthest).collect()
}

fn standing_out(calibration: &LensCalibration, names: &[String], loss: Loss) -> Option<String> {
    let rmse: Vec<f64> = (0..names.len()).filter_map(|i| calibration.view_rmse_px(i)).collect();
    let mut sorted = rmse.clone();
    sorted.sort_by(f64::total_cmp);
    let median = *sorted.get(sorted.len() / 2)?;
    let out: Vec<&str> = rmse
        .iter()
        .zip(names)
        .filter(|(rmse, _)| **rmse > STANDS_OUT * median)
        .map(|(_, name)| name.as_str())
        .collect();
    let (views, are) = if out.len() == 1 { ("view", "is") } else { ("views", "is each") };
    let cure = match loss {
        Loss::Squares => ", or leave out strays with --reject-views 3",
        _ => "; the loss keeps strays among them out of the camera",
    };
    (!out.is_empty()).then(|| {
        format!(
            "the RMSE of {views} {} {are} more than {STANDS_OUT} times the median: look at the marks found there{cure}",
            out.join(", ")
        )
    })
}
