//! Which camera do the homographies alone imply? Zhang's closed form (Zhang 2000, sections 2.3, 3.1, appendix
//! B).

use crate::camera::Camera;
use crate::geometry::{Homography, Mat3, Pose, Vec3};
use nalgebra::{DMatrix, SVector};

/// Why the closed form has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum ClosedFormError {
    /// Two constraints a view against five unknowns, four without skew.
    #[error("the closed form needs at least {need} views ({}), got {got}", if *skew { "with skew" } else { "zero skew" })]
    TooFewViews {
        /// Views needed.
        need: usize,
        /// Views given.
        got: usize,
        /// Whether skew is among the unknowns.
        skew: bool,
    },
    /// The estimated image of the absolute conic is not one of a real camera: parallel views or noise.
    #[error("the closed form found no real camera: the views are parallel, or too noisy for it")]
    NoRealCamera,
}

/// The camera whose absolute conic best meets the constraints of the homographies, without distortion.
///
/// Each `H = [h1 h2 h3]` gives `h1^T B h2 = 0` and `h1^T B h1 = h2^T B h2` for `B ~ K^-T K^-1` (Zhang 2000,
/// eqs. 3, 4). With `b = (B11, B12, B22, B13, B23, B33)` they read `V b = 0` (eqs. 8, 9); `b` is the singular
/// vector of the smallest singular value. Without skew the column of `B12` is left out, which is Zhang's
/// extra equation met exactly.
///
/// The result depends on the scaling of the homographies and of the pixels; Zhang's published values are
/// those for `h33 = 1` and raw pixels.
///
/// # Errors
/// Fewer than 3 views with skew or 2 without; a `B` that is not definite.
///
/// ```
/// use calibench::calibrate::{closed_form, pose_from_homography};
/// use calibench::camera::{BrownConrady, Camera};
/// use calibench::geometry::Homography;
/// use calibench::synth::{Scene, Truth};
///
/// // Without noise and distortion it is exact.
/// let camera = Truth::example_camera().with_distortion(BrownConrady::default());
/// let scene = Scene::new(Truth { camera, ..Truth::example() })?;
/// let of_view = |pixels: &Vec<_>| Homography::fit(&scene.truth.points, pixels).map(|fit| fit.homography);
/// let homographies: Vec<Homography> = scene.pixels().iter().map(of_view).collect::<Result<_, _>>()?;
/// let found: Camera = closed_form(&homographies, false)?;
/// assert!((found.fx - camera.fx).abs() < 1e-6);
/// let pose = pose_from_homography(&found, &homographies[0]).expect("the target is in front of the camera");
/// assert!((pose.translation - scene.truth.cam_from_target[0].translation).norm() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn closed_form(homographies: &[Homography], skew: bool) -> Result<Camera, ClosedFormError> {
    let need = if skew { 3 } else { 2 };
    if homographies.len() < need {
        return Err(ClosedFormError::TooFewViews { need, got: homographies.len(), skew });
    }
    let columns: &[usize] = if skew { &[0, 1, 2, 3, 4, 5] } else { &[0, 2, 3, 4, 5] };
    // At least as many rows as columns, so that the decomposition has a vector for every column.
    let rows = (2 * homographies.len()).max(columns.len());
    let mut v = DMatrix::zeros(rows, columns.len());
    for (i, Homography(h)) in homographies.iter().enumerate() {
        let across = constraint(h, 0, 1);
        let difference = constraint(h, 0, 0) - constraint(h, 1, 1);
        for (j, &column) in columns.iter().enumerate() {
            v[(2 * i, j)] = across[column];
            v[(2 * i + 1, j)] = difference[column];
        }
    }
    if !v.iter().all(|x| x.is_finite()) {
        return Err(ClosedFormError::NoRealCamera);
    }
    let svd = v.svd(false, true);
    let v_t = svd.v_t.ok_or(ClosedFormError::NoRealCamera)?;
    let smallest = svd.singular_values.imin();
    let mut b = [0.0; 6];
    for (j, &column) in columns.iter().enumerate() {
        b[column] = v_t[(smallest, j)];
    }
    camera_from_conic(b)
}

/// `v_ij` of Zhang 2000, eq. 7.
fn constraint(h: &Mat3, i: usize, j: usize) -> SVector<f64, 6> {
    let (a, b) = (h.column(i), h.column(j));
    SVector::from([
        a[0] * b[0],
        a[0] * b[1] + a[1] * b[0],
        a[1] * b[1],
        a[2] * b[0] + a[0] * b[2],
        a[2] * b[1] + a[1] * b[2],
        a[2] * b[2],
    ])
}

/// Zhang 2000, appendix B: alpha = fx, beta = fy, gamma = skew, (u0, v0) = (cx, cy).
fn camera_from_conic([b11, b12, b22, b13, b23, b33]: [f64; 6]) -> Result<Camera, ClosedFormError> {
    let minor = b11 * b22 - b12 * b12;
    let v0 = (b12 * b13 - b11 * b23) / minor;
    let lambda = b33 - (b13 * b13 + v0 * (b12 * b13 - b11 * b23)) / b11;
    let alpha_sq = lambda / b11;
    let beta_sq = lambda * b11 / minor;
    if !(alpha_sq > 0.0 && beta_sq > 0.0 && alpha_sq.is_finite() && beta_sq.is_finite()) {
        return Err(ClosedFormError::NoRealCamera);
    }
    let (alpha, beta) = (alpha_sq.sqrt(), beta_sq.sqrt());
    let gamma = -b12 * alpha_sq * beta / lambda;
    let u0 = gamma * v0 / beta - b13 * alpha_sq / lambda;
    Ok(Camera { skew: gamma, ..Camera::pinhole(alpha, beta, u0, v0) })
}

