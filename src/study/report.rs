//! One page that a colleague can open anywhere: question, answer in figures and tables, and how it was made.

use super::engine::Engine;
use super::manifest::Manifest;
use super::moments::Estimated;
use super::shard::Shard;
use super::summary::{CellSummary, Statistic, Summary};
use calibench::io::significant;
use calibench_harness::Figure;
use std::fmt::Write;

/// Wide tables and figures scroll within the page, which never does: figures keep a size at which they can be
/// read.
const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:1280px;margin:2em auto;padding:0 1em;color:#1a1a1a}\
h1{font-size:1.6em;margin-bottom:.2em}h2{font-size:1.2em;margin-top:2em}\
table{border-collapse:collapse;margin:.5em 0;font-variant-numeric:tabular-nums;font-size:13px}\
th,td{padding:.15em .7em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}\
th:first-child,td:first-child{text-align:left}thead th{border-bottom:2px solid #888}td small{color:#555}\
.wide{overflow-x:auto}figure{margin:1em 0}figure svg{max-width:none}\
figcaption{color:#444;font-size:14px}\
pre{background:#f5f5f5;padding:1em;overflow:auto;font-size:13px}.low{color:#666}.hash{word-break:break-all;white-space:normal}";

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
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>Study {name}</title>\n<style>{STYLE}</style></head><body>\n\
         <h1>Study {name}</h1>\n<p>{}</p>\n<p class=\"low\">{} trials in {} cells, seed {}; intervals at {} % confidence.{}</p>\n",
        escape(&engine.spec.question),
        engine.trials(),
        engine.cells.len(),
        engine.spec.seed,
        percent(summary.confidence),
        if engine.shard == Shard::WHOLE { String::new() } else { format!(" Part {} only.", engine.shard) },
    ));
    if let Some(solver) = &manifest.solver {
        page.push_str(&format!("<p>Calibrated by <code>{}</code>.</p>\n", escape(solver)));
    }
    let imprecise: Vec<String> = engine.imprecise().iter().map(|cell| escape(&cell.name)).collect();
    if !imprecise.is_empty() {
        page.push_str(&format!(
            "<p>Not as precise as wanted after all trials: {}.</p>\n",
            imprecise.join("; ")
        ));
    }
    page.push_str("<h2>Figures</h2>\n");
    for figure in figures {
        let drawing = String::from_utf8_lossy(&figure.bytes);
        page.push_str(&format!(
            "<figure><div class=\"wide\">{drawing}</div><figcaption>{}</figcaption></figure>\n",
            escape(&figure.caption)
        ));
    }
    page.push_str("<h2>How trials ended</h2>\n");
    page.push_str(&endings(summary));
    page.push_str("<h2>Errors</h2>\n<p>sd / bound is the spread over the Cramer-Rao bound: 1 is the best that is possible. \
                   Bias and sd are of the trials that converged.</p>\n");
    page.push_str(&together(engine, summary));
    for statistic in engine.quantities.iter() {
        page.push_str(&quantity_table(summary, statistic.name()));
    }
    page.push_str(&provenance(manifest, spec_text));
    page.push_str("</body></html>\n");
    page
}

/// What holds of all cells at once.
fn together(engine: &Engine, summary: &Summary) -> String {
    let cells = match (engine.cells.len(), engine.spec.common_random_numbers) {
        (1, _) => "",
        (_, true) => {
            " Trial t meets the same noise in every cell (common random numbers): cells are compared pair by pair, more sharply \
             than these intervals tell, but they are not independent. They move together, and what is unusual in one is \
             likely to be so in its neighbours."
        }
        (_, false) => " Every cell draws noise of its own: cells are independent.",
    };
    let all = summary.cells.iter().flat_map(|cell| &cell.statistics);
    let judged = all.filter(|s| s.ratio_jointly.is_some()).count();
    let confidence = percent(summary.confidence);
    format!(
        "<p>An interval holds with {confidence} % by itself. Under \u{201c}jointly\u{201d} those of all {judged} ratios sd / bound of this \
         study hold together with {confidence} % (Bonferroni), whether or not cells are independent.{cells}</p>\n"
    )
}

/// A share without the rounding of its binary fraction: 95, 99.9.
fn percent(share: f64) -> f64 {
    libm::round(1e6 * share) / 1e4
}

