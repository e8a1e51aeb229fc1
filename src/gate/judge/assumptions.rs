//! What does the solver say when the world is not its model? It admits, warns, refuses - or says nothing.
//!
//! The usual laws do not hold where an assumption is broken, so two things are measured instead: by how much
//! the stated standard deviations are too small, and how often the solver says that something is wrong. It
//! fails only where three things come together: the error is more than [`TOLERATED`] times what is stated,
//! the solver is silent of more than one sample in ten, and an ordinary test of the residuals sees the
//! violation in [`VISIBLE`] of all samples, so that a solver of ordinary quality could have said so.

use super::checks::{Basis, Check, Property};
use super::habits::Habits;
use super::{Answers, chance};
use crate::plan::{Plan, Purpose};
use crate::suite::{Demand, Scenario};
use crate::trial::{Seen, Trial};
use calibench::camera::Parameter;
use calibench::evaluate::distribution::ChiSquare;
use calibench::io::significant;
use serde::Serialize;

/// Errors this many times as large as stated are tolerated. Noise that is unequal along the two axes makes no
/// standard deviation more than sqrt(2) times too small.
pub const TOLERATED: f64 = 1.5;
/// A violation is visible if ordinary tests of the residuals see it in this share of samples.
pub const VISIBLE: f64 = 0.9;
/// Where it is visible a solver may be silent in this share.
const SILENT: f64 = 1.0 - VISIBLE;
/// Level of the interval that is told.
const LEVEL: f64 = 0.95;

/// What a solver says of a scene whose world is not the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Admission {
    /// The scene.
    pub scenario: &'static str,
    /// What is left out.
    pub about: &'static str,
    /// Share of samples whose residuals show it to ordinary tests, as measured beforehand.
    pub seen_in_residuals: f64,
    /// Samples asked.
    pub samples: usize,
    /// Samples without an estimate, or with a warning where warnings are rare.
    pub flagged: usize,
    /// The worst of the stated standard deviations; none if none was stated.
    pub worst: Option<TooSmall>,
}

/// By how much a standard deviation is too small.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TooSmall {
    /// Of which parameter.
    pub parameter: &'static str,
    /// Root mean square of error over stated standard deviation; 1 if it covers.
    pub ratio: f64,
    /// Its interval of 95 %, by the chi-squared law: for errors that are mostly bias it is too wide.
    pub interval: (f64, f64),
    /// Mean of error over stated standard deviation: the part that does not average out.
    pub bias: f64,
    /// Samples behind it.
    #[serde(skip)]
    samples: usize,
}

/// One admission a scene that breaks an assumption and was asked, in the order of the plan.
pub fn admissions(plan: &Plan, seen: &[Option<Seen>]) -> Vec<Admission> {
    let habits = Habits::of(plan, seen);
    let broken = plan.scenarios.iter().enumerate().filter(|(_, s)| s.demand == Demand::Assumptions);
    broken
        .map(|(index, scenario)| admission(scenario, &Answers::of(plan, seen, index, habits)))
        .filter(|admission| admission.samples > 0)
        .collect()
}

fn admission(scenario: &Scenario, answers: &Answers<'_>) -> Admission {
    let replies: Vec<&Seen> = answers.for_purpose(Purpose::Sample).map(|(_, seen)| seen).collect();
    Admission {
        scenario: scenario.id,
        about: scenario.about,
        seen_in_residuals: scenario.seen_in_residuals,
        samples: replies.len(),
        flagged: replies.iter().filter(|seen| is_flagged(seen, answers.habits)).count(),
        worst: worst(scenario, &answers.samples()),
    }
}

fn is_flagged(seen: &Seen, habits: Habits) -> bool {
    match seen {
        Seen::Estimate(trial) => trial.warnings > 0 && habits.warns_rarely,
        Seen::Refused { .. } | Seen::Unsupported(_) => habits.answers,
        Seen::Broken(_) => false,
    }
}

/// The parameter whose errors are largest against what is stated of them.
fn worst(scenario: &Scenario, samples: &[&Trial]) -> Option<TooSmall> {
    let has_true_value =
        |p: Parameter| scenario.violation.is_none_or(|violation| violation.has_true_value(p));
    let free = scenario.free.iter().enumerate().filter(|(_, p)| has_true_value(*p));
    let each = free.filter_map(|(i, parameter)| {
        let over_stated = |t: &&Trial| Some(t.errors[i] / t.standard_deviations.as_ref()?[i]);
        too_small(parameter.name(), &samples.iter().filter_map(over_stated).collect::<Vec<_>>())
    });
    each.max_by(|a, b| a.ratio.total_cmp(&b.ratio))
}

