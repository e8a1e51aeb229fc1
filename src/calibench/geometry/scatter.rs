//! Where is a cloud of points, how wide is it, and does it span a plane?

use super::Vec2;
use nalgebra::Matrix2;

/// Flatness from which points span a plane. A line seen with rounding errors has 1e-16; points that leave
/// their line by a millionth of its length have 1e-12 and still pass.
pub(super) const SMALLEST_FLATNESS: f64 = 1e-13;

/// Centre and extent of a cloud of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Mean point.
    pub centroid: Vec2,
    /// `sqrt(mean |p - centroid|^2)`.
    pub rms_radius: f64,
    /// `4 det / trace^2` of the scatter matrix: 1 for a round cloud, 0 for a line, NaN for a single place.
    pub flatness: f64,
}

impl Scatter {
    /// The scatter of a list of points; all NaN for an empty list.
    ///
    /// The mean is corrected by the mean of the offsets from it, so that it is the nearest number even where
    /// coordinates are large against their differences.
    pub fn of(points: &[Vec2]) -> Scatter {
        let count = points.len() as f64;
        let near = points.iter().sum::<Vec2>() / count;
        let centroid = near + points.iter().map(|p| p - near).sum::<Vec2>() / count;
        let scatter = points.iter().fold(Matrix2::zeros(), |sum, p| {
            let offset = p - centroid;
            sum + offset * offset.transpose()
        });
        let trace = scatter.trace();
        Scatter {
            centroid,
            rms_radius: (trace / count).sqrt(),
            flatness: 4.0 * scatter.determinant() / (trace * trace),
        }
    }

    /// Whether the points span a plane.
    pub fn spans_a_plane(&self) -> bool {
        self.flatness > SMALLEST_FLATNESS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_round_and_a_line_is_flat() {
        let square = [(0.0, 0.0), (2.0, 0.0), (0.0, 2.0), (2.0, 2.0)].map(|(x, y)| Vec2::new(x, y));
        let scatter = Scatter::of(&square);
        assert_eq!(scatter.centroid, Vec2::new(1.0, 1.0));
        assert_eq!(scatter.rms_radius, 2.0f64.sqrt());
        assert_eq!(scatter.flatness, 1.0);
        let line = [0.1, 0.7, 0.9].map(|x| Vec2::new(x, 3.0 * x));
        assert!(!Scatter::of(&line).spans_a_plane());
        assert!(!Scatter::of(&[Vec2::new(1.0, 1.0); 5]).spans_a_plane());
    }
}