fn endings(summary: &Summary) -> String {
    let mut rows = String::new();
    for cell in &summary.cells {
        for (outcome, count, share) in &cell.outcomes {
            row(&mut rows, &[escape(&cell.name), escape(outcome), count.to_string(), shown(Some(*share))]);
        }
    }
    table(&["cell", "outcome", "trials", "share"], &rows)
}

fn quantity_table(summary: &Summary, name: &str) -> String {
    let statistics: Vec<(&CellSummary, &Statistic)> =
        summary.cells.iter().filter_map(|c| Some((c, c.of(name)?))).filter(|(_, s)| s.count > 0).collect();
    let Some(&(_, first)) = statistics.first() else { return String::new() };
    let unit = match first.quantity.unit() {
        "" => String::new(),
        unit => format!(" ({unit})"),
    };
    let mean = if first.quantity.is_error() { "bias" } else { "mean" };
    let mut heads = vec!["cell".to_string(), "trials".into(), mean.into(), "sd".into(), "RMS".into()];
    heads.extend(first.quantiles.iter().map(|(share, _)| match share {
        0.5 => "median".to_string(),
        share => format!("{} %", percent(*share)),
    }));
    heads.extend(["predicted", "sd / bound", "jointly"].map(String::from));
    let mut rows = String::new();
    for (cell, s) in statistics {
        let predicted = s.predicted.map_or_else(dash, |p| match first.quantity.is_error() {
            true => significant(p.sd, 4),
            false => format!("{}<br><small>\u{b1} {}</small>", significant(p.mean, 4), significant(p.sd, 4)),
        });
        let mut entries =
            vec![escape(&cell.name), s.count.to_string(), shown(s.mean), shown(s.sd), shown(s.rms)];
        entries.extend(s.quantiles.iter().map(|(_, q)| shown(*q)));
        entries.extend([predicted, shown(s.ratio), interval(s.ratio_jointly)]);
        row(&mut rows, &entries);
    }
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    format!("<h3>{name}{unit}</h3>\n{}", table(&heads, &rows))
}

fn provenance(manifest: &Manifest, spec_text: &str) -> String {
    let mut text = String::from("<h2>How this was made</h2>\n<div class=\"wide\"><table>\n");
    let commit = manifest.commit.clone().unwrap_or_else(|| "unknown".to_string());
    let dirty = if manifest.dirty == Some(true) { " (with changes)" } else { "" };
    let mut line = |what: &str, is: &str| {
        row(&mut text, &[escape(what), format!("<span class=\"hash\">{}</span>", escape(is))]);
    };
    line("commit", &format!("{commit}{dirty}"));
    line("calibench", &manifest.code.calibench);
    line("solver behaviour", &manifest.code.behaviour);
    manifest.code.crates.iter().for_each(|(name, version)| line(name, version));
    line("specification", &manifest.spec_sha256);
    manifest.files.iter().for_each(|(name, hash)| line(name, hash));
    let command = escape(&manifest.command("spec.toml"));
    text + &format!(
        "</table></div>\n<p>Command: <code>{command}</code> with</p>\n<pre>{}</pre>\n",
        escape(spec_text)
    )
}

/// A table that scrolls where the page is narrower.
fn table(heads: &[&str], rows: &str) -> String {
    let heads: String = heads.iter().map(|head| format!("<th>{head}</th>")).collect();
    format!("<div class=\"wide\"><table><thead><tr>{heads}</tr></thead>\n{rows}</table></div>\n")
}

/// A row of entries that are HTML already.
fn row(text: &mut String, entries: &[String]) {
    text.push_str("<tr>");
    for entry in entries {
        write!(text, "<td>{entry}</td>").expect("writing to memory cannot fail");
    }
    text.push_str("</tr>\n");
}

fn dash() -> String {
    "\u{2013}".to_string()
}

/// The value, and its interval in a line of its own.
fn shown(estimated: Option<Estimated>) -> String {
    estimated.map_or_else(dash, |e| {
        let [value, low, high] = [e.value, e.low, e.high].map(|x| significant(x, 4));
        format!("{value}<br><small>[{low}, {high}]</small>")
    })
}

