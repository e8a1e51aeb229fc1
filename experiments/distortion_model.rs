//! What does it cost to leave the tangential terms out of the lens model?
//!
//! A lens whose elements are not quite centred distorts tangentially too (Brown 1971). The chapter holds
//! those terms at zero. Here the truth has them, from none to half of the radial displacement, and the
//! chapter's model, which has none, is fitted. A displacement of the whole lens is its RMS over all points of
//! the target in all four views: at a single point the ratio depends on where it lies (opposite corners of
//! the target differ by a factor of three). Expected: the principal point takes the place of the missing
//! terms; at a tenth of the radial ones it is off by many standard deviations; the reprojection error tells
//! of it only at a ratio where the harm is long done; and below a ratio that the linear theory names, leaving
//! them out is the better choice, because two parameters fewer have to be paid for.
//!
//! What it cannot show: lenses that no Brown-Conrady model describes (Steger, Ulrich & Wiedemann 2018).

use calibench::calibrate::{Calibration, Covariance, Settings, calibrate};
use calibench::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use calibench::evaluate::{RmseDistribution, cramer_rao};
use calibench::geometry::{Affine, Pose, Vec2, Vec3};
use calibench::synth::{Scene, Truth};
use calibench_harness::stats;
use calibench_harness::{
    Band, Context, Experiment, ExperimentError, Figure, Look, Marker, Plot, Record, Table,
};
use nalgebra::{DMatrix, DVector, Vector2};
use rayon::prelude::*;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "distortion-model",
    title: "What leaving out the tangential terms costs",
    question: "The truth has tangential distortion, from none to half of the radial displacement (RMS over \
               the target); the model that is fitted has none. How far are the parameters off, does the \
               reprojection error tell, what does it cost on the plane, and up to which ratio is the \
               smaller model the better one? Expected: at a tenth the principal point is off by many \
               standard deviations, and the RMSE tells only when the harm is long done.",
    seed: 0,
    takes_image: false,
    run,
};

/// Noise that the biases are measured against, px.
const SIGMA_PX: f64 = 0.1;
/// Tangential over radial displacement, RMS over the target's points in all views, in thousandths.
const RATIO_THOUSANDTHS: [u32; 12] = [0, 5, 10, 20, 30, 50, 75, 100, 150, 200, 300, 500];
/// The two ratios that the chapter's question is about, in thousandths.
const TENTH: u32 = 100;
const HALF: u32 = 500;
/// Direction of the decentring in the (p1, p2) plane in which the fits are made: neither axis, so that both
/// terms act.
const DIRECTION: [f64; 2] = [0.8, 0.6];
/// Steps of all other directions, degrees; the opposite direction has the opposite effect.
const DIRECTION_STEP_DEG: usize = 15;
/// The chapter's parameters, then the two tangential ones, in the order of a covariance matrix.
const FULL: FreeParameters = {
    use Parameter::*;
    FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2, P1, P2])
};

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let theory = Theory::of(&Truth::example())?;
    let unit = tangential_per_ratio(&Truth::example(), Vector2::from(DIRECTION));
    let nodes = RATIO_THOUSANDTHS
        .par_iter()
        .map(|&thousandths| Node::of(thousandths, unit))
        .collect::<Result<Vec<Node>, _>>()?;
    report_numbers(&mut record, &nodes, &theory, unit);
    report_directions(&mut record, &theory);
    claim_linear(&mut record, [&nodes[3], &nodes[2], &nodes[1]], &theory, unit);
    claim_full_model(&mut record, &nodes);
    record.table(bias_table(&nodes, &theory, unit));
    record.figure(bias_figure(&nodes, &theory, unit));
    record.figure(rmse_figure(&nodes, &theory, unit));
    Ok(record)
}

/// The chapter's scene through a lens with tangential terms.
fn decentred(p: Vector2<f64>) -> Truth {
    let chapter = Truth::example();
    let lens = BrownConrady { p1: p.x, p2: p.y, ..chapter.camera.distortion };
    Truth { camera: chapter.camera.with_distortion(lens), ..chapter }
}

