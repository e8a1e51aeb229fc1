//! Where are camera and target at once? The closed form of Shah 2013 for `A X = Z B`.

use super::{HandEyeError, Stations};
use crate::geometry::{Mat3, Pose, Vec3, rotation};
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};

/// Shah 2013, section 3: X and Z of `A_i X = Z B_i`, here `A = G`, `Z = Y` and `B = C^-1`.
///
/// With `vec` column by column, `R_A R_X = R_Z R_B` is `(R_B kron R_A) vec(R_X) = vec(R_Z)`. So `vec(R_X)`
/// and `vec(R_Z)` are the right and left singular vectors of `sum R_B kron R_A` with the largest singular
/// value, which is the number of stations where nothing errs. The translations follow from `R_A t_X - t_Z =
/// R_Z t_B - t_A` by least squares, both at once. Every station counts once, where the closed forms of `A X =
/// X B` count pairs; it is not found what each station errs by.
pub(super) fn shah(stations: &Stations<'_>) -> Result<[Pose; 2], HandEyeError> {
    let pairs: Vec<(Pose, Pose)> = (0..stations.base_from_gripper.len())
        .map(|i| (stations.inverse_of_robot(i).inverse(), stations.cam_from_target[i].inverse()))
        .collect();
    let (r_x, r_z) = rotations(&pairs).ok_or(HandEyeError::Singular)?;
    let (t_x, t_z) = translations(&pairs, &r_z).ok_or(HandEyeError::Singular)?;
    Ok([Pose { rotation: r_x, translation: t_x }, Pose { rotation: r_z, translation: t_z }])
}

/// `R_X` and `R_Z`.
fn rotations(pairs: &[(Pose, Pose)]) -> Option<(Mat3, Mat3)> {
    let product: SMatrix<f64, 9, 9> = pairs.iter().map(|(a, b)| b.rotation.kronecker(&a.rotation)).sum();
    let svd = product.svd(true, true);
    let largest = svd.singular_values.imax();
    let of_x: SVector<f64, 9> = svd.v_t?.row(largest).transpose();
    let of_z: SVector<f64, 9> = svd.u?.column(largest).into_owned();
    // The vectors are unit ones of a sign that both share: a rotation has the determinant 1.
    let proper = |v: &SVector<f64, 9>| {
        let matrix = Mat3::from_column_slice(v.as_slice());
        rotation::nearest(&(matrix * matrix.determinant().signum()))
    };
    Some((proper(&of_x)?, proper(&of_z)?))
}

/// `t_X` and `t_Z` for a given `R_Z`.
fn translations(pairs: &[(Pose, Pose)], r_z: &Mat3) -> Option<(Vec3, Vec3)> {
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for (a, b) in pairs {
        let mut matrix = SMatrix::<f64, 3, 6>::zeros();
        matrix.fixed_columns_mut::<3>(0).copy_from(&a.rotation);
        matrix.fixed_columns_mut::<3>(3).copy_from(&-Mat3::identity());
        normal += matrix.transpose() * matrix;
        right += matrix.transpose() * (r_z * b.translation - a.translation);
    }
    let both = normal.cholesky()?.solve(&right);
    Some((both.fixed_rows::<3>(0).into_owned(), both.fixed_rows::<3>(3).into_owned()))
}
