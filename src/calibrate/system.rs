//! How are thousands of poses solved for without a matrix of thousands of rows? Schur elimination of the pose blocks.
//!
//! The normal equations of a calibration are an arrow: intrinsics `A` (n x n), one pose block `C_i` (6 x 6) a view, and
//! couplings `B_i` (n x 6). Poses do not couple with each other, so with `Y_i = C_i^-1 B_i^T`
//!
//! ```text
//! S = A - sum B_i Y_i,   S d_a = -(g_a - sum Y_i^T g_i),   d_i = -C_i^-1 g_i - Y_i d_a
//! ```
//! and time and memory grow linearly in the number of views.

use super::Covariance;
use crate::camera::{FreeParameters, Parameter};
use nalgebra::{Cholesky, Const, DMatrix, DVector, SMatrix, SVector};

/// Room for every intrinsic parameter; rows beyond the free ones stay 0.
const N: usize = Parameter::COUNT;

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

/// Normal equations `J^T w J` and gradient `J^T w r` of all views.
#[derive(Debug, Clone)]
pub struct System {
    pub(super) free: FreeParameters,
    pub(super) intrinsics: Intrinsics,
    pub(super) gradient: SVector<f64, N>,
    pub(super) views: Vec<ViewBlock>,
    pub(super) cost: f64,
}

/// A step of all unknowns.
#[derive(Debug, Clone, Default)]
pub(super) struct Step {
    /// One entry per free intrinsic parameter.
    pub intrinsics: SVector<f64, N>,
    /// Rotation vector and translation of each view.
    pub poses: Vec<SVector<f64, 6>>,
    /// Predicted fall of the cost, `-(2 g^T d + d^T H d)`, without the damping.
    pub predicted_gain: f64,
}

impl System {
    /// An empty system with room for `views` views.
    pub(super) fn new(free: FreeParameters, views: usize) -> System {
        System {
            free,
            intrinsics: Intrinsics::zeros(),
            gradient: SVector::zeros(),
            views: Vec::with_capacity(views),
            cost: 0.0,
        }
    }

    /// Empties the system and keeps its memory.
    pub(super) fn clear(&mut self) {
        self.intrinsics.fill(0.0);
        self.gradient.fill(0.0);
        self.views.clear();
        self.cost = 0.0;
    }

    /// Solves for the step of `H + damping diag(H)`. `None` where the damped matrix is not positive definite.
    pub(super) fn solve_into(&self, damping: f64, step: &mut Step) -> Option<()> {
        let n = self.free.len();
        let mut schur = damped(&self.intrinsics, damping);
        let mut right = self.gradient;
        for view in &self.views {
            let factor = damped(&view.pose, damping).cholesky()?;
            // With C = L L^T and W = L^-1 B^T, S loses W^T W: symmetric by construction.
            let w = whiten(&factor, &view.coupling);
            let z = factor.l_dirty().solve_lower_triangular(&view.gradient)?;
            subtract_square(&mut schur, &w, n);
            right -= w.tr_mul(&z);
        }
        let factor = leading_cholesky(&schur, n)?;
        step.intrinsics.fill(0.0);
        let solved = factor.solve(&DVector::from_fn(n, |i, _| -right[i]));
        step.intrinsics.rows_mut(0, n).copy_from(&solved);
        step.poses.clear();
        for view in &self.views {
            let rest = -(view.gradient + view.coupling.tr_mul(&step.intrinsics));
            step.poses.push(damped(&view.pose, damping).cholesky()?.solve(&rest));
        }
        step.predicted_gain = self.predicted_gain(step);
        Some(())
    }

    /// `-(2 g^T d + d^T H d)`.
    fn predicted_gain(&self, step: &Step) -> f64 {
        let a = &step.intrinsics;
        let mut gain = -(2.0 * self.gradient.dot(a) + a.dot(&(self.intrinsics * a)));
        for (view, d) in self.views.iter().zip(&step.poses) {
            let along = view.coupling.tr_mul(a) * 2.0 + view.pose * d;
            gain -= 2.0 * view.gradient.dot(d) + d.dot(&along);
        }
        gain
    }

    /// `S`, the information on the intrinsics once the poses are unknown too; `None` where a pose is undetermined.
    pub(super) fn schur(&self) -> Option<DMatrix<f64>> {
        let n = self.free.len();
        let mut schur = self.intrinsics;
        for view in &self.views {
            let w = whiten(&view.pose.cholesky()?, &view.coupling);
            subtract_square(&mut schur, &w, n);
        }
        Some(DMatrix::from_fn(n, n, |i, j| schur[(i, j)]))
    }

    /// The inverse of the normal matrix, block by block, for unit noise; `None` if it is singular.
    pub fn covariance(&self) -> Option<Covariance> {
        let n = self.free.len();
        let intrinsics = self.schur()?.cholesky()?.inverse();
        let mut poses = Vec::with_capacity(self.views.len());
        let mut cross = Vec::with_capacity(self.views.len());
        for view in &self.views {
            let factor = view.pose.cholesky()?;
            let y = factor.solve(&view.coupling.transpose());
            let y = y.columns(0, n);
            let minus_cross = &intrinsics * y.transpose();
            let pose = factor.inverse() + y * &minus_cross;
            poses.push(0.5 * (pose + pose.transpose()));
            cross.push(-minus_cross);
        }
        Some(Covariance { free: self.free, intrinsics, poses, cross })
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.free.len() + 6 * self.views.len()
    }
}

