//! Where has a part moved to? A map of the plane from its taught to its found marks, and how well it is known
//! at any point.
//!
//! ```text
//! found = A taught + t
//! ```
//!
//! `A` is a rotation (rigid), a rotation times a scale (similarity) or any matrix (affine). Marks may be
//! known with standard deviations on both sides; the estimate is then that of maximum likelihood with errors
//! in both.

mod fit;
mod start;

use crate::calibrate::Loss;
use crate::evaluate::distribution::ChiSquare;
use crate::geometry::{LinearFitError, Mat3, Vec2};
use nalgebra::{DMatrix, DVector, Matrix2};

/// The family of maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum MapModel {
    /// Turned and shifted: three parameters.
    Rigid,
    /// Turned, scaled and shifted: four parameters.
    Similarity,
    /// Any linear map and a shift: six parameters.
    Affine,
}

impl MapModel {
    /// Number of parameters.
    pub fn parameters(self) -> usize {
        match self {
            MapModel::Rigid => 3,
            MapModel::Similarity => 4,
            MapModel::Affine => 6,
        }
    }

    /// Fewest marks that fix the map.
    pub fn least_marks(self) -> usize {
        match self {
            MapModel::Rigid | MapModel::Similarity => 2,
            MapModel::Affine => 3,
        }
    }
}

/// A mark of the part: where it is, and how well that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mark {
    /// Its place, in any unit.
    pub at: Vec2,
    /// Standard deviations of both coordinates, in the same unit; 0 for a place that is given, as on a
    /// drawing.
    pub deviations: Vec2,
}

impl Mark {
    /// A mark of which nothing more is known.
    pub fn at(x: f64, y: f64) -> Mark {
        Mark { at: Vec2::new(x, y), deviations: Vec2::zeros() }
    }

    /// The same mark with one standard deviation for both coordinates.
    pub fn with_deviation(self, deviation: f64) -> Mark {
        Mark { deviations: Vec2::new(deviation, deviation), ..self }
    }

    /// Diagonal of the variances.
    fn covariance(&self) -> Matrix2<f64> {
        Matrix2::from_diagonal(&self.deviations.component_mul(&self.deviations))
    }
}

/// Why a part cannot be registered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegistrationError {
    /// The lists differ in length.
    #[error("{taught} taught marks but {found} found ones: each needs its partner")]
    Lengths {
        /// Number of taught marks.
        taught: usize,
        /// Number of found marks.
        found: usize,
    },
    /// Not enough marks for the map.
    #[error("the map needs at least {need} marks, got {got}")]
    TooFewMarks {
        /// Least number.
        need: usize,
        /// Number given.
        got: usize,
    },
    /// A number is NaN or infinite.
    #[error("{side} mark {index} is not finite")]
    NotFinite {
        /// `taught` or `found`.
        side: &'static str,
        /// Position in the list.
        index: usize,
    },
    /// A standard deviation is below 0.
    #[error("{side} mark {index} has the standard deviation {value}: it must not be negative")]
    NegativeDeviation {
        /// `taught` or `found`.
        side: &'static str,
        /// Position in the list.
        index: usize,
        /// The value.
        value: f64,
    },
    /// Some marks have standard deviations and this one has none on either side.
    #[error("mark {index} is known exactly on both sides while others are not: give it a standard deviation")]
    NoDeviation {
        /// Position in the list.
        index: usize,
    },
    /// All marks of one side in one place.
    #[error("the {marks} {side} marks coincide: they fix no direction")]
    Coincident {
        /// `taught` or `found`.
        side: &'static str,
        /// Number of marks.
        marks: usize,
    },
    /// The marks fix no affine map.
    #[error("the affine map is not fixed: {0}")]
    Affine(LinearFitError),
    /// Found marks that are a mirror image, which no rotation makes.
    #[error(
        "the found part is the mirror image of the taught one (a mirrored map leaves {mirrored_rms:.3e} RMS, a turned one {turned_rms:.3e}): is the \
         part upside down, or an axis reversed?"
    )]
    Mirrored {
        /// RMS that the best mirrored similarity leaves.
        mirrored_rms: f64,
        /// RMS that the best turned similarity leaves.
        turned_rms: f64,
    },
    /// The best of all maps of the family is none: no direction, a scale of zero, or a plane onto a line.
    #[error("the marks fix no map: taught and found do not correspond; check which mark is which")]
    Singular,
    /// The loss has no positive scale.
    #[error("the scale of the loss must be positive and finite")]
    Loss,
    /// The iteration did not settle.
    #[error("the fit did not settle in {iterations} steps: too many marks lie astray for this loss")]
    NotConverged {
        /// Number of steps.
        iterations: usize,
    },
}

