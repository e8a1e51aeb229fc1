//! Is the camera from a measured target right, and is its covariance? Exact data, many trials, invariances,
//! hostile input.

use super::*;
use crate::board::View;
use crate::calibrate::{
    CalibrationError, Loss, Outliers, Settings, Termination, Warning, calibrate, calibrate_lens,
};
use crate::camera::{BrownConrady, Camera, FreeParameters, Lens, Model, Parameter};
use crate::distribution::ChiSquare;
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use crate::synth::{Stream, StreamKey};

pub(super) const SIGMA_PX: f64 = 0.1;

/// What is photographed: a camera, places of marks, poses.
pub(super) struct Scene {
    pub camera: Camera<Lens>,
    pub marks: Vec<Vec3>,
    pub cam_from_target: Vec<Pose>,
}

pub(super) fn stream(scenario: &'static str, trial: u64) -> Stream {
    Stream::open(StreamKey { seed: 5, scenario, trial, purpose: "measured" })
}

/// Poses about a target of some 60 mm, turned about axes that follow the golden angle.
pub(super) fn poses(count: usize, distance: f64) -> Vec<Pose> {
    let pose = |k: usize| {
        let (sin, cos) = libm::sincos(2.399_963_229_728_653 * k as f64);
        let turn = Vec3::new(0.5 * cos, 0.5 * sin, 0.2 * sin);
        let place = Vec3::new(8.0 * sin, -6.0 * cos, distance * (1.0 + 0.1 * libm::sin(5.0 * k as f64)));
        Pose { rotation: rotation::exp(&turn), translation: place }
    };
    (0..count).map(pose).collect()
}

/// Thirty marks on three sides of a cube of 60 mm, in no order.
fn cube() -> Vec<Vec3> {
    let mark = |i: usize| {
        let (a, b) = (
            60.0 * libm::fmod(0.618 * i as f64, 1.0) - 30.0,
            60.0 * libm::fmod(0.414 * i as f64, 1.0) - 30.0,
        );
        match i % 3 {
            0 => Vec3::new(a, b, -30.0),
            1 => Vec3::new(30.0, a, b),
            _ => Vec3::new(a, -30.0, b),
        }
    };
    (0..30).map(mark).collect()
}

fn brown_conrady() -> Camera<Lens> {
    Camera::pinhole(600.0, 602.0, 322.0, 241.0).with_distortion(BrownConrady::radial(-0.2, 0.05)).into()
}

fn fisheye() -> Camera<Lens> {
    let lens = Lens::new(Model::KannalaBrandt, &[-0.03, 0.004, -0.001, 0.0]).unwrap();
    Camera::with_lens(300.0, 301.0, 640.0, 480.0, lens)
}

impl Scene {
    pub fn cube() -> Scene {
        Scene { camera: brown_conrady(), marks: cube(), cam_from_target: poses(6, 220.0) }
    }

    /// Marks wherever a room of 100 mm has them, seen out to 60 degrees.
    fn fisheye() -> Scene {
        let far = |x: f64| 100.0 * libm::fmod(x, 1.0) - 50.0;
        let mark = |i: u32| {
            let i = f64::from(i);
            Vec3::new(far(0.618 * i), far(0.414 * i), far(0.732 * i))
        };
        Scene { camera: fisheye(), marks: (1..51).map(mark).collect(), cam_from_target: poses(6, 90.0) }
    }

    fn target(&self, sd: f64, mut error: impl FnMut() -> f64) -> MeasuredTarget {
        let mark = |(i, p): (usize, &Vec3)| {
            let off = Vec3::new(error(), error(), error());
            MeasuredMark::new(format!("m{i}"), p + sd * off, sd)
        };
        MeasuredTarget::new(self.marks.iter().enumerate().map(mark).collect()).unwrap()
    }

    /// What is seen of the true marks, where `is_seen` says so of view and mark.
    fn views(
        &self,
        is_seen: impl Fn(usize, usize) -> bool,
        mut noise: impl FnMut() -> f64,
    ) -> Vec<MeasuredView> {
        let view = |(number, pose): (usize, &Pose)| {
            let mut seen = Vec::new();
            for (i, p) in self.marks.iter().enumerate() {
                let pixel = self.camera.pixel(&pose.apply(p)).unwrap() + Vec2::new(noise(), noise());
                if is_seen(number, i) {
                    seen.push(SeenMark::new(format!("m{i}"), pixel));
                }
            }
            MeasuredView::new(seen).unwrap()
        };
        self.cam_from_target.iter().enumerate().map(view).collect()
    }

