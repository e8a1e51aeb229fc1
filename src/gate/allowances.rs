//! What is known to fail, and why? A file of allowances: a property, the scenes where it may fail or by how
//! much, and a reason each.
//!
//! ```toml
//! [[allow]]
//! property = "exactness"
//! limit_px = 1e-4
//! reason = "cv2 takes points in single precision"
//! ```

use super::bad_input::{Fault, bad_cases};
use super::judge::{Check, Property, Verdict};
use super::quoted::quoted;
use super::suite::{Demand, Scenario, suite};
use super::variant::Variant;
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::{InputError, read_regular_text};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toml::Spanned;

/// A failure that is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Allowance {
    /// What may fail.
    pub property: Property,
    /// Where; empty for every scene.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scenes: Vec<String>,
    /// Up to which size, px; without it whatever the size. Only of properties that have one
    /// ([`Check::size_px`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit_px: Option<f64>,
    /// Why, on one line.
    pub reason: String,
}

/// What became of an allowance.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Allowed {
    /// The allowance as stated.
    #[serde(flatten)]
    pub allowance: Allowance,
    /// Scenes that needed it.
    pub needed_by: Vec<&'static str>,
    /// Of the scenes that it names those that were asked and did not need it.
    pub not_needed_by: Vec<String>,
    /// Whether anything that it speaks of was judged.
    pub is_judged: bool,
}

/// A file of allowances that says nothing, or nothing that can be meant.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AllowError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] InputError),
    /// What stands there is wrong.
    #[error("{path}, line {line}: {message}", path = path.display())]
    At {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// What is wrong and what to do.
        message: String,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// A file in which nothing stands allows nothing.
    #[serde(default)]
    allow: Vec<Spanned<Entry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    property: Spanned<String>,
    scenes: Option<Vec<Spanned<String>>>,
    limit_px: Option<Spanned<f64>>,
    reason: Spanned<String>,
}

/// A byte of the file and what is wrong there.
type Wrong = (usize, String);

/// Properties whose checks have a size, in words.
const SIZED: &str = "exactness, view-order, point-order, target-units, image-shift and swapped-axes";

impl Allowance {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read or is no list of allowances (an empty one is a list of none); a property or
    /// scene that there is not; a scene on which the property is never judged, or that is named twice; a
    /// reason that is empty; a limit where nothing has a size.
    pub fn read(path: &Path) -> Result<Vec<Allowance>, AllowError> {
        let text = read_regular_text(path, MOST_SPEC_BYTES)?;
        Allowance::of_toml(&text).map_err(|(line, message)| AllowError::At {
            path: path.to_path_buf(),
            line,
            message,
        })
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// The line, from 1, and what is wrong there.
    pub fn of_toml(text: &str) -> Result<Vec<Allowance>, (usize, String)> {
        let line = |(at, message): Wrong| {
            let lines_before = text.bytes().take(at).filter(|&b| b == b'\n').count();
            (1 + lines_before, message)
        };
        let syntax = |e: toml::de::Error| (e.span().map_or(0, |s| s.start), e.message().trim().to_string());
        let file: File = toml::from_str(text).map_err(|e| line(syntax(e)))?;
        let known = Known::scenes();
        let mut allowances: Vec<Allowance> = Vec::new();
        for entry in file.allow {
            let at = entry.span().start;
            let allowance = of_entry(entry.into_inner(), &known).map_err(line)?;
            if let Some(other) = allowances.iter().find(|other| other.overlaps(&allowance)) {
                let property = other.property.name();
                return Err(line((
                    at,
                    format!("{property} is allowed twice for the same scene: keep one of the two"),
                )));
            }
            allowances.push(allowance);
        }
        Ok(allowances)
    }

    fn overlaps(&self, other: &Allowance) -> bool {
        let is_everywhere = self.scenes.is_empty() || other.scenes.is_empty();
        self.property == other.property
            && (is_everywhere || self.scenes.iter().any(|scene| other.scenes.contains(scene)))
    }

    /// Whether it speaks of a check.
    fn speaks_of(&self, check: &Check) -> bool {
        self.property == check.property
            && (self.scenes.is_empty() || self.scenes.iter().any(|scene| scene == check.scenario))
    }

    /// Whether it covers a check that fails.
    pub(super) fn covers(&self, check: &Check) -> bool {
        // Written so that NaN is not covered.
        let is_small = self.limit_px.is_none_or(|limit| check.size_px.is_some_and(|size| size <= limit));
        self.speaks_of(check) && is_small
    }

    /// What became of it: of a check that fails it is needed where it covers it.
    pub(super) fn applied(&self, checks: &[Check]) -> Allowed {
        let spoken_of = || checks.iter().filter(|check| self.speaks_of(check));
        let judged = || spoken_of().filter(|check| check.verdict != Verdict::NotJudged);
        let is_named = |check: &&Check| self.scenes.iter().any(|scene| scene == check.scenario);
        // What was asked and is told only fails nobody: a violation that residuals do not show, a time
        // without a limit.
        let cannot_fail = |check: &Check| check.verdict == Verdict::NotJudged && check.problems > 0;
        let holds = |check: &&Check| check.verdict == Verdict::Held || cannot_fail(check);
        Allowed {
            allowance: self.clone(),
            needed_by: judged().filter(|c| c.verdict == Verdict::Accepted).map(|c| c.scenario).collect(),
            not_needed_by: spoken_of()
                .filter(is_named)
                .filter(holds)
                .map(|c| c.scenario.to_string())
                .collect(),
            is_judged: judged().next().is_some()
                || spoken_of().any(|check| is_named(&check) && cannot_fail(check)),
        }
    }
}

impl Allowed {
    /// Whether something was judged and nothing needed it.
    pub fn is_idle(&self) -> bool {
        self.is_judged && self.needed_by.is_empty()
    }

