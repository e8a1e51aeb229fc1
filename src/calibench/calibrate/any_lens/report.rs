//! What does a calibration with a lens of any model say? The minimum as a [`LensCalibration`].

use super::super::conditioning::Conditioning;
use super::super::estimate::whole;
use super::super::intervals::Profile;
use super::super::minimise::{Minimum, descend};
use super::super::noise::Noise;
use super::super::outliers::{self, Outliers};
use super::super::target_frame::TargetFrames;
use super::super::{
    CalibrationError, LensCalibration, Loss, Settings, Warning, identifiability, structure, warnings,
};
use super::judge::Judged;
use super::marks::{Mark, Marks};
use super::problem::{Problem, ROUGH_GAIN, State};
use super::{BoardShape, WIDTH, focal};
use crate::camera::Parameter;
use crate::geometry::{Pose, Vec2};

/// Residuals of a state.
struct Residuals {
    /// Predicted - observed, px.
    plain: Vec<Vec<Vec2>>,
    /// Times the marks' weights.
    weighted: Vec<Vec<Vec2>>,
    /// Sum of the weighted squares.
    square: f64,
    marks: usize,
}

impl Residuals {
    fn of(problem: &Problem<'_>, state: &State) -> Residuals {
        let mut all = Residuals { plain: Vec::new(), weighted: Vec::new(), square: 0.0, marks: 0 };
        for (view, marks) in problem.views.iter().enumerate() {
            let residual = |mark| match state.pixel(view, mark) {
                Some(pixel) => pixel - mark.pixel,
                None => Vec2::repeat(f64::INFINITY),
            };
            let plain: Vec<Vec2> = marks.list.iter().map(residual).collect();
            let weighted: Vec<Vec2> =
                plain.iter().zip(&marks.list).map(|(r, mark)| r * mark.weight).collect();
            all.square += weighted.iter().map(Vec2::norm_squared).sum::<f64>();
            all.marks += marks.len();
            all.plain.push(plain);
            all.weighted.push(weighted);
        }
        all
    }

    /// Degrees of freedom; `settled` unknowns are known from elsewhere.
    fn freedom(&self, minimum: &Minimum<State, WIDTH>, settled: f64) -> f64 {
        2.0 * self.marks as f64 + settled - minimum.system.unknowns() as f64
    }
}

/// The largest angle from the axis at which a mark is seen, rad.
fn largest_angle(problem: &Problem<'_>, state: &State) -> f64 {
    let of_view = |(marks, pose): (&Marks, &Pose)| {
        let angle = |mark: &Mark| {
            let point = pose.apply(&mark.on_board(&state.shape));
            libm::atan2(point.xy().norm(), point.z)
        };
        marks.list.iter().map(angle).fold(0.0, f64::max)
    };
    problem.views.iter().zip(&state.cam_from_target).map(of_view).fold(0.0, f64::max)
}

/// The noise of a coordinate of weight 1 that the residuals of a minimum show.
pub(super) fn noise(problem: &Problem<'_>, minimum: &Minimum<State, WIDTH>) -> Noise {
    let residuals = Residuals::of(problem, &minimum.state);
    let freedom = residuals.freedom(minimum, problem.settled(&minimum.system)).max(1.0);
    Noise::of_residuals(&residuals.weighted, residuals.square, problem.loss, freedom)
}

/// Whether the residuals of a state may be more than noise.
pub(super) fn may_have_structure(problem: &Problem<'_>, state: &State) -> bool {
    let residuals = Residuals::of(problem, state);
    residuals.square > problem.rounding_cost
        && structure::neighbours(&residuals.weighted, problem.loss).may_agree()
}

/// Gross errors among the marks of a minimum of least squares.
fn outliers(
    problem: &Problem<'_>,
    minimum: &Minimum<State, WIDTH>,
    residuals: &Residuals,
    freedom: f64,
) -> Option<Outliers> {
    if problem.loss != Loss::Squares {
        return None;
    }
    let mut state = minimum.state.clone();
    let variance = residuals.square / freedom.max(1.0);
    outliers::of_residuals(&residuals.weighted, minimum.system.unknowns(), variance, |loss| {
        state = descend(&Problem { loss, relative_gain: ROUGH_GAIN, ..*problem }, state.clone()).state;
        Residuals::of(problem, &state).weighted
    })
}