/// The interval alone.
fn interval(estimated: Option<Estimated>) -> String {
    estimated.map_or_else(dash, |e| {
        format!("<small>[{}, {}]</small>", significant(e.low, 4), significant(e.high, 4))
    })
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Shard, Spec, Trial, summarise};
    use calibench_harness::Build;

    #[test]
    fn a_share_is_told_without_the_rounding_of_its_binary_fraction() {
        assert_eq!([0.95, 0.999, 0.997_3].map(percent), [95.0, 99.9, 99.73]);
    }

    #[test]
    fn every_way_in_which_trials_ended_has_a_row_with_its_share() {
        let mut engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let values = vec![None; engine.quantities.len()];
        for outcome in ["converged", "converged", "converged", "refused-<few>"] {
            let trial =
                Trial { cell: 0, trial: 0, outcome: outcome.into(), iterations: 1, values: values.clone() };
            engine.tallies[0].add(&trial);
        }
        let html = endings(&summarise(&engine));
        for row in ["noise = 0.1", "converged", "<td>3", "refused-&lt;few&gt;", "<td>1"] {
            assert!(html.contains(row), "{row}: {html}");
        }
        // The other cell has none.
        assert!(!html.contains("noise = 0.3"), "{html}");
    }

    /// The study after four trials of the first cell, in which all quantities but cy have these values.
    fn after_four() -> (Engine, Summary) {
        let mut engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        for x in [0.5, 1.5, 2.5, 3.5] {
            let values = engine.quantities.iter().map(|q| (q.name() != "cy").then_some(x)).collect();
            let outcome = "converged".to_string();
            engine.tallies[0].add(&Trial { cell: 0, trial: 0, outcome, iterations: 1, values });
        }
        let summary = summarise(&engine);
        (engine, summary)
    }

    #[test]
    fn a_quantity_has_a_row_for_every_cell_that_has_values_of_it() {
        let (_, summary) = after_four();
        let html = quantity_table(&summary, "fx");
        assert!(html.contains("<h3>fx (px)</h3>") && html.contains("<th>bias</th>"), "{html}");
        // Bias, sqrt(5 / 3) and sqrt(5.25); of four values no quantile of 2.5 % has an interval.
        for entry in ["noise = 0.1</td>", "4</td>", "2.000<br>", "1.291<br>", "2.291<br>", "\u{2013}</td>"] {
            assert!(html.contains(&format!("<td>{entry}")), "{entry}: {html}");
        }
        assert!(!html.contains("noise = 0.3"), "{html}");
        assert_eq!(html.matches("<th>").count(), html.matches("<td>").count(), "{html}");
        assert!(quantity_table(&summary, "rmse").contains("<th>mean</th>"));
        assert_eq!(quantity_table(&summary, "cy"), "", "no cell has values of it");
    }

    #[test]
    fn the_page_says_whether_cells_share_their_noise_and_how_many_ratios_hold_jointly() {
        let (mut engine, summary) = after_four();
        // fx, fy, cx, k1, k2 and depth, RMSE and NEES.
        let common = together(&engine, &summary);
        assert!(common.contains("all 8 ratios") && common.contains("95 % (Bonferroni)"), "{common}");
        assert!(common.contains("common random numbers") && common.contains("not independent"), "{common}");
        engine.spec.common_random_numbers = false;
        let own = together(&engine, &summary);
        assert!(own.contains("noise of its own") && !own.contains("common"), "{own}");
        engine.cells.truncate(1);
        let one = together(&engine, &summary);
        assert!(!one.contains("noise of its own") && !one.contains("common"), "{one}");
    }

    #[test]
    fn a_page_tells_the_commit_and_whether_the_tree_differed_from_it() {
        let unknown = Manifest::new(&Spec::parse(STUDY).unwrap(), Shard::WHOLE, &Build::default());
        let told = |dirty: Option<bool>| {
            let commit = dirty.map(|_| "0a1b2c".to_string());
            provenance(&Manifest { commit, dirty, ..unknown.clone() }, "levels < 3")
        };
        assert!(told(Some(true)).contains("0a1b2c (with changes)"));
        assert!(told(Some(false)).contains("0a1b2c<") && !told(Some(false)).contains("with changes"));
        assert!(told(None).contains("unknown<") && told(None).contains("levels &lt; 3"));
    }
}
