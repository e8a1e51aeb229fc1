//! How well do photographs of discs give their centres and a camera, and is the chapter's noise of 0.1 px
//! realistic?
//!
//! Expected: image noise moves centres by little more than the information in the discs' edges allows, a few
//! thousandths of a pixel, far below 0.1 px. Without correction, the bias of imaged discs (the centre of the
//! ellipse is not the image of the centre) is as large as that noise or larger, and it does not average out,
//! though the poses take up most of it; with correction the camera is exact up to what the detector leaves.
//!
//! What it cannot show: lenses that are not sharp alike over the frame, discs that are printed out of place,
//! boards that are not plane. What they add is not measured here.

use calibench::board::{Board, View};
use calibench::calibrate::Settings;
use calibench::camera::{Camera, FreeParameters};
use calibench::detect::{circle_grid, disc_biases};
use calibench::evaluate::cramer_rao;
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::photos::Fitter;
use calibench::synth::render::{Imaging, Photograph, SensorNoise, photograph};
use calibench::synth::{Stream, StreamKey, Truth};
use calibench_harness::stats::{self, Interval, each_of};
use calibench_harness::{
    Band, Context, Experiment, ExperimentError, Figure, Look, Plot, Record, Rows, Table,
};
use rayon::prelude::*;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "photographs",
    title: "From photographs to a camera",
    question: "The chapter's four poses are photographed, their discs detected, the camera calibrated. What \
               extraction noise results against blur, image noise and disc size; what does the bias of \
               imaged discs do without correction and with it; is the chapter's 0.1 px realistic? Expected: \
               a few thousandths of a pixel of noise, a bias of more than that without correction and none \
               with it, most of it taken up by the poses. A sensor does not make 0.1 px.",
    seed: 3,
    takes_image: false,
    run,
};

/// Where the sweeps cross: blur of a good lens, noise of 40 dB, the discs of the chapter's figure.
const BASE: Node = Node { blur_px: 0.5, noise: 0.01, diameter_mm: 3.0 };
const BLURS_PX: [f64; 4] = [0.0, 0.5, 1.0, 2.0];
/// Of full scale. Beyond 5 % the discs' outlines break up.
const NOISES: [f64; 4] = [0.003, 0.01, 0.02, 0.05];
const DIAMETERS_MM: [f64; 4] = [2.0, 3.0, 5.0, 7.0];
/// The chapter's noise of a coordinate.
const CHAPTER_NOISE_PX: f64 = 0.1;
/// False-alarm rate of the claim about noise, all nodes together.
const FALSE_ALARM: f64 = 1e-4;
/// What the detector may lose against the bound, which knows levels and outline: a quarter, as its tests
/// claim up to this blur.
const LOSS: f64 = 1.25;
const SHARP_PX: f64 = 1.0;
/// What the bound itself leaves open: pixel and blur together are taken for a Gaussian of their variance,
/// which changes the information of a sharp edge by 4 % at most, along the diagonal.
const BOUND_ERROR: f64 = 0.02;
/// First-order bounds are widened by this: the errors are thousandths of what would bend the model
/// noticeably.
const SECOND_ORDER: f64 = 1.1;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    blur_px: f64,
    noise: f64,
    diameter_mm: f64,
}

/// What the photographs of a node gave.
struct Outcome {
    node: Node,
    /// Detected minus true centre and bias, px, all views.
    errors: Vec<Vec2>,
    /// Root mean square of a coordinate that the edges' information allows, px.
    bound_px: f64,
}

impl Outcome {
    /// Root mean square of a coordinate's error, px.
    fn noise_px(&self) -> f64 {
        rms_coordinate(&self.errors)
    }

    /// The same over its bound.
    fn loss(&self) -> f64 {
        self.noise_px() / self.bound_px
    }
}