    pub fn settings(&self) -> Settings {
        Settings::of_model(self.camera.distortion.model())
    }

    /// One set of measurements and photographs.
    pub fn drawn(&self, sd: f64, stream: &mut Stream) -> (MeasuredTarget, Vec<MeasuredView>) {
        self.drawn_where(five_in_six, sd, stream)
    }

    /// The same, of the marks that each view shows.
    pub fn drawn_where(
        &self,
        is_seen: impl Fn(usize, usize) -> bool,
        sd: f64,
        stream: &mut Stream,
    ) -> (MeasuredTarget, Vec<MeasuredView>) {
        let target = self.target(sd, || stream.normal());
        let views = self.views(is_seen, || SIGMA_PX * stream.normal());
        (target, views)
    }
}

/// Views that do not show one mark in six.
fn five_in_six(view: usize, mark: usize) -> bool {
    !(view + mark).is_multiple_of(6)
}

fn errors(found: &MeasuredCalibration, truth: &Camera<Lens>) -> Vec<f64> {
    let off = |p| found.calibration.camera.value(p).unwrap() - truth.value(p).unwrap();
    found.calibration.free.iter().map(off).collect()
}

fn nees(found: &MeasuredCalibration, truth: &Camera<Lens>) -> f64 {
    found.calibration.covariance.normalised_error_squared(&errors(found, truth)).unwrap()
}

/// The largest difference of two estimates, in standard deviations of the first.
fn apart(a: &MeasuredCalibration, b: &MeasuredCalibration) -> f64 {
    let off = |p| {
        let sd = a.standard_deviation(p).unwrap();
        (a.calibration.camera.value(p).unwrap() - b.calibration.camera.value(p).unwrap()).abs() / sd
    };
    a.calibration.free.iter().map(off).fold(0.0, f64::max)
}

#[test]
fn exact_data_give_the_camera_back() {
    let models = [
        (Model::Division, vec![-0.2]),
        (Model::DoubleSphere, vec![-0.2, 0.6]),
        (Model::HalconPolynomial, vec![0.2, 0.03, 0.001, -0.001, 0.01]),
        (Model::Rational, vec![0.3, -0.05, 0.0005, -0.0004, 0.0, 0.5, 0.0, 0.0]),
    ];
    let of_model = |(model, coefficients): (Model, Vec<f64>)| {
        let lens = Lens::new(model, &coefficients).unwrap();
        Scene { camera: Camera::with_lens(400.0, 401.0, 640.0, 480.0, lens), ..Scene::cube() }
    };
    let scenes = [Scene::cube(), Scene::fisheye()].into_iter().chain(models.into_iter().map(of_model));
    for scene in scenes {
        let model = scene.camera.distortion.model();
        for sd in [0.0, 0.02] {
            let settings = match model {
                Model::Rational => {
                    Settings::new("fx,fy,cx,cy,k1,k2,p1,p2,k4".parse().unwrap()).with_model(model)
                }
                _ => scene.settings(),
            };
            let target = scene.target(sd, || 0.0);
            let found =
                calibrate_measured(&target, &scene.views(five_in_six, || 0.0), &settings, Noise::default())
                    .unwrap();
            assert_eq!(found.calibration.termination, Termination::Converged);
            assert!(found.calibration.rmse_px < 1e-9, "{model}: {:e}", found.calibration.rmse_px);
            for (parameter, value) in scene.camera.values() {
                let off = (found.calibration.camera.value(parameter).unwrap() - value).abs();
                // Coefficients of a quotient hang together by a factor of thousands.
                let loose = if model == Model::Rational { 1e3 } else { 1.0 };
                assert!(off < 1e-9 * loose * value.abs().max(1.0), "{model} {parameter}: {off:e}");
            }
            for (pose, truth) in found.calibration.cam_from_target.iter().zip(&scene.cam_from_target) {
                assert!((pose.translation - truth.translation).norm() < 1e-6, "{model}");
            }
            assert!(found.marks.iter().all(|mark| mark.correction.norm() < 1e-8));
        }
    }
}