/// `(p1, p2)` of a direction for a ratio of one: the tangential displacement as long as the radial one, each
/// as RMS over all points of all views. Both terms are linear in their coefficients.
fn tangential_per_ratio(truth: &Truth, direction: Vector2<f64>) -> Vector2<f64> {
    let ideal = |pose: &Pose| -> Vec<Vec2> {
        let seen = truth.points.iter().map(|p| pose.apply(&Vec3::new(p.x, p.y, 0.0)));
        seen.map(|p| p.xy() / p.z).collect()
    };
    let points: Vec<Vec2> = truth.cam_from_target.iter().flat_map(ideal).collect();
    let moved = |lens: BrownConrady| -> f64 {
        let squares = points.iter().map(|p| (lens.distort(p) - p).norm_squared());
        (squares.sum::<f64>() / points.len() as f64).sqrt()
    };
    let tangential = moved(BrownConrady { p1: direction.x, p2: direction.y, ..BrownConrady::default() });
    direction * (moved(truth.camera.distortion) / tangential)
}

/// First-order theory of a fit without the tangential terms.
///
/// With the covariance `C` of the full model at the truth, split into the chapter's parameters `a` and the
/// tangential ones `p`, holding `p` at zero moves the estimate by `-C_ap C_pp^-1 p` and leaves a sum of
/// squares `sigma^2 p' C_pp^-1 p`, as for any linear restriction of a least-squares fit.
struct Theory {
    full: Covariance,
    small: Covariance,
    /// `-C_ap C_pp^-1`.
    bias_per_p: DMatrix<f64>,
    /// `C_pp^-1`.
    weight: DMatrix<f64>,
    observations: usize,
}

impl Theory {
    fn of(truth: &Truth) -> Result<Theory, ExperimentError> {
        let bound = |free| cramer_rao(truth, free, SIGMA_PX).map_err(ExperimentError::at("bound"));
        let (full, small) = (bound(FULL)?, bound(FreeParameters::STANDARD)?);
        let n = small.free.len();
        let tangential = full.intrinsics.view((n, n), (2, 2)).into_owned();
        let weight = tangential
            .try_inverse()
            .ok_or_else(|| ExperimentError::Input("the tangential terms are not identifiable".to_string()))?;
        let bias_per_p = -full.intrinsics.view((0, n), (n, 2)) * &weight;
        let observations = truth.points.len() * truth.cam_from_target.len();
        Ok(Theory { full, small, bias_per_p, weight, observations })
    }

    fn bias(&self, p: Vector2<f64>) -> DVector<f64> {
        &self.bias_per_p * DVector::from_row_slice(p.as_slice())
    }

    /// RMSE per point that remains without noise, px.
    fn rmse_px(&self, p: Vector2<f64>) -> f64 {
        let p = DVector::from_row_slice(p.as_slice());
        SIGMA_PX * (p.dot(&(&self.weight * &p)) / self.observations as f64).sqrt()
    }

    fn small_sd(&self, parameter: Parameter) -> f64 {
        self.small.standard_deviation(parameter).unwrap_or(f64::NAN)
    }

    fn full_sd(&self, parameter: Parameter) -> f64 {
        self.full.standard_deviation(parameter).unwrap_or(f64::NAN)
    }

    /// What the RMSE of the small model is under noise alone.
    fn noise(&self) -> RmseDistribution {
        let free = self.small.free.len() + 6 * self.small.poses.len();
        RmseDistribution { sigma_px: SIGMA_PX, points: self.observations, parameters: free }
    }

    /// Root of the expected squared RMSE where `rmse_px` remain without noise: the two add as squares.
    fn with_noise_px(&self, rmse_px: f64) -> f64 {
        let noise = self.noise().root_mean_square_px();
        (rmse_px * rmse_px + noise * noise).sqrt()
    }

    /// The ratio at which noise and what is left together leave the central 99 % of the RMSE that noise alone
    /// predicts.
    fn rmse_notices(&self, unit: Vector2<f64>) -> f64 {
        let noise = self.noise();
        let (high, expected) = (noise.interval_px(0.01).high, noise.root_mean_square_px());
        (high * high - expected * expected).sqrt() / self.rmse_px(unit)
    }

