//! Does the solver find what others published for their own measurements?
//!
//! Expected values: `published.toml` of the data folder. Ignored where the folder is absent.

use crate::data;
use calibench::calibrate::{
    Board, Calibration, LensCalibration, Settings, calibrate, calibrate_lens, closed_form,
};
use calibench::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use calibench::geometry::{Homography, Vec3};
use calibench::io::{CornerFile, read_corners};
use std::path::PathBuf;

struct Published {
    folder: PathBuf,
    table: toml::Table,
}

impl Published {
    fn load() -> Published {
        let folder = data::folder();
        let text = std::fs::read_to_string(folder.join("published.toml")).unwrap();
        Published { folder, table: text.parse().unwrap() }
    }

    fn set(&self, name: &str) -> &toml::Table {
        self.table[name].as_table().unwrap()
    }

    fn numbers(&self, set: &str, key: &str) -> Vec<f64> {
        self.set(set)[key].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect()
    }

    fn number(&self, set: &str, key: &str) -> f64 {
        self.set(set)[key].as_float().unwrap()
    }

    fn entry(&self, set: &str, table: &str, key: &str) -> f64 {
        self.set(set)[table].as_table().unwrap()[key].as_float().unwrap()
    }

    fn corners(&self, file: &str) -> CornerFile {
        read_corners(&self.folder.join(file)).unwrap()
    }
}

fn solve(corners: &CornerFile, free: &str) -> Calibration {
    let free: FreeParameters = free.parse().unwrap();
    let result = calibrate(&corners.views, &Settings::new(free).with_image_size((640, 480))).unwrap();
    // Real boards are never quite what the model says: the minimum may lie above its floor, but not grossly.
    assert!(result.termination.is_minimum() && result.is_usable());
    result
}

fn assert_relative(ours: f64, theirs: f64, tolerance: f64, what: &str) {
    let error = (ours / theirs - 1.0).abs();
    assert!(error <= tolerance, "{what}: {ours} against {theirs}, relative {error:.2e} > {tolerance:.0e}");
}

/// Zhang's names in the order of our parameters: alpha, beta, u0, v0, gamma, k1, k2.
const ZHANG_ORDER: [usize; 7] = [0, 2, 3, 4, 1, 5, 6];

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn zhangs_optimum_and_standard_deviations_are_found() {
    let published = Published::load();
    let result = solve(&published.corners("zhang/points.csv"), "fx,fy,cx,cy,skew,k1,k2");
    let optimum = published.numbers("zhang", "optimum");
    let sigma = published.numbers("zhang", "sigma");
    for (parameter, place) in result.free.iter().zip(ZHANG_ORDER) {
        assert_relative(result.camera.get(parameter), optimum[place], 1e-6, parameter.name());
        // Printed with four digits; gamma and k1 with three.
        let sd = result.standard_deviation(parameter).unwrap();
        assert_relative(sd, sigma[place], 1e-3, &format!("sd {parameter}"));
    }
    assert_relative(result.rmse_px, published.number("zhang", "rms_point_px"), 1e-6, "rms");
}

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn zhangs_closed_form_is_met_to_the_printed_digits() {
    let published = Published::load();
    let corners = published.corners("zhang/points.csv");
    let homographies: Vec<Homography> =
        corners.views.iter().map(|v| Homography::fit(v.points(), v.pixels()).unwrap().homography).collect();
    let camera = closed_form(&homographies, true).unwrap();
    for (name, value) in [
        ("alpha", camera.fx),
        ("gamma", camera.skew),
        ("beta", camera.fy),
        ("u0", camera.cx),
        ("v0", camera.cy),
    ] {
        let precise = published.entry("zhang", "closed_form", name);
        assert!((value - precise).abs() <= 5.1e-5, "{name}: {value} against {precise}");
        let printed = published.entry("zhang", "closed_form_published", name);
        let half_digit = if name == "gamma" { 5e-5 } else { 5e-3 };
        assert!((value - printed).abs() <= half_digit, "{name}: {value} against the printed {printed}");
    }
}

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn opencvs_published_camera_is_found() {
    let published = Published::load();
    let result = solve(&published.corners("opencv_left/corners.csv"), "fx,fy,cx,cy,k1,k2,p1,p2,k3");
    for (parameter, theirs) in result.free.iter().zip(published.numbers("opencv_left", "published")) {
        assert_relative(result.camera.get(parameter), theirs, 1e-6, parameter.name());
    }
    assert_relative(result.rmse_px, published.number("opencv_left", "rms_point_px"), 1e-6, "rms");
}

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn the_matlab_toolboxs_camera_is_found() {
    let published = Published::load();
    let result = solve(&published.corners("calib1/points.csv"), "fx,fy,cx,cy,k1,k2,p1,p2");
    let theirs = published.numbers("calib1", "published");
    // MATLAB stopped 2e-6 short of the optimum in f.
    assert_relative(result.camera.fx, theirs[0], 3e-6, "fx");
    assert_relative(result.camera.fy, theirs[1], 3e-6, "fy");
    for (parameter, optimum) in result.free.iter().zip(published.numbers("calib1", "optimum")) {
        // The valley is flat (fx is known to 0.8 %), and two searches for its bottom end a small way apart.
        let z = (result.camera.get(parameter) - optimum) / result.standard_deviation(parameter).unwrap();
        assert!(z.abs() < 1e-4, "{parameter}: {z:.1e} standard deviations from the optimum");
    }
    // The toolbox divides by N - 1.
    let unbiased = result.rms_per_axis_px() * (245.0f64 / 244.0).sqrt();
    let rms = published.numbers("calib1", "rms_axis_px");
    assert_relative(unbiased.x, rms[0], 1e-6, "rms u");
    assert_relative(unbiased.y, rms[1], 1e-6, "rms v");
}

