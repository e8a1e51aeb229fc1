//! What does a nine-point calibration of one undistorted image give, and why does another program give
//! something else?
//!
//! Expected (chapter, section 5.5): a detector for dense grids refuses nine dots, the centres of dark blobs
//! take over, and an affine map to the unit grid has scales of 0.0042332 and 0.0042338 units a pixel. The
//! vendor's GUI reports a translation that differs by 0.002 for the same image; the chapter blames rounding
//! to half pixels.
//!
//! The image is not available. A stand-in is rendered from the published size and spacings and from the
//! centre that follows from the published translation and scales; the matrix therefore must return them.
//! `--image FILE` takes the real one, or any other.
//!
//! What it cannot show: the residual of the real image, whose noise no stand-in has. Its shape is checked
//! instead: the ratio of largest to RMS residual does not depend on the size of the noise.

use calibench::detect::{GridError, circle_grid, sparse_dots};
use calibench::geometry::{Affine, Mat3, Vec2};
use calibench::io::image::{ImageError, parse_image};
use calibench::io::input::{MOST_IMAGE_BYTES, read_regular};
use calibench::io::memory::DEFAULT_MEMORY;
use calibench::io::overlay::Overlay;
use calibench::io::parse_extent;
use calibench::planar::{PlaneCalibration, PlaneModel, calibrate_plane};
use calibench::raster::Raster;
use calibench::synth::render::nine_dot_stand_in;
use calibench::synth::{Stream, StreamKey};
use calibench_harness::figure::Format;
use calibench_harness::published::{self, Entry};
use calibench_harness::stats::Interval;
use calibench_harness::{
    Band, Cell, Context, Experiment, ExperimentError, Figure, Look, Plot, Predicted, Record, Table,
};

mod book;
mod gui;
mod modes;
mod perspective;
mod shown;

use book::{
    claim_published_consistent, claim_residual_shape, claim_scales_differ, entry, reconcile, report_derived,
};
use gui::{GUI, explain_gui};
use modes::{modes_table, report_geometry, report_planar, residual_table};
use perspective::judge_perspective;
use shown::Shown;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "nine-point",
    title: "Nine-point calibration, and half a pixel between two programs",
    question: "An image of 3 x 3 dark dots (a stand-in rendered from the published geometry, or --image \
               FILE) is mapped to the unit grid by an affine map, a projective map and a similarity. Do \
               matrix and scales agree with the chapter's, and what explains the 0.002 by which the \
               vendor's GUI differs? Expected: scales 0.0042332 and 0.0042338; dense-grid detection refuses \
               nine dots; the GUI's numbers are those of centres rounded to half pixels.",
    seed: 1,
    takes_image: true,
    run,
};

/// The SDK's modes 0, 1 and 2.
const MODES: [(&str, PlaneModel); 3] = [
    ("planar", PlaneModel::Affine),
    ("tilted", PlaneModel::Projective),
    ("similarity", PlaneModel::Similarity),
];

/// Size of the published image.
const PUBLISHED_SIZE: (usize, usize) = (1571, 1053);
/// Published spacings along u and v, px; printed to 0.01.
const SPACING_PX: (f64, f64) = (236.23, 236.19);
/// Largest error of a dot's centre from rounding to 8 bits, if all roundings conspire: about 236 edge pixels
/// of a dot of 59 px diameter, half a level of the contrast's 191 each, at a mean distance of 18.8 px, over
/// an area of 2739 px.
const DETECTION_PX: f64 = 0.005;
/// Rounding of a fit of nine points: coordinates near 1000 px carry 1.1e-13 px, some tens of operations.
const ROUNDING: f64 = 1e-11;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let shown = Shown::new(context, &mut record)?;
    claim_refusal(&mut record, &shown.image);
    let grid = sparse_dots(&shown.image, 3, 3)
        .map_err(|error| ExperimentError::Input(format!("nine dots: {error}")))?;
    let centres = grid.centres_px();
    let fits = MODES
        .iter()
        .map(|(_, model)| calibrate_plane(*model, &centres, &unit_grid()))
        .collect::<Result<Vec<_>, _>>()
        .map_err(ExperimentError::at("plane calibration"))?;

    report_geometry(&mut record, &shown.image, &centres, shown.band());
    report_planar(&mut record, &fits[0], shown.band());
    record.table(modes_table(&fits)?);
    record.table(residual_table(&centres, &fits));
    claim_nesting(&mut record, &fits);
    if let Some(centres_true) = &shown.centres_true {
        claim_stand_in(&mut record, &centres, centres_true, &fits[2]);
    }
    claim_published_consistent(&mut record)?;
    claim_residual_shape(&mut record, context)?;
    report_derived(&mut record)?;
    claim_scales_differ(&mut record)?;
    judge_perspective(&mut record)?;
    if shown.is_published() {
        explain_gui(&mut record, &centres, &fits[0], shown.band())?;
        reconcile(&mut record, shown.stand_in_text())?;
    }
    record.figure(marks_figure(&shown, &centres)?);
    record.figure(residual_figure(&centres, &fits, shown.name()));
    Ok(record)
}

/// World coordinates of the dots, row by row from the top left: (-1, 1) ... (1, -1), y up.
fn unit_grid() -> Vec<Vec2> {
    (0..9).map(|i| Vec2::new(f64::from(i % 3) - 1.0, 1.0 - f64::from(i / 3))).collect()
}

