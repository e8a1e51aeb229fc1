//! Where exactly do four squares meet? The point that every edge around it points at.
//!
//! At a pixel `p` on an edge through the corner `q` the gradient `g` is perpendicular to `p - q`; inside a
//! square it is zero. So `q` minimises `sum w (g . (p - q))^2`, a linear problem, solved again around each
//! new `q` until it rests (Foerstner & Gulch 1987; the window and weights are those of OpenCV's
//! `cornerSubPix`). Differences between pixels put an error of some hundredths of a pixel into it that
//! depends on the corner's place on the pixel grid, so it is only the start of a fit to the pixels themselves
//! (`saddle`), and what remains where that does not converge.

use super::saddle;
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};
use nalgebra::Matrix2;

/// Why a corner cannot be refined.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RefineError {
    /// The window leaves the image.
    #[error("the window of {half_px} px around the corner at ({u:.1}, {v:.1}) leaves the image")]
    OutsideImage {
        /// Place, u.
        u: f64,
        /// Place, v.
        v: f64,
        /// Half the side of the window.
        half_px: usize,
    },
    /// Edges of one direction, or none, do not fix a point.
    #[error("no corner at ({u:.1}, {v:.1}): the edges there have a single direction or no contrast")]
    NoCorner {
        /// Place, u.
        u: f64,
        /// Place, v.
        v: f64,
    },
    /// The estimate wandered out of its first window.
    #[error("the corner at ({u:.1}, {v:.1}) moved by {moved_px:.1} px, more than its window of {half_px} px")]
    Wandered {
        /// Start, u.
        u: f64,
        /// Start, v.
        v: f64,
        /// Distance moved.
        moved_px: f64,
        /// Half the side of the window.
        half_px: usize,
    },
}

/// The iteration contracts by a factor of three or more a step; 40 steps are past rest from anywhere in the
/// window.
const MAX_STEPS: usize = 40;

/// Steps below this leave the corner where it is to the accuracy of any image.
const REST_PX: f64 = 1e-5;

/// Least ratio of the eigenvalues of the gradients' scatter: edges that cross at less than 10 degrees have
/// 0.008.
const LEAST_FLATNESS: f64 = 0.01;

/// Refines the place of a chessboard corner, looking at `2 half_px + 1` pixels a side.
///
/// # Errors
/// See [`RefineError`].
///
/// ```
/// use calibench::detect::refine_corner;
/// use calibench::geometry::Vec2;
/// use calibench::raster::Raster;
///
/// // Four squares meet between the pixels 9 and 10, that is at 9.5.
/// let image = Raster::from_fn(20, 20, |x, y| if (x < 10) == (y < 10) { 30u8 } else { 220 });
/// let corner = refine_corner(&image, Vec2::new(8.3, 10.6), 5)?;
/// assert!((corner - Vec2::new(9.5, 9.5)).norm() < 1e-3);
/// // Where there is only an edge, there is no corner.
/// assert!(refine_corner(&image.map(|_| 30u8), Vec2::new(8.3, 10.6), 5).is_err());
/// # Ok::<(), calibench::detect::RefineError>(())
/// ```
pub fn refine_corner<T: Level>(image: &Raster<T>, start: Vec2, half_px: usize) -> Result<Vec2, RefineError> {
    let mut corner = start;
    for _ in 0..MAX_STEPS {
        let next = step(image, corner, half_px)?;
        let moved = next - start;
        if moved.amax().is_nan() || moved.amax() > half_px as f64 {
            let (u, v, moved_px) = (start.x, start.y, moved.norm());
            return Err(RefineError::Wandered { u, v, moved_px, half_px });
        }
        let is_at_rest = (next - corner).norm() < REST_PX;
        corner = next;
        if is_at_rest {
            break;
        }
    }
    Ok(saddle::refine(image, corner, half_px).unwrap_or(corner))
}

