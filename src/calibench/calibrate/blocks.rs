//! Of which blocks are the normal equations made? Fixed sizes, so that a view's share needs no allocation.

use crate::camera::Parameter;
use crate::geometry::lanes::LANES;
use nalgebra::{SMatrix, SVector};

/// Room for every intrinsic parameter of a camera with Brown-Conrady's lens and the gradient, in whole lanes;
/// rows beyond the free ones stay 0. The blocks of other lenses are `W` wide.
pub(super) const N: usize = (Parameter::COUNT + 1).next_multiple_of(LANES);

pub(super) type Intrinsics<const W: usize = N> = SMatrix<f64, W, W>;
pub(super) type PoseBlock = SMatrix<f64, 6, 6>;
pub(super) type Coupling<const W: usize = N> = SMatrix<f64, W, 6>;

/// What one view contributes.
#[derive(Debug, Clone)]
pub(super) struct ViewBlock<const W: usize = N> {
    /// `B`, intrinsics x pose.
    pub coupling: Coupling<W>,
    /// `C`.
    pub pose: PoseBlock,
    /// Gradient of the pose.
    pub gradient: SVector<f64, 6>,
}

impl<const W: usize> ViewBlock<W> {
    /// A view that says nothing.
    pub(super) fn zero() -> ViewBlock<W> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector3, Vector6};

    #[test]
    fn a_plane_whose_tilt_is_held_turns_about_its_normal_only() {
        let root = PoseBlock::from_fn(|i, j| libm::sin((7 * i + 3 * j) as f64) + 2.0 * f64::from(i == j));
        let mut block: ViewBlock = ViewBlock::zero();
        block.pose = root * root.transpose();
        block.gradient = Vector6::new(1.0, -2.0, 3.0, -4.0, 5.0, -6.0);
        let (free, normal) = (block.clone(), Vector3::new(2.0, -1.0, 2.0) / 3.0);
        block.hold_tilt(&normal);
        let step = block.pose.lu().solve(&block.gradient).unwrap();
        let turn: Vector3<f64> = step.fixed_rows::<3>(0).into();
        assert!(turn.cross(&normal).norm() < 1e-12 * step.norm());
        // What may still move does so by the equations as they were.
        let allowed = Vector6::new(0.5 * normal.x, 0.5 * normal.y, 0.5 * normal.z, 0.3, -0.2, 0.7);
        let cost = |block: &ViewBlock| allowed.dot(&(block.pose * allowed)) + block.gradient.dot(&allowed);
        assert!((cost(&block) - cost(&free)).abs() < 1e-12 * cost(&free).abs());
    }
}
