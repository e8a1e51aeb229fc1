//! Where exactly is the centre of an imaged disc? The ellipse whose edge explains the pixels best.
//!
//! 1. Levels: a plane is fitted to the ground around the disc and one to the inside, so that smooth shading
//!    cancels; the pixels near the edge become coverage `c = (ground - level) / (ground - inside)`.
//! 2. Moments of the coverage give the ellipse and a grey-weighted centroid. Pixels clear of the edge count
//!    as 1 or 0, so only the noise of a narrow ring enters.
//! 3. One Gauss-Newton step on the centre against the model `c = S(d)`, `d` the distance to the ellipse. It
//!    weighs each pixel by the slope of the edge, which the centroid does not, and so attains the Cramer-Rao
//!    bound of the centre: by symmetry the centre's derivatives are orthogonal to those of axes, levels and
//!    edge width, whose errors then do not matter.

use super::blob::{Blob, semi_axes};
use super::edge::{Edge, SHARPEST_EDGE_PX, SPREAD_PER_WIDTH};
use super::levels::{Levels, PlaneFit};
use super::region::{Region, around};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};
use nalgebra::Matrix2;

/// An ellipse as a quadratic form: `rho^2 = (p - centre)^T form (p - centre)`, 1 on the ellipse.
#[derive(Debug, Clone, Copy)]
struct Ellipse {
    centre: Vec2,
    covariance: Matrix2<f64>,
    form: Matrix2<f64>,
    short_px: f64,
    long_px: f64,
}

impl Ellipse {
    fn new(centre: Vec2, covariance: Matrix2<f64>) -> Option<Ellipse> {
        let (short_px, long_px) = semi_axes(&covariance);
        let form = (covariance * 4.0).try_inverse()?;
        let is_finite = centre.iter().chain(form.iter()).all(|x| x.is_finite());
        (is_finite && short_px >= 1.0).then_some(Ellipse { centre, covariance, form, short_px, long_px })
    }

    /// The ellipse with its outline moved by a distance.
    fn grown(&self, by_px: f64) -> Option<Region> {
        Region::new(self.centre, &self.covariance, by_px)
    }

    /// Distance to the ellipse (positive outside) to first order, and its gradient.
    fn distance(&self, offset: &Vec2) -> (f64, Vec2) {
        let half_gradient = self.form * offset;
        let rho_sq = offset.dot(&half_gradient);
        let norm_sq = half_gradient.dot(&half_gradient);
        // At the centre itself: far inside, no direction.
        if norm_sq == 0.0 {
            return (-self.short_px, Vec2::zeros());
        }
        let inverse_norm = 1.0 / norm_sq.sqrt();
        ((rho_sq - rho_sq.sqrt()) * inverse_norm, half_gradient * inverse_norm)
    }

    /// Circumference, by Ramanujan's first approximation (relative error below 1e-4 for axis ratios above
    /// 1/4).
    fn circumference_px(&self) -> f64 {
        let (a, b) = (self.long_px, self.short_px);
        std::f64::consts::PI * (3.0 * (a + b) - ((3.0 * a + b) * (a + 3.0 * b)).sqrt())
    }

    /// Levels inside of the edge by `clear_px`, and outside of it from there to a few pixels on.
    fn levels<T: Level>(&self, image: &Raster<T>, clear_px: f64) -> Option<Levels> {
        let (inner, clear) = (self.grown(-clear_px)?, self.grown(clear_px)?);
        let outer = self.grown(outer_px(self, clear_px))?;
        Levels::fit(image, &self.centre, &inner, &clear, &outer)
    }
}

/// The pixels of `outer` that are not in `inner`, if there is one.
fn for_each_between<T: Level>(
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
    let levels = rough.levels(image, clear_px)?;
    let (ellipse, edge_px) = moments(image, &rough, &levels, clear_px)?;
    // Second look, with the edge's own width.
    let edge_px = edge_px.clamp(SHARPEST_EDGE_PX, clear_px.max(SHARPEST_EDGE_PX));
    let edge = Edge::new(edge_px);
    let levels = ellipse.levels(image, 0.1 + edge.reach_px())?;
    let (moved, misfit) = step(image, &ellipse, &levels, &edge)?;
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

/// How far around the mark its ground is looked at: a few pixels, more for larger marks, but less than half
/// of the gap to a neighbour that is as far away as the mark is wide.
fn outer_px(ellipse: &Ellipse, clear_px: f64) -> f64 {
    clear_px + (0.5 * ellipse.short_px).clamp(1.0, 8.0)
}
