//! How many views, how far tilted, how widely placed, for a wanted accuracy? Predicted from the bound,
//! confirmed by trials: the bound is what no unbiased calibration of many views exceeds, and trials say
//! whether the estimator keeps it with these.

use super::engine::{Pace, in_memory};
use super::moments::Estimated;
use super::poses::{Poses, PosesError};
use super::spec::{Spec, Trials};
use super::spec_error::SpecError;
use super::summary::{CellSummary, summarise};

/// What is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// `fx`, ..., `depth`, `length`.
    pub quantity: String,
    /// Largest standard deviation, in the quantity's unit.
    pub sd: f64,
}

/// Where to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// Tilts of all views.
    pub tilts_deg: Vec<f64>,
    /// Shares of the way to the image's border.
    pub coverages: Vec<f64>,
    /// Most views.
    pub most_views: usize,
    /// Depth of the target.
    pub distance_mm: f64,
}

/// The fewest views of one tilt and coverage.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// Tilt of every view.
    pub tilt_deg: f64,
    /// See [`Poses::Spread`].
    pub coverage: f64,
    /// Fewest views that suffice, and the predicted standard deviation of each goal with them.
    pub enough: Option<(usize, Vec<f64>)>,
    /// Where no number suffices: the predicted standard deviations with the most views, if there are any, or
    /// why there are none.
    pub best: Result<Option<Vec<f64>>, String>,
}

/// What is known of a goal, or of all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The whole interval of the standard deviation lies at or below what is wanted.
    Confirmed,
    /// The whole interval lies above what is wanted, or that of the mean error lies further from 0 than it,
    /// or too few trials found a camera.
    Refuted,
    /// The interval holds what is wanted.
    Undecided,
}

impl Outcome {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Confirmed => "confirmed",
            Outcome::Refuted => "refuted",
            Outcome::Undecided => "undecided",
        }
    }

    fn of(sd: &Estimated, mean: &Estimated, wanted: f64) -> Outcome {
        match () {
            () if sd.low > wanted || is_off(mean, wanted) => Outcome::Refuted,
            () if sd.high <= wanted => Outcome::Confirmed,
            () => Outcome::Undecided,
        }
    }
}

/// Whether a mean error lies further from 0 than what is wanted.
fn is_off(mean: &Estimated, wanted: f64) -> bool {
    mean.low > wanted || mean.high < -wanted
}

/// What the trials of one attempt say of a goal.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The goal.
    pub goal: Goal,
    /// The bound.
    pub predicted_sd: f64,
    /// Measured standard deviation.
    pub sd: Estimated,
    /// Measured over predicted.
    pub ratio: Estimated,
    /// Mean error: where it is not 0, more views need not help.
    pub mean: Estimated,
    /// What follows.
    pub outcome: Outcome,
    /// Where nothing is decided: about how many trials would, if their standard deviation were the one
    /// measured; the logarithm of the interval narrows with the root of their number. `None` where that is no
    /// number of use.
    pub deciding_trials: Option<u64>,
}

impl Finding {
    fn of(goal: &Goal, predicted_sd: f64, [sd, ratio, mean]: [Estimated; 3], trials: u64) -> Finding {
        let outcome = Outcome::of(&sd, &mean, goal.sd);
        let deciding_trials = match outcome {
            Outcome::Undecided => deciding_trials(&sd, goal.sd, trials),
            _ => None,
        };
        Finding { goal: goal.clone(), predicted_sd, sd, ratio, mean, outcome, deciding_trials }
    }
}

/// More trials than these are no answer: the measured value cannot be told from what is wanted.
const MOST_DECIDING: f64 = 1e9;

fn deciding_trials(sd: &Estimated, wanted: f64, trials: u64) -> Option<u64> {
    let end = if sd.value <= wanted { sd.high } else { sd.low };
    let factor = libm::log(end / sd.value) / libm::log(wanted / sd.value);
    let needed = libm::ceil(trials as f64 * factor * factor);
    (needed <= MOST_DECIDING).then_some(needed as u64)
}

/// Trials of one number of views.
#[derive(Debug, Clone, PartialEq)]
pub struct Attempt {
    /// Tilt of every view.
    pub tilt_deg: f64,
    /// See [`Poses::Spread`].
    pub coverage: f64,
    /// Views.
    pub views: usize,
    /// Trials.
    pub trials: u64,
    /// Share that converged.
    pub converged: f64,
    /// One a goal; none where too few trials converged, fewer than 95 %.
    pub findings: Vec<Finding>,
}

