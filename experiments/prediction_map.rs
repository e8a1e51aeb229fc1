//! Where in the image is a calibration good? The error of what it predicts, over the frame.
//!
//! The parameters of the chapter's table 5.1 are off by many times what a measurement needs, and the chapter
//! says that predictions within the covered region cannot be told from the truth's all the same (section
//! 5.3). So the published camera, and many calibrations of the same scene, are compared with the truth pixel
//! by pixel.
//!
//! What "prediction" means decides. A camera may be used for points at the target's distance: then a motion
//! of the camera makes up for some of its errors, and it may be used for directions: then only a turn does.
//! Expected: at the target's distance, as far out as points were seen, predictions are off by less than the
//! noise of a single point, although k2 is off by a third; farther out they are not. For directions they are
//! off by more even within, because a focal length that is wrong is made up for by the distance, and a
//! direction has none.
//!
//! What it cannot show: errors of a lens that the model does not describe. They are largest outside as well.

use calibench::calibrate::{Covariance, Settings};
use calibench::camera::{Camera, FreeParameters, Parameter};
use calibench::evaluate::{FrameDifference, TakenOut, cramer_rao, frame_difference};
use calibench::geometry::Vec2;
use calibench::synth::{Scene, Truth};
use calibench_harness::stats::{Interval, largest, mean, root_mean_square};
use calibench_harness::{
    Band, Context, Dash, Experiment, ExperimentError, Figure, HeatMap, Look, MonteCarlo, Plot, Record, Table,
    published,
};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "prediction-map",
    title: "Where in the image a calibration is good",
    question: "The chapter's k2 is off by a third. By how many pixels is its camera off, where, and does the \
               Cramer-Rao bound predict that? Expected: less than the noise of a point as far out as points \
               were seen, several times more in the corners.",
    seed: 1,
    takes_image: false,
    run,
};

/// Noise on each of u and v.
const SIGMA_PX: f64 = 0.1;
const TRIALS: usize = 1000;
/// Chance that a correct program fails one claim.
const RATE: f64 = 1e-4;
/// Change of a parameter for a difference quotient, in its standard deviations: small against what bends, and
/// large against rounding.
const STEP: f64 = 1e-3;
/// Cells of the maps.
const COLUMNS: usize = 10;
const ROWS: usize = 8;
/// Rings around the principal point, in which errors are averaged for the figure.
const RING_PX: f64 = 20.0;

/// What the camera is used for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Use {
    AtTarget,
    Directions,
}

impl Use {
    const ALL: [Use; 2] = [Use::AtTarget, Use::Directions];

    fn name(self) -> &'static str {
        match self {
            Use::AtTarget => "at-target",
            Use::Directions => "directions",
        }
    }

    fn words(self) -> &'static str {
        match self {
            Use::AtTarget => "points at the target's distance",
            Use::Directions => "directions",
        }
    }

    /// What no calibration can tell for this use, and what is therefore no error.
    fn taken_out(self) -> TakenOut {
        match self {
            Use::AtTarget => {
                TakenOut::RotationAndTranslation { distance: Truth::example_poses()[0].translation.z }
            }
            Use::Directions => TakenOut::Rotation,
        }
    }
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let scene = Scene::example();
    let truth = scene.truth.camera;
    let bound = cramer_rao(&scene.truth, FreeParameters::STANDARD, SIGMA_PX)
        .map_err(ExperimentError::at("Cramer-Rao bound"))?;
    let covered_px = covered_px(&scene);
    let progress = context.progress("calibrations", TRIALS);
    let settings = Settings::standard();
    let draws = MonteCarlo {
        scene: &scene,
        settings: &settings,
        sigma_px: SIGMA_PX,
        seed: context.seed,
        scenario: "prediction-map",
        trials: TRIALS,
    };
    let outcome = draws.run(&progress);
    drop(progress);
    let compared = Use::ALL
        .into_iter()
        .map(|of| {
            let estimates = outcome.estimates.iter().map(|e| moved(&truth, &e.errors));
            Ok(Compared {
                of,
                predicted: Predicted::new(&truth, &bound, of)?,
                book: map_of(&truth, &book_camera()?, of)?,
                trials: estimates.map(|camera| map_of(&truth, &camera, of)).collect::<Result<_, _>>()?,
            })
        })
        .collect::<Result<Vec<Compared>, ExperimentError>>()?;
    report_lens_alone(&mut record, covered_px)?;
    let regions: Vec<Found> = compared.iter().flat_map(|c| c.regions(covered_px)).collect();
    report_regions(&mut record, &regions, covered_px);
    claim_uses(&mut record, &regions);
    claim_theory(&mut record, &regions);
    claim_book(&mut record, &regions);
    for c in &compared {
        record.table(ring_table(c));
    }
    record.figure(map_figure(&compared)?);
    record.figure(ring_figure(&compared, covered_px, context.seed));
    Ok(record)
}

