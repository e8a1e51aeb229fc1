//! Which marks are strays under a robust loss, where fits are judged by their residuals?
//!
//! The loss keeps strays out of the camera, but a sum of squares over all marks is theirs. A squared residual
//! of noise exceeds `x sigma^2` with probability `exp(-x / 2)`, and half of them `2 ln 2 sigma^2`: what
//! exceeds 25 variances, as their median tells them, is noise once in 270 000.

use super::Loss;
use super::outliers::median;
use crate::geometry::Vec2;
use std::borrow::Cow;

/// The largest squared residual of noise over the median.
const LARGEST: f64 = 25.0 / (2.0 * std::f64::consts::LN_2);

/// The squared residual beyond which a mark is a stray; infinite under least squares, which knows none, and
/// without noise.
pub(super) fn limit(residuals: &[Vec<Vec2>], loss: Loss) -> f64 {
    if loss == Loss::Squares || residuals.iter().all(Vec::is_empty) {
        return f64::INFINITY;
    }
    let limit = LARGEST * median(residuals);
    if limit > 0.0 { limit } else { f64::INFINITY }
}

/// The residuals, those of strays 0.
pub(super) fn at_zero(residuals: &[Vec<Vec2>], loss: Loss) -> Cow<'_, [Vec<Vec2>]> {
    let limit = limit(residuals, loss);
    if limit == f64::INFINITY {
        return Cow::Borrowed(residuals);
    }
    let kept = |r: &Vec2| if r.norm_squared() <= limit { *r } else { Vec2::zeros() };
    Cow::Owned(residuals.iter().map(|view| view.iter().map(kept).collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stray_is_told_by_the_median_under_a_robust_loss_alone() {
        let mut residuals = vec![vec![Vec2::new(0.3, 0.4); 9]];
        residuals[0][4] = Vec2::new(2.0, 1.0);
        assert_eq!(at_zero(&residuals, Loss::Squares), residuals);
        let huber = Loss::Huber { delta_px: 0.5 };
        // 25 / (2 ln 2) times 0.25 is 4.51, and the stray's square 5.
        assert!((limit(&residuals, huber) - 4.508_422_002_778).abs() < 1e-9);
        let without = at_zero(&residuals, huber);
        assert_eq!((without[0][3], without[0][4]), (Vec2::new(0.3, 0.4), Vec2::zeros()));
        residuals[0].fill(Vec2::zeros());
        assert_eq!(limit(&residuals, huber), f64::INFINITY);
        assert_eq!(limit(&[], huber), f64::INFINITY);
    }
}
