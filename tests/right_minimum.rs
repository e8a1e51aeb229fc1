//! Is a minimum the right one, and is what is said of it true? Data on which a search can go wrong, and data
//! that mislead.

use calibench::board::View;
use calibench::calibrate::{
    Calibration, CalibrationError, Loss, Outliers, Settings, Termination, Warning, calibrate, locate,
};
use calibench::camera::{Camera, FreeParameters, Lens, Parameter};
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::synth::{Scene, Stream, StreamKey, Truth, scene::looking_at_centre};

fn noise(scenario: &'static str, trial: u64) -> Stream {
    Stream::open(StreamKey { seed: 11, scenario, trial, purpose: "noise" })
}

fn scene_of(poses: Vec<Pose>) -> Scene {
    Scene::new(Truth { cam_from_target: poses, ..Truth::example() }).unwrap()
}

/// The free parameters within six standard deviations of the truth, at a certified minimum.
fn assert_right(result: &Calibration, truth: &Camera) {
    assert_eq!(result.termination, Termination::Converged, "{:?}", result.warnings);
    for parameter in result.free.iter() {
        let z = (result.camera.get(parameter) - truth.get(parameter))
            / result.standard_deviation(parameter).unwrap();
        assert!(z.abs() < 6.0, "{parameter} is {z:.1} standard deviations off");
    }
}

/// With hundreds of views some always face the camera, and their tilts are in doubt: the others say what
/// camera it is, and no search is made for another.
#[test]
fn a_few_views_of_doubtful_tilt_among_many_need_no_search() {
    let mut stream = noise("many", 0);
    let mut pose = |most: f64| {
        let turn = std::array::from_fn(|_| stream.uniform_in(-most, most));
        looking_at_centre(turn, stream.uniform_in(110.0, 160.0))
    };
    let mut poses: Vec<Pose> = (0..150).map(|_| pose(30.0)).collect();
    poses.extend((0..12).map(|_| pose(0.3)));
    let count = poses.len();
    let scene = scene_of(poses);
    let views = scene.observe(0.5, &mut noise("many", 1));
    let result = calibrate(&views, &Settings::standard()).unwrap();
    assert_right(&result, &scene.truth.camera);
    assert_eq!(result.starts, 1);
    // The tilt that explains each view better: refined from its mirror image no view is explained better.
    let camera: Camera<Lens> = result.camera.into();
    let poses = &result.cam_from_target;
    for view in (0..count).filter(|&view| view >= 150) {
        let alone = locate(&camera, &views[view]).unwrap();
        let square = |pose: &Pose| -> f64 {
            let seen = |p: &Vec2| camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap();
            views[view].pairs().map(|(p, q)| (seen(p) - q).norm_squared()).sum()
        };
        assert!(square(&poses[view]) <= square(&alone.cam_from_target) + 0.01, "view {view}");
    }
}

#[test]
fn three_facing_views_and_one_tilted_give_the_camera() {
    let poses = [([0.0, 0.0, 0.0], 120.0), ([0.0; 3], 140.0), ([0.0; 3], 160.0), ([25.0, 0.0, 0.0], 120.0)];
    let scene = scene_of(poses.map(|(turn, z)| looking_at_centre(turn, z)).to_vec());
    let free: FreeParameters = "fx,fy,cx,cy".parse().unwrap();
    let settings = Settings::new(free).hold(Parameter::K1, -0.18).hold(Parameter::K2, 0.05);
    for trial in 0..50 {
        let views = scene.observe(0.1, &mut noise("three and one", trial));
        assert_right(&calibrate(&views, &settings).unwrap(), &scene.truth.camera);
    }
}

/// A target in a corner of a large image, far from its centre, image size not given: the closed form is
/// exact, and must be believed.
#[test]
fn exact_data_far_from_the_image_centre_give_the_exact_camera() {
    let turns = [[20.0, 0.0, 0.0], [0.0, 20.0, 5.0], [-20.0, 10.0, 0.0], [5.0, -20.0, 10.0]];
    let poses = turns
        .map(|turn| Pose { translation: Vec3::new(850.0, 630.0, 2000.0), ..looking_at_centre(turn, 2000.0) });
    let truth = Truth {
        camera: Camera::pinhole(4000.0, 4000.0, 2000.0, 1500.0),
        image_size: (4000, 3000),
        cam_from_target: poses.to_vec(),
        ..Truth::example()
    };
    let scene = Scene::new(truth).unwrap();
    let result = calibrate(&scene.exact(), &Settings::new("fx,fy,cx,cy".parse().unwrap())).unwrap();
    assert_eq!(result.termination, Termination::Converged);
    for parameter in result.free.iter() {
        // Rounding of pixels near 4000 is 1e-12; these poses turn a pixel into some hundred pixels of focal
        // length.
        let error = result.camera.get(parameter) - scene.truth.camera.get(parameter);
        assert!(error.abs() < 1e-7, "{parameter}: {error:e}");
    }
}

