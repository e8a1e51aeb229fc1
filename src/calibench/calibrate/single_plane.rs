//! How does a lens bend one photograph of a plane? Homography and radial distortion from a single view.
//!
//! ```text
//! i = H X                                         ideal pixel of target point X
//! m = c + f distort((i - c) / f)                  observed pixel; distort: x (1 + k1 r^2 + k2 r^4)
//! ```
//! One plane cannot tell the focal length, so `f` is a gauge: any value fits as well, with `k1` proportional
//! to `f^2` and `k2` to `f^4`. With the camera's true focal length the coefficients are the camera's own. A
//! free distortion centre `c` is fixed by the data only as far as there is distortion. (Tsai 1987 is the
//! classical single-view calibration; this is its planar core, without a pose.)

mod model;
mod refine;

use super::Termination;
use crate::board::View;
use crate::camera::{BrownConrady, Camera, UndistortError};
use crate::geometry::projective_frame::change_frames;
use crate::geometry::{Homography, HomographyError, Mat3, Vec2};
use model::{Frames, PARAMETERS, ParameterVector};
use nalgebra::{DMatrix, Matrix4, SMatrix};
use refine::Outcome;

/// What is given, and what is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SinglePlaneOptions {
    /// Length that makes radii dimensionless, px: the gauge of `k1` and `k2`.
    pub focal_px: f64,
    /// The distortion centre, px: held there, or started from there.
    pub centre_px: Vec2,
    /// Whether the centre is estimated too.
    pub centre_free: bool,
}

/// Why a single view gives no distortion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SinglePlaneError {
    /// Fewer coordinates than parameters.
    #[error("{parameters} parameters need at least {need} points, got {got}")]
    TooFewPoints {
        /// Number of parameters.
        parameters: usize,
        /// Least number of points.
        need: usize,
        /// Number given.
        got: usize,
    },
    /// The gauge length or the centre is unusable.
    #[error("focal_px {focal_px} must be positive and the centre ({centre_u}, {centre_v}) finite")]
    Options {
        /// The length given.
        focal_px: f64,
        /// The centre given, u.
        centre_u: f64,
        /// The centre given, v.
        centre_v: f64,
    },
    /// Not even a homography can be fitted.
    #[error(transparent)]
    Homography(#[from] HomographyError),
    /// The points do not fix the parameters: too few radii, or too few points in general position.
    #[error(
        "{points} points do not fix homography and distortion (smallest pivot {pivot:.1e}): add points at other \
         radii, or hold the centre"
    )]
    NotIdentifiable {
        /// Number of points.
        points: usize,
        /// Smallest relative pivot of the normal equations.
        pivot: f64,
    },
    /// There is too little distortion to see its centre.
    #[error(
        "the data show no distortion (chi-square {chi_square:.1} on 2 degrees of freedom, less than {threshold:.1}), so \
         its centre cannot be found: hold it"
    )]
    CentreNotIdentifiable {
        /// `k^T C^-1 k` of `k = (k1, k2)` with the centre held.
        chi_square: f64,
        /// What it takes to release the centre.
        threshold: f64,
    },
}

/// Distortion counts as seen when `k^T C^-1 k` exceeds the 99.9 % quantile of chi-square on 2 degrees of
/// freedom, `-2 ln 0.001`.
const SEEN_DISTORTION: f64 = 13.815510557964274;

/// Uncertainty to first order, from the residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct SinglePlaneSpread {
    /// Standard deviation of a pixel coordinate: `sqrt(sum |r|^2 / degrees of freedom)`, px.
    pub sigma_px: f64,
    /// Covariance of `k1, k2, cu, cv`; zero where the centre was held.
    pub lens: Matrix4<f64>,
    /// Covariance of the homography's first eight entries, row by row, at the scale `h33 = 1`, and then `k1,
    /// k2, cu, cv`. `None` if the target's origin lies on the horizon, where that scale does not exist.
    pub all: Option<DMatrix<f64>>,
}