/// The map from taught to found marks.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Registration {
    /// The family that was fitted.
    pub model: MapModel,
    /// `A`.
    pub linear: Matrix2<f64>,
    /// Mean of the taught marks.
    pub taught_centre: Vec2,
    /// Where the map takes it.
    pub found_centre: Vec2,
    /// Predicted minus found, mark by mark.
    pub residuals: Vec<Vec2>,
    /// Weight of each mark under the loss: 1 where nothing is held against it.
    pub weights: Vec<f64>,
    /// `sqrt(mean |r|^2)`, per mark.
    pub rms: f64,
    /// `2 N - p`.
    pub degrees_of_freedom: usize,
    /// Whether standard deviations of the marks were given; otherwise the residuals estimate one for all.
    pub deviations_given: bool,
    /// Standard deviation of a coordinate, estimated from the residuals, in the marks' unit; where deviations
    /// were given, the factor by which the residuals exceed them. `None` without degrees of freedom.
    pub sigma: Option<f64>,
    /// Sum of the squared residuals over their variances, for given deviations and squares.
    pub chi_squared: Option<f64>,
    /// Steps of the fit.
    pub iterations: usize,
    /// Unit of the parameters of `covariance` other than the shift: RMS distance of the taught marks from
    /// their mean.
    radius: f64,
    /// Covariance of the parameters, p x p; `None` where nothing tells the noise.
    #[cfg_attr(feature = "serde", serde(with = "crate::rows::if_any"))]
    covariance: Option<DMatrix<f64>>,
}

/// Registers a found part on a taught one: the map of the family that minimises
/// `sum rho(r^T (S_found + A S_taught A^T)^-1 r)`, `r = A taught + t - found`.
///
/// The start is the closed form of Kabsch 1976 and Umeyama 1991 (eqs. 40 to 43) with weights; for an affine
/// map linear least squares. Gauss-Newton steps follow, in which errors of the taught marks are adjusted as
/// in the general least-squares model (Deming 1943), and reweighting for a robust loss (Huber 1964). The
/// scale of the loss counts standard deviations where they are given, otherwise the marks' unit.
///
/// The covariance is `(J^T W J)^-1`: with given deviations as it stands, without them times the residual
/// variance on `2 N - p` degrees of freedom, and under a robust loss times Huber's correction (Huber 1981,
/// section 7.6).
///
/// # Errors
/// See [`RegistrationError`].
///
/// ```
/// use calibench::calibrate::Loss;
/// use calibench::downstream::{MapModel, Mark, register};
///
/// let taught = [Mark::at(0.0, 0.0), Mark::at(100.0, 0.0), Mark::at(0.0, 50.0)];
/// // Turned by a quarter, shifted by (5, 7), found to 0.01 mm.
/// let found = [(5.0, 7.0), (5.0, 107.0), (-45.0, 7.0)].map(|(x, y)| Mark::at(x, y).with_deviation(0.01));
/// let map = register(MapModel::Rigid, &taught, &found, Loss::Squares)?;
/// assert!((map.angle_rad().to_degrees() - 90.0).abs() < 1e-12);
/// // Far from the marks the angle's uncertainty counts: 0.01 mm over some 60 mm, 1000 mm away.
/// let far = map.covariance_at(&calibench::geometry::Vec2::new(1000.0, 0.0)).expect("deviations are given");
/// assert!(far.trace().sqrt() > 0.09);
/// # Ok::<(), calibench::downstream::RegistrationError>(())
/// ```
pub fn register(
    model: MapModel,
    taught: &[Mark],
    found: &[Mark],
    loss: Loss,
) -> Result<Registration, RegistrationError> {
    let deviations_given = checked(model, taught, found, loss)?;
    let pairs = fit::Pairs::new(taught, found, deviations_given);
    let begun = start::start(model, &pairs)?;
    fit::refine(model, &pairs, begun, loss, deviations_given)
}

