//! Do the data determine what is free, or does only their noise? Singular equations are refused by name, and
//! focal lengths of which nothing is known.

use super::MeasuredError;
use super::data::Data;
use super::descent::Minimum;
use super::equations::Equations;
use super::focal::{DOUBTFUL, OTHER_FOCAL, at_focal};
use super::problem::{Problem, State};
use crate::calibrate::{CalibrationError, Conditioning, Unknown, WeakComponent};
use crate::camera::{FreeParameters, Parameter};
use nalgebra::{DMatrix, DVector};

/// Members of the weakest combination below this share of the largest one are not worth a name.
const NAMED_SHARE: f64 = 0.2;
/// Focal lengths far off must cost this many variances more, three standard deviations: as
/// [`crate::calibrate::calibrate`] asks.
const FOCAL_RISE: f64 = 9.0;

/// How well the data separate the camera's parameters.
///
/// # Errors
/// Positions of marks, a pose or parameters that the data do not determine.
pub(super) fn conditioning(
    problem: &Problem<'_>,
    equations: &Equations,
) -> Result<Option<Conditioning>, MeasuredError> {
    let n = problem.free.len();
    let Some(reduced) = equations.reduced(0.0) else {
        return Err(not_identifiable(
            vec![Unknown::Poses],
            "the marks of a view do not determine its pose".into(),
        ));
    };
    let marks = reduced.matrix.nrows() - n;
    let own = reduced.matrix.view((0, 0), (n, n)).into_owned();
    // How marks follow a step of the camera: -S_mm^-1 S_mc.
    let follow = if marks > 0 {
        let of_marks = reduced.matrix.view((n, n), (marks, marks)).into_owned();
        let Some(factor) = of_marks.cholesky() else { return Err(loose(problem.data)) };
        -factor.solve(&reduced.matrix.view((n, 0), (marks, n)).into_owned())
    } else {
        DMatrix::zeros(0, n)
    };
    if n == 0 {
        return Ok(None);
    }
    let schur = own + reduced.matrix.view((0, n), (n, marks)) * &follow;
    let scale = DVector::from_fn(n, |i, _| 1.0 / equations.matrix[(i, i)].sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, j| schur[(i, j)] * scale[i] * scale[j]);
    if !scaled.iter().all(|x| x.is_finite()) {
        return Err(not_identifiable(vec![Unknown::Camera], "a parameter moves no mark".into()));
    }
    let eigen = scaled.symmetric_eigen();
    let weakest = eigen.eigenvalues.imin();
    let direction = eigen.eigenvectors.column(weakest).into_owned();
    let (smallest, largest) =
        (Conditioning::above_rounding(eigen.eigenvalues[weakest]), eigen.eigenvalues.max());
    let of_camera = direction.component_mul(&scale);
    let mut step = DVector::zeros(n + marks);
    step.rows_mut(0, n).copy_from(&of_camera);
    step.rows_mut(n, marks).copy_from(&(follow * &of_camera));
    let poses = equations.following(&reduced, &step).unwrap_or_default();
    let found = Conditioning {
        smallest_eigenvalue: smallest,
        condition_number: largest / smallest,
        weakest: named(problem.free, equations, &direction, &poses),
    };
    if found.is_singular() {
        let names = names(&found.weakest);
        return Err(not_identifiable(names, "the normal equations are singular".into()));
    }
    Ok(Some(found))
}

/// Refuses a focal length that may as well be three times as long or as short; `relative` is its standard
/// deviation over itself.
pub(super) fn refuse_if_open(
    problem: &Problem<'_>,
    minimum: &Minimum,
    relative: f64,
) -> Result<(), MeasuredError> {
    if !problem.free.contains(Parameter::Fx) || relative.is_nan() || relative < DOUBTFUL {
        return Ok(());
    }
    let fx = minimum.state.camera.fx;
    for factor in [OTHER_FOCAL, 1.0 / OTHER_FOCAL] {
        let Some(other) = at_focal(problem, minimum, factor) else { continue };
        let rise = (other.equations.cost - minimum.equations.cost) / problem.variance;
        if rise < FOCAL_RISE {
            let why = format!(
                "fx {:.5} fits as {:.5} does: the cost rises by {:.1} variances only, and {FOCAL_RISE:.0} are needed to rule chance out",
                factor * fx,
                fx,
                rise.max(0.0)
            );
            return Err(not_identifiable(vec![Unknown::FocalLength, Unknown::Distance], why));
        }
    }
    Ok(())
}

fn not_identifiable(inseparable: Vec<Unknown>, why: String) -> MeasuredError {
    CalibrationError::NotIdentifiable { inseparable, why }.into()
}

fn loose(data: &Data) -> MeasuredError {
    MeasuredError::Loose { largest: data.unknown_deviations.iter().copied().fold(0.0, f64::max) }
}

/// The weakest combination, strongest member first: parameters, and what poses do with them, root mean square
/// over the views, in units in which each alone has unit information.
fn named(
    free: FreeParameters,
    equations: &Equations,
    direction: &DVector<f64>,
    poses: &[nalgebra::Vector6<f64>],
) -> Vec<WeakComponent> {
    let mut squares = [0.0; 4];
    let total = equations.views.len() as f64;
    for (view, moved) in equations.views.iter().zip(poses) {
        for (i, group) in [0, 0, 1, 2, 2, 3].into_iter().enumerate() {
            squares[group] += moved[i] * moved[i] * view.square[(i, i)] / (total * total);
        }
    }
    let of_pose = [Unknown::Tilt, Unknown::Roll, Unknown::LateralPosition, Unknown::Distance];
    let parameters = free.iter().map(Unknown::Intrinsic).zip(direction.iter().copied());
    let others = of_pose.into_iter().zip(squares.map(f64::sqrt));
    let mut members: Vec<WeakComponent> =
        parameters.chain(others).map(|(unknown, weight)| WeakComponent { unknown, weight }).collect();
    members.sort_by(|a, b| b.weight.abs().total_cmp(&a.weight.abs()));
    let largest = members.first().map_or(0.0, |m| m.weight.abs());
    members.retain(|m| m.weight.abs() >= NAMED_SHARE * largest);
    members
}

/// Groups for people; coefficients that hang together among themselves only are named one by one.
fn names(weakest: &[WeakComponent]) -> Vec<Unknown> {
    if weakest.iter().all(|m| m.unknown.group() == Unknown::RadialDistortion) {
        return weakest.iter().map(|m| m.unknown).collect();
    }
    let mut names = Vec::new();
    for group in weakest.iter().map(|m| m.unknown.group()) {
        if !names.contains(&group) {
            names.push(group);
        }
    }
    names
}

/// The largest angle of a mark from the axis, rad.
pub(super) fn largest_angle(problem: &Problem<'_>, state: &State) -> f64 {
    let of_view = |(view, list): (usize, &Vec<super::data::Seen>)| {
        let angle = |seen: &super::data::Seen| {
            let point = state.cam_from_target[view].apply(&problem.position(state, seen.mark));
            libm::atan2(point.xy().norm(), point.z)
        };
        list.iter().map(angle).fold(0.0, f64::max)
    };
    problem.data.views.iter().enumerate().map(of_view).fold(0.0, f64::max)
}