/// Noise-free photographs of one disc size, with what follows from them.
struct Exact {
    diameter_mm: f64,
    /// Predicted bias, px, all views.
    biases: Vec<Vec2>,
    /// Detected minus true centre, px, all views.
    displacements: Vec<Vec2>,
    uncorrected: Camera,
    corrected: Camera,
    /// The camera from exact pixels with the predicted bias added: what the bias alone does.
    predicted: Camera,
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let nodes = nodes();
    let album = Album::of(&nodes, context)?;
    let outcomes: Vec<Outcome> =
        nodes.par_iter().map(|node| outcome(*node, &album, context.seed)).collect::<Result<_, _>>()?;
    let exact: Vec<Exact> =
        DIAMETERS_MM.par_iter().map(|&diameter| noise_free(diameter, &album)).collect::<Result<_, _>>()?;
    let unit = unit_deviations()?;
    report_noise(&mut record, &outcomes)?;
    report_bias(&mut record, &exact, &unit)?;
    claim_noise(&mut record, &outcomes);
    claim_bias(&mut record, &exact, &unit);
    record.table(noise_table(&outcomes));
    record.table(bias_table(&exact, &unit));
    record.figure(noise_figure(&outcomes, context.seed));
    record.figure(bias_figure(&exact, &unit));
    record.note(format!(
        "{CHAPTER_NOISE_PX} px is not what a sensor makes of discs like these: noise of {} % of full scale \
         gives {:.1} % of it. What print, flatness and uneven sharpness add is not rendered here.",
        100.0 * BASE.noise,
        100.0 * base(&outcomes)?.noise_px() / CHAPTER_NOISE_PX
    ));
    let photo = &album.photos(&BASE)[3];
    let caption = format!(
        "The chapter's target in its compound pose, discs of {} mm, blur {} px, without noise: what the \
         detector sees.",
        BASE.diameter_mm, BASE.blur_px
    );
    record.figure(Figure::photo("photograph", &photo.image.to_u8(), caption));
    Ok(record)
}

/// Three sweeps through the base, which is photographed once.
fn nodes() -> Vec<Node> {
    let blurs = BLURS_PX.map(|blur_px| Node { blur_px, ..BASE });
    let noises = NOISES.map(|noise| Node { noise, ..BASE });
    let diameters = DIAMETERS_MM.map(|diameter_mm| Node { diameter_mm, ..BASE });
    let mut nodes = vec![BASE];
    nodes.extend(blurs.into_iter().chain(noises).chain(diameters).filter(|node| *node != BASE));
    nodes
}

fn board(diameter_mm: f64) -> Result<Board, ExperimentError> {
    Board::circles(9, 7, 10.0, diameter_mm).map_err(ExperimentError::at("board"))
}

/// The noise-free photographs of the chapter's poses, each rendered once: nodes that differ in noise alone
/// share theirs.
struct Album(Vec<(Node, Vec<Photograph>)>);

impl Album {
    fn of(nodes: &[Node], context: &Context) -> Result<Album, ExperimentError> {
        let mut scenes: Vec<Node> = Vec::new();
        for scene in nodes.iter().map(Node::noiseless) {
            if !scenes.contains(&scene) {
                scenes.push(scene);
            }
        }
        let poses = Truth::example_poses();
        let progress = context.progress("photographs", scenes.len() * poses.len());
        let sheets: Vec<(&Node, &Pose)> =
            scenes.iter().flat_map(|node| poses.iter().map(move |pose| (node, pose))).collect();
        let photos: Vec<Photograph> = sheets
            .par_iter()
            .map(|(node, pose)| photo(pose, node).inspect(|_| progress.step()))
            .collect::<Result<_, _>>()?;
        let mut photos = photos.into_iter();
        let pages = scenes.into_iter().map(|node| (node, photos.by_ref().take(poses.len()).collect()));
        Ok(Album(pages.collect()))
    }

    /// One photograph a pose.
    fn photos(&self, node: &Node) -> &[Photograph] {
        let page = self.0.iter().find(|(scene, _)| *scene == node.noiseless());
        &page.expect("the album was made for all nodes").1
    }
}

