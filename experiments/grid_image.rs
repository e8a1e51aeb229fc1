//! Does a corrected image show straight lines, in its pixels?
//!
//! The chapter proves its correction on computed points, which no interpolation touches (section 5.4). Here a
//! grid of lines is photographed through the lens, corrected pixel by pixel, and the line is found again in
//! the levels of the corrected image. Expected: straight to what 8-bit levels allow, with the true lens; a
//! little less straight with a lens from one noisy view; and visibly wrong where the nearest sample stands in
//! for interpolation. Mapping forwards, from photograph to output, leaves holes wherever the lens had shrunk
//! the scene.
//!
//! What it cannot show: a shift of the whole image. A line that is moved stays straight.

use calibench::calibrate::single_plane::{SinglePlaneOptions, calibrate_single_plane};
use calibench::camera::{BrownConrady, Camera};
use calibench::geometry::{LineFit, Vec2};
use calibench::raster::Raster;
use calibench::rectify::RectifyMap;
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench_harness::stats::largest;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Figure, Plot, Record, Table};

mod directions;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "grid-image",
    title: "A grid of lines, corrected pixel by pixel",
    question: "A grid photographed through the chapter's lens is corrected as an image. How straight is its top \
               line in the corrected pixels, does a wrong interpolation show, and what does mapping forwards leave \
               out? Expected: straight to the rounding of 8-bit levels; the nearest sample shows; holes.",
    seed: 1,
    takes_image: false,
    run,
};

/// The lines of the chapter's grid, ideal pixels.
const GRID_U_PX: [f64; 11] = [20.0, 80.0, 140.0, 200.0, 260.0, 320.0, 380.0, 440.0, 500.0, 560.0, 620.0];
const GRID_V_PX: [f64; 7] = [60.0, 120.0, 180.0, 240.0, 300.0, 360.0, 420.0];
/// Half of a line's width, ideal pixels.
const HALF_WIDTH_PX: f64 = 1.5;
const PAPER: f64 = 230.0;
const INK: f64 = 30.0;
/// A pixel is the mean of so many samples along u and v: more where the line's centre is measured.
const SAMPLES: (usize, usize) = (2, 8);
/// The line is looked for this far from where it would be without a lens, and its centre measured over this
/// many rows on each side of the darkest.
const SEARCH_PX: usize = 30;
const WINDOW_PX: usize = 5;
/// Columns nearer than this to an upright line are left out.
const CLEARANCE_PX: f64 = 9.0;
/// Noise of the view that the lens is calibrated from, and its distance.
const SIGMA_PX: f64 = 0.1;
const DISTANCE_MM: f64 = 120.0;
/// k1 of the pincushion.
const PINCUSHION_K1: f64 = 0.18;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let truth = Truth::example_camera();
    let photo = photograph(&truth);
    let plane = calibrated_lens(context.seed)?;
    let size = Truth::EXAMPLE_IMAGE;
    let rectified = |camera: &Camera| -> Result<Raster<u8>, ExperimentError> {
        let map = RectifyMap::new(size, size, |ideal| Some(camera.distort_pixel(ideal)))
            .map_err(ExperimentError::at("rectification"))?;
        map.apply(&photo, 0).map_err(ExperimentError::at("rectification"))
    };
    let by_truth = rectified(&truth)?;
    let by_plane = rectified(&plane)?;
    let nearest = nearest_sample(&photo, &truth);
    let forward = Forward::new(&photo, &truth)?;
    let lines = [
        Line::in_image("photograph", &photo, &truth)?,
        Line::in_image("true lens", &by_truth, &without_lens(&truth))?,
        Line::in_image("calibrated lens", &by_plane, &without_lens(&truth))?,
        Line::in_image("nearest sample", &nearest, &without_lens(&truth))?,
    ];
    let lens_error = lens_error_px(&truth, &plane);
    report(&mut record, &lines, lens_error, &forward);
    let expected = bent_by_both(&truth, &plane, &lines[2])?;
    claim_straight(&mut record, &lines, &expected);
    claim_holes(&mut record, &forward, size);
    record.table(line_table(&lines));
    draw(&mut record, context.seed, &lines, (&photo, &by_truth, &by_plane, &forward.image));
    record.figure(directions::figure(&truth)?);
    Ok(record)
}

