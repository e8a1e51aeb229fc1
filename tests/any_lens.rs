//! Cameras with lenses of every model, from exact and noisy marks: the estimate, its covariance, and the
//! choice between models.

use calibench::board::View;
use calibench::calibrate::{
    Board, CalibrationError, Candidate, Deformation, LensCalibration, Settings, Warning, calibrate,
    calibrate_lens, compare_models,
};
use calibench::camera::{BrownConrady, Camera, Lens, Model, Parameter};
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::synth::{Scene, Stream, StreamKey, Truth};

use crate::lens_views::{self, board};

/// Twelve views, close enough for the wanted half field of view.
fn poses(distance: f64) -> Vec<Pose> {
    lens_views::poses(12, distance, [0.35, 0.3])
}

/// What the camera sees with noise of `sigma` px; marks that it does not see are left out.
fn seen(
    camera: &Camera<Lens>,
    poses: &[Pose],
    height: impl Fn(&Vec2) -> f64,
    sigma: f64,
    trial: u64,
) -> Vec<View> {
    let mut stream = Stream::open(StreamKey { seed: 5, scenario: "lens", trial, purpose: "noise" });
    let view = |pose: &Pose| {
        let pairs = board().into_iter().filter_map(|p| {
            let pixel = camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, height(&p))))?;
            Some((p, pixel))
        });
        let (points, pixels): (Vec<Vec2>, Vec<Vec2>) = pairs.unzip();
        let noisy = pixels.iter().map(|p| p + sigma * Vec2::new(stream.normal(), stream.normal())).collect();
        View::new(points, noisy).unwrap()
    };
    poses.iter().map(view).collect()
}

fn camera(model: Model, f: f64, coefficients: &[f64]) -> Camera<Lens> {
    Camera::with_lens(f, 1.01 * f, 655.0, 470.0, Lens::new(model, coefficients).unwrap())
}

/// A camera of every model with a distance of the board that shows its lens.
fn cameras() -> Vec<(Camera<Lens>, f64)> {
    vec![
        (camera(Model::BrownConrady, 900.0, &[-0.2, 0.06, 1e-3, -5e-4, 0.0]), 130.0),
        (camera(Model::Rational, 700.0, &[0.6, 0.05, 1e-3, -5e-4, 0.001, 0.9, 0.2, 0.01]), 80.0),
        (
            camera(
                Model::ThinPrism,
                700.0,
                &[-0.25, 0.05, 1e-3, -5e-4, 0.0, 0.0, 0.0, 0.0, 2e-3, -1e-3, 1e-3, 1e-3],
            ),
            90.0,
        ),
        (camera(Model::KannalaBrandt, 420.0, &[-0.02, 0.004, -0.001, 0.0002]), 45.0),
        (camera(Model::Division, 800.0, &[-0.25]), 90.0),
        (camera(Model::DoubleSphere, 500.0, &[-0.2, 0.6]), 50.0),
    ]
}

/// All coefficients but those that hardly show, which are held at the truth.
fn settings(truth: &Camera<Lens>) -> Settings {
    use Parameter::{K3, K4, K5, K6};
    let model = truth.distortion.model();
    let settings = Settings::of_model(model).with_image_size((1280, 960));
    let held: &[Parameter] = match model {
        Model::BrownConrady => return settings.estimate(Parameter::P1).estimate(Parameter::P2),
        Model::Rational => &[K3, K6],
        Model::ThinPrism => &[K3, K4, K5, K6],
        _ => &[],
    };
    held.iter().fold(settings, |s, &p| s.hold(p, truth.distortion.get(p).unwrap()))
}