/// Whether standard deviations are given, once every mark is known to be one.
fn checked(model: MapModel, taught: &[Mark], found: &[Mark], loss: Loss) -> Result<bool, RegistrationError> {
    if taught.len() != found.len() {
        return Err(RegistrationError::Lengths { taught: taught.len(), found: found.len() });
    }
    if taught.len() < model.least_marks() {
        return Err(RegistrationError::TooFewMarks { need: model.least_marks(), got: taught.len() });
    }
    if !loss.is_valid() {
        return Err(RegistrationError::Loss);
    }
    for (side, marks) in [("taught", taught), ("found", found)] {
        for (index, mark) in marks.iter().enumerate() {
            if mark.at.iter().chain(&mark.deviations).any(|x| !x.is_finite()) {
                return Err(RegistrationError::NotFinite { side, index });
            }
            let value = mark.deviations.min();
            if value < 0.0 {
                return Err(RegistrationError::NegativeDeviation { side, index, value });
            }
        }
        if marks.iter().all(|mark| mark.at == marks[0].at) {
            return Err(RegistrationError::Coincident { side, marks: marks.len() });
        }
    }
    let is_exact = |(t, f): (&Mark, &Mark)| (t.deviations + f.deviations).min() == 0.0;
    let exact: Vec<usize> = (0..taught.len()).filter(|&i| is_exact((&taught[i], &found[i]))).collect();
    let all_exact = taught.iter().chain(found).all(|mark| mark.deviations == Vec2::zeros());
    match exact.first() {
        Some(_) if all_exact => Ok(false),
        Some(&index) => Err(RegistrationError::NoDeviation { index }),
        None => Ok(true),
    }
}

impl Registration {
    /// Where a taught point is found.
    pub fn apply(&self, taught: &Vec2) -> Vec2 {
        self.linear * (taught - self.taught_centre) + self.found_centre
    }

    /// `[[A, t], [0, 0, 1]]`.
    pub fn matrix(&self) -> Mat3 {
        let (a, t) = (&self.linear, self.apply(&Vec2::zeros()));
        Mat3::new(a[(0, 0)], a[(0, 1)], t.x, a[(1, 0)], a[(1, 1)], t.y, 0.0, 0.0, 1.0)
    }

    /// Angle of the rotation nearest to `A`, `atan2(a21 - a12, a11 + a22)`, rad.
    pub fn angle_rad(&self) -> f64 {
        let a = &self.linear;
        libm::atan2(a[(1, 0)] - a[(0, 1)], a[(0, 0)] + a[(1, 1)])
    }

    /// Ratio of lengths, `sqrt(|det A|)`: 1 for a rigid map.
    pub fn scale(&self) -> f64 {
        self.linear.determinant().abs().sqrt()
    }

    /// Covariance of the found position of a taught point, in squares of the marks' unit: what the map adds
    /// to the error of the point itself. `None` where nothing tells the noise.
    pub fn covariance_at(&self, taught: &Vec2) -> Option<Matrix2<f64>> {
        let jacobian = self.jacobian((taught - self.taught_centre) / self.radius);
        let product = &jacobian * self.covariance.as_ref()? * jacobian.transpose();
        Some(product.fixed_view::<2, 2>(0, 0).into_owned())
    }

    /// Standard deviation of the angle, rad.
    pub fn angle_deviation_rad(&self) -> Option<f64> {
        let a = &self.linear;
        let (sine, cosine) = (a[(1, 0)] - a[(0, 1)], a[(0, 0)] + a[(1, 1)]);
        let square = sine * sine + cosine * cosine;
        self.deviation_of(|d| (cosine * (d[(1, 0)] - d[(0, 1)]) - sine * (d[(0, 0)] + d[(1, 1)])) / square)
    }

