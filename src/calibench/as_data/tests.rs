//! Does every result come back from JSON to the bit, and is refused what cannot be?

use crate::board::{Arrangement, Board, Pattern, View};
use crate::calibrate::{LensCalibration, Loss, Settings, calibrate_lens};
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use crate::downstream::{
    Conditions, MapModel, Mark, PlaneView, Repeatability, SetUp, Stations, hand_eye, length_in_view, register,
};
use crate::evaluate::cramer_rao;
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use crate::measured::{MeasuredMark, MeasuredTarget, MeasuredView, Noise, SeenMark, calibrate_measured};
use crate::noise::extraction_noise;
use crate::planning::{Estimated, Knowledge, Reach, Wanted, Wish, next_pose};
use crate::synth::{Scene, Stream, StreamKey, Truth};
use crate::tsai::{Assumed, SpatialView, refine_view, two_stage};
use crate::validate::{Estimate, hold_out, repeated};
use serde::{Serialize, de::DeserializeOwned};
use std::fmt::Debug;

/// Holds a value against what it is after the way through JSON.
#[track_caller]
fn comes_back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let text = serde_json::to_string(value).unwrap();
    let back: T = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
    assert_eq!(&back, value);
}

/// The example's views with noise of their own.
fn views(trial: u64) -> Vec<View> {
    let key = StreamKey { seed: 1, scenario: "as data", trial, purpose: "noise" };
    Scene::example().observe(0.1, &mut Stream::open(key))
}

fn calibrated(trial: u64) -> LensCalibration {
    calibrate_lens(&views(trial), &Settings::standard()).unwrap()
}

#[test]
fn boards_and_views() {
    let view = views(0).remove(0);
    comes_back(&view);
    let weights = (1..=view.len()).map(|i| i as f64).collect();
    comes_back(&view.with_weights(weights).unwrap());
    comes_back(&Board::chessboard(9, 6, 25.0).unwrap());
    let discs = Pattern::Circles { diameter: 15.0 };
    comes_back(&Board::arranged(4, 11, 20.0, discs, Arrangement::Asymmetric).unwrap());
}

#[test]
fn cameras_with_any_lens() {
    for model in Model::ALL {
        let lens = Lens::new(model, &vec![0.25; model.coefficients().len()]).unwrap();
        comes_back(&Camera::with_lens(600.0, 590.0, 320.0, 240.0, lens));
    }
    comes_back(&calibrated(0));
    let text = r#"{"model": "division", "coefficients": {"k1": -0.1, "p1": 0.0}}"#;
    let error = serde_json::from_str::<Lens>(text).unwrap_err().to_string();
    assert!(error.contains("the division model has no p1"), "{error}");
}

#[test]
fn what_cannot_be_is_refused_with_its_reason() {
    let view = r#"{"points": [[0.0, 0.0]], "pixels": [], "weights": null}"#;
    let error = serde_json::from_str::<View>(view).unwrap_err().to_string();
    assert!(error.contains("every point needs its pixel"), "{error}");
    let board =
        r#"{"columns": 1, "rows": 6, "spacing": 25.0, "pattern": "chessboard", "arrangement": "square"}"#;
    let error = serde_json::from_str::<Board>(board).unwrap_err().to_string();
    assert!(error.contains("at least 2 x 2 marks"), "{error}");
    let mark = r#"{"id": "a", "position": [0.0, 0.0, 0.0], "standard_deviation": [0.1, 0.1, 0.1]}"#;
    let error = serde_json::from_str::<MeasuredTarget>(&format!("[{mark}, {mark}]")).unwrap_err().to_string();
    assert!(error.contains("twice"), "{error}");
    let error = crate::rows::deserialize(&mut serde_json::Deserializer::from_str("[[1.0], []]")).unwrap_err();
    assert!(error.to_string().contains("different lengths"), "{error}");
}

#[test]
fn lengths_and_parts() {
    let world: Vec<Vec2> = (0..9).map(|i| 20.0 * Vec2::new(f64::from(i % 3), -f64::from(i / 3))).collect();
    let off = |i: usize| 0.03 * Vec2::new((i * 7 % 5) as f64 - 2.0, (i * 3 % 5) as f64 - 2.0);
    let found = calibrated(0);
    let camera = found.camera.brown_conrady().unwrap();
    let plane = PlaneView::of_view(&camera, &found.cam_from_target, &found.covariance, 0).unwrap();
    let ends = [Vec2::new(250.0, 200.0), Vec2::new(380.0, 260.0)];
    comes_back(&length_in_view(&plane, &ends, &Conditions::marks(0.1)).unwrap());
    let mark = |(i, at): (usize, &Vec2)| Mark { at: at + off(i), deviations: Vec2::repeat(0.05) };
    let (taught, moved): (Vec<Mark>, Vec<Mark>) = (
        world.iter().map(|&at| Mark { at, deviations: Vec2::zeros() }).collect(),
        world.iter().enumerate().map(mark).collect(),
    );
    comes_back(&register(MapModel::Similarity, &taught, &moved, Loss::Squares).unwrap());
}

