//! How do two cameras differ over the frame, whatever their lenses?
//!
//! As [`evaluate::frame_difference`](crate::evaluate::frame_difference), which knows one lens: rays of camera
//! A are turned by the rotation that makes B's pixels meet A's best, in least squares over the frame, and
//! where the points lie at one distance a translation may be taken out as well.

use super::slopes::Slopes;
use crate::camera::{Camera, Lens};
use crate::evaluate::difference::{PixelDifference, frame_nodes};
use crate::evaluate::{DifferenceError, FrameDifference, TakenOut};
use crate::geometry::{Pose, Vec2, Vec3};
use nalgebra::{DMatrix, DVector, Vector6};

/// Least number of nodes: several for each of some twenty parameters and six numbers of a motion.
const LEAST_NODES: usize = 50;
/// Gauss-Newton steps; each squares the error, and the start is a fraction of a radian away.
const STEPS: usize = 20;

/// What is taken out, as numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    /// Distance of the points.
    pub distance: f64,
    /// Unknowns: of the rotation, and of a translation.
    pub unknowns: usize,
}

impl Motion {
    pub fn of(taken_out: TakenOut) -> Result<Motion, DifferenceError> {
        match taken_out {
            TakenOut::Rotation => Ok(Motion { distance: 1.0, unknowns: 3 }),
            TakenOut::RotationAndTranslation { distance } if distance.is_finite() && distance > 0.0 => {
                Ok(Motion { distance, unknowns: 6 })
            }
            TakenOut::RotationAndTranslation { distance } => Err(DifferenceError::Distance(distance)),
        }
    }

    /// The unit of each number: radians, and distances.
    pub fn unit(&self, j: usize) -> f64 {
        if j < 3 { 1.0 } else { self.distance }
    }
}

/// The points that camera A sees at the nodes, at the distance; those left out at which one of the lenses is
/// not one-to-one.
pub(super) fn points_seen(
    a: &Camera<Lens>,
    b: &Camera<Lens>,
    size: (usize, usize),
    distance: f64,
) -> Vec<(Vec2, Vec3)> {
    let limit = b.distortion.monotone_angle();
    let point = |pixel: &Vec2| {
        let ray = a.ray(pixel).ok()?;
        let angle = libm::atan2(ray.xy().norm(), ray.z);
        (angle < limit).then_some((*pixel, distance * ray))
    };
    frame_nodes(size).0.iter().filter_map(point).collect()
}

/// Refuses too few nodes.
pub(super) fn enough(got: usize) -> Result<(), DifferenceError> {
    match got >= LEAST_NODES {
        true => Ok(()),
        false => Err(DifferenceError::TooFewNodes { need: LEAST_NODES, got }),
    }
}

/// The difference of projection of B against A over a frame, without the motion that fits best.
///
/// # Errors
/// [`DifferenceError::TooFewNodes`], [`DifferenceError::Distance`].
///
/// ```
/// use calibench::camera::{Camera, Lens, Model};
/// use calibench::evaluate::TakenOut;
/// use calibench::validate::frame_difference;
///
/// // A fisheye without further terms shows a ray at f theta; a double sphere with xi = 0 and alpha = 1/2 nearly so.
/// let fisheye = Camera::with_lens(300.0, 300.0, 320.0, 240.0, Lens::ideal(Model::KannalaBrandt));
/// let sphere = Camera::with_lens(300.0, 300.0, 320.0, 240.0, Lens::ideal(Model::DoubleSphere));
/// let difference = frame_difference(&fisheye, &sphere, (640, 480), TakenOut::Rotation)?;
/// // 2 f tan(theta / 2) against f theta: 28 px where theta is 1.
/// assert!(difference.rms_px > 10.0 && difference.rotation_rad() < 1e-3);
/// # Ok::<(), calibench::evaluate::DifferenceError>(())
/// ```
pub fn frame_difference(
    a: &Camera<Lens>,
    b: &Camera<Lens>,
    size: (usize, usize),
    taken_out: TakenOut,
) -> Result<FrameDifference, DifferenceError> {
    let motion = Motion::of(taken_out)?;
    let points = points_seen(a, b, size, motion.distance);
    enough(points.len())?;
    let mut b_from_a = Pose::identity();
    for _ in 0..STEPS {
        let step = motion_step(b, &b_from_a, &points, motion);
        b_from_a = b_from_a.perturbed(&step);
        let size = Vec3::new(step[0], step[1], step[2]).norm()
            + Vec3::new(step[3], step[4], step[5]).norm() / motion.distance;
        // A rounding of a radian moves no pixel.
        if size < 1e-15 {
            break;
        }
    }
    let seen = |(pixel, point): &(Vec2, Vec3)| {
        let difference = b.pixel(&b_from_a.apply(point))? - pixel;
        Some(PixelDifference { pixel: *pixel, difference })
    };
    let nodes: Vec<PixelDifference> = points.iter().filter_map(seen).collect();
    enough(nodes.len())?;
    let sum: f64 = nodes.iter().map(|node| node.difference.norm_squared()).sum();
    Ok(FrameDifference { rms_px: (sum / nodes.len() as f64).sqrt(), nodes, b_from_a })
}

