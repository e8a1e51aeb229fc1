//! What makes k2 and the focal length observable, and does the reprojection error show that they are not?
//!
//! Expected: the standard deviation of k2 falls steeply with how far towards the corners the points reach,
//! that of the focal length with the tilt; without tilt the focal length is lost. The RMSE is the same
//! everywhere (section 5.3).
//!
//! Coverage `c` is a factor of its own: every view is photographed from the distance at which its outermost
//! point touches a rectangle `c` times as wide and high as the largest one about the principal point that the
//! image holds. In the view that faces the camera the target's corners then reach the fraction `c` of the way
//! to the image's. Tilt `t` is the second: the chapter's poses with (20, 20, 15) degrees replaced by (t, t,
//! 3/4 t).
//!
//! Coverage won that way is bought with distance: the farther the points shall reach, the nearer the target.
//! A second sweep keeps the distance and moves the target instead, each view towards another corner, so that
//! either cause stands alone.
//!
//! What it cannot show: what happens with wider lenses or more coefficients, or with points that are hard to
//! see at the border.

use calibench::calibrate::{Covariance, Settings};
use calibench::camera::{FreeParameters, Parameter};
use calibench::evaluate::{BoundError, RmseDistribution, cramer_rao};
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::synth::{Scene, Truth, scene::looking_at_centre};
use calibench_harness::stats::{self, Interval, each_of};
use calibench_harness::{
    Band, Context, Experiment, ExperimentError, MonteCarlo, Outcome, Progress, Record, Rows, Table,
};

mod figures;
mod one_distance;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "k2-observability",
    title: "What makes k2 and the focal length observable",
    question: "Four views, from a third of the way to the image's corners to all of it, and from no tilt to \
               45 degrees: how well are k2 and fx known, how strongly are k1 and k2 correlated, and does \
               the RMSE tell? Expected: the solver attains the Cramer-Rao bound wherever there is one; the \
               standard deviation of k2 changes by orders of magnitude while the RMSE stays flat; without \
               tilt the data are refused.",
    seed: 1,
    takes_image: false,
    run,
};

/// Standard deviation of the noise on each of u and v.
const SIGMA_PX: f64 = 0.1;
/// Trials of a node.
const TRIALS: usize = 200;
/// Trials of a node without tilt: each is refused, after a search that takes many times longer than a
/// calibration.
const TRIALS_WITHOUT_TILT: usize = 25;
/// Coverage in tenths: how far towards the corners the points reach.
const COVERAGE_TENTHS: [u32; 8] = [3, 4, 5, 6, 7, 8, 9, 10];
/// Tilt in degrees.
const TILT_DEG: [u32; 7] = [0, 5, 10, 15, 20, 30, 45];
/// Chance that a correct program fails one family of claims.
const RATE: f64 = 1e-4;
/// Where the bound of fx, a first-order prediction, is small enough to be trusted: its relative error is of
/// the order of twice the square of this, a tenth of what the trials of a node can tell.
const FIRST_ORDER: f64 = 0.03;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let trials = |tilt_deg: &u32| COVERAGE_TENTHS.len() * trials_at(*tilt_deg);
    let progress = context.progress("sweep", TILT_DEG.iter().map(trials).sum());
    let mut nodes = Vec::new();
    for tilt_deg in TILT_DEG {
        for tenths in COVERAGE_TENTHS {
            nodes.push(Node::new(tenths, tilt_deg, context.seed, &progress)?);
        }
    }
    drop(progress);
    let map = Map { nodes };
    report_numbers(&mut record, &map);
    record.table(node_table(&map));
    claim_no_tilt(&mut record, &map);
    claim_bound_attained(&mut record, &map);
    claim_flat_rmse(&mut record, &map);
    claim_cures(&mut record, &map);
    record.figure(figures::heat_maps(&map, context.seed)?);
    record.figure(figures::ratios(&map, context.seed)?);
    record.figure(figures::k2_sections(&map, context.seed));
    record.figure(figures::focal_sections(&map, context.seed));
    record.figure(figures::rmse_sections(&map, context.seed));
    one_distance::report(&mut record, &map, context)?;
    Ok(record)
}