    /// How far the principal point is off at a ratio, px.
    fn centre_shift_px(&self, p: Vector2<f64>) -> f64 {
        let bias = self.bias(p);
        Vector2::new(bias[2], bias[3]).norm()
    }

    /// The ratio at which both models have the same mean squared distance of the principal point from the
    /// truth.
    fn centre_break_even(&self, unit: Vector2<f64>) -> f64 {
        let square = |sd: f64| sd * sd;
        let gain = |p: Parameter| square(self.full_sd(p)) - square(self.small_sd(p));
        (gain(Parameter::Cx) + gain(Parameter::Cy)).sqrt() / self.centre_shift_px(unit)
    }

    /// The ratio at which both models have the same mean squared error of a parameter:
    /// `bias^2 + sd_small^2 = sd_full^2`.
    fn break_even(&self, parameter: Parameter, unit: Vector2<f64>) -> f64 {
        let at_one = self.small.free.position(parameter).map_or(f64::NAN, |i| self.bias(unit)[i]);
        let (small, full) = (self.small_sd(parameter), self.full_sd(parameter));
        (full * full - small * small).sqrt() / at_one.abs()
    }
}

/// The fit of the small and of the full model to exact pixels.
struct Node {
    ratio: f64,
    /// Estimate minus truth, in the order of the chapter's parameters.
    bias: Vec<f64>,
    rmse_px: f64,
    full_rmse_px: f64,
    /// Residual of an affine map of the corrected facing view to the target, RMS and largest, mm.
    plane_mm: (f64, f64),
}

impl Node {
    fn of(thousandths: u32, unit: Vector2<f64>) -> Result<Node, ExperimentError> {
        Node::fitted(f64::from(thousandths) / 1000.0, unit)
    }

    fn fitted(ratio: f64, unit: Vector2<f64>) -> Result<Node, ExperimentError> {
        let scene = Scene::new(decentred(unit * ratio)).map_err(ExperimentError::at("scene"))?;
        let fit = |free: FreeParameters| -> Result<Calibration, ExperimentError> {
            calibrate(&scene.exact(), &Settings::new(free)).map_err(ExperimentError::at("calibration"))
        };
        let (small, full) = (fit(FreeParameters::STANDARD)?, fit(FULL)?);
        let truth = &scene.truth.camera;
        let bias = FreeParameters::STANDARD.iter().map(|p| small.camera.get(p) - truth.get(p)).collect();
        let plane_mm = plane_residual_mm(&scene, &small.camera)?;
        Ok(Node { ratio, bias, rmse_px: small.rmse_px, full_rmse_px: full.rmse_px, plane_mm })
    }

    fn bias_of(&self, parameter: Parameter) -> f64 {
        FreeParameters::STANDARD.position(parameter).map_or(f64::NAN, |i| self.bias[i])
    }
}

/// Corrects the facing view with a camera and maps it to the target: what is left is distortion that the
/// camera did not explain.
fn plane_residual_mm(scene: &Scene, camera: &Camera) -> Result<(f64, f64), ExperimentError> {
    let corrected = scene.pixels()[0].iter().map(|pixel| camera.correct_pixel(pixel));
    let corrected = corrected.collect::<Result<Vec<Vec2>, _>>().map_err(ExperimentError::at("correction"))?;
    let points = &scene.truth.points;
    let map = Affine::fit(&corrected, points).map_err(ExperimentError::at("affine fit"))?;
    let distances: Vec<f64> = corrected.iter().zip(points).map(|(c, p)| (map.apply(c) - p).norm()).collect();
    let square = distances.iter().map(|d| d * d).sum::<f64>() / distances.len() as f64;
    Ok((square.sqrt(), distances.iter().fold(0.0, |largest, d| d.max(largest))))
}

