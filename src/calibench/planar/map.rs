//! How does a pixel become a world point, and back, without losing digits to large coordinates?

use crate::geometry::{Mat3, Vec2, Vec3};
use nalgebra::{Matrix2, SMatrix};

/// A plane map, kept as a homography between offsets from two origins: `s [w - w0, 1]^T = L [p - p0, 1]^T`,
/// `l33 = 1`.
///
/// Its 3 x 3 matrix between absolute coordinates loses digits where world coordinates are large; this form
/// does not.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlaneMap {
    pub(super) pixel_origin: Vec2,
    pub(super) world_origin: Vec2,
    pub(super) local: Mat3,
    pub(super) local_inverse: Mat3,
}

impl PlaneMap {
    /// The map of a local homography scaled to `l33 = 1`; `None` if singular.
    pub(super) fn new(pixel_origin: Vec2, world_origin: Vec2, local: Mat3) -> Option<PlaneMap> {
        let inverse = local.try_inverse()?;
        // The pixel origin maps to the front, so its image must come back from the front: fixes the sign of
        // the inverse.
        let back = (inverse * Vec3::new(local[(0, 2)], local[(1, 2)], 1.0)).z;
        let local_inverse = if back < 0.0 { -inverse } else { inverse };
        Some(PlaneMap { pixel_origin, world_origin, local, local_inverse })
    }

    /// The 3 x 3 matrix `M` of `s [X Y 1]^T = M [u v 1]^T`, scaled to `m33 = 1` unless pixel (0, 0) lies on
    /// the horizon.
    pub fn matrix(&self) -> Mat3 {
        let product = translation(&self.world_origin) * self.local * translation(&-self.pixel_origin);
        if product[(2, 2)] != 0.0 { product / product[(2, 2)] } else { product }
    }

    /// The world point seen at a pixel; `None` on or behind the horizon of a projective map.
    pub fn world_from_pixel(&self, pixel: &Vec2) -> Option<Vec2> {
        Some(self.offset_from_pixel(&(pixel - self.pixel_origin))? + self.world_origin)
    }

    /// The pixel that shows a world point; `None` on or behind the vanishing line of a projective map.
    pub fn pixel_from_world(&self, world: &Vec2) -> Option<Vec2> {
        Some(project(&self.local_inverse, &(world - self.world_origin))? + self.pixel_origin)
    }

    /// World units per pixel at a pixel: `d(X, Y) / d(u, v)`; `None` on or behind the horizon.
    pub fn jacobian(&self, pixel: &Vec2) -> Option<Matrix2<f64>> {
        let p = pixel - self.pixel_origin;
        let w = self.offset_from_pixel(&p)?;
        let depth = (self.local * Vec3::new(p.x, p.y, 1.0)).z;
        let l = &self.local;
        Some(Matrix2::from_fn(|row, column| (l[(row, column)] - w[row] * l[(2, column)]) / depth))
    }

    /// The world offset of a pixel offset.
    pub(super) fn offset_from_pixel(&self, p: &Vec2) -> Option<Vec2> {
        project(&self.local, p)
    }

    /// Derivatives of the world offset by the first eight entries of `L`, row by row: 2 x 8.
    pub(super) fn entry_jacobian(&self, p: &Vec2) -> Option<SMatrix<f64, 2, 8>> {
        let w = self.offset_from_pixel(p)?;
        let depth = (self.local * Vec3::new(p.x, p.y, 1.0)).z;
        let a = Vec3::new(p.x, p.y, 1.0) / depth;
        let mut jacobian = SMatrix::zeros();
        for i in 0..3 {
            jacobian[(0, i)] = a[i];
            jacobian[(1, i + 3)] = a[i];
        }
        for i in 0..2 {
            jacobian[(0, i + 6)] = -w.x * a[i];
            jacobian[(1, i + 6)] = -w.y * a[i];
        }
        Some(jacobian)
    }
}

