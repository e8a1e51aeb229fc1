//! How does a small rotation become a matrix, and a matrix an angle? The exponential and logarithm of SO(3).

use super::{Mat3, Vec3};

/// Below this angle the Taylor series of `sin(a)/a` and `(1 - cos(a))/a^2` to second order is exact to
/// rounding: its first neglected term is `a^4 / 120 < 1e-18`.
const SMALL_ANGLE_RAD: f64 = 1e-4;

/// The cross-product matrix: `skew(a) b = a x b`.
pub fn skew(a: &Vec3) -> Mat3 {
    Mat3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// The rotation matrix `exp([w]x)` of a rotation vector `w` in radians (axis times angle).
///
/// Rodrigues' formula: `I + sin(a)/a [w]x + (1 - cos(a))/a^2 [w]x^2`, `a = |w|` (Rodrigues 1840).
pub fn exp(w: &Vec3) -> Mat3 {
    let angle_sq = w.norm_squared();
    let angle = angle_sq.sqrt();
    let (sine_ratio, cosine_ratio) = if angle < SMALL_ANGLE_RAD {
        (1.0 - angle_sq / 6.0, 0.5 - angle_sq / 24.0)
    } else {
        // 1 - cos(a) = 2 sin^2(a/2) keeps its digits for small angles.
        let half_sine = libm::sin(0.5 * angle);
        (libm::sin(angle) / angle, 2.0 * half_sine * half_sine / angle_sq)
    };
    let cross = skew(w);
    Mat3::identity() + cross * sine_ratio + cross * cross * cosine_ratio
}

/// The rotation vector `w` with `exp(w) = R`, in radians, `|w| <= pi`.
///
/// The quaternion of largest component is formed first (Shepperd 1978), so that the result keeps full
/// precision for every angle, half turns included.
pub fn log(r: &Mat3) -> Vec3 {
    let (real, imaginary) = quaternion(r);
    let norm = imaginary.norm();
    if norm < 0.5 * SMALL_ANGLE_RAD {
        // tan(a/2) = norm / real, and 2 atan(x) / x = 2 (1 - x^2 / 3) to rounding.
        let tangent = norm / real;
        return imaginary * (2.0 / real * (1.0 - tangent * tangent / 3.0));
    }
    imaginary * (2.0 * libm::atan2(norm, real) / norm)
}

/// Unit quaternion (real part, imaginary part) of a rotation matrix, real part >= 0.
fn quaternion(r: &Mat3) -> (f64, Vec3) {
    let trace = r.trace();
    let diagonal = [r[(0, 0)], r[(1, 1)], r[(2, 2)]];
    let (mut real, mut imaginary);
    if trace >= diagonal[0] && trace >= diagonal[1] && trace >= diagonal[2] {
        let four_real = 2.0 * (1.0 + trace).sqrt();
        real = 0.25 * four_real;
        imaginary =
            Vec3::new(r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]) / four_real;
    } else {
        let i = (0..3).fold(0, |best, k| if diagonal[k] > diagonal[best] { k } else { best });
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let four_i = 2.0 * (1.0 + diagonal[i] - diagonal[j] - diagonal[k]).sqrt();
        real = (r[(k, j)] - r[(j, k)]) / four_i;
        imaginary = Vec3::zeros();
        imaginary[i] = 0.25 * four_i;
        imaginary[j] = (r[(j, i)] + r[(i, j)]) / four_i;
        imaginary[k] = (r[(k, i)] + r[(i, k)]) / four_i;
    }
    if real < 0.0 {
        real = -real;
        imaginary = -imaginary;
    }
    (real, imaginary)
}

/// `Rz(z) Ry(y) Rx(x)`: turn about X first, then Y, then Z, all about the fixed axes; angles in radians.
pub fn from_xyz_rad(x: f64, y: f64, z: f64) -> Mat3 {
    let about = |axis: Vec3, angle: f64| exp(&(axis * angle));
    about(Vec3::z(), z) * about(Vec3::y(), y) * about(Vec3::x(), x)
}

/// The rotation nearest to `m` in the Frobenius norm: `U diag(1, 1, det(U V^T)) V^T` of its singular value
/// decomposition (Zhang 2000, appendix C; Umeyama 1991 for the sign). `None` where the decomposition does not
/// exist (non-finite input).
pub fn nearest(m: &Mat3) -> Option<Mat3> {
    if !m.iter().all(|x| x.is_finite()) {
        return None;
    }
    let svd = m.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = if (u * v_t).determinant() < 0.0 { -1.0 } else { 1.0 };
    Some(u * Mat3::from_diagonal(&Vec3::new(1.0, 1.0, sign)) * v_t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_logarithm_undoes_the_exponential(x in -1.8f64..1.8, y in -1.8f64..1.8, z in -1.8f64..1.8, scale in -9.0f64..0.0) {
            let w = Vec3::new(x, y, z) * libm::exp10(scale);
            // Half turns map w and -w to the same matrix; 1.8 sqrt(3) < pi keeps clear of them.
            let error = (log(&exp(&w)) - w).norm();
            prop_assert!(error <= 1e-15 * (1.0 + 4.0 * w.norm()), "error {error:e} for {w:?}");
        }

        #[test]
        fn an_exponential_is_a_rotation(x in -9.0f64..9.0, y in -9.0f64..9.0, z in -9.0f64..9.0) {
            let r = exp(&Vec3::new(x, y, z));
            prop_assert!((r.transpose() * r - Mat3::identity()).norm() < 1e-14);
            prop_assert!((r.determinant() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn a_half_turn_has_a_logarithm_of_length_pi() {
        for axis in [Vec3::x(), Vec3::y(), Vec3::z(), Vec3::new(1.0, -2.0, 0.5).normalize()] {
            let w = log(&exp(&(axis * std::f64::consts::PI)));
            assert!((w.norm() - std::f64::consts::PI).abs() < 1e-15);
            assert!(w.cross(&axis).norm() < 1e-14);
        }
    }

    #[test]
    fn the_compound_rotation_turns_about_x_first() {
        let quarter = std::f64::consts::FRAC_PI_2;
        // X turns Y into Z; Z-rotation leaves it there.
        let image = from_xyz_rad(quarter, 0.0, quarter) * Vec3::y();
        assert!((image - Vec3::z()).norm() < 1e-15);
    }

    #[test]
    fn the_nearest_rotation_of_a_rotation_is_itself() {
        let r = exp(&Vec3::new(0.3, -1.0, 0.7));
        assert!((nearest(&r).unwrap() - r).norm() < 1e-14);
        assert!(nearest(&(r * f64::NAN)).is_none());
    }
}
