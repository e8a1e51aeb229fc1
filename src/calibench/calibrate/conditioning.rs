//! Which combination of parameters do the data say least about?

use super::Unknown;
use super::elimination::Eliminated;
use super::system::{Reduction, System};
use nalgebra::{DMatrix, DVector, SVector};

/// How well the data separate the intrinsics, and the direction in which they do worst.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Conditioning {
    /// Smallest eigenvalue of the intrinsics' information after the poses are eliminated, scaled to unit
    /// diagonal before the elimination: the part of the information about the weakest combination that is
    /// left when the poses and the other intrinsics are unknown too. 1 is perfect; 0 is not identifiable,
    /// also where rounding alone keeps it from 0.
    pub smallest_eigenvalue: f64,
    /// Largest over smallest eigenvalue of the same matrix.
    pub condition_number: f64,
    /// The weakest combination, strongest member first, members below a fifth of the strongest left out.
    pub weakest: Vec<WeakComponent>,
}

/// One member of the weakest combination.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WeakComponent {
    /// An intrinsic parameter, or the pose component that moves with it: tilt, roll, lateral position,
    /// distance.
    pub unknown: Unknown,
    /// Share of the combination in scaled units, signed for intrinsics, in size for poses (root mean square
    /// over views).
    pub weight: f64,
}

/// Smallest eigenvalue of the scaled information below which it is rounding: the elimination subtracts
/// numbers of size 1, so its error is some hundred roundings.
const ROUNDING: f64 = 1e-12;
/// The same where it is the square of a singular value of the Jacobian, which has an error of some ten
/// roundings.
const ROUNDING_OF_ROOT: f64 = 1e-28;
/// Members of the weakest combination below this share of the largest one are not worth a name.
const NAMED_SHARE: f64 = 0.2;

impl<const W: usize> System<W> {
    /// How well these equations separate the intrinsics; `None` if nothing is free or a pose is undetermined.
    pub fn conditioning(&self) -> Option<Conditioning> {
        Conditioning::of(self, &self.reduction()?)
    }

    /// Units of the shared unknowns in which each has unit information before the poses are eliminated.
    pub(super) fn scale(&self) -> DVector<f64> {
        DVector::from_fn(self.shared, |i, _| 1.0 / self.intrinsics[(i, i)].sqrt())
    }
}

impl Conditioning {
    /// Whether the weakest combination is known by nothing but rounding.
    pub fn is_singular(&self) -> bool {
        self.smallest_eigenvalue.is_nan() || self.smallest_eigenvalue <= 0.0
    }

    /// Whether the weakest combination is known worse than each of its members alone by a factor of a million
    /// or more.
    pub fn is_hardly_separable(&self) -> bool {
        self.smallest_eigenvalue <= ROUNDING
    }

    /// An eigenvalue of information scaled to unit diagonal; 0 where it is rounding.
    pub(crate) fn above_rounding(eigenvalue: f64) -> f64 {
        known(eigenvalue, ROUNDING)
    }

    /// Analyses normal equations and their reduction; `None` if nothing is free.
    pub(super) fn of<const W: usize>(system: &System<W>, reduction: &Reduction<W>) -> Option<Conditioning> {
        let scale = system.scale();
        let spectrum = Spectrum::of(reduction, &scale)?;
        let weakest = spectrum.values.imin();
        let direction = spectrum.directions.column(weakest).into_owned();
        let smallest = known(spectrum.values[weakest], spectrum.rounding);
        Some(Conditioning {
            smallest_eigenvalue: smallest,
            condition_number: spectrum.values.max() / smallest,
            weakest: named(system, &reduction.eliminated, &direction, &scale),
        })
    }
}

/// The scaled information's eigenvalues, in no order.
pub(super) struct Spectrum {
    pub values: DVector<f64>,
    /// In columns.
    pub directions: DMatrix<f64>,
    /// What is less is rounding.
    rounding: f64,
}

impl Spectrum {
    /// `None` where the information is not finite, or of nothing.
    pub fn of<const W: usize>(reduction: &Reduction<W>, scale: &DVector<f64>) -> Option<Spectrum> {
        let n = scale.len();
        if n == 0 {
            return None;
        }
        let Some(root) = &reduction.root else {
            let scaled = DMatrix::from_fn(n, n, |i, j| reduction.schur[(i, j)] * scale[i] * scale[j]);
            let eigen = is_finite(&scaled).then(|| scaled.symmetric_eigen())?;
            let (values, directions) = (eigen.eigenvalues, eigen.eigenvectors);
            return Some(Spectrum { values, directions, rounding: ROUNDING });
        };
        let scaled = DMatrix::from_fn(n, n, |i, j| root[(i, j)] * scale[j]);
        let singular = is_finite(&scaled).then(|| scaled.svd(false, true))?;
        let values = singular.singular_values.map(|s| s * s);
        Some(Spectrum { values, directions: singular.v_t?.transpose(), rounding: ROUNDING_OF_ROOT })
    }
}

fn is_finite(matrix: &DMatrix<f64>) -> bool {
    matrix.iter().all(|x| x.is_finite())
}