impl Node {
    /// What the photographs show before noise is added.
    fn noiseless(&self) -> Node {
        Node { noise: 0.0, ..*self }
    }
}

fn photo(pose: &Pose, node: &Node) -> Result<Photograph, ExperimentError> {
    let imaging = Imaging { blur_px: node.blur_px, ..Imaging::default() };
    photograph(&Truth::example_camera(), Truth::EXAMPLE_IMAGE, &board(node.diameter_mm)?, pose, &imaging)
        .map_err(ExperimentError::at("rendering"))
}

fn detected(photo: &Photograph) -> Result<Vec<Vec2>, ExperimentError> {
    Ok(circle_grid(&photo.image, 9, 7).map_err(ExperimentError::at("detection"))?.centres_px())
}

fn biases(pose: &Pose, board: &Board) -> Result<Vec<Vec2>, ExperimentError> {
    disc_biases(&Truth::example_camera(), pose, board).map_err(ExperimentError::at("bias of the discs"))
}

fn outcome(node: Node, album: &Album, seed: u64) -> Result<Outcome, ExperimentError> {
    let scenario = format!("blur {} noise {} diameter {}", node.blur_px, node.noise, node.diameter_mm);
    let (mut errors, mut variances) = (Vec::new(), Vec::new());
    for ((pose, photo), trial) in Truth::example_poses().iter().zip(album.photos(&node)).zip(0..) {
        let key = StreamKey { seed, scenario: &scenario, trial, purpose: "image noise" };
        let photo = photo.clone().with_noise(&SensorNoise::constant(node.noise), &mut Stream::open(key));
        let seen = detected(&photo)?;
        let biases = biases(pose, &board(node.diameter_mm)?)?;
        errors.extend(seen.iter().zip(&photo.centres_true).zip(&biases).map(|((s, t), b)| s - t - b));
        let points = Truth::example_board().points();
        variances.extend(points.iter().map(|point| edge_variance(pose, point, &node)));
    }
    let bound_px = (variances.iter().sum::<f64>() / variances.len() as f64).sqrt();
    Ok(Outcome { node, errors, bound_px })
}

/// The Cramer-Rao bound of a disc's centre, px^2, mean of both coordinates: an edge of contrast `C` blurred
/// by a Gaussian of variance `s^2 = blur^2 + 1/12` (the pixel's square) holds `C^2 / (2 sqrt(pi) s sigma^2)`
/// of information a pixel of its length about its place along the normal `n`; the outline sums `n n^T`.
fn edge_variance(pose: &Pose, centre: &Vec2, node: &Node) -> f64 {
    const SIDES: u32 = 64;
    let camera = Truth::example_camera();
    let appearance = Imaging::default().appearance;
    let snr = (appearance.paper - appearance.ink) / node.noise;
    let spread = (node.blur_px * node.blur_px + 1.0 / 12.0).sqrt();
    let density = snr * snr / (2.0 * std::f64::consts::PI.sqrt() * spread);
    let corner = |i: u32| {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(i) / f64::from(SIDES));
        let p = centre + Vec2::new(cosine, sine) * (0.5 * node.diameter_mm);
        camera.project(&pose.apply(&Vec3::new(p.x, p.y, 0.0)))
    };
    let mut information = nalgebra::Matrix2::zeros();
    for i in 0..SIDES {
        let (Some(a), Some(b)) = (corner(i), corner(i + 1)) else { return f64::NAN };
        let side = b - a;
        let normal = Vec2::new(-side.y, side.x) / side.norm();
        information += normal * normal.transpose() * (density * side.norm());
    }
    information.try_inverse().map_or(f64::NAN, |variance| 0.5 * variance.trace())
}