/// The pose of a target with the given homography, for a camera without distortion (Zhang 2000, section 3.1):
/// the columns of `K^-1 H` are `r1`, `r2`, `t` up to scale; the nearest rotation is taken. `None` if the
/// target would lie at or behind the camera, or is not finite.
pub fn pose_from_homography(camera: &Camera, homography: &Homography) -> Option<Pose> {
    let columns = camera.k().try_inverse()? * homography.0;
    let (a, b, c) = (columns.column(0), columns.column(1), columns.column(2));
    let mut scale = 2.0 / (a.norm() + b.norm());
    if c[2] < 0.0 {
        scale = -scale;
    }
    let rotation = nearest_rotation(&(a * scale), &(b * scale));
    let pose = Pose { rotation, translation: c * scale };
    (pose.is_finite() && pose.translation.z > 0.0).then_some(pose)
}

/// The rotation nearest to `[r1, r2, r1 x r2]`, not finite if `r1` and `r2` are parallel.
///
/// The third column stands on the first two, so the polar factor falls apart: with `G = [r1 r2]^T [r1 r2]`
/// the first two columns are `[r1 r2] G^(-1/2)`, and a 2 x 2 root is `G^(1/2) = (G + d I) / sqrt(trace G + 2
/// d)`, `d = sqrt(det G)` (Higham 2008, section 6.1).
fn nearest_rotation(r1: &Vec3, r2: &Vec3) -> Mat3 {
    let (g11, g12, g22) = (r1.norm_squared(), r1.dot(r2), r2.norm_squared());
    // |r1 x r2| is the root of the determinant without cancellation.
    let root = r1.cross(r2).norm();
    // G^(-1/2) = adj(G + d I) / (sqrt(trace G + 2 d) d).
    let factor = 1.0 / ((g11 + g22 + 2.0 * root).sqrt() * root);
    let first = (r1 * (g22 + root) - r2 * g12) * factor;
    let second = (r2 * (g11 + root) - r1 * g12) * factor;
    Mat3::from_columns(&[first, second, first.cross(&second)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation;

    fn views(camera: &Camera, degrees: &[[f64; 3]]) -> Vec<Homography> {
        degrees
            .iter()
            .map(|d| {
                let r = rotation::from_xyz_rad(d[0].to_radians(), d[1].to_radians(), d[2].to_radians());
                let h = camera.k()
                    * Mat3::from_columns(&[
                        r.column(0).into(),
                        r.column(1).into(),
                        Vec3::new(3.0, -2.0, 120.0),
                    ]);
                Homography(h / h[(2, 2)])
            })
            .collect()
    }

    #[test]
    fn exact_homographies_give_the_exact_camera() {
        let camera = Camera { skew: 2.0, ..Camera::pinhole(600.0, 610.0, 326.0, 243.0) };
        let degrees = [[20.0, 0.0, 0.0], [0.0, -20.0, 0.0], [-15.0, 15.0, 10.0]];
        let found = closed_form(&views(&camera, &degrees), true).unwrap();
        for (a, b) in found.parameters().iter().zip(camera.parameters()) {
            assert!((a - b).abs() < 1e-7, "{found:?}");
        }
        let square = Camera { skew: 0.0, ..camera };
        let found = closed_form(&views(&square, &degrees[1..]), false).unwrap();
        assert!((found.fx - 600.0).abs() < 1e-7 && found.skew == 0.0);
        let pose = pose_from_homography(&square, &views(&square, &degrees)[2]).unwrap();
        assert!((pose.translation - Vec3::new(3.0, -2.0, 120.0)).norm() < 1e-9);
    }

    #[test]
    fn the_rotation_is_the_nearest() {
        for (r1, r2) in [
            (Vec3::new(1.0, 0.1, -0.2), Vec3::new(0.05, 0.8, 0.3)),
            (Vec3::new(0.2, 0.0, 0.9), Vec3::new(-0.1, 1.2, 0.3)),
        ] {
            let expected = rotation::nearest(&Mat3::from_columns(&[r1, r2, r1.cross(&r2)])).unwrap();
            assert!((nearest_rotation(&r1, &r2) - expected).norm() < 1e-14);
        }
    }

    #[test]
    fn too_few_views_are_refused() {
        let homographies =
            views(&Camera::pinhole(600.0, 600.0, 320.0, 240.0), &[[20.0, 0.0, 0.0], [0.0, 20.0, 0.0]]);
        assert!(matches!(
            closed_form(&homographies, true),
            Err(ClosedFormError::TooFewViews { need: 3, got: 2, skew: true })
        ));
        assert!(matches!(
            closed_form(&homographies[..1], false),
            Err(ClosedFormError::TooFewViews { need: 2, .. })
        ));
    }

    #[test]
    fn only_a_definite_conic_is_of_a_real_camera() {
        // K^-T K^-1 of fx = 2, fy = 4 about the centre, at any scale.
        for scale in [1.0, -3.0] {
            let found = camera_from_conic([0.25 * scale, 0.0, 0.0625 * scale, 0.0, 0.0, scale]).unwrap();
            assert_eq!((found.fx, found.fy, found.cx, found.cy), (2.0, 4.0, 0.0, 0.0));
        }
        for signs in [[-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0], [0.0, 1.0, 1.0]] {
            let [b11, b22, b33] = signs;
            let refused = camera_from_conic([b11, 0.0, b22, 0.0, 0.0, b33]);
            assert_eq!(refused, Err(ClosedFormError::NoRealCamera), "{signs:?}");
        }
    }
}
