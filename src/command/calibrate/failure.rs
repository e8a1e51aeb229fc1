//! Why does a calibration end without a result?

use super::super::Exit;

/// Why there is no result.
#[derive(Debug)]
pub(super) struct Failure {
    pub exit: Exit,
    pub message: String,
}

/// Input that is the user's to mend.
impl From<String> for Failure {
    fn from(message: String) -> Failure {
        Failure { exit: Exit::Usage, message }
    }
}

impl Failure {
    /// Results that could not be written.
    pub fn unwritten(error: impl ToString) -> Failure {
        Failure { exit: Exit::Incomplete, message: error.to_string() }
    }
}