#[test]
fn a_board_without_errors_is_what_calibrate_makes_of_it() {
    // A flat board somewhere in space, its plane none of the coordinates'.
    let place =
        Pose { rotation: rotation::from_xyz_rad(0.4, -0.7, 0.2), translation: Vec3::new(100.0, 30.0, -50.0) };
    let flat: Vec<Vec3> =
        (0..35).map(|i| Vec3::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0, 0.0) * 12.0).collect();
    let turns = [[0.4, 0.0, 0.1], [0.0, -0.45, 0.0], [-0.35, 0.3, 0.4], [0.3, 0.35, -0.2]];
    for camera in [brown_conrady(), fisheye()] {
        let mut noise = stream("board", 0);
        let settings = Settings::of_model(camera.distortion.model());
        let (mut views, mut seen) = (Vec::new(), Vec::new());
        for [x, y, z] in turns {
            let pose =
                Pose { rotation: rotation::from_xyz_rad(x, y, z), translation: Vec3::new(2.0, -3.0, 90.0) };
            let pixel = |p: &Vec3| camera.pixel(&pose.apply(p)).unwrap();
            let pixels: Vec<Vec2> = flat
                .iter()
                .map(|p| pixel(p) + SIGMA_PX * Vec2::new(noise.normal(), noise.normal()))
                .collect();
            let marks = pixels.iter().enumerate().map(|(i, pixel)| SeenMark::new(i.to_string(), *pixel));
            seen.push(MeasuredView::new(marks.collect()).unwrap());
            views.push(View::new(flat.iter().map(|p| p.xy()).collect(), pixels).unwrap());
        }
        let marks =
            flat.iter().enumerate().map(|(i, p)| MeasuredMark::new(i.to_string(), place.apply(p), 0.0));
        let target = MeasuredTarget::new(marks.collect()).unwrap();
        let found = calibrate_measured(&target, &seen, &settings, Noise::default()).unwrap();
        let board = match camera.brown_conrady() {
            Some(_) => calibrate(&views, &settings.clone().polished()).unwrap().into(),
            None => calibrate_lens(&views, &settings).unwrap(),
        };
        for parameter in board.free.iter() {
            let sd = board.standard_deviation(parameter).unwrap();
            let off =
                found.calibration.camera.value(parameter).unwrap() - board.camera.value(parameter).unwrap();
            assert!(off.abs() < 1e-8 * sd, "{parameter}: {:e} standard deviations", off.abs() / sd);
            let ratio = found.standard_deviation(parameter).unwrap() / sd;
            assert!((ratio - 1.0).abs() < 1e-6, "{parameter}: {ratio}");
        }
        assert!((found.calibration.sigma_px / board.sigma_px - 1.0).abs() < 1e-9);
        assert!(found.credibility.is_none() && found.marks.iter().all(|mark| mark.p_value == 1.0));
        for (view, pose) in found.calibration.cam_from_target.iter().enumerate() {
            let of_board = pose.compose(&place);
            assert!((of_board.translation - board.cam_from_target[view].translation).norm() < 1e-6);
            // The pose's covariance is about another origin; that of its rotation is the same.
            let [a, b] = [&found.calibration.covariance.poses[view], &board.covariance.poses[view]];
            assert!((a[(0, 0)] / b[(0, 0)] - 1.0).abs() < 1e-5);
        }
    }
}

const TRIALS: u64 = 200;
/// Rate at which a statistical test fails a correct program.
const RATE: f64 = 1e-4;

/// The mean of `TRIALS` chi-squared numbers lies between these, but for [`RATE`].
fn mean_of_chi_squared(freedom: usize) -> (f64, f64) {
    let all = ChiSquare::new(freedom * TRIALS as usize);
    let trials = TRIALS as f64;
    (all.quantile(0.5 * RATE) / trials, all.quantile(1.0 - 0.5 * RATE) / trials)
}

