//! Which camera should the rectified image come from? The same, one that loses nothing, or one that shows
//! nothing empty.

use crate::camera::{BrownConrady, Camera, UndistortError};
use crate::geometry::Vec2;

/// What the rectified image shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputView {
    /// The same `K`: pixels keep their meaning; parts are lost or empty.
    SameK,
    /// Every pixel of the photograph; parts are empty.
    AllPixels,
    /// No empty pixel: the largest crop of the image's shape about the middle of what is valid.
    OnlyValid,
}

/// Why there is no such camera.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OutputCameraError {
    /// The lens model does not reach the image's border.
    #[error("the border pixel ({u}, {v}) cannot be corrected: {cause}; keep the same K instead")]
    Border {
        /// The pixel, u.
        u: f64,
        /// The pixel, v.
        v: f64,
        /// Why not.
        cause: UndistortError,
    },
    /// Borders bent so far that no rectangle lies inside, or an image of fewer than 2 x 2 pixels.
    #[error("no part of a {width} x {height} image is valid everywhere after correction")]
    NothingValid {
        /// Width, px.
        width: usize,
        /// Height, px.
        height: usize,
    },
}

/// The camera without distortion of a rectified image of the same size as the photograph.
///
/// The photograph's border (the centres of its outermost samples) is corrected pixel by pixel. `AllPixels`
/// fits the box around it into the image, `OnlyValid` fits the image into the box inside of it, both with one
/// magnification for u and v, so that pixels keep their shape.
///
/// # Errors
/// A border that the lens model does not reach, or no valid rectangle; never for `SameK`.
///
/// ```
/// use calibench::camera::{BrownConrady, Camera};
/// use calibench::geometry::Vec2;
/// use calibench::rectify::{OutputView, output_camera, source_pixel};
///
/// let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.18, 0.05));
/// let all = output_camera(&camera, (640, 480), OutputView::AllPixels)?;
/// let valid = output_camera(&camera, (640, 480), OutputView::OnlyValid)?;
/// // What shows more has the shorter focal length.
/// assert!(all.fx < camera.fx && valid.fx > all.fx);
/// // Its left side shows in its middle what the photograph has no pixel of; the crop is full to its corners.
/// let inside = |p: Vec2| p.x > -0.5 && p.x < 639.5 && p.y > -0.5 && p.y < 479.5;
/// assert!(!source_pixel(&camera, &all, &Vec2::new(0.0, 239.5)).is_some_and(inside));
/// assert!(source_pixel(&camera, &valid, &Vec2::zeros()).is_some_and(inside));
/// # Ok::<(), calibench::rectify::OutputCameraError>(())
/// ```
pub fn output_camera(
    camera: &Camera,
    size: (usize, usize),
    view: OutputView,
) -> Result<Camera, OutputCameraError> {
    let same_k = camera.with_distortion(BrownConrady::default());
    if view == OutputView::SameK {
        return Ok(same_k);
    }
    let (width, height) = size;
    let nothing = OutputCameraError::NothingValid { width, height };
    if width < 2 || height < 2 {
        return Err(nothing);
    }
    let outward = view == OutputView::AllPixels;
    let [left, right, top, bottom] = corrected_extents(camera, size, outward)?;
    if !(left < right && top < bottom) {
        return Err(nothing);
    }
    let wide = (width - 1) as f64 / ((right - left) * camera.fx);
    let high = (height - 1) as f64 / ((bottom - top) * camera.fy);
    let magnification = if outward { wide.min(high) } else { wide.max(high) };
    let (fx, fy) = (magnification * camera.fx, magnification * camera.fy);
    let cx = 0.5 * (width - 1) as f64 - fx * 0.5 * (left + right);
    let cy = 0.5 * (height - 1) as f64 - fy * 0.5 * (top + bottom);
    Ok(Camera::pinhole(fx, fy, cx, cy))
}

/// Left, right, top and bottom of the box around (`outward`) or inside of the corrected border, normalised
/// coordinates.
fn corrected_extents(
    camera: &Camera,
    size: (usize, usize),
    outward: bool,
) -> Result<[f64; 4], OutputCameraError> {
    let (last_u, last_v) = ((size.0 - 1) as f64, (size.1 - 1) as f64);
    let column = |u: f64| corrected(camera, (0..size.1).map(move |v| Vec2::new(u, v as f64)));
    let row = |v: f64| corrected(camera, (0..size.0).map(move |u| Vec2::new(u as f64, v)));
    let along = |points: Vec<Vec2>, axis: usize| points.iter().map(|p| p[axis]).collect::<Vec<f64>>();
    let sides =
        [along(column(0.0)?, 0), along(column(last_u)?, 0), along(row(0.0)?, 1), along(row(last_v)?, 1)];
    if outward {
        // A bent side may reach beyond its corners along its own direction too: the box is over all four
        // sides.
        let rows = [along(row(0.0)?, 0), along(row(last_v)?, 0)];
        let columns = [along(column(0.0)?, 1), along(column(last_u)?, 1)];
        Ok([
            rows.iter().map(|side| least(side)).fold(least(&sides[0]), f64::min),
            rows.iter().map(|side| greatest(side)).fold(greatest(&sides[1]), f64::max),
            columns.iter().map(|side| least(side)).fold(least(&sides[2]), f64::min),
            columns.iter().map(|side| greatest(side)).fold(greatest(&sides[3]), f64::max),
        ])
    } else {
        Ok([greatest(&sides[0]), least(&sides[1]), greatest(&sides[2]), least(&sides[3])])
    }
}

