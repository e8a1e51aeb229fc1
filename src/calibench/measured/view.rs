//! What does one photograph of a measured target give? Marks by name, with their pixels.

use super::MeasuredError;
use crate::geometry::Vec2;
use std::collections::BTreeSet;

/// A mark in a photograph.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SeenMark {
    /// The mark's name in the target.
    pub id: String,
    /// Where it was seen, px; (0, 0) is the centre of the top-left pixel.
    pub pixel: Vec2,
    /// 1 over the standard deviation of its coordinates, in units of that of a mark of weight 1.
    pub weight: f64,
}

impl SeenMark {
    /// A mark of weight 1.
    pub fn new(id: impl Into<String>, pixel: Vec2) -> SeenMark {
        SeenMark { id: id.into(), pixel, weight: 1.0 }
    }
}

/// The marks of one photograph: any part of the target's, in any order.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Vec<SeenMark>", into = "Vec<SeenMark>"))]
pub struct MeasuredView {
    marks: Vec<SeenMark>,
}

impl MeasuredView {
    /// A view of these marks.
    ///
    /// # Errors
    /// A mark seen twice, pixels that are not finite, weights that are not positive.
    pub fn new(marks: Vec<SeenMark>) -> Result<MeasuredView, MeasuredError> {
        let mut seen = BTreeSet::new();
        for SeenMark { id, pixel, weight } in &marks {
            if !seen.insert(id) {
                return Err(MeasuredError::SeenTwice { mark: id.clone() });
            }
            if !(pixel.x.is_finite() && pixel.y.is_finite()) {
                return Err(MeasuredError::PixelNotFinite { mark: id.clone(), u: pixel.x, v: pixel.y });
            }
            if !(*weight > 0.0 && weight.is_finite()) {
                return Err(MeasuredError::BadWeight { mark: id.clone(), weight: *weight });
            }
        }
        Ok(MeasuredView { marks })
    }

    /// The marks that were seen.
    pub fn marks(&self) -> &[SeenMark] {
        &self.marks
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.marks.len()
    }

    /// Whether none was seen.
    pub fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }
}

impl TryFrom<Vec<SeenMark>> for MeasuredView {
    type Error = MeasuredError;

    fn try_from(marks: Vec<SeenMark>) -> Result<MeasuredView, MeasuredError> {
        MeasuredView::new(marks)
    }
}

impl From<MeasuredView> for Vec<SeenMark> {
    fn from(view: MeasuredView) -> Vec<SeenMark> {
        view.marks
    }
}
