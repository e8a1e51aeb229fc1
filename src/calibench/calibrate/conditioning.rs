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
    /// left when the poses and the other intrinsics are unknown too. 1 is perfect, 0 is not identifiable.
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
const SINGULAR: f64 = 1e-12;
/// Members of the weakest combination below this share of the largest one are not worth a name.
const NAMED_SHARE: f64 = 0.2;

impl<const W: usize> System<W> {
    /// How well these equations separate the intrinsics; `None` if nothing is free or a pose is undetermined.
    pub fn conditioning(&self) -> Option<Conditioning> {
        Conditioning::of(self, &self.reduction()?)
    }
}

impl Conditioning {
    /// Whether the weakest combination is known by nothing but rounding.
    pub fn is_singular(&self) -> bool {
        self.smallest_eigenvalue.is_nan() || self.smallest_eigenvalue <= SINGULAR
    }

    /// Analyses normal equations and their reduction; `None` if nothing is free.
    pub(super) fn of<const W: usize>(system: &System<W>, reduction: &Reduction<W>) -> Option<Conditioning> {
        let n = system.shared;
        if n == 0 {
            return None;
        }
        let Reduction { eliminated, schur, .. } = reduction;
        let scale = DVector::from_fn(n, |i, _| 1.0 / system.intrinsics[(i, i)].sqrt());
        let scaled = DMatrix::from_fn(n, n, |i, j| schur[(i, j)] * scale[i] * scale[j]);
        if !scaled.iter().all(|x| x.is_finite()) {
            return None;
        }
        let eigen = scaled.symmetric_eigen();
        let weakest = eigen.eigenvalues.imin();
        let direction = eigen.eigenvectors.column(weakest).into_owned();
        let (smallest, largest) = (eigen.eigenvalues[weakest], eigen.eigenvalues.max());
        Some(Conditioning {
            smallest_eigenvalue: smallest,
            condition_number: largest / smallest,
            weakest: named(system, eliminated, &direction, &scale),
        })
    }
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
