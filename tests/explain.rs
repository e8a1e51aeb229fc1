//! Does `calibench explain` say where a thing comes from, and find what was meant?

use std::path::Path;
use std::process::{Command, Output};

fn explain(name: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    let run = command.args(["explain", name]).current_dir(env!("CARGO_MANIFEST_DIR"));
    run.output().expect("the program starts")
}

/// What is said, on one line.
fn explained(name: &str) -> String {
    let run = explain(name);
    assert_eq!(run.status.code(), Some(0), "{name}: {}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8_lossy(&run.stdout).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The file and line behind a word, and what stands there.
fn line_behind(text: &str, word: &str) -> String {
    let (_, rest) = text.split_once(&format!(" {word} ")).expect("the word");
    let (file, line) = rest.split(' ').next().expect("a place").rsplit_once(':').expect("a file and a line");
    let code = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("a file");
    let line: usize = line.parse().expect("a line");
    code.lines().nth(line - 1).expect("it has the line").to_string()
}

#[test]
fn a_number_is_explained_from_its_line_of_code_to_the_chapter() {
    let said = explained("line-bending.max-deviation");
    for part in [
        "number largest distance of the distorted line from its regression line",
        "value 4.67774",
        "px (the golden value, to the last bit)",
        "band absolute",
        "chapter section 5.1, 5.4 prints 4.678 px",
        "verdict the chapter's value: holds; ours: holds",
        "kind independent",
        "seed ",
        "pages book/text/",
        "again calibench run line-bending",
    ] {
        assert!(said.contains(part), "`{part}` is not in: {said}");
    }
    assert!(line_behind(&said, "computed").contains("\"max-deviation\""), "{said}");
}

#[test]
fn a_claim_a_figure_and_the_table_behind_it_are_explained() {
    let claim = explained("line-bending.correction-is-exact");
    assert!(
        claim.contains("because 40 roundings") && claim.contains("px: holds interval -inf to 3.00000e-12 px"),
        "{claim}"
    );
    assert!(line_behind(&claim, "computed").contains("claim_that("), "{claim}");
    let both = explained("line-bending.k1");
    for part in
        ["rows, in out/line-bending/k1.csv", "figures/line-bending/k1.svg", "Nothing is drawn at", "pages"]
    {
        assert!(both.to_lowercase().contains(&part.to_lowercase()), "`{part}` is not in: {both}");
    }
}

#[test]
fn sections_experiments_and_contradictions_have_their_names() {
    let section = explained("5.4");
    assert!(section.contains("line-bending.max-deviation printed 4.678 px"), "{section}");
    assert!(section.contains("ours 4.677747 px: holds, independent"), "{section}");
    assert!(explained("line-bending").contains("names line-bending.centre-line-stays-straight"));
    let against = explained("tangential-terms-may-be-left-out");
    assert!(
        against.contains("shown by distortion-model.bias-is-linear") && !against.contains("{{"),
        "{against}"
    );
}

#[test]
fn an_unknown_name_gets_the_nearest_ones() {
    for (slip, meant) in [
        ("four-pose.xf", "four-pose.fx"),
        ("line-bendin", "line-bending"),
        ("max-deviaton", "line-bending.max-deviation"),
    ] {
        let run = explain(slip);
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2));
        assert!(said.contains(&format!("\n  {meant}\n")), "{slip}: {said}");
    }
}
