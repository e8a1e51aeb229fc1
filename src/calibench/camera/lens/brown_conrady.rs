//! Brown-Conrady behind the interface of all lenses; the formulas and their inverse are those of
//! [`crate::camera::BrownConrady`].

use super::pinhole::{self, Bent};
use super::{LensModel, Projected, Real};
use crate::camera::{self, Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};

pub(super) struct BrownConrady;

impl LensModel<5> for BrownConrady {
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
    fn project<A: Real>(&[k1, k2, p1, p2, k3]: &[A; 5], point: [A; 3]) -> Projected<A, 5> {
        pinhole::project(point, |[x, y]| {
            let (one, two, three, six) = (A::splat(1.0), A::splat(2.0), A::splat(3.0), A::splat(6.0));
            let (xx, yy, xy) = (x * x, y * y, x * y);
            let s = xx + yy;
            let g = one + s * (k1 + s * (k2 + s * k3));
            let twice_slope = two * (k1 + s * (two * k2 + s * (three * k3)));
            let (tx, ty, twice_xy) = (s + two * xx, s + two * yy, two * xy);
            let cross = twice_slope * xy + two * (p1 * x + p2 * y);
            let radial = |factor: A| [factor * x, factor * y];
            Bent {
                at: [x * g + p1 * twice_xy + p2 * tx, y * g + p1 * ty + p2 * twice_xy],
                by_ideal: [
                    [g + twice_slope * xx + two * (p1 * y) + six * (p2 * x), cross],
                    [cross, g + twice_slope * yy + six * (p1 * y) + two * (p2 * x)],
                ],
                by_lens: [radial(s), radial(s * s), [twice_xy, ty], [tx, twice_xy], radial(s * s * s)],
                inside: one,
            }
        })
    }

    fn monotone_angle(coefficients: &[f64; 5]) -> f64 {
        libm::atan(plain(coefficients).monotone_radius())
    }

    fn ray(coefficients: &[f64; 5], at: &Vec2) -> Result<Vec3, UndistortError> {
        plain(coefficients).undistort(at).map(|ideal| pinhole::ray_of(&ideal))
    }
}

fn plain(&[k1, k2, p1, p2, k3]: &[f64; 5]) -> camera::BrownConrady {
    camera::BrownConrady { k1, k2, p1, p2, k3 }
}