/// One solution of the linear problem around a place.
fn step<T: Level>(image: &Raster<T>, at: Vec2, half_px: usize) -> Result<Vec2, RefineError> {
    let (u, v) = (at.x, at.y);
    let outside = RefineError::OutsideImage { u, v, half_px };
    if half_px >= image.width().max(image.height()) {
        return Err(outside);
    }
    let patch = patch(image, at, half_px + 1).ok_or(outside)?;
    let side = 2 * half_px + 3;
    let level = |x: usize, y: usize| patch[y * side + x];
    let (mut scatter, mut weighted) = (Matrix2::zeros(), Vec2::zeros());
    for y in 1..side - 1 {
        for x in 1..side - 1 {
            let gradient = Vec2::new(level(x + 1, y) - level(x - 1, y), level(x, y + 1) - level(x, y - 1));
            let offset = Vec2::new(x as f64, y as f64) - Vec2::repeat((half_px + 1) as f64);
            let weight = libm::exp(-offset.norm_squared() / (half_px * half_px) as f64);
            let outer = gradient * gradient.transpose() * weight;
            scatter += outer;
            weighted += outer * offset;
        }
    }
    let flatness = 4.0 * scatter.determinant() / (scatter.trace() * scatter.trace());
    let solved = (flatness > LEAST_FLATNESS).then(|| scatter.try_inverse()).flatten();
    Ok(at + solved.ok_or(RefineError::NoCorner { u, v })? * weighted)
}

/// Levels on a unit raster centred on a place, bilinear; `None` where it leaves the image.
fn patch<T: Level>(image: &Raster<T>, centre: Vec2, half: usize) -> Option<Vec<f64>> {
    let first = centre - Vec2::repeat(half as f64);
    let (x0, y0) = (libm::floor(first.x), libm::floor(first.y));
    let side = 2 * half + 1;
    let fits = x0 >= 0.0 && y0 >= 0.0;
    let ends = |low: f64, size: usize| low + (side as f64) < size as f64;
    if !(fits && ends(x0, image.width()) && ends(y0, image.height())) {
        return None;
    }
    let (a, b) = (first.x - x0, first.y - y0);
    let (x0, y0) = (x0 as usize, y0 as usize);
    let mut levels = Vec::with_capacity(side * side);
    for y in y0..y0 + side {
        let (upper, lower) = (&image.row(y)[x0..=x0 + side], &image.row(y + 1)[x0..=x0 + side]);
        let mix = |row: &[T], x: usize| row[x].to_f64() * (1.0 - a) + row[x + 1].to_f64() * a;
        levels.extend((0..side).map(|x| mix(upper, x) * (1.0 - b) + mix(lower, x) * b));
    }
    Some(levels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_without_a_corner_are_refused() {
        let edge = Raster::from_fn(40, 40, |x, _| if x < 20 { 10u8 } else { 200 });
        assert!(matches!(refine_corner(&edge, Vec2::new(20.0, 20.0), 5), Err(RefineError::NoCorner { .. })));
        let flat = Raster::filled(40, 40, 7u8);
        assert!(matches!(refine_corner(&flat, Vec2::new(20.0, 20.0), 5), Err(RefineError::NoCorner { .. })));
        assert!(matches!(
            refine_corner(&flat, Vec2::new(3.0, 20.0), 5),
            Err(RefineError::OutsideImage { .. })
        ));
        assert!(refine_corner(&flat, Vec2::new(f64::NAN, 20.0), 5).is_err());
    }

    #[test]
    fn a_corner_on_the_pixel_grid_is_found_exactly() {
        // Squares meet between pixels 19 and 20: at 19.5.
        let image = Raster::from_fn(40, 40, |x, y| if (x < 20) == (y < 20) { 10u8 } else { 200 });
        let corner = refine_corner(&image, Vec2::new(20.6, 18.7), 5).unwrap();
        assert!((corner - Vec2::new(19.5, 19.5)).norm() < 1e-4, "{corner}");
    }
}