fn corrected(camera: &Camera, pixels: impl Iterator<Item = Vec2>) -> Result<Vec<Vec2>, OutputCameraError> {
    let ray = |pixel: Vec2| {
        camera.normalised_ray(&pixel).map_err(|cause| OutputCameraError::Border {
            u: pixel.x,
            v: pixel.y,
            cause,
        })
    };
    pixels.map(ray).collect()
}

fn greatest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max) + between_samples(values)
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min) - between_samples(values)
}

/// How far a smooth curve may rise above its samples: an eighth of its second difference, doubled for the
/// change of curvature from sample to sample.
fn between_samples(values: &[f64]) -> f64 {
    0.25 * values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rectify::{RectifyMap, rectify_points};
    use proptest::prelude::*;

    const SIZE: (usize, usize) = (64, 48);

    proptest! {
        #[test]
        fn the_output_shows_all_or_only_valid_pixels(
            k1 in -0.25f64..0.25, p1 in -0.01f64..0.01, p2 in -0.01f64..0.01, cx in 28.0f64..36.0, fy in 50.0f64..70.0,
        ) {
            let lens = BrownConrady { k1, k2: 0.02, p1, p2, k3: 0.0 };
            let camera = Camera::pinhole(60.0, fy, cx, 24.3).with_distortion(lens);

            let valid = output_camera(&camera, SIZE, OutputView::OnlyValid).unwrap();
            let mask = RectifyMap::between(&camera, SIZE, &valid, SIZE).unwrap().mask();
            prop_assert!(mask.samples().iter().all(|&has_data| has_data));
            // Pixels keep their shape.
            prop_assert!((valid.fx / valid.fy - camera.fx / camera.fy).abs() < 1e-12);

            let all = output_camera(&camera, SIZE, OutputView::AllPixels).unwrap();
            let pixels: Vec<Vec2> = (0..64 * 48).map(|i| Vec2::new(f64::from(i % 64), f64::from(i / 64))).collect();
            let mut nearest = f64::INFINITY;
            for shown in rectify_points(&camera, &all, &pixels) {
                let p = shown.unwrap();
                let inside = p.x.min(63.0 - p.x).min(p.y.min(47.0 - p.y));
                prop_assert!(inside >= -1e-12, "{inside}");
                nearest = nearest.min(inside);
            }
            // Tight: the box touches the image but for the allowance between samples, 0.25 * curvature, which
            // is large for an image as small as this.
            prop_assert!(nearest < 0.1, "{nearest}");
        }
    }

    #[test]
    fn a_larger_crop_would_show_something_empty() {
        let camera =
            Camera::pinhole(60.0, 60.0, 31.5, 23.5).with_distortion(BrownConrady::radial(-0.2, 0.02));
        let valid = output_camera(&camera, SIZE, OutputView::OnlyValid).unwrap();
        let wider = Camera::pinhole(valid.fx * 0.99, valid.fy * 0.99, valid.cx, valid.cy);
        let mask = RectifyMap::between(&camera, SIZE, &wider, SIZE).unwrap().mask();
        assert!(mask.samples().iter().any(|&has_data| !has_data));
    }

    #[test]
    fn an_ideal_lens_needs_no_other_camera() {
        let camera = Camera::pinhole(60.0, 55.0, 30.0, 25.0);
        for view in [OutputView::SameK, OutputView::AllPixels, OutputView::OnlyValid] {
            let output = output_camera(&camera, SIZE, view).unwrap();
            assert!((output.k() - camera.k()).norm() < 1e-12, "{view:?}");
        }
    }

    #[test]
    fn a_lens_that_folds_before_the_border_is_refused_with_the_pixel() {
        let camera = Camera::pinhole(40.0, 40.0, 31.5, 23.5).with_distortion(BrownConrady::radial(-0.5, 0.0));
        let error = output_camera(&camera, SIZE, OutputView::AllPixels).unwrap_err();
        assert!(matches!(error, OutputCameraError::Border { u: 0.0, v: 0.0, .. }), "{error}");
        assert!(output_camera(&camera, SIZE, OutputView::SameK).is_ok());
        let tiny = output_camera(&camera, (1, 5), OutputView::OnlyValid).unwrap_err();
        assert_eq!(tiny, OutputCameraError::NothingValid { width: 1, height: 5 });
    }
}
