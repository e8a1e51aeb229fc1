//! How long is what lies between two pixels, and which cause makes how much of its uncertainty?
//!
//! The length `L = |X2 - X1|` of two points of a plane is a function of the marks, the camera, the pose and
//! the board; its variance is the sum of their contributions to first order (law of propagation, JCGM
//! 100:2008, eq. 13, correlations of camera and pose included).

use super::coverage::{coverage_factor, effective_freedom};
use super::plane_view::{PlaneView, PlaneViewError};
use crate::geometry::Vec2;
use crate::planar::PlaneCalibration;
use nalgebra::Matrix2;

/// What makes a length uncertain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Cause {
    /// Where the marks were found.
    Marks,
    /// What the lens model leaves out.
    Model,
    /// The camera's parameters.
    Camera,
    /// The plane's pose.
    Pose,
    /// Twice the covariance of what camera and pose contribute: below 0 where they make up for each other.
    CameraWithPose,
    /// The map of the plane.
    Map,
    /// The board's scale.
    BoardScale,
    /// Heights over the plane.
    Flatness,
    /// The board's temperature.
    Temperature,
}

impl Cause {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Marks => "marks",
            Cause::Model => "model",
            Cause::Camera => "camera",
            Cause::Pose => "pose",
            Cause::CameraWithPose => "camera-with-pose",
            Cause::Map => "map",
            Cause::BoardScale => "board-scale",
            Cause::Flatness => "flatness",
            Cause::Temperature => "temperature",
        }
    }
}

/// How well everything but camera and pose is known: standard deviations, 0 where nothing is uncertain.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Conditions {
    /// Of a coordinate of a mark, px.
    pub mark_px: f64,
    /// Degrees of freedom of the calibration's noise, which scales the covariance of camera and pose (or of
    /// the map); `None` where that noise was known beforehand, and intervals are those of the normal
    /// distribution.
    pub noise_freedom: Option<usize>,
    /// Whether `mark_px` is that noise, and not known from elsewhere.
    pub mark_is_noise: bool,
    /// Of what the lens model leaves out at either end, px.
    pub model_px: f64,
    /// Of the board's scale, relative.
    pub scale: f64,
    /// Of the height of either end over the plane, in the target's unit.
    pub flatness: f64,
    /// Of the board's temperature against that at which its size is known, K.
    pub temperature_k: f64,
    /// Expansion of the board, 1/K.
    pub expansion_per_k: f64,
}

impl Conditions {
    /// Marks with this standard deviation, known beforehand as the calibration's noise was, and nothing else
    /// uncertain. Of a noise that the calibration estimated, [`of_noise`](Conditions::of_noise).
    pub fn marks(mark_px: f64) -> Conditions {
        Conditions {
            mark_px,
            noise_freedom: None,
            mark_is_noise: false,
            model_px: 0.0,
            scale: 0.0,
            flatness: 0.0,
            temperature_k: 0.0,
            expansion_per_k: 0.0,
        }
    }

    /// Marks with the calibration's noise, which it estimated on so many degrees of freedom, and nothing else
    /// uncertain.
    pub fn of_noise(sigma_px: f64, degrees_of_freedom: usize) -> Conditions {
        Conditions {
            noise_freedom: Some(degrees_of_freedom),
            mark_is_noise: true,
            ..Conditions::marks(sigma_px)
        }
    }

    fn wrong(&self) -> Option<(&'static str, f64)> {
        let all = [
            ("standard deviation of a mark", self.mark_px),
            ("standard deviation of the model", self.model_px),
            ("standard deviation of the scale", self.scale),
            ("flatness", self.flatness),
            ("standard deviation of the temperature", self.temperature_k),
            ("expansion", self.expansion_per_k),
        ];
        all.into_iter().find(|(_, value)| !(value.is_finite() && *value >= 0.0))
    }
}

/// Part of the variance of camera and pose by which that of both may lie below nought: they can make up for
/// each other, and what is left is rounding.
const ROUNDING: f64 = 1e-6;

