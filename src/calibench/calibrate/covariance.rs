//! How well are the unknowns known? Covariance blocks and what follows from them.

use crate::camera::{FreeParameters, Parameter};
use crate::geometry::Vec2;
use nalgebra::{DMatrix, Matrix2, MatrixXx6, SMatrix};

/// Covariance of the free intrinsics and of every pose.
///
/// To first order the estimate is Gaussian with covariance `sigma^2 (J^T J)^-1`; poses are marginal over the
/// intrinsics and the other way round. Pose entries: rotation vector of `R <- exp(delta) R` in rad, then
/// translation in the target's unit.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "data::Rows", try_from = "data::Rows"))]
#[non_exhaustive]
pub struct Covariance {
    /// Which parameters the rows of `intrinsics` are, in order.
    pub free: FreeParameters,
    /// fy over fx, if the two are tied: fy then has no row, the standard deviation of fx times this ratio,
    /// and the correlations of fx.
    pub fy_per_fx: Option<f64>,
    /// n x n.
    pub intrinsics: DMatrix<f64>,
    /// 6 x 6 a view.
    pub poses: Vec<SMatrix<f64, 6, 6>>,
    /// n x 6 a view: intrinsics with that view's pose.
    pub cross: Vec<MatrixXx6<f64>>,
}

impl Covariance {
    /// Of parameters of which none is tied: `intrinsics` n x n for the n parameters of `free`, and 6 x 6 and
    /// n x 6 a view.
    pub fn untied(
        free: FreeParameters,
        intrinsics: DMatrix<f64>,
        poses: Vec<SMatrix<f64, 6, 6>>,
        cross: Vec<MatrixXx6<f64>>,
    ) -> Covariance {
        Covariance { free, fy_per_fx: None, intrinsics, poses, cross }
    }

    /// The part of some views, by their numbers here, in their order.
    ///
    /// # Panics
    /// Where there is no such view.
    pub fn of_views(&self, views: impl Iterator<Item = usize> + Clone) -> Covariance {
        Covariance {
            free: self.free,
            fy_per_fx: self.fy_per_fx,
            intrinsics: self.intrinsics.clone(),
            poses: views.clone().map(|view| self.poses[view]).collect(),
            cross: views.map(|view| self.cross[view].clone()).collect(),
        }
    }

    /// The covariance for noise of variance `factor` times that of this one.
    pub fn scaled(mut self, factor: f64) -> Covariance {
        self.intrinsics *= factor;
        self.poses.iter_mut().for_each(|block| *block *= factor);
        self.cross.iter_mut().for_each(|block| *block *= factor);
        self
    }

    /// Standard deviation of an intrinsic parameter; `None` if it was not estimated.
    pub fn standard_deviation(&self, parameter: Parameter) -> Option<f64> {
        let (i, factor) = self.row(parameter)?;
        Some(factor * self.intrinsics[(i, i)].sqrt())
    }

    /// Correlation coefficient of two intrinsic parameters, 1 of fx and an fy that is tied to it; `None` if
    /// one was not estimated.
    pub fn correlation(&self, a: Parameter, b: Parameter) -> Option<f64> {
        let ((i, _), (j, _)) = (self.row(a)?, self.row(b)?);
        let m = &self.intrinsics;
        Some(m[(i, j)] / (m[(i, i)] * m[(j, j)]).sqrt())
    }

    /// The columns of the estimated parameters, from those of all ten in the Jacobian of a pixel: to that of
    /// fx an fy that is tied to it adds its share.
    pub fn columns(&self, of_all: &SMatrix<f64, 2, { Parameter::COUNT }>) -> Vec<Vec2> {
        let column = |parameter: Parameter| of_all.column(parameter as usize).into_owned();
        let with_tie = |parameter: Parameter| match self.fy_per_fx {
            Some(ratio) if parameter == Parameter::Fx => column(parameter) + ratio * column(Parameter::Fy),
            _ => column(parameter),
        };
        self.free.iter().map(with_tie).collect()
    }

    /// How an output is spread, px, in its worst direction, whose derivatives by a camera's parameters are
    /// given: with `J` those of the estimated ones and `P` their covariance the root of the larger eigenvalue
    /// of `J P J^T`. To that of fx an fy that is tied to it adds its share.
    pub fn largest_spread(&self, by_parameters: &[(Parameter, Vec2)]) -> f64 {
        let slope = |parameter: Parameter| {
            by_parameters.iter().find(|(p, _)| *p == parameter).map_or(Vec2::zeros(), |(_, slope)| *slope)
        };
        let with_tie = |parameter: Parameter| match self.fy_per_fx {
            Some(ratio) if parameter == Parameter::Fx => slope(parameter) + ratio * slope(Parameter::Fy),
            _ => slope(parameter),
        };
        let columns: Vec<Vec2> = self.free.iter().map(with_tie).collect();
        let mut spread = Matrix2::zeros();
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                spread += a * b.transpose() * self.intrinsics[(i, j)];
            }
        }
        let (mean, half) = (0.5 * spread.trace(), 0.5 * (spread[(0, 0)] - spread[(1, 1)]));
        (mean + libm::hypot(half, spread[(0, 1)])).max(0.0).sqrt()
    }

    /// The row of a parameter, and how many times that of the row it is.
    fn row(&self, parameter: Parameter) -> Option<(usize, f64)> {
        match self.fy_per_fx {
            Some(ratio) if parameter == Parameter::Fy => Some((self.free.position(Parameter::Fx)?, ratio)),
            _ => Some((self.free.position(parameter)?, 1.0)),
        }
    }

    /// `e^T P^-1 e` for an error of the free intrinsics: chi-squared with as many degrees of freedom if the
    /// covariance is right (the normalised estimation error squared; Bar-Shalom, Li & Kirubarajan 2001).
    /// `None` if `P` is singular or the error has another length.
    pub fn normalised_error_squared(&self, error: &[f64]) -> Option<f64> {
        if error.len() != self.free.len() {
            return None;
        }
        let e = nalgebra::DVector::from_row_slice(error);
        Some(e.dot(&self.intrinsics.clone().cholesky()?.solve(&e)))
    }
}

