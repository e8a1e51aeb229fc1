//! Which affine map takes one set of points to another? Least squares, solved exactly.

use super::scatter::Scatter;
use super::{Mat3, Vec2};
use nalgebra::Matrix2;

/// An affine map `y = A x + t`: six parameters, parallels stay parallel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    /// `A`.
    pub linear: Matrix2<f64>,
    /// `t`.
    pub offset: Vec2,
}

/// Why an affine map or a similarity cannot be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinearFitError {
    /// Not enough pairs for the parameters.
    #[error("the map needs at least {need} point pairs, got {got}")]
    TooFewPoints {
        /// Least number.
        need: usize,
        /// Number given.
        got: usize,
    },
    /// The lists differ in length.
    #[error("{from} points on one side but {to} on the other")]
    Lengths {
        /// Number on the first side.
        from: usize,
        /// Number on the second.
        to: usize,
    },
    /// All points on one line, in one place, or not finite.
    #[error(
        "the {points} points do not span a plane (flatness {flatness:.1e}): they are collinear or coincide"
    )]
    Collinear {
        /// Number of points.
        points: usize,
        /// `4 det / trace^2` of the scatter matrix: 1 for a round cloud, 0 for a line.
        flatness: f64,
    },
    /// The pairs fit a turned and a mirrored map equally badly.
    #[error(
        "the {points} point pairs do not say whether the map mirrors (relative determinant {determinant:.1e}): \
         check which point belongs to which"
    )]
    HandednessUndecided {
        /// Number of pairs.
        points: usize,
        /// `2 det S / |S|^2` of the cross scatter `S`, between -1 (mirror) and 1 (rotation).
        determinant: f64,
    },
}

impl Affine {
    /// `A x + t`.
    pub fn apply(&self, point: &Vec2) -> Vec2 {
        self.linear * point + self.offset
    }

    /// `[[A, t], [0, 0, 1]]`.
    pub fn matrix(&self) -> Mat3 {
        let (a, t) = (&self.linear, &self.offset);
        Mat3::new(a[(0, 0)], a[(0, 1)], t.x, a[(1, 0)], a[(1, 1)], t.y, 0.0, 0.0, 1.0)
    }

    /// The map `from -> to` that minimises the squared distances in `to`.
    ///
    /// Both sides are reduced to their centroids; the two columns of the remaining design matrix are
    /// orthogonalised (Gram-Schmidt, twice, as a QR decomposition), so the condition number is not squared.
    ///
    /// # Errors
    /// Fewer than three pairs, or `from` on one line.
    ///
    /// ```
    /// use calibench::geometry::{Affine, Vec2};
    ///
    /// let from = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)];
    /// let to = [Vec2::new(5.0, 5.0), Vec2::new(7.0, 5.0), Vec2::new(5.0, 8.0)];
    /// let map = Affine::fit(&from, &to)?;
    /// assert!((map.apply(&Vec2::new(1.0, 1.0)) - Vec2::new(7.0, 8.0)).norm() < 1e-12);
    /// # Ok::<(), calibench::geometry::LinearFitError>(())
    /// ```
    pub fn fit(from: &[Vec2], to: &[Vec2]) -> Result<Affine, LinearFitError> {
        let (from_centroid, to_centroid) = checked_centroids(from, to, 3)?;
        let pairs = || from.iter().zip(to).map(|(f, t)| (f - from_centroid, t - to_centroid));
        // v is split into `slope u`, parallel to u, and a rest orthogonal to it.
        let uu: f64 = pairs().map(|(p, _)| p.x * p.x).sum();
        // A set on a vertical line was refused: uu > 0.
        let slope_once = pairs().map(|(p, _)| p.x * p.y).sum::<f64>() / uu;
        let slope_rest = pairs().map(|(p, _)| p.x * (p.y - slope_once * p.x)).sum::<f64>() / uu;
        let rest = |p: &Vec2| (p.y - slope_once * p.x) - slope_rest * p.x;
        let rest_square: f64 = pairs().map(|(p, _)| rest(&p) * rest(&p)).sum();
        let by_v = pairs().map(|(p, w)| w * rest(&p)).sum::<Vec2>() / rest_square;
        let by_u = pairs().map(|(p, w)| (w - by_v * p.y) * p.x).sum::<Vec2>() / uu;
        let linear = Matrix2::from_columns(&[by_u, by_v]);
        Ok(Affine { linear, offset: to_centroid - linear * from_centroid })
    }
}

/// The centroids of both sides, once they are known to define a map.
pub(super) fn checked_centroids(
    from: &[Vec2],
    to: &[Vec2],
    need: usize,
) -> Result<(Vec2, Vec2), LinearFitError> {
    if from.len() != to.len() {
        return Err(LinearFitError::Lengths { from: from.len(), to: to.len() });
    }
    if from.len() < need {
        return Err(LinearFitError::TooFewPoints { need, got: from.len() });
    }
    let scatter = Scatter::of(from);
    if !scatter.spans_a_plane() {
        return Err(LinearFitError::Collinear { points: from.len(), flatness: scatter.flatness });
    }
    Ok((scatter.centroid, Scatter::of(to).centroid))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn scattered() -> Vec<Vec2> {
        (0..9).map(|i| Vec2::new(f64::from(i % 3) + 0.1 * f64::from(i), f64::from(i / 3))).collect()
    }

    proptest! {
        #[test]
        fn a_noiseless_map_is_found_to_rounding(a in prop::array::uniform6(-2.0f64..2.0)) {
            let truth = Affine { linear: Matrix2::new(a[0], a[1], a[2], a[3]), offset: Vec2::new(a[4], a[5]) };
            let to: Vec<Vec2> = scattered().iter().map(|p| truth.apply(p)).collect();
            let fit = Affine::fit(&scattered(), &to).unwrap();
            // Entries below 10, nine points, a handful of roundings each.
            prop_assert!((fit.matrix() - truth.matrix()).norm() < 1e-14);
        }

        #[test]
        fn residuals_are_orthogonal_to_the_design(noise in prop::collection::vec(-1.0f64..1.0, 18)) {
            let to: Vec<Vec2> = scattered().iter().zip(noise.chunks(2)).map(|(p, n)| p + Vec2::new(n[0], n[1])).collect();
            let fit = Affine::fit(&scattered(), &to).unwrap();
            let residuals = scattered().iter().zip(&to).map(|(p, w)| (*p, fit.apply(p) - w)).collect::<Vec<_>>();
            prop_assert!(residuals.iter().map(|(_, r)| r).sum::<Vec2>().norm() < 1e-13);
            prop_assert!(residuals.iter().map(|(p, r)| r * p.x).sum::<Vec2>().norm() < 1e-13);
            prop_assert!(residuals.iter().map(|(p, r)| r * p.y).sum::<Vec2>().norm() < 1e-13);
        }
    }

    #[test]
    fn sets_that_fix_no_map_are_refused() {
        let line: Vec<Vec2> = (0..4).map(|i| Vec2::new(1.0, f64::from(i))).collect();
        assert!(matches!(
            Affine::fit(&line, &line),
            Err(LinearFitError::Collinear { points: 4, flatness }) if flatness == 0.0
        ));
        assert_eq!(
            Affine::fit(&line[..2], &line[..2]),
            Err(LinearFitError::TooFewPoints { need: 3, got: 2 })
        );
        assert_eq!(Affine::fit(&line, &line[..2]), Err(LinearFitError::Lengths { from: 4, to: 2 }));
    }
}
