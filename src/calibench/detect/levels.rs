//! How bright are ground and mark here? A plane through each, clear of the edge, so that smooth shading
//! cancels.

use super::mean::Mean;
use super::region::{Region, around};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Fewest pixels that fix a plane; with fewer the level is taken as constant.
const PLANE_PIXELS: f64 = 40.0;

/// Parts of the ring around a mark whose mean levels are compared: above, below, and three on either side.
const PARTS: usize = 8;

/// Sums over pixels, for a plane `level = a + b x + c y`.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlaneFit {
    pub n: f64,
    pub x: f64,
    pub y: f64,
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
    level: Vector3<f64>,
}

impl PlaneFit {
    /// Adds the places of `count` pixels of a row, the first at `(x, y)`.
    pub fn add_places(&mut self, x: f64, y: f64, count: usize) {
        let n = count as f64;
        // Consecutive numbers about their mean: sum of squares n (n^2 - 1) / 12.
        let mean = x + 0.5 * (n - 1.0);
        let sum = n * mean;
        self.n += n;
        self.x += sum;
        self.y += n * y;
        self.xx += sum * mean + n * (n * n - 1.0) / 12.0;
        self.xy += sum * y;
        self.yy += n * y * y;
    }

    /// Adds the pixels of a row, the first at `(x, y)`; the sum of their levels.
    fn add<T: Level>(&mut self, x: f64, y: f64, samples: &[T]) -> f64 {
        if samples.is_empty() {
            return 0.0;
        }
        self.add_places(x, y, samples.len());
        let (sum, weighted) = T::sums(samples);
        self.level += Vector3::new(sum, x * sum + weighted, y * sum);
        sum
    }

    /// Adds a pixel.
    pub fn add_pixel(&mut self, place: &Vec2, level: f64) {
        self.add_weighted(place, level, 1.0);
    }

    /// Adds as many pixels as `weight` says, all at one place.
    pub fn add_weighted(&mut self, place: &Vec2, level: f64, weight: f64) {
        let (x, y) = (weight * place.x, weight * place.y);
        self.n += weight;
        self.x += x;
        self.y += y;
        self.xx += x * place.x;
        self.xy += x * place.y;
        self.yy += y * place.y;
        self.level += Vector3::new(weight, x, y) * level;
    }

    /// What the pixels of a region add up to, places counted from `centre`.
    pub fn within<T: Level>(image: &Raster<T>, centre: &Vec2, region: &Region) -> PlaneFit {
        let mut sums = PlaneFit::default();
        for y in region.rows(image.height()) {
            let run = region.columns(y, image.width());
            sums.add(run.start as f64 - centre.x, y as f64 - centre.y, &image.row(y)[run]);
        }
        sums
    }

    fn normal(&self) -> Matrix3<f64> {
        Matrix3::new(self.n, self.x, self.y, self.x, self.xx, self.xy, self.y, self.xy, self.yy)
    }

    /// Variance of the plane's level at a place, where a pixel's is 1.
    pub fn variance_at(&self, place: &Vec2) -> Option<f64> {
        let row = Vector3::new(1.0, place.x, place.y);
        Some(row.dot(&self.normal().cholesky()?.solve(&row)))
    }

    /// The plane of least squares.
    pub fn solve(&self) -> Option<Plane> {
        if self.n == 0.0 {
            return None;
        }
        let constant = Plane::constant(self.level[0] / self.n);
        if self.n < PLANE_PIXELS {
            return Some(constant);
        }
        Some(self.normal().cholesky().map_or(constant, |factor| Plane(factor.solve(&self.level))))
    }
}

/// A level that changes evenly from place to place.
#[derive(Debug, Clone, Copy)]
pub struct Plane(Vector3<f64>);

impl Plane {
    /// The same level everywhere.
    pub fn constant(level: f64) -> Plane {
        Plane(Vector3::new(level, 0.0, 0.0))
    }

    /// Its level at an offset from the centre.
    pub fn at(&self, p: &Vec2) -> f64 {
        self.0[0] + self.0[1] * p.x + self.0[2] * p.y
    }
}

/// Levels of the ground and of the mark, as functions of the offset from a centre.
#[derive(Debug, Clone, Copy)]
pub struct Levels {
    ground: Plane,
    mark: Plane,
    /// Farthest mean of a part of the ring from the ground's plane.
    uneven: f64,
}

