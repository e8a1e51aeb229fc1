//! Where was the target in a view of a camera that is known? From the rays of its marks, linear.
//!
//! With the ray `b` of a mark at `X`, `b x (P (X, 1)) = 0` for the 3 x 4 matrix `P ~ [R | t]`: two equations
//! a mark, eleven unknowns, so six marks that are not in one plane (the direct linear transform of Abdel-Aziz
//! & Karara 1971, with rays in the place of pixels, so that it needs no pinhole). Marks near a plane have
//! [`locate`].

use super::data::Data;
use super::descent::descend;
use super::problem::{Problem, State};
use super::shape::NEARLY_FLAT;
use crate::board::View;
use crate::calibrate::locate;
use crate::camera::{Camera, FreeParameters, Lens};
use crate::geometry::{Mat3, Pose, Vec3};
use nalgebra::{SMatrix, SVector};

/// Marks for a pose where they are in space, and where they are in a plane.
pub(super) const IN_SPACE: usize = 6;
pub(super) const IN_PLANE: usize = 4;
/// Marks thinner than this leave the linear equations of space singular but for rounding and noise.
const SPATIAL: f64 = 1e-2;
/// Steps of a pose from its linear start.
const STEPS: usize = 20;

/// Poses of all views, each refined alone; `None` where a view has none.
pub(super) fn with_poses(data: &Data, camera: &Camera<Lens>) -> Option<State> {
    let views = 0..data.views.len();
    let cam_from_target = views.map(|view| pose(data, view, camera)).collect::<Option<Vec<Pose>>>()?;
    Some(State { camera: *camera, cam_from_target, offsets: vec![0.0; data.unknown_deviations.len()] })
}

/// The better of what a plane and what space lead to.
fn pose(data: &Data, view: usize, camera: &Camera<Lens>) -> Option<Pose> {
    let shape = data.shape(view);
    let flat = (shape.thickness() < NEARLY_FLAT).then(|| in_plane(data, view, camera)).flatten();
    let is_spatial = shape.thickness() > SPATIAL && data.views[view].len() >= IN_SPACE;
    let spatial = is_spatial.then(|| in_space(data, view, camera)).flatten();
    let start = [flat, spatial].into_iter().flatten().filter_map(|pose| refined(data, view, camera, pose));
    start.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pose)| pose)
}

/// The pose of one view refined alone, the camera and the marks held, and its cost.
pub(super) fn refined(data: &Data, view: usize, camera: &Camera<Lens>, pose: Pose) -> Option<(f64, Pose)> {
    let offsets = vec![0.0; data.unknown_deviations.len()];
    let state = State { camera: *camera, cam_from_target: vec![pose], offsets };
    let found = descend(&poses_alone(&data.with_views(&[view])), state)?;
    Some((found.equations.cost, found.state.cam_from_target[0]))
}

/// The problem in which nothing but poses is unknown.
fn poses_alone(data: &Data) -> Problem<'_> {
    Problem {
        data,
        free: FreeParameters::NONE,
        fy_per_fx: None,
        priors: &[],
        variance: 0.0,
        moves_marks: false,
        moves_poses: true,
        max_iterations: STEPS,
    }
}

fn in_plane(data: &Data, view: usize, camera: &Camera<Lens>) -> Option<Pose> {
    let plane = data.shape(view).plane_from_points();
    let seen = || data.views[view].iter();
    let points = seen().map(|seen| plane.apply(&data.positions[seen.mark]).xy()).collect();
    let flat = View::new(points, seen().map(|seen| seen.pixel).collect()).ok()?;
    Some(locate(camera, &flat)?.cam_from_target.compose(&plane))
}

fn in_space(data: &Data, view: usize, camera: &Camera<Lens>) -> Option<Pose> {
    let shape = data.shape(view);
    let size = shape.extents.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut normal = SMatrix::<f64, 12, 12>::zeros();
    let mut rays = Vec::with_capacity(data.views[view].len());
    for seen in &data.views[view] {
        let Ok(ray) = camera.ray(&seen.pixel) else { continue };
        let p = (data.positions[seen.mark] - shape.centre) / size;
        let point = [p.x, p.y, p.z, 1.0];
        // Two directions across the ray: P X has no part along them.
        let other = if ray.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
        let first = ray.cross(&other).normalize();
        for across in [first, ray.cross(&first)] {
            let row = SVector::<f64, 12>::from_fn(|i, _| point[i % 4] * across[i / 4]);
            normal += row * row.transpose();
        }
        rays.push((p, ray));
    }
    if rays.len() < IN_SPACE {
        return None;
    }
    let eigen = normal.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let turn = Mat3::from_fn(|i, j| least[4 * i + j]);
    let shift = Vec3::new(least[3], least[7], least[11]);
    let along: f64 = rays.iter().map(|(p, ray)| (turn * p + shift).dot(ray)).sum();
    let (turn, shift) = if along < 0.0 { (-turn, -shift) } else { (turn, shift) };
    // A mirrored target would have a negative determinant; its nearest rotation is a start that leads
    // nowhere.
    let svd = turn.svd(true, true);
    let scale = svd.singular_values.sum() / 3.0;
    let rotation = crate::geometry::rotation::nearest(&turn)?;
    let translation = shift * (size / scale) - rotation * shape.centre;
    let pose = Pose { rotation, translation };
    pose.is_finite().then_some(pose)
}
