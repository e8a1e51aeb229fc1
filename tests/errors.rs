//! Does an error that is printed with its causes say everything, and everything once?
//!
//! A cause is handed on in one way: the message states it, or `source()` gives it.

use calibench::board::BoardError;
use calibench::calibrate::single_plane::SinglePlaneError;
use calibench::calibrate::{CalibrationError, ClosedFormError};
use calibench::detect::GridError;
use calibench::geometry::HomographyError;
use calibench::io::{InputError, TableError, message, read_regular};
use calibench::photos::DetectError;
use calibench::synth::SceneError;
use calibench_gate::{PlanError, certified::DigitsTable, files::FilesError, suite::SuiteError};
use calibench_harness::{ExperimentError, RecordError, published::PublishedError};
use calibench_study::compare::CompareError;
use calibench_study::{FolderError, Located, MergeError, RunError, SpecError};
use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

const POINTS: HomographyError = HomographyError::TooFewPoints { need: 4, got: 3 };

fn view() -> CalibrationError {
    CalibrationError::View { view: 2, source: POINTS }
}

fn scene() -> SceneError {
    SceneError::BehindCamera { view: 1, point: 5 }
}

fn input() -> InputError {
    read_regular(Path::new("no/such/file"), 10).expect_err("there is no such file")
}

fn located() -> Located {
    Located { path: PathBuf::from("a/file"), cause: io::Error::other("the disk is full") }
}

fn spec() -> SpecError {
    SpecError::Name("Two Words".to_string())
}

/// Errors that have a cause, and what the innermost cause says.
fn with_causes() -> Vec<(Box<dyn Error>, String)> {
    let board = BoardError::TooSmall { columns: 1, rows: 2 };
    let grid = GridError::TooSmall { columns: 1, rows: 1 };
    let published = PublishedError::Unknown("four-pose.fx".to_string());
    let json = || serde_json::from_str::<u8>("x").expect_err("no number");
    let csv = DigitsTable::of_csv("solver\na,b\n").expect_err("no table");
    let closed_form = ClosedFormError::NoRealCamera;
    vec![
        (view().into(), POINTS.to_string()),
        (CalibrationError::NoStart { source: closed_form.clone() }.into(), closed_form.to_string()),
        (SinglePlaneError::from(POINTS).into(), POINTS.to_string()),
        (TableError::from(input()).into(), input().to_string()),
        (DetectError::from(grid).into(), grid.to_string()),
        (SuiteError::from(board.clone()).into(), board.to_string()),
        (SuiteError::Setup { id: "four", cause: scene().into() }.into(), scene().to_string()),
        (PlanError::from(scene()).into(), scene().to_string()),
        (FilesError::from(PlanError::from(scene())).into(), scene().to_string()),
        (FilesError::from(input()).into(), input().to_string()),
        (FilesError::from(io::Error::other("the disk is full")).into(), "the disk is full".to_string()),
        (FilesError::Manifest { path: "m.json".into(), cause: json() }.into(), json().to_string()),
        (csv.into(), "CSV error".to_string()),
        (ExperimentError::at("calibration")(view()).into(), POINTS.to_string()),
        (ExperimentError::from(RecordError::from(published)).into(), "four-pose.fx".to_string()),
        (located().into(), "the disk is full".to_string()),
        (CompareError::from(RunError::from(spec())).into(), spec().to_string()),
        (MergeError::from(RunError::from(FolderError::from(located()))).into(), located().to_string()),
    ]
}

#[test]
fn a_cause_is_said_once() {
    for (error, cause) in with_causes() {
        let said = message(&*error);
        assert_eq!(said.matches(&cause).count(), 1, "`{cause}` in `{said}`");
        let mut below = error.source();
        while let Some(source) = below {
            let text = source.to_string();
            assert_eq!(said.matches(&text).count(), 1, "`{text}` in `{said}`");
            below = source.source();
        }
    }
}

/// The list above cannot hold what is written tomorrow: no `#[error(...)]` states a field that is a source.
#[test]
fn no_message_states_what_is_a_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut seen = 0;
    for folder in ["src", "experiments"] {
        for file in crate::layout::files(folder, &["rs"]) {
            let text = std::fs::read_to_string(&file).expect("a source file");
            for variant in text.split("#[error(").skip(1) {
                seen += 1;
                let Some((message, fields)) = variant.split_once("]\n") else { continue };
                let is_source = fields.lines().next().is_some_and(|line| line.contains("#[from]"));
                let states = message.contains("{source") || is_source && message.contains("{0");
                let name = file.strip_prefix(root).unwrap_or(&file).display();
                assert!(!states, "{name}: {message}");
            }
        }
    }
    assert!(seen > 150, "{seen} messages were read");
}
