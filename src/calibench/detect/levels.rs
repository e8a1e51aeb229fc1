//! How bright are ground and mark here? A plane through each, clear of the edge, so that smooth shading
//! cancels.

use super::region::{Region, around};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Fewest pixels that fix a plane; with fewer the level is taken as constant.
const PLANE_PIXELS: f64 = 40.0;

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

    /// Adds the pixels of a row, the first at `(x, y)`.
    fn add<T: Level>(&mut self, x: f64, y: f64, samples: &[T]) {
        if samples.is_empty() {
            return;
        }
        self.add_places(x, y, samples.len());
        let (sum, weighted) = T::sums(samples);
        self.level += Vector3::new(sum, x * sum + weighted, y * sum);
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
pub struct Levels {
    ground: Plane,
    mark: Plane,
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
        let width = image.width();
        let (inner_rows, clear_rows) = (inner.rows(image.height()), clear.rows(image.height()));
        for y in outer.rows(image.height()) {
            let (row, dy) = (image.row(y), y as f64 - centre.y);
            let add = |fit: &mut PlaneFit, run: Range<usize>| {
                fit.add(run.start as f64 - centre.x, dy, &row[run]);
            };
            let whole = outer.columns(y, width);
            if clear_rows.contains(&y) {
                let [left, right] = around(&whole, &clear.columns(y, width));
                add(&mut ground, left);
                add(&mut ground, right);
            } else {
                add(&mut ground, whole);
            }
            if inner_rows.contains(&y) {
                add(&mut mark, inner.columns(y, width));
            }
        }
        Levels::of(&ground, &mark)
    }

    fn of(ground: &PlaneFit, mark: &PlaneFit) -> Option<Levels> {
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
        Some(Levels { ground, mark })
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