/// A refusal for want of information, or for the outliers that hide it if there are any.
pub(super) fn or_blamed<T>(
    problem: &Problem<'_>,
    minimum: &Minimum<State, WIDTH>,
    outcome: Result<T, CalibrationError>,
) -> Result<T, CalibrationError> {
    let Err(CalibrationError::NotIdentifiable { .. }) = outcome else { return outcome };
    let residuals = Residuals::of(problem, &minimum.state);
    let freedom = residuals.freedom(minimum, 0.0);
    match outliers(problem, minimum, &residuals, freedom) {
        Some(found) => Err(CalibrationError::Outliers(found)),
        None => outcome,
    }
}

/// The result at a minimum.
///
/// # Errors
/// Normal equations that are singular.
pub(super) fn report(
    judged: Judged,
    problem: &Problem<'_>,
    frames: &TargetFrames,
    region: [Vec2; 2],
    settings: &Settings,
) -> Result<LensCalibration, CalibrationError> {
    let Judged { minimum, reduction, noise, starts, skewed, rivals } = judged;
    let Minimum { state, system, termination, iterations } = &minimum;
    let residuals = Residuals::of(problem, state);
    let freedom = residuals.freedom(&minimum, problem.settled(system));
    let degrees_of_freedom = whole(freedom);
    outliers::refuse_narrow_loss(problem.loss, &residuals.weighted)?;
    let conditioning = Conditioning::of(system, &reduction);
    identifiability::refuse_singular_minimum(problem.free, conditioning.as_ref())?;
    let unit = reduction.covariance().ok_or_else(identifiability::singular)?;
    let fx = problem.free.position(Parameter::Fx);
    let relative =
        fx.map_or(0.0, |row| (unit.intrinsics[(row, row)] * noise.variance).sqrt() / state.camera.fx);
    focal::refuse_if_open(problem, &minimum, noise, relative)?;
    let profile = Profile::new(problem, &minimum, &reduction, noise);
    let intervals = settings.profile_coverage.zip(profile);
    let intervals = intervals.map_or(Vec::new(), |(coverage, p)| p.intervals(coverage, degrees_of_freedom));
    let mut covariance = frames.covariance(unit, &state.cam_from_target, noise.variance);
    covariance.fy_per_fx = problem.fy_per_fx;
    // The board's shape stands behind the camera's parameters.
    let n = problem.free.len();
    let board = problem.bend.map(|bend| {
        let sd = |k: usize| match k < bend.deformations {
            true => covariance.intrinsics[(n + k, n + k)].sqrt(),
            false => 0.0,
        };
        let [bow_x, bow_y, twist] = state.shape;
        BoardShape { bow_x, bow_y, twist, standard_deviations: [sd(0), sd(1), sd(2)], region }
    });
    covariance.intrinsics = covariance.intrinsics.view((0, 0), (n, n)).into_owned();
    covariance.cross = covariance.cross.iter().map(|cross| cross.rows(0, n).into_owned()).collect();
    let of_residuals: Vec<Warning> = if residuals.square > problem.rounding_cost {
        let per_coordinate = 0.5 * residuals.square / residuals.marks as f64;
        let structure = structure::structure(&residuals.weighted, per_coordinate, problem.loss);
        outliers(problem, &minimum, &residuals, freedom)
            .map(Warning::Outliers)
            .into_iter()
            .chain(structure)
            .collect()
    } else {
        Vec::new()
    };
    let poses = state.cam_from_target.iter().enumerate();
    let mut calibration = LensCalibration {
        camera: state.camera,
        free: problem.free,
        priors: problem.priors.to_vec(),
        cam_from_target: poses.map(|(view, pose)| frames.at(view).cam_from_target(pose)).collect(),
        rmse_px: (residuals.square / residuals.marks as f64).sqrt(),
        sigma_px: (residuals.square / freedom.max(1.0)).sqrt(),
        degrees_of_freedom,
        covariance,
        conditioning,
        termination: *termination,
        certificate: None,
        intervals,
        starts,
        iterations: *iterations,
        warnings: Vec::new(),
        board,
        residuals: residuals.plain,
    };
    let largest_angle = largest_angle(problem, state);
    calibration.warnings =
        warnings::of_lens(&calibration, largest_angle, of_residuals, &skewed, &rivals, problem.bend);
    Ok(calibration)
}

#[cfg(test)]
mod tests {
    use super::super::super::{Board, Settings, Warning};
    use super::super::{estimate, fixture};
    use super::*;
    use crate::board::View;
    use crate::calibrate::tests::correlations;
    use crate::camera::FreeParameters;
    use crate::camera::{Model, Parameter};

