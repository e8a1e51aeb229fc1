//! What is a page made of? Headings, paragraphs, tables and figures, light or dark as the reader's system is.

use calibench::io::significant;
use calibench_harness::Figure;
use std::fmt::Write;

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1c1c1e;--paper:#fff;--rule:#d5d5da;--soft:#66666c;--warn:#8a4b00;--card:#fff8ec}
@media(prefers-color-scheme:dark){:root{--ink:#ececf0;--paper:#17171a;--rule:#3b3b42;--soft:#a0a0a8;--warn:#ffc66b;--card:#2a2418}
figure svg{filter:invert(.91) hue-rotate(180deg)}}
body{margin:2rem auto;max-width:74rem;padding:0 1.2rem;font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper)}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{padding:.25rem .9rem .25rem 0;border-bottom:1px solid var(--rule);text-align:right;white-space:nowrap}
.l1 :is(th,td):nth-child(1),.l2 :is(th,td):nth-child(2){text-align:left}th{color:var(--soft);font-weight:600}
.scroll{overflow-x:auto}.warn{background:var(--card);border-left:4px solid var(--warn);padding:.6rem 1rem;margin:.5rem 0}
.note{color:var(--soft);font-size:.9rem;margin:.4rem 0}p,li,figcaption{overflow-wrap:anywhere}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(30rem,100%),1fr));gap:1.5rem}
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(13rem,100%),1fr));gap:1rem}
figure{margin:0}figure svg{max-width:100%;height:auto}figcaption{color:var(--soft);font-size:.9rem}
img{max-width:100%;height:auto;display:block}.pictures img{width:100%;aspect-ratio:4/3;object-fit:contain;background:var(--rule)}
a{color:inherit}";

/// What stands in a cell that has no value; a sentence below the table says why.
pub(super) const DASH: &str = "\u{2013}";

/// The page up to its first heading.
pub(super) fn begin(title: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width,initial-scale=1\">\n<title>{0}</title>\n<style>\n{STYLE}\n</style>\n</head>\n<body>\n\
         <h1>{0}</h1>\n",
        escaped(title)
    )
}

/// The end of a page.
pub(super) fn end(page: &mut String) {
    // Writing to a string cannot fail, here and below.
    let _ = write!(page, "<p><small>calibench {}</small></p>\n</body>\n</html>\n", env!("CARGO_PKG_VERSION"));
}

pub(super) fn heading(page: &mut String, text: &str) {
    let _ = writeln!(page, "<h2>{}</h2>", escaped(text));
}

pub(super) fn paragraph(page: &mut String, text: &str) {
    let _ = writeln!(page, "<p>{}</p>", escaped(text));
}

/// A paragraph to be careful about.
pub(super) fn warning(page: &mut String, text: &str) {
    let _ = writeln!(page, "<p class=\"warn\">{}</p>", escaped(text));
}

/// What a table means by its marks.
pub(super) fn note(page: &mut String, text: &str) {
    let _ = writeln!(page, "<p class=\"note\">{}</p>", escaped(text));
}

/// A table; the cells are HTML already. The first `left` columns are words and stand at the left. An empty
/// cell has [`DASH`].
pub(super) fn table(page: &mut String, left: usize, header: &[&str], rows: &[Vec<String>]) {
    let words = if left > 1 { "l1 l2" } else { "l1" };
    let _ = write!(page, "<div class=\"scroll\"><table class=\"{words}\">\n<tr>");
    header.iter().for_each(|cell| {
        let _ = write!(page, "<th>{}</th>", escaped(cell));
    });
    page.push_str("</tr>\n");
    for row in rows {
        let filled = |cell: &String| if cell.is_empty() { DASH.to_string() } else { cell.clone() };
        let cells: String = row.iter().map(|cell| format!("<td>{}</td>", filled(cell))).collect();
        let _ = writeln!(page, "<tr>{cells}</tr>");
    }
    page.push_str("</table></div>\n");
}

/// A number as a cell: empty, and so [`DASH`], where it has no value.
pub(super) fn number(x: f64, digits: usize) -> String {
    if x.is_finite() { significant(x, digits).replace('-', "\u{2212}") } else { String::new() }
}

/// A number that was given: with its own digits if those are few.
pub(super) fn given(x: f64) -> String {
    const FEW: usize = 10;
    let own = x.to_string();
    if own.len() <= FEW { own.replace('-', "\u{2212}") } else { number(x, FEW - 1) }
}

/// Plots side by side, as many as the window takes.
pub(super) fn figures(page: &mut String, figures: &[Figure]) {
    page.push_str("<div class=\"figures\">\n");
    for figure in figures {
        let svg = String::from_utf8_lossy(&figure.bytes);
        let caption = escaped(&figure.caption);
        let _ = writeln!(page, "<figure>\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>");
    }
    page.push_str("</div>\n");
}

/// A picture beside the page, which opens whole; the caption is HTML already.
pub(super) fn picture(page: &mut String, file: &str, alternative: &str, caption: &str) {
    let (file, alternative) = (escaped(file), escaped(alternative));
    let _ = writeln!(
        page,
        "<figure><a href=\"{file}\"><img src=\"{file}\" alt=\"{alternative}\" loading=\"lazy\"></a>\n\
         <figcaption>{caption}</figcaption></figure>"
    );
}

/// Text of others as text of the page.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_do_not_become_elements_and_no_cell_is_empty() {
        let mut page = begin("a <b> & \"c\"");
        table(
            &mut page,
            1,
            &["x<y"],
            &[vec![String::new()], vec![number(f64::NAN, 3)], vec![number(-1.5, 3)]],
        );
        assert!(
            page.contains("<h1>a &lt;b&gt; &amp; &quot;c&quot;</h1>") && page.contains("<th>x&lt;y</th>")
        );
        assert_eq!(page.matches(&format!("<td>{DASH}</td>")).count(), 2);
        assert!(page.contains("<td>\u{2212}1.50</td>"), "{page}");
        assert_eq!((given(-62.5), given(400000.25)), ("\u{2212}62.5".to_string(), "400000.25".to_string()));
    }
}
