//! `calibench gate --detector`: is a detector of calibration boards to be trusted?

use super::super::Exit;
use super::super::program::timeout;
use super::{Arguments, Size, Stop, incomplete, tell, usage};
use calibench_detector_gate::protocol::Kind;
use calibench_detector_gate::{Builtin, Detector, MOST_PHOTOS, Program, QUICK, THOROUGH, run as judge};

/// Judges one detector; without a program that is this library's.
pub(super) fn run(arguments: &Arguments) -> Result<Exit, Stop> {
    let photos = arguments.samples.unwrap_or(match arguments.size {
        Size::Quick => QUICK,
        Size::Thorough => THOROUGH,
    });
    if photos > MOST_PHOTOS {
        return Err(usage(format!("{photos} photographs a scene, and the limit is {MOST_PHOTOS}")));
    }
    let mut detector: Box<dyn Detector> = match &arguments.solver {
        Some(command) => {
            let timeout = timeout(arguments.timeout).map_err(usage)?;
            Box::new(Program::new(command, timeout).map_err(incomplete)?)
        }
        None => Box::new(Builtin),
    };
    let kinds = if arguments.boards.is_empty() { &Kind::ALL[..] } else { &arguments.boards };
    let report = judge(detector.as_mut(), kinds, arguments.seed, photos, arguments.false_alarms)
        .map_err(incomplete)?;
    tell(arguments, &report.to_json(), &report.to_text(), report.trusted)
}

/// A kind of board by its name.
pub(super) fn kind(text: &str) -> Result<Kind, String> {
    let names = || Kind::ALL.map(Kind::name).join(", ");
    Kind::ALL.into_iter().find(|kind| kind.name() == text).ok_or_else(|| format!("expected {}", names()))
}
