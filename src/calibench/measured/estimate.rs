//! From measured marks and their pixels to a camera: the steps in order.

use super::data::Data;
use super::problem::{Problem, State};
use super::report::{MeasuredCalibration, report};
use super::resection::{IN_PLANE, IN_SPACE};
use super::search::Found;
use super::shape::{FLAT, NEARLY_FLAT, Shape};
use super::{MeasuredError, MeasuredTarget, MeasuredView, left_out, linearity, plane, rivals, search, space};
use crate::calibrate::{Board, CalibrationError, Loss, Prior, Settings, Warning, asked, domain};
use crate::camera::Parameter;

/// Most marks with a standard deviation that may be seen: 1500 coordinates, equations of 18 MB, a
/// factorisation of some 10^9 operations.
pub const MOST_UNCERTAIN_MARKS: usize = 500;

/// How the noise of a pixel coordinate of weight 1 is known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Noise {
    /// From the residuals, with the rest.
    #[default]
    Estimated,
    /// From elsewhere, such as many photographs of a still target.
    Known {
        /// Its standard deviation, px.
        sigma_px: f64,
    },
}

/// Where nothing else tells the noise of a coordinate, what is known beforehand is first weighed with this
/// one, px.
const USUAL_PX: f64 = 0.1;

/// The most likely camera, poses and positions of marks, from views of a target whose marks were measured,
/// through a lens of any model. The equations stand at [`crate::measured`].
///
/// Parameters are free, held, tied or known beforehand as `settings` say. Marks near a plane (as thick as a
/// thousandth of their width, or as they are known to be) start from
/// [`calibrate_lens`](crate::calibrate::calibrate_lens), with all that it refuses; marks in space from their
/// rays; up to a twentieth from both.
///
/// # Errors
/// [`MeasuredError`]: names that do not agree, views with too few marks, data that do not determine what is
/// free, more than [`MOST_UNCERTAIN_MARKS`]; robust losses, board shapes, profile intervals, starts and last
/// digits, which are not known here. A refinement that does not converge is no error: the result says so.
///
/// ```
/// use calibench::calibrate::Settings;
/// use calibench::geometry::{Pose, Vec3, rotation};
/// use calibench::measured::{MeasuredMark, MeasuredTarget, MeasuredView, Noise, SeenMark, calibrate_measured};
/// use calibench::synth::Truth;
///
/// // Sixty-four marks on two walls, known to 0.02 mm, seen in three photographs.
/// let place = |i: u32| {
///     let (wall, row, column) = (i / 32, f64::from(i % 32 / 8), f64::from(i % 8));
///     if wall == 0 { Vec3::new(-9.0 * column, 12.0 * row - 18.0, 0.0) } else { Vec3::new(9.0 * column, 12.0 * row - 18.0, 5.0 * column) }
/// };
/// let target = MeasuredTarget::new((0..64).map(|i| MeasuredMark::new(i.to_string(), place(i), 0.02)).collect())?;
/// let camera = Truth::example_camera();
/// let view = |x: f64, y: f64| {
///     let pose = Pose { rotation: rotation::from_xyz_rad(x, y, 0.1), translation: Vec3::new(0.0, 0.0, 180.0) };
///     let seen = |i: u32| camera.project(&pose.apply(&place(i))).map(|pixel| SeenMark::new(i.to_string(), pixel));
///     MeasuredView::new((0..64).filter_map(seen).collect())
/// };
/// let views = [view(0.2, 0.0)?, view(-0.3, 0.2)?, view(0.0, -0.4)?];
/// let found = calibrate_measured(&target, &views, &Settings::standard(), Noise::Known { sigma_px: 0.1 })?;
/// assert!((found.calibration.camera.fx - camera.fx).abs() < 1e-6);
/// assert!(found.beyond_expectation().is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn calibrate_measured(
    target: &MeasuredTarget,
    views: &[MeasuredView],
    settings: &Settings,
    noise: Noise,
) -> Result<MeasuredCalibration, MeasuredError> {
    check_settings(settings, noise)?;
    let data = Data::of(target, views)?;
    check_views(&data)?;
    check_counts(&data, settings)?;
    let priors: Vec<Prior> = settings.priors().collect();
    let problem = Problem {
        data: &data,
        free: settings.free(),
        fy_per_fx: settings.fy_per_fx().filter(|_| settings.free().contains(Parameter::Fx)),
        priors: &priors,
        variance: match noise {
            Noise::Known { sigma_px } => sigma_px * sigma_px,
            Noise::Estimated => USUAL_PX * USUAL_PX,
        },
        moves_marks: true,
        moves_poses: true,
        max_iterations: settings.max_iterations,
    };
    let (starts, ambiguous) = starts(&problem, settings)?;
    let (minima, starts) = space::minima(&problem, starts);
    let Found { problem, best, others } = search::best(problem, noise, minima)?;
    let (problem, minimum, not_linear) = linearity::checked(problem, noise, best)?;
    let mut found = report(&problem, &minimum, starts, target, noise, views)?;
    let rival = rivals::rival(&problem, &found.calibration, minimum.equations.cost, &others);
    let left_out = asked(settings, &found.calibration, false, |settings, found, more| {
        left_out::Falls::of(&problem, &minimum, settings, found, more)
    });
    let of_cost = not_linear.into_iter().chain(ambiguous).chain(rival);
    found.calibration.warnings.extend(of_cost.chain(left_out));
    Ok(found)
}