#[test]
fn the_covariance_counts_the_errors_of_the_marks_and_without_them_is_far_too_small() {
    // 0.05 mm are 0.14 px at this distance: marks are known no better than pixels see them.
    let scene = Scene::cube();
    let (mut right, mut ignored, mut believed) = (0.0, 0.0, 0);
    let (mut flagged, mut p_below_half) = (0, 0);
    for trial in 0..TRIALS {
        let mut stream = stream("nees", trial);
        let (target, views) = scene.drawn(0.05, &mut stream);
        let found =
            calibrate_measured(&target, &views, &scene.settings(), Noise::Known { sigma_px: SIGMA_PX })
                .unwrap();
        right += nees(&found, &scene.camera) / TRIALS as f64;
        let test = found.credibility.unwrap();
        believed += u64::from(test.holds());
        p_below_half += u64::from(test.p_value < 0.5);
        flagged += u64::from(!found.beyond_expectation().is_empty());
        let marks = target.marks().iter().map(|m| MeasuredMark::new(m.id.clone(), m.position, 0.0));
        let exact = MeasuredTarget::new(marks.collect()).unwrap();
        let taken = calibrate_measured(&exact, &views, &scene.settings(), Noise::default()).unwrap();
        ignored += nees(&taken, &scene.camera) / TRIALS as f64;
    }
    let (low, high) = mean_of_chi_squared(6);
    // Terms of second order in the noise are a part of a hundredth.
    assert!((0.98 * low..1.02 * high).contains(&right), "mean NEES {right}, expected {low} to {high}");
    // An error of a mark is the same in every view, and residuals take it for noise of single pixels.
    assert!(ignored > 1.5 * high, "marks taken for exact: {ignored}");
    // What the command's page states of these trials.
    assert!((right - 5.95).abs() < 0.01 && (ignored - 15.3).abs() < 0.1, "{right} {ignored}");
    // At a rate of 1 in 100 of 200 trials more than 10 are one in 10^4 (binomial); half of all p-values are
    // below a half.
    assert!(TRIALS - believed <= 10 && flagged <= 10, "{believed} believed, {flagged} flagged");
    assert!((72..=128).contains(&p_below_half), "{p_below_half} of {TRIALS}");
}

#[test]
fn the_noise_that_is_estimated_beside_the_marks_is_unbiased() {
    let scene = Scene { cam_from_target: poses(4, 220.0), ..Scene::cube() };
    let (mut mean, mut nees_sum) = (0.0, 0.0);
    for trial in 0..TRIALS {
        let (target, views) = scene.drawn(0.05, &mut stream("sigma", trial));
        let found = calibrate_measured(&target, &views, &scene.settings(), Noise::Estimated).unwrap();
        let variance = found.calibration.sigma_px * found.calibration.sigma_px;
        mean += variance / (SIGMA_PX * SIGMA_PX) / TRIALS as f64;
        nees_sum += nees(&found, &scene.camera) / TRIALS as f64;
    }
    // Some 120 degrees of freedom: a variance is known to a part sqrt(2 / 120), its mean over 200 trials to
    // 0.9 %.
    assert!((mean - 1.0).abs() < 4.0 * 0.0092, "{mean}");
    let (low, high) = mean_of_chi_squared(6);
    // Estimated with 120 degrees of freedom, F in the place of chi-squared is larger by 2 / 120.
    assert!((0.98 * low..1.04 * high).contains(&nees_sum), "{nees_sum}");
}

#[test]
fn a_bumped_mark_is_named_and_deviations_that_were_stated_too_small_are_not_believed() {
    let scene = Scene::cube();
    let known = Noise::Known { sigma_px: SIGMA_PX };
    let mut stream = stream("bumped", 0);
    let (target, views) = scene.drawn(0.02, &mut stream);
    let mut marks = target.marks().to_vec();
    let bump = Vec3::new(0.1, -0.2, 0.15);
    marks[7].position += bump;
    let bumped = MeasuredTarget::new(marks).unwrap();
    let found = calibrate_measured(&bumped, &views, &scene.settings(), known).unwrap();
    let named: Vec<&str> = found.beyond_expectation().iter().map(|mark| mark.id.as_str()).collect();
    assert_eq!(named, ["m7"]);
    // What pixels tell of it takes so much of the bump back: the correction's expectation is -(I - posterior
    // / sd^2) bump.
    let mark = &found.marks[7];
    let taken = -(bump - mark.covariance * bump / (0.02 * 0.02));
    for axis in 0..3 {
        assert!(
            (mark.correction[axis] - taken[axis]).abs() < 4.5 * mark.expected[axis],
            "{} {taken}",
            mark.correction
        );
    }
    assert!(taken.norm() > 0.25 * bump.norm(), "{taken}");
    assert!(found.doubts()[0].contains("m7"), "{:?}", found.doubts());
    let stated = |factor: f64| {
        let marks = target
            .marks()
            .iter()
            .map(|m| MeasuredMark { standard_deviation: factor * m.standard_deviation, ..m.clone() });
        let target = MeasuredTarget::new(marks.collect()).unwrap();
        calibrate_measured(&target, &views, &scene.settings(), known).unwrap().credibility.unwrap()
    };
    let (small, right, large) = (stated(0.4), stated(1.0), stated(4.0));
    assert!(!small.holds() && right.holds() && !large.holds(), "{small:?} {right:?} {large:?}");
    assert!(small.factor() > 1.0 && large.factor() < 1.0);
    // And a noise that was given too small likewise.
    let found =
        calibrate_measured(&target, &views, &scene.settings(), Noise::Known { sigma_px: 0.05 }).unwrap();
    assert!(found.noise_test.is_some_and(|test| !test.holds() && test.factor() > 1.3));
}