/// The grid through a lens: each pixel the mean of its samples, each sample looked up where it was without
/// lens.
fn photograph(camera: &Camera) -> Raster<u8> {
    let (width, height) = Truth::EXAMPLE_IMAGE;
    let (across, down) = SAMPLES;
    let offset = |k: usize, n: usize| (k as f64 + 0.5) / n as f64 - 0.5;
    Raster::from_bands(width, height, 0u8, 1, |y, levels| {
        for (x, pixel) in levels.iter_mut().enumerate() {
            let mut sum = 0.0;
            for (i, j) in (0..across).flat_map(|i| (0..down).map(move |j| (i, j))) {
                let seen = Vec2::new(x as f64 + offset(i, across), y as f64 + offset(j, down));
                // Beyond the lens's reach there is paper.
                sum += camera.correct_pixel(&seen).map_or(PAPER, |ideal| level(&ideal));
            }
            *pixel = libm::round(sum / (across * down) as f64) as u8;
        }
    })
}

/// The level of the printed grid at an ideal pixel. Ink thins out over one pixel at the edge of a line.
fn level(ideal: &Vec2) -> f64 {
    let ink = |distance: f64| (HALF_WIDTH_PX + 0.5 - distance).clamp(0.0, 1.0);
    let on = |lines: &[f64], at: f64| largest(lines.iter().map(|line| ink((line - at).abs())));
    let along = |lines: &[f64], at: f64| ink((lines[0] - at).max(at - lines[lines.len() - 1]));
    let level_line = on(&GRID_V_PX, ideal.y).min(along(&GRID_U_PX, ideal.x));
    let upright_line = on(&GRID_U_PX, ideal.x).min(along(&GRID_V_PX, ideal.y));
    PAPER - (PAPER - INK) * level_line.max(upright_line)
}

/// The lens that one noisy facing view of the target gives, its centre estimated.
fn calibrated_lens(seed: u64) -> Result<Camera, ExperimentError> {
    let pose = looking_at_centre([0.0; 3], DISTANCE_MM);
    let scene = Scene::new(Truth { cam_from_target: vec![pose], ..Truth::example() })
        .map_err(ExperimentError::at("scene"))?;
    let key = StreamKey { seed, scenario: "grid-image", trial: 0, purpose: "noise" };
    let view = scene.observe(SIGMA_PX, &mut Stream::open(key)).remove(0);
    let (width, height) = Truth::EXAMPLE_IMAGE;
    let centre_px = Vec2::new(0.5 * width as f64, 0.5 * height as f64);
    let options = SinglePlaneOptions { focal_px: scene.truth.camera.fx, centre_px, centre_free: true };
    let plane =
        calibrate_single_plane(&view, &options).map_err(ExperimentError::at("single-plane calibration"))?;
    Ok(plane.lens_camera())
}

/// The corrected image without interpolation.
fn nearest_sample(photo: &Raster<u8>, camera: &Camera) -> Raster<u8> {
    let inside = |p: Vec2| {
        let (x, y) = (libm::round(p.x), libm::round(p.y));
        let is_inside = x >= 0.0 && y >= 0.0 && x < photo.width() as f64 && y < photo.height() as f64;
        is_inside.then_some((x as usize, y as usize))
    };
    Raster::from_fn(photo.width(), photo.height(), |x, y| {
        inside(camera.distort_pixel(&Vec2::new(x as f64, y as f64))).map_or(0, |(x, y)| photo.get(x, y))
    })
}

