//! Which checks notice that a point call answers in pixels, not millimetres?

use super::black_box::BlackBox;
use super::{FREE, SIGMA_PX};
use calibench::camera::Camera;
use calibench::geometry::{Affine, LineFit, Vec2};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench_harness::stats::Interval;
use calibench_harness::{Band, ExperimentError, Figure, Plot, Record, Table};

/// Distances of the facing target, mm: 60, 80, ..., 800. At 600 a pixel is a millimetre.
const DISTANCE_TWENTIES_MM: std::ops::RangeInclusive<u32> = 3..=40;
/// Points of a row of the target.
const ROW: usize = 9;

/// What four checks say of points that are taken for millimetres.
pub(crate) struct Checks {
    distance_mm: f64,
    /// RMS difference between answer and target point.
    direct: f64,
    /// Mean spacing of neighbours over the true spacing.
    spacing_ratio: f64,
    /// RMS residual of an affine map from answer to target, mm.
    affine_mm: f64,
    /// Largest distance of a point of the top row from its line.
    collinearity: f64,
}

/// The black box of one noisy calibration, and the checks on exact points at every distance.
pub(crate) struct Examined {
    /// With the true camera, at the chapter's distance.
    chapter: Checks,
    /// With the calibrated black box.
    black_box: Checks,
    sweep: Vec<Checks>,
}

pub(crate) fn examine(seed: u64) -> Result<Examined, ExperimentError> {
    let mut stream = Stream::open(StreamKey { seed, scenario: "units", trial: 0, purpose: "noise" });
    let views = Scene::example().observe(SIGMA_PX, &mut stream);
    let black_box =
        BlackBox::calibrate(&views, FREE).map_err(ExperimentError::at("calibration in the black box"))?;
    let truth = Truth::example_camera();
    let exact = |distance| checks(distance, |pixel| truth.correct_pixel(pixel));
    let sweep = DISTANCE_TWENTIES_MM.map(|twenties| exact(20.0 * f64::from(twenties)));
    Ok(Examined {
        chapter: exact(120.0)?,
        black_box: checks(120.0, |pixel| black_box.correct_point(pixel))?,
        sweep: sweep.collect::<Result<_, _>>()?,
    })
}

/// Shows the facing target from a distance, corrects every pixel and takes the answer for millimetres.
fn checks<E: std::error::Error + Send + Sync + 'static>(
    distance_mm: f64,
    correct: impl Fn(&Vec2) -> Result<Vec2, E>,
) -> Result<Checks, ExperimentError> {
    let facing = vec![looking_at_centre([0.0; 3], distance_mm)];
    let scene = Scene::new(Truth { cam_from_target: facing, ..Truth::example() });
    let scene = scene.map_err(ExperimentError::at("scene of the facing target"))?;
    let points = &scene.truth.points;
    let answers = scene.pixels()[0].iter().map(correct).collect::<Result<Vec<Vec2>, E>>();
    let answers = answers.map_err(ExperimentError::at("point call"))?;
    let map = Affine::fit(&answers, points).map_err(ExperimentError::at("affine fit"))?;
    let row = LineFit::new(&answers[..ROW]).map_err(ExperimentError::at("line fit"))?;
    let length = |row: &[Vec2]| row.windows(2).map(|p| (p[1] - p[0]).norm()).sum::<f64>();
    Ok(Checks {
        distance_mm,
        direct: rms(answers.iter().zip(points).map(|(a, p)| a - p)),
        spacing_ratio: length(&answers[..ROW]) / length(&points[..ROW]),
        affine_mm: rms(answers.iter().zip(points).map(|(a, p)| map.apply(a) - p)),
        collinearity: row.max_deviation(),
    })
}

fn rms(differences: impl ExactSizeIterator<Item = Vec2>) -> f64 {
    let n = differences.len() as f64;
    (differences.map(|d| d.norm_squared()).sum::<f64>() / n).sqrt()
}

/// Coordinates below 1000 carry roundings of `2^-44` in each of some 60 operations of projection and
/// correction.
const ROUNDING: f64 = 60.0 * 5.7e-14;

