//! Does the single-plane calibration recover a lens from one view, with the residuals and the spread that
//! theory predicts?

use calibench::board::View;
use calibench::calibrate::Termination;
use calibench::calibrate::single_plane::{
    SinglePlane, SinglePlaneError, SinglePlaneOptions, calibrate_single_plane, predicted_rms_px,
};
use calibench::camera::{BrownConrady, Camera};
use calibench::geometry::Vec2;
use calibench::synth::{Scene, Stream, StreamKey, Truth};

const TRUE_CENTRE: Vec2 = Vec2::new(326.0, 243.0);
const IMAGE_CENTRE: Vec2 = Vec2::new(320.0, 240.0);
const SIGMA_PX: f64 = 0.1;
const POINTS: usize = 63;

fn options(centre_px: Vec2, centre_free: bool) -> SinglePlaneOptions {
    SinglePlaneOptions { focal_px: 600.0, centre_px, centre_free }
}

/// The chapter's camera and target, one of its four poses only.
fn scene(pose: usize) -> Scene {
    let chapter = Truth::example();
    Scene::new(Truth { cam_from_target: vec![chapter.cam_from_target[pose]], ..chapter }).unwrap()
}

fn noisy(scene: &Scene, trial: u64) -> View {
    let key = StreamKey { seed: 20260101, scenario: "single-plane", trial, purpose: "noise" };
    scene.observe(SIGMA_PX, &mut Stream::open(key)).remove(0)
}

fn lens_errors(fit: &SinglePlane) -> [f64; 4] {
    let (lens, centre) = (fit.distortion, fit.centre_px - TRUE_CENTRE);
    [lens.k1 + 0.18, lens.k2 - 0.05, centre.x, centre.y]
}

#[test]
fn a_noiseless_view_gives_the_lens_back_from_any_pose() {
    for pose in 0..4 {
        let view = scene(pose).exact().remove(0);
        for options in [options(TRUE_CENTRE, false), options(IMAGE_CENTRE, true)] {
            let fit = calibrate_single_plane(&view, &options).unwrap();
            assert_eq!(fit.termination, Termination::Converged);
            assert!(fit.rms_px < 1e-11, "{:e}", fit.rms_px);
            // Predicted spread at sigma = 640 eps, the rounding of a pixel: sd(k2) 0.03 * 1.4e-12, sd(c) 3 *
            // 1.4e-12 px; 100 of them.
            let [k1, k2, cu, cv] = lens_errors(&fit);
            assert!(k1.abs() < 1e-10 && k2.abs() < 1e-10, "{k1:e} {k2:e}");
            assert!(cu.abs() < 1e-8 && cv.abs() < 1e-8, "{cu:e} {cv:e}");
        }
    }
}

#[test]
fn correction_undoes_the_lens_and_the_homography_finds_the_target() {
    let scene = scene(3);
    let view = scene.exact().remove(0);
    let fit = calibrate_single_plane(&view, &options(TRUE_CENTRE, false)).unwrap();
    for (point, pixel) in view.pairs() {
        let ideal = scene.truth.camera.correct_pixel(pixel).unwrap();
        assert!((fit.correct_pixel(pixel).unwrap() - ideal).norm() < 1e-9);
        assert!((fit.target_from_pixel(pixel).unwrap().unwrap() - point).norm() < 1e-9);
    }
}

#[test]
fn the_focal_length_is_a_gauge() {
    let view = noisy(&scene(0), 0);
    let fit = |focal_px| {
        let options = SinglePlaneOptions { focal_px, ..options(TRUE_CENTRE, false) };
        calibrate_single_plane(&view, &options).unwrap()
    };
    let (at_600, at_900) = (fit(600.0), fit(900.0));
    assert!((at_600.rms_px - at_900.rms_px).abs() < 1e-12);
    // k1 scales with f^2, k2 with f^4; both fits stop within 1e-7 of a standard deviation (0.03).
    assert!((at_900.distortion.k1 / 2.25 - at_600.distortion.k1).abs() < 1e-8);
    assert!((at_900.distortion.k2 / 5.0625 - at_600.distortion.k2).abs() < 1e-8);
    let pixel = Vec2::new(50.0, 60.0);
    let moved = at_600.correct_pixel(&pixel).unwrap() - at_900.correct_pixel(&pixel).unwrap();
    assert!(moved.norm() < 1e-6);
}

struct Sample {
    rms_mean: f64,
    /// Mean over the trials of `e^T C^-1 e` for (k1, k2) or (k1, k2, cu, cv), `C` the covariance each fit
    /// reports.
    mean_square: f64,
}

