//! Is there "practically no perspective"? What the printed residual and the printed spacings allow.
//!
//! With a perspective `(a, b)` a dot at the grid's place `(X, Y)` is seen at `s (X, Y) / (1 + a X + b Y)`:
//! from one spacing to the next the scale changes by that fraction. To first order an affine fit of nine dots
//! leaves `(a (X^2 - 2/3) + b X Y, a X Y + b (Y^2 - 2/3))`, root mean square `sqrt(2/3) |(a, b)|`.

use super::*;
use book::entry;

/// The chapter's accuracy of a point, which the printed pixels of its first sections have, px.
const EXTRACTION_PX: f64 = 0.1;
/// Directions in which the perspective is tried.
const DIRECTIONS: usize = 12;

pub fn judge_perspective(record: &mut Record) -> Result<(), ExperimentError> {
    let value = |id: &str| entry(id).map(Entry::value);
    let rms = value("rms")?;
    let spacing_px = 2.0 / (value("sx")? + value("sy")?);
    let largest = rms / (2.0f64 / 3.0).sqrt();
    // A corner dot lies sqrt(2) spacings out, and its place is changed by sqrt(2) times the perspective, at
    // most.
    let moved_px = 2.0 * largest * spacing_px;
    let ratio = value("spacing-rows")? / value("spacing-columns")?;
    record
        .group("%", Band::relative(1e-9, "a few operations on printed digits"))
        .number(
            "perspective-at-most",
            100.0 * 2.0 * largest,
            "change of scale across the target, if the whole printed residual were perspective",
        )
        .unit("px")
        .number("perspective-moves", moved_px, "how far that moves a corner dot")
        .unit("deg")
        .number(
            "tilt-of-spacings",
            libm::acos(ratio.min(1.0 / ratio)).to_degrees(),
            "tilt of a plane far away, with square pixels, that shortens one spacing to the other",
        );
    record
        .claim_that("practically-no-perspective", "the printed residual leaves room for no perspective that moves a dot by what the chapter calls the accuracy of a point")
        .at_most(moved_px, EXTRACTION_PX)
        .unit("px")
        .because("first order: an affine fit of nine dots leaves sqrt(2/3) of the perspective, in any direction");
    let cases = (0..DIRECTIONS).map(|k| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / DIRECTIONS as f64);
        let left = left_by_affine(Vec2::new(cos, sin) * largest, spacing_px)?;
        // The second order adds products of two perspectives and three coordinates below 1.
        Ok((format!("direction {k}: {left:.4e}"), (left / rms - 1.0).abs() <= 10.0 * largest))
    });
    record
        .claim_that("perspective-leaves-its-share", "nine dots with just that perspective leave the printed residual to an affine map, in every direction")
        .every("directions", cases.collect::<Result<Vec<_>, ExperimentError>>()?)
        .because("fitted, not expanded: the second order is ten times the perspective, relative, at most");
    Ok(())
}

/// What an affine map leaves of dots with this perspective, root mean square, target units.
fn left_by_affine(perspective: Vec2, spacing_px: f64) -> Result<f64, ExperimentError> {
    let world = unit_grid();
    let seen: Vec<Vec2> = world.iter().map(|w| w * (spacing_px / (1.0 + perspective.dot(w)))).collect();
    let fit = calibrate_plane(PlaneModel::Affine, &seen, &world);
    Ok(fit.map_err(ExperimentError::at("plane calibration"))?.rms_point)
}
