//! What do scenes ask of a camera, whatever its lens? Where a point is seen, and whether only that one is.

use super::{BrownConrady, Camera, Lens};
use crate::geometry::{Vec2, Vec3};

/// A lens that a scene can be photographed with.
pub trait Imaging: Copy {
    /// The pixel of a point in camera coordinates; `None` where the lens has no image of it.
    fn image(camera: &Camera<Self>, point: &Vec3) -> Option<Vec2>;

    /// Tells of points in camera coordinates whether the lens is one-to-one from the axis out to them.
    fn one_to_one(&self) -> impl Fn(&Vec3) -> bool;
}

impl Imaging for BrownConrady {
    fn image(camera: &Camera, point: &Vec3) -> Option<Vec2> {
        camera.project(point)
    }

    fn one_to_one(&self) -> impl Fn(&Vec3) -> bool {
        let radius = self.monotone_radius();
        move |point| point.xy().norm() < radius * point.z
    }
}

/// A Brown-Conrady lens gives the bits of [`BrownConrady`].
impl Imaging for Lens {
    fn image(camera: &Camera<Lens>, point: &Vec3) -> Option<Vec2> {
        match camera.brown_conrady() {
            Some(plain) => plain.project(point),
            None => camera.pixel(point),
        }
    }

    fn one_to_one(&self) -> impl Fn(&Vec3) -> bool {
        let angle = self.monotone_angle();
        let plain = self.brown_conrady().map(|plain| plain.monotone_radius());
        move |point| match plain {
            Some(radius) => point.xy().norm() < radius * point.z,
            None => libm::atan2(point.xy().norm(), point.z) < angle,
        }
    }
}
