//! Which of the two estimators calibrates? That of [`super::calibrate`] knows one lens, and much about it;
//! that of [`super::any_lens`] knows all.

use super::estimate::calibrate_distinct;
use super::{Board, Calibration, CalibrationError, Settings, any_lens, copies, left_out};
use crate::board::View;
use crate::camera::{Camera, Lens, Model};

/// A calibration with a lens of any model.
pub type LensCalibration = Calibration<Lens>;

impl<L> Calibration<L> {
    /// The same with the camera written another way.
    fn with_camera<M>(self, camera: Camera<M>) -> Calibration<M> {
        Calibration {
            camera,
            free: self.free,
            priors: self.priors,
            cam_from_target: self.cam_from_target,
            residuals: self.residuals,
            rmse_px: self.rmse_px,
            sigma_px: self.sigma_px,
            degrees_of_freedom: self.degrees_of_freedom,
            covariance: self.covariance,
            conditioning: self.conditioning,
            termination: self.termination,
            certificate: self.certificate,
            intervals: self.intervals,
            starts: self.starts,
            iterations: self.iterations,
            warnings: self.warnings,
            board: self.board,
        }
    }
}

impl From<Calibration> for LensCalibration {
    fn from(plain: Calibration) -> LensCalibration {
        let camera = plain.camera.into();
        plain.with_camera(camera)
    }
}

impl LensCalibration {
    /// The same with a camera whose lens model is known to be Brown-Conrady's; `None` if it is another.
    pub fn brown_conrady(&self) -> Option<Calibration> {
        self.camera.brown_conrady().map(|camera| self.clone().with_camera(camera))
    }
}

/// [`calibrate`](super::calibrate) with a lens of any model ([`Settings::of_model`]), marks of unequal weight
/// ([`View::with_weights`]) and a board that need not be flat ([`Board`]).
///
/// The cost is `sum w^2 |r|^2` under the loss, with the priors' share; see [`Prior`](super::Prior). The
/// covariance is that of [`calibrate`](super::calibrate), the noise that of a coordinate of weight 1. A
/// camera with Brown-Conrady's lens, marks of weight 1 and a flat board is handed to
/// [`calibrate`](super::calibrate), with all that it checks. For all else the best of a few starts is
/// refined, by the rays of a fisheye and by a pinhole, and the profiles of the parameters are walked where
/// the cost is no parabola; nothing certifies that minimum. Views given twice count once, but where marks
/// have weights.
///
/// With any lens the marks are asked by score tests whether they need what nobody has decided on: p1 and p2,
/// k3, the principal point, skew, and what is held at another value than 0
/// ([`Warning::LeftOut`](super::Warning::LeftOut)), a board that is not flat
/// ([`Warning::NotFlat`](super::Warning::NotFlat)).
///
/// # Errors
/// As [`calibrate`](super::calibrate); a parameter that the model does not have; a model that cannot see
/// every mark.
///
/// ```
/// use calibench::board::View;
/// use calibench::calibrate::{Settings, calibrate_lens};
/// use calibench::camera::{Camera, Lens, Model};
/// use calibench::geometry::{Pose, Vec2, Vec3};
/// use calibench::synth::Truth;
///
/// // The example's board and poses, seen through a fisheye.
/// let lens = Lens::new(Model::KannalaBrandt, &[-0.03, 0.004, 0.0, 0.0])?;
/// let camera = Camera::with_lens(600.0, 600.0, 320.0, 240.0, lens);
/// let truth = Truth::example();
/// let seen = |pose: &Pose| {
///     let pixel = |p: &Vec2| camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0)));
///     View::new(truth.points.clone(), truth.points.iter().filter_map(pixel).collect())
/// };
/// let views: Vec<View> = truth.cam_from_target.iter().map(seen).collect::<Result<_, _>>()?;
/// let found = calibrate_lens(&views, &Settings::of_model(Model::KannalaBrandt))?;
/// assert!((found.camera.fx - 600.0).abs() < 1e-3 && found.rmse_px < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn calibrate_lens(views: &[View], settings: &Settings) -> Result<LensCalibration, CalibrationError> {
    // A mark that was given twice with weights may be meant so.
    if views.iter().any(|view| view.weights().is_some()) {
        return asked(views, settings);
    }
    copies::without(views, |views| asked(views, settings))
}

/// The calibration of views without copies, with what the marks ask for besides.
fn asked(views: &[View], settings: &Settings) -> Result<LensCalibration, CalibrationError> {
    let is_plain = views.iter().all(|view| view.weights().is_none()) && settings.board == Board::Flat;
    let mut found = if settings.model() == Model::BrownConrady && is_plain {
        LensCalibration::from(calibrate_distinct(views, settings)?)
    } else {
        any_lens::calibrate(views, settings)?
    };
    let asked_for = left_out::asked_for(views, settings, &found);
    found.warnings.extend(asked_for);
    Ok(found)
}
