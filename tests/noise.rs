//! Does the noise of extraction come out as it was planted, with intervals that hold, and is what moved told
//! as such?

use crate::program::{calibench, folder, text};
use calibench::board::{Board, View};
use calibench::detect::chessboard;
use calibench::evaluate::Interval;
use calibench::geometry::{Pose, Vec2};
use calibench::io::write_png;
use calibench::noise::{Correlation, ExtractionNoise, NoiseError, Scatter, extraction_noise};
use calibench::synth::render::{Imaging, SensorNoise, photograph};
use calibench::synth::{Stream, StreamKey, Truth};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::sync::LazyLock;

/// Chance that a right program fails one of these counts.
const DOUBT: f64 = 1e-3;
/// Rate of false alarms of each test.
const RATE: f64 = 0.05;
const COLUMNS: usize = 9;
const ROWS: usize = 7;
/// Noise of a coordinate, px.
const SIGMA_PX: f64 = 0.04;

fn stream(scenario: &str, trial: u64) -> Stream {
    Stream::open(StreamKey { seed: 61, scenario, trial, purpose: "noise" })
}

/// The marks of the chapter's tilted view, on the board and in the image: photographed once for all frames.
static BOARD: LazyLock<(Vec<Vec2>, Vec<Vec2>)> = LazyLock::new(|| {
    let pose: Pose = Truth::example_poses()[3];
    let photo = photograph(
        &Truth::example_camera(),
        Truth::EXAMPLE_IMAGE,
        &Truth::example_board(),
        &pose,
        &Imaging::default(),
    );
    (Truth::example_board().points(), photo.expect("it is seen").centres_true)
});

/// What is added to the marks of each frame.
fn frames(count: usize, mut error: impl FnMut(usize, usize) -> Vec2) -> Vec<View> {
    let (points, places) = &*BOARD;
    let frame = |t: usize, error: &mut dyn FnMut(usize, usize) -> Vec2| {
        let pixels = places.iter().enumerate().map(|(i, place)| place + error(t, i)).collect();
        View::new(points.clone(), pixels).expect("finite")
    };
    (0..count).map(|t| frame(t, &mut error)).collect()
}

fn white(stream: &mut Stream) -> Vec2 {
    SIGMA_PX * Vec2::new(stream.normal(), stream.normal())
}

fn measured(frames: &[View], light: Option<&[f64]>) -> ExtractionNoise {
    extraction_noise(frames, light, RATE).expect("frames of a board")
}

/// Whether so many of so many trials go with a rate between two.
fn counted(what: &str, count: usize, trials: usize, least: f64, most: f64) {
    eprintln!("{what}: {count} of {trials}");
    let of_rate = Interval::of_proportion(count, trials, DOUBT);
    assert!(of_rate.low <= most && of_rate.high >= least, "{what}: {count} of {trials}: {of_rate:?}");
}

/// Counts how often something holds, and says how often it should.
#[derive(Default)]
struct Counts(Vec<(String, usize)>);

impl Counts {
    fn add(&mut self, what: &str, holds: bool) {
        match self.0.iter_mut().find(|(name, _)| name == what) {
            Some((_, count)) => *count += usize::from(holds),
            None => self.0.push((what.to_string(), usize::from(holds))),
        }
    }

    fn each(self, trials: usize, least: f64, most: f64) {
        self.0.into_iter().for_each(|(what, count)| counted(&what, count, trials, least, most));
    }
}

fn contained(counts: &mut Counts, of: &str, scatter: &Scatter, [uv, beside, next]: [f64; 3]) {
    for (name, deviation) in
        [("u", scatter.sigma_u_px), ("v", scatter.sigma_v_px), ("both", scatter.sigma_px)]
    {
        counts.add(&format!("{of}: sigma {name}"), deviation.interval_px.contains(SIGMA_PX));
    }
    for (name, correlation, truth) in [
        ("u and v", scatter.correlation_uv, uv),
        ("neighbours", scatter.correlation_neighbours, beside),
        ("next frame", scatter.correlation_next_frame, next),
    ] {
        let Some(Correlation { interval, .. }) = correlation else { continue };
        counts.add(&format!("{of}: {name}"), interval.contains(truth));
    }
}

