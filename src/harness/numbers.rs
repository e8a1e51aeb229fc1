//! Numbers that share a unit and a band: both are said once, and the printed value stands beside the number.

use super::band::Band;
use super::predicted::Predicted;
use super::published::Rule;
use super::reconcile::Reconciliation;
use super::record::{Number, Record};
use std::panic::Location;

/// A group of numbers, begun by [`Record::group`] or [`Record::exact`].
///
/// ```
/// use calibench_harness::{Band, Record};
///
/// let mut record = Record::new("noise", 1);
/// record
///     .exact("px")
///     .number("sigma", 0.1, "standard deviation of the noise")
///     .unit("")
///     .count("trials", 2000, "trials of the Monte Carlo")
///     .group("px", Band::relative(1e-6, "where the refinement ends"))
///     .number("rmse", 0.1371, "reprojection RMSE per point");
/// let units: Vec<&str> = record.numbers().iter().map(|number| number.unit.as_str()).collect();
/// assert_eq!(units, ["px", "", "px"]);
/// ```
///
/// A number of an experiment that the chapter prints is held against it by the word behind it, such as
/// [`rounds_to_printed`](Numbers::rounds_to_printed).
#[derive(Debug)]
pub struct Numbers<'a> {
    record: &'a mut Record,
    unit: String,
    band: Band,
    /// What the names of the numbers begin and end with, and what their descriptions end with.
    prefix: String,
    suffix: (String, String),
    /// Name of the last number: what a reconciliation is about.
    last: String,
}

impl Record {
    /// Begins a group of numbers of one unit, each locked within `band`.
    pub fn group(&mut self, unit: impl Into<String>, band: Band) -> Numbers<'_> {
        let (prefix, suffix) = Default::default();
        Numbers { record: self, unit: unit.into(), band, prefix, suffix, last: String::new() }
    }

    /// Begins a group of numbers of one unit of which not a bit may change.
    pub fn exact(&mut self, unit: impl Into<String>) -> Numbers<'_> {
        self.group(unit, Band::Exact)
    }

    /// A number that is in the record already, to be held against its published value.
    pub fn reconcile(&mut self, id: impl Into<String>) -> Numbers<'_> {
        Numbers { last: id.into(), ..self.exact("") }
    }
}

