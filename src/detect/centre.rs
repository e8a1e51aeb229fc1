//! Where exactly is the centre of an imaged disc? The ellipse whose edge explains the pixels best.
//!
//! 1. Levels: a plane is fitted to the ground around the disc and one to the inside, so that smooth shading cancels; the
//!    pixels near the edge become coverage `c = (ground - level) / (ground - inside)`.
//! 2. Moments of the coverage give the ellipse and a grey-weighted centroid. Pixels clear of the edge count as 1 or 0, so
//!    only the noise of a narrow ring enters.
//! 3. One Gauss-Newton step on the centre against the model `c = S(d)`, `d` the distance to the ellipse. It weighs each pixel
//!    by the slope of the edge, which the centroid does not, and so attains the Cramer-Rao bound of the centre: by symmetry
//!    the centre's derivatives are orthogonal to those of axes, levels and edge width, whose errors then do not matter.

use super::blob::{Blob, semi_axes};
use super::edge::{Edge, SHARPEST_EDGE_PX, SPREAD_PER_WIDTH};
use crate::geometry::Vec2;
use crate::raster::{Raster, Sample};
use nalgebra::{Matrix2, Matrix3, Vector3};

/// Fewest pixels that fix a plane; with fewer the level is taken as constant.
const PLANE_PIXELS: f64 = 40.0;

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

    /// Distance to the ellipse (positive outside) to first order, and its gradient.
    fn distance(&self, offset: &Vec2) -> (f64, Vec2) {
        let half_gradient = self.form * offset;
        let rho_sq = offset.dot(&half_gradient);
        let norm = half_gradient.norm();
        // At the centre itself: far inside, no direction.
        if norm == 0.0 {
            return (-self.short_px, Vec2::zeros());
        }
        let rho = rho_sq.sqrt();
        ((rho - 1.0) * rho / norm, half_gradient / norm)
    }

    /// Circumference, by Ramanujan's first approximation (relative error below 1e-4 for axis ratios above 1/4).
    fn circumference_px(&self) -> f64 {
        let (a, b) = (self.long_px, self.short_px);
        std::f64::consts::PI * (3.0 * (a + b) - ((3.0 * a + b) * (a + 3.0 * b)).sqrt())
    }
}

/// The pixels around an ellipse, up to a distance from it.
fn for_each_pixel<T: Sample>(
    image: &Raster<T>,
    ellipse: &Ellipse,
    reach_px: f64,
    mut visit: impl FnMut(Vec2, f64),
) {
    let half_width = 2.0 * ellipse.covariance[(0, 0)].sqrt() + reach_px;
    let half_height = 2.0 * ellipse.covariance[(1, 1)].sqrt() + reach_px;
    let range = |centre: f64, half: f64, size: usize| {
        let first = libm::ceil(centre - half).max(0.0) as usize;
        let end = (libm::floor(centre + half) + 1.0).clamp(0.0, size as f64) as usize;
        first..end.max(first)
    };
    let columns = range(ellipse.centre.x, half_width, image.width());
    for y in range(ellipse.centre.y, half_height, image.height()) {
        let dy = y as f64 - ellipse.centre.y;
        for (x, sample) in columns.clone().zip(&image.row(y)[columns.clone()]) {
            visit(Vec2::new(x as f64 - ellipse.centre.x, dy), sample.to_f64());
        }
    }
}

/// Sums for a plane `level = a + b x + c y`.
#[derive(Debug, Clone, Copy, Default)]
struct PlaneFit {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    level: Vector3<f64>,
}

impl PlaneFit {
    fn add(&mut self, p: &Vec2, level: f64) {
        self.n += 1.0;
        self.x += p.x;
        self.y += p.y;
        self.xx += p.x * p.x;
        self.xy += p.x * p.y;
        self.yy += p.y * p.y;
        self.level += Vector3::new(level, level * p.x, level * p.y);
    }

    fn solve(&self) -> Option<Plane> {
        if self.n == 0.0 {
            return None;
        }
        let constant = Plane(Vector3::new(self.level[0] / self.n, 0.0, 0.0));
        if self.n < PLANE_PIXELS {
            return Some(constant);
        }
        let normal = Matrix3::new(self.n, self.x, self.y, self.x, self.xx, self.xy, self.y, self.xy, self.yy);
        Some(normal.cholesky().map_or(constant, |factor| Plane(factor.solve(&self.level))))
    }
}

#[derive(Debug, Clone, Copy)]
struct Plane(Vector3<f64>);

impl Plane {
    fn at(&self, p: &Vec2) -> f64 {
        self.0[0] + self.0[1] * p.x + self.0[2] * p.y
    }
}

