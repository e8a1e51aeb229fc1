//! What does the exit code say?

use calibench_harness::ExperimentError;
use std::process::ExitCode;

/// The four ways to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// All held.
    Held = 0,
    /// A number deviates.
    Deviates = 1,
    /// Wrong usage or input.
    Usage = 2,
    /// Interrupted or incomplete.
    Incomplete = 3,
}

impl Exit {
    /// For `--help`.
    pub(super) const HELP: &str = "Exit codes: 0 all held, 1 a number deviates, 2 wrong usage or input, 3 interrupted or incomplete\n(calibench exit-codes says what they mean for every verb)";

    /// The user's input is the user's to mend; anything else left the run incomplete.
    pub fn of_failure(error: &ExperimentError) -> Exit {
        match error {
            ExperimentError::Input(_) => Exit::Usage,
            _ => Exit::Incomplete,
        }
    }

    /// The name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Exit::Held => "held",
            Exit::Deviates => "deviates",
            Exit::Usage => "usage",
            Exit::Incomplete => "incomplete",
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(exit as u8)
    }
}
