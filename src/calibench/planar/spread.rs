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
