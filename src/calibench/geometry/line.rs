//! How straight is a row of points? The line that minimises the squared perpendicular distances.

use super::Vec2;

/// A line fitted by orthogonal regression (total least squares, Pearson 1901), with the distances of its
/// points.
#[derive(Debug, Clone, PartialEq)]
pub struct LineFit {
    /// A point of the line: the points' mean.
    pub point: Vec2,
    /// Unit vector along the line, `x >= 0`.
    pub direction: Vec2,
    /// Signed perpendicular distance of every point, in the points' unit; positive on the side of `(-d_y,
    /// d_x)`.
    pub deviations: Vec<f64>,
}

/// Why points fix no line.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LineError {
    /// Two points are the least.
    #[error("a line needs at least 2 points, got {got}")]
    TooFewPoints {
        /// Number given.
        got: usize,
    },
    /// NaN or infinite coordinates.
    #[error("point {index} ({x}, {y}) is not finite")]
    NotFinite {
        /// Index of the point.
        index: usize,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
    },
    /// All points in one place, or spread evenly in all directions.
    #[error("the {points} points have no direction: they coincide, or spread alike along all directions")]
    NoDirection {
        /// Number of points.
        points: usize,
    },
}

impl LineFit {
    /// Fits a line through at least two points that are not all the same.
    ///
    /// With the centred second moments `S`, the direction has the angle `atan2(2 S_xy, S_xx - S_yy) / 2`: the
    /// axis of the larger eigenvalue of `S`.
    ///
    /// # Errors
    /// See [`LineError`]: fewer than two points, all of them the same, or a coordinate that is not finite.
    pub fn new(points: &[Vec2]) -> Result<LineFit, LineError> {
        if points.len() < 2 {
            return Err(LineError::TooFewPoints { got: points.len() });
        }
        if let Some(index) = points.iter().position(|p| !(p.x.is_finite() && p.y.is_finite())) {
            return Err(LineError::NotFinite { index, x: points[index].x, y: points[index].y });
        }
        let mean = points.iter().sum::<Vec2>() / points.len() as f64;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for d in points.iter().map(|p| p - mean) {
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
        }
        if xy == 0.0 && xx == yy {
            return Err(LineError::NoDirection { points: points.len() });
        }
        let (sin, cos) = libm::sincos(0.5 * libm::atan2(2.0 * xy, xx - yy));
        let deviations = points.iter().map(|p| cos * (p.y - mean.y) - sin * (p.x - mean.x)).collect();
        Ok(LineFit { point: mean, direction: Vec2::new(cos, sin), deviations })
    }

    /// Largest distance of a point from the line.
    pub fn max_deviation(&self) -> f64 {
        self.deviations.iter().fold(0.0, |largest, d| largest.max(d.abs()))
    }

    /// Root mean square of the distances, over all points.
    pub fn rms_deviation(&self) -> f64 {
        let sum: f64 = self.deviations.iter().map(|d| d * d).sum();
        (sum / self.deviations.len() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn points_of_a_line_have_no_deviation(angle in -3.2f64..3.2, x in -500.0f64..500.0, y in -500.0f64..500.0) {
            let (sin, cos) = libm::sincos(angle);
            let points: Vec<Vec2> = (0..9).map(|i| Vec2::new(x + 10.0 * cos * f64::from(i), y + 10.0 * sin * f64::from(i))).collect();
            let fit = LineFit::new(&points).unwrap();
            // Coordinates below 600 carry roundings of 600 eps = 1.3e-13 each.
            prop_assert!(fit.max_deviation() < 1e-12);
            prop_assert!((fit.direction.x * sin - fit.direction.y * cos).abs() < 1e-13);
        }

        #[test]
        fn no_other_line_is_closer(coordinates in prop::collection::vec(-10.0f64..10.0, 10..30), turn in -0.1f64..0.1, shift in -0.1f64..0.1) {
            let points: Vec<Vec2> = coordinates.chunks_exact(2).map(|c| Vec2::new(c[0], c[1])).collect();
            let fit = LineFit::new(&points).unwrap();
            let (sin, cos) = libm::sincos(turn);
            let direction = Vec2::new(cos * fit.direction.x - sin * fit.direction.y, sin * fit.direction.x + cos * fit.direction.y);
            let normal = Vec2::new(-direction.y, direction.x);
            let other: f64 = points.iter().map(|p| (p - fit.point).dot(&normal) + shift).map(|d| d * d).sum();
            let best: f64 = fit.deviations.iter().map(|d| d * d).sum();
            prop_assert!(best <= other * (1.0 + 1e-12) + 1e-12);
        }
    }

    #[test]
    fn a_vertical_line_is_a_line() {
        let fit = LineFit::new(&[Vec2::new(3.0, 0.0), Vec2::new(3.5, 10.0), Vec2::new(3.0, 20.0)]).unwrap();
        assert!(fit.direction.y.abs() > 0.999);
        // The middle point stands 2/3 of 0.5 from the mean line, the outer ones 1/3.
        assert!((fit.max_deviation() - 1.0 / 3.0).abs() < 1e-12);
        assert!((fit.rms_deviation() - (1.0f64 / 18.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn points_without_a_direction_are_refused() {
        let point = Vec2::new(1.0, 2.0);
        assert_eq!(LineFit::new(&[point]), Err(LineError::TooFewPoints { got: 1 }));
        assert_eq!(LineFit::new(&[point, point]), Err(LineError::NoDirection { points: 2 }));
        assert!(matches!(
            LineFit::new(&[point, Vec2::new(f64::NAN, 0.0)]),
            Err(LineError::NotFinite { index: 1, .. })
        ));
    }
}
