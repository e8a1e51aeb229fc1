//! What is measured? Every row of the speed tables as a piece of work that can be repeated and whose answer
//! can be looked at.
#![allow(dead_code, reason = "every program of this folder takes what it needs")]

use crate::common;
use calibench::board::{Board, View};
use calibench::calibrate::{Calibration, LensCalibration, Settings, calibrate, calibrate_lens, information};
use calibench::camera::{BrownConrady, Camera, FreeParameters, Model};
use calibench::detect::{chessboard, circle_grid, sparse_dots};
use calibench::geometry::{Affine, Homography, Vec2};
use calibench::raster::Raster;
use calibench::rectify::{RectifyMap, rectify_image};
use calibench::synth::render::{Imaging, SensorNoise, nine_dot_stand_in, photograph};
use calibench::synth::{Stream, StreamKey, Truth, scene};
use std::hint::black_box;
use std::marker::PhantomData;

/// Views of the calibrations.
pub const VIEWS: [usize; 5] = [4, 20, 100, 500, 2000];
/// Views of the calibrations through other lenses.
pub const WIDE_VIEWS: [usize; 3] = [4, 20, 100];
/// Width and height of the images that are rectified, px.
pub const FRAMES: [(usize, usize); 2] = [(640, 480), (4000, 3000)];

/// A piece of work.
pub trait Work {
    /// Does it some times over.
    fn repeat(&mut self, times: usize);
    /// Does it once; the numbers that tell how exact it is.
    fn answer(&mut self) -> Vec<f64>;
}

struct Job<T, R, A> {
    run: R,
    answer: A,
    result: PhantomData<T>,
}

impl<T, R: FnMut() -> T, A: Fn(T) -> Vec<f64>> Work for Job<T, R, A> {
    fn repeat(&mut self, times: usize) {
        for _ in 0..times {
            black_box((self.run)());
        }
    }

    fn answer(&mut self) -> Vec<f64> {
        (self.answer)((self.run)())
    }
}

fn job<T: 'static>(
    run: impl FnMut() -> T + 'static,
    answer: impl Fn(T) -> Vec<f64> + 'static,
) -> Option<Box<dyn Work>> {
    Some(Box::new(Job { run, answer, result: PhantomData }))
}

