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