/// A Gauss-Newton step of the motion: the least-squares solution of `J step = -d`.
fn motion_step(b: &Camera<Lens>, pose: &Pose, points: &[(Vec2, Vec3)], motion: Motion) -> Vector6<f64> {
    let n = motion.unknowns;
    let mut normal = DMatrix::<f64>::zeros(n, n);
    let mut right = DVector::<f64>::zeros(n);
    for (pixel, point) in points {
        let Some(at) = Slopes::of(b, pose, point) else { continue };
        let jacobian = DMatrix::from_fn(2, n, |i, j| at.by_pose[(i, j)] * motion.unit(j));
        normal += jacobian.transpose() * &jacobian;
        right -= jacobian.transpose() * (at.pixel - pixel);
    }
    let mut step = Vector6::zeros();
    if let Some(solved) = normal.cholesky().map(|factor| factor.solve(&right)) {
        (0..n).for_each(|j| step[j] = motion.unit(j) * solved[j]);
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{BrownConrady, Model};
    use crate::evaluate;

    const SIZE: (usize, usize) = (640, 480);

    #[test]
    fn with_brown_conradys_lens_it_is_the_difference_of_evaluate() {
        let a = Camera::pinhole(600.0, 598.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.2, 0.05));
        let b =
            Camera::pinhole(604.0, 601.0, 323.0, 238.0).with_distortion(BrownConrady::radial(-0.19, 0.04));
        for taken_out in [TakenOut::Rotation, TakenOut::RotationAndTranslation { distance: 500.0 }] {
            let of_one = evaluate::frame_difference(&a, &b, SIZE, taken_out).unwrap();
            let of_any = frame_difference(&a.into(), &b.into(), SIZE, taken_out).unwrap();
            assert_eq!(of_one.nodes.len(), of_any.nodes.len());
            let apart = |x: &PixelDifference, y: &PixelDifference| (x.difference - y.difference).norm();
            let largest =
                of_one.nodes.iter().zip(&of_any.nodes).map(|(x, y)| apart(x, y)).fold(0.0, f64::max);
            // The least squares end where a step is a rounding, at pixels of some hundreds.
            assert!(largest < 1e-9, "{largest:e}");
        }
    }

    #[test]
    fn a_turned_fisheye_is_the_same_camera_beyond_90_degrees_too() {
        let lens = Lens::new(Model::KannalaBrandt, &[-0.01, 0.002, 0.0, 0.0]).unwrap();
        let camera = Camera::with_lens(180.0, 181.0, 320.0, 240.0, lens);
        let same = frame_difference(&camera, &camera, SIZE, TakenOut::Rotation).unwrap();
        // The frame's corners are 400 px away: more than 120 degrees.
        assert!(same.rms_px < 1e-11 && same.nodes.len() == frame_nodes(SIZE).0.len());
        let nowhere = TakenOut::RotationAndTranslation { distance: -1.0 };
        assert_eq!(frame_difference(&camera, &camera, SIZE, nowhere), Err(DifferenceError::Distance(-1.0)));
    }
}
