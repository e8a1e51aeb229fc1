//! What names are there, and which one is meant?

use super::known::Known;
use calibench::io::shown::on_one_line;
use calibench_harness::{Experiment, golden};
use std::collections::BTreeSet;

/// Everything that can be explained.
pub(super) struct Names<'a> {
    experiments: &'a [Experiment],
    /// `four-pose.fx`: what is locked of a record, and the published values.
    entries: BTreeSet<String>,
    sections: BTreeSet<String>,
    contradictions: BTreeSet<String>,
}

/// What a name stands for.
pub(super) enum Meant<'a> {
    Experiment(&'a Experiment),
    /// A number, claim, table, figure or published value, by its name within the experiment.
    Entry(&'a Experiment, &'a str),
    Section,
    Contradiction,
}

/// How many names are offered where none is meant.
const OFFERED: usize = 6;

impl<'a> Names<'a> {
    pub fn of(known: &'a Known<'a>) -> Names<'a> {
        let mut entries = BTreeSet::new();
        for experiment in known.experiments {
            let snapshot = known.project.snapshot_text(experiment.id).unwrap_or_default();
            entries.extend(locked(&snapshot).map(|name| format!("{}.{name}", experiment.id)));
        }
        entries.extend(known.sources.published.iter().map(|entry| entry.id.clone()));
        let printed = known.sources.published.iter().map(|entry| &entry.section);
        let items = known.sources.items.iter().map(|item| &item.section);
        let sections = printed.chain(items).flat_map(|text| sections_of(text)).map(str::to_string).collect();
        let contradictions = known.sources.contradictions.iter().map(|c| c.id.clone()).collect();
        Names { experiments: known.experiments, entries, sections, contradictions }
    }

    /// What a name stands for, if there is such a thing.
    pub fn meant<'n>(&self, name: &'n str) -> Option<Meant<'n>>
    where
        'a: 'n,
    {
        if let Some(experiment) = self.experiments.iter().find(|e| e.id == name) {
            return Some(Meant::Experiment(experiment));
        }
        if self.sections.contains(name) {
            return Some(Meant::Section);
        }
        if self.contradictions.contains(name) {
            return Some(Meant::Contradiction);
        }
        let (experiment, own) = name.split_once('.').filter(|_| self.entries.contains(name))?;
        let experiment = self.experiments.iter().find(|e| e.id == experiment)?;
        Some(Meant::Entry(experiment, own))
    }

    /// The names within an experiment.
    pub fn within(&self, experiment: &str) -> Vec<&str> {
        let own = |name: &'_ String| -> bool { name.split_once('.').is_some_and(|(of, _)| of == experiment) };
        self.entries.iter().filter(|name| own(name)).map(String::as_str).collect()
    }

    /// That there is no such name, with those that are nearest to it.
    pub fn not_found(&self, name: &str) -> String {
        let (offered, name) = (self.nearest(name).join("\n  "), on_one_line(name));
        format!(
            "nothing is called `{name}`; the nearest names:\n  {offered}\n`calibench explain four-pose` lists the names of an experiment"
        )
    }

    /// The nearest names, nearest first: whoever leaves out the experiment means any one. Names have no
    /// capitals.
    fn nearest(&self, name: &str) -> Vec<&str> {
        let name = name.to_lowercase();
        let entries = self.entries.iter().map(|known| {
            let own = known.split_once('.').map_or(known.as_str(), |(_, own)| own);
            (strsim::jaro_winkler(&name, known).max(strsim::jaro_winkler(&name, own)), known.as_str())
        });
        let others = self.sections.iter().chain(&self.contradictions).map(String::as_str);
        let others = others.chain(self.experiments.iter().map(|e| e.id));
        let others = others.map(|known| (strsim::jaro_winkler(&name, known), known));
        let mut near: Vec<(f64, &str)> = entries.chain(others).collect();
        near.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(b.1)));
        near.into_iter().take(OFFERED).map(|(_, known)| known).collect()
    }
}

/// The names that a snapshot locks; a figure's without the ending of its file.
fn locked(snapshot: &str) -> impl Iterator<Item = &str> {
    golden::contents(snapshot).lines().filter_map(|line| {
        let mut fields = line.split(" | ");
        match fields.next()? {
            "number" | "claim" | "table" => fields.next(),
            "figure" => Some(fields.next()?.rsplit_once('.')?.0),
            _ => None,
        }
    })
}

/// The sections of `5.1, 5.4`.
pub(super) fn sections_of(text: &str) -> impl Iterator<Item = &str> {
    text.split(',').map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Names<'static> {
        let set = |names: &[&str]| names.iter().map(|name| name.to_string()).collect();
        Names {
            experiments: &[],
            entries: set(&["four-pose.fx", "four-pose.fx-unbiased", "line-bending.max-deviation"]),
            sections: set(&["5.1"]),
            contradictions: set(&["two-views-suffice"]),
        }
    }

    #[test]
    fn a_slip_is_answered_with_what_was_meant_first() {
        assert_eq!(names().nearest("four-pose.xf")[0], "four-pose.fx");
        assert_eq!(names().nearest("max-devation")[0], "line-bending.max-deviation");
        assert_eq!(names().nearest("two-views-sufice")[0], "two-views-suffice");
        assert_eq!(names().nearest("FX")[0], "four-pose.fx");
        assert!(names().not_found("fx").contains("\n  four-pose.fx\n"));
    }

    #[test]
    fn names_are_read_from_what_is_locked() {
        let snapshot =
            "---\nsource: x\n---\nseed | 1\nnumber | a | 1.0\nclaim | b | 0\nfigure | c.d.svg | sha\n";
        assert_eq!(locked(snapshot).collect::<Vec<_>>(), ["a", "b", "c.d"]);
    }

    #[test]
    fn an_experiment_has_the_names_before_whose_dot_it_stands() {
        assert_eq!(names().within("four-pose"), ["four-pose.fx", "four-pose.fx-unbiased"]);
        assert!(names().within("four").is_empty());
    }
}
