//! How near does Zhang's closed form come before it is refined?
//!
//! The closed form ignores the lens and minimises what nobody measures; the refinement is there to mend both.
//! To take the two faults apart, the four poses are calibrated with a lens and without one, over the noise.
//! The refinement may use what the closed form uses: without a lens it holds the lens at zero.
//!
//! Expected: without lens and noise the closed form is exact; without a lens it spreads as linear propagation
//! of the noise says, and not less than the bound; with the lens it is off by many standard deviations,
//! whatever the noise. The refinement attains the bound in both cases.
//!
//! What it cannot show: that a worse start does not matter. Where a search from it ends is asked in
//! `global-minimum`.

use calibench::board::View;
use calibench::calibrate::{Calibration, Settings, calibrate, closed_form};
use calibench::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use calibench::evaluate::{Sample, cramer_rao};
use calibench::geometry::{Homography, HomographyFit, Vec2};
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench_harness::stats::{Interval, each_of};
use calibench_harness::{Band, Context, Experiment, ExperimentError, Record, Table};
use rayon::prelude::*;

mod figures;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "closed-form",
    title: "The closed form before it is refined",
    question: "How far from the truth is fx by the closed form alone, against the refinement and the Cramer-Rao bound, \
               with and without a lens, over the noise? Expected: exact without both, hardly worse than the bound with \
               noise alone, and off by many standard deviations with a lens.",
    seed: 1,
    takes_image: false,
    run,
};

/// Noise on each of u and v, px.
const SIGMAS_PX: [f64; 4] = [0.05, 0.1, 0.2, 0.5];
const TRIALS: usize = 2000;
/// Chance that a correct program fails one claim.
const RATE: f64 = 1e-4;
/// Pixels of 600 are rounded by 1e-13; the equations, whose coefficients span the square of the focal length
/// and are solved by their smallest singular vector, enlarge that by 1e6 at most.
const ROUNDING_PX: f64 = 1e-7;
/// Each pixel is moved by this much to see what the closed form makes of it: the square of it is far below
/// one, and rounding of the result over it far below a thousandth.
const STEP_PX: f64 = 1e-2;
/// At half a pixel of noise the second order adds a hundredth of a spread.
const SECOND_ORDER: f64 = 0.01;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let cases = [Case::new(false)?, Case::new(true)?];
    let progress = context.progress("calibrations", cases.len() * SIGMAS_PX.len() * TRIALS);
    let mut nodes = Vec::new();
    for case in &cases {
        for sigma_px in SIGMAS_PX {
            nodes.push(Node::new(case, sigma_px, context.seed, || progress.step())?);
        }
    }
    drop(progress);
    let draw = Draw::new(&cases[1])?;
    report_cases(&mut record, &cases);
    report_nodes(&mut record, &nodes);
    report_draw(&mut record, &draw);
    claim_cases(&mut record, &cases);
    claim_nodes(&mut record, &nodes);
    record.table(table(&nodes));
    record.figure(figures::homography(&cases)?);
    record.figure(figures::steps(&draw));
    record.figure(figures::errors(&cases, &nodes, context.seed));
    Ok(record)
}

/// The chapter's four poses, with its lens or none, and what is known of them beforehand.
struct Case {
    name: &'static str,
    scene: Scene,
    settings: Settings,
    /// Error of fx by the closed form on exact pixels, px.
    exact_error_px: f64,
    /// Standard deviation of fx by the closed form, to first order, for a pixel of noise.
    spread: f64,
    /// The Cramer-Rao bound of what `settings` estimates, for a pixel of noise.
    bound: f64,
}

impl Case {
    fn new(with_lens: bool) -> Result<Case, ExperimentError> {
        let truth = Truth::example();
        let (name, camera, settings) = if with_lens {
            ("with lens", truth.camera, Settings::standard())
        } else {
            let held = Settings::standard().hold(Parameter::K1, 0.0).hold(Parameter::K2, 0.0);
            ("without lens", truth.camera.with_distortion(BrownConrady::radial(0.0, 0.0)), held)
        };
        let scene = Scene::new(Truth { camera, ..truth }).map_err(ExperimentError::at("scene"))?;
        let homographies = homographies(&scene.exact())?;
        let exact_error_px = closed_form_camera(&homographies)?.fx - scene.truth.camera.fx;
        let bound = cramer_rao(&scene.truth, settings.free(), 1.0)
            .map_err(ExperimentError::at("Cramer-Rao bound"))?
            .standard_deviation(Parameter::Fx)
            .unwrap_or(f64::NAN);
        let spread = linear_spread(&scene, &homographies)?;
        Ok(Case { name, scene, settings, exact_error_px, spread, bound })
    }
}

/// The homography of each view.
fn homographies(views: &[View]) -> Result<Vec<Homography>, ExperimentError> {
    views.iter().map(|view| Ok(homography(view.points(), view.pixels())?.homography)).collect()
}