#[test]
fn intervals_of_white_noise_hold_as_often_as_they_say_and_tests_alarm_as_rarely() {
    const TRIALS: usize = 600;
    for count in [2, 4, 12] {
        let (mut inside, mut alarms) = (Counts::default(), Counts::default());
        for trial in 0..TRIALS as u64 {
            let mut stream = stream(&format!("white {count}"), trial);
            let frames = frames(count, |_, _| white(&mut stream));
            let light: Vec<f64> = (0..count).map(|_| stream.normal()).collect();
            let found = measured(&frames, Some(&light));
            assert_eq!(found.within.correlation_uv.is_some(), count > 2);
            contained(&mut inside, &format!("{count} frames, as seen"), &found.as_seen, [0.0; 3]);
            contained(&mut inside, &format!("{count} frames, within"), &found.within, [0.0; 3]);
            let still = found.still;
            for (name, test) in [
                ("motion", Some(still.motion)),
                ("drift", still.drift),
                ("bending", still.bending),
                ("light", still.light),
            ] {
                assert_eq!(test.is_some(), count > 2 || name == "motion");
                alarms.add(&format!("{count} frames: {name}"), test.is_some_and(|t| !still.passes(&t)));
            }
            let noisiest = found.marks.iter().map(|mark| mark.p_value).fold(1.0, f64::min);
            alarms.add(&format!("{count} frames: a noisier mark"), noisiest < RATE);
        }
        // A twentieth of one per cent of room: M is an estimate too.
        inside.each(TRIALS, 0.945, 0.97);
        alarms.each(TRIALS, 0.0, RATE);
    }
}

/// White noise mixed so that u and v, neighbours and frames have something in common, and its correlations.
struct Mixed {
    uv: f64,
    beside: f64,
    next: f64,
}

impl Mixed {
    /// `(tr S)^2 / tr S^2` of the 126 coordinates, without the frames' memory.
    fn independent(&self) -> f64 {
        let (columns, rows) = (COLUMNS as f64, ROWS as f64);
        // Beside, across a corner: each shares two, one of four.
        let (beside, across) = (self.beside * self.beside, 0.25 * self.beside * self.beside);
        let pairs_beside = (columns - 1.0) * rows + columns * (rows - 1.0);
        let pairs_across = 2.0 * (columns - 1.0) * (rows - 1.0);
        let marks = columns * rows;
        let squares = marks + 2.0 * (pairs_beside * beside + pairs_across * across);
        2.0 * marks * marks / (squares * (1.0 + self.uv * self.uv))
    }

    /// Errors of `count` frames. A mark has its own number and that of the marks beside it; a frame a part of
    /// the one before.
    fn errors(&self, count: usize, stream: &mut Stream) -> Vec<Vec<Vec2>> {
        let mut before: Option<Vec<Vec2>> = None;
        let mut all = Vec::new();
        for _ in 0..count {
            let now: Vec<Vec2> = self.frame(stream);
            let now = match &before {
                Some(before) => {
                    let fresh = (1.0 - self.next * self.next).sqrt();
                    now.iter().zip(before).map(|(now, before)| fresh * now + self.next * before).collect()
                }
                None => now,
            };
            all.push(now.clone());
            before = Some(now);
        }
        all
    }

    fn frame(&self, stream: &mut Stream) -> Vec<Vec2> {
        // Sums of two by two numbers of a grid one larger: neighbours share half of theirs.
        let grid: Vec<Vec2> =
            (0..(COLUMNS + 1) * (ROWS + 1)).map(|_| Vec2::new(stream.normal(), stream.normal())).collect();
        let at = |column: usize, row: usize| grid[row * (COLUMNS + 1) + column];
        let (own, shared) = ((1.0 - 2.0 * self.beside).sqrt(), (2.0 * self.beside).sqrt());
        let mut marks = Vec::new();
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let four =
                    at(column, row) + at(column + 1, row) + at(column, row + 1) + at(column + 1, row + 1);
                let e = own * Vec2::new(stream.normal(), stream.normal()) + shared * 0.5 * four;
                let v = self.uv * e.x + (1.0 - self.uv * self.uv).sqrt() * e.y;
                marks.push(SIGMA_PX * Vec2::new(e.x, v));
            }
        }
        marks
    }
}

