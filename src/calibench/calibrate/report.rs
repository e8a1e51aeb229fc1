//! What does a calibration say? The estimate, how sure it is, how it fits, and what to be careful about.

use super::{
    BoardShape, Certificate, Conditioning, Covariance, Deformation, Outliers, Prior, ProfileInterval,
    Termination,
};
use crate::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use crate::geometry::{Pose, Vec2};
use std::fmt;

/// The result of a calibration.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Calibration<L = BrownConrady> {
    /// The estimate; parameters that were not free have the values they were held at.
    pub camera: Camera<L>,
    /// What was estimated. An fy that is tied to fx (`covariance.fy_per_fx`) follows and is not counted.
    pub free: FreeParameters,
    /// What was known of them beforehand; it counts in the estimate and in the covariance.
    pub priors: Vec<Prior>,
    /// One pose a view.
    pub cam_from_target: Vec<Pose>,
    /// Predicted - observed, px, view by view, point by point.
    pub residuals: Vec<Vec<Vec2>>,
    /// `sqrt(sum |r|^2 / N)` over all N points, px: as in OpenCV.
    pub rmse_px: f64,
    /// Estimated standard deviation of one pixel coordinate: `sqrt(sum |r|^2 / (2 N - p))`, px. Under a
    /// robust loss see [`Calibration::covariance`]. With priors `p` counts the unknowns less what the priors
    /// settle of them, see [`Prior`].
    pub sigma_px: f64,
    /// Degrees of freedom `2 N - p`; with priors rounded down.
    pub degrees_of_freedom: usize,
    /// First-order covariance of intrinsics and poses. Under a robust loss it is scaled by Huber's correction
    /// `K^2 [sum psi^2 / (2N - p)] / [mean psi']^2` (Huber & Ronchetti 2009, section 7.6), psi' being
    /// [`Loss::slope`](crate::calibrate::Loss::slope), `K = 1 + (p / 2N) var psi' / [mean psi']^2`.
    pub covariance: Covariance,
    /// Weakest direction of the estimate; `None` if nothing but poses was free.
    pub conditioning: Option<Conditioning>,
    /// How the refinement ended.
    pub termination: Termination,
    /// How the cost compares with its floor; `None` where a pose is undetermined. Under a robust loss it
    /// compares what the loss counts, and its probability is rough where the loss is many times as wide as
    /// the noise.
    pub certificate: Option<Certificate>,
    /// Intervals by the profile of the cost, one a free parameter; empty unless
    /// [`super::Settings::with_profile_intervals`] asked for them.
    pub intervals: Vec<ProfileInterval>,
    /// Starts that were refined: 1 where the first left no doubt.
    pub starts: usize,
    /// Refinement steps.
    pub iterations: usize,
    /// What to be careful about.
    pub warnings: Vec<Warning>,
    /// The shape of the board, where it was estimated.
    pub board: Option<BoardShape>,
}

