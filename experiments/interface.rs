//! Which data with known answers expose a misread interface, and which hide it?
//!
//! A calibrator is often a black box: it returns numbers in a matrix, and its manual says which is which. The
//! chapter found two faults of such a manual. Here both are rebuilt around our own solver: a matrix whose row
//! holds `_, fx, cx, fy, cy` while the reader takes it for `_, fx, fy, cx, cy`, and a call that corrects a
//! point, said to answer in millimetres, that answers in pixels. Expected: a truth hides every layout that
//! only exchanges parameters of equal value, so that a truth of four different values exposes all, and the
//! chapter's own (fx = fy) hides one; the millimetres are 427 off, yet no check that fits a scale sees it.
//!
//! What it cannot show: that these two are all the faults an interface can have.

mod black_box;
mod layout;
mod units;

use black_box::BlackBox;
use calibench::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use calibench::evaluate::cramer_rao;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench_harness::stats::each_of;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Figure, Look, Plot, Record, Table};
use layout::{DISTORTION, LINEAR, Row};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "interface",
    title: "Which truths expose a misread interface",
    question: "A black box returns its camera in a matrix of undocumented layout and corrects points into \
               undocumented units. Which synthetic truths expose an exchange of fy and cx, and every other \
               order of the row, and which hide it? Which checks of a point call notice that its \
               millimetres are pixels? Expected: a truth hides the layouts that exchange equal values and \
               no others; the pixels differ from the millimetres by 427.",
    seed: 1,
    takes_image: false,
    run,
};

/// Noise of a pixel coordinate, px.
const SIGMA_PX: f64 = 0.1;
/// Chance that the right layout of any truth is refused; eight values for each truth.
const FALSE_ALARM: f64 = 1e-6;
/// The parameters that the black box estimates.
const FREE: FreeParameters = {
    use Parameter::*;
    FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2, P1, P2])
};
/// fx, fy, cx, cy, p1, p2 of every truth, with its name. The lens is the chapter's otherwise.
const TRUTHS: [(&str, [f64; 6]); 6] = [
    ("chapter: fx = fy, no tangential terms", [600.0, 600.0, 326.0, 243.0, 0.0, 0.0]),
    ("all different", [640.0, 580.0, 326.0, 243.0, 0.004, -0.003]),
    ("square image: fx = fy, cx = cy", [600.0, 600.0, 260.0, 260.0, 0.004, -0.003]),
    ("different focal lengths, cx = cy", [640.0, 580.0, 260.0, 260.0, 0.004, -0.003]),
    ("wide angle: fy = cx", [380.0, 326.0, 326.0, 243.0, 0.004, -0.003]),
    ("wide angle: fx = fy = cx, p1 = p2", [326.0, 326.0, 326.0, 243.0, 0.003, 0.003]),
];
/// Focal lengths of the sweep towards fy = cx, px: cx - 12, ..., cx + 12.
const SWEEP_HALVES_PX: std::ops::RangeInclusive<i32> = -24..=24;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let cases = TRUTHS
        .par_iter()
        .enumerate()
        .map(|(i, (name, values))| Case::of(name, truth_of(values), context.seed, i as u64))
        .collect::<Result<Vec<Case>, _>>()?;
    let sweep = SWEEP_HALVES_PX
        .into_par_iter()
        .map(|halves| Step::of(0.5 * f64::from(halves), context.seed))
        .collect::<Result<Vec<Step>, _>>()?;
    let units = units::examine(context.seed)?;

    report_layouts(&mut record, &cases);
    report_sweep(&mut record, &sweep);
    units::report(&mut record, &units);
    Ok(record)
}

/// The chapter's scene with another camera.
fn truth_of(&[fx, fy, cx, cy, p1, p2]: &[f64; 6]) -> Truth {
    let chapter = Truth::example();
    let lens = BrownConrady { p1, p2, ..chapter.camera.distortion };
    Truth { camera: Camera { fx, fy, cx, cy, ..chapter.camera }.with_distortion(lens), ..chapter }
}

