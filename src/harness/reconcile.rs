//! Does our number reproduce the book's? One expectation for each rule.

use super::predicted::Predicted;
use super::published::{Entry, Rule};
use calibench::io::significant;

/// What the published number is held against.
#[derive(Debug, Clone, PartialEq)]
pub enum Expectation {
    /// Ours rounds to the printed digits.
    Rounds,
    /// Both values lie inside the predicted distribution.
    Distribution {
        /// The prediction.
        predicted: Predicted,
        /// Chance that one correct draw lies outside.
        false_alarm_rate: f64,
        /// The interval at that rate.
        interval: (f64, f64),
    },
    /// Ours comes within a tolerance.
    Within {
        /// Where the tolerance comes from.
        reason: String,
        /// Largest accepted difference, in the number's unit.
        tolerance: f64,
    },
}

/// A published number beside ours.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconciliation {
    /// The published number.
    pub entry: Entry,
    /// Our value.
    pub ours: f64,
    /// What they are held against.
    pub expectation: Expectation,
    /// Whether the published value fits. An exact value always does: it is ours that must reproduce it.
    pub book_held: bool,
    /// Whether our value fits.
    pub ours_held: bool,
}

impl Reconciliation {
    /// Whether the published value and ours both fit.
    pub fn held(&self) -> bool {
        self.book_held && self.ours_held
    }

    pub(super) fn exact(entry: &Entry, ours: f64) -> Reconciliation {
        Reconciliation {
            entry: entry.clone(),
            ours,
            expectation: Expectation::Rounds,
            book_held: true,
            ours_held: entry.rounds_from(ours),
        }
    }

    /// The book's value is known to half a unit of its last digit: it is inside if any value that rounds to
    /// it is.
    pub(super) fn sampled(
        entry: &Entry,
        ours: f64,
        predicted: Predicted,
        false_alarm_rate: f64,
    ) -> Reconciliation {
        let (low, high) = predicted.interval(false_alarm_rate);
        let rounding = entry.rounding();
        let false_alarm_rate = predicted.effective_rate(false_alarm_rate);
        Reconciliation {
            book_held: (low - rounding..=high + rounding).contains(&entry.value()),
            ours_held: (low..=high).contains(&ours),
            entry: entry.clone(),
            ours,
            expectation: Expectation::Distribution { predicted, false_alarm_rate, interval: (low, high) },
        }
    }

    pub(super) fn within(entry: &Entry, ours: f64, tolerance: f64, reason: String) -> Reconciliation {
        Reconciliation {
            entry: entry.clone(),
            ours,
            book_held: true,
            ours_held: (ours - entry.value()).abs() <= tolerance,
            expectation: Expectation::Within { reason, tolerance },
        }
    }

    /// The rule that this expectation serves.
    pub fn rule(&self) -> Rule {
        match self.expectation {
            Expectation::Rounds => Rule::Exact,
            Expectation::Distribution { .. } => Rule::Sampled,
            Expectation::Within { .. } => Rule::Within,
        }
    }

    /// The expectation in words, as it is locked in the snapshot.
    pub fn expectation_text(&self) -> String {
        match &self.expectation {
            Expectation::Rounds => "ours rounds to the printed digits".to_string(),
            Expectation::Distribution { predicted, false_alarm_rate, .. } => {
                format!("{predicted}, false-alarm rate {false_alarm_rate:?}")
            }
            Expectation::Within { reason, tolerance } => format!("within {tolerance:?}: {reason}"),
        }
    }

    /// One sentence for a person: what failed and by how much.
    pub fn describe(&self) -> String {
        let Entry { id, unit, printed, .. } = &self.entry;
        let ours = significant(self.ours, 9);
        let head = format!("{id}: book {printed} {unit}, ours {ours} {unit}");
        match &self.expectation {
            Expectation::Rounds => {
                format!("{head}; ours must round to the printed digits")
            }
            Expectation::Distribution { predicted, false_alarm_rate, interval: (low, high) } => {
                let (low, high) = (significant(*low, 6), significant(*high, 6));
                format!("{head}; predicted [{low}, {high}] at rate {false_alarm_rate} ({predicted})")
            }
            Expectation::Within { reason, tolerance } => {
                let difference = significant(self.ours - self.entry.value(), 3);
                format!("{head}; difference {difference}, tolerance {tolerance} ({reason})")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::published::Kind;
    use super::*;

    fn entry(printed: &str, rule: Rule) -> Entry {
        Entry {
            id: "e.n".into(),
            section: "5.3".into(),
            unit: "px".into(),
            printed: printed.into(),
            rule: Some(rule),
            kind: Kind::Independent,
            because: String::new(),
            what: String::new(),
        }
    }

    #[test]
    fn a_sampled_number_needs_both_values_inside() {
        let normal = || Predicted::Normal { mean: 600.0, sd: 0.681 };
        let at =
            |printed, ours| Reconciliation::sampled(&entry(printed, Rule::Sampled), ours, normal(), 1e-3);
        assert!(at("598.5707", 600.3).held());
        let outside = at("596.0", 600.3);
        assert!(outside.ours_held && !outside.book_held && !outside.held());
        assert!(!at("598.5707", 590.0).ours_held);
    }

    #[test]
    fn ours_must_come_within_the_tolerance() {
        let at = |ours| Reconciliation::within(&entry("236.2", Rule::Within), ours, 0.05, "rounding".into());
        assert!(at(236.24).held() && !at(236.26).held() && !at(f64::NAN).held());
    }
}
