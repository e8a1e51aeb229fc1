//! How is a single photograph rectified without a table? Sources are computed and sampled while they are near.

use super::eight_bit::Photograph;
use super::fraction::Place;
use super::map::check_size;
use super::source_row::{PIECE, SourceRows, Sources};
use super::{RectifyError, Sample};
use crate::camera::Camera;
use crate::raster::Raster;

/// Turns a photograph of `camera` into an image of `output`, usually a camera without distortion; pixels without data get the level
/// `border`. The same image as [`RectifyMap::between`](super::RectifyMap::between) and [`RectifyMap::apply`](super::RectifyMap::apply) make, at a
/// fraction of their time together; a table is for several photographs.
///
/// # Errors
/// Photographs of fewer than 2 x 2 pixels.
pub fn rectify_image<T: Sample>(
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
    Ok(Raster::from_rows(output_size.0, output_size.1, border, |y, levels| {
        for (piece, levels) in levels.chunks_mut(PIECE).enumerate() {
            rows.fill(y, piece * PIECE, levels.len(), &mut sources);
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
    }))
}
