//! What does one view say about the unknowns? The normal equations of a view, summed over its points.
//!
//! Unknowns of a view: the `n` free intrinsics, then its six pose parameters. With the Jacobian `J = [J_a J_c]` of a point's
//! residual (predicted - observed) and the weight `w` of the loss, a view contributes
//! `A += w J_a^T J_a`, `B = sum w J_a^T J_c`, `C = sum w J_c^T J_c` and the gradients `J^T w r`.

use super::Loss;
use super::system::{System, ViewBlock};
use crate::camera::{Camera, FreeParameters, Parameter};
use crate::geometry::{Pose, Vec2};
use nalgebra::{SMatrix, SVector};

/// Most unknowns that one point can depend on: all intrinsics and a pose.
const MOST: usize = Parameter::COUNT + 6;

/// The observations of one view as the kernel reads them.
#[derive(Debug, Clone)]
pub(super) struct Observations {
    /// Target point and pixel.
    pub pairs: Vec<(Vec2, Vec2)>,
}

/// Sums over the points of a view, before they are split into blocks.
struct Sums {
    /// Upper triangle of `J^T w J`.
    square: [[f64; MOST]; MOST],
    gradient: [f64; MOST],
    cost: f64,
}

/// Adds one view to the system. Returns `None` where a point is not in front of the camera.
pub(super) fn add_view(
    system: &mut System,
    camera: &Camera,
    free: FreeParameters,
    cam_from_target: &Pose,
    observations: &Observations,
    loss: Loss,
) -> Option<()> {
    let sums = sum_points(camera, free, cam_from_target, observations, loss)?;
    let n = free.len();
    let mut block = ViewBlock {
        coupling: SMatrix::zeros(),
        pose: SMatrix::zeros(),
        gradient: SVector::from_fn(|i, _| sums.gradient[n + i]),
    };
    for i in 0..n {
        for j in i..n {
            system.intrinsics[(i, j)] += sums.square[i][j];
            if i != j {
                system.intrinsics[(j, i)] += sums.square[i][j];
            }
        }
        for j in 0..6 {
            block.coupling[(i, j)] = sums.square[i][n + j];
        }
        system.gradient[i] += sums.gradient[i];
    }
    for i in 0..6 {
        for j in i..6 {
            block.pose[(i, j)] = sums.square[n + i][n + j];
            block.pose[(j, i)] = sums.square[n + i][n + j];
        }
    }
    system.views.push(block);
    system.cost += sums.cost;
    Some(())
}

fn sum_points(
    camera: &Camera,
    free: FreeParameters,
    cam_from_target: &Pose,
    observations: &Observations,
    loss: Loss,
) -> Option<Sums> {
    let mut columns = [0usize; MOST];
    let n = free.len();
    for (slot, parameter) in columns.iter_mut().zip(free.iter()) {
        *slot = parameter as usize;
    }
    for i in 0..6 {
        columns[n + i] = Parameter::COUNT + i;
    }
    let active = &columns[..n + 6];
    let mut sums = Sums { square: [[0.0; MOST]; MOST], gradient: [0.0; MOST], cost: 0.0 };
    for (point, pixel) in &observations.pairs {
        let rows = point_rows(camera, cam_from_target, point)?;
        let (ru, rv) = (rows.pixel.x - pixel.x, rows.pixel.y - pixel.y);
        let (cost, weight) = loss.at(ru * ru + rv * rv);
        sums.cost += cost;
        for (i, &a) in active.iter().enumerate() {
            let (wu, wv) = (weight * rows.u[a], weight * rows.v[a]);
            sums.gradient[i] += wu * ru + wv * rv;
            for (j, &b) in active.iter().enumerate().skip(i) {
                sums.square[i][j] += wu * rows.u[b] + wv * rows.v[b];
            }
        }
    }
    Some(sums)
}

/// A predicted pixel and the two rows of its Jacobian: ten intrinsics, then six pose parameters.
struct PointRows {
    pixel: Vec2,
    u: [f64; MOST],
    v: [f64; MOST],
}