/// What only other estimators know is refused, as are values that no camera has.
fn check_settings(settings: &Settings, noise: Noise) -> Result<(), MeasuredError> {
    let unknown: [(bool, &str, &str); 5] = [
        (
            settings.loss != Loss::Squares,
            "a robust loss",
            "take squares; strays and bumped marks are named in the result",
        ),
        (
            settings.board != Board::Flat,
            "the shape of a board",
            "where its marks are was measured: leave it out",
        ),
        (
            settings.profile_coverage.is_some(),
            "the profile of the cost",
            "state intervals by the standard deviations: where they mislead the result says so",
        ),
        (settings.start.is_some(), "a start for the intrinsics", "leave it out"),
        (
            settings.polish,
            "the last digits in double-double arithmetic",
            "leave it out: refinements go to rounding as it is",
        ),
    ];
    if let Some((_, what, instead)) = unknown.into_iter().find(|(asked, ..)| *asked) {
        return Err(MeasuredError::NotForTargets { what, instead });
    }
    if let Noise::Known { sigma_px } = noise
        && !(sigma_px > 0.0 && sigma_px.is_finite())
    {
        return Err(MeasuredError::BadNoise { sigma_px });
    }
    Ok(domain::check(settings)?)
}

/// Every view has marks enough, not on one line, and is no copy.
fn check_views(data: &Data) -> Result<(), MeasuredError> {
    if data.views.is_empty() {
        return Err(MeasuredError::NoViews);
    }
    for (view, list) in data.views.iter().enumerate() {
        let got = list.len();
        if got < IN_PLANE {
            return Err(MeasuredError::TooFewMarks { view, need: IN_PLANE, got });
        }
        let shape = data.shape(view);
        let position = |i: usize| data.positions[list[i].mark];
        if shape.is_line() || domain::is_line_but_for_one(got, FLAT, position) {
            return Err(MeasuredError::OnALine { view });
        }
        if got < IN_SPACE && shape.thickness() > NEARLY_FLAT {
            return Err(MeasuredError::TooFewMarks { view, need: IN_SPACE, got });
        }
    }
    data.refuse_copies()
}

/// Measurements suffice for the unknowns, and the unknowns for the equations.
fn check_counts(data: &Data, settings: &Settings) -> Result<(), MeasuredError> {
    let got = data.uncertain_marks();
    if got > MOST_UNCERTAIN_MARKS {
        return Err(MeasuredError::TooManyUncertain { got, most: MOST_UNCERTAIN_MARKS });
    }
    // Each coordinate of a mark has its own measurement.
    let unknowns = settings.free().len() - settings.priors().count() + 6 * data.views.len();
    let coordinates = 2 * data.observations();
    if coordinates < unknowns {
        return Err(CalibrationError::TooFewPoints { coordinates, unknowns }.into());
    }
    Ok(())
}

/// Starts by how the marks lie, and other cameras that explain a plane's as well.
fn starts(problem: &Problem<'_>, settings: &Settings) -> Result<(Vec<State>, Vec<Warning>), MeasuredError> {
    let shape = Shape::of(&problem.data.positions);
    if plane::is_flat(problem.data, &shape) {
        return match plane::start(problem.data, &shape, settings) {
            Ok((state, warnings)) => Ok((vec![state], warnings)),
            Err(error) if shape.thickness() <= FLAT => Err(error.into()),
            // As thin as it is known to be, but not thin: space may still tell.
            Err(error) => match space::starts(problem, settings) {
                states if states.is_empty() => Err(error.into()),
                states => Ok((states, Vec::new())),
            },
        };
    }
    let mut states = space::starts(problem, settings);
    if shape.thickness() < NEARLY_FLAT {
        states.extend(plane::start(problem.data, &shape, settings).ok().map(|(state, _)| state));
    }
    Ok((states, Vec::new()))
}
