//! Which figures can a reader move? A placeholder stands beside the figure. What it becomes is empty and
//! holds the golden values that the page is to find again; the scripts of book/laboratory fill it where they
//! run. Without them, and on paper, the figure is all there is.

use super::evidence::Evidence;
use super::text::attribute;
use calibench_harness::project::Project;
use serde_json::{Value, json};
use std::io;

/// A laboratory: its name, which is that of its script, the golden numbers that it computes anew, and what it
/// begins with besides: columns of a table of the last run.
struct Laboratory {
    name: &'static str,
    golden: &'static [&'static str],
    columns: Option<Columns>,
}

/// Columns of a table, by their headings, under the names that the script knows.
struct Columns {
    experiment: &'static str,
    table: &'static str,
    columns: &'static [(&'static str, &'static str)],
}

const LABORATORIES: [Laboratory; 5] = [
    Laboratory {
        name: "four-pose",
        golden: &[
            "four-pose.fx",
            "four-pose.fy",
            "four-pose.cx",
            "four-pose.cy",
            "four-pose.k1",
            "four-pose.k2",
            "four-pose.fx-sd",
            "four-pose.k2-sd",
            "four-pose.rmse",
            "four-pose.rmse-expected",
            "four-pose.chi-squared-ours",
            "four-pose.converged",
            "four-pose.rmse-mean",
            "four-pose.fx-sd-ratio",
            "four-pose.k2-sd-ratio",
        ],
        columns: None,
    },
    Laboratory {
        name: "line-bending",
        golden: &[
            "line-bending.max-deviation",
            "line-bending.rms-deviation",
            "line-bending.max-after-correction",
            "line-bending.round-trip",
            "line-bending.pincushion-max-deviation",
            "line-bending.pincushion-rms-deviation",
        ],
        columns: None,
    },
    Laboratory {
        name: "nine-point",
        golden: &[
            "nine-point.m11",
            "nine-point.m12",
            "nine-point.m21",
            "nine-point.m22",
            "nine-point.tx",
            "nine-point.ty",
            "nine-point.sx",
            "nine-point.sy",
            "nine-point.rms",
            "nine-point.max",
        ],
        columns: Some(Columns {
            experiment: "nine-point",
            table: "residuals",
            columns: &[("u", "u [px]"), ("v", "v [px]")],
        }),
    },
    Laboratory {
        name: "prediction-map",
        golden: &[
            "prediction-map.covered-radius",
            "prediction-map.predicted-at-target-covered",
            "prediction-map.predicted-at-target-beyond",
            "prediction-map.predicted-directions-covered",
            "prediction-map.predicted-directions-beyond",
        ],
        columns: None,
    },
    Laboratory {
        name: "grid-image",
        golden: &[
            "line-bending.max-deviation",
            "line-bending.rms-deviation",
            "line-bending.max-after-correction",
            "line-bending.round-trip",
        ],
        columns: None,
    },
];

/// What all laboratories share, in the order in which a page loads it; that of the solver's code is made of
/// the WebAssembly.
const SHARED: [&str; 7] =
    ["solver.js", "calibench.js", "drawing.js", "knobs.js", "same-numbers.js", "monte-carlo.js", "scene.js"];
/// Starts them; loaded last.
const START: &str = "page.js";
const CODE: &str = "calibench.js";
const FOLDER: &str = "book/laboratory";
const STYLE: &str = "style/laboratory.css";

/// The solver as WebAssembly, in the source tree.
pub const WEB_ASSEMBLY: &str = "book/laboratory/calibench.wasm";

/// How a page names a laboratory that stands on it.
const MARK: &str = "data-lab=\"";

/// The place of a laboratory on a page.
pub(super) fn place(name: &str, evidence: &Evidence) -> Result<String, String> {
    let names = || LABORATORIES.iter().map(|laboratory| laboratory.name).collect::<Vec<_>>().join(", ");
    let laboratory = LABORATORIES.iter().find(|laboratory| laboratory.name == name);
    let laboratory =
        laboratory.ok_or_else(|| format!("there is no laboratory `{name}`; there are: {}", names()))?;
    let golden: Vec<_> =
        laboratory.golden.iter().map(|id| golden_number(id, evidence)).collect::<Result<_, _>>()?;
    let golden = attribute(&Value::Array(golden).to_string());
    let columns = laboratory.columns.as_ref().map(|columns| columns.read(evidence)).transpose()?;
    let columns =
        columns.map_or(String::new(), |data| format!(" data-columns=\"{}\"", attribute(&data.to_string())));
    Ok(format!(
        "<div class=\"laboratory\" id=\"lab-{name}\" {MARK}{name}\" data-golden=\"{golden}\"{columns}></div>\n"
    ))
}

