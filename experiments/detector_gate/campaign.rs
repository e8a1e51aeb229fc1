//! The whole measurement of a program: shows it all photographs, and writes what is committed.

use super::programs::{PROGRAMS, Program};
use super::row::{HEADER, Row};
use super::{PHOTOS, SEED, wrong};
use calibench_detector_gate::{Builtin, Detector, Scene, outcomes, scenes};
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{ProgressDisplay, campaign};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Where the committed lines stand, from the root of the project.
pub const FOLDER: &str = "golden/detector-gate";
/// Longest time for one photograph.
const TIMEOUT: Duration = Duration::from_secs(120);
/// What the adapter imports.
const MODULES: [&str; 2] = ["cv2", "numpy"];

/// Shows a program the photographs of the experiment detector-gate, and writes what it found to
/// golden/detector-gate/NAME.csv.
#[derive(Debug, Parser)]
struct Arguments {
    /// calibench, opencv or opencv-sb
    name: String,
    /// The Python that has OpenCV
    #[arg(long, default_value = "python3")]
    python: String,
    /// First photographs of each scene alone
    #[arg(long, requires = "out")]
    photos: Option<u64>,
    /// Counts wrong boards instead, in ten thousand photographs of these scenes and others
    #[arg(long)]
    wrong: bool,
    /// Draws other photographs of those ten thousand
    #[arg(long, requires = "wrong", requires = "out")]
    seed: Option<u64>,
    /// Writes there instead
    #[arg(long)]
    out: Option<PathBuf>,
}

/// The command.
pub fn main() -> ExitCode {
    campaign::exit_code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let program = campaign::named(&PROGRAMS, |program| program.name, &arguments.name)?;
    if arguments.wrong {
        if program.method.is_some() {
            return Err(format!(
                "wrong boards are counted of this library's detectors, not of {}",
                program.name
            ));
        }
        let (seed, photos) = (arguments.seed.unwrap_or(SEED), arguments.photos.unwrap_or(wrong::PHOTOS));
        return wrong::write(seed, photos, arguments.out.as_deref());
    }
    let photos = arguments.photos.unwrap_or(PHOTOS);
    let (mut detector, versions, fingerprint): (Box<dyn Detector>, String, Fingerprint) = match program.method
    {
        None => {
            let versions = format!("calibench {}", env!("CARGO_PKG_VERSION"));
            (Box::new(Builtin), versions, Fingerprint::of_detector_gate())
        }
        Some(method) => {
            let versions = campaign::python_versions(&arguments.python, &MODULES)?;
            let command = format!("{} adapters/detector_opencv.py {method}", arguments.python);
            let asked = calibench_detector_gate::Program::new(&command, TIMEOUT);
            let asked = asked.map_err(|error| error.to_string())?;
            (Box::new(asked), versions, Fingerprint::of_detector_gate_scenes())
        }
    };
    let rows = rows(program, detector.as_mut(), photos)?;
    let what = format!(
        "detector-gate-trials {}; seed {SEED}; versions {versions}; adapter {}",
        program.name,
        program.adapter_hash()
    );
    let table = campaign::table(HEADER, rows.iter().map(Row::text));
    let text = format!("{}\n{table}", fingerprint.head(&what));
    campaign::write(arguments.out.as_deref(), FOLDER, program.name, &text)
}

/// The scenes that a program is shown.
pub fn scenes_of(program: &Program) -> Vec<Scene> {
    scenes().into_iter().filter(|scene| program.knows(scene.kind)).collect()
}

/// The first photographs of every scene, scene after scene.
fn rows(program: &Program, detector: &mut dyn Detector, photos: u64) -> Result<Vec<Row>, String> {
    let scenes = scenes_of(program);
    let progress = ProgressDisplay::stderr().start(program.name, scenes.len());
    let mut rows = Vec::new();
    for scene in scenes {
        rows.extend(rows_of(&scene, detector, 0..photos).map_err(|error| error.to_string())?);
        progress.step();
    }
    Ok(rows)
}

/// These photographs of a scene.
///
/// # Errors
/// Photographs that cannot be handed over, and a program that does not know the board.
pub fn rows_of(
    scene: &Scene,
    detector: &mut dyn Detector,
    trials: std::ops::Range<u64>,
) -> std::io::Result<Vec<Row>> {
    let found = outcomes(scene, detector, SEED, trials)?;
    let found = found.ok_or_else(|| {
        std::io::Error::other(format!("{} does not know {}", detector.name(), scene.name()))
    })?;
    let row = |(trial, outcome)| Row { kind: scene.kind, scene: scene.id.to_string(), trial, outcome };
    Ok(found.into_iter().map(row).collect())
}
