//! On which pages of the book does a name stand? Its placeholders, by file and line.

use calibench_book::Page;

/// Placeholders that show one thing, and those that show all of an experiment's claims.
const OF_ONE: [&str; 4] = ["num", "published", "figure", "table"];
const OF_ALL: [&str; 2] = ["claims", "run"];

/// Places of `experiment.own`, such as `book/text/four-pose.md:41`, each page once; if it stands nowhere
/// itself, where the experiment does.
pub(super) fn pages(pages: &[Page], experiment: &str, own: &str) -> Vec<String> {
    let name = format!("{experiment}.{own}");
    let own: Vec<String> = OF_ONE.iter().map(|word| format!("{{{{{word} {name}")).collect();
    let all: Vec<String> = OF_ALL.iter().map(|word| format!("{{{{{word} {experiment}")).collect();
    let found =
        |wanted: &[String]| -> Vec<String> { pages.iter().filter_map(|page| place(page, wanted)).collect() };
    let shown = found(&own);
    if shown.is_empty() { found(&all) } else { shown }
}

/// The first place on a page.
fn place(page: &Page, wanted: &[String]) -> Option<String> {
    let line = page.text.lines().position(|line| wanted.iter().any(|name| holds(line, name)))?;
    Some(format!("{}:{} ({})", page.file(), line + 1, page.title))
}

/// Whether a line has a placeholder whose name ends there: `four-pose.fx` is not in `four-pose.fx-sd`.
fn holds(line: &str, wanted: &str) -> bool {
    line.split(wanted).skip(1).any(|rest| rest.starts_with([' ', '}']))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(text: &str) -> Page {
        Page { path: "a.md".into(), title: "A".into(), number: None, text: text.into() }
    }

    #[test]
    fn a_name_is_found_whole_and_else_its_experiment() {
        let text = "{{run four-pose}}\n{{num four-pose.fx-sd .3}}\n{{num four-pose.fx .3}} {{num four-pose.fx s2}}\n";
        let at = |own: &str| pages(&[page(text), page("nothing")], "four-pose", own);
        assert_eq!(at("fx"), ["book/text/a.md:3 (A)"]);
        assert_eq!(at("cy"), ["book/text/a.md:1 (A)"]);
        assert!(pages(&[page(text)], "four", "fx").is_empty());
    }
}
