//! In which order do the coefficients of a lens stand? OpenCV's, which ROS, Kalibr, mrcal and COLMAP share.
//!
//! `k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]]`: each further group makes another lens model, in
//! the order of [`Model::coefficients`]; and `k1 k2 k3 k4` of a fisheye. (OpenCV documentation, "Camera
//! Calibration and 3D Reconstruction"; mrcal documentation, "Lens models", `LENSMODEL_OPENCV`.)

use super::error::FormatError;
use super::node::Source;
use crate::camera::{BrownConrady, Camera, Lens, Model};

/// What can be done about a lens of another kind.
pub(super) const CALIBRATE_AGAIN: &str =
    "calibrate again with this library from the corners that the camera was calibrated with";
/// What can be done about a lens that mrcal knows.
pub(super) const REFIT_BY_MRCAL: &str = "fit the nearest such lens with `mrcal-convert-lensmodel LENSMODEL_OPENCV5` (or 8, or 12), or calibrate again from its corners";

/// How the formats that share OpenCV's order say it.
pub(super) const IN_OPENCVS_ORDER: &str = "in OpenCV's order";

/// Models with OpenCV's coefficients: each has those of the one before it, and then its own.
pub(super) const OPENCV: [Model; 4] = [Model::BrownConrady, Model::Rational, Model::ThinPrism, Model::Tilted];

/// The lens of coefficients in OpenCV's order, as many as OpenCV takes: 0, 4, 5, 8, 12 or 14.
pub(super) fn from_opencv_order(
    source: &Source,
    offset: usize,
    coefficients: &[f64],
) -> Result<Lens, FormatError> {
    if ![0, 4, 5, 8, 12, 14].contains(&coefficients.len()) {
        let message = format!("{} coefficients; a lens has 0, 4, 5, 8, 12 or 14", coefficients.len());
        return Err(source.value(offset, "the distortion", message));
    }
    Ok(least_of(coefficients))
}

/// The lens of the first of OpenCV's models that has a place for all coefficients that are not 0.
pub(super) fn least_of(coefficients: &[f64]) -> Lens {
    let needed = coefficients.iter().rposition(|value| *value != 0.0).map_or(0, |last| last + 1);
    let model = OPENCV.into_iter().find(|model| model.coefficients().len() >= needed);
    let model = model.unwrap_or(Model::Tilted);
    let mut padded = coefficients[..needed].to_vec();
    padded.resize(model.coefficients().len(), 0.0);
    // The list is as long as the model's; an ideal lens would be a fault that the tests see.
    Lens::new(model, &padded).unwrap_or(Lens::ideal(model))
}

/// The same lens by the model with the fewest coefficients: those that are 0 at the end of OpenCV's order say
/// nothing, and a division by 1 and a polynomial that is 1 are no distortion.
pub(super) fn simplest(lens: Lens) -> Lens {
    match lens.model() {
        model if OPENCV.contains(&model) => least_of(lens.coefficients()),
        Model::Division | Model::HalconPolynomial if lens.coefficients().iter().all(|c| *c == 0.0) => ideal(),
        _ => lens,
    }
}

/// The lens of a fisheye's coefficients, of which there may be fewer than four.
pub(super) fn fisheye(coefficients: &[f64]) -> Option<Lens> {
    let mut padded = coefficients.to_vec();
    padded.resize(4.max(coefficients.len()), 0.0);
    Lens::new(Model::KannalaBrandt, &padded).ok()
}

/// A division's lens.
pub(super) fn division(k1: f64) -> Lens {
    // One coefficient is what the model has; an ideal lens would be a fault that the tests see.
    Lens::new(Model::Division, &[k1]).unwrap_or(Lens::ideal(Model::Division))
}

/// The lens of HALCON's polynomial: k1, k2, p1, p2, k3.
pub(super) fn halcon_polynomial(coefficients: [f64; 5]) -> Lens {
    // As many as the model has, like the division's.
    Lens::new(Model::HalconPolynomial, &coefficients).unwrap_or(Lens::ideal(Model::HalconPolynomial))
}

/// A camera without skew.
pub(super) fn camera([fx, fy, cx, cy]: [f64; 4], lens: impl Into<Lens>) -> Camera<Lens> {
    Camera::with_lens(fx, fy, cx, cy, lens.into())
}

/// An ideal lens.
pub(super) fn ideal() -> Lens {
    BrownConrady::default().into()
}

/// Whether a lens shows what a pinhole would.
pub(super) fn is_ideal(lens: &Lens) -> bool {
    simplest(*lens).brown_conrady().is_some_and(|lens| lens.is_ideal())
}

/// How many of OpenCV's coefficients at the beginning hold those that are not 0, of the numbers that a format
/// may have.
pub(super) fn least_count(lens: &Lens, counts: &[usize]) -> Option<usize> {
    let needed = lens.coefficients().iter().rposition(|value| *value != 0.0).map_or(0, |last| last + 1);
    counts.iter().copied().find(|count| *count >= needed)
}

/// The first so many coefficients, 0 where the lens has fewer.
pub(super) fn padded(lens: &Lens, count: usize) -> Vec<f64> {
    let mut coefficients = lens.coefficients().to_vec();
    coefficients.resize(count, 0.0);
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Parameter;

    #[test]
    fn each_of_opencvs_models_has_the_coefficients_of_the_one_before_and_in_opencvs_order() {
        use Parameter::*;
        let all = [K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4, TauX, TauY];
        for (model, count) in OPENCV.into_iter().zip([5, 8, 12, 14]) {
            assert_eq!(model.coefficients(), &all[..count]);
        }
    }

    #[test]
    fn a_lens_is_written_by_the_model_that_it_needs() {
        let model = |coefficients: &[f64]| least_of(coefficients).model();
        assert_eq!(model(&[]), Model::BrownConrady);
        assert_eq!(model(&[-0.2, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Model::BrownConrady);
        assert_eq!(model(&[-0.2, 0.1, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0]), Model::Rational);
        assert_eq!(model(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0]), Model::ThinPrism);
        let tilted = Lens::new(Model::Tilted, &[0.0; 14]).unwrap();
        assert_eq!(simplest(tilted), ideal());
        assert_eq!(simplest(division(0.0)), ideal());
        assert_eq!(simplest(division(0.1)).model(), Model::Division);
        assert_eq!(simplest(halcon_polynomial([0.0; 5])), ideal());
        let tangential = halcon_polynomial([0.0, 0.0, 0.0, 1e-3, 0.0]);
        assert_eq!(simplest(tangential), tangential);
        assert!(is_ideal(&tilted) && !is_ideal(&Lens::ideal(Model::KannalaBrandt)));
    }
}
