//! What a lens does to points and to a straight line.

use super::questions::{Answer, exactly};
use calibench::camera::{BrownConrady, Camera};
use calibench::geometry::{LineFit, Vec2};
use calibench::synth::Truth;

/// The chapter's line runs from 20 to 620 px, with a point every 10 px.
const POINTS: std::ops::RangeInclusive<u32> = 2..=62;
const STEP_PX: f64 = 10.0;

/// The chapter's camera with another lens.
pub(crate) fn camera(k1: f64, k2: f64) -> Camera {
    Truth::example_camera().with_distortion(BrownConrady::radial(k1, k2))
}

/// k1, k2 and the coordinates of ideal pixels -> those of the pixels at which the lens shows them.
pub(crate) fn distort(numbers: &[f64]) -> Answer {
    let [k1, k2, points @ ..] = numbers else { return Err("a lens has k1 and k2".to_string()) };
    let camera = camera(*k1, *k2);
    let (points, _) = points.as_chunks::<2>();
    Ok(points
        .iter()
        .map(|[u, v]| camera.distort_pixel(&Vec2::new(*u, *v)))
        .flat_map(|p| [p.x, p.y])
        .collect())
}

/// k1 and k2 of the lens that bends, k1 and k2 of the lens that corrects, and the height v of a line, px ->
/// largest and RMS distance of the bent line from its regression line, the same of the corrected line, the
/// largest distance of a corrected point from its ideal place, px; then u, v of every bent point, its
/// distance from the regression line, u, v of the corrected point and its distance.
pub(crate) fn bend(numbers: &[f64]) -> Answer {
    let [k1, k2, k1_known, k2_known, v] = exactly(numbers)?;
    let (lens, known) = (camera(k1, k2), camera(k1_known, k2_known));
    let ideal: Vec<Vec2> = POINTS.map(|k| Vec2::new(STEP_PX * f64::from(k), v)).collect();
    let bent: Vec<Vec2> = ideal.iter().map(|p| lens.distort_pixel(p)).collect();
    let corrected: Result<Vec<Vec2>, _> = bent.iter().map(|p| known.correct_pixel(p)).collect();
    let corrected = corrected.map_err(|error| error.to_string())?;
    let fit = |points: &[Vec2]| LineFit::new(points).map_err(|error| error.to_string());
    let (of_bent, of_corrected) = (fit(&bent)?, fit(&corrected)?);
    let round_trip = corrected.iter().zip(&ideal).map(|(c, i)| (c - i).norm()).fold(0.0, f64::max);
    let mut answer = Vec::new();
    for line in [&of_bent, &of_corrected] {
        answer.extend([line.max_deviation(), line.rms_deviation()]);
    }
    answer.push(round_trip);
    for k in 0..ideal.len() {
        answer.extend([bent[k].x, bent[k].y, of_bent.deviations[k]]);
        answer.extend([corrected[k].x, corrected[k].y, of_corrected.deviations[k]]);
    }
    Ok(answer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chapters_line_bends_as_printed_and_comes_back() {
        let answer = bend(&[-0.18, 0.05, -0.18, 0.05, 60.0]).unwrap();
        // Printed: 4.678 px at most, 2.249 px RMS, straight after correction.
        assert!((answer[0] - 4.678).abs() < 5e-4 && (answer[1] - 2.249).abs() < 5e-4, "{answer:?}");
        assert!(answer[2] < 3e-12 && answer[4] < 3e-12);
        assert_eq!(answer.len(), 5 + 6 * 61);
    }

    #[test]
    fn without_a_lens_nothing_moves() {
        let seen = distort(&[0.0, 0.0, 10.0, 20.0]).unwrap();
        // Rounding of coordinates below 640 px, to the camera's unit and back.
        assert!((seen[0] - 10.0).abs() < 1e-12 && (seen[1] - 20.0).abs() < 1e-12, "{seen:?}");
        let answer = bend(&[-0.18, 0.05, 0.0, 0.0, 60.0]).unwrap();
        assert!((answer[2] - answer[0]).abs() < 1e-12);
    }

    #[test]
    fn a_lens_that_folds_back_is_refused_in_words() {
        assert!(bend(&[0.3, 0.0, -0.9, 0.0, 0.0]).is_err_and(|words| words.contains("folds back")));
    }
}
