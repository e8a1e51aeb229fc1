//! What of the deviations did the board do as a whole? The part that lies in the eight fields by which the
//! image of a plane can change.
//!
//! A homography next to the identity moves a place `(x, y)` of the image by a combination of
//!
//! ```text
//! (1, 0)  (0, 1)  (x, 0)  (y, 0)  (0, x)  (0, y)  (x^2, x y)  (x y, y^2)
//! ```
//! A board or camera that moves by a little moves the marks so, whatever the lens but for its own bending of
//! these fields, which is of second order. The fields at the marks, made orthonormal, are `Q`; `Q Q^T e` is
//! motion, the rest noise. Of white noise the fields take `8` of the `2 m` coordinates.

use super::frames::Deviations;
use crate::geometry::Vec2;

/// Fields at the marks, orthonormal.
pub struct Motion {
    fields: Vec<Vec<Vec2>>,
    marks: usize,
}

/// A field that has less than this part of its length left beside the others is one of them: marks on a line.
const LEAST_LEFT: f64 = 1e-6;

impl Motion {
    /// No motion is looked for.
    pub fn none(marks: usize) -> Motion {
        Motion { fields: Vec::new(), marks }
    }

    /// Of marks at these places.
    pub fn of(places_px: &[Vec2]) -> Motion {
        let count = places_px.len() as f64;
        let middle = places_px.iter().sum::<Vec2>() / count;
        let size = (places_px.iter().map(|p| (p - middle).norm_squared()).sum::<f64>() / count).sqrt();
        let mut motion = Motion::none(places_px.len());
        for field in 0..8 {
            let at = |place: &Vec2| {
                let p = (place - middle) / size;
                match field {
                    0 => Vec2::new(1.0, 0.0),
                    1 => Vec2::new(0.0, 1.0),
                    2 => Vec2::new(p.x, 0.0),
                    3 => Vec2::new(p.y, 0.0),
                    4 => Vec2::new(0.0, p.x),
                    5 => Vec2::new(0.0, p.y),
                    6 => p * p.x,
                    _ => p * p.y,
                }
            };
            motion.add(places_px.iter().map(at).collect());
        }
        motion
    }

    /// Adds a field, made orthogonal to the others (Gram & Schmidt, twice for the last digits).
    fn add(&mut self, mut field: Vec<Vec2>) {
        let length = dot(&field, &field).sqrt();
        for _ in 0..2 {
            for other in &self.fields {
                let along = dot(other, &field);
                field.iter_mut().zip(other).for_each(|(f, o)| *f -= o * along);
            }
        }
        let left = dot(&field, &field).sqrt();
        if left > LEAST_LEFT * length {
            field.iter_mut().for_each(|f| *f /= left);
            self.fields.push(field);
        }
    }

    /// Number of fields.
    pub fn dimensions(&self) -> usize {
        self.fields.len()
    }

    /// What moved as a whole, and the rest.
    pub fn split(&self, seen: &Deviations) -> (Deviations, Deviations) {
        let (mut moved, mut rest) = (Vec::new(), Vec::new());
        for frame in &seen.frames {
            let mut motion = vec![Vec2::zeros(); frame.len()];
            for field in &self.fields {
                let along = dot(field, frame);
                motion.iter_mut().zip(field).for_each(|(m, f)| *m += f * along);
            }
            rest.push(frame.iter().zip(&motion).map(|(seen, moved)| seen - moved).collect());
            moved.push(motion);
        }
        (Deviations { frames: moved }, Deviations { frames: rest })
    }

    /// Part of white noise's variance that the fields leave of a mark's u and v.
    pub fn left_of(&self, mark: usize) -> Vec2 {
        let taken: Vec2 = self.fields.iter().map(|field| field[mark].component_mul(&field[mark])).sum();
        Vec2::repeat(1.0) - taken
    }

    /// Coordinates that the fields leave, of u and of v.
    pub fn left(&self) -> Vec2 {
        (0..self.marks).map(|mark| self.left_of(mark)).sum()
    }

    /// Covariance that the fields give the coordinates of white noise: of u and v of the marks, summed.
    pub fn covariance_uv(&self) -> f64 {
        -self.fields.iter().flatten().map(|f| f.x * f.y).sum::<f64>()
    }

    /// The same of two marks, u with u and v with v.
    pub fn covariance(&self, [a, b]: [usize; 2]) -> f64 {
        -self.fields.iter().map(|field| field[a].dot(&field[b])).sum::<f64>()
    }
}

/// Sum of products over all marks.
pub fn dot(a: &[Vec2], b: &[Vec2]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Board;
    use crate::camera::Camera;
    use crate::geometry::{Pose, Vec3, rotation};

    fn places(turn_rad: f64, shift: f64) -> Vec<Vec2> {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.3 + turn_rad, 0.2 - turn_rad, turn_rad),
            translation: Vec3::new(shift, -shift, 130.0 + shift),
        };
        let points = Board::chessboard(9, 7, 10.0).unwrap().points();
        points.iter().map(|p| camera.project(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap()).collect()
    }

    #[test]
    fn a_small_motion_of_the_board_is_motion_and_nothing_else() {
        let (before, after) = (places(0.0, 0.0), places(2e-4, 0.02));
        let motion = Motion::of(&before);
        assert_eq!(motion.dimensions(), 8);
        let seen = Deviations { frames: vec![after.iter().zip(&before).map(|(a, b)| a - b).collect()] };
        let (moved, rest) = motion.split(&seen);
        // Second order: the square of a motion of a few ten-thousandths, times the focal length.
        assert!(moved.square().sqrt() > 0.5 && rest.square().sqrt() < 1e-3 * moved.square().sqrt());
    }

    #[test]
    fn the_fields_take_eight_coordinates_and_fewer_of_marks_on_a_line() {
        let motion = Motion::of(&places(0.0, 0.0));
        assert!((motion.left().sum() - (126.0 - 8.0)).abs() < 1e-9);
        let line: Vec<Vec2> = (0..9).map(|i| Vec2::new(f64::from(i) * 20.0, 5.0)).collect();
        assert!(Motion::of(&line).dimensions() < 8);
    }
}