/// The errors over the frame for one use of the camera.
struct Compared {
    of: Use,
    predicted: Predicted,
    book: FrameDifference,
    trials: Vec<FrameDifference>,
}

impl Compared {
    fn regions(&self, covered_px: f64) -> [Found; 2] {
        [Region::Covered, Region::Beyond].map(|region| {
            let rms = |map: &FrameDifference| root_mean_square(region.errors(map, covered_px));
            Found {
                of: self.of,
                region,
                predicted_px: self.predicted.rms_px(region, covered_px),
                book_px: rms(&self.book),
                trials_px: self.trials.iter().map(rms).collect(),
            }
        })
    }
}

/// How far from the principal point the farthest point of the target is seen, px.
fn covered_px(scene: &Scene) -> f64 {
    let camera = &scene.truth.camera;
    let centre = Vec2::new(camera.cx, camera.cy);
    largest(scene.pixels().iter().flatten().map(|pixel| (pixel - centre).norm()))
}

/// The chapter's camera of table 5.1.
fn book_camera() -> Result<Camera, ExperimentError> {
    use Parameter::{Cx, Cy, Fx, Fy, K1, K2};
    let mut camera = Truth::example_camera();
    for (parameter, name) in [(Fx, "fx"), (Fy, "fy"), (Cx, "cx"), (Cy, "cy"), (K1, "k1"), (K2, "k2")] {
        let entry = published::entry("four-pose", name).map_err(ExperimentError::at("published values"))?;
        camera = camera.with(parameter, entry.value());
    }
    Ok(camera)
}

fn moved(truth: &Camera, errors: &[f64]) -> Camera {
    let free: Vec<Parameter> =
        Parameter::ALL.into_iter().filter(|&p| FreeParameters::STANDARD.contains(p)).collect();
    free.iter().zip(errors).fold(*truth, |camera, (&p, error)| camera.with(p, truth.get(p) + error))
}

/// What the estimate predicts less the truth, pixel by pixel.
fn map_of(truth: &Camera, estimate: &Camera, of: Use) -> Result<FrameDifference, ExperimentError> {
    frame_difference(truth, estimate, Truth::EXAMPLE_IMAGE, of.taken_out())
        .map_err(ExperimentError::at("difference over the frame"))
}

/// Part of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Region {
    Covered,
    Beyond,
}

impl Region {
    fn name(self) -> &'static str {
        match self {
            Region::Covered => "covered",
            Region::Beyond => "beyond",
        }
    }

    fn has(self, pixel: &Vec2, covered_px: f64) -> bool {
        (radius_px(pixel) <= covered_px) == (self == Region::Covered)
    }

    /// Lengths of the errors in this region.
    fn errors(self, map: &FrameDifference, covered_px: f64) -> impl Iterator<Item = f64> {
        let here = map.nodes.iter().filter(move |node| self.has(&node.pixel, covered_px));
        here.map(|node| node.difference.norm())
    }
}

/// Distance from the principal point of the truth.
fn radius_px(pixel: &Vec2) -> f64 {
    let camera = Truth::example_camera();
    (pixel - Vec2::new(camera.cx, camera.cy)).norm()
}

/// What the bound says of every pixel.
struct Predicted {
    /// Pixel, and the root of the mean squared error there, px.
    nodes: Vec<(Vec2, f64)>,
}

impl Predicted {
    /// To first order the error at a pixel is `G (estimate - truth)`, with the derivatives `G` of the pixel
    /// by the parameters, the motion that fits best taken out, and its mean square is the trace of `G P G^T`.
    /// `G` comes from difference quotients of the same comparison.
    fn new(truth: &Camera, bound: &Covariance, of: Use) -> Result<Predicted, ExperimentError> {
        let sd = |p: Parameter| bound.standard_deviation(p).unwrap_or(0.0);
        let free: Vec<Parameter> =
            Parameter::ALL.into_iter().filter(|&p| FreeParameters::STANDARD.contains(p)).collect();
        let columns = free
            .iter()
            .map(|&p| {
                let map = map_of(truth, &truth.with(p, truth.get(p) + STEP * sd(p)), of)?;
                Ok(map.nodes.into_iter().map(|n| (n.pixel, n.difference / (STEP * sd(p)))).collect())
            })
            .collect::<Result<Vec<Vec<(Vec2, Vec2)>>, ExperimentError>>()?;
        let mean_square = |node: usize| -> f64 {
            let pairs = (0..free.len()).flat_map(|i| (0..free.len()).map(move |j| (i, j)));
            pairs.map(|(i, j)| bound.intrinsics[(i, j)] * columns[i][node].1.dot(&columns[j][node].1)).sum()
        };
        let nodes =
            (0..columns[0].len()).map(|node| (columns[0][node].0, mean_square(node).sqrt())).collect();
        Ok(Predicted { nodes })
    }