fn trials_at(tilt_deg: u32) -> usize {
    if tilt_deg == 0 { TRIALS_WITHOUT_TILT } else { TRIALS }
}

/// One scene of the sweep.
struct Node {
    tenths: u32,
    tilt_deg: u32,
    /// Largest distance of an ideal point from the optical axis, normalised.
    largest_radius: f64,
    /// `None` where the information is singular.
    bound: Option<Covariance>,
    outcome: Outcome,
    rmse: RmseDistribution,
}

impl Node {
    fn new(tenths: u32, tilt_deg: u32, seed: u64, progress: &Progress) -> Result<Node, ExperimentError> {
        let coverage = f64::from(tenths) / 10.0;
        let truth = truth(coverage, f64::from(tilt_deg));
        let scenario = format!("k2-observability/coverage-{tenths}/tilt-{tilt_deg}");
        Node::of(truth, (tenths, tilt_deg), (seed, &scenario), progress)
    }

    /// The bound and the trials of any scene.
    fn of(
        truth: Truth,
        (tenths, tilt_deg): (u32, u32),
        (seed, scenario): (u64, &str),
        progress: &Progress,
    ) -> Result<Node, ExperimentError> {
        let scene = Scene::new(truth).map_err(ExperimentError::at("scene of a node"))?;
        let bound = match cramer_rao(&scene.truth, FreeParameters::STANDARD, SIGMA_PX) {
            Ok(bound) => Some(bound),
            Err(BoundError::Singular { .. }) => None,
            Err(error) => return Err(ExperimentError::at("Cramer-Rao bound of a node")(error)),
        };
        let settings = Settings::standard();
        let outcome = MonteCarlo {
            scene: &scene,
            settings: &settings,
            sigma_px: SIGMA_PX,
            seed,
            scenario,
            trials: trials_at(tilt_deg),
        }
        .run(progress);
        let rmse = RmseDistribution {
            sigma_px: SIGMA_PX,
            points: scene.observations(),
            parameters: FreeParameters::STANDARD.len() + 6 * scene.pixels().len(),
        };
        let largest_radius = largest_radius(&scene.truth);
        Ok(Node { tenths, tilt_deg, largest_radius, bound, outcome, rmse })
    }

    fn coverage(&self) -> f64 {
        f64::from(self.tenths) / 10.0
    }

    fn name(&self) -> String {
        format!("coverage {:.1}, tilt {} deg", self.coverage(), self.tilt_deg)
    }

    fn bound_sd(&self, parameter: Parameter) -> f64 {
        self.bound.as_ref().and_then(|b| b.standard_deviation(parameter)).unwrap_or(f64::NAN)
    }

    /// Spread of the trials; NaN where fewer than two converged.
    fn sampled_sd(&self, parameter: Parameter) -> f64 {
        if self.outcome.converged() < 2 {
            return f64::NAN;
        }
        self.outcome.errors().standard_deviation(position(parameter))
    }

    /// Spread of the trials over the bound.
    fn sd_over_bound(&self, parameter: Parameter) -> f64 {
        self.sampled_sd(parameter) / self.bound_sd(parameter)
    }

    fn bound_correlation(&self) -> f64 {
        self.bound.as_ref().and_then(|b| b.correlation(Parameter::K1, Parameter::K2)).unwrap_or(f64::NAN)
    }

    fn sampled_correlation(&self) -> f64 {
        if self.outcome.converged() < 2 {
            return f64::NAN;
        }
        self.outcome.errors().correlation(position(Parameter::K1), position(Parameter::K2))
    }

    fn sampled_rmse_px(&self) -> f64 {
        self.outcome.mean(|e| e.rmse_px)
    }

    /// Whether a first-order prediction holds here: decided by the bound alone, before any trial.
    fn is_identifiable(&self) -> bool {
        self.bound_sd(Parameter::Fx) / Truth::example_camera().fx < FIRST_ORDER
    }
}

fn position(parameter: Parameter) -> usize {
    FreeParameters::STANDARD.position(parameter).expect("only free parameters are asked for")
}

/// All nodes, tilt by tilt.
struct Map {
    nodes: Vec<Node>,
}