#[test]
fn planted_correlations_are_found_and_widen_the_interval_of_sigma() {
    const TRIALS: usize = 400;
    const FRAMES: usize = 20;
    for (name, mixed) in [
        ("u with v", Mixed { uv: 0.5, beside: 0.0, next: 0.0 }),
        ("neighbours", Mixed { uv: 0.0, beside: 0.3, next: 0.0 }),
    ] {
        let (mut inside, mut independent) = (Counts::default(), 0.0);
        for trial in 0..TRIALS as u64 {
            let errors = mixed.errors(FRAMES, &mut stream(name, trial));
            let found = measured(&frames(FRAMES, |t, i| errors[t][i]), None);
            let truth = [mixed.uv, mixed.beside, mixed.next];
            contained(&mut inside, name, &found.as_seen, truth);
            independent += found.as_seen.independent_coordinates / TRIALS as f64;
        }
        // (sum of eigenvalues)^2 / sum of squares: with u and v correlated by r, 126 / (1 + r^2); with
        // neighbours sharing half of what they share with themselves, 126 / (1 + sum of the squared
        // correlations of a mark with all others).
        eprintln!("{name}: {independent} independent coordinates");
        assert!((independent / mixed.independent() - 1.0).abs() < 0.05, "{name}: {independent}");
        inside.each(TRIALS, 0.93, 0.98);
    }
    // Frames that remember: no interval takes them for independent without a word.
    let next = Mixed { uv: 0.0, beside: 0.0, next: 0.4 };
    let (mut inside, mut told) = (0, 0);
    for trial in 0..TRIALS as u64 {
        let errors = next.errors(FRAMES, &mut stream("next", trial));
        let found = measured(&frames(FRAMES, |t, i| errors[t][i]), None).as_seen;
        let correlation = found.correlation_next_frame.expect("twenty frames");
        inside += usize::from(correlation.interval.contains(next.next));
        told += usize::from(correlation.interval.low > 0.0);
    }
    counted("next frame", inside, TRIALS, 0.9, 1.0);
    assert_eq!(told, TRIALS);
}

#[test]
fn what_moves_is_told_and_does_not_enter_the_noise_within_the_frames() {
    const TRIALS: usize = 200;
    const FRAMES: usize = 10;
    let (_, places) = &*BOARD;
    let turn = |place: &Vec2, rad: f64| Vec2::new(240.0 - place.y, place.x - 320.0) * rad;
    let (mut counts, mut independent) = (Counts::default(), 0.0);
    for trial in 0..TRIALS as u64 {
        let mut stream = stream("moving", trial);
        let still = frames(FRAMES, |_, _| white(&mut stream));
        let alone = measured(&still, None).within.sigma_px.value_px;
        // Half a noise of shift in all, and as much in turning.
        let drift = |t: usize, i: usize| {
            let time = t as f64 / (FRAMES - 1) as f64;
            Vec2::new(0.5 * SIGMA_PX * time, 0.0) + turn(&places[i], 1e-4 * time)
        };
        let shaken: Vec<Vec2> = (0..FRAMES).map(|_| 0.5 * white(&mut stream)).collect();
        // The marks' distance from the middle column follows the light.
        let light: Vec<f64> = (0..FRAMES).map(|_| stream.normal()).collect();
        let with = |more: &dyn Fn(usize, usize) -> Vec2| -> Vec<View> {
            let moved = |(t, view): (usize, &View)| {
                let pixels = view.pixels().iter().enumerate().map(|(i, pixel)| pixel + more(t, i)).collect();
                View::new(view.points().to_vec(), pixels).expect("finite")
            };
            still.iter().enumerate().map(moved).collect()
        };
        let drifting = measured(&with(&drift), None);
        counts.add("drift", !drifting.still.passes(&drifting.still.drift.expect("ten frames")));
        let shift = drifting.still.drift_px;
        // Half a noise along u, by the mean of 63 marks in ten frames.
        let middle: Vec2 = places.iter().sum::<Vec2>() / places.len() as f64;
        let planted = Vec2::new(0.5 * SIGMA_PX, 0.0) + turn(&middle, 1e-4);
        assert!((shift - planted).norm() < 5.0 * SIGMA_PX * (12.0f64 / (63.0 * 10.0)).sqrt(), "{shift}");
        assert!((drifting.within.sigma_px.value_px / alone - 1.0).abs() < 1e-3);
        let shaking = measured(&with(&|t, _| shaken[t]), None);
        counts.add("shaking", !shaking.still.passes(&shaking.still.motion));
        assert!((shaking.within.sigma_px.value_px / alone - 1.0).abs() < 1e-9);
        independent += shaking.as_seen.independent_coordinates / TRIALS as f64;
        let shown = with(&|t, i| Vec2::new(0.0, SIGMA_PX * light[t] * if i % 2 == 0 { 1.0 } else { -1.0 }));
        let flickering = measured(&shown, Some(&light));
        counts.add("light", !flickering.still.passes(&flickering.still.light.expect("the light is known")));
    }
    counts.each(TRIALS, 0.99, 1.0);
    // A quarter of the variance in common: (63 * 1.25)^2 / (63 (1 + 0.5) + 63^2 / 16) = 18.1 of u, as many of
    // v.
    assert!((20.0..60.0).contains(&independent), "{independent}");
}