fn noise_free(diameter_mm: f64, album: &Album) -> Result<Exact, ExperimentError> {
    let board = board(diameter_mm)?;
    let node = Node { diameter_mm, ..BASE };
    let (mut seen_views, mut predicted_views) = (Vec::new(), Vec::new());
    let (mut all_biases, mut displacements) = (Vec::new(), Vec::new());
    for (pose, photo) in Truth::example_poses().iter().zip(album.photos(&node)) {
        let seen = detected(photo)?;
        let biases = biases(pose, &board)?;
        displacements.extend(seen.iter().zip(&photo.centres_true).map(|(s, t)| s - t));
        let biased = photo.centres_true.iter().zip(&biases).map(|(t, b)| t + b).collect();
        all_biases.extend(biases);
        let view = |pixels| View::new(board.points(), pixels).map_err(ExperimentError::at("view"));
        seen_views.push(view(seen)?);
        predicted_views.push(view(biased)?);
    }
    let settings = Settings::standard();
    let fit = |views: &[View], discs: Option<&Board>| -> Result<Camera, ExperimentError> {
        let fitter = Fitter { settings: &settings, discs, reject_factor: None };
        let camera = fitter.fit(views).map(|fit| fit.calibration.camera);
        let camera = camera.map_err(ExperimentError::at("calibration"))?;
        Ok(camera.brown_conrady().expect("the settings ask for a Brown-Conrady lens"))
    };
    Ok(Exact {
        diameter_mm,
        biases: all_biases,
        displacements,
        uncorrected: fit(&seen_views, None)?,
        corrected: fit(&seen_views, Some(&board))?,
        predicted: fit(&predicted_views, None)?,
    })
}

/// Standard deviations of the parameters for noise of 1 px a coordinate.
fn unit_deviations() -> Result<Vec<f64>, ExperimentError> {
    let bound = cramer_rao(&Truth::example(), FreeParameters::STANDARD, 1.0)
        .map_err(ExperimentError::at("Cramer-Rao bound"))?;
    Ok(FreeParameters::STANDARD.iter().filter_map(|p| bound.standard_deviation(p)).collect())
}

/// Root mean square of a coordinate.
fn rms_coordinate(errors: &[Vec2]) -> f64 {
    (0.5 * errors.iter().map(Vec2::norm_squared).sum::<f64>() / errors.len() as f64).sqrt()
}

/// Root mean square of the lengths.
fn rms(vectors: &[Vec2]) -> f64 {
    std::f64::consts::SQRT_2 * rms_coordinate(vectors)
}

fn largest(vectors: &[Vec2]) -> f64 {
    vectors.iter().map(|v| v.norm()).fold(0.0, f64::max)
}

impl Exact {
    /// What the detector leaves when the true bias is taken off, px.
    fn remainder(&self) -> Vec<Vec2> {
        self.displacements.iter().zip(&self.biases).map(|(d, b)| d - b).collect()
    }

    /// How far errors of the pixels can move each parameter: least squares is linear to first order, so an
    /// error vector `e` moves it by `|e|` times its standard deviation for unit noise at most
    /// (Cauchy-Schwarz).
    fn reach(&self, unit: &[f64]) -> Vec<f64> {
        let length = self.remainder().iter().map(Vec2::norm_squared).sum::<f64>().sqrt();
        unit.iter().map(|sd| SECOND_ORDER * length * sd).collect()
    }
}

fn differences(a: &Camera, b: &Camera) -> Vec<f64> {
    FreeParameters::STANDARD.iter().map(|p| a.get(p) - b.get(p)).collect()
}

fn base(outcomes: &[Outcome]) -> Result<&Outcome, ExperimentError> {
    outcomes.iter().find(|o| o.node == BASE).ok_or(ExperimentError::Input("the base node is missing".into()))
}

fn band() -> Band {
    Band::relative(
        1e-5,
        "the bits repeat on every machine, so that a larger difference is a change of method",
    )
}