    /// Standard deviation of the scale: 0 for a rigid map.
    pub fn scale_deviation(&self) -> Option<f64> {
        let inverse = self.linear.try_inverse()?;
        self.deviation_of(|d| 0.5 * self.scale() * (inverse * d).trace())
    }

    /// Degrees of freedom of the noise behind the covariance; `None` where the noise was given.
    pub fn noise_freedom(&self) -> Option<usize> {
        let is_estimated = !self.deviations_given || self.weights.iter().any(|w| *w != 1.0);
        is_estimated.then_some(self.degrees_of_freedom)
    }

    /// Probability of residuals as large or larger if the given deviations are right.
    pub fn p_value(&self) -> Option<f64> {
        let chi_squared = self.chi_squared.filter(|_| self.degrees_of_freedom > 0)?;
        Some(ChiSquare::new(self.degrees_of_freedom).survival(chi_squared))
    }

    /// Standard deviation of a function of `A`, by its change with a change of `A`.
    fn deviation_of(&self, change: impl Fn(&Matrix2<f64>) -> f64) -> Option<f64> {
        let covariance = self.covariance.as_ref()?;
        let directions = fit::directions(self.model, &self.linear);
        let gradient = DVector::from_iterator(
            directions.len(),
            directions.iter().map(|(linear, _)| change(&(linear / self.radius))),
        );
        Some((covariance * &gradient).dot(&gradient).max(0.0).sqrt())
    }

