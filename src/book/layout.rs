//! What stands around the text of a page? The contents beside it, the neighbours below it; no script, and
//! nothing from outside.

use super::html::attributes;
use super::page::CompiledPage;
use super::text::escape;

/// Title of the book.
const TITLE: &str = "Camera calibration, checked against truth";

/// A page as a browser opens it: its text, the contents of the whole book, and links to the pages before and
/// after it.
pub(super) fn page(pages: &[&CompiledPage], at: usize, text: &str) -> String {
    let contents: String =
        pages.iter().enumerate().map(|(i, page)| line_of_contents(page, i == at)).collect();
    let neighbour = |page: Option<&&CompiledPage>, class: &str, [before, after]: [&str; 2]| {
        page.map_or(String::new(), |page| {
            let (file, title) = (page.file(), escape(&page.title));
            format!("<a rel=\"{class}\" href=\"{file}\">{before}{title}{after}</a>")
        })
    };
    let before = neighbour(at.checked_sub(1).and_then(|i| pages.get(i)), "prev", ["\u{2190} ", ""]);
    let after = neighbour(pages.get(at + 1), "next", ["", " \u{2192}"]);
    document(
        &format!("{} \u{2013} {TITLE}", pages[at].title),
        &format!(
            "<input type=\"checkbox\" id=\"contents-shown\">\n<header><label for=\"contents-shown\">Contents</label>\
             <a href=\"index.html\">{TITLE}</a><a href=\"print.html\">All on one page</a></header>\n\
             <nav class=\"contents\" aria-label=\"Contents\"><ol>\n{contents}</ol></nav>\n\
             <div class=\"content\"><main>\n{text}</main>\n\
             <nav class=\"neighbours\" aria-label=\"Neighbouring pages\">{before}<span></span>{after}</nav></div>\n"
        ),
    )
}

/// The whole book on one page, to be printed or searched.
pub(super) fn print(pages: &[&CompiledPage], texts: &[String]) -> String {
    let sections: String = pages
        .iter()
        .zip(texts)
        .map(|(page, text)| {
            let stem = page.stem();
            format!("<section id=\"{stem}\">\n{}</section>\n", within_one_page(text, stem))
        })
        .collect();
    document(TITLE, &format!("<div class=\"content\"><main>\n{sections}</main></div>\n"))
}

/// The text of a page with its names and links as they are when all pages are one: `#place` of page `stem` is
/// `#stem--place`.
fn within_one_page(text: &str, stem: &str) -> String {
    let named = attributes(text, "id", |name| format!("{stem}--{name}"));
    attributes(&named, "href", |target| {
        let (path, place) = target.split_once('#').map_or((target, ""), |(path, place)| (path, place));
        let Some(page) = (if path.is_empty() { Some(stem) } else { path.strip_suffix(".html") }) else {
            return target.to_string();
        };
        if path.contains("://") {
            return target.to_string();
        }
        if place.is_empty() { format!("#{page}") } else { format!("#{page}--{place}") }
    })
}

fn line_of_contents(page: &CompiledPage, here: bool) -> String {
    let number = page.number.map_or(String::new(), |n| format!("<b>{n}.</b> "));
    let (class, current) =
        (if page.below { " class=\"below\"" } else { "" }, if here { " aria-current=\"page\"" } else { "" });
    format!("<li{class}><a href=\"{}\"{current}>{number}{}</a></li>\n", page.file(), escape(&page.title))
}

fn document(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{}</title>\n<link rel=\"icon\" href=\"data:,\">\n<link rel=\"stylesheet\" href=\"style/book.css\">\n</head>\n<body>\n{body}</body>\n</html>\n",
        escape(title)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_one_page_names_of_different_pages_stay_apart() {
        let text = "<h2 id=\"a\">A</h2> <a href=\"#a\">1</a> <a href=\"b.html#c\">2</a> <a href=\"b.html\">3</a> \
                    <a href=\"data/x.csv\">4</a> <a href=\"https://example.org/y.html\">5</a>";
        let expected = "<h2 id=\"p--a\">A</h2> <a href=\"#p--a\">1</a> <a href=\"#b--c\">2</a> <a href=\"#b\">3</a> \
                        <a href=\"data/x.csv\">4</a> <a href=\"https://example.org/y.html\">5</a>";
        assert_eq!(within_one_page(text, "p"), expected);
    }
}