fn report_noise(record: &mut Record, outcomes: &[Outcome]) -> Result<(), ExperimentError> {
    let base = base(outcomes)?;
    let noise = base.noise_px();
    let needed = CHAPTER_NOISE_PX / base.bound_px * BASE.noise;
    let blurred = outcomes.iter().max_by(|a, b| a.node.blur_px.total_cmp(&b.node.blur_px)).unwrap_or(base);
    let ratio = blurred.loss();
    let worst = stats::largest(outcomes.iter().map(Outcome::noise_px));
    record
        .group("px", band())
        .number("extraction-noise", noise, "RMS of a coordinate: blur 0.5 px, noise 1 %, discs of 3 mm")
        .number("extraction-bound", base.bound_px, "what the information in the discs' edges allows there")
        .unit("")
        .number("noise-for-a-tenth", needed, "image noise, of full scale, at which the bound reaches 0.1 px")
        .number("loss-under-blur", ratio, "extraction noise over its bound at the heaviest blur, 2 px")
        .unit("px")
        .number("largest-extraction-noise", worst, "the same in the worst node of the sweeps");
    Ok(())
}

fn report_bias(record: &mut Record, exact: &[Exact], unit: &[f64]) -> Result<(), ExperimentError> {
    let chapter = exact
        .iter()
        .find(|e| e.diameter_mm == BASE.diameter_mm)
        .ok_or(ExperimentError::Input("the base's disc size is missing".into()))?;
    let bias = rms(&chapter.displacements);
    let remainder = rms(&chapter.remainder());
    record
        .group("px", band())
        .number("bias-rms", bias, "RMS displacement of uncorrected centres, 3 mm discs, four poses")
        .number("bias-largest", largest(&chapter.displacements), "largest displacement")
        .number("remainder-rms", remainder, "RMS distance from the true centres once corrected");
    let truth = Truth::example_camera();
    let (before, after) =
        (differences(&chapter.uncorrected, &truth), differences(&chapter.corrected, &truth));
    for (i, p) in FreeParameters::STANDARD.iter().enumerate() {
        let what = |centres: &str| format!("error of {p} from {centres} centres, 3 mm discs");
        record
            .group(p.unit(), band())
            .number(format!("{p}-uncorrected"), before[i], what("uncorrected"))
            .number(format!("{p}-corrected"), after[i], what("corrected"));
    }
    let worst = largest_deviation(&before, unit);
    let what =
        "largest error from uncorrected centres, in standard deviations under the chapter's noise of 0.1 px";
    record.group("", band()).number("bias-in-deviations", worst, what);
    Ok(())
}

fn name(node: &Node) -> String {
    format!("blur {} px, noise {}, diameter {} mm", node.blur_px, node.noise, node.diameter_mm)
}

fn claim_noise(record: &mut Record, outcomes: &[Outcome]) {
    let coordinates = 2 * outcomes[0].errors.len();
    let rate = each_of(outcomes.len(), FALSE_ALARM);
    // The mean is known to be zero, so every coordinate is a degree of freedom.
    let chance = Interval::of_deviation_ratio(coordinates + 1, rate);
    let (low, high) = (chance.low * (1.0 - BOUND_ERROR), chance.high * (1.0 + BOUND_ERROR) * LOSS);
    let sharp = outcomes.iter().filter(|o| o.node.blur_px <= SHARP_PX);
    let cases = sharp.map(|o| {
        let ratio = o.loss();
        (format!("{}: {ratio:.3} of the bound", name(&o.node)), (low..=high).contains(&ratio))
    });
    let reason = format!(
        "chi-squared interval of {coordinates} coordinates a node, 2 % for the bound's Gaussian edge, and a \
         quarter that the detector may lose: {low:.3} to {high:.3}"
    );
    let statement = "up to 1 px of blur, noise moves centres as much as the information in the discs' edges \
                     demands, and hardly more";
    record
        .claim_that("noise-is-at-the-bound", statement)
        .every("cases", cases)
        .at_rate(FALSE_ALARM)
        .because(reason);
    let worst = stats::largest(outcomes.iter().map(Outcome::noise_px));
    let statement = "no blur, noise and disc size of the sweeps makes the chapter's 0.1 px";
    let reason = "the largest bound of the sweeps, widened as above, is below it";
    record
        .claim_that("below-a-tenth", statement)
        .at_most(worst, CHAPTER_NOISE_PX)
        .unit("px")
        .at_rate(FALSE_ALARM)
        .because(reason);
}

