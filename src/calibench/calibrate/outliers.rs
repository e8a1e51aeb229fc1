//! Which marks are no noise? An outlier pulls its neighbours along, so it is looked for where it cannot.

use super::estimate::Fit;
use super::minimise::{Problem, State};
use super::{CalibrationError, Loss};
use crate::geometry::Vec2;

/// Noise makes one set in this many look as if it had an outlier, before a robust fit has been asked:
/// `exp(-7)`.
const LOG_LOOK: f64 = 7.0;
/// Of noise the mean square of a squared residual is twice the square of its mean; this many times are none.
const HEAVY: f64 = 4.0;
/// And one in this many after it: `exp(-13)`.
const LOG_OUTLIER: f64 = 13.0;
/// More than this part of the marks are no outliers: the model is wrong.
const MOST: f64 = 0.3;
/// A robust loss with a scale below this part of the median residual, Huber's or Cauchy's, takes noise for
/// outliers: the stated covariance no longer is that of the estimate.
const NARROW_HUBER: f64 = 0.3;
const NARROW_CAUCHY: f64 = 0.5;

/// Marks that lie too far from where they should to be noise.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Outliers {
    /// How many.
    pub marks: usize,
    /// Which part of all marks.
    pub share: f64,
    /// View of the worst.
    pub view: usize,
    /// Its number there.
    pub point: usize,
    /// Its residual, px.
    pub residual_px: f64,
    /// The residual that half of the marks stay below, px.
    pub median_px: f64,
}

/// Refuses a robust loss that is narrower than the noise: its weights, and so the covariance, would mean
/// nothing.
pub(super) fn refuse_narrow_loss(loss: Loss, residuals: &[Vec<Vec2>]) -> Result<(), CalibrationError> {
    let (scale_px, narrow) = match loss {
        Loss::Squares => return Ok(()),
        Loss::Huber { delta_px } => (delta_px, NARROW_HUBER),
        Loss::Cauchy { scale_px } => (scale_px, NARROW_CAUCHY),
    };
    let median_px = median(residuals).sqrt();
    if scale_px < narrow * median_px {
        return Err(CalibrationError::NarrowLoss { scale_px, median_px });
    }
    Ok(())
}
/// Robust fits, each at the scale that the one before found.
const FITS: usize = 3;

/// A refusal for want of information, or for the outliers that hide it if there are any.
pub(super) fn or_blamed<T>(
    problem: &Problem<'_>,
    state: &State,
    outcome: Result<T, CalibrationError>,
) -> Result<T, CalibrationError> {
    let Err(CalibrationError::NotIdentifiable { .. }) = outcome else { return outcome };
    let fit = Fit::of(state, problem.observations);
    match outliers(problem, state, &fit, fit.square / fit.marks() as f64) {
        Some(found) => Err(CalibrationError::Outliers(found)),
        None => outcome,
    }
}

/// The outliers of a least-squares fit with residuals of variance `variance`, if there are a few.
pub(super) fn outliers(problem: &Problem<'_>, state: &State, fit: &Fit, variance: f64) -> Option<Outliers> {
    let is_suspicious = is_suspicious(fit.marks(), fit.largest_square, fit.tails(), variance);
    if problem.loss != Loss::Squares || !is_suspicious {
        return None;
    }
    let mut state = state.clone();
    let unknowns = problem.free.len() + 6 * problem.observations.len();
    named(Fit::of(&state, problem.observations).residuals, unknowns, |loss| {
        state = Problem { loss, ..*problem }.minimise(state.clone()).state;
        Fit::of(&state, problem.observations).residuals
    })
}

/// Those of any fit with these residuals, of so many unknowns: `refit` gives the residuals under another
/// loss, and starts where the fit before ended.
pub(super) fn of_residuals(
    residuals: &[Vec<Vec2>],
    unknowns: usize,
    variance: f64,
    refit: impl FnMut(Loss) -> Vec<Vec<Vec2>>,
) -> Option<Outliers> {
    let squares = || residuals.iter().flatten().map(Vec2::norm_squared);
    let (square, fourth) = squares().fold((0.0, 0.0), |(s, f), square| (s + square, f + square * square));
    let marks = squares().count();
    let tails = fourth * marks as f64 / (square * square);
    is_suspicious(marks, squares().fold(0.0, f64::max), tails, variance)
        .then(|| named(residuals.to_vec(), unknowns, refit))?
}