fn homography(points: &[Vec2], pixels: &[Vec2]) -> Result<HomographyFit, ExperimentError> {
    Homography::fit(points, pixels).map_err(ExperimentError::at("homography"))
}

fn closed_form_camera(homographies: &[Homography]) -> Result<Camera, ExperimentError> {
    closed_form(homographies, false).map_err(ExperimentError::at("closed form"))
}

/// The spread of fx by the closed form under unit noise: the root of the sum of its squared derivatives by
/// all coordinates.
fn linear_spread(scene: &Scene, homographies: &[Homography]) -> Result<f64, ExperimentError> {
    let views = scene.exact();
    let fx_with = |view: usize, point: usize, step: Vec2| -> Result<f64, ExperimentError> {
        let mut pixels = views[view].pixels().to_vec();
        pixels[point] += step;
        let mut moved = homographies.to_vec();
        moved[view] = homography(views[view].points(), &pixels)?.homography;
        Ok(closed_form_camera(&moved)?.fx)
    };
    let mut squares = 0.0;
    for (view, point) in (0..views.len()).flat_map(|j| (0..views[j].points().len()).map(move |i| (j, i))) {
        for step in [Vec2::new(STEP_PX, 0.0), Vec2::new(0.0, STEP_PX)] {
            let slope = (fx_with(view, point, step)? - fx_with(view, point, -step)?) / (2.0 * STEP_PX);
            squares += slope * slope;
        }
    }
    Ok(squares.sqrt())
}

/// Many draws of one case at one noise.
struct Node {
    case: &'static str,
    sigma_px: f64,
    /// Errors of fx by the closed form and refined, px.
    errors: Sample,
    /// What first order predicts for the spread of either, px.
    closed_form_sd_px: f64,
    bound_px: f64,
}

/// Places in a node's sample.
const CLOSED_FORM: usize = 0;
const REFINED: usize = 1;

impl Node {
    fn new(case: &Case, sigma_px: f64, seed: u64, step: impl Fn() + Sync) -> Result<Node, ExperimentError> {
        let truth = case.scene.truth.camera.fx;
        // Both cases and all levels see the same draws, enlarged.
        let draw = |trial: u64| -> Result<[f64; 2], ExperimentError> {
            let key = StreamKey { seed, scenario: "closed-form", trial, purpose: "noise" };
            let views = case.scene.observe(sigma_px, &mut Stream::open(key));
            let closed = closed_form_camera(&homographies(&views)?)?;
            let refined = calibrate(&views, &case.settings).map_err(ExperimentError::at("calibration"))?;
            step();
            Ok([closed.fx - truth, refined.camera.fx - truth])
        };
        let drawn = (0..TRIALS as u64).into_par_iter().map(draw).collect::<Result<Vec<_>, _>>()?;
        let mut errors = Sample::about(&[0.0; 2]);
        drawn.iter().for_each(|pair| errors.add(pair));
        Ok(Node {
            case: case.name,
            sigma_px,
            errors,
            closed_form_sd_px: sigma_px * case.spread,
            bound_px: sigma_px * case.bound,
        })
    }

    fn name(&self) -> String {
        format!("{}, {} px", self.case, self.sigma_px)
    }

    /// The root mean square error of the closed form over that of the refinement.
    fn factor(&self) -> f64 {
        self.errors.root_mean_square(CLOSED_FORM) / self.errors.root_mean_square(REFINED)
    }
}

/// One draw, step by step: that of the experiment `four-pose`.
struct Draw {
    homographies: Vec<HomographyFit>,
    points: usize,
    closed: Camera,
    refined: Calibration,
}

/// Noise of that draw, px.
const DRAW_SIGMA_PX: f64 = 0.1;

impl Draw {
    fn new(case: &Case) -> Result<Draw, ExperimentError> {
        let key = StreamKey { seed: 1, scenario: "four-pose", trial: 0, purpose: "noise" };
        let views = case.scene.observe(DRAW_SIGMA_PX, &mut Stream::open(key));
        let fit = |view: &View| homography(view.points(), view.pixels());
        Ok(Draw {
            homographies: views.iter().map(fit).collect::<Result<_, _>>()?,
            points: views.iter().map(|view| view.points().len()).sum(),
            closed: closed_form_camera(&homographies(&views)?)?,
            refined: calibrate(&views, &case.settings).map_err(ExperimentError::at("calibration"))?,
        })
    }

    /// What the homographies leave of all points, root mean square of distances, px.
    fn homography_rms_px(&self) -> f64 {
        (self.homographies.iter().map(|fit| fit.cost).sum::<f64>() / self.points as f64).sqrt()
    }
}