#[test]
fn every_model_finds_its_camera_without_noise() {
    for (truth, distance) in cameras() {
        let views = seen(&truth, &poses(distance), |_| 0.0, 0.0, 0);
        let found = calibrate_lens(&views, &settings(&truth)).unwrap();
        let model = truth.distortion.model();
        assert!(found.rmse_px < 1e-8, "{model}: {}", found.rmse_px);
        for ((parameter, value), (_, wanted)) in found.camera.values().zip(truth.values()) {
            assert!(
                (value - wanted).abs() <= 1e-6 * (1.0 + wanted.abs()),
                "{model} {parameter}: {value} {wanted}"
            );
        }
    }
}

#[test]
fn what_is_held_keeps_its_value_with_any_lens() {
    use Parameter::{Cx, Cy, Fx, Fy};
    for (truth, distance) in cameras() {
        let views = seen(&truth, &poses(distance), |_| 0.0, 0.1, 7);
        for held in [Fx, Fy, Cx, Cy] {
            let value = truth.value(held).unwrap();
            let found = calibrate_lens(&views, &settings(&truth).hold(held, value)).unwrap();
            assert_eq!(found.camera.value(held), Some(value), "{}", truth.distortion.model());
            for free in [Fx, Fy, Cx, Cy].into_iter().filter(|&parameter| parameter != held) {
                let off = found.camera.value(free).unwrap() - truth.value(free).unwrap();
                let sd = found.standard_deviation(free).unwrap();
                assert!(
                    off.abs() < 5.0 * sd,
                    "{} with {held} held: {free} off by {off}, {sd}",
                    truth.distortion.model()
                );
            }
        }
    }
}

#[test]
fn errors_have_the_stated_covariance_with_every_model() {
    for (truth, distance) in cameras() {
        let settings = settings(&truth);
        let trials = 40;
        let (mut sum, mut n) = (0.0, 0);
        for trial in 0..trials {
            let views = seen(&truth, &poses(distance), |_| 0.0, 0.2, trial);
            let found = calibrate_lens(&views, &settings).unwrap();
            let error: Vec<f64> =
                found.free.iter().map(|p| found.camera.value(p).unwrap() - truth.value(p).unwrap()).collect();
            n = error.len();
            sum += found.covariance.normalised_error_squared(&error).unwrap();
        }
        // Chi-squared with n degrees of freedom a trial: four standard deviations of the mean.
        let (mean, sd) = (sum / trials as f64 / n as f64, (2.0 / (trials as f64 * n as f64)).sqrt());
        assert!((mean - 1.0).abs() < 4.0 * sd + 0.05, "{}: {mean} +- {sd}", truth.distortion.model());
    }
}

/// Weights of 1 make marks weighted, and the general estimator answers in place of the special one.
fn weighted(views: &[View], weight: impl Fn(usize) -> f64) -> Vec<View> {
    views
        .iter()
        .map(|view| view.clone().with_weights((0..view.len()).map(&weight).collect()).unwrap())
        .collect()
}