/// Outliers by name: the fit is repeated with Cauchy's loss at the scale of the median, which outliers do not
/// move.
fn named(
    mut residuals: Vec<Vec<Vec2>>,
    unknowns: usize,
    mut refit: impl FnMut(Loss) -> Vec<Vec<Vec2>>,
) -> Option<Outliers> {
    for _ in 0..FITS {
        let loss = Loss::Cauchy { scale_px: median(&residuals).sqrt() };
        if !loss.is_valid() {
            return None;
        }
        residuals = refit(loss);
    }
    let median = median(&residuals);
    let squares = || residuals.iter().flatten().map(Vec2::norm_squared);
    let all = squares().count();
    let limit = largest_of_noise(all, unknowns)? * median;
    let marks = squares().filter(|&square| square > limit).count();
    if marks == 0 || marks as f64 > (MOST * all as f64).max(1.0) {
        return None;
    }
    let numbered = residuals.iter().enumerate().flat_map(|(view, list)| {
        list.iter().enumerate().map(move |(point, residual)| (view, point, residual.norm()))
    });
    let (view, point, residual_px) = numbered.max_by(|a, b| a.2.total_cmp(&b.2))?;
    let share = marks as f64 / all as f64;
    Some(Outliers { marks, share, view, point, residual_px, median_px: median.sqrt() })
}

/// What hardly any set of noise exceeds, over the median squared residual. A squared residual exceeds `x
/// sigma^2` with probability `exp(-x / 2)`, half of them `2 ln 2 sigma^2`, so that of `N` marks one exceeds
/// `2 (ln N + L) sigma^2` with probability `exp(-L)` at most. A fit of few degrees of freedom follows some
/// marks and leaves others: by how much more is bounded by the square of coordinates over degrees of freedom.
/// `None` where these are fewer than the marks: a robust fit then passes through half of them.
fn largest_of_noise(marks: usize, unknowns: usize) -> Option<f64> {
    let freedom = (2 * marks).checked_sub(unknowns)?;
    let followed = 2.0 * marks as f64 / freedom as f64;
    let largest = 2.0 * (libm::log(marks as f64) + LOG_OUTLIER);
    (freedom >= marks).then(|| largest * followed * followed / (2.0 * std::f64::consts::LN_2))
}

/// Whether some residuals are much larger than the rest: one alone stands out, and many make the tails heavy.
fn is_suspicious(marks: usize, largest_square: f64, tails: f64, variance: f64) -> bool {
    let noise = 2.0 * (libm::log(marks as f64) + LOG_LOOK) * variance;
    largest_square > noise || tails > HEAVY
}

