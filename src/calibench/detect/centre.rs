//! Where exactly is the centre of an imaged disc? The ellipse whose edge explains the pixels best.
//!
//! 1. Levels: a plane is fitted to the ground around the disc and one to the inside, so that smooth shading
//!    cancels; the pixels near the edge become coverage `c = (ground - level) / (ground - inside)`. Where the
//!    ring around the disc is not all ground, because the sheet ends there, the disc is fitted to the part of
//!    its edge that is clear ([`super::beside`]).
//! 2. Moments of the coverage give the ellipse and a grey-weighted centroid. Pixels clear of the edge count
//!    as 1 or 0, so only the noise of a narrow ring enters.
//! 3. One Gauss-Newton step on the centre against the model `c = S(d)`, `d` the distance to the ellipse. It
//!    weighs each pixel by the slope of the edge, which the centroid does not, and so attains the Cramer-Rao
//!    bound of the centre: by symmetry the centre's derivatives are orthogonal to those of axes, levels and
//!    edge width, whose errors then do not matter.

use super::beside;
use super::blob::Blob;
use super::edge::{Edge, SHARPEST_EDGE_PX, SPREAD_PER_WIDTH};
use super::ellipse::Ellipse;
use super::levels::{Levels, PlaneFit};
use super::region::{Region, around};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};
use nalgebra::Matrix2;

/// Levels inside of an ellipse's edge by `clear_px`, and outside of it from there to a few pixels on.
fn levels<T: Level>(image: &Raster<T>, ellipse: &Ellipse, clear_px: f64) -> Option<Levels> {
    let (inner, clear) = (ellipse.grown(-clear_px)?, ellipse.grown(clear_px)?);
    let outer = ellipse.grown(outer_px(ellipse, clear_px))?;
    Levels::fit(image, &ellipse.centre, &inner, &clear, &outer)
}

/// The pixels of `outer` that are not in `inner`, if there is one.
pub(super) fn for_each_between<T: Level>(
    image: &Raster<T>,
    centre: &Vec2,
    inner: Option<&Region>,
    outer: &Region,
    mut visit: impl FnMut(&Vec2, f64),
) {
    let (width, height) = (image.width(), image.height());
    let inner_rows = inner.map_or(0..0, |inner| inner.rows(height));
    for y in outer.rows(height) {
        let whole = outer.columns(y, width);
        let hole = inner.filter(|_| inner_rows.contains(&y)).map_or(0..0, |inner| inner.columns(y, width));
        let (row, dy) = (image.row(y), y as f64 - centre.y);
        for run in around(&whole, &hole) {
            for (x, sample) in run.clone().zip(&row[run]) {
                visit(&Vec2::new(x as f64 - centre.x, dy), sample.to_f64());
            }
        }
    }
}

/// Moments of the coverage: a better ellipse, and the edge's half-width. Pixels within `ring_px` of the edge
/// are looked at.
fn moments<T: Level>(
    image: &Raster<T>,
    ellipse: &Ellipse,
    levels: &Levels,
    ring_px: f64,
) -> Option<(Ellipse, f64)> {
    let (inner, outer) = (ellipse.grown(-ring_px)?, ellipse.grown(ring_px)?);
    let (width, height) = (image.width(), image.height());
    let mut covered = PlaneFit::default();
    for y in inner.rows(height) {
        let run = inner.columns(y, width);
        if !run.is_empty() {
            let (dx, dy) = (run.start as f64 - ellipse.centre.x, y as f64 - ellipse.centre.y);
            covered.add_places(dx, dy, run.len());
        }
    }
    let PlaneFit { n: mut area, x, y, mut xx, mut xy, mut yy, .. } = covered;
    let (mut first, mut spread) = (Vec2::new(x, y), 0.0);
    for_each_between(image, &ellipse.centre, Some(&inner), &outer, |p, level| {
        let c = levels.coverage(p, level);
        area += c;
        first += p * c;
        xx += c * p.x * p.x;
        xy += c * p.x * p.y;
        yy += c * p.y * p.y;
        spread += c * (1.0 - c);
    });
    let mean = first / area;
    let (xx, xy, yy) =
        (xx / area - mean.x * mean.x, xy / area - mean.x * mean.y, yy / area - mean.y * mean.y);
    let edge_px = spread / ellipse.circumference_px() / SPREAD_PER_WIDTH;
    // The pixel's square and the edge's softness both widen the moments of coverage by the edge's variance
    // h^2 / 5.
    let soft = edge_px.max(SHARPEST_EDGE_PX);
    let soft = soft * soft / 5.0;
    let covariance = Matrix2::new(xx - soft, xy, xy, yy - soft);
    Some((Ellipse::new(ellipse.centre + mean, covariance)?, edge_px))
}

