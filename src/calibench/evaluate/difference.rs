//! How do two cameras differ? Their projections compared over the frame.
//!
//! Rays of camera A are turned by the rotation that makes B's pixels meet A's best, in least squares over the
//! frame: a calibration cannot tell where its camera looks, so a rotation that all poses share is no
//! difference of the lenses (the implied transformation of mrcal; Kogan 2021). Where the points lie at one
//! distance, a translation may be taken out as well.

use crate::camera::{Camera, Parameter, project_with_jacobian};
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use nalgebra::{DMatrix, DVector};

/// What is taken out of a difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TakenOut {
    /// The best rotation: for points at any distance.
    Rotation,
    /// The best rotation and translation, for points at this distance from the camera.
    RotationAndTranslation {
        /// In the unit in which the translation is to be known.
        distance: f64,
    },
}

impl TakenOut {
    fn distance(self) -> f64 {
        match self {
            TakenOut::Rotation => 1.0,
            TakenOut::RotationAndTranslation { distance } => distance,
        }
    }

    /// Unknowns of the motion.
    fn unknowns(self) -> usize {
        match self {
            TakenOut::Rotation => 3,
            TakenOut::RotationAndTranslation { .. } => 6,
        }
    }
}

/// The difference at one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelDifference {
    /// Pixel of camera A.
    pub pixel: Vec2,
    /// What camera B shows at another place: its pixel less that of A, px.
    pub difference: Vec2,
}

/// The difference over the frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameDifference {
    /// Row by row from the top, those left out at which a lens folds back.
    pub nodes: Vec<PixelDifference>,
    /// What was taken out: from coordinates of camera A to those of camera B.
    pub b_from_a: Pose,
    /// `sqrt(sum |d|^2 / N)` over the nodes, px.
    pub rms_px: f64,
}

impl FrameDifference {
    /// The node with the largest difference.
    pub fn largest(&self) -> Option<&PixelDifference> {
        self.nodes.iter().max_by(|a, b| a.difference.norm().total_cmp(&b.difference.norm()))
    }

    /// Angle of the rotation taken out, rad.
    pub fn rotation_rad(&self) -> f64 {
        rotation::log(&self.b_from_a.rotation).norm()
    }
}

/// Why cameras cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DifferenceError {
    /// Too little of the frame is seen by both.
    #[error(
        "both cameras are defined at {got} of the frame's nodes, and {need} are needed: a lens folds back within the frame"
    )]
    TooFewNodes {
        /// Nodes needed.
        need: usize,
        /// Nodes at which both are defined.
        got: usize,
    },
    /// The distance is no distance.
    #[error("the distance must be positive and finite, got {0}")]
    Distance(f64),
    /// A parameter that neither calibration estimated has two values.
    #[error("{0} was held in both calibrations, at different values: they cannot be one camera")]
    HeldApart(Parameter),
    /// A covariance is none.
    #[error("the sum of the covariances is not positive definite: was a parameter not determined?")]
    NotPositive,
    /// Nothing was estimated.
    #[error("neither calibration estimated anything")]
    NothingFree,
}

/// Nodes along the longer side of the frame.
const LONG_SIDE_NODES: usize = 30;
/// Least number of nodes: several for each of ten parameters and six numbers of a motion.
const LEAST_NODES: usize = 50;
/// Gauss-Newton steps; each squares the error, and the start is a fraction of a radian away.
const STEPS: usize = 20;

/// Pixels over the frame, row by row, in the middle of equal cells, and how many stand in a row.
pub fn frame_nodes((width, height): (usize, usize)) -> (Vec<Vec2>, usize) {
    let cell = width.max(height) as f64 / LONG_SIDE_NODES as f64;
    let count = |side: usize| libm::round(side as f64 / cell).max(1.0) as usize;
    let (columns, rows) = (count(width), count(height));
    let along = |i: usize, n: usize, side: usize| (i as f64 + 0.5) * side as f64 / n as f64 - 0.5;
    let row =
        |j: usize| (0..columns).map(move |i| Vec2::new(along(i, columns, width), along(j, rows, height)));
    ((0..rows).flat_map(row).collect(), columns)
}

/// The points that camera A sees at the nodes, at the distance; those left out at which one of the lenses
/// folds back.
fn points_seen(a: &Camera, b: &Camera, size: (usize, usize), distance: f64) -> Vec<(Vec2, Vec3)> {
    let limit = b.distortion.monotone_radius();
    let point = |pixel: &Vec2| {
        let ray = a.normalised_ray(pixel).ok().filter(|ray| ray.norm() < limit)?;
        Some((*pixel, distance * Vec3::new(ray.x, ray.y, 1.0).normalize()))
    };
    frame_nodes(size).0.iter().filter_map(point).collect()
}