fn report_numbers(record: &mut Record, nodes: &[Node], theory: &Theory, unit: Vector2<f64>) {
    use Parameter::*;
    // The solver stops where a step is below 1e-6 standard deviations or so; a bias of many of them moves by
    // less than 1e-6.
    let stop = || Band::relative(1e-6, "where the solver stops");
    let theory_band = || Band::relative(1e-8, "inverse of the information matrix");
    for (prefix, thousandths) in [("tenth-", TENTH), ("half-", HALF)] {
        let Some(node) = nodes.iter().find(|n| (n.ratio - f64::from(thousandths) / 1000.0).abs() < 1e-12)
        else {
            continue;
        };
        let mut numbers = record.group("", stop());
        numbers.prefix(prefix);
        for p in [Fx, Cx, Cy, K1, K2] {
            let bias = node.bias_of(p);
            let z = bias.abs() / theory.small_sd(p);
            numbers
                .unit(p.unit())
                .number(format!("{p}-bias"), bias, format!("{p}, estimate minus truth"))
                .unit("")
                .number(format!("{p}-z"), z, format!("the same in standard deviations of {p}"));
        }
        let with_noise = theory.with_noise_px(node.rmse_px);
        let rise = with_noise / theory.with_noise_px(0.0) - 1.0;
        numbers
            .unit("px")
            .number("rmse", node.rmse_px, "RMSE without noise")
            .number("rmse-noisy", with_noise, "RMSE to expect with noise")
            .unit("")
            .number("rmse-rise", rise, "rise of the expected RMSE above that of noise alone, as a fraction")
            .unit("mm")
            .number("plane-mm", node.plane_mm.0, "RMS residual on the plane after correction")
            .number("plane-max-mm", node.plane_mm.1, "largest residual on the plane");
    }
    let notices = theory.rmse_notices(unit);
    let noise = theory.with_noise_px(0.0);
    let noisy = theory.with_noise_px(theory.rmse_px(unit * notices));
    let bias = theory.bias(unit * notices)[2].abs() / theory.small_sd(Cx);
    let leaves = "ratio at which the expected RMSE leaves the central 99 % of its prediction";
    let equal = "p1 where tangential and radial displacement are equal in the RMS over the target";
    let differ = "largest over smallest tangential displacement at the corners of the facing target";
    record
        .group("", theory_band())
        .number("rmse-notices", notices, leaves)
        .unit("px")
        .number("rmse-noise", noise, "RMSE to expect from noise alone")
        .number("rmse-notices-px", noisy, "RMSE to expect at that ratio")
        .unit("")
        .number("rmse-notices-cx-z", bias, "bias of cx at that ratio, in standard deviations")
        .band(Band::relative(1e-12, "rounding"))
        .number("p1-per-ratio", unit.x, equal)
        .number("corners-differ", corners_differ(&Truth::example()), differ)
        .number("p2-per-ratio", unit.y, "p2 there");
    for p in [Fx, Cx, Cy] {
        let (inflation, even) = (theory.full_sd(p) / theory.small_sd(p), theory.break_even(p, unit));
        let wider = format!("standard deviation of {p} with the tangential terms over that without");
        let better = format!("ratio below which {p} is better without them: same mean squared error");
        record.group("", theory_band()).number(format!("{p}-inflation"), inflation, wider).number(
            format!("{p}-break-even"),
            even,
            better,
        );
    }
}

/// Largest over smallest tangential displacement at the four corners of the facing target: why one corner
/// does not speak for the lens.
fn corners_differ(truth: &Truth) -> f64 {
    let direction = Vector2::from(DIRECTION);
    let lens = BrownConrady { p1: direction.x, p2: direction.y, ..BrownConrady::default() };
    let distance = truth.cam_from_target[0].translation.z;
    let farthest = truth.points.iter().map(Vec2::norm_squared).fold(0.0, f64::max);
    let corners = truth.points.iter().filter(|p| p.norm_squared() == farthest).map(|p| p / distance);
    let moved: Vec<f64> = corners.map(|p| (lens.distort(&p) - p).norm()).collect();
    moved.iter().copied().fold(0.0, f64::max) / moved.iter().copied().fold(f64::INFINITY, f64::min)
}

/// What the linear theory says of one direction of the decentring, at its own ratio of one.
struct Direction {
    degrees: f64,
    /// `(p1, p2)` at a ratio of a tenth, and the bias there.
    tenth: Vector2<f64>,
    bias: DVector<f64>,
    centre_shift_px: f64,
    rmse_notices: f64,
    centre_break_even: f64,
}

