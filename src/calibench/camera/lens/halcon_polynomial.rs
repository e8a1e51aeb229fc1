//! HALCON's polynomial, five coefficients: Brown's polynomial (1971) from the seen point to the ideal one.
//!
//! With `s = x_d^2 + y_d^2` of the seen point
//!
//! ```text
//! g = 1 + k1 s + k2 s^2 + k3 s^3
//! x = x_d g + p1 (s + 2 x_d^2) + 2 p2 x_d y_d
//! y = y_d g + 2 p1 x_d y_d + p2 (s + 2 y_d^2)
//! ```
//! so that the inverse is the simple direction, `k1 > 0` is a barrel, and p1 and p2 stand the other way round
//! than in [`super::brown_conrady`]. HALCON measures the seen point in metres on the sensor, here it is in
//! units of the focal length `f`: `K1 = k1 / f^2`, `K2 = k2 / f^4`, `K3 = k3 / f^6`, `P1 = p1 / f` and
//! `P2 = p2 / f`. (MVTec HALCON operator reference, `calibrate_cameras`, `area_scan_polynomial`.)
//!
//! The image of a point is the solution on the piece that holds the axis: up to where the radius stops to
//! grow.

use super::pinhole::{self, Bent};
use super::roots::smallest_positive_root;
use super::{LensModel, Projected, Real};
use crate::camera::{Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};

pub(super) struct HalconPolynomial;

/// Steps along the radius. Ten miss 1 to 121 of a million points of lenses drawn at random up to 89.9 degrees
/// from the axis, far out or next to where the radius hardly grows; such a point counts as unseen.
const RADIAL_STEPS: usize = 10;
/// Steps in the plane from there: what p1 and p2 move is small, and each step squares what is left of it.
/// Six miss none of the points of the test below that they move by a fiftieth of the distance from the axis,
/// and few that they move by a tenth; eight find hardly one of these.
const PLANE_STEPS: usize = 6;
/// A solution leaves rounding: less than this squared, for an ideal point of length 1.
const SOLVED: f64 = 1e-24;
/// Added where a root of 0 would be taken: no digit of any other feels it.
const NOT_ZERO: f64 = 1e-280;

impl LensModel<5> for HalconPolynomial {
    const PARAMETERS: [Parameter; 5] = {
        use Parameter::*;
        [K1, K2, P1, P2, K3]
    };
    type Constants<A: Real> = [A; 5];

    #[inline(always)]
    fn constants<A: Real>(coefficients: [A; 5]) -> [A; 5] {
        coefficients
    }

    #[inline(always)]
    fn project<A: Real>(coefficients: &[A; 5], point: [A; 3]) -> Projected<A, 5> {
        pinhole::project(point, |ideal| bend(coefficients, ideal))
    }

    fn monotone_angle(coefficients: &[f64; 5]) -> f64 {
        let limit = monotone_radius(coefficients);
        if limit.is_finite() {
            let [k1, k2, _, _, k3] = *coefficients;
            let s = limit * limit;
            libm::atan(limit * (1.0 + s * (k1 + s * (k2 + s * k3))))
        } else {
            std::f64::consts::FRAC_PI_2
        }
    }

    fn ray(coefficients: &[f64; 5], at: &Vec2) -> Result<Vec3, UndistortError> {
        let straight = straighten(coefficients, [at.x, at.y]);
        let limit = monotone_radius(coefficients);
        if at.norm() < limit && straight.orientation() > 0.0 {
            return Ok(pinhole::ray_of(&Vec2::from(straight.ideal)));
        }
        Err(pinhole::outside(at, limit))
    }
}

/// The ideal point of a seen one.
struct Straight<A> {
    ideal: [A; 2],
    /// `d(x, y) / d(x_d, y_d)`, which is symmetric: xx, xy, yy.
    by_seen: [A; 3],
}

impl<A: Real> Straight<A> {
    #[inline(always)]
    fn determinant(&self) -> A {
        let [xx, xy, yy] = self.by_seen;
        xx * yy - xy * xy
    }

    /// Positive where the map is one-to-one as it is on the axis: beyond a fold it turns both directions, and
    /// the determinant alone is positive again.
    #[inline(always)]
    fn orientation(&self) -> A {
        let [xx, _, yy] = self.by_seen;
        self.determinant().min(xx + yy)
    }

    /// The seen points that a change of the ideal one moves to, to first order.
    #[inline(always)]
    fn seen_by(&self, [x, y]: [A; 2]) -> [A; 2] {
        let [xx, xy, yy] = self.by_seen;
        let scale = A::splat(1.0) / self.determinant();
        [scale * (yy * x - xy * y), scale * (xx * y - xy * x)]
    }
}

