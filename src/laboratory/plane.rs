//! Which maps take nine pixels to nine places of the plane?

use super::questions::{Answer, exactly};
use calibench::geometry::Vec2;
use calibench::planar::{PlaneCalibration, PlaneModel, calibrate_plane};

/// The kinds of map, in the order of the answer.
const MODELS: [PlaneModel; 3] = [PlaneModel::Affine, PlaneModel::Similarity, PlaneModel::Projective];

/// Nine pixels, u and v of each, row by row from the top left -> for an affine map to the unit grid, a
/// similarity and a projective map: the nine entries of its matrix, row by row; world units per pixel along u
/// and along v; RMS and largest residual, units; and the residual of every dot, units.
pub(crate) fn nine_points(numbers: &[f64]) -> Answer {
    let pixels = exactly::<18>(numbers)?;
    let (pixels, _) = pixels.as_chunks::<2>();
    let pixels: Vec<Vec2> = pixels.iter().map(|[u, v]| Vec2::new(*u, *v)).collect();
    let mut answer = Vec::new();
    for model in MODELS {
        let plane = calibrate_plane(model, &pixels, &unit_grid()).map_err(|error| error.to_string())?;
        answer.extend(numbers_of(&plane));
    }
    Ok(answer)
}

fn numbers_of(plane: &PlaneCalibration) -> impl Iterator<Item = f64> {
    let matrix = plane.map.matrix();
    let entries = (0..9).map(move |at| matrix[(at / 3, at % 3)]);
    let rest = [plane.scale_x, plane.scale_y, plane.rms_point, plane.max_point];
    entries.chain(rest).chain(plane.residuals.iter().flat_map(|r| [r.x, r.y]))
}

/// The dots' places, row by row from the top left: (-1, 1) ... (1, -1), y up.
fn unit_grid() -> Vec<Vec2> {
    (0..9).map(|i| Vec2::new(f64::from(i % 3) - 1.0, 1.0 - f64::from(i / 3))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dots so far apart along u and v, the middle one at (700, 500).
    fn dots(p: f64, q: f64) -> Vec<f64> {
        unit_grid().iter().flat_map(|w| [700.0 + p * w.x, 500.0 - q * w.y]).collect()
    }

    #[test]
    fn the_affine_map_is_that_of_the_spacings() {
        let answer = nine_points(&dots(236.0, 240.0)).unwrap();
        assert_eq!(answer.len(), 3 * 31);
        assert!((answer[0] * 236.0 - 1.0).abs() < 1e-13 && (answer[4] * 240.0 + 1.0).abs() < 1e-13);
        assert!(answer[11] < 1e-13);
    }

    #[test]
    fn a_similarity_leaves_what_the_spacings_differ_by() {
        let (p, q) = (236.0, 240.0);
        let answer = nine_points(&dots(p, q)).unwrap();
        // The best common scale is (p + q) / (p^2 + q^2); mean X^2 and mean Y^2 are 2/3.
        let scale = (p + q) / (p * p + q * q);
        let (x, y) = (scale * p - 1.0, scale * q - 1.0);
        assert!((answer[31 + 11] - (2.0 / 3.0 * (x * x + y * y)).sqrt()).abs() < 1e-13);
    }

    #[test]
    fn nine_dots_on_a_line_are_refused_in_words() {
        let line: Vec<f64> = (0..9).flat_map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert!(nine_points(&line).is_err_and(|words| words.contains("line")));
    }
}
