//! Where are a target's marks, and how well is it known? Their measured places, by name.

use crate::geometry::Vec3;
use std::collections::BTreeMap;

/// A mark as it was measured.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeasuredMark {
    /// Its name.
    pub id: String,
    /// Where it was measured, in the target's right-handed coordinates and unit.
    pub position: Vec3,
    /// Standard deviation of each coordinate, in the same unit; 0 where it is exact.
    pub standard_deviation: Vec3,
}

impl MeasuredMark {
    /// A mark whose coordinates are known equally well.
    pub fn new(id: impl Into<String>, position: Vec3, standard_deviation: f64) -> MeasuredMark {
        MeasuredMark { id: id.into(), position, standard_deviation: Vec3::repeat(standard_deviation) }
    }
}

/// All marks of a target.
///
/// ```
/// use calibench::geometry::Vec3;
/// use calibench::measured::{MeasuredMark, MeasuredTarget, TargetError};
///
/// let mark = |id: &str, x: f64| MeasuredMark::new(id, Vec3::new(x, 0.0, 5.0), 0.01);
/// let target = MeasuredTarget::new(vec![mark("a", 0.0), mark("b", 20.0)])?;
/// assert_eq!(target.position("b"), Some(1));
/// assert!(matches!(MeasuredTarget::new(vec![mark("a", 0.0), mark("a", 1.0)]), Err(TargetError::Repeated { .. })));
/// # Ok::<(), TargetError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Vec<MeasuredMark>", into = "Vec<MeasuredMark>"))]
pub struct MeasuredTarget {
    marks: Vec<MeasuredMark>,
    places: BTreeMap<String, usize>,
}

/// Why marks are no target.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// No mark at all.
    #[error(
        "the target has no marks: give at least six, and not all in one plane unless the views are tilted"
    )]
    Empty,
    /// Two marks of one name.
    #[error("mark '{id}' is in the target twice: give every mark a name of its own")]
    Repeated {
        /// The name.
        id: String,
    },
    /// A coordinate that is NaN or infinite.
    #[error(
        "mark '{id}' of the target has the coordinates ({x}, {y}, {z}), which are not all finite: measure it, or leave it out"
    )]
    NotFinite {
        /// The mark.
        id: String,
        /// X.
        x: f64,
        /// Y.
        y: f64,
        /// Z.
        z: f64,
    },
    /// A standard deviation that is none.
    #[error(
        "mark '{id}' of the target has a standard deviation of {deviation}: it is a finite number, 0 for a mark that is exact; a mark of which \
         nothing is known is to be left out"
    )]
    BadDeviation {
        /// The mark.
        id: String,
        /// As given.
        deviation: f64,
    },
}

impl MeasuredTarget {
    /// A target of these marks.
    ///
    /// # Errors
    /// No marks, names given twice, numbers that are not finite, negative standard deviations.
    pub fn new(marks: Vec<MeasuredMark>) -> Result<MeasuredTarget, TargetError> {
        if marks.is_empty() {
            return Err(TargetError::Empty);
        }
        let mut places = BTreeMap::new();
        for (place, MeasuredMark { id, position, standard_deviation }) in marks.iter().enumerate() {
            if places.insert(id.clone(), place).is_some() {
                return Err(TargetError::Repeated { id: id.clone() });
            }
            if !position.iter().all(|x| x.is_finite()) {
                let (x, y, z) = (position.x, position.y, position.z);
                return Err(TargetError::NotFinite { id: id.clone(), x, y, z });
            }
            if let Some(&deviation) = standard_deviation.iter().find(|sd| !(sd.is_finite() && **sd >= 0.0)) {
                return Err(TargetError::BadDeviation { id: id.clone(), deviation });
            }
        }
        Ok(MeasuredTarget { marks, places })
    }

    /// The marks, in the order in which they were given.
    pub fn marks(&self) -> &[MeasuredMark] {
        &self.marks
    }

    /// The place of a mark in that order; `None` if there is none of this name.
    pub fn position(&self, id: &str) -> Option<usize> {
        self.places.get(id).copied()
    }
}

impl TryFrom<Vec<MeasuredMark>> for MeasuredTarget {
    type Error = TargetError;

    fn try_from(marks: Vec<MeasuredMark>) -> Result<MeasuredTarget, TargetError> {
        MeasuredTarget::new(marks)
    }
}

impl From<MeasuredTarget> for Vec<MeasuredMark> {
    fn from(target: MeasuredTarget) -> Vec<MeasuredMark> {
        target.marks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_that_are_none_are_refused_by_name() {
        let with = |position: Vec3, sd: f64| MeasuredTarget::new(vec![MeasuredMark::new("a", position, sd)]);
        assert_eq!(MeasuredTarget::new(Vec::new()), Err(TargetError::Empty));
        assert!(with(Vec3::zeros(), 0.0).is_ok());
        for sd in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(with(Vec3::zeros(), sd), Err(TargetError::BadDeviation { .. })), "{sd}");
        }
        let error = with(Vec3::new(0.0, f64::NAN, 0.0), 0.0).unwrap_err();
        assert!(error.to_string().contains("'a'"), "{error}");
    }
}