fn claim_bias(record: &mut Record, exact: &[Exact], unit: &[f64]) {
    let truth = Truth::example_camera();
    let within = |moved: &[f64], reach: &[f64]| moved.iter().zip(reach).all(|(m, r)| m.abs() <= *r);
    let remainder = |e: &Exact| rms(&e.remainder());
    let worst = exact.iter().map(remainder).fold(0.0, f64::max);
    let statement = "centres less the predicted bias lie on the true ones, for every disc size";
    let reason = "the project's target for noise-free images, 0.01 px RMS";
    record.claim_that("bias-is-predicted", statement).at_most(worst, 0.01).unit("px").because(reason);
    let reason = "least squares moves a parameter by at most the length of the pixels' error vector times \
                  its standard deviation for unit noise (Cauchy-Schwarz), and a tenth for second order";
    let case = |e: &Exact, moved: Vec<f64>| {
        (format!("discs of {} mm: {moved:?}", e.diameter_mm), within(&moved, &e.reach(unit)))
    };
    let statement = "with correction the camera is true up to what the detector leaves";
    let cases = exact.iter().map(|e| case(e, differences(&e.corrected, &truth)));
    record.claim_that("corrected-camera-is-true", statement).every("disc sizes", cases).because(reason);
    let statement = "without correction the camera is wrong as the bias of the discs alone makes it";
    let cases = exact.iter().map(|e| case(e, differences(&e.uncorrected, &e.predicted)));
    record.claim_that("uncorrected-camera-is-biased", statement).every("disc sizes", cases).because(reason);
}

fn noise_table(outcomes: &[Outcome]) -> Rows<&Outcome> {
    Table::of("noise", "extraction noise against blur, image noise and disc size", outcomes)
        .column("blur", "px", |o| o.node.blur_px)
        .column("noise", "", |o| o.node.noise)
        .column("diameter", "mm", |o| o.node.diameter_mm)
        .column("extraction_noise", "px", |o| o.noise_px())
        .column("bound", "px", |o| o.bound_px)
}

/// Largest error of a parameter, in standard deviations under the chapter's noise.
fn largest_deviation(moved: &[f64], unit: &[f64]) -> f64 {
    moved.iter().zip(unit).map(|(m, sd)| (m / (CHAPTER_NOISE_PX * sd)).abs()).fold(0.0, f64::max)
}

fn bias_table<'a>(exact: &'a [Exact], unit: &[f64]) -> Rows<&'a Exact> {
    let truth = Truth::example_camera();
    let error = |camera: &Camera| largest_deviation(&differences(camera, &truth), unit);
    let deviations = "standard deviations at 0.1 px";
    Table::of("bias", "bias of discs without noise, and the worst parameter it leaves", exact)
        .column("diameter", "mm", |e| e.diameter_mm)
        .column("bias_rms", "px", |e| rms(&e.displacements))
        .column("bias_largest", "px", |e| largest(&e.displacements))
        .column("remainder_rms", "px", |e| rms(&e.remainder()))
        .column("uncorrected_error", deviations, |e| error(&e.uncorrected))
        .column("corrected_error", deviations, |e| error(&e.corrected))
}

