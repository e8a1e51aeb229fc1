//! Which problems make a run? The list of cases, each a function of suite, seed and size, and of nothing
//! else.

use super::bad_input::{BadCase, bad_cases};
use super::protocol::Problem;
use super::suite::{Demand, OUTLIER_PX, Scenario, SuiteError, suite};
use super::variant::Variant;
use calibench::board::View;
use calibench::camera::Model;
use calibench::geometry::Vec2;
use calibench::synth::{SceneError, Stream, StreamKey, fnv1a};

/// What a problem is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
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
#[non_exhaustive]
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
#[non_exhaustive]
pub struct Plan {
    /// The scenes.
    pub scenarios: Vec<Scenario>,
    /// The bad input.
    pub bad: Vec<BadCase>,
    /// Seed of the noise.
    pub seed: u64,
    /// What was wanted.
    pub asked: Asked,
    /// Samples a scenario.
    pub samples: usize,
    /// The problems, in the order in which they are asked.
    pub cases: Vec<Case>,
}

/// Which part of the suite is asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Asked {
    /// Lens models.
    pub models: Vec<Model>,
    /// Names of scenarios and of bad input; empty for all.
    pub scenes: Vec<String>,
}

impl Default for Asked {
    /// All that a solver must answer that says nothing of itself: every scene with Brown-Conrady's lens.
    fn default() -> Asked {
        Asked::of(&[Model::BrownConrady])
    }
}

impl Asked {
    /// All scenes of some lens models.
    pub fn of(models: &[Model]) -> Asked {
        Asked { models: models.to_vec(), scenes: Vec::new() }
    }

    fn wants(&self, scene: &str) -> bool {
        self.scenes.is_empty() || self.scenes.iter().any(|name| name == scene)
    }
}

/// A plan that cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
    /// No lens model whose scenes could be asked.
    #[error("no lens model to ask about: name at least one")]
    NothingToAsk,
    /// A scene that is not in the suite, or not of the lens models that are asked.
    #[error("no scene `{scene}` among those of {models}; there are: {known}")]
    UnknownScene {
        /// As asked.
        scene: String,
        /// The lens models.
        models: String,
        /// The names there are.
        known: String,
    },
}

/// Samples a scenario: ten times a thorough run. What was seen of each stays in memory.
pub const MOST_SAMPLES: usize = 100_000;
/// Samples a scenario that are asked twice.
const REPEATS: usize = 4;
/// Samples a scenario that are asked in every variant.
const VARIED: usize = 2;
/// Samples a scenario that test honesty: each takes a verdict of its own.
const HONEST: usize = 32;
/// Samples a scenario that breaks an assumption: fits that go wrong take long, and sixteen tell a ratio to
/// two fifths.
const BROKEN: usize = 16;

impl Plan {
    /// [`Plan::of`] for every scene with Brown-Conrady's lens.
    ///
    /// # Errors
    /// Too many samples.
    pub fn new(seed: u64, samples: usize) -> Result<Plan, PlanError> {
        Plan::of(seed, samples, Asked::default())
    }

    /// `samples` draws of the noise a scenario, and with them the exact, repeated, varied and bad problems.
    ///
    /// # Errors
    /// Too many samples; a scene that there is not.
    pub fn of(seed: u64, samples: usize, asked: Asked) -> Result<Plan, PlanError> {
        if samples > MOST_SAMPLES {
            return Err(PlanError::TooManySamples { samples });
        }
        if asked.models.is_empty() {
            return Err(PlanError::NothingToAsk);
        }
        let mut scenarios = suite()?;
        scenarios.retain(|scenario| asked.models.contains(&scenario.model()));
        let mut bad = bad_cases(seed)?;
        bad.retain(|_| asked.models.contains(&Model::BrownConrady));
        check_scenes(&asked, &scenarios, &bad)?;
        scenarios.retain(|scenario| asked.wants(scenario.id));
        bad.retain(|case| asked.wants(case.id));
        let mut cases: Vec<Case> = Vec::new();
        for (i, scenario) in scenarios.iter().enumerate() {
            cases.extend(cases_of(i, scenario, samples));
        }
        // Last: a program that breaks on bad input has been heard on good data by then.
        cases.extend((0..bad.len()).map(|i| Case { scenario: 0, purpose: Purpose::Bad(i), trial: 0 }));
        Ok(Plan { scenarios, bad, seed, asked, samples, cases })
    }

