//! Are the committed scenes of the experiment lens-minimum those that are drawn again, whoever draws them?

use crate::program::{folder, text};
use calibench_experiments::lens_minimum::families::FAMILIES;
use calibench_experiments::lens_minimum::judged::judged;
use std::path::Path;
use std::process::Command;

#[test]
fn a_scene_does_not_depend_on_the_others() {
    for family in &FAMILIES {
        let name = format!("golden/lens-minimum/{}.csv", family.name());
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(&name);
        let table = std::fs::read_to_string(path).expect("it is committed");
        // Not one that the experiment repeats.
        let line = judged(family, 21, 7).expect("a scene is drawn").text();
        assert!(table.lines().any(|committed| committed == line), "{name}: {line}");
    }
}

#[test]
fn a_model_without_scenes_is_named_with_those_that_have_some() {
    let asked = Command::new(env!("CARGO_BIN_EXE_lens-minimum-scenes"))
        .args(["brown-conrady", "--out"])
        .arg(folder("lens-minimum-none"))
        .output()
        .expect("it runs");
    assert_eq!(asked.status.code(), Some(1));
    assert!(text(&asked.stderr).contains("there are: rational, thin-prism"), "{}", text(&asked.stderr));
}