/// The work of a row, with its input made; `None` if there is no such row.
pub fn named(row: &str) -> Option<Box<dyn Work>> {
    let (kind, size) = row.split_once('-').unwrap_or((row, ""));
    match kind {
        "calibrate" => {
            let views = common::views(size.parse().ok()?);
            job(move || calibrate(&views, &Settings::standard()).expect("it can be calibrated"), intrinsics)
        }
        "fisheye" => {
            let views = common::fisheye_views(size.parse().ok()?);
            let settings = Settings::of_model(Model::KannalaBrandt);
            let run = move || calibrate_lens(&views, &settings).expect("it can be calibrated");
            job(run, |found| found.camera.values().map(|(_, value)| value).collect())
        }
        "wide" | "rational" => {
            let model = wide_model(kind);
            let views = common::wide_views(model, size.parse().ok()?);
            let settings = Settings::of_model(model);
            let run = move || calibrate_lens(&views, &settings).expect("it can be calibrated");
            job(run, |found| free_values(&found))
        }
        "covariance" => {
            let poses = common::poses(size.parse().ok()?);
            let points = Truth::example_board().points();
            let system = information(&Truth::example_camera(), FreeParameters::STANDARD, &poses, &points)
                .expect("every view lies in front of the camera");
            job(move || system.covariance(), |_| Vec::new())
        }
        "refusal" => {
            let views = common::facing_views();
            job(move || calibrate(&views, &Settings::standard()).expect_err("nothing tilts"), |_| Vec::new())
        }
        "homography" => {
            let view = common::views(4).remove(3);
            let answer = |h: Homography| h.0.transpose().iter().copied().collect();
            job(move || Homography::fit(view.points(), view.pixels()).expect("63 points").homography, answer)
        }
        "affine" => {
            let (pixels, world) = nine_points();
            let run = move || Affine::fit(&pixels, &world).expect("nine points");
            job(run, |map| map.matrix().transpose().iter().take(6).copied().collect())
        }
        "points" => {
            let (camera, pixels) = (Truth::example_camera(), pixels());
            job(move || camera.correct_pixels(&pixels).expect("inside the lens model"), |p| flat(&p))
        }
        "remap" => {
            let (size, image) = (parse_size(size)?, frame(parse_size(size)?));
            let (camera, output) = cameras(size);
            let map = RectifyMap::between(&camera, size, &output, size).expect("a map");
            job(move || map.apply(&image, 0).expect("the map's size"), |i: Raster<u8>| levels(&i))
        }
        "undistort" => {
            let (size, image) = (parse_size(size)?, frame(parse_size(size)?));
            let (camera, output) = cameras(size);
            let run = move || rectify_image(&image, &camera, &output, size, 0).expect("a photograph");
            job(run, |i: Raster<u8>| levels(&i))
        }
        "grid" => {
            let (image, _) = grid();
            let run = move || circle_grid(&image, 9, 7).expect("the grid is there");
            job(run, |found| flat(&found.centres_px()))
        }
        "study" => Some(Box::new(Study)),
        "chess" => {
            let (image, _) = chess();
            let run = move || chessboard(&image, 9, 6).expect("the board is there");
            job(run, |found| flat(found.corners_px()))
        }
        "dots" => {
            let (image, _) = dots();
            let run = move || sparse_dots(&image, 3, 3).expect("the dots are there");
            job(run, |found| flat(&found.centres_px()))
        }
        _ => None,
    }
}

/// Every row there is.
pub fn rows() -> Vec<String> {
    let calibrations = VIEWS.iter().map(|views| format!("calibrate-{views}"));
    let frames = FRAMES.iter().map(|(width, height)| format!("{width}x{height}"));
    let images = frames.flat_map(|size| [format!("remap-{size}"), format!("undistort-{size}")]);
    let rest = ["covariance-100", "refusal", "homography", "affine", "points", "grid", "chess", "dots"];
    let study = Some("study");
    calibrations.chain(images).chain(rest.into_iter().chain(study).map(str::to_string)).collect()
}

/// Trials of the study of four poses, in one batch as `study run` does them but for the files: a repetition
/// is a trial.
struct Study;

impl Work for Study {
    fn repeat(&mut self, times: usize) {
        use calibench_study::{Spec, in_memory};
        let text = include_str!("../studies/four-pose.toml");
        let mut spec = Spec::parse(text).expect("a study of the project");
        spec.trials.per_cell = times as u64;
        spec.trials.batch = times as u64;
        black_box(in_memory(spec, text, |_| {}).expect("a study of the project"));
    }

    fn answer(&mut self) -> Vec<f64> {
        Vec::new()
    }
}

/// The lens model of the rows `wide` and `rational`.
pub fn wide_model(kind: &str) -> Model {
    if kind == "wide" { Model::KannalaBrandt } else { Model::Rational }
}

/// What was estimated of a camera, in order.
pub fn free_values(found: &LensCalibration) -> Vec<f64> {
    found.free.iter().filter_map(|p| found.camera.value(p)).collect()
}

/// The six free intrinsics.
fn intrinsics(calibration: Calibration) -> Vec<f64> {
    FreeParameters::STANDARD.iter().map(|p| calibration.camera.get(p)).collect()
}

fn flat(points: &[Vec2]) -> Vec<f64> {
    points.iter().flat_map(|p| [p.x, p.y]).collect()
}

fn levels(image: &Raster<u8>) -> Vec<f64> {
    image.samples().iter().map(|&level| f64::from(level)).collect()
}