#[test]
fn a_mark_that_scatters_twice_as_much_is_named() {
    let mut stream = stream("noisy mark", 0);
    let frames = frames(20, |_, i| if i == 17 { 2.0 * white(&mut stream) } else { white(&mut stream) });
    let found = measured(&frames, None);
    let named: Vec<usize> = (0..63).filter(|&i| found.marks[i].p_value < 1e-3).collect();
    assert_eq!(named, [17]);
    let (low, high) = found.factors_of_a_mark();
    let sigma = found.marks[17].sigma_px.x;
    assert!(low * sigma < 2.0 * SIGMA_PX && 2.0 * SIGMA_PX < high * sigma, "{sigma}");
}

#[test]
fn frames_that_tell_nothing_are_refused() {
    let mut stream = stream("refused", 0);
    let good = frames(3, |_, _| white(&mut stream));
    let one = extraction_noise(&good[..1], None, RATE);
    assert_eq!(one, Err(NoiseError::TooFewFrames { need: 2, got: 1 }));
    assert!(extraction_noise(&[], None, RATE).is_err());
    let light = extraction_noise(&good, Some(&[1.0, f64::NAN, 1.0]), RATE);
    assert_eq!(light, Err(NoiseError::Light { frames: 3, light: 2 }));
    let few: Vec<View> = (good.iter())
        .map(|v| View::new(v.points()[..5].to_vec(), v.pixels()[..5].to_vec()).expect("finite"))
        .collect();
    assert_eq!(extraction_noise(&few, None, RATE), Err(NoiseError::TooFewMarks { need: 6, common: 5 }));
}

/// A chessboard photographed by a still camera with this noise of its pixels.
fn photographs(count: usize, noise: f64) -> Vec<calibench::raster::Raster<f32>> {
    let board = Board::chessboard(8, 6, 8.0).expect("a board");
    let imaging = Imaging { blur_px: 0.7, ..Imaging::default() };
    let pose = Truth::example_poses()[1];
    let exact = photograph(&Truth::example_camera(), Truth::EXAMPLE_IMAGE, &board, &pose, &imaging);
    let exact = exact.expect("it is seen").image;
    (0..count as u64)
        .map(|t| {
            let mut image = exact.clone();
            SensorNoise::constant(noise).add_to(&mut image, &mut stream("pixels", t));
            image
        })
        .collect()
}

fn corners(photos: &[calibench::raster::Raster<f32>]) -> Vec<View> {
    let points = Board::chessboard(8, 6, 8.0).expect("a board").points();
    let view = |photo| {
        let found = chessboard(photo, 8, 6).expect("it is seen");
        View::new(points.clone(), found.corners_px().to_vec()).expect("finite")
    };
    photos.iter().map(view).collect()
}

