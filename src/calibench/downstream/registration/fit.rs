//! Which map is the most likely one? Gauss-Newton steps with errors on both sides, reweighted for a robust
//! loss.

use super::{MapModel, Mark, Registration, RegistrationError};
use crate::calibrate::Loss;
use crate::geometry::Vec2;
use nalgebra::{DMatrix, DVector, Matrix2};

/// The marks in coordinates without large numbers: taught ones as offsets from their mean in units of their
/// radius, found ones as offsets from their mean.
pub(super) struct Pairs {
    pub taught_centre: Vec2,
    pub found_mean: Vec2,
    pub radius: f64,
    /// Taught marks.
    pub offsets: Vec<Vec2>,
    /// Found marks.
    pub found: Vec<Vec2>,
    /// Covariances of the taught marks, in squares of the radius.
    pub of_taught: Vec<Matrix2<f64>>,
    /// Covariances of the found marks; one unit each where none are given.
    pub of_found: Vec<Matrix2<f64>>,
}

impl Pairs {
    pub fn new(taught: &[Mark], found: &[Mark], deviations_given: bool) -> Pairs {
        let mean = |marks: &[Mark]| {
            let near = marks[0].at;
            near + marks.iter().map(|m| m.at - near).sum::<Vec2>() / marks.len() as f64
        };
        let (taught_centre, found_mean) = (mean(taught), mean(found));
        let square: f64 = taught.iter().map(|m| (m.at - taught_centre).norm_squared()).sum();
        let radius = (square / taught.len() as f64).sqrt();
        let unit = |m: &Mark| if deviations_given { m.covariance() } else { Matrix2::identity() };
        Pairs {
            taught_centre,
            found_mean,
            radius,
            offsets: taught.iter().map(|m| (m.at - taught_centre) / radius).collect(),
            found: found.iter().map(|m| m.at - found_mean).collect(),
            of_taught: taught.iter().map(|m| m.covariance() / (radius * radius)).collect(),
            of_found: found.iter().map(unit).collect(),
        }
    }
}

/// A map from offsets in units of the radius to offsets of found marks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Map {
    /// `A` times the radius.
    pub linear: Matrix2<f64>,
    pub found_centre: Vec2,
}

/// What each parameter adds to `A` and `t`: the angle (times `A`) and the scale of a turned map or the four
/// entries of an affine one, then the shift.
pub(super) fn directions(model: MapModel, linear: &Matrix2<f64>) -> Vec<(Matrix2<f64>, Vec2)> {
    let unit = |row: usize, column: usize| {
        let mut matrix = Matrix2::zeros();
        matrix[(row, column)] = 1.0;
        matrix
    };
    let quarter = Matrix2::new(0.0, -1.0, 1.0, 0.0);
    // Of unit size, so that every parameter is a length.
    let along = linear / linear.norm() * std::f64::consts::SQRT_2;
    let linear_ones = match model {
        MapModel::Rigid => vec![quarter * along],
        MapModel::Similarity => vec![quarter * along, along],
        MapModel::Affine => vec![unit(0, 0), unit(0, 1), unit(1, 0), unit(1, 1)],
    };
    let shifts = [Vec2::x(), Vec2::y()].map(|shift| (Matrix2::zeros(), shift));
    linear_ones.into_iter().map(|linear| (linear, Vec2::zeros())).chain(shifts).collect()
}

/// The derivative of the found position by the parameters, 2 x p, at an offset.
pub(super) fn jacobian(directions: &[(Matrix2<f64>, Vec2)], offset: &Vec2) -> DMatrix<f64> {
    let columns: Vec<Vec2> = directions.iter().map(|(linear, shift)| linear * offset + shift).collect();
    DMatrix::from_fn(2, columns.len(), |row, column| columns[column][row])
}

/// Most steps: reweighting halves the error in each where a tenth of the marks lie astray.
const MOST_STEPS: usize = 300;
/// A step below this part of a standard deviation, or of the part's size, changes nothing that is shown.
const SMALL_STEP: f64 = 1e-9;
const ROUNDING: f64 = 1e-14;

/// The normal equations at a map.
struct System {
    normal: DMatrix<f64>,
    right: DVector<f64>,
    /// Squared residuals over their variances.
    squares: Vec<f64>,
    residuals: Vec<Vec2>,
}