impl Columns {
    /// The numbers of each column, by the script's name of it.
    fn read(&self, evidence: &Evidence) -> Result<Value, String> {
        let Columns { experiment, table, columns } = self;
        let csv = evidence.experiments.get(*experiment).and_then(|found| found.tables.get(*table));
        let csv = csv.ok_or_else(|| {
            format!("table `{experiment}.{table}` is not in the last run: `calibench run {experiment}`")
        })?;
        let mut reader = csv::Reader::from_reader(csv.as_bytes());
        let headings = reader.headers().map_err(|error| error.to_string())?.clone();
        let rows = reader.records().collect::<Result<Vec<_>, _>>().map_err(|error| error.to_string())?;
        let column = |(name, heading): &(&str, &str)| {
            let at = headings.iter().position(|h| h == *heading);
            let at = at.ok_or_else(|| format!("table `{experiment}.{table}` has no column `{heading}`"))?;
            let numbers: Result<Vec<f64>, _> = rows.iter().map(|row| row[at].parse()).collect();
            Ok((name.to_string(), json!(numbers.map_err(|error| error.to_string())?)))
        };
        columns.iter().map(column).collect()
    }
}

/// Name, value to the last bit, unit.
fn golden_number(id: &str, evidence: &Evidence) -> Result<Value, String> {
    let golden = |experiment: &str, number: &str| {
        let (_, golden) = evidence.experiments.get(experiment)?.golden.as_ref()?.number(number)?;
        Some(json!([id, golden.value, golden.unit]))
    };
    let found = id.split_once('.').and_then(|(experiment, number)| golden(experiment, number));
    found.ok_or_else(|| format!("the laboratory is to find `{id}` again, and golden/ has no such number"))
}

/// The laboratories in the text of a page.
fn standing_in(text: &str) -> impl Iterator<Item = &'static Laboratory> {
    LABORATORIES.iter().filter(move |laboratory| text.contains(&format!("{MARK}{}\"", laboratory.name)))
}

/// The scripts of these laboratories, in the order in which they are loaded; none for none.
fn scripts<'a>(laboratories: impl Iterator<Item = &'a Laboratory>) -> Vec<String> {
    let own: Vec<String> = laboratories.map(|laboratory| format!("{}.js", laboratory.name)).collect();
    if own.is_empty() {
        return own;
    }
    SHARED.map(str::to_string).into_iter().chain(own).chain([START.to_string()]).collect()
}

/// What the head of a page needs for the laboratories in its text: nothing, or their style and their scripts.
pub(super) fn head(text: &str) -> String {
    let scripts = scripts(standing_in(text));
    if scripts.is_empty() {
        return String::new();
    }
    let line = |file: &String| format!("<script defer src=\"laboratory/{file}\"></script>\n");
    let lines: String = scripts.iter().map(line).collect();
    format!("<link rel=\"stylesheet\" href=\"{STYLE}\">\n{lines}")
}

/// What the laboratories of these texts need, by its path in the book.
pub(super) fn files(project: &Project, texts: &[String]) -> Vec<(String, io::Result<Vec<u8>>)> {
    let used = |laboratory: &&Laboratory| {
        texts.iter().any(|text| standing_in(text).any(|here| here.name == laboratory.name))
    };
    let scripts = scripts(LABORATORIES.iter().filter(used));
    let content = |file: &str| match file {
        CODE => project.read(WEB_ASSEMBLY).map(|bytes| code(&bytes).into_bytes()),
        _ => project.read(&format!("{FOLDER}/{file}")),
    };
    let style = (!scripts.is_empty()).then(|| (STYLE.to_string(), project.read(&format!("book/{STYLE}"))));
    let scripts = scripts.iter().map(|file| (format!("laboratory/{file}"), content(file)));
    style.into_iter().chain(scripts).collect()
}

/// The WebAssembly as a script: a browser that opens a file from a disk may load a script, but no data.
fn code(bytes: &[u8]) -> String {
    format!("Laboratory.code = '{}';\n", base64(bytes))
}

/// Base64 of RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |word, i| word << 8 | u32::from(three.get(i).copied().unwrap_or(0)));
        let digit = |i: usize| char::from(DIGITS[(word >> (18 - 6 * i)) as usize & 63]);
        (0..4).for_each(|i| text.push(if i <= three.len() { digit(i) } else { '=' }));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_its_definition() {
        // RFC 4648, section 10.
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn only_pages_with_a_laboratory_load_scripts() {
        assert_eq!(head("<p>four-pose</p>"), "");
        let head = head("<div data-lab=\"four-pose\"></div>");
        let at = |file: &str| head.find(file).unwrap_or_else(|| panic!("{file} is not in {head}"));
        assert!(at("solver.js") < at("calibench.js") && at("drawing.js") < at("four-pose.js"));
        assert!(at("four-pose.js") < at("page.js"));
    }
}
