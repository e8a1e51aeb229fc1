//! What should a user know before trusting a calibration? The conditions behind each warning.

use super::intervals::Skewed;
use super::intervals::student_quantile;
use super::judged::Twin;
use super::prior::contradiction;
use super::report::{STRONG_CORRELATION, UNCERTAIN_FOCAL};
use super::rival::Rival;
use super::settings::Bend;
use super::{
    BoardShape, Calibration, Certificate, Covariance, Deformation, LensCalibration, Prior, Termination,
    Unknown, Warning, WeakComponent,
};
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use crate::geometry::Pose;

/// The warnings of a calibration: `of_residuals` are those of its outliers and of what residuals have in
/// common, `skewed` are the parameters whose cost is no parabola, `rival` is another camera.
pub(super) fn of(
    calibration: &Calibration,
    largest_radius: f64,
    of_residuals: impl Iterator<Item = Warning>,
    skewed: &[Skewed],
    rival: Option<Rival>,
    twins: Vec<Twin>,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    warnings.extend(ending(calibration));
    warnings.extend(of_residuals);
    warnings.extend(few_degrees_of_freedom(calibration.degrees_of_freedom));
    if calibration.termination.is_minimum()
        && !calibration.certificate.as_ref().is_some_and(Certificate::is_possible)
    {
        warnings.push(Warning::NotCertified);
    }
    let value = |parameter| calibration.camera.get(parameter);
    warnings.extend(calibration.priors.iter().filter_map(|prior| contradicted(calibration, prior, value)));
    warnings.extend(twin_pose(&twins));
    warnings.extend(from_behind(&calibration.cam_from_target));
    warnings.extend(correlated(&calibration.covariance, calibration.free));
    warnings.extend(focal_length_uncertain(calibration, value));
    warnings.extend(folding(&calibration.camera, largest_radius));
    warnings.extend(not_linear(skewed));
    warnings.extend(rival.map(|rival| ambiguous(&rival, value)));
    warnings
}

/// The warnings of a calibration with a lens of any model: `bend` is what was known of the board's shape.
pub(super) fn of_lens(
    calibration: &LensCalibration,
    largest_angle: f64,
    of_residuals: Vec<Warning>,
    skewed: &[Skewed],
    rivals: &[Rival],
    bend: Option<Bend>,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if calibration.termination != Termination::Converged {
        let LensCalibration { termination, iterations, .. } = *calibration;
        warnings.push(Warning::NotConverged { termination, iterations });
    }
    warnings.extend(of_residuals);
    warnings.extend(few_degrees_of_freedom(calibration.degrees_of_freedom));
    let value = |parameter| calibration.camera.value(parameter).unwrap_or(0.0);
    warnings.extend(calibration.priors.iter().filter_map(|prior| contradicted(calibration, prior, value)));
    let known_board = calibration.board.as_ref().zip(bend);
    warnings.extend(known_board.and_then(|(board, bend)| board_contradicted(board, bend.standard_deviation)));
    warnings.extend(from_behind(&calibration.cam_from_target));
    let model = calibration.camera.distortion.model();
    let pairs = correlated(&calibration.covariance, calibration.free);
    warnings
        .extend(pairs.into_iter().filter(|pair| model == Model::BrownConrady || !is_by_construction(pair)));
    warnings.extend(hardly_separable(calibration));
    let is_misled = |parameter| {
        skewed.iter().any(|s| s.parameter == parameter && s.ratios.iter().all(|&ratio| ratio < MISLED))
    };
    let uncertain = focal_length_uncertain(calibration, value);
    warnings.extend(uncertain.filter(|warning| match warning {
        Warning::FocalLengthUncertain { parameter, .. } => !is_misled(*parameter),
        _ => true,
    }));
    let limit = calibration.camera.distortion.monotone_angle();
    if limit < largest_angle {
        warnings.push(Warning::FoldsInsideView {
            monotone_angle: limit.to_degrees(),
            largest_observed: largest_angle.to_degrees(),
        });
    }
    warnings.extend(Warning::outside_range(&calibration.camera));
    warnings.extend(not_linear(skewed));
    warnings.extend(rivals.iter().map(|rival| ambiguous(rival, value)));
    warnings
}

/// Where the profile says that a parameter is known better than its standard deviation by this factor, that
/// tells nothing of it.
const MISLED: f64 = 0.5;