/// Levels of the ground and of the mark, as functions of the offset from a centre.
#[derive(Debug, Clone, Copy)]
struct Levels {
    ground: Plane,
    mark: Plane,
}

impl Levels {
    /// Fits the levels clear of the edge: inside it by `clear_px`, and outside from `clear_px` to `outer_px`.
    fn fit<T: Sample>(image: &Raster<T>, ellipse: &Ellipse, clear_px: f64, outer_px: f64) -> Option<Levels> {
        let (mut ground, mut mark) = (PlaneFit::default(), PlaneFit::default());
        for_each_pixel(image, ellipse, outer_px, |p, level| {
            let (d, _) = ellipse.distance(&p);
            if d <= -clear_px {
                mark.add(&p, level);
            } else if d >= clear_px && d <= outer_px {
                ground.add(&p, level);
            }
        });
        let (own, middle) = (mark.solve()?, Vec2::new(mark.x, mark.y) / mark.n);
        let ground = ground.solve()?;
        // Light falls on mark and ground alike, and the ground, being wider, shows its slope with less noise. Not so for
        // bright marks: their ground shows no light.
        let (mark_level, ground_level) = (own.at(&middle), ground.at(&middle));
        let mark = if 0.0 <= mark_level && mark_level < ground_level {
            Plane(ground.0 * (mark_level / ground_level))
        } else {
            own
        };
        Some(Levels { ground, mark })
    }

    fn contrast(&self) -> f64 {
        self.ground.0[0] - self.mark.0[0]
    }

    /// Coverage of a pixel by the mark.
    fn coverage(&self, p: &Vec2, level: f64) -> f64 {
        let ground = self.ground.at(p);
        (ground - level) / (ground - self.mark.at(p))
    }
}

/// Moments of the coverage: a better ellipse, and the edge's half-width.
fn moments<T: Sample>(
    image: &Raster<T>,
    ellipse: &Ellipse,
    levels: &Levels,
    ring_px: f64,
) -> Option<(Ellipse, f64)> {
    let (mut area, mut first, mut xx, mut xy, mut yy) = (0.0, Vec2::zeros(), 0.0, 0.0, 0.0);
    let mut spread = 0.0;
    for_each_pixel(image, ellipse, ring_px, |p, level| {
        let (d, _) = ellipse.distance(&p);
        if d > ring_px {
            return;
        }
        let c = if d < -ring_px { 1.0 } else { levels.coverage(&p, level) };
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
    // The pixel's square and the edge's softness both widen the moments of coverage by the edge's variance h^2 / 5.
    let soft = edge_px.max(SHARPEST_EDGE_PX);
    let soft = soft * soft / 5.0;
    let covariance = Matrix2::new(xx - soft, xy, xy, yy - soft);
    Some((Ellipse::new(ellipse.centre + mean, covariance)?, edge_px))
}

/// The Gauss-Newton step of the centre, and the RMS residual it was computed from.
fn step<T: Sample>(
    image: &Raster<T>,
    ellipse: &Ellipse,
    levels: &Levels,
    edge: &Edge,
) -> Option<(Vec2, f64)> {
    let (mut normal, mut gradient) = (Matrix2::zeros(), Vec2::zeros());
    let (mut square, mut count) = (0.0, 0.0);
    let reach_px = edge.reach_px();
    for_each_pixel(image, ellipse, reach_px, |p, level| {
        let (d, direction) = ellipse.distance(&p);
        if d.abs() >= reach_px {
            return;
        }
        let (model, slope) = edge.coverage(d, &direction);
        let residual = levels.coverage(&p, level) - model;
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
pub(super) fn refine<T: Sample>(image: &Raster<T>, centre: Vec2, covariance: Matrix2<f64>) -> Option<Blob> {
    let rough = Ellipse::new(centre, covariance)?;
    // First look: the edge may be soft, the blob small.
    let clear_px = 2.5f64.min(0.5 * rough.short_px);
    let levels = Levels::fit(image, &rough, clear_px, outer_px(&rough, clear_px))?;
    let (ellipse, edge_px) = moments(image, &rough, &levels, clear_px)?;
    // Second look, with the edge's own width.
    let edge_px = edge_px.clamp(SHARPEST_EDGE_PX, clear_px.max(SHARPEST_EDGE_PX));
    let edge = Edge::new(edge_px);
    let clear_px = 0.1 + edge.reach_px();
    let levels = Levels::fit(image, &ellipse, clear_px, outer_px(&ellipse, clear_px))?;
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

/// How far around the mark its ground is looked at: a few pixels, more for larger marks, but less than half of the gap to
/// a neighbour that is as far away as the mark is wide.
fn outer_px(ellipse: &Ellipse, clear_px: f64) -> f64 {
    clear_px + (0.5 * ellipse.short_px).clamp(1.0, 8.0)
}