/// A lens, and how it saw one plane.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SinglePlane {
    /// Ideal pixel of a target point.
    pub ideal_from_target: Homography,
    /// `k1`, `k2` in the gauge `focal_px`.
    pub distortion: BrownConrady,
    /// The distortion centre, px.
    pub centre_px: Vec2,
    /// The gauge length, px.
    pub focal_px: f64,
    /// Predicted minus observed pixel, one a point.
    pub residuals_px: Vec<Vec2>,
    /// `sqrt(mean |r|^2)`, per point, px.
    pub rms_px: f64,
    /// `2 N - p`.
    pub degrees_of_freedom: usize,
    /// Uncertainty; `None` without degrees of freedom.
    pub spread: Option<SinglePlaneSpread>,
    /// How the refinement ended.
    pub termination: Termination,
    /// Refinement steps tried.
    pub iterations: usize,
}

impl SinglePlane {
    /// The lens as a camera: `focal_px` for both focal lengths, the centre as principal point. It is the
    /// camera up to the gauge: right for correcting and distorting pixels, not for distances.
    pub fn lens_camera(&self) -> Camera {
        lens_camera(self.focal_px, &self.centre_px, self.distortion)
    }

    /// Where an ideal lens would have shown what is seen at `pixel`; in pixels, not in target units.
    ///
    /// # Errors
    /// Outside the monotone radius of the lens model.
    pub fn correct_pixel(&self, pixel: &Vec2) -> Result<Vec2, UndistortError> {
        self.lens_camera().correct_pixel(pixel)
    }

    /// The target point seen at `pixel`; the inner `None` on the horizon.
    ///
    /// # Errors
    /// Outside the monotone radius of the lens model.
    pub fn target_from_pixel(&self, pixel: &Vec2) -> Result<Option<Vec2>, UndistortError> {
        let ideal = self.correct_pixel(pixel)?;
        Ok(self.ideal_from_target.inverse().and_then(|target_from_ideal| target_from_ideal.apply(&ideal)))
    }
}

/// The RMS per point to expect from `points` points under noise of `sigma_px` a coordinate, and its standard
/// deviation, px.
///
/// `sum |r|^2 / sigma^2` follows chi-square with `n = 2 N - p` degrees of freedom to first order, so `E[RMS]
/// = sigma sqrt(n / N)` and `sd(RMS) = sigma / sqrt(2 N)`, each short of the exact moment of the chi
/// distribution by less than `1 / (4 n)` relative.
pub fn predicted_rms_px(sigma_px: f64, points: usize, parameters: usize) -> (f64, f64) {
    let degrees = (2 * points).saturating_sub(parameters) as f64;
    (sigma_px * (degrees / points as f64).sqrt(), sigma_px / (2.0 * points as f64).sqrt())
}

