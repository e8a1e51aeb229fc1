//! What does a calibration from a measured target say? The camera with its uncertainty, and what became of
//! every mark.

use super::data::Data;
use super::descent::Minimum;
use super::equations::Inverse;
use super::identifiability::{self, largest_angle};
use super::noise::{Known, Left};
use super::problem::Problem;
use super::tests_of_sums::Moments;
use super::{FALSE_ALARM, MeasuredError, MeasuredTarget, Noise, SumTest, warnings};
use crate::calibrate::{Covariance, LensCalibration};
use crate::camera::Parameter;
use crate::distribution::ChiSquare;
use crate::geometry::{Mat3, Pose, Vec3, rotation};
use nalgebra::{DMatrix, Matrix6, MatrixXx6};

/// A camera from a measured target.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MeasuredCalibration {
    /// Camera, poses, residuals and their covariance, which counts what is not known of the marks. Residuals
    /// stand in the order of each view's marks; `degrees_of_freedom` are those of the pixels, rounded down.
    /// Nothing certifies its minimum.
    pub calibration: LensCalibration,
    /// Where the noise `sigma_px` comes from.
    pub noise: Noise,
    /// Every mark that was seen, in the target's order.
    pub marks: Vec<CorrectedMark>,
    /// Names of marks that no view shows.
    pub unseen: Vec<String>,
    /// Whether the stated standard deviations of the marks can be believed: the sum of their squared
    /// corrections, each over its standard deviation. `None` where no mark is uncertain, or pixels tell
    /// nothing of them.
    pub credibility: Option<SumTest>,
    /// Whether the noise that was given can be believed: the sum of squared residuals over it. `None` where
    /// it was estimated.
    pub noise_test: Option<SumTest>,
}

/// A mark after the calibration.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CorrectedMark {
    /// Its name.
    pub id: String,
    /// How many views show it.
    pub views: usize,
    /// Its estimated position, in the target's coordinates.
    pub position: Vec3,
    /// Covariance of that position; rows and columns of exact coordinates are 0.
    pub covariance: Mat3,
    /// Estimated - measured position.
    pub correction: Vec3,
    /// What the correction's standard deviation is to be expected, `sqrt(sd^2 - variance of the estimate)`:
    /// what pixels leave where it was shows as nothing.
    pub expected: Vec3,
    /// Correction over that, standard normal if all is as stated (Baarda 1968); 0 for exact coordinates.
    pub normalised: Vec3,
    /// Probability of a correction as large in all that pixels tell of the mark, by chance; 1 where they tell
    /// nothing.
    pub p_value: f64,
    /// Whether that is beyond expectation: one set of marks in a hundred has such a mark by chance
    /// ([`FALSE_ALARM`]).
    pub is_beyond_expectation: bool,
}

impl CorrectedMark {
    /// Standard deviations of the estimated position.
    pub fn standard_deviation(&self) -> Vec3 {
        self.covariance.diagonal().map(|v| v.max(0.0).sqrt())
    }
}

impl MeasuredCalibration {
    /// The marks whose correction is beyond expectation, the least probable first.
    pub fn beyond_expectation(&self) -> Vec<&CorrectedMark> {
        let mut list: Vec<&CorrectedMark> =
            self.marks.iter().filter(|mark| mark.is_beyond_expectation).collect();
        list.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
        list
    }

    /// Standard deviation of an estimated parameter; `None` if it was held.
    pub fn standard_deviation(&self, parameter: Parameter) -> Option<f64> {
        self.calibration.standard_deviation(parameter)
    }

