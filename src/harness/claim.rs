//! Is the number correct? A statement about one value, with the interval that theory or an oracle gives and
//! its reason.

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
    /// `56 of 56 cells`: the cases that hold; `None` for a claim about one value.
    pub fn counted(&self) -> Option<String> {
        let Cases { count, noun } = self.cases.as_ref()?;
        Some(format!("{} of {count} {noun}", count.saturating_sub(self.failures.len())))
    }
}
