//! Does every link lead somewhere? Pages and names within the book; the outside is not asked.

use super::labels::Labels;
use std::collections::BTreeSet;

/// Why a link of a page leads nowhere; `None` if it does not.
pub(super) fn dead(page: &str, target: &str, pages: &BTreeSet<String>, labels: &Labels) -> Option<String> {
    let target = target.split_whitespace().next().unwrap_or("");
    if target.starts_with("https://") {
        return None;
    }
    if target.contains("://") {
        return Some(format!("link to `{target}`: only https leads outside"));
    }
    let (path, name) = target.split_once('#').map_or((target, None), |(path, name)| (path, Some(name)));
    let path = if path.is_empty() { page } else { path };
    if !pages.contains(path) {
        return Some(format!("dead link: there is no page `{path}`"));
    }
    let name = name?;
    (!labels.on_page(path, name))
        .then(|| format!("dead link: page `{path}` has no place `{name}`; give its heading {{#{name}}}"))
}