impl Map {
    /// The node of given coverage (tenths) and tilt (degrees).
    fn at(&self, tenths: u32, tilt_deg: u32) -> &Node {
        self.nodes
            .iter()
            .find(|n| (n.tenths, n.tilt_deg) == (tenths, tilt_deg))
            .expect("only levels of the sweep are asked for")
    }

    fn identifiable(&self) -> Vec<&Node> {
        self.nodes.iter().filter(|n| n.is_identifiable()).collect()
    }

    fn without_tilt(&self) -> impl Iterator<Item = &Node> {
        self.nodes.iter().filter(|n| n.tilt_deg == 0)
    }

    fn trials_without_tilt(&self) -> usize {
        self.without_tilt().map(|n| n.outcome.trials).sum()
    }

    fn converged_without_tilt(&self) -> usize {
        self.without_tilt().map(|n| n.outcome.converged()).sum()
    }

    /// Largest over smallest value among the identifiable nodes.
    fn range(&self, value: impl Fn(&Node) -> f64) -> f64 {
        let values = || self.identifiable().into_iter().map(&value);
        stats::largest(values()) / stats::smallest(values())
    }
}

/// The chapter's four turns with another tilt.
fn turns(tilt_deg: f64) -> [[f64; 3]; 4] {
    let t = tilt_deg;
    [[0.0, 0.0, 0.0], [t, 0.0, 0.0], [0.0, -t, 0.0], [-0.75 * t, 0.75 * t, 10.0]]
}

/// The chapter's camera and target, tilted by `tilt_deg` and photographed from where they have the given
/// coverage.
fn truth(coverage: f64, tilt_deg: f64) -> Truth {
    let chapter = Truth::example();
    let cam_from_target = turns(tilt_deg).map(|turn| framed(&chapter, turn, coverage)).to_vec();
    Truth { cam_from_target, ..chapter }
}

/// The pose at the distance where the outermost point touches the rectangle of `coverage`, by bisection:
/// coming nearer, every point moves outwards.
fn framed(truth: &Truth, turn_deg: [f64; 3], coverage: f64) -> Pose {
    let (mut near, mut far) = (0.0, FARTHEST_MM);
    loop {
        let middle = 0.5 * (near + far);
        if middle <= near || middle >= far {
            return looking_at_centre(turn_deg, far);
        }
        if reach(truth, &looking_at_centre(turn_deg, middle)) > coverage {
            near = middle;
        } else {
            far = middle;
        }
    }
}

/// From here the target is a tenth of the least coverage.
const FARTHEST_MM: f64 = 3000.0;

/// How far the outermost point reaches, as a fraction of the way from the principal point to the nearer image
/// border in its direction; infinite if a point is not in front of the camera.
fn reach(truth: &Truth, cam_from_target: &Pose) -> f64 {
    let (camera, (width, height)) = (&truth.camera, truth.image_size);
    let half = |size: usize, centre: f64| (centre + 0.5).min(size as f64 - 0.5 - centre);
    let room = Vec2::new(half(width, camera.cx), half(height, camera.cy));
    truth.points.iter().fold(0.0, |most, p| {
        let pixel = camera.project(&cam_from_target.apply(&Vec3::new(p.x, p.y, 0.0)));
        pixel.map_or(f64::INFINITY, |pixel| {
            let offset = (pixel - Vec2::new(camera.cx, camera.cy)).component_div(&room);
            offset.amax().max(most)
        })
    })
}

fn largest_radius(truth: &Truth) -> f64 {
    truth
        .cam_from_target
        .iter()
        .flat_map(|pose| truth.points.iter().map(|p| pose.apply(&Vec3::new(p.x, p.y, 0.0))))
        .fold(0.0, |most, p| (p.xy().norm() / p.z).max(most))
}

/// Convergence leaves 1e-6 of a standard deviation; bounds and means over trials know the rest to more
/// digits.
fn relative() -> Band {
    Band::relative(1e-5, "convergence of the refinement to 1e-6 of a standard deviation")
}