#[inline(always)]
fn straighten<A: Real>(&[k1, k2, p1, p2, k3]: &[A; 5], [x, y]: [A; 2]) -> Straight<A> {
    let (one, two, three, six) = (A::splat(1.0), A::splat(2.0), A::splat(3.0), A::splat(6.0));
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    let g = one + s * (k1 + s * (k2 + s * k3));
    let twice_slope = two * (k1 + s * (two * k2 + s * (three * k3)));
    let twice_xy = two * xy;
    Straight {
        ideal: [x * g + p1 * (s + two * xx) + p2 * twice_xy, y * g + p1 * twice_xy + p2 * (s + two * yy)],
        by_seen: [
            g + twice_slope * xx + six * (p1 * x) + two * (p2 * y),
            twice_slope * xy + two * (p1 * y + p2 * x),
            g + twice_slope * yy + two * (p1 * x) + six * (p2 * y),
        ],
    }
}

/// The seen point of an ideal one, and its derivatives from those of the inverse.
#[inline(always)]
fn bend<A: Real>(coefficients: &[A; 5], ideal: [A; 2]) -> Bent<A, 5> {
    let ideal_square = ideal[0] * ideal[0] + ideal[1] * ideal[1];
    let scale = radial_scale(coefficients, ideal_square);
    let mut at = [scale * ideal[0], scale * ideal[1]];
    let left = |straight: &Straight<A>| [ideal[0] - straight.ideal[0], ideal[1] - straight.ideal[1]];
    for _ in 0..PLANE_STEPS {
        let straight = straighten(coefficients, at);
        let step = straight.seen_by(left(&straight));
        at = [at[0] + step[0], at[1] + step[1]];
    }
    let straight = straighten(coefficients, at);
    let [off_x, off_y] = left(&straight);
    let solved = A::splat(SOLVED) * (A::splat(1.0) + ideal_square) - (off_x * off_x + off_y * off_y);
    let [x, y] = at;
    let (xx, yy) = (x * x, y * y);
    let (s, twice_xy) = (xx + yy, A::splat(2.0) * (x * y));
    let moved = |by_coefficient: [A; 2]| {
        let [x, y] = straight.seen_by(by_coefficient);
        [-x, -y]
    };
    let radial = |power: A| moved([power * x, power * y]);
    let [a, b] = straight.seen_by([A::splat(1.0), A::splat(0.0)]);
    let [c, d] = straight.seen_by([A::splat(0.0), A::splat(1.0)]);
    Bent {
        at,
        by_ideal: [[a, c], [b, d]],
        by_lens: [
            radial(s),
            radial(s * s),
            moved([s + A::splat(2.0) * xx, twice_xy]),
            moved([twice_xy, s + A::splat(2.0) * yy]),
            radial(s * s * s),
        ],
        // Last, since the smaller of what is not a number and another is the other.
        inside: growth(coefficients, s).min(straight.orientation()).min(solved),
    }
}

/// `r_d / r` of the radial part for `r^2`: the root of `m (1 + k1 r^2 m^2 + k2 r^4 m^4 + k3 r^6 m^6) = 1`, by
/// Euler's method, whose step is the root of the parabola that touches the curve: it stays exact to third
/// order where the radius stops to grow.
#[inline(always)]
fn radial_scale<A: Real>(&[k1, k2, _, _, k3]: &[A; 5], square: A) -> A {
    let constant = A::splat;
    let (a, b, c) = (k1 * square, k2 * square * square, k3 * square * square * square);
    let positive = |x: A| larger(x, constant(0.0)) + constant(NOT_ZERO);
    // What each term alone would leave of the radius, at the least.
    let barrel = positive(a) + positive(b).sqrt() + positive(c).sqrt().sqrt();
    let mut m = constant(1.0) / (constant(1.0) + barrel).sqrt();
    for _ in 0..RADIAL_STEPS {
        let mm = m * m;
        let left = constant(1.0) - m * (constant(1.0) + mm * (a + mm * (b + mm * c)));
        let slope =
            constant(1.0) + mm * (constant(3.0) * a + mm * (constant(5.0) * b + mm * (constant(7.0) * c)));
        let curvature = m * (constant(6.0) * a + mm * (constant(20.0) * b + mm * (constant(42.0) * c)));
        let under = slope * slope + constant(2.0) * (curvature * left);
        m = m + constant(2.0) * left / (slope + larger(under, -under).sqrt());
    }
    m
}

/// The least slope of the seen radius' polynomial between the axis and `s = r_d^2`: beyond where it is 0 lies
/// what belongs to no ray.
#[inline(always)]
fn growth<A: Real>(&[k1, k2, _, _, k3]: &[A; 5], s: A) -> A {
    let (zero, one) = (A::splat(0.0), A::splat(1.0));
    // As a cubic of t from 0 to 1. Its lowest place between, if it has one, is the root of its slope where
    // that rises.
    let (a, b, c) = (A::splat(3.0) * k1 * s, A::splat(5.0) * k2 * s * s, A::splat(7.0) * k3 * s * s * s);
    let slope = |t: A| one + t * (a + t * (b + t * c));
    let under = larger(b * b - A::splat(3.0) * a * c, zero) + A::splat(NOT_ZERO);
    let lowest = -a / (b + under.sqrt());
    // The order makes 1 of what is not a number.
    let inside = larger(lowest.min(one), zero);
    slope(inside).min(slope(one))
}

