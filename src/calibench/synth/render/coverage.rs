//! How much of each pixel does a region cover? Signed areas summed along its outline.
//!
//! A step `dy` of the outline covers everything to its right; steps up and down cancel outside the region.
//! Each step enters as a difference along its row, so that one running sum at the end gives every pixel's
//! coverage. (The scheme of area-coverage font rasterisers, here with curved edges.)

use super::outline::Arc;
use crate::geometry::Vec2;

/// Coverage of each pixel, as differences along the rows until [`Coverage::finish`] sums them.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    width: usize,
    height: usize,
    differences: Vec<f64>,
}

impl Coverage {
    /// Nothing covered.
    pub fn new(width: usize, height: usize) -> Coverage {
        Coverage { width, height, differences: vec![0.0; width * height] }
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Changes the coverage of pixel `(column, row)` and all to its right by `area`. Left of the image counts
    /// as its first column; right of it nothing changes.
    pub fn step(&mut self, column: i64, row: usize, area: f64) {
        let column = column.max(0) as usize;
        if column < self.width {
            self.differences[row * self.width + column] += area;
        }
    }

    /// Adds an arc of an outline: the two chords of its halves and the slivers between them and the arc.
    pub fn add_arc(&mut self, arc: &Arc) {
        // Half a parabola's arc has an eighth of its sliver.
        let sliver = arc.sliver() / 8.0;
        for (from, to) in [(arc.from, arc.middle), (arc.middle, arc.to)] {
            self.add_chord(from, to);
            self.add_sliver((from + to) * 0.5, sliver);
        }
    }

    /// Credits a sliver to the pixel at its place. A step covers what is right of it, `-oint x dy`, hence the
    /// sign.
    fn add_sliver(&mut self, at: Vec2, sliver: f64) {
        let (column, row) = (libm::floor(at.x + 0.5), libm::floor(at.y + 0.5));
        if row >= 0.0 && row < self.height as f64 && column >= 0.0 && column < self.width as f64 {
            self.step(column as i64, row as usize, -sliver);
            self.step(column as i64 + 1, row as usize, sliver);
        }
    }

    /// Adds a straight step, cut at the borders of pixel rows.
    fn add_chord(&mut self, from: Vec2, to: Vec2) {
        // From here on pixel (i, j) is the square i ... i + 1, j ... j + 1.
        let (from, to) = (from + Vec2::new(0.5, 0.5), to + Vec2::new(0.5, 0.5));
        if from.y == to.y {
            return;
        }
        let (top, bottom, sign) = if from.y < to.y { (from, to, 1.0) } else { (to, from, -1.0) };
        let slope = (bottom.x - top.x) / (bottom.y - top.y);
        let x_at = |y: f64| if y >= bottom.y { bottom.x } else { top.x + slope * (y - top.y) };
        let first = libm::floor(top.y.max(0.0)) as usize;
        let end = libm::ceil(bottom.y.min(self.height as f64)).max(0.0) as usize;
        for row in first..end.min(self.height) {
            let low = top.y.max(row as f64);
            let high = bottom.y.min((row + 1) as f64);
            if high > low {
                self.add_in_row(row, x_at(low), x_at(high), sign * (high - low));
            }
        }
    }

    /// Adds a step of height `dy` that runs between two abscissae within one row, cut at the borders of
    /// columns.
    fn add_in_row(&mut self, row: usize, x0: f64, x1: f64, dy: f64) {
        let (left, right) = (x0.min(x1), x0.max(x1));
        let (low, high) = (left.clamp(0.0, self.width as f64), right.clamp(0.0, self.width as f64));
        if left >= self.width as f64 {
            return;
        }
        if right - left <= 0.0 || right <= 0.0 {
            return self.add_in_cell(row, libm::floor(low) as i64, low, dy);
        }
        let per_px = dy / (right - left);
        if left < 0.0 {
            self.step(0, row, -left * per_px);
        }
        let mut x = low;
        while x < high {
            let column = libm::floor(x);
            let next = (column + 1.0).min(high);
            self.add_in_cell(row, column as i64, 0.5 * (x + next), (next - x) * per_px);
            x = next;
        }
    }

    /// Adds a step of height `dy` inside one pixel, at mean abscissa `x`: of the pixel, the part right of it
    /// is covered.
    fn add_in_cell(&mut self, row: usize, column: i64, x: f64, dy: f64) {
        let left_part = x - column as f64;
        self.step(column, row, dy * (1.0 - left_part));
        self.step(column + 1, row, dy * left_part);
    }

    /// Sums the differences. Outlines seen from behind turn the other way: the sum's sign is taken out.
    pub fn finish(&mut self) {
        let mut total = 0.0;
        for row in self.differences.chunks_exact_mut(self.width.max(1)) {
            let mut sum = 0.0;
            for cell in row {
                sum += *cell;
                *cell = sum;
                total += sum;
            }
        }
        if total < 0.0 {
            self.differences.iter_mut().for_each(|cell| *cell = -*cell);
        }
    }

    /// Coverage of a pixel, 0 ... 1, after [`Coverage::finish`].
    pub fn at(&self, column: usize, row: usize) -> f64 {
        self.differences[row * self.width + column]
    }
}

#[cfg(test)]
mod tests {
    use super::super::outline::{Outline, Steps, trace};
    use super::super::window::Window;
    use super::*;
    use std::convert::Infallible;