fn claim_refusal(record: &mut Record, image: &Raster<f32>) {
    let answer = circle_grid(image, 3, 3);
    let text = answer.as_ref().map_or_else(ToString::to_string, |_| "accepted".to_string());
    record.note(format!("The detector for dense grids says of nine dots: {text}"));
    record
        .claim_that(
            "dense-grid-refuses",
            "the detector for dense grids refuses a 3 x 3 board with a typed error that names the detector \
             to use",
        )
        .every(
            "cases",
            [(text, matches!(answer, Err(GridError::TooFewForGrid { columns: 3, rows: 3, found: 9, .. })))],
        )
        .because(
            "three marks in a row leave one step to confirm another: too few to tell a grid from chance",
        );
}

fn mean(points: &[Vec2]) -> Vec2 {
    points.iter().sum::<Vec2>() / points.len() as f64
}

fn claim_nesting(record: &mut Record, fits: &[PlaneCalibration]) {
    let [planar, tilted, similarity] = [fits[0].rms_point, fits[1].rms_point, fits[2].rms_point];
    let cases = [
        ("similarity <= planar", planar <= similarity + ROUNDING),
        ("planar <= tilted", tilted <= planar + ROUNDING),
    ];
    record
        .claim_that("families-nest", "each family that holds another fits at least as well")
        .every("cases", cases)
        .because(
            "a similarity is an affine map, an affine map is projective; all minimise the same sum of \
             squares",
        );
}

fn claim_stand_in(
    record: &mut Record,
    centres: &[Vec2],
    centres_true: &[Vec2],
    similarity: &PlaneCalibration,
) {
    let worst = centres.iter().zip(centres_true).map(|(c, t)| (c - t).amax()).fold(0.0, f64::max);
    let reason = "rounding to 8 bits: half a level of 191 on 236 edge pixels, if all conspire";
    let statement = "every dot's centre is found where it was rendered";
    record.claim_that("centres-are-true", statement).at_most(worst, DETECTION_PX).unit("px").because(reason);
    // u = p X, v = -q Y: the best common scale is (p + q) / (p^2 + q^2), and mean X^2 = mean Y^2 = 2/3.
    let (p, q) = SPACING_PX;
    let scale = (p + q) / (p * p + q * q);
    let theory =
        (2.0 / 3.0 * ((scale * p - 1.0) * (scale * p - 1.0) + (scale * q - 1.0) * (scale * q - 1.0))).sqrt();
    let units = std::f64::consts::SQRT_2 * DETECTION_PX * scale;
    record
        .claim_that(
            "similarity-residual",
            "a similarity leaves what the two spacings differ by, as its closed form says",
        )
        .within(similarity.rms_point, Interval::around(theory, units))
        .because("closed form for spacings 236.23 and 236.19 px; detection error of every centre");
}

fn marks_figure(shown: &Shown, centres: &[Vec2]) -> Result<Figure, ExperimentError> {
    let mut overlay = Overlay::new(&shown.image.to_u8(), 1);
    overlay.grid(centres, 3);
    for &centre in centres {
        overlay.cross(centre, 12.0, [255, 60, 60]);
    }
    Ok(Figure {
        name: if shown.centres_true.is_some() { "stand-in-marks" } else { "marks" }.to_string(),
        caption: format!(
            "The nine dots as found ({}): crosses at the centres, rows joined in their order, the first dot \
             circled. Notice that no dense-grid detector is needed for nine dots.",
            if shown.centres_true.is_some() {
                "a stand-in rendered from the published geometry, not the published image"
            } else {
                "image given"
            }
        ),
        format: Format::Png,
        bytes: overlay.png().map_err(ExperimentError::at("overlay"))?,
        reproducible: true,
    })
}

fn residual_figure(centres: &[Vec2], fits: &[PlaneCalibration], name: &str) -> Figure {
    let panels: Vec<Plot> = MODES
        .iter()
        .zip(fits)
        .map(|((mode, _), fit)| {
            // A largest arrow of 0.2 units shows, whatever the residuals' size.
            let enlarge = libm::exp10(libm::floor(libm::log10(0.3 / fit.max_point.max(1e-12))));
            let dots = unit_grid();
            let arrows =
                dots.iter().zip(&fit.residuals).map(|(w, r)| (w.x, w.y, enlarge * r.x, enlarge * r.y));
            Plot::new(format!("{mode}: RMS {:.2e}", fit.rms_point), "x", "y")
                .size(340.0, 350.0)
                .equal_aspect()
                .x_range(-1.5, 1.5)
                .y_range(-1.8, 1.5)
                .points_as("target", dots.iter().map(|w| (w.x, w.y)), Look::ink())
                .arrows("residual", arrows)
                .arrows(format!("this long: {:.0e} units", 0.2 / enlarge), [(-1.0, -1.6, 0.2, 0.0)])
        })
        .collect();
    let caption = format!(
        "Residuals of the three modes at the nine target points ({name}, {} centres), target units. Notice \
         the scales, and that a similarity leaves the difference of the two spacings.",
        centres.len()
    );
    Figure::panels("residuals", &panels, 3, caption)
}