#[test]
fn neither_order_nor_the_frame_of_the_target_matters() {
    for scene in [Scene::cube(), Scene::fisheye()] {
        let (target, views) = scene.drawn(0.03, &mut stream("invariance", 1));
        let settings = scene.settings();
        let found = calibrate_measured(&target, &views, &settings, Noise::default()).unwrap();
        let backwards = MeasuredTarget::new(target.marks().iter().rev().cloned().collect()).unwrap();
        let turned: Vec<MeasuredView> = views
            .iter()
            .rev()
            .map(|view| MeasuredView::new(view.marks().iter().rev().cloned().collect()).unwrap())
            .collect();
        let again = calibrate_measured(&backwards, &turned, &settings, Noise::default()).unwrap();
        assert!(apart(&found, &again) < 1e-7, "{:e}", apart(&found, &again));
        assert!(
            (found.calibration.residuals[0][3] - again.calibration.residuals[5].iter().rev().nth(3).unwrap())
                .norm()
                < 1e-8
        );
        let motion = Pose {
            rotation: rotation::from_xyz_rad(1.0, -0.6, 2.0),
            translation: Vec3::new(500.0, -300.0, 1000.0),
        };
        let moved =
            target.marks().iter().map(|m| MeasuredMark { position: motion.apply(&m.position), ..m.clone() });
        let elsewhere = MeasuredTarget::new(moved.collect()).unwrap();
        let again = calibrate_measured(&elsewhere, &views, &settings, Noise::default()).unwrap();
        assert!(apart(&found, &again) < 1e-6, "{:e}", apart(&found, &again));
        for (a, b) in found.marks.iter().zip(&again.marks) {
            assert!((motion.rotation * a.correction - b.correction).norm() < 1e-7);
            assert!((a.p_value - b.p_value).abs() < 1e-5);
        }
        let pose = again.calibration.cam_from_target[2].compose(&motion);
        assert!((pose.translation - found.calibration.cam_from_target[2].translation).norm() < 1e-6);
    }
}

#[test]
fn what_is_known_of_parameters_counts_and_ties_hold() {
    let scene = Scene { camera: Camera { fy: 600.0, ..brown_conrady() }, ..Scene::cube() };
    let (target, views) = scene.drawn(0.03, &mut stream("priors", 0));
    let free = calibrate_measured(&target, &views, &scene.settings(), Noise::default()).unwrap();
    let settings = scene
        .settings()
        .tie_focal_lengths(1.0)
        .with_prior(Parameter::K1, -0.2, 1e-4)
        .hold(Parameter::K2, 0.05);
    let told = calibrate_measured(&target, &views, &settings, Noise::default()).unwrap();
    let camera = &told.calibration.camera;
    assert!(camera.fx == camera.fy && camera.value(Parameter::K2) == Some(0.05));
    assert!(
        told.standard_deviation(Parameter::K1) < Some(1e-4)
            && free.standard_deviation(Parameter::K1) > Some(1e-4)
    );
    assert_eq!(told.standard_deviation(Parameter::Fx), told.standard_deviation(Parameter::Fy));
    assert!(nees(&told, &scene.camera) < ChiSquare::new(4).quantile(1.0 - RATE));
    // An exact axis stays where it was measured, and what is exact in all is no unknown.
    let exact_z = target
        .marks()
        .iter()
        .map(|m| MeasuredMark { standard_deviation: Vec3::new(0.03, 0.03, 0.0), ..m.clone() });
    let found = calibrate_measured(
        &MeasuredTarget::new(exact_z.collect()).unwrap(),
        &views,
        &scene.settings(),
        Noise::default(),
    )
    .unwrap();
    assert!(
        found
            .marks
            .iter()
            .all(|m| m.correction.z == 0.0 && m.standard_deviation().z == 0.0 && m.correction.x != 0.0)
    );
}

