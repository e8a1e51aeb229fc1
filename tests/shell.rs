//! Do shells and the manual know every verb?

use std::path::Path;
use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    let output =
        Command::new(env!("CARGO_BIN_EXE_calibench")).args(arguments).output().expect("the program starts");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

/// The verbs that the help lists.
pub(crate) fn verbs() -> Vec<String> {
    let help = String::from_utf8_lossy(&run(&["--help"]).stdout).into_owned();
    let (_, listed) = help.split_once("Commands:").expect("verbs are listed");
    let (listed, _) = listed.split_once("Options:").expect("options follow");
    let indented = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
    let names = listed.lines().filter(indented).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(String::from).collect()
}

#[test]
fn every_verb_is_completed_and_has_a_page_of_the_manual() {
    let verbs = verbs();
    assert!(verbs.len() > 15 && verbs.contains(&"check-reference".to_string()), "{verbs:?}");
    for shell in ["bash", "zsh", "fish"] {
        let script = String::from_utf8_lossy(&run(&["completions", shell]).stdout).into_owned();
        for verb in &verbs {
            assert!(script.contains(verb.as_str()), "{shell} does not complete {verb}");
        }
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("manual");
    let _ = std::fs::remove_dir_all(&folder);
    run(&["manual", "--out", &folder.to_string_lossy()]);
    for verb in &verbs {
        let page = std::fs::read_to_string(folder.join(format!("calibench-{verb}.1"))).expect("a page");
        assert!(page.contains(".SH SYNOPSIS"), "{verb}");
    }
    assert!(folder.join("calibench.1").is_file() && folder.join("calibench-study-run.1").is_file());
}