/// Why a length cannot be measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LengthError {
    /// A pixel shows no point of the plane.
    #[error(transparent)]
    Plane(#[from] PlaneViewError),
    /// A pixel lies behind the horizon of a map.
    #[error("pixel ({u:.2}, {v:.2}) lies on or behind the horizon of the map")]
    BehindHorizon {
        /// u, px.
        u: f64,
        /// v, px.
        v: f64,
    },
    /// Both ends are one place, which has no direction.
    #[error("both ends are one place")]
    NoLength,
    /// A map without degrees of freedom says nothing of its errors.
    #[error("the map rests on as many numbers as it has parameters: nothing tells its uncertainty")]
    NoFreedom,
    /// Heights need a viewing direction, which a map has not.
    #[error("a map of a plane knows no viewing direction: flatness cannot be taken into account")]
    FlatnessOfMap,
    /// Camera and pose together have a variance below nought.
    #[error("the calibration's covariance is none: it gives the length a variance of {variance}")]
    NoCovariance {
        /// What they have.
        variance: f64,
    },
    /// A standard deviation is negative or not finite.
    #[error("the {what} must be 0 or more and finite, got {value}")]
    Condition {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// A cause's share.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contribution {
    /// The cause.
    pub cause: Cause,
    /// What it adds to the variance of the length, in squares of its unit; only [`Cause::CameraWithPose`] can
    /// be negative.
    pub variance: f64,
    /// Whether the calibration's noise scales it, so that its degrees of freedom are those of that noise.
    pub is_noise: bool,
}

/// A measured length with its budget.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Length {
    /// The length, in the target's unit.
    pub value: f64,
    /// Its ends on the plane.
    pub ends: [Vec2; 2],
    /// Cause by cause.
    pub budget: Vec<Contribution>,
    noise_freedom: Option<usize>,
}

impl Length {
    /// Combined standard uncertainty (JCGM 100:2008, 5.1.2 and 5.2.2).
    pub fn standard_uncertainty(&self) -> f64 {
        self.budget.iter().map(|c| c.variance).sum::<f64>().max(0.0).sqrt()
    }

    /// Effective degrees of freedom of the combined uncertainty (Welch & Satterthwaite; JCGM 100:2008, G.4);
    /// `None` where nothing in it is estimated.
    ///
    /// All that the calibration's noise scales rests on one estimate, so it is one contribution.
    pub fn effective_freedom(&self) -> Option<f64> {
        let sum = |noise: bool| -> f64 {
            self.budget.iter().filter(|c| c.is_noise == noise).map(|c| c.variance).sum()
        };
        let freedom = self.noise_freedom.map(|freedom| freedom as f64);
        effective_freedom(&[(sum(true).max(0.0), freedom), (sum(false), None)])
    }

    /// Factor of the standard uncertainty for an interval of this coverage, by Student's distribution on the
    /// effective degrees of freedom.
    pub fn coverage_factor(&self, coverage: f64) -> f64 {
        coverage_factor(coverage, self.effective_freedom())
    }
}