/// The largest deviation that the right layout may show, in standard deviations.
fn limit() -> f64 {
    let values = LINEAR.len() + DISTORTION.len();
    -Normal::standard().inverse_cdf(0.5 * each_of(values * TRUTHS.len(), FALSE_ALARM))
}

/// What one truth says of all layouts.
struct Case {
    name: &'static str,
    camera: Camera,
    linear: Row,
    distortion: Row,
}

impl Case {
    fn of(name: &'static str, truth: Truth, seed: u64, trial: u64) -> Result<Case, ExperimentError> {
        let bound = cramer_rao(&truth, FREE, SIGMA_PX).map_err(ExperimentError::at("bound"))?;
        let camera = truth.camera;
        let scene = Scene::new(truth).map_err(ExperimentError::at("scene"))?;
        let mut stream = Stream::open(StreamKey { seed, scenario: "layouts", trial, purpose: "noise" });
        let black_box = BlackBox::calibrate(&scene.observe(SIGMA_PX, &mut stream), FREE)
            .map_err(ExperimentError::at("calibration in the black box"))?;
        let [linear, distortion] = black_box.matrix();
        Ok(Case {
            name,
            camera,
            linear: Row::judge(&linear[1..5], LINEAR, &camera, &bound, limit()),
            distortion: Row::judge(&distortion[..4], DISTORTION, &camera, &bound, limit()),
        })
    }

    /// Whether the chapter's fault, fy and cx exchanged, shows.
    fn exposes_swap(&self) -> bool {
        self.linear.exposes(&[Parameter::Fx, Parameter::Fy, Parameter::Cx, Parameter::Cy])
    }
}

/// One focal length of the sweep: what the reader sees in fy's place.
struct Step {
    difference_px: f64,
    z: f64,
    sd_px: f64,
}

impl Step {
    fn of(difference_px: f64, seed: u64) -> Result<Step, ExperimentError> {
        let focal = Truth::example_camera().cx + difference_px;
        let truth = truth_of(&[focal, focal, Truth::example_camera().cx, 243.0, 0.0, 0.0]);
        let free = FreeParameters::STANDARD;
        let bound = cramer_rao(&truth, free, SIGMA_PX).map_err(ExperimentError::at("bound"))?;
        let sd_px = bound.standard_deviation(Parameter::Fy).unwrap_or(f64::NAN);
        let scene = Scene::new(truth).map_err(ExperimentError::at("scene"))?;
        let trial = (difference_px + 100.0) as u64 * 2 + u64::from(difference_px.fract() != 0.0);
        let mut stream = Stream::open(StreamKey { seed, scenario: "sweep", trial, purpose: "noise" });
        let black_box = BlackBox::calibrate(&scene.observe(SIGMA_PX, &mut stream), free)
            .map_err(ExperimentError::at("calibration in the black box"))?;
        // The reader looks for fy where cx stands.
        let misread = black_box.matrix()[0][2];
        Ok(Step { difference_px, z: (misread - focal) / sd_px, sd_px })
    }
}

