//! What level do some pixels have, and where? Sums that are filled by pixels or by runs of a row.

use super::levels::Plane;
use crate::geometry::Vec2;

/// Some pixels around a mark.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mean {
    pub count: f64,
    places: Vec2,
    levels: f64,
}

impl Mean {
    /// Adds a pixel.
    pub fn add_pixel(&mut self, place: &Vec2, level: f64) {
        self.count += 1.0;
        self.places += place;
        self.levels += level;
    }

    /// Adds a run of a row with the sum of its levels, `start` the place of its first pixel.
    pub fn add_run(&mut self, start: &Vec2, length: usize, sum: f64) {
        let n = length as f64;
        self.count += n;
        self.places += Vec2::new(n * (start.x + 0.5 * (n - 1.0)), n * start.y);
        self.levels += sum;
    }

    /// The mean place; that of one pixel at least.
    pub fn place(&self) -> Vec2 {
        self.places / self.count
    }

    /// The mean level; that of one pixel at least.
    pub fn level(&self) -> f64 {
        self.levels / self.count
    }

    /// How far the mean lies from a plane; without pixels, on it.
    pub fn beside(&self, plane: &Plane) -> f64 {
        if self.count == 0.0 {
            return 0.0;
        }
        self.level() - plane.at(&self.place())
    }
}