    /// The problem of a case.
    pub fn problem(&self, case: &Case) -> Problem {
        // Bad input has none.
        let scenario = || &self.scenarios[case.scenario];
        let sample = |id| problem_of(scenario(), &self.observe(scenario(), case.trial), id);
        match case.purpose {
            Purpose::Bad(index) => Problem { id: self.id(case), ..self.bad[index].problem.clone() },
            Purpose::Exact => {
                problem_of(scenario(), &scenario().setup_of(self.seed, case.trial).exact(), self.id(case))
            }
            Purpose::Sample | Purpose::Repeat => sample(self.id(case)),
            Purpose::Variant(variant) => variant.apply(&sample(String::new()), self.id(case)),
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
        let of_scenario = |what: &str| format!("{}.{what}", self.scenarios[case.scenario].id);
        match case.purpose {
            Purpose::Bad(index) => self.bad[index].id.to_string(),
            Purpose::Exact => of_scenario("exact"),
            Purpose::Sample => of_scenario(&format!("sample.{}", case.trial)),
            Purpose::Repeat => of_scenario(&format!("repeat.{}", case.trial)),
            Purpose::Variant(variant) => of_scenario(&format!("{}.{}", variant.name(), case.trial)),
        }
    }

    fn observe(&self, scenario: &Scenario, trial: u64) -> Vec<View> {
        let key = |purpose| StreamKey { seed: self.seed, scenario: scenario.id, trial, purpose };
        if let Some(violation) = &scenario.violation {
            return violation.observe(
                &scenario.setup.scene,
                scenario.sigma_px,
                &mut Stream::open(key("noise")),
            );
        }
        let setup = scenario.setup_of(self.seed, trial);
        let views = setup.observe(scenario.sigma_px, &mut Stream::open(key("noise")));
        if scenario.outliers == 0.0 {
            return views;
        }
        let mut stream = Stream::open(key("outliers"));
        views.iter().map(|view| displaced(view, scenario.outliers, &mut stream)).collect()
    }
}

fn check_scenes(asked: &Asked, scenarios: &[Scenario], bad: &[BadCase]) -> Result<(), PlanError> {
    let known: Vec<&str> = scenarios.iter().map(|s| s.id).chain(bad.iter().map(|case| case.id)).collect();
    match asked.scenes.iter().find(|name| !known.contains(&name.as_str())) {
        None => Ok(()),
        Some(scene) => {
            let models: Vec<&str> = asked.models.iter().map(|model| model.name()).collect();
            let (scene, models, known) = (scene.clone(), models.join(", "), known.join(", "));
            Err(PlanError::UnknownScene { scene, models, known })
        }
    }
}

fn cases_of(index: usize, scenario: &Scenario, samples: usize) -> Vec<Case> {
    let case = |purpose, trial: usize| Case { scenario: index, purpose, trial: trial as u64 };
    let samples = samples.min(scenario.most);
    let only = |most: usize| (0..samples.min(most)).map(|trial| case(Purpose::Sample, trial)).collect();
    match scenario.demand {
        Demand::Honesty => return only(HONEST),
        Demand::Assumptions => return only(BROKEN),
        Demand::Law => {}
    }
    let mut cases = vec![case(Purpose::Exact, 0)];
    for trial in 0..samples {
        cases.push(case(Purpose::Sample, trial));
        if trial < REPEATS {
            cases.push(case(Purpose::Repeat, trial));
        }
        if trial < VARIED {
            let variants = Variant::ALL.into_iter().filter(|variant| variant.is_known_of(scenario.model()));
            cases.extend(variants.map(|variant| case(Purpose::Variant(variant), trial)));
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
    let truth = &scenario.setup.scene.truth;
    Problem::of_views(id, truth.image_size, views, &truth.camera, scenario.free)
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

    #[test]
    fn a_scene_is_asked_exactly_as_samples_some_twice_and_fewer_in_every_variant() {
        let plan = Plan::new(1, 40).unwrap();
        let count = |of: fn(&Purpose) -> bool| {
            plan.cases.iter().filter(|case| case.scenario == 0 && of(&case.purpose)).count()
        };
        assert_eq!(plan.scenarios[0].id, "four-pose");
        assert_eq!(count(|purpose| *purpose == Purpose::Exact), 1);
        assert_eq!(count(|purpose| *purpose == Purpose::Sample), 40);
        assert_eq!(count(|purpose| *purpose == Purpose::Repeat), 4);
        assert_eq!(count(|purpose| matches!(purpose, Purpose::Variant(_))), 2 * 5);
    }

    #[test]
    fn in_the_scene_with_outliers_two_marks_in_a_hundred_lie_5_to_20_px_off() {
        let asked = Asked { scenes: vec!["outliers".into()], ..Asked::default() };
        let plan = Plan::of(1, 32, asked).unwrap();
        let exact = plan.scenarios[0].setup.exact();
        let exact: Vec<Vec2> = exact.iter().flat_map(View::pixels).copied().collect();
        let off_px = |case: &Case| -> Vec<f64> {
            let views = plan.problem(case).views;
            let seen = views.iter().flat_map(|view| &view.pixels).map(|&[u, v]| Vec2::new(u, v));
            seen.zip(&exact).map(|(seen, exact)| (seen - exact).norm()).collect()
        };
        let all: Vec<f64> = plan.cases.iter().flat_map(off_px).collect();
        // Noise of 0.1 px; of 8064 marks 161 +- 13, five standard deviations.
        let (far, near): (Vec<f64>, Vec<f64>) = all.iter().partition(|px| **px > 1.0);
        assert_eq!(all.len(), 32 * 252);
        assert!((98..225).contains(&far.len()), "{}", far.len());
        assert!(far.iter().all(|px| (4.4..20.6).contains(px)) && near.iter().all(|px| *px < 0.6));
    }

    #[test]
    fn a_scene_that_there_is_not_is_refused_and_so_are_too_many_samples() {
        let asked = Asked { scenes: vec!["four-pose".into(), "five-pose".into()], ..Asked::default() };
        let refused = Plan::of(1, 1, asked).map(|plan| plan.cases.len());
        assert!(matches!(&refused, Err(PlanError::UnknownScene { scene, .. }) if scene == "five-pose"));
        let only =
            |samples| Plan::of(1, samples, Asked { scenes: vec!["four-pose".into()], ..Asked::default() });
        assert!(matches!(only(MOST_SAMPLES + 1), Err(PlanError::TooManySamples { .. })));
        assert!(only(MOST_SAMPLES).is_ok());
    }

    #[test]
    fn outliers_lie_in_every_direction() {
        let view = crate::suite::suite().unwrap()[0].setup.exact().remove(0);
        let mut stream = Stream::open(StreamKey { seed: 1, scenario: "s", trial: 0, purpose: "outliers" });
        let mut counts = [0; 4];
        for _ in 0..10 {
            let moved = displaced(&view, 1.0, &mut stream);
            for (to, from) in moved.pixels().iter().zip(view.pixels()) {
                let by = to - from;
                counts[2 * usize::from(by.x > 0.0) + usize::from(by.y > 0.0)] += 1;
            }
        }
        // A quarter of 630: 157.5 +- 10.9, five standard deviations.
        assert!(counts.iter().all(|count| (104..212).contains(count)), "{counts:?}");
    }
}
