//! Which marks are no noise? A stray pulls its neighbours along, so it is looked for where it cannot.

use super::estimate::Fit;
use super::minimise::{Problem, State};
use super::{Loss, Warning};

/// A squared residual above this many variances is worth a look: in 250 marks of noise one set in a hundred has one.
const LARGE: f64 = 20.0;
/// Of noise, one squared residual in 10^8 exceeds the median by this factor: `36 sigma^2` over `2 ln 2 sigma^2`.
const STRAY: f64 = 26.0;
/// More than this part of the marks are no strays: the model is wrong.
const FEW: f64 = 0.1;
/// Robust fits, each at the scale that the one before found.
const FITS: usize = 3;

/// The strays of a least-squares fit with residuals of variance `variance`, if there are a few: the fit is repeated with Cauchy's loss at the
/// scale of the median, which strays do not move.
pub(super) fn strays(problem: &Problem<'_>, state: &State, fit: &Fit, variance: f64) -> Option<Warning> {
    let is_large = |square: f64| square > LARGE * variance;
    if problem.loss != Loss::Squares || !fit.squares().any(is_large) {
        return None;
    }
    let mut state = state.clone();
    let mut fit = Fit::of(&state, problem.observations);
    for _ in 0..FITS {
        let scale = median(&fit).sqrt();
        let robust = Problem { loss: Loss::Cauchy { scale_px: scale }, ..*problem };
        if !robust.loss.is_valid() {
            return None;
        }
        state = robust.minimise(state).state;
        fit = Fit::of(&state, problem.observations);
    }
    let median = median(&fit);
    let marks = fit.squares().filter(|&square| square > STRAY * median).count();
    if marks == 0 || marks as f64 > (FEW * fit.squares().count() as f64).max(1.0) {
        return None;
    }
    let numbered = fit.residuals.iter().enumerate().flat_map(|(view, list)| {
        list.iter().enumerate().map(move |(point, residual)| (view, point, residual.norm()))
    });
    let (view, point, residual_px) = numbered.max_by(|a, b| a.2.total_cmp(&b.2))?;
    Some(Warning::Outliers { marks, view, point, residual_px, median_px: median.sqrt() })
}

/// The median squared residual.
fn median(fit: &Fit) -> f64 {
    let mut squares: Vec<f64> = fit.squares().collect();
    let middle = squares.len() / 2;
    *squares.select_nth_unstable_by(middle, f64::total_cmp).1
}
