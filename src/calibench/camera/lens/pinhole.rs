//! What do all lenses share that bend the picture of a pinhole? The ideal point `(X, Y) / Z`, which they
//! move, and the inverse of that.

use super::{LensModel, Projected, Real};
use crate::camera::UndistortError;
use crate::geometry::{Vec2, Vec3};

/// The moved point and its derivatives by the ideal point and the coefficients.
pub(super) struct Bent<A, const P: usize> {
    pub at: [A; 2],
    /// `d(x_d, y_d) / d(x, y)`.
    pub by_ideal: [[A; 2]; 2],
    pub by_lens: [[A; 2]; P],
    /// Positive where the formulas are a lens's: a denominator that has not passed through zero.
    pub inside: A,
}

/// The projection of a point by a lens that bends the ideal point.
#[inline(always)]
pub(super) fn project<A: Real, const P: usize>(
    [x, y, z]: [A; 3],
    bend: impl FnOnce([A; 2]) -> Bent<A, P>,
) -> Projected<A, P> {
    let inverse_depth = A::splat(1.0) / z;
    let (x, y) = (x * inverse_depth, y * inverse_depth);
    let bent = bend([x, y]);
    let by_point = bent.by_ideal.map(|[a, b]| {
        let (a, b) = (a * inverse_depth, b * inverse_depth);
        [a, b, -(a * x + b * y)]
    });
    Projected { at: bent.at, by_point, by_lens: bent.by_lens, inside: z.min(bent.inside) }
}

/// The ray of an ideal point.
pub(super) fn ray_of(ideal: &Vec2) -> Vec3 {
    Vec3::new(ideal.x, ideal.y, 1.0).normalize()
}

/// Newton's method in the plane for the ideal point whose image is `at`, with steps halved until they help,
/// kept within ideal radius `limit` and where the map keeps its orientation.
pub(super) fn inverse<M: LensModel<P>, const P: usize>(
    coefficients: &[f64; P],
    at: &Vec2,
    start: Vec2,
    limit: f64,
) -> Option<Vec2> {
    let constants = M::constants(*coefficients);
    let image = |ideal: &Vec2| {
        let p = M::project(&constants, [ideal.x, ideal.y, 1.0]);
        let [[a, b, _], [c, d, _]] = p.by_point;
        (Vec2::new(p.at[0], p.at[1]) - at, nalgebra::Matrix2::new(a, b, c, d))
    };
    // A solution leaves only rounding; a point with no preimage leaves a distance.
    let rounding = 2.0 * f64::EPSILON * (1.0 + at.norm());
    let mut ideal = start;
    let (mut residual, mut slope) = image(&ideal);
    for _ in 0..100 {
        let step = slope.try_inverse()? * residual;
        let halved = (0..12).map(|halvings| ideal - step / f64::from(1 << halvings));
        let better = halved.map(|next| (next, image(&next))).find(|(next, (at, slope))| {
            at.norm() < residual.norm() && slope.determinant() > 0.0 && next.norm() <= limit
        });
        let Some((next, (next_residual, next_slope))) = better else { break };
        (ideal, residual, slope) = (next, next_residual, next_slope);
        if residual.norm() <= 0.25 * rounding {
            break;
        }
    }
    (residual.norm() <= 4.0 * rounding && slope.determinant() > 0.0).then_some(ideal)
}

/// The refusal of a point that no ideal point within radius `limit` has as its image.
pub(super) fn outside(at: &Vec2, limit: f64) -> UndistortError {
    UndistortError::OutsideMonotoneRadius { x: at.x, y: at.y, radius: at.norm(), limit }
}
