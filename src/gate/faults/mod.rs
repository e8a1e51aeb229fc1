//! Would the gate notice? Faults of the kinds that calibrators have, planted in this library's correct
//! solver.

mod estimation;
mod input;
mod lens;
mod output;
mod protocol;
mod uncertainty;

use super::accept::Breakage;
use super::protocol::{Answer, Problem, Status};
use super::solver::{Builtin, Solver, answer, solve};
use calibench::calibrate::Settings;
use calibench::camera::{Camera, Model, Parameter};
use calibench::geometry::{Vec2, Vec3};
use calibench::synth::fnv1a;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// How hard a fault is to see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Class {
    /// A quick run must catch it.
    Gross,
    /// It hides in the noise, or is rare: a thorough run must catch it.
    Subtle,
}

/// A faulty solver; its second argument tells how often the problem was asked before.
type How = fn(&Problem, &dyn Fn() -> u64) -> Answer;

/// A fault.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Planted {
    /// Name.
    pub id: &'static str,
    /// What is wrong.
    pub about: &'static str,
    /// How hard it is to see.
    pub class: Class,
    /// The lens models on whose scenes it is looked for.
    pub models: &'static [Model],
    how: How,
}

/// All planted faults.
pub fn planted() -> Vec<Planted> {
    [output::FAULTS, uncertainty::FAULTS, input::FAULTS, estimation::FAULTS, protocol::FAULTS, lens::FAULTS]
        .concat()
}

/// A solver with a planted fault.
#[derive(Debug)]
pub struct Faulty {
    fault: Planted,
    /// How often each problem was asked, by its fingerprint: a count of all calls would depend on the order
    /// of threads.
    asked: Mutex<BTreeMap<u64, u64>>,
}

impl Faulty {
    /// The solver with this fault.
    pub fn new(fault: Planted) -> Faulty {
        Faulty { fault, asked: Mutex::default() }
    }

    fn asked_before(&self, problem: &Problem) -> u64 {
        let points = problem.views.iter().flat_map(|v| v.target.iter().chain(&v.pixels).flatten());
        let fingerprint = mixed(points.flat_map(|x| x.to_bits().to_le_bytes()));
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        let count = asked.entry(fingerprint).or_default();
        *count += 1;
        *count - 1
    }
}

impl Solver for Faulty {
    fn name(&self) -> String {
        format!("calibench with {}", self.fault.id)
    }

    fn models(&self) -> Vec<Model> {
        self.fault.models.to_vec()
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        Ok((self.fault.how)(problem, &|| self.asked_before(problem)))
    }
}

const fn gross(id: &'static str, about: &'static str, how: How) -> Planted {
    Planted { id, about, class: Class::Gross, models: &[Model::BrownConrady], how }
}

const fn subtle(id: &'static str, about: &'static str, how: How) -> Planted {
    Planted { id, about, class: Class::Subtle, models: &[Model::BrownConrady], how }
}

/// The correct answer.
fn correct(problem: &Problem) -> Answer {
    let refused =
        |breakage: Breakage| Answer::without_estimate(&problem.id, Status::Refused, breakage.to_string());
    Builtin.ask(problem).unwrap_or_else(refused)
}

/// The correct answer, spoilt where it is an estimate.
fn spoilt(problem: &Problem, spoil: impl FnOnce(&mut Answer)) -> Answer {
    let mut answer = correct(problem);
    if answer.status == Status::Ok {
        spoil(&mut answer);
    }
    answer
}

/// The answer of a run with other settings, stated as good however it ended. Where parameters were held that
/// should have been estimated, the standard deviations are those of the correct answer: the fault itself is
/// to be noticed, not a gap.
fn with_settings(problem: &Problem, adjust: impl FnOnce(Settings) -> Settings) -> Answer {
    let right = correct(problem);
    if right.status != Status::Ok {
        return right;
    }
    match solve(problem, adjust) {
        Err(message) => Answer::without_estimate(&problem.id, Status::Refused, message),
        Ok(calibration) => {
            let mut given = answer(&problem.id, &calibration);
            given.status = Status::Ok;
            given.message = None;
            given.warnings = right.warnings;
            if given.covariance.as_ref().is_none_or(|c| c.parameters.len() < problem.free.len()) {
                given.covariance = right.covariance;
                given.pose_covariances = right.pose_covariances;
            }
            given
        }
    }
}

/// Degrees of freedom of the residuals.
fn freedom(problem: &Problem) -> f64 {
    (2 * problem.points() - problem.free.len() - 6 * problem.views.len()) as f64
}

fn camera_of(answer: &Answer) -> Camera {
    Camera::from_parameters(Parameter::ALL.map(|p| answer.parameters.get(p.name()).copied().unwrap_or(0.0)))
}

/// Target point and residual (predicted - observed, px) of every point that the answer puts before the
/// camera.
fn residuals(problem: &Problem, answer: &Answer) -> Vec<(Vec2, Vec2)> {
    let camera = camera_of(answer);
    let mut residuals = Vec::with_capacity(problem.points());
    for (pose, view) in answer.poses.iter().flatten().zip(&problem.views) {
        let pose = pose.pose();
        for (&[x, y], &[u, v]) in view.target.iter().zip(&view.pixels) {
            let predicted = camera.project(&pose.apply(&Vec3::new(x, y, 0.0)));
            residuals.extend(predicted.map(|p| (Vec2::new(x, y), p - Vec2::new(u, v))));
        }
    }
    residuals
}