/// Calibrates the lens from one view of a plane: minimises the squared distances between predicted and
/// observed pixels over the homography, `k1`, `k2` and, if asked, the centre, by Levenberg-Marquardt from a
/// fitted homography without distortion. A free centre is released once `k1` and `k2` have settled: without
/// distortion it has no effect to follow.
///
/// # Errors
/// Too few points, no homography, or parameters that the points do not fix.
///
/// ```
/// use calibench::calibrate::single_plane::{SinglePlaneOptions, calibrate_single_plane};
/// use calibench::synth::Scene;
///
/// let scene = Scene::example();
/// let camera = &scene.truth.camera;
/// let centre_px = calibench::geometry::Vec2::new(camera.cx, camera.cy);
/// let options = SinglePlaneOptions { focal_px: camera.fx, centre_px, centre_free: false };
/// let lens = calibrate_single_plane(&scene.exact()[1], &options)?;
/// // With the camera's own focal length and centre the coefficients are the camera's own.
/// assert!((lens.distortion.k1 - camera.distortion.k1).abs() < 1e-6);
/// # Ok::<(), calibench::calibrate::single_plane::SinglePlaneError>(())
/// ```
pub fn calibrate_single_plane(
    view: &View,
    options: &SinglePlaneOptions,
) -> Result<SinglePlane, SinglePlaneError> {
    let parameters = if options.centre_free { PARAMETERS } else { PARAMETERS - 2 };
    let (start, frames) = start(view, options, parameters)?;
    let mut outcome = refine::refine(&frames, view, start, PARAMETERS - 2)?;
    if options.centre_free {
        refuse_unseen_centre(&frames, view, &outcome)?;
        let held_iterations = outcome.iterations;
        outcome = refine::refine(&frames, view, outcome.parameters, PARAMETERS)?;
        outcome.iterations += held_iterations;
    }
    let residuals_px: Vec<Vec2> = frames.residuals(view, &outcome.parameters).collect();
    let square: f64 = residuals_px.iter().map(Vec2::norm_squared).sum();
    let degrees_of_freedom = 2 * view.len() - parameters;
    let spread = (degrees_of_freedom > 0).then(|| {
        let sigma_px = (square / degrees_of_freedom as f64).sqrt();
        spread(&frames, &outcome.parameters, &(outcome.unit_covariance * (sigma_px * sigma_px)), sigma_px)
    });
    Ok(SinglePlane {
        ideal_from_target: frames.homography(&outcome.parameters),
        distortion: frames.lens(&outcome.parameters),
        centre_px: frames.centre(&outcome.parameters),
        focal_px: options.focal_px,
        rms_px: (square / view.len() as f64).sqrt(),
        residuals_px,
        degrees_of_freedom,
        spread,
        termination: outcome.termination,
        iterations: outcome.iterations,
    })
}

/// The homography without distortion, in frames that make all numbers of order one.
fn start(
    view: &View,
    options: &SinglePlaneOptions,
    parameters: usize,
) -> Result<(ParameterVector, Frames), SinglePlaneError> {
    let (focal_px, centre) = (options.focal_px, options.centre_px);
    if !(focal_px > 0.0 && focal_px.is_finite() && centre.x.is_finite() && centre.y.is_finite()) {
        return Err(SinglePlaneError::Options { focal_px, centre_u: centre.x, centre_v: centre.y });
    }
    let need = parameters.div_ceil(2);
    if view.len() < need {
        return Err(SinglePlaneError::TooFewPoints { parameters, need, got: view.len() });
    }
    let frames = Frames::of(view, focal_px, centre);
    let from: Vec<Vec2> = view.points().iter().map(|p| frames.target_offset(p)).collect();
    let to: Vec<Vec2> = view.pixels().iter().map(|p| frames.pixel_offset(p)).collect();
    let fit = Homography::fit(&from, &to)?;
    Ok((frames.start(&fit.homography), frames))
}

fn spread(
    frames: &Frames,
    at: &ParameterVector,
    covariance: &SMatrix<f64, PARAMETERS, PARAMETERS>,
    sigma_px: f64,
) -> SinglePlaneSpread {
    // The last four parameters: k1, k2 and the centre in units of the gauge length.
    let mut to_px = SMatrix::<f64, PARAMETERS, PARAMETERS>::identity();
    to_px[(10, 10)] = frames.focal_px;
    to_px[(11, 11)] = frames.focal_px;
    let scaled = to_px * covariance * to_px;
    let lens = scaled.fixed_view::<4, 4>(8, 8).into_owned();
    let (left, right): (Mat3, Mat3) = (frames.ideal_from_offset(), frames.offset_from_target());
    let entries = change_frames(&left, &frames.local(at), &right, &scaled);
    let all = entries.map(|c| DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| c[(i, j)]));
    SinglePlaneSpread { sigma_px, lens, all }
}

