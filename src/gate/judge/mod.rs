//! What follows from the answers? One check a property and scenario, then one decision over all of them.

mod assumptions;
mod bad;
mod chance;
mod checks;
mod decide;
mod exact;
mod habits;
mod invariance;
mod pose_covariance;
mod rmse;
mod statistics;

pub use assumptions::{Admission, TOLERATED, TooSmall, VISIBLE, admissions};
pub(super) use bad::misled;
pub(super) use chance::at_least;
pub use checks::{Basis, Check, Property, Verdict};
pub use decide::{EXPECTED_FALSE_ALARMS, Terms, decide, rejected};

use self::habits::Habits;
use super::plan::{Case, Plan, Purpose};
use super::suite::{Demand, Scenario};
use super::trial::{Seen, Trial};

/// Every check of a plan on the answers seen so far, decided.
pub fn judged(plan: &Plan, seen: &[Option<Seen>], terms: &Terms) -> Vec<Check> {
    decide(check(plan, seen, terms), terms)
}

/// Every check, undecided.
pub fn check(plan: &Plan, seen: &[Option<Seen>], terms: &Terms) -> Vec<Check> {
    let habits = Habits::of(plan, seen);
    let mut checks = bad::check(plan, seen, habits);
    let all = all_answers(plan, seen);
    let is_any_supported =
        all.iter().any(|(_, answers)| !answers.cases.is_empty() && answers.unsupported().is_none());
    for (scenario, answers) in &all {
        if let Some(reason) = answers.unsupported() {
            checks.push(unsupported_check(scenario, reason, is_any_supported, answers.cases.len()));
            continue;
        }
        checks.extend(exact::protocol(scenario, answers));
        match scenario.demand {
            Demand::Honesty => checks.push(bad::honesty(scenario, answers)),
            Demand::Assumptions => checks.push(assumptions::check(scenario, answers)),
            Demand::Law => {
                checks.extend(exact::check(scenario, answers, terms));
                checks.push(habits::specificity(scenario, answers));
                checks.extend(statistics::check(scenario, answers));
                checks.extend(rmse::check(scenario, answers));
                checks.extend(invariance::check(scenario, answers));
            }
        }
    }
    checks
}

/// The scenes of which every problem that was asked is unsupported, in the order of the plan.
pub fn unsupported(plan: &Plan, seen: &[Option<Seen>]) -> Vec<&'static str> {
    let all = all_answers(plan, seen).into_iter();
    all.filter(|(_, answers)| answers.unsupported().is_some()).map(|(scenario, _)| scenario.id).collect()
}

fn all_answers<'a>(plan: &'a Plan, seen: &'a [Option<Seen>]) -> Vec<(&'a Scenario, Answers<'a>)> {
    let habits = Habits::of(plan, seen);
    let scenarios = plan.scenarios.iter().enumerate();
    scenarios.map(|(index, scenario)| (scenario, Answers::of(plan, seen, index, habits))).collect()
}

/// A scene that is not supported is not judged. Where no scene is supported nothing was answered, and that
/// does not hold.
fn unsupported_check(scenario: &Scenario, reason: &str, is_any_supported: bool, problems: usize) -> Check {
    let (basis, problems, what) = match is_any_supported {
        true => (Basis::Told, 0, "not supported"),
        false => (Basis::Certain(false), problems, "nothing that was asked is supported"),
    };
    Check::new(Property::Convergence, scenario.id, basis, problems, format!("{what}: {reason}"))
}

/// The answers of one scenario.
struct Answers<'a> {
    cases: Vec<(&'a Case, &'a Seen)>,
    /// How the solver meets good data.
    habits: Habits,
}

