//! `calibench gate detector`: is a detector of calibration boards to be trusted?

use super::super::Exit;
use super::options::OwnKind;
use super::{Stop, incomplete};
use calibench_detector_gate::protocol::Kind;
use calibench_detector_gate::{Builtin, Detector, MOST_PHOTOS, Program, QUICK, THOROUGH, run as judge};

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Program to judge, by photographs of known truth (see adapters/DETECTOR-PROTOCOL.md) [default: this
    /// library's detector]
    #[arg(long, value_name = "COMMAND")]
    solver: Option<String>,
    /// Kinds of boards that the detector is asked for: chessboard, circles, asymmetric, hexagonal, charuco,
    /// aprilgrid [default: all]
    #[arg(long, value_name = "KINDS", value_delimiter = ',', value_parser = kind)]
    boards: Vec<Kind>,
    #[command(flatten)]
    own: OwnKind,
}

/// Judges one detector; without a program that is this library's.
pub(super) fn run(arguments: &Arguments) -> Result<Exit, Stop> {
    let OwnKind { amount, false_alarms, told, .. } = &arguments.own;
    let timeout = arguments.own.timeout(arguments.solver.as_deref())?;
    let photos = amount.samples([QUICK, THOROUGH], MOST_PHOTOS)?;
    let mut detector: Box<dyn Detector> = match &arguments.solver {
        Some(command) => Box::new(Program::new(command, timeout).map_err(incomplete)?),
        None => Box::new(Builtin),
    };
    let kinds = if arguments.boards.is_empty() { &Kind::ALL[..] } else { &arguments.boards };
    let report =
        judge(detector.as_mut(), kinds, amount.seed, photos, false_alarms.rate).map_err(incomplete)?;
    Ok(told.tell(&report.to_json(), &report.to_text(), report.trusted))
}

/// A kind of board by its name.
fn kind(text: &str) -> Result<Kind, String> {
    let names = || Kind::ALL.map(Kind::name).join(", ");
    Kind::ALL.into_iter().find(|kind| kind.name() == text).ok_or_else(|| format!("expected {}", names()))
}
