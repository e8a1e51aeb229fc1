//! Which camera explains one view? Tsai's two stages (R. Y. Tsai, "A versatile camera calibration technique
//! for high-accuracy 3D machine vision metrology using off-the-shelf TV cameras and lenses", IEEE Journal of
//! Robotics and Automation 3(4), 1987): one photograph of a tilted plane, or of a target in three dimensions.
//!
//! ```text
//! x = R X + T                                     camera coordinates of target point X
//! X_d = (u - cx) fy / fx,   Y_d = v - cy          px, from a principal point that is given
//! stage 1   X_d y = Y_d x                         radial alignment: no focal length, depth or radial lens in it
//! stage 2   X_d (1 + kappa r_d^2 / f^2) = f x / z,  the same for Y_d;  r_d^2 = X_d^2 + Y_d^2
//! ```
//! Stage 1 (`alignment.rs`) is linear and gives R, T_x, T_y and, of a target in three dimensions, fy / fx;
//! stage 2 (`depth.rs`) gives `f = fy` and T_z, linear for an ideal lens, then refined with `kappa`.
//!
//! Tsai's `kappa` takes *distorted* coordinates to ideal ones, this library's `k1`, `k2`, `k3` ideal to
//! distorted ones (Brown-Conrady): `lens.rs` converts, and says what is left over.
//!
//! Names of the paper: its `s_x` is `fx / fy`, its `kappa_1` is `kappa / f^2` with the sensor's unit the px.
//!
//! The answer is no maximum-likelihood estimate: [`refine_view`] makes one of it, for targets of either kind,
//! and [`crate::calibrate::Settings::starting_at`] takes its camera as the start of a calibration from one
//! plane or more.

mod alignment;
mod depth;
mod descent;
mod error;
mod facing;
mod frame;
mod lens;
mod refine;
mod view;

pub use error::TsaiError;
pub use refine::{RefineError, Refined, refine_view};
pub use view::SpatialView;

use crate::camera::Camera;
use crate::geometry::{Mat3, Pose, Vec2};
use frame::TargetFrame;

/// What Tsai's method is told.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Assumed {
    /// The principal point, px: where it is wrong, so is the answer.
    pub principal_point_px: Vec2,
    /// fy over fx, 1 for square pixels; `None` to estimate it, which takes a target in three dimensions.
    pub fy_per_fx: Option<f64>,
}

impl Assumed {
    /// Square pixels, and the principal point in the image's centre, `((w - 1) / 2, (h - 1) / 2)`.
    pub fn centre_of((width, height): (usize, usize)) -> Assumed {
        let middle = |side: usize| 0.5 * (side as f64 - 1.0);
        Assumed { principal_point_px: Vec2::new(middle(width), middle(height)), fy_per_fx: Some(1.0) }
    }

    fn check(&self) -> Result<(), TsaiError> {
        let (x, y) = (self.principal_point_px.x, self.principal_point_px.y);
        match self.fy_per_fx {
            _ if !(x.is_finite() && y.is_finite()) => Err(TsaiError::PrincipalPoint { u: x, v: y }),
            Some(ratio) if !(ratio > 0.0 && ratio.is_finite()) => Err(TsaiError::BadRatio { ratio }),
            _ => Ok(()),
        }
    }
}

/// What one view says by Tsai's method.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TwoStage {
    /// The camera, its lens in this library's form: `kappa` converted to k1, k2 and k3.
    pub camera: Camera,
    /// Where the target was.
    pub cam_from_target: Pose,
    /// Whether the points lie in one plane: 5 unknowns in stage 1, else 7, or 8 - 1 with fy / fx estimated.
    pub is_flat: bool,
    /// Tsai's lens: ideal = distorted `(1 + kappa r_d^2)`, in units of the focal length.
    pub kappa: f64,
    /// fy without the lens: what the linear part of stage 2 gives, px.
    pub linear_focal_px: f64,
    /// Largest distance over the points between Tsai's lens and the converted one, px.
    pub conversion_px: f64,
    /// Tilt of a plane against the image plane, rad; `None` for a target in three dimensions.
    pub tilt_rad: Option<f64>,
    /// `sqrt(sum |r|^2 / N)` of the converted camera, px.
    pub rmse_px: f64,
}

