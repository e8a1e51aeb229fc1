//! The rational model of OpenCV, eight coefficients: a quotient of polynomials, for wide angles.
//!
//! With `s = x^2 + y^2` of the ideal point
//!
//! ```text
//! g   = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)
//! x_d = x g + 2 p1 x y + p2 (s + 2 x^2)
//! y_d = y g + p1 (s + 2 y^2) + 2 p2 x y
//! ```
//! A point where the denominator is 0 or less has no image: between there and the axis is a pole.
//! (Claus & Fitzgibbon 2005 on rational lenses; the form is OpenCV's `CALIB_RATIONAL_MODEL`.)

use super::pinhole::{self, Bent};
use super::roots::{inverse_of_growing, smallest_positive_root};
use super::{LensModel, Projected, Real};
use crate::camera::{Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};

pub(super) struct Rational;

impl LensModel<8> for Rational {
    const PARAMETERS: [Parameter; 8] = {
        use Parameter::*;
        [K1, K2, P1, P2, K3, K4, K5, K6]
    };
    type Constants<A: Real> = [A; 8];

    #[inline(always)]
    fn constants<A: Real>(coefficients: [A; 8]) -> [A; 8] {
        coefficients
    }

    #[inline(always)]
    fn project<A: Real>(coefficients: &[A; 8], point: [A; 3]) -> Projected<A, 8> {
        pinhole::project(point, |ideal| bend(coefficients, ideal))
    }

    fn monotone_angle(coefficients: &[f64; 8]) -> f64 {
        libm::atan(monotone_radius(coefficients))
    }

    fn ray(coefficients: &[f64; 8], at: &Vec2) -> Result<Vec3, UndistortError> {
        let start = radial_start(coefficients, at);
        let limit = monotone_radius(coefficients);
        pinhole::inverse::<Rational, 8>(coefficients, at, start, limit)
            .map(|ideal| pinhole::ray_of(&ideal))
            .ok_or_else(|| pinhole::outside(at, limit * radial(coefficients, limit * limit).0))
    }
}

/// The moved point and its derivatives.
#[inline(always)]
pub(super) fn bend<A: Real>(&[k1, k2, p1, p2, k3, k4, k5, k6]: &[A; 8], [x, y]: [A; 2]) -> Bent<A, 8> {
    let (one, two, three, six) = (A::splat(1.0), A::splat(2.0), A::splat(3.0), A::splat(6.0));
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    let above = one + s * (k1 + s * (k2 + s * k3));
    let denominator = one + s * (k4 + s * (k5 + s * k6));
    let below = one / denominator;
    let above_slope = k1 + s * (two * k2 + s * (three * k3));
    let below_slope = k4 + s * (two * k5 + s * (three * k6));
    let g = above * below;
    let twice_slope = two * ((above_slope - g * below_slope) * below);
    let (tx, ty, twice_xy) = (s + two * xx, s + two * yy, two * xy);
    let cross = twice_slope * xy + two * (p1 * x + p2 * y);
    let (sb, gb) = (s * below, -(g * below));
    let radial = |factor: A| [factor * x, factor * y];
    Bent {
        at: [x * g + p1 * twice_xy + p2 * tx, y * g + p1 * ty + p2 * twice_xy],
        by_ideal: [
            [g + twice_slope * xx + two * (p1 * y) + six * (p2 * x), cross],
            [cross, g + twice_slope * yy + six * (p1 * y) + two * (p2 * x)],
        ],
        by_lens: [
            radial(sb),
            radial(sb * s),
            [twice_xy, ty],
            [tx, twice_xy],
            radial(sb * s * s),
            radial(gb * s),
            radial(gb * s * s),
            radial(gb * s * s * s),
        ],
        inside: denominator,
    }
}

/// `g(s)` and `dg/ds`.
fn radial(&[k1, k2, _, _, k3, k4, k5, k6]: &[f64; 8], s: f64) -> (f64, f64) {
    let above = 1.0 + s * (k1 + s * (k2 + s * k3));
    let below = 1.0 + s * (k4 + s * (k5 + s * k6));
    let g = above / below;
    let slope = k1 + s * (2.0 * k2 + 3.0 * s * k3) - g * (k4 + s * (2.0 * k5 + 3.0 * s * k6));
    (g, slope / below)
}

/// The ideal radius up to which `r g(r^2)` grows: with `g = a / b` its slope has the sign of
/// `(a + 2 s a') b - 2 s a b'`, and a zero of `b` ends it too.
pub(super) fn monotone_radius(&[k1, k2, _, _, k3, k4, k5, k6]: &[f64; 8]) -> f64 {
    let a = [1.0, k1, k2, k3];
    let b = [1.0, k4, k5, k6];
    let mut slope = [0.0; 7];
    for i in 0..4 {
        for j in 0..4 {
            // s^i of a with s^j of b: (1 + 2 i) a_i b_j - 2 j a_i b_j.
            slope[i + j] += (1.0 + 2.0 * i as f64 - 2.0 * j as f64) * a[i] * b[j];
        }
    }
    let roots = [smallest_positive_root(&slope), smallest_positive_root(&b)];
    roots.into_iter().flatten().fold(f64::INFINITY, f64::min).sqrt()
}

/// The ideal point if the lens were radial: where the inverse starts.
pub(super) fn radial_start(coefficients: &[f64; 8], at: &Vec2) -> Vec2 {
    let limit = monotone_radius(coefficients);
    let radius = at.norm();
    let map = |r: f64| {
        let (g, slope) = radial(coefficients, r * r);
        (r * g, g + 2.0 * r * r * slope)
    };
    // What tangential terms carry over the rim starts just inside.
    let ideal = inverse_of_growing(map, radius, radius, 0.999_999 * limit).unwrap_or(0.999 * limit.min(1e3));
    if radius > 0.0 { at * (ideal / radius) } else { *at }
}
