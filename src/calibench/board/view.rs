//! What does one photograph of a target give? Pairs of target point and pixel.

use crate::geometry::Vec2;

/// The correspondences of one photograph: `points[i]` of the target's plane Z = 0 was seen at `pixels[i]`.
///
/// ```
/// use calibench::board::View;
/// use calibench::geometry::Vec2;
///
/// let points = vec![Vec2::new(0.0, 0.0), Vec2::new(10.0, 0.0)];
/// let view = View::new(points.clone(), vec![Vec2::new(320.5, 240.0), Vec2::new(371.2, 239.4)])?;
/// assert_eq!(view.len(), 2);
/// // Every point needs its pixel.
/// assert!(View::new(points, vec![]).is_err());
/// # Ok::<(), calibench::board::ViewError>(())
/// ```
///
/// # A layout of your own
///
/// The points may lie anywhere in the plane: a view needs no [`Board`](super::Board), which is a lattice, and
/// each view may show other points. You then detect the marks yourself. Marks that do not lie in a plane, or
/// whose places are not exact, are for [`crate::measured`].
///
/// ```
/// use calibench::board::View;
/// use calibench::calibrate::{Settings, calibrate};
/// use calibench::geometry::Vec2;
/// use calibench::synth::{Scene, Truth};
///
/// // A mark in the middle and rings of 8, 16 and 24 about it, 10 mm apart.
/// let ring = |k: usize| {
///     let angle = move |i: usize| std::f64::consts::TAU * i as f64 / (8 * k) as f64;
///     (0..8 * k).map(move |i| 10.0 * k as f64 * Vec2::new(angle(i).cos(), angle(i).sin()))
/// };
/// let points: Vec<Vec2> = std::iter::once(Vec2::zeros()).chain((1..4).flat_map(ring)).collect();
///
/// // Four views without noise by a virtual camera; yours come from your detector. The last three marks are hidden.
/// let scene = Scene::new(Truth { points: points.clone(), ..Truth::example() })?;
/// let see = |pixels: &Vec<Vec2>| View::new(points[..46].to_vec(), pixels[..46].to_vec());
/// let views: Vec<View> = scene.pixels().iter().map(see).collect::<Result<_, _>>()?;
/// let result = calibrate(&views, &Settings::standard())?;
/// assert!((result.camera.fx - scene.truth.camera.fx).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    points: Vec<Vec2>,
    pixels: Vec<Vec2>,
    weights: Option<Vec<f64>>,
}

/// Why correspondences cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// Points and pixels do not pair up.
    #[error("{points} target points but {pixels} pixels: every point needs its pixel")]
    Lengths {
        /// Number of target points.
        points: usize,
        /// Number of pixels.
        pixels: usize,
    },
    /// A number is NaN or infinite.
    #[error("point {index} is not finite: target ({x}, {y}), pixel ({u}, {v})")]
    NotFinite {
        /// Position in the list.
        index: usize,
        /// Target X.
        x: f64,
        /// Target Y.
        y: f64,
        /// Pixel u.
        u: f64,
        /// Pixel v.
        v: f64,
    },
    /// Marks and weights do not pair up.
    #[error("{marks} marks but {weights} weights: every mark needs its weight")]
    Weights {
        /// Number of marks.
        marks: usize,
        /// Number of weights.
        weights: usize,
    },
    /// A weight that says nothing.
    #[error("point {index} has weight {weight}: a weight is positive; leave the mark out instead")]
    BadWeight {
        /// Position in the list.
        index: usize,
        /// The weight.
        weight: f64,
    },
}

impl View {
    /// Pairs target points with pixels.
    ///
    /// # Errors
    /// See [`ViewError`]: lists of two lengths, and numbers that are not finite.
    pub fn new(points: Vec<Vec2>, pixels: Vec<Vec2>) -> Result<View, ViewError> {
        if points.len() != pixels.len() {
            return Err(ViewError::Lengths { points: points.len(), pixels: pixels.len() });
        }
        for (index, (point, pixel)) in points.iter().zip(&pixels).enumerate() {
            if ![point.x, point.y, pixel.x, pixel.y].iter().all(|c| c.is_finite()) {
                return Err(ViewError::NotFinite { index, x: point.x, y: point.y, u: pixel.x, v: pixel.y });
            }
        }
        Ok(View { points, pixels, weights: None })
    }

    /// Gives every mark a weight by which its residual is multiplied: 1 over its standard deviation, in units
    /// of that of a mark of weight 1.
    ///
    /// # Errors
    /// Not a weight a mark, or one that is not positive and finite.
    pub fn with_weights(mut self, weights: Vec<f64>) -> Result<View, ViewError> {
        if weights.len() != self.len() {
            return Err(ViewError::Weights { marks: self.len(), weights: weights.len() });
        }
        if let Some(index) = weights.iter().position(|w| !(*w > 0.0 && w.is_finite())) {
            return Err(ViewError::BadWeight { index, weight: weights[index] });
        }
        self.weights = Some(weights);
        Ok(self)
    }

    /// The marks' weights; `None` if all are 1.
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// Target points, in the target's unit.
    pub fn points(&self) -> &[Vec2] {
        &self.points
    }

    /// Their pixels.
    pub fn pixels(&self) -> &[Vec2] {
        &self.pixels
    }

    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no pair.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// `(target point, pixel)` pairs.
    pub fn pairs(&self) -> impl ExactSizeIterator<Item = (&Vec2, &Vec2)> {
        self.points.iter().zip(&self.pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_pairs_are_refused_with_their_numbers() {
        let point = Vec2::new(1.0, 2.0);
        assert_eq!(View::new(vec![point], vec![]), Err(ViewError::Lengths { points: 1, pixels: 0 }));
        let error = View::new(vec![point], vec![Vec2::new(f64::NAN, 0.0)]).unwrap_err();
        assert!(matches!(error, ViewError::NotFinite { index: 0, .. }));
    }
}