fn report_cases(record: &mut Record, cases: &[Case]) {
    let derivatives = || Band::relative(1e-6, "differences over a hundredth of a pixel");
    record.exact("").count("trials", TRIALS, "draws a node");
    for case in cases {
        record
            .group("px", Band::absolute(ROUNDING_PX, "rounding of the equations"))
            .suffix(format!("-{}", case.name.replace(' ', "-")), format!(", {}", case.name))
            .number("exact", case.exact_error_px, "error of fx by the closed form on exact pixels")
            .unit("")
            .band(derivatives())
            .number(
                "spread",
                case.spread,
                "spread of fx by the closed form over that of the pixels, first order",
            )
            .number("bound", case.bound, "Cramer-Rao bound of fx over the spread of the pixels")
            .number("spread-over-bound", case.spread / case.bound, "the former over the latter");
    }
}

fn report_nodes(record: &mut Record, nodes: &[Node]) {
    let converged = || Band::relative(1e-6, "refinement converges to 1e-6 of a standard deviation");
    for node in nodes {
        let hundredths = libm::round(100.0 * node.sigma_px);
        record
            .group("px", converged())
            .suffix(format!("-{}-{hundredths}", node.case.replace(' ', "-")), format!(", {}", node.name()))
            .number(
                "closed-form",
                node.errors.root_mean_square(CLOSED_FORM),
                "root mean square error of fx by the closed form",
            )
            .number("refined", node.errors.root_mean_square(REFINED), "root mean square error of fx refined")
            .unit("")
            .number("factor", node.factor(), "the former over the latter");
    }
}

fn report_draw(record: &mut Record, draw: &Draw) {
    let band = || Band::relative(1e-6, "refinement converges to 1e-6 of a standard deviation");
    record
        .group("px", band())
        .number(
            "draw-homographies",
            draw.homography_rms_px(),
            "what the homographies of our draw leave of a point, root mean square",
        )
        .number("draw-closed-form", draw.closed.fx, "fx of our draw by the closed form")
        .number("draw-refined", draw.refined.camera.fx, "fx of our draw, refined");
}

fn claim_cases(record: &mut Record, [without, with]: &[Case; 2]) {
    record
        .claim_that("exact-without-lens-and-noise", "without lens and noise the closed form is exact")
        .at_most(without.exact_error_px.abs(), ROUNDING_PX)
        .unit("px")
        .because("rounding, enlarged by the equations");
    record
        .claim_that(
            "no-better-than-the-bound",
            "without a lens the closed form spreads no less than the bound",
        )
        .at_least(without.spread / without.bound, 1.0)
        .because("the information inequality, which holds for whatever is right on exact data");
    record
        .claim_that(
            "the-lens-costs-more-than-the-noise",
            "the lens puts the closed form farther off than the chapter's noise puts the refinement",
        )
        .at_least(with.exact_error_px.abs(), 3.0 * DRAW_SIGMA_PX * with.bound)
        .unit("px")
        .because("three standard deviations of the bound");
}

fn claim_nodes(record: &mut Record, nodes: &[Node]) {
    let interval = Interval::of_deviation_ratio(TRIALS, each_of(nodes.len(), RATE));
    let attained = |place: usize, predicted: fn(&Node) -> f64| {
        nodes.iter().map(move |node| {
            let ratio = node.errors.standard_deviation(place) / predicted(node);
            let holds = ratio >= interval.low && ratio <= (1.0 + SECOND_ORDER) * interval.high;
            (format!("{}: {ratio:.3}", node.name()), holds)
        })
    };
    let reason =
        "chi-squared interval of the trials' deviation, and a hundredth for the second order in the noise";
    record
        .claim_that(
            "closed-form-spreads-as-predicted",
            "the closed form spreads about its mean as linear propagation of the noise says",
        )
        .every("nodes", attained(CLOSED_FORM, |node| node.closed_form_sd_px))
        .at_rate(RATE)
        .because(reason);
    record
        .claim_that(
            "refinement-attains-the-bound",
            "refined, fx is as good as the bound allows, with and without a lens",
        )
        .every("nodes", attained(REFINED, |node| node.bound_px))
        .at_rate(RATE)
        .because(reason);
}

fn table(nodes: &[Node]) -> Table {
    Table::of(
        "errors",
        "fx by the closed form and refined: root mean square errors, spreads, and what first order predicts",
        nodes,
    )
    .column("lens", "", |node| node.case)
    .column("noise", "px", |node| node.sigma_px)
    .column("closed_form", "px", |node| node.errors.root_mean_square(CLOSED_FORM))
    .column("closed_form_sd", "px", |node| node.errors.standard_deviation(CLOSED_FORM))
    .column("predicted_sd", "px", |node| node.closed_form_sd_px)
    .column("refined", "px", |node| node.errors.root_mean_square(REFINED))
    .column("bound", "px", |node| node.bound_px)
    .into()
}
