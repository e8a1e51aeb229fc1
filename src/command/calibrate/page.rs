//! The report as a page: one HTML file that needs nothing else, light or dark as the reader's system is.

use super::finished::{Finished, parameter_rows, summary, weakest};
use calibench::calibrate::in_words;
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
th,td{padding:.25rem .9rem .25rem 0;border-bottom:1px solid var(--rule);text-align:right}
th:first-child,td:first-child{text-align:left}th{color:var(--soft);font-weight:600}
.scroll{overflow-x:auto}.warn{background:var(--card);border-left:4px solid var(--warn);padding:.6rem 1rem;margin:.5rem 0}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(30rem,100%),1fr));gap:1.5rem}
figure{margin:0}figure svg{max-width:100%;height:auto}figcaption{color:var(--soft);font-size:.9rem}
a{color:inherit}";

/// The page.
pub(super) fn html(finished: &Finished, figures: &[Figure]) -> String {
    let title = format!("Calibration from {}", finished.source);
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width,initial-scale=1\">\n<title>{0}</title>\n<style>\n{STYLE}\n</style>\n</head>\n<body>\n\
         <h1>{0}</h1>\n",
        escaped(&title)
    );
    for line in summary(finished).lines() {
        paragraph(&mut page, "", line);
    }
    warnings(&mut page, finished);
    page.push_str("<h2>Parameters</h2>\n");
    let rows: Vec<Vec<String>> = parameter_rows(finished)
        .into_iter()
        .map(|row| row.iter().map(|cell| escaped(cell)).collect())
        .collect();
    table(&mut page, &["parameter", "value", "standard deviation", "unit"], &rows);
    if let Some(weakest) = weakest(finished) {
        let line = format!("Weakest direction, the combination that the data say least about: {weakest}.");
        paragraph(&mut page, "", &line);
    }
    page.push_str("<h2>Views</h2>\n");
    table(
        &mut page,
        &["view", "points", "RMSE (px)", "largest (px)", "distance", "tilt (deg)"],
        &views(finished),
    );
    left_out(&mut page, finished);
    page.push_str("<h2>Figures</h2>\n<div class=\"figures\">\n");
    figures.iter().for_each(|figure| inlined(&mut page, figure));
    let version = env!("CARGO_PKG_VERSION");
    // Writing to a string cannot fail, here and below.
    let _ = write!(page, "</div>\n<p><small>calibench {version}</small></p>\n</body>\n</html>\n");
    page
}

fn warnings(page: &mut String, finished: &Finished) {
    let own = in_words(&finished.fit.calibration.warnings).into_iter();
    for warning in own.chain(finished.notes.iter().chain(&finished.advice).cloned()) {
        paragraph(page, " class=\"warn\"", &warning);
    }
}

fn views(finished: &Finished) -> Vec<Vec<String>> {
    let calibration = &finished.fit.calibration;
    let row = |(i, name): (usize, &String)| {
        let residuals = &calibration.residuals[i];
        let largest = residuals.iter().map(|r| r.norm()).fold(0.0, f64::max);
        let pose = &calibration.cam_from_target[i];
        // Angle between the board's normal and the optical axis, whichever side of the board is called its
        // front.
        let normal = pose.rotation.column(2);
        let tilt = libm::atan2(libm::hypot(normal.x, normal.y), normal.z.abs()).to_degrees();
        vec![
            linked(finished, name),
            residuals.len().to_string(),
            significant(calibration.view_rmse_px(i).unwrap_or(f64::NAN), 4),
            significant(largest, 3),
            significant(pose.translation.z, 5),
            format!("{tilt:.1}"),
        ]
    };
    finished.names.iter().enumerate().map(row).collect()
}

fn left_out(page: &mut String, finished: &Finished) {
    if finished.left_out.is_empty() {
        return;
    }
    page.push_str("<h2>Left out</h2>\n");
    paragraph(
        page,
        "",
        "In the picture of a photograph without the board, a red cross stands on each disc that was seen.",
    );
    page.push_str("<ul>\n");
    for left in &finished.left_out {
        let _ = writeln!(page, "<li>{}: {}</li>", linked(finished, &left.name), escaped(&left.reason));
    }
    page.push_str("</ul>\n");
}

/// A view's name, which leads to its picture if there is one.
fn linked(finished: &Finished, name: &str) -> String {
    match finished.overlays.get(name) {
        Some(overlay) => format!("<a href=\"{}\">{}</a>", escaped(overlay), escaped(name)),
        None => escaped(name),
    }
}

fn paragraph(page: &mut String, attributes: &str, text: &str) {
    let _ = writeln!(page, "<p{attributes}>{}</p>", escaped(text));
}

/// A table; the cells are HTML already.
fn table(page: &mut String, header: &[&str], rows: &[Vec<String>]) {
    page.push_str("<div class=\"scroll\"><table>\n<tr>");
    header.iter().for_each(|cell| {
        let _ = write!(page, "<th>{}</th>", escaped(cell));
    });
    page.push_str("</tr>\n");
    for row in rows {
        let cells: String = row.iter().map(|cell| format!("<td>{cell}</td>")).collect();
        let _ = writeln!(page, "<tr>{cells}</tr>");
    }
    page.push_str("</table></div>\n");
}

fn inlined(page: &mut String, figure: &Figure) {
    let svg = String::from_utf8_lossy(&figure.bytes);
    let _ =
        writeln!(page, "<figure>\n{svg}\n<figcaption>{}</figcaption>\n</figure>", escaped(&figure.caption));
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
