//! Does Tsai's method give the camera of one view, refuse the views that have none, and start the refinement
//! well?

use crate::data;
use crate::program::{calibench as run, folder, text};
use calibench::board::View;
use calibench::calibrate::{Settings, calibrate};
use calibench::camera::{Camera, FreeParameters, Parameter};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::io::read_corners;
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench::tsai::{Assumed, SpatialView, TsaiError, TwoStage, refine_view, two_stage};
use proptest::prelude::*;
use serde_json::Value;
use std::fmt::Write;
use std::fs;

const CENTRE: Vec2 = Vec2::new(326.0, 243.0);
const SQUARE: Assumed = Assumed { principal_point_px: CENTRE, fy_per_fx: Some(1.0) };

/// What a camera with Tsai's own lens sees: the distorted radius is the root of `r + kappa r^3 = r_u`.
fn pixel(fx: f64, fy: f64, kappa: f64, point: &Vec3) -> Vec2 {
    let ideal = Vec2::new(point.x / point.z, point.y / point.z);
    let (target, mut r) = (ideal.norm(), ideal.norm());
    for _ in 0..60 {
        r -= (r * (1.0 + kappa * r * r) - target) / (1.0 + 3.0 * kappa * r * r);
    }
    let seen = if target > 0.0 { ideal * (r / target) } else { ideal };
    CENTRE + Vec2::new(fx * seen.x, fy * seen.y)
}

fn grid() -> Vec<Vec3> {
    Truth::example_board().points().iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect()
}

/// A grid in each of two planes at a right angle.
fn corner() -> Vec<Vec3> {
    let folded = |p: Vec3| if p.x > 0.0 { Vec3::new(0.0, p.y, p.x) } else { p };
    grid().into_iter().map(folded).collect()
}

fn seen(points: &[Vec3], pose: &Pose, (fx, fy, kappa): (f64, f64, f64)) -> SpatialView {
    let pixels = points.iter().map(|p| pixel(fx, fy, kappa, &pose.apply(p))).collect();
    SpatialView::new(points.to_vec(), pixels).expect("as many pixels as points")
}

/// The largest relative error of what was found.
fn error(found: &TwoStage, pose: &Pose, (fx, fy, kappa): (f64, f64, f64)) -> f64 {
    let of_pose = (found.cam_from_target.rotation - pose.rotation).norm()
        + (found.cam_from_target.translation - pose.translation).norm() / pose.translation.norm();
    let of_camera = (found.camera.fx / fx - 1.0).abs() + (found.camera.fy / fy - 1.0).abs();
    of_pose + of_camera + (found.kappa - kappa).abs()
}

proptest! {
    #[test]
    fn a_tilted_plane_is_solved_exactly_wherever_its_origin_lies(
        tilt in 8f64..50.0, about in 0f64..std::f64::consts::TAU, roll in -3f64..3.0, kappa in -0.1f64..0.2, depth in 130f64..180.0,
        shift in prop::array::uniform2(-200f64..200.0), turn in prop::array::uniform3(-2f64..2.0),
    ) {
        let axis = Vec3::new(libm::cos(about), libm::sin(about), 0.0) * tilt.to_radians();
        let pose = Pose { rotation: rotation::exp(&axis) * rotation::exp(&Vec3::new(0.0, 0.0, roll)), translation: Vec3::new(5.0, -3.0, depth) };
        // The same board in coordinates of another origin and other axes.
        let target_from_board = Pose { rotation: rotation::exp(&Vec3::from(turn)), translation: Vec3::new(shift[0], shift[1], 40.0) };
        let points: Vec<Vec3> = grid().iter().map(|p| target_from_board.apply(p)).collect();
        let cam_from_target = pose.compose(&target_from_board.inverse());
        let truth = (600.0, 600.0, kappa);
        let found = two_stage(&seen(&points, &cam_from_target, truth), &SQUARE).unwrap();
        // Tilts of 8 degrees lose three digits more than the far origin does.
        prop_assert!(error(&found, &cam_from_target, truth) < 1e-8, "{found:?}");
    }

    #[test]
    fn a_target_in_three_dimensions_gives_the_pixels_shape_too(
        turn in prop::array::uniform3(-0.6f64..0.6), ratio in 0.9f64..1.1, kappa in -0.1f64..0.2,
    ) {
        let pose = Pose { rotation: rotation::exp(&Vec3::from(turn)), translation: Vec3::new(4.0, 0.0, 190.0) };
        let truth = (600.0, 600.0 * ratio, kappa);
        let view = seen(&corner(), &pose, truth);
        let free = Assumed { fy_per_fx: None, ..SQUARE };
        prop_assert!(error(&two_stage(&view, &free).unwrap(), &pose, truth) < 1e-9);
        let told = Assumed { fy_per_fx: Some(ratio), ..SQUARE };
        prop_assert!(error(&two_stage(&view, &told).unwrap(), &pose, truth) < 1e-9);
    }
}