/// `sum w J^T W J` and `-sum w J^T W r`, with `W = (S_found + A S_taught A^T)^-1` and the Jacobian at the
/// adjusted taught mark `p - S_taught A^T W r`. `None` where a covariance is singular.
fn system(model: MapModel, pairs: &Pairs, map: &Map, loss: Loss) -> Option<System> {
    let directions = directions(model, &map.linear);
    let count = directions.len();
    let mut system = System {
        normal: DMatrix::zeros(count, count),
        right: DVector::zeros(count),
        squares: Vec::with_capacity(pairs.offsets.len()),
        residuals: Vec::with_capacity(pairs.offsets.len()),
    };
    for i in 0..pairs.offsets.len() {
        let residual = map.linear * pairs.offsets[i] + map.found_centre - pairs.found[i];
        let spread = pairs.of_found[i] + map.linear * pairs.of_taught[i] * map.linear.transpose();
        let information = spread.try_inverse()?;
        let pull = information * residual;
        let square = residual.dot(&pull);
        let weight = loss.at(square).1;
        let adjusted = pairs.offsets[i] - pairs.of_taught[i] * map.linear.transpose() * pull;
        let jacobian = jacobian(&directions, &adjusted);
        system.normal += jacobian.transpose() * information * &jacobian * weight;
        system.right -= jacobian.transpose() * pull * weight;
        system.squares.push(square);
        system.residuals.push(residual);
    }
    Some(system)
}

/// The map moved by a step; a rigid one is turned, so that it stays a rotation.
fn moved(model: MapModel, map: &Map, step: &DVector<f64>) -> Map {
    let count = step.len();
    let found_centre = map.found_centre + Vec2::new(step[count - 2], step[count - 1]);
    let linear = if model == MapModel::Rigid {
        let angle = step[0] * std::f64::consts::SQRT_2 / map.linear.norm();
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        Matrix2::new(cosine, -sine, sine, cosine) * map.linear
    } else {
        let change: Matrix2<f64> =
            directions(model, &map.linear).iter().zip(step).map(|(d, s)| d.0 * *s).sum();
        map.linear + change
    };
    Map { linear, found_centre }
}

/// Gauss-Newton from a start to the minimum.
pub(super) fn refine(
    model: MapModel,
    pairs: &Pairs,
    begun: Map,
    loss: Loss,
    deviations_given: bool,
) -> Result<Registration, RegistrationError> {
    let mut map = begun;
    for iterations in 1..=MOST_STEPS {
        let at = system(model, pairs, &map, loss).ok_or(RegistrationError::Singular)?;
        let factor = at.normal.clone().cholesky().ok_or(RegistrationError::Singular)?;
        let step = factor.solve(&at.right);
        let in_deviations = step.dot(&at.right).max(0.0).sqrt();
        map = moved(model, &map, &step);
        let noise = (at.squares.iter().sum::<f64>() / at.squares.len() as f64).sqrt();
        let unit = if deviations_given { 1.0 } else { noise };
        if in_deviations <= SMALL_STEP * unit || step.norm() <= ROUNDING * map.linear.norm() {
            return finished(model, pairs, &map, loss, deviations_given, iterations);
        }
    }
    Err(RegistrationError::NotConverged { iterations: MOST_STEPS })
}

/// The result at the minimum.
fn finished(
    model: MapModel,
    pairs: &Pairs,
    map: &Map,
    loss: Loss,
    deviations_given: bool,
    iterations: usize,
) -> Result<Registration, RegistrationError> {
    let at = system(model, pairs, map, loss).ok_or(RegistrationError::Singular)?;
    let inverse = at.normal.clone().cholesky().ok_or(RegistrationError::Singular)?.inverse();
    let count = at.residuals.len();
    let degrees_of_freedom = 2 * count - model.parameters();
    let weights: Vec<f64> = at.squares.iter().map(|s| loss.at(*s).1).collect();
    let variance = (degrees_of_freedom > 0).then(|| noise_variance(&at.squares, loss, degrees_of_freedom));
    let counted = if deviations_given && weights.iter().all(|w| *w == 1.0) { Some(1.0) } else { variance };
    let square: f64 = at.residuals.iter().map(Vec2::norm_squared).sum();
    Ok(Registration {
        model,
        linear: map.linear / pairs.radius,
        taught_centre: pairs.taught_centre,
        found_centre: pairs.found_mean + map.found_centre,
        rms: (square / count as f64).sqrt(),
        residuals: at.residuals,
        weights,
        degrees_of_freedom,
        deviations_given,
        sigma: variance.map(f64::sqrt),
        chi_squared: (deviations_given && loss == Loss::Squares).then(|| at.squares.iter().sum()),
        iterations,
        radius: pairs.radius,
        covariance: counted.map(|factor| inverse * factor),
    })
}

/// Factor of the unit covariance: the residual variance, or Huber's correction for a robust loss.
///
/// The weighted normal matrix is `sum w J^T W J`; with `mean w` it stands for `mean w J^T W J`, so the
/// sandwich is `sum w^2 s mean w / (mean psi')^2` times its inverse, over the degrees of freedom.
fn noise_variance(squares: &[f64], loss: Loss, degrees_of_freedom: usize) -> f64 {
    let (mut square, mut weights, mut slopes) = (0.0, 0.0, 0.0);
    for &s in squares {
        let weight = loss.at(s).1;
        square += weight * weight * s;
        weights += weight;
        slopes += loss.slope(s);
    }
    square / degrees_of_freedom as f64 * weights * squares.len() as f64 / (slopes * slopes)
}