impl Direction {
    fn of(degrees: f64, theory: &Theory) -> Direction {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        let unit = tangential_per_ratio(&Truth::example(), Vector2::new(cos, sin));
        let tenth = unit * (f64::from(TENTH) / 1000.0);
        Direction {
            degrees,
            tenth,
            bias: theory.bias(tenth),
            centre_shift_px: theory.centre_shift_px(tenth),
            rmse_notices: theory.rmse_notices(unit),
            centre_break_even: theory.centre_break_even(unit),
        }
    }
}

fn report_directions(record: &mut Record, theory: &Theory) {
    let directions: Vec<Direction> =
        (0..180).step_by(DIRECTION_STEP_DEG).map(|degrees| Direction::of(degrees as f64, theory)).collect();
    let caption = "linear theory for every direction of the decentring: principal point at a ratio of a \
                   tenth, the ratio at which the RMSE leaves its range, and that up to which the smaller \
                   model has the better principal point";
    record.table(
        Table::of("directions", caption, &directions)
            .column("direction", "deg", |d| d.degrees)
            .column("p1_at_a_tenth", "", |d| d.tenth.x)
            .column("p2_at_a_tenth", "", |d| d.tenth.y)
            .column("cx_bias", "px", |d| d.bias[2])
            .column("cy_bias", "px", |d| d.bias[3])
            .column("centre_shift", "px", |d| d.centre_shift_px)
            .column("rmse_notices", "", |d| d.rmse_notices)
            .column("centre_break_even", "", |d| d.centre_break_even),
    );
    let mut ends = |id: &str, unit: &str, value: fn(&Direction) -> f64, what: &str| {
        let values = || directions.iter().map(value);
        record
            .group(unit, Band::relative(1e-8, "inverse of the information matrix"))
            .prefix(id)
            .number("-least", stats::smallest(values()), format!("{what}, least over the directions"))
            .number("-most", stats::largest(values()), format!("{what}, most over the directions"));
    };
    let shift = "distance of the principal point from the truth at a tenth";
    ends("tenth-centre-shift", "px", |d| d.centre_shift_px, shift);
    let notices = "ratio at which the expected RMSE leaves the central 99 % of its prediction";
    ends("rmse-notices", "", |d| d.rmse_notices, notices);
    let break_even = "ratio below which the principal point is better without the tangential terms";
    ends("centre-break-even", "", |d| d.centre_break_even, break_even);
}

/// A smooth function of the ratio at a ratio of zero, from its values at `h`, `h / 2` and `h / 4` (Richardson
/// 1911): each step removes the lowest power that is left, `2 f(h/2) - f(h)` the first and
/// `(4 g(h/2) - g(h)) / 3` the second.
struct AtZero {
    value: DVector<f64>,
    /// What the last step changed. It is all of the second power, of which the value is free: where powers
    /// fall from step to step, what the value still lacks is smaller.
    correction: f64,
    /// What the step before changed.
    before: f64,
}

impl AtZero {
    fn of([f, half, quarter]: [DVector<f64>; 3]) -> AtZero {
        let first = &half * 2.0 - &f;
        let second = &quarter * 2.0 - &half;
        let value = (&second * 4.0 - &first) / 3.0;
        AtZero { correction: (&value - &second).norm(), before: (&second - &quarter).norm(), value }
    }
}

/// The gain relative to the cost below which the solver ends.
const RELATIVE_GAIN: f64 = 1e-14;