    #[test]
    fn an_interval_counts_what_is_known_of_its_own_parameter() {
        let views = fixture::wide_views();
        let settings = Settings::of_model(Model::KannalaBrandt).with_profile_intervals(0.95);
        let alone = estimate::calibrate(&views, &settings).unwrap();
        let sd = 1e-3 * alone.standard_deviation(Parameter::K4).unwrap();
        let settings = settings.with_prior(Parameter::K4, -0.0015, sd);
        let found = estimate::calibrate(&views, &settings).unwrap();
        // Little but the prior speaks of it, and a prior's cost is a parabola.
        let interval = found.intervals.iter().find(|i| i.parameter == Parameter::K4).unwrap();
        let half = found.intervals[0].linear.1 - found.intervals[0].linear.0;
        let t = 0.5 * half / found.standard_deviation(Parameter::Fx).unwrap();
        for (end, expected) in [(interval.low.unwrap(), -t * sd), (interval.high.unwrap(), t * sd)] {
            assert!(((end + 0.0015) / expected - 1.0).abs() < 0.02, "{interval:?}");
        }
        let misleads = |w: &Warning| matches!(w, Warning::NotLinear { parameter: Parameter::K4, .. });
        assert!(!found.warnings.iter().any(misleads), "{:?}", found.warnings);
    }

    #[test]
    fn the_deformations_that_are_estimated_have_deviations_and_the_others_none() {
        let views = fixture::wide_views();
        let standard_deviation = f64::INFINITY;
        for (board, estimated) in
            [(Board::Bowed { standard_deviation }, 2), (Board::Bent { standard_deviation }, 3)]
        {
            let mut settings = Settings::of_model(Model::KannalaBrandt);
            settings.board = board;
            let shape = estimate::calibrate(&views, &settings).unwrap().board.unwrap();
            let numbers = [shape.bow_x, shape.bow_y, shape.twist];
            for (k, (number, sd)) in numbers.into_iter().zip(shape.standard_deviations).enumerate() {
                // The board is flat: five deviations are what chance does once in a million.
                assert_eq!(sd > 0.0, k < estimated, "{k} {sd}");
                assert!(number.abs() <= 5.0 * sd, "{k}: {number} {sd}");
            }
        }
    }

    #[test]
    fn the_largest_angle_is_that_of_the_outermost_mark() {
        fixture::at_minimum(FreeParameters::of(&fixture::FREE), 1.0, |problem, minimum| {
            let mut largest: f64 = 0.0;
            for (marks, pose) in problem.views.iter().zip(&minimum.state.cam_from_target) {
                for mark in &marks.list {
                    let at = pose.rotation.columns(0, 2) * mark.point + pose.translation;
                    largest = largest.max(libm::acos(at.z / at.norm()));
                }
            }
            let own = largest_angle(problem, &minimum.state);
            assert!((own - largest).abs() < 1e-12, "{own} {largest}");
        });
    }

    #[test]
    fn what_is_known_from_elsewhere_costs_no_degree_of_freedom() {
        fixture::at_minimum(FreeParameters::of(&fixture::FREE), 1.0, |problem, minimum| {
            // Five views of 35 marks; six parameters and five poses.
            let residuals = Residuals::of(problem, &minimum.state);
            assert_eq!(residuals.freedom(minimum, 1.5), 350.0 + 1.5 - 36.0);
        });
    }

    #[test]
    fn the_correlation_that_is_told_is_that_of_neighbours_residuals() {
        let views = fixture::wide_views_of_a_bowed_board(0.05);
        let found = estimate::calibrate(&views, &Settings::of_model(Model::KannalaBrandt)).unwrap();
        let (told, expected) = correlations(&found);
        assert!((told - expected).abs() < 1e-12, "{told} {expected}");
    }

    #[test]
    fn a_mark_ten_deviations_off_is_an_outlier_by_the_noise_of_a_coordinate() {
        let mut views = fixture::wide_views();
        let mut pixels = views[3].pixels().to_vec();
        pixels[17].x -= 10.3 * fixture::WIDE_NOISE_PX;
        views[3] = View::new(views[3].points().to_vec(), pixels).unwrap();
        let found = estimate::calibrate(&views, &Settings::of_model(Model::KannalaBrandt)).unwrap();
        // So few do not make the tails heavy: four times the square of the mean square.
        let squares = || found.residuals.iter().flatten().map(Vec2::norm_squared);
        let (mean, fourth) = (squares().sum::<f64>() / 700.0, squares().map(|s| s * s).sum::<f64>() / 700.0);
        assert!(fourth < 3.8 * mean * mean, "{}", fourth / (mean * mean));
        let is_it =
            |w: &Warning| matches!(w, Warning::Outliers(o) if (o.marks, o.view, o.point) == (1, 3, 17));
        assert!(found.warnings.iter().any(is_it), "{:?}", found.warnings);
    }
}