fn known(eigenvalue: f64, rounding: f64) -> f64 {
    if eigenvalue > rounding { eigenvalue } else { 0.0 }
}

fn named<const W: usize>(
    system: &System<W>,
    eliminated: &[Eliminated<W>],
    direction: &DVector<f64>,
    scale: &DVector<f64>,
) -> Vec<WeakComponent> {
    let mut step = SVector::<f64, W>::zeros();
    for (i, d) in direction.iter().enumerate() {
        step[i] = d * scale[i];
    }
    let mut members: Vec<WeakComponent> = system
        .free
        .iter()
        .zip(direction.iter())
        .map(|(parameter, &weight)| WeakComponent { unknown: Unknown::Intrinsic(parameter), weight })
        .collect();
    let response = pose_response(system, eliminated, &step);
    let of_pose = [Unknown::Tilt, Unknown::Roll, Unknown::LateralPosition, Unknown::Distance];
    members
        .extend(of_pose.into_iter().zip(response).map(|(unknown, weight)| WeakComponent { unknown, weight }));
    members.sort_by(|a, b| b.weight.abs().total_cmp(&a.weight.abs()));
    let largest = members.first().map_or(0.0, |m| m.weight.abs());
    members.retain(|m| m.weight.abs() >= NAMED_SHARE * largest);
    members
}

/// How far the poses follow an intrinsics step, `-C^-1 B^T d`, in units in which each component alone has
/// unit information: root mean square over the views of tilt (x, y), roll (z), lateral position (x, y),
/// distance (z).
fn pose_response<const W: usize>(
    system: &System<W>,
    eliminated: &[Eliminated<W>],
    step: &SVector<f64, W>,
) -> [f64; 4] {
    let mut squares = [0.0; 4];
    let total: f64 = system.views.len() as f64;
    for (view, factors) in system.views.iter().zip(eliminated) {
        let moved = factors.response(step, system.shared);
        for i in 0..6 {
            let group = [0, 0, 1, 2, 2, 3][i];
            squares[group] += moved[i] * moved[i] * view.pose[(i, i)] / total;
        }
    }
    // A view holds 1/total of the intrinsics' information, so its pose is measured on a scale smaller by that
    // root.
    squares.map(|s| (s / total).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::tests::equations;
    use crate::camera::Parameter;

    #[test]
    fn poses_follow_the_intrinsics_as_a_dense_solver_says() {
        let system = equations();
        let step = SVector::from_fn(|i, _| [1.0, -2.0, 3.0, 0.5, 0.01, -0.02].get(i).copied().unwrap_or(0.0));
        let found = pose_response(&system, &system.reduction().unwrap().eliminated, &step);
        let mut squares = [0.0; 4];
        for view in &system.views {
            let moved = view.pose.lu().solve(&(view.coupling.transpose() * step)).unwrap();
            // In units of what each number of a pose alone is known to.
            let part = |i: usize| moved[i] * moved[i] * view.pose[(i, i)];
            let parts = [part(0) + part(1), part(2), part(3) + part(4), part(5)];
            squares.iter_mut().zip(parts).for_each(|(square, part)| *square += part);
        }
        // The mean over three views, each with a third of the intrinsics' information.
        for (own, square) in found.into_iter().zip(squares) {
            let expected = (square / 3.0 / 3.0).sqrt();
            assert!((own / expected - 1.0).abs() < 1e-9, "{own} {expected}");
        }
    }

    #[test]
    fn members_below_a_fifth_of_the_strongest_are_not_named() {
        let mut system = equations();
        // Poses that do not follow.
        system.views.iter_mut().for_each(|view| view.coupling.fill(0.0));
        let eliminated = system.reduction().unwrap().eliminated;
        let direction = DVector::from_row_slice(&[0.8, 0.15, -0.17, 0.5, 0.0, 0.0]);
        let members = named(&system, &eliminated, &direction, &system.scale());
        let names: Vec<Unknown> = members.iter().map(|member| member.unknown).collect();
        assert_eq!(names, [Parameter::Fx, Parameter::Cy, Parameter::Cx].map(Unknown::Intrinsic));
    }

    #[test]
    fn a_root_of_the_information_has_the_same_spectrum() {
        let system = equations();
        let (mut reduction, scale) = (system.reduction().unwrap(), system.scale());
        let sorted = |reduction: &Reduction| {
            let mut values: Vec<f64> =
                Spectrum::of(reduction, &scale).unwrap().values.iter().copied().collect();
            values.sort_unstable_by(f64::total_cmp);
            values
        };
        let of_square = sorted(&reduction);
        reduction.root = Some(reduction.schur.clone().cholesky().unwrap().l().transpose());
        for (own, expected) in sorted(&reduction).iter().zip(&of_square) {
            assert!((own - expected).abs() < 1e-12 + 1e-6 * expected, "{own} {expected}");
        }
    }

    #[test]
    fn information_that_is_no_number_has_no_spectrum() {
        let system = equations();
        let (mut reduction, scale) = (system.reduction().unwrap(), system.scale());
        reduction.schur[(1, 2)] = f64::NAN;
        assert!(Spectrum::of(&reduction, &scale).is_none());
    }
}