/// Calibrates from one view by Tsai's two stages.
///
/// Domain: the plane is tilted, by so much that noise cannot make its perspective and that a focal length
/// three times as long or as short is excluded; the lens is radial about the given principal point; the
/// target lies before the camera.
///
/// The paper divides stage 1 by T_y, which fails where the target's origin appears beside the principal
/// point; here the homogeneous system is solved, and the scale taken from the length of R's rows, so that the
/// origin may appear anywhere. The rotation of a plane is completed by the singular vectors of its 2 x 2
/// block, which is the paper's equation 10 without its cases; stage 2 counts both coordinates of a point
/// where the paper counts Y alone.
///
/// # Errors
/// See [`TsaiError`]; a plane that faces the camera has none but a made-up focal length and is refused as
/// [`TsaiError::Facing`].
///
/// ```
/// use calibench::geometry::Vec2;
/// use calibench::synth::{Scene, Truth};
/// use calibench::tsai::{Assumed, SpatialView, two_stage};
///
/// let scene = Scene::example();
/// // The second view is tilted by 20 degrees; the camera's principal point is known.
/// let view = SpatialView::from(&scene.exact()[1]);
/// let truth = Truth::example_camera();
/// let assumed = Assumed { principal_point_px: Vec2::new(truth.cx, truth.cy), fy_per_fx: Some(1.0) };
/// let found = two_stage(&view, &assumed)?;
/// // Tsai's lens has one coefficient, the true one two: the focal length is off by a part in a thousand.
/// assert!((found.camera.fy - 600.0).abs() < 2.0 && (found.camera.distortion.k1 + 0.18).abs() < 0.02);
/// // The first faces the camera.
/// let facing = two_stage(&SpatialView::from(&scene.exact()[0]), &assumed);
/// assert!(facing.unwrap_err().to_string().contains("inseparable"));
/// # Ok::<(), calibench::tsai::TsaiError>(())
/// ```
pub fn two_stage(view: &SpatialView, assumed: &Assumed) -> Result<TwoStage, TsaiError> {
    assumed.check()?;
    let frame = TargetFrame::of(view).ok_or(TsaiError::OnePlace)?;
    let aligned = alignment::align(view, &frame, assumed)?;
    let deep = depth::depth(&aligned, frame.is_flat()).map_err(|error| match frame.is_flat() {
        // A plane can always be tilted the other way: what is left are those that have no perspective to
        // speak of.
        true => TsaiError::Facing { tilt_deg: tilt_rad(&aligned.rotation).to_degrees(), p_value: None },
        false => error,
    })?;
    let (camera, conversion_px) = lens::camera(&aligned, &deep, assumed.principal_point_px);
    let pose = frame.cam_from_target(&deep.cam_from_frame);
    let found = TwoStage {
        rmse_px: refine::rmse_px(&camera, &pose, view).ok_or(TsaiError::Behind { focal_px: camera.fy })?,
        camera,
        cam_from_target: pose,
        is_flat: frame.is_flat(),
        kappa: deep.kappa,
        linear_focal_px: deep.linear_focal_px,
        conversion_px,
        tilt_rad: frame.is_flat().then(|| tilt_rad(&deep.cam_from_frame.rotation)),
    };
    if let Some(tilt_rad) = found.tilt_rad {
        facing::refuse(view, &found, tilt_rad, aligned.fy_per_fx)?;
    }
    Ok(found)
}

/// Angle between the normal of a plane Z = 0 and the optical axis, rad.
fn tilt_rad(rotation: &Mat3) -> f64 {
    libm::atan2(libm::hypot(rotation[(0, 2)], rotation[(1, 2)]), rotation[(2, 2)].abs())
}
