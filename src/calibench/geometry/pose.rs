//! Where is one frame seen from another? A rigid motion that takes coordinates of frame B to frame A.

use super::{Mat3, Vec3, rotation};

/// A rigid motion `x_a = R x_b + t`. A variable of this type names both frames, target first to be applied
/// last: `cam_from_target` takes target coordinates to camera coordinates.
///
/// ```
/// use calibench::geometry::{Mat3, Pose, Vec3};
///
/// let cam_from_target = Pose { rotation: Mat3::identity(), translation: Vec3::new(0.0, 0.0, 120.0) };
/// let target_from_cam = cam_from_target.inverse();
/// let point = Vec3::new(10.0, 20.0, 0.0);
/// assert_eq!(cam_from_target.apply(&point), Vec3::new(10.0, 20.0, 120.0));
/// assert_eq!(target_from_cam.compose(&cam_from_target).apply(&point), point);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// `R`, a proper rotation.
    pub rotation: Mat3,
    /// `t`, in the unit of the points it moves (mm unless said otherwise).
    pub translation: Vec3,
}

impl Pose {
    /// The motion that changes nothing.
    pub fn identity() -> Pose {
        Pose { rotation: Mat3::identity(), translation: Vec3::zeros() }
    }

    /// `R p + t`.
    pub fn apply(&self, point: &Vec3) -> Vec3 {
        self.rotation * point + self.translation
    }

    /// The motion that undoes this one: `b_from_a` of `a_from_b`.
    pub fn inverse(&self) -> Pose {
        let rotation = self.rotation.transpose();
        Pose { rotation, translation: -(rotation * self.translation) }
    }

    /// `a_from_c = a_from_b * b_from_c`.
    pub fn compose(&self, b_from_c: &Pose) -> Pose {
        Pose { rotation: self.rotation * b_from_c.rotation, translation: self.apply(&b_from_c.translation) }
    }

    /// The pose moved by a small step `(rotation vector in rad, translation)`: `R <- exp(delta) R`, `t <- t +
    /// step`.
    pub fn perturbed(&self, step: &nalgebra::Vector6<f64>) -> Pose {
        let delta = Vec3::new(step[0], step[1], step[2]);
        Pose {
            rotation: rotation::exp(&delta) * self.rotation,
            translation: self.translation + Vec3::new(step[3], step[4], step[5]),
        }
    }

    /// The step that leads from `self` to `other`: the inverse of [`Pose::perturbed`].
    pub fn step_to(&self, other: &Pose) -> nalgebra::Vector6<f64> {
        let delta = rotation::log(&(other.rotation * self.rotation.transpose()));
        let step = other.translation - self.translation;
        nalgebra::Vector6::new(delta.x, delta.y, delta.z, step.x, step.y, step.z)
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.rotation.iter().chain(self.translation.iter()).all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    fn sample() -> Pose {
        Pose { rotation: rotation::from_xyz_rad(0.3, -0.7, 1.1), translation: Vec3::new(4.0, -5.0, 120.0) }
    }

    #[test]
    fn a_pose_and_its_inverse_cancel() {
        let both = sample().compose(&sample().inverse());
        assert!((both.rotation - Mat3::identity()).norm() < 1e-15);
        assert!(both.translation.norm() < 1e-13);
    }

    #[test]
    fn a_step_leads_where_it_was_measured() {
        let step = Vector6::new(0.01, -0.02, 0.03, 0.4, 0.5, -0.6);
        let moved = sample().perturbed(&step);
        assert!((sample().step_to(&moved) - step).norm() < 1e-13);
    }
}