    /// What is doubtful about the marks and the noise, in sentences.
    pub fn doubts(&self) -> Vec<String> {
        let mut said = Vec::new();
        let beyond = self.beyond_expectation();
        if !beyond.is_empty() {
            let name = |mark: &&CorrectedMark| {
                let most =
                    mark.normalised.iter().fold(0.0, |m: f64, x| if x.abs() > m.abs() { *x } else { m });
                format!("{} ({most:+.1} of its deviations)", mark.id)
            };
            let names: Vec<String> = beyond.iter().take(MOST_NAMED).map(name).collect();
            let more = beyond.len().saturating_sub(MOST_NAMED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            said.push(format!(
                "marks that are not where they were measured: {}{more}; by chance one target in a hundred has such a mark: measure them again, or \
                 leave them out",
                names.join(", ")
            ));
        }
        if let Some(test) = self.credibility.filter(|test| !test.holds()) {
            let what = if test.factor() > 1.0 { "too small" } else { "too large" };
            said.push(format!(
                "the stated standard deviations of the marks are {what}: corrections are {:.2} times what they let expect (by chance with probability \
                 {:.1e}), and the camera's covariance rests on them",
                test.factor(),
                test.p_value
            ));
        }
        if let Some(test) = self.noise_test.filter(|test| !test.holds()) {
            said.push(format!(
                "residuals are {:.2} times what the noise that was given lets expect (by chance with probability {:.1e}): is the noise right, the lens \
                 model rich enough?",
                test.factor(),
                test.p_value
            ));
        }
        said
    }
}

/// Marks named in a sentence.
const MOST_NAMED: usize = 5;
/// Combinations of a mark's coordinates of which pixels tell less than this part are left out of its test.
const TOLD: f64 = 1e-6;

/// The result at a minimum.
pub(super) fn report(
    problem: &Problem<'_>,
    minimum: &Minimum,
    starts: usize,
    target: &MeasuredTarget,
    noise: Noise,
    views: &[super::MeasuredView],
) -> Result<MeasuredCalibration, MeasuredError> {
    let data = problem.data;
    let conditioning = identifiability::conditioning(problem, &minimum.equations)?;
    let singular = || crate::calibrate::CalibrationError::NotIdentifiable {
        inseparable: vec![crate::calibrate::Unknown::Camera, crate::calibrate::Unknown::Poses],
        why: "the normal equations are singular".into(),
    };
    let inverse = minimum.equations.inverse().ok_or_else(singular)?;
    let left = Left::of(problem, minimum, &inverse).ok_or(MeasuredError::NoStart)?;
    // Under priors the noise is settled to a part of 1e-6; without, the residuals tell it now.
    let variance = match noise {
        Noise::Known { .. } => problem.variance,
        Noise::Estimated if left.moments.sum >= 1.0 => left.variance(),
        Noise::Estimated => {
            let coordinates = 2 * data.observations();
            return Err(MeasuredError::NoFreedom { coordinates, freedom: left.moments.sum });
        }
    };
    let covariance = covariance(problem, minimum, &inverse, variance);
    let fx = minimum.state.camera.fx;
    let relative = covariance.standard_deviation(Parameter::Fx).map_or(0.0, |sd| sd / fx);
    identifiability::refuse_if_open(problem, minimum, relative)?;
    let marks = marks(problem, minimum, &inverse, target);
    let credibility = credibility(problem, minimum, &inverse);
    let noise_test = match noise {
        Noise::Known { .. } => SumTest::of(left.square / variance, left.moments),
        Noise::Estimated => None,
    };
    let seen: Vec<bool> =
        (0..target.marks().len()).map(|i| data.in_target.binary_search(&i).is_ok()).collect();
    let unseen = target.marks().iter().zip(seen).filter(|(_, seen)| !seen).map(|(m, _)| m.id.clone());
    let largest_angle = largest_angle(problem, &minimum.state);
    let observations = data.observations() as f64;
    let from_centre = |pose: &Pose| Pose {
        rotation: pose.rotation,
        translation: pose.translation - pose.rotation * data.centre,
    };
    let mut calibration = LensCalibration {
        camera: minimum.state.camera,
        free: problem.free,
        priors: problem.priors.to_vec(),
        cam_from_target: minimum.state.cam_from_target.iter().map(from_centre).collect(),
        residuals: in_given_order(&left, data, target, views),
        rmse_px: (left.square / observations).sqrt(),
        sigma_px: variance.sqrt(),
        degrees_of_freedom: left.moments.sum.max(0.0) as usize,
        covariance,
        conditioning,
        termination: minimum.termination,
        certificate: None,
        intervals: Vec::new(),
        starts,
        iterations: minimum.iterations,
        warnings: Vec::new(),
        board: None,
    };
    let least = problem.rounding_cost() / observations;
    calibration.warnings = warnings::of(&calibration, views, variance.max(least), largest_angle);
    Ok(MeasuredCalibration { calibration, noise, marks, unseen: unseen.collect(), credibility, noise_test })
}

/// Residuals in the order in which the marks of each view were given.
fn in_given_order(
    left: &Left,
    data: &Data,
    target: &MeasuredTarget,
    views: &[super::MeasuredView],
) -> Vec<Vec<crate::geometry::Vec2>> {
    let of_view = |(view, residuals): (usize, &Vec<crate::geometry::Vec2>)| {
        let residual = |seen: &super::SeenMark| {
            let place = target.position(&seen.id)?;
            let at = data.views[view].binary_search_by_key(&place, |s| data.in_target[s.mark]).ok()?;
            Some(residuals[at])
        };
        views[view].marks().iter().filter_map(residual).collect()
    };
    left.residuals.iter().enumerate().map(of_view).collect()
}

/// Of camera and poses. A pose's translation is that of the target's origin, `T = T_c - R c`, so `dT = dT_c +
/// [R c]x delta`.
fn covariance(problem: &Problem<'_>, minimum: &Minimum, inverse: &Inverse, variance: f64) -> Covariance {
    let n = problem.free.len();
    let about_the_origin = |pose: &Pose| {
        let mut change = Matrix6::identity();
        let arm = pose.rotation * problem.data.centre;
        change.fixed_view_mut::<3, 3>(3, 0).copy_from(&rotation::skew(&arm));
        change
    };
    let changes: Vec<Matrix6<f64>> = minimum.state.cam_from_target.iter().map(about_the_origin).collect();
    let pose =
        |(block, change): (&Matrix6<f64>, &Matrix6<f64>)| change * block * change.transpose() * variance;
    let cross = |(block, change): (&DMatrix<f64>, &Matrix6<f64>)| {
        MatrixXx6::from_fn(n, |i, j| variance * (0..6).map(|k| block[(i, k)] * change[(j, k)]).sum::<f64>())
    };
    Covariance {
        free: problem.free,
        fy_per_fx: problem.fy_per_fx,
        intrinsics: inverse.shared.view((0, 0), (n, n)).into_owned() * variance,
        poses: inverse.poses.iter().zip(&changes).map(pose).collect(),
        cross: inverse.cross.iter().zip(&changes).map(cross).collect(),
    }
}

/// Every mark that was seen.
fn marks(
    problem: &Problem<'_>,
    minimum: &Minimum,
    inverse: &Inverse,
    target: &MeasuredTarget,
) -> Vec<CorrectedMark> {
    let data = problem.data;
    let uncertain = data.uncertain_marks().max(1) as f64;
    let mut seen_in = vec![0; data.positions.len()];
    data.views.iter().flatten().for_each(|seen| seen_in[seen.mark] += 1);
    let n = problem.free.len();
    let of_mark = |mark: usize| {
        let rows = data.unknown[mark];
        let entry = |a: usize, b: usize| match (rows[a], rows[b]) {
            (Some(i), Some(j)) => problem.variance * inverse.shared[(n + i, n + j)],
            _ => 0.0,
        };
        let covariance = Mat3::from_fn(entry);
        let offset = |axis: usize| rows[axis].map_or(0.0, |k| minimum.state.offsets[k]);
        let correction = Vec3::new(offset(0), offset(1), offset(2));
        let sd = data.deviations[mark];
        let expected = Vec3::from_fn(|k, _| (sd[k] * sd[k] - covariance[(k, k)]).max(0.0).sqrt());
        let told = |k: usize| expected[k] > TOLD.sqrt() * sd[k] && sd[k] > 0.0;
        let normalised = Vec3::from_fn(|k, _| if told(k) { correction[k] / expected[k] } else { 0.0 });
        let p_value = chance(&correction, &covariance, &sd);
        CorrectedMark {
            id: target.marks()[data.in_target[mark]].id.clone(),
            views: seen_in[mark],
            position: data.positions[mark] + data.centre + correction,
            covariance,
            correction,
            expected,
            normalised,
            p_value,
            is_beyond_expectation: p_value < FALSE_ALARM / uncertain,
        }
    };
    (0..data.positions.len()).map(of_mark).collect()
}

/// The probability of a correction as large: `c^T D^+ c` is chi-squared, in units of the stated deviations
/// with `D = I - posterior`, over the combinations that pixels tell something of.
fn chance(correction: &Vec3, covariance: &Mat3, sd: &Vec3) -> f64 {
    let scale = sd.map(|sd| if sd > 0.0 { 1.0 / sd } else { 0.0 });
    let own = |i: usize| if sd[i] > 0.0 { 1.0 } else { 0.0 };
    let told = Mat3::from_fn(|i, j| {
        let prior = if i == j { own(i) } else { 0.0 };
        prior - scale[i] * covariance[(i, j)] * scale[j]
    });
    let eigen = told.symmetric_eigen();
    let scaled = correction.component_mul(&scale);
    let (mut sum, mut freedom) = (0.0, 0);
    for k in 0..3 {
        let lambda = eigen.eigenvalues[k];
        if lambda > TOLD {
            let along = eigen.eigenvectors.column(k).dot(&scaled);
            sum += along * along / lambda;
            freedom += 1;
        }
    }
    if freedom == 0 { 1.0 } else { ChiSquare::new(freedom).survival(sum) }
}

/// The corrections of all marks against what is stated.
fn credibility(problem: &Problem<'_>, minimum: &Minimum, inverse: &Inverse) -> Option<SumTest> {
    let data = problem.data;
    let terms = minimum.state.offsets.iter().zip(&data.unknown_deviations);
    let sum: f64 = terms.map(|(c, sd)| (c / sd) * (c / sd)).sum();
    let n = problem.free.len();
    let known = Known::among(problem, &minimum.state, inverse, |row| row >= n);
    let count = data.unknown_deviations.len() as f64;
    // Of D = I - P^1/2 Q P^1/2: tr D = m - tr(Q P), tr D^2 = m - 2 tr(Q P) + tr(Q P Q P).
    let moments =
        Moments { sum: count - known.trace, squares: count - 2.0 * known.trace + known.trace_of_square };
    SumTest::of(sum, moments)
}
