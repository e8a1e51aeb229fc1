//! How is a single photograph rectified without a table? Sources are computed and sampled while they are
//! near.

use super::eight_bit::Photograph;
use super::fraction::Place;
use super::map::check_size;
use super::source_row::{PIECE, SourceRows, Sources};
use super::{Interpolated, RectifyError};
use crate::camera::Camera;
use crate::raster::Raster;

/// Rows of the output whose pieces are made one below the other: they look at nearly the same samples.
const BAND: usize = 64;

/// Turns a photograph of `camera` into an image of `output`, usually a camera without distortion; pixels
/// without data get the level `border`. The same image as [`RectifyMap::between`](super::RectifyMap::between)
/// and [`RectifyMap::apply`](super::RectifyMap::apply) make, at a fraction of their time together; a table is
/// for several photographs.
///
/// # Errors
/// Photographs of fewer than 2 x 2 pixels.
///
/// ```
/// use calibench::rectify::{OutputView, output_camera, rectify_image};
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph};
///
/// let (camera, size) = (Truth::example_camera(), Truth::EXAMPLE_IMAGE);
/// let pose = Truth::example_poses()[0];
/// let photo = photograph(&camera, size, &Truth::example_board(), &pose, &Imaging::default())?.image;
/// // A camera without distortion that loses no pixel of the photograph; what it sees beyond is white.
/// let output = output_camera(&camera, size, OutputView::AllPixels)?;
/// let rectified = rectify_image(&photo, &camera, &output, size, 1.0)?;
/// assert_eq!((rectified.width(), rectified.height()), size);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn rectify_image<T: Interpolated>(
    photograph: &Raster<T>,
    camera: &Camera,
    output: &Camera,
    output_size: (usize, usize),
    border: T,
) -> Result<Raster<T>, RectifyError> {
    let size = (photograph.width(), photograph.height());
    check_size(size)?;
    let samples = photograph.samples();
    let bytes = T::as_bytes(samples).map(|samples| Photograph::new(samples, size));
    let mut rows = SourceRows::new(camera, output, output_size.0);
    let mut sources = Sources::new();
    let (width, height) = output_size;
    Ok(Raster::from_bands(width, height, border, BAND, |top, band| {
        for first in (0..width).step_by(PIECE) {
            for (y, row) in (top..).zip(band.chunks_exact_mut(width)) {
                let levels = &mut row[first..width.min(first + PIECE)];
                rows.fill(y, first, levels.len(), &mut sources);
                if let (Some(photograph), Some(levels)) = (&bytes, T::as_bytes_mut(levels)) {
                    photograph.mix_sources(&sources, levels);
                    continue;
                }
                for (place, level) in levels.iter_mut().enumerate() {
                    if let Some(Place { column, row, right, down }) = Place::of(&sources.get(place), size) {
                        let at = row as usize * size.0 + column as usize;
                        *level = T::mix(samples, size.0, at, right, down);
                    }
                }
            }
        }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::BrownConrady;
    use crate::rectify::RectifyMap;
    use proptest::prelude::*;

    /// Wider than a piece and a window, and a multiple of neither.
    const SIZE: (usize, usize) = (301, 60);

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_image_is_that_of_the_table(
            k1 in -0.4f64..0.4, k2 in -0.1f64..0.1, p1 in -0.01f64..0.01, p2 in -0.01f64..0.01, k3 in -0.05f64..0.05,
            skew in -1.0f64..1.0, zoom in 0.4f64..2.0, plain: bool,
        ) {
            let lens = if plain { BrownConrady::radial(k1, k2) } else { BrownConrady { k1, k2, p1, p2, k3 } };
            let camera = Camera { skew: if plain { 0.0 } else { skew }, ..Camera::pinhole(200.0, 198.0, 151.2, 29.3) }
                .with_distortion(lens);
            let output = Camera::pinhole(200.0 * zoom, 198.0 * zoom, 150.0, 30.0);
            let map = RectifyMap::between(&camera, SIZE, &output, SIZE).unwrap();
            let wide = Raster::from_fn(SIZE.0, SIZE.1, |x, y| ((x * 7919 + y * 104_729 + x * y * 31) % 65_536) as u16);
            let bytes = wide.map(|&level| (level % 251) as u8);
            let real = wide.map(|&level| f32::from(level) / 3.0);
            let direct = |border| rectify_image(&bytes, &camera, &output, SIZE, border).unwrap();
            prop_assert_eq!(direct(7), map.apply(&bytes, 7).unwrap());
            prop_assert_eq!(rectify_image(&wide, &camera, &output, SIZE, 7).unwrap(), map.apply(&wide, 7).unwrap());
            prop_assert_eq!(rectify_image(&real, &camera, &output, SIZE, -1.0).unwrap(), map.apply(&real, -1.0).unwrap());
            // Levels stay below 251: another border shows the mask.
            let mask = direct(255).map(|&level| level != 255);
            prop_assert_eq!(mask, map.mask());
        }
    }

    #[test]
    fn an_image_that_cannot_be_interpolated_is_refused() {
        let camera = Camera::pinhole(60.0, 60.0, 32.0, 24.0);
        let error = rectify_image(&Raster::filled(1, 9, 0u8), &camera, &camera, (4, 3), 0).unwrap_err();
        assert_eq!(error, RectifyError::Size { width: 1, height: 9 });
    }
}
