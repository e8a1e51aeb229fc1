//! Which turned, scaled and shifted copy fits best? The plane Helmert transformation, in closed form.

use super::affine::{Affine, LinearFitError, checked_centroids};
use super::{Vec2, Vec3};
use nalgebra::Matrix2;

/// Whether a map keeps the sense of rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Handedness {
    /// Determinant positive: `A = [[a, -b], [b, a]]`.
    Proper,
    /// Determinant negative, as between an image (v down) and a world with Y up: `A = [[a, b], [b, -a]]`.
    Mirrored,
}

/// A similarity `y = A x + t` with `a = scale cos(angle)`, `b = scale sin(angle)`: four parameters, shapes
/// stay the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// `scale cos(angle)`.
    pub a: f64,
    /// `scale sin(angle)`.
    pub b: f64,
    /// `t`.
    pub offset: Vec2,
    /// Whether `A` mirrors.
    pub handedness: Handedness,
}

impl Similarity {
    /// `A`.
    pub fn linear(&self) -> Matrix2<f64> {
        let (a, b) = (self.a, self.b);
        match self.handedness {
            Handedness::Proper => Matrix2::new(a, -b, b, a),
            Handedness::Mirrored => Matrix2::new(a, b, b, -a),
        }
    }

    /// The same map as an affine one.
    pub fn affine(&self) -> Affine {
        Affine { linear: self.linear(), offset: self.offset }
    }

    /// Ratio of lengths, `sqrt(a^2 + b^2)`.
    pub fn scale(&self) -> f64 {
        libm::hypot(self.a, self.b)
    }

    /// The map `from -> to` that minimises the squared distances in `to`, turned or mirrored, whichever fits
    /// better.
    ///
    /// With offsets `p`, `w` from the centroids and `S = sum w p^T`, a proper map has `a = (S11 + S22) / sum
    /// |p|^2`, `b = (S21 - S12) / sum |p|^2`; a mirrored one `a = (S11 - S22) / ...`, `b = (S12 + S21) /
    /// ...`. The proper one leaves less than the mirrored one by `4 det S / sum |p|^2`, so the sign of `det
    /// S` decides (Umeyama 1991 with scale, in the plane and without the restriction to rotations).
    ///
    /// # Errors
    /// Fewer than three pairs, or `from` on one line: that leaves the handedness open. So does `det S = 0`,
    /// which is refused too.
    pub fn fit(from: &[Vec2], to: &[Vec2]) -> Result<Similarity, LinearFitError> {
        let (from_centroid, to_centroid) = checked_centroids(from, to, 3)?;
        let mut cross = Matrix2::zeros();
        let mut square = 0.0;
        for (f, t) in from.iter().zip(to) {
            let (p, w) = (f - from_centroid, t - to_centroid);
            cross += w * p.transpose();
            square += p.norm_squared();
        }
        let determinant = 2.0 * cross.determinant() / cross.norm_squared();
        if determinant.is_nan() || determinant.abs() < SMALLEST_DETERMINANT {
            return Err(LinearFitError::HandednessUndecided { points: from.len(), determinant });
        }
        let sum = Vec3::new(cross[(0, 0)] + cross[(1, 1)], cross[(1, 0)] - cross[(0, 1)], 0.0);
        let difference = Vec3::new(cross[(0, 0)] - cross[(1, 1)], cross[(0, 1)] + cross[(1, 0)], 0.0);
        let (handedness, ab) = if determinant > 0.0 {
            (Handedness::Proper, sum / square)
        } else {
            (Handedness::Mirrored, difference / square)
        };
        let unshifted = Similarity { a: ab.x, b: ab.y, offset: Vec2::zeros(), handedness };
        Ok(Similarity { offset: to_centroid - unshifted.linear() * from_centroid, ..unshifted })
    }
}

/// Rounding leaves 1e-16 of a determinant that is zero; a set that is a plane by a millionth of its length
/// has 1e-6.
const SMALLEST_DETERMINANT: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn scattered() -> Vec<Vec2> {
        (0..9).map(|i| Vec2::new(f64::from(i % 3) + 0.1 * f64::from(i), f64::from(i / 3))).collect()
    }

    proptest! {
        #[test]
        fn a_noiseless_similarity_is_found_and_so_is_its_mirror_image(
            angle in -3.1f64..3.1, scale in 0.1f64..3.0, t in prop::array::uniform2(-2.0f64..2.0), mirrored: bool,
        ) {
            let truth = Similarity {
                a: scale * libm::cos(angle), b: scale * libm::sin(angle), offset: Vec2::from(t),
                handedness: if mirrored { Handedness::Mirrored } else { Handedness::Proper },
            };
            let to: Vec<Vec2> = scattered().iter().map(|p| truth.affine().apply(p)).collect();
            let fit = Similarity::fit(&scattered(), &to).unwrap();
            prop_assert_eq!(fit.handedness, truth.handedness);
            prop_assert!((fit.affine().matrix() - truth.affine().matrix()).norm() < 1e-14);
            prop_assert!((fit.scale() - scale).abs() < 1e-14);
        }

        #[test]
        fn no_other_similarity_fits_better(
            noise in prop::collection::vec(-2.0f64..2.0, 18), step in prop::array::uniform4(-1e-3f64..1e-3),
        ) {
            let to: Vec<Vec2> = scattered().iter().zip(noise.chunks(2)).map(|(p, n)| p + Vec2::new(n[0], n[1])).collect();
            let Ok(fit) = Similarity::fit(&scattered(), &to) else { return Ok(()) };
            let cost = |s: &Similarity| -> f64 {
                scattered().iter().zip(&to).map(|(p, w)| (s.affine().apply(p) - w).norm_squared()).sum()
            };
            let moved = Similarity {
                a: fit.a + step[0], b: fit.b + step[1], offset: fit.offset + Vec2::new(step[2], step[3]), ..fit
            };
            prop_assert!(cost(&moved) >= cost(&fit));
            // The best map of the other hand: linear in a and b, whose two design columns are orthogonal.
            let other = match fit.handedness {
                Handedness::Proper => Handedness::Mirrored,
                Handedness::Mirrored => Handedness::Proper,
            };
            let (centroid, goal) = (Scatter::of(&scattered()).centroid, Scatter::of(&to).centroid);
            let along = |a: f64, b: f64| -> f64 {
                let column = Similarity { a, b, offset: Vec2::zeros(), handedness: other }.linear();
                let pairs = scattered().into_iter().zip(&to).map(|(p, w)| (column * (p - centroid), w - goal));
                let (dot, square) = pairs.fold((0.0, 0.0), |(d, s), (c, w)| (d + c.dot(&w), s + c.dot(&c)));
                dot / square
            };
            let unshifted = Similarity { a: along(1.0, 0.0), b: along(0.0, 1.0), offset: Vec2::zeros(), handedness: other };
            let shifted = Similarity { offset: goal - unshifted.linear() * centroid, ..unshifted };
            prop_assert!(cost(&shifted) >= cost(&fit));
        }
    }

    use crate::geometry::scatter::Scatter;

    #[test]
    fn pairs_that_do_not_decide_the_handedness_are_refused() {
        let square = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(x, y)| Vec2::new(x, y));
        // Every point goes to its own x on a line: det S = 0.
        let line = square.map(|p| Vec2::new(p.x, 0.0));
        assert!(matches!(Similarity::fit(&square, &line), Err(LinearFitError::HandednessUndecided { .. })));
        assert!(matches!(Similarity::fit(&line, &square), Err(LinearFitError::Collinear { .. })));
    }
}
