//! How does markdown become HTML? By CommonMark with tables and named headings; links to pages of the book
//! become links to HTML.

use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd};
use std::collections::BTreeSet;

/// The HTML of a page.
pub(super) fn html(markdown: &str) -> String {
    let options = Options::ENABLE_TABLES | Options::ENABLE_HEADING_ATTRIBUTES;
    let mut events: Vec<Event<'_>> = Parser::new_ext(markdown, options).collect();
    name_headings(&mut events);
    let mut html = String::with_capacity(markdown.len() * 2);
    pulldown_cmark::html::push_html(&mut html, events.into_iter().flat_map(set));
    // All tables have their headings at the top.
    html.replace("<th>", "<th scope=\"col\">")
}

/// Gives every heading without a name one of its words, so that it can be linked to.
fn name_headings(events: &mut [Event<'_>]) {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    for i in 0..events.len() {
        if !matches!(&events[i], Event::Start(Tag::Heading { id: None, .. })) {
            continue;
        }
        let words: String = events[i..]
            .iter()
            .take_while(|event| !matches!(event, Event::End(TagEnd::Heading(_))))
            .map(|event| match event {
                Event::Text(text) | Event::Code(text) => text.as_ref(),
                _ => "",
            })
            .collect();
        let name = free(slug(&words), &taken);
        taken.insert(name.clone());
        if let Event::Start(Tag::Heading { id, .. }) = &mut events[i] {
            *id = Some(CowStr::from(name));
        }
    }
}

/// Letters and digits in lower case, everything else one hyphen.
fn slug(words: &str) -> String {
    let lower = words.to_lowercase();
    lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect::<Vec<_>>().join("-")
}

/// The name, or the name with the first count that is not taken.
fn free(name: String, taken: &BTreeSet<String>) -> String {
    let counted = (1..).map(|n| if n == 1 { name.clone() } else { format!("{name}-{n}") });
    counted.into_iter().find(|name| !taken.contains(name)).unwrap_or_default()
}

/// One event as it is written: links lead to HTML, a table may be wider than the page.
fn set(event: Event<'_>) -> Vec<Event<'_>> {
    match event {
        Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
            vec![Event::Start(Tag::Link { link_type, dest_url: page_link(&dest_url).into(), title, id })]
        }
        Event::Html(text) => vec![Event::Html(with_page_links(&text).into())],
        Event::InlineHtml(text) => vec![Event::InlineHtml(with_page_links(&text).into())],
        Event::Start(Tag::Table(columns)) => {
            vec![Event::Html("<div class=\"table-wrapper\">".into()), Event::Start(Tag::Table(columns))]
        }
        Event::End(TagEnd::Table) => vec![Event::End(TagEnd::Table), Event::Html("</div>\n".into())],
        event => vec![event],
    }
}

/// `page.md#place` becomes `page.html#place`; links that leave the book stay.
fn page_link(target: &str) -> String {
    let (path, place) = target.find('#').map_or((target, ""), |at| target.split_at(at));
    match path.strip_suffix(".md") {
        Some(stem) if !path.contains("://") => format!("{stem}.html{place}"),
        _ => target.to_string(),
    }
}

/// The links of a piece of HTML, likewise.
fn with_page_links(html: &str) -> String {
    attributes(html, "href", page_link)
}

/// HTML with the values of an attribute changed.
pub(super) fn attributes(html: &str, name: &str, change: impl Fn(&str) -> String) -> String {
    let open = format!(" {name}=\"");
    let mut changed = String::with_capacity(html.len());
    let mut rest = html;
    while let Some(at) = rest.find(&open) {
        let (before, value) = rest.split_at(at + open.len());
        let Some(end) = value.find('"') else { break };
        changed.push_str(before);
        changed.push_str(&change(&value[..end]));
        rest = &value[end..];
    }
    changed + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_to_pages_of_html_and_the_outside_stays() {
        let page = html("[a](b.md#c), [d](https://example.org/e.md), <a href=\"f.md\">g</a>\n");
        for link in ["href=\"b.html#c\"", "href=\"https://example.org/e.md\"", "href=\"f.html\""] {
            assert!(page.contains(link), "{page}");
        }
    }

    #[test]
    fn headings_have_names_of_their_own_and_tables_may_scroll() {
        let page =
            html("# A title {#mine}\n\n## What, `x`?\n\n## What x\n\n| a | b |\n|---|---|\n| 1 | 2 |\n");
        for part in [
            "id=\"mine\"",
            "id=\"what-x\"",
            "id=\"what-x-2\"",
            "<div class=\"table-wrapper\"><table>",
            "<th scope=\"col\">",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
    }
}
