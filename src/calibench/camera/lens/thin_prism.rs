//! The rational model with thin prisms, twelve coefficients (Weng, Cohen & Herniou 1992; OpenCV's
//! `CALIB_THIN_PRISM_MODEL`): lens elements whose surfaces are not parallel.
//!
//! ```text
//! x_d = rational_x + s1 s + s2 s^2,   y_d = rational_y + s3 s + s4 s^2
//! ```

use super::pinhole::{self, Bent};
use super::{LensModel, Projected, Real, rational};
use crate::camera::{Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};

pub(super) struct ThinPrism;

impl LensModel<12> for ThinPrism {
    const PARAMETERS: [Parameter; 12] = {
        use Parameter::*;
        [K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4]
    };
    type Constants<A: Real> = [A; 12];

    #[inline(always)]
    fn constants<A: Real>(coefficients: [A; 12]) -> [A; 12] {
        coefficients
    }

    #[inline(always)]
    fn project<A: Real>(coefficients: &[A; 12], point: [A; 3]) -> Projected<A, 12> {
        pinhole::project(point, |ideal| bend(coefficients, ideal))
    }

    fn monotone_angle(coefficients: &[f64; 12]) -> f64 {
        libm::atan(rational::monotone_radius(&rational_part(coefficients)))
    }

    fn ray(coefficients: &[f64; 12], at: &Vec2) -> Result<Vec3, UndistortError> {
        let radial = rational_part(coefficients);
        let limit = rational::monotone_radius(&radial);
        pinhole::inverse::<ThinPrism, 12>(coefficients, at, rational::radial_start(&radial, at), limit)
            .map(|ideal| pinhole::ray_of(&ideal))
            .ok_or_else(|| pinhole::outside(at, limit))
    }
}

/// The first eight coefficients.
pub(super) fn rational_part<A: Copy, const P: usize>(coefficients: &[A; P]) -> [A; 8] {
    std::array::from_fn(|i| coefficients[i])
}

/// The moved point and its derivatives.
#[inline(always)]
pub(super) fn bend<A: Real>(c: &[A; 12], [x, y]: [A; 2]) -> Bent<A, 12> {
    let two = A::splat(2.0);
    let bent = rational::bend(&rational_part(c), [x, y]);
    let [s1, s2, s3, s4] = [c[8], c[9], c[10], c[11]];
    let s = x * x + y * y;
    let (zero, ss) = (A::splat(0.0), s * s);
    let (along, down) = (two * (s1 + two * (s2 * s)), two * (s3 + two * (s4 * s)));
    let [[a, b], [c, d]] = bent.by_ideal;
    let prisms = [[s, zero], [ss, zero], [zero, s], [zero, ss]];
    Bent {
        at: [bent.at[0] + s1 * s + s2 * ss, bent.at[1] + s3 * s + s4 * ss],
        by_ideal: [[a + along * x, b + along * y], [c + down * x, d + down * y]],
        by_lens: std::array::from_fn(|i| if i < 8 { bent.by_lens[i] } else { prisms[i - 8] }),
        inside: bent.inside,
    }
}