/// The length between what two pixels show on a plane before a calibrated camera.
///
/// # Errors
/// See [`LengthError`].
///
/// ```
/// use calibench::calibrate::{Settings, calibrate};
/// use calibench::downstream::{Cause, Conditions, PlaneView, length_in_view};
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// let scene = Scene::example();
/// let mut stream = Stream::open(StreamKey { seed: 1, scenario: "length", trial: 0, purpose: "noise" });
/// let result = calibrate(&scene.observe(0.1, &mut stream), &Settings::standard())?;
/// // From the first to the last mark of the first row: eight spacings of the target.
/// let true_length = (scene.truth.points[8] - scene.truth.points[0]).norm();
/// let plane = PlaneView::of_view(&result.camera, &result.cam_from_target, &result.covariance, 0)?;
/// let ends = [scene.pixels()[0][0], scene.pixels()[0][8]];
/// let conditions = Conditions::of_noise(result.sigma_px, result.degrees_of_freedom);
/// let length = length_in_view(&plane, &ends, &conditions)?;
/// assert!((length.value - true_length).abs() < 4.0 * length.standard_uncertainty());
/// // Which cause makes how much of it?
/// let of_marks = length.budget.iter().find(|share| share.cause == Cause::Marks).expect("it is listed");
/// assert!(of_marks.variance > 0.0 && of_marks.variance < length.standard_uncertainty().powi(2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn length_in_view(
    plane: &PlaneView,
    pixels: &[Vec2; 2],
    conditions: &Conditions,
) -> Result<Length, LengthError> {
    let (a, b) = (plane.foot(&pixels[0])?, plane.foot(&pixels[1])?);
    let (value, along) = checked([a.at, b.at], conditions)?;
    let [camera, pose, both] = plane.variances(&(along.transpose() * (&b.by_unknowns - &a.by_unknowns)));
    let variance = camera + pose + both;
    if variance.is_nan() || variance < -ROUNDING * (camera + pose) {
        return Err(LengthError::NoCovariance { variance });
    }
    let height = libm::hypot(along.dot(&a.by_height), along.dot(&b.by_height)) * conditions.flatness;
    let mut budget = at_the_ends(&along, [&a.by_pixel, &b.by_pixel], conditions);
    for (cause, variance) in [(Cause::Camera, camera), (Cause::Pose, pose), (Cause::CameraWithPose, both)] {
        budget.push(Contribution { cause, variance, is_noise: true });
    }
    budget.push(Contribution { cause: Cause::Flatness, variance: height * height, is_noise: false });
    budget.extend(of_board(value, conditions));
    Ok(Length { value, ends: [a.at, b.at], budget, noise_freedom: conditions.noise_freedom })
}

/// The length between what two pixels show under a map of a plane; the map's unit is `unit` long.
///
/// # Errors
/// See [`LengthError`].
///
/// ```
/// use calibench::downstream::{Conditions, length_on_map};
/// use calibench::geometry::Vec2;
/// use calibench::planar::{PlaneModel, calibrate_plane};
///
/// // Nine marks 20 mm apart, seen 100 px apart, each some hundredths of a pixel off.
/// let world: Vec<Vec2> = (0..9).map(|i| 20.0 * Vec2::new(f64::from(i % 3), f64::from(i / 3))).collect();
/// let off = |i: usize| 0.03 * Vec2::new((i * 7 % 5) as f64 - 2.0, (i * 3 % 5) as f64 - 2.0);
/// let pixels: Vec<Vec2> = world.iter().enumerate().map(|(i, w)| 5.0 * w + off(i)).collect();
/// let map = calibrate_plane(PlaneModel::Affine, &pixels, &world)?;
/// // The map's unit is one millimetre.
/// let ends = [Vec2::new(10.0, 10.0), Vec2::new(160.0, 10.0)];
/// // The map's covariance is scaled by what its own residuals say.
/// let conditions = Conditions { noise_freedom: Some(map.degrees_of_freedom), ..Conditions::marks(0.05) };
/// let length = length_on_map(&map, 1.0, &ends, &conditions)?;
/// assert!((length.value - 30.0).abs() < 4.0 * length.standard_uncertainty());
/// assert!(length.effective_freedom().is_some_and(|freedom| freedom > 12.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn length_on_map(
    map: &PlaneCalibration,
    unit: f64,
    pixels: &[Vec2; 2],
    conditions: &Conditions,
) -> Result<Length, LengthError> {
    if conditions.flatness > 0.0 {
        return Err(LengthError::FlatnessOfMap);
    }
    let spread = map.spread.as_ref().ok_or(LengthError::NoFreedom)?;
    let horizon = |p: &Vec2| LengthError::BehindHorizon { u: p.x, v: p.y };
    let at = |p: &Vec2| map.map.world_from_pixel(p).map(|x| x * unit).ok_or_else(|| horizon(p));
    let by_pixel = |p: &Vec2| map.map.jacobian(p).map(|j| j * unit).ok_or_else(|| horizon(p));
    let ends = [at(&pixels[0])?, at(&pixels[1])?];
    let (value, along) = checked(ends, conditions)?;
    let of_map = spread.difference_covariance(&pixels[0], &pixels[1]).ok_or_else(|| horizon(&pixels[0]))?;
    let mut budget = at_the_ends(&along, [&by_pixel(&pixels[0])?, &by_pixel(&pixels[1])?], conditions);
    let variance = along.dot(&(of_map * along)) * unit * unit;
    budget.push(Contribution { cause: Cause::Map, variance, is_noise: true });
    budget.extend(of_board(value, conditions));
    Ok(Length { value, ends, budget, noise_freedom: conditions.noise_freedom })
}

