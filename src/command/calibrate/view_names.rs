//! How is a view called on the page? By one number, and by as much of its path as tells it from the others.

use calibench::calibrate::{Outliers, Warning};
use std::collections::{BTreeMap, BTreeSet};

/// Views as they were given, those that were left out among them.
#[derive(Debug, Clone, Default)]
pub(super) struct ViewNames {
    given: Vec<String>,
    labels: Vec<String>,
    numbers: Vec<usize>,
    fitted: Vec<usize>,
}

impl ViewNames {
    /// All names in the order in which they were given, and the places of the fitted views among them.
    pub(super) fn new(given: Vec<String>, fitted: Vec<usize>) -> ViewNames {
        ViewNames { labels: labels(&given), numbers: numbers(&given), given, fitted }
    }

    /// How many views were given.
    pub(super) fn given(&self) -> usize {
        self.given.len()
    }

    /// The place of a fitted view among those given.
    pub(super) fn place(&self, view: usize) -> usize {
        self.fitted.get(view).copied().unwrap_or(view)
    }

    /// The number at a place.
    pub(super) fn number_at(&self, place: usize) -> usize {
        self.numbers.get(place).copied().unwrap_or(place + 1)
    }

    /// The number of a fitted view.
    pub(super) fn number(&self, view: usize) -> usize {
        self.number_at(self.place(view))
    }

    /// The short name at a place.
    pub(super) fn label_at(&self, place: usize) -> &str {
        self.labels.get(place).map_or("", String::as_str)
    }

    /// Whether the numbers say all that the names do.
    pub(super) fn are_numbers(&self) -> bool {
        self.given.iter().zip(&self.numbers).all(|(name, number)| *name == number.to_string())
    }

    /// A sentence with short names in the place of whole paths.
    pub(super) fn shortened(&self, sentence: &str) -> String {
        let mut pairs: Vec<(&String, &String)> =
            self.given.iter().zip(&self.labels).filter(|(name, label)| name != label).collect();
        // A path may be the end of another: the longest goes first.
        pairs.sort_by_key(|(name, _)| std::cmp::Reverse(name.len()));
        pairs.into_iter().fold(sentence.to_string(), |text, (name, label)| text.replace(name, label))
    }

    /// Warnings that name views by these numbers and not by their place among the fitted ones.
    pub(super) fn numbered(&self, warnings: &[Warning]) -> Vec<Warning> {
        let mut warnings = warnings.to_vec();
        for warning in &mut warnings {
            match warning {
                Warning::Duplicates { view, copy_of, .. } => {
                    *view = self.number(*view);
                    *copy_of = self.number(*copy_of);
                }
                Warning::RepeatedMarks { view, .. }
                | Warning::TwinPose { view, .. }
                | Warning::FromBehind { view, .. }
                | Warning::Outliers(Outliers { view, .. }) => *view = self.number(*view),
                _ => {}
            }
        }
        warnings
    }
}

/// Names that are numbers keep them, as in files that count their views from 0; other views are counted
/// from 1. Large numbers are no count, but dates and the like.
fn numbers(names: &[String]) -> Vec<usize> {
    let own: Option<Vec<usize>> =
        names.iter().map(|name| name.parse().ok().filter(|n: &usize| n.to_string() == *name)).collect();
    let is_count = |own: &Vec<usize>| {
        let distinct: BTreeSet<usize> = own.iter().copied().collect();
        distinct.len() == own.len() && distinct.last().is_none_or(|&last| last <= 10 * own.len() + 100)
    };
    own.filter(is_count).unwrap_or_else(|| (1..=names.len()).collect())
}

/// The ends of paths, each as long as it takes to be no other's. A path that was given twice has one name.
fn labels(names: &[String]) -> Vec<String> {
    let parts: Vec<Vec<&str>> = names.iter().map(|name| name.split(['/', '\\']).collect()).collect();
    let end = |view: usize, length: usize| parts[view][parts[view].len().saturating_sub(length)..].join("/");
    let mut labels = names.to_vec();
    let mut open: Vec<usize> = (0..names.len()).collect();
    let longest = parts.iter().map(Vec::len).max().unwrap_or(0);
    for length in 1..longest {
        let mut owners: BTreeMap<String, BTreeSet<&str>> = BTreeMap::new();
        for (view, name) in names.iter().enumerate() {
            owners.entry(end(view, length)).or_default().insert(name);
        }
        open.retain(|&view| {
            let end = end(view, length);
            let is_open = end.is_empty() || owners[&end].len() > 1;
            if !is_open {
                labels[view] = end;
            }
            is_open
        });
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str]) -> Vec<String> {
        labels(&names.iter().map(|name| name.to_string()).collect::<Vec<_>>())
    }

    #[test]
    fn a_path_is_cut_to_what_tells_it_from_the_others() {
        assert_eq!(of(&["/data/a/1.png", "/data/a/2.png"]), ["1.png", "2.png"]);
        assert_eq!(of(&["/d/a/1.png", "/d/b/1.png", "/d/b/2.png"]), ["a/1.png", "b/1.png", "2.png"]);
        assert_eq!(of(&["1.png", "b/1.png"]), ["1.png", "b/1.png"]);
        assert_eq!(of(&["a/1.png", "a/1.png"]), ["1.png", "1.png"]);
        assert_eq!(of(&["view", "a/"]), ["view", "a/"]);
        assert!(of(&[]).is_empty());
    }

    #[test]
    fn names_that_count_views_are_their_numbers() {
        let numbers =
            |names: &[&str]| numbers(&names.iter().map(|name| name.to_string()).collect::<Vec<_>>());
        assert_eq!(numbers(&["0", "1", "4"]), [0, 1, 4]);
        for no_count in [["0", "0"], ["20260101", "20260102"], ["1", "01"], ["1", "a"], ["-1", "1"]] {
            assert_eq!(numbers(&no_count), [1, 2], "{no_count:?}");
        }
    }

    #[test]
    fn sentences_and_warnings_call_views_by_their_label_and_number() {
        let given = ["/d/1.png", "/d/2.png", "/e/d/1.png"].map(String::from).to_vec();
        let names = ViewNames::new(given, vec![0, 2]);
        assert_eq!((names.label_at(1), names.number(1), names.are_numbers()), ("2.png", 3, false));
        assert_eq!(names.shortened("see /e/d/1.png and /d/2.png"), "see e/d/1.png and 2.png");
        let warning = Warning::FromBehind { view: 1, views: 1 };
        assert_eq!(names.numbered(&[warning]), [Warning::FromBehind { view: 3, views: 1 }]);
    }
}