impl Numbers<'_> {
    /// Adds a number: its name within the experiment, its value, and what it is.
    #[track_caller]
    pub fn number(&mut self, id: impl Into<String>, value: f64, what: impl Into<String>) -> &mut Self {
        let (unit, band) = (self.unit.clone(), self.band.clone());
        self.last = format!("{}{}{}", self.prefix, id.into(), self.suffix.0);
        let (id, description) = (self.last.clone(), what.into() + &self.suffix.1);
        self.record.add_number(Number { id, value, unit, band, description }, Location::caller());
        self
    }

    /// Adds a number that counts something.
    #[track_caller]
    pub fn count(&mut self, id: impl Into<String>, count: usize, what: impl Into<String>) -> &mut Self {
        self.number(id, count as f64, what)
    }

    /// What the names of the numbers that follow begin with: `tenth-` makes `tenth-rmse` of `rmse`.
    pub fn prefix(&mut self, id: impl Into<String>) -> &mut Self {
        self.prefix = id.into();
        self
    }

    /// What the names of the numbers that follow end with, and their descriptions: `-20` and `, tilt 20 deg`.
    pub fn suffix(&mut self, id: impl Into<String>, what: impl Into<String>) -> &mut Self {
        self.suffix = (id.into(), what.into());
        self
    }

    /// Unit and band of the numbers that follow.
    pub fn group(&mut self, unit: impl Into<String>, band: Band) -> &mut Self {
        self.unit(unit).band(band)
    }

    /// The unit of the numbers that follow, of which not a bit may change.
    pub fn exact(&mut self, unit: impl Into<String>) -> &mut Self {
        self.group(unit, Band::Exact)
    }

    /// The unit of the numbers that follow.
    pub fn unit(&mut self, unit: impl Into<String>) -> &mut Self {
        self.unit = unit.into();
        self
    }

    /// The band of the numbers that follow.
    pub fn band(&mut self, band: Band) -> &mut Self {
        self.band = band;
        self
    }

    /// Holds the last number against the published value of the same name: ours must round to the printed
    /// digits.
    ///
    /// What is wrong with a reconciliation (no such entry, or one of another rule) is reported when the
    /// record is closed.
    pub fn rounds_to_printed(&mut self) -> &mut Self {
        self.reconcile(Rule::Exact, Reconciliation::exact)
    }

    /// Holds the last number and the published value of the same name against a predicted distribution, each
    /// at `false_alarm_rate`.
    pub fn drawn_as_printed(&mut self, predicted: Predicted, false_alarm_rate: f64) -> &mut Self {
        self.reconcile(Rule::Sampled, |entry, ours| {
            Reconciliation::sampled(entry, ours, predicted, false_alarm_rate)
        })
    }

    /// Holds the last number against the published value of the same name: ours must come within `tolerance`,
    /// and `reason` says where that comes from.
    pub fn near_printed(&mut self, tolerance: f64, reason: impl Into<String>) -> &mut Self {
        let reason = reason.into();
        self.reconcile(Rule::Within, |entry, ours| Reconciliation::within(entry, ours, tolerance, reason))
    }

    fn reconcile(
        &mut self,
        rule: Rule,
        judge: impl FnOnce(&super::published::Entry, f64) -> Reconciliation,
    ) -> &mut Self {
        self.record.hold_against_printed(&self.last, rule, judge);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::published::PublishedError;
    use crate::record_error::RecordError;

    #[test]
    fn unit_and_band_hold_until_others_are_said() {
        let mut record = Record::with_claim();
        record.exact("px").number("a", 1.0, "").unit("").count("b", 2, "");
        record
            .group("mm", Band::relative(0.1, "test"))
            .number("c", 3.0, "")
            .band(Band::Exact)
            .number("d", 4.0, "");
        let found: Vec<_> =
            record.numbers().iter().map(|n| (n.unit.as_str(), n.value, n.band.width())).collect();
        let width = |text: &str| text.to_string();
        assert_eq!(
            found,
            [
                ("px", 1.0, width("exact")),
                ("", 2.0, width("exact")),
                ("mm", 3.0, width("relative 0.1")),
                ("mm", 4.0, width("exact"))
            ]
        );
    }

    #[test]
    fn names_and_descriptions_are_put_together() {
        let mut record = Record::with_claim();
        record.exact("px").suffix("-20", ", tilt 20 deg").number("sd-fx", 1.0, "sd of fx");
        record.exact("").prefix("half-").number("rmse", 1.0, "RMSE").prefix("").number("rise", 1.0, "");
        let found: Vec<_> =
            record.numbers().iter().map(|n| (n.id.as_str(), n.description.as_str())).collect();
        assert_eq!(found, [("sd-fx-20", "sd of fx, tilt 20 deg"), ("half-rmse", "RMSE"), ("rise", "")]);
    }

    #[test]
    fn only_a_published_number_is_reconciled_and_only_by_its_rule() {
        let mut record = Record::with_claim();
        record.exact("px").number("max-deviation", 4.677_75, "").rounds_to_printed();
        assert_eq!(record.validate(), Ok(()));
        assert!(record.reconciliations()[0].held());

        let mut record = Record::with_claim();
        record.exact("px").number("other", 1.0, "").rounds_to_printed();
        assert!(matches!(record.validate(), Err(RecordError::Published(PublishedError::Unknown(_)))));

        let mut record = Record::with_claim();
        record.exact("px").number("max-deviation", 4.677_75, "").near_printed(1.0, "nothing");
        assert!(matches!(record.validate(), Err(RecordError::Rule { expected: Some(Rule::Exact), .. })));

        let mut record = Record::with_claim();
        record.exact("px").rounds_to_printed();
        assert!(matches!(record.validate(), Err(RecordError::NoSuchNumber(_))));
        let mut record = Record::with_claim();
        record.reconcile("max-deviation").rounds_to_printed();
        assert_eq!(record.validate(), Err(RecordError::NoSuchNumber("max-deviation".into())));
    }
}
