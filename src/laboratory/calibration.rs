//! One draw of the four poses, calibrated, and what theory says of all draws.

use super::questions::{Answer, exactly};
use super::scene::{KNOBS, Knobs, SEED};
use calibench::board::View;
use calibench::calibrate::{Covariance, Settings, calibrate};
use calibench::camera::{Camera, FreeParameters};
use calibench::evaluate::{RmseDistribution, cramer_rao, errors_of};
use calibench::geometry::Vec2;
use calibench::synth::{Scene, Stream, StreamKey};

/// Bars of the predicted histogram of the RMSE, over this many standard deviations to either side of its
/// mean.
const BARS: usize = 24;
const BARS_REACH: f64 = 4.0;

/// Knobs -> what is known before anything is drawn: the six true parameters; their covariance by the
/// Cramer-Rao bound, row by row, NaN where the scene bounds nothing; mean, standard deviation and floor of
/// the RMSE, px; how far from the principal point points are seen, px; the lowest RMSE of the histogram and
/// the width of its bars, px; the share of trials in each bar.
pub(crate) fn predict(numbers: &[f64]) -> Answer {
    let knobs = Knobs::read(exactly(numbers)?)?;
    let scene = knobs.scene()?;
    let bound = cramer_rao(&scene.truth, FreeParameters::STANDARD, knobs.sigma_px).ok();
    let rmse = knobs.rmse(&scene);
    let mut answer = parameters(&scene.truth.camera);
    let n = answer.len();
    let entry = |at: usize| bound.as_ref().map_or(f64::NAN, |b| b.intrinsics[(at / n, at % n)]);
    answer.extend((0..n * n).map(entry));
    answer.extend([rmse.mean_px(), rmse.standard_deviation_px(), rmse.noise_floor_px(), reach_px(&scene)]);
    answer.extend(histogram(&rmse));
    Ok(answer)
}

/// Lowest edge, width of a bar, and the probability of each.
fn histogram(rmse: &RmseDistribution) -> Vec<f64> {
    let (mean, sd) = (rmse.mean_px(), rmse.standard_deviation_px());
    let (low, width) = (mean - BARS_REACH * sd, 2.0 * BARS_REACH * sd / BARS as f64);
    let below = |k: usize| rmse.cdf((low + width * k as f64).max(0.0));
    let mut bars = vec![low, width];
    bars.extend((0..BARS).map(|k| below(k + 1) - below(k)));
    bars
}

/// How far from the principal point the farthest point is seen, px.
pub(crate) fn reach_px(scene: &Scene) -> f64 {
    let camera = &scene.truth.camera;
    let centre = Vec2::new(camera.cx, camera.cy);
    scene.pixels().iter().flatten().map(|pixel| (pixel - centre).norm()).fold(0.0, f64::max)
}

/// Knobs and the number of the draw -> points of a view; u, v of every point as seen, px, view by view.
pub(crate) fn observe(numbers: &[f64]) -> Answer {
    let (_, scene, views) = drawn(numbers)?;
    let mut answer = vec![scene.truth.points.len() as f64];
    answer.extend(views.iter().flat_map(|view| view.pixels()).flat_map(|pixel| [pixel.x, pixel.y]));
    Ok(answer)
}

/// Knobs and the number of the draw -> the six estimates; their own standard deviations; RMSE, px;
/// chi-squared of the six errors under the bound, NaN without one; the residual of every point, px, view by
/// view.
pub(crate) fn calibrate_once(numbers: &[f64]) -> Answer {
    let (knobs, scene, views) = drawn(numbers)?;
    let found = calibrate(&views, &Settings::standard()).map_err(|error| error.to_string())?;
    let truth = &scene.truth;
    let bound = cramer_rao(truth, FreeParameters::STANDARD, knobs.sigma_px).ok();
    let errors = bound.and_then(|bound| errors_of(&truth.camera, &found.camera, &bound));
    let mut answer = parameters(&found.camera);
    answer.extend(deviations(&found.covariance));
    answer.extend([found.rmse_px, errors.map_or(f64::NAN, |errors| errors.chi_squared)]);
    answer.extend(found.residuals.iter().flatten().flat_map(|residual| [residual.x, residual.y]));
    Ok(answer)
}

/// The scene of the knobs and its views with the noise of a draw.
fn drawn(numbers: &[f64]) -> Result<(Knobs, Scene, Vec<View>), String> {
    let [knobs @ .., draw] = exactly::<{ KNOBS + 1 }>(numbers)?;
    let knobs = Knobs::read(knobs)?;
    let scene = knobs.scene()?;
    let key = StreamKey { seed: SEED, scenario: "four-pose", trial: draw as u64, purpose: "noise" };
    let views = scene.observe(knobs.sigma_px, &mut Stream::open(key));
    Ok((knobs, scene, views))
}

/// How many parameters are estimated.
pub(crate) const PARAMETERS: usize = 6;

/// The parameters that are estimated.
pub(crate) fn parameters(camera: &Camera) -> Vec<f64> {
    FreeParameters::STANDARD.iter().map(|parameter| camera.get(parameter)).collect()
}

fn deviations(covariance: &Covariance) -> impl Iterator<Item = f64> {
    FreeParameters::STANDARD
        .iter()
        .map(|parameter| covariance.standard_deviation(parameter).unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::super::scene::CHAPTER;
    use super::*;

    #[test]
    fn the_chapters_prediction_is_met() {
        let answer = predict(&CHAPTER).unwrap();
        // Printed for this scene: the standard deviation of fx, mean and deviation of the RMSE, the noise
        // floor.
        for (value, printed, digit) in [
            (answer[6].sqrt(), 0.681, 1e-3),
            (answer[42], 0.1371, 1e-4),
            (answer[43], 0.0045, 1e-4),
            (answer[44], 0.1414, 1e-4),
        ] {
            assert!((value - printed).abs() <= 0.5 * digit, "{value} is not {printed}");
        }
        // Four standard deviations to either side hold all but 6e-5.
        let held: f64 = answer[48..].iter().sum();
        assert!(answer.len() == 48 + BARS && (1.0 - held) < 2e-4, "{held}");
    }

    #[test]
    fn a_draw_has_a_residual_for_every_point_and_its_rmse() {
        let numbers = [&CHAPTER[..], &[3.0]].concat();
        let (seen, found) = (observe(&numbers).unwrap(), calibrate_once(&numbers).unwrap());
        let residuals = &found[14..];
        assert_eq!((seen[0], seen.len() - 1), (63.0, residuals.len()));
        let sum: f64 = residuals.iter().map(|r| r * r).sum();
        assert!(((sum / 252.0).sqrt() - found[12]).abs() < 1e-12);
    }

    #[test]
    fn the_parameters_are_those_of_the_experiment() {
        assert_eq!(FreeParameters::STANDARD.len(), PARAMETERS);
    }

    #[test]
    fn without_tilt_the_data_are_refused_and_nothing_is_bounded() {
        let mut facing = CHAPTER;
        facing[0] = 0.0;
        assert!(calibrate_once(&[&facing[..], &[0.0]].concat()).is_err_and(|e| e.contains("focal length")));
        assert!(predict(&facing).unwrap()[6].is_nan());
    }
}