#[test]
fn a_camera_on_a_robot() {
    let found = calibrated(0);
    let pose = |turn: Vec3, translation: Vec3| Pose { rotation: rotation::exp(&turn), translation };
    let hand = pose(Vec3::new(0.1, -0.2, 1.5), Vec3::new(20.0, -30.0, 60.0));
    let target = pose(Vec3::new(0.0, 0.0, 0.4), Vec3::new(500.0, 100.0, 0.0));
    let robot: Vec<Pose> =
        found.cam_from_target.iter().map(|seen| target.compose(&hand.compose(seen).inverse())).collect();
    let stations = Stations {
        set_up: SetUp::EyeInHand,
        base_from_gripper: &robot,
        cam_from_target: &found.cam_from_target,
        covariance: &found.covariance,
        robot: Repeatability { position: 0.02, rotation_rad: 1e-4 },
    };
    comes_back(&hand_eye(&stations).unwrap());
}

#[test]
fn a_measured_target() {
    let truth = Truth::example();
    let place = |i: usize| Vec3::new(truth.points[i].x, truth.points[i].y, (i % 5) as f64);
    let marks = (0..63).map(|i| MeasuredMark::new(i.to_string(), place(i), 0.02)).collect();
    let target = MeasuredTarget::new(marks).unwrap();
    comes_back(&target);
    let view = |pose: &Pose| {
        let seen = |i: usize| truth.camera.project(&pose.apply(&place(i)));
        let marks = (0..63).filter_map(|i| Some(SeenMark::new(i.to_string(), seen(i)?))).collect();
        MeasuredView::new(marks).unwrap()
    };
    let views: Vec<MeasuredView> = truth.cam_from_target.iter().map(view).collect();
    comes_back(&views);
    let noise = Noise::Known { sigma_px: 0.1 };
    comes_back(&calibrate_measured(&target, &views, &Settings::standard(), noise).unwrap());
}

#[test]
fn one_view_still_frames_and_the_next_pose() {
    let truth = Truth::example();
    let view = SpatialView::from(&Scene::example().exact()[1]);
    let principal_point_px = Vec2::new(truth.camera.cx, truth.camera.cy);
    let assumed = Assumed { principal_point_px, fy_per_fx: Some(1.0) };
    comes_back(&assumed);
    let start = two_stage(&view, &assumed).unwrap();
    comes_back(&start);
    let free: FreeParameters = "fx,k1,k2".parse().unwrap();
    comes_back(&refine_view(&view, (&start.camera, &start.cam_from_target), free, Some(1.0)).unwrap());

    let frames: Vec<View> = (0..6).map(|trial| views(trial).remove(0)).collect();
    comes_back(&extraction_noise(&frames, None, 0.01).unwrap());

    let bound = cramer_rao(&truth, FreeParameters::STANDARD, 0.1).unwrap();
    let estimated = Estimated { free: bound.free, fy_per_fx: None };
    let knowledge = Knowledge::of(estimated, &bound.intrinsics).unwrap();
    let camera = truth.camera.into();
    let wish = Wish::of(Wanted::Parameter(Parameter::Fx), &camera, &estimated).unwrap();
    let reach = Reach {
        image_size: truth.image_size,
        margin_px: 10.0,
        distances: vec![150.0],
        places: (1, 1),
        tilts_rad: vec![0.0, 0.4],
        directions: 4,
        turns: 1,
    };
    comes_back(&next_pose(&camera, &knowledge, &[wish], (&truth.points, 0.1), &reach, 2).unwrap());
}

#[test]
fn validation() {
    let all = [calibrated(0), calibrated(1)];
    let estimates: Vec<Estimate<'_>> = all.iter().map(Estimate::from).collect();
    comes_back(&hold_out(&estimates[0], &views(2), 0.01).unwrap());
    comes_back(&repeated(&estimates, Truth::EXAMPLE_IMAGE, 0.01).unwrap());
}
