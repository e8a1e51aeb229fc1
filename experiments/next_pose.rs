//! Which photograph should be taken next, and how many photographs does choosing save?
//!
//! Three views are taken, the first ones of the studies' spread. From there the set grows in four ways: each
//! next view is the one that tells most of fx, or of a direction's pixel over the whole frame, among all
//! poses of a grid (as `calibench next-pose` finds it); or the spread goes on, all views tilted alike in
//! directions that follow the golden angle; or a pose of the grid is drawn. All may use the same distances
//! and the same largest tilt.
//!
//! Expected: what is chosen for a quantity is better for it than the spread and than nearly every drawn set,
//! by some views; and since a view that is best for fx need not reach the corners, the two chosen sets
//! differ.
//!
//! What it cannot show: marks whose noise grows with tilt and distance, and boards that nobody can hold so. A
//! greedy set need not be the best of its size.

use calibench::calibrate::{Covariance, Settings};
use calibench::camera::{Camera, FreeParameters, Lens, Parameter};
use calibench::evaluate::{TakenOut, cramer_rao, frame_difference};
use calibench::geometry::Pose;
use calibench::planning::{
    Candidate, Estimated, Knowledge, Reach, Wanted, Wish, next_pose, view_information,
};
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench_harness::stats::{Interval, largest, mean, median, quantile, root_mean_square};
use calibench_harness::{
    Band, Context, Dash, Experiment, ExperimentError, Figure, Look, MonteCarlo, Plot, Record, Table,
};
use calibench_study::Spec;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "next-pose",
    title: "The next photograph, chosen",
    question: "From three views on, each next one is the pose that tells most of fx, or of a pixel over the frame. How many views \
               does that save against a spread of tilts and against poses that are drawn? Expected: some, and most for the pixel.",
    seed: 31,
    takes_image: false,
    run,
};

/// Noise on each of u and v.
const SIGMA_PX: f64 = 0.1;
/// Views of the smallest set, which all share, and of the largest.
const FEWEST: usize = 3;
const MOST: usize = 10;
/// Sets of which every further pose is drawn.
const DRAWN: usize = 200;
/// Sets whose calibrations are repeated, by their numbers of views, and how often.
const REPEATED: [usize; 2] = [4, MOST];
const TRIALS: usize = 600;
/// Chance that a correct program fails one claim.
const RATE: f64 = 1e-4;
const SIZE: (usize, usize) = Truth::EXAMPLE_IMAGE;
/// Nearest and farthest distance, mm, and the largest tilt, degrees: for every way of growing.
const NEAR_MM: f64 = 120.0;
const FAR_MM: f64 = 180.0;
const TILT_DEG: f64 = 45.0;

/// The poses of the studies: every view tilted as far as is allowed, from the middle towards the border,
/// near.
const SPREAD: &str = r#"
name = "next-pose-spread"
question = "Which poses does a study spread?"
seed = 0
scene.image = [640, 480]
scene.camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
scene.target = { columns = 9, rows = 7, spacing_mm = 10.0 }
scene.poses = { kind = "spread", views = 10, tilt_deg = 45.0, coverage = 1.0, distance_mm = 120.0 }
scene.noise_px = 0.1
trials = { per_cell = 2 }
"#;

/// What is wanted: in names, in words, and as it is asked.
const WANTED: [(&str, &str, Wanted); 2] =
    [("fx", "fx", Wanted::Parameter(Parameter::Fx)), ("pixel", "a pixel", Wanted::Pixel(SIZE))];

/// Standard deviations of fx and of a pixel over the frame, by the number of views from [`FEWEST`] on.
type Course = Vec<[f64; 2]>;

