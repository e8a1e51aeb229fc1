//! What does a photograph of a target in three dimensions give? Pairs of point and pixel.

use crate::board::{View, ViewError};
use crate::geometry::{Vec2, Vec3};

/// The correspondences of one photograph: `points[i]` in the target's right-handed coordinates, in its unit,
/// was seen at `pixels[i]`.
///
/// ```
/// use calibench::geometry::{Vec2, Vec3};
/// use calibench::tsai::SpatialView;
///
/// let points = vec![Vec3::new(0.0, 0.0, 5.0), Vec3::new(10.0, 0.0, 0.0)];
/// assert!(SpatialView::new(points.clone(), vec![Vec2::new(320.5, 240.0), Vec2::new(371.2, 239.4)]).is_ok());
/// assert!(SpatialView::new(points, vec![]).is_err());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SpatialView {
    points: Vec<Vec3>,
    pixels: Vec<Vec2>,
}

impl SpatialView {
    /// Pairs target points with pixels.
    ///
    /// # Errors
    /// Points and pixels that do not pair up, or that are not finite.
    pub fn new(points: Vec<Vec3>, pixels: Vec<Vec2>) -> Result<SpatialView, ViewError> {
        if points.len() != pixels.len() {
            return Err(ViewError::Lengths { points: points.len(), pixels: pixels.len() });
        }
        let is_finite =
            |(point, pixel): (&Vec3, &Vec2)| point.iter().chain(pixel.iter()).all(|c| c.is_finite());
        match points.iter().zip(&pixels).position(|pair| !is_finite(pair)) {
            None => Ok(SpatialView { points, pixels }),
            Some(index) => {
                let (point, pixel) = (points[index], pixels[index]);
                Err(ViewError::NotFinite { index, x: point.x, y: point.y, u: pixel.x, v: pixel.y })
            }
        }
    }

    /// Target points, in the target's unit.
    pub fn points(&self) -> &[Vec3] {
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
    pub fn pairs(&self) -> impl ExactSizeIterator<Item = (&Vec3, &Vec2)> {
        self.points.iter().zip(&self.pixels)
    }
}

/// A flat target, in its plane Z = 0; weights count no more.
impl From<&View> for SpatialView {
    fn from(view: &View) -> SpatialView {
        let points = view.points().iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect();
        SpatialView { points, pixels: view.pixels().to_vec() }
    }
}
