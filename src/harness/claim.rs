//! Is the number correct? A statement about one value, with the interval that theory or an oracle gives and
//! its reason.

use super::predicted::Predicted;
use super::record::Record;
use calibench::evaluate::Interval;

/// A statement that holds or does not. Blessing never changes it: a claim that fails is a finding about the
/// code.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// Name within the experiment, in kebab-case.
    pub id: String,
    /// What is claimed, as a sentence.
    pub statement: String,
    /// The value judged.
    pub value: f64,
    /// Unit of the value, empty for a pure number.
    pub unit: String,
    /// Where the value must lie, both ends included; an end may be infinite.
    pub interval: (f64, f64),
    /// Where the interval comes from.
    pub reason: String,
    /// Chance that a correct program fails this claim; `None` where nothing is drawn.
    pub false_alarm_rate: Option<f64>,
    /// Whether the value lies in the interval.
    pub held: bool,
    /// How many cases a claim about many examined, and what one of them is called; `None` for a claim about
    /// one value.
    pub cases: Option<Cases>,
    /// The cases that failed, for a claim about many.
    pub failures: Vec<String>,
}

/// The cases of a claim about many.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cases {
    /// How many were examined.
    pub count: usize,
    /// What they are, in the plural: cells, shifts, rows.
    pub noun: String,
}

impl Claim {
    /// `low <= value <= high`. NaN is never within.
    pub fn within(
        id: impl Into<String>,
        statement: impl Into<String>,
        value: f64,
        (low, high): (f64, f64),
        reason: impl Into<String>,
    ) -> Claim {
        Claim {
            id: id.into(),
            statement: statement.into(),
            value,
            unit: String::new(),
            interval: (low, high),
            reason: reason.into(),
            false_alarm_rate: None,
            held: (low..=high).contains(&value),
            cases: None,
            failures: Vec::new(),
        }
    }

    /// `value <= bound`.
    pub fn at_most(
        id: impl Into<String>,
        statement: impl Into<String>,
        value: f64,
        bound: f64,
        reason: impl Into<String>,
    ) -> Claim {
        Claim::within(id, statement, value, (f64::NEG_INFINITY, bound), reason)
    }

    /// `value >= bound`.
    pub fn at_least(
        id: impl Into<String>,
        statement: impl Into<String>,
        value: f64,
        bound: f64,
        reason: impl Into<String>,
    ) -> Claim {
        Claim::within(id, statement, value, (bound, f64::INFINITY), reason)
    }

    /// Every named case holds. The value is the number of cases that fail; no case at all is a failure too.
    pub fn all_of(
        id: impl Into<String>,
        statement: impl Into<String>,
        cases: impl IntoIterator<Item = (String, bool)>,
        reason: impl Into<String>,
    ) -> Claim {
        let mut count = 0;
        let mut failures = Vec::new();
        for (name, held) in cases {
            count += 1;
            if !held {
                failures.push(name);
            }
        }
        if count == 0 {
            failures.push("no case was examined".to_string());
        }
        let claim = Claim::within(id, statement, failures.len() as f64, (0.0, 0.0), reason);
        Claim { failures, cases: Some(Cases { count, noun: "cases".to_string() }), ..claim }
    }

    /// Says what one of the cases of [`Claim::all_of`] is, in the plural.
    pub fn over(self, noun: impl Into<String>) -> Claim {
        let noun = noun.into();
        Claim { cases: self.cases.map(|cases| Cases { noun, ..cases }), ..self }
    }

    /// `56 of 56 cells`: the cases that hold; `None` for a claim about one value.
    pub fn counted(&self) -> Option<String> {
        let Cases { count, noun } = self.cases.as_ref()?;
        Some(format!("{} of {count} {noun}", count.saturating_sub(self.failures.len())))
    }

    /// The value lies in the central interval of its predicted distribution that a correct program misses at
    /// `false_alarm_rate`.
    pub fn drawn_from(
        id: impl Into<String>,
        statement: impl Into<String>,
        value: f64,
        predicted: &Predicted,
        false_alarm_rate: f64,
        reason: impl Into<String>,
    ) -> Claim {
        let interval = predicted.interval(false_alarm_rate);
        let reason = format!("{}; {}", predicted, reason.into());
        Claim::within(id, statement, value, interval, reason)
            .with_false_alarm_rate(predicted.effective_rate(false_alarm_rate))
    }

    /// States how often a correct program fails the claim.
    pub fn with_false_alarm_rate(self, rate: f64) -> Claim {
        Claim { false_alarm_rate: Some(rate), ..self }
    }

    /// States the unit of the value and the interval.
    pub fn in_unit(self, unit: impl Into<String>) -> Claim {
        Claim { unit: unit.into(), ..self }
    }
}

/// A claim whose statement is said: what must hold, and at which rate it may fail by chance.
/// [`ClaimDraft::because`] closes it, so that no claim is without a reason.
///
/// ```text
/// record
///     .claim_that("fx-unbiased", "the mean error of fx is zero within the uncertainty of the mean")
///     .within(bias, interval)
///     .unit("px")
///     .at_rate(1e-4)
///     .because("the bound's standard deviation over the root of the number of trials, normal");
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
}

impl Record {
    /// Begins a claim: its name within the experiment, and what is claimed, as a sentence.
    pub fn claim_that(&mut self, id: impl Into<String>, statement: impl Into<String>) -> ClaimDraft<'_> {
        let claim = Claim::within(id, statement, f64::NAN, (f64::NAN, f64::NAN), "");
        ClaimDraft { record: self, claim, prediction: None }
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
        self.record.claim(Claim { reason, ..self.claim });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_holds_on_its_edge_and_never_for_nan() {
        let held = |value| Claim::within("c", "in one", value, (0.0, 1.0), "definition").held;
        assert!(held(0.0) && held(1.0));
        assert!(!held(1.0 + f64::EPSILON) && !held(f64::NAN));
        assert!(!Claim::at_most("c", "", f64::NAN, 1.0, "").held);
        assert!(Claim::at_least("c", "", 2.0, 1.0, "").held);
    }

    #[test]
    fn a_claim_about_many_names_the_cases_that_fail() {
        let cases = [("one", true), ("two", false), ("three", false)];
        let claim = Claim::all_of("c", "", cases.map(|(n, h)| (n.to_string(), h)), "");
        assert!(!claim.held);
        assert_eq!((claim.value, claim.failures), (2.0, vec!["two".to_string(), "three".to_string()]));
        let cells = [("a".to_string(), true), ("b".to_string(), false)];
        assert_eq!(Claim::all_of("c", "", cells, "").over("cells").counted().unwrap(), "1 of 2 cells");
        let none = Claim::all_of("c", "", [], "");
        assert!(!none.held && none.counted().unwrap() == "0 of 0 cases");
    }

    #[test]
    fn a_drawn_value_is_judged_at_the_stated_rate() {
        let predicted = Predicted::Normal { mean: 0.0, sd: 1.0 };
        // Two-sided 5 % of the normal distribution: 1.959964.
        let held = |value| Claim::drawn_from("c", "", value, &predicted, 0.05, "").held;
        assert!(held(1.9599) && !held(1.9600));
    }
}