/// The difference of projection of B against A over a frame, without the motion that fits best.
///
/// # Errors
/// [`DifferenceError::TooFewNodes`], [`DifferenceError::Distance`].
///
/// ```
/// use calibench::camera::Camera;
/// use calibench::evaluate::{TakenOut, frame_difference};
///
/// let a = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
/// // A principal point 6 px further right is nearly a camera turned by a hundredth of a radian.
/// let b = Camera::pinhole(600.0, 600.0, 326.0, 240.0);
/// let difference = frame_difference(&a, &b, (640, 480), TakenOut::Rotation)?;
/// assert!((difference.rotation_rad() - 0.01).abs() < 2e-3);
/// assert!(difference.rms_px < 1.0);
/// # Ok::<(), calibench::evaluate::DifferenceError>(())
/// ```
pub fn frame_difference(
    a: &Camera,
    b: &Camera,
    size: (usize, usize),
    taken_out: TakenOut,
) -> Result<FrameDifference, DifferenceError> {
    let distance = taken_out.distance();
    if !(distance.is_finite() && distance > 0.0) {
        return Err(DifferenceError::Distance(distance));
    }
    let points = points_seen(a, b, size, distance);
    let enough = |got: usize| match got >= LEAST_NODES {
        true => Ok(()),
        false => Err(DifferenceError::TooFewNodes { need: LEAST_NODES, got }),
    };
    enough(points.len())?;
    let mut b_from_a = Pose::identity();
    for _ in 0..STEPS {
        let step = motion_step(b, &b_from_a, &points, taken_out);
        b_from_a = b_from_a.perturbed(&step);
        let size = Vec3::new(step[0], step[1], step[2]).norm()
            + Vec3::new(step[3], step[4], step[5]).norm() / distance;
        // A rounding of a radian moves no pixel.
        if size < 1e-15 {
            break;
        }
    }
    let seen = |(pixel, point): &(Vec2, Vec3)| {
        let difference = b.project(&b_from_a.apply(point))? - pixel;
        Some(PixelDifference { pixel: *pixel, difference })
    };
    let nodes: Vec<PixelDifference> = points.iter().filter_map(seen).collect();
    enough(nodes.len())?;
    let sum: f64 = nodes.iter().map(|node| node.difference.norm_squared()).sum();
    Ok(FrameDifference { rms_px: (sum / nodes.len() as f64).sqrt(), nodes, b_from_a })
}

/// A Gauss-Newton step of the motion: the least-squares solution of `J step = -d`.
fn motion_step(
    b: &Camera,
    pose: &Pose,
    points: &[(Vec2, Vec3)],
    taken_out: TakenOut,
) -> nalgebra::Vector6<f64> {
    let n = taken_out.unknowns();
    let mut normal = DMatrix::<f64>::zeros(n, n);
    let mut right = DVector::<f64>::zeros(n);
    let scale = motion_scale(taken_out);
    for (pixel, point) in points {
        let Ok(at) = project_with_jacobian(b, pose, point) else { continue };
        let difference = at.pixel - pixel;
        let jacobian = DMatrix::from_fn(2, n, |i, j| at.pose[(i, j)] * scale(j));
        normal += jacobian.transpose() * &jacobian;
        right -= jacobian.transpose() * difference;
    }
    let mut step = nalgebra::Vector6::zeros();
    if let Some(solved) = normal.cholesky().map(|factor| factor.solve(&right)) {
        (0..n).for_each(|j| step[j] = scale(j) * solved[j]);
    }
    step
}

/// The unit of each number of the motion: radians, and distances.
fn motion_scale(taken_out: TakenOut) -> impl Fn(usize) -> f64 {
    move |j| if j < 3 { 1.0 } else { taken_out.distance() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Parameter;
    use crate::synth::Truth;

    const SIZE: (usize, usize) = Truth::EXAMPLE_IMAGE;

    #[test]
    fn a_principal_point_apart_is_mostly_a_rotation() {
        let camera = Truth::example_camera();
        let same = frame_difference(&camera, &camera, SIZE, TakenOut::Rotation).unwrap();
        assert!(same.rms_px < 1e-12 && same.rotation_rad() < 1e-15);
        // A principal point 3 px off: most of it is a rotation by 3 / 600 rad, and what is left is what
        // perspective makes of it.
        let moved = camera.with(Parameter::Cx, camera.cx + 3.0);
        let left = frame_difference(&camera, &moved, SIZE, TakenOut::Rotation).unwrap();
        assert!((left.rotation_rad() - 3.0 / 600.0).abs() < 1e-3 && left.rms_px < 0.6, "{left:?}");
        assert!(left.rms_px > 0.05 && left.largest().unwrap().difference.norm() > left.rms_px);
    }

    #[test]
    fn at_one_distance_a_translation_imitates_a_focal_length() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let longer = camera.with(Parameter::Fx, 606.0).with(Parameter::Fy, 606.0);
        let far = frame_difference(&camera, &longer, SIZE, TakenOut::Rotation).unwrap();
        let near =
            frame_difference(&camera, &longer, SIZE, TakenOut::RotationAndTranslation { distance: 1000.0 })
                .unwrap();
        assert!(near.rms_px < 0.15 * far.rms_px, "{} against {}", near.rms_px, far.rms_px);
        // The camera stands nearer by about a hundredth of the distance.
        assert!((near.b_from_a.translation.z - 10.0).abs() < 3.0, "{}", near.b_from_a.translation);
        let nowhere = TakenOut::RotationAndTranslation { distance: 0.0 };
        assert_eq!(frame_difference(&camera, &longer, SIZE, nowhere), Err(DifferenceError::Distance(0.0)));
    }

    #[test]
    fn nodes_are_the_middles_of_equal_cells() {
        // Cells of one pixel: the pixels' centres themselves.
        let (nodes, columns) = frame_nodes((30, 20));
        assert_eq!((nodes.len(), columns), (600, 30));
        let centre = |i: usize| Vec2::new((i % 30) as f64, (i / 30) as f64);
        assert!(nodes.iter().enumerate().all(|(i, node)| (node - centre(i)).norm() < 1e-12));
        // Of four pixels each: between the second and the third.
        assert_eq!(frame_nodes((120, 80)).0[31], Vec2::new(5.5, 5.5));
    }
}
