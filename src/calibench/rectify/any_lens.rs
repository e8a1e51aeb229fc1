//! What would another lens have shown? Rectification of photographs through a lens of any model.

use super::{RectifyError, RectifyMap};
use crate::camera::{Camera, Lens, Model};
use crate::geometry::{Vec2, Vec3};

/// What the output shows, with the photograph's focal lengths and principal point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Projection {
    /// A pinhole: straight lines are straight; `u = fx X / Z + cx`. Sees less than 180 degrees.
    Pinhole,
    /// An equidistant fisheye: the distance from the principal point is the angle from the axis times the
    /// focal length.
    Equidistant,
    /// Longitude along u and latitude along v: `X : Y : Z = sin a cos b : sin b : cos a cos b` with
    /// `u = fx a + cx`, `v = fy b + cy`.
    Equirectangular,
}

impl Projection {
    /// The ray that an output pixel shows; `None` where there is none.
    fn ray(self, camera: &Camera<Lens>, pixel: &Vec2) -> Option<Vec3> {
        let (x, y) = ((pixel.x - camera.cx) / camera.fx, (pixel.y - camera.cy) / camera.fy);
        match self {
            Projection::Pinhole => Some(Vec3::new(x, y, 1.0).normalize()),
            Projection::Equidistant => Lens::ideal(Model::KannalaBrandt).ray(&Vec2::new(x, y)).ok(),
            Projection::Equirectangular => {
                let is_on_sphere = x.abs() <= std::f64::consts::PI && y.abs() <= std::f64::consts::FRAC_PI_2;
                let (sin_a, cos_a) = libm::sincos(x);
                let (sin_b, cos_b) = libm::sincos(y);
                is_on_sphere.then(|| Vec3::new(sin_a * cos_b, sin_b, cos_a * cos_b))
            }
        }
    }

    /// The camera of the output, where it is one that a lens model describes: a pinhole or an equidistant
    /// fisheye without skew.
    pub fn camera(self, camera: &Camera<Lens>) -> Option<Camera<Lens>> {
        let model = match self {
            Projection::Pinhole => Model::BrownConrady,
            Projection::Equidistant => Model::KannalaBrandt,
            Projection::Equirectangular => return None,
        };
        Some(Camera::with_lens(camera.fx, camera.fy, camera.cx, camera.cy, Lens::ideal(model)))
    }
}

impl RectifyMap {
    /// The table that shows a photograph of `size` px through `camera` in another projection, at the same
    /// size. What lies beyond the angle up to which the lens model is one-to-one has no data.
    ///
    /// # Errors
    /// Photographs of fewer than 2 x 2 pixels.
    ///
    /// ```
    /// use calibench::camera::{Camera, Lens, Model};
    /// use calibench::raster::Raster;
    /// use calibench::rectify::{Projection, RectifyMap};
    ///
    /// let lens = Lens::new(Model::KannalaBrandt, &[0.01, 0.0, 0.0, 0.0])?;
    /// let fisheye = Camera::with_lens(20.0, 20.0, 31.5, 23.5, lens);
    /// let map = RectifyMap::through_lens(&fisheye, (64, 48), Projection::Pinhole)?;
    /// let grey = Raster::from_fn(64, 48, |_, _| 90u8);
    /// assert_eq!(map.apply(&grey, 0)?.get(31, 23), 90);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn through_lens(
        camera: &Camera<Lens>,
        size: (usize, usize),
        projection: Projection,
    ) -> Result<RectifyMap, RectifyError> {
        let rim = libm::cos(camera.distortion.monotone_angle());
        RectifyMap::new(size, size, |pixel| {
            let ray = projection.ray(camera, pixel).filter(|ray| ray.z > rim)?;
            camera.pixel(&ray)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::BrownConrady;

    #[test]
    fn a_pinholes_lens_is_undone_as_its_own_table_does() {
        let plain = Camera::pinhole(60.0, 61.0, 31.0, 23.0).with_distortion(BrownConrady::radial(-0.1, 0.02));
        let ideal = Camera::pinhole(60.0, 61.0, 31.0, 23.0);
        let own = RectifyMap::between(&plain, (64, 48), &ideal, (64, 48)).unwrap();
        let any = RectifyMap::through_lens(&plain.into(), (64, 48), Projection::Pinhole).unwrap();
        let ramp = crate::raster::Raster::from_fn(64, 48, |x, y| (x * 3 + y) as f32);
        let (a, b) = (own.apply(&ramp, -1.0).unwrap(), any.apply(&ramp, -1.0).unwrap());
        for (a, b) in a.samples().iter().zip(b.samples()) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
    }

    #[test]
    fn every_projection_shows_each_ray_where_it_says() {
        let lens = Lens::new(Model::KannalaBrandt, &[-0.02, 0.003, 0.0, 0.0]).unwrap();
        let camera = Camera::with_lens(200.0, 210.0, 319.5, 239.5, lens);
        for projection in [Projection::Pinhole, Projection::Equidistant, Projection::Equirectangular] {
            let centre = projection.ray(&camera, &Vec2::new(319.5, 239.5)).unwrap();
            assert!((centre - Vec3::z()).norm() < 1e-12);
            // 0.5 rad, or its tangent, to the right and down.
            let step = if projection == Projection::Pinhole { libm::tan(0.5) } else { 0.5 };
            for (pixel, wanted) in [
                (Vec2::new(319.5 + 200.0 * step, 239.5), Vec3::new(libm::sin(0.5), 0.0, libm::cos(0.5))),
                (Vec2::new(319.5, 239.5 + 210.0 * step), Vec3::new(0.0, libm::sin(0.5), libm::cos(0.5))),
            ] {
                assert!((projection.ray(&camera, &pixel).unwrap() - wanted).norm() < 1e-12, "{projection:?}");
            }
        }
        let beyond = Projection::Equirectangular.ray(&camera, &Vec2::new(319.5, 239.5 + 210.0 * 1.6));
        assert_eq!(beyond, None);
    }
}