/// Something a user should know before trusting the numbers.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Warning {
    /// The search did not end in a minimum.
    NotConverged {
        /// How it ended.
        termination: Termination,
        /// After how many steps.
        iterations: usize,
    },
    /// The minimum lies above its floor: the lens model does not fit, or a better minimum was not found.
    AboveFloor {
        /// Root mean square error, px; with a robust loss the root of the mean loss.
        rmse_px: f64,
        /// That of free homographies behind the same lens, px.
        floor_rmse_px: f64,
        /// Upper bound of the probability of such a difference by chance.
        p_value: f64,
        /// Starts of the search, none of which ended lower.
        starts: usize,
    },
    /// Views that were given more than once, and were counted once.
    Duplicates {
        /// One such view.
        view: usize,
        /// The view it is a copy of.
        copy_of: usize,
        /// How many copies there are in all.
        copies: usize,
    },
    /// Marks that were given more than once in a view, and were counted once.
    RepeatedMarks {
        /// How many copies there are in all.
        marks: usize,
        /// View of the first.
        view: usize,
        /// Its number there.
        point: usize,
    },
    /// Nothing certifies the minimum: free homographies leave no degrees of freedom.
    NotCertified,
    /// So few degrees of freedom that intervals are wider than the standard deviations suggest.
    FewDegreesOfFreedom {
        /// How many.
        degrees_of_freedom: usize,
        /// Standard deviations that an interval of 95 % reaches (Student 1908); 1.96 where they are many.
        student: f64,
    },
    /// Views whose target may as well be tilted the other way.
    TwinPose {
        /// The view whose other tilt costs least.
        view: usize,
        /// How many such views there are.
        views: usize,
        /// By how many degrees its plane is turned there.
        degrees: f64,
        /// By how many variances its cost is higher there.
        excess: f64,
    },
    /// Views that show the target from its other side than most do.
    FromBehind {
        /// The first.
        view: usize,
        /// How many.
        views: usize,
    },
    /// A few marks lie so far from where they should that they are no noise.
    Outliers(Outliers),
    /// Another camera explains the data nearly as well: the standard deviations speak of this one only.
    Ambiguous {
        /// The parameter that differs most.
        parameter: Parameter,
        /// Its value here.
        value: f64,
        /// Its value there.
        other: f64,
        /// By how many variances the cost is higher there.
        excess: f64,
    },
    /// A standard deviation that misleads: two of them away the cost is no parabola any more.
    NotLinear {
        /// Of which parameter.
        parameter: Parameter,
        /// True half-width of an interval of two standard deviations over the linear one, below the estimate;
        /// none where the cost never rises.
        below: Option<f64>,
        /// The same above.
        above: Option<f64>,
    },
    /// Residuals of neighbouring marks agree: something that is no noise is left out of the model.
    Structured {
        /// Correlation coefficient of a mark's residual with the next one's.
        correlation: f64,
    },
    /// Parameters that are held because nobody asked for them, at a value other than 0, or of the principal
    /// point and skew at all, and that the marks ask for; one that is known too well for the marks to move it
    /// counts as held.
    LeftOut {
        /// Which.
        parameters: Vec<Parameter>,
        /// By how many variances the cost would fall with them.
        fall: f64,
        /// How likely chance makes so much for a camera without them.
        probability: f64,
    },
    /// The board is taken to be flat, or to have no twist, and the marks ask for one that is bent: two bows
    /// and a twist as in [`super::BoardShape`], in the target's unit, to first order.
    NotFlat {
        /// Height of the middle over the edges in x.
        bow_x: f64,
        /// The same in y.
        bow_y: f64,
        /// Height of the corners where `x y = 1`.
        twist: f64,
        /// By how many variances the cost would fall with them.
        fall: f64,
        /// How likely chance makes so much for a flat board.
        probability: f64,
    },
    /// Two parameters cannot be told apart well: an error of one is made up by the other.
    Correlated {
        /// One.
        a: Parameter,
        /// The other.
        b: Parameter,
        /// Correlation coefficient.
        correlation: f64,
    },
    /// A combination of parameters that hardly changes the picture: known worse than each of them alone by a
    /// factor of a million or more.
    HardlySeparable {
        /// Those that take part, the strongest first.
        parameters: Vec<Parameter>,
    },
    /// A focal length known only roughly; its standard deviation, being first-order, is itself rough.
    FocalLengthUncertain {
        /// Which.
        parameter: Parameter,
        /// Standard deviation over value.
        relative: f64,
    },
    /// The lens model folds back inside the image.
    FoldsInsideImage {
        /// Radius, in normalised coordinates, beyond which the model is not one-to-one.
        monotone_radius: f64,
        /// Largest radius of an observed point.
        largest_observed: f64,
    },
    /// The lens model folds back within the view.
    FoldsInsideView {
        /// Angle from the axis, degrees, beyond which the model is not one-to-one.
        monotone_angle: f64,
        /// Largest angle of an observed point, degrees.
        largest_observed: f64,
    },
    /// A coefficient came out at a value for which its model is not defined.
    OutsideRange {
        /// Which.
        parameter: Parameter,
        /// Its value.
        value: f64,
        /// The least value of the model's definition.
        low: f64,
        /// The largest one.
        high: f64,
    },
    /// The pixels and what was known beforehand do not go together: one of the two is wrong.
    Contradicted {
        /// Of which parameter.
        parameter: Parameter,
        /// The value known beforehand.
        mean: f64,
        /// Its standard deviation.
        standard_deviation: f64,
        /// The estimate, between the two.
        estimate: f64,
        /// By how many standard deviations of their difference they disagree.
        deviations: f64,
    },
    /// The marks and what was known of the board's shape beforehand do not go together: one of the two is
    /// wrong.
    BoardContradicted {
        /// Of which deformation, the one that contradicts most.
        deformation: Deformation,
        /// The standard deviation known beforehand, about 0, in the target's unit.
        standard_deviation: f64,
        /// The estimate, between the two.
        estimate: f64,
        /// By how many standard deviations of their difference they disagree.
        deviations: f64,
    },
    /// No residual degrees of freedom: the fit is exact whatever the noise, and no standard deviation can be
    /// told.
    NoDegreesOfFreedom,
    /// The last digits were asked for, and the steps towards them did not shrink: the estimate is the
    /// refinement's.
    NotPolished,
}

