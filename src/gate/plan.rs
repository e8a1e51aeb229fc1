//! Which problems make a run? The list of cases, each a function of suite, seed and size, and of nothing
//! else.

use super::bad_input::{BadCase, bad_cases};
use super::protocol::{Problem, ProblemView};
use super::suite::{Demand, OUTLIER_PX, Scenario, SuiteError, suite};
use super::variant::Variant;
use calibench::board::View;
use calibench::camera::Parameter;
use calibench::geometry::Vec2;
use calibench::synth::{SceneError, Stream, StreamKey, fnv1a};

/// What a problem is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Noise-free data.
    Exact,
    /// A draw of the noise.
    Sample,
    /// A sample that is asked a second time.
    Repeat,
    /// A sample, changed so that the answer must follow.
    Variant(Variant),
    /// A problem that should be refused or flagged; the index of its case.
    Bad(usize),
}

/// One problem of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Case {
    /// Index of the scenario; unused by bad input.
    pub scenario: usize,
    /// What for.
    pub purpose: Purpose,
    /// Trial number of the noise.
    pub trial: u64,
}

/// Everything that is asked in a run.
#[derive(Debug)]
pub struct Plan {
    /// The scenes.
    pub scenarios: Vec<Scenario>,
    /// The bad input.
    pub bad: Vec<BadCase>,
    /// Seed of the noise.
    pub seed: u64,
    /// Samples a scenario.
    pub samples: usize,
    /// The problems, in the order in which they are asked.
    pub cases: Vec<Case>,
}