/// A set of views that grows.
struct Growth {
    name: &'static str,
    words: &'static str,
    poses: Vec<Pose>,
    course: Course,
    /// Largest relative difference between what was said of a view and what it brought; 0 where nothing was
    /// said.
    said_apart: f64,
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let scene = Scenery::new()?;
    let spread = spread_poses(&mut record)?;
    let start = &spread[..FEWEST];
    let mut grown = vec![
        scene.chosen("for-fx", "chosen for fx", start, 0)?,
        scene.chosen("for-pixel", "chosen for a pixel", start, 1)?,
    ];
    grown.push(Growth {
        name: "spread",
        words: "spread by the golden angle",
        course: scene.course(&spread)?,
        said_apart: 0.0,
        poses: spread.clone(),
    });
    let drawn = scene.drawn(context, start)?;
    record
        .exact("")
        .count("drawn", DRAWN, "sets of which every further pose is drawn")
        .count("trials", TRIALS, "calibrations of a set")
        .count("poses", scene.candidates.len(), "poses of the grid that show every mark");
    report(&mut record, &grown, &drawn);
    claim_gain(&mut record, &grown, &drawn);
    claim_said(&mut record, &grown);
    claim_trials(context, &mut record, &scene, &grown[..2])?;
    record.table(course_table(&grown, &drawn));
    record.figure(figure(&grown, &drawn, context.seed));
    Ok(record)
}

/// The camera, the board and where it may be held.
struct Scenery {
    truth: Truth,
    camera: Camera<Lens>,
    estimated: Estimated,
    wishes: Vec<Wish>,
    reach: Reach,
    candidates: Vec<Candidate>,
}

impl Scenery {
    fn new() -> Result<Scenery, ExperimentError> {
        let truth = Truth::example();
        let camera = truth.camera.into();
        let estimated = Estimated { free: FreeParameters::STANDARD, fy_per_fx: None };
        let wishes = WANTED
            .iter()
            .map(|(_, _, wanted)| Wish::of(*wanted, &camera, &estimated))
            .collect::<Result<_, _>>()
            .map_err(ExperimentError::at("what is wanted"))?;
        let tilt = TILT_DEG.to_radians();
        let reach = Reach {
            image_size: SIZE,
            margin_px: 5.0,
            distances: vec![NEAR_MM, (NEAR_MM * FAR_MM).sqrt(), FAR_MM],
            places: (7, 5),
            tilts_rad: vec![0.0, tilt / 3.0, 2.0 * tilt / 3.0, tilt],
            directions: 8,
            turns: 2,
        };
        let (candidates, _) =
            reach.candidates(&camera, &truth.points).map_err(ExperimentError::at("poses of the grid"))?;
        Ok(Scenery { truth, camera, estimated, wishes, reach, candidates })
    }

    fn bound(&self, poses: &[Pose]) -> Result<Covariance, ExperimentError> {
        let truth = Truth { cam_from_target: poses.to_vec(), ..self.truth.clone() };
        cramer_rao(&truth, self.estimated.free, SIGMA_PX).map_err(ExperimentError::at("Cramer-Rao bound"))
    }

    fn knowledge(&self, poses: &[Pose]) -> Result<Knowledge, ExperimentError> {
        Knowledge::of(self.estimated, &self.bound(poses)?.intrinsics)
            .map_err(ExperimentError::at("covariance"))
    }

    fn sds(&self, knowledge: &Knowledge) -> [f64; 2] {
        [0, 1].map(|i| self.wishes[i].standard_deviation(knowledge.covariance()))
    }

    /// Of the first views, then of more and more.
    fn course(&self, poses: &[Pose]) -> Result<Course, ExperimentError> {
        (FEWEST..=poses.len()).map(|views| Ok(self.sds(&self.knowledge(&poses[..views])?))).collect()
    }

    /// Each next view tells most of one wish.
    fn chosen(
        &self,
        name: &'static str,
        words: &'static str,
        start: &[Pose],
        wish: usize,
    ) -> Result<Growth, ExperimentError> {
        let failed = ExperimentError::at("next pose");
        let (mut poses, mut said) = (start.to_vec(), Vec::new());
        let marks = (&self.truth.points[..], SIGMA_PX);
        while poses.len() < MOST {
            let knowledge = self.knowledge(&poses)?;
            let wishes = &self.wishes[wish..=wish];
            let found = next_pose(&self.camera, &knowledge, wishes, marks, &self.reach, 1)
                .map_err(ExperimentError::at("next pose"))?;
            let best = found.ranked.first().ok_or_else(|| failed("no pose tells anything"))?;
            poses.push(best.candidate.cam_from_target);
            said.push(best.gains[0].after);
        }
        let course = self.course(&poses)?;
        let apart = course[1..].iter().zip(&said).map(|(is, said)| (said / is[wish] - 1.0).abs());
        Ok(Growth { name, words, said_apart: largest(apart), course, poses })
    }