fn monte_carlo(trials: u64, options: &SinglePlaneOptions) -> Sample {
    let scene = scene(0);
    let (mut rms, mut square) = (0.0, 0.0);
    for trial in 0..trials {
        let fit = calibrate_single_plane(&noisy(&scene, trial), options).unwrap();
        assert_eq!(fit.termination, Termination::Converged);
        rms += fit.rms_px;
        let count = if options.centre_free { 4 } else { 2 };
        let errors = nalgebra::DVector::from_column_slice(&lens_errors(&fit)[..count]);
        let spread = fit.spread.unwrap();
        let covariance = spread.lens.view((0, 0), (count, count)).into_owned();
        let scaled = covariance * (SIGMA_PX / spread.sigma_px) * (SIGMA_PX / spread.sigma_px);
        square += (errors.transpose() * scaled.cholesky().unwrap().solve(&errors))[0];
    }
    let trials = trials as f64;
    Sample { rms_mean: rms / trials, mean_square: square / trials }
}

/// Exact mean of `sigma sqrt(chi2_n / N)`.
fn mean_rms(degrees: usize) -> f64 {
    let half = 0.5 * degrees as f64;
    let chi_mean = 2.0f64.sqrt() * libm::exp(libm::lgamma(half + 0.5) - libm::lgamma(half));
    SIGMA_PX * chi_mean / (POINTS as f64).sqrt()
}

/// 1000 trials each; z = 4.5 gives each two-sided check a false-alarm rate of 7e-6, for a seed that is fixed.
const TRIALS: u64 = 1000;
const Z: f64 = 4.5;

fn check(centre_free: bool, parameters: usize) {
    let sample = monte_carlo(TRIALS, &options(TRUE_CENTRE, centre_free));
    let (predicted, sd) = predicted_rms_px(SIGMA_PX, POINTS, parameters);
    let exact = mean_rms(2 * POINTS - parameters);
    assert!((predicted / exact - 1.0).abs() < 1.0 / (4.0 * (2 * POINTS - parameters) as f64) * 1.1);
    let interval = Z * sd / (TRIALS as f64).sqrt();
    assert!((sample.rms_mean - exact).abs() < interval, "{} for {exact} +- {interval}", sample.rms_mean);
    // The chapter's sheet gives 0.1355 +- 0.008 for both; that is the held centre's mean, two parameters
    // fewer.
    let spread = if centre_free { 0.008 } else { interval + 0.00005 };
    assert!((sample.rms_mean - 0.1355).abs() < spread, "{}", sample.rms_mean);
    // e^T C^-1 e follows chi-square with d degrees: mean d, variance 2 d. The linearisation moves the mean by
    // a few percent of that at most: the curvature enters with sd(centre) / focal, about 1e-2, squared
    // against terms of order one.
    let d = if centre_free { 4.0 } else { 2.0 };
    let interval = Z * (2.0 * d / TRIALS as f64).sqrt() + 0.02 * d;
    assert!((sample.mean_square - d).abs() < interval, "{} for {d} +- {interval}", sample.mean_square);
}

#[test]
fn residuals_and_spread_follow_theory_with_the_centre_held_at_the_truth() {
    check(false, 10);
}

#[test]
fn residuals_and_spread_follow_theory_with_the_centre_free() {
    check(true, 12);
}

#[test]
fn a_centre_held_at_the_image_centre_adds_the_expected_model_error() {
    // Without noise what remains is the model's error b; with noise the squares add: E[RMS^2] = sigma^2 (2N -
    // p) / N + b^2.
    let exact = scene(0).exact().remove(0);
    let fit = calibrate_single_plane(&exact, &options(IMAGE_CENTRE, false)).unwrap();
    let noise = mean_rms(2 * POINTS - 10);
    let expected = (noise * noise + fit.rms_px * fit.rms_px).sqrt();
    let mut sum = 0.0;
    let scene = scene(0);
    for trial in 0..TRIALS {
        sum += calibrate_single_plane(&noisy(&scene, trial), &options(IMAGE_CENTRE, false)).unwrap().rms_px;
    }
    let mean = sum / TRIALS as f64;
    let (_, sd) = predicted_rms_px(SIGMA_PX, POINTS, 10);
    let interval = Z * sd / (TRIALS as f64).sqrt();
    assert!((mean - expected).abs() < interval, "{mean} for {expected} +- {interval}");
    // The chapter's sheet: 0.1422 +- 0.009.
    assert!((mean - 0.1422).abs() < interval + 0.00005, "{mean} for 0.1422 +- {interval}");
}