    /// A line: what is allowed, who needs it, and why.
    pub fn told(&self) -> String {
        let Allowance { property, limit_px, reason, .. } = &self.allowance;
        let limit = limit_px.map_or(String::new(), |limit| format!(" up to {limit} px"));
        let idle = match &self.not_needed_by[..] {
            [] => String::new(),
            scenes => format!("; not needed by {}", scenes.join(", ")),
        };
        let needed = match &self.needed_by[..] {
            _ if !self.is_judged => "nothing judged".to_string(),
            [] => "NOTHING NEEDS IT".to_string(),
            scenes => format!("needed by {}", scenes.join(", ")),
        };
        format!("{}{limit}: {reason} ({needed}{idle})", property.name())
    }
}

/// A scene or bad input, and what is asked on it.
struct Known {
    name: &'static str,
    properties: Vec<Property>,
}

impl Known {
    /// All scenes and bad input.
    fn scenes() -> Vec<Known> {
        let scenes = suite().into_iter().flatten();
        let scenes = scenes.map(|scenario| Known { name: scenario.id, properties: properties_of(&scenario) });
        let bad = bad_cases(1).into_iter().flatten().map(|case| {
            let property = match case.fault {
                Fault::Degenerate => Property::Degenerate,
                Fault::Malformed => Property::BadInput,
            };
            Known { name: case.id, properties: vec![property] }
        });
        scenes.chain(bad).collect()
    }
}

/// The properties that a scene can fail.
fn properties_of(scenario: &Scenario) -> Vec<Property> {
    let is_of_law = |property: &Property| match property {
        Property::BadInput | Property::Degenerate | Property::Honesty | Property::Assumptions => false,
        Property::SwappedAxes => Variant::SwappedAxes.is_known_of(scenario.model()),
        _ => true,
    };
    match scenario.demand {
        Demand::Honesty => vec![Property::Protocol, Property::HeldValues, Property::Honesty],
        Demand::Assumptions => vec![Property::Protocol, Property::HeldValues, Property::Assumptions],
        Demand::Law => Property::ALL.iter().copied().filter(is_of_law).collect(),
    }
}

fn of_entry(entry: Entry, known: &[Known]) -> Result<Allowance, Wrong> {
    let property = property(&entry.property)?;
    let has_size = Check::HAVE_SIZE.contains(&property);
    if let Some(limit) = &entry.limit_px {
        let at = limit.span().start;
        let size = *limit.get_ref();
        if !(size > 0.0 && size.is_finite()) {
            return Err((at, format!("limit_px = {size}: a positive number of px is needed")));
        }
        if !has_size {
            let name = property.name();
            return Err((at, format!("{name} has no size in px: leave limit_px out; {SIZED} have one")));
        }
    }
    let scenes = entry
        .scenes
        .map(|scenes| scenes_of(&scenes, known, property, entry.property.span().start))
        .transpose()?;
    // A report has a line for it.
    let reason = quoted(&entry.reason.get_ref().split_whitespace().collect::<Vec<_>>().join(" "));
    if reason.is_empty() {
        return Err((entry.reason.span().start, "the reason is empty: say why this is known".to_string()));
    }
    Ok(Allowance {
        property,
        scenes: scenes.unwrap_or_default(),
        limit_px: entry.limit_px.map(Spanned::into_inner),
        reason,
    })
}

fn property(name: &Spanned<String>) -> Result<Property, Wrong> {
    let found = Property::ALL.iter().copied().find(|property| property.name() == name.get_ref());
    found.ok_or_else(|| {
        let known: Vec<&str> = Property::ALL.iter().map(|property| property.name()).collect();
        (name.span().start, format!("no property `{}`; there are: {}", name.get_ref(), known.join(", ")))
    })
}

fn scenes_of(
    scenes: &[Spanned<String>],
    known: &[Known],
    property: Property,
    at: usize,
) -> Result<Vec<String>, Wrong> {
    if scenes.is_empty() {
        return Err((at, "no scenes: name some, or leave `scenes` out for every scene".to_string()));
    }
    let names = |list: Vec<&Known>| list.iter().map(|scene| scene.name).collect::<Vec<_>>().join(", ");
    let mut read: Vec<String> = Vec::new();
    for scene in scenes {
        let (at, name) = (scene.span().start, scene.get_ref());
        let Some(found) = known.iter().find(|known| known.name == name) else {
            let message = format!("no scene `{name}`; there are: {}", names(known.iter().collect()));
            return Err((at, message));
        };
        if !found.properties.contains(&property) {
            let judged = known.iter().filter(|known| known.properties.contains(&property)).collect();
            let property = property.name();
            return Err((at, format!("{property} is never judged on `{name}`, but on: {}", names(judged))));
        }
        if read.contains(name) {
            return Err((at, format!("the scene `{name}` is named twice: keep one of the two")));
        }
        read.push(name.clone());
    }
    Ok(read)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::{Basis, Terms, decide};

    const GOOD: &str = "# known\n[[allow]]\nproperty = 'exactness'\nlimit_px = 1e-4\nreason = 'single precision'\n\n\
                        [[allow]]\nproperty = 'degenerate'\nscenes = ['one-view', 'same-tilt']\nreason = 'no check'\n";

    fn check(property: Property, scenario: &'static str, held: bool, size_px: Option<f64>) -> Check {
        Check { size_px, ..Check::new(property, scenario, Basis::Certain(held), 1, "") }
    }

    #[test]
    fn what_is_wrong_with_a_file_is_told_with_its_line() {
        assert_eq!(Allowance::of_toml(GOOD).unwrap().len(), 2);
        for (from, to, line, word) in [
            ("'exactness'", "'beauty'", 3, "no property `beauty`; there are: protocol"),
            ("'one-view'", "'two-view'", 9, "no scene `two-view`; there are: four-pose"),
            ("'one-view'", "'four-pose'", 9, "never judged on `four-pose`, but on: three-parallel-views"),
            ("'one-view'", "'no-views'", 9, "never judged on `no-views`"),
            ("'one-view'", "'same-tilt'", 9, "`same-tilt` is named twice"),
            (
                "limit_px = 1e-4",
                "scenes = ['board-bowed']",
                4,
                "exactness is never judged on `board-bowed`, but on: four-pose",
            ),
            (
                "'exactness'\nlimit_px = 1e-4",
                "'swapped-axes'\nscenes = ['tilted']",
                4,
                "swapped-axes is never judged on `tilted`",
            ),
            ("1e-4", "-1.0", 4, "a positive number"),
            ("1e-4", "nan", 4, "a positive number"),
            ("1e-4", "'small'", 4, "invalid type"),
            ("'no check'", "' '", 10, "the reason is empty"),
            ("reason = 'no check'\n", "", 7, "missing field `reason`"),
            ("limit_px", "limit", 4, "unknown field `limit`"),
            ("[[allow]]\nproperty = 'd", "[[allows]]\nproperty = 'd", 7, "unknown field `allows`"),
            ("['one-view', 'same-tilt']", "[]", 8, "no scenes"),
            ("'degenerate'\nscenes = ['one-view', 'same-tilt']", "'exactness'", 7, "allowed twice"),
            ("scenes = ['one-view', 'same-tilt']", "limit_px = 1.0", 9, "degenerate has no size in px"),
            ("[[allow]]\nproperty = 'e", "[[allow\nproperty = 'e", 2, ""),
        ] {
            let spoilt = GOOD.replacen(from, to, 1);
            assert_ne!(spoilt, GOOD, "{from}");
            let (found, message) = Allowance::of_toml(&spoilt).unwrap_err();
            assert!(message.contains(word) && found == line, "{from} -> {to}: line {found}: {message}");
        }
    }

    #[test]
    fn an_allowance_covers_its_scenes_and_sizes_and_tells_what_did_not_need_it() {
        let allowances = Allowance::of_toml(GOOD).unwrap();
        let terms = Terms { allowances: allowances.clone(), ..Terms::default() };
        let decided = decide(
            vec![
                check(Property::Exactness, "four-pose", false, Some(5e-5)),
                check(Property::Exactness, "metres", false, Some(2e-4)),
                check(Property::Exactness, "held", false, None),
                check(Property::Degenerate, "one-view", false, None).gravely(),
                check(Property::Degenerate, "same-tilt", true, None),
                check(Property::Degenerate, "three-points", false, None).gravely(),
            ],
            &terms,
        );
        let verdicts: Vec<Verdict> = decided.iter().map(|c| c.verdict).collect();
        use Verdict::{Accepted, Failed, Grave, Held};
        assert_eq!(verdicts, [Accepted, Failed, Failed, Accepted, Held, Grave]);
        let applied: Vec<Allowed> = allowances.iter().map(|a| a.applied(&decided)).collect();
        assert_eq!(applied[0].needed_by, ["four-pose"]);
        assert_eq!(
            (&applied[1].needed_by[..], &applied[1].not_needed_by[..]),
            (&["one-view"][..], &["same-tilt".to_string()][..])
        );
        assert!(!applied.iter().any(Allowed::is_idle));
        let idle = allowances[0].applied(&decided[3..]);
        assert!(!idle.is_judged && !idle.is_idle());
        let all_hold = [Check { verdict: Held, ..check(Property::Exactness, "four-pose", true, Some(1e-9)) }];
        assert!(allowances[0].applied(&all_hold).told().contains("NOTHING NEEDS IT"));
    }

    #[test]
    fn an_allowance_for_what_cannot_fail_is_not_needed() {
        let text = "[[allow]]\nproperty = 'assumptions'\nscenes = ['board-stretched', 'board-bowed']\nreason = 'x'\n";
        let allowance = Allowance::of_toml(text).unwrap().remove(0);
        let told =
            |scenario| Check::new(Property::Assumptions, scenario, crate::judge::Basis::Told, 16, "told");
        let applied = allowance.applied(&[told("board-stretched")]);
        assert!(applied.is_idle(), "{applied:?}");
        assert!(
            applied.told().contains("NOTHING NEEDS IT; not needed by board-stretched"),
            "{}",
            applied.told()
        );
        // What was not asked needs nothing, and does not say so.
        assert!(!allowance.applied(&[]).is_judged);
    }

    #[test]
    fn a_reason_takes_one_line_and_a_file_with_nothing_in_it_allows_nothing() {
        let text = "[[allow]]\nproperty = 'bias'\nreason = \"\"\"two\n\n  lines \\u001b[2J\"\"\"\n";
        assert_eq!(Allowance::of_toml(text).unwrap()[0].reason, "two lines \\u001b[2J");
        for nothing in ["", "# nothing is known\n", "allow = []\n"] {
            assert_eq!(Allowance::of_toml(nothing), Ok(Vec::new()), "{nothing:?}");
        }
    }

    #[test]
    fn only_a_scene_that_is_named_is_told_not_to_need_its_allowance() {
        let text = "[[allow]]\nproperty = 'exactness'\nscenes = ['metres']\nreason = 'x'\n";
        let named = Allowance::of_toml(text).unwrap().remove(0);
        let every = Allowance { scenes: Vec::new(), ..named.clone() };
        let held = |scene| Check { verdict: Verdict::Held, ..check(Property::Exactness, scene, true, None) };
        let checks = [held("metres"), held("four-pose")];
        assert_eq!(named.applied(&checks).not_needed_by, ["metres"]);
        assert!(every.applied(&checks).not_needed_by.is_empty());
    }
}
