//! How uncertain is a plane map? Covariance from the residuals, and what it means for a measured point.

use super::map::{PlaneMap, translation};
use super::pairs::Pairs;
use crate::geometry::Vec2;
use crate::geometry::projective_frame::{EntryCovariance, change_frames};
use nalgebra::{DMatrix, Matrix2};

/// Uncertainty of a plane map, to first order, under independent errors of equal size in both world
/// coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneSpread {
    /// Standard deviation of a world coordinate, estimated: `sqrt(sum |r|^2 / degrees of freedom)`.
    pub sigma: f64,
    /// Covariance of the matrix's first eight entries, row by row, at the scale `m33 = 1`; its rank is the
    /// number of parameters. `None` if pixel (0, 0) lies on the horizon, where that scale does not exist.
    pub covariance: Option<EntryCovariance>,
    map: PlaneMap,
    local_covariance: EntryCovariance,
}

impl PlaneSpread {
    /// Covariance of the world point that the map gives for a pixel, world units squared; `None` behind the
    /// horizon. It covers the map's error, not that of measuring the pixel.
    pub fn world_covariance(&self, pixel: &Vec2) -> Option<Matrix2<f64>> {
        let jacobian = self.map.entry_jacobian(&(pixel - self.map.pixel_origin))?;
        Some(jacobian * self.local_covariance * jacobian.transpose())
    }

    /// Covariance of the difference of the world points that the map gives for two pixels, `b - a`, world
    /// units squared; `None` behind the horizon. What both share, as the map's shift, drops out.
    pub fn difference_covariance(&self, a: &Vec2, b: &Vec2) -> Option<Matrix2<f64>> {
        let jacobian = |pixel: &Vec2| self.map.entry_jacobian(&(pixel - self.map.pixel_origin));
        let difference = jacobian(b)? - jacobian(a)?;
        Some(difference * self.local_covariance * difference.transpose())
    }

    /// The spread of a map whose parameters move the entries of `L` by the columns of `basis` (8 x p); `None`
    /// where the normal equations are singular.
    pub(super) fn of(map: &PlaneMap, pairs: &Pairs, basis: &DMatrix<f64>, sigma: f64) -> Option<PlaneSpread> {
        // Pixel offsets in units of their radius make the normal equations well conditioned: entries 1 and 2
        // of a row scale.
        let unit = pairs.pixel_radius;
        let scaled = DMatrix::from_fn(8, basis.ncols(), |row, column| {
            basis[(row, column)] / if row % 3 == 2 { 1.0 } else { unit }
        });
        let mut normal = DMatrix::zeros(basis.ncols(), basis.ncols());
        for p in &pairs.pixels {
            let rows = map.entry_jacobian(p)? * &scaled;
            normal += rows.transpose() * &rows;
        }
        let inverse = normal.cholesky()?.inverse();
        let product = &scaled * inverse * scaled.transpose() * (sigma * sigma);
        let local_covariance = EntryCovariance::from_fn(|i, j| product[(i, j)]);
        let (left, right) = (translation(&map.world_origin), translation(&-map.pixel_origin));
        let covariance = change_frames(&left, &map.local, &right, &local_covariance);
        Some(PlaneSpread { sigma, covariance, map: *map, local_covariance })
    }
}

#[cfg(test)]
mod tests {
    use crate::geometry::Vec2;
    use crate::planar::{PlaneModel, calibrate_plane};
    use nalgebra::Matrix2;

    #[test]
    fn a_point_is_as_uncertain_as_a_regression_on_a_grid_says() {
        // Nine marks 200 px apart. A slope rests on the squares of one coordinate in an affine map, 6 * 200^2
        // about the centroid, and of both in a similarity; at an offset d the variance of X and of Y is
        // sigma^2 (1 / 9 +
        // |d|^2 / sum of squares), and the two are not correlated.
        let pixels: Vec<Vec2> =
            (0..9).map(|i| Vec2::new(f64::from(i % 3), f64::from(i / 3)) * 200.0).collect();
        let error = |i: usize| ((i * 7919) % 211) as f64 / 1e5;
        let world: Vec<Vec2> =
            (0..9).map(|i| pixels[i] * 0.01 + Vec2::new(error(i), error(i + 40))).collect();
        let centre = Vec2::new(200.0, 200.0);
        let (a, b) = (Vec2::new(-50.0, 130.0), Vec2::new(410.0, 20.0));
        for (model, freedom, squares) in
            [(PlaneModel::Affine, 12.0, 6.0 * 4e4), (PlaneModel::Similarity, 14.0, 12.0 * 4e4)]
        {
            let fit = calibrate_plane(model, &pixels, &world).unwrap();
            let spread = fit.spread.as_ref().unwrap();
            let variance = fit.residuals.iter().map(Vec2::norm_squared).sum::<f64>() / freedom;
            assert!((spread.sigma - variance.sqrt()).abs() < 1e-12 * spread.sigma);
            let agree = |found: Matrix2<f64>, expected: f64| {
                let expected = Matrix2::identity() * (variance * expected);
                assert!(
                    (found - expected).norm() < 1e-9 * expected.norm(),
                    "{model:?}: {found} for {expected}"
                );
            };
            for pixel in [centre, a, b] {
                let share = 1.0 / 9.0 + (pixel - centre).norm_squared() / squares;
                agree(spread.world_covariance(&pixel).unwrap(), share);
            }
            agree(spread.difference_covariance(&a, &b).unwrap(), (b - a).norm_squared() / squares);
        }
    }
}