    fn covered_by(outline: &Outline, width: usize, height: usize) -> Coverage {
        let mut coverage = Coverage::new(width, height);
        for piece in &outline.pieces {
            let curve = |t: f64| Ok::<_, Infallible>(piece.at(t));
            trace(&curve, piece.start_parts(), &Steps::SHARP, &Window::ALL, &mut |arc| coverage.add_arc(arc))
                .unwrap();
        }
        coverage.finish();
        coverage
    }

    /// Area of the disc of radius `r` about the origin left of `x` and below `y` (both signed), from the
    /// circle's antiderivative: an independent closed form.
    fn quadrant_area(x: f64, y: f64, r: f64) -> f64 {
        let segment = |t: f64| {
            let t = t.clamp(-r, r);
            0.5 * (t * (r * r - t * t).max(0.0).sqrt() + r * r * libm::asin(t / r))
        };
        let x = x.clamp(-r, r);
        let y = y.clamp(-r, r);
        // Integrate min(y, +sqrt) - max(-sqrt) over t from -r to x, splitting where the circle crosses y.
        let cross = (r * r - y * y).max(0.0).sqrt();
        let lower = |from: f64, to: f64| segment(to) - segment(from);
        let mut area = 0.0;
        for (from, to) in [(-r, -cross), (-cross, cross), (cross, r)] {
            let to = to.min(x);
            if to > from {
                area += if from.abs() > cross || to.abs() > cross {
                    if y > 0.0 { 2.0 * lower(from, to) } else { 0.0 }
                } else {
                    y * (to - from) + lower(from, to)
                };
            }
        }
        area
    }

    #[test]
    fn the_coverage_of_a_disc_is_its_closed_form() {
        let mut largest = 0.0f64;
        for (centre, r) in
            [(Vec2::new(9.3, 10.7), 7.5), (Vec2::new(10.0, 10.0), 2.0), (Vec2::new(8.5, 9.5), 0.4)]
        {
            let coverage = covered_by(&Outline::disc(centre, r), 20, 20);
            for row in 0..20 {
                for column in 0..20 {
                    let (x, y) = (column as f64 - centre.x, row as f64 - centre.y);
                    let area = |dx: f64, dy: f64| quadrant_area(x + dx, y + dy, r);
                    let exact = area(0.5, 0.5) - area(-0.5, 0.5) - area(0.5, -0.5) + area(-0.5, -0.5);
                    largest = largest.max((coverage.at(column, row) - exact).abs());
                }
            }
        }
        // Four slivers of 1e-7 px^2 at most lie on a pixel's border.
        assert!(largest < 4e-7, "{largest:e}");
        assert!(largest > 0.0);
    }

    #[test]
    fn regions_that_leave_the_image_cover_what_is_inside() {
        let outline = Outline::rectangle(Vec2::new(-30.0, -7.0), Vec2::new(4.25, 2.0));
        let coverage = covered_by(&outline, 10, 8);
        assert_eq!(coverage.at(0, 0), 1.0);
        assert_eq!(coverage.at(4, 0), 0.75);
        assert_eq!(coverage.at(3, 2), 0.5);
        assert_eq!(coverage.at(5, 0), 0.0);
        assert_eq!(coverage.at(3, 3), 0.0);
        let all = covered_by(&Outline::rectangle(Vec2::new(-3.0, -3.0), Vec2::new(30.0, 30.0)), 10, 8);
        assert!((0..8).all(|row| (0..10).all(|column| (all.at(column, row) - 1.0).abs() < 1e-14)));
    }
}