fn report_layouts(record: &mut Record, cases: &[Case]) {
    record
        .exact("")
        .count("layouts", cases[0].linear.layouts(), "orders of the four numbers of a row")
        .band(Band::relative(1e-9, "inverse of the normal distribution"))
        .number("limit", limit(), "largest deviation of the right layout, in standard deviations");
    let [chapter, different, square, .., worst] = cases else { return };
    for (id, case) in [("chapter", chapter), ("different", different), ("square", square), ("worst", worst)] {
        let what = format!("wrong layouts of the focal lengths' row that this truth hides: {}", case.name);
        record.exact("").count(format!("hidden-{id}"), case.linear.hidden(), what);
    }
    let what = "wrong layouts of the distortion's row that the chapter's truth hides";
    record.exact("").count("hidden-chapter-distortion", chapter.distortion.hidden(), what);

    let caption = "what every truth says of the layouts of both rows; wrong layouts that stay hidden, found \
                   and predicted";
    record.table(
        Table::of("layouts", caption, cases)
            .column("truth", "", |case| case.name)
            .column("fx", "px", |case| case.camera.fx)
            .column("fy", "px", |case| case.camera.fy)
            .column("cx", "px", |case| case.camera.cx)
            .column("cy", "px", |case| case.camera.cy)
            .column("p1", "", |case| case.camera.distortion.p1)
            .column("p2", "", |case| case.camera.distortion.p2)
            .column("swap_of_fy_and_cx", "", |case| if case.exposes_swap() { "exposed" } else { "hidden" })
            .column("hidden", "", |case| case.linear.hidden())
            .column("predicted", "", |case| case.linear.predicted_hidden())
            .column("hidden_distortion", "", |case| case.distortion.hidden())
            .column("predicted_distortion", "", |case| case.distortion.predicted_hidden()),
    );

    let rows = cases.iter().flat_map(|case| [(case, &case.linear), (case, &case.distortion)]);
    let cases = rows.map(|(case, row)| {
        let name = format!("{}: {} hidden, {} predicted", case.name, row.hidden(), row.predicted_hidden());
        (name, row.hidden() == row.predicted_hidden() && row.right_is_accepted())
    });
    record
        .claim_that(
            "hidden-layouts-are-symmetries",
            "every truth accepts the right layout and hides exactly those that exchange equal values",
        )
        .every("cases", cases.collect::<Vec<_>>())
        .at_rate(FALSE_ALARM)
        .because("values that occur m times can be exchanged in m! ways: the product of the m!, less one");
}

fn report_sweep(record: &mut Record, sweep: &[Step]) {
    let caption = "deviation of the number read as fy from the true fy when fy and cx are exchanged, in \
                   standard deviations";
    record.table(
        Table::of("sweep", caption, sweep)
            .column("fy_minus_cx", "px", |step| step.difference_px)
            .column("z", "", |step| step.z)
            .column("sd_fy", "px", |step| step.sd_px),
    );
    let limit = limit();
    let middle = &sweep[sweep.len() / 2];
    let band = Band::relative(1e-6, "inverse of the information matrix");
    let what = "difference of fy and cx below which an exchange stays hidden";
    record.group("px", band).number("blind-px", limit * middle.sd_px, what);
    let expected = sweep.iter().map(|s| (s.difference_px, -s.difference_px / s.sd_px));
    let plot = Plot::new(
        "How far must fy lie from cx?",
        "fy \u{2212} cx of the truth (px)",
        "deviation read as fy (standard deviations)",
    )
    .line("expected", expected)
    .points_as("one calibration each", sweep.iter().map(|s| (s.difference_px, s.z)), Look::series(1))
    .hline("limit", limit)
    .hline("", -limit);
    let caption = format!(
        "What a reader who exchanges fy and cx sees in fy's place, in standard deviations of fy, for truths \
         whose focal length approaches cx; noise {SIGMA_PX} px, one calibration a point, seed {}. Notice \
         the blind zone between the limits: an exchange stays hidden where the two differ by less than \
         {:.1} px.",
        record.seed(),
        limit * middle.sd_px
    );
    record.figure(Figure::plot("blind-zone", &plot, caption));
    // cx is estimated with a standard deviation of its own: z has mean -difference / sd(fy) and deviation
    // sd(cx) / sd(fy), which the sweep keeps below 2.
    let rate = each_of(sweep.len(), 1e-6);
    let bound = -2.0 * Normal::standard().inverse_cdf(0.5 * rate);
    let worst = sweep.iter().map(|s| (s.z + s.difference_px / s.sd_px).abs()).fold(0.0, f64::max);
    let reason = "noise of cx in units of fy's deviation, below 2, at a rate of 1e-6 over all steps";
    let statement = "what the reader sees is the difference of the two truths and noise";
    record.claim_that("sweep-follows-theory", statement).at_most(worst, bound).at_rate(1e-6).because(reason);
}