/// Without distortion every centre fits: the held fit must show some.
fn refuse_unseen_centre(frames: &Frames, view: &View, held: &Outcome) -> Result<(), SinglePlaneError> {
    let square: f64 = frames.residuals(view, &held.parameters).map(|r| r.norm_squared()).sum();
    let variance = square / (2 * view.len() - (PARAMETERS - 2)) as f64;
    let covariance = held.unit_covariance.fixed_view::<2, 2>(8, 8) * variance;
    let k = held.parameters.fixed_rows::<2>(8).into_owned();
    let chi_square = covariance.cholesky().map_or(f64::INFINITY, |c| k.dot(&c.solve(&k)));
    if chi_square > SEEN_DISTORTION {
        Ok(())
    } else {
        Err(SinglePlaneError::CentreNotIdentifiable { chi_square, threshold: SEEN_DISTORTION })
    }
}

fn lens_camera(focal_px: f64, centre: &Vec2, distortion: BrownConrady) -> Camera {
    Camera::pinhole(focal_px, focal_px, centre.x, centre.y).with_distortion(distortion)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose, Vec3, rotation};

    #[test]
    fn the_expected_rms_is_that_of_the_degrees_of_freedom() {
        // 0.1 sqrt((100 - 10) / 50) and 0.1 / sqrt(100).
        let (rms_px, sd_px) = predicted_rms_px(0.1, 50, 10);
        assert!((rms_px - 0.134_164_078_649_987_4).abs() < 1e-15 && (sd_px - 0.01).abs() < 1e-15);
        assert_eq!(predicted_rms_px(0.1, 5, 10).0, 0.0);
    }

    /// A lens about (326, 243), and what it sees of a tilted board: marks, ideal pixels and pixels with
    /// noise.
    fn seen(k1: f64, noise_px: f64) -> (Camera, View, Vec<Vec2>) {
        let ideal = Camera::pinhole(600.0, 600.0, 326.0, 243.0);
        let camera = ideal.with_distortion(BrownConrady::radial(k1, -0.25 * k1));
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.35, -0.2, 0.1),
            translation: Vec3::new(3.0, -2.0, 120.0),
        };
        let points: Vec<Vec2> =
            (0..63).map(|i| Vec2::new(f64::from(i % 9) - 3.0, f64::from(i / 9) - 2.0) * 10.0).collect();
        let image = |camera: &Camera| -> Vec<Vec2> {
            points.iter().map(|p| camera.project(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap()).collect()
        };
        let noise = |k: f64| noise_px * std::f64::consts::SQRT_2 * libm::sin(0.7 * k * k);
        let observed = image(&camera).into_iter().enumerate().map(|(i, pixel)| {
            let k = 2.0 * i as f64;
            pixel + Vec2::new(noise(k + 1.0), noise(k + 2.0))
        });
        let view = View::new(points.clone(), observed.collect()).unwrap();
        (camera, view, image(&ideal))
    }

    fn options(off: Vec2, centre_free: bool) -> SinglePlaneOptions {
        SinglePlaneOptions { focal_px: 600.0, centre_px: Vec2::new(326.0, 243.0) + off, centre_free }
    }

    #[test]
    fn exact_pixels_tell_the_lens_its_centre_and_the_plane() {
        let (camera, view, ideal) = seen(-0.18, 0.0);
        for (off, centre_free) in [(Vec2::zeros(), false), (Vec2::new(9.0, -7.0), true)] {
            let found = calibrate_single_plane(&view, &options(off, centre_free)).unwrap();
            assert!((found.centre_px - Vec2::new(326.0, 243.0)).norm() < 1e-6);
            assert!((found.distortion.k1 - camera.distortion.k1).abs() < 1e-8);
            assert!((found.distortion.k2 - camera.distortion.k2).abs() < 1e-7);
            for ((point, pixel), ideal) in view.pairs().zip(&ideal) {
                assert!((found.ideal_from_target.apply(point).unwrap() - ideal).norm() < 1e-6);
                assert!((found.correct_pixel(pixel).unwrap() - ideal).norm() < 1e-6);
                assert!((found.target_from_pixel(pixel).unwrap().unwrap() - point).norm() < 1e-6);
            }
        }
    }

    /// What the lens with this homography and these coefficients shows of a point.
    fn predicted(h: &Mat3, k: Vec2, point: &Vec2) -> Vec2 {
        let ideal = Homography(*h).apply(point).unwrap();
        lens_camera(600.0, &Vec2::new(326.0, 243.0), BrownConrady::radial(k.x, k.y))
            .project(&Vec3::new((ideal.x - 326.0) / 600.0, (ideal.y - 243.0) / 600.0, 1.0))
            .unwrap()
    }

    #[test]
    fn residuals_and_deviations_are_those_of_least_squares_in_pixels() {
        let (_, view, _) = seen(-0.18, 0.1);
        let found = calibrate_single_plane(&view, &options(Vec2::zeros(), false)).unwrap();
        let (h, k) = (found.ideal_from_target.0, Vec2::new(found.distortion.k1, found.distortion.k2));
        let mut square = 0.0;
        for ((point, pixel), residual) in view.pairs().zip(&found.residuals_px) {
            assert!((predicted(&h, k, point) - pixel - residual).norm() < 1e-9);
            square += residual.norm_squared();
        }
        // 126 coordinates; eight entries of a homography and two coefficients.
        let spread = found.spread.unwrap();
        assert_eq!(found.degrees_of_freedom, 116);
        assert!((found.rms_px / (square / 63.0).sqrt() - 1.0).abs() < 1e-12);
        assert!((spread.sigma_px / (square / 116.0).sqrt() - 1.0).abs() < 1e-12);
        // The covariance of k1 and k2 by central differences: any eight numbers of the homography do.
        let moved = |column: usize, part: f64| {
            let (mut h, mut k) = (h, k);
            match column {
                8 | 9 => k[column - 8] += part,
                _ => h[(column / 3, column % 3)] *= 1.0 + part,
            }
            view.points().iter().map(|point| predicted(&h, k, point)).collect::<Vec<_>>()
        };
        let columns: Vec<(Vec<Vec2>, Vec<Vec2>)> =
            (0..10).map(|j| (moved(j, 1e-6), moved(j, -1e-6))).collect();
        let jacobian = DMatrix::from_fn(126, 10, |i, j| {
            (columns[j].0[i / 2][i % 2] - columns[j].1[i / 2][i % 2]) / 2e-6
        });
        let covariance = (jacobian.transpose() * &jacobian).try_inverse().unwrap() * (square / 116.0);
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            let ratio = spread.lens[(i, j)] / covariance[(8 + i, 8 + j)];
            assert!((ratio - 1.0).abs() < 1e-3, "{i} {j}: {ratio}");
        }
        assert_eq!(spread.lens[(2, 2)], 0.0);
    }

    #[test]
    fn a_centre_is_looked_for_where_distortion_is_seen() {
        for (k1, is_seen) in [(0.0, false), (-0.18, true)] {
            let (_, view, _) = seen(k1, 0.1);
            let held = calibrate_single_plane(&view, &options(Vec2::zeros(), false)).unwrap();
            let covariance = held.spread.unwrap().lens.fixed_view::<2, 2>(0, 0).into_owned();
            let k = Vec2::new(held.distortion.k1, held.distortion.k2);
            let expected = k.dot(&(covariance.try_inverse().unwrap() * k));
            assert_eq!(expected > SEEN_DISTORTION, is_seen, "{expected}");
            match calibrate_single_plane(&view, &options(Vec2::zeros(), true)) {
                Ok(found) => assert!(is_seen && (found.centre_px - Vec2::new(326.0, 243.0)).norm() < 20.0),
                Err(SinglePlaneError::CentreNotIdentifiable { chi_square, .. }) => {
                    assert!(
                        !is_seen && (chi_square / expected - 1.0).abs() < 1e-6,
                        "{chi_square} {expected}"
                    );
                }
                Err(other) => panic!("{other}"),
            }
        }
    }
}
