//! Does a photograph do what was said of it? The view is really added: to the Cramer-Rao bound, and to a
//! calibration.

use super::*;
use crate::board::View;
use crate::calibrate::{Prior, Settings, calibrate_lens};
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use crate::evaluate::{TakenOut, cramer_rao, frame_difference};
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use crate::synth::{Scene, Stream, StreamKey, Truth};

const SIGMA_PX: f64 = 0.1;
const SIZE: (usize, usize) = Truth::EXAMPLE_IMAGE;

fn reach() -> Reach {
    Reach {
        image_size: SIZE,
        margin_px: 8.0,
        distances: vec![100.0, 130.0, 170.0],
        places: (5, 3),
        tilts_rad: vec![0.0, 0.35, 0.7],
        directions: 8,
        turns: 2,
    }
}

/// The example's board before a camera with a lens of some model.
fn scene(lens: Lens) -> Truth<Lens> {
    let Truth { camera, image_size, points, cam_from_target } = Truth::example();
    let camera = match lens.model() {
        Model::BrownConrady => camera.into(),
        _ => Camera::with_lens(400.0, 404.0, 322.0, 243.0, lens),
    };
    Truth { camera, image_size, points, cam_from_target }
}

fn wishes(truth: &Truth<Lens>, estimated: &Estimated) -> Vec<Wish> {
    let length = Wanted::Length { centre: Vec3::new(5.0, -10.0, 150.0), length: 40.0 };
    [Wanted::Parameter(Parameter::Fx), Wanted::Parameter(Parameter::K1), Wanted::Pixel(SIZE), length]
        .map(|wanted| Wish::of(wanted, &truth.camera, estimated).unwrap())
        .to_vec()
}

#[test]
fn with_the_view_added_the_bound_is_the_one_that_was_said() {
    let fisheye = Lens::new(Model::KannalaBrandt, &[-0.03, 0.004, 0.001, -0.0005]).unwrap();
    let rational = Lens::new(Model::Rational, &[-0.2, 0.05, 0.001, -0.001, 0.01, 0.02, 0.01, 0.003]).unwrap();
    let free =
        FreeParameters::of(&[Parameter::Fx, Parameter::Fy, Parameter::Cx, Parameter::Cy, Parameter::K1]);
    for (lens, free) in [
        (Lens::ideal(Model::BrownConrady), FreeParameters::STANDARD),
        (fisheye, Model::KannalaBrandt.standard_free()),
        (rational, free),
    ] {
        let truth = scene(lens);
        let bound = cramer_rao(&truth, free, SIGMA_PX).unwrap();
        let estimated = Estimated { free, fy_per_fx: None };
        let knowledge = Knowledge::of(estimated, &bound.intrinsics).unwrap();
        let wishes = wishes(&truth, &estimated);
        for wish in &wishes {
            let marks = (&truth.points[..], SIGMA_PX);
            let found =
                next_pose(&truth.camera, &knowledge, std::slice::from_ref(wish), marks, &reach(), 3).unwrap();
            for ranked in &found.ranked {
                let mut longer = truth.clone();
                longer.cam_from_target.push(ranked.candidate.cam_from_target);
                let with = cramer_rao(&longer, free, SIGMA_PX).unwrap();
                let (said, is) = (ranked.gains[0].after, wish.standard_deviation(&with.intrinsics));
                assert!((said / is - 1.0).abs() < 1e-6, "{:?}: {said} {is}", wish.wanted);
                assert!(said < ranked.gains[0].before);
            }
        }
    }
}