/// Beyond this two parameters share 96 % of their variance; k1 and k2 of an ordinary set of views stay below
/// it.
pub(super) const STRONG_CORRELATION: f64 = 0.98;
/// A focal length worse than this makes the linearisation behind the covariance doubtful.
pub(super) const UNCERTAIN_FOCAL: f64 = 0.05;

/// A number with two significant digits at the least, as a user may type it.
pub(super) fn digits(number: f64) -> String {
    if number >= 0.1 { format!("{number:.2}") } else { format!("{number:.1e}") }
}

/// The same of a number of either sign, which is told.
fn signed(number: f64) -> String {
    format!("{}{}", if number < 0.0 { '-' } else { '+' }, digits(number.abs()))
}

/// How far a true interval reaches, over the linear one.
pub(super) fn reach(ratio: Option<f64>) -> String {
    match ratio {
        None => "without end".to_string(),
        // Also where two standard deviations away there is no camera at all.
        Some(ratio) if ratio < 0.01 => "less than 0.01 times as far".to_string(),
        Some(ratio) => format!("{ratio:.2} times as far"),
    }
}

/// A larger part of the marks than this goes astray by itself seldom.
const MANY: f64 = 0.1;

/// Real boards leave the RMSE up to a seventh above its floor, wrong minima of consequence lie more than a
/// third above.
const GROSS: f64 = 1.25;

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::NotConverged { termination, iterations } => {
                write!(
                    f,
                    "the search did not end in a minimum ({} after {iterations} steps): the estimate may be off by more than its \
                     standard deviations",
                    termination.name()
                )
            }
            Warning::AboveFloor { rmse_px, floor_rmse_px, p_value, starts } => {
                let advice = if *rmse_px > GROSS * floor_rmse_px {
                    "do not use the result: check the board's geometry (spacing in both directions, order of the marks) and the values \
                     held; if they are right, take more views, with evident tilts"
                } else {
                    "the model does not explain the marks: is the board flat and its geometry right, is the lens model rich enough?"
                };
                write!(
                    f,
                    "no other of {starts} starts ended lower, but homographies behind the same lens reach {floor_rmse_px:.4} px where the \
                     calibration has {rmse_px:.4} px (by chance with probability {p_value:.1e}): {advice}"
                )
            }
            Warning::Duplicates { view, copy_of, copies } => write!(
                f,
                "view {view} is a copy of view {copy_of}{}: copies say nothing new and were counted once",
                if *copies > 1 { format!(", and there are {copies} copies in all") } else { String::new() }
            ),
            Warning::RepeatedMarks { marks, view, point } => write!(
                f,
                "{marks} mark(s) were given more than once in their view, the first (view {view}, point {point}): they were counted once"
            ),
            Warning::NotCertified => f.write_str(
                "nothing certifies this minimum: with so few marks and views free homographies fit as well whatever the camera, so neither \
                 the lens model nor the search could be checked",
            ),
            Warning::FewDegreesOfFreedom { degrees_of_freedom, student } => write!(
                f,
                "the standard deviations rest on {degrees_of_freedom} degrees of freedom: an interval of 95 % reaches {student:.2} of them, not 1.96"
            ),
            Warning::TwinPose { view, views, degrees, excess } => write!(
                f,
                "the target of view {view} may as well be tilted the other way, turned by {degrees:.0} degrees ({excess:.1} variances \
                 more){}: the standard deviations of such a pose speak of one of its two tilts only",
                if *views > 1 { format!(", and {views} views in all are like it") } else { String::new() }
            ),
            Warning::FromBehind { view, views } => write!(
                f,
                "view {view}{} shows the target from its other side: is the order of its marks that of the others?",
                if *views > 1 { format!(" (and {views} views in all)") } else { String::new() }
            ),
            Warning::Outliers(Outliers { marks, share, view, point, residual_px, median_px }) => write!(
                f,
                "{marks} mark(s) lie too far off to be noise, the worst (view {view}, point {point}) by {residual_px:.2} px where half of all \
                 stay below {median_px:.2} px: correct or remove them, or use a robust loss (huber:{}){}",
                digits(2.0 * median_px),
                if *share > MANY { "; so many may also mean that lens model or board do not hold there" } else { "" }
            ),
            Warning::Ambiguous { parameter, value, other, excess } => write!(
                f,
                "another camera explains the data nearly as well: {parameter} = {other:.6} instead of {value:.6} costs {:.1} variances \
                 {}; standard deviations and intervals speak of one of the two only. Take more views, with tilts about different axes",
                excess.abs(),
                if *excess < 0.0 { "less" } else { "more" }
            ),
            Warning::NotLinear { parameter, below, above } => write!(
                f,
                "the standard deviation of {parameter} misleads: an interval of two of them truly reaches {} below and {} above; state \
                 that one, or one by the profile of the cost",
                reach(*below),
                reach(*above)
            ),
            Warning::Structured { correlation } => write!(
                f,
                "residuals of neighbouring marks agree (correlation {correlation:+.2}), which noise does not: the model leaves something out (a richer \
                 lens, a board that is not flat or not as given, noise that marks share), and the standard deviations are too small"
            ),
            Warning::LeftOut { parameters, fall, probability } => {
                let names: Vec<&str> = parameters.iter().map(|parameter| parameter.name()).collect();
                let them = if names.len() == 1 { "it" } else { "them" };
                let held = if names.len() == 1 { "it is held or tied" } else { "they are held or tied" };
                write!(
                    f,
                    "the marks ask for {}, but {held}, or known too well to move: the cost would fall by {fall:.0} variances, by chance \
                     with probability {probability:.1e}; estimate {them} too, as the other parameters make up for {them}",
                    names.join(" and ")
                )
            }
            Warning::NotFlat { bow_x, bow_y, twist, fall, probability } => write!(
                f,
                "the marks ask for a board that is bent, or bent otherwise: with its middle {} higher than its edges in x and {} in y, and corners twisted by {} \
                 (in its unit, to first order), the cost would fall by {fall:.0} variances, by chance with probability {probability:.1e}; estimate \
                 its shape too, as the camera makes up for it",
                signed(*bow_x),
                signed(*bow_y),
                signed(*twist)
            ),
            Warning::Correlated { a, b, correlation } => write!(
                f,
                "{a} and {b} are correlated {correlation:+.4}: the data hardly tell them apart; cover the image corners, or \
                 hold one of them"
            ),
            Warning::HardlySeparable { parameters } => {
                let names: Vec<&str> = parameters.iter().map(|parameter| parameter.name()).collect();
                write!(
                    f,
                    "together {} hardly change the picture: their standard deviations mean little; hold one of them, estimate fewer \
                     coefficients, or take the intervals of the profile",
                    names.join(", ")
                )
            }
            Warning::FocalLengthUncertain { parameter, relative } => write!(
                f,
                "{parameter} is known to {:.0} % only: tilt the target more, about different axes",
                100.0 * relative
            ),
            Warning::FoldsInsideView { monotone_angle, largest_observed } => write!(
                f,
                "the lens model folds back {monotone_angle:.1} degrees from the axis, and points were seen out to {largest_observed:.1} \
                 degrees: do not use it near or beyond that angle; free fewer coefficients or take another model"
            ),
            Warning::FoldsInsideImage { monotone_radius, largest_observed } => write!(
                f,
                "the lens model folds back at normalised radius {monotone_radius:.3}, and points were seen out to \
                 {largest_observed:.3}: it must not be used beyond them"
            ),
            Warning::OutsideRange { parameter, value, low, high } => write!(
                f,
                "{parameter} is {value:.4}, and its model is defined from {low} to {high}: other programs may refuse the camera; take \
                 another model"
            ),
            Warning::Contradicted { parameter, mean, standard_deviation, estimate, deviations } => write!(
                f,
                "the marks contradict what is known of {parameter} beforehand, {mean} +- {standard_deviation}: with both it is {estimate:.6}, and \
                 they disagree by {deviations:.1} standard deviations; one of the two is wrong"
            ),
            Warning::BoardContradicted { deformation, standard_deviation, estimate, deviations } => write!(
                f,
                "the marks contradict what is known of the board's shape beforehand, {deformation} 0 +- {standard_deviation}: with both it is {}, and \
                 they disagree by {deviations:.1} standard deviations; one of the two is wrong, and the camera makes up for it",
                signed(*estimate)
            ),
            Warning::NoDegreesOfFreedom => f.write_str(
                "as many unknowns as measurements: the fit is exact and says nothing about its accuracy",
            ),
            Warning::NotPolished => f.write_str(
                "the last digits could not be had: undamped steps from the minimum do not shrink; the estimate is that of an \
                 ordinary calibration",
            ),
        }
    }
}

