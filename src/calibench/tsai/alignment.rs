//! Stage 1: where does a point appear from the principal point? In the direction of its camera coordinates
//! `(x, y)`, whatever focal length, depth and radial lens.
//!
//! ```text
//! Y_d (r1 X + r2 Y + r3 Z + T_x) - X_d (r4 X + r5 Y + r6 Z + T_y) = 0
//! ```
//! (Tsai 1987, section II-A). A plane has no Z: 6 unknowns up to scale, else 8. The null vector is that of
//! least singular value; its scale follows from rows of R having length 1, its sign from points lying before
//! the camera.

use super::frame::TargetFrame;
use super::{Assumed, SpatialView, TsaiError};
use crate::geometry::{Mat3, Vec2, Vec3, rotation};
use nalgebra::{DMatrix, DVector, Matrix2, RowVector3};

/// The second-smallest singular value must exceed the largest by this part: half of the digits are lost in
/// squares.
const LEAST_SECOND: f64 = 1e-6;
/// And the smallest, which is what noise and a wrong principal point make of 0, by this factor: with less the
/// null vector is any of two.
const ABOVE_NOISE: f64 = 3.0;

/// A view whose rotation and sideways position are known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Aligned {
    /// Of the target's frame.
    pub rotation: Mat3,
    /// T_x and T_y, in the frame's unit.
    pub translation: Vec2,
    /// fy over fx.
    pub fy_per_fx: f64,
    /// Points in the frame.
    pub points: Vec<Vec3>,
    /// `(X_d, Y_d)`, px.
    pub seen: Vec<Vec2>,
}

pub(super) fn align(
    view: &SpatialView,
    frame: &TargetFrame,
    assumed: &Assumed,
) -> Result<Aligned, TsaiError> {
    let is_flat = frame.is_flat();
    let need = if is_flat { 5 } else { 7 };
    if view.len() < need {
        return Err(TsaiError::TooFewPoints { need, got: view.len(), is_flat });
    }
    if is_flat && assumed.fy_per_fx.is_none() {
        return Err(TsaiError::RatioOfPlane);
    }
    let points: Vec<Vec3> = view.points().iter().map(|p| frame.of_point(p)).collect();
    let mut fy_per_fx = assumed.fy_per_fx.unwrap_or(1.0);
    let from_centre =
        |pixel: &Vec2| (pixel - assumed.principal_point_px).component_mul(&Vec2::new(fy_per_fx, 1.0));
    let mut seen: Vec<Vec2> = view.pixels().iter().map(from_centre).collect();
    let null = null_vector(&points, &seen, is_flat)?;
    let mut rows = Rows::of(&null, is_flat, &points, &seen);
    if assumed.fy_per_fx.is_none() {
        // The first row has the length fx / fy, which is the paper's s_x.
        fy_per_fx = rows.y.norm() / rows.x.norm();
        rows.x *= fy_per_fx;
        rows.shift.x *= fy_per_fx;
        seen.iter_mut().for_each(|pixel| pixel.x *= fy_per_fx);
    }
    let (rotation, scale) = if is_flat { rows.of_plane() } else { rows.of_solid() };
    Ok(Aligned { rotation, translation: scale * rows.shift, fy_per_fx, points, seen })
}

/// The unknowns `r1 .. T_x, r4 .. T_y` up to scale and sign.
fn null_vector(points: &[Vec3], seen: &[Vec2], is_flat: bool) -> Result<DVector<f64>, TsaiError> {
    let size = (seen.iter().map(Vec2::norm_squared).sum::<f64>() / seen.len() as f64).sqrt();
    let of_point = |p: &Vec3| if is_flat { vec![p.x, p.y, 1.0] } else { vec![p.x, p.y, p.z, 1.0] };
    let half = if is_flat { 3 } else { 4 };
    let mut normal = DMatrix::<f64>::zeros(2 * half, 2 * half);
    for (point, seen) in points.iter().zip(seen) {
        let place = of_point(point);
        let factor = |j: usize| if j < half { seen.y / size } else { -seen.x / size };
        let row = DVector::from_fn(2 * half, |j, _| factor(j) * place[j % half]);
        normal += &row * row.transpose();
    }
    let eigen = normal.symmetric_eigen();
    let mut order: Vec<usize> = (0..2 * half).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let singular = |k: usize| eigen.eigenvalues[order[k]].max(0.0).sqrt();
    let largest = singular(2 * half - 1);
    let (smallest, second) = (singular(0) / largest, singular(1) / largest);
    if second > (ABOVE_NOISE * smallest).max(LEAST_SECOND) {
        Ok(eigen.eigenvectors.column(order[0]).into_owned())
    } else {
        Err(TsaiError::Singular { smallest, second })
    }
}

/// The first two rows of R and of T, up to one positive factor.
struct Rows {
    x: RowVector3<f64>,
    y: RowVector3<f64>,
    shift: Vec2,
}

impl Rows {
    /// With the sign with which points lie before the camera: `(x, y)` in the direction of `(X_d, Y_d)`.
    fn of(null: &DVector<f64>, is_flat: bool, points: &[Vec3], seen: &[Vec2]) -> Rows {
        let half = null.len() / 2;
        let row = |from: usize| {
            RowVector3::new(null[from], null[from + 1], if is_flat { 0.0 } else { null[from + 2] })
        };
        let rows = Rows { x: row(0), y: row(half), shift: Vec2::new(null[half - 1], null[2 * half - 1]) };
        let along = |(p, s): (&Vec3, &Vec2)| {
            s.x * ((rows.x * p)[0] + rows.shift.x) + s.y * ((rows.y * p)[0] + rows.shift.y)
        };
        let sign = if points.iter().zip(seen).map(along).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        Rows { x: sign * rows.x, y: sign * rows.y, shift: sign * rows.shift }
    }

    /// R of a plane, and the factor that makes its rows unit vectors.
    ///
    /// Rows of a rotation without their last numbers `w` are `A` with `A A^T = I - w w^T`: one singular value
    /// is 1, the other the cosine of the tilt, and `w` is its singular vector by the sine. Both signs of `w`
    /// fit; they are the two tilts of the plane, of which stage 2 tells by the sign of f.
    fn of_plane(&self) -> (Mat3, f64) {
        let svd = Matrix2::new(self.x[0], self.x[1], self.y[0], self.y[1]).svd(true, false);
        let u = svd.u.unwrap_or_else(Matrix2::identity);
        let (large, small) = if svd.singular_values[0] >= svd.singular_values[1] { (0, 1) } else { (1, 0) };
        let scale = 1.0 / svd.singular_values[large];
        let cosine = scale * svd.singular_values[small];
        let w = u.column(small) * ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
        let first = Vec3::new(scale * self.x[0], scale * self.x[1], w[0]);
        let second = Vec3::new(scale * self.y[0], scale * self.y[1], w[1]);
        (Mat3::from_rows(&[first.transpose(), second.transpose(), first.cross(&second).transpose()]), scale)
    }

    /// R of a target in three dimensions: the rotation nearest to the rows, which noise leaves neither of one
    /// length nor quite at right angles.
    fn of_solid(&self) -> (Mat3, f64) {
        let (first, second) = (self.x.normalize(), self.y.normalize());
        let third = first.transpose().cross(&second.transpose()).transpose();
        let rows = Mat3::from_rows(&[first, second, third]);
        let scale = 2.0 / (self.x.norm() + self.y.norm());
        (rotation::nearest(&rows).unwrap_or(rows), scale)
    }
}