fn too_small(parameter: &'static str, over_stated: &[f64]) -> Option<TooSmall> {
    let samples = over_stated.len();
    if samples == 0 {
        return None;
    }
    let n = samples as f64;
    // A stated deviation of zero covers nothing: JSON has no infinity.
    let square = over_stated.iter().map(|z| z * z).sum::<f64>().min(f64::MAX.sqrt());
    let law = ChiSquare::new(samples);
    let end = |share: f64| (square / law.quantile(share)).sqrt();
    Some(TooSmall {
        parameter,
        ratio: (square / n).sqrt(),
        interval: (end(0.5 + 0.5 * LEVEL), end(0.5 - 0.5 * LEVEL)),
        bias: over_stated.iter().sum::<f64>().clamp(-f64::MAX, f64::MAX) / n,
        samples,
    })
}

impl Admission {
    /// Whether ordinary tests see the violation.
    pub fn is_visible(&self) -> bool {
        self.seen_in_residuals >= VISIBLE
    }

    /// The ratio with its interval and its parameter, for a table.
    pub fn errors_told(&self) -> String {
        self.worst.as_ref().map_or("none stated".to_string(), |w| {
            let [low, ratio, high] = [w.interval.0, w.ratio, w.interval.1].map(|x| significant(x, 3));
            format!("{ratio} ({low} to {high}), {}", w.parameter)
        })
    }

    /// What was seen, in words.
    pub fn told(&self) -> String {
        let covered = match &self.worst {
            None => "no standard deviations stated".to_string(),
            Some(w) => format!(
                "errors of {} are {} times what is stated ({} to {})",
                w.parameter,
                significant(w.ratio, 3),
                significant(w.interval.0, 3),
                significant(w.interval.1, 3)
            ),
        };
        let visible = if self.is_visible() { "" } else { "; residuals do not show it surely: told only" };
        format!("{covered}, {} of {} flagged{visible}", self.flagged, self.samples)
    }

    /// Chance of such errors if they are tolerable on the average, whichever parameter is looked at.
    fn chance_of_errors(&self, parameters: usize) -> f64 {
        self.worst.as_ref().map_or(1.0, |w| {
            let square = w.ratio * w.ratio * w.samples as f64 / (TOLERATED * TOLERATED);
            chance::smallest_of(parameters, chance::above(square, w.samples))
        })
    }

    /// Chance of such silence of a solver that is silent of one sample in ten.
    fn chance_of_silence(&self) -> f64 {
        chance::at_least(self.samples - self.flagged, self.samples, SILENT)
    }
}