fn report_numbers(record: &mut Record, map: &Map) {
    let identifiable = map.identifiable().len() as f64;
    record
        .exact("")
        .count("nodes", map.nodes.len(), "scenes of the sweep")
        .number("identifiable-nodes", identifiable, "scenes whose bound of fx is below 3 %")
        .count("trials", TRIALS, "trials of a node");
    for (tenths, tilt_deg) in [(3, 20), (6, 5), (6, 20), (6, 45), (10, 5), (10, 20), (10, 45)] {
        let node = map.at(tenths, tilt_deg);
        record
            .group("", relative())
            .suffix(format!("-c{tenths}-t{tilt_deg}"), format!(", {}", node.name()))
            .number("k2-sd", node.bound_sd(Parameter::K2), "bound of k2")
            .number("k2-sd-trials", node.sampled_sd(Parameter::K2), "spread of k2")
            .unit("px")
            .number("fx-sd", node.bound_sd(Parameter::Fx), "bound of fx")
            .number("fx-sd-trials", node.sampled_sd(Parameter::Fx), "spread of fx")
            .unit("")
            .number("k1-k2", node.bound_correlation(), "correlation of k1 and k2")
            .unit("px")
            .number("rmse", node.sampled_rmse_px(), "mean RMSE");
    }
}

fn node_table(map: &Map) -> Rows<&Node> {
    let endings = |n: &Node| -> Vec<String> {
        n.outcome.endings.iter().map(|(ending, count)| format!("{ending}: {count}")).collect()
    };
    Table::of("nodes", "bound and trials at every coverage and tilt", &map.nodes)
        .column("coverage", "", |n| n.coverage())
        .column("tilt", "deg", |n| f64::from(n.tilt_deg))
        .column("largest_radius", "", |n| n.largest_radius)
        .column("k2_sd_bound", "", |n| n.bound_sd(Parameter::K2))
        .column("k2_sd_trials", "", |n| n.sampled_sd(Parameter::K2))
        .column("fx_sd_bound", "px", |n| n.bound_sd(Parameter::Fx))
        .column("fx_sd_trials", "px", |n| n.sampled_sd(Parameter::Fx))
        .column("k1_k2_bound", "", |n| n.bound_correlation())
        .column("k1_k2_trials", "", |n| n.sampled_correlation())
        .column("rmse_mean", "px", |n| n.sampled_rmse_px())
        .column("trials", "", |n| n.outcome.trials)
        .column("converged", "", |n| n.outcome.converged())
        .column("endings", "", |n| endings(n).join("; "))
}

/// Without tilt there is no bound, and every trial is refused for the right reason.
fn claim_no_tilt(record: &mut Record, map: &Map) {
    let flat: Vec<&Node> = map.without_tilt().collect();
    let refused: usize = flat.iter().map(|n| n.outcome.refused_naming(&["focal length", "distance"])).sum();
    let trials = map.trials_without_tilt();
    let what = "trials without tilt refused for focal length and distance";
    record.exact("").count("no-tilt-refused", refused, what);
    let endings: Vec<String> =
        flat.iter().map(|n| format!("{}: {:?}", n.name(), n.outcome.endings)).collect();
    record
        .claim_that(
            "no-tilt-is-refused",
            "without tilt every trial is refused, at any coverage, and focal length and distance are named \
             as inseparable",
        )
        .at_least(refused as f64, trials as f64)
        .at_rate(trials as f64 * 1e-9)
        .because(format!(
            "1e-9 a trial, the solver's rate of taking parallel planes for tilted; {}",
            endings.join("; ")
        ));
    // That their information is singular is a claim of `four-pose`.
}

fn claim_bound_attained(record: &mut Record, map: &Map) {
    let nodes = map.identifiable();
    let converges =
        |n: &&Node| (format!("{}: {:?}", n.name(), n.outcome.endings), n.outcome.converged() == TRIALS);
    record
        .claim_that(
            "identifiable-nodes-converge",
            "wherever the bound of fx is below 3 % every trial converges",
        )
        .every("nodes", nodes.iter().map(converges))
        .because("nothing is refused or lost where the camera is determined");
    let each = each_of(nodes.len(), RATE);
    let ratio = Interval::of_deviation_ratio(TRIALS, each);
    for parameter in [Parameter::K2, Parameter::Fx] {
        let cases = nodes.iter().map(|n| {
            let over = n.sd_over_bound(parameter);
            (format!("{}: {over}", n.name()), ratio.contains(over))
        });
        record
            .claim_that(
                format!("{parameter}-attains-bound"),
                format!("the spread of {parameter} equals the Cramer-Rao bound at every identifiable node"),
            )
            .every("nodes", cases)
            .at_rate(RATE)
            .because(format!(
                "sample deviation over {TRIALS} Gaussian values: ratio in [{:.4}, {:.4}], Bonferroni over \
                 {} nodes",
                ratio.low,
                ratio.high,
                nodes.len()
            ));
    }
    let cases = nodes.iter().map(|n| {
        let (bound, sampled) = (n.bound_correlation(), n.sampled_correlation());
        let around = Interval::of_correlation(bound, TRIALS, each);
        (format!("{}: {sampled} against {bound}", n.name()), around.contains(sampled))
    });
    record
        .claim_that(
            "k1-k2-correlation-attains-bound",
            "the correlation of k1 and k2 is the bound's at every identifiable node",
        )
        .every("nodes", cases)
        .at_rate(RATE)
        .because("Fisher's transformation of the sample correlation, Bonferroni over the nodes");
}

