//! What does one view say about the unknowns? The normal equations of a view, summed over its points.
//!
//! Unknowns of a view: the `n` free intrinsics, then its six pose parameters. With the Jacobian `J = [J_a
//! J_c]` of a point's residual (predicted - observed) and the weight `w` of the loss, a view contributes `A
//! += w J_a^T J_a`, `B = sum w J_a^T J_c`, `C = sum w J_c^T J_c` and the gradients `J^T w r`.

use super::Loss;
use super::blocks::{Intrinsics, N, ViewBlock};
use super::chunks::{self, CHUNK};
use super::kernel::{self, INTRINSICS_SLOTS, Sums};
use super::system::System;
use crate::camera::{Camera, FreeParameters, Parameter};
use crate::geometry::lanes::PairBlocks;
use crate::geometry::{Pose, Vec2};
use nalgebra::SVector;

/// The observations of one view as the kernel reads them: target point and pixel.
pub(super) type Observations = PairBlocks;

/// The intrinsics' share of some views.
struct Share {
    square: Intrinsics,
    gradient: SVector<f64, N>,
    cost: f64,
}

impl Share {
    fn zero() -> Share {
        Share { square: Intrinsics::zeros(), gradient: SVector::zeros(), cost: 0.0 }
    }
}

/// Fills the system with the normal equations of all views. `None` where a point is not in front of the
/// camera.
///
/// Views are summed in chunks of fixed size, and the chunks in order: the result is the same whoever computes
/// them.
pub(super) fn fill(
    system: &mut System,
    camera: &Camera,
    cam_from_target: &[Pose],
    observations: &[Observations],
    loss: Loss,
    fy_per_fx: Option<f64>,
) -> Option<()> {
    let free = system.free;
    let radial = kernel::is_radial(camera, free);
    let columns = Columns::of(free, fy_per_fx);
    // Every entry that is ever read is written below; the rest stays 0.
    system.views.resize_with(observations.len(), ViewBlock::zero);
    let mut total = Some(Share::zero());
    let chunk = |index: usize, blocks: &mut [ViewBlock]| {
        let (mut share, mut sums) = (Share::zero(), kernel::NO_SUMS);
        for (k, block) in blocks.iter_mut().enumerate() {
            let view = index * CHUNK + k;
            let (pose, pairs) = (&cam_from_target[view], &observations[view]);
            kernel::view_sums(camera, pose, pairs, loss, radial, &mut sums)?;
            columns.spread(&sums, &mut share, block);
        }
        Some(share)
    };
    chunks::fold(&mut system.views, chunk, |share| {
        total = match (total.take(), share) {
            (Some(mut sum), Some(part)) => {
                sum.square += part.square;
                sum.gradient += part.gradient;
                sum.cost += part.cost;
                Some(sum)
            }
            _ => None,
        };
    });
    let mut total = total?;
    total.square.fill_lower_triangle_with_upper_triangle();
    (system.intrinsics, system.gradient, system.cost) = (total.square, total.gradient, total.cost);
    Some(())
}

/// The free parameters in order.
struct Columns {
    parameters: [Parameter; Parameter::COUNT],
    n: usize,
    /// fy over fx, if fx is free and fy tied to it.
    fy_per_fx: Option<f64>,
}

impl Columns {
    fn of(free: FreeParameters, fy_per_fx: Option<f64>) -> Columns {
        let mut parameters = Parameter::ALL;
        for (slot, parameter) in parameters.iter_mut().zip(free.iter()) {
            *slot = parameter;
        }
        Columns { parameters, n: free.len(), fy_per_fx: fy_per_fx.filter(|_| free.contains(Parameter::Fx)) }
    }

    /// Hands the sums of a view to its block and adds the intrinsics' share (upper triangle).
    fn spread(&self, sums: &Sums, share: &mut Share, block: &mut ViewBlock) {
        let parameters = &self.parameters[..self.n];
        for (i, &a) in parameters.iter().enumerate() {
            for (j, &b) in parameters.iter().enumerate().skip(i) {
                let (row, column) = INTRINSICS_SLOTS[a as usize][b as usize];
                share.square[(i, j)] += sums[usize::from(row)][usize::from(column)];
            }
            share.gradient[i] += kernel::gradient(sums, a);
            for j in 0..6 {
                block.coupling[(i, j)] = kernel::coupling(sums, a, j);
            }
        }
        if let Some(ratio) = self.fy_per_fx {
            self.add_tied(ratio, sums, share, block);
        }
        share.cost += kernel::cost(sums);
        for i in 0..6 {
            for (j, &sum) in sums[i].iter().enumerate().take(6).skip(i) {
                block.pose[(i, j)] = sum;
                block.pose[(j, i)] = sum;
            }
            block.gradient[i] = kernel::pose_gradient(sums, i);
        }
    }
}

