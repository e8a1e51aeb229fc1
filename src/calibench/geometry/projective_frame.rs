//! How uncertain are the entries of a homography once its coordinate frames are changed?

use super::Mat3;
use nalgebra::SMatrix;

/// The first eight entries of a 3 x 3 matrix scaled to `m33 = 1`, row by row, as a covariance.
pub type EntryCovariance = SMatrix<f64, 8, 8>;

/// The map with entry `index` (0 ... 7, row by row) equal to 1 and all others 0.
pub fn entry(index: usize) -> Mat3 {
    let mut unit = Mat3::zeros();
    unit[(index / 3, index % 3)] = 1.0;
    unit
}

/// The covariance of the entries of `M = left L right`, scaled to `m33 = 1`, from that of `L`, scaled to `l33
/// = 1`.
///
/// First order: `dM = (left dL right - M (left dL right)_33) / (left L right)_33`. Parameters beyond the
/// eighth stay as they are. `None` if `m33` is zero: then the origin maps to infinity and no such scale
/// exists.
pub fn change_frames<const N: usize>(
    left: &Mat3,
    local: &Mat3,
    right: &Mat3,
    covariance: &SMatrix<f64, N, N>,
) -> Option<SMatrix<f64, N, N>> {
    let product = left * local * right;
    let scale = product[(2, 2)];
    if scale == 0.0 {
        return None;
    }
    let matrix = product / scale;
    let mut jacobian = SMatrix::<f64, N, N>::identity();
    for column in 0..8 {
        let moved = left * entry(column) * right;
        let change = (moved - matrix * moved[(2, 2)]) / scale;
        for row in 0..8 {
            jacobian[(row, column)] = change[(row / 3, row % 3)];
        }
    }
    Some(jacobian * covariance * jacobian.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_frames_moves_the_covariance_as_differences_do() {
        let left = Mat3::new(2.0, 0.1, 5.0, 0.0, 1.5, -3.0, 0.0, 0.0, 1.0);
        let right = Mat3::new(0.5, 0.0, 1.0, 0.2, 0.4, 2.0, 0.0, 0.0, 1.0);
        let local = Mat3::new(1.0, 0.2, 0.3, -0.1, 0.9, 0.4, 0.05, -0.02, 1.0);
        let moved = |l: &Mat3| {
            let product = left * l * right;
            product / product[(2, 2)]
        };
        // The covariance of one varying entry is the outer product of the derivative with itself.
        for index in 0..8 {
            let mut covariance = EntryCovariance::zeros();
            covariance[(index, index)] = 1.0;
            let predicted = change_frames(&left, &local, &right, &covariance).unwrap();
            let h = 1e-6;
            let slope = (moved(&(local + entry(index) * h)) - moved(&(local - entry(index) * h))) / (2.0 * h);
            for row in 0..8 {
                for column in 0..8 {
                    let outer = slope[(row / 3, row % 3)] * slope[(column / 3, column % 3)];
                    // Central differences at h = 1e-6 keep 1e-9 of slopes below 10.
                    assert!((predicted[(row, column)] - outer).abs() < 1e-7);
                }
            }
        }
    }

    #[test]
    fn an_origin_at_infinity_has_no_scale() {
        let mut local = Mat3::identity();
        local[(2, 0)] = -1.0;
        let right = Mat3::new(1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        assert_eq!(change_frames(&Mat3::identity(), &local, &right, &EntryCovariance::identity()), None);
    }
}