#[test]
fn the_converted_lens_is_tsais_where_the_points_are() {
    let pose = looking_at_centre([25.0, 10.0, 5.0], 120.0);
    let found = two_stage(&seen(&grid(), &pose, (600.0, 600.0, 0.18)), &SQUARE).unwrap();
    // 55 kappa^4 r^9 f at the corner's radius of 0.45 is 0.03 px.
    assert!(found.conversion_px < 0.03 && found.rmse_px < found.conversion_px, "{found:?}");
    assert!(
        (found.camera.distortion.k1 + 0.18).abs() < 1e-9
            && (found.camera.distortion.k2 - 3.0 * 0.18 * 0.18).abs() < 1e-8
    );
}

fn noisy(tilt_deg: f64, trial: u64) -> Vec<View> {
    let poses = vec![looking_at_centre([tilt_deg, 0.5 * tilt_deg, 10.0], 120.0)];
    let camera = Truth::example_camera().with(Parameter::K2, 0.0);
    let truth = Truth { camera, cam_from_target: poses, ..Truth::example() };
    let key = StreamKey { seed: 1, scenario: "tsai", trial, purpose: "noise" };
    Scene::new(truth).unwrap().observe(0.1, &mut Stream::open(key))
}

#[test]
fn a_plane_that_faces_the_camera_is_refused_and_a_tilted_one_is_not() {
    for trial in 0..300 {
        let facing = two_stage(&SpatialView::from(&noisy(0.0, trial)[0]), &SQUARE);
        // A facing plane passes for a tilted one once in a million.
        assert!(matches!(facing, Err(TsaiError::Facing { .. })), "{facing:?}");
        let tilted = two_stage(&SpatialView::from(&noisy(20.0, trial)[0]), &SQUARE);
        assert!(tilted.is_ok(), "{tilted:?}");
    }
    let exact = two_stage(&SpatialView::from(&Scene::example().exact()[0]), &SQUARE).unwrap_err();
    assert!(exact.to_string().starts_with("focal length and distance (f, T_z) are inseparable"), "{exact}");
    // At a degree (0.9 and 0.45 about two axes) perspective is seen, and the focal length known to 55 %: the
    // squared sine of the tilt to 1.1 times itself. For a third of the focal length to be excluded by three
    // standard deviations it must come out 2.5 of them too large, seven times in a thousand; more than five
    // of a hundred come once in ten thousand.
    let answered = |trial: &u64| two_stage(&SpatialView::from(&noisy(0.9, *trial)[0]), &SQUARE).is_ok();
    let answered = (0..100).filter(answered).count();
    assert!(answered <= 5, "{answered}");
}

#[test]
fn views_without_an_answer_are_refused_by_name() {
    let pose = looking_at_centre([25.0, 10.0, 5.0], 120.0);
    let truth = (600.0, 600.0, 0.1);
    let few = |points: &[Vec3]| two_stage(&seen(points, &pose, truth), &SQUARE);
    assert_eq!(few(&grid()[..4]), Err(TsaiError::OnePlace), "four of a row");
    let spread = [grid()[0], grid()[8], grid()[54], grid()[62]];
    assert_eq!(few(&spread), Err(TsaiError::TooFewPoints { need: 5, got: 4, is_flat: true }));
    let solid: Vec<Vec3> = corner().into_iter().step_by(11).collect();
    assert_eq!(few(&solid), Err(TsaiError::TooFewPoints { need: 7, got: 6, is_flat: false }));
    let free = Assumed { fy_per_fx: None, ..SQUARE };
    assert_eq!(two_stage(&seen(&grid(), &pose, truth), &free), Err(TsaiError::RatioOfPlane));
    let nowhere = Assumed { principal_point_px: Vec2::new(f64::NAN, 0.0), ..SQUARE };
    assert!(matches!(
        two_stage(&seen(&grid(), &pose, truth), &nowhere),
        Err(TsaiError::PrincipalPoint { .. })
    ));
    // Thickness that rounding of the pixels hides.
    let thin: Vec<Vec3> =
        grid().iter().enumerate().map(|(i, p)| p + Vec3::z() * (1e-6 * (i % 3) as f64)).collect();
    assert!(matches!(few(&thin), Err(TsaiError::Singular { .. })), "{:?}", few(&thin));
    // Left-handed coordinates: the target seen in a mirror.
    let mirrored: Vec<Vec3> = corner().iter().map(|p| Vec3::new(p.x, p.y, -p.z)).collect();
    let view = SpatialView::new(mirrored, seen(&corner(), &pose, truth).pixels().to_vec()).unwrap();
    assert!(
        matches!(two_stage(&view, &SQUARE), Err(TsaiError::Behind { .. })),
        "{:?}",
        two_stage(&view, &SQUARE)
    );
}