/// Every pixel of the photograph sent to where it belongs.
struct Forward {
    image: Raster<u8>,
    /// Output pixels that nothing was sent to.
    holes: usize,
    /// Pixels of the photograph that were sent to within the output.
    landed: usize,
}

impl Forward {
    fn new(photo: &Raster<u8>, camera: &Camera) -> Result<Forward, ExperimentError> {
        let (width, height) = (photo.width(), photo.height());
        let mut image = Raster::filled(width, height, 0u8);
        let mut hit = Raster::filled(width, height, false);
        let mut landed = 0;
        for y in 0..height {
            for x in 0..width {
                let seen = Vec2::new(x as f64, y as f64);
                let ideal =
                    camera.correct_pixel(&seen).map_err(ExperimentError::at("correction of a pixel"))?;
                let (u, v) = (libm::round(ideal.x), libm::round(ideal.y));
                if u >= 0.0 && v >= 0.0 && u < width as f64 && v < height as f64 {
                    landed += 1;
                    image.set(u as usize, v as usize, photo.get(x, y));
                    hit.set(u as usize, v as usize, true);
                }
            }
        }
        let holes = hit.samples().iter().filter(|&&hit| !hit).count();
        Ok(Forward { image, holes, landed })
    }
}

/// The grid's top line as it is found in an image.
struct Line {
    name: &'static str,
    /// Column, and the row of the line's centre there.
    points: Vec<Vec2>,
    fit: LineFit,
}

impl Line {
    /// The centre of the darkness in each column. The lens of the image says where upright lines cross.
    fn in_image(name: &'static str, image: &Raster<u8>, lens: &Camera) -> Result<Line, ExperimentError> {
        let crossings = GRID_U_PX.map(|u| lens.distort_pixel(&Vec2::new(u, GRID_V_PX[0])).x);
        let clear = |u: f64| crossings.iter().all(|line| (line - u).abs() > CLEARANCE_PX);
        let columns = (crossings[0] as usize..crossings[10] as usize).filter(|&x| clear(x as f64));
        let points: Vec<Vec2> = columns.map(|x| Vec2::new(x as f64, centre_of_darkness(image, x))).collect();
        let fit = LineFit::new(&points).map_err(ExperimentError::at("line fit"))?;
        Ok(Line { name, points, fit })
    }
}

fn centre_of_darkness(image: &Raster<u8>, x: usize) -> f64 {
    let top = GRID_V_PX[0] as usize;
    let darkness = |y: usize| (PAPER - f64::from(image.get(x, y))).max(0.0);
    let around = top - SEARCH_PX..=top + SEARCH_PX;
    let darkest = around.max_by(|&a, &b| darkness(a).total_cmp(&darkness(b))).unwrap_or(top);
    let window = darkest - WINDOW_PX..=darkest + WINDOW_PX;
    let (mut sum, mut moment) = (0.0, 0.0);
    for y in window {
        sum += darkness(y);
        moment += darkness(y) * y as f64;
    }
    moment / sum
}

fn without_lens(camera: &Camera) -> Camera {
    camera.with_distortion(BrownConrady::radial(0.0, 0.0))
}

/// What whole levels and samples may move the centre by. Each of the rows of the window is off by half a
/// level in the photograph and by half a level in the corrected image, at most; a line's darkness is its
/// width times the contrast, less a tenth for the lens, which makes it narrower. And the mean of samples `h`
/// apart is off by `h^2 / 8` of the contrast at each of four places where the ink begins or ceases to thin
/// out, two pixels from the centre.
fn rounding_px() -> f64 {
    let lever: f64 = 2.0 * (1..=WINDOW_PX).map(|k| k as f64).sum::<f64>();
    let width = 0.9 * 2.0 * HALF_WIDTH_PX;
    let step = 1.0 / SAMPLES.1 as f64;
    2.0 * 0.5 * lever / (width * (PAPER - INK)) + 4.0 * 2.0 * step * step / 8.0 / width
}

