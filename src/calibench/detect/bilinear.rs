//! What is the level of an image between its pixels?

use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// The level at a place, linear along both axes between the four pixels about it; `None` outside of the
/// image.
pub(super) fn bilinear<T: Level>(image: &Raster<T>, place: &Vec2) -> Option<f64> {
    let fits = |at: f64, size: usize| at >= 0.0 && at + 1.0 < size as f64;
    if !(fits(place.x, image.width()) && fits(place.y, image.height())) {
        return None;
    }
    let (x, y) = (place.x as usize, place.y as usize);
    let (a, b) = (place.x - x as f64, place.y - y as f64);
    let mix = |row: &[T]| row[x].to_f64() + (row[x + 1].to_f64() - row[x].to_f64()) * a;
    let (upper, lower) = (mix(image.row(y)), mix(image.row(y + 1)));
    Some(upper + (lower - upper) * b)
}