    fn rms_px(&self, region: Region, covered_px: f64) -> f64 {
        root_mean_square(
            self.nodes.iter().filter(|(p, _)| region.has(p, covered_px)).map(|(_, error)| *error),
        )
    }
}

/// Errors in a part of the frame, for one use.
struct Found {
    of: Use,
    region: Region,
    predicted_px: f64,
    book_px: f64,
    /// Of each trial.
    trials_px: Vec<f64>,
}

/// How far k1 and k2 of the published camera alone move a pixel, everything else being true.
fn report_lens_alone(record: &mut Record, covered_px: f64) -> Result<(), ExperimentError> {
    let truth = Truth::example_camera();
    let book = truth.with_distortion(book_camera()?.distortion);
    let (width, height) = Truth::EXAMPLE_IMAGE;
    // The corner farthest from the principal point.
    let corner = Vec2::new(-0.5, height as f64 - 0.5);
    let ray = |pixel: &Vec2| truth.normalised_ray(pixel).map_err(ExperimentError::at("ray of a pixel"));
    let shift = |pixel: &Vec2| -> Result<f64, ExperimentError> {
        let ideal = truth.pixel_from_normalised(&ray(pixel)?);
        Ok((book.distort_pixel(&ideal) - pixel).norm())
    };
    // The lens is radial: one line from the principal point shows all.
    let along = |radius: f64| shift(&Vec2::new(truth.cx - radius, truth.cy));
    let inside =
        (0..=100).map(|k| along(covered_px * f64::from(k) / 100.0)).collect::<Result<Vec<_>, _>>()?;
    record
        .group("px", converged())
        .number(
            "lens-alone-covered",
            largest(inside),
            "largest shift by k1 and k2 of table 5.1 alone, as far out as points are seen",
        )
        .number("lens-alone-corner", shift(&corner)?, "the same in the farthest corner of the image")
        .number("corner-radius", radius_px(&corner), "distance of that corner from the principal point")
        .unit("")
        .number(
            "corner-radius-normalised",
            ray(&corner)?.norm(),
            "its radius in normalised coordinates, without distortion",
        )
        .number(
            "covered-radius-normalised",
            ray(&Vec2::new(truth.cx - covered_px, truth.cy))?.norm(),
            "normalised radius of the farthest point, without distortion",
        );
    let share = covered_share(width, height, covered_px);
    record.exact("").number(
        "covered-share",
        share,
        "share of the image's pixels that lie as near to the principal point as points are seen",
    );
    Ok(())
}

fn covered_share(width: usize, height: usize, covered_px: f64) -> f64 {
    let pixels = (0..height).flat_map(|v| (0..width).map(move |u| Vec2::new(u as f64, v as f64)));
    pixels.filter(|pixel| radius_px(pixel) <= covered_px).count() as f64 / (width * height) as f64
}

/// Numbers that rest on converged estimates.
fn converged() -> Band {
    Band::relative(1e-6, "refinement converges to 1e-6 of a standard deviation")
}

fn report_regions(record: &mut Record, regions: &[Found], covered_px: f64) {
    record
        .group("px", converged())
        .number("covered-radius", covered_px, "distance of the farthest point from the principal point")
        .number("sigma", SIGMA_PX, "noise on each of u and v");
    record.exact("").count("trials", TRIALS, "calibrations with noise of their own");
    for found in regions {
        record
            .group("px", converged())
            .suffix(
                format!("-{}-{}", found.of.name(), found.region.name()),
                format!(", {}, {}", found.of.words(), found.region.name()),
            )
            .number(
                "predicted",
                found.predicted_px,
                "root mean square error of a predicted pixel by the bound",
            )
            .number("trials", root_mean_square(found.trials_px.iter().copied()), "the same over the trials")
            .number("book", found.book_px, "the same of the camera of table 5.1")
            .unit("")
            .number(
                "farther-than-book",
                found.farther_than_book(),
                "share of the trials that are farther off than the camera of table 5.1",
            );
    }
}

