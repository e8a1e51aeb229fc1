//! One page that a colleague can open anywhere: question, answer in figures and tables, and how it was made.

use super::engine::Engine;
use super::manifest::Manifest;
use super::moments::Estimated;
use super::summary::{CellSummary, Statistic, Summary};
use crate::harness::{Figure, significant};
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:1280px;margin:2em auto;padding:0 1em;color:#1a1a1a}\
h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.2em;margin-top:2em}\
table{border-collapse:collapse;margin:.5em 0;font-variant-numeric:tabular-nums;font-size:13px}\
th,td{padding:.15em .7em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}\
th:first-child,td:first-child{text-align:left}thead th{border-bottom:2px solid #888}\
figure{margin:1em 0}figure svg{max-width:100%;height:auto}figcaption{color:#444;font-size:14px}\
pre{background:#f5f5f5;padding:1em;overflow:auto;font-size:13px}.low{color:#666}";

/// The page, self-contained.
pub(super) fn page(
    engine: &Engine,
    summary: &Summary,
    figures: &[Figure],
    manifest: &Manifest,
    spec_text: &str,
) -> String {
    let mut page = String::new();
    let name = escape(&engine.spec.name);
    page.push_str(&format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Study {name}</title>\n<style>{STYLE}</style></head><body>\n\
         <h1>Study {name}</h1>\n<p>{}</p>\n<p class=\"low\">{} trials in {} cells, seed {}; intervals at {} % confidence. \
         Part {}.</p>\n",
        escape(&engine.spec.question),
        engine.trials(),
        engine.cells.len(),
        engine.spec.seed,
        significant(100.0 * summary.confidence, 3),
        manifest.shard,
    ));
    page.push_str("<h2>Figures</h2>\n");
    for figure in figures {
        let drawing = String::from_utf8_lossy(&figure.bytes);
        page.push_str(&format!(
            "<figure>{drawing}<figcaption>{}</figcaption></figure>\n",
            escape(&figure.caption)
        ));
    }
    page.push_str("<h2>How trials ended</h2>\n");
    page.push_str(&endings(summary));
    page.push_str("<h2>Errors</h2>\n<p>sd / bound is the spread over the Cramer-Rao bound: 1 is the best that is possible. \
                   Bias and sd are of the trials that converged.</p>\n");
    for statistic in engine.quantities.iter() {
        page.push_str(&quantity_table(summary, statistic.name()));
    }
    page.push_str(&provenance(manifest, spec_text));
    page.push_str("</body></html>\n");
    page
}

fn endings(summary: &Summary) -> String {
    let mut text = String::from(
        "<table><thead><tr><th>cell</th><th>outcome</th><th>trials</th><th>share</th></tr></thead>\n",
    );
    for cell in &summary.cells {
        for (outcome, count, share) in &cell.outcomes {
            row(&mut text, &[&cell.name, outcome, &count.to_string(), &told(Some(*share))]);
        }
    }
    text + "</table>\n"
}

fn quantity_table(summary: &Summary, name: &str) -> String {
    let statistics: Vec<(&CellSummary, &Statistic)> =
        summary.cells.iter().filter_map(|c| Some((c, c.of(name)?))).filter(|(_, s)| s.count > 0).collect();
    let Some(&(_, first)) = statistics.first() else { return String::new() };
    let unit = if first.quantity.unit().is_empty() {
        String::new()
    } else {
        format!(" ({})", first.quantity.unit())
    };
    let mean = if first.quantity.is_error() { "bias" } else { "mean" };
    let mut text = format!(
        "<h3>{name}{unit}</h3>\n<table><thead><tr><th>cell</th><th>trials</th><th>{mean}</th><th>sd</th><th>RMS</th>\
         <th>2.5 %</th><th>median</th><th>97.5 %</th><th>predicted</th><th>sd / bound</th></tr></thead>\n"
    );
    for (cell, s) in statistics {
        let quantile = |i: usize| s.quantiles[i].1.map_or_else(dash, |q| significant(q.value, 4));
        let predicted = s.predicted.map_or_else(dash, |p| {
            let mean = if first.quantity.is_error() {
                String::new()
            } else {
                format!("{} \u{b1} ", significant(p.mean, 4))
            };
            format!("{mean}{}", significant(p.sd, 4))
        });
        row(
            &mut text,
            &[
                &cell.name,
                &s.count.to_string(),
                &told(s.mean),
                &told(s.sd),
                &told(s.rms),
                &quantile(0),
                &quantile(2),
                &quantile(4),
                &predicted,
                &told(s.ratio),
            ],
        );
    }
    text + "</table>\n"
}

fn provenance(manifest: &Manifest, spec_text: &str) -> String {
    let mut text = String::from("<h2>How this was made</h2>\n<table>\n");
    let commit = manifest.commit.clone().unwrap_or_else(|| "unknown".to_string());
    let dirty = if manifest.dirty == Some(true) { " (with changes)" } else { "" };
    row(&mut text, &["commit", &format!("{commit}{dirty}")]);
    row(&mut text, &["calibench", &manifest.code.calibench]);
    row(&mut text, &["solver behaviour", &manifest.code.behaviour]);
    for (name, version) in &manifest.code.crates {
        row(&mut text, &[name, version]);
    }
    row(&mut text, &["specification", &manifest.spec_sha256]);
    for (name, hash) in &manifest.files {
        row(&mut text, &[name, hash]);
    }
    text.push_str("</table>\n<p>Command: <code>calibench study run spec.toml</code> with</p>\n");
    text + &format!("<pre>{}</pre>\n", escape(spec_text))
}

fn row(text: &mut String, cells: &[&str]) {
    text.push_str("<tr>");
    for cell in cells {
        write!(text, "<td>{}</td>", escape(cell)).expect("writing to memory cannot fail");
    }
    text.push_str("</tr>\n");
}

fn dash() -> String {
    "\u{2013}".to_string()
}

/// `0.681 [0.670, 0.692]`.
fn told(estimated: Option<Estimated>) -> String {
    estimated.map_or_else(dash, |e| {
        format!("{} [{}, {}]", significant(e.value, 4), significant(e.low, 4), significant(e.high, 4))
    })
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