#[test]
fn both_estimators_agree_on_the_lens_that_both_know() {
    let mut stream = Stream::open(StreamKey { seed: 6, scenario: "lens", trial: 0, purpose: "noise" });
    let views = Scene::example().observe(0.1, &mut stream);
    let free = "fx,fy,cx,cy,k1,k2,p1,p2,k3".parse().unwrap();
    for settings in [Settings::standard(), Settings::new(free), Settings::standard().tie_focal_lengths(1.0)] {
        let special = calibrate(&views, &settings).unwrap();
        let general = calibrate_lens(&weighted(&views, |_| 1.0), &settings).unwrap();
        assert!(general.certificate.is_none() && general.free == special.free);
        for parameter in special.free.iter() {
            let sd = special.covariance.standard_deviation(parameter).unwrap();
            let off = general.camera.value(parameter).unwrap() - special.camera.get(parameter);
            assert!(off.abs() < 1e-5 * sd, "{parameter}: {off} {sd}");
            let other = general.covariance.standard_deviation(parameter).unwrap();
            assert!((other / sd - 1.0).abs() < 1e-6, "{parameter}: {other} {sd}");
        }
        for (a, b) in special.covariance.poses.iter().zip(&general.covariance.poses) {
            assert!((a - b).norm() <= 1e-6 * a.norm());
        }
        assert!((special.sigma_px / general.sigma_px - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_weight_of_two_counts_as_four_marks() {
    let mut stream = Stream::open(StreamKey { seed: 7, scenario: "lens", trial: 0, purpose: "noise" });
    let views = Scene::example().observe(0.1, &mut stream);
    let twice = calibrate_lens(&weighted(&views, |_| 2.0), &Settings::standard()).unwrap();
    let once = calibrate_lens(&weighted(&views, |_| 1.0), &Settings::standard()).unwrap();
    // The same camera and covariance, whatever the unit of the weights; the noise is that of weight 1.
    assert!((twice.camera.fx - once.camera.fx).abs() < 1e-6);
    assert!((twice.sigma_px / once.sigma_px - 2.0).abs() < 1e-9);
    let sd = |c: &LensCalibration| c.covariance.standard_deviation(Parameter::Fx).unwrap();
    assert!((sd(&twice) / sd(&once) - 1.0).abs() < 1e-6);
    // A mark of weight w is worth w^2: marks that are 100 times noisier than the rest change nothing.
    let mut pixels: Vec<Vec<Vec2>> = views.iter().map(|view| view.pixels().to_vec()).collect();
    pixels.iter_mut().for_each(|view| view[7] += Vec2::new(10.0, -7.0));
    let wild: Vec<View> =
        views.iter().zip(pixels).map(|(view, p)| View::new(view.points().to_vec(), p).unwrap()).collect();
    let weight = |i: usize| if i == 7 { 1e-3 } else { 1.0 };
    let told = calibrate_lens(&weighted(&wild, weight), &Settings::standard()).unwrap();
    let clean = calibrate_lens(&weighted(&views, weight), &Settings::standard()).unwrap();
    assert!((told.camera.fx - clean.camera.fx).abs() < 0.01 * sd(&clean));
}

#[test]
fn a_bowed_board_is_found_with_its_size() {
    let truth = camera(Model::KannalaBrandt, 420.0, &[-0.02, 0.004, -0.001, 0.0002]);
    let (bow_x, bow_y, twist) = (0.6, -0.3, 0.2);
    let height = |p: &Vec2| {
        let (x, y) = (p.x / 40.0 - 1.0, p.y / 30.0 - 1.0);
        bow_x * (1.0 - x * x) + bow_y * (1.0 - y * y) + twist * x * y
    };
    let views = seen(&truth, &poses(45.0), height, 0.1, 1);
    let flat = calibrate_lens(&views, &settings(&truth)).unwrap();
    let free = settings(&truth).with_board(Board::Bent { standard_deviation: f64::INFINITY });
    let bent = calibrate_lens(&views, &free).unwrap();
    assert!(flat.rmse_px > 2.0 * bent.rmse_px && bent.sigma_px < 0.11, "{} {}", flat.rmse_px, bent.rmse_px);
    let shape = bent.board.unwrap();
    for (k, (found, wanted)) in
        [(shape.bow_x, bow_x), (shape.bow_y, bow_y), (shape.twist, twist)].into_iter().enumerate()
    {
        let sd = shape.standard_deviations[k];
        assert!((found - wanted).abs() < 4.0 * sd && sd < 0.05, "{k}: {found} {wanted} {sd}");
    }
    let middle = Vec2::new(40.0, 30.0);
    assert!((shape.height(&middle) - 0.3).abs() < 0.1);
    // A prior that says flat keeps it flat; a wrong one is told, one that allows for the shape is not.
    let known = |standard_deviation| {
        calibrate_lens(&views, &settings(&truth).with_board(Board::Bent { standard_deviation })).unwrap()
    };
    let contradicted = |found: &LensCalibration| {
        found.warnings.iter().find_map(|w| match *w {
            Warning::BoardContradicted { deformation, deviations, .. } => Some((deformation, deviations)),
            _ => None,
        })
    };
    assert!(known(1e-4).board.unwrap().bow_x.abs() < 1e-2);
    let told = contradicted(&known(0.02));
    assert!(matches!(told, Some((Deformation::BowX, deviations)) if deviations > 10.0), "{told:?}");
    // One that leaves the marks no say is as good as a flat board.
    let is_not_flat = |found: &LensCalibration| {
        let height = |w: &Warning| matches!(*w, Warning::NotFlat { bow_x, .. } if (bow_x - 0.6).abs() < 0.05);
        found.warnings.iter().any(height)
    };
    for standard_deviation in [1e-3, 1e-4, 1e-5, 1e-7] {
        let found = known(standard_deviation);
        assert!(is_not_flat(&found) != contradicted(&found).is_some(), "{standard_deviation}");
    }
    assert_eq!(contradicted(&known(0.5)), None);
    assert_eq!(contradicted(&bent), None);
}

#[test]
fn what_a_model_cannot_do_is_refused_by_name() {
    let views = Scene::example().exact();
    let settings = Settings::of_model(Model::Division).estimate(Parameter::K2);
    assert!(matches!(
        calibrate_lens(&views, &settings),
        Err(CalibrationError::NotOfModel { parameter: Parameter::K2, model: Model::Division })
    ));
    assert!(matches!(
        calibrate(&views, &Settings::of_model(Model::Division)),
        Err(CalibrationError::OfAnyLens { .. })
    ));
    let bent = Settings::standard().with_board(Board::Bent { standard_deviation: 0.0 });
    assert!(matches!(calibrate_lens(&views, &bent), Err(CalibrationError::BadBoard { .. })));
    // Marks beside the camera: no pinhole sees them.
    let fisheye = camera(Model::KannalaBrandt, 300.0, &[0.0; 4]);
    let near: Vec<Pose> = poses(14.0);
    let wide = seen(&fisheye, &near, |_| 0.0, 0.05, 2);
    let found = calibrate_lens(&wide, &Settings::of_model(Model::KannalaBrandt)).unwrap();
    assert!((found.camera.fx - 300.0).abs() < 1.0, "{:?}", found.camera);
}

#[test]
fn a_camera_of_the_special_estimator_is_one_of_any_lens() {
    let plain = Camera::pinhole(600.0, 590.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.2, 0.05));
    let any: Camera<Lens> = plain.into();
    let truth = Truth::example();
    for point in &truth.points {
        let seen = truth.cam_from_target[0].apply(&Vec3::new(point.x, point.y, 0.0));
        assert!((any.pixel(&seen).unwrap() - plain.project(&seen).unwrap()).norm() < 1e-12);
    }
}

#[test]
fn the_model_that_made_the_marks_is_chosen() {
    let truth = camera(Model::BrownConrady, 900.0, &[-0.2, 0.06, 1e-3, -5e-4, 0.0]);
    let views = seen(&truth, &poses(130.0), |_| 0.0, 0.1, 9);
    let (compared, refused) = compare_models(&views, &Settings::standard(), &Candidate::usual());
    assert!(compared.len() + refused.len() == 8);
    let best = &compared[0];
    // What has fewer coefficients, or others, predicts worse.
    assert_eq!(best.candidate.model, Model::BrownConrady);
    let named = |model| compared.iter().find(|c| c.candidate.model == model);
    let division = named(Model::Division).unwrap();
    assert!(division.hold_out_px > best.hold_out_px, "{:?} {:?}", division.hold_out_px, best.hold_out_px);
    assert!(division.bic > best.bic + 10.0, "{} {}", division.bic, best.bic);
    let (wins, folds) = best.wins_against(division);
    assert!(wins == folds && folds == 5, "{wins} of {folds}");
    assert!(best.correlation.abs() < 0.15, "{}", best.correlation);
    // What division leaves over is not chance; and it has no unknowns more to take away by chance.
    assert!(best.chance_against(division).unwrap() < 1e-9 && division.chance_against(best).is_none());
}

#[test]
fn a_lens_with_more_coefficients_does_better_by_chance_as_often_as_is_said() {
    let truth = camera(Model::BrownConrady, 900.0, &[-0.2, 0.06, 0.0, 0.0, 0.0]);
    let candidates = &Candidate::usual()[..2];
    // Five marks in each of four views leave ten degrees of freedom, and k3 one fewer.
    let few = |view: &View| {
        let of = |list: &[Vec2]| [0, 8, 30, 54, 62].map(|i| list[i]).to_vec();
        View::new(of(view.points()), of(view.pixels())).unwrap()
    };
    let mut chances: Vec<f64> = (0..60)
        .filter_map(|trial| {
            let views = seen(&truth, &poses(130.0)[..4], |_| 0.0, 0.1, 900 + trial);
            let views: Vec<View> = views.iter().map(few).collect();
            let (compared, _) = compare_models(&views, &Settings::standard(), candidates);
            let fit = |own: &Candidate| compared.iter().find(|c| c.candidate == *own);
            fit(&candidates[1])?.chance_against(fit(&candidates[0])?)
        })
        .collect();
    chances.sort_by(f64::total_cmp);
    // Uniform: Kolmogorov's distance of sixty draws is below 0.25 in 999 of 1000 sets.
    let count = chances.len() as f64;
    let distance = chances.iter().enumerate().map(|(i, p)| (p - (i as f64 + 0.5) / count).abs());
    let farthest = distance.fold(0.0, f64::max);
    assert!(count > 55.0 && farthest < 0.25, "{count} {farthest}");
}

#[test]
fn a_division_lens_is_found_from_marks_beside_the_camera() {
    let truth = camera(Model::Division, 330.0, &[-0.2]);
    let views = seen(&truth, &poses(16.0), |_| 0.0, 0.1, 3);
    let found = calibrate_lens(&views, &settings(&truth)).unwrap();
    let farthest = found
        .cam_from_target
        .iter()
        .zip(&views)
        .flat_map(|(pose, view)| view.points().iter().map(|p| pose.apply(&Vec3::new(p.x, p.y, 0.0)).z))
        .fold(f64::INFINITY, f64::min);
    assert!(farthest < 0.0 && found.termination.is_minimum(), "{farthest} {:?}", found.termination);
    let error: Vec<f64> =
        found.free.iter().map(|p| found.camera.value(p).unwrap() - truth.value(p).unwrap()).collect();
    let square = found.covariance.normalised_error_squared(&error).unwrap();
    // Chi-squared with five degrees of freedom: 25.7 is exceeded once in ten thousand.
    assert!(square < 25.7, "{square}");
}

/// A fraction whose numerator and denominator nearly cancel: the search goes along a curved valley.
#[test]
fn a_rational_lens_with_terms_that_nearly_cancel_converges_and_says_what_its_deviations_are_worth() {
    let truth = camera(Model::Rational, 700.0, &[0.6, 0.05, 1e-3, -5e-4, 0.001, 0.9, 0.2, 0.01]);
    let settings = Settings::of_model(Model::Rational).with_image_size((1280, 960));
    let (mut warned, mut sum) = (0, 0.0);
    for trial in 0..8 {
        let views = seen(&truth, &poses(80.0), |_| 0.0, 0.2, trial);
        let found = calibrate_lens(&views, &settings).unwrap();
        assert!(found.termination.is_minimum(), "{trial}: {:?}", found.termination);
        sum += found.sigma_px / 0.2;
        let speaks = |w: &Warning| matches!(w, Warning::NotLinear { .. } | Warning::Ambiguous { .. });
        warned += usize::from(found.warnings.iter().any(speaks));
    }
    // 8 x 1428 degrees of freedom: a fitted noise is that of the marks to 0.7 %.
    assert!((sum / 8.0 - 1.0).abs() < 0.03, "{sum}");
    assert!(warned >= 6, "{warned}");
}