/// Whether this problem is among one in `rate`, chosen by its pixels: the same in every run, and when it is
/// asked again.
fn chosen(problem: &Problem, rate: u64) -> bool {
    fingerprint(problem).is_multiple_of(rate)
}

/// FNV-1a over the bits of the pixels, mixed by a final multiplication and shift.
fn fingerprint(problem: &Problem) -> u64 {
    let pixels = problem.views.iter().flat_map(|v| v.pixels.iter().flatten());
    mixed(pixels.flat_map(|x| x.to_bits().to_le_bytes()))
}

fn mixed(bytes: impl Iterator<Item = u8>) -> u64 {
    let sum = fnv1a(bytes);
    (sum ^ (sum >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd) >> 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Asked, Case, Plan, Purpose};

    /// The first sample of a scene, or its problem where it is bad input.
    pub(super) fn asked_of(scene: &str) -> Problem {
        let plan = Plan::of(1, 1, Asked { models: Model::ALL.to_vec(), scenes: vec![scene.into()] }).unwrap();
        plan.problem(plan.cases.iter().find(|case| case.purpose != Purpose::Exact).unwrap())
    }

    /// What a solver with this fault answers at first.
    pub(super) fn with_fault(id: &str, problem: &Problem) -> Answer {
        Faulty::new(planted().into_iter().find(|fault| fault.id == id).unwrap()).ask(problem).unwrap()
    }

    #[test]
    fn there_are_enough_faults_and_each_has_its_name() {
        let faults = planted();
        assert!(faults.len() >= 25);
        for (i, fault) in faults.iter().enumerate() {
            assert!(faults[..i].iter().all(|other| other.id != fault.id), "{}", fault.id);
        }
    }

    #[test]
    fn one_in_a_hundred_is_one_in_a_hundred() {
        let count = (0..20_000u32).filter(|i| mixed(i.to_le_bytes().into_iter()).is_multiple_of(100)).count();
        // Binomial: 200 +- 14; five standard deviations.
        assert!((130..270).contains(&count), "{count}");
    }

    #[test]
    fn degrees_of_freedom_are_those_of_the_scene() {
        let plan = Plan::new(1, 1).unwrap();
        for (index, scenario) in plan.scenarios.iter().enumerate() {
            let problem = plan.problem(&Case { scenario: index, purpose: Purpose::Sample, trial: 0 });
            assert_eq!(freedom(&problem), scenario.degrees_of_freedom() as f64, "{}", scenario.id);
        }
        // Four views of 63 marks, six parameters.
        assert_eq!(plan.scenarios[0].degrees_of_freedom(), 2 * 252 - 6 - 24);
    }

    #[test]
    fn the_last_bit_of_fx_changes_with_every_time_that_a_problem_is_asked() {
        let faulty = Faulty::new(planted().into_iter().find(|fault| fault.id == "last-bits").unwrap());
        let plan = Plan::of(1, 4, Asked { scenes: vec!["four-pose".into()], ..Asked::default() }).unwrap();
        for case in plan.cases.iter().filter(|case| case.purpose == Purpose::Sample) {
            let problem = plan.problem(case);
            let bits = |solver: &dyn Solver| solver.ask(&problem).unwrap().parameters["fx"].to_bits();
            let right = bits(&Builtin);
            assert_eq!([(); 3].map(|()| bits(&faulty) ^ right), [0, 1, 0]);
        }
    }

    #[test]
    fn a_fault_is_looked_for_on_the_scenes_of_its_lenses() {
        let lenses =
            |id: &str| Faulty::new(planted().into_iter().find(|fault| fault.id == id).unwrap()).models();
        assert_eq!(lenses("biased-fx"), [Model::BrownConrady]);
        assert_eq!(lenses("another-lens"), [Model::KannalaBrandt]);
        assert_eq!(lenses("marks-far-out-dropped"), Model::ALL[1..]);
    }

    #[test]
    fn what_is_held_by_fault_is_stated_with_the_right_covariance_and_all_else_with_its_own() {
        let problem = asked_of("four-pose");
        let right = correct(&problem);
        let held = with_fault("k2-ignored", &problem);
        assert_eq!(held.parameters["k2"], 0.0);
        assert_eq!(
            (held.covariance, held.pose_covariances),
            (right.covariance.clone(), right.pose_covariances)
        );
        assert_ne!(with_fault("no-refinement", &problem).covariance, right.covariance);
    }

    #[test]
    fn a_search_that_did_not_end_is_stated_as_good() {
        let problem = asked_of("four-pose");
        let right = correct(&problem);
        let [none, one] = ["no-refinement", "one-iteration"].map(|fault| with_fault(fault, &problem));
        for answer in [&none, &one] {
            assert_ne!(answer.parameters, right.parameters);
            let said = (answer.status, &answer.message, &answer.warnings);
            assert_eq!(said, (Status::Ok, &None, &right.warnings));
        }
        assert_ne!(none.parameters, one.parameters);
    }
}
