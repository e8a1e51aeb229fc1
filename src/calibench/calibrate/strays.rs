//! Which marks are no noise? A stray pulls its neighbours along, so it is looked for where it cannot.

use super::estimate::Fit;
use super::minimise::{Problem, State};
use super::{CalibrationError, Loss, Warning};

/// A squared residual above this many variances is worth a look: in 250 marks of noise one set in a hundred has one.
const LARGE: f64 = 20.0;
/// Of noise the mean square of a squared residual is twice the square of its mean; this many times are none.
const HEAVY: f64 = 4.0;
/// Of noise, one squared residual in 10^8 exceeds the median by this factor: `36 sigma^2` over `2 ln 2 sigma^2`.
const STRAY: f64 = 26.0;
/// More than this part of the marks are no strays: the model is wrong.
const MOST: f64 = 0.3;
/// A robust loss with a scale below this part of the median residual takes noise for strays.
const NARROW: f64 = 0.1;

/// Gross errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Strays {
    marks: usize,
    /// Part of all marks.
    share: f64,
    view: usize,
    point: usize,
    residual_px: f64,
    median_px: f64,
}

impl From<Strays> for Warning {
    fn from(Strays { marks, share, view, point, residual_px, median_px }: Strays) -> Warning {
        Warning::Outliers { marks, share, view, point, residual_px, median_px }
    }
}

impl From<Strays> for CalibrationError {
    fn from(Strays { marks, view, point, residual_px, median_px, .. }: Strays) -> CalibrationError {
        CalibrationError::Strays { marks, view, point, residual_px, median_px }
    }
}

/// Refuses a robust loss that is narrower than the noise: its weights, and so the covariance, would mean nothing.
pub(super) fn refuse_narrow_loss(loss: Loss, fit: &Fit) -> Result<(), CalibrationError> {
    let scale_px = match loss {
        Loss::Squares => return Ok(()),
        Loss::Huber { delta_px: scale } | Loss::Cauchy { scale_px: scale } => scale,
    };
    let median_px = median(fit).sqrt();
    if scale_px < NARROW * median_px {
        return Err(CalibrationError::NarrowLoss { scale_px, median_px });
    }
    Ok(())
}
/// Robust fits, each at the scale that the one before found.
const FITS: usize = 3;

/// A refusal for want of information, or for the strays that hide it if there are any.
pub(super) fn or_blamed<T>(
    problem: &Problem<'_>,
    state: &State,
    outcome: Result<T, CalibrationError>,
) -> Result<T, CalibrationError> {
    let Err(CalibrationError::NotIdentifiable { .. }) = outcome else { return outcome };
    let fit = Fit::of(state, problem.observations);
    let mean = fit.squares().sum::<f64>() / fit.squares().count() as f64;
    match strays(problem, state, &fit, mean) {
        Some(found) => Err(found.into()),
        None => outcome,
    }
}

/// The strays of a least-squares fit with residuals of variance `variance`, if there are a few: the fit is repeated with Cauchy's loss at the
/// scale of the median, which strays do not move.
pub(super) fn strays(problem: &Problem<'_>, state: &State, fit: &Fit, variance: f64) -> Option<Strays> {
    if problem.loss != Loss::Squares || !is_suspicious(fit, variance) {
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
    if marks == 0 || marks as f64 > (MOST * fit.squares().count() as f64).max(1.0) {
        return None;
    }
    let numbered = fit.residuals.iter().enumerate().flat_map(|(view, list)| {
        list.iter().enumerate().map(move |(point, residual)| (view, point, residual.norm()))
    });
    let (view, point, residual_px) = numbered.max_by(|a, b| a.2.total_cmp(&b.2))?;
    let share = marks as f64 / fit.squares().count() as f64;
    Some(Strays { marks, share, view, point, residual_px, median_px: median.sqrt() })
}

/// Whether some residuals are much larger than the rest: one alone stands out, and many make the tails heavy.
fn is_suspicious(fit: &Fit, variance: f64) -> bool {
    let (mut count, mut sum, mut sum_of_squares) = (0.0, 0.0, 0.0);
    let mut stands_out = false;
    for square in fit.squares() {
        count += 1.0;
        sum += square;
        sum_of_squares += square * square;
        stands_out |= square > LARGE * variance;
    }
    stands_out || sum_of_squares * count > HEAVY * sum * sum
}

/// The median squared residual.
fn median(fit: &Fit) -> f64 {
    let mut squares: Vec<f64> = fit.squares().collect();
    let middle = squares.len() / 2;
    *squares.select_nth_unstable_by(middle, f64::total_cmp).1
}