fn noise_figure(outcomes: &[Outcome], seed: u64) -> Figure {
    let panel = |title: &str, label: &str, at: fn(&Node) -> f64, others: fn(&Node) -> Node| {
        let mut chosen: Vec<&Outcome> = outcomes.iter().filter(|o| others(&o.node) == BASE).collect();
        chosen.sort_by(|a, b| at(&a.node).total_cmp(&at(&b.node)));
        let curve = |value: fn(&Outcome) -> f64| chosen.iter().map(move |o| (at(&o.node), value(o)));
        Plot::new(title, label, "noise of a coordinate (px)")
            .size(400.0, 340.0)
            .line("bound of the edges", curve(|o| o.bound_px))
            .points_as("detected", curve(Outcome::noise_px), Look::series(1))
            .y_range(0.0, 0.025)
    };
    let panels = [
        panel("blur", "blur (px)", |n| n.blur_px, |n| Node { blur_px: BASE.blur_px, ..*n }),
        panel("image noise", "noise (of full scale)", |n| n.noise, |n| Node { noise: BASE.noise, ..*n }),
        panel(
            "disc size",
            "diameter (mm)",
            |n| n.diameter_mm,
            |n| Node { diameter_mm: BASE.diameter_mm, ..*n },
        ),
    ];
    let worst_loss = |chosen: &dyn Fn(&Node) -> bool| {
        stats::largest(outcomes.iter().filter(|o| chosen(&o.node)).map(Outcome::loss))
    };
    let largest_px = stats::largest(outcomes.iter().map(Outcome::noise_px));
    let caption = format!(
        "Extraction noise of a coordinate, px, over the {} discs of the chapter's four poses, each node one \
         photograph a pose, seed {seed}; the sweeps cross at blur {} px, noise {} % of full scale, discs of \
         {} mm. Notice that the detector's noise is at most {:.2} times its bound up to {SHARP_PX} px of \
         blur and {:.2} times beyond, and that the largest, {largest_px:.3} px, is {:.0} % of the chapter's \
         {CHAPTER_NOISE_PX} px.",
        outcomes[0].errors.len(),
        BASE.blur_px,
        100.0 * BASE.noise,
        BASE.diameter_mm,
        worst_loss(&|node| node.blur_px <= SHARP_PX),
        worst_loss(&|node| node.blur_px > SHARP_PX),
        100.0 * largest_px / CHAPTER_NOISE_PX
    );
    Figure::panels("noise", &panels, 3, caption)
}

fn bias_figure(exact: &[Exact], unit: &[f64]) -> Figure {
    let truth = Truth::example_camera();
    let curve = |value: &dyn Fn(&Exact) -> f64| -> Vec<(f64, f64)> {
        exact.iter().map(|e| (e.diameter_mm, value(e))).collect()
    };
    let worst = |camera: &Camera| largest_deviation(&differences(camera, &truth), unit);
    let pixels = Plot::new("centres", "diameter (mm)", "RMS distance from the truth (px)")
        .size(480.0, 360.0)
        .log_y()
        .line("uncorrected", curve(&|e| rms(&e.displacements)))
        .points("predicted bias", curve(&|e| rms(&e.biases)))
        .line("corrected", curve(&|e| rms(&e.remainder())));
    let cameras = Plot::new("camera", "diameter (mm)", "worst error (sd at 0.1 px)")
        .size(480.0, 360.0)
        .log_y()
        .line("uncorrected", curve(&|e| worst(&e.uncorrected)))
        .points("predicted", curve(&|e| worst(&e.predicted)))
        .line("corrected", curve(&|e| worst(&e.corrected)));
    let (first, last) = (&exact[0], &exact[exact.len() - 1]);
    let caption = format!(
        "Left: RMS distance of detected centres from the true ones, px. Right: error of the worst of the \
         six parameters in standard deviations under the chapter's noise of {CHAPTER_NOISE_PX} px. Four \
         poses, blur {} px, nothing drawn at random. Notice that with discs of {} mm centres {:.3} px off \
         move the camera by {:.2} standard deviations, and that correction leaves {:.4} px and {:.3} \
         standard deviations. With discs of {} mm the bias predicts an error of {:.4} standard deviations and \
         {:.4} is found: correction leaves {:.4} there too, which is the detector's own.",
        BASE.blur_px,
        last.diameter_mm,
        rms(&last.displacements),
        worst(&last.uncorrected),
        rms(&last.remainder()),
        worst(&last.corrected),
        first.diameter_mm,
        worst(&first.predicted),
        worst(&first.uncorrected),
        worst(&first.corrected)
    );
    Figure::panels("bias", &[pixels, cameras], 2, caption)
}
