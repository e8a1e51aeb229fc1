//! `calibench gate hand-eye`: is a solver to be trusted that finds where a camera sits on a robot?

use super::super::{Exit, print, warn};
use super::options::{OwnKind, refuse_unwritable};
use super::{Stop, incomplete, usage};
use calibench::io::write_atomically;
use calibench_gate::{THOROUGH, Terms};
use calibench_hand_eye_gate::{Builtin, MOST_SAMPLES, Program, QUICK, Report, Solver, run as judge};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Methods of the table besides this library's, with their programs. KinHEC's two refinements take so long
/// that they are judged by themselves.
const METHODS: [(&str, &str); 14] = [
    ("OpenCV, Tsai & Lenz", "python3 adapters/hand_eye_opencv_solver.py tsai"),
    ("OpenCV, Park & Martin", "python3 adapters/hand_eye_opencv_solver.py park"),
    ("OpenCV, Horaud & Dornaika", "python3 adapters/hand_eye_opencv_solver.py horaud"),
    ("OpenCV, Andreff", "python3 adapters/hand_eye_opencv_solver.py andreff"),
    ("OpenCV, Daniilidis", "python3 adapters/hand_eye_opencv_solver.py daniilidis"),
    ("OpenCV, Shah", "python3 adapters/hand_eye_opencv_solver.py shah"),
    ("OpenCV, Li", "python3 adapters/hand_eye_opencv_solver.py li"),
    ("KinHEC, Tsai & Lenz", "python3 adapters/hand_eye_kinhec_solver.py tsai_lenz"),
    ("KinHEC, Park & Martin", "python3 adapters/hand_eye_kinhec_solver.py park_martin"),
    ("KinHEC, Horaud & Dornaika", "python3 adapters/hand_eye_kinhec_solver.py horaud_dornaika"),
    ("KinHEC, Andreff", "python3 adapters/hand_eye_kinhec_solver.py andreff"),
    ("KinHEC, Daniilidis", "python3 adapters/hand_eye_kinhec_solver.py daniilidis"),
    ("KinHEC, Shah", "python3 adapters/hand_eye_kinhec_solver.py shah"),
    ("KinHEC, Li", "python3 adapters/hand_eye_kinhec_solver.py li_kronecker"),
];

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Program to judge, which finds where a camera sits on a robot (see adapters/HAND-EYE-PROTOCOL.md)
    /// [default: this library's solver]
    #[arg(long, value_name = "COMMAND")]
    solver: Option<String>,
    #[command(flatten)]
    own: OwnKind,
    /// Judges this library and the hand-eye methods of the programs in adapters/, and writes the table as
    /// Markdown
    #[arg(long, value_name = "FILE", conflicts_with_all = ["solver", "json", "format"])]
    methods: Option<PathBuf>,
}

/// Judges one solver; without a program that is this library's.
pub(super) fn run(arguments: &Arguments) -> Result<Exit, Stop> {
    let timeout = arguments.own.timeout(arguments.solver.as_deref())?;
    if let Some(path) = &arguments.methods {
        return write_table(&arguments.own, path, timeout);
    }
    let mut solver: Box<dyn Solver> = match &arguments.solver {
        Some(command) => Box::new(Program::new(command, timeout)),
        None => Box::new(Builtin),
    };
    let report = judged(&arguments.own, solver.as_mut())?;
    Ok(arguments.own.told.tell(&report.to_json(), &report.to_text(), report.trusted))
}

fn judged(own: &OwnKind, solver: &mut dyn Solver) -> Result<Report, Stop> {
    let samples = own.amount.samples([QUICK, THOROUGH], MOST_SAMPLES)?;
    let terms = Terms { false_alarm_rate: own.false_alarms.rate, ..Terms::default() };
    Ok(judge(solver, own.amount.seed, samples, &terms))
}

/// What stands above the table.
const TABLE_HEAD: &str = "\
# Hand-eye methods at the gate

How large are the errors of X, in terms of the Cramer-Rao bound, and what does not hold? Eight scenes that determine X
([the protocol](HAND-EYE-PROTOCOL.md) says which), 1 is as good as can be; then the properties that fail, with the scenes.
";

/// Judges this library and the methods of the adapters, and writes the table.
fn write_table(own: &OwnKind, path: &Path, timeout: Duration) -> Result<Exit, Stop> {
    let project = calibench_harness::project::Project::find().map_err(usage)?;
    std::env::set_current_dir(project.root()).map_err(incomplete)?;
    refuse_unwritable(path)?;
    let ours = judged(own, &mut Builtin)?;
    let mut text = format!("{TABLE_HEAD}\n{}\n{}\n", ours.head(), ours.to_row("calibench"));
    for (name, command) in METHODS {
        let report = judged(own, &mut Program::new(command, timeout))?;
        if report.scenes.iter().all(|scene| scene.over_bound.is_none()) {
            return Err(incomplete(format!(
                "{name} answered nothing: adapters/requirements-hand-eye.txt names what it needs"
            )));
        }
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(text, "{}", report.to_row(name));
        warn(&format!("{name}: judged"));
    }
    let _ = writeln!(
        text,
        "\nWritten by `calibench gate hand-eye --methods FILE` with {} samples a scene, seed {}. A dash: nothing was answered.",
        ours.samples, ours.seed
    );
    write_atomically(path, text.as_bytes()).map_err(incomplete)?;
    print(&text);
    Ok(Exit::Held)
}