impl<'a> Answers<'a> {
    fn of(plan: &'a Plan, seen: &'a [Option<Seen>], index: usize, habits: Habits) -> Answers<'a> {
        let of_scenario = |case: &Case| case.scenario == index && !matches!(case.purpose, Purpose::Bad(_));
        let cases = plan.cases.iter().zip(seen).filter(|(case, _)| of_scenario(case));
        Answers { cases: cases.filter_map(|(case, seen)| Some((case, seen.as_ref()?))).collect(), habits }
    }

    fn for_purpose(&self, purpose: Purpose) -> impl Iterator<Item = (u64, &'a Seen)> {
        self.cases
            .iter()
            .filter(move |(case, _)| case.purpose == purpose)
            .map(|&(case, seen)| (case.trial, seen))
    }

    /// Why the solver says that it is not made for this scene, if it says so of every problem: of some only
    /// is no reason.
    fn unsupported(&self) -> Option<&'a str> {
        let reasons = self.cases.iter().map(|(_, seen)| match seen {
            Seen::Unsupported(reason) => Some(reason.as_str()),
            _ => None,
        });
        reasons.collect::<Option<Vec<&str>>>()?.first().copied()
    }

    /// The estimates of samples, in order.
    fn samples(&self) -> Vec<&'a Trial> {
        self.for_purpose(Purpose::Sample).filter_map(|(_, seen)| estimate(seen)).collect()
    }
}

fn estimate(seen: &Seen) -> Option<&Trial> {
    match seen {
        Seen::Estimate(trial) => Some(trial),
        _ => None,
    }
}

