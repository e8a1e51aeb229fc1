//! Where are the discs? Components of about elliptic shape, with the ellipse of their moments.

use super::blob::{Blob, semi_axes};
use super::centre;
use super::components::{Component, Polarity, components};
use super::looks::in_image;
use super::threshold::Thresholds;
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};
use nalgebra::Matrix2;

/// What counts as a disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlobOptions {
    /// Dark marks on bright ground, or the reverse.
    pub polarity: Polarity,
    /// Least area, px. Below 12 px (diameter 4 px) neither shape nor centre can be trusted.
    pub least_area_px: f64,
    /// Least ratio of the axes. A disc tilted by 45 deg at the edge of a wide view shows 0.5; 0.25 leaves
    /// room.
    pub least_axis_ratio: f64,
}

impl Default for BlobOptions {
    fn default() -> BlobOptions {
        BlobOptions { polarity: Polarity::Dark, least_area_px: 12.0, least_axis_ratio: 0.25 }
    }
}

/// The area of a component may differ from that of its moments' ellipse by this fraction, plus the raggedness
/// of small components, about one pixel in ten along the outline.
const AREA_TOLERANCE: f64 = 0.1;

/// Largest misfit of an ellipse: discs show 0.02 to 0.08 depending on size and sharpness; squares show 0.25
/// and more.
const LARGEST_MISFIT: f64 = 0.2;

/// The discs of an image, top to bottom by their highest pixel. Marks that touch the image's border are left
/// out.
///
/// ```
/// use calibench::detect::{BlobOptions, blobs};
/// use calibench::raster::Raster;
///
/// // A bright sheet with a dark disc of radius 8 px about (30, 20), its edge one pixel wide.
/// let image = Raster::from_fn(60, 40, |x, y| {
///     let distance = ((x as f64 - 30.0).powi(2) + (y as f64 - 20.0).powi(2)).sqrt();
///     0.9 - 0.7 * (8.5 - distance).clamp(0.0, 1.0) as f32
/// });
/// let found = blobs(&image, &BlobOptions::default());
/// assert_eq!(found.len(), 1);
/// assert!((found[0].centre_px.x - 30.0).abs() < 0.01 && (found[0].centre_px.y - 20.0).abs() < 0.01);
/// assert!((found[0].semi_axes_px().0 - 8.0).abs() < 0.1);
/// ```
pub fn blobs<T: Level>(image: &Raster<T>, options: &BlobOptions) -> Vec<Blob> {
    match Thresholds::of(image) {
        Some(thresholds) => blobs_by(image, image, 1, &thresholds, options),
        None => Vec::new(),
    }
}

/// The discs that thresholds show in an image averaged over squares of so many pixels, refined in the image
/// itself.
pub(super) fn blobs_by<T: Level, A: Level>(
    image: &Raster<T>,
    averaged: &Raster<A>,
    square: usize,
    thresholds: &Thresholds<A>,
    options: &BlobOptions,
) -> Vec<Blob> {
    let area = (square * square) as f64;
    components(averaged, thresholds, options.polarity)
        .iter()
        .filter(|component| is_inside(component, averaged))
        .filter_map(|component| ellipse(component, options))
        .filter_map(|(centre, covariance)| centre::refine(image, in_image(centre, square), covariance * area))
        .filter(|blob| blob.misfit <= LARGEST_MISFIT)
        .filter(|blob| (blob.contrast > 0.0) == (options.polarity == Polarity::Dark))
        .collect()
}

fn is_inside<T: Copy>(component: &Component, image: &Raster<T>) -> bool {
    component.low[0] > 0
        && component.low[1] > 0
        && (component.high[0] as usize) < image.width() - 1
        && (component.high[1] as usize) < image.height() - 1
}

/// Centroid and covariance of a component, if it is about an ellipse.
fn ellipse(component: &Component, options: &BlobOptions) -> Option<(Vec2, Matrix2<f64>)> {
    let n = component.area_px;
    if n < options.least_area_px {
        return None;
    }
    let [x, y] = component.first.map(|sum| sum / n);
    let [xx, xy, yy] = component.second.map(|sum| sum / n);
    // A pixel is a square, not a point: variance 1/12 along each axis.
    let covariance = Matrix2::new(xx - x * x + 1.0 / 12.0, xy - x * y, xy - x * y, yy - y * y + 1.0 / 12.0);
    let (short, long) = semi_axes(&covariance);
    let ratio = n / (std::f64::consts::PI * short * long);
    let ragged = 0.1 * std::f64::consts::TAU * long / n;
    let is_ellipse = (ratio - 1.0).abs() <= AREA_TOLERANCE + ragged;
    (is_ellipse && short >= options.least_axis_ratio * long).then(|| (Vec2::new(x, y), covariance))
}