impl<L> Calibration<L> {
    /// Whether the estimate is a minimum whose RMSE, as its [`Certificate`] counts it, lies no more than a
    /// quarter above its floor: beyond that it is another minimum than the right one, or a model that has
    /// little to do with the data.
    pub fn is_usable(&self) -> bool {
        let is_gross = |c: &Certificate| !c.holds() && c.rmse_px > GROSS * c.floor_rmse_px;
        self.termination.is_minimum() && !self.certificate.as_ref().is_some_and(is_gross)
    }

    /// Standard deviation of an estimated parameter; `None` if it was held.
    pub fn standard_deviation(&self, parameter: Parameter) -> Option<f64> {
        self.covariance.standard_deviation(parameter)
    }

    /// Number of points over all views.
    pub fn points(&self) -> usize {
        self.residuals.iter().map(Vec::len).sum()
    }

    /// RMSE of one view, per point, px.
    pub fn view_rmse_px(&self, view: usize) -> Option<f64> {
        self.residuals.get(view).map(|r| rms(r.iter()))
    }

    /// Root mean square of u and of v residuals apart, px: the definition of programs that report one number
    /// an axis.
    pub fn rms_per_axis_px(&self) -> Vec2 {
        let sums = self.residuals.iter().flatten().fold(Vec2::zeros(), |s, r| s + r.component_mul(r));
        (sums / self.points() as f64).map(f64::sqrt)
    }
}