impl Found {
    fn farther_than_book(&self) -> f64 {
        self.trials_px.iter().filter(|&&e| e > self.book_px).count() as f64 / self.trials_px.len() as f64
    }

    fn name(&self) -> String {
        format!("{}, {}", self.of.words(), self.region.name())
    }
}

/// Against the noise of a single point, root of two sigma.
fn claim_uses(record: &mut Record, regions: &[Found]) {
    let noise = SIGMA_PX * std::f64::consts::SQRT_2;
    let [inside, beyond, directions, _] = regions else { return };
    record
        .claim_that(
            "covered-below-the-noise",
            "at the target's distance, as far out as points were seen, a pixel is predicted better than a single point is measured",
        )
        .at_most(inside.predicted_px, noise)
        .unit("px")
        .because("the noise of one point, root of two sigma; the bound, nothing drawn");
    record
        .claim_that("book-covered-below-the-noise", "so it is with the camera of table 5.1")
        .at_most(inside.book_px, noise)
        .unit("px")
        .because("the same noise; printed values, nothing drawn");
    record
        .claim_that("beyond-is-worse", "farther out the bound is more than twice as large")
        .at_least(beyond.predicted_px / inside.predicted_px, 2.0)
        .because(
            "terms of the third and fifth power of the radius, which is 1.5 times as large in the corners",
        );
    record
        .claim_that(
            "directions-exceed-the-noise",
            "as directions, pixels of the camera of table 5.1 are off by more than the noise of a point",
        )
        .at_least(directions.book_px, noise)
        .unit("px")
        .because("the same noise; printed values, nothing drawn");
}

/// The mean squared errors of the trials against the bound.
fn claim_theory(record: &mut Record, regions: &[Found]) {
    let cases = regions.iter().map(|found| {
        let squares: Vec<f64> = found.trials_px.iter().map(|e| e * e).collect();
        let ratio: Vec<f64> = squares.iter().map(|s| s / (found.predicted_px * found.predicted_px)).collect();
        let average = mean(&ratio);
        let spread = root_mean_square(ratio.iter().map(|r| r - average));
        let interval = Interval::of_mean(1.0, spread, ratio.len(), RATE / regions.len() as f64);
        (format!("{}: {average:.3} of the bound", found.name()), interval.contains(average))
    });
    record
        .claim_that("errors-are-those-of-the-bound", "mean squared errors of predicted pixels are those of the bound")
        .every("parts", cases)
        .at_rate(RATE)
        .because("their mean over the trials is normal, with the spread of the trials over the root of their number");
}

/// The published camera among the trials.
fn claim_book(record: &mut Record, regions: &[Found]) {
    let cases = regions.iter().map(|found| {
        let share = found.farther_than_book();
        (format!("{}: {share:.3} of the trials are farther off", found.name()), share > 0.0)
    });
    record
        .claim_that(
            "book-is-one-of-the-trials",
            "the camera of table 5.1 is no farther off than some of the trials",
        )
        .every("parts", cases)
        .at_rate(regions.len() as f64 / (TRIALS + 1) as f64)
        .because("one draw more is the farthest of all with probability 1 / (trials + 1), in each part");
}

/// A ring around the principal point: its middle, the errors in it.
struct Ring {
    radius_px: f64,
    predicted_px: f64,
    book_px: f64,
    trials_px: f64,
}

impl Compared {
    fn rings(&self) -> Vec<Ring> {
        let ring_of = |pixel: &Vec2| (radius_px(pixel) / RING_PX) as usize;
        let in_ring = |map: &FrameDifference, k: usize| -> Vec<f64> {
            map.nodes.iter().filter(|n| ring_of(&n.pixel) == k).map(|n| n.difference.norm()).collect()
        };
        let predicted =
            |k: usize| self.predicted.nodes.iter().filter(move |(p, _)| ring_of(p) == k).map(|n| n.1);
        let last = self.predicted.nodes.iter().map(|(p, _)| ring_of(p)).max().unwrap_or(0);
        (0..=last)
            .filter(|&k| predicted(k).next().is_some())
            .map(|k| Ring {
                radius_px: (k as f64 + 0.5) * RING_PX,
                predicted_px: root_mean_square(predicted(k)),
                book_px: root_mean_square(in_ring(&self.book, k)),
                trials_px: root_mean_square(self.trials.iter().flat_map(|map| in_ring(map, k))),
            })
            .collect()
    }
}

