//! Can these point pairs fix a plane map? Refusals first; then both sides relative to origins of their own.

use crate::geometry::{HomographyError, LinearFitError, Scatter, Vec2};

/// Why a plane cannot be calibrated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlaneError {
    /// Four pairs are the least for every model, so that the affine and similarity maps leave something to
    /// check.
    #[error("a plane calibration needs at least {need} point pairs, got {got}")]
    TooFewPairs {
        /// Least number.
        need: usize,
        /// Number given.
        got: usize,
    },
    /// The lists differ in length.
    #[error("{pixels} pixels but {world} world points: every pixel needs its world point")]
    Lengths {
        /// Number of pixels.
        pixels: usize,
        /// Number of world points.
        world: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("{side} point {index} is not finite: ({x}, {y})")]
    NotFinite {
        /// `pixel` or `world`.
        side: &'static str,
        /// Position in the list.
        index: usize,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
    },
    /// Two pairs share a point: a mark measured or entered twice.
    #[error("{side} points {first} and {second} are the same, ({x}, {y}): remove one, or correct it")]
    Duplicate {
        /// `pixel` or `world`.
        side: &'static str,
        /// Position of the first.
        first: usize,
        /// Position of the second.
        second: usize,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
    },
    /// All points of one side lie on a line.
    #[error("the {points} {side} points lie on one line (flatness {flatness:.1e}): add a mark beside it")]
    Collinear {
        /// `pixel` or `world`.
        side: &'static str,
        /// Number of points.
        points: usize,
        /// `4 det / trace^2` of the scatter matrix: 1 for a round cloud, 0 for a line.
        flatness: f64,
    },
    /// The projective map is not fixed by the pairs.
    #[error("the projective map is not fixed: {0}")]
    Projective(HomographyError),
    /// The affine or similarity map is not fixed by the pairs.
    #[error("the map is not fixed: {0}")]
    Linear(LinearFitError),
    /// The fitted map flattens the plane onto a line.
    #[error(
        "the fitted map is singular: pixels and world points do not correspond; check the order of the points"
    )]
    Singular,
    /// A mark lies on or behind the fitted map's horizon.
    #[error(
        "pixel {index} lies on or behind the horizon of the fitted projective map: check the order of the points"
    )]
    BehindHorizon {
        /// Position in the list.
        index: usize,
    },
}

impl From<HomographyError> for PlaneError {
    fn from(error: HomographyError) -> PlaneError {
        PlaneError::Projective(error)
    }
}

impl From<LinearFitError> for PlaneError {
    fn from(error: LinearFitError) -> PlaneError {
        PlaneError::Linear(error)
    }
}

/// Pairs as offsets from an origin on each side.
///
/// A coordinate minus an origin of similar size is exact in floating point (Sterbenz 1974), so nothing is
/// lost where world coordinates are large, as on a machine's axes, against the patch they measure.
pub(super) struct Pairs {
    pub pixel_origin: Vec2,
    pub world_origin: Vec2,
    /// RMS distance of the pixels from their origin.
    pub pixel_radius: f64,
    pub pixels: Vec<Vec2>,
    pub world: Vec<Vec2>,
}

impl Pairs {
    pub fn new(pixels: &[Vec2], world: &[Vec2]) -> Result<Pairs, PlaneError> {
        if pixels.len() != world.len() {
            return Err(PlaneError::Lengths { pixels: pixels.len(), world: world.len() });
        }
        if pixels.len() < 4 {
            return Err(PlaneError::TooFewPairs { need: 4, got: pixels.len() });
        }
        let pixel_scatter = usable(pixels, "pixel")?;
        let world_scatter = usable(world, "world")?;
        let relative = |points: &[Vec2], origin: Vec2| points.iter().map(|p| p - origin).collect();
        Ok(Pairs {
            pixel_origin: pixel_scatter.centroid,
            world_origin: world_scatter.centroid,
            pixel_radius: pixel_scatter.rms_radius,
            pixels: relative(pixels, pixel_scatter.centroid),
            world: relative(world, world_scatter.centroid),
        })
    }
}

/// The scatter of finite, distinct points that span a plane.
fn usable(points: &[Vec2], side: &'static str) -> Result<Scatter, PlaneError> {
    if let Some((index, p)) = points.iter().enumerate().find(|(_, p)| !(p.x.is_finite() && p.y.is_finite())) {
        return Err(PlaneError::NotFinite { side, index, x: p.x, y: p.y });
    }
    refuse_duplicates(points, side)?;
    let scatter = Scatter::of(points);
    if !scatter.spans_a_plane() {
        return Err(PlaneError::Collinear { side, points: points.len(), flatness: scatter.flatness });
    }
    Ok(scatter)
}

fn refuse_duplicates(points: &[Vec2], side: &'static str) -> Result<(), PlaneError> {
    // Adding zero makes -0 and 0 one key.
    let key = |index: usize| (points[index].x + 0.0, points[index].y + 0.0);
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&i, &j| {
        let (a, b) = (key(i), key(j));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(i.cmp(&j))
    });
    match order.windows(2).find(|pair| key(pair[0]) == key(pair[1])) {
        None => Ok(()),
        Some(pair) => {
            let (x, y) = key(pair[0]);
            Err(PlaneError::Duplicate { side, first: pair[0], second: pair[1], x, y })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_of_both_signs_are_one_place() {
        // By the sign alone the second would stand between the other two, which then are no neighbours.
        let points = [Vec2::new(-0.0, 1.0), Vec2::new(-0.0, 2.0), Vec2::new(0.0, 1.0)];
        let error = refuse_duplicates(&points, "pixels").unwrap_err();
        assert!(matches!(error, PlaneError::Duplicate { first: 0, second: 2, .. }), "{error:?}");
        assert!(refuse_duplicates(&points[..2], "pixels").is_ok());
    }
}
