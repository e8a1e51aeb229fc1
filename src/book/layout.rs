//! What stands around the text of a page? The contents and the search beside it, the neighbours below it;
//! nothing from outside, and no scripts but those of the search and of the laboratories.

use super::html::attributes;
use super::laboratory;
use super::page::CompiledPage;
use super::text::escape;

/// Title of the book.
const TITLE: &str = "Camera calibration, checked against truth";

/// The field that leads to the search page.
const SEARCH: &str = "<form action=\"search.html\" role=\"search\"><input type=\"search\" name=\"q\" placeholder=\"Search\" aria-label=\"Search the book\"></form>";

/// A page as a browser opens it: its text, the contents of the whole book, and links to the pages before and
/// after it.
pub(super) fn page(pages: &[&CompiledPage], at: usize, text: &str) -> String {
    // The pages of the records fill half of the contents: they are listed where the reader is among them.
    let among_records = pages[at].below || pages.get(at + 1).is_some_and(|next| next.below);
    let listed = pages.iter().enumerate().filter(|(_, page)| among_records || !page.below);
    let contents: String = listed.map(|(i, page)| line_of_contents(page, i == at)).collect();
    let neighbour = |page: Option<&&CompiledPage>, class: &str, [before, after]: [&str; 2]| {
        page.map_or(String::new(), |page| {
            let (file, title) = (page.file(), escape(&page.title));
            format!("<a rel=\"{class}\" href=\"{file}\">{before}{title}{after}</a>")
        })
    };
    let before = neighbour(at.checked_sub(1).and_then(|i| pages.get(i)), "prev", ["\u{2190} ", ""]);
    let after = neighbour(pages.get(at + 1), "next", ["", " \u{2192}"]);
    let neighbours = format!(
        "<nav class=\"neighbours\" aria-label=\"Neighbouring pages\">{before}<span></span>{after}</nav>"
    );
    let title = format!("{} \u{2013} {TITLE}", pages[at].title);
    document(&title, &laboratory::head(text), &around(&contents, text, &neighbours))
}

/// The bar at the top, the contents beside the text, and what stands below it.
fn around(contents: &str, text: &str, below: &str) -> String {
    format!(
        "<input type=\"checkbox\" id=\"contents-shown\">\n<header><label for=\"contents-shown\">Contents</label>\
         <a href=\"index.html\">{TITLE}</a>{SEARCH}<a href=\"print.html\">All on one page</a></header>\n\
         <nav class=\"contents\" aria-label=\"Contents\"><ol>\n{contents}</ol></nav>\n\
         <div class=\"content\"><main>\n{text}</main>\n{below}</div>\n"
    )
}

/// The page of the search: the contents of the whole book beside what is found.
pub(super) fn search(pages: &[&CompiledPage], text: &str) -> String {
    let listed = pages.iter().filter(|page| !page.below);
    let contents: String = listed.map(|page| line_of_contents(page, false)).collect();
    document(&format!("Search \u{2013} {TITLE}"), "", &around(&contents, text, ""))
}

/// A file of the code that the book quotes, a place to link to on every line.
pub(super) fn source(path: &str, text: &str) -> String {
    let lines: String = (1..)
        .zip(text.lines())
        .map(|(n, line)| format!("<span id=\"L{n}\"><a href=\"#L{n}\">{n:4}</a>  {}</span>\n", escape(line)))
        .collect();
    let path = escape(path);
    let page = format!(
        "<main class=\"source\"><h1><code>{path}</code></h1><pre><code>{lines}</code></pre></main>\n"
    );
    document(&path, "", &page).replace("href=\"style/", "href=\"../style/")
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
    let title = format!(
        "<div class=\"title-page\"><p class=\"book-title\">{TITLE}</p><p>Every number in this book is taken from a run of calibench.</p></div>\n"
    );
    let lines: String =
        pages.iter().filter(|page| !page.below).map(|page| line_of_contents(page, false)).collect();
    let contents = format!(
        "<section class=\"contents\"><h1>Contents</h1><ol>\n{}</ol></section>\n",
        within_one_page(&lines, "")
    );
    document(TITLE, "", &format!("<div class=\"content\"><main>\n{title}{contents}{sections}</main></div>\n"))
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
        // The code stands on pages of its own.
        if path.contains('/') {
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

/// A file of HTML; `head` is what its head has besides.
fn document(title: &str, head: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{}</title>\n<link rel=\"icon\" href=\"data:,\">\n<link rel=\"stylesheet\" href=\"style/book.css\">\n{head}</head>\n<body>\n{body}</body>\n</html>\n",
        escape(title)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_one_page_names_of_different_pages_stay_apart() {
        let text = "<h2 id=\"a\">A</h2> <a href=\"#a\">1</a> <a href=\"b.html#c\">2</a> <a href=\"b.html\">3</a> \
                    <a href=\"data/x.csv\">4</a> <a href=\"https://example.org/y.html\">5</a> <a href=\"code/z.html#L1\">6</a>";
        let expected = "<h2 id=\"p--a\">A</h2> <a href=\"#p--a\">1</a> <a href=\"#b--c\">2</a> <a href=\"#b\">3</a> \
                        <a href=\"data/x.csv\">4</a> <a href=\"https://example.org/y.html\">5</a> <a href=\"code/z.html#L1\">6</a>";
        assert_eq!(within_one_page(text, "p"), expected);
    }
}
