//! In which order do the coefficients of a lens stand? OpenCV's, which ROS, Kalibr, mrcal and COLMAP share.
//!
//! `k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]]`, in the equations of [`BrownConrady`]: OpenCV
//! documentation, "Camera Calibration and 3D Reconstruction"; mrcal documentation, "Lens models",
//! `LENSMODEL_OPENCV`.

use super::error::FormatError;
use super::node::Source;
use crate::camera::BrownConrady;

/// What can be done about a lens of another kind.
pub(super) const CALIBRATE_AGAIN: &str =
    "calibrate again with this library from the corners that the camera was calibrated with";
/// What can be done about a lens that mrcal knows.
pub(super) const REFIT_BY_MRCAL: &str = "fit the nearest such lens with `mrcal-convert-lensmodel LENSMODEL_OPENCV5`, or calibrate again from its corners";

/// Names of the coefficients beyond those of Brown-Conrady.
const FURTHER: [&str; 9] = ["k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"];

/// The lens of coefficients in OpenCV's order, as many as OpenCV takes: 0, 4, 5, 8, 12 or 14.
pub(super) fn from_opencv_order(
    source: &Source,
    offset: usize,
    coefficients: &[f64],
    help: &'static str,
) -> Result<BrownConrady, FormatError> {
    if ![0, 4, 5, 8, 12, 14].contains(&coefficients.len()) {
        let message = format!("{} coefficients; a lens has 0, 4, 5, 8, 12 or 14", coefficients.len());
        return Err(source.value(offset, "the distortion", message));
    }
    let further = coefficients.iter().skip(5).zip(FURTHER).filter(|(value, _)| **value != 0.0);
    let names: Vec<&str> = further.map(|(_, name)| name).collect();
    if !names.is_empty() {
        return Err(source.lens(format!("a lens with {}", names.join(" ")), help));
    }
    let c = |i: usize| coefficients.get(i).copied().unwrap_or(0.0);
    Ok(BrownConrady { k1: c(0), k2: c(1), p1: c(2), p2: c(3), k3: c(4) })
}

/// The five coefficients in OpenCV's order.
pub(super) fn opencv_order(lens: &BrownConrady) -> [f64; 5] {
    [lens.k1, lens.k2, lens.p1, lens.p2, lens.k3]
}