#[test]
fn copies_of_a_view_count_once_and_are_named() {
    let scene = Scene::example();
    for trial in 0..20 {
        let views = scene.observe(0.1, &mut noise("copies", trial));
        let once = calibrate(&views, &Settings::standard()).unwrap();
        let mut more = views.clone();
        more.extend([views[1].clone(), views[1].clone(), views[3].clone()]);
        let copied = calibrate(&more, &Settings::standard()).unwrap();
        assert_eq!(copied.camera, once.camera);
        assert_eq!(copied.covariance.intrinsics, once.covariance.intrinsics);
        assert_eq!((copied.rmse_px, copied.degrees_of_freedom), (once.rmse_px, once.degrees_of_freedom));
        assert_eq!(copied.cam_from_target.len(), 7);
        assert_eq!(copied.cam_from_target[5], once.cam_from_target[1]);
        assert_eq!(copied.residuals[6], once.residuals[3]);
        assert!(copied.warnings.contains(&Warning::Duplicates { view: 4, copy_of: 1, copies: 3 }));
    }
    let view = scene.observe(0.1, &mut noise("copies", 0)).remove(0);
    let error = calibrate(&vec![view; 5], &Settings::standard()).map(|r| r.camera).unwrap_err();
    assert_eq!(error, CalibrationError::TooFewViews { need: 2, got: 1, linear: 4, copies: 4 });
    assert!(error.to_string().contains("4 copies"), "{error}");
}

/// The views with marks of one view moved.
fn with_strays(views: &[View], view: usize, strays: &[(usize, Vec2)]) -> Vec<View> {
    let mut all = views.to_vec();
    let mut pixels = all[view].pixels().to_vec();
    for &(point, shift) in strays {
        pixels[point] += shift;
    }
    all[view] = View::new(all[view].points().to_vec(), pixels).unwrap();
    all
}

#[test]
fn one_stray_mark_is_named_as_one() {
    let scene = Scene::example();
    for trial in 0..20 {
        let views = scene.observe(0.1, &mut noise("stray", trial));
        for size in [3.0, 20.0, 100.0] {
            let stray = with_strays(&views, 2, &[(17, Vec2::new(size, -0.5 * size))]);
            let result = calibrate(&stray, &Settings::standard()).unwrap();
            let found = result.warnings.iter().find_map(|w| match w {
                Warning::Outliers(Outliers { marks, view, point, .. }) => Some((*marks, *view, *point)),
                _ => None,
            });
            let (marks, view, point) = found.unwrap_or_else(|| panic!("{size} px: {:?}", result.warnings));
            assert_eq!((marks, view, point), (1, 2, 17), "{size} px");
        }
        let clean = calibrate(&views, &Settings::standard()).unwrap();
        assert!(!clean.warnings.iter().any(|w| matches!(w, Warning::Outliers(_))));
    }
}

#[test]
fn two_per_cent_of_strays_suggest_the_robust_loss() {
    let views = Scene::example().observe(0.1, &mut noise("strays", 0));
    let shifts = [(3, 14.0), (20, -11.0), (31, 9.0), (44, -13.0), (60, 12.0)];
    let strays = with_strays(&views, 1, &shifts.map(|(point, size)| (point, Vec2::new(size, 0.7 * size))));
    let result = calibrate(&strays, &Settings::standard()).unwrap();
    assert!(result.rmse_px > 1.0);
    let text: Vec<String> = result.warnings.iter().map(ToString::to_string).collect();
    assert!(text.iter().any(|t| t.contains("robust loss (huber:")), "{text:?}");
}

#[test]
fn on_good_data_profiles_agree_with_the_covariance() {
    let views = Scene::example().observe(0.1, &mut noise("profile", 0));
    let result = calibrate(&views, &Settings::standard().with_profile_intervals(0.95)).unwrap();
    assert_eq!(result.intervals.len(), 6);
    for interval in &result.intervals {
        let (low, high) = (interval.low.unwrap(), interval.high.unwrap());
        let width = interval.linear.1 - interval.linear.0;
        // sd(fx) is 0.1 % of fx: the cost is a parabola to that order.
        assert!((low - interval.linear.0).abs() < 0.01 * width, "{interval:?}");
        assert!((high - interval.linear.1).abs() < 0.01 * width, "{interval:?}");
    }
}

/// A long lens and little tilt: the focal length is bounded below, and hardly above.
fn weak_telephoto(trial: u64) -> Vec<View> {
    let turns = [[3.0, 0.0, 0.0], [0.0, -3.0, 0.0], [-2.5, 2.5, 10.0], [2.5, 2.5, -20.0]];
    let truth = Truth {
        camera: Camera::pinhole(3000.0, 3000.0, 640.0, 480.0),
        image_size: (1280, 960),
        cam_from_target: turns.map(|turn| looking_at_centre(turn, 1200.0)).to_vec(),
        ..Truth::example()
    };
    Scene::new(truth).unwrap().observe(0.1, &mut noise("telephoto", trial))
}