fn hardly_separable(calibration: &LensCalibration) -> Option<Warning> {
    let conditioning = calibration.conditioning.as_ref().filter(|c| c.is_hardly_separable())?;
    let parameter = |member: &WeakComponent| match member.unknown {
        Unknown::Intrinsic(parameter) => Some(parameter),
        _ => None,
    };
    Some(Warning::HardlySeparable { parameters: conditioning.weakest.iter().filter_map(parameter).collect() })
}

impl Warning {
    /// Whether a coefficient lies outside of the range for which its model is defined.
    pub(crate) fn is_outside_range(camera: &Camera<Lens>) -> bool {
        Warning::outside_range(camera).next().is_some()
    }

    /// Those of coefficients outside of the range for which their model is defined.
    pub(crate) fn outside_range(camera: &Camera<Lens>) -> impl Iterator<Item = Warning> {
        let is_outside = |&(parameter, value): &(Parameter, f64)| !parameter.is_defined_at(value);
        camera.values().filter(is_outside).map(|(parameter, value)| {
            let (low, high) = parameter.defined_range();
            Warning::OutsideRange { parameter, value, low, high }
        })
    }
}

fn not_linear(skewed: &[Skewed]) -> impl Iterator<Item = Warning> {
    let warning = |s: &Skewed| {
        let [below, above] = s.ratios.map(|ratio| Some(ratio).filter(|ratio| ratio.is_finite()));
        Warning::NotLinear { parameter: s.parameter, below, above }
    };
    skewed.iter().map(warning)
}

fn ambiguous(rival: &Rival, value: impl Fn(Parameter) -> f64) -> Warning {
    let Rival { parameter, value: other, excess } = *rival;
    Warning::Ambiguous { parameter, value: value(parameter), other, excess }
}

/// Focal lengths that are known roughly.
fn focal_length_uncertain<L>(
    calibration: &Calibration<L>,
    value: impl Fn(Parameter) -> f64,
) -> impl Iterator<Item = Warning> {
    [Parameter::Fx, Parameter::Fy].into_iter().filter_map(move |parameter| {
        let relative = calibration.covariance.standard_deviation(parameter)? / value(parameter);
        // An fy that is tied to fx is known as well, and said once.
        calibration.free.position(parameter)?;
        (relative > UNCERTAIN_FOCAL).then_some(Warning::FocalLengthUncertain { parameter, relative })
    })
}

fn contradicted<L>(
    calibration: &Calibration<L>,
    prior: &Prior,
    value: impl Fn(Parameter) -> f64,
) -> Option<Warning> {
    let Prior { parameter, mean, standard_deviation } = *prior;
    let posterior = calibration.covariance.standard_deviation(parameter)?;
    let estimate = value(parameter);
    let deviations = contradiction(estimate - mean, standard_deviation, posterior)?;
    Some(Warning::Contradicted { parameter, mean, standard_deviation, estimate, deviations })
}

/// The deformation of a board that contradicts most what is known of all of them beforehand: 0 +-
/// `standard_deviation`.
fn board_contradicted(board: &BoardShape, standard_deviation: f64) -> Option<Warning> {
    let deformations = board.deformations().into_iter().zip(board.standard_deviations).zip(Deformation::ALL);
    let contradicted = |((estimate, posterior), deformation)| {
        let deviations = contradiction(estimate, standard_deviation, posterior)?;
        Some((
            deviations,
            Warning::BoardContradicted { deformation, standard_deviation, estimate, deviations },
        ))
    };
    deformations.filter_map(contradicted).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, warning)| warning)
}

/// Coverage of the interval that few degrees of freedom widen.
const COVERAGE: f64 = 0.95;
/// Half the width of such an interval where the degrees of freedom are many.
const NORMAL: f64 = 1.959964;
/// Intervals wider by more than this factor are worth a word.
const WIDER: f64 = 1.1;
/// With this many degrees of freedom they are not: Student's quantile is 1.0995 times the normal one at 13.
const ENOUGH: usize = 14;

fn few_degrees_of_freedom(degrees_of_freedom: usize) -> Option<Warning> {
    if degrees_of_freedom == 0 {
        return Some(Warning::NoDegreesOfFreedom);
    }
    if degrees_of_freedom >= ENOUGH {
        return None;
    }
    let student = student_quantile(COVERAGE, degrees_of_freedom);
    (student > WIDER * NORMAL).then_some(Warning::FewDegreesOfFreedom { degrees_of_freedom, student })
}

fn twin_pose(twins: &[Twin]) -> Option<Warning> {
    let nearest = twins.iter().min_by(|a, b| a.excess.total_cmp(&b.excess))?;
    let Twin { view, degrees, excess } = *nearest;
    Some(Warning::TwinPose { view, views: twins.len(), degrees, excess })
}