/// mrcal's names in the order of OpenCV: fx fy cx cy, then the rational model's coefficients.
fn rational(numbers: &[f64]) -> Camera<Lens> {
    let lens = Lens::new(Model::Rational, &numbers[4..]).unwrap();
    Camera::with_lens(numbers[0], numbers[1], numbers[2], numbers[3], lens)
}

/// The largest distance, px, of where two cameras see the marks of a calibration, each mark at its own ray of
/// the other camera: k1 with k4, k2 with k5 and k3 with k6 nearly trade off, pixels do not.
fn apart(found: &LensCalibration, other: &Camera<Lens>, corners: &CornerFile) -> f64 {
    let mut largest = 0.0_f64;
    for (view, pose) in corners.views.iter().zip(&found.cam_from_target) {
        for point in view.points() {
            let seen = pose.apply(&Vec3::new(point.x, point.y, 0.0));
            largest = largest.max((found.camera.pixel(&seen).unwrap() - other.pixel(&seen).unwrap()).norm());
        }
    }
    largest
}

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn mrcals_ultra_wide_camera_and_its_bowed_board_are_found() {
    let published = Published::load();
    let corners = published.corners("overpass/points.csv");
    let of_model = Settings::of_model(Model::Rational).with_image_size((6016, 4016));
    let bowed = Board::Bowed { standard_deviation: f64::INFINITY };
    for (board, camera, rms) in [
        (Board::Flat, "flat_board", "flat_board_rms_point_weighted_px"),
        (bowed, "bowed_board", "bowed_board_rms_point_weighted_px"),
    ] {
        let found = calibrate_lens(&corners.views, &of_model.clone().with_board(board)).unwrap();
        let theirs = rational(&published.numbers("overpass", camera));
        assert_relative(found.rmse_px, published.number("overpass", rms), 1e-7, rms);
        for parameter in [Parameter::Fx, Parameter::Fy] {
            let (ours, theirs) = (found.camera.value(parameter).unwrap(), theirs.value(parameter).unwrap());
            assert_relative(ours, theirs, 1e-6, parameter.name());
        }
        let apart = apart(&found, &theirs, &corners);
        assert!(apart < 0.002, "{camera}: {apart} px");
        if let Some(shape) = found.board {
            let bow = published.numbers("overpass", "bow_m");
            for (k, ours) in [shape.bow_x, shape.bow_y].into_iter().enumerate() {
                let z = (ours - bow[k]) / shape.standard_deviations[k];
                assert!(z.abs() < 0.1, "bow {k}: {z} standard deviations");
            }
        }
    }
}
