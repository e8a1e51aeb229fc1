//! Which map from pixels to the world fits the measured marks best, and how well?

use super::pairs::{Pairs, PlaneError};
use super::{PlaneMap, PlaneSpread};
use crate::geometry::{Affine, Handedness, Homography, Similarity, Vec2};
use nalgebra::DMatrix;

/// The family of maps to fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaneModel {
    /// Six parameters: the camera looks straight at the plane, pixels may be oblong or skewed (mode 0,
    /// planar).
    Affine,
    /// Eight parameters: the camera is tilted (mode 1, tilted).
    Projective,
    /// Four parameters, turned or mirrored: square pixels, no tilt (mode 2, similarity; Helmert).
    Similarity,
}

impl PlaneModel {
    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        match self {
            PlaneModel::Affine => 6,
            PlaneModel::Projective => 8,
            PlaneModel::Similarity => 4,
        }
    }
}

/// A calibrated plane.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PlaneCalibration {
    /// The family that was fitted.
    pub model: PlaneModel,
    /// The map, both ways.
    pub map: PlaneMap,
    /// Whether the map mirrors at the centroid of the pixels, as it does where v points down and Y up.
    pub handedness: Handedness,
    /// World units per pixel along u: `|d(X, Y) / du|` at the centroid of the pixels. For an affine map and a
    /// similarity, the norm of the matrix's first column, the same everywhere.
    pub scale_x: f64,
    /// World units per pixel along v.
    pub scale_y: f64,
    /// Predicted minus given world point, one a pair.
    pub residuals: Vec<Vec2>,
    /// `sqrt(mean |r|^2)`, per point, world units.
    pub rms_point: f64,
    /// Largest `|r|`, world units.
    pub max_point: f64,
    /// `2 N - p`; zero for a projective map of four pairs, which fits any four exactly.
    pub degrees_of_freedom: usize,
    /// Uncertainty; `None` without degrees of freedom, where the residuals say nothing about the errors.
    pub spread: Option<PlaneSpread>,
}

/// Calibrates a plane from pixels and the world points they show: the map of the family that minimises the
/// squared distances in the world.
///
/// Affine map and similarity are exact linear solutions; the projective map is the maximum-likelihood
/// homography. World coordinates may be large against the patch: everything is computed from offsets.
///
/// # Errors
/// Fewer than four pairs, coordinates that are not finite, a point given twice, points on one line, and sets
/// that leave the family's map open.
///
/// ```
/// use calibench::geometry::Vec2;
/// use calibench::planar::{PlaneModel, calibrate_plane};
///
/// // Nine marks 10 mm apart, seen at 4 px a millimetre.
/// let world: Vec<Vec2> = (0..9).map(|i| Vec2::new(f64::from(i % 3), f64::from(i / 3)) * 10.0).collect();
/// let pixels: Vec<Vec2> = world.iter().map(|p| Vec2::new(100.0 + 4.0 * p.x, 50.0 + 4.0 * p.y)).collect();
/// let plane = calibrate_plane(PlaneModel::Affine, &pixels, &world)?;
/// assert!((plane.scale_x - 0.25).abs() < 1e-12);
/// assert_eq!(plane.degrees_of_freedom, 12);
/// # Ok::<(), calibench::planar::PlaneError>(())
/// ```
pub fn calibrate_plane(
    model: PlaneModel,
    pixels: &[Vec2],
    world: &[Vec2],
) -> Result<PlaneCalibration, PlaneError> {
    let pairs = Pairs::new(pixels, world)?;
    let map = fit(model, &pairs)?;
    let residuals = residuals(&map, &pairs)?;
    let square: f64 = residuals.iter().map(Vec2::norm_squared).sum();
    let jacobian = map.jacobian(&pairs.pixel_origin).expect("the depth at the pixels' origin is l33 = 1");
    let handedness = if jacobian.determinant() > 0.0 { Handedness::Proper } else { Handedness::Mirrored };
    let degrees_of_freedom = 2 * pixels.len() - model.parameters();
    let spread = if degrees_of_freedom > 0 {
        let sigma = (square / degrees_of_freedom as f64).sqrt();
        PlaneSpread::of(&map, &pairs, &entries_by_parameter(model, handedness), sigma)
    } else {
        None
    };
    Ok(PlaneCalibration {
        model,
        map,
        handedness,
        scale_x: jacobian.column(0).norm(),
        scale_y: jacobian.column(1).norm(),
        rms_point: (square / pixels.len() as f64).sqrt(),
        max_point: residuals.iter().map(Vec2::norm).fold(0.0, f64::max),
        residuals,
        degrees_of_freedom,
        spread,
    })
}