#[test]
fn where_the_covariance_misleads_a_warning_says_so_and_the_profile_is_lopsided() {
    let settings = Settings::new("fx,fy,cx,cy".parse().unwrap()).with_image_size((1280, 960));
    let (mut warned, mut above, mut below) = (0, 0.0, 0.0);
    for trial in 0..20 {
        let result =
            calibrate(&weak_telephoto(trial), &settings.clone().with_profile_intervals(0.95)).unwrap();
        let is_fx = |w: &Warning| matches!(w, Warning::NotLinear { parameter: Parameter::Fx, .. });
        let interval = result.intervals.iter().find(|i| i.parameter == Parameter::Fx).unwrap();
        let (Some(low), Some(high)) = (interval.low, interval.high) else {
            warned += usize::from(result.warnings.iter().any(is_fx));
            continue;
        };
        above += high - interval.linear.1;
        below += low - interval.linear.0;
        warned += usize::from(result.warnings.iter().any(is_fx));
    }
    assert!(warned >= 15, "{warned} of 20");
    assert!(above > 0.0 && below > 0.0, "the profile reaches {below} less far down and {above} farther up");
}

/// A board bent by far more than the noise: no camera explains it, and that is said.
#[test]
fn a_bent_board_is_above_the_floor_and_the_result_says_so() {
    let truth = Truth::example();
    let bent = |pose: &Pose| {
        let mark = |p: &Vec2| pose.apply(&Vec3::new(p.x, p.y, 1.5 * p.x * p.x / 1600.0));
        let pixels = truth.points.iter().map(|p| truth.camera.project(&mark(p)).unwrap()).collect();
        View::new(truth.points.clone(), pixels).unwrap()
    };
    let views: Vec<View> = truth.cam_from_target.iter().map(bent).collect();
    let result = calibrate(&views, &Settings::standard()).unwrap();
    assert_eq!(result.termination, Termination::AboveFloor);
    let certificate = result.certificate.unwrap();
    assert!(!certificate.holds() && certificate.floor_rmse_px < result.rmse_px);
    assert!(result.starts > 1);
    assert!(result.warnings.iter().any(|w| matches!(w, Warning::AboveFloor { .. })));
}

/// Of white noise: the warning is to come once in a million sets.
#[test]
fn the_residuals_of_a_model_that_holds_show_no_structure() {
    let scene = Scene::example();
    for trial in 0..500 {
        let result =
            calibrate(&scene.observe(0.1, &mut noise("structure", trial)), &Settings::standard()).unwrap();
        assert!(!result.warnings.iter().any(|w| matches!(w, Warning::Structured { .. })), "{trial}");
    }
}

/// The certificate's probability is an upper bound: at 5 % it refuses no more than 5 % of right minima.
#[test]
fn the_certificate_refuses_no_more_than_it_says() {
    let scene = Scene::example();
    let trials = 2000;
    let low = (0..trials)
        .filter(|&trial| {
            let views = scene.observe(0.1, &mut noise("certificate", trial));
            calibrate(&views, &Settings::standard()).unwrap().certificate.unwrap().p_value < 0.05
        })
        .count();
    // Binomial(2000, 0.05): mean 100, standard deviation 9.7; 148 is exceeded with probability 1e-6.
    assert!(low <= 148, "{low} of {trials}");
    assert!(low > 10, "{low} of {trials}: the bound is far too wide to be of use");
}

/// One mark in ten astray.
fn one_in_ten_astray(views: Vec<View>, stream: &mut Stream) -> Vec<View> {
    let strayed = |view: View| {
        let mut pixels = view.pixels().to_vec();
        for pixel in pixels.iter_mut().step_by(10) {
            *pixel += 3.0 * Vec2::new(stream.normal(), stream.normal());
        }
        View::new(view.points().to_vec(), pixels).unwrap()
    };
    views.into_iter().map(strayed).collect()
}

#[test]
fn under_a_robust_loss_an_excess_is_that_of_chance() {
    const TRIALS: u64 = 40;
    let settings = Settings::standard().with_loss(Loss::Cauchy { scale_px: 0.2 });
    let example = Truth::example();
    // Of a board ten times as far perspective hardly tells the tilt's sign: a search, which fits the floor.
    let mut far = example.clone();
    let Pose { rotation, translation } = far.cam_from_target[1];
    far.cam_from_target.push(Pose { rotation, translation: 10.0 * translation });
    for (truth, is_searched) in [(example, false), (far, true)] {
        let scene = Scene::new(truth).unwrap();
        let (mut mean, mut freedom, mut most_starts) = (0.0, 0.0, 0);
        for trial in 0..TRIALS {
            let mut stream =
                Stream::open(StreamKey { seed: 7, scenario: "certificate", trial, purpose: "marks" });
            let views = one_in_ten_astray(scene.observe(0.1, &mut stream), &mut stream);
            let found = calibrate(&views, &settings).unwrap();
            most_starts = most_starts.max(found.starts);
            let certificate = found.certificate.unwrap();
            assert!(certificate.holds());
            freedom = certificate.freedom as f64;
            mean += certificate.excess / TRIALS as f64;
        }
        assert_eq!(most_starts > 1, is_searched);
        // A mean of so many variables of chi-squared, five standard deviations.
        let within = 5.0 * (2.0 * freedom / TRIALS as f64).sqrt();
        assert!((mean - freedom).abs() < within, "{mean} of {freedom} +- {within}");
    }
}