/// The check of a scene: both that the errors are not covered and that the solver is silent must be beyond
/// chance, so the larger of the two chances counts (an intersection-union test, Berger 1982).
pub(super) fn check(scenario: &Scenario, answers: &Answers<'_>) -> Check {
    let admission = admission(scenario, answers);
    let basis = if admission.is_visible() && admission.worst.is_some() && answers.habits.answers {
        let parameters = scenario.free.len();
        Basis::Chance(admission.chance_of_errors(parameters).max(admission.chance_of_silence()))
    } else {
        Basis::Told
    };
    Check::new(Property::Assumptions, scenario.id, basis, admission.samples, admission.told())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::{Faulty, planted};
    use crate::judge::{Terms, Verdict};
    use crate::{Builtin, Report, Solver, run};

    fn report(solver: &dyn Solver) -> Report {
        let plan = Plan::new(1, 16).unwrap();
        Report::new(&plan, "", &run(&plan, solver, &|_| ()), &Terms::default(), 0.0)
    }

    #[test]
    fn who_never_warns_fails_where_residuals_show_what_is_wrong_and_only_there() {
        let fault = planted().into_iter().find(|fault| fault.id == "never-warns").unwrap();
        let report = report(&Faulty::new(fault));
        let verdict = |scene: &str| {
            let of = |c: &&Check| c.property == Property::Assumptions && c.scenario == scene;
            report.checks.iter().find(of).unwrap().verdict
        };
        for scene in ["board-bowed", "lens-decentred", "lens-of-another-kind"] {
            assert_eq!(verdict(scene), Verdict::Failed, "{scene}: {}", report.to_text(200));
        }
        // Visible, and two and a half times what is stated, which sixteen samples do not show beyond chance.
        assert_eq!(verdict("noise-of-neighbours"), Verdict::Held);
        // Visible, and covered within half; invisible, and far from covered; invisible, and no matter.
        assert_eq!(verdict("noise-along-u"), Verdict::Held);
        assert_eq!(verdict("board-stretched"), Verdict::NotJudged);
        assert_eq!(verdict("board-of-another-size"), Verdict::NotJudged);
    }

    #[test]
    fn what_the_solver_says_of_broken_assumptions_is_told_in_every_report() {
        let report = report(&Builtin);
        assert!(report.held(), "{}", report.details());
        assert_eq!(report.assumptions.len(), 9);
        let of = |scene: &str| report.assumptions.iter().find(|a| a.scenario == scene).unwrap();
        let worst = |scene: &str| of(scene).worst.clone().unwrap();
        // A board of another size leaves the camera as it is; one that is stretched does not, and hardly
        // shows.
        let size = worst("board-of-another-size");
        assert!(size.interval.0 < 1.0 && size.interval.1 > 1.0, "{size:?}");
        let stretched = worst("board-stretched");
        assert!(stretched.interval.0 > 3.0 && !of("board-stretched").is_visible(), "{stretched:?}");
        assert!(of("lens-decentred").is_visible() && of("lens-decentred").flagged == 16);
        for text in [report.to_text(200), report.to_html(), report.to_json()] {
            assert!(text.contains("board-stretched") && text.contains("three thousandths wider"), "{text}");
        }
    }

    #[test]
    fn the_interval_of_a_ratio_is_the_chi_squared_one() {
        let found = too_small("fx", &[2.0; 16]).unwrap();
        // 16 * 4 over the quantiles 28.845 and 6.908 of chi-squared on 16.
        assert!((found.ratio - 2.0).abs() < 1e-12 && (found.bias - 2.0).abs() < 1e-12);
        assert!((found.interval.0 - (64.0f64 / 28.845).sqrt()).abs() < 1e-3, "{found:?}");
        assert!((found.interval.1 - (64.0f64 / 6.908).sqrt()).abs() < 1e-3, "{found:?}");
        assert!(too_small("fx", &[f64::INFINITY]).unwrap().ratio.is_finite());
        assert_eq!(too_small("fx", &[]), None);
    }

    fn admission(ratio: f64, samples: usize, flagged: usize) -> Admission {
        let worst = TooSmall { parameter: "fx", ratio, interval: (ratio, ratio), bias: 0.0, samples };
        Admission {
            scenario: "s",
            about: "",
            seen_in_residuals: VISIBLE,
            samples,
            flagged,
            worst: Some(worst),
        }
    }

    #[test]
    fn errors_are_judged_by_their_square_over_what_is_tolerated() {
        // Two samples of three times what is stated: 2 * 9 / 1.5^2 = 8, above which lies exp(-4).
        let chance = admission(3.0, 2, 0).chance_of_errors(3);
        // Tails have ten digits.
        assert!((chance - 3.0 * libm::exp(-4.0)).abs() < 1e-10, "{chance}");
        let unstated = Admission { worst: None, ..admission(3.0, 2, 0) };
        assert_eq!(unstated.chance_of_errors(3), 1.0);
    }

    #[test]
    fn silence_is_judged_against_one_sample_in_ten() {
        let chance = |flagged| admission(3.0, 3, flagged).chance_of_silence();
        for (flagged, expected) in [(0, 1e-3), (1, 0.028), (2, 0.271), (3, 1.0)] {
            assert!((chance(flagged) - expected).abs() < 1e-12, "{flagged}: {}", chance(flagged));
        }
        assert!(admission(3.0, 3, 0).is_visible());
        assert!(!Admission { seen_in_residuals: 0.899, ..admission(3.0, 3, 0) }.is_visible());
    }

    #[test]
    fn errors_of_both_signs_have_a_ratio_and_no_bias() {
        let found = too_small("fx", &[3.0, -3.0, 1.0, -1.0]).unwrap();
        assert!((found.ratio - 5.0f64.sqrt()).abs() < 1e-12 && found.bias == 0.0, "{found:?}");
        assert_eq!(found.samples, 4);
    }

    #[test]
    fn a_sample_is_flagged_by_a_rare_warning_or_a_refusal_of_who_answers_good_data() {
        let (_, any) = crate::judge::tests::any_estimate();
        let warned = |warnings| Seen::Estimate(Box::new(Trial { warnings, ..any.clone() }));
        let refused = Seen::Refused { reason: "no".into(), seconds: 0.0 };
        let chatty = Habits { warns_rarely: false, answers: true };
        let mute = Habits { warns_rarely: true, answers: false };
        let flagged = |seen: &Seen| [Habits::UNKNOWN, chatty, mute].map(|habits| is_flagged(seen, habits));
        assert_eq!(flagged(&warned(0)), [false, false, false]);
        assert_eq!(flagged(&warned(2)), [true, false, true]);
        assert_eq!(flagged(&refused), [true, true, false]);
    }

    #[test]
    fn what_is_told_has_the_errors_the_flags_and_whether_it_is_visible() {
        let told = admission(3.0, 16, 4).told();
        assert!(told.contains("fx are 3.00 times") && told.contains("4 of 16 flagged"), "{told}");
        assert!(!told.contains("told only"), "{told}");
        let hidden = Admission { seen_in_residuals: 0.5, worst: None, ..admission(3.0, 16, 4) }.told();
        assert!(hidden.contains("no standard deviations") && hidden.contains("told only"), "{hidden}");
    }
}