/// The homography that adds an offset.
pub(super) fn translation(offset: &Vec2) -> Mat3 {
    Mat3::new(1.0, 0.0, offset.x, 0.0, 1.0, offset.y, 0.0, 0.0, 1.0)
}

fn project(h: &Mat3, p: &Vec2) -> Option<Vec2> {
    let image = h * Vec3::new(p.x, p.y, 1.0);
    (image.z > 0.0).then(|| Vec2::new(image.x / image.z, image.y / image.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample() -> PlaneMap {
        let local = Mat3::new(0.02, 0.001, 0.3, -0.002, -0.021, 0.1, 4e-4, -3e-4, 1.0);
        PlaneMap::new(Vec2::new(320.0, 240.0), Vec2::new(4.0e5, -3.0e5), local).unwrap()
    }

    proptest! {
        #[test]
        fn a_pixel_survives_the_way_to_the_world_and_back(u in 0.0f64..640.0, v in 0.0f64..480.0) {
            let pixel = Vec2::new(u, v);
            let back = sample().pixel_from_world(&sample().world_from_pixel(&pixel).unwrap()).unwrap();
            // World coordinates near 4e5 are rounded to 2.9e-11; a pixel is 0.02 world units: 1.5e-9 px each.
            prop_assert!((back - pixel).norm() < 1e-8);
        }

        #[test]
        fn the_jacobian_agrees_with_central_differences(u in 0.0f64..640.0, v in 0.0f64..480.0) {
            let map = PlaneMap { world_origin: Vec2::zeros(), ..sample() };
            let world = |du: f64, dv: f64| map.world_from_pixel(&Vec2::new(u + du, v + dv)).unwrap();
            let h = 1e-3;
            let by_u = (world(h, 0.0) - world(-h, 0.0)) / (2.0 * h);
            let by_v = (world(0.0, h) - world(0.0, -h)) / (2.0 * h);
            let analytic = map.jacobian(&Vec2::new(u, v)).unwrap();
            // Offsets below 20 in 1e-16 steps over 2e-3 px; the third derivative leaves 1e-14.
            prop_assert!((analytic - Matrix2::from_columns(&[by_u, by_v])).norm() < 1e-11);
        }
    }

    #[test]
    fn beyond_the_horizon_there_is_no_world() {
        // l31 u + 1 = 0 at u = -2500.
        let far = Vec2::new(320.0 - 2600.0, 240.0);
        assert_eq!(sample().world_from_pixel(&far), None);
        assert_eq!(sample().jacobian(&far), None);
        assert!(sample().world_from_pixel(&Vec2::new(320.0 - 2400.0, 240.0)).is_some());
    }

    #[test]
    fn the_matrix_is_the_map() {
        let map = PlaneMap { world_origin: Vec2::new(4.0, 5.0), ..sample() };
        let image = map.matrix() * Vec3::new(100.0, 400.0, 1.0);
        let world = map.world_from_pixel(&Vec2::new(100.0, 400.0)).unwrap();
        assert!((image.xy() / image.z - world).norm() < 1e-13);
        assert_eq!(map.matrix()[(2, 2)], 1.0);
    }

    #[test]
    fn the_derivatives_by_the_entries_agree_with_central_differences() {
        let (map, p, h) = (sample(), Vec2::new(170.0, -90.0), 1e-6);
        let analytic = map.entry_jacobian(&p).unwrap();
        for entry in 0..8 {
            let offset = |step: f64| {
                let mut local = map.local;
                local[(entry / 3, entry % 3)] += step;
                PlaneMap { local, ..map }.offset_from_pixel(&p).unwrap()
            };
            // The lower entries are multiplied by pixels: a smaller step.
            let h = if entry < 6 { h } else { 1e-2 * h };
            let difference = (offset(h) - offset(-h)) / (2.0 * h);
            assert!((analytic.column(entry) - difference).norm() < 1e-5 * difference.norm(), "{entry}");
        }
    }
}
