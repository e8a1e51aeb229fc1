//! What follows from the answers? One check a property and scene.

use super::Solver;
use super::protocol::{Answer, PoseRows, Problem, Status, rows};
use super::scene::{Demand, Scene};
use calibench::distribution::{ChiSquare, fisher_tail};
use calibench::geometry::Pose;
use calibench::io::significant;
use calibench_gate::judge::{Basis, Check, Property};
use calibench_gate::quoted::quoted;
use nalgebra::{Matrix6, Vector6};

/// Samples of a scene that wants a refusal.
const REFUSALS: usize = 8;
/// An exact problem is solved to this part of the bound's standard deviation: what iterative solvers end
/// with.
const EXACT: f64 = 1e-4;
/// So many standard deviations of the bound are far off: no method is as inefficient as that.
const FAR: f64 = 50.0;
/// Who states that the rotation is not known to this admits what the motions leave open, rad.
const ADMITTED_RAD: f64 = 0.05;
/// Metres in place of millimetres.
const UNIT: f64 = 1e-3;

/// A scene and its problems: the exact one, the samples, and of the exact one the stations backwards and in
/// metres.
pub(super) struct Asked {
    scene: Scene,
    /// Covariance of X at the truth; `None` where the motions leave it open.
    bound: Option<Matrix6<f64>>,
    problems: Vec<Problem>,
}

/// With what was answered.
pub(super) struct Answered {
    pub scene: Scene,
    bound: Option<Matrix6<f64>>,
    answers: Vec<Result<Answer, String>>,
}

impl Asked {
    pub fn new(scene: Scene, seed: u64, samples: usize) -> Asked {
        let exact = scene.exact();
        let samples = if scene.demand == Demand::Law { samples } else { REFUSALS };
        let bound = exact.solve().ok().map(|found| found.x_covariance());
        let drawn = (0..samples as u64).map(|trial| scene.sample(&exact, seed, trial)).collect::<Vec<_>>();
        let problems = match scene.demand {
            Demand::Law => [vec![exact.clone(), backwards(&drawn[0]), in_metres(&drawn[0])], drawn].concat(),
            Demand::Refusal => drawn,
        };
        Asked { scene, bound, problems }
    }

    pub fn ask(self, solver: &mut dyn Solver) -> Answered {
        let answers = solver.answer_all(&self.problems);
        Answered { scene: self.scene, bound: self.bound, answers }
    }
}

/// The same stations in the opposite order.
fn backwards(problem: &Problem) -> Problem {
    let mut problem = Problem { id: format!("{}-backwards", problem.id), ..problem.clone() };
    problem.base_from_gripper.reverse();
    problem.cam_from_target.reverse();
    problem.cam_covariances.reverse();
    problem
}

/// The same problem with lengths in metres.
fn in_metres(problem: &Problem) -> Problem {
    let scaled = |pose: &PoseRows| {
        let pose = pose.pose();
        rows(&Pose { translation: pose.translation * UNIT, ..pose })
    };
    let unit = |i: usize| if i < 3 { 1.0 } else { UNIT };
    let mut metres = Problem { id: format!("{}-metres", problem.id), ..problem.clone() };
    metres.base_from_gripper = problem.base_from_gripper.iter().map(scaled).collect();
    metres.cam_from_target = problem.cam_from_target.iter().map(scaled).collect();
    metres.robot.position *= UNIT;
    for covariance in &mut metres.cam_covariances {
        for (i, row) in covariance.iter_mut().enumerate() {
            row.iter_mut().enumerate().for_each(|(j, value)| *value *= unit(i) * unit(j));
        }
    }
    metres
}

/// An X with what was stated of it.
struct Estimate {
    /// Step from the truth.
    error: Vector6<f64>,
    pose: Pose,
    covariance: Option<Result<Matrix6<f64>, String>>,
}

impl Answered {
    /// The estimates among these answers.
    fn estimates<'a>(&'a self, answers: &'a [Result<Answer, String>]) -> impl Iterator<Item = Estimate> + 'a {
        answers.iter().filter_map(|answer| self.estimate(answer.as_ref().ok()?))
    }

    fn estimate(&self, answer: &Answer) -> Option<Estimate> {
        if answer.status != Status::Ok {
            return None;
        }
        let pose = answer.pose().ok()?;
        Some(Estimate { error: self.scene.x().step_to(&pose), pose, covariance: answer.covariance() })
    }

    fn check(&self, property: Property, basis: Basis, problems: usize, evidence: String) -> Check {
        Check::new(property, self.scene.id, basis, problems, evidence)
    }