#[test]
fn a_stray_in_one_view_is_told_with_its_number_there() {
    let scene = Scene::cube();
    let (target, mut views) = scene.drawn(0.02, &mut stream("stray", 0));
    let mut marks: Vec<SeenMark> = views[3].marks().iter().rev().cloned().collect();
    marks[4].pixel.x += 3.0;
    views[3] = MeasuredView::new(marks).unwrap();
    let found = calibrate_measured(&target, &views, &scene.settings(), Noise::default()).unwrap();
    let worst = found.calibration.warnings.iter().find_map(|warning| match warning {
        Warning::Outliers(Outliers { view, point, residual_px, .. }) => Some((*view, *point, *residual_px)),
        _ => None,
    });
    let (view, point, residual_px) = worst.expect("it is told");
    assert!((view, point) == (3, 4) && residual_px > 2.0, "{view} {point} {residual_px}");
}

#[test]
fn one_view_of_a_target_in_space_tells_a_camera() {
    let scene = Scene { cam_from_target: poses(1, 200.0), ..Scene::cube() };
    let target = scene.target(0.0, || 0.0);
    let settings = Settings::new("fx,fy,cx,cy,k1,k2".parse::<FreeParameters>().unwrap());
    let found =
        calibrate_measured(&target, &scene.views(five_in_six, || 0.0), &settings, Noise::default()).unwrap();
    assert!((found.calibration.camera.fx - 600.0).abs() < 1e-6);
}

#[test]
fn data_that_determine_nothing_are_refused_by_name() {
    let refused = |target: &MeasuredTarget, views: &[MeasuredView], settings: &Settings| {
        calibrate_measured(target, views, settings, Noise::default())
            .map(|f| f.calibration.camera)
            .unwrap_err()
    };
    let standard = Settings::standard();
    // A flat target that faces the camera.
    let facing = |turn: f64| Pose {
        rotation: rotation::from_xyz_rad(0.0, 0.0, turn),
        translation: Vec3::new(0.0, 0.0, 200.0),
    };
    let flat: Vec<Vec3> = cube().iter().map(|p| Vec3::new(p.x + 0.3 * p.z, p.y - 0.2 * p.z, 0.0)).collect();
    let scene = Scene {
        camera: brown_conrady(),
        marks: flat,
        cam_from_target: [0.0, 0.4, -0.3, 1.0].map(facing).to_vec(),
    };
    let (target, views) = scene.drawn(0.0, &mut stream("facing", 0));
    let error = refused(&target, &views, &standard);
    assert!(matches!(error, MeasuredError::Calibration(CalibrationError::NotIdentifiable { .. })), "{error}");
    // One view of a flat target tells no fx, fy, cx and cy.
    let error = refused(&target, &views[..1], &standard);
    assert!(matches!(error, MeasuredError::Calibration(CalibrationError::TooFewViews { .. })), "{error}");
    // As flat as it is known to be.
    let (target, views) = scene.drawn(0.05, &mut stream("facing", 1));
    let error = refused(&target, &views, &standard);
    assert!(error.to_string().contains("focal length"), "{error}");
    // A target in space too far away: its perspective drowns in noise.
    let far = Scene { cam_from_target: poses(3, 2e5), ..Scene::cube() };
    let (target, views) = far.drawn(0.01, &mut stream("far", 0));
    let error =
        refused(&target, &views, &Settings::new("fx,fy".parse().unwrap()).with_image_size((640, 480)));
    assert!(error.to_string().contains("focal length") || error == MeasuredError::NoStart, "{error}");
}