impl Attempt {
    /// Confirmed if every goal is, refuted if one is.
    pub fn outcome(&self) -> Outcome {
        let is = |outcome| self.findings.iter().any(|finding| finding.outcome == outcome);
        match () {
            () if self.findings.is_empty() || is(Outcome::Refuted) => Outcome::Refuted,
            () if is(Outcome::Undecided) => Outcome::Undecided,
            () => Outcome::Confirmed,
        }
    }

    /// Whether a mean error is larger than what is wanted: no bound tells with how many views it will not be.
    pub fn is_off(&self) -> bool {
        self.findings.iter().any(|finding| is_off(&finding.mean, finding.goal.sd))
    }

    /// About how many trials would decide every goal, where nothing is decided.
    pub fn deciding_trials(&self) -> Option<u64> {
        let undecided = || self.findings.iter().filter(|finding| finding.outcome == Outcome::Undecided);
        undecided().map(|finding| finding.deciding_trials).collect::<Option<Vec<u64>>>()?.into_iter().max()
    }

    /// Whether these predictions, taken by as much as the trials of this attempt exceed its own, would be
    /// confirmed by as many trials.
    fn expects(&self, predicted: &[f64]) -> bool {
        self.findings.iter().zip(predicted).all(|(finding, sd)| sd * finding.ratio.high <= finding.goal.sd)
    }
}

/// A plan that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The scene.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// Nothing to plan for.
    #[error("a plan cannot be made for `{quantity}`; there are: {known}")]
    Quantity {
        /// As asked.
        quantity: String,
        /// Those that are.
        known: String,
    },
    /// A wanted value that is none.
    #[error("a standard deviation of {0} cannot be wanted: give a positive number")]
    Wanted(f64),
    /// Another lens model is estimated than the camera has.
    #[error(
        "the estimator's lens model is not the camera's: no bound says what that reaches, so that nothing can be planned; `study run` measures it"
    )]
    OtherModel,
    /// Two wishes for one quantity.
    #[error("`{0}` is wanted twice: give the smaller standard deviation alone")]
    Twice(String),
    /// No view of the search shows the whole target.
    #[error("no tilt and coverage shows the whole target: {0}")]
    Nowhere(String),
    /// Nothing is wanted.
    #[error("nothing is wanted: give a quantity and its largest standard deviation")]
    Nothing,
}

/// For every tilt and coverage the fewest views whose Cramer-Rao bound meets every goal.
///
/// The views of a longer series contain those of a shorter one, so the bound of every quantity falls with
/// every view and halving finds the fewest.
///
/// # Errors
/// [`PlanError`]: a scene that cannot be, a goal that is none.
pub fn search(spec: &Spec, goals: &[Goal], search: &Search) -> Result<Vec<Design>, PlanError> {
    check(goals)?;
    if spec.estimator.model != spec.scene.camera.0.distortion.model() {
        return Err(PlanError::OtherModel);
    }
    let mut designs = Vec::new();
    for &tilt_deg in &search.tilts_deg {
        for &coverage in &search.coverages {
            let at = |views: usize| {
                predicted(&with_poses(spec, views, tilt_deg, coverage, search.distance_mm), goals)
            };
            designs.push(match at(search.most_views) {
                // Another tilt or coverage may fit.
                Err(PlanError::Spec(SpecError::Poses {
                    cause: cause @ PosesError::OutsideImage { .. },
                    ..
                })) => Design { tilt_deg, coverage, enough: None, best: Err(cause.to_string()) },
                Err(error) => return Err(error),
                Ok(best) => {
                    let enough = match best.clone().filter(|sds| suffice(sds, goals)) {
                        Some(sds) => {
                            Some(fewest((0, search.most_views, sds), at, |sds| suffice(sds, goals))?)
                        }
                        None => None,
                    };
                    Design { tilt_deg, coverage, enough, best: Ok(best) }
                }
            });
        }
    }
    match designs.iter().map(|design| design.best.as_ref().err()).collect::<Option<Vec<_>>>().as_deref() {
        Some([why, ..]) => Err(PlanError::Nowhere(why.to_string())),
        _ => Ok(designs),
    }
}