/// How far the two lenses place the same pixel of the top line apart, at most.
fn lens_error_px(truth: &Camera, estimate: &Camera) -> f64 {
    let along = (GRID_U_PX[0] as usize..GRID_U_PX[10] as usize).map(|x| Vec2::new(x as f64, GRID_V_PX[0]));
    largest(along.map(|ideal| (truth.distort_pixel(&ideal) - estimate.distort_pixel(&ideal)).norm()))
}

/// Levels are whole numbers: a source that moves by rounding may turn one.
fn levels() -> Band {
    Band::relative(1e-3, "a source that moves by 1e-8 px turns the rounding of few levels")
}

fn report(record: &mut Record, lines: &[Line], lens_error_px: f64, forward: &Forward) {
    for line in lines {
        record
            .group("px", levels())
            .suffix(format!("-{}", line.name.replace(' ', "-")), format!(", {}", line.name))
            .number(
                "max-deviation",
                line.fit.max_deviation(),
                "largest distance of the top line from its regression line, in the image",
            )
            .number("rms-deviation", line.fit.rms_deviation(), "root mean square of the distances");
    }
    record
        .group("px", levels())
        .number("rounding", rounding_px(), "what rounding to whole levels may move a centre by")
        .number(
            "lens-error",
            lens_error_px,
            "largest distance of the calibrated lens from the true one along the line",
        );
    record
        .exact("px")
        .count("columns", lines[0].points.len(), "columns in which the line is measured")
        .count("holes", forward.holes, "pixels that mapping forwards leaves empty")
        .count(
            "landed",
            forward.landed,
            "pixels of the photograph that mapping forwards sends into the output",
        );
    let all = (Truth::EXAMPLE_IMAGE.0 * Truth::EXAMPLE_IMAGE.1) as f64;
    record.exact("").number(
        "holes-share",
        forward.holes as f64 / all,
        "share of the output that mapping forwards leaves empty",
    );
}

/// Where the top line lies, computed point by point, that is seen through one lens and corrected with
/// another.
fn bent_by_both(truth: &Camera, estimate: &Camera, line: &Line) -> Result<LineFit, ExperimentError> {
    /// The correction moves a point along the line by a pixel at most, and less each time.
    const STEPS: usize = 6;
    let corrected = |u: f64| {
        let seen = truth.distort_pixel(&Vec2::new(u, GRID_V_PX[0]));
        estimate.correct_pixel(&seen).map_err(ExperimentError::at("correction of the line"))
    };
    let at_column = |column: f64| {
        let mut u = column;
        for _ in 0..STEPS {
            u += column - corrected(u)?.x;
        }
        corrected(u)
    };
    let points = line.points.iter().map(|p| at_column(p.x)).collect::<Result<Vec<Vec2>, _>>()?;
    LineFit::new(&points).map_err(ExperimentError::at("line fit"))
}

fn claim_straight(record: &mut Record, lines: &[Line], expected: &LineFit) {
    let [_, truth, plane, nearest] = lines else { return };
    let pairs = plane.fit.deviations.iter().zip(&expected.deviations);
    let from_points = largest(pairs.map(|(image, points)| (image - points).abs()));
    record
        .group("px", levels())
        .number("calibrated-from-points", expected.max_deviation(), "largest deviation that points of the line have, seen through the true lens and corrected with the calibrated one")
        .number("image-from-points", from_points, "largest distance of the line in the image from these points");
    record
        .claim_that("corrected-pixels-are-straight", "in the image corrected by the true lens the line is straight")
        .at_most(truth.fit.max_deviation(), rounding_px())
        .unit("px")
        .because("half a level at each row of the window, in both images, over the line's darkness; bilinear mixing keeps a centre where it is");
    record
        .claim_that(
            "calibrated-pixels-are-as-straight-as-the-lens",
            "with the calibrated lens the line of the image lies where computed points do",
        )
        .at_most(from_points, 2.0 * rounding_px())
        .unit("px")
        .because("the same rounding, once for the line and once for its regression");
    record
        .claim_that("a-wrong-interpolation-shows", "without interpolation the line is not straight")
        .at_least(nearest.fit.max_deviation(), 2.0 * rounding_px())
        .unit("px")
        .because("the nearest sample is up to half a pixel away: a check that could not see that would prove nothing");
}