    /// Each next view is drawn among those of the grid.
    fn drawn(&self, context: &Context, start: &[Pose]) -> Result<Vec<Course>, ExperimentError> {
        let first = self.knowledge(start)?;
        let grow = |trial: u64| -> Option<Course> {
            let key = StreamKey { seed: context.seed, scenario: "next-pose", trial, purpose: "poses" };
            let mut stream = Stream::open(key);
            let mut knowledge = first.clone();
            let mut course = vec![self.sds(&knowledge)];
            for _ in FEWEST..MOST {
                let drawn = (stream.uniform() * self.candidates.len() as f64) as usize;
                let pose = &self.candidates[drawn].cam_from_target;
                let information =
                    view_information(&self.camera, &self.estimated, pose, &self.truth.points, SIGMA_PX)?;
                knowledge = Knowledge::of(self.estimated, &knowledge.after(&information)?).ok()?;
                course.push(self.sds(&knowledge));
            }
            Some(course)
        };
        let all: Option<Vec<Course>> = (0..DRAWN as u64).map(grow).collect();
        all.ok_or_else(|| ExperimentError::at("drawn poses")("one of them fixes nothing"))
    }
}

/// The poses of the studies, from the study itself.
fn spread_poses(record: &mut Record) -> Result<Vec<Pose>, ExperimentError> {
    record.input("spread", SPREAD.as_bytes());
    let spec = Spec::parse(SPREAD).map_err(ExperimentError::at("spread"))?;
    let cells = spec.cells(SPREAD).map_err(ExperimentError::at("spread"))?;
    let poses = cells.first().and_then(|cell| cell.poses());
    poses.map(<[Pose]>::to_vec).ok_or_else(|| ExperimentError::at("spread")("its poses are not known"))
}

/// Standard deviations of drawn sets for a wish with so many views.
fn of_drawn(drawn: &[Course], wish: usize, views: usize) -> Vec<f64> {
    drawn.iter().map(|course| course[views - FEWEST][wish]).collect()
}

impl Growth {
    fn sd(&self, wish: usize, views: usize) -> f64 {
        self.course[views - FEWEST][wish]
    }

    /// The fewest views with which a wish is met; one more than the most where none does.
    fn views_for(&self, wish: usize, sd: f64) -> usize {
        (FEWEST..=MOST).find(|&views| self.sd(wish, views) <= sd).unwrap_or(MOST + 1)
    }
}

fn report(record: &mut Record, grown: &[Growth], drawn: &[Course]) {
    let band =
        Band::relative(1e-9, "the bound is a sum and an inverse; another best pose would move it by more");
    for (wish, (id, quantity, _)) in WANTED.iter().enumerate() {
        for views in [FEWEST, 4, 6, MOST] {
            let mut numbers = record.group("px", band.clone());
            numbers.suffix(format!("-{id}-{views}"), format!(" of {quantity} with {views} views"));
            for growth in grown {
                numbers.number(
                    growth.name,
                    growth.sd(wish, views),
                    format!("standard deviation, {},", growth.words),
                );
            }
            let sds = of_drawn(drawn, wish, views);
            numbers.number("drawn", median(&sds), "standard deviation, median of the sets drawn,");
            numbers.number(
                "drawn-low",
                quantile(&sds, 0.05),
                "standard deviation, 5 % of the sets drawn have less,",
            );
        }
        let chosen = &grown[wish];
        let mut counts = record.exact("");
        counts.suffix(format!("-{id}"), format!(" of {quantity}"));
        counts
            .count(
                "views-for-drawn",
                chosen.views_for(wish, median(&of_drawn(drawn, wish, MOST))),
                "chosen views that do as well as the median of ten drawn ones by the standard deviation",
            )
            .count(
                "views-for-spread",
                chosen.views_for(wish, grown[2].sd(wish, MOST)),
                "chosen views that do as well as ten of the spread by the standard deviation",
            );
    }
}

