//! Who answers? Anything that takes a problem and gives an answer: this library's solver, a wrapper of it, a
//! process.

use super::accept::{Breakage, Outcome, accept, free_of};
use super::program::ProgramEnd;
use super::protocol::{Answer, AnswerCovariance, AnswerPose, Problem, Status};
use calibench::board::{View, ViewError};
use calibench::calibrate::{LensCalibration, Settings, Termination, Warning, calibrate_lens};
use calibench::camera::{Camera, FreeParameters, Lens, Model};
use calibench::geometry::{Pose, Vec2};
use calibench::io::message;
use nalgebra::Matrix6;
use rayon::prelude::*;
use std::time::Instant;

/// An outcome and the time it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Reply {
    /// What became of the problem.
    pub outcome: Outcome,
    /// From question to answer, s; NaN where it is not known, as of answers in files.
    pub seconds: f64,
}

/// A calibrator as the gate sees it.
///
/// ```
/// use calibench_gate::accept::Breakage;
/// use calibench_gate::protocol::{Answer, Problem};
/// use calibench_gate::{Builtin, Plan, Report, Solver, Terms, run};
///
/// /// Yours; this one spoils the answer of another.
/// struct Mine;
///
/// impl Solver for Mine {
///     fn name(&self) -> String {
///         "mine".to_string()
///     }
///
///     fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
///         let mut answer = Builtin.ask(problem)?;
///         if let Some(fx) = answer.parameters.get_mut("fx") {
///             *fx *= 1.001;
///         }
///         Ok(answer)
///     }
/// }
///
/// // Seed, and samples of every scenario.
/// let plan = Plan::new(1, 2)?;
/// let report = Report::new(&plan, &Mine.name(), &run(&plan, &Mine, &|_| ()), &Terms::default(), 0.0);
/// assert!(!report.held(), "a focal length too large by a thousandth is no answer to exact marks");
/// # Ok::<(), calibench_gate::PlanError>(())
/// ```
pub trait Solver: Sync {
    /// What it is called in reports.
    fn name(&self) -> String;

    /// The lens models it knows: scenes of others are not asked.
    fn models(&self) -> Vec<Model> {
        vec![Model::BrownConrady]
    }

    /// Solves one problem.
    ///
    /// # Errors
    /// No answer could be had.
    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage>;

    /// Solves many, in parallel; answers in the order of the problems.
    fn give_all(&self, problems: &[Problem]) -> Vec<Given> {
        problems.par_iter().map(|problem| Given::taken(|| self.ask(problem))).collect()
    }

    /// Ends the programs that were started to answer, and says how each ended: for the end of a run.
    fn finish(&self) -> Vec<ProgramEnd> {
        Vec::new()
    }

    /// The answers to many, checked.
    fn ask_all(&self, problems: &[Problem]) -> Vec<Reply> {
        problems.iter().zip(self.give_all(problems)).map(|(problem, given)| given.checked(problem)).collect()
    }
}

/// What was given to a question, and the time it took.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Given {
    /// The answer as it came.
    pub answer: Result<Answer, Breakage>,
    /// From question to answer, s; NaN where it is not known.
    pub seconds: f64,
}

impl Given {
    /// Asks and takes the time.
    pub fn taken(ask: impl FnOnce() -> Result<Answer, Breakage>) -> Given {
        let started = Instant::now();
        let answer = ask();
        Given { answer, seconds: started.elapsed().as_secs_f64() }
    }

    /// What the answer is to its problem.
    pub fn checked(self, problem: &Problem) -> Reply {
        let outcome = self.answer.map_or_else(Outcome::Broken, |answer| accept(problem, answer));
        Reply { outcome, seconds: self.seconds }
    }
}

/// This library's solver.
#[derive(Debug, Clone, Copy, Default)]
pub struct Builtin;

impl Solver for Builtin {
    fn name(&self) -> String {
        "calibench".into()
    }

    fn models(&self) -> Vec<Model> {
        Model::ALL.to_vec()
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        Ok(solved(problem, |settings| settings))
    }
}

fn solved(problem: &Problem, adjust: impl FnOnce(Settings) -> Settings) -> Answer {
    match solve(problem, adjust) {
        Ok(calibration) => answer(&problem.id, &calibration),
        Err(message) => Answer::without_estimate(&problem.id, Status::Refused, message),
    }
}

/// This library's solver, followed to the minimum's last digits.
#[derive(Debug, Clone, Copy, Default)]
pub struct Polished;

