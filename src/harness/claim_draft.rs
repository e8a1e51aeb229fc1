//! How is a claim said? By its parts, the reason last.

use super::claim::{Cases, Claim};
use super::predicted::Predicted;
use super::record::Record;
use calibench::evaluate::Interval;
use std::panic::Location;

/// A claim whose statement is said: what must hold, and at which rate it may fail by chance.
/// [`ClaimDraft::because`] closes it, so that no claim is without a reason.
///
/// ```
/// use calibench::evaluate::Interval;
/// use calibench_harness::Record;
///
/// let mut record = Record::new("four-pose", 1);
/// let (bias_px, sd_px, trials) = (0.004, 0.68, 2000);
/// record
///     .claim_that("fx-unbiased", "the mean error of fx is zero within the uncertainty of the mean")
///     .within(bias_px, Interval::of_mean(0.0, sd_px, trials, 1e-4))
///     .unit("px")
///     .at_rate(1e-4)
///     .because("the bound's standard deviation over the root of the number of trials, normal");
/// assert!(record.claims()[0].held);
/// ```
#[derive(Debug)]
#[must_use = "a claim counts once its reason is said: `because`"]
pub struct ClaimDraft<'a> {
    record: &'a mut Record,
    /// Value, interval and cases are those of a claim that nothing fulfils until one of the conditions is
    /// said.
    claim: Claim,
    /// What stands before the reason: a predicted distribution.
    prediction: Option<String>,
    /// Where it was begun.
    place: &'static Location<'static>,
}

impl Record {
    /// Begins a claim: its name within the experiment, and what is claimed, as a sentence.
    #[track_caller]
    pub fn claim_that(&mut self, id: impl Into<String>, statement: impl Into<String>) -> ClaimDraft<'_> {
        let claim = Claim {
            id: id.into(),
            statement: statement.into(),
            value: f64::NAN,
            unit: String::new(),
            interval: (f64::NAN, f64::NAN),
            reason: String::new(),
            false_alarm_rate: None,
            held: false,
            cases: None,
            failures: Vec::new(),
        };
        ClaimDraft { record: self, claim, prediction: None, place: Location::caller() }
    }
}

impl ClaimDraft<'_> {
    fn holds(self, value: f64, (low, high): (f64, f64)) -> Self {
        let held = (low..=high).contains(&value);
        Self { claim: Claim { value, interval: (low, high), held, ..self.claim }, ..self }
    }

    /// `value` lies in the interval, both ends included. NaN is never within.
    pub fn within(self, value: f64, interval: Interval) -> Self {
        self.holds(value, (interval.low, interval.high))
    }

    /// `value <= bound`.
    pub fn at_most(self, value: f64, bound: f64) -> Self {
        self.holds(value, (f64::NEG_INFINITY, bound))
    }

    /// `value >= bound`.
    pub fn at_least(self, value: f64, bound: f64) -> Self {
        self.holds(value, (bound, f64::INFINITY))
    }

    /// Every named case holds; `noun` says in the plural what they are. The value is the number of cases that
    /// fail; no case at all is a failure too.
    pub fn every<N: Into<String>>(self, noun: &str, cases: impl IntoIterator<Item = (N, bool)>) -> Self {
        let mut count = 0;
        let mut failures = Vec::new();
        for (name, held) in cases {
            count += 1;
            if !held {
                failures.push(name.into());
            }
        }
        if count == 0 {
            failures.push("no case was examined".to_string());
        }
        let all = self.holds(failures.len() as f64, (0.0, 0.0));
        let cases = Some(Cases { count, noun: noun.to_string() });
        Self { claim: Claim { failures, cases, ..all.claim }, ..all }
    }

    /// `value` lies in the central interval of its predicted distribution that a correct program misses at
    /// `false_alarm_rate`. The distribution stands before the reason.
    pub fn drawn_from(self, value: f64, predicted: &Predicted, false_alarm_rate: f64) -> Self {
        let judged = self.holds(value, predicted.interval(false_alarm_rate));
        Self { prediction: Some(predicted.to_string()), ..judged }
            .at_rate(predicted.effective_rate(false_alarm_rate))
    }

    /// How often a correct program fails the claim.
    pub fn at_rate(self, false_alarm_rate: f64) -> Self {
        Self { claim: Claim { false_alarm_rate: Some(false_alarm_rate), ..self.claim }, ..self }
    }

    /// The unit of the value and the interval.
    pub fn unit(self, unit: impl Into<String>) -> Self {
        Self { claim: Claim { unit: unit.into(), ..self.claim }, ..self }
    }

    /// Where the interval comes from. Adds the claim to the record.
    pub fn because(self, reason: impl Into<String>) {
        let reason = reason.into();
        let reason = self.prediction.map_or(reason.clone(), |predicted| format!("{predicted}; {reason}"));
        self.record.add_claim(Claim { reason, ..self.claim }, self.place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The claim that a sentence adds to a record.
    fn claim(sentence: impl FnOnce(ClaimDraft<'_>)) -> Claim {
        let mut record = Record::new("e", 0);
        sentence(record.claim_that("c", "is right"));
        record.claims()[0].clone()
    }

    #[test]
    fn a_claim_holds_on_its_edge_and_never_for_nan() {
        let unit = Interval { low: 0.0, high: 1.0 };
        let held = |value| claim(|c| c.within(value, unit).because("definition")).held;
        assert!(held(0.0) && held(1.0));
        assert!(!held(1.0 + f64::EPSILON) && !held(f64::NAN));
        assert!(!claim(|c| c.at_most(f64::NAN, 1.0).because("")).held);
        assert!(claim(|c| c.at_least(2.0, 1.0).because("")).held);
        assert!(!claim(|c| c.because("no condition")).held);
    }

    #[test]
    fn a_claim_about_many_names_the_cases_that_fail() {
        let of_three =
            claim(|c| c.every("cells", [("one", true), ("two", false), ("three", false)]).because(""));
        assert!(!of_three.held);
        assert_eq!(of_three.counted().unwrap(), "1 of 3 cells");
        assert_eq!((of_three.value, of_three.failures), (2.0, vec!["two".to_string(), "three".to_string()]));
        let none = claim(|c| c.every::<String>("cases", []).because(""));
        assert!(!none.held && none.counted().unwrap() == "0 of 0 cases");
    }

    #[test]
    fn a_drawn_value_is_judged_at_the_stated_rate() {
        let predicted = Predicted::Normal { mean: 0.0, sd: 1.0 };
        // Two-sided 5 % of the normal distribution: 1.959964.
        let judged = |value| claim(|c| c.drawn_from(value, &predicted, 0.05).because("theory"));
        assert!(judged(1.9599).held && !judged(1.9600).held);
        assert_eq!(judged(0.0).false_alarm_rate, Some(0.05));
        assert!(judged(0.0).reason.ends_with("; theory"));
    }
}