#[test]
fn hostile_input_is_refused_by_name() {
    let scene = Scene::cube();
    let (target, views) = scene.drawn(0.02, &mut stream("hostile", 0));
    let settings = scene.settings();
    let refused = |target: &MeasuredTarget, views: &[MeasuredView], settings: &Settings, noise| {
        calibrate_measured(target, views, settings, noise).map(|f| f.calibration.camera).unwrap_err()
    };
    let plain = |views: &[MeasuredView]| refused(&target, views, &settings, Noise::default());
    let only = |ids: &[usize]| {
        let is_wanted = |m: &&SeenMark| ids.iter().any(|i| m.id == format!("m{i}"));
        MeasuredView::new(views[0].marks().iter().filter(is_wanted).cloned().collect()).unwrap()
    };
    assert_eq!(plain(&[]), MeasuredError::NoViews);
    assert!(matches!(
        plain(&[only(&[1, 2, 3, 4, 5])]),
        MeasuredError::TooFewMarks { view: 0, need: 6, got: 5 }
    ));
    assert!(matches!(plain(&[only(&[1, 2])]), MeasuredError::TooFewMarks { view: 0, need: 4, got: 2 }));
    let copies = [views[0].clone(), views[1].clone(), views[0].clone()];
    assert_eq!(plain(&copies), MeasuredError::RepeatedView { view: 2, copy_of: 0 });
    let stranger = MeasuredView::new(vec![SeenMark::new("x9", Vec2::zeros())]).unwrap();
    assert_eq!(plain(&[stranger]), MeasuredError::UnknownMark { view: 0, mark: "x9".into() });
    let mark = |id: &str, u: f64, weight: f64| SeenMark { id: id.into(), pixel: Vec2::new(u, 1.0), weight };
    let twice = MeasuredView::new(vec![mark("m1", 1.0, 1.0), mark("m1", 2.0, 1.0)]);
    assert_eq!(twice, Err(MeasuredError::SeenTwice { mark: "m1".into() }));
    assert!(matches!(
        MeasuredView::new(vec![mark("a", f64::NAN, 1.0)]),
        Err(MeasuredError::PixelNotFinite { .. })
    ));
    assert!(matches!(MeasuredView::new(vec![mark("a", 1.0, -1.0)]), Err(MeasuredError::BadWeight { .. })));
    for sigma_px in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            refused(&target, &views, &settings, Noise::Known { sigma_px }),
            MeasuredError::BadNoise { .. }
        ));
    }
    // On a line, at one place, of a size that loses the marks.
    let with = |place: &dyn Fn(usize, Vec3) -> Vec3, sd: f64| {
        let marks = scene.marks.iter().enumerate();
        MeasuredTarget::new(
            marks.map(|(i, p)| MeasuredMark::new(format!("m{i}"), place(i, *p), sd)).collect(),
        )
        .unwrap()
    };
    let on_a_line = with(&|i, _| Vec3::new(1.0, 2.0, -0.5) * i as f64, 0.1);
    assert_eq!(refused(&on_a_line, &views, &settings, Noise::default()), MeasuredError::OnALine { view: 0 });
    let at_one_place = with(&|_, _| Vec3::repeat(7.0), 0.1);
    assert_eq!(
        refused(&at_one_place, &views, &settings, Noise::default()),
        MeasuredError::OnALine { view: 0 }
    );
    let loose = refused(&with(&|_, p| p, 1e9), &views, &settings, Noise::Known { sigma_px: SIGMA_PX });
    assert!(matches!(loose, MeasuredError::Loose { .. }), "{loose}");
    // The names of marks exchanged: whatever is said, it is no camera to be trusted.
    let shuffled = with(&|i, _| scene.marks[(7 * i + 3) % 30], 0.0);
    match calibrate_measured(&shuffled, &views, &settings, Noise::default()) {
        Ok(found) => assert!(found.calibration.rmse_px > 10.0, "{}", found.calibration.rmse_px),
        Err(error) => {
            assert!(matches!(error, MeasuredError::NoStart | MeasuredError::Calibration(_)), "{error}")
        }
    }
    // Too many, and what is not known here.
    let many: Vec<MeasuredMark> = (0..501)
        .map(|i| {
            MeasuredMark::new(
                i.to_string(),
                Vec3::new(f64::from(i % 7), f64::from(i % 11), f64::from(i % 13)),
                0.1,
            )
        })
        .collect();
    let seen = MeasuredView::new(
        (0..501).map(|i| SeenMark::new(i.to_string(), Vec2::new(f64::from(i), 1.0))).collect(),
    )
    .unwrap();
    let error = refused(&MeasuredTarget::new(many).unwrap(), &[seen], &settings, Noise::default());
    assert_eq!(error, MeasuredError::TooManyUncertain { got: 501, most: MOST_UNCERTAIN_MARKS });
    let robust = settings.clone().with_loss(Loss::Huber { delta_px: 1.0 });
    assert!(matches!(
        refused(&target, &views, &robust, Noise::default()),
        MeasuredError::NotForTargets { .. }
    ));
    let foreign = settings.clone().estimate(Parameter::K4);
    assert!(matches!(
        refused(&target, &views, &foreign, Noise::default()),
        MeasuredError::Calibration(CalibrationError::NotOfModel { .. })
    ));
}