fn claim_flat_rmse(record: &mut Record, map: &Map) {
    let nodes = map.identifiable();
    let each = each_of(nodes.len(), RATE);
    let cases = nodes.iter().map(|n| {
        let rmse = n.sampled_rmse_px();
        let around = Interval::of_mean(n.rmse.mean_px(), n.rmse.standard_deviation_px(), TRIALS, each);
        (format!("{}: {rmse} px", n.name()), around.contains(rmse))
    });
    record
        .claim_that("rmse-stays-flat", "the mean RMSE is the same predicted one at every identifiable node")
        .every("nodes", cases)
        .at_rate(RATE)
        .because(
            "252 points and 30 parameters everywhere: sigma / sqrt(N) times chi with 474 degrees of \
             freedom; Bonferroni over the nodes",
        );
    let (k2, fx) = (map.range(|n| n.bound_sd(Parameter::K2)), map.range(|n| n.bound_sd(Parameter::Fx)));
    let rmse = map.range(Node::sampled_rmse_px);
    record
        .group("", relative())
        .number("k2-sd-range", k2, "largest over smallest bound of k2 at identifiable nodes")
        .number("fx-sd-range", fx, "the same of fx")
        .number("rmse-range", rmse, "the same of the mean RMSE");
    record
        .claim_that(
            "k2-changes-by-orders-of-magnitude",
            "among nodes of equal RMSE the standard deviation of k2 changes by two orders of magnitude or \
             more",
        )
        .at_least(k2, 100.0)
        .because(
            "k2 moves a point by r^5: reaching 1 / 0.3 times as far is worth 3.3^5 = 410, or less where k1 \
             takes part of it up",
        );
}

/// More coverage always helps k2, more tilt always helps the focal length.
fn claim_cures(record: &mut Record, map: &Map) {
    let tilts = TILT_DEG.iter().filter(|t| **t > 0);
    let along_coverage = tilts.flat_map(|&t| {
        COVERAGE_TENTHS.windows(2).map(move |w| (map.at(w[0], t), map.at(w[1], t), Parameter::K2))
    });
    better_and_better(
        record,
        "coverage-cures-k2",
        "at every tilt the bound of k2 falls with every step of coverage",
        along_coverage,
        "the same directions seen farther out: every derivative by k2 grows",
    );
    let along_tilt = COVERAGE_TENTHS.iter().flat_map(|&c| {
        TILT_DEG[1..].windows(2).map(move |w| (map.at(c, w[0]), map.at(c, w[1]), Parameter::Fx))
    });
    better_and_better(
        record,
        "tilt-cures-the-focal-length",
        "at every coverage the bound of fx falls with every step of tilt",
        along_tilt,
        "the perspective that tells f from Z grows with the sine of the tilt",
    );
}

fn better_and_better<'a>(
    record: &mut Record,
    id: &str,
    statement: &str,
    pairs: impl Iterator<Item = (&'a Node, &'a Node, Parameter)>,
    reason: &str,
) {
    let cases = pairs.map(|(worse, better, parameter)| {
        let (before, after) = (worse.bound_sd(parameter), better.bound_sd(parameter));
        (format!("{} to {}: {before} to {after}", worse.name(), better.name()), after < before)
    });
    record.claim_that(id, statement).every("steps", cases).because(reason);
}