/// A plan that cannot be made: a mistake in the suite.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A scenario.
    #[error(transparent)]
    Suite(#[from] SuiteError),
    /// More problems than a run can hold.
    #[error("{samples} samples a scenario, and the limit is {MOST_SAMPLES}: ask for fewer")]
    TooManySamples {
        /// As asked.
        samples: usize,
    },
    /// Bad input that cannot be photographed.
    #[error(transparent)]
    Bad(#[from] SceneError),
}

/// Samples a scenario: ten times a thorough run. What was seen of each stays in memory.
pub const MOST_SAMPLES: usize = 100_000;
/// Samples a scenario that are asked twice.
const REPEATS: usize = 4;
/// Samples a scenario that are asked in every variant.
const VARIED: usize = 2;
/// Samples a scenario that test honesty: each takes a verdict of its own.
const HONEST: usize = 32;

impl Plan {
    /// `samples` draws of the noise a scenario, and with them the exact, repeated, varied and bad problems.
    pub fn new(seed: u64, samples: usize) -> Result<Plan, PlanError> {
        if samples > MOST_SAMPLES {
            return Err(PlanError::TooManySamples { samples });
        }
        let scenarios = suite()?;
        let bad = bad_cases(seed)?;
        let mut cases: Vec<Case> = Vec::new();
        for (i, scenario) in scenarios.iter().enumerate() {
            cases.extend(cases_of(i, scenario, samples));
        }
        // Last: a program that breaks on bad input has been heard on good data by then.
        cases.extend((0..bad.len()).map(|i| Case { scenario: 0, purpose: Purpose::Bad(i), trial: 0 }));
        Ok(Plan { scenarios, bad, seed, samples, cases })
    }

    /// The problem of a case.
    pub fn problem(&self, case: &Case) -> Problem {
        let scenario = &self.scenarios[case.scenario];
        match case.purpose {
            Purpose::Bad(index) => Problem { id: self.id(case), ..self.bad[index].problem.clone() },
            Purpose::Exact => problem_of(scenario, &scenario.scene.exact(), self.id(case)),
            Purpose::Sample | Purpose::Repeat => {
                problem_of(scenario, &self.observe(scenario, case.trial), self.id(case))
            }
            Purpose::Variant(variant) => {
                let original = problem_of(scenario, &self.observe(scenario, case.trial), String::new());
                variant.apply(&original, self.id(case))
            }
        }
    }

    /// The id of a case's problem: a number that tells a solver nothing of what it is asked for.
    pub fn id(&self, case: &Case) -> String {
        let name = self.name(case);
        let hash = fnv1a(self.seed.to_le_bytes().into_iter().chain(name.bytes()));
        // The last letters of a name move the low bits of its hash only: neighbours would be told by their
        // common beginning.
        format!("{:016x}", (hash ^ (hash >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// What a case is, for people: scenario, purpose and trial.
    pub fn name(&self, case: &Case) -> String {
        let scenario = self.scenarios[case.scenario].id;
        match case.purpose {
            Purpose::Bad(index) => self.bad[index].id.to_string(),
            Purpose::Exact => format!("{scenario}.exact"),
            Purpose::Sample => format!("{scenario}.sample.{}", case.trial),
            Purpose::Repeat => format!("{scenario}.repeat.{}", case.trial),
            Purpose::Variant(variant) => format!("{scenario}.{}.{}", variant.name(), case.trial),
        }
    }

    fn observe(&self, scenario: &Scenario, trial: u64) -> Vec<View> {
        let key = |purpose| StreamKey { seed: self.seed, scenario: scenario.id, trial, purpose };
        let views = scenario.scene.observe(scenario.sigma_px, &mut Stream::open(key("noise")));
        if scenario.outliers == 0.0 {
            return views;
        }
        let mut stream = Stream::open(key("outliers"));
        views.iter().map(|view| displaced(view, scenario.outliers, &mut stream)).collect()
    }
}

fn cases_of(index: usize, scenario: &Scenario, samples: usize) -> Vec<Case> {
    let case = |purpose, trial: usize| Case { scenario: index, purpose, trial: trial as u64 };
    let samples = samples.min(scenario.most);
    if scenario.demand == Demand::Honesty {
        return (0..samples.min(HONEST)).map(|trial| case(Purpose::Sample, trial)).collect();
    }
    let mut cases = vec![case(Purpose::Exact, 0)];
    for trial in 0..samples {
        cases.push(case(Purpose::Sample, trial));
        if trial < REPEATS {
            cases.push(case(Purpose::Repeat, trial));
        }
        if trial < VARIED {
            cases.extend(Variant::ALL.map(|variant| case(Purpose::Variant(variant), trial)));
        }
    }
    cases
}

/// Displaces every point with the given probability, by a uniform length in a uniform direction.
fn displaced(view: &View, share: f64, stream: &mut Stream) -> View {
    let pixels = view.pixels().iter().map(|pixel| {
        let (chosen, turn) = (stream.uniform() < share, stream.uniform());
        let length = stream.uniform_in(OUTLIER_PX.0, OUTLIER_PX.1);
        let (sine, cosine) = libm::sincos(turn * std::f64::consts::TAU);
        if chosen { pixel + Vec2::new(cosine, sine) * length } else { *pixel }
    });
    View::new(view.points().to_vec(), pixels.collect()).expect("a displaced pixel is finite")
}

fn problem_of(scenario: &Scenario, views: &[View], id: String) -> Problem {
    let truth = &scenario.scene.truth;
    let pair = |p: &Vec2| [p.x, p.y];
    let (width, height) = truth.image_size;
    let held = Parameter::ALL.into_iter().filter(|p| !scenario.free.contains(*p));
    Problem {
        id,
        image_size: [width, height],
        views: views
            .iter()
            .map(|v| ProblemView {
                target: v.points().iter().map(pair).collect(),
                pixels: v.pixels().iter().map(pair).collect(),
            })
            .collect(),
        free: scenario.free.iter().map(|p| p.name().to_string()).collect(),
        held: held.map(|p| (p.name().to_string(), truth.camera.get(p))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn ids_are_different_and_tell_nothing() {
        let plan = Plan::new(1, 40).unwrap();
        let ids: BTreeSet<String> = plan.cases.iter().map(|case| plan.id(case)).collect();
        assert_eq!(ids.len(), plan.cases.len());
        assert!(ids.iter().all(|id| id.len() == 16 && id.bytes().all(|b| b.is_ascii_hexdigit())));
        // Samples 10 and 11 of a scene share no beginning, but by chance.
        let of = |trial| plan.id(&Case { scenario: 0, purpose: Purpose::Sample, trial });
        assert_ne!(of(10)[..6], of(11)[..6]);
        assert_ne!(Plan::new(2, 40).unwrap().id(&plan.cases[0]), plan.id(&plan.cases[0]));
    }
}