#[test]
fn the_noise_of_pixels_is_that_of_the_corners_to_scale_and_corners_are_independent() {
    let [half, whole] = [0.01, 0.02].map(|noise| measured(&corners(&photographs(16, noise)), None));
    for found in [&half, &whole] {
        assert!(found.still.holds(), "{:?}", found.still);
        // Windows of neighbouring corners do not overlap, so that white pixels make white corners.
        for correlation in [found.as_seen.correlation_neighbours, found.as_seen.correlation_next_frame] {
            assert!(correlation.is_some_and(|c| c.interval.contains(0.0)), "{correlation:?}");
        }
    }
    // The same draws, twice as large: the estimate is linear but for the second order.
    let ratio = whole.within.sigma_px.value_px / half.within.sigma_px.value_px;
    assert!((ratio - 2.0).abs() < 0.02, "{ratio}");
}

#[test]
fn the_command_measures_photographs_and_their_corners_alike() {
    let folder = folder("noise-command");
    let photos: Vec<_> = photographs(5, 0.01);
    let mut csv = "view,point,X,Y,u,v\n".to_string();
    let rounded: Vec<_> = photos.iter().map(|photo| photo.to_u8()).collect();
    let points = Board::chessboard(8, 6, 8.0).expect("a board").points();
    let names: Vec<String> = (0..5).map(|t| folder.join(format!("{t}.png")).display().to_string()).collect();
    for (t, photo) in rounded.iter().enumerate() {
        write_png(names[t].as_ref(), photo).expect("written");
        for (i, (at, p)) in points.iter().zip(chessboard(photo, 8, 6).expect("seen").corners_px()).enumerate()
        {
            writeln!(csv, "{t},{i},{},{},{},{}", at.x, at.y, p.x, p.y).expect("text grows");
        }
    }
    let file = folder.join("corners.csv").display().to_string();
    fs::write(&file, csv).expect("written");
    let mut arguments = vec!["noise", "--board", "chess:8x6:8mm", "--format", "json"];
    arguments.extend(names.iter().map(String::as_str));
    let of = |arguments: &[&str]| -> Value {
        let output = calibench(&folder, arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let (of_photos, of_corners) = (of(&arguments), of(&["noise", &file, "--format", "json"]));
    for field in ["as_seen", "within", "marks", "drift_px"] {
        assert_eq!(of_photos[field], of_corners[field], "{field}");
    }
    // The light of photographs is known, that of corners not.
    assert!(of_photos["tests"]["light"]["p_value"].is_number() && of_corners["tests"]["light"].is_null());
    let sigma = of_photos["within"]["sigma"]["value_px"].as_f64().expect("a number");
    let found = measured(&corners(&photos), None).within.sigma_px.value_px;
    // Rounding to 256 levels adds a twelfth of a level's square: a hundredth of the noise's.
    assert!((sigma / found - 1.0).abs() < 0.05, "{sigma} {found}");
    let out = folder.join("out").display().to_string();
    let output = calibench(&folder, &["noise", &file, "--want", "2", "--out", &out]);
    let said = text(&output.stdout);
    assert!(said.contains("to 2 %: ") && said.contains("nothing but noise changed"), "{said}");
    assert!(folder.join("out/noise.json").exists());
    // One photograph, one corner file of a single view, and two copies.
    let one = calibench(&folder, &["noise", "--board", "chess:8x6:8mm", &names[0]]);
    assert_eq!(one.status.code(), Some(2));
    assert!(text(&one.stderr).contains("takes 2 at least"), "{}", text(&one.stderr));
    let copies = calibench(&folder, &["noise", "--board", "chess:8x6:8mm", &names[0], &names[0]]);
    assert_eq!(copies.status.code(), Some(2));
    assert!(text(&copies.stderr).contains("the same marks to the last bit"));
    // A board that was pushed by a twentieth of a pixel after the third frame: told, and exit code 1.
    let pushed: String = fs::read_to_string(&file)
        .expect("read")
        .lines()
        .map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            [view @ ("3" | "4"), point, x, y, u, v] => {
                format!("{view},{point},{x},{y},{},{v}\n", u.parse::<f64>().expect("a number") + 0.05)
            }
            _ => format!("{line}\n"),
        })
        .collect();
    fs::write(&file, pushed).expect("written");
    let output = calibench(&folder, &["noise", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("more than noise changed"), "{}", text(&output.stdout));
}
