//! From marks to a camera with a lens of any model and its uncertainty.

use super::super::minimise::{Descent, Minimum, RELATIVE_GAIN, descend};
use super::super::noise::Noise;
use super::super::settings::Bend;
use super::super::system::Step;
use super::super::target_frame::TargetFrames;
use super::super::{CalibrationError, LensCalibration, Prior, Settings, Termination, chunks, domain};
use super::problem::{Problem, State, rounding_cost};
use super::{WIDTH, certificate, judge, marks, report, shape, start, walk};
use crate::board::View;
use crate::camera::{FreeParameters, Parameter};

/// Where nothing else tells the noise of a coordinate, priors are first weighed with this one, px.
const USUAL_PX: f64 = 0.1;
/// Nobody's marks are better than this, px: exact data would otherwise leave priors no weight at all.
const LEAST_PX: f64 = 1e-4;
/// The noise that weighs priors is settled when it changes by less than this part.
const SETTLED: f64 = 2e-6;
/// Steps that sharpen a minimum.
const LAST_STEPS: usize = 2;
/// A cost that rises by less than this part has not risen.
const NO_RISE: f64 = 1e-12;
/// Refinements until that noise is settled.
const MOST_REFITS: usize = 60;

/// What [`super::super::calibrate_lens`] does with other lenses than Brown-Conrady's, marks of unequal
/// weight, and boards that need not be flat.
///
/// # Errors
/// As there.
pub(in super::super) fn calibrate(
    views: &[View],
    settings: &Settings,
) -> Result<LensCalibration, CalibrationError> {
    check(views, settings)?;
    chunks::in_pool(views.len(), || estimate(views, settings))
}

fn check(views: &[View], settings: &Settings) -> Result<(), CalibrationError> {
    use Parameter::{Cx, Cy, Fx, Fy, Skew};
    domain::check(settings)?;
    let only_plain = [
        (settings.polish, "the last digits of a minimum"),
        (settings.start.is_some(), "a start for the intrinsics"),
    ];
    if let Some((_, what)) = only_plain.into_iter().find(|(asked, _)| *asked) {
        return Err(CalibrationError::OfBrownConrady { what: what.into() });
    }
    if let Some(Bend { standard_deviation, .. }) = settings.board.bend()
        && (standard_deviation.is_nan() || standard_deviation <= 0.0)
    {
        return Err(CalibrationError::BadBoard { standard_deviation });
    }
    let free = settings.free();
    let is_known = |p| settings.priors().any(|prior| prior.parameter == p);
    let linear = [Fx, Fy, Cx, Cy, Skew].into_iter().filter(|&p| free.contains(p) && !is_known(p)).count();
    // A distortion tells its centre and the aspect ratio besides.
    let need = linear.div_ceil(2).clamp(1, 2);
    if views.len() < need {
        return Err(CalibrationError::TooFewViews { need, got: views.len(), linear, copies: 0 });
    }
    let coordinates = 2 * views.iter().map(View::len).sum::<usize>();
    let unknowns = free.len() - settings.priors().count() + 6 * views.len();
    if coordinates < unknowns {
        return Err(CalibrationError::TooFewPoints { coordinates, unknowns });
    }
    views.iter().enumerate().try_for_each(|(view, marks)| {
        domain::spans_a_plane(marks).map_err(|source| CalibrationError::View { view, source })
    })
}

fn estimate(views: &[View], settings: &Settings) -> Result<LensCalibration, CalibrationError> {
    let frames = TargetFrames::of(views);
    let region = shape::region(views);
    let marks = marks::of_views(views, &frames, &region);
    let priors: Vec<Prior> = settings.priors().collect();
    let flat = Problem {
        views: &marks,
        free: settings.free(),
        held: FreeParameters::NONE,
        fy_per_fx: settings.tie()?,
        priors: &priors,
        noise: Noise::of_squares(USUAL_PX * USUAL_PX),
        bend: None,
        loss: settings.loss,
        max_iterations: settings.max_iterations,
        relative_gain: RELATIVE_GAIN,
        rounding_cost: rounding_cost(&marks),
        is_certifiable: certificate::counts_for(settings.model()),
    };
    let mut walked = walk::walk(&flat, views, settings)?;
    let state = start::with_better_tilts(&flat, walked.best.state.clone());
    let is_turned = state.cam_from_target != walked.best.state.cam_from_target;
    if is_turned && settings.board.bend().is_none() {
        walked.others.push(walked.best.clone());
    }
    walked.best.state = state;
    let bent = Problem { bend: settings.board.bend(), ..flat };
    // A search that has not ended may do so in as many iterations again, and in the valley of a lens of many
    // coefficients one that has may still go on.
    let has_ended = walked.best.termination == Termination::Converged && bent.is_certifiable;
    if bent.bend.is_some() {
        walked = walk::walked_anew(walked, &bent);
    } else if is_turned || !has_ended {
        walk::follow(&bent, &mut walked.best);
    }
    let (problem, minimum) = settled(bent, walked.best);
    let found = minimum.clone();
    let others = walked.others.iter().map(|other| walk::weighed_anew(other, &bent, &problem));
    let met = others.chain([walk::met(&minimum)]).collect();
    let calibration = judge::judge(&problem, minimum, met)
        .and_then(|judged| report::report(judged, &problem, &frames, region, settings));
    report::or_blamed(&problem, &found, calibration)
}