    /// How the found position moves with the parameters, 2 x p, at an offset from the centre in units of the
    /// radius.
    fn jacobian(&self, offset: Vec2) -> DMatrix<f64> {
        fit::jacobian(&fit::directions(self.model, &self.linear), &offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{Stream, StreamKey};
    use proptest::prelude::*;

    const MODELS: [MapModel; 3] = [MapModel::Rigid, MapModel::Similarity, MapModel::Affine];

    /// Six marks of a part some 100 mm wide, far from the origin of the machine.
    fn part() -> Vec<Vec2> {
        [(0.0, 0.0), (100.0, 3.0), (95.0, 60.0), (4.0, 55.0), (50.0, 30.0), (20.0, 48.0)]
            .map(|(x, y)| Vec2::new(x + 4000.0, y - 2500.0))
            .to_vec()
    }

    fn exact(points: &[Vec2]) -> Vec<Mark> {
        points.iter().map(|p| Mark::at(p.x, p.y)).collect()
    }

    /// A map of the family.
    fn truth(model: MapModel, angle: f64, scale: f64) -> impl Fn(&Vec2) -> Vec2 {
        let scale = if model == MapModel::Rigid { 1.0 } else { scale };
        let (sine, cosine) = (scale * libm::sin(angle), scale * libm::cos(angle));
        let shear = if model == MapModel::Affine { 0.3 } else { 0.0 };
        let linear = Matrix2::new(cosine, -sine + shear, sine, cosine);
        move |p| linear * (p - Vec2::new(4050.0, -2470.0)) + Vec2::new(12.0, 700.0)
    }

    proptest! {
        #[test]
        fn a_map_without_noise_is_found_to_rounding(angle in -3.1f64..3.1, scale in 0.2f64..3.0) {
            for model in MODELS {
                let map = truth(model, angle, scale);
                let found: Vec<Vec2> = part().iter().map(&map).collect();
                let fit = register(model, &exact(&part()), &exact(&found), Loss::Squares).unwrap();
                // Coordinates of 4000 are rounded to 5e-13.
                let far = Vec2::new(4300.0, -2100.0);
                prop_assert!((fit.apply(&far) - map(&far)).norm() < 2e-11, "{model:?}");
                prop_assert!(fit.rms < 5e-12);
                if model != MapModel::Affine {
                    prop_assert!((fit.angle_rad() - angle).abs() < 1e-13);
                }
            }
        }
    }

    /// Marks with errors on both sides, those of each mark of another size and those of x and y too.
    fn drawn(model: MapModel, stream: &mut Stream) -> (Vec<Mark>, Vec<Mark>) {
        let map = truth(model, 0.7, 1.4);
        let mut noisy = |p: Vec2, deviations: Vec2| Mark {
            at: p + Vec2::new(deviations.x * stream.normal(), deviations.y * stream.normal()),
            deviations,
        };
        part()
            .into_iter()
            .enumerate()
            .map(|(i, p)| {
                let size = 0.01 * (1.0 + i as f64);
                (noisy(p, Vec2::new(size, 0.02)), noisy(map(&p), Vec2::new(0.03, 0.5 * size)))
            })
            .unzip()
    }

    #[test]
    fn the_stated_covariance_is_that_of_the_draws() {
        const DRAWS: u64 = 1000;
        let far = Vec2::new(4300.0, -2100.0);
        for model in MODELS {
            let map = truth(model, 0.7, 1.4);
            let (mut position, mut angle, mut scale, mut squares) = (0.0, 0.0, 0.0, 0.0);
            for trial in 0..DRAWS {
                let mut stream =
                    Stream::open(StreamKey { seed: 31, scenario: "registration", trial, purpose: "marks" });
                let (taught, found) = drawn(model, &mut stream);
                let fit = register(model, &taught, &found, Loss::Squares).unwrap();
                let error = fit.apply(&far) - map(&far);
                let inverse = fit.covariance_at(&far).unwrap().try_inverse().unwrap();
                position += error.dot(&(inverse * error)) / DRAWS as f64;
                squares += fit.chi_squared.unwrap() / DRAWS as f64;
                if model != MapModel::Affine {
                    let z = (fit.angle_rad() - 0.7) / fit.angle_deviation_rad().unwrap();
                    angle += z * z / DRAWS as f64;
                }
                if model == MapModel::Similarity {
                    let z = (fit.scale() - 1.4) / fit.scale_deviation().unwrap();
                    scale += z * z / DRAWS as f64;
                }
            }
            // Means of chi-squared with d degrees of freedom have the variance 2 d / DRAWS; 3.9 standard
            // deviations are left by one in ten thousand.
            let near = |mean: f64, d: f64| (mean - d).abs() < 3.9 * (2.0 * d / DRAWS as f64).sqrt();
            assert!(near(position, 2.0), "{model:?}: {position} of 2");
            assert!(near(squares, (12 - model.parameters()) as f64), "{model:?}: {squares}");
            assert!(model == MapModel::Affine || near(angle, 1.0), "{model:?}: {angle} of 1");
            assert!(model != MapModel::Similarity || near(scale, 1.0), "{scale} of 1");
        }
    }

    #[test]
    fn without_deviations_the_residuals_state_the_noise() {
        const DRAWS: u64 = 1000;
        let map = truth(MapModel::Rigid, 0.7, 1.0);
        let far = Vec2::new(4300.0, -2100.0);
        let mut mean = 0.0;
        for trial in 0..DRAWS {
            let key = StreamKey { seed: 32, scenario: "registration", trial, purpose: "marks" };
            let mut stream = Stream::open(key);
            let mut noise = || 0.05 * stream.normal();
            let found: Vec<Vec2> = part().iter().map(|p| map(p) + Vec2::new(noise(), noise())).collect();
            let fit = register(MapModel::Rigid, &exact(&part()), &exact(&found), Loss::Squares).unwrap();
            assert_eq!((fit.degrees_of_freedom, fit.noise_freedom()), (9, Some(9)));
            let error = fit.apply(&far) - map(&far);
            mean +=
                error.dot(&(fit.covariance_at(&far).unwrap().try_inverse().unwrap() * error)) / DRAWS as f64;
        }
        // Twice Fisher's F of 2 and 9 degrees of freedom: mean 2 * 9 / 7, variance 4 * 2 * 81 * 9 / (2 * 49 *
        // 5).
        let (expected, spread) =
            (18.0 / 7.0, (4.0 * 2.0 * 81.0 * 9.0 / (2.0 * 49.0 * 5.0) / DRAWS as f64).sqrt());
        assert!((mean - expected).abs() < 3.9 * spread, "{mean} of {expected}");
    }

    #[test]
    fn a_mark_that_is_known_better_counts_by_its_variance() {
        // Only the shift of two marks is at stake: a rigid map of unequal distances.
        let taught = [Mark::at(0.0, 0.0), Mark::at(10.0, 0.0)];
        let found = [Mark::at(0.0, 0.0).with_deviation(0.1), Mark::at(10.5, 0.0).with_deviation(0.2)];
        let fit = register(MapModel::Rigid, &taught, &found, Loss::Squares).unwrap();
        // Half a millimetre too much, shared 1 to 4.
        assert!((fit.apply(&Vec2::zeros()).x - 0.1).abs() < 1e-12);
        let chi_squared = fit.chi_squared.unwrap();
        assert!((chi_squared - (0.01 / 0.01 + 0.16 / 0.04)).abs() < 1e-9, "{chi_squared}");
    }

    #[test]
    fn a_robust_loss_keeps_a_mark_astray_from_turning_the_part() {
        for model in MODELS {
            let map = truth(model, 0.7, 1.4);
            let mut found: Vec<Vec2> = part().iter().map(&map).collect();
            found[1] += Vec2::new(0.0, 5.0);
            let error = |loss| {
                let fit = register(model, &exact(&part()), &exact(&found), loss).unwrap();
                (fit.apply(&part()[0]) - map(&part()[0])).norm()
            };
            let (squares, huber) = (error(Loss::Squares), error(Loss::Huber { delta_px: 0.01 }));
            // Five of six marks are exact; Huber lets the sixth pull with 0.01 mm instead of 5.
            assert!(squares > 0.3 && huber < 0.05, "{model:?}: {squares} and {huber}");
        }
    }

    #[test]
    fn marks_that_fix_no_map_are_refused_by_name() {
        let place = vec![Mark::at(1.0, 2.0); 4];
        let line: Vec<Mark> = (0..4).map(|i| Mark::at(f64::from(i), 2.0 * f64::from(i))).collect();
        let square = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(x, y)| Mark::at(x, y));
        let fail = |model, taught: &[Mark], found: &[Mark]| {
            register(model, taught, found, Loss::Squares).map(|fit| fit.matrix()).unwrap_err()
        };
        let coincident = RegistrationError::Coincident { side: "taught", marks: 4 };
        assert_eq!(fail(MapModel::Rigid, &place, &line), coincident);
        assert!(matches!(fail(MapModel::Affine, &line, &line), RegistrationError::Affine(_)));
        assert_eq!(fail(MapModel::Affine, &square, &line), RegistrationError::Singular);
        let few = RegistrationError::TooFewMarks { need: 3, got: 2 };
        assert_eq!(fail(MapModel::Affine, &line[..2], &line[..2]), few);
        let uneven = RegistrationError::Lengths { taught: 4, found: 3 };
        assert_eq!(fail(MapModel::Rigid, &line, &line[..3]), uneven);
        let mirrored = square.map(|mark| Mark::at(-mark.at.x, mark.at.y));
        assert!(matches!(fail(MapModel::Rigid, &square, &mirrored), RegistrationError::Mirrored { .. }));
        let mut half_known = square;
        half_known[0] = half_known[0].with_deviation(0.1);
        assert_eq!(fail(MapModel::Rigid, &half_known, &square), RegistrationError::NoDeviation { index: 1 });
        half_known[0].deviations.x = -1.0;
        assert!(matches!(
            fail(MapModel::Rigid, &half_known, &square),
            RegistrationError::NegativeDeviation { side: "taught", index: 0, .. }
        ));
    }

    #[test]
    fn two_marks_register_a_rigid_part_and_a_line_is_enough() {
        let line: Vec<Mark> = (0..4).map(|i| Mark::at(f64::from(i), 2.0 * f64::from(i))).collect();
        for count in [2, 4] {
            let fit = register(MapModel::Rigid, &line[..count], &line[..count], Loss::Squares).unwrap();
            assert!((fit.matrix() - Mat3::identity()).norm() < 1e-14);
        }
        // Two marks fix a similarity and leave nothing to tell the noise by.
        let fit = register(MapModel::Similarity, &line[..2], &line[..2], Loss::Squares).unwrap();
        assert_eq!((fit.sigma, fit.covariance_at(&Vec2::zeros())), (None, None));
    }
}