/// Views whose target faces the camera with the other side than most targets do: a mirrored order of marks
/// looks like this.
fn from_behind(cam_from_target: &[Pose]) -> Option<Warning> {
    let faces_away = |pose: &Pose| pose.rotation.column(2).dot(&pose.translation) > 0.0;
    let away: Vec<bool> = cam_from_target.iter().map(faces_away).collect();
    let count = away.iter().filter(|&&away| away).count();
    let odd = 2 * count <= away.len();
    let mut views = (0..away.len()).filter(|&view| away[view] == odd);
    let views_in_all = if odd { count } else { away.len() - count };
    Some(Warning::FromBehind { view: views.next()?, views: views_in_all })
}

/// What the ending of the search asks to be told.
fn ending(calibration: &Calibration) -> Option<Warning> {
    match (calibration.termination, calibration.certificate) {
        (Termination::Converged, _) => None,
        (Termination::AboveFloor, Some(certificate)) => Some(Warning::AboveFloor {
            rmse_px: certificate.rmse_px,
            floor_rmse_px: certificate.floor_rmse_px,
            p_value: certificate.p_value,
            starts: calibration.starts,
        }),
        (termination, _) => Some(Warning::NotConverged { termination, iterations: calibration.iterations }),
    }
}

/// Pairs of distortion coefficients, or of any parameters, that trade off against each other.
fn correlated(covariance: &Covariance, free: FreeParameters) -> Vec<Warning> {
    let parameters: Vec<Parameter> = free.iter().collect();
    let mut found = Vec::new();
    for (i, &a) in parameters.iter().enumerate() {
        for &b in &parameters[i + 1..] {
            match covariance.correlation(a, b) {
                // fx and fy share the distance to the target: their correlation is the rule, and harmless.
                Some(_) if (a, b) == (Parameter::Fx, Parameter::Fy) => {}
                Some(correlation) if correlation.abs() > STRONG_CORRELATION => {
                    found.push(Warning::Correlated { a, b, correlation });
                }
                _ => {}
            }
        }
    }
    found
}

/// Whether a pair of parameters makes up for each other in every calibration, so that its correlation tells
/// nothing of this one: radial coefficients of one lens, whose terms grow with the same angle, and the focal
/// length with those of the double sphere, which change the scale on the axis. Nothing is to be held there:
/// pixels are known well, however poorly each of the numbers is. Of a Brown-Conrady lens coefficients are
/// left out as a matter of course, and the pair says which may be.
fn is_by_construction(warning: &Warning) -> bool {
    use Parameter::{Alpha, Fx, Fy, K1, K2, K3, K4, K5, K6, Xi};
    let is_radial = |p: &Parameter| matches!(p, K1 | K2 | K3 | K4 | K5 | K6 | Xi | Alpha);
    match warning {
        Warning::Correlated { a: Fx | Fy, b: Xi | Alpha, .. } => true,
        Warning::Correlated { a, b, .. } => is_radial(a) && is_radial(b),
        _ => false,
    }
}

