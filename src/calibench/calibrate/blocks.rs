//! Of which blocks are the normal equations made? Fixed sizes, so that a view's share needs no allocation.

use crate::camera::Parameter;
use crate::geometry::lanes::LANES;
use nalgebra::{SMatrix, SVector};

/// Room for every intrinsic parameter and the gradient, in whole lanes; rows beyond the free ones stay 0.
pub(super) const N: usize = (Parameter::COUNT + 1).next_multiple_of(LANES);

pub(super) type Intrinsics = SMatrix<f64, N, N>;
pub(super) type PoseBlock = SMatrix<f64, 6, 6>;
pub(super) type Coupling = SMatrix<f64, N, 6>;

/// What one view contributes.
#[derive(Debug, Clone)]
pub(super) struct ViewBlock {
    /// `B`, intrinsics x pose.
    pub coupling: Coupling,
    /// `C`.
    pub pose: PoseBlock,
    /// Gradient of the pose.
    pub gradient: SVector<f64, 6>,
}

impl ViewBlock {
    /// A view that says nothing.
    pub(super) fn zero() -> ViewBlock {
        ViewBlock { coupling: SMatrix::zeros(), pose: SMatrix::zeros(), gradient: SVector::zeros() }
    }

    /// Lets the target turn only about `normal` (unit vector, camera frame), so that its plane keeps its
    /// tilt: with `P = diag(n n^T, I)` the block becomes `P C P + (I - P) c` and `B P`, `P g`, whose step
    /// stays in the range of `P`.
    pub(super) fn hold_tilt(&mut self, normal: &nalgebra::Vector3<f64>) {
        let mut keep = PoseBlock::identity();
        keep.fixed_view_mut::<3, 3>(0, 0).copy_from(&(normal * normal.transpose()));
        let stiffness = self.pose.trace() / 6.0;
        self.pose = keep * self.pose * keep + (PoseBlock::identity() - keep) * stiffness;
        self.coupling *= keep;
        self.gradient = keep * self.gradient;
    }
}
