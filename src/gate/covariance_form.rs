//! Can a stated covariance be one? Symmetric, positive definite, and of the standard deviations and names
//! that stand beside it.

use nalgebra::DMatrix;

/// Entries and their mirror images, and standard deviations stated twice, differ by less than this part in
/// single precision and rounded text.
const ROUNDED: f64 = 1e-3;

/// Why a matrix is no covariance of the parameters it names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CovarianceFault {
    /// Entries differ from their mirror images.
    #[error("not symmetric")]
    Asymmetric,
    /// Some combination of parameters has no positive variance.
    #[error("not positive definite")]
    NotPositiveDefinite,
    /// The diagonal has the standard deviations' squares in another order.
    #[error(
        "in another order than its names: its diagonal has the squares of the standard deviations, exchanged"
    )]
    OtherOrder,
    /// The diagonal is not the squares of the standard deviations.
    #[error("of other standard deviations than those stated beside it")]
    OtherDeviations,
}

/// What is wrong with a covariance, if anything; `deviations` are those stated apart from it.
pub fn fault(covariance: &DMatrix<f64>, deviations: Option<&[f64]>) -> Option<CovarianceFault> {
    let sd: Vec<f64> = covariance.diagonal().iter().map(|v| v.sqrt()).collect();
    if sd.iter().any(|sd| sd.is_nan() || *sd <= 0.0) {
        return Some(CovarianceFault::NotPositiveDefinite);
    }
    let correlations = DMatrix::from_fn(sd.len(), sd.len(), |i, j| covariance[(i, j)] / (sd[i] * sd[j]));
    if (&correlations - correlations.transpose()).amax() > ROUNDED {
        return Some(CovarianceFault::Asymmetric);
    }
    if correlations.cholesky().is_none() {
        return Some(CovarianceFault::NotPositiveDefinite);
    }
    let agree = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= ROUNDED * b);
    let stated = deviations?;
    if agree(stated, &sd) {
        return None;
    }
    let sorted = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values
    };
    let is_exchanged = agree(&sorted(stated), &sorted(&sd));
    Some(if is_exchanged { CovarianceFault::OtherOrder } else { CovarianceFault::OtherDeviations })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_told_from_the_others() {
        let of = |entries: [f64; 4], sd: Option<&[f64]>| fault(&DMatrix::from_row_slice(2, 2, &entries), sd);
        let good = [4.0, 1.0, 1.0, 9.0];
        assert_eq!(of(good, None), None);
        assert_eq!(of(good, Some(&[2.0, 3.0])), None);
        assert_eq!(of(good, Some(&[3.0, 2.0])), Some(CovarianceFault::OtherOrder));
        assert_eq!(of(good, Some(&[2.0, 2.9])), Some(CovarianceFault::OtherDeviations));
        assert_eq!(of([4.0, 1.0, 0.0, 9.0], None), Some(CovarianceFault::Asymmetric));
        assert_eq!(of([4.0, 6.1, 6.1, 9.0], None), Some(CovarianceFault::NotPositiveDefinite));
        assert_eq!(of([4.0, 0.0, 0.0, -9.0], None), Some(CovarianceFault::NotPositiveDefinite));
    }

    #[test]
    fn a_covariance_is_judged_alike_in_every_unit() {
        for unit in [1e-6, 1.0, 1e6] {
            let of = |entries: [f64; 4], sd: [f64; 2]| {
                fault(
                    &(DMatrix::from_row_slice(2, 2, &entries) * (unit * unit)),
                    Some(&sd.map(|sd| sd * unit)),
                )
            };
            assert_eq!(of([4.0, 1.0, 1.0005, 9.0], [2.0, 3.0]), None);
            assert_eq!(of([4.0, 1.0, 1.1, 9.0], [2.0, 3.0]), Some(CovarianceFault::Asymmetric));
            assert_eq!(of([4.0, 1.0, 1.0, 9.0], [2.0, 3.1]), Some(CovarianceFault::OtherDeviations));
        }
    }
}