/// Length and direction between two ends.
fn checked(ends: [Vec2; 2], conditions: &Conditions) -> Result<(f64, Vec2), LengthError> {
    if let Some((what, value)) = conditions.wrong() {
        return Err(LengthError::Condition { what, value });
    }
    let between = ends[1] - ends[0];
    let value = between.norm();
    if value > 0.0 { Ok((value, between / value)) } else { Err(LengthError::NoLength) }
}

/// What errors of the two pixels, independent of each other, contribute.
fn at_the_ends(along: &Vec2, by_pixel: [&Matrix2<f64>; 2], conditions: &Conditions) -> Vec<Contribution> {
    let square: f64 = by_pixel.iter().map(|j| (j.transpose() * along).norm_squared()).sum();
    let of = |cause, deviation: f64, is_noise| Contribution {
        cause,
        variance: square * deviation * deviation,
        is_noise,
    };
    vec![
        of(Cause::Marks, conditions.mark_px, conditions.mark_is_noise),
        of(Cause::Model, conditions.model_px, false),
    ]
}

/// What is proportional to the length: scale and temperature of the board.
fn of_board(value: f64, conditions: &Conditions) -> [Contribution; 2] {
    let of = |cause, relative: f64| {
        let deviation = value * relative;
        Contribution { cause, variance: deviation * deviation, is_noise: false }
    };
    [
        of(Cause::BoardScale, conditions.scale),
        of(Cause::Temperature, conditions.temperature_k * conditions.expansion_per_k),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Covariance;
    use crate::camera::{Camera, FreeParameters, Parameter};
    use crate::geometry::{Mat3, Pose, Vec3};
    use crate::planar::{PlaneModel, calibrate_plane};
    use nalgebra::{DMatrix, MatrixXx6, SMatrix};

    /// A pinhole 300 mm before a plane that it faces; fx with 0.6 px, the distance with `sd_z` mm, both
    /// correlated fully if they are to make up for each other.
    fn facing(sd_z: f64, correlation: f64) -> PlaneView {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let pose = Pose { rotation: Mat3::identity(), translation: Vec3::new(0.0, 0.0, 300.0) };
        let mut of_pose = SMatrix::zeros();
        of_pose[(5, 5)] = sd_z * sd_z;
        let mut cross = MatrixXx6::zeros(1);
        cross[(0, 5)] = correlation * 0.6 * sd_z;
        let covariance = Covariance {
            free: FreeParameters::of(&[Parameter::Fx]),
            fy_per_fx: Some(1.0),
            intrinsics: DMatrix::from_element(1, 1, 0.36),
            poses: vec![of_pose],
            cross: vec![cross],
        };
        PlaneView::of_view(&camera, &[pose], &covariance, 0).unwrap()
    }

    const ENDS: [Vec2; 2] = [Vec2::new(220.0, 240.0), Vec2::new(420.0, 240.0)];

    fn variance(length: &Length, cause: Cause) -> f64 {
        length.budget.iter().filter(|c| c.cause == cause).map(|c| c.variance).sum()
    }

    #[test]
    fn every_cause_counts_as_geometry_says() {
        let conditions = Conditions {
            scale: 1e-4,
            flatness: 0.3,
            temperature_k: 2.0,
            expansion_per_k: 11.5e-6,
            model_px: 0.05,
            ..Conditions::marks(0.1)
        };
        let length = length_in_view(&facing(0.15, 0.0), &ENDS, &conditions).unwrap();
        let near = |cause, expected: f64| {
            let found = variance(&length, cause).sqrt();
            assert!((found - expected).abs() < 1e-12, "{cause:?}: {found} instead of {expected}");
        };
        // 200 px at half a millimetre a pixel.
        assert!((length.value - 100.0).abs() < 1e-12);
        near(Cause::Marks, 0.1 * 0.5 * 2.0_f64.sqrt());
        near(Cause::Model, 0.05 * 0.5 * 2.0_f64.sqrt());
        // A length is proportional to distance over focal length: a thousandth of fx, half of one of Z.
        near(Cause::Camera, 0.1);
        near(Cause::Pose, 0.05);
        near(Cause::BoardScale, 0.01);
        near(Cause::Temperature, 100.0 * 23e-6);
        // Either end is seen 50 mm beside the axis, 300 mm away.
        near(Cause::Flatness, 0.3 / 6.0 * 2.0_f64.sqrt());
        let sum: f64 = length.budget.iter().map(|c| c.variance).sum();
        assert!((length.standard_uncertainty() - sum.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn a_longer_lens_further_away_is_the_same_length() {
        // 0.3 mm of distance go with 0.6 px of focal length: nothing is left.
        let length = length_in_view(&facing(0.3, 1.0), &ENDS, &Conditions::marks(0.0)).unwrap();
        assert!(variance(&length, Cause::CameraWithPose) < -0.019);
        assert!(length.standard_uncertainty() < 1e-7);
    }

    #[test]
    fn what_is_no_covariance_gives_no_length_of_certain_size() {
        // They would make up for each other twice over.
        let refused = length_in_view(&facing(0.3, 2.0), &ENDS, &Conditions::marks(0.0)).unwrap_err();
        assert!(matches!(refused, LengthError::NoCovariance { variance } if variance < -0.019), "{refused}");
    }

    #[test]
    fn degrees_of_freedom_are_those_of_the_noise_where_it_is_alone() {
        let noisy = Conditions { noise_freedom: Some(9), mark_is_noise: true, ..Conditions::marks(0.1) };
        let alone = length_in_view(&facing(0.1, 0.0), &ENDS, &noisy).unwrap();
        assert!((alone.effective_freedom().unwrap() - 9.0).abs() < 1e-9);
        // Table G.2 of JCGM 100: 2.26 for nine.
        assert!((alone.coverage_factor(0.95) - 2.26).abs() < 0.005);
        let with_scale = Conditions { scale: 1e-3, ..noisy };
        assert!(
            length_in_view(&facing(0.1, 0.0), &ENDS, &with_scale).unwrap().effective_freedom().unwrap()
                > 12.0
        );
        let known = length_in_view(&facing(0.0, 0.0), &ENDS, &Conditions::marks(0.1)).unwrap();
        assert_eq!(known.effective_freedom(), None);
    }

    #[test]
    fn what_is_no_length_or_cannot_be_known_is_refused() {
        let fail = |conditions: Conditions, ends: [Vec2; 2]| {
            length_in_view(&facing(0.1, 0.0), &ends, &conditions).unwrap_err()
        };
        assert_eq!(fail(Conditions::marks(0.1), [ENDS[0]; 2]), LengthError::NoLength);
        assert!(matches!(fail(Conditions::marks(-0.1), ENDS), LengthError::Condition { value: -0.1, .. }));
        let pixels = [(0.0, 0.0), (100.0, 1.0), (0.0, 100.0), (100.0, 100.0)].map(|(x, y)| Vec2::new(x, y));
        let map = |model| calibrate_plane(model, &pixels, &pixels.map(|p| 0.1 * p)).unwrap();
        let on_map = |model, conditions| length_on_map(&map(model), 1.0, &ENDS, &conditions).map(|l| l.value);
        assert_eq!(on_map(PlaneModel::Projective, Conditions::marks(0.1)), Err(LengthError::NoFreedom));
        let flat = Conditions { flatness: 0.1, ..Conditions::marks(0.1) };
        assert_eq!(on_map(PlaneModel::Affine, flat), Err(LengthError::FlatnessOfMap));
        assert!((on_map(PlaneModel::Affine, Conditions::marks(0.1)).unwrap() - 20.0).abs() < 1e-12);
    }
}