fn ring_table(compared: &Compared) -> Table {
    let caption = format!(
        "root mean square error of a predicted pixel in rings around the principal point, {}",
        compared.of.words()
    );
    Table::of(format!("rings-{}", compared.of.name()), caption, &compared.rings())
        .column("radius", "px", |ring| ring.radius_px)
        .column("bound", "px", |ring| ring.predicted_px)
        .column("trials", "px", |ring| ring.trials_px)
        .column("book", "px", |ring| ring.book_px)
        .into()
}

/// What the bound predicts, and the published camera's error, for both uses.
fn map_figure(compared: &[Compared]) -> Result<Figure, ExperimentError> {
    let (width, height) = Truth::EXAMPLE_IMAGE;
    let cell = |pixel: &Vec2| {
        let column = ((pixel.x + 0.5) * COLUMNS as f64 / width as f64) as usize;
        // The first row of a heat map is at its bottom.
        let row = ROWS - 1 - ((pixel.y + 0.5) * ROWS as f64 / height as f64) as usize;
        row * COLUMNS + column
    };
    let over_cells = |values: &[(Vec2, f64)]| -> Vec<f64> {
        let here = |k: usize| values.iter().filter(move |(p, _)| cell(p) == k).map(|v| v.1);
        (0..COLUMNS * ROWS).map(|k| root_mean_square(here(k))).collect()
    };
    let middles = |count: usize, side: usize| -> Vec<String> {
        (0..count).map(|k| format!("{:.0}", (k as f64 + 0.5) * side as f64 / count as f64)).collect()
    };
    let rows: Vec<String> = middles(ROWS, height).into_iter().rev().collect();
    let panel = |title: String, values: &[(Vec2, f64)]| -> Result<Plot, ExperimentError> {
        let heat = HeatMap::new("error (px)", middles(COLUMNS, width), rows.clone(), over_cells(values))
            .map_err(ExperimentError::at("heat map"))?;
        let heat = heat.logarithmic().range(0.02, 1.5).decimals(2);
        Ok(Plot::heat_map(title, "u (px)", "v (px)", heat).size(560.0, 400.0))
    };
    let mut panels = Vec::new();
    for c in compared {
        let book: Vec<(Vec2, f64)> = c.book.nodes.iter().map(|n| (n.pixel, n.difference.norm())).collect();
        panels.push(panel(format!("Bound, {}", c.of.words()), &c.predicted.nodes)?);
        panels.push(panel(format!("Table 5.1, {}", c.of.words()), &book)?);
    }
    let caption = format!(
        "Root mean square error of a predicted pixel over the frame: what the Cramer-Rao bound predicts for noise of \
         {SIGMA_PX} px, and the camera of the chapter's table 5.1 against the truth; for points at the target's distance, \
         where any motion of the camera is taken out, and for directions, where a rotation is. Notice the broad middle of \
         the upper maps, as far as points were seen, and that for directions there is none."
    );
    Ok(Figure::panels("maps", &panels, 2, caption))
}

fn ring_figure(compared: &[Compared], covered_px: f64, seed: u64) -> Figure {
    let noise = SIGMA_PX * std::f64::consts::SQRT_2;
    let panel = |c: &Compared| {
        let rings = c.rings();
        let words = c.of.words();
        let title = format!("{}{}", words[..1].to_uppercase(), &words[1..]);
        Plot::new(title, "distance from the principal point (px)", "error (px, root mean square)")
            .size(460.0, 400.0)
            .log_y()
            .y_range(0.02, 2.0)
            .line("bound", rings.iter().map(|r| (r.radius_px, r.predicted_px)))
            .points(format!("{TRIALS} trials"), rings.iter().map(|r| (r.radius_px, r.trials_px)))
            .points("camera of table 5.1", rings.iter().map(|r| (r.radius_px, r.book_px)))
            .hline("noise of one point", noise)
            .vline_as("farthest point of the target", covered_px, Look::ink().dash(Dash::Dotted))
    };
    let panels: Vec<Plot> = compared.iter().map(panel).collect();
    let caption = format!(
        "Root mean square error of a predicted pixel in rings of {RING_PX} px around the principal point: bound, {TRIALS} \
         calibrations (seed {seed}, sigma {SIGMA_PX} px) and the camera of table 5.1. Notice where the curves cross the \
         noise of a point."
    );
    Figure::panels("rings", &panels, 2, caption)
}