impl Solver for Polished {
    fn name(&self) -> String {
        "calibench, polished".into()
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        Ok(solved(problem, Settings::polished))
    }
}

/// Calibrates as the problem asks, with settings that `adjust` may change. The error is for people.
pub(super) fn solve(
    problem: &Problem,
    adjust: impl FnOnce(Settings) -> Settings,
) -> Result<LensCalibration, String> {
    let views = views(problem).map_err(|e| message(&e))?;
    calibrate_lens(&views, &adjust(settings(problem))).map_err(|e| message(&e))
}

/// The problem's correspondences as views.
pub(super) fn views(problem: &Problem) -> Result<Vec<View>, ViewError> {
    let points = |list: &[[f64; 2]]| list.iter().map(|&[x, y]| Vec2::new(x, y)).collect();
    problem.views.iter().map(|view| View::new(points(&view.target), points(&view.pixels))).collect()
}

/// What the problem wants estimated and held.
pub(super) fn settings(problem: &Problem) -> Settings {
    let [width, height] = problem.image_size;
    let model = problem.lens_model();
    let settings = Settings::new(free_of(problem)).with_model(model).with_image_size((width, height));
    model
        .parameters()
        .filter_map(|p| problem.held.get(p.name()).map(|&value| (p, value)))
        .fold(settings, |settings, (parameter, value)| settings.hold(parameter, value))
}

/// Nothing but poses is free.
pub(super) fn only_poses(camera: &Camera<Lens>) -> Settings {
    let settings = Settings::new(FreeParameters::NONE).with_model(camera.distortion.model());
    camera.values().fold(settings, |settings, (parameter, value)| settings.hold(parameter, value))
}

/// A calibration in the words of the protocol. Only warnings that question the estimate flag it: a
/// correlation between two coefficients stands in the covariance already, and that a minimum is not certified
/// is said of every lens but Brown-Conrady's.
pub(super) fn answer(id: &str, calibration: &LensCalibration) -> Answer {
    let is_plain = calibration.camera.distortion.model() == Model::BrownConrady;
    let is_flag = |warning: &&Warning| match warning {
        Warning::Correlated { .. } => false,
        Warning::NotCertified => is_plain,
        _ => true,
    };
    let covariance = &calibration.covariance;
    let names = || calibration.free.iter().map(|p| p.name().to_string());
    let flags = calibration.warnings.iter().filter(is_flag);
    Answer {
        id: id.to_string(),
        status: if calibration.is_usable() { Status::Ok } else { Status::NotConverged },
        parameters: calibration.camera.values().map(|(p, value)| (p.name().to_string(), value)).collect(),
        poses: Some(calibration.cam_from_target.iter().map(answer_pose).collect()),
        standard_deviations: None,
        covariance: Some(AnswerCovariance {
            parameters: names().collect(),
            matrix: covariance.intrinsics.row_iter().map(|row| row.iter().copied().collect()).collect(),
        }),
        pose_covariances: Some(covariance.poses.iter().map(rows).collect()),
        rmse: Some(calibration.rmse_px),
        warnings: flags.map(ToString::to_string).collect(),
        message: (calibration.termination != Termination::Converged)
            .then(|| calibration.termination.name().to_string()),
    }
}

/// A pose covariance in the words of the protocol.
pub(super) fn rows(covariance: &Matrix6<f64>) -> Vec<Vec<f64>> {
    covariance.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn answer_pose(pose: &Pose) -> AnswerPose {
    AnswerPose {
        rotation: std::array::from_fn(|r| std::array::from_fn(|c| pose.rotation[(r, c)])),
        translation: pose.translation.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Asked, Plan};

    #[test]
    fn how_a_search_ended_is_told_where_it_was_not_in_a_minimum() {
        let plan = Plan::of(1, 0, Asked { scenes: vec!["four-pose".into()], ..Asked::default() }).unwrap();
        let problem = plan.problem(&plan.cases[0]);
        assert_eq!(Builtin.ask(&problem).unwrap().message, None);
        let one_step = |mut settings: Settings| {
            settings.max_iterations = 1;
            settings.without_search()
        };
        let stopped = solve(&problem, one_step).unwrap();
        assert_ne!(stopped.termination, Termination::Converged);
        let said = answer("a", &stopped).message;
        assert_eq!(said.as_deref(), Some(stopped.termination.name()));
    }

    #[test]
    fn the_librarys_solvers_have_names_of_their_own() {
        let names = [Builtin.name(), Polished.name()];
        assert!(names[0] != names[1] && names.iter().all(|name| name.starts_with("calibench")), "{names:?}");
    }
}