impl Levels {
    /// Fits the ground between `clear` and `outer` and the mark within `inner`, places counted from `centre`;
    /// `None` where either has no pixel.
    pub fn fit<T: Level>(
        image: &Raster<T>,
        centre: &Vec2,
        inner: &Region,
        clear: &Region,
        outer: &Region,
    ) -> Option<Levels> {
        let (mut ground, mut mark) = (PlaneFit::default(), PlaneFit::default());
        let mut parts = [Mean::default(); PARTS];
        let width = image.width();
        let (inner_rows, clear_rows) = (inner.rows(image.height()), clear.rows(image.height()));
        for y in outer.rows(image.height()) {
            let (row, dy) = (image.row(y), y as f64 - centre.y);
            let mut add_ground = |part: usize, run: Range<usize>| {
                let (start, length) = (Vec2::new(run.start as f64 - centre.x, dy), run.len());
                let sum = ground.add(start.x, dy, &row[run]);
                parts[part].add_run(&start, length, sum);
            };
            let whole = outer.columns(y, width);
            if clear_rows.contains(&y) {
                let [left, right] = around(&whole, &clear.columns(y, width));
                // By the middles of the rows, so that thirds stay thirds upside down.
                let third = 3 * (2 * (y - clear_rows.start) + 1) / (2 * clear_rows.len());
                add_ground(2 + third, left);
                add_ground(5 + third, right);
            } else {
                add_ground(usize::from(y >= clear_rows.end), whole);
            }
            if inner_rows.contains(&y) {
                let run = inner.columns(y, width);
                mark.add(run.start as f64 - centre.x, dy, &row[run]);
            }
        }
        let levels = Levels::of(&ground, &mark)?;
        let uneven = parts.iter().map(|part| part.beside(&levels.ground).abs()).fold(0.0, f64::max);
        Some(Levels { uneven, ..levels })
    }

    /// The levels of a ground and of a mark, by what their pixels add up to.
    pub fn of(ground: &PlaneFit, mark: &PlaneFit) -> Option<Levels> {
        let (own, middle) = (mark.solve()?, Vec2::new(mark.x, mark.y) / mark.n);
        let ground = ground.solve()?;
        // Light falls on mark and ground alike, and the ground, being wider, shows its slope with less noise.
        // Not so for bright marks: their ground shows no light.
        let (mark_level, ground_level) = (own.at(&middle), ground.at(&middle));
        let mark = if 0.0 <= mark_level && mark_level < ground_level {
            Plane(ground.0 * (mark_level / ground_level))
        } else {
            own
        };
        Some(Levels { ground, mark, uneven: 0.0 })
    }

    /// Farthest mean of a part of the ring from the ground's plane, as a fraction of the contrast: something
    /// else may lie there.
    pub fn unevenness(&self) -> f64 {
        self.uneven / self.contrast().abs()
    }

    /// Ground minus mark at the centre.
    pub fn contrast(&self) -> f64 {
        self.ground.0[0] - self.mark.0[0]
    }

    /// Coverage of a pixel by the mark.
    pub fn coverage(&self, p: &Vec2, level: f64) -> f64 {
        let ground = self.ground.at(p);
        (ground - level) / (ground - self.mark.at(p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    #[test]
    fn light_that_falls_on_a_disc_is_found_exactly() {
        let ground = |x: f64, y: f64| 0.7 + 0.004 * x - 0.003 * y;
        let centre = Vec2::new(30.0, 25.0);
        let image = Raster::from_fn(64, 50, |x, y| {
            let (dx, dy) = (x as f64 - centre.x, y as f64 - centre.y);
            (ground(dx, dy) * if dx * dx + dy * dy < 100.0 { 0.25 } else { 1.0 }) as f32
        });
        let covariance = Matrix2::identity() * 25.0;
        let region = |by: f64| Region::new(centre, &covariance, by).unwrap();
        let levels = Levels::fit(&image, &centre, &region(-1.0), &region(1.0), &region(6.0)).unwrap();
        // Samples are rounded to 24 bits: 6e-8 of 0.7, less in the mean of hundreds.
        for p in [Vec2::new(0.0, 0.0), Vec2::new(12.0, -9.0)] {
            let (light, level) = (ground(p.x, p.y), 0.4);
            let expected = (light - level) / (light - 0.25 * light);
            assert!((levels.coverage(&p, level) - expected).abs() < 1e-6);
        }
        assert!((levels.contrast() - 0.75 * 0.7).abs() < 1e-6);
    }
}