impl ViewBlock {
    /// Lets the target turn only about `normal` (unit vector, camera frame), so that its plane keeps its tilt: with
    /// `P = diag(n n^T, I)` the block becomes `P C P + (I - P) c` and `B P`, `P g`, whose step stays in the range of `P`.
    pub(super) fn hold_tilt(&mut self, normal: &nalgebra::Vector3<f64>) {
        let mut keep = PoseBlock::identity();
        keep.fixed_view_mut::<3, 3>(0, 0).copy_from(&(normal * normal.transpose()));
        let stiffness = self.pose.trace() / 6.0;
        self.pose = keep * self.pose * keep + (PoseBlock::identity() - keep) * stiffness;
        self.coupling *= keep;
        self.gradient = keep * self.gradient;
    }
}

fn damped<const K: usize>(matrix: &SMatrix<f64, K, K>, damping: f64) -> SMatrix<f64, K, K> {
    let mut out = *matrix;
    for i in 0..K {
        out[(i, i)] *= 1.0 + damping;
    }
    out
}

/// `W = L^-1 B^T`.
fn whiten(factor: &Cholesky<f64, Const<6>>, coupling: &Coupling) -> SMatrix<f64, 6, N> {
    let mut w = coupling.transpose();
    // The factor's diagonal is positive, so the solve cannot fail.
    factor.l_dirty().solve_lower_triangular_mut(&mut w);
    w
}

/// `S -= W^T W` on the leading `n x n` block.
fn subtract_square(schur: &mut Intrinsics, w: &SMatrix<f64, 6, N>, n: usize) {
    for i in 0..n {
        for j in i..n {
            let product = w.column(i).dot(&w.column(j));
            schur[(i, j)] -= product;
            if i != j {
                schur[(j, i)] -= product;
            }
        }
    }
}

fn leading_cholesky(matrix: &Intrinsics, n: usize) -> Option<Cholesky<f64, nalgebra::Dyn>> {
    DMatrix::from_fn(n, n, |i, j| matrix[(i, j)]).cholesky()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::information;
    use crate::camera::{BrownConrady, Camera};
    use crate::geometry::{Pose, Vec2, Vec3, rotation};

    fn system() -> System {
        let camera =
            Camera::pinhole(600.0, 590.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.2, 0.1));
        let points: Vec<Vec2> =
            (0..35).map(|i| Vec2::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0) * 12.0).collect();
        let poses = [[0.3, 0.0, 0.1], [0.0, -0.3, 0.0], [-0.2, 0.25, 0.4]].map(|[x, y, z]| Pose {
            rotation: rotation::from_xyz_rad(x, y, z),
            translation: Vec3::new(2.0, -3.0, 120.0),
        });
        information(&camera, FreeParameters::CHAPTER, &poses, &points).unwrap()
    }

    /// The same matrix written out in full.
    fn dense(system: &System) -> DMatrix<f64> {
        let n = system.free.len();
        let mut full = DMatrix::zeros(system.unknowns(), system.unknowns());
        for i in 0..n {
            for j in 0..n {
                full[(i, j)] = system.intrinsics[(i, j)];
            }
        }
        for (k, view) in system.views.iter().enumerate() {
            let at = n + 6 * k;
            full.fixed_view_mut::<6, 6>(at, at).copy_from(&view.pose);
            for i in 0..n {
                for j in 0..6 {
                    full[(i, at + j)] = view.coupling[(i, j)];
                    full[(at + j, i)] = view.coupling[(i, j)];
                }
            }
        }
        full
    }

    #[test]
    fn elimination_gives_the_inverse_of_the_full_matrix() {
        let system = system();
        let inverse = dense(&system).try_inverse().unwrap();
        let covariance = system.covariance().unwrap();
        let n = system.free.len();
        // Both lose digits with the condition number of the scaled matrix (about 1e6): compare at 1e-8 of the scale.
        let close = |a: f64, b: f64, i: usize, j: usize| {
            (a - b).abs() <= 1e-8 * (inverse[(i, i)] * inverse[(j, j)]).sqrt()
        };
        for i in 0..n {
            for j in 0..n {
                assert!(close(covariance.intrinsics[(i, j)], inverse[(i, j)], i, j));
            }
        }
        for k in 0..3 {
            let at = n + 6 * k;
            for i in 0..6 {
                for j in 0..6 {
                    assert!(close(covariance.poses[k][(i, j)], inverse[(at + i, at + j)], at + i, at + j));
                }
                for j in 0..n {
                    assert!(close(covariance.cross[k][(j, i)], inverse[(j, at + i)], j, at + i));
                }
            }
        }
    }

    #[test]
    fn the_step_solves_the_full_equations() {
        let mut system = system();
        for (i, g) in system.gradient.iter_mut().take(6).enumerate() {
            *g = 1.0 + i as f64;
        }
        for view in &mut system.views {
            view.gradient = SVector::from_fn(|i, _| 0.5 - i as f64);
        }
        let mut step = Step::default();
        system.solve_into(0.0, &mut step).unwrap();
        let n = system.free.len();
        let mut gradient = DVector::zeros(system.unknowns());
        let mut stacked = DVector::zeros(system.unknowns());
        gradient.rows_mut(0, n).copy_from(&system.gradient.rows(0, n));
        stacked.rows_mut(0, n).copy_from(&step.intrinsics.rows(0, n));
        for k in 0..3 {
            gradient.rows_mut(n + 6 * k, 6).copy_from(&system.views[k].gradient);
            stacked.rows_mut(n + 6 * k, 6).copy_from(&step.poses[k]);
        }
        let expected = -dense(&system).lu().solve(&gradient).unwrap();
        assert!((&stacked - &expected).norm() <= 1e-8 * expected.norm());
        assert!((step.predicted_gain + gradient.dot(&expected)).abs() <= 1e-8 * step.predicted_gain);
    }
}