pub(crate) fn report(record: &mut Record, examined: &Examined) {
    let rounding = || Band::absolute(ROUNDING, "60 roundings of coordinates below 1000");
    // The solver stops within 1e-6 standard deviations of the minimum, and a corrected point moves by less
    // than a pixel a standard deviation.
    let stop = || Band::absolute(1e-6, "where the solver stops");
    let Examined { chapter, black_box, sweep } = examined;
    let affine = "RMS residual of an affine fit of the black box's answer";
    let farthest = "largest distance from the top row's line, black box";
    record
        .group("", rounding())
        .number("units-direct", chapter.direct, "RMS of corrected pixels minus millimetres, true camera")
        .band(stop())
        .number("units-direct-box", black_box.direct, "the same from the black box")
        .band(rounding())
        .number("units-spacing-ratio", chapter.spacing_ratio, "spacing of the answer over the target's")
        .group("mm", stop())
        .number("units-affine-mm", black_box.affine_mm, affine)
        .unit("")
        .number("units-collinearity", black_box.collinearity, farthest);

    let caption = "what four checks say when corrected pixels are taken for millimetres, target facing the \
                   camera, no noise";
    record.table(
        Table::of("units", caption, sweep)
            .column("distance", "mm", |c| c.distance_mm)
            .column("difference", "", |c| c.direct)
            .column("spacing_ratio", "", |c| c.spacing_ratio)
            .column("affine_residual", "mm", |c| c.affine_mm)
            .column("collinearity", "", |c| c.collinearity),
    );

    let expected = expected_difference(&Truth::example_camera(), 120.0);
    let reason = "sqrt(cx^2 + cy^2 + (f/Z - 1)^2 (mean X^2 + mean Y^2)) of a centred grid, by hand; rounding";
    let statement = "the difference of pixels and millimetres is that of the geometry";
    record
        .claim_that("units-difference", statement)
        .within(chapter.direct, Interval::around(expected, ROUNDING))
        .because(reason);
    let ratios = sweep.iter().map(|c| {
        let expected = Truth::example_camera().fx / c.distance_mm;
        let held = (c.spacing_ratio - expected).abs() <= ROUNDING;
        (format!("{} mm: ratio {}, expected {expected}", c.distance_mm, c.spacing_ratio), held)
    });
    record
        .claim_that(
            "spacing-shows-the-scale",
            "the spacing check sees the scale f / Z: blind only where a pixel is a millimetre",
        )
        .every("distances", ratios.collect::<Vec<_>>())
        .because("a facing plane is seen at f / Z px a mm");
    let blind = sweep.iter().map(|c| {
        (
            format!("{} mm: {} mm, {}", c.distance_mm, c.affine_mm, c.collinearity),
            c.affine_mm.max(c.collinearity) <= ROUNDING,
        )
    });
    record
        .claim_that("fits-are-blind", "an affine fit and a collinearity check see nothing at any distance")
        .every("cases", blind.collect::<Vec<_>>())
        .because("both are invariant under a change of scale; rounding");

    let error_percent = |c: &Checks| 100.0 * (c.spacing_ratio - 1.0).abs();
    let one_to_one = Truth::example_camera().fx;
    let off = |c: &Checks| (c.distance_mm - one_to_one).abs();
    let nearest = sweep.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(chapter);
    let panel = |title: &str, label: &str, check: &dyn Fn(&Checks) -> f64| {
        Plot::new(title, "distance of the target (mm)", label)
            .size(440.0, 360.0)
            .line("what the check shows", sweep.iter().map(|c| (c.distance_mm, check(c))))
            .vline("one pixel a millimetre", one_to_one)
    };
    let difference = panel("Compared with the target", "difference (\u{201c}mm\u{201d})", &|c| c.direct)
        .y_range(0.0, 550.0);
    let spacing = panel("Spacing of neighbours", "error (%)", &error_percent);
    let caption = format!(
        "RMS difference of corrected pixels and target millimetres, and error of the spacing of neighbours, \
         against the distance of a facing target; nothing is drawn at random. Notice that at \
         {} mm, where a pixel is {:.0} mm on the target, the difference is {:.0} and the spacing {:.1} % \
         off.",
        nearest.distance_mm,
        nearest.distance_mm / one_to_one,
        nearest.direct,
        error_percent(nearest)
    );
    record.figure(Figure::panels("units", &[difference, spacing], 2, caption));
}

/// By hand: corrected pixel `f/Z X + cx` minus `X`, over a centred grid of 9 x 7 points 10 mm apart, whose
/// mean squares are `(n^2 - 1) / 12` spacings squared.
fn expected_difference(camera: &Camera, distance_mm: f64) -> f64 {
    let mean_square = |n: f64| 100.0 * (n * n - 1.0) / 12.0;
    let scale = camera.fx / distance_mm - 1.0;
    let grid = scale * scale * (mean_square(9.0) + mean_square(7.0));
    (camera.cx * camera.cx + camera.cy * camera.cy + grid).sqrt()
}