fn claim_holes(record: &mut Record, forward: &Forward, (width, height): (usize, usize)) {
    record
        .claim_that(
            "forward-mapping-leaves-holes",
            "mapping forwards leaves at least as many pixels empty as it has too few",
        )
        .at_least(forward.holes as f64, (width * height - forward.landed) as f64)
        .unit("px")
        .because(
            "each pixel of the photograph fills one pixel of the output at most; inverse mapping fills all",
        );
}

fn line_table(lines: &[Line]) -> Table {
    Table::of("lines", "the grid's top line, found in the levels of four images", lines)
        .column("image", "", |line| line.name)
        .column("max_deviation", "px", |line| line.fit.max_deviation())
        .column("rms_deviation", "px", |line| line.fit.rms_deviation())
        .into()
}

fn draw(
    record: &mut Record,
    seed: u64,
    lines: &[Line],
    (photo, by_truth, by_plane, forward): (&Raster<u8>, &Raster<u8>, &Raster<u8>, &Raster<u8>),
) {
    let truth = Truth::example_camera();
    let ideal = without_lens(&truth);
    let pincushion = truth.with_distortion(BrownConrady { k1: PINCUSHION_K1, ..truth.distortion });
    let grid = "The chapter's grid, lines of 3 px";
    record.figure(Figure::photo("ideal", &photograph(&ideal), format!("{grid}, without a lens.")));
    record.figure(Figure::photo(
        "barrel",
        photo,
        format!(
            "{grid}, through the chapter's lens, k1 = {}. Notice how the outer lines bow.",
            truth.distortion.k1
        ),
    ));
    record.figure(Figure::photo(
        "pincushion",
        &photograph(&pincushion),
        format!("{grid}, with k1 = +{PINCUSHION_K1} and the same k2."),
    ));
    record.figure(Figure::photo("corrected-true", by_truth, "The barrel image corrected by inverse mapping with the true lens, levels mixed from four neighbours."));
    record.figure(Figure::photo(
        "corrected-plane",
        by_plane,
        format!("The same corrected with the lens that one facing view with noise of {SIGMA_PX} px gave (seed {seed})."),
    ));
    record.figure(Figure::photo("forward", forward, "The barrel image sent forwards, each pixel to where it belongs: black pixels received nothing. Notice the curves of holes towards the corners, where the lens had shrunk the scene most."));
    let deviations = |line: &Line| {
        line.points.iter().zip(&line.fit.deviations).map(|(p, d)| (p.x, *d)).collect::<Vec<_>>()
    };
    let before = Plot::new("Photograph", "u (px)", "deviation (px), down positive")
        .size(440.0, 360.0)
        .y_down()
        .points("top line", deviations(&lines[0]));
    let after = Plot::new("Corrected", "u (px)", "deviation (px), down positive")
        .size(440.0, 360.0)
        .y_down()
        .points("nearest sample", deviations(&lines[3]))
        .points("calibrated lens", deviations(&lines[2]))
        .points("true lens", deviations(&lines[1]))
        .hline("rounding to whole levels", rounding_px())
        .hline("", -rounding_px());
    let caption = format!(
        "The grid's top line as found in the levels of the images, {} columns: distance from its regression line, before and \
         after correction (lens calibrated with seed {seed}). Notice the two scales; that the calibrated lens bends the line at its ends, where no point of its \
         view was; and the steps of the nearest sample.",
        lines[0].points.len()
    );
    record.figure(Figure::panels("top-line", &[before, after], 2, caption));
}