fn parse_size(text: &str) -> Option<(usize, usize)> {
    let (width, height) = text.split_once('x')?;
    Some((width.parse().ok()?, height.parse().ok()?))
}

/// A million pixels all over the chapter's image.
pub fn pixels() -> Vec<Vec2> {
    (0..1_000_000).map(|i| Vec2::new(f64::from(i % 1000) * 0.64, f64::from(i / 1000) * 0.48)).collect()
}

/// The chapter's camera for an image of this size, and the pinhole camera of the rectified image.
pub fn cameras((width, _): (usize, usize)) -> (Camera, Camera) {
    let scale = width as f64 / 640.0;
    let c = Truth::example_camera();
    let pinhole = Camera::pinhole(c.fx * scale, c.fy * scale, c.cx * scale, c.cy * scale);
    (pinhole.with_distortion(BrownConrady::radial(c.distortion.k1, c.distortion.k2)), pinhole)
}

/// A tilted circle grid in front of the chapter's camera, with noise of four grey levels: edges, flats and
/// texture.
pub fn frame(size: (usize, usize)) -> Raster<u8> {
    board_image(size, &Truth::example_board(), [-15.0, 15.0, 10.0]).0
}

/// The chapter's grid as its camera sees it in the fourth view, 640 x 480, and where its discs' centres truly
/// are.
pub fn grid() -> (Raster<u8>, Vec<Vec2>) {
    board_image((640, 480), &Truth::example_board(), [-15.0, 15.0, 10.0])
}

/// A chessboard of 9 x 6 inner corners in the same place, and where they truly are.
pub fn chess() -> (Raster<u8>, Vec<Vec2>) {
    let board = Board::chessboard(9, 6, 10.0).expect("a board");
    board_image((640, 480), &board, [-15.0, 15.0, 10.0])
}

/// The stand-in for the nine-point image, 1571 x 1053, and where its dots' centres truly are.
pub fn dots() -> (Raster<u8>, Vec<Vec2>) {
    let photograph = nine_dot_stand_in().with_noise(&SensorNoise::constant(NOISE), &mut stream("dots"));
    (photograph.image.to_u8(), photograph.centres_true)
}

/// Noise of an image, as part of the range: about one grey level.
const NOISE: f64 = 0.004;

fn board_image(size: (usize, usize), board: &Board, degrees: [f64; 3]) -> (Raster<u8>, Vec<Vec2>) {
    let (camera, _) = cameras(size);
    let imaging = Imaging { blur_px: 0.7, ..Imaging::default() };
    let pose = scene::looking_at_centre(degrees, 120.0);
    let photograph = photograph(&camera, size, board, &pose, &imaging)
        .expect("the board lies in front of the camera")
        .with_noise(&SensorNoise::constant(NOISE), &mut stream("frame"));
    (photograph.image.to_u8(), photograph.centres_true)
}

/// The stand-in's nine dots, measured with noise of 0.05 px, and where they are in the world.
pub fn nine_points() -> (Vec<Vec2>, Vec<Vec2>) {
    let mut stream = stream("nine");
    let mut pair = |i: usize| {
        let (column, row) = ((i % 3) as f64, (i / 3) as f64);
        let pixel = Vec2::new(478.478 + 236.23 * column, 329.803 + 236.19 * row);
        let noise = Vec2::new(stream.normal(), stream.normal()) * 0.05;
        (pixel + noise, Vec2::new(10.0 * column, 10.0 * row))
    };
    (0..9).map(&mut pair).unzip()
}

fn stream(purpose: &str) -> Stream {
    Stream::open(StreamKey { seed: 1, scenario: "bench", trial: 0, purpose })
}

/// The views' numbers: X, Y, u, v point by point.
pub fn pairs(views: &[View]) -> Vec<f64> {
    views.iter().flat_map(View::pairs).flat_map(|(p, q)| [p.x, p.y, q.x, q.y]).collect()
}
