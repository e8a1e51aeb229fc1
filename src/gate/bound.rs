//! How well could anybody know camera and poses if every view sees other marks? The Cramer-Rao bound of
//! ragged views.
//!
//! `calibench::evaluate::cramer_rao` bounds scenes whose views all see the whole board. Here a view brings
//! the marks it sees: with `J = [J_a J_p]` its derivatives by the free parameters and by its pose,
//!
//! ```text
//! A = J_a^T J_a    B = J_a^T J_p    C = J_p^T J_p    Y = B C^-1
//! P_a = sigma^2 (sum over views of A - Y B^T)^-1          parameters
//! P_p = sigma^2 C^-1 + Y^T P_a Y                           a pose, marginal over all else
//! P_ap = -P_a Y                                            both
//! ```
//!
//! which is `sigma^2 (J^T J)^-1` by blocks (Triggs et al. 2000).

use calibench::calibrate::Covariance;
use calibench::camera::{Camera, FreeParameters, Lens};
use calibench::geometry::{Pose, Vec2};
use calibench::planning::{Estimated, ViewBlocks};
use nalgebra::{DMatrix, Matrix6, MatrixXx6};

/// The bound for noise of standard deviation `sigma_px` on every coordinate; `views` are poses with the
/// points of the target that each sees. `None` where a point has no image or the views determine no camera.
pub fn bound(
    camera: &Camera<Lens>,
    free: FreeParameters,
    views: &[(Pose, Vec<Vec2>)],
    sigma_px: f64,
) -> Option<Covariance> {
    let estimated = Estimated { free, fy_per_fx: None };
    let said = |(pose, points): &(Pose, Vec<Vec2>)| {
        Eliminated::of(ViewBlocks::of(camera, &estimated, pose, points)?)
    };
    let blocks: Vec<Eliminated> = views.iter().map(said).collect::<Option<_>>()?;
    let mut information = DMatrix::zeros(free.len(), free.len());
    blocks.iter().for_each(|view| information += &view.of_parameters);
    let intrinsics = inverse(&information)?;
    let poses =
        blocks.iter().map(|view| view.of_pose + view.follows.transpose() * &intrinsics * &view.follows);
    let cross = blocks.iter().map(|view| -(&intrinsics * &view.follows));
    let (poses, cross) = (poses.collect(), cross.collect());
    Some(Covariance::untied(free, intrinsics, poses, cross).scaled(sigma_px * sigma_px))
}

/// What a view says for unit noise.
struct Eliminated {
    /// `A - Y B^T`: of the parameters, its pose not known.
    of_parameters: DMatrix<f64>,
    /// `C^-1`: of the pose, the parameters known.
    of_pose: Matrix6<f64>,
    /// `Y`.
    follows: MatrixXx6<f64>,
}

impl Eliminated {
    fn of(view: ViewBlocks) -> Option<Eliminated> {
        let of_pose = view.c.cholesky()?.inverse();
        let follows = &view.b * of_pose;
        Some(Eliminated { of_parameters: view.a - &follows * view.b.transpose(), of_pose, follows })
    }
}

/// The inverse of a positive definite matrix, whose rows are brought to one size first.
fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = matrix.diagonal().map(f64::sqrt);
    let n = size.len();
    let even = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / (size[i] * size[j]));
    let inverse = even.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (size[i] * size[j])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::suite::suite;
    use calibench::evaluate::cramer_rao;

    fn near(ours: &DMatrix<f64>, theirs: &DMatrix<f64>, scale: &dyn Fn(usize, usize) -> f64) -> f64 {
        let (rows, columns) = ours.shape();
        let each = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        each.map(|(i, j)| (ours[(i, j)] - theirs[(i, j)]).abs() / scale(i, j)).fold(0.0, f64::max)
    }

    #[test]
    fn views_that_see_the_whole_board_have_the_librarys_bound_with_every_lens() {
        let suite = suite().unwrap();
        for scenario in suite.iter().filter(|s| s.setup.sees_whole_board()) {
            let truth = &scenario.setup.scene.truth;
            let views: Vec<(Pose, Vec<Vec2>)> =
                truth.cam_from_target.iter().map(|pose| (*pose, truth.points.clone())).collect();
            let ours = bound(&truth.camera, scenario.free, &views, scenario.sigma_px).unwrap();
            let theirs = cramer_rao(truth, scenario.free, scenario.sigma_px).unwrap();
            let sd = theirs.intrinsics.diagonal().map(f64::sqrt);
            // Two ways to invert: they were seen to differ by 2.5e-9 at most, on the scene whose parameters
            // are hardest to separate.
            let apart = near(&ours.intrinsics, &theirs.intrinsics, &|i, j| sd[i] * sd[j]);
            assert!(apart < 1e-7, "{}: {apart}", scenario.id);
            for view in 0..views.len() {
                let pose_sd = theirs.poses[view].diagonal().map(f64::sqrt);
                let dense = |m: &Matrix6<f64>| DMatrix::from_fn(6, 6, |i, j| m[(i, j)]);
                let (ours_pose, theirs_pose) = (dense(&ours.poses[view]), dense(&theirs.poses[view]));
                let apart = near(&ours_pose, &theirs_pose, &|i, j| pose_sd[i] * pose_sd[j]);
                assert!(apart < 1e-7, "{}, view {view}: {apart}", scenario.id);
                let cross = |m: &MatrixXx6<f64>| DMatrix::from_fn(m.nrows(), 6, |i, j| m[(i, j)]);
                let apart =
                    near(&cross(&ours.cross[view]), &cross(&theirs.cross[view]), &|i, j| sd[i] * pose_sd[j]);
                assert!(apart < 1e-7, "{}, view {view} and parameters: {apart}", scenario.id);
            }
        }
    }

    #[test]
    fn fewer_marks_say_less_and_one_mark_a_view_says_nothing() {
        let scenario = suite().unwrap().remove(0);
        let truth = &scenario.setup.scene.truth;
        let views = |count: usize| -> Vec<(Pose, Vec<Vec2>)> {
            truth.cam_from_target.iter().map(|pose| (*pose, truth.points[..count].to_vec())).collect()
        };
        let sd = |count: usize| {
            let bound = bound(&truth.camera, scenario.free, &views(count), 0.1)?;
            bound.standard_deviation(calibench::camera::Parameter::Fx)
        };
        assert!(sd(40) > sd(63) && sd(63).is_some());
        assert_eq!(sd(1), None);
    }
}
