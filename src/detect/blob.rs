//! Where are the discs? Components of about elliptic shape, with the ellipse of their moments.

use super::centre;
use super::components::{Component, Polarity, components};
use super::threshold::Thresholds;
use crate::geometry::Vec2;
use crate::raster::{Raster, Sample};
use nalgebra::Matrix2;

/// What counts as a disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlobOptions {
    /// Dark marks on bright ground, or the reverse.
    pub polarity: Polarity,
    /// Least area, px. Below 12 px (diameter 4 px) neither shape nor centre can be trusted.
    pub least_area_px: f64,
    /// Least ratio of the axes. A disc tilted by 45 deg at the edge of a wide view shows 0.5; 0.25 leaves room.
    pub least_axis_ratio: f64,
}

impl Default for BlobOptions {
    fn default() -> BlobOptions {
        BlobOptions { polarity: Polarity::Dark, least_area_px: 12.0, least_axis_ratio: 0.25 }
    }
}

/// An imaged disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blob {
    /// Sub-pixel centre of the imaged disc, px. It is not the image of the disc's centre: see
    /// [`disc_bias`](super::disc_bias).
    pub centre_px: Vec2,
    /// Covariance of the imaged disc's area, px^2: an ellipse with semi-axes `2 sqrt(eigenvalue)`.
    pub covariance_px2: Matrix2<f64>,
    /// Half the width of the edge's transition, px: 0.65 for a sharp lens.
    pub edge_px: f64,
    /// Ground minus mark, in levels of the image (negative for bright marks).
    pub contrast: f64,
    /// RMS difference between the pixels at the edge and the ellipse, as a fraction of the contrast.
    pub misfit: f64,
}

impl Blob {
    /// Area of the ellipse, px^2: `4 pi sqrt(det covariance)`.
    pub fn area_px2(&self) -> f64 {
        4.0 * std::f64::consts::PI * self.covariance_px2.determinant().max(0.0).sqrt()
    }

    /// Smaller and larger semi-axis, px.
    pub fn semi_axes_px(&self) -> (f64, f64) {
        semi_axes(&self.covariance_px2)
    }
}

/// Semi-axes of the ellipse with this covariance of area, smaller first.
pub(super) fn semi_axes(covariance: &Matrix2<f64>) -> (f64, f64) {
    let mean = 0.5 * covariance.trace();
    let half_difference = 0.5 * (covariance[(0, 0)] - covariance[(1, 1)]);
    let spread = libm::hypot(half_difference, covariance[(0, 1)]);
    (2.0 * (mean - spread).max(0.0).sqrt(), 2.0 * (mean + spread).sqrt())
}

/// The area of a component may differ from that of its moments' ellipse by this fraction, plus the raggedness of small
/// components, about one pixel in ten along the outline.
const AREA_TOLERANCE: f64 = 0.1;

/// Largest misfit of an ellipse: discs show 0.02 to 0.08 depending on size and sharpness; squares show 0.25 and more.
const LARGEST_MISFIT: f64 = 0.2;

/// The discs of an image, top to bottom by their highest pixel. Marks that touch the image's border are left out.
pub fn blobs<T: Sample>(image: &Raster<T>, options: &BlobOptions) -> Vec<Blob> {
    let Some(thresholds) = Thresholds::of(image) else { return Vec::new() };
    components(image, &thresholds, options.polarity)
        .iter()
        .filter(|component| is_inside(component, image))
        .filter_map(|component| ellipse(component, options))
        .filter_map(|(centre, covariance)| centre::refine(image, centre, covariance))
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