/// What is chosen for a quantity against the other ways, with the most views.
fn claim_gain(record: &mut Record, grown: &[Growth], drawn: &[Course]) {
    let cases = WANTED.iter().enumerate().map(|(wish, (_, quantity, _))| {
        let ratio = grown[wish].sd(wish, MOST) / grown[2].sd(wish, MOST);
        (format!("{quantity}: {ratio:.2} of the spread's standard deviation"), ratio < 1.0)
    });
    record
        .claim_that("chosen-beats-the-spread", "with ten views the set chosen for a quantity knows it better than the spread")
        .every("quantities", cases)
        .because("every further view is the best of a grid with the spread's distances and tilts; bounds, nothing drawn");
    for (wish, (id, quantity, _)) in WANTED.iter().enumerate() {
        let chosen = grown[wish].sd(wish, MOST);
        let better = of_drawn(drawn, wish, MOST).into_iter().filter(|sd| *sd <= chosen).count();
        let share = Interval::of_proportion(better, DRAWN, RATE).high;
        record
            .claim_that(
                format!("chosen-beats-the-drawn-{id}"),
                format!(
                    "fewer than one in ten drawn sets of ten views know {quantity} as well as the chosen one"
                ),
            )
            .at_most(share, 0.1)
            .at_rate(RATE)
            .because("the upper end of the share among the sets drawn (Wilson 1927)");
    }
    let cross = WANTED.iter().enumerate().map(|(wish, (_, quantity, _))| {
        let other = 1 - wish;
        let more = grown[other].sd(wish, MOST) / grown[wish].sd(wish, MOST);
        (format!("{quantity}: {more:.2} times the standard deviation with the other set"), more > 1.0)
    });
    record
        .claim_that(
            "each-for-its-own",
            "with ten views each chosen set is better for its own quantity than the other one",
        )
        .every("quantities", cross)
        .because("a view that tells most of one need not tell most of the other; bounds, nothing drawn");
}

/// What was said of each view before it was added.
fn claim_said(record: &mut Record, grown: &[Growth]) {
    record
        .claim_that("as-was-said", "with the view added the Cramer-Rao bound is what was said before, in every step")
        .at_most(largest(grown.iter().map(|growth| growth.said_apart)), 1e-9)
        .because("both are the same sums in another order; their rounding is 1e-16 times a condition number of 1e4 or so");
}

/// The errors of calibrations from the chosen sets.
fn claim_trials(
    context: &Context,
    record: &mut Record,
    scenery: &Scenery,
    chosen: &[Growth],
) -> Result<(), ExperimentError> {
    let progress = context.progress("calibrations", chosen.len() * REPEATED.len() * TRIALS);
    let settings = Settings::standard().with_image_size(SIZE);
    let mut cases = Vec::new();
    let mut numbers = Vec::new();
    for growth in chosen {
        for views in REPEATED {
            let truth = Truth { cam_from_target: growth.poses[..views].to_vec(), ..scenery.truth.clone() };
            let scene = Scene::new(truth).map_err(ExperimentError::at("scene"))?;
            let scenario = format!("{}-{views}", growth.name);
            let draws = MonteCarlo {
                scene: &scene,
                settings: &settings,
                sigma_px: SIGMA_PX,
                seed: context.seed,
                scenario: &scenario,
                trials: TRIALS,
            };
            let outcome = draws.run(&progress);
            let camera = scenery.truth.camera;
            let mut squares = [Vec::new(), Vec::new()];
            for estimate in &outcome.estimates {
                let moved = outcome
                    .free
                    .iter()
                    .zip(&estimate.errors)
                    .fold(camera, |moved: Camera, (p, error)| moved.with(p, camera.get(p) + error));
                let map = frame_difference(&camera, &moved, SIZE, TakenOut::Rotation)
                    .map_err(ExperimentError::at("difference over the frame"))?;
                squares[0].push((moved.fx - camera.fx) * (moved.fx - camera.fx));
                squares[1].push(map.rms_px * map.rms_px);
            }
            for (wish, (id, quantity, _)) in WANTED.iter().enumerate() {
                let sd = growth.sd(wish, views);
                let ratio: Vec<f64> = squares[wish].iter().map(|square| square / (sd * sd)).collect();
                let average = mean(&ratio);
                let spread = root_mean_square(ratio.iter().map(|r| r - average));
                let interval = Interval::of_mean(1.0, spread, ratio.len(), RATE / 8.0);
                let all = outcome.estimates.len() == TRIALS;
                let name = format!("{quantity}, {}, {views} views: {average:.3} of the bound", growth.words);
                cases.push((name, all && interval.contains(average)));
                numbers.push((format!("{scenario}-{id}"), average, growth.words, quantity, views));
            }
        }
    }
    let band = Band::relative(1e-5, "refinement converges to 1e-6 of a standard deviation");
    let mut group = record.group("", band);
    for (id, average, words, quantity, views) in numbers {
        let said = format!("mean squared error of {quantity} over the bound's, {words}, {views} views");
        group.number(format!("trials-{id}"), average, said);
    }
    record
        .claim_that(
            "calibrations-attain-the-bound",
            "calibrations from the chosen sets all converge, with the mean squared errors of the bound",
        )
        .every("quantities of sets", cases)
        .at_rate(RATE)
        .because(
            "the mean over the trials is normal, with the spread of the trials over the root of their number",
        );
    Ok(())
}

