//! Is the bound right? Taken once more from the pixels and the robot's poses themselves, by differences.

use super::cases::Case;
use super::trial::{Drawn, bound, draw, true_x, true_y};
use calibench::camera::{Camera, FreeParameters};
use calibench::downstream::SetUp;
use calibench::geometry::{Pose, Vec3};
use calibench_harness::ExperimentError;
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

/// Unknowns of a pose.
const SIX: usize = 6;
/// Half the width of a central difference: its error is the square of this, its rounding 1e-13 px over this.
const STEP: f64 = 1e-5;

/// The bound of X from the covariances of poses, and from pixels.
pub(super) fn both_bounds(case: &Case, seed: u64) -> Result<(Matrix6<f64>, Matrix6<f64>), ExperimentError> {
    let drawn = draw(case, seed, 0);
    let by_poses = bound(case, &drawn)?.fixed_view::<SIX, SIX>(0, 0).into_owned();
    let information = information(case, &drawn)?;
    let factor =
        information.cholesky().ok_or("singular").map_err(ExperimentError::at("bound of the pixels"))?;
    Ok((by_poses, factor.inverse().fixed_view::<SIX, SIX>(0, 0).into_owned()))
}

/// All that is unknown: X, Y, the robot's true poses, the camera, and the poses of the views beside the
/// stations.
struct Unknown {
    x: Pose,
    y: Pose,
    robot: Vec<Pose>,
    camera: Camera,
    more: Vec<Pose>,
}

/// Fisher information of pixels and robot poses about all unknowns, in their order.
fn information(case: &Case, drawn: &Drawn) -> Result<DMatrix<f64>, ExperimentError> {
    let n = drawn.robot.len();
    let more = drawn.truth.cam_from_target[n..].to_vec();
    let truth =
        Unknown { x: true_x(), y: true_y(), robot: drawn.robot.clone(), camera: drawn.truth.camera, more };
    let intrinsics = FreeParameters::STANDARD.len();
    let count = SIX * (2 + n) + intrinsics + SIX * truth.more.len();
    let at = |k: usize, step: f64| {
        truth
            .stepped(k, step)
            .pixels(case.set_up, drawn)
            .ok_or("a point is behind the camera")
            .map_err(ExperimentError::at("bound of the pixels"))
    };
    let columns = (0..count)
        .map(|k| Ok((at(k, STEP)? - at(k, -STEP)?) / (2.0 * STEP)))
        .collect::<Result<Vec<DVector<f64>>, ExperimentError>>()?;
    let jacobian = DMatrix::from_columns(&columns);
    let mut information = jacobian.transpose() * jacobian / (case.noise_px * case.noise_px);
    // What the robot says of its poses, whose errors are steps from the left as the unknowns are.
    for i in 0..SIX * n {
        let sd = if i % SIX < 3 { case.robot.rotation_rad } else { case.robot.position };
        information[(2 * SIX + i, 2 * SIX + i)] += 1.0 / (sd * sd);
    }
    Ok(information)
}

impl Unknown {
    /// The unknowns with one of them moved.
    fn stepped(&self, k: usize, by: f64) -> Unknown {
        let (n, intrinsics) = (self.robot.len(), FreeParameters::STANDARD.len());
        let moved =
            |pose: &Pose, k: usize| pose.perturbed(&Vector6::from_fn(|i, _| if i == k { by } else { 0.0 }));
        let (mut x, mut y, mut robot, mut camera, mut more) =
            (self.x, self.y, self.robot.clone(), self.camera, self.more.clone());
        let in_camera = SIX * (2 + n);
        match k {
            _ if k < SIX => x = moved(&x, k),
            _ if k < 2 * SIX => y = moved(&y, k - SIX),
            _ if k < in_camera => {
                let i = k / SIX - 2;
                robot[i] = moved(&robot[i], k % SIX);
            }
            _ if k < in_camera + intrinsics => {
                let step: Vec<f64> =
                    (0..intrinsics).map(|i| if i == k - in_camera { by } else { 0.0 }).collect();
                camera = camera.stepped(FreeParameters::STANDARD, &step);
            }
            _ => {
                let left = k - in_camera - intrinsics;
                more[left / SIX] = moved(&more[left / SIX], left % SIX);
            }
        }
        Unknown { x, y, robot, camera, more }
    }

    /// All pixels of all views.
    fn pixels(&self, set_up: SetUp, drawn: &Drawn) -> Option<DVector<f64>> {
        let at_station = |robot: &Pose| {
            let inverse = if set_up == SetUp::EyeInHand { robot.inverse() } else { *robot };
            self.x.inverse().compose(&inverse).compose(&self.y)
        };
        let poses = self.robot.iter().map(at_station).chain(self.more.iter().copied());
        let pixels = poses.flat_map(|pose| {
            drawn
                .truth
                .points
                .iter()
                .map(move |p| self.camera.project(&pose.apply(&Vec3::new(p.x, p.y, 0.0))))
        });
        let pixels = pixels.collect::<Option<Vec<_>>>()?;
        Some(DVector::from_iterator(2 * pixels.len(), pixels.iter().flat_map(|p| [p.x, p.y])))
    }
}
