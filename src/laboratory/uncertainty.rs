//! Where in the image is a calibration good? The error of a pixel that the bound predicts, over the frame.

use super::questions::{Answer, count, exactly};
use super::scene::{KNOBS, Knobs};
use calibench::calibrate::Covariance;
use calibench::camera::{Camera, FreeParameters, Parameter};
use calibench::evaluate::cramer_rao;
use calibench::evaluate::difference::{TakenOut, frame_difference, frame_nodes};
use calibench::geometry::Vec2;
use calibench::synth::Truth;

/// Change of a parameter for a difference quotient, in its standard deviations: small against what bends, and
/// large against rounding.
const STEP: f64 = 1e-3;

/// Knobs, and what the camera is used for (0: points at the target's distance, 1: directions) -> how far from
/// the principal point points are seen, px; root of the mean squared error of a pixel as far as that and
/// beyond, px; then every node of the frame, row by row from the top: u, v, and the root of its mean squared
/// error, px, NaN where the lens folds back.
pub(crate) fn uncertainty(numbers: &[f64]) -> Answer {
    let [knobs @ .., used_for] = exactly::<{ KNOBS + 1 }>(numbers)?;
    let knobs = Knobs::read(knobs)?;
    let scene = knobs.scene()?;
    let camera = scene.truth.camera;
    let bound = cramer_rao(&scene.truth, FreeParameters::STANDARD, knobs.sigma_px)
        .map_err(|error| error.to_string())?;
    let taken_out = match count(used_for, "use of the camera", 0, 1)? {
        0 => TakenOut::RotationAndTranslation { distance: scene.truth.cam_from_target[0].translation.z },
        _ => TakenOut::Rotation,
    };
    let nodes = errors(&camera, &bound, taken_out)?;
    let reach = super::calibration::reach_px(&scene);
    let centre = Vec2::new(camera.cx, camera.cy);
    let rms = |within: bool| {
        let is_in_part =
            |(pixel, error): &&(Vec2, f64)| !error.is_nan() && ((pixel - centre).norm() <= reach) == within;
        let part = nodes.iter().filter(is_in_part);
        let (sum, count) =
            part.fold((0.0, 0.0), |(sum, count), (_, error)| (sum + error * error, count + 1.0));
        (sum / count).sqrt()
    };
    let mut answer = vec![reach, rms(true), rms(false)];
    answer.extend(nodes.iter().flat_map(|(pixel, error)| [pixel.x, pixel.y, *error]));
    Ok(answer)
}

/// To first order the error at a pixel is `G (estimate - truth)`, with the derivatives `G` of the pixel by
/// the parameters, the motion that fits best taken out, and its mean square is the trace of `G P G^T`, `P`
/// the bound. `G` comes from difference quotients of the comparison of two cameras. NaN at nodes that one of
/// these leaves out.
fn errors(camera: &Camera, bound: &Covariance, taken_out: TakenOut) -> Result<Vec<(Vec2, f64)>, String> {
    let column = |parameter: Parameter| -> Result<Vec<(Vec2, Vec2)>, String> {
        let step = STEP * bound.standard_deviation(parameter).unwrap_or(0.0);
        let moved = camera.with(parameter, camera.get(parameter) + step);
        let map = frame_difference(camera, &moved, Truth::EXAMPLE_IMAGE, taken_out)
            .map_err(|error| error.to_string())?;
        Ok(map.nodes.into_iter().map(|node| (node.pixel, node.difference / step)).collect())
    };
    let columns = FreeParameters::STANDARD.iter().map(column).collect::<Result<Vec<_>, _>>()?;
    // A lens that folds back within the frame leaves out other nodes with one parameter than with another.
    let at = |pixel: &Vec2, column: &[(Vec2, Vec2)]| {
        column.iter().find(|(place, _)| place == pixel).map(|(_, derivative)| *derivative)
    };
    let error = |pixel: &Vec2| {
        let derivatives: Option<Vec<Vec2>> = columns.iter().map(|column| at(pixel, column)).collect();
        derivatives.map_or(f64::NAN, |derivatives| mean_square(bound, &derivatives).sqrt())
    };
    Ok(frame_nodes(Truth::EXAMPLE_IMAGE).0.into_iter().map(|pixel| (pixel, error(&pixel))).collect())
}

/// The trace of `G P G^T`; the columns of `G` are the derivatives.
fn mean_square(bound: &Covariance, derivatives: &[Vec2]) -> f64 {
    let all = derivatives.len();
    let pairs = (0..all).flat_map(|i| (0..all).map(move |j| (i, j)));
    pairs.map(|(i, j)| bound.intrinsics[(i, j)] * derivatives[i].dot(&derivatives[j])).sum()
}

#[cfg(test)]
mod tests {
    use super::super::scene::CHAPTER;
    use super::*;

    #[test]
    fn farther_out_than_points_were_seen_is_worse_and_directions_are_worse_still() {
        let ask = |used_for: f64| uncertainty(&[&CHAPTER[..], &[used_for]].concat()).unwrap();
        let (at_target, directions) = (ask(0.0), ask(1.0));
        assert!(at_target[2] > 2.0 * at_target[1] && directions[1] > at_target[1]);
        assert_eq!(at_target.len() - 3, 3 * 30 * 23);
        assert!(at_target.iter().all(|number| number.is_finite()));
    }

    #[test]
    fn where_the_lens_folds_back_nothing_is_said_and_the_middle_is_as_good_as_ever() {
        let mut folding = CHAPTER;
        (folding[5], folding[6]) = (-0.3, -0.1);
        let answer = uncertainty(&[&folding[..], &[0.0]].concat()).unwrap();
        let (nodes, _) = answer[3..].as_chunks::<3>();
        let silent: Vec<f64> = nodes
            .iter()
            .filter(|[.., error]| error.is_nan())
            .map(|[u, v, _]| libm::hypot(u - 326.0, v - 243.0))
            .collect();
        // Only corners are left out, as points went nowhere near them.
        assert!(!silent.is_empty() && silent.iter().all(|radius| *radius > answer[0]), "{silent:?}");
        assert!(answer[1] < 0.2 && answer[2].is_finite());
    }

    #[test]
    fn a_scene_that_bounds_nothing_is_refused_in_words() {
        let facing = uncertainty(&[&[0.0], &CHAPTER[1..], &[0.0]].concat());
        assert!(facing.is_err_and(|words| words.contains("no unbiased estimate")));
    }
}
