//! How well could any unbiased calibrator do? The Cramer-Rao bound of a scene.

use crate::calibrate::{Conditioning, Covariance, information, lens_information};
use crate::camera::{BrownConrady, FreeParameters, Imaging, Lens};
use crate::synth::Truth;

/// A scene that bounds nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BoundError {
    /// The free parameters are not identifiable even from perfect knowledge of the noise.
    #[error("the scene does not determine {free} together with {views} poses: no unbiased estimate exists")]
    Singular {
        /// Free intrinsics.
        free: String,
        /// Number of views.
        views: usize,
    },
    /// A point is behind the camera.
    #[error("a target point of the scene is not in front of the camera")]
    BehindCamera,
}

/// The Cramer-Rao bound `sigma^2 (J^T J)^-1` of intrinsics and poses for Gaussian noise of standard deviation
/// `sigma_px` on each pixel coordinate, `J` taken at the truth (Rao 1945; Cramer 1946). The
/// maximum-likelihood estimate attains it to first order.
///
/// # Errors
/// A scene whose information matrix is singular, or with points behind the camera.
///
/// ```
/// use calibench::camera::{FreeParameters, Parameter};
/// use calibench::evaluate::cramer_rao;
/// use calibench::synth::Truth;
///
/// let bound = cramer_rao(&Truth::example(), FreeParameters::STANDARD, 0.1)?;
/// // Whoever calibrates from these four views knows fx to 0.68 px at best, and to twice that at twice the noise.
/// let at_twice = cramer_rao(&Truth::example(), FreeParameters::STANDARD, 0.2)?;
/// let (fx, fx_at_twice) = (bound.standard_deviation(Parameter::Fx), at_twice.standard_deviation(Parameter::Fx));
/// assert!(fx.is_some_and(|sd| (sd - 0.681).abs() < 5e-4));
/// assert!(fx.zip(fx_at_twice).is_some_and(|(one, two)| (two / one - 2.0).abs() < 1e-12));
/// # Ok::<(), calibench::evaluate::BoundError>(())
/// ```
pub fn cramer_rao<L: Bounded>(
    truth: &Truth<L>,
    free: FreeParameters,
    sigma_px: f64,
) -> Result<Covariance, BoundError> {
    let (conditioning, unit) = L::unit(truth, free).ok_or(BoundError::BehindCamera)?;
    let singular = || BoundError::Singular { free: free.to_string(), views: truth.cam_from_target.len() };
    // Rounding can leave a singular matrix with a Cholesky factor: its inverse would be large and
    // meaningless.
    if conditioning.is_some_and(|c| c.is_singular()) {
        return Err(singular());
    }
    unit.map(|unit| unit.scaled(sigma_px * sigma_px)).ok_or_else(singular)
}

/// How well the data separate the parameters, and their covariance for unit noise; `None` where there is
/// none.
pub type Unit = (Option<Conditioning>, Option<Covariance>);

/// A lens whose parameters a scene bounds.
pub trait Bounded: Imaging {
    /// What a scene says for unit noise; `None` where a point has no image.
    fn unit(truth: &Truth<Self>, free: FreeParameters) -> Option<Unit>;
}

impl Bounded for BrownConrady {
    fn unit(truth: &Truth, free: FreeParameters) -> Option<Unit> {
        let information = information(&truth.camera, free, &truth.cam_from_target, &truth.points)?;
        Some((information.conditioning(), information.covariance()))
    }
}

impl Bounded for Lens {
    fn unit(truth: &Truth<Lens>, free: FreeParameters) -> Option<Unit> {
        let Truth { camera, points, cam_from_target, image_size } = truth;
        match camera.brown_conrady() {
            Some(camera) => {
                let (points, cam_from_target) = (points.clone(), cam_from_target.clone());
                BrownConrady::unit(&Truth { camera, image_size: *image_size, points, cam_from_target }, free)
            }
            None => lens_information(camera, free, cam_from_target, points),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::scene::looking_at_centre;

    #[test]
    fn views_that_face_the_camera_bound_nothing_at_any_distance() {
        for z in 60..200 {
            let distances = [0.9, 1.0, 1.1, 1.3].map(|factor| factor * f64::from(z));
            let poses = distances.map(|z| looking_at_centre([0.0, 0.0, 10.0], z)).to_vec();
            let truth = Truth { cam_from_target: poses, ..Truth::example() };
            let bound = cramer_rao(&truth, FreeParameters::STANDARD, 0.1);
            assert!(matches!(bound, Err(BoundError::Singular { views: 4, .. })), "{z} mm: {bound:?}");
        }
    }

    #[test]
    fn the_examples_bound_is_met_to_its_printed_digits() {
        // Printed for this scene: standard deviations with all poses at 120 mm.
        let bound = cramer_rao(&Truth::example(), FreeParameters::STANDARD, 0.1).unwrap();
        for (parameter, (sd, digit)) in FreeParameters::STANDARD.iter().zip([
            (0.681, 1e-3),
            (0.684, 1e-3),
            (0.392, 1e-3),
            (0.376, 1e-3),
            (0.0035, 1e-4),
            (0.0157, 1e-4),
        ]) {
            let ours = bound.standard_deviation(parameter).unwrap();
            assert!((ours - sd).abs() <= 0.5 * digit, "{parameter}: {ours}");
        }
    }
}