/// The linear theory is exact at a ratio of zero. So bias and RMSE, each per ratio, are extrapolated to zero
/// from three ratios of which each is half the one before, and must meet the theory within the
/// extrapolation's own last correction and what the solver leaves. A cost of `c` (in units of the noise's
/// variance) ends the search within `sqrt(1e-14 c)` standard deviations of the minimum, in the metric of the
/// covariance; six parameters share it.
fn claim_linear(record: &mut Record, nodes: [&Node; 3], theory: &Theory, unit: Vector2<f64>) {
    let sds: Vec<f64> = FreeParameters::STANDARD.iter().map(|p| theory.small_sd(p)).collect();
    let in_sds =
        |bias: &[f64]| DVector::from_iterator(sds.len(), bias.iter().zip(&sds).map(|(b, sd)| b / sd));
    let predicted = in_sds(theory.bias(unit).as_slice());
    let smallest = nodes[2];
    let linear = theory.bias(unit * smallest.ratio);
    let rest = smallest.bias.iter().zip(&linear).zip(&sds).map(|((b, l), sd)| (b - l) / sd);
    let remainder = rest.map(|z| z * z).sum::<f64>().sqrt();
    record.group("", Band::relative(1e-3, "where the solver stops")).number(
        "linear-remainder",
        remainder,
        "bias less its linear prediction at the smallest ratio, in standard deviations",
    );
    let bias = AtZero::of(nodes.map(|n| in_sds(&n.bias) / n.ratio));
    let cost = |n: &Node| theory.observations as f64 * (n.rmse_px / SIGMA_PX) * (n.rmse_px / SIGMA_PX);
    // The weights of the three values, 1/3, 2 and 8/3, add up to five.
    let left = |n: &Node| (sds.len() as f64 * RELATIVE_GAIN * cost(n)).sqrt() / n.ratio;
    let solver = 5.0 * nodes.iter().map(|n| left(n)).fold(0.0, f64::max);
    record
        .claim_that(
            "bias-is-linear",
            "the bias is the linear theory's: extrapolated to a ratio of zero, bias per ratio meets it, \
             relative to its length",
        )
        .at_most(
            (&bias.value - &predicted).norm() / predicted.norm(),
            (bias.correction + solver) / predicted.norm(),
        )
        .because(
            "the last correction of the extrapolation, from this run, and the solver's end: a relative gain \
             of 1e-14",
        );
    let rmse =
        AtZero::of(nodes.map(|n| DVector::from_element(1, n.rmse_px / theory.rmse_px(unit * n.ratio))));
    // Rounding of pixels below 1000 is 1.1e-13 in each of some 40 operations, against the RMSE of the
    // smallest ratio.
    let rounding = 5.0 * 1e-11 / smallest.rmse_px;
    record
        .claim_that(
            "rmse-is-predicted",
            "without noise the RMSE is that of the linear theory, p' C^-1 p: extrapolated to a ratio of \
             zero, their quotient is one",
        )
        .at_most((rmse.value[0] - 1.0).abs(), rmse.correction + rounding)
        .because("the last correction of the extrapolation, from this run, and rounding of the pixels");
    record
        .claim_that(
            "extrapolation-converges",
            "the corrections of both extrapolations fall from step to step, so that the last of them bounds \
             what is left",
        )
        .every(
            "extrapolations",
            [("bias", &bias), ("RMSE", &rmse)].map(|(name, a)| {
                (format!("{name}: {} after {}", a.correction, a.before), a.correction < a.before)
            }),
        )
        .because("powers of the ratio, each removed in turn");
}

fn claim_full_model(record: &mut Record, nodes: &[Node]) {
    let cases = nodes.iter().map(|n| {
        // Rounding of pixels below 1000 is 1.1e-13 in each of some 40 operations.
        (format!("ratio {}: RMSE {} px", n.ratio, n.full_rmse_px), n.full_rmse_px < 1e-11)
    });
    record
        .claim_that("full-model-is-exact", "with the tangential terms every exact scene is fitted exactly")
        .every("ratios", cases.collect::<Vec<_>>())
        .because("the truth is in the model; rounding of pixels");
}

fn bias_table(nodes: &[Node], theory: &Theory, unit: Vector2<f64>) -> Table {
    use Parameter::*;
    let caption =
        "what a fit without the tangential terms costs, against their ratio to the radial ones; no noise";
    Table::of("bias", caption, nodes)
        .column("ratio", "", |n| n.ratio)
        .column("cx_bias", "px", |n| n.bias_of(Cx))
        .column("cx_predicted", "px", |n| theory.bias(unit * n.ratio)[2])
        .column("cy_bias", "px", |n| n.bias_of(Cy))
        .column("fx_bias", "px", |n| n.bias_of(Fx))
        .column("k1_bias", "", |n| n.bias_of(K1))
        .column("k2_bias", "", |n| n.bias_of(K2))
        .column("rmse", "px", |n| n.rmse_px)
        .column("plane_rms", "mm", |n| n.plane_mm.0)
        .column("plane_max", "mm", |n| n.plane_mm.1)
        .into()
}