fn check(goals: &[Goal]) -> Result<(), PlanError> {
    if goals.is_empty() {
        return Err(PlanError::Nothing);
    }
    for (i, goal) in goals.iter().enumerate() {
        if !(goal.sd > 0.0 && goal.sd.is_finite()) {
            return Err(PlanError::Wanted(goal.sd));
        }
        if goals[..i].iter().any(|other| other.quantity == goal.quantity) {
            return Err(PlanError::Twice(goal.quantity.clone()));
        }
    }
    Ok(())
}

fn suffice(sds: &[f64], goals: &[Goal]) -> bool {
    sds.iter().zip(goals).all(|(sd, goal)| *sd <= goal.sd)
}

/// The fewest views, more than `short`, whose predictions are good; `enough` views have predictions that are.
fn fewest(
    (mut short, mut enough, mut sds): (usize, usize, Vec<f64>),
    at: impl Fn(usize) -> Result<Option<Vec<f64>>, PlanError>,
    is_good: impl Fn(&[f64]) -> bool,
) -> Result<(usize, Vec<f64>), PlanError> {
    while enough - short > 1 {
        let middle = short + (enough - short) / 2;
        match at(middle)? {
            Some(found) if is_good(&found) => (enough, sds) = (middle, found),
            _ => short = middle,
        }
    }
    Ok((enough, sds))
}

/// The study's scene with other poses, without factors.
fn with_poses(spec: &Spec, views: usize, tilt_deg: f64, coverage: f64, distance_mm: f64) -> Spec {
    let mut spec = spec.clone();
    spec.factor.clear();
    spec.trials.precision = None;
    spec.scene.poses = Poses::Spread { views, tilt_deg, coverage, distance_mm };
    spec
}

/// The predicted standard deviation of each goal; `None` where the scene determines no camera.
fn predicted(spec: &Spec, goals: &[Goal]) -> Result<Option<Vec<f64>>, PlanError> {
    let cells = spec.cells("")?;
    let quantities = spec.quantities(&cells);
    let of = |goal: &Goal| {
        let at = quantities.iter().position(|q| q.is_error() && q.name() == goal.quantity);
        at.ok_or_else(|| PlanError::Quantity {
            quantity: goal.quantity.clone(),
            known: quantities
                .iter()
                .filter(|q| q.is_error())
                .map(|q| q.name())
                .collect::<Vec<_>>()
                .join(", "),
        })
    };
    let places = goals.iter().map(of).collect::<Result<Vec<_>, _>>()?;
    Ok(places.into_iter().map(|at| cells[0].prediction.0[at].map(|p| p.sd)).collect())
}

/// The designs that suffice, fewest views first; among equals the one whose predictions stay furthest below
/// what is wanted.
pub fn ranked<'a>(designs: &'a [Design], goals: &[Goal]) -> Vec<(usize, &'a Design)> {
    let largest = |sds: &[f64]| sds.iter().zip(goals).map(|(sd, goal)| sd / goal.sd).fold(0.0, f64::max);
    let known =
        designs.iter().filter_map(|d| d.enough.as_ref().map(|(views, sds)| (*views, largest(sds), d)));
    let mut known: Vec<_> = known.collect();
    known.sort_by(|(a, of_a, _), (b, of_b, _)| a.cmp(b).then(of_a.total_cmp(of_b)));
    known.into_iter().map(|(views, _, design)| (views, design)).collect()
}

/// Where fewer trials converge, the standard deviation is that of a selection, and the photographs of a user
/// are often refused.
const CONVERGED: f64 = 0.95;

/// Trials of a design with some number of views.
///
/// # Errors
/// [`PlanError`]: a scene that cannot be.
pub fn attempt(
    spec: &Spec,
    goals: &[Goal],
    (views, design): (usize, &Design),
    distance_mm: f64,
    trials: u64,
    report: impl FnMut(&Pace),
) -> Result<Attempt, PlanError> {
    let mut spec = with_poses(spec, views, design.tilt_deg, design.coverage, distance_mm);
    spec.trials = Trials { per_cell: trials, ..spec.trials };
    let engine = in_memory(spec, "", report)?;
    let cell = &summarise(&engine).cells[0];
    let findings = goals.iter().map(|goal| finding(cell, goal)).collect::<Option<Vec<_>>>();
    let converged = cell.converged().map_or(0.0, |share| share.value);
    let Design { tilt_deg, coverage, .. } = *design;
    let findings = findings.filter(|_| converged >= CONVERGED).unwrap_or_default();
    Ok(Attempt { tilt_deg, coverage, views, trials: cell.trials, converged, findings })
}

