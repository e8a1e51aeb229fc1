//! Where does a pixel of the photograph lie in the rectified image, and the other way round?

use crate::camera::{Camera, UndistortError};
use crate::geometry::Vec2;

/// The pixels of a rectified image in which `pixels` of the photograph are shown: the correction of points,
/// for `output` the same `K` without distortion. One answer a pixel; results are in pixels of `output`, not
/// in target units.
///
/// ```
/// use calibench::camera::{BrownConrady, Camera};
/// use calibench::geometry::Vec2;
/// use calibench::rectify::rectify_points;
///
/// let ideal = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
/// let camera = ideal.with_distortion(BrownConrady::radial(-0.18, 0.06));
/// // What a barrel lens draws in goes out again; the centre stays.
/// let seen = [camera.distort_pixel(&Vec2::new(620.0, 60.0)), Vec2::new(320.0, 240.0)];
/// let corrected: Vec<Vec2> = rectify_points(&camera, &ideal, &seen).into_iter().collect::<Result<_, _>>()?;
/// assert!((corrected[0] - Vec2::new(620.0, 60.0)).norm() < 1e-9);
/// assert!((corrected[1] - seen[1]).norm() < 1e-12);
/// # Ok::<(), calibench::camera::UndistortError>(())
/// ```
pub fn rectify_points(
    camera: &Camera,
    output: &Camera,
    pixels: &[Vec2],
) -> Vec<Result<Vec2, UndistortError>> {
    pixels
        .iter()
        .map(|pixel| {
            Ok(output.pixel_from_normalised(&output.distortion.distort(&camera.normalised_ray(pixel)?)))
        })
        .collect()
}

/// The pixel of the photograph that shows what `pixel` of an output image shows; `None` where the lens model,
/// of either camera, has folded back: what it predicts there is seen elsewhere already.
pub fn source_pixel(camera: &Camera, output: &Camera, pixel: &Vec2) -> Option<Vec2> {
    source_within(camera, output, camera.distortion.monotone_radius(), pixel)
}

/// [`source_pixel`] with the monotone radius of the photograph's lens given: finding it costs more than the
/// rest.
pub(super) fn source_within(camera: &Camera, output: &Camera, radius: f64, pixel: &Vec2) -> Option<Vec2> {
    let seen = output.normalised_from_pixel(pixel);
    let ray = if output.distortion.is_ideal() { seen } else { output.distortion.undistort(&seen).ok()? };
    let lens = &camera.distortion;
    let unfolded = ray.norm_squared() <= radius * radius && lens.jacobian(&ray).determinant() > 0.0;
    unfolded.then(|| camera.pixel_from_normalised(&lens.distort(&ray)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::BrownConrady;

    #[test]
    fn points_and_their_sources_cancel() {
        let lens = BrownConrady { k1: -0.18, k2: 0.05, p1: 1e-3, p2: -2e-3, k3: 0.0 };
        let camera = Camera::pinhole(600.0, 590.0, 326.0, 243.0).with_distortion(lens);
        let output = Camera::pinhole(500.0, 510.0, 310.0, 250.0);
        let pixels: Vec<Vec2> =
            (0..48).map(|i| Vec2::new(f64::from(i) * 13.0, f64::from(i % 7) * 60.0)).collect();
        for (pixel, rectified) in pixels.iter().zip(rectify_points(&camera, &output, &pixels)) {
            let back = source_pixel(&camera, &output, &rectified.unwrap()).unwrap();
            // Four maps of pixels near 640 at a few ulp each: 640 eps is 1.4e-13.
            assert!((back - pixel).norm() < 2e-12);
        }
    }

    #[test]
    fn a_folded_lens_shows_nothing_twice() {
        // Folds at normalised radius 1.054: u = 640 of f = 300 about 320 is at 1.0667.
        let camera =
            Camera::pinhole(300.0, 300.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.3, 0.0));
        let output = Camera::pinhole(300.0, 300.0, 320.0, 240.0);
        assert_eq!(source_pixel(&camera, &output, &Vec2::new(640.0, 240.0)), None);
        assert!(source_pixel(&camera, &output, &Vec2::new(630.0, 240.0)).is_some());
        let far = rectify_points(&camera, &output, &[Vec2::new(320.0, 240.0), Vec2::new(600.0, 240.0)]);
        assert!(far[0].is_ok() && far[1].is_err());
    }
}