/// An error of the camera as the noise that would cause it: `sigma sqrt(e^T P^-1 e / k)`, px.
fn equivalent_noise_px(scenario: &Scenario, nees: f64, dimensions: usize) -> f64 {
    scenario.sigma_px * (nees / dimensions as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accept::Breakage;
    use crate::plan::Asked;
    use crate::protocol::{Answer, Problem, Status};
    use crate::{Builtin, Report, Solver, run};

    /// Answers some problems, and does what it is told with the others.
    struct Partly {
        answers: fn(&Problem) -> bool,
        otherwise: fn(&Problem) -> Result<Answer, Breakage>,
    }

    impl Solver for Partly {
        fn name(&self) -> String {
            "a solver".into()
        }

        fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
            if (self.answers)(problem) { Builtin.ask(problem) } else { (self.otherwise)(problem) }
        }
    }

    fn unsupported(problem: &Problem) -> Result<Answer, Breakage> {
        Ok(Answer::without_estimate(&problem.id, Status::Unsupported, "no skew here"))
    }

    fn report(solver: &dyn Solver, scenes: &[&str]) -> Report {
        let scenes = scenes.iter().map(|name| name.to_string()).collect();
        let plan = Plan::of(1, 16, Asked { scenes, ..Asked::default() }).unwrap();
        Report::new(&plan, "a solver", &run(&plan, solver, &|_| ()), &Terms::default(), 0.0)
    }

    /// The id of four-pose's problem without noise.
    fn exact_id() -> String {
        let plan = Plan::new(1, 1).unwrap();
        plan.id(&Case { scenario: 0, purpose: Purpose::Exact, trial: 0 })
    }

    #[test]
    fn a_scene_that_is_not_supported_is_not_judged_and_named_whatever_else_was_asked() {
        let knows_no_skew = Partly {
            answers: |problem| !problem.free.iter().any(|name| name == "skew"),
            otherwise: unsupported,
        };
        let with_another = report(&knows_no_skew, &["skew-and-k3", "four-pose"]);
        assert!(with_another.held(), "{}", with_another.details());
        let alone = report(&knows_no_skew, &["skew-and-k3"]);
        // Who answers nothing is not trusted, for that alone.
        let failed: Vec<Property> = alone.failures().iter().map(|check| check.property).collect();
        assert_eq!(failed, [Property::Convergence], "{}", alone.details());
        for report in [with_another, alone] {
            assert!(report.conclusion().contains("not supported: skew-and-k3"), "{}", report.conclusion());
            let of_scene = report.checks.iter().filter(|check| check.scenario == "skew-and-k3");
            assert!(of_scene.clone().count() > 0);
            assert!(of_scene.clone().all(|check| !check.evidence.contains("one way round")));
        }
    }

    #[test]
    fn samples_that_are_unsupported_like_their_variants_are_not_answered_one_way_round() {
        let exact_only = Partly { answers: |problem| problem.id == exact_id(), otherwise: unsupported };
        let report = report(&exact_only, &["four-pose"]);
        let variants = report.checks.iter().filter(|check| check.property == Property::ViewOrder);
        let verdicts: Vec<Verdict> = variants.map(|check| check.verdict).collect();
        assert_eq!(verdicts, [Verdict::NotJudged], "{}", report.to_text(200));
    }

    #[test]
    fn a_program_that_never_answers_converges_nowhere() {
        let silent = Partly { answers: |_| false, otherwise: |_| Err(Breakage::Timeout { seconds: 1.0 }) };
        let report = report(&silent, &["four-pose"]);
        let converges = report.checks.iter().filter(|check| check.property == Property::Convergence);
        let verdicts: Vec<Verdict> = converges.map(|check| check.verdict).collect();
        assert_eq!(verdicts, [Verdict::NotJudged], "{}", report.to_text(200));
        assert!(!report.held());
    }

    #[test]
    fn a_propertys_row_counts_its_own_checks_in_every_form_of_the_report() {
        let report = report(&Builtin, &["four-pose", "metres"]);
        let page = report.to_html();
        let rows = report.rows();
        assert!(rows.iter().any(|row| row.held.1 > 1), "{}", report.to_text(200));
        for row in rows {
            let of_property = || report.checks.iter().filter(|check| check.property == row.property);
            let judged = of_property().filter(|check| check.verdict != Verdict::NotJudged).count();
            let held = of_property().filter(|check| check.verdict == Verdict::Held).count();
            assert_eq!((row.telling.property, row.held), (row.property, (held, judged)));
            let name = row.property.name();
            let line = page.lines().find(|line| line.contains(&format!("<a href=\"#{name}\">"))).unwrap();
            let count = if judged == 0 { "&ndash;".to_string() } else { format!("{held} / {judged}") };
            assert!(line.contains(&format!("<td class=n>{count}<td>")), "{line}");
        }
    }

    #[test]
    fn every_check_that_fails_has_in_json_the_command_that_the_text_has() {
        let refuses = Partly {
            answers: |_| false,
            otherwise: |problem| Ok(Answer::without_estimate(&problem.id, Status::Refused, "no")),
        };
        let report = report(&refuses, &["four-pose", "metres"]).with_repeat("calibench gate --seed 1");
        let details = report.details();
        assert!(details.contains("again: calibench gate --seed 1 --scene four-pose\n"), "{details}");
        let json: serde_json::Value = serde_json::from_str(&report.to_json()).unwrap();
        assert_eq!(json["repeat"], "calibench gate --seed 1 --scene four-pose --scene metres");
        let checks = json["checks"].as_array().unwrap();
        for check in checks.iter().filter(|check| check["verdict"] == "failed") {
            let scene = check["scenario"].as_str().unwrap();
            assert_eq!(check["repeat"], format!("calibench gate --seed 1 --scene {scene}"));
        }
        assert!(checks.iter().any(|check| check["verdict"] == "failed"));
        assert!(checks.iter().filter(|check| check["verdict"] != "failed").all(|c| c["repeat"].is_null()));
    }

    /// A run of this library on four-pose.
    pub(super) fn answered(samples: usize) -> (Plan, Vec<Option<Seen>>) {
        let plan =
            Plan::of(1, samples, Asked { scenes: vec!["four-pose".into()], ..Asked::default() }).unwrap();
        let seen = run(&plan, &Builtin, &|_| ());
        (plan, seen)
    }

    /// What this library answers first on four-pose.
    pub(super) fn any_estimate() -> (Plan, Trial) {
        let (plan, seen) = answered(1);
        let Some(Some(Seen::Estimate(trial))) = seen.into_iter().next() else { panic!("it is answered") };
        (plan, *trial)
    }

    /// Changes the answers to cases of this purpose.
    pub(super) fn change(plan: &Plan, seen: &mut [Option<Seen>], purpose: Purpose, how: impl Fn(&mut Seen)) {
        let cases = plan.cases.iter().zip(seen).filter(|(case, _)| case.purpose == purpose);
        cases.for_each(|(_, seen)| seen.iter_mut().for_each(&how));
    }

    /// Changes the estimates among them.
    pub(super) fn change_trials(
        plan: &Plan,
        seen: &mut [Option<Seen>],
        purpose: Purpose,
        how: impl Fn(&mut Trial),
    ) {
        change(plan, seen, purpose, |seen| {
            if let Seen::Estimate(trial) = seen {
                how(trial);
            }
        });
    }

    /// What is judged of the only scene.
    pub(super) fn on_scene<T>(
        plan: &Plan,
        seen: &[Option<Seen>],
        judge: impl FnOnce(&Scenario, &Answers<'_>) -> T,
    ) -> T {
        judge(&plan.scenarios[0], &Answers::of(plan, seen, 0, Habits::UNKNOWN))
    }
}