fn fit(model: PlaneModel, pairs: &Pairs) -> Result<PlaneMap, PlaneError> {
    let (pixels, world) = (&pairs.pixels, &pairs.world);
    let local = match model {
        PlaneModel::Affine => Affine::fit(pixels, world)?.matrix(),
        PlaneModel::Similarity => Similarity::fit(pixels, world)?.affine().matrix(),
        PlaneModel::Projective => Homography::fit(pixels, world)?.homography.0,
    };
    PlaneMap::new(pairs.pixel_origin, pairs.world_origin, local).ok_or(PlaneError::Singular)
}

fn residuals(map: &PlaneMap, pairs: &Pairs) -> Result<Vec<Vec2>, PlaneError> {
    let residual = |(index, (p, w)): (usize, (&Vec2, &Vec2))| {
        map.offset_from_pixel(p).map(|at| at - w).ok_or(PlaneError::BehindHorizon { index })
    };
    pairs.pixels.iter().zip(&pairs.world).enumerate().map(residual).collect()
}

/// How the first eight entries of the map, row by row, move with each parameter: 8 x p. All families are
/// linear in theirs.
fn entries_by_parameter(model: PlaneModel, handedness: Handedness) -> DMatrix<f64> {
    let mut basis = DMatrix::zeros(8, model.parameters());
    if model != PlaneModel::Similarity {
        basis.fill_diagonal(1.0);
        return basis;
    }
    // a, b, tx, ty of [[a, -b], [b, a]], or of [[a, b], [b, -a]].
    let sign = if handedness == Handedness::Proper { 1.0 } else { -1.0 };
    basis[(0, 0)] = 1.0;
    basis[(4, 0)] = sign;
    basis[(1, 1)] = -sign;
    basis[(3, 1)] = 1.0;
    basis[(2, 2)] = 1.0;
    basis[(5, 3)] = 1.0;
    basis
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODELS: [PlaneModel; 3] = [PlaneModel::Affine, PlaneModel::Projective, PlaneModel::Similarity];

    fn nine_pixels() -> Vec<Vec2> {
        (0..9)
            .map(|i| Vec2::new(f64::from(i % 3) * 236.0 + 478.0, f64::from(i / 3) * 236.0 + 330.0))
            .collect()
    }

    /// The unit grid, Y up, with errors that are multiples of 2^-20.
    fn nine_marks() -> Vec<Vec2> {
        let error = |i: i32| f64::from((i * 7919) % 211 - 105) / 1048576.0;
        (0..9)
            .map(|i| Vec2::new(f64::from(i % 3 - 1) + error(i), f64::from(1 - i / 3) + error(i + 40)))
            .collect()
    }

    #[test]
    fn an_image_of_a_world_with_y_up_is_mirrored_and_its_scales_are_the_column_norms() {
        for model in MODELS {
            let fit = calibrate_plane(model, &nine_pixels(), &nine_marks()).unwrap();
            assert_eq!(fit.handedness, Handedness::Mirrored);
            // One world unit is 236 px; errors of 1e-4 over three marks a side.
            assert!((fit.scale_x * 236.0 - 1.0).abs() < 2e-4 && (fit.scale_y * 236.0 - 1.0).abs() < 2e-4);
            assert!(fit.rms_point > 0.0 && fit.max_point >= fit.rms_point);
            assert_eq!(fit.degrees_of_freedom, 18 - model.parameters());
        }
    }

    #[test]
    fn world_coordinates_near_400000_cost_no_digits_of_the_residuals() {
        // Adding 400000 and -300000 to multiples of 2^-20 is exact: both sets are the same data.
        let shift = Vec2::new(400000.0, -300000.0);
        let patch: Vec<Vec2> = nine_pixels().iter().map(|p| p * (40.0 / 472.0)).collect();
        let far: Vec<Vec2> = nine_marks().iter().map(|w| w + shift).collect();
        for model in MODELS {
            let near_fit = calibrate_plane(model, &patch, &nine_marks()).unwrap();
            let far_fit = calibrate_plane(model, &patch, &far).unwrap();
            for (near, far) in near_fit.residuals.iter().zip(&far_fit.residuals) {
                // Offsets up to 1.4 rounded to 2e-16 under residuals of 1e-5: 1e-10 relative is five times
                // that.
                assert!((near - far).norm() <= 1e-10 * near_fit.rms_point, "{model:?}: {near} {far}");
            }
            let (near, far) = (near_fit.spread.unwrap(), far_fit.spread.unwrap());
            let at = |spread: &PlaneSpread| spread.world_covariance(&patch[0]).unwrap();
            assert!((at(&near) - at(&far)).norm() <= 1e-9 * at(&near).norm());
            assert!((near_fit.scale_x - far_fit.scale_x).abs() <= 1e-12 * near_fit.scale_x);
        }
    }

    #[test]
    fn four_pairs_leave_a_projective_map_no_uncertainty_to_state() {
        let corners = [0, 2, 6, 8];
        let pixels = corners.map(|i| nine_pixels()[i]);
        let marks = corners.map(|i| nine_marks()[i]);
        let fit = calibrate_plane(PlaneModel::Projective, &pixels, &marks).unwrap();
        assert_eq!((fit.degrees_of_freedom, fit.spread), (0, None));
        // Exactly solvable: what remains is rounding of numbers near 1.
        assert!(fit.max_point < 1e-14, "{:e}", fit.max_point);
        for (model, degrees) in [(PlaneModel::Affine, 2), (PlaneModel::Similarity, 4)] {
            let fit = calibrate_plane(model, &pixels, &marks).unwrap();
            assert_eq!(fit.degrees_of_freedom, degrees);
            assert!(fit.spread.is_some());
        }
    }

    #[test]
    fn pairs_that_cannot_calibrate_are_refused_with_their_numbers() {
        let (pixels, marks) = (nine_pixels(), nine_marks());
        for model in MODELS {
            let refused = |p: &[Vec2], w: &[Vec2]| calibrate_plane(model, p, w).unwrap_err();
            assert_eq!(refused(&pixels[..3], &marks[..3]), PlaneError::TooFewPairs { need: 4, got: 3 });
            assert_eq!(refused(&pixels, &marks[..8]), PlaneError::Lengths { pixels: 9, world: 8 });
            assert!(matches!(
                refused(&pixels[..3].repeat(2), &marks[..6]),
                PlaneError::Duplicate { side: "pixel", first: 0, second: 3, .. }
            ));
            let mut broken = marks.clone();
            broken[5].y = f64::NAN;
            assert!(matches!(
                refused(&pixels, &broken),
                PlaneError::NotFinite { side: "world", index: 5, .. }
            ));
            let line: Vec<Vec2> = (0..9).map(|i| Vec2::new(f64::from(i), 0.1 * f64::from(i))).collect();
            assert!(matches!(refused(&line, &marks), PlaneError::Collinear { side: "pixel", points: 9, .. }));
            assert!(matches!(
                refused(&pixels, &line),
                PlaneError::Collinear { side: "world", points: 9, .. }
            ));
        }
    }

    #[test]
    fn three_marks_of_four_on_a_line_do_not_fix_a_projective_map() {
        let points = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (0.0, 1.0)].map(|(x, y)| Vec2::new(x, y));
        let image = points.map(|p| p * 100.0);
        let error = calibrate_plane(PlaneModel::Projective, &image, &points).unwrap_err();
        assert!(matches!(error, PlaneError::Projective(_)), "{error}");
        assert!(calibrate_plane(PlaneModel::Affine, &image, &points).is_ok());
    }

    #[test]
    fn a_plane_seen_upside_down_is_mirrored() {
        let pixels: Vec<Vec2> =
            (0..9).map(|i| Vec2::new(f64::from(i % 3), f64::from(i / 3)) * 100.0).collect();
        for (sign, handedness) in [(1.0, Handedness::Proper), (-1.0, Handedness::Mirrored)] {
            let world: Vec<Vec2> = pixels.iter().map(|p| 0.1 * Vec2::new(p.x, sign * p.y)).collect();
            for model in [PlaneModel::Similarity, PlaneModel::Affine, PlaneModel::Projective] {
                let plane = calibrate_plane(model, &pixels, &world).unwrap();
                assert_eq!(plane.handedness, handedness, "{model:?}");
            }
        }
    }
}