/// The median squared residual.
pub(super) fn median(residuals: &[Vec<Vec2>]) -> f64 {
    let mut squares: Vec<f64> = residuals.iter().flatten().map(Vec2::norm_squared).collect();
    let middle = squares.len() / 2;
    *squares.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::normal::Observations;
    use crate::calibrate::tests::plain_problem;
    use crate::camera::{Camera, FreeParameters};
    use crate::geometry::{Pose, Vec3, rotation};

    #[test]
    fn many_outliers_show_in_the_tails_where_none_of_them_stands_out() {
        let residual = |i: usize| Vec2::new(if i % 10 == 3 { 1.0 + 1e-3 * i as f64 } else { 0.1 }, 0.0);
        let residuals = vec![(0..50).map(residual).collect::<Vec<_>>(), (50..100).map(residual).collect()];
        let variance = residuals.iter().flatten().map(Vec2::norm_squared).sum::<f64>() / 200.0;
        let largest = residuals.iter().flatten().map(Vec2::norm_squared).fold(0.0, f64::max);
        assert!(!is_suspicious(100, largest, 2.0, variance));
        let found = of_residuals(&residuals, 20, variance, |_| residuals.clone()).unwrap();
        assert_eq!((found.marks, found.share, found.view, found.point), (10, 0.1, 1, 43));
        assert!((found.residual_px - 1.093).abs() < 1e-12);
        assert!((found.median_px - 0.1).abs() < 1e-12);
    }

    #[test]
    fn what_noise_hardly_exceeds_grows_with_what_a_fit_follows() {
        // One of 100 exceeds 2 (ln 100 + 13) variances with probability exp(-13), half of all 2 ln 2 of them.
        // Of 200 coordinates 150 are degrees of freedom.
        let expected = (libm::log(100.0) + 13.0) / libm::log(2.0) * (200.0 / 150.0) * (200.0 / 150.0);
        let largest = largest_of_noise(100, 50).unwrap();
        assert!((largest / expected - 1.0).abs() < 1e-12, "{largest}");
        assert_eq!((largest_of_noise(100, 101), largest_of_noise(100, 201)), (None, None));
    }

    #[test]
    fn half_of_the_marks_stay_below_the_median() {
        let residuals = [5.0, 1.0, 3.0, 2.0, 4.0].map(|x| Vec2::new(0.0, x)).to_vec();
        assert_eq!(median(&[residuals]), 9.0);
    }

    #[test]
    fn a_loss_narrower_than_the_noise_is_refused() {
        let residuals = [vec![Vec2::new(0.6, 0.8); 5]];
        for (delta_px, is_refused) in [(0.29, true), (0.31, false)] {
            let refused = refuse_narrow_loss(Loss::Huber { delta_px }, &residuals);
            assert_eq!(refused.is_err(), is_refused);
        }
        for (scale_px, is_refused) in [(0.49, true), (0.51, false)] {
            let refused = refuse_narrow_loss(Loss::Cauchy { scale_px }, &residuals);
            assert_eq!(refused.is_err(), is_refused);
        }
    }

    #[test]
    fn outliers_are_the_same_in_any_unit() {
        let of = |unit: f64| {
            let residual = |i: usize| Vec2::new(if i % 10 == 3 { 12.0 } else { 1.0 } * unit, 0.0);
            let residuals = vec![(0..100).map(residual).collect::<Vec<_>>()];
            // So large a variance that none of them stands out.
            of_residuals(&residuals, 20, 100.0 * unit * unit, |_| residuals.clone()).map(|found| found.marks)
        };
        assert_eq!([1e-3, 1.0, 1e3].map(of), [Some(10); 3]);
    }

    #[test]
    fn a_fit_that_follows_half_of_its_marks_names_no_outlier() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let poses =
            [[0.4, 0.0, 0.0], [0.0, -0.4, 0.2], [-0.3, 0.3, 1.0], [0.3, 0.3, 2.0]].map(|[x, y, z]| Pose {
                rotation: rotation::from_xyz_rad(x, y, z),
                translation: Vec3::new(0.0, 0.0, 120.0),
            });
        let seen = |pose: &Pose, marks: u32, off: f64| {
            let pair = |i: u32| {
                let point = Vec2::new(f64::from(i % 4) - 1.5, f64::from(i / 4) - 1.0) * 15.0;
                let noise = 0.1 * Vec2::new(libm::sin(7.0 * f64::from(i)), libm::cos(5.0 * f64::from(i)));
                let off = if i == 4 { Vec2::new(off, 0.0) } else { Vec2::zeros() };
                (point, camera.project(&pose.apply(&Vec3::new(point.x, point.y, 0.0))).unwrap() + noise + off)
            };
            Observations::new((0..marks).map(pair).collect::<Vec<_>>().into_iter())
        };
        // Seven and twelve marks in each of four views: 26 and 66 degrees of freedom of 28 and 48 marks.
        let found = [7, 12].map(|marks| {
            let views = [0.0, 0.0, 30.0, 0.0].into_iter().zip(&poses);
            let observations: Vec<Observations> = views.map(|(off, pose)| seen(pose, marks, off)).collect();
            let problem = plain_problem(&observations, FreeParameters::STANDARD);
            let state = State { camera, cam_from_target: poses.to_vec() };
            let fit = Fit::of(&state, &observations);
            outliers(&problem, &state, &fit, 0.01).map(|found| (found.view, found.point))
        });
        assert_eq!(found, [None, Some((2, 4))]);
    }
}
