//! Along which combinations of parameters is a covariance looked at? Along those that the bound knows best
//! and worst.
//!
//! Variances of single parameters say nothing of their correlations. With `D` the standard deviations of the
//! bound `P` and `D^-1 P D^-1 = V L V^T`, the combinations `w_i^T x`, `w_i = D^-1 v_i / sqrt(l_i)`, are
//! uncorrelated and of variance 1 under the bound: a stated covariance `S` is as large as the bound along
//! every one if `w_i^T S w_i = 1`. A correlation of 0.996 that is left out makes that 250.

use calibench::camera::{FreeParameters, Parameter};
use nalgebra::{DMatrix, DVector, Matrix6, SymmetricEigen};

/// Components below this part of the largest are left out of the name.
const NAMED: f64 = 0.5;

/// Names of what a pose covariance is of.
pub const OF_POSE: [&str; 6] = ["rx", "ry", "rz", "tx", "ty", "tz"];

/// The uncorrelated combinations of parameters under a covariance, the best known first.
#[derive(Debug, Clone)]
pub struct Principal {
    directions: Vec<Direction>,
}

#[derive(Debug, Clone)]
struct Direction {
    name: String,
    weights: DVector<f64>,
}

impl Principal {
    /// Those of the parameters `free`, whose covariance is positive definite.
    pub fn of(covariance: &DMatrix<f64>, free: FreeParameters) -> Principal {
        Principal::named(covariance, &free.iter().map(Parameter::name).collect::<Vec<_>>())
    }

    /// Those of a pose: rotation about x, y, z, then translation along them.
    pub fn of_pose(covariance: &Matrix6<f64>) -> Principal {
        Principal::named(&DMatrix::from_fn(6, 6, |i, j| covariance[(i, j)]), &OF_POSE)
    }

    fn named(covariance: &DMatrix<f64>, names: &[&'static str]) -> Principal {
        let sd = covariance.diagonal().map(f64::sqrt);
        let n = sd.len();
        let correlations = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (sd[i] * sd[j]));
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(correlations);
        let direction = |i: usize| {
            let v = eigenvectors.column(i);
            Direction {
                name: name(&v.into_owned(), names),
                weights: v.component_div(&sd) / eigenvalues[i].sqrt(),
            }
        };
        let mut best_known_first: Vec<usize> = (0..n).collect();
        best_known_first.sort_by(|&a, &b| eigenvalues[a].total_cmp(&eigenvalues[b]));
        Principal { directions: best_known_first.into_iter().map(direction).collect() }
    }

    /// `w_i^T S w_i` for a covariance of the same parameters.
    pub fn variances(&self, covariance: &DMatrix<f64>) -> Vec<f64> {
        self.directions.iter().map(|d| d.weights.dot(&(covariance * &d.weights))).collect()
    }

    /// What a combination consists of, in standard deviations: `fx - fy`.
    pub fn name(&self, i: usize) -> &str {
        &self.directions[i].name
    }
}

fn name(v: &DVector<f64>, names: &[&'static str]) -> String {
    let largest = v.amax();
    let mut parts: Vec<(f64, &str)> =
        v.iter().copied().zip(names.iter().copied()).filter(|(x, _)| x.abs() >= NAMED * largest).collect();
    // Of a direction and its opposite the one whose first part is positive.
    if parts.first().is_some_and(|(x, _)| *x < 0.0) {
        parts.iter_mut().for_each(|(x, _)| *x = -*x);
    }
    let mut text = String::new();
    for (i, (x, part)) in parts.into_iter().enumerate() {
        text.push_str(if i == 0 {
            ""
        } else if x < 0.0 {
            " - "
        } else {
            " + "
        });
        text.push_str(part);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_correlation_shows_along_the_difference() {
        let free = FreeParameters::of(&[Parameter::Fx, Parameter::Fy]);
        let bound = DMatrix::from_row_slice(2, 2, &[4.0, 5.97, 5.97, 9.0]);
        let principal = Principal::of(&bound, free);
        let one = principal.variances(&bound);
        assert!(one.iter().all(|v| (v - 1.0).abs() < 1e-10), "{one:?}");
        let lost = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 9.0]);
        let largest = (0..2)
            .max_by(|&i, &j| principal.variances(&lost)[i].total_cmp(&principal.variances(&lost)[j]))
            .unwrap();
        // The correlation is 5.97 / 6; along the difference of the standardised parameters the bound is 1
        // less that.
        assert!((principal.variances(&lost)[largest] * (1.0 - 5.97 / 6.0) - 1.0).abs() < 1e-9);
        assert_eq!(principal.name(largest), "fx - fy");
    }
}