/// [`crate::camera::project_with_jacobian`], written out in scalars for points with Z = 0.
fn point_rows(camera: &Camera, cam_from_target: &Pose, point: &Vec2) -> Option<PointRows> {
    let (r, t, lens) = (&cam_from_target.rotation, &cam_from_target.translation, &camera.distortion);
    let (qx, qy, qz) = (
        r[(0, 0)] * point.x + r[(0, 1)] * point.y,
        r[(1, 0)] * point.x + r[(1, 1)] * point.y,
        r[(2, 0)] * point.x + r[(2, 1)] * point.y,
    );
    let depth = qz + t.z;
    if depth.is_nan() || depth <= 0.0 {
        return None;
    }
    let inverse_depth = 1.0 / depth;
    let (x, y) = ((qx + t.x) * inverse_depth, (qy + t.y) * inverse_depth);

    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    let g = 1.0 + s * (lens.k1 + s * (lens.k2 + s * lens.k3));
    let twice_slope = 2.0 * (lens.k1 + s * (2.0 * lens.k2 + s * 3.0 * lens.k3));
    let (tx, ty) = (s + 2.0 * xx, s + 2.0 * yy);
    let xd = x * g + 2.0 * lens.p1 * xy + lens.p2 * tx;
    let yd = y * g + lens.p1 * ty + 2.0 * lens.p2 * xy;
    let cross = twice_slope * xy + 2.0 * (lens.p1 * x + lens.p2 * y);
    let xd_by_x = g + twice_slope * xx + 2.0 * lens.p1 * y + 6.0 * lens.p2 * x;
    let yd_by_y = g + twice_slope * yy + 6.0 * lens.p1 * y + 2.0 * lens.p2 * x;

    // Derivatives of the pixel by the ideal point, then by the point in camera coordinates.
    let (ux, uy) = (camera.fx * xd_by_x + camera.skew * cross, camera.fx * cross + camera.skew * yd_by_y);
    let (vx, vy) = (camera.fy * cross, camera.fy * yd_by_y);
    let by_point = |dx: f64, dy: f64| {
        let (a, b) = (dx * inverse_depth, dy * inverse_depth);
        [a, b, -(a * x + b * y)]
    };
    let (pu, pv) = (by_point(ux, uy), by_point(vx, vy));
    // d X_c / d delta = -[q]x, so the row is p x q taken as q x ... : -(p^T [q]x) = (q x p)^T.
    let by_rotation = |p: [f64; 3]| [qy * p[2] - qz * p[1], qz * p[0] - qx * p[2], qx * p[1] - qy * p[0]];
    let (du, dv) = (by_rotation(pu), by_rotation(pv));

    let lens_columns = |lx: f64, ly: f64| (camera.fx * lx + camera.skew * ly, camera.fy * ly);
    let (k1u, k1v) = lens_columns(x * s, y * s);
    let (p1u, p1v) = lens_columns(2.0 * xy, ty);
    let (p2u, p2v) = lens_columns(tx, 2.0 * xy);
    Some(PointRows {
        pixel: Vec2::new(camera.fx * xd + camera.skew * yd + camera.cx, camera.fy * yd + camera.cy),
        u: [
            xd,
            0.0,
            1.0,
            0.0,
            yd,
            k1u,
            k1u * s,
            p1u,
            p2u,
            k1u * s * s,
            du[0],
            du[1],
            du[2],
            pu[0],
            pu[1],
            pu[2],
        ],
        v: [
            0.0,
            yd,
            0.0,
            1.0,
            0.0,
            k1v,
            k1v * s,
            p1v,
            p2v,
            k1v * s * s,
            dv[0],
            dv[1],
            dv[2],
            pv[0],
            pv[1],
            pv[2],
        ],
    })
}

/// The pixel that the kernel predicts, or `None` behind the camera.
pub(super) fn predict(camera: &Camera, cam_from_target: &Pose, point: &Vec2) -> Option<Vec2> {
    let r = &cam_from_target.rotation;
    let q = r.column(0) * point.x + r.column(1) * point.y;
    camera.project(&(q + cam_from_target.translation))
}

/// The Fisher information of a scene: normal equations at given parameters, for unit noise, with every point of `points`
/// seen in every view. `None` if a point is not in front of the camera.
///
/// Divided by `sigma^2` it is the inverse of the Cramer-Rao bound; its [`System::covariance`] times `sigma^2` is the bound.
pub fn information(
    camera: &Camera,
    free: FreeParameters,
    cam_from_target: &[Pose],
    points: &[Vec2],
) -> Option<System> {
    let mut system = System::new(free, cam_from_target.len());
    for pose in cam_from_target {
        let pairs = points.iter().map(|p| Some((*p, predict(camera, pose, p)?))).collect::<Option<_>>()?;
        add_view(&mut system, camera, free, pose, &Observations { pairs }, Loss::Squares)?;
    }
    Some(system)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::project_with_jacobian;
    use crate::geometry::{Vec3, rotation};

    #[test]
    fn the_kernel_agrees_with_the_readable_jacobian() {
        let camera =
            Camera::from_parameters([600.0, 580.0, 326.0, 243.0, 1.5, -0.2, 0.05, 1e-3, -2e-3, 0.01]);
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2),
            translation: Vec3::new(5.0, -7.0, 150.0),
        };
        for point in [Vec2::new(-40.0, 30.0), Vec2::new(13.0, 0.0), Vec2::new(0.0, -21.0)] {
            let kernel = point_rows(&camera, &pose, &point).unwrap();
            let plain = project_with_jacobian(&camera, &pose, &Vec3::new(point.x, point.y, 0.0)).unwrap();
            // Same formulas in another order: a few ulp of the largest entry, a focal length.
            assert!((kernel.pixel - plain.pixel).norm() < 1e-12);
            for i in 0..MOST {
                let column: Vec2 =
                    if i < 10 { plain.intrinsics.column(i).into() } else { plain.pose.column(i - 10).into() };
                assert!((kernel.u[i] - column.x).abs() < 1e-11, "column {i}");
                assert!((kernel.v[i] - column.y).abs() < 1e-11, "column {i}");
            }
        }
    }
}