fn finding(cell: &CellSummary, goal: &Goal) -> Option<Finding> {
    let statistic = cell.of(&goal.quantity)?;
    let measured = [statistic.sd?, statistic.ratio?, statistic.mean?];
    Some(Finding::of(goal, statistic.predicted?.sd, measured, cell.trials))
}

/// The number of views to try after an attempt that confirmed nothing: the fewest more whose bound, taken by
/// as much as the trials exceeded it at most, meets every goal, so that as many trials are expected to
/// confirm it. The most views where none does or a mean error is larger than what is wanted, of which the
/// bound says nothing, and twice as many where too few trials converged; `None` beyond the most views.
///
/// # Errors
/// [`PlanError`]: a scene that cannot be.
pub fn next_views(
    spec: &Spec,
    goals: &[Goal],
    (after, design): (&Attempt, &Design),
    search: &Search,
) -> Result<Option<usize>, PlanError> {
    let most = search.most_views;
    if after.views >= most {
        return Ok(None);
    }
    if after.findings.is_empty() {
        return Ok(Some((2 * after.views).min(most)));
    }
    if after.is_off() {
        return Ok(Some(most));
    }
    let poses = |views| with_poses(spec, views, design.tilt_deg, design.coverage, search.distance_mm);
    let at = |views| predicted(&poses(views), goals);
    match at(most)?.filter(|sds| after.expects(sds)) {
        Some(sds) => Ok(Some(fewest((after.views, most, sds), at, |sds| after.expects(sds))?.0)),
        None => Ok(Some(most)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimated(value: f64, part: f64) -> Estimated {
        Estimated { value, low: value * (1.0 - part), high: value * (1.0 + part) }
    }

    fn finding(value: f64, part: f64, wanted: f64) -> Finding {
        let goal = Goal { quantity: "fx".into(), sd: wanted };
        let mean = Estimated { value: 0.0, low: -0.1, high: 0.1 };
        Finding::of(&goal, value, [estimated(value, part), estimated(1.0, part), mean], 500)
    }

    fn attempt(findings: Vec<Finding>) -> Attempt {
        Attempt { tilt_deg: 30.0, coverage: 0.5, views: 5, trials: 500, converged: 1.0, findings }
    }

    #[test]
    fn each_goal_is_held_against_the_bound_of_its_own_quantity() {
        let spec = Spec::parse(crate::example::STUDY).unwrap();
        let goal = |quantity: &str| Goal { quantity: quantity.into(), sd: 1.0 };
        let sds = predicted(&spec, &[goal("fx"), goal("k1")]).unwrap().unwrap();
        let cells = spec.cells("").unwrap();
        let quantities = spec.quantities(&cells);
        for (sd, name) in sds.iter().zip(["fx", "k1"]) {
            let at = quantities.iter().position(|q| q.name() == name).unwrap();
            assert_eq!(Some(*sd), cells[0].prediction.0[at].map(|p| p.sd), "{name}");
        }
        // The RMSE is measured, but is no error of which less could be wished.
        assert!(matches!(predicted(&spec, &[goal("rmse")]), Err(PlanError::Quantity { .. })));
    }

    #[test]
    fn only_an_interval_that_lies_at_or_below_the_wish_as_a_whole_confirms_it() {
        // An interval of 0.94 to 1.06 of the value.
        for (value, outcome) in [
            (0.90, Outcome::Confirmed),
            (0.95, Outcome::Undecided),
            (1.00, Outcome::Undecided),
            (1.06, Outcome::Undecided),
            (1.07, Outcome::Refuted),
        ] {
            assert_eq!(finding(value, 0.06, 1.0).outcome, outcome, "{value}");
        }
        let exact = finding(1.0, 0.0, 1.0);
        assert_eq!(
            exact.outcome,
            Outcome::Confirmed,
            "an interval that ends at the wish lies at or below it"
        );
    }

    #[test]
    fn a_mean_error_beyond_the_wish_refutes_it_however_small_the_spread() {
        let goal = Goal { quantity: "fx".into(), sd: 1.0 };
        let off = |low: f64, high: f64| {
            let mean = Estimated { value: 0.5 * (low + high), low, high };
            Finding::of(&goal, 0.1, [estimated(0.1, 0.06), estimated(1.0, 0.06), mean], 500).outcome
        };
        assert_eq!(off(-8.1, -7.8), Outcome::Refuted);
        assert_eq!(off(1.1, 1.2), Outcome::Refuted);
        assert_eq!(off(0.8, 1.2), Outcome::Confirmed, "it is told, and not surely beyond the wish");
    }

    #[test]
    fn an_attempt_is_as_good_as_its_worst_goal() {
        let [good, open, bad] = [0.5, 1.0, 2.0].map(|value| finding(value, 0.06, 1.0));
        assert_eq!(attempt(vec![good.clone(), good.clone()]).outcome(), Outcome::Confirmed);
        assert_eq!(attempt(vec![good.clone(), open.clone()]).outcome(), Outcome::Undecided);
        assert_eq!(attempt(vec![open, good, bad]).outcome(), Outcome::Refuted);
        assert_eq!(attempt(vec![]).outcome(), Outcome::Refuted, "nothing converged");
    }

    #[test]
    fn as_many_trials_decide_as_narrow_the_interval_to_the_wish() {
        // The upper end has to come down from 6 to 3 per cent above: four times the trials, but for the
        // curvature of the logarithm.
        let trials = finding(1.0, 0.06, 1.03).deciding_trials.unwrap();
        assert!((1900..2000).contains(&trials), "{trials}");
        let trials = finding(1.0, 0.06, 0.98).deciding_trials.unwrap();
        assert!((4600..4800).contains(&trials), "{trials}");
        assert_eq!(finding(1.0, 0.06, 1.0).deciding_trials, None, "nothing decides between equals");
        assert_eq!(finding(0.5, 0.06, 1.0).deciding_trials, None, "it is decided");
    }

    #[test]
    fn halving_finds_the_fewest_views_that_suffice() {
        for enough in 4..=20 {
            // Below four views there is no camera.
            let at = |views: usize| Ok((views >= 4).then(|| vec![1.0 / views as f64]));
            let is_good = |sds: &[f64]| sds[0] <= 1.0 / enough as f64;
            let found = fewest((0, 20, vec![0.05]), at, is_good).unwrap();
            assert_eq!(found, (enough, vec![1.0 / enough as f64]));
        }
    }

    #[test]
    fn the_views_found_are_the_first_whose_bound_meets_the_wish() {
        let spec = Spec::parse(crate::example::STUDY).unwrap();
        let wide = Search { tilts_deg: vec![30.0], coverages: vec![0.0], most_views: 12, distance_mm: 150.0 };
        let goal = |sd: f64| [Goal { quantity: "fx".into(), sd }];
        let sd = |views: usize| {
            predicted(&with_poses(&spec, views, 30.0, 0.0, 150.0), &goal(1.0)).unwrap().map(|sds| sds[0])
        };
        let wanted = sd(7).unwrap();
        let found = search(&spec, &goal(wanted), &wide).unwrap();
        assert_eq!(found[0].enough, Some((7, vec![wanted])));
        assert_eq!(found[0].best, Ok(Some(vec![sd(12).unwrap()])));
        let found = search(&spec, &goal(0.99 * sd(12).unwrap()), &wide).unwrap();
        assert_eq!(found[0].enough, None);
        // Where the board fits nowhere there is no plan; where it fits somewhere there is one.
        let near = Search { distance_mm: 20.0, ..wide.clone() };
        assert!(matches!(search(&spec, &goal(1.0), &near), Err(PlanError::Nowhere(_))));
        let beside = Search { tilts_deg: vec![5.0, 30.0], distance_mm: 26.5, ..wide };
        let found = search(&spec, &goal(1.0), &beside).unwrap();
        assert!(found[0].best.is_ok() && found[1].best.is_err(), "{found:?}");
    }

    #[test]
    fn a_wish_is_a_positive_number_and_stands_once() {
        let goal = |quantity: &str, sd: f64| Goal { quantity: quantity.into(), sd };
        for sd in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            assert!(matches!(check(&[goal("fx", sd)]), Err(PlanError::Wanted(_))), "{sd}");
        }
        assert_eq!(check(&[goal("fx", 1.0), goal("fx", 2.0)]), Err(PlanError::Twice("fx".into())));
        assert_eq!(check(&[goal("fx", 1.0), goal("fy", 1.0)]), Ok(()));
        assert_eq!(check(&[]), Err(PlanError::Nothing));
    }

    #[test]
    fn as_many_trials_decide_an_attempt_as_its_slowest_goal_needs() {
        let [sooner, later, never, done] =
            [(1.0, 1.03), (1.0, 0.98), (1.0, 1.0), (0.5, 1.0)].map(|(x, wanted)| finding(x, 0.06, wanted));
        let most = later.deciding_trials;
        assert!(most > sooner.deciding_trials);
        assert_eq!(attempt(vec![sooner.clone(), later.clone(), done]).deciding_trials(), most);
        assert_eq!(attempt(vec![sooner, never, later]).deciding_trials(), None);
    }

    #[test]
    fn predictions_are_taken_by_as_much_as_the_trials_exceeded_them_at_most() {
        // The trials exceed the bound by 6 % at most.
        let tried = attempt(vec![finding(1.0, 0.06, 2.12)]);
        assert!(tried.expects(&[1.99]) && !tried.expects(&[2.01]));
        let exact = attempt(vec![finding(1.0, 0.0, 2.0)]);
        assert!(exact.expects(&[2.0]), "at the wish it is met");
    }

    #[test]
    fn too_few_trials_that_converge_ask_for_twice_the_views_and_no_more_than_the_most() {
        let spec = Spec::parse(crate::example::STUDY).unwrap();
        let to = |most_views| Search {
            tilts_deg: vec![30.0],
            coverages: vec![0.5],
            most_views,
            distance_mm: 150.0,
        };
        let design = Design { tilt_deg: 30.0, coverage: 0.5, enough: None, best: Ok(None) };
        let next = |most| next_views(&spec, &[], (&attempt(vec![]), &design), &to(most)).unwrap();
        assert_eq!([next(20), next(8), next(6), next(5)], [Some(10), Some(8), Some(6), None]);
    }

    #[test]
    fn fewest_views_rank_first_and_among_equals_the_smaller_part_of_the_wish() {
        let goals = [("fx", 2.0), ("k1", 0.1)].map(|(q, sd)| Goal { quantity: q.into(), sd });
        let design = |coverage: f64, enough: Option<(usize, Vec<f64>)>| Design {
            tilt_deg: 30.0,
            coverage,
            enough,
            best: Ok(None),
        };
        // Parts of the wishes: 0.5 and 0.9, 0.8 and 0.1, nothing, 0.95 and 0.95.
        let designs = [
            design(0.1, Some((6, vec![1.0, 0.09]))),
            design(0.2, Some((6, vec![1.6, 0.01]))),
            design(0.3, None),
            design(0.4, Some((5, vec![1.9, 0.095]))),
        ];
        let order: Vec<(usize, f64)> =
            ranked(&designs, &goals).into_iter().map(|(views, design)| (views, design.coverage)).collect();
        assert_eq!(order, [(5, 0.4), (6, 0.2), (6, 0.1)]);
    }

    #[test]
    fn outcomes_are_told_by_the_names_that_they_have_in_the_documents() {
        let names = [Outcome::Confirmed, Outcome::Refuted, Outcome::Undecided].map(Outcome::name);
        assert_eq!(names, ["confirmed", "refuted", "undecided"]);
    }

    #[test]
    fn an_attempt_finds_what_a_study_of_its_poses_measures() {
        let (scene, _) = crate::example::STUDY.split_once("[[factor]]").unwrap();
        let text = scene.replace("per_cell = 3", "per_cell = 6").replace("views = 3", "views = 8");
        let engine = in_memory(Spec::parse(&text).unwrap(), &text, |_| ()).unwrap();
        let cell = &summarise(&engine).cells[0];
        // The goals in another order than the quantities.
        let goals = ["depth", "fx"].map(|quantity| Goal { quantity: quantity.into(), sd: 1e9 });
        let design = Design { tilt_deg: 30.0, coverage: 0.0, enough: None, best: Ok(None) };
        let spec = Spec::parse(crate::example::STUDY).unwrap();
        let tried = super::attempt(&spec, &goals, (8, &design), 150.0, 6, |_| ()).unwrap();
        assert_eq!((tried.views, tried.trials, tried.converged), (8, 6, 1.0));
        assert_eq!((tried.findings.len(), tried.outcome()), (2, Outcome::Confirmed));
        for (found, goal) in tried.findings.iter().zip(&goals) {
            let measured = cell.of(&goal.quantity).unwrap();
            assert_eq!(&found.goal, goal);
            assert_eq!(
                [found.sd, found.ratio, found.mean].map(Some),
                [measured.sd, measured.ratio, measured.mean]
            );
            assert_eq!(Some(found.predicted_sd), measured.predicted.map(|p| p.sd));
        }
    }
}