#[test]
fn the_best_pose_is_the_best_of_all_bounds_and_better_than_any_view_again() {
    let truth = scene(Lens::ideal(Model::BrownConrady));
    let bound = cramer_rao(&truth, FreeParameters::STANDARD, SIGMA_PX).unwrap();
    let estimated = Estimated { free: bound.free, fy_per_fx: None };
    let knowledge = Knowledge::of(estimated, &bound.intrinsics).unwrap();
    let wish = [Wish::of(Wanted::Parameter(Parameter::Fx), &truth.camera, &estimated).unwrap()];
    let marks = (&truth.points[..], SIGMA_PX);
    let found = next_pose(&truth.camera, &knowledge, &wish, marks, &reach(), 1).unwrap();
    let (candidates, tried) = reach().candidates(&truth.camera, &truth.points).unwrap();
    assert_eq!((found.tried, found.reachable), (tried, candidates.len()));
    // By the bound of five views, for each of them.
    let sd = |candidate: &Candidate| {
        let mut longer = truth.clone();
        longer.cam_from_target.push(candidate.cam_from_target);
        cramer_rao(&longer, bound.free, SIGMA_PX).unwrap().standard_deviation(Parameter::Fx).unwrap()
    };
    let best = candidates.iter().map(sd).fold(f64::INFINITY, f64::min);
    assert!((found.ranked[0].gains[0].after / best - 1.0).abs() < 1e-9);
    let (view, again) =
        best_repeated(&truth.camera, &knowledge, &wish, marks, &truth.cam_from_target).unwrap();
    let mut longer = truth.clone();
    longer.cam_from_target.push(truth.cam_from_target[view]);
    let with = cramer_rao(&longer, bound.free, SIGMA_PX).unwrap().standard_deviation(Parameter::Fx).unwrap();
    assert!((again[0].after / with - 1.0).abs() < 1e-9 && again[0].after > best);
}