/// A covariance as data: every matrix by its rows.
#[cfg(feature = "serde")]
mod data {
    use super::{Covariance, DMatrix, FreeParameters, MatrixXx6, SMatrix};

    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct Rows {
        free: FreeParameters,
        fy_per_fx: Option<f64>,
        intrinsics: Vec<Vec<f64>>,
        poses: Vec<[[f64; 6]; 6]>,
        cross: Vec<Vec<[f64; 6]>>,
    }

    impl From<Covariance> for Rows {
        fn from(covariance: Covariance) -> Rows {
            let Covariance { free, fy_per_fx, intrinsics, poses, cross } = covariance;
            let row_of_six = |row: &dyn Fn(usize) -> f64| std::array::from_fn(row);
            Rows {
                free,
                fy_per_fx,
                intrinsics: intrinsics.row_iter().map(|row| row.iter().copied().collect()).collect(),
                poses: poses.iter().map(|m| std::array::from_fn(|i| row_of_six(&|j| m[(i, j)]))).collect(),
                cross: cross
                    .iter()
                    .map(|m| m.row_iter().map(|row| row_of_six(&|j| row[j])).collect())
                    .collect(),
            }
        }
    }

    impl TryFrom<Rows> for Covariance {
        type Error = String;

        fn try_from(rows: Rows) -> Result<Covariance, String> {
            let n = rows.free.len();
            let fits = |len: usize| len == n;
            let is_whole = fits(rows.intrinsics.len())
                && rows.intrinsics.iter().all(|row| fits(row.len()))
                && rows.cross.iter().all(|block| fits(block.len()))
                && rows.cross.len() == rows.poses.len();
            if !is_whole {
                return Err(format!(
                    "a covariance of {n} parameters and {} poses has blocks of other sizes",
                    rows.poses.len()
                ));
            }
            let from_rows = |block: &[[f64; 6]]| MatrixXx6::from_fn(n, |i, j| block[i][j]);
            Ok(Covariance {
                free: rows.free,
                fy_per_fx: rows.fy_per_fx,
                intrinsics: DMatrix::from_fn(n, n, |i, j| rows.intrinsics[i][j]),
                poses: rows.poses.iter().map(|m| SMatrix::from_fn(|i, j| m[i][j])).collect(),
                cross: rows.cross.iter().map(|block| from_rows(block)).collect(),
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of fx and k1, with deviations 2 and 3 and a correlation of -1/2.
    fn two(fy_per_fx: Option<f64>) -> Covariance {
        let free = FreeParameters::of(&[Parameter::Fx, Parameter::K1]);
        let matrix = DMatrix::from_row_slice(2, 2, &[4.0, -3.0, -3.0, 9.0]);
        Covariance { fy_per_fx, ..Covariance::untied(free, matrix, Vec::new(), Vec::new()) }
    }

    #[test]
    fn a_correlation_is_over_both_deviations_and_1_with_what_is_tied() {
        use Parameter::{Fx, Fy, K1};
        assert_eq!((two(None).correlation(Fx, K1), two(None).correlation(Fx, Fy)), (Some(-0.5), None));
        let tied = two(Some(0.75));
        assert_eq!((tied.correlation(Fx, Fy), tied.correlation(K1, Fy)), (Some(1.0), Some(-0.5)));
    }

    #[test]
    fn the_largest_spread_is_that_of_the_worst_direction() {
        let slopes = [
            (Parameter::Fx, Vec2::new(0.5, 0.1)),
            (Parameter::Fy, Vec2::new(-0.3, 0.8)),
            (Parameter::K1, Vec2::new(0.2, 0.4)),
        ];
        for fy_per_fx in [None, Some(0.75)] {
            let covariance = two(fy_per_fx);
            let fx = slopes[0].1 + fy_per_fx.unwrap_or(0.0) * slopes[1].1;
            // The variance along (cos a, sin a).
            let along = |i: u32| {
                let angle = 1e-4 * f64::from(i);
                let direction = Vec2::new(libm::cos(angle), libm::sin(angle));
                let (a, b) = (direction.dot(&fx), direction.dot(&slopes[2].1));
                4.0 * a * a - 6.0 * a * b + 9.0 * b * b
            };
            let worst = (0..31416).map(along).fold(0.0, f64::max).sqrt();
            let found = covariance.largest_spread(&slopes);
            assert!((found / worst - 1.0).abs() < 1e-8, "{found} {worst}");
        }
    }
}