/// Where a curve first rises through one, straight between its nodes on logarithmic axes; NaN where it does
/// not.
fn reaches_one(curve: &[(f64, f64)]) -> f64 {
    let rise = curve.windows(2).find(|pair| pair[0].1 < 1.0 && pair[1].1 >= 1.0);
    rise.map_or(f64::NAN, |pair| {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        x0 * libm::pow(x1 / x0, libm::log(1.0 / y0) / libm::log(y1 / y0))
    })
}

fn bias_figure(nodes: &[Node], theory: &Theory, unit: Vector2<f64>) -> Figure {
    use Parameter::*;
    let shown = &nodes[1..];
    let curve = |p: Parameter| -> Vec<(f64, f64)> {
        shown.iter().map(|n| (n.ratio, n.bias_of(p).abs() / theory.small_sd(p))).collect()
    };
    // The axis is logarithmic, so that a sign has to be told by the marker.
    let of_sign = |p: Parameter, sign: f64| {
        let here = shown.iter().filter(move |n| sign * n.bias_of(p) > 0.0);
        here.map(move |n| (n.ratio, n.bias_of(p).abs() / theory.small_sd(p))).collect::<Vec<_>>()
    };
    let linear = shown.iter().map(|n| (n.ratio, theory.bias(unit * n.ratio)[2].abs() / theory.small_sd(Cx)));
    let plot = Plot::new(
        "Bias of a model without tangential terms",
        "tangential over radial displacement (RMS)",
        "bias (standard deviations)",
    )
    .points("cx", curve(Cx))
    .points("cy", curve(Cy))
    .points("fx", curve(Fx))
    .points("k1, above zero", of_sign(K1, 1.0))
    .points_as("k1, below zero", of_sign(K1, -1.0), Look::series(3).marker(Marker::Circle))
    .line("cx, linear theory", linear)
    .hline("one standard deviation", 1.0)
    .log_x()
    .log_y();
    let caption = format!(
        "Bias of the chapter's model on exact pixels of a decentred lens, in standard deviations for noise \
         of {SIGMA_PX} px; nothing is drawn at random. Notice where a bias reaches one standard deviation: \
         cx at a ratio of {:.3}, cy at {:.3}, k1 at {:.2}, fx at {:.2}.",
        reaches_one(&curve(Cx)),
        reaches_one(&curve(Cy)),
        reaches_one(&curve(K1)),
        reaches_one(&curve(Fx))
    );
    Figure::plot("bias", &plot, caption)
}

fn rmse_figure(nodes: &[Node], theory: &Theory, unit: Vector2<f64>) -> Figure {
    let noisy = nodes.iter().map(|n| (n.ratio, theory.with_noise_px(n.rmse_px)));
    let noise = theory.noise();
    let notices = theory.rmse_notices(unit);
    let plot = Plot::new(
        "Does the reprojection error tell?",
        "tangential over radial displacement (RMS)",
        "RMSE (px)",
    )
    .line("without noise", nodes.iter().map(|n| (n.ratio, n.rmse_px)))
    .line(format!("expected with noise of {SIGMA_PX} px"), noisy)
    .hline("noise alone: 99.5 % lie below", noise.interval_px(0.01).high);
    let caption = format!(
        "RMSE per point of the model without tangential terms, without noise and as expected with noise of \
         {SIGMA_PX} px; nothing is drawn at random. The second begins at {:.4} px, what noise alone leaves \
         after the fit of {} parameters. Notice that it passes what noise alone explains at a ratio of \
         {:.3}, where the bias of cx is {:.0} standard deviations.",
        noise.root_mean_square_px(),
        noise.parameters,
        notices,
        theory.bias(unit * notices)[2].abs() / theory.small_sd(Parameter::Cx)
    );
    Figure::plot("rmse", &plot, caption)
}
