//! Where does a word stand? Every section of every page with its plain text, for the script of the search
//! page.

use super::page::CompiledPage;
use serde_json::json;

/// A piece of a page from one heading to the next.
#[derive(Debug, PartialEq, Eq)]
struct Section {
    /// Name of the heading on its page; empty before the first.
    place: String,
    title: String,
    text: String,
}

/// The index as a script: a browser that opens a file from a disk may load a script, but no data.
pub(super) fn index(pages: &[&CompiledPage], texts: &[String]) -> String {
    let mut entries = Vec::new();
    for (page, text) in pages.iter().zip(texts) {
        for Section { place, title, text } in sections(text) {
            entries.push(json!([page.file(), place, page.title, title, text]));
        }
    }
    format!("const SECTIONS = {};\n", serde_json::Value::Array(entries))
}

/// The text of the search page; the script fills it.
pub(super) const PAGE: &str = "<h1>Search</h1>\n<p id=\"found\" role=\"status\"><noscript>The search is a script, \
     and scripts are switched off. <a href=\"print.html\">All on one page</a> can be searched by the browser itself.</noscript></p>\n\
     <ol id=\"results\"></ol>\n<script src=\"search-index.js\"></script>\n<script src=\"style/search.js\"></script>\n";

fn sections(html: &str) -> Vec<Section> {
    let mut found = Vec::new();
    for part in html.split("<h").filter(|part| !part.trim().is_empty()) {
        let heading = part.starts_with(|c: char| c.is_ascii_digit());
        let (head, body) = match part.split_once("</h").filter(|_| heading) {
            Some((head, rest)) => (head, rest.split_once('>').map_or("", |(_, body)| body)),
            None => ("", part),
        };
        let place = head.split_once(" id=\"").and_then(|(_, rest)| rest.split_once('"')).map_or("", |p| p.0);
        let title = head.split_once('>').map_or("", |(_, title)| title);
        found.push(Section { place: place.to_string(), title: plain(title), text: plain(body) });
    }
    found
}

/// HTML without its tags; TeX beside a formula is left out.
fn plain(html: &str) -> String {
    let mut text = String::new();
    let mut rest = html;
    while let Some((before, after)) = rest.split_once('<') {
        text.push_str(before);
        // A tag ends a word, unless it is a mark within one.
        if !after.starts_with(['a', '/', 'b', 'm', 's'])
            || after.starts_with("/td")
            || after.starts_with("/p")
        {
            text.push(' ');
        }
        let end = if after.starts_with("annotation") { "</annotation>" } else { ">" };
        rest = after.split_once(end).map_or("", |(_, rest)| rest);
    }
    text.push_str(rest);
    let decoded = decoded(&text);
    decoded.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Character references as characters.
fn decoded(text: &str) -> String {
    let mut decoded = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('&') {
        decoded.push_str(before);
        let Some((name, behind)) = after.split_once(';') else {
            decoded.push('&');
            rest = after;
            continue;
        };
        let known = match name {
            "amp" => Some('&'),
            "lt" => Some('<'),
            "gt" => Some('>'),
            "quot" => Some('"'),
            _ => name.strip_prefix('#').and_then(|n| n.parse().ok()).and_then(char::from_u32),
        };
        match known {
            Some(character) => {
                decoded.push(character);
                rest = behind;
            }
            None => {
                decoded.push('&');
                rest = after;
            }
        }
    }
    decoded + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_falls_into_its_sections_as_plain_text() {
        let html = "<h1 id=\"t\">A <em>title</em></h1>\n<p>One &amp; <a href=\"x\">two</a>.</p><table><tr><td>1</td><td>2</td></tr></table>\n\
                    <h2 id=\"b\">Next</h2><p>k&#95;1 <math><mi>x</mi><annotation e=\"\">x^2</annotation></math></p>";
        let section = |place: &str, title: &str, text: &str| Section {
            place: place.into(),
            title: title.into(),
            text: text.into(),
        };
        assert_eq!(
            sections(html),
            [section("t", "A title", "One & two. 1 2"), section("b", "Next", "k_1 x")]
        );
        assert_eq!(decoded("a & b &nonsense; c & d"), "a & b &nonsense; c & d");
    }
}