/// Warns if the model folds within 1.2 times the largest radius seen.
fn folding(camera: &Camera, largest_observed: f64) -> Option<Warning> {
    let monotone_radius = camera.distortion.monotone_radius();
    (monotone_radius < 1.2 * largest_observed)
        .then_some(Warning::FoldsInsideImage { monotone_radius, largest_observed })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::calibrate_lens;
    use crate::calibrate::tests::four_views;
    use crate::calibrate::{Settings, calibrate};
    use crate::camera::BrownConrady;
    use crate::geometry::{Mat3, Vec3};
    use nalgebra::DMatrix;

    #[test]
    fn a_prior_is_contradicted_by_its_distance_over_the_deviation_of_both() {
        let views = four_views(0.1);
        let alone = calibrate(&views, &Settings::standard()).unwrap();
        let (k1, sd) = (alone.camera.distortion.k1, alone.standard_deviation(Parameter::K1).unwrap());
        // Six deviations of the difference of two independent estimates.
        let prior_sd = 3.0 * sd;
        let both_sd = libm::hypot(sd, prior_sd);
        let told = |away: f64| {
            let settings = Settings::standard().with_prior(Parameter::K1, k1 + away * both_sd, prior_sd);
            let warnings = calibrate(&views, &settings).unwrap().warnings;
            warnings.into_iter().find_map(|warning| match warning {
                Warning::Contradicted { parameter: Parameter::K1, deviations, .. } => Some(deviations),
                _ => None,
            })
        };
        let deviations = told(6.0).unwrap();
        assert!((deviations - 6.0).abs() < 0.1, "{deviations}");
        assert_eq!(told(-4.0), None);
    }

    #[test]
    fn the_fewer_views_from_one_side_are_those_from_behind() {
        let seen = |sides: &[f64]| {
            let pose = |side: &f64| Pose {
                rotation: Mat3::from_diagonal(&Vec3::new(1.0, *side, *side)),
                translation: Vec3::new(0.0, 0.0, 100.0),
            };
            from_behind(&sides.iter().map(pose).collect::<Vec<_>>())
        };
        let found = Some(Warning::FromBehind { view: 1, views: 2 });
        assert_eq!(seen(&[1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0]), found);
        assert_eq!(seen(&[-1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0]), found);
        assert_eq!((seen(&[1.0; 3]), seen(&[-1.0; 3])), (None, None));
    }

    #[test]
    fn pairs_that_share_their_variance_are_told_but_for_the_focal_lengths() {
        use Parameter::{Cx, Fx, Fy, K1};
        let free = FreeParameters::of(&[Fx, Fy, Cx, K1]);
        // Deviations of 2, 2, 3 and 5.
        let rows =
            [[4.0, 3.98, 0.0, 9.7], [3.98, 4.0, 0.0, 9.7], [0.0, 0.0, 9.0, -14.85], [9.7, 9.7, -14.85, 25.0]];
        let matrix = DMatrix::from_fn(4, 4, |i, j| rows[i][j]);
        let found = correlated(&Covariance::untied(free, matrix, Vec::new(), Vec::new()), free);
        assert_eq!(found, [Warning::Correlated { a: Cx, b: K1, correlation: -0.99 }]);
    }

    #[test]
    fn radial_coefficients_of_other_lenses_make_up_for_each_other_in_every_calibration() {
        use Parameter::{Alpha, Cx, Fx, Fy, K1, K2, K4, P1, Xi};
        for (a, b, is) in [
            (K1, K2, true),
            (K2, K4, true),
            (Xi, Alpha, true),
            (Fx, Xi, true),
            (Fy, Alpha, true),
            (Fx, K1, false),
            (Cx, P1, false),
            (K1, P1, false),
        ] {
            assert_eq!(is_by_construction(&Warning::Correlated { a, b, correlation: 0.99 }), is, "{a} {b}");
        }
        assert!(!is_by_construction(&Warning::NotCertified));
    }

    #[test]
    fn a_lens_that_folds_within_a_fifth_of_what_was_seen_is_told() {
        // r - 0.3 r^3 turns at r = 1 / sqrt(0.9) = 1.0541: 1.2 times 0.8784.
        let camera =
            Camera::pinhole(600.0, 600.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.3, 0.0));
        assert_eq!(folding(&camera, 0.875), None);
        let Some(Warning::FoldsInsideImage { monotone_radius, largest_observed }) = folding(&camera, 0.882)
        else {
            panic!();
        };
        assert!((monotone_radius - 1.0 / 0.9f64.sqrt()).abs() < 1e-9 && largest_observed == 0.882);
    }

    #[test]
    fn a_focal_length_known_better_than_its_deviation_says_is_not_called_uncertain() {
        let mut found = calibrate_lens(&four_views(0.1), &Settings::standard()).unwrap();
        // Deviations of more than a twentieth.
        let sd = found.standard_deviation(Parameter::Fx).unwrap();
        found.covariance = found.covariance.scaled((60.0 / sd) * (60.0 / sd));
        let uncertain = |skewed: &[Skewed]| -> Vec<Parameter> {
            let warnings = of_lens(&found, 0.5, Vec::new(), skewed, &[], None);
            let of = |warning: &Warning| match warning {
                Warning::FocalLengthUncertain { parameter, .. } => Some(*parameter),
                _ => None,
            };
            warnings.iter().filter_map(of).collect()
        };
        let skewed = |parameter: Parameter, below: f64| Skewed { parameter, ratios: [below, 0.1] };
        assert_eq!(uncertain(&[]), [Parameter::Fx, Parameter::Fy]);
        assert_eq!(uncertain(&[skewed(Parameter::Fx, 0.4)]), [Parameter::Fy]);
        // Better on one side only, or another parameter.
        assert_eq!(uncertain(&[skewed(Parameter::Fx, 0.6)]), [Parameter::Fx, Parameter::Fy]);
        assert_eq!(uncertain(&[skewed(Parameter::Cx, 0.1)]), [Parameter::Fx, Parameter::Fy]);
    }
}