fn course_table(grown: &[Growth], drawn: &[Course]) -> Table {
    let rows: Vec<(usize, usize)> =
        (0..WANTED.len()).flat_map(|wish| (FEWEST..=MOST).map(move |views| (wish, views))).collect();
    let caption = "standard deviation of fx, and of a direction's pixel over the frame (root mean square), against the number of views";
    Table::of("courses", caption, &rows)
        .column("wanted", "", |(wish, _)| WANTED[*wish].0)
        .column("views", "", |(_, views)| *views)
        .column("for_fx", "px", |(wish, views)| grown[0].sd(*wish, *views))
        .column("for_pixel", "px", |(wish, views)| grown[1].sd(*wish, *views))
        .column("spread", "px", |(wish, views)| grown[2].sd(*wish, *views))
        .column("drawn_median", "px", |(wish, views)| median(&of_drawn(drawn, *wish, *views)))
        .column("drawn_low", "px", |(wish, views)| quantile(&of_drawn(drawn, *wish, *views), 0.05))
        .column("drawn_high", "px", |(wish, views)| quantile(&of_drawn(drawn, *wish, *views), 0.95))
        .into()
}

fn figure(grown: &[Growth], drawn: &[Course], seed: u64) -> Figure {
    let panel = |(wish, title): (usize, &str)| {
        let views = FEWEST..=MOST;
        let band: Vec<(f64, f64, f64)> = views
            .clone()
            .map(|views| {
                let sds = of_drawn(drawn, wish, views);
                (views as f64, quantile(&sds, 0.05), quantile(&sds, 0.95))
            })
            .collect();
        let middle = views.clone().map(|views| (views as f64, median(&of_drawn(drawn, wish, views))));
        let mut plot = Plot::new(title, "views", "standard deviation (px)")
            .size(460.0, 400.0)
            .log_y()
            .band(format!("9 in 10 of {DRAWN} drawn sets"), &band)
            .line_as("drawn, median", middle, Look::ink().dash(Dash::Dotted));
        for (i, growth) in grown.iter().enumerate() {
            let points: Vec<(f64, f64)> =
                views.clone().map(|views| (views as f64, growth.sd(wish, views))).collect();
            plot = plot.line_as("", points.clone(), Look::series(i)).points_as(
                growth.words,
                points,
                Look::series(i),
            );
        }
        plot
    };
    let panels: Vec<Plot> =
        [(0, "fx"), (1, "A direction's pixel over the frame")].into_iter().map(panel).collect();
    let caption = format!(
        "Cramer-Rao bound of fx, and of a direction's pixel over the frame (root mean square, a rotation taken out), for sets of views \
         that grow from the same three: each next view chosen for one of both, by the golden angle, or drawn (seed {seed}); noise of \
         {SIGMA_PX} px. Notice how many drawn views a chosen one is worth, and which set is the best for each of both."
    );
    Figure::panels("courses", &panels, 2, caption)
}
