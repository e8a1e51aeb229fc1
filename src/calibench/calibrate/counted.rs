//! What counts of each mark where fits are compared? All of it under least squares; under a robust loss what
//! could be noise.
//!
//! A sum of squares over all marks is that of the strays, which the loss keeps out of the cameras, and a lens
//! with coefficients to spare bends to one of them. So a mark counts with what noise comes to at the most,
//! which one stray cannot buy many coefficients with, and one that is a stray to every fit counts nowhere.
//! Which marks count is the same for all fits.

use super::{LensCalibration, Loss, strays};
use crate::board::View;
use crate::geometry::Vec2;

/// What counts of the marks of some views.
pub(super) struct Counted {
    /// The largest squared, weighted residual that counts in whole.
    limit: f64,
    /// Of each view's marks, those that no fit explains.
    is_stray: Vec<Vec<bool>>,
}

impl Counted {
    /// In fits to the same views with the same loss.
    pub fn of<'a>(
        views: &[View],
        fits: impl Iterator<Item = &'a LensCalibration> + Clone,
        loss: Loss,
    ) -> Counted {
        let mut is_stray: Vec<Vec<bool>> =
            views.iter().map(|view| vec![loss != Loss::Squares; view.len()]).collect();
        if loss == Loss::Squares {
            return Counted { limit: f64::INFINITY, is_stray };
        }
        let weighted: Vec<_> = fits.map(|fit| weighted_residuals(views, fit)).collect();
        let limit = weighted.iter().map(|fit| strays::limit(fit, loss)).fold(f64::INFINITY, f64::min);
        for fit in &weighted {
            for (strays, residuals) in is_stray.iter_mut().zip(fit) {
                for (is_stray, residual) in strays.iter_mut().zip(residuals) {
                    *is_stray &= residual.norm_squared() > limit;
                }
            }
        }
        Counted { limit, is_stray }
    }

    /// Sum of what counts of the residuals of view `place`, weighted, px^2, and of how many marks.
    pub fn in_view(&self, place: usize, view: &View, residuals: &[Vec2]) -> (f64, usize) {
        let all = weighted(view, residuals).zip(&self.is_stray[place]);
        let counting = all.filter(|(_, is_stray)| !**is_stray);
        counting.fold((0.0, 0), |(square, marks), (residual, _)| {
            (square + residual.norm_squared().min(self.limit), marks + 1)
        })
    }

    /// The same of all views of a fit.
    pub fn in_fit(&self, views: &[View], fit: &LensCalibration) -> (f64, usize) {
        if self.limit == f64::INFINITY {
            return (fit.rmse_px * fit.rmse_px * fit.points() as f64, fit.points());
        }
        let listed = views.iter().zip(&fit.residuals).enumerate();
        let of_views = listed.map(|(place, (view, residuals))| self.in_view(place, view, residuals));
        of_views.fold((0.0, 0), |(square, marks), (s, m)| (square + s, marks + m))
    }

    /// RMSE of the marks of a fit that count, px a point.
    pub fn rmse_px(&self, views: &[View], fit: &LensCalibration) -> f64 {
        if self.limit == f64::INFINITY {
            return fit.rmse_px;
        }
        let (square, marks) = self.in_fit(views, fit);
        (square / marks as f64).sqrt()
    }
}

/// The residuals of a fit times the weights of their marks.
pub(super) fn weighted_residuals(views: &[View], fit: &LensCalibration) -> Vec<Vec<Vec2>> {
    views.iter().zip(&fit.residuals).map(|(view, list)| weighted(view, list).collect()).collect()
}

/// Residuals times the weights of their marks.
fn weighted<'a>(view: &'a View, residuals: &'a [Vec2]) -> impl Iterator<Item = Vec2> + 'a {
    let weights = view.weights();
    residuals
        .iter()
        .enumerate()
        .map(move |(mark, residual)| residual * weights.map_or(1.0, |list| list[mark]))
}