impl Columns {
    /// Turns the column of fx, the first, into `d/dfx + a d/dfy`.
    fn add_tied(&self, ratio: f64, sums: &Sums, share: &mut Share, block: &mut ViewBlock) {
        let by_fy = |parameter: Parameter| {
            let (row, column) = INTRINSICS_SLOTS[Parameter::Fy as usize][parameter as usize];
            sums[usize::from(row)][usize::from(column)]
        };
        share.square[(0, 0)] += ratio * ratio * by_fy(Parameter::Fy) + 2.0 * ratio * by_fy(Parameter::Fx);
        for (j, &other) in self.parameters.iter().enumerate().take(self.n).skip(1) {
            share.square[(0, j)] += ratio * by_fy(other);
        }
        share.gradient[0] += ratio * kernel::gradient(sums, Parameter::Fy);
        for j in 0..6 {
            block.coupling[(0, j)] += ratio * kernel::coupling(sums, Parameter::Fy, j);
        }
    }
}

/// The pixel that the kernel predicts, or `None` behind the camera.
fn predict(camera: &Camera, cam_from_target: &Pose, point: &Vec2) -> Option<Vec2> {
    let r = &cam_from_target.rotation;
    let q = r.column(0) * point.x + r.column(1) * point.y;
    camera.project(&(q + cam_from_target.translation))
}

/// The Fisher information of a scene: normal equations at given parameters, for unit noise, with every point
/// of `points` seen in every view. `None` if a point is not in front of the camera.
///
/// Divided by `sigma^2` it is the inverse of the Cramer-Rao bound; its [`System::covariance`] times `sigma^2`
/// is the bound.
///
/// ```
/// use calibench::calibrate::information;
/// use calibench::camera::{FreeParameters, Parameter};
/// use calibench::synth::Truth;
///
/// let truth = Truth::example();
/// let system = information(&truth.camera, FreeParameters::STANDARD, &truth.cam_from_target, &truth.points)
///     .expect("the target is in front of the camera");
/// let unit = system.covariance().expect("tilted views determine the camera");
/// // With noise of 0.1 px no unbiased method finds fx better than this, px.
/// let bound_px = 0.1 * unit.standard_deviation(Parameter::Fx).expect("fx is free");
/// assert!((0.6..0.8).contains(&bound_px));
/// ```
pub fn information(
    camera: &Camera,
    free: FreeParameters,
    cam_from_target: &[Pose],
    points: &[Vec2],
) -> Option<System> {
    let mut system = System::new(free, cam_from_target.len());
    let seen = |pose: &Pose| {
        let pixels: Vec<Vec2> =
            points.iter().map(|p| predict(camera, pose, p)).collect::<Option<Vec<Vec2>>>()?;
        Some(Observations::new(points.iter().copied().zip(pixels)))
    };
    let observations: Vec<Observations> = cam_from_target.iter().map(seen).collect::<Option<_>>()?;
    fill(&mut system, camera, cam_from_target, &observations, Loss::Squares, None)?;
    Some(system)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vec3, rotation};

    #[test]
    fn tied_focal_lengths_follow_the_chain_rule() {
        use Parameter::{Cx, Cy, Fx, Fy, K1};
        let ratio = 1.25;
        let camera = Camera::pinhole(600.0, 750.0, 320.0, 240.0);
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2),
            translation: Vec3::new(5.0, -7.0, 150.0),
        };
        let points = (0..35).map(|i| Vec2::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0) * 12.0);
        let seen = |(i, p): (usize, Vec2)| {
            (
                p,
                predict(&camera, &pose, &p).unwrap()
                    + Vec2::new(libm::sin(i as f64), libm::cos(3.0 * i as f64)),
            )
        };
        let pairs: Vec<(Vec2, Vec2)> = points.enumerate().map(seen).collect();
        let filled = |free: &[Parameter], tie: Option<f64>| {
            let mut system = System::new(FreeParameters::of(free), 1);
            let observations = [Observations::new(pairs.iter().copied())];
            fill(&mut system, &camera, &[pose], &observations, Loss::Squares, tie).unwrap();
            system
        };
        let (untied, tied) = (filled(&[Fx, Fy, Cx, Cy, K1], None), filled(&[Fx, Cx, Cy, K1], Some(ratio)));
        // Columns of the tied problem as combinations of the untied one's.
        let change = nalgebra::SMatrix::<f64, 5, 4>::from_row_slice(&[
            1.0, 0.0, 0.0, 0.0, ratio, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0,
            1.0,
        ]);
        let close = |a: nalgebra::DMatrix<f64>, b: nalgebra::DMatrix<f64>| {
            assert!((&a - &b).amax() < 1e-12 * b.amax(), "{a}{b}");
        };
        let square = untied.intrinsics.fixed_view::<5, 5>(0, 0);
        close(
            nalgebra::DMatrix::from_fn(4, 4, |i, j| tied.intrinsics[(i, j)]),
            nalgebra::DMatrix::from_column_slice(4, 4, (change.transpose() * square * change).as_slice()),
        );
        let gradient = change.transpose() * untied.gradient.fixed_rows::<5>(0);
        close(
            nalgebra::DMatrix::from_fn(4, 1, |i, _| tied.gradient[i]),
            nalgebra::DMatrix::from_column_slice(4, 1, gradient.as_slice()),
        );
        let coupling = change.transpose() * untied.views[0].coupling.fixed_rows::<5>(0);
        close(
            nalgebra::DMatrix::from_fn(4, 6, |i, j| tied.views[0].coupling[(i, j)]),
            nalgebra::DMatrix::from_column_slice(4, 6, coupling.as_slice()),
        );
    }
}