/// The minimum at which the noise that weighs what is known beforehand is the noise that the residuals show,
/// from one with any noise.
fn settled(
    mut problem: Problem<'_>,
    mut minimum: Minimum<State, WIDTH>,
) -> (Problem<'_>, Minimum<State, WIDTH>) {
    let is_told = !problem.priors.is_empty() || problem.bend.is_some();
    let mut iterations = minimum.iterations;
    for _ in 0..MOST_REFITS {
        let noise = report::noise(&problem, &minimum).at_least(LEAST_PX * LEAST_PX);
        let agree = |next: f64, last: f64| (next - last).abs() <= SETTLED * next;
        let is_settled =
            agree(noise.variance, problem.noise.variance) && agree(noise.rise, problem.noise.rise);
        if !is_told || is_settled || minimum.termination != Termination::Converged {
            break;
        }
        problem.noise = noise;
        minimum = descend(&problem, minimum.state);
        iterations += minimum.iterations;
    }
    minimum.iterations = iterations;
    if minimum.termination == Termination::Converged {
        sharpen(&problem, &mut minimum);
    }
    (problem, minimum)
}

/// Takes a minimum a few undamped Gauss-Newton steps further: they give digits of the parameters that the sum
/// of squares does not show, and that damping hides where a combination of them is hardly known.
fn sharpen(problem: &Problem<'_>, minimum: &mut Minimum<State, WIDTH>) {
    let mut system = problem.system();
    let mut step = Step::default();
    problem.linearise_into(&minimum.state, &mut system);
    for _ in 0..LAST_STEPS {
        if system.solve_into(0.0, &mut step).is_none() {
            return;
        }
        let mut next = minimum.state.clone();
        problem.step(&minimum.state, &step, &mut next);
        let cost = system.cost;
        problem.linearise_into(&next, &mut system);
        if system.cost.is_nan() || system.cost > (1.0 + NO_RISE) * cost {
            return;
        }
        minimum.state = next;
        minimum.system.clone_from(&system);
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;
    use crate::camera::Model;

    #[test]
    fn every_view_and_parameter_must_be_paid_for() {
        let settings = Settings::of_model(Model::KannalaBrandt);
        let few = |views: usize, marks: usize| -> Vec<View> {
            let corners = [0, 6, 28, 34, 17];
            let of = |view: &View| {
                let (points, pixels) =
                    corners.into_iter().take(marks).map(|i| (view.points()[i], view.pixels()[i])).unzip();
                View::new(points, pixels).unwrap()
            };
            fixture::exact_views()[..views].iter().map(of).collect()
        };
        // Of eight parameters four are linear; a view has two equations for them.
        let one = CalibrationError::TooFewViews { need: 2, got: 1, linear: 4, copies: 0 };
        assert_eq!(check(&few(1, 5), &settings), Err(one));
        let known = settings.clone().with_prior(Parameter::Cx, 320.0, 1.0);
        let three = CalibrationError::TooFewViews { need: 2, got: 1, linear: 3, copies: 0 };
        assert_eq!(check(&few(1, 5), &known), Err(three));
        // Eight parameters and twice six numbers of a pose.
        let points = CalibrationError::TooFewPoints { coordinates: 16, unknowns: 20 };
        assert_eq!(check(&few(2, 4), &settings), Err(points));
        assert_eq!(check(&few(2, 5), &settings), Ok(()));
    }
}