/// The Gauss-Newton step of the centre, and the RMS residual it was computed from.
fn step<T: Level>(image: &Raster<T>, ellipse: &Ellipse, levels: &Levels, edge: &Edge) -> Option<(Vec2, f64)> {
    let (mut normal, mut gradient) = (Matrix2::zeros(), Vec2::zeros());
    let (mut square, mut count) = (0.0, 0.0);
    let reach_px = edge.reach_px();
    let (inner, outer) = (ellipse.grown(-reach_px), ellipse.grown(reach_px)?);
    for_each_between(image, &ellipse.centre, inner.as_ref(), &outer, |p, level| {
        let (d, direction) = ellipse.distance(p);
        if d.abs() >= reach_px {
            return;
        }
        let (model, slope) = edge.coverage(d, &direction);
        let residual = levels.coverage(p, level) - model;
        // The edge moves with the centre: dS/d(centre) = -dS/dd direction.
        let by_centre = direction * slope;
        normal += by_centre * by_centre.transpose();
        gradient += by_centre * residual;
        square += residual * residual;
        count += 1.0;
    });
    Some((normal.try_inverse()? * gradient, (square / count).sqrt()))
}

/// Refines centre and ellipse of a blob; `None` where it is too small or has no contrast.
pub(super) fn refine<T: Level>(image: &Raster<T>, centre: Vec2, covariance: Matrix2<f64>) -> Option<Blob> {
    let rough = Ellipse::new(centre, covariance)?;
    // First look: the edge may be soft, the blob small.
    let clear_px = 2.5f64.min(0.5 * rough.short_px);
    let narrow = Look::new(image, &rough, clear_px)?;
    let wide = wider(clear_px, narrow.edge_px, &rough).and_then(|px| Look::new(image, &rough, px));
    let is_even = |look: &Look| look.levels.unevenness() <= EVEN;
    let is_wide_even = wide.as_ref().is_some_and(is_even);
    let is_ground = is_even(&narrow) && wide.iter().all(is_even);
    if !is_ground && let Some(blob) = beside::refine(image, &rough, clear_px) {
        return Some(blob);
    }
    let widest = wide.filter(|_| is_wide_even).and_then(|wide| wide.refined(image));
    widest.or_else(|| narrow.refined(image))
}

/// A first look at a disc.
struct Look {
    levels: Levels,
    ellipse: Ellipse,
    edge_px: f64,
    clear_px: f64,
}

impl Look {
    /// With levels taken `clear_px` from the edge.
    fn new<T: Level>(image: &Raster<T>, rough: &Ellipse, clear_px: f64) -> Option<Look> {
        let levels = levels(image, rough, clear_px)?;
        let (ellipse, edge_px) = moments(image, rough, &levels, clear_px)?;
        Some(Look { levels, ellipse, edge_px, clear_px })
    }

    /// Second look, with the edge's own width.
    fn refined<T: Level>(&self, image: &Raster<T>) -> Option<Blob> {
        let Look { ellipse, clear_px, .. } = self;
        let edge_px = self.edge_px.clamp(SHARPEST_EDGE_PX, clear_px.max(SHARPEST_EDGE_PX));
        let edge = Edge::new(edge_px);
        let levels = levels(image, ellipse, 0.1 + edge.reach_px())?;
        let (moved, misfit) = step(image, ellipse, &levels, &edge)?;
        let blob = Blob {
            centre_px: ellipse.centre + moved,
            covariance_px2: ellipse.covariance,
            edge_px,
            contrast: levels.contrast(),
            misfit,
        };
        let is_finite = blob.centre_px.iter().chain(blob.covariance_px2.iter()).all(|x| x.is_finite());
        (is_finite && moved.norm() < 0.5 * ellipse.short_px).then_some(blob)
    }
}

/// Means of the parts of a ring that differ from a plane by less, as a fraction of the contrast, are of one
/// ground. What may lie beside it is looked at closely only where they differ by more.
const EVEN: f64 = 0.005;

/// Where to look for levels instead if an edge of this half-width fills what was looked at; `None` where it
/// does not, or the mark has no room for more.
pub(super) fn wider(clear_px: f64, edge_px: f64, ellipse: &Ellipse) -> Option<f64> {
    let most_px = LARGEST_CLEAR * ellipse.short_px;
    (edge_px >= clear_px && clear_px < most_px).then(|| (2.0 * clear_px).min(most_px))
}

/// Part of the smaller semi-axis that an edge may fill: the middle shows the mark's level.
pub(super) const LARGEST_CLEAR: f64 = 0.75;

/// How far around the mark its ground is looked at: a few pixels, more for larger marks, but less than half
/// of the gap to a neighbour that is as far away as the mark is wide.
pub(super) fn outer_px(ellipse: &Ellipse, clear_px: f64) -> f64 {
    clear_px + (0.5 * ellipse.short_px).clamp(1.0, 8.0)
}