/// `sqrt(mean |r|^2)`.
fn rms<'a>(residuals: impl ExactSizeIterator<Item = &'a Vec2>) -> f64 {
    let count = residuals.len() as f64;
    (residuals.map(|r| r.norm_squared()).sum::<f64>() / count).sqrt()
}

#[cfg(all(test, feature = "serde", feature = "io"))]
mod tests {
    use super::signed;
    use crate::board::View;
    use crate::calibrate::{Calibration, CalibrationError, Conditioning, Loss, Settings, Warning, calibrate};
    use crate::calibrate::{Certificate, Termination};
    use crate::camera::{BrownConrady, Camera, Parameter};
    use crate::geometry::{Pose, Vec2, Vec3, rotation};
    use serde::{Serialize, de::DeserializeOwned};

    fn views(turns: &[[f64; 3]]) -> Vec<View> {
        let camera =
            Camera::pinhole(600.0, 590.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.2, 0.1));
        let points: Vec<Vec2> =
            (0..35).map(|i| Vec2::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0) * 12.0).collect();
        let view = |(number, turn): (usize, &[f64; 3])| {
            let pose = Pose {
                rotation: rotation::from_xyz_rad(turn[0], turn[1], turn[2]),
                translation: Vec3::new(2.0, -3.0, 120.0 + 9.0 * number as f64),
            };
            // A wave for noise: residuals, and so a covariance, that are not 0.
            let error = |i: usize| 0.1 * Vec2::new(libm::sin(7.0 * i as f64), libm::cos(5.0 * i as f64));
            let image = |(i, p): (usize, &Vec2)| {
                camera.project(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).map(|pixel| pixel + error(i))
            };
            let pixels = points.iter().enumerate().map(image).collect::<Option<Vec<Vec2>>>().unwrap();
            View::new(points.clone(), pixels).unwrap()
        };
        turns.iter().enumerate().map(view).collect()
    }

    /// What a value is after the way through JSON.
    fn there_and_back<T: Serialize + DeserializeOwned>(value: &T) -> T {
        serde_json::from_str(&serde_json::to_string(value).unwrap()).unwrap()
    }

    #[test]
    fn an_interval_without_end_is_said_and_kept() {
        let warning = Warning::NotLinear { parameter: Parameter::Fx, below: Some(0.8), above: None };
        assert_eq!(there_and_back(&warning), warning);
        assert!(warning.to_string().contains("truly reaches 0.80 times as far below and without end above"));
    }

    #[test]
    fn serde_keeps_a_calibration_and_what_it_was_asked_to_the_bit() {
        let settings = Settings::standard()
            .with_image_size((640, 480))
            .with_loss(Loss::Huber { delta_px: 0.5 })
            .hold(Parameter::K2, 0.1)
            .with_profile_intervals(0.95);
        assert_eq!(there_and_back(&settings), settings);
        let views = views(&[[0.3, 0.0, 0.1], [0.0, -0.3, 0.0], [-0.2, 0.25, 0.4]]);
        let calibration: Calibration = calibrate(&views, &settings).unwrap();
        assert_eq!(there_and_back(&calibration), calibration);
        let conditioning: Conditioning = calibration.conditioning.unwrap();
        assert_eq!(there_and_back(&conditioning), conditioning);
    }

    #[test]
    fn serde_keeps_a_refusal_with_its_reason() {
        let facing = views(&[[0.0; 3], [0.0, 0.0, 0.3], [0.0, 0.0, -0.2]]);
        let refusals = [
            calibrate(&facing, &Settings::standard()).map(|r| r.camera).unwrap_err(),
            calibrate(&facing[..1], &Settings::standard()).map(|r| r.camera).unwrap_err(),
        ];
        assert!(matches!(refusals[0], CalibrationError::NotIdentifiable { .. }), "{}", refusals[0]);
        for refusal in refusals {
            assert_eq!(there_and_back(&refusal), refusal);
        }
    }

    #[test]
    fn serde_refuses_a_covariance_whose_blocks_do_not_fit() {
        let text = r#"{"free": "fx,fy", "intrinsics": [[1.0]], "poses": [], "cross": []}"#;
        let error = serde_json::from_str::<crate::calibrate::Covariance>(text).unwrap_err();
        assert!(error.to_string().contains("other sizes"), "{error}");
    }

    #[test]
    fn serde_refuses_a_covariance_whose_rows_are_not_of_one_length() {
        let text = r#"{"free": "fx,fy", "intrinsics": [[1.0, 0.0], [0.0]], "poses": [], "cross": []}"#;
        assert!(serde_json::from_str::<crate::calibrate::Covariance>(text).is_err());
    }

    /// A calibration of three views.
    fn calibration() -> Calibration {
        let views = views(&[[0.3, 0.0, 0.1], [0.0, -0.3, 0.0], [-0.2, 0.25, 0.4]]);
        calibrate(&views, &Settings::standard().hold(Parameter::K2, 0.1)).unwrap()
    }

    #[test]
    fn the_rmse_of_a_view_is_that_of_its_own_points() {
        let mut found = calibration();
        found.residuals = vec![vec![Vec2::new(1.0, 1.0)], vec![Vec2::new(3.0, 4.0), Vec2::new(-5.0, 0.0)]];
        assert_eq!((found.view_rmse_px(1), found.view_rmse_px(2)), (Some(5.0), None));
    }

    #[test]
    fn a_minimum_a_quarter_above_its_floor_is_not_to_be_used() {
        let mut found = calibration();
        let certificate = found.certificate.unwrap();
        for (rmse_px, p_value, termination, is_usable) in [
            (0.125, 0.0, Termination::AboveFloor, false),
            (0.115, 0.0, Termination::AboveFloor, true),
            // By chance, as of few marks.
            (0.125, 0.1, Termination::Converged, true),
            (0.1, 0.5, Termination::IterationLimit, false),
        ] {
            found.certificate = Some(Certificate { rmse_px, floor_rmse_px: 0.095, p_value, ..certificate });
            found.termination = termination;
            assert_eq!(found.is_usable(), is_usable, "{rmse_px} {p_value}");
        }
    }

    #[test]
    fn a_number_of_either_sign_is_told_with_it() {
        assert_eq!([-0.25, 0.25, 0.0031, -0.0031].map(signed), ["-0.25", "+0.25", "+3.1e-3", "-3.1e-3"]);
    }

    #[test]
    fn advice_depends_on_how_far_above_its_floor_a_minimum_lies() {
        let told = |rmse_px: f64| {
            Warning::AboveFloor { rmse_px, floor_rmse_px: 0.1, p_value: 1e-9, starts: 7 }.to_string()
        };
        assert!(
            told(0.126).contains("do not use the result") && !told(0.124).contains("do not use the result")
        );
    }

    #[test]
    fn one_parameter_left_out_is_told_of_in_the_singular() {
        let told = |parameters: Vec<Parameter>| {
            Warning::LeftOut { parameters, fall: 100.0, probability: 1e-9 }.to_string()
        };
        assert!(told(vec![Parameter::K3]).contains("ask for k3, but it is held or tied"));
        assert!(
            told(vec![Parameter::P1, Parameter::P2]).contains("ask for p1 and p2, but they are held or tied")
        );
    }
}