/// fx and k1 of one view, fy tied to fx, the rest held at the truth.
fn one_view() -> Settings {
    let free: FreeParameters = "fx,k1".parse().unwrap();
    Settings::new(free).hold(Parameter::Cx, CENTRE.x).hold(Parameter::Cy, CENTRE.y).tie_focal_lengths(1.0)
}

#[test]
fn tsais_answer_starts_the_refinement_that_ends_where_the_closed_form_leads() {
    for trial in 0..40 {
        let views = noisy(25.0, trial);
        let view = SpatialView::from(&views[0]);
        let tsai = two_stage(&view, &SQUARE).unwrap();
        let start = tsai.camera.with(Parameter::K2, 0.0).with(Parameter::K3, 0.0);
        let from_tsai = calibrate(&views, &one_view().starting_at(start).without_search()).unwrap();
        let from_zhang = calibrate(&views, &one_view()).unwrap();
        let alone =
            refine_view(&view, (&start, &tsai.cam_from_target), one_view().free(), Some(1.0)).unwrap();
        let sd = from_zhang.covariance.standard_deviation(Parameter::Fx).unwrap();
        for camera in [&from_tsai.camera, &alone.camera] {
            // A refinement ends within a millionth of a standard deviation.
            assert!(
                (camera.fx - from_zhang.camera.fx).abs() < 1e-5 * sd,
                "{} {}",
                camera.fx,
                from_zhang.camera.fx
            );
            assert_eq!(camera.fx, camera.fy);
        }
        assert!((alone.standard_deviation(Parameter::Fy).unwrap() / sd - 1.0).abs() < 1e-5);
        let depth = from_zhang.covariance.poses[0][(5, 5)].sqrt();
        assert!((alone.pose_standard_deviations()[5] / depth - 1.0).abs() < 1e-5);
        // Tsai's own answer is near it.
        assert!((tsai.camera.fx - from_zhang.camera.fx).abs() < 5.0 * sd);
    }
}

#[test]
fn the_covariance_of_a_refined_view_is_that_of_its_errors() {
    const TRIALS: u64 = 300;
    let (points, pose) = (corner(), looking_at_centre([20.0, -25.0, 5.0], 190.0));
    let camera = Camera::pinhole(600.0, 606.0, CENTRE.x, CENTRE.y).with(Parameter::K1, -0.15);
    let free: FreeParameters = "fx,fy,cx,cy,k1".parse().unwrap();
    let mut sum = 0.0;
    for trial in 0..TRIALS {
        let mut noise = Stream::open(StreamKey { seed: 3, scenario: "solid", trial, purpose: "noise" });
        let mut at = |p: &Vec3| {
            camera.project(&pose.apply(p)).unwrap() + 0.05 * Vec2::new(noise.normal(), noise.normal())
        };
        let view = SpatialView::new(points.clone(), points.iter().map(&mut at).collect()).unwrap();
        let tsai = two_stage(&view, &Assumed { fy_per_fx: None, ..SQUARE }).unwrap();
        let start = tsai.camera.with(Parameter::K2, 0.0).with(Parameter::K3, 0.0);
        let found = refine_view(&view, (&start, &tsai.cam_from_target), free, None).unwrap();
        let errors: Vec<f64> = free.iter().map(|p| found.camera.get(p) - camera.get(p)).collect();
        let moved = pose.step_to(&found.cam_from_target);
        let e = nalgebra::DVector::from_iterator(11, errors.into_iter().chain(moved.iter().copied()));
        sum += e.dot(&found.covariance.clone().cholesky().unwrap().solve(&e));
    }
    // e^T P^-1 e is 11 F(11, 115), of mean 11 x 115 / 113 and variance 24.9; 3.3 standard deviations of the
    // mean of 300 leave a thousandth, and terms of second order a tenth.
    let mean = sum / TRIALS as f64;
    assert!((mean - 11.2).abs() < 3.3 * (24.9 / TRIALS as f64).sqrt() + 0.1, "{mean}");
}

