//! How do other calibrators end on the same scenes? Asked through the gate's protocol, judged by the same
//! reference.

use super::SEED;
use super::committed::DETERMINED;
use super::families::{FAMILIES, Family};
use super::oracle;
use super::scenes::Drawn;
use calibench::camera::{Camera, Parameter};
use calibench::evaluate::cramer_rao;
use calibench::geometry::Pose;
use calibench::io::write_atomically;
use calibench_gate::accept::Outcome;
use calibench_gate::protocol::Problem;
use calibench_gate::{Process, Solver};
use calibench_harness::ProgressDisplay;
use calibench_harness::fingerprint::Fingerprint;
use rayon::prelude::*;
use std::path::Path;
use std::time::Duration;

/// Scenes of the first family that other programs are asked; they are slower. Of the others: the first half
/// hundred.
const SCENES: u64 = 2000;
const NAMED_SCENES: u64 = 50;
/// A cost is the reference's if it exceeds it by less than this many noise variances: a hundredth is a tenth
/// of a standard deviation of one parameter. Wider than for this library's solver, for programs that read
/// points in single precision.
const SAME_COST_VARIANCES: f64 = 0.01;
/// Problems that are asked at once.
const CHUNK: u64 = 100;
/// Longest time for one answer.
const TIMEOUT: Duration = Duration::from_secs(120);

/// The columns of a line.
pub const HEADER: &str = "family,index,bound,ending,excess,fx";

/// How a program ended on a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name of the family.
    pub family: String,
    /// The scene's number in it.
    pub index: u64,
    /// Bound of sd(fx)/fx.
    pub bound: f64,
    /// How it ended.
    pub ending: Ending,
    /// Cost above the reference's over the noise variance; 0 without an answer.
    pub excess: f64,
    /// fx, px; 0 without an answer.
    pub fx: f64,
}

/// How a program ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// An estimate at the reference's cost or below.
    Right,
    /// An estimate at a higher cost, or one that is no camera.
    Wrong,
    /// It said that it has none.
    Refused,
    /// No answer.
    Broken,
    /// It is not made for what is asked.
    Unsupported,
}

impl Ending {
    /// All, in order.
    pub const ALL: [Ending; 5] =
        [Ending::Right, Ending::Wrong, Ending::Refused, Ending::Broken, Ending::Unsupported];

    /// The word for it.
    pub fn name(self) -> &'static str {
        ["right", "wrong", "refused", "broken", "unsupported"][self as usize]
    }
}

impl Line {
    /// Reads a line as it is written.
    pub fn read(text: &str) -> Option<Line> {
        let cells: Vec<&str> = text.split(',').collect();
        let [family, index, bound, ending, excess, fx] = cells.as_slice() else { return None };
        Some(Line {
            family: family.to_string(),
            index: index.parse().ok()?,
            bound: bound.parse().ok()?,
            ending: Ending::ALL.into_iter().find(|e| e.name() == *ending)?,
            excess: excess.parse().ok()?,
            fx: fx.parse().ok()?,
        })
    }

    fn text(&self) -> String {
        let Line { family, index, bound, ending, excess, fx } = self;
        format!("{family},{index},{bound:.2e},{},{excess:.2e},{fx:.1}\n", ending.name())
    }

    /// Whether the data determine the camera.
    pub fn is_determined(&self) -> bool {
        self.bound < DETERMINED
    }
}

/// The command that asks OpenCV.
pub const COMMAND: &str = "cargo run --release --bin global-minimum-scenes -- --peer opencv --solver 'python3 adapters/opencv_solver.py'";

/// Asks a program about the first scenes of every family, at most `first` of each, and writes how it ended to
/// `path`. Scenes whose skew is unknown are left out: few programs know it.
pub fn measure(command: &str, name: &str, jobs: usize, first: u64, path: &Path) -> Result<(), String> {
    let process = Process::new(command, TIMEOUT, jobs);
    let mut lines = String::new();
    for family in FAMILIES {
        let usual = if family.name == FAMILIES[0].name { SCENES } else { NAMED_SCENES };
        let scenes = family.scenes.min(usual).min(first);
        let progress = ProgressDisplay::stderr().start(family.name, scenes as usize);
        for first in (0..scenes).step_by(CHUNK as usize) {
            let drawn: Vec<Drawn> = (first..scenes.min(first + CHUNK))
                .into_par_iter()
                .filter_map(|index| Drawn::new(family, SEED, index))
                .filter(|drawn| !drawn.free.contains(Parameter::Skew))
                .collect();
            let problems: Vec<Problem> = drawn.iter().map(|d| problem(family, d)).collect();
            let replies = process.ask_all(&problems);
            let judged: Vec<String> = drawn
                .par_iter()
                .zip(&replies)
                .filter_map(|(drawn, reply)| Some(judge(family, drawn, &reply.outcome)?.text()))
                .collect();
            lines += &judged.concat();
            drawn.iter().for_each(|_| progress.step());
        }
    }
    let head = Fingerprint::of_global_minimum_scenes()
        .head(&format!("global-minimum-scenes --peer {name}; seed {SEED}"));
    write_atomically(path, format!("{head}\n{HEADER}\n{lines}").as_bytes()).map_err(|e| e.to_string())
}

/// The scene as the protocol tells it; every program is told the image size.
fn problem(family: &Family, drawn: &Drawn) -> Problem {
    let truth = drawn.truth();
    let id = format!("{}-{}", family.name, drawn.index);
    Problem::of_views(id, truth.image_size, &drawn.views, &truth.camera.into(), drawn.free)
}

fn judge(family: &Family, drawn: &Drawn, outcome: &Outcome) -> Option<Line> {
    let truth = drawn.truth();
    let variance = drawn.noise_px * drawn.noise_px;
    let reference = oracle::from_truth(truth, &drawn.views, drawn.free)?.cost;
    let bound = cramer_rao(truth, drawn.free, drawn.noise_px)
        .ok()
        .and_then(|bound| bound.standard_deviation(Parameter::Fx))
        .map_or(f64::INFINITY, |sd| sd / truth.camera.fx);
    let (ending, excess, fx) = match outcome {
        Outcome::Refused(_) => (Ending::Refused, 0.0, 0.0),
        Outcome::Unsupported(_) => (Ending::Unsupported, 0.0, 0.0),
        Outcome::Broken(_) => (Ending::Broken, 0.0, 0.0),
        Outcome::Estimate(estimate) => {
            let answered = estimate.camera.brown_conrady().zip(estimate.cam_from_target.as_ref());
            let cost = answered.and_then(|(camera, poses)| cost(&camera, poses, drawn));
            let excess = cost.map_or(f64::INFINITY, |cost| (cost - reference) / variance);
            let same = excess <= SAME_COST_VARIANCES;
            (if same { Ending::Right } else { Ending::Wrong }, excess, estimate.camera.fx)
        }
    };
    Some(Line { family: family.name.to_string(), index: drawn.index, bound, ending, excess, fx })
}

/// Sum of squared pixel distances at the answer's camera and poses; `None` if a mark is behind the camera.
fn cost(camera: &Camera, cam_from_target: &[Pose], drawn: &Drawn) -> Option<f64> {
    oracle::cost(camera, cam_from_target, &drawn.views).filter(|cost| cost.is_finite())
}