/// A view without noise before the camera that was estimated leaves the estimate where it is, so that the
/// covariance of the calibration with it, for the same noise, is the one that was said: also with fy tied to
/// fx and a prior.
#[test]
fn a_calibration_with_the_view_is_as_sure_as_was_said() {
    let truth = Truth::example();
    let key = StreamKey { seed: 1, scenario: "planning", trial: 0, purpose: "noise" };
    let views = Scene::example().observe(SIGMA_PX, &mut Stream::open(key));
    let tied = Settings::standard().tie_focal_lengths(1.0);
    for settings in [Settings::standard(), tied] {
        let settings = settings.with_image_size(SIZE);
        let calibration = calibrate_lens(&views, &settings).unwrap();
        let covariance = &calibration.covariance;
        let estimated = Estimated { free: covariance.free, fy_per_fx: covariance.fy_per_fx };
        let knowledge = Knowledge::of(estimated, &covariance.intrinsics).unwrap();
        let wanted = [Wanted::Parameter(Parameter::Fy), Wanted::Pixel(SIZE)];
        let wishes = wanted.map(|wanted| Wish::of(wanted, &calibration.camera, &estimated).unwrap());
        let marks = (&truth.points[..], calibration.sigma_px);
        let found = next_pose(&calibration.camera, &knowledge, &wishes, marks, &reach(), 1).unwrap();
        let best = &found.ranked[0];
        let pose = best.candidate.cam_from_target;
        let pixel = |p: &Vec2| calibration.camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap();
        let added = View::new(truth.points.clone(), truth.points.iter().map(pixel).collect()).unwrap();
        let again = calibrate_lens(&[&views[..], &[added]].concat(), &settings).unwrap();
        let noise = calibration.sigma_px / again.sigma_px;
        let of_one_noise = again.covariance.clone().scaled(noise * noise);
        for (wish, gain) in wishes.iter().zip(&best.gains) {
            let is = wish.standard_deviation(&of_one_noise.intrinsics);
            assert!((gain.after / is - 1.0).abs() < 1e-6, "{:?}: {} {is}", wish.wanted, gain.after);
            assert!((gain.before / wish.standard_deviation(&covariance.intrinsics) - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn the_marks_of_another_board_do_not_explain_the_covariance() {
    let key = StreamKey { seed: 3, scenario: "planning", trial: 0, purpose: "noise" };
    let views = Scene::example().observe(SIGMA_PX, &mut Stream::open(key));
    let calibration = calibrate_lens(&views, &Settings::standard().with_image_size(SIZE)).unwrap();
    let ratio = |points: &[Vec2], view: usize| {
        let pose = &calibration.cam_from_target[view];
        let marks = (points, calibration.sigma_px);
        marks_against_covariance(&calibration.camera, &calibration.covariance, (view, pose), marks)
    };
    let points = Truth::example().points;
    let moved = |factor: f64, by: Vec2| points.iter().map(|p| factor * p + by).collect::<Vec<_>>();
    for view in 0..4 {
        assert!((ratio(&points, view).unwrap() - 1.0).abs() < 1e-6);
        // In another unit, and counted from a corner.
        assert!(ratio(&moved(0.1, Vec2::zeros()), view).unwrap() > 3.0);
        assert!(ratio(&moved(1.0, Vec2::new(40.0, 30.0)), view).unwrap() > 1.1);
    }
    assert!(ratio(&points[..9], 0).is_none_or(|ratio| ratio > 3.0), "a row fixes no pose");
}

#[test]
fn what_was_known_beforehand_counts() {
    let prior = Prior { parameter: Parameter::Fx, mean: 600.0, standard_deviation: 0.05 };
    let key = StreamKey { seed: 2, scenario: "planning", trial: 0, purpose: "noise" };
    let views = Scene::example().observe(SIGMA_PX, &mut Stream::open(key));
    let settings = Settings::standard().with_image_size(SIZE);
    let known = settings.clone().with_prior(prior.parameter, prior.mean, prior.standard_deviation);
    let remains = |settings: &Settings| {
        let calibration = calibrate_lens(&views, settings).unwrap();
        let estimated = Estimated { free: calibration.covariance.free, fy_per_fx: None };
        let knowledge = Knowledge::of(estimated, &calibration.covariance.intrinsics).unwrap();
        let wish = [Wish::of(Wanted::Parameter(Parameter::Fx), &calibration.camera, &estimated).unwrap()];
        let points = Truth::example().points;
        let marks = (&points[..], calibration.sigma_px);
        let found = next_pose(&calibration.camera, &knowledge, &wish, marks, &reach(), 1).unwrap();
        found.ranked[0].gains[0]
    };
    let (without, with) = (remains(&settings), remains(&known));
    // Known to a tenth of what four views tell, fx gains nothing from a fifth.
    assert!(without.ratio() < 0.8 && with.ratio() > 0.99 && with.before < 0.051, "{without:?} {with:?}");
}

/// By difference quotients of the comparison of two cameras, as the page of the book draws it.
#[test]
fn the_pixel_over_the_frame_is_that_of_compared_cameras() {
    let truth = Truth::example();
    let bound = cramer_rao(&truth, FreeParameters::STANDARD, SIGMA_PX).unwrap();
    let estimated = Estimated { free: bound.free, fy_per_fx: None };
    let wish = Wish::of(Wanted::Pixel(SIZE), &truth.camera.into(), &estimated).unwrap();
    let columns: Vec<Vec<Vec2>> = bound
        .free
        .iter()
        .map(|parameter| {
            let step = 1e-3 * bound.standard_deviation(parameter).unwrap();
            let moved = truth.camera.with(parameter, truth.camera.get(parameter) + step);
            let map = frame_difference(&truth.camera, &moved, SIZE, TakenOut::Rotation).unwrap();
            map.nodes.into_iter().map(|node| node.difference / step).collect()
        })
        .collect();
    let nodes = columns[0].len();
    let mut sum = 0.0;
    for node in 0..nodes {
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                sum += bound.intrinsics[(i, j)] * a[node].dot(&b[node]);
            }
        }
    }
    let expected = (sum / nodes as f64).sqrt();
    let found = wish.standard_deviation(&bound.intrinsics);
    assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
}

#[test]
fn a_length_changes_as_its_measurement_with_another_camera() {
    let truth = scene(Lens::new(Model::KannalaBrandt, &[-0.03, 0.004, 0.001, -0.0005]).unwrap());
    let estimated = Estimated { free: Model::KannalaBrandt.standard_free(), fy_per_fx: None };
    let (centre, length) = (Vec3::new(20.0, -30.0, 150.0), 40.0);
    let ends =
        [-0.5, 0.5].map(|part| truth.camera.pixel(&(centre + Vec3::new(part * length, 0.0, 0.0))).unwrap());
    let measured = |camera: &Camera<Lens>| {
        let [a, b] = ends.map(|pixel| camera.ray(&pixel).unwrap()).map(|ray| ray.xy() / ray.z);
        (b - a).norm() * centre.z
    };
    let wish = Wish::of(Wanted::Length { centre, length }, &truth.camera, &estimated).unwrap();
    let n = estimated.len();
    for (i, parameter) in estimated.free.iter().enumerate() {
        let value = truth.camera.value(parameter).unwrap();
        let step = 1e-6 * (1.0 + value.abs());
        let moved = |by: f64| measured(&truth.camera.with_value(parameter, value + by).unwrap());
        let slope = (moved(step) - moved(-step)) / (2.0 * step);
        // With this parameter alone uncertain, by one unit.
        let alone = nalgebra::DMatrix::from_fn(n, n, |j, k| if (j, k) == (i, i) { 1.0 } else { 0.0 });
        let said = wish.standard_deviation(&alone);
        assert!((said - slope.abs()).abs() < 1e-5 * (1e-3 + slope.abs()), "{parameter}: {said} {slope}");
    }
}

#[test]
fn every_pose_shows_the_board_as_it_says() {
    let truth = scene(Lens::ideal(Model::BrownConrady));
    // A board that is counted from one of its corners.
    let points: Vec<Vec2> = truth.points.iter().map(|p| p + Vec2::new(40.0, 30.0)).collect();
    let (candidates, _) = reach().candidates(&truth.camera, &points).unwrap();
    assert!(candidates.len() > 100);
    for c in &candidates {
        let pose: &Pose = &c.cam_from_target;
        let middle = pose.apply(&Vec3::new(40.0, 30.0, 0.0));
        assert!((middle.norm() - c.distance).abs() < 1e-9);
        assert!((truth.camera.pixel(&middle).unwrap() - c.middle_px).norm() < 1e-6);
        // Its normal against the line of sight.
        let cos = pose.rotation.column(2).dot(&middle.normalize());
        assert!((libm::acos(cos.min(1.0)) - c.tilt_rad).abs() < 1e-6);
        // Which side is away: a step in that direction of the image, on the board, leads away from the
        // camera.
        if c.tilt_rad > 0.0 {
            let (sin, cos) = libm::sincos(c.away_rad - c.turn_rad);
            let end = pose.apply(&Vec3::new(40.0 + cos, 30.0 + sin, 0.0));
            let away = (end - middle).dot(&middle.normalize());
            assert!((away - libm::sin(c.tilt_rad)).abs() < 1e-6, "{away} {}", c.tilt_rad);
            let drawn = truth.camera.pixel(&end).unwrap() - c.middle_px;
            let (sin, cos) = libm::sincos(c.away_rad);
            assert!(drawn.dot(&Vec2::new(cos, sin)) > 0.9 * drawn.norm());
        }
        for p in &points {
            let pixel = truth.camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap();
            assert!((7.5..=631.5).contains(&pixel.x) && (7.5..=471.5).contains(&pixel.y), "{pixel}");
        }
    }
    // No two are neighbours, and neighbours are found around the circle.
    let pose = |step: [usize; 6]| Candidate { step, tilt_rad: 0.35, ..candidates[0] };
    let near = |a, b| pose(a).is_next_to(&pose(b), &reach());
    assert!(near([0, 0, 0, 1, 0, 0], [1, 1, 0, 2, 7, 1]) && !near([0, 0, 0, 1, 0, 0], [0, 0, 0, 1, 2, 0]));
}

#[test]
fn what_cannot_be_is_refused_with_its_numbers() {
    let truth = scene(Lens::ideal(Model::BrownConrady));
    let estimated = Estimated { free: FreeParameters::STANDARD, fy_per_fx: None };
    let wish = |wanted| Wish::of(wanted, &truth.camera, &estimated).unwrap_err();
    assert!(matches!(wish(Wanted::Parameter(Parameter::P1)), WantedError::NotEstimated { .. }));
    let behind = Wanted::Length { centre: Vec3::new(0.0, 0.0, -100.0), length: 10.0 };
    assert!(matches!(wish(behind), WantedError::Unseen { z: -100.0, .. }));
    let nan = Wanted::Length { centre: Vec3::new(0.0, 0.0, 100.0), length: f64::NAN };
    assert!(matches!(wish(nan), WantedError::Unseen { .. }));
    // A lens that folds back at 45 degrees shows a hundredth of so large a frame.
    let folding = Lens::new(Model::BrownConrady, &[-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let camera = Camera::with_lens(600.0, 600.0, 320.0, 240.0, folding);
    let wide = Wish::of(Wanted::Pixel((100_000, 100_000)), &camera, &estimated);
    assert!(matches!(wide, Err(WantedError::TooFewNodes { .. })), "{wide:?}");
    let singular = nalgebra::DMatrix::from_element(6, 6, 1.0);
    assert_eq!(Knowledge::of(estimated, &singular), Err(GainError::NotPositive));
    assert!(matches!(
        Knowledge::of(estimated, &nalgebra::DMatrix::identity(5, 5)),
        Err(GainError::Shape { .. })
    ));
    let nothing = Estimated { free: FreeParameters::NONE, fy_per_fx: None };
    assert_eq!(Knowledge::of(nothing, &nalgebra::DMatrix::zeros(0, 0)), Err(GainError::NothingFree));
    let candidates = |reach: Reach| reach.candidates(&truth.camera, &truth.points).unwrap_err();
    assert!(matches!(candidates(Reach { distances: vec![20.0], ..reach() }), ReachError::Nowhere { .. }));
    assert!(matches!(candidates(Reach { distances: vec![f64::NAN], ..reach() }), ReachError::Value { .. }));
    assert!(matches!(candidates(Reach { tilts_rad: vec![1.5], ..reach() }), ReachError::Value { .. }));
    assert!(matches!(
        candidates(Reach { places: (100_000, 100_000), ..reach() }),
        ReachError::TooMany { .. }
    ));
    let line: Vec<Vec2> = (0..3).map(|i| Vec2::new(f64::from(i), 0.0)).collect();
    assert_eq!(reach().candidates(&truth.camera, &line), Err(ReachError::TooFewMarks(3)));
    // Marks on a line do not fix a pose, and no pose of them tells anything.
    let line: Vec<Vec2> = (0..9).map(|i| Vec2::new(f64::from(i), 0.0)).collect();
    let pose =
        Pose { rotation: rotation::exp(&Vec3::new(0.3, 0.1, 0.0)), translation: Vec3::new(0.0, 0.0, 120.0) };
    assert_eq!(view_information(&truth.camera, &estimated, &pose, &line, SIGMA_PX), None);
}

#[test]
fn no_mark_is_wanted_near_where_the_lens_folds_back() {
    // r (1 - r^2 / 2) is largest at r = sqrt(2 / 3), which this image shows.
    let lens = Lens::new(Model::BrownConrady, &[-0.5, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let fold = libm::atan(libm::sqrt(2.0 / 3.0));
    let camera = Camera::with_lens(400.0, 404.0, 322.0, 243.0, lens);
    let points = Truth::example().points;
    let (candidates, tried) = reach().candidates(&camera, &points).unwrap();
    assert!(candidates.len() < tried);
    let angle = |pose: &Pose, point: &Vec2| {
        let seen = pose.apply(&Vec3::new(point.x, point.y, 0.0));
        libm::atan2(seen.xy().norm(), seen.z)
    };
    let all = || candidates.iter().flat_map(|c| points.iter().map(|point| angle(&c.cam_from_target, point)));
    let furthest = all().fold(0.0, f64::max);
    assert!(furthest < fold / 1.1, "{furthest} of {fold}");
    assert!(furthest > 0.8 * fold, "the margin is what bounds it: {furthest} of {fold}");
}