#[test]
fn the_command_answers_for_planes_and_for_targets_in_three_dimensions() {
    let folder = folder("tsai");
    let mut flat = "view,point,X,Y,u,v\n".to_string();
    for (view, seen) in [(0, &noisy(25.0, 0)[0]), (1, &noisy(0.0, 0)[0])] {
        for (i, (p, u)) in seen.pairs().enumerate() {
            writeln!(flat, "{view},{i},{},{},{},{}", p.x, p.y, u.x, u.y).unwrap();
        }
    }
    fs::write(folder.join("flat.csv"), flat).unwrap();
    let mut solid = "view,point,X,Y,Z,u,v\n".to_string();
    let pose = looking_at_centre([20.0, -25.0, 5.0], 190.0);
    for (i, (p, u)) in seen(&corner(), &pose, (600.0, 612.0, 0.1)).pairs().enumerate() {
        writeln!(solid, "a,{i},{},{},{},{},{}", p.x, p.y, p.z, u.x, u.y).unwrap();
    }
    fs::write(folder.join("solid.csv"), solid).unwrap();
    let said = |arguments: &[&str]| -> Value {
        let output = run(&folder, &[arguments, &["--format", "json"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let json = said(&["tsai", "flat.csv", "--principal-point", "326,243", "--out", "out"]);
    assert_eq!(
        (json["views"][0]["view"].as_str(), json["refused"][0]["view"].as_str()),
        (Some("0"), Some("1"))
    );
    let refined = json["views"][0]["refined"]["camera"]["fx"].as_f64().unwrap();
    assert!(
        (refined - 600.0).abs()
            < 4.0 * json["views"][0]["refined"]["standard_deviations"]["fx"].as_f64().unwrap()
    );
    let result: Value =
        serde_json::from_str(&fs::read_to_string(folder.join("out/result.json")).unwrap()).unwrap();
    assert_eq!(result["free"], serde_json::json!(["fx", "k1"]));
    let json = said(&[
        "tsai",
        "solid.csv",
        "--principal-point",
        "326,243",
        "--aspect",
        "free",
        "--free",
        "fx,fy,cx,cy,k1,k2",
    ]);
    assert!((json["views"][0]["camera"]["fy"].as_f64().unwrap() - 612.0).abs() < 1e-6);
    assert!(json["all_views"].is_null());
    let facing = run(&folder, &["tsai", "flat.csv", "--image-size", "640x480", "--aspect", "free"]);
    assert_eq!(facing.status.code(), Some(2));
    assert!(text(&facing.stderr).contains("does not tell fy over fx"), "{}", text(&facing.stderr));
    let neither = run(&folder, &["tsai", "flat.csv"]);
    assert_eq!(neither.status.code(), Some(2));
}

/// Zhang's own photographs: his report has fx = 832.5 px and the principal point (303.959, 206.585) from all
/// five.
#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn each_of_zhangs_views_gives_his_focal_length_if_it_is_told_his_principal_point() {
    let corners = read_corners(&data::folder().join("zhang/points.csv")).unwrap();
    let errors = |assumed: Assumed| -> Vec<f64> {
        let of = |view: &View| two_stage(&SpatialView::from(view), &assumed).unwrap().camera.fx / 832.5 - 1.0;
        corners.views.iter().map(of).collect()
    };
    let told = errors(Assumed { principal_point_px: Vec2::new(303.959, 206.585), fy_per_fx: Some(1.0) });
    // When this was written: from -0.5 to 0.7 %.
    assert!(told.iter().all(|error| error.abs() < 0.01), "{told:?}");
    // From the image's centre, 36 px away, each view is wrong by something of its own.
    let assumed = errors(Assumed::centre_of((640, 480)));
    assert!(
        assumed.iter().any(|error| *error < -0.1) && assumed.iter().any(|error| *error > 0.05),
        "{assumed:?}"
    );
}