    /// `sqrt(mean(e^T B^-1 e) / 6)` of the samples: 1 for errors as large as the bound.
    pub fn over_bound(&self) -> Option<f64> {
        let (bound, samples) = (self.bound?.try_inverse()?, self.samples());
        let squares: Vec<f64> = self.estimates(samples).map(|e| e.error.dot(&(bound * e.error))).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / (6 * squares.len()) as f64).sqrt())
    }

    /// The answers to samples, behind those to the exact problem and its variants.
    fn samples(&self) -> &[Result<Answer, String>] {
        if self.scene.demand == Demand::Law {
            self.answers.get(3..).unwrap_or_default()
        } else {
            &self.answers
        }
    }

    /// Every check.
    pub fn checks(&self) -> Vec<Check> {
        let mut checks = vec![self.protocol()];
        match (self.scene.demand, self.bound.and_then(|bound| bound.try_inverse())) {
            (Demand::Law, Some(inverse)) => checks.extend(self.law(&inverse)),
            (Demand::Law, None) => {}
            (Demand::Refusal, _) => checks.push(self.refusal()),
        }
        checks
    }

    fn protocol(&self) -> Check {
        let broken: Vec<String> = self
            .answers
            .iter()
            .filter_map(|answer| match answer {
                Err(breakage) => Some(breakage.clone()),
                Ok(answer) if answer.status == Status::Ok => answer.pose().err(),
                Ok(_) => None,
            })
            .collect();
        let evidence = match broken.first() {
            None => format!("all {} answers are well formed", self.answers.len()),
            Some(first) => format!("{} of {} broken, first: {first}", broken.len(), self.answers.len()),
        };
        self.check(Property::Protocol, Basis::Certain(broken.is_empty()), self.answers.len(), evidence)
    }

    fn law(&self, inverse: &Matrix6<f64>) -> Vec<Check> {
        let samples: Vec<Estimate> = self.estimates(self.samples()).collect();
        let asked = self.samples().len();
        let mut checks = vec![self.convergence(asked, samples.len())];
        if samples.is_empty() {
            return checks;
        }
        checks.push(self.exactness(inverse));
        checks.push(self.same_as_first(Property::ViewOrder, 1, 1.0, inverse));
        checks.push(self.same_as_first(Property::TargetUnits, 2, UNIT, inverse));
        checks.push(self.bias(&samples, inverse));
        checks.push(self.efficiency(&samples, inverse));
        checks.push(self.not_far(&samples, inverse));
        checks.extend(self.stated(&samples));
        checks
    }

    fn convergence(&self, asked: usize, answered: usize) -> Check {
        let first = self.samples().iter().find_map(|answer| match answer {
            Ok(answer) if answer.status != Status::Ok => {
                Some(format!(", first: {}", quoted(answer.message.as_deref().unwrap_or("no reason given"))))
            }
            _ => None,
        });
        let evidence = format!("{answered} of {asked} good problems answered{}", first.unwrap_or_default());
        self.check(Property::Convergence, Basis::Certain(answered == asked), asked, evidence)
    }

    fn exactness(&self, inverse: &Matrix6<f64>) -> Check {
        let exact = self.answers.first().and_then(|answer| self.estimate(answer.as_ref().ok()?));
        let off = exact.map(|e| e.error.dot(&(inverse * e.error)).sqrt());
        let evidence = off.map_or("no X without noise".to_string(), |off| {
            format!("without noise X is {} standard deviations of the bound off", significant(off, 2))
        });
        self.check(Property::Exactness, Basis::Certain(off.is_some_and(|off| off < EXACT)), 1, evidence)
    }

    /// The answer to another form of the first sample is the same X.
    fn same_as_first(&self, property: Property, at: usize, unit: f64, inverse: &Matrix6<f64>) -> Check {
        let of = |answer: Option<&Result<Answer, String>>| self.estimate(answer?.as_ref().ok()?);
        let both = of(self.samples().first()).zip(of(self.answers.get(at)));
        let off = both.map(|(first, other)| {
            let step = first.pose.step_to(&Pose { translation: other.pose.translation / unit, ..other.pose });
            step.dot(&(inverse * step)).sqrt()
        });
        let evidence = off.map_or("one of the two is not answered".to_string(), |off| {
            format!("X moves by {} standard deviations of the bound", significant(off, 2))
        });
        self.check(property, Basis::Certain(off.is_some_and(|off| off < EXACT)), 2, evidence)
    }

    /// Is the mean error zero, against the spread of the errors themselves (Hotelling 1931)? They may be
    /// larger than the bound.
    fn bias(&self, samples: &[Estimate], inverse: &Matrix6<f64>) -> Check {
        let n = samples.len();
        let mean = samples.iter().map(|e| e.error).sum::<Vector6<f64>>() / n as f64;
        let spread: Matrix6<f64> =
            samples.iter().map(|e| (e.error - mean) * (e.error - mean).transpose()).sum();
        let in_bound = mean.dot(&(inverse * mean)).sqrt();
        let evidence =
            format!("the mean error is {} standard deviations of the bound", significant(in_bound, 2));
        let square = spread.try_inverse().map(|inverse| n as f64 * mean.dot(&(inverse * mean)));
        let basis = match square {
            // Too few samples for a spread.
            _ if n <= 6 => Basis::Told,
            // n m^T (S / (n - 1))^-1 m (n - 6) / (6 (n - 1)) is distributed as F with 6 and n - 6 degrees of
            // freedom.
            Some(square) if square.is_finite() => {
                Basis::Chance(fisher_tail(square * (n - 6) as f64 / 6.0, 6, n - 6))
            }
            _ => Basis::Chance(0.0),
        };
        self.check(Property::Bias, basis, n, evidence)
    }

    /// Errors as large as the bound: their squares add up to a chi-squared number.
    fn efficiency(&self, samples: &[Estimate], inverse: &Matrix6<f64>) -> Check {
        let sum: f64 = samples.iter().map(|e| e.error.dot(&(inverse * e.error))).sum();
        let freedom = 6 * samples.len();
        let evidence = format!("errors {} times the bound", significant((sum / freedom as f64).sqrt(), 3));
        self.check(Property::Nees, Basis::Chance(both_sides(sum, freedom)), samples.len(), evidence)
    }

    fn not_far(&self, samples: &[Estimate], inverse: &Matrix6<f64>) -> Check {
        let worst = samples.iter().map(|e| e.error.dot(&(inverse * e.error)).sqrt()).fold(0.0, f64::max);
        let evidence = format!("worst error {} standard deviations of the bound", significant(worst, 3));
        let check =
            self.check(Property::NoSilentFailure, Basis::Certain(worst < FAR), samples.len(), evidence);
        Check { grave: true, ..check }
    }

    /// A stated covariance is one, and as large as the errors.
    fn stated(&self, samples: &[Estimate]) -> Vec<Check> {
        let stated: Vec<(&Estimate, &Result<Matrix6<f64>, String>)> =
            samples.iter().filter_map(|e| Some((e, e.covariance.as_ref()?))).collect();
        if stated.is_empty() {
            let evidence = "no covariance stated".to_string();
            return vec![self.check(Property::Covariance, Basis::Told, 0, evidence)];
        }
        let faults: Vec<&String> =
            stated.iter().filter_map(|(_, covariance)| covariance.as_ref().err()).collect();
        let form =
            faults.first().map_or("symmetric and positive definite".to_string(), |fault| (*fault).clone());
        let squares: Vec<f64> = stated
            .iter()
            .filter_map(|(e, covariance)| {
                Some(e.error.dot(&(covariance.as_ref().ok()?.try_inverse()? * e.error)))
            })
            .collect();
        let (sum, freedom) = (squares.iter().sum::<f64>(), 6 * squares.len());
        let times = (sum / freedom.max(1) as f64).sqrt();
        let evidence = format!("errors {} times what is stated", significant(times, 3));
        let basis = Basis::Chance(both_sides(sum, freedom));
        vec![
            self.check(Property::CovarianceForm, Basis::Certain(faults.is_empty()), stated.len(), form),
            self.check(Property::Covariance, basis, squares.len(), evidence),
        ]
    }

    /// Refused, or its uncertainty admitted.
    fn refusal(&self) -> Check {
        let admits = |e: &Estimate| {
            let covariance = e.covariance.as_ref().and_then(|c| c.as_ref().ok());
            covariance.is_some_and(|c| {
                let turn = c.fixed_view::<3, 3>(0, 0).into_owned().symmetric_eigenvalues().max();
                turn.sqrt() > ADMITTED_RAD
            })
        };
        let confident = self.estimates(&self.answers).filter(|e| !admits(e)).count();
        let n = self.answers.len();
        let evidence = match confident {
            0 => format!("all {n} refused or their uncertainty admitted"),
            _ => format!("{confident} of {n} answered as if the motions told X"),
        };
        let check = self.check(Property::Degenerate, Basis::Certain(confident == 0), n, evidence);
        Check { grave: true, ..check }
    }
}

/// Chance that a chi-squared number lies at least as far from its middle, both sides counted.
fn both_sides(x: f64, freedom: usize) -> f64 {
    if !x.is_finite() || freedom == 0 {
        return 0.0;
    }
    let chi = ChiSquare::new(freedom);
    (2.0 * chi.cdf(x).min(chi.survival(x))).min(1.0)
}