#[inline(always)]
fn larger<A: Real>(a: A, b: A) -> A {
    -((-a).min(-b))
}

/// The seen radius up to which the ideal one grows.
fn monotone_radius(&[k1, k2, _, _, k3]: &[f64; 5]) -> f64 {
    smallest_positive_root(&[1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3]).map_or(f64::INFINITY, f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the polynomial gives of a seen point, one term after another.
    fn by_the_book([k1, k2, p1, p2, k3]: [f64; 5], x: f64, y: f64) -> [f64; 2] {
        let s = x * x + y * y;
        let radial = 1.0 + k1 * s + k2 * s * s + k3 * s * s * s;
        [
            x * radial + p1 * (s + 2.0 * x * x) + 2.0 * p2 * x * y,
            y * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * y * y),
        ]
    }

    #[test]
    fn the_image_of_a_point_is_where_the_polynomial_leads_to_it() {
        let lenses = [
            [0.25, 0.04, 6e-4, -9e-4, -0.01],
            [-0.1, 0.01, -1e-3, 2e-3, 0.0],
            [0.0, 0.0, 0.01, 0.0, 0.0],
            [0.6, -0.05, 0.0, 0.0, 0.002],
            [0.0; 5],
        ];
        for lens in lenses {
            for seen in [[0.3, -0.2], [0.0, 0.0], [-0.6, 0.7], [1e-9, 1e-5], [0.0, 1.0]] {
                let ideal = by_the_book(lens, seen[0], seen[1]);
                let p = HalconPolynomial::project(&lens, [3.0 * ideal[0], 3.0 * ideal[1], 3.0]);
                assert!(p.inside > 0.0, "{lens:?} {seen:?}");
                let off = libm::hypot(p.at[0] - seen[0], p.at[1] - seen[1]);
                assert!(off < 1e-14, "{lens:?} {seen:?}: {off}");
            }
        }
    }

    #[test]
    fn a_decentring_by_a_tenth_of_the_distance_is_solved_for_in_nearly_all_places() {
        // How many images are found of a thousand lenses and places that p1 and p2 move by `shift` of the
        // distance from the axis.
        let found = |shift: f64| {
            let place = |i: usize| {
                // Numbers between 0 and 1 that fill the square evenly.
                let [radius, k1, turn] =
                    [0.754_877, 0.569_840, 0.618_034].map(|step| (step * i as f64).fract());
                let (radius, k1) = (0.1 + 0.9 * radius, -0.1 + 0.4 * k1);
                let (p1, p2) =
                    (shift / radius * libm::cos(7.0 * turn), shift / radius * libm::sin(7.0 * turn));
                let lens = [k1, 0.0, p1, p2, 0.0];
                let seen = [radius * libm::cos(0.1 * i as f64), radius * libm::sin(0.1 * i as f64)];
                let ideal = by_the_book(lens, seen[0], seen[1]);
                let p = HalconPolynomial::project(&lens, [ideal[0], ideal[1], 1.0]);
                p.inside > 0.0 && libm::hypot(p.at[0] - seen[0], p.at[1] - seen[1]) < 1e-11
            };
            (0..1000).filter(|&i| place(i)).count()
        };
        assert_eq!(found(0.02), 1000);
        assert!(found(0.1) >= 995, "{}", found(0.1));
    }

    #[test]
    fn beyond_the_fold_nothing_is_seen() {
        // x = x_d - 0.3 x_d^3 grows up to x_d = 1.054, x = 0.703.
        let pincushion = [-0.3, 0.0, 0.0, 0.0, 0.0];
        let at = |x: f64| HalconPolynomial::project(&pincushion, [x, 0.0, 1.0]);
        assert!(at(0.70).inside > 0.0);
        assert!((HalconPolynomial::monotone_angle(&pincushion) - libm::atan(0.703)).abs() < 1e-3);
        for x in [0.71, 1.0, 30.0] {
            assert!(at(x).inside.is_nan() || at(x).inside <= 0.0, "{x}");
        }
        // With k3 the radius grows again farther out: what lies there belongs to no ray either.
        let again = [-0.5, 0.0, 0.0, 0.0, 0.05];
        let folds = monotone_radius(&again);
        let beyond = by_the_book(again, 2.2, 0.0)[0];
        assert!(folds < 1.0 && beyond > by_the_book(again, folds, 0.0)[0], "{folds} {beyond}");
        let p = HalconPolynomial::project(&again, [beyond, 0.0, 1.0]);
        assert!(p.inside.is_nan() || p.inside <= 0.0, "{:?}", p.at);
        assert!(HalconPolynomial::ray(&again, &Vec2::new(2.2, 0.0)).is_err());
    }
}
