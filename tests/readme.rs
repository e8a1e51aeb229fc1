//! Do README.md and the pages behind it say what the program says? Their tables, numbers and figures are
//! compared with golden/ and with a run.

use calibench_harness::published::{Kind, not_judged};
use calibench_harness::verdict::ByKind;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a file of the project")
}

/// The lines of a golden snapshot of the given kind, split into their fields.
fn golden(experiment: &str, kind: &str) -> Vec<Vec<String>> {
    let fields = |line: &str| line.split(" | ").map(str::to_string).collect::<Vec<_>>();
    read(&format!("golden/{experiment}.snap")).lines().map(fields).filter(|f| f[0] == kind).collect()
}

/// The published values of an experiment by kind, all of which hold.
fn published(experiment: &str) -> ByKind {
    let mut counts = ByKind::default();
    for line in golden(experiment, "published") {
        let kind = Kind::ALL.into_iter().find(|k| k.name() == line[7]).expect("a kind of verdict");
        counts.count(kind, true);
    }
    not_judged(experiment).for_each(|entry| counts.count(entry.kind, false));
    counts
}

#[test]
fn the_table_of_experiments_counts_what_golden_holds() {
    let page = read("experiments/README.md");
    let counted: BTreeMap<String, Vec<String>> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `"))
        .filter_map(|line| line.split_once("` |"))
        .map(|(id, counts)| {
            (id.to_string(), counts.trim_matches(['|', ' ']).split(" | ").map(|c| c.trim().into()).collect())
        })
        .collect();
    let of_all = |n: usize| if n == 0 { "–".to_string() } else { format!("{n} of {n}") };
    let held: BTreeMap<String, Vec<String>> =
        std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/golden"))
            .expect("golden/ is there")
            .map(|file| file.expect("a file of golden/").path())
            .filter(|path| path.extension().is_some_and(|e| e == "snap"))
            .map(|path| {
                let id = path.file_stem().expect("a snapshot has a name").to_string_lossy().into_owned();
                let mut counts = ["number", "claim"].map(|kind| of_all(golden(&id, kind).len())).to_vec();
                let published = published(&id).to_string();
                counts.push(if published.is_empty() { "–".to_string() } else { published });
                (id, counts)
            })
            .collect();
    for (id, counts) in &held {
        assert_eq!(counted.get(id), Some(counts), "`{id}` in experiments/README.md");
    }
    let all = held.keys().fold(ByKind::default(), |sum, id| sum.plus(&published(id)));
    let said = format!("| all | | | {all} |");
    assert!(page.contains(&said), "experiments/README.md should say: {said}");
    let said = format!("published values: {all}\n");
    assert!(read("README.md").contains(&said), "README.md should say: {said}");
}

#[test]
fn the_chi_squared_of_both_tables_are_the_golden_ones() {
    let value = |id: &str| -> f64 {
        let numbers = golden("four-pose", "number");
        let number = numbers.iter().find(|f| f[1] == id).unwrap_or_else(|| panic!("no number `{id}`"));
        number[2].parse().expect("a golden number")
    };
    let said = format!(
        "(joint chi-squared {:.2} on 6 degrees of freedom; ours {:.2})",
        value("chi-squared-book"),
        value("chi-squared-ours")
    );
    for page in ["README.md", "experiments/README.md"] {
        let text = read(page).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains(&said), "{page} should say: {said}");
    }
}

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn the_output_shown_for_zhangs_data_is_what_the_command_prints() {
    let folder = crate::data::folder();
    let page = read("src/command/README.md");
    let (_, shown) =
        page.split_once("$ calibench calibrate zhang/points.csv ").expect("the command is shown");
    let (shown, _) = shown.split_once("\n```").expect("the block ends");
    let (arguments, output) = shown.split_once('\n').expect("output follows the command");
    let run = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .args(["calibrate", "zhang/points.csv"])
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program starts");
    let printed = String::from_utf8_lossy(&run.stdout);
    assert_eq!(printed.trim_end(), output.trim_end(), "{}", String::from_utf8_lossy(&run.stderr));
}

/// README.md and the pages that its long tables stand on.
const PAGES: [&str; 6] = [
    "README.md",
    "adapters/DIGITS.md",
    "adapters/POWER.md",
    "benches/peers/README.md",
    "experiments/README.md",
    "src/command/README.md",
];

#[test]
fn the_readme_is_read_in_some_minutes_and_its_links_lead_somewhere() {
    assert!(read("README.md").lines().count() <= 150);
    for page in PAGES {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(page);
        let folder = folder.parent().expect("a page lies in a folder");
        let text = read(page);
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let pictures = ["src=\"", "srcset=\""].into_iter().flat_map(|word| text.split(word).skip(1));
        let pictures = pictures.filter_map(|rest| rest.split('"').next());
        let places = links.chain(pictures).map(|place| place.split('#').next().unwrap_or_default());
        for place in places.filter(|place| !place.is_empty() && !place.contains("://")) {
            assert!(folder.join(place).exists(), "{page}: nothing at {place}");
        }
    }
}

/// A figure for dark pages, as `.ci/pictures` recolours it.
fn dark(svg: &str) -> String {
    let script = read(".ci/pictures");
    let colours = script.split("-e 's/").skip(1).filter_map(|rest| rest.split_once("/g'")?.0.split_once('/'));
    colours.fold(svg.to_string(), |svg, (light, dark)| svg.replace(light, dark))
}

#[test]
fn figures_of_the_readme_are_those_of_the_program() {
    let pictures = |name: &str| read(&format!(".github/pictures/{name}"));
    assert_eq!(pictures("cloud-dark.svg"), dark(&read("figures/four-pose/k1-k2.svg")), "run .ci/pictures");
    assert_eq!(pictures("study-dark.svg"), dark(&pictures("study.svg")), "run .ci/pictures");
    assert_ne!(pictures("study-dark.svg"), pictures("study.svg"));
    let readme = read("README.md");
    let (_, study) = readme.split_once("```toml\n").expect("a study");
    let (study, _) = study.split_once("```").expect("the block ends");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme-study");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder is made");
    std::fs::write(folder.join("views.toml"), study).expect("written");
    let run = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .args(["study", "run", "views.toml", "--out", "views"])
        .current_dir(&folder)
        .output()
        .expect("the program starts");
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    let figure = std::fs::read_to_string(folder.join("views/figures/spread.svg")).expect("a figure");
    assert!(figure == pictures("study.svg"), "run .ci/pictures");
}