#[test]
fn the_covariance_of_all_parameters_predicts_the_observed_pixels() {
    // A pixel's spread from the full covariance at h33 = 1 agrees with what moving the data does: the mean
    // over the points of trace(J C J^T) is sigma^2 p / N, the hat matrix's trace.
    let view = noisy(&scene(3), 1);
    let fit = calibrate_single_plane(&view, &options(IMAGE_CENTRE, true)).unwrap();
    let spread = fit.spread.as_ref().unwrap();
    let all = spread.all.as_ref().unwrap();
    let predict = |step: &[f64; 12], point: &Vec2| {
        let mut h = fit.ideal_from_target;
        for (i, delta) in step[..8].iter().enumerate() {
            h.0[(i / 3, i % 3)] += delta;
        }
        let centre = fit.centre_px + Vec2::new(step[10], step[11]);
        let lens = BrownConrady::radial(fit.distortion.k1 + step[8], fit.distortion.k2 + step[9]);
        let camera = Camera::pinhole(600.0, 600.0, centre.x, centre.y).with_distortion(lens);
        camera.distort_pixel(&h.apply(point).unwrap())
    };
    let mut trace = 0.0;
    for point in view.points() {
        let columns: Vec<Vec2> = (0..12)
            .map(|i| {
                let h = 1e-4 * all[(i, i)].sqrt();
                let mut step = [0.0; 12];
                step[i] = h;
                let ahead = predict(&step, point);
                step[i] = -h;
                (ahead - predict(&step, point)) / (2.0 * h)
            })
            .collect();
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                trace += all[(i, j)] * a.dot(b);
            }
        }
    }
    let expected = 12.0 * spread.sigma_px * spread.sigma_px;
    // Differences at 1e-4 of a standard deviation: 1e-4 * 0.03 px above rounding 1e-13 leaves 1e-7;
    // cancellation between correlated entries costs three digits.
    assert!((trace / expected - 1.0).abs() < 1e-3, "{trace} for {expected}");
}

#[test]
fn views_that_fix_no_lens_are_refused() {
    let view = scene(0).exact().remove(0);
    let part = |indices: &[usize]| {
        let pick = |from: &[Vec2]| indices.iter().map(|&i| from[i]).collect();
        View::new(pick(view.points()), pick(view.pixels())).unwrap()
    };
    let refused =
        |view: &View, options: SinglePlaneOptions| calibrate_single_plane(view, &options).unwrap_err();
    let held = options(TRUE_CENTRE, false);
    assert_eq!(
        refused(&part(&[0, 8, 54, 62]), held),
        SinglePlaneError::TooFewPoints { parameters: 10, need: 5, got: 4 }
    );
    assert!(matches!(refused(&part(&[0, 1, 2, 3, 4, 5, 6]), held), SinglePlaneError::Homography(_)));
    // Eight points on one circle about the centre see one radius: k1 and k2 cannot be told apart, nor from
    // the scale.
    let ring: Vec<Vec2> = (0..12)
        .map(|i| 30.0 * Vec2::new(libm::cos(f64::from(i) * 0.5), libm::sin(f64::from(i) * 0.5)))
        .collect();
    let seen = ring.iter().map(|p| p * 4.0 + TRUE_CENTRE).collect();
    let error = refused(&View::new(ring, seen).unwrap(), held);
    assert!(matches!(error, SinglePlaneError::NotIdentifiable { points: 12, .. }), "{error}");
    assert!(matches!(
        refused(&view, SinglePlaneOptions { focal_px: 0.0, ..held }),
        SinglePlaneError::Options { .. }
    ));
}

#[test]
fn without_distortion_a_free_centre_is_refused_and_a_held_one_is_not() {
    let truth = Truth { camera: Camera::pinhole(600.0, 600.0, 326.0, 243.0), ..Truth::example() };
    let scene = Scene::new(Truth { cam_from_target: vec![truth.cam_from_target[0]], ..truth }).unwrap();
    let released = (0..200)
        .filter(|&trial| {
            let view = noisy(&scene, trial);
            assert!(calibrate_single_plane(&view, &options(TRUE_CENTRE, false)).is_ok());
            match calibrate_single_plane(&view, &options(TRUE_CENTRE, true)) {
                Ok(_) => true,
                Err(SinglePlaneError::CentreNotIdentifiable { .. }) => false,
                Err(other) => panic!("{other}"),
            }
        })
        .count();
    // One in a thousand by the threshold, 1.5 with sigma estimated on 116 degrees of freedom: five or more of
    // 200 at 2e-5.
    assert!(released < 5, "{released} of 200");
}
